"""How a run ends: all ranks together, with one message and one exit code, whatever happened on which rank.

An error may come to all ranks at once (a bad script line), or to one of them while the others wait for it inside
MPI. A failing rank cannot know which; so it knocks, with a barrier that does not block, and when the others do not
come within a second it prints its message and aborts the job.
"""

from __future__ import annotations

import os
import signal
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn

from hpcdem.errors import EXIT_ERROR, EXIT_OK, HpcdemError

GRACE = 1.0
"""Seconds a failing rank waits for the others to fail as well."""
LAST_RESORT = 30
"""Seconds after which a process that hangs on its way out is ended by the system."""


@dataclass(frozen=True)
class Failure:
    """What one rank has to say about its end."""

    code: int
    text: str


def describe(error: BaseException) -> Failure:
    """Message alone for what a user can act on, traceback for what only we can."""
    if isinstance(error, HpcdemError):
        return Failure(error.exit_code, f"hpcdem: {error}")
    if isinstance(error, SystemExit):
        code = error.code if isinstance(error.code, int) else EXIT_OK if error.code is None else EXIT_ERROR
        return Failure(code, error.code if isinstance(error.code, str) else "")
    if isinstance(error, KeyboardInterrupt):
        return Failure(130, "hpcdem: interrupted; nothing was saved")
    return Failure(EXIT_ERROR, "".join(traceback.format_exception(error)).rstrip())


def run_together(comm: Any, work: Callable[[], None]) -> int:
    """Call `work` on every rank and end all ranks together; returns the exit code of the job.

    If only some ranks fail, the lowest of them prints and the job is aborted; this function does not return then.
    """
    failure = None
    knock = comm.mpi.Dup() if comm.mpi is not None else None
    try:
        work()
    except BaseException as error:  # KeyboardInterrupt and SystemExit too: the other ranks must not wait for this one
        failure = describe(error)
        if failure.code == EXIT_OK:
            failure = None
    flush()
    if knock is None:
        return report(failure, 0, 1)
    if not all_arrive(knock, failure):
        assert failure is not None
        report(failure, comm.rank, comm.size)
        comm.abort(failure.code)
    failures = knock.allgather(failure)
    rank, first = next(((r, f) for r, f in enumerate(failures) if f is not None), (0, None))
    # All ranks hold the same message after a collective error; a single rank's error names its rank.
    same = all(f == first for f in failures)
    if comm.rank == 0:
        report(first, rank, 1 if same else comm.size)
    return EXIT_OK if first is None else first.code


def all_arrive(knock: Any, failure: Failure | None) -> bool:
    """Wait for every rank to get here: a failing rank for GRACE seconds, the others as long as it takes.

    The grace grows with the rank, so that of several failing ranks only the lowest comes to print and abort.
    """
    deadline = time.monotonic() + GRACE + 0.2 * min(knock.Get_rank(), 20) if failure is not None else None
    request = knock.Ibarrier()
    while not request.Test():
        if deadline is not None and time.monotonic() > deadline:
            return False
        time.sleep(0.005)
    return True


def report(failure: Failure | None, rank: int, ranks: int) -> int:
    """Print a failure to stderr, with its rank if it is not the failure of all; returns its exit code."""
    if failure is None:
        return EXIT_OK
    if failure.text:
        head = "" if ranks == 1 else f"rank {rank} of {ranks}: "
        sys.stderr.write(f"{head}{failure.text}\n")  # in one piece, or launchers mix it with other ranks' lines
        sys.stderr.flush()
    return failure.code


def flush() -> None:
    """Empty the buffers of stdout and stderr: MPI_Abort would lose them. A closed pipe is no reason to fail."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            pass


def leave(code: int) -> NoReturn:
    """End MPI and the process. After an error MPI may wait for messages that will never come: not for ever."""
    flush()
    if "mpi4py.MPI" in sys.modules:  # HDF5 may have started it too
        from mpi4py import MPI

        if code != EXIT_OK and hasattr(signal, "alarm"):
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.alarm(LAST_RESORT)
        if MPI.Is_initialized() and not MPI.Is_finalized():
            MPI.Finalize()
    if code != EXIT_OK:
        os._exit(code)  # a library whose file was left half written may crash when it tidies up (HDF5 does)
    sys.exit(code)

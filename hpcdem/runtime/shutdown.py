"""End of a run: all ranks stop together, with one message and one exit code, whatever happened on which rank.

An error may come to all ranks at once (a bad script line), or to one of them while the others wait for it inside
MPI. A failing rank cannot know which; so it enters the abort barrier, which does not block, and when the others do not
arrive within a second it prints its message and aborts the job.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NoReturn

from hpcdem.core.chinese import beside
from hpcdem.core.errors import EXIT_ERROR, EXIT_OK, HpcdemError, StoppedWithCheckpoint

if TYPE_CHECKING:
    from hpcdem.core.comm import Comm


EXIT_INTERRUPTED, EXIT_TERMINATED = 130, 143
"""Ended by a second Ctrl-C or SIGTERM: 128 and the number of the signal, as shells have it."""

GRACE = 1.0
"""Seconds a failing rank waits for the others to fail as well."""
EXIT_TIMEOUT = 30
"""Seconds after which a process that hangs on its way out is ended by the system."""


@dataclass(frozen=True)
class Failure:
    """Error of one rank at its end."""

    code: int
    text: str


@dataclass(frozen=True)
class ExitStatus:
    """Final status of the job for this rank: exit code of the job, rank, and (host, process id) of the other ranks."""

    code: int = EXIT_OK
    rank: int = 0
    others: tuple[tuple[str, int], ...] = ()


def describe(error: BaseException) -> Failure:
    """Message alone for what a user can act on, traceback for what only we can."""
    if isinstance(error, (HpcdemError, StoppedWithCheckpoint)):
        return Failure(error.exit_code, beside(f"hpcdem: {error}"))
    if isinstance(error, SystemExit):
        code = error.code if isinstance(error.code, int) else EXIT_OK if error.code is None else EXIT_ERROR
        return Failure(code, error.code if isinstance(error.code, str) else "")
    if isinstance(error, KeyboardInterrupt):
        if error.args == ("SIGTERM",):
            return Failure(EXIT_TERMINATED, "hpcdem: ended by a second SIGTERM; nothing was saved")
        if error.args == ("own loop",):
            message = f"hpcdem: interrupted{_line_of_script(error)} before the next command; nothing was saved"
            return Failure(EXIT_INTERRUPTED, message)
        return Failure(EXIT_INTERRUPTED, "hpcdem: interrupted; nothing was saved")
    return Failure(EXIT_ERROR, "".join(traceback.format_exception(error)).rstrip())


def _line_of_script(error: BaseException) -> str:
    """`in line 4 of script.sc`: where it came to the script or program, "" if it did not."""
    place, trace = "", error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_globals.get("__name__") == "__main__" and trace.tb_frame.f_back is not None:
            place = f" in line {trace.tb_lineno} of {trace.tb_frame.f_code.co_filename}"
        trace = trace.tb_next
    return place


def run_together(comm: Comm, work: Callable[[], None]) -> ExitStatus:
    """Call `work` on every rank and bring all ranks together at its end, with the message of an error printed.

    If only some ranks fail, the lowest of them prints and the job is aborted; this function does not return then.
    """
    channel = private_channel(comm)
    try:
        work()
    except BaseException as error:  # KeyboardInterrupt and SystemExit too: the other ranks must not wait for this one
        return come_together(comm, channel, describe(error))
    return come_together(comm, channel, None)


def private_channel(comm: Comm) -> Any:
    """Collective, at the start of a run: the communicator of the abort barrier, apart from all other messages."""
    return comm.mpi.Dup() if comm.mpi is not None else None


def come_together(comm: Comm, channel: Any, failure: Failure | None) -> ExitStatus:
    """The end of a run on this rank; see `run_together`. channel: of `private_channel`."""
    if failure is not None and failure.code == EXIT_OK:
        failure = None
    flush()
    if channel is None:
        return ExitStatus(report(failure, 0, 1))
    if not all_arrive(channel, failure):
        assert failure is not None
        report(failure, comm.rank, comm.size)
        comm.abort(failure.code)
    ranks = channel.allgather((failure, socket.gethostname(), os.getpid()))
    failures = [failure for failure, *_ in ranks]
    rank, first = next(((r, f) for r, f in enumerate(failures) if f is not None), (0, None))
    # All ranks hold the same message after a collective error; a single rank's error names its rank.
    same = all(f == first for f in failures)
    if comm.rank == 0:
        report(first, rank, 1 if same else comm.size)
    others = tuple((host, pid) for r, (_, host, pid) in enumerate(ranks) if r != comm.rank)
    return ExitStatus(EXIT_OK if first is None else first.code, comm.rank, others)


def all_arrive(channel: Any, failure: Failure | None) -> bool:
    """The abort barrier: a failing rank waits GRACE seconds for all others to get here, the others as long as it takes.

    The grace grows with the rank, so that of several failing ranks only the lowest comes to print and abort.
    """
    deadline = time.monotonic() + GRACE + 0.2 * min(channel.Get_rank(), 20) if failure is not None else None
    request = channel.Ibarrier()
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
        with contextlib.suppress(OSError):  # a full disk under it changes no exit code
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


def leave(end: ExitStatus) -> NoReturn:
    """End MPI and the process.

    The exit code of a failed job is rank 0's, and it leaves last: launchers kill what still runs when a process
    leaves with an error, and may then report the kill instead of the code.
    """
    sys.exit(end_mpi(end))  # not os._exit: MPICH says goodbye to its launcher in an exit handler


def end_mpi(end: ExitStatus) -> int:
    """End MPI and return the exit code of this process: that of the job on rank 0, which waits for the others."""
    flush()
    if "mpi4py.MPI" in sys.modules:  # HDF5 may have started it too
        from mpi4py import MPI

        # After an error MPI may wait for messages that will never come: not for ever.
        if end.code != EXIT_OK and hasattr(signal, "alarm"):
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.alarm(EXIT_TIMEOUT)
        if "petsc4py.PETSc" in sys.modules:  # at the exit of Python, after MPI, its end would be an error
            sys.modules["petsc4py.PETSc"]._finalize()
        if MPI.Is_initialized() and not MPI.Is_finalized():
            MPI.Finalize()
    if end.rank > 0:
        return EXIT_OK
    wait_for_end_of(end.others if end.code != EXIT_OK else ())
    return end.code


def wait_for_end_of(others: tuple[tuple[str, int], ...]) -> None:
    """Wait until the processes (host, pid) of this host are gone, which a busy machine lets take long; give those
    elsewhere half a second."""
    here = socket.gethostname()
    if any(host != here for host, _ in others) or not os.path.isdir("/proc/self"):
        time.sleep(0.5)
    deadline = time.monotonic() + EXIT_TIMEOUT
    while any(host == here and runs(pid) for host, pid in others) and time.monotonic() < deadline:
        time.sleep(0.01)


def runs(pid: int) -> bool:
    """Return whether a process exists and is not a zombie."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False

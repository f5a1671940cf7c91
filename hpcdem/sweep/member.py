"""One member of a sweep, from its folder to its end: what the driver starts, and each task of a Slurm array.

The run inherits the lock of the folder. So the folder stays locked while ranks live, even if this process is killed,
and whoever comes later knows that the member runs.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

from hpcdem.core.errors import EXIT_CHECKPOINT, EXIT_ERROR, EXIT_OK, UsageError
from hpcdem.io.lock import FolderLock, Taken
from hpcdem.sweep.plan import DONE, FAILED, LOG, STATE, STOPPED, Member, Plan, read_json, write_json


def launcher(ranks: int, threads: int) -> list[str]:
    """The words that start this number of ranks: srun in a job of Slurm (on cores of their own, so that several
    members run side by side), else the mpiexec beside this Python, or in PATH."""
    if "SLURM_JOB_ID" in os.environ:
        return ["srun", "--exact", "-n", str(ranks), "-c", str(threads)]
    if ranks == 1:
        return []
    beside = Path(sys.executable).parent / "mpiexec"
    found = str(beside) if beside.exists() else shutil.which("mpiexec")
    if found is None:
        raise UsageError(f"--ranks {ranks}: mpiexec not found. Install the extra [mpi] or an MPI of the system")
    return [found, "-n", str(ranks)]


def command(plan: Plan, again: bool) -> list[str]:
    """The command started in the folder of a member. again: it was started before and resumes if it can."""
    words = [sys.executable, "-m", "hpcdem", "-j", str(plan.threads), "--no-figure"]
    return [
        *launcher(plan.ranks, plan.threads),
        *words,
        *(["--resume"] if again and plan.kind != "python" else []),
        plan.script,
    ]


def _locked(plan: Plan, member: Member) -> FolderLock:
    """The lock of its folder. UsageError if it runs already. A process that only inspects the folder holds the lock
    briefly, so a failed attempt is repeated once.
    """
    for _ in range(3):
        try:
            return FolderLock(member.folder, {"host": socket.gethostname(), "pid": os.getpid()})
        except Taken:
            time.sleep(0.1)
    raise UsageError(f"member {member.name} of {plan.folder} is already running")


def run(plan: Plan, member: Member) -> int:
    """Carry it out; returns the exit code of the run. UsageError if it runs already. A signal to this process that
    ends programs makes the run save and stop."""
    lock = _locked(plan, member)
    before = read_json(member.folder / STATE, {"state": "", "tries": 0, "seconds": 0.0})
    if before["state"] == DONE:
        lock.release()
        return EXIT_OK
    again = bool(before["tries"])
    tries, began = int(before["tries"]) + 1, time.monotonic()
    state = {"state": FAILED, "code": None, "tries": tries, "seconds": before["seconds"]}
    write_json(member.folder / STATE, state)  # what a killed run leaves: it counts as failed and resumes when started
    with open(member.folder / LOG, "ab") as log:
        begin = log.tell()
        process = subprocess.Popen(
            command(plan, again), cwd=member.folder, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT,
            pass_fds=lock.descriptors, start_new_session=True,
        )  # fmt: skip
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGUSR1):
            # mpiexec of either MPI hands on SIGUSR1, which makes hpcdem save and stop.
            signal.signal(number, lambda *_: process.send_signal(signal.SIGUSR1))
        code: int | None = process.wait()
        wrote = os.fstat(log.fileno()).st_size > begin
    if code == EXIT_OK and not wrote:
        code = None  # a run names itself; srun has been seen to end with 0 without having started anything
    state["code"] = code
    state["state"] = DONE if code == EXIT_OK else STOPPED if code == EXIT_CHECKPOINT else FAILED
    state["seconds"] = round(state["seconds"] + time.monotonic() - began, 3)
    write_json(member.folder / STATE, state)
    lock.release()
    return EXIT_ERROR if code is None else code

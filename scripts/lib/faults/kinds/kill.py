"""Processes that are killed: the system's last word, to which no program can answer."""

from __future__ import annotations

import signal
from functools import partial

from faults.case import Case
from faults.kind import kind
from faults.model import files
from faults.runs import Job


@kind("kill a rank", "kill -9 of one rank at a random moment; the job ends", least=1)
def one(case: Case) -> None:
    job = case.start()
    if case.moment(job):
        pids = job.rank_pids()
        if pids:
            job.signal(case.rng.choice(pids), signal.SIGKILL)
    case.end(job, quiet=job.ranks > 1)


@kind("kill all ranks", "kill -9 of all ranks at once at a random moment", least=2)
def everyone(case: Case) -> None:
    job = case.start()
    if case.moment(job):
        for pid in job.rank_pids():
            job.signal(pid, signal.SIGKILL)
    case.end(job, quiet=True)


@kind("kill the launcher", "kill -9 of mpiexec; the ranks end, or complete the run", least=2)
def launcher(case: Case) -> None:
    job = case.start()
    if case.moment(job):
        job.signal(job.process.pid, signal.SIGKILL)
    case.end(job, quiet=True)


def _being_written(case: Case, suffix: str) -> bool:
    try:
        return any(name.endswith(suffix + ".tmp") for name in files(case.data))
    except OSError:
        return False


def _kill(job: Job) -> None:
    for pid in job.rank_pids() or [job.process.pid]:
        job.signal(pid, signal.SIGKILL)


def _while_writing(case: Case, suffix: str) -> None:
    """When the temporary file is seen in the folder; a few of them are let through."""
    job = case.start()
    for _ in range(case.rng.randint(0, 6)):
        case.until(partial(_being_written, case, suffix), job, 0.0005)
        case.moments.clear()
        case.until(lambda: not _being_written(case, suffix), job, 0.0005)
        case.moments.clear()
    if case.until(partial(_being_written, case, suffix), job, 0.0002):
        _kill(job)
    case.end(job, quiet=job.ranks > 1)


@kind("kill while .sav.tmp is there", "kill -9 of all ranks when the temporary file of a checkpoint appears")
def seen_checkpoint(case: Case) -> None:
    _while_writing(case, ".sav")


@kind("kill while .vtkhdf.tmp is there", "the same with a frame")
def seen_frame(case: Case) -> None:
    _while_writing(case, case.rng.choice((".vtkhdf", ".dat")))


def strike(case: Case, call: str, suffix: str, how: str) -> Job:
    """A run in which a random one of these calls is the last of rank 0, or fails, or stops the process."""
    calls = case.world.reference.calls.get(f"{call} {suffix}", 0)
    left = 1.0 - min(case.reached() / case.model.last, 0.9)
    nth = case.rng.randint(1, max(1, int(calls * left)))
    plan = {"call": call, "suffix": suffix, "nth": nth, "part": case.rng.random(), "how": how}
    return case.start({"strike": plan})


def _in_call(case: Case, call: str, suffix: str) -> None:
    job = strike(case, call, suffix, "SIGKILL")
    end = case.end(job, quiet=job.ranks > 1)
    if end.code != 0:
        case.moments.append(case.reached())


@kind("kill in a write of a checkpoint", "rank 0 writes a part of the bytes of a call, then kill -9")
def writing_checkpoint(case: Case) -> None:
    _in_call(case, "pwritev", ".sav")


@kind("kill in a write of a frame", "the same with .vtkhdf and .dat")
def writing_frame(case: Case) -> None:
    _in_call(case, "pwritev", case.rng.choice((".vtkhdf", ".dat")))


@kind("kill at flush or rename", "kill -9 before or after the fsync or the rename of a file")
def renaming(case: Case) -> None:
    _in_call(case, case.rng.choice(("fsync", "replace")), case.rng.choice((".sav", ".vtkhdf", ".dat")))


@kind("kill in a row of a series", "rank 0 writes a part of a row of walls.csv or hist_1.dat, then kill -9")
def writing_row(case: Case) -> None:
    _in_call(case, "append", case.rng.choice((".csv", ".dat")))


@kind(
    "stop in a write, then kill", "rank 0 stops itself within a write (SIGSTOP); some time later it is killed", most=1
)
def stopped(case: Case) -> None:
    job = strike(case, "pwritev", case.rng.choice((".sav", ".vtkhdf", ".dat")), "SIGSTOP")

    def waiting() -> bool:
        try:
            with open(f"/proc/{job.process.pid}/stat") as file:
                return file.read().rpartition(")")[2].split()[0] in "TZ"
        except OSError:
            return True

    if case.until(waiting, job):
        if case.rng.random() < 0.3:
            job.signal(job.process.pid, signal.SIGCONT)  # or goes on after all
        else:
            job.signal(job.process.pid, signal.SIGKILL)
    case.end(job)

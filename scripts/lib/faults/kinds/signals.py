"""Signals that can be answered: stop, save, wait; and runs that hang when they come."""

from __future__ import annotations

import signal
import time

from faults.case import DONE, STOPPED, Case
from faults.kind import kind
from faults.runs import Job

ASKED = "resume with"


def _to_ranks(case: Case, job: Job, number: int) -> None:
    pids = job.rank_pids()
    for pid in pids if case.rng.random() < 0.5 else [case.rng.choice(pids)] if pids else []:
        job.signal(pid, number)


def _stop(case: Case, number: int) -> None:
    """Before the model is made there is nothing to be saved, and the signal does what it always does."""
    job = case.start()
    at_work = case.moment(job, begins=False)
    if at_work:
        _to_ranks(case, job, number)
    case.end(job, {DONE, STOPPED} if at_work else {DONE}, ASKED)


@kind("SIGTERM", "sent to one rank or all: a checkpoint is written, exit code 85")
def sigterm(case: Case) -> None:
    _stop(case, signal.SIGTERM)


@kind("SIGUSR1", "the same")
def sigusr1(case: Case) -> None:
    _stop(case, signal.SIGUSR1)


@kind("SIGINT", "the same")
def sigint(case: Case) -> None:
    _stop(case, signal.SIGINT)


@kind("SIGUSR2", "sent to one rank or all: a checkpoint is written, and the run continues to completion")
def sigusr2(case: Case) -> None:
    job = case.start()
    if case.moment(job, begins=False):
        _to_ranks(case, job, signal.SIGUSR2)
    case.end(job, {DONE})


@kind("SIGINT twice", "sent to all ranks: the job ends at once without saving")
def twice(case: Case) -> None:
    job = case.start()
    if case.moment(job, begins=False):
        for _ in range(2):
            for pid in job.rank_pids():
                job.signal(pid, signal.SIGINT)
            time.sleep(case.rng.uniform(0.001, 0.02))
    case.end(job, quiet=job.ranks > 1)


@kind(
    "signal to the launcher",
    "SIGTERM, SIGINT, SIGUSR1 or SIGUSR2 is sent to mpiexec, which may forward it or end the job",
    least=2,
)
def launcher(case: Case) -> None:
    job = case.start()
    number = case.rng.choice((signal.SIGTERM, signal.SIGINT, signal.SIGUSR1, signal.SIGUSR2))
    if case.moment(job, begins=False):
        job.signal(job.process.pid, number)
    case.end(job, quiet=True)


@kind("SIGTERM twice while ranks hang", "one rank is stopped (SIGSTOP), so the others wait in MPI and cannot "
      "respond to a SIGTERM; another SIGTERM ends the job with a message", least=2)  # fmt: skip
def hanging(case: Case) -> None:
    job = case.start()
    if case.moment(job, begins=False):
        pids = job.rank_pids()
        stopped = case.rng.choice(pids) if len(pids) == job.ranks else None
        if stopped is not None:
            job.signal(stopped, signal.SIGSTOP)
            time.sleep(0.5)
            for _ in range(
                3
            ):  # the third is for a rank that was inside a slow disk when the first came, and saw it late
                for pid in pids:
                    if pid != stopped and not job.ended():
                        job.signal(pid, signal.SIGTERM)
                time.sleep(2.5)
    began = time.monotonic()
    end = case.end(job, quiet=True)
    if end.code == STOPPED or (end.code != DONE and "SIGTERM" not in end.said):
        case.problem("no word about another SIGTERM", end)
    if time.monotonic() - began > 20.0:
        case.problem("took 20 s to end", end)


@kind("suspended", "all ranks are stopped for a while (SIGSTOP, SIGCONT), as when a queue suspends a job: the run "
      "continues")  # fmt: skip
def suspended(case: Case) -> None:
    job = case.start()
    if case.moment(job, begins=False):
        pids = job.rank_pids()
        for number in (signal.SIGSTOP, signal.SIGCONT):
            for pid in pids:
                job.signal(pid, number)
            time.sleep(case.rng.uniform(0.0, 1.0))
    case.end(job, {DONE})


@kind("--time-limit", "a random limit: a checkpoint is written in time, exit code 85")
def limit(case: Case) -> None:
    seconds = case.rng.uniform(1.5, 4.0)
    began = time.monotonic()
    job = case.start(options=["--time-limit", f"{seconds:.2f}"])
    end = case.end(job, {DONE, STOPPED}, ASKED)
    if end.code == STOPPED:
        case.moments.append(0)
        # The clock of the limit begins when MPI does; a second and a half is for starting and ending processes.
        if time.monotonic() - began > seconds + 6.0:
            case.problem(f"a limit of {seconds:.1f} s, ended after {time.monotonic() - began:.1f} s", end)

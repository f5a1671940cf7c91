"""A wall clock that jumps."""

from __future__ import annotations

import os
import signal
import time

from faults.case import DONE, STOPPED, Case
from faults.kind import kind


def _jumps(case: Case) -> list[list[float]]:
    return [[case.rng.uniform(0.0, 3.0), case.rng.uniform(-20.0, 20.0) * 3600.0] for _ in range(case.rng.randint(1, 4))]


@kind("clock jumps, with a limit", "the wall clock of the process jumps by hours, back and forth; a distant time "
      "limit does not stop the run, a near one does")  # fmt: skip
def jumping(case: Case) -> None:
    near = case.rng.random() < 0.5
    began = time.monotonic()
    job = case.start({"clock": _jumps(case)}, ["--time-limit", "2.5" if near else "15:00"])
    end = case.end(job, {DONE, STOPPED} if near else {DONE}, "resume with")
    case.moments.append(0)
    if time.monotonic() - began > (2.5 + 8.0 if near else 60.0):
        case.problem("the time limit was not kept", end)


@kind("clock of the disk jumps", "after kill -9 the checkpoints get random modification times; the run resumes "
      "from the largest step, not from the latest time")  # fmt: skip
def times(case: Case) -> None:
    job = case.start()
    if case.moment(job, 1000, begins=False):
        for pid in job.rank_pids():
            job.signal(pid, signal.SIGKILL)
    case.end(job, quiet=job.ranks > 1)
    now = time.time()
    for path in sorted(case.data.glob("*.sav")):
        then = now + case.rng.uniform(-1e6, 1e5)
        os.utime(path, (then, then))

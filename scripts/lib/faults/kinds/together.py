"""Other programs in the same folder: a second run, an older run, readers that lock files."""

from __future__ import annotations

import fcntl
import os
import shutil
import signal

from faults import judge, runs
from faults.case import DONE, USAGE, Case
from faults.kind import kind
from faults.model import files


@kind("two runs in one folder", "a second run is started while the first one writes: the second is refused and "
      "the first continues, or the first is killed and leaves no lock behind", most=2)  # fmt: skip
def two(case: Case) -> None:
    job = case.start(ranks=1)
    case.until(lambda: case.reached() > 0, job)
    if not job.ended():
        job.signal(job.process.pid, signal.SIGSTOP)  # so that it cannot come to its end before
        case.moments.append(case.reached())
        words = [str(case.script), "--outdir", str(case.data)]
        second = runs.start(words, case.next_ranks(), case.folder, name="second")
        case.jobs.insert(0, second)
        end = second.end()
        if end.code != USAGE or "another run" not in end.said:
            case.problem(f"the second run was not refused: exit code {end.code}", end)
        case.refused = True
        if case.rng.random() < 0.5:
            job.signal(job.process.pid, signal.SIGKILL)
        job.signal(job.process.pid, signal.SIGCONT)
    case.end(job, {DONE, -signal.SIGKILL})


@kind("a new run in an old folder", "the folder contains later checkpoints and frames of another script; the run "
      "is killed and resumes from its own checkpoint")  # fmt: skip
def old_folder(case: Case) -> None:
    if case.data.exists():
        raise AssertionError("must be the first fault of a case")
    shutil.copytree(case.world.other.data, case.data)
    mine = set(case.world.reference.names)
    case.spoiled |= set(files(case.data)) - mine
    strangers = {path.name: path.stat().st_mtime_ns for path in case.data.glob("*.sav")}
    job = runs.start([str(case.script)], case.next_ranks(), case.folder, name="log0")
    case.jobs.append(job)

    def own() -> list[str]:
        found = []
        for path in case.data.glob("*.sav"):
            try:
                if path.stat().st_mtime_ns != strangers.get(path.name):
                    found.append(path.name)
            except OSError:
                continue
        return found

    number = case.rng.randint(1, 12)
    if case.until(lambda: len(own()) >= number, job, 0.005):
        for pid in job.rank_pids():
            job.signal(pid, signal.SIGKILL)
    job.end()
    left = set(strangers) - set(own())
    case.spoiled |= {name for name in files(case.data) if name in left or not name.endswith(".sav")}
    case.end(case.start(), {DONE})
    # Everything of this run was written again by now, so it is looked at like that of any other.
    case.spoiled -= mine


@kind("locks of HDF5", "HDF5_USE_FILE_LOCKING TRUE, FALSE or BEST_EFFORT, and another program that holds a lock on the "
      "newest checkpoint while the run resumes from it or skips it", most=1)  # fmt: skip
def locks(case: Case) -> None:
    how = case.rng.choice(("TRUE", "FALSE", "BEST_EFFORT"))
    job = case.start(HDF5_USE_FILE_LOCKING=how)
    if case.moment(job, 500, begins=False):
        job.signal(job.process.pid, signal.SIGKILL)
    case.end(job)
    found = judge.in_order(case.data)
    if not found:
        return
    handle = os.open(found[-1], os.O_RDWR)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        job = case.start(HDF5_USE_FILE_LOCKING=how)
        if how != "FALSE":
            case._expected = None  # it may be passed over
        case.end(job, {DONE})
    finally:
        os.close(handle)

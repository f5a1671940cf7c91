"""Disks that are full, go away, or refuse."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import time

from faults import judge
from faults.case import DONE, FAILED, Case, Skipped
from faults.kind import kind
from faults.kinds.kill import strike
from faults.runs import Job

CANNOT = r"cannot (write|make|read)"
FULL = "no space left on the disk"


class SmallDisk:
    """A file system in memory under the output folder of a case, with a size that can be changed."""

    def __init__(self, case: Case) -> None:
        self.folder = case.data
        if self.mounted():
            self.size("64m")
            return
        if case.data.exists():
            before = case.folder / "before"
            case.data.rename(before)
        self.folder.mkdir()
        self._mount("size=64m")
        case.cleanup.append(self.unmount)
        if (case.folder / "before").exists():
            shutil.copytree(case.folder / "before", self.folder, dirs_exist_ok=True)
            shutil.rmtree(case.folder / "before")

    def mounted(self) -> bool:
        return os.path.ismount(self.folder)

    def size(self, size: str) -> bool:
        """Change it; False if that is less than is in use."""
        return self._mount(f"remount,rw,size={size}", must=False)

    def used(self) -> int:
        found = os.statvfs(self.folder)
        return (found.f_blocks - found.f_bfree) * found.f_frsize

    def readonly(self) -> bool:
        """Nothing can be written any more; a file that is just being written delays it."""
        for _ in range(300):
            if self._mount("remount,ro", must=False):
                return True
            time.sleep(0.003)
        return False

    def writable(self) -> None:
        self._mount("remount,rw")

    def unmount(self) -> None:
        subprocess.run(["umount", "-l", str(self.folder)], capture_output=True, check=False)

    def _mount(self, options: str, must: bool = True) -> bool:
        command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(self.folder)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
        except OSError as error:
            raise Skipped(f"nothing can be mounted here: {error}") from None
        if done.returncode and must:
            raise Skipped(f"nothing can be mounted here: {done.stderr.strip()}")
        return done.returncode == 0


@kind("disk full", "during the run the disk of the output folder is reduced until a random number of bytes is "
      "free; the run ends with a message, and resumes when there is space again")  # fmt: skip
def full(case: Case) -> None:
    disk = SmallDisk(case)
    job = case.start()
    if case.moment(job, begins=False):
        left = case.rng.choice((0, 0, 4, 8, 16, 40, 100, 200)) * 1024
        for _ in range(20):
            if disk.size(str(disk.used() + left + 4096)):
                break
    case.end(job, {FAILED, DONE}, FULL)
    disk.size("64m")


@kind("disk full from the beginning", "the disk has a random size from the beginning")
def small(case: Case) -> None:
    disk = SmallDisk(case)
    disk.size(str(disk.used() + case.rng.randint(1, 400) * 4096))
    job = case.start()
    end = case.end(job, {FAILED, DONE}, FULL)
    if end.code:
        case.moments.append(case.reached())
    disk.size("64m")


@kind(
    "limit on the size of files",
    "ulimit -f, as a quota: a random limit from 1 KiB to the size of the largest file",
    most=1,
)
def quota(case: Case) -> None:
    largest = max((case.world.reference.data / name).stat().st_size for name in case.world.reference.names)
    job = case.start(limit=case.rng.randint(1, max(2, largest // 1024)), ranks=1)
    end = case.end(job, {FAILED, DONE}, "exceed the allowed size")
    if end.code:
        case.moments.append(case.reached())


@kind(
    "disk error",
    "a write, flush, rename or row fails with EIO, ENOSPC, EDQUOT or EROFS, once; the run ends with a message",
)
def error(case: Case) -> None:
    call = case.rng.choice(("pwritev", "fsync", "replace", "append"))
    suffix = case.rng.choice((".csv", ".dat") if call == "append" else (".sav", ".vtkhdf", ".dat"))
    job = strike(case, call, suffix, case.rng.choice(("EIO", "ENOSPC", "EDQUOT", "EROFS")))
    end = case.end(job, {FAILED, DONE}, CANNOT)
    if end.code:
        case.moments.append(case.reached())


@kind("disk becomes read-only", "the file system is remounted read-only during the run; the run ends with a message")
def readonly(case: Case) -> None:
    disk = SmallDisk(case)
    job = case.start()
    if case.moment(job, begins=False):
        disk.readonly()
    case.end(job, {FAILED, DONE}, "read-only|" + CANNOT)
    disk.writable()


@kind(
    "output folder renamed",
    "the output folder is renamed during the run, and gets its name back afterwards; the run ends with a message",
)
def renamed(case: Case) -> None:
    job = case.start()
    away = case.folder / "away"
    if case.moment(job, begins=False):
        case.data.rename(away)
    case.gone = True
    case.end(job, {FAILED, DONE}, CANNOT)
    case.gone = False
    if away.exists():
        if case.data.exists():
            shutil.rmtree(case.data)
        away.rename(case.data)


@kind("output folder removed", "the output folder is removed during the run; the run ends with a message, and the "
      "next run starts from the beginning")  # fmt: skip
def removed(case: Case) -> None:
    job = case.start()
    if case.moment(job, begins=False):
        for _ in range(50):  # the run may just be making a file in it
            shutil.rmtree(case.data, ignore_errors=True)
            if not case.data.exists():
                break
    case.gone = True
    case.end(job, {FAILED, DONE}, CANNOT)
    shutil.rmtree(case.data, ignore_errors=True)


@kind("a folder in the place of a file", "a folder has the name of a later frame, checkpoint or series, or of its "
      "temporary file; the run ends with a message, and resumes when the folder has been removed")  # fmt: skip
def folder(case: Case) -> None:
    job = case.start()
    if not case.until(lambda: case.reached() > 0, job):
        case.end(job, {DONE})
        return
    now = max(case.reached(), (judge.newest(case.data) or 0) + case.model.ahead)
    later = [
        name
        for name in case.world.reference.names
        if name.endswith((".sav", ".vtkhdf", ".dat")) and not judge.is_series(name) and "auto_" not in name
        and now + 600 < _step(name) + (0 if name.startswith("sand/") else case.model.ahead) <= case.model.last
    ]  # fmt: skip
    if not later:
        case.end(job, {DONE})
        return
    name = case.rng.choice(later) + case.rng.choice(("", ".tmp"))
    _replaced(case, job, name)


def _step(name: str) -> int:
    """The step in the name of a frame or checkpoint."""
    return int(re.findall(r"\d{10}", name)[-1])


def _replaced(case: Case, job: Job, name: str) -> None:
    place = case.data / name
    try:
        place.mkdir()
    except OSError:  # the run was faster
        case.end(job, {DONE})
        return
    case.spoiled.add(name)
    end = case.end(job, {FAILED, DONE}, "a folder with this name exists|" + CANNOT)
    if end.code == DONE:
        case.problem(f"{name} is a folder, and the run did not notice", end)
    place.rmdir()
    case.spoiled.discard(name)

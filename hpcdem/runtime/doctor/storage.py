"""File systems: where results and temporary files go, and whether what a run does there works."""

from __future__ import annotations

import errno
import fcntl
import os
import shutil
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from hpcdem.runtime.doctor.findings import Finding, ok, problem, size, warning
from hpcdem.runtime.doctor.mounts import Mount, existing, mount_of
from hpcdem.runtime.doctor.scene import Disk, Scene

TOPIC = "results"
ELSEWHERE = "--outdir DIR on another file system"
LITTLE, VERY_LITTLE = 1 << 30, 64 << 20
"""Free bytes below which a run is at risk, and below which it cannot begin."""
FEW_FILES = 1000
SLOW = 0.5
"""Seconds for a MiB to be safe on the disk from which on checkpoints are felt."""
SKEW = 5.0
"""Seconds by which two clocks may differ."""


def free_space(scene: Scene) -> Iterator[Finding]:
    """Room for results: bytes and files."""
    yield from _room(scene, TOPIC, scene.directory, ELSEWHERE)


def _room(scene: Scene, topic: str, path: Path, cure: str) -> Iterator[Finding]:
    folder = existing(path)
    try:
        found = scene.disk.statvfs(folder)
    except OSError as failure:
        yield problem(topic, f"{folder}: {failure.strerror}", cure)
        return
    free = found.f_bavail * found.f_frsize
    if not found.f_blocks:  # a file system that does not say
        pass
    elif free < VERY_LITTLE:
        yield problem(topic, f"{size(free)} free in {folder}", cure)
    elif free < LITTLE:
        yield warning(topic, f"only {size(free)} free in {folder}", cure)
    if found.f_files and found.f_favail < FEW_FILES:  # some file systems do not count them
        yield warning(topic, f"room for only {found.f_favail} more files (inodes) in {folder}", cure)


def kind(scene: Scene) -> Iterator[Finding]:
    """On what the results will be."""
    mount = mount_of(existing(scene.directory), scene.mountinfo)
    if mount is None:
        return
    if mount.read_only:
        yield problem(TOPIC, f"{mount.point} is mounted read-only ({_name(mount)})", ELSEWHERE)
    elif mount.in_memory:
        yield warning(
            TOPIC,
            f"{existing(scene.directory)} is in memory ({_name(mount)}): what is there is lost at the next start of "
            "the machine, and counts as memory of the run",
            "--outdir DIR on a disk",
        )


def locking_of_hdf5(scene: Scene) -> Iterator[Finding]:
    """HDF5's own locks fail or block on many network file systems; hpcdem switches them off unless told otherwise."""
    given = scene.environ.get("HDF5_USE_FILE_LOCKING", "FALSE").upper()
    mount = mount_of(existing(scene.directory), scene.mountinfo)
    if given not in ("FALSE", "0") and mount is not None and mount.network:
        yield warning(
            "HDF5",
            f"HDF5_USE_FILE_LOCKING={given}, and the results are on a network file system ({_name(mount)}), where "
            "locks may fail or block",
            "export HDF5_USE_FILE_LOCKING=FALSE",
        )


def results(scene: Scene) -> Iterator[Finding]:
    """Try in the folder of the results what a run does there."""
    yield from _tried(scene, TOPIC, scene.directory, ELSEWHERE)
    yield from _quota(scene)


def temporary(scene: Scene) -> Iterator[Finding]:
    """The same in the folder for temporary files."""
    folder = scene.temporary if scene.temporary is not None else Path(tempfile.gettempdir())
    yield from _room(scene, "temporary", folder, "export TMPDIR=DIR on another file system")
    yield from _tried(scene, "temporary", folder, "export TMPDIR=DIR on another file system")


def _tried(scene: Scene, topic: str, path: Path, cure: str) -> Iterator[Finding]:
    folder = existing(path)
    mount = mount_of(folder, scene.mountinfo)
    on = f"{folder} ({_name(mount)})" if mount is not None else str(folder)
    found = Trial(scene.disk).run(folder, scene.now)
    if found.failed:
        yield problem(topic, f"{on}: {found.failed}", cure)
        return
    free = scene.disk.statvfs(folder)
    text = f"{on}: {size(free.f_bavail * free.f_frsize)} free, 1 MiB is safe in {1000.0 * found.seconds:.2g} ms"
    if found.seconds > SLOW:
        yield warning(topic, f"{text}: checkpoints will wait for the disk", cure)
    else:
        yield ok(topic, text)
    if found.unlocked:
        yield warning(
            topic,
            f"{folder}: locks of files do not work ({found.unlocked}), so two runs in one folder cannot be told apart",
            "Mount with locks (NFS: lockd; Lustre: -o flock), or start one run per folder",
        )
    if abs(found.skew) > SKEW:
        yield warning(
            "clock",
            f"files made in {folder} now carry a time {abs(found.skew):.0f} s in the "
            f"{'future' if found.skew > 0 else 'past'}: the clocks of file server and host differ",
            "timedatectl set-ntp true",
        )


def _name(mount: Mount) -> str:
    return f"{mount.kind}, network" if mount.network else mount.kind


@dataclass
class Trial:
    """What a run asks of a folder, tried in a folder of its own there that is removed again.

    failed: what does not work at all; unlocked: how locks fail; seconds: for a MiB to be on the disk; skew: time of a
    new file less the time here [s].
    """

    disk: Disk
    failed: str = ""
    unlocked: str = ""
    seconds: float = 0.0
    skew: float = 0.0
    _doing: str = field(default="", repr=False)

    def run(self, folder: Path, now: Callable[[], float]) -> Trial:
        """Try; says what happened in its attributes and raises nothing."""
        try:
            self._doing = "make a folder"
            scratch = Path(tempfile.mkdtemp(prefix=".hpcdem-doctor-", dir=folder))
        except OSError as failure:
            self.failed = f"cannot {self._doing}: {failure.strerror or failure}"
            return self
        try:
            self._files(scratch, now)
        except OSError as failure:
            self.failed = f"cannot {self._doing}: {failure.strerror or failure}"
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
        return self

    def _files(self, scratch: Path, now: Callable[[], float]) -> None:
        block, taken = bytes(1 << 20), []
        temporary, final = scratch / "file.tmp", scratch / "file"
        for _ in range(3):
            self._doing = "write a file"
            with open(temporary, "wb") as file:
                file.write(block)
                file.flush()
                began = time.perf_counter()
                self._doing = "bring a file to the disk (fsync)"
                self.disk.fsync(file.fileno())
                taken.append(time.perf_counter() - began)
            self._doing = "rename a file"
            self.disk.replace(temporary, final)  # the second time over the file of the first
        self.seconds = statistics.median(taken)
        self.skew = final.stat().st_mtime - now()
        self._doing = "read a file back"
        if final.read_bytes() != block:
            raise OSError(errno.EIO, "it is not what was written")
        self._locks(final)

    def _locks(self, path: Path) -> None:
        wanted = fcntl.LOCK_EX | fcntl.LOCK_NB
        with open(path, "r+b") as first, open(path, "r+b") as second:
            try:
                self.disk.lockf(first, wanted)
                self.disk.lockf(first, fcntl.LOCK_UN)
                self.disk.flock(first, wanted)
            except OSError as failure:
                self.unlocked = failure.strerror or str(failure)
                return
            try:
                self.disk.flock(second, wanted)
            except OSError:
                return
            self.unlocked = "two can have the same lock"


def _quota(scene: Scene) -> Iterator[Finding]:
    """What the program quota says, where there is one: lines with a * behind a number that is over its limit."""
    if scene.which("quota") is None:
        return
    code, said, _ = scene.run(["quota", "-w"])
    over = [line.split() for line in said.splitlines() if "*" in line]
    if code and over:
        said = f"the quota on {over[0][0]} is used up: {' '.join(over[0][1:4])} (used, quota, limit in KiB)"
        yield warning(TOPIC, said, "quota -s")


def future_files(scene: Scene) -> Iterator[Finding]:
    """Results that carry a time to come: what asks for the newest file will be misled."""
    most = 5000
    now, names = scene.now(), []
    try:
        with os.scandir(scene.directory) as entries:
            for number, entry in enumerate(entries):
                if number >= most:
                    break
                if entry.is_file() and entry.stat().st_mtime > now + 60.0:
                    names.append(entry.name)
    except OSError:
        return
    if names:
        yield warning(
            "clock",
            f"{len(names)} files in {scene.directory} carry a time in the future ({min(names)}): the clock of this or "
            "of another host is or was wrong",
            f"timedatectl; then touch {scene.directory}/{min(names)}",
        )

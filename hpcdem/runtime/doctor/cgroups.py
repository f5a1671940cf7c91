"""What a control group (of a container or a job) allows; version 1 and 2, see cgroups(7)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePosixPath

from hpcdem.runtime.doctor.mounts import unescaped
from hpcdem.runtime.doctor.scene import Scene

NO_LIMIT = 1 << 60
"""Version 1 writes a number like 2^63 where there is no limit."""


def cpu_quota(scene: Scene) -> float | None:
    """Processor time per time [cores]; None without a quota."""
    found = []
    for folder, version in _folders(scene, "cpu"):
        if version == 2:
            words = scene.read(folder, "cpu.max").split()
        else:
            words = [scene.read(folder, name).strip() for name in ("cpu.cfs_quota_us", "cpu.cfs_period_us")]
        if len(words) == 2 and all(word.isdigit() for word in words) and int(words[1]) > 0:  # else "max" or -1
            found.append(int(words[0]) / int(words[1]))
    return min(found, default=None)


def memory(scene: Scene) -> int | None:
    """The limit of memory [bytes]; None without one."""
    found = []
    for folder, version in _folders(scene, "memory"):
        word = scene.read(folder, "memory.max" if version == 2 else "memory.limit_in_bytes").strip()
        if word.isdigit() and int(word) < NO_LIMIT:
            found.append(int(word))
    return min(found, default=None)


def _folders(scene: Scene, controller: str) -> Iterator[tuple[str, int]]:
    """The folders of this process's group and of all that it is part of, with the version: each may set a limit."""
    for line in scene.read("proc/self/cgroup").splitlines():
        _, _, rest = line.partition(":")
        controllers, _, path = rest.partition(":")
        version = 2 if not controllers else 1
        if version == 1 and controller not in controllers.split(","):
            continue
        for inner, point in _mounts(scene, version, controller):
            relative = PurePosixPath(path).relative_to(inner) if PurePosixPath(path).is_relative_to(inner) else "."
            group = PurePosixPath("/", relative)
            for folder in (group, *group.parents):
                yield point + str(folder), version


def _mounts(scene: Scene, version: int, controller: str) -> Iterator[tuple[str, str]]:
    """Where the tree of a controller is mounted, and which part of it."""
    for line in scene.mountinfo.splitlines():
        before, _, after = line.partition(" - ")
        fields, kind = before.split(), after.split()
        if len(fields) < 5 or len(kind) < 3:
            continue
        if (version == 2 and kind[0] == "cgroup2") or (kind[0] == "cgroup" and controller in kind[2].split(",")):
            yield unescaped(fields[3]), unescaped(fields[4])

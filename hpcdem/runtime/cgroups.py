"""Read the limits of a control group (of a container or a job); versions 1 and 2, where systemd mounts them, see
cgroups(7).

root: where proc and sys are.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path


def cpu_quota(root: Path) -> float | None:
    """Processor time per time [cores]; None without a quota."""
    found = []
    for group in _groups(root, "cpu"):
        v1 = f"{read(group / 'cpu.cfs_quota_us')} {read(group / 'cpu.cfs_period_us')}"
        words = (read(group / "cpu.max") or v1).split()
        if len(words) == 2 and all(word.isdigit() for word in words) and int(words[1]):  # else "max" or -1
            found.append(int(words[0]) / int(words[1]))
    return min(found, default=None)


def memory(root: Path) -> int | None:
    """The limit of memory [bytes]; None without one."""
    groups = _groups(root, "memory")
    words = [(read(group / "memory.max") or read(group / "memory.limit_in_bytes")).strip() for group in groups]
    return min((int(word) for word in words if word.isdigit() and int(word) < 1 << 60), default=None)  # 2^63: none


def free_memory(root: Path) -> int | None:
    """Return the memory that processes of this host can still take, and their control group allows [bytes]; None:
    nobody knows."""
    free = re.search(r"^MemAvailable:\s+(\d+)", read(root / "proc/meminfo"), re.MULTILINE)
    found = [limit for limit in (memory(root), int(free[1]) * 1024 if free else None) if limit is not None]
    return min(found, default=None)


def read(path: Path) -> str:
    """The text of a file; empty without one."""
    try:
        return path.read_text(errors="replace")
    except OSError:
        return ""


def _groups(root: Path, controller: str) -> Iterator[Path]:
    """The folders of this process's group and of all around it: each may set a limit.

    A container may see its own group as the top of the tree; folders above that are not there and have no files.
    """
    top = root / "sys/fs/cgroup"
    for line in read(root / "proc/self/cgroup").splitlines():
        controllers, _, path = line.partition(":")[2].partition(":")
        if not controllers or controller in controllers.split(","):
            for tree in (top / controller, top / controllers) if controllers else (top, top / "unified"):
                group = tree / path.lstrip("/")
                yield from (folder for folder in (group, *group.parents) if folder.is_relative_to(tree))

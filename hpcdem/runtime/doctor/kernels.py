"""The cache of compiled kernels, and what threads run on."""

from __future__ import annotations

import grp
import os
import pwd
import stat
from collections.abc import Iterator
from pathlib import Path

from hpcdem.runtime import launch
from hpcdem.runtime.doctor.findings import Finding, ok, size, warning
from hpcdem.runtime.doctor.mounts import existing, mount_of
from hpcdem.runtime.doctor.scene import Scene
from hpcdem.runtime.warmup import cache_base, cache_folder, temporary_base

TOPIC = "kernels"


def not_ours_alone(scene: Scene) -> Iterator[Finding]:
    """numba executes what it finds in its cache: whoever can write there can do what we can."""
    base = cache_base(scene.environ)
    try:
        found = base.stat()
    except OSError:
        return
    if found.st_uid not in (os.getuid(), 0):
        yield warning(
            TOPIC,
            f"the kernel cache {base} belongs to {_user(found.st_uid)}, and compiled code is executed as it is found",
            "export NUMBA_CACHE_DIR=DIR of your own",
        )
    elif found.st_mode & stat.S_IWOTH or (found.st_mode & stat.S_IWGRP and not _private(found.st_gid)):
        who = "everyone" if found.st_mode & stat.S_IWOTH else "your group"
        ours = found.st_uid == os.getuid() and not found.st_mode & stat.S_ISVTX  # else it is a folder like /tmp
        yield warning(
            TOPIC,
            f"the kernel cache {base} can be written by {who}, and compiled code is executed as it is found",
            f"chmod go-w {base}" if ours else "export NUMBA_CACHE_DIR=DIR of your own",
        )


def _user(number: int) -> str:
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return f"user {number}"


def _private(group: int) -> bool:
    """Whether it is the group that many systems give each user for himself, or root's."""
    try:
        return group == 0 or grp.getgrgid(group).gr_name == pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        return False


def cache(scene: Scene) -> Iterator[Finding]:
    """Where the kernels are kept and whether they are there."""
    base, (folder, writable) = cache_base(scene.environ), cache_folder(scene.environ)
    if not writable:
        yield warning(
            TOPIC,
            f"the kernel cache {base} cannot be written; {temporary_base()} is used, which is empty after a restart",
            "export NUMBA_CACHE_DIR=DIR of your own",
        )
    mount = mount_of(existing(base), scene.mountinfo)
    kind = "" if mount is None else f" ({mount.kind}{', network' if mount.network else ''})"
    if mount is not None and mount.network and len(scene.hosts) > 1:
        yield warning(
            TOPIC,
            f"the kernel cache {base} is on a network file system{kind}: {len(scene.hosts)} hosts will read it at once",
            "export NUMBA_CACHE_DIR=/tmp/hpcdem-kernels-$UID (see slurm/many_nodes.sh)",
        )
    kernels, amount = _contents(folder)
    _, in_all = _contents(base)
    if kernels:
        yield ok(TOPIC, f"{folder}{kind}: {kernels} entries, {size(amount)}; all versions {size(in_all)}")
    else:
        yield ok(TOPIC, f"{base}{kind}: no kernels of this version for this processor yet", "hpcdem warmup")


def _contents(folder: Path) -> tuple[int, int]:
    """Compiled kernels in a folder, and bytes of all files."""
    kernels = amount = 0
    for path, _, files in os.walk(folder):
        for name in files:
            try:
                amount += os.stat(os.path.join(path, name)).st_size
            except OSError:  # removed meanwhile
                continue
            kernels += name.endswith(".nbc")
    return kernels, amount


def threads(scene: Scene) -> Iterator[Finding]:
    """The library under numba's threads."""
    layer = scene.environ.get("NUMBA_THREADING_LAYER", "omp")
    if layer not in ("omp", "workqueue"):
        yield warning(
            "threads",
            f"NUMBA_THREADING_LAYER={layer}: starting threads takes far longer than with OpenMP",
            "unset NUMBA_THREADING_LAYER",
        )
    elif not launch.openmp_runtime_found():
        yield warning(
            "threads", "libgomp.so.1 (OpenMP) cannot be loaded: one thread per rank only", "apt-get install libgomp1"
        )
    else:
        yield ok("threads", f"libgomp.so.1 found, {scene.places[scene.rank].threads} thread(s) per rank asked for")

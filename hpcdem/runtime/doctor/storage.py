"""File systems: where results, temporary files and compiled kernels go, and whether what a run does there works."""

from __future__ import annotations

import grp
import os
import pwd
import re
import shutil
import stat
import tempfile
import time
from pathlib import Path

from hpcdem.io.disk import explain, publish
from hpcdem.io.lock import FolderLock, Taken
from hpcdem.runtime import cgroups
from hpcdem.runtime.doctor.machine import CLOCK_SKEW, MIB, Findings, Machine, ok, problem, size, warning
from hpcdem.runtime.kept import cache_base, store_of, temporary_base

NETWORK = frozenset(
    "nfs nfs4 cifs smb3 smbfs ncpfs afs ceph 9p lustre gpfs mmfs beegfs pvfs2 orangefs panfs wekafs gfs2 ocfs2 "
    "glusterfs acfs stornext virtiofs vboxsf drvfs".split()
)
"""File systems that other hosts can see, or that work over a network."""
LOCAL_FUSE = frozenset("fuseblk fuse.fuse-overlayfs fuse.squashfuse fuse.ntfs-3g fuse.gocryptfs fuse.bindfs".split())
RESULTS, TEMPORARY = "--outdir DIR on another file system", "export TMPDIR=DIR on another file system"
OWN_CACHE = "export NUMBA_CACHE_DIR=DIR of your own"
LITTLE, VERY_LITTLE, FEW_FILES = 1024 * MIB, 64 * MIB, 1000
"""Free bytes below which a run is at risk, and below which it cannot begin; free files below which it is at risk."""
SLOW, SOON = 0.5, 5.0
"""Seconds for a MiB to be safe on the disk from which on checkpoints are felt, and until a new file is seen by all."""


def kind_of(path: Path, mountinfo: str) -> str:
    """Return the kernel's name of the file system of a path, from its mount table (see proc(5)); "" if it is
    unknown."""
    real, best = f"{os.path.realpath(path)}/", ("", "")
    for found in re.finditer(r"^(?:\S+ ){4}(\S+) \S.*? - (\S+)", mountinfo, re.MULTILINE):
        point = re.sub(r"\\([0-7]{3})", lambda code: chr(int(code[1], 8)), found[1])  # a blank is \040
        point = f"{point.rstrip('/')}/"
        if real.startswith(point) and len(point) >= len(best[0]):  # a later one of the same name hides the earlier
            best = point, found[2]
    return best[1]


def is_network(kind: str) -> bool:
    """Return whether a file system is a network file system. FUSE hides many of them: all but the local ones count."""
    return kind in NETWORK or (kind.startswith("fuse") and kind not in LOCAL_FUSE)


def existing(path: Path) -> Path:
    """The path, or the nearest folder above it that exists."""
    path = path.absolute()
    return next((folder for folder in (path, *path.parents) if folder.is_dir()), path)


def _where(machine: Machine, path: Path) -> tuple[str, str]:
    """Kind of file system under the nearest folder that exists, and both as text: `/home/me (nfs4, network)`."""
    kind = kind_of(existing(path), cgroups.read(machine.root / "proc/self/mountinfo"))
    return kind, f"{existing(path)} ({kind or 'unknown'}{', network' * is_network(kind)})"


def free_space(machine: Machine) -> Findings:
    """Room for results: bytes and files."""
    yield from _space("results", machine.directory, RESULTS)


def results(machine: Machine) -> Findings:
    """Try in the folder of the results what a run does there."""
    yield from _trial(machine, "results", machine.directory, RESULTS)


def temporary(machine: Machine) -> Findings:
    """Check space and file operations in the folder for temporary files."""
    yield from _space("temporary", Path(tempfile.gettempdir()), TEMPORARY)
    yield from _trial(machine, "temporary", Path(tempfile.gettempdir()), TEMPORARY)


def _space(topic: str, path: Path, cure: str) -> Findings:
    folder = existing(path)
    try:
        found = os.statvfs(folder)
    except OSError as failure:
        yield problem(topic, f"{folder}: {failure.strerror}", cure)
        return
    free = found.f_bavail * found.f_frsize
    if found.f_blocks and free < LITTLE:  # some file systems do not say
        finding = problem if free < VERY_LITTLE else warning
        yield finding(topic, f"only {size(free)} free in {folder}", cure)
    if found.f_files and found.f_favail < FEW_FILES:  # some do not count them
        yield warning(topic, f"space for only {found.f_favail} more files (inodes) in {folder}", cure)


def _trial(machine: Machine, topic: str, path: Path, cure: str) -> Findings:
    """Try the file operations of a run in a temporary folder inside `path`."""
    folder, doing, taken = existing(path), "make a folder in", []
    name = _where(machine, folder)[1]
    try:
        with tempfile.TemporaryDirectory(prefix=".hpcdem-doctor-", dir=folder, ignore_cleanup_errors=True) as scratch:
            doing, final = "write a file in", f"{scratch}/file"
            for _ in range(3):  # the second time over the file of the first
                Path(f"{final}.tmp").write_bytes(bytes(MIB))
                began = time.perf_counter()
                publish(f"{final}.tmp", final)
                taken.append(time.perf_counter() - began)
            skew, doing = os.stat(final).st_mtime - time.time(), "lock a file in"
            locks = _locks_work(Path(scratch))
    except OSError as failure:
        yield problem(topic, explain(name, failure, doing), cure)
        return
    median = sorted(taken)[1]
    text = f"{name}: {size(shutil.disk_usage(folder).free)} free, 1 MiB is safe in {1000.0 * median:.2g} ms"
    if median > SLOW:
        yield warning(topic, f"{text}: checkpoints will wait for the disk", cure)
    else:
        yield ok(topic, text)
    if not locks:
        text = f"{folder}: file locks do not work, so two runs in one folder cannot be detected"
        yield warning(topic, text, "Mount with locks (NFS: lockd; Lustre: -o flock), or start one run per folder")
    if abs(skew) > CLOCK_SKEW:
        text = f"new files in {folder} have a time {abs(skew):.0f} s in the {'future' if skew > 0 else 'past'}"
        yield warning("clock", f"{text}: the clocks of file server and host differ", "timedatectl set-ntp true")


def _locks_work(folder: Path) -> bool:
    """Return whether a folder can be locked exclusively."""
    lock = FolderLock(folder, {})
    try:
        FolderLock(folder, {}).release()
        return False
    except Taken:
        return lock.works
    finally:
        lock.release()


def shared(machine: Machine) -> Findings:
    """Check that this host sees a file that rank 0 wrote among the results; wait some seconds for caches to expire."""
    end = time.monotonic() + SOON
    while not (seen := machine.token.exists()) and len(machine.hosts) > 1 and time.monotonic() < end:
        time.sleep(0.1)
    if not seen and len(machine.hosts) > 1:
        text = f"a file made by rank 0 in {machine.token.parent} is not visible here: another file system is mounted"
        yield problem("results", text, "--outdir DIR on a file system shared by all hosts")


def quota(machine: Machine) -> Findings:
    """Report exceeded quotas from the program quota, if it is installed: it marks a number over its limit by a *."""
    code, out, _ = machine.run(["quota", "-w"])
    over = next((line.split() for line in out.splitlines() if "*" in line), None)
    if code and over:
        text = f"the quota on {over[0]} is used up: {' '.join(over[1:4])} (used, quota, limit in KiB)"
        yield warning("results", text, "quota -s")


def in_memory(machine: Machine) -> Findings:
    """Results that are not on a disk."""
    kind, name = _where(machine, machine.directory)
    if kind in ("tmpfs", "ramfs", "devtmpfs"):
        text = f"{name} is in memory: its files are lost on restart and count as memory of the run"
        yield warning("results", text, "--outdir DIR on a disk")


def hdf5_locks(machine: Machine) -> Findings:
    """HDF5's own locks fail or block on many network file systems; hpcdem switches them off unless told otherwise."""
    given = machine.environ.get("HDF5_USE_FILE_LOCKING", "FALSE").upper()
    kind, name = _where(machine, machine.directory) if given not in ("FALSE", "0") else ("", "")
    if is_network(kind):
        text = f"HDF5_USE_FILE_LOCKING={given}, and locks may fail or block in {name}"
        yield warning("HDF5", text, "export HDF5_USE_FILE_LOCKING=FALSE")


def cache_owner(machine: Machine) -> Findings:
    """numba executes what it finds in its cache: whoever can write there can do what we can."""
    base = cache_base(machine.environ)
    if not base.exists():
        return
    found = base.stat()
    ours, who = found.st_uid == os.getuid(), ""
    if found.st_uid not in (os.getuid(), 0):
        who = f"belongs to user {found.st_uid}"
    elif found.st_mode & stat.S_IWOTH:
        who = "can be written by everyone"
    elif found.st_mode & stat.S_IWGRP and not _private(found.st_gid):
        who = "can be written by your group"
    if who:
        cure = f"chmod go-w {base}" if ours and not found.st_mode & stat.S_ISVTX else OWN_CACHE  # sticky: as /tmp
        yield warning(
            "kernels", f"the kernel cache {base} {who}, and compiled code in it is executed without checks", cure
        )


def _private(group: int) -> bool:
    """Return whether the group is the user's private group, which many systems create, or root's."""
    try:
        return group == 0 or grp.getgrgid(group).gr_name == pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        return False


def cache(machine: Machine) -> Findings:
    """Check the kernel store: its location, and whether the kernels are present."""
    base, (folder, writable), hosts = cache_base(machine.environ), store_of(machine.environ), len(machine.hosts)
    kind, name = _where(machine, base)
    if not writable:
        text = f"the kernel cache {base} cannot be written; {temporary_base()} is used, which is empty after a restart"
        yield warning("kernels", text, OWN_CACHE)
    if is_network(kind) and hosts > 1:
        cure = "export NUMBA_CACHE_DIR=/tmp/hpcdem-kernels-$UID (see slurm/many_nodes.sh)"
        yield warning("kernels", f"the kernel cache is on {name}: {hosts} hosts will read it at once", cure)
    kernels = sum(file.endswith(".nbc") for _, _, files in os.walk(folder) for file in files)
    if kernels:
        yield ok("kernels", f"{_where(machine, folder)[1]}: {kernels} entries")
    else:
        yield ok("kernels", f"{base}: no kernels of this version for this processor yet", "hpcdem warmup")

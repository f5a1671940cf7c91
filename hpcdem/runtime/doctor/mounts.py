"""Which file system a path is on, by the kernel's table of mounts."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

NETWORK = frozenset(
    "nfs nfs4 cifs smb3 smbfs ncpfs afs ceph 9p lustre gpfs mmfs beegfs pvfs2 orangefs panfs wekafs gfs2 ocfs2 "
    "glusterfs acfs stornext virtiofs vboxsf drvfs".split()
)
"""File systems that other hosts can see, or that are asked over a wire."""
IN_MEMORY = frozenset(("tmpfs", "ramfs", "devtmpfs"))


@dataclass(frozen=True)
class Mount:
    """point: where it is mounted; kind: as the kernel calls it; source: disk or server."""

    point: str
    kind: str
    source: str
    read_only: bool = False

    @property
    def network(self) -> bool:
        """Whether it is asked over a network. FUSE hides many of them: all but the local ones count."""
        if self.kind.startswith("fuse"):
            return self.kind.partition(".")[2] not in ("fuse-overlayfs", "squashfuse", "ntfs-3g", "gocryptfs", "bindfs")
        return self.kind in NETWORK

    @property
    def in_memory(self) -> bool:
        """Whether its files are gone with the machine's next start."""
        return self.kind in IN_MEMORY


def unescaped(text: str) -> str:
    """Blanks and the like are written as octal numbers there."""
    return re.sub(r"\\([0-7]{3})", lambda found: chr(int(found[1], 8)), text)


def mount_of(path: Path, mountinfo: str) -> Mount | None:
    """The mount that a path is on; None where the table does not tell."""
    real = os.path.realpath(path)
    best: Mount | None = None
    for line in mountinfo.splitlines():
        before, _, after = line.partition(" - ")
        fields, kind = before.split(), after.split()
        if len(fields) < 6 or len(kind) < 2:
            continue
        point = unescaped(fields[4])
        inside = real == point or real.startswith(point.rstrip("/") + "/")
        if inside and (best is None or len(point) >= len(best.point)):  # a later one of the same name hides the earlier
            read_only = "ro" in fields[5].split(",") or "ro" in (kind[2].split(",") if len(kind) > 2 else ())
            best = Mount(point, kind[0], unescaped(kind[1]), read_only)
    return best


def existing(path: Path) -> Path:
    """The path, or the nearest folder above it that exists."""
    path = path.absolute()
    while not path.is_dir() and path != path.parent:
        path = path.parent
    return path

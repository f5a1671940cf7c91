"""Which frames a folder holds, and reading one, whatever its format."""

from __future__ import annotations

import os
import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from hpcdem.errors import HpcdemError
from hpcdem.io.frame import Frame

FORMATS = ("vtkhdf", "dat")
"""Formats that can be read, the preferred one first."""

_NAME = re.compile(r"all_(\d+)(_ini)?\.(\w+)")
_MESH_NAME = re.compile(r"(.+)_(\d{10,})\.vtkhdf")


@dataclass(frozen=True)
class FrameFile:
    """A frame on disk; `ini` marks the state before the first cycle of a CYC or IMPLE."""

    path: Path
    step: int
    ini: bool


def frame_name(step: int, suffix: str, ini: bool = False, stem: str = "all") -> str:
    """``all_0000046000.vtkhdf``, ``all_0000046000_ini.dat``, ``wall_0000046000.vtk``."""
    return f"{stem}_{step:010d}{'_ini' if ini else ''}.{suffix.removeprefix('.')}"


def list_frames(folder: str | os.PathLike) -> list[FrameFile]:
    """The frames in a folder in the order of time: by step, the `_ini` one after the other of the same step, since it
    shows what was done between two commands.

    Where a frame is there in several formats, the first of FORMATS is taken. Raises HpcdemError if the folder
    cannot be read.
    """
    try:
        names = os.listdir(folder)
    except OSError as failure:
        raise HpcdemError(f"cannot read the folder {os.fspath(folder)}: {failure.strerror}") from None
    best: dict[tuple[int, bool], tuple[int, str]] = {}
    for name in sorted(names):
        found = _NAME.fullmatch(name)
        if found and found[3] in FORMATS:
            key = int(found[1]), found[2] is not None
            best[key] = min(best.get(key, (len(FORMATS), "")), (FORMATS.index(found[3]), name))
    return [FrameFile(Path(folder) / name, step, ini) for (step, ini), (_, name) in sorted(best.items())]


def list_mesh_frames(folder: str | os.PathLike, stem: str | None = None) -> list[FrameFile]:
    """The frames of blocks in a folder, `<stem>_<step>.vtkhdf`, in the order of steps; without a stem those of the name
    that most of them have. Raises HpcdemError if the folder cannot be read, or has none of this name."""
    from hpcdem.io.vtkhdf_mesh import is_mesh_frame

    try:
        names = os.listdir(folder)
    except OSError as failure:
        raise HpcdemError(f"cannot read the folder {os.fspath(folder)}: {failure.strerror}") from None
    found: dict[str, list[FrameFile]] = {}
    for name in sorted(names):
        parts = _MESH_NAME.fullmatch(name)
        if parts and (stem is None or parts[1] == stem) and is_mesh_frame(Path(folder) / name):
            found.setdefault(parts[1], []).append(FrameFile(Path(folder) / name, int(parts[2]), False))
    if stem is not None and not found:
        raise HpcdemError(f"no frame {stem}_*.vtkhdf of blocks in {os.fspath(folder)}")
    most = max(found, key=lambda name: len(found[name]), default=None)
    return sorted(found[most], key=lambda file: file.step) if most is not None else []


def read_frame(path: str | os.PathLike, tables: Collection[str] | None = None) -> Frame:
    """The frame in a file, by its suffix; see `read_vtkhdf` and `read_dat`. Serial. Raises HpcdemError."""
    suffix = Path(path).suffix
    if suffix == ".vtkhdf":
        from hpcdem.io.vtkhdf import read_vtkhdf

        return read_vtkhdf(path, tables)
    if suffix == ".dat":
        from hpcdem.io.dat import read_dat

        return read_dat(path, tables)
    raise HpcdemError(f"cannot read {os.fspath(path)}: frames end in .vtkhdf or .dat")

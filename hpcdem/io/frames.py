"""List the frames of a folder and read one of any format."""

from __future__ import annotations

import functools
import os
import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from hpcdem.core.errors import HpcdemError
from hpcdem.io.frame import Frame
from hpcdem.io.run_record import Record, is_earlier_frame, read

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
    """The frames in a folder in the order of time: by step, the `_ini` one after that of the same step, since it shows
    what was done between two commands. Frames of an earlier run, according to run.json, are ignored; `left_out`
    describes them.

    Where a frame is there in several formats, the first of FORMATS is taken. Raises HpcdemError if the folder cannot be
    read.
    """
    best: dict[tuple[int, bool], tuple[int, str]] = {}
    for name in _names(folder)[0]:
        found = _NAME.fullmatch(name)
        if found and found[3] in FORMATS:
            key = int(found[1]), found[2] is not None
            best[key] = min(best.get(key, (len(FORMATS), "")), (FORMATS.index(found[3]), name))
    return [FrameFile(Path(folder) / name, step, ini) for (step, ini), (_, name) in sorted(best.items())]


def list_mesh_frames(folder: str | os.PathLike, stem: str | None = None) -> list[FrameFile]:
    """The frames of blocks in a folder, `<stem>_<step>.vtkhdf`, in the order of steps; without a stem those of the name
    that most of them have. Those of an earlier run do not count, as in `list_frames`. Raises HpcdemError if the folder
    cannot be read, or has none of this name."""
    found = mesh_frames_by_name(folder, stem)
    if stem is not None and not found:
        raise HpcdemError(f"no frame {stem}_*.vtkhdf of blocks in {os.fspath(folder)}")
    most = max(found, key=lambda name: len(found[name]), default=None)
    return found[most] if most is not None else []


def mesh_frames_by_name(folder: str | os.PathLike, stem: str | None = None) -> dict[str, list[FrameFile]]:
    """Mesh frames of all names, or of one. Raises HpcdemError if the folder cannot be read."""
    found: dict[str, list[FrameFile]] = {}
    for name in _names(folder)[0]:
        parts = _MESH_NAME.fullmatch(name)
        if parts and (stem is None or parts[1] == stem) and _of_blocks(Path(folder) / name):
            found.setdefault(parts[1], []).append(FrameFile(Path(folder) / name, int(parts[2]), False))
    return {name: sorted(files, key=lambda file: file.step) for name, files in found.items()}


def _of_blocks(path: Path) -> bool:
    try:
        return _known(path, path.stat().st_mtime_ns)
    except OSError:  # gone in the meantime
        return False


@functools.lru_cache(maxsize=1 << 14)
def _known(path: Path, changed: int) -> bool:
    """Return whether a file is a frame of blocks: those who follow a run ask every second."""
    from hpcdem.io.vtkhdf_mesh import is_mesh_frame

    return is_mesh_frame(path)


def left_out(folder: str | os.PathLike) -> str:
    """Warning about frames that an earlier run has left in a folder, or "". Raises
    HpcdemError if the folder cannot be read."""
    earlier = _names(folder)[1]
    if not earlier:
        return ""
    steps = sorted(int(name.partition(".")[0].removesuffix("_ini").rpartition("_")[2]) for name in earlier)
    which = f"of step {steps[0]}" if steps[0] == steps[-1] else f"of steps {steps[0]} to {steps[-1]}"
    count = len({name.rpartition(".")[0] for name in earlier})
    return (
        f"{count} frame{'s' if count > 1 else ''} {which} in {os.fspath(folder)} are from an earlier run and "
        "ignored. To use them together, copy them into a separate folder"
    )


def earlier_stems(folder: str | os.PathLike) -> frozenset[str]:
    """Names, without suffix, of frames that an earlier run has left in a folder, and this one not written again. Raises
    HpcdemError if the folder cannot be read."""
    names, earlier = _names(folder)
    return frozenset(Path(name).stem for name in earlier) - {
        Path(name).stem for name in names if name.endswith(FORMATS)
    }


def _names(folder: str | os.PathLike) -> tuple[list[str], list[str]]:
    """Sorted names of the files in a folder without the frames of an earlier run, and these."""
    try:
        names = sorted(os.listdir(folder))
    except OSError as failure:
        raise HpcdemError(f"cannot read the folder {os.fspath(folder)}: {failure.strerror}") from None
    record: Record | None = None
    try:
        record = read(Path(folder))
    except HpcdemError:
        pass  # `hpcdem info` tells that run.json is damaged; all frames count then
    earlier = [name for name in names if is_earlier_frame(Path(folder) / name, record)]
    gone = set(earlier)
    return [name for name in names if name not in gone], earlier


def read_frame(path: str | os.PathLike, tables: Collection[str] | None = None, periodic: bool = True) -> Frame:
    """The frame in a file, by its suffix; see `read_vtkhdf` and `read_dat`. Serial. Raises HpcdemError; also for a
    frame of a model with periodic sides if these are not supported."""
    suffix = Path(path).suffix
    if suffix == ".vtkhdf":
        from hpcdem.io.vtkhdf import read_vtkhdf

        frame = read_vtkhdf(path, tables)
    elif suffix == ".dat":
        from hpcdem.io.dat import read_dat

        frame = read_dat(path, tables)
    else:
        raise HpcdemError(f"cannot read {os.fspath(path)}: frames end in .vtkhdf or .dat")
    if "period" in frame.settings and not periodic:
        raise HpcdemError(
            f"{os.fspath(path)}: the sides of this model are periodic (PERIODIC), which stress and strain of sections "
            "do not support; use hpcdem measure, the command stress, HIST, or the columns x and laps of the frames"
        )
    return frame

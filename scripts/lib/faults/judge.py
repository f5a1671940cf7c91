"""What must hold after a fault: files under their final names are whole, what was there is there, the end is the same.

The undisturbed run is the measure. Since every run writes the same files, a frame or a checkpoint is whole if it is
that of the undisturbed run; one that was written on request, at a step of its own, if its checksums are right.
"""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any

os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")

import h5py
import numpy as np

from faults.model import PARTICLES, Model, Reference, files
from hpcdem.core.errors import HpcdemError
from hpcdem.io import checkpoint

FRAMES = (".vtkhdf", ".dat", ".vtk", ".ps")
APART = ("run", "resumed", "began")
"""Words of a checkpoint's state that tell one run from another."""


def final_names(data: Path) -> set[str]:
    """Frames and checkpoints that a folder holds, by their names below it."""
    return {name for name in files(data) if name.endswith((".sav", *FRAMES)) and not is_series(name)}


def is_series(name: str) -> bool:
    """Whether a file grows row by row, or is made of such."""
    return Path(name).name.startswith(("hist_", "history_"))


def contents(path: Path) -> dict[str, bytes]:
    """All datasets and attributes of an HDF5 file; of the state of a checkpoint, what two equal runs share."""
    if path.suffix == ".sav":
        checkpoint.read(path)  # its checksums come first: HDF5 believes what it reads
    found: dict[str, bytes] = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            found[name] = np.asarray(item[()]).tobytes()
        for key, value in item.attrs.items():
            if path.suffix == ".sav" and key in ("state", "crc"):
                continue
            found[f"{name}@{key}"] = value.encode() if isinstance(value, str) else np.asarray(value).tobytes()

    with h5py.File(path, "r") as file:
        visit("", file)
        file.visititems(visit)
        if "state" in file.attrs and path.suffix == ".sav":
            state = json.loads(str(file.attrs["state"]))
            found["state"] = json.dumps({k: v for k, v in state.items() if k not in APART}).encode()
    return found


def same(one: Path, other: Path) -> str:
    """Empty, or in what two files of one name differ."""
    if one.read_bytes() == other.read_bytes():
        return ""
    if one.suffix not in (".vtkhdf", ".sav"):
        return "bytes differ"
    try:
        a, b = contents(one), contents(other)
    except (OSError, ValueError, KeyError, RuntimeError, HpcdemError) as problem:
        return f"cannot be read: {problem}"
    odd = sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))
    return f"differs in {', '.join(odd[:5])}" if odd else ""


def broken(data: Path, reference: Reference, spoiled: set[str]) -> list[str]:
    """Files with a final name that are not whole; spoiled: those that were damaged on purpose, or are strangers."""
    found = []
    for name in sorted(final_names(data) - spoiled):
        path, original = data / name, reference.data / name
        if path.is_dir():
            continue
        if original.exists():
            if why := same(path, original):
                found.append(f"{name}: {why}")
        elif path.suffix == ".sav":
            try:
                checkpoint.read(path)
            except HpcdemError as problem:
                found.append(str(problem))
        else:
            found.append(f"{name}: a frame that the undisturbed run does not have")
    return found


def other_end(data: Path, reference: Reference, spoiled: set[str]) -> list[str]:
    """In what a folder differs from that of the undisturbed run. Checkpoints may be missing, everything else not."""
    found = broken(data, reference, spoiled)
    for name in reference.names:
        path = data / name
        if name.endswith((".sav", *FRAMES)) and path.exists():
            continue  # compared already
        if not path.exists():
            found += [] if name.endswith(".sav") else [f"{name} is missing"]
        elif path.read_bytes() != (reference.data / name).read_bytes():
            found.append(f"{name}: bytes differ")
    return found


def newest(data: Path, spoiled: set[str] = frozenset()) -> int | None:  # type: ignore[assignment]
    """Step of the last checkpoint that is whole; None without one."""
    steps = []
    for path in sorted(data.glob("*.sav")):
        if path.name not in spoiled:
            try:
                steps.append(int(checkpoint.read(path)[0]["clock"]["step"]))
            except (HpcdemError, OSError):
                continue
    return max(steps, default=None)


def in_order(data: Path) -> list[Path]:
    """The checkpoints of a folder by their steps."""
    return sorted(data.glob("*.sav"), key=lambda path: (re.sub(r"\D", "", path.name), path.name))


def reached(data: Path, model: Model = PARTICLES) -> int:
    """The last step that the row of a series tells of."""
    try:
        with open(data / model.series, "rb") as file:
            file.seek(max(0, os.fstat(file.fileno()).st_size - 400))
            lines = file.read().split(b"\n")
    except OSError:
        return 0
    for line in reversed(lines[:-1]):  # the last one may be on its way
        step = line.partition(b",")[0]
        if step.isdigit():
            return int(step)
    return 0

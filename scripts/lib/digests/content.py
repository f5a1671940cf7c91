"""What a run wrote, as fingerprints: of every dataset of HDF5 files, of the text of all others."""

from __future__ import annotations

import hashlib
from pathlib import Path

import h5py
import numpy as np

Digests = dict[str, dict[str, str]]
"""Of each file (its path in the folder): fingerprints by dataset; of text files one, named "text"."""

HDF5 = (".vtkhdf", ".sav")
TEXT = (".dat", ".csv", ".vtk", ".ps", ".txt")
VERSION = b"version"
"""Lines of text files that hold it are left out."""


def of_folder(folder: Path) -> Digests:
    """Fingerprints of all results below a folder. Pictures and run.json are no results of the computation."""
    files = sorted(path for path in folder.rglob("*") if path.suffix in (*HDF5, *TEXT))
    return {str(path.relative_to(folder)): of_file(path) for path in files}


def of_file(path: Path) -> dict[str, str]:
    """Fingerprints of one file."""
    if path.suffix in TEXT:
        lines = (line for line in path.read_bytes().splitlines() if VERSION not in line)
        return {"text": _short(b"\n".join(lines))}
    found: dict[str, str] = {}

    def visit(name: str, item: h5py.Group | h5py.Dataset) -> None:
        if isinstance(item, h5py.Dataset):
            values = np.asarray(item[()])
            found[name] = _short(f"{values.dtype.str}{values.shape}".encode() + values.tobytes())

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


def _short(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def differences(before: Digests, after: Digests) -> tuple[list[str], list[str]]:
    """What is another, and what is on one side only ("- " before, "+ " after), as `file: dataset`."""
    a, b = ({f"{file}: {name}": digest for file, part in one.items() for name, digest in part.items()}
            for one in (before, after))  # fmt: skip
    other = sorted(name for name in a.keys() & b.keys() if a[name] != b[name])
    apart = [f"- {name}" for name in a.keys() - b.keys()] + [f"+ {name}" for name in b.keys() - a.keys()]
    return other, sorted(apart)

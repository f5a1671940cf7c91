"""Contents of a mesh file, under the numbers of the file, before they become a mesh of the model.

Readers (`abaqus.py`, `gmsh_file.py`, `imported.py` for what meshio reads) make a `FileMesh`; `imported.py` makes a mesh
of it.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from hpcdem.core.errors import HpcdemError

CORNERS = {"vertex": 1, "line": 2, "triangle": 3, "quad": 4, "tetra": 4, "hexahedron": 8}
"""Number of corners of the elements that are read; others can only be refused or omitted."""
DIMENSIONS = {"vertex": 0, "line": 1, "triangle": 2, "quad": 2, "tetra": 3, "hexahedron": 3}
IN_WORDS = {
    "vertex": "points", "line": "lines", "triangle": "triangles", "quad": "quads", "tetra": "tetrahedra",
    "hexahedron": "hexahedra", "wedge": "wedges (prisms)", "pyramid": "pyramids",
}  # fmt: skip


@dataclass
class Block:
    """Elements of one kind: `kind` of meshio's names without the number of points, rows (n, k) of points (corners
    first), numbers (n,) in the file, label as the file calls the kind."""

    kind: str
    rows: np.ndarray
    ids: np.ndarray
    label: str


@dataclass
class FileMesh:
    """Contents of a mesh file. points (n, 3): in units of the file; point_ids (n,): their numbers in it; blocks; sets
    by name: of elements (counted over all blocks), of points (rows) and of faces (each (m, 1 to 4) corners); notes:
    ignored contents, in words; strict: its lines and surfaces are sides of its elements; parts: first point and element
    of each instance of an assembly, and its name; instances: their elements; files: files read.
    """

    path: Path
    points: np.ndarray
    point_ids: np.ndarray
    blocks: list[Block]
    element_sets: dict[str, np.ndarray] = field(default_factory=dict)
    node_sets: dict[str, np.ndarray] = field(default_factory=dict)
    face_sets: dict[str, list[np.ndarray]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    parts: list[tuple[int, int, str]] = field(default_factory=list)
    instances: dict[str, np.ndarray] = field(default_factory=dict)
    strict: bool = True
    files: list[Path] = field(default_factory=list)

    @property
    def firsts(self) -> np.ndarray:
        """Number of the first element of each block, and of all elements."""
        return np.cumsum([0, *(len(block.rows) for block in self.blocks)])

    def point(self, row: int) -> str:
        """Number of a point as the file has it."""
        return f"{self.point_ids[row]}{self._part(row, 0)}"

    def element(self, number: int) -> str:
        """Number of an element as the file has it."""
        firsts = self.firsts
        k = int(np.searchsorted(firsts, number, side="right")) - 1
        return f"{self.blocks[k].ids[number - firsts[k]]}{self._part(number, 1)}"

    def _part(self, number: int, column: Literal[0, 1]) -> str:
        name = next((part[2] for part in reversed(self.parts) if part[column] <= number), "")
        return f" of {name}" if name else ""

    def refuse(self, what: str) -> HpcdemError:
        """The error, with the name of the file."""
        return HpcdemError(f"{self.path}: {what}")


def lines(content: bytes) -> list[str]:
    """Decode a text as UTF-8, GB 18030 or Latin-1 and split it into lines. Names that differ stay different."""
    for encoding in ("utf-8-sig", "gb18030", "latin-1"):
        with contextlib.suppress(UnicodeDecodeError):
            return content.decode(encoding).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    raise AssertionError


def listed(numbers: Iterable[object], most: int = 5) -> str:
    """The first few of them, in words."""
    every = list(map(str, numbers))
    return ", ".join(every[:most]) + (f" and {len(every) - most} more" if len(every) > most else "")

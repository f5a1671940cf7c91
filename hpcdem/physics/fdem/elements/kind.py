"""The kinds of elements, a row each.

An element consists of *parts*: triangles, in space tetrahedra, of constant strain. A triangle and a tetrahedron are one
part; a quad is two overlays of two, a hexahedron two overlays of five. An overlay covers the element once; each counts
half. In an overlay the trace of the strain is the mean by area or volume (mixed discretisation, Marti & Cundall 1982).

A law of elements takes the strain of a part to its stress. Components: 11, 22, 12, 33, in space 13, 23 besides; in the
plane there is no strain 33 but that of a law.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hpcdem.physics.fdem import hexahedra, tetrahedra
from hpcdem.physics.fdem.kernels import elements, hexes, tets

PLANE = ("11", "22", "12", "33")
SPACE = (*PLANE, "13", "23")


class Tables(NamedTuple):
    """What describes the elements of a kind that a rank holds.

    rows (n + 3,) i4: storage row of each, of a hexahedron the first of its six; first: of the first owned element; x:
    where corners are, flat, `width` words a row; c (n or n + 3, columns): constants, see `Kind`; place (n + 3, 8) i4:
    where corners begin in x; parts (blocks, 10, 10, 32): constants of parts, `hexes.WORDS` (these two without rows but
    of hexahedra).
    """

    rows: np.ndarray
    first: int
    x: np.ndarray
    width: int
    c: np.ndarray
    place: np.ndarray = np.zeros((0, 8), np.int32)
    parts: np.ndarray = np.zeros((0, hexes.PARTS, hexes.WORDS, hexes.BLOCK))


class Triangles(Tables):
    """Of each kind there is a class, by which kernels tell them apart while they are compiled."""


class Quads(Tables):
    """See `Triangles`."""


class Tetrahedra(Tables):
    """See `Triangles`."""


class Hexahedra(Tables):
    """See `Triangles`."""


@dataclass(frozen=True)
class Kind:
    """tables: class of its tables; parts: corners of each, overlay after overlay; faces: corners of each, in order.

    stresses: words of a row of stresses of a part, of which the first `components` are used; in_row: parts that a row
    of storage remembers something of; lame, two_mu, free: columns of its constants (free: of whether the strain across
    the plane is free, -1: there is no plane); volume: of areas of parts, of hexahedra of volumes of overlays, -1: they
    follow from the inverse of the reference matrix.
    """

    name: str
    tables: type[Tables]
    dim: int
    corners: int
    parts: tuple[tuple[int, ...], ...]
    overlays: int
    faces: tuple[tuple[int, ...], ...]
    stresses: int
    in_row: int
    lame: int
    two_mu: int
    free: int = -1
    volume: int = -1

    @property
    def components(self) -> tuple[str, ...]:
        """Of stress and strain."""
        return PLANE if self.dim == 2 else SPACE

    @property
    def frame(self) -> int:
        """Words of the frame that turns with a part: cosine and sine, or the rotation by rows."""
        return 2 if self.dim == 2 else 9

    @property
    def stride(self) -> int:
        """Words from one corner to the next in a row of x."""
        return 2 if self.dim == 2 else tets.STRIDE

    @property
    def normal(self) -> tuple[int, ...]:
        """Components whose sum the parts of an overlay share: the normal ones of the plane, or all three."""
        return (0, 1) if self.dim == 2 else (0, 1, 3)

    @property
    def each(self) -> int:
        """Parts of an overlay."""
        return len(self.parts) // self.overlays


def _rows(table: np.ndarray) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(row) for row in table.tolist())


TRIANGLE = Kind(
    "triangle", Triangles, 2, 3, ((0, 1, 2),), 1, ((0, 1), (1, 2), (2, 0)), 4, 1,
    elements.LAMBDA, elements.TWO_MU, elements.FREE,
)  # fmt: skip
QUAD = Kind(
    "quad", Quads, 2, 4, _rows(elements.PARTS), 2, ((0, 1), (1, 2), (2, 3), (3, 0)), 4, 4,
    elements.Q_LAMBDA, elements.Q_TWO_MU, elements.Q_FREE, volume=elements.Q_AREA,
)  # fmt: skip
TETRAHEDRON = Kind(
    "tetrahedron", Tetrahedra, 3, 4, ((0, 1, 2, 3),), 1, _rows(tetrahedra.FACES), tets.STRESSES, 1,
    tets.LAMBDA, tets.TWO_MU,
)  # fmt: skip
HEXAHEDRON = Kind(
    "hexahedron", Hexahedra, 3, 8, _rows(hexahedra.OVERLAYS), 2, _rows(hexahedra.FACES), tets.STRESSES, hexes.IN_ROW,
    hexes.H_LAMBDA, hexes.H_TWO_MU, volume=hexes.H_VOLUME,
)  # fmt: skip
KINDS = TRIANGLE, QUAD, TETRAHEDRON, HEXAHEDRON

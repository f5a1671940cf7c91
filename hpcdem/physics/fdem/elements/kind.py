"""The kinds of elements, a row each: the one place that names them all.

An element consists of *parts*: triangles, in space tetrahedra, of constant strain. A triangle and a tetrahedron are one
part; a quad is two overlays of two, a hexahedron two overlays of five. An overlay covers the element once; each counts
half. In an overlay the trace of the strain is the mean by area or volume (mixed discretisation, Marti & Cundall 1982).
A six-node triangle is three overlays of one part, its Gauss points, whose strain follows from all six nodes.

The mesh stores an element as one row of corners or, a *macro-element*, as several simplices with numbers one after the
other, which go everywhere together: a hexahedron as six tetrahedra, a six-node triangle as four triangles. Joints and
contact act on the sides of these simplices; forces inside are those of the whole.

A law of elements takes the strain of a part to its stress. Components: 11, 22, 12, 33, in space 13, 23 besides; in the
plane there is no strain 33 but that of a law.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hpcdem.physics.fdem import hexahedra, tetrahedra
from hpcdem.physics.fdem.kernels import elements, hexes, tets
from hpcdem.physics.fdem.six import kernels as six

PLANE = ("11", "22", "12", "33")
SPACE = (*PLANE, "13", "23")


class Tables(NamedTuple):
    """Tables of the elements of a kind that a rank holds.

    rows (n + 3,) i4: storage row of each, of a macro-element the first of its own; first: of the first owned element;
    x: where corners are, flat, `width` words a row; c (n or n + 3, columns): constants, see `Kind`; place (n + 3, k)
    i4, of macro-elements: where corners begin in x; parts (blocks, 10, 10, 32), of hexahedra: constants of parts,
    `hexes.WORDS`.
    """

    rows: np.ndarray
    first: int
    x: np.ndarray
    width: int
    c: np.ndarray
    place: np.ndarray = np.zeros((0, 8), np.int32)
    parts: np.ndarray = np.zeros((0, hexes.PARTS, hexes.WORDS, hexes.BLOCK))


class Triangles(Tables):
    """Tables of triangles. Each kind has a class, so that kernels are compiled for each kind."""


class Quads(Tables):
    """See `Triangles`."""


class Tetrahedra(Tables):
    """See `Triangles`."""


class Hexahedra(Tables):
    """See `Triangles`."""


class SixNodeTriangles(Tables):
    """See `Triangles`."""


@dataclass(frozen=True)
class Kind:
    """tables: class of its tables; corners: nodes of its displacements; parts: corners of each, overlay after overlay;
    faces: corners of each, in order.

    stresses: words of a row of stresses of a part, of which the first `components` are used; in_row: parts that a row
    of storage remembers something of; lame, two_mu, free: columns of its constants (free: of whether the strain across
    the plane is free, -1: there is no plane); volume: of areas of parts, of hexahedra of volumes of overlays, -1: they
    follow from the inverse of the reference matrix.

    stored: elements of the mesh that it is; cells: corners of each of these, where they are always the same; shape: how
    many of the corners, the first ones, are those of its shape; said_of_parts: initial stress is that at the middle of
    each element of the mesh, not of the whole; laws: names of the models that it can have, if not all.
    """

    name: str
    plural: str
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
    stored: int = 1
    cells: tuple[tuple[int, ...], ...] = ()
    shape: int = 0
    stress_of_parts: bool = False
    laws: tuple[str, ...] = ()

    def only(self, law: str, follow: Sequence[str]) -> str:
        """Return, for messages, what elements of this kind can have in place of this model ("": the one that they
        have), or of properties of it that follow a field; "": they can have it."""
        if not self.laws or ((not law or law in self.laws) and not follow):
            return ""
        if not law or law in self.laws:
            return f"a number for {follow[0]} only, no table over a field"
        return f"element c-model {' or '.join(self.laws).replace('_', '-')} only: they are elastic"

    def elements(self, table: np.ndarray) -> np.ndarray:
        """(n, stored) numbers of the elements that store these macro-elements (n, corners + 1), see `Mesh.macros`."""
        found: np.ndarray = table[:, -1, None] + np.arange(self.stored)
        return found

    def places(self, cells: np.ndarray, table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the corners of these (n, corners + 1): (n, corners) the first position (corners of cells * element + k)
        at each of them, and (n, places) the corner at each position."""
        width = self.stored * cells.shape[1]
        own = cells[self.elements(table)].reshape(len(table), width)
        same = own[:, None, :] == table[:, : self.corners, None]
        return np.argmax(same, axis=2), np.argmax(same, axis=1)

    def inside(self) -> np.ndarray:
        """(stored, 4) bool: faces of the elements of the mesh that are between two of `cells`, of the plane."""
        ends = [[tuple(sorted((one[k], one[(k + 1) % 3]))) for k in range(3)] for one in self.cells]
        every = [pair for one in ends for pair in one]
        return np.array([[every.count(pair) == 2 for pair in one] + [False] for one in ends])

    @property
    def components(self) -> tuple[str, ...]:
        """Number of components of stress and strain."""
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
    "triangle", "triangles", Triangles, 2, 3, ((0, 1, 2),), 1, ((0, 1), (1, 2), (2, 0)), 4, 1,
    elements.LAMBDA, elements.TWO_MU, elements.FREE,
)  # fmt: skip
QUAD = Kind(
    "quad", "quads", Quads, 2, 4, _rows(elements.PARTS), 2, ((0, 1), (1, 2), (2, 3), (3, 0)), 4, 4,
    elements.Q_LAMBDA, elements.Q_TWO_MU, elements.Q_FREE, volume=elements.Q_AREA,
)  # fmt: skip
TETRAHEDRON = Kind(
    "tetrahedron", "tetrahedra", Tetrahedra, 3, 4, ((0, 1, 2, 3),), 1, _rows(tetrahedra.FACES), tets.STRESSES, 1,
    tets.LAMBDA, tets.TWO_MU,
)  # fmt: skip
HEXAHEDRON = Kind(
    "hexahedron", "hexahedra", Hexahedra, 3, 8, _rows(hexahedra.OVERLAYS), 2, _rows(hexahedra.FACES), tets.STRESSES,
    hexes.IN_ROW, hexes.H_LAMBDA, hexes.H_TWO_MU, volume=hexes.H_VOLUME, stored=hexahedra.PARTS, shape=8,
)  # fmt: skip
SIX_NODE_TRIANGLE = Kind(
    "six-node triangle", "six-node triangles", SixNodeTriangles, 2, 6, (tuple(range(6)),) * six.GAUSS, six.GAUSS,
    ((0, 3, 1), (1, 4, 2), (2, 5, 0)), 4, 1, six.LAMBDA, six.TWO_MU, six.FREE, volume=six.AREA,
    stored=six.PARTS, cells=((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)), shape=3, stress_of_parts=True,
    laws=("mech_iso_elastic",),
)  # fmt: skip
"""Triangle with nodes 3, 4 and 5 in the middle of the edges 0-1, 1-2 and 2-0."""
KINDS = TRIANGLE, QUAD, TETRAHEDRON, HEXAHEDRON, SIX_NODE_TRIANGLE
MACROS = {kind.dim: kind for kind in KINDS if kind.stored > 1}
"""Macro-elements by dimension: a mesh has one kind of them at most."""

"""Conduction in the elements that a rank holds, of any kind (physics/fdem/elements/kind.py).

What flows between two corners of an element is the sum over its parts of -V grad N_a . k . grad N_b, the law of Fourier
with linear triangles and tetrahedra (manual, 7.6.1, (93) to (99)), each of several overlays counted for its share, as
in the stress. So each kind is a table of pairs of corners. Values t (n, w) stand at the corners of the elements that
storage consists of; those of a hexahedron are at eight of the corners of its six tetrahedra.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numba import njit, prange

from hpcdem.core.units import counted
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem import hexahedra
from hpcdem.physics.fdem.elements.kind import HEXAHEDRON, QUAD, TETRAHEDRON, TRIANGLE, Kind

if TYPE_CHECKING:
    from hpcdem.physics.fdem.mesh import Mesh
    from hpcdem.physics.fdem.simulation import Blocks

CONDUCT = TRIANGLE, QUAD, TETRAHEDRON, HEXAHEDRON
"""Kinds whose parts conduct; in six-node triangles the triangles that they are stored as do."""
ROUNDING = 1e-12
"""What flows from low to high, over what an element conducts, that is rounding."""
OF_PART = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
"""Pairs of corners of a part; of a triangle the first three."""
TENSOR = np.array([[0, 2, 4], [2, 1, 5], [4, 5, 3]])
"""Where the components of a conductivity are, in columns xx, yy, xy, zz, xz, yz."""


def _pairs_of(kind: Kind) -> np.ndarray:
    found = {tuple(sorted(pair)) for part in kind.parts for pair in combinations(part, 2)}
    return np.array(sorted(found, key=lambda pair: pair[::-1]))


def _pairs_of_parts(kind: Kind) -> np.ndarray:
    row = {tuple(pair): k for k, pair in enumerate(PAIRS[kind.corners].tolist())}
    ends = np.sort(np.array(kind.parts)[:, OF_PART[: 3 * kind.dim - 3]], axis=2)
    return np.array([[row[tuple(pair)] for pair in part] for part in ends.tolist()])


PAIRS = {kind.corners: _pairs_of(kind) for kind in CONDUCT}
"""By the number of corners of an element the pairs of them between which something flows."""
_PARTS = {kind: (np.array(kind.parts), _pairs_of_parts(kind)) for kind in CONDUCT}
_SHARE = {kind: kind.overlays * math.factorial(kind.dim) for kind in CONDUCT}


@njit(cache=True, nogil=True, error_model="numpy")
def _conductances(points, corners, parts, pairs, share, tensor, k, out):
    """Into out (n, pairs of corners) those of elements with these points as corners (n, c); parts (p, dim + 1): their
    corners; pairs (p, m): which pairs those of a part are; k (n, 6); share: of the determinants of a part."""
    dim = points.shape[1]
    side, slope = np.zeros((3, 3)), np.zeros((4, 3))
    side[2, 2] = 1.0  # what lies in the plane is one metre thick
    for i in range(len(corners)):
        out[i] = 0.0
        for p in range(len(parts)):
            first = corners[i, parts[p, 0]]
            for m in range(dim):
                for axis in range(dim):
                    side[m, axis] = points[corners[i, parts[p, m + 1]], axis] - points[first, axis]
            # The determinant times the gradients of the shape functions.
            for m in range(3):
                u, w = side[(m + 1) % 3], side[(m + 2) % 3]
                for axis in range(3):
                    y, z = (axis + 1) % 3, (axis + 2) % 3
                    slope[m + 1, axis] = u[y] * w[z] - u[z] * w[y]
            det = side[0, 0] * slope[1, 0] + (side[0, 1] * slope[1, 1] + side[0, 2] * slope[1, 2])
            for axis in range(3):
                slope[0, axis] = -(slope[1, axis] + (slope[2, axis] + slope[3, axis]))
            each = 1.0 / (share * det)
            for m in range(pairs.shape[1]):
                a, b, flow = OF_PART[m, 0], OF_PART[m, 1], 0.0
                for q in range(dim):
                    along = 0.0
                    for r in range(dim - 1, -1, -1):
                        along += k[i, tensor[q, r]] * slope[b, r]
                    flow += slope[a, q] * along
                out[i, pairs[p, m]] -= each * flow


def conductances(kind: Kind, points: np.ndarray, corners: np.ndarray, k: np.ndarray) -> np.ndarray:
    """(n, pairs) [W/K, in the plane per metre of thickness] between the `PAIRS` of elements of a kind with these points
    as corners (n, c), and conductivities k (n, 6)."""
    out = np.empty((len(corners), len(PAIRS[kind.corners])))
    _conductances(points, corners, *_PARTS[kind], _SHARE[kind], TENSOR, k, out)
    return out


@njit(nogil=True, error_model="numpy")
def _in_rows(part, threads, g, t, q):
    """Triangles, quads, tetrahedra as they are stored, by hand: four tenths faster than the loop of `_at_places`."""
    n, wide = len(g), g.shape[1] == 6
    for r in range(n * part // threads, n * (part + 1) // threads):
        at = (4 if wide else 3) * r
        a, b, c = t[at], t[at + 1], t[at + 2]
        ab, ac, bc = g[r, 0] * (b - a), g[r, 1] * (c - a), g[r, 2] * (c - b)
        if wide:
            d = t[at + 3]
            ad, bd, cd = g[r, 3] * (d - a), g[r, 4] * (d - b), g[r, 5] * (d - c)
            q[at], q[at + 1], q[at + 2] = (ab + ac) + ad, (bc - ab) + bd, cd - (ac + bc)
            q[at + 3] = -((ad + bd) + cd)
        else:
            q[at], q[at + 1], q[at + 2] = ab + ac, bc - ab, -(ac + bc)


_ROWS = np.array([np.flatnonzero((PAIRS[8] == k).any(axis=1)) for k in range(8)])
_PARTNERS = PAIRS[8].sum(axis=1)[_ROWS] - np.arange(8)[:, None]


@njit(nogil=True, error_model="numpy")
def _at_places(part, threads, at, g, t, q):
    n = len(at)
    for i in range(n * part // threads, n * (part + 1) // threads):
        for k in range(8):
            own, total = t[at[i, k]], 0.0
            for m in range(_ROWS.shape[1]):
                total += g[i, _ROWS[k, m]] * (t[at[i, _PARTNERS[k, m]]] - own)
            q[at[i, k]] = total


@on_threads
def conduct(threads, g, at, g_there, t, q):
    """Compute the flows to the corners of elements by conduction, stored in q (flat), with values t (flat): g (n, 3 or
    6) between those of rows of storage, then g_there (m, 24) between those at places at (m, 8)."""
    for part in prange(threads):
        _in_rows(part, threads, g, t, q)
    for part in prange(threads):
        _at_places(part, threads, at, g_there, t, q)


def of_kinds(mesh: Mesh, number: np.ndarray) -> Iterator[tuple[Kind, np.ndarray, np.ndarray]]:
    """Sort these elements (n,) of the mesh by kind: which they are (m,), of hexahedra their first parts, and where
    their corners are (m, c), element * 4 + k. All kinds that the mesh has, also those that none of these are of: ranks
    gather matrices kind by kind, so all have them in one order."""
    hexes, there = mesh.hexes, np.ones(len(number), bool)
    if len(hexes):
        of = mesh.macro_of()[number]
        there = of < 0
        at = np.flatnonzero(~there & (np.append(hexes[:, -1], -1)[of] == number))
        mine = hexes[of[at]]
        yield HEXAHEDRON, at, 4 * mine[:, 8:] + hexahedra.places(mesh.cells, mine)[0]
    wide = mesh.cells[:, 3] >= 0
    for kind, known in ((TRIANGLE, ~wide), (QUAD if mesh.dim == 2 else TETRAHEDRON, wide)):
        if known.any():
            at = np.flatnonzero(known[number] & there)
            yield kind, at, 4 * number[at][:, None] + np.arange(kind.corners)


class Conduction:
    """Conduction between the corners of the elements that a rank holds, ghosts too.

    g (n, 3 or 6): between those of rows of storage, 0 of parts of hexahedra; hexes (m, 8), g_hexes (m, 24): where the
    corners of hexahedra are in t, flat, and what flows between them; sizes (n, w): half the sum of what flows to each
    corner per degree, and of its size."""

    def __init__(self, blocks: Blocks, width: int, conductivities: Callable[[np.ndarray], np.ndarray]) -> None:
        """conductivities: (n, 6) of elements (n,)."""
        mesh, self.number, self.width = blocks.reference, blocks.number, width
        self.blocks = blocks
        self.g = np.zeros((len(self.number), len(PAIRS[width])))
        self.hexes, self.g_hexes = np.empty((0, 8), np.int64), np.empty((0, len(PAIRS[8])))
        self.sizes = np.zeros((len(self.number), width))
        for kind, at, corners in of_kinds(mesh, self.number):
            k = conductivities(self.number[at])
            found = conductances(kind, mesh.points, mesh.cells.reshape(-1)[corners], k)
            if kind is HEXAHEDRON:
                self.hexes, self.g_hexes = self._places(corners), found
            else:
                self.g[at, : found.shape[1]] = found
            places, each, sizes = self._places(corners), 0.5 * (found + np.abs(found)), self.sizes.reshape(-1)
            for pair, (a, b) in enumerate(PAIRS[kind.corners].tolist()):
                sizes[places[:, a]] += each[:, pair]
                sizes[places[:, b]] += each[:, pair]

    def _places(self, corners: np.ndarray) -> np.ndarray:
        """Return where corners, element * 4 + k, are in t, flat."""
        return self.blocks.where[corners // 4] * self.width + corners % 4

    def conduct(self, t: np.ndarray, q: np.ndarray) -> None:
        """Compute the flows to corners into q (flat), with values t (flat)."""
        conduct(self.blocks.threads, self.g, self.hexes, self.g_hexes, t, q)

    def by_kind(self) -> Iterator[tuple[Kind, np.ndarray, np.ndarray, np.ndarray]]:
        """Kind, numbers of elements (m,), corners (m, c), element * 4 + k, and what flows between these (m, pairs)."""
        for kind, at, corners in of_kinds(self.blocks.reference, self.number):
            g = self.g_hexes if kind is HEXAHEDRON else self.g[at, : len(PAIRS[kind.corners])]
            yield kind, self.number[at], corners, g


def matrices(kind: Kind, g: np.ndarray) -> np.ndarray:
    """(n, c, c) of elements of a kind between whose `PAIRS` g (n, pairs) flows."""
    out = np.zeros((len(g), kind.corners, kind.corners))
    for pair, (a, b) in enumerate(PAIRS[kind.corners].tolist()):
        out[:, a, b] -= g[:, pair]
        out[:, b, a] -= g[:, pair]
        out[:, a, a] += g[:, pair]
        out[:, b, b] += g[:, pair]
    return out


def against(
    mesh: Mesh, number: np.ndarray, node: np.ndarray, conductivities: Callable[[np.ndarray], np.ndarray]
) -> tuple[int, int, str]:
    """Along how many edges of these elements (n,), of how many, it flows from low to high, and in which elements; node
    (4 ne,): of the corners of the mesh."""
    ends, along, sizes, obtuse = [np.empty((0, 2), np.int64)], [np.empty(0)], [np.empty(0)], []
    for kind, at, corners in of_kinds(mesh, number):
        g = conductances(kind, mesh.points, mesh.cells.reshape(-1)[corners], conductivities(number[at]))
        size = np.abs(g).max(axis=1, keepdims=True)
        ends.append(np.sort(node[corners][:, PAIRS[kind.corners]].reshape(-1, 2), axis=1))
        along.append(g.reshape(-1))
        sizes.append(np.broadcast_to(size, g.shape).reshape(-1))
        if some := int((g < -ROUNDING * size).any(axis=1).sum()):
            obtuse.append(f"{some} of {counted(len(g), kind.name)}".replace("hedrons", "hedra"))
    both = np.concatenate(ends)
    key, where = np.unique(both[:, 0] * (len(node) + 1) + both[:, 1], return_inverse=True)
    total, size = (np.bincount(where.reshape(-1), np.concatenate(one), len(key)) for one in (along, sizes))
    return int((total < -ROUNDING * size).sum()), len(key), " and ".join(obtuse)

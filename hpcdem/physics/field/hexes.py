"""A field in hexahedra: the mean of that in the five tetrahedra of each of two overlays, as their stress is.

Heat flows between corners that share an edge of one of these ten: along the twelve edges and both diagonals of each
side. Corners have the parts of the volume that their masses have, and sides of four corners are those of both ways to
cut them, half each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.physics.fdem import hexahedra
from hpcdem.physics.fdem.mesh import sizes
from hpcdem.physics.field import kernels_space
from hpcdem.physics.field.kernels_space import HEX_PAIRS

if TYPE_CHECKING:
    from hpcdem.physics.fdem.mesh import Mesh
    from hpcdem.physics.fdem.simulation import Blocks


class Hexes:
    """All that are held here, ghosts too. number (n,): of their first elements; rows (n, 6): of storage; corners (n,
    8): in the table of temperatures, flat; g (n, 24) [W/K]: conductances between HEX_PAIRS."""

    def __init__(self, blocks: Blocks, k: np.ndarray) -> None:
        """k (hexahedra of the mesh, 6): conductivities, see `kernels_space.conductances`."""
        mesh = blocks.reference
        held = np.flatnonzero(blocks.where[mesh.hexes[:, 8]] >= 0)
        hexes = mesh.hexes[held]
        self.number = hexes[:, 8]
        self.rows = blocks.where[self.number[:, None] + np.arange(hexahedra.PARTS)]
        self.corners = hexahedra.Rows(mesh.points, mesh.cells, hexes, self.rows).corners
        self.g = conductances(mesh.points, hexes, k[held])
        self.threads = blocks.threads

    def conduct(self, t: np.ndarray, q: np.ndarray) -> None:
        """Heat that flows to their corners into q (flat), with temperatures t (flat)."""
        kernel: Any = kernels_space.conduct_hexes if self.threads == 1 else kernels_space.conduct_hexes_threaded
        kernel(self.threads, self.corners, self.g, t, q)

    def add_sizes(self, out: np.ndarray) -> None:
        """Add to out (flat) for each corner half the sum of conductances and of their sizes [W/K]."""
        each = 0.5 * (self.g + np.abs(self.g))
        for end in HEX_PAIRS.T:
            np.add.at(out, self.corners[:, end], each)

    def matrices(self, mine: np.ndarray) -> np.ndarray:
        """(m, 8, 8) [W/K] of some (n,) bool."""
        g = self.g[mine]
        out = np.zeros((len(g), 8, 8))
        for p, (a, b) in enumerate(HEX_PAIRS.tolist()):
            out[:, a, b] -= g[:, p]
            out[:, b, a] -= g[:, p]
            out[:, a, a] += g[:, p]
            out[:, b, b] += g[:, p]
        return out


def conductances(points: np.ndarray, hexes: np.ndarray, k: np.ndarray) -> np.ndarray:
    """(n, 24) [W/K] of hexahedra with these points (n, 8 or 9) and conductivities k (n, 6)."""
    out, one, every = np.zeros((len(hexes), len(HEX_PAIRS))), np.empty((len(hexes), 6)), np.arange(len(hexes))
    for corners, pairs in zip(hexahedra.OVERLAYS, kernels_space.OVERLAY_PAIRS):
        kernels_space.conductances(every, points, np.ascontiguousarray(hexes[:, corners]), k, one)
        out[:, pairs] += 0.5 * one
    return out


def with_other_cuts(mesh: Mesh, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners (m, 3), element * 4 + k, of triangles to which what goes through faces (n,) is shared out equally, the
    area of each [m2], half of it where a side is cut both ways, and which face (m,) it is of."""
    corners, area = mesh.face_corners(faces), sizes(mesh.points[mesh.face_points(faces)])
    at, _, beside = _cut_otherwise(mesh, faces)
    area[at] *= 0.5
    more = 0.5 * sizes(mesh.points[mesh.cells.reshape(-1)[beside]])
    return np.concatenate([corners, beside]), np.append(area, more), np.append(np.arange(len(faces)), at)


def facing(mesh: Mesh, faces: np.ndarray, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (2, m, 3), element * 4 + k, of pairs of triangles that may touch, where pairs (n, 2) of free faces,
    ascending `faces`, may; sides of hexahedra are cut both ways. share (m,): which part of what they pass on counts."""
    side = faces.copy()  # its lowest face
    at, number, _ = _cut_otherwise(mesh, faces)
    _, which = np.unique(number, return_inverse=True)
    lowest = np.full(len(at), mesh.cells.size)
    np.minimum.at(lowest, which, faces[at])
    side[at] = lowest[which]
    corners, _, of = with_other_cuts(mesh, faces)
    part = np.ones(len(faces))
    part[at] = 0.5
    order = np.argsort(side[of], kind="stable")
    known, begin, count = np.unique(side[of][order], return_index=True, return_counts=True)
    both = np.unique(np.sort(side[np.searchsorted(faces, pairs)], axis=1), axis=0).reshape(-1, 2)
    first, second = np.searchsorted(known, both[both[:, 0] < both[:, 1]]).T
    many = count[first] * count[second]
    pair = np.repeat(np.arange(len(many)), many)
    k, m = np.divmod(np.arange(len(pair)) - np.repeat(np.cumsum(many) - many, many), count[second[pair]])
    one, two = order[begin[first[pair]] + k], order[begin[second[pair]] + m]
    return corners[np.array([one, two])], part[of[one]] * part[of[two]]


def _cut_otherwise(mesh: Mesh, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which of the faces (n,) are half a side of a hexahedron (k,), numbers (k,) of these sides, and corners (k, 3),
    element * 4 + k, of a half that is cut the other way; both halves have another one each."""
    of = mesh.macro_of()[faces // 4]
    at = np.flatnonzero(of >= 0)
    hexes = mesh.hexes[of[at]]
    first, inside = hexahedra.places(mesh.cells, hexes)
    own = np.take_along_axis(inside, mesh.face_corners(faces[at]) - 4 * hexes[:, 8:], axis=1)
    other = hexahedra.OTHER_CUT[own[:, 0], own[:, 1], own[:, 2]]
    of_side = np.bitwise_or.reduce(1 << np.column_stack([own, other]), axis=1)
    return at, 256 * of[at] + of_side, 4 * hexes[:, 8:] + np.take_along_axis(first, other, axis=1)

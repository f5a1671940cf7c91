"""Sides of hexahedra that are passed by a field: conduction in a hexahedron is the mean of two overlays, which cut each
side of four corners both ways, so that each way counts half."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hpcdem.physics.fdem import hexahedra
from hpcdem.physics.fdem.mesh import sizes

if TYPE_CHECKING:
    from hpcdem.physics.fdem.mesh import Mesh


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
    """Find the faces (n,) that are halves of sides of hexahedra (k,), the numbers (k,) of these sides, and the corners
    (k, 3), element * 4 + k, of a half that is cut the other way; both halves have another one each."""
    of = mesh.macro_of()[faces // 4]
    at = np.flatnonzero(of >= 0)
    hexes = mesh.hexes[of[at]]
    first, inside = hexahedra.places(mesh.cells, hexes)
    own = np.take_along_axis(inside, mesh.face_corners(faces[at]) - 4 * hexes[:, 8:], axis=1)
    other = hexahedra.OTHER_CUT[own[:, 0], own[:, 1], own[:, 2]]
    of_side = np.bitwise_or.reduce(1 << np.column_stack([own, other]), axis=1)
    return at, 256 * of[at] + of_side, 4 * hexes[:, 8:] + np.take_along_axis(first, other, axis=1)

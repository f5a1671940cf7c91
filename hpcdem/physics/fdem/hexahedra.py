"""Hexahedra: a hexahedron is six tetrahedra of the mesh one after the other, which go everywhere together; its forces
are those of two overlays of five tetrahedra (kernels/hexes.py).

Points 1 to 8 as in VTK: 1 2 3 4 below, counter-clockwise as seen from above, 5 6 7 8 over them. The six tetrahedra hang
on the lowest point: each side of the hexahedron is cut from its own lowest point, so that neighbours cut it alike.
"""

from __future__ import annotations

import numpy as np

from hpcdem.physics.fdem import tetrahedra

PARTS = 6
"""Number of tetrahedra of a hexahedron in the mesh."""
FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
"""Corners of the sides, counter-clockwise as seen from outside."""
DIAGONAL, LONE = 5.0 / 36.0, -1.0 / 36.0
"""e of the corners of half a side (kernels/joints_hexes.py): of those on the diagonal, and of the one that the other
half does not have."""


def _upright(parts: list[tuple[int, ...]]) -> np.ndarray:
    """Reorder the tetrahedra of a cube so that their volumes are positive."""
    cube = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    out = np.array(parts) - 1
    for part in out:
        if np.linalg.det(cube[part[1:]] - cube[part[0]]) < 0.0:
            part[2:] = part[[3, 2]]
    return out


OVERLAYS = _upright([
    (1, 2, 3, 6), (1, 3, 4, 8), (1, 6, 8, 5), (3, 8, 6, 7), (1, 3, 8, 6),
    (2, 3, 4, 7), (2, 4, 1, 5), (2, 7, 5, 6), (4, 5, 7, 8), (2, 4, 5, 7),
])  # fmt: skip
"""Two overlays of five tetrahedra: corners of the hexahedron (10, 4)."""


def split(points: np.ndarray) -> np.ndarray:
    """(n, 6, 4) tetrahedra of hexahedra with these points (n, 8)."""
    out = np.empty((len(points), PARTS, 4), np.int64)
    lowest = np.argmin(points, axis=1)
    for corner in range(8):
        at = np.flatnonzero(lowest == corner)
        apart = [face for face in FACES if corner not in face]
        for k, face in enumerate(apart):
            of = points[at][:, face]
            first = np.argmin(of, axis=1)[:, None]
            a, b, c, d = (np.take_along_axis(of, (first + m) % 4, axis=1)[:, 0] for m in range(4))
            top = points[at, corner]
            # Seen from outside a, b, c run counter-clockwise, so that they do not as seen from `top`.
            out[at, 2 * k] = np.column_stack([a, c, b, top])
            out[at, 2 * k + 1] = np.column_stack([a, d, c, top])
    return out


def triangles(sides: list[np.ndarray]) -> np.ndarray:
    """(k, 3) triangles, of triangles (m, 3) and sides (m, 4) as `split` cuts them."""
    out = [np.empty((0, 3), np.int64)]
    for of in sides:
        if of.shape[1] == 3:
            out.append(of)
            continue
        first = np.argmin(of, axis=1)[:, None]
        a, b, c, d = (np.take_along_axis(of, (first + m) % 4, axis=1)[:, 0] for m in range(4))
        out += [np.column_stack([a, b, c]), np.column_stack([a, c, d])]
    return np.concatenate(out)


def volumes(points: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """(n, 10) of the tetrahedra of both overlays [m3]."""
    at = points[hexes[:, :8][:, OVERLAYS]]
    u, w, t = (at[:, :, k] - at[:, :, 0] for k in (1, 2, 3))
    return (np.cross(u, w) * t).sum(axis=2) / 6.0


def corner_volumes(points: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """(n, 8) parts of the corners [m3]: quarters of the tetrahedra at them, the mean of the overlays."""
    of, out = volumes(points, hexes), np.zeros((len(hexes), 8))
    for j, corners in enumerate(OVERLAYS):
        out[:, corners] += 0.125 * of[:, j, None]
    return out


class Rows:
    """Hexahedra (n, 9) of a mesh whose tetrahedra stand in rows (n, 6) of a table of elements: what stands at their
    corners is where `corners` (n, 8) say, 4 row + k."""

    def __init__(self, points: np.ndarray, cells: np.ndarray, hexes: np.ndarray, rows: np.ndarray) -> None:
        self.hexes, self.rows = hexes, rows
        first, self.parts = corner_parts(points, cells, hexes)
        self.corners = 4 * np.take_along_axis(rows, first // 4, axis=1) + first % 4

    def means(self, t: np.ndarray) -> np.ndarray:
        """Means by volume (n,) of values at corners (rows, 4)."""
        return (self.parts * t[self.rows]).sum(axis=2).sum(axis=1)


def corner_parts(points: np.ndarray, cells: np.ndarray, hexes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first corners (n, 8) of `places`, and (n, 6, 4) the parts of the volume that belong to them; to the other
    corners of the six tetrahedra belongs nothing."""
    first, _ = places(cells, hexes)
    of, parts = corner_volumes(points, hexes), np.zeros((len(hexes), 4 * PARTS))
    np.put_along_axis(parts, first, of / of.sum(axis=1, keepdims=True), axis=1)
    return first, parts.reshape(-1, PARTS, 4)


def places(cells: np.ndarray, hexes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the corners of hexahedra: (n, 8) the first corner (4 tetrahedron + k, of the six) at each of them, and (n,
    24) the corner of the hexahedron at each corner of its tetrahedra."""
    own = cells[hexes[:, 8, None] + np.arange(PARTS)].reshape(len(hexes), 4 * PARTS)
    same = own[:, None, :] == hexes[:, :8, None]
    return np.argmax(same, axis=2), np.argmax(same, axis=1)


def halves(cells: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """(n, 6, 2) faces of the mesh (element * 4 + k) that the sides of hexahedra are cut into, by `FACES`."""
    _, of = places(cells, hexes)
    inside = 4 * np.arange(PARTS)[:, None, None] + tetrahedra.FACES
    side = _SIDE_OF[tuple(np.moveaxis(of[:, inside.reshape(-1, 3)], 2, 0))]
    order = np.argsort(side, axis=1, kind="stable")[:, -2 * len(FACES) :]  # inner faces lead
    return (4 * hexes[:, 8, None] + order).reshape(-1, len(FACES), 2)


def _sides() -> np.ndarray:
    """(8, 8, 8): the side that has these three corners, -1: none."""
    out = np.full((8, 8, 8), -1)
    for number, side in enumerate(FACES):
        out[np.ix_(side, side, side)] = number
    return out


_SIDE_OF = _sides()


def _other_cuts() -> np.ndarray:
    """(8, 8, 8, 3): of three corners of a side the three that, cut the other way, belong to the same half."""
    out = np.full((8, 8, 8, 3), -1)
    for side in FACES:
        for lost in range(4):
            a, b, c = (side[(lost + m) % 4] for m in (1, 2, 3))
            for order in ((a, b, c), (b, c, a), (c, a, b)):
                out[order] = side[lost], a, b
    return out


OTHER_CUT = _other_cuts()

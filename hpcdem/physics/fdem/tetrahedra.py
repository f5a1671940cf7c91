"""Who is next to whom in a mesh of tetrahedra: what `connectivity` is for the plane, with the same numbers.

- a *corner* is element * 4 + k; corners 0, 1, 2 run counter-clockwise as seen from corner 3;
- a *face* is element * 4 + k, with the corners `FACES[k]`, counter-clockwise as seen from outside;
- an *edge* of `Edges` stands for a face: one on the surface of a body, or two with the same points.

Cells are (ne, 4) i8 point numbers.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.connectivity import Edges, join_corners, pair_equal, root_of

FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
"""Corners of the faces, outwards."""
ROW, STRIDE = 16, 4
"""Words of a row of positions, velocities or forces, and from one corner of it to the next."""


def without_spares(rows: np.ndarray) -> np.ndarray:
    """Rows (n, 16) without the spare word of each corner (n, 12)."""
    return rows.reshape(-1, 4, STRIDE)[:, :, :3].reshape(-1, 12)


def _turns() -> np.ndarray:
    """(4, 4, 4): the even permutation of four corners that begins with two given ones."""
    out = np.zeros((4, 4, 4), np.int64)
    for a in range(4):
        for b in range(4):
            if a != b:
                c, d = (k for k in range(4) if k not in (a, b))
                even = np.linalg.det(np.eye(4)[[a, b, c, d]]) > 0.0
                out[a, b] = (a, b, c, d) if even else (a, b, d, c)
    return out


_TURNS = _turns()


def canonical(cells: np.ndarray) -> np.ndarray:
    """Turn tetrahedra (ne, 4) so that their lowest point leads and the second lowest follows: both sides of a face
    then begin at the same point of it."""
    order = np.argsort(cells, axis=1, kind="stable")
    return np.take_along_axis(cells, _TURNS[order[:, 0], order[:, 1]], axis=1) if len(cells) else cells


def face_points(cells: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(n, 3) i8 points of each face."""
    e, k = np.divmod(faces, 4)
    return cells[e[:, None], FACES[k]]


def face_corners(_cells: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(n, 3) i8 corners (element * 4 + k) of each face."""
    e, k = np.divmod(faces, 4)
    return 4 * e[:, None] + FACES[k]


@njit(cache=True, nogil=True, error_model="numpy")
def _points_of_faces(cells, faces, points):
    for f in range(len(points)):
        e, k = f // 4, f % 4
        a, b, c = cells[e, faces[k, 0]], cells[e, faces[k, 1]], cells[e, faces[k, 2]]
        points[f, 0], points[f, 2] = min(min(a, b), c), max(max(a, b), c)
        points[f, 1] = a + b + c - points[f, 0] - points[f, 2]


def pair_faces(cells: np.ndarray, n_points: int, partner: np.ndarray) -> int:
    """Fill partner (4 ne,) i8; returns the lowest face that is used by three or more elements, or -1."""
    points = np.empty((len(partner), 3), np.int32)
    _points_of_faces(cells, FACES, points)
    return int(pair_equal(points, n_points, partner))


def face_partners(cells: np.ndarray, n_points: int = 0) -> np.ndarray:
    """(4 ne,) i8: the face on the other side of each face, -1 at a surface. ValueError if three elements share one.
    n_points: 0: as many as the cells name."""
    partner = np.empty(4 * len(cells), np.int64)
    bad = pair_faces(cells, n_points or int(cells.max(initial=-1)) + 1, partner)
    if bad >= 0:
        raise ValueError(f"face {bad} is used by more than two elements")
    return partner


def edges_of(cells: np.ndarray, n_points: int, partner: np.ndarray | None = None) -> Edges:
    """Return all faces, each once, ascending by number."""
    partner = face_partners(cells, n_points) if partner is None else partner
    face = np.arange(len(partner))
    lower = face[(partner < 0) | (partner > face)]
    return Edges(np.column_stack([lower, partner[lower]]), face_points(cells, lower))


def find_edges(faces: Edges, points: np.ndarray, _points: int = 0) -> np.ndarray:
    """(k,) i8 rows of `faces` with these points (k, 3) in any order; -1 where the mesh has no such face."""
    points = np.sort(np.asarray(points, np.int64).reshape(-1, 3), axis=1)
    if not len(points) or not len(faces):
        return np.full(len(points), -1, np.int64)
    wanted = np.zeros(int(faces.points.max()) + 1, bool)
    wanted[points[points < len(wanted)]] = True
    some = np.flatnonzero(wanted[faces.points].all(axis=1))  # few, as a rule
    known = np.sort(faces.points[some], axis=1)
    both = np.concatenate([known, points])
    key = np.unique(both, axis=0, return_inverse=True)[1].reshape(-1)
    row = np.full(int(key.max()) + 1, -1, np.int64)
    row[key[: len(known)]] = some
    return row[key[len(known) :]]


@njit(cache=True, nogil=True, error_model="numpy")
def _corner_roots(cells, partner, faces, apart, parent):
    for c in range(len(parent)):
        parent[c] = c
    for f in range(len(partner)):
        g = partner[f]
        if g < f or apart[f] or apart[g]:
            continue
        e, d = f // 4, g // 4
        for i in range(3):
            c = 4 * e + faces[f % 4, i]
            for j in range(3):
                o = 4 * d + faces[g % 4, j]
                if cells[e, c % 4] == cells[d, o % 4]:
                    join_corners(parent, c, o)
    for c in range(len(parent)):
        parent[c] = root_of(parent, c)


def corner_clusters(cells: np.ndarray, partner: np.ndarray, apart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes: sets of corners at one point that are connected through faces that are not `apart` (4 ne,) bool. Returns
    (node (ne, 4) i4, lead (nn,) i8), see `connectivity.corner_clusters`."""
    root = np.empty(4 * len(cells), np.int64)
    _corner_roots(cells, partner, FACES, np.asarray(apart, bool), root)
    lead = np.flatnonzero(root == np.arange(len(root)))
    number = np.full(len(root), -1, np.int32)
    number[lead] = np.arange(len(lead))
    return number[root].reshape(-1, 4), lead


def sides(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(ne, 3, 3) from the first corner to the three others, by rows [m]."""
    return points[cells[:, 1:]] - points[cells[:, :1]]


def volumes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(ne,) [m3], negative if the corners run the other way."""
    out = np.empty(len(cells))
    _volumes(np.ascontiguousarray(points), np.ascontiguousarray(cells), out)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _volumes(points, cells, out):
    u, w, t = np.empty(3), np.empty(3), np.empty(3)
    for e in range(len(cells)):
        for k in range(3):
            first = points[cells[e, 0], k]
            u[k], w[k] = points[cells[e, 1], k] - first, points[cells[e, 2], k] - first
            t[k] = points[cells[e, 3], k] - first
        x, y = (u[1] * w[2] - u[2] * w[1]) * t[0], (u[2] * w[0] - u[0] * w[2]) * t[1]
        out[e] = ((x + y) + (u[0] * w[1] - u[1] * w[0]) * t[2]) / 6.0


def face_areas(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(ne, 4) [m2]."""
    out = np.empty((len(cells), 4))
    _face_areas(points, cells, FACES, out)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _face_areas(points, cells, faces, out):
    u, w = np.empty(3), np.empty(3)
    for e in range(len(cells)):
        for f in range(4):
            a, b, c = cells[e, faces[f, 0]], cells[e, faces[f, 1]], cells[e, faces[f, 2]]
            for k in range(3):
                u[k], w[k] = points[b, k] - points[a, k], points[c, k] - points[a, k]
            x, y, z = u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]
            out[e, f] = 0.5 * math.sqrt((x * x + y * y) + z * z)


areas = volumes
"""What the plane calls so."""


def nearest_element(points: np.ndarray, cells: np.ndarray, at: tuple[float, ...], among: np.ndarray) -> int:
    """Number of the tetrahedron that holds the point `at`, the lowest of several; else of the one by whose size it lies
    outside least."""
    among = np.sort(among)
    u = np.swapaxes(sides(points, cells[among]), 1, 2)
    offset = np.asarray(at, np.float64) - points[cells[among, 0]]
    part = np.linalg.solve(u, offset[:, :, None])[:, :, 0]
    least = np.minimum(part.min(axis=1), 1.0 - part.sum(axis=1))
    return int(among[np.argmax(np.minimum(least, 0.0))])

"""Positions of elements that are filled back after excavation: pure functions of arrays.

Points that they share with elements that stayed are where these are now. The others follow by the harmonic extension of
their displacement (Laplace's equation on the elements that come back, linear triangles or tetrahedra): a field that is
linear on the rim is linear inside, so the void may have moved, turned and been stretched.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from hpcdem.physics.fdem.tetrahedra import FACES

TORN = 0.1
"""Limit of tearing: where the corners that meet in a point are farther apart than this fraction of the mean edge, the
body counts as torn, and elements that are filled in again are not connected with it. The overlap of others with them
may be as large."""


def extended(points: np.ndarray, cells: np.ndarray, known: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (np, c) at all points of the elements `cells` (n, 4): given where known (np,) bool, harmonic elsewhere;
    zero in parts that touch no known point. points (np, dim) [m]: in the mesh."""
    simplices = cells
    if points.shape[1] == 2:
        simplices = np.concatenate([cells[:, :3], cells[cells[:, 3] >= 0][:, [0, 2, 3]]])
    at, rows = np.unique(simplices, return_inverse=True)
    rows = rows.reshape(simplices.shape)
    matrix = _laplacian(points[at], rows)
    _, part = connected_components(matrix, directed=False)
    fixed = known[at]
    held = np.isin(part, part[fixed])
    free = held & ~fixed
    out = np.zeros_like(values)
    out[at[fixed]] = values[at[fixed]]
    if free.any():
        solved = splu(matrix[free][:, free].tocsc()).solve(-(matrix[free][:, fixed] @ values[at[fixed]]))
        out[at[free]] = solved
    return out


def _laplacian(points: np.ndarray, rows: np.ndarray) -> csr_array:
    """Stiffness of Laplace's equation (n, n) on linear triangles or tetrahedra; rows (m, dim + 1) of points
    (n, dim)."""
    sides = points[rows[:, 1:]] - points[rows[:, :1]]
    slope = np.swapaxes(np.linalg.inv(sides), 1, 2)  # of the shape functions of all corners but the first
    slope = np.concatenate([-slope.sum(axis=1, keepdims=True), slope], axis=1)
    size = np.abs(np.linalg.det(sides)) / math.factorial(points.shape[1])
    each = np.einsum("tic,tjc->tij", slope, slope) * size[:, None, None]
    i, j = np.repeat(rows, rows.shape[1], axis=1), np.tile(rows, (1, rows.shape[1]))
    return csr_array((each.reshape(-1), (i.reshape(-1), j.reshape(-1))), shape=(len(points), len(points)))


def depth(one: np.ndarray, other: np.ndarray) -> float:
    """Depth [m] to which two convex polygons (n, 2), counter-clockwise, or two tetrahedra (4, 3) overlap; not positive
    if they do not overlap. It is the shortest displacement that separates them, over the normals of all sides, and in
    space also over the normals of pairs of edges."""
    least = np.inf
    for a, b in ((one, other), (other, one)):
        at, normal = _outwards(a)
        normal = normal / np.linalg.norm(normal, axis=1)[:, None]
        least = min(least, float(((at * normal).sum(axis=1) - (b @ normal.T).min(axis=0)).min()))
    if one.shape[1] == 3 and least > 0.0:
        edges_of_both = [shape[EDGES[:, 1]] - shape[EDGES[:, 0]] for shape in (one, other)]
        across = np.cross(edges_of_both[0][:, None], edges_of_both[1]).reshape(-1, 3)
        size = np.linalg.norm(across, axis=1)
        normal = across[size > 1e-9 * size.max()] / size[size > 1e-9 * size.max(), None]
        a, b = one @ normal.T, other @ normal.T
        least = min(least, float(np.minimum(a.max(axis=0) - b.min(axis=0), b.max(axis=0) - a.min(axis=0)).min()))
    return least


EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
"""Edges of a tetrahedron."""


def _outwards(shape: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A corner and an outward vector of each side (m, dim)."""
    if shape.shape[1] == 3:
        a, b, c = np.moveaxis(shape[FACES], 1, 0)
        return a, np.cross(b - a, c - a)
    edges = np.roll(shape, -1, axis=0) - shape
    return shape, np.column_stack([edges[:, 1], -edges[:, 0]])


def deepest(
    cells: np.ndarray, places: np.ndarray, new: np.ndarray, old: np.ndarray, allowed: float
) -> tuple[int, int, float] | None:
    """The first new element into which an old one reaches by more than `allowed` [m], that one, and how far; None if
    missing. places (ne, 4, dim) [m] of all corners; new, old: element numbers."""
    if not len(old):
        return None
    middle, far, there = np.zeros((len(cells), places.shape[2])), np.zeros(len(cells)), np.concatenate([new, old])
    corners = np.where((cells[there] >= 0)[:, :, None], places[there], np.nan)
    middle[there] = np.nanmean(corners, axis=1)
    far[there] = np.nanmax(np.linalg.norm(corners - middle[there, None], axis=2), axis=1)
    counts = (cells >= 0).sum(axis=1)
    for e, near in zip(new.tolist(), cKDTree(middle[old]).query_ball_point(middle[new], far[new] + far[old].max())):
        f = old[np.sort(np.array(near, np.int64))]
        for other in f[np.linalg.norm(middle[f] - middle[e], axis=1) < far[e] + far[f]].tolist():
            deep = depth(places[e, : counts[e]], places[other, : counts[other]])
            if deep > allowed:
                return e, other, deep
    return None

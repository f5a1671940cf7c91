"""Where elements lie that come back after they were taken out: pure functions of arrays.

Points that they share with elements that stayed are where these are now. The others follow by the harmonic extension of
their displacement (Laplace's equation on the elements that come back, linear triangles): a field that is linear on the
rim is linear inside, so the void may have moved, turned and been stretched.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from hpcdem.physics.fdem.connectivity import corner_counts


def extended(points: np.ndarray, cells: np.ndarray, known: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (np, c) at all points of the elements `cells` (n, 4): given where known (np,) bool, harmonic elsewhere;
    zero in parts that touch no known point. points (np, 2) [m]: in the mesh."""
    quads = cells[cells[:, 3] >= 0]
    triangles = np.concatenate([cells[:, :3], quads[:, [0, 2, 3]]])
    at, rows = np.unique(triangles, return_inverse=True)
    rows = rows.reshape(-1, 3)
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


def _laplacian(xy: np.ndarray, rows: np.ndarray) -> csr_array:
    """Stiffness of Laplace's equation (n, n) on linear triangles; rows (m, 3) of xy (n, 2)."""
    corners = xy[rows]
    side = np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1)  # opposite to each corner
    area = 0.5 * np.abs(side[:, 0, 0] * side[:, 1, 1] - side[:, 0, 1] * side[:, 1, 0])
    each = np.einsum("tic,tjc->tij", side, side) / (4.0 * area)[:, None, None]
    i, j = np.repeat(rows, 3, axis=1), np.tile(rows, (1, 3))
    return csr_array((each.reshape(-1), (i.reshape(-1), j.reshape(-1))), shape=(len(xy), len(xy)))


def depth(one: np.ndarray, other: np.ndarray) -> float:
    """How far two convex polygons (n, 2), counter-clockwise, reach into each other [m]; not positive if they do not:
    the least way, over the normals of all edges, that parts them."""
    least = np.inf
    for a, b in ((one, other), (other, one)):
        way = np.roll(a, -1, axis=0) - a
        normal = np.column_stack([way[:, 1], -way[:, 0]]) / np.hypot(way[:, 0], way[:, 1])[:, None]
        least = min(least, float(((a * normal).sum(axis=1) - (b @ normal.T).min(axis=0)).min()))
    return least


def deepest(
    cells: np.ndarray, places: np.ndarray, new: np.ndarray, old: np.ndarray, allowed: float
) -> tuple[int, int, float] | None:
    """The first new element into which an old one reaches by more than `allowed` [m], that one, and how far; None if
    there is none. places (ne, 4, 2) [m] of all corners; new, old: element numbers."""
    if not len(old):
        return None
    corners = np.where((cells >= 0)[:, :, None], places, np.nan)
    with_old, with_new = (np.nanmean(corners[rows], axis=1) for rows in (old, new))
    far = [
        np.nanmax(np.hypot(*np.moveaxis(corners[r] - c[:, None], 2, 0))) for r, c in ((old, with_old), (new, with_new))
    ]
    counts = corner_counts(cells)
    for e, near in zip(new.tolist(), cKDTree(with_old).query_ball_point(with_new, sum(far))):
        for f in old[np.sort(np.array(near, np.int64))].tolist():
            deep = depth(places[e, : counts[e]], places[f, : counts[f]])
            if deep > allowed:
                return e, f, deep
    return None

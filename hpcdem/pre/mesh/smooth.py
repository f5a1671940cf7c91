"""Triangles whose inner points lie in the middle of their neighbours.

Joints on all edges ask for it. Going around an inner point the jumps from element to element add to nothing, and the
jump of a joint of length h under the traction t is h t/P, if the penalties of opening and sliding are the same. So
whatever the penalty is, the tractions at the point obey sum(h t) = 0. A uniform stress s has t = s n, and h n is the
edge turned by 90 degrees: it can be uniform on the joints only where the edges to the neighbours add to nothing.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import splu

from hpcdem.physics.fdem.connectivity import edges_of

SMALLEST = 20.0
"""Smallest angle [degrees] that smoothing may produce, unless the angle was smaller before."""


def smoothed(points: np.ndarray, cells: np.ndarray, held: np.ndarray) -> tuple[np.ndarray, int]:
    """Points (np, 2) [m] with each in the mean of its neighbours, but those of `held` (np,) bool, which stay; and how
    many others had to stay, as triangles would have become sharp. cells (ne, 4): triangles.

    The middle of all neighbours is a linear system (Tutte 1963); where the outline is not convex triangles may turn
    over, so corners of those that would are held too, and the rest is solved again.
    """
    edges = edges_of(cells, len(points)).points
    a, b = edges.T
    links = coo_matrix((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, a])), shape=(len(points),) * 2).tocsr()
    count = np.asarray(links.sum(axis=1)).ravel()
    matrix = (diags(count) - links).tocsr()
    least = np.minimum(_sharpest(points, cells), SMALLEST)
    held = held | (count == 0.0)  # points that no element uses
    stays = held.copy()
    while True:
        out, free = points.copy(), np.flatnonzero(~stays)
        if len(free):
            rows = matrix[free]
            out[free] = splu(rows[:, free].tocsc()).solve(-(rows[:, np.flatnonzero(stays)] @ points[stays]))
        bad = np.unique(cells[_sharpest(out, cells) < least, :3])
        bad = bad[~stays[bad]]
        if not len(bad):
            return out, int((stays & ~held).sum())
        stays[bad] = True


def _sharpest(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(ne,) smallest angle [degrees] of triangles; negative for one that is turned over."""
    xy = points[cells[:, :3]]
    ahead, back = np.roll(xy, -1, axis=1) - xy, np.roll(xy, 1, axis=1) - xy
    cross = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    return np.degrees(np.arctan2(cross, (ahead * back).sum(axis=2))).min(axis=1)

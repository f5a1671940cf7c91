"""Connected components, by their lowest member."""

from __future__ import annotations

import numpy as np


def united(n: int, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(n,) lowest member of the set that each of n things is in, when those of one and other (m,) are joined."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    _, part = connected_components(coo_array((np.ones(len(one)), (one, other)), shape=(n, n)), directed=False)
    _, lowest = np.unique(part, return_index=True)
    return lowest[part]


def spots(points: np.ndarray, distance: float, among: np.ndarray | None = None) -> np.ndarray:
    """(n,) the lowest of the points (n, dim) that are nearer to each other than the distance, one by one; among: only
    these (m,), others are alone."""
    from scipy.spatial import cKDTree

    rows = np.arange(len(points)) if among is None else among
    near = rows[cKDTree(points[rows]).query_pairs(distance, output_type="ndarray").reshape(-1, 2)]
    return united(len(points), near[:, 0], near[:, 1])

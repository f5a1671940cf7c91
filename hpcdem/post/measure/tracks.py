"""Selection of the particles whose paths are measured."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hpcdem.post.measure.grains import Grains


def nearest(g: Grains, points: np.ndarray, number: int = 1) -> np.ndarray:
    """Return the sorted ids of the `number` particles nearest to each of the points (m, 2) [m]."""
    found = []
    for x, y in np.asarray(points, dtype=float).reshape(-1, 2):
        away = np.hypot(g.x - x, g.y - y)
        found.append(g.gid[np.argsort(away, kind="stable")[:number]])
    return np.unique(np.concatenate(found)) if found else np.zeros(0, np.int64)


def spread(g: Grains, columns: int = 8, rows: int = 3) -> np.ndarray:
    """Return points (columns x rows, 2) spread evenly over the bed: in the middle of each column, between its lowest
    and its highest particle.
    """
    if not len(g):
        return np.zeros((0, 2))
    edges = np.linspace(float(np.min(g.x)), float(np.max(g.x)), columns + 1)
    points = []
    for left, right in pairwise(edges):
        y = g.y[(g.x >= left) & (g.x <= right)]
        if len(y):
            low, high = np.quantile(y, [0.02, 0.98])
            points += [((left + right) / 2.0, low + (high - low) * (k + 0.5) / rows) for k in range(rows)]
    return np.array(points)

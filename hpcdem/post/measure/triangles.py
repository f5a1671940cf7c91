"""Strain and area from the triangles between neighbouring grains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, QhullError


def triangles(x: np.ndarray, y: np.ndarray, reach: float) -> np.ndarray:
    """Return the corners (m, 3), as rows of particles, of the triangles between neighbouring grains (Delaunay).
    Triangles with a side longer than `reach` [m] span the surface or holes and are omitted.
    """
    points = np.column_stack([x, y])
    if len(points) < 3:
        return np.zeros((0, 3), np.int64)
    try:
        corners = Delaunay(points).simplices.astype(np.int64)
    except QhullError:  # all on one line
        return np.zeros((0, 3), np.int64)
    p = points[corners]
    sides = np.linalg.norm(p - np.roll(p, 1, axis=1), axis=2)
    return corners[sides.max(axis=1) <= reach]


def shares(x: np.ndarray, y: np.ndarray, r: np.ndarray, reach: float) -> np.ndarray:
    """(n,) [m2]: the part of the section that belongs to each grain, pores included.

    A triangle is shared out by the angles at its corners; where the section ends, the strip between the line of centres
    and the rim of the grains belongs to the two grains at its ends. A grain in no triangle has its own disc. So areas
    of layers add up to that of the section.
    """
    corners = triangles(x, y, reach)
    p = np.column_stack([x, y])[corners]
    result = np.zeros(len(x))
    ahead, behind = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    cross = np.abs(ahead[..., 0] * behind[..., 1] - ahead[..., 1] * behind[..., 0])
    angle = np.arctan2(cross, (ahead * behind).sum(axis=2))
    np.add.at(result, corners, angle / np.pi * (cross[:, :1] / 2.0))
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    edges, times = np.unique(edges, axis=0, return_counts=True)
    a, b = edges[times == 1].T if len(edges) else (np.zeros(0, np.int64),) * 2
    strip = np.hypot(x[a] - x[b], y[a] - y[b]) / 2.0
    np.add.at(result, a, strip * r[a])
    np.add.at(result, b, strip * r[b])
    alone = np.ones(len(x), bool)
    alone[corners] = False
    return np.where(alone, np.pi * r * r, result)


@dataclass(frozen=True)
class Strain:
    """Mean displacement gradient of square cells, in the places of the earlier frame unless asked otherwise.

    gradient: (rows, columns, 2, 2), ``gradient[..., i, j] = d u_i / d x_j``, NaN where no grains are; area: (rows,
    columns), of the bed in each cell [m2]; x, y: centres of columns and rows [m].
    """

    x: np.ndarray
    y: np.ndarray
    gradient: np.ndarray
    area: np.ndarray

    @property
    def distortion(self) -> np.ndarray:
        """Signed distortional strain: root of the second invariant of the deviator of the Lagrangian strain, positive
        where the top has moved to the right (forward thrusting), negative to the left."""
        f = self.gradient + np.eye(2)
        e = (np.swapaxes(f, -1, -2) @ f - np.eye(2)) / 2.0
        size = np.hypot((e[..., 0, 0] - e[..., 1, 1]) / 2.0, e[..., 0, 1])
        return np.sign(f[..., 0, 1] - f[..., 1, 0]) * size

    @property
    def rate(self) -> np.ndarray:
        """Signed largest shear strain of the linear theory (angle, not quadratic in large steps), signs as above."""
        h = self.gradient
        size = np.hypot(h[..., 0, 0] - h[..., 1, 1], h[..., 0, 1] + h[..., 1, 0])
        return np.sign(h[..., 0, 1] - h[..., 1, 0]) * size


def strain(
    x: np.ndarray, y: np.ndarray, dx: np.ndarray, dy: np.ndarray, cell: float, reach: float, later: bool = False
) -> Strain:
    """Gradient of the displacement, linear in the triangles between neighbouring grains, averaged over square cells.

    Triangles with a side longer than `reach` span the surface or holes and are left out. later: cells are in the places
    of the later frame; gradient and area stay those of the earlier one. Raises ValueError where no triangle is left.
    """
    points = np.column_stack([x, y])
    corners = triangles(x, y, reach)
    if not len(corners):
        raise ValueError("no grains are neighbours")
    p = points[corners]
    e1, e2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    double = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    u = np.column_stack([dx, dy])[corners]
    d1, d2 = u[:, 1] - u[:, 0], u[:, 2] - u[:, 0]
    # Gradient times area: (d1 x e2 - d2 x e1) / 2, so flat triangles do no harm.
    times_area = np.empty((len(corners), 2, 2))
    sign = np.sign(double)[:, None]
    times_area[:, :, 0] = (d1 * e2[:, 1:2] - d2 * e1[:, 1:2]) / 2.0 * sign
    times_area[:, :, 1] = (d2 * e1[:, 0:1] - d1 * e2[:, 0:1]) / 2.0 * sign

    centre = p.mean(axis=1) + (u.mean(axis=1) if later else 0.0)
    origin = np.floor((points + np.column_stack([dx, dy]) if later else points).min(axis=0) / cell) * cell
    column, row = np.floor((centre - origin) / cell).astype(np.int64).T
    shape = int(row.max()) + 1, int(column.max()) + 1
    flat = row * shape[1] + column
    count = shape[0] * shape[1]
    area = np.bincount(flat, np.abs(double) / 2.0, count)
    total = [np.bincount(flat, times_area[:, i, j], count) for i in (0, 1) for j in (0, 1)]
    with np.errstate(invalid="ignore", divide="ignore"):
        gradient = np.stack([t / area for t in total], axis=-1)
    at = [origin[k] + (np.arange(shape[1 - k]) + 0.5) * cell for k in (0, 1)]
    return Strain(at[0], at[1], gradient.reshape(*shape, 2, 2), area.reshape(shape))

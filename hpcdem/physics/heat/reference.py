"""One sub-step of heat, written plainly: the oracle of the kernels."""

from __future__ import annotations

import numpy as np


def sub_step(
    points: np.ndarray, triangles: np.ndarray, k: np.ndarray, capacity: np.ndarray, t: np.ndarray, dt: float,
    held: dict[int, float] | None = None,
) -> np.ndarray:  # fmt: skip
    """Temperatures (np,) after dt [s] of triangles (n, 3) with conductivities k (n, 2, 2) [W/(m K)] and heat capacities
    (n,) [J/(m3 K)]; held: temperature of points."""
    q, mass = np.zeros(len(points)), np.zeros(len(points))
    for corners, tensor, c in zip(triangles, k, capacity):
        matrix = np.column_stack([np.ones(3), points[corners]])
        area = 0.5 * np.linalg.det(matrix)
        slopes = np.linalg.inv(matrix)[1:]  # (2, 3) gradients of the shape functions
        q[corners] -= area * slopes.T @ tensor @ (slopes @ t[corners])
        mass[corners] += c * area / 3.0
    after = t + dt * q / mass
    for point, value in (held or {}).items():
        after[point] = value
    return after

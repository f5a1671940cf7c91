"""Principal stresses in space, by operations that give the same bits wherever a stress stands in memory (those of
LAPACK do not): Jacobi's rotations, as in kernels/plasticity.py."""

from __future__ import annotations

import numpy as np

SWEEPS = 5


def principal(stress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Principal values (n, 3), ascending, of symmetric matrices (n, 3, 3), and their axes (n, 3, 3) by columns."""
    s, axes = stress.copy(), np.broadcast_to(np.eye(3), stress.shape).copy()
    for _ in range(SWEEPS):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            r = 3 - p - q
            d, b = s[:, q, q] - s[:, p, p], 2.0 * s[:, p, q]
            whole = np.abs(d) + np.sqrt(d * d + b * b)
            t = np.where(d >= 0.0, b, -b) / np.where(whole > 0.0, whole, 1.0)
            cs = 1.0 / np.sqrt(1.0 + t * t)
            sn, more = t * cs, 0.5 * t * b
            s[:, p, p], s[:, q, q] = s[:, p, p] - more, s[:, q, q] + more
            s[:, p, q] = s[:, q, p] = 0.0
            u, w = s[:, r, p].copy(), s[:, r, q].copy()
            s[:, r, p] = s[:, p, r] = cs * u - sn * w
            s[:, r, q] = s[:, q, r] = sn * u + cs * w
            a, c = axes[:, :, p].copy(), axes[:, :, q].copy()
            axes[:, :, p], axes[:, :, q] = cs[:, None] * a - sn[:, None] * c, sn[:, None] * a + cs[:, None] * c
    values = s[:, range(3), range(3)]
    order = np.argsort(values, axis=1, kind="stable")
    return np.take_along_axis(values, order, axis=1), np.take_along_axis(axes, order[:, None, :], axis=2)

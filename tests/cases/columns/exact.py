"""V9, V10, V11: equal balls one above the other on a floor.

At rest the contact under the j-th ball from the top carries j m g, whatever the law: Fn(U_j) = j m g.

    Hertz:  U_j = (j m g / K)^(2/3), the same K at the wall (Rt = R) and between equal balls (Rt = R)
    linear: U_j = j m g / k

The heights follow: the j-th of N balls from the top stands at R + 2 R (N - j) - (U_j + ... + U_N).
"""

from __future__ import annotations

import math

import numpy as np

RADIUS, SHEAR, NU, DENSITY, GRAVITY = 60.0, 2.9e9, 0.2, 2500.0, 9.8
MASS = DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
K = 2.0 * SHEAR * math.sqrt(2.0 * RADIUS) / (3.0 * (1.0 - NU))


def hertz(n: int) -> np.ndarray:
    """U_1 .. U_n [m]."""
    return (np.arange(1, n + 1) * MASS * GRAVITY / K) ** (2.0 / 3.0)


def linear(n: int, k: float) -> np.ndarray:
    """U_1 .. U_n [m] for the pair stiffness k [N/m]."""
    return np.arange(1, n + 1) * MASS * GRAVITY / k


def heights(overlaps: np.ndarray) -> np.ndarray:
    """Centres from the top down [m]."""
    n = len(overlaps)
    return RADIUS * (2.0 * np.arange(n, 0, -1) - 1.0) - np.cumsum(overlaps[::-1])[::-1]

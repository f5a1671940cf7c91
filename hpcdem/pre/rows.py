"""GLINE: rows of equal particles."""

from __future__ import annotations

import math

import numpy as np


def row(p1: tuple[float, float], p2: tuple[float, float], rad: float, cratio: float) -> np.ndarray:
    """Return the centres (n, 2) [m] at P1 + k s e, s = 2 rad cratio, k = 0 .. floor(|P2 - P1| / s + 1e-9).

    The first centre is P1 itself; only then are published states of ZDEM in equilibrium.
    """
    spacing = 2.0 * rad * cratio
    length = math.dist(p1, p2)
    n = math.floor(length / spacing + 1e-9) + 1
    start = np.array(p1, dtype=np.float64)
    along = np.array(p2, dtype=np.float64) - start
    direction = along / length if length > 0.0 else along
    return start + (spacing * np.arange(n))[:, None] * direction

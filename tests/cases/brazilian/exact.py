"""Stress in an elastic disc of radius R between two forces P (per thickness) at (0, R) and (0, -R) towards its centre.

Each force alone, on a half plane, makes a stress -2 P cos(angle) / (pi r) along the line from it (Flamant). Together
they leave the traction -2 P / (pi D) along the normal on the circle, everywhere; a uniform tension of that size removes
it (Timoshenko & Goodier 1970, section 41). With r1, r2 the distances from the two forces:

    s_x = 2 P / (pi D) - 2 P / pi ((R - y) x2 / r1^4 + (R + y) x2 / r2^4)
    s_y = 2 P / (pi D) - 2 P / pi ((R - y)^3 / r1^4 + (R + y)^3 / r2^4)

In the centre 2 P / (pi D) and -6 P / (pi D): 1 and -3 in units of the former. The elements around the centre that are
averaged lie in a small circle, over which both are a little less.
"""

from __future__ import annotations

import numpy as np


def stress(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """s_x and s_y over 2 P / (pi D) at (x, y) / R."""
    r1, r2 = x * x + (1 - y) ** 2, x * x + (1 + y) ** 2
    across = 1 - 2 * ((1 - y) * x * x / r1**2 + (1 + y) * x * x / r2**2)
    along = 1 - 2 * ((1 - y) ** 3 / r1**2 + (1 + y) ** 3 / r2**2)
    return across, along


def mean_in_the_middle(radius: float, n: int = 400) -> tuple[float, float]:
    """Means of both over the circle of this radius (over R) around the centre."""
    r = radius * np.sqrt((np.arange(n) + 0.5) / n)  # rings of equal area
    t = 2 * np.pi * (np.arange(n) + 0.5) / n
    across, along = stress(*(np.outer(r, f(t)) for f in (np.cos, np.sin)))
    return float(across.mean()), float(along.mean())

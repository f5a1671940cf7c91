"""A thick ring under pressure p from inside, plane strain (Lame 1852; Timoshenko & Goodier, section 28). a, b: radii.

    s_r = p a2/(b2 - a2) (1 - b2/r2),  s_t = p a2/(b2 - a2) (1 + b2/r2),
    u_r = (1 + nu)/E  p a2/(b2 - a2) ((1 - 2 nu) r + b2/r)

At r = a: s_r = -p. Linear elements: displacements converge with the square of the element size, stresses, which are
constant in a triangle, with the first power, and with the square in the mean over an element.
"""

from __future__ import annotations

import numpy as np

A, B, P = 1.0, 3.0, 10e6


def stress(r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """s_r, s_t [Pa]."""
    k = P * A**2 / (B**2 - A**2)
    return k * (1.0 - B**2 / r**2), k * (1.0 + B**2 / r**2)


def moved(r: np.ndarray, young: float, poisson: float) -> np.ndarray:
    """u_r [m]."""
    return (1.0 + poisson) / young * P * A**2 / (B**2 - A**2) * ((1.0 - 2.0 * poisson) * r + B**2 / r)

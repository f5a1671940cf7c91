"""Stress around a circular hole in an infinite plate under far stress P1 along x and P2 along y (Kirsch 1898).

With radius a of the hole and polar coordinates (r, t), tension positive:

    s_r  = (P1 + P2)/2 (1 - a2/r2) + (P1 - P2)/2 (1 - 4 a2/r2 + 3 a4/r4) cos 2t
    s_t  = (P1 + P2)/2 (1 + a2/r2) - (P1 - P2)/2 (1 + 3 a4/r4) cos 2t
    s_rt = -(P1 - P2)/2 (1 + 2 a2/r2 - 3 a4/r4) sin 2t

Jaeger, Cook & Zimmerman (2007), section 8.5. At r = a they give s_r = s_rt = 0 and s_t = P1 + P2 - 2 (P1 - P2) cos 2t:
here -10 MPa at t = 0 and -50 MPa at t = 90 degrees.

The disk of the test ends at R = 20 a, where the tractions are those of the uniform far field; the difference is of the
order (a/R)2 = 0.25 %.
"""

from __future__ import annotations

import numpy as np

A, R, P1, P2 = 1.0, 20.0, -20e6, -10e6


def polar(r: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """s_r, s_t, s_rt [Pa] at r [m], t [rad]."""
    q = (A / r) ** 2
    mean, half = 0.5 * (P1 + P2), 0.5 * (P1 - P2)
    radial = mean * (1 - q) + half * (1 - 4 * q + 3 * q * q) * np.cos(2 * t)
    tangential = mean * (1 + q) - half * (1 + 3 * q * q) * np.cos(2 * t)
    shear = -half * (1 + 2 * q - 3 * q * q) * np.sin(2 * t)
    return radial, tangential, shear


def turned(xx: np.ndarray, yy: np.ndarray, xy: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """s_r, s_t, s_rt of stresses along x and y."""
    c, s = np.cos(t), np.sin(t)
    return (
        xx * c * c + yy * s * s + 2 * xy * s * c,
        xx * s * s + yy * c * c - 2 * xy * s * c,
        (yy - xx) * s * c + xy * (c * c - s * s),
    )

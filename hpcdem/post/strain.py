"""Strain from the displacements of particles: gradient of the displacement on a grid, deformation gradient on the
particles.

Between two frames the displacement near a node is fitted by least squares with u = u0 + H (x - x0) (the grid method of
SSPX: Cardozo & Allmendinger 2009, Computers & Geosciences 35, 1343-1357); dF = 1 + H goes to the particles by bilinear
interpolation, and F <- dF F. Both steps are exact for affine displacements, so a rigid rotation by any angle gives no
strain.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hpcdem.post import grid as grids

REACH = 1.5
"""Particles nearer to a node than this many spacings count in its fit."""
FLAT = 1e-4
"""The particles of a fit count as lying on a line when the variance across it is less than this part of that along."""

Sums = Callable[..., dict[str, np.ndarray]]


def gradient(
    grid: grids.Grid, x: np.ndarray, y: np.ndarray, u: np.ndarray, v: np.ndarray, sums: Sums = grids.sums
) -> np.ndarray:
    """(ny, nx, 4): H = du/dx, du/dy, dv/dx, dv/dy at each node from displacements u, v [m] of particles at x, y [m];
    NaN where there are fewer than three particles in reach, or all on a line."""
    # A common displacement says nothing about H, but would cost digits.
    u, v = u - np.mean(u), v - np.mean(v)
    s = sums(grid, x, y, {"u": u, "v": v}, REACH, moments=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        n = s["number"]
        mx, my = s["x"] / n, s["y"] / n
        xx, xy, yy = s["xx"] - s["x"] * mx, s["xy"] - s["x"] * my, s["yy"] - s["y"] * my
        det = xx * yy - xy * xy
        rows = []
        for name in "uv":
            cx, cy = s[f"{name} x"] - s[name] * mx, s[f"{name} y"] - s[name] * my
            rows += [(yy * cx - xy * cy) / det, (xx * cy - xy * cx) / det]
        result = np.stack(rows, axis=2) / grid.size
        result[~((n >= 3) & (det > FLAT * (xx + yy) ** 2))] = np.nan
    return result


def increment(
    size: float,
    x: np.ndarray,
    y: np.ndarray,
    radius: np.ndarray,
    u: np.ndarray,
    v: np.ndarray,
    sums: Sums = grids.sums,
) -> np.ndarray:
    """(n, 4): dF = xx, xy, yx, yy on particles that moved by u, v; NaN where no node around has a gradient."""
    if len(x) == 0:
        return np.zeros((0, 4))
    grid = grids.cover(size, x, y, radius)
    return grids.between(grid, gradient(grid, x, y, u, v, sums), x, y) + IDENTITY


IDENTITY = np.array([1.0, 0.0, 0.0, 1.0])
"""F of a particle that is new: xx, xy, yx, yy."""


def times(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n, 4): products a b of 2 x 2 matrices stored as xx, xy, yx, yy."""
    axx, axy, ayx, ayy = a.T
    bxx, bxy, byx, byy = b.T
    return np.stack(
        [axx * bxx + axy * byx, axx * bxy + axy * byy, ayx * bxx + ayy * byx, ayx * bxy + ayy * byy], axis=1
    )


def volumetric(f: np.ndarray) -> np.ndarray:
    """(n,): 100 (det F - 1) [%], positive for growth."""
    return 100.0 * (f[:, 0] * f[:, 3] - f[:, 1] * f[:, 2] - 1.0)


def distortional(f: np.ndarray) -> np.ndarray:
    """(n,): s sqrt(J2) of the deviator of E = (F^T F - 1) / 2, J2 = ((Exx - Eyy) / 2)^2 + Exy^2.

    s is the sign of F_xy - F_yx, + for clockwise (top to the right) shear; + too where there is no rotation.
    """
    fxx, fxy, fyx, fyy = f.T
    exx, eyy = 0.5 * (fxx * fxx + fyx * fyx), 0.5 * (fxy * fxy + fyy * fyy)
    size = np.hypot(0.5 * (exx - eyy), 0.5 * (fxx * fxy + fyx * fyy))
    return np.where(fxy - fyx < 0.0, -size, size)

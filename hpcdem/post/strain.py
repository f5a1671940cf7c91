"""Strain from the displacements of particles: gradient of the displacement, deformation gradient on the particles.

Between two frames displacements are fitted by least squares with u = u0 + H (x - x0), dF = 1 + H, and F <- dF F
(SSPX: Cardozo & Allmendinger 2009, Computers & Geosciences 35, 1343-1357). `nearest` fits a particle and its nearest
neighbours, as sharp as particles can tell; `increment` fits what lies around the nodes of a grid, and brings dF to the
particles by bilinear interpolation. Both are exact for affine displacements, so a rigid rotation by any angle gives no
strain. A fit with det dF <= 0 turns the material inside out, which says only that neighbours have parted: it is no dF.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import cKDTree

from hpcdem.post import grid as grids

REACH = 1.5
"""Distance in spacings from a node, or from a particle, up to which particles belong to its fit."""
NEIGHBOURS = (6, 12, 18)
"""A fit has the first ring of a dense packing; two or three times as many particles where that gives no dF."""
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


def nearest(
    size: float, x: np.ndarray, y: np.ndarray, u: np.ndarray, v: np.ndarray, counts: Sequence[int] = NEIGHBOURS,
    positive: bool = True,
) -> np.ndarray:  # fmt: skip
    """(n, 4): dF = xx, xy, yx, yy of particles at x, y [m] that moved by u, v [m]: each fitted with its nearest
    neighbours (counts) within REACH x size, all with the weight 1. NaN where these are fewer than two, or all on a
    line, or, where only `positive` ones count, no number of them gives a det dF > 0."""
    n = len(x)
    result = np.full((n, 4), np.nan)
    if n < 3:
        return result
    places = np.stack([x, y], axis=1)
    moved = np.stack([u - np.mean(u), v - np.mean(v)], axis=1)
    tree = cKDTree(places)
    open_rows = np.arange(n)
    for count in counts:
        distance, row = tree.query(places[open_rows], min(count + 1, n), distance_upper_bound=REACH * size)
        near = np.isfinite(distance)
        row = np.where(near, row, open_rows[:, None])
        d = (places[row] - places[open_rows, None]) * near[..., None]
        w = (moved[row] - moved[open_rows, None]) * near[..., None]
        number = near.sum(axis=1)
        df = _fit(number, d, w)
        known = _det(df) > 0.0 if positive else np.isfinite(df).all(axis=1)
        result[open_rows[known]] = df[known]
        open_rows = open_rows[~known]
        if not len(open_rows):
            break
    return result


def _fit(number: np.ndarray, d: np.ndarray, w: np.ndarray) -> np.ndarray:
    """(m, 4): 1 + H by least squares from the `number` (m,) of points at d (m, k, 2) that moved by w (m, k, 2); those
    that do not count are zeros. NaN for fewer than three points, or all on a line."""
    with np.errstate(invalid="ignore", divide="ignore"):
        middle = d.sum(axis=1) / number[:, None]
        moment = np.einsum("mki,mkj->mij", d, d) - number[:, None, None] * middle[:, :, None] * middle[:, None, :]
        cross = np.einsum("mki,mkj->mij", w, d) - w.sum(axis=1)[:, :, None] * middle[:, None, :]
        xx, xy, yy = moment[:, 0, 0], moment[:, 0, 1], moment[:, 1, 1]
        det = xx * yy - xy * xy
        (ux, uy), (vx, vy) = cross[:, 0].T, cross[:, 1].T
        columns = [yy * ux - xy * uy, xx * uy - xy * ux, yy * vx - xy * vy, xx * vy - xy * vx]
        result = np.stack([c / det for c in columns], axis=1) + IDENTITY
        result[~((number >= 3) & (det > FLAT * (xx + yy) ** 2))] = np.nan
    return result


def _det(f: np.ndarray) -> np.ndarray:
    """(n,): determinants of matrices stored as xx, xy, yx, yy."""
    return f[:, 0] * f[:, 3] - f[:, 1] * f[:, 2]


def increment(
    size: float,
    x: np.ndarray,
    y: np.ndarray,
    radius: np.ndarray,
    u: np.ndarray,
    v: np.ndarray,
    sums: Sums = grids.sums,
) -> np.ndarray:
    """(n, 4): dF = xx, xy, yx, yy on particles that moved by u, v; NaN where no node around has a gradient, or
    det dF <= 0."""
    if len(x) == 0:
        return np.zeros((0, 4))
    grid = grids.cover(size, x, y, radius)
    df = grids.between(grid, gradient(grid, x, y, u, v, sums), x, y) + IDENTITY
    df[~(_det(df) > 0.0)] = np.nan
    return df


IDENTITY = np.array([1.0, 0.0, 0.0, 1.0])
"""Deformation gradient F of a new particle: xx, xy, yx, yy."""


def times(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n, 4): products a b of 2 x 2 matrices stored as xx, xy, yx, yy."""
    axx, axy, ayx, ayy = a.T
    bxx, bxy, byx, byy = b.T
    return np.stack(
        [axx * bxx + axy * byx, axx * bxy + axy * byy, ayx * bxx + ayy * byx, ayx * bxy + ayy * byy], axis=1
    )


def page_volume(size: float, x: np.ndarray, y: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(n,): 100 (det(1 + du/dx) - 1) [%] of displacements u, v since the beginning, with x, y and the neighbours those
    of the present: what the manual's pages draw as volumetric strain. It is no change of volume: a rotation by 25
    degrees gives +37 %, and many values lie below -100 %."""
    return volumetric(nearest(size, x, y, u, v, NEIGHBOURS[:1], positive=False))


def mean_volume(
    grid: grids.Grid, x: np.ndarray, y: np.ndarray, weight: np.ndarray, values: np.ndarray, spread: float
) -> np.ndarray:
    """(ny, nx): means around the nodes of values (n,) of particles of these earlier volumes, with a Gaussian of the
    standard deviation `spread` [m]. Volumes add, so this mean of det F - 1 is the change of volume of what lies around
    the node. A wave of length L keeps exp(-2 (pi spread / L)^2) of its amplitude."""
    from scipy import ndimage

    a, b = x / grid.size - grid.column, y / grid.size - grid.row
    i, j = (np.clip(np.floor(c).astype(np.int64), 0, n - 2) for c, n in ((a, grid.nx), (b, grid.ny)))
    sums = []
    for what in (weight * values, weight):
        total = np.zeros(grid.ny * grid.nx)
        for row, column in ((0, 0), (0, 1), (1, 0), (1, 1)):
            part = (a - i if column else 1.0 - (a - i)) * (b - j if row else 1.0 - (b - j))
            total += np.bincount((j + row) * grid.nx + i + column, part * what, grid.ny * grid.nx)
        field = total.reshape(grid.ny, grid.nx)
        sums.append(ndimage.gaussian_filter(field, spread / grid.size, mode="constant", truncate=TRUNCATE))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(sums[1] > 0.0, sums[0] / sums[1], np.nan)


TRUNCATE = 3.0
"""Gaussian means end at this many standard deviations."""


def volumetric(f: np.ndarray) -> np.ndarray:
    """(n,): 100 (det F - 1) [%], positive for growth."""
    return 100.0 * (_det(f) - 1.0)


def distortional(f: np.ndarray) -> np.ndarray:
    """(n,): s sqrt(J2) of the deviator of E = (F^T F - 1) / 2, J2 = ((Exx - Eyy) / 2)^2 + Exy^2.

    s is the sign of F_xy - F_yx, + for clockwise (top to the right) shear; + too where there is no rotation.
    """
    fxx, fxy, fyx, fyy = f.T
    exx, eyy = 0.5 * (fxx * fxx + fyx * fyx), 0.5 * (fxy * fxy + fyy * fyy)
    size = np.hypot(0.5 * (exx - eyy), 0.5 * (fxx * fxy + fyx * fyy))
    return np.where(fxy - fyx < 0.0, -size, size)

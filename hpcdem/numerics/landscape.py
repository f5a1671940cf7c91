"""Change of a land surface, given as mean heights of adjacent columns: pure functions of arrays.

Diffusion and avalanches exchange area between neighbouring columns. Both return the area that passes the boundaries
between columns, positive to the right, so that what leaves one column enters the next one. Heights of NaN are columns
without ground: nothing passes their sides.

Diffusion of topography: Culling 1960, J. Geol. 68, 336; limited slopes: Burbank et al. 1996, Nature 379, 505.
"""

from __future__ import annotations

import math

import numpy as np

MOST_PARTS, LEAST_PARTS = 100, 4
"""Largest and smallest number of implicit steps into which an interval of diffusion is divided."""
SWEEPS = 200
CLOSE = 1e-6
"""Change of a slope, relative to the largest one, at which avalanches end."""


def edges(left: float, right: float, spacing: float) -> tuple[int, np.ndarray]:
    """Sides (n + 1,) of columns between two positions [m]: multiples of the spacing, without outer columns narrower
    than half of it, which belong to their neighbours. Returns the number of the first column with them; column k covers
    [k, k + 1] spacing, as far as it is not cut or extended."""
    first, last = math.floor(left / spacing), max(math.ceil(right / spacing), math.floor(left / spacing) + 1)
    sides = np.arange(first, last + 1) * spacing
    sides[0], sides[-1] = left, right
    if len(sides) > 2 and sides[1] - sides[0] < 0.5 * spacing:
        sides, first = np.delete(sides, 1), first + 1
    if len(sides) > 2 and sides[-1] - sides[-2] < 0.5 * spacing:
        sides = np.delete(sides, -2)
    return first, sides


def spacings(width: np.ndarray) -> np.ndarray:
    """Distances (n - 1,) of the middles of columns of widths (n,) [m]."""
    distance: np.ndarray = 0.5 * (width[:-1] + width[1:])
    return distance


def moved(height: np.ndarray, width: np.ndarray, passed: np.ndarray) -> np.ndarray:
    """Heights (n,) after areas (n - 1,) [m2] have passed the boundaries of columns."""
    return height + change(passed) / width


def change(passed: np.ndarray) -> np.ndarray:
    """Gain (n,) of columns by what passes their boundaries (n - 1,)."""
    gain = np.zeros(len(passed) + 1, passed.dtype)
    gain[:-1] -= passed
    gain[1:] += passed
    return gain


def diffused(height: np.ndarray, width: np.ndarray, spread: float) -> np.ndarray:
    """Area (n - 1,) [m2] that diffusion moves between columns; spread [m2]: coefficient times duration.

    Implicit steps (backward Euler), stable for any spread; no flow through the outer sides.
    """
    from scipy.linalg import solveh_banded  # slow to import, and seldom needed

    if len(height) < 2 or spread <= 0.0:
        return np.zeros(max(len(height) - 1, 0))
    distance = spacings(width)
    closed = np.isnan(height[:-1]) | np.isnan(height[1:])
    parts = min(max(math.ceil(2.0 * spread / float(distance.min()) ** 2), LEAST_PARTS), MOST_PARTS)
    rate = np.where(closed, 0.0, spread / parts / distance)
    h, total = np.where(np.isnan(height), 0.0, height), np.zeros(len(rate))
    matrix = np.stack([np.insert(-rate, 0, 0.0), width + np.append(rate, 0.0) + np.insert(rate, 0, 0.0)])
    for _ in range(parts):
        h = solveh_banded(matrix, width * h, check_finite=False)
        total -= rate * np.diff(h)
    return total


def avalanches(height: np.ndarray, width: np.ndarray, slope: float) -> np.ndarray:
    """Area (n - 1,) [m2] that slides down between columns until no slope exceeds `slope` (rise over run).

    Slopes to the right and to the left are limited in turn, each by the nearest heights of equal area (isotonic
    regression), until neither is too steep.
    """
    passed = np.zeros(max(len(height) - 1, 0))
    ground = ~np.isnan(height)
    for piece in np.split(np.arange(len(height)), np.flatnonzero(np.diff(ground)) + 1):
        h, w = height[piece], width[piece]
        if ground[piece[0]] and (np.abs(np.diff(h)) > slope * spacings(w) * (1.0 + CLOSE)).any():
            descent = np.append(0.0, np.cumsum(slope * spacings(w)))
            limited_h = h
            for _ in range(SWEEPS):
                before = limited_h
                limited_h = _ascending(limited_h + descent, w) - descent
                limited_h = _ascending((limited_h - descent)[::-1], w[::-1])[::-1] + descent
                if np.abs(limited_h - before).max() <= CLOSE * slope * float(w.min()):
                    break
            passed[piece[:-1]] = -np.cumsum((limited_h - h) * w)[:-1]
    return passed


def _ascending(values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Nearest ascending values (n,) of equal weighted sum: neighbours that descend take their mean."""
    if (np.diff(values) >= 0.0).all():
        return values
    blocks: list[tuple[float, float, int]] = []  # mean, weight, number
    for value, w in zip(values.tolist(), weight.tolist()):
        mean, total, number = value, w, 1
        while blocks and blocks[-1][0] > mean:
            other, more, count = blocks.pop()
            mean, total, number = (mean * total + other * more) / (total + more), total + more, number + count
        blocks.append((mean, total, number))
    return np.repeat([mean for mean, _, _ in blocks], [number for _, _, number in blocks])


def limited(passed: np.ndarray, available: np.ndarray) -> np.ndarray:
    """Areas (n - 1,) reduced where a column (n,) would lose more than is available in it."""
    out = np.append(np.maximum(passed, 0.0), 0.0) + np.insert(np.maximum(-passed, 0.0), 0, 0.0)
    share = np.minimum(1.0, np.divide(available, out, out=np.ones_like(out), where=out > available))
    reduced: np.ndarray = passed * np.where(passed > 0.0, share[:-1], share[1:])
    return reduced


def lowered(height: np.ndarray, most: float, level: float) -> np.ndarray:
    """Loss (n,) [m], not positive, of what lies above a level, `most` at most."""
    return -np.where(np.isnan(height), 0.0, np.clip(height - level, 0.0, most))


def raised(height: np.ndarray, most: float, level: float) -> np.ndarray:
    """Gain (n,) [m], not negative, of what lies below a level, `most` at most."""
    return np.where(np.isnan(height), 0.0, np.clip(level - height, 0.0, most))


COMPACTIONS = 32
"""Number of equal steps by which the porosity decreases from that at the surface to zero."""


def compaction(depth: np.ndarray, scale: float) -> np.ndarray:
    """Number (n,) i8 of steps by which porosity has decreased at these depths [m]: p0 exp(-depth / scale) at most.

    Source: Athy 1930, AAPG Bulletin 14, 1.
    """
    steps = COMPACTIONS * (1.0 - np.exp(-np.maximum(depth, 0.0) / scale))
    return np.floor(steps).astype(np.int64)


def shrinkage(level: int, porosity: float) -> float:
    """Length of a side of sediment over that at the surface, of which the solid area is the same."""
    return math.sqrt((1.0 - porosity) / (1.0 - porosity * (1.0 - level / COMPACTIONS)))

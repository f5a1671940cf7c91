"""Where a disc that is laid on others comes to rest: the lowest hollow between two positions, seen from above."""

from __future__ import annotations

import numpy as np

FINE, LEVELS = 48, 3
"""Number of positions that are compared, and number of refinements of the interval around the best one."""


def top(at: np.ndarray, radius: float, discs: np.ndarray, walls: np.ndarray) -> np.ndarray:
    """Return the heights (n,) [m] at which the centre of a disc of this radius stops when it falls at x = at (n,).

    discs: (m, 3) x, y, r; walls: (k, 4) x1 y1 x2 y2. Flat walls support the disc; steep ones, regarded as infinitely
    high, keep it at a distance of its radius (inf). -inf where nothing stops it.
    """
    height = np.full(len(at), -np.inf)
    if len(discs):
        square = (discs[:, 2] + radius) ** 2 - (at[:, None] - discs[:, 0]) ** 2
        over = np.where(square >= 0.0, discs[:, 1] + np.sqrt(np.maximum(square, 0.0)), -np.inf)
        height = over.max(axis=1)
    for x1, y1, x2, y2 in walls:
        low, high = min(x1, x2), max(x1, x2)
        if is_steep(x1, y1, x2, y2):
            height[(at > low - radius) & (at < high + radius)] = np.inf
            continue
        rise = (y2 - y1) / (x2 - x1)
        shift = radius / np.sqrt(1.0 + rise * rise)  # from the foot of the disc to its centre, upwards
        foot = at + shift * rise
        on = (foot >= low) & (foot <= high)
        height[on] = np.maximum(height[on], (y1 + rise * (foot - x1) + shift)[on])
    return height


def is_steep(x1: float, y1: float, x2: float, y2: float) -> bool:
    """Return whether a wall rises at more than 45 degrees."""
    return bool(abs(y2 - y1) > abs(x2 - x1))


def resting(
    left: float, right: float, radius: float, discs: np.ndarray, walls: np.ndarray
) -> tuple[float, float] | None:
    """Return the centre of a disc in the lowest hollow between two positions, in contact and without overlap; without a
    hollow the lowest position, None if nothing supports it.
    """
    near = discs[(discs[:, 0] > left - discs[:, 2] - radius) & (discs[:, 0] < right + discs[:, 2] + radius)]
    at = np.linspace(left, right, FINE + 1)
    height = top(at, radius, near, walls)
    possible = np.isfinite(height)
    if not possible.any():
        return None
    inner = np.zeros(len(at), bool)
    inner[1:-1] = (height[1:-1] <= height[:-2]) & (height[1:-1] <= height[2:])
    chosen = possible & inner if (possible & inner).any() else possible
    k = int(np.argmin(np.where(chosen, height, np.inf)))
    for _ in range(LEVELS):
        at = np.linspace(at[max(k - 1, 0)], at[min(k + 1, len(at) - 1)], FINE + 1)
        height = top(at, radius, near, walls)
        k = int(np.argmin(np.where(np.isfinite(height), height, np.inf)))
    return float(at[k]), float(height[k])

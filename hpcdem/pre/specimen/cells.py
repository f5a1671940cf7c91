"""Loose placement: one grain in each cell of a square grid, as in the original pre-processor."""

from __future__ import annotations

import math

import numpy as np

from hpcdem.pre.specimen.shapes import numbers

ORDER, ACROSS, UP = 21, 22, 23
"""Numbers of the streams of random numbers."""


def order(number: int, seed: int) -> np.ndarray:
    """A random order of so many grains."""
    return np.argsort(numbers(seed, ORDER, number), kind="stable")


def in_cells(radius: np.ndarray, width: float, factor: float, seed: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Centres x, y (n,) f8 [m], and the height of all cells [m].

    radius (n,) f8 [m]: circles that hold the grains, in the order in which they fill the cells, from left to right and
    from the bottom to the top. Cells are `factor` times the largest diameter high, and wide enough to fill the width.
    The centre is anywhere in the cell where the whole circle is inside, so nothing overlaps.
    """
    n = len(radius)
    side = factor * 2.0 * float(radius.max())
    columns = max(1, math.floor(width / side))
    across = width / columns
    k = np.arange(n)
    x = across * (k % columns) + radius + numbers(seed, ACROSS, n) * (across - 2.0 * radius)
    y = side * (k // columns) + radius + numbers(seed, UP, n) * (side - 2.0 * radius)
    return x, y, side * math.ceil(n / columns)

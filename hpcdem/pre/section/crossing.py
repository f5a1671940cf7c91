"""Search for pairs of discs on opposite sides of a line."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np


def crossing(first: np.ndarray, second: np.ndarray, lines: Iterable[np.ndarray]) -> np.ndarray:
    """(n,) bool: the straight line between points first and second (n, 2) crosses one of the lines (m, 2).

    A point on a line counts as right of it, and an end of a line as right of the pair, so that a pair that passes
    through a corner of a line crosses it, and one that ends on a line is on one side of it.
    """
    found = np.zeros(len(first), bool)
    low, high = np.minimum(first, second), np.maximum(first, second)
    for line in lines:
        for a, b in pairwise(line):
            near = np.flatnonzero(
                ((low <= np.maximum(a, b)) & (high >= np.minimum(a, b))).all(axis=1) & ~found
            )  # boxes touch
            p, q = first[near], second[near]
            apart = (_left(a, b, p) != _left(a, b, q)) & (_left(p, q, a) != _left(p, q, b))
            found[near[apart]] = True
    return found


def _left(a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return whether p lies left of the line from a to b."""
    ab, ap = b - a, p - a
    left: np.ndarray = ab[..., 0] * ap[..., 1] - ab[..., 1] * ap[..., 0] > 0.0
    return left

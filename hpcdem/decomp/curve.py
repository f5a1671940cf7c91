"""The order of the cells of space along Hilbert's curve. Pure functions of arrays.

Space is cut into cubes of a side of at least one reach. A grid of 2^levels cubes along each axis covers the model; what
lies outside of it counts to the cubes at its faces. The curve passes every cube once, from neighbour to neighbour, so a
piece of it is compact: its surface grows with its volume to the power 2/3, where slabs keep theirs.

The key of a cube is its position along the curve (Skilling 2004, "Programming the Hilbert curve").
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from hpcdem.core.cells import first_not_before, index

MOST_LEVELS = 20
"""Keys have three bits per level, and 63 at most."""


class Grid(NamedTuple):
    """side of the cubes [m]; first cube along x, y, z; levels: log2 of the cubes along an axis."""

    side: float
    first: tuple[int, int, int]
    levels: int

    @staticmethod
    def around(low: np.ndarray, high: np.ndarray, side: float) -> Grid:
        """The smallest one that covers the box from low to high (3,) [m], in its middle."""
        ends = [(index(a, side), index(b, side)) for a, b in zip(low.tolist(), high.tolist())]
        most = max(b - a + 1 for a, b in ends)
        levels = min(max(int(most - 1).bit_length(), 1), MOST_LEVELS)
        first = [(a + b + 1 - (1 << levels)) // 2 for a, b in ends]
        return Grid(side, (first[0], first[1], first[2]), levels)

    def keys(self, points: np.ndarray) -> np.ndarray:
        """(n,) i8 of points (n, 3) [m]."""
        return _keys(points, self.side, *self.first, self.levels)

    def beside(self, cells: np.ndarray) -> np.ndarray:
        """Keys (n, 27) of cubes (n,) and of the 26 around each; where the grid ends that of the cube itself."""
        return _beside(cells, self.levels)


def overlapping(cell: np.ndarray, boxes: np.ndarray, beside: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Indices of rows in cubes cell (n,), ascending, whose boxes (n, 6) overlap one of others (m, 6) that is beside:
    in one of the cubes beside (m, 27)."""
    chosen = np.zeros(len(cell), np.bool_)
    _overlap(cell, boxes, beside, others, chosen)
    return np.flatnonzero(chosen)


@njit(cache=True, nogil=True, error_model="numpy")
def key_of(i, j, k, levels):
    """Position on the curve of the cube (i, j, k), each from 0 to 2^levels - 1."""
    bit = 1 << (levels - 1)
    while bit > 1:
        below = bit - 1
        if i & bit:
            i ^= below
        if j & bit:
            i ^= below
        else:
            swap = (i ^ j) & below
            i ^= swap
            j ^= swap
        if k & bit:
            i ^= below
        else:
            swap = (i ^ k) & below
            i ^= swap
            k ^= swap
        bit >>= 1
    j ^= i
    k ^= j
    flip, bit = 0, 1 << (levels - 1)
    while bit > 1:
        if k & bit:
            flip ^= bit - 1
        bit >>= 1
    i, j, k = i ^ flip, j ^ flip, k ^ flip
    key = 0
    for level in range(levels - 1, -1, -1):
        key = (key << 3) | ((i >> level & 1) << 2) | ((j >> level & 1) << 1) | (k >> level & 1)
    return key


@njit(cache=True, nogil=True, error_model="numpy")
def cube_of(key, levels):
    """The inverse of `key_of`."""
    i = j = k = 0
    for level in range(levels - 1, -1, -1):
        part = key >> (3 * level)
        i, j, k = (i << 1) | (part >> 2 & 1), (j << 1) | (part >> 1 & 1), (k << 1) | (part & 1)
    flip = k >> 1
    k ^= j
    j ^= i
    i ^= flip
    bit = 2
    while bit < 1 << levels:
        below = bit - 1
        if k & bit:
            i ^= below
        else:
            swap = (i ^ k) & below
            i ^= swap
            k ^= swap
        if j & bit:
            i ^= below
        else:
            swap = (i ^ j) & below
            i ^= swap
            j ^= swap
        if i & bit:
            i ^= below
        bit <<= 1
    return i, j, k


@njit(cache=True, nogil=True, error_model="numpy")
def _keys(points, side, first_i, first_j, first_k, levels):
    out = np.empty(len(points), np.int64)
    last = (1 << levels) - 1
    for n in range(len(points)):
        i = min(max(index(points[n, 0], side) - first_i, 0), last)
        j = min(max(index(points[n, 1], side) - first_j, 0), last)
        k = min(max(index(points[n, 2], side) - first_k, 0), last)
        out[n] = key_of(i, j, k, levels)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _beside(cells, levels):
    out = np.empty((len(cells), 27), np.int64)
    last = (1 << levels) - 1
    for n in range(len(cells)):
        i, j, k = cube_of(cells[n], levels)
        m = 0
        for a in range(i - 1, i + 2):
            for b in range(j - 1, j + 2):
                for c in range(k - 1, k + 2):
                    inside = min(a, b, c) >= 0 and max(a, b, c) <= last
                    out[n, m] = key_of(a, b, c, levels) if inside else cells[n]
                    m += 1
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _overlap(cell, boxes, beside, others, chosen):
    n = len(cell)
    for m in range(len(others)):
        for c in range(beside.shape[1]):
            key = beside[m, c]
            at = first_not_before(cell, key, 0, n)
            while at < n and cell[at] == key:
                if not chosen[at]:
                    meet = True
                    for k in range(3):
                        meet &= boxes[at, k] <= others[m, 3 + k] and others[m, k] <= boxes[at, 3 + k]
                    chosen[at] = meet
                at += 1

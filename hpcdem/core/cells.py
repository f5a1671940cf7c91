"""Square cells of the plane and the numbers they go by.

The cell of a point has a column (from its x) and a row (from its y). Its *key* is one integer, column * 2^32 + row, so
keys are in the order of (column, row): the order in which particles are stored.
"""

from __future__ import annotations

import numpy as np
from numba import njit

FARTHEST = 1 << 28
"""Columns and rows are clamped to +- this, so that an escaped particle costs nothing."""
COLUMN = 1 << 32
"""From one column to the next."""


@njit(cache=True, nogil=True, error_model="numpy")
def index(value, side):
    """Column or row of a coordinate [m]; not-a-number goes to the last one. Never falls when the coordinate grows."""
    scaled = np.floor(value / side)
    return np.int64(max(scaled, -1.0 * FARTHEST) if scaled < FARTHEST else 1.0 * FARTHEST)


@njit(cache=True, nogil=True, error_model="numpy")
def keys(points, side):
    """Keys (n,) i8 of points: rows of a table that begin with x, y [m]."""
    out = np.empty(len(points), np.int64)
    for i in range(len(points)):
        out[i] = index(points[i, 0], side) * COLUMN + index(points[i, 1], side)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def columns(keys):
    """Columns (n,) i8 of cells."""
    out = np.empty(len(keys), np.int64)
    for i in range(len(keys)):
        out[i] = column(keys[i])
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def column(key):
    """Column of a cell."""
    return (key + COLUMN // 2) >> 32


@njit(cache=True, nogil=True, error_model="numpy")
def row(key):
    """Row of a cell."""
    return key - column(key) * COLUMN


@njit(cache=True, nogil=True, error_model="numpy")
def first_not_before(keys, key, begin, end):
    """Index of the first of keys[begin:end], ascending, that is not less than `key`; else `end`."""
    while begin < end:
        middle = (begin + end) // 2
        if keys[middle] < key:
            begin = middle + 1
        else:
            end = middle
    return begin

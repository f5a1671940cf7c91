"""Memory for tables whose rows are read one at a time."""

from __future__ import annotations

import math
import mmap
from typing import Any

import numpy as np
from numba import njit, prange

LINE = 64
"""Bytes of a cache line."""


def aligned(shape: tuple[int, ...]) -> np.ndarray:
    """f8 array, not initialised, that begins on a cache line: rows of 64 bytes lie in one line each, not across two."""
    count = math.prod(shape)
    block = np.empty(8 * count + LINE, np.uint8)
    start = -block.ctypes.data % LINE
    return block[start : start + 8 * count].view(np.float64).reshape(shape)


def sparse_zeros(shape: int | tuple[int, ...], dtype: Any = np.float64) -> np.ndarray:
    """Zeros that use memory only where they are written, page by page: for tables that most models do not use.
    numpy.zeros cuts tables of up to 32 MB out of memory that was used before, and writes the zeros."""
    shape = (shape,) if isinstance(shape, int) else shape
    count = math.prod(shape)
    if count * np.dtype(dtype).itemsize < mmap.PAGESIZE:
        return np.zeros(shape, dtype)
    pages = mmap.mmap(-1, count * np.dtype(dtype).itemsize, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    return np.frombuffer(pages, dtype).reshape(shape)


def take_rows(rows: np.ndarray, order: np.ndarray, out: np.ndarray, threads: int = 1) -> np.ndarray:
    """out[k] = rows[order[k]] for tables (n, w) f8; returns out."""
    if threads == 1:
        _take(0, 1, rows, order, out)
    else:
        _take_threaded(threads, rows, order, out)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _take(t, parts, rows, order, out):
    n = len(order)
    for k in range(n * t // parts, n * (t + 1) // parts):
        i = order[k]
        for c in range(rows.shape[1]):
            out[k, c] = rows[i, c]


@njit(cache=True, parallel=True, error_model="numpy")
def _take_threaded(parts, rows, order, out):
    for t in prange(parts):
        _take(t, parts, rows, order, out)

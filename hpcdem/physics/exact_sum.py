"""Sums of floating-point numbers that do not depend on order, hence not on ranks or threads.

Every double is an integer times a power of two; integers are summed exactly, one bin per exponent, and rounded once
at the end. Used wherever a sum is written to a file or feeds back into the run.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

_LOW = 26  # the 53-bit mantissa is split in 27 + 26 bits, so that 2**26 of them fit a double exactly
_BINS = 2112
_SHIFT = 1080


def partial_bins(values: np.ndarray) -> np.ndarray:
    """Exact sums of `values` (any shape) by exponent: (2, 2112) int64; NaN and infinities must be kept out."""
    values = np.ascontiguousarray(values, dtype=np.float64).ravel()
    bins = np.zeros((2, _BINS), dtype=np.int64)
    for start in range(0, len(values), 1 << 25):
        mantissa, exponent = np.frexp(values[start : start + (1 << 25)])
        whole = (mantissa * 9007199254740992.0).astype(np.int64)
        slot = exponent.astype(np.int64) + _SHIFT
        high = whole >> _LOW
        low = whole - (high << _LOW)
        for row, part in enumerate((high, low)):
            bins[row] += np.bincount(slot, weights=part, minlength=_BINS).astype(np.int64)
    return bins


def rounded(bins: np.ndarray) -> float:
    """The double nearest to the exact value of `bins` (as made by `partial_bins`, possibly added up)."""
    total = 0
    used = np.flatnonzero(bins.any(axis=0))
    if not len(used):
        return 0.0
    base = int(used[0])
    for slot in used:
        total += ((int(bins[0, slot]) << _LOW) + int(bins[1, slot])) << (int(slot) - base)
    exponent = base - _SHIFT - 53
    try:  # int / int is correctly rounded in Python
        return float(total << exponent) if exponent >= 0 else total / (1 << -exponent)
    except OverflowError:
        return math.inf if total > 0 else -math.inf


def exact_sum(values: np.ndarray, comm: Any) -> float:
    """Correctly rounded sum over all ranks; the same bits for any distribution of the values.

    Returns NaN if any value anywhere is not finite.
    """
    finite = bool(np.isfinite(values).all())
    bins = partial_bins(values) if finite else np.zeros((2, _BINS), dtype=np.int64)
    packed = np.concatenate([bins.ravel(), np.array([0 if finite else 1], dtype=np.int64)])
    comm.sum_into(packed)
    return math.nan if packed[-1] else rounded(packed[:-1].reshape(2, _BINS))

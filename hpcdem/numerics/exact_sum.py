"""Sums of floating-point numbers that do not depend on order, hence not on ranks or threads.

Every double is an integer times a power of two; integers are summed exactly, one bin per exponent, and rounded once
at the end. Used wherever a sum is written to a file or feeds back into the run.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.core.comm import Comm

_LOW = 26  # the 53-bit mantissa is split in 27 + 26 bits, so that a bin has room for 2**36 numbers
_BINS = 2112
_SHIFT = 1080
BINS_SHAPE = (2, _BINS)
"""Shape of the int64 bins of one sum: upper and lower parts of mantissas, by exponent. Slot 0 of the lower parts, which
no number needs, counts what is not finite."""

_MANTISSA = np.int64((1 << 52) - 1)
_HIDDEN = np.int64(1 << 52)


@njit(cache=True, nogil=True, error_model="numpy")
def add_to_bins(bins, bits):
    """Add the value with these bits (int64) to bins (2, 2112) i8."""
    exponent = (bits >> 52) & 0x7FF
    if exponent == 0x7FF:
        bins[1, 0] += 1
        return
    whole = bits & _MANTISSA
    if exponent == 0:
        exponent = 1  # zero or denormal: no hidden bit
    else:
        whole |= _HIDDEN
    sign = bits >> 63
    whole = (whole ^ sign) - sign
    slot = np.uint64(exponent + (_SHIFT - 1022))
    high = whole >> _LOW
    bins[0, slot] += high
    bins[1, slot] += whole - (high << _LOW)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_all(bins, bits):
    for value in bits:
        add_to_bins(bins, value)


def partial_bins(values: np.ndarray) -> np.ndarray:
    """Exact sums of `values` (any shape) by exponent: (2, 2112) int64."""
    bins = np.zeros(BINS_SHAPE, np.int64)
    _add_all(bins, np.ascontiguousarray(values, dtype=np.float64).ravel().view(np.int64))
    return bins


def rounded(bins: np.ndarray) -> float:
    """The double nearest to the exact value of `bins` (as made by `partial_bins`, possibly added up); NaN if any value
    was not finite."""
    if bins[1, 0]:
        return math.nan
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


def as_integer(bins: np.ndarray) -> int | None:
    """The exact value of `bins` (2, 2112) i8 in units of 2**-1133, or None if a value was not finite.

    Integers have no size and no order: bins that are emptied into one now and then never run out of room.
    """
    if bins[1, 0]:
        return None
    used = np.flatnonzero(bins.any(axis=0)).tolist()
    return sum(((int(bins[0, slot]) << _LOW) + int(bins[1, slot])) << slot for slot in used)


def from_integer(total: int) -> float:
    """The double nearest to an integer of `as_integer`."""
    try:  # int / int is correctly rounded in Python
        return total / (1 << (_SHIFT + 53))
    except OverflowError:
        return math.inf if total > 0 else -math.inf


def rounded_sums(bins: np.ndarray, comm: Comm) -> np.ndarray:
    """Sums over all ranks of bins (k, 2, 2112) i8, each correctly rounded, (k,) f8. Collective.

    Only the part of the exponents that is in use travels.
    """
    if comm.size > 1:
        used = np.flatnonzero(bins[:, :, 1:].any(axis=(0, 1))) + 1
        span = np.array([-used[0], used[-1]] if len(used) else [-_BINS, 0], np.int64)
        comm.max_into(span)
        first, last = -int(span[0]), int(span[1]) + 1
        packed = np.concatenate([bins[:, 1, 0], bins[:, :, first:last].ravel()])
        comm.sum_into(packed)
        bins = np.zeros_like(bins)
        bins[:, 1, 0] = packed[: len(bins)]
        if last > first:
            bins[:, :, first:last] = packed[len(bins) :].reshape(len(bins), 2, last - first)
    return np.array([rounded(b) for b in bins])


def exact_sum(values: np.ndarray, comm: Comm) -> float:
    """Correctly rounded sum over all ranks; the same bits for any distribution of the values. Collective.

    Returns NaN if any value anywhere is not finite.
    """
    return float(rounded_sums(partial_bins(values)[None], comm)[0])

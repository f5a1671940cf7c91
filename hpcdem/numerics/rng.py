"""Counter-based random numbers: a pure function of (seed, stream, counter), the same on any rank and any machine.

The mixer is SplitMix64's finaliser (Steele, Lea & Flood 2014), applied twice so that neighbouring streams differ.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_M1 = np.uint64(0xBF58476D1CE4E5B9)
_M2 = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


@njit(cache=True)
def _mix(z):
    z = (z ^ (z >> _S30)) * _M1
    z = (z ^ (z >> _S27)) * _M2
    return z ^ (z >> _S31)


@njit(cache=True)
def uniform(seed, stream, counter):
    """Uniform double in [0, 1) for non-negative integers seed, stream, counter."""
    z = _mix(np.uint64(seed) * _GOLDEN + np.uint64(stream))
    z = _mix(z + (np.uint64(counter) + np.uint64(1)) * _GOLDEN)
    return float(z >> _S11) * (1.0 / 9007199254740992.0)


def uniforms(seed: int, stream: int, counters: np.ndarray) -> np.ndarray:
    """Return the uniform numbers of an array of counters, see `uniform`."""

    def mix(z: np.ndarray) -> np.ndarray:
        z = (z ^ (z >> _S30)) * _M1
        z = (z ^ (z >> _S27)) * _M2
        return z ^ (z >> _S31)

    with np.errstate(over="ignore"):
        z = mix(np.array([seed], np.uint64) * _GOLDEN + np.uint64(stream))
        z = mix(z + (np.asarray(counters).astype(np.uint64) + np.uint64(1)) * _GOLDEN)
    return (z >> _S11).astype(np.float64) * (1.0 / 9007199254740992.0)

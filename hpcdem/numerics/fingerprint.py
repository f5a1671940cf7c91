"""A 128-bit number that stands for a table of rows, whatever their order and wherever they are.

Each row is mixed to two 64-bit words (SplitMix64's finaliser, Steele, Lea & Flood 2014), and these are added up modulo
2^64: sums do not depend on order, so ranks only add theirs. Not a cryptographic hash: it finds differences that happen,
not those that somebody designs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_M1, _M2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31 = np.uint64(30), np.uint64(27), np.uint64(31)
_SEEDS = (0x243F6A8885A308D3, 0x13198A2E03707344)  # of the two words: digits of pi


def of_rows(columns: Sequence[np.ndarray]) -> np.ndarray:
    """(2,) u8 of rows given by columns (n,) of floats (their bits count: 0.0 and -0.0 differ) or integers."""
    words = [_bits(column) for column in columns]
    out = np.zeros(2, np.uint64)
    if not words or not len(words[0]):
        return out
    with np.errstate(over="ignore"):
        for half, seed in enumerate(_SEEDS):
            h = np.full(len(words[0]), seed, np.uint64)
            for word in words:
                h = _mix((h ^ word) + _GOLDEN)
            out[half] = np.add.reduce(h, dtype=np.uint64)
    return out


def as_text(words: np.ndarray) -> str:
    """32 hexadecimal digits."""
    return "".join(f"{int(word):016x}" for word in words)


def _bits(column: np.ndarray) -> np.ndarray:
    wide = np.float64 if np.asarray(column).dtype.kind == "f" else np.int64
    return np.ascontiguousarray(column, dtype=wide).view(np.uint64)


def _mix(z: np.ndarray) -> np.ndarray:
    z = (z ^ (z >> _S30)) * _M1
    z = (z ^ (z >> _S27)) * _M2
    return z ^ (z >> _S31)

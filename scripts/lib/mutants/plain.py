"""Kernels as plain Python: what numba knows as functions for the compiler only (intrinsics), in Python.

With NUMBA_DISABLE_JIT=1 kernels are the functions that they are made of. A mutant of a kernel then costs no compiling,
and tests of models of a few discs or elements take no longer than with compiled kernels.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

import numpy as np

GROUP = 4


def install() -> None:
    """Let intrinsics be called, in a process that compiles no kernels."""
    from numba.core.extending import _Intrinsic

    intrinsic: Any = _Intrinsic
    intrinsic.__call__ = lambda self, *args: of(self)(*args)


def of(intrinsic: Any) -> Callable[..., Any]:
    """What it does, in Python. It is known by the name of the function it is made of, and what that closes over."""
    function = intrinsic._defn
    values = [cell.cell_contents for cell in function.__closure__ or ()]
    known = _KNOWN[function.__name__]
    return known(*values) if values else known


def _bits(value: float) -> np.int64:
    return np.float64(value).view(np.int64)


def _no_farther(a: float, b: float) -> np.int64:
    return np.int64(-1 if a <= b else 0)


def _flat(table: np.ndarray) -> np.ndarray:
    return table.reshape(-1)


def _rows(table: np.ndarray, offsets: tuple) -> np.ndarray:
    """Four columns of rows. What lies behind the end of the table can be read in memory; nobody uses it."""
    found = np.full((GROUP, GROUP), np.nan)
    for row, i in zip(found, offsets, strict=True):
        there = _flat(table)[int(i) : int(i) + GROUP]
        row[: len(there)] = there
    return found


def _lanes(at: int, count: int) -> list[slice]:
    from hpcdem.numerics.lanes import CAPACITY

    return [slice(int(at) + c * CAPACITY, int(at) + c * CAPACITY + GROUP) for c in range(count)]


def _differences(lanes: np.ndarray, at: int, table: np.ndarray, j: tuple, i: tuple) -> None:
    for c, place in enumerate(_lanes(at, GROUP)):
        lanes[place] = (_rows(table, j) - _rows(table, i))[:, c]


def _columns(count: int) -> Callable[..., None]:
    def columns(lanes: np.ndarray, at: int, table: np.ndarray, i: tuple) -> None:
        for c, place in enumerate(_lanes(at, count)):
            lanes[place] = _rows(table, i)[:, c]

    return columns


def _put(count: int) -> Callable[..., None]:
    def put(table: np.ndarray, i: tuple, lanes: np.ndarray, at: int) -> None:
        rows = np.array([lanes[place] for place in _lanes(at, count)]).T
        for offset, row in zip(i, rows, strict=True):
            _flat(table)[int(offset) : int(offset) + count] = row

    return put


def _add_in_turn(force: np.ndarray, i: tuple, j: tuple, lanes: np.ndarray, at: int) -> None:
    a, b, c, d = (lanes[place] for place in _lanes(at, GROUP))
    flat = _flat(force)
    for q in range(GROUP):
        flat[int(i[q]) : int(i[q]) + GROUP] += (a[q], b[q], c[q], 0.0)
        flat[int(j[q]) : int(j[q]) + GROUP] += (-a[q], -b[q], d[q], 0.0)


def _store(bits: int) -> Callable[..., None]:
    form = {32: "<I", 64: "<Q"}[bits]

    def store(out: np.ndarray, at: int, word: int) -> None:
        out[int(at) : int(at) + bits // 8] = np.frombuffer(struct.pack(form, int(word)), np.uint8)

    return store


_KNOWN: dict[str, Callable[..., Any]] = {
    "no_farther": _no_farther,
    "as_bits": _bits,
    "as_number": np.int64,
    "differences": _differences,
    "columns": _columns,
    "put": _put,
    "add_in_turn": _add_in_turn,
    "store": _store,
}


if __name__ == "__main__":
    import sys

    import pytest

    install()
    sys.exit(pytest.main(sys.argv[1:]))

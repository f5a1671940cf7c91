"""Cells and their keys; memory for tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hpcdem.core import cells
from hpcdem.core.memory import LINE, aligned, sparse_zeros, take_rows

quick = settings(max_examples=150, deadline=None, derandomize=True)
index = st.integers(-cells.FARTHEST, cells.FARTHEST)


@quick
@given(index, index)
def test_a_key_holds_column_and_row(column, row):
    key = column * cells.COLUMN + row
    assert (cells.column(key), cells.row(key)) == (column, row)


@quick
@given(st.lists(st.tuples(index, index), min_size=2, max_size=30))
def test_keys_are_in_the_order_of_column_and_row(places):
    keys = [column * cells.COLUMN + row for column, row in places]
    assert [places[k] for k in np.argsort(keys, kind="stable")] == sorted(places)


def test_keys_of_points():
    points = np.array([[0.0, 0.0, 9.0], [-0.1, 2.5, 9.0], [np.nan, 1e300, 9.0], [-np.inf, -1e300, 9.0]])
    keys = cells.keys(points, 0.5)
    far = cells.FARTHEST
    assert cells.columns(keys).tolist() == [0, -1, far, -far]
    assert [cells.row(key) for key in keys] == [0, 5, far, -far]


@quick
@given(st.lists(st.integers(-9, 9), max_size=30), st.integers(-11, 11))
def test_bisection(values, key):
    keys = np.sort(np.array(values, dtype=np.int64))
    assert cells.first_not_before(keys, key, 0, len(keys)) == np.searchsorted(keys, key)


def test_aligned_tables_begin_on_a_cache_line():
    for n in (0, 1, 7, 1000):
        table = aligned((n, 8))
        assert table.shape == (n, 8) and table.dtype == np.float64
        assert table.ctypes.data % LINE == 0 or n == 0


def test_tables_of_zeros_take_memory_where_they_are_written_to():
    """40 MB of them, of which a page is written; read they are zeros without memory."""
    table = sparse_zeros((5000, 1000))
    assert table.shape == (5000, 1000) and table.dtype == np.float64 and sparse_zeros(3, np.int32).tolist() == [0, 0, 0]
    before = resident()
    assert not table.any() and resident() - before < 4e6
    table[0, 0] = 1.0
    assert table.sum() == 1.0 and resident() - before < 4e6
    table[:] = 1.0
    assert resident() - before > 35e6


def resident() -> int:
    """Memory of this process in bytes."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))


def test_rows_are_taken_in_any_order_by_any_number_of_threads():
    rows = np.random.default_rng(1).random((50, 8))
    order = np.random.default_rng(2).integers(0, 50, 37)
    for threads in (1, 2, 3):
        assert (take_rows(rows, order, np.empty((37, 8)), threads) == rows[order]).all()

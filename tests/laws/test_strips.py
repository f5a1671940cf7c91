"""Strips: cells, the one order of the model, who owns which column."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hpcdem.core import cells
from hpcdem.core.cells import COLUMN
from hpcdem.decomp import balance, strips

quick = settings(max_examples=150, deadline=None, derandomize=True)
weights = hnp.arrays(np.float64, st.integers(1, 80), elements=st.floats(0.0, 1e6))
ranks = st.integers(1, 24)
first = st.integers(-(10**6), 10**6)


# ---- cells -------------------------------------------------------------------------------------------------------


@quick
@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=50), st.floats(1e-2, 1e4))
def test_a_point_lies_in_its_cell(x, h):
    x = np.array(x)
    cx, cy = strips.cells(x, -x, h)
    inside = np.abs(cx) < strips.FARTHEST
    assert (np.abs(cx * h + 0.5 * h - x) <= 0.5 * h * (1.0 + 1e-9) + 1e-9 * np.abs(x))[inside].all()
    assert (cx == np.floor(x / h).clip(-strips.FARTHEST, strips.FARTHEST)).all()
    assert (cy == np.floor(-x / h).clip(-strips.FARTHEST, strips.FARTHEST)).all()


def test_escaped_particles_go_to_the_rim():
    cx, _ = strips.cells(np.array([np.nan, np.inf, -np.inf, 1e300, -1e300, 0.0]), np.zeros(6), 1.0)
    assert cx.tolist() == [strips.FARTHEST, strips.FARTHEST, -strips.FARTHEST, strips.FARTHEST, -strips.FARTHEST, 0]


@quick
@given(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5), st.floats(0.1, 100.0))
def test_cells_of_neighbours_are_neighbours(x, y, h):
    """Points less than one cell side apart lie in the same or in adjacent columns and rows."""
    near = np.array([x, x + 0.999 * h]), np.array([y, y - 0.999 * h])
    cx, cy = strips.cells(*near, h)
    assert abs(cx[1] - cx[0]) <= 1 and abs(cy[1] - cy[0]) <= 1


# ---- order -------------------------------------------------------------------------------------------------------


def cells_and_ids(span: int, most: int):
    """Columns, rows within +-span and distinct ids up to `most`."""
    cell = st.integers(-span, span)
    return st.lists(
        st.tuples(cell, cell, st.integers(0, most)), max_size=60, unique_by=lambda row: row[2]
    )  # fmt: skip


def order_of(rows: list[tuple[int, int, int]]) -> np.ndarray:
    """The order of particles given as (column, row, id)."""
    cx, cy, gid = np.array(rows, dtype=np.int64).reshape(-1, 3).T
    return strips.global_order(cx * COLUMN + cy, gid.copy())


@quick
@given(st.one_of(cells_and_ids(1, 100), cells_and_ids(10**4, 10**7), cells_and_ids(strips.FARTHEST, 10**12)))
def test_order_is_column_row_id(rows):
    """Also where there are too many cells to be counted."""
    assert [rows[k] for k in order_of(rows)] == sorted(rows)


def test_a_runaway_changes_the_method_but_not_the_order():
    """The same particles, once near together, once with a runaway that is far beyond any table of cells."""
    random = np.random.default_rng(5)
    cx, cy = random.integers(-50, 50, (2, 500))
    rows = list(zip(cx.tolist(), cy.tolist(), random.permutation(500).tolist()))
    far = strips.FARTHEST
    stretched = order_of([*rows, (far, -far, 1 << 40)])
    assert (2 * far) ** 2 > strips.CELLS_PER_PARTICLE * 501 + strips.SMALL
    assert (stretched == np.append(order_of(rows), 500)).all()


@pytest.mark.parametrize("crowd", [2, strips.CROWD, strips.CROWD + 1, 1000])
def test_a_crowd_in_one_cell_is_sorted_by_id(crowd):
    random = np.random.default_rng(crowd)
    rows = [(0, 0, g) for g in random.permutation(crowd).tolist()] + [(0, -1, crowd), (0, 1, crowd + 1)]
    assert [rows[k] for k in order_of(rows)] == sorted(rows)


def test_a_cell_is_sorted_without_those_before_it():
    rows = [(0, 0, 5), (0, 0, 6), (1, 0, 4), (1, 0, 1), (1, 0, 2), (2, 0, 0)]
    assert [rows[k] for k in order_of(rows)] == sorted(rows)


@quick
@given(cells_and_ids(5, 1000), st.randoms(use_true_random=False))
def test_order_does_not_depend_on_where_particles_come_from(rows, random):
    shuffled = rows.copy()
    random.shuffle(shuffled)
    for values in (rows, shuffled):
        assert [values[k] for k in order_of(values)] == sorted(rows)


# ---- borders -----------------------------------------------------------------------------------------------------


@quick
@given(weights, first, ranks)
def test_cut_gives_everyone_whole_columns(w, start, n):
    borders = strips.cut(w, start, n)
    assert borders.dtype == np.int64 and len(borders) == n + 1 and (np.diff(borders) >= 1).all()
    assert borders[0] == start
    if len(w) >= n:
        assert borders[-1] == start + len(w)
    else:
        assert borders[-1] >= start + n, "the last ranks own columns without particles"


@quick
@given(hnp.arrays(np.float64, st.integers(24, 80), elements=st.floats(0.5, 1.5)), ranks)
def test_cut_is_as_even_as_whole_columns_allow(w, n):
    """Every border stands within half a column of its goal, so no strip is off by more than the heaviest column.
    Holds where a strip is wider than one column, so that nobody's border is pushed by a neighbour's."""
    borders = strips.cut(w, 0, n)
    loads = np.add.reduceat(w, borders[:-1])
    if len(w) >= 6 * n:
        assert np.abs(loads - w.sum() / n).max() <= w.max() * (1.0 + 1e-12)
    assert loads.sum() == pytest.approx(w.sum())


def test_cut_examples():
    assert strips.cut(np.ones(12), 0, 3).tolist() == [0, 4, 8, 12]
    assert strips.cut(np.ones(12), -5, 4).tolist() == [-5, -2, 1, 4, 7]
    assert strips.cut(np.array([9.0, 1.0, 1.0, 1.0]), 0, 2).tolist() == [0, 1, 4]
    assert strips.cut(np.array([1.0, 1.0, 1.0, 9.0]), 0, 2).tolist() == [0, 3, 4]
    assert strips.cut(np.array([0.0, 0.0, 5.0]), 7, 3).tolist() == [7, 8, 9, 10]
    assert strips.cut(np.array([3.0]), 7, 3).tolist()[0] == 7
    assert strips.cut(np.zeros(6), 0, 3)[-1] == 6


@quick
@given(st.lists(st.integers(-20, 20), min_size=2, max_size=12))
def test_separate(values):
    """Strictly increasing, never to the left of where it was, and unchanged where it was increasing already."""
    borders = np.array(values, dtype=np.int64)
    apart = strips.separate(borders)
    assert (np.diff(apart) >= 1).all() and (apart >= borders).all() and apart[0] == borders[0]
    assert (strips.separate(apart) == apart).all()
    # The smallest such borders: each is where it was, or one column after its left neighbour.
    assert ((apart[1:] == borders[1:]) | (np.diff(apart) == 1)).all()


@quick
@given(weights, first, ranks, st.lists(st.integers(-100, 200), min_size=1, max_size=50))
def test_every_column_has_one_owner(w, start, n, columns):
    """The first and the last rank own everything beyond as well."""
    borders = strips.cut(w, start, n)
    cx = start + np.array(columns)
    owner = strips.owner_of(cx, borders)
    assert ((owner >= 0) & (owner < n)).all()
    assert ((cx >= borders[owner]) | (owner == 0)).all()
    assert ((cx < borders[owner + 1]) | (owner == n - 1)).all()
    assert (np.diff(strips.owner_of(np.sort(cx), borders)) >= 0).all(), "ranks follow each other from left to right"


def test_one_rank_owns_all():
    assert not strips.owner_of(np.array([-(1 << 28), 0, 1 << 28]), np.array([0, 1])).any()


@quick
@given(st.lists(st.tuples(st.integers(-20, 20), st.integers(-9, 9)), max_size=40), st.integers(-9, 9), ranks)
def test_strays_are_those_that_belong_to_others(places, start, n):
    """Columns beyond the outermost borders belong to the first and the last rank."""
    key = np.array([cx * COLUMN + cy for cx, cy in places] + [strips.FARTHEST * COLUMN, -strips.FARTHEST * COLUMN])
    borders = start + 2 * np.arange(n + 1)
    owner = strips.owner_of(cells.columns(key), borders)
    for rank in range(n):
        assert strips.strays(key, borders, rank).tolist() == np.flatnonzero(owner != rank).tolist()


def test_how_uneven_ranks_are_and_what_a_particle_costs():
    """Nothing to compare: as if all were equal; one measurement counts for a factor of two at most."""
    assert balance.imbalance(1.5, 0.5) == 3.0 and balance.imbalance(0.0, 0.0) == 1.0
    assert balance.cost_per_particle(3.0, 10.0, 8.0, 40.0) == pytest.approx(1.5)
    assert (
        balance.cost_per_particle(9.0, 10.0, 10.0, 40.0) == 2.0
        and balance.cost_per_particle(0.0, 9.0, 1.0, 20.0) == 0.5
    )

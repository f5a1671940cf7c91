"""Masks of selections: bounds, shapes, groups, chains, expressions."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hpcdem.core.errors import CommandError
from hpcdem.core.selection import Chain, Ellipse, Expression, Group, Ids, Interval, Polygon, chain, has_expressions
from hpcdem.lang.zdem.parser import parse_text

EXTENTS = {"left": 0.0, "right": 100.0, "bottom": 10.0, "top": 4000.0}
TOP_KILOMETRE = Expression("{top}-1000.0", ("top", 1000.0, "-"))


def particles(x, y=None, group=None, names=("***",)):
    x = np.asarray(x, dtype=float)
    y = np.zeros_like(x) if y is None else np.asarray(y, dtype=float)
    group = np.zeros(len(x), dtype=np.int64) if group is None else np.asarray(group)
    return {"x": x, "y": y, "gid": np.arange(1, len(x) + 1), "group": group, "group_names": list(names)}


def test_intervals_own_their_lower_bound_only():
    mask = Interval("x", 1.0, 2.0).mask(particles([0.999, 1.0, 1.5, 2.0, 2.001]))
    assert mask.tolist() == [False, True, True, False, False]


def test_layers_that_meet_share_no_particle_and_lose_none():
    p = particles(np.zeros(9), np.linspace(0.0, 1000.0, 9))
    layers = [Interval("y", a, a + 250.0).mask(p) for a in (0.0, 250.0, 500.0, 750.0)]
    assert np.sum(layers, axis=0).tolist() == [1] * 8 + [0]


@pytest.mark.parametrize("turn", [1, -1])
def test_quadrilateral_in_both_orientations(turn):
    fault = ((4000.0, 0.0), (4500.0, 0.0), (10500.0, 4000.0), (10000.0, 4000.0))[::turn]
    p = particles([4100.0, 3900.0, 7250.0, 7250.0, 10400.0], [10.0, 10.0, 2000.0, 2400.0, 3999.0])
    assert Polygon(fault).mask(p).tolist() == [True, False, True, False, True]


def test_quadrilateral_with_three_corners_on_a_line():
    high = Polygon(((10000.0, 0.0), (12000.0, 0.0), (15000.0, 0.0), (12500.0, 1500.0)))
    p = particles([12500.0, 11000.0, 14000.0, 10100.0, 12500.0], [1499.0, 500.0, 500.0, 1000.0, -1.0])
    assert high.mask(p).tolist() == [True, True, True, False, False]


def test_a_quadrilateral_that_crosses_itself_is_taken_by_the_even_odd_rule():
    bow_tie = Polygon(((0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)))
    p = particles([0.2, 1.8, 1.0, 1.0], [1.0, 1.0, 0.2, 1.8])
    assert bow_tie.mask(p).tolist() == [True, True, False, False]


coordinate = st.integers(-4, 4).map(float) | st.floats(-4, 4)


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.tuples(coordinate, coordinate), min_size=1, max_size=30), coordinate, coordinate)
def test_polygons_that_share_an_edge_share_no_particle_and_lose_none(points, a, b):
    """Two halves of a square cut from (a, -4) to (b, 4), whatever the cut, also for centres on it."""
    p = particles([x for x, _ in points], [y for _, y in points])
    west = Polygon(((-5.0, -4.0), (a, -4.0), (b, 4.0), (-5.0, 4.0)))
    east = Polygon(((a, -4.0), (5.0, -4.0), (5.0, 4.0), (b, 4.0)))
    inside = (p["y"] >= -4.0) & (p["y"] < 4.0)
    assert np.array_equal(west.mask(p).astype(int) + east.mask(p), inside.astype(int))


def test_ellipse():
    high = Ellipse(20000.0, 0.0, 2000.0, 1000.0)
    p = particles([20000.0, 22000.0, 22001.0, 21414.0, 21415.0, 20000.0], [0.0, 0.0, 0.0, 707.0, 708.0, -1000.0])
    assert high.mask(p).tolist() == [True, True, False, True, False, True]


def test_an_ellipse_without_height_encloses_nothing():
    """The manual has one: ``ellipse ( 2e-2, 0.0) 3e-2, 0.0``."""
    with np.errstate(all="raise"):
        assert not Ellipse(2e-2, 0.0, 3e-2, 0.0).mask(particles([2e-2, 3e-2])).any()


def test_groups():
    p = particles([0.0] * 4, group=[0, 1, 2, 1], names=["***", "Sed", "base"])
    assert Group("sed").mask(p).tolist() == [False, True, False, True]
    assert Group("SED", "base").mask(p).tolist() == [False, True, True, True]
    assert not Group("nobody").mask(p).any()


def test_ids_are_inclusive():
    assert Ids(2, 3).mask(particles([0.0] * 4)).tolist() == [False, True, True, False]
    assert Ids(4, 4).mask(particles([0.0] * 4)).tolist() == [False, False, False, True]


def test_chains_run_from_left_to_right_with_equal_precedence():
    p = particles([0.0, 1.0, 2.0, 3.0])
    a, b, c = Interval("x", 0.0, 1.0), Interval("x", 1.0, 2.0), Interval("x", 1.0, 4.0)
    assert (a | b & c).mask(p).tolist() == [True, True, False, False]  # Python: b & c first
    assert chain([a, b, c], ["or", "and"]).mask(p).tolist() == [False, True, False, False]  # (a or b) and c


def test_group_and_group_means_both_groups():
    p = particles([0.0] * 3, group=[0, 1, 2], names=["***", "wall_bom", "wall_mov0"])
    both = chain([Group("wall_bom"), Group("wall_mov0")], ["and"])
    assert both == Group("wall_bom", "wall_mov0")
    assert both.mask(p).tolist() == [False, True, True]


def test_group_and_group_within_a_longer_range():
    x = Interval("x", 0.0, 1.0)
    assert chain([x, Group("a"), Group("b")], ["and", "and"]) == Chain((x, Group("a", "b")), ("and",))
    assert chain([Group("a"), Group("b"), x], ["or", "and"]) == Chain((Group("a"), Group("b"), x), ("or", "and"))


def test_expressions_are_resolved_once():
    top = Chain((Interval("y", TOP_KILOMETRE, Expression("{top}", ("top",))), Group("a")), ("and",))
    assert has_expressions(top)
    plain = top.resolve(EXTENTS)
    assert plain == Chain((Interval("y", 3000.0, 4000.0), Group("a")), ("and",))
    assert not has_expressions(plain)


def test_expressions_in_corners_and_axes():
    right = Expression("{right}", ("right",))
    corners = Polygon(((0.0, 0.0), (right, 0.0), (right, 1.0), (0.0, 1.0))).resolve(EXTENTS)
    assert corners == Polygon(((0.0, 0.0), (100.0, 0.0), (100.0, 1.0), (0.0, 1.0)))
    assert Ellipse(right, 0.0, 1.0, right).resolve(EXTENTS) == Ellipse(100.0, 0.0, 1.0, 100.0)


def test_a_mask_of_an_unresolved_expression_is_refused():
    with pytest.raises(CommandError, match=r"'\{top\}-1000.0' must be resolved"):
        Interval("y", TOP_KILOMETRE, 5000.0).mask(particles([0.0]))


@pytest.mark.parametrize(
    ("program", "message"),
    [(("top", 0.0, "/"), "divides by zero"), (("top", 1e308, "*", 1e308, "*"), "not a finite number")],
)
def test_expressions_without_a_value(program, message):
    with pytest.raises(CommandError, match=message):
        Expression("e", program).value(EXTENTS)


def test_variables_without_a_value():
    with pytest.raises(CommandError, match=r"\{top\} has no value"):
        TOP_KILOMETRE.value({"top": float("nan")})
    with pytest.raises(CommandError, match=r"\{top\} has no value"):
        TOP_KILOMETRE.value({})


def test_selections_travel_between_ranks():
    selection = (Interval("y", TOP_KILOMETRE, 1.0) | Group("a")) & Ids(1, 2)
    assert pickle.loads(pickle.dumps(selection)) == selection


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("group sed", 4),
        ("group sed or x (6 8) y (0 2)", 8),
        ("group sed or y (0 2) x (6 8)", 8),
        ("x (6 8) y (0 2) or group sed", 8),
        ("group sed and x (0 1) y (0 9) or x (6 8) y (0 2) or x (6 8) y (8 10)", 10),
        ("group sed or x (6 8) and y (0 2)", 4 + 2),  # two terms and two words: from left to right
        ("group sed or id 0 99 y (0 2)", 20),
        ("x (0 2) y (8 9) x (1 9)", 1),
    ],
)
def test_a_rectangle_is_one_shape(text, number):
    """Particles at 0.5, 1.5 ... 9.5 in x and y; four of them in the group."""
    y, x = (k.ravel() + 0.5 for k in np.mgrid[0:10, 0:10].astype(float))
    group = np.zeros(100, int)
    group[[0, 1, 80, 90]] = 1
    statement = parse_text(f"START\nPROP color red RANGE {text}\n").statements[1]
    p = {"x": x, "y": y, "gid": np.arange(100), "group": group, "group_names": ["***", "sed"]}
    assert statement.selection.mask(p).sum() == number

"""Changes of heights against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.numerics import landscape
from hpcdem.physics.dem.land import carried_over
from hpcdem.pre.deposit import resting, top

NO_DISCS, NO_WALLS = np.empty((0, 3)), np.empty((0, 4))


def test_a_scarp_diffuses_as_the_error_function() -> None:
    """h(x, t) = a/2 erfc(x / sqrt(4 k t)), in one call and in 20; columns of unequal width too."""
    rng = np.random.default_rng(1)
    for sides in (np.linspace(-100.0, 100.0, 201), np.cumsum(np.append(-100.0, rng.uniform(0.6, 1.4, 200)))):
        width = np.diff(sides)
        x = 0.5 * (sides[:-1] + sides[1:])
        height = np.clip(-sides[:-1] / width, 0.0, 1.0) * 10.0  # the share of the column left of 0
        exact = 5.0 * np.array([math.erfc(v / math.sqrt(4.0 * 90.0)) for v in x])
        for parts, tolerance in ((1, 0.02), (20, 0.004)):
            h = height
            for _ in range(parts):
                h = landscape.moved(h, width, landscape.diffused(h, width, 90.0 / parts))
            assert np.abs(h - exact).max() < 10.0 * tolerance
            assert (h @ width) == pytest.approx(height @ width, rel=1e-13)
            assert (np.diff(h) <= 1e-12).all()


def test_an_enormous_time_levels_everything_without_oscillation() -> None:
    width, height = np.array([1.0, 2.0, 0.5, 1.5]), np.array([7.0, 0.0, 3.0, 1.0])
    level = height @ width / width.sum()
    assert landscape.moved(height, width, landscape.diffused(height, width, 1e9)) == pytest.approx(level, rel=1e-6)
    assert not landscape.diffused(np.array([1.0]), np.array([1.0]), 5.0).size


def test_nothing_crosses_columns_without_ground() -> None:
    width, height = np.ones(5), np.array([4.0, 2.0, math.nan, 8.0, 1.0])
    passed = landscape.diffused(height, width, 3.0)
    assert passed[0] > 0.5 and passed[3] > 0.5 and (passed[1:3] == 0.0).all()
    assert (landscape.avalanches(height, width, 0.1)[1:3] == 0.0).all()
    for change in (landscape.lowered(height, 1.0, 3.0), landscape.raised(height, 1.0, 3.0)):
        assert change[2] == 0.0
    assert landscape.lowered(height, 1.5, 3.0).tolist() == [-1.0, 0.0, 0.0, -1.5, 0.0]
    assert landscape.lowered(height, math.inf, -math.inf)[0] == -math.inf
    assert landscape.raised(height, 1.5, 3.0).tolist() == [0.0, 1.0, 0.0, 0.0, 1.5]


@pytest.mark.parametrize("slope", [0.2, 0.5, math.tan(math.radians(30.0))])
def test_a_cliff_becomes_a_slope_of_the_largest_angle(slope: float) -> None:
    """Of a cliff of height a there remains the slope through its middle, of half its area on either side: the area that
    passes the middle is a^2 / (8 tan)."""
    width = np.full(100, 0.25)
    height = np.where(np.arange(100) < 50, 4.0, 0.0)
    passed = landscape.avalanches(height, width, slope)
    h = landscape.moved(height, width, passed)
    steep = -np.diff(h) / 0.25
    assert steep.max() <= slope * (1.0 + 1e-5) and (steep > 0.99 * slope).sum() >= int(4.0 / slope / 0.25) - 2
    assert passed[49] == pytest.approx(4.0**2 / (8.0 * slope), rel=0.01)
    assert h.sum() == pytest.approx(height.sum(), rel=1e-12)
    assert not landscape.avalanches(h, width, slope * 1.001).any()


def test_no_column_loses_more_than_it_has() -> None:
    passed, available = np.array([3.0, -2.0, 1.0]), np.array([1.0, 9.0, 1.5, 0.0])
    left = landscape.limited(passed, available)
    assert left.tolist() == [1.0, -1.0, 0.5]
    assert landscape.change(left).sum() == 0.0


def test_columns_are_fixed_in_space() -> None:
    first, sides = landscape.edges(0.9, 10.2, 2.0)
    assert first == 0 and sides.tolist() == [0.9, 2.0, 4.0, 6.0, 8.0, 10.2]
    first, sides = landscape.edges(1.1, 10.2, 2.0)
    assert first == 1 and sides.tolist() == [1.1, 4.0, 6.0, 8.0, 10.2]
    assert landscape.edges(1.1, 1.6, 2.0)[1].tolist() == [1.1, 1.6]
    assert landscape.edges(-3.0, 1.0, 2.0)[0] == -2
    assert carried_over({-1: 5, 0: 2, 3: 4, 7: 1}, 0, 4).tolist() == [7, 0, 0, 5]


def test_a_disc_rests_in_the_hollow() -> None:
    """On two equal discs, between two walls, and on an inclined floor."""
    discs = np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [4.0, 3.0, 1.0]])
    x, y = resting(0.2, 1.8, 1.0, discs, NO_WALLS)
    assert (x, y) == pytest.approx((1.0, math.sqrt(3.0)), abs=1e-3)
    distance = np.hypot(discs[:, 0] - x, discs[:, 1] - y) - 2.0
    assert distance.min() >= -1e-12 and sorted(distance)[1] < 2e-3
    floor = np.array([[0.0, 0.0, 10.0, 5.0], [0.0, 20.0, 0.0, -1.0]])
    x, y = resting(0.0, 4.0, 0.5, NO_DISCS, floor)
    assert x == pytest.approx(0.5, abs=1e-3) and x >= 0.5
    assert (y - 0.5 * x) / math.hypot(1.0, 0.5) == pytest.approx(0.5, rel=1e-12)
    assert resting(20.0, 24.0, 0.5, discs, floor) is None
    assert top(np.array([1.0, 50.0]), 1.0, discs, NO_WALLS).tolist() == [math.sqrt(3.0), -math.inf]

"""Factors of safety of slopes.

Griffiths & Lane (1999), example 1: 2:1 on a firm base, friction 20 degrees, c / (gamma H) 0.05, no dilation: 1.4 by
finite elements, 1.38 by Bishop & Morgenstern's charts.

Limit analysis, log-spirals through the toe (Chen 1975): a slope of angle b comes down with gamma H / c = N, for a
friction of 20 degrees 16.16 for b 45, 10.39 for 60 and 5.50 for 90. With tan(friction) and c that are F times those the
factor is F. The bounds are upper ones, for flow with dilation equal to friction; what can move freely depends little on
it, and quads are too stiff in flow that dilates: 1.28 in place of 1.2 then.
"""

from __future__ import annotations

import math

import pytest

from hpcdem.cases import SlopeStability
from tests.cases.ready import results


def chen(angle: float, number: float, factor: float, **more: float) -> SlopeStability:
    """A slope of 8 m on 2 m of the same soil, friction 20 degrees, with this factor of safety."""
    friction = math.degrees(math.atan(factor * math.tan(math.radians(20.0))))
    cohesion = factor * 1900.0 * 9.81 * 8.0 / number
    given = {
        "angle": angle, "height": 8.0, "behind": 8.0, "before": 4.0, "below": 2.0, "density": 1900.0, "young": 60e6,
        "friction": friction, "cohesion": cohesion, "size": 0.4, "precision": 0.02, **more,
    }  # fmt: skip
    return SlopeStability(**given)


@pytest.mark.slow
def test_a_steep_slope(resident, tmp_path):
    """A coarse mesh, above the bound by some percent; one trial in balance, one not."""
    done = results(resident, tmp_path, chen(60.0, 10.39, 1.2, size=1.0, precision=0.05))
    print(done.factor, done.trials)
    assert done.factor == pytest.approx(1.2, rel=0.12)
    assert done.stands < done.factor < done.falls <= 1.06 * done.stands
    for factor, moved, ratio, _ in done.trials:
        assert (ratio <= 1e-6) == (factor <= done.stands)
        assert moved < 0.08 if factor <= done.stands else moved > 0.08  # a hundredth of the height
    assert done.movement == max(trial[1] for trial in done.trials if trial[0] <= done.stands)


@pytest.mark.slow
def test_griffiths_and_lane(resident, tmp_path):
    done = results(resident, tmp_path, SlopeStability(density=20e3 / 9.81))
    print(done.factor, done.trials)
    assert done.factor == pytest.approx(1.40, rel=0.03)
    assert done.stands > 1.30 and done.falls < 1.50


@pytest.mark.slow
@pytest.mark.parametrize(
    ("angle", "number", "factor", "error"),
    [(45.0, 16.16, 1.2, 0.03), (60.0, 10.39, 0.7, 0.03), (90.0, 5.50, 1.5, 0.06)],
)
def test_chen(resident, tmp_path, angle, number, factor, error):
    """A vertical face, in whose toe the stress is singular, is met less closely."""
    done = results(resident, tmp_path, chen(angle, number, factor))
    print(done.factor, done.trials)
    assert done.factor == pytest.approx(factor, rel=error)


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.ranks
def test_the_same_on_two_ranks(resident, tmp_path):
    case = chen(60.0, 10.39, 1.2, size=1.0, precision=0.05)
    assert results(resident, tmp_path / "2", case, ranks=2) == results(resident, tmp_path / "1", case)

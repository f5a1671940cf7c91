"""V1, V2: a ball dropped from a tower."""

from __future__ import annotations

import pytest

from hpcdem.commands.dem import cycles, particles, properties
from tests.cases.free_fall import exact
from tests.support import model, only, value, velocity, watch


@pytest.fixture
def two_balls(tmp_path):
    """Two balls of different size and weight that never meet."""
    sim = model(tmp_path, dt=exact.DT, gravity=(0.0, -exact.G))
    particles.ball(sim, 0, 0.0, exact.Y0, 2.0)
    particles.ball(sim, 1, 50.0, exact.Y0, 5.0)
    properties.prop(sim, only(0), density=1000.0)
    properties.prop(sim, only(1), density=7800.0)
    return sim


@pytest.mark.smoke
def test_v1_drop(two_balls):
    cycles.cycle(two_balls, exact.STEPS)
    y = value(two_balls, "y", 0)
    assert y == pytest.approx(-22.745, abs=1e-10) and exact.height(exact.STEPS) == pytest.approx(-22.745, abs=1e-10)
    assert value(two_balls, "y", 1) == y, "a heavier ball falls as fast"
    t = two_balls.clock.time
    assert y - (exact.Y0 - 0.5 * exact.G * t**2) == pytest.approx(-0.5 * exact.G * exact.DT * t, abs=1e-10)
    assert value(two_balls, "x", 0) == 0.0 and value(two_balls, "spin", 0) == 0.0


def test_v2_damped_drop(two_balls):
    properties.prop(two_balls, damp=0.4)
    y = watch(two_balls, 300, lambda sim: value(sim, "y"))
    assert y[1] - y[0] == pytest.approx(-1.4 * exact.G * exact.DT**2, abs=1e-12)
    assert (y[2:] - 2.0 * y[1:-1] + y[:-2])[1:] == pytest.approx(-0.6 * exact.G * exact.DT**2, abs=1e-12)
    assert y == pytest.approx([exact.height(n, 0.4) for n in range(301)], abs=1e-10)


def test_v2_damping_works_against_the_motion(two_balls):
    """On the way up gravity and damping pull together."""
    properties.prop(two_balls, damp=0.4, yv=20.0)
    y = watch(two_balls, 100, lambda sim: value(sim, "y"))
    assert y == pytest.approx([exact.thrown(n, 20.0, 0.4) for n in range(101)], abs=1e-10)


def test_fixed_components_keep_their_velocity(two_balls):
    properties.prop(two_balls, xv=3.0, yv=-1.0, spin=0.5)
    properties.fix(two_balls, ("y", "spin"))
    cycles.cycle(two_balls, 100)
    assert tuple(velocity(two_balls)) == (3.0, -1.0)
    assert value(two_balls, "y") == pytest.approx(exact.Y0 - 1.0, abs=1e-10)
    assert value(two_balls, "angle") == pytest.approx(0.5, abs=1e-12)
    properties.free(two_balls, ("y",))
    cycles.cycle(two_balls, 1)
    assert value(two_balls, "vy") == pytest.approx(-1.0 - exact.G * exact.DT, abs=1e-12)

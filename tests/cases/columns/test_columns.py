"""V9, V10, V11: balls settle on a floor."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.dem import cycles, particles, properties, walls
from hpcdem.physics.dem import diagnostics
from tests.cases.columns import exact
from tests.support import at_wall, model, pair, value


def settle(folder, n: int, steps: int, dt: float, damp: float = 0.4, **law):
    """n balls, made touching, come to rest; ball 0 is the top one. Where they rest does not depend on dt or damping."""
    sim = model(folder, dt=dt, disk="off", gravity=(0.0, -exact.GRAVITY))
    walls.wall(sim, 0, ((-300.0, 0.0), (300.0, 0.0)), kn=law.get("kn"))
    for j in range(n):
        particles.ball(sim, j, 0.0, exact.RADIUS * (2.0 * (n - j) - 1.0), exact.RADIUS)
    properties.prop(sim, density=exact.DENSITY, damp=damp, **law)
    cycles.cycle(sim, steps)
    return sim


def overlaps(sim, n: int) -> np.ndarray:
    """Overlaps from the top down, the floor last [m]."""
    return np.array([*(pair(sim, j, j + 1).overlap for j in range(n - 1)), at_wall(sim, n - 1).overlap])


def test_v9_one_ball(tmp_path):
    sim = settle(tmp_path, 1, 20000, 1e-3, shear=exact.SHEAR, poiss=exact.NU, hertz=True)
    assert at_wall(sim).overlap == pytest.approx(0.888384, rel=1e-4) == exact.hertz(1)[0]
    assert at_wall(sim).fn == pytest.approx(exact.MASS * exact.GRAVITY, rel=1e-4)


def test_v10_ten_hertz_balls(tmp_path):
    sim = settle(tmp_path, 10, 15000, 5e-3, shear=exact.SHEAR, poiss=exact.NU, hertz=True)
    u = overlaps(sim, 10)
    table = [0.8884, 1.4102, 1.8479, 2.2386, 2.5977, 2.9334, 3.2509, 3.5535, 3.8438, 4.1235]
    assert u == pytest.approx(exact.hertz(10), rel=1e-3)
    assert exact.hertz(10) == pytest.approx(table, abs=6e-5)
    assert u.sum() == pytest.approx(26.6879, rel=1e-3)
    y = np.array([value(sim, "y", j) for j in range(10)])
    assert y == pytest.approx(exact.heights(exact.hertz(10)), abs=1e-3)
    assert diagnostics.wall_forces(sim)[0] == pytest.approx([0.0, -10.0 * exact.MASS * exact.GRAVITY], rel=1e-3)
    assert not sim.particles["x"].any(), "a straight column stays straight"


@pytest.mark.parametrize("n", [1, 4, 7])
def test_v11_linear_balls(tmp_path, n):
    k = 2e10
    sim = settle(tmp_path, n, 15000, 5e-3, damp=0.8, kn=2.0 * k)
    assert overlaps(sim, n) == pytest.approx(exact.linear(n, k), rel=1e-4)

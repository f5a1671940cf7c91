"""V7, V8: elastic impact of spheres with each other and with a wall."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.dem import particles, properties, walls
from tests.cases.hertz_impact import exact
from tests.support import at_wall, crossing, model, only, pair, value, watch

DT = 1e-3


def sphere_model(folder):
    """Nothing yet, spheres of the table."""
    return model(folder, dt=DT, disk="off")


def elastic(sim, where=None, **more):
    properties.prop(sim, where, density=exact.DENSITY, shear=exact.G, poiss=exact.NU, hertz=True, **more)


@pytest.mark.smoke
def test_v7_two_spheres(tmp_path):
    sim = sphere_model(tmp_path)
    particles.ball(sim, 0, 0.0, 0.0, exact.RADIUS)
    particles.ball(sim, 1, 2.0 * exact.RADIUS, 0.0, exact.RADIUS)
    elastic(sim, only(0), xv=0.5)
    elastic(sim, only(1), xv=-0.5)

    def look(sim):
        contact = pair(sim)
        return 2.0 * exact.RADIUS - value(sim, "x", 1) + value(sim, "x", 0), contact.fn if contact else 0.0

    overlap, fn = watch(sim, 1000, look).T
    t = DT * np.arange(1001)
    assert overlap.max() == pytest.approx(0.309758, rel=0.002) == exact.PAIR.overlap
    assert crossing(t, overlap) == pytest.approx(0.911702, rel=0.002) == exact.PAIR.duration
    assert fn.max() == pytest.approx(4.56394e9, rel=0.002) == exact.PAIR.force
    restitution = value(sim, "vx", 1) - value(sim, "vx", 0)
    assert restitution == pytest.approx(1.0, rel=0.002)
    assert value(sim, "vx", 0) == -value(sim, "vx", 1), "equal and opposite to the last bit"


def test_v8_sphere_and_wall(tmp_path):
    sim = sphere_model(tmp_path)
    walls.wall(sim, 0, ((-200.0, 0.0), (200.0, 0.0)))
    particles.ball(sim, 0, 0.0, exact.RADIUS, exact.RADIUS)
    elastic(sim, yv=-1.0)

    def look(sim):
        contact = at_wall(sim)
        return exact.RADIUS - value(sim, "y"), contact.fn if contact else 0.0

    overlap, fn = watch(sim, 1300, look).T
    t = DT * np.arange(1301)
    assert overlap.max() == pytest.approx(0.408728, rel=0.002) == exact.WALL.overlap
    assert crossing(t, overlap) == pytest.approx(1.202998, rel=0.002) == exact.WALL.duration
    assert fn.max() == pytest.approx(6.91765e9, rel=0.002) == exact.WALL.force
    assert value(sim, "vy") == pytest.approx(1.0, rel=0.002)
    assert value(sim, "vx") == 0.0


def test_the_scheme_is_of_second_order(tmp_path):
    """Largest force at dt and dt / 4, from a parabola through the three largest values."""
    errors = []
    for dt in (2e-2, 5e-3):
        sim = model(tmp_path, dt=dt, disk="off")
        walls.wall(sim, 0, ((-200.0, 0.0), (200.0, 0.0)))
        particles.ball(sim, 0, 0.0, exact.RADIUS, exact.RADIUS)
        elastic(sim, yv=-1.0)
        u = exact.RADIUS - watch(sim, round(1.0 / dt), lambda sim: value(sim, "y"))
        k = u.argmax()
        a, b, c = u[k - 1 : k + 2]
        errors.append(abs(b - (a - c) ** 2 / (8.0 * (a - 2.0 * b + c)) - exact.WALL.overlap))
    assert np.log(errors[0] / errors[1]) / np.log(4.0) == pytest.approx(2.0, abs=0.3)


def test_a_thousand_collisions(tmp_path):
    """A sphere to and fro between two walls, about 60 steps per collision: no drift of its speed."""
    sim = model(tmp_path, dt=0.02, disk="off")
    walls.wall(sim, 0, ((-200.0, 0.0), (200.0, 0.0)))
    walls.wall(sim, 1, ((-200.0, 120.2), (200.0, 120.2)))
    particles.ball(sim, 0, 0.0, exact.RADIUS, exact.RADIUS)
    elastic(sim, yv=-exact.V)
    v = watch(sim, 71000, lambda sim: float(sim.particles["vy"][0]))
    assert np.count_nonzero(v[1:] * v[:-1] < 0.0) >= 1000, "each collision turns it round once"
    free = np.abs(v[1:-1])[(v[1:-1] == v[:-2]) & (v[1:-1] == v[2:])]
    assert free**2 == pytest.approx(exact.V**2, rel=0.01)

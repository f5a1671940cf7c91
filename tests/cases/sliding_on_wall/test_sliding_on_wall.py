"""V5, V6: stick, slip and return of a ball along a wall."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.dem import particles, properties, walls
from tests.cases.sliding_on_wall import exact
from tests.support import at_wall, crossing, model, value, watch


def slide(folder, dt: float, eta: float, seconds: float) -> dict[str, np.ndarray]:
    """t, y, v (at the half step before t), Fn, Fs of a ball along a wall on its left."""
    sim = model(folder, dt=dt, disk="hex", lsm=eta)
    walls.wall(sim, 1, ((exact.OVERLAP, -200.0), (exact.OVERLAP, 200.0)), kn=exact.K, ks=exact.K, fric=exact.MU)
    particles.ball(sim, 0, exact.RADIUS, 0.0, exact.RADIUS)
    properties.prop(sim, density=exact.DENSITY, kn=exact.K, ks=exact.K, fric=1.0, yv=exact.V0)
    properties.fix(sim, ("x", "spin"))
    n = round(seconds / dt)

    def look(sim):
        contact = at_wall(sim, wall=1)
        return value(sim, "y"), value(sim, "vy"), contact.fn, contact.fs

    y, v, fn, fs = watch(sim, n, look).T
    return {"t": np.arange(n + 1) * dt, "y": y, "v": v, "fn": fn, "fs": fs}


def stop(run: dict[str, np.ndarray], dt: float) -> float:
    """Moment at which the velocity, known at half steps, passes zero."""
    return crossing(run["t"] - 0.5 * dt, run["v"])


def test_v5_coulomb_slip(tmp_path):
    dt = 1e-3
    run = slide(tmp_path, dt, 0.0, 1.0)
    expected = exact.Exact(0.0)
    t, y = run["t"], run["y"]
    assert run["fn"] == pytest.approx(1.213152e9, rel=1e-6)
    sticking = y < 0.0220573
    sticking[np.argmax(~sticking) :] = False
    # Anticlockwise normal to the left: the tangent points down, friction on the upward ball is positive along it.
    assert run["fs"][sticking] == pytest.approx(5.5e9 * y[sticking], rel=1e-9)
    slipping = ~sticking & (t < 0.189)
    assert run["fs"][slipping] == pytest.approx(0.1 * 1.213152e9, rel=1e-6)
    assert crossing(t, y, 0.0220573) == pytest.approx(0.022539, rel=0.01) == expected.slips_at
    assert stop(run, dt) == pytest.approx(0.189613, rel=0.01) == expected.stops_at
    assert y.max() == pytest.approx(0.100262, rel=0.01) == expected.stops_y
    swing = y[t > 0.2]
    assert 0.5 * (swing.max() - swing.min()) == pytest.approx(0.0220573, rel=0.01) == exact.STRETCH
    assert 0.5 * (swing.max() + swing.min()) == pytest.approx(0.0782044, rel=0.01) == expected.centre
    assert y[round(0.4 / dt)] == pytest.approx(0.056639, rel=0.01) == expected.swing(0.4)


def test_v6_with_lattice_solid_damping(tmp_path):
    """The program comes to 1 % of all figures at dt = 1e-4; the error is of first order in dt (next test)."""
    dt = 1e-4
    run = slide(tmp_path, dt, 3e8, 1.0)
    expected = exact.Exact(3e8)
    assert crossing(run["t"], run["y"], 0.0220573) == pytest.approx(0.027358, rel=0.01) == expected.slips_at
    assert stop(run, dt) == pytest.approx(0.093840, rel=0.01) == expected.stops_at
    assert run["y"].max() == pytest.approx(0.039308, rel=0.01) == expected.stops_y
    assert run["y"][-1] == pytest.approx(0.017250, rel=0.01) == expected.centre


def test_v6_converges_with_first_order(tmp_path):
    """The viscous force takes the velocity half a step late. (Place of the stop; dt and dt / 4.)"""
    errors = [slide(tmp_path, dt, 3e8, 0.12)["y"].max() - exact.Exact(3e8).stops_y for dt in (1e-3, 2.5e-4)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_the_friction_of_the_pair_is_the_smaller_one(tmp_path):
    """As in V5, but it is now the ball that is smooth."""
    sim = model(tmp_path, disk="hex")
    walls.wall(sim, 1, ((exact.OVERLAP, -200.0), (exact.OVERLAP, 200.0)), kn=exact.K, ks=exact.K, fric=0.8)
    particles.ball(sim, 0, exact.RADIUS, 0.0, exact.RADIUS)
    properties.prop(sim, density=exact.DENSITY, kn=exact.K, ks=exact.K, fric=0.1, yv=exact.V0)
    properties.fix(sim, ("x", "spin"))
    seen = watch(sim, 100, lambda sim: at_wall(sim, wall=1).fs)
    assert seen[-1] == pytest.approx(0.1 * exact.FN, rel=1e-12)

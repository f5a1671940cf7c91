"""V14: oblique impact with gross slip."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import cycles, particles, properties, walls
from tests.cases.oblique_impact import exact
from tests.support import body, model, steps, value, velocity


@pytest.mark.parametrize("disk", ["on", "off", "hex"])
@pytest.mark.parametrize("slope", [0.0, 0.5, 2.0])
def test_v14_gross_slip(tmp_path, disk, slope):
    """The wall is turned by `slope`; in its frame nothing changes."""
    t, n = np.array([math.cos(slope), math.sin(slope)]), np.array([-math.sin(slope), math.cos(slope)])
    sim = model(tmp_path, exact.DT, disk=disk)
    particles.ball(sim, 0, *(exact.RADIUS * n), exact.RADIUS)
    properties.prop(sim, density=exact.DENSITY)
    walls.wall(sim, 0, (tuple(-9.0 * t), tuple(9.0 * t)), fric=exact.MU)
    cycles.prepare(sim)
    mass, inertia = body(sim)
    kn = 2.0 * mass * exact.W**2
    walls.wall(sim, 0, kn=kn, ks=kn)
    vx, vy = exact.VT * t - exact.VN * n
    properties.prop(sim, kn=kn, ks=kn, fric=1.0, xv=vx, yv=vy)
    steps(sim, exact.CONTACT_STEPS + 20)

    v = velocity(sim)
    assert v @ n == pytest.approx(exact.VN, rel=0.005)
    assert exact.VT - v @ t == pytest.approx(exact.LOST, rel=0.005)
    assert value(sim, "spin") == pytest.approx(exact.spin(mass, inertia), rel=0.005)
    # At every single step friction is mu times the normal force, so the momenta keep that ratio to rounding.
    assert exact.VT - v @ t == pytest.approx(exact.MU * (v @ n + exact.VN), rel=1e-10)

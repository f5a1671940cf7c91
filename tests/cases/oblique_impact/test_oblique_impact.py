"""V14: oblique impact with gross slip."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import cycles, particles, properties, walls
from hpcdem.core.selection import Ids
from tests.cases.oblique_impact import exact
from tests.support import body, model, steps, value, velocity


@pytest.mark.some_of_each
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


@pytest.mark.parametrize("hertz", [False, True])
def test_no_impact_gains_energy(tmp_path, hertz):
    """Spheres fall on a wall with friction at all angles, those that graze it too: no more energy after than before,
    and none is faster along the wall."""
    angles, radius, density, kn = np.radians(np.arange(0.0, 90.0, 2.0)), 0.4, 2100.0, 3e6
    sim = model(tmp_path, 4e-6 if hertz else 4e-5, disk="off")
    walls.wall(sim, 0, ((-10.0, 0.0), (4.0 * len(angles) + 10.0, 0.0)), kn=2.0 * kn, ks=2.0 * kn, fric=0.5)
    for gid in range(len(angles)):
        particles.ball(sim, gid, 4.0 * gid, radius * (1.0 + 1e-9), radius)
    law = {"shear": 8e8, "poiss": 0.3, "hertz": True} if hertz else {"kn": 2.0 * kn, "ks": 2.0 * kn}
    properties.prop(sim, density=density, fric=0.5, **law)
    for gid, angle in enumerate(angles):
        properties.prop(sim, Ids(gid, gid), xv=math.sin(angle), yv=-math.cos(angle))
    cycles.cycle(sim, 15000 if hertz else 4000)
    p, mass = sim.particles, density * 4.0 / 3.0 * math.pi * radius**3
    order = np.argsort(p["gid"])
    vx, vy, spin, y = (p[name][order] for name in ("vx", "vy", "spin", "y"))
    assert (y > radius).all()
    kept = vx * vx + vy * vy + 0.4 * (radius * spin) ** 2  # over that before, which is 1
    assert body(sim)[0] == pytest.approx(mass)
    assert kept.max() <= 1.0 + 1e-6 and kept.min() < 0.75
    assert (np.abs(vx[1:]) < np.sin(angles[1:])).all()

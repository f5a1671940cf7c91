"""V18: two free balls collide with friction; momentum and angular momentum stay what they were.

Forces come in equal and opposite pairs, so sum(m v) cannot change. Both act at one point on the line of centres,
l_a and l_b from them with l_a + l_b = d: the torques Fs l_a + Fs l_b and the moment of the pair of forces, -Fs d,
cancel. For the leap-frog the angular momentum sum(m x(n) x v(n - 1/2) + I w(n - 1/2)) is the one that is kept:
going on by a step adds dt (m x(n) x a + I w') + m dt v x v = 0.
"""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.dem import particles, properties
from tests.support import body, model, only, pair, value, watch

LINEAR = {"kn": 4e7, "ks": 3e7}
HERTZ = {"shear": 1e8, "poiss": 0.25, "hertz": True}


def momenta(sim) -> tuple[float, float, float]:
    """Momentum (2) [kg m/s] and angular momentum about the origin [kg m^2/s]."""
    px = py = angular = 0.0
    for gid in (0, 1):
        mass, inertia = body(sim, gid)
        x, y, vx, vy, spin = (value(sim, name, gid) for name in ("x", "y", "vx", "vy", "spin"))
        px += mass * vx
        py += mass * vy
        angular += mass * (x * vy - y * vx) + inertia * spin
    return px, py, angular


@pytest.mark.some_of_each
@pytest.mark.parametrize("law", [LINEAR, HERTZ], ids=["linear", "hertz"])
@pytest.mark.parametrize("disk", ["on", "off", "hex"])
@pytest.mark.parametrize("mu", [0.1, 0.8])
def test_v18_conservation(tmp_path, law, disk, mu):
    sim = model(tmp_path, dt=1e-4, disk=disk)
    particles.ball(sim, 0, 3.0, 2.0, 1.0)
    particles.ball(sim, 1, 5.1, 3.0, 1.4)
    properties.prop(sim, density=2000.0, fric=mu, **law)
    properties.prop(sim, only(1), density=1200.0)
    properties.prop(sim, only(0), xv=3.0, yv=-1.0, spin=4.0)
    properties.prop(sim, only(1), xv=-2.0, yv=-0.5, spin=7.0)
    spins = []

    def look(sim):
        contact = pair(sim)
        spins.append(value(sim, "spin", 0))
        return (*momenta(sim), 0.0 if contact is None else contact.fs)

    px, py, angular, fs = watch(sim, 700, look).T
    assert np.abs(fs).max() > 0.0 and fs[-1] == 0.0, "they touched, with friction, and parted"
    assert abs(spins[-1] - spins[0]) > 0.1
    size = np.abs([px, py, angular]).max(axis=1)
    for values, scale in zip((px, py, angular), size):
        assert values == pytest.approx(values[0], abs=1e-10 * scale)


def test_elastic_collision_without_friction_keeps_the_energy(tmp_path):
    sim = model(tmp_path, dt=1e-4, disk="off")
    particles.ball(sim, 0, 0.0, 0.0, 1.0)
    particles.ball(sim, 1, 2.1, 1.3, 1.4)
    properties.prop(sim, density=2000.0, **HERTZ)
    properties.prop(sim, only(0), xv=3.0, spin=2.0)

    def energy(sim) -> float:
        total = 0.0
        for gid in (0, 1):
            mass, inertia = body(sim, gid)
            vx, vy, spin = (value(sim, name, gid) for name in ("vx", "vy", "spin"))
            total += 0.5 * mass * (vx**2 + vy**2) + 0.5 * inertia * spin**2
        return total

    seen = watch(sim, 2000, energy)
    assert seen.min() < 0.95 * seen[0], "part of it was in the contact"
    assert seen[-1] == pytest.approx(seen[0], rel=1e-4)
    assert value(sim, "spin", 0) == 2.0

"""V25: lattice-solid damping: a ball under its weight reaches v = m g / eta.

v(n) = v(n-1) + (m g - eta v(n-1)) dt / m, from rest v(n) = (m g / eta) (1 - (1 - eta dt / m)^n). The damping makes
no torque.
"""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.dem import particles, properties
from tests.support import body, model, value, velocity, watch

G, ETA, DT = 9.8, 4e3, 1e-2


@pytest.mark.parametrize("damp", [0.0, 0.4])
def test_v25_terminal_velocity(tmp_path, damp):
    """Local damping multiplies the net force, so it changes how fast, not where it ends: from the second step on
    the rate is (1 - alpha) eta / m; the first step, from rest, has 1 + alpha."""
    sim = model(tmp_path, dt=DT, gravity=(0.6 * G, -0.8 * G), lsm=ETA)
    particles.ball(sim, 0, 0.0, 0.0, 1.0)
    properties.prop(sim, density=1000.0, spin=3.0, damp=damp)
    v = watch(sim, 2000, velocity)
    mass, _ = body(sim)
    terminal = mass * G / ETA * np.array([0.6, -0.8])
    assert v[-1] == pytest.approx(terminal, rel=1e-6)
    rate = (1.0 - damp) * ETA * DT / mass
    first = v[1] / terminal
    assert first == pytest.approx([rate, (1.0 + damp) / (1.0 - damp) * rate], rel=1e-12)
    n = np.arange(1, 2001)
    for axis in (0, 1):
        missing = (1.0 - first[axis]) * (1.0 - rate) ** (n - 1.0)
        assert 1.0 - v[1:, axis] / terminal[axis] == pytest.approx(missing, abs=1e-12)
    assert value(sim, "spin") == 3.0

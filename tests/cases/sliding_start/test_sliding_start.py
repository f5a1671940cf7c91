"""V17: from sliding to rolling."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.dem import cycles, particles, properties, walls
from tests.cases.sliding_start import exact
from tests.support import at_wall, body, held_for_a_step, model, value, watch

DT, W = 1e-3, 300.0


@pytest.mark.parametrize("disk", ["on", "off"])
def test_v17_the_ball_ends_up_rolling(tmp_path, disk):
    sim = model(tmp_path, DT, disk=disk, gravity=(0.0, -exact.GRAVITY))
    walls.wall(sim, 0, ((-10.0, 0.0), (80.0, 0.0)), fric=exact.MU)
    particles.ball(sim, 0, 0.0, exact.RADIUS - exact.GRAVITY / W**2, exact.RADIUS)
    properties.prop(sim, density=exact.DENSITY, fric=1.0)
    cycles.prepare(sim)
    mass, inertia = body(sim)
    walls.wall(sim, 0, kn=2.0 * mass * W**2, ks=2.0 * mass * W**2)
    properties.prop(sim, kn=2.0 * mass * W**2, ks=2.0 * mass * W**2)
    held_for_a_step(sim)
    properties.prop(sim, xv=exact.V0)

    def look(sim):
        contact = at_wall(sim)
        return value(sim, "vx"), value(sim, "spin"), contact.fn if contact else 0.0, contact.fs if contact else 0.0

    v, w, fn, fs = watch(sim, 3000, look).T
    t = DT * np.arange(len(v))
    sliding = np.abs(fs) > (1.0 - 1e-9) * exact.MU * fn
    begins_to_roll = t[np.flatnonzero(~sliding[5:])[0] + 5]
    assert begins_to_roll == pytest.approx(exact.TIME[disk], rel=0.01)
    rolling = t > exact.TIME[disk] + 0.1
    assert v[rolling].mean() == pytest.approx(exact.FINAL[disk], rel=1e-3)
    assert v[rolling] == pytest.approx(exact.FINAL[disk], rel=0.01)
    assert -w[rolling].mean() * exact.RADIUS == pytest.approx(exact.FINAL[disk], rel=0.01)
    arm = exact.RADIUS - 0.5 * exact.GRAVITY / W**2
    assert mass * v * arm - inertia * w == pytest.approx(mass * exact.V0 * arm, rel=1e-10)

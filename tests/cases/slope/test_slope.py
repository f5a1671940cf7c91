"""V15, V16: ball on an inclined wall."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import cycles, particles, properties, walls
from tests.cases.slope import exact
from tests.support import at_wall, body, held_for_a_step, model, position, value, velocity, watch

DT, W = 1e-3, 200.0
"""Time step [s]; sqrt(k / m) of the contact [1/s], so that the overlap is g cos a / W^2 = 0.00025 R."""


def on_slope(folder, angle: float, mu: float, disk: str, damp: float = 0.0, fix: tuple[str, ...] = ()):
    """A ball laid on a wall that falls to the right, pressed in so far that it carries the ball; returns also
    "down"."""
    down, out = np.array([math.cos(angle), -math.sin(angle)]), np.array([math.sin(angle), math.cos(angle)])
    sim = model(folder, DT, disk=disk, gravity=(0.0, -exact.GRAVITY))
    walls.wall(sim, 0, (tuple(-5.0 * down), tuple(50.0 * down)), fric=mu)
    start = (exact.RADIUS - exact.GRAVITY * math.cos(angle) / W**2) * out
    particles.ball(sim, 0, *start, exact.RADIUS)
    properties.prop(sim, density=exact.DENSITY, fric=1.0, damp=damp)
    cycles.prepare(sim)
    k = body(sim)[0] * W**2
    walls.wall(sim, 0, kn=2.0 * k, ks=2.0 * k)
    properties.prop(sim, kn=2.0 * k, ks=2.0 * k)
    held_for_a_step(sim)
    properties.fix(sim, fix)
    return sim, down, start


def acceleration(sim, down, n: int) -> float:
    """Slope of the velocity along `down` over n steps, by least squares [m/s^2]."""
    v = watch(sim, n, lambda sim: velocity(sim) @ down)
    return float(np.polyfit(DT * np.arange(n + 1), v, 1)[0])


@pytest.mark.parametrize(("angle", "mu"), [(30.0, 0.3), (20.0, 0.35), (60.0, 1.0), (10.0, 0.0)])
def test_v15_sliding(tmp_path, angle, mu):
    angle = math.radians(angle)
    sim, down, _ = on_slope(tmp_path, angle, mu, "on", fix=("spin",))
    assert math.tan(angle) > mu
    acceleration(sim, down, 200)  # the shear spring is stretched first
    assert acceleration(sim, down, 800) == pytest.approx(exact.sliding(angle, mu), rel=1e-5)
    assert value(sim, "spin") == 0.0


@pytest.mark.parametrize(("angle", "mu"), [(20.0, 0.5), (20.0, 0.37), (5.0, 1.0)])
def test_v15_at_rest(tmp_path, angle, mu):
    """Even where tan a is just below mu: what slips in the first swing comes to rest."""
    angle = math.radians(angle)
    sim, down, start = on_slope(tmp_path, angle, mu, "on", damp=0.5, fix=("spin",))
    assert math.tan(angle) < mu
    here = watch(sim, 1500, lambda sim: (position(sim) - start) @ down)
    mass, _ = body(sim)
    assert abs(velocity(sim) @ down) < 1e-6
    assert abs(here[-1] - here[-300]) < 1e-9
    assert abs(at_wall(sim).fs) == pytest.approx(mass * exact.GRAVITY * math.sin(angle), rel=0.005)
    if math.tan(angle) < 0.5 * mu:  # the first swing, to twice the static stretch, does not slip
        assert here[-1] == pytest.approx(exact.GRAVITY * math.sin(angle) / W**2, rel=0.005)


@pytest.mark.some_of_each
@pytest.mark.parametrize(("disk", "ratio", "limit"), [("on", 0.5, 3.0), ("off", 0.4, 3.5)])
@pytest.mark.parametrize("share", [0.2, 0.6, 0.95])
def test_v16_rolling(tmp_path, disk, ratio, limit, share):
    """tan a is `share` of the largest slope on which the ball still rolls."""
    mu = 0.3
    angle = math.atan(share * limit * mu)
    sim, down, _ = on_slope(tmp_path, angle, mu, disk)
    acceleration(sim, down, 300)
    assert acceleration(sim, down, 1500) == pytest.approx(exact.rolling(angle, ratio), rel=0.005)
    arm = exact.RADIUS - 0.5 * at_wall(sim).overlap
    rolled = -value(sim, "spin") * arm
    assert velocity(sim) @ down == pytest.approx(rolled, rel=0.005), "it rolls clockwise, without slip"


def test_too_steep_to_roll(tmp_path):
    mu = 0.2
    angle = math.atan(1.3 * 3.0 * mu)
    sim, down, _ = on_slope(tmp_path, angle, mu, "on")
    acceleration(sim, down, 200)
    began = value(sim, "spin")
    assert acceleration(sim, down, 800) == pytest.approx(exact.sliding(angle, mu), rel=0.005)
    mass, inertia = body(sim)
    torque = mu * mass * exact.GRAVITY * math.cos(angle) * exact.RADIUS
    assert value(sim, "spin") - began == pytest.approx(-torque / inertia * 800 * DT, rel=0.005)

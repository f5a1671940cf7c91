"""SET restitution: discs part with the share of their speed that was asked for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, clumps, cycles, particles, properties, settings, walls
from hpcdem.core.errors import CommandError
from hpcdem.physics.coupling.model import Coupled
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.runtime.progress import Log
from tests.cases.restitution import exact
from tests.support import body, crossing, model, only, value, watch

KN, RADIUS, DENSITY, SPEED = 3e6, 0.4, 2100.0, 0.7
G, NU = 8e8, 0.3


def law(sim, hertz: bool, where=None, **more):
    own = {"shear": G, "poiss": NU, "hertz": True} if hertz else {"kn": 2.0 * KN}
    properties.prop(sim, where, density=DENSITY, **own, **more)


def drop(folder, e, hertz=False, dt=2e-5, steps=4000, **options):
    """On a wall, without gravity: overlaps [m] and velocities [m/s]; the model is left behind."""
    sim = model(folder, dt=dt, disk="off" if hertz else "on", restitution=e, **options)
    walls.wall(sim, 0, ((-5.0, 0.0), (5.0, 0.0)), kn=2.0 * KN)
    particles.ball(sim, 0, 0.0, RADIUS, RADIUS)
    law(sim, hertz, yv=-SPEED)
    seen = watch(sim, steps, lambda sim: (RADIUS - value(sim, "y"), value(sim, "vy")))
    return sim, seen[:, 0], seen[:, 1]


@pytest.mark.parametrize("e", [0.9, 0.55, 0.1])
def test_a_drop_on_a_wall_with_a_linear_spring(tmp_path, e):
    sim, u, v = drop(tmp_path, e)
    mass = body(sim)[0]
    duration, deepest = exact.linear(mass, KN, e, SPEED)
    assert v[-1] / SPEED == pytest.approx(e, rel=0.01)
    assert u.max() == pytest.approx(deepest, rel=0.01)
    assert crossing(2e-5 * np.arange(len(u)), u) == pytest.approx(duration, rel=0.01)


@pytest.mark.parametrize("e", [0.8, 0.3])
def test_a_drop_on_a_wall_with_the_law_of_hertz(tmp_path, e):
    """The dashpot goes with U^(1/4): e does not depend on the speed."""
    sim, u, v = drop(tmp_path, e, hertz=True, dt=3e-6, steps=9000)
    factor = 2.0 * G / (3.0 * (1.0 - NU)) * math.sqrt(2.0 * RADIUS)
    duration, deepest, parts = exact.hertz(body(sim)[0], factor, e, SPEED)
    assert parts == pytest.approx(e, rel=1e-3)
    assert v[-1] / SPEED == pytest.approx(e, rel=0.01)
    assert u.max() == pytest.approx(deepest, rel=0.01)
    assert crossing(3e-6 * np.arange(len(u)), u) == pytest.approx(duration, rel=0.01)


@pytest.mark.some_of_each
@pytest.mark.parametrize("hertz", [False, True])
@pytest.mark.parametrize("fixed", [False, True])
def test_two_discs(tmp_path, hertz, fixed):
    """Of different size, one of them held or none, along a line at an angle; momentum stays what it was."""
    e, dt = 0.6, (3e-6 if hertz else 2e-5)
    sim = model(tmp_path, dt=dt, disk="off" if hertz else "on", restitution=e)
    along = np.array([0.6, 0.8])
    for gid, r in ((1, 0.3), (2, 0.5)):
        particles.ball(sim, gid, *(0.8 * along * (gid - 1)), r)
    law(sim, hertz)
    properties.prop(sim, only(2), xv=-SPEED * along[0], yv=-SPEED * along[1])
    if fixed:
        properties.fix(sim, ("x", "y"), only(1))
    cycles.cycle(sim, 10000 if hertz else 4000)
    first, second = (np.array([value(sim, name, gid) for name in ("vx", "vy")]) for gid in (1, 2))
    assert (second - first) @ along / SPEED == pytest.approx(e, rel=0.01)
    mass, other = body(sim, 1)[0], body(sim, 2)[0]
    if fixed:
        assert not first.any()
    else:
        assert mass * first + other * second == pytest.approx(-other * SPEED * along, rel=1e-9)


def test_only_contacts_are_damped(tmp_path):
    """Free flight and bonds are not; 1 takes the dashpots away."""
    ends = []
    for e, bonded in ((1.0, False), (0.3, False), (1.0, True), (0.3, True)):
        sim = model(tmp_path, dt=2e-5, restitution=e)
        particles.ball(sim, 1, 0.0, 0.0, 0.5)
        particles.ball(sim, 2, 0.999, 0.0, 0.5)
        particles.ball(sim, 3, 9.0, 0.0, 0.5)
        law(sim, False)
        properties.prop(sim, only(3), xv=3.0)
        if bonded:
            bonds.bond(sim, ebmod=1e7, gbmod=1e7, tstrength=1e9, sstrength=1e9)
        cycles.cycle(sim, 300)
        assert value(sim, "vx", 3) == 3.0
        ends.append(value(sim, "vx", 2))
    assert ends[0] > 0.0 and ends[1] != ends[0] and ends[2] == ends[3]


def test_the_force_on_a_wall_holds_that_of_the_dashpot(tmp_path):
    """What stops the disc is what the wall feels."""
    sim, _, v = drop(tmp_path, 0.4, steps=100)
    before = v[-1]
    assert 0.0 < -before < SPEED
    pushed = diagnostics.wall_forces(sim)[0, 1]
    cycles.cycle(sim, 1)
    assert body(sim)[0] * (value(sim, "vy") - before) / 2e-5 == pytest.approx(-pushed, rel=1e-9)


def test_what_it_does_not_go_with(tmp_path):
    sim = model(tmp_path, restitution=0.5)
    for gid in range(2):
        particles.ball(sim, gid, 2.0 * gid, 0.0, 0.5)
    law(sim, False)
    settings.set_option(sim, "energy", 5)
    with pytest.raises(CommandError, match="SET restitution does not support SET energy"):
        cycles.cycle(sim, 1)
    settings.set_option(sim, "energy", 0)
    cycles.cycle(sim, 1)
    clumps.join(sim)
    with pytest.raises(CommandError, match="SET restitution does not support clumps"):
        cycles.cycle(sim, 1)
    for wrong in (0.0, -0.1, 1.2, math.nan):
        with pytest.raises(CommandError, match="above 0 and not above 1"):
            settings.set_option(sim, "restitution", wrong)


def test_blocks_are_refused(tmp_path):
    blocks = Blocks(outdir=tmp_path)
    with pytest.raises(CommandError, match="SET restitution does not support contacts with blocks"):
        Coupled(model(tmp_path, restitution=0.5), blocks)


@pytest.mark.parametrize(
    ("more", "dt", "said"),
    [
        ({}, 2e-5, ""),
        ({"damp": 0.3}, 2e-5, "PROP damp and SET damp lsm dissipate additional energy"),
        ({}, 6e-2, "would reverse velocities within"),
    ],
)
def test_what_is_warned_of(tmp_path, capsys, more, dt, said):
    """With the time step of the last: c/m = 2 beta w, beta = 0.59, w = 60/s, twice of which times dt is 8.5."""
    sim = Simulation(outdir=tmp_path, log=Log())
    settings.set_option(sim, "dt", dt)
    settings.set_option(sim, "restitution", 0.1)
    particles.ball(sim, 0, 0.0, 0.39, RADIUS)
    walls.wall(sim, 0, ((-5.0, 0.0), (5.0, 0.0)), kn=2.0 * KN)
    law(sim, False, **more)
    cycles.cycle(sim, 0)
    found = [line for line in capsys.readouterr().out.splitlines() if "SET restitution" in line]
    assert len(found) == bool(said) and (not said or said in found[0])

"""Rolling resistance: deceleration on the level, rest without oscillation, slopes, pairs, energy, refusals."""

from __future__ import annotations

import math
from unittest.mock import Mock

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, clumps, cycles, particles, properties, settings, walls
from hpcdem.core.errors import CommandError
from hpcdem.core.selection import Ids
from hpcdem.physics.dem import diagnostics
from tests.cases.rolling import exact
from tests.cases.rolling.exact import KN, MU, V0, G, R
from tests.support import body, force, model, steps, value, watch


def on_plane(folder, beta: float = 0.0, speed: float = 0.0, kind: str = "c", dt: float = 2e-4, mu: float = MU,
             eta: float = 0.0, hertz: bool = False, **options):  # fmt: skip
    """A disc at rest in its contact with a level wall, gravity inclined by beta, rolling along x with `speed`."""
    gravity = (G * math.sin(beta), -G * math.cos(beta))
    sim = model(folder, dt, gravity=gravity, rolling=kind, **options)
    walls.wall(sim, 0, ((-5.0, 0.0), (50.0, 0.0)), kn=2.0 * KN, ks=2.0 * KN, fric=0.8)
    law = {"hertz": True, "shear": 1e8, "poiss": 0.2} if hertz else {"kn": 2.0 * KN, "ks": 2.0 * KN}
    mass = 1000.0 * (math.pi * R**2 if sim.settings.disk == "on" else 4.0 / 3.0 * math.pi * R**3)
    u = mass * G * math.cos(beta) / KN
    if hertz:
        u = (mass * G * math.cos(beta) * 3.0 * 0.8 / (2e8 * math.sqrt(2.0 * R))) ** (2.0 / 3.0)
    particles.ball(sim, 0, 0.0, R - u, R)
    arm = R - 0.5 * u
    properties.prop(sim, density=1000.0, fric=0.8, rfric=mu, rdamp=eta, xv=speed, spin=-speed / arm, **law)
    return sim


def rolling_speed(sim) -> float:
    """Angular momentum about the point of contact as a speed [m/s]: the swing of the shear spring is not in it."""
    (mass, inertia), arm = body(sim), 0.5 * (R + value(sim, "y"))
    return (mass * arm * value(sim, "vx") - inertia * value(sim, "spin")) / (mass * arm + inertia / arm)


@pytest.mark.parametrize("kind", ["a", "c"])
@pytest.mark.parametrize("disk, hertz", [("on", False), ("off", True)])
def test_a_rolling_disc_slows_down_at_the_stated_rate(tmp_path, kind, disk, hertz):
    sim = on_plane(tmp_path, speed=V0, kind=kind, disk=disk, hertz=hertz)
    steps(sim, 500)
    before, t = rolling_speed(sim), sim.clock.time
    steps(sim, 1000)
    a = (rolling_speed(sim) - before) / (sim.clock.time - t)
    arm = 0.5 * (R + value(sim, "y"))
    assert a == pytest.approx(exact.acceleration(0.0, arm, sphere=disk == "off"), rel=2e-3)
    assert -a == pytest.approx(0.7 if disk == "off" else 0.65333, rel=5e-3)


def test_with_spring_and_dashpot_it_comes_to_rest_and_does_not_oscillate(tmp_path):
    """eta_r 1: after the first steps, in which the dashpot acts, it rolls v^2/(2 a) far; the spring turns it back by
    M/kr = 5e-4 rad, and it does not swing."""
    sim = on_plane(tmp_path, speed=V0, eta=1.0)
    seen = watch(sim, 5000, lambda s: (value(s, "x"), rolling_speed(s), value(s, "angle")))
    x, speed, angle = seen.T
    stop = int(np.argmax(speed <= 0.0))
    way = speed[100] ** 2 / (-2.0 * exact.acceleration(0.0))
    assert 3000 < stop < 4000 and x[stop] - x[100] == pytest.approx(way, rel=5e-3)
    assert way == pytest.approx(0.19133 * (speed[100] / V0) ** 2, rel=1e-4)
    back = MU * R * body(sim)[0] * G / (3.0 * KN * (MU * R) ** 2)
    assert angle[-1] - angle[stop] == pytest.approx(back, rel=0.05) and back == pytest.approx(5.13e-4, rel=1e-3)
    assert np.abs(speed[-100:]).max() < 1e-6 and speed.min() > -R * back * 60.0


def test_without_dashpot_the_spring_swings_and_the_constant_torque_rattles(tmp_path):
    """What Ai et al. found: type A changes its sign for ever at rest, by one step's work; type C swings freely."""
    rattling = on_plane(tmp_path, speed=0.02, kind="a")
    spin = watch(rattling, 3000, lambda s: value(s, "spin"))[1500:]
    kick = MU * R * body(rattling)[0] * G / body(rattling)[1] * rattling.clock.dt
    assert (np.diff(np.sign(spin)) != 0).sum() > 100 and np.abs(spin).max() < 3.0 * kick
    swinging = on_plane(tmp_path, speed=0.005)
    spin = watch(swinging, 4000, rolling_speed)
    crossings = np.flatnonzero(np.diff(np.sign(spin)) > 0)
    mass, inertia = body(swinging)
    omega = math.sqrt(3.0 * KN * (MU * R) ** 2 / (inertia + mass * R**2))
    period = (crossings[-1] - crossings[0]) / (len(crossings) - 1) * swinging.clock.dt
    assert period == pytest.approx(2.0 * math.pi / omega, rel=0.03)  # ks of the contact in series: 2 %


@pytest.mark.parametrize("share", [0.9, 1.5])
def test_slope(tmp_path, share):
    """Below tan(beta) = mu_r it stays, above it rolls down at the rate of the balance of moments."""
    beta = math.atan(share * MU)
    sim = on_plane(tmp_path, beta, eta=0.5)
    steps(sim, 2000)
    before, t, x = rolling_speed(sim), sim.clock.time, value(sim, "x")
    steps(sim, 1000)
    if share < 1.0:
        assert abs(value(sim, "x") - x) < 1e-5 * R and x < MU * R
    else:
        a = (rolling_speed(sim) - before) / (sim.clock.time - t)
        assert a == pytest.approx(exact.acceleration(beta, 0.5 * (R + value(sim, "y"))), rel=5e-3)


def bed(folder, kind: str = "c", energy: int = 10**6, threads: int = 1, n: int = 40):
    """Discs thrown into a BOX with an inclined wall."""
    sim = model(folder, 1e-4, gravity=(0.0, -G), rolling=kind, energy=energy, seed=3)
    sim.threads = threads
    walls.box(sim, 0.0, 10.0, 0.0, 10.0, kn=1e7, ks=1e7, fric=0.5)
    walls.wall(sim, 1, ((2.0, 0.0), (6.0, 3.0)), kn=1e7, ks=1e7, fric=0.5)
    particles.gen(sim, n, [0.3, 0.4], (0.0, 10.0), (3.0, 10.0))
    properties.prop(sim, density=2000.0, kn=1e7, ks=8e6, fric=0.5, rfric=0.3, rdamp=0.2, yv=-3.0)
    return sim


@pytest.mark.parametrize("kind", ["a", "c"])
def test_the_energy_budget_closes(tmp_path, kind):
    """Linear springs: to rounding but for the turning of normals, as without rolling."""
    sim = bed(tmp_path, kind)
    cycles.cycle(sim, 6000)
    seen = sim.energy.evaluate(sim)
    assert abs(seen.relative) < 2e-4
    assert seen.loss_rolling > 0.02 * seen.work_gravity
    assert (seen.elastic_rolling > 0.0) == (kind == "c")


def test_what_the_spring_of_a_pair_stores_and_loses(tmp_path):
    """Two held discs; one turns by angles worked out by hand. kn 5e5, Rr = 2/3, u = 0.1: kr = 3 kn mu^2 Rr^2."""
    sim = model(tmp_path, 1e-3, energy=10**6)
    for gid, (x, r) in enumerate(((0.0, 1.0), (2.9, 2.0))):
        particles.ball(sim, gid, x, 0.0, r)
    properties.prop(sim, density=1000.0, kn=1e6, rfric=0.2)
    properties.prop(sim, Ids(1, 1), rfric=0.5)
    properties.fix(sim, ("x", "y", "spin"))
    properties.prop(sim, Ids(0, 0), spin=0.25)
    kr, limit = 3.0 * 5e5 * (0.2 * 2.0 / 3.0) ** 2, 0.2 * 2.0 / 3.0 * 5e5 * 0.1
    assert (kr, limit) == pytest.approx((26666.667, 6666.667))
    cycles.cycle(sim, 400)  # 0.1 rad: below the limit, at 0.25 rad
    seen = sim.energy.evaluate(sim)
    torque = kr * 0.1
    assert force(sim, 0)[2] == pytest.approx(-torque) and force(sim, 1)[2] == pytest.approx(torque)
    assert seen.elastic_rolling == pytest.approx(0.5 * kr * 0.1**2) and abs(seen.loss_rolling) < 1e-9 * kr
    cycles.cycle(sim, 1600)  # 0.5 rad: 0.25 of slipping
    seen = sim.energy.evaluate(sim)
    assert force(sim, 0)[2] == pytest.approx(-limit)
    assert seen.elastic_rolling == pytest.approx(0.5 * limit**2 / kr)
    assert seen.loss_rolling == pytest.approx(limit * 0.25, rel=1e-3) and abs(seen.relative) < 1e-12
    properties.prop(sim, Ids(0, 0), spin=0.0, xv=-10.0)
    cycles.cycle(sim, 20)  # they part
    seen = sim.energy.evaluate(sim)
    assert seen.elastic_rolling == 0.0 and not force(sim, 0).any() and abs(seen.relative) < 1e-9


def test_a_bonded_pair_does_not_resist_until_it_breaks(tmp_path):
    sim = model(tmp_path, 1e-3)
    for gid in range(2):
        particles.ball(sim, gid, 1.9 * gid, 0.0, 1.0)
    properties.prop(sim, density=1000.0, kn=1e6, rfric=0.2)
    bonds.bond(sim, ebmod=1e6, tstrength=1e6)
    properties.fix(sim, ("x", "y", "spin"))
    properties.prop(sim, Ids(0, 0), spin=0.1)
    steps(sim, 100)
    assert force(sim, 0)[2] == 0.0
    bonds.break_bonds(sim)
    steps(sim, 100)
    assert force(sim, 0)[2] == pytest.approx(-3.0 * 5e5 * (0.2 * 0.5) ** 2 * 0.01)


def test_the_stability_limit_counts_rolling(tmp_path):
    """A disc in its contact with a wall, mu_r 1: kr 3 kn R^2 on I = m R^2/2 is the highest frequency."""
    sim = on_plane(tmp_path, mu=1.0)
    steps(sim, 2)
    mass, inertia = body(sim)
    bare = on_plane(tmp_path, mu=0.0)
    steps(bare, 2)
    found, less = diagnostics.highest_frequency(sim), diagnostics.highest_frequency(bare)
    u = R - value(sim, "y")
    stiff = KN * np.array([[1.0, R - u / 2], [R - u / 2, (R - u / 2) ** 2 + 3.0 * R**2]])
    scale = np.diag([mass**-0.5, inertia**-0.5])
    assert (
        found == pytest.approx(math.sqrt(np.linalg.eigvalsh(scale @ stiff @ scale)[-1]), rel=1e-3)
        and found > 1.5 * less
    )
    assert diagnostics.critical_dt(sim) == pytest.approx(0.8 * math.sqrt(inertia / (3.0 * KN * R**2)), rel=1e-9)


@pytest.mark.parametrize("kind", ["c", "a"])
def test_dashpots_that_reverse_a_rotation_are_reported(tmp_path, kind):
    """C/I dt of a disc in its contact with a wall: 2 eta sqrt(kr Ir)/I dt, Ir = I + m R^2 = 3 I."""
    sim = on_plane(tmp_path, eta=1.0, kind=kind)
    steps(sim, 1)
    rate = 2.0 * math.sqrt(3.0 * 3.0 * KN * (MU * R) ** 2 / body(sim)[1]) * (kind == "c")
    assert sim.rolling.fastest(sim) == pytest.approx(rate)
    sim.log = Mock()
    sim.settings.dt = 2e-3
    properties.prop(sim, rdamp=20.0)
    cycles.cycle(sim, 1)
    keys = [call.args[0] for call in sim.log.warn_once.call_args_list]
    assert ("rolling dashpots" in keys) == (kind == "c")


def test_a_stiff_rolling_spring_is_not_taken_for_harmless(tmp_path):
    """mu_r 10: kr/I is 600 kn/m, so the step is looked at while contacts form."""
    sim = on_plane(tmp_path, mu=10.0, dt=3e-4)
    cycles.prepare(sim)
    assert not cycles._is_surely_small(sim)
    sim = on_plane(tmp_path, mu=0.0, dt=3e-4)
    cycles.prepare(sim)
    assert cycles._is_surely_small(sim)


@pytest.mark.parametrize("threads", [2, 4])
def test_threads_do_not_change_a_bit(tmp_path, threads):
    states = []
    for number in (1, threads):
        sim = bed(tmp_path / str(number), energy=0, threads=number, n=60)
        steps(sim, 600)
        states.append(diagnostics.fingerprint(sim))
    assert states[0] == states[1]


def test_energy_gains_columns_when_rolling_begins(tmp_path):
    sim = model(tmp_path, 1e-4, energy=2)
    particles.ball(sim, 0, 0.0, 0.0, 1.0)
    properties.prop(sim, density=1000.0, kn=1e6, xv=1.0)
    cycles.cycle(sim, 4)
    properties.prop(sim, rfric=0.1)
    cycles.cycle(sim, 4)
    head, *rows = (tmp_path / "energy.csv").read_text().splitlines()
    assert head.endswith(",elastic_rolling,loss_rolling") and len(rows) >= 4
    assert {row.count(",") for row in rows} == {head.count(",")}
    assert rows[0].endswith(",0.0,0.0")


def test_what_it_cannot_act_with_is_refused(tmp_path):
    sim = bed(tmp_path, energy=0)
    clumps.join(sim, Ids(0, 1))
    with pytest.raises(CommandError, match=r"PROP rfric .* does not support clumps"):
        cycles.prepare(sim)
    sim = bed(tmp_path, energy=0)
    sim.coupled = True
    with pytest.raises(CommandError, match="does not support contacts with blocks"):
        cycles.prepare(sim)
    with pytest.raises(CommandError, match="rfric must be a number from 0 to 10, got -1"):
        properties.prop(sim, rfric=-1.0)
    with pytest.raises(CommandError, match="SET rolling: expected a or c, got b"):
        settings.set_option(sim, "rolling", "b")

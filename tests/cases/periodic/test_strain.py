"""Periodic sides that move: strain rate, velocities across the sides, stress, work, ranks, restart, refusals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, cycles, history, output, particles, properties, settings, walls
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError, ScriptError
from hpcdem.core.selection import Group, Ids, Interval
from hpcdem.io.frames import read_frame
from hpcdem.lang.zdem.parser import parse_text
from hpcdem.physics.dem import diagnostics, mean_stress, saved_state
from hpcdem.physics.dem.simulation import Simulation
from tests.cases.periodic import exact
from tests.cases.periodic.test_periodic import LENGTH, by_id, chain, gas
from tests.pretended import Ranks
from tests.support import force, model, steps


def drifting(folder, at: float, left: float) -> Simulation:
    """Two discs in contact that move as the sides let them, the first at `at` from the left one, at rest there, the
    second 0.19 to its right, past the right side if need be; they slide and spin."""
    length, velocity = 4.0 / 3.0, -0.6
    sim = model(folder, 1e-5)
    walls.periodic(sim, (left, left + length))
    for gid, x in enumerate((at, at + 0.19)):
        particles.ball(sim, gid, left + x % length, 0.03 * gid, 0.1)
    properties.prop(sim, density=2000.0, kn=1e6, ks=5e5, fric=0.5)
    for gid, v, spin in ((0, 0.7, 3.0), (1, 0.0, -1.0)):
        properties.prop(sim, Ids(gid, gid), yv=v, spin=spin)
    walls.periodic(sim, xv=velocity)
    cycles.prepare(sim)
    return steps(sim, 7)


@pytest.mark.parametrize("left", [0.0, -3.7, 1000.123])
def test_a_pair_across_the_moving_sides_has_the_forces_of_one_inside(tmp_path, left):
    """Both are in one homogeneous strain, so the discs approach each other alike; forces are opposite to the last
    bit."""
    inside, across = (drifting(tmp_path, at, left) for at in (0.5, 4.0 / 3.0 - 0.07))
    for sim in (inside, across):
        assert np.array_equal(force(sim, 0)[:2], -force(sim, 1)[:2]) and np.hypot(*force(sim, 0)[:2]) > 100.0
    assert force(across, 0) == pytest.approx(force(inside, 0), rel=3e-9 * max(1.0, abs(left)))
    steady = drifting(tmp_path, 4.0 / 3.0 - 0.07, left)
    assert steady.settings.period == pytest.approx(4.0 / 3.0 - 0.6 * 7e-5, rel=1e-15)


@pytest.mark.parametrize("velocity", [0.003, -0.002])
def test_a_closed_chain_is_strained_evenly(tmp_path, velocity):
    """The homogeneous strain is a solution, since all bonds pull alike: the tension is that of the length, to rounding,
    and extension breaks all bonds at their strength."""
    gap = 1e-5
    sim = chain(tmp_path, gap)
    at_rest = sim.settings.period
    walls.periodic(sim, xv=velocity)
    cycles.prepare(sim)
    history.hist(sim, 1, 10, "period")
    for _ in range(5):
        cycles.cycle(sim, 49 if sim.clock.step == 1 else 50)
        period = sim.settings.period
        assert period == pytest.approx(at_rest + velocity * sim.clock.dt * (sim.clock.step - 1), rel=1e-15)
        tension = exact.tension(1e8, 0.1, period / 12.0 - 0.2)
        assert mean_stress.mean(sim, "sxx", (-1.0, 1.0)) == pytest.approx(-0.5 * tension, rel=1e-8)
    rows = (tmp_path / "hist_1.csv").read_text().splitlines()
    assert rows[0] == "step,time [s],period [m]" and float(rows[-1].split(",")[2]) == sim.settings.period
    if velocity > 0.0:
        until = (12.0 * (exact.breaking_gap(1e8, 1e6, 0.1) + 0.2) - sim.settings.period) / velocity / sim.clock.dt
        steps(sim, round(0.99 * until))
        assert sim.bonds_left() == 12 and sim.rebuilds > 2
        steps(sim, round(0.02 * until))
        assert sim.bonds_left() == 0


def test_free_flight_between_closing_sides(tmp_path):
    """Discs that do not touch fly straight in the frame of all images: the velocity relative to the strain, times the
    length, is constant across any number of crossings, and so are laps and frames consistent."""
    sim = gas(tmp_path, 0.3, 6.0)
    properties.prop(sim, kn=0.0, ks=0.0)
    sim.particles["radius"][:] = 0.02
    sim.particles["vy"][:] = 0.0
    walls.periodic(sim, xv=-1.5)
    s = sim.settings

    def invariant() -> np.ndarray:
        x, vx = by_id(sim, "x", "vx").T
        return vx * s.period - s.widening * (x - s.side)

    cycles.prepare(sim)
    before = invariant()
    begun = by_id(sim, "x", "vx", "laps")
    steps(sim, 9000)
    assert s.period == pytest.approx(LENGTH - 1.5 * 0.9, rel=1e-14)
    cycles.prepare(sim)
    assert invariant() == pytest.approx(before, rel=1e-9, abs=1e-9)
    output.Snapshot(sim).write_print()
    frame = read_frame(tmp_path / "all_0000009000.vtkhdf")
    p = frame.tables["particles"].columns
    order = np.argsort(p["gid"])
    x, vx, laps = (p[name][order] for name in ("x", "vx", "laps"))
    assert frame.settings["period"] == s.period and x.max() < s.side + s.period and laps.max() >= 1.0
    assert vx * s.period - s.widening * (x - s.side) == pytest.approx(before, rel=1e-9, abs=1e-9)
    flown = x + s.period * laps - begun[:, 0] - LENGTH * begun[:, 2]
    assert flown == pytest.approx((vx + s.widening * laps) * 0.9, abs=1e-9)


def test_the_work_of_the_sides_is_the_energy_of_the_springs(tmp_path):
    """A lattice that is shortened by 1 %: minus the integral of sxx over the area that is lost."""
    sim = model(tmp_path, 1e-5)
    walls.periodic(sim, (0.0, 2.0))
    x, y = (places.ravel() for places in np.meshgrid(0.1 + 0.2 * np.arange(10), 0.2 * np.arange(4)))
    particles.add(sim, np.column_stack([x, y, np.full(len(x), 0.1)]), 0, 0)
    properties.prop(sim, density=2000.0, kn=1e6, ks=1e6)
    walls.periodic(sim, xv=-0.02)
    cycles.prepare(sim)
    stress, length = [], []
    for _ in range(100):
        stress.append(mean_stress.mean(sim, "sxx", (-1.0, 1.0)))
        length.append(sim.settings.period)
        steps(sim, 1000)
    stress.append(mean_stress.mean(sim, "sxx", (-1.0, 1.0)))
    length.append(sim.settings.period)
    work = -2.0 * sum(0.5 * (a + b) * (l1 - l0) for a, b, l0, l1 in zip(stress, stress[1:], length, length[1:]))
    sim.particles["vx"][:] = 0.0  # the kinetic energy of the strain itself
    assert length[-1] == pytest.approx(1.98, rel=1e-9)
    assert output.HISTORIES["energy"][1](sim) == pytest.approx(work, rel=1e-3)
    assert work == pytest.approx(40 * 0.5 * 1e6 * 0.002**2 * 0.5, rel=1e-2)  # two springs in series per contact


def shortened(comm, threads: int = 1, velocity: float = -1.2) -> Simulation:
    """A bonded layer on a rigid row, in strain, with friction, rolling and dashpots; the row does not move."""
    sim = Simulation(comm, threads, outdir=Path("unused"))
    for name, given in {"dt": 1e-4, "gravity": (3.0, -8.0), "restitution": 0.6}.items():
        settings.set_option(sim, name, given)
    walls.box(sim, 0.0, 3.0, 0.0, 2.0, kn=1e6, ks=1e6, fric=0.5)
    walls.periodic(sim, (0.0, 3.0), xv=velocity)
    particles.gline(sim, (1.0, 0.1), (1.6, 0.1), 0.05, group="bed")
    properties.fix(sim, ("x", "y", "spin"), where=Group("bed"))
    particles.gen_grid(sim, [0.06, 0.075], (0.0, 3.0), (0.2, 0.95))
    properties.prop(sim, density=2000.0, kn=1e6, ks=5e5, fric=0.5, rfric=0.1, damp=0.1)
    bonds.bond(sim, ebmod=1e7, gbmod=1e7, tstrength=4e5, sstrength=4e5, tolerate=0.04, moment=True)
    walls.periodic(sim, xv=0.0)
    properties.prop(sim, Interval("y", 0.15, 2.0), xv=5.0)
    walls.periodic(sim, xv=velocity)
    cycles.prepare(sim)
    return sim


def finished(sim, until: int = 700) -> tuple:
    steps(sim, until - sim.clock.step)
    cycles.prepare(sim)
    stress = tuple(mean_stress.mean(sim, name, (0.1, 0.6)) for name in mean_stress.COMPONENTS)
    laps = int(sim.count(int(np.abs(sim.particles["laps"]).sum())))
    found = (
        diagnostics.fingerprint(sim),
        stress,
        sim.bonds_left(),
        sim.broken(),
        laps,
        sim.settings.period,
        sim.rebuilds,
    )
    sim.release()
    return found


@pytest.mark.parametrize("velocity", [-1.2, 0.9])
def test_bits_do_not_depend_on_ranks_threads_and_restarts(tmp_path, velocity):
    whole = finished(shortened(SerialComm(), velocity=velocity))
    assert whole[4] > 0 and sum(whole[3]) > 5 and whole[2] > 5 and whole[6] > 5
    assert finished(shortened(SerialComm(), 2, velocity)) == whole
    for ranks in (2, 3):
        run = Ranks(ranks).run(lambda comm, n=1 + ranks % 2: finished(shortened(comm, n, velocity)))
        assert run == [whole] * ranks
    begun = shortened(SerialComm(), velocity=velocity)
    while begun.settings.period == begun.rebuild_state.period or begun.clock.step < 300:  # between two rebuilds
        steps(begun, 1)
    saved_state.save(begun, tmp_path / "middle.sav")

    def resumed(comm) -> tuple:
        sim = Simulation(comm, 1, outdir=Path("unused"))
        saved_state.restore(sim, tmp_path / "middle.sav")
        return finished(sim)

    assert resumed(SerialComm())[:-1] == whole[:-1]
    assert [found[:-1] for found in Ranks(2).run(resumed)] == [whole[:-1]] * 2


def test_what_cannot_act_is_refused(tmp_path):
    sim = gas(tmp_path)
    for given, text in (({}, "give x"), ({"xv": math.nan}, "xv must be a finite number")):
        with pytest.raises(CommandError, match=text):
            walls.periodic(sim, **given)
    walls.periodic(sim, xv=-1.0)
    settings.set_option(sim, "energy", 10)
    with pytest.raises(CommandError, match="PERIODIC xv does not support SET energy"):
        cycles.cycle(sim, 1)
    settings.set_option(sim, "energy", 0)
    sim.settings.lsm = 1.0
    with pytest.raises(CommandError, match="PERIODIC xv does not support SET damp lsm"):
        cycles.cycle(sim, 1)
    other = model(tmp_path)
    with pytest.raises(CommandError, match="give x, the left and the right side"):
        walls.periodic(other, xv=-1.0)
    with pytest.raises(CommandError, match=r"^period: the sides are not periodic yet"):
        history.hist(other, 1, 10, "period")
    with pytest.raises(ScriptError, match="give x, the left and the right side, or xv"):
        parse_text("START\nPERIODIC\nSTOP\n", "script.py")
    parse_text("START\nPERIODIC x (0.0, 1.0) xv -0.1\nPERIODIC xv 0.0\nSTOP\n", "script.py")


def test_sides_that_close_too_far_stop_the_run(tmp_path):
    """As soon as the length is less than three reaches, and where a wall comes too near."""
    sim = gas(tmp_path)
    sim.particles["vx"][:] = sim.particles["vy"][:] = 0.0
    walls.wall(sim, 3, ((0.5, 3.0), (3.5, 3.0)))
    walls.periodic(sim, xv=-20.0)
    with pytest.raises(CommandError, match=r"wall 3 reaches from x = 0.5 to 3.5 m"):
        cycles.cycle(sim, 2000)
    walls.wall(sim, 3, delete=True)
    properties.prop(sim, kn=0.0, ks=0.0)
    with pytest.raises(CommandError, match=r"the length 0\.\d+ m must be at least 3 times the reach"):
        cycles.cycle(sim, 2000)

"""A two-disc clump falls on a wall, and two clumps hit each other."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import clumps, cycles, properties, walls
from hpcdem.io.clumps import write_clumps
from hpcdem.physics.dem import diagnostics
from tests.cases.clump_impact import exact
from tests.clumped import bodies, of_discs
from tests.support import model, only, steps


def falling(folder, theta: float, k: float, dt: float):
    """A dumbbell that is about to touch the floor with its lower disc."""
    sim = model(folder / "data", dt=dt)
    walls.wall(sim, 0, ((-20.0, 0.0), (20.0, 0.0)), kn=2.0 * k)
    half = 0.5 * exact.L
    kind = exact.AREA, exact.MOMENT, np.array([(-half, 0.0, exact.R), (half, 0.0, exact.R)])
    height = exact.R + half * math.sin(theta)
    write_clumps(folder / "one.clumps", bodies([kind], np.array([(0.0, height)]), np.array([theta])))
    clumps.clump(sim, folder / "one.clumps")
    properties.prop(sim, density=exact.DENSITY, kn=2.0 * k, yv=-exact.V0)
    cycles.prepare(sim)
    return sim


def state(sim) -> tuple[float, float, float, float]:
    """y, velocity upwards, spin, velocity sideways."""
    c = diagnostics.clumps(sim)
    return float(c["y"][0]), float(c["vy"][0]), float(c["spin"][0]), float(c["vx"][0])


def test_flat_on_the_floor_every_step_is_that_of_the_scheme(tmp_path):
    dt, seen = 1e-4, []
    sim = falling(tmp_path, 0.0, exact.K, dt)
    assert diagnostics.clumps(sim)["mass"][0] == exact.MASS and diagnostics.clumps(sim)["inertia"][0] == exact.INERTIA
    n = int(math.pi * math.sqrt(exact.MASS / (2.0 * exact.K)) / dt)
    for _ in range(n):
        steps(sim, 1)
        seen.append(exact.R - state(sim)[0])
    assert seen == pytest.approx(exact.flat(np.arange(1, n + 1), dt), abs=1e-12)
    assert max(seen) == pytest.approx(exact.V0 * math.sqrt(exact.MASS / (2.0 * exact.K)), rel=1e-4)
    steps(sim, 100)
    _, up, spin, sideways = state(sim)
    assert up == pytest.approx(exact.V0, rel=2e-3)
    assert abs(spin) < 1e-12 and sideways == 0.0


@pytest.mark.parametrize("theta", [0.4, 1.0, 1.4])
def test_on_one_disc_it_bounces_and_turns(tmp_path, theta):
    """To the limit of a stiff floor with the square root of the stiffness."""
    expected, errors = np.array(exact.oblique(theta)), []
    for k in (exact.K, 64.0 * exact.K):
        folder = tmp_path / f"{k:g}"
        folder.mkdir()
        lasts = exact.contact_time(theta, k)
        sim = falling(folder, theta, k, lasts / 2000.0)
        before = diagnostics.kinetic_energy(sim)
        steps(sim, 2100)
        _, up, spin, sideways = state(sim)
        assert sideways == 0.0
        assert diagnostics.kinetic_energy(sim) == pytest.approx(before, rel=2e-6)
        errors.append(np.abs([up, spin] - expected))
    assert (errors[1] < 0.02 * exact.V0).all()
    order = np.log(errors[0] / errors[1]) / np.log(64.0)
    assert order == pytest.approx([0.5, 0.5], abs=0.06)


@pytest.mark.parametrize("fric", [0.0, 0.5])
def test_two_clumps_keep_momentum_and_angular_momentum(tmp_path, fric):
    """Off-centre, with friction and without. Forces are equal and opposite and meet in one point, so what is kept is
    kept to rounding: angular momentum about the origin as well."""
    sim = model(tmp_path / "data", dt=1e-4)
    kinds = [of_discs([0.0, 0.8, 1.6], [0.0, 0.1, 0.5], [0.5, 0.6, 0.4]), of_discs([0.0, 0.9], [0.0, 0.0], [0.5, 0.45])]
    places = np.array([(0.0, 0.0), (2.2, 0.4)])
    write_clumps(tmp_path / "two.clumps", bodies(kinds, places, np.array([0.3, 2.0])))
    clumps.clump(sim, tmp_path / "two.clumps")
    properties.prop(sim, density=3.0, kn=2e5, ks=1e5, fric=fric)
    properties.prop(sim, only(0), xv=1.0, yv=0.2, spin=1.5)
    cycles.prepare(sim)

    def kept() -> np.ndarray:
        c = diagnostics.clumps(sim)
        m, i = c["mass"], c["inertia"]
        turning = m * (c["x"] * c["vy"] - c["y"] * c["vx"]) + i * c["spin"]
        return np.array([(m * c["vx"]).sum(), (m * c["vy"]).sum(), turning.sum()])

    before, energy = kept(), diagnostics.kinetic_energy(sim)
    touched = False
    for _ in range(300):
        steps(sim, 100)
        touched |= bool(len(diagnostics.contact_rows(sim)[0]))
    assert touched and not len(diagnostics.contact_rows(sim)[0])
    change = diagnostics.clumps(sim)["spin"]
    assert abs(change[1]) > 0.05
    assert kept() == pytest.approx(before, rel=1e-10)
    if fric == 0.0:
        assert diagnostics.kinetic_energy(sim) == pytest.approx(energy, rel=1e-4)
    else:
        assert diagnostics.kinetic_energy(sim) < energy

"""A clump on which nothing acts, and a clump of one disc."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import clumps, cycles, particles, properties, walls
from hpcdem.io.clumps import Clumps, write_clumps
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.dem import diagnostics
from tests.clumped import bodies, of_discs
from tests.support import model, only, steps

N = 100_000


@pytest.mark.parametrize("n", [4000, pytest.param(N, marks=pytest.mark.slow)])
def test_free_motion_is_kept(tmp_path, n):
    """x = x0 + V t, a = a0 + W t; momentum, angular momentum about the origin and energy stay; the distances between
    members stay to the last bits of the coordinates, however often it turned (270 rad in the long run)."""
    v, w, dt = (0.3, -0.1), 2.7, 1e-3
    sim = model(tmp_path / "data", dt=dt)
    kind = of_discs([0.0, 1.5, 2.0], [0.0, 0.2, -0.4], [0.5, 0.6, 0.4])
    write_clumps(tmp_path / "one.clumps", bodies([kind], np.array([(1.0, 5.0)]), np.array([0.3])))
    clumps.clump(sim, tmp_path / "one.clumps")
    properties.prop(sim, density=2.0, kn=1e5, fric=0.3)
    properties.prop(sim, only(0), xv=v[0], yv=v[1], spin=w)
    cycles.prepare(sim)

    def kept() -> list[float]:
        c = {name: float(values[0]) for name, values in diagnostics.clumps(sim).items()}
        turning = c["mass"] * (c["x"] * c["vy"] - c["y"] * c["vx"]) + c["inertia"] * c["spin"]
        return [c["mass"] * c["vx"], c["mass"] * c["vy"], turning, diagnostics.kinetic_energy(sim)]

    before = kept()
    steps(sim, n)
    assert kept() == pytest.approx(before, rel=1e-10)
    c, t = diagnostics.clumps(sim), n * dt
    assert (c["x"][0], c["y"][0]) == pytest.approx((1.0 + v[0] * t, 5.0 + v[1] * t), abs=1e-9)
    assert c["angle"][0] == pytest.approx(0.3 + w * t, rel=1e-10)
    p = sim.particles
    order = np.argsort(p["gid"])
    x, y = p["x"][order], p["y"][order]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        apart = math.hypot(*(kind[2][i, :2] - kind[2][j, :2]))
        assert math.hypot(x[i] - x[j], y[i] - y[j]) == pytest.approx(apart, abs=5e-14)
    # The members' velocities are those of the body half a step ago: v + w z x r.
    half = c["angle"][0] - 0.5 * w * dt
    cos, sin = math.cos(half), math.sin(half)
    turned = kind[2][:, :2] @ np.array([[cos, sin], [-sin, cos]])
    assert p["vx"][order] == pytest.approx(v[0] - w * turned[:, 1], abs=1e-12)
    assert p["vy"][order] == pytest.approx(v[1] + w * turned[:, 0], abs=1e-12)
    assert (p["spin"] == w).all() and (p["angle"] == c["angle"][0]).all()
    assert exact_sum(sim.body[:, 0], sim.comm) == pytest.approx(2.0 * kind[0], rel=1e-15)


def drops(folder, as_clumps: bool):
    """Three discs of radius 1/2 fall on an inclined, rough floor and on each other."""
    sim = model(folder / ("clumps" if as_clumps else "discs"), dt=1e-3, gravity=(0.3, -9.8), lsm=0.01)
    walls.wall(sim, 0, ((-5.0, -1.0), (10.0, 0.5)), kn=1e4, ks=1e4, fric=0.4)
    places = np.array([(0.0, 1.0), (0.3, 2.3), (1.4, 1.5)])
    if as_clumps:
        area = math.pi * 0.5 * 0.5
        kind = area, area / 8.0, np.array([(0.0, 0.0, 0.5)])
        write_clumps(folder / "discs.clumps", bodies([kind], places, np.zeros(3)))
        clumps.clump(sim, folder / "discs.clumps")
    else:
        for k, (x, y) in enumerate(places):
            particles.ball(sim, k, x, y, 0.5)
    properties.prop(sim, density=1.7, kn=1e4, ks=8e3, fric=0.3, damp=0.1)
    properties.fix(sim, ("x",), only(1))
    cycles.prepare(sim)
    return sim


def test_a_clump_of_one_disc_is_that_disc(tmp_path):
    """Bit for bit: it is moved by the same loop. (Radius 1/2, so that area / 8 is the disc's inertia without
    rounding.)"""
    a, b = drops(tmp_path, False), drops(tmp_path, True)
    touching = []
    for _ in range(10):
        steps(a, 100)
        steps(b, 100)
        for name in ("gid", "x", "y", "vx", "vy", "spin", "angle"):
            assert (a.particles[name] == b.particles[name]).all(), name
        assert (a.lists.owned_forces() == b.lists.owned_forces()).all()
        assert diagnostics.kinetic_energy(a) == diagnostics.kinetic_energy(b)
        seen = diagnostics.survey(a), diagnostics.survey(b)
        assert seen[0] == seen[1]
        assert diagnostics.lightest(a) == diagnostics.lightest(b)
        assert diagnostics.highest_frequency(a) == pytest.approx(diagnostics.highest_frequency(b), rel=1e-12)
        touching.append(len(diagnostics.contact_rows(a)[0]) + len(diagnostics.wall_rows(a)[0]))
    assert max(touching) >= 2


def test_velocities_that_are_set_are_those_of_the_centre(tmp_path):
    sim = model(tmp_path / "data", dt=1e-3)
    clump = Clumps(*(np.array([v]) for v in (2.0, 1.0, 0.5, 3.0, 4.0)), np.array([0, 2]), *np.array(
        [(-1.0, 1.0), (0.0, 0.0), (0.6, 0.6)]
    ))  # fmt: skip
    write_clumps(tmp_path / "one.clumps", clump)
    clumps.clump(sim, tmp_path / "one.clumps")
    properties.prop(sim, density=1.0, kn=1.0)
    for closed in (False, True):
        if closed:
            cycles.prepare(sim)
            steps(sim, 3)
        properties.prop(sim, only(1), xv=0.2, spin=3.0)
        c, p = diagnostics.clumps(sim) if closed else None, sim.particles
        angle = c["angle"][0] if closed else 0.5
        by_gid = np.argsort(p["gid"])
        assert p["vx"][by_gid] == pytest.approx([0.2 + 3.0 * math.sin(angle), 0.2 - 3.0 * math.sin(angle)], abs=1e-14)
        assert p["vy"][by_gid] == pytest.approx([-3.0 * math.cos(angle), 3.0 * math.cos(angle)], abs=1e-14)
        assert (p["spin"] == 3.0).all()
    assert c["vx"][0] == 0.2 and c["spin"][0] == 3.0 and c["vy"][0] == 0.0

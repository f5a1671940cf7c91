"""A1-A3: published settled bed of ZDEM (10 713 spheres, 40 x 4 km), and our own settling of the same script.

The bed is data of the ZDEM manual; it is read where it lies and not part of this project. Exact statements:

- At rest the vertical contact force through a horizontal cut is the weight above it. For a pair cut by y = h this is
the y
  component of the force that the lower particle exerts on the upper one; walls that cross the cut are frictionless.
- Floor and BOX bottom together carry the whole weight.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.dem import cycles, particles, properties, settings, walls
from hpcdem.core.selection import Interval
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.simulation import Simulation

G = 9.8


def deck(sim: Simulation) -> None:
    """Walls, material and settings of the manual's detachment and push scripts before any bond is made."""
    settings.set_option(sim, "disk", "off")
    walls.box(sim, 0.0, 41000.0, 0.0, 11000.0)
    walls.wall(sim, 0, ((0.0, 10.0), (40000.0, 10.0)))
    walls.wall(sim, 1, ((10.0, 10000.0), (10.0, 10.0)))
    walls.wall(sim, 2, ((40000.0, 10.0), (40000.0, 10000.0)))
    properties.prop(sim, density=2.5e3, fric=0.0, shear=2.9e9, poiss=0.2, damp=0.4, hertz=True)
    settings.set_option(sim, "dt", 5e-2)
    settings.set_option(sim, "gravity", (0.0, -G))


@pytest.fixture(scope="module")
def bed(manual_scripts: Path) -> Simulation:
    """The published bed as loaded, ready to step."""
    sim = Simulation()
    particles.load(sim, manual_scripts / "init_xyr.dat")
    deck(sim)
    cycles.prepare(sim)
    return sim


def floor_force(sim: Simulation) -> float:
    """Force on floor and BOX bottom over the total weight."""
    force = diagnostics.wall_forces(sim)
    carried = -(force[sim.walls.row(0), 1] + force[sim.walls.row(100), 1])
    return carried / (sim.body[:, 0].sum() * G)


def test_cuts_carry_the_weight_above(bed: Simulation) -> None:
    """A2: at all 16 depths within 0.5 %; coordination 4.92 and K0 = 0.98 of the published state."""
    out, iout = diagnostics.contact_rows(bed)
    p = bed.particles
    row = np.argsort(p["gid"])
    y, weight = p["y"], bed.body[:, 0] * G
    first, second = row[iout[:, 0]], row[iout[:, 1]]
    fy_first = out[:, diagnostics.FORCE_Y]
    for depth in np.linspace(300.0, 3800.0, 16):
        first_above, second_above = y[first] > depth, y[second] > depth
        lifted = fy_first[first_above & ~second_above].sum() - fy_first[~first_above & second_above].sum()
        assert lifted / weight[y > depth].sum() == pytest.approx(1.0, abs=0.005), f"cut at {depth} m"
    assert 2.0 * len(out) / len(p) == pytest.approx(4.92, rel=0.005)

    # K0, horizontal over vertical stress: force through vertical cuts over the integral of the weight above. The
    # frictionless bed is close to hydrostatic; the published number has two digits and no recorded method.
    heights = np.linspace(10.0, 4110.0, 400)
    above = np.array([weight[y > h].sum() for h in heights])
    vertical = float(((above[1:] + above[:-1]) / 2.0 * np.diff(heights)).sum()) / 39950.0
    x, fx_first = p["x"], out[:, diagnostics.FORCE_X]
    pushed = []
    for at in np.linspace(3000.0, 37000.0, 16):
        left, right = x[first] < at, x[second] < at
        pushed.append(fx_first[~left & right].sum() - fx_first[left & ~right].sum())
    assert np.mean(pushed) / vertical == pytest.approx(0.98, abs=0.015)


def test_published_bed_stays_at_rest(bed: Simulation) -> None:
    """A1: the floor carries the weight as loaded, and after 1000 steps; mean height changes by less than 1 m."""
    assert floor_force(bed) == pytest.approx(1.0, abs=0.005)
    before = bed.particles["y"].mean()
    for _ in range(1000):
        bed.step()
    assert floor_force(bed) == pytest.approx(1.0, abs=0.005)
    assert abs(bed.particles["y"].mean() - before) < 1.0
    speed = np.hypot(bed.particles["vx"], bed.particles["vy"])
    assert np.sqrt((speed**2).mean()) < 0.01 * np.sqrt(2.0 * G * 60.0)


@pytest.mark.slow
def test_settling_reproduces_the_published_bed() -> None:
    """A3: settle, cut at 4 km, rest. Kept 10 700 +- 2 %, small : large 2.0 +- 0.1, cover 0.943 +- 0.005 inside, rebound
    of the top to about 4110 m (bands of the published file)."""
    sim = Simulation()
    deck(sim)
    particles.gen(sim, 100000, [60.0, 80.0], (10.0, 40000.0), (10.0, 10000.0))
    properties.prop(sim, density=2.5e3, fric=0.0, shear=2.9e9, poiss=0.2, damp=0.4, hertz=True)
    cycles.prepare(sim)
    for _ in range(5000):
        sim.step()
    particles.delete(sim, Interval("y", 4000.0, 999000.0))
    cycles.prepare(sim)
    for _ in range(1000):
        sim.step()
    p = sim.particles
    r, y = p["radius"], p["y"]
    assert len(p) == pytest.approx(10700, rel=0.02)
    assert (r == 60.0).sum() / (r == 80.0).sum() == pytest.approx(2.0, abs=0.1)
    assert cover(p["y"], r, 500.0, 3500.0, 39990.0) == pytest.approx(0.943, abs=0.005)
    assert (y + r).max() == pytest.approx(4110.0 + 80.0, abs=60.0)
    assert floor_force(sim) == pytest.approx(1.0, abs=0.005)


def cover(y: np.ndarray, r: np.ndarray, low: float, high: float, width: float) -> float:
    """Area of the discs between two heights, cut discs counted with the cut part, over the area of the band."""

    def below(h: float) -> np.ndarray:
        t = np.clip((h - y) / r, -1.0, 1.0)
        return r**2 * (np.arcsin(t) + t * np.sqrt(1.0 - t * t) + np.pi / 2.0)

    return float((below(high) - below(low)).sum() / (width * (high - low)))

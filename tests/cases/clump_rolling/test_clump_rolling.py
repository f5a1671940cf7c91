"""Clumps that roll down a plane: the acceleration shows the moment of inertia."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import clumps, cycles, properties, walls
from hpcdem.io.clumps import write_clumps
from hpcdem.physics.dem import diagnostics
from tests.cases.clump_rolling import exact
from tests.clumped import bodies
from tests.support import model, steps

R, DENSITY = 1.0, 2.0
AREA = math.pi * R**2


def rolls(folder, alpha: float, mu: float, discs: np.ndarray, area: float, moment: float, k: float, dt: float):
    """A body on a plane that falls to the right at alpha, at rest and in balance across the plane."""
    sim = model(folder / "data", dt=dt, gravity=(0.0, -exact.G))
    c, s = math.cos(alpha), math.sin(alpha)
    walls.wall(sim, 0, ((-20.0 * c, 20.0 * s), (60.0 * c, -60.0 * s)), kn=2.0 * k, ks=2.0 * k, fric=mu)
    outer = float(np.hypot(discs[:, 0], discs[:, 1]).max()) if len(discs) > 8 else 0.0
    high = outer + discs[0, 2] - exact.overlap(DENSITY * area, alpha, k)
    write_clumps(
        folder / "one.clumps", bodies([(area, moment, discs)], np.array([(high * s, high * c)]), np.array([0.0]))
    )
    clumps.clump(sim, folder / "one.clumps")
    properties.prop(sim, density=DENSITY, kn=2.0 * k, ks=2.0 * k, fric=1.0)
    cycles.prepare(sim)
    return sim


def motion(sim, alpha: float) -> tuple[float, float]:
    """Speed down the plane [m/s] and spin [rad/s]."""
    c = diagnostics.clumps(sim)
    return float(c["vx"][0] * math.cos(alpha) - c["vy"][0] * math.sin(alpha)), float(c["spin"][0])


@pytest.mark.parametrize("gyration2", [0.5, 1.0, 0.08], ids=["disc", "hoop", "heavy core"])
def test_round_outline_any_moment_of_inertia(tmp_path, gyration2):
    """One disc is the outline; two more inside it, anywhere, change nothing."""
    alpha, k, dt, n = 0.3, 4e6, 1e-4, 10_000
    discs = np.array([(0.0, 0.0, R), (0.4, 0.3, 0.2), (-0.5, 0.0, 0.3)])
    sim = rolls(tmp_path, alpha, 0.8, discs, AREA, gyration2 * R**2 * AREA, k, dt)
    arm = R - 0.5 * exact.overlap(DENSITY * AREA, alpha, k)
    expected = exact.rolling(alpha, gyration2, arm)
    steps(sim, n)
    speed, spin = motion(sim, alpha)
    swing = exact.swing(DENSITY * AREA, alpha, gyration2, arm, k)
    assert swing < 3e-3
    assert speed == pytest.approx(expected * n * dt, abs=swing)
    assert spin == pytest.approx(-speed / arm, abs=1.05 * swing)
    # Beside a disc's own 1/2 the difference is plain.
    if gyration2 != 0.5:
        assert abs(speed / (exact.rolling(alpha, 0.5, arm) * n * dt) - 1.0) > 0.2


def test_too_steep_it_slides(tmp_path):
    alpha, mu, gyration2, k, dt, n = 1.0, 0.3, 0.5, 4e6, 1e-4, 5_000
    sim = rolls(tmp_path, alpha, mu, np.array([(0.0, 0.0, R), (0.4, 0.3, 0.2)]), AREA, gyration2 * AREA, k, dt)
    arm = R - 0.5 * exact.overlap(DENSITY * AREA, alpha, k)
    steps(sim, n)
    down, turning = exact.sliding(alpha, mu, gyration2, arm)
    speed, spin = motion(sim, alpha)
    assert speed == pytest.approx(down * n * dt, rel=1e-3)
    assert spin == pytest.approx(-turning * n * dt, rel=1e-3)


def test_a_ring_of_discs_rolls_like_a_hoop(tmp_path):
    """A regular polygon of 120 discs; a contact soft enough to rest on several of them at once, so that it does not
    jump from disc to disc. Inertia is that of the discs."""
    n_discs, r = 120, 0.1
    turn = 2.0 * math.pi * np.arange(n_discs) / n_discs
    ring = R - r
    discs = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), np.full(n_discs, r)])
    area = n_discs * math.pi * r**2
    gyration2 = ring**2 + 0.5 * r**2
    alpha, k, dt, n = 0.1, 2e4, 2e-4, 10_000
    sim = rolls(tmp_path, alpha, 0.8, discs, area, gyration2 * area, k, dt)
    steps(sim, n)
    speed, spin = motion(sim, alpha)
    assert speed == pytest.approx(exact.rolling(alpha, gyration2, R) * n * dt, rel=0.01)
    assert spin == pytest.approx(-speed / R, rel=0.01)

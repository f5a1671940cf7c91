"""Deposits with a source prograde as in `exact.py`: heights of columns, and discs under SURFACE."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import checkpoints, cycles, surface
from hpcdem.numerics import landscape
from hpcdem.physics.dem.land import carried_over
from hpcdem.physics.dem.simulation import Simulation
from tests.cases.delta import exact
from tests.support import model
from tests.surface.support import SAND, assert_adds_up, basin, heights

LEVEL, SPEED, K = 6.0, 2.0, 30.0
BED, WIDTH, EVERY = 6.0, 100.0, 20


def test_the_closed_form_is_one() -> None:
    """It solves the equation, its area is that of its heights, and both have the limits of a mouth at rest and of a
    front of constant form."""
    s, t, step = np.linspace(0.0, 150.0, 6001), 3.0, 1e-3
    h = exact.front(s, t, LEVEL, SPEED, K)
    rate = (exact.front(s, t + step, LEVEL, SPEED, K) - exact.front(s, t - step, LEVEL, SPEED, K)) / (2.0 * step)
    ds = s[1] - s[0]
    slope, curvature = np.gradient(h, ds), np.gradient(np.gradient(h, ds), ds)
    assert np.abs(rate - SPEED * slope - K * curvature)[2:-2].max() < 1e-4 * np.abs(rate).max()
    assert h[0] == pytest.approx(LEVEL, rel=1e-14)
    assert exact.front_area(t, LEVEL, SPEED, K) == pytest.approx(float((h[1:] + h[:-1]).sum()) * 0.5 * ds, rel=1e-6)
    assert exact.front_area(1e-6, LEVEL, SPEED, K) == pytest.approx(
        2.0 * LEVEL * math.sqrt(K * 1e-6 / math.pi), rel=1e-3
    )
    assert exact.front_area(1e3, LEVEL, SPEED, K) == pytest.approx(LEVEL * K / SPEED, rel=1e-9)
    assert exact.front(s, 1e3, LEVEL, SPEED, K) == pytest.approx(LEVEL * np.exp(-SPEED * s / K), rel=1e-9)


@pytest.mark.parametrize("irregular", [False, True])
def test_columns_prograde_as_a_delta(irregular: bool) -> None:
    """Levels behind the mouth, then diffusion, as SURFACE applies them: the level falls while the front diffuses, by an
    error of order 1/2 in the interval, which extrapolation removes. What was brought is the area of the deposit."""
    sides = np.linspace(-10.0, 290.0, 601)
    if irregular:
        sides[1:-1] += np.random.default_rng(2).uniform(-0.1, 0.1, len(sides) - 2)
    width, middle, time = np.diff(sides), 0.5 * (sides[:-1] + sides[1:]), 12.0
    front = exact.front(middle - SPEED * time, time, LEVEL, SPEED, K)
    area = LEVEL * (10.0 + SPEED * time) + exact.front_area(time, LEVEL, SPEED, K)
    found, brought = [], []
    for parts in (120, 480, 1920):
        h, total = np.zeros(len(width)), 0.0
        for k in range(parts):
            behind = np.clip((SPEED * (k + 0.5) * time / parts - sides[:-1]) / width, 0.0, 1.0)
            gain = landscape.raised(h, math.inf, LEVEL) * behind
            h, total = h + gain, total + float(gain @ width)
            h = landscape.moved(h, width, landscape.diffused(h, width, K * time / parts))
        assert total == pytest.approx(h @ width, rel=1e-12)
        found.append(h)
        brought.append(total)
    found.append(2.0 * found[2] - found[1])
    errors = [math.sqrt(float(np.mean((h - front) ** 2))) / LEVEL for h in found]
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.1) and errors[1] / errors[2] == pytest.approx(2.0, abs=0.1)
    assert errors[3] < 0.002
    assert 2.0 * brought[2] - brought[1] == pytest.approx(area, rel=1e-3)


@pytest.mark.parametrize("slope", [0.2, 0.6])
def test_columns_prograde_as_a_fan(slope: float) -> None:
    """A source in the first column, and a limit of the slope: the triangle, to the area of a column."""
    width, rate = np.full(400, 0.25), 3.0
    h = np.zeros(len(width))
    for k in range(1, 61):
        h[0] += rate * 0.5 / width[0]
        h = landscape.moved(h, width, landscape.avalanches(h, width, slope))
        if k % 20 == 0:
            toe = exact.toe(rate, 0.5 * k, slope)
            triangle = np.maximum(slope * (toe - width * (np.arange(len(width)) + 0.5)), 0.0)
            assert np.abs(h - triangle).max() < slope * width[0]
            assert h @ width == pytest.approx(rate * 0.5 * k, rel=1e-12)


def follow(sim: Simulation, steps: int, begun: float) -> None:
    """Let the river of process 1 follow its mouth, which is at the left wall at the time `begun`; 2 is the front."""
    for _ in range(steps // EVERY):
        mouth = SPEED * (sim.clock.time - begun + 0.5 * EVERY * sim.clock.dt)
        surface.surface(sim, 1, EVERY, x=(0.0, max(mouth, 4.0)), below=BED + LEVEL, group="delta", **SAND)
        cycles.cycle(sim, EVERY)


def test_discs_prograde_as_a_delta(tmp_path) -> None:
    """The mouth moves 20 m over a bed of discs. Heights are those of columns with the same intervals and of the closed
    form within 0.4 m (rms; a fifth of a disc); the area that the river brings is that of the closed form within 10 %:
    intervals make 4 % of it, and the porosity of 0.18 instead of 0.15 as much. A checkpoint on half the way changes no
    bit."""
    sim = basin(tmp_path, WIDTH)
    surface.surface(sim, 3, 100, below=BED, x=(0.0, WIDTH), group="bed", **SAND)
    cycles.cycle(sim, 1000)
    surface.surface(sim, 3, off=True)
    surface.surface(sim, 2, EVERY, diffuse=K, x=(0.0, WIDTH), group="front", **SAND)
    sides, h, _ = heights(sim, 2, WIDTH)
    begun, width = sim.clock.time, np.diff(sides)
    follow(sim, 2500, begun)
    checkpoints.save(sim, tmp_path / "half.sav")
    follow(sim, 2500, begun)
    for ident in (1, 2):
        assert_adds_up(sim, ident)
    assert surface.balance(sim, 1)["lost"] == surface.balance(sim, 2)["lost"] == 0.0
    _, now, _ = heights(sim, 2, WIDTH)
    for land in (sim.lands[1], sim.lands[2]):  # with what whole discs have not met yet
        now += carried_over(land.owed, 0, len(now)) * land.unit / width
    time = sim.clock.time - begun
    front = BED + exact.front(0.5 * (sides[:-1] + sides[1:]) - SPEED * time, time, LEVEL, SPEED, K)
    for k in range(5000 // EVERY):
        behind = np.clip((max(SPEED * (k + 0.5) * EVERY * sim.clock.dt, 4.0) - sides[:-1]) / width, 0.0, 1.0)
        h = h + landscape.raised(h, math.inf, BED + LEVEL) * behind
        h = landscape.moved(h, width, landscape.diffused(h, width, K * EVERY * sim.clock.dt))
    for expected in (h, front):
        assert math.sqrt(float(np.mean((now - expected) ** 2))) < 0.4
    area = LEVEL * SPEED * time + exact.front_area(time, LEVEL, SPEED, K)
    assert surface.balance(sim, 1)["demanded"] == pytest.approx(area, rel=0.1)
    again = model(tmp_path)
    checkpoints.restore(again, tmp_path / "half.sav")
    follow(again, 2500, begun)
    assert again.lands == sim.lands
    for name in ("gid", "x", "y", "vx", "spin"):
        assert np.array_equal(again.particles[name], sim.particles[name])

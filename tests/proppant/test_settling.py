"""The speed of a grain, and grains that settle in a closed slot."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.proppant import settling
from tests.flow.support import over
from tests.proppant.support import OIL, nodes_up, profile, slot


@pytest.mark.parametrize("reynolds", [0.01, 0.1, 1.0, 10.0, 77.0, 300.0, 999.0])
def test_the_speed_is_that_of_the_correlation(reynolds: float) -> None:
    """The other way round: a Reynolds number gives the drag, that the diameter by Archimedes' number."""
    density, fluid, viscosity, g = 2550.0, 1000.0, 1e-3, 9.81
    drag = 24.0 / reynolds * (1.0 + 0.15 * reynolds**0.687)
    archimedes = 0.75 * drag * reynolds**2
    size = (archimedes * viscosity**2 / (fluid * (density - fluid) * g)) ** (1.0 / 3.0)
    v = settling.terminal(size, density, fluid, viscosity, g)
    assert settling.reynolds(v, size, fluid, viscosity) == pytest.approx(reynolds, rel=1e-9)


def test_coarse_grains_settle_after_newton() -> None:
    """Drag 0.44 beyond a Reynolds number of 1000."""
    v = settling.terminal(0.01, 2650.0, 1000.0, 1e-3, 9.81)
    assert v == pytest.approx(math.sqrt(4.0 / 3.0 * 1.65 * 9.81 * 0.01 / 0.44), rel=1e-9)


def test_small_grains_settle_after_stokes_and_light_ones_rise() -> None:
    assert settling.terminal(1e-6, 2650.0, 1000.0, 1e-3, 9.81) == pytest.approx(
        settling.stokes(1e-6, 2650.0, 1000.0, 1e-3, 9.81), rel=1e-3
    )
    up = settling.terminal(4e-4, 900.0, 1000.0, 1e-3, 9.81)
    assert up < 0.0 and abs(up) < abs(settling.stokes(4e-4, 900.0, 1000.0, 1e-3, 9.81))
    assert settling.terminal(4e-4, 1000.0, 1000.0, 1e-3, 9.81) == 0.0


def test_sand_of_fracturing_is_far_from_stokes() -> None:
    """0.45 mm, 2550 kg/m3, in water: Stokes' law says 0.17 m/s, at a Reynolds number of 77."""
    slow = settling.stokes(4.5e-4, 2550.0, 1000.0, 1e-3, 9.81)
    assert slow == pytest.approx(0.171, rel=2e-3)
    assert settling.reynolds(slow, 4.5e-4, 1000.0, 1e-3) == pytest.approx(77.0, rel=2e-3)
    rest = 1.55 * 9.81 * 4.5e-4**2
    smooth, natural = (rest / (18e-6 + math.sqrt(0.75 * drag * rest * 4.5e-4)) for drag in (0.4, 1.0))
    assert natural < settling.terminal(4.5e-4, 2550.0, 1000.0, 1e-3, 9.81) < smooth  # Ferguson & Church 2004


@pytest.mark.parametrize("c", [0.2, 0.1])
def test_a_closed_slot_clears_from_above(c: float) -> None:
    """9.15: below the clear fluid nothing has changed yet (Kynch 1952), its lower end sinks by v (1 - c)^5.65; sand
    is neither made nor lost."""
    sim, flow, proppant = slot(100, 1.0, proppant_stokes=1.0)
    proppant.fill(None, c)
    assert proppant.speed() == pytest.approx(2.248e-3, rel=5e-4)
    y = sim.mesh.points[nodes_up(sim), 1]
    front = []
    for _ in range(4):
        over(sim, 80.0, 20)
        now = profile(sim, flow)
        assert now[np.abs(y - 0.3) < 0.05] == pytest.approx(c, rel=0.05)
        front.append(float(np.interp(-0.5 * c, -now[40:], y[40:])))
    speed = -np.diff(front) / 80.0
    assert speed == pytest.approx(proppant.speed() * (1.0 - c) ** 5.65, rel=0.05)
    found = proppant.account()
    assert found["relative"] < 1e-12 and found["stored"] == pytest.approx(c * 5e-3, rel=1e-12)


def test_a_pack_is_as_high_as_its_sand() -> None:
    """9.15: at the end all lies at the bottom, at the concentration of a pack and not beyond."""
    sim, flow, proppant = slot(50, 1.0)
    proppant.fill(None, 0.2)
    over(sim, 6e4, 300)
    now = profile(sim, flow)
    assert now.max() <= 0.6 + 1e-9
    packed = now >= 0.6 - 1e-6
    y = sim.mesh.points[nodes_up(sim), 1]
    assert y[packed].max() + 0.01 == pytest.approx(1.0 / 3.0, abs=0.02)
    assert now[~packed].sum() < 0.6
    assert proppant.account()["stored"] == pytest.approx(1e-3, rel=1e-12)
    assert proppant.account()["packed"] == pytest.approx(1e-3, rel=0.03)


@pytest.mark.parametrize(
    ("fluid", "changes", "factor"),
    [
        ({}, {}, 1.0), ({}, {"proppant_density": 1825.0}, 0.5), ({}, {"proppant_size": 2.5e-4}, 0.25),
        ({"viscosity": 2e-4}, {}, 0.5), ({"fluid_density": 1825.0}, {}, 0.274),
        ({}, {"proppant_density": 350.0}, -0.394),
    ],
)  # fmt: skip
def test_each_property_of_settling_acts(fluid: dict[str, float], changes: dict[str, float], factor: float) -> None:
    """Sand that has gone down through the middle."""
    sim, flow, proppant = slot(20, 1.0, {**OIL, **fluid}, proppant_stokes=1.0, **changes)
    proppant.fill(nodes_up(sim)[8:13], 0.01)
    y = sim.mesh.points[nodes_up(sim), 1]

    def middle() -> float:
        n = profile(sim, flow, "proppant")
        return float((n * y).sum() / n.sum())

    before = middle()
    over(sim, 40.0, 10)
    hindered = 2.248e-3 * 40.0 * 0.99**5.65
    assert middle() - before == pytest.approx(-factor * hindered, rel=0.03)


def test_sand_stays_where_it_is_without_gravity_and_while_it_is_switched_off() -> None:
    sim, flow, proppant = slot(20, 1.0)
    proppant.fill(nodes_up(sim)[8:13], 0.1)
    before = profile(sim, flow)
    sim.parts(proppant=False)
    over(sim, 40.0, 4)
    assert profile(sim, flow) == pytest.approx(before, abs=1e-5)  # fluid sinks in itself
    sim.parts(proppant=True)
    sim.gravity(0.0, 0.0)
    over(sim, 40.0, 4)
    assert profile(sim, flow) == pytest.approx(before, abs=1e-5)
    sim.gravity(0.0, -9.81)
    over(sim, 40.0, 4)
    assert not profile(sim, flow) == pytest.approx(before, rel=0.1)

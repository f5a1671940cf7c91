"""Fast flow between plates: friction of Blasius beyond the Reynolds number of its meeting with the cubic law."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.fdem.groups import CHANNEL
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.pre.mesh import structured_space
from tests.flow import space
from tests.flow.support import at, hold, line


def speed(gradient: float, aperture: float, nu: float = 1e-6, rho: float = 1000.0) -> float:
    """Mean speed [m/s] by the friction of Darcy and Weisbach, f = 96 / Re or 0.3164 Re^-1/4, hydraulic diameter twice
    the aperture [m]; found by halving, as f is given by Re."""
    low, high = 0.0, 1e4
    for _ in range(200):
        v = 0.5 * (low + high)
        re = 2.0 * v * aperture / nu
        f = max(96.0 / re, 0.3164 * re**-0.25)
        low, high = (v, high) if f * rho * v * v / (4.0 * aperture) < gradient else (low, v)
    return low


@pytest.mark.some_of_each
@pytest.mark.parametrize("gradient", [1.0, 90.0, 2e2, 5e4])
@pytest.mark.parametrize("implicit", [True, False])
def test_a_fracture_flows_as_darcy_and_weisbach_say(gradient: float, implicit: bool) -> None:
    """5 mm of water: the laminar law would hold up to 98 Pa/m."""
    sim, flow = line(4, 1.0, aperature_initial=5e-3, fluid_bulk=1e6, turbulence=1.0)
    hold(flow, at(sim, 0.0, 0.0), 1e3 + gradient)
    hold(flow, at(sim, 1.0, 0.0), 1e3)
    flow.fill(None, pressure=1e3)
    if implicit:
        with Coupled(sim, 1.0) as run:
            run.steady()
        assert run.count.iterations < 25
    else:
        x = sim.mesh.points[flow.network.nodes, 0]
        for node, place in zip(flow.network.nodes, x):
            flow.fill(np.array([node]), pressure=1e3 + gradient * (1.0 - place))
        for _ in range(20):
            sim.step()
    found = np.abs(flow.values(CHANNEL, "velocity"))
    assert found == pytest.approx(speed(gradient, 5e-3), rel=1e-6)
    assert (found < gradient * 5e-3**2 / 12e-3 * 0.999).all() == (gradient > 98.0)


@pytest.mark.parametrize("turn", [0.0, 30.0])
def test_triangles_have_the_gradient_of_their_plane(turn: float) -> None:
    """A plane of triangles in which the pressure falls any way."""
    mesh = structured_space.box((np.linspace(0.0, 1.0, 4), np.array([-0.5, 0.0, 0.5]), np.linspace(0.0, 1.0, 4)))
    sim, flow = space.standing(mesh, space.on_plane(mesh, 1, 0.0), aperature_initial=5e-3, fluid_bulk=1e6,
                               turbulence=1.0)  # fmt: skip
    way = np.array([math.cos(math.radians(turn)), 0.0, math.sin(math.radians(turn))])
    flow.fill(None, pressure=1e3)
    points = flow.network.nodes
    where = sim.mesh.points[points]
    rim = ((where[:, [0, 2]] < 1e-9) | (where[:, [0, 2]] > 1.0 - 1e-9)).any(axis=1)
    for node, place in zip(points[rim], where[rim]):
        hold(flow, np.array([node]), 1e4 - 1e3 * float(place @ way))
    with Coupled(sim, 1.0) as run:
        run.steady()
    assert flow.values(CHANNEL, "velocity") == pytest.approx(speed(1e3, 5e-3), rel=1e-6)


def test_it_begins_at_reynolds_2040() -> None:
    assert pytest.approx(2040.0, abs=2.0) == kernels.TURBULENT

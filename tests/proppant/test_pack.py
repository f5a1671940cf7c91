"""Packs that hold a fracture open."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.proppant.model import Proppant
from tests.flow.support import at, run
from tests.flow.test_coupling import split
from tests.proppant.support import SAND

FINE = {**SAND, "proppant_size": 1e-5}
STIFF = 50e9 * 0.75 / (1.25 * 0.5)
"""Of rock between rollers [Pa]."""


def closed(closure: float, c: float = 0.6, **changed: float) -> tuple[Blocks, Flow, Proppant]:
    """A broken joint of 0.1 mm, full of sand and of a fluid that gives way, that is closed by its upper wall [m]."""
    sim, flow = split(fluid_bulk=1e3)
    joints = flow.network.channels
    changes.crack(sim, joints)
    sim.flow_clock(dt=1e-7)
    flow.fill(None, saturation=1.0)
    proppant = Proppant.of(sim)
    proppant.assign(joints, {**FINE, **changed})
    proppant.fill(None, c)
    run(sim, 1)
    steps = 400
    sim.velocity_condition(at(sim, y=0.5), vy=-closure / (steps * sim.clock.dt))
    run(sim, steps)
    sim.velocity_condition(at(sim, y=0.5), vy=0.0)
    return sim, flow, proppant


@pytest.mark.parametrize(("modulus", "limit"), [(1e7, 0.6), (4e7, 0.6), (1e7, 0.5)])
def test_a_pack_carries_its_walls(modulus: float, limit: float) -> None:
    """(137): modulus times the strain of the pack; the rest of what closes is taken by the rock."""
    sim, flow, proppant = closed(6e-5, limit, proppant_modulus=modulus, proppant_concentration_limit=limit)
    convergence.solve(sim, ratio=1e-6)
    delta = flow.values("flow-channel", "aperture")
    p = modulus * (1.0 - delta / 1e-4)
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(-p.mean(), rel=1e-3)
    assert 6e-5 - p.mean() / STIFF * 0.5 == pytest.approx(1e-4 - delta.mean(), rel=5e-3)
    assert flow.values("flow-channel", "pack_pressure") == pytest.approx(p, rel=1e-6) and p.min() > 1e6
    assert proppant.account()["relative"] < 1e-12


def test_sand_that_is_no_pack_yet_bears_nothing() -> None:
    """Half as much as makes a pack: until the fracture is closed to a half; and without a modulus never."""
    sim, flow, _ = closed(4e-5, 0.3, proppant_modulus=1e7)
    run(sim, 2000)
    assert np.abs(diagnostics.values(sim, "stress_yy")).max() < 3e3
    assert flow.values("flow-channel", "concentration") == pytest.approx(0.5, rel=0.02)
    sim, flow, _ = closed(7e-5, 0.3, proppant_modulus=1e7)
    convergence.solve(sim, ratio=1e-6)
    p = 1e7 * (1.0 - flow.values("flow-channel", "aperture") / 5e-5)
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(-p.mean(), rel=0.01) and p.min() > 1e6
    sim, flow, _ = closed(6e-5, 0.6)
    run(sim, 2000)
    assert np.abs(diagnostics.values(sim, "stress_yy")).max() < 3e3


def test_fluid_that_does_not_push_leaves_the_pack_where_it_is() -> None:
    """One way, or without proppant: nothing of either pushes."""
    for switch in ({"one_way": True}, {"hydraulic": False}):
        sim, flow, proppant = closed(0.0, 0.6, proppant_modulus=1e7, proppant_concentration_limit=0.6)
        proppant.adjust({"proppant_concentration_limit": 0.5})
        sim.parts(**switch)
        run(sim, 50)
        assert np.abs(diagnostics.values(sim, "stress_yy")).max() == 0.0, switch


def test_what_a_pack_does_is_work_from_outside() -> None:
    """A pack that becomes too thick for its room throws its walls apart; the budget of energy closes."""
    sim, flow = split(dynamic=True, fluid_bulk=1e3)
    changes.crack(sim, flow.network.channels)
    flow.fill(None, saturation=1.0)
    proppant = Proppant.of(sim)
    proppant.assign(flow.network.channels, {**FINE, "proppant_modulus": 1e7})
    proppant.fill(None, 0.6)
    diagnostics.account_energy(sim)
    run(sim, 10)
    assert diagnostics.energies(sim)["kinetic"] < 1e-6
    proppant.adjust({"proppant_concentration_limit": 0.5})
    run(sim, 500)
    energies = diagnostics.energies(sim)
    assert energies["kinetic"] > 0.1 and energies["work_outside"] > 0.1 and energies["relative"] < 0.02


def test_implicit_steps_and_the_static_solve_refuse_a_pack_that_bears() -> None:
    sim, flow, proppant = closed(0.0, proppant_modulus=1e7)
    sim.option(large_strain=False)
    with pytest.raises(CommandError, match="no pack of proppant that bears: proppant-modulus 0"), Coupled(sim, 1.0):
        pass
    with pytest.raises(CommandError, match="the static solve knows no proppant"):
        equilibrium.solve_elastic(sim)
    proppant.adjust({"proppant_modulus": 0.0})
    equilibrium.solve_elastic(sim)
    with Coupled(sim, 1.0) as steps:
        steps.advance(1.0)

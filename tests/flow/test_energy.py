"""Where the energy goes that is pumped into joints: closed forms, while joints break, in motion."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import account, kernels
from hpcdem.physics.flow.account import ENTRIES
from hpcdem.physics.flow.model import Flow
from tests.blocks.support import JOINT
from tests.flow.support import at, line, over
from tests.flow.test_implicit import LENGTH, plate
from tests.flow.test_space import _pushed


def pumped(steps: int = 4) -> tuple[Blocks, Flow]:
    """Two blocks of tetrahedra and the fluid that was pumped in between, everywhere alike."""
    sim, flow = _pushed(aperature_initial=1e-4)
    area = np.zeros(len(flow.network.there))
    np.add.at(area, flow.network.corners, (sim.mesh.face_sizes(flow.network.channels) / 3.0)[:, None])
    for node in flow.numbers("flow-node"):
        flow.prescribe(np.array([node]), kernels.RATE, 1e-5 * float(area[node]))
    over(sim, 4.0, steps)
    return sim, flow


def test_fluid_between_two_blocks_in_space() -> None:
    """Stress s in the blocks, pressure p, both alike everywhere: s o/2 and (a + o) p^2/(2 K) per area are stored, and
    T (o^2/o_p - o^3/(3 o_p^2)) in joints, with 2 T (o/o_p - o^2/(2 o_p^2)) before their peak. Nothing is lost."""
    sim, flow = pumped()
    found = flow.energies()
    p, o = flow.values("flow-node", "pressure").mean(), flow.values("flow-channel", "aperture").mean() - 1e-4
    s = -diagnostics.values(sim, "stress_zz").mean()
    assert found["strain"] == pytest.approx(0.06 * 0.5 * s * o, rel=1e-6)
    assert found["fluid"] == pytest.approx(0.06 * (1e-4 + o) * p**2 / (2.0 * 2.2e9), rel=1e-4)
    top = 2.0 * np.sqrt(0.005) * 2e9 / 1e10  # h the root of half a square of 0.1 m
    assert found["joints"] == pytest.approx(0.06 * 2e9 * (o**2 / top - o**3 / (3.0 * top**2)), rel=1e-4)
    assert max(abs(found[name]) for name in ("leaked", "viscous", "fracture", "outside")) < 1e-9 * found["pumped"]
    assert found["pushed"] == pytest.approx(found["strain"] + found["joints"], rel=2e-3)
    assert found["relative"] < 2e-3


@pytest.mark.slow
def test_a_joint_that_is_pumped_open() -> None:
    """In the plane: what joints took is G and what they store at their peak, per length; what does not add up is of
    second order in the mesh."""
    errors = []
    for cells in (20, 40):
        sim, flow = plate(cells)
        equilibrium.solve_elastic(sim)
        flow.prescribe(at(sim, 0.0, 0.0), kernels.RATE, 1e-5)
        over(sim, 20.0, 100)
        found = flow.energies()
        damage = diagnostics.values(sim, "damage", flow.numbers("flow-channel"))
        h = LENGTH / cells
        most = JOINT["gf1"] + 4.0 / 3.0 * h * 2e6**2 / JOINT["penalty_normal"]
        assert (damage == 1.0).sum() * h * JOINT["gf1"] <= found["fracture"] <= (damage > 0.0).sum() * h * most
        assert found["viscous"] > 0.1 * found["pumped"] and found["strain"] > 0.1 * found["pumped"]
        assert found["pushed"] == pytest.approx(found["strain"] + found["joints"] + found["fracture"], rel=0.01)
        errors.append(found["relative"])
    assert errors[0] < 0.02 and errors[1] < 0.004


@pytest.mark.parametrize("kind", [pytest.param("cross", marks=pytest.mark.slow), "mixed"])
def test_what_fluid_does_on_triangles(kind: str) -> None:
    """What was pumped in, and is neither lost by the flow nor stored in the fluid, was done on the blocks."""
    sim, flow = plate(12, kind=kind)
    equilibrium.solve_elastic(sim)
    flow.prescribe(at(sim, 0.0, 0.0), kernels.RATE, 1e-5)
    over(sim, 5.0, 10)
    found = flow.energies()
    assert found["pushed"] == pytest.approx(found["pumped"] - found["viscous"] - found["fluid"], rel=0.03)
    assert found["pushed"] == pytest.approx(found["strain"] + found["joints"] + found["fracture"], rel=0.06)


def test_flow_through_a_line_loses_what_comes_in() -> None:
    """Blocks stand still, steady: rate times the difference of pressures. Work of the conditions at both ends."""
    sim, flow = line(10, 1.0)
    flow.fill(None, saturation=1.0)
    flow.prescribe(at(sim, 0.0), kernels.PRESSURE, 3e6)
    flow.prescribe(at(sim, 1.0), kernels.PRESSURE, 1e6)
    over(sim, 1e3, 50)
    before = flow.energies()
    over(sim, 1e3, 50)
    found = {name: flow.energies()[name] - before[name] for name in ENTRIES}
    rate = abs(flow.values("flow-channel", "flow_rate")).mean()
    assert found["viscous"] == pytest.approx(1e3 * rate * 2e6, rel=1e-6)
    assert found["pumped"] == pytest.approx(found["viscous"], rel=1e-6)
    assert flow.energies()["strain"] == flow.energies()["fracture"] == 0.0


def test_a_checkpoint_keeps_it(tmp_path) -> None:
    sim, flow = pumped()
    expected = flow.energies()
    saved_state.save(sim, tmp_path / "a.sav")
    again = Blocks(SerialComm())
    saved_state.restore(again, tmp_path / "a.sav")
    assert Flow.of(again).energies() == expected


def test_where_grains_carry_load_is_refused() -> None:
    flow = pumped(1)[1]
    flow.energy = None
    with pytest.raises(CommandError, match="does not support packs of grains"):
        flow.energies()


def test_what_does_not_add_up_is_reported() -> None:
    """Pumped and outside come, all others but what is pushed are taken; relative to the largest."""
    entries = dict(zip(ENTRIES, (100.0, 1.0, 2.0, 4.0, 64.0, 8.0, 16.0, 32.0, -20.0)))
    found = account.closed(entries)
    assert found["closing"] == 100.0 - 20.0 - (1.0 + 2.0 + 4.0 + 8.0 + 16.0 + 32.0)
    assert found["relative"] == pytest.approx(17.0 / 100.0)

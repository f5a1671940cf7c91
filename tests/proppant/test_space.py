"""Proppant in triangular channels: settling in planes that stand or lean, fronts, packs, scripts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands import fdem
from hpcdem.commands.fdem import frames
from hpcdem.core.comm import SerialComm
from hpcdem.physics.fdem.groups import CHANNEL
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.proppant import kernels as own
from hpcdem.physics.proppant.assignments import CONCENTRATION, RATE
from hpcdem.physics.proppant.model import Proppant
from tests.flow.space import on_plane, points_at, standing
from tests.flow.support import over
from tests.pcdc.fake import Bench, Noted
from tests.proppant.support import OIL, SAND
from tests.space.support import box

SHAKEN = box((3, 3, 2), (3.0, 2.0, 1.0), 5, shaken=0.25)
WIDTH = 0.2


def plane(up: int, tilt: float = 0.0, fluid: dict[str, float] = OIL, **changes: float) -> tuple[Blocks, Flow, Proppant]:
    """A fracture 0.2 m wide and 1 m high, full of fluid, which may carry sand; gravity leans by tilt [degrees] from it.
    Its triangles are those of rectangles with a diagonal."""
    mesh = box((2, 4, up), (0.1, WIDTH, 1.0), 6)
    joints = on_plane(mesh, 0, 0.05)
    sim, flow = standing(mesh, joints, **fluid)
    sim.gravity(-9.81 * np.sin(np.radians(tilt)), 0.0, -9.81 * np.cos(np.radians(tilt)))
    flow.fill(None, pressure=1e5)
    proppant = Proppant.of(sim)
    proppant.assign(joints, {**SAND, **changes})
    return sim, flow, proppant


def rows(sim: Blocks, flow: Flow, name: str = "concentration") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Heights of the rows of nodes, the mean of a quantity there, its largest difference in each."""
    nodes = flow.network.nodes
    z, value = np.round(sim.mesh.points[nodes, 2], 9), flow.values("flow-node", name, nodes)
    heights = np.unique(z)
    found = [value[z == one] for one in heights]
    return heights, np.array([one.mean() for one in found]), np.array([np.ptp(one) for one in found])


def test_medians_pass_on_what_a_uniform_velocity_brings() -> None:
    """Kernels against the pieces of median themselves, in triangles of any shape: v . n l from the middle of a side to
    the centre; and a flow whose pressure is linear crosses them likewise."""
    sim, flow = standing(SHAKEN)
    sim.close_model()
    down, gradient = np.array([0.36, -0.48, -0.8]), np.array([3e5, 1e5, -2e5])
    found = np.zeros(len(flow.links[0]))
    own.falls(*flow.sides, sim.x, down, found)
    table, head = flow.channel_table, SHAKEN.points[flow.number] @ gradient
    ends = flow.links[0]
    q = table[:, kernels.CONDUCT] * (head[ends[:, 0]] - head[ends[:, 1]])
    q -= np.repeat(q.reshape(-1, 3).mean(axis=1), 3)
    assert table[:, kernels.CONDUCT].min() < 0.0
    for k, corners in enumerate(flow.network.corners):
        at = SHAKEN.points[corners]
        normal = np.cross(at[1] - at[0], at[2] - at[0])
        normal /= np.linalg.norm(normal)
        for m in range(3):
            first, last = at[(m + 1) % 3], at[(m + 2) % 3]
            piece = at.mean(axis=0) - 0.5 * (first + last)
            across = np.cross(piece, normal)
            across *= np.sign(across @ (last - first))
            assert found[3 * k + m] == pytest.approx(down @ across, abs=1e-12)
            assert q[3 * k + m] == pytest.approx(-(1e-5**3) / 12e-3 * gradient @ across, rel=1e-8, abs=1e-18)


@pytest.mark.parametrize(("tilt", "speed"), [(0.0, 6.372e-4), (45.0, 4.506e-4)])
def test_a_plane_clears_from_above(tilt: float, speed: float) -> None:
    """9.15 in a fracture that stands and in one that leans: the clear fluid sinks by v (1 - c)^5.65, of gravity what is
    in the plane; it does so evenly, and no sand is lost."""
    sim, flow, proppant = plane(40, tilt, proppant_stokes=1.0)
    proppant.fill(None, 0.2)
    front = []
    for _ in range(3):
        over(sim, 110.0, 28)
        z, c, _ = rows(sim, flow)
        front.append(float(np.interp(-0.1, -c[z > 0.4], z[z > 0.4])))
    y, heights = sim.mesh.points[flow.network.nodes, 1], sim.mesh.points[flow.network.nodes, 2]
    each = flow.values("flow-node", "concentration")
    for one in np.unique(np.round(y, 9)):
        along = np.abs(y - one) < 1e-9
        order = np.argsort(heights[along])
        z, c = heights[along][order], each[along][order]
        assert np.interp(-0.1, -c[z > 0.4], z[z > 0.4]) == pytest.approx(front[-1], abs=0.025)
    assert -np.diff(front) / 110.0 == pytest.approx(speed, rel=0.05)
    found = proppant.account()
    assert found["relative"] < 1e-12 and found["stored"] == pytest.approx(0.2 * 5e-3 * WIDTH, rel=1e-12)


def test_a_pack_is_as_high_as_its_sand() -> None:
    """9.15: a third of the height, at the limit and not beyond."""
    sim, flow, proppant = plane(25)
    proppant.fill(None, 0.2)
    over(sim, 2400.0, 240)
    z, c, spread = rows(sim, flow)
    assert flow.values("flow-node", "concentration").max() <= 0.6 + 1e-9
    assert c[z < 0.28] == pytest.approx(0.6, abs=1e-5) and c[z > 0.4].max() < 1e-3
    height = 0.5 * ((c[1:] + c[:-1]) * np.diff(z)).sum() / 0.6
    assert height == pytest.approx(1.0 / 3.0, rel=1e-3) and spread[z < 0.28].max() < 1e-5
    found = proppant.account()
    assert found["relative"] < 1e-12 and found["packed"] == pytest.approx(found["stored"], rel=0.08)


def flowing(**changes: float) -> tuple[Blocks, Flow, Proppant]:
    """A plane without gravity, through which fluid flows up by 2 mm/s."""
    sim, flow, proppant = plane(40, **changes)
    sim.gravity(0.0, 0.0, 0.0)
    low, top = points_at(sim.mesh, x=0.05, z=0.0), points_at(sim.mesh, x=0.05, z=1.0)
    y = sim.mesh.points[low, 1]
    ends = (y < 1e-9) | (y > WIDTH - 1e-9)
    for nodes, part in ((low[ends], 0.5), (low[~ends], 1.0)):
        flow.prescribe(nodes, kernels.RATE, part * 2e-3 * 5e-3 * WIDTH / 4.0)
    flow.prescribe(top, kernels.PRESSURE, 1e5)
    proppant.prescribe(low, CONCENTRATION, 0.01)
    return sim, flow, proppant


def test_a_front_goes_with_the_slurry() -> None:
    sim, flow, proppant = flowing()
    over(sim, 250.0, 25)
    z, c, spread = rows(sim, flow)
    assert np.interp(-0.005, -c, z) == pytest.approx(0.5, abs=0.03) and c.max() <= 0.01 + 1e-9
    assert spread.max() < 3e-3
    found = proppant.account()
    assert found["came"] == pytest.approx(0.01 * 2e-3 * 5e-3 * WIDTH * 250.0, rel=1e-9) and found["relative"] < 1e-12


def test_bridges_hold_it_and_rates_bring_it() -> None:
    """Grains larger than a third of the aperture do not pass; a volume rate is one of m3/s."""
    sim, flow, proppant = flowing(proppant_size=2e-3)
    over(sim, 250.0, 25)
    z, c, _ = rows(sim, flow)
    assert c[z > 0.01].max() == 0.0 and proppant.account()["stored"] > 0.0
    sim, flow, proppant = flowing()
    low = points_at(sim.mesh, x=0.05, z=0.0)
    proppant.prescribe(low, RATE, 1e-9)
    over(sim, 100.0, 10)
    assert proppant.account()["came"] == pytest.approx(len(low) * 1e-7, rel=1e-12)


@pytest.mark.parametrize("factor", [0.0, 0.2])
def test_a_pack_lets_fluid_through(factor: float) -> None:
    """By its permeability (Kozeny & Carman), or as a channel of a part of the aperture."""
    sim, flow, proppant = plane(20, aperature_factor=factor)
    sim.gravity(0.0, 0.0, 0.0)
    proppant.fill(None, 0.6)
    for z, pressure in ((0.0, 2e5), (1.0, 1e5)):
        flow.prescribe(points_at(sim.mesh, x=0.05, z=z), kernels.PRESSURE, pressure)
    over(sim, 100.0, 10)
    conduct = (factor * 5e-3) ** 3 / 12.0 if factor else own.kozeny_carman(0.6, 5e-4) * 5e-3
    inflow = flow.values("flow-node", "inflow", points_at(sim.mesh, x=0.05, z=0.0)).sum()
    assert inflow == pytest.approx(conduct / 0.1 * 1e5 * WIDTH, rel=1e-6)
    assert flow.values("flow-node", "concentration") == pytest.approx(0.6, rel=1e-9)


def test_a_slurry_weighs_more_and_is_more_viscous() -> None:
    """It stands still in a plane of triangles, at a pressure that rises by its weight; what flows in it has
    (1 - C / limit)^-2 of the viscosity."""
    sim, flow, proppant = plane(20, viscosity_power=-2.0, proppant_size=1e-6)
    proppant.fill(None, 0.2)
    over(sim, 2.0, 10)
    z, pressure, spread = rows(sim, flow, "pressure")
    assert pressure[0] - pressure[-1] == pytest.approx(1330.0 * 9.81, rel=2e-3) and spread.max() < 1.0
    inflows = []
    for c in (0.0, 0.2):
        sim, flow, proppant = plane(20, viscosity_power=-2.0)
        sim.gravity(0.0, 0.0, 0.0)
        proppant.fill(None, c)
        for z, one in ((0.0, 2e5), (1.0, 1e5)):
            low = points_at(sim.mesh, x=0.05, z=z)
            flow.prescribe(low, kernels.PRESSURE, one)
            proppant.prescribe(low, CONCENTRATION, c)
        over(sim, 1.0, 5)
        inflows.append(flow.values("flow-node", "inflow", points_at(sim.mesh, x=0.05, z=0.0)).sum())
    assert inflows[0] / inflows[1] == pytest.approx(2.25, rel=1e-4)


SCRIPT = """
pcdc model new dim 3
pcdc model gravity (0,0,-9.81)
pcdc mesh structured (0,0,0) (0.1,0.2,1) cells 2 2 10
pcdc element c-model mech-iso-e property density 2500 young 50e9 poisson-ratio 0.25
pcdc face-joint c-model hydr-p-p-m property f-den 1000 f-bulk 2.2e9 vis 1e-4 a-initial 5e-3 a-min 1e-3 \\
    p-den 2650 p-s 5e-4 p-c-l 0.6 range x 0.05 0.05
pcdc flow-node initial pressure 1e5
pcdc model option mechanical off
pcdc node group 'low' set 'end' range z 0 0 x 0.05 0.05
pcdc node boundary hydra-c-f-b flow-rate 1e-7 range group 'low' set 'end'
pcdc node boundary hydra-c-f-b pressure 1e5 range z 1 1 x 0.05 0.05
pcdc node boundary hydra-p-b p-v-c 0.1 range group 'low' set 'end'
pcdc flow-node initial concentration 0.05 range z 0.5 0.7
pcdc face-joint property proppant-size 4e-4
pcdc history create 'sand' model value proppant-stored
pcdc history create 'low' flow-node value proppant maximum range group 'low' set 'end'
pcdc model solve hydraulic time 40 dt 2
account = pcdc.proppant
"""


def test_a_script_says_it_too(tmp_path: Path) -> None:
    found = Bench(tmp_path, blocks=Blocks(SerialComm()))(SCRIPT)
    model, account = found.project, found["account"]
    assert account["relative"] < 1e-12 and account["came"] > 3 * 0.1 * 1e-7 * 40.0
    assert {name: history.unit for name, history in model.histories.items()} == {"sand": "m3", "low": "m3"}
    assert model.histories["sand"].rows[-1][2] == account["stored"]
    joints = frames.whole(model).of_joints
    at = np.isin(joints["number"], fdem.queries.numbers(model, CHANNEL))
    c = fdem.queries.values(model, CHANNEL, "concentration")
    assert joints["proppant_concentration"][at] == pytest.approx(c) and c.max() > 0.04
    assert Proppant.of(model.blocks).values["proppant_size"] == 4e-4


def test_long_steps_of_flow_are_named(tmp_path: Path) -> None:
    """Currents that the weight of grains drives cannot follow them; a slot in the plane has none."""
    said = []
    for dt in (2e3, 5.0):
        sim = Blocks(SerialComm())
        sim.log = Noted()
        Bench(tmp_path, blocks=sim)(SCRIPT.replace("time 40 dt 2", f"time {dt} dt {dt}"))
        said.append("\n".join(sim.log.lines))
    assert "currents driven by their weight need steps of at most" in said[0] and "currents" not in said[1]

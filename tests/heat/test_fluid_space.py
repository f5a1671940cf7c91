"""Heat in the fluid of triangular channels: the arithmetic, fronts, Lauwerier's forms, limits, accounts, restarts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import erfc

from hpcdem.commands import fdem
from hpcdem.commands.fdem import frames
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, saved_state
from hpcdem.physics.fdem.groups import CHANNEL
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels as flowing
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.fluid import FluidHeat
from hpcdem.physics.heat.implicit import Implicit
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.heat.reference import fluid_step_in_space
from hpcdem.pre.mesh import structured_space
from tests.flow.space import on_plane, points_at, ring, standing
from tests.flow.support import hold
from tests.heat import exact
from tests.heat.support import GRANITE, RHO_C, WATER, of_nodes, step, temperatures, with_heat
from tests.heat.test_fluid import flowing_line
from tests.pcdc.fake import Bench, Noted
from tests.space.support import ROCK, box

ROCK_C = ROCK["density"] * GRANITE["capacity"]
"""Heat capacity of the rock [J/(m3 K)]."""


def steady(sim: Blocks) -> None:
    """The water flows."""
    with Coupled(sim, 1.0) as run:
        run.steady()


def put(fluid: FluidHeat, t: np.ndarray) -> None:
    """Every flow node has its temperature."""
    for point, value in zip(fluid.flow.network.nodes, t):
        fluid.initial(np.array([point]), value)


def test_a_sub_step_against_plain_sums() -> None:
    """Triangles of any shape, many at an edge, between blocks of many temperatures; one node is held."""
    mesh = box((3, 2, 2), (1.0, 0.8, 0.6), 5, shaken=0.2)
    sim, flow = standing(mesh, aperature_initial=2e-4, fluid_bulk=1e6)
    flow.fill(None, pressure=1e3)
    hold(flow, points_at(mesh, x=0.0), 4e3)
    hold(flow, points_at(mesh, x=1.0), 0.0)
    steady(sim)
    heat, fluid = with_heat(sim, {"conductivity": 50.0})
    rng = np.random.default_rng(3)
    nodes = flow.network.nodes
    rock = rng.uniform(0.0, 50.0, len(mesh.points))
    for point, value in enumerate(rock.tolist()):
        heat.initial(np.array([point]), value)
    t = rng.uniform(0.0, 80.0, len(nodes))
    put(fluid, t)
    heat.prescribe_fluid(nodes[[7]], 99.0)
    sim.close_model()
    fluid.begin_cycle(1.0)
    dt = 0.3 / fluid.rate
    fluid.begin_cycle(dt)
    assert fluid._conduct.min() < 0.0 < fluid._conduct.max()
    fluid.advance(dt, heat.held_at(0.0))
    assert fluid.sub_steps == 1
    wanted, to_rock = fluid_step_in_space(
        mesh.points[nodes], np.searchsorted(nodes, flow.network.corners), of_nodes(flow, "pressure"),
        flow.values("flow-channel", "aperture"), 1e-3, of_nodes(flow, "fluid"), t, rock[nodes], dt, RHO_C, 50.0, 200.0,
        {7: 99.0},
    )  # fmt: skip
    assert np.abs(wanted - t).max() > 5.0 and of_nodes(flow) == pytest.approx(wanted, abs=1e-6)
    assert fluid.wall_heat.sum() == pytest.approx(to_rock, rel=1e-8)


def fracture(cells: tuple[int, int], size: tuple[float, float], speed: float, water: dict[str, float], uneven=0.0,
             heights=(0.0, 0.5, 1.0), aperture: float = 1e-3, **rock: float):  # fmt: skip
    """Water in steady flow of this speed [m/s] along x in a plane between two halves; uneven: points in it are moved
    within it by so much of a cell."""
    made = structured_space.box((*(np.linspace(0.0, s, n + 1) for s, n in zip(size, cells)), np.array(heights)), 6)
    points, middle = made.points.copy(), heights[len(heights) // 2]
    inside = (points[:, 2] == middle) & (points[:, :2] > 0.0).all(axis=1) & (points[:, :2] < size).all(axis=1)
    shift = np.random.default_rng(11).uniform(-uneven, uneven, (int(inside.sum()), 2))
    points[inside, :2] += shift * np.array(size) / cells
    mesh = Mesh.of(points, made.cells)
    sim, flow = standing(mesh, on_plane(mesh, 2, middle), aperature_initial=aperture, fluid_bulk=1e6)
    flow.fill(None, saturation=1.0)
    low = points_at(mesh, x=0.0, z=middle)
    if speed > 0.0:
        hold(flow, low, speed * 12.0 * 1e-3 / aperture**2 * size[0])
        hold(flow, points_at(mesh, x=size[0], z=middle), 0.0)
        steady(sim)
    heat, fluid = with_heat(sim, water, **rock)
    return sim, flow, heat, fluid, low


def of_plane(sim: Blocks, flow: Flow) -> tuple[np.ndarray, np.ndarray]:
    """Places along x and temperatures of flow nodes, by x."""
    x, t = sim.mesh.points[flow.network.nodes, 0], of_nodes(flow)
    order = np.argsort(x, kind="stable")
    return x[order], t[order]


def test_a_front_on_uneven_triangles() -> None:
    """What is warm in the fracture has come in: rho C Q t at the inflow's temperature. The front's middle is at v t; of
    second order it is steeper; nothing is above or below what came in, though some triangles are obtuse."""
    adiabatic, width = {"transfer_coeficient": 0.0, "conductivity": 0.0}, []
    for second in (0.0, 1.0):
        sim, flow, heat, fluid, low = fracture((60, 4), (6.0, 0.4), 0.01, {**adiabatic, "second_order": second}, 0.3)
        heat.prescribe_fluid(low, 50.0)
        fluid.initial(low, 50.0)
        step(sim, 300.0, 30)
        x, t = of_plane(sim, flow)
        assert t.min() >= 0.0 and t.max() <= 50.0 * (1.0 + 1e-14)
        rest = ~np.isin(flow.network.nodes, low)
        if not second:
            came = 50.0 * 0.01 * 1e-3 * 0.4 * 300.0
            assert (of_nodes(flow, "fluid") * of_nodes(flow))[rest].sum() == pytest.approx(came, rel=1e-7)
        edges = np.arange(0.05, 6.0, 0.1)
        mean = np.array([t[(x >= a - 0.05) & (x < a + 0.05)].mean() for a in edges])
        assert np.interp(-25.0, -mean, edges) == pytest.approx(3.0, abs=0.08)
        width.append(np.interp(-5.0, -mean, edges) - np.interp(-45.0, -mean, edges))
        found = heat.account()
        assert found["relative"] < 1e-13 and found["stored"] == 0.0
    assert width[1] < width[0] / 3.0, width


def test_conduction_along_a_fracture_follows_the_series() -> None:
    water = {"conductivity": 420.0, "transfer_coeficient": 0.0}
    sim, flow, heat, _, low = fracture((32, 2), (1.0, 0.1), 0.0, water, 0.25)
    heat.prescribe_fluid(low, 100.0)
    a = 420.0 / RHO_C
    time = 0.2 / a
    step(sim, time, 50)
    x, t = of_plane(sim, flow)
    assert t == pytest.approx(100.0 * exact.slab(x, time, 1.0, a), abs=0.4)
    assert (temperatures(sim) == 0.0).all() and heat.account()["relative"] < 1e-12


CONDUCTIVITY, ALMOST_NONE = 2.5, 2.5e-4
ACROSS = {"conductivity": ALMOST_NONE, "conductivity_across": CONDUCTIVITY, "conductivity_dip": 0.0}
"""Rock that conducts along z alone."""
GOOD = {"transfer_coeficient": 1e4, "conductivity": 0.0}


def lauwerier(swept: np.ndarray, z: np.ndarray, time: float, rate: float, aperture: float) -> np.ndarray:
    """Part of the difference of temperature at a distance z [m] from a fracture, where the inflow [m3/s] has passed an
    area [m2]; Lauwerier 1955, for whatever form the area has."""
    left = np.maximum(time - swept * aperture / rate, 1e-9)
    return erfc((2.0 * CONDUCTIVITY * swept / (RHO_C * rate) + np.abs(z)) * np.sqrt(ROCK_C / CONDUCTIVITY / left) / 2.0)


@pytest.mark.slow
@pytest.mark.parametrize(("second", "error"), [pytest.param(0.0, 0.02, marks=pytest.mark.slow), (1.0, 0.004)])
def test_water_cools_a_fracture_as_lauwerier_says(second: float, error: float) -> None:
    """Within 2 % of the difference of temperature, as in the plane, in the water and in the rock beside it; far nearer
    of second order."""
    water = {**GOOD, "second_order": second}
    sim, flow, heat, _, low = fracture((50, 1), (50.0, 2.0), 0.01, water, heights=np.linspace(-6.0, 6.0, 41), **ACROSS)
    heat.prescribe_fluid(low, 50.0)
    run = Implicit(sim)
    time = 40.0 * 86400.0
    for _ in range(100):
        run.advance(time / 100)
    run.close()
    points = sim.mesh.points
    wanted = lauwerier(2.0 * points[:, 0], points[:, 2], time, 2e-5, 1e-3)
    fluid = of_nodes(flow) / 50.0 - wanted[flow.network.nodes]
    assert wanted[flow.network.nodes].min() < 0.1 and np.abs(fluid).max() < error, np.abs(fluid).max()
    near = np.abs(points[:, 2]) < 3.2
    assert np.abs(temperatures(sim) / 50.0 - wanted)[near].max() < error
    assert heat.account()["relative"] < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize(("second", "error"), [(0.0, 0.03), (1.0, 0.01)])
def test_water_that_spreads_from_a_well_cools_a_fracture(second: float, error: float) -> None:
    """Lauwerier's form by the area pi (r2 - r02) that has been passed, in a sector of 60 degrees: within 3 %."""
    radii = 0.2 + np.concatenate([[0.0], np.linspace(0.6, 30.0, 40)])
    mesh = ring(radii, 4, np.linspace(-6.0, 6.0, 41), math.pi / 3.0)
    sim, flow = standing(mesh, on_plane(mesh, 2, 0.0), aperature_initial=1e-3, fluid_bulk=1e6)
    flow.fill(None, saturation=1.0)
    r = np.hypot(mesh.points[:, 0], mesh.points[:, 1])
    middle = np.abs(mesh.points[:, 2]) < 1e-9
    well = np.flatnonzero((r < 0.2001) & middle)
    rate = 4e-4
    flow.drill("well", well)
    flow.stage("well", "rate", rate / 6.0, math.inf, math.inf)
    hold(flow, np.flatnonzero((r > radii[-1] - 1e-6) & middle), 0.0)
    steady(sim)
    heat, _ = with_heat(sim, {**GOOD, "second_order": second}, **ACROSS)
    heat.prescribe_fluid(well, 50.0)
    run = Implicit(sim)
    time = 40.0 * 86400.0
    for _ in range(80):
        run.advance(time / 80)
    run.close()
    wanted = lauwerier(math.pi * (r * r - 0.04), mesh.points[:, 2], time, rate, 1e-3)
    fluid = of_nodes(flow) / 50.0 - wanted[flow.network.nodes]
    assert wanted[flow.network.nodes].min() < 0.1 and np.abs(fluid).max() < error, np.abs(fluid).max()
    assert heat.account()["relative"] < 1e-10


def test_a_model_that_is_one_cell_thick_is_that_of_the_plane() -> None:
    """The same fracture in the plane and in space, of second order: temperatures along it, all heat over the width."""
    water = {"second_order": 1.0, "transfer_coeficient": 50.0}
    flat, flow, heat, _ = flowing_line(40, 2.0, 0.01, water)
    heat.prescribe_fluid(np.flatnonzero((flat.mesh.points == 0.0).all(axis=1)), 50.0)
    sim, thick, other, _, low = fracture((40, 1), (2.0, 0.1), 0.01, water, heights=(-0.05, 0.0, 0.05))
    other.prescribe_fluid(low, 50.0)
    for one in (flat, sim):
        step(one, 150.0, 75)
    (x, t), (places, u) = of_plane(flat, flow), of_plane(sim, thick)
    assert np.interp(0.3, x, t) > 20.0 and u == pytest.approx(np.interp(places, x, t), abs=0.6)
    for name in ("fluid", "stored"):
        assert other.account()[name] == pytest.approx(0.1 * heat.account()[name], rel=0.015)


def test_perfect_exchange_holds_the_front_back() -> None:
    """Rock that conducts well across and takes the temperature of the water at once: the front goes by the share of the
    water in all heat capacity."""
    water = {"transfer_coeficient": 1e6, "conductivity": 0.0, "second_order": 1.0}
    rock = {"conductivity": 1e-4, "conductivity_across": 1e4, "conductivity_dip": 0.0}
    sim, flow, heat, _, low = fracture((60, 1), (6.0, 0.4), 0.01, water, heights=(-2e-3, 0.0, 2e-3), **rock)
    heat.prescribe_fluid(low, 50.0)
    share = RHO_C * 1e-3 / (RHO_C * 1e-3 + ROCK_C * 4e-3)
    run = Implicit(sim)
    time = 3.0 / (share * 0.01)
    for _ in range(60):
        run.advance(time / 60)
    run.close()
    x, t = of_plane(sim, flow)
    assert 0.2 < share < 0.4 and np.interp(-25.0, -t, x) == pytest.approx(3.0, abs=0.1)
    assert of_nodes(flow) == pytest.approx(temperatures(sim)[flow.network.nodes], abs=0.05)


@pytest.mark.parametrize("second", [pytest.param(0.0, marks=pytest.mark.slow), 1.0])
def test_implicit_steps_come_to_what_explicit_ones_do(second: float) -> None:
    """On uneven triangles, with conduction, exchange and advection; the account of both closes."""
    found = []
    for implicit in (True, False):
        sim, flow, heat, _, low = fracture((12, 2), (1.2, 0.2), 0.01, {"second_order": second, "conductivity": 20.0},
                                           0.25, heights=(-0.1, 0.0, 0.1))  # fmt: skip
        heat.prescribe_fluid(low, 50.0)
        if implicit:
            run = Implicit(sim)
            for _ in range(300):
                run.advance(1.0)
            run.close()
        else:
            step(sim, 300.0, 300)
        assert heat.account()["relative"] < 1e-12, heat.account()
        found.append(np.concatenate([of_nodes(flow), temperatures(sim)]))
    assert found[0][:12].max() > 5.0 and found[0] == pytest.approx(found[1], abs=0.4 if second else 0.15)


def test_steady_state_of_a_cooled_fracture() -> None:
    """Rock held at 0: exp(-2 h x / (rho C v delta)), of second order within a percent."""
    water = {"conductivity": 0.0, "second_order": 1.0}
    sim, flow, heat, _, low = fracture((40, 2), (0.4, 0.02), 0.01, water, 0.2)
    heat.prescribe_fluid(low, 50.0)
    heat.prescribe(None, 0.0)
    run = Implicit(sim)
    run.steady()
    run.close()
    x, t = of_plane(sim, flow)
    assert t[x < 0.39] == pytest.approx(50.0 * np.exp(-2.0 * 200.0 * x[x < 0.39] / (RHO_C * 1e-5)), abs=0.45)
    assert heat.account()["relative"] < 1e-12


@pytest.mark.parametrize("dt", [5.0, 1e4])
def test_implicit_second_order_stays_between(dt: float) -> None:
    """In tetrahedra of any shape, all of whose faces are channels."""
    mesh = box((4, 3, 3), (1.0, 0.8, 0.9), 5, shaken=0.2)
    sim, flow = standing(mesh, aperature_initial=2e-4, fluid_bulk=1e6)
    flow.fill(None, pressure=1e3)
    hold(flow, points_at(mesh, x=0.0), 4e3)
    hold(flow, points_at(mesh, x=1.0), 0.0)
    steady(sim)
    heat, _ = with_heat(sim, {"second_order": 1.0, "transfer_coeficient": 5.0, "conductivity": 0.0})
    heat.prescribe_fluid(points_at(mesh, x=0.0), 50.0)
    run = Implicit(sim)
    for _ in range(4):
        run.advance(dt)
        assert -1e-5 < of_nodes(flow).min() and of_nodes(flow).max() < 50.0 + 1e-5
        assert heat.account()["relative"] < 1e-12
    assert of_nodes(flow).mean() > 5.0
    run.close()


@pytest.mark.parametrize(
    ("name", "value"),
    [("conductivity", 500.0), ("capacity", 2100.0), ("transfer_coeficient", 100.0), ("second_order", 1.0)],
)
def test_each_property_alone_changes_the_heat(name: str, value: float) -> None:
    def warmed(**changed: float) -> np.ndarray:
        sim, flow, heat, _, low = fracture((12, 1), (0.24, 0.02), 0.01, changed)
        heat.prescribe_fluid(low, 50.0)
        step(sim, 12.0, 12)
        return of_nodes(flow)

    assert np.abs(warmed() - warmed(**{name: value})).max() > 0.2


def test_the_temperature_of_what_comes_in_follows_its_table() -> None:
    adiabatic = {"transfer_coeficient": 0.0, "conductivity": 0.0}
    sim, flow, heat, _, low = fracture((40, 1), (2.0, 0.1), 0.01, adiabatic)
    sim.table("boiler", [(0.0, 0.0), (1e3, 100.0)])
    heat.prescribe_fluid(low, "boiler")
    step(sim, 400.0, 100)
    x, t = of_plane(sim, flow)
    near = x < 1.0
    assert t[near] == pytest.approx(0.1 * (400.0 - x[near] / 0.01), abs=0.6)


@pytest.mark.slow
def test_filling_a_dry_fracture_brings_its_heat() -> None:
    """Water of 40 K runs into dry triangles: what is in them has come in at 40 K, to the last digit."""
    mesh = box((6, 1, 2), (0.6, 0.1, 0.2))
    sim, flow = standing(mesh, on_plane(mesh, 2, 0.1), aperature_initial=1e-3, fluid_bulk=1e5)
    heat, fluid = with_heat(sim, {"transfer_coeficient": 0.0})
    low = points_at(mesh, x=0.0, z=0.1)
    heat.prescribe_fluid(low, 40.0)
    flow.prescribe(low, flowing.RATE, 1e-5)
    far = np.searchsorted(flow.network.nodes, points_at(mesh, x=0.3, z=0.1))
    while of_nodes(flow, "saturation")[far].min() < 0.5:
        for _ in range(50):
            sim.step()
    wet = of_nodes(flow, "fluid") > 1e-12
    assert 6 < wet.sum() < 14 and of_nodes(flow)[wet] == pytest.approx(40.0, rel=1e-9)
    found = heat.account()
    assert found["relative"] < 1e-12 and found["fluid"] == pytest.approx(
        RHO_C * 40.0 * flow.account()["given"], rel=1e-9
    )
    assert flow.time == pytest.approx(heat.time)


def test_channels_that_go_take_their_heat_with_them() -> None:
    sim, _, heat, _, _ = fracture((10, 2), (1.0, 0.2), 0.01, {}, heights=(-0.1, 0.0, 0.1))
    heat.initial(None, 30.0)
    before = heat.account()
    changes.null(sim, np.flatnonzero(sim.mesh.points[sim.mesh.cells].mean(axis=1)[:, 0] > 0.7))
    after = heat.account()
    assert after["fluid"] < 0.8 * before["fluid"] and after["relative"] < 1e-13 and after["removed"] > 0.0


def test_a_restart_in_the_middle(tmp_path) -> None:
    """Of explicit steps beside flow that fills the fracture, and of implicit ones: the same bits."""
    for implicit in (False, True):
        sim, flow, heat, fluid, low = fracture((10, 2), (1.0, 0.2), 0.01, {"second_order": 1.0}, 0.2)
        heat.prescribe_fluid(low, 50.0)

        def on(one: Blocks, many: int, implicit: bool = implicit) -> None:
            if not implicit:
                for _ in range(many):
                    one.step()
                return
            run = Implicit(one)
            for _ in range(many):
                run.advance(10.0)
            run.close()

        on(sim, 5)
        saved_state.save(sim, tmp_path / "a.sav")
        other = Blocks()
        saved_state.restore(other, tmp_path / "a.sav")
        for one in (sim, other):
            on(one, 5)
        found = [np.concatenate([of_nodes(Flow.of(one)), temperatures(one)]) for one in (sim, other)]
        assert np.array_equal(*found) and found[0].max() == 50.0 and np.ptp(found[0]) > 1.0
        assert Heat.of(other).account()["relative"] < 1e-12


SCRIPT = """
pcdc model new dim 3
pcdc mesh structured (0,0,-0.5) (1,0.2,0.5) cells 5 1 2
pcdc element c-model mech-iso-e property density 2500 young 50e9 poisson-ratio 0.25
pcdc element c-model therm-iso-h property conductivity 2.5 capacity 1000
pcdc face-joint c-model hydr-p-m property f-den 1000 f-bulk 1e6 vis 1e-6 a-initial 1e-3 a-min 1e-4 range z 0 0
pcdc face-joint c-model t-f property conductivity 0.6 capacity 4200 transfer-coefficient 200 second-order on
pcdc flow-node initial saturation 1
pcdc model option mechanical off
pcdc node group 'low' set 'end' range x 0 0 z 0 0
pcdc node boundary hydra-c-f-b pressure 120 range group 'low' set 'end'
pcdc node boundary hydra-c-f-b pressure 0 range x 1 1 z 0 0
pcdc model solve hydraulic steady
pcdc node initial temperature 80
pcdc table create 'colder' values (0,80) (100,20) (1e6,20)
pcdc node boundary therm-f-b-c temperature table 'colder' range group 'low' set 'end'
pcdc face-joint property transfer-coefficient 300
pcdc history create 'water' model value heat-in-fluid
pcdc history create 'low' flow-node value temperature minimum
pcdc history create 'all' flow-channel value temperature mean
pcdc model solve thermal time 300 dt 10
account = pcdc.heat
"""


def test_a_script_says_it_too(tmp_path) -> None:
    found = Bench(tmp_path, blocks=Blocks(SerialComm()))(SCRIPT)
    model, account = found.project, found["account"]
    assert account["relative"] < 1e-12 and 0.0 < account["fluid"] < RHO_C * 2e-4 * 80.0
    assert {name: history.unit for name, history in model.histories.items()} == {"water": "J", "low": "K", "all": "K"}
    assert model.histories["low"].rows[-1][2] == 20.0 and model.histories["water"].rows[-1][2] == account["fluid"]
    joints = frames.whole(model).of_joints
    at = np.isin(joints["number"], fdem.queries.numbers(model, CHANNEL))
    t = fdem.queries.values(model, CHANNEL, "temperature")
    assert joints["fluid_temperature"][at] == pytest.approx(t) and t.min() < 60.0


def test_obtuse_triangles_that_conduct_are_reported() -> None:
    """Once, and not without conduction; right angles do nothing."""
    for uneven, conductivity, some in ((0.0, 0.6, False), (0.45, 0.6, True), (0.45, 0.0, False)):
        sim, _, _, fluid, _ = fracture((6, 3), (0.6, 0.3), 0.01, {"conductivity": conductivity}, uneven)
        sim.log = Noted()
        step(sim, 1.0, 2)
        fluid.adjust(None, {"transfer_coeficient": 10.0})
        step(sim, 1.0, 1)
        assert sum("have negative conductance in the fluid" in line for line in sim.log.lines) == some


def test_what_cannot_be_is_refused() -> None:
    sim, flow = standing(box((2, 1, 2), (0.2, 0.1, 0.2)))
    heat = Heat.of(sim)
    with pytest.raises(CommandError, match="no heat yet"):
        heat.of_fluid()
    heat.assign(None, GRANITE)
    with pytest.raises(CommandError, match="the fluid has no thermal model"):
        heat.prescribe_fluid(None, 1.0)
    fluid = heat.of_fluid()
    fluid.assign(flow.network.channels[:2], WATER)
    with pytest.raises(CommandError, match="has no thermal model"):
        sim.step()
    fluid.assign(None, WATER)
    sim.parts(mechanical=True)
    sim.option(dynamic=False)
    sim.flow_clock(dt=1e-5)
    sim.heat_clock(dt=1.0)
    with pytest.raises(CommandError, match="heat in fluid needs the clock of flow"):
        sim.step()

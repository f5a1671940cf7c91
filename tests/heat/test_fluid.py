"""Heat in fluid: conduction and fronts along channels, exchange with the rock, accounts, implicit steps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.groups import CHANNEL
from hpcdem.physics.flow import kernels as flowing
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.physics.heat import kernels
from hpcdem.physics.heat.implicit import Implicit
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.heat.reference import fluid_step
from tests.blocks.support import rectangle, shaken
from tests.flow.support import at, hold, line
from tests.flow.support import standing as standing_flow
from tests.heat import exact
from tests.heat.support import GRANITE, RHO_C, WATER, of_nodes, step, temperatures, with_heat


def flowing_line(n: int, length: float, speed: float, water: dict[str, float], aperture: float = 1e-3, **rock: float):
    """Water in steady flow of this speed [m/s] along a straight fracture from (0, 0)."""
    sim, flow = line(n, length, aperature_initial=aperture, fluid_bulk=1e6, viscosity=1e-6)
    flow.fill(None, saturation=1.0)
    drop = speed * 12.0 * 1e-3 / aperture**2 * length
    hold(flow, at(sim, 0.0, 0.0), drop)
    hold(flow, at(sim, length, 0.0), 0.0)
    with Coupled(sim, 1.0) as run:
        run.steady()
    heat, fluid = with_heat(sim, water, **rock)
    return sim, flow, heat, fluid


@pytest.mark.parametrize("second", [0.0, 1.0])
def test_a_sub_step_against_plain_sums(second: float) -> None:
    """A net of channels in which water flows every way, between blocks of many temperatures; one node is held."""
    sim, flow = standing_flow(shaken(rectangle(5, 4, 1.0, 0.8), 0.2), aperature_initial=2e-4, fluid_bulk=1e6)
    flow.fill(None, pressure=1e3)
    hold(flow, at(sim, x=0.0), 4e3)
    hold(flow, at(sim, x=1.0), 0.0)
    with Coupled(sim, 1.0) as run:
        run.steady()
    heat, fluid = with_heat(sim, {"second_order": second, "conductivity": 50.0}, conductivity=100.0)
    rng = np.random.default_rng(3)
    sim.close_model()
    rock = rng.uniform(0.0, 50.0, len(sim.mesh.points))
    for point, value in enumerate(rock.tolist()):
        heat.initial(np.array([point]), value)
    t = rng.uniform(0.0, 80.0, len(flow.network.nodes))
    for point, value in zip(flow.network.nodes, t):
        fluid.initial(np.array([point]), value)
    held = {7: 99.0, int(np.searchsorted(flow.network.nodes, at(sim, x=0.0)[1])): 33.0}  # nothing flows into the last
    for row, value in held.items():
        heat.prescribe_fluid(flow.network.nodes[[row]], value)
    sim.close_model()
    q, w = flow.values(CHANNEL, "flow_rate"), of_nodes(flow, "fluid")
    fluid.begin_cycle(1.0)
    dt = 0.4 / fluid.rate
    fluid.begin_cycle(dt)
    fluid.advance(dt, heat.held_at(0.0))
    assert fluid.sub_steps == 1
    ends = np.searchsorted(flow.network.nodes, flow.network.ends)
    wanted, to_rock = fluid_step(
        sim.mesh.points[flow.network.nodes], ends, q, flow.values(CHANNEL, "aperture"), of_nodes(flow, "saturation"), w,
        t, rock[flow.network.nodes], dt, RHO_C, 50.0, 200.0, held, bool(second),
    )  # fmt: skip
    assert np.abs(wanted - t).max() > 5.0 and of_nodes(flow) == pytest.approx(wanted, abs=1e-9)
    assert fluid.wall_heat.sum() == pytest.approx(to_rock, rel=1e-10)


@pytest.mark.parametrize("saturation", [1e-6, 1e-22])
def test_a_node_that_is_nearly_dry_needs_no_sub_steps_of_its_own(saturation: float) -> None:
    """Water at 50 degrees that flows on into it, as it did when flow was switched off: the node has the temperature of
    what passes, and the account closes."""
    sim, flow = line(6, 1.0, aperature_initial=1e-3, fluid_bulk=1e6, viscosity=1e-6)
    flow.fill(None, saturation=saturation)
    first = at(sim, 0.0, 0.0)
    flow.fill(first, pressure=1e3)
    heat, fluid = with_heat(sim, {})
    fluid.initial(first, 50.0)
    heat.prescribe_fluid(first, 50.0)
    step(sim, 0.02, 20)
    found = of_nodes(flow)
    assert fluid.sub_steps < 5 and found[:2] == pytest.approx(50.0, abs=1e-3)
    assert found.min() >= 0.0 and found.max() <= 50.0 and heat.account()["relative"] < 1e-12


@pytest.mark.parametrize(("before", "after"), [(0.0, 1e-12), (1e-9, 1e-12), (1e-6, 5e-7), (3e-7, 9e-7)])
def test_a_node_that_hands_what_comes_to_the_rock(before: float, after: float) -> None:
    """1e-6 m2 at 200 degrees flow into a node at 20: what leaks off mixes with them first, so the temperature is that
    of the mixture, however little stays; the account has what it took along."""
    state = np.zeros((2, kernels.FLUID_STATE))
    state[:, kernels.T] = 200.0, 20.0
    out, given, dt = np.zeros(2), np.zeros(2), 1e-3
    kernels.carry(
        dt, np.array([0, 1, 2]), np.array([0, 0]), np.array([-1.0, 1.0]), np.array([[0, 1]]), np.array([1e-6 / dt]),
        np.array([200.0]), np.zeros(1), np.zeros((1, 4), np.int64), np.zeros(1), np.zeros(1), np.full(2, -1),
        np.zeros(1), np.array([2e-6, before]), np.array([1e-6, after]), np.array([0.0, before + 1e-6 - after]), RHO_C,
        state, out, given,
    )  # fmt: skip
    mixed = (before * 20.0 + 1e-6 * 200.0) / (before + 1e-6)
    assert out == pytest.approx([200.0, mixed], rel=1e-12)
    assert given[1] == pytest.approx(-RHO_C * (before + 1e-6 - after) * mixed, rel=1e-12) and abs(given[0]) < 1e-9


def test_heat_goes_over_to_the_rock() -> None:
    """Warm water at rest between blocks that conduct well: the difference decays with 2 h (1 / C_water + 1 / C_rock),
    both per metre of fracture."""
    sim, flow = line(4, 0.02, aperature_initial=1e-2, fluid_bulk=1e6)
    flow.fill(None, saturation=1.0)
    heat, fluid = with_heat(sim, {}, conductivity=500.0)
    fluid.initial(np.flatnonzero(flow.network.there), 60.0)
    rock = float(sim.element_rows.column("density")[1]) * GRANITE["capacity"] * 0.01
    water = RHO_C * 1e-2
    rate = 2.0 * 200.0 * (1.0 / water + 1.0 / rock)
    step(sim, 0.7 / rate, 2000)
    difference = of_nodes(flow) - temperatures(sim)[flow.network.nodes]
    assert difference == pytest.approx(60.0 * math.exp(-0.7), rel=4e-3)
    assert heat.account()["relative"] < 1e-13


def test_conduction_along_a_channel_follows_the_series() -> None:
    sim, flow = line(64, 1.0, aperature_initial=1e-3, fluid_bulk=1e6)
    flow.fill(None, saturation=1.0)
    _, fluid = with_heat(sim, {"conductivity": 420.0, "transfer_coeficient": 0.0})
    heat = fluid.heat
    heat.prescribe_fluid(at(sim, 0.0, 0.0), 100.0)
    a = 420.0 / RHO_C
    time = 0.2 / a
    step(sim, time, 50)
    x = sim.mesh.points[flow.network.nodes, 0]
    assert of_nodes(flow) == pytest.approx(100.0 * exact.slab(x, time, 1.0, a), abs=0.1)
    assert (temperatures(sim) == 0.0).all() and heat.account()["relative"] < 1e-12


def test_fronts_and_what_the_limiter_keeps_of_them() -> None:
    """A front that goes with the water: its middle is at v t; of second order it is three times as sharp, and nothing
    is ever above or below what came in."""
    width = []
    for second in (0.0, 1.0):
        sim, flow, heat, _ = flowing_line(100, 10.0, 0.01, {"transfer_coeficient": 0.0, "conductivity": 0.0,
                                                            "second_order": second})  # fmt: skip
        heat.prescribe_fluid(at(sim, 0.0, 0.0), 50.0)
        step(sim, 500.0, 100)
        x, t = sim.mesh.points[flow.network.nodes, 0], of_nodes(flow)
        order = np.argsort(x)
        x, t = x[order], t[order]
        assert t.min() >= 0.0 and t.max() <= 50.0 * (1.0 + 1e-14) and (np.diff(t) <= 1e-12).all()
        assert np.interp(-25.0, -t, x) == pytest.approx(5.0, abs=0.02 if second else 0.06)
        width.append(np.interp(-5.0, -t, x) - np.interp(-45.0, -t, x))
        assert heat.account()["relative"] < 1e-13
    assert width[1] < width[0] / 2.5, width


@pytest.mark.parametrize("second", [pytest.param(0.0, marks=pytest.mark.slow), 1.0])
def test_implicit_steps_are_backward_euler_of_the_same(second: float) -> None:
    """(T' - T) C / dt is what the kernels of explicit steps bring at T', to fluid and rock; many short ones come to
    what explicit steps come to; the account closes."""
    found = []
    for implicit in (True, False):
        sim, flow, heat, _ = flowing_line(20, 2.0, 0.01, {"second_order": second})
        heat.prescribe_fluid(at(sim, 0.0, 0.0), 50.0)
        if implicit:
            run = Implicit(sim)
            for _ in range(800):
                run.advance(5.0)
            run.close()
            assert run.factors == 1
            assert run.unknowns == len(sim.mesh.points) + 20
        else:
            step(sim, 4000.0, 800)
        assert heat.account()["relative"] < 1e-12, heat.account()
        found.append(np.concatenate([of_nodes(flow), temperatures(sim)]))
    assert found[0][1:12].min() > 5.0 and found[0] == pytest.approx(found[1], abs=0.1)


def test_steady_state_of_a_cooled_fracture() -> None:
    """Water that leaves as warm as the rock: rock that is held at 0 along the fracture takes the heat of water that
    comes with 50 K: exp(-2 h x / (rho C v delta)), of backward differences (1 + 2 h dx / (rho C v delta))^-n."""
    sim, flow, heat, _ = flowing_line(40, 4.0, 0.01, {"conductivity": 0.0})
    heat.prescribe_fluid(at(sim, 0.0, 0.0), 50.0)
    heat.prescribe(None, 0.0)
    run = Implicit(sim)
    run.steady()
    run.close()
    x = sim.mesh.points[flow.network.nodes, 0]
    order = np.argsort(x)
    n = np.arange(41.0)
    wanted = 50.0 * (1.0 + 2.0 * 200.0 * 0.1 / (RHO_C * 0.01 * 1e-3)) ** -n
    assert of_nodes(flow)[order][:-1] == pytest.approx(wanted[:-1], rel=1e-6)
    assert heat.account()["relative"] < 1e-12


@pytest.mark.parametrize(
    ("second", "least", "most"), [pytest.param(0.0, 0.9, 1.1, marks=pytest.mark.slow), (1.0, 1.75, 2.2)]
)
def test_order_of_advection(second: float, least: float, most: float) -> None:
    """Of the same, against the exponential, on channels of 1 cm and of half of that."""
    off = []
    for n in (40, 80):
        sim, flow, heat, _ = flowing_line(n, 0.4, 0.01, {"conductivity": 0.0, "second_order": second})
        heat.prescribe_fluid(at(sim, 0.0, 0.0), 50.0)
        heat.prescribe(None, 0.0)
        run = Implicit(sim)
        run.steady()
        run.close()
        x = sim.mesh.points[flow.network.nodes, 0]
        wanted = 50.0 * np.exp(-2.0 * 200.0 * x / (RHO_C * 0.01 * 1e-3))
        inside = x < 0.399
        off.append(np.abs(of_nodes(flow) - wanted)[inside].max())
        assert heat.account()["relative"] < 1e-12
    assert off[0] < 1.0 and least < math.log2(off[0] / off[1]) < most, off


@pytest.mark.parametrize("dt", [5.0, 1e3, 1e6])
def test_implicit_second_order_stays_between(dt: float) -> None:
    """In a net of channels whatever the steps, from far less than a node takes to be filled to far more, to a steady
    state that is warm all over."""
    sim, flow = standing_flow(shaken(rectangle(6, 5, 1.0, 0.8), 0.2), aperature_initial=2e-4, fluid_bulk=1e6)
    flow.fill(None, pressure=1e3)
    hold(flow, at(sim, x=0.0), 4e3)
    hold(flow, at(sim, x=1.0), 0.0)
    with Coupled(sim, 1.0) as run:
        run.steady()
    heat, _ = with_heat(sim, {"second_order": 1.0, "transfer_coeficient": 5.0})
    heat.prescribe_fluid(at(sim, x=0.0), 50.0)
    implicit = Implicit(sim)
    for _ in range(4):
        implicit.advance(dt)
        assert -1e-5 < of_nodes(flow).min() and of_nodes(flow).max() < 50.0 + 1e-5
        assert heat.account()["relative"] < 1e-12
    assert of_nodes(flow).mean() > 49.9 or dt < 1e6
    implicit.close()


def test_the_temperature_of_what_comes_in_follows_its_table() -> None:
    """Warmer by 0.1 K a second: so it is farther down later, by x / v, but for half a node at the entrance."""
    sim, flow, heat, _ = flowing_line(50, 2.0, 0.01, {"transfer_coeficient": 0.0, "conductivity": 0.0})
    sim.table("boiler", [(0.0, 0.0), (1e3, 100.0)])
    heat.prescribe_fluid(at(sim, 0.0, 0.0), "boiler")
    step(sim, 400.0, 200)
    x = sim.mesh.points[flow.network.nodes, 0]
    near = x < 1.0
    assert of_nodes(flow)[near] == pytest.approx(0.1 * (400.0 - x[near] / 0.01), abs=0.4)
    heat.remove_conditions(None)
    sim.remove_table("boiler")


@pytest.mark.parametrize(
    ("name", "value"),
    [("conductivity", 500.0), ("capacity", 2100.0), ("transfer_coeficient", 100.0), ("second_order", 1.0)],
)
def test_each_property_alone_changes_the_heat(name: str, value: float) -> None:
    """Of water that runs between blocks at 0 degrees."""

    def warmed(**changed: float) -> np.ndarray:
        sim, flow, heat, _ = flowing_line(20, 0.4, 0.01, changed)
        heat.prescribe_fluid(at(sim, 0.0, 0.0), 50.0)
        step(sim, 20.0, 20)
        return of_nodes(flow)

    assert np.abs(warmed() - warmed(**{name: value})).max() > 0.2


@pytest.mark.slow
def test_filling_a_dry_fracture_brings_its_heat() -> None:
    """Water of 40 K runs into dry channels, explicit flow and heat on one clock: what is in them has come in at 40 K,
    to the last digit, though nodes fill and flows change."""
    sim, flow = line(10, 1.0, aperature_initial=1e-3, fluid_bulk=1e5)
    heat, fluid = with_heat(sim, {"transfer_coeficient": 0.0})
    heat.prescribe_fluid(at(sim, 0.0, 0.0), 40.0)
    flow.prescribe(at(sim, 0.0, 0.0), flowing.RATE, 1e-4)
    while of_nodes(flow, "saturation")[5] < 0.5:
        for _ in range(50):
            sim.step()
    wet = of_nodes(flow, "fluid") > 1e-12
    assert 4 < wet.sum() < 11 and of_nodes(flow)[wet] == pytest.approx(40.0, rel=1e-9)
    found = heat.account()
    assert found["relative"] < 1e-12 and found["fluid"] == pytest.approx(
        RHO_C * 40.0 * flow.account()["given"], rel=1e-9
    )
    assert flow.time == pytest.approx(heat.time)


def test_the_exchange_is_part_of_saturation() -> None:
    """Half full channels exchange f(1/2) = 1/2 of what full ones do; dry ones nothing."""
    rates = []
    for saturation in (1.0, 0.5, 0.0):
        sim, flow = line(4, 1.0, aperature_initial=1e-2, fluid_bulk=1e6)
        flow.fill(None, saturation=saturation)
        heat, fluid = with_heat(sim, {})
        heat.initial(None, 50.0)
        fluid.initial(np.flatnonzero(flow.network.there), 0.0)
        step(sim, 1.0, 1)
        rates.append(heat.account()["fluid"])
    assert rates[2] == 0.0 and rates[1] / rates[0] == pytest.approx(0.5, rel=0.02)


def test_channels_that_go_take_their_heat_with_them() -> None:
    sim, flow, heat, _ = flowing_line(10, 1.0, 0.01, {})
    heat.initial(None, 30.0)
    before = heat.account()
    changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 0] > 0.7))
    after = heat.account()
    assert after["fluid"] < 0.8 * before["fluid"] and after["relative"] < 1e-13 and after["removed"] > 0.0


def test_what_cannot_be_is_refused() -> None:
    sim, flow = line(4, 1.0)
    heat = Heat.of(sim)
    with pytest.raises(CommandError, match="no heat yet"):
        heat.of_fluid()
    heat.assign(None, GRANITE)
    fluid = heat.of_fluid()
    with pytest.raises(CommandError, match="the fluid has no thermal model"):
        heat.prescribe_fluid(None, 1.0)
    with pytest.raises(CommandError, match="needs capacity"):
        fluid.assign(None, {"conductivity": 1.0})
    edges = sim.mesh.edges()
    with pytest.raises(CommandError, match="is no channel"):
        fluid.assign(np.setdiff1d(edges.faces[edges.inner, 0], flow.network.channels), WATER)
    some = flow.network.channels[:2]
    fluid.assign(some, WATER)
    with pytest.raises(CommandError, match="has no thermal model"):
        sim.step()
    with pytest.raises(CommandError, match="all channels have the same fluid, but capacity is 4000 and 4200"):
        fluid.assign(flow.network.channels[2:], {**WATER, "capacity": 4000.0})
    fluid.assign(flow.network.channels[2:], {**WATER, "transfer_coeficient": 10.0})


def test_temperature_of_what_flows_in_a_channel() -> None:
    """Van Leer's limiter and the half step, by hand: as far as it goes between both nodes, behind a held node, against
    the flow, and where the slopes have opposite signs."""
    state = np.zeros((3, kernels.FLUID_STATE))
    state[:, kernels.T], state[:, kernels.U], state[:, kernels.FROM] = (
        (10.0, 14.0, 30.0),
        (8.0, 10.0, 0.0),
        (2.0, 4.0, 0.0),
    )
    state[:, kernels.FULL], state[:, kernels.RISE] = (5.0, 4.0, 8.0), (0.5, 2.0, -3.0)
    ends, q, length, dt = np.array([[0, 1], [2, 1], [0, 1]]), np.array([2.0, 3.0, -1.5]), np.array([3.0, 5.0, 4.0]), 0.2
    out = np.zeros(3)
    kernels.faces(ends, q, length, False, dt, state, out)
    assert out.tolist() == [10.0, 30.0, 14.0]
    kernels.faces(ends, q, length, True, dt, state, out)
    r = (10.0 - 8.0) / 2.0 * 3.0 / 4.0
    first = r / (1.0 + r) * 4.0 * (1.0 - dt * 2.0 / 5.0) + 0.5 * dt * 0.5
    second = 0.5 * -16.0 + 0.25 * dt * (2.0 - 3.0 / 4.0 * -16.0)
    assert out == pytest.approx(
        [10.0 + first, 30.0 + second, 14.0], rel=1e-14
    )  # the last: -4 of the channel, +4 before

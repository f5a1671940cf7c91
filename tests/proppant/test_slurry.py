"""Sand that flows: fronts, what conditions bring, bridges, and what it does to the fluid."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.proppant import kernels as own
from hpcdem.physics.proppant.assignments import CONCENTRATION, RATE
from hpcdem.physics.proppant.model import Proppant
from hpcdem.physics.proppant.properties import PROPPANT
from hpcdem.physics.proppant.reference import sub_step
from tests.flow.support import at, hold, over, until
from tests.proppant.support import OIL, SAND, nodes_up, profile, slot

FAST = 1e-5
"""Flow of the slots below [m2/s]."""


def test_what_leaves_a_node_comes_to_the_other() -> None:
    """By 0.4 m2/s there and 0.04 back: what one gives times the flow times what the other takes."""
    nodes, state = np.ones((2, own.NODE)), np.ones((2, own.STATE))
    nodes[:, own.N], state[:, own.GIVES], state[:, own.TAKES] = (0.3, 0.1), (0.5, 0.2), (0.4, 0.8)
    links = np.array([0, 1, 2]), np.zeros(2, np.int64), np.array([-1.0, 1.0]), np.array([[0, 1]])
    getattr(own.move, "py_func", own.move)(*links, np.array([[1.0, 0.5]]), 0.1, 1.0, 0.6, 2.0, 1e6, nodes, state)
    assert nodes[:, own.N] == pytest.approx([0.264, 0.136], rel=1e-12)


def test_only_what_is_refused_is_reported() -> None:
    told: list[str] = []
    log = SimpleNamespace(warn_once=lambda key, text: told.append(text))
    blocks, flow = SimpleNamespace(log=log, comm=SerialComm()), SimpleNamespace(implicit=True)
    for refused in (0.0, 2.0):
        Proppant._report_refused(SimpleNamespace(_refused=0.0, blocks=blocks, cycles=0, flow=flow), refused)  # type: ignore[arg-type]
    assert told == ["inflow nodes of proppant are packed: 2 m2 of it could not enter"]


def flowing(
    n: int = 50, fluid: dict[str, float] = OIL, rate: float = FAST, **changes: float
) -> tuple[Blocks, Flow, Proppant]:
    """A slot of 1 m without gravity, through which fluid flows up."""
    sim, flow, proppant = slot(n, 1.0, fluid, **changes)
    sim.gravity(0.0, 0.0)
    low, *_, top = nodes_up(sim)
    flow.prescribe(np.array([low]), kernels.RATE, rate)
    hold(flow, np.array([top]), 1e5)
    return sim, flow, proppant


def bring(sim: Blocks, proppant: Proppant, c: float | str, kind: str = CONCENTRATION) -> None:
    proppant.prescribe(nodes_up(sim)[:1], kind, c)


def test_the_power_of_the_viscosity_has_two_bounds() -> None:
    for power in (-3.0, -1.0):
        PROPPANT.derive({"viscosity_power": power})
    for power in (-3.01, -0.99, 0.5):
        with pytest.raises(CommandError, match=rf"between -3 and -1, got {power:g}"):
            PROPPANT.derive({"viscosity_power": power})


def test_a_front_goes_with_the_slurry() -> None:
    """9.15: dilute slurry comes in at one end; half of it has come where the fluid is."""
    sim, flow, proppant = flowing()
    bring(sim, proppant, 0.01)
    y = sim.mesh.points[nodes_up(sim), 1]
    for time in (100.0, 300.0):
        over(sim, time - flow.time, 20)
        now = profile(sim, flow)
        front = float(np.interp(-0.005, -now, y))
        assert front == pytest.approx(FAST / 5e-3 * time, abs=0.03)
        assert now.max() <= 0.01 + 1e-9
        found = proppant.account()
        assert found["came"] == pytest.approx(0.01 * FAST * time, rel=1e-9) and found["relative"] < 1e-12


def test_what_comes_in_follows_its_table() -> None:
    """Concentration and rate that grow with time: what came is their integral, by steps that take the end of each."""
    for kind, flux in ((CONCENTRATION, FAST), (RATE, 1.0)):
        sim, flow, proppant = flowing()
        top = 0.02 if kind == CONCENTRATION else 1e-6
        sim.table("more", [(0.0, 0.0), (200.0, top)])
        bring(sim, proppant, "more", kind)
        over(sim, 200.0, 50)
        found = proppant.account()
        assert found["came"] == pytest.approx(flux * 0.5 * top * 200.0, rel=0.03) and found["relative"] < 1e-12


def test_explicit_cycles_carry_it_as_far() -> None:
    """Fluid that yields to pressure, so that cycles are long."""
    fluid = {**OIL, "fluid_bulk": 1e4, "viscosity": 1e-3}
    found = []
    for implicit in (True, False):
        sim, flow, proppant = flowing(20, fluid, rate=1e-4)
        hold(flow, nodes_up(sim)[-1:], 0.0)
        flow.fill(None, saturation=1.0)
        bring(sim, proppant, 0.05)
        if implicit:
            over(sim, 20.0, 400)
        else:
            until(sim, 20.0)
            assert flow.cycles > 100
        found.append(profile(sim, flow))
        account = proppant.account()
        assert account["relative"] < 1e-12
        assert account["came"] == pytest.approx(0.05 * 1e-4 * flow.time, rel=1e-6)
    assert found[0] == pytest.approx(found[1], abs=5e-4) and found[0][8] > 0.005


def test_a_rate_brings_sand_without_fluid() -> None:
    sim, flow, proppant = flowing()
    sim.table("sand", [(0.0, 0.0), (100.0, 2e-7), (1e9, 2e-7)])
    bring(sim, proppant, "sand", RATE)
    over(sim, 200.0, 200)
    found = proppant.account()
    assert found["came"] == pytest.approx(0.5 * 100.0 * 2e-7 + 100.0 * 2e-7, rel=0.01)
    assert found["relative"] < 1e-12
    proppant.remove_conditions(None)
    over(sim, 50.0, 20)
    assert proppant.account()["came"] == found["came"]


def test_what_comes_out_is_counted() -> None:
    """Through the whole slot: at last as much leaves as comes."""
    sim, flow, proppant = flowing()
    bring(sim, proppant, 0.1)
    over(sim, 1500.0, 100)
    before = proppant.account()
    over(sim, 100.0, 20)
    after = proppant.account()
    assert after["left"] - before["left"] == pytest.approx(0.1 * FAST * 100.0, rel=1e-3)
    assert after["relative"] < 1e-12
    assert profile(sim, flow) == pytest.approx(0.1, rel=1e-3)


def test_narrow_channels_carry_none() -> None:
    """They bridge: sand packs before them, up to the limit and not beyond, and the rest finds no room."""
    for factor, passes in ((9.9, True), (10.1, False)):
        sim, flow, proppant = flowing(proppant_size_factor=factor)
        proppant.fill(nodes_up(sim)[:10], 0.1)
        over(sim, 200.0, 20)
        assert (profile(sim, flow)[15:].max() > 0.05) == passes
    for limit in (0.6, 0.4):
        sim, flow, proppant = flowing(20, proppant_concentration_limit=limit, aperature_factor=0.3)
        y = sim.mesh.points[nodes_up(sim), 1]
        edges = sim.mesh.edges()
        upper = edges.faces[(sim.mesh.points[edges.points][:, :, 1] > 0.74).all(axis=1), 0]
        flow.adjust(np.intersect1d(upper, flow.network.channels), {"aperature_initial": 1e-3})
        bring(sim, proppant, 0.2)
        over(sim, 500.0, 50)
        now = profile(sim, flow)
        full = now >= limit - 1e-6
        assert now.max() <= limit + 1e-9 and full.any() and now[y > 0.8].max() == 0.0
        room = profile(sim, flow, "volume")
        assert proppant.account()["packed"] == pytest.approx(limit * room[full].sum(), rel=1e-5)
        assert proppant.account()["relative"] < 1e-12


@pytest.mark.parametrize(("power", "factor"), [(-2.0, 2.25), (-2.5, 1.5**2.5), (-1.0, 1.5)])
def test_a_slurry_is_more_viscous(power: float, factor: float) -> None:
    """9.15: C = 0.2, limit 0.6."""
    drops = []
    for c in (0.0, 0.2):
        sim, flow, proppant = flowing(20, viscosity_power=power)
        proppant.fill(None, c)
        bring(sim, proppant, c)
        over(sim, 1.0, 5)
        pressure = profile(sim, flow, "pressure")
        drops.append(pressure[2] - pressure[17])
    assert drops[0] == pytest.approx(12.0 * 0.1 * FAST * 0.75 / 5e-3**3, rel=1e-6)
    assert drops[1] / drops[0] == pytest.approx(factor, rel=1e-4)


@pytest.mark.parametrize("factor", [0.0, 0.2])
def test_a_pack_lets_fluid_through(factor: float) -> None:
    """By its permeability (Kozeny & Carman), or as a channel of a part of the aperture."""
    sim, flow, proppant = flowing(20, aperature_factor=factor, rate=1e-9)
    proppant.fill(None, 0.6)
    over(sim, 200.0, 20)
    pressure = profile(sim, flow, "pressure")
    permeability = 0.4**3 * 5e-4**2 / (180.0 * 0.6**2)
    assert own.kozeny_carman(0.6, 5e-4) == pytest.approx(permeability)
    resistance = 12.0 * 0.1 / (factor * 5e-3) ** 3 if factor else 0.1 / (permeability * 5e-3)
    assert pressure[2] - pressure[17] == pytest.approx(1e-9 * 0.75 * resistance, rel=1e-4)
    over(sim, 1.0, 1)
    assert profile(sim, flow) == pytest.approx(0.6, rel=1e-6)  # nothing of it is washed out


def test_a_slurry_weighs_more() -> None:
    """What the lower end of a slot bears more than its upper one; a pack rests on its walls."""
    for c, density in ((0.0, 1000.0), (0.2, 1330.0), (0.6, 1000.0)):
        sim, flow, proppant = slot(20, 1.0)
        proppant.fill(None, c)
        over(sim, 2.0, 10)
        pressure = profile(sim, flow, "pressure")
        assert pressure[0] - pressure[-1] == pytest.approx(density * 9.81, rel=2e-3)


def test_kernels_compute_what_the_plain_loop_does() -> None:
    """A network with a closed channel and a pack, in which what comes finds too little room."""
    rng = np.random.default_rng(5)
    n, m = 12, 20
    ends = np.array([rng.choice(n, 2, replace=False) for _ in range(m)])
    q, along = rng.normal(0.0, 2e-2, m), rng.normal(0.0, 0.1, m)
    delta, room = rng.uniform(1e-3, 5e-3, m), rng.uniform(1e-4, 2e-4, n)
    c = rng.choice([0.0, 0.1, 0.59], n)
    c[3] = 0.6
    packed = c >= 0.6
    carries = rng.random(m) > 0.2
    nodes = np.zeros((n, own.NODE))
    nodes[:, own.N] = c * room
    for column in (own.ROOM_BEFORE, own.ROOM, own.VOLUME):
        nodes[:, column] = room
    state = np.zeros((n, own.STATE))
    state[:, own.C], state[:, own.PACKED] = c, packed
    table = np.zeros((m, kernels.CHANNEL))
    table[:, kernels.APERTURE] = delta
    both = np.concatenate([ends[:, 0], ends[:, 1]])
    order = np.argsort(both, kind="stable")
    begin = np.searchsorted(both[order], np.arange(n + 1))
    channel, side = np.tile(np.arange(m), 2)[order], np.repeat([-1.0, 1.0], m)[order]
    out, takes, dt = np.zeros((m, 2)), np.zeros(n), 0.02
    fluid = np.zeros((n, kernels.STATE))
    fluid[:, kernels.S] = rng.choice([0.3, 1.0], n)
    own.carry(ends, along, carries, q, table, fluid, 2e-3, 1.0, state, out)
    own.give(begin, channel, side, out, dt, nodes, state)
    own.come(begin, channel, side, ends, out, dt, nodes, state)
    for _ in range(4):
        own.take(begin, channel, side, ends, out, dt, 0.6, 1.0, nodes, state, takes)
        state[:, own.TAKES] = takes
    before = nodes[:, own.N].copy()
    own.move(begin, channel, side, ends, out, dt, 1.0, 0.6, -2.5, 0.0, nodes, state)
    held = ~carries | (delta < 2e-3)
    wanted = sub_step(ends, q, delta, along, held, before, room, packed, fluid[:, kernels.S], 0.6, dt, 4)
    assert nodes[:, own.N] == pytest.approx(wanted, rel=1e-12, abs=1e-20)
    assert nodes[:, own.N].sum() == pytest.approx(before.sum(), rel=1e-13)
    assert (nodes[:, own.N] <= 0.6 * room * (1.0 + 1e-12)).all() and state[:, own.TAKES].min() < 1.0
    assert not np.allclose(wanted, before, rtol=0.01) and state[:, own.GIVES].min() < 1.0


def test_what_makes_no_sense_is_refused() -> None:
    sim, flow, proppant = flowing(5)
    bring(sim, proppant, 0.1)
    for act, message in (
        (lambda: bring(sim, proppant, 0.7), "at most that of a pack, 0.6"),
        (lambda: bring(sim, proppant, -0.1), "negative"), (lambda: bring(sim, proppant, "no such"), "no table"),
        (lambda: proppant.fill(None, 0.61), "between 0 and that of a pack"),
        (lambda: proppant.fill(at(sim, x=0.2), 0.1), "not at the end of a channel"),
        (lambda: proppant.adjust({"viscosity_power": -4.0}), "viscosity_power"),
        (lambda: proppant.adjust({"proppant_concentration_limit": 0.8}), "proppant_concentration_limit"),
        (lambda: proppant.adjust({"proppant_size": 0.0}), "proppant_size"),
        (lambda: proppant.adjust({"proppant_concentration_limit": 0.05}), "concentration of a pack, 0.05"),
        (lambda: proppant.assign(None, {**SAND, "proppant_size": 1e-3}), "all channels have the same proppant"),
    ):  # fmt: skip
        with pytest.raises(CommandError, match=message):
            act()


def test_what_conditions_bring_fits_or_is_refused() -> None:
    """Room, too little room, a pack; a part of what is there leaves, all of it at most, and none of a pack."""
    nodes, state = np.zeros((7, own.NODE)), np.zeros((7, own.STATE))
    nodes[:, own.ROOM] = 1.0
    nodes[:, own.N] = 0.0, 0.3, 0.2, 0.4, 0.3, 0.2, 0.2
    nodes[:, own.SOURCE] = 0.2, 0.5, 0.1, -0.25, -2.0, -0.5, 0.0
    state[[2, 5], own.PACKED] = 1.0
    assert own.pour(1.0, 0.6, nodes, state) == pytest.approx(0.2 + 0.1, rel=1e-14)
    assert nodes[:, own.N] == pytest.approx([0.2, 0.6, 0.2, 0.3, 0.0, 0.2, 0.2], abs=1e-15)
    assert nodes[:, own.CAME] == pytest.approx([0.2, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0], abs=1e-15)
    assert nodes[:, own.LEFT] == pytest.approx([0.0, 0.0, 0.0, 0.1, 0.3, 0.0, 0.0], abs=1e-15)


def test_what_a_node_is_by_its_sand_and_its_volume() -> None:
    """Room at a quarter of a step; a pack begins at its limit, ends a hundredth below, and is pressed beyond it."""
    nodes, state = np.zeros((6, own.NODE)), np.zeros((6, own.STATE))
    nodes[:, own.ROOM_BEFORE], nodes[:, own.ROOM], nodes[:, own.VOLUME] = 2.0, 1.0, 2.0
    nodes[:, own.N] = 0.35, 0.0, 1.04475, 1.04475, 1.4, 1.1
    state[3, own.PACKED] = 1.0
    own.settle(0.25, 0.6, -2.5, 1e6, nodes, state)
    c = [0.2, 0.0, 0.597, 0.597, 0.7, 0.6]
    assert state[:, own.C] == pytest.approx(c, rel=1e-14)
    assert state[:, own.PACKED].tolist() == [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    assert state[:, own.PUSHES] == pytest.approx([0.0, 0.0, 0.0, 0.0, 1e6 / 7.0, 0.0], rel=1e-12)
    thick = [1.5**2.5, 1.0, 200.0**2.5, 200.0**2.5, 1e3**2.5, 1e3**2.5]
    assert state[:, own.THICK] == pytest.approx(thick, rel=1e-9)


def test_what_sand_does_to_a_channel() -> None:
    """The parts of a channel one behind the other: slurry, at most as stiff as a pack, and a pack, by its permeability
    or by its factor; the weight of what does not rest on walls."""
    state = np.zeros((3, own.STATE))
    state[:, own.C], state[:, own.THICK], state[:, own.PACKED] = (0.2, 0.6, 0.5), (3.0, 9.0, 1e4), (0.0, 1.0, 0.0)
    edges, ends = np.zeros((2, kernels.CHANNEL)), np.array([[0, 1], [2, 0]])
    edges[:, kernels.APERTURE], edges[:, kernels.CONDUCT] = 1e-3, 5.0
    own.thicken(1, ends, state, 0.0, 1e-9, 1.5, edges)
    pack = 1e-6 / 12e-9
    assert edges[:, kernels.CONDUCT] == pytest.approx([10.0 / (3.0 + pack), 10.0 / (pack + 3.0)], rel=1e-14)
    assert edges[:, kernels.WEIGHT] == pytest.approx([1.0 + 0.75 * 0.2, 1.0 + 0.75 * 0.7], rel=1e-14)
    edges[:, kernels.CONDUCT] = 5.0
    own.thicken(1, ends, state, 0.0, 1e-6, 1.5, edges)  # a pack that is no obstacle
    assert edges[:, kernels.CONDUCT] == pytest.approx([5.0, 5.0])
    triangle, around = np.zeros((3, kernels.CHANNEL)), np.array([[0, 1], [1, 2], [2, 0]])
    triangle[:, kernels.APERTURE], triangle[:, kernels.CONDUCT] = 1e-3, (5.0, 7.0, -1.0)
    own.thicken(3, around, state, 0.5, 1e-9, 0.0, triangle)
    assert triangle[:, kernels.CONDUCT] == pytest.approx(np.array([5.0, 7.0, -1.0]) * 3.0 / (3.0 + 8.0 + 8.0))
    assert (triangle[:, kernels.WEIGHT] == 1.0).all()


def test_the_shortest_time_in_which_a_node_loses_its_slurry() -> None:
    """What flows out of it and what settles; of a node that is nearly empty a tenth of its volume counts."""
    begin, channel, side = np.array([0, 1, 3, 4]), np.array([0, 0, 1, 1]), np.array([-1.0, 1.0, -1.0, 1.0])
    q, channels, fluid = np.array([2.0, 3.0]), np.zeros((2, kernels.CHANNEL)), np.zeros((3, kernels.NODE))
    channels[:, kernels.APERTURE] = 0.5, 0.25
    nodes = np.zeros((3, own.NODE))
    nodes[:, own.ROOM] = 10.0, 0.1, 10.0
    for fall, volume, shortest in (
        ([0.0, 0.0], 0.0, 0.1 / 3.0),
        ([0.0, 0.0], 2.0, 0.2 / 3.0),
        ([-1.0, 1.0], 0.0, 0.1 / (3.0 + 4.0 * (0.5 + 0.25))),
    ):
        fluid[:, kernels.V] = volume
        found = own.fastest(begin, channel, side, q, channels, np.array(fall), 4.0, fluid, nodes)
        assert found == pytest.approx(shortest, rel=1e-14)
    assert own.fastest(begin, channel, side, 0.0 * q, channels, np.zeros(2), 4.0, fluid, nodes) == np.inf

"""Fluid in channels of blocks that stand still: kernels against the plain loop, numbers by hand, closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem import changes, creep
from hpcdem.physics.flow import kernels, reference
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.network import Network, around, at_nodes
from hpcdem.pre.mesh import structured
from tests.blocks.support import model, rectangle, shaken
from tests.flow import exact
from tests.flow.support import WATER, at, hold, inner, line, run, standing, until


def test_faces_around_points_are_those_of_all_faces_that_a_search_finds() -> None:
    mesh = rectangle(3, 2, 3.0, 2.0, kind="mixed")
    points = np.array([0, 3, 4, 7])
    faces = np.flatnonzero(np.arange(4 * len(mesh.cells)) % 4 < np.repeat((mesh.cells >= 0).sum(axis=1), 4))
    inside = np.isin(mesh.face_points(faces), points)
    whole, touched = around(mesh, points)
    assert whole.tolist() == faces[inside.all(axis=1)].tolist() and len(whole) > 3
    assert touched.tolist() == faces[inside.any(axis=1)].tolist()


def test_channels_of_a_node_stand_in_their_order() -> None:
    mesh = rectangle(3, 2, 3.0, 2.0)
    channels = np.sort(inner(mesh))
    network = Network.of(mesh, channels)
    assert np.array_equal(network.nodes, np.unique(network.ends)) and network.there.sum() == len(network.nodes)
    rows = np.searchsorted(network.nodes, network.ends)
    begin, channel, side = at_nodes(rows, len(network.nodes))
    assert begin[-1] == 2 * len(channels)
    for node in range(len(network.nodes)):
        mine = channel[begin[node] : begin[node + 1]]
        assert np.array_equal(mine, np.flatnonzero((rows == node).any(axis=1)))
        assert np.array_equal(side[begin[node] : begin[node + 1]], np.where(rows[mine, 0] == node, -1.0, 1.0))


def test_kernels_do_what_the_plain_loop_does() -> None:
    """Wet, half wet and dry nodes, gravity, one with a pressure."""
    mesh = shaken(rectangle(5, 4, 1.0, 0.8), 0.2)
    sim, flow = standing(mesh, fluid_bulk=1e5)
    sim.gravity(1.3, -9.81)
    sim.close_model()
    rng = np.random.default_rng(2)
    n = len(flow.number)
    flow.nodes[:, kernels.W] = flow.nodes[:, kernels.V] * rng.choice([0.0, 0.4, 0.9, 1.0, 1.3], n)
    flow._find_state(slice(None))
    hold(flow, flow.number[3:4], 5e4)
    sim.close_model()
    w, energy = flow.nodes[:, kernels.W].copy(), -1000.0 * (mesh.points[flow.number] @ np.array([1.3, -9.81]))
    way = mesh.points[flow.network.ends[:, 1]] - mesh.points[flow.network.ends[:, 0]]
    ends, length = np.searchsorted(flow.number, flow.network.ends), np.hypot(way[:, 0], way[:, 1])
    links = reference.straight(np.full(len(ends), 1e-5), length, 1e-3)
    for _ in range(3):
        sim.step()
        w, p, s = reference.sub_step(ends, *links, 1e5, energy, w, flow.dt, {3: 5e4})
        assert flow.nodes[:, kernels.W] == pytest.approx(w, rel=1e-12, abs=1e-18)
        assert flow.state[:n, kernels.P] == pytest.approx(p, rel=1e-9, abs=1e-4)
        assert flow.state[:n, kernels.S] == pytest.approx(s, rel=1e-12)


def test_one_pass_over_channels_has_the_bits_of_two() -> None:
    """`sub_step` against flows and sums of nodes by themselves, with copies of other ranks' nodes, leak-off, wet and
    dry nodes and all conditions."""
    rng = np.random.default_rng(5)
    n, copies, m, dt, bulk = 40, 6, 150, 1e-3, 1e5
    first = rng.integers(0, n + copies, m)
    ends = np.column_stack([first, (first + rng.integers(1, n, m)) % (n + copies)])
    channels = np.column_stack([rng.uniform(1e-5, 1e-4, m), rng.uniform(-2e-9, 1e-8, m), rng.uniform(1e-4, 1e-3, m),
                                rng.uniform(1.0, 2.0, m)])  # fmt: skip
    laws = np.zeros((2, kernels.LAW))
    laws[:, kernels.LEAK], laws[:, kernels.FRONT] = (1e-8, 1e-6), (0.0, 1.0)
    since = np.where(rng.random(m) < 0.7, rng.uniform(0.0, 1.0, m), math.inf)
    condition, table = rng.integers(0, 4, n), np.array([[does, 3e3 * does] for does in range(4)], np.float64)
    table[kernels.RATE, 1] = -0.3
    begin, channel, side = at_nodes(ends, n)
    held = np.zeros((n, kernels.NODE))
    held[:, kernels.V] = np.bincount(ends.reshape(-1), np.repeat(channels[:, kernels.HALF], 2), n + copies)[:n] + 1e-4
    held[:, kernels.W] = held[:, kernels.V] * rng.choice([0.0, 0.4, 1.0, 1.2], n)
    start = np.column_stack(
        [rng.choice([0.0, 1e4, 2e4], n + copies), rng.random(n + copies), rng.normal(0.0, 1e3, n + copies)]
    )
    law, found = rng.integers(0, 2, m), []
    for leaks in (False, True):
        along = law, laws, since, leaks, 2.0, 2.0 + dt
        for one_pass in (True, False):
            nodes, state, q, lost = held.copy(), start.copy(), np.zeros(m), np.zeros(m)
            told = dt, condition, table, bulk, nodes, state
            if one_pass:
                kernels.sub_step(ends, *along, channels, q, lost, *np.full((2, n + copies), 7.0), *told)
            else:
                kernels.flows(1, ends, *along, channels, state, q, lost)
                kernels.fill(2, begin, channel, side, q, leaks, lost, *told)
            found.append(np.concatenate([nodes.reshape(-1), state.reshape(-1), q, lost]))
    assert np.array_equal(found[0], found[1]) and np.array_equal(found[2], found[3])
    assert not np.array_equal(found[0], found[2])


def test_one_channel_by_hand() -> None:
    """Two nodes, 1 m apart, 0.1 mm: 1e-12 / 12e-3 = 8.333e-11 m2/(Pa s), times 1 kPa."""
    mesh = rectangle(1, 1, 1.0, 1.0)
    sim, flow = standing(mesh, aperature_initial=1e-4)
    ends = flow.network.ends[0]
    length = math.sqrt(2.0)
    hold(flow, ends[:1], 1000.0)
    hold(flow, ends[1:], 0.0)
    run(sim, 2)
    q = 1e-12 / (12.0 * 1e-3 * length) * 1000.0
    assert flow.values("flow-channel", "flow_rate") == pytest.approx(q, rel=1e-8)
    assert flow.values("flow-channel", "velocity") == pytest.approx(q / 1e-4, rel=1e-8)
    assert flow.values("flow-channel", "aperture") == pytest.approx(1e-4)
    assert flow.values("flow-channel", "pressure") == pytest.approx(500.0, rel=1e-6)
    inflow = dict(zip(flow.numbers("flow-node").tolist(), flow.values("flow-node", "inflow")))
    assert [inflow[int(e)] for e in ends] == pytest.approx([q, -q], rel=1e-6)
    assert flow.values("flow-node", "volume") == pytest.approx(0.5 * 1e-4 * length)


def test_a_column_of_water_is_hydrostatic() -> None:
    """Closed below, its surface is at the upper end; the part above the surface is dry."""
    mesh = rectangle(2, 20, 0.2, 2.0)
    edges = mesh.edges()
    upright = edges.inner & (np.abs(mesh.points[edges.points][:, :, 0] - 0.1) < 1e-9).all(axis=1)
    sim, flow = standing(mesh, edges.faces[upright, 0], fluid_bulk=1e6)
    sim.gravity(0.0, -9.81)
    top = at(sim, 0.1, 2.0)
    flow.fill(None, saturation=1.0)
    flow.prescribe(top, kernels.SURFACE, 2.5)
    run(sim, 9000)
    y = mesh.points[flow.numbers("flow-node"), 1]
    assert flow.values("flow-node", "pressure") == pytest.approx(1000.0 * 9.81 * (2.5 - y), rel=1e-4)
    assert np.abs(flow.values("flow-channel", "flow_rate")).max() < 1e-12
    flow.prescribe(top, kernels.SURFACE, 1.95)  # below the upper end: air
    run(sim, 6000)
    pressure = flow.values("flow-node", "pressure")
    assert pressure == pytest.approx(1000.0 * 9.81 * (2.0 - y), abs=1.0)  # full to the brim, no more
    assert flow.account()["relative"] < 1e-12


def test_a_pulse_runs_into_a_closed_channel() -> None:
    """9.11: L 10 m, 0.1 mm, D = K delta^2 / (12 mu) = 1833.3 m2/s, 100 channels; 1 % of p_A."""
    sim, flow = line(100, 10.0, aperature_initial=1e-4)
    flow.fill(None, saturation=1.0)
    hold(flow, at(sim, 0.0, 0.0), 1e6)
    ends = np.array([at(sim, 5.0, 0.0)[0], at(sim, 10.0, 0.0)[0]])
    rate = 2.2e9 * 1e-8 / (12.0 * 1e-3) / 100.0
    for t, middle, end in ((0.05, 0.11385, 0.00313), (0.25, 0.51299, 0.31455), (0.5, 0.73781, 0.62922)):
        until(sim, t / rate)
        found = flow.values("flow-node", "pressure", ends) / 1e6
        assert found == pytest.approx([exact.transient(0.5, t), exact.transient(0.0, t)], abs=0.001)
        assert found == pytest.approx([middle, end], abs=0.001)
    account = flow.account()
    assert account["relative"] < 1e-12 and account["given"] > 1e-3


def _lattice() -> float:
    """Measured over predicted permeability of a lattice of edges of 0.25 m, along x."""
    mesh = structured.equilateral((0.0, 0.0), 4.0, 4.0 * math.sqrt(0.75), 0.25)
    sim, flow = standing(mesh, fluid_bulk=1e9)
    flow.fill(None, saturation=1.0)
    first, last = at(sim, 0.0), at(sim, 4.0)
    hold(flow, first, 1e6)
    hold(flow, last, 0.0)
    run(sim, 15_000)
    nodes, inflow = flow.numbers("flow-node"), flow.values("flow-node", "inflow")
    into, out = inflow[np.isin(nodes, first)].sum(), inflow[np.isin(nodes, last)].sum()
    assert into == pytest.approx(-out, rel=1e-6)
    return float(into * 1e-3 * 4.0 / (1e6 * np.ptp(mesh.points[:, 1])) / exact.lattice(1e-5, 0.25))


def test_a_lattice_has_the_permeability_of_its_rule() -> None:
    """Rows of edges along the flow carry two thirds of it. On both surfaces there is no channel, where a lattice that
    goes on would have half of one: 1 of 16 rows is missing."""
    assert _lattice() == pytest.approx(1.0 - 2.0 / 3.0 / 16.0, rel=1e-6)
    assert exact.lattice(1e-5, 0.1) == pytest.approx(1.443e-15, rel=1e-3)


@pytest.mark.slow
def test_water_finds_its_level_in_a_dam() -> None:
    """9.11, Dupuit: 16 m between levels of 8 and 4 m. Levels within 4 % up to x = 12 m (the exact ones lie above
    Dupuit's, as there is a seepage face), discharge within 3 % of Charny's."""
    size = 0.5
    mesh = structured.equilateral((0.0, 0.0), 16.0, 9.0, size)
    sim, flow = standing(mesh, fluid_bulk=3e4)  # as soft as that, it is soon steady: pressure knows no density
    sim.gravity(0.0, -9.81)
    points = mesh.points
    left, right = np.flatnonzero(points[:, 0] < 1e-9), np.flatnonzero(points[:, 0] > 16.0 - 1e-9)
    flow.prescribe(left, kernels.SURFACE, 8.0)
    flow.prescribe(right, kernels.SURFACE, 4.0)
    flow.fill(np.flatnonzero(points[:, 1] < 8.0 - 0.25 * points[:, 0]), pressure=2e4)
    run(sim, 25_000)
    nodes = flow.numbers("flow-node")
    pressure, inflow = flow.values("flow-node", "pressure"), flow.values("flow-node", "inflow")
    head = points[nodes, 1] + pressure / 9810.0
    for x in (4.0, 8.0, 12.0):
        near = (np.abs(points[nodes, 0] - x) < 0.51 * size) & (pressure > 0.0)
        assert head[near].max() == pytest.approx(exact.dupuit(x, 8.0, 4.0, 16.0), rel=0.04)
    conductivity = exact.lattice(1e-5, size) * 1000.0 * 9.81 / 1e-3
    wanted = exact.charny(conductivity, 8.0, 4.0, 16.0)
    into, out = inflow[np.isin(nodes, left)].sum(), inflow[np.isin(nodes, right)].sum()
    assert [into, -out] == pytest.approx([wanted, wanted], rel=0.03)
    assert (inflow[np.isin(nodes, right)] <= 0.0).all()
    above = points[nodes[np.isin(nodes, left)], 1] > 8.0
    assert above.any() and (inflow[np.isin(nodes, left)][above] <= 0.0).all()  # none comes in above the water
    assert flow.account()["relative"] < 1e-11


def test_leak_off_after_carter() -> None:
    """A crack held at one pressure: both walls take up 4 C L sqrt(t), whatever the length of the steps."""
    mesh = rectangle(4, 2, 0.4, 0.2)
    sim = model(mesh)
    edges = mesh.edges()
    on = edges.inner & (np.abs(mesh.points[edges.points][:, :, 1] - 0.1) < 1e-9).all(axis=1)
    joints = edges.faces[on, 0]
    matrix = {"matrix_permeability": 1e-15, "matrix_porosity": 0.2, "matrix_porosity_compressibility": 1e-9}
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, "leak_off": 1.0, "matrix_pore_pressure": 2e5, **matrix})
    sim.parts(mechanical=False)
    sim.flow_clock(dt=1e-7)
    flow.fill(None, pressure=1e6)
    hold(flow, flow.numbers("flow-node"), 1e6)
    run(sim, 5)
    assert flow.account()["leaked"] == 0.0  # joints are whole
    changes.crack(sim, joints)
    start = flow.time
    run(sim, 300)
    wanted = exact.carter(8e5, flow.time - start, 0.4, (1e-15, 0.2, 1e-9), 2.2e9, 1e-3)
    assert flow.account()["leaked"] == pytest.approx(wanted, rel=1e-9)
    assert flow.account()["relative"] < 1e-12


@pytest.mark.parametrize("suction", [0.0, 6e5])
def test_leak_off_fills_empty_pores(suction: float) -> None:
    """Rock that is not saturated takes up what a sharp front does, also by suction."""
    sim, flow = line(4, 0.4, leak_off=1.0, matrix_permeability=1e-15, matrix_porosity=0.2, matrix_saturation=0.3,
                     matrix_pore_pressure=-suction)  # fmt: skip
    changes.crack(sim, flow.network.channels)
    sim.flow_clock(dt=1e-7)
    flow.fill(None, pressure=1e6)
    hold(flow, flow.numbers("flow-node"), 1e6)
    run(sim, 300)
    wanted = exact.front(1e6 + suction, flow.time, 0.4, (1e-15, 0.2, 0.3), 1e-3)
    account = flow.account()
    assert account["leaked"] == pytest.approx(wanted, rel=1e-9) and account["relative"] < 1e-12


# ---- conditions ---------------------------------------------------------------------------------------------------


def test_a_rate_fills_a_channel_and_stops_where_there_is_nothing_to_take() -> None:
    sim, flow = line(4, 1.0)
    node = at(sim, 0.0, 0.0)
    flow.prescribe(node, kernels.RATE, 1e-6)
    run(sim, 50)
    assert flow.account()["given"] == pytest.approx(1e-6 * flow.time, rel=1e-12)
    flow.prescribe(node, kernels.RATE, -1.0)
    run(sim, 2000)
    account = flow.account()
    assert flow.nodes[:, kernels.W].min() >= 0.0 and account["relative"] < 1e-12
    assert account["stored"] < 0.2e-6 * flow.time
    flow.remove_conditions(node)
    given = flow.account()["given"]
    run(sim, 10)
    assert flow.account()["given"] == given


def test_tables_are_followed_in_flow_time() -> None:
    sim, flow = line(4, 1.0)
    sim.table("p", [(0.0, 0.0), (1.0, 1e6)])
    hold(flow, at(sim, 0.0, 0.0), "p")
    sim.flow_clock(dt=1e-9)
    run(sim, 100)
    first = flow.values("flow-node", "pressure", at(sim, 0.0, 0.0))[0]
    assert first == pytest.approx(1e6 * flow.time, rel=1e-5) and flow.time == pytest.approx(1e-7)
    with pytest.raises(CommandError, match="table 'p' is used"):
        sim.remove_table("p")


@pytest.mark.parametrize(
    "name, value, factor",
    [("viscosity", 2e-6, 0.5), ("aperature_initial", 2e-5, 8.0), ("fluid_density", 2000.0, 0.5),
     ("aperature_minumum", 3e-5, 27.0), ("aperature_maximum", 5e-6, 0.125)],
)  # fmt: skip
def test_each_property_alone_changes_the_flow(name: str, value: float, factor: float) -> None:
    """Steady flow between two pressures: delta^3 / (nu rho)."""

    def steady(**changed: float) -> float:
        sim, flow = line(2, 1.0, **changed)
        flow.fill(None, pressure=1e5)
        hold(flow, at(sim, 0.0, 0.0), 2e5)
        hold(flow, at(sim, 1.0, 0.0), 0.0)
        run(sim, 200)
        return float(flow.values("flow-channel", "flow_rate")[0])

    assert steady(**{name: value}) == pytest.approx(factor * steady(), rel=1e-6)


def test_the_bulk_modulus_says_how_fast() -> None:
    assert line(2, 1.0, fluid_bulk=1.1e9)[1].rows[0][1] == 1.1e9
    steps = []
    for bulk in (2.2e9, 1.1e9):
        sim, flow = line(2, 1.0, fluid_bulk=bulk)
        sim.close_model()
        steps.append(flow.dt)
        assert flow.dt == pytest.approx(0.5 * 1e-5 * 0.25 / (bulk * 1e-15 / (12e-3 * 0.5)), rel=1e-12)
    assert steps[1] == pytest.approx(2.0 * steps[0])


@pytest.mark.parametrize(
    "name, value",
    [("matrix_permeability", 4e-15), ("matrix_porosity", 0.4), ("matrix_porosity_compressibility", 4e-9),
     ("matrix_pore_pressure", 5e5), ("matrix_pore_pressure", -5e5), ("leak_off", 0.0)],
)  # fmt: skip
def test_each_property_of_leak_off_changes_it(name: str, value: float) -> None:
    matrix = {"matrix_permeability": 1e-15, "matrix_porosity": 0.2, "matrix_porosity_compressibility": 1e-9}

    def leaked(**changed: float) -> float:
        given = {"leak_off": 1.0, **matrix, "matrix_pore_pressure": 0.0, **changed}
        if not given["leak_off"]:
            given = {}
        sim, flow = line(4, 1.0, **given)
        changes.crack(sim, flow.network.channels)
        sim.flow_clock(dt=1e-8)
        flow.fill(None, pressure=1e6)
        hold(flow, flow.numbers("flow-node"), 1e6)
        run(sim, 20)
        return flow.account()["leaked"]

    assert leaked() > 0.0 and leaked(**{name: value}) != pytest.approx(leaked(), rel=1e-3)


# ---- what makes no sense ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "changed, text",
    [
        ({"aperature_initial": -1e-5}, "aperature_initial must be >= 0"),
        ({"aperature_minumum": 0.0}, "aperature_minumum must be > 0"),
        ({"aperature_minumum": 1e-3, "aperature_maximum": 1e-4}, "must not be above aperature_maximum"),
        ({"fluid_bulk": 0.0}, "fluid_bulk must be > 0"), ({"fluid_bulk": math.inf}, "fluid_bulk must be finite"),
        ({"leak_off": 1.0}, "leak_off needs matrix_permeability"),
        ({"matrix_permeability": 1e-15}, "matrix_permeability needs leak_off"),
        ({"matrix_saturation": 0.5}, "matrix_saturation needs leak_off"),
        ({"leak_off": 1.0, "matrix_permeability": 1e-15, "matrix_porosity": 0.2, "matrix_saturation": 0.5,
          "matrix_porosity_compressibility": 1e-9}, "has no effect if leak-off fills empty pores"),
        ({"leak_off": 1.0, "matrix_permeability": 1e-15, "matrix_porosity": 0.2}, "needs matrix_porosity_compress"),
        ({"viscosity": None}, "needs viscosity"), ({"colour": 1.0}, "has no property colour"),
    ],
)  # fmt: skip
def test_properties_that_make_no_sense_are_refused(changed: dict, text: str) -> None:
    given = {name: value for name, value in {**WATER, **changed}.items() if value is not None}
    sim = model(rectangle(2, 2, 1.0, 1.0))
    with pytest.raises(CommandError, match=text):
        Flow.of(sim).assign(None, given)


def test_conditions_that_make_no_sense_are_refused() -> None:
    sim, flow = line(4, 1.0)
    off = at(sim, 0.0, 0.25)
    for nodes, does, value, text in (
        (off, kernels.PRESSURE, 1.0, "not at the end of a channel"),
        (None, kernels.PRESSURE, -1.0, "must not be negative"),
        (None, kernels.RATE, math.nan, "must be finite"),
        (None, kernels.PRESSURE, "p", "there is no table 'p'"),
    ):
        with pytest.raises(CommandError, match=text):
            flow.prescribe(nodes, does, value)
    with pytest.raises(CommandError, match="all channels have the same fluid, but viscosity"):
        flow.assign(flow.network.channels[:1], {**WATER, "viscosity": 3e-6})
    with pytest.raises(CommandError, match="give either a pressure"):
        flow.fill(None, pressure=1.0, saturation=1.0)
    with pytest.raises(CommandError, match="from 0 to 1"):
        flow.fill(None, saturation=1.5)
    flow.prescribe(None, kernels.SURFACE, 1.0)
    with pytest.raises(CommandError, match="flow-surface needs gravity"):
        sim.step()


def test_what_cannot_act_is_refused() -> None:
    sim = model(rectangle(2, 2, 1.0, 1.0))
    for changed in ({"one_way": True}, {"mechanical": False}):
        sim.parts(**changed)
        with pytest.raises(CommandError, match=r"no joint has a hydraulic model|nothing to compute"):
            sim.step()
        sim.parts(mechanical=True, one_way=False)
    sim.flow_clock(every=2)
    with pytest.raises(CommandError, match="sub-step of flow"):
        sim.step()
    sim.flow_clock(every=1)
    flow = Flow.of(sim)
    with pytest.raises(CommandError, match="no channels yet"):
        flow.fill(None, saturation=1.0)
    flow.assign(None, WATER)
    sim.option(dynamic=False)
    with pytest.raises(CommandError, match="model time-step hydraulic"):
        sim.step()
    sim.parts(mechanical=False)
    with pytest.raises(CommandError, match="without mechanics, flow and heat need a dynamic run"):
        sim.step()
    sim.option(dynamic=True)
    Bolts.of(sim)
    with pytest.raises(CommandError, match="bolts need moving blocks"):
        sim.step()
    sim.surface_loads.remove(Bolts.of(sim))
    creep.switch(sim, True)
    with pytest.raises(CommandError, match="creep needs moving blocks"):
        sim.step()


def test_pressure_on_faces_pushes_with_its_resultant_and_its_moment() -> None:
    """An edge and a triangle with a linear pressure: force and moment of what their corners get are its integrals."""
    state = np.zeros((3, kernels.STATE))
    state[:, kernels.P] = 2.0, 5.0, 11.0
    x, applied = np.array([1.0, 2.0, 4.0, 6.0]), np.zeros(4)
    at, none = np.array([[0, 2]]), np.empty((0, 4))
    kernels.loads(at, at, np.array([[0, 1]]), none, none, x, state, kernels.P, applied)
    normal = np.array([-4.0, 3.0])  # to the left of the edge, as long as it
    assert applied[:2] == pytest.approx((2.0 * 2.0 + 5.0) / 6.0 * normal)
    assert applied[2:] == pytest.approx((2.0 + 2.0 * 5.0) / 6.0 * normal)
    points = np.array([[0.1, 0.2, 0.3], [1.5, 0.1, 0.4], [0.3, 1.2, 0.9]])
    twice = np.cross(points[1] - points[0], points[2] - points[0])
    x, applied, at = points.reshape(-1).copy(), np.zeros(9), np.array([[0, 3, 6]])
    kernels.loads(at, at, np.array([[0, 1, 2]]), none, none, x, state, kernels.P, applied)
    p, forces = state[:, kernels.P], applied.reshape(3, 3)
    for k in range(3):
        assert forces[k] == pytest.approx(-(p.sum() + p[k]) / 24.0 * twice)
    assert forces.sum(axis=0) == pytest.approx(-0.5 * p.mean() * twice)

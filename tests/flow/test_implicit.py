"""Implicit steps of flow: derivatives against differences, closed forms, equilibrium with blocks, refusals."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem import changes, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.network import SHAPES, normals
from hpcdem.physics.flow.tangent import Tangent
from hpcdem.physics.flow.wells import PRESSURE, RATE, SHUT
from hpcdem.pre.mesh import structured
from tests.blocks.support import JOINT, ROCK, jointed, model, near, rectangle, shaken
from tests.flow import exact
from tests.flow.support import WATER, at, hold, inner, line, over, standing

# ---- flow alone ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dim", [2, 3])
def test_slip_that_is_rounding_opens_nothing_along_the_normal(dim: int) -> None:
    """The aperture of a joint that opens along its normal grows with that, whatever the slip that should be nothing."""
    law = np.zeros((1, kernels.LAW))
    law[0, [kernels.LEAST, kernels.MOST, kernels.DILATE, kernels.GAIN]] = -1.0, 1.0, 0.3, 1e-3
    facing, rng, worst = np.array(SHAPES[dim].facing), np.random.default_rng(1), 0.0
    for _ in range(300):
        near = rng.uniform(-5.0, 5.0, (dim, dim))
        normal = normals(near[None])[0]
        normal /= np.linalg.norm(normal)
        x = np.concatenate([near, near[facing] + 1e-4 * rng.random() * normal])
        fluid = SimpleNamespace(laws=law, law=np.zeros(len(SHAPES[dim].links), int), dim=dim, m=1,
                                at=np.arange(2 * dim)[None])  # fmt: skip
        opens = Tangent(cast(Any, fluid))._opens(x, np.array([1e-5])).reshape(2 * dim, dim)
        worst = max(worst, abs(opens[dim:].sum(axis=0) @ normal - 1.0))
    assert worst < 1e-9


@pytest.mark.parametrize("viscosity", [1e-6, 1e-9])
def test_derivatives_are_those_of_differences(viscosity: float) -> None:
    """The residual of nodes that are full, half full and nearly dry, with gravity and leak-off, by all variables and
    positions; and forces on faces by the variables. Of the thin fluid flow is turbulent."""
    mesh = shaken(rectangle(4, 3, 0.4, 0.3), 0.2)
    sim = jointed(model(mesh))
    sim.option(dynamic=False, large_strain=False, collision=False)
    sim.gravity(2.0, -9.81)
    flow, joints = Flow.of(sim), inner(mesh)
    matrix = {"matrix_permeability": 1e-13, "matrix_porosity": 0.2, "matrix_porosity_compressibility": 1e-9}
    flow.assign(
        joints,
        {**WATER, "fluid_bulk": 1e7, "aperature_initial": 1e-4, "shear_dilation": 30.0, "leak_off": 1.0,
         "viscosity": viscosity, "turbulence": 1.0, **matrix},
    )  # fmt: skip
    flow.adjust(joints[4:7], {"matrix_porosity_compressibility": 0.0, "matrix_saturation": 0.5})
    changes.crack(sim, joints[:4])
    flow.prescribe(at(sim, 0.0), kernels.SURFACE, 0.1)
    flow.prescribe(np.array([7]), kernels.RATE, -1e-6)
    flow.drill("full", np.array([9, 10, 11]))
    flow.drill("dry", np.array([13, 14]))
    flow.stage("full", RATE, 1e-3, math.inf, 1e9)
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    rng = np.random.default_rng(3)
    with Coupled(sim, 1.0) as run:
        flow.since[flow.network.channels[:9]] = -1e-4
        fluid, count = run.fluid, len(run.x)
        fluid.fluid = rng.uniform(0.0, 1e-5, fluid.n)
        step, _ = fluid.begin(1e-3, run.x)
        u = rng.choice([0.4, 0.05, -0.3, -0.9], fluid.n) * rng.uniform(0.8, 1.2, fluid.n)
        for name, value in (("full", 1e3 / fluid.p0), ("dry", -0.4)):  # full: the highest of its nodes has no pressure
            u[np.searchsorted(fluid.numbers, flow.well(name).points[0])] = value
        x = run.x + rng.uniform(-1e-6, 1e-6, run.x.shape)
        equilibrium.place_corners(sim, x)
        now = fluid.balance(step, u, x)
        assert now.slow is not None and ((now.slow < 1.0).mean() > 0.5) == (viscosity < 1e-6)
        matrix_of = np.zeros((2 * (count + fluid.n),) * 2)
        for piece in Tangent(fluid).pieces(step, now, u, x, count):
            for node, part in zip(piece.node, piece.stiffness):
                rows = np.column_stack([2 * node, 2 * node + 1]).reshape(-1)
                np.add.at(matrix_of, np.ix_(rows, rows), part)  # both ends of a channel may count as one
        residual = slice(2 * count, None, 2)
        assert now.held.any() and not now.held.all() and (now.lost > 0.0).any()
        for i in range(fluid.n):
            h = 1e-6
            ends = [fluid.balance(step, u + s * h * np.eye(fluid.n)[i], x) for s in (1.0, -1.0)]
            wanted = (ends[0].residual - ends[1].residual) / (2.0 * h)
            found = np.where(step.known | fluid.tied, 0.0, matrix_of[residual, 2 * (count + i)])
            assert found == pytest.approx(wanted, abs=2e-6 * np.abs(wanted).max())
        for i in rng.choice(count, 20, replace=False):
            for axis in range(2):
                way = np.zeros_like(x)
                way[i, axis] = 1e-9
                ends = [fluid.balance(step, u, x + s * way) for s in (1.0, -1.0)]
                wanted = (ends[0].residual - ends[1].residual) / 2e-9
                found = matrix_of[residual, 2 * i + axis]
                assert found == pytest.approx(wanted, abs=2e-2 * np.abs(matrix_of[residual]).max())
        forces = []
        for s in (1.0, -1.0):
            fluid.show(fluid.state_of(u + s * 1e-3 * (u > 0.0), x))
            forces.append(equilibrium.unbalanced(sim, run.nodes, run.of_blocks, x)[0])
        wanted = -(forces[0] - forces[1]).reshape(-1) / 2e-3
        found = matrix_of[: 2 * count, residual] @ (u > 0.0)
        assert found == pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max()) and np.abs(wanted).max() > 0.0


def test_a_pulse_runs_into_a_closed_channel() -> None:
    """9.11 by steps 60 times as long as the explicit ones: of first order in the time step."""
    rate = 2.2e9 * 1e-8 / (12.0 * 1e-3) / 100.0
    wanted = [exact.transient(0.5, 0.25), exact.transient(0.0, 0.25)]
    errors = []
    for steps in (50, 100):
        sim, flow = line(100, 10.0, aperature_initial=1e-4)
        flow.fill(None, saturation=1.0)
        hold(flow, at(sim, 0.0, 0.0), 1e6)
        over(sim, 0.25 / rate, steps)
        ends = np.array([at(sim, 5.0, 0.0)[0], at(sim, 10.0, 0.0)[0]])
        errors.append(np.abs(flow.values("flow-node", "pressure", ends) / 1e6 - wanted).max())
        assert flow.account()["relative"] < 1e-12
    assert errors[1] < 0.003 and errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)


def test_long_steps_do_not_mind_an_incompressible_fluid() -> None:
    """A rate into a line with an outlet: what comes in goes out, at any bulk modulus."""
    sim, flow = line(10, 1.0, fluid_bulk=1e15)
    flow.fill(None, saturation=1.0)
    flow.prescribe(at(sim, 0.0, 0.0), kernels.RATE, 1e-9)
    hold(flow, at(sim, 1.0, 0.0), 2e5)
    run = over(sim, 10.0, 3)
    pressure = flow.values("flow-node", "pressure")
    x = sim.mesh.points[flow.numbers("flow-node"), 0]
    drop = 12.0 * 1e-3 * 1e-9 / 1e-15
    assert pressure == pytest.approx(2e5 + drop * (1.0 - x), rel=1e-6)
    assert np.abs(flow.values("flow-channel", "flow_rate")) == pytest.approx(1e-9, rel=1e-6)
    assert run.count.steps == 3


def test_an_incompressible_fluid_without_outlet() -> None:
    """A rate into a full channel between blocks that stand: K dV / V everywhere, as large as that is; nothing is
    lost."""
    sim, flow = line(10, 1.0, fluid_bulk=1e15)
    flow.fill(None, saturation=1.0)
    flow.prescribe(at(sim, 0.0, 0.0), kernels.RATE, 1e-9)
    over(sim, 10.0, 3)
    assert flow.values("flow-node", "pressure") == pytest.approx(1e15 * 1e-8 / 1e-5, rel=1e-6)
    assert flow.account()["relative"] < 1e-12


def test_steady_flow_around_a_line_of_wells() -> None:
    """Between two walls of a lattice: equal gradients, and the permeability of the lattice without the half channels
    that are missing on two surfaces; no time passes."""
    mesh = structured.equilateral((0.0, 0.0), 4.0, 4.0 * math.sqrt(0.75), 0.25)
    sim, flow = standing(mesh, fluid_bulk=1e9)
    flow.fill(None, saturation=1.0)
    first, last = at(sim, 0.0), at(sim, 4.0)
    hold(flow, first, 1e6)
    hold(flow, last, 0.0)
    with Coupled(sim, 1.0) as run:
        run.steady()
    nodes, inflow = flow.numbers("flow-node"), flow.values("flow-node", "inflow")
    into, out = inflow[np.isin(nodes, first)].sum(), inflow[np.isin(nodes, last)].sum()
    assert into == pytest.approx(-out, rel=1e-8) and flow.time == 0.0
    found = into * 1e-3 * 4.0 / (1e6 * np.ptp(mesh.points[:, 1])) / exact.lattice(1e-5, 0.25)
    assert found == pytest.approx(1.0 - 2.0 / 3.0 / 16.0, rel=1e-6)


def test_water_finds_its_level_in_a_dam_at_once() -> None:
    """9.11, Dupuit, as by explicit steps (test_channels.py): levels 4 %, discharge 3 %; a seepage face."""
    size = 0.5
    mesh = structured.equilateral((0.0, 0.0), 16.0, 9.0, size)
    sim, flow = standing(mesh, fluid_bulk=2.2e9)
    sim.gravity(0.0, -9.81)
    points = mesh.points
    left, right = np.flatnonzero(points[:, 0] < 1e-9), np.flatnonzero(points[:, 0] > 16.0 - 1e-9)
    flow.prescribe(left, kernels.SURFACE, 8.0)
    flow.prescribe(right, kernels.SURFACE, 4.0)
    flow.fill(np.flatnonzero(points[:, 1] < 8.0 - 0.25 * points[:, 0]), pressure=2e4)
    with Coupled(sim, 10.0) as run:
        run.steady()
    nodes = flow.numbers("flow-node")
    pressure, inflow = flow.values("flow-node", "pressure"), flow.values("flow-node", "inflow")
    head = points[nodes, 1] + pressure / 9810.0
    for x in (4.0, 8.0, 12.0):
        close = (np.abs(points[nodes, 0] - x) < 0.51 * size) & (pressure > 0.0)
        assert head[close].max() == pytest.approx(exact.dupuit(x, 8.0, 4.0, 16.0), rel=0.04)
    wanted = exact.charny(exact.lattice(1e-5, size) * 1000.0 * 9.81 / 1e-3, 8.0, 4.0, 16.0)
    into, out = inflow[np.isin(nodes, left)].sum(), inflow[np.isin(nodes, right)].sum()
    assert into == pytest.approx(wanted, rel=0.03) and into == pytest.approx(-out, rel=1e-6)
    assert (inflow[np.isin(nodes, right)] <= 0.0).all()  # no water comes in above the level


def test_a_rate_takes_no_more_than_there_is() -> None:
    sim, flow = line(4, 1.0)
    node = at(sim, 0.0, 0.0)
    flow.fill(None, saturation=0.5)
    flow.prescribe(node, kernels.RATE, -1.0)
    over(sim, 1.0, 4)
    saturation = flow.values("flow-node", "saturation", node)[0]
    assert saturation == pytest.approx(0.0, abs=1e-9) and flow.nodes[:, kernels.W].min() > -1e-18
    assert flow.account()["relative"] < 1e-12


def test_leak_off_is_that_of_carter() -> None:
    """A held crack, exact in any step."""
    mesh = rectangle(4, 2, 0.4, 0.2)
    sim = model(mesh)
    edges = mesh.edges()
    on = edges.inner & (np.abs(mesh.points[edges.points][:, :, 1] - 0.1) < 1e-9).all(axis=1)
    joints = edges.faces[on, 0]
    matrix = {"matrix_permeability": 1e-15, "matrix_porosity": 0.2, "matrix_porosity_compressibility": 1e-9}
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, "leak_off": 1.0, "matrix_pore_pressure": 2e5, **matrix})
    sim.parts(mechanical=False)
    changes.crack(sim, joints)
    flow.fill(None, pressure=1e6)
    hold(flow, flow.numbers("flow-node"), 1e6)
    over(sim, 40.0, 3)
    wanted = exact.carter(8e5, 40.0, 0.4, (1e-15, 0.2, 1e-9), 2.2e9, 1e-3)
    assert flow.account()["leaked"] == pytest.approx(wanted, rel=1e-9)
    assert flow.account()["relative"] < 1e-12


def test_leak_off_into_empty_pores_lets_the_pressure_fall() -> None:
    """A closed crack, in equilibrium at the end of one step: K dV / V is what the front took at that pressure."""
    dry = {"leak_off": 1.0, "matrix_permeability": 1e-15, "matrix_porosity": 0.2, "matrix_saturation": 0.3}
    sim, flow = line(4, 0.4, aperature_initial=1e-4, **dry)
    changes.crack(sim, flow.network.channels)
    flow.fill(None, pressure=1e6)
    run = over(sim, 5e-10, 1)
    p = flow.state[:, kernels.P]
    assert np.ptp(p) < 1e-3 and 1e5 < p[0] < 9e5 and run.count.iterations < 12
    leaked = exact.front(float(p[0]), 5e-10, 0.4, (1e-15, 0.2, 0.3), 1e-3)
    assert flow.account()["leaked"] == pytest.approx(leaked, rel=1e-6)
    assert 0.4 * 1e-4 * (1e6 - p[0]) / 2.2e9 == pytest.approx(leaked, rel=1e-6)
    assert flow.account()["relative"] < 1e-12


def test_tables_are_followed() -> None:
    """A linear table to the end of each step."""
    sim, flow = line(4, 1.0)
    flow.fill(None, saturation=1.0)
    sim.table("p", [(0.0, 0.0), (10.0, 1e6)])
    hold(flow, at(sim, 0.0, 0.0), "p")
    over(sim, 5.0, 5)
    assert flow.values("flow-node", "pressure", at(sim, 0.0, 0.0))[0] == pytest.approx(5e5, rel=1e-12)


# ---- wells --------------------------------------------------------------------------------------------------------


def drilled(nodes: np.ndarray | None = None, **changed: float) -> tuple[Blocks, Flow]:
    """A channel of 1 m that is full, with a well at its left end or at these nodes."""
    sim, flow = line(4, 1.0, aperature_initial=1e-4, **changed)
    flow.fill(None, saturation=1.0)
    flow.drill("w", at(sim, 0.0, 0.0) if nodes is None else nodes)
    return sim, flow


def test_the_rate_of_a_well_is_that_of_a_condition() -> None:
    sim, flow = drilled()
    flow.stage("w", RATE, 2e-8, math.inf, math.inf)
    other, beside = line(4, 1.0, aperature_initial=1e-4)
    beside.fill(None, saturation=1.0)
    beside.prescribe(at(other, 0.0, 0.0), kernels.RATE, 2e-8)
    for one in (sim, other):
        over(one, 1.0, 10)
    assert flow.nodes == pytest.approx(beside.nodes, rel=1e-12) and flow.state[0, kernels.P] > 1e5
    assert flow.well_value("w", "injected") == pytest.approx(2e-8, rel=1e-12)
    assert flow.well_value("w", "rate") == pytest.approx(2e-8, rel=1e-12)
    assert flow.well_value("w", "pressure") == flow.state[0, kernels.P]
    assert flow.account()["relative"] < 1e-13


def test_steps_end_with_stages() -> None:
    """Volumes are exact, pressures those of their stage, though the longest step does not fit; afterwards shut in."""
    sim, flow = drilled()
    sim.table("ramp", [(0.0, 0.0), (100.0, 1e6)])
    given = flow.account()["given"]
    stages = (RATE, 2e-8, 1.05), (SHUT, 0.0, 0.5), (RATE, -1e-8, 0.2025), (PRESSURE, "ramp", 0.4)
    for does, value, duration in stages:
        flow.stage("w", does, value, duration, math.inf)
    volumes, pressures, lengths = [], [], []
    with Coupled(sim, 0.1) as run:
        while flow.time < 3.0 - 1e-12:
            began, stage = flow.time, flow.well("w").number(flow.time)
            run.advance(3.0)
            lengths.append(flow.time - began)
            volumes.append((flow.time, flow.well_value("w", "injected")))
            pressures.append((stage, flow.time, flow.well_value("w", "pressure"), flow.well_value("w", "rate")))
    times = np.array([time for time, _ in volumes])
    for time, volume in ((1.05, 2.1e-8), (1.55, 2.1e-8), (1.7525, 2.1e-8 - 2.025e-9)):
        k = int(np.argmin(np.abs(times - time)))
        assert times[k] == pytest.approx(time, abs=1e-12) and volumes[k][1] == pytest.approx(volume, rel=1e-11)
    held = [(time, p) for _, time, p, _ in pressures if 1.76 < time <= 2.1525 + 1e-12]
    assert len(held) >= 4 and all(p == pytest.approx(1e4 * time, rel=1e-12) for time, p in held)
    assert pressures[-1][3] == 0.0 and flow.well_value("w", "stage") == 0.0
    assert max(lengths) == pytest.approx(0.1) and lengths[-2] == pytest.approx(0.1, rel=0.3)  # long again at once
    assert flow.account()["given"] - given == pytest.approx(flow.well_value("w", "injected"), rel=1e-9)
    assert flow.account()["relative"] < 1e-13


def test_a_limit_holds_and_takes_nothing_back() -> None:
    """The rate below it, less at it; above it, where others press, nothing comes and nothing goes."""
    found = {}
    for limit in (math.inf, 2e5):
        sim, flow = drilled()
        flow.stage("w", RATE, 1e-7, math.inf, limit)
        with Coupled(sim, 0.05) as run:
            run.advance(0.05)
            first = flow.well_value("w", "rate")
            while flow.time < 1.0 - 1e-12:
                run.advance(1.0)
        found[limit] = first, flow.well_value("w", "pressure"), flow.well_value("w", "injected")
    assert found[math.inf][1] > 1e6 and found[math.inf][2] == pytest.approx(1e-7, rel=1e-12)
    assert found[2e5][0] == pytest.approx(1e-7, rel=1e-12)  # below the limit
    assert found[2e5][1] == pytest.approx(2e5, rel=1e-9)
    assert found[2e5][2] == pytest.approx(flow.nodes[:, kernels.V].sum() * 2e5 / 2.2e9, rel=1e-3)  # full of it
    hold(flow, at(sim, 1.0, 0.0), 5e5)
    before = flow.well_value("w", "injected")
    over(sim, 5.0, 10)
    assert flow.well_value("w", "injected") == before and flow.well_value("w", "rate") == 0.0
    assert flow.well_value("w", "pressure") == pytest.approx(5e5, rel=1e-3)


def test_a_well_draws_no_more_than_there_is() -> None:
    sim, flow = drilled()
    flow.stage("w", RATE, -1.0, math.inf, math.inf)
    over(sim, 1.0, 4)
    assert flow.nodes[0, kernels.W] == pytest.approx(0.0, abs=1e-12) and flow.nodes[:, kernels.W].min() > -1e-18
    assert 0.0 < -flow.well_value("w", "injected") <= 1e-4 and flow.account()["relative"] < 1e-12


def test_nodes_of_a_well_share_one_volume_in_implicit_steps() -> None:
    """Upright, 2 m: half full first, then under a head; as by explicit steps (test_wells.py)."""
    sim, flow = standing(rectangle(1, 4, 0.5, 2.0, y0=0.0), fluid_bulk=1e6)
    sim.close_model()
    points = np.intersect1d(at(sim, 0.0), flow.numbers("flow-node"))
    flow.fill(points[:2], saturation=0.6)
    flow.drill("w", points)
    over(sim, 1e-12, 1)
    own = np.searchsorted(flow.number, points)
    share = flow.state[own, kernels.S]
    assert np.ptp(share) < 1e-9 and share[0] == pytest.approx(
        flow.nodes[own, kernels.W].sum() / flow.nodes[own, kernels.V].sum(), rel=1e-9
    )
    sim.gravity(0.0, -9.81)
    flow.stage("w", PRESSURE, 5e4, 1.0, math.inf)
    over(sim, 1.0, 2)
    y, p = sim.mesh.points[points, 1], flow.state[own, kernels.P]
    assert p == pytest.approx(5e4 + 9810.0 * (y.max() - y), rel=1e-9)
    assert flow.well_value("w", "pressure") == pytest.approx(5e4, rel=1e-12)
    flow.stage("w", RATE, -1.12e-3, 1e-3, math.inf)  # out of the upper ones
    over(sim, 1e-3, 1)
    p = flow.state[own, kernels.P]
    assert p.min() == 0.0 < p.max() and flow.well_value("w", "pressure") == 0.0
    assert flow.well_value("w", "rate") == pytest.approx(-1.12e-3, rel=1e-12)
    assert flow.account()["relative"] < 1e-12


def test_steady_flow_between_two_wells() -> None:
    """What one pumps in the other takes out; no time passes, tables are those of now."""
    sim, flow = drilled()
    sim.table("later", [(0.0, 1e4), (1.0, 1e9)])
    flow.drill("out", at(sim, 1.0, 0.0))
    flow.stage("w", RATE, 1e-8, math.inf, math.inf)
    flow.stage("out", PRESSURE, "later", math.inf, math.inf)
    with Coupled(sim, 1.0) as run:
        run.steady()
    drop = flow.well_value("w", "pressure") - flow.well_value("out", "pressure")
    assert drop == pytest.approx(1e-8 * 12.0 * 1e-3 / 1e-12, rel=1e-6) and flow.time == 0.0
    assert flow.well_value("out", "pressure") == pytest.approx(1e4)
    assert flow.well_value("out", "rate") == pytest.approx(-1e-8, rel=1e-6)


def test_a_well_in_nothing_is_refused_by_implicit_steps() -> None:
    sim, flow = drilled(at(line(4, 1.0)[0], 1.0, 0.0))
    flow.stage("w", RATE, 1e-6, math.inf, math.inf)
    changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 0] > 0.7))
    with pytest.raises(CommandError, match="well 'w' has no flow nodes left"), Coupled(sim, 1.0):
        pass


@pytest.mark.slow
def test_all_of_it_at_once_is_that_of_small_explicit_steps() -> None:
    """A well with stages, a table, a level, a rate, gravity, cracks that leak into rock that is not saturated; then a
    part is taken out. What leaks depends on the length of steps as its square root, as leak-off begins at once."""
    found = {}
    for small in (True, False):
        mesh = shaken(rectangle(8, 4, 0.8, 0.4), 0.2)
        sim, flow = standing(
            mesh, fluid_bulk=1e6, aperature_initial=1e-4, leak_off=1.0, matrix_permeability=1e-14, matrix_porosity=0.2,
            matrix_saturation=0.3,
        )  # fmt: skip
        sim.gravity(0.0, -9.81)
        sim.table("pump", [(0.0, 0.0), (1.0, 1e4)])
        changes.crack(sim, inner(mesh)[::2])
        flow.fill(None, saturation=0.7)
        nodes = flow.numbers("flow-node")
        flow.drill("w", nodes[10:13])
        for does, value, duration in ((RATE, 1e-4, 0.02), (SHUT, 0.0, 0.01), (RATE, -1e-5, math.inf)):
            flow.stage("w", does, value, duration, 3e5 if value > 0.0 else math.inf)
        hold(flow, nodes[:2], "pump")
        flow.prescribe(nodes[20:22], kernels.SURFACE, 0.3)
        flow.prescribe(nodes[30:31], kernels.RATE, 1e-5)
        if small:
            sim.flow_clock(dt=2e-5)
        account = []
        for time in (0.04, 0.01):
            if small:
                for _ in range(round(time / 2e-5)):
                    sim.step()
            else:
                over(sim, time, round(time / 1e-4))
            account.append(flow.account())
            if len(account) == 1:
                state = [flow.values("flow-node", name) for name in ("pressure", "saturation")]
                changes.null(sim, np.arange(4))
        assert max(one["relative"] for one in account) < (1e-12 if small else 1e-9)
        assert (
            account[0]["removed"] == 0.0 < account[1]["removed"] and account[1]["leaked"] > account[0]["leaked"] > 0.0
        )
        found[small] = *state, flow.well_value("w", "injected"), account
    one, other = found[True], found[False]
    assert other[0] == pytest.approx(one[0], rel=1e-6, abs=1e-6) and one[0].max() > 100.0
    assert other[1] == pytest.approx(one[1], abs=1e-3)
    assert other[2] == pytest.approx(one[2], rel=1e-9)
    for before, after in zip(one[3], other[3]):
        assert after["given"] == pytest.approx(before["given"], rel=2e-4)
        assert after["leaked"] == pytest.approx(before["leaked"], rel=0.03)


# ---- flow and equilibrium ------------------------------------------------------------------------------------------

LENGTH, HEIGHT = 4.0, 2.0


def plate(cells: int = 20, pressed: float = 1e6, kind: str = "quad") -> tuple[Blocks, Flow]:
    """Two halves of a block, pressed together, with an open crack between them all along; held above and below."""
    mesh = rectangle(cells, cells // 2, LENGTH, HEIGHT, y0=-0.5 * HEIGHT, kind=kind)
    sim = model(mesh)
    joints = near(mesh, 1, 0.0, inner=True)
    joints = np.unique(np.minimum(joints, sim.partner[joints]))
    law = {**JOINT, "friction": 30.0, "tensile_strength": 2e6, "penalty_normal": 100.0 * ROCK["young"]}
    sim.joint_model(joints, "classic_intrinsic_cohesive_interface", law)
    sim.option(dynamic=False, large_strain=False, collision=False)
    sim.initial_stress(None, yy=-pressed)
    sim.velocity_condition(np.flatnonzero(np.abs(np.abs(mesh.points[:, 1]) - 0.5 * HEIGHT) < 1e-9), vx=0.0, vy=0.0)
    for x in (0.0, LENGTH):
        sim.velocity_condition(near_points(mesh.points, x), vx=0.0)
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, "aperature_initial": 1e-5, "aperature_minumum": 1e-6})
    return sim, flow


def near_points(points: np.ndarray, x: float) -> np.ndarray:
    """Inner points of a side."""
    return np.flatnonzero((np.abs(points[:, 0] - x) < 1e-9) & (np.abs(np.abs(points[:, 1]) - 0.5 * HEIGHT) > 1e-9))


def test_fluid_that_is_pumped_in_lifts_the_block() -> None:
    """Uniaxial strain: both halves, of the height H / 2 each, and the joint with P; the volume that was pumped in is
    stored in apertures and in the compressed fluid."""
    sim, flow = plate()
    changes.crack(sim, flow.network.channels)
    flow.fill(None, saturation=1.0)
    nodes, ends = flow.numbers("flow-node"), at(sim, y=0.0)
    assert np.array_equal(nodes, ends)
    filled = flow.account()["given"]
    flow.prescribe(None, kernels.RATE, 1e-6)
    sim.initial_stress(None, yy=0.0)
    over(sim, 10.0, 5)
    given = flow.account()["given"] - filled
    assert given == pytest.approx(10.0 * 1e-6 * len(nodes), rel=1e-12)
    pressure = flow.values("flow-node", "pressure")
    young, nu = ROCK["young"], ROCK["poisson_ratio"]
    stiff = young * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)) / HEIGHT
    opening = pressure.mean() / stiff
    wanted = LENGTH * (opening + (1e-5 + opening) * pressure.mean() / 2.2e9)
    assert given == pytest.approx(wanted, rel=0.02)  # ends of the line get as much as the others
    assert diagnostics.values(sim, "stress_yy").mean() == pytest.approx(-pressure.mean(), rel=0.02)


@pytest.mark.slow
def test_a_joint_is_pumped_open() -> None:
    """From one end into a whole joint under pressure: joints break one after the other, nothing is lost, and fluid and
    crack go together."""
    sim, flow = plate()
    equilibrium.solve_elastic(sim)
    source = at(sim, 0.0, 0.0)
    flow.prescribe(source, kernels.RATE, 1e-5)
    run = over(sim, 20.0, 40)
    counts = diagnostics.joint_counts(sim)
    assert counts[2] >= 2 and sum(counts) == 20
    account = flow.account()
    assert account["given"] == pytest.approx(20.0 * 1e-5, rel=1e-12) and account["relative"] < 1e-12
    wet = flow.values("flow-node", "saturation") > 0.999
    x = sim.mesh.points[flow.numbers("flow-node"), 0]
    broken = diagnostics.values(sim, "state", flow.numbers("flow-channel")) == 3
    ends = sim.mesh.points[flow.network.ends[broken]][:, :, 0].max()
    assert x[wet].max() >= ends - 1e-9
    assert diagnostics.unbalanced_ratio(sim) < 1e-6 and run.count.steps >= 40


def test_a_well_opens_a_joint_and_is_shut_in() -> None:
    """The same as a rate that is prescribed, then nothing comes or goes, and the fracture stays open."""
    found = {}
    for drill in (True, False):
        sim, flow = plate()
        sim.option(collision=True)
        equilibrium.solve_elastic(sim)
        if drill:
            flow.drill("w", at(sim, 0.0, 0.0))
            flow.stage("w", RATE, 1e-5, 10.0, math.inf)
        else:
            flow.prescribe(at(sim, 0.0, 0.0), kernels.RATE, 1e-5)
        over(sim, 10.0, 20)
        found[drill] = flow.values("flow-node", "pressure")
        if drill:
            over(sim, 10.0, 20)
            assert flow.account()["given"] == pytest.approx(1e-4, rel=1e-12)
            assert 1e6 < flow.well_value("w", "pressure") < found[True][0]
            assert flow.well_value("w", "rate") == 0.0 and diagnostics.unbalanced_ratio(sim) < 1e-6
            assert len(sim.event_rows) == diagnostics.joint_counts(sim)[2] >= 2  # each breaks once
    assert found[True] == pytest.approx(found[False], rel=1e-6, abs=1.0)


def test_one_way_fluid_does_not_push() -> None:
    sim, flow = plate()
    equilibrium.solve_elastic(sim)
    before = diagnostics.values(sim, "stress_yy")
    sim.parts(one_way=True)
    flow.prescribe(at(sim, 0.0, 0.0), kernels.PRESSURE, 5e6)
    over(sim, 1.0, 4)
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(before, rel=1e-6)
    assert flow.values("flow-node", "pressure").max() == pytest.approx(5e6)


def test_the_static_solve_keeps_pressures() -> None:
    """A crack full of fluid of 3 MPa under a block: it is lifted, its pressure stays, and the fluid that it takes is
    given."""
    sim, flow = plate(pressed=0.0)
    changes.crack(sim, flow.network.channels)
    flow.fill(None, pressure=3e6)
    stored = flow.account()["stored"]
    equilibrium.solve_elastic(sim)
    assert diagnostics.values(sim, "stress_yy").mean() == pytest.approx(-3e6, rel=1e-3)
    assert flow.values("flow-node", "pressure") == pytest.approx(3e6)
    account = flow.account()
    opened = diagnostics.values(sim, "displacement_y")
    room = (opened[at(sim, y=0.0)].size and account["stored"] - stored) / LENGTH
    young, nu = ROCK["young"], ROCK["poisson_ratio"]
    assert room == pytest.approx(3e6 * HEIGHT / (young * (1 - nu) / ((1 + nu) * (1 - 2 * nu))), rel=5e-3)
    assert account["relative"] < 1e-12


@pytest.mark.slow
def test_a_file_in_mid_injection(tmp_path) -> None:
    """The rest of the way from a checkpoint ends where the whole way ends."""
    whole, flow = plate()
    equilibrium.solve_elastic(whole)
    flow.prescribe(at(whole, 0.0, 0.0), kernels.RATE, 1e-5)
    over(whole, 10.0, 20)
    saved_state.save(whole, tmp_path / "middle.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "middle.sav")
    for sim in (whole, again):
        fluid = Flow.of(sim)
        with Coupled(sim, 0.5) as run:
            while fluid.time < 18.0:
                run.advance(18.0)
    assert diagnostics.joint_counts(whole) == diagnostics.joint_counts(again) and diagnostics.joint_counts(again)[2] > 0
    for name in ("pressure", "saturation", "fluid"):
        one, other = (Flow.of(sim).values("flow-node", name) for sim in (whole, again))
        assert other == pytest.approx(one, rel=1e-9, abs=1e-12 * np.abs(one).max())
    assert Flow.of(again).implicit_dt == Flow.of(whole).implicit_dt


@pytest.mark.slow
def test_injection_continues_where_a_part_is_dug_away(tmp_path) -> None:
    """A well with stages, leak-off into rock that is not saturated; elements on both sides of wet channels are taken
    out. From a checkpoint before that, the same."""
    leak = {"leak_off": 1.0, "matrix_permeability": 1e-18, "matrix_porosity": 0.2, "matrix_saturation": 0.4}
    whole, flow = plate()
    flow.adjust(None, leak)
    equilibrium.solve_elastic(whole)
    flow.drill("w", at(whole, 0.0, 0.0))
    for does, value, duration in ((RATE, 1e-5, 12.0), (SHUT, 0.0, 3.0), (RATE, 1e-5, math.inf)):
        flow.stage("w", does, value, duration, 4e6 if does == RATE else math.inf)
    over(whole, 10.0, 20)
    saved_state.save(whole, tmp_path / "middle.sav")
    before, again = flow.account(), Blocks()
    saved_state.restore(again, tmp_path / "middle.sav")
    accounts = []
    for sim in (whole, again):
        x, y = sim.mesh.centroids().T
        changes.null(sim, np.flatnonzero((x > 0.6) & (np.abs(y) < 0.25)))
        over(sim, 10.0, 20)
        assert Flow.of(sim).well_value("w", "stage") == 3.0
        accounts.append(Flow.of(sim).account())
    one, other = accounts
    assert before["removed"] == 0.0 < one["removed"] and one["leaked"] > before["leaked"] > 0.0
    assert one["relative"] < 1e-9 and other["relative"] < 1e-9
    for name in ("given", "stored", "leaked", "removed"):
        assert other[name] == pytest.approx(one[name], rel=1e-9)


# ---- faces that touch ----------------------------------------------------------------------------------------------


def joint_stresses(sim: Blocks) -> np.ndarray:
    """Normal and shear stress (n, 2) [Pa] of the joints while implicit steps go on."""
    return sim.local.joint_means(sim.local.slot_of(Flow.of(sim).network.channels))[:, 2:]


def test_faces_of_a_crack_press_on_each_other() -> None:
    """A crack all along under the stress of the rock: it is carried, command after command; with pressure in the crack
    they press by the rest, and part where the pressure is larger."""
    sim, flow = plate()
    sim.option(collision=True)
    changes.crack(sim, flow.network.channels)
    flow.fill(None, saturation=1.0)
    for pressure in (0.0, 4e5, 4e5, 1.5e6):
        hold(flow, flow.numbers("flow-node"), pressure)
        with Coupled(sim, 1.0) as run:
            run.advance(flow.time + 1.0)
            normal, shear = joint_stresses(sim).T
        assert np.abs(shear).max() < 1e-3 * 1e6
        gone = pressure > 1e6
        assert normal == pytest.approx(0.0 if gone else pressure - 1e6, rel=0.05, abs=1.0)
        if gone:
            assert flow.values("flow-channel", "aperture").min() > 1.1e-5
        assert diagnostics.joint_counts(sim) == (0, 0, 0)  # a crack, not a joint that broke
    assert not sim.event_rows and not (sim.broken > 0).any()


def sheared(friction: float = 30.0) -> tuple[Blocks, Flow]:
    """The same rock, its crack between stresses that friction does not hold."""
    sim, flow = plate()
    sim.option(collision=True)
    law = {**JOINT, "friction": friction, "tensile_strength": 2e6, "penalty_normal": 100.0 * ROCK["young"]}
    sim.joint_model(flow.network.channels, "classic_intrinsic_cohesive_interface", law)
    changes.crack(sim, flow.network.channels)
    sim.initial_stress(None, yy=-1e6, xy=8e5)
    flow.fill(None, saturation=1.0)
    return sim, flow


@pytest.mark.parametrize("friction", [0.0, 20.0, 30.0])
def test_faces_of_a_crack_slide_with_friction(friction: float) -> None:
    """No more shear than friction holds, and as much where they slip; pressure of the fluid takes it away."""
    sim, flow = sheared(friction)
    limit = math.tan(math.radians(friction))
    for pressure in (0.0, 5e5):
        hold(flow, flow.numbers("flow-node"), pressure)
        with Coupled(sim, 1.0) as run:
            run.advance(flow.time + 1.0)
            normal, shear = joint_stresses(sim)[5:-5].T
        assert normal.mean() == pytest.approx(pressure - 1e6, rel=0.05)
        assert np.abs(shear) == pytest.approx(-limit * normal, rel=1e-6, abs=1.0)


def test_rubbing_in_two_commands_or_one(tmp_path) -> None:
    """Pressure makes a crack slip, then falls: what friction remembers is kept in between, also in a file."""
    ends = []
    for halves in (1, 2):
        sim, flow = sheared()
        sim.initial_stress(None, yy=-1e6, xy=5e5)
        sim.table("p", [(0.0, 0.0), (4.0, 5e5), (8.0, 0.0)])
        hold(flow, flow.numbers("flow-node"), "p")
        for end in (8.0,) if halves == 1 else (6.0, 8.0):
            flow.implicit_dt = 0.0
            with Coupled(sim, 1.0) as run:
                while flow.time < end - 1e-9:
                    run.advance(end)
                stresses = joint_stresses(sim)
            if end == 6.0:
                saved_state.save(sim, tmp_path / "middle.sav")
                sim = Blocks()
                saved_state.restore(sim, tmp_path / "middle.sav")
                flow = Flow.of(sim)
        ends.append((stresses, diagnostics.values(sim, "displacement_x")))
    (one, moved), (other, again) = ends
    assert np.abs(one[5:-5, 1]).max() > 1e5
    assert other == pytest.approx(one, rel=1e-6, abs=1e-6 * np.abs(one).max())
    assert again == pytest.approx(moved, rel=1e-6, abs=1e-6 * np.nanmax(np.abs(moved)))


def test_faces_that_slid_away_are_refused_by_name() -> None:
    sim, _ = sheared()
    sim.close_model()
    moved = equilibrium.all_nodes(sim)
    way = np.zeros_like(moved.x)
    way[sim.mesh.centroids()[moved.lead // 4, 1] > 0.0] = 0.04, -2e-6
    equilibrium.settle(sim, moved, moved.x + way, np.zeros_like(way))
    with pytest.raises(CommandError, match=r"surfaces are in contact.* Use relaxation"), Coupled(sim, 1.0):
        pass


SOIL = {**ROCK, "cohesion": 1e6, "tensile": 1e5}


# ---- refusals -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "spoil, words",
    [(lambda sim: sim.option(dynamic=True), "dynamic off"),
     (lambda sim: sim.parts(hydraulic=False), "hydraulic on"),
     (lambda sim: sim.velocity_condition(np.array([0]), vx=1e-3), "velocities"),
     (lambda sim: changes.element_model(sim, None, "mech_mohr_coulomb", SOIL), "yield"),
     (lambda sim: Bolts.of(sim), "bolts")],
)  # fmt: skip
def test_what_implicit_steps_cannot_do_is_refused(spoil, words) -> None:
    sim, _ = plate(4)
    spoil(sim)
    with pytest.raises(CommandError, match=words), Coupled(sim, 1.0):
        pass


def test_without_channels_there_is_nothing_to_solve() -> None:
    with pytest.raises(CommandError, match="no channels"):
        Coupled(model(rectangle(2, 2, 1.0, 1.0)), 1.0)


def test_a_steady_flow_without_outlet_is_refused_and_nothing_has_changed() -> None:
    sim, flow = line(4, 1.0)
    flow.fill(None, saturation=1.0)
    flow.prescribe(at(sim, 0.0, 0.0), kernels.RATE, 1e-9)
    with pytest.raises(CommandError, match="steady"), Coupled(sim, 1.0) as run:
        run.steady()
    assert flow.time == 0.0


def test_a_body_that_hangs_on_nothing_is_refused() -> None:
    sim, flow = plate(4)
    sim.remove_conditions(np.flatnonzero(sim.mesh.points[:, 1] > 0.9))
    changes.crack(sim, flow.network.channels)
    with pytest.raises(CommandError, match="can move"), Coupled(sim, 1.0):
        pass

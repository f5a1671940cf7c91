"""Fluid in triangular channels of tetrahedra: kernels against the plain formula, closed forms, pressure on walls."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.kernels import space
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels, reference
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.tangent import Tangent
from hpcdem.physics.flow.wells import RATE
from hpcdem.pre.mesh import structured_space
from tests.flow import exact
from tests.flow.space import on_plane, points_at, ring, standing
from tests.flow.support import WATER, hold, inner, over, run, until
from tests.space.support import body, box, hexes

SHAKEN = box((3, 3, 2), (3.0, 2.0, 1.0), 5, shaken=0.25)


def _by_links(flow: Flow) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends (rows of nodes), conductances and halves of the links of triangles, of the formula alone."""
    mesh, network = flow.blocks.the_mesh(), flow.network
    conduct, half = [], []
    for corners in network.corners:
        at = mesh.points[corners]
        side = [at[(k + 2) % 3] - at[(k + 1) % 3] for k in range(3)]
        area = 0.5 * np.linalg.norm(np.cross(side[0], side[1]))
        for k in range(3):
            cot = -float(side[(k + 1) % 3] @ side[(k + 2) % 3]) / (2.0 * area)
            conduct.append(1e-5**3 * cot / (24.0 * 1e-3))
            half.append(1e-5 * area / 6.0)
    return np.searchsorted(flow.number, network.ends), np.array(conduct), np.array(half)


def test_what_leaves_corners_is_half_the_flux_across_the_opposite_side() -> None:
    """Table of links against Q = q . n s / 2 of each triangle, also of obtuse ones."""
    sim, flow = standing(SHAKEN)
    sim.close_model()
    table = flow.channel_table.reshape(-1, 3, kernels.CHANNEL)
    assert table[:, :, kernels.CONDUCT].min() < 0.0
    rng = np.random.default_rng(3)
    for corners, rows in zip(flow.network.corners, table):
        at, head = SHAKEN.points[corners], rng.uniform(0.0, 1e6, 3)
        wanted = reference.out_of_triangle(at, 1e-5, 1e-3, head)
        along = rows[:, kernels.CONDUCT] * (head[[1, 2, 0]] - head[[2, 0, 1]])  # from 1 to 2, 2 to 0, 0 to 1
        assert [along[2] - along[1], along[0] - along[2], along[1] - along[0]] == pytest.approx(wanted, rel=1e-10)
        area = 0.5 * np.linalg.norm(np.cross(at[1] - at[0], at[2] - at[0]))
        assert 2.0 * rows[:, kernels.HALF].sum() == pytest.approx(1e-5 * area, rel=1e-12)


def test_kernels_do_what_the_plain_loop_does() -> None:
    """Wet, half wet and dry nodes, gravity along all axes, one with a pressure."""
    sim, flow = standing(SHAKEN, fluid_bulk=1e5)
    sim.gravity(1.3, -0.7, -9.81)
    sim.close_model()
    n = len(flow.number)
    flow.nodes[:, kernels.W] = flow.nodes[:, kernels.V] * np.random.default_rng(2).choice([0.0, 0.4, 0.9, 1.0, 1.3], n)
    flow._find_state(slice(None))
    hold(flow, flow.number[3:4], 5e4)
    sim.close_model()
    w, energy = flow.nodes[:, kernels.W].copy(), -1000.0 * (SHAKEN.points[flow.number] @ np.array([1.3, -0.7, -9.81]))
    links = _by_links(flow)
    for _ in range(3):
        sim.step()
        w, p, s = reference.sub_step(*links, 1e5, energy, w, flow.dt, {3: 5e4})
        assert flow.nodes[:, kernels.W] == pytest.approx(w, rel=1e-11, abs=1e-18)
        assert flow.state[:n, kernels.P] == pytest.approx(p, rel=1e-9, abs=1e-3)
        assert flow.state[:n, kernels.S] == pytest.approx(s, rel=1e-11)


@pytest.mark.parametrize("made", [box, hexes])
def test_a_uniform_gradient_flows_evenly(made: Callable[..., Mesh]) -> None:
    """A plane of triangles, or halves of sides of hexahedra: q = d^3 / (12 mu) dp/dx, its velocity over the aperture,
    the same everywhere."""
    mesh = made((4, 3, 2), (4.0, 3.0, 2.0))
    sim, flow = standing(mesh, on_plane(mesh, 2, 1.0), aperature_initial=1e-4)
    flow.fill(None, saturation=1.0)
    hold(flow, points_at(mesh, x=0.0, z=1.0), 4e3)
    hold(flow, points_at(mesh, x=4.0, z=1.0), 0.0)
    run(sim, 400)
    flux = 1e-12 / 12e-3 * 1e3
    assert flow.values("flow-channel", "flow_rate") == pytest.approx(flux, rel=1e-6)
    assert flow.values("flow-channel", "velocity") == pytest.approx(flux / 1e-4, rel=1e-6)
    nodes = flow.numbers("flow-node")
    assert flow.values("flow-node", "pressure") == pytest.approx(4e3 - 1e3 * mesh.points[nodes, 0], rel=1e-6, abs=1e-2)
    inflow = flow.values("flow-node", "inflow")
    assert inflow[mesh.points[nodes, 0] == 0.0].sum() == pytest.approx(3.0 * flux, rel=1e-6)
    assert flow.values("flow-node", "volume").sum() == pytest.approx(12.0 * 1e-4)


def test_radial_flow_in_a_disc() -> None:
    """fdem_3d.md D: 10 MPa at r = 1 m, 1 MPa at 5 m, 10 um, 1 mPa s: 7.7326, 6.1239, 3.8565, 2.2478 MPa within 1 % of
    9 MPa; Q 2.92797e-6 m3/s; what comes in goes out to 1e-6."""
    marks, parts = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0), (3, 2, 3, 2, 2)
    radii = np.concatenate(
        [np.geomspace(a, b, n, endpoint=False) for a, b, n in zip(marks, marks[1:], parts)] + [[5.0]]
    )
    mesh = ring(radii, 24, np.array([-0.5, 0.0, 0.5]))
    sim, flow = standing(mesh, on_plane(mesh, 2, 0.0), fluid_bulk=1e7)
    flow.fill(None, pressure=5e6)
    nodes = flow.numbers("flow-node")
    r = np.hypot(*mesh.points[nodes, :2].T)
    hold(flow, nodes[r < 1.0 + 1e-9], 10e6)
    hold(flow, nodes[r > 5.0 - 1e-9], 1e6)
    run(sim, 13_000)
    pressure, inflow = flow.values("flow-node", "pressure"), flow.values("flow-node", "inflow")
    for radius, wanted in ((1.5, 7.7326e6), (2.0, 6.1239e6), (3.0, 3.8565e6), (4.0, 2.2478e6)):
        found = pressure[np.abs(r - radius) < 1e-9]
        assert len(found) == 24 and found == pytest.approx(wanted, abs=0.01 * 9e6)
        assert float(exact.radial(np.array([radius]), (1.0, 10e6), (5.0, 1e6))[0]) == pytest.approx(wanted, rel=1e-4)
    into, out = inflow[r < 1.0 + 1e-9].sum(), inflow[r > 5.0 - 1e-9].sum()
    wanted = 2.0 * math.pi * 1e-15 / (12.0 * 1e-3) * 9e6 / math.log(5.0)
    assert wanted == pytest.approx(2.92797e-6, rel=1e-5)
    assert into == pytest.approx(wanted, rel=0.01) and into == pytest.approx(-out, rel=1e-6)
    assert flow.account()["relative"] < 1e-12


def test_a_pulse_runs_into_a_closed_channel() -> None:
    """A plane of channels 10 m long; the closed form of the line, 1 % of p_A."""
    mesh = box((40, 1, 2), (10.0, 0.25, 0.5), 6)
    sim, flow = standing(mesh, on_plane(mesh, 2, 0.25), aperature_initial=1e-4)
    flow.fill(None, saturation=1.0)
    hold(flow, points_at(mesh, x=0.0, z=0.25), 1e6)
    ends = [points_at(mesh, x=x, z=0.25) for x in (5.0, 10.0)]
    rate = 2.2e9 * 1e-8 / (12.0 * 1e-3) / 100.0
    for t in (0.25, 0.5):
        until(sim, t / rate)
        for at, xi in zip(ends, (0.5, 0.0)):
            assert flow.values("flow-node", "pressure", at) == pytest.approx(1e6 * exact.transient(xi, t), abs=1e4)


@pytest.mark.parametrize("axis", [1, 2])
def test_a_column_of_water_is_hydrostatic(axis: int) -> None:
    """In an upright plane, gravity along y or z; then its surface is below the upper end, where it is dry."""
    size = [0.4, 0.4, 0.4]
    size[axis] = 2.0
    cells = [2, 2, 2]
    cells[axis] = 8
    mesh = box(tuple(cells), tuple(size))
    sim, flow = standing(mesh, on_plane(mesh, 0, 0.2), fluid_bulk=1e6)
    g = [0.0, 0.0, 0.0]
    g[axis] = -9.81
    sim.gravity(*g)
    top = points_at(mesh, **{"x": 0.2, "xyz"[axis]: 2.0})
    flow.fill(None, saturation=1.0)
    flow.prescribe(top, kernels.SURFACE, 2.5)
    run(sim, 5000)
    height = mesh.points[flow.numbers("flow-node"), axis]
    assert flow.values("flow-node", "pressure") == pytest.approx(1000.0 * 9.81 * (2.5 - height), rel=1e-4)
    assert flow.values("flow-channel", "flow_rate").max() < 1e-11
    flow.prescribe(top, kernels.SURFACE, 1.9)
    run(sim, 4000)
    assert flow.values("flow-node", "pressure") == pytest.approx(1000.0 * 9.81 * (2.0 - height), abs=2.0)
    assert flow.account()["relative"] < 1e-12


def test_leak_off_after_carter() -> None:
    """Both walls of the area take up 4 C A sqrt(t)."""
    mesh = box((3, 2, 2), (0.3, 0.2, 0.2))
    sim = body(mesh)
    joints = on_plane(mesh, 2, 0.1)
    matrix = {"matrix_permeability": 1e-15, "matrix_porosity": 0.2, "matrix_porosity_compressibility": 1e-9}
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, "leak_off": 1.0, "matrix_pore_pressure": 2e5, **matrix})
    sim.parts(mechanical=False)
    sim.flow_clock(dt=1e-7)
    flow.fill(None, pressure=1e6)
    hold(flow, flow.numbers("flow-node"), 1e6)
    run(sim, 5)
    assert flow.account()["leaked"] == 0.0
    changes.crack(sim, joints)
    start = flow.time
    run(sim, 200)
    wanted = exact.carter(8e5, flow.time - start, 0.3 * 0.2, (1e-15, 0.2, 1e-9), 2.2e9, 1e-3)
    assert flow.account()["leaked"] == pytest.approx(wanted, rel=1e-9)
    assert flow.account()["relative"] < 1e-12


# ---- conditions, wells ---------------------------------------------------------------------------------------------


def test_rates_and_wells_count_volumes() -> None:
    """A rate at three nodes follows a table; a well pumps a slug of so many m3; nothing comes out of dry nodes."""
    mesh = box((3, 3, 2), (3.0, 3.0, 2.0))
    sim, flow = standing(mesh, on_plane(mesh, 2, 1.0), fluid_bulk=1e6)
    nodes = flow.numbers("flow-node")
    sim.table("ramp", [(0.0, 0.0), (10.0, 1e-6)])
    flow.prescribe(nodes[:3], kernels.RATE, "ramp")
    flow.drill("hole", nodes[8:10])
    flow.stage("hole", RATE, 2e-6, 1.5, math.inf)
    sim.flow_clock(dt=0.01)
    run(sim, 200)
    wanted = 3.0 * sum(1e-7 * 0.01 * (k + 1) * 0.01 for k in range(200)) + 3e-6
    assert flow.account()["given"] == pytest.approx(wanted, rel=1e-9)
    assert flow.well_value("hole", "injected") == pytest.approx(3e-6, rel=1e-9)
    flow.prescribe(nodes[-1:], kernels.RATE, -1.0)
    run(sim, 50)
    assert flow.values("flow-node", "fluid").min() >= 0.0
    assert flow.account()["relative"] < 1e-12


def test_flow_surface_needs_gravity_along_any_axis() -> None:
    mesh = box((2, 2, 2), (1.0, 1.0, 1.0))
    sim, flow = standing(mesh)
    flow.prescribe(flow.numbers("flow-node")[:1], kernels.SURFACE, 1.0)
    with pytest.raises(CommandError, match="flow-surface needs gravity"):
        sim.step()
    sim.gravity(0.0, 0.0, -9.81)
    sim.step()


def test_channels_go_with_their_elements() -> None:
    mesh = box((3, 2, 2), (3.0, 2.0, 2.0))
    sim, flow = standing(mesh, fluid_bulk=1e6)
    flow.fill(None, pressure=1e3)
    before = len(flow.network.channels)
    changes.null(sim, np.arange(12))
    sim.step()
    account = flow.account()
    assert len(flow.network.channels) < before and account["removed"] > 0.0 and account["relative"] < 1e-12


# ---- with blocks that move ------------------------------------------------------------------------------------------


def _sandwich(one_way: bool = False, made: Callable[..., Mesh] = box) -> tuple[Blocks, Flow]:
    """Two blocks with a crack between them at z = 0.1 that is full of fluid at 2 MPa, held below and above, which move
    along z only."""
    mesh = made((3, 2, 2), (0.3, 0.2, 0.2))
    sim = body(mesh, young=1e9, damp_factor=0.3)
    joints = on_plane(mesh, 2, 0.1)
    changes.crack(sim, joints)
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    for z in (0.0, 0.2):
        sim.velocity_condition(points_at(mesh, z=z), vx=0.0, vy=0.0, vz=0.0)
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, "fluid_bulk": 1e6, "aperature_initial": 1e-4})
    flow.fill(None, saturation=1.0)
    hold(flow, flow.numbers("flow-node"), 2e6)
    sim.parts(one_way=one_way)
    return sim, flow


@pytest.mark.parametrize(("made", "within"), [(box, 1e-6), (hexes, 1e-6)])
def test_pressure_pushes_walls_apart_and_the_aperture_follows(made: Callable[..., Mesh], within: float) -> None:
    """Uniaxial strain: each side gives way by p h / M, M = 1.2 E; the room for the fluid grows with it. One way: walls
    stay."""
    sim, flow = _sandwich(made=made)
    convergence.advance(sim, 1500)
    wanted = 1e-4 + 2.0 * 2e6 * 0.1 / 1.2e9
    assert flow.values("flow-channel", "aperture") == pytest.approx(wanted, rel=within)
    assert flow.values("flow-node", "volume").sum() == pytest.approx(wanted * 0.06, rel=within)
    assert flow.account()["relative"] < 1e-12
    still, flow = _sandwich(one_way=True)
    convergence.advance(still, 300)
    assert flow.values("flow-channel", "aperture") == pytest.approx(1e-4, rel=1e-9)


def test_a_pressure_that_is_linear_on_a_face_pushes_by_its_integrals() -> None:
    """A (2 p1 + p2 + p3) / 12 on the first corner; all together, and their moment, are those of the pressure."""
    sim, flow = _sandwich()
    sim.close_model()
    at = sim.mesh.points[flow.held]
    flow.state[:, kernels.P] = 1e6 * (1.0 + 2.0 * at[:, 0] - 3.0 * at[:, 1])
    applied = np.zeros_like(sim.local.loads.applied)
    flow.add_to(applied)
    force, place = applied.reshape(-1, 4, 4)[:, :, :3], sim.x.reshape(-1, 4, 4)[:, :, :3]
    above = sim.mesh.centroids(sim.number)[:, 2] > 0.1
    assert np.abs(force.sum(axis=(0, 1))).max() < 1e-6
    up, arm = force[above][:, :, 2], place[above]
    lx, ly = 0.3, 0.2
    assert up.sum() == pytest.approx(1e6 * lx * ly * (1.0 + lx - 1.5 * ly), rel=1e-12)
    moment = 1e6 * ly * (lx**2 / 2.0 + 2.0 * lx**3 / 3.0 - 0.75 * ly * lx**2)
    assert (up * arm[:, :, 0]).sum() == pytest.approx(moment, rel=1e-12)


def test_fluid_that_cannot_drain_makes_channels_stiff() -> None:
    """K A / (3 d) at each corner of a channel: a shorter time step, by its square root where it rules."""
    steps = []
    for bulk in (1e6, 2.2e9, 8.8e9):
        mesh = box((2, 2, 2), (0.2, 0.2, 0.2))
        sim = body(mesh)
        flow = Flow.of(sim)
        flow.assign(on_plane(mesh, 2, 0.1), {**WATER, "fluid_bulk": bulk})
        sim.close_model()
        steps.append(sim.clock.dt)
    assert steps[0] > 5.0 * steps[1] and steps[1] == pytest.approx(2.0 * steps[2], rel=0.02)


def test_apertures_of_joints_that_open_slip_and_press() -> None:
    """Limits, and dilation by the size of a slip along both axes."""
    mesh = box((2, 2, 2), (0.2, 0.2, 0.2))
    sim = body(mesh)
    joints = on_plane(mesh, 2, 0.1)
    changes.crack(sim, joints)
    flow = Flow.of(sim)
    limits = {"aperature_minumum": 4e-5, "aperature_maximum": 6e-4, "shear_dilation": 10.0}
    flow.assign(joints, {**WATER, **limits, "aperature_initial": 1e-4})
    sim.close_model()
    above = sim.mesh.centroids(sim.number)[:, 2] > 0.1
    for move, wanted in (
        ((0.0, 0.0, 1e-4), 2e-4), ((0.0, 0.0, -9e-5), 4e-5), ((0.0, 0.0, 1e-3), 6e-4),
        ((3e-4, 4e-4, 0.0), 1e-4 + math.tan(math.radians(10.0)) * 5e-4),
    ):  # fmt: skip
        kept = sim.x.copy()
        sim.x.reshape(-1, 4, 4)[above, :, :3] += np.array(move)
        flow.find_geometry()
        assert flow.apertures() == pytest.approx(wanted, rel=1e-9)
        sim.x[:] = kept


def test_an_unbroken_joint_has_a_virtual_aperture() -> None:
    """A cohesive joint is a channel too: of aperature-initial and its elastic opening."""
    mesh = box((2, 2, 2), (0.2, 0.2, 0.2))
    sim = body(mesh)
    joints = inner(mesh)
    law = {"friction": 30.0, "cohesion": 8e9, "tensile_strength": 2e9, "gf1": 1e6, "gf2": 4e6, "penalty_normal": 5e11}
    sim.joint_model(joints, "classic_intrinsic_cohesive_interface", law)
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, "fluid_bulk": 1e6})
    flow.fill(None, pressure=1e6)
    hold(flow, flow.numbers("flow-node"), 1e6)
    convergence.advance(sim, 200)
    aperture = flow.values("flow-channel", "aperture")
    assert (aperture > 1e-6).all() and np.ptp(aperture) > 0.0
    assert diagnostics.joint_counts(sim)[2] == 0


# ---- implicit steps -------------------------------------------------------------------------------------------------


def _disc(parts: int) -> tuple[Blocks, Flow, np.ndarray]:
    """Between r = 1 and 5 m, K 2.2 GPa; radii of the flow nodes."""
    mesh = ring(np.geomspace(1.0, 5.0, parts + 1), 4 * parts, np.array([-0.5, 0.0, 0.5]))
    sim, flow = standing(mesh, on_plane(mesh, 2, 0.0))
    nodes = flow.numbers("flow-node")
    r = np.hypot(*mesh.points[nodes, :2].T)
    hold(flow, nodes[r < 1.0 + 1e-9], 10e6)
    hold(flow, nodes[r > 5.0 - 1e-9], 1e6)
    return sim, flow, r


@pytest.mark.slow
def test_steady_flow_in_a_disc_at_once() -> None:
    """Pressures at all nodes, and Q, of second order in the mesh; what comes in goes out."""
    errors = []
    for parts in (6, 12):
        sim, flow, r = _disc(parts)
        with Coupled(sim, 1.0) as solved:
            solved.steady()
        inflow, pressure = flow.values("flow-node", "inflow"), flow.values("flow-node", "pressure")
        wanted = 2.0 * math.pi * 1e-15 / (12.0 * 1e-3) * 9e6 / math.log(5.0)
        into, out = inflow[r < 1.0 + 1e-9].sum(), inflow[r > 5.0 - 1e-9].sum()
        assert into == pytest.approx(-out, rel=1e-8) and flow.account()["relative"] < 1e-12
        assert pressure == pytest.approx(exact.radial(r, (1.0, 10e6), (5.0, 1e6)), abs=2e4)
        errors.append(abs(into / wanted - 1.0))
    assert errors[1] < 0.005 and errors[1] == pytest.approx(errors[0] / 4.0, rel=0.1)


def test_implicit_steps_are_those_of_small_explicit_ones() -> None:
    """A column that fills from below, against gravity; dry nodes, an outlet that takes more than there is."""
    found = []
    for implicit in (False, True):
        mesh = box((2, 2, 6), (0.4, 0.4, 1.2), 6, shaken=0.1)
        sim, flow = standing(mesh, None, fluid_bulk=1e5, aperature_initial=1e-4)
        sim.gravity(0.5, 0.0, -9.81)
        nodes = flow.numbers("flow-node")
        z = mesh.points[nodes, 2]
        flow.fill(None, saturation=0.3)
        hold(flow, nodes[z == 0.0], 6e3)
        flow.prescribe(nodes[z == 1.2], kernels.RATE, -1e-9)
        if implicit:
            over(sim, 3.0, 60)
        else:
            until(sim, 3.0)
        assert flow.account()["relative"] < 1e-12
        found.append((flow.values("flow-node", "saturation"), flow.account()["given"], flow.time))
    assert found[0][2] == pytest.approx(found[1][2], rel=0.01)
    assert np.ptp(found[0][0]) > 0.3 and found[1][0] == pytest.approx(found[0][0], abs=0.03)
    assert found[1][1] == pytest.approx(found[0][1], rel=0.02)


def _pushed(split: int = 6, **changes: float) -> tuple[Blocks, Flow]:
    """Two blocks with intact joints between them, held outside, at a pressure, in static equilibrium."""
    mesh = box((3, 2, 2), (0.3, 0.2, 0.2), split)
    sim = body(mesh, dynamic=False, young=1e9)
    joints = on_plane(mesh, 2, 0.1)
    law = {"friction": 30.0, "cohesion": 8e9, "tensile_strength": 2e9, "gf1": 1e6, "gf2": 4e6, "penalty_normal": 1e10}
    sim.joint_model(joints, "classic_intrinsic_cohesive_interface", law)
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    for z in (0.0, 0.2):
        sim.velocity_condition(points_at(mesh, z=z), vx=0.0, vy=0.0, vz=0.0)
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, **changes})
    flow.fill(None, saturation=1.0)
    return sim, flow


def test_fluid_that_is_pumped_into_a_joint_opens_it() -> None:
    """Uniaxial: the fluid that came in is the room that opened and what is pressed together; walls and joint carry the
    pressure, each as stiff as it is."""
    sim, flow = _pushed(aperature_initial=1e-4)
    nodes = flow.numbers("flow-node")
    area = np.zeros(len(flow.network.there))
    mesh, channels = sim.mesh, flow.network.channels
    np.add.at(area, flow.network.corners, (mesh.face_sizes(channels) / 3.0)[:, None])
    table = flow.conditions
    for node in nodes:
        flow.prescribe(np.array([node]), kernels.RATE, 1e-5 * float(area[node]))
    assert len(table) > 2
    over(sim, 4.0, 4)
    pressure = flow.values("flow-node", "pressure")
    p = pressure.mean()
    assert pressure == pytest.approx(p, rel=1e-6)
    aperture = flow.values("flow-channel", "aperture")
    assert aperture == pytest.approx(aperture.mean(), rel=1e-6)
    o = aperture.mean() - 1e-4
    # p = M o / (2 h) + stress of the joints at this opening, found from the stress in the blocks.
    stress = -diagnostics.values(sim, "stress_zz").mean()
    assert stress == pytest.approx(1.2e9 * 0.5 * o / 0.1, rel=1e-3) and stress < 0.9 * p
    given = flow.account()["given"]
    assert given == pytest.approx(0.06 * (1e-4 + 4e-5), rel=1e-9)
    assert 0.06 * (1e-4 + o) * (1.0 + p / 2.2e9) == pytest.approx(given, rel=1e-6)
    assert flow.account()["relative"] < 1e-12


def test_implicit_steps_continue_from_a_file(tmp_path) -> None:
    """In the middle of what is pumped into the joint, which opens: the same bits; and not beside blocks in motion."""

    def on(one: Blocks, end: float) -> None:
        with Coupled(one, 0.5) as run_:
            while Flow.of(one).time < end * (1.0 - 1e-12):
                run_.advance(end)

    sim, flow = _pushed(aperature_initial=1e-4, shear_dilation=10.0)
    flow.prescribe(flow.numbers("flow-node")[:4], kernels.RATE, 1e-7)
    on(sim, 2.0)
    saved_state.save(sim, tmp_path / "a.sav")
    other = Blocks()
    saved_state.restore(other, tmp_path / "a.sav")
    found = []
    for one in (sim, other):
        on(one, 4.0)
        of = Flow.of(one)
        water = [of.values("flow-node", name) for name in ("pressure", "fluid", "inflow")]
        rock = [diagnostics.values(one, name) for name in ("position_z", "stress_zz")]
        found.append(np.concatenate([*water, of.values("flow-channel", "aperture"), *rock]))
    assert np.array_equal(*found) and Flow.of(other).values("flow-channel", "aperture").max() > 1.05e-4
    assert Flow.of(other).account()["relative"] < 1e-12
    other.option(dynamic=True)
    with pytest.raises(CommandError, match="dynamic off first, or mechanical"):
        Coupled(other, 0.5)


def _cracked(made: Callable[..., Mesh] = box, **stress: float) -> tuple[Blocks, Flow, np.ndarray]:
    """Rock under stress with a crack all along z = 0.1 full of fluid, held below and above, and the joints of the crack
    away from both ends."""
    mesh = made((6, 2, 2), (0.6, 0.2, 0.2))
    sim = body(mesh, dynamic=False, young=1e9)
    sim.option(large_strain=False, collision=True)
    joints = on_plane(mesh, 2, 0.1)
    law = {"friction": 30.0, "cohesion": 8e6, "tensile_strength": 2e6, "gf1": 1.0, "gf2": 4.0, "penalty_normal": 1e11}
    sim.joint_model(joints, "classic_intrinsic_cohesive_interface", law)
    changes.crack(sim, joints)
    sim.initial_stress(None, **stress)
    sim.velocity_condition(None, vy=0.0)
    for z in (0.0, 0.2):
        sim.velocity_condition(points_at(mesh, z=z), vx=0.0, vy=0.0, vz=0.0)
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, "aperature_initial": 1e-5, "aperature_minumum": 1e-6})
    flow.fill(None, saturation=1.0)
    middle = np.abs(mesh.points[mesh.face_points(flow.network.channels)][:, :, 0].mean(axis=1) - 0.3) < 0.11
    return sim, flow, middle


def _held_at(sim: Blocks, flow: Flow, pressure: float, middle: np.ndarray) -> np.ndarray:
    """Normal and shear stress (n, 2) [Pa] of the joints of the crack after a second at this pressure."""
    hold(flow, flow.numbers("flow-node"), pressure)
    with Coupled(sim, 1.0) as run:
        run.advance(flow.time + 1.0)
        found = sim.local.joint_means(sim.local.slot_of(flow.network.channels))
    return found[middle, 2:]


@pytest.mark.parametrize("made", [box, hexes])
def test_faces_of_a_crack_press_on_each_other(made: Callable[..., Mesh]) -> None:
    """It is carried, command after command; with pressure in the crack its faces press by the rest, and part where the
    pressure is larger."""
    sim, flow, middle = _cracked(made, zz=-1e6)
    sim.velocity_condition(None, vx=0.0)
    for pressure in (0.0, 4e5, 4e5, 1.5e6):
        normal, shear = _held_at(sim, flow, pressure, middle).T
        assert np.abs(shear).max() < 1e3
        assert normal == pytest.approx(min(pressure - 1e6, 0.0), rel=0.05, abs=1.0)
        assert (flow.values("flow-channel", "aperture").min() > 1.1e-5) == (pressure > 1e6)
    assert diagnostics.joint_counts(sim) == (0, 0, 0)  # a crack, not a joint that broke
    assert not sim.event_rows and not (sim.broken > 0).any()


@pytest.mark.parametrize(("friction", "made"), [(0.0, box), (30.0, box), (30.0, hexes)])
def test_faces_of_a_crack_slide_with_friction(friction: float, made: Callable[..., Mesh]) -> None:
    """No more shear than friction holds, and as much where they slip; pressure of the fluid takes it away."""
    sim, flow, middle = _cracked(made, zz=-1e6, xz=8e5)
    sim.joint_property(flow.network.channels, {"friction": friction})
    for pressure in (0.0, 5e5):
        normal, shear = _held_at(sim, flow, pressure, middle).T
        assert normal.mean() == pytest.approx(pressure - 1e6, rel=0.05)
        assert np.abs(shear).mean() == pytest.approx(
            -math.tan(math.radians(friction)) * normal.mean(), rel=0.02, abs=1.0
        )


def test_where_surfaces_may_overlap_faces_of_a_crack_do_not_press() -> None:
    sim, flow, middle = _cracked(zz=-1e6)
    sim.option(collision=False)
    assert np.abs(_held_at(sim, flow, 0.0, middle)).max() == 0.0


def test_the_matrix_is_the_derivative_of_what_is_lacking() -> None:
    """Newton's method of the coupled problem needs few iterations in tangled states: slip, dilation, leak-off, height,
    partly dry; each is the derivative of the residual by differences."""
    sim, flow = _pushed(5, aperature_initial=1e-4, shear_dilation=15.0, fluid_bulk=1e6)
    sim.gravity(0.3, 0.2, -9.81)
    flow.fill(None, pressure=1e5)  # at u = 0 there is a kink
    flow.fill(flow.numbers("flow-node")[::3], saturation=0.6)
    hold(flow, flow.numbers("flow-node")[:2], 2e5)
    with Coupled(sim, 1e-3) as run_:
        fluid = run_.fluid
        step, u = fluid.begin(1e-3, run_.x)
        x = run_.x + np.random.default_rng(1).uniform(-1e-5, 1e-5, run_.x.shape)
        now = fluid.balance(step, u, x)
        first, n = len(x), fluid.n
        matrix = np.zeros((n, 3 * first + n))
        for one in Tangent(fluid).pieces(step, now, u, x, first)[:2]:
            for nodes, stiffness in zip(one.node, one.stiffness):
                places = [3 * k + np.arange(3) if k < first else np.array([3 * first + k - first, -1, -1])
                          for k in nodes]  # fmt: skip
                columns = np.concatenate(places)
                for i, row in enumerate(columns):
                    if row >= 3 * first:
                        keep = columns >= 0
                        np.add.at(matrix[row - 3 * first], columns[keep], stiffness[i][keep])
        check = np.random.default_rng(4)
        for _ in range(6):
            way = check.uniform(-1.0, 1.0, first * 3 + n)
            way[: 3 * first] *= 1e-9
            way[3 * first :] *= 1e-6
            dx, du = way[: 3 * first].reshape(-1, 3), way[3 * first :]
            plus, minus = (fluid.balance(step, u + s * du, x + s * dx).residual for s in (1.0, -1.0))
            free = ~now.held
            found, wanted = (matrix @ way)[free], (0.5 * (plus - minus))[free]
            assert np.abs(found - wanted).max() < 1e-2 * np.abs(wanted).max()


def _penny(parts: int) -> tuple[np.ndarray, np.ndarray, float]:
    """A crack of 1 m with so many circles of joints in a sector of 20 degrees, at 1 MPa of fluid, E 30 GPa, nu 0.25:
    distances from the axis of its channels, openings, volume of the whole crack."""
    turn, size = math.radians(20.0), 1.0 / parts
    away = np.cumsum(size * 1.35 ** np.arange(round(math.log(1.0 + 9.0 * parts * 0.35) / math.log(1.35))))
    radii = np.concatenate([np.arange(parts + 1) * size, 1.0 + away])
    mesh = structured_space.sector(radii, 2, turn, np.concatenate([-away[::-1], [0.0], away]))
    sim = body(mesh, dynamic=False, young=30e9)
    sim.option(large_strain=False)
    plane = on_plane(mesh, 2, 0.0)
    crack = plane[np.linalg.norm(mesh.points[mesh.face_points(plane)], axis=2).max(axis=1) < 1.0 + 1e-9]
    changes.crack(sim, crack)
    x, y, z = mesh.points.T
    r = np.hypot(x, y)
    side = np.flatnonzero((np.abs(x * math.sin(turn) - y * math.cos(turn)) < 1e-9) & (r > 1e-9))
    sim.velocity_condition(np.flatnonzero(np.abs(y) < 1e-9), vy=0.0)
    sim.move_constraint(side, space.ACROSS, (-math.sin(turn), math.cos(turn), 0.0))
    sim.velocity_condition(np.flatnonzero(r < 1e-9), vx=0.0, vy=0.0)
    outside = np.flatnonzero((r > r.max() - 1e-6) | (np.abs(z) > z.max() - 1e-6))
    sim.velocity_condition(outside, vx=0.0, vy=0.0, vz=0.0)
    flow = Flow.of(sim)
    flow.assign(crack, {**WATER, "aperature_initial": 1e-6})
    flow.fill(None, pressure=1e6)
    equilibrium.solve_elastic(sim)
    opening = flow.values("flow-channel", "aperture") - 1e-6
    away = np.linalg.norm(mesh.points[flow.network.corners].mean(axis=1), axis=1)
    volume = float((opening * mesh.face_sizes(flow.network.channels)).sum()) * 2.0 * math.pi / turn
    return away, opening, volume


def test_pressure_in_a_penny_crack_opens_it_as_sneddon_says() -> None:
    """fdem_3d.md D: w(r) = 8 p sqrt(a2 - r2) / (pi E'), 79.58 um in the middle, 68.92 at half of it; volume 16 p a3 /
    (3 E') = 1.6667e-4 m3. The error is of first order in the size of the joints, as their strain is constant."""
    middle = 8.0 * 1e6 / (math.pi * 32e9)
    assert middle == pytest.approx(79.58e-6, rel=1e-4)
    errors, volumes = [], []
    for parts in (10, 20):
        away, opening, volume = _penny(parts)
        first = int(np.argmin(away))
        errors.append(opening[first] / (middle * math.sqrt(1.0 - away[first] ** 2)) - 1.0)
        volumes.append(volume / 1.6667e-4 - 1.0)
    assert abs(errors[1]) < 0.05 and errors[1] > 0.75 * errors[0]
    assert abs(2.0 * errors[1] - errors[0]) < 0.03 and abs(2.0 * volumes[1] - volumes[0]) < 0.04

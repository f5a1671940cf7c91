"""Fluid that pushes on blocks, and blocks that press on fluid."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.model import Flow
from hpcdem.pre.mesh import structured
from tests.blocks.support import JOINT, model, rectangle
from tests.flow.support import WATER, at, hold, inner, run

CRACK = {**WATER, "fluid_bulk": 1e6, "aperature_initial": 1e-4, "aperature_minumum": 1e-5}


def split(dynamic: bool = False, **changed: float) -> tuple[Blocks, Flow]:
    """1 m x 0.5 m with one row of joints along x at its middle, which are channels; sides on rollers."""
    sim = model(rectangle(4, 2, 1.0, 0.5))
    edges = sim.mesh.edges()
    on = edges.inner & (np.abs(sim.mesh.points[edges.points][:, :, 1] - 0.25) < 1e-9).all(axis=1)
    joints = edges.faces[on, 0]
    sim.joint_model(joints, "classic_intrinsic_cohesive_interface", {**JOINT, "tensile_strength": 20e6})
    flow = Flow.of(sim)
    flow.assign(joints, {**CRACK, **changed})
    sim.option(dynamic=dynamic, collision=False)
    for x in (0.0, 1.0):
        sim.velocity_condition(at(sim, x), vx=0.0)
    for y in (0.0, 0.5):
        sim.velocity_condition(at(sim, y=y), vy=0.0)
    return sim, flow


def applied(sim: Blocks) -> dict[int, np.ndarray]:
    """What fluid applies to corners, by element * 4 + corner [N/m]."""
    sim.close_model()
    out = np.zeros((len(sim.number), 8))
    Flow.of(sim).add_to(out)
    rows = zip(sim.number.tolist(), out.reshape(-1, 4, 2))
    return {4 * e + k: force[k] for e, force in rows for k in range(3) if force[k].any()}


def test_the_load_on_a_face_is_linear() -> None:
    """One joint across a square, 1 and 4 kPa at its ends: L (2 p1 + p2) / 6 = 1.414 kN, 2.121 kN, on both faces."""
    sim = model(rectangle(1, 1, 1.0, 1.0))
    flow = Flow.of(sim)
    flow.assign(None, WATER)
    a, b = flow.network.ends[0]
    flow.fill(np.array([a]), pressure=1e3)
    flow.fill(np.array([b]), pressure=4e3)
    found = applied(sim)
    assert len(found) == 4
    assert np.abs(sum(found.values())).max() < 1e-12
    for corner, force in found.items():
        p, q = (1e3, 4e3) if sim.mesh.cells[corner // 4, corner % 4] == a else (4e3, 1e3)
        assert np.hypot(*force) == pytest.approx(np.sqrt(2.0) * (2.0 * p + q) / 6.0, rel=1e-6)
        outward = sim.mesh.centroids()[corner // 4] - 0.5
        assert force @ outward > 0.0  # away from the channel


def test_wet_surfaces_are_pushed_too() -> None:
    """A body full of fluid of one pressure, on all joints and its surface: nothing pushes it away, and the elements
    carry that pressure."""
    mesh = structured.rectangle(np.linspace(0.0, 1.0, 4), np.linspace(0.0, 0.75, 4), "tri", "both")
    sim = model(mesh)
    flow = Flow.of(sim)
    flow.assign(None, WATER)
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", JOINT)
    sim.option(dynamic=False, collision=False)
    sim.flow_clock(dt=1e-9)
    assert len(flow.numbers("flow-node")) == len(mesh.points)
    flow.fill(None, pressure=1e6)
    hold(flow, flow.numbers("flow-node"), 1e6)
    found = applied(sim)
    assert np.abs(sum(found.values())).max() < 1e-8 and len(found) == 3 * len(mesh.cells)
    convergence.solve(sim, ratio=1e-6)
    for name in ("stress_xx", "stress_yy"):
        assert diagnostics.values(sim, name) == pytest.approx(-1e6, rel=1e-3)


def test_pressure_opens_a_joint() -> None:
    """1 MPa in the joint, ends held: sigma = lambda' eps in both halves, opening as the joint's law says."""
    sim, flow = split()
    sim.flow_clock(dt=1e-6)
    hold(flow, flow.numbers("flow-node"), 1e6)
    flow.fill(None, pressure=1e6)
    convergence.solve(sim, ratio=1e-7)
    joints = flow.network.channels
    opening, stress = diagnostics.values(sim, "opening", joints), diagnostics.values(sim, "normal_stress", joints)
    young, nu = 50e9, 0.25
    stiff = young * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    rock = diagnostics.values(sim, "stress_yy")
    assert rock == pytest.approx(
        stress.mean() - 1e6, rel=1e-3
    )  # the halves feel the pressure less what the joint holds
    assert opening == pytest.approx(-rock.mean() / stiff * 0.5, rel=1e-3)
    found = flow.values("flow-channel", "aperture")
    assert found == pytest.approx(1e-4 + opening, rel=1e-9) and (opening > 1e-7).all()


def test_one_way_does_not_push() -> None:
    sim, flow = split()
    sim.parts(one_way=True)
    sim.flow_clock(dt=1e-6)
    flow.fill(None, pressure=1e6)
    run(sim, 50)
    assert np.abs(diagnostics.values(sim, "stress_yy")).max() == 0.0
    assert not applied(sim)


def test_fluid_that_is_pressed_has_a_pressure() -> None:
    """Undrained: the volume of the fluid stays, its pressure rises as its room shrinks; one way it is the same."""
    for one_way in (False, True):
        sim, flow = split(fluid_bulk=1e6)
        sim.parts(one_way=one_way)
        sim.flow_clock(dt=1e-3)
        flow.fill(None, saturation=1.0)
        sim.velocity_condition(at(sim, y=0.5), vy=-1e-9)
        before = flow.account()["stored"]
        run(sim, 500)
        room = flow.nodes[:, kernels.V]
        assert flow.account()["stored"] == before and flow.account()["relative"] < 1e-13
        assert flow.state[: len(room), kernels.P] == pytest.approx(
            1e6 * (flow.nodes[:, kernels.W] / room - 1.0), rel=1e-9
        )
        assert flow.state[:, kernels.P].max() > 10.0
        assert (np.abs(diagnostics.values(sim, "normal_stress", flow.network.channels)) > 1.0).all()


def test_stiff_fluid_shortens_the_time_step() -> None:
    """K L / (2 delta) at each corner of a channel, beside half the penalty of the joint."""
    steps = {}
    for bulk in (1e6, 2.2e9):
        sim, _ = split(True, fluid_bulk=bulk)
        sim.close_model()
        steps[bulk] = sim.clock.dt
        extra = Flow.of(sim).springs(sim)
        assert extra[extra > 0.0] == pytest.approx(bulk * 0.25 / 2e-4, rel=1e-9)
    assert steps[2.2e9] < 0.5 * steps[1e6]
    sim.flow_clock(every=5)
    sim.close_model()
    assert sim.clock.dt > 1.9 * steps[2.2e9]
    sim.flow_clock(every=1)
    sim.parts(one_way=True)
    sim.close_model()
    assert sim.clock.dt > 1.9 * steps[2.2e9]


def test_the_clocks() -> None:
    """Without anything said flow takes the time of the blocks, in sub-steps that are stable."""
    sim, flow = split(True, fluid_bulk=1e7)
    flow.fill(None, saturation=1.0)
    run(sim, 20)
    assert flow.time == pytest.approx(sim.clock.time, rel=1e-12) and flow.dt <= flow.limit()
    assert flow.dt * flow.sub_steps == pytest.approx(sim.clock.dt)
    sim.flow_clock(every=4, steps=3)
    cycles, begun = flow.cycles, flow.time
    run(sim, 8)
    assert flow.cycles == cycles + 2 and flow.time - begun == pytest.approx(8 * sim.clock.dt)
    sim.flow_clock(dt=1e-8)
    begun = flow.time
    run(sim, 4)
    assert flow.time - begun == pytest.approx(3e-8)


def test_excavation_takes_its_fluid_away() -> None:
    sim = model(rectangle(4, 2, 1.0, 0.5))
    flow = Flow.of(sim)
    flow.assign(None, WATER)
    sim.parts(mechanical=False)
    flow.fill(None, pressure=1e5)
    run(sim, 3)
    before, channels = flow.account(), len(flow.network.channels)
    gone = np.flatnonzero(sim.mesh.centroids()[:, 0] < 0.5)
    changes.null(sim, gone)
    run(sim, 3)
    after = flow.account()
    assert len(flow.network.channels) < channels and not np.isin(flow.network.channels // 4, gone).any()
    assert after["removed"] > 0.4 * before["stored"] and after["relative"] < 1e-13
    assert flow.values("flow-node", "pressure") == pytest.approx(1e5, rel=1e-6)  # what stays is as it was


@pytest.mark.slow
def test_pressure_breaks_joints_and_lists_follow() -> None:
    """A jointed block that bursts: the fluid's account closes, and the energy's, in which it is work from outside. Its
    pieces turn as they fly apart: channels get short, and flow needs ever more sub-steps within 100 cycles."""
    sim = model(rectangle(6, 4, 0.6, 0.4))
    joints = inner(sim.mesh)
    sim.joint_model(joints, "classic_intrinsic_cohesive_interface", {**JOINT, "gf1": 5.0, "gf2": 5.0})
    flow = Flow.of(sim)
    flow.assign(joints, {**CRACK, "aperature_maximum": 1e-3})
    diagnostics.account_energy(sim)
    hold(flow, at(sim, 0.3, 0.2), 30e6)
    run(sim, 1500)
    energies = diagnostics.energies(sim)
    assert diagnostics.joint_counts(sim)[2] > 3 and energies["work_outside"] > 0.0
    assert energies["relative"] < 0.02
    assert flow.account()["relative"] < 1e-11
    assert (flow.values("flow-channel", "aperture") > 5e-4).any()

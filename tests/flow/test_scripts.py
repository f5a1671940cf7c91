"""Fluid in models that are made by commands: steady flow around a hole, histories, what a script cannot do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands import fdem
from hpcdem.commands.fdem import frames
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.groups import CHANNEL, FLOW_NODE, JOINT, NODE, Ids, InGroup, OnLayer, Span
from hpcdem.physics.fdem.simulation import Blocks
from tests.conftest import absent
from tests.flow import exact
from tests.flow.support import WATER

ROCK = {"density": 2500.0, "young": 50e9, "poisson_ratio": 0.25}


def project(tmp_path) -> fdem.Project:
    return fdem.Project(Blocks(SerialComm()), outdir=tmp_path / "out")


@pytest.mark.slow  # quick: tests/cases/water
def test_steady_flow_around_a_hole(tmp_path) -> None:
    """9.11: 10 MPa at r = 1 m, 1 MPa at r = 5 m; 1 % of 9 MPa in the mean over rings, what comes in goes out."""
    try:
        import gmsh  # noqa: F401
    except ImportError:
        absent("gmsh", "no package gmsh here: install the extra [mesh]")
    model = project(tmp_path)
    for name, radius in (("out", 5.0), ("hole", 1.0)):
        fdem.geometry.create(model, "circle", name, (0.0, 0.0), radius)
    fdem.meshes.create(model, "out", 0.15, hole=["hole"])
    fdem.assignments.element_model(model, "mech_iso_elastic", ROCK)
    fdem.flow.model(model, {**WATER, "fluid_bulk": 1e9})
    fdem.settings.option(model, mechanical=False)
    fdem.flow.initial(model, pressure=3e6)
    fdem.flow.condition(model, pressure=10e6, where=(OnLayer("hole"),))
    fdem.flow.condition(model, pressure=1e6, where=(OnLayer("out"),))
    for name, layer in (("in", "hole"), ("out", "out")):
        fdem.assignments.group(model, NODE, name, where=(OnLayer(layer),))
    fdem.steps.step(model, 30_000)
    nodes = fdem.queries.numbers(model, FLOW_NODE)
    radius = np.hypot(*model.mesh.points[nodes].T)
    error = fdem.queries.values(model, FLOW_NODE, "pressure") - exact.radial(radius, (1.0, 10e6), (5.0, 1e6))
    for r, wanted in ((1.5, 7.7326e6), (2.0, 6.1239e6), (3.0, 3.8565e6), (4.0, 2.2478e6)):
        assert float(exact.radial(np.array([r]), (1.0, 10e6), (5.0, 1e6))[0]) == pytest.approx(wanted, rel=1e-4)
        ring = np.abs(radius - r) < 0.15
        assert abs(error[ring].mean()) < 0.01 * 9e6
    into, out = (fdem.queries.total(model, FLOW_NODE, "inflow", (InGroup(name),)) for name in ("in", "out"))
    assert into == pytest.approx(-out, rel=1e-6) and into > 0.0


def strip(tmp_path) -> fdem.Project:
    model = project(tmp_path)
    fdem.meshes.grid(model, (0.0, 0.0), (4.0, 2.0), (4, 2))
    fdem.assignments.element_model(model, "mech_iso_elastic", ROCK)
    return model


def test_histories_ranges_and_groups_of_nodes(tmp_path) -> None:
    model = strip(tmp_path)
    with pytest.raises(CommandError, match="no channels yet"):
        fdem.queries.numbers(model, FLOW_NODE)
    fdem.flow.model(model, WATER)
    fdem.settings.option(model, mechanical=False)
    fdem.assignments.group(model, NODE, "left", where=(Span(0, 0.0, 0.0),))
    fdem.assignments.group(model, JOINT, "upright", where=(Span(0, 2.0, 2.0),))
    fdem.flow.initial(model, saturation=1.0)
    fdem.flow.condition(model, pressure=1e5, where=(InGroup("left"),))
    fdem.histories.create(model, "p", FLOW_NODE, "pressure", nearest=(0.0, 1.0), every=5)
    fdem.histories.create(model, "in", FLOW_NODE, "inflow", how="sum", every=5, where=(InGroup("left"),))
    fdem.histories.create(model, "q", CHANNEL, "velocity", how="maximum", every=5)
    fdem.histories.create(model, "given", "model", "fluid_given", every=5)
    fdem.histories.create(model, "time", "model", "flow_time", every=5)
    fdem.steps.step(model, 20)
    rows = {name: np.array(history.rows) for name, history in model.histories.items()}
    assert (rows["p"][:, 2] == pytest.approx(1e5, rel=1e-6)) and len(rows["p"]) == 4
    assert (rows["in"][:, 2] > 0.0).all() and (rows["q"][:, 2] > 0.0).all()
    assert (np.diff(rows["given"][:, 2]) > 0.0).all()
    flow = model.blocks.surface_loads
    assert rows["time"][-1, 2] == pytest.approx(model.blocks.clock.time) and "fluid" in flow
    assert len(fdem.queries.values(model, CHANNEL, "aperture", (InGroup("upright"),))) == 2
    with pytest.raises(CommandError, match="there is no node 1000000"):
        fdem.queries.values(model, FLOW_NODE, "pressure", (Ids(10**6, 10**6),))
    assert fdem.queries.fluid(model)["relative"] < 1e-12


def test_what_a_script_cannot_do(tmp_path) -> None:
    model = strip(tmp_path)
    with pytest.raises(CommandError, match="no channels yet"):
        fdem.flow.condition(model, pressure=1.0)
    with pytest.raises(CommandError, match="needs viscosity"):
        fdem.flow.model(model, {name: value for name, value in WATER.items() if name != "viscosity"})
    assert "fluid" not in model.blocks.surface_loads
    fdem.flow.model(model, WATER)
    with pytest.raises(CommandError, match="one of pressure, flow_surface, flow_rate, got pressure and flow_rate"):
        fdem.flow.condition(model, pressure=1.0, flow_rate=1.0)
    fdem.settings.option(model, mechanical=False)
    with pytest.raises(CommandError, match="no unbalanced forces"):
        fdem.steps.solve(model, ratio=1e-5)
    with pytest.raises(CommandError, match="use model option mechanical on first"):
        fdem.steps.solve_elastic(model)
    fdem.steps.solve(model, time=1e-9)
    assert math.isfinite(model.blocks.clock.time)
    fdem.flow.condition(model, pressure=1e5)
    fdem.assignments.remove_node_conditions(model)
    fdem.flow.remove_conditions(model)
    before = fdem.queries.fluid(model)["given"]
    fdem.steps.step(model, 3)
    assert fdem.queries.fluid(model)["given"] == before


def test_frames_hold_the_fluid_of_joints(tmp_path) -> None:
    """Channels without a cohesive model are lines of their own."""
    model = strip(tmp_path)
    assert "aperture" not in frames.whole(model).of_joints
    upright = (Span(0, 2.0, 2.0),)
    cohesive = {"cohesion": 1e6, "tensile_strength": 1e6, "gf1": 10.0, "gf2": 10.0}
    fdem.assignments.joint_model(model, "classic_intrinsic_cohesive_interface", cohesive, upright)
    before = frames.whole(model).of_joints
    fdem.flow.model(model, WATER, where=(Span(1, 1.0, 1.0),))
    fdem.flow.initial(model, pressure=2e5)
    found = frames.whole(model).of_joints
    wet = ~np.isnan(found["aperture"])
    assert len(before["state"]) == 2 and len(found["state"]) == 6 and wet.sum() == 4
    assert (found["state"][wet] == 1.0).all() and found["length"][wet] == pytest.approx(1.0)
    assert found["fluid_pressure"][wet] == pytest.approx(2e5) and found["aperture"][wet] == pytest.approx(1e-5)
    assert (found["saturation"][wet] == 1.0).all() and np.isnan(found["opening"][wet]).all()
    assert np.abs(found["flow_rate"][wet]).max() < 1e-15 and np.abs(found["fluid_velocity"][wet]).max() < 1e-9

"""Fluid that tears a block apart, and water that seeps: models for tests/parallel/test_models.py."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem import changes, diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.wells import PRESSURE, QUANTITIES, RATE, SHUT
from tests.blocks.models import COHESIVE, WEAK
from tests.blocks.support import ROCK, rectangle, shaken
from tests.bolts.models import WEAKER
from tests.flow.support import WATER, inner
from tests.parallel.model import Found, Model
from tests.space.support import box

LEAKS = {
    "leak_off": 1.0, "matrix_permeability": 1e-14, "matrix_porosity": 0.2, "matrix_porosity_compressibility": 1e-9,
}  # fmt: skip
WIDE = {
    **WATER, "fluid_bulk": 1e7, "aperature_initial": 2e-4, "aperature_minumum": 5e-5, "aperature_maximum": 5e-3,
    "turbulence": 1.0,
}  # fmt: skip


SOIL = {
    "density": 2000.0, "young": 1e8, "poisson_ratio": 0.3, "friction": 20.0, "cohesion": 4e3, "tensile": 2e3,
    "dilation": 5.0,
}  # fmt: skip


def bursting(sim: Blocks) -> None:
    """A jointed block is torn apart by fluid that is pumped into it, while it flies to the right, through the strips
    of the ranks."""
    sim.take_mesh(shaken(rectangle(16, 6, 1.6, 0.6, kind="mixed"), 0.2))
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "friction": 20.0, "damp_factor": 0.05})
    joints = inner(sim.mesh)
    sim.joint_model(joints, COHESIVE, WEAK)
    sim.gravity(3.0, -9.81)
    x = sim.mesh.points[:, 0]
    for one in np.unique(np.round(x, 1)):
        changes.set_velocity(sim, np.flatnonzero(np.round(x, 1) == one), vx=150.0 + 6.0 * one, vy=4.0 * one)
    flow = Flow.of(sim)
    flow.assign(joints[joints % 7 > 0], {**WIDE, **LEAKS})
    flow.adjust(joints[joints % 7 > 3], {"matrix_saturation": 0.4, "matrix_porosity_compressibility": 0.0})
    flow.fill(np.flatnonzero(x < 0.5), pressure=3e4)
    flow.fill(np.flatnonzero(x > 1.1), saturation=0.6)
    sim.table("pump", [(0.0, 0.0), (2e-3, 2e6), (1.0, 2e6)])
    flow.prescribe(np.flatnonzero(np.hypot(*(sim.mesh.points - (0.8, 0.3)).T) < 0.12), kernels.PRESSURE, "pump")
    flow.prescribe(np.flatnonzero(x > 1.55), kernels.SURFACE, 0.4)
    flow.prescribe(np.flatnonzero(x < 0.05), kernels.RATE, 1e-3)


def more(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 300:
        changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 1] < 0.1)[3:9])
    if sim.clock.step == 600:
        Flow.of(sim).assign(np.flatnonzero(sim.joint_exists())[:40:3], {**WIDE, **LEAKS, "aperature_initial": 1e-4})
        sim.flow_clock(every=3)


def pumped(sim: Blocks) -> None:
    """The same with wells across the strips of the ranks in place of conditions, in channels that slip opens further;
    stages end where steps do not, one of them after the checkpoint."""
    bursting(sim)
    flow = Flow.of(sim)
    flow.remove_conditions(None)
    flow.adjust(None, {"shear_dilation": 20.0, "shear_dilation_limit": 4e-3})
    points = sim.mesh.points
    flow.drill("long", np.flatnonzero((np.abs(points[:, 1] - 0.3) < 0.03) & (points[:, 0] > 0.3)))
    flow.drill("short", np.flatnonzero(points[:, 0] < 0.05))
    flow.stage("long", RATE, 10.0, 1.23e-3, 2e6)
    flow.stage("long", SHUT, 0.0, 2.1e-4, math.inf)
    flow.stage("long", RATE, 10.0, math.inf, 1e6)
    flow.stage("short", PRESSURE, "pump", 1.7e-3, math.inf)
    flow.stage("short", RATE, -1e-2, math.inf, math.inf)


def seeping(sim: Blocks) -> None:
    """Water rises in a block that stands still, then moves."""
    sim.take_mesh(shaken(rectangle(20, 6, 2.0, 0.6), 0.2))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    flow = Flow.of(sim)
    flow.assign(None, {**WATER, "fluid_bulk": 1e5})
    sim.gravity(0.0, -9.81)
    x = sim.mesh.points[:, 0]
    flow.prescribe(np.flatnonzero(x == 0.0), kernels.SURFACE, 0.5)
    flow.prescribe(np.flatnonzero(x == 2.0), kernels.SURFACE, 0.2)
    sim.parts(mechanical=False)


def move(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 900:
        sim.option(dynamic=False, collision=False)
        sim.parts(mechanical=True)
        sim.flow_clock(dt=0.01)
        sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 1] == 0.0), vx=0.0, vy=0.0)


def resting(sim: Blocks) -> None:
    """Rock that yields, with bolts, water in some of its joints and a well: in relaxation, then in motion."""
    sim.take_mesh(shaken(rectangle(16, 6, 1.6, 0.6), 0.2))
    changes.element_model(sim, None, "mech_mohr_coulomb", SOIL)
    joints = inner(sim.mesh)
    sim.joint_model(joints[::3], COHESIVE, {**WEAK, "cohesion": 4e3, "tensile_strength": 1e3})
    sim.gravity(0.0, -9.81)
    sim.option(dynamic=False, collision=False)
    y = sim.mesh.points[:, 1]
    sim.velocity_condition(np.flatnonzero(y == 0.0), vx=0.0, vy=0.0)
    bolts = Bolts.of(sim)
    for x in (0.33, 1.01):
        _, elements = bolts.create([(x, 0.6), (x + 0.1, 0.1)], plate=True, grout=(0.2, 0.6))
        bolts.assign(elements, {**WEAKER, "pretension_force": 3e3})
    flow = Flow.of(sim)
    flow.assign(joints[joints % 5 > 0], {**WATER, "fluid_bulk": 1e6, "aperature_initial": 1e-4, "shear_dilation": 5.0})
    flow.fill(np.flatnonzero(y < 0.3), pressure=2e3)
    sim.flow_clock(dt=1e-3)
    flow.drill("pump", np.flatnonzero((np.abs(y - 0.3) < 0.03) & (sim.mesh.points[:, 0] < 1.2)))
    flow.stage("pump", RATE, 1e-3, 0.2005, 6e4)
    flow.stage("pump", SHUT, 0.0, math.inf, math.inf)


def dig(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 250:
        changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 0] < 0.4), relax=150.0)
    if sim.clock.step in (290, 320):  # fluid stays as it is meanwhile, over the checkpoint
        sim.parts(hydraulic=sim.clock.step == 320)
    if sim.clock.step == 450:
        sim.option(dynamic=True)
        sim.flow_clock(dt=0.0, every=2)
        Flow.of(sim).stage("pump", PRESSURE, 2e4, math.inf, math.inf)


def tearing(sim: Blocks) -> None:
    """A jointed bar of tetrahedra is torn apart by fluid that is pumped into it by a well, held at a pressure, drawn,
    and stands at a level, while it flies through the strips of the ranks; some of its joints are no channels."""
    sim.take_mesh(box((16, 2, 2), (1.6, 0.2, 0.2), 6, shaken=0.2))
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "friction": 20.0, "damp_factor": 0.05})
    joints = inner(sim.mesh)
    sim.joint_model(joints, COHESIVE, WEAK)
    sim.gravity(3.0, 1.0, -9.81)
    x, y, z = sim.mesh.points.T
    for one in np.unique(np.round(x, 1)):
        at = np.flatnonzero(np.round(x, 1) == one)
        changes.set_velocity(sim, at, 150.0 + 6.0 * one, 4.0 * one, 2.0)
    flow = Flow.of(sim)
    flow.assign(joints[joints % 7 > 0], {**WIDE, **LEAKS, "shear_dilation": 10.0, "shear_dilation_limit": 4e-3})
    flow.fill(np.flatnonzero(x < 0.4), pressure=3e4)
    flow.fill(np.flatnonzero(x > 1.1), saturation=0.6)
    sim.table("pump", [(0.0, 0.0), (2e-3, 2e6), (1.0, 2e6)])
    flow.prescribe(np.flatnonzero((x > 0.75) & (x < 0.95) & (z < 0.15)), kernels.PRESSURE, "pump")
    flow.prescribe(np.flatnonzero(x > 1.55), kernels.SURFACE, 0.15)
    flow.prescribe(np.flatnonzero((x < 0.05) & (y > 0.1)), kernels.RATE, -1e-4)
    flow.drill("long", np.flatnonzero((np.abs(y - 0.1) < 0.03) & (np.abs(x - 0.4) < 0.35) & (x > 0.06)))
    flow.stage("long", RATE, 0.4, 4.53e-4, 2e6)
    flow.stage("long", SHUT, 0.0, 2.1e-4, math.inf)
    flow.stage("long", RATE, 0.4, math.inf, 1e6)


def more_in_space(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 100:
        changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 2] < 0.05)[3:9])
    if sim.clock.step == 250:
        Flow.of(sim).assign(np.flatnonzero(sim.joint_exists())[:60:3], {**WIDE, **LEAKS, "aperature_initial": 1e-4})
        sim.flow_clock(every=3)


def seeping_in_space(sim: Blocks) -> None:
    """Water rises in tetrahedra that stand still, then are at rest, pushed by it."""
    sim.take_mesh(box((12, 2, 3), (2.4, 0.4, 0.6), 5, shaken=0.2))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    flow = Flow.of(sim)
    flow.assign(None, {**WATER, "fluid_bulk": 1e5})
    sim.gravity(0.0, 0.0, -9.81)
    x = sim.mesh.points[:, 0]
    flow.prescribe(np.flatnonzero(x == 0.0), kernels.SURFACE, 0.5)
    flow.prescribe(np.flatnonzero(x == 2.4), kernels.SURFACE, 0.2)
    sim.parts(mechanical=False)


def move_in_space(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 400:
        sim.option(dynamic=False, collision=False)
        sim.parts(mechanical=True)
        sim.flow_clock(dt=0.01)
        sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 2] == 0.0), vx=0.0, vy=0.0, vz=0.0)


def all_of_it(sim: Blocks, notes: dict[str, Any]) -> Found:
    """That of the fluid, of bolts and of plastic flow."""
    found = result(sim, notes)
    found["plastic"] = diagnostics.values(sim, "plastic_shear_strain")
    found["axial"] = Bolts.of(sim).values("bolt-element", "axial_force")
    return found


def result(sim: Blocks, notes: dict[str, Any]) -> Found:
    """All that may not depend on ranks."""
    found = {name: diagnostics.values(sim, name) for name in ("position_x", "velocity_y", "stress_xx")}
    flow = Flow.of(sim)
    for on in ("flow-node", "flow-channel"):
        found[f"numbers_{on}"] = flow.numbers(on)
        for name in ("pressure", "saturation"):
            found[f"{on}_{name}"] = flow.values(on, name)
    for name in ("fluid", "volume", "inflow"):
        found[f"flow-node_{name}"] = flow.values("flow-node", name)
    for name in ("aperture", "flow_rate"):
        found[f"flow-channel_{name}"] = flow.values("flow-channel", name)
    found.update({f"account_{name}": np.array(value) for name, value in flow.account().items()})
    for name in (well.name for well in flow.wells):
        for value in QUANTITIES:
            found[f"well_{name}_{value}"] = np.array(flow.well_value(name, value))
    found["counts"] = np.array(diagnostics.joint_counts(sim))
    found["clock"] = np.array([flow.time, flow.dt, flow.sub_steps, flow.cycles, sim.clock.time])
    return found


def water_moves(found: Found) -> None:
    wet = found["flow-node_saturation"]
    assert (wet == 1.0).sum() > 10 and ((wet > 0.0) & (wet < 1.0)).sum() > 5
    assert found["flow-node_pressure"].max() > 1e3
    assert found["account_relative"] < 1e-11 and found["account_stored"] > 0.0


def water_bursts(found: Found) -> None:
    water_moves(found)
    assert found["counts"][2] > 20 and found["account_leaked"] > 0.0 and found["account_removed"] > 0.0
    assert np.ptp(found["flow-channel_aperture"]) > 1e-3


def it_tears(found: Found) -> None:
    water_moves(found)
    assert found["counts"][2] > 50 and found["account_leaked"] > 0.0 and found["account_removed"] > 0.0
    assert np.ptp(found["flow-channel_aperture"]) > 1e-3
    assert found["well_long_stage"] == 3.0 and found["well_long_injected"] > 0.0


def wells_pump(found: Found) -> None:
    water_bursts(found)
    assert found["well_long_stage"] == 3.0 and found["well_short_stage"] == 2.0
    assert found["well_long_injected"] > 0.0 and found["well_short_rate"] < 0.0


def all_acts(found: Found) -> None:
    assert found["account_relative"] < 1e-11 and found["account_removed"] > 0.0
    assert found["well_pump_stage"] == 3.0 and found["well_pump_injected"] > 0.0
    assert found["flow-node_pressure"].max() > 1e3 and np.abs(found["axial"]).max() > 10.0
    assert np.nanmax(found["plastic"]) > 0.0 and np.ptp(found["flow-channel_aperture"]) > 1e-7


# Checkpoints after excavation and a change of channels.
MODELS = {
    "bursting": Model(bursting, result, water_bursts, more, steps=1100, middle=703, slow=True),
    "pumped": Model(pumped, result, wells_pump, more, steps=1100, middle=703, slow=True),
    "wet soil with bolts": Model(resting, all_of_it, all_acts, dig, steps=550, middle=303),
    "seeping": Model(seeping, result, water_moves, move, steps=1100, middle=703, slow=True),
    "tearing in space": Model(tearing, result, it_tears, more_in_space, steps=900, middle=303, slow=True),
    "seeping in space": Model(seeping_in_space, result, water_moves, move_in_space, steps=600, middle=303, slow=True),
}

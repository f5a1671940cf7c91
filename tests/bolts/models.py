"""Bolts that are pulled apart, excavated, installed in mid-run: models for tests/parallel/test_models.py."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.physics.bolts import kernels
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem import changes, diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.models import COHESIVE, WEAK
from tests.blocks.support import ROCK, rectangle, shaken
from tests.bolts.support import STEEL, state
from tests.parallel.model import Found, Model
from tests.space.support import ROCK as SOLID
from tests.space.support import box

WEAKER = {
    **STEEL, "tensile_yield_force": 4e3, "tension_failure_strain": 2e-3, "friction_rock_grout": 25.0,
    "friction_grout_bolt": 30.0, "cohesion_rock_grout": 2e4, "cohesion_grout_bolt": 3e4, "spacing": 1.3,
}  # fmt: skip


def breaking(sim: Blocks) -> None:
    """A jointed block with bolts is torn apart: bars yield and rupture, grout slips, while all flies to the right,
    through the strips of the ranks."""
    sim.take_mesh(shaken(rectangle(16, 6, 1.6, 0.6, kind="mixed"), 0.2))
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "friction": 20.0, "damp_factor": 0.05})
    inner = sim.mesh.edges()
    sim.joint_model(inner.faces[inner.inner][:, 0], COHESIVE, WEAK)
    x = sim.mesh.points[:, 0]
    for one in np.unique(np.round(x, 1)):
        changes.set_velocity(sim, np.flatnonzero(np.round(x, 1) == one), vx=150.0 + 6.0 * one, vy=4.0 * one)
    bolts = Bolts.of(sim)
    for y in (0.1, 0.33):
        _, elements = bolts.create([(0.0, y), (1.6, y + 0.07)], plate=True)
        bolts.assign(elements, {**WEAKER, "pretension_force": 1e3})
    diagnostics.account_energy(sim)


def more(sim: Blocks) -> None:
    """What happens to them."""
    if sim.clock.step == 500:  # installed in the middle of the run
        at = diagnostics.values(sim, "position_x"), diagnostics.values(sim, "position_y")
        a, b = (tuple(float(v[n]) for v in at) for n in (3, len(at[0]) - 4))
        bolts = Bolts.of(sim)
        _, elements = bolts.create([a, b], length=0.05, grout=(0.3, 9.0), plate=True)
        bolts.assign(elements, {**WEAKER, "pretension_force": 2e3})
        bolts.condition(np.array([0]), force_x=-500.0)
    if sim.clock.step == 900:  # hosts of the first bolt go
        host = Bolts.of(sim).nodes["host"]
        changes.null(sim, np.unique(host[(Bolts.of(sim).nodes["bar"] == 0) & (host >= 0)])[:6])


def relaxing(sim: Blocks) -> None:
    """The same block at rest, static mode, pulled by its bolts."""
    sim.take_mesh(rectangle(16, 6, 1.6, 0.6))
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 1e8})
    sim.option(dynamic=False, collision=False)
    sim.gravity(0.0, -9.81)
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 1] == 0.0), vx=0.0, vy=0.0)
    bolts = Bolts.of(sim)
    for x in (0.33, 1.21):
        _, elements = bolts.create([(x, 0.6), (x + 0.1, 0.1)], plate=True, grout=(0.2, 0.6))
        bolts.assign(elements, {**WEAKER, "pretension_force": 3e3})


def excavate(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 600:
        changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 0] < 0.4), relax=200.0)
    if sim.clock.step == 1000:
        sim.option(dynamic=True)


def in_space(sim: Blocks) -> None:
    """A jointed bar of tetrahedra with bolts along and across it is torn apart while it flies along itself, through the
    strips of the ranks."""
    sim.take_mesh(box((14, 2, 2), (1.4, 0.2, 0.2), 5, shaken=0.2))
    mesh = sim.mesh
    changes.element_model(sim, None, "mech_iso_elastic", {**SOLID, "young": 1e9, "friction": 20.0, "damp_factor": 0.05})
    edges = mesh.edges()
    sim.joint_model(edges.faces[edges.inner][:, 0], COHESIVE, {**WEAK, "penalty_normal": 1e10, "tensile_strength": 1e5})
    sim.initial_stress(None, yy=-2e4, xz=1e4)
    x = mesh.points[:, 0]
    for one in np.unique(np.round(x, 1)):
        at = np.flatnonzero(np.round(x, 1) == one)
        changes.set_velocity(sim, at, 100.0 + 6.0 * float(one), 4.0 * float(one), -3.0 * float(one))
    bolts = Bolts.of(sim)
    for line in ([(0.0, 0.05, 0.08), (1.4, 0.13, 0.11)], [(0.1, 0.0, 0.2), (0.4, 0.1, 0.1), (1.0, 0.2, 0.0)]):
        _, elements = bolts.create(line, plate=True)
        bolts.assign(elements, {**WEAKER, "pretension_force": 1e3, "spacing": 1.0})


def more_in_space(sim: Blocks) -> None:
    """What happens to them."""
    bolts = Bolts.of(sim)
    if sim.clock.step == 300:
        at = np.column_stack([diagnostics.values(sim, f"position_{axis}") for axis in "xyz"])
        _, elements = bolts.create([tuple(at[4]), tuple(at[-5])], length=0.05, grout=(0.2, 9.0), plate=True)
        bolts.assign(elements, {**WEAKER, "pretension_force": 2e3, "spacing": 1.0})
        bolts.condition(np.array([0]), force_z=-500.0, does_y=kernels.VELOCITY, at_y=2.0)
    if sim.clock.step == 500:
        host = bolts.nodes["host"]
        changes.null(sim, np.unique(host[(bolts.nodes["bar"] == 0) & (host >= 0)])[:6])


def result(sim: Blocks, notes: dict[str, Any]) -> Found:
    """All that may not depend on ranks."""
    found = {name: diagnostics.values(sim, name) for name in ("position_x", "velocity_y", "stress_xx", "damage")}
    found.update(state(Bolts.of(sim)))
    found["counts"] = np.array(diagnostics.joint_counts(sim))
    found["ratio"] = np.array(diagnostics.unbalanced_ratio(sim))
    if sim.budget is not None:
        found.update({f"energy_{name}": np.array(value) for name, value in diagnostics.energies(sim).items()})
        found.update({f"bolts_{name}": np.array(value) for name, value in Bolts.of(sim).energies().items()})
    return found


def grout_slips(found: Found) -> None:
    grout, host = found["node_bond_state"], found["node_host"]
    assert (host < 0).sum() >= 3 and (grout & kernels.SLIPPED).sum() > 10
    assert np.abs(found["element_force"]).max() > 100.0


def bars_rupture(found: Found) -> None:
    grout_slips(found)
    bars = found["element_state"]
    assert (bars & kernels.RUPTURED).any() and (bars & kernels.WAS_IN_TENSION).sum() > 10
    assert not (bars & kernels.RUPTURED).all() and found["counts"][2] > 20
    assert found["energy_relative"] < 0.01 and found["bolts_relative"] < 0.01
    assert found["bolts_lost_in_bars"] > 1.0 and found["bolts_lost_in_grout"] > 1.0
    assert found["bolts_work_on_rock"] == found["energy_work_bolts"] > 50.0


def in_pieces(found: Found) -> None:
    grout_slips(found)
    bars = found["element_state"]
    assert (bars & kernels.RUPTURED).any() and not (bars & kernels.RUPTURED).all() and found["counts"][2] > 20
    assert np.abs(found["node_x"][:, 1:] - found["node_origin"][:, 1:]).max() > 1e-3


# Checkpoints after rupture, excavation, and the change to motion.
MODELS = {
    "bolts torn": Model(breaking, result, bars_rupture, more, steps=1400, middle=1101, slow=True),
    "bolts in space": Model(in_space, result, in_pieces, more_in_space, steps=900, middle=601, slow=True),
    "bolts at rest": Model(relaxing, result, grout_slips, excavate, steps=1400, middle=1101, slow=True),
}

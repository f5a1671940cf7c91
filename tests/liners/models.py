"""Liners that are torn apart, excavated, put on and deleted in mid-run: models for tests/parallel/test_models.py."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.physics.fdem import changes, diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.liners import kernels
from hpcdem.physics.liners.model import Liners
from tests.blocks.models import COHESIVE, WEAK
from tests.blocks.support import ROCK, near, rectangle, shaken
from tests.liners.support import SHOTCRETE, state
from tests.parallel.model import Found, Model
from tests.space.support import box, faces_on

WEAKER = {
    **SHOTCRETE, "young": 2e9, "thickness": 0.02, "tensile_strength": 3e5, "compressive_strength": 2e6,
    "bond_tensile_strength": 1e5, "bond_cohesion": 5e4, "bond_friction": 30.0,
}  # fmt: skip


def breaking(sim: Blocks) -> None:
    """A jointed block with a liner on its top is torn apart: the liner yields, slips and parts from the rock, while all
    flies to the right, through the strips of the ranks."""
    mesh = shaken(rectangle(16, 6, 1.6, 0.6, kind="mixed"), 0.2)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "friction": 20.0, "damp_factor": 0.05})
    inner = sim.mesh.edges()
    sim.joint_model(inner.faces[inner.inner][:, 0], COHESIVE, WEAK)
    x = sim.mesh.points[:, 0]
    for one in np.unique(np.round(x, 1)):
        changes.set_velocity(sim, np.flatnonzero(np.round(x, 1) == one), vx=150.0 + 6.0 * one, vy=4.0 * one)
    liners = Liners.of(sim)
    _, elements = liners.create(near(mesh, 1, 0.6))
    liners.assign(elements, WEAKER)
    diagnostics.account_energy(sim)


def in_space(sim: Blocks) -> None:
    """A jointed body with a liner on two of its sides is torn apart and turns, through the strips of the ranks."""
    mesh = box((14, 2, 2), (2.8, 0.4, 0.4), shaken=0.2)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "friction": 20.0, "damp_factor": 0.05})
    inner = sim.mesh.edges()
    sim.joint_model(inner.faces[inner.inner][:, 0], COHESIVE, WEAK)
    x, y, _ = mesh.points.T
    for i in range(len(x)):
        changes.set_velocity(sim, np.array([i]), vx=150.0 + 12.0 * x[i], vy=8.0 * x[i], vz=20.0 * y[i])
    liners = Liners.of(sim)
    _, elements = liners.create(np.concatenate([faces_on(mesh, "top"), faces_on(mesh, "front")]))
    liners.assign(elements, WEAKER)
    diagnostics.account_energy(sim)


def more_in_space(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 60:  # another one in the middle of the run, and a force
        liners = Liners.of(sim)
        _, elements = liners.create(faces_on(sim.mesh, "bottom"))
        liners.assign(elements, {**WEAKER, "thickness": 0.04})
        liners.condition(np.array([0]), force_z=-500.0, moment_x=20.0)
    if sim.clock.step == 90:  # hosts go, and elements
        liners = Liners.of(sim)
        changes.null(sim, liners.elements["host"][4:8].copy())
        liners.delete(np.array([10, 18]))


def more(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 500:  # another one in the middle of the run, and a force
        liners = Liners.of(sim)
        _, elements = liners.create(near(sim.mesh, 1, 0.0)[2:])
        liners.assign(elements, {**WEAKER, "thickness": 0.04})
        liners.condition(np.array([0]), force_x=-500.0, moment=20.0)
    if sim.clock.step == 900:  # hosts go, and elements
        liners = Liners.of(sim)
        changes.null(sim, liners.elements["host"][4:7].copy())
        liners.delete(np.array([10, 18]))


def relaxing(sim: Blocks) -> None:
    """The same block at rest, static mode, under its weight and that of the liner around it."""
    mesh = rectangle(16, 6, 1.6, 0.6)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 1e8})
    sim.option(dynamic=False, collision=False)
    sim.gravity(0.0, -9.81)
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 1] == 0.0), vx=0.0, vy=0.0)
    liners = Liners.of(sim)
    _, elements = liners.create(np.concatenate([near(mesh, 1, 0.6), near(mesh, 0, 1.6)]))
    liners.assign(elements, {**WEAKER, "bond_tensile_strength": 3e3, "bond_cohesion": 1e3, "tensile_strength": 3e4})


def excavate(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 600:
        changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 0] < 0.4), relax=200.0)
    if sim.clock.step == 1000:
        sim.option(dynamic=True)


def result(sim: Blocks, notes: dict[str, Any]) -> Found:
    """All that may not depend on ranks."""
    found = {name: diagnostics.values(sim, name) for name in ("position_x", "velocity_y", "stress_xx", "damage")}
    found.update(state(Liners.of(sim)))
    found["counts"] = np.array(diagnostics.joint_counts(sim))
    found["ratio"] = np.array(diagnostics.unbalanced_ratio(sim))
    if sim.budget is not None:
        found.update({f"energy_{name}": np.array(value) for name, value in diagnostics.energies(sim).items()})
        found.update({f"liners_{name}": np.array(value) for name, value in Liners.of(sim).energies().items()})
    return found


def liners_yield_and_part(found: Found) -> None:
    bond = found["element_bond_state"]
    assert (found["element_host"] < 0).sum() >= 3
    assert (bond & kernels.SLIPPED > 0).sum() > 5 and (bond & kernels.PARTED > 0).sum() > 2
    assert np.abs(found["element_force"]).max(axis=0).min() > 0.1
    assert (found["element_state"] & kernels.HAS_YIELDED > 0).any()


def liners_are_torn(found: Found) -> None:
    liners_yield_and_part(found)
    assert found["counts"][2] > 20
    assert found["energy_relative"] < 0.01 and found["liners_relative"] < 0.01
    assert found["liners_lost_in_beams"] > 1.0 and found["liners_lost_in_bond"] > 0.1
    assert found["liners_work_on_rock"] == found["energy_work_liners"] != 0.0


def liners_in_space_are_torn(found: Found) -> None:
    liners_yield_and_part(found)
    assert found["counts"][2] > 5 and found["element_ends"].shape[1] == 3
    assert found["liners_relative"] < 0.01 and found["liners_work_on_rock"] == found["energy_work_liners"] != 0.0
    assert found["liners_lost_in_beams"] > 1.0 and found["liners_lost_in_bond"] > 0.1


# Checkpoints after excavation and deletion, and the change to motion.
MODELS = {
    "liners torn": Model(breaking, result, liners_are_torn, more, steps=1400, middle=1101, slow=True),
    "liners in space": Model(
        in_space, result, liners_in_space_are_torn, more_in_space, steps=140, middle=101, slow=True
    ),
    "liners at rest": Model(relaxing, result, liners_yield_and_part, excavate, steps=1400, middle=1101, slow=True),
}

"""Blocks that break, slide, yield, creep, fly about and are excavated: models for tests/parallel/test_models.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.physics.fdem import changes, creep, diagnostics, sides, user_functions, user_laws
from hpcdem.physics.fdem.free_field import FreeField
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import PLASTIC_STRAIN, Over
from hpcdem.physics.fdem.water import Water
from hpcdem.pre.mesh.quadratic import quadratic
from tests.blocks.support import JOINT, ROCK, joined, rectangle, shaken
from tests.parallel.model import Found, Model

COHESIVE = "classic_intrinsic_cohesive_interface"
WEAK = {**JOINT, "gf1": 20.0, "gf2": 100.0, "tensile_strength": 1.5e6, "cohesion": 5e6}


LAWS: dict[str, user_laws.UserLaw] = {}
FUNCTIONS: dict[str, str] = {}
"""Of laws/rock.py, compiled."""


def load_laws(sim: Blocks) -> None:
    """Before the model is made or comes back from a checkpoint."""
    file = Path(__file__).with_name("laws") / "rock.py"
    LAWS.update({name: user_laws.load(sim, file, f"rock.py:{name}") for name in ("flat", "tresca")})
    FUNCTIONS["beat"] = user_functions.load(sim, file, "rock.py:beat")


def impact(sim: Blocks, shape: str = "cross") -> None:
    """A jointed block falls apart on a fixed plate, with Rayleigh damping."""
    block = shaken(rectangle(16, 6, 1.6, 0.6, kind=shape), 0.2)
    plate = rectangle(24, 1, 2.4, 0.1, x0=-0.4, y0=-0.101, kind=shape)
    sim.take_mesh(joined(block, plate))
    n = len(block.cells)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "friction": 20.0, "damp_factor": 0.05})
    edges = sim.mesh.edges()
    inner = edges.faces[edges.inner & (edges.faces[:, 0] < 4 * n)]
    if shape == "mixed":  # joints on the right half only
        centre = sim.mesh.centroids()[inner[:, 0] // 4, 0]
        inner = inner[centre > 0.8]
    sim.joint_model(inner[:, 0], COHESIVE, WEAK)
    sim.velocity_condition(np.arange(len(block.points), len(sim.mesh.points)), vx=0.0, vy=0.0)
    changes.set_velocity(sim, np.arange(len(block.points)), vx=0.5, vy=-2.0)
    sim.rayleigh(0.002, 400.0)
    sim.gravity(0.0, -9.81)
    diagnostics.account_energy(sim)


def six_nodes(sim: Blocks) -> None:
    """The same of six-node triangles, with stress from the beginning."""
    block, plate = shaken(rectangle(8, 4, 1.6, 0.8), 0.2), rectangle(8, 1, 2.4, 0.2, x0=-0.4, y0=-0.201)
    mesh = quadratic(joined(block, plate)).mesh
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "friction": 20.0, "damp_factor": 0.05})
    joints = sim.numbers_of_joints(None)
    sim.joint_model(joints[joints < 16 * len(block.cells)], COHESIVE, WEAK)
    on_plate = mesh.points[:, 1] < -1e-4
    sim.velocity_condition(np.flatnonzero(on_plate), vx=0.0, vy=0.0)
    changes.set_velocity(sim, np.flatnonzero(~on_plate), vx=0.5, vy=-4.0)
    sim.initial_stress(None, xx=-1e5, yy=-2e5)
    sim.rayleigh(0.002, 400.0)
    sim.gravity(0.0, -9.81)
    diagnostics.account_energy(sim)


def mixed(sim: Blocks) -> None:
    """The same of quads and triangles, partly one body."""
    impact(sim, "mixed")


COULOMB = {
    "normal_stiffness": 5e11, "shear_stiffness": 2e11, "friction": 25.0, "cohesion": 1e5, "tensile_strength": 1e5,
    "dilation": 5.0, "dilation_limit": 1e-5,
}  # fmt: skip
ROUGH = {
    "normal_stiffness": 5e11, "shear_stiffness": 2e11, "closure_maximum": 1e-4, "residual_friction": 25.0, "jrc": 8.0,
    "jcs": 5e7, "joint_size": 1e-4,
}  # fmt: skip


def slide_in_turn(sim: Blocks) -> None:
    """Joints that slide after Coulomb, after Barton and Bandis, and such as break, in turn."""
    joints = sim.numbers_of_joints(None)
    joints = joints[(sim.joint_row[joints] > 0) & ~sim.open[joints]]
    sim.joint_model(joints[::3], "joint_mohr_coulomb", COULOMB)
    sim.joint_model(joints[1::3], "joint_barton_bandis", ROUGH)


def flight(sim: Blocks) -> None:
    """Two blocks shatter each other while both fly to the right, through the strips of all ranks; their outer faces are
    of three kinds."""
    one = shaken(rectangle(10, 5, 1.0, 0.5), 0.2)
    two = shaken(rectangle(8, 3, 0.8, 0.3, x0=1.001, y0=0.13, kind="mixed"), 0.2, seed=2)
    sim.take_mesh(joined(one, two))
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "damp_factor": 0.05})
    sim.face_model(None, "contact_mohr_coulomb",
                   {"friction": 25.0, "penalty_normal": 2e11, "damping_t": 2e8, "damping_b": 2.0})  # fmt: skip
    outside = sim.mesh.edges()
    outside = outside.faces[~outside.inner][:, 0]
    sim.face_property(outside[::3], {"friction": 5.0, "penalty_normal": 1e11, "damping_ratio": 0.3})
    sim.face_property(outside[1::3], {"penalty_shear": 5e10, "damping_b": 4.0})
    sim.joint_model(None, COHESIVE, WEAK)
    sim.stress_condition(outside[5::40], quiet=True)
    n = len(one.points)
    changes.set_velocity(sim, np.arange(n), vx=203.0, vy=0.0)
    changes.set_velocity(sim, np.arange(n, len(sim.mesh.points)), vx=197.0, vy=0.5)
    diagnostics.account_energy(sim)


def yielding(sim: Blocks) -> None:
    """Two blocks of triangles and quads that yield and soften, one of them jointed, hit each other while both fly to
    the right, through the strips of all ranks; a part of the other is elastic."""
    one = shaken(rectangle(14, 7, 1.0, 0.5, kind="mixed"), 0.2)
    two = shaken(rectangle(8, 3, 0.8, 0.3, x0=1.001, y0=0.13, kind="mixed"), 0.2, seed=2)
    sim.take_mesh(joined(one, two))
    rock = {**ROCK, "friction": 25.0, "cohesion": 2e6, "tensile": 1e6, "dilation": 10.0, "damp_factor": 0.05}
    sim.table("softening", [(0.0, 2e6), (2e-3, 1.2e6)])
    changes.element_model(sim, None, "mech_mohr_coulomb", {**rock, "cohesion": Over("softening", PLASTIC_STRAIN)})
    sim.element_property(np.arange(0, len(one.cells), 3), {"cohesion": 3e6, "dilation": 0.0})
    changes.element_model(sim, np.arange(len(one.cells), len(one.cells) + 6), "mech_iso_elastic", ROCK)
    edges = sim.mesh.edges()
    inner = edges.faces[edges.inner][:, 0]
    sim.joint_model(inner[inner < 4 * len(one.cells)], COHESIVE, WEAK)
    sim.initial_stress(None, xx=-1e4, yy=-2e4, zz=-1e4)
    n = len(one.points)
    changes.set_velocity(sim, np.arange(n), vx=203.0, vy=0.0)
    changes.set_velocity(sim, np.arange(n, len(sim.mesh.points)), vx=197.0, vy=0.5)
    diagnostics.account_energy(sim)


def yield_more(sim: Blocks) -> None:
    """What happens to them."""
    if sim.clock.step == 600:
        changes.reset_state(sim, np.arange(20))
    if sim.clock.step == 800:
        sim.element_property(np.arange(30, 60), {"cohesion": 0.5e6})
        changes.element_model(sim, np.arange(10), "mech_iso_elastic", ROCK)


def obeying(sim: Blocks) -> None:
    """The same blocks with laws of the user (laws/rock.py), one of them with quads, which come to rest first."""
    one = shaken(rectangle(10, 5, 1.0, 0.5, kind="mixed"), 0.2)
    two = shaken(rectangle(8, 3, 0.8, 0.3, x0=1.001, y0=0.13), 0.2, seed=2)
    sim.take_mesh(joined(one, two))
    rock = {**ROCK, "friction": 25.0, "damp_factor": 0.05}
    changes.element_model(sim, None, LAWS["tresca"].name, {**rock, "limit": 2e6})
    sim.element_property(np.arange(0, len(one.cells), 3), {"limit": 3e6})
    changes.element_model(sim, np.arange(len(one.cells), len(one.cells) + 6), "mech_iso_elastic", ROCK)
    changes.element_model(sim, np.arange(len(one.cells) + 6, len(one.cells) + 16), LAWS["flat"].name, rock)
    edges = sim.mesh.edges()
    inner = edges.faces[edges.inner][:, 0]
    sim.joint_model(inner[inner < 4 * len(one.cells)], COHESIVE, WEAK)
    sim.initial_stress(None, xx=-1e5, yy=-5e6, zz=-1e5)
    outside = edges.faces[~edges.inner][:, 0]
    sim.stress_condition(outside[::7], normal=FUNCTIONS["beat"])
    sim.option(dynamic=False)


def obey_more(sim: Blocks) -> None:
    """What happens to them."""
    n = len(rectangle(10, 5, 1.0, 0.5).points)
    if sim.clock.step == 200:
        sim.option(dynamic=True)
        changes.set_velocity(sim, np.arange(n), vx=203.0, vy=0.0)
        changes.set_velocity(sim, np.arange(n, len(sim.mesh.points)), vx=197.0, vy=0.5)
    if sim.clock.step == 600:
        changes.reset_state(sim, np.arange(20))
    if sim.clock.step == 750:
        sim.element_property(np.arange(30, 60), {"limit": 0.5e6})
        changes.element_model(sim, np.arange(10), "mech_iso_elastic", ROCK)
        changes.element_model(sim, np.arange(4), LAWS["tresca"].name, {**ROCK, "limit": 1e6})


def opening(sim: Blocks) -> None:
    """A stressed bed of triangles and quads, jointed on the left, with a crack; a hole is made in it, then blasted."""
    mesh = shaken(rectangle(16, 8, 1.6, 0.8, kind="mixed"), 0.15)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "damp_factor": 0.1, "friction": 20.0})
    edges = mesh.edges()
    inner = edges.faces[edges.inner][:, 0]
    centre = mesh.centroids()[inner // 4]
    sim.joint_model(inner[centre[:, 0] < 0.8], COHESIVE, WEAK)
    ends = mesh.points[edges.points[edges.inner]]
    upright = np.abs(ends[:, 0, 0] - ends[:, 1, 0]) < 0.04
    across = (np.abs(ends[:, :, 0].mean(axis=1) - 0.5) < 0.03) & upright & (ends[:, :, 1].mean(axis=1) < 0.5)
    changes.crack(sim, inner[across])
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero((x < 1e-9) | (x > 1.6 - 1e-9)), vx=0.0)
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    top = edges.faces[~edges.inner][:, 0]
    top = top[mesh.points[edges.points[~edges.inner]][:, :, 1].min(axis=1) > 0.8 - 1e-9]
    sim.stress_condition(top, normal=-2e6)
    sim.initial_stress(None, xx=-0.5e6, yy=-1e6, gradient={"yy": (0.0, 1e4)})
    sim.gravity(0.0, -9.81)
    sim.option(dynamic=False)


def open_up(sim: Blocks) -> None:
    """What happens to the bed: the hole at rest, then motion in time with a pressure in the hole."""
    if sim.clock.step == 300:
        middle = sim.mesh.centroids() - [0.75, 0.45]
        changes.null(sim, np.flatnonzero(np.hypot(*middle.T) < 0.16), relax=250)
    if sim.clock.step == 750:
        sim.option(dynamic=True)
        sim.time_step(mass_scaling=3e-6)
        diagnostics.account_energy(sim)
        sim.table("blast", [(0.0, 0.0), (1e-4, -2.5e7), (3e-4, -2e6)])
        gone = np.repeat(~sim.alive, 4) & (sim.partner >= 0)
        rim = sim.partner[gone]
        sim.stress_condition(rim[sim.alive[rim // 4]], normal="blast")
        changes.reset_displacement(sim)
    if sim.clock.step == 1200:
        sim.element_property(np.arange(40), {"young": 40e9})
        sim.time_step(auto=True)


def backfill(sim: Blocks) -> None:
    """The same bed; its hole is filled at rest, taken out once more and filled again in motion."""
    opening(sim)


def fill_up(sim: Blocks) -> None:
    """What happens to it."""
    middle = sim.mesh.centroids() - [0.75, 0.45]
    hole = np.flatnonzero(np.hypot(*middle.T) < 0.16)
    fill = {"density": 2000.0, "young": 5e9, "poisson_ratio": 0.3}
    if sim.clock.step == 200:
        changes.null(sim, hole, relax=100)
    if sim.clock.step == 400:
        changes.element_model(sim, hole, "mech_iso_elastic", fill)
        joints = np.flatnonzero(sim.joint_exists())
        inside = np.isin(joints // 4, hole) & np.isin(sim.partner[joints] // 4, hole)
        sim.joint_model(joints[inside], COHESIVE, WEAK)
    if sim.clock.step == 600:
        sim.option(dynamic=True)
        sim.time_step(mass_scaling=3e-6)
        diagnostics.account_energy(sim)
        changes.reset_displacement(sim)
        sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 0] > 1.6 - 1e-9), vx=0.5)
    if sim.clock.step == 800:
        changes.null(sim, hole)
    if sim.clock.step == 900:
        changes.element_model(sim, hole[:-3], "mech_iso_elastic", {**fill, "young": 20e9})


def creeping(sim: Blocks) -> None:
    """A specimen of triangles and quads under load at rest, the left of it creeps, joints in the elastic right break in
    mid-creep."""
    mesh = shaken(rectangle(14, 8, 1.4, 0.8, kind="mixed"), 0.2)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "damp_factor": 0.05, "friction": 20.0})
    soft = {**ROCK, "maxwell_viscosity": 4e6, "kelvin_shear": 1e10, "kelvin_viscosity": 1e6, "damp_factor": 0.05}
    centre = mesh.centroids()
    changes.element_model(sim, np.flatnonzero(centre[:, 0] < 0.9), "mech_burgers", {**soft, "kelvin_strain_xy": 1e-6})
    edges = mesh.edges()
    inner = edges.faces[edges.inner][:, 0]
    weak = {**WEAK, "tensile_strength": 0.8e6, "gf1": 2.0, "gf2": 10.0}
    sim.joint_model(inner[centre[inner // 4, 0] > 0.6], COHESIVE, weak)
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
    top = edges.faces[~edges.inner][:, 0]
    top = top[mesh.points[edges.points[~edges.inner]][:, :, 1].min(axis=1) > 0.8 - 1e-9]
    sim.stress_condition(top, yy=0.8e6)
    sim.initial_stress(None, xx=-1e4, yy=-2e4, zz=-1e4)
    sim.option(dynamic=False)
    creep.switch(sim, True, dt=2e-5, change=0.2)


def creep_more(sim: Blocks) -> None:
    """What happens to it: creep steps at rest, one of them under way at step 701; then motion in which it creeps."""
    step = sim.clock.step
    if step % 150 == 50 and step < 1000:
        if sim.creep.passed > 0.0:
            creep.finish(sim, 1.0)
        creep.begin(sim, 1.0)
    if step == 1000:
        creep.finish(sim, 1.0)
        sim.option(dynamic=True)
        creep.switch(sim, True)
        diagnostics.account_energy(sim)
        changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 1] > 0.7), vx=8.0, vy=1.0)
    if step == 1200:
        changes.reset_kelvin_strain(sim, np.arange(40))
        sim.element_property(np.arange(20, 60), {"kelvin_viscosity": 3e6})
    if step == 1300:
        changes.element_model(sim, np.arange(10), "mech_iso_elastic", ROCK)


def plate(sim: Blocks) -> None:
    """A plate in plane stress, of rock that yields beside rock that creeps, is thrown against its support."""
    mesh = shaken(rectangle(12, 6, 1.2, 0.6, kind="mixed"), 0.2)
    sim.option(plane_stress=True, collision=False)
    sim.take_mesh(mesh)
    weak = {**ROCK, "damp_factor": 0.05, "cohesion": 1e6, "tensile": 5e5, "friction": 25.0, "dilation": 10.0}
    changes.element_model(sim, None, "mech_mohr_coulomb", weak)
    slow = {**ROCK, "maxwell_viscosity": 4e7, "kelvin_shear": 1e10, "kelvin_viscosity": 1e7}
    changes.element_model(sim, np.flatnonzero(mesh.centroids()[:, 0] > 0.6), "mech_burgers", slow)
    sim.initial_stress(None, xx=-1e4, yy=-2e4)
    sim.velocity_condition(np.flatnonzero(mesh.points[:, 0] < 1e-9), vx=0.0, vy=0.0)
    changes.set_velocity(sim, np.flatnonzero(mesh.points[:, 0] > 0.1), vx=-1.0, vy=0.5)
    creep.switch(sim, True)
    diagnostics.account_energy(sim)


def shaking(sim: Blocks) -> None:
    """Soft ground with joints on rock between free-field sides, an earthquake comes in from below."""
    mesh = shaken(rectangle(26, 10, 2.6, 1.0, kind="mixed"), 0.15)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "damp_factor": 0.05})
    centre = mesh.centroids()
    soft = np.flatnonzero(centre[:, 1] > 0.5)
    changes.element_model(sim, soft, "mech_iso_elastic", {**ROCK, "young": 2e9})
    edges = mesh.edges()
    inner = edges.faces[edges.inner][:, 0]
    sim.joint_model(inner[np.abs(centre[inner // 4] - [1.3, 0.7]).max(axis=1) < 0.3], COHESIVE, WEAK)
    x, y = mesh.points.T
    ends, outer = mesh.points[edges.points[~edges.inner]], edges.faces[~edges.inner][:, 0]
    sim.table("wave", [(1e-5 * t, 4.0 * np.sin(0.05 * t)) for t in range(126)] + [(1.0, 0.0)])
    sim.stress_condition(outer[(ends[:, :, 1] < 1e-9).all(axis=1)], quiet=True, incoming_x="wave", incoming_y="wave")
    for side in (0.0, 2.6):
        FreeField.create(sim, outer[(np.abs(ends[:, :, 0] - side) < 1e-9).all(axis=1)])
    sim.rayleigh(0.05, 500.0)
    diagnostics.account_energy(sim)


def weir(sim: Blocks) -> None:
    """Water before a jointed block that breaks off a wall, nodes with damping of their own, loads along faces, and
    elements that touch nothing."""
    mesh = joined(shaken(rectangle(24, 10, 2.4, 1.0, kind="mixed"), 0.15), rectangle(6, 2, 0.6, 0.2, x0=1.0, y0=1.001))
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 1e8, "damp_factor": 0.02})
    centre = mesh.centroids()
    edges = mesh.edges()
    inner = edges.faces[edges.inner][:, 0]
    sim.joint_model(inner[centre[inner // 4, 0] < 1.0], COHESIVE, {**WEAK, "tensile_strength": 2e4, "cohesion": 4e4})
    sim.gravity(0.0, -9.81)
    Water.create(sim, None, [((-1.0, 0.87), (0.4, 0.8)), ((2.0, 0.6), (3.0, 0.63))], 1e3)
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
    sim.damp_nodes(np.flatnonzero((x > 1.2) & (y < 0.9)), 0.3)
    sim.touches[np.flatnonzero(centre[:, 1] > 1.0)[::2]] = False
    ends, outer = mesh.points[edges.points[~edges.inner]], edges.faces[~edges.inner][:, 0]
    sim.stress_condition(outer[(ends[:, :, 0] > 2.4 - 1e-9).all(axis=1)], dip=3e4)
    changes.set_velocity(sim, np.flatnonzero(x < 0.8), vx=-8.0, vy=0.5)


def shake_more(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 300:
        sim.element_property(np.arange(40), {"young": 15e9})
    if sim.clock.step == 500:
        right = FreeField.there(sim).faces["face"][-10:, 0].copy()
        FreeField.remove(sim, right)
        FreeField.create(sim, right)


def upper_side(sim: Blocks) -> np.ndarray:
    """Nodes on the seam of the model below as its upper elements have them."""
    mesh = sim.the_mesh()
    above = mesh.centroids()[:, 1] > 0.3
    chosen = (mesh.cells >= 0) & above[:, None] & (np.abs(mesh.points[mesh.cells][:, :, 1] - 0.3) < 1e-9)
    return sides.numbers(mesh.cells, chosen.reshape(-1), np.ones(len(mesh.cells), bool))


def parting(sim: Blocks) -> None:
    """A body with a seam, half of it joints and half a crack, of which both sides are led and pushed by themselves."""
    mesh = rectangle(20, 6, 2.0, 0.6, kind="mixed")
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "friction": 20.0, "damp_factor": 0.05})
    edges = mesh.edges()
    ends = mesh.points[edges.points]
    seam = edges.inner & (np.abs(ends[:, :, 1] - 0.3) < 1e-9).all(axis=1)
    left = ends[:, :, 0].mean(axis=1) < 1.2
    upper = upper_side(sim)
    sim.velocity_condition(upper[::3], vx=0.0)
    sim.force_condition(upper[1::3], fy=4e5)
    sim.joint_model(edges.faces[seam & left, 0], COHESIVE, WEAK)
    changes.crack(sim, edges.faces[seam & ~left, 0])
    sim.velocity_condition(np.flatnonzero(mesh.points[:, 1] < 1e-9), vy=0.0)
    sim.move_constraint(upper[2::3], 2, (0.1, 1.0))
    sim.move_constraint(upper[1:2], 2, (0.0, 1.0))
    sim.velocity_condition(np.flatnonzero(mesh.points[:, 1] > 0.6 - 1e-9), vy=0.4)
    diagnostics.account_energy(sim)


def part_more(sim: Blocks) -> None:
    """What happens to it."""
    if sim.clock.step == 350:
        sim.force_condition(upper_side(sim)[1::3], fy=0.0)
        sim.remove_conditions(upper_side(sim)[2::3])


def parted(sim: Blocks, notes: dict[str, Any]) -> Found:
    """Besides what both sides do."""
    upper, mesh = upper_side(sim), sim.the_mesh()
    of_sides = {f"side_{name}": diagnostics.values(sim, name, upper) for name in ("position_y", "reaction_x")}
    seam = mesh.edges().faces[mesh.edges().inner, 0]
    return {**result(sim, notes), **of_sides, "gap": diagnostics.values(sim, "opening", seam)}


def sides_part(found: Found) -> None:
    gap = found["gap"][~np.isnan(found["gap"])]
    assert found["counts"][2] > 3 and (gap > 1e-5).sum() > 5  # joints that broke; cracks that opened
    lower = found["position_y"][np.abs(found["position_y"] - 0.3) < 1e-2]
    assert found["side_position_y"].mean() > lower.mean() + 1e-5
    assert np.abs(found["side_reaction_x"]).max() > 0.0


def result(sim: Blocks, notes: dict[str, Any]) -> Found:
    """All that may not depend on ranks, and in `about` rebuilds, late ones, contact pairs, elements that came from
    another rank."""
    found = {name: diagnostics.values(sim, name) for name in (*NAMES, *user_laws.quantities(sim))}
    found["creep"] = np.array(list(vars(sim.creep).values()), float)
    found.update({f"event_{name}": values for name, values in diagnostics.events(sim).items()})
    found["counts"] = np.array(diagnostics.joint_counts(sim))
    found["time"] = np.array([sim.clock.time, sim.clock.dt])
    if sim.budget is not None:
        found.update({f"energy_{name}": np.array(value) for name, value in diagnostics.energies(sim).items()})
    came = sim.comm.allgather(len(set(sim.number[sim.owned].tolist()) - notes["first"]))
    found["about"] = np.array([sim.rebuilds, sim.rebuild_state.late, len(sim.local.pairs), sum(came)])
    return found


NAMES = (
    "position_x", "position_y", "velocity_x", "velocity_y", "stress_xx", "stress_yy", "stress_xy", "stress_zz", "state",
    "damage", "mode", "reaction_y", "displacement_x", "normal_stress_largest", "normal_stress_last",
    "shear_stress_largest", "shear_stress_first", "plastic_state", "plastic_shear_strain", "plastic_volume_strain",
    "plastic_work", "creep_strain_xx", "creep_strain_xy", "kelvin_strain_yy", "creep_work",
)  # fmt: skip

# ---- what must have happened -----------------------------------------------------------------------------------------


def much_breaks(found: Found) -> None:
    intact, yielded, broken = found["counts"]
    assert broken > 20 and yielded > 5
    assert found["about"][0] > 5  # rebuilds
    assert found["about"][2] > 50  # contact pairs
    assert (np.diff(found["event_step"]) >= 0).all()
    assert found["energy_relative"] < 0.01


def much_yields(found: Found) -> None:
    much_breaks(found)
    assert found["energy_plastic_lost"] > 0.05 * found["energy_joints_lost"] > 0.0
    assert (found["plastic_state"] > 0).sum() > 20 and (found["plastic_state"] == 0).sum() > 3


def a_hole_is_made(found: Found) -> None:
    much_breaks(found)
    assert np.isnan(found["stress_xx"]).sum() > 5  # elements that were taken out


def laws_act(found: Found) -> None:
    assert found["counts"][2] > 10 and found["about"][0] > 5  # joints that broke; rebuilds
    slip = found["law_slip"]
    assert np.isnan(slip).sum() == 22 and (slip > 1e-5).sum() > 20 and (slip == 0.0).sum() > 3


def the_fill_carries(found: Found) -> None:
    stress = found["stress_xx"]
    assert np.isnan(stress).sum() == 3 and found["energy_relative"] < 1e-3
    assert found["energy_commands"] != 0.0 and np.nanmax(np.abs(stress)) > 1e5


def a_plate_flows(found: Found) -> None:
    assert found["energy_plastic_lost"] > 0.0 and found["energy_creep_lost"] > 0.0 and found["energy_relative"] < 0.01
    assert (found["stress_zz"] == 0.0).all() and (found["plastic_state"] > 0).sum() > 10


def much_creeps(found: Found) -> None:
    intact, _, broken = found["counts"]
    assert broken > 10 and intact > 10
    steps, times = found["event_step"], found["event_time"]
    in_creep = (steps > 200) & (steps < 1000)
    assert in_creep.sum() > 5 and len(set(times[in_creep])) > 2  # at several creep times
    assert np.abs(found["creep_strain_xx"]).max() > 1e-6
    assert (found["creep_work"] > 0.0).sum() > 50
    assert found["energy_creep_lost"] > 0.0 and found["energy_relative"] < 0.01


def the_weir_gives_way(found: Found) -> None:
    assert found["counts"][2] > 10
    assert np.abs(found["displacement_x"]).max() > 1e-2


def the_ground_shakes(found: Found) -> None:
    assert np.hypot(found["velocity_x"], found["velocity_y"]).max() > 0.1
    assert found["counts"][1] + found["counts"][2] > 5  # joints behind their peak
    assert found["energy_work_outside"] > 0.0 and found["energy_relative"] < 0.01


# Checkpoints: of creep in the middle of a creep step, of the fill between two fillings. What flies goes through borders
# that stay; else they follow the load.
MODELS = {
    "impact": Model(impact, result, much_breaks, slow=True),
    "six nodes": Model(six_nodes, result, much_breaks, slow=True),
    "mixed": Model(mixed, result, much_breaks, slow=True),
    "flight": Model(flight, result, much_breaks, balance=False, come=10, steps=600, middle=301),
    "yielding": Model(yielding, result, much_yields, yield_more, come=10, slow=True),
    "obeying": Model(obeying, result, laws_act, obey_more, prepare=load_laws, steps=900, come=3, slow=True),
    "opening": Model(opening, result, a_hole_is_made, open_up, slow=True),
    "backfill": Model(backfill, result, the_fill_carries, fill_up, steps=1100, slow=True),
    "creeping": Model(creeping, result, much_creeps, creep_more, steps=1400, slow=True),
    "plate": Model(plate, result, a_plate_flows, steps=300, middle=131, slow=True),
    "parting": Model(parting, parted, sides_part, part_more, steps=600, middle=300, slow=True),
    "weir": Model(weir, result, the_weir_gives_way, steps=700, middle=401, slow=True),
    "shaking": Model(shaking, result, the_ground_shakes, shake_more, steps=700, middle=401, slow=True),
}

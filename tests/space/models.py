"""Bodies in space that fly, swing and are dug out: models for tests/parallel/test_models.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.commands.fdem.project import joined
from hpcdem.numerics.random_field import LOGNORMAL, RandomField
from hpcdem.physics.fdem import changes, creep, diagnostics, user_functions, user_laws
from hpcdem.physics.fdem.kernels import space
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import PLASTIC_STRAIN, TEMPERATURE, Drawn, Over, Value
from hpcdem.physics.fdem.water import Water
from hpcdem.physics.heat.model import Heat
from tests.blocks.models import slide_in_turn
from tests.parallel.model import Found, Model
from tests.space.support import ROCK, box, hexes


def swinging(sim: Blocks) -> None:
    """A bar with an initial stress that is held at one end, pressed and pulled by a table at the other, and another one
    that flies over it through all strips while it tumbles."""
    bar, flier = box((12, 2, 2), (2.4, 0.3, 0.3), 5, shaken=0.2), box((3, 2, 1), (0.4, 0.3, 0.2), 12)
    away = np.array([-0.3, 0.0, 0.5])
    mesh = Mesh.of(
        np.concatenate([bar.points, flier.points + away]),
        np.concatenate([bar.cells, flier.cells + len(bar.points)]),
        layers=bar.layers,
    )
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 1e8, "damp_factor": 0.02})
    sim.option(collision=False)
    sim.initial_stress(None, xx=1e4, yz=-3e3, gradient={"zz": (1e3, 0.0, -2e3)})
    edges = mesh.edges()
    faces = {side: edges.faces[mesh.find_edges(edges, mesh.layers[side]), 0] for side in mesh.layers}
    left, right = (np.unique(mesh.layers[side]) for side in ("left", "right"))
    sim.move_constraint(left, 1)
    sim.table("beat", [(0.0, 0.0), (0.01, 3e5), (0.02, 0.0), (0.04, 2e5)])
    sim.stress_condition(faces["right"], normal="beat")
    sim.stress_condition(faces["top"], normal=-2e4, xz=5e3)
    sim.stress_condition(faces["right"], quiet=True, incoming_y=0.05, incoming_z=0.02)
    sim.force_condition(right[:2], fy=300.0)
    sim.move_constraint(np.unique(mesh.layers["front"])[6:9], space.ACROSS, (1.0, 1.0, 0.0))
    sim.rayleigh(0.02, 60.0)
    sim.gravity(0.5, 0.0, -9.81)
    over = np.arange(len(bar.points), len(mesh.points))
    changes.set_velocity(sim, over, 30.0, 1.0, 3.0)
    changes.set_velocity(sim, over[:4], 30.0, 4.0, 0.0)


def dig(sim: Blocks) -> None:
    """A piece of the bar is taken out in the middle of the run, and lets go while a checkpoint is written."""
    if sim.clock.step == 300:
        changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 0] > 2.2), relax=300.0 * sim.clock.dt)


def dig_and_fill(sim: Blocks) -> None:
    """Half of the piece comes back, of another rock, before it has let go."""
    dig(sim)
    if sim.clock.step == 380:
        changes.element_model(sim, np.flatnonzero(~sim.alive)[:10], "mech_iso_elastic", {**ROCK, "young": 5e7})


def yielding(sim: Blocks) -> None:
    """The same bar and its flier, of soil that yields: in the middle of the bar it softens, its end is elastic."""
    swinging(sim)
    mesh = sim.mesh
    soil = {"density": 2000.0, "young": 5e7, "poisson_ratio": 0.3, "friction": 25.0, "dilation": 10.0, "tensile": 5e4}
    sim.table("soft", [(0.0, 1.5e5), (5e-3, 3e4)])
    sim.table("brittle", [(0.0, 5e4), (2e-3, 1e3)])
    x = mesh.centroids()[:, 0]
    changes.element_model(sim, np.flatnonzero(x < 2.1), "mech_mohr_coulomb", {**soil, "cohesion": 1e5})
    tables: dict[str, Value] = {"cohesion": Over("soft", PLASTIC_STRAIN), "tensile": Over("brittle", PLASTIC_STRAIN)}
    sim.element_property(np.flatnonzero((x > 0.6) & (x < 1.4)), tables)


def dig_soil(sim: Blocks) -> None:
    """What happens to it: the same piece is taken out; some of it has not yielded, or becomes elastic."""
    dig(sim)
    if sim.clock.step == 300:
        changes.reset_state(sim, np.arange(30))
    if sim.clock.step == 600:
        changes.element_model(sim, np.arange(20, 40), "mech_iso_elastic", {**ROCK, "young": 5e7})


def creeping(sim: Blocks) -> None:
    """A bar at rest under its weight and pressure, of which the left part creeps."""
    sim.take_mesh(box((12, 2, 2), (2.4, 0.3, 0.3), 5, shaken=0.2))
    mesh = sim.mesh
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "damp_factor": 0.05})
    soft = {**ROCK, "maxwell_viscosity": 4e6, "kelvin_shear": 1e10, "kelvin_viscosity": 1e6, "damp_factor": 0.05}
    left = np.flatnonzero(mesh.centroids()[:, 0] < 1.6)
    changes.element_model(sim, left, "mech_burgers", {**soft, "kelvin_strain_xz": 1e-6, "kelvin_strain_zz": 0.0})
    sim.option(dynamic=False, collision=False)
    sim.initial_stress(None, xx=-1e4, yy=-2e4, yz=5e3)
    sim.move_constraint(np.unique(mesh.layers["left"]), 1)
    edges = mesh.edges()
    for side, stress in (("right", 8e5), ("top", -2e5)):
        sim.stress_condition(edges.faces[mesh.find_edges(edges, mesh.layers[side]), 0], normal=stress)
    creep.switch(sim, True, dt=2e-5, change=0.2)


def creep_more(sim: Blocks) -> None:
    """What happens to it: creep steps at rest, one of them under way at step 401; then motion in which it creeps."""
    step = sim.clock.step
    if step % 100 == 50 and step < 600:
        if sim.creep.passed > 0.0:
            creep.finish(sim, 1.0)
        creep.begin(sim, 1.0)
    if step == 600:
        creep.finish(sim, 1.0)
        sim.option(dynamic=True)
        creep.switch(sim, True)
        changes.set_velocity(sim, np.flatnonzero(sim.mesh.points[:, 0] > 1.5), 2.0, 1.0, -3.0)
    if step == 700:
        soft = np.flatnonzero(sim.creeping())
        changes.reset_kelvin_strain(sim, soft[:40])
        sim.element_property(soft[20:60], {"kelvin_viscosity": 3e6})
    if step == 800:
        changes.element_model(sim, np.flatnonzero(sim.creeping())[:10], "mech_iso_elastic", ROCK)


def blocks_of_hexes(sim: Blocks) -> None:
    """A bar of hexahedra like that of `swinging` beside one of tetrahedra that is held at the same end, and a block of
    hexahedra that flies onto both through all strips."""
    bar, rod = hexes((12, 2, 2), (2.4, 0.3, 0.3), 0.2), box((10, 1, 1), (2.4, 0.2, 0.3), 6)
    flier = hexes((2, 2, 1), (0.4, 0.5, 0.2), 0.1)
    mesh = bar
    for other, away in ((rod, (0.0, 0.35, 0.0)), (flier, (-0.3, 0.0, 0.32))):
        mesh = joined(mesh, Mesh.of(other.points + np.array(away), other.cells, layers={}, macros=other.hexes))
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 1e8, "damp_factor": 0.02})
    sim.initial_stress(None, xx=1e4, yz=-3e3, gradient={"zz": (1e3, 0.0, -2e3)})
    edges = mesh.edges()
    faces = {side: edges.faces[mesh.find_edges(edges, bar.layers[side]), 0] for side in bar.layers}
    sim.move_constraint(np.flatnonzero((mesh.points[:, 0] < 1e-9) & (mesh.points[:, 2] < 0.31)), 1)
    sim.table("beat", [(0.0, 0.0), (0.01, 3e5), (0.02, 0.0), (0.04, 2e5)])
    sim.stress_condition(faces["right"], normal="beat")
    sim.rayleigh(0.02, 60.0)
    sim.gravity(0.5, 0.0, -9.81)
    Water.create(sim, None, [((0.0, 0.0, 0.12), (0.05, 0.0, 1.0))], 1e3)
    changes.set_velocity(sim, np.arange(len(mesh.points) - len(flier.points), len(mesh.points)), 30.0, 1.0, -3.0)


def damped_blocks_of_hexes(sim: Blocks) -> None:
    """The same with damping of some nodes, of which the energy budget knows nothing."""
    blocks_of_hexes(sim)
    sim.damp_nodes(np.flatnonzero(sim.mesh.points[:, 0] > 2.0), 0.1)


def hexes_that_flow(sim: Blocks) -> None:
    """Blocks of hexahedra; of the bar a part creeps, and one yields and softens."""
    blocks_of_hexes(sim)
    bar, x = np.arange(len(sim.mesh.cells)) < 12 * 2 * 2 * 6, sim.mesh.centroids()[:, 0]
    soft = {**ROCK, "young": 1e8, "maxwell_viscosity": 4e6, "kelvin_shear": 1e8, "kelvin_viscosity": 1e5}
    changes.element_model(sim, np.flatnonzero(bar & (x < 0.8)), "mech_burgers", {**soft, "kelvin_strain_xz": 1e-6})
    sim.table("weaker", [(0.0, 1.5e4), (5e-3, 3e3)])
    soil = {**ROCK, "young": 1e8, "friction": 25.0, "dilation": 10.0, "tensile": 1e4}
    changes.element_model(
        sim, np.flatnonzero(bar & (x > 0.8) & (x < 2.1)), "mech_mohr_coulomb",
        {**soil, "cohesion": Over("weaker", PLASTIC_STRAIN)},
    )  # fmt: skip
    creep.switch(sim, True)
    diagnostics.account_energy(sim)


def hexes_that_glow(sim: Blocks) -> None:
    """The same with heat: they expand, get softer and weaker, touch, rub and pass heat on; the air is warm."""
    hexes_that_flow(sim)
    mesh = sim.mesh
    sim.table("softer", [(20.0, 1e8), (320.0, 8e7)])
    sim.element_property(np.flatnonzero(mesh.centroids()[:, 0] > 2.1), {"young": Over("softer", TEMPERATURE)})
    sim.table("crumbling", [(20.0, 1e4), (320.0, 2e3)])
    sim.element_property(np.flatnonzero(sim.yielding()), {"tensile": Over("crumbling", TEMPERATURE)})
    heat = Heat.of(sim)
    heat.assign(None, {**ROCK_OF_HEAT, "friction_heat": 0.5})
    heat.initial(None, 20.0)
    sim.table("oven", [(0.0, 20.0), (3e3, 320.0), (1e4, 120.0)])
    heat.prescribe(np.flatnonzero((np.abs(mesh.points - (1.6, 0.15, 0.15)) < (0.5, 1.0, 1.0)).all(axis=1))[::3], "oven")
    heat.expose(None, environment=40.0, transfer=20.0)
    heat.expose(np.flatnonzero(sim.face_exists())[::7], flux=400.0)
    sim.heat_clock(dt=10.0)
    sim.flow_clock(every=2)


def glow_in_hexes(sim: Blocks) -> None:
    """What happens to it."""
    dig_hexes_that_flow(sim)
    if sim.clock.step == 620:
        Heat.of(sim).adjust(np.arange(24), {"capacity": 700.0})
        Heat.of(sim).initial(np.flatnonzero(sim.node_exists())[5:9], 90.0)
        sim.heat_clock(steps=2)


LAWS = Path(__file__).with_name("laws") / "rock.py"


def load_laws(sim: Blocks) -> None:
    """Laws of the user, before they are assigned or restored."""
    user_laws.load(sim, LAWS, "rock.py:mises")
    user_functions.load(sim, LAWS, "rock.py:shove")


def hexes_that_obey(sim: Blocks) -> None:
    """Of the same a part has a law of the user, as some of the tetrahedra do; it is warm here and there, pushed by a
    function of place and time, and its density differs from place to place."""
    blocks_of_hexes(sim)
    sim.rayleigh(0.02, 60.0, part="mass")
    mesh = sim.mesh
    mises = user_laws.load(sim, LAWS, "rock.py:mises").name
    x, of_hexes = mesh.centroids()[:, 0], mesh.macro_of() >= 0
    soft = {**ROCK, "young": 1e8, "damp_factor": 0.02}
    changes.element_model(sim, np.flatnonzero((x > 0.8) & (x < 2.1) | ~of_hexes), mises, {**soft, "limit": 1.5e4})
    sim.random_field("rho", RandomField.of(LOGNORMAL, 2700.0, 100.0, 5, 0.4))
    sim.random_field("each", RandomField.of(LOGNORMAL, 2700.0, 50.0, 5))
    sim.element_property(np.flatnonzero(x < 1.2), {"density": Drawn("rho")})
    sim.element_property(np.flatnonzero(x >= 1.2), {"density": Drawn("each")})
    top = np.flatnonzero((mesh.points[:, 2] > 0.29) & (mesh.points[:, 2] < 0.31) & (mesh.points[:, 0] < 2.0))
    sim.force_condition(top, fy=user_functions.load(sim, LAWS, "rock.py:shove"))
    heat = Heat.of(sim)
    heat.assign(None, {**ROCK_OF_HEAT, "transfer_coeficient": 0.0})
    heat.initial(None, 20.0)
    heat.prescribe(np.flatnonzero(np.abs(mesh.points[:, 0] - 1.6) < 0.3)[::3], 150.0)
    sim.heat_clock(dt=20.0)


def obey_more(sim: Blocks) -> None:
    """What happens to it."""
    dig_hexes(sim)
    if sim.clock.step == 300:
        changes.reset_state(sim, np.arange(96, 144))


def obeying(sim: Blocks, notes: dict[str, Any]) -> Found:
    names = ("law_p11", "law_p23", "law_work", "temperature")
    return touching(sim, notes) | {name: diagnostics.values(sim, name) for name in names}


def they_obey(found: Found) -> None:
    assert (found["law_work"] > 0.0).sum() > 100 and np.nanmax(found["temperature"]) == 150.0
    assert np.isnan(found["strain_energy"]).any() and np.nanmax(found["displacement_x"]) > 0.5


def dig_hexes_that_flow(sim: Blocks) -> None:
    """The same; some forget that they have yielded or crept, or become elastic."""
    dig_hexes(sim)
    if sim.clock.step == 300:
        changes.reset_state(sim, np.arange(96, 144))
        changes.reset_kelvin_strain(sim, np.arange(48))
    if sim.clock.step == 600:
        changes.element_model(sim, np.flatnonzero(sim.yielding())[:24], "mech_iso_elastic", {**ROCK, "young": 1e8})


def flow_and_creep(sim: Blocks, notes: dict[str, Any]) -> Found:
    return {**flow(sim, notes), **crept(sim, notes)}


def they_flow_and_creep(found: Found) -> None:
    assert (found["plastic_shear_strain"] > 1e-5).sum() > 100 and (found["plastic_state"] % 2 == 1).any()
    assert (np.abs(found["creep_strain_xx"]) > 1e-6).sum() > 90 and (found["creep_work"] > 0.0).sum() > 90
    assert found["energy_relative"] < 0.01 and min(found["energy_plastic_lost"], found["energy_creep_lost"]) > 0.0


def dig_hexes(sim: Blocks) -> None:
    """Whole hexahedra are taken out in the middle of the run."""
    if sim.clock.step == 500:
        changes.null(sim, np.flatnonzero((sim.mesh.centroids()[:, 0] > 2.1) & (sim.mesh.macro_of() >= 0)))


def dig_hexes_and_fill(sim: Blocks) -> None:
    """A piece of the bar is out for a while before."""
    dig_hexes(sim)
    piece = np.arange(120, 144)
    if sim.clock.step == 20:
        changes.null(sim, piece)
    if sim.clock.step == 60:
        changes.element_model(sim, piece, "mech_iso_elastic", {**ROCK, "young": 5e7})


def settling(sim: Blocks) -> None:
    """A slab that comes into static balance with its weight and what is prescribed, in small strains."""
    sim.take_mesh(box((16, 3, 3), (8.0, 1.0, 1.0), shaken=0.15))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    sim.option(collision=False, dynamic=False, large_strain=False)
    mesh = sim.mesh
    sim.velocity_condition(np.unique(mesh.layers["bottom"]), vx=0.0, vy=0.0, vz=0.0)
    sim.velocity_condition(np.unique(mesh.layers["top"])[:5], vz=-1e-9)
    sim.gravity(0.0, 1.0, -9.81)


def crowding(sim: Blocks) -> None:
    """Blocks of several kinds that hit a plate and each other, slide over it through all strips, stick and rub; faces
    and elements differ, contacts are damped, and one block is dug out while others lie on it."""
    plate = box((16, 3, 1), (3.2, 0.6, 0.2), shaken=0.15)
    stone = box((2, 2, 1), (0.24, 0.22, 0.14), 5), box((2, 1, 2), (0.2, 0.13, 0.2), 12)
    away = [(0.11 + 0.34 * k, 0.05 + 0.03 * (k % 4), 0.21 + 0.005 * k) for k in range(6)]
    away += [(0.16 + 0.34 * k, 0.13, 0.45 + 0.003 * k) for k in range(5)]
    parts = [(plate, (0.0, 0.0, 0.0)), *((stone[k % 2], at) for k, at in enumerate(away))]
    begin = np.cumsum([0, *(len(mesh.points) for mesh, _ in parts)])
    mesh = Mesh.of(
        np.concatenate([mesh.points + np.array(at) for mesh, at in parts]),
        np.concatenate([mesh.cells + k for (mesh, _), k in zip(parts, begin)]),
    )
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 2e7, "damp_factor": 0.05, "friction": 25.0})
    sim.velocity_condition(np.flatnonzero(mesh.points[: begin[1], 2] < 1e-9), vx=0.0, vy=0.0, vz=0.0)
    edges = mesh.edges()
    free = edges.faces[~edges.inner, 0]
    top = free[(np.abs(mesh.points[mesh.face_points(free)][:, :, 2] - 0.2) < 1e-9).all(axis=1)]
    sim.face_model(top, "contact_mohr_coulomb", {"penalty_normal": 4e8, "friction": 10.0, "damping_ratio": 0.2})
    sim.face_model(free[::7], "contact_mohr_coulomb", {"penalty_normal": 2e8, "friction": 40.0, "damping_b": 1.5})
    sim.gravity(4.0, 0.0, -9.81)
    changes.set_velocity(sim, np.arange(begin[1], len(mesh.points)), 5.0, 0.2, -1.0)
    changes.set_velocity(sim, np.arange(begin[-3], begin[-2]), -8.0, 0.0, -2.0)


def dig_below(sim: Blocks) -> None:
    """The first block is taken out."""
    if sim.clock.step == 900:
        changes.null(sim, np.arange(16 * 3 * 6, 16 * 3 * 6 + 20))


def shattering(sim: Blocks) -> None:
    """Jointed blocks that fly along a jointed beam through all strips, hit it and break, and the beam with them; parts
    of them are whole, joints differ from place to place, one crack is there from the beginning."""
    beam = box((16, 2, 1), (3.2, 0.4, 0.2), shaken=0.2)
    stone = box((2, 2, 1), (0.24, 0.22, 0.14), 5), box((2, 1, 2), (0.2, 0.13, 0.2), 12)
    away = [(0.13 + 0.5 * k, 0.05 + 0.03 * (k % 4), 0.205 + 0.005 * k) for k in range(6)]
    parts = [(beam, (0.0, 0.0, 0.0)), *((stone[k % 2], at) for k, at in enumerate(away))]
    begin = np.cumsum([0, *(len(mesh.points) for mesh, _ in parts)])
    mesh = Mesh.of(
        np.concatenate([mesh.points + np.array(at) for mesh, at in parts]),
        np.concatenate([mesh.cells + k for (mesh, _), k in zip(parts, begin)]),
    )
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 2e8, "damp_factor": 0.05, "friction": 25.0})
    edges = mesh.edges()
    inner = edges.faces[edges.inner, 0]
    law = {
        "friction": 30.0, "cohesion": 4e6, "tensile_strength": 8e5, "gf1": 25.0, "gf2": 100.0, "penalty_normal": 4e9,
    }  # fmt: skip
    sim.joint_model(inner[inner % 5 > 0], "classic_intrinsic_cohesive_interface", law)
    sim.joint_property(inner[inner % 10 == 1], {"tensile_strength": 4e5, "penalty_overlay": 6e9, "penalty_shear": 2e9})
    changes.crack(sim, inner[inner % 35 == 7])
    sim.velocity_condition(np.flatnonzero(mesh.points[: begin[1], 2] < 1e-9)[::2], vx=0.0, vy=0.0, vz=0.0)
    sim.gravity(4.0, 0.0, -9.81)
    changes.set_velocity(sim, np.arange(begin[1], len(mesh.points)), 30.0, 0.5, -9.0)
    changes.set_velocity(sim, np.arange(begin[-3], begin[-2]), -30.0, 0.0, -9.0)
    diagnostics.account_energy(sim)


def sliding(sim: Blocks) -> None:
    """The same of tetrahedra and hexahedra, with joints that slide between those that break."""
    shattering_hexes(sim)
    slide_in_turn(sim)


def dig_beam(sim: Blocks) -> None:
    """A piece of the beam is taken out, damage is forgotten at one end."""
    if sim.clock.step == 600:
        changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 0] > 3.1)[:6])
        holds = np.flatnonzero((sim.joint_row > 0) & sim.joint_exists() & ~sim.open)
        changes.reset_joint_state(sim, holds[:20])


def shattering_hexes(sim: Blocks) -> None:
    """The same of hexahedra; a part of the beam is of tetrahedra that hang on them by joints, some of it yields, some
    creeps."""
    cells, size = (14, 2, 1), (2.8, 0.4, 0.2)
    beam, split = hexes(cells, size, 0.1), box(cells, size)
    of_tets = np.flatnonzero(split.centroids()[:, 0] > 2.0)
    own = beam.hexes[beam.points[beam.hexes[:, :8]].mean(axis=1)[:, 0] < 2.0, :8]
    mesh = Mesh.of_hexes(beam.points, own, more=split.cells[of_tets])
    stones = hexes((2, 2, 1), (0.24, 0.22, 0.14), 0.1), hexes((2, 1, 2), (0.2, 0.13, 0.2))
    for k in range(5):
        stone, away = stones[k % 2], (0.13 + 0.5 * k, 0.05 + 0.03 * (k % 4), 0.205 + 0.005 * k)
        mesh = joined(mesh, Mesh.of(stone.points + np.array(away), stone.cells, layers={}, macros=stone.hexes))
    sim.take_mesh(mesh)
    n = len(beam.points)
    rock = {**ROCK, "young": 2e8, "damp_factor": 0.05, "friction": 25.0}
    changes.element_model(sim, None, "mech_iso_elastic", rock)
    x = mesh.centroids()[:, 0]
    soil = {**rock, "friction": 30.0, "dilation": 5.0, "cohesion": 2e5, "tensile": 1e5}
    changes.element_model(sim, np.flatnonzero((x < 0.6) & (mesh.cells.max(axis=1) < n)), "mech_mohr_coulomb", soil)
    soft = {**rock, "maxwell_viscosity": 4e6, "kelvin_shear": 1e8, "kelvin_viscosity": 1e5}
    changes.element_model(
        sim, np.flatnonzero((x > 1.2) & (x < 1.8) & (mesh.cells.max(axis=1) < n)), "mech_burgers", soft
    )
    creep.switch(sim, True)
    joints = sim.numbers_of_joints(None)
    law = {
        "friction": 30.0, "cohesion": 4e6, "tensile_strength": 8e5, "gf1": 25.0, "gf2": 100.0, "penalty_normal": 4e9,
    }  # fmt: skip
    sim.joint_model(joints[joints % 7 > 0], "classic_intrinsic_cohesive_interface", law)
    sim.joint_property(joints[joints % 7 == 1], {"tensile_strength": 4e5, "penalty_overlay": 6e9, "penalty_shear": 2e9})
    changes.crack(sim, joints[joints % 35 == 7])
    sim.velocity_condition(np.flatnonzero(mesh.points[:n, 2] < 1e-9)[::2], vx=0.0, vy=0.0, vz=0.0)
    sim.gravity(4.0, 0.0, -9.81)
    changes.set_velocity(sim, np.arange(n, len(mesh.points)), 30.0, 0.5, -9.0)
    diagnostics.account_energy(sim)


def dig_beam_of_hexes(sim: Blocks) -> None:
    """A piece of the beam is taken out and lets go slowly, damage is forgotten at one end."""
    if sim.clock.step == 250:
        changes.null(sim, np.arange(6), relax=50.0 * sim.clock.dt)
        holds = np.flatnonzero((sim.joint_row > 0) & sim.joint_exists() & ~sim.open)
        changes.reset_joint_state(sim, holds[:20])


ROCK_OF_HEAT = {
    "conductivity": 2.5, "capacity": 1000.0, "conductivity_across": 1.0, "conductivity_angle": 20.0,
    "conductivity_dip": 40.0, "expansion_coeficient": 1e-4, "transfer_coeficient": 400.0,
}  # fmt: skip


def glowing(sim: Blocks) -> None:
    """The same beam and blocks, warmed from places in the beam: they expand, get softer and weaker, break, touch and
    pass heat on; the air is warm, here and there comes a flux."""
    shattering(sim)
    sim.table("weaker", [(20.0, 8e5), (320.0, 5e5)])
    sim.table("softer", [(20.0, 2e8), (320.0, 1.6e8)])
    sim.element_property(None, {"young": Over("softer", TEMPERATURE)})
    joints = np.flatnonzero((sim.joint_row > 0) & sim.joint_exists())
    sim.joint_property(joints[joints % 3 == 0], {"tensile_strength": Over("weaker", TEMPERATURE)})
    heat = Heat.of(sim)
    heat.assign(None, {**ROCK_OF_HEAT, "friction_heat": 0.5})
    heat.initial(None, 20.0)
    sim.table("oven", [(0.0, 20.0), (3e3, 320.0), (1e4, 120.0)])
    heat.prescribe(
        np.flatnonzero((np.abs(sim.mesh.points - (1.6, 0.2, 0.1)) < (0.5, 1.0, 1.0)).all(axis=1))[::3], "oven"
    )
    sim.table("room", [(0.0, 20.0), (1e4, 60.0)])
    heat.expose(None, environment="room", transfer=20.0)
    heat.expose(np.flatnonzero(sim.face_exists())[::7], flux=400.0)
    sim.heat_clock(dt=10.0)
    sim.flow_clock(every=2)


def glow_on(sim: Blocks) -> None:
    """What happens to it."""
    dig_beam(sim)
    if sim.clock.step == 620:
        Heat.of(sim).adjust(np.flatnonzero(sim.alive)[:20], {"capacity": 700.0})
        Heat.of(sim).initial(np.flatnonzero(sim.node_exists())[5:9], 90.0)
        sim.heat_clock(steps=2)


def warm_soil(sim: Blocks) -> None:
    """Soil that yields and swings, which heat weakens."""
    yielding(sim)
    x = sim.mesh.centroids()[:, 0]
    sim.table("weaker", [(0.0, 1e5), (300.0, 2e4)])
    sim.element_property(np.flatnonzero(x < 0.6), {"cohesion": Over("weaker", TEMPERATURE)})
    heat = Heat.of(sim)
    heat.assign(None, {**ROCK_OF_HEAT, "transfer_coeficient": 0.0, "expansion_coeficient": 1e-5})
    x = sim.mesh.points[:, 0]
    heat.prescribe(np.flatnonzero(x < x.min() + 0.2), 200.0)
    sim.heat_clock(dt=50.0)


VECTORS = "position", "velocity", "displacement", "reaction", "unbalanced"
NAMES = (
    *(f"{name}_{axis}" for name in VECTORS for axis in "xyz"),
    *(f"stress_{c}" for c in ("xx", "yy", "xy", "zz", "xz", "yz")), "stress_max", "strain_energy", "kinetic_energy",
)  # fmt: skip


def result(sim: Blocks, notes: dict[str, Any]) -> Found:
    """All that may not depend on ranks, and in `about` rebuilds, late ones, elements that came from another rank."""
    found = {name: diagnostics.values(sim, name) for name in NAMES}
    found["time"] = np.array([sim.clock.time, sim.clock.dt, diagnostics.unbalanced_ratio(sim)])
    came = sim.comm.allgather(len(set(sim.number[sim.owned].tolist()) - notes["first"]))
    found["about"] = np.array([sim.rebuilds, sim.rebuild_state.late, 0, sum(came)])
    if sim.budget is not None:
        found |= {f"energy_{name}": np.array(value) for name, value in diagnostics.energies(sim).items()}
    return found


def it_swings(found: Found) -> None:
    assert np.nanmax(found["displacement_x"]) > 1.5  # flies from one end to the other
    bar = found["displacement_z"][: 13 * 9]
    assert np.nanmax(np.abs(bar)) > 1e-3
    assert np.isnan(found["stress_xx"]).sum() == 10  # dug out


def flow(sim: Blocks, notes: dict[str, Any]) -> Found:
    """The same, with what elements remember of yielding."""
    names = ("plastic_state", "plastic_shear_strain", "plastic_volume_strain", "plastic_work")
    return result(sim, notes) | {name: diagnostics.values(sim, name) for name in names}


def it_flows(found: Found) -> None:
    assert np.nanmax(found["displacement_x"]) > 1.5
    assert (found["plastic_shear_strain"] > 1e-3).sum() > 40
    assert len({int(state) for state in found["plastic_state"] if not np.isnan(state)}) > 4
    assert np.isnan(found["stress_xx"]).sum() == 20  # dug out


def crept(sim: Blocks, notes: dict[str, Any]) -> Found:
    """The same, with what elements remember of creep."""
    names = [f"{name}_{c}" for name in ("creep_strain", "kelvin_strain") for c in ("xx", "yy", "xy", "zz", "xz", "yz")]
    found = {name: diagnostics.values(sim, name) for name in (*names, "creep_work")}
    return result(sim, notes) | found | {"creep_time": np.array([sim.creep.time, sim.creep.dt])}


def it_creeps(found: Found) -> None:
    assert (np.abs(found["creep_strain_xx"]) > 1e-6).sum() > 100
    assert (found["creep_work"] > 0.0).sum() > 100 and found["creep_time"][0] > 1e-4
    assert np.abs(found["kelvin_strain_xz"]).max() > 1e-7


def touching(sim: Blocks, notes: dict[str, Any]) -> Found:
    """The same, with the contacts in the order of their pairs."""
    found = result(sim, notes)
    parts = sim.comm.allgather(diagnostics.contacts(sim))
    every = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    order = np.lexsort((every["element_2"], every["face"]))
    return found | {f"contact_{name}": values[order] for name, values in every.items()}


def in_pieces(sim: Blocks, notes: dict[str, Any]) -> Found:
    """The same, with joints and what broke."""
    found = touching(sim, notes)
    names = "state", "mode", "damage", "opening", "slip", "normal_stress", "shear_stress", "break_energy"
    return found | {name: diagnostics.values(sim, name) for name in names} | {
        f"event_{name}": values for name, values in diagnostics.events(sim).items()
    }  # fmt: skip


def it_shatters(found: Found) -> None:
    counts = np.bincount(found["state"][np.isfinite(found["state"])].astype(int), minlength=4)
    assert counts[1] > 30 and counts[2] > 30 and counts[3] > 100
    assert found["energy_relative"] < 0.01 and found["energy_joints_lost"] > 0.0
    assert len(found["contact_face"]) > 20 and (found["event_mode"] > 1.9).any() and (found["event_mode"] < 1.1).any()


def it_slides(found: Found) -> None:
    assert (found["state"] == 2.0).sum() > 30 and found["energy_joints_lost"] > 0.0
    assert found["energy_relative"] < 0.01


def in_pieces_that_creep(sim: Blocks, notes: dict[str, Any]) -> Found:
    return {**in_pieces(sim, notes), **crept(sim, notes)}


def hexes_shatter(found: Found) -> None:
    counts = np.bincount(found["state"][np.isfinite(found["state"])].astype(int), minlength=4)
    assert counts[1:].min() > 20
    assert found["energy_relative"] < 1e-3 and found["energy_joints_lost"] > 0.0 < found["energy_plastic_lost"]
    assert (found["creep_work"] > 0.0).sum() > 30 and found["energy_creep_lost"] > 0.0
    assert len(found["contact_face"]) > 20 and (found["event_mode"] > 1.9).any() and (found["event_mode"] < 1.1).any()


def hot(sim: Blocks, notes: dict[str, Any]) -> Found:
    """The same, with heat."""
    found, heat = in_pieces(sim, notes), Heat.of(sim)
    found |= {name: diagnostics.values(sim, name) for name in ("temperature", "mean_temperature")}
    found |= {f"heat_{name}": np.array(value) for name, value in heat.account().items()}
    return found | {"heat_clock": np.array([heat.time, heat.dt, heat.sub_steps, heat.cycles])}


def hot_hexes(sim: Blocks, notes: dict[str, Any]) -> Found:
    """The same of hexahedra."""
    heat = Heat.of(sim)
    found = flow_and_creep(sim, notes) | {f"heat_{name}": np.array(value) for name, value in heat.account().items()}
    found |= {name: diagnostics.values(sim, name) for name in ("temperature", "mean_temperature")}
    return found | {"heat_clock": np.array([heat.time, heat.dt, heat.sub_steps, heat.cycles])}


def they_glow(found: Found) -> None:
    they_flow_and_creep(found)
    t = found["temperature"]
    assert np.nanmax(t) > 100.0 and (t > 21.0).sum() > 60 and found["heat_relative"] < 1e-12
    assert found["heat_removed"] > 0.0 and found["heat_given"] > 0.0


def it_glows(found: Found) -> None:
    it_shatters(found)
    t = found["temperature"]
    assert np.nanmax(t) > 100.0 and (t > 21.0).sum() > 60 and found["heat_relative"] < 1e-12
    assert found["heat_removed"] > 0.0 and found["heat_given"] > 0.0


def warm_and_flowing(sim: Blocks, notes: dict[str, Any]) -> Found:
    """Of soil, with heat."""
    heat = Heat.of(sim)
    found = flow(sim, notes) | {"temperature": diagnostics.values(sim, "temperature")}
    return found | {f"heat_{name}": np.array(value) for name, value in heat.account().items()}


def it_is_warm(found: Found) -> None:
    it_flows(found)
    assert np.nanmax(found["temperature"]) > 199.0 and found["heat_relative"] < 1e-12


def it_crowds(found: Found) -> None:
    assert len(found["contact_face"]) > 50
    assert np.nanmax(found["displacement_x"]) > 0.3
    assert np.isnan(found["stress_xx"]).sum() == 20  # dug out
    assert found["about"][0] > 10


def it_hits(found: Found) -> None:
    assert np.nanmax(found["displacement_x"]) > 1.0
    assert found["velocity_z"][-18:].mean() > -2.0  # the flier came down with 3 m/s and faster
    lost = int(np.isnan(found["stress_xx"]).sum())
    assert lost > 0 and lost % 6 == 0  # dug out


def it_settles(found: Found) -> None:
    assert found["time"][2] < 1e-2
    assert np.abs(found["stress_zz"]).max() > 2e4


MODELS = {
    "swinging": Model(swinging, result, it_swings, dig_and_fill, steps=1000, middle=401, come=10, slow=True),
    "soil that swings": Model(yielding, flow, it_flows, dig_soil, steps=1000, middle=401, come=10, slow=True),
    "salt bar": Model(creeping, crept, it_creeps, creep_more, steps=1000, middle=401, slow=True),
    "crowding": Model(crowding, touching, it_crowds, dig_below, steps=1500, middle=701, come=10, slow=True),
    "shattering": Model(shattering, in_pieces, it_shatters, dig_beam, steps=900, middle=501, come=10, slow=True),
    "hexahedra that shatter": Model(
        shattering_hexes, in_pieces_that_creep, hexes_shatter, dig_beam_of_hexes, steps=350, middle=211, come=10
    ),
    "joints that slide": Model(sliding, in_pieces, it_slides, steps=300, middle=151, slow=True),
    "glowing": Model(glowing, hot, it_glows, glow_on, steps=900, middle=501, come=1, slow=True),
    "soil that gets warm": Model(
        warm_soil, warm_and_flowing, it_is_warm, dig_soil, steps=1000, middle=401, come=10, slow=True
    ),
    "hexahedra": Model(
        damped_blocks_of_hexes, touching, it_hits, dig_hexes_and_fill, steps=900, middle=401, come=10, slow=True
    ),
    "hexahedra that flow": Model(
        hexes_that_flow,
        flow_and_creep,
        they_flow_and_creep,
        dig_hexes_that_flow,
        steps=900,
        middle=401,
        come=10,
        slow=True,
    ),
    "hexahedra that glow": Model(
        hexes_that_glow, hot_hexes, they_glow, glow_in_hexes, steps=900, middle=401, come=10, slow=True
    ),
    "hexahedra that obey": Model(
        hexes_that_obey, obeying, they_obey, obey_more, prepare=load_laws, steps=600, middle=401, come=10, slow=True
    ),
    "settling": Model(settling, result, it_settles, steps=200, middle=101, slow=True),
}

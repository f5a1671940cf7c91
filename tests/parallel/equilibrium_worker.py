"""Static solves of a model with joints, rollers, a hole and stages, on any number of ranks; writes what came out.

python equilibrium_worker.py RUN...

RUN: SOLVER, or SOLVER-yields: instead, rock that yields under a stamp, in increments, the second of which softens, or
SOLVER-pumped: a joint that fluid opens by implicit steps, in one go and from a file in mid-injection, -propped: slurry,
or SOLVER-cooled: a jointed bar that cools and yields, SOLVER-rinsed: rock that water cools, or SOLVER-solid,
SOLVER-crushed, SOLVER-burst: tetrahedra, with joints that break, that yield and are dug out, whose joints fluid opens,
SOLVER-sides, SOLVER-seam: the first and the last of hexahedra; one after the other. Files are RUN.npz.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.connectivity import face_points
from hpcdem.physics.fdem.kernels import space
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import PLASTIC_STRAIN, Over
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.wells import QUANTITIES, RATE, SHUT
from hpcdem.physics.heat.implicit import Implicit
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.proppant.assignments import CONCENTRATION
from hpcdem.physics.proppant.model import Proppant
from tests.blocks.support import JOINT, ROCK, near, rectangle, shaken
from tests.flow.support import WATER
from tests.heat.support import GRANITE
from tests.parallel.model import communicator
from tests.space.support import box, hexes

SAND = {"proppant_density": 2650.0, "proppant_size": 1e-6, "proppant_concentration_limit": 0.6}

NAMES = (
    "stress_xx", "stress_yy", "stress_xy", "stress_zz", "displacement_x", "displacement_y", "velocity_x", "velocity_y",
    "opening", "slip", "reaction_x", "reaction_y",
)  # fmt: skip


FLUID = "pressure", "saturation", "fluid"
SPACE = ("stress_xx", "stress_yz", "displacement_x", "displacement_z", "reaction_x", "opening", "slip")


def excavation(sim: Blocks, solver: str, out: str) -> None:
    mesh = shaken(rectangle(15, 5, 2.4, 0.8, kind="mixed"), 0.2)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "young": 1e9})
    joints = sim.numbers_of_joints(None)
    sim.joint_model(joints[: len(joints) // 2], "classic_intrinsic_cohesive_interface",
                    {**JOINT, "penalty_normal": 2e10, "tensile_strength": 1e8, "cohesion": 1e8})  # fmt: skip
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vy=0.0)
    sim.move_constraint(np.flatnonzero((x < 1e-9) & (y > 1e-9)), 2, (0.1, 0.9))
    right = np.flatnonzero((x > 2.4 - 1e-9) & (y > 1e-9))
    sim.velocity_condition(right, vx=-2e-6)
    sim.gravity(0.0, -9.81)
    sim.initial_stress(None, xx=-1e4)
    sim.option(dynamic=False, collision=False)
    sim.move_constraint(np.flatnonzero((x < 1e-9) & (y < 1e-9)), 1)
    first = equilibrium.solve_elastic(sim, cycles=3, solver=solver)
    sim.velocity_condition(right, vx=0.0)
    changes.null(sim, np.flatnonzero(np.hypot(*(mesh.centroids() - [1.1, 0.4]).T) < 0.2), relax=50)
    second = equilibrium.solve_elastic(sim, solver=solver)
    found = {name: diagnostics.values(sim, name) for name in NAMES}
    convergence.advance(sim, 30)
    found.update({f"later_{name}": diagnostics.values(sim, name) for name in NAMES})
    found["ratios"] = np.array([first.ratio, second.ratio, diagnostics.unbalanced_ratio(sim)])
    found["counts"] = np.array([first.iterations, first.factors, first.unknowns, second.iterations, sim.clock.step])
    if sim.comm.rank == 0:
        np.savez(out, **found)


def stamp(sim: Blocks, solver: str, out: str) -> None:
    mesh = shaken(rectangle(24, 8, 2.4, 0.8, kind="mixed"), 0.2)
    sim.take_mesh(mesh)
    soil = {
        "density": 2000.0, "bulk": 3.9e9, "shear": 2.8e9, "friction": 30.0, "dilation": 10.0, "cohesion": 3.45e6,
        "tensile": 1e6,
    }  # fmt: skip
    changes.element_model(sim, None, "mech_mohr_coulomb", soil)
    x, y = mesh.points.T
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
    sim.velocity_condition(np.flatnonzero((y > 0.8 - 1e-9) & (np.abs(x - 1.0) < 0.45)), vx=0.0, vy=-1.2e-3)
    sim.gravity(0.0, -9.81)
    sim.option(dynamic=False, collision=False)
    first = equilibrium.solve_elastic(sim, solver=solver, steps=3)
    sim.table("c", [(0.0, 3.45e6), (0.01, 3e6)])
    sim.element_property(None, {"cohesion": Over("c", PLASTIC_STRAIN)})
    changes.null(sim, np.flatnonzero(np.hypot(*(mesh.centroids() - [0.4, 0.4]).T) < 0.1), relax=50)
    second = equilibrium.solve_elastic(sim, solver=solver)
    names = (*NAMES, "plastic_shear_strain", "plastic_volume_strain", "plastic_work", "plastic_state")
    found = {name: diagnostics.values(sim, name) for name in names if name not in ("opening", "slip")}
    found["ratios"] = np.array([first.ratio, second.ratio])
    found["counts"] = np.array([first.iterations, first.increments, second.iterations, second.increments])
    if sim.comm.rank == 0:
        np.savez(out, **found)


def go_on(sim: Blocks, end: float, solver: str) -> None:
    """Implicit steps of the fluid to this flow time [s]."""
    flow = Flow.of(sim)
    with Coupled(sim, 0.05, solver) as run:
        while flow.time < end * (1.0 - 1e-12):
            run.advance(end)


def pumped(sim: Blocks, solver: str, out: str, propped: bool = False) -> None:
    sim.take_mesh(rectangle(24, 8, 2.4, 0.8, y0=-0.4, kind="mixed"))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    joints = np.unique(np.minimum(*(lambda faces: (faces, sim.partner[faces]))(near(sim.the_mesh(), 1, 0.0, True))))
    law = {**JOINT, "friction": 30.0, "tensile_strength": 1e6, "gf1": 20.0, "penalty_normal": 100.0 * ROCK["young"]}
    sim.joint_model(joints, "classic_intrinsic_cohesive_interface", law)
    sim.option(dynamic=False, large_strain=False, collision=True)
    sim.initial_stress(None, yy=-1e6)
    x, y = sim.the_mesh().points.T
    sim.velocity_condition(np.flatnonzero(np.abs(np.abs(y) - 0.4) < 1e-9), vx=0.0, vy=0.0)
    equilibrium.solve_elastic(sim)
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, "aperature_initial": 5e-6})
    if propped:
        flow.prescribe(np.flatnonzero((x < 1e-9) & (np.abs(y) < 1e-9)), kernels.RATE, 5e-5)
        proppant = Proppant.of(sim)
        proppant.assign(joints, SAND)
        proppant.prescribe(None, CONCENTRATION, 0.2)
    else:
        flow.drill("pump", np.flatnonzero((x < 0.25) & (np.abs(y) < 1e-9)))
        flow.stage("pump", RATE, 5e-5, 0.83, math.inf)
        flow.stage("pump", SHUT, 0.0, math.inf, math.inf)
    sim.gravity(5.0, 0.0)
    middle, again = Path(out).with_suffix(".sav"), Blocks(sim.comm)
    go_on(sim, 0.6, solver)
    if propped:  # all that is thicker is a pack now, which pushes
        proppant.prescribe(None, CONCENTRATION, 0.1)
        proppant.adjust({"proppant_concentration_limit": 0.15, "proppant_modulus": 4e5})
    saved_state.save(sim, middle)
    saved_state.restore(again, middle)
    for one in (sim, again):  # joints that broke are joints again, see pressed.py
        go_on(one, 1.0, solver)
    found = {name: diagnostics.values(sim, name) for name in NAMES}
    for name in FLUID:
        found[name] = flow.values("flow-node", name)
        found[f"again_{name}"] = Flow.of(again).values("flow-node", name)
    found["joints"] = np.array(diagnostics.joint_counts(sim))
    found["account"] = np.array(list(flow.account().values())[:4])
    found["wells"] = np.array([flow.well_value(one.name, name) for one in flow.wells for name in QUANTITIES])
    if propped:
        found |= {name: flow.values("flow-node", name) for name in ("concentration", "proppant", "pack_pressure")}
        found["sand"] = np.array(list(proppant.account().values())[:5])
    if sim.comm.rank == 0:
        np.savez(out, **found)


def propped(sim: Blocks, solver: str, out: str) -> None:
    pumped(sim, solver, out, propped=True)


def cooled(sim: Blocks, solver: str, out: str) -> None:
    sim.take_mesh(shaken(rectangle(16, 4, 2.4, 0.6, kind="mixed"), 0.2))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    mesh = sim.the_mesh()
    x, y = mesh.points.T
    weak = {**{name: ROCK[name] for name in ("density", "young", "poisson_ratio")}, "friction": 30.0, "cohesion": 5e6}
    left = np.flatnonzero(mesh.centroids()[:, 0] < 0.8)
    changes.element_model(sim, left, "mech_mohr_coulomb", {**weak, "dilation": 10.0, "tensile": 4e6})
    joints = sim.numbers_of_joints(None)
    law = {**JOINT, "friction": 30.0, "tensile_strength": 1e8, "cohesion": 1e8, "penalty_normal": 20.0 * ROCK["young"]}
    ends = np.array([mesh.points[mesh.cells[j // 4]][:3].mean(axis=0)[0] for j in joints])
    sim.joint_model(joints[np.abs(ends - 1.2) < 0.15], "classic_intrinsic_cohesive_interface", law)
    sim.option(dynamic=False, large_strain=False, collision=False)
    for end in (0.0, 2.4):
        sim.velocity_condition(np.flatnonzero(np.abs(x - end) < 1e-9), vx=0.0, vy=0.0)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "expansion_coeficient": 1e-5, "conductivity_across": 1.0})
    heat.initial(None, 20.0)
    sim.table("winter", [(0.0, 20.0), (1e5, -10.0)])
    heat.prescribe(np.flatnonzero(x < 1e-9), "winter")
    heat.expose(None, environment="winter", transfer=30.0)
    run = Implicit(sim, solver)
    for _ in range(5):
        run.advance(2e4)
    run.close()
    found = {name: diagnostics.values(sim, name) for name in (*NAMES, "temperature", "plastic_work")}
    assert found["plastic_work"].max() > 0.0
    found["joints"] = np.array(diagnostics.joint_counts(sim))
    found["account"] = np.array(list(heat.account().values())[:4])
    if sim.comm.rank == 0:
        np.savez(out, **found)


def rinsed(sim: Blocks, solver: str, out: str) -> None:
    """Cold water flows through warm rock, whose parts touch along a crack."""
    sim.take_mesh(shaken(rectangle(24, 6, 2.4, 0.6, kind="mixed"), 0.2))
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    mesh = sim.the_mesh()
    x, y = mesh.points.T
    ends = mesh.points[face_points(mesh.cells, joints := sim.numbers_of_joints(None))]
    wet = (np.abs(ends[:, :, 1] - 0.3) < 0.06).all(axis=1)
    flow = Flow.of(sim)
    flow.assign(joints[wet], {**WATER, "aperature_initial": 5e-4, "fluid_bulk": 1e6})
    changes.crack(sim, joints[(np.abs(ends[:, :, 0] - 1.2) < 0.06).all(axis=1)])
    sim.parts(mechanical=False)
    flow.fill(None, saturation=1.0)
    network = flow.network.nodes
    for end, pressure in ((x[network].min(), 100.0), (x[network].max(), 0.0)):
        flow.prescribe(network[x[network] == end], kernels.PRESSURE, pressure)
    with Coupled(sim, 1.0, "direct") as run:
        run.steady()
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, "transfer_coeficient": 20.0})
    heat.initial(None, 60.0)
    fluid = heat.of_fluid()
    fluid.assign(None, {"conductivity": 0.6, "capacity": 4200.0, "transfer_coeficient": 150.0,
                        "second_order": 1.0})  # fmt: skip
    heat.prescribe_fluid(network[x[network] == x[network].min()], 10.0)
    run = Implicit(sim, solver)
    for _ in range(10):
        run.advance(1e3)
    found = {"temperature": diagnostics.values(sim, "temperature"), "water": flow.values("flow-node", "temperature")}
    found["account"] = np.array(list(heat.account().values())[:5])
    run.steady()
    run.close()
    found["steady"] = flow.values("flow-node", "temperature")
    if sim.comm.rank == 0:
        np.savez(out, **found)


def solid(sim: Blocks, solver: str, out: str, of_hexes: bool = False) -> None:
    """A bar with joints in its right half, held along oblique ways, pulled until some break."""
    cells, size = (12, 2, 2), (2.4, 0.4, 0.3)
    mesh = hexes(cells, size, 0.2) if of_hexes else box(cells, size, 5, shaken=0.2)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    face = mesh.points[mesh.face_points(np.arange(4 * len(mesh.cells)))][:, :, 0]
    joints = np.intersect1d(np.flatnonzero(((face > 1.1) & (face < 1.9)).all(axis=1)), sim.numbers_of_joints(None))
    sim.joint_model(joints, "classic_intrinsic_cohesive_interface", {**JOINT, "penalty_normal": 5e11, "gf1": 200.0})
    sim.option(dynamic=False, collision=False)
    left, right = (np.unique(mesh.layers[side]) for side in ("left", "right"))
    sim.velocity_condition(left, vx=0.0, vy=0.0, vz=0.0)
    sim.move_constraint(np.unique(mesh.layers["bottom"])[4:7], space.ACROSS, (0.1, 0.2, 0.9))
    sim.velocity_condition(right, vx=4e-5, vy=0.0)
    sim.gravity(0.0, 0.0, -9.81)
    sim.initial_stress(None, xx=-1e4, yz=3e3)
    first = equilibrium.solve_elastic(sim, cycles=2, solver=solver)
    second = equilibrium.solve_elastic(sim, solver=solver, softening=True)
    found = {name: diagnostics.values(sim, name) for name in SPACE}
    sim.velocity_condition(right, vx=0.0, vy=0.0)
    convergence.advance(sim, 30)
    found.update({f"later_{name}": diagnostics.values(sim, name) for name in SPACE})
    found["ratios"] = np.array([first.ratio, second.ratio, diagnostics.unbalanced_ratio(sim)])
    found["joints"] = np.array(diagnostics.joint_counts(sim))
    if sim.comm.rank == 0:
        np.savez(out, **found)


def sides(sim: Blocks, solver: str, out: str) -> None:
    solid(sim, solver, out, True)


def burst(sim: Blocks, solver: str, out: str, of_hexes: bool = False) -> None:
    """A plane of joints between tetrahedra that a well opens, then shuts in; where they broke they press and rub."""
    mesh = (hexes if of_hexes else box)((12, 2, 4), (1.2, 0.2, 0.4))
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    joints = sim.numbers_of_joints(None)
    joints = joints[(np.abs(mesh.points[mesh.face_points(joints)][:, :, 2] - 0.2) < 1e-9).all(axis=1)]
    law = {**JOINT, "friction": 30.0, "tensile_strength": 1e6, "gf1": 20.0, "penalty_normal": 100.0 * ROCK["young"]}
    sim.joint_model(joints, "classic_intrinsic_cohesive_interface", law)
    sim.option(dynamic=False, large_strain=False, collision=True)
    sim.initial_stress(None, zz=-1e6)
    x, y, z = mesh.points.T
    sim.velocity_condition(np.flatnonzero(np.abs(np.abs(z - 0.2) - 0.2) < 1e-9), vx=0.0, vy=0.0, vz=0.0)
    equilibrium.solve_elastic(sim, solver="direct")
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, "aperature_initial": 5e-6, "shear_dilation": 3.0})
    flow.drill("pump", np.flatnonzero((x < 0.15) & (np.abs(z - 0.2) < 1e-9)))
    flow.stage("pump", RATE, 1e-5, 0.43, math.inf)
    flow.stage("pump", SHUT, 0.0, math.inf, math.inf)
    sim.gravity(5.0, 1.0, -2.0)
    for end in (0.3, 0.45, 0.5):
        go_on(sim, end, solver)
    found = {name: diagnostics.values(sim, name) for name in SPACE}
    for name in FLUID:
        found[name] = flow.values("flow-node", name)
    found["joints"] = np.array(diagnostics.joint_counts(sim))
    found["account"] = np.array(list(flow.account().values())[:4])
    found["wells"] = np.array([flow.well_value("pump", name) for name in QUANTITIES])
    if sim.comm.rank == 0:
        np.savez(out, **found)


def seam(sim: Blocks, solver: str, out: str) -> None:
    burst(sim, solver, out, True)


def crushed(sim: Blocks, solver: str, out: str) -> None:
    """A bar of rock that yields under a stamp; a part is dug out."""
    mesh = box((9, 2, 2), (2.4, 0.6, 0.6), 5, shaken=0.2)
    sim.take_mesh(mesh)
    soil = {
        "density": 2000.0, "bulk": 3.9e9, "shear": 2.8e9, "friction": 30.0, "dilation": 10.0, "cohesion": 3.45e6,
        "tensile": 1e6,
    }  # fmt: skip
    changes.element_model(sim, None, "mech_mohr_coulomb", soil)
    sim.option(dynamic=False, collision=False)
    bottom, top = (np.unique(mesh.layers[side]) for side in ("bottom", "top"))
    sim.velocity_condition(bottom, vx=0.0, vy=0.0, vz=0.0)
    sim.velocity_condition(top[np.abs(mesh.points[top, 0] - 1.0) < 0.45], vx=0.0, vy=0.0, vz=-1.5e-3)
    sim.gravity(0.0, 0.0, -9.81)
    first = equilibrium.solve_elastic(sim, solver=solver, steps=3)
    changes.null(sim, np.flatnonzero(mesh.centroids()[:, 0] > 2.1))
    second = equilibrium.solve_elastic(sim, solver=solver)
    found = {name: diagnostics.values(sim, name) for name in (*SPACE[:-2], "plastic_shear_strain", "plastic_work")}
    found["ratios"] = np.array([first.ratio, second.ratio])
    found["counts"] = np.array([first.iterations, first.increments, second.iterations])
    if sim.comm.rank == 0:
        np.savez(out, **found)


KINDS = {
    "": excavation, "yields": stamp, "pumped": pumped, "propped": propped, "cooled": cooled, "rinsed": rinsed,
    "solid": solid, "crushed": crushed, "burst": burst, "sides": sides, "seam": seam,
}  # fmt: skip

if __name__ == "__main__":
    for run in sys.argv[1:]:
        solver, _, kind = run.partition("-")
        KINDS[kind](Blocks(communicator()), solver, f"{run}.npz")

"""Tiny runs of blocks that call every kernel once, so that they are compiled before anyone waits for them: one for what
each model needs, one for each kind that only some do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hpcdem.core.comm import SerialComm
from hpcdem.physics.fdem import changes, connectivity, convergence, creep, diagnostics, equilibrium, overlaps
from hpcdem.physics.fdem.elements.kind import SIX_NODE_TRIANGLE
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import PLASTIC_STRAIN, Over, Value

ROCK = {"density": 2700.0, "young": 1e9, "poisson_ratio": 0.25, "damp_factor": 0.1, "friction": 20.0}
JOINT = {
    "friction": 30.0, "cohesion": 1e4, "tensile_strength": 1e4, "gf1": 1e-3, "gf2": 1e-3, "penalty_normal": 1e10,
}  # fmt: skip


def warm_up(threads: int = 1) -> None:
    """Call the kernels of all runs with this many threads per rank. Writes nothing."""
    for mesh in _meshes():
        _rest(mesh, threads)
        sim = _jointed(mesh, threads)
        sim.close_model()
        connectivity.bodies(sim.partner)
        convergence.advance(sim, 3)
        overlaps.count(sim, sim.local)
        diagnostics.energies(sim)
        changes.set_velocity(sim, None, 0.0, 0.0)
        changes.set_velocity(sim, [0, 1], 10.0, 10.0)
        convergence.advance(sim, 20)
        sim.rebuild()
        diagnostics.unbalanced_ratio(sim)
        for name in ("stress_xx", "opening", "position_x", "reaction_x"):
            diagnostics.values(sim, name)
        diagnostics.contacts(sim)
        diagnostics.account_energy(sim, False)
        sim.option(dynamic=False)
        changes.null(sim, [len(mesh.cells) - 2], relax=2)
        convergence.advance(sim, 2)
        sim.time_step(mass_scaling=1e-3)
        sim.option(dynamic=True)
        sim.step()


def tangent(threads: int = 1) -> None:
    """Compile the kernels of the static solver."""
    for mesh in _meshes():
        sim = _jointed(mesh, threads)
        sim.close_model()
        equilibrium.tangent(sim, softening=True)


def six_nodes(threads: int = 1) -> None:
    """Compile the kernels of six-node triangles."""
    mesh = Mesh.of([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)], SIX_NODE_TRIANGLE.cells,
                   macros=[[0, 1, 2, 3, 4, 5, 0]])  # fmt: skip
    sim = _jointed(mesh, threads)
    convergence.advance(sim, 2)
    diagnostics.energies(sim)
    equilibrium.tangent(sim)


def yielding(threads: int = 1) -> None:
    """Compile the kernels of elements that yield."""
    for mesh in _meshes():
        sim = _weak(mesh, threads)
        convergence.advance(sim, 2)
        diagnostics.energies(sim)
        sim.local.yielding.flow(1)


def plastic_tangent(threads: int = 1) -> None:
    """Compile the kernels of the static solver for elements that yield."""
    for mesh in _meshes():
        equilibrium.tangent(_weak(mesh, threads))


def _meshes() -> list[Mesh]:
    """Quads beside triangles, and triangles alone."""
    points = [(x, y) for x in (0.0, 1.0, 2.0, 3.0) for y in (0.0, 1.0)] + [(0.5, 0.999), (1.5, 0.999), (1.0, 2.0)]
    quads = [[0, 2, 3, 1], [2, 4, 5, 3]]
    triangles = [[4, 6, 7, -1], [4, 7, 5, -1], [8, 9, 10, -1]]
    found = []
    for cells in (quads + triangles, triangles):
        used, numbers = np.unique(np.array(cells)[np.array(cells) >= 0], return_inverse=True)
        again = np.array(cells)
        again[again >= 0] = numbers
        found.append(Mesh.of(np.array(points)[used], again))
    return found


_CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0)]


def two(dim: int) -> Mesh:
    """Make a mesh of two triangles, or two tetrahedra, with a joint between them."""
    if dim == 2:
        return Mesh.of([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], [(0, 1, 2, -1), (0, 2, 3, -1)])
    return Mesh.of(_CORNERS, [(0, 1, 2, 3), (1, 4, 2, 3)])


def rock(mesh: Mesh, threads: int, law: str = "mech_iso_elastic", **properties: Value) -> Blocks:
    """A model whose elements have a law."""
    sim = Blocks(SerialComm(), threads)
    sim.take_mesh(mesh)
    changes.element_model(sim, None, law, {**ROCK, **properties})
    return sim


def _jointed(mesh: Mesh, threads: int) -> Blocks:
    """A model with joints, contact, conditions and budgets; open."""
    sim = Blocks(SerialComm(), threads)
    sim.take_mesh(mesh)
    sim.option(overlap="keep")
    changes.element_model(sim, None, "mech_iso_elastic", ROCK)
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", JOINT)
    sim.face_model(None, "contact_mohr_coulomb", {"penalty_normal": 1e10, "damping_t": 1e8})
    sim.face_property([0], {"friction": 1.0})
    sim.velocity_condition([0], vx=0.0, vy=0.0)
    sim.stress_condition([0], normal=-1.0, quiet=True)
    diagnostics.account_energy(sim)
    changes.set_velocity(sim, [len(mesh.points) - 1], 0.0, -1e-3)
    return sim


def _weak(mesh: Mesh, threads: int) -> Blocks:
    """Elements of which some yield; closed."""
    sim = Blocks(SerialComm(), threads)
    sim.take_mesh(mesh)
    sim.table("c", [(0.0, 1.0), (1.0, 0.0)])
    weak: dict[str, Value] = {**ROCK, "dilation": 10.0, "cohesion": Over("c", PLASTIC_STRAIN), "tensile": 1.0}
    changes.element_model(sim, None, "mech_mohr_coulomb", weak)
    sim.initial_stress(None, yy=1e3)
    sim.option(collision=False)
    diagnostics.account_energy(sim)
    sim.close_model()
    return sim


def creeping(threads: int = 1) -> None:
    """Compile the kernels of elements that creep: triangles in motion, then in a static creep step."""
    for mesh in _meshes():
        _creep(mesh, threads)


def _creep(mesh: Mesh, threads: int) -> None:
    """Step in motion, then in a static creep step."""
    sim = rock(mesh, threads, "mech_burgers", kelvin_shear=1e9, kelvin_viscosity=1.0)
    sim.initial_stress(None, yy=1e3)
    sim.option(collision=False)
    creep.switch(sim, True)
    diagnostics.account_energy(sim)
    convergence.advance(sim, 2)
    diagnostics.energies(sim)
    diagnostics.values(sim, "creep_strain_xx")
    diagnostics.account_energy(sim, False)
    _creep_at_rest(sim)


def _creep_at_rest(sim: Blocks) -> None:
    sim.option(dynamic=False)
    creep.switch(sim, True, dt=1.0)
    creep.begin(sim, 1.0)
    sim.local.solids.linear()
    sim.step()
    creep.finish(sim, 1.0)


def _in_space(threads: int, law: str = "mech_iso_elastic", **properties: Value) -> Blocks:
    """Make a model of two tetrahedra, and one that touches them."""
    below = [(x, y, z - 1.001) for x, y, z in _CORNERS[:4]]
    mesh = Mesh.of(_CORNERS + below, [(0, 1, 2, 3), (1, 4, 2, 3), (5, 6, 7, 8)])
    return rock(mesh, threads, law, **properties)


def yielding_in_space(threads: int = 1) -> None:
    """Compile the kernels of tetrahedra that yield."""
    sim = _in_space(threads, "mech_mohr_coulomb", dilation=10.0, cohesion=1.0, tensile=1.0)
    sim.table("c", [(0.0, 1.0), (1.0, 0.0)])
    sim.element_property([0], {"cohesion": Over("c", PLASTIC_STRAIN)})
    sim.initial_stress(None, yy=1e3)
    convergence.advance(sim, 2)
    for name in ("strain_energy", "plastic_work"):
        diagnostics.values(sim, name)


def creeping_in_space(threads: int = 1) -> None:
    """Compile the kernels of tetrahedra that creep."""
    sim = _in_space(threads, "mech_burgers", kelvin_shear=1e9, kelvin_viscosity=1.0)
    sim.initial_stress(None, yy=1e3)
    creep.switch(sim, True)
    convergence.advance(sim, 2)
    for name in ("strain_energy", "creep_strain_xx"):
        diagnostics.values(sim, name)


def tangent_in_space(threads: int = 1) -> None:
    """Compile the kernels of the static solver for tetrahedra, with joints, one of them past its peak, and yielding."""
    sim = _in_space(threads, "mech_mohr_coulomb", dilation=10.0, cohesion=1.0, tensile=1.0)
    sim.initial_stress(None, yy=1e3)
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", JOINT)
    sim.close_model()
    equilibrium.tangent(sim, softening=True)


def hexahedra(threads: int = 1) -> None:
    """Compile the kernels of hexahedra: two in contact in motion, at rest, and their tangent."""
    sim = rock(_hexes((0.0, 1.0, 1.001, 2.0), range(8), range(8, 16)), threads)
    sim.initial_stress(None, yy=1e3)
    sim.stress_condition([0], normal=-1.0)
    convergence.advance(sim, 2)
    diagnostics.values(sim, "strain_energy")
    sim.option(dynamic=False)
    convergence.advance(sim, 2)
    equilibrium.tangent(sim)


def _hexes(levels: Sequence[float], *cells: range) -> Mesh:
    """Hexahedra of the corners of a square on some levels."""
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    return Mesh.of_hexes([(x, y, z) for z in levels for x, y in square], cells)


def _hexahedron(threads: int, law: str, **properties: Value) -> Blocks:
    sim = rock(_hexes((0.0, 1.0), range(8)), threads, law, **properties)
    sim.initial_stress(None, yy=1e3)
    return sim


def yielding_hexahedra(threads: int = 1) -> None:
    """Compile the kernels of hexahedra that yield, and their tangent."""
    sim = _hexahedron(threads, "mech_mohr_coulomb", dilation=10.0, cohesion=1.0, tensile=1.0)
    sim.table("c", [(0.0, 1.0), (1.0, 0.0)])
    sim.element_property(None, {"cohesion": Over("c", PLASTIC_STRAIN)})
    convergence.advance(sim, 2)
    for name in ("strain_energy", "plastic_work"):
        diagnostics.values(sim, name)
    sim.option(dynamic=False)
    equilibrium.tangent(sim)


def creeping_hexahedra(threads: int = 1) -> None:
    """Compile the kernels of hexahedra that creep, in motion and in a static creep step."""
    sim = _hexahedron(threads, "mech_burgers", kelvin_shear=1e9, kelvin_viscosity=1.0)
    creep.switch(sim, True)
    convergence.advance(sim, 2)
    for name in ("strain_energy", "creep_strain_xx"):
        diagnostics.values(sim, name)
    _creep_at_rest(sim)


def jointed_hexahedra(threads: int = 1) -> None:
    """Compile the kernels of joints between hexahedra, which are torn apart, and their tangent."""
    sim = rock(_hexes((0.0, 1.0, 2.0), range(8), range(4, 12)), threads)
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", JOINT)
    changes.set_velocity(sim, [8, 9], 1.0, 1.0, 1.0)
    diagnostics.account_energy(sim)
    convergence.advance(sim, 2)
    diagnostics.energies(sim)
    diagnostics.values(sim, "normal_stress")
    equilibrium.tangent(sim, softening=True)


def in_space(threads: int = 1) -> None:
    """Compile the kernels of tetrahedra: in motion with conditions and loads, torn apart, and at rest."""
    sim = _in_space(threads)
    sim.face_model([0], "contact_mohr_coulomb", {"penalty_normal": 1e10})
    sim.initial_stress(None, yy=1e3)
    sim.velocity_condition([0], vx=0.0, vz=0.0)
    sim.stress_condition([0], normal=-1.0, quiet=True)
    convergence.advance(sim, 20)
    overlaps.count(sim, sim.local)
    sim.rebuild()
    for name in ("stress_xx", "strain_energy", "position_x", "reaction_x"):
        diagnostics.values(sim, name)
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", JOINT)
    changes.set_velocity(sim, [4], 1.0, 1.0, 1.0)
    diagnostics.account_energy(sim)
    convergence.advance(sim, 20)
    diagnostics.energies(sim)
    diagnostics.account_energy(sim, False)
    diagnostics.values(sim, "normal_stress")
    sim.rebuild()
    sim.option(dynamic=False)
    changes.null(sim, [1], relax=2)
    convergence.advance(sim, 2)
    diagnostics.unbalanced_ratio(sim)


def _rest(mesh: Mesh, threads: int) -> None:
    """Call the kernels of one body at rest, of which an element is removed gradually."""
    sim = rock(mesh, threads)
    sim.initial_stress(None, yy=-1.0)
    sim.option(dynamic=False, overlap="keep")
    sim.step()
    changes.null(sim, [1], relax=2)
    convergence.advance(sim, 2)

"""Hexahedra: overlays, patch, tangent, rotation, loads, masses, time step, what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, hexahedra, reference, saved_state
from hpcdem.physics.fdem import mesh as meshes
from hpcdem.physics.fdem.kernels import hexes as kernels
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow.model import Flow
from hpcdem.pre.mesh.imported import import_mesh
from tests.cases.solids import exact
from tests.flow.support import WATER
from tests.space.support import LAME, ROCK, SHEAR, body, box, faces_on, hexes, nodes_on
from tests.space.test_equilibrium import STRAIN, STRESSES, boundary, farthest

CUBE = [(x, y, z) for z in (0.0, 1.0) for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))]


def test_both_overlays_and_the_six_parts_fill_the_hexahedron():
    """Warped sides too; neighbours cut their common side alike, so that the mesh is one of tetrahedra."""
    mesh = hexes((3, 2, 2), (1.2, 1.0, 0.9), 0.2)
    found = hexahedra.volumes(mesh.points, mesh.hexes)
    assert found.min() > 0.0 and mesh.areas().min() > 0.0
    whole = [found[:, :5].sum(), found[:, 5:].sum(), mesh.areas().sum()]
    assert whole == pytest.approx([1.2 * 1.0 * 0.9] * 3, rel=1e-12)
    edges = mesh.edges()
    assert int((~edges.inner).sum()) == 4 * (3 * 2 + 3 * 2 + 2 * 2)
    parts = hexahedra.corner_volumes(np.array(CUBE), np.arange(9)[None] % 8)
    assert parts == pytest.approx(1.0 / 8.0)


def test_inside_out_or_flat_is_refused():
    for points in (CUBE[4:] + CUBE[:4], [(x, y, 0.5 * z if x < 0.5 else -z) for x, y, z in CUBE]):
        with pytest.raises(HpcdemError, match="hexahedron 0"):
            meshes.check(Mesh.of_hexes(points, [range(8)]))


@pytest.mark.parametrize("large", [False, True])
def test_patch(large):
    """The stress of the table of fdem_3d.md to 1e-10."""
    mesh = hexes((2, 2, 3), (1.0, 0.9, 0.8), 0.2)
    sim = body(mesh, dynamic=False)
    sim.option(large_strain=large)
    outside = boundary(mesh)
    for node, v in zip(outside, (mesh.points[outside] @ STRAIN.T).tolist()):
        sim.velocity_condition([node], vx=v[0], vy=v[1], vz=v[2])
    equilibrium.solve_elastic(sim)
    want = (6.00125e6, -1.998e6, 6.001e6, 3.9993e6, 3.9997e6, 6.0004e6) if large else (6e6, -2e6, 6e6, 4e6, 4e6, 6e6)
    for name, value in zip(STRESSES, want):
        stress = diagnostics.values(sim, name)
        assert stress == pytest.approx(value, rel=1e-5 if large else 1e-9)
        assert np.ptp(stress) < 1e-10 * ROCK["young"]
    energy = diagnostics.values(sim, "strain_energy").sum()
    sym = 0.5 * (STRAIN + STRAIN.T)
    density = 0.5 * LAME * np.trace(sym) ** 2 + SHEAR * (sym * sym).sum()
    assert energy == pytest.approx(density * 1.0 * 0.9 * 0.8, rel=1e-3 if large else 1e-9)


def test_loads_on_sides_are_those_of_quads():
    """A uniform traction on a warped bar gives a uniform stress: the mean of both ways to cut a side meets the mean of
    both overlays."""
    mesh = hexes((2, 2, 2), (1.0, 0.8, 0.6), 0.2)
    sim = body(mesh, dynamic=False)
    sim.option(large_strain=False)
    for side, axis in (("left", "vx"), ("front", "vy"), ("bottom", "vz")):
        sim.velocity_condition(nodes_on(mesh, side), **{axis: 0.0})
    sim.stress_condition(faces_on(mesh, "right"), xx=3e3)
    sim.stress_condition(faces_on(mesh, "top"), normal=-2e3)
    sim.initial_stress(None, xx=1e3)
    equilibrium.solve_elastic(sim)
    for name, value in zip(STRESSES, (3e3, 0.0, -2e3, 0.0, 0.0, 0.0)):
        assert diagnostics.values(sim, name) == pytest.approx(value, abs=1e-3)


@pytest.mark.parametrize("large, beta", [(True, 0.0), (True, 2e-7), (False, 2e-7)])
def test_forces_are_those_of_the_plain_reference(large, beta):
    """Of any shape, strain, turn and motion, with initial stress, viscosity, gravity and Rayleigh damping; of more than
    a block of them, and on several threads."""
    rng = np.random.default_rng(5)
    sim = body(hexes((5, 3, 3), (1.0, 0.9, 0.6), 0.3), damp_factor=0.4)
    sim.option(large_strain=large)
    sim._set(mass_damping=30.0, stiffness_damping=beta)
    sim.gravity(1.0, -2.0, -9.0)
    sim.initial_stress(None, xx=5e8, yy=-3e8, zz=1e8, xy=2e8, xz=-1e8, yz=3e8)
    sim.close_model()
    own, place = sim.local.hexes, sim.local.hexes.place[: sim.local.hexes.count]
    x, v = sim.x.reshape(-1), sim.v.reshape(-1)
    mesh = sim.mesh.points[own.nodes]
    for i in range(own.count):
        gradient = turned(np.eye(3), rng.uniform(0.0, 6.0)).T @ (np.eye(3) + rng.uniform(-0.05, 0.05, (3, 3)))
        now = mesh[i] @ gradient.T + rng.uniform(-3e-3, 3e-3, (8, 3)) + [7.0, -3.0, 5.0]
        for axis in range(3):
            x[place[i] + axis], v[place[i] + axis] = now[:, axis], rng.uniform(-3.0, 3.0, 8)
        force = np.full(sim.x.shape, np.nan)  # neighbours share no rows
        own.forces(force, sim.v, (1.0, -2.0, -9.0), sim.local.solids.blocks[1].s0)
        exact = reference.hexahedron_forces(mesh[i], now, *speeds_and_solid(sim, v, place, i))
        exact += own.h[i, 8:16, None] * (np.array([1.0, -2.0, -9.0]) - 30.0 * v[place[i][:, None] + np.arange(3)])
        found = force.reshape(-1)[place[i][:, None] + np.arange(3)]
        assert np.abs(found - exact).max() < 1e-11 * np.abs(exact).max()
        assert np.isfinite(force.reshape(-1, 4)[:, :3]).sum() == 24 * own.count
    several = np.full(sim.x.shape, np.nan)
    sim.threads = 3
    own.forces(several, sim.v, (1.0, -2.0, -9.0), sim.local.solids.blocks[1].s0)
    assert np.array_equal(force, several, equal_nan=True)


def speeds_and_solid(sim, v, place, i):
    h = sim.local.hexes.h[i]
    xx, yy, xy, zz, xz, yz = h[:6]
    stress = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    o = sim.options
    solid = reference.Solid(h[16], h[17], h[18], stress, not o.large_strain, o.stiffness_damping)
    return v[place[i][:, None] + np.arange(3)], solid


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    """About (1, 2, 3), by Rodrigues' formula."""
    axis = np.array([1.0, 2.0, 3.0]) / math.sqrt(14.0)
    return (
        points * math.cos(angle)
        + np.cross(axis, points) * math.sin(angle)
        + np.outer(points @ axis, axis) * (1 - math.cos(angle))
    )


def test_turned_it_has_no_stress():
    """Rotations through 360 degrees: stresses below 1e-9 E."""
    mesh = hexes((2, 1, 1), (1.0, 0.5, 0.6), 0.0)
    sim = body(mesh)
    sim.close_model()
    for angle in np.linspace(0.0, 2.0 * math.pi, 9):
        equilibrium.place_corners(sim, turned(mesh.points, angle)[equilibrium.all_nodes(sim).point])
        stress, energy = sim.local.stresses()
        assert np.abs(stress).max() < 1e-9 * ROCK["young"] and np.abs(energy).max() < 1e-6


def sag(across: int, nu: float) -> float:
    mesh = hexes((10 * across, across, across), (10.0, 1.0, 1.0))
    sim = body(mesh, dynamic=False, poisson_ratio=nu)
    sim.option(large_strain=False)
    sim.velocity_condition(nodes_on(mesh, "left"), vx=0.0, vy=0.0, vz=0.0)
    sim.stress_condition(faces_on(mesh, "right"), xz=-1e5)
    equilibrium.solve_elastic(sim)
    end = nodes_on(mesh, "right")
    return -diagnostics.values(sim, "displacement_z", end).mean() / exact.cantilever(1e5, 10.0, 1.0, ROCK["young"], nu)


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    "across, nu, want",
    [
        (2, 0.25, 0.739), (4, 0.25, 0.912), pytest.param(6, 0.25, 0.956, marks=SLOW),
        (2, 0.49, 0.730), pytest.param(4, 0.49, 0.894, marks=SLOW), pytest.param(6, 0.49, 0.938, marks=SLOW),
    ],
)  # fmt: skip
def test_cantilever(across, nu, want):
    """The rows of fdem_3d.md, D: it does not lock near nu = 0.5."""
    assert sag(across, nu) == pytest.approx(want, abs=0.01)


def leaning() -> Blocks:
    mesh = hexes((2, 2, 3), (0.6, 0.5, 0.9), 0.2)
    sim = body(mesh, dynamic=False)
    sim.velocity_condition(nodes_on(mesh, "bottom"), vx=0.0, vy=0.0, vz=0.0)
    sim.stress_condition(faces_on(mesh, "top"), zz=-8e5, xz=3e5, yz=1e5)
    sim.initial_stress(None, xx=-3e5, gradient={"zz": (0.0, 1e5, 2e5)})
    sim.gravity(0.0, 0.0, -9.81)
    return sim


def test_the_same_as_relaxation_then_at_rest_in_motion():
    sim, slow = leaning(), leaning()
    found = equilibrium.solve_elastic(sim)
    assert found.ratio < 1e-9
    assert convergence.solve(slow, ratio=1e-9, cycles=60000).reason == "ratio"
    assert farthest(sim, slow) < 1e-6
    sim.option(dynamic=True)
    convergence.advance(sim, 50)
    assert max(np.abs(diagnostics.values(sim, f"velocity_{a}")).max() for a in "xyz") < 1e-9


def test_energy_of_a_swing():
    """Kinetic and elastic energy of a free bar that swings: constant to 1e-3 with half the stable time step."""
    mesh = hexes((6, 1, 1), (1.2, 0.2, 0.2))
    sim = body(mesh, damp_factor=0.0)
    x = mesh.points[:, 0] - 0.6
    for node, v in enumerate(x):
        changes.set_velocity(sim, [node], 10.0 * v, 0.0, 3.0 * v * v)
    sim.time_step(safety=0.5)
    totals = []
    for _ in range(20):
        convergence.advance(sim, 25)
        both = (sim.v * sim.evaluate().v_next).reshape(-1, 4, 4).sum(axis=2)  # half a step before and after
        kinetic = 0.5 * (sim.local.true_mass * both).sum()
        totals.append(kinetic + diagnostics.values(sim, "strain_energy").sum())
    assert np.ptp(totals) < 2e-3 * np.mean(totals)
    assert diagnostics.values(sim, "strain_energy").sum() > 0.05 * totals[-1]


@pytest.mark.parametrize("shaken", [0.0, 0.3])
def test_the_time_step_is_below_the_stability_limit(shaken):
    """The largest eigenvalue of M^-1 K gives 2 / omega; the bound is below it, not by much."""
    mesh = hexes((2, 2, 2), (1.0, 1.0, 1.0), shaken)
    sim = body(mesh, damp_factor=0.0)
    sim.close_model()
    nodes = equilibrium.all_nodes(sim)
    (_, pieces, _), _ = equilibrium.tangent(sim)
    n = len(nodes.x)
    k = np.zeros((3 * n, 3 * n))
    for node, part in zip(pieces.node, pieces.stiffness):
        at = (3 * node[:, None] + np.arange(3)).reshape(-1)
        k[np.ix_(at, at)] += part
    mass = np.zeros(n)
    np.add.at(mass, sim.node[sim.number].reshape(-1), sim.local.true_mass.reshape(-1))
    assert mass.sum() == pytest.approx(ROCK["density"])
    per = np.repeat(1.0 / np.sqrt(mass), 3)
    limit = 2.0 / math.sqrt(np.linalg.eigvalsh(per[:, None] * k * per)[-1])
    bound = diagnostics.critical_time_step(sim) / sim.options.safety
    assert 0.25 * limit < bound <= limit


def test_restart_of_hexes(tmp_path):
    """n steps, save, m steps are n + m steps, bit for bit."""
    sim = leaning()
    sim.option(dynamic=True)
    convergence.advance(sim, 30)
    saved_state.save(sim, tmp_path / "a.sav")
    convergence.advance(sim, 30)
    other = Blocks()
    saved_state.restore(other, tmp_path / "a.sav")
    convergence.advance(other, 30)
    for name in (*STRESSES, "velocity_x", "displacement_z"):
        assert np.array_equal(diagnostics.values(sim, name), diagnostics.values(other, name))


def test_dug_out_as_a_whole():
    sim = leaning()
    out = np.flatnonzero(sim.mesh.centroids()[:, 2] > 0.62)
    assert len(out) % 6 == 0
    with pytest.raises(CommandError, match="are one hexahedron"):
        changes.null(sim, out[1:])
    changes.null(sim, out)
    equilibrium.solve_elastic(sim)
    left = sim.alive.sum() // 6
    assert left == len(sim.mesh.hexes) - len(out) // 6
    assert np.isnan(diagnostics.values(sim, "stress_zz")).sum() == len(out)


def test_what_hexes_cannot_do_is_refused():
    sim = body(hexes((2, 1, 1), (1.0, 0.5, 0.5)))
    inside = np.flatnonzero((sim.partner > np.arange(len(sim.partner))) & ~sim.joint_exists())
    assert len(inside) == 2 * 6
    with pytest.raises(CommandError, match="there is no joint"):
        sim.joint_model(inside[:1], "classic_intrinsic_cohesive_interface", {"tensile_strength": 1e6})
    with pytest.raises(HpcdemError, match="a crack through a hexahedron"):
        cracked = sim.mesh.face_points(inside[:1])
        meshes.check(Mesh.of(sim.mesh.points, sim.mesh.cells, cracks=cracked, macros=sim.mesh.hexes))
    alone = body(hexes((1, 1, 1), (1.0, 1.0, 1.0)))
    with pytest.raises(CommandError, match="no joint here can be a channel"):
        Flow.of(alone).assign(None, WATER)
    with pytest.raises(CommandError, match="are one hexahedron"):
        changes.element_model(sim, np.arange(7), "mech_iso_elastic", ROCK)


def test_a_cube_of_hexes_falls_onto_a_plate():
    """Contact is that of the tetrahedra in them: the cube bounces off with its momentum turned."""
    plate, cube = hexes((3, 3, 1), (0.6, 0.6, 0.2)), hexes((1, 1, 1), (0.2, 0.2, 0.2))
    mesh = Mesh.of(
        np.concatenate([plate.points, cube.points + [0.2, 0.2, 0.2005]]),
        np.concatenate([plate.cells, cube.cells + len(plate.points)]),
        macros=np.concatenate([plate.hexes, cube.hexes + np.append(np.full(8, len(plate.points)), len(plate.cells))]),
    )
    sim = body(mesh, young=1e9, damp_factor=0.0)
    sim.option(collision=True)
    sim.velocity_condition(np.flatnonzero(mesh.points[:, 2] < 1e-9), vx=0.0, vy=0.0, vz=0.0)
    top = np.arange(len(plate.points), len(mesh.points))
    changes.set_velocity(sim, top, 0.0, 0.0, -2.0)
    convergence.advance(
        sim,
        100,
    )
    for _ in range(60):
        convergence.advance(sim, 50)
        if diagnostics.values(sim, "velocity_z", top).mean() > 0.5:
            break
    assert 0.5 < diagnostics.values(sim, "velocity_z", top).mean() < 2.0


def test_the_same_body_of_tetrahedra_is_stiffer():
    one, other = hexes((4, 1, 1), (4.0, 1.0, 1.0)), box((4, 1, 1), (4.0, 1.0, 1.0), 6)
    sags = []
    for mesh in (one, other):
        sim = body(mesh, dynamic=False)
        sim.velocity_condition(nodes_on(mesh, "left"), vx=0.0, vy=0.0, vz=0.0)
        sim.gravity(0.0, 0.0, -9.81)
        equilibrium.solve_elastic(sim)
        sags.append(-diagnostics.values(sim, "displacement_z").min())
    assert sags[0] > 1.2 * sags[1]


def test_import(tmp_path):
    """Hexahedra beside tetrahedra, with groups and a surface of quads; one that is inside out is turned back."""
    meshio = pytest.importorskip("meshio")
    one = hexes((2, 1, 1), (2.0, 1.0, 1.0))
    cells = one.hexes[:, :8].copy()
    cells[1] = cells[1][[4, 5, 6, 7, 0, 1, 2, 3]]
    points = np.concatenate([one.points, np.array([(5.0, 0, 0), (6, 0, 0), (5, 1, 0), (5, 0, 1)])])
    n = len(one.points)
    side = cells[0][hexahedra.FACES[5]]
    path = tmp_path / "both.msh"
    data = {"gmsh:physical": [np.array([7]), np.array([1, 2]), np.array([3])]}
    data["gmsh:geometrical"] = data["gmsh:physical"]
    blocks = [("quad", side[None]), ("hexahedron", cells), ("tetra", np.array([[n, n + 1, n + 2, n + 3]]))]
    names = {"wall": np.array([7, 2]), "a": np.array([1, 3]), "b": np.array([2, 3]), "c": np.array([3, 3])}
    meshio.write(path, meshio.Mesh(points, blocks, cell_data=data, field_data=names), "gmsh22", binary=False)
    mesh = import_mesh(path, dim=3)
    assert len(mesh.hexes) == 2 and len(mesh.cells) == 13 and mesh.areas().min() > 0.0
    groups = {name: rows.tolist() for name, rows in mesh.groups["physical"].items()}
    assert groups == {"a": list(range(6)), "b": list(range(6, 12)), "c": [12]}
    assert (mesh.points[mesh.layers["wall"]][:, :, 0] == 0.0).all() and len(mesh.layers["wall"]) == 2
    sim = body(mesh)
    convergence.advance(sim, 2)


def test_tetrahedra_that_lock_are_reported_and_hexahedra_are_not():
    for made, told in ((box((2, 1, 1), (1.0, 0.5, 0.5)), True), (hexes((2, 1, 1), (1.0, 0.5, 0.5)), False)):
        sim = body(made, poisson_ratio=0.49)
        log = Heard()
        sim.log = log
        sim.changed()
        sim.close_model()
        assert any("lock" in text for text in log.told) == told


class Heard:
    """A log that is listened to."""

    def __init__(self) -> None:
        self.told: list[str] = []

    def warn_once(self, key: str, text: str) -> None:
        self.told.append(text)

    def info(self, text: str) -> None:
        pass


def test_the_time_step_is_the_least_of_all_hexahedra():
    """Each with its own frequency, viscosity and modulus: of two that of the one that allows less; mass is added until
    the step that is asked for is stable."""
    omega2, eta, modulus = np.array([4.0, 9.0]), np.array([3.0, 0.1]), np.array([2.0, 5.0])
    place = 4 * np.arange(16, dtype=np.int32).reshape(2, 8)
    springs, dashpots = np.zeros((2, 8)), np.zeros((2, 8))
    springs[1, 3], dashpots[0, 5] = 7.0, 2.0

    def step(which, target: float = 0.0, mass=None) -> float:
        mass = np.full((4, 4), 2.0) if mass is None else mass
        return kernels.time_step(
            omega2[which], np.column_stack([eta[which]] * 2)[:, 0], modulus[which], place[which], springs[which],
            dashpots[which], 0.3, 0.2, 0.8, target, mass,
        )  # fmt: skip

    alone = [step([0, 0]), step([1, 1])]
    assert alone[0] != alone[1] and step([0, 1]) == min(alone) == step([1, 0])
    mass = np.full((4, 4), 2.0)
    longer = step([0, 1], 1.5 * 0.8 * min(alone), mass)
    assert longer >= 1.5 * min(alone) * (1.0 - 1e-12) and mass.max() > 2.0

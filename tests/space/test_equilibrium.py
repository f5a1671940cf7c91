"""The static solve in space: the tangent, closed forms, the same as relaxation, what follows on it, what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, creep, diagnostics, equilibrium, linear
from hpcdem.physics.fdem.kernels import joint_law, space
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.space.support import LAME, ROCK, SHEAR, body, box, faces_on, nodes_on

COMPONENTS = ("xx", "yy", "zz", "xy", "xz", "yz")
STRESSES = tuple(f"stress_{c}" for c in COMPONENTS)
MOVED = tuple(f"displacement_{c}" for c in "xyz")
QUIET = {"dynamic": False, "collision": False}
JOINT = {
    "tensile_strength": 2e6, "cohesion": 8e6, "friction": 30.0, "penalty_normal": 500e9, "penalty_overlay": 700e9,
    "penalty_shear": 300e9, "gf1": 50.0, "gf2": 200.0,
}  # fmt: skip


def jointed(sim: Blocks, **properties: float) -> Blocks:
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", {**JOINT, **properties})
    return sim


def farthest(one: Blocks, other: Blocks, names=(*STRESSES, *MOVED)) -> float:
    """Largest difference of two models over the largest value of a kind."""
    differences = []
    for kind in {n.rpartition("_")[0] for n in names}:
        of = [n for n in names if n.startswith(kind)]
        a, b = (np.concatenate([diagnostics.values(sim, n) for n in of]) for sim in (one, other))
        differences.append(float(np.nanmax(np.abs(a - b)) / np.nanmax(np.abs(b))))
    return max(differences)


def slopes_by_difference(sim: Blocks, x: np.ndarray, step: float, flows: bool = True, softening: bool = False):
    """(along the tangent, by central differences), (nn, 3) each, along three random ways."""
    rng = np.random.default_rng(11)
    nodes = equilibrium.all_nodes(sim)
    unknowns = equilibrium.unknowns_of(sim, nodes, 1)
    equilibrium.place_corners(sim, x)
    pieces, _ = equilibrium.tangent(sim, flows=flows, softening=softening)
    found = []
    for _ in range(3):
        way, product = rng.uniform(-1.0, 1.0, nodes.x.shape), np.zeros(nodes.x.shape)
        for one in pieces:
            m, k = one.node.shape
            local = way[one.node].reshape(m, 3 * k, 1)
            np.add.at(product, one.node, (one.stiffness @ local).reshape(m, k, 3))
        ends = [equilibrium.unbalanced(sim, nodes, unknowns, x + h * way)[0] for h in (step, -step)]
        found.append((product, (ends[1] - ends[0]) / (2.0 * step)))
    return found


# ---- the tangent ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", [(2e-6, 1e-6, 0.5e-6), (-3e-6, 2e-6, -4e-6), (5e-6, 0.0, 2e-6), (1e-6, 0.0, 0.0)])
def test_the_matrix_of_a_joint_is_the_derivative_of_its_law(way):
    """One tetrahedron moved from the other, in opening and both shears: forces of the joint along each axis by
    differences. (Normal and area turn with the corners: all of them move alike.)"""
    mesh = Mesh.of([(0, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0.2, 0.3), (1, 0.3, 0.2)], [(0, 2, 1, 3), (0, 1, 2, 4)])
    sim = jointed(body(mesh, dynamic=False))
    sim.close_model()
    nodes = equilibrium.all_nodes(sim)
    unknowns = equilibrium.unknowns_of(sim, nodes, 1)
    right = nodes.lead // 4 == 1
    x = nodes.x + right[:, None] * np.array(way)
    equilibrium.place_corners(sim, x)
    (joint,), past = equilibrium.of_joints(sim)
    assert past == 0
    for axis in range(3):
        move = np.zeros(nodes.x.shape)
        move[right, axis] = 1.0
        product = np.zeros(nodes.x.shape)
        product[joint.node[0]] = (joint.stiffness[0] @ move[joint.node[0]].reshape(-1)).reshape(-1, 3)
        ends = [equilibrium.unbalanced(sim, nodes, unknowns, x + h * move)[0] for h in (1e-10, -1e-10)]
        slope = (ends[1] - ends[0]) / 2e-10
        assert np.abs(product - slope).max() < 1e-4 * np.abs(joint.stiffness).max()


def test_the_matrix_of_a_joint_behind_its_peak():
    """The same where damage grows in both modes, and on the line through the origin after unloading."""
    mesh = Mesh.of([(0, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0.2, 0.3), (1, 0.3, 0.2)], [(0, 2, 1, 3), (0, 1, 2, 4)])
    sim = jointed(body(mesh, dynamic=False))
    sim.close_model()
    nodes = equilibrium.all_nodes(sim)
    unknowns, right = equilibrium.unknowns_of(sim, nodes, 1), nodes.lead // 4 == 1
    for way, before in (((2e-5, 3e-5, -1e-5), None), ((1e-5, 1e-5, 2e-5), (2e-5, 3e-5, -1e-5))):
        if before is not None:
            equilibrium.place_corners(sim, nodes.x + right[:, None] * np.array(before))
            sim.local.open_joints()
        x = nodes.x + right[:, None] * np.array(way)
        equilibrium.place_corners(sim, x)
        pieces, past = equilibrium.tangent(sim, softening=True)
        joint = pieces[-1]
        assert past == (1 if before is None else 0)
        for axis in range(3):
            move = np.zeros(nodes.x.shape)
            move[right, axis] = 1.0
            product = np.zeros(nodes.x.shape)
            product[joint.node[0]] = (joint.stiffness[0] @ move[joint.node[0]].reshape(-1)).reshape(-1, 3)
            ends = [equilibrium.unbalanced(sim, nodes, unknowns, x + h * move)[0] for h in (1e-10, -1e-10)]
            slope = (ends[1] - ends[0]) / 2e-10
            assert np.abs(product - slope).max() < 1e-4 * np.abs(joint.stiffness).max()


# ---- closed forms --------------------------------------------------------------------------------------------------

SOIL = {"density": 2000.0, "bulk": 3.9e9, "shear": 2.8e9, "friction": 30.0, "cohesion": 3.45e6, "dilation": 10.0}
K, G = SOIL["bulk"], SOIL["shear"]
A, B = K + 4.0 / 3.0 * G, K - 2.0 / 3.0 * G


def soil(mesh: Mesh, **properties: float) -> Blocks:
    sim = body(mesh, dynamic=False)
    changes.element_model(sim, None, "mech_mohr_coulomb", {**SOIL, "tensile": 1e6, **properties})
    return sim


STRAIN = np.array([[1.0, 2.0, 0.0], [0.0, -1.0, 3.0], [2.0, 0.0, 1.0]]) * 1e-4


def boundary(mesh: Mesh) -> np.ndarray:
    edges = mesh.edges()
    return np.unique(edges.points[~edges.inner])


@pytest.mark.parametrize("large", [False, True])
def test_patch(large):
    """u = A X on the surface, in one go and in units of time: the stress of the table of fdem_3d.md, to 1e-10."""
    mesh = box((3, 3, 3), (1.0, 0.9, 0.8), 6, shaken=0.2)
    sim = body(mesh, dynamic=False)
    sim.option(large_strain=large)
    outside = boundary(mesh)
    for node, v in zip(outside, (mesh.points[outside] @ STRAIN.T / 5.0).tolist()):
        sim.velocity_condition([node], vx=v[0], vy=v[1], vz=v[2])
    found = equilibrium.solve_elastic(sim, cycles=5)
    assert sim.clock.step == 5 and found.ratio < 1e-10
    want = (6.00125e6, -1.998e6, 6.001e6, 3.9993e6, 3.9997e6, 6.0004e6) if large else (6e6, -2e6, 6e6, 4e6, 4e6, 6e6)
    for name, value in zip(STRESSES, want):
        stress = diagnostics.values(sim, name)
        assert stress == pytest.approx(value, rel=1e-5 if large else 1e-9)
        assert np.ptp(stress) < 1e-10 * ROCK["young"]
    for axis, column in zip("xyz", range(3)):
        assert diagnostics.values(sim, f"displacement_{axis}") == pytest.approx(mesh.points @ STRAIN[column], abs=1e-13)


def test_rollers_on_oblique_planes():
    """A bar, turned, that slides between four planes and is pressed at its end by a plane that moves along it:
    uniaxial strain along the bar."""
    flat = box((4, 2, 2), (1.2, 0.6, 0.5), 6)
    axis = np.array([1.0, 2.0, 3.0]) / math.sqrt(14.0)
    basis = equilibrium._basis(axis)[0][:, [0, 2, 1]]  # a rotation, no reflection
    mesh = Mesh.of(flat.points @ basis.T, flat.cells)
    sim = body(mesh, dynamic=False)
    sim.option(large_strain=False)
    x, y, z = flat.points.T
    on_y, on_z = (y < 1e-9) | (y > 0.6 - 1e-9), (z < 1e-9) | (z > 0.5 - 1e-9)
    end = x > 1.2 - 1e-9
    sim.move_constraint(np.flatnonzero(on_y & ~on_z), space.ACROSS, tuple(basis[:, 1]))
    sim.move_constraint(np.flatnonzero(on_z & ~on_y), space.ACROSS, tuple(basis[:, 2]))
    sim.move_constraint(np.flatnonzero(on_y & on_z), space.ALONG, tuple(axis))
    fixed = np.flatnonzero(x < 1e-9)
    sim.velocity_condition(fixed, vx=0.0, vy=0.0, vz=0.0)
    sim.move_constraint(fixed, space.FIXED)
    moved = np.flatnonzero(end)
    v = 1e-5 * axis  # all components, which fulfil the constraints
    sim.velocity_condition(moved, vx=float(v[0]), vy=float(v[1]), vz=float(v[2]))
    sim.move_constraint(moved, space.ALONG, tuple(axis))
    equilibrium.solve_elastic(sim)
    stress = (LAME + 2.0 * SHEAR) * 1e-5 / 1.2
    xx, yy, zz, xy, xz, yz = (diagnostics.values(sim, name) for name in STRESSES)
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    for k, want in enumerate((stress, stress * LAME / (LAME + 2 * SHEAR), stress * LAME / (LAME + 2 * SHEAR))):
        assert np.einsum("i,ijn,j->n", basis[:, k], tensor, basis[:, k]) == pytest.approx(want, rel=1e-8)


def test_weight_on_rollers():
    """sigma_zz = -rho g depth, sides nu / (1 - nu) of it; the reaction of the floor is the weight."""
    mesh = box((3, 3, 6), (6.0, 6.0, 12.0), 5)
    sim = body(mesh, dynamic=False)
    sim.velocity_condition(nodes_on(mesh, "bottom"), vz=0.0)
    for side, axis in (("left", "vx"), ("right", "vx"), ("front", "vy"), ("back", "vy")):
        sim.velocity_condition(nodes_on(mesh, side), **{axis: 0.0})
    sim.gravity(0.0, 0.0, -9.81)
    equilibrium.solve_elastic(sim)
    weight = ROCK["density"] * 9.81
    depth = 12.0 - mesh.centroids()[:, 2]
    assert diagnostics.values(sim, "stress_zz") == pytest.approx(-weight * depth, abs=0.1 * weight * 12.0)
    assert diagnostics.total(sim, "reaction_z", nodes_on(mesh, "bottom")) == pytest.approx(
        weight * 6.0 * 6.0 * 12.0, rel=1e-9
    )


def test_joints_open_by_their_parabola():
    """A column pulled at its end by t < T: o = o_p (1 - sqrt(1 - t / T)) at faces across it, with o_p = 2 h T / P and h
    the root of the face's area."""
    n, pull = 3, 1.6e6
    mesh = box((1, 1, n), (0.1, 0.1, 0.1 * n), 6)
    sim = body(mesh, dynamic=False, poisson_ratio=0.0)
    across = np.flatnonzero(
        np.ptp(mesh.points[mesh.face_points(np.arange(4 * len(mesh.cells)))][:, :, 2], axis=1) < 1e-9
    )
    across = np.intersect1d(across, sim.numbers_of_joints(None))
    sim.joint_model(across, "classic_intrinsic_cohesive_interface", JOINT)
    sim.option(large_strain=False)
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    sim.velocity_condition(nodes_on(mesh, "bottom"), vz=0.0)
    sim.stress_condition(faces_on(mesh, "top"), zz=pull)
    equilibrium.solve_elastic(sim)
    assert diagnostics.values(sim, "stress_zz") == pytest.approx(pull, rel=1e-9)
    t, p, h = JOINT["tensile_strength"], JOINT["penalty_normal"], math.sqrt(0.5 * 0.1**2)
    opening = 2.0 * h * t / p * (1.0 - math.sqrt(1.0 - pull / t))
    found = diagnostics.values(sim, "opening")
    assert found[np.isfinite(found)] == pytest.approx(opening, rel=1e-6)


@pytest.mark.parametrize("steps", [1, 3])
def test_uniaxial_strain_of_rock_that_yields(steps):
    """On an edge of the surface: the closed form of tests/blocks/test_yielding.py, where both sides are alike."""
    sim, e = soil(box((2, 2, 2), (1.0, 1.0, 1.0), 5)), 0.01
    mesh = sim.mesh
    sim.option(large_strain=False)
    for side, axis in (("left", "vx"), ("right", "vx"), ("front", "vy"), ("back", "vy"), ("bottom", "vz")):
        sim.velocity_condition(nodes_on(mesh, side), **{axis: 0.0})
    sim.velocity_condition(nodes_on(mesh, "top"), vz=-e / 4.0)
    found = equilibrium.solve_elastic(sim, cycles=4, steps=steps)
    n, m = (math.tan(math.pi / 4.0 + 0.5 * math.radians(SOIL[a])) ** 2 for a in ("friction", "dilation"))
    k = 2.0 * SOIL["cohesion"] * math.sqrt(n)
    lag = (A * e - n * B * e - k) / (A - B * m - n * (B - 0.5 * (A + B) * m))
    sz, sx = -A * e + lag * (A - B * m), -B * e + lag * (B - 0.5 * (A + B) * m)
    assert found.increments == steps and found.ratio < 1e-8
    for name, want in zip(STRESSES, (sx, sx, sz, 0.0, 0.0, 0.0)):
        assert diagnostics.values(sim, name) == pytest.approx(want, rel=1e-7, abs=1e-7 * abs(sz))
    assert diagnostics.values(sim, "plastic_volume_strain") == pytest.approx(lag * (m - 1.0), rel=1e-6)


# ---- the same as relaxation, and what follows ----------------------------------------------------------------------


def leaning(with_joints: bool = False) -> Blocks:
    mesh = box((2, 2, 3), (0.6, 0.5, 0.9), 5, shaken=0.2)
    sim = body(mesh, dynamic=False)
    if with_joints:
        jointed(sim)
    sim.velocity_condition(nodes_on(mesh, "bottom"), vx=0.0, vy=0.0, vz=0.0)
    sim.stress_condition(faces_on(mesh, "top"), zz=-8e5, xz=3e5, yz=1e5)
    sim.initial_stress(None, xx=-3e5, gradient={"zz": (0.0, 1e5, 2e5)})
    sim.gravity(0.0, 0.0, -9.81)
    return sim


@pytest.mark.parametrize("with_joints, large", [(False, True), (True, False)])
def test_the_same_as_relaxation(with_joints, large):
    sim, slow = leaning(with_joints), leaning(with_joints)
    for one in (sim, slow):
        one.option(large_strain=large)
    found = equilibrium.solve_elastic(sim)
    assert found.ratio < 1e-9 and found.factors <= 3 and found.solver.startswith("direct")
    assert diagnostics.unbalanced_ratio(sim) == pytest.approx(found.ratio, rel=1e-6, abs=1e-12)
    assert convergence.solve(slow, ratio=1e-9, cycles=60000).reason == "ratio"
    assert farthest(sim, slow) < 1e-6


def test_at_rest_it_stays_at_rest_in_motion():
    """Static, then dynamic: nothing moves; where a part is dug out it does, and a second solve finds the new rest."""
    sim, dug = leaning(), leaning()
    equilibrium.solve_elastic(sim)
    sim.option(dynamic=True)
    convergence.advance(sim, 50)
    assert max(np.abs(diagnostics.values(sim, f"velocity_{a}")).max() for a in "xyz") < 1e-9
    sim.option(dynamic=False)
    out = np.flatnonzero(sim.mesh.centroids()[:, 2] > 0.65)
    for one in (sim, dug):
        changes.null(one, out)
        equilibrium.solve_elastic(one)
    assert farthest(sim, dug) < 1e-7


def test_creep_at_once():
    """Burgers under a constant stress: the creep strain of the closed form, each creep step a static solve."""
    mesh = box((1, 1, 1), (1.0, 1.0, 1.0), 6)
    sim = body(mesh, dynamic=False)
    changes.element_model(sim, None, "mech_burgers", {**ROCK, "maxwell_viscosity": 1e15})
    sim.option(large_strain=False)
    for side, axis in (("left", "vx"), ("front", "vy"), ("bottom", "vz")):
        sim.velocity_condition(nodes_on(mesh, side), **{axis: 0.0})
    sim.stress_condition(faces_on(mesh, "top"), zz=-3e6)
    equilibrium.solve_elastic(sim)
    start = diagnostics.values(sim, "displacement_z", nodes_on(mesh, "top")).mean()
    creep.switch(sim, True, dt=100.0)
    for _ in range(3):
        creep.begin(sim, 300.0)
        found = equilibrium.solve_elastic(sim)
        assert found.iterations <= 3
        creep.finish(sim, 300.0)
    moved = diagnostics.values(sim, "displacement_z", nodes_on(mesh, "top")).mean() - start
    # deviator -2 MPa along z; e = s t / (2 eta); the pressure acts on the present area, wider by 3e-5
    assert moved == pytest.approx(-2e6 * 300.0 / (2.0 * 1e15), rel=2e-4)


def test_joints_may_pass_their_peak():
    """A bar with one plane of joints is pulled apart: sigma L / E + o = u, sigma = T f((o - o_p) / o_t) behind the
    peak; in the end it is in two."""
    sim, t = pulled(), JOINT["tensile_strength"]
    o_p = 2.0 * math.sqrt(0.5 * 0.1**2) * t / JOINT["penalty_normal"]
    o_t = JOINT["gf1"] / (joint_law.SOFTENING_AREA * t)
    for moves in (1, 2, 3):
        equilibrium.solve_elastic(sim, softening=True)
        low, high = o_p, o_p + o_t
        for _ in range(60):
            o = 0.5 * (low + high)
            below = t * joint_law.softening((o - o_p) / o_t) * 0.2 / ROCK["young"] + o < 2e-5 * moves
            low, high = (o, high) if below else (low, o)
        stress = t * joint_law.softening((o - o_p) / o_t)
        assert diagnostics.values(sim, "stress_xx") == pytest.approx(stress, rel=1e-6)
    equilibrium.solve_elastic(sim, softening=True)
    assert diagnostics.joint_counts(sim) == (0, 0, 2)
    assert np.abs(diagnostics.values(sim, "stress_xx")).max() < 1.0


def pulled() -> Blocks:
    mesh = box((2, 1, 1), (0.2, 0.1, 0.1), 6)
    sim = body(mesh, dynamic=False, poisson_ratio=0.0)
    x = mesh.points[mesh.face_points(np.arange(4 * len(mesh.cells)))][:, :, 0]
    plane = np.flatnonzero((np.abs(x - 0.1) < 1e-9).all(axis=1))
    sim.joint_model(np.intersect1d(plane, sim.numbers_of_joints(None)), "classic_intrinsic_cohesive_interface", JOINT)
    sim.option(large_strain=False)
    sim.velocity_condition(nodes_on(mesh, "left"), vx=0.0, vy=0.0, vz=0.0)
    sim.velocity_condition(nodes_on(mesh, "right"), vx=2e-5, vy=0.0, vz=0.0)
    return sim


# ---- refused -------------------------------------------------------------------------------------------------------


def test_a_body_that_can_turn_is_refused():
    mesh = box((1, 1, 2), (0.5, 0.5, 1.0))
    sim = body(mesh, dynamic=False)
    with pytest.raises(CommandError, match="can move in x in y in z"):
        equilibrium.solve_elastic(sim)
    sim.velocity_condition(nodes_on(mesh, "bottom")[:1], vx=0.0, vy=0.0, vz=0.0)
    with pytest.raises(CommandError, match="about some axis"):
        equilibrium.solve_elastic(sim)
    sim.velocity_condition(nodes_on(mesh, "bottom")[:2], vx=0.0, vy=0.0, vz=0.0)
    with pytest.raises(CommandError, match="about some axis"):
        equilibrium.solve_elastic(sim)
    sim.velocity_condition(nodes_on(mesh, "bottom")[2:3], vz=0.0)
    equilibrium.solve_elastic(sim)


def test_a_joint_beyond_its_peak_is_refused_and_the_model_stays():
    sim = pulled()
    before = sim.x.copy()
    with pytest.raises(CommandError, match="would pass their peak"):
        equilibrium.solve_elastic(sim)
    assert np.array_equal(sim.x[np.argsort(sim.number)], before) and not sim.v.any()


def test_a_plane_and_a_velocity_leave_the_line_that_they_have_in_common():
    sim = leaning()
    at = nodes_on(sim.mesh, "top")[:1]
    sim.move_constraint(at, space.ACROSS, (1.0, 1.0, 0.0))
    sim.velocity_condition(at, vx=0.0)
    equilibrium.solve_elastic(sim)
    x, y, z = (diagnostics.values(sim, f"displacement_{axis}", at) for axis in "xyz")
    assert abs(x[0]) < 1e-18 and abs(y[0]) < 1e-18 and abs(z[0]) > 1e-9


@pytest.mark.skipif(not linear.petsc_there(), reason="petsc4py is missing")
@pytest.mark.parametrize("with_joints", [False, True])
def test_petsc_finds_the_same(with_joints):
    one, other = leaning(with_joints), leaning(with_joints)
    equilibrium.solve_elastic(one)
    found = equilibrium.solve_elastic(other, solver="petsc")
    assert found.solver.startswith("PETSc (CG" if not with_joints else "PETSc")
    assert farthest(other, one) < 1e-9


@pytest.mark.skipif(not linear.petsc_there(), reason="petsc4py is missing")
@pytest.mark.parametrize(("limit", "levels"), [(None, 2), (50, 3)])
def test_multigrid_has_few_levels_unless_an_option_of_petsc_asks_for_more(monkeypatch, limit, levels):
    from petsc4py import PETSc

    name, found, solve = "pc_gamg_coarse_eq_limit", [], linear.Petsc.solve

    def noted(self, *args):
        found.append(self._ksp.getPC().getMGLevels())
        return solve(self, *args)

    monkeypatch.setattr(linear.Petsc, "solve", noted)
    sim = body(box((10, 10, 10), (1.0, 1.0, 1.0)), dynamic=False)
    sim.velocity_condition(nodes_on(sim.mesh, "bottom"), vx=0.0, vy=0.0, vz=0.0)
    sim.gravity(0.0, 0.0, -9.81)
    if limit is not None:
        PETSc.Options().setValue(name, limit)
    try:
        equilibrium.solve_elastic(sim, solver="petsc")
        assert PETSc.Options().hasName(name) == (limit is not None)
    finally:
        PETSc.Options().delValue(name)
    assert set(found) == {levels}

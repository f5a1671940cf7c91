"""Joints between hexahedra: the law, both sides against each other, columns and lattices in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.fdem import convergence, diagnostics, equilibrium
from hpcdem.physics.fdem.kernels import hexes as of_hexes
from hpcdem.physics.fdem.kernels import joint_law, joints, joints_hexes
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.space.support import ROCK, body, box, faces_on, hexes, nodes_on
from tests.space.test_equilibrium import farthest, slopes_by_difference
from tests.space.test_joints import AREA, INTERFACE, PEAK_OPENING, PEAK_SLIP, SOFTENING, TURN, VALUES

SIDE = math.sqrt(AREA)
QUAD = SIDE * np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


class Pair:
    """Two hexahedra with a joint between them, of the area AREA, turned into space; the second is moved as a whole, or
    its four corners at the joint one by one."""

    def __init__(self, quad: np.ndarray = QUAD, warp: float = 0.0, **values: float) -> None:
        middle = np.column_stack([quad, warp * np.array([1.0, -1.0, 1.0, -1.0])])
        points = np.concatenate([middle - [0, 0, SIDE], middle, middle + [0, 0, SIDE]]) @ TURN.T
        self.sim = body(Mesh.of_hexes(points, [range(8), range(4, 12)]))
        self.sim.joint_model(None, INTERFACE, {**VALUES, **values})
        self.sim.close_model()
        self.local, self.home = self.sim.local, self.sim.x.copy()

    def put(self, *ways: np.ndarray) -> np.ndarray:
        """Forces (2, 4, 3) [N] of the joint on the corners of the first hexahedron and on those opposite, in the frame
        of the joint (two along it, the last across), when all corners of the second are moved by ways (3,), or those at
        the joint by (3,) each [m]. Histories move on."""
        sim, own = self.sim, self.local.hexes
        x = sim.x.reshape(-1, 4)
        x[:] = self.home.reshape(-1, 4)
        points = sim.mesh.cells[sim.number]
        lower, upper = np.argsort(own.number)
        second = np.isin(np.arange(len(x)) // 4, own.rows[upper])
        for i, way in enumerate(ways):
            at = second if len(ways) == 1 else second & (points.reshape(-1) == 4 + i)
            x[at, :3] += TURN @ way
        force, of_joints = np.zeros_like(sim.x), np.zeros_like(sim.x)
        self.local._fill(force, of_joints, True)
        at = np.array([own.place[lower, 4:], own.place[upper, :4]]) // 4
        return of_joints.reshape(-1, 4)[at, :3] @ TURN

    def states(self) -> list[int]:
        return self.local.slot_state[self.local.lower_slots].tolist()


@pytest.mark.parametrize(
    ("way", "peak", "strength", "energy"),
    [
        ((0.0, 0.0, 1.0), PEAK_OPENING, 2e6, 50.1257), ((1.0, 0.0, 0.0), PEAK_SLIP, 8e6, 202.0113),
        ((0.0, 1.0, 0.0), PEAK_SLIP, 8e6, 202.0113), ((-0.6, 0.8, 0.0), PEAK_SLIP, 8e6, 202.0113),
    ],
    ids=["I", "II", "III", "II and III"],
)  # fmt: skip
def test_strength_and_fracture_energy(way, peak, strength, energy):
    """The same numbers as of a triangle of this area: both halves have the length of the side."""
    way = np.array(way)
    pair = Pair()
    half = pair.put(way * peak * 0.5)
    assert np.allclose(half[0], 0.75 * strength * way * AREA / 4.0, rtol=0.0, atol=1e-5 * strength * AREA)
    assert pair.states() == [joints.INTACT] * 2 and (half[0] == -half[1]).all()
    at_peak = pair.put(way * peak)[0].sum(axis=0)
    assert np.allclose(at_peak / AREA, strength * way, rtol=0.0, atol=1e-5 * strength)
    pair = Pair()
    path = np.concatenate([np.linspace(0.0, peak, 200), peak + np.linspace(0.0, 1.001, 800)[1:] * SOFTENING])
    forces = np.array([pair.put(step * way)[0].sum(axis=0) @ way for step in path])
    assert 0.5 * ((forces[1:] + forces[:-1]) * np.diff(path)).sum() / AREA == pytest.approx(energy, rel=1e-3)
    assert pair.states() == [joints.BROKEN] * 2
    assert np.abs(pair.put(way * (peak + 1.01 * SOFTENING))).max() < 1e-12 * strength * AREA


@pytest.mark.parametrize("warp", [0.0, 0.1])
@pytest.mark.parametrize("size", [3e-8, 3e-7, 2e-5])
def test_both_sides_are_opposite_bit_for_bit(size, warp):
    """Corners of the other side moved each by itself, before the peak and behind it, also of a warped side."""
    rng = np.random.default_rng(5)
    quad = QUAD + SIDE * rng.uniform(-0.2, 0.2, (4, 2))
    states = set()
    for _ in range(8):
        pair = Pair(quad, warp * SIDE)
        mine, theirs = pair.put(*rng.uniform(-size, size, (4, 3)))
        states |= set(pair.states())
        assert (mine == -theirs).all() and mine.any()
    assert states <= {3e-8: {1}, 3e-7: {1, 2}, 2e-5: {2}}[size]


def test_a_uniform_traction_on_any_flat_quad():
    """Corner i has (A_i + A) / 6 of it, A_i: the triangle there; the same as the stress of hexahedra gives."""
    quad = SIDE * np.array([[-0.6, -0.5], [0.4, -0.3], [0.9, 0.7], [-0.5, 0.3]])
    at = [[np.roll(np.arange(4), 1 - i)[:3]] for i in range(4)]
    u, w = (np.array([quad[k[0][m]] - quad[k[0][0]] for k in at]) for m in (1, 2))
    part = 0.5 * (u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0])
    share = (part + part[0] + part[2]) / 6.0
    h = math.sqrt(part[0] + part[2])
    pressed = Pair(quad).put(np.array([0.0, 0.0, -1e-8]))[0]
    assert np.allclose(pressed[:, 2], -3e11 * 1e-8 / h * share, rtol=1e-8)


def test_a_joint_bends_and_twists_as_its_area_does():
    """Turned by t about an axis in it a pressed joint has the moment P t a^4 / (12 h), a: its side. Any linear opening
    is exact."""
    pair, t = Pair(), 1e-6
    for axis in range(2):
        force = pair.put(*([0.0, 0.0, -1e-8 + t * q[axis]] for q in QUAD))[0]
        assert force[:, 2].sum() == pytest.approx(-3e11 * 1e-8 / SIDE * AREA, rel=1e-6)
        assert force[:, 2] @ QUAD[:, axis] == pytest.approx(3e11 * t * AREA**2 / (12.0 * SIDE), rel=1e-5)


STRONG = {**VALUES, "tensile_strength": 1e9, "cohesion": 1e9, "gf1": 1e6, "gf2": 1e6}


def lattice(cells: tuple[int, int, int], side: float, penalty: float, skew: float = 0.0) -> Blocks:
    """Cubes with a joint on every side, on rollers; skew: sheared and stretched to parallelepipeds."""
    made = hexes(cells, tuple(side * n for n in cells))
    points = made.points @ (np.eye(3) + skew * np.array([[0.0, 0.3, 0.2], [0.0, 0.4, 0.1], [0.0, 0.0, -0.2]])).T
    mesh = Mesh.of(points, made.cells, made.groups, made.layers, macros=made.hexes)
    sim = body(mesh, dynamic=False)
    sim.joint_model(None, INTERFACE, {**STRONG, "penalty_normal": penalty})
    sim.option(large_strain=False)
    return sim


@pytest.mark.parametrize("factor", [1.0, 10.0, 100.0])
def test_modulus_of_cubes_with_a_joint_on_every_side(factor):
    """Pressed: a cube shortens by s a / E, a joint by s h / P = s a / P: 1 / E_eff = 1 / E + 1 / P, here with as many
    joints as cubes but one. The stress is uniform to 1e-10."""
    cells, side, stress, e = (2, 3, 4), 0.1, -1e6, ROCK["young"]
    sim = lattice(cells, side, factor * e)
    for name, axis in (("left", "vx"), ("front", "vy"), ("bottom", "vz")):
        sim.velocity_condition(nodes_on(sim.mesh, name), **{axis: 0.0})
    sim.stress_condition(faces_on(sim.mesh, "top"), normal=stress)
    equilibrium.solve_elastic(sim)
    for name, value in (("zz", stress), ("xx", 0.0), ("yy", 0.0), ("xy", 0.0), ("xz", 0.0), ("yz", 0.0)):
        found = diagnostics.values(sim, f"stress_{name}")
        assert np.ptp(found) < 1e-10 * e and found == pytest.approx(value, abs=2e-5 * abs(stress))
    top = diagnostics.values(sim, "displacement_z", nodes_on(sim.mesh, "top"))
    assert top == pytest.approx(stress * side * (4 / e + 3 / (factor * e)), rel=2e-5)
    aside = diagnostics.values(sim, "displacement_x", nodes_on(sim.mesh, "right"))
    assert aside == pytest.approx(-ROCK["poisson_ratio"] * stress / e * 2 * side, rel=2e-5)
    found = diagnostics.values(sim, "normal_stress")
    found = found[np.isfinite(found)]
    assert len(found) == 2 * (1 * 3 * 4 + 2 * 2 * 4 + 2 * 3 * 3)
    assert np.minimum(np.abs(found), np.abs(found - stress)).max() < 1e-6 * abs(stress)


def test_patch_of_parallelepipeds():
    """A lattice of them that is pressed and sheared on all sides has one stress: the pieces move apart as the tractions
    want."""
    sim = lattice((3, 2, 2), 0.1, 10.0 * ROCK["young"], skew=1.0)
    mesh = sim.mesh
    sim.velocity_condition([0], vx=0.0, vy=0.0, vz=0.0)
    sim.velocity_condition([int(np.argmax(mesh.points[:, 0] - mesh.points[:, 1] - mesh.points[:, 2]))], vy=0.0, vz=0.0)
    stress = {"xx": -3e3, "yy": -5e3, "zz": -4e3, "xy": 7e2, "xz": -5e2, "yz": 3e2}
    sim.velocity_condition([int(np.argmax(mesh.points[:, 1] - mesh.points[:, 0]))], vz=0.0)
    for side in mesh.layers:
        sim.stress_condition(faces_on(mesh, side), **stress)
    equilibrium.solve_elastic(sim)
    for name, value in stress.items():
        assert np.abs(diagnostics.values(sim, f"stress_{name}") - value).max() < 1e-6 * 5e3


def test_the_matrix_is_the_derivative_of_the_forces():
    """Of a lattice shaken by openings below and behind the peaks."""
    rng = np.random.default_rng(3)
    for size, softening in ((2e-9, False), (4e-6, True)):
        sim = body(hexes((2, 2, 1), (0.02, 0.02, 0.01), 0.1), dynamic=False)
        sim.joint_model(None, INTERFACE, VALUES)
        sim.option(large_strain=False)
        sim.close_model()
        x = equilibrium.all_nodes(sim).x
        equilibrium.place_corners(sim, x + rng.uniform(-2.0 * size, 2.0 * size, x.shape))
        if softening:
            sim.local.open_joints()
        x = x + rng.uniform(-size, size, x.shape)
        for product, slope in slopes_by_difference(sim, x, 1e-4 * size, softening=softening):
            assert np.abs(product - slope).max() < 1e-2 * np.abs(slope).max()


@pytest.mark.parametrize("factor", [1.0, 100.0])
def test_the_time_step_is_below_the_stability_limit(factor):
    """The largest eigenvalue of M^-1 K with joints gives 2 / omega; the bound is below it, not by much."""
    sim = lattice((2, 2, 2), 0.1, factor * ROCK["young"])
    sim.option(dynamic=True)
    sim.element_property(None, {"damp_factor": 0.0})
    sim.close_model()
    nodes = equilibrium.all_nodes(sim)
    pieces, _ = equilibrium.tangent(sim)
    n = len(nodes.x)
    k = np.zeros((3 * n, 3 * n))
    for one in pieces:
        for node, part in zip(one.node, one.stiffness):
            at = (3 * node[:, None] + np.arange(3)).reshape(-1)
            np.add.at(k, np.ix_(at, at), part)
    mass = np.zeros(n)
    np.add.at(mass, sim.node[sim.number].reshape(-1), sim.local.true_mass.reshape(-1))
    per = np.repeat(1.0 / np.sqrt(mass), 3)
    limit = 2.0 / math.sqrt(np.linalg.eigvalsh(per[:, None] * k * per)[-1])
    bound = diagnostics.critical_time_step(sim) / sim.options.safety
    assert 0.3 * limit < bound <= limit


def leaning() -> Blocks:
    """A jointed column that leans, of warped hexahedra over tetrahedra that hang on them by joints."""
    made, split = hexes((2, 2, 4), (0.4, 0.4, 0.8), 0.1), box((2, 2, 4), (0.4, 0.4, 0.8))
    own = made.hexes[made.points[made.hexes[:, :8]].mean(axis=1)[:, 2] > 0.2, :8]
    more = split.cells[split.centroids()[:, 2] < 0.2]
    mesh = Mesh.of_hexes(made.points, own, made.layers, more)
    sim = body(mesh, dynamic=False)
    sim.joint_model(None, INTERFACE, {**STRONG, "penalty_normal": 5.0 * ROCK["young"]})
    sim.velocity_condition(nodes_on(mesh, "bottom"), vx=0.0, vy=0.0, vz=0.0)
    sim.stress_condition(faces_on(mesh, "top"), zz=-8e5, xz=3e5, yz=1e5)
    sim.initial_stress(None, xx=-3e5, gradient={"zz": (0.0, 1e5, 2e5)})
    sim.gravity(0.0, 0.0, -9.81)
    return sim


def test_the_same_as_relaxation_then_at_rest_in_motion():
    """With the corners where hexahedra and tetrahedra meet; of joints opening, slip and stresses too."""
    sim, slow = leaning(), leaning()
    assert equilibrium.solve_elastic(sim).ratio < 1e-9
    assert convergence.solve(slow, ratio=1e-9, cycles=60000).reason == "ratio"
    assert farthest(sim, slow) < 1e-6
    assert farthest(sim, slow, ("opening", "slip", "normal_stress", "shear_stress")) < 1e-5
    sim.option(dynamic=True)
    convergence.advance(sim, 50)
    assert max(np.abs(diagnostics.values(sim, f"velocity_{a}")).max() for a in "xyz") < 1e-9


def test_a_pulled_bar_breaks_in_the_middle_with_mode_1():
    """Its strength is that of the joints; both halves of each side are events, with place, area and mode."""
    mesh = hexes((2, 2, 4), (0.2, 0.2, 0.4))
    sim = body(mesh)
    joints_there = sim.numbers_of_joints(None)
    middle = joints_there[(np.abs(mesh.points[mesh.face_points(joints_there)][:, :, 2] - 0.2) < 1e-9).all(axis=1)]
    sim.joint_model(middle, INTERFACE, {**VALUES, "gf1": 5.0})
    top, bottom = nodes_on(mesh, "top"), nodes_on(mesh, "bottom")
    sim.velocity_condition(bottom, vx=0.0, vy=0.0, vz=0.0)
    sim.velocity_condition(top, vz=0.02)
    most = 0.0
    for _ in range(60):
        convergence.advance(sim, 25)
        most = max(most, diagnostics.total(sim, "reaction_z", top))
        if diagnostics.joint_counts(sim)[2] == 8:
            break
    assert most == pytest.approx(2e6 * 0.04, rel=0.05)
    found = diagnostics.events(sim)
    assert len(found["joint"]) == 8 and (found["mode"] < 1.01).all() and np.allclose(found["z"], 0.2)
    assert found["joint_area"].sum() == pytest.approx(0.04) and (found["peak_step"] < found["step"]).all()


@pytest.mark.parametrize("size", [3e-8, 3e-7, 2e-5])
def test_forces_are_those_of_the_plain_reference(size):
    """Two times three points of a side, with bilinear shape functions of its four corners on the plane of each half."""
    rng = np.random.default_rng(8)
    halves, corner = (((0, 1, 2), (0, 2, 3))), np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    for _ in range(8):
        pair, ways = Pair(), rng.uniform(-size, size, (4, 3))
        mine, _ = pair.put(*ways)
        table, beyond = pair.local.joint_table[1], pair.local.joint_beyond[1]
        expected, middle = np.zeros((4, 3)), np.column_stack([QUAD, np.zeros(4)]) + 0.5 * ways
        for half in halves:
            twice = np.cross(middle[half[1]] - middle[half[0]], middle[half[2]] - middle[half[0]])
            normal, area = twice / np.linalg.norm(twice), 0.5 * np.linalg.norm(twice)
            for point in half:
                at = corner[list(half)].sum(axis=0) / 6.0 + corner[point] / 2.0
                shape = np.prod(np.where(corner == 1.0, at, 1.0 - at), axis=1)
                jump = shape @ ways
                slip = jump - (jump @ normal) * normal
                size_of_slip = float(np.linalg.norm(slip))
                sigma, tau = joint_law.point(
                    float(jump @ normal), size_of_slip, SIDE, table, beyond, np.zeros(joint_law.HISTORY), 0
                )[:2]
                expected += area / 3.0 * np.outer(shape, sigma * normal + tau * slip / size_of_slip)
        assert np.allclose(mine, expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())


def test_what_a_warped_side_moves_its_corners_by_and_kinetic_energy():
    """Half the weighted sum of what opens at four corners; m v^2 / 2 of eight."""
    near, far, weights = (1.0, 2.0, 3.0, 4.0), (2.0, 4.0, 7.0, 12.0), (0.1, 0.2, 0.3, 0.5)
    a, b, c, d = near
    p, r, q, s = far
    half = 0.5 * sum(w * (y - x) for w, x, y in zip(weights, near, far))
    assert joints_hexes._half_w(a, b, c, d, p, r, q, s, *weights) == pytest.approx(half, rel=1e-14)
    rng = np.random.default_rng(2)
    v, mass, h = rng.normal(size=(12, 4)), rng.uniform(1.0, 2.0, 8), np.zeros((2, of_hexes.H_MASS + 8))
    place = rng.permutation(12)[:8]
    h[1, of_hexes.H_MASS :] = mass
    found = joints_hexes._kinetic(1, np.array([np.zeros(8, int), 4 * place]), h, v.reshape(-1))
    assert found == pytest.approx(0.5 * (mass * (v[place, :3] ** 2).sum(axis=1)).sum(), rel=1e-13)

"""Joints between tetrahedra: the law against its closed forms, both sides against each other and the reference."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hpcdem.physics.fdem import changes, diagnostics
from hpcdem.physics.fdem.kernels import joint_law, joints
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.reference import face_joint_forces
from hpcdem.physics.fdem.simulation import Blocks
from tests.space.support import ROCK, body, box, faces_on, nodes_on

INTERFACE = "classic_intrinsic_cohesive_interface"
VALUES = {
    "friction": 30.0, "cohesion": 8e6, "tensile_strength": 2e6, "gf1": 50.0, "gf2": 200.0, "penalty_normal": 3e11,
}  # fmt: skip
AREA = 5e-5
H = math.sqrt(AREA)
PEAK_OPENING, PEAK_SLIP, SOFTENING = 9.42809e-8, 3.77124e-7, 6.47153e-5
"""o_p, s_p and o_t = s_t [m] of these values and this area, as computed elsewhere."""
TURN = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()


class Pair:
    """Two tetrahedra with a joint between them, an equilateral triangle of the area AREA turned into space. The second
    is moved as a whole, or its corners one by one, and the elements stay without strain or are not looked at."""

    def __init__(self, **values: float) -> None:
        side = math.sqrt(4.0 * AREA / math.sqrt(3.0))
        flat = side * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.5 * math.sqrt(3.0), 0.0]])
        points = np.vstack([flat, [0.5 * side, 0.3 * side, -side], [0.5 * side, 0.3 * side, side]]) @ TURN.T
        self.sim = body(Mesh.of(points, np.array([[0, 2, 1, 3], [0, 1, 2, 4]])))
        self.sim.joint_model(None, INTERFACE, {**VALUES, **values})
        self.sim.close_model()
        self.local, self.home = self.sim.local, self.sim.x.copy()
        (self.lower,) = self.local.lower_faces
        self.sides = [self.lower, int(self.sim.partner[self.lower])]

    def put(self, *ways: np.ndarray) -> np.ndarray:
        """Forces (2, 3, 3) [N] of the joint on the corners of both its faces, those of the first in the order of the
        face, those of the second opposite to them, when the second element is moved by ways (3,) or its corners by (3,)
        each, in the frame of the joint (two along it, the last across) [m]. Histories move on."""
        x = self.sim.x
        x[:] = self.home
        e, k = divmod(self.sides[1], 4)
        row, corners = self.sim.where[e], self.sim.mesh.face_corners(np.array([self.sides[1]]))[0] % 4
        for i, way in enumerate(ways):
            at = range(4) if len(ways) == 1 else [corners[i]]
            for corner in at:
                x[row, 4 * corner : 4 * corner + 3] += TURN @ way * self.out
        force, of_joints = np.zeros_like(x), np.zeros_like(x)
        self.local._fill(force, of_joints, True)
        found = []
        for face, order in zip(self.sides, ([0, 1, 2], [0, 2, 1])):
            corner = self.sim.mesh.face_corners(np.array([face]))[0][order]
            found.append(of_joints.reshape(-1, 4, 4)[self.sim.where[face // 4], corner % 4, :3])
        return np.array(found)

    @property
    def out(self) -> float:
        """1 if the lower face looks along the third axis of the frame."""
        corners = self.sim.mesh.points[self.sim.mesh.face_points(np.array([self.lower]))[0]]
        return float(np.sign(np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ TURN[:, 2]))

    def state(self) -> int:
        return int(self.local.slot_state[self.local.slot_of(np.array([self.lower]))[0]])


def work(pair: Pair, path: np.ndarray) -> float:
    """Work per area [J/m2] on a way (n, 3), by the trapezoidal rule."""
    forces = np.array([(pair.put(way)[0].sum(axis=0) @ TURN) * pair.out for way in path])
    return float(0.5 * ((forces[1:] + forces[:-1]) * np.diff(path, axis=0)).sum()) / AREA


@pytest.mark.parametrize(
    ("way", "peak", "strength", "energy"),
    [
        ((0.0, 0.0, 1.0), PEAK_OPENING, 2e6, 50.1257), ((1.0, 0.0, 0.0), PEAK_SLIP, 8e6, 202.0113),
        ((0.0, 1.0, 0.0), PEAK_SLIP, 8e6, 202.0113), ((-0.6, 0.8, 0.0), PEAK_SLIP, 8e6, 202.0113),
    ],
    ids=["I", "II", "III", "II and III"],
)  # fmt: skip
def test_strength_and_fracture_energy(way, peak, strength, energy):
    """Numbers computed elsewhere for T 2 MPa, c 8 MPa, P 300 GPa, G 50 and 200 J/m2, A 5e-5 m2."""
    way = np.array(way)
    pair = Pair()
    half = pair.put(way * peak * 0.5)[0].sum(axis=0) @ TURN * pair.out / AREA
    assert np.allclose(half, 0.75 * strength * way, rtol=0.0, atol=1e-5 * strength) and pair.state() == joints.INTACT
    at_peak = pair.put(way * peak)[0].sum(axis=0) @ TURN * pair.out / AREA
    assert np.allclose(at_peak, strength * way, rtol=0.0, atol=1e-5 * strength)
    pair = Pair()
    steps = np.concatenate([np.linspace(0.0, peak, 200), peak + np.linspace(0.0, 1.001, 800)[1:] * SOFTENING])
    assert work(pair, steps[:, None] * way) == pytest.approx(energy, rel=1e-3)
    assert pair.state() == joints.BROKEN
    assert np.abs(pair.put(way * (peak + 1.01 * SOFTENING))).max() < 1e-12 * strength * AREA


@pytest.mark.parametrize(
    ("name", "changed", "way"),
    [
        ("tensile_strength", 1e6, (0, 0, 3e-6)), ("cohesion", 4e6, (3e-6, 0, 0)), ("gf1", 25.0, (0, 0, 3e-5)),
        ("gf2", 100.0, (3e-5, 0, 0)), ("friction", 10.0, (2e-6, 0, -1e-7)), ("penalty_normal", 1e11, (0, 0, 5e-8)),
        ("penalty_overlay", 1e11, (0, 0, -5e-8)), ("penalty_shear", 1e11, (5e-8, 0, 0)),
    ],
)  # fmt: skip
def test_each_property_acts(name, changed, way):
    """Alone, where it should; ways on which another property rules stay as they were."""
    other = (5e-8, 0, 0) if name in ("tensile_strength", "gf1", "penalty_overlay") else (0, 0, 5e-8)
    if name == "penalty_normal":
        other = (5e-8, 0, -5e-8)
        values = {"penalty_overlay": 3e11, "penalty_shear": 3e11}
    else:
        values = {}
    before, after = Pair(**values), Pair(**{**values, name: changed})
    assert not np.allclose(before.put(np.array(way)), after.put(np.array(way)), rtol=1e-2)
    before, after = Pair(**values), Pair(**{**values, name: changed})
    force = before.put(np.array(other))
    assert np.allclose(force, after.put(np.array(other)), rtol=0.0, atol=1e-9 * np.abs(force).max())


def test_unloading_goes_to_the_origin_also_when_the_slip_turns():
    """Behind the peak: half the slip, half the stress, along the slip of the moment; forward again the same."""
    pair = Pair()
    far = 0.3 * SOFTENING
    most = pair.put(np.array([far, 0.0, 0.0]))[0].sum(axis=0) @ TURN * pair.out
    back = pair.put(np.array([0.0, 0.5 * far, 0.0]))[0].sum(axis=0) @ TURN * pair.out
    assert most[0] > 0.1 * 8e6 * AREA and np.abs(most[1:]).max() < 1e-9 * most[0]
    assert back[1] == pytest.approx(0.5 * most[0], rel=1e-9) and abs(back[0]) < 1e-9 * back[1]
    again = pair.put(np.array([far, 0.0, 0.0]))[0].sum(axis=0) @ TURN * pair.out
    assert np.allclose(again, most, rtol=1e-12)


def test_friction_grows_with_pressure():
    """Peak and residual shear stress of a closed joint: c + p tan(phi), then p tan(phi)."""
    p, tan = 6e6, math.tan(math.radians(30.0))
    close = -p * H / 3e11
    pair = Pair()
    peak = 2.0 * (8e6 + p * tan) * H / 3e11
    force = pair.put(np.array([0.0, peak, close]))[0].sum(axis=0) @ TURN * pair.out / AREA
    assert np.allclose(force, [0.0, 8e6 + p * tan, -p], rtol=0.0, atol=20.0)
    force = pair.put(np.array([0.0, 2.0 * SOFTENING, close]))[0].sum(axis=0) @ TURN * pair.out / AREA
    assert np.allclose(force, [0.0, p * tan, -p], rtol=0.0, atol=20.0) and pair.state() == joints.BROKEN


@pytest.mark.parametrize("size", [3e-8, 3e-7, 2e-5])
def test_forces_are_those_of_the_plain_reference_and_opposite_bit_for_bit(size):
    """Corners of the other side moved each by itself, before the peak and behind it: both sides get the same numbers
    with the other sign, which are those of the formula written plainly."""
    rng = np.random.default_rng(5)
    states = set()
    for _ in range(25):
        pair = Pair()
        ways = rng.uniform(-size, size, (3, 3))
        mine, theirs = pair.put(*ways)
        states.add(pair.state())
        assert (mine == -theirs).all() and mine.any()
        table, beyond = pair.local.joint_table[1], pair.local.joint_beyond[1]

        def stresses(point, o, s, law=table, more=beyond):
            return joint_law.point(o, s, H, law, more, np.zeros(joint_law.HISTORY), 0)[:2]

        (e, _), (d, _) = (divmod(face, 4) for face in pair.sides)
        first, second = (pair.sim.mesh.face_corners(np.array([face]))[0] % 4 for face in pair.sides)
        x = pair.sim.x.reshape(-1, 4, 4)[:, :, :3]
        here, there = x[pair.sim.where[e]][first], x[pair.sim.where[d]][second[[0, 2, 1]]]
        expected = face_joint_forces(here, there, stresses)
        assert np.allclose(mine, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    assert states == {3e-8: {joints.INTACT}, 3e-7: {joints.INTACT, joints.YIELDED}, 2e-5: {joints.YIELDED}}[size]


def test_all_joints_of_a_turned_mesh_are_opposite():
    """Every inner face of a shaken box far from the origin: one element moved alone is pulled by its neighbours with
    exactly the opposite of what they feel."""
    made = box((2, 2, 2), (1.0, 0.8, 0.6), 6, shaken=0.2)
    sim = body(Mesh.of(made.points @ TURN.T + [300.0, -20.0, 7.0], made.cells))
    sim.joint_model(None, INTERFACE, VALUES)
    sim.close_model()
    home, rng = sim.x.copy(), np.random.default_rng(2)
    for e in range(0, len(made.cells), 5):
        sim.x[:] = home
        sim.x.reshape(-1, 4, 4)[sim.where[e], :, :3] += rng.uniform(-1e-7, 1e-7, 3)
        seen = sim.evaluate().of_joints.reshape(-1, 4, 4)[:, :, :3]
        points = {int(p): seen[sim.where[e], k] for k, p in enumerate(made.cells[e])}
        beside = [int(f) // 4 for f in sim.partner[4 * e : 4 * e + 4] if f >= 0]
        assert len(beside) > 1
        for p, force in points.items():
            others = [seen[sim.where[d], k] for d in beside for k in range(4) if made.cells[d, k] == p]
            assert np.abs(force + sum(others)).max() <= 4e-16 * np.abs(seen).max()


def bar(height: float = 0.4, **values: float) -> Blocks:
    """Two blocks of tetrahedra on each other, whole but for the joints between them."""
    mesh = box((2, 2, 4), (0.2, 0.2, height), 6)
    sim = body(mesh)
    edges = mesh.edges()
    middle = edges.faces[edges.inner, 0]
    middle = middle[(np.abs(mesh.points[mesh.face_points(middle)][:, :, 2] - 0.5 * height) < 1e-9).all(axis=1)]
    sim.joint_model(middle, INTERFACE, {**VALUES, **values})
    return sim


def test_a_pulled_bar_breaks_in_the_middle_with_mode_1():
    """Its strength is that of the joints; cracks are known with place, area, mode; what it took is their energy."""
    sim = bar(gf1=5.0)
    top, bottom = nodes_on(sim.mesh, "top"), nodes_on(sim.mesh, "bottom")
    sim.velocity_condition(bottom, vx=0.0, vy=0.0, vz=0.0)
    sim.velocity_condition(top, vz=0.02)
    most = 0.0
    for _ in range(60):
        for _ in range(25):
            sim.step()
        most = max(most, diagnostics.total(sim, "reaction_z", top))
        if diagnostics.joint_counts(sim)[2] == 8:
            break
    assert most == pytest.approx(2e6 * 0.04, rel=0.05)
    found = diagnostics.events(sim)
    assert len(found["joint"]) == 8 and (found["mode"] < 1.01).all()
    assert np.allclose(found["z"], 0.2) and np.allclose(found["joint_area"].sum(), 0.04)
    assert (found["peak_step"] > 0).all() and (found["peak_step"] < found["step"]).all()


@pytest.mark.slow
@pytest.mark.parametrize("friction", [20.0, pytest.param(35.0, marks=pytest.mark.slow)])
def test_a_sheared_bar_breaks_with_mode_2_and_slides_on_by_friction(friction):
    """The pressed joint breaks while it is closed: friction is handed over to the contact, whose tangent it then is."""
    sim = bar(0.06, gf2=5.0, friction=friction, cohesion=1e6, penalty_overlay=3e12)
    sim.element_property(None, {"friction": friction, "damp_factor": 1.0})
    sim.option(collision=True)
    top, bottom = nodes_on(sim.mesh, "top"), nodes_on(sim.mesh, "bottom")
    sim.velocity_condition(bottom, vx=0.0, vy=0.0, vz=0.0)
    sim.stress_condition(faces_on(sim.mesh, "top"), normal=-2e6)
    sim.velocity_condition(top, vx=0.05, vy=0.0)
    path = []
    for _ in range(300):
        for _ in range(50):
            sim.step()
        path.append(diagnostics.total(sim, "reaction_x", top))
    assert diagnostics.joint_counts(sim)[2] == 8
    found = diagnostics.events(sim)
    assert (found["mode"] > 1.9).all()
    residual = 2e6 * 0.04 * math.tan(math.radians(friction))
    assert max(path) > 1.15 * residual
    assert np.mean(path[-100:]) == pytest.approx(residual, rel=0.05)


def test_an_open_crack_and_reset_and_excavation():
    """Faces opened by hand carry nothing; damage can be forgotten; joints beside what is taken out are gone."""
    sim = bar()
    sim.close_model()
    joint = sim.local.lower_faces.copy()
    changes.crack(sim, joint[:1])
    sim.close_model()
    state = sim.local.slot_state[sim.local.slot_of(joint)]
    assert (state[0] == joints.NONE) and (state[1:] == joints.INTACT).all()
    e = int(joint[3]) // 4
    changes.null(sim, np.array([e]))
    sim.close_model()
    gone = np.isin(4 * e + np.arange(4), joint) | np.isin(sim.partner[4 * e : 4 * e + 4], joint)
    assert gone.any() and sorted(sim.local.lower_faces) == sorted(set(joint) - {joint[3]})
    sim.step()


def test_stiffness_of_a_jointed_lattice():
    """A Kuhn box with joints everywhere under uniform strain in one direction, all of its surface moved: softer than
    the solid by what was computed elsewhere, .879 M for P = 10 E and 4 cells, .984 M for 100 E."""
    for factor, expected in ((10.0, 0.879), (100.0, 0.984)):
        mesh = box((4, 4, 4), (1.0, 1.0, 1.0), 6)
        sim = body(mesh, dynamic=False)
        strong = {**VALUES, "tensile_strength": 1e12, "cohesion": 1e12, "gf1": 1e9, "gf2": 1e9}
        sim.joint_model(None, INTERFACE, {**strong, "penalty_normal": factor * ROCK["young"]})
        outer = np.unique(np.concatenate([nodes_on(mesh, side) for side in mesh.layers]))
        strain, steps = 1e-6, 100
        for point in outer:
            sim.velocity_condition([point], vx=0.0, vy=0.0, vz=strain / steps * mesh.points[point, 2])
        for _ in range(steps):
            sim.step()
        sim.velocity_condition(outer, vx=0.0, vy=0.0, vz=0.0)
        for _ in range(1500):
            sim.step()
        modulus = diagnostics.total(sim, "reaction_z", nodes_on(mesh, "top")) / strain
        assert modulus / 60e9 == pytest.approx(expected, abs=0.012)

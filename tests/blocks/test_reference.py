"""Elements, joints and the kick of nodes against the plain loops of physics/fdem/reference.py, in random states."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, reference
from hpcdem.physics.fdem.kernels import elements, joint_law, joints
from hpcdem.physics.fdem.local import Evaluation
from hpcdem.physics.fdem.node_set import ALPHA
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import EVERY_KIND, JOINT, ROCK, jointed, model, rectangle, shaken

MU2 = ROCK["young"] / (1.0 + ROCK["poisson_ratio"])
LAME = MU2 * ROCK["poisson_ratio"] / (1.0 - 2.0 * ROCK["poisson_ratio"])
OPENING = 2.0 * JOINT["tensile_strength"] / JOINT["penalty_normal"]  # of the peak, over the length


def disturbed(kind: str, tied: bool, **options: bool) -> Blocks:
    """40 cells of 0.1 m with initial stress, viscosity and gravity."""
    sim = model(shaken(rectangle(8, 5, 0.8, 0.5, kind=kind), 0.2))
    sim.element_property(None, {"damp_factor": 0.6})
    sim.initial_stress(None, xx=-3e6, yy=-5e6, xy=1e6, zz=-2e6)
    sim.gravity(1.0, -9.81)
    sim.option(collision=False, **options)
    if tied:
        jointed(sim)
    sim.close_model()
    return sim


def corners(sim: Blocks, r: int) -> np.ndarray:
    """Nodes of the element in a storage row."""
    cell = sim.reference.cells[sim.number[r]]
    return cell[cell >= 0]


def disturb(sim: Blocks, tied: bool, seed: int) -> None:
    """Random places and velocities of the corners: of nodes where they hang together, else joints open and slip by up
    to some widths of the peak; strains some 0.1 %, turned by half a radian if strains may be large."""
    rng = np.random.default_rng(seed)
    points = sim.reference.points
    angle = 0.5 if sim.options.large_strain else 0.0
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    at, speed = points + 1e-5 * rng.normal(size=points.shape), rng.normal(size=points.shape)
    width = 2.0 * 0.1 * OPENING
    for r in range(len(sim.number)):
        nodes = corners(sim, r)
        n = 2 * len(nodes)
        own = width * rng.normal(size=(len(nodes), 2)) if tied else 0.0
        apart = width * rng.normal(size=2) * rng.choice([0.0, 1.0, 30.0, 2000.0]) if tied else 0.0
        sim.x[r, :n] = ((at[nodes] + own + apart) @ turn.T).reshape(-1)
        sim.v[r, :n] = (speed[nodes] + (rng.normal(size=(len(nodes), 2)) if tied else 0.0)).reshape(-1)
    changes.repeat(sim, sim.x)
    if sim.wide:
        changes.repeat(sim, sim.v)


def of_elements(sim: Blocks) -> np.ndarray:
    """Forces (n, 4, 2) of stress and gravity, by the reference."""
    local, small = sim.local, not sim.options.large_strain
    eta = dict(zip(local.triangle_rows[: local.count], local.c[:, elements.ETA]))
    eta |= dict(zip(local.quad_rows, local.q[:, elements.Q_ETA]))
    stress0 = np.array([[-3e6, 1e6], [1e6, -5e6]])
    force = np.zeros((len(sim.number), 4, 2))
    for r in range(len(sim.number)):
        nodes = corners(sim, r)
        n = len(nodes)
        solid = reference.Solid(LAME, MU2, eta[r], stress0, small, sim.options.stiffness_damping)
        forces = reference.triangle_forces if n == 3 else reference.quad_forces
        x, v = (rows[r, : 2 * n].reshape(-1, 2) for rows in (sim.x, sim.v))
        force[r, :n] = forces(sim.reference.points[nodes], x, v, solid)
        force[r, :n] += local.true_mass[r, :n, None] * ((1.0, -9.81) - sim.options.mass_damping * v)
    return force


def of_joints(sim: Blocks) -> tuple[np.ndarray, np.ndarray]:
    """Forces (n, 4, 2) of joints by the reference, and how many joints are intact, past the peak now, and before."""
    local, found = sim.local, np.zeros(3, int)
    force = np.zeros((len(sim.number), 4, 2))
    for slot in range(local.slots):
        state = local.slot_state[slot]
        if state == joints.NONE:
            continue
        face = local.slot_face[slot]
        law, beyond = local.joint_table[local.slot_kind[slot]], local.joint_beyond[local.slot_kind[slot]]
        history = local.slot_history[slot] if state != joints.INTACT else np.zeros(joint_law.HISTORY)

        left = []

        def before(point, o, s, length, law=law, left=left):
            sigma, tau, rest = joint_law.intact_point(o / length, s / length, *law[:6])
            left.append(rest)
            return sigma, tau

        def behind(point, o, s, length, law=law, beyond=beyond, history=history):
            return joint_law.point(o, s, length, law, beyond, history, point)[:2]

        (r, k, k2), (other, m, m2) = (ends(sim, f) for f in (face, sim.partner[face]))
        x = sim.x[:, :8].reshape(-1, 4, 2)
        place = x[r, k], x[r, k2], x[other, m], x[other, m2]
        pull = reference.joint_forces(*place, before)
        if state != joints.INTACT or min(left) < 0.0:
            pull = reference.joint_forces(*place, behind)
        found[0 if min(left) >= 0.0 else 1 if state == joints.INTACT else 2] += 1
        force[r, [k, k2]] += pull
    return force, found


def ends(sim: Blocks, face: int) -> tuple[int, int, int]:
    """Storage row of the element of a face, and its first and last corner."""
    r = int(sim.where[face // 4])
    return r, face % 4, (face % 4 + 1) % len(corners(sim, r))


def rows_of(sim: Blocks, found: Evaluation) -> tuple[np.ndarray, np.ndarray]:
    return found.force.reshape(-1, 4, 2), found.of_joints.reshape(-1, 4, 2)


@pytest.mark.some_of_each
@pytest.mark.parametrize("large", [True, False])
@EVERY_KIND
def test_elements_and_nodes(kind: str, large: bool) -> None:
    """Stress, viscosity, gravity; nodes of several corners are kicked by the sum of their forces."""
    for dynamic, part in ((True, None), (True, "mass"), (True, "stiffness"), (False, None)):
        sim = disturbed(kind, False, large_strain=large, dynamic=dynamic)
        if part is not None:
            sim.rayleigh(0.3, 1000.0, part)
            sim.close_model()
        disturb(sim, False, 1)
        force, found = of_elements(sim), sim.local.evaluation(contact=False)
        scale = np.abs(force).max()
        assert rows_of(sim, found)[0] == pytest.approx(force, abs=1e-10 * scale)
        check_kick(sim, force, found.v_next, tied=False)


def check_kick(sim: Blocks, force: np.ndarray, after: np.ndarray, tied: bool) -> None:
    """New velocities of all corners; tied by joints each is a node by itself."""
    members: dict = {}
    for r in range(len(sim.number)):
        for k, node in enumerate(corners(sim, r)):
            members.setdefault((node, r) if tied else node, []).append((r, k))
    alpha = 0.0 if sim.options.dynamic else ALPHA
    v, out = (rows.reshape(len(rows), -1, 2) for rows in (sim.v, after))
    for at in members.values():
        mass = sum(sim.local.masses.of_motion[r, k] for r, k in at)
        pulls = np.array([force[r, k] for r, k in at])
        expected = reference.node_velocity(v[at[0]], pulls, mass, alpha, sim.clock.dt)
        scale = np.abs(pulls).max() * sim.clock.dt / mass
        assert all(out[r, k] == pytest.approx(expected, abs=1e-9 * scale + 1e-12) for r, k in at)


@pytest.mark.some_of_each
@pytest.mark.parametrize("large", [True, False])
@EVERY_KIND
def test_joints(kind: str, large: bool) -> None:
    """Joints before their peak, past it for the first time, and past it with a history, in three random states."""
    sim = disturbed(kind, True, large_strain=large)
    seen = np.zeros(3, int)
    for seed in (2, 3, 4):
        disturb(sim, True, seed)
        force, states = of_joints(sim)
        seen += states
        found = sim.local.evaluation(contact=False)
        assert rows_of(sim, found)[1] == pytest.approx(force, abs=1e-9 * np.abs(force).max())
        total = force + of_elements(sim)
        assert rows_of(sim, found)[0] == pytest.approx(total, abs=1e-9 * np.abs(total).max())
        check_kick(sim, total, found.v_next, tied=True)
        rooms = (np.zeros((len(sim.number), elements.FORCE)) for _ in range(2))
        sim.local._elements(
            np.ones(sim.local.count, bool), np.ones(len(sim.local.head), bool), *rooms, False
        )  # remember
    assert (seen > 20).all()


@pytest.mark.parametrize("kind", ["quad", "mixed"])
def test_the_place_of_a_quad_in_the_lanes_changes_no_bit(kind: str) -> None:
    """Forces and histories where quads go through in one part and in seven, others side by side in the lanes; a third
    of them have no joints."""
    mesh = shaken(rectangle(20, 9, 2.0, 0.9, kind=kind), 0.2)
    sim = model(mesh)
    sim.option(collision=False)
    edges = mesh.edges()
    some = edges.inner & (mesh.points[edges.points, 0].max(axis=1) < 1.3)
    sim.joint_model(edges.faces[some, 0], "classic_intrinsic_cohesive_interface", JOINT)
    sim.close_model()
    disturb(sim, True, 5)
    local = sim.local
    start = [table.copy() for table in (local.slot_law, local.slot_state, local.slot_history, local.head, local.follow)]
    found = []
    for parts in (1, 7):
        tables = [table.copy() for table in start]
        out = [np.zeros((len(sim.number), elements.FORCE)) for _ in range(2)]
        for _ in range(2):
            args = list(local._quad_args)
            args[0] = parts
            args[11], args[13], args[14] = tables[0], tables[1], tables[2]
            tally = np.zeros((parts, elements.TALLY), np.int64)
            elements.quads(*args, *out, True, 1.0, -9.81, 0.0, 0.0, 3, tally)
        found.append([*out, tables[0], tables[1], tables[2]])
    assert all((a == b).all() for a, b in zip(*found))
    assert np.bincount(found[0][3], minlength=4).tolist()[:3] > [40, 40, 40]
    assert (found[0][1] != 0.0).any() and len(local.quad_rows) > elements.QUAD_BLOCK

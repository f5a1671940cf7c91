"""Whose properties a contact has: those of the two faces that touch, and of no other face of their elements; and which
elements take part at all."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.kernels import contact
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import EVERY_KIND, JOINT, joined, near, rectangle, shaken

SOFT = {"density": 2700.0, "young": 1e9, "poisson_ratio": 0.25, "damp_factor": 1.0}
MODEL = {"friction": 25.0, "penalty_normal": 1e10, "penalty_shear": 4e9, "damping_t": 4e6, "damping_b": 2.0}


def pressed(
    kind: str, bottom: dict[str, float], others: dict[str, float], plate_top: dict[str, float] | None = None
) -> np.ndarray:
    """A block one element high whose nodes are moved into a plate by 0.4 mm, along it by 20 um, and out again: forces
    on the block (n, 2) [N/m] at each step. bottom: what its lower faces have instead of MODEL; others: its upper ones,
    its inner ones, and the lower ones of the plate; plate_top: the upper ones of that."""
    block, plate = rectangle(6, 1, 0.6, 0.1, x0=0.213, kind=kind), rectangle(10, 1, 1.0, 0.1, y0=-0.1, kind=kind)
    mesh = joined(block, plate)
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", SOFT)
    sim.face_model(None, "contact_mohr_coulomb", MODEL)
    n = len(block.points)
    at_zero = near(mesh, 1, 0.0)
    lower = at_zero[at_zero // 4 < len(block.cells)]
    edges = mesh.edges()
    rest = np.concatenate([near(mesh, 1, 0.1), near(mesh, 1, -0.1), edges.faces[edges.inner].reshape(-1)])
    for faces, given in ((lower, bottom), (rest, others), (np.setdiff1d(at_zero, lower), plate_top)):
        if given:
            sim.face_property(faces, given)
    sim.velocity_condition(np.arange(n, len(mesh.points)), vx=0.0, vy=0.0)
    sim.time_step(value=1e-6)
    out = []
    for steps, vx, vy in ((40, 0.0, -10.0), (20, 1.0, 0.0), (40, 0.0, 8.0)):
        sim.velocity_condition(np.arange(n), vx=vx, vy=vy)
        for _ in range(steps):
            sim.step()
            found = diagnostics.contacts(sim)
            out.append((found["force_x"].sum(), found["force_y"].sum()))
    return np.array(out)


@pytest.mark.some_of_each
@EVERY_KIND
@pytest.mark.parametrize(
    "name, value",
    [("friction", 0.0), ("penalty_normal", 5e9), ("penalty_shear", 1e9), ("damping_t", 1e6), ("damping_b", 6.0),
     ("damping_ratio", 0.5)],
)  # fmt: skip
def test_a_property_of_the_face_that_touches_acts_and_of_others_does_not(kind, name, value):
    """Each property alone: on the lower faces of the block it changes the forces, on all faces that touch nothing it
    changes no bit of them."""
    usual = pressed(kind, {}, {})
    assert np.array_equal(pressed(kind, {}, {name: value}), usual)
    other = pressed(kind, {name: value}, {})
    assert np.abs(other - usual).max() > 0.02 * np.abs(usual).max()


@pytest.mark.parametrize("bottom, plate", [(10.0, 25.0), (25.0, 10.0)])
def test_the_smaller_friction_of_both_faces_counts(bottom, plate):
    """Sliding: the force along is tan(10 degrees) of the normal one, whoever has the smaller angle."""
    stiff = {"penalty_shear": 1e12}
    found = pressed("cross", {**stiff, "friction": bottom}, {}, {**stiff, "friction": plate})[59]
    assert abs(found[0] / found[1]) == pytest.approx(math.tan(math.radians(10.0)), rel=0.002)


def on_slope(kind: str, top: float | None = None, joint: bool = False, of_faces: bool = True) -> float:
    """Way [m] of a block one element high in 0.1 s on a plate inclined by 20 degrees, friction 40 degrees, of the faces
    or of the elements; top: of the upper faces; joint: one inside without friction."""
    block, plate = rectangle(4, 1, 0.4, 0.1, x0=0.513, kind=kind), rectangle(20, 1, 2.0, 0.1, y0=-0.1, kind=kind)
    mesh = joined(block, plate)
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**SOFT, "friction": 0.0 if of_faces else 40.0})
    if of_faces:
        sim.face_model(None, "contact_mohr_coulomb", {"friction": 40.0, "penalty_normal": 1e10})
    if top is not None:
        sim.face_model(near(mesh, 1, 0.1), "contact_mohr_coulomb", {"friction": top, "penalty_normal": 1e10})
    if joint:
        edges = mesh.edges()
        inside = edges.faces[edges.inner & (mesh.points[edges.points][:, :, 1].max(axis=1) > 0.05)][:, 0]
        whole = {**JOINT, "friction": 0.0, "tensile_strength": 1e9, "cohesion": 1e9, "penalty_normal": 1e10}
        sim.joint_model(inside, "classic_intrinsic_cohesive_interface", whole)
    n = len(block.points)
    sim.velocity_condition(np.arange(n, len(mesh.points)), vx=0.0, vy=0.0)
    sim.gravity(9.81 * math.sin(math.radians(20.0)), -9.81 * math.cos(math.radians(20.0)))
    convergence.solve(sim, time=0.1)
    return float(diagnostics.values(sim, "displacement_x", np.arange(n)).mean())


@pytest.mark.parametrize("kind", ["cross", pytest.param("quad", marks=pytest.mark.slow)])
def test_a_slippery_top_or_joint_does_not_let_a_block_slide(kind):
    """Free sliding would be 17 mm; elastic movement is below a micrometre."""
    assert abs(on_slope(kind)) < 1e-6
    assert abs(on_slope(kind, top=0.0)) < 1e-6
    assert abs(on_slope(kind, joint=True)) < 2e-6
    assert abs(on_slope(kind, joint=True, of_faces=False)) < 2e-6


def test_faces_of_a_broken_joint_have_its_friction():
    """Two halves on each other along a joint that was opened: tan(20 degrees) of the joint, neither the 40 of the
    elements, nor the 0 of a joint that lies elsewhere in them."""
    mesh = rectangle(4, 2, 0.4, 0.2)
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**SOFT, "friction": 40.0})
    middle = near(mesh, 1, 0.1, inner=True)
    edges = mesh.edges()
    inner = edges.faces[edges.inner][:, 0]
    strong = {**JOINT, "tensile_strength": 1e9, "cohesion": 1e9, "penalty_normal": 1e10}
    sim.joint_model(inner, "classic_intrinsic_cohesive_interface", {**strong, "friction": 0.0})
    lower = np.intersect1d(middle, inner)
    sim.joint_model(lower, "classic_intrinsic_cohesive_interface", {**strong, "friction": 20.0})
    changes.crack(sim, lower)
    y = mesh.points[:, 1]
    sim.velocity_condition(np.flatnonzero(y < 1e-9), vx=0.0, vy=0.0)
    sim.velocity_condition(np.flatnonzero(y > 0.2 - 1e-9), vx=0.0, vy=-0.05)
    convergence.solve(sim, time=2e-3)
    sim.velocity_condition(np.flatnonzero(y > 0.2 - 1e-9), vx=0.2, vy=0.0)
    convergence.solve(sim, time=4e-3)
    c = diagnostics.contacts(sim)
    upper = mesh.centroids()[:, 1] > 0.1
    sign = np.where(upper[c["element_1"]], 1.0, -1.0)
    ratio = abs((sign * c["force_x"]).sum() / (sign * c["force_y"]).sum())
    assert ratio == pytest.approx(math.tan(math.radians(20.0)), rel=0.02)


@pytest.mark.parametrize("kind", ["cross", "mixed"])
def test_a_mirrored_model_has_mirrored_forces(kind):
    """Which face is touched does not depend on the side from which the model is seen. Five kinds of faces on two bodies
    that stick in each other's corners."""

    def forces(mirror: bool) -> np.ndarray:
        one, two = shaken(rectangle(3, 2, 0.3, 0.2, kind=kind), 0.2), rectangle(3, 2, 0.3, 0.2, kind=kind)
        turn = math.radians(25.0)
        rotated = (two.points - [0.0, 0.0]) @ np.array(
            [[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]]
        )
        mesh = joined(one, type(two).of(rotated + [0.24, 0.1987], two.cells))
        outside = mesh.edges()
        faces = outside.faces[~outside.inner][:, 0]
        middles = mesh.points[outside.points[~outside.inner]].mean(axis=1)
        if mirror:
            turned = np.where(mesh.cells[:, 3:] >= 0, mesh.cells[:, [0, 3, 2, 1]], mesh.cells[:, [0, 2, 1, 3]])
            mesh = type(mesh).of(mesh.points * [-1.0, 1.0], turned)
            outside = mesh.edges()
            again = mesh.points[outside.points[~outside.inner]].mean(axis=1) * [-1.0, 1.0]
            place = np.array([int(np.argmin(((again - m) ** 2).sum(axis=1))) for m in middles])
            faces = outside.faces[~outside.inner][:, 0][place]
        sim = Blocks()
        sim.take_mesh(mesh)
        changes.element_model(sim, None, "mech_iso_elastic", SOFT)
        for k, face in enumerate(faces.tolist()):
            sim.face_model([face], "contact_mohr_coulomb", {"penalty_normal": 1e10 * (1 + k % 5)})
        seen = diagnostics.values(sim, "unbalanced_x"), diagnostics.values(sim, "unbalanced_y")
        return np.column_stack(seen) * ([-1.0, 1.0] if mirror else [1.0, 1.0])

    right, left = forces(False), forces(True)
    assert np.abs(right).max() > 1e3
    assert left == pytest.approx(right, abs=1e-9 * np.abs(right).max())


def overlapping(depth: float, shift: float) -> Blocks:
    """A block 0.1 `depth` in a plate, both of shaken triangles of 0.1 m."""
    block = shaken(rectangle(6, 3, 0.6, 0.3, x0=0.213 + shift, y0=-0.1 * depth), 0.2)
    plate = shaken(rectangle(10, 4, 1.0, 0.4, y0=-0.4), 0.2, seed=8)
    sim = Blocks()
    sim.take_mesh(joined(block, plate))
    changes.element_model(sim, None, "mech_iso_elastic", SOFT)
    sim.face_model(None, "contact_mohr_coulomb", {"penalty_normal": 1e10})
    return sim


@pytest.mark.parametrize("depth", [0.05, 0.01])
def test_every_element_that_is_overlapped_takes_part(depth):
    """The force of all faces on the surface in all elements, tried one by one: those that touch the surface with a
    corner only carry their part (4.1 % of all at an overlap of 0.05 h, 0.8 % at 0.01 h)."""
    sim = overlapping(depth, 0.037)
    sim.close_model()
    mesh, place = sim.the_mesh(), np.argsort(sim.number)
    x, n = np.ascontiguousarray(sim.x[place]), len(mesh.cells)
    edges = mesh.edges()
    free = np.zeros(4 * n, bool)
    free[edges.faces[~edges.inner][:, 0]] = True
    bits = (free.reshape(n, 4)[:, :3] << np.arange(3)).sum(axis=1)
    block = mesh.cells[:, 0] < 4 * 7
    first, second = (a.reshape(-1) for a in np.meshgrid(np.flatnonzero(block), np.flatnonzero(~block), indexing="ij"))
    m = len(first)
    table = np.tile([1e10, 1e10, 0.0, 0.0], (m + 4, 1))
    table.view(np.int64)[:m, contact.CODE] = 4 * bits[first] + 32 * bits[second]
    touching, out = np.zeros(m, np.uint8), np.zeros((m, 12))
    contact.forces(
        1, first, second, 8 * np.arange(n), 6 * np.arange(n), x, np.zeros((n + 2, 6)), table, np.zeros((m + 4, 6)),
        np.zeros((0, 3)), np.zeros((0, 12)), np.zeros(0, np.int64), np.zeros(1, np.int64),
        np.zeros((0, contact.CHOICE)), touching, out, 0.0,
    )  # fmt: skip
    found = diagnostics.contacts(sim)
    assert found["force_y"].sum() == pytest.approx(out[touching > 0, 1:6:2].sum(), rel=1e-12)
    bare = bits == 0
    assert (bare[found["element_1"]] | bare[found["element_2"]]).any()

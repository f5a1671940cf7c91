"""The kernels of tetrahedra: against the plain reference, against values computed elsewhere, turned, and mirrored."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hpcdem.core.comm import SerialComm
from hpcdem.physics.fdem import changes, diagnostics, saved_state
from hpcdem.physics.fdem.kernels import space, tets
from hpcdem.physics.fdem.reference import Solid, tetrahedron_forces
from hpcdem.physics.fdem.simulation import Blocks
from tests.space.support import LAME, ROCK, SHEAR, body, box, without_joints

A = np.array([[1.0, 2.0, 0.0], [0.0, -1.0, 3.0], [2.0, 0.0, 1.0]]) * 1e-4


def moved(points: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    return points @ (np.eye(3) + gradient).T


@pytest.mark.parametrize("split", [5, 6, 12])
@pytest.mark.parametrize(
    ("large", "expected"),
    [(True, (6.00125, -1.998, 3.9993, 6.001, 3.9997, 6.0004)), (False, (6.0, -2.0, 4.0, 6.0, 4.0, 6.0))],
)
def test_a_uniform_strain_gives_one_stress(split: int, large: bool, expected: tuple[float, ...]) -> None:
    """Values xx, yy, xy, zz, xz, yz [MPa] for u = A X, lambda = mu = 20 GPa, to the digits they are known to; by R of
    an SVD to rounding."""
    mesh = box((3, 2, 2), (1.0, 0.7, 0.5), split, shaken=0.2)
    sim = body(mesh)
    sim.option(large_strain=large)
    sim.close_model()
    corners = sim.x.reshape(-1, 4, 4)
    corners[:, :, :3] = moved(corners[:, :, :3].reshape(-1, 3), A).reshape(-1, 4, 3)
    stress = np.array([diagnostics.values(sim, f"stress_{c}") for c in ("xx", "yy", "xy", "zz", "xz", "yz")]).T
    assert np.allclose(stress * 1e-6, expected, rtol=0.0, atol=3e-5)
    left, _, right = np.linalg.svd(np.eye(3) + A)
    r = left @ right if large else np.eye(3)
    strain = r.T @ (np.eye(3) + A) - np.eye(3)
    strain = 0.5 * (strain + strain.T)
    exact = r @ (LAME * np.trace(strain) * np.eye(3) + 2.0 * SHEAR * strain) @ r.T
    found = exact[[0, 1, 0, 2, 0, 1], [0, 1, 1, 2, 2, 2]]
    assert np.abs(stress - found).max() < 1e-10 * np.abs(found).max() * 10.0
    outer = {int(p) for side in mesh.layers.values() for p in side.reshape(-1)}
    forces = np.array([diagnostics.values(sim, f"unbalanced_{axis}") for axis in "xyz"]).T
    inner = [p for p in range(len(mesh.points)) if p not in outer]
    assert len(inner) >= 2 and np.abs(forces[inner]).max() < 1e-8 * np.abs(forces).max()


@pytest.mark.parametrize("small", [False, True])
def test_forces_are_those_of_the_plain_reference(small: bool) -> None:
    """Of any shape, strain, turn and motion; with initial stress, viscosity, gravity and Rayleigh damping."""
    rng = np.random.default_rng(3)
    n = 41  # more than a block, and no multiple of four
    mesh = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    mesh = mesh + rng.uniform(-0.2, 0.2, (n, 4, 3))
    x = np.zeros((n + 2, 16))
    v, rows = np.zeros_like(x), rng.permutation(n).astype(np.int32) + 1
    for i in range(n):
        turned = Rotation.random(random_state=i).as_matrix() @ (np.eye(3) + rng.uniform(-0.1, 0.1, (3, 3)))
        x[rows[i]].reshape(4, 4)[:, :3] = mesh[i] @ turned.T + rng.uniform(-5.0, 5.0, 3)
        v[rows[i]].reshape(4, 4)[:, :3] = rng.uniform(-1.0, 1.0, (4, 3))
    c, s0 = np.zeros((n + 3, tets.TET)), np.zeros((n + 3, tets.STRESSES))
    for i in range(n):
        c[i, :9] = np.linalg.inv((mesh[i, 1:] - mesh[i, 0]).T).reshape(-1)
    c[:n, tets.LAMBDA], c[:n, tets.TWO_MU] = rng.uniform(1.0, 3.0, (2, n))
    c[:n, tets.ETA], c[:n, tets.WEIGHT] = rng.uniform(0.1, 0.5, (2, n))
    s0[:n, :6] = rng.uniform(-0.3, 0.3, (n, 6))
    c[n:] = c[n - 1]
    gravity, drag, beta = rng.uniform(-9.0, 9.0, 3), 0.3, 0.2
    force = np.full((n + 2, 16), np.nan)
    padded = np.concatenate([rows, rows[-1:].repeat(3)])
    none = without_joints(3)
    tets.forces(1, n, padded, x, v, c, s0, True, small, force, *gravity, drag, beta, *none)
    several = np.full_like(force, np.nan)
    tets.forces.py_func(3, n, padded, x, v, c, s0, True, small, several, *gravity, drag, beta, *none)
    assert np.array_equal(force, several, equal_nan=True)
    assert np.isnan(force[[0, n + 1]]).all()  # of others nothing is written
    for i in range(n):
        xx, yy, xy, zz, xz, yz = s0[i, :6]
        solid = Solid(
            c[i, tets.LAMBDA], c[i, tets.TWO_MU], c[i, tets.ETA],
            np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), small, beta,
        )  # fmt: skip
        now, speed = (rows_[rows[i]].reshape(4, 4)[:, :3] for rows_ in (x, v))
        exact = tetrahedron_forces(mesh[i], now, speed, solid) + c[i, tets.WEIGHT] * (gravity - drag * speed)
        assert np.allclose(force[rows[i]].reshape(4, 4)[:, :3], exact, rtol=0.0, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize(("strain", "allowed"), [(1e-3, 2e-15), (0.1, 2e-15), (0.3, 4e-15)])
def test_the_rotation_is_exact(strain: float, allowed: float) -> None:
    """Five steps of Newton's iteration, from any rotation and strains of this size."""
    rng = np.random.default_rng(11)
    for k in range(100):
        stretch = rng.uniform(-strain, strain, (3, 3))
        exact = Rotation.random(random_state=k).as_matrix()
        f = exact @ (np.eye(3) + 0.5 * (stretch + stretch.T))
        assert np.abs(np.array(tets.rotation(*f.reshape(-1))).reshape(3, 3) - exact).max() < allowed


def test_turning_makes_no_stress() -> None:
    """A whole turn about (1, 2, 3) in 36 steps: stress stays below 1e-9 E, and is that of before at its end."""
    sim = body(box((2, 2, 2), (1.0, 1.0, 1.0), shaken=0.2))
    sim.close_model()
    start = sim.x.copy()
    for degrees in range(10, 370, 10):
        turn = Rotation.from_rotvec(np.radians(degrees) * np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)).as_matrix()
        corners = start.reshape(-1, 4, 4)[:, :, :3] @ turn.T
        sim.x.reshape(-1, 4, 4)[:, :, :3] = corners
        stress, _ = sim.local.stresses()
        assert np.abs(stress).max() < 1e-9 * ROCK["young"]


def test_a_turned_mesh_does_the_same() -> None:
    """The same body, turned by 90 degrees about z, moves as the turned one does."""
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    found = []
    for turn in (np.eye(3), quarter):
        mesh = box((3, 2, 2), (1.0, 0.7, 0.5), shaken=0.2)
        sim = body(type(mesh).of(mesh.points @ turn.T, mesh.cells), damp_factor=0.1)
        changes.set_velocity(sim, [0, 5], *(turn @ (1.0, -2.0, 3.0)))
        for _ in range(50):
            sim.step()
        places = np.array([diagnostics.values(sim, f"displacement_{axis}") for axis in "xyz"]).T
        found.append(places @ turn)
    assert np.abs(found[0]).max() > 1e-4
    assert np.abs(found[1] - found[0]).max() < 1e-12 * np.abs(found[0]).max() * 10.0


def test_principal_stresses_of_a_last_frame() -> None:
    """Elements that are not finite have none; the others have theirs."""
    sim = body(box((1, 1, 1), (1.0, 1.0, 1.0)))
    sim.initial_stress(None, xx=-3e6, yy=1e6, zz=2e6, xy=1.5e6)
    sim.close_model()
    whole = [diagnostics.values(sim, name) for name in ("stress_max", "stress_min")]
    assert whole[0] == pytest.approx(np.full(6, 2e6)) and whole[1] == pytest.approx(np.full(6, -3.5e6))
    sim.x[2] = np.nan
    for one, before in zip(("stress_max", "stress_min"), whole):
        assert np.isnan(diagnostics.values(sim, one)[sim.number[2]])
        assert np.array_equal(np.delete(diagnostics.values(sim, one), sim.number[2]), np.delete(before, sim.number[2]))


def test_what_is_stored_is_released() -> None:
    """Kinetic and elastic energy of a body that rings freely: without damping their sum stays."""
    sim = body(box((4, 3, 3), (1.0, 0.75, 0.75), split=12))
    changes.set_velocity(sim, [0], 2.0, 1.0, -1.0)
    stored = []
    for _ in range(400):
        sim.step()
        stored.append(diagnostics.total(sim, "kinetic_energy") + diagnostics.total(sim, "strain_energy"))
    stored = np.array(stored[100:])
    assert diagnostics.total(sim, "strain_energy") > 0.2 * stored.mean()
    assert np.ptp(stored.reshape(-1, 50).mean(axis=1)) < 0.01 * stored.mean()


def test_the_time_step_is_stable_and_near_the_limit() -> None:
    """The largest eigenvalue of the body, by a power iteration on its forces, is below the bound of the elements and
    above a fifth of it: what shakes a node is shared by all of its elements."""
    mesh = box((3, 3, 3), (1.0, 1.0, 1.0), shaken=0.15)
    sim = body(mesh)
    sim.option(large_strain=False)
    sim.close_model()
    bound = (2.0 / (diagnostics.critical_time_step(sim) / sim.options.safety)) ** 2
    at, node = sim.x.reshape(-1, 4, 4), mesh.cells
    points = at[:, :, :3].copy()
    mass = np.bincount(node.reshape(-1), sim.local.true_mass.reshape(-1))
    shape = np.random.default_rng(1).normal(size=(len(mass), 3))
    for _ in range(60):
        shape /= np.abs(shape).max()
        at[:, :, :3] = points + 1e-6 * shape[node]
        force = np.zeros((sim.n_own, 16))
        sim.local._fill(force, np.zeros((1, 16)), False)
        pull = np.zeros_like(shape)
        np.add.at(pull, node.reshape(-1), force.reshape(-1, 4, 4)[:, :, :3].reshape(-1, 3))
        new = -pull / mass[:, None] / 1e-6
        omega2 = float((new * shape).sum() / (shape * shape).sum())
        shape = new
    assert 0.2 * bound < omega2 < bound


@pytest.mark.parametrize("slope", [(0.0, 0.0, 1.0), (1.0, 2.0, -1.0)])
def test_a_plane_that_holds_nodes(slope: tuple[float, float, float]) -> None:
    """Type 3: nodes move across the vector only, and the conditions carry what is along it."""
    sim = body(box((2, 2, 2), (1.0, 1.0, 1.0)), damp_factor=0.3)
    n = np.array(slope) / np.linalg.norm(slope)
    sim.move_constraint(None, space.ACROSS, slope)
    sim.gravity(1.0, 2.0, -9.0)
    for _ in range(20):
        sim.step()
    speed = np.array([diagnostics.values(sim, f"velocity_{axis}") for axis in "xyz"]).T
    way = np.array([1.0, 2.0, -9.0]) - (n @ (1.0, 2.0, -9.0)) * n
    assert np.allclose(speed, sim.clock.time * way, rtol=1e-9)
    held = np.array([diagnostics.total(sim, f"reaction_{axis}") for axis in "xyz"])
    assert np.allclose(held, -2700.0 * (n @ (1.0, 2.0, -9.0)) * n, rtol=1e-9)


def test_a_checkpoint_with_spare_words_continues(tmp_path: Path) -> None:
    """Where storage and lists were made had rows of sixteen words once."""
    sim = body(box((2, 2, 2), (0.02, 0.02, 0.02)))
    sim.option(collision=True)
    changes.set_velocity(sim, None, 0.1, 0.0, 0.0)
    for _ in range(5):
        sim.step()
    kept, ends = sim.origin, []
    assert kept.shape == (48, 12) and not np.array_equal(kept, sim.places())
    for name in ("now", "once"):
        if name == "once":
            wide = np.zeros((48, 4, 4))
            wide[:, :, :3] = kept.reshape(48, 4, 3)
            sim.origin = sim.listed = wide.reshape(48, 16)
        saved_state.save(sim, tmp_path / f"{name}.sav")
        other = Blocks(SerialComm())
        saved_state.restore(other, tmp_path / f"{name}.sav")
        assert np.array_equal(other.origin, kept) and np.array_equal(other.listed, kept)
        for _ in range(50):
            other.step()
        ends.append(other.x)
    assert np.array_equal(*ends)

"""Tetrahedra and hexahedra that creep after Burgers: closed forms of creep and relaxation, restarts, refusals.

J(t) and what it becomes in the Laplace domain: see tests/blocks/test_creep.py."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, creep, diagnostics, saved_state
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.test_creep import LOAD, ROCK, SALT, after_step, compliance, transform
from tests.space.support import box, faces_on, hexes, nodes_on

BURGERS = "mech_burgers"
COMPONENTS = ("xx", "yy", "xy", "zz", "xz", "yz")


def body(make: Callable[..., Mesh] = box, **other: float) -> Blocks:
    """A cube of a metre that creeps, at rest, without conditions."""
    sim = Blocks(SerialComm())
    sim.take_mesh(make((2, 2, 2), (1.0, 1.0, 1.0), shaken=0.2))
    changes.element_model(sim, None, BURGERS, {**SALT, **other})
    sim.option(dynamic=False, collision=False)
    return sim


def loaded(xx: float, yy: float, zz: float, make: Callable[..., Mesh] = box, **other: float) -> Blocks:
    """The cube on rollers on three sides, with these stresses on the others, in balance."""
    sim = body(make, **other)
    mesh = sim.mesh
    for side, axis in (("left", "x"), ("front", "y"), ("bottom", "z")):
        sim.velocity_condition(nodes_on(mesh, side), **{f"v{axis}": 0.0})
    for side, stress in (("right", xx), ("back", yy), ("top", zz)):
        sim.stress_condition(faces_on(mesh, side), normal=stress)
    balanced(sim)
    return sim


def balanced(sim: Blocks) -> None:
    assert convergence.solve(sim, ratio=1e-8).reason == "ratio"


def crept(sim: Blocks, time: float, steps: int) -> None:
    """So much creep time, in equal creep steps."""
    end = sim.creep.time + time
    creep.switch(sim, True, dt=time / steps)
    for _ in range(steps):
        creep.begin(sim, end)
        balanced(sim)
        creep.finish(sim, end)
    assert sim.creep.time == end


def waited(sim: Blocks, time: float, steps: int) -> None:
    """The same where all nodes are held."""
    end = sim.creep.time + time
    creep.switch(sim, True, dt=time / steps)
    for _ in range(steps):
        creep.begin(sim, end)
        creep.finish(sim, end)


def held(sim: Blocks, gradient: np.ndarray) -> None:
    """All nodes go to their places in the mesh times this deformation gradient (3, 3), and stay."""
    sim.velocity_condition(None, vx=0.0, vy=0.0, vz=0.0)
    sim.open_model()
    places = sim.mesh.points @ np.asarray(gradient).T
    sim.x.reshape(-1, 4, 4)[:, :, :3] = places[sim.mesh.cells[sim.number]]
    sim.close_model()


def matrices(sim: Blocks, name: str = "stress") -> np.ndarray:
    """(ne, 3, 3) of the stress, the creep strain or that of the Kelvin units."""
    s = np.array([diagnostics.values(sim, f"{name}_{c}") for c in COMPONENTS])
    return s[[0, 2, 4, 2, 1, 5, 4, 5, 3]].T.reshape(-1, 3, 3)


def width(sim: Blocks) -> np.ndarray:
    """Strain xx, yy, zz of the cube."""
    corner = [int(np.flatnonzero((sim.mesh.points == 1.0).all(axis=1))[0])]
    return np.array([diagnostics.values(sim, f"displacement_{axis}", corner)[0] for axis in "xyz"])


@pytest.mark.parametrize("make", [box, hexes])
def test_uniaxial_stress(make: Callable[..., Mesh]) -> None:
    """10 MPa along z: strain sigma [1 / 9K + J(t) / 3], 3.8889e-4 at once, 1.084397e-3 after 1e5 s; across it sigma
    [1 / 9K - J(t) / 6]."""
    sim = loaded(0.0, 0.0, 1e7, make)
    assert width(sim)[2] == pytest.approx(3.8889e-4, rel=1e-3)
    for time in (2e4, 8e4):
        crept(sim, time, 20)
        j = compliance(sim.creep.time) / 3.0
        along, across = (1e7 * (1.0 / (9.0 * SALT["bulk"]) + part) for part in (j, -0.5 * j))
        assert width(sim) == pytest.approx([across, across, along], rel=1e-3)
    assert along == pytest.approx(1.084397e-3, rel=1e-5)
    want = np.diag([-0.5, -0.5, 1.0]) * 1e7 / 3.0 * (compliance(1e5) - compliance(0.0))
    assert np.abs(matrices(sim, "creep_strain") - want).max() < 2e-3 * np.abs(want).max()
    assert np.abs(matrices(sim) - np.diag([0.0, 0.0, 1e7])).max() < 1e-4 * 1e7


@pytest.mark.parametrize("make", [box, hexes])
def test_true_triaxial_stress(make: Callable[..., Mesh]) -> None:
    """Three stresses, by superposition; the energy that is given is stored or lost."""
    stress = np.array([2e6, -5e6, 9e6])
    sim = loaded(*stress, make=make)
    given = 0.5 * float(stress @ width(sim))
    before = width(sim)
    crept(sim, 5e4, 25)
    deviator = stress - stress.mean()
    want = stress.mean() / (3.0 * SALT["bulk"]) + 0.5 * compliance(5e4) * deviator
    assert width(sim) == pytest.approx(want, rel=1e-3)
    given += float(stress @ (width(sim) - before))
    lost, stored = (diagnostics.total(sim, name) for name in ("creep_work", "strain_energy"))
    assert lost > 0.2 * given and stored + lost == pytest.approx(given, rel=1e-3)


@pytest.mark.parametrize(("turned", "make"), [(False, box), (True, box), (True, hexes)])
def test_relaxation_at_fixed_strain(turned: bool, make: Callable[..., Mesh]) -> None:
    """S(t) = 2 e D / N after a step of strain with all components, the mean stress stays; second order in the creep
    step; turned with the body by any angle."""
    n, d = transform(ROCK)
    turn = Rotation.from_euler("zxy", (20.0, -50.0, 35.0), degrees=True).as_matrix() if turned else np.eye(3)
    strain = np.array([[1e-4, 2e-5, -3e-5], [2e-5, -2e-4, 4e-5], [-3e-5, 4e-5, 5e-5]])
    errors = []
    for steps in (20, 200):
        sim = body(make, **ROCK)
        held(sim, turn @ (np.eye(3) + strain))
        before = matrices(sim)
        waited(sim, 3e5, steps)
        left = after_step(d, n, 3e5) / ROCK["maxwell_shear"]
        mean = np.trace(before, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
        errors.append(np.abs(matrices(sim) - (mean + left * (before - mean))).max() / np.abs(before).max())
    assert left < 0.7 and errors[0] < 1e-3 and 80.0 < errors[0] / errors[1] < 120.0


@pytest.mark.parametrize("component", ["xx", "yy", "xy", "xz", "yz"])
def test_strain_of_the_kelvin_unit(component: str) -> None:
    """Free of load, a Kelvin unit with the strain e_0 comes back to none, and the body deforms by
    -e_0 (1 - exp(-G_K t / eta_K)). Each component alone; zz is -xx - yy."""
    strain, axis = 1e-4, ["xyz".index(c) for c in component]
    sim = body(maxwell_viscosity=0.0, **{f"kelvin_strain_{component}": strain})
    e0 = np.zeros((3, 3))
    e0[axis[0], axis[1]] = e0[axis[1], axis[0]] = strain
    if axis[0] == axis[1]:
        e0[2, 2] = -strain
    sim.close_model()
    assert np.abs(matrices(sim, "kelvin_strain") - e0).max() < 1e-12 * strain
    balanced_at(sim, 4e4, 40)
    gone = 1.0 - math.exp(-SALT["kelvin_shear"] * 4e4 / SALT["kelvin_viscosity"])
    assert np.abs(matrices(sim, "creep_strain") + gone * e0).max() < 1e-3 * strain
    assert np.abs(matrices(sim, "kelvin_strain") - (1.0 - gone) * e0).max() < 1e-3 * strain
    move = np.array([diagnostics.values(sim, f"displacement_{a}") for a in "xyz"]).T
    points = sim.mesh.points - sim.mesh.points.mean(axis=0)
    gradient = np.linalg.lstsq(points, move - move.mean(axis=0), rcond=None)[0]
    assert np.abs(0.5 * (gradient + gradient.T) + gone * e0).max() < 1e-3 * strain


def balanced_at(sim: Blocks, time: float, steps: int) -> None:
    """Creep of a body that nothing loads: the ratio of no forces is none, so steps are counted."""
    end = time
    creep.switch(sim, True, dt=time / steps)
    for _ in range(steps):
        creep.begin(sim, end)
        convergence.advance(sim, 60)
        creep.finish(sim, end)


def test_zz_of_the_kelvin_unit() -> None:
    """It may be said, of a strain without volume; then it follows again."""
    sim = body()
    sim.element_property(None, {"kelvin_strain_xx": 1e-4, "kelvin_strain_zz": -1e-4})
    sim.element_property(None, {"kelvin_strain_yy": -3e-4})
    sim.close_model()
    assert np.abs(matrices(sim, "kelvin_strain") - np.diag([1e-4, -3e-4, 2e-4])).max() < 1e-15
    with pytest.raises(CommandError, match=r"kelvin_strain_zz must be -xx - yy = 0.0002, as .* no volume, got 0.0001"):
        sim.element_property(None, {"kelvin_strain_zz": 1e-4})
    changes.reset_kelvin_strain(sim, np.arange(5))
    assert not matrices(sim, "kelvin_strain")[:5].any() and matrices(sim, "kelvin_strain")[5:].all(axis=0)[0, 0]


def test_components_of_space_are_refused_in_the_plane() -> None:
    from tests.blocks.test_creep import body as plane

    for name in ("kelvin_strain_zz", "kelvin_strain_xz", "kelvin_strain_yz"):
        sim = plane()
        with pytest.raises(CommandError, match=f"{name} is for three dimensions"):
            sim.element_property(None, {name: 1e-4})
        with pytest.raises(CommandError, match=f"there is no quantity {name} in two dimensions"):
            diagnostics.values(sim, name)


def test_elastic_as_long_as_creep_is_off() -> None:
    """The bits of an elastic element, in motion."""
    ends = []
    for name in (BURGERS, "mech_iso_elastic"):
        sim = Blocks(SerialComm())
        sim.take_mesh(box((3, 2, 2), (1.0, 0.7, 0.5), shaken=0.2))
        rock = {"density": 2500.0, "young": 30e9, "poisson_ratio": 0.3, "damp_factor": 0.1}
        more = {"kelvin_shear": 1e9, "kelvin_viscosity": 1e5, "maxwell_viscosity": 1e5} if name == BURGERS else {}
        changes.element_model(sim, None, name, {**rock, **more})
        sim.option(collision=False)
        sim.initial_stress(None, xx=1e6, yy=-2e6, zz=1e5, yz=3e5)
        changes.set_velocity(sim, np.arange(4), 1.0, -2.0, 0.5)
        convergence.advance(sim, 50)
        ends.append(np.concatenate([diagnostics.values(sim, "position_x"), diagnostics.values(sim, "strain_energy")]))
    assert np.array_equal(*ends)


def test_creep_in_motion() -> None:
    """In dynamic runs elements creep by the time of the model: all nodes held, the stress relaxes as in creep steps."""
    fast = {**ROCK, "maxwell_viscosity": 6e7, "kelvin_viscosity": 4e6}
    n, d = transform(fast)
    sim = body(**fast)
    held(sim, np.eye(3) + np.array([[1e-4, 2e-5, 0.0], [2e-5, -2e-4, 4e-5], [0.0, 4e-5, 0.0]]))
    before = matrices(sim)
    sim.option(dynamic=True)
    creep.switch(sim, True)
    convergence.advance(sim, 300)
    left = after_step(d, n, sim.clock.time) / fast["maxwell_shear"]
    mean = np.trace(before, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    assert 0.05 < left < 0.95 and sim.creep.time == sim.clock.time
    assert np.abs(matrices(sim) - (mean + left * (before - mean))).max() < 1e-3 * np.abs(before).max()


def test_creep_steps_that_follow_the_change() -> None:
    """model creep ... change: the step grows while less and less changes."""
    sim = loaded(0.0, 0.0, LOAD, maxwell_viscosity=0.0)
    creep.switch(sim, True, dt=100.0, change=0.05)
    grown = [sim.creep.dt]
    for _ in range(12):
        creep.begin(sim, 1e7)
        balanced(sim)
        creep.finish(sim, 1e7)
        grown.append(sim.creep.dt)
    assert grown[-1] > 10.0 * grown[0] and all(b >= a for a, b in itertools.pairwise(grown))


def test_it_continues_in_mid_creep(tmp_path: Path) -> None:
    """Saved within a creep step, and gone on from: the same bits."""
    ends = []
    for again in (False, True):
        sim = loaded(1e6, 0.0, -LOAD)
        creep.switch(sim, True, dt=2e3)
        creep.begin(sim, 1e5)
        convergence.advance(sim, 7)
        if again:
            saved_state.save(sim, tmp_path / "a.sav")
            sim = Blocks(SerialComm())
            saved_state.restore(sim, tmp_path / "a.sav")
        convergence.advance(sim, 30)
        creep.finish(sim, 1e5)
        creep.begin(sim, 1e5)
        convergence.advance(sim, 20)
        names = ("position_z", "stress_zz", "creep_strain_zz", "kelvin_strain_xz", "creep_work", "strain_energy")
        ends.append(np.concatenate([diagnostics.values(sim, name) for name in names]))
    assert np.array_equal(*ends)

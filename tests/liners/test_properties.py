"""Every property, option and condition of liners changes what becomes of them by itself."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem import convergence
from hpcdem.physics.fdem.structures import VELOCITY
from hpcdem.physics.liners.layout import closing
from hpcdem.physics.liners.model import Liners
from hpcdem.physics.liners.properties import LINER
from tests.blocks.support import model, near, rectangle

USUAL = {
    "density": 2400.0, "young": 20e9, "poisson_ratio": 0.2, "thickness": 0.05, "area": 0.04, "inertia": 1e-5,
    "tensile_strength": 5e5, "compressive_strength": 1e6, "plastic_moment": 4e3, "normal_stiffness": 1e10,
    "shear_stiffness": 8e9, "bond_tensile_strength": 2e5, "bond_cohesion": 1e5, "bond_friction": 30.0,
}  # fmt: skip
OTHER = {
    "density": 3000.0, "young": 15e9, "poisson_ratio": 0.1, "thickness": 0.08, "area": 0.06, "inertia": 2e-5,
    "tensile_strength": 3e5, "compressive_strength": 2e6, "plastic_moment": 2e3, "normal_stiffness": 2e10,
    "shear_stiffness": 4e9, "bond_tensile_strength": 1e5, "bond_cohesion": 2e5, "bond_friction": 10.0,
}  # fmt: skip
CONDITIONS = {"does_y": VELOCITY, "at_y": 0.6, "force_x": -2e4, "moment": 500.0}


def test_faces_of_a_closed_chain() -> None:
    """Of an open chain, a ring of three faces, and one of four."""
    points = np.array([[0, 1], [1, 2], [5, 6], [6, 7], [7, 5], [10, 11], [11, 12], [12, 13], [13, 10]])
    assert closing(points, np.array([0, 1, 0, 1, 1, 0, 1, 1, 1], bool)) == [(2, 4), (5, 8)]


def shaken(properties: dict[str, float], conditions: dict[str, object] | None = None) -> np.ndarray:
    """What becomes of a liner on a pressed block in motion, drawn off at one end and pushed in the middle."""
    sim = model(rectangle(8, 3, 0.8, 0.3))
    sim.option(collision=False)
    sim.initial_stress(None, yy=-2e6)
    sim.move_constraint(np.flatnonzero(sim.mesh.points[:, 1] == 0.0), 1)
    liners = Liners.of(sim)
    _, elements = liners.create(near(sim.mesh, 1, 0.3))
    liners.assign(elements, properties)
    liners.condition(np.array([0]), **(CONDITIONS if conditions is None else conditions))
    liners.condition(np.array([4, 5]), force_y=-1e6, force_x=3e5)
    convergence.advance(sim, 250)
    return np.concatenate([liners.nodes["x"].ravel(), liners.elements["force"].ravel(), liners.nodes["turn"]])


@pytest.fixture(scope="module")
def usual() -> np.ndarray:
    return shaken(USUAL)


def test_a_thickness_gives_the_section() -> None:
    """A = 0.2, I = 0.2^3 / 12, M = (2 + 30 MPa) 0.2^2 / 8; and back from I and A."""
    values = {"thickness": 0.2, "tensile_strength": 2e6, "compressive_strength": 30e6}
    LINER.derive(values)
    found = [values[name] for name in ("area", "inertia", "plastic_moment")]
    assert found == pytest.approx([0.2, 6.6666667e-4, 160e3], rel=1e-7)
    values = {"area": 0.2, "inertia": 6.6666667e-4, "tensile_strength": np.inf, "compressive_strength": np.inf}
    LINER.derive(values)
    assert values["thickness"] == pytest.approx(0.2, rel=1e-7)


def test_all_of_them_are_here() -> None:
    assert set(USUAL) == set(OTHER) == {one.name for one in LINER.properties}


@pytest.mark.parametrize("name", OTHER)
def test_a_property_alone_changes_the_outcome(usual, name) -> None:
    if name == "thickness":  # it counts where area, inertia and the plastic moment do not say all
        shell = {key: value for key, value in USUAL.items() if key not in ("area", "inertia", "plastic_moment")}
        assert not np.array_equal(shaken({**shell, name: OTHER[name]}), shaken(shell))
    else:
        assert not np.array_equal(shaken({**USUAL, name: OTHER[name]}), usual)


@pytest.mark.parametrize(
    "change",
    [{"does_x": VELOCITY}, {"does_turn": VELOCITY}, {"does_turn": VELOCITY, "at_turn": 1.0}, {"at_y": 0.7},
     {"force_x": 0.0}, {"force_y": 1e3, "does_y": 0}, {"moment": 0.0}, {"does_x": VELOCITY, "at_x": 0.1}],
)  # fmt: skip
def test_a_condition_alone_changes_the_outcome(usual, change) -> None:
    assert not np.array_equal(shaken(USUAL, {**CONDITIONS, **change}), usual)


def test_nothing_is_drawn_by_chance(usual) -> None:
    assert np.array_equal(shaken(USUAL), usual)

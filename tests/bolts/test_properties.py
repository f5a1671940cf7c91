"""Every property, option and condition of bolts changes what becomes of them by itself."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.bolts import kernels
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.bolts.properties import BOLT
from hpcdem.physics.fdem import convergence
from tests.blocks.support import model, rectangle
from tests.bolts.support import STEEL

USUAL = {
    **STEEL, "tensile_yield_force": 3e3, "compressive_yield_force": 2.5e3, "tension_failure_strain": 1e-4,
    "cohesion_rock_grout": 5e4, "cohesion_grout_bolt": 9e4, "friction_rock_grout": 20.0, "friction_grout_bolt": 15.0,
    "spacing": 1.2, "pretension_force": 500.0, "damp_factor": 0.05,
}  # fmt: skip
OTHER = {
    "density": 9000.0, "young": 100e9, "diameter": 0.03, "tensile_yield_force": 2e3, "compressive_yield_force": 1e3,
    "tension_failure_strain": 2e-4, "shear_stiffness_rock_bolt": 5e8, "grout_thickness": 0.02,
    "cohesion_rock_grout": 4e4, "cohesion_grout_bolt": 6e4, "friction_rock_grout": 10.0, "friction_grout_bolt": 5.0,
    "spacing": 2.0, "pretension_force": 700.0, "damp_factor": 0.2,
}  # fmt: skip


def shaken(properties: dict[str, float], condition: dict[str, float] | None = None, **options: object) -> np.ndarray:
    """What becomes of a bolt in a pressed block in motion: pulled at one end, pushed at the other. condition: of a node
    in between."""
    sim = model(rectangle(8, 3, 0.8, 0.3))
    sim.option(collision=False)
    sim.initial_stress(None, yy=-1e6)
    sim.move_constraint(np.arange(0, 20), 1)
    bolts = Bolts.of(sim)
    _, elements = bolts.create([(0.05, 0.12), (0.74, 0.17)], **{"length": 0.04, **options})
    bolts.assign(elements, properties)
    bolts.condition(np.array([3]), does_x=kernels.VELOCITY, at_x=-0.5)
    bolts.condition(np.array([len(bolts) - 4]), does_x=kernels.VELOCITY, at_x=-0.3)
    if condition is not None:
        bolts.condition(np.array([8]), **condition)
    convergence.advance(sim, 120)
    return np.concatenate([bolts.nodes["x"].ravel(), bolts.elements["force"], bolts.nodes["bond"]])


@pytest.fixture(scope="module")
def usual() -> np.ndarray:
    return shaken(USUAL)


def test_a_bolt_is_tensioned_up_to_its_strength_at_most() -> None:
    BOLT.derive({**USUAL, "pretension_force": 3e3})
    with pytest.raises(CommandError, match=r"above tensile_yield_force \(3000 N\), got 3001"):
        BOLT.derive({**USUAL, "pretension_force": 3001.0})


def test_all_of_them_are_here() -> None:
    assert set(USUAL) == set(OTHER) == {one.name for one in BOLT.properties}


@pytest.mark.parametrize("name", OTHER)
def test_a_property_alone_changes_the_outcome(usual, name) -> None:
    properties = dict(USUAL)
    if name.endswith(("rock_grout", "grout_bolt", "thickness")):  # of the two faces of the grout the weaker counts
        properties["cohesion_rock_grout" if name.endswith("grout_bolt") else "cohesion_grout_bolt"] = 5e5
        usual = shaken(properties)
    assert not np.array_equal(shaken({**properties, name: OTHER[name]}), usual)


@pytest.mark.parametrize(
    "options",
    [{"length": 0.05}, {"length": None, "segments": 9}, {"length": None}, {"grout": (0.2, 0.6)}, {"plate": True}],
)
def test_an_option_alone_changes_the_outcome(usual, options) -> None:
    other = shaken(USUAL, **options)
    assert other.shape != usual.shape or not np.array_equal(other, usual)


@pytest.mark.parametrize(
    "condition",
    [{"force_x": 2e3}, {"force_y": 2e3}, {"does_x": kernels.VELOCITY}, {"does_y": kernels.VELOCITY},
     {"does_x": kernels.ACCELERATION}, {"does_y": kernels.ACCELERATION}],
)  # fmt: skip
def test_a_condition_alone_changes_the_outcome(usual, condition) -> None:
    found = shaken(USUAL, condition)
    assert not np.array_equal(found, usual)
    for name in [f"at_{axis}" for axis in "xy" if f"does_{axis}" in condition]:
        assert not np.array_equal(shaken(USUAL, {**condition, name: 0.5}), found)


def test_nothing_is_drawn_by_chance(usual) -> None:
    assert np.array_equal(shaken(USUAL), usual)

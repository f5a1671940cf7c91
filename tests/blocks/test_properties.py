"""Properties that are left out, and properties that are changed."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.bolts.properties import BOLT
from hpcdem.physics.fdem.properties import COHESIVE, CONTACT_MOHR_COULOMB, Model
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.heat.properties import ISO_HEAT
from tests.blocks.support import model, rectangle

LEADERS = [
    (of, one.follows, one.name) for of in (BOLT, COHESIVE, CONTACT_MOHR_COULOMB, ISO_HEAT) for one in of.properties
    if one.follows
]  # fmt: skip


@pytest.mark.parametrize("of, leader, name", LEADERS)
def test_what_is_left_out_follows(of: Model, leader: str, name: str) -> None:
    """As it is assigned, and as the other is changed while both are equal."""
    needed = {p.name: 1.0 for p in of.properties if p.default is None and not p.optional}
    first = of.complete({**needed, leader: 3.0})
    assert first[name] == first[leader] == 3.0
    assert of.changed(first, {leader: 5.0})[name] == 5.0
    own = of.complete({**needed, leader: 3.0, name: 4.0})
    assert own[name] == 4.0 == of.changed(own, {leader: 5.0})[name]
    assert of.changed(first, {leader: 5.0, name: 3.0})[name] == 3.0
    each = of.changed({leader: np.array([3.0, 3.0]), name: np.array([3.0, 4.0])}, {leader: np.array([5.0, 6.0])})
    assert each[name].tolist() == [5.0, 4.0]


def test_leaders() -> None:
    assert {name for *_, name in LEADERS} == {
        "compressive_yield_force", "penalty_overlay", "penalty_shear", "conductivity_across",
    }  # fmt: skip


def test_changed_in_a_model() -> None:
    """Rock whose conductivity is changed stays isotropic; joints whose penalty is changed have one penalty."""
    sim = model(rectangle(2, 1, 1.0, 0.5))
    heat = Heat.of(sim)
    heat.assign(None, {"conductivity": 2.0, "capacity": 900.0})
    heat.adjust(None, {"conductivity": 3.0})
    assert heat.column("conductivity_across")[heat.row].tolist() == [3.0] * len(heat.row)
    joints = {"cohesion": 1e6, "tensile_strength": 1e6, "gf1": 10.0, "gf2": 50.0, "penalty_normal": 1e10}
    sim.joint_model(None, COHESIVE.name, {**joints, "penalty_shear": 5e9})
    sim.joint_property(None, {"penalty_normal": 2e10})
    values = sim.joint_rows.values(len(sim.joint_rows) - 1)
    assert (values["penalty_normal"], values["penalty_overlay"], values["penalty_shear"]) == (2e10, 2e10, 5e9)

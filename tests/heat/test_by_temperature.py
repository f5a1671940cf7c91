"""Moduli and strengths that follow tables over temperature: each changes what it should, at its temperature."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import TEMPERATURE, Over
from hpcdem.physics.heat.model import Heat
from tests.blocks.models import COHESIVE, WEAK
from tests.blocks.support import ROCK, rectangle, shaken
from tests.flow.support import at, inner
from tests.heat.support import GRANITE

E, NU = ROCK["young"], ROCK["poisson_ratio"]
STRONG = {"density": 2700.0, "young": E, "poisson_ratio": NU, "friction": 0.0, "cohesion": 5e6, "tensile": 4e6}
FALLING = [(20.0, 1.0), (220.0, 0.5), (420.0, 0.25)]
"""Over temperature, the part that is left."""


def over(sim: Blocks, name: str, most: float) -> Over:
    """A property that falls from this value."""
    sim.table(name, [(t, most * part) for t, part in FALLING])
    return Over(name, TEMPERATURE)


def body(model: str, values: dict[str, Any], warm: tuple[str, ...], kind: str = "mixed", left: float = 20.0,
         right: float = 20.0, dynamic: bool = False) -> Blocks:  # fmt: skip
    """A block 1.2 m long, at these temperatures in its halves; warm: properties that follow a table; no expansion."""
    sim = Blocks()
    sim.take_mesh(rectangle(6, 4, 1.2, 0.8, kind=kind))
    changes.element_model(sim, None, model, values | {name: over(sim, name, values[name]) for name in warm})
    heat = Heat.of(sim)
    heat.assign(None, GRANITE)
    heat.initial(None, left)
    heat.initial(np.flatnonzero(sim.mesh.points[:, 0] > 0.6 - 1e-9), right)
    sim.option(dynamic=dynamic, collision=False)
    sim.parts(thermal=False)
    return sim


def pulled(sim: Blocks, by: float) -> Blocks:
    """In equilibrium, its right end drawn so far, its ends on rollers."""
    sim.velocity_condition(at(sim, x=0.0), vx=0.0)
    sim.velocity_condition(at(sim, y=0.0), vy=0.0)
    sim.velocity_condition(at(sim, x=1.2), vx=by)
    equilibrium.solve_elastic(sim, cycles=1, steps=4)
    return sim


@pytest.mark.parametrize(("warmth", "part"), [(-50.0, 1.0), (20.0, 1.0), (120.0, 0.75), (320.0, 0.375), (900.0, 0.25)])
def test_stress_is_that_of_the_modulus_at_this_temperature(warmth: float, part: float) -> None:
    """Plane strain: E / (1 - nu^2) times the strain; the static solve and relaxation agree."""
    sim = pulled(body("mech_iso_elastic", ROCK, ("young",), left=warmth, right=warmth), 1.2e-6)
    expected = part * E / (1.0 - NU * NU) * 1e-6
    assert diagnostics.values(sim, "stress_xx") == pytest.approx(expected, rel=1e-5)
    assert diagnostics.unbalanced_ratio(sim) < 1e-9


def test_each_element_has_the_modulus_of_its_own_temperature() -> None:
    """One half is warm: both carry the same stress, its strain is twice that of the other."""
    sim = body("mech_iso_elastic", ROCK, ("young",), left=20.0, right=220.0, kind="quad")
    changes.element_model(sim, None, "mech_iso_elastic", {**ROCK, "poisson_ratio": 0.0, "young": Over("young", TEMPERATURE)})
    pulled(sim, 1.2e-6)
    x, move = sim.mesh.points[:, 0], diagnostics.values(sim, "displacement_x")
    warm, cold = (move[np.isclose(x, b)].mean() - move[np.isclose(x, a)].mean() for a, b in ((0.8, 1.2), (0.0, 0.4)))
    assert warm == pytest.approx(2.0 * cold, rel=1e-6)

"""Clay that dries, shrinks and cracks while it flies: a model for tests/parallel/test_models.py."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.physics.fdem import changes, diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import AXES, Over
from hpcdem.physics.moisture.model import Moisture
from tests.blocks.models import COHESIVE
from tests.blocks.support import rectangle, shaken
from tests.flow.support import at, inner
from tests.parallel.model import Found, Model

CLAY = {"density": 1800.0, "young": 1e7, "poisson_ratio": 0.3}
CRUST = {"friction": 20.0, "cohesion": 40e3, "gf1": 0.5, "gf2": 5.0, "penalty_normal": 1e8}
OVER = AXES.index("moisture")


def drying(sim: Blocks) -> None:
    """It flies to the right through the strips of the ranks; its surface has dry air before it."""
    sim.take_mesh(shaken(rectangle(16, 6, 1.6, 0.6, kind="mixed"), 0.2))
    sim.table("drier", [(0.05, 12e3), (0.4, 4e3)])
    changes.element_model(sim, None, "mech_iso_elastic", {**CLAY, "damp_factor": 0.05})
    sim.joint_model(inner(sim.mesh), COHESIVE, {**CRUST, "tensile_strength": Over("drier", OVER)})
    x = sim.mesh.points[:, 0]
    for one in np.unique(np.round(x, 1)):
        changes.set_velocity(sim, np.flatnonzero(np.round(x, 1) == one), vx=20.0 + 0.2 * one, vy=0.0)
    moisture = Moisture.of(sim)
    moisture.assign(None, {"diffusivity": 1e-6, "shrinkage": 0.1, "evaporation": 1e-2})
    moisture.initial(None, 0.4)
    sim.table("air", [(0.0, 0.3), (2e3, 0.05)])
    moisture.expose(None, environment="air")
    moisture.prescribe(at(sim, y=0.6), "air")
    moisture.clock(dt=20.0)
    diagnostics.account_energy(sim)


def more(sim: Blocks) -> None:
    """What happens to it."""
    moisture = Moisture.of(sim)
    if sim.clock.step == 100:
        changes.null(sim, np.flatnonzero(sim.mesh.centroids()[:, 1] < 0.1)[3:9])
    if sim.clock.step == 170:
        moisture.adjust(np.flatnonzero(sim.alive)[:20], {"diffusivity": 2e-6})
        moisture.clock(steps=2)


def result(sim: Blocks, notes: dict[str, Any]) -> Found:
    """All that may not depend on ranks."""
    found = {name: diagnostics.values(sim, name) for name in ("moisture", "suction", "stress_xx", "position_x")}
    found["counts"] = np.array(diagnostics.joint_counts(sim))
    found |= {f"account_{name}": np.array(value) for name, value in Moisture.of(sim).account().items()}
    found |= {f"energy_{name}": np.array(value) for name, value in diagnostics.energies(sim).items()}
    come = set(sim.number[sim.owned].tolist()) - notes.get("first", set())
    return {**found, "about": np.array([len(come), sim.rebuilds])}


def it_dries(found: Found) -> None:
    assert found["counts"][2] > 10 and np.nanmin(found["moisture"]) < 0.1 < 0.2 < np.nanmax(found["moisture"])
    assert found["account_relative"] < 1e-12 and found["account_removed"] > 0.0
    assert abs(found["energy_work_heat"]) > 1e3 and found["energy_relative"] < 1e-5


MODELS = {"drying": Model(drying, result, it_dries, more, steps=230, middle=143)}

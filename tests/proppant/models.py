"""Slurry that tears a block apart: models for tests/parallel/test_models.py."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.physics.fdem.groups import CHANNEL, FLOW_NODE
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.proppant.assignments import CONCENTRATION, RATE
from hpcdem.physics.proppant.model import Proppant
from tests.flow.models import bursting, it_tears, more_in_space, move, pumped, seeping, tearing, water_bursts
from tests.flow.models import more as burst_on
from tests.flow.models import result as of_fluid
from tests.parallel.model import Found, Model

SAND = {
    "proppant_density": 2650.0, "proppant_size": 4e-5, "proppant_concentration_limit": 0.35, "proppant_modulus": 1e6,
}  # fmt: skip


def sandy(sim: Blocks, pump: Any = bursting) -> None:
    """Slurry is pumped into a block that flies through the strips of the ranks, and tears it apart."""
    pump(sim)
    proppant = Proppant.of(sim)
    joints = Flow.of(sim).network.channels
    proppant.assign(joints[joints % 11 > 0], SAND)
    x = sim.mesh.points[:, 0]
    proppant.fill(np.flatnonzero(x < 0.5), 0.3)
    Flow.of(sim).fill(np.flatnonzero(x > 1.1), saturation=1.0)
    proppant.fill(np.flatnonzero(x > 1.1), 0.35)
    sim.table("sand", [(0.0, 0.1), (3e-3, 0.3), (1.0, 0.3)])
    proppant.prescribe(np.flatnonzero(np.hypot(*(sim.mesh.points - (0.8, 0.3)).T) < 0.12), CONCENTRATION, "sand")
    proppant.prescribe(np.flatnonzero(x < 0.05), RATE, 2e-4)


def sandy_wells(sim: Blocks) -> None:
    """The same by wells."""
    sandy(sim, pumped)


def sand_on(sim: Blocks) -> None:
    """What happens to it."""
    burst_on(sim)
    proppant = Proppant.of(sim)
    if sim.clock.step == 400:
        proppant.adjust({"proppant_concentration_limit": 0.33, "proppant_size": 5e-5})
    if sim.clock.step == 800:
        proppant.remove_conditions(np.flatnonzero(sim.mesh.points[:, 0] < 0.05))
        sim.parts(proppant=False)
    if sim.clock.step == 850:
        sim.parts(proppant=True)


def sandy_in_space(sim: Blocks) -> None:
    """Slurry is pumped into a bar of tetrahedra that flies through the strips of the ranks, and tears it apart."""
    tearing(sim)
    proppant = Proppant.of(sim)
    joints = Flow.of(sim).network.channels
    proppant.assign(joints[joints % 11 > 0], SAND)
    x = sim.mesh.points[:, 0]
    proppant.fill(np.flatnonzero(x < 0.5), 0.3)
    Flow.of(sim).fill(np.flatnonzero(x > 1.1), saturation=1.0)
    proppant.fill(np.flatnonzero(x > 1.1), 0.35)
    sim.table("sand", [(0.0, 0.1), (3e-4, 0.3), (1.0, 0.3)])
    proppant.prescribe(np.flatnonzero((x > 0.3) & (x < 0.95)), CONCENTRATION, "sand")
    proppant.prescribe(np.flatnonzero(x < 0.05), RATE, 2e-5)


def sand_on_in_space(sim: Blocks) -> None:
    """What happens to it."""
    more_in_space(sim)
    if sim.clock.step == 200:
        Proppant.of(sim).adjust({"proppant_concentration_limit": 0.33, "proppant_size": 5e-5})
    if sim.clock.step in (330, 350):
        sim.parts(proppant=sim.clock.step == 350)


def muddy(sim: Blocks) -> None:
    """Mud rises in a block that stands still, then moves, and settles in it."""
    seeping(sim)
    proppant = Proppant.of(sim)
    proppant.assign(None, {**SAND, "proppant_size": 5e-6, "proppant_size_factor": 1.0, "viscosity_power": -1.0,
                           "aperature_factor": 0.3})  # fmt: skip
    proppant.prescribe(np.flatnonzero(sim.mesh.points[:, 0] == 0.0), CONCENTRATION, 0.15)


def result(sim: Blocks, notes: dict[str, Any]) -> Found:
    """All that may not depend on ranks."""
    found = of_fluid(sim, notes)
    flow, proppant = Flow.of(sim), Proppant.of(sim)
    for name in ("concentration", "proppant", "pack_pressure"):
        found[name] = flow.values(FLOW_NODE, name)
    found["along"] = flow.values(CHANNEL, "concentration")
    found.update({f"sand_{name}": np.array(value) for name, value in proppant.account().items()})
    found["sub_steps"] = np.array([proppant.cycles, proppant.sub_steps, proppant.time])
    return found


def sand_moves(found: Found) -> None:
    c = found["concentration"]
    assert (c > 0.01).sum() > 10 and np.ptp(c) > 0.1
    assert found["sand_relative"] < 1e-12 and found["sand_came"] > 0.0 and found["sand_stored"] > 0.0


def sand_bursts(found: Found) -> None:
    water_bursts(found)
    sand_moves(found)
    assert found["sand_packed"] > 0.0 and found["sand_removed"] > 0.0 and found["pack_pressure"].max() > 0.0


def sand_tears(found: Found) -> None:
    it_tears(found)
    sand_moves(found)
    assert found["sand_packed"] > 0.0 and found["sand_removed"] > 0.0 and found["pack_pressure"].max() > 0.0


def mud_rises(found: Found) -> None:
    wet = found["flow-node_saturation"]
    assert (wet == 1.0).sum() > 5 and ((wet > 0.0) & (wet < 1.0)).sum() > 20
    sand_moves(found)


# Checkpoints after excavation, and while the blocks stand still.
MODELS = {
    "bursting with sand": Model(sandy, result, sand_bursts, sand_on, steps=1100, middle=703, slow=True),
    "sand by wells": Model(sandy_wells, result, sand_moves, sand_on, steps=1100, middle=703, slow=True),
    "sand in space": Model(sandy_in_space, result, sand_tears, sand_on_in_space, steps=900, middle=303, slow=True),
    "mud": Model(muddy, result, mud_rises, move, steps=1300, middle=703, slow=True),
}

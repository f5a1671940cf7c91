"""Blocks with heat in them."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.physics.fdem.groups import FLOW_NODE
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.fluid import FluidHeat
from hpcdem.physics.heat.model import Heat
from tests.blocks.support import ROCK, model

GRANITE = {"conductivity": 2.5, "capacity": 1000.0}
WATER = {"conductivity": 0.6, "capacity": 4200.0, "transfer_coeficient": 200.0}
RHO_C = 1000.0 * 4200.0
"""Of the water."""
DIFFUSIVITY = GRANITE["conductivity"] / (ROCK["density"] * GRANITE["capacity"])


def standing(mesh: Mesh, **changes: float) -> tuple[Blocks, Heat]:
    """Blocks that do not move, through which heat flows."""
    sim = model(mesh)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, **changes})
    sim.parts(mechanical=False)
    return sim, heat


def with_heat(sim: Blocks, water: dict[str, float], **rock: float) -> tuple[Heat, FluidHeat]:
    """Rock and water of channels that are there have heat."""
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, **rock})
    fluid = heat.of_fluid()
    fluid.assign(None, {**WATER, **water})
    return heat, fluid


def of_nodes(flow: Flow, name: str = "temperature") -> np.ndarray:
    """Of all flow nodes."""
    return flow.values(FLOW_NODE, name)


def step(sim: Blocks, time: float, count: int) -> None:
    """So many steps of heat beside water that flows on as it does now."""
    sim.parts(hydraulic=False)
    sim.heat_clock(dt=time / count)
    for _ in range(count):
        sim.step()


def until(sim: Blocks, time: float) -> None:
    """To this time of heat, in equal steps near those of the model."""
    sim.close_model()
    heat = Heat.of(sim)
    steps = int(np.ceil((time - heat.time) / heat.dt))
    sim.heat_clock(dt=(time - heat.time) / steps)
    for _ in range(steps):
        sim.step()


def temperatures(sim: Blocks) -> np.ndarray:
    """Of all nodes."""
    from hpcdem.physics.fdem import diagnostics

    return diagnostics.values(sim, "temperature")


def expose(heat: Heat, faces: Any, **conditions: Any) -> None:
    """Conditions of faces."""
    heat.expose(faces, **conditions)


def faces_at(mesh: Mesh, x: float) -> np.ndarray:
    """Outer faces on the line of this x."""
    edges = mesh.edges()
    on = ~edges.inner & (np.abs(mesh.points[edges.points][:, :, 0] - x) < 1e-9).all(axis=1)
    return edges.faces[on, 0]

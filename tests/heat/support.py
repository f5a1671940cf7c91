"""Blocks with heat in them."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.heat.model import Heat
from tests.blocks.support import ROCK, model

GRANITE = {"conductivity": 2.5, "capacity": 1000.0}
DIFFUSIVITY = GRANITE["conductivity"] / (ROCK["density"] * GRANITE["capacity"])


def standing(mesh: Mesh, **changes: float) -> tuple[Blocks, Heat]:
    """Blocks that do not move, through which heat flows."""
    sim = model(mesh)
    heat = Heat.of(sim)
    heat.assign(None, {**GRANITE, **changes})
    sim.parts(mechanical=False)
    return sim, heat


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

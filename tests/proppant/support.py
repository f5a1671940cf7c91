"""Slots full of slurry, in blocks that stand still."""

from __future__ import annotations

import numpy as np

from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.proppant.model import Proppant
from tests.blocks.support import rectangle
from tests.flow.support import WATER, at, standing

OIL = {**WATER, "viscosity": 1e-4, "aperature_initial": 5e-3}
"""Viscosity 0.1 Pa s."""
SAND = {"proppant_density": 2650.0, "proppant_size": 5e-4, "proppant_concentration_limit": 0.6}


def slot(n: int, height: float, fluid: dict[str, float] = OIL, **changes: float) -> tuple[Blocks, Flow, Proppant]:
    """A straight row of n channels along y, from (0, 0) up, full of fluid, which may carry sand."""
    width = height / n
    mesh = rectangle(2, n, 2.0 * width, height, x0=-width)
    edges = mesh.edges()
    on = edges.inner & (np.abs(mesh.points[edges.points][:, :, 0]) < 1e-9).all(axis=1)
    joints = edges.faces[on, 0]
    sim, flow = standing(mesh, joints, **fluid)
    sim.gravity(0.0, -9.81)
    flow.fill(None, pressure=1e5)
    proppant = Proppant.of(sim)
    proppant.assign(joints, {**SAND, **changes})
    return sim, flow, proppant


def nodes_up(sim: Blocks) -> np.ndarray:
    """Nodes of the row, from below."""
    nodes = at(sim, x=0.0)
    return nodes[np.argsort(sim.mesh.points[nodes, 1])]


def profile(sim: Blocks, flow: Flow, name: str = "concentration") -> np.ndarray:
    """A quantity of the nodes of the row, from below."""
    return flow.values("flow-node", name, nodes_up(sim))

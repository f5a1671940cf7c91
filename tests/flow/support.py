"""Networks of channels in blocks that stand still, or move."""

from __future__ import annotations

import numpy as np

from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.physics.flow.model import Flow
from tests.blocks.support import model, rectangle

WATER = {
    "fluid_density": 1000.0, "fluid_bulk": 2.2e9, "viscosity": 1e-6, "aperature_initial": 1e-5,
    "aperature_minumum": 1e-6,
}  # fmt: skip


def inner(mesh: Mesh) -> np.ndarray:
    """All joints."""
    edges = mesh.edges()
    return edges.faces[edges.inner][:, 0]


def standing(mesh: Mesh, joints: np.ndarray | None = None, **changes: float) -> tuple[Blocks, Flow]:
    """Blocks that do not move, with channels on these joints (None: all)."""
    sim = model(mesh)
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, **changes})
    sim.parts(mechanical=False)
    return sim, flow


def line(n: int, length: float, **changes: float) -> tuple[Blocks, Flow]:
    """A straight row of n channels along x, from (0, 0)."""
    mesh = rectangle(n, 2, length, 2.0 * length / n, y0=-length / n)
    edges = mesh.edges()
    on = edges.inner & (np.abs(mesh.points[edges.points][:, :, 1]) < 1e-9).all(axis=1)
    return standing(mesh, edges.faces[on, 0], **changes)


def at(sim: Blocks, x: float | None = None, y: float | None = None) -> np.ndarray:
    """Points of the mesh with this x or y."""
    points = sim.mesh.points
    found = np.ones(len(points), bool)
    for axis, value in ((0, x), (1, y)):
        if value is not None:
            found &= np.abs(points[:, axis] - value) < 1e-9
    return np.flatnonzero(found)


def hold(flow: Flow, nodes: np.ndarray, pressure: float | str) -> None:
    """Their pressure [Pa] is prescribed."""
    flow.prescribe(nodes, kernels.PRESSURE, pressure)


def run(sim: Blocks, steps: int) -> None:
    """So many cycles."""
    for _ in range(steps):
        sim.step()


def until(sim: Blocks, time: float) -> None:
    """To this flow time [s] or a little further."""
    while sim.clock.time < time:
        sim.step()


def over(sim: Blocks, time: float, steps: int) -> Coupled:
    """So much time [s] in so many equal implicit steps at most."""
    flow = Flow.of(sim)
    end = flow.time + time
    flow.implicit_dt = 0.0
    with Coupled(sim, time / steps) as run:
        while flow.time < end * (1.0 - 1e-12):
            run.advance(end)
    return run

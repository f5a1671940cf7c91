"""Liners on blocks, and on none: beams and rings whose rock was taken out."""

from __future__ import annotations

import math

import numpy as np

from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.liners.model import Liners
from tests.blocks.support import joined, model, near, rectangle

SHOTCRETE = {
    "density": 2400.0, "young": 20e9, "poisson_ratio": 0.2, "thickness": 0.1, "normal_stiffness": 1e10,
    "shear_stiffness": 1e10,
}  # fmt: skip


def annulus(inner: float, outer: float, around: int, layers: int, grow: float = 1.0) -> Mesh:
    """Quads between two circles around the origin, each ring `grow` times as thick as the one before; the points of
    each ring lie one after the other, the inner one first, from the x axis on."""
    steps = np.concatenate([[0.0], np.cumsum(grow ** np.arange(layers))])
    r = inner + (outer - inner) * steps / steps[-1]
    angle = 2.0 * math.pi * np.arange(around) / around
    points = (r[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)).reshape(-1, 2)
    cells = [
        (k * around + i, (k + 1) * around + i, (k + 1) * around + (i + 1) % around, k * around + (i + 1) % around)
        for k in range(layers)
        for i in range(around)
    ]
    return Mesh.of(points, cells)


def inner_faces(mesh: Mesh, radius: float) -> np.ndarray:
    """Free faces on a circle around the origin."""
    edges = mesh.edges()
    on = (np.abs(np.hypot(*mesh.points[edges.points].reshape(-1, 2).T).reshape(-1, 2) - radius) < 1e-9).all(axis=1)
    return edges.faces[on & ~edges.inner, 0]


def bare(mesh: Mesh, faces: np.ndarray, dynamic: bool = False, **properties: float) -> tuple[Blocks, Liners]:
    """A liner on faces of a mesh that was taken out afterwards: nothing holds it. A block far away is left."""
    far = rectangle(1, 1, 1.0, 1.0, x0=1e3)
    sim = model(joined(mesh, far))
    sim.option(dynamic=dynamic, collision=False)
    sim.move_constraint(None, 1)
    liners = Liners.of(sim)
    _, elements = liners.create(faces)
    liners.assign(elements, {**SHOTCRETE, **properties})
    changes.null(sim, np.arange(len(mesh.cells)))
    return sim, liners


def beam(count: int, length: float, dynamic: bool = False, **properties: float) -> tuple[Blocks, Liners]:
    """So many elements from (0, 0) to (-length, 0): node 0 is at the origin, the free side above."""
    mesh = rectangle(count, 1, length, 0.2, x0=-length, y0=-0.2)
    return bare(mesh, near(mesh, 1, 0.0), dynamic, **properties)


def stiffness(properties: dict[str, float]) -> tuple[float, float]:
    """E A and E I in plane strain [N/m, N m2/m] of a shell."""
    e, t = properties["young"] / (1.0 - properties["poisson_ratio"] ** 2), properties["thickness"]
    return e * t, e * t**3 / 12.0


def state(liners: Liners) -> dict[str, np.ndarray]:
    """All that there is to know of liners, to be compared bit by bit."""
    return {
        **{f"node_{name}": values for name, values in liners.nodes.items()},
        **{f"element_{name}": values for name, values in liners.elements.items()},
        "work": liners.work.copy(), "on_rock": liners._on_rock.copy(),
    }  # fmt: skip

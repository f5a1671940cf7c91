"""Networks of triangular channels in tetrahedra."""

from __future__ import annotations

import numpy as np

from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow.model import Flow
from hpcdem.pre.mesh import structured_space
from tests.flow.support import WATER, inner
from tests.space.support import body


def standing(mesh: Mesh, joints: np.ndarray | None = None, **changes: float) -> tuple[Blocks, Flow]:
    """Tetrahedra that do not move, with channels on these joints (None: all)."""
    sim = body(mesh)
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, **changes})
    sim.parts(mechanical=False)
    return sim, flow


def on_plane(mesh: Mesh, axis: int, at: float) -> np.ndarray:
    """Joints whose corners have this coordinate."""
    joints = inner(mesh)
    return joints[(np.abs(mesh.points[mesh.face_points(joints)][:, :, axis] - at) < 1e-9).all(axis=1)]


def points_at(mesh: Mesh, **at: float) -> np.ndarray:
    """Points with these coordinates."""
    found = np.ones(len(mesh.points), bool)
    for axis, value in at.items():
        found &= np.abs(mesh.points[:, "xyz".index(axis)] - value) < 1e-9
    return np.flatnonzero(found)


def ring(radii: np.ndarray, parts: int, heights: np.ndarray, turn: float = 2.0 * np.pi) -> Mesh:
    """Between circles of these radii, with so many parts around, or in a sector `turn`; diagonals both ways in turn."""
    whole = turn == 2.0 * np.pi
    angle = np.linspace(0.0, turn, parts + 1)[: parts if whole else None]
    points = np.stack([np.outer(radii, np.cos(angle)), np.outer(radii, np.sin(angle))], axis=-1).reshape(-1, 2)
    i, j = (k.reshape(-1) for k in np.meshgrid(np.arange(len(radii) - 1), np.arange(parts), indexing="ij"))
    m = len(angle)
    a, b, c, d = i * m + j, (i + 1) * m + j, (i + 1) * m + (j + 1) % m, i * m + (j + 1) % m
    even = (i + j) % 2 == 0
    one = np.where(even[:, None], np.column_stack([a, b, c]), np.column_stack([a, b, d]))
    two = np.where(even[:, None], np.column_stack([a, c, d]), np.column_stack([b, c, d]))
    return structured_space.layers(points, np.concatenate([one, two]), heights)

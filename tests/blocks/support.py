"""Meshes and models for the tests of blocks."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem import changes as changes_
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks

EVERY_KIND = pytest.mark.parametrize(
    "kind", ["mixed", *(pytest.param(k, marks=pytest.mark.slow) for k in ("cross", "quad"))]
)
"""Of elements in the plane; `mixed` has both."""
ROCK = {"density": 2700.0, "young": 50e9, "poisson_ratio": 0.25}


def rectangle(
    nx: int, ny: int, width: float, height: float, x0: float = 0.0, y0: float = 0.0, kind: str = "cross"
) -> Mesh:
    """nx x ny cells; kind: "cross" (two triangles, diagonals in turn), "quad", "mixed" (both in turn)."""
    x, y = np.meshgrid(np.linspace(0.0, width, nx + 1), np.linspace(0.0, height, ny + 1), indexing="ij")
    points = np.column_stack([x.ravel() + x0, y.ravel() + y0])
    cells = []
    for i in range(nx):
        for j in range(ny):
            a, b = i * (ny + 1) + j, (i + 1) * (ny + 1) + j
            c, d = b + 1, a + 1
            if kind == "quad" or (kind == "mixed" and (i + j) % 2):
                cells.append((a, b, c, d))
            elif (i + j) % 2:
                cells += [(a, b, c, -1), (a, c, d, -1)]
            else:
                cells += [(a, b, d, -1), (b, c, d, -1)]
    return Mesh.of(points, cells)


def shaken(mesh: Mesh, amount: float, seed: int = 1) -> Mesh:
    """Inner points moved by up to `amount` of the shortest edge."""
    rng = np.random.default_rng(seed)
    edges = mesh.edges()
    way = mesh.points[edges.points[:, 1]] - mesh.points[edges.points[:, 0]]
    step = amount * float(np.hypot(way[:, 0], way[:, 1]).min())
    points = mesh.points.copy()
    inner = np.ones(len(points), bool)
    inner[edges.points[~edges.inner]] = False
    points[inner] += rng.uniform(-step, step, (int(inner.sum()), 2))
    return Mesh.of(points, mesh.cells)


def joined(*meshes: Mesh) -> Mesh:
    """Several bodies in one mesh."""
    points, cells, at = [], [], 0
    for mesh in meshes:
        points.append(mesh.points)
        cells.append(np.where(mesh.cells >= 0, mesh.cells + at, -1))
        at += len(mesh.points)
    return Mesh.of(np.concatenate(points), np.concatenate(cells))


def near(mesh: Mesh, axis: int, at: float, inner: bool = False) -> np.ndarray:
    """Faces (both of an inner edge) that lie on the line x = at (axis 0) or y = at (1)."""
    edges = mesh.edges()
    on = (np.abs(mesh.points[edges.points][:, :, axis] - at) < 1e-9).all(axis=1) & (edges.inner == inner)
    faces = edges.faces[on]
    return faces[faces >= 0]


def model(mesh: Mesh, **options) -> Blocks:
    """A model of rock on one rank."""
    sim = Blocks(**options)
    sim.take_mesh(mesh)
    changes_.element_model(sim, None, "mech_iso_elastic", ROCK)
    return sim


JOINT = {
    "friction": 30.0, "cohesion": 10e6, "tensile_strength": 2e6, "gf1": 50.0, "gf2": 500.0, "penalty_normal": 500e9,
}  # fmt: skip


def jointed(sim: Blocks, **changes: float) -> Blocks:
    """A joint on every inner edge."""
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", {**JOINT, **changes})
    return sim

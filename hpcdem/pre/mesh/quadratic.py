"""Meshes of six-node triangles from meshes of triangles."""

from __future__ import annotations

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.macros import SIX_NODES
from hpcdem.physics.fdem.mesh import Mesh


def quadratic(mesh: Mesh) -> Mesh:
    """The mesh with a six-node triangle in place of each triangle, its sides straight. The four parts of triangle e are
    the elements 4 e to 4 e + 3; groups, layers and cracks stay where they are. CommandError for other elements."""
    if mesh.dim == 3 or (mesh.cells[:, 3] >= 0).any() or len(mesh.macros):
        raise CommandError("six-node triangles come from a mesh of triangles alone")
    edges, n = mesh.edges(), len(mesh.points)
    between = np.zeros(4 * len(mesh.cells), np.int64)
    for side in range(2):
        faces = edges.faces[:, side]
        between[faces[faces >= 0]] = n + np.flatnonzero(faces >= 0)
    nodes = np.column_stack([mesh.cells[:, :3], between.reshape(-1, 4)[:, :3]])

    def halves(pairs: np.ndarray) -> np.ndarray:
        middle = n + mesh.find_edges(edges, pairs)
        return np.concatenate([np.column_stack([pairs[:, k], middle]) for k in range(2)])

    def parts(rows: np.ndarray) -> np.ndarray:
        found: np.ndarray = (4 * rows[:, None] + np.arange(4)).reshape(-1)
        return found

    return Mesh.of(
        np.concatenate([mesh.points, mesh.points[edges.points].mean(axis=1)]),
        nodes[:, SIX_NODES].reshape(-1, 3),
        {name: {group: parts(rows) for group, rows in groups.items()} for name, groups in mesh.groups.items()},
        {name: halves(pairs) for name, pairs in mesh.layers.items()},
        halves(mesh.cracks),
        np.tile(mesh.crack_sets, 2),
        np.column_stack([nodes, 4 * np.arange(len(mesh.cells))]),
    )

"""Meshes of six-node triangles from meshes of triangles."""

from __future__ import annotations

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.elements.kind import SIX_NODE_TRIANGLE
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.pre.mesh.remade import Moved, Remade, named


def quadratic(mesh: Mesh) -> Remade:
    """Return the mesh with each triangle replaced by a six-node triangle with straight sides. The four parts of
    triangle e are the elements 4 e to 4 e + 3; the point on edge k follows the existing points, at index k. Groups,
    layers and cracks do not change. CommandError for other elements.
    """
    if mesh.dim == 2 and len(mesh.macros):
        raise CommandError("the mesh already has six-node triangles")
    if mesh.dim == 3 or (mesh.cells[:, 3] >= 0).any():
        raise CommandError("six-node triangles need a mesh of triangles only")
    edges, n = mesh.edges(), len(mesh.points)
    between = np.zeros(4 * len(mesh.cells), np.int64)
    for side in range(2):
        faces = edges.faces[:, side]
        between[faces[faces >= 0]] = n + np.flatnonzero(faces >= 0)
    nodes = np.column_stack([mesh.cells[:, :3], between.reshape(-1, 4)[:, :3]])
    number, parent = np.arange(n), np.repeat(np.arange(len(mesh.cells)), 4)
    ends = np.sort(edges.points, axis=1).tolist()
    moved = Moved(number, pieces={(a, b): [(a, n + k), (b, n + k)] for k, (a, b) in enumerate(ends)})
    made = named(
        mesh,
        np.concatenate([mesh.points, mesh.points[edges.points].mean(axis=1)]),
        np.insert(nodes[:, np.array(SIX_NODE_TRIANGLE.cells)].reshape(-1, 3), 3, -1, axis=1),
        parent,
        moved,
        np.column_stack([nodes, 4 * np.arange(len(mesh.cells))]),
    )
    return Remade(made, number, parent, moved)

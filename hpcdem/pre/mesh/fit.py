"""Check that the faces of a mesh fit together: find free faces that lie on others, and why they are not connected."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from hpcdem.numerics.clusters import spots
from hpcdem.physics.fdem.connectivity import bodies
from hpcdem.physics.fdem.mesh import Mesh

TOLERANCE = 1e-3
"""Fraction of the shortest edge on a surface: points that are nearer to each other are one."""
OPPOSITE = 0.999
"""Faces that lie on each other look away from each other: the cosine of their normals is below minus this."""
LEVEL = 0.5
"""Smallest cosine between the normals of two triangles that form a quad."""
PLACES = 3
"""Number of positions that a message names."""


@dataclass(frozen=True)
class Free:
    """Faces (n,) without a partner: points (n, dim), at (n, dim, dim) [m], outward normals (n, dim), body (n,)."""

    mesh: Mesh
    faces: np.ndarray
    points: np.ndarray
    at: np.ndarray
    normal: np.ndarray
    body: np.ndarray
    bodies: int

    def of(self, rows: np.ndarray) -> Free:
        """Select some of the faces."""
        return Free(
            self.mesh,
            self.faces[rows],
            self.points[rows],
            self.at[rows],
            self.normal[rows],
            self.body[rows],
            self.bodies,
        )

    def tolerance(self) -> float:
        """TOLERANCE of the shortest edge [m]."""
        edges = np.roll(self.at, -1, axis=1) - self.at
        return TOLERANCE * float(np.sqrt((edges * edges).sum(axis=2)).min()) if len(self.faces) else 0.0


def free_faces(mesh: Mesh) -> Free:
    """Return all faces on a surface."""
    partner = mesh.face_partners()
    body = bodies(partner)
    real = np.ones(len(partner), bool)
    real[3::4] = mesh.cells[:, 3] >= 0
    faces = np.flatnonzero(real & (partner < 0))
    points = mesh.face_points(faces)
    at = mesh.points[points]
    edges = at[:, 1] - at[:, 0]
    normal = np.column_stack([edges[:, 1], -edges[:, 0]]) if mesh.dim == 2 else np.cross(edges, at[:, 2] - at[:, 0])
    normal = normal / np.sqrt((normal * normal).sum(axis=1))[:, None]
    return Free(mesh, faces, points, at, normal, body[faces // 4], int(body.max(initial=-1)) + 1)


def lying(free: Free, tolerance: float) -> np.ndarray:
    """(m, 2) rows of faces that lie on each other, back to back, with more than their rims."""
    pairs = _near(free, tolerance)
    i, j = pairs.T
    keep = (free.normal[i] * free.normal[j]).sum(axis=1) < -OPPOSITE
    i, j = i[keep], j[keep]
    middle = free.at[i].mean(axis=1)[:, None]
    keep = np.abs(((free.at[j] - middle) * free.normal[i][:, None]).sum(axis=2)).max(axis=1) <= tolerance
    i, j = i[keep], j[keep]
    keep = np.ones(len(i), bool)
    for side in range(1 if free.mesh.dim == 2 else 6):
        of = (i, j)[side // 3]
        axis = free.at[of, (side + 1) % free.mesh.dim] - free.at[of, side % free.mesh.dim]
        if free.mesh.dim == 3:
            axis = np.cross(free.normal[of], axis)
        axis = axis / np.sqrt((axis * axis).sum(axis=1))[:, None]
        one, other = ((free.at[rows] * axis[:, None]).sum(axis=2) for rows in (i, j))
        common = np.minimum(one.max(axis=1), other.max(axis=1)) - np.maximum(one.min(axis=1), other.min(axis=1))
        keep &= common > 2.0 * tolerance
    return np.column_stack([i[keep], j[keep]])


def _near(free: Free, tolerance: float) -> np.ndarray:
    """(m, 2) rows, i < j, of faces whose circles about their middles touch; small faces and large ones by turns."""
    middle = free.at.mean(axis=1)
    radius = np.sqrt(((free.at - middle[:, None]) ** 2).sum(axis=2)).max(axis=1)
    size = np.floor(np.log2(radius)).astype(np.int64)
    out = [np.empty((0, 2), np.int64)]
    for one in np.unique(size):
        small, as_large = np.flatnonzero(size == one), np.flatnonzero(size >= one)
        reach = radius[as_large] + radius[small].max() + tolerance
        found = cKDTree(middle[small]).query_ball_point(middle[as_large], reach)
        i = np.repeat(as_large, [len(near) for near in found])
        j = small[np.concatenate([np.array(near, np.int64) for near in found])]
        new = (size[i] > one) | (i < j)
        out.append(np.sort(np.column_stack([i[new], j[new]]), axis=1))
    return np.concatenate(out)


def cut_otherwise(free: Free, corners: np.ndarray) -> np.ndarray:
    """(m, 4) rows of faces in space, with these spots of their corners (n, 3): two of them are a quad, and two others,
    back to back with them, the same quad, cut along the other diagonal."""
    ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    quads, rows, cuts = [np.empty((0, 4), np.int64)], [np.empty((0, 2), np.int64)], [np.empty((0, 2), np.int64)]
    for step in (1, 2, 3):  # more than four faces seldom meet in an edge
        a, b = order[: len(order) - step], order[step:]
        same = (ends[a] == ends[b]).all(axis=1)
        i, j = a[same] // 3, b[same] // 3
        lone = [corners[t, (at % 3 + 2) % 3] for t, at in ((i, a[same]), (j, b[same]))]
        real = lone[0] != lone[1]
        cut = ends[a[same]][real]
        quads.append(np.sort(np.column_stack([cut, lone[0][real], lone[1][real]]), axis=1))
        rows.append(np.column_stack([i, j])[real])
        cuts.append(cut)
    quad, row, cut = np.concatenate(quads), np.concatenate(rows), np.concatenate(cuts)
    if not len(quad):
        return np.empty((0, 4), np.int64)
    key = np.unique(quad, axis=0, return_inverse=True)[1].reshape(-1)
    order = np.lexsort((cut[:, 1], cut[:, 0], key))
    a, b = order[:-1], order[1:]
    found = (key[a] == key[b]) & (cut[a] != cut[b]).any(axis=1)
    quads_found = np.column_stack([row[a[found]], row[b[found]]])
    n = np.moveaxis(free.normal[quads_found], 1, 0)
    level = ((n[0] * n[1]).sum(axis=1) > LEVEL) & ((n[2] * n[3]).sum(axis=1) > LEVEL)
    element = free.faces[quads_found] // 4
    one = (element == element[:, :1]).all(axis=1)  # the four faces of a tetrahedron are two such quads
    return quads_found[level & ~one & (((n[0] + n[1]) * (n[2] + n[3])).sum(axis=1) < 0.0)]


@dataclass(frozen=True)
class Fit:
    """bodies: how many; places (k, dim) [m] of faces that lie on others: own: with the same corners, each with points
    of its own; cut: of quads that are cut along the other diagonal; parts: on parts of others."""

    bodies: int
    own: np.ndarray
    cut: np.ndarray
    parts: np.ndarray

    def description(self) -> str:
        """Describe what does not fit; "" if everything does."""
        found = [
            f"{len(at)} {what}, at {places(at)}"
            for at, what in (
                (self.own, "pairs with separate points"),
                (self.cut, "quads that are cut along different diagonals"),
                (self.parts, "pairs of other sizes or shapes (hanging points)"),
            )
            if len(at)
        ]
        if not found:
            return ""
        return f"coincident faces are not connected: {'; '.join(found)}. Use mesh glue to join them"


def fit(mesh: Mesh, since: int = 0) -> Fit:
    """Compare the faces of elements from `since` on with each other and with earlier faces."""
    free = free_faces(mesh)
    empty = np.empty((0, mesh.dim))
    tolerance = free.tolerance()
    if not len(free.faces):
        return Fit(free.bodies, empty, empty, empty)
    spot = spots(mesh.points, tolerance, np.unique(free.points))
    corners = spot[free.points]
    pairs = lying(free, tolerance)
    new = free.faces // 4 >= since
    pairs = pairs[new[pairs].any(axis=1)]
    same = (np.sort(corners[pairs[:, 0]], axis=1) == np.sort(corners[pairs[:, 1]], axis=1)).all(axis=1)
    quads = cut_otherwise(free, corners) if mesh.dim == 3 else np.empty((0, 4), np.int64)
    quads = quads[new[quads].any(axis=1)]
    turned = np.isin(pairs, quads).all(axis=1)
    middle = free.at.mean(axis=1)
    return Fit(
        free.bodies, middle[pairs[same, 0]], middle[quads].mean(axis=1), middle[pairs[~same & ~turned]].mean(axis=1)
    )


def places(at: np.ndarray) -> str:
    """The first of these (k, dim), in words."""
    text = [f"({', '.join(f'{c:g}' for c in one)})" for one in at[:PLACES]]
    return ", ".join(text) + (" and others" if len(at) > PLACES else "")

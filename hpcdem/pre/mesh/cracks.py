"""Cracks and layers on a mesh that was made without them: which of its edges, in space faces, follow a line or
surface."""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.physics.fdem.connectivity import Edges
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.pre.mesh.fractures import Fractures
from hpcdem.pre.mesh.geometry import Curve, arc_of, distance_to_segment
from hpcdem.pre.mesh.solids import Disc, on_surface

TOLERANCE = 1e-6
"""Largest distance of an edge from a line on which it lies, over its own length."""
STRAYING = 4.0
"""Factor by which the cost of a path along edges grows with the square of its distance from the trace, in edge
lengths."""


def _sides(mesh: Mesh) -> Edges:
    """The edges, in space faces, along which elements can part: none inside a macro-element."""
    edges = mesh.edges()
    sides = ~mesh.inside_macros(edges.faces[:, 0])
    return Edges(edges.faces[sides], edges.points[sides])


def edges_on(mesh: Mesh, curves: Sequence[Curve], tolerance: float | None = None) -> np.ndarray:
    """Return the end points (k, 2) i8 of the edges that lie on curves: both ends do, and for straight segments the
    middle too.

    tolerance: [m]; None: TOLERANCE times the length of the edge. The chord of an arc lies on it if its ends do and it
    spans the shorter arc between them. Edges inside a six-node triangle are excluded.
    """
    edges = _sides(mesh)
    a, b = mesh.points[edges.points[:, 0]], mesh.points[edges.points[:, 1]]
    length = np.hypot(*(b - a).T)
    near = TOLERANCE * length if tolerance is None else np.full(len(length), tolerance)
    on = np.zeros(len(edges), bool)
    for curve in curves:
        for i in range(curve.segments):
            p, q, bulge = curve.segment(i)
            box = _box(p, q, bulge)
            rows = np.flatnonzero(
                (np.minimum(a, b) >= box[0] - near[:, None]).all(axis=1)
                & (np.maximum(a, b) <= box[1] + near[:, None]).all(axis=1)
            )
            far = [distance_to_segment(p, q, bulge, x[rows]) for x in (a, b, 0.5 * (a + b))]
            allowed = near[rows].copy()
            good = (far[0] <= allowed) & (far[1] <= allowed)
            if bulge != 0.0:
                radius = arc_of(p, q, bulge)[1]
                half = np.minimum(0.5 * length[rows], radius)
                allowed += radius - np.sqrt(radius * radius - half * half)
            on[rows] |= good & (far[2] <= allowed * (1.0 + 1e-9))
    return np.sort(edges.points[on], axis=1)


def _box(p: np.ndarray, q: np.ndarray, bulge: float) -> tuple[np.ndarray, np.ndarray]:
    if bulge == 0.0:
        return np.minimum(p, q), np.maximum(p, q)
    centre, radius, _, _ = arc_of(p, q, bulge)
    return centre - radius, centre + radius


def with_layer(mesh: Mesh, name: str, pairs: np.ndarray) -> Mesh:
    """Return the mesh with these edges added to one of its layers."""
    old = mesh.layers.get(name, np.empty((0, mesh.dim), np.int64))
    layers = dict(mesh.layers) | {name: np.unique(np.concatenate([old, np.sort(pairs, axis=1)]), axis=0)}
    return replace(mesh, layers=layers)


def with_cracks(mesh: Mesh, pairs: np.ndarray, number: int) -> Mesh:
    """Return the mesh with cracks on these edges (k, 2), in space faces (k, 3), in the fracture set `number`; those at
    a surface are skipped.

    An edge that has a crack already keeps its set.
    """
    edges = mesh.edges()
    rows = mesh.find_edges(edges, pairs)
    if (rows < 0).any():
        lost = " and ".join(map(str, pairs[np.flatnonzero(rows < 0)[0]]))
        raise HpcdemError(f"no element has an edge between points {lost}")
    new = edges.points[rows[edges.inner[rows]]]
    made = Mesh.of(
        np.empty((0, mesh.dim)),
        np.empty((0, 4)),
        cracks=np.concatenate([mesh.cracks, new]),
        crack_sets=np.concatenate([mesh.crack_sets, np.full(len(new), number, np.int64)]),
    )
    return replace(mesh, cracks=made.cracks, crack_sets=made.crack_sets)


def faces_on(mesh: Mesh, surfaces: Sequence[Any]) -> np.ndarray:
    """Return the points (k, 3) i8 of the faces, of hexahedra the sides, that lie on surfaces or those of
    bodies, in space.
    """
    edges = _sides(mesh)
    slack = TOLERANCE * float(np.ptp(mesh.points, axis=0).max())
    at = mesh.points[edges.points]
    on = np.any([on_surface(one, at, slack) for one in surfaces], axis=0)
    return np.sort(edges.points[on], axis=1)


def between_sides(mesh: Mesh, surfaces: Sequence[Any]) -> np.ndarray:
    """Return the points (k, 3) i8 of the inner faces between elements whose centres are on different sides of a
    surface, if the centre of the face, for hexahedra of the side, projects onto the surface: a rough face along it,
    without holes, in one piece, with about 1.75 times its area.
    """
    edges = mesh.edges()
    inner = np.flatnonzero(edges.inner)
    sides = edges.faces[inner] // 4
    middle = mesh.centroids()
    at = mesh.points[edges.points[inner]].mean(axis=1)
    half, fourth, *_ = mesh.on_sides(edges.faces[inner, 0])
    at[half] += 0.25 * (mesh.points[mesh.cells.reshape(-1)[fourth]] - at[half])
    tree = cKDTree(at)
    found = []
    for one in surfaces:
        if not one.surface:
            raise CommandError("follow supports polygons, discs and planes only")
        (place, normal), rows = one.plane(), np.arange(len(inner))
        if isinstance(one, Disc):  # what lies farther than an element from it cannot be about it
            rows = np.array(sorted(tree.query_ball_point(place, one.radius + mesh.mean_edge() * 3.0)), np.int64)
        over = (middle[sides[rows]] - place) @ normal >= 0.0
        found.append(rows[(over[:, 0] != over[:, 1]) & (one.beyond(at[rows]) <= 0.0)])
    return np.sort(edges.points[inner[np.unique(np.concatenate(found))]], axis=1)


def follow(mesh: Mesh, fractures: Fractures) -> Mesh:
    """Return the mesh with cracks along the edges that follow traces best; points do not move.

    A trace runs from the point of the mesh nearest to its beginning to the one nearest to its end, along the path of
    edges with the least cost: the length of each edge times 1 + STRAYING (distance of its middle from the trace / its
    length)2. Traces shorter than the surrounding edges leave no crack. Edges inside a six-node triangle are not used.
    """
    paths = _Paths(mesh, _sides(mesh))
    pairs, sets = [], []
    for (start, end), number in zip(fractures.ends, fractures.sets):
        path = paths.along(start, end)
        pairs.append(np.column_stack([path[:-1], path[1:]]))
        sets.append(np.full(len(path) - 1, number, np.int64))
    for number in np.unique(fractures.sets):
        mine = [p for p, s in zip(pairs, sets) if len(s) and s[0] == number]
        if mine:
            mesh = with_cracks(mesh, np.concatenate(mine), int(number))
    return mesh


class _Paths:
    """Paths along the edges of a mesh."""

    def __init__(self, mesh: Mesh, edges: Edges) -> None:
        self.points = mesh.points
        both = np.concatenate([edges.points, edges.points[:, ::-1]])
        order = np.lexsort((both[:, 1], both[:, 0]))
        self.start = np.searchsorted(both[order, 0], np.arange(len(mesh.points) + 1))
        self.other = both[order, 1]
        self.tree = cKDTree(mesh.points)

    def along(self, start: np.ndarray, end: np.ndarray) -> list[int]:
        """Points from the one nearest to `start` to the one nearest to `end` (Dijkstra's shortest path, with costs)."""
        source, goal = (self._nearest(p) for p in (start, end))
        cost, before = {source: 0.0}, {source: source}
        done: set[int] = set()
        heap = [(0.0, source)]
        trace = end - start
        length2 = float(trace @ trace)
        while heap:
            so_far, i = heapq.heappop(heap)
            if i in done:
                continue
            done.add(i)
            if i == goal:
                break
            px, py = self.points[i]
            for j in self.other[self.start[i] : self.start[i + 1]].tolist():
                if j in done:
                    continue
                qx, qy = self.points[j]
                mx, my = 0.5 * (px + qx) - start[0], 0.5 * (py + qy) - start[1]
                t = min(max((mx * trace[0] + my * trace[1]) / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
                stray2 = (mx - t * trace[0]) ** 2 + (my - t * trace[1]) ** 2
                length = math.hypot(qx - px, qy - py)
                total = so_far + length + STRAYING * stray2 / length
                if total < cost.get(j, math.inf):
                    cost[j], before[j] = total, i
                    heapq.heappush(heap, (total, j))
        if goal not in done:
            raise CommandError(
                f"no path along edges leads from ({start[0]:g}, {start[1]:g}) to ({end[0]:g}, {end[1]:g}): the trace "
                "begins and ends in different bodies"
            )
        path = [goal]
        while path[-1] != source:
            path.append(before[path[-1]])
        return path[::-1]

    def _nearest(self, at: np.ndarray) -> int:
        """The lowest of equally near points, so that a tie does not hang on how a tree was built."""
        far, _ = self.tree.query(at)
        return min(self.tree.query_ball_point(at, far * (1.0 + 1e-12) + 1e-300))

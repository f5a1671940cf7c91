"""Elements are cut where faces of others lie on theirs in part: both sides get the pieces that they have in common.

In the plane an element with points on its edges becomes triangles. In space a tetrahedron becomes tetrahedra about one
of its corners, where its sides allow that, else about its middle; a hexahedron becomes tetrahedra about its middle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from hpcdem.core.errors import CommandError
from hpcdem.numerics import clusters
from hpcdem.physics.fdem import hexahedra
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.tetrahedra import volumes
from hpcdem.pre.mesh import fit, optional

Face = tuple[int, ...]


@dataclass(frozen=True)
class Refined:
    """Result of `refined`. mesh: points and elements only; faces: number of common pieces of both sides; parent (ne,):
    original element; pieces: of cut sides, by their sorted points; cut: number of elements cut.
    """

    mesh: Mesh
    faces: int
    parent: np.ndarray
    pieces: dict[Face, list[Face]] = field(default_factory=dict)
    cut: int = 0

    def with_pieces(self, elements: np.ndarray) -> np.ndarray:
        """Return these elements and the pieces that were cut off from them."""
        return np.flatnonzero(np.isin(self.parent, elements))

    def flags(self, before: np.ndarray) -> np.ndarray:
        """(ne,) of elements now."""
        return before[self.parent]


def refined(mesh: Mesh, free: fit.Free, pairs: np.ndarray, tolerance: float) -> Refined:
    """The mesh, in which these pairs (m, 2) of faces that lie on each other are pieces with the same points.
    CommandError, with the place, for warped faces in space, and those of which no rest can be cut into triangles."""
    if not len(pairs):
        return Refined(mesh, 0, np.arange(len(mesh.cells)))
    return (_in_space if mesh.dim == 3 else _in_plane)(mesh, free, pairs, tolerance)


# ---- in the plane --------------------------------------------------------------------------------------------------


def _in_plane(mesh: Mesh, free: fit.Free, pairs: np.ndarray, tolerance: float) -> Refined:
    on: dict[int, set[int]] = {}
    for i, j in (*pairs.tolist(), *pairs[:, ::-1].tolist()):
        on.setdefault(i, set()).update(free.points[j].tolist())
    ends = free.points.tolist()
    inner = {row: _between(mesh.points, ends[row][0], ends[row][1], points, tolerance) for row, points in on.items()}
    cells, parent = [mesh.cells.copy()], [np.arange(len(mesh.cells))]
    pieces: dict[Face, list[Face]] = {}
    edges: list[Face] = []
    by_element: dict[int, dict[int, list[int]]] = {}
    for row, points in inner.items():
        a, b = free.points[row].tolist()
        chain = [a, *points, b]
        parts = [(min(p, q), max(p, q)) for p, q in pairwise(chain)]
        edges += parts
        if points:
            pieces[min(a, b), max(a, b)] = list(parts)
            e, k = divmod(int(free.faces[row]), 4)
            by_element.setdefault(e, {})[k] = points
    for e, sides in by_element.items():
        corners = [p for p in mesh.cells[e].tolist() if p >= 0]
        outline = [p for k, corner in enumerate(corners) for p in (corner, *sides.get(k, []))]
        made = np.array(triangles(outline, mesh.points[outline], tolerance, fit.places(mesh.points[corners[:1]])))
        made = np.column_stack([made, np.full(len(made), -1)])
        cells[0][e] = made[0]
        cells.append(made[1:])
        parent.append(np.full(len(made) - 1, e))
    common = len(edges) - len(set(edges))
    new = Mesh.of(mesh.points, np.concatenate(cells))
    return Refined(new, common, np.concatenate(parent), pieces, len(by_element))


def _between(points: np.ndarray, a: int, b: int, others: set[int], tolerance: float) -> list[int]:
    """Select the other points strictly between a and b on their line, in order."""
    some = np.array(sorted(others - {a, b}), np.int64)
    if not len(some):
        return []
    edge = points[b] - points[a]
    length = float(np.sqrt(edge @ edge))
    off = points[some] - points[a]
    along = off @ (edge / length)
    across = np.sqrt(np.maximum((off * off).sum(axis=1) - along * along, 0.0))
    good = (across <= tolerance) & (along > tolerance) & (along < length - tolerance)
    return [int(p) for p in some[good][np.argsort(along[good], kind="stable")]]


# ---- in space ------------------------------------------------------------------------------------------------------


def _in_space(mesh: Mesh, free: fit.Free, pairs: np.ndarray, tolerance: float) -> Refined:
    work = _Cut(mesh, free, tolerance)
    for i, j in pairs.tolist():
        work.common(i, j)
    work.points_named()
    return work.made()


class _Cut:
    """Common pieces of faces, and what they make of the elements."""

    def __init__(self, mesh: Mesh, free: fit.Free, tolerance: float) -> None:
        self.mesh, self.free, self.tolerance = mesh, free, tolerance
        self.outlines: list[tuple[int, int, np.ndarray]] = []
        self.points = mesh.points
        self.sides: dict[int, list[Face]] = {}
        self.count = 0

    def common(self, i: int, j: int) -> None:
        """The outline of what two faces have in common."""
        free = self.free
        off = ((free.at[j] - free.at[i].mean(axis=0)) @ free.normal[i]).tolist()
        if max(map(abs, off)) > self.tolerance:
            raise CommandError(
                f"quads of the elements {free.faces[i] // 4} and {free.faces[j] // 4} at "
                f"{fit.places(free.at[i][:1])} are warped and cut along different diagonals: they cannot be glued. "
                "Use the same triangles in the meshes of both bodies"
            )
        outline = [corner - height * free.normal[i] for corner, height in zip(free.at[j], off, strict=True)]
        outline.reverse()  # as the first face runs
        for a, b in zip(free.at[i], np.roll(free.at[i], -1, axis=0), strict=True):
            inwards = _across(free.normal[i], b - a)
            outline = _clipped(outline, a, inwards / np.sqrt(inwards @ inwards))
        if len(outline) > 2:
            self.outlines.append((i, j, np.array(outline)))

    def points_named(self) -> None:
        """Corners of all outlines become points; outlines become triangles of both faces."""
        mesh, free, n = self.mesh, self.free, len(self.mesh.points)
        known = np.unique(free.points[np.unique([row for i, j, _ in self.outlines for row in (i, j)])])
        found = np.concatenate([outline for _, _, outline in self.outlines])
        both = np.concatenate([mesh.points[known], found])
        number = np.concatenate([known, n + np.arange(len(found))])
        spot = clusters.spots(both, self.tolerance)  # known points precede new ones
        lead = number[spot[len(known) :]]
        new, at = np.unique(lead[lead >= n], return_inverse=True)
        lead[lead >= n] = n + at
        self.points = np.concatenate([mesh.points, found[new - n]])
        self.some = np.concatenate([known, n + np.arange(len(new))])
        self.tree = cKDTree(self.points[self.some])
        first = 0
        for i, j, outline in self.outlines:
            corners = lead[first : first + len(outline)].tolist()
            first += len(outline)
            ring = [p for k, p in enumerate(corners) if p != corners[k - 1]]
            if len(set(ring)) < 3:
                continue
            ring = [p for k, a in enumerate(ring) for p in (a, *self._on(a, ring[(k + 1) % len(ring)]))]
            if len(set(ring)) < len(ring):
                continue  # thinner than the tolerance: its neighbours have its corners on their sides
            made = self._flat(ring, free.normal[i])
            self.count += len(made)
            self.sides.setdefault(int(free.faces[i]), []).extend(made)
            self.sides.setdefault(int(free.faces[j]), []).extend((a, c, b) for a, b, c in made)
        rows = {int(face): row for row, face in enumerate(free.faces)}
        for face, made in self.sides.items():
            self._complete(rows[face], made)

    def _complete(self, row: int, made: list[Face]) -> None:
        """Triangles of what these leave of a face, beside them. CommandError if none fit."""
        corners = self.free.at[row]
        whole, covered = _area(corners), sum(_area(self.points[list(one)]) for one in made)
        rim = np.sqrt(((np.roll(corners, -1, axis=0) - corners) ** 2).sum(axis=1)).sum()
        slack = 3.0 * self.tolerance * rim
        if abs(covered - whole) <= slack:
            return
        rest = self._rest(row, made)
        if abs(covered + sum(_area(self.points[list(one)]) for one in rest) - whole) > slack:
            raise CommandError(
                f"a face of element {self.free.faces[row] // 4} at {fit.places(corners.mean(axis=0)[None])} is "
                f"covered in part only, by {covered / whole:.3g} of its area, and the rest cannot be cut into "
                "triangles. Use the same points in both meshes, or a line of points on the rim of the smaller face"
            )
        made += rest

    def _rest(self, row: int, made: list[Face]) -> list[Face]:
        """Triangles between the rim of a face and these, counter-clockwise from outside."""
        shapely = optional.shapely()
        if not hasattr(shapely, "constrained_delaunay_triangles"):
            raise CommandError(
                f"a face of element {self.free.faces[row] // 4} is covered in part only: gluing it needs shapely 2.1 "
                f"or newer, here is {shapely.__version__}: {optional.EXTRA}"
            )
        normal, ends = self.free.normal[row], self.free.points[row].tolist()
        ring = [p for k, a in enumerate(ends) for p in (a, *self._on(a, ends[(k + 1) % len(ends)]))]
        rim = set(zip(ring, ring[1:] + ring[:1]))
        inner = {(a, b) for one in made for a, b in zip(one, one[1:] + one[:1])}
        bound = {pair for pair in inner if pair[::-1] not in inner}
        sides = (rim - bound) | {pair[::-1] for pair in bound - rim}
        u = self.points[ends[1]] - self.points[ends[0]]
        u = u / np.sqrt(u @ u)
        numbers = sorted({p for pair in sides for p in pair} | {p for one in made for p in one})
        flat = (self.points[numbers] - self.points[ends[0]]) @ np.array([u, _across(normal, u)]).T
        at = {p: (float(x), float(y)) for p, (x, y) in zip(numbers, flat)}
        back = {place: p for p, place in at.items()}
        lines = shapely.linestrings([[at[a], at[b]] for a, b in sorted(sides)])
        pieces = shapely.union_all(shapely.polygons([[at[p] for p in one] for one in made]))
        found: list[Face] = []
        for area in shapely.get_parts(shapely.polygonize(lines)):
            if pieces.contains(area.representative_point()):
                continue
            for one in shapely.get_parts(shapely.constrained_delaunay_triangles(area)):
                a, b, c = (back[place] for place in list(one.exterior.coords)[:3])
                found.append((a, b, c) if _turn(at[a], at[b], at[c]) > 0.0 else (a, c, b))
        edges = {pair for one in found for pair in zip(one, one[1:] + one[:1])}
        return found if sides <= edges else []

    def _on(self, a: int, b: int) -> list[int]:
        """Points on the line from a to b, in order."""
        ends = self.points[[a, b]]
        reach = 0.5 * float(np.sqrt(((ends[1] - ends[0]) ** 2).sum()))
        near = self.tree.query_ball_point(ends.mean(axis=0), reach)
        return _between(self.points, a, b, set(self.some[near].tolist()), self.tolerance)

    def _flat(self, ring: list[int], normal: np.ndarray) -> list[Face]:
        """Triangles of a ring of points in a plane, counter-clockwise as its normal looks at one."""
        u = self.points[ring[1]] - self.points[ring[0]]
        u = u / np.sqrt(u @ u)
        xy = (self.points[ring] - self.points[ring[0]]) @ np.array([u, _across(normal, u)]).T
        return triangles(ring, xy, self.tolerance, fit.places(self.points[ring[:1]]))

    def made(self) -> Refined:
        """The mesh."""
        mesh = self.mesh
        faces = np.array(sorted(self.sides), np.int64)
        self.edges: dict[Face, list[int]] = {}
        for row in np.flatnonzero(np.isin(self.free.faces, faces)):
            corners = self.free.points[row].tolist()
            for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
                a, b = min(a, b), max(a, b)
                if (a, b) not in self.edges:
                    self.edges[a, b] = self._on(a, b)
        n = len(self.points)
        split = np.array([a * n + b for (a, b), points in self.edges.items() if points], np.int64)
        touched = np.zeros(len(mesh.cells), bool)
        for one in range(3):
            for other in range(one + 1, 4):
                ends = np.sort(mesh.cells[:, [one, other]], axis=1)
                touched |= np.isin(ends[:, 0] * n + ends[:, 1], split)
        whole = {int(face): made for face, made in self.sides.items() if len(made) > 1}
        touched[np.array(sorted(whole), np.int64) // 4] = True
        hex_of = mesh.macro_of()
        hexes = np.unique(hex_of[touched & (hex_of >= 0)])
        self.pieces: dict[Face, list[Face]] = {}
        self.middles: list[np.ndarray] = []
        new: list[tuple[np.ndarray, list[Face]]] = []
        for e in np.flatnonzero(touched & (hex_of < 0)).tolist():
            corners = mesh.cells[e].tolist()
            new.append((np.array([e]), self._tets([4 * e + k for k in range(4)], corners)))
        halves = hexahedra.halves(mesh.cells, mesh.hexes)[hexes].reshape(len(hexes), -1) if len(hexes) else []
        for h, of in zip(hexes.tolist(), halves, strict=True):
            rows = mesh.hexes[h, 8] + np.arange(hexahedra.PARTS)
            new.append((rows, self._tets(list(of), mesh.hexes[h, :8].tolist(), False)))
        cells, parent = [mesh.cells.copy()], [np.arange(len(mesh.cells))]
        points = np.concatenate([self.points, np.array(self.middles).reshape(-1, 3)])
        for rows, tets in new:
            made = np.array(tets, np.int64)
            if not (volumes(points, made) > 0.0).all():
                raise CommandError(
                    f"element {rows[0]} at {fit.places(points[made[0, :1]])} cannot be cut at hanging nodes on its "
                    "sides: use the same points in the meshes of both bodies"
                )
            cells[0][rows] = made[: len(rows)]
            cells.append(made[len(rows) :])
            parent.append(np.full(len(made) - len(rows), rows[0]))
        left = np.delete(mesh.hexes, hexes, axis=0)
        result = Mesh.of(points, np.concatenate(cells), macros=left)
        return Refined(result, self.count, np.concatenate(parent), self.pieces, len(new))

    def _tets(self, faces: list[int], corners: list[int], about_corner: bool = True) -> list[Face]:
        """Tetrahedra of an element with these faces (outwards)."""
        sides = [self._side(face) for face in faces]
        if about_corner:
            for apex in corners:
                if all(apex in one for side in sides if any(apex in one for one in side) for one in side):
                    return [(a, c, b, apex) for side in sides for a, b, c in side if apex not in (a, b, c)]
        middle = len(self.points) + len(self.middles)
        self.middles.append(self.points[corners].mean(axis=0))
        return [(a, c, b, middle) for side in sides for a, b, c in side]

    def _side(self, face: int) -> list[Face]:
        """Triangles of a face, counter-clockwise from outside."""
        corners = self.mesh.face_points(np.array([face]))[0].tolist()
        if face in self.sides:
            made = self.sides[face]
        else:
            ring = []
            for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
                on = self.edges.get((min(a, b), max(a, b)), [])
                ring += [a, *(on if a < b else on[::-1])]
            if len(ring) == 3:
                return [(corners[0], corners[1], corners[2])]
            # The element on the other side makes the same triangles.
            at = ring.index(min(ring))
            turned = ring[at:] + ring[:at]
            back = turned[1] > turned[-1]
            turned = [turned[0], *turned[:0:-1]] if back else turned
            u, w = (self.points[corners[k]] - self.points[corners[0]] for k in (1, 2))
            normal = _across(u, w) * (-1.0 if back else 1.0)
            made = self._flat(turned, normal / np.sqrt(normal @ normal))
            made = [(a, c, b) for a, b, c in made] if back else made
        if len(made) > 1:
            self.pieces[tuple(sorted(corners))] = [tuple(sorted(one)) for one in made]
        return made


def _clipped(outline: list[np.ndarray], at: np.ndarray, inwards: np.ndarray) -> list[np.ndarray]:
    """The part of a convex outline on one side of a line in its plane."""
    out = []
    height = [float((point - at) @ inwards) for point in outline]
    for k, point in enumerate(outline):
        before, low = outline[k - 1], height[k - 1]
        if (low < 0.0) != (height[k] < 0.0):
            out.append(before + (point - before) * (low / (low - height[k])))
        if height[k] >= 0.0:
            out.append(point)
    return out


def _across(u: np.ndarray, w: np.ndarray) -> np.ndarray:
    """The cross product of two vectors, faster than that of arrays."""
    (a, b, c), (x, y, z) = u.tolist(), w.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def _area(corners: np.ndarray) -> float:
    normal = _across(corners[1] - corners[0], corners[2] - corners[0])
    return 0.5 * float(np.sqrt(normal @ normal))


def triangles(ring: Sequence[int], xy: np.ndarray, tolerance: float, place: str) -> list[Face]:
    """Triangles of a polygon with corners xy (n, 2), counter-clockwise, convex but for points on its sides, within the
    tolerance [m]: the ear with the best shape goes first."""
    at = [(float(x), float(y)) for x, y in xy]
    left = list(range(len(ring)))
    out: list[Face] = []
    while len(left) > 3:
        best, best_shape = -1, 0.0
        for k in range(len(left)):
            a, b, c = (left[(k + m - 1) % len(left)] for m in range(3))
            shape = _shape(at[a], at[b], at[c], tolerance)
            if shape > best_shape * (1.0 + 1e-6) and not any(
                _within(at[p], (at[a], at[b], at[c]), tolerance) for p in left if p not in (a, b, c)
            ):
                best, best_shape = k, shape
        if best < 0:
            raise CommandError(f"faces at {place} have no common part that can be cut into triangles")
        a, b, c = (left[(best + m - 1) % len(left)] for m in range(3))
        out.append((ring[a], ring[b], ring[c]))
        left.remove(b)
    out.append(tuple(ring[k] for k in left))
    return out


Plane = tuple[float, float]


def _turn(a: Plane, b: Plane, c: Plane) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _squared(a: Plane, b: Plane) -> float:
    return (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2


def _shape(a: Plane, b: Plane, c: Plane, tolerance: float) -> float:
    """Twice the area over the square of the longest side; 0 if a corner lies on a side, or they run clockwise."""
    longest = max(_squared(a, b), _squared(b, c), _squared(c, a))
    area = _turn(a, b, c)
    return area / longest if area > tolerance * math.sqrt(longest) else 0.0


def _within(p: Plane, corners: tuple[Plane, Plane, Plane], tolerance: float) -> bool:
    """Return whether a point is in the triangle or on its sides."""
    a, b, c = corners
    return all(_turn(u, v, p) >= -tolerance * math.sqrt(_squared(u, v)) for u, v in ((a, b), (b, c), (c, a)))

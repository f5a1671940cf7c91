"""The mesh of the blocks: points, elements, and what is known about them before the first step.

In the plane elements are triangles and quads, in space tetrahedra. Points, elements (cells), faces and edges are
numbered for the whole model, see `connectivity` and `tetrahedra`; the numbers do not depend on ranks. In space what the
plane calls an edge is a face with three points. `hpcdem.pre.mesh` makes meshes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from hpcdem.core.errors import HpcdemError
from hpcdem.physics.fdem import connectivity, hexahedra, tetrahedra
from hpcdem.physics.fdem.connectivity import Edges, centroids
from hpcdem.physics.fdem.elements.kind import HEXAHEDRON, MACROS, Kind

CONNECTIVITY = {2: connectivity, 3: tetrahedra}
FLAT = 1e-9
"""Fraction of the square of the longest edge: an element with a corner that spans less area is flat."""
MANY = 1 << 16
"""Number of elements or faces that are checked together: checking all of them at once would take more memory than the
mesh."""
SAME = 1e-9
"""Points nearer than this part of the shortest edge are one point."""


def _no_pairs() -> np.ndarray:
    return np.empty((0, 2), np.int64)


@dataclass(frozen=True)
class Mesh:
    """Points and elements, with names for parts of them. Arrays are not to be changed."""

    points: np.ndarray
    """(np, 2) f8 [m], in space (np, 3)."""
    cells: np.ndarray
    """(ne, 4) i8 point numbers; of triangles and quads counter-clockwise, the fourth -1 for triangles; of tetrahedra
    as `tetrahedra.canonical` has them."""
    groups: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    """Set name -> group name -> ascending i8 element numbers; an element is in one group per set at most."""
    layers: dict[str, np.ndarray] = field(default_factory=dict)
    """Geometry layer -> (k, 2) i8 end points of the edges that lie on it, (k, 3) in space."""
    cracks: np.ndarray = field(default_factory=_no_pairs)
    """(k, 2) i8 end points of the inner edges that carry a crack from the beginning."""
    crack_sets: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    """(k,) i8 number of the fracture set of each crack edge."""
    macros: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    """(n, corners + 1) i8 of macro-elements (elements/kind.py), in space hexahedra, in the plane six-node triangles:
    their points, and the first of the elements that store each."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "macros", self.macros.reshape(-1, self.macro.corners + 1))

    @property
    def macro(self) -> Kind:
        """The kind of macro-element that there can be."""
        return MACROS[self.dim]

    @property
    def hexes(self) -> np.ndarray:
        """(nh, 9) i8 of hexahedra: their points, and the first of their six elements."""
        return self.macros if self.dim == 3 else np.empty((0, HEXAHEDRON.corners + 1), np.int64)

    @staticmethod
    def of_hexes(points: Any, hexes: Any, layers: Any = None, more: Any = None) -> Mesh:
        """Hexahedra with these points (nh, 8), then tetrahedra `more` (n, 4)."""
        hexes = np.array(hexes, np.int64).reshape(-1, 8)
        cells = hexahedra.split(hexes).reshape(-1, 4)
        if more is not None:
            cells = np.concatenate([cells, np.array(more, np.int64).reshape(-1, 4)])
        table = np.column_stack([hexes, hexahedra.PARTS * np.arange(len(hexes))])
        return Mesh.of(points, cells, layers=layers, macros=table)

    @staticmethod
    def of(
        points: Any, cells: Any, groups: Any = None, layers: Any = None, cracks: Any = None, crack_sets: Any = None,
        macros: Any = None,
    ) -> Mesh:  # fmt: skip
        """A mesh from anything array-like, in the form the fields are documented in.

        Points of three columns are in space. Cells of three columns are triangles. Pairs get their lower point first,
        ascending and each once (of a crack edge named twice the first set stays); element numbers of groups are sorted.
        """
        points = np.array(points, np.float64, order="C")
        dim = 3 if points.ndim == 2 and points.shape[1] == 3 else 2
        points = points.reshape(-1, dim)
        cells = np.array(cells, np.int64, order="C")
        cells = cells.reshape(-1, 3 if cells.ndim == 2 and cells.shape[1] == 3 and dim == 2 else 4)
        if cells.shape[1] == 3:
            cells = np.column_stack([cells, np.full(len(cells), -1, np.int64)])
        if dim == 3:
            cells = tetrahedra.canonical(cells)
        # Rows lie one after the other whatever was given: kernels are compiled for that.
        points, cells = np.ascontiguousarray(points), np.ascontiguousarray(cells)
        pairs = np.sort(np.array(_no_pairs() if cracks is None else cracks, np.int64).reshape(-1, dim), axis=1)
        pairs, first = np.unique(pairs, axis=0, return_index=True)
        sets = np.zeros(len(first), np.int64) if crack_sets is None else np.array(crack_sets, np.int64)[first]
        return Mesh(
            points,
            cells,
            {s: {g: np.unique(np.array(rows, np.int64)) for g, rows in of.items()} for s, of in (groups or {}).items()},
            {name: _sorted_pairs(given, dim) for name, given in (layers or {}).items()},
            pairs,
            sets,
            np.ascontiguousarray([] if macros is None else macros, np.int64),
        )

    def macro_of(self) -> np.ndarray:
        """(ne,) i8 macro-element of which each element is a part, -1: none."""
        out = np.full(len(self.cells), -1, np.int64)
        out[self.macro.elements(self.macros)] = np.arange(len(self.macros))[:, None]
        return out

    def of_one(self, elements: np.ndarray) -> np.ndarray:
        """(n,) these elements; of parts of a macro-element its first one."""
        of = self.macro_of()[elements]
        return np.where(of >= 0, np.append(self.macros[:, -1], -1)[of], elements)

    def of_one_side(self, faces: np.ndarray) -> np.ndarray:
        """(n,) these faces; of the two halves of a side of a hexahedron the lower one."""
        if not len(self.hexes):
            return faces
        other = self._other_half[faces]
        return np.where(other >= 0, np.minimum(faces, other), faces)

    def side_middles(self, faces: np.ndarray) -> np.ndarray:
        """(n, dim) [m] of these faces (n,); of half a side of a hexahedron between those of both halves."""
        middle = self.points[self.face_points(faces)].mean(axis=1)
        if len(self.hexes):
            other = self._other_half[faces]
            half = other >= 0
            middle[half] = 0.5 * (middle[half] + self.points[self.face_points(other[half])].mean(axis=1))
        return middle

    def with_own_points(self, elements: np.ndarray, places: np.ndarray) -> Mesh:
        """Return the mesh with these elements (n,) at positions (n, 4, dim) [m] on new points, which the parts of a
        macro-element share."""
        cells, macros = self.cells.copy(), self.macros.copy()
        own = cells[elements]
        real = own >= 0
        key = (self.of_one(elements)[:, None] * len(self.points) + own)[real]
        _, first, number = np.unique(key, return_index=True, return_inverse=True)
        own[real] = len(self.points) + number.reshape(-1)
        cells[elements] = own
        at = np.flatnonzero(np.isin(macros[:, -1], elements))
        if len(at):
            corner, _ = self.macro.places(self.cells, macros[at])
            parts = cells[self.macro.elements(macros[at])].reshape(len(at), -1)
            macros[at, :-1] = np.take_along_axis(parts, corner, axis=1)
        return replace(self, points=np.concatenate([self.points, places[real][first]]), cells=cells, macros=macros)

    def inside_macros(self, faces: np.ndarray) -> np.ndarray:
        """(n,) bool: of these faces (n,) those within a macro-element, between two of its parts."""
        if not len(self.macros):
            return np.zeros(len(faces), bool)
        of = self.macro_of()
        number = of[faces // 4]
        if self.dim == 3:
            return (number >= 0) & (self._other_half[faces] < 0)
        inside = self.macro.inside()[faces // 4 - np.append(self.macros[:, -1], 0)[number], faces % 4]
        found: np.ndarray = (number >= 0) & inside
        return found

    def share(self, per_node: Callable[[Callable[[], Any]], Any]) -> None:
        """Tables that are made on first use become one copy per node of the machine. Collective."""
        if len(self.hexes):
            self.__dict__["_other_half"] = per_node(lambda: self._other_half)

    @cached_property
    def _other_half(self) -> np.ndarray:
        """(4 ne,) i8: of half a side of a hexahedron the face that is the other half, -1 of other faces."""
        out = np.full(4 * len(self.cells), -1, np.int64)
        halves = hexahedra.halves(self.cells, self.hexes).reshape(-1, 2)
        out[halves] = halves[:, ::-1]
        return out

    def quads(self, faces: np.ndarray, partner: np.ndarray) -> np.ndarray:
        """(n, 2) i8: of these faces (n,) that are half the side of one hexahedron and of another one the other half
        and its partner, -1 of others."""
        out = np.full((len(faces), 2), -1, np.int64)
        if not len(self.hexes):
            return out
        over = partner[faces]
        other = self._other_half[faces]
        beyond = np.where(over >= 0, self._other_half[over], -1)
        at = np.flatnonzero((other >= 0) & (beyond >= 0))
        at = at[partner[other[at]] == beyond[at]]
        out[at] = np.column_stack([other[at], beyond[at]])
        return out

    def on_sides(self, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Find which of these faces (n,) are half a side of a hexahedron (k,), the corner (k,), element * 4 + k, that
        only the other half has, and how corners share what is bilinear: g (k, 4) of the three and this one, e (k, 3),
        see kernels/joints_hexes.py. The same bits from both sides of a face."""
        at = np.empty(0, np.int64) if not len(self.hexes) else np.flatnonzero(self._other_half[faces] >= 0)
        if not len(at):
            return at, at, np.empty((0, 4)), np.empty((0, 3))
        half, other = faces[at], self._other_half[faces[at]]
        points, beyond = self.face_points(half), self.face_points(other)
        same = points[:, :, None] == beyond[:, None]
        lone, rows = np.argmin(same.any(axis=2), axis=1), np.arange(len(at))
        fourth = np.argmin(same.any(axis=1), axis=1)
        around = np.column_stack([beyond[rows, fourth], *(points[rows, (lone + k) % 3] for k in (2, 0, 1))])
        a = [sizes(self.points[np.sort(np.roll(around, -k, axis=1)[:, :3], axis=1)]) for k in range(4)]
        one, other_cut = 2.0 / (a[1] + a[3]), 2.0 / (a[0] + a[2])
        g, e = np.empty((len(at), 4)), np.full((len(at), 3), hexahedra.DIAGONAL)
        g[rows, lone], g[:, 3] = -a[3] * one, -a[1] * one
        g[rows, (lone + 2) % 3], g[rows, (lone + 1) % 3] = a[2] * other_cut, a[0] * other_cut
        e[rows, lone] = hexahedra.LONE
        return at, self.face_corners(other)[rows, fourth], g, e

    def joint_lengths(self, faces: np.ndarray, partner: np.ndarray) -> np.ndarray:
        """(n,) h [m] of the law of joints on these faces: the length of the edge; in space the root of the area of the
        face, between hexahedra of the whole side."""
        size = self.face_sizes(faces)
        if self.dim == 2:
            return size
        other = self.quads(faces, partner)[:, 0]
        at = other >= 0
        size[at] += self.face_sizes(other[at])
        return np.sqrt(size)

    @property
    def _of(self) -> Any:
        """The module with the functions for elements of these dimensions."""
        return CONNECTIVITY[self.dim]

    @property
    def dim(self) -> int:
        """Dimensions of space: 2 or 3."""
        return int(self.points.shape[1])

    def face_partners(self) -> np.ndarray:
        """(4 ne,) i8, see `connectivity.face_partners`. Computed again at each call."""
        found: np.ndarray = self._of.face_partners(self.cells, len(self.points))
        return found

    def face_points(self, faces: np.ndarray) -> np.ndarray:
        """(n, 2) i8 first and last point of each face; in space its three points (n, 3)."""
        found: np.ndarray = self._of.face_points(self.cells, faces)
        return found

    def face_corners(self, faces: np.ndarray) -> np.ndarray:
        """Return the corners of these faces, element * 4 + k."""
        found: np.ndarray = self._of.face_corners(self.cells, faces)
        return found

    def face_sizes(self, faces: np.ndarray) -> np.ndarray:
        """(n,) length of each face [m]; in space its area [m2]."""
        return sizes(self.points[self.face_points(faces)])

    def edges(self) -> Edges:
        """Return all edges, in space all faces, ascending by number. Computed again at each call."""
        found: Edges = self._of.edges_of(self.cells, len(self.points))
        return found

    def find_edges(self, edges: Edges, points: np.ndarray) -> np.ndarray:
        """(k,) i8 rows of `edges` with these points (k, 2), in space (k, 3); -1 where the mesh has no such edge."""
        found: np.ndarray = self._of.find_edges(edges, points, len(self.points))
        return found

    def corner_clusters(self, partner: np.ndarray, apart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Nodes, see `connectivity.corner_clusters`."""
        found: tuple[np.ndarray, np.ndarray] = self._of.corner_clusters(self.cells, partner, apart)
        return found

    def areas(self) -> np.ndarray:
        """(ne,) [m2], in space volumes [m3]."""
        found: np.ndarray = self._of.areas(self.points, self.cells)
        return found

    def centroids(self, elements: np.ndarray | slice = slice(None)) -> np.ndarray:
        """(n, 2) [m], in space (n, 3), of these elements; parts of a macro-element have that of its corners."""
        out = centres(self.points, self.cells[elements])
        if len(self.macros):
            of = self.macro_of()[elements]
            out[of >= 0] = self.points[self.macros[of[of >= 0], : self.macro.shape]].mean(axis=1)
        return out

    def stress_points(self, elements: np.ndarray) -> np.ndarray:
        """(n, dim) [m] where the initial stress of these elements is theirs: at their centroids, see
        `Kind.said_of_parts`."""
        return centres(self.points, self.cells[elements]) if self.macro.stress_of_parts else self.centroids(elements)

    def nearest_element(self, points: np.ndarray, cells: np.ndarray, at: tuple[float, ...], among: np.ndarray) -> int:
        """Return which of the cells (n, 4) of points (m, dim) holds the point `at`, or is nearest to it; among: of
        these."""
        return int(self._of.nearest_element(points, cells, at, among))

    def mean_edge(self) -> float:
        """Mean length of an edge [m]."""
        if self.dim == 2:
            ends = self.edges().points
        else:
            n, pairs = len(self.points), [(a, b) for a in range(3) for b in range(a + 1, 4)]
            keys = np.empty((len(pairs), len(self.cells)), np.int64)
            for key, (a, b) in zip(keys, pairs):
                one, other = self.cells[:, a], self.cells[:, b]
                key[:] = np.minimum(one, other) * n + np.maximum(one, other)
            ends = np.column_stack(np.divmod(np.unique(keys), n))
        along = self.points[ends[:, 1]] - self.points[ends[:, 0]]
        return float(np.sqrt((along * along).sum(axis=1)).mean())


def pieces(n: int) -> Iterator[slice]:
    """Ranges of n rows, `MANY` at a time."""
    return (slice(at, min(at + MANY, n)) for at in range(0, n, MANY))


def sizes(corners: np.ndarray) -> np.ndarray:
    """(n,) lengths [m] of edges with these ends (n, 2, 2), areas [m2] of faces with these corners (n, 3, 3)."""
    if corners.shape[2] == 3:
        return 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return np.hypot(*(corners[:, 1] - corners[:, 0]).T)


def centres(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(n, 2), in space (n, 3), middles of elements [m]."""
    return points[cells].mean(axis=1) if points.shape[1] == 3 else centroids(points, cells)


def _sorted_pairs(pairs: np.ndarray, dim: int) -> np.ndarray:
    return np.unique(np.sort(np.array(pairs, np.int64).reshape(-1, dim), axis=1), axis=0)


def edge_rows(mesh: Mesh, edges: Edges, layer: str) -> np.ndarray:
    """Rows of `edges` that lie on a geometry layer; HpcdemError if the mesh has no such layer."""
    if layer not in mesh.layers:
        raise HpcdemError(f"the mesh has no edges of a layer '{layer}' (layers: {_listed(mesh.layers)})")
    return np.sort(mesh.find_edges(edges, mesh.layers[layer]))


def crack_rows(mesh: Mesh, edges: Edges) -> np.ndarray:
    """Rows of `edges` for the rows of `mesh.cracks`, in their order."""
    return mesh.find_edges(edges, mesh.cracks)


@dataclass(frozen=True)
class Names:
    """Names of a point and an element of the mesh in messages."""

    point: Callable[[int], str] = str
    element: Callable[[int], str] = str


def check(mesh: Mesh, source: str = "mesh", names: Names | None = None) -> None:
    """Raise HpcdemError `source: element or point, what is wrong` for the first thing a simulation cannot take.

    Refused are: no elements; numbers that are not finite or name no point; an element that is flat, clockwise, folded
    or concave; two points of a body in one place; a point without element; an element given twice; three elements on an
    edge or two on the same side of it; groups, layers and cracks that name what is not there or overlap.
    """
    if not len(mesh.cells):
        raise HpcdemError(f"{source}: there are no elements")
    for finding in (_bad_numbers, _bad_hexes, _bad_shapes, _bad_points, _bad_edges, _bad_names):
        problem = finding(mesh, names or Names())
        if problem:
            raise HpcdemError(f"{source}: {problem}")


def _at(mesh: Mesh, point: int) -> str:
    return f"({', '.join(f'{c:g}' for c in mesh.points[point])})"


def _element(mesh: Mesh, e: int, names: Names) -> str:
    corners = [int(p) for p in mesh.cells[e] if p >= 0]
    where = f" at {_at(mesh, corners[0])}" if corners and corners[0] < len(mesh.points) else ""
    return f"element {names.element(e)}{where} with the points {', '.join(map(names.point, corners))}"


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"'{n}'" for n in names) or "none"


def _bad_numbers(mesh: Mesh, names: Names) -> str | None:
    bad = np.flatnonzero(~np.isfinite(mesh.points).all(axis=1))
    if len(bad):
        return f"point {names.point(int(bad[0]))} is not finite: {_at(mesh, int(bad[0]))}"
    n = len(mesh.points)
    wrong = (mesh.cells[:, :3] < 0).any(axis=1) | (mesh.cells[:, 3] < (0 if mesh.dim == 3 else -1))
    wrong |= (mesh.cells >= n).any(axis=1)
    bad = np.flatnonzero(wrong)
    if len(bad):
        return f"element {bad[0]} names points {mesh.cells[bad[0]].tolist()}, but points are numbered 0 to {n - 1}"
    return None


def _bad_hexes(mesh: Mesh, names: Names) -> str | None:
    """Find hexahedra with a tetrahedron of either overlay that has no volume."""
    if not len(mesh.hexes):
        return None
    points = mesh.hexes[:, :8]
    if ((points < 0) | (points >= len(mesh.points))).any():
        return f"a hexahedron names a point outside 0 to {len(mesh.points) - 1}"
    least = hexahedra.volumes(mesh.points, mesh.hexes).min(axis=1)
    corners = mesh.points[points]
    size = np.ptp(corners, axis=1).max(axis=1)
    bad = np.flatnonzero(~(least > FLAT * size**3))
    if not len(bad):
        return None
    k = int(bad[0])
    return (
        f"hexahedron {k if names == Names() else names.element(int(mesh.hexes[k, 8]))} at "
        f"{_at(mesh, int(points[k, 0]))} with the points {', '.join(map(names.point, points[k].tolist()))} "
        "is turned inside out, flat, or so warped that a tetrahedron of its corners is"
    )


def _bad_shapes(mesh: Mesh, names: Names) -> str | None:
    """Each corner of a convex counter-clockwise element turns left; a tetrahedron has a volume."""
    if mesh.dim == 3:
        longest, volume = np.empty(len(mesh.cells)), mesh.areas()
        for at in pieces(len(longest)):
            side = tetrahedra.sides(mesh.points, mesh.cells[at])
            longest[at] = np.sqrt((side * side).sum(axis=2).max(axis=1))
        bad = np.flatnonzero(~(volume > FLAT * longest**3))
        if not len(bad):
            return None
        inverted = volume[bad[0]] < -FLAT * longest[bad[0]] ** 3
        return f"{_element(mesh, int(bad[0]), names)} {'is turned inside out (inverted)' if inverted else 'is flat'}"
    for n in (3, 4):
        rows = np.flatnonzero(connectivity.corner_counts(mesh.cells) == n)
        xy = mesh.points[mesh.cells[rows, :n]]
        side = np.roll(xy, -1, axis=1) - xy
        before = np.roll(side, 1, axis=1)
        turn = before[..., 0] * side[..., 1] - before[..., 1] * side[..., 0]
        flat = FLAT * (side * side).sum(axis=2).max(axis=1)
        bad = np.flatnonzero((turn <= flat[:, None]).any(axis=1))
        if len(bad):
            i = bad[0]
            if (turn[i] < -flat[i]).all():
                what = "runs clockwise (inverted)"
            elif n == 3 or (np.abs(turn[i]) <= flat[i]).any():
                what = "is flat"
            else:
                what = "is folded or concave"
            return f"{_element(mesh, int(rows[i]), names)} {what}"
    return None


def _bad_points(mesh: Mesh, names: Names) -> str | None:
    used = np.zeros(len(mesh.points), bool)
    used[mesh.cells[mesh.cells >= 0]] = True
    if not used.all():
        lost = int(np.flatnonzero(~used)[0])
        return f"point {names.point(lost)} at {_at(mesh, lost)} belongs to no element"
    corners = mesh.cells[:, : mesh.dim + 1]
    shortest = math.inf
    for at in pieces(len(corners)):
        a, b = mesh.points[corners[at]], mesh.points[np.roll(corners[at], -1, axis=1)]
        shortest = min(shortest, float(np.sqrt(((b - a) ** 2).sum(axis=2)).min()))
    twins = cKDTree(mesh.points).query_pairs(SAME * shortest, output_type="ndarray")
    if len(twins):
        twins = twins[_of_one_body(mesh, twins)]
    if len(twins):
        p, q = min((int(min(t)), int(max(t))) for t in twins)
        return (
            f"points {names.point(p)} and {names.point(q)} coincide at {_at(mesh, p)} of one body: elements "
            "on both sides would not be connected; merge the points (a crack between them is an edge flagged as crack)"
        )
    return None


def _of_one_body(mesh: Mesh, pairs: np.ndarray) -> np.ndarray:
    """(n,) bool of pairs of points (n, 2): a chain of elements leads from one to the other. Bodies that share no point
    may touch: each has points of its own there."""
    first = np.repeat(mesh.cells[:, 0], 3)
    other = mesh.cells[:, 1:].ravel()
    ends, n = (first[other >= 0], other[other >= 0]), len(mesh.points)
    _, of = connected_components(coo_array((np.ones(len(ends[0])), ends), shape=(n, n)), directed=False)
    return np.asarray(of[pairs[:, 0]] == of[pairs[:, 1]])


def _bad_edges(mesh: Mesh, names: Names) -> str | None:
    partner = np.empty(4 * len(mesh.cells), np.int64)
    face, what = mesh._of.pair_faces(mesh.cells, len(mesh.points), partner), "face" if mesh.dim == 3 else "edge"
    if face >= 0:
        points = mesh.face_points(np.array([face]))[0].tolist()
        both = np.flatnonzero(np.all([(mesh.cells == p).any(axis=1) for p in points], axis=0))
        return _given_twice(mesh, face // 4, names) or (
            f"the {what} between points {' and '.join(map(names.point, points))} at {_at(mesh, points[0])} is used by "
            f"more than two elements: {', '.join(map(names.element, both[:5].tolist()))}"
        )
    lower = np.flatnonzero(partner > np.arange(len(partner)))
    for at in pieces(len(lower)):
        mine, other = (mesh.face_points(f) for f in (lower[at], partner[lower[at]]))
        # From outside of both elements the points of a common face run opposite ways.
        if mesh.dim == 3:
            after = (np.argmax(other == mine[:, :1], axis=1) + 1) % 3
            bad = np.flatnonzero(other[np.arange(len(other)), after] == mine[:, 1])
        else:
            bad = np.flatnonzero(mine[:, 0] == other[:, 0])
        if not len(bad):
            continue
        f = int(lower[at][bad[0]])
        return _given_twice(mesh, f // 4, names) or (
            f"{_element(mesh, f // 4, names)} lies on the same side of a common {what} as element "
            f"{names.element(int(partner[f] // 4))}"
        )
    return None


def _given_twice(mesh: Mesh, e: int, names: Names) -> str | None:
    twins = np.flatnonzero((np.sort(mesh.cells, axis=1) == np.sort(mesh.cells[e])).all(axis=1))
    return (
        f"{_element(mesh, int(twins[0]), names)} is a duplicate of element {names.element(int(twins[1]))}"
        if len(twins) > 1
        else None
    )


def _bad_names(mesh: Mesh, names: Names) -> str | None:
    n = len(mesh.cells)
    for set_name, groups in mesh.groups.items():
        taken = np.zeros(n, bool)
        for name, rows in groups.items():
            if len(rows) and (rows.min() < 0 or rows.max() >= n):
                return f"group '{name}' of set '{set_name}' names elements outside 0 to {n - 1}"
            if taken[rows].any() or len(np.unique(rows)) < len(rows):
                twice = int(rows[taken[rows]][0]) if taken[rows].any() else int(rows[0])
                return f"element {twice} is in two groups of set '{set_name}', one of them '{name}'"
            taken[rows] = True
    if not mesh.layers and not len(mesh.cracks):
        return None
    edges = mesh.edges()
    for name, pairs in mesh.layers.items():
        rows = mesh.find_edges(edges, pairs)
        if (rows < 0).any():
            lost = " and ".join(map(str, pairs[np.flatnonzero(rows < 0)[0]]))
            return f"layer '{name}' has an edge between points {lost}, but no element has"
    if len(mesh.crack_sets) != len(mesh.cracks):
        return f"there are {len(mesh.cracks)} crack edges, but {len(mesh.crack_sets)} numbers of fracture sets"
    rows = mesh.find_edges(edges, mesh.cracks)
    outside = np.flatnonzero((rows < 0) | ~edges.inner[rows])
    if len(mesh.macros) and len(rows):
        bad = np.flatnonzero((rows >= 0) & mesh.inside_macros(edges.faces[rows, 0]))
        if len(bad):
            at = _at(mesh, int(mesh.cracks[bad[0], 0]))
            return f"a crack through a {mesh.macro.name} at {at}: only its sides crack"
    if len(outside):
        points = mesh.cracks[outside[0]].tolist()
        return (
            f"a crack joins points {' and '.join(map(str, points))} at {_at(mesh, points[0])}, but there is no edge "
            "inside a body"
        )
    return None

"""Ranges: which elements, nodes, faces and joints a command is meant for."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics import supports
from hpcdem.physics.fdem import groups as g
from hpcdem.physics.fdem import sides
from hpcdem.physics.fdem.mesh import centres
from hpcdem.physics.flow.model import Flow
from hpcdem.pre.mesh import geometry
from hpcdem.pre.mesh.cracks import TOLERANCE, edges_on
from hpcdem.pre.mesh.solids import Solid, on_surface

if TYPE_CHECKING:
    from hpcdem.commands.fdem.project import Project

NEAR = 1e-9
"""Tolerance of bounds of x and y over the size of the model, as coordinates of meshes are rounded."""


def chosen(project: Project, kind: str, where: g.Range | None, null_too: bool = False) -> np.ndarray | None:
    """Return the ascending numbers of the objects of a kind that a range selects; None selects all and returns None.
    null_too: include removed elements and their objects. Raises CommandError if nothing is selected.
    """
    if where is None:
        return None
    return _once(project, where, lambda: _chosen(project, kind, where, null_too))


def _once(project: Project, where: g.Range | None, make: Callable[[], np.ndarray]) -> np.ndarray:
    """Found once per node of the machine, unless all ranks have to be asked where things are now."""
    project.whole_mesh()
    if any(isinstance(term, g.Present) for term in where or ()):
        return make()
    found: np.ndarray = project.comm.per_node(make)
    return found


def _chosen(project: Project, kind: str, where: g.Range, null_too: bool) -> np.ndarray:
    objects = _Objects(project, kind, null_too)
    mask = objects.all_of(where)
    if project.hidden.any() and not any(isinstance(term, g.UseHidden) and term.on for term in where):
        mask &= objects.seen()
    if not mask.any():
        raise CommandError(f"the range selects no {kind}" + _why(objects, where))
    return objects.on_sides(mask) if kind == g.NODE else objects.numbers[mask]


def everything(project: Project, kind: str, where: g.Range | None, null_too: bool = False) -> np.ndarray:
    """Return the numbers of the objects that a range selects, also if it is None."""
    found = chosen(project, kind, where, null_too)
    return _once(project, None, lambda: _Objects(project, kind, null_too).numbers) if found is None else found


def points(project: Project, where: g.Range | None) -> np.ndarray | None:
    """Return the points of the nodes that a range selects, for quantities that both sides of a joint share."""
    found = chosen(project, g.NODE, where)
    return found if found is None else sides.points(project.whole_mesh().cells, found)


def places(project: Project, kind: str) -> np.ndarray:
    """Return the present positions of the existing objects of a kind, their centres: (n, 2), in space (n, 3) [m]."""
    objects = _Objects(project, kind)
    objects.now = True
    return objects.places()[:, :3].mean(axis=1)


def _why(objects: _Objects, where: g.Range) -> str:
    """Explain why a range is empty: its objects were removed, or which of its terms selects nothing."""
    if not objects.null_too and objects.kind not in g.SUPPORTS and not objects.project.alive.all():
        gone = int(_Objects(objects.project, objects.kind, True).all_of(where).sum())
        if gone:
            return f": all that it selects ({gone}) was removed by element c-model null"
    if objects.project.hidden.any() and not any(isinstance(term, g.UseHidden) for term in where):
        gone = int(objects.all_of(where).sum())
        if gone:
            return f": all that it selects ({gone}) is hidden by element hide; add use-hidden on to select it"
    if len(where) == 1:
        return ""
    empty = [type(term).__name__ for term in where if not objects.mask(term).any()]
    return "; each of its terms alone selects some" if not empty else ""


_ONLY_JOINTS = (g.Between, g.OnCrack, g.Around)
_NOT_ELEMENTS = (g.OnBoundary, g.OfElements)
_NOT_SUPPORTS = (*_NOT_ELEMENTS, g.OnLayer, g.Along, g.Near, g.Crossed, g.Sized)
_BY_PLACE = (g.Span, g.OnLayer, g.InCircle, g.Near, g.Crossed, g.Along)
ASIDE = 1e-4
"""Distance over the size of a face within which a surface is searched for; it limits the accuracy of the cosine of its
angle."""
STRAIGHT = 1e-6
"""Tolerance of an angle of 0 [degrees], as coordinates of meshes are rounded."""


class _Objects:
    """All objects of a kind that are there: numbers (n,), ends (n, 2), in space (n, 3), point numbers of faces and
    joints, sides (n, 2) of joints. An element is there unless it was removed, a node or face if one of its elements
    is, a joint if both are. null_too: those that are not there as well."""

    def __init__(self, project: Project, kind: str, null_too: bool = False) -> None:
        self.project, self.kind, self.null_too = project, kind, null_too
        self.mesh = mesh = project.whole_mesh()
        self.groups = project.groups
        self.now = False
        self.corners_of_terms: list[np.ndarray] = []
        if kind in g.SUPPORTS:
            self.support = supports.of(project.blocks, kind)
            there = self.support.alive(kind)
            self.numbers = np.flatnonzero(there | null_too)
            return
        some = None
        if kind in g.FLOW:
            flow = Flow.there(project.blocks)
            if flow is None:
                raise CommandError("no channels yet: assign face-joint c-model hydraulic-porous-medium first")
            some, null_too = flow.numbers(kind), False
            self.kind = kind = g.FLOW[kind]
        self.there = there = np.ones(len(mesh.cells), bool) if null_too else project.alive
        if kind == g.ELEMENT:
            self.numbers = np.flatnonzero(there)
        elif kind == g.NODE:
            corners = mesh.cells[there]
            self.numbers = np.unique(corners[corners >= 0]) if some is None else some
        else:
            self.edges = edges = project.edges()
            if kind == g.JOINT:
                sides = edges.faces[edges.inner]
                sides = sides[~mesh.inside_macros(sides[:, 0])]
                self.sides = sides[there[sides // 4].all(axis=1)]
                if some is not None:
                    self.sides = self.sides[np.isin(self.sides[:, 0], some)]
                self.numbers = self.sides[:, 0]
            else:
                faces = np.sort(edges.faces[edges.faces >= 0])
                self.numbers = faces[there[faces // 4]]
            self.ends = mesh.face_points(self.numbers)
            self.corners = mesh.face_corners(self.numbers)
            if kind == g.JOINT and len(mesh.hexes):
                self._whole_sides()

    def _whole_sides(self) -> None:
        """Joints between hexahedra are where the whole side is, so that both halves are chosen together: they have a
        fourth point, which is one of the three again where there are tetrahedra."""
        partner = np.full(self.mesh.cells.size, -1)
        inner = self.edges.faces[self.edges.inner]
        partner[inner] = inner[:, ::-1]
        other = self.mesh.quads(self.numbers, partner)[:, 0]
        fourth = self.corners[:, 0].copy()
        at = np.flatnonzero(other >= 0)
        points = self.mesh.face_points(other[at])
        lone = ~(points[:, :, None] == self.ends[at][:, None]).any(axis=2)
        fourth[at] = self.mesh.face_corners(other[at])[lone]
        self.corners = np.column_stack([self.corners, fourth])
        self.ends = self.mesh.cells.reshape(-1)[self.corners]

    def all_of(self, where: g.Range) -> np.ndarray:
        """(n,) bool: which of them all terms hold for."""
        self.now = any(isinstance(term, g.Present) for term in where)
        if self.now and not any(isinstance(_bare(term), _BY_PLACE) for term in where):
            raise CommandError("present needs x, y or geometry, whose positions it selects")
        mask = np.ones(len(self.numbers), bool)
        for term in where:
            mask &= self.mask(term)
        return mask

    def seen(self) -> np.ndarray:
        """(n,) bool: those of which an element is not hidden."""
        hidden = self.project.hidden
        if self.kind in g.SUPPORTS:
            return np.ones(len(self.numbers), bool)
        if self.kind == g.ELEMENT:
            return ~hidden[self.numbers]
        if self.kind == g.JOINT:
            return ~hidden[self.sides // 4].all(axis=1)
        if self.kind == g.FACE:
            return ~hidden[self.numbers // 4]
        corners = self.mesh.cells[self.there & ~hidden]
        return np.isin(self.numbers, corners[corners >= 0])

    def on_sides(self, mask: np.ndarray) -> np.ndarray:
        """Numbers of these nodes (sides.py), on the sides that terms of elements and groups name. Where no corner at a
        point is meant by all of them, as between two groups, those count that any of them means."""
        if not self.corners_of_terms:
            return self.numbers[mask]
        cells = self.mesh.cells
        at = np.zeros(len(self.mesh.points) + 1, bool)  # the last one is for the fourth corner of triangles
        at[self.numbers[mask]] = True
        at = at[cells].reshape(-1) & np.repeat(self.there, 4)
        every, some = (at & how(self.corners_of_terms, axis=0) for how in (np.all, np.any))
        met = np.zeros(len(self.mesh.points), bool)
        met[cells.reshape(-1)[every]] = True
        return sides.numbers(cells, every | (some & ~met[cells.reshape(-1)]), self.there)

    def _of_corners(self, corners: np.ndarray) -> np.ndarray:
        """(n,) bool: nodes with one of these corners (4 ne,) bool, which are those that are meant."""
        self.corners_of_terms.append(corners)
        some = np.zeros(len(self.mesh.points), bool)
        some[self.mesh.cells.reshape(-1)[corners & np.repeat(self.there, 4)]] = True
        return some[self.numbers]

    def _in(self, members: np.ndarray) -> np.ndarray:
        """(n,) bool: those with these numbers."""
        if self.kind == g.NODE and sides.are_there(members):
            return self._of_corners(sides.corners(self.mesh.cells, members, len(self.mesh.points)))
        return np.isin(self.numbers, members)

    def places(self) -> np.ndarray:
        """(n, k, dim) [m] where x, y, z and geometry look for each: the centre of an element, a node, the points of a
        face or joint (of the element that it is numbered by) or the ends of an element of a bolt or liner."""
        mesh = self.mesh
        if self.kind in g.SUPPORTS:
            at = self.support.nodes["x" if self.now else "origin"]
            found = at[self.support.ends()] if self.kind == self.support.parts[0] else at[:, None]
            return found[self.numbers]
        if not self.now:
            if self.kind == g.ELEMENT:
                return mesh.centroids(self.numbers)[:, None]
            return mesh.points[self.numbers][:, None] if self.kind == g.NODE else mesh.points[self.ends]
        if self.kind == g.NODE:
            return self.project.positions()[self.numbers][:, None]
        corners = self.project.corner_positions()
        if self.kind == g.ELEMENT:
            own = np.arange(4 * len(self.numbers)).reshape(-1, 4)
            cells = np.where(mesh.cells[self.numbers] >= 0, own, -1)
            return centres(corners.reshape(-1, 4, mesh.dim)[self.numbers].reshape(-1, mesh.dim), cells)[:, None]
        return corners[self.corners]

    def mask(self, term: g.Term) -> np.ndarray:
        """(n,) bool: which of them a term holds for."""
        if isinstance(term, _ONLY_JOINTS) and self.kind != g.JOINT:
            raise CommandError(f"{term} does not apply to {self.kind}s")
        if isinstance(term, _NOT_SUPPORTS) and self.kind in g.SUPPORTS:
            raise CommandError(f"{term} does not apply to {self.kind}s")
        if isinstance(term, _NOT_ELEMENTS) and self.kind == g.ELEMENT:
            raise CommandError(f"{term} does not apply to elements")
        return _MASKS[type(term)](self, *vars(term).values())

    def _around(self, elements: np.ndarray) -> np.ndarray:
        return np.isin(self.sides // 4, elements).any(axis=1)

    def _of_element(self, first: int, last: int) -> np.ndarray:
        if self.kind == g.JOINT:
            raise CommandError("element selects faces and nodes; for joints of elements use face-of with a group")
        if self.kind == g.ELEMENT:
            return self._ids(first, last)
        elements = _Objects(self.project, g.ELEMENT, self.null_too)
        return self._of_elements(elements.numbers[elements._ids(first, last)])

    def _between(self, one: str, other: str, set_name: str) -> np.ndarray:
        groups = self.groups[g.ELEMENT]
        a, b = (np.isin(self.sides // 4, groups.members(name, set_name)) for name in (one, other))
        return (a[:, 0] & b[:, 1]) | (a[:, 1] & b[:, 0])

    def _without(self, term: g.Term) -> np.ndarray:
        before = len(self.corners_of_terms)
        found = ~self.mask(term)
        # Nodes by what they belong to: the sides of points that are not meant.
        return self._of_corners(~self.corners_of_terms.pop()) if len(self.corners_of_terms) > before else found

    def _in_circle(self, centre: tuple[float, ...], radius: float) -> np.ndarray:
        if len(centre) != self.mesh.dim:
            raise CommandError(f"in-circle: a centre of {self.mesh.dim} numbers is needed, got {len(centre)}")
        away = np.sqrt(((self.places() - np.array(centre)) ** 2).sum(axis=2))
        return (away <= radius + self._slack()).all(axis=1)

    def _crossed(self, layer: str, direction: tuple[float, ...], count: int) -> np.ndarray:
        crossed = _crossings(self._curves(layer), self.places().mean(axis=1), direction)
        return (crossed >= count) & ((crossed - count) % 2 == 0)

    def _on_crack(self) -> np.ndarray:
        rows = self.mesh.find_edges(self.edges, self.mesh.cracks)
        return np.isin(self.numbers, self.edges.faces[rows[rows >= 0], 0])

    def _of_set(self, set_name: str) -> np.ndarray:
        of = self.groups[self.kind].of_set(set_name)
        return self._in(np.concatenate([np.empty(0, np.int64), *of.values()]))

    def _members(self, group: str, set_name: str) -> np.ndarray:
        try:
            return self.groups[self.kind].members(group, set_name)
        except CommandError as error:
            of_elements = self.groups[g.ELEMENT].sets.get(set_name, {})
            if self.kind not in (g.NODE, g.FACE, g.JOINT) or group not in of_elements:
                raise
            raise CommandError(
                f"{error}. '{group}' is a group of elements: use face-of to select their {self.kind}s"
            ) from None

    def _ids(self, first: int, last: int) -> np.ndarray:
        if first > last:
            raise CommandError(f"id {first} {last}: the first number is above the last")
        mask = (self.numbers >= first) & (self.numbers <= last)
        if first == last and not mask.any():
            known = _Objects(self.project, self.kind, True).numbers
            if first in known:
                how = (
                    f"{supports.class_of(self.kind).word} delete" if self.kind in g.SUPPORTS else "element c-model null"
                )
                raise CommandError(f"{self.kind} {first} was removed ({how})")
            raise CommandError(f"there is no {self.kind} {first}; numbers range from 0 to {int(known[-1])}")
        return mask

    def _span(self, axis: int, low: float, high: float) -> np.ndarray:
        if axis >= self.mesh.dim:
            raise CommandError("a range in z needs a model in three dimensions")
        if low > high:
            raise CommandError(f"{'xyz'[axis]} {low:g} {high:g}: the first bound is above the second")
        slack = self._slack()
        at = self.places()[:, :, axis]
        return ((at >= low - slack) & (at <= high + slack)).all(axis=1)

    def _slack(self, part: float = NEAR) -> float:
        """Tolerance of positions [m]."""
        return part * float(np.ptp(self.mesh.points, axis=0).max())

    def _sized(self, low: float, high: float) -> np.ndarray:
        """Select by the area of elements, or of faces in three dimensions."""
        wanted = {2: g.ELEMENT, 3: g.FACE}[self.mesh.dim]
        if self.kind != wanted:
            raise CommandError(f"area selects {wanted}s in {self.mesh.dim} dimensions, not {self.kind}s")
        if wanted == g.ELEMENT:
            found = self.mesh.areas()[self.numbers]
        else:
            a, b, c = np.moveaxis(self.mesh.points[self.ends[:, :3]], 1, 0)
            found = 0.5 * np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1))
        return (found >= low) & (found <= high)

    def _away(self, layer: str) -> np.ndarray:
        """(n, k) [m]: how far points are from the lines, in space the surfaces, of a layer."""
        places = self.places()
        if self.mesh.dim == 3:
            flat = places.reshape(-1, 3)
            found = [np.abs(one.distance(flat)) for one in self._solids(layer)]
        else:
            flat = places.reshape(-1, 2)
            found = [geometry.distance(curve, flat) for curve in self._curves(layer)]
        return np.min(found, axis=0).reshape(places.shape[:2])

    def _along(self, layer: str, distance: float, angle: float) -> np.ndarray:
        """Flag objects near a line of the layer; objects with a direction must be at a small angle to the line
        there."""
        if self.mesh.dim == 3:
            return self._along_surfaces(layer, distance, angle)
        places, found = self.places(), np.zeros(len(self.numbers), bool)
        slack, least = self._slack(TOLERANCE), math.cos(math.radians(angle + STRAIGHT)) if angle < 90.0 else 0.0
        edge_vector = places[:, -1] - places[:, 0]
        size = np.hypot(*edge_vector.T)
        for curve in self._curves(layer):
            ends = curve.points if curve.bulges.any() == 0 else geometry.sampled(curve, curve.length() / SIDES)
            for a, b in zip(ends, np.roll(ends, -1, axis=0)[: len(ends) - (not curve.closed)]):
                away = geometry.distance_to_segment(a, b, 0.0, places.reshape(-1, 2)).reshape(places.shape[:2])
                near = (away <= distance + slack).all(axis=1)
                along = np.abs(edge_vector @ (b - a)) >= least * size * np.hypot(*(b - a))
                found |= near & along
        return found

    def _along_surfaces(self, layer: str, distance: float, angle: float) -> np.ndarray:
        """Flag objects near the surfaces of a layer in space, at a small angle to them: a face that leans from one by
        an angle comes away from it along its normal by the cosine of that."""
        places, found = self.places(), np.zeros(len(self.numbers), bool)
        slack = self._slack(TOLERANCE)
        middle, along = places.mean(axis=1), places.shape[1] > 1 and self.kind not in g.SUPPORTS and angle < 90.0
        normal = np.zeros_like(middle)
        if along:
            normal = np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0])
            normal *= (ASIDE * np.sqrt(np.linalg.norm(normal, axis=1)) / np.linalg.norm(normal, axis=1))[:, None]
        size, least = np.linalg.norm(normal, axis=1), math.cos(math.radians(angle)) - ASIDE
        for one in self._solids(layer):
            near = (np.abs(one.distance(places.reshape(-1, 3))).reshape(places.shape[:2]) <= distance + slack).all(
                axis=1
            )
            if along:
                here, above, below = (
                    np.abs(one.distance(middle + edge_vector * normal)) for edge_vector in (0.0, 1.0, -1.0)
                )
                near &= np.maximum(above, below) - here >= least * size
            found |= near
        return found

    def _layer(self, layer: str) -> np.ndarray:
        if self.mesh.dim == 3:
            return self._solid(layer)
        if self.kind == g.ELEMENT:
            return _inside(self._curves(layer), self.places()[:, 0], layer)
        if self.now:
            raise CommandError(
                f"geometry '{layer}' present selects elements by their present centres; {self.kind}s on its lines are "
                "known in the mesh only: omit present"
            )
        pairs = self.mesh.layers[layer] if layer in self.mesh.layers else edges_on(self.mesh, self._curves(layer))
        if self.kind == g.NODE:
            return np.isin(self.numbers, pairs) | self._on_points(layer)
        rows = self.mesh.find_edges(self.edges, pairs)
        return np.isin(self.numbers, self.edges.faces[rows[rows >= 0]])

    def _solid(self, layer: str) -> np.ndarray:
        """Select in three dimensions: elements whose centre is inside a solid of the layer; nodes, and faces with all
        points, on the surface of one."""
        if layer in self.mesh.layers and self.kind != g.ELEMENT:
            if self.now:
                raise CommandError(f"{self.kind}s on '{layer}' are known in the mesh only: omit present")
            points = self.mesh.layers[layer]
            if self.kind == g.NODE:
                return np.isin(self.numbers, points)
            rows = self.mesh.find_edges(self.edges, points)
            return np.isin(self.numbers, self.edges.faces[rows[rows >= 0]])
        solids = self._solids(layer)
        places = self.places()
        if self.kind == g.ELEMENT:
            return np.any([one.distance(places[:, 0]) < 0.0 for one in solids], axis=0)
        slack = TOLERANCE * float(np.ptp(self.mesh.points, axis=0).max())
        return np.any([on_surface(one, places, slack) for one in solids], axis=0)

    def _solids(self, layer: str) -> list[Solid]:
        if layer not in self.project.layers:
            known = ", ".join(f"'{name}'" for name in {**self.mesh.layers, **dict.fromkeys(self.project.layers)})
            raise CommandError(f"there is no geometry layer '{layer}'; available: {known or 'none so far'}")
        return self.project.layers[layer]

    def _on_points(self, layer: str) -> np.ndarray:
        """Nodes on the single points of a layer, or on a line of which no edge of the mesh is a part."""
        found = np.zeros(len(self.numbers), bool)
        points = self.mesh.points[self.numbers]
        slack = TOLERANCE * float(np.ptp(self.mesh.points, axis=0).max())
        for curve in self.project.layers[layer] if layer in self.project.layers else ():
            if not curve.segments or layer not in self.mesh.layers:
                found |= geometry.distance(curve, points) <= slack
        return found

    def _curves(self, layer: str) -> list[geometry.Curve]:
        if layer not in self.project.layers:
            known = ", ".join(f"'{name}'" for name in {**self.mesh.layers, **dict.fromkeys(self.project.layers)})
            raise CommandError(f"there is no geometry layer '{layer}'; available: {known or 'none so far'}")
        return self.project.layers[layer]

    def _boundary(self) -> np.ndarray:
        """Flag objects without a neighbour, or next to a removed element."""
        alive, edges = self.project.alive, self.project.edges()
        there = np.append(alive, False)[np.where(edges.faces >= 0, edges.faces // 4, len(alive))]
        rim = there[:, 0] != there[:, 1]
        if self.kind == g.NODE:
            return np.isin(self.numbers, edges.points[rim])
        return np.isin(self.numbers, edges.faces[rim][there[rim]])

    def _of_elements(self, elements: np.ndarray) -> np.ndarray:
        if self.kind == g.JOINT:
            return np.isin(self.sides // 4, elements).all(axis=1)
        if self.kind == g.NODE:
            corners = np.zeros(self.mesh.cells.shape, bool)
            corners[elements] = self.mesh.cells[elements] >= 0
            return self._of_corners(corners.reshape(-1))
        return np.isin(self.numbers // 4, elements)


_MASKS: dict[type, Callable[..., np.ndarray]] = {
    g.InGroup: lambda of, group, set_name: of._in(of._members(group, set_name)),
    g.InSet: _Objects._of_set,
    g.Ids: _Objects._ids,
    g.Span: _Objects._span,
    g.OnLayer: _Objects._layer,
    g.OnBoundary: _Objects._boundary,
    g.OfElements: lambda of, group, set_name: of._of_elements(of.groups[g.ELEMENT].members(group, set_name)),
    g.OfElement: _Objects._of_element,
    g.Between: _Objects._between,
    g.Around: _Objects._around,
    g.Present: lambda of: np.ones(len(of.numbers), bool),
    g.UseHidden: lambda of, on: np.ones(len(of.numbers), bool),
    g.Not: _Objects._without,
    g.Sized: _Objects._sized,
    g.InCircle: _Objects._in_circle,
    g.Near: lambda of, layer, within: (of._away(layer) <= within + of._slack(TOLERANCE)).all(axis=1),
    g.Along: _Objects._along,
    g.Crossed: _Objects._crossed,
    g.OnCrack: _Objects._on_crack,
}
"""Functions that flag the objects selected by a term, by its type."""


def _bare(term: g.Term) -> g.Term:
    return term.term if isinstance(term, g.Not) else term


def _crossings(curves: list[geometry.Curve], points: np.ndarray, direction: tuple[float, ...]) -> np.ndarray:
    """(n,) how often rays from points cross lines, arcs by their sides."""
    size = math.hypot(*direction)
    if len(direction) != 2 or size == 0.0:
        raise CommandError(f"ray-direction is a vector of two numbers that is not zero, got {direction}")
    along = np.array(direction) / size
    turned = np.column_stack([along, [-along[1], along[0]]])
    u, v = (points @ turned).T
    count = np.zeros(len(points), np.int64)
    for curve in curves:
        sides = curve.points if not curve.bulges.any() else geometry.sampled(curve, curve.length() / SIDES)
        ends = sides @ turned
        for (au, av), (bu, bv) in zip(ends, np.roll(ends, -1, axis=0)[: len(ends) - (not curve.closed)]):
            across = (av > v) != (bv > v)
            if across.any():
                count[across] += u[across] < au + (v[across] - av) * (bu - au) / (bv - av)
    return count


SIDES = 1440
"""Number of sides per closed curve that replace its arcs in queries of its inside."""


def _inside(curves: list[geometry.Curve], points: np.ndarray, layer: str) -> np.ndarray:
    """(n,) bool: an odd number of sides of the closed curves lies to the right of the point (even-odd rule)."""
    outlines = [curve for curve in curves if curve.closed]
    if not outlines:
        raise CommandError(f"layer '{layer}' has no closed line, so it has no inside")
    odd = np.zeros(len(points), bool)
    x, y = points.T
    for curve in outlines:
        straight = not curve.bulges.any()
        sides = curve.points if straight else geometry.sampled(curve, curve.length() / SIDES)
        for (ax, ay), (bx, by) in zip(sides, np.roll(sides, -1, axis=0)):
            across = (ay > y) != (by > y)
            if across.any():
                odd[across] ^= x[across] < ax + (y[across] - ay) * (bx - ax) / (by - ay)
    return odd

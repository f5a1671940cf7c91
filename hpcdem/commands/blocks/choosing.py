"""Ranges: which elements, nodes, faces and joints a command is meant for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hpcdem.errors import CommandError
from hpcdem.model.blocks import groups as g
from hpcdem.model.blocks.connectivity import centroids, face_points, find_edges
from hpcdem.pre.mesh import geometry
from hpcdem.pre.mesh.cracks import TOLERANCE, edges_on

if TYPE_CHECKING:
    from hpcdem.commands.blocks.project import Project

NEAR = 1e-9
"""Bounds of x and y reach so much of the size of the model further: coordinates of meshes are rounded."""


def chosen(project: Project, kind: str, where: g.Range | None) -> np.ndarray | None:
    """Ascending numbers of the objects of this kind that a range chooses; None stands for all. CommandError if it
    chooses nothing."""
    if where is None:
        return None
    objects = _Objects(project, kind)
    mask = np.ones(len(objects.numbers), bool)
    for term in where:
        mask &= objects.mask(term)
    if not mask.any():
        raise CommandError(f"the range chooses no {kind}" + _why(objects, where))
    return objects.numbers[mask]


def everything(project: Project, kind: str, where: g.Range | None) -> np.ndarray:
    """The same as numbers in any case."""
    found = chosen(project, kind, where)
    return _Objects(project, kind).numbers if found is None else found


def _why(objects: _Objects, where: g.Range) -> str:
    """Which of several terms is fulfilled by nothing at all."""
    if len(where) == 1:
        return ""
    empty = [type(term).__name__ for term in where if not objects.mask(term).any()]
    return "; each of its terms alone chooses some" if not empty else ""


_ONLY_JOINTS = (g.Between, g.OnCrack)
_NOT_ELEMENTS = (g.OnBoundary, g.OfElements)


class _Objects:
    """All objects of a kind: numbers (n,), the corners of an element or ends of a face as point numbers (n, k)."""

    def __init__(self, project: Project, kind: str) -> None:
        self.project, self.kind = project, kind
        self.mesh = mesh = project.whole_mesh()
        self.groups = project.groups
        if kind == g.ELEMENT:
            self.numbers = np.arange(len(mesh.cells))
        elif kind == g.NODE:
            self.numbers = np.arange(len(mesh.points))
        else:
            self.edges = edges = project.edges()
            if kind == g.JOINT:
                self.sides = edges.faces[edges.inner]
                self.numbers = self.sides[:, 0]
            else:
                self.numbers = np.sort(edges.faces[edges.faces >= 0])
            self.ends = face_points(mesh.cells, self.numbers)

    def mask(self, term: g.Term) -> np.ndarray:
        """(n,) bool: which of them a term holds for."""
        if isinstance(term, _ONLY_JOINTS) and self.kind != g.JOINT:
            raise CommandError(f"{term} makes no sense for {self.kind}s")
        if isinstance(term, _NOT_ELEMENTS) and self.kind == g.ELEMENT:
            raise CommandError(f"{term} makes no sense for elements")
        match term:
            case g.InGroup(group, set_name):
                return np.isin(self.numbers, self.groups[self.kind].members(group, set_name))
            case g.InSet(set_name):
                of = self.groups[self.kind].of_set(set_name)
                return np.isin(self.numbers, np.concatenate([np.empty(0, np.int64), *of.values()]))
            case g.Ids(first, last):
                return self._ids(first, last)
            case g.Span(axis, low, high):
                return self._span(axis, low, high)
            case g.OnLayer(layer):
                return self._layer(layer)
            case g.OnBoundary():
                return self._boundary()
            case g.OfElements(group, set_name):
                return self._of_elements(self.groups[g.ELEMENT].members(group, set_name))
            case g.Between(one, other, set_name):
                groups = self.groups[g.ELEMENT]
                a, b = (np.isin(self.sides // 4, groups.members(name, set_name)) for name in (one, other))
                return (a[:, 0] & b[:, 1]) | (a[:, 1] & b[:, 0])
            case g.OnCrack():
                rows = find_edges(self.edges, self.mesh.cracks, len(self.mesh.points))
                return np.isin(self.numbers, self.edges.faces[rows[rows >= 0], 0])
        raise AssertionError(term)

    def _ids(self, first: int, last: int) -> np.ndarray:
        if first > last:
            raise CommandError(f"id {first} {last}: the first number is above the last")
        mask = (self.numbers >= first) & (self.numbers <= last)
        if first == last and not mask.any():
            raise CommandError(f"there is no {self.kind} {first}; numbers go from 0 to {int(self.numbers[-1])}")
        return mask

    def _span(self, axis: int, low: float, high: float) -> np.ndarray:
        if low > high:
            raise CommandError(f"{'xy'[axis]} {low:g} {high:g}: the first bound is above the second")
        xy = self.project.positions()
        slack = NEAR * float(np.ptp(self.mesh.points, axis=0).max())
        if self.kind == g.ELEMENT:
            at = centroids(xy, self.mesh.cells)[:, axis]
        else:
            at = xy[:, axis]
        inside = (at >= low - slack) & (at <= high + slack)
        return inside if self.kind in (g.ELEMENT, g.NODE) else inside[self.ends].all(axis=1)

    def _layer(self, layer: str) -> np.ndarray:
        if self.kind == g.ELEMENT:
            return _inside(self._curves(layer), self.mesh.centroids(), layer)
        pairs = self.mesh.layers[layer] if layer in self.mesh.layers else edges_on(self.mesh, self._curves(layer))
        if self.kind == g.NODE:
            return np.isin(self.numbers, pairs) | self._on_points(layer)
        rows = find_edges(self.edges, pairs, len(self.mesh.points))
        return np.isin(self.numbers, self.edges.faces[rows[rows >= 0]])

    def _on_points(self, layer: str) -> np.ndarray:
        """Nodes on the single points of a layer, or on a line of which no edge of the mesh is a part."""
        found = np.zeros(len(self.numbers), bool)
        slack = TOLERANCE * float(np.ptp(self.mesh.points, axis=0).max())
        for curve in self.project.layers[layer] if layer in self.project.layers else ():
            if not curve.segments or layer not in self.mesh.layers:
                found |= geometry.distance(curve, self.mesh.points) <= slack
        return found

    def _curves(self, layer: str) -> list[geometry.Curve]:
        if layer not in self.project.layers:
            known = ", ".join(f"'{name}'" for name in {**self.mesh.layers, **dict.fromkeys(self.project.layers)})
            raise CommandError(f"there is no geometry layer '{layer}'; there is {known or 'none so far'}")
        return self.project.layers[layer]

    def _boundary(self) -> np.ndarray:
        """Beside nothing, or beside an element that was taken out."""
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
            corners = self.mesh.cells[elements]
            return np.isin(self.numbers, corners[corners >= 0])
        return np.isin(self.numbers // 4, elements)


SIDES = 1440
"""Arcs of an outline stand for so many sides per closed curve when it is asked what lies inside."""


def _inside(curves: list[geometry.Curve], points: np.ndarray, layer: str) -> np.ndarray:
    """(n,) bool: an odd number of sides of the closed curves lies to the right of the point (even-odd rule)."""
    outlines = [curve for curve in curves if curve.closed]
    if not outlines:
        raise CommandError(f"layer '{layer}' has no closed line, so nothing lies inside of it")
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

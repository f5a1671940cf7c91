"""Quads are halved where a mesh is too coarse; where a neighbour has a point on a side it is cut into triangles."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.pre.mesh import fit, refine
from hpcdem.pre.mesh.remade import Moved, Remade, named
from hpcdem.pre.mesh.sizes import not_too_many, positive

Quad = tuple[int, int, int, int]
SHARP = 1e-9
"""Distance over the length of a side below which a point is on a line."""


def densified(mesh: Mesh, elements: np.ndarray, pattern: Sequence[int], most: Sequence[float]) -> Remade:
    """Return the mesh in which the quads among these elements are no longer than `most` (x, y) [m] along the directions
    of the pattern (x, y: 1, or 0: unchanged). Neighbours differ by a factor of at most two. The first piece of an
    element keeps its number, others follow at the end. CommandError if nothing changes.
    """
    if mesh.dim == 3:
        raise CommandError("densify supports quads in two dimensions only")
    if not any(pattern):
        raise CommandError("pattern 0 0 has no effect")
    for wanted, size in zip(pattern, most):
        if wanted:
            positive(size, "maximum-length")
    quads = elements[mesh.cells[elements, 3] >= 0]
    if not len(quads):
        raise CommandError("the range selects no quad: densify halves quads")
    _not_too_many(mesh, quads, pattern, most)
    tree = _Tree(mesh, pattern)
    for e in quads.tolist():
        tree.until(e, most)
    tree.even_out()
    return tree.made()


def _not_too_many(mesh: Mesh, quads: np.ndarray, pattern: Sequence[int], most: Sequence[float]) -> None:
    corners = mesh.points[mesh.cells[quads]]
    pieces = np.ones(len(quads))
    for axis in (0, 1):
        if pattern[axis]:
            length = np.ptp(corners[:, :, axis], axis=1)
            pieces *= 2.0 ** np.maximum(np.ceil(np.log2(np.maximum(length / most[axis], 1e-300)) - 1e-9), 0.0)
    not_too_many(float(pieces.sum()), f"maximum-length {' '.join(f'{size:g}' for size in most)}")


class _Tree:
    """Leaves: quads, by the element they are pieces of; middles: points that halve sides, by their ends."""

    def __init__(self, mesh: Mesh, pattern: Sequence[int]) -> None:
        self.mesh, self.pattern = mesh, pattern
        self.points = [tuple(at) for at in mesh.points.tolist()]
        self.middles: dict[tuple[int, int], int] = {}
        self.leaves: dict[int, list[Quad]] = {
            e: [tuple(mesh.cells[e].tolist())] for e in np.flatnonzero(mesh.cells[:, 3] >= 0).tolist()
        }

    def _middle(self, a: int, b: int) -> int:
        key = min(a, b), max(a, b)
        if key not in self.middles:
            self.middles[key] = len(self.points)
            (ax, ay), (bx, by) = self.points[key[0]], self.points[key[1]]
            self.points.append((0.5 * (ax + bx), 0.5 * (ay + by)))
        return self.middles[key]

    def _sides(self, quad: Quad) -> tuple[int, int]:
        """Along which axis the first side of a quad runs, and along which the second."""
        (ax, ay), (bx, by), (cx, cy), (dx, dy) = (self.points[p] for p in quad)
        along = abs(bx - ax + cx - dx), abs(by - ay + cy - dy)
        first = 0 if along[0] >= along[1] else 1
        return first, 1 - first

    def _halved(self, quad: Quad, first: bool, second: bool) -> list[Quad]:
        """Return the pieces of a quad: the first side halved (and the one across), the second, or both."""
        a, b, c, d = quad
        if first and second:
            ab, bc, cd, da = (self._middle(*pair) for pair in ((a, b), (b, c), (c, d), (d, a)))
            m = len(self.points)
            x, y = zip(*(self.points[p] for p in quad))
            self.points.append((0.25 * sum(x), 0.25 * sum(y)))
            return [(a, ab, m, da), (ab, b, bc, m), (m, bc, c, cd), (da, m, cd, d)]
        if first:
            ab, cd = self._middle(a, b), self._middle(c, d)
            return [(a, ab, cd, d), (ab, b, c, cd)]
        bc, da = self._middle(b, c), self._middle(d, a)
        return [(a, b, bc, da), (da, bc, c, d)]

    def until(self, e: int, most: Sequence[float]) -> None:
        """Halve an element until it is short enough."""
        left, done = self.leaves[e], []
        while left:
            quad = left.pop()
            xy = np.array([self.points[p] for p in quad])
            long = [
                bool(self.pattern[axis]) and float(np.ptp(xy[:, axis])) > most[axis] * (1.0 + SHARP) for axis in (0, 1)
            ]
            sides = self._sides(quad)
            if any(long):
                left += self._halved(quad, long[sides[0]], long[sides[1]])[::-1]
            else:
                done.append(quad)
        self.leaves[e] = done

    def even_out(self) -> None:
        """Halve quads with more than one point on a side, until none has."""
        again = True
        while again:
            again = False
            for e, quads in self.leaves.items():
                new: list[Quad] = []
                for quad in quads:
                    deep = [self._deep(quad[k], quad[(k + 1) % 4]) for k in range(4)]
                    first, second = deep[0] or deep[2], deep[1] or deep[3]
                    if first or second:
                        if all(self.pattern):
                            first = second = True
                        again = True
                        new += self._halved(quad, first, second)
                    else:
                        new.append(quad)
                self.leaves[e] = new

    def _deep(self, a: int, b: int) -> bool:
        """Return whether the side a-b carries more than one hanging point."""
        m = self.middles.get((min(a, b), max(a, b)))
        return m is not None and any((min(p, m), max(p, m)) in self.middles for p in (a, b))

    def _chain(self, a: int, b: int) -> list[int]:
        """Points on a side, without its ends."""
        m = self.middles.get((min(a, b), max(a, b)))
        return [] if m is None else [*self._chain(a, m), m, *self._chain(m, b)]

    def made(self) -> Remade:
        points = np.array(self.points)
        first: list[Sequence[int]] = []
        more: list[Sequence[int]] = []
        parent: list[int] = []
        for e, corners in enumerate(self.mesh.cells.tolist()):
            whole = [p for p in corners if p >= 0]
            pieces: list[Sequence[int]] = []
            for leaf in self.leaves.get(e, [tuple(whole)]):
                pieces += self._cut(leaf, points)
            first.append(pieces[0])
            more += pieces[1:]
            parent += [e] * (len(pieces) - 1)
        cells = np.array([[*cell, -1] if len(cell) == 3 else cell for cell in (*first, *more)], np.int64)
        rows = np.concatenate([np.arange(len(first)), np.array(parent, np.int64)])
        mesh = self.mesh
        number = np.arange(len(mesh.points))
        pieces_of: dict[tuple[int, ...], list[tuple[int, ...]]] = {}
        for a, b in mesh.edges().points.tolist():
            chain = [min(a, b), *self._chain(min(a, b), max(a, b)), max(a, b)]
            if len(chain) > 2:
                pieces_of[chain[0], chain[-1]] = [(min(p, q), max(p, q)) for p, q in pairwise(chain)]
        moved = Moved(number, pieces=pieces_of)
        return Remade(named(mesh, points, cells, rows, moved), number, rows, moved)

    def _cut(self, leaf: Sequence[int], points: np.ndarray) -> list[Sequence[int]]:
        """The leaf itself, or triangles if there are points on its sides."""
        outline = [p for k, a in enumerate(leaf) for p in (a, *self._chain(a, leaf[(k + 1) % len(leaf)]))]
        if len(outline) == len(leaf):
            return [leaf]
        size = float(np.ptp(points[list(leaf)], axis=0).max())
        return [*refine.triangles(outline, points[outline], SHARP * size, fit.places(points[[leaf[0]]]))]

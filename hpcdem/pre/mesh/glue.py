"""Bodies that were meshed separately become one where their faces lie on each other.

Points in one place are merged. Sides of hexahedra are cut from their lowest point (`hexahedra.split`), so where
tetrahedra have another diagonal points change their numbers; what fits in no numbering, and faces of other sizes, are
cut into the pieces that both sides have in common (`refine.py`).
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.numerics import clusters
from hpcdem.physics.fdem import hexahedra
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.pre.mesh import fit, refine
from hpcdem.pre.mesh.remade import Moved, Remade


@dataclass(frozen=True)
class Glued(Remade):
    """Result of `glued`. faces: number of pairs of faces that became inner faces; cut: number of elements cut;
    tolerance [m].
    """

    faces: int
    tolerance: float
    cut: int = 0


def glued(mesh: Mesh, tolerance: float | None = None, between: tuple[np.ndarray, np.ndarray] | None = None) -> Glued:
    """Make faces that coincide within `tolerance` [m] inner faces. Elements keep their numbers, and pieces of cut
    elements follow; of merged points the lowest keeps its position.

    between: elements (ne,) bool of the two sides; other faces do not change. CommandError, with the position, if no
    faces coincide, if faces cannot be cut to fit, if bodies overlap there, or if the tolerance would merge points of
    one element.
    """
    free = _between(fit.free_faces(mesh), between)
    if not len(free.faces):
        raise CommandError("no face on a surface belongs to an element of these groups")
    tolerance = free.tolerance() if tolerance is None else tolerance
    spot = _spots(free, tolerance)
    pairs = _touching(free, spot, tolerance, between)
    if not len(pairs) and free.bodies == 1:
        same = np.arange(len(mesh.points))
        return Glued(mesh, same, np.arange(len(mesh.cells)), Moved(same, {}, {}), 0, tolerance)
    if not len(pairs):
        raise CommandError(
            f"no faces of different bodies coincide within {tolerance:g} m, so there is nothing to glue. Check the "
            "bodies, or use a larger tolerance"
        )
    one, number, quads = _merged(mesh, free, spot, pairs)
    flat = np.flatnonzero(one.areas() <= 0.0)
    if len(flat):
        raise CommandError(f"with the tolerance {tolerance:g} m element {flat[0]} would have no area")
    faces = int((one.face_partners() >= 0).sum() - (mesh.face_partners() >= 0).sum()) // 2
    left = _between(fit.free_faces(one), between)
    still = _touching(left, np.arange(len(one.points)), tolerance, between)
    made = refine.refined(one, left, still, tolerance)
    flags = None if between is None else (made.flags(between[0]), made.flags(between[1]))
    rest = _between(fit.free_faces(made.mesh), flags)
    lost = fit.lying(rest, tolerance) if len(rest.faces) else np.empty((0, 2), np.int64)
    lost = lost[_allowed(rest, lost, flags)]
    if len(lost):
        raise CommandError(
            f"faces of the elements {made.parent[rest.faces[lost[0]] // 4].tolist()} at "
            f"{fit.places(rest.at[lost[:1, 0]].mean(axis=1))} cannot be glued: use the same points in the meshes of "
            "both bodies"
        )
    moved = Moved(number, quads, made.pieces)
    whole = Mesh.of(
        made.mesh.points,
        made.mesh.cells,
        {name: {group: made.with_pieces(rows) for group, rows in of.items()} for name, of in mesh.groups.items()},
        {name: moved.faces(rows)[0] for name, rows in mesh.layers.items()},
        *_cracks(mesh, moved),
        macros=made.mesh.macros,
    )
    return Glued(whole, number, made.parent, moved, faces + made.faces, tolerance, made.cut)


def _cracks(mesh: Mesh, moved: Moved) -> tuple[np.ndarray, np.ndarray]:
    rows, of = moved.faces(mesh.cracks)
    return rows, mesh.crack_sets[of]


def _between(free: fit.Free, between: tuple[np.ndarray, np.ndarray] | None) -> fit.Free:
    """The faces of the two sides."""
    if between is None:
        return free
    return free.of(np.flatnonzero(between[0][free.faces // 4] | between[1][free.faces // 4]))


def _spots(free: fit.Free, tolerance: float) -> np.ndarray:
    """(np,) the lowest of the surface points nearer to each other than the tolerance; CommandError if two are of one
    element."""
    mesh = free.mesh
    spot = clusters.spots(mesh.points, tolerance, np.unique(free.points))
    corners = np.where(mesh.cells >= 0, spot[mesh.cells], -1)
    order = np.argsort(corners, axis=1, kind="stable")
    ranked = np.take_along_axis(corners, order, axis=1)
    same = np.argwhere(ranked[:, 1:] == ranked[:, :-1])
    if len(same):
        e, k = same[0]
        p, q = sorted(mesh.cells[e, order[e, k : k + 2]].tolist())
        raise CommandError(
            f"the tolerance {tolerance:g} m is too large: points {p} and {q} of one element at "
            f"{fit.places(mesh.points[p : p + 1])} would become one"
        )
    return spot


def _touching(
    free: fit.Free, spot: np.ndarray, tolerance: float, between: tuple[np.ndarray, np.ndarray] | None
) -> np.ndarray:
    """(m, 2) rows of faces that lie on each other, back to back, and of the halves of quads that are cut along
    different diagonals; CommandError if bodies overlap there."""
    if not len(free.faces):
        return np.empty((0, 2), np.int64)
    corners = spot[free.points]
    _refuse_overlap(free, corners, between)
    pairs = [fit.lying(free, tolerance)]
    if free.mesh.dim == 3:
        quads = fit.cut_otherwise(free, corners)
        pairs += [np.sort(quads[:, [a, b]], axis=1) for a in (0, 1) for b in (2, 3)]
    found = np.unique(np.concatenate(pairs), axis=0)
    return found[_allowed(free, found, between)]


def _allowed(free: fit.Free, pairs: np.ndarray, between: tuple[np.ndarray, np.ndarray] | None) -> np.ndarray:
    if between is None:
        return np.ones(len(pairs), bool)
    one, other = (flags[free.faces // 4] for flags in between)
    i, j = pairs.T
    return np.asarray((one[i] & other[j]) | (other[i] & one[j]))


def _refuse_overlap(free: fit.Free, corners: np.ndarray, between: tuple[np.ndarray, np.ndarray] | None) -> None:
    """Raise CommandError if faces with the same corners have the same normal, or if three faces share them."""
    key = np.sort(corners, axis=1)
    order = np.lexsort((free.faces, *key.T[::-1]))
    same = np.flatnonzero((key[order[1:]] == key[order[:-1]]).all(axis=1))
    pairs = np.column_stack([order[same], order[same + 1]])
    pairs = pairs[_allowed(free, pairs, between) & (free.body[pairs[:, 0]] != free.body[pairs[:, 1]])]
    i, j = pairs.T
    wrong = np.flatnonzero((free.normal[i] * free.normal[j]).sum(axis=1) > 0.0)
    if not len(wrong):
        wrong = np.flatnonzero(np.isin(i, j))
    if len(wrong):
        a, b = free.faces[pairs[wrong[0]]] // 4
        at = fit.places(free.at[i[wrong[:1]]].mean(axis=1))
        raise CommandError(
            f"elements {a} and {b} lie on the same side of their common face at {at}: the bodies overlap"
        )


def _merged(
    mesh: Mesh, free: fit.Free, spot: np.ndarray, pairs: np.ndarray
) -> tuple[Mesh, np.ndarray, dict[tuple[int, ...], list[tuple[int, ...]]]]:
    """The mesh with the points of these pairs of faces merged and numbered so that sides of hexahedra are cut as
    tetrahedra on them are; the new number of each point; halves of sides that are cut otherwise now, by the sorted
    points of both halves together and of each."""
    of = free.points[pairs]  # (m, 2, dim)
    same = spot[of[:, 0, :, None]] == spot[of[:, 1, None, :]]
    k, a, b = np.nonzero(same)
    lead, number = np.unique(clusters.united(len(mesh.points), of[k, 0, a], of[k, 1, b]), return_inverse=True)
    number = number.reshape(-1)
    if not len(mesh.hexes):
        cells = np.where(mesh.cells >= 0, number[mesh.cells], -1)
        return Mesh.of(mesh.points[lead], cells), number, {}
    order = _numbered(mesh, free, number, len(lead))
    number, points = order[number], np.empty((len(lead), 3))
    points[order] = mesh.points[lead]
    table = np.column_stack([number[mesh.hexes[:, :8]], mesh.hexes[:, 8]])
    cells = number[mesh.cells]
    cells[table[:, 8, None] + np.arange(hexahedra.PARTS)] = hexahedra.split(table[:, :8])
    made = Mesh.of(points, cells, macros=table)
    before = np.sort(number[mesh.face_points(hexahedra.halves(mesh.cells, mesh.hexes).ravel())], axis=1).reshape(
        -1, 2, 3
    )
    after = np.sort(made.face_points(hexahedra.halves(made.cells, made.hexes).ravel()), axis=1).reshape(-1, 2, 3)
    changed = ~((before == after) | (before == after[:, ::-1])).all(axis=(1, 2))
    halves: dict[tuple[int, ...], list[tuple[int, ...]]] = {}
    for old, new in zip(before[changed].tolist(), after[changed].tolist(), strict=True):
        # Of a group or layer both halves come: each stands for one.
        halves.update((tuple(one), [tuple(other)]) for one, other in zip(sorted(old), sorted(new), strict=True))
    return made, number, halves


def _numbered(mesh: Mesh, free: fit.Free, number: np.ndarray, n: int) -> np.ndarray:
    """(n,) new numbers of points, such that of each side of a hexahedron with two faces of tetrahedra on it the lowest
    point is on their diagonal, as far as that can be; all stay as they are where it is so already."""
    sides, cuts = _wanted_cuts(mesh, free, number)
    here = np.arange(n)
    low = np.where(sides == cuts[:, :1], True, sides == cuts[:, 1:])
    if low[np.arange(len(sides)), np.argmin(sides, axis=1)].all():
        return here
    of_point: dict[int, list[int]] = {}
    for k, side in enumerate(sides.tolist()):
        for p in side:
            of_point.setdefault(p, []).append(k)
    off = {p: sum(p not in cuts[k] for k in of) for p, of in of_point.items()}
    open_sides = set(range(len(sides)))
    ready = [p for p in off if not off[p]]
    heapq.heapify(ready)
    order: list[int] = []
    done: set[int] = set()
    slots = sorted(of_point)
    while len(order) < len(slots):
        if not ready:  # no numbering fits all: the lowest point that is left comes next
            heapq.heappush(ready, next(p for p in slots if p not in done))
        p = heapq.heappop(ready)
        if p in done:
            continue
        done.add(p)
        order.append(p)
        for k in of_point[p]:
            if k in open_sides:
                open_sides.discard(k)
                for q in sides[k].tolist():
                    if q not in cuts[k]:
                        off[q] -= 1
                        if not off[q] and q not in done:
                            heapq.heappush(ready, q)
    here[order] = slots
    return here


def _wanted_cuts(mesh: Mesh, free: fit.Free, number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sides of hexahedra (k, 4) with two faces of tetrahedra on them, and the ends (k, 2) of the diagonal of these."""
    halves = hexahedra.halves(mesh.cells, mesh.hexes).reshape(-1, 2)
    both = number[mesh.face_points(halves.ravel())].reshape(-1, 6)
    sides = np.array([np.unique(row) for row in both]).reshape(-1, 4)
    partner = mesh.face_partners()
    outside = mesh.macro_of() < 0
    over = partner[halves]
    tets = (over >= 0).all(axis=1) & outside[np.maximum(over, 0) // 4].all(axis=1)
    found = {}
    for side, one in zip(sides[tets].tolist(), both[tets].tolist(), strict=True):
        found[tuple(side)] = sorted(set(one[:3]) & set(one[3:]))
    # Free faces of tetrahedra in twos.
    wanted = {tuple(side) for side in sides[(over < 0).all(axis=1)].tolist()}
    corners = number[free.points[outside[free.faces // 4]]]
    edges: dict[tuple[int, int], list[int]] = {}
    for row in corners.tolist():
        for a, b in zip(row, row[1:] + row[:1], strict=True):
            lone = next(p for p in row if p not in (a, b))
            edges.setdefault((min(a, b), max(a, b)), []).append(lone)
    for cut, lone in edges.items():
        for m, a in enumerate(lone):
            for b in lone[m + 1 :]:
                side = tuple(sorted((*cut, a, b)))
                if side in wanted:
                    found[side] = list(cut)
    return np.array(list(found), np.int64).reshape(-1, 4), np.array(list(found.values()), np.int64).reshape(-1, 2)

"""Bodies that were meshed separately become one: where their faces coincide, points are merged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.connectivity import bodies, face_partners, face_points
from hpcdem.physics.fdem.mesh import Mesh

TOLERANCE = 1e-3
"""Points of two bodies are one if they are nearer than this part of the shortest edge on a surface."""


@dataclass(frozen=True)
class Glued:
    """mesh; faces: how many pairs of faces are inner edges now; points (np,): the number in it of each point before;
    tolerance [m]."""

    mesh: Mesh
    faces: int
    points: np.ndarray
    tolerance: float


def glued(mesh: Mesh, tolerance: float | None = None, between: tuple[np.ndarray, np.ndarray] | None = None) -> Glued:
    """Faces of different bodies whose ends are nearer than `tolerance` [m] become inner edges. Elements keep their
    numbers; of points that become one the lowest stays where it is.

    between: elements (ne,) bool of the two sides; faces between others stay as they are. CommandError, with the place,
    if nothing coincides, if faces lie on each other only in part, if bodies overlap there, or if the tolerance would
    make points of one body one.
    """
    partner = face_partners(mesh.cells, len(mesh.points))
    body = bodies(partner)
    real = np.ones(len(partner), bool)
    real[3::4] = mesh.cells[:, 3] >= 0
    faces = np.flatnonzero(real & (partner < 0))
    side = np.zeros((len(faces), 2), bool)
    if between is None:
        side[:] = True
    else:
        side[:, 0], side[:, 1] = (flags[faces // 4] for flags in between)
        faces, side = faces[side.any(axis=1)], side[side.any(axis=1)]
    if not len(faces):
        raise CommandError("no face on a surface belongs to an element of these groups")
    ends = face_points(mesh.cells, faces)
    way = mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]]
    shortest = float(np.hypot(way[:, 0], way[:, 1]).min())
    tolerance = TOLERANCE * shortest if tolerance is None else tolerance
    of = body[faces // 4]
    spot = _spots(mesh, ends, of, tolerance)
    pairs = _coinciding(mesh, faces, ends, of, side, spot)
    single = np.ones(len(faces), bool)
    single[pairs] = False
    _refuse_partial(mesh, faces[single], ends[single], of[single], side[single], tolerance)
    if not len(pairs):
        raise CommandError(
            f"no faces of different bodies coincide within {tolerance:g} m: there is nothing to glue; a larger "
            "tolerance may help"
        )
    i, j = pairs.T
    one, other = np.concatenate([ends[i, 0], ends[i, 1]]), np.concatenate([ends[j, 1], ends[j, 0]])
    point = _united(len(mesh.points), one, other)
    lead = np.unique(point)
    number = np.searchsorted(lead, point)
    cells = np.where(mesh.cells >= 0, number[mesh.cells], -1)
    layers = {name: number[rows] for name, rows in mesh.layers.items()}
    made = Mesh.of(mesh.points[lead], cells, mesh.groups, layers, number[mesh.cracks], mesh.crack_sets)
    flat = np.flatnonzero(made.areas() <= 0.0)
    if len(flat):
        raise CommandError(f"with the tolerance {tolerance:g} m element {flat[0]} would have no area")
    return Glued(made, len(pairs), number, tolerance)


def _united(n: int, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(n,) lowest member of the set that each of n things is in, when those of one and other (m,) are joined."""
    _, part = connected_components(coo_array((np.ones(len(one)), (one, other)), shape=(n, n)), directed=False)
    low = np.full(part.max() + 1, n)
    np.minimum.at(low, part, np.arange(n))
    return low[part]


def _spots(mesh: Mesh, ends: np.ndarray, of: np.ndarray, tolerance: float) -> np.ndarray:
    """(np,) the lowest of the surface points nearer to each other than the tolerance; CommandError if two are of one
    body."""
    points, first = np.unique(ends, return_index=True)
    body = np.repeat(of, 2)[first]
    near = cKDTree(mesh.points[points]).query_pairs(tolerance, output_type="ndarray").reshape(-1, 2)
    same = near[body[near[:, 0]] == body[near[:, 1]]]
    if len(same):
        x, y = mesh.points[points[same[0, 0]]]
        raise CommandError(
            f"the tolerance {tolerance:g} m is too large: points {points[same[0, 0]]} and {points[same[0, 1]]} of one "
            f"body at ({x:g}, {y:g}) would become one"
        )
    return _united(len(mesh.points), points[near[:, 0]], points[near[:, 1]])


def _coinciding(
    mesh: Mesh, faces: np.ndarray, ends: np.ndarray, of: np.ndarray, side: np.ndarray, spot: np.ndarray
) -> np.ndarray:
    """(m, 2) rows of faces whose ends are in the same spots, in opposite order."""
    key = np.sort(spot[ends], axis=1)
    order = np.lexsort((faces, key[:, 1], key[:, 0]))
    at = np.flatnonzero((key[order[1:]] == key[order[:-1]]).all(axis=1))
    i, j = order[at], order[at + 1]
    use = (of[i] != of[j]) & ((side[i, 0] & side[j, 1]) | (side[i, 1] & side[j, 0]))
    i, j = i[use], j[use]
    wrong = np.flatnonzero(spot[ends[i, 0]] == spot[ends[j, 0]])
    if not len(wrong):
        wrong = np.flatnonzero(np.isin(i, j))
    if len(wrong):
        x, y = mesh.points[ends[i[wrong[0]]]].mean(axis=0)
        a, b = faces[i[wrong[0]]] // 4, faces[j[wrong[0]]] // 4
        raise CommandError(f"elements {a} and {b} lie on the same side of their common face at ({x:g}, {y:g}): bodies "
                           "overlap there")  # fmt: skip
    return np.column_stack([i, j])


def _refuse_partial(
    mesh: Mesh, faces: np.ndarray, ends: np.ndarray, of: np.ndarray, side: np.ndarray, tolerance: float
) -> None:
    """CommandError if two of these faces, of different bodies, lie on each other."""
    if not len(faces):
        return
    a, b = mesh.points[ends[:, 0]], mesh.points[ends[:, 1]]
    length = np.hypot(*(b - a).T)
    along = (b - a) / length[:, None]
    tree = cKDTree(0.5 * (a + b))
    for i, near in enumerate(tree.query_ball_point(0.5 * (a + b), 0.5 * (length + length.max()) + tolerance)):
        j = np.array(near, np.int64)
        j = j[(j > i) & (of[j] != of[i])]
        j = j[(side[i, 0] & side[j, 1]) | (side[i, 1] & side[j, 0])]
        t = [(p[j] - a[i]) @ along[i] for p in (a, b)]
        off = [np.abs((p[j] - a[i]) @ [-along[i, 1], along[i, 0]]) for p in (a, b)]
        low, high = np.maximum(np.minimum(*t), 0.0), np.minimum(np.maximum(*t), length[i])
        bad = np.flatnonzero((np.maximum(*off) <= tolerance) & (high - low > 2.0 * tolerance))
        if len(bad):
            k = bad[0]
            p, q = a[i] + along[i] * low[k], a[i] + along[i] * high[k]
            raise CommandError(
                f"faces of the elements {faces[i] // 4} and {faces[j[k]] // 4} lie on each other from ({p[0]:g}, "
                f"{p[1]:g}) to ({q[0]:g}, {q[1]:g}), but their ends do not coincide within {tolerance:g} m: mesh both "
                "bodies with the same points there"
            )

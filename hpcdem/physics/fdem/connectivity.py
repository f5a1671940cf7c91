"""Who is next to whom in a mesh of triangles and quads: pure functions of arrays, in linear time.

Numbers, used all over the blocks and free of ranks:

- a *corner* is element * 4 + k, k = 0..2 (triangle) or 0..3 (quad), counter-clockwise;
- a *face* is element * 4 + k: the edge of that element from corner k to the next one. The element lies to the left;
- an *edge* is one face on the surface of a body or two faces with the same end points. It, and the joint on it, has
  the number of its lower face.

Cells are (ne, 4) i8 point numbers, the fourth -1 for triangles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit


@dataclass(frozen=True)
class Edges:
    """The edges of a mesh in ascending order of their numbers (lower faces)."""

    faces: np.ndarray
    """(n, 2) i8: the lower face, which is the number of the edge and of its joint; the other face, -1 at a surface."""
    points: np.ndarray
    """(n, 2) i8 end points in the direction of the lower face; its element lies to the left."""

    def __len__(self) -> int:
        return len(self.faces)

    @property
    def inner(self) -> np.ndarray:
        """(n,) bool: the edge lies between two elements."""
        return self.faces[:, 1] >= 0


@njit(cache=True, nogil=True, error_model="numpy")
def _ends(cells, face):
    e, k = face // 4, face % 4
    n = 4 if cells[e, 3] >= 0 else 3
    return cells[e, k], cells[e, (k + 1) % n]


@njit(cache=True, nogil=True, error_model="numpy")
def _ends_of_faces(cells, points):
    for f in range(len(points)):
        points[f, 0] = -1
        if f % 4 < 3 or cells[f // 4, 3] >= 0:
            a, b = _ends(cells, f)
            points[f, 0], points[f, 1] = min(a, b), max(a, b)


def pair_faces(cells: np.ndarray, n_points: int, partner: np.ndarray) -> int:
    """Fill partner (4 ne,) i8; returns the lowest face whose edge is used by three or more elements, or -1."""
    points = np.empty((4 * len(cells), 2), np.int32)
    _ends_of_faces(cells, points)
    return int(pair_equal(points, n_points, partner))


@njit(cache=True, nogil=True, error_model="numpy")
def _in_order(points, n_points):
    """Faces sorted by their last point, then by the one before it, and so on, by counting: equal ones come to lie next
    to each other in ascending order."""
    before = np.flatnonzero(points[:, 0] >= 0).astype(np.int32)
    order = np.empty_like(before)
    for k in range(points.shape[1] - 1, -1, -1):
        begin = np.zeros(n_points + 1, np.int64)
        for f in before:
            begin[points[f, k] + 1] += 1
        for p in range(n_points):
            begin[p + 1] += begin[p]
        for f in before:
            order[begin[points[f, k]]] = f
            begin[points[f, k]] += 1
        order, before = before, order
    return before


@njit(cache=True, nogil=True, error_model="numpy")
def pair_equal(points, n_points, partner):
    """Fill partner (m,) i8 with the other face with the same points (m, k) i4, ascending in each row, the first -1: no
    face. Returns the lowest face of three or more with the same points, or -1."""
    partner[:] = -1
    order = _in_order(points, n_points)
    count = len(order)
    bad = -1
    i = 0
    while i < count:
        f = order[i]
        j = i + 1
        while j < count and (points[order[j]] == points[f]).all():
            j += 1
        if j - i == 2:
            partner[f], partner[order[i + 1]] = order[i + 1], f
        elif j - i > 2 and (bad < 0 or f < bad):
            bad = f
        i = j
    return bad


def face_partners(cells: np.ndarray, n_points: int) -> np.ndarray:
    """(4 ne,) i8: the face on the other side of each face; -1 at a surface and for the fourth face of a triangle.

    ValueError if three elements share an edge (`mesh.check` says which).
    """
    partner = np.empty(4 * len(cells), np.int64)
    bad = pair_faces(cells, n_points, partner)
    if bad >= 0:
        raise ValueError(f"the edge of face {bad} is used by more than two elements")
    return partner


def edges_of(cells: np.ndarray, n_points: int, partner: np.ndarray | None = None) -> Edges:
    """Return all edges, ascending by number; `partner` of `face_partners` if it is there already."""
    partner = face_partners(cells, n_points) if partner is None else partner
    face = np.arange(4 * len(cells))
    real = np.ones(len(face), bool)
    real[3::4] = cells[:, 3] >= 0
    lower = face[real & ((partner < 0) | (partner > face))]
    return Edges(np.column_stack([lower, partner[lower]]), face_points(cells, lower))


def face_points(cells: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(n, 2) i8 first and last point of each face."""
    e, k = np.divmod(faces, 4)
    after = np.where(k + 1 < corner_counts(cells[e]), k + 1, 0)
    return np.column_stack([cells[e, k], cells[e, after]])


def face_corners(cells: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(n, 2) i8 the same by corners, element * 4 + k."""
    e, k = np.divmod(faces, 4)
    return np.column_stack([faces, 4 * e + (k + 1) % corner_counts(cells[e])])


def corner_counts(cells: np.ndarray) -> np.ndarray:
    """(ne,) i8: 3 or 4."""
    return np.where(cells[:, 3] >= 0, 4, 3)


def find_edges(edges: Edges, pairs: np.ndarray, n_points: int) -> np.ndarray:
    """(k,) i8 rows of `edges` that join these pairs (k, 2) of points, in either direction; -1 where no edge does."""
    pairs = np.asarray(pairs, np.int64).reshape(-1, 2)
    if not len(pairs) or not len(edges):
        return np.full(len(pairs), -1, np.int64)
    key = edges.points.min(axis=1) * n_points + edges.points.max(axis=1)
    order = np.argsort(key, kind="stable")
    wanted = pairs.min(axis=1) * n_points + pairs.max(axis=1)
    at = np.minimum(np.searchsorted(key[order], wanted), len(key) - 1)
    row = order[at]
    return np.where(key[row] == wanted, row, -1)


@njit(cache=True, nogil=True, error_model="numpy")
def root_of(parent, i):
    """The lowest member of the cluster of i."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True, nogil=True, error_model="numpy")
def join_corners(parent, a, b):
    """Make one cluster of those of a and b."""
    # The lower number becomes the root, so a cluster is known by its lowest member.
    a, b = root_of(parent, a), root_of(parent, b)
    if a < b:
        parent[b] = a
    else:
        parent[a] = b


@njit(cache=True, nogil=True, error_model="numpy")
def _corner_roots(cells, partner, jointed, parent):
    for c in range(len(parent)):
        parent[c] = c
    for f in range(len(parent)):
        g = partner[f]
        if g < f or jointed[f] or jointed[g]:
            continue
        e, k, d, m = f // 4, f % 4, g // 4, g % 4
        e_next = e * 4 + (k + 1) % (4 if cells[e, 3] >= 0 else 3)
        d_next = d * 4 + (m + 1) % (4 if cells[d, 3] >= 0 else 3)
        join_corners(parent, f, d_next)  # a face and its first corner have the same number
        join_corners(parent, e_next, g)
    for c in range(len(parent)):
        parent[c] = root_of(parent, c)


def corner_clusters(cells: np.ndarray, partner: np.ndarray, jointed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the nodes: sets of corners at one point that are connected through faces without a joint.

    `jointed` (4 ne,) bool marks the faces with a joint (one face of the two is enough). Returns (node (ne, 4) i8 of
    each corner, -1 for the fourth of a triangle; lead (nn,) i8, the lowest corner of each node). Nodes are numbered
    by ascending lead. Without joints that is an ordinary finite element mesh, except where bodies touch in a single
    point: there each has a node of its own.
    """
    root = np.empty(4 * len(cells), np.int64)
    _corner_roots(cells, partner, np.asarray(jointed, bool), root)
    real = np.ones(len(root), bool)
    real[3::4] = cells[:, 3] >= 0
    lead = np.flatnonzero(real & (root == np.arange(len(root))))
    number = np.full(len(root), -1, np.int64)
    number[lead] = np.arange(len(lead))
    return np.where(real, number[root], -1).reshape(-1, 4), lead


@njit(cache=True, nogil=True, error_model="numpy")
def _element_roots(partner, parent):
    for e in range(len(parent)):
        parent[e] = e
    for f in range(len(partner)):
        if partner[f] > f:
            join_corners(parent, f // 4, partner[f] // 4)
    for e in range(len(parent)):
        parent[e] = root_of(parent, e)


def bodies(partner: np.ndarray) -> np.ndarray:
    """(ne,) i8 number of the body of each element, bodies counted by their lowest element.

    Elements of one body are connected through faces with a partner; set partner[face] = -1 on both sides to cut there.
    """
    root = np.empty(len(partner) // 4, np.int64)
    _element_roots(partner, root)
    return np.unique(root, return_inverse=True)[1].astype(np.int64)


@njit(cache=True, nogil=True, error_model="numpy")
def _walk(cells, partner, order, starts):
    seen = np.zeros(len(partner), np.bool_)
    n = loops = 0
    for first in range(len(partner)):
        if seen[first] or partner[first] >= 0 or (first % 4 == 3 and cells[first // 4, 3] < 0):
            continue
        starts[loops] = n
        loops += 1
        f = first
        while not seen[f]:
            seen[f] = True
            order[n] = f
            n += 1
            # Turn about the end point from element to element of the same body until its next surface face.
            e, k = f // 4, f % 4
            f = e * 4 + (k + 1) % (4 if cells[e, 3] >= 0 else 3)
            while partner[f] >= 0:
                e, k = partner[f] // 4, partner[f] % 4
                f = e * 4 + (k + 1) % (4 if cells[e, 3] >= 0 else 3)
    starts[loops] = n
    return loops


def boundary_loops(cells: np.ndarray, partner: np.ndarray) -> list[np.ndarray]:
    """Surface faces in walking order, one array (m,) i8 per loop, the body to the left (outlines counter-clockwise).

    Each loop starts with its lowest face, and loops come in the order of these. Where a body touches itself in a point
    the walk stays on the elements that are connected there.
    """
    surface = int((partner < 0).sum())
    order, starts = np.empty(surface, np.int64), np.empty(surface + 1, np.int64)
    loops = _walk(cells, partner, order, starts)
    return np.split(order[: starts[loops]], starts[1:loops]) if loops else []


def centroids(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(ne, 2) centre of area of each element [m]."""
    out = points[cells[:, :3]].mean(axis=1)
    quads = np.flatnonzero(cells[:, 3] >= 0)
    if len(quads):
        a, b, c, d = (points[cells[quads, k]] for k in range(4))
        one, two = _cross(b - a, c - a), _cross(c - a, d - a)
        out[quads] = ((a + b + c) * one[:, None] + (a + c + d) * two[:, None]) / (3.0 * (one + two))[:, None]
    return out


def areas(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(ne,) area of each element [m2], negative if its corners run clockwise."""
    a, b, c = (points[cells[:, k]] for k in range(3))
    d = points[np.where(cells[:, 3] >= 0, cells[:, 3], cells[:, 0])]
    return 0.5 * _cross(c - a, d - b) if len(cells) else np.empty(0)


def _cross(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def nearest_point(points: np.ndarray, at: tuple[float, ...], among: np.ndarray | None = None) -> int:
    """Number of the point nearest to `at`, the lowest of equals; `among` restricts it to these numbers."""
    among = np.arange(len(points)) if among is None else np.sort(among)
    offset = points[among] - np.asarray(at, np.float64)
    return int(among[np.argmin((offset * offset).sum(axis=1))])


@njit(cache=True, nogil=True, error_model="numpy")
def _nearest_element(points, cells, among, x, y):
    best, best_d = -1, np.inf
    for i in range(len(among)):
        e = among[i]
        n = 4 if cells[e, 3] >= 0 else 3
        inside = True
        d = np.inf
        for k in range(n):
            ax, ay = points[cells[e, k]]
            bx, by = points[cells[e, (k + 1) % n]]
            ux, uy, wx, wy = bx - ax, by - ay, x - ax, y - ay
            if ux * wy - uy * wx < 0.0:
                inside = False
            t = min(max((ux * wx + uy * wy) / (ux * ux + uy * uy), 0.0), 1.0)
            d = min(d, (wx - t * ux) ** 2 + (wy - t * uy) ** 2)
        if inside:
            d = 0.0
        if d < best_d:
            best, best_d = e, d
    return best


def nearest_element(
    points: np.ndarray, cells: np.ndarray, at: tuple[float, float], among: np.ndarray | None = None
) -> int:
    """Number of the (convex) element that holds the point `at`, else of the nearest one; the lowest of equals."""
    among = np.arange(len(cells)) if among is None else np.sort(among)
    return int(_nearest_element(points, cells, among, float(at[0]), float(at[1])))

"""Find pairs of triangles that may touch before something has moved half the buffer: their boxes are near each other.

Only triangles (or halves of quads, along the shorter diagonal) with a corner on a free face are examined. The pairs
found are all in which the box around the free faces of one and that around the other, half the buffer wider on every
side, overlap: that does not depend on how they are found.

Left out are two elements whose common face holds, and two that share no face but a point around which they are still
connected. Across an open face they touch, also where it ends (at the tip of a crack): otherwise they would sink into
each other there, and be repelled violently when the crack extends.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.core.cells import COLUMN, index


@njit(cache=True, nogil=True, error_model="numpy")
def boxes(body_place, free, x, buffer, box, around_faces):
    """Boxes (n, 4) left, bottom, right, top of triangles, and around their free edges (bits of `free`; without any:
    nowhere), `buffer` / 2 wider; body_place: where in flat x."""
    x = x.reshape(x.size)
    half = 0.5 * buffer
    for i in range(len(body_place)):
        p = body_place[i]
        box[i, 0] = min(x[p], x[p + 2], x[p + 4]) - half
        box[i, 1] = min(x[p + 1], x[p + 3], x[p + 5]) - half
        box[i, 2] = max(x[p], x[p + 2], x[p + 4]) + half
        box[i, 3] = max(x[p + 1], x[p + 3], x[p + 5]) + half
        around_faces[i, :2], around_faces[i, 2:] = math.inf, -math.inf
        for k in range(3):
            if free[i] >> k & 1:
                a, b = p + 2 * k, p + 2 * ((k + 1) % 3)
                around_faces[i, 0] = min(around_faces[i, 0], min(x[a], x[b]) - half)
                around_faces[i, 1] = min(around_faces[i, 1], min(x[a + 1], x[b + 1]) - half)
                around_faces[i, 2] = max(around_faces[i, 2], max(x[a], x[b]) + half)
                around_faces[i, 3] = max(around_faces[i, 3], max(x[a + 1], x[b + 1]) + half)


@njit(cache=True, error_model="numpy")
def _meet(a, b):
    """Return whether two boxes overlap."""
    return max(a[0], b[0]) <= min(a[2], b[2]) and max(a[1], b[1]) <= min(a[3], b[3])


@njit(cache=True, nogil=True, error_model="numpy")
def _spread(box, side, key, body):
    """Entries (cell key, body) of all boxes; with key of length 0 only their number is counted."""
    n = 0
    write = len(key) > 0
    for i in range(len(box)):
        x0, x1 = index(box[i, 0], side), index(box[i, 2], side)
        y0, y1 = index(box[i, 1], side), index(box[i, 3], side)
        for cx in range(x0, x1 + 1):
            for cy in range(y0, y1 + 1):
                if write:
                    key[n], body[n] = cx * COLUMN + cy, i
                n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def _connected(e, f, cells, partner, closed):
    """Return whether elements e and f are connected: across the face between them if they share one, else around a
    point of the mesh that they share, through closed faces."""
    ne = 4 if cells[e, 3] >= 0 else 3
    nf = 4 if cells[f, 3] >= 0 else 3
    for k in range(ne):
        over = partner[4 * e + k]
        if over >= 0 and over // 4 == f:
            return closed[4 * e + k]
    for a in range(ne):
        for b in range(nf):
            if cells[e, a] != cells[f, b]:
                continue
            # Turn about the point in both directions until the surface, or until f is met.
            for way in range(2):
                at, k = e, a
                for _ in range(1000):
                    n = 4 if cells[at, 3] >= 0 else 3
                    face = 4 * at + (k if way == 0 else (k + n - 1) % n)
                    over = partner[face]
                    if over < 0 or not closed[face]:
                        break
                    at = over // 4
                    n = 4 if cells[at, 3] >= 0 else 3
                    k = (over % 4 + 1) % n if way == 0 else over % 4
                    if at == f:
                        return True
                    if at == e:
                        break
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _pairs(
    key, order, body, box, around_faces, side, element, number, owned, cells, partner, closed, first, second
):  # fmt: skip
    """Pairs of bodies into first, second (either of length 0: count only)."""
    write = len(first) > 0
    n = 0
    m = len(order)
    s = 0
    while s < m:
        e = s + 1
        while e < m and key[order[e]] == key[order[s]]:
            e += 1
        for a in range(s, e):
            i = body[order[a]]
            for b in range(a + 1, e):
                j = body[order[b]]
                if not (owned[i] or owned[j]) or element[i] == element[j]:
                    continue
                left, bottom = max(box[i, 0], box[j, 0]), max(box[i, 1], box[j, 1])
                if left > min(box[i, 2], box[j, 2]) or bottom > min(box[i, 3], box[j, 3]):
                    continue
                # A pair that shares several cells counts in that of the corner of what the boxes have in common.
                if index(left, side) * COLUMN + index(bottom, side) != key[order[a]]:
                    continue
                if not (_meet(around_faces[i], box[j]) or _meet(around_faces[j], box[i])):
                    continue
                if _connected(element[i], element[j], cells, partner, closed):
                    continue
                if write:
                    low = number[i] < number[j]
                    first[n], second[n] = (i, j) if low else (j, i)
                n += 1
        s = e
    return n


def find(
    box: np.ndarray, around_faces: np.ndarray, element: np.ndarray, number: np.ndarray, owned: np.ndarray,
    cells: np.ndarray, partner: np.ndarray, closed: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Pairs (i, j) of bodies, i the one of the lower number, in ascending order of (number of i, number of j).

    box, around_faces (n, 4) of each body, see `boxes`; element (n,): its element, number (n,): its own, both of the
    whole model; owned (n,) bool: pairs of which no body is owned are left out; cells, partner, closed: the mesh, and
    which faces hold together.
    """
    if len(box) < 2:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    size = np.maximum(box[:, 2] - box[:, 0], box[:, 3] - box[:, 1])
    side = 1.5 * float(np.median(size))
    side = max(side, float(size.max()) / 32.0)  # a few large boxes must not fill thousands of cells each
    nothing = np.empty(0, np.int64)
    entries = _spread(box, side, nothing, nothing)
    key, body = np.empty(entries, np.int64), np.empty(entries, np.int64)
    _spread(box, side, key, body)
    order = np.argsort(key, kind="stable")
    args = key, order, body, box, around_faces, side, element, number, owned, cells, partner, closed
    count = _pairs(*args, nothing, nothing)
    first, second = np.empty(count, np.int64), np.empty(count, np.int64)
    if count:
        _pairs(*args, first, second)
    order = np.lexsort((number[second], number[first]))
    return first[order], second[order]

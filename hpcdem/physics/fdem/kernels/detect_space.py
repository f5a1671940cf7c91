"""Find faces and tetrahedra that may touch before something has moved half the buffer: pairs whose boxes overlap, each
half the buffer wider on every side, unless along the normal of a side of the tetrahedron, or of the face, they are
farther apart than the buffer. The counterpart of detect.py in space, which states which pairs are omitted."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.core.cells import first_not_before, index

_HALF = 1 << 20
"""Cells are counted from -2^20 to 2^20 along each axis; those farther off count as the last."""

PER_FACE = 8
"""Pairs of a face that find space before they are counted: most bodies have fewer."""


@njit(cache=True, nogil=True, error_model="numpy")
def boxes(corner, x, buffer, box):
    """Boxes (n, 6), lowest x, y, z and highest, `buffer` / 2 wider, around corners (n, 3 or 4), places in flat x."""
    x = x.reshape(x.size)
    half = 0.5 * buffer
    for i in range(len(corner)):
        for k in range(3):
            low = high = x[corner[i, 0] + k]
            for c in range(1, corner.shape[1]):
                low, high = min(low, x[corner[i, c] + k]), max(high, x[corner[i, c] + k])
            box[i, k], box[i, 3 + k] = low - half, high + half


@njit(cache=True, error_model="numpy")
def _cell(value, side):
    return min(max(index(value, side), -_HALF), _HALF - 1) + _HALF


@njit(cache=True, error_model="numpy")
def _key(i, j, k):
    return (i << 42) | (j << 21) | k


@njit(cache=True, nogil=True, error_model="numpy")
def _place_of(cells, key):
    """Place of a key among cells, ascending; -1: none."""
    at = first_not_before(cells, key, 0, len(cells))
    return at if at < len(cells) and cells[at] == key else -1


@njit(cache=True, nogil=True, error_model="numpy")
def _spread(box, side, wanted, key, body):
    """Entries (cell, body) of all boxes, of cells that are wanted, ascending, if there are any; with key of length 0
    only their number is counted."""
    n = 0
    for b in range(len(box)):
        low_i, high_i = _cell(box[b, 0], side), _cell(box[b, 3], side)
        low_j, high_j = _cell(box[b, 1], side), _cell(box[b, 4], side)
        low_k, high_k = _cell(box[b, 2], side), _cell(box[b, 5], side)
        if len(key) == 0 and len(wanted) == 0:
            n += (high_i - low_i + 1) * (high_j - low_j + 1) * (high_k - low_k + 1)
            continue
        for i in range(low_i, high_i + 1):
            for j in range(low_j, high_j + 1):
                for k in range(low_k, high_k + 1):
                    cell = _key(i, j, k)
                    if len(wanted) > 0 and _place_of(wanted, cell) < 0:
                        continue
                    if len(key) > 0:
                        key[n], body[n] = cell, b
                    n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def _apart(face, target, clusters, partner, closed):
    """Return whether element `target` may touch `face`: it is another element that is not connected to the one of the
    face, across the face between them if they share one, else around a point."""
    e = face >> 2
    if e == target:
        return False
    for k in range(4):
        over = partner[4 * e + k]
        if over >= 0 and over >> 2 == target:
            return not closed[4 * e + k]
    for a in range(4):
        for b in range(4):
            if clusters[e, a] == clusters[target, b]:
                return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _separated(corner, target, x, buffer, points):
    """Return whether one of five normals separates a face and a target by more than the buffer; places of their corners
    in x, points (7, 3): scratch."""
    for c in range(7):
        at = corner[c] if c < 3 else target[c - 3]
        for k in range(3):
            points[c, k] = x[at + k]
    for n in range(5):
        # The three corners of a side, then of the face.
        a, b, c = 3 + n % 4, 3 + (n + 1) % 4, 3 + (n + 2) % 4
        if n == 4:
            a, b, c = 0, 1, 2
        ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        wx, wy, wz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        low = far_low = math.inf
        high = far_high = -math.inf
        for i in range(7):
            d = nx * (points[i, 0] - points[a, 0]) + ny * (points[i, 1] - points[a, 1])
            d += nz * (points[i, 2] - points[a, 2])
            if i < 3:
                low, high = min(low, d), max(high, d)
            else:
                far_low, far_high = min(far_low, d), max(far_high, d)
        reach = buffer * math.sqrt(nx * nx + (ny * ny + nz * nz))
        if low - far_high > reach or far_low - high > reach:
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _pairs(
    cells, begin, body, side, face_box, box, corner, target, x, buffer, face, face_owned, element, owned, clusters,
    partner, closed, first, second,
):  # fmt: skip
    """Pairs of faces and targets into first, second, as many as find space; returns how many there are."""
    n, points = 0, np.empty((7, 3))
    x = x.reshape(x.size)
    for f in range(len(face)):
        low_i, high_i = _cell(face_box[f, 0], side), _cell(face_box[f, 3], side)
        low_j, high_j = _cell(face_box[f, 1], side), _cell(face_box[f, 4], side)
        low_k, high_k = _cell(face_box[f, 2], side), _cell(face_box[f, 5], side)
        for i in range(low_i, high_i + 1):
            for j in range(low_j, high_j + 1):
                for k in range(low_k, high_k + 1):
                    key = _key(i, j, k)
                    at = _place_of(cells, key)
                    if at < 0:
                        continue
                    for m in range(begin[at], begin[at + 1]):
                        t = body[m]
                        if not (face_owned[f] or owned[t]):
                            continue
                        x0, y0 = max(face_box[f, 0], box[t, 0]), max(face_box[f, 1], box[t, 1])
                        z0 = max(face_box[f, 2], box[t, 2])
                        if (
                            x0 > min(face_box[f, 3], box[t, 3])
                            or y0 > min(face_box[f, 4], box[t, 4])
                            or z0 > min(face_box[f, 5], box[t, 5])
                        ):
                            continue
                        # A pair that shares several cells counts in that of the lowest corner of what is in both boxes.
                        if _key(_cell(x0, side), _cell(y0, side), _cell(z0, side)) != key:
                            continue
                        if not _apart(face[f], element[t], clusters, partner, closed):
                            continue
                        if _separated(corner[f], target[t], x, buffer, points):
                            continue
                        if n < len(first):
                            first[n], second[n] = f, t
                        n += 1
    return n


def find(
    corner: np.ndarray, face: np.ndarray, face_owned: np.ndarray, target: np.ndarray, element: np.ndarray,
    owned: np.ndarray, x: np.ndarray, buffer: float, clusters: np.ndarray, partner: np.ndarray, closed: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Pairs (i, j) of contactor i and target j, in ascending order of (number of the face, element).

    corner (c, 3): where the corners of each contactor are in x, face (c,): its number; target (n, 4), element (n,): the
    same of targets; face_owned, owned (bool): pairs of which neither is owned are left out; buffer [m]; clusters
    (ne, 4): of the corners of all elements, connected corners have one number; partner, closed (4 ne,): the
    mesh, and which faces hold together.
    """
    nothing = np.empty(0, np.int64)
    if not len(face) or not len(element):
        return nothing, nothing
    face_box, box = np.empty((len(face), 6)), np.empty((len(element), 6))
    boxes(corner, x, buffer, face_box)
    boxes(target, x, buffer, box)
    size = (box[:, 3:] - box[:, :3]).max(axis=1)
    side = max(1.5 * float(np.median(size)), float(size.max()) / 16.0)  # a few large boxes must not fill many cells
    near = np.empty(_spread(face_box, side, nothing, nothing, nothing), np.int64)
    _spread(face_box, side, nothing, near, np.empty_like(near))
    near = np.unique(near)  # of targets only what is in these cells counts
    entries = _spread(box, side, near, nothing, nothing)
    key, body = np.empty(entries, np.int64), np.empty(entries, np.int64)
    _spread(box, side, near, key, body)
    order = np.argsort(key, kind="stable")
    cells, begin = np.unique(key[order], return_index=True)
    args = (
        cells, np.append(begin, entries), body[order], side, face_box, box, corner, target, x, buffer, face, face_owned,
        element, owned, clusters, partner, closed,
    )  # fmt: skip
    count = PER_FACE * len(face)
    first, second = np.empty((2, count), np.int64)
    count = _pairs(*args, first, second)
    if count > len(first):
        first, second = np.empty((2, count), np.int64)
        _pairs(*args, first, second)
    order = np.lexsort((element[second[:count]], face[first[:count]]))
    return first[order], second[order]

"""Positions of the nodes of a bolt, and the elements that contain them: functions of the present mesh, in the plane and
in space.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hpcdem.core.errors import CommandError

MOST = 100_000
"""Largest number of segments of one bolt."""
SHORTEST = 0.1
"""Fraction of the mean edge: crossings of edges that are nearer to each other count once."""
INSIDE = 1e-9
"""Tolerance of barycentric coordinates: points on an edge may have coordinates as low as minus this."""


def checked(points: Sequence[Sequence[float]], dim: int) -> np.ndarray:
    """The points (k, dim) [m] of a bolt. CommandError unless two at least, finite, each away from the one before."""
    if any(len(point) != dim for point in points):
        raise CommandError(f"the points of a bolt are vectors of {dim} numbers")
    line = np.asarray(points, np.float64).reshape(-1, dim)
    if len(line) < 2:
        raise CommandError(f"a bolt needs at least two points, got {len(line)}")
    if not np.isfinite(line).all():
        raise CommandError("the points of a bolt must be finite")
    twice = np.flatnonzero((np.diff(line, axis=0) == 0.0).all(axis=1))
    if len(twice):
        at = ",".join(f"{c:g}" for c in line[twice[0]])
        raise CommandError(f"two consecutive points of the bolt coincide, ({at})")
    return line


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Lengths of vectors (n, 2 or 3)."""
    found: np.ndarray = np.hypot.reduce(vectors, axis=1)
    return found


def parts(span: float, segments: int | None, length: float | None) -> int:
    """Divide a straight part of a bolt [m] into so many segments, or into segments no longer than length [m].
    CommandError if there are too many."""
    wanted = float(segments) if segments is not None else span / float(length or span)
    if not wanted <= MOST:
        size = f"segments {segments}" if segments is not None else f"length {length:g}"
        raise CommandError(f"{size} would make {wanted:.2g} segments of {span:g} m of bolt, more than {MOST:g}")
    return max(1, math.ceil(wanted - 1e-9))


def split(
    line: np.ndarray, corners: np.ndarray, cells: np.ndarray, mean_edge: float, segments: int | None,
    length: float | None,
) -> np.ndarray:  # fmt: skip
    """Nodes (n, d) [m] along a line: each straight part in so many segments, or in ones no longer than length [m], or
    at the edges of elements, in space their faces, corners (ne, 4, d) of cells (ne, 4)."""
    nodes = [line[:1]]
    for a, b in pairwise(line):
        span = float(lengths((b - a)[None])[0])
        if segments is None and length is None:
            t = (_crossings if len(a) == 2 else _crossed_faces)(a, b, corners, cells)
            near = SHORTEST * mean_edge / span
            kept = [0.0]
            for one in t.tolist():
                if one - kept[-1] > near and 1.0 - one > near:
                    kept.append(one)
            at = np.array([*kept[1:], 1.0])
        else:
            count = parts(span, segments, length)
            at = np.arange(1, count + 1) / count
        nodes.append(a + at[:, None] * (b - a))
        nodes[-1][-1] = b
    return np.concatenate(nodes)


def inside(a: np.ndarray, b: np.ndarray, corners: np.ndarray, cells: np.ndarray, alive: np.ndarray) -> np.ndarray:
    """(k, 2, d) ends of the parts of the way from a to b that lie in elements, of which some are there; see `hosts`."""
    there = np.where(alive[:, None], cells, -1)
    t = np.unique(np.concatenate([[0.0], (_crossings if len(a) == 2 else _crossed_faces)(a, b, corners, there), [1.0]]))
    t = np.append(t[:-1][np.diff(t) > INSIDE], 1.0)
    middle = a + (0.5 * (t[:-1] + t[1:]))[:, None] * (b - a)
    held = np.concatenate([[False], hosts(middle, corners, cells, alive)[0] >= 0, [False]])
    begin, end = t[np.flatnonzero(~held[:-1] & held[1:])], t[np.flatnonzero(held[:-1] & ~held[1:])]
    out = a + np.column_stack([begin, end])[:, :, None] * (b - a)
    out[end == 1.0, 1] = b
    return out


def _crossings(a: np.ndarray, b: np.ndarray, corners: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Parts (k,) of the way from a to b, ascending, at which it crosses edges of elements."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    real = (cells >= 0)[:, :, None]
    near = (np.where(real, corners, np.inf).min(axis=1) <= high) & (np.where(real, corners, -np.inf).max(axis=1) >= low)
    some = np.flatnonzero(near.all(axis=1))
    of, four = corners[some], cells[some, 3] >= 0
    after = np.stack([of[:, 1], of[:, 2], np.where(four[:, None], of[:, 3], of[:, 0]), of[:, 0]], axis=1)
    use = np.ones((len(some), 4), bool)
    use[:, 3] = four
    p, q = of[use], after[use]
    d, s = b - a, q - p
    cross = d[0] * s[:, 1] - d[1] * s[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        w = p - a
        t = (w[:, 0] * s[:, 1] - w[:, 1] * s[:, 0]) / cross
        u = (w[:, 0] * d[1] - w[:, 1] * d[0]) / cross
    hit = (cross != 0.0) & (t > 0.0) & (t < 1.0) & (u >= -INSIDE) & (u <= 1.0 + INSIDE)
    return np.sort(t[hit])


def _crossed_faces(a: np.ndarray, b: np.ndarray, corners: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Parts (k,) of the way from a to b, ascending, at which it crosses faces of tetrahedra: a + t (b - a) is a point
    of the face with the barycentric coordinates 1 - u - w, u, w."""
    from hpcdem.physics.fdem.tetrahedra import FACES  # brings kernels with it; points are checked before there are any

    low, high = np.minimum(a, b), np.maximum(a, b)
    near = (cells[:, 0] >= 0) & (corners.min(axis=1) <= high).all(axis=1) & (corners.max(axis=1) >= low).all(axis=1)
    p, q, r = np.moveaxis(corners[near][:, FACES].reshape(-1, 3, len(a)), 1, 0)
    d, e, f = b - a, q - p, r - p
    normal, offset = np.cross(e, f), p - a
    along = normal @ d
    turned = np.cross(d, offset)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (normal * offset).sum(axis=1) / along
        u, w = -(f * turned).sum(axis=1) / along, (e * turned).sum(axis=1) / along
        hit = (along != 0.0) & (t > 0.0) & (t < 1.0) & (u >= -INSIDE) & (w >= -INSIDE) & (u + w <= 1.0 + INSIDE)
    return np.sort(t[hit])


def hosts(
    points: np.ndarray, corners: np.ndarray, cells: np.ndarray, alive: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Find for points (n, d) [m] the lowest element in which each is, -1: none, and the weights of its corners (n, 4);
    corners (ne, 4, d) [m] of cells (ne, 4), of which some are there."""
    host, weight = np.full(len(points), -1, np.int64), np.zeros((len(points), 4))
    real = (cells >= 0)[:, :, None]
    low = np.where(real, corners, np.inf).min(axis=1)
    high = np.where(real, corners, -np.inf).max(axis=1)
    slack = INSIDE * (np.nanmax(high - low, initial=0.0) if len(cells) else 0.0)
    low, high = low - slack, high + slack
    here = np.flatnonzero(alive & (low <= points.max(axis=0)).all(axis=1) & (high >= points.min(axis=0)).all(axis=1))
    low, high = low[here], high[here]
    for i, at in enumerate(points):
        for e in here[((low <= at) & (at <= high)).all(axis=1)].tolist():
            found = coordinates(at, corners[e], bool(cells[e, 3] >= 0))
            if found.min() >= -INSIDE:
                host[i], weight[i] = e, found
                break
    return host, weight


def coordinates(at: np.ndarray, corners: np.ndarray, four: bool) -> np.ndarray:
    """Weights (4,) of the corners (4, d) of an element at a point, from inside or outside: barycentric in the triangle
    or tetrahedron, of a quad in the half of it that holds the point best."""
    if len(at) == 3:
        part = np.linalg.solve((corners[1:] - corners[0]).T, at - corners[0])
        return np.concatenate([[1.0 - part.sum()], part])
    best = np.full(4, -math.inf)
    for half in ((0, 1, 2), (0, 2, 3)) if four else ((0, 1, 2),):
        a, b, c = corners[list(half)]
        u, w, p = b - a, c - a, at - a
        double = u[0] * w[1] - u[1] * w[0]
        second, third = (p[0] * w[1] - p[1] * w[0]) / double, (u[0] * p[1] - u[1] * p[0]) / double
        found = np.zeros(4)
        found[list(half)] = 1.0 - second - third, second, third
        if found.min() > best.min():
            best = found
    return best


def carriers(bar: np.ndarray, arc: np.ndarray, host: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the nodes that carry those without a host across the bar: the next nodes with a host before and after them
    on the same bar (n, 2), -1: none, and the share of the second (n,), by the distance arc along the bar."""
    carrier, share = np.full((len(bar), 2), -1, np.int64), np.zeros(len(bar))
    for one in np.unique(bar[host < 0]).tolist():
        members = np.flatnonzero(bar == one)
        held = members[host[members] >= 0]
        for i in members[host[members] < 0].tolist():
            before, after = held[held < i], held[held > i]
            if len(before) and len(after):
                carrier[i] = before[-1], after[0]
                share[i] = (arc[i] - arc[before[-1]]) / (arc[after[0]] - arc[before[-1]])
            elif len(held):
                carrier[i, 0] = before[-1] if len(before) else after[0]
    return carrier, share

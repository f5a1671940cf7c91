"""Who has slipped through a row of GLINE or a wall since the lists were built.

A row is a chain of particles with successive ids. A particle has passed it when its centre has crossed the line between
two neighbours of the chain. To do so it must have touched one of them, so the pairs of the lists are all that is
looked at; likewise for the slots of walls.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from hpcdem.fields import GID, X, Y

NOT, ROW, WALL = range(3)


def found(
    lists: Any, hot: np.ndarray, origin: np.ndarray, rows: list, ends: np.ndarray, ways: np.ndarray
) -> np.ndarray:
    """NOT, ROW or WALL for each owned particle (n_own,) i8.

    lists: neighbours.ContactLists; hot (n, 8): storage; origin (n, 2) [m]: where its particles were when the lists
    were built; rows: (first id, id after the last) of each row; ends (w, 4) [m]: walls now; ways (w, 2) [m]: how far
    they have gone since then, not-a-number for walls that do not count.
    """
    out = np.zeros(lists.n_own, np.int8)
    if rows:
        node, place = _nodes(hot.view(np.int64)[:, GID], rows)
        b = lists.blocks
        for t in range(lists.n_blocks):
            first, end = lists.ptr[b.poff[t]], lists.ptr[b.poff[t] + max(b.cut[t + 1] - b.lo[t], 0)]
            _through_rows(first, end, lists.row, lists.partner, hot, origin, node, place, lists.n_left, out)
    if len(lists.slot_row):
        _through_walls(lists.slot_row, lists.slot_wall, hot, origin, ends, ways, lists.n_left, out)
    return out


def _nodes(gid: np.ndarray, rows: list) -> tuple[np.ndarray, np.ndarray]:
    """Node (n,) of each storage row in the chains, -1 for none, and the storage row of each node, -1 for those that are
    not here. Chains are separated by a node that nobody has."""
    node = np.full(len(gid), -1)
    starts = np.cumsum([1] + [end - first + 1 for first, end in rows])
    place = np.full(starts[-1], -1)
    for (first, end), start in zip(rows, starts, strict=False):
        here = np.flatnonzero((gid >= first) & (gid < end))
        node[here] = start + gid[here] - first
        place[node[here]] = here
    return node, place


@njit(cache=True, nogil=True, error_model="numpy")
def _crosses(px, py, qx, qy, x, y, dp, dq, dd):
    """Whether a point now at (x, y) has crossed the segment now from p to q; dp, dq, dd: how far each has gone."""
    now = (qx - px) * (y - py) - (qy - py) * (x - px)
    ex, ey = qx - dq[0] - px + dp[0], qy - dq[1] - py + dp[1]
    before = ex * (y - dd[1] - py + dp[1]) - ey * (x - dd[0] - px + dp[0])
    if not now * before < 0.0:
        return False
    back = now / (now - before)  # the part of the way that lies behind the line
    ax, ay = px - back * dp[0], py - back * dp[1]
    ex, ey = qx - back * dq[0] - ax, qy - back * dq[1] - ay
    along = (x - back * dd[0] - ax) * ex + (y - back * dd[1] - ay) * ey
    return 0.0 <= along <= ex * ex + ey * ey


@njit(cache=True, nogil=True, error_model="numpy")
def _gone(hot, origin, i):
    return hot[i, X] - origin[i, 0], hot[i, Y] - origin[i, 1]


@njit(cache=True, nogil=True, error_model="numpy")
def _through_rows(first, end, row, partner, hot, origin, node, place, n_left, out):
    for k in range(first, end):
        i, j = row[k], partner[k]
        if (node[i] < 0) == (node[j] < 0):
            continue
        at, d = (node[i], j) if node[i] >= 0 else (node[j], i)
        if not 0 <= d - n_left < len(out):
            continue
        for begin in range(at - 1, at + 1):
            p, q = place[begin], place[begin + 1]
            if p >= 0 and q >= 0 and _crosses(
                hot[p, X], hot[p, Y], hot[q, X], hot[q, Y], hot[d, X], hot[d, Y],
                _gone(hot, origin, p), _gone(hot, origin, q), _gone(hot, origin, d),
            ):  # fmt: skip
                out[d - n_left] = ROW


@njit(cache=True, nogil=True, error_model="numpy")
def _through_walls(slot_row, slot_wall, hot, origin, ends, ways, n_left, out):
    for k in range(len(slot_row)):
        d, w = slot_row[k], slot_wall[k]
        way = ways[w, 0], ways[w, 1]
        if _crosses(
            ends[w, 0], ends[w, 1], ends[w, 2], ends[w, 3], hot[d, X], hot[d, Y], way, way, _gone(hot, origin, d)
        ):
            out[d - n_left] = WALL

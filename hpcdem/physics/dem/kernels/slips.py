"""Find particles that slipped through a row of GLINE or a wall since the lists were built.

A row is a chain of particles with successive ids. A particle has passed it when its centre has crossed the line between
two neighbours of the chain. To do so it must have touched one of them, so the pairs of the lists are all that is
examined; likewise for the slots of walls.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from hpcdem.core.fields import X, Y

NOT, ROW, WALL = range(3)


def neighbours_in_rows(gid: np.ndarray, xy: np.ndarray, origin: np.ndarray, rows: list, reach: float) -> np.ndarray:
    """Places now and at the last search of the neighbours in its row: (n, 8) [m], of the one before and the one after.

    gid (n,), xy and origin (n, 2) [m]: storage; rows: (first id, id after the last) of each row. Not-a-number for
    particles of no row, inf where there is no neighbour within reach [m] at the last search. The owner of a particle
    has all within a reach of one column in its storage; ghosts are filled in from there.
    """
    out = np.full((len(gid), 2, 2, 2), np.nan)
    for first, end in rows:
        here = np.flatnonzero((gid >= first) & (gid < end))
        place = np.full(end - first + 2, -1)  # nobody stands before the first and after the last
        place[gid[here] - first + 1] = here
        for side, step in enumerate((-1, 1)):
            there = place[gid[here] - first + 1 + step]
            near = (there >= 0) & (np.hypot(*(origin[here] - origin[there]).T) <= reach)
            out[here, side] = np.inf
            out[here[near], side] = np.stack([xy[there[near]], origin[there[near]]], axis=1)
    return out.reshape(-1, 8)


def found(
    lists: Any, hot: np.ndarray, origin: np.ndarray, chain: np.ndarray | None, ends: np.ndarray, paths: np.ndarray
) -> np.ndarray:
    """NOT, ROW or WALL for each owned particle (n_own,) i8.

    lists: neighbours.ContactLists; hot (n, 8): storage; origin (n, 2) [m]: where its particles were when the lists
    were built; chain (n, 8): neighbours_in_rows, ghosts filled in; ends (w, 4) [m]: walls now; ways (w, 2) [m]: how far
    they have gone since then, not-a-number for walls that do not count.
    """
    out = np.zeros(lists.n_own, np.int8)
    if chain is not None:
        for row, partner, _, _ in lists.pieces():
            _through_rows(row, partner, hot, origin, chain, lists.n_left, out)
    if len(lists.slot_row):
        _through_walls(lists.slot_row, lists.slot_wall, hot, origin, ends, paths, lists.n_left, out)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _crosses(px, py, qx, qy, x, y, dp, dq, dd):
    """Return whether a point now at (x, y) has crossed the segment now from p to q; dp, dq, dd: how far each has
    gone."""
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
def _through_rows(row, partner, hot, origin, chain, n_left, out):
    for k in range(len(row)):
        i, j = row[k], partner[k]
        if np.isnan(chain[i, 0]) == np.isnan(chain[j, 0]):
            continue
        p, d = (i, j) if not np.isnan(chain[i, 0]) else (j, i)
        if not 0 <= d - n_left < len(out):
            continue
        for side in (0, 4):
            q = chain[p, side : side + 4]
            if np.isfinite(q[0]) and _crosses(
                hot[p, X], hot[p, Y], q[0], q[1], hot[d, X], hot[d, Y],
                _gone(hot, origin, p), (q[0] - q[2], q[1] - q[3]), _gone(hot, origin, d),
            ):  # fmt: skip
                out[d - n_left] = ROW


@njit(cache=True, nogil=True, error_model="numpy")
def _through_walls(slot_row, slot_wall, hot, origin, ends, paths, n_left, out):
    for k in range(len(slot_row)):
        d, w = slot_row[k], slot_wall[k]
        path = paths[w, 0], paths[w, 1]
        if _crosses(
            ends[w, 0], ends[w, 1], ends[w, 2], ends[w, 3], hot[d, X], hot[d, Y], path, path, _gone(hot, origin, d)
        ):
            out[d - n_left] = WALL

"""Build the wall slots of the lists: which particles may touch which walls.

Particles are sorted by column, then row. What is near a wall in a column lies between two rows, and these are found by
bisection, so that the many particles far from all walls cost nothing.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from hpcdem.core.cells import COLUMN, FARTHEST, column, first_not_before, index
from hpcdem.core.fields import RADIUS, X, Y
from hpcdem.physics.dem.kernels.histories import Histories
from hpcdem.physics.dem.kernels.walls import P1X, P1Y, P2X, P2Y, closest


def place(
    lists: Any, hot: np.ndarray, cell: np.ndarray, hist: Histories, where: np.ndarray, walls: np.ndarray,
    side: float, largest: float, skin: float, fast_rows: np.ndarray, reach: np.ndarray, left: float,
) -> None:  # fmt: skip
    """Give the lists their wall slots, with histories; arguments as in neighbours.build. fast_rows (m,): storage rows
    of the fast particles, ascending, and their reach [m] (fast.py)."""
    # columns of what is remembered; of few rows they are contiguous, of many they are not: one type for the kernels
    partner, remembered, extra = (np.ascontiguousarray(one) for one in (hist.partner, hist.fs, hist.extra))
    memory = _who_remembers(where, hist.ptr, partner)
    n = capacity = lists.n_own // 16 + 64
    while n >= capacity:
        capacity = n + 64
        rows, which, source = np.empty(capacity, np.int64), np.empty(capacity, np.int64), np.empty(capacity, np.int64)
        fs, at_side = np.empty(capacity), np.empty(capacity)
        n = _find(
            hot, cell, lists.n_left, lists.n_own, walls, left, side, largest, skin, memory, where,
            hist.ptr, partner, remembered, extra, fast_rows, reach, rows, which, fs, at_side, source,
        )  # fmt: skip
    lists.slot_row, lists.slot_wall, lists.slot_fs, lists.slot_side = (
        column[:n].copy() for column in (rows, which, fs, at_side)
    )
    lists.slot_memory = np.zeros((n, hist.memory.shape[1]))
    lists.slot_memory[source[:n] >= 0] = hist.memory[source[:n][source[:n] >= 0]]
    lists.new_side = np.zeros(n)
    lists.wptr = np.searchsorted(lists.slot_row, lists.blocks.cut).astype(np.int64)


@njit(cache=True, nogil=True, error_model="numpy")
def _who_remembers(where, hptr, hpartner):
    """Owned particles with a history at a wall, ascending. It stands last among what a particle remembers."""
    found = np.empty(len(where), np.int64)
    n = 0
    for c in range(len(where)):
        end = hptr[where[c] + 1]
        if end > hptr[where[c]] and hpartner[end - 1] < 0:
            found[n] = c
            n += 1
    return found[:n].copy()


@njit(cache=True, nogil=True, error_model="numpy")
def _rows_near(wall, at, left, side, reach):
    """First and last row of column `at` in which something may lie within `reach` of a wall; none if first > last."""
    x1, y1, x2, y2 = wall[P1X] - left, wall[P1Y], wall[P2X] - left, wall[P2Y]
    if at < index(min(x1, x2) - reach, side) or at > index(max(x1, x2) + reach, side):
        return 0, -1
    low, high = min(y1, y2), max(y1, y2)
    if low != high and x1 != x2 and abs(at) < FARTHEST:
        # The piece of an inclined wall that belongs to the column; a column more on each side, for rounding.
        slope = (y2 - y1) / (x2 - x1)
        ya = y1 + slope * ((at - 1) * side - reach - x1)
        yb = y1 + slope * ((at + 2) * side + reach - x1)
        low, high = max(low, min(ya, yb)), min(high, max(ya, yb))
        return index(low - reach, side) - 1, index(high + reach, side) + 1
    return index(low - reach, side), index(high + reach, side)


@njit(cache=True, nogil=True, error_model="numpy")
def _is_near(wall, x, y, reach):
    if (
        x + reach < min(wall[P1X], wall[P2X])
        or x - reach > max(wall[P1X], wall[P2X])
        or y + reach < min(wall[P1Y], wall[P2Y])
        or y - reach > max(wall[P1Y], wall[P2Y])
    ):
        return False
    _, _, qx, qy = closest(wall, x, y)
    return (x - qx) ** 2 + (y - qy) ** 2 <= reach * reach


@njit(cache=True, nogil=True, error_model="numpy")
def _find(
    hot, cell, n_left, n_own, walls, left, side, largest, skin, memory, where, hptr, hpartner, hfs, hextra,
    fast_rows, fast_reach, slot_row, slot_wall, slot_fs, slot_side, source,
):  # fmt: skip
    """Owned particles within R + skin of a wall (of fast ones half the skin is their reach), or with a history there,
    sorted by row then wall. source: entry of the history, -1 without one.

    Returns the number of slots needed; slots past the end of the arrays are counted only.
    """
    n_walls = len(walls)
    begin, end = np.empty(n_walls, np.int64), np.empty(n_walls, np.int64)
    n, m = 0, 0
    i, stop = n_left, n_left + n_own
    f = first_not_before(fast_rows, i, 0, len(fast_rows))
    while i < stop:
        at = column(cell[i])
        beyond = (at + 1) * COLUMN - COLUMN // 2
        stride = 16
        while i + stride < stop and cell[i + stride] < beyond:
            stride *= 2
        column_end = first_not_before(cell, beyond, i, min(i + stride, stop))
        for w in range(n_walls):
            low, high = _rows_near(walls[w], at, left, side, 1.000001 * (largest + skin))  # rounding
            begin[w] = first_not_before(cell, at * COLUMN + low, i, column_end) if low <= high else column_end
            end[w] = first_not_before(cell, at * COLUMN + high + 1, begin[w], column_end)
        while True:
            following = column_end
            for w in range(n_walls):
                if end[w] > i:
                    following = min(following, max(i, begin[w]))
            if m < len(memory):
                following = min(following, n_left + memory[m])
            if f < len(fast_rows):
                following = min(following, fast_rows[f])
            i = following
            if i >= column_end:
                break
            first, last = 0, 0
            if m < len(memory) and n_left + memory[m] == i:
                c = where[memory[m]]
                first, last = hptr[c], hptr[c + 1]
                m += 1
            x, y, reach = hot[i, X], hot[i, Y], hot[i, RADIUS] + skin
            is_fast = f < len(fast_rows) and fast_rows[f] == i
            if is_fast:
                reach += fast_reach[f] - 0.5 * skin
                f += 1
            for w in range(n_walls):
                known = -1
                for q in range(first, last):
                    if hpartner[q] == -1 - w:
                        known = q
                if known < 0 and not ((is_fast or begin[w] <= i < end[w]) and _is_near(walls[w], x, y, reach)):
                    continue
                if n < len(slot_row):
                    slot_row[n], slot_wall[n], source[n] = i, w, known
                    slot_fs[n] = hfs[known] if known >= 0 else 0.0
                    slot_side[n] = hextra[known] if known >= 0 else 0.0
                n += 1
            i += 1
    return n

"""Strips: which rank owns which column. Pure functions of arrays.

Space is cut into square cells of side h, at least one reach wide; a column is all cells of one x index. Rank p owns
the columns borders[p] : borders[p+1]; the first and the last rank own everything beyond as well. Borders decide who
computes, never what: the order of particles depends on the cells alone.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hpcdem.core.cells import COLUMN, FARTHEST, column, columns, keys, row

__all__ = ["FARTHEST", "cells", "cut", "global_order", "owner_of", "separate", "strays"]

CELLS_PER_PARTICLE = 4
"""Room that is sorted by counting; a model that is thinner than that, or has runaways, is sorted by comparing."""
SMALL = 65536
"""Cells that are always few enough."""
CROWD = 64
"""Particles in a cell from which on they are sorted by comparing, if they have to be."""


def cells(x: np.ndarray, y: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Columns and rows (i8) of points [m]; not-a-number goes to the last cell."""
    numbers = keys(np.column_stack([x, y]).astype(float), h)
    cx = columns(numbers)
    return cx, numbers - cx * COLUMN


def global_order(cell: np.ndarray, gid: np.ndarray) -> np.ndarray:
    """Indices that sort by (column, row, gid): the one order of the whole model. cell, gid (n,) i8; cell: see cells.py.

    Linear in the number of particles, unless there are far more cells than particles between the outermost ones.
    """
    if not len(cell):
        return np.empty(0, np.int64)
    cell, gid = np.ascontiguousarray(cell), np.ascontiguousarray(gid)  # the ids are mostly a column of a table
    left, right, bottom, top = _extent(cell)
    rows = top - bottom + 1
    number = (right - left + 1) * rows
    if number <= CELLS_PER_PARTICLE * len(cell) + SMALL:
        order = _count_out(cell, left, bottom, rows, number)
    else:
        order = np.argsort(cell, kind="stable")
    if _sort_ids(order, cell, gid):
        order = order[np.lexsort((gid[order], cell[order]))]
    return order


@njit(cache=True, nogil=True, error_model="numpy")
def _extent(cell):
    """First and last column, first and last row."""
    first = last = cell[0]
    bottom = top = row(cell[0])
    for key in cell:
        first, last = min(first, key), max(last, key)
        at = row(key)
        bottom, top = min(bottom, at), max(top, at)
    return column(first), column(last), bottom, top


@njit(cache=True, nogil=True, error_model="numpy")
def _count_out(cell, left, bottom, rows, number):
    """Order by cell; those of one cell stay in the order in which they come."""
    begin = np.zeros(number + 1, np.int32)
    place = np.empty(len(cell), np.int32)
    for i in range(len(cell)):
        place[i] = (column(cell[i]) - left) * rows + row(cell[i]) - bottom
        begin[place[i] + 1] += 1
    for k in range(number):
        begin[k + 1] += begin[k]
    order = np.empty(len(cell), np.int64)
    for i in range(len(cell)):
        at = begin[place[i]]
        order[at] = i
        begin[place[i]] = at + 1
    return order


@njit(cache=True, nogil=True, error_model="numpy")
def _sort_ids(order, cell, gid):
    """Put those of one cell in the order of their ids. Nearly always they are. Returns whether a crowd is left over."""
    n = len(order)
    crowded = False
    k = 1
    while k < n:
        i = order[k]
        if cell[order[k - 1]] != cell[i] or gid[order[k - 1]] < gid[i]:
            k += 1
            continue
        begin = k - 1
        while begin > 0 and cell[order[begin - 1]] == cell[i]:
            begin -= 1
        end = k + 1
        while end < n and cell[order[end]] == cell[i]:
            end += 1
        if end - begin > CROWD:
            crowded = True
        else:
            for m in range(k, end):
                moving = order[m]
                at = m
                while at > begin and gid[order[at - 1]] > gid[moving]:
                    order[at] = order[at - 1]
                    at -= 1
                order[at] = moving
        k = end
    return crowded


def strays(cell: np.ndarray, borders: np.ndarray, rank: int) -> np.ndarray:
    """Indices of the particles that are not in the columns of this rank."""
    first = borders[rank] if rank > 0 else -FARTHEST
    end = borders[rank + 1] if rank + 2 < len(borders) else FARTHEST + 1
    return _outside(cell, first * COLUMN - COLUMN // 2, end * COLUMN - COLUMN // 2)


@njit(cache=True, nogil=True, error_model="numpy")
def _outside(cell, first, end):
    found = np.empty(len(cell), np.int64)
    n = 0
    for i in range(len(cell)):
        found[n] = i
        n += (cell[i] < first) | (cell[i] >= end)
    return found[:n].copy()


def owner_of(cx: np.ndarray, borders: np.ndarray) -> np.ndarray:
    """Rank that owns each column index; borders (ranks + 1,) i8, strictly increasing."""
    return np.searchsorted(borders[1:-1], cx, side="right")


def separate(borders: np.ndarray, least: int = 1) -> np.ndarray:
    """The nearest borders that leave every rank at least so many columns."""
    steps = least * np.arange(len(borders))
    return np.maximum.accumulate(borders - steps) + steps


def cut(weights: np.ndarray, first: int, ranks: int, least: int = 1) -> np.ndarray:
    """Borders that share out columns first, first + 1, ... of given cost as evenly as whole columns allow, at least
    `least` to each rank.

    weights (columns,) f8. Returns (ranks + 1,) i8; with too few columns the last ranks own empty ones.
    """
    columns = len(weights)
    total = np.concatenate(([0.0], np.cumsum(weights)))
    goals = total[-1] * np.arange(1, ranks) / ranks
    at = np.searchsorted(total, goals)
    # Of the two borders around a goal take the nearer one.
    below = np.maximum(at - 1, 0)
    at = np.where(goals - total[below] < total[np.minimum(at, columns)] - goals, below, at)
    borders = separate(np.concatenate(([0], at, [max(columns, ranks * least)])).astype(np.int64), least)
    # Push back from the right end, so that the last ranks keep theirs.
    available = borders[-1] if columns < ranks * least else columns
    borders = np.minimum(borders, available - least * np.arange(ranks, -1, -1))
    return borders + first

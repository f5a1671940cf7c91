"""Strips: who owns which column. Pure functions of arrays.

Space is cut into square cells of side h, at least one reach wide; a column is all cells of one x index. Rank p owns
the columns borders[p] : borders[p+1]; the first and the last rank own everything beyond as well. Borders decide who
computes, never what: the order of particles depends on the cells alone.
"""

from __future__ import annotations

import numpy as np

FARTHEST = 1 << 28
"""Cell indices are clamped to +- this, so that an escaped particle costs nothing."""


def cells(x: np.ndarray, y: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Cell indices (i8) of points [m]; not-a-number goes to the last cell."""
    out = []
    for values in (x, y):
        scaled = np.floor(values / h)
        scaled = np.where(scaled < FARTHEST, np.maximum(scaled, -FARTHEST), FARTHEST)
        out.append(scaled.astype(np.int64))
    return out[0], out[1]


def global_order(cx: np.ndarray, cy: np.ndarray, gid: np.ndarray) -> np.ndarray:
    """Indices that sort by (column, row, gid): the one order of the whole model."""
    if not len(cx):
        return np.empty(0, np.int64)
    x0, y0 = int(cx.min()), int(cy.min())
    rows, gids = int(cy.max()) - y0 + 1, int(gid.max()) + 1
    if (int(cx.max()) - x0 + 1) * rows * gids < 1 << 62:
        return np.argsort(((cx - x0) * rows + (cy - y0)) * gids + gid, kind="stable")
    return np.lexsort((gid, cy, cx))


def owner_of(cx: np.ndarray, borders: np.ndarray) -> np.ndarray:
    """Rank that owns each column index; borders (ranks + 1,) i8, strictly increasing."""
    return np.searchsorted(borders[1:-1], cx, side="right")


def separate(borders: np.ndarray) -> np.ndarray:
    """The nearest borders that leave every rank at least one column."""
    steps = np.arange(len(borders))
    return np.maximum.accumulate(borders - steps) + steps


def cut(weights: np.ndarray, first: int, ranks: int) -> np.ndarray:
    """Borders that share out columns first, first + 1, ... of given cost as evenly as whole columns allow.

    weights (columns,) f8. Returns (ranks + 1,) i8; with fewer columns than ranks the last ranks own empty columns.
    """
    columns = len(weights)
    total = np.concatenate(([0.0], np.cumsum(weights)))
    goals = total[-1] * np.arange(1, ranks) / ranks
    at = np.searchsorted(total, goals)
    # Of the two borders around a goal take the nearer one.
    below = np.maximum(at - 1, 0)
    at = np.where(goals - total[below] < total[np.minimum(at, columns)] - goals, below, at)
    borders = separate(np.concatenate(([0], at, [max(columns, ranks)])).astype(np.int64))
    # Push back from the right end, so that the last ranks keep a column each.
    room = borders[-1] if columns < ranks else columns
    borders = np.minimum(borders, room - np.arange(ranks, -1, -1))
    return borders + first

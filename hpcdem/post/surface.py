"""Selection of the particles of the bed, and the line along its top."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hpcdem.core.fields import FIX_X, FIX_Y

LOOSE = 1 / 500
"""Fraction of all particles: smaller pieces are loose fragments and no part of the model."""
HELD = FIX_X | FIX_Y


def held_fast(columns: Mapping[str, np.ndarray], n: int) -> np.ndarray:
    """Return flags (n,) of the particles of a frame that are fixed along x and y, as rows that represent walls are."""
    return (np.asarray(columns.get("fix", np.zeros(n)), dtype=np.int64) & HELD) == HELD


def bed(x: np.ndarray, y: np.ndarray, radius: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """(n,): the particles without flying bits and fixed ones; the fixed ones count where there are no others, and all
    particles where there are only flying bits."""
    kept = in_large_pieces(x, y, radius)
    return next((some for some in (kept & ~fixed, kept) if some.any()), np.ones(len(x), bool))


def in_large_pieces(x: np.ndarray, y: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Flag the discs in connected pieces of at least the share LOOSE of all discs. Discs are connected if their cells
    of a grid, as wide as the largest diameter, are."""
    from scipy import ndimage

    if len(x) == 0:
        return np.zeros(0, bool)
    side = max(2.0 * float(radius.max()), float(np.ptp(x)) / 5000.0, float(np.ptp(y)) / 5000.0)
    column, row = (((v - v.min()) / side).astype(np.int64) for v in (x, y))
    filled = np.zeros((row.max() + 1, column.max() + 1), bool)
    filled[row, column] = True
    piece = ndimage.label(filled, np.ones((3, 3)))[0][row, column]
    return np.bincount(piece)[piece] >= LOOSE * len(x)


def surface(x: np.ndarray, y: np.ndarray, radius: np.ndarray, ball: float, spacing: float) -> np.ndarray:
    """(m, 2): the way of the lowest point of a ball of radius `ball` [m] that is rolled over the discs from above, at
    multiples of `spacing` [m] from the left edge of the particles to the right one.

    No disc stands out of it, and it does not enter what is narrower than the ball. NaN heights where the ball falls
    through, in gaps wider than itself.
    """
    if len(x) == 0:
        return np.zeros((0, 2))
    first, last = np.floor(np.min(x - radius) / spacing), np.ceil(np.max(x + radius) / spacing)
    extra = int(np.ceil(ball / spacing)) + 1
    count = int(last - first) + 1 + 2 * extra
    start = (first - extra) * spacing
    reach = float(np.max(radius)) + ball
    place = np.floor((x - start) / spacing).astype(np.int64)
    # Only what lies near the highest of its column can carry the ball.
    order = np.argsort(place, kind="stable")
    columns, begin = np.unique(place[order], return_index=True)
    highest = np.full(count, -np.inf)
    highest[columns] = np.maximum.reduceat(y[order], begin)
    some = order[y[order] > highest[place[order]] - 3.0 * reach]
    px, py, pr, place = x[some] - start, y[some], radius[some] + ball, place[some]
    columns, begin = np.unique(place, return_index=True)
    centre = np.full(count, -np.inf)  # lowest height of the centre of the ball over each place
    for k in range(-int(np.ceil(reach / spacing)) - 1, int(np.ceil(reach / spacing)) + 2):
        h2 = pr * pr - ((place + k) * spacing - px) ** 2
        height = np.where(h2 >= 0.0, py + np.sqrt(np.maximum(h2, 0.0)), -np.inf)
        at, best = columns + k, np.maximum.reduceat(height, begin)
        ok = (at >= 0) & (at < count)
        centre[at[ok]] = np.maximum(centre[at[ok]], best[ok])
    # The ball stays between the outermost particles, as between walls.
    centre[:extra] = centre[count - extra :] = np.inf
    line = np.full(count, np.inf)
    for k in range(-extra, extra + 1):
        h2 = ball * ball - (k * spacing) ** 2
        if h2 >= 0.0:
            shifted = np.roll(centre, -k) - np.sqrt(h2)
            line = np.minimum(line, shifted)
    line = line[extra : count - extra]
    where = (first + np.arange(len(line))) * spacing
    return np.stack([where, np.where(np.isfinite(line), line, np.nan)], axis=1)

"""The line over the top of the particles."""

from __future__ import annotations

import numpy as np


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

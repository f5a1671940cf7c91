"""Images of the particles of a model with periodic sides, for measurements that need neighbours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hpcdem.post.measure.grains import Grains

REACH = 0.5
"""Length over which images extend beyond each side, over the distance of the sides."""


def extended(before: Grains, after: Grains | None = None) -> tuple[Grains, Grains]:
    """Add images beyond both sides to the particles of a frame, and to those of a later frame, in which their positions
    are continuous.

    Parameters
    ----------
    before, after : frames of a model with periodic sides, with other lengths if the sides move (default of after:
        before).

    Returns
    -------
    tuple : both frames; the first rows are those of the particles themselves, images have ids of their own, and the
        walls that span both sides extend over them.
    """
    after = before if after is None else after
    laps = dict(zip(before.gid.tolist(), before.laps.tolist()))
    crossed = after.laps - np.array([laps.get(gid, lap) for gid, lap in zip(after.gid.tolist(), after.laps.tolist())])
    low, high = before.side - REACH * before.period, before.side + (1.0 + REACH) * before.period
    number = 1 + max(int(g.gid.max(initial=0)) for g in (before, after))
    parts: list[tuple[Grains, Grains]] = [(before, replace(after, x=after.x + crossed * after.period))]
    for k, shift in enumerate((-1.0, 1.0), 1):
        x = before.x + shift * before.period
        image = replace(before, x=x, gid=before.gid + k * number).take((x >= low) & (x < high))
        x = parts[0][1].x + shift * after.period
        later = replace(after, x=x, gid=after.gid + k * number)
        parts.append((image, later.take(np.isin(later.gid, image.gid))))
    return _joined([a for a, _ in parts]), _joined([b for _, b in parts])


def inside(g: Grains, x: np.ndarray) -> np.ndarray:
    """Return positions x (n,) [m] brought between the periodic sides."""
    return g.side + np.mod(x - g.side, g.period) if g.period else x


def _joined(parts: list[Grains]) -> Grains:
    first = parts[0]
    more = REACH * first.period
    walls = dict(first.walls)
    for number, (a, b) in walls.items():
        if a[1] == b[1] and min(a[0], b[0]) <= first.side and max(a[0], b[0]) >= first.side + first.period:
            left, right = min(a[0], b[0]) - more, max(a[0], b[0]) + more
            walls[number] = ((left, a[1]), (right, a[1]))
    columns = {name: np.concatenate([getattr(g, name) for g in parts]) for name in first.columns()}
    return replace(first, **columns, walls=walls)

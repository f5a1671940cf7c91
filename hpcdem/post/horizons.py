"""Horizons of a frame: the line over the top of each layer, that is of each group, or of each colour without groups."""

from __future__ import annotations

import numpy as np

from hpcdem.post import surface as tops
from hpcdem.post.measure.grains import Grains

BALL, SPACING = 3.0, 0.5
"""Radius of the ball that is rolled over the particles of a layer, and distance between the points of a horizon, in
median radii."""


def horizons(g: Grains) -> dict[str, list[np.ndarray]]:
    """Return the top lines (n, 2) [m] of layers, by group or by number of the colour; several lines if particles of a
    layer are missing in between. Detached particles and fixed ones that represent walls are ignored.
    """
    bed = tops.bed(g.x, g.y, g.r, g.fixed) if len(g) else np.zeros(0, bool)
    named = sorted({name for name in g.group[bed].tolist() if name and name != "***"})
    layers = {name: bed & (g.group == name) for name in named}
    layers = layers or {f"color {c}": bed & (g.color == c) for c in np.unique(g.color[bed])}
    return {name: _top(g.take(of)) for name, of in layers.items()}


def _top(g: Grains) -> list[np.ndarray]:
    usual = float(np.median(g.r))
    line = tops.surface(g.x, g.y, g.r, BALL * usual, SPACING * usual)
    pieces = np.split(line, np.flatnonzero(~np.isfinite(line[:, 1])))
    pieces = [piece[np.isfinite(piece[:, 1])] for piece in pieces]
    return [piece for piece in pieces if len(piece) > 1]

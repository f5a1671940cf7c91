"""Shape of a thrust wedge: crest, toe, slopes, taper.

The crest is the highest point of the surface, the toe the point farthest from the straight line between crest and far
end, the slope the straight line fitted to the surface between them, a fifth left out at either end: the rule of the
public program Quantitative-wedge (see `surface.py`). *Forward* is +x, the wall that pushes stands on the left; mirror x
for anything else.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcdem.post.measure.grains import Walls
from hpcdem.post.measure.surface import surface

ROUGH = 3.0
"""Limit of the toe: how much higher the bed stands behind the toe than in front of it, on average and at least, over
the standard deviation of the surface in front. The highest and the farthest point of a rough level surface lie
anywhere, but part nothing."""
LEAST_FRONT = 5
"""Smallest number of surface points from the toe on; where there are fewer, the fall from crest to toe is compared with
the roughness there."""


@dataclass(frozen=True)
class Wedge:
    """Crest and toe [m], surface slope between them [degrees, positive where the surface falls to the right]."""

    crest: tuple[float, float]
    toe: tuple[float, float]
    slope: float


def wedge(xs: np.ndarray, ys: np.ndarray, trim: float = 0.2) -> Wedge:
    """Wedge of a surface by the rule in the head of this file.

    Raises ValueError with the reason if it is missing: nothing falls away from the crest, or by no more than the
    surface is rough.
    """
    crest = int(np.argmax(ys))
    px, py = xs[crest:], ys[crest:]
    if len(px) < 3:
        raise ValueError("the highest point of the surface is its far end, so no slope descends from it")
    ex, ey = px[-1] - px[0], py[-1] - py[0]
    away = np.abs(ex * (py - py[0]) - ey * (px - px[0])) / np.hypot(ex, ey)
    toe = int(np.argmax(away))
    skip = int(toe * trim)
    inside = slice(skip, toe - skip + 1)
    if toe - 2 * skip < 1:
        raise ValueError("crest and toe have fewer than two surface points between them")
    slope = _fitted(px[inside], py[inside])[0]
    if len(px) - toe >= LEAST_FRONT:
        rough = _fitted(px[toe:], py[toe:])[1]
        rise = float(np.mean(ys[: crest + toe]) - np.mean(py[toe:]))
        what = f"behind the toe the surface is {max(rise, 0.0):.4g} m higher on average than in front of it"
    else:
        rough, rise = _fitted(px[: toe + 1], py[: toe + 1])[1], -slope * float(px[toe] - px[0])
        what = f"from crest to toe the surface falls by {max(rise, 0.0):.4g} m"
    if rise < ROUGH * rough:
        raise ValueError(f"the surface is flat: {what}; its roughness is {rough:.4g} m (standard deviation)")
    return Wedge((float(px[0]), float(py[0])), (float(px[toe]), float(py[toe])), float(np.degrees(np.arctan(-slope))))


def _fitted(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Slope of the line through points, and their standard deviation about it; 0 for fewer than three."""
    if len(x) < 3:
        return (float((y[-1] - y[0]) / (x[-1] - x[0])) if len(x) > 1 else 0.0), 0.0
    slope, height = np.polyfit(x, y, 1)
    return float(slope), float(np.std(y - (height + slope * x)))


@dataclass(frozen=True)
class Shape:
    """A wedge above its base. height: top of the grain at the crest above the base below it; width: from the back to
    the toe [m]; base: slope of the base [degrees, positive if it falls to the left, towards the back].
    """

    wedge: Wedge
    back: float
    height: float
    width: float
    base: float

    @property
    def taper(self) -> float:
        """Sum of both slopes [degrees]."""
        return self.wedge.slope + self.base


def shape(x: np.ndarray, y: np.ndarray, r: np.ndarray, walls: Walls, cell: float, back: float | None = None) -> Shape:
    """Return the shape of the wedge of these grains. back: its rear end, the face of the pushing wall [m] (default: the
    leftmost grain). Raises ValueError without a wedge: as `wedge`, or if the crest is less than the largest diameter
    above the toe.
    """
    if not len(x):
        raise ValueError("no particles")
    found = wedge(*surface(x, y, cell))
    fall, diameter = found.crest[1] - found.toe[1], 2.0 * float(np.max(r))
    if fall < diameter:
        raise ValueError(f"the surface is flat: it falls by {fall:.4g} m, the largest diameter is {diameter:g} m")
    back = float(np.min(x - r)) if back is None else back
    rise, height = base(x, y, r, walls, cell, found.crest[0], found.toe[0])
    top = surface(x, y + r, cell)[1].max()
    slope = float(np.degrees(np.arctan(rise)))
    return Shape(found, back, float(top - (height + rise * found.crest[0])), found.toe[0] - back, slope)


def floor(x: np.ndarray, y: np.ndarray, r: np.ndarray, walls: Walls, cell: float, at: np.ndarray) -> np.ndarray:
    """Height of the base (m,) [m] at positions (m,) [m]: of the wall of several segments on which the grains lie, as
    FLEXURE makes one, otherwise of the straight base below all grains; see `base`.

    Segments are flatter than 45 degrees and at most one column away from the lowest grain of their column.
    """
    left, right = float(x.min()), float(x.max())
    rise, height = base(x, y, r, walls, cell, left, right)
    heights = height + rise * at
    px, py = surface(x, r - y, cell)
    lowest = np.interp(at, px, -py)
    found = np.full(len(at), np.nan)
    for (x1, y1), (x2, y2) in walls.values():
        if abs(x2 - x1) <= abs(y2 - y1) or (min(x1, x2) <= left and max(x1, x2) >= right):
            continue
        here = y1 + (y2 - y1) / (x2 - x1) * (at - x1)
        near = (at >= min(x1, x2)) & (at <= max(x1, x2)) & (np.abs(here - lowest) <= cell)
        found[near] = np.fmin(found[near], here[near])
    some = np.isfinite(found)
    if some.mean() > 0.5:
        heights = np.interp(at, at[some], found[some])
    return heights


def base(
    x: np.ndarray, y: np.ndarray, r: np.ndarray, walls: Walls, cell: float, left: float, right: float
) -> tuple[float, float]:
    """(rise, height at x = 0) of the straight base under the stretch from `left` to `right`.

    The wall on which the grains lie there: one flatter than 45 degrees under the whole stretch, at most one column away
    from their lowest points. Otherwise the line fitted to the lowest points of the grains in each column.
    """
    some = (x >= left - cell) & (x <= right + cell)
    if not some.any():
        some = np.ones(len(x), bool)
    low = (y - r)[some]
    px, py = surface(x[some], -low, cell)
    py = -py
    best: tuple[float, float, float] | None = None
    for (x1, y1), (x2, y2) in walls.values():
        if abs(x2 - x1) <= abs(y2 - y1) or min(x1, x2) > left or max(x1, x2) < right:
            continue
        rise = (y2 - y1) / (x2 - x1)
        away = float(np.median(np.abs(py - (y1 + rise * (px - x1)))))
        if away <= cell and (best is None or away < best[0]):
            best = away, rise, y1 - rise * x1
    if best is not None:
        return best[1], best[2]
    if len(px) < 2:
        return 0.0, float(py.min())
    rise, height = np.polyfit(px, py, 1)
    return float(rise), float(height)

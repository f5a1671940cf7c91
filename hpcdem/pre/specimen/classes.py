"""Count kinds and sizes of grains in a file of outlines."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hpcdem.io.ppdem import PpdemGrains
from hpcdem.physics.polyarc.moments import moments
from hpcdem.physics.polyarc.outlines import Outlines, arc_circles
from hpcdem.pre.specimen import counts as number_of
from hpcdem.pre.specimen.grading import Grading
from hpcdem.pre.specimen.shapes import SIDES

SMOOTH = 1e-6
"""Angle [rad] between the normals of two arcs below which their common end is no corner."""
SAME = 1e-4
"""Relative difference below which two sizes belong to one class."""
_NAMES = {sides: name for name, sides in SIDES.items()}


@dataclass(frozen=True)
class Grains:
    """Grains of a file. outlines: in their places; kind (n,): "circle", "ellipse", "triangle", ... or "polyarc"; size
    (n,) f8 [m]: diameter of the circle through the vertices, long axis of an ellipse; area (n,) f8 [m2]; roundness
    (n,) f8: mean of the edges of a polygon, 1 for circles, not a number for others; class_of (n,) i8 into sizes (m,)
    f8 [mm], falling.
    """

    outlines: Outlines
    kind: np.ndarray
    size: np.ndarray
    area: np.ndarray
    roundness: np.ndarray
    class_of: np.ndarray
    sizes: np.ndarray

    def __len__(self) -> int:
        return len(self.outlines)

    @property
    def counts(self) -> np.ndarray:
        """(m,) i8: grains of each class."""
        return np.bincount(self.class_of, minlength=len(self.sizes))

    @property
    def grading(self) -> Grading:
        """The grading by areas, each grain as of the size of its class."""
        by_area = np.bincount(self.class_of, self.area, len(self.sizes))
        return Grading(self.sizes, number_of.percent_finer(by_area))


def classified(grains: PpdemGrains, sizes: np.ndarray | None = None) -> Grains:
    """Kinds and sizes of grains. sizes [mm]: classes to sort them into (the nearest on a log scale); without, every
    size there is makes one."""
    outlines = as_outlines(grains)
    kind, size, roundness = _measured_outlines(grains, outlines)
    found = _sizes(size / 1e-3) if sizes is None else np.sort(np.asarray(sizes, np.float64))[::-1]
    between = 0.5 * (np.log(found[1:]) + np.log(found[:-1]))
    class_of = len(found) - 1 - np.searchsorted(between[::-1], np.log(size / 1e-3))
    return Grains(outlines, kind, size, moments(outlines)[0], roundness, class_of, found)


def as_outlines(grains: PpdemGrains) -> Outlines:
    """Outlines; a circle becomes two half circles."""
    is_circle = grains.diameter > 0.0
    rows = np.diff(grains.start)
    number = np.where(is_circle, 2, rows)
    start = np.concatenate([[0], np.cumsum(number)]).astype(np.int64)
    owner = np.repeat(np.arange(len(grains)), number)
    i = np.arange(start[-1]) - start[owner]
    row = grains.start[:-1][owner] + np.where(is_circle[owner], 0, i)
    side = np.where(is_circle[owner], 0.5 * grains.diameter[owner] * (1.0 - 2.0 * (i % 2)), 0.0)
    theta = np.where(is_circle[owner], math.pi, grains.theta[row])
    return Outlines(start, grains.x[row] + side, grains.y[row], theta)


def _measured_outlines(grains: PpdemGrains, o: Outlines) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    n = len(o)
    radius, cx, cy, first = arc_circles(o)
    kind = np.full(n, "polyarc", dtype="<U13")
    size, roundness = np.empty(n), np.full(n, np.nan)
    for k, (a, b) in enumerate(zip(o.start[:-1], o.start[1:])):
        x, y, theta = o.x[a:b], o.y[a:b], o.theta[a:b]
        if grains.diameter[k] > 0.0:
            kind[k], size[k], roundness[k] = "circle", grains.diameter[k], 1.0
            continue
        turn = (np.roll(first[a:b], -1) - first[a:b] - theta + math.pi) % (2.0 * math.pi) - math.pi
        smooth = bool((np.abs(turn) < SMOOTH).all())
        r = radius[a:b]
        if b - a == 4 and smooth and np.ptp(r) > SMOOTH * r.max():
            mx, my = x.mean(), y.mean()
            end = np.argmin(r)
            kind[k], size[k] = "ellipse", 2.0 * (math.hypot(cx[a + end] - mx, cy[a + end] - my) + r[end])
            continue
        mx, my, around = _circle(x, y)
        size[k] = 2.0 * around
        off = np.abs(np.hypot(x - mx, y - my) - around).max()
        if b - a in _NAMES and off <= 1e-6 * around:
            at = np.arctan2(y - my, x - mx)
            alpha = (np.roll(at, -1) - at) % (2.0 * math.pi)
            kind[k], roundness[k] = _NAMES[int(b - a)], (theta / alpha).mean()
    return kind, size, roundness


def _circle(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Centre and radius of the circle nearest to points (least squares of |p|^2 = 2 c . p + const)."""
    ox, oy = x.mean(), y.mean()
    u, v = x - ox, y - oy
    scale = math.sqrt((u * u + v * v).mean())
    u, v = u / scale, v / scale
    (a, b, c), *_ = np.linalg.lstsq(np.column_stack([2.0 * u, 2.0 * v, np.ones_like(u)]), u * u + v * v, rcond=None)
    return ox + scale * a, oy + scale * b, scale * math.sqrt(c + a * a + b * b)


def _sizes(size: np.ndarray) -> np.ndarray:
    """The different sizes there are, falling; those that differ by less than SAME count as one, their mean."""
    rising = np.sort(size)
    parts = np.split(rising, np.flatnonzero(np.diff(rising) > SAME * rising[1:]) + 1)
    return np.array([part.mean() for part in parts])[::-1]

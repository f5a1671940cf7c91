"""Axes of pictures of frames: the part of the plane shown, its unit, and the positions of ticks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from hpcdem.core.units import label, power_of_ten
from hpcdem.io.frame import Frame

UNITS = ((1e3, 1e3, "km"), (1.0, 1.0, "m"), (0.05, 0.01, "cm"), (1e-3, 1e-3, "mm"), (0.0, 1e-6, "µm"))
"""Smallest longer side [m], length of the unit [m], its name."""
CM = 1.0 / 2.54
"""A centimetre in inches."""
MOST = 12.0
"""Largest number of steps along an axis."""
LEAST = 5
"""Smallest number of labels along a colour bar."""


@dataclass(frozen=True)
class Ticks:
    """Positions of major and minor ticks along one axis, in its unit."""

    major: list[float]
    minor: list[float]

    @property
    def labels(self) -> list[str]:
        """The numbers at the major ticks."""
        return [number(v) for v in self.major]


@dataclass(frozen=True)
class View:
    """The rectangle shown [m], and the unit of its axes; system: units that the model declared, "" SI."""

    left: float
    right: float
    bottom: float
    top: float
    system: str = field(default="", kw_only=True)

    @property
    def width(self) -> float:
        return self.right - self.left

    @property
    def height(self) -> float:
        return self.top - self.bottom

    @property
    def unit(self) -> tuple[float, str]:
        """Length in metres and name of the unit of the axes; the declared unit if the model declares one."""
        if self.system:
            return 1.0, label(self.system, "m")
        longer = max(self.width, self.height)
        return next((size, name) for least, size, name in UNITS if longer >= least)

    def ticks(self, major: float | None = None, minor: float | None = None) -> tuple[Ticks, Ticks]:
        """The ticks of the x and the y axis.

        Both go in the same steps, three to eight of them along the longer side; up to MOST where the other axis would
        have a single number. Only an axis that would have none takes steps of its own. major, minor: steps [m] that are
        wanted instead, on both axes.
        """
        size = self.unit[0]
        sides = (self.left / size, self.right / size), (self.bottom / size, self.top / size)
        if major is not None:
            fine = major / 10.0 if minor is None else minor
            x, y = (Ticks(_multiples(*side, major / size), _multiples(*side, fine / size)) for side in sides)
            return x, y
        longer = max(self.width, self.height) / size
        common = next(step for step in _round_steps(longer) if longer / step <= 7.0)
        finer = [step for step in _round_steps(longer) if step <= common and longer / step <= MOST]
        common = max((s for s in finer if min(len(_multiples(*side, s)) for side in sides) > 1), default=common)
        x, y = (_ticks(*side, common) for side in sides)
        if minor is not None:
            x, y = (Ticks(t.major, _multiples(*side, minor / size)) for t, side in zip((x, y), sides))
        return x, y

    def moved(self, x: float, y: float) -> View:
        """The view of a model that is moved by (x, y)."""
        return View(self.left + x, self.right + x, self.bottom + y, self.top + y)


def view(frame: Frame, extent: tuple[float, float, float, float] | None = None) -> View:
    """Choose the view of a frame whose tables are complete, or whose particles have the given extent.

    With a BOX: the BOX and all walls, as no particle leaves them. Otherwise the walls and the particles. extent: left,
    right, bottom, top of all particles [m], for a frame of which this rank holds a part.
    """
    points = [np.asarray(frame.walls[p], dtype=float).reshape(-1, 2) for p in ("p1", "p2") if p in frame.walls]
    box = [float(frame.settings.get(k, "nan")) for k in ("left", "right", "bottom", "height")]
    boxed = all(map(math.isfinite, box)) and box[1] > box[0] and box[3] > box[2]
    if boxed:
        points.append(np.array([[box[0], box[2]], [box[1], box[3]]]))
    else:
        extent = particle_extent(frame) if extent is None else extent
        points.append(np.array([extent[0::2], extent[1::2]]))
    corners = np.concatenate(points)
    corners = corners[np.isfinite(corners).all(axis=1)]
    if len(corners) == 0:
        return View(0.0, 1.0, 0.0, 1.0)
    left, bottom = (float(v) for v in corners.min(axis=0))
    right, top = (float(v) for v in corners.max(axis=0))
    if len(points[0]) == 0 and not boxed:  # nothing that bounds the particles: give them air
        air = 0.02 * max(right - left, top - bottom)
        left, right, bottom, top = left - air, right + air, bottom - air, top + air
    pad = 0.05 * max(right - left, top - bottom) or 1.0
    if right - left < pad:
        left, right = left - pad, right + pad
    if top - bottom < pad:
        top = top + pad
    return View(left, right, bottom, top)


def particle_extent(frame: Frame) -> tuple[float, float, float, float]:
    """Left, right, bottom, top of this rank's particles [m]; reversed infinite bounds without particles."""
    columns = frame.tables["particles"].columns
    x, y, r = (np.asarray(columns.get(k, np.zeros(0))) for k in ("x", "y", "radius"))
    return (
        float(np.min(x - r, initial=np.inf)),
        float(np.max(x + r, initial=-np.inf)),
        float(np.min(y - r, initial=np.inf)),
        float(np.max(y + r, initial=-np.inf)),
    )


def _round_steps(length: float) -> Iterator[float]:
    """1, 2 and 5 times powers of ten, from small against `length` to twice as long."""
    power = 10.0 ** (math.floor(math.log10(length)) - 2)
    for _ in range(4):
        yield from (power, 2.0 * power, 5.0 * power)
        power *= 10.0


def _ticks(low: float, high: float, major: float) -> Ticks:
    if not _multiples(low, high, major):
        major = max((s for s in _round_steps(high - low) if len(_multiples(low, high, s)) >= 2), default=major)
    minor = major / {"1": 10.0, "2": 4.0, "5": 5.0}[f"{major:e}"[0]]
    return Ticks(_multiples(low, high, major), _multiples(low, high, minor))


def _multiples(low: float, high: float, step: float) -> list[float]:
    """Multiples of `step` from low to high, ends included."""
    first, last = math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6)
    return [k * step for k in range(first, last + 1)]


def bar_ticks(low: float, high: float, log: bool = False) -> list[tuple[float, str]]:
    """Positions of at least LEAST ticks from `low` in round steps, and their labels."""
    if log:
        for parts in ((1.0,), (1.0, 2.0, 5.0), tuple(map(float, range(1, 10)))):
            decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
            if len(parts) == 1:
                decades = decades[:: max(1, len(decades) // 8)]
            found = [part * 10.0**k for k in decades for part in parts]
            found = [v for v in found if low * (1.0 - 1e-9) <= v <= high * (1.0 + 1e-9)]
            if len(found) >= LEAST:
                return [(v, power_of_ten(v)) for v in found]
    step = max(step for step in _round_steps(high - low) if len(_multiples(low, high, step)) >= LEAST)
    digits = max(0, -math.floor(math.log10(step) + 1e-9))
    return [(v, f"{v:.{digits}f}" if abs(v) > 0.5 * step else "0") for v in _multiples(low, high, step)]


def number(value: float) -> str:
    """The shortest text for the number of a tick."""
    return f"{value:.6g}" if abs(value) > 1e-9 else "0"

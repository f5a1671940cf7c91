"""Data common to all pages of a folder: the visible part of the plane, and the displacement of each frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import UsageError
from hpcdem.core.fields import sides_of_box
from hpcdem.io.axes import View
from hpcdem.post.section import Section

KM = 1000.0
AIR = 0.02
"""Free height above the particles over the width of the view."""


@dataclass(frozen=True)
class Outline:
    """The little of a section that every rank knows. extent: left, right, bottom, top of its bed [m]; reach:
    left and right end of its walls [m]; sides: x [m] of the walls that stand upright, by id; came, went: particles
    added and removed since the section before."""

    name: str
    step: int
    initial: bool
    extent: tuple[float, float, float, float]
    reach: tuple[float, float]
    sides: dict[int, float]
    came: int = 0
    went: int = 0


def outline(section: Section, before: Section | None = None) -> Outline:
    """The outline of a section; before: the one before it."""
    p = section.particles
    x, y, r = (np.asarray(p[k], dtype=float)[section.bed] for k in ("x", "y", "radius"))
    extent = (
        float(np.min(x - r, initial=np.inf)), float(np.max(x + r, initial=-np.inf)),
        float(np.min(y - r, initial=np.inf)), float(np.max(y + r, initial=-np.inf)),
    )  # fmt: skip
    reach, sides = (np.inf, -np.inf), {}
    if len(section.walls.get("id", ())):
        p1, p2 = (np.asarray(section.walls[k], dtype=float) for k in ("p1", "p2"))
        own = ~np.isin(
            section.walls["id"], [*sides_of_box(section.walls["id"])]
        )  # BOX is a limit, no part of the model
        ends = np.concatenate([p1[own, 0], p2[own, 0]])
        reach = (float(np.min(ends, initial=np.inf)), float(np.max(ends, initial=-np.inf)))
        upright = np.abs(p2[:, 1] - p1[:, 1]) > np.abs(p2[:, 0] - p1[:, 0])
        middle = 0.5 * (p1[:, 0] + p2[:, 0])
        sides = {int(k): float(at) for k, at in zip(section.walls["id"][upright], middle[upright])}
    came, went = 0, 0
    if before is not None:
        came = len(np.setdiff1d(p["gid"], before.particles["gid"]))
        went = len(np.setdiff1d(before.particles["gid"], p["gid"]))
    return Outline(section.name, section.step, section.initial, extent, reach, sides, came, went)


Limits = tuple[float | None, float | None]
"""Limits of an axis [m], None: those of the model."""


def common_view(outlines: Sequence[Outline], x: Limits = (None, None), y: Limits = (None, None)) -> View:
    """The view of all sections together. x, y: where the axes begin and end [m]; else beyond walls and particles,
    rounded, and from 0 on unless the model is far from there.

    Raises UsageError if nothing is left between the limits.
    """
    extents = np.array([o.extent for o in outlines])
    low_x = min(extents[:, 0].min(), min(o.reach[0] for o in outlines))
    high_x = max(extents[:, 1].max(), max(o.reach[1] for o in outlines))
    low_y, high_y = extents[:, 2].min(), extents[:, 3].max()
    if not np.isfinite([low_x, high_x, low_y, high_y]).all():
        low_x, high_x, low_y, high_y = 0.0, 1.0, 0.0, 1.0
    step = 10.0 ** math.floor(math.log10(max(high_x - low_x, high_y - low_y))) / 10.0
    left, bottom = (_begin(low, high, step) for low, high in ((low_x, high_x), (low_y, high_y)))
    left, bottom = (began if low is None else low for began, (low, _) in zip((left, bottom), (x, y)))
    right = math.ceil(high_x / step - 0.3) * step if x[1] is None else x[1]
    top = math.ceil((high_y + AIR * (right - left)) / step - 0.3) * step if y[1] is None else y[1]
    for axis, low, high in (("x", left, right), ("y", bottom, top)):
        if not high > low:
            raise UsageError(
                f"zdemss: nothing to draw between {axis} = {low / KM:g} km and {axis} = {high / KM:g} km: change "
                f"--{axis}lim or --{axis}max"
            )
    return View(left, right, bottom, top)


def _begin(low: float, high: float, step: float) -> float:
    if -0.5 * step < low <= 0.5 * max(high, 0.0):  # particles stick out of a wall a little
        return 0.0
    return math.floor(low / step) * step


def progress(outlines: Sequence[Outline], unit: tuple[float, str]) -> dict[str, str]:
    """Caption of each section by name: its step, and how much the upright walls have come closer, or apart, since the
    first one. unit: length in metres and name."""
    size, name = unit
    first = outlines[0]
    middle, length = 0.5 * (first.extent[0] + first.extent[1]), first.extent[1] - first.extent[0]
    captions = {}
    for o in outlines:
        text = f"step {o.step}" + (", initial" if o.initial else "")
        moved = {k: o.sides[k] - at for k, at in first.sides.items() if k in o.sides}
        inwards = (
            max((moved[k] for k in moved if first.sides[k] <= middle), key=abs, default=0.0)
            - max((moved[k] for k in moved if first.sides[k] > middle), key=abs, default=0.0)
        )  # fmt: skip
        if length > 0.0 and abs(inwards) > 1e-3 * length:
            word = "shortening" if inwards > 0.0 else "extension"
            text += f": {word} {abs(inwards) / size:.3g} {name} ({100.0 * abs(inwards) / length:.3g} %)"
        captions[o.name] = text
    return captions

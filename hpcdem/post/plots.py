"""Pictures of frames: the figure at the end of a run, those of zdem2jpg, and the pictures of a movie.

matplotlib is imported where it is used, and only its file-writing parts: no window system, no global state.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from hpcdem.core.errors import UsageError
from hpcdem.core.units import stamped
from hpcdem.io.axes import CM, Ticks, View, particle_extent, view
from hpcdem.io.frame import Frame, Table
from hpcdem.io.frames import read_frame
from hpcdem.post.layers import USUAL, Appearance, coloured
from hpcdem.post.saved import write

PAGE_WIDTH = 17.0
"""Width of a figure [cm]: that of a printed page."""
TALLEST = 22.0 / 17.0
"""Largest height of a figure over its width."""
FONT = 9.0
_MARGINS = 0.9 * CM, 0.45 * CM, 1.15 * CM, 0.35 * CM  # left (without numbers), right, bottom, top of the axes
_DIGIT = 0.2 * CM
BAR = 1.9 * CM
"""Width of the colour bar of a field with its labels."""
SIDES = ("left", "right", "bottom", "top")
MODEL = ("bfill", "wall")
"""Default layers of a picture: filled particles and walls."""
MAJOR, MINOR = 10000.0, 1000.0
"""Steps of the ticks of zdem2jpg [m], for models that are neither much smaller nor much larger."""
_LARGE = 120_000.0
_MOST_TICKS = 1000


@dataclass(frozen=True)
class Style:
    """Appearance of a picture. Lengths of the model in metres, `page` (width of the picture) in cm, `font` and lines in
    points, `dpi` dots per inch."""

    what: tuple[str, ...] = MODEL
    page: float = PAGE_WIDTH
    font: float = FONT
    dpi: float = 300.0
    frame_line: float = 0.6
    appearance: Appearance = USUAL
    sides: frozenset[str] = frozenset(SIDES)
    move: tuple[float, float] = (0.0, 0.0)
    limits: dict[str, float] = field(default_factory=dict)  # of SIDES, after the move; those missing by the model
    from_zero: bool = False  # missing left and bottom limits are 0 where the model allows
    major: float | None = None
    minor: float | None = None
    usual_ticks: bool = False  # MAJOR and MINOR where they suit
    title: str | None = None  # {step} and {time} are those of the frame

    def ticks(self, seen: View) -> tuple[Ticks, Ticks]:
        """Return the ticks along both axes. Raises UsageError for more than are readable."""
        major, minor = self.major, self.minor
        if self.usual_ticks and major is None and MAJOR <= max(seen.width, seen.height) <= _LARGE:
            x, y = seen.ticks(MAJOR, MINOR if minor is None else minor)
            if min(len(x.major), len(y.major)) < 2:
                x, y = seen.ticks(None, minor)
        else:
            x, y = seen.ticks(major, minor)
        if max(len(ticks.major) + len(ticks.minor) for ticks in (x, y)) > _MOST_TICKS:
            raise UsageError(f"more than {_MOST_TICKS} ticks along an axis: use larger steps")
        return x, y


USUAL_STYLE = Style()


def seen_of(frame: Frame, style: Style) -> View:
    """Return the part of the moved plane that a picture shows. Raises UsageError if the limits contain nothing."""
    seen = view(frame).moved(*style.move)
    sides = {"left": seen.left, "right": seen.right, "bottom": seen.bottom, "top": seen.top}
    if style.from_zero:
        left, _, bottom, _ = particle_extent(frame)
        air = 0.02 * max(seen.width, seen.height)
        for side, lowest in (("left", left + style.move[0]), ("bottom", bottom + style.move[1])):
            if sides[side] <= 0.0 and lowest > -air:
                sides[side] = 0.0
    sides |= style.limits
    if sides["right"] <= sides["left"] or sides["top"] <= sides["bottom"]:
        raise UsageError(
            f"the limits contain nothing: x from {sides['left']:g} to {sides['right']:g} m, y from "
            f"{sides['bottom']:g} to {sides['top']:g} m"
        )
    return View(*(sides[side] for side in SIDES))


def moved(frame: Frame, x: float, y: float) -> Frame:
    """Return the drawable parts of the frame, moved by (x, y)."""
    tables = dict(frame.tables)
    columns = dict(tables["particles"].columns)
    columns |= {name: columns[name] + d for name, d in (("x", x), ("y", y)) if name in columns}
    tables["particles"] = Table(columns, 0, len(tables["particles"]))
    walls = dict(frame.walls)
    walls |= {p: walls[p] + (x, y) for p in ("p1", "p2") if len(walls.get(p, ()))}
    return replace(frame, tables=tables, walls=walls)


def draw_frame(
    frame: Frame, ax: Any, seen: View | None = None, what: Sequence[str] = MODEL, style: Style = USUAL_STYLE
) -> None:
    """Draw a whole frame into matplotlib axes; what: words of `layers.LAYERS`, in any order.

    The axes get limits, ticks and labels in km (m, cm or mm for small models); their data unit stays the metre, so
    that more can be drawn on top. seen: the part of the plane to show (by default BOX and walls, see `axes.view`).
    """
    from hpcdem.post.layers import LAYERS

    seen = replace(view(frame) if seen is None else seen, system=str(frame.settings.get("units", "")))
    ax.set(xlim=(seen.left, seen.right), ylim=(seen.bottom, seen.top), aspect="equal")
    for word, draw in LAYERS.items():
        if word in what:
            draw(frame, ax, style.appearance)
    _draw_axes(ax, seen, style)
    if style.title is not None:
        text = stamped(style.title, frame.step, frame.time)
        ax.text(0.01, 0.97, text, transform=ax.transAxes, fontsize=style.font, ha="left", va="top", parse_math=False)


def _draw_axes(ax: Any, seen: View, style: Style) -> None:
    size, unit = seen.unit
    for axis, ticks in zip((ax.xaxis, ax.yaxis), style.ticks(seen)):
        axis.set_ticks([v * size for v in ticks.major], labels=ticks.labels, fontsize=style.font)
        axis.set_ticks([v * size for v in ticks.minor], minor=True)
    ax.tick_params(which="major", length=4.0, width=style.frame_line)
    ax.tick_params(which="minor", length=2.0, width=style.frame_line)
    ax.set_xlabel(f"x ({unit})", fontsize=style.font)
    ax.set_ylabel(f"y ({unit})", fontsize=style.font)
    for side, spine in ax.spines.items():
        spine.set_linewidth(style.frame_line)
        spine.set_visible(side in style.sides)


def frame_figure(
    frame: Frame, what: Sequence[str] = MODEL, style: Style = USUAL_STYLE, seen: View | None = None
) -> Any:
    """Return a matplotlib Figure of the frame, as wide as a page; narrower if it would be too high."""
    from matplotlib.figure import Figure

    seen = replace(seen_of(frame, style) if seen is None else seen, system=str(frame.settings.get("units", "")))
    if style.move != (0.0, 0.0):
        frame = moved(frame, *style.move)
    growth = style.font / FONT
    left, right, bottom, top = (growth * margin for margin in _MARGINS)
    left += growth * _DIGIT * max(map(len, style.ticks(seen)[1].labels), default=0)
    bar = coloured(frame, style.appearance)
    right += growth * BAR if bar is not None and bar.scale is not None else 0.0
    available = style.page * CM - left - right, style.page * CM * TALLEST - bottom - top
    if min(available) < 0.5 * CM:
        raise UsageError(f"a page of {style.page:g} cm is too small for numbers of {style.font:g} points")
    scale = min(available[0] / seen.width, available[1] / seen.height)
    width, height = scale * seen.width, scale * seen.height
    page = left + width + right, bottom + height + top
    figure = Figure(figsize=page)
    ax = figure.add_axes((left / page[0], bottom / page[1], width / page[0], height / page[1]))
    draw_frame(frame, ax, seen, what, style)
    if bar is not None and bar.scale is not None:
        from hpcdem.post.view.paper import colour_bar

        place = ((left + width + 0.3 * CM) / page[0], bottom / page[1], 0.3 * CM / page[0], height / page[1])
        colour_bar(figure, figure.add_axes(place), bar.scale, style.font)
    return figure


def plot_frame(
    frame: Frame, path: str | os.PathLike, dpi: float = 300.0, what: Sequence[str] = MODEL,
    style: Style = USUAL_STYLE, seen: View | None = None,
) -> Path:  # fmt: skip
    """Write the picture of a whole frame: JPG, PNG, TIFF, PDF or SVG by the suffix of `path`.

    what: words of `layers.LAYERS`; dpi: dots per inch of JPG, PNG and TIFF; the figure is 17 cm wide unless
    `style` says otherwise. Serial. Raises HpcdemError.
    """
    return write(lambda: frame_figure(frame, what, style, seen), path, dpi)


def plot_file(source: Path, path: Path, style: Style, seen: View | None = None) -> None:
    """Draw the frame of a file in a style. Serial. Raises HpcdemError."""
    tables = ["particles", *(("contacts", "bonds") if {"bondplot", "bondc", "cforce"} & {*style.what} else ())]
    if style.appearance.of_field is not None:  # stress comes from all of them
        tables = ["particles", "contacts", "bonds", "wall_contacts"]
    plot_frame(read_frame(source, tables), path, style.dpi, style.what, style, seen)

"""Views as figures: PNG and JPG, and true vectors in PDF and SVG. matplotlib draws, without a window system. Bodies in
space are painted by screen.py, also for PDF and SVG, and set into the figure."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import UsageError
from hpcdem.core.picture_words import COLOURS
from hpcdem.io.axes import CM, View, number
from hpcdem.post import blocks
from hpcdem.post.saved import write
from hpcdem.post.view import space
from hpcdem.post.view.model import ModelView
from hpcdem.post.view.moment import DISCS, POLYGONS, Moment, read_moment
from hpcdem.post.view.scene import Painted, Reference, Scale, Scene, scene

TALLEST = 1.3
"""Largest height of the model over its width on paper; taller ones are narrower."""
EDGE = "#5a5a5a"
FINE = 2
"""Square root of the number of samples of which each pixel of bodies in three dimensions is the mean."""
EDGES = 0.5
"""Width of the edges of bodies [points]."""
LARGEST = 8192
"""Largest number of pixels of bodies along a side."""
MOST = 2**24
"""Largest number of pixels of bodies: a gigabyte while they are painted."""
_LEFT, _RIGHT, _BOTTOM, _TOP, _BAR = 1.35, 0.35, 1.05, 0.75, 1.9  # cm around the model, and for each bar of colours
SWATCH = 0.8
"""Width of a colour of a class that has several, over the size of letters."""
_CORNER = 2.0
"""Side of the square in which the axes of space are drawn [cm]."""


@dataclass(frozen=True)
class Paper:
    """page: width of the figure [cm]; font in points; dpi: dots per inch of PNG, JPG and TIFF."""

    page: float = 17.0
    font: float = 9.0
    dpi: float = 300.0


USUAL = Paper()


def draw(
    source: str | os.PathLike | Moment,
    picture: str | os.PathLike,
    view: ModelView,
    paper: Paper = USUAL,
    seen: View | None = None,
    only: Mapping[str, np.ndarray] | None = None,
) -> Path:
    """Draw a view of a frame, in a file or as `read_moment` gave it: PNG, JPG, TIFF, PDF or SVG by the suffix of
    `picture`. seen, only: see `scene`. Serial. Raises HpcdemError."""

    def figure() -> Any:
        moment = source if isinstance(source, Moment) else read_moment(source)
        return figure_of(scene(moment, view, seen, only), paper)

    return write(figure, picture, paper.dpi)


def figure_of(shown: Scene, paper: Paper = USUAL) -> Any:
    """A matplotlib Figure of a scene. UsageError if the page is too small."""
    from matplotlib.figure import Figure

    seen, view, k = shown.seen, shown.view, paper.font / 9.0
    bars = [layer for layer in shown.layers if layer.scale is not None] if view.legend else []
    along = None if shown.turn is None else space.axes_of(shown.turn)
    oblique = shown.turn is not None and along is None
    left, bottom = (k * _RIGHT, k * _CORNER) if oblique else (k * _LEFT, k * _BOTTOM)
    left, bottom = (left, bottom) if view.axes else (0.15, 0.15)
    classes = [entry for layer in shown.layers for entry in layer.legend] if view.legend else []
    top = k * (_TOP + 0.45 * (-(-len(classes) // 4))) if view.title or classes else 0.5 * k if bars else 0.15
    references = [layer.reference for layer in shown.layers if layer.reference is not None] if view.legend else []
    arrow_row = 0.5 * k if references else 0.0
    top += arrow_row
    right = k * _RIGHT + k * _BAR * len(bars)
    width = paper.page - left - right
    if width < 1.0:
        raise UsageError(f"a page of {paper.page:g} cm is too small for letters of {paper.font:g} points")
    height = width * seen.height / seen.width
    if height > TALLEST * width:
        width, height = TALLEST * width * seen.width / seen.height, TALLEST * width
    page = left + width + right, bottom + height + top
    figure = Figure(figsize=(page[0] * CM, page[1] * CM))
    axes = figure.add_axes((left / page[0], bottom / page[1], width / page[0], height / page[1]))
    blocks.frame(axes, seen, blocks.Appearance(font=paper.font), first=True, last=True)
    if not view.axes or oblique:
        axes.set_axis_off()
    if shown.turn is not None:
        body(axes, shown, width * CM * paper.dpi, paper.dpi)
        if along is not None:
            _named(axes, seen, along, paper.font)
        elif view.axes:
            _axes_of_space(figure, shown.turn, paper.font, k * _CORNER, page)
            _length(figure, seen, width, (left + width, 0.45 * k), paper.font, page)
    handles = []
    for place, layer in enumerate(shown.layers):
        if shown.turn is None:
            _draw(axes, layer, place)
        handles += handles_of(layer) if view.legend else []
    _bars(figure, bars, (left + width, bottom, height), k, paper.font, page)
    if handles:
        _legend(axes, handles, 1.0 + arrow_row / height, 0.9 * paper.font)
    end = left + width
    for reference in references:
        end -= _arrow(figure, reference, width / seen.width, (end, bottom + height + 0.25 * k), paper.font, page)
    if view.title:
        figure.text(
            (left + width) / page[0], 1.0 - 0.1 / page[1], shown.title(), fontsize=paper.font, ha="right", va="top",
            parse_math=False,
        )  # fmt: skip
    return figure


def _bars(
    figure: Any, layers: list[Any], place: tuple[float, float, float], k: float, font: float, page: tuple[float, float]
) -> None:
    """Bars of colours. place: right side, bottom and height of the axes [cm]; k: size of letters over the usual one."""
    right, bottom, height = place
    for which, layer in enumerate(layers):
        at = right + k * (0.3 + _BAR * which)
        box = at / page[0], bottom / page[1], 0.3 * k / page[0], height / page[1]
        colour_bar(figure, figure.add_axes(box), layer.scale, font)


def _legend(axes: Any, handles: list[tuple[str, Any]], bottom: float, font: float) -> None:
    """Words and their patches, over the axes."""
    axes.legend(
        [patches for _, patches in handles], [word for word, _ in handles], loc="lower left",
        bbox_to_anchor=(0.0, bottom), ncols=4, frameon=False, fontsize=font, borderaxespad=0.15,
        handlelength=max(1.2, *(SWATCH * len(patches) for _, patches in handles)), columnspacing=1.0,
        handletextpad=0.4, handler_map={tuple: _swatches()},
    )  # fmt: skip


def body(axes: Any, shown: Scene, pixels: float, dpi: float) -> None:
    """The picture of bodies in three dimensions, of this width in pixels."""
    from hpcdem.post.view.screen import paint

    seen = shown.seen
    columns = max(1, min(round(pixels), LARGEST, math.isqrt(int(MOST * seen.width / seen.height))))
    rows = max(1, min(round(columns * seen.height / seen.width), LARGEST))
    picture = paint(shown, columns, rows, FINE, pen=EDGES * columns / pixels * dpi / 72.0)
    axes.imshow(picture.colours, extent=(seen.left, seen.right, seen.bottom, seen.top), interpolation="antialiased",
                aspect="equal", zorder=0.5)  # fmt: skip


def _named(axes: Any, seen: View, along: tuple[tuple[float, str], tuple[float, str]], font: float) -> None:
    """Axes of space along the sides of the picture, which may run to the left or down."""
    size, unit = seen.unit
    for axis, (sign, name) in zip((axes.xaxis, axes.yaxis), along, strict=True):
        axis.set_label_text(f"{name} ({unit})", fontsize=font)
        if sign < 0.0:
            places = axis.get_majorticklocs()
            axis.set_ticks(places, labels=[number(-v / size) for v in places])


def _axes_of_space(figure: Any, turn: np.ndarray, font: float, side: float, page: tuple[float, float]) -> None:
    """Arrows of x, y and z in the lower left corner, in a square of this side [cm]."""
    axes = figure.add_axes((0.1 / page[0], 0.1 / page[1], side / page[0], side / page[1]))
    axes.set(xlim=(-1.35, 1.35), ylim=(-1.35, 1.35), aspect="equal")
    axes.set_axis_off()
    for k in np.argsort(turn[2]):  # what comes towards the eye over what goes away from it
        x, y = turn[:2, k]
        axes.annotate("", (x, y), (0.0, 0.0), arrowprops={"arrowstyle": "-|>", "lw": 0.8, "color": EDGE, "shrinkA": 0,
                                                          "shrinkB": 0})  # fmt: skip
        axes.text(1.22 * x, 1.22 * y, "xyz"[k], fontsize=font, ha="center", va="center")


def _length(
    figure: Any, seen: View, width: float, at: tuple[float, float], font: float, page: tuple[float, float]
) -> None:
    """A bar of a round length, which ends at `at` [cm] on the right; far things are not smaller."""
    size, unit = seen.unit
    tick = seen.ticks()[0].major
    step = (tick[1] - tick[0]) if len(tick) > 1 else 0.2 * seen.width / size
    part = step * size / seen.width * width
    low = at[1] / page[1]
    ends = (at[0] - part) / page[0], at[0] / page[0]
    axes = figure.add_axes((ends[0], low, ends[1] - ends[0], 0.09 / page[1]))
    axes.set(xticks=[], yticks=[], facecolor=EDGE)
    for spine in axes.spines.values():
        spine.set_visible(False)
    figure.text(0.5 * (ends[0] + ends[1]), low + 0.15 / page[1], f"{number(step)} {unit}", fontsize=font, ha="center",
                va="bottom")  # fmt: skip


def _arrow(
    figure: Any, reference: Reference, scale: float, at: tuple[float, float], font: float, page: tuple[float, float]
) -> float:
    """An arrow of a round value that ends at `at` [cm], what it is before it; scale: cm per metre. Width of both."""
    from matplotlib.patches import FancyArrowPatch

    length = scale * reference.length
    ends = ((at[0] - length) / page[0], at[1] / page[1]), (at[0] / page[0], at[1] / page[1])
    figure.add_artist(FancyArrowPatch(
        *ends, transform=figure.transFigure, arrowstyle="-|>", mutation_scale=0.6 * font, shrinkA=0.0, shrinkB=0.0,
        color="#202020", linewidth=0.8,
    ))  # fmt: skip
    figure.text((at[0] - length - 0.15) / page[0], at[1] / page[1], reference.text, fontsize=0.9 * font, ha="right",
                va="center")  # fmt: skip
    return length + 0.6 + 0.018 * font * len(reference.text)


def _draw(axes: Any, layer: Painted, order: int) -> None:
    """Draw a layer over those before it."""
    from matplotlib.collections import LineCollection, PolyCollection

    from hpcdem.post.discs import Discs

    shade, alpha, order = layer.shades[layer.kind], layer.layer.opacity, 1 + 2 * order
    if layer.kind_of_shape == DISCS:
        places, radius = layer.shape
        found: list[Any] = [Discs(places, radius, layer.shades, layer.kind)]
        if layer.layer.edges:
            found.append(Discs(places, radius, np.zeros((1, 3)), np.zeros(len(layer.rows), np.int64), 0.3))
        for discs in found:
            discs.set_alpha(alpha)
    elif layer.kind_of_shape == POLYGONS:
        points, cells = layer.shape
        found = []
        for n in (3, 4):
            some = np.flatnonzero((cells[:, 3] >= 0) == (n == 4))
            if len(some):
                found.append(PolyCollection(
                    points[cells[some, :n]], facecolors=shade[some], alpha=alpha, linewidths=0.25,
                    edgecolors=EDGE if layer.layer.edges else "face" if alpha == 1.0 else "none",
                ))  # fmt: skip
    else:
        found = [LineCollection(layer.shape[0], colors=shade, linewidths=layer.width, alpha=alpha, capstyle="round")]
    for artist in found:
        artist.set_zorder(order)
        axes.add_collection(artist, autolim=False)
    if layer.arrows is not None:
        at, far = layer.arrows
        axes.quiver(
            *at.T, *far.T, angles="xy", scale_units="xy", scale=1.0, width=0.0015, color="#202020", zorder=order + 1
        )  # fmt: skip


def handles_of(layer: Painted) -> list[Any]:
    from matplotlib.patches import Patch

    return [(word, tuple(Patch(color=one) for one in shades.split())) for word, shades in layer.legend]


def _swatches() -> Any:
    """Make the legend handler that draws the colours of a class side by side before its label, as wide as they need."""
    from matplotlib.legend_handler import HandlerTuple

    class Swatches(HandlerTuple):
        def create_artists(self, legend: Any, patches: Any, x: float, y: float, width: float, height: float,
                           font: float, place: Any) -> Any:  # fmt: skip
            own = font * max(1.2, SWATCH * len(patches))
            return super().create_artists(legend, patches, x - (width - own), y, own, height, font, place)

    return Swatches(ndivide=None, pad=0.0)


def colour_bar(figure: Any, axes: Any, scale: Scale, font: float) -> None:
    """The bar of colours of a field, in axes of its own; its ends are pointed where values lie beyond them."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    beyond = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
    colours = ScalarMappable(Normalize(0.0, 1.0), COLOURS[scale.colours])
    bar = figure.colorbar(colours, cax=axes, extend=beyond[scale.below, scale.above], extendfrac=0.04)
    ticks = scale.ticks()
    high = axes.get_position().height * figure.get_figheight() * 72.0 / font
    while len(ticks) > high / 1.15 and len(ticks) > 5:  # they would overlap
        ticks = ticks[::2]
    bar.set_ticks([place for place, _ in ticks], labels=[text for _, text in ticks], minor=False)
    bar.minorticks_off()
    bar.ax.tick_params(labelsize=0.85 * font, width=0.5, length=2.5)
    bar.outline.set_linewidth(0.5)
    bar.set_label(scale.title, fontsize=0.9 * font)

"""Views as figures: PNG and JPG, and true vectors in PDF and SVG. matplotlib draws, without a window system."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.core.looks import COLOURS
from hpcdem.io.agreed import atomic_path
from hpcdem.io.axes import CM, View
from hpcdem.post import blocks
from hpcdem.post.saved import FORMATS, SAVED, saving
from hpcdem.post.view.model import ModelView
from hpcdem.post.view.moment import DISCS, POLYGONS, Moment, read_moment
from hpcdem.post.view.scene import Painted, Scale, Scene, scene

TALLEST = 1.3
"""Largest height of the model over its width on paper; taller ones are narrower."""
EDGE = "#5a5a5a"
_LEFT, _RIGHT, _BOTTOM, _TOP, _BAR = 1.35, 0.35, 1.05, 0.75, 1.9  # cm around the model, and for each bar of colours


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
    picture = Path(picture)
    kind = picture.suffix.lower().removeprefix(".")
    kind = {"jpeg": "jpg", "tif": "tiff"}.get(kind, kind)
    if picture.suffix.lower() not in FORMATS:
        raise HpcdemError(f"cannot draw {picture}: pictures end in {', '.join(FORMATS)}")
    try:
        import matplotlib
    except ImportError:
        raise HpcdemError(f"cannot draw {picture}: matplotlib is not installed") from None
    moment = source if isinstance(source, Moment) else read_moment(source)
    with matplotlib.rc_context(SAVED):
        figure = figure_of(scene(moment, view, seen, only), paper)
        if kind in ("jpg", "png", "tiff") and max(figure.get_size_inches()) * paper.dpi >= 2**16:
            raise HpcdemError(f"cannot draw {picture}: more than 65535 pixels along a side; take a smaller page or dpi")
        with atomic_path(picture) as temporary:
            figure.savefig(temporary, format=kind, dpi=paper.dpi, **saving(kind))
    return picture


def figure_of(shown: Scene, paper: Paper = USUAL) -> Any:
    """A matplotlib Figure of a scene. UsageError if the page is too small."""
    from matplotlib.figure import Figure

    seen, view, k = shown.seen, shown.view, paper.font / 9.0
    bars = [layer for layer in shown.layers if layer.scale is not None] if view.legend else []
    left, bottom = (k * _LEFT, k * _BOTTOM) if view.axes else (0.15, 0.15)
    classes = [entry for layer in shown.layers for entry in layer.legend] if view.legend else []
    top = k * (_TOP + 0.45 * (-(-len(classes) // 4))) if view.title or classes else 0.15
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
    blocks.frame(axes, seen, blocks.Looks(font=paper.font), first=True, last=True)
    if not view.axes:
        axes.set_axis_off()
    handles = []
    for number, layer in enumerate(shown.layers):
        _draw(axes, layer, number)
        handles += _handles(layer) if view.legend else []
    for number, layer in enumerate(bars):
        at = left + width + k * (0.3 + _BAR * number)
        assert layer.scale is not None
        colour_bar(figure, figure.add_axes((at / page[0], bottom / page[1], 0.3 * k / page[0], height / page[1])),
             layer.scale, paper.font)  # fmt: skip
    if handles:
        axes.legend(
            handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, frameon=False,
            fontsize=0.9 * paper.font, borderaxespad=0.15, handlelength=1.2, columnspacing=1.0, handletextpad=0.4,
        )  # fmt: skip
    if view.title:
        figure.text(
            (left + width) / page[0], 1.0 - 0.1 / page[1], shown.title(), fontsize=paper.font, ha="right", va="top",
            parse_math=False,
        )  # fmt: skip
    return figure


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


def _handles(layer: Painted) -> list[Any]:
    from matplotlib.patches import Patch

    return [Patch(color=shade, label=word) for word, shade in layer.legend]


def colour_bar(figure: Any, axes: Any, scale: Scale, font: float) -> None:
    """The bar of colours of a field, in axes of its own."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize

    high = scale.high if scale.high > scale.low else scale.low + max(1e-12, 1e-9 * abs(scale.low))
    norm = (LogNorm if scale.log else Normalize)(scale.low, high)
    bar = figure.colorbar(ScalarMappable(norm, COLOURS[scale.colours]), cax=axes)
    bar.ax.tick_params(labelsize=0.85 * font, width=0.5, length=2.5)
    if not scale.log:
        bar.formatter.set_powerlimits((-3, 4))
        bar.ax.yaxis.get_offset_text().set_fontsize(0.85 * font)
        bar.ax.yaxis.get_offset_text().set_horizontalalignment("left")
    bar.outline.set_linewidth(0.5)
    bar.set_label(scale.title, fontsize=0.9 * font)

"""Diagrams: curves in axes, for papers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core import units
from hpcdem.io.vtkhdf_mesh import MeshState
from hpcdem.post.saved import save

SIZE = 5.5, 3.9
"""Size of the diagram [inches]."""
FONT = 9.0
"""Size of letters of a diagram beside a model [points]."""
BAR = 0.85
"""Width of a colour bar beside a body, with its numbers and name [inches]."""
IN_SPACE = {
    "plastic": ("elements", "plastic_shear_strain"), "temperature": ("elements", "mean_temperature"),
    "pressure": ("joints", "fluid_pressure"), "saturation": ("joints", "saturation"),
    "aperture": ("joints", "aperture"), "velocity": ("joints", "fluid_velocity"),
    "concentration": ("joints", "proppant_concentration"), "cracks": ("joints", ""),
}  # fmt: skip
"""Field that colours a body beside a diagram, by the panel: objects and one of their fields."""
COLOURS = ("#202020", "#2a8c5a", "#8c5aa8", "#9a6b2f")
"""Colours of curves beside a model; no crack has any of them."""
Points = Sequence[tuple[float, float]]


def draw(
    path: Path,
    kind: str,
    title: str,
    x_label: str,
    y_label: str,
    curves: Sequence[tuple[str, str, Points]],
    model: MeshState | None = None,
    beside: str = "cracks",
) -> None:
    """Draw curves (label, "line" or "points", points) into a file of this kind: png, pdf or svg. model: blocks drawn
    next to the diagram, as one of hpcdem.post.blocks.PANELS.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    if model is None:
        figure = Figure(figsize=SIZE, layout="constrained")
        axes = figure.add_subplot()
    else:
        figure, axes = (_beside if model.points.shape[1] == 2 else _body_beside)(model, beside)
    every = np.array([point for *_, points in curves for point in points]).reshape(-1, 2)
    (x_size, x_label), (y_size, y_label) = (_axis(*both) for both in zip((x_label, y_label), every.T, strict=True))
    for label, style, points in curves:
        x, y = [p[0] / x_size for p in points], [p[1] / y_size for p in points]
        if style == "points":
            axes.plot(x, y, "o", markersize=4, markerfacecolor="none", label=label)
        else:
            axes.plot(x, y, linewidth=1.2, label=label)
    axes.set(xlabel=x_label, ylabel=y_label)
    for axis in (axes.xaxis, axes.yaxis):
        axis.get_major_formatter().set_scientific(False)
        axis.get_major_formatter().set_useOffset(False)
    axes.tick_params(direction="in", top=True, right=True)
    if title:
        axes.set_title(title)
    if len(curves) > 1:
        axes.legend(frameon=False)
    save(figure, str(path), kind, 200.0, path)


def _axis(label: str, values: np.ndarray) -> tuple[float, str]:
    """Size of the unit in which values are drawn along an axis, and the label with it: a unit of SI at its end, as
    "stress [Pa]", gets the prefix that suits, values without one a power of ten where they are very large or small."""
    found = re.fullmatch(r"(.*?)\s*([\[(])([^\])]+)[\])]\s*", label, re.DOTALL)
    unit = found[3] if found and len(units.ladder(found[3])) > 1 else ""
    known = values[np.isfinite(values)]
    size, name = units.on_bar(float(known.min(initial=0.0)), float(known.max(initial=0.0)), unit)
    if found and unit:
        return size, f"{found[1]} {found[2]}{name}{']' if found[2] == '[' else ')'}"
    if found and name:  # in a unit of the script
        return size, f"{found[1]} {found[2]}{name} {found[3]}{']' if found[2] == '[' else ')'}"
    return size, f"{label} ({name})" if name else label


def _beside(model: MeshState, panel: str) -> tuple[Any, Any]:
    """A figure with a model on the left, and the axes for a diagram on the right."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    from hpcdem.post import blocks

    coloured = panel != blocks.CRACKS
    views = {blocks.CRACKS: blocks.view, blocks.TEMPERATURE: blocks.view, blocks.PLASTIC: blocks.view_of_flow}
    seen = views.get(panel, blocks.view_of_fluid)(model)
    height = SIZE[1] - (0.95 if coloured else 0.75)  # of the panels: above and below there are words
    width = min(max(height * seen.width / seen.height, 0.3 * height), 1.5 * height)
    page = 0.7 + width + 0.75 + SIZE[0] - 1.4 + 0.15, SIZE[1]
    figure = Figure(figsize=page)
    left = figure.add_axes((0.7 / page[0], 0.5 / page[1], width / page[0], height / page[1]))
    right = figure.add_axes(
        ((0.7 + width + 0.75) / page[0], 0.5 / page[1], (SIZE[0] - 1.4) / page[0], height / page[1])
    )
    modes: list[Any] = []
    if coloured:
        shown = blocks.COLOURED[panel]
        blocks.frame(left, seen, blocks.USUAL, first=True, last=True)
        filled = blocks.coloured(left, model, panel, shown.range(model), 2.54 * width / seen.width)
        modes = blocks.supports(left, model)
        left.apply_aspect()
        box = left.get_position()
        begin = min(max(0.55, 1.75 / (box.width * page[0])), 0.75)  # between "(a)" and the bar stands its name
        bar = figure.add_axes(
            (box.x0 + begin * box.width, box.y1 + 0.1 / page[1], (1.0 - begin) * box.width, 0.07 / page[1])
        )
        if filled is None:
            bar.set_axis_off()
        else:
            every = 4 if begin == 0.55 else 8
            ticks = filled.levels[::every] if panel in blocks.CONTOURS else MaxNLocator(3)
            figure.colorbar(filled, cax=bar, orientation="horizontal", ticks=ticks)
        bar.tick_params(labelsize=0.8 * FONT, width=0.5, length=2.0, labelbottom=False, labeltop=True, bottom=False,
                        top=True, pad=1.0)  # fmt: skip
        title = blocks.titled(shown, shown.range(model), model)
        bar.text(-0.05, 0.5, title, fontsize=0.9 * FONT, ha="right", va="center",
                 transform=bar.transAxes)  # fmt: skip
    else:
        modes = blocks.panel(left, model, seen, 2.54 * width)
    _lettered(left, right)
    if modes and coloured:
        left.legend(handles=modes, loc="lower right", fontsize=0.75 * FONT, borderaxespad=0.3, framealpha=0.9,
                    edgecolor="none", handlelength=1.2, handletextpad=0.4)  # fmt: skip
    elif modes:  # over the diagram there is room for all of them in one line
        tight = len(modes) > 2
        figure.legend(
            handles=modes, loc="lower right", bbox_to_anchor=(1.0, 1.0), bbox_transform=right.transAxes, ncols=4,
            frameon=False, fontsize=(0.75 if tight else 0.9) * FONT, borderaxespad=0.15,
            handlelength=1.2, columnspacing=0.8 if tight else 1.0,
            handletextpad=0.4,
        )  # fmt: skip
    return figure, right


def _lettered(left: Any, right: Any) -> None:
    """Letters over a model and a diagram, and the looks of the diagram."""
    for axes, label in ((left, "(a)"), (right, "(b)")):
        axes.set_title(label, loc="left", fontsize=FONT, pad=3.0)
    right.set_prop_cycle(color=COLOURS)
    right.tick_params(labelsize=FONT)
    right.xaxis.label.set_fontsize(FONT)
    right.yaxis.label.set_fontsize(FONT)


def _body_beside(model: MeshState, panel: str) -> tuple[Any, Any]:
    """Figure and axes beside a body in three dimensions, painted as by `hpcdem draw`: joints are visible through
    elements."""
    from matplotlib.figure import Figure

    from hpcdem.post.view import paper
    from hpcdem.post.view.moment import of_blocks
    from hpcdem.post.view.scene import PALE, THROUGH, default_view, scene

    moment, (kind, name) = of_blocks(model), IN_SPACE[panel]
    view = default_view(moment).with_layer("elements", field="", colour=PALE[0], edges=False, opacity=THROUGH)
    if kind == "elements":
        view = view.with_layer("elements", field=name if moment.of(kind).has(name) else "", colour="", opacity=1.0)
        view = view.changed(layers=[layer for layer in view.model_dump()["layers"] if layer["object"] != "joints"])
    elif kind in moment.objects:
        view = view.with_layer("joints", field=name)
    shown = scene(moment, view)
    bars = [layer.scale for layer in shown.layers if layer.scale is not None]
    height = SIZE[1] - 0.75
    width = min(max(height * shown.seen.width / shown.seen.height, 0.3 * height), 1.5 * height)
    begin = 0.2 + width + BAR * len(bars) + 0.55
    page = begin + SIZE[0] - 1.4 + 0.15, SIZE[1]
    figure = Figure(figsize=page)
    left = figure.add_axes((0.2 / page[0], 0.5 / page[1], width / page[0], height / page[1]))
    right = figure.add_axes((begin / page[0], 0.5 / page[1], (SIZE[0] - 1.4) / page[0], height / page[1]))
    left.set_axis_off()
    paper.body(left, shown, 200.0 * width, 200.0)
    for number, scale in enumerate(bars):
        at = (0.3 + width + BAR * number) / page[0], 0.5 / page[1], 0.1 / page[0], height / page[1]
        paper.colour_bar(figure, figure.add_axes(at), scale, FONT)
    handles = [handle for layer in shown.layers for handle in paper.handles_of(layer)]
    if handles:
        words, patches = zip(*handles, strict=True)
        left.legend(patches, words, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=3, frameon=False,
                    fontsize=0.75 * FONT)  # fmt: skip
    _lettered(left, right)
    return figure, right

"""Pictures of blocks: cracks coloured by mode, axial forces of bolts, forces and moments of liners,
contours of the compressive stress and of plastic strain, and fluid in channels.

matplotlib is imported where it is used, and only its file-writing parts: no window system, no global state.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core import units
from hpcdem.core.errors import UsageError
from hpcdem.io.axes import CM, View
from hpcdem.io.vtkhdf_mesh import MeshState, read_mesh_frame
from hpcdem.numerics.clusters import spots
from hpcdem.post import bolts, fluid, liners
from hpcdem.post.saved import write

CRACKS, STRESS, PLASTIC, TEMPERATURE = "cracks", "stress", "plastic", "temperature"
PANELS = (CRACKS, STRESS, PLASTIC, TEMPERATURE, *fluid.PICTURES)
FREE, YIELDED, BROKEN = 0.0, 2.0, 3.0
"""States of joints, as frames have them; free: cracks that were there from the beginning."""
TENSION, MIXED, SHEAR = "#c81e1e", "#d98c00", "#1e3cb4"
OPEN, YIELD, EDGE, INK = "#202020", "#8f8f8f", "#c9ced1", "#202020"
LINES = (TENSION, MIXED, SHEAR, INK)
GROUPS = ("#e9e4d8", "#d5dde3", "#dfe8d2", "#f1dfc8", "#e2d8e6", "#d3e4e2", "#ece6bf", "#dcd6cf")
KINDS = ((1.0, 4.0 / 3.0, TENSION, "tension"), (4.0 / 3.0, 5.0 / 3.0, MIXED, "mixed"), (5.0 / 3.0, 2.1, SHEAR, "shear"))
"""Kinds of broken joints: lowest and highest mode (1 opened, 2 slid), colour, word."""
MOST_EDGES = 4000
"""Largest number of edges of a mesh that is drawn; the mesh of a larger model would be illegible."""
NEAR = 1e-3
"""Distance over an edge: corners that are nearer to each other get the mean of their stresses."""
LEVELS = 14
ROUNDING = 1e-3  # of a step between contours: values that are so little outside are at the edge
_LEFT, _BOTTOM, _TOP, _GAP, _BAR = 1.25, 1.05, 1.0, 0.5, 1.6  # cm around the panels, between them, for the colours


@dataclass(frozen=True)
class Appearance:
    """Appearance of a figure of blocks.

    panels: names of PANELS (default: cracks, stress, and if available plastic strain and fluid pressure; with heat
    cracks, or without joints stress, and temperature); page: width [cm]; font: size and lines in points; dpi: dots per
    inch; title: in the corner, with {step} and {time}; ranges: limits of the colours of panels in SI units (default:
    those of the frame).
    """

    panels: tuple[str, ...] = ()
    page: float = 17.0
    font: float = 9.0
    dpi: float = 300.0
    title: str | None = None
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)


USUAL = Appearance()


def view(state: MeshState) -> View:
    """Return the part of the plane that contains the model, with a margin."""
    if not len(state.points):
        return View(0.0, 1.0, 0.0, 1.0)
    low, high = state.points.min(axis=0), state.points.max(axis=0)
    air = 0.03 * max(float((high - low).max()), 1e-12)
    return View(float(low[0]) - air, float(high[0]) + air, float(low[1]) - air, float(high[1]) + air)


def view_of_flow(state: MeshState) -> View:
    """Return the part of the plane with plastic strain, bolts or liners, enlarged by half of its width; the whole model
    if that is hardly larger.
    """
    from hpcdem.post.bolts import areas

    cells = state.cells[plastic_shear(state) > 0.01 * plastic_range(state)[1]]
    points = [state.points[cells[cells >= 0]]]
    if "bolts" in state.supports:
        points.append(areas(state)[0].reshape(-1, 2))
    if "liners" in state.supports:
        points.append(liners.areas(state, "axial_force", "axial_force")[0].reshape(-1, 2))
    return _around(state, np.concatenate(points))


def view_of_fluid(state: MeshState) -> View:
    """Return the part of the plane around channels."""
    return _around(state, fluid.ends(state))


def _around(state: MeshState, there: np.ndarray) -> View:
    """The part of the plane with these points (n, 2) and half of its width around it; the whole model where that is
    hardly more."""
    whole = view(state)
    if not len(there):
        return whole
    low, high = there.min(axis=0), there.max(axis=0)
    middle, half = 0.5 * (low + high), 0.75 * float((high - low).max())
    if 2.0 * half > 0.6 * max(whole.width, whole.height):
        return whole
    (left, bottom), (right, top) = middle - half, middle + half
    return View(max(left, whole.left), min(right, whole.right), max(bottom, whole.bottom), min(top, whole.top))


def compression(state: MeshState) -> np.ndarray:
    """Return the larger compressive stress in the plane (ne,) [Pa], minus the smaller principal stress."""
    s = state.of_elements
    mean, half = 0.5 * (s["stress_xx"] + s["stress_yy"]), 0.5 * (s["stress_xx"] - s["stress_yy"])
    return -(mean - np.hypot(half, s["stress_xy"]))


def plastic_shear(state: MeshState) -> np.ndarray:
    """Return the accumulated plastic shear strain (ne,); 0 if the frame has none."""
    return state.of_elements.get("plastic_shear_strain", np.zeros(len(state.cells)))


def temperature(state: MeshState) -> np.ndarray:
    """Return the temperature of the corners (n,); 0 if the frame has none."""
    return state.of_points.get("temperature", np.zeros(len(state.points)))


def temperature_range(state: MeshState) -> tuple[float, float]:
    """Return the least and greatest temperature of the corners of elements."""
    values = temperature(state)[state.cells[state.cells >= 0]]
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)


def stress_range(state: MeshState) -> tuple[float, float]:
    """Return the least and greatest compressive stress [Pa] without the extreme percent of the elements."""
    values = compression(state)
    values = values[np.isfinite(values)]
    if not len(values):
        return 0.0, 1.0
    low, high = np.percentile(values, (1.0, 99.0))
    return float(min(low, 0.0) if low > -0.05 * abs(high) else low), float(high)


def plastic_range(state: MeshState) -> tuple[float, float]:
    """Return the range from 0 to the greatest plastic strain without the extreme percent of the elements that have
    some."""
    values = plastic_shear(state)
    values = values[values > 0.0]
    return 0.0, float(np.percentile(values, 99.0)) if len(values) else 0.0


@dataclass(frozen=True)
class Contours:
    """A panel with contours of values of elements or of their corners; units: from the largest value to size and name
    of the unit.
    """

    values: Callable[[MeshState], np.ndarray]
    range: Callable[[MeshState], tuple[float, float]]
    unit: str
    title: str
    colours: str
    of_corners: bool = False


def panels_of(state: MeshState) -> tuple[str, ...]:
    """Return the default panels for the quantities of a frame."""
    wet = (TEMPERATURE,) * ("temperature" in state.of_points) + ("pressure",) * fluid.there(state)
    wet += ("concentration",) * fluid.with_proppant(state)
    if wet[:1] == (TEMPERATURE,) and plastic_range(state)[1] == 0.0:
        return (CRACKS if len(state.joints) else STRESS), *wet
    if plastic_range(state)[1] > 0.0:
        return ((CRACKS,) if len(state.joints) else ()) + (STRESS, PLASTIC, *wet)
    return CRACKS, STRESS, *wet


def plot(state: MeshState, path: str | os.PathLike, appearance: Appearance = USUAL, seen: View | None = None) -> Path:
    """Write the picture of a frame, see `saved.write`."""
    return write(lambda: draw(state, appearance, seen), path, appearance.dpi)


def plot_file(source: Path, path: Path, appearance: Appearance, seen: View | None = None) -> None:
    """Draw the frame in a file."""
    plot(read_mesh_frame(source), path, appearance, seen)


def draw(state: MeshState, appearance: Appearance = USUAL, seen: View | None = None) -> Any:
    """Return a matplotlib Figure with the panels, side by side for tall models, otherwise stacked."""
    from matplotlib.figure import Figure

    seen = replace(view(state) if seen is None else seen, system=state.units)
    panels = appearance.panels or panels_of(state)
    ratio = seen.height / seen.width
    beside = len(panels) > 1 and ratio > 0.7
    across = len(panels) if beside else 1
    k = appearance.font / 9.0
    left, bottom, top, gap, bar = (k * length for length in (_LEFT, _BOTTOM, _TOP, _GAP, _BAR))
    after = [gap if panel == CRACKS else bar for panel in panels]  # room for colours, or none
    between = sum(after[:-1]) if beside else 0.0
    free = (appearance.page - left - bar - between) / across
    if free < 1.0:
        raise UsageError(f"a page of {appearance.page:g} cm is too small for letters of {appearance.font:g} points")
    width = min(free, 21.0 / ratio)
    height = width * ratio
    down = 1 if beside else len(panels)
    page = left + across * width + between + bar, down * (height + top) + (down - 1) * 0.3 * gap + bottom
    figure = Figure(figsize=(page[0] * CM, page[1] * CM))
    for number, panel in enumerate(panels):
        x = left + (number * width + sum(after[:number]) if beside else 0.0)
        y = bottom + (0 if beside else (down - 1 - number) * (height + top + 0.3 * gap))
        axes = figure.add_axes((x / page[0], y / page[1], width / page[0], height / page[1]))
        frame(axes, seen, appearance, first=number == 0 or not beside, last=beside or number == down - 1)
        if panel == CRACKS:
            cracks(axes, state, appearance.font, width / seen.width)
        else:
            shown = COLOURED[panel]
            span = appearance.ranges.get(panel) or shown.range(state)
            filled = coloured(axes, state, panel, span, width / seen.width)
            if number == 0:  # no panel of cracks, which would show them
                supports(axes, state)
            colours = figure.add_axes(
                ((x + width + 0.25 * k) / page[0], y / page[1], 0.28 * k / page[0], height / page[1])
            )
            _bar(figure, colours, filled, appearance.font)
            axes.set_title(titled(shown, span, state), loc="right", fontsize=0.9 * appearance.font, pad=3.0)
        label = f"({'abcdefgh'[number]})" if len(panels) > 1 else ""
        axes.set_title(label, loc="left", fontsize=appearance.font, pad=3.0)
    if appearance.title is not None:
        text = units.stamped(appearance.title, state.step, state.time)
        figure.text(0.99, 0.995, text, fontsize=appearance.font, ha="right", va="top", parse_math=False)
    return figure


def panel(axes: Any, state: MeshState, seen: View, width: float, appearance: Appearance = USUAL) -> list[Any]:
    """Draw the cracks of a model in axes of a width [cm]; return the entries of a legend."""
    frame(axes, seen, appearance, first=True, last=True)
    return _cracks(axes, state, width / seen.width)


def frame(axes: Any, seen: View, appearance: Appearance, first: bool, last: bool) -> None:
    size, unit = seen.unit
    axes.set(xlim=(seen.left, seen.right), ylim=(seen.bottom, seen.top), aspect="equal")
    for axis, ticks, name, shown in zip((axes.xaxis, axes.yaxis), seen.ticks(), "xy", (last, first), strict=True):
        axis.set_ticks([v * size for v in ticks.major], labels=ticks.labels if shown else [])
        axis.set_ticks([v * size for v in ticks.minor], minor=True)
        axis.set_tick_params(labelsize=appearance.font, width=0.6, length=3.5)
        axis.set_tick_params(which="minor", width=0.5, length=1.8)
        if shown:
            axis.set_label_text(f"{name} ({unit})", fontsize=appearance.font)
    for spine in axes.spines.values():
        spine.set_linewidth(0.6)


# ---- cracks --------------------------------------------------------------------------------------------------------


def cracks(axes: Any, state: MeshState, font: float = 9.0, scale: float = 1.0) -> None:
    """Draw elements coloured by group, and joints that have yielded or broken. scale: cm on paper per metre."""
    handles = _cracks(axes, state, scale)
    if handles:
        axes.legend(
            handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False, fontsize=0.9 * font,
            borderaxespad=0.15, handlelength=1.2, columnspacing=1.0, handletextpad=0.4, labelspacing=0.25,
        )  # fmt: skip


def rock(axes: Any, state: MeshState, edges: str) -> None:
    """Draw elements coloured by group; edges: their colour, or "face"."""
    from matplotlib.collections import PolyCollection

    colour = _group_colours(state)
    for n in (3, 4):
        rows = np.flatnonzero((state.cells[:, 3] >= 0) == (n == 4))
        if len(rows):
            corners = state.points[state.cells[rows, :n]]
            axes.add_collection(
                PolyCollection(corners, facecolors=colour[rows], edgecolors=edges, linewidths=0.25, zorder=1),
                autolim=False,
            )


def _cracks(axes: Any, state: MeshState, scale: float) -> list[Any]:
    from matplotlib.lines import Line2D

    rock(axes, state, EDGE if len(state.cells) <= MOST_EDGES else "face")
    width = line_width(state, scale)
    at = state.points[state.joints]
    joint_state, mode = state.of_joints.get("state", np.empty(0)), state.of_joints.get("mode", np.empty(0))
    handles: list[Any] = []
    for rows, shade, part, word in _kinds(joint_state, mode):
        lines(axes, at[rows], shade, part * width)
        handles.insert(0, Line2D([], [], color=shade, linewidth=max(part * width, 0.9), label=word))
    return handles + supports(axes, state)


def supports(axes: Any, state: MeshState) -> list[Any]:
    """Draw bolts and liners; return the entries of a legend."""
    return bolts.draw(axes, state) + liners.draw(axes, state)


def _kinds(state: np.ndarray, mode: np.ndarray) -> list[tuple[np.ndarray, str, float, str]]:
    """Joints, colour, part of the line width, word of the legend, in the order of drawing; what is missing is
    omitted."""
    broken = state == BROKEN
    rows = [(np.flatnonzero(state == YIELDED), YIELD, 0.45, "yielded")]
    rows.append((np.flatnonzero((state == FREE) | (broken & (mode < 1.0))), OPEN, 0.7, "initial"))
    for low, high, shade, word in reversed(KINDS):
        rows.append((np.flatnonzero(broken & (low <= mode) & (mode < high)), shade, 1.0, word))
    return [row for row in rows if len(row[0])]


def _group_colours(state: MeshState) -> np.ndarray:
    """A colour per element: by the set of groups that distinguishes most of them."""
    colour = np.full(len(state.cells), GROUPS[0], object)
    sets = [name for name in state.of_elements if name.startswith("group_")]
    best = max(sets, key=lambda name: len(np.unique(state.of_elements[name])), default=None)
    if best is not None:
        for k, group in enumerate(np.unique(state.of_elements[best])):
            colour[state.of_elements[best] == group] = GROUPS[k % len(GROUPS)]
    return colour


def line_width(state: MeshState, scale: float) -> float:
    """Return a line width in points: a seventh of an edge on paper, within visible limits."""
    return float(np.clip(_edge(state) * scale * CM * 72.0 / 7.0, 0.5, 1.6))


def _edge(state: MeshState) -> float:
    """Typical length of an edge [m]."""
    if not len(state.cells):
        return 1.0
    a, b = state.points[state.cells[:, 0]], state.points[state.cells[:, 1]]
    return float(np.median(np.hypot(*(b - a).T)))


def lines(axes: Any, ends: np.ndarray, shade: str, width: float) -> None:
    from matplotlib.collections import LineCollection

    axes.add_collection(
        LineCollection(list(ends), colors=shade, linewidths=width, capstyle="round", zorder=3), autolim=False
    )


# ---- contours --------------------------------------------------------------------------------------------------------


CONTOURS = {
    STRESS: Contours(compression, stress_range, "Pa", "compressive stress", "YlOrBr"),
    PLASTIC: Contours(plastic_shear, plastic_range, "%", "plastic shear strain", "YlGn"),
    TEMPERATURE: Contours(temperature, temperature_range, "K", "temperature", "RdYlBu_r", of_corners=True),
}
COLOURED: dict[str, Contours | fluid.Shown] = {**CONTOURS, **fluid.PICTURES}
"""Panels with a colour bar."""


def coloured(axes: Any, state: MeshState, panel: str, span: tuple[float, float], scale: float) -> Any:
    """Draw one of the panels with colours over a range `span`; return the artist of the colour bar. scale: cm on paper
    per metre.
    """
    shown = COLOURED[panel]
    if isinstance(shown, Contours):
        return contours(axes, state, shown, span)
    rock(axes, state, "face")
    return fluid.draw(axes, state, shown, span, unit_of(shown, span, state)[0], 1.6 * line_width(state, scale))


def contours(axes: Any, state: MeshState, shown: Contours, span: tuple[float, float]) -> Any:
    """Draw contours with colours over a range `span`, and broken joints over them; return the artist of the
    colour bar.
    """
    from matplotlib.tri import Triangulation

    if not len(state.cells):
        return None
    unit, _ = unit_of(shown, span, state)
    levels = nice_levels(span[0] / unit, span[1] / unit)
    points, triangles, values = (cornered if shown.of_corners else smoothed)(state, shown.values(state))
    mesh = Triangulation(points[:, 0], points[:, 1], triangles)
    values, slack = values / unit, ROUNDING * (levels[1] - levels[0])
    inside = (values > levels[0] - slack) & (values < levels[-1] + slack)
    values = np.where(inside, np.clip(values, levels[0], levels[-1]), values)
    filled = axes.tricontourf(mesh, values, levels=levels, cmap=shown.colours, extend="both", zorder=1)
    joints = state.of_joints.get("state", np.empty(0))
    broken = (joints == BROKEN) | (joints == FREE)
    lines(axes, state.points[state.joints[broken]], INK, 0.5)
    return filled


def unit_of(shown: Contours | fluid.Shown, span: tuple[float, float], state: MeshState) -> tuple[float, str]:
    """Return size and name of a suitable unit for values of this range, in the units of the model."""
    return units.on_bar(*span, units.label(state.units, shown.unit))


def titled(shown: Contours | fluid.Shown, span: tuple[float, float], state: MeshState) -> str:
    """Return the title of a colour bar."""
    return f"{shown.title} ({unit_of(shown, span, state)[1] or '-'})"


def nice_levels(low: float, high: float) -> np.ndarray:
    """Return about LEVELS round levels that cover the range from low to high."""
    spread = max(high - low, 1e-9 * max(abs(low), abs(high)), 1e-12)
    power = 10.0 ** math.floor(math.log10(spread / LEVELS))
    step = next(s * power for s in (1.0, 2.0, 2.5, 5.0, 10.0) if spread / (s * power) <= LEVELS)
    first, last = math.floor(low / step + ROUNDING), math.ceil(high / step - ROUNDING)
    return step * np.arange(first, max(last, first + 1) + 1)


def cornered(state: MeshState, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return triangles for contours of values (n,) at the corners of elements."""
    quads = state.cells[state.cells[:, 3] >= 0]
    triangles = np.concatenate([state.cells[:, :3], quads[:, [0, 2, 3]]])
    a, b, c = (state.points[triangles[:, k]] for k in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return state.points, triangles[area != 0.0], np.nan_to_num(values)


def smoothed(state: MeshState, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points (n, 2) at which corners meet, triangles (m, 3), and nodal values: area-weighted means of the values
    (ne,) of the elements around each point.
    """
    cells, points = state.cells, state.points
    lowest, place = np.unique(spots(points, NEAR * _edge(state)), return_inverse=True)
    count = len(lowest)
    quads = cells[cells[:, 3] >= 0]
    triangles = np.concatenate([cells[:, :3], quads[:, [0, 2, 3]]])
    owner = np.concatenate([np.arange(len(cells)), np.flatnonzero(cells[:, 3] >= 0)])
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    value = np.nan_to_num(values)[owner]
    corner = place[triangles]
    weight = np.bincount(corner.reshape(-1), np.repeat(area, 3), count)
    total = np.bincount(corner.reshape(-1), np.repeat(area * value, 3), count)
    members = np.bincount(place, minlength=count)
    middle = np.column_stack([np.bincount(place, points[:, k], count) / members for k in range(2)])
    flat = (corner[:, 0] == corner[:, 1]) | (corner[:, 1] == corner[:, 2]) | (corner[:, 0] == corner[:, 2])
    return middle, corner[~flat & (area > 0.0)], total / np.where(weight > 0.0, weight, 1.0)


def _bar(figure: Any, axes: Any, filled: Any, font: float) -> None:
    if filled is None:
        axes.set_axis_off()
        return
    bar = figure.colorbar(filled, cax=axes)
    bar.ax.tick_params(labelsize=0.9 * font, width=0.5, length=2.5)
    bar.outline.set_linewidth(0.5)

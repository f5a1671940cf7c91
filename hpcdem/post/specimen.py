"""Figures of specimens: grading curve, packing, numbers of grains by size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from hpcdem.io.axes import View
from hpcdem.physics.polyarc.outlines import Outlines, sampled
from hpcdem.post import plots
from hpcdem.post.measure.figures import INK, key, label, page

STEP = 5.0
"""Largest angle [degrees] of the chords by which arcs are drawn."""
ANCHORS = "9c3708", "e0690f", "f2b53c", "a9c46c", "46a592", "3f7fb5", "6a6fc4"
"""Colours of the classes, coarse to fine; those between are interpolated."""
TARGET, ACHIEVED = "#404040", "#c8511b"
MOST_KEYS = 10
TALLEST = 20.0
"""Largest height of a packing [cm]."""
_SIEVES = 1.0, 2.0, 5.0


def class_colours(number: int) -> list[str]:
    """Colours of the given number of classes, coarse to fine."""
    rgb = np.array([[int(c[k : k + 2], 16) for k in (0, 2, 4)] for c in ANCHORS])
    at = np.linspace(0, len(rgb) - 1, max(number, 2))[:number]
    mixed = np.stack([np.interp(at, np.arange(len(rgb)), c) for c in rgb.T], 1).round().astype(int)
    return [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in mixed]


def grading_curve(
    sizes: np.ndarray,
    achieved: np.ndarray,
    target: np.ndarray | None = None,
    numbers: Sequence[tuple[str, float, float]] = (),
    falling: bool = False,
) -> Any:
    """Per cent finer over size [mm] on a log axis: `achieved` by areas, and the target where there is one, (m,) f8 with
    sizes falling. numbers: name, target and achieved value, written into the corner. falling: sizes fall to the right,
    as soil mechanics has it in some countries."""
    figure, (ax,) = page([8.0])
    ax.set_xscale("log")
    if target is not None:
        ax.plot(sizes, target, "-", color=TARGET, lw=3.0, alpha=0.35, solid_capstyle="round", zorder=2, label="target")
        ax.plot(sizes, target, "o", color=TARGET, ms=4.5, alpha=0.6, mew=0.0, zorder=2)
    ax.plot(sizes, achieved, "o-", color=ACHIEVED, lw=1.2, ms=4.0, mfc="white", mew=1.1, zorder=3,
            label="specimen, by area")  # fmt: skip
    low, high = float(sizes.min()), float(sizes.max())
    air = max((high / low) ** 0.06, 1.15)
    low, high = low / air, high * air
    ax.set_xlim((high, low) if falling else (low, high))
    ax.set_ylim(0.0, 104.0)
    ax.set_yticks(np.arange(0, 101, 20), minor=False)
    ax.set_yticks(np.arange(10, 101, 20), minor=True)
    places = _decades(low, high)
    ax.set_xticks(places, [f"{v:g}" for v in places])
    ax.set_xticks([v for v in _decades(low, high, range(1, 10)) if v not in places], minor=True)
    ax.xaxis.set_minor_formatter(_nothing())
    ax.grid(which="major", lw=0.5, color="#d0d0d0")
    ax.grid(which="minor", lw=0.3, color="#e6e6e6")
    ax.set_axisbelow(True)
    label(ax, "grain size (mm)", "finer by mass (%)")
    key(ax, loc="lower left" if falling else "upper left", frameon=True, framealpha=0.9, edgecolor="none")
    known = [row for row in numbers if any(map(math.isfinite, row[1:]))]
    if known:
        lines = ["        target  specimen"] if target is not None else []
        for name, wanted, got in known:
            first = f"{_short(wanted):>7}  " if target is not None else ""
            lines.append(f"{name:<6} {first}{_short(got):>8}")
        ax.text(0.02 if falling else 0.98, 0.04 if not falling else 0.96, "\n".join(lines), transform=ax.transAxes,
                ha="left" if falling else "right", va="top" if falling else "bottom", fontsize=plots.FONT - 1.5,
                family="monospace", bbox={"fc": "white", "ec": "none", "alpha": 0.9, "pad": 2.0})  # fmt: skip
    return figure


def _short(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "-"


def _nothing() -> Any:
    from matplotlib.ticker import NullFormatter

    return NullFormatter()


def _decades(low: float, high: float, times: Sequence[float] = _SIEVES) -> list[float]:
    """Round sizes from low to high."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    every = [float(f"{t}e{k}") for k in range(first, last + 1) for t in times]
    return [v for v in every if low <= v <= high]


def packing(
    outlines: Outlines,
    class_of: np.ndarray,
    sizes: np.ndarray,
    extent: tuple[float, float],
    box: tuple[float, float],
    title: str = "",
) -> Any:
    """True outlines [m], coloured by class (into sizes [mm], falling), in their room and with the box of the wanted
    void ratio (width, height [m]). A column that is much higher than wide is cut into pieces that stand side by side,
    the lowest on the left."""
    from matplotlib.patches import Rectangle

    width, height = max(extent[0], 1e-30), max(extent[1], box[1])
    usable = plots.PAGE_WIDTH - 1.75 - 3.2
    pieces = max(1, math.ceil(math.sqrt(height * usable / (width * TALLEST)) - 1e-9)) if height > 4.0 * width else 1
    high = height / pieces
    step = width * (1.12 if pieces > 1 else 1.0)
    across = step * (pieces - 1) + width
    tall = min(usable * high / across, TALLEST)
    right = plots.PAGE_WIDTH - 1.75 - tall * across / high
    figure, (ax,) = page([tall], right=right)
    _, _, bottom, top = outlines.boxes().T
    piece = np.clip((0.5 * (bottom + top) // high).astype(int), 0, pieces - 1)
    owner = outlines.owner
    size, unit = View(0.0, across, 0.0, high).unit
    moved = Outlines(
        outlines.start, outlines.x + (piece * step)[owner], outlines.y - (piece * high)[owner], outlines.theta
    )
    draw_grains(ax, moved, class_of, len(sizes), size)
    for q in range(pieces):
        top = min(height - q * high, high)
        ax.add_patch(Rectangle((q * step / size, 0.0), width / size, top / size, fill=False, ec="0.65", lw=0.5))
    if box[1] <= high * (1.0 + 1e-9) or pieces == 1:
        ax.add_patch(Rectangle((0.0, 0.0), box[0] / size, box[1] / size, fill=False, ec="black", lw=1.0))
    air = 0.01 * max(across, high) / size
    for spine in ax.spines.values():
        spine.set_visible(False)
    ax.set(xlim=(-air, across / size + air), ylim=(-air, high / size + air), aspect="equal")
    label(ax, f"x ({unit})", f"y ({unit})")
    if pieces > 1:
        ax.set_xticks([])
        label(ax, f"one column {width / size:.3g} {unit} wide, {height / size:.4g} {unit} high, in {pieces} pieces",
              f"y ({unit})")  # fmt: skip
    class_key(ax, sizes, np.bincount(class_of, minlength=len(sizes)))
    if title:
        ax.set_title(title, fontsize=plots.FONT, loc="left")
    return figure


def draw_grains(ax: Any, outlines: Outlines, class_of: np.ndarray, classes: int, unit: float = 1.0) -> None:
    """Outlines filled with the colours of their classes; lengths in this unit [m]."""
    from matplotlib.collections import PolyCollection

    corners = _corners(outlines)
    thin = 0.3 if len(corners) <= 3000 else 0.0
    for k, colour in enumerate(class_colours(classes)):
        some = [corners[i] / unit for i in np.flatnonzero(class_of == k)]
        ax.add_collection(PolyCollection(some, facecolors=colour, edgecolors=INK if thin else "none", lw=thin))


def _corners(outlines: Outlines) -> list[np.ndarray]:
    per_arc = max(1, math.ceil(math.degrees(float(outlines.theta.max(initial=0.0))) / STEP))
    points = sampled(outlines, per_arc)
    if outlines.arcs_each:
        return list(points)
    return np.split(points, outlines.start[1:-1] * per_arc)


def class_key(ax: Any, sizes: np.ndarray, counts: np.ndarray) -> None:
    """Colours, sizes [mm] and numbers of the classes to the right of the axes, at most MOST_KEYS of them."""
    from matplotlib.patches import Patch

    colours = class_colours(len(sizes))
    chosen = np.unique(np.linspace(0, len(sizes) - 1, min(len(sizes), MOST_KEYS)).round().astype(int))
    handles = [Patch(fc=colours[k], ec=INK, lw=0.3, label=f"{sizes[k]:.4g} ({counts[k]})") for k in chosen]
    ax.legend(handles=handles, title="size in mm (grains)", loc="upper left", bbox_to_anchor=(1.02, 1.0), frameon=False,
              fontsize=plots.FONT - 1.5, title_fontsize=plots.FONT - 1.0, handlelength=1.2, handleheight=1.0,
              borderaxespad=0.0)  # fmt: skip


def histogram(sizes: np.ndarray, counts: np.ndarray, exact: np.ndarray | None = None) -> Any:
    """Grains of each size [mm], log axis; a line where the unrounded number lies."""
    figure, (ax,) = page([6.0])
    order = np.argsort(sizes)
    at = np.arange(len(sizes))
    colours = [class_colours(len(sizes))[k] for k in order]
    least = 0.5 if exact is None else min(0.5, float(exact[exact > 0.0].min(initial=0.5)) * 0.7)
    ax.bar(at, np.maximum(counts[order], 0) - least * (counts[order] > 0), bottom=least, width=0.62, color=colours,
           ec=INK, lw=0.4, zorder=3)  # fmt: skip
    ax.set_yscale("log")
    ax.yaxis.set_major_formatter("{x:g}")
    ax.set_ylim(least, 2.5 * max(int(counts.max()), 1))
    for k, number in zip(at, counts[order]):
        ax.annotate(str(number), (k, max(number, least)), xytext=(0, 3), textcoords="offset points", ha="center",
                    fontsize=plots.FONT - 2.0, zorder=5)  # fmt: skip
    if exact is not None:
        ax.hlines(exact[order], at - 0.4, at + 0.4, color="black", lw=1.0, ls=(0, (3, 1.5)), zorder=4,
                  label="before rounding")  # fmt: skip
        key(ax, loc="upper right")
    every = max(1, math.ceil(len(sizes) / 16))
    ax.set_xticks(at[::every], [f"{v:.4g}" for v in sizes[order][::every]])
    ax.grid(axis="y", which="major", lw=0.4, color="#d8d8d8")
    ax.set_axisbelow(True)
    label(ax, "grain size (mm)", "grains")
    return figure

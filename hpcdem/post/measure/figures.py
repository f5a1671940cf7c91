"""The figures of the measurements: a page as wide as a printed one, panels below one another."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.units import scale
from hpcdem.io import colours
from hpcdem.io.axes import CM, View, view
from hpcdem.post import plots
from hpcdem.post.layers import Appearance
from hpcdem.post.measure import cracks
from hpcdem.post.measure.fault_history import History
from hpcdem.post.measure.grains import Grains
from hpcdem.post.measure.kinds import WEDGE_HEAD, Done, cracking, layer_series, paths, wedge_rows
from hpcdem.post.measure.kinds import drawn as last_drawn
from hpcdem.post.measure.scene import Plan, Stamp
from hpcdem.post.measure.walls import Curve
from hpcdem.post.saved import write

LEFT, RIGHT, TOP, BOTTOM, GAP = 1.75, 0.45, 0.55, 1.1, 0.45
"""Margins of a page and space between panels with a common x axis [cm]."""
PALE = 0.45
"""Fraction of its colour that a particle keeps under lines."""
RIGHTWARD, LEFTWARD, INK = "#b2182b", "#2166ac", "#202020"
LINES = ("#1b6ca8", "#c8511b", "#3a8a4d", "#7a4fa3", "#8a6d1f", "#c2378a", "#4d4d4d", "#16a0a0")
MOST_PROFILES = 14


# --- pages -----------------------------------------------------------------------------------------------------


def page(heights: Sequence[float], gaps: Sequence[float] | None = None, right: float = RIGHT) -> tuple[Any, list[Any]]:
    """A figure with panels of these heights from top to bottom, and its axes. gaps: below each but the last [cm]."""
    from matplotlib.figure import Figure

    gaps = [GAP] * (len(heights) - 1) if gaps is None else gaps
    width, height = plots.PAGE_WIDTH, TOP + sum(heights) + sum(gaps) + BOTTOM
    figure = Figure(figsize=(width * CM, height * CM))
    axes, y = [], height - TOP
    for high, gap in zip(heights, [*gaps, 0.0]):
        y -= high
        ax = figure.add_axes((LEFT / width, y / height, (width - LEFT - right) / width, high / height))
        ax.tick_params(labelsize=plots.FONT - 1.0, width=0.6, length=3.0)
        for spine in ax.spines.values():
            spine.set_linewidth(0.6)
        axes.append(ax)
        y -= gap
    return figure, axes


def save(figure: Any, path: Path, dpi: float = 300.0) -> Path:
    """Write a figure, the same bytes every time; the kind by the suffix."""
    return write(lambda: figure, path, dpi)


def length_unit(extent: float) -> tuple[float, str]:
    """Unit of lengths on an axis of this extent [m]."""
    return View(0.0, max(extent, 1e-9), 0.0, 0.0).unit


def section_view(g: Grains, air: float = 0.1) -> View:
    """Return a view of all particles with the usual margin, without the height of the walls above the bed."""
    seen = view(g.drawn())
    high = float(np.max(g.y + g.r))
    low = float(np.min(g.y - g.r))
    bottom = max(seen.bottom, low - 0.15 * (high - low))
    return View(seen.left, seen.right, bottom, high + max(air * (high - low), 0.02 * seen.width))


def section_height(seen: View, right: float = RIGHT) -> float:
    """Height [cm] of a section as wide as the page."""
    return min((plots.PAGE_WIDTH - LEFT - right) * seen.height / seen.width, 16.0)


def draw_section(ax: Any, g: Grains, seen: View, palette: np.ndarray = colours.RGB, walls: int = 5) -> None:
    """Particles and walls (of this colour), axes in km."""
    plots.draw_frame(g.drawn(walls), ax, seen, plots.MODEL, plots.Style(appearance=Appearance(palette)))
    ax.tick_params(labelsize=plots.FONT - 1.0)


def pale() -> np.ndarray:
    """The colours as they are under lines."""
    return 1.0 - PALE * (1.0 - colours.RGB)


def label(ax: Any, x: str | None, y: str) -> None:
    """Names of the axes; without numbers below where another panel has them."""
    ax.set_ylabel(y, fontsize=plots.FONT)
    if x is None:
        ax.tick_params(labelbottom=False)
    else:
        ax.set_xlabel(x, fontsize=plots.FONT)


def key(ax: Any, columns: int = 1, **more: Any) -> None:
    """Add a legend of the lines."""
    options = {"loc": "best", "frameon": False, "handlelength": 1.6, "columnspacing": 1.2} | more
    ax.legend(fontsize=plots.FONT - 1.5, ncol=columns, **options)


def when(stamps: Sequence[Stamp], steps: bool = False) -> tuple[np.ndarray, str]:
    """Places on the axis of time and its name: shortening (or extension) where a wall moves, else (or on request)
    thousands of steps."""
    shortened = np.array([s.shortening for s in stamps])
    if not steps and np.isfinite(shortened).all() and np.ptp(shortened) > 0.0:
        size, unit = length_unit(float(np.abs(shortened).max()))
        opened = -float(shortened.min()) > float(shortened.max())
        return (-shortened if opened else shortened) / size, f"{'extension' if opened else 'shortening'} ({unit})"
    return np.array([s.step for s in stamps]) / 1000.0, "thousand steps"


# --- one figure per measurement --------------------------------------------------------------------------------


def surface(done: Done, plan: Plan, final: Grains) -> Any:
    """Profiles over one another, the first at the bottom; at most MOST_PROFILES of them."""
    from matplotlib import colormaps

    some = [(stamp, part) for stamp, part in done if part]
    chosen = [some[k] for k in _spread([stamp for stamp, _ in some])]
    left, right = (f(f(xs) for _, (xs, _) in chosen) for f in (min, max))
    relief = max(float(np.ptp(ys)) for _, (_, ys) in chosen) or 1.0
    size, unit = length_unit(right - left)
    lift = 0.6 * relief
    figure, (ax,) = page([min(3.0 + 1.1 * len(chosen), 17.0)], right=3.0)
    low = min(float(ys.min()) for _, (_, ys) in chosen)
    for k, (stamp, (xs, ys)) in enumerate(chosen):
        shade = colormaps["viridis"](0.05 + 0.8 * k / max(len(chosen) - 1, 1))
        raised = (ys - low + lift * k) / size
        order = 2 * (len(chosen) - k)
        ax.fill_between(xs / size, lift * k / size, raised, color="white", zorder=order, lw=0.0)
        ax.fill_between(xs / size, lift * k / size, raised, color=shade, alpha=0.18, zorder=order, lw=0.0)
        ax.plot(xs / size, raised, color=shade, lw=1.1, zorder=order + 1)
        shortened = "" if not np.isfinite(stamp.shortening) else f", {abs(stamp.shortening) / size:.3g} {unit}"
        ax.annotate(f"{stamp.label}{shortened}", (1.01, raised[-1]), xycoords=("axes fraction", "data"),
                    fontsize=plots.FONT - 2.0, color=shade, va="center", annotation_clip=False)  # fmt: skip
    ax.set_xlim(left / size, right / size)
    highest = max(float(ys.max()) - low + lift * k for k, (_, (_, ys)) in enumerate(chosen))
    ax.set_ylim(-0.08 * relief / size, (highest + 0.4 * relief) / size)
    bar = next(v for v in (5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.0) if v * 1.5 <= relief / size)
    if bar:
        at = (ax.get_ylim()[1] - bar - 0.05 * relief / size), ax.get_ylim()[1] - 0.05 * relief / size
        x = left / size + 0.97 * (right - left) / size
        ax.plot([x, x], at, color=INK, lw=1.5, solid_capstyle="butt", zorder=999)
        ax.text(x - 0.008 * (right - left) / size, sum(at) / 2.0, f"{bar:g} {unit}", fontsize=plots.FONT - 1.0,
                ha="right", va="center")  # fmt: skip
    stretch = ((ax.get_xlim()[1] - ax.get_xlim()[0]) / (plots.PAGE_WIDTH - LEFT - 3.0)) / (
        (ax.get_ylim()[1] - ax.get_ylim()[0]) / min(3.0 + 1.1 * len(chosen), 17.0)
    )
    ax.text(0.01, 0.985, f"heights {stretch:.2g} times", transform=ax.transAxes, fontsize=plots.FONT - 1.0, va="top")
    ax.set_yticks([])
    label(ax, f"x ({unit})", "surface height, profiles raised by time")
    return figure


def _spread(stamps: Sequence[Stamp]) -> list[int]:
    """Choose at most MOST_PROFILES frames, evenly over shortening where a wall pushes, else over the frames."""
    at, _ = when(stamps)
    if np.isnan(at).any() or np.ptp(at) == 0.0:
        at = np.arange(len(stamps), dtype=float)
    wanted = np.linspace(at[0], at[-1], min(len(stamps), MOST_PROFILES))
    # Of frames at one place the last.
    nearest = [len(at) - 1 - int(np.argmin(np.abs(at[::-1] - w))) for w in wanted]
    return sorted({0, *nearest[1:]})


def wedge(done: Done, plan: Plan, final: Grains) -> Any:
    """Height and width, slopes and taper over shortening."""
    rows = {name: column for name, column in zip(WEDGE_HEAD, wedge_rows(done, plan).T)}
    at, axis = when([stamp for stamp, _ in done])
    figure, (a, b, c) = page([4.2, 4.2, 4.2])
    for ax, name, shade in ((a, "height[m]", LINES[0]), (b, "width[m]", LINES[1])):
        size, unit = length_unit(float(np.nanmax(np.abs(rows[name]), initial=1.0)))
        ax.plot(at, rows[name] / size, "o-", ms=3.0, lw=1.0, color=shade)
        label(ax, None, f"{name.split('[')[0]} ({unit})")
    c.plot(at, rows["taper[deg]"], lw=3.5, color="#d8cfa8", label="taper α + β")
    for name, text, shade in (("surface", "surface slope α", LINES[2]), ("base", "base slope β", LINES[3])):
        c.plot(at, rows[f"{name}_slope[deg]"], "o-", ms=3.0, lw=1.0, color=shade, label=text)
    label(c, axis, "slope (°)")
    key(c, 3)
    for ax in (a, b, c):
        ax.set_xlim(*_with_air(at))
        ax.set_ylim(*_with_air(np.concatenate([line.get_ydata() for line in ax.lines]), 0.0))
        ax.grid(lw=0.3, color="#d0d0d0")
    return figure


def _with_air(values: np.ndarray, include: float | None = None) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    if include is not None:
        known = np.append(known, include)
    low, high = (float(np.min(known)), float(np.max(known))) if len(known) else (0.0, 1.0)
    air = 0.04 * (high - low) or 0.5
    return (low if low == include else low - air), (high if high == include else high + 2.0 * air)


def faults(done: Done, plan: Plan, final: Grains) -> Any:
    """Bands over the last section that has some; below, where the bands of all frames are."""
    drawn: Any = last_drawn([part for _, part in done])
    g = drawn.grains
    seen = section_view(g)
    figure, (ax, below) = page([section_height(seen), 5.5], [1.3])
    draw_section(ax, g, seen, pale())
    _paint(ax, drawn)
    for k, band in enumerate(drawn.bands, 1):
        (x1, y1), (x2, y2) = band.ends
        ax.plot([x1, x2], [y1, y2], color="black", lw=1.2, solid_capstyle="round")
        end = max(band.ends, key=lambda p: p[1])
        ax.annotate(str(k), end, xytext=(0, 2), textcoords="offset points", fontsize=plots.FONT - 2.0, ha="center",
                    va="bottom")  # fmt: skip
    size, unit = seen.unit
    stamps = [stamp for stamp, _ in done]
    at, axis = when(stamps)
    longest = max((b.length for _, part in done if part for b in part.bands), default=1.0)
    for vergence, shade, text in ((1, RIGHTWARD, "top to the right"), (-1, LEFTWARD, "top to the left")):
        points = [
            (b.centre[0] / size, t, 60.0 * b.length / longest)
            for t, (_, part) in zip(at, done) if part
            for b in part.bands if b.vergence == vergence
        ]  # fmt: skip
        px, pt, area = np.array(points).reshape(-1, 3).T
        below.scatter(px, pt, s=area, color=shade, alpha=0.75, lw=0.0, label=text)
    below.set_xlim(seen.left / size, seen.right / size)
    below.set_ylim(*_with_air(at))
    below.set_ylabel(axis, fontsize=plots.FONT)
    below.set_xlabel(f"centre of the band, x ({unit}); size: length", fontsize=plots.FONT)
    below.grid(lw=0.3, color="#d0d0d0")
    key(below, 2, loc="upper right", frameon=True, framealpha=0.8, edgecolor="none")
    since = "the first section" if drawn.total else "the frame before"
    text = f"step {g.step}: |strain since {since}| > {drawn.threshold:g}"
    ax.text(1.0, 1.015, text, transform=ax.transAxes, ha="right", va="bottom", fontsize=plots.FONT - 1.0)
    return figure


def faults_over_time(stamps: Sequence[Stamp], found: History, final: Grains) -> Any:
    """Faults over the last section; slip of each over shortening, thick while it is active; when each is active. Those
    with most slip, one for each of LINES, are coloured and numbered, the others grey."""
    from matplotlib import patheffects

    seen = section_view(final)
    steps = [stamp.step for stamp in stamps]
    count = len(found.faults)
    figure, (ax, slips, bars) = page([section_height(seen), 6.0, min(max(0.34 * count, 1.2), 7.0)], [1.3, GAP])
    draw_section(ax, final, seen, pale())
    at, axis = when(stamps)
    lines = {f.number: found.curve(f) for f in found.faults}
    most = sorted(lines, key=lambda n: (-float(lines[n][1].max()), n))[: len(LINES)]
    shades = dict(zip(sorted(most), LINES))
    size, unit = length_unit(max((float(slip.max()) for _, slip in lines.values()), default=1.0))
    for f in sorted(found.faults, key=lambda f: (f.number in shades, f.number)):
        shade, named = shades.get(f.number, "#b0b0b0"), f.number in shades
        frames, slip = lines[f.number]
        active = np.array([found.active(f, max(k, f.born), steps) for k in frames])
        x, y = at[frames], slip / size
        slips.plot(x, y, color=shade, lw=0.7)
        slips.plot(x, np.where(active, y, np.nan), color=shade, lw=2.0, solid_capstyle="round")
        if f.merged is not None:
            slips.plot(x[-1], y[-1], "x", color=shade, ms=4.0, mew=1.0)
        bars.plot(x[[0, -1]], [f.number] * 2, color=shade, lw=0.5)
        bars.plot(x, np.where(active, float(f.number), np.nan), color=shade, lw=2.6, solid_capstyle="butt")
        last = found.profiles[f.number][int(frames[-1])]
        if frames[-1] < len(stamps) - 1:
            continue
        edge = [patheffects.Stroke(linewidth=3.0, foreground="white"), patheffects.Normal()]
        ax.plot(last.x, last.y, color=shade if named else "#606060", lw=(1.9 if active[-1] else 1.1) if named else 0.6,
                path_effects=edge if named else None, zorder=4.0 + named)  # fmt: skip
        if named:
            top = int(np.nanargmax(last.y))
            ax.annotate(str(f.number), (last.x[top], last.y[top]), xytext=(0, 2), textcoords="offset points",
                        fontsize=plots.FONT - 2.0, ha="center", va="bottom", color=shade, zorder=6.0,
                        path_effects=edge)  # fmt: skip
    slips.set_xlim(*_with_air(at))
    bars.set_xlim(*slips.get_xlim())
    slips.set_ylim(*_with_air(np.concatenate([slip / size for _, slip in lines.values()] or [np.ones(1)]), 0.0))
    ends = [float(lines[n][1][-1]) / size for n in shades]
    gap = 0.045 * float(slips.get_ylim()[1])
    for place, n in zip(_apart(ends, gap), shades):
        right = at[lines[n][0][-1]]
        slips.annotate(str(n), (right, place), (3, 0), textcoords="offset points", color=shades[n],
                       fontsize=plots.FONT - 2.0, va="center", annotation_clip=False)  # fmt: skip
    bars.set_ylim(count + 0.7, 0.3)
    bars.set_yticks(range(1, count + 1, 1 if count <= 12 else 5))
    label(slips, None, f"slip ({unit})")
    label(bars, axis, "fault")
    for panel in (slips, bars):
        panel.grid(lw=0.3, color="#d0d0d0")
    text = f"step {final.step}: {count} fault{'s' if count != 1 else ''}; thick lines: active"
    ax.text(1.0, 1.015, text, transform=ax.transAxes, ha="right", va="bottom", fontsize=plots.FONT - 1.0)
    return figure


def _apart(places: Sequence[float], gap: float) -> list[float]:
    """Places moved up such that they lie at least `gap` apart, in the order given."""
    moved, lowest = [0.0] * len(places), -np.inf
    for k in sorted(range(len(places)), key=lambda k: (places[k], k)):
        moved[k] = lowest = max(places[k], lowest + gap)
    return moved


def _paint(ax: Any, part: Any) -> None:
    """Cells above the threshold: red where the top has moved to the right, blue to the left."""
    strain = np.nan_to_num(part.strain)
    strength = np.clip(np.abs(strain) / (2.0 * part.threshold), 0.0, 1.0)
    picture = np.zeros((*strain.shape, 4))
    for sign, shade in ((1.0, RIGHTWARD), (-1.0, LEFTWARD)):
        picture[strain * sign > 0.0, :3] = [int(shade[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    picture[..., 3] = np.where(np.abs(strain) > part.threshold, 0.35 + 0.5 * strength, 0.0)
    cell = float(part.x[1] - part.x[0]) if len(part.x) > 1 else 1.0
    extent = part.x[0] - cell / 2.0, part.x[-1] + cell / 2.0, part.y[0] - cell / 2.0, part.y[-1] + cell / 2.0
    limits = ax.get_xlim(), ax.get_ylim()
    ax.imshow(picture, origin="lower", extent=extent, interpolation="nearest", aspect="equal", zorder=2.5)
    ax.set(xlim=limits[0], ylim=limits[1])


def wallforce(curves: dict[int, Curve], pusher: Curve | None, name: str) -> Any:
    """Forces on the walls and work done by them over the path of the pushing wall `name`; over time without one."""
    figure, axes = page([4.6, 4.6, 4.6])
    forces = max((float(np.nanmax(np.abs(c.force), initial=0.0)) for c in curves.values()), default=0.0)
    work = max((float(np.nanmax(np.abs(c.work), initial=0.0)) for c in curves.values()), default=0.0)
    (newton, force_unit), (joule, work_unit) = scale(max(forces, 1e6), "N"), scale(max(work, 1e6), "J")
    displacements = {} if pusher is None else dict(zip(pusher.step.tolist(), pusher.path_length.tolist()))
    size, unit = length_unit(max(displacements.values(), default=1.0))
    for k, (wall, curve) in enumerate(sorted(curves.items())):
        at = (
            np.array([displacements.get(s, np.nan) for s in curve.step.tolist()]) / size
            if displacements
            else curve.time
        )
        shade = LINES[k % len(LINES)]
        for ax, values in zip(axes, (curve.force[:, 0] / newton, curve.force[:, 1] / newton, curve.work / joule)):
            ax.plot(at, values, lw=0.9, color=shade, label=f"wall {wall}")
    axis = f"displacement of {name} ({unit})" if displacements else "time (s)"
    label(axes[0], None, f"$F_x$ on the wall ({force_unit})")
    label(axes[1], None, f"$F_y$ on the wall ({force_unit})")
    label(axes[2], axis, f"work of the wall ({work_unit})")
    for ax in axes:
        ax.axhline(0.0, color="#808080", lw=0.5, zorder=0)
        ax.grid(lw=0.3, color="#d0d0d0")
        ax.margins(x=0.01)
    key(axes[0], 4)
    return figure


def tracks(done: Done, plan: Plan, final: Grains) -> Any:
    """Paths over the last section, in colours of their time."""
    from matplotlib import colormaps
    from matplotlib.collections import LineCollection

    found = paths(done)
    seen = section_view(final)
    every = np.concatenate([path[:, 1:] for path in found.values()])
    air = 0.02 * seen.width
    # Paths may begin where nothing is any more.
    top = min(float(every[:, 1].max()), seen.top + 0.5 * seen.height) + air
    sides = min(seen.left, float(every[:, 0].min()) - air), max(seen.right, float(every[:, 0].max()) + air)
    seen = View(*sides, seen.bottom, max(seen.top, top))
    figure, (ax, bar) = page([section_height(seen), 0.25], [1.35])
    draw_section(ax, final, seen, pale())
    at, axis = when([stamp for stamp, _ in done])
    low, high = float(np.min(at)), max(float(np.max(at)), float(np.min(at)) + 1e-9)
    lines: Any = np.array([s for p in found.values() for s in np.stack([p[:-1, 1:], p[1:, 1:]], axis=1)]).reshape(
        -1, 2, 2
    )
    middle = np.array([m for p in found.values() for m in (at[p[:-1, 0].astype(int)] + at[p[1:, 0].astype(int)]) / 2.0])
    thin = 1.4 if len(found) <= 60 else 0.5
    ax.add_collection(LineCollection(lines, colors="white", linewidths=thin + 1.0, zorder=3), autolim=False)
    shades = colormaps["plasma"]((middle - low) / (high - low))
    ax.add_collection(LineCollection(lines, colors=shades, linewidths=thin, zorder=4), autolim=False)
    if len(found) <= 200:
        begin = np.array([p[0, 1:] for p in found.values()])
        end = np.array([p[-1, 1:] for p in found.values()])
        ax.plot(*begin.T, "o", ms=3.0, mfc="white", mec=INK, mew=0.6, zorder=5, label="first")
        ax.plot(*end.T, "o", ms=3.0, mfc=INK, mec=INK, mew=0.6, zorder=6, label="last")
        key(ax, 2, loc="upper right", frameon=True, framealpha=0.8, edgecolor="none")
    bar.imshow(np.linspace(0.0, 1.0, 256)[None, :], aspect="auto", cmap="plasma", extent=(low, high, 0.0, 1.0))
    bar.set_yticks([])
    bar.set_xlabel(axis, fontsize=plots.FONT)
    return figure


def layers(done: Done, plan: Plan, final: Grains) -> Any:
    """Changes of the areas of colours and groups over the steps."""
    from matplotlib import patheffects

    found = layer_series(done)
    at, axis = when([stamp for stamp, _ in done], steps=True)
    kinds = [kind for kind in ("color", "group") if any(layer.kind == kind for layer in found)]
    figure, axes = page([5.0] * (1 + len(kinds)), [GAP] * len(kinds), right=2.6)
    size = 1e6 if max(float(layer.envelope.max(initial=0.0)) for layer in found) >= 1e5 else 1.0
    unit = "km²" if size > 1.0 else "m²"
    below = axes[0]
    for layer in found:
        if layer.kind == "all":
            below.plot(at, layer.envelope / size, lw=1.4, color=INK, label="section")
            below.plot(at, layer.discs / size, lw=1.0, ls="--", color=INK, label="particles")
    label(below, None, f"area ({unit})")
    key(below, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    for ax, kind in zip(axes[1:], kinds):
        mine = [layer for layer in found if layer.kind == kind]
        for k, layer in enumerate(mine):
            shade = colours.RGB[int(layer.name) % len(colours.RGB)] if kind == "color" else LINES[k % len(LINES)]
            effects = [patheffects.Stroke(linewidth=2.6, foreground="#404040"), patheffects.Normal()]
            name = plan.request.color(layer.name) if kind == "color" else layer.name
            ax.plot(at, 100.0 * layer.change(layer.envelope), lw=1.6, color=shade, label=name,
                    path_effects=effects if kind == "color" else None)  # fmt: skip
            ax.plot(at, 100.0 * layer.change(layer.discs), lw=0.9, ls=(0, (4, 2)), color="#404040" if kind == "color"
                    else shade)  # fmt: skip
        ax.axhline(0.0, color="#808080", lw=0.5, zorder=0)
        key(ax, loc="upper left", bbox_to_anchor=(1.0, 1.0), title={"color": "colour", "group": "group"}[kind])
        label(ax, None, "change of area (%)")
    axes[-1].tick_params(labelbottom=True)
    axes[-1].set_xlabel(f"{axis}; solid: with pores, dashed: particles", fontsize=plots.FONT)
    for ax in axes:
        ax.set_xlim(*_with_air(at))
        ax.grid(lw=0.3, color="#d0d0d0")
    return figure


DAMAGE = ("#f2f0e6", "#fdd49e", "#fc8d59", "#d7301f", "#5a0000")


def damage(done: Done, plan: Plan, final: Grains, log: np.ndarray | None = None) -> Any:
    """Broken bonds and damaged particles over the steps; damage of the particles at the end."""
    from matplotlib.colors import LinearSegmentedColormap

    c = cracking(done)
    at, axis = when([stamp for stamp, _ in done], steps=True)
    seen = section_view(final)
    figure, (a, b, ax) = page([4.6, 4.0, section_height(seen)], [GAP, 1.3])
    a.plot(at, c.broken, "o-", ms=2.5, lw=1.2, color=INK, label="broken")
    a.plot(at, c.parted, lw=1.0, color=RIGHTWARD, label="of these, open")
    a.plot(at, c.broken - c.parted, lw=1.0, color=LEFTWARD, label="still touching")
    if c.lost[-1]:
        a.plot(at, c.lost, lw=1.0, ls=":", color="#606060", label="lost with deleted particles")
    if log is not None:
        a.plot(log[:, 0] / 1000.0, log[:, 1], "--", lw=0.9, color=RIGHTWARD, label="in tension (log)")
        a.plot(log[:, 0] / 1000.0, log[:, 2], "--", lw=0.9, color=LEFTWARD, label="in shear (log)")
    label(a, None, "bonds")
    key(a, loc="upper left")
    for level, values, shade in zip(cracks.LEVELS, c.beyond.T, LINES):
        b.plot(at, 100.0 * values, lw=1.2, color=shade, label=f"damage ≥ {level:g}")
    b.plot(at, 100.0 * c.broken / np.maximum(c.made, 1), lw=1.0, ls="--", color=INK, label="bonds broken")
    label(b, axis, "share (%)")
    key(b, loc="upper left")
    for panel in (a, b):
        panel.set_xlim(*_with_air(at))
        panel.set_ylim(bottom=0.0)
        panel.grid(lw=0.3, color="#d0d0d0")
    had, _, share = c.damage.of(final.gid)
    shades = LinearSegmentedColormap.from_list("damage", DAMAGE)(np.linspace(0.0, 1.0, 8))[:, :3]
    palette = np.concatenate([shades, [[0.72, 0.76, 0.8], [0.1, 0.1, 0.1]]])
    kind = np.where(had > 0, np.minimum(8.0 * np.nan_to_num(share), 7.0), 8).astype(np.int64)
    g = Grains(final.step, final.gid, final.x, final.y, final.r, kind, final.group, final.walls)
    draw_section(ax, g, seen, palette, 9)
    bar = ax.inset_axes((0.66, 0.86, 0.3, 0.035))
    bar.imshow(np.linspace(0.0, 1.0, 8)[None, :], aspect="auto", extent=(0.0, 1.0, 0.0, 1.0),
               cmap=LinearSegmentedColormap.from_list("damage", shades, 8))  # fmt: skip
    bar.set(yticks=[], xticks=[0.0, 0.5, 1.0])
    bar.tick_params(labelsize=plots.FONT - 2.0, length=2.0, width=0.5, pad=1.5)
    bar.set_title("share of bonds broken; grey: never bonded", fontsize=plots.FONT - 2.0, pad=2.0)
    return figure

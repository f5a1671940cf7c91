"""The figures of cracks, fragments, fluid and emission of blocks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hpcdem.core.units import scale
from hpcdem.io.vtkhdf_mesh import MeshState
from hpcdem.post import blocks, plots
from hpcdem.post.measure import bodies, emission
from hpcdem.post.measure.blocks import Emission, Part, orientation
from hpcdem.post.measure.emission import Events
from hpcdem.post.measure.figures import BOTTOM, GAP, INK, LEFT, LINES, RIGHT, TOP, key, label, length_unit, page

MODE_COLOURS = blocks.TENSION, blocks.MIXED, blocks.SHEAR
GREY, PALE = "#808080", "#e4e1d8"
MAP_HEIGHT = 9.5
"""Largest height of maps [cm]."""
LOWER_GAP = 1.45
"""Gap above panels whose axis differs from that of the panels above them [cm]."""
LEGEND = 0.6
"""Height of a line of a legend above the maps [cm]."""
SOME_FRAMES = 5
"""Largest number of size distributions in a figure."""
FRAGMENT_COLOURS = (
    "#7fa6c9", "#e8b27d", "#9cc49a", "#c9a0c4", "#d8cf7f", "#8fc4c0", "#dd9a96", "#b3b7d9", "#c4a98a", "#a8c97f",
)  # fmt: skip


def times(values: np.ndarray, timed: bool) -> tuple[np.ndarray, str]:
    """Return values on the time axis and its label, µs to years; steps if the time is constant."""
    if not timed:
        return values / 1000.0, "thousand steps"
    largest = float(np.abs(values).max(initial=0.0))
    size, unit = scale(largest, "s")
    return values / size, f"time ({unit})"


def when(parts: Sequence[Part]) -> tuple[np.ndarray, str]:
    """Positions of frames on the axis of time, and its name."""
    time = np.array([one.time for one in parts])
    timed = bool(np.ptp(time) > 0.0)
    return times(time if timed else np.array([float(one.step) for one in parts]), timed)


def _plain(axes: Any) -> None:
    axes.grid(lw=0.3, color="#d0d0d0")
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=plots.FONT - 1.0, width=0.6, length=3.0)
    for spine in axes.spines.values():
        spine.set_linewidth(0.6)


def _marks(n: int) -> str:
    return "o-" if n <= 40 else "-"


def _letters(axes: Sequence[Any]) -> None:
    for letter, ax in zip("abcdefgh", axes):
        ax.text(0.0, 1.015, f"({letter})", transform=ax.transAxes, fontsize=plots.FONT - 1.0, va="bottom")


class _Maps:
    """Room for some maps of a model, side by side below the panels of a page, with a legend over them. above: heights
    of the panels, gaps: below them [cm]. scale: cm on paper per metre."""

    def __init__(
        self, state: MeshState, above: Sequence[float], gaps: Sequence[float], number: int, bar: float = 1.7,
        right: float = RIGHT,
    ) -> None:  # fmt: skip
        seen = blocks.view(state)
        panel_width = (plots.PAGE_WIDTH - LEFT - bar - RIGHT - (number - 1) * GAP) / number
        self.width = min(panel_width, MAP_HEIGHT * seen.width / seen.height)
        self.height = self.width * seen.height / seen.width
        self.scale, self.seen = self.width / seen.width, seen
        self.figure, axes = page([*above, self.height], gaps, right)
        self.panels, below = axes[:-1], axes[-1]
        below.remove()
        total = TOP + sum(above) + sum(gaps) + self.height + BOTTOM
        self._page = plots.PAGE_WIDTH, total
        used = number * self.width + (number - 1) * GAP + bar
        left = LEFT + max(0.0, 0.5 * (plots.PAGE_WIDTH - LEFT - RIGHT - used))
        self.maps = [self._axes(left + k * (self.width + GAP), self.width) for k in range(number)]
        for k, ax in enumerate(self.maps):
            blocks.frame(ax, seen, blocks.Appearance(font=plots.FONT), first=k == 0, last=True)
        self._right = left + number * self.width + (number - 1) * GAP

    def _axes(self, x: float, width: float, part: float = 1.0) -> Any:
        w, h = self._page
        return self.figure.add_axes((x / w, BOTTOM / h, width / w, part * self.height / h))

    def legend(self, handles: Sequence[Any]) -> None:
        """Draw a line over the maps; the first one has its legend."""
        w, h = self._page
        place = self.maps[0].get_position().x0, (BOTTOM + self.height + 0.45) / h
        self.figure.legend(
            handles=handles, loc="lower left", bbox_to_anchor=place, ncols=6, frameon=False,
            fontsize=plots.FONT - 1.5, handlelength=1.2, columnspacing=1.0, handletextpad=0.4, borderaxespad=0.0,
        )  # fmt: skip

    def bar(self) -> Any:
        """Axes for colours, right of the last map."""
        return self._axes(self._right + 0.3, 0.3)


def _elements(axes: Any, state: MeshState, colour: Any = PALE, edges: Any = "face") -> None:
    """Draw all elements, in one colour or (ne,) colours."""
    from matplotlib.collections import PolyCollection

    for n in (3, 4):
        rows = np.flatnonzero((state.cells[:, 3] >= 0) == (n == 4))
        if len(rows):
            face = colour if isinstance(colour, str) else colour[rows]
            axes.add_collection(
                PolyCollection(state.points[state.cells[rows, :n]], facecolors=face, edgecolors=edges, linewidths=0.2),
                autolim=False,
            )


# --- cracks ------------------------------------------------------------------------------------------------------


def cracks(parts: Sequence[Part], state: MeshState, events: Events | None) -> Any:
    """Draw broken joints by mode (from the events, if available, which are finer than the frames) and damage over time;
    below, the broken joints of the last frame by mode and by time.
    """
    timed = "break_time" in state.of_joints and bool((state.of_joints["state"] == blocks.BROKEN).any())
    sheet = _Maps(state, [4.6, 3.6], [GAP, LOWER_GAP + LEGEND], 2 if timed else 1)
    _crack_curves(sheet.panels, parts, events, "length")
    sheet.legend(blocks.panel(sheet.maps[0], state, sheet.seen, sheet.width, blocks.Appearance(font=plots.FONT)))
    if timed:
        _by_time(sheet, state)
    _letters([*sheet.panels, *sheet.maps])
    return sheet.figure


def _crack_curves(panels: Sequence[Any], parts: Sequence[Part], events: Events | None, size: str) -> None:
    """Broken joints by mode, and damage over time; size: what is measured of joints."""
    known = [one.cracks for one in parts if one.cracks is not None]
    a, b = panels
    at, axis = when(parts)
    if events is None or not len(events):
        ends, counts = at, np.array([c.broken for c in known])
    else:
        stamps = np.array([one.time if "time" in axis else one.step for one in parts], float)
        factor = float(at[-1] / stamps[-1]) if stamps[-1] else 1.0
        moment = (events.time if "time" in axis else events.step) * factor
        counts = np.cumsum(events.kinds()[:, None] == np.arange(len(emission.MODES)), axis=0)
        ends = np.concatenate([[min(at[0], moment[0])], moment, [max(at[-1], moment[-1])]])
        counts = np.concatenate([np.zeros((1, len(emission.MODES)), int), counts, counts[-1:]])
    a.stackplot(ends, counts.T, colors=MODE_COLOURS, labels=emission.MODES, lw=0.0, alpha=0.85, step="post")
    a.step(ends, counts.sum(axis=1), where="post", lw=1.0, color=INK, label="all")
    label(a, None, "broken joints")
    key(a, loc="upper left")
    damage = np.array([c.damage for c in known])
    length = np.array([c.broken_size.sum() for c in known])
    total = np.array([c.size for c in known])
    b.plot(at, 100.0 * damage, _marks(len(at)), ms=2.5, lw=1.2, color=LINES[0], label="damage index")
    b.plot(at, 100.0 * length / np.where(total > 0.0, total, 1.0), "--", lw=1.0, color=INK, label=f"broken {size}")
    label(b, axis, "of all joints (%)")
    key(b, loc="upper left")
    for ax in (a, b):
        _plain(ax)
        ax.set_xlim(*_ends(at))
        ax.set_ylim(bottom=0.0)


STEREONET = 6.0
"""Diameter of a stereonet [cm]."""


def cracks_in_space(parts: Sequence[Part], state: MeshState, rows: np.ndarray, events: Events | None) -> Any:
    """Draw broken joints by mode and damage over time; below, the centres of the broken joints of the last frame (rows
    of joints), seen along the shortest axis of the body, and their poles in a stereonet.
    """
    figure, (a, b, low) = page([4.6, 3.6, STEREONET], [GAP, LOWER_GAP])
    _crack_curves((a, b), parts, events, "area")
    corners = state.points[state.joints[rows, :3]]
    kinds = np.searchsorted(emission.LIMITS, state.of_joints["mode"][rows], side="right")
    place, (width, _) = low.get_position(), 2.54 * figure.get_size_inches()
    low.set_position((place.x0, place.y0, place.width - (STEREONET + 2.0) / width, place.height))
    _scatter(low, dict(zip("xyz", corners.mean(axis=1).T)), kinds, np.full(len(rows), 6.0),
             np.ptp(state.points, axis=0))  # fmt: skip
    net = figure.add_axes((place.x1 - STEREONET / width, place.y0, STEREONET / width, place.height))
    _stereonet(net, corners, kinds)
    _letters([a, b, low])
    net.text(-1.0, 1.015, "(d)", fontsize=plots.FONT - 1.0, va="bottom")
    return figure


def _stereonet(axes: Any, corners: np.ndarray, kinds: np.ndarray) -> None:
    """Poles of triangles (n, 3, 3) in the lower hemisphere, equal areas (Schmidt net); y is north."""
    dip, direction = (np.radians(one) for one in orientation(corners))
    r = np.sqrt(2.0) * np.sin(0.5 * dip)
    x, y = -r * np.sin(direction), -r * np.cos(direction)
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    axes.plot(np.cos(turn), np.sin(turn), lw=0.8, color=INK)
    axes.plot([-0.03, 0.03], [0.0, 0.0], lw=0.6, color=INK)
    axes.plot([0.0, 0.0], [-0.03, 0.03], lw=0.6, color=INK)
    for k, shade in enumerate(MODE_COLOURS):
        some = kinds == k
        axes.scatter(x[some], y[some], s=6.0, facecolors="none", edgecolors=shade, linewidths=0.6)
    for words, at in (("y", (0.0, 1.04)), ("x", (1.06, 0.0))):
        axes.text(*at, words, fontsize=plots.FONT, ha="center", va="bottom" if words == "y" else "center")
    axes.text(0.0, -1.06, f"{len(dip)} poles, lower hemisphere", fontsize=plots.FONT - 1.0, ha="center", va="top")
    axes.set_aspect("equal")
    axes.set_xlim(-1.15, 1.15)
    axes.set_ylim(-1.15, 1.15)
    axes.axis("off")


def _scatter(
    axes: Any, places: dict[str, np.ndarray], kinds: np.ndarray, sizes: np.ndarray, extent: np.ndarray, more: str = ""
) -> None:
    """Places [m] of broken joints, in space seen along the axis of which there is least; extent (dim,) [m]."""
    least = "" if len(places) == 2 else "xyz"[int(np.argmin(extent))]
    one, other = (axis for axis in places if axis != least)
    size, unit = length_unit(float(max(extent["xyz".index(axis)] for axis in (one, other))))
    for k, shade in enumerate(MODE_COLOURS):
        rows = kinds == k
        axes.scatter(places[one][rows] / size, places[other][rows] / size, s=sizes[rows], facecolors="none",
                     edgecolors=shade, linewidths=0.6)  # fmt: skip
    axes.set_aspect("equal", adjustable="box")
    axes.margins(0.06)
    label(axes, f"{one} ({unit}){more}", f"{other} ({unit})")
    _plain(axes)


def _ends(at: np.ndarray) -> tuple[float, float]:
    low, high = float(at.min()), float(at.max())
    return (low, high) if high > low else (low - 0.5, low + 0.5)


def _by_time(sheet: _Maps, state: MeshState) -> None:
    """Broken joints in the colours of the time at which they broke."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection
    from matplotlib.colors import Normalize

    axes = sheet.maps[1]
    _elements(axes, state)
    rows = np.flatnonzero(state.of_joints["state"] == blocks.BROKEN)
    broke = state.of_joints["break_time"][rows]
    order = np.argsort(broke, kind="stable")
    at, name = times(broke[order], True)
    scale = ScalarMappable(Normalize(*_ends(at)), "plasma")
    width = blocks.line_width(state, sheet.scale)
    axes.add_collection(
        LineCollection(
            list(state.points[state.joints[rows[order]]]), colors=scale.to_rgba(at), linewidths=width, capstyle="round",
            zorder=3,
        ),
        autolim=False,
    )  # fmt: skip
    bar = sheet.figure.colorbar(scale, cax=sheet.bar())
    bar.set_label(f"{name} of breaking".replace("time (", "time of breaking (").replace(") of breaking", ")"),
                  fontsize=plots.FONT)  # fmt: skip
    bar.ax.tick_params(labelsize=plots.FONT - 1.0, width=0.5, length=2.5)
    bar.outline.set_linewidth(0.5)


# --- fragments ---------------------------------------------------------------------------------------------------


def fragments(parts: Sequence[Part], state: MeshState) -> Any:
    """Draw number of fragments and share of the largest over time; distribution of sizes; the last frame."""
    from matplotlib import colormaps

    flat = state.points.shape[1] == 2
    sheet = _Maps(state, [3.8, 4.6], [LOWER_GAP, LOWER_GAP], 1, 0.0, 1.6) if flat else None
    figure, (a, b) = (sheet.figure, sheet.panels) if sheet is not None else page([3.8, 4.6], [LOWER_GAP], 1.6)
    amount, body = ("area", "circle") if flat else ("volume", "sphere")
    at, axis = when(parts)
    pieces = [one.pieces for one in parts if one.pieces is not None]
    number = np.array([len(p.area) for p in pieces])
    share = np.array([p.area[0] / p.area.sum() for p in pieces])
    a.plot(at, number, _marks(len(at)), ms=2.5, lw=1.2, color=INK, label="fragments")
    a.set_ylim(0.0, 1.1 * float(number.max()))
    label(a, axis, "fragments")
    other = a.twinx()
    other.plot(at, 100.0 * share, _marks(len(at)), ms=2.5, lw=1.2, color=LINES[1])
    other.set_ylim(0.0, 105.0)
    other.set_ylabel(f"{amount} of the largest (%)", fontsize=plots.FONT, color=LINES[1])
    _plain(a)
    other.tick_params(labelsize=plots.FONT - 1.0, width=0.6, length=3.0, colors=LINES[1])
    a.set_xlim(*_ends(at))
    # Of frames with as many fragments the first; of these some.
    changed = [k for k in range(len(pieces)) if k == 0 or number[k] != number[k - 1]]
    chosen = [changed[k] for k in np.unique(np.linspace(0, len(changed) - 1, SOME_FRAMES).round().astype(int))]
    size, unit = length_unit(max(float(p.size[0]) for p in pieces))
    for k in chosen:
        sizes, passing = pieces[k].passing()
        shade = INK if k == chosen[-1] else colormaps["viridis"](0.1 + 0.75 * k / max(len(pieces) - 1, 1))
        moment = f"{at[k]:.3g} {axis[axis.find('(') + 1 : -1]}" if "(" in axis else f"step {parts[k].step}"
        b.step(np.append(sizes[0], sizes) / size, 100.0 * np.append(0.0, passing), where="post", lw=1.2, color=shade,
               label=moment)  # fmt: skip
    b.set_xscale("log")
    b.set_ylim(0.0, 105.0)
    label(b, f"size of fragment: diameter of the {body} of its {amount} ({unit})", f"{amount} in smaller ones (%)")
    key(b, loc="upper left")
    _plain(b)
    if sheet is None:  # hpcdem draw shows bodies in space
        _letters([a, b])
        return figure
    ax = sheet.maps[0]
    last = pieces[-1]
    shades = np.array([*FRAGMENT_COLOURS, "#f2f0ea"], object)
    # Single elements stay pale, and so does what was not requested.
    kind = np.where((last.of >= 0) & (last.elements[last.of] > 1), last.of % len(FRAGMENT_COLOURS), -1)
    _elements(ax, state, shades[kind])
    broken = np.isin(state.of_joints["state"], (blocks.BROKEN, blocks.FREE))
    blocks.lines(ax, state.points[state.joints[broken]], INK, 0.5 * blocks.line_width(state, sheet.scale))
    _letters([a, b, ax])
    return sheet.figure


# --- bodies in space -----------------------------------------------------------------------------------------------


def regions(parts: Sequence[Part]) -> Any:
    """Draw the mean stress of every region over time; components of stress and of strain of the last region."""
    figure, axes = page([4.2, 4.6, 4.6], [GAP, GAP])
    at, axis = when(parts)
    series: dict[tuple[str, str], list[tuple[float, bodies.Region]]] = {}
    for time, one in zip(at.tolist(), parts, strict=True):
        for region in one.regions or ():
            series.setdefault((region.set_name, region.name), []).append((time, region))
    largest = max(float(np.abs(r.stress).max()) for many in series.values() for _, r in many)
    size, unit = scale(largest, "Pa")
    for k, ((_, name), many) in enumerate(series.items()):
        axes[0].plot([t for t, _ in many], [r.stress[:3].mean() / size for _, r in many], _marks(len(many)), ms=2.5,
                     lw=1.2, color=LINES[k % len(LINES)], label=name)  # fmt: skip
    name, many = next((name, many) for (_, name), many in reversed(series.items()))
    time = [t for t, _ in many]
    for k, c in enumerate(bodies.COMPONENTS):
        style = {"lw": 1.2, "ls": "-" if k < 3 else "--", "color": LINES[k % 3]}
        axes[1].plot(time, [r.stress[k] / size for _, r in many], label=c, **style)
        axes[2].plot(time, [1e3 * r.strain[k] for _, r in many], label=c, **style)
    label(axes[0], None, f"mean stress ({unit})")
    label(axes[1], None, f"stress, {name} ({unit})")
    label(axes[2], axis, f"strain, {name} (‰)")
    for ax in axes:
        _plain(ax)
        ax.set_xlim(*_ends(at))
        key(ax, 3)
    _letters(axes)
    return figure


def displacement(parts: Sequence[Part]) -> Any:
    """Draw the largest displacement of the surface, and the least and the greatest of each component, over time."""
    figure, axes = page([4.6, 5.2], [GAP])
    at, axis = when(parts)
    kept = [k for k, one in enumerate(parts) if one.surface is not None and len(one.surface.node)]
    at, some = at[kept], [surface for k in kept if (surface := parts[k].surface) is not None]
    size, unit = length_unit(max(float(s.length.max()) for s in some))
    axes[0].plot(at, [s.length.max() / size for s in some], _marks(len(at)), ms=2.5, lw=1.2, color=INK)
    for k, c in enumerate("xyz"):
        for end, ls in ((np.min, "--"), (np.max, "-")):
            axes[1].plot(at, [end(s.moved[:, k]) / size for s in some], ls=ls, lw=1.2, color=LINES[k],
                         label=f"{'least' if end is np.min else 'greatest'} $u_{c}$")  # fmt: skip
    label(axes[0], None, f"largest ({unit})")
    label(axes[1], axis, f"displacement ({unit})")
    key(axes[1], 3)
    for ax in axes:
        _plain(ax)
        ax.set_xlim(*_ends(at))
    _letters(axes)
    return figure


# --- fluid -------------------------------------------------------------------------------------------------------


def fluid(parts: Sequence[Part], state: MeshState) -> Any:
    """Draw wet length, in space wet area, and largest pressure and aperture over time; below, the pressure in the last
    frame: in the plane on all channels, in space on those of a flat fracture, seen at a right angle.
    """
    from hpcdem.post import fluid as pictures

    if state.points.shape[1] == 3:
        return _fluid_in_space(parts, state)
    sheet = _Maps(state, [3.8, 3.8], [GAP, LOWER_GAP], 1, right=1.6)
    _fluid_curves(sheet.panels, parts, 1)
    shown = pictures.PICTURES["pressure"]
    span = shown.range(state)
    drawn = blocks.coloured(sheet.maps[0], state, "pressure", span, sheet.scale)
    _fluid_bar(sheet.figure, drawn, sheet.bar(), blocks.titled(shown, span, state))
    _letters([*sheet.panels, sheet.maps[0]])
    return sheet.figure


def _fluid_curves(panels: Sequence[Any], parts: Sequence[Part], power: int) -> None:
    """power: of the metre in what is wet."""

    a, b = panels
    at, axis = when(parts)
    some = [one.fluid for one in parts if one.fluid is not None]
    size, unit = length_unit(max(max(f.size for f in some), 1e-12) ** (1.0 / power))
    size = size**power
    what = f"length of channels ({unit})" if power == 1 else f"area of channels ({unit}²)"
    a.plot(at, [f.size / size for f in some], _marks(len(at)), ms=2.5, lw=1.2, color=LINES[0], label="wet")
    a.plot(at, [f.open_size / size for f in some], "--", lw=1.0, color=INK, label="of these, open")
    label(a, None, what)
    key(a, loc="upper left")
    pressure, kind = _in_unit([f.pressure for f in some], "Pa")
    b.plot(at, pressure, _marks(len(at)), ms=2.5, lw=1.2, color=INK)
    label(b, axis, f"largest pressure ({kind})")
    aperture, kind = _in_unit([f.aperture for f in some], "m")
    other = b.twinx()
    other.plot(at, aperture, _marks(len(at)), ms=2.5, lw=1.2, color=LINES[1])
    other.set_ylabel(f"largest aperture ({kind})", fontsize=plots.FONT, color=LINES[1])
    other.tick_params(labelsize=plots.FONT - 1.0, width=0.6, length=3.0, colors=LINES[1])
    for ax in (a, b):
        _plain(ax)
        ax.set_xlim(*_ends(at))
    for ax in (a, b, other):
        ax.set_ylim(bottom=0.0)


def _fluid_bar(figure: Any, drawn: Any, axes: Any, title: str) -> None:
    bar = figure.colorbar(drawn, cax=axes)
    bar.set_label(title, fontsize=plots.FONT)
    bar.ax.tick_params(labelsize=plots.FONT - 1.0, width=0.5, length=2.5)
    bar.outline.set_linewidth(0.5)


FLAT = 0.05
"""Largest deviation of a fracture from its mean plane, over its extent, with which it is drawn in that plane."""


def _fluid_in_space(parts: Sequence[Part], state: MeshState) -> Any:
    from matplotlib.collections import PolyCollection

    from hpcdem.post import fluid as pictures

    shown = pictures.PICTURES["pressure"]
    rows = np.flatnonzero(np.isfinite(state.of_joints["aperture"]))
    corners = state.points[state.joints[rows, :3]]
    flat, names = _in_its_plane(corners)
    if flat is None:
        figure, panels = page([3.8, 3.8], [GAP], 1.6)
        _fluid_curves(panels, parts, 2)
        _letters(panels)
        return figure
    low, high = flat.reshape(-1, 2).min(axis=0), flat.reshape(-1, 2).max(axis=0)
    bar = 1.7
    width = min(plots.PAGE_WIDTH - LEFT - bar - RIGHT, MAP_HEIGHT * (high - low)[0] / (high - low)[1])
    height = width * (high - low)[1] / (high - low)[0]
    figure, (a, b, seen) = page([3.8, 3.8, height], [GAP, LOWER_GAP], 1.6)
    _fluid_curves((a, b), parts, 2)
    box, (w, h) = seen.get_position(), 2.54 * figure.get_size_inches()
    left = box.x0 + max(0.0, 0.5 * (box.width - (width + bar) / w))
    seen.set_position((left, box.y0, width / w, height / h))
    pressure, span = shown.values(state)[rows], shown.range(state)
    size, unit = blocks.unit_of(shown, span, state)
    wet = np.isfinite(pressure)
    seen.add_collection(PolyCollection(flat[~wet], facecolors=pictures.DRY, edgecolors="face", linewidths=0.2))
    drawn = PolyCollection(flat[wet], array=pressure[wet] / size, cmap=shown.colours, linewidths=0.5, edgecolors="face")
    drawn.set_clim(span[0] / size, max(span[1], span[0] + 1e-12) / size)
    seen.add_collection(drawn)
    seen.set_xlim(low[0], high[0])
    seen.set_ylim(low[1], high[1])
    label(seen, f"{names[0]} (m)", f"{names[1]} (m)")
    seen.tick_params(labelsize=plots.FONT - 1.0, width=0.6, length=3.0)
    place = (left + (width + 0.3) / w, box.y0, 0.3 / w, height / h)
    _fluid_bar(figure, drawn, figure.add_axes(place), f"{shown.title} ({unit})")
    _letters([a, b, seen])
    return figure


def _in_its_plane(corners: np.ndarray) -> tuple[np.ndarray | None, tuple[str, str]]:
    """Triangles (n, 3, 3) in their mean plane (n, 3, 2), and what both axes are: two coordinates, or along strike and
    up dip; None if they are not in a plane."""
    points = corners.reshape(-1, 3)
    middle = points.mean(axis=0)
    _, axis_of_least, axes = np.linalg.svd(points - middle, full_matrices=False)
    normal = axes[2] * (np.sign(axes[2, 2]) or 1.0)
    if axis_of_least[2] > FLAT * axis_of_least[1]:
        return None, ("", "")
    along = np.abs(normal)
    if along.max() > 1.0 - 1e-9:
        one, other = (k for k in range(3) if k != int(along.argmax()))
        return corners[:, :, [one, other]], ("xyz"[one], "xyz"[other])
    strike = np.array([-normal[1], normal[0], 0.0]) / np.hypot(normal[0], normal[1])
    up = np.cross(normal, strike)
    up *= np.sign(up[2])
    return np.stack([(corners - middle) @ strike, (corners - middle) @ up], axis=2), ("along strike", "up dip")


def _in_unit(values: Sequence[float], unit: str) -> tuple[list[float], str]:
    """Values in the multiple of a unit in which they are read best, and its name."""
    size, name = scale(max(map(abs, values)), unit)
    return [value / size for value in values], name


# --- emission ----------------------------------------------------------------------------------------------------


def emitted(found: Emission) -> Any:
    """Draw load and events over time, rate by mode, magnitudes; magnitude-frequency plot and positions of the
    events.
    """
    low_height = 6.2
    figure, (a, b, c, low) = page([4.4, 3.6, 3.6, low_height], [GAP, GAP, LOWER_GAP], right=1.6)
    kinds = found.events.kinds()
    edges, axis = times(np.append(found.rates[:, 0], found.rates[-1, 1]), found.timed)
    factor = float(edges[-1] / found.rates[-1, 1]) if found.rates[-1, 1] else 1.0
    at = found.at * factor
    _load(a, found, factor)
    count = a.twinx()
    order = np.argsort(at, kind="stable")
    steps = np.concatenate([[edges[0]], at[order], [edges[-1]]])
    total = np.concatenate([[0], np.arange(1, len(at) + 1), [len(at)]])
    count.step(steps, total, where="post", lw=1.2, color=LINES[1])
    count.set_ylim(0.0, 1.08 * len(at))
    count.set_ylabel("cumulative events", fontsize=plots.FONT, color=LINES[1])
    count.tick_params(labelsize=plots.FONT - 1.0, width=0.6, length=3.0, colors=LINES[1])
    base = np.zeros(len(found.rates))
    for k, (name, shade) in enumerate(zip(emission.MODES, MODE_COLOURS)):
        b.bar(edges[:-1], found.rates[:, 2 + k], np.diff(edges), base, align="edge", color=shade, lw=0.0, label=name)
        base += found.rates[:, 2 + k]
    part = float(found.rates[0, 1] - found.rates[0, 0])
    wide, unit = times(np.array([part]), True)
    interval = f"{wide[0]:.2g} {unit[unit.find('(') + 1 : -1]}" if found.timed else f"{part:.3g} steps"
    label(b, None, f"events per {interval}")
    key(b, loc="upper left")
    for k, shade in enumerate(MODE_COLOURS):
        c.plot(at[kinds == k], found.magnitude[kinds == k], "o", ms=2.6, mfc="none", mec=shade, mew=0.6)
    label(c, axis, "magnitude M")
    for ax in (a, b, c):
        _plain(ax)
        ax.set_xlim(edges[0], edges[-1])
    b.set_ylim(bottom=0.0)
    place = low.get_position()
    low.set_position((place.x0, place.y0, 0.46 * place.width, place.height))
    _frequencies(low, found)
    shown = figure.add_axes((place.x0 + 0.6 * place.width, place.y0, 0.4 * place.width, place.height))
    _places(shown, found, kinds)
    _letters([a, b, c, low, shown])
    return figure


def _load(axes: Any, found: Emission, factor: float) -> None:
    """The history beside the events; compression upwards if there is more of it."""
    curve = found.history
    if curve is None or not len(curve.step):
        axes.set_yticks([])
        label(axes, None, "")
        return
    values = curve.values
    known = values[np.isfinite(values)]
    sign = -1.0 if len(known) and known[np.argmax(np.abs(known))] < 0.0 else 1.0
    size, unit = scale(float(np.abs(known).max(initial=0.0)), curve.unit)
    axes.plot((curve.time if found.timed else curve.step) * factor, sign * values / size, lw=1.0, color=INK)
    label(axes, None, f"{'−' if sign < 0 else ''}{curve.name} ({unit})")
    bottom, top = axes.get_ylim()
    if -0.1 * top < bottom < 0.0:
        axes.set_ylim(bottom=0.0)
    axes.set_zorder(1.0)
    axes.patch.set_visible(False)


def _frequencies(axes: Any, found: Emission) -> None:
    """Number of events of each magnitude, and from each on; the line of the fit."""
    edges, number, above = emission.frequencies(found.magnitude)
    f = found.fit
    if not len(edges):
        axes.text(0.5, 0.5, "no event has energy", transform=axes.transAxes, ha="center", fontsize=plots.FONT)
        return
    some = number > 0
    axes.semilogy(edges[some] + 0.5 * emission.BIN, number[some], "s", ms=3.0, mfc="none", mec=GREY, mew=0.7,
                  label=f"in bins of {emission.BIN:g}")  # fmt: skip
    axes.semilogy(edges, above, "o", ms=3.2, color=INK, label="of M and above")
    if np.isfinite(f.b):
        m = np.array([f.completeness, min(f.a / f.b, float(edges[-1]) + 2.0 * emission.BIN)])
        axes.semilogy(m, 10.0 ** (f.a - f.b * m), "-", lw=1.2, color=LINES[1],
                      label=f"b = {f.b:.2f} ± {f.error:.2f}")  # fmt: skip
        axes.axvline(f.completeness, color=LINES[1], lw=0.7, ls=":")
    axes.set_ylim(0.7, 30.0 * float(above.max()))  # room for the legend
    label(axes, "magnitude M", "events")
    key(axes, loc="upper right")
    _plain(axes)


def _places(axes: Any, found: Emission, kinds: np.ndarray) -> None:
    """Draw the positions of events; the size of a circle follows the magnitude."""
    e = found.events
    m = np.nan_to_num(found.magnitude, nan=float(np.nanmin(found.magnitude, initial=0.0)))
    part = (m - m.min()) / max(float(np.ptp(m)), 1e-12)
    extent = np.array([float(np.ptp(values)) for values in e.places.values()])
    _scatter(axes, e.places, kinds, 2.0 + 34.0 * part**2, extent, "; size: magnitude")

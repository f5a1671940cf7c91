"""Pages: panels one over the other on common axes, colour bars below. All lengths in centimetres."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from hpcdem.io.axes import View
from hpcdem.post.cpt import ColourTable
from hpcdem.post.section import Section
from hpcdem.post.sections import panels
from hpcdem.post.sections.panels import Kind

CM, CM_OF_POINT = 1.0 / 2.54, 2.54 / 72.0
HEIGHT, SHEET = 1.8, 24.0
"""Largest height of a page over its width, and the height of a sheet of paper [cm]; further panels go side by side, or
on the next page."""
RIGHT, TOP, GAP, BOTTOM, BAR, BAR_HEIGHT = 0.35, 0.3, 0.5, 1.1, 0.92, 0.28
LEFT, DIGIT = 0.95, 0.17
HEADING = 0.35
"""Part of the width in which the headings of colour bars stand, left of them."""
MINUS = "\N{MINUS SIGN}"


@dataclass(frozen=True)
class Style:
    """Appearance of pages. width [cm]; bars: whether colour bars are drawn; labels: off, on or abc; tables: colours of
    each kind by key; stress_bars: square [m] and scale of the bars along the largest principal stress, or None."""

    tables: Mapping[str, ColourTable]
    width: float = 14.0
    bars: bool = True
    labels: str = "off"
    stress_bars: tuple[float, float] | None = None

    @property
    def most(self) -> float:
        """Largest height of a page [cm]."""
        return max(HEIGHT * self.width, SHEET)

    @property
    def font(self) -> float:
        """Size of the numbers [points]: legible also in a figure of one column."""
        return min(9.0, max(6.0, 8.0 * self.width / 14.0))


def section_page(section: Section, seen: View, kinds: Sequence[Kind], style: Style, caption: str = "") -> Any:
    """A matplotlib Figure: one section, a panel for each kind. caption: said over all of them if labels are on."""
    captions = style.labels != "off" or (
        style.stress_bars is not None and any(kind.key == panels.DISTORTIONAL.key for kind in kinds)
    )
    page = Page(seen, len(kinds), style, bars_of(kinds, style), captions, caption if style.labels == "on" else "")
    for index, (kind, ax) in enumerate(zip(kinds, page.axes)):
        panels.draw(section, kind, ax, style.tables.get(kind.key))
        names = {"off": "", "on": f"{_letter(index)}  {kind.title}", "abc": _letter(index)}
        page.say(ax, names[style.labels], _stress_bars(section, kind, ax, style))
    return page.figure


def series_page(sections: Iterable[tuple[Section, str]], count: int, seen: View, kind: Kind, style: Style) -> Any:
    """A matplotlib Figure: one kind, a panel for each of `count` sections, each with its caption."""
    page = Page(seen, count, style, bars_of([kind], style), captions=True)
    for index, ((section, caption), ax) in enumerate(zip(sections, page.axes)):
        panels.draw(section, kind, ax, style.tables.get(kind.key))
        name = "" if style.labels == "off" else f"{_letter(index)}  "
        page.say(ax, name + caption, _stress_bars(section, kind, ax, style))
    return page.figure


def _letter(index: int) -> str:
    return chr(ord("a") + index % 26)


def _stress_bars(section: Section, kind: Kind, ax: Any, style: Style) -> str:
    if kind.key != panels.DISTORTIONAL.key or style.stress_bars is None:
        return ""
    return panels.draw_stress_bars(section, ax, *style.stress_bars)


def panels_of_a_page(seen: View, style: Style) -> int:
    """Count the panels of full width with captions that fit on a page, at least one."""
    page = _Sizes(seen, style, int(style.bars), captions=True)
    return max(1, int((style.most - page.rest + page.gap) / (page.height + page.gap)))


# -- layout -------------------------------------------------------------------------------------------------------


class _Sizes:
    """Sizes of the parts of a page with panels in this number of columns."""

    def __init__(
        self, seen: View, style: Style, bars: int, captions: bool, title: bool = False, columns: int = 1
    ) -> None:
        line = style.font * CM_OF_POINT + 0.1
        self.top, self.gap = TOP + line * (captions + title), GAP + line * captions
        self.left = LEFT + DIGIT * max(map(len, seen.ticks()[1].labels), default=0)
        self.column = style.width / columns
        self.panel = self.column - self.left - RIGHT
        self.height = self.panel * seen.height / seen.width
        self.rest = self.top + BOTTOM + BAR * bars

    def page(self, rows: int) -> float:
        """Height of the page."""
        return self.rest + rows * (self.height + self.gap) - self.gap


@dataclass
class Page:
    """A figure with empty panels of one view, numbered down the columns, and its colour bars.

    seen: the view of all panels; count: number of panels; bars: the colour bars; captions: whether
    there is room for a line over each panel; title: a line over all of them.
    """

    seen: View
    count: int
    style: Style
    bars: Sequence[Bar] = ()
    captions: bool = False
    title: str = ""
    figure: Any = field(init=False)
    axes: list[Any] = field(init=False)

    def __post_init__(self) -> None:
        from matplotlib.figure import Figure

        style = self.style
        for columns in (1, 2, 3):
            sizes = _Sizes(self.seen, style, len(self.bars), self.captions, bool(self.title), columns)
            rows = math.ceil(self.count / columns)
            high = sizes.page(rows)
            if high <= style.most:
                break
        self._page = (style.width, high)
        self.figure = Figure(figsize=(style.width * CM, high * CM))
        self.axes = []
        for index in range(self.count):
            column, row = divmod(index, rows)
            above = sizes.top + row * (sizes.height + sizes.gap)
            ax = self._add(column * sizes.column + sizes.left, above, sizes.panel, sizes.height)
            self._draw_axes(ax, first=column == 0, last=row == rows - 1 or index == self.count - 1)
            self.axes.append(ax)
        self.figure.text(
            sizes.left / style.width, 1.0 - 0.15 / high, self.title, fontsize=style.font, ha="left", va="top"
        )
        for index, bar in enumerate(self.bars):
            under = BAR * (len(self.bars) - index)
            length = (1.0 - HEADING) * style.width - 2.0 * RIGHT  # the last number sticks out
            bar.draw(self._add(HEADING * style.width, high - under + 0.38, length, BAR_HEIGHT), length, style.font)

    def _add(self, left: float, above: float, width: float, height: float) -> Any:
        w, h = self._page
        return self.figure.add_axes((left / w, 1.0 - (above + height) / h, width / w, height / h))

    def _draw_axes(self, ax: Any, first: bool, last: bool) -> None:
        """Frame, ticks on all sides, numbers at the left and under the last panel of a column."""
        from matplotlib import markers

        size, unit = self.seen.unit
        ax.set(xlim=(self.seen.left, self.seen.right), ylim=(self.seen.bottom, self.seen.top), aspect="equal")
        ax.set_title("", y=1.0)  # else the box of every number is measured to find room for a title
        x, y = self.seen.ticks()
        for axis, ticks in ((ax.xaxis, x), (ax.yaxis, y)):
            axis.set_ticks([v * size for v in ticks.major], labels=ticks.labels, fontsize=self.style.font)
        ax.tick_params(top=True, right=True, width=0.5, length=4.0, pad=2.0, zorder=4.0)
        # As markers, since each tick of matplotlib is five artists: a third of the time of a page.
        for side, ends, along_x in (
            ("TICKDOWN", self.seen.bottom, True), ("TICKUP", self.seen.top, True),
            ("TICKLEFT", self.seen.left, False), ("TICKRIGHT", self.seen.right, False),
        ):  # fmt: skip
            at = [v * size for v in (x if along_x else y).minor]
            rest = [ends] * len(at)
            ax.plot(
                *((at, rest) if along_x else (rest, at)), linestyle="none", marker=getattr(markers, side),
                markersize=2.0, markeredgewidth=0.5, color="black", clip_on=False, zorder=4.0, scalex=False,
                scaley=False,
            )  # fmt: skip
        ax.tick_params(labelbottom=last)
        if last:
            ax.set_xlabel(f"x ({unit})", fontsize=self.style.font, labelpad=2.0)
        if first:
            ax.set_ylabel(f"y ({unit})", fontsize=self.style.font, labelpad=2.0)
        for spine in ax.spines.values():
            spine.set(linewidth=0.5, zorder=4.0)

    def say(self, ax: Any, left: str, right: str) -> None:
        """Write over a panel, at its left and at its right end; smaller if that is too much for one line."""
        available = ax.get_position().width * self._page[0]
        size = min(
            self.style.font, self.style.font * available / (sum(text_widths([left, right], self.style.font)) + 0.3)
        )
        for text, place in ((left, 0.0), (right, 1.0)):
            if text:
                ax.annotate(
                    text, (place, 1.0), (0.0, 6.0), "axes fraction", textcoords="offset points", fontsize=size,
                    ha="right" if place else "left", va="baseline",
                )  # fmt: skip


# -- colour bars --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Bar:
    """One colour bar. linear: lengths show values; otherwise every slice of the table is as long as any other."""

    heading: str
    table: ColourTable
    linear: bool

    def draw(self, ax: Any, length: float, font: float) -> None:
        """Colours, ticks and numbers above, the heading over them."""
        table, breaks = self.table, self.table.breaks
        if self.linear:
            ends = (breaks[0], breaks[-1])
            values = ends[0] + (np.arange(512) + 0.5) / 512 * (ends[1] - ends[0])
        else:
            ends = (0.0, float(len(table.slices)))
            part = (np.arange(32) + 0.5) / 32
            values = np.concatenate([s.low + part * (s.high - s.low) for s in table.slices])
        colours = table.colours(values)[None]
        ax.imshow(np.where(np.isfinite(colours), colours, 1.0), extent=(*ends, 0.0, 1.0), aspect="auto",
                  interpolation="none")  # fmt: skip
        ticks = thinned(self._linear_ticks(ax) if self.linear else bar_ticks(table), length / (ends[1] - ends[0]), font)
        ax.set_xticks([at for at, _ in ticks], labels=[text for _, text in ticks])
        ax.set_yticks([])
        ax.tick_params(axis="x", which="both", top=True, bottom=False, width=0.5)
        ax.tick_params(axis="x", which="major", length=2.5, labeltop=True, labelbottom=False, pad=1.0,
                       labelsize=0.85 * font)  # fmt: skip
        ax.tick_params(axis="x", which="minor", length=1.3)
        ax.annotate(
            self._wrapped(length, font), (0.0, 0.5), (-2.0 * font, 0.0), "axes fraction",
            textcoords="offset points", fontsize=0.9 * font, ha="right", va="center",
        )  # fmt: skip
        for spine in ax.spines.values():
            spine.set_linewidth(0.3)

    def _wrapped(self, length: float, font: float) -> str:
        """The heading in lines that fit beside a bar of this length [cm]."""
        available = HEADING / (1.0 - HEADING) * (length + 2.0 * RIGHT) / CM_OF_POINT - 2.0 * font
        characters = max(8, int(available / (0.54 * 0.9 * font)))
        return "\n".join(line for part in self.heading.split("\n") for line in textwrap.wrap(part, characters))

    def _linear_ticks(self, ax: Any) -> list[tuple[float, str]]:
        from matplotlib.ticker import AutoMinorLocator, MaxNLocator

        low, high = self.table.breaks[[0, -1]]
        ax.xaxis.set_minor_locator(AutoMinorLocator(5))
        inside = MaxNLocator(5, steps=[1, 2, 5, 10]).tick_values(low, high)
        return [(float(v), number(v)) for v in inside if low - 1e-9 * high <= v <= high * (1.0 + 1e-9)]


def bars_of(kinds: Sequence[Kind], style: Style) -> list[Bar]:
    """The colour bars of some kinds: kinds with the same colours share one."""
    groups: list[list[Kind]] = []
    for kind in kinds if style.bars else ():
        if kind.key not in style.tables:
            continue
        same = next((g for g in groups if style.tables[g[0].key] == style.tables[kind.key]), None)
        if same is None:
            groups.append([kind])
        else:
            same.append(kind)
    return [Bar(_heading(group), style.tables[group[0].key], not group[0].strain) for group in groups]


def _heading(kinds: Sequence[Kind]) -> str:
    if len({kind.unit for kind in kinds}) == 1:
        unit = f" ({kinds[0].unit})" if kinds[0].unit else ""
        return ",\n".join(kind.title for kind in kinds) + unit
    return ",\n".join(kind.heading for kind in kinds)


def text_widths(texts: Sequence[str], font: float) -> list[float]:
    """Measure the widths of texts [cm]."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    size = FontProperties(size=font)
    return [text_to_path.get_text_width_height_descent(t, size, "$" in t)[0] * CM_OF_POINT if t else 0.0 for t in texts]


def thinned(ticks: list[tuple[float, str]], scale: float, font: float) -> list[tuple[float, str]]:
    """Thin out ticks until their labels can be read side by side, with the middle one among them; "more than" at the
    ends is dropped first. scale: cm per unit of position."""
    widths = text_widths([text for _, text in ticks], 0.85 * font)
    numbered = range(ticks[0][1].startswith("<"), len(ticks) - ticks[-1][1].startswith(">")) if ticks else ()
    strides = (range(len(ticks) // 2 % step, len(ticks), step) for step in range(2, len(ticks)))
    for chosen in (range(len(ticks)), numbered, *strides):
        if all((ticks[b][0] - ticks[a][0]) * scale > 0.5 * (widths[a] + widths[b]) + 0.06 for a, b in pairwise(chosen)):
            return [ticks[k] for k in chosen]
    return ticks[:1]


def bar_ticks(table: ColourTable) -> list[tuple[float, str]]:
    """Places (slices from the left) and texts on a bar of equal slices: labels of the table in the middle of their
    slices, the limits it annotates, or else all limits, where one that is ten times the next stands for "more"."""
    if any(s.label for s in table.slices) or table.categorical:
        return [(k + 0.5, s.label or number(s.low)) for k, s in enumerate(table.slices)]
    breaks = table.breaks
    texts = [number(z) for z in breaks]
    if len(breaks) > 2 and breaks[0] < 0.0 and breaks[0] <= 10.0 * breaks[1] < 0.0:
        texts[0] = f"<{texts[1]}"
    if len(breaks) > 2 and breaks[-1] > 0.0 and breaks[-1] >= 10.0 * breaks[-2] > 0.0:
        texts[-1] = f">{texts[-2]}"
    annotated = {
        k + d
        for k, s in enumerate(table.slices)
        for d, flags in ((0, "LB"), (1, "UB"))
        if s.annotated in flags and s.annotated
    }
    return [(float(k), text) for k, text in enumerate(texts) if not annotated or k in annotated]


def number(value: float) -> str:
    """The shortest text of a number, with a true minus sign."""
    return f"{value:.6g}".replace("-", MINUS) if value else "0"

"""Figures of a report: bands over time by group, profiles of the surface, measures against parameters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from hpcdem.core.units import scale
from hpcdem.lang.parameters import Value
from hpcdem.post import plots
from hpcdem.post.measure.figures import LINES, key, label, length_unit, page
from hpcdem.sweep.tables import STATISTICS, Band, Column, Report, statistics

DRAWN = {
    "wedge": ("height[m]", "width[m]", "toe_x[m]", "taper[deg]"),
    "faults": ("bands", "reverse", "normal", "dip[deg]"),
    "faults_total": ("faults", "active", "slip[m]", "share_of_shortening"),
    "wallforce": ("fx[N]", "fy[N]", "work[J]"),
    "layers all": ("envelope_area[m2]", "porosity"),
    "cracks": ("broken_share", "particles_from_0.5"),
    "cracks_joints": ("broken", "damage", "p21[1/m]"),
    "fragments": ("fragments", "largest_share", "size_50[m]"),
    "fluid": ("wet_length[m]", "pressure[Pa]", "aperture[m]"),
    "emission": ("cumulative", "cumulative_energy[J]"),
}
"""Columns that are drawn, by the beginning of the name of the table; of other tables all columns, up to MOST."""
MOST = 4
GROUPS = 4
"""Largest number of groups side by side in one panel; with more groups only the band of all members is drawn, and the
dependence."""
HIGH = 4.2
"""Height of a panel [cm]."""


def all_of(report: Report) -> Iterator[tuple[str, Any]]:
    """Names and figures."""
    tables: dict[str, list[Column]] = {}
    for column in report.bands:
        if column[0].startswith("layers ") and not column[0].startswith("layers all"):
            continue
        tables.setdefault(column[0], []).append(column)
    tables = {name: [c for c in columns if _changes(report, c)] for name, columns in tables.items()}
    chosen = {name: found for name, columns in tables.items() if (found := _chosen(name, columns))}
    for name, columns in chosen.items():
        yield f"bands_{name.replace(' ', '_')}", bands(report, columns)
    if report.profiles:
        yield "surface", surface(report)
    for name in report.varied:
        if not isinstance(report.members[name][0], (str, bool)):
            for table, columns in chosen.items():
                yield f"against_{name}_{table.replace(' ', '_')}", against(report, name, columns)


def _changes(report: Report, column: Column) -> bool:
    """Return whether a column changes over time or between members."""
    values = np.concatenate([one.y.ravel() for one in report.bands[column].values()])
    known = values[np.isfinite(values)]
    return len(known) > 0 and bool(np.ptp(known) > 0.0)


def _chosen(name: str, columns: Sequence[Column]) -> list[Column]:
    wanted = next((names for begin, names in DRAWN.items() if name == begin or name.startswith(f"{begin} ")), None)
    if wanted is None:
        return list(columns[:MOST])
    return [column for column in columns if column[1] in wanted]


def _groups(report: Report, there: dict[tuple[Value, ...], Band]) -> list[tuple[tuple[Value, ...], Band]]:
    """Choose the curves to draw: the groups, if there are few, otherwise all members."""
    some = [(group, one) for group, one in there.items() if group]
    return some if 1 < len(some) <= GROUPS else [(group, one) for group, one in there.items() if not group]


def _name(report: Report, group: tuple[Value, ...], count: int) -> str:
    values = ", ".join(f"{name} {value}" for name, value in zip(report.varied, group))
    return f"{values or 'all'} (n = {count})"


def bands(report: Report, columns: Sequence[Column]) -> Any:
    """A panel per measure: median, the middle half and nine tenths of the members, each member as a thin line."""
    figure, axes = page([HIGH] * len(columns))
    alike: dict[str, list[Any]] = {}
    for panel, (ax, column) in enumerate(zip(axes, columns)):
        drawn = _groups(report, report.bands[column])
        size, unit = _unit(column[1], max(float(np.nanmax(np.abs(one.y), initial=0.0)) for _, one in drawn))
        across, axis = _axis(drawn[0][1], np.concatenate([one.x for _, one in drawn]))
        for shade, (group, one) in zip(LINES, drawn):
            _band(ax, one.x / across, one, size, shade, _name(report, group, len(one.y)))
        last = (
            panel + 1 == len(columns)
            or _groups(report, report.bands[columns[panel + 1]])[0][1].axis != drawn[0][1].axis
        )
        label(ax, axis if last else None, unit)
        _frame(ax)
        if panel == 0:
            key(ax, 2 if len(drawn) > 2 else 1)
        alike.setdefault(axis, []).append(ax)
    for panels in alike.values():
        limits = [ax.get_xlim() for ax in panels]
        for ax in panels:
            ax.set_xlim(min(low for low, _ in limits), max(high for _, high in limits))
    return figure


def _band(ax: Any, x: np.ndarray, one: Band, size: float, shade: str, name: str) -> None:
    numbers = dict(zip(STATISTICS, one.statistics / size, strict=True))
    ax.fill_between(x, numbers["q05"], numbers["q95"], color=shade, alpha=0.15, lw=0.0)
    ax.fill_between(x, numbers["q25"], numbers["q75"], color=shade, alpha=0.3, lw=0.0)
    for line in one.y / size:
        ax.plot(x, line, color=shade, lw=0.3, alpha=0.5)
    ax.plot(x, numbers["q50"], color=shade, lw=1.6, label=name)


def surface(report: Report) -> Any:
    """The surface at the end: median and bands."""
    figure, (ax,) = page([5.5])
    drawn = _groups(report, report.profiles)
    size, unit = length_unit(max(float(one.x.max() - one.x.min()) for _, one in drawn))
    for shade, (group, one) in zip(LINES, drawn):
        _band(ax, one.x / size, one, size, shade, _name(report, group, len(one.y)))
    label(ax, f"x ({unit})", f"height at the end ({unit})")
    _frame(ax)
    key(ax)
    return figure


def against(report: Report, name: str, columns: Sequence[Column]) -> Any:
    """Measures at the end against a parameter: members as points, mean and spread where several have one value."""
    figure, axes = page([HIGH] * len(columns))
    values = np.array(report.members[name], dtype=float)
    for k, (ax, (table, column)) in enumerate(zip(axes, columns)):
        y = np.array(report.members[f"{table}.{column} end"], dtype=float)
        size, unit = _unit(column, float(np.nanmax(np.abs(y), initial=0.0)))
        ax.plot(values, y / size, "o", ms=3.0, mew=0.0, color=LINES[0], alpha=0.5)
        of = {value: statistics(y[values == value] / size) for value in np.unique(values)}
        if max(numbers[0] for numbers in of.values()) > 1:
            mean, spread = (np.array([numbers[i] for numbers in of.values()]) for i in (1, 2))
            ax.errorbar(list(of), mean, spread, fmt="_-", color=LINES[1], ms=7.0, lw=1.2, capsize=2.5,
                        label="mean ± standard deviation")  # fmt: skip
            if k == 0:
                key(ax)
        label(ax, name if k + 1 == len(columns) else None, unit)
        if len(of) <= 8:
            ax.set_xticks(list(of))
        _frame(ax)
    return figure


def _frame(ax: Any) -> None:
    ax.grid(lw=0.3, color="#d0d0d0")
    ax.set_axisbelow(True)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    ax.margins(x=0.02)
    ax.yaxis.label.set_fontsize(plots.FONT - 0.5)


def _unit(column: str, largest: float) -> tuple[float, str]:
    """Size of the unit in which a column is drawn, and its label."""
    name, _, unit = column.partition("[")
    unit, name = unit.rstrip("]"), name.strip().replace("_", " ")
    if not unit:
        return 1.0, name
    if unit == "deg":
        return 1.0, f"{name} (°)"
    if unit == "m":
        size, shown = length_unit(largest)
        return size, f"{name} ({shown})"
    if unit == "m2":
        return (1e6, f"{name} (km²)") if largest > 1e6 else (1.0, f"{name} (m²)")
    if unit in ("N", "Pa", "J", "N/m"):
        size, shown = scale(largest, unit)
        return size, f"{name} ({shown})"
    return 1.0, f"{name} ({unit})"


def _axis(one: Band, x: np.ndarray) -> tuple[float, str]:
    """Size and label of the axis of time."""
    name, _, unit = one.axis.partition("[")
    if unit == "m]":
        size, shown = length_unit(float(np.abs(x).max()))
        return size, f"{name} ({shown})"
    return (1.0, "time (s)") if unit else (1000.0, "thousand steps") if name == "step" else (1.0, name)

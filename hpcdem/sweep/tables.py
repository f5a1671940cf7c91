"""Comparison of the measurements of members: values by member, bands over time, dependence on parameters."""

from __future__ import annotations

import csv
import importlib.util
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.agreed import atomic_path
from hpcdem.lang.parameters import Value
from hpcdem.sweep.plan import Member

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
STATISTICS = ("members", "mean", "spread", *(f"q{round(100 * q):02d}" for q in QUANTILES), "min", "max")

SERIES: dict[str, tuple[str, ...]] = {
    "wedge": (), "wallforce": ("wall",), "layers": ("kind", "name"), "cracks": (), "cracks_joints": (), "fragments": (),
    "fluid": (), "emission": (), "faults_total": (),
}  # fmt: skip
"""Tables of `hpcdem measure` with a row per moment, or with one for each of these keys."""
TIMES = ("step", "ini", "time[s]", "shortening[m]", "from", "to")
OF_FAULTS = ("born_shortening[m]", "born_time[s]", "x[m]", "dip_at_birth[deg]", "dip[deg]", "length[m]", "slip[m]",
             "throw[m]", "heave[m]", "largest_slip_rate[m/s]", "share_of_shortening")  # fmt: skip
"""Columns of the n-th fault of each member that are compared."""
CHANCE = ("seed", "twin")
"""Parameters by which groups are not distinguished."""
APART = ("tracks",)
"""Measurements of single particles, which differ between members."""

Column = tuple[str, str]
"""Table and column."""


@dataclass(frozen=True)
class Series:
    """A measure over time: axis: its name; x, y (n,)."""

    axis: str
    x: np.ndarray
    y: np.ndarray


@dataclass(frozen=True)
class Band:
    """A measure over time, of the members of a group: x (n,), y (members, n), statistics (STATISTICS, n)."""

    axis: str
    x: np.ndarray
    y: np.ndarray

    @property
    def statistics(self) -> np.ndarray:
        return np.stack([statistics(column) for column in self.y.T], axis=1)


@dataclass
class Report:
    """members: by column, a value per member that is done; bands: by measure, then by group (() all of them, else
    values of the parameters but `CHANCE`)."""

    names: list[str]
    members: dict[str, list[Any]]
    bands: dict[Column, dict[tuple[Value, ...], Band]]
    profiles: dict[tuple[Value, ...], Band] = field(default_factory=dict)
    parameters: tuple[str, ...] = ()
    varied: tuple[str, ...] = ()
    folder: Path = Path()


def statistics(values: Iterable[float]) -> np.ndarray:
    """STATISTICS of numbers; values that are not finite are ignored; spread is that of a sample (n - 1)."""
    known = np.array([value for value in values if np.isfinite(value)], dtype=float)
    if not len(known):
        return np.array([0.0] + [np.nan] * (len(STATISTICS) - 1))
    spread = float(known.std(ddof=1)) if len(known) > 1 else np.nan
    return np.array([len(known), known.mean(), spread, *np.quantile(known, QUANTILES), known.min(), known.max()])


# --- what a member measured --------------------------------------------------------------------------------------


def rows(path: Path) -> list[dict[str, str]]:
    """A CSV table."""
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def measured(folder: Path, data: Path) -> tuple[dict[Column, Series], Series | None, dict[str, float]]:
    """Read the tables in `folder` and the histories in `data`: measurements over time; the last profile of the surface;
    single numbers."""
    found: dict[Column, Series] = {}
    for name, keys in SERIES.items():
        if (folder / f"{name}.csv").exists():
            found |= _series(name, rows(folder / f"{name}.csv"), keys)
    if (folder / "faults.csv").exists() and not (folder / "faults_total.csv").exists():
        found |= _faults(rows(folder / "faults.csv"), moments(folder))
    for path in sorted([*data.glob("hist_*.csv"), *data.glob("history_*.csv")]):
        found |= _series(path.stem, rows(path), ())
    single: dict[str, float] = {}
    if (folder / "emission_b.csv").exists():
        single = {f"emission.{n}": number(v) for n, v in rows(folder / "emission_b.csv")[-1].items() if n in ("b", "a")}
    if (folder / "faults_summary.csv").exists():
        for row in rows(folder / "faults_summary.csv"):  # the n-th to appear in each member
            single |= {f"fault {row['fault']}.{n}": number(row[n]) for n in OF_FAULTS}
    return found, _profile(folder / "surface.csv"), single


def _series(name: str, table: list[dict[str, str]], keys: tuple[str, ...]) -> dict[Column, Series]:
    """Columns of numbers over the first of shortening, time, step that changes. Of several rows of one moment the last
    counts: what a script does between two commands changes the later ones."""
    parts: dict[str, list[dict[str, str]]] = {}
    for row in table:
        parts.setdefault(" ".join(row[key] for key in keys), []).append(row)
    found: dict[Column, Series] = {}
    for part, lines in parts.items():
        columns = {n: np.array([number(line[n]) for line in lines]) for n in lines[0] if n not in keys}
        times = {n: c for n, c in columns.items() if n.replace(" ", "") in TIMES or re.match(r"(from|to)\b", n)}
        changing = {n.split("[")[0].strip(): n for n, c in times.items() if np.isfinite(c).all() and np.ptp(c) > 0.0}
        axis = next((changing[n] for n in ("shortening", "time", "to", "step") if n in changing), "step")
        x = columns.get(axis, np.arange(len(lines), dtype=float))
        last = np.append(np.flatnonzero(np.diff(x) != 0.0), len(x) - 1)
        label = f"{name} {part}".strip()
        for n, c in columns.items():
            if n not in times and np.isfinite(c).any():
                found[label, n] = Series(axis.replace(" ", ""), x[last], c[last])
    return found


def moments(folder: Path) -> list[tuple[float, float]]:
    """Step and time [s] of the frames that were measured."""
    for name in ("layers", "surface", "wedge", "faults"):
        if (folder / f"{name}.csv").exists():
            table = rows(folder / f"{name}.csv")
            return sorted({(float(row["step"]), number(row["time[s]"])) for row in table})
    return []


FAULTS: dict[str, Callable[[dict[str, str]], bool]] = {
    "bands": lambda row: True,
    "reverse": lambda row: row["sense"] == "reverse",
    "normal": lambda row: row["sense"] == "normal",
    "verging right": lambda row: row["vergence"] == "right",
    "verging left": lambda row: row["vergence"] == "left",
}
"""Kinds of bands that are counted."""


def _faults(table: list[dict[str, str]], when: list[tuple[float, float]]) -> dict[Column, Series]:
    """Numbers of bands over time, 0 without bands, and their mean dip and length. The first frame has no
    strain."""
    when = when[1:]
    x, found = np.array([time for _, time in when]), {}
    axis = "time[s]"
    if not len(x) or np.ptp(x) == 0.0:
        axis, x = "step", np.array([step for step, _ in when])
    each = [[row for row in table if float(row["step"]) == step] for step, _ in when]
    for name, kind in FAULTS.items():
        found["faults", name] = Series(axis, x, np.array([float(sum(map(kind, part))) for part in each]))
    for name in ("dip[deg]", "length[m]", "mean_strain"):
        mean = [np.mean([number(row[name]) for row in part]) if part else np.nan for part in each]
        found["faults", name] = Series(axis, x, np.array(mean, dtype=float))
    return found if len(x) else {}


def _profile(path: Path) -> Series | None:
    """The surface of the last frame."""
    table = rows(path) if path.exists() else []
    if not table:
        return None
    last = [row for row in table if (row["step"], row["ini"]) == (table[-1]["step"], table[-1]["ini"])]
    x, y = (np.array([number(row[name]) for row in last]) for name in ("x[m]", "height[m]"))
    order = np.argsort(x)
    return Series("x[m]", x[order], y[order])


def number(word: str | None) -> float:
    """A number of a table, NaN for what is none."""
    try:
        return float(word or "nan")
    except ValueError:
        return float("nan")


# --- all members -------------------------------------------------------------------------------------------------


def band(parts: Sequence[Series]) -> Band | None:
    """Several members on the moments of the one with most of them, as far as all go; straight lines between moments.
    Moments that all have are taken as they are. None if they have no moment in common."""
    low, high = max(p.x[0] for p in parts), min(p.x[-1] for p in parts)
    x = max((p.x[(p.x >= low) & (p.x <= high)] for p in parts), key=len)
    if not len(x):
        return None
    return Band(parts[0].axis, x, np.stack([np.interp(x, p.x, p.y) for p in parts]))


def collect(members: Sequence[Member], found: Sequence[tuple[Any, Any, dict[str, float]]], folder: Path) -> Report:
    """The report of members that are done, from what each measured."""
    names = tuple(members[0].values)
    varied = tuple(n for n in names if n not in CHANCE and len({m.values[n] for m in members}) > 1)
    table: dict[str, list[Any]] = {"member": [m.name for m in members]}
    table |= {name: [m.values[name] for m in members] for name in names}
    columns = list(dict.fromkeys(column for series, _, _ in found for column in series))
    for sheet, name in columns:
        each = [series.get((sheet, name)) for series, _, _ in found]
        known = [one.y[np.isfinite(one.y)] if one is not None else np.zeros(0) for one in each]
        for word, take in (("end", lambda y: y[-1]), ("min", np.min), ("max", np.max)):
            table[f"{sheet}.{name} {word}"] = [float(take(y)) if len(y) else np.nan for y in known]
    for name in dict.fromkeys(n for _, _, single in found for n in single):
        table[name] = [single.get(name, np.nan) for _, _, single in found]
    groups = grouped(members, varied)
    bands: dict[Column, dict[tuple[Value, ...], Band]] = {}
    for column in columns:
        for group, which in groups.items():
            parts = [found[k][0][column] for k in which if column in found[k][0]]
            made = band(parts) if parts and len({p.axis for p in parts}) == 1 else None
            if made is not None:
                bands.setdefault(column, {})[group] = made
    profiles = {}
    for group, which in groups.items():
        some = [p for p in (found[k][1] for k in which) if p is not None]
        made = band(some) if some else None
        if made is not None:
            profiles[group] = made
    return Report(table["member"], table, bands, profiles, names, varied, folder)


def grouped(members: Sequence[Member], varied: Sequence[str]) -> dict[tuple[Value, ...], list[int]]:
    """Members by the values of their parameters but `CHANCE`; () are all. Groups of one member are none."""
    groups: dict[tuple[Value, ...], list[int]] = {(): list(range(len(members)))}
    for k, member in enumerate(members):
        if varied:
            groups.setdefault(tuple(member.values[name] for name in varied), []).append(k)
    return {group: which for group, which in groups.items() if len(which) > 1 or not group}


# --- tables ------------------------------------------------------------------------------------------------------

Rows = list[dict[str, Any]]


def sheets(report: Report) -> dict[str, Rows]:
    """`members`: a row per member; `bands`: per measure, group and moment; `parameters`: per measure and group;
    `correlation`: per measure and parameter."""
    measures = [c for c in report.members if c not in ("member", *report.parameters)]
    members = [{n: c[k] for n, c in report.members.items()} for k in range(len(report.names))]
    bands = []
    for (sheet, name), groups in report.bands.items():
        for group, one in groups.items():
            numbers = one.statistics
            bands += [
                {"table": sheet, "measure": name, **_group(report, group), "axis": one.axis, "at": float(at)}
                | dict(zip(STATISTICS, numbers[:, k].tolist(), strict=True))
                for k, at in enumerate(one.x)
            ]
    of_groups: dict[tuple[Value, ...], list[int]] = {(): list(range(len(report.names)))}
    for k in range(len(report.names)):
        if report.varied:
            of_groups.setdefault(tuple(report.members[n][k] for n in report.varied), []).append(k)
    parameters = [
        {"measure": name, **_group(report, group)}
        | dict(zip(STATISTICS, statistics(report.members[name][k] for k in which).tolist(), strict=True))
        for name in measures
        for group, which in of_groups.items()
    ]
    result = {"members": members, "bands": bands, "parameters": parameters}
    correlation = list(_correlations(report, measures))
    return result | ({"correlation": correlation} if correlation else {})


def _group(report: Report, group: tuple[Value, ...]) -> dict[str, Any]:
    return {name: group[k] if group else "all" for k, name in enumerate(report.varied)}


def _correlations(report: Report, measures: Sequence[str]) -> Iterable[dict[str, Any]]:
    """Spearman's rank correlation of each measure with each parameter that is a number and has three values or more,
    with the probability of one as large by chance."""
    from scipy.stats import spearmanr

    for name in report.varied:
        values = report.members[name]
        if len(set(values)) < 3 or isinstance(values[0], (str, bool)):
            continue
        x = np.array(values, dtype=float)
        for measure in measures:
            y = np.array(report.members[measure], dtype=float)
            known = np.isfinite(y)
            if known.sum() > 3 and np.ptp(y[known]) > 0.0 and np.ptp(x[known]) > 0.0:
                rank = spearmanr(x[known], y[known])
                yield {"measure": measure, "parameter": name, "members": int(known.sum()),
                       "rank_correlation": float(rank.statistic), "p": float(rank.pvalue)}  # fmt: skip


def write(folder: Path, name: str, table: Rows, kinds: Sequence[str]) -> list[Path]:
    """The table as files of these kinds, of KINDS."""
    return [KINDS[kind](folder / f"{name}.{kind}", table) for kind in kinds]


def _write_csv(path: Path, table: Rows) -> Path:
    with atomic_path(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(table[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: _word(value) for name, value in row.items()} for row in table)
    return path


def _word(value: Any) -> Any:
    if isinstance(value, float):
        return f"{value:.10g}" if np.isfinite(value) else ""
    return value


def _write_parquet(path: Path, table: Rows) -> Path:
    import pyarrow
    import pyarrow.parquet

    columns: dict[str, list[Any]] = {}
    for name in table[0]:
        values = [row[name] for row in table]
        columns[name] = [str(v) for v in values] if len({isinstance(v, str) for v in values}) > 1 else values
    with atomic_path(path) as temporary:
        pyarrow.parquet.write_table(pyarrow.table(columns), temporary)
    return path


KINDS: dict[str, Callable[[Path, Rows], Path]] = {"csv": _write_csv, "parquet": _write_parquet}


def check(kinds: Sequence[str]) -> None:
    """UsageError for a kind of file that cannot be written here."""
    for kind in kinds:
        if kind not in KINDS:
            raise UsageError(f"--tables {kind}: expected {' or '.join(KINDS)}")
    if "parquet" in kinds and importlib.util.find_spec("pyarrow") is None:
        raise HpcdemError("--tables parquet: pyarrow is not installed: pip install pyarrow")

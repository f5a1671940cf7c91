"""Curves of what a run has recorded: histories over time or over each other, and the charts that its script wrote."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core import units
from hpcdem.core.deprecated import present_history
from hpcdem.core.errors import HpcdemError
from hpcdem.post.view import filter

POINTS = 2000
"""Largest number of points of a curve sent to the page, including its extrema."""
MOST = 12
"""Largest number of curves of a chart."""
LONGEST = 500
"""Largest number of characters of a title and an expression."""
OWN = {"time": "s", "step": ""}
"""Columns of every history, and their units."""
_TITLE = re.compile(r"(.*?)\s*\[([^\]]*)\]\s*")
_QUOTED = re.compile(r"'([^']*)'|\"([^\"]*)\"")
_NAMED = re.compile(r"([^='\"<>!]*)=(?!=)(.+)", re.DOTALL)


@dataclass(frozen=True)
class Record:
    """A history. name: as the script says; title: what it follows; unit: of its values."""

    path: Path
    name: str
    title: str
    unit: str

    @property
    def label(self) -> str:
        """Return the name of the record in charts; numbered histories of particles show their title instead."""
        return self.title if self.name.isdigit() else self.name


class Curves:
    """Read histories, tables and charts of a results folder for the page."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._heads: dict[Path, tuple[int, list[str]]] = {}
        """Size of a file, and its titles."""
        self._read: dict[Path, tuple[int, bytes, np.ndarray]] = {}
        """Bytes of a history that were read, the last line of them, and what they say."""

    def records(self) -> list[Record]:
        """The histories that are there, by name."""
        found = []
        for path in self.folder.glob("hist*_*.csv"):
            name = re.fullmatch(r"(?:history|hist)_(.+)\.csv", path.name)
            head = self._head(path)
            if name and len(head) == 3 and head[0] == "step":
                title, unit = _parted(head[2])
                found.append(Record(path, name[1], title.replace("_", " "), unit))
        return sorted(found, key=lambda record: record.name)

    def charts(self) -> list[str]:
        """Names of the charts that the script wrote as CSV."""
        heads = {path.name: self._head(path) for path in self.folder.glob("*.csv")}
        return sorted(name for name, head in heads.items() if head[:1] == ["curve"] and len(head) == 3)

    def state(self) -> dict[str, Any]:
        """List the records and charts that can be drawn."""
        return {"records": [[one.name, one.title, one.label] for one in self.records()], "charts": self.charts()}

    def presets(self) -> list[dict[str, Any]]:
        """Charts of the script, and what a laboratory draws: stress over strain first, load over shortening last.

        chart: as `chart` takes it; x and y: as `drawn` does."""
        records = self.records()

        def of(word: str) -> list[Record]:
            return [one for one in records if word in f"{one.name} {one.title}".lower()]

        found: list[dict[str, Any]] = []
        strains = of("strain")
        stresses = [one for one in of("stress") if one not in strains]
        for strain in strains[:1]:
            along = [one for one in stresses if one.title[:1] == strain.title[:1]] or stresses
            if along:
                found.append(
                    {"kind": "stress_strain", "x": _quoted(strain), "y": [_quoted(one) for one in along[:MOST]]}
                )
        for name in self.charts():
            _, across, up = (title.lower() for title in self._head(self.folder / name))
            kind = "stress_strain" if "strain" in across and "stress" in up else "of_script"
            found.append({"kind": kind, "chart": name})
        found.sort(key=lambda one: one["kind"] != "stress_strain")
        for axis in "xyz":
            displacements, loads = (
                [one for one in records if one.title == f"{word} {axis}"] for word in ("displacement", "reaction")
            )
            if not (displacements and loads):
                continue
            if (
                len(displacements) == len(loads) == 2
            ):  # two ends that approach each other: their distance, the mean load
                x = self._positive(displacements, "{0} - {1}", "shortening")
                y = [self._positive(loads, "({0} - {1}) / 2", "load")]
            else:
                x, y = _quoted(displacements[0]), [*map(_quoted, loads[:MOST])]
            found.append({"kind": "load_displacement", "x": x, "y": y})
        return found

    def _positive(self, two: Sequence[Record], form: str, name: str) -> str:
        """A difference of both that ends above 0."""
        text = form.format(*map(_quoted, two))
        values = self._values(text, {one.name: one for one in two})[1]
        ended = values[np.isfinite(values)][-1:]
        if len(ended) and ended[0] < 0.0:
            text = form.format(*map(_quoted, reversed(two)))
        return f"{name} [{two[0].unit}] = {text}"

    def drawn(self, x: Any, y: Any, whole: bool = False) -> dict[str, Any]:
        """Curves y over x, each `time`, `step`, the name of a history, or what is computed of some, with their names in
        quotes: `'above' - 'below'`, also with a title and a unit before it, `load [N/m] = ...`. whole: all points.
        HpcdemError."""
        if not isinstance(x, str) or not isinstance(y, list) or not all(isinstance(one, str) for one in y):
            raise HpcdemError("a chart needs an x and a list of y")
        if any(len(one) > LONGEST for one in (x, *y)):
            raise HpcdemError(f"a column has at most {LONGEST} characters")
        if not 1 <= len(y) <= MOST:
            raise HpcdemError(f"a chart has 1 to {MOST} curves, not {len(y)}")
        records = {record.name: record for record in self.records()}
        x, *y = (_present(text, records) for text in (x, *y))
        x_title, x_unit, x_text = self._asked(x, records)
        curves = []
        for one in y:
            title, unit, text = self._asked(one, records)
            used = _used(x_text, records) | _used(text, records)
            if not used:
                raise HpcdemError(f"{one or 'y'}: expected a history, such as {_some(records)}")
            steps, along = self._values(x_text, used)
            curves.append((title, unit, steps, along, self._values(text, used)[1]))
        return _answer((x_title, x_unit), curves, whole)

    def chart(self, name: Any, whole: bool = False) -> dict[str, Any]:
        """A chart of the script, as it was written last. HpcdemError."""
        if name not in self.charts():
            raise HpcdemError("there is no such chart")
        rows: dict[str, list[tuple[float, float]]] = {}
        try:
            with open(self.folder / name, encoding="utf-8", newline="") as file:
                head = next(file_rows := csv.reader(file))
                for label, x, y in file_rows:
                    rows.setdefault(label, []).append((float(x), float(y)))
        except (OSError, ValueError, StopIteration) as problem:
            raise HpcdemError(f"cannot read {name}: {problem}") from None
        (x_title, x_unit), (y_title, y_unit) = (_parted(text, "([") for text in head[1:])
        curves = []
        for label, points in rows.items():
            values = np.array(points).T
            curves.append((label if len(rows) > 1 else y_title, y_unit, np.full(values.shape[1], -1), *values))
        answer = _answer((x_title, x_unit), curves, whole)
        return answer | {"y_title": y_title}

    # ---- columns ---------------------------------------------------------------------------------------------------

    def _asked(self, text: str, records: dict[str, Record]) -> tuple[str, str, str]:
        """Title, unit and expression of a requested column."""
        text = text.strip()
        if text in OWN and text not in records:
            return text, OWN[text], text
        name = text.strip("'\"")
        if name in records:
            return records[name].label, records[name].unit, _quoted(records[name])
        if found := _NAMED.fullmatch(text):
            title, unit = _parted(found[1].strip())
            return title, unit, found[2].strip()
        return text, "", text

    def _values(self, text: str, used: dict[str, Record]) -> tuple[np.ndarray, np.ndarray]:
        """Steps that all histories used have, and the value of an expression there."""
        tables = {name: self._table(record) for name, record in used.items()}
        steps: np.ndarray | None = None
        for table in tables.values():
            steps = table[:, 0] if steps is None else np.intersect1d(steps, table[:, 0], assume_unique=False)
        assert steps is not None
        fields: dict[str, np.ndarray] = {"step": steps}
        names = {}
        for k, (name, table) in enumerate(tables.items()):
            places = np.searchsorted(table[:, 0], steps)
            names[name] = f"history_{k}"
            fields[names[name]] = table[places, 2]
            fields["time"] = table[places, 1]
        plain = _QUOTED.sub(lambda found: names.get(found[1] or found[2], "nothing"), text)
        return steps.astype(int), np.broadcast_to(filter.amount(plain, fields, text), steps.shape)

    def _table(self, record: Record) -> np.ndarray:
        """(n, 3): step, time, value, in the order of steps; an incomplete last line is ignored, and only what is
        new is read. HpcdemError."""
        known, last, rows = self._read.get(record.path, (0, b"", np.zeros((0, 3))))
        try:
            with open(record.path, "rb") as file:
                file.seek(known - len(last))
                if not known or file.read(len(last)) != last:  # another file of this name
                    known, rows = 0, np.zeros((0, 3))
                    file.seek(0)
                    known += len(file.readline())
                text = file.read()
            text = text[: text.rfind(b"\n") + 1]
            if text:
                new = np.loadtxt(text.decode().splitlines(), delimiter=",", ndmin=2)
                rows = np.concatenate([rows, new])
                rows = rows[np.unique(rows[:, 0], return_index=True)[1]]
                self._read[record.path] = known + len(text), text.splitlines(keepends=True)[-1], rows
        except (OSError, ValueError) as problem:
            raise HpcdemError(f"cannot read {record.path.name}: {problem}") from None
        return rows

    def _head(self, path: Path) -> list[str]:
        """Titles of the columns of a file; none if it cannot be read. A file that grows keeps them."""
        try:
            size = path.stat().st_size
            if path not in self._heads or size < self._heads[path][0]:
                with open(path, encoding="utf-8") as file:
                    line = file.readline(4096)
                if not line.endswith("\n"):
                    return []
                self._heads[path] = size, next(csv.reader([line.strip()]), [])
        except (OSError, UnicodeDecodeError, csv.Error):
            return []
        self._heads[path] = size, self._heads[path][1]
        return self._heads[path][1]


def as_csv(answer: dict[str, Any]) -> str:
    """Write the drawn curves as CSV with columns curve, x, y, like the charts of scripts."""

    def cell(text: str) -> str:
        return f'"{text}"'.replace('"', '""')[1:-1] if set(text) & set(',"\n') else text

    def titled(part: dict[str, Any]) -> str:
        return f"{part['title']} [{part['unit']}]" if part["unit"] else part["title"]

    lines = [f"curve,{cell(titled(answer['x']))},{cell(answer.get('y_title') or 'y')}"]
    for curve in answer["curves"]:
        label = cell(titled(curve))
        lines += [f"{label},{_word(x)},{_word(y)}" for x, y in zip(curve["x"], curve["y"], strict=True)]
    return "\n".join(lines) + "\n"


def _word(value: float | None) -> str:
    return "" if value is None else repr(value)


def _quoted(record: Record) -> str:
    return f"'{record.name}'" if "'" not in record.name else f'"{record.name}"'


def _present(text: str, records: dict[str, Record]) -> str:
    """An expression with the present names of histories of ready-made models."""
    return _QUOTED.sub(lambda found: found[0][0] + present_history(found[0][1:-1], records) + found[0][-1], text)


def _used(text: str, records: dict[str, Record]) -> dict[str, Record]:
    """The histories named in an expression. HpcdemError for an unknown one."""
    used = {}
    for found in _QUOTED.finditer(text):
        name = found[1] or found[2] or ""
        if name not in records:
            raise HpcdemError(f"there is no history '{name}'; known: {_some(records)}")
        used[name] = records[name]
    return used


def _some(records: dict[str, Record]) -> str:
    return ", ".join(f"'{name}'" for name in list(records)[:8]) or "none so far"


def _parted(title: str, brackets: str = "[") -> tuple[str, str]:
    """The words and the unit of a title such as `reaction_y [N/m]`."""
    if "(" in brackets and title.endswith(")") and "[" not in title:
        title = re.sub(r"\(([^()]*)\)$", r"[\1]", title)
    found = _TITLE.fullmatch(title)
    return (found[1], "" if found[2] == "1" else found[2]) if found else (title, "")


def _answer(x: tuple[str, str], curves: list[tuple], whole: bool) -> dict[str, Any]:
    """Assemble the answer for the page. size, shown: divisor of the displayed values, and their unit."""

    def part(title: str, unit: str, columns: list[np.ndarray]) -> dict[str, Any]:
        largest = max((float(np.abs(c[np.isfinite(c)]).max(initial=0.0)) for c in columns), default=0.0)
        size, shown = units.scale(largest, unit) if unit not in ("", "%") else (1.0, unit)
        return {"title": title, "unit": unit, "size": size, "shown": shown}

    by_unit: dict[str, list[np.ndarray]] = {}
    for _, unit, _, _, values in curves:
        by_unit.setdefault(unit, []).append(values)
    described = []
    for title, unit, steps, along, values in curves:
        rows = np.arange(len(steps)) if whole else _some_of(values)
        described.append(part(title, unit, by_unit[unit]) | {
            "x": _list(along[rows]), "y": _list(values[rows]), "step": steps[rows].tolist(),
        })  # fmt: skip
    return {"x": part(*x, [curve[3] for curve in curves]), "curves": described}


def _list(values: np.ndarray) -> list[float | None]:
    return [value if np.isfinite(value) else None for value in values.tolist()]


def _some_of(values: np.ndarray) -> np.ndarray:
    """Rows that look like all of them: of each stretch the first, the last, the lowest and the highest."""
    count = len(values)
    if count <= POINTS:
        return np.arange(count)
    edges = np.linspace(0, count, POINTS // 4 + 1).astype(int)
    low, high = np.where(np.isfinite(values), values, np.inf), np.where(np.isfinite(values), values, -np.inf)
    rows = [edges[:-1], edges[1:] - 1]
    for first, last in pairwise(edges):
        rows.append(first + np.array([low[first:last].argmin(), high[first:last].argmax()]))
    return np.unique(np.concatenate(rows))


__all__ = ["Curves", "Record", "as_csv"]

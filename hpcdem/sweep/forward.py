"""Specimen tests as the forward model of a calibration: a sweep of each script, and numbers from its histories."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.lang import parameters
from hpcdem.lang.parameters import Adjustable
from hpcdem.sweep import design, driver, tables
from hpcdem.sweep import plan as plans
from hpcdem.sweep.calibration import Target
from hpcdem.sweep.design import Range

OF = ("max", "min", "end", "mean", "slope")
"""Values that can be taken from a history: a value of y, or the slope of y over x while y is within a fraction of its
maximum."""
_NUMBER = "a number", lambda v: isinstance(v, int | float) and not isinstance(v, bool)
_WHOLE = "a whole number above 0", lambda v: _whole(v) and v > 0
_NATURAL = "a whole number from 0 on", lambda v: _whole(v) and v >= 0
_TEXT = "a text", lambda v: isinstance(v, str)
_TEXTS = "a list of texts", lambda v: isinstance(v, list) and all(isinstance(one, str) for one in v)
_TABLE = "a table", lambda v: isinstance(v, dict)
_TABLES = "tables in double brackets", lambda v: isinstance(v, list) and all(isinstance(one, dict) for one in v)
_SEEDS = (
    "a list of different whole numbers",
    lambda v: isinstance(v, list) and all(map(_whole, v)) and len({*v}) == len(v),
)
_PART = "two numbers", lambda v: isinstance(v, list) and len(v) == 2 and all(map(_NUMBER[1], v))
_KEYS: dict[str, dict[str, tuple[str, Callable[[Any], bool]]]] = {
    "": {"test": _TABLES, "parameters": _TABLE, "search": _TABLE, "write": _TABLE},
    "test": {
        "script": _TEXT, "seeds": _SEEDS, "ranks": _WHOLE, "threads": _WHOLE, "with": _TEXTS, "target": _TABLES,
    },
    "target": {
        "name": _TEXT, "history": _TEXT, "y": _TEXT, "x": _TEXT, "of": _TEXT, "part": _PART, "value": _NUMBER,
        "tolerance": _NUMBER, "log": ("true or false", lambda v: isinstance(v, bool)),
    },
    "search": {"first": _WHOLE, "rounds": _NATURAL, "batch": _WHOLE, "seed": _NATURAL},
    "write": {"lines": _TEXTS},
}  # fmt: skip
"""Keys of each table, and what their values are."""


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


@dataclass(frozen=True)
class Measured:
    """A target and how it is read from a history of a run. log: compared by its logarithm."""

    target: Target
    history: str
    y: str
    x: str = ""
    of: str = "max"
    part: tuple[float, float] = (0.1, 0.5)
    log: bool = True

    def read(self, data: Path) -> float:
        """The number of a run that is done, NaN where it has none. UsageError without the history."""
        try:
            rows = tables.rows(data / f"{self.history}.csv")
        except FileNotFoundError:
            known = ", ".join(sorted(path.stem for path in data.glob("*.csv"))) or "no tables"
            raise UsageError(f"target {self.target.name}: {data} has no {self.history}.csv ({known})") from None
        if not rows or self.y not in rows[0] or (self.x and self.x not in rows[0]):
            known = ", ".join(rows[0]) if rows else "no rows"
            raise UsageError(f"{data / self.history}.csv has no column '{self.x or self.y}' or '{self.y}' ({known})")
        number = self._number(
            np.array([tables.number(row[self.y]) for row in rows]),
            np.array([tables.number(row[self.x]) for row in rows]) if self.x else np.zeros(0),
        )
        if not self.log:
            return number
        return float(np.log(number)) if number > 0.0 else float("nan")

    def _number(self, y: np.ndarray, x: np.ndarray) -> float:
        if not (np.isfinite(y).all() and np.isfinite(x).all()):
            return float("nan")
        if self.of == "slope":
            top = int(np.argmax(y))
            low, high = (share * y[top] for share in self.part)
            chosen = np.flatnonzero((y[: top + 1] >= low) & (y[: top + 1] <= high))
            if len(chosen) < 2 or np.ptp(x[chosen]) == 0.0:
                return float("nan")
            return float(np.polyfit(x[chosen], y[chosen], 1)[0])
        return float({"max": y.max(), "min": y.min(), "end": y[-1], "mean": y.mean()}[self.of])


@dataclass(frozen=True)
class Test:
    """A script with its seeds and what is measured in it."""

    script: Adjustable
    seeds: tuple[int, ...]
    measured: tuple[Measured, ...]
    ranks: int = 1
    threads: int = 1
    links: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Settings:
    """A calibration as its file has it."""

    path: Path
    tests: tuple[Test, ...]
    ranges: dict[str, Range]
    search: dict[str, int] = field(default_factory=dict)
    lines: tuple[str, ...] = ()

    @property
    def targets(self) -> tuple[Target, ...]:
        """Return the targets of all tests, in order."""
        return tuple(one.target for test in self.tests for one in test.measured)


def read_settings(path: Path) -> Settings:
    """A file of settings. UsageError or ScriptError for what cannot be, before anything runs."""
    try:
        given = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as problem:
        raise UsageError(f"{path}: cannot read the settings: {problem.strerror or problem}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as problem:
        raise UsageError(f"{path}: {problem}") from None
    _known(path, "", given)
    for name in ("test", "parameters"):
        if not given.get(name):
            raise UsageError(f"{path}: {'[[test]]' if name == 'test' else '[parameters]'} is missing")
    _known(path, "search", given.get("search", {}))
    _known(path, "write", given.get("write", {}))
    tests = tuple(_test(path, one) for one in given["test"])
    names = [one.name for test in tests for one in (m.target for m in test.measured)]
    if len(set(names)) < len(names):
        raise UsageError(f"{path}: two targets have the same name")
    ranges = {name: _range(path, tests, name, words) for name, words in given["parameters"].items()}
    if "seed" in ranges and any(test.seeds for test in tests):
        raise UsageError(f"{path}: seed is a parameter with a range and has seeds: omit one of them")
    lines = tuple(given.get("write", {}).get("lines", ()))
    for line in lines:
        try:
            line.format(**{name: 1 if r.whole else 1.0 for name, r in ranges.items()})
        except (KeyError, ValueError, IndexError, AttributeError) as problem:
            raise UsageError(f"{path}: write line '{line}': {problem}; parameters are {', '.join(ranges)}") from None
    return Settings(path, tests, ranges, given.get("search", {}), lines)


def _known(path: Path, table: str, given: Mapping[str, Any]) -> None:
    for key, value in given.items():
        if key not in _KEYS[table]:
            raise UsageError(f"{path}: unknown key '{key}'; known: {', '.join(sorted(_KEYS[table]))}")
        expected, fits = _KEYS[table][key]
        if not fits(value):
            raise UsageError(f"{path}: {table + '.' if table else ''}{key} = {repr(value)[:40]}: expected {expected}")


def _test(path: Path, given: Mapping[str, Any]) -> Test:
    _known(path, "test", given)
    if not given.get("target"):
        raise UsageError(f"{path}: a [[test]] has no [[test.target]]")
    file = path.parent / str(given.get("script", ""))
    try:
        script = parameters.read(file.read_bytes(), str(file))
    except OSError as problem:
        raise UsageError(f"{path}: script {file}: {problem.strerror}") from None
    seeds = tuple(given.get("seeds", ()))
    if seeds:
        script.parameter("seed")
    links = tuple(path.parent / name for name in given.get("with", ()))
    measured = tuple(_measured(path, one) for one in given["target"])
    return Test(script, seeds, measured, given.get("ranks", 1), given.get("threads", 1), links)


def _measured(path: Path, given: Mapping[str, Any]) -> Measured:
    _known(path, "target", given)
    for key in ("name", "history", "y", "value", "tolerance"):
        if key not in given:
            raise UsageError(f"{path}: a [[test.target]] has no {key}")
    name, of, value, tolerance = given["name"], given.get("of", "max"), given["value"], given["tolerance"]
    if of not in OF:
        raise UsageError(f"{path}: target {name}: of = '{of}': expected {', '.join(OF)}")
    if of == "slope" and "x" not in given:
        raise UsageError(f"{path}: target {name}: a slope needs x")
    log = bool(given.get("log", value > 0.0))
    if log and not value > 0.0:
        raise UsageError(f"{path}: target {name}: a logarithm needs a value above 0; give log = false")
    target = Target(name, float(np.log(value)), tolerance / value) if log else Target(name, float(value), tolerance)
    part = tuple(map(float, given.get("part", (0.1, 0.5))))
    if not 0.0 <= part[0] < part[1] <= 1.0:
        raise UsageError(f"{path}: target {name}: part = {part}: two shares of the maximum, rising, are needed")
    return Measured(target, given["history"], given["y"], given.get("x", ""), of, (part[0], part[1]), log)


def _range(path: Path, tests: Sequence[Test], name: str, words: Any) -> Range:
    using = [test.script for test in tests if name in test.script.parameters]
    if not using:
        tests[0].script.parameter(name)
    if not isinstance(words, str):
        raise UsageError(f"{path}: parameter {name} = {words!r}: expected 'LOW:HIGH' or 'LOW:HIGH:log'")
    found = design.choice(using[0], name, words, True)
    if not isinstance(found, Range):
        raise UsageError(f"{path}: parameter {name} = '{words}': expected LOW:HIGH or LOW:HIGH:log")
    return found


class Forward:
    """Runs of the tests at points; those that are done already, by this or an earlier call, are only read."""

    def __init__(self, settings: Settings, folder: Path, log: Any, jobs: int | None = None, tries: int = 2) -> None:
        self.settings, self.folder, self.log, self.jobs, self.tries = settings, folder, log, jobs, tries
        self._failed: dict[Path, set[str]] = {}

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """(n, seeds, targets) at points (n, d)."""
        most = max(max(len(test.seeds), 1) for test in self.settings.tests)
        found = np.full((len(points), most, len(self.settings.targets)), np.nan)
        first = 0
        for k, test in enumerate(self.settings.tests):
            part = self._of_test(test, self.folder / f"test_{k + 1}", points)
            found[:, : part.shape[1], first : first + part.shape[2]] = part
            first += part.shape[2]
        return found

    def _of_test(self, test: Test, folder: Path, points: np.ndarray) -> np.ndarray:
        from hpcdem.sweep.report import data_folder

        seeds = [{"seed": seed} for seed in test.seeds] or [{}]
        values = [
            {name: r.at(min(float(u), 1.0 - 1e-12)) for (name, r), u in zip(self.settings.ranges.items(), point)
             if name in test.script.parameters} | seed
            for point in points for seed in seeds
        ]  # fmt: skip
        for one in values:
            test.script.with_values(one)
        once = [one for k, one in enumerate(values) if one not in values[:k]]  # of whole numbers some are the same
        plan, new = plans.make(folder, test.script, once, {}, None, test.ranks, test.threads, test.links)
        if new:
            self.log.info(f"{folder}: {new} new members, {len(plan.values)} in all")
        failed_before = self._failed.setdefault(folder, set())
        states = driver.run(plan, self.log, self.jobs, self.tries, failed_before)
        failed_before.update(name for name, state in states.items() if state == plans.FAILED)
        if plans.STOPPED in states.values() or plans.WAITING in states.values():
            raise HpcdemError(f"{folder}: stopped; repeat the command to continue")
        by_values = {tuple(sorted(member.values.items())): member for member in plan.members}
        found = []
        for one in values:
            member = by_values[tuple(sorted(one.items()))]
            done = member.state == plans.DONE
            found.append([m.read(data_folder(member)) if done else float("nan") for m in test.measured])
        failed = sum(by_values[tuple(sorted(one.items()))].state == plans.FAILED for one in values)
        if failed:
            self.log.warn(f"{folder}: {failed} of these {len(values)} members failed and are treated as missing values")
        return np.array(found).reshape(len(points), len(seeds), len(test.measured))

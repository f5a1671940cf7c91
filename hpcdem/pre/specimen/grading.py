"""Grading curves: sizes [mm] and the per cent of mass that is finer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError, ScriptError

MOST_SIZES = 1000
"""Largest number of rows of a grading; a laboratory has a few dozen sieves."""
SMALLEST, LARGEST = 1e-6, 1e9
"""Smallest and largest admissible size of a grain [mm]: from a nanometre to a thousand kilometres."""


@dataclass(frozen=True)
class Grading:
    """sizes (m,) f8 [mm], falling; percent (m,) f8: mass finer than that size, 100 at the first.

    Class k holds the grains from size k + 1 (the last one: from 0) up to size k; all of them count as of size k.
    """

    sizes: np.ndarray
    percent: np.ndarray

    @property
    def fractions(self) -> np.ndarray:
        """(m,) f8: share of the mass in each class, together 1."""
        return (self.percent - np.append(self.percent[1:], 0.0)) / 100.0

    @property
    def uniformity(self) -> float:
        """Cu = d60 / d10; NaN if the curve does not reach down to 10 %."""
        return self.size_at(60.0) / self.size_at(10.0)

    @property
    def curvature(self) -> float:
        """Cc = d30^2 / (d10 d60); NaN if the curve does not reach down to 10 %."""
        return self.size_at(30.0) ** 2 / (self.size_at(10.0) * self.size_at(60.0))

    def size_at(self, percent: float) -> float:
        """The size [mm] below which this per cent lies, straight lines in log size between the rows; not a number
        outside the curve."""
        rising = self.percent[::-1]
        if not rising[0] <= percent <= rising[-1]:
            return math.nan
        return float(np.exp(np.interp(percent, rising, np.log(self.sizes[::-1]))))


def grading(sizes: Sequence[float], percents: Sequence[float]) -> Grading:
    """A grading from rows in falling or rising order. Raises CommandError."""
    if len(sizes) != len(percents):
        raise CommandError(f"grading: {len(sizes)} sizes and {len(percents)} percentages, expected equal numbers")
    where, text = fault(sizes, percents)
    if text:
        raise CommandError(f"grading, row {where + 1}: {text}" if where >= 0 else f"grading: {text}")
    return _falling(sizes, percents)


def read_grading(path: Path | str) -> Grading:
    """Read a file of rows `size percent-finer` [mm, %]. Raises HpcdemError, with the line."""
    try:
        with open(path, "rb") as file:
            text = file.read(1 << 22).decode("utf-8-sig", errors="replace")
    except OSError as problem:
        raise HpcdemError(f"cannot read {path}: {problem.strerror}") from None
    return parse_grading(text, str(path))


def parse_grading(text: str, name: str = "grading") -> Grading:
    """A grading from rows `size percent-finer`; what follows # and empty lines are skipped. Raises ScriptError."""
    sizes: list[float] = []
    percents: list[float] = []
    lines: list[int] = []
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split("#")[0].split()
        if not words:
            continue
        values = [_number(word) for word in words]
        if len(words) != 2 or None in values:
            raise ScriptError(name, number, f"read '{_shown(line)}', expected a size in mm and the per cent finer")
        sizes.append(values[0])  # type: ignore[arg-type]
        percents.append(values[1])  # type: ignore[arg-type]
        lines.append(number)
        if len(lines) > MOST_SIZES:
            raise ScriptError(name, number, f"more than {MOST_SIZES} rows, expected a grading curve")
    where, message = fault(sizes, percents)
    if message:
        raise ScriptError(name, lines[where] if where >= 0 else max(len(text.splitlines()), 1), message)
    return _falling(sizes, percents)


def fault(sizes: Sequence[float], percents: Sequence[float]) -> tuple[int, str]:
    """The first row (-1: all of it) that cannot be in a grading, and why; an empty text without one."""
    if not len(sizes):
        return -1, "contains no rows, expected sizes in mm and per cent finer"
    if len(sizes) > MOST_SIZES:
        return -1, f"has {len(sizes)} rows, at most {MOST_SIZES}"
    for k, (size, percent) in enumerate(zip(sizes, percents)):
        if not (math.isfinite(size) and size > 0.0):
            return k, f"size {size:g} mm, expected a number above 0"
        if not SMALLEST <= size <= LARGEST:
            return k, f"size {size:g} mm, expected {SMALLEST:g} to {LARGEST:g}"
        if not 0.0 <= percent <= 100.0:
            return k, f"{percent:g} % finer, expected 0 to 100"
    falling = len(sizes) < 2 or sizes[1] < sizes[0]
    for k in range(1, len(sizes)):
        if sizes[k] == sizes[k - 1] or (sizes[k] < sizes[k - 1]) != falling:
            order = "falling" if falling else "rising"
            return k, f"size {sizes[k]:g} mm after {sizes[k - 1]:g} mm, expected {order} sizes as in the rows before"
        if percents[k] != percents[k - 1] and (percents[k] < percents[k - 1]) != falling:
            return k, (
                f"{percents[k]:g} % finer than {sizes[k]:g} mm, but {percents[k - 1]:g} % finer than {sizes[k - 1]:g} "
                "mm, expected no more below the smaller size"
            )
    largest = 0 if falling else len(sizes) - 1
    if percents[largest] != 100.0:
        return largest, f"{percents[largest]:g} % finer than the largest size {sizes[largest]:g} mm, expected 100"
    return -1, ""


def _falling(sizes: Sequence[float], percents: Sequence[float]) -> Grading:
    d, p = np.array(sizes, np.float64), np.array(percents, np.float64)
    order = np.argsort(-d)
    return Grading(d[order], p[order])


def _number(word: str) -> float | None:
    try:
        return float(word) if "_" not in word else None
    except ValueError:
        return None


def _shown(line: str) -> str:
    return "".join(c if c.isprintable() else " " for c in line.strip()[:60])

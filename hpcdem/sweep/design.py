"""Convert `friction=0.2,0.3` and `1:10` to the values of each member: grids, Latin hypercubes, Sobol sequences."""

from __future__ import annotations

import inspect
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import UsageError
from hpcdem.lang.parameters import Adjustable, Value

MOST = 100_000
"""Largest number of members of a sweep; more are a typing mistake."""


@dataclass(frozen=True)
class Range:
    """low to high, both included; log: even in the logarithm; whole: whole numbers only."""

    low: float
    high: float
    log: bool = False
    whole: bool = False

    def at(self, u: float) -> Value:
        """The value at u in [0, 1), with six digits."""
        if self.whole:
            return int(self.low) + math.floor(u * (self.high - self.low + 1))
        if self.log:
            return float(f"{self.low * (self.high / self.low) ** u:.6g}")
        return float(f"{self.low + (self.high - self.low) * u:.6g}")


@dataclass(frozen=True)
class Sampling:
    """Sampling of ranges. method: "latin" or "sobol"; seed: of the sampling itself."""

    method: str
    number: int
    seed: int = 0

    def points(self, dimensions: int) -> np.ndarray:
        """(number, dimensions) in [0, 1): McKay et al. 1979, Technometrics 21; Sobol, scrambled (Owen 1998)."""
        from scipy.stats import qmc

        kind = qmc.LatinHypercube if self.method == "latin" else qmc.Sobol
        word = "rng" if "rng" in inspect.signature(kind).parameters else "seed"  # renamed in SciPy 1.15
        return kind(dimensions, **{word: np.random.default_rng(self.seed)}).random(self.number)


def members(
    script: Adjustable, wanted: Mapping[str, str | Sequence[object]], sampling: Sampling | None = None
) -> list[dict[str, Value]]:
    """The values of each member. wanted: by parameter, words as on the command line, or a list of values. Lists are
    crossed with each other, in the order given, and with the samples of ranges. UsageError for what cannot be."""
    if not wanted:
        raise UsageError("no parameter is varied: give --seed or --set NAME=VALUES")
    choices: dict[str, list[Value] | Range] = {}
    for name, words in wanted.items():
        choices[name] = choice(script, name, words, sampling is not None and name != "seed")
    lists = {name: values for name, values in choices.items() if isinstance(values, list)}
    ranges = {name: values for name, values in choices.items() if isinstance(values, Range)}
    number = math.prod(map(len, lists.values())) * (1 if sampling is None else sampling.number)
    if number > MOST:
        raise UsageError(f"{number} members, at most {MOST} allowed")
    samples: list[dict[str, Value]] = [{}]
    if sampling is not None:
        if not ranges:
            raise UsageError(f"--{sampling.method}: no parameter has a range LOW:HIGH to sample")
        if sampling.method == "sobol" and sampling.number & (sampling.number - 1):
            near = 2 ** round(math.log2(sampling.number))
            raise UsageError(
                f"--sobol {sampling.number}: a Sobol sequence is uniform only for powers of two, such as {near}"
            )
        points = sampling.points(len(ranges))
        samples = [{n: r.at(u) for (n, r), u in zip(ranges.items(), point.tolist(), strict=True)} for point in points]
    crossed = [dict(zip(lists, values, strict=True)) for values in itertools.product(*lists.values())]
    found = [{name: (one | other)[name] for name in wanted} for one in samples for other in crossed]
    for values in found:
        script.with_values(values)  # ScriptError before anything runs
    return found


def choice(script: Adjustable, name: str, words: str | Sequence[object], sampled: bool) -> list[Value] | Range:
    """The specification of one parameter."""
    script.parameter(name)
    if not isinstance(words, str):
        values = [script.value(name, str(word)) for word in words]
        return _different(name, values)
    parts = words.split(":")
    if len(parts) == 1 or isinstance(script.parameters[name].value, str):
        return _different(name, [script.value(name, word.strip()) for word in words.split(",") if word.strip()])
    if len(parts) > 3:
        raise UsageError(f"{name}={words}: expected LOW:HIGH or LOW:HIGH:N")
    low, high = (_number(script, name, words, part) for part in parts[:2])
    if not low < high:
        raise UsageError(f"{name}={words}: {low:g} is not below {high:g}")
    if len(parts) == 2:
        whole = low.is_integer() and high.is_integer()
        if sampled:
            return Range(low, high, whole=whole and isinstance(script.parameters[name].value, int))
        return _whole_numbers(f"{name}={words}", words, low, high)
    if parts[2] == "log":
        if not sampled:
            raise UsageError(f"{name}={words}: log requires --latin N or --sobol N")
        if low <= 0.0:
            raise UsageError(f"{name}={words}: the logarithm requires numbers above 0")
        return Range(low, high, log=True)
    if not parts[2].isdigit() or not 2 <= int(parts[2]) <= MOST:
        raise UsageError(f"{name}={words}: expected log or a number of values, at least 2, not '{parts[2]}'")
    even = (float(f"{value:.12g}") for value in np.linspace(low, high, int(parts[2])).tolist())
    return _different(name, [script.value(name, f"{value!r}") for value in even])


def _whole_numbers(given: str, words: str, low: float, high: float) -> list[Value]:
    """List the whole numbers from low to high."""
    if not (low.is_integer() and high.is_integer()):
        raise UsageError(
            f"{given}: without sampling, a range consists of whole numbers. Give the number of values, such as "
            f"{words}:5, or use --latin N or --sobol N"
        )
    if high - low >= MOST:
        raise UsageError(f"{given}: more than {MOST} values")
    return [int(low) + k for k in range(int(high - low) + 1)]


def _number(script: Adjustable, name: str, words: str, part: str) -> float:
    value = script.value(name, part)
    if isinstance(value, (bool, str)):
        raise UsageError(f"{name}={words}: {name} is {script.parameters[name].value!r} in the script and has no ranges")
    return float(value)


def _different(name: str, values: list[Value]) -> list[Value]:
    if not values:
        raise UsageError(f"{name}: no value given")
    for value in values:
        if values.count(value) > 1:
            raise UsageError(f"{name}: {value} is given twice")
    return values

"""Parameters of bonds, contacts and joints from measured properties: which values fit, how sure they are.

Runs at points of the parameters, each with several seeds; an emulator of each measured number between them; more runs
where the parameters are probable and the emulators least sure; the posterior of the parameters under flat priors and
normal tolerances.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.sweep.design import Range, Sampling
from hpcdem.sweep.emulator import Emulator, fit

Forward = Callable[[np.ndarray], np.ndarray]
"""(n, seeds, targets) numbers at points (n, d) in the unit cube; NaN where a run failed."""
VAGUE = 0.7
"""Width of a posterior over that of its prior above which the targets do not determine the parameter."""
TIED = 0.8
"""Correlation of two parameters above which only a combination of them is determined."""
APART = 0.02
"""Smallest distance of two points of a round, in the unit cube."""
MORE = 3
"""Number of points beyond the number of parameters that an emulator needs."""
FAR = 3.0
"""Distance from a target, in tolerances, above which it is reported as out of reach."""


@dataclass(frozen=True)
class Target:
    """A measured number and its tolerance (a standard deviation)."""

    name: str
    value: float
    tolerance: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.value) and np.isfinite(self.tolerance) and self.tolerance > 0.0):
            raise UsageError(f"target {self.name}: a finite value and a tolerance above 0 are needed")


@dataclass(frozen=True)
class Result:
    """names: of the parameters; points (n, d) in the unit cube and values (n, seeds, targets) of the runs; samples
    (s, d) of the posterior in the unit cube, parameters (s, d) in their units; emulators by target."""

    names: tuple[str, ...]
    ranges: tuple[Range, ...]
    targets: tuple[Target, ...]
    points: np.ndarray
    values: np.ndarray
    samples: np.ndarray
    emulators: tuple[Emulator, ...]

    @property
    def parameters(self) -> np.ndarray:
        """(s, d) samples in the units of the parameters."""
        return np.array([[_at(r, u) for r, u in zip(self.ranges, row)] for row in self.samples])

    @property
    def predicted(self) -> np.ndarray:
        """(s, targets) of the emulators at the samples."""
        return np.stack([emulator(self.samples)[0] for emulator in self.emulators], axis=1)

    @property
    def best(self) -> dict[str, float]:
        """Means of the posterior, of the logarithm where a range is logarithmic."""
        return {name: _at(r, float(u)) for name, r, u in zip(self.names, self.ranges, self.samples.mean(axis=0))}

    def sensitivity(self) -> np.ndarray:
        """(targets, d): change of a target, in tolerances, across the posterior spread of a parameter."""
        middle, spread = self.samples.mean(axis=0), self.samples.std(axis=0)
        found = np.zeros((len(self.targets), len(self.names)))
        for j in range(len(self.names)):
            both = np.stack([middle, middle])
            both[:, j] = np.clip(middle[j] + spread[j] * np.array([-1.0, 1.0]), 0.0, 1.0)
            for k, emulator in enumerate(self.emulators):
                low, high = emulator(both)[0]
                found[k, j] = (high - low) / self.targets[k].tolerance
        return found

    def cautions(self) -> list[str]:
        """List the parameters that the targets do not determine, and the targets that no parameters meet."""
        found = []
        width = self.samples.std(axis=0) * np.sqrt(12.0)
        for name, one in zip(self.names, width):
            if one > VAGUE:
                found.append(f"the targets do not determine {name}: its posterior is {100.0 * one:.0f} % of its range")
        related = np.atleast_2d(np.corrcoef(self.samples.T)) if len(self.names) > 1 else np.eye(1)
        for i in range(len(self.names)):
            for j in range(i):
                if abs(related[i, j]) > TIED and max(width[i], width[j]) > 0.1:
                    found.append(
                        f"the targets determine a combination of {self.names[j]} and {self.names[i]}, not each of them "
                        f"(correlation {related[i, j]:.2f})"
                    )
        edge = ((self.samples < 0.02).mean(axis=0), (self.samples > 0.98).mean(axis=0))
        for side, share in zip(("lower", "upper"), edge):
            for name, one in zip(self.names, share):
                if one > 0.2:
                    found.append(f"{name} lies at the {side} end of its range: widen the range")
        for k, target in enumerate(self.targets):
            off = abs(float(self.predicted[:, k].mean()) - target.value) / target.tolerance
            if off > FAR:
                found.append(
                    f"target {target.name} cannot be reached: the best prediction is {off:.1f} tolerances away"
                )
        return found


def _at(r: Range, u: float) -> float:
    """The value at u in [0, 1], of whole numbers one of them."""
    if r.whole:
        return int(r.at(min(u, 1.0 - 1e-12)))
    return float(r.low * (r.high / r.low) ** u if r.log else r.low + u * (r.high - r.low))


def calibrate(
    forward: Forward, ranges: dict[str, Range], targets: Sequence[Target], first: int = 16, rounds: int = 4,
    batch: int = 6, seed: int = 0,
) -> Result:  # fmt: skip
    """Runs at `first` points of a Latin hypercube and at `batch` points of each round, and the posterior. The same
    arguments choose the same points, so that a forward model which keeps its runs continues after a kill.

    HpcdemError where too few runs gave all numbers.
    """
    if not ranges or not targets:
        raise UsageError("a calibration needs at least one parameter with a range, and one target")
    d = len(ranges)
    if first < d + MORE:
        raise UsageError(f"first = {first}: {d} parameters need at least {d + MORE} points before the first round")
    random = np.random.default_rng(seed)
    points = Sampling("latin", first, seed).points(d)
    values = forward(points)
    for turn in range(rounds + 1):
        emulators = _fitted(points, values, targets)
        samples = _posterior(emulators, targets, d, random)
        if turn == rounds:
            return Result(
                tuple(ranges), tuple(ranges.values()), tuple(targets), points, values, samples, tuple(emulators)
            )
        more = _chosen(samples, emulators, targets, batch, points)
        points, values = np.concatenate([points, more]), np.concatenate([values, forward(more)])
    raise AssertionError


def _fitted(points: np.ndarray, values: np.ndarray, targets: Sequence[Target]) -> list[Emulator]:
    seeds = values.shape[1]
    repeated = np.repeat(points, seeds, axis=0)
    found = []
    for k, target in enumerate(targets):
        y = values[:, :, k].reshape(-1)
        known = np.isfinite(y)
        if len(np.unique(repeated[known], axis=0)) < points.shape[1] + MORE:
            raise HpcdemError(
                f"target {target.name}: {int(known.sum())} of {len(y)} runs gave a number, too few for "
                f"{points.shape[1]} parameters; check the failed members, or narrow the ranges"
            )
        found.append(fit(repeated[known], y[known]))
    return found


def _log_posterior(at: np.ndarray, emulators: Sequence[Emulator], targets: Sequence[Target]) -> np.ndarray:
    total = np.where(((at >= 0.0) & (at <= 1.0)).all(axis=1), 0.0, -np.inf)
    for emulator, target in zip(emulators, targets):
        mean, variance = emulator(at)
        variance = variance + target.tolerance**2
        total = total - 0.5 * ((mean - target.value) ** 2 / variance + np.log(variance))
    return total


def _posterior(
    emulators: Sequence[Emulator], targets: Sequence[Target], d: int, random: np.random.Generator
) -> np.ndarray:
    """Samples by walkers that stretch towards each other (Goodman & Weare 2010, a = 2)."""
    start = random.random((4096, d))
    level = _log_posterior(start, emulators, targets)
    walkers = max(32, 4 * d)
    at = start[np.argsort(-level)[: 2 * walkers]]
    here = _log_posterior(at, emulators, targets)
    kept = []
    for step in range(400):
        for half in (slice(0, walkers), slice(walkers, 2 * walkers)):
            other = at[walkers:] if half.start == 0 else at[:walkers]
            partner = other[random.integers(walkers, size=walkers)]
            z = (1.0 + random.random(walkers)) ** 2 / 2.0
            trial = partner + z[:, None] * (at[half] - partner)
            there = _log_posterior(trial, emulators, targets)
            accept = np.log(random.random(walkers)) < (d - 1) * np.log(z) + there - here[half]
            at[half] = np.where(accept[:, None], trial, at[half])
            here[half] = np.where(accept, there, here[half])
        if step >= 150 and step % 10 == 0:
            kept.append(at.copy())
    return np.concatenate(kept)


def _chosen(
    samples: np.ndarray, emulators: Sequence[Emulator], targets: Sequence[Target], batch: int, done: np.ndarray
) -> np.ndarray:
    """Samples of the posterior where the emulators are least sure, in tolerances, and no run is near."""
    doubt = sum(emulator(samples)[1] / target.tolerance**2 for emulator, target in zip(emulators, targets))
    taken: list[np.ndarray] = []
    for k in np.argsort(-np.asarray(doubt), kind="stable"):
        near = np.concatenate([done, taken]) if taken else done
        if np.abs(near - samples[k]).max(axis=1).min() > APART:
            taken.append(samples[k])
        if len(taken) == batch:
            break
    return np.array(taken) if taken else samples[:1]

"""What a peer is: how it is found, tuned and run."""

from __future__ import annotations

import tempfile
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from bench.launch import Failed
from bench.workloads import Bed, steps_for, warm_for

Options = dict[str, Any]
TRIAL_S = 0.6
"""Stepping time of a trial run [s], about."""


@dataclass
class Case:
    """What is to be computed: a settled bed (arrays [m]) between floor and side walls, on so many cores."""

    bed: Bed
    x: np.ndarray
    y: np.ndarray
    r: np.ndarray
    pushed: bool
    cores: int

    @classmethod
    def load(cls, bed: Bed, npz: Path, pushed: bool, cores: int) -> Case:
        """From the arrays in the cache."""
        with np.load(npz) as arrays:
            return cls(bed, arrays["x"], arrays["y"], arrays["r"], pushed, cores)


@dataclass
class Found:
    """Of one run: steps, wall time of the loop over them [s], touching pairs per particle at its end, and the share of
    the processor that it got, if the code says."""

    particles: int
    steps: int
    seconds: float
    contacts_per_particle: float
    cpu_use: float | None = None

    @property
    def speed(self) -> float:
        """Particle-steps per second."""
        return self.particles * self.steps / self.seconds


class Peer(ABC):
    """One other code. Subclasses say where it is, what can be tuned, and how one run is made."""

    name: ClassVar[str]
    install: ClassVar[str]
    """How to get it."""
    rate: ClassVar[float]
    """Particle-steps/s of a core, roughly: how long trials are made."""
    laws: ClassVar[tuple[str, ...]] = ("hertz",)
    """Those of workloads.Bed that it is set up for."""
    same_steps: ClassVar[bool] = True
    """Whether it does the same steps as hpcdem; the slow ones do fewer, as many as `rate` allows."""

    @abstractmethod
    def missing(self) -> str:
        """Empty if it can be run, else what is missing."""

    @abstractmethod
    def version(self, options: Options) -> str:
        """Name and version of what is run with these options."""

    def choices(self, case: Case) -> list[list[Options]]:
        """Rounds of tuning: in each, the fastest of these changes to the options so far is kept."""
        return [[{}]]

    def describe(self, options: Options) -> str:
        """The options in a few words."""
        return ", ".join(f"{name} {value}" for name, value in options.items())

    @abstractmethod
    def once(self, case: Case, options: Options, warm: int, steps: int, folder: Path) -> Found:
        """One run in an empty folder."""

    def run(self, case: Case, options: Options, steps: int) -> Found:
        """One run of so many steps after a warm-up."""
        with tempfile.TemporaryDirectory(prefix="hpcdem-bench-") as folder:
            return self.once(case, options, warm_for(case.bed, steps if self.same_steps else 20), steps, Path(folder))

    def tuned(self, case: Case) -> tuple[Options, list[tuple[str, float]]]:
        """The fastest options, and all trials: their description and particle-steps/s (0: it failed)."""
        best: Options = {}
        trials: list[tuple[str, float]] = []
        fault = ""
        steps = steps_for(case.bed, case.pushed, TRIAL_S, self.rate * case.cores)
        for changes in self.choices(case):
            if len(changes) == 1:
                best |= changes[0]
                continue
            speeds = []
            for change in changes:
                options = best | change
                try:
                    # The better of two: a busy moment of the machine must not choose.
                    speed = max(self.run(case, options, steps).speed for _ in range(2))
                except Failed as error:
                    speed, fault = 0.0, str(error)
                speeds.append(speed)
                trials.append((self.describe(options), speed))
            if max(speeds) == 0.0:
                raise Failed(f"{self.name}: no setting works\n{fault}")
            best |= changes[speeds.index(max(speeds))]
        return best, trials

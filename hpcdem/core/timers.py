"""Time of each stage: one stopwatch per stage, cheap enough for every stage of every step.

::

    timers = Timers()
    with timers("force"):          # or: timers.start("force") ... timers.stop("force")
        add_forces()
    timers.count(steps=1, particles=n_own)

A stage must not be entered twice at once. A stage inside another is counted in both, unless the outer one is entered by
`around`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter_ns

from hpcdem.core.comm import Comm

WAITING = frozenset({"halo", "exchange", "migrate", "reduce", "output", "checkpoint", "figure", "callback"})
"""Stages in which a rank mostly waits for others or for the disk; all others are computation."""


class Stopwatch:
    """Nanoseconds spent and number of times entered; a context manager."""

    __slots__ = ("ns", "calls", "_began")

    def __init__(self) -> None:
        self.ns = 0
        self.calls = 0
        self._began = 0

    def __enter__(self) -> None:
        self._began = perf_counter_ns()

    def __exit__(self, *exc: object) -> None:
        self.ns += perf_counter_ns() - self._began
        self.calls += 1

    @property
    def seconds(self) -> float:
        """Time spent so far [s]."""
        return self.ns * 1e-9


@dataclass(frozen=True)
class Stage:
    """One stage over all ranks: mean and largest time of a rank [s], entries on the busiest rank."""

    name: str
    mean: float
    largest: float
    calls: int


@dataclass(frozen=True)
class Summary:
    """All stages over all ranks, in the order in which rank 0 met them.

    wall [s] is the longest time since the timers were made; imbalance is the largest over the mean of the ranks'
    own work (1 = even); particle_steps is the sum over ranks.
    """

    stages: list[Stage]
    wall: float
    imbalance: float
    steps: int
    particle_steps: int
    ranks: int


class Timers:
    """Stopwatches by name, made on first use, and the work done while they ran."""

    def __init__(self) -> None:
        self.watches: dict[str, Stopwatch] = {}
        self.steps = 0
        self.particle_steps = 0
        self._began = perf_counter_ns()

    @staticmethod
    def joined(parts: Mapping[str, Timers], shared: Mapping[str, str]) -> Timers:
        """Merge the timers of models that run together into one table: names of stages get a prefix with the model,
        `shared` ones (whatever the model) the name in `shared`. Wall time counts from the first model on; no steps."""
        made = Timers()
        made._began = min(timers._began for timers in parts.values())
        for model, timers in parts.items():
            for name, watch in timers.watches.items():
                into = made(shared.get(name, f"{model}: {name}"))
                into.ns += watch.ns
                into.calls += watch.calls
        return made

    def __call__(self, name: str) -> Stopwatch:
        """The stopwatch of a stage, for ``with timers("force"):``."""
        watch = self.watches.get(name)
        if watch is None:
            watch = self.watches[name] = Stopwatch()
        return watch

    def start(self, name: str) -> None:
        """Enter a stage."""
        self(name).__enter__()

    def stop(self, name: str) -> None:
        """Leave a stage."""
        self(name).__exit__()

    @contextmanager
    def around(self, name: str) -> Iterator[None]:
        """A stage that may contain others: their time is subtracted from its own."""
        began, inner = perf_counter_ns(), sum(w.ns for w in self.watches.values())
        try:
            yield
        finally:
            watch = self(name)
            watch.ns += perf_counter_ns() - began - (sum(w.ns for w in self.watches.values()) - inner)
            watch.calls += 1

    def count(self, steps: int, particles: int) -> None:
        """Record that this rank advanced `particles` of its own particles by `steps` steps."""
        self.steps += steps
        self.particle_steps += steps * particles

    def seconds(self, *names: str) -> float:
        """Return the time of this rank in the named stages [s]; without names, in all its own work."""
        if names:
            return sum(self.watches[n].seconds for n in names if n in self.watches)
        return sum(w.seconds for n, w in self.watches.items() if n.rpartition(": ")[2] not in WAITING)

    def merge(self, comm: Comm) -> Summary:
        """Collective: the same summary on every rank."""
        mine = (
            {name: (w.seconds, w.calls) for name, w in self.watches.items()},
            (perf_counter_ns() - self._began) * 1e-9,
            self.seconds(),
            self.steps,
            self.particle_steps,
        )
        ranks = comm.allgather(mine)
        names = dict.fromkeys(name for watches, *_ in ranks for name in watches)
        stages = []
        for name in names:
            rows = [watches.get(name, (0.0, 0)) for watches, *_ in ranks]
            times = [seconds for seconds, _ in rows]
            stages.append(Stage(name, sum(times) / len(times), max(times), max(calls for _, calls in rows)))
        work = [r[2] for r in ranks]
        mean = sum(work) / len(work)
        return Summary(
            stages=stages,
            wall=max(r[1] for r in ranks),
            imbalance=max(work) / mean if mean > 0 else 1.0,
            steps=max(r[3] for r in ranks),
            particle_steps=sum(r[4] for r in ranks),
            ranks=len(ranks),
        )

"""Wells: flow nodes that share one volume, into which fluid is pumped, or from which it is produced, in stages.

The nodes of a well share one head: those of a hole without gravity have one pressure, with gravity it grows downwards;
the pressure of a well is that at its highest node. All ranks hold all wells, and compute them from sums over their
nodes in the order of these, so bits do not depend on ranks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.field.assigned import Number

SHUT, RATE, PRESSURE = "shut_in", "rate", "pressure"
QUANTITIES = {
    "pressure": ("Pa", "pressure at its highest node"),
    "rate": ("m2/s", "inflow in the last sub-step"),
    "injected": ("m2", "accumulated inflow, at the density at zero pressure"),
    "stage": ("1", "number of the active stage, from 1; 0: none yet, or all are over"),
}
"""Quantities of a well that can be queried: unit and meaning."""


@dataclass(frozen=True)
class Stage:
    """does: SHUT, RATE [m2/s, of the whole well] or PRESSURE [Pa]; value: a number or the name of a table over the time
    of flow; begin, end: times of flow [s]; limit: largest pressure [Pa] that a rate may lead to."""

    does: str
    value: Number = 0.0
    begin: float = 0.0
    end: float = math.inf
    limit: float = math.inf


@dataclass(frozen=True)
class Asked:
    """Action of a well in an implicit step: the pressure at its highest node [Pa], or None and an amount [m2]
    (negative: withdrawn) that respects a limit [Pa]."""

    pressure: float | None
    amount: float
    limit: float


@dataclass
class Well:
    """points (n,): of the mesh, ascending; wall (k,): others that the water of the well touches, at which no channel
    ended when it was made; see `QUANTITIES` for the rest."""

    name: str
    points: np.ndarray
    stages: list[Stage] = field(default_factory=list)
    pressure: float = 0.0
    rate: float = 0.0
    injected: float = 0.0
    wall: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))

    def add(self, stage: Stage, now: float) -> None:
        """Append a stage; a stage without an end that has begun ends now. CommandError if a stage would never act."""
        begin = max(now, self.stages[-1].end if self.stages else now)
        if self.stages and math.isinf(begin):
            last = self.stages[-1]
            if last.begin >= now:
                raise CommandError(
                    f"stage {len(self.stages)} of well '{self.name}' has no time, so no other stage can follow: give "
                    "its time"
                )
            self.stages[-1], begin = replace(last, end=now), now
        self.stages.append(replace(stage, begin=begin, end=begin + stage.end))

    def number(self, time: float) -> int:
        """Number of the stage that is active just before a flow time, from 1; 0: none."""
        return next((k for k, one in enumerate(self.stages, 1) if one.begin < time <= one.end), 0)

    def will_act(self, time: float) -> bool:
        """Return whether the well pumps or holds a pressure at or after this time [s]."""
        return any(one.does != SHUT and one.end > time for one in self.stages)

    def next_change(self, time: float) -> float:
        """The first time after this one at which a stage begins or ends; inf: none."""
        ends = [end for one in self.stages for end in (one.begin, one.end)]
        return min((end for end in ends if end > time * (1.0 + 1e-12)), default=math.inf)

    def pumped(self, before: float, after: float, value: Callable[[Number, float], float]) -> tuple[float, float]:
        """Volume [m2] that stages with a rate bring between two times, and the pressure [Pa] that it may lead to."""
        rates = [one for one in self.stages if one.does == RATE and one.begin < after and one.end > before]
        amount = math.fsum(
            value(one.value, min(after, one.end)) * (min(after, one.end) - max(before, one.begin)) for one in rates
        )
        return amount, min((one.limit for one in rates), default=math.inf)

    def asked(self, before: float, after: float, value: Callable[[Number, float], float]) -> Asked:
        """Action in an implicit step, in which no stage ends."""
        number = self.number(0.5 * (before + after))
        if number and (one := self.stages[number - 1]).does == PRESSURE:
            return Asked(value(one.value, after), 0.0, math.inf)
        return Asked(None, *self.pumped(before, after, value))

    def asked_now(self, time: float, dt: float, value: Callable[[Number, float], float]) -> Asked:
        """Return the action for dt [s] of the stage that is active at this time [s]."""
        one = next((one for one in self.stages if one.begin <= time < one.end), Stage(SHUT))
        if one.does == PRESSURE:
            return Asked(value(one.value, time), 0.0, math.inf)
        return Asked(None, dt * value(one.value, time) if one.does == RATE else 0.0, one.limit)

    def filled(
        self, contents: np.ndarray, before: float, after: float, bulk: float, value: Callable[[Number, float], float]
    ) -> np.ndarray:
        """Return the fluid of its nodes (n,) at the end of a sub-step; contents (3, n): their fluid and volume [m2] and
        potential energy [Pa] before, without wells."""
        had, volume, energy = contents
        w, v, top = math.fsum(had.tolist()), math.fsum(volume.tolist()), float(energy.max())
        number = self.number(after)
        stage = self.stages[number - 1] if number else Stage(SHUT)
        if stage.does == PRESSURE:
            head = value(stage.value, after) + top
            found = volume * (1.0 + (head - energy) / bulk)
        else:
            amount, limit = self.pumped(before, after, value)
            target = max(w + amount, 0.0)
            if math.isfinite(limit):
                most = math.fsum((volume * (1.0 + (limit + top - energy) / bulk)).tolist())
                target = min(target, max(most, w))
            if target < v:
                head, found = top, volume * (target / v)
            else:
                head = _head(target - v, volume, energy, bulk)
                found = volume * (1.0 + np.maximum(head - energy, 0.0) / bulk)
            if len(found) == 1:
                found = np.array([target])
        came = math.fsum([*found.tolist(), -w])
        self.pressure, self.rate = max(head - top, 0.0), came / (after - before)
        self.injected += came
        return found

    def saved(self) -> dict[str, Any]:
        """The well as JSON values."""
        stages = [{**asdict(one), "end": _json(one.end), "limit": _json(one.limit)} for one in self.stages]
        return {**vars(self), "points": self.points.tolist(), "wall": self.wall.tolist(), "stages": stages}

    @staticmethod
    def restored(state: dict[str, Any]) -> Well:
        """Inverse of `saved`."""
        known: list[dict[str, Any]] = [
            {k: math.inf if v is None else v for k, v in one.items()} for one in state["stages"]
        ]
        places = {name: np.array(state.get(name, []), np.int64) for name in ("points", "wall")}
        return Well(**{**state, **places, "stages": [Stage(**one) for one in known]})


def _json(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _head(more: float, volume: np.ndarray, energy: np.ndarray, bulk: float) -> float:
    """Return the head [Pa] at which all nodes below it together hold this much [m2] more than their volume: sum of
    V (head - E) / K over nodes with E < head."""
    order = np.argsort(energy, kind="stable")
    v, e = volume[order], energy[order]
    volumes, weight = np.cumsum(v), np.cumsum(v * e)
    heads = (bulk * more + weight) / volumes
    return float(heads[np.flatnonzero(heads >= e)[-1]])

"""The clock of a model: which step, what time, how long a step."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Clock:
    """Step number, model time [s] and time step [s].

    The time is the sum of the steps taken: a script may change dt during a run, so it is not ``step * dt``.
    """

    step: int = 0
    time: float = 0.0
    dt: float = 0.0

    def tick(self) -> None:
        """Count one step of length dt."""
        self.step += 1
        self.time += self.dt

"""Choice of the number of threads if the user gives none: first from the size of the model, then from measured times.

Threads wait for each other several times a step. Where a model is small, or other programs want the same cores, that
costs more than the threads save, up to twenty times as much. So from time to time half or twice as many are tried; the
faster number stays. States do not depend on it.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from hpcdem.core.timers import WAITING

if TYPE_CHECKING:
    from hpcdem.core.timers import Timers
    from hpcdem.runtime.progress import Log

GRAIN = 2000
"""Particles of a thread, at least, before anything was measured."""
WINDOW = 0.2
"""Seconds of computing from which the cost of a step is measured."""
GAIN = 0.93
"""A number of threads is faster if a step takes this part of the time."""
SHORTEST, LONGEST = 2.0, 60.0
"""Seconds until the next trial after a change, doubled by each trial that changed nothing; the longest wait."""


class Pace:
    """most: available threads; log: receives changes."""

    def __init__(self, most: int, log: Log | None = None) -> None:
        self.most, self.log = most, log
        self.now = 0
        self._cost: dict[int, float] = {}
        self._before = 0
        self._steps, self._seconds = 0, 0.0
        self._settling = True
        self._wait = SHORTEST
        self._next = 0.0
        self._up = False

    def choose(self, particles: int, timers: Timers, step: int) -> int:
        """The number for the next lists; called when they are made."""
        seconds = sum(watch.seconds for name, watch in timers.watches.items() if name not in WAITING)
        if self.now == 0:
            while self.now < self.most and (self.now == 0 or particles >= 2 * self.now * GRAIN):
                self.now = min(2 * self.now or 1, self.most)
            self._begin(step, seconds)
            self._next = time.monotonic() + SHORTEST
            return self.now
        if self._settling:  # what is called for the first time is loaded first
            self._begin(step, seconds, settling=False)
        elif seconds - self._seconds > WINDOW and step > self._steps:
            self._cost[self.now] = (seconds - self._seconds) / (step - self._steps)
            if self._before:
                self._judge(step)
            elif time.monotonic() >= self._next:
                self._try()
            self._begin(step, seconds, settling=self._before != 0)
        return self.now

    def _begin(self, step: int, seconds: float, settling: bool = True) -> None:
        self._steps, self._seconds, self._settling = step, seconds, settling

    def _try(self) -> None:
        """Another number for a while: in turn more and fewer."""
        more, fewer = min(2 * self.now, self.most), max(self.now // 2, 1)
        self._up = not self._up
        other = more if (self._up and more != self.now) or fewer == self.now else fewer
        if other != self.now:
            self._before, self.now = self.now, other

    def _judge(self, step: int) -> None:
        """Keep the number that was tried, or go back."""
        before, self._before = self._before, 0
        if self._cost[self.now] < GAIN * self._cost[before]:
            if self.log is not None:
                self.log.info(
                    f"step {step}: {threads(self.now)} from here on, at {1e3 * self._cost[self.now]:.3g} ms a step; "
                    f"{threads(before)} took {1e3 * self._cost[before]:.3g} ms (-j N fixes the number)"
                )
            self._wait = SHORTEST
        else:
            self.now = before
            self._wait = min(2.0 * self._wait, LONGEST)
        self._next = time.monotonic() + self._wait


def threads(count: int) -> str:
    """Format a number of threads."""
    return "1 thread" if count == 1 else f"{count} threads"

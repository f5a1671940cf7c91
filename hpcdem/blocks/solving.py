"""Many steps: a number of them, or until something is reached."""

from __future__ import annotations

from dataclasses import dataclass

from hpcdem.blocks.changing import Changing
from hpcdem.errors import CommandError

RATIO = 1e-5
"""Balance at which a model counts as being at rest, if nothing else is asked for."""
EVERY = 50
"""Steps between two looks at the balance."""


@dataclass(frozen=True)
class Solved:
    """How `Blocks.solve` ended. ratio: unbalanced over contributing forces at the last look, NaN if nobody looked;
    reason: "ratio", "cycles", "time" or "request" (a signal or limit asked to stop)."""

    steps: int
    ratio: float
    reason: str
    request: int = 0


class Solving(Changing):
    """Verbs of `Blocks` that step. All collective."""

    def advance(self, steps: int) -> int:
        """Up to `steps` steps; ends early if the outside asks for something, and returns that (0: nothing)."""
        if steps < 0:
            raise CommandError(f"the number of steps must not be negative, got {steps}")
        request = done = 0
        while done < steps and not request:
            request = self.step()
            done += 1
        self.timers.count(done, len(self.number[self.owned]))
        return request

    def solve(
        self,
        ratio: float | None = None,
        cycles: int | None = None,
        time: float | None = None,
        every: int = EVERY,
    ) -> Solved:
        """Step until the sum of unbalanced over the sum of contributing nodal forces falls below `ratio` (1e-5 if none
        of the three is given), or after so many steps, or so much model time [s], whatever comes first.

        every: steps between two looks at the ratio.
        """
        if ratio is None and cycles is None and time is None:
            ratio = RATIO
        for name, value in (("ratio", ratio), ("cycles", cycles), ("time", time), ("every", every)):
            if value is not None and not value > 0:
                raise CommandError(f"{name} must be positive, got {value}")
        if time is not None and not self.options.dynamic:
            raise CommandError("time does not pass in static mode: use cycles or ratio")
        end = None if time is None else self.clock.time + time
        done, found = 0, float("nan")
        while True:
            upto = every if ratio is not None else 10**9
            if cycles is not None:
                upto = min(upto, cycles - done)
            n = 0
            while n < upto:
                request = self.step()
                n += 1
                if request or (end is not None and self.clock.time >= end - 0.5 * self.clock.dt):
                    break
            done += n
            self.timers.count(n, len(self.number[self.owned]))
            if request:
                return Solved(done, found, "request", request)
            if ratio is not None:
                found = self.unbalanced_ratio()
                if found < ratio:
                    return Solved(done, found, "ratio")
            if end is not None and self.clock.time >= end - 0.5 * self.clock.dt:
                return Solved(done, found, "time")
            if cycles is not None and done >= cycles:
                return Solved(done, found, "cycles")

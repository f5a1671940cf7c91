"""Schedule of rebuilds of the lists: the state that determines them in every physics, and the steps between checks."""

from __future__ import annotations

from dataclasses import dataclass

LONGEST_WAIT = 64
"""Largest number of steps between two checks of the displacements."""
GLANCE = 10
"""Interval of quick checks [steps], which detect particles that have accelerated since the last check."""
UNSEEN, AT_A_GLANCE, CHECK = 0, 1, 2


@dataclass
class CheckInterval:
    """countdown: steps to the next check; pace: steps between the last two. Global, saved in checkpoints."""

    countdown: int = 1
    pace: int = 1

    def passed(self) -> int:
        """Count one step. Returns what is due at it: UNSEEN, AT_A_GLANCE or CHECK."""
        self.countdown = left = self.countdown - 1
        return CHECK if left <= 0 else UNSEEN if left % GLANCE else AT_A_GLANCE

    def is_too_late(self, margin: float, stride: float) -> bool:
        """Return whether a margin [m] is used up before the next glance or check at this stride [m] per step."""
        return stride * min(GLANCE, self.countdown) > margin

    def wait(self, *limits: float) -> None:
        """Schedule the next check after at most so many steps, at least one, and at most twice the last interval."""
        self.pace = self.countdown = max(1, int(min(LONGEST_WAIT, 2 * self.pace, *limits)))

    def soon(self) -> None:
        """Schedule a check at the next step, because a command changed speeds or the time step."""
        self.countdown = self.pace = 1


@dataclass
class RebuildState(CheckInterval):
    """State that determines the next rebuild; from global values only, part of every checkpoint.

    side of the cells [m]; skin: buffer of the search [m]; skin_factor: the skin relative to a length of the model; age
    of the lists in steps; late: number of lists that were rebuilt late.
    """

    side: float = 0.0
    skin: float = 0.0
    skin_factor: float = 0.0
    age: int = 0
    late: int = 0

    def adapt_skin(self, narrow: float, wide: float, short: int, long: int) -> None:
        """Choose the wide skin if the lists lasted fewer steps than `short`, the narrow one if more than `long`."""
        if 0 < self.age < short:
            self.skin_factor = wide
        elif self.age > long:
            self.skin_factor = narrow

"""Energy budget of a model of any physics: stored energy, and work done and lost since the budget began.

Steps book each flow for a whole kick, that is, from half step to half step; readings are taken at whole steps. `begin`
therefore subtracts the half of the coming kick that a reading at that moment would add, and `pause` brings the budget
to the whole step before anything other than a step changes the model. The change of stored energy between a pause and
the next `begin` is booked as the effect of that change.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Generic, NamedTuple, TypeVar

N = TypeVar("N", int, float)
M = TypeVar("M")


class Reading(NamedTuple, Generic[N]):
    """Stored energy now, stored energy when the budget began, and flows since then, by name."""

    stored: dict[str, N]
    start: dict[str, N]
    flows: dict[str, N]


class Budget(ABC, Generic[M, N]):
    """accounts: flows up to now or, while steps are booked (running), up to the last `begin`. start, left: stored
    energy at the beginning (None: not begun) and at the last pause. Integers are sums of exact_sum.as_integer over this
    rank; floats are sums over all ranks."""

    def __init__(self, stored: Iterable[str], flows: Iterable[str], nothing: N) -> None:
        self.accounts: dict[str, N] = dict.fromkeys(flows, nothing)
        self.left: dict[str, N] = dict.fromkeys(stored, nothing)
        self.start: dict[str, N] | None = None
        self.running = False
        self._nothing: dict[str, N] = dict(self.accounts)

    @abstractmethod
    def _read(self, sim: M) -> tuple[dict[str, N], dict[str, N]]:
        """Read the stored energy at the present whole step, and half of the work of the coming kick. Collective."""

    @abstractmethod
    def _booked(self, sim: M) -> dict[str, N]:
        """Return the flows of steps since the last `begin` that the accounts do not include yet. Collective."""

    @abstractmethod
    def _book_change(self, change: dict[str, N]) -> None:
        """Book the change of stored energy while the budget was paused."""

    def begin(self, sim: M) -> None:
        """Start to book the flows of the steps that follow. The model is closed and its tables are current.
        Collective."""
        stored, half = self._read(sim)
        if self.start is None:
            self.start = stored
        else:
            self._book_change({name: stored[name] - self.left[name] for name in stored})
        for name in half:
            self.accounts[name] -= half[name]
        self.running = True

    def pause(self, sim: M) -> None:
        """Stop booking before something other than a step changes the model. Collective."""
        self.left, half = self._read(sim)
        booked = self._booked(sim)
        for name in half:
            self.accounts[name] += booked[name] + half[name]
        self.running = False

    def now(self, sim: M) -> Reading[N]:
        """Return the budget at this moment. Changes since a pause are booked later. Collective."""
        if self.running:
            stored, half = self._read(sim)
            booked = self._booked(sim)
        else:
            stored, half = (self._read(sim)[0] if self.start is None else self.left), self._nothing
            booked = half
        flows = {name: self.accounts[name] + booked[name] + half[name] for name in self.accounts}
        return Reading(stored, stored if self.start is None else self.start, flows)

"""The account of energy of a model of any physics: what is stored, what was done and lost since it began.

Steps book flows a whole kick at a time, from half step to half step; readings are of whole steps. So the account is
taken up (`begin`) without the half of the coming kick that a reading at that moment would add, and brought to the whole
step (`pause`) before something else than a step changes the model: what that changes of what is stored is the
difference of two readings, and booked as such when the account is taken up again.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Generic, NamedTuple, TypeVar

N = TypeVar("N", int, float)
M = TypeVar("M")


class Reading(NamedTuple, Generic[N]):
    """What is stored now, what was when the account began, and the flows since then; by name."""

    stored: dict[str, N]
    start: dict[str, N]
    flows: dict[str, N]


class Budget(ABC, Generic[M, N]):
    """accounts: flows up to now or, while steps are booked (running), up to where they were taken up; start, left: what
    was stored at the beginning (None: it has not begun) and at the last pause. Integers are those of
    exact_sum.as_integer, and this rank's share; floats are of all ranks."""

    def __init__(self, stored: Iterable[str], flows: Iterable[str], nothing: N) -> None:
        self.accounts: dict[str, N] = dict.fromkeys(flows, nothing)
        self.left: dict[str, N] = dict.fromkeys(stored, nothing)
        self.start: dict[str, N] | None = None
        self.running = False
        self._nothing: dict[str, N] = dict(self.accounts)

    @abstractmethod
    def _read(self, sim: M) -> tuple[dict[str, N], dict[str, N]]:
        """What is stored at the present whole step, and the first half of what the coming kick does. Collective."""

    @abstractmethod
    def _booked(self, sim: M) -> dict[str, N]:
        """Flows of the steps since the account was taken up that are not in the accounts yet. Collective."""

    @abstractmethod
    def _book_change(self, change: dict[str, N]) -> None:
        """Change of the stored energy while the budget was not updated."""

    def begin(self, sim: M) -> None:
        """Steps follow, whose flows are booked. The model is closed, its tables are fresh. Collective."""
        stored, half = self._read(sim)
        if self.start is None:
            self.start = stored
        else:
            self._book_change({name: stored[name] - self.left[name] for name in stored})
        for name in half:
            self.accounts[name] -= half[name]
        self.running = True

    def pause(self, sim: M) -> None:
        """Something else than a step is about to change the model. Collective."""
        self.left, half = self._read(sim)
        booked = self._booked(sim)
        for name in half:
            self.accounts[name] += booked[name] + half[name]
        self.running = False

    def now(self, sim: M) -> Reading[N]:
        """The account at this moment. What has changed since a pause is booked later. Collective."""
        if self.running:
            stored, half = self._read(sim)
            booked = self._booked(sim)
        else:
            stored, half = (self._read(sim)[0] if self.start is None else self.left), self._nothing
            booked = half
        flows = {name: self.accounts[name] + booked[name] + half[name] for name in self.accounts}
        return Reading(stored, stored if self.start is None else self.start, flows)

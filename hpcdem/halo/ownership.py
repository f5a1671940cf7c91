"""Which rank owns which columns: the strip boundaries during the life of a model, and when they move.

Boundaries determine which rank computes, never the result. Measured times may therefore enter here, and only here.
"""

from __future__ import annotations

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.errors import UsageError
from hpcdem.decomp import balance, strips

MOST_COLUMNS = 1 << 24


class Ownership:
    """Strip boundaries (ranks + 1,) i8 in columns of width `side` [m]; none before the first `renew`.

    balance_on: boundaries follow the measured load; otherwise they move only on request (`wanted`).
    """

    def __init__(self, comm: Comm, balance_on: bool) -> None:
        self.comm, self.balance_on = comm, balance_on
        self.borders = np.zeros(0, np.int64)
        self.side = 1.0
        self.wanted = True
        """Particles came or went: cut again at the next chance, whatever was measured."""
        self._busy, self._step = 0.0, 0

    def owner_of(self, cx: np.ndarray) -> np.ndarray:
        """Return the rank that owns each column index."""
        return strips.owner_of(cx, self.borders)

    def renew(
        self,
        cx: np.ndarray,
        side: float,
        step: int,
        busy: float,
        room: tuple[float, float] | None,
        cost: np.ndarray | float = 1.0,
        least: int = 1,
    ) -> None:
        """Choose boundaries for particles (or elements) in columns cx (n,) i8 of this rank. Collective.

        busy: seconds of work of this rank so far; room: x range [m] of possible positions, if known; cost: (n,),
        relative cost of each row, if known; least: smallest number of columns of a rank. Raises UsageError if a new
        model has fewer columns than ranks. A model that lost columns later, or was restored with fewer, continues with
        idle ranks.
        """
        first_time = not len(self.borders)
        if self.comm.size == 1:
            self.borders, self.side = np.array([0, 1]), side
            return
        if not first_time and self.side != side:
            self.borders = strips.separate(np.rint(self.borders * (self.side / side)).astype(np.int64))
        self.side = side
        if least > 1 and not first_time:
            self.borders = strips.separate(self.borders, least)
        weight = cost
        if not (self.wanted or first_time):
            found = self._uneven(float(np.sum(np.broadcast_to(cost, len(cx)))), step, busy)
            if found is None:
                return
            weight = found * cost
        first, columns = self._span(cx)
        if columns == 0:
            first, columns = 0, 1
        elif first_time and step == 0:
            self._refuse_too_many_ranks(columns, room)
        total = np.zeros(min(columns, MOST_COLUMNS))
        np.add.at(total, np.minimum(cx - first, len(total) - 1), weight)
        self.comm.sum_into(total)
        self.borders = strips.cut(self.comm.bcast(total), first, self.comm.size, least)
        self.wanted = False
        self._busy, self._step = busy, step

    def _uneven(self, owned: float, step: int, busy: float) -> float | None:
        """Return the relative cost of a particle of this rank if the load is uneven, else None. Collective when due.

        owned: number of particles, weighted with their cost.
        """
        if not self.balance_on or step - self._step < balance.PATIENCE:
            return None
        mine = busy - self._busy
        total = self.comm.bcast(self.comm.sum_into(np.array([mine, owned])))  # the same on all ranks, to the last bit
        largest = float(self.comm.max_into(np.array([mine]))[0])
        self._busy, self._step = busy, step
        if balance.imbalance(largest, float(total[0]) / self.comm.size) < balance.TOLERANCE:
            return None
        return balance.cost_per_particle(mine, owned, float(total[0]), float(total[1]))

    def _span(self, cx: np.ndarray) -> tuple[int, int]:
        """Return the first occupied column and the number of columns up to the last, over all ranks; (0, 0) without
        particles."""
        ends = np.array([-cx.min(), cx.max()] if len(cx) else [-strips.FARTHEST, -strips.FARTHEST])
        self.comm.max_into(ends)
        first, columns = -int(ends[0]), int(ends[1] + ends[0]) + 1
        return (first, columns) if columns > 0 else (0, 0)

    def _refuse_too_many_ranks(self, columns: int, room: tuple[float, float] | None) -> None:
        """Raise UsageError if a rank would never have a column: the job was started with too many ranks."""
        if room is not None:
            ends, _ = strips.cells(np.array(room), np.zeros(2), self.side)
            columns = max(columns, int(ends[1] - ends[0]) + 1)
        if columns < self.comm.size:
            raise UsageError(
                f"{self.comm.size} ranks are too many for this model: its width in columns of {self.side:g} m (the "
                f"largest contact, bond or clump, plus skin) is {columns}, so at most {columns} ranks fit; start it "
                "with fewer"
            )

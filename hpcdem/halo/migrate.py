"""Migration: particles go to the rank that owns their column, and their contact histories go with them."""

from __future__ import annotations

from typing import Any

import numpy as np


class Migration:
    """One change of ownership: row i of any per-particle table goes to rank owner[i].

    Rows that stay are not copied through MPI. The new rows are [stayed | arrived from rank 0, 1, ...], the same order
    in every table.
    """

    def __init__(self, comm: Any, owner: np.ndarray) -> None:
        self.comm = comm
        self.stay = np.flatnonzero(owner == comm.rank)
        leave = np.flatnonzero(owner != comm.rank)
        self.leave = leave[np.argsort(owner[leave], kind="stable")]
        self.cuts = np.searchsorted(owner[self.leave], np.arange(1, comm.size))
        self.nobody = not comm.any(len(leave) > 0)

    def move(self, table: np.ndarray) -> np.ndarray:
        """This rank's new rows of a table (n, ...). Collective."""
        if self.nobody:
            return table
        arrived = self.comm.alltoallv(np.split(table[self.leave], self.cuts))
        return np.concatenate([table[self.stay], *arrived])

    def move_ragged(self, counts: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same for rows of which particle i has counts[i], one particle after the other. Collective."""
        if self.nobody:
            return counts, rows
        first = np.cumsum(counts) - counts

        def entries(of: np.ndarray) -> np.ndarray:
            n = counts[of]
            return rows[np.repeat(first[of] - (np.cumsum(n) - n), n) + np.arange(n.sum())]

        cuts = np.concatenate(([0], np.cumsum(counts[self.leave])))[self.cuts]
        arrived = self.comm.alltoallv(np.split(entries(self.leave), cuts))
        return self.move(counts), np.concatenate([entries(self.stay), *arrived])

"""Migration: particles move, with their contact histories, to the rank that owns their column."""

from __future__ import annotations

import numpy as np

from hpcdem.core.comm import Comm


class Migration:
    """One change of ownership: of n particles on this rank, those at `leave` (indices) move to the ranks `owner`.

    The new order on a rank is [stayed | arrived from rank 0, 1, ...]. leave: particles that leave, by destination;
    leave_to: their destinations. Nearly all move to the neighbours, to others if a strip boundary has jumped. The cost
    of a migration does not grow with the number of ranks.
    """

    def __init__(self, comm: Comm, n: int, leave: np.ndarray, owner: np.ndarray) -> None:
        self.comm = comm
        by_owner = np.argsort(owner, kind="stable")
        self.leave, self.leave_to = leave[by_owner], owner[by_owner]
        self.owners, first = np.unique(self.leave_to, return_index=True)
        self.cuts = first[1:]
        self.n = n

    def stay(self) -> np.ndarray:
        """Indices of the particles that do not leave."""
        stays = np.ones(self.n, bool)
        stays[self.leave] = False
        return np.flatnonzero(stays)

    def exchange(
        self, rows: np.ndarray, counts: np.ndarray, entries: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Send what belongs to `leave`: rows (k, w) f8; entries (m, v) f8, of which particle i has counts[i], one
        particle after the other. Returns what arrives, in the same form. Collective: one exchange.
        """
        parcels = {}
        begin = np.cumsum(counts) - counts
        for to, mine in zip(self.owners.tolist(), np.split(np.arange(len(rows)), self.cuts)):
            first, end = begin[mine[0]], begin[mine[-1]] + counts[mine[-1]]
            parts = (np.array([len(mine)]), counts[mine], rows[mine].view(np.int64), entries[first:end].view(np.int64))
            parcels[to] = np.concatenate([part.reshape(-1) for part in parts])
        new_rows, new_counts, new_entries = [rows[:0]], [counts[:0]], [entries[:0]]
        for parcel in self.comm.exchange(parcels).values():
            n = int(parcel[0])
            of_counts, of_rows, of_entries = np.split(parcel[1:], np.cumsum((n, n * rows.shape[1])))
            new_counts.append(of_counts)
            new_rows.append(of_rows.view(np.float64).reshape(n, -1))
            new_entries.append(of_entries.view(np.float64).reshape(-1, entries.shape[1]))
        return np.concatenate(new_rows), np.concatenate(new_counts), np.concatenate(new_entries)


class Trail:
    """Destinations of particles that left this rank, so that data about them on other ranks can follow.

    Nothing is recorded before `begin`.
    """

    def __init__(self) -> None:
        self._left: list[tuple[np.ndarray, np.ndarray]] | None = None

    def begin(self) -> None:
        """Start to record departures."""
        self._left = []

    def note(self, gid: np.ndarray, owner: np.ndarray) -> None:
        """Record that the particles gid (n,) i8 moved to the ranks owner (n,) i8."""
        if self._left is not None and len(gid):
            self._left.append((gid, owner))

    def follow(self, comm: Comm, mine: np.ndarray, gid: np.ndarray, *columns: np.ndarray) -> tuple[np.ndarray, ...]:
        """Send rows (n, ...) about the particles gid (n,) i8, which were here at `begin`, to their present owners.
        Collective.

        Returns the rows about `mine` (m,) i8, the particles owned now: gid, then the columns. Rows about deleted
        particles are dropped.

        A particle that left more than once is followed from rank to rank. Its last departure from here is later than
        its stay here, so the search ends.
        """
        if self._left is None:
            return tuple(column[:0] for column in (gid, *columns))
        left = self._left[::-1]
        gone, first = np.unique(np.concatenate([np.empty(0, np.int64), *(g for g, _ in left)]), return_index=True)
        to = np.concatenate([np.empty(0, np.int64), *(owner for _, owner in left)])[first]
        here: list[tuple[np.ndarray, ...]] = []
        rows = (gid, *columns)
        while True:
            stays = np.isin(rows[0], mine)
            here.append(tuple(column[stays] for column in rows))
            goes = ~stays & np.isin(rows[0], gone)
            rows = tuple(column[goes] for column in rows)
            if not comm.any(bool(goes.any())):
                return tuple(np.concatenate(column) for column in zip(*here))
            rows = comm.to_ranks(to[np.searchsorted(gone, rows[0])], *rows)[1:]

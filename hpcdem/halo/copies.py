"""Copies of numbered rows that other ranks own: found once, then renewed by messages to their owners only."""

from __future__ import annotations

import numpy as np

from hpcdem.core.comm import Comm

COPIES = 31
"""Tag of messages."""


def _home(comm: Comm, numbers: np.ndarray, total: int) -> np.ndarray:
    """Return the rank that stores the address of each number (n,): equal parts of all numbers."""
    return numbers * comm.size // max(total, 1)


def moved(
    comm: Comm, total: int, had: np.ndarray, rows: np.ndarray, mine: np.ndarray, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Move rows to new owners. Collective.

    had (n,), rows (n, k): numbers below `total` that this rank had, with their rows; mine (m,): numbers that it owns
    now, each on one rank; wanted (w,): numbers of which it needs copies. Returns the rows of `mine` (m, k), zero for
    rows that no rank had, and the ranks that own `wanted` (w,).
    """
    _, number, values = comm.to_ranks(_home(comm, had, total), had, rows)
    source, asked = comm.to_ranks(_home(comm, mine, total), mine)
    order = np.argsort(number)
    at = np.searchsorted(number[order], asked)
    at = np.minimum(at, max(len(number) - 1, 0))
    found = np.zeros((len(asked), rows.shape[1]))
    if len(number):
        known = number[order[at]] == asked
        found[known] = values[order[at[known]]]
    kept = _answered(comm, _home(comm, mine, total), source, found)
    where = np.argsort(asked)
    asker, questions = comm.to_ranks(_home(comm, wanted, total), wanted)
    answers = source[where][np.searchsorted(asked[where], questions)] if len(questions) else questions
    return kept, _answered(comm, _home(comm, wanted, total), asker, answers)


def _answered(comm: Comm, target: np.ndarray, source: np.ndarray, answers: np.ndarray) -> np.ndarray:
    """Return the answers to the queries sent to the ranks `target`, in the order of the queries."""
    _, came = comm.to_ranks(source, answers)
    out = np.empty_like(came)
    out[np.argsort(target, kind="stable")] = came
    return out


class Copies:
    """Rows from `first` on of a table (n, k) f8, which are copies of rows of other ranks."""

    def __init__(self, comm: Comm, mine: np.ndarray, wanted: np.ndarray, owner: np.ndarray, table: np.ndarray) -> None:
        """mine (m,): numbers of the first rows of the table, ascending; wanted (w,): numbers of the other rows, in the
        order of their owners (w,). Collective."""
        self.comm, self.table, self.requests = comm, table, []
        source, asked = comm.to_ranks(owner, wanted)
        self.rows = np.searchsorted(mine, asked)
        self.parcel = np.empty((len(asked), table.shape[1]))
        if comm.mpi is None:
            return
        for ranks, rows, start in (
            (owner, table[len(mine) :], comm.mpi.Recv_init),
            (source, self.parcel, comm.mpi.Send_init),
        ):
            for rank in np.unique(ranks).tolist():
                first, last = np.searchsorted(ranks, [rank, rank + 1])
                self.requests.append(start(rows[first:last].reshape(-1).view(np.uint8), rank, COPIES))

    def refresh(self) -> None:
        """Copy the present rows of the owners. Collective among the ranks concerned."""
        if self.requests:
            self.parcel[:] = self.table[self.rows]
            self.comm.start_all(self.requests)
            self.comm.wait_all(self.requests)

    def close(self) -> None:
        """Free the requests of MPI."""
        for request in self.requests:
            request.Free()
        self.requests = []

"""Ghosts: copies of the neighbours' border columns.

Three verbs, after HOOMD-blue: *migrate* (ownership follows position; migrate.py), *connect* (choose and send ghosts)
and *refresh* (every step: the same ghosts, new values). The first two happen only when the lists are rebuilt.

Particles are sorted by column, so the border column is a contiguous piece of the particle rows and lands in a
contiguous piece on the other side: the requests work on the rows themselves, nothing is packed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

TO_LEFT, TO_RIGHT = 11, 12


class Halo:
    """The exchange with the two neighbours for one set of lists.

    n_left, n_right: ghosts; first, last: owned rows sent to the left (the first `first`) and right (the last `last`).
    """

    def __init__(self, comm: Any, n_own: int, first: int, last: int) -> None:
        self.comm, self.n_own, self.first, self.last = comm, n_own, first, last
        self.requests: list = []
        self.n_left = self.n_right = 0
        if comm.mpi is None:
            return
        from mpi4py import MPI

        self.left = comm.rank - 1 if comm.rank > 0 else MPI.PROC_NULL
        self.right = comm.rank + 1 if comm.rank + 1 < comm.size else MPI.PROC_NULL
        counts = np.zeros(2, np.int64)
        out = np.array([first, last], np.int64)
        self._swap(counts[0:1], out[0:1], out[1:2], counts[1:2])
        self.n_left, self.n_right = int(counts[0]), int(counts[1])

    def _pieces(self, rows: np.ndarray) -> tuple:
        a, b = self.n_left, self.n_left + self.n_own
        return rows[:a], rows[a : a + self.first], rows[b - self.last : b], rows[b:]

    def fill(self, rows: np.ndarray) -> None:
        """Set the ghost rows of any storage-ordered array (n, ...) from their owners. Collective."""
        if self.comm.mpi is None:
            return
        self._swap(*(_bytes(piece) for piece in self._pieces(rows)))

    def _swap(self, from_left: np.ndarray, to_left: np.ndarray, to_right: np.ndarray, from_right: np.ndarray) -> None:
        mpi = self.comm.mpi
        self.comm.wait(
            mpi.Irecv(from_left, self.left, TO_RIGHT),
            mpi.Irecv(from_right, self.right, TO_LEFT),
            mpi.Isend(to_left, self.left, TO_LEFT),
            mpi.Isend(to_right, self.right, TO_RIGHT),
        )

    def keep_fresh(self, rows: np.ndarray) -> None:
        """From now on `refresh` renews the ghost rows of this array; its memory must stay where it is."""
        if self.comm.mpi is None:
            return
        from_left, to_left, to_right, from_right = self._pieces(rows)
        mpi = self.comm.mpi
        for piece, start, peer, tag in (
            (from_left, mpi.Recv_init, self.left, TO_RIGHT),
            (from_right, mpi.Recv_init, self.right, TO_LEFT),
            (to_left, mpi.Send_init, self.left, TO_LEFT),
            (to_right, mpi.Send_init, self.right, TO_RIGHT),
        ):
            if len(piece):
                self.requests.append(start(_bytes(piece), peer, tag))

    def refresh(self) -> None:
        """Ghosts carry the owners' present state in; nothing comes out."""
        if self.requests:
            from mpi4py import MPI

            MPI.Prequest.Startall(self.requests)
            self.comm.wait(*self.requests)

    def close(self) -> None:
        """Give the requests back to MPI."""
        for request in self.requests:
            request.Free()
        self.requests = []


def _bytes(rows: np.ndarray) -> np.ndarray:
    return rows.reshape(-1).view(np.uint8)


def connect(comm: Any, hot: np.ndarray, cx: np.ndarray, borders: np.ndarray) -> tuple[np.ndarray, Halo]:
    """Storage with ghosts for owned rows `hot` (n, w) sorted by column `cx` (n,), and the halo that keeps it fresh."""
    first = int(np.searchsorted(cx, borders[comm.rank], side="right")) if comm.rank > 0 else 0
    last = 0
    if comm.rank + 1 < comm.size:
        last = len(cx) - int(np.searchsorted(cx, borders[comm.rank + 1] - 1, side="left"))
    halo = Halo(comm, len(hot), first, last)
    storage = np.empty((halo.n_left + len(hot) + halo.n_right, hot.shape[1]))
    storage[halo.n_left : halo.n_left + len(hot)] = hot
    halo.fill(storage)
    halo.keep_fresh(storage)
    return storage, halo

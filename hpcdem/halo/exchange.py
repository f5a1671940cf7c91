"""Ghosts: copies of the boundary columns of the neighbours.

Three operations, after HOOMD-blue: *migrate* (ownership follows position; migrate.py), *connect* (choose and send
ghosts) and *refresh* (every step: new values of the same ghosts). The first two happen only when the lists are rebuilt.

Particles are sorted by column. A boundary column is therefore a contiguous part of the rows, and arrives as a
contiguous part on the other side: messages use the rows directly, without packing.
"""

from __future__ import annotations

import numpy as np

from hpcdem.core.cells import COLUMN
from hpcdem.core.comm import Comm
from hpcdem.core.memory import aligned, take_rows

TO_LEFT, TO_RIGHT = 11, 12
BACK = 2
"""Added to the tags of a second table of rows."""


class Halo:
    """The exchange with the two neighbours for one set of lists.

    n_left, n_right: number of ghosts; first, last: number of owned rows sent to the left (the first ones) and to the
    right (the last ones). border: these rows as ranges of owned particles; inside: the other rows. If the border moves
    before `start`, the messages travel while the inside moves.
    """

    def __init__(self, comm: Comm, n_own: int, first: int, last: int) -> None:
        self.comm, self.n_own, self.first, self.last = comm, n_own, first, last
        self.requests: list = []
        self.more: list = []
        # Owned particles first : last that others wait for, in up to two pieces, and the rest between them.
        first, last = min(first, n_own), min(last, n_own)
        if first + last >= n_own:
            self.border, self.inside = [(0, n_own)] if first + last > 0 else [], (0, 0 if first + last else n_own)
        else:
            self.border = [piece for piece in ((0, first), (n_own - last, n_own)) if piece[0] < piece[1]]
            self.inside = (first, n_own - last)
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
        """Set the ghost rows of any array in storage order (n, ...) from their owners. Collective."""
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

    def add_ghost_field(self, rows: np.ndarray) -> None:
        """Include this array in `refresh`; its memory must not move."""
        self.requests += self._persistent(rows, 0)

    def add_late_ghost_field(self, rows: np.ndarray) -> None:
        """Include this array in `refresh_more`."""
        self.more += self._persistent(rows, BACK)

    def storage(self, rows: np.ndarray) -> np.ndarray:
        """Make storage with ghosts, renewed by `refresh`, for owned rows (n, w) in this order. Collective."""
        out = aligned((self.n_left + self.n_own + self.n_right, rows.shape[1]))
        out[self.n_left : self.n_left + self.n_own] = rows
        self.fill(out)
        self.add_ghost_field(out)
        return out

    def _persistent(self, rows: np.ndarray, shift: int) -> list:
        if self.comm.mpi is None:
            return []
        from_left, to_left, to_right, from_right = self._pieces(rows)
        mpi = self.comm.mpi
        return [
            start(_bytes(piece), peer, tag + shift)
            for piece, start, peer, tag in (
                (from_left, mpi.Recv_init, self.left, TO_RIGHT),
                (from_right, mpi.Recv_init, self.right, TO_LEFT),
                (to_left, mpi.Send_init, self.left, TO_LEFT),
                (to_right, mpi.Send_init, self.right, TO_RIGHT),
            )
            if len(piece)
        ]

    def start(self) -> None:
        """Begin to renew the ghosts. Until `finish`, rows of `border` must not change and ghosts must not be read."""
        if self.requests:
            self.comm.start_all(self.requests)

    def finish(self) -> None:
        """Wait until ghosts have the state that the owners had at `start`."""
        if self.requests:
            self.comm.wait_all(self.requests)

    def refresh(self) -> None:
        """Renew the ghosts: `start` and `finish` in one."""
        self.start()
        self.finish()

    def refresh_more(self) -> None:
        """Renew the ghost rows of the second array."""
        if self.more:
            self.comm.start_all(self.more)
            self.comm.wait_all(self.more)

    def close(self) -> None:
        """Free the requests of MPI."""
        for request in self.requests + self.more:
            request.Free()
        self.requests, self.more = [], []


def _bytes(rows: np.ndarray) -> np.ndarray:
    return rows.reshape(-1).view(np.uint8)


def connect(
    comm: Comm,
    hot: np.ndarray,
    order: np.ndarray,
    cell: np.ndarray,
    borders: np.ndarray,
    threads: int,
    columns: int = 1,
) -> tuple[np.ndarray, Halo]:
    """Make the storage with ghosts for the owned rows hot[order] (n, w), and the halo that keeps it current.

    cell (n,) i8: cells of the owned particles in this order, ascending; columns: how many columns of each neighbour are
    copied. Every rank except the first and the last has at least as many columns.
    """
    first = last = 0
    if comm.rank > 0:
        first = int(np.searchsorted(cell, (int(borders[comm.rank]) + columns) * COLUMN - COLUMN // 2))
    if comm.rank + 1 < comm.size:
        last = len(cell) - int(np.searchsorted(cell, (int(borders[comm.rank + 1]) - columns) * COLUMN - COLUMN // 2))
    halo = Halo(comm, len(order), first, last)
    storage = aligned((halo.n_left + len(order) + halo.n_right, hot.shape[1]))
    take_rows(hot, order, storage[halo.n_left : halo.n_left + len(order)], threads)
    halo.fill(storage)
    halo.add_ghost_field(storage)
    return storage, halo

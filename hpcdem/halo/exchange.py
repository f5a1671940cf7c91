"""Ghosts: copies of rows of other ranks that lie within reach of one's own.

Three operations, after HOOMD-blue: *migrate* (ownership follows position; migrate.py), *connect* (choose and send
ghosts) and *refresh* (every step: new values of the same ghosts). The first two happen only when the lists are rebuilt.

Rows are in one global order, of which a rank owns a piece. The ghosts from each neighbour are therefore a contiguous
part of the storage, before or after the owned rows, and messages arrive there directly. Where ranks own columns, the
rows that a neighbour needs are contiguous too, and are sent directly; otherwise they are packed.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.memory import aligned, take_rows

ROWS = 11
"""Tag of messages."""
BACK = 1
"""Added to the tag for a second table of rows."""

Sends = dict[int, slice | np.ndarray]
"""Owned rows by the rank that gets them: a range, or ascending indices."""


class Halo:
    """The exchange with neighbours for one set of lists.

    n_left, n_right: number of ghosts before and after the owned rows. border: rows that are sent, as ranges of owned
    rows; inside: the other rows. If the border moves before `start`, the messages travel while the inside moves.
    """

    def __init__(self, comm: Comm, n_own: int, sends: Sends) -> None:
        """sends: rows for each rank with which this one exchanges ghosts, by ascending rank. Both ranks list each
        other; either may send nothing. Collective among them."""
        self.comm, self.n_own = comm, n_own
        self.requests: list = []
        self.more: list = []
        self._packed: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self._more_packed: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self.border, self.inside = _border(n_own, sends)
        counts = np.array([_length(rows) for rows in sends.values()], np.int64)
        arriving = np.zeros_like(counts)
        if comm.mpi is not None:
            self._swap((rank, arriving[k : k + 1], counts[k : k + 1]) for k, rank in enumerate(sends))
        before = np.array(list(sends), np.int64) < comm.rank
        self.n_left, self.n_right = int(arriving[before].sum()), int(arriving[~before].sum())
        ends = np.cumsum(arriving) + np.where(before, 0, n_own)
        self._pieces = [
            (rank, slice(int(end - count), int(end)), _shifted(rows, self.n_left))
            for (rank, rows), end, count in zip(sends.items(), ends, arriving)
            if count or _length(rows)
        ]

    def fill(self, rows: np.ndarray) -> None:
        """Set the ghost rows of any array in storage order (n, ...) from their owners. Collective."""
        if self._pieces:
            self._swap((rank, _bytes(rows[to]), _bytes(rows[sent])) for rank, to, sent in self._pieces)

    def _swap(self, parts: Iterable[tuple[int, np.ndarray, np.ndarray]]) -> None:
        """Exchange messages with ranks; parts: (rank, received, sent)."""
        mpi, requests = self.comm.mpi, []
        for rank, comes, goes in parts:
            requests += [mpi.Irecv(comes, rank, ROWS), mpi.Isend(goes, rank, ROWS)]
        self.comm.wait_all(requests)

    def add_ghost_field(self, rows: np.ndarray) -> None:
        """Include this array in `refresh`; its memory must not move."""
        self._persistent(rows, ROWS, self.requests, self._packed)

    def add_late_ghost_field(self, rows: np.ndarray) -> None:
        """Include this array in `refresh_more`."""
        self._persistent(rows, ROWS + BACK, self.more, self._more_packed)

    def storage(self, rows: np.ndarray) -> np.ndarray:
        """Make storage with ghosts, renewed by `refresh`, for owned rows (n, w) in this order. Collective."""
        out = aligned((self.n_left + self.n_own + self.n_right, rows.shape[1]))
        out[self.n_left : self.n_left + self.n_own] = rows
        self.fill(out)
        self.add_ghost_field(out)
        return out

    def _persistent(self, rows: np.ndarray, tag: int, requests: list, packed: list) -> None:
        mpi = self.comm.mpi
        for rank, to, sent in self._pieces:
            parcel = rows[sent]
            if not isinstance(sent, slice):
                packed.append((rows, sent, parcel))
            for piece, start in ((rows[to], mpi.Recv_init), (parcel, mpi.Send_init)):
                if len(piece):
                    requests.append(start(_bytes(piece), rank, tag))

    def start(self) -> None:
        """Begin to renew the ghosts. Until `finish`, rows of `border` must not change and ghosts must not be read."""
        if self.requests:
            _pack(self._packed)
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
            _pack(self._more_packed)
            self.comm.start_all(self.more)
            self.comm.wait_all(self.more)

    def close(self) -> None:
        """Free the requests of MPI."""
        for request in self.requests + self.more:
            request.Free()
        self.requests, self.more = [], []
        self._packed, self._more_packed = [], []


def _bytes(rows: np.ndarray) -> np.ndarray:
    return rows.reshape(-1).view(np.uint8)


def _pack(tables: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> None:
    for rows, which, parcel in tables:
        take_rows(rows, which, parcel)


def _length(rows: slice | np.ndarray) -> int:
    return rows.stop - rows.start if isinstance(rows, slice) else len(rows)


def _shifted(rows: slice | np.ndarray, by: int) -> slice | np.ndarray:
    return slice(rows.start + by, rows.stop + by) if isinstance(rows, slice) else rows + by


def _border(n: int, sends: Sends) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Return the rows that are sent as up to two ranges, and the range between them; all rows if they are scattered."""
    first, last = 0, n
    for rows in sends.values():
        if not isinstance(rows, slice):
            first = n if len(rows) else first
        elif rows.start == 0:
            first = max(first, rows.stop)
        else:
            last = min(last, rows.start)
    if first >= last:
        return ([(0, n)], (0, 0)) if n else ([], (0, 0))
    return [piece for piece in ((0, first), (last, n)) if piece[0] < piece[1]], (first, last)


def connect(comm: Comm, hot: np.ndarray, order: np.ndarray, sends: Sends, threads: int) -> tuple[np.ndarray, Halo]:
    """Make the storage with ghosts for the owned rows hot[order] (n, w), and the halo that keeps it current; sends: of
    these rows, see `Halo`."""
    halo = Halo(comm, len(order), sends)
    storage = aligned((halo.n_left + len(order) + halo.n_right, hot.shape[1]))
    take_rows(hot, order, storage[halo.n_left : halo.n_left + len(order)], threads)
    halo.fill(storage)
    halo.add_ghost_field(storage)
    return storage, halo

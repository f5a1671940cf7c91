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
SPEED = 2
"""Column of the velocity along x in rows of a periodic model (core.fields.VX)."""
BACK = 1
"""Offset of the tag for a second table of rows."""
ONWARDS = 2
"""Offset of the tag for messages to a later neighbour: of two periodic ranks, each is both neighbours of the other."""

Sends = dict[int, slice | np.ndarray]
"""Owned rows by the rank that gets them: a range, or ascending indices. Periodic models have one more neighbour at
either end of the line: -1 is the last rank, the number of ranks is the first one."""


class Halo:
    """The exchange with neighbours for one set of lists.

    n_left, n_right: number of ghosts before and after the owned rows. border: rows that are sent, as ranges of owned
    rows; inside: the other rows. If the border moves before `start`, the messages travel while the inside moves.
    images: owned rows (ranges) that are sent past an end of a periodic model. followers: exchanges that are freed with
    this one.
    """

    def __init__(
        self, comm: Comm, n_own: int, sends: Sends, period: float = 0.0, widening: float = 0.0, behind: bool = False
    ) -> None:
        """sends: rows for each rank with which this one exchanges ghosts, by ascending rank. Both ranks list each
        other; either may send nothing. period [m]: length of a periodic model; ghosts from past its ends are images,
        moved by it in the first column of rows that hold positions; widening [m/s]: its rate, by which images of rows
        that hold velocities, x in their third column, are faster. behind: all ghosts follow the owned rows. Collective
        among them."""
        self.comm, self.n_own, self.period, self.widening = comm, n_own, period, widening
        self.requests: list = []
        self.more: list = []
        self._under_way = False
        self.followers: list[Halo] = []
        self._packed: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self._more_packed: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self._copied: list[tuple[np.ndarray, slice, slice | np.ndarray]] = []
        self._places: list[np.ndarray] = []
        self.border, self.inside = _border(n_own, sends)
        counts = np.array([_length(rows) for rows in sends.values()], np.int64)
        if comm.size == 1:  # its own neighbour on both sides
            arriving, sends = counts[::-1], dict(zip(sends, reversed(sends.values())))
        else:
            arriving = np.zeros_like(counts)
            self._swap((number, arriving[k : k + 1], counts[k : k + 1]) for k, number in enumerate(sends))
        before = np.array(list(sends), np.int64) < (-1 if behind else comm.rank)
        self.n_left, self.n_right = int(arriving[before].sum()), int(arriving[~before].sum())
        ends = np.cumsum(arriving) + np.where(before, 0, n_own)
        self._pieces = [
            (number, slice(int(end - count), int(end)), _shifted(rows, self.n_left))
            for (number, rows), end, count in zip(sends.items(), ends, arriving)
            if count or _length(rows)
        ]
        past = [(to, sent, number // comm.size) for number, to, sent in self._pieces if number // comm.size]
        self._images = [(to, by) for to, _, by in past]
        self.images = [_shifted(sent, -self.n_left) for _, sent, _ in past]

    def fill(self, rows: np.ndarray, speeds: bool = False) -> None:
        """Set the ghost rows of any array in storage order (n, ...) from their owners; speeds: it begins with x, y and
        the velocity along x, those of images are moved. Collective."""
        if self.comm.size == 1:
            for _, to, sent in self._pieces:
                rows[to] = rows[sent]
        elif self._pieces:
            self._swap((number, _bytes(rows[to]), _bytes(rows[sent])) for number, to, sent in self._pieces)
        if speeds:
            self.move_images(rows, speeds)

    def move_images(self, rows: np.ndarray, speeds: bool = False, period: float = 0.0) -> None:
        """Move the images among rows (n, ...) in storage order, which begin with x [m], by the period, the present
        one or another; speeds: they begin with x, y and the velocity along x, which changes by the widening."""
        for to, by in self._images:
            rows[to, 0] += by * (period or self.period)
            if speeds and self.widening:
                rows[to, SPEED] += by * self.widening

    def _swap(self, parts: Iterable[tuple[int, np.ndarray, np.ndarray]]) -> None:
        """Exchange messages with neighbours; parts: (number of the neighbour, received, sent)."""
        mpi, requests = self.comm.mpi, []
        for number, comes, goes in parts:
            rank, of_theirs, of_ours = self._line(number, ROWS)
            requests += [mpi.Irecv(comes, rank, of_theirs), mpi.Isend(goes, rank, of_ours)]
        self.comm.wait_all(requests)

    def _line(self, number: int, tag: int) -> tuple[int, int, int]:
        """Rank of a neighbour, tags of what comes from it and of what goes to it."""
        tags = (tag, tag + ONWARDS) if number > self.comm.rank else (tag + ONWARDS, tag)
        return number % self.comm.size, *tags

    def owners(self) -> np.ndarray:
        """Return the rank that owns each row of the storage (n,)."""
        out = np.full(self.n_left + self.n_own + self.n_right, self.comm.rank)
        for number, to, _ in self._pieces:
            out[to] = number % self.comm.size
        return out

    def add_ghost_field(self, rows: np.ndarray, speeds: bool = False) -> None:
        """Include this array in `refresh`; its memory must not move. speeds: it begins with x, y and the velocity along
        x."""
        self._persistent(rows, ROWS, self.requests, self._packed)
        if self.comm.size == 1:
            self._copied += [(rows, to, sent) for _, to, sent in self._pieces]
        if speeds and self._images:
            self._places.append(rows)

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
        for number, to, sent in self._pieces if self.comm.size > 1 else ():
            parcel = rows[sent]
            if not isinstance(sent, slice):
                packed.append((rows, sent, parcel))
            rank, of_theirs, of_ours = self._line(number, tag)
            for piece, start, label in ((rows[to], mpi.Recv_init, of_theirs), (parcel, mpi.Send_init, of_ours)):
                if len(piece):
                    requests.append(start(_bytes(piece), rank, label))

    def start(self) -> None:
        """Begin to renew the ghosts. Until `finish`, rows of `border` must not change and ghosts must not be read."""
        self._under_way = True
        if self.requests:
            _pack(self._packed)
            self.comm.start_all(self.requests)
        for rows, to, sent in self._copied:
            rows[to] = rows[sent]

    def finish(self) -> None:
        """Wait until ghosts have the state that the owners had at `start`, unless it was waited for already."""
        if not self._under_way:
            return
        self._under_way = False
        if self.requests:
            self.comm.wait_all(self.requests)
        for rows in self._places:
            self.move_images(rows, speeds=True)

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
        for follower in self.followers:
            follower.close()
        for request in self.requests + self.more:
            request.Free()
        self.requests, self.more = [], []
        self._packed, self._more_packed, self._copied, self._places = [], [], [], []


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


def connect(
    comm: Comm, hot: np.ndarray, order: np.ndarray, sends: Sends, threads: int, period: float = 0.0,
    widening: float = 0.0, keep: bool = True,
) -> tuple[np.ndarray, Halo]:  # fmt: skip
    """Make the storage with ghosts for the owned rows hot[order] (n, w), and the halo, which keeps it current unless
    `keep` is False; sends: of these rows; period, widening: see `Halo`. Where there is a period, rows begin with x, y
    and the velocity along x."""
    halo = Halo(comm, len(order), sends, period, widening)
    storage = aligned((halo.n_left + len(order) + halo.n_right, hot.shape[1]))
    take_rows(hot, order, storage[halo.n_left : halo.n_left + len(order)], threads)
    halo.fill(storage, speeds=True)
    if keep:
        halo.add_ghost_field(storage, speeds=True)
    return storage, halo

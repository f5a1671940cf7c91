"""The communicator: one set of operations for one rank and for many.

`SerialComm` does nothing where nothing needs doing, so that no other module asks how many ranks there are.

MPI libraries wait by spinning, which is the fastest way while every rank has a core of its own. With more ranks than
cores on a host, a spinning rank keeps the core from the one it waits for, and a step takes milliseconds instead of
microseconds. There `MpiComm` asks and sleeps in turn; only calls that do not block make that possible, so all of its
operations are built on them.
"""

from __future__ import annotations

import math
import os
import pickle
import time
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError


class SerialComm:
    """One rank: every collective operation is the identity."""

    rank = 0
    size = 1
    mpi: Any = None
    crowded = False
    """More ranks than cores on some host."""

    def barrier(self) -> None:
        """Wait for all ranks."""

    def bcast(self, obj: Any, root: int = 0) -> Any:
        """The object of rank `root`, on all ranks."""
        return obj

    def gather(self, obj: Any) -> list | None:
        """List of the objects of all ranks on rank 0, None elsewhere."""
        return [obj]

    def allgather(self, obj: Any) -> list:
        """List of the objects of all ranks, on all ranks."""
        return [obj]

    def any(self, flag: bool) -> bool:
        """True everywhere if true anywhere."""
        return bool(flag)

    def max_into(self, array: np.ndarray) -> np.ndarray:
        """Elementwise maximum over the ranks, in place."""
        return array

    def min_into(self, array: np.ndarray) -> np.ndarray:
        """Elementwise minimum over the ranks, in place."""
        return array

    def sum_into(self, array: np.ndarray) -> np.ndarray:
        """Elementwise sum over the ranks, in place. Exact for integers; float sums are for printing only."""
        return array

    def exscan(self, count: int) -> int:
        """Sum of the counts of all lower ranks."""
        return 0

    def exchange(self, parcels: dict[int, np.ndarray]) -> dict[int, np.ndarray]:
        """Collective: hand parcels (n,) i8 to the ranks they are for (not to oneself); returns what came, by sender, in
        order of ranks. Costs messages for these parcels only, however many ranks there are."""
        assert not parcels, "there is no other rank"
        return {}

    def to_ranks(self, target: np.ndarray, *columns: np.ndarray) -> tuple[np.ndarray, ...]:
        """Collective: rows (n, ...) of these columns go to the ranks `target` (n,) i8, to oneself too.

        Returns the rank (m,) i8 that each row that came is from, then the columns; in the order of ranks, those of one
        rank in the order in which it had them. Types and shapes of rows are equal on all ranks. One `exchange`.
        """
        small = target.astype(np.uint16) if self.size <= 1 << 16 else target  # which numpy sorts in linear time
        order = np.argsort(small, kind="stable")
        cuts = np.flatnonzero(np.diff(target[order])) + 1
        parts = {int(target[rows[0]]): rows for rows in np.split(order, cuts) if len(rows)}
        parcels = {to: _packed([c[rows] for c in columns]) for to, rows in parts.items() if to != self.rank}
        arrived = {source: _unpacked(parcel, columns) for source, parcel in self.exchange(parcels).items()}
        if self.rank in parts:
            arrived[self.rank] = [column[parts[self.rank]] for column in columns]
        ranks = sorted(arrived)
        sources = np.repeat(np.array(ranks, np.int64), [len(arrived[rank][0]) for rank in ranks])
        every = [np.concatenate([c[:0], *(arrived[rank][k] for rank in ranks)]) for k, c in enumerate(columns)]
        return sources, *every

    def agree(self, error: str | None) -> None:
        """Collective: raise HpcdemError on every rank if any rank hands in a message (the lowest rank's is used)."""
        if error is not None:
            raise HpcdemError(error)

    def abort(self, code: int) -> None:
        """End the whole job at once."""
        raise SystemExit(code)


PARCELS = 21
"""Tag of messages of `exchange`; every other call uses the next one."""
NAP = 2e-5
"""Sleep between two questions on a crowded host [s]; the kernel adds some 50 us."""


class MpiComm(SerialComm):
    """The same operations over an mpi4py communicator."""

    def __init__(self, mpi: Any) -> None:
        from mpi4py import MPI

        self._wait_all, self._test_all = MPI.Request.Waitall, MPI.Request.Testall
        self.start_all = MPI.Prequest.Startall
        """Start the persistent requests of a list."""
        self.mpi = mpi
        self.rank = mpi.Get_rank()
        self.size = mpi.Get_size()
        self.crowded = _more_ranks_than_cores(mpi)
        self._exchanges = 0

    def wait(self, *requests: Any) -> None:
        """Until all these requests are done."""
        self.wait_all(list(requests))

    def wait_all(self, requests: list) -> None:
        """Until all requests of the list are done."""
        if not self.crowded:
            self._wait_all(requests)
            return
        while not self._test_all(requests):
            time.sleep(NAP)

    def barrier(self) -> None:
        self.wait(self.mpi.Ibarrier())

    def bcast(self, obj: Any, root: int = 0) -> Any:
        payload = _pickled(obj) if self.rank == root else np.empty(0, np.uint8)
        count = np.array([len(payload)], np.int64)
        self.wait(self.mpi.Ibcast(count, root))
        if self.rank != root:
            payload = np.empty(int(count[0]), np.uint8)
        self.wait(self.mpi.Ibcast(payload, root))
        return obj if self.rank == root else pickle.loads(payload.data)

    def gather(self, obj: Any) -> list | None:
        payload = _pickled(obj)
        counts = np.empty(self.size, np.int64)
        self.wait(self.mpi.Iallgather(np.array([len(payload)], np.int64), counts))
        received = np.empty(int(counts.sum()) if self.rank == 0 else 0, np.uint8)
        self.wait(self.mpi.Igatherv(payload, [received, (counts, _starts(counts))] if self.rank == 0 else None, 0))
        return _unpickled(received, counts) if self.rank == 0 else None

    def allgather(self, obj: Any) -> list:
        payload = _pickled(obj)
        counts = np.empty(self.size, np.int64)
        self.wait(self.mpi.Iallgather(np.array([len(payload)], np.int64), counts))
        received = np.empty(int(counts.sum()), np.uint8)
        self.wait(self.mpi.Iallgatherv(payload, [received, (counts, _starts(counts))]))
        return _unpickled(received, counts)

    def any(self, flag: bool) -> bool:
        return bool(self.max_into(np.array([1 if flag else 0], dtype=np.int64))[0])

    def _reduce_into(self, array: np.ndarray, op: Any) -> np.ndarray:
        from mpi4py import MPI

        if self.crowded:
            self.wait(self.mpi.Iallreduce(MPI.IN_PLACE, array, op=op))
        else:
            self.mpi.Allreduce(MPI.IN_PLACE, array, op=op)
        return array

    def max_into(self, array: np.ndarray) -> np.ndarray:
        from mpi4py import MPI

        return self._reduce_into(array, MPI.MAX)

    def min_into(self, array: np.ndarray) -> np.ndarray:
        from mpi4py import MPI

        return self._reduce_into(array, MPI.MIN)

    def sum_into(self, array: np.ndarray) -> np.ndarray:
        from mpi4py import MPI

        return self._reduce_into(array, MPI.SUM)

    def exscan(self, count: int) -> int:
        before = np.zeros(1, np.int64)  # rank 0 gets nothing
        self.wait(self.mpi.Iexscan(np.array([count], np.int64), before))
        return int(before[0]) if self.rank else 0

    def exchange(self, parcels: dict[int, np.ndarray]) -> dict[int, np.ndarray]:
        """Nobody knows who sends to it. So a rank takes what comes until its own parcels have been received, enters a
        barrier that does not block, and goes on taking until all are there: then nothing is on its way any more
        (Hoefler, Siebert & Lumsdaine 2010, NBX). A rank may be a call ahead of another, hence two tags in turn."""
        from mpi4py import MPI

        mpi, tag, status = self.mpi, PARCELS + self._exchanges % 2, MPI.Status()
        self._exchanges += 1
        sent = [mpi.Issend([parcel, MPI.INT64_T], to, tag) for to, parcel in parcels.items()]
        arrived: dict[int, np.ndarray] = {}
        all_received: Any = None
        while True:
            message = mpi.Improbe(MPI.ANY_SOURCE, tag, status)
            if message is not None:
                parcel = np.empty(status.Get_count(MPI.INT64_T), np.int64)
                message.Recv([parcel, MPI.INT64_T])
                arrived[status.Get_source()] = parcel
            elif all_received is None:
                if self._test_all(sent):
                    all_received = mpi.Ibarrier()
            elif all_received.Test():
                return dict(sorted(arrived.items()))
            elif self.crowded:
                time.sleep(NAP)

    def agree(self, error: str | None) -> None:
        if not self.any(error is not None):
            return
        raise HpcdemError(next(e for e in self.allgather(error) if e is not None))

    def abort(self, code: int) -> None:
        self.mpi.Abort(code)


def _more_ranks_than_cores(mpi: Any) -> bool:
    """Whether any host has more ranks than cores that they may use between them."""
    from mpi4py import MPI

    host = mpi.Split_type(MPI.COMM_TYPE_SHARED)
    mine = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set(range(os.cpu_count() or 1))
    cores = set().union(*host.allgather(mine))
    crowded = host.Get_size() > len(cores)
    host.Free()
    return bool(mpi.allreduce(crowded, op=MPI.LOR))


def _pickled(obj: Any) -> np.ndarray:
    return np.frombuffer(pickle.dumps(obj, protocol=pickle.HIGHEST_PROTOCOL), dtype=np.uint8)


def _unpickled(payload: np.ndarray, counts: np.ndarray) -> list:
    return [pickle.loads(part.data) for part in np.split(payload, np.cumsum(counts)[:-1])]


def _packed(columns: list[np.ndarray]) -> np.ndarray:
    """(words,) i8: number of rows, then one column after the other, each filled up to whole words."""
    whole = [np.frombuffer(c.tobytes() + bytes(-c.nbytes % 8), np.int64) for c in columns]
    return np.concatenate([np.array([len(columns[0])]), *whole])


def _unpacked(parcel: np.ndarray, like: tuple[np.ndarray, ...]) -> list[np.ndarray]:
    """The columns of a parcel; like: arrays with rows of the same type and shape."""
    n, at, found = int(parcel[0]), 8, []
    flat = parcel.view(np.uint8)
    for column in like:
        size = n * column.dtype.itemsize * math.prod(column.shape[1:])
        found.append(flat[at : at + size].view(column.dtype).reshape(n, *column.shape[1:]))
        at += size + -size % 8
    return found


def _starts(counts: np.ndarray) -> np.ndarray:
    return np.cumsum(counts) - counts

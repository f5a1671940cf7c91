"""The communicator of several ranks, over mpi4py.

MPI libraries wait by spinning, which is fastest while every rank has its own core. With more ranks than cores on a
host, a spinning rank keeps the core from the rank it waits for, and a step takes milliseconds instead of microseconds.
In that case `MpiComm` polls and sleeps in turn. Only non-blocking calls allow this, so all operations are built on
them.
"""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from hpcdem.core.comm import Comm, SerialComm, T
from hpcdem.core.errors import HpcdemError
from hpcdem.halo.shared import Nodes

__all__ = ["MpiComm", "SerialComm"]

PARCELS = 21
"""Tag of messages of `exchange`; each further call uses the next tag."""
NAP = 2e-5
"""Sleep between two polls on a crowded host [s]; the kernel adds some 50 us."""


class MpiComm(Comm):
    """Operations of `SerialComm` over an mpi4py communicator. of: the communicator of which it is a part, with the same
    cores."""

    def __init__(self, mpi: Any, of: MpiComm | None = None) -> None:
        from mpi4py import MPI

        self._wait_all, self._test_all = MPI.Request.Waitall, MPI.Request.Testall
        self._start_all = MPI.Prequest.Startall
        self.mpi = mpi
        self.rank = mpi.Get_rank()
        self.size = mpi.Get_size()
        self._exchanges = 0
        self.crowded, self.here = False, 1
        if of is not None:
            self.crowded, self.here = of.crowded, of.here
            return
        host = mpi.Split_type(MPI.COMM_TYPE_SHARED, self.rank)
        self.crowded = _more_ranks_than_cores(mpi, host)
        self.here = host.Get_size()
        leads = mpi.Split(MPI.UNDEFINED if host.Get_rank() else 0, self.rank)
        self.nodes = Nodes(MpiComm(host, self), None if leads == MPI.COMM_NULL else MpiComm(leads, self))

    def start_all(self, requests: list[Any]) -> None:
        self._start_all(requests)

    def wait(self, *requests: Any) -> None:
        self.wait_all(list(requests))

    def wait_all(self, requests: list) -> None:
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

    def per_node(self, make: Callable[[], T], once: bool = False) -> T:
        made: T = self.nodes.share(make, once)
        return made

    def warns_by(self, warn: Callable[[str], None]) -> None:
        self.nodes.warn = warn

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
        """Exchange messages although no rank knows who sends to it.

        A rank receives until its own messages have arrived, enters a non-blocking barrier, and keeps receiving until
        all ranks have entered it: then no message is in transit (Hoefler, Siebert & Lumsdaine 2010, NBX). A rank may be
        one call ahead of another, so two tags alternate.
        """
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


def _more_ranks_than_cores(mpi: Any, host: Any) -> bool:
    """Return whether any host has more ranks than cores that they may use; host: communicator of the ranks of this
    host."""
    from mpi4py import MPI

    mine = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set(range(os.cpu_count() or 1))
    cores = set().union(*host.allgather(mine))
    crowded = host.Get_size() > len(cores)
    return bool(mpi.allreduce(crowded, op=MPI.LOR))


def _pickled(obj: Any) -> np.ndarray:
    return np.frombuffer(pickle.dumps(obj, protocol=pickle.HIGHEST_PROTOCOL), dtype=np.uint8)


def _unpickled(payload: np.ndarray, counts: np.ndarray) -> list:
    return [pickle.loads(part.data) for part in np.split(payload, np.cumsum(counts)[:-1])]


def _starts(counts: np.ndarray) -> np.ndarray:
    starts: np.ndarray = np.cumsum(counts) - counts
    return starts

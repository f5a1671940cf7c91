"""The communicator: one set of verbs for one rank and for many.

`SerialComm` does nothing where nothing needs doing, so that no other module asks how many ranks there are.
Only this file and `exchange.py` call MPI.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.errors import HpcdemError


class SerialComm:
    """One rank: every collective verb is the identity."""

    rank = 0
    size = 1
    mpi: Any = None

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

    def alltoallv(self, parts: list[np.ndarray]) -> list[np.ndarray]:
        """Hand part p to rank p; returns what each rank handed to this one, in rank order. Rows stay whole."""
        return list(parts)

    def agree(self, error: str | None) -> None:
        """Collective: raise HpcdemError on every rank if any rank hands in a message (the lowest rank's is used)."""
        if error is not None:
            raise HpcdemError(error)

    def abort(self, code: int) -> None:
        """End the whole job at once."""
        raise SystemExit(code)


class MpiComm(SerialComm):
    """The same verbs over an mpi4py communicator."""

    def __init__(self, mpi: Any) -> None:
        self.mpi = mpi
        self.rank = mpi.Get_rank()
        self.size = mpi.Get_size()

    def barrier(self) -> None:
        self.mpi.Barrier()

    def bcast(self, obj: Any, root: int = 0) -> Any:
        return self.mpi.bcast(obj, root=root)

    def gather(self, obj: Any) -> list | None:
        return self.mpi.gather(obj, root=0)

    def allgather(self, obj: Any) -> list:
        return self.mpi.allgather(obj)

    def any(self, flag: bool) -> bool:
        return bool(self.max_into(np.array([1 if flag else 0], dtype=np.int64))[0])

    def _reduce_into(self, array: np.ndarray, op: Any) -> np.ndarray:
        from mpi4py import MPI

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
        return int(sum(self.mpi.allgather(int(count))[: self.rank]))

    def alltoallv(self, parts: list[np.ndarray]) -> list[np.ndarray]:
        from mpi4py import MPI

        tail = parts[0].shape[1:]
        dtype = parts[0].dtype
        send = np.ascontiguousarray(np.concatenate(parts))
        width = dtype.itemsize * int(np.prod(tail, dtype=np.int64))
        out = np.array([len(p) for p in parts], dtype=np.int64)
        into = np.empty_like(out)
        self.mpi.Alltoall(out, into)
        recv = np.empty((int(into.sum()), *tail), dtype=dtype)
        # One MPI item is one row, so counts stay far from the 2**31 limit of MPI's int arguments.
        row = MPI.BYTE.Create_contiguous(width).Commit()
        try:
            displs = [np.concatenate(([0], np.cumsum(c)[:-1])) for c in (out, into)]
            self.mpi.Alltoallv([send, (out, displs[0]), row], [recv, (into, displs[1]), row])
        finally:
            row.Free()
        return np.split(recv, np.cumsum(into)[:-1])

    def agree(self, error: str | None) -> None:
        if not self.any(error is not None):
            return
        first = next(e for e in self.mpi.allgather(error) if e is not None)
        raise HpcdemError(first)

    def abort(self, code: int) -> None:
        self.mpi.Abort(code)

"""The communicator: one set of operations for one rank and for many.

`SerialComm` does nothing where nothing needs doing, so that no other module asks how many ranks there are; the
operations over MPI are in `halo/comm.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from hpcdem.core.errors import CommandError, HpcdemError

if TYPE_CHECKING:
    import numpy as np

T = TypeVar("T")


class Comm(Protocol):
    """Operations of every communicator. All operations but `wait`, `wait_all`, `start_all` and `abort` are
    collective."""

    rank: int
    size: int
    mpi: Any
    """The communicator of mpi4py, None without MPI."""
    crowded: bool
    """True if a host has more ranks than cores."""
    here: int
    """Number of ranks on this node of the machine."""

    def barrier(self) -> None:
        """Wait for all ranks."""

    def bcast(self, obj: Any, root: int = 0) -> Any:
        """The object of rank `root`, on all ranks."""

    def gather(self, obj: Any) -> list[Any] | None:
        """List of the objects of all ranks on rank 0, None elsewhere."""

    def allgather(self, obj: Any) -> list[Any]:
        """List of the objects of all ranks, on all ranks."""
        ...

    def per_node(self, make: Callable[[], T], once: bool = False) -> T:
        """The result of `make()`, which is equal on all ranks and calls nothing that is collective.

        The first rank of each node of the machine calls it, and the ranks of the node share one copy of its large
        arrays (halo/shared.py); pages that a rank writes to become its own. once: rank 0 alone calls it, for what need
        not be equal to the last bit. An error of it is raised on all ranks. Collective, except from inside of another
        `make`. Without nodes to distinguish every rank calls it."""
        if not once or self.size == 1:
            return make()
        found: Any = None
        if self.rank == 0:
            try:
                found = make(), None, False
            except HpcdemError as why:
                found = None, str(why), why.exit_code == CommandError.exit_code
        made: T
        made, error, wrong_use = self.bcast(found)
        if error is not None:
            raise (CommandError if wrong_use else HpcdemError)(error)
        return made

    def warns_by(self, warn: Callable[[str], None]) -> None:
        """Function that reports messages about the memory of a node."""
        return None

    def any(self, flag: bool) -> bool:
        """True everywhere if true anywhere."""
        ...

    def max_into(self, array: np.ndarray) -> np.ndarray:
        """Elementwise maximum over the ranks, in place."""
        ...

    def min_into(self, array: np.ndarray) -> np.ndarray:
        """Elementwise minimum over the ranks, in place."""
        ...

    def sum_into(self, array: np.ndarray) -> np.ndarray:
        """Elementwise sum over the ranks, in place. Exact for integers; float sums are for printing only."""
        ...

    def exscan(self, count: int) -> int:
        """Sum of the counts of all lower ranks."""
        ...

    def exchange(self, parcels: dict[int, np.ndarray]) -> dict[int, np.ndarray]:
        """Hand parcels (n,) i8 to the ranks they are for (not to oneself); returns what came, by sender, in order of
        ranks. Costs messages for these parcels only, however many ranks there are."""
        ...

    def to_ranks(self, target: np.ndarray, *columns: np.ndarray) -> tuple[np.ndarray, ...]:
        """Rows (n, ...) of these columns go to the ranks `target` (n,) i8, to oneself too.

        Returns the rank (m,) i8 that each row that came is from, then the columns; in the order of ranks, those of one
        rank in the order in which it had them. Types and shapes of rows are equal on all ranks. One `exchange`.
        """
        import numpy as np

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
        """Raise HpcdemError on every rank if any rank hands in a message (the lowest rank's is used)."""

    def abort(self, code: int) -> None:
        """End the whole job at once."""

    def start_all(self, requests: list[Any]) -> None:
        """Start the persistent requests of a list."""

    def wait(self, *requests: Any) -> None:
        """Until all these requests are done."""

    def wait_all(self, requests: list[Any]) -> None:
        """Until all requests of the list are done."""


class SerialComm(Comm):
    """One rank: every collective operation is the identity."""

    rank = 0
    size = 1
    mpi: Any = None
    crowded = False
    here = 1

    def barrier(self) -> None:
        return None

    def bcast(self, obj: Any, root: int = 0) -> Any:
        return obj

    def gather(self, obj: Any) -> list[Any] | None:
        return [obj]

    def allgather(self, obj: Any) -> list[Any]:
        return [obj]

    def any(self, flag: bool) -> bool:
        return bool(flag)

    def max_into(self, array: np.ndarray) -> np.ndarray:
        return array

    def min_into(self, array: np.ndarray) -> np.ndarray:
        return array

    def sum_into(self, array: np.ndarray) -> np.ndarray:
        return array

    def exscan(self, count: int) -> int:
        return 0

    def exchange(self, parcels: dict[int, np.ndarray]) -> dict[int, np.ndarray]:
        assert not parcels, "a single rank has no other ranks"
        return {}

    def agree(self, error: str | None) -> None:
        if error is not None:
            raise HpcdemError(error)

    def abort(self, code: int) -> None:
        raise SystemExit(code)

    def start_all(self, requests: list[Any]) -> None:
        return None

    def wait(self, *requests: Any) -> None:
        return None

    def wait_all(self, requests: list[Any]) -> None:
        return None


def _packed(columns: list[np.ndarray]) -> np.ndarray:
    """(words,) i8: number of rows, then one column after the other, each filled up to whole words."""
    import numpy as np

    whole = [np.frombuffer(c.tobytes() + bytes(-c.nbytes % 8), np.int64) for c in columns]
    return np.concatenate([np.array([len(columns[0])]), *whole])


def _unpacked(parcel: np.ndarray, like: tuple[np.ndarray, ...]) -> list[np.ndarray]:
    """The columns of a parcel; like: arrays with rows of the same type and shape."""
    import numpy as np

    n, at, found = int(parcel[0]), 8, []
    flat = parcel.view(np.uint8)
    for column in like:
        size = n * column.dtype.itemsize * math.prod(column.shape[1:])
        found.append(flat[at : at + size].view(column.dtype).reshape(n, *column.shape[1:]))
        at += size + -size % 8
    return found

"""A model of any physics: its step, and the rebuild of its lists. The page on which the method can be read.

A rank owns rows (particles, elements) that lie in its strip of the model, and what they remember. A model is either
*closed* (sorted, ghosts in place, lists built: ready to step) or *open* (owned rows and their histories only: free to
be changed). Commands that change who is there open it; the next step closes it again. A rebuild in mid-run is the same
two moves. Everything that decides the order of arithmetic comes from global values and is part of the state, see
`rebuild.RebuildState`.

What a physics brings are the phases, which have their names below: `_begin_step`, `_move_rows`, `_moved`,
`_check_rebuild`, `_end_step`; `_choose_reach`, `_share_out`, `_store`, `_build_lists`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol, Self, TypeVar

import numpy as np

from hpcdem.core.cells import columns
from hpcdem.core.clock import Clock
from hpcdem.core.comm import Comm, SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.core.memory import aligned, take_rows
from hpcdem.core.timers import Timers
from hpcdem.decomp import strips
from hpcdem.engine.rebuild import AT_A_GLANCE, RebuildState
from hpcdem.halo.exchange import connect
from hpcdem.halo.migrate import Migration
from hpcdem.halo.ownership import Ownership

FRESH, LISTS, STORAGE = 0, 1, 2
"""What a check finds outdated: nothing; the lists; storage, order and ghosts with them."""


class Histories(Protocol):
    """What rows remember: entries rows (m, v) f8, of which each has some, one row after the other."""

    rows: np.ndarray

    def counts(self) -> np.ndarray:
        """Entries of each row (n,)."""
        ...

    def take(self, order: np.ndarray) -> Self:
        """Those of the rows in `order`."""
        ...

    def joined(self, counts: np.ndarray, rows: np.ndarray) -> Self:
        """With more rows behind, which have so many entries each."""
        ...


H = TypeVar("H", bound=Histories)


class Model(ABC):
    """comm: halo.comm; threads: per rank; outdir: where results go; log and stop: see runtime (None: silent, never
    stopped); balance_on: borders follow the load. A subclass has `clear`, which makes it empty and calls `restart`.

    closed: ready to step; rebuilds: how often lists were built; halo: the exchange of ghosts, while it is closed."""

    rebuild_state: RebuildState
    closed: bool
    moves_as_one = False
    """Rows are moved in one piece."""

    def __init__(
        self,
        comm: Comm | None = None,
        threads: int = 1,
        outdir: Path | str = "data",
        log: Any = None,
        stop: Any = None,
        balance_on: bool = True,
    ) -> None:
        self.comm = comm if comm is not None else SerialComm()
        self.threads, self.outdir = threads, Path(outdir)
        self.log, self.stop = log, stop
        self.balance_on = balance_on
        self.timers = Timers()
        self.halo: Any = None
        self.prepare_kernels: Callable[[str], object] = lambda kind: None
        """Collective: loads or compiles those of a kind, see `session.KINDS`."""

    def restart(self) -> None:
        """Back to step 0, open, with the first ownership."""
        self.release()
        self.clock = Clock()
        self.ownership = Ownership(self.comm, self.balance_on)
        self.rebuilds = 0
        self.closed = False

    def release(self) -> None:
        """Give back what MPI holds for this simulation. Not collective."""
        if self.halo is not None:
            self.halo.close()
        self.halo = None

    def count(self, n: int) -> int:
        """Sum of an integer over the ranks. Collective."""
        return int(self.comm.sum_into(np.array([n], dtype=np.int64))[0])

    # ---- one step ------------------------------------------------------------------------------------------------

    def step(self) -> int:
        """Advance everything by one dt. The same text for every physics, on one rank and on a thousand.

        Returns the external request (0: none; else see runtime.stop_requests), agreed by all ranks.
        """
        timers, halo, state, request, outdated = self.timers, self.halo, self.rebuild_state, 0, FRESH
        self._begin_step()
        with timers("move"):
            if self.moves_as_one:
                self._move_rows(0, halo.n_own)
                halo.start()
            else:  # the borders first: their new state travels while the others are moved
                for first, last in halo.border:
                    self._move_rows(first, last)
                halo.start()
                self._move_rows(*halo.inside)
            self._moved()
        state.age += 1
        if due := state.passed():
            with timers("reduce"):
                try:
                    outdated, request = self._check_rebuild(due == AT_A_GLANCE)
                except HpcdemError:  # on all ranks
                    halo.finish()  # the script may continue
                    raise
        with timers("halo"):
            halo.finish()
        self._end_step(outdated)
        return request

    def advance(self, steps: int) -> int:
        """Up to `steps` steps; ends early if the outside asks for something, and returns that (0: nothing)."""
        request = done = 0
        try:
            while done < steps and not request:
                request = self.step()
                done += 1
        finally:
            if done:
                self.timers.count(done, self.halo.n_own)
        return request

    @abstractmethod
    def _begin_step(self) -> None:
        """What comes before anything moves. The model is closed."""

    @abstractmethod
    def _move_rows(self, first: int, last: int) -> None:
        """Move the owned rows first : last by dt. Not collective."""

    @abstractmethod
    def _moved(self) -> None:
        """All rows have moved. Not collective."""

    @abstractmethod
    def _check_rebuild(self, glance: bool = False) -> tuple[int, int]:
        """How far has anyone gone since the lists were built? Sets the step of the next check. glance: between two
        checks; it becomes one if somebody has sped up so much that the next might come too late, else nothing changes.

        Returns what is outdated (FRESH, LISTS, STORAGE) and the request from outside. Only global maxima enter.
        """

    @abstractmethod
    def _end_step(self, outdated: int) -> None:
        """Everything has moved, ghosts too: what is outdated is made again, and whatever else acts in a step."""

    # ---- from open to closed -------------------------------------------------------------------------------------

    def close_as_saved(self) -> None:
        """Close a restored model: its rebuild state stays as it was. Collective."""
        self._close(frozen=True)

    def _close(self, frozen: bool = False) -> None:
        """Order, owners, ghosts and lists at the present positions. frozen: keep the rebuild state as it is (restart).
        Collective."""
        with self.timers("neighbour"):
            cell = self._choose_reach(frozen)
        cell, number = self._share_out(cell)
        with self.timers("neighbour"):
            order = strips.global_order(cell, number)
            cell = cell[order]
        with self.timers("halo"):
            self._store(order, cell)
        with self.timers("neighbour"):
            self.rebuilds += 1
            self._build_lists(order, cell, frozen)

    @abstractmethod
    def _choose_reach(self, frozen: bool) -> np.ndarray:
        """Skin and side of cells for the next lists, from global values only, unless they are frozen. Returns the cells
        (n,) i8 of the rows held here."""

    @abstractmethod
    def _share_out(self, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Every row goes to the owner of its column. Returns cells and ids (n,) i8 of those that are owned now."""

    @abstractmethod
    def _store(self, order: np.ndarray, cell: np.ndarray) -> None:
        """Owned rows in this order, with the ghosts around them; cell (n,) i8: in the new order."""

    @abstractmethod
    def _build_lists(self, order: np.ndarray, cell: np.ndarray, frozen: bool) -> None:
        """Lists and tables of the kernels."""

    def _send_home(
        self,
        cell: np.ndarray,
        histories: H,
        tables: Sequence[np.ndarray],
        room: tuple[float, float] | None = None,
        cost: np.ndarray | float = 1.0,
        least: int = 1,
        left: Callable[[np.ndarray, np.ndarray], object] = lambda leave, to: None,
    ) -> tuple[np.ndarray, H, Sequence[np.ndarray]]:
        """Move borders if it pays, then send rows of the tables (n, w) f8, and what they remember, to the owners of
        their columns. room, cost, least: see `Ownership.renew`; left: receives the destinations. Returns cells,
        histories and tables of the rows that are owned now. Collective."""
        with self.timers("balance"):
            self.ownership.renew(
                columns(cell), self.rebuild_state.side, self.clock.step, self.timers.seconds(), room, cost, least
            )
        with self.timers("migrate"):
            leave = strips.strays(cell, self.ownership.borders, self.comm.rank) if self.comm.size > 1 else cell[:0]
            migration = Migration(self.comm, len(cell), leave, self.ownership.owner_of(columns(cell[leave])))
            leave = migration.leave
            left(leave, migration.leave_to)
            rows, leaving = [cell.view(np.float64)[:, None], *tables], histories.take(leave)
            arrived, counts, entries = migration.exchange(
                np.hstack([part[leave] for part in rows]), leaving.counts(), leaving.rows
            )
            if not len(leave) and not len(arrived):
                return cell, histories, tables
            stay, owned, at = migration.stay(), [], 0
            for part in rows:
                table = aligned((len(stay) + len(arrived), part.shape[1]))
                take_rows(part, stay, table[: len(stay)], self.threads)
                table[len(stay) :] = arrived[:, at : at + part.shape[1]]
                owned.append(table)
                at += part.shape[1]
            return owned[0].view(np.int64)[:, 0].copy(), histories.take(stay).joined(counts, entries), owned[1:]

    def _connect(self, rows: np.ndarray, order: np.ndarray, cell: np.ndarray, columns: int = 1) -> np.ndarray:
        """Storage of rows[order] with ghosts, kept fresh by a new halo; columns: of each neighbour. Collective."""
        storage, self.halo = connect(self.comm, rows, order, cell, self.ownership.borders, self.threads, columns)
        return storage

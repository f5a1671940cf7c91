"""A model of any physics: its step and the rebuild of its lists. Read this page to understand the method.

A rank owns the rows (particles, elements) that lie in its strip of the model, with their histories. A model is either
*closed* (sorted, with ghosts and lists: ready to step) or *open* (owned rows and their histories only: free to be
changed). Commands that add or remove rows open it; the next step closes it again. A rebuild during a run consists of
the same two moves. Everything that determines the order of arithmetic comes from global values and is part of the
state, see `rebuild.RebuildState`.

A physics implements the phases that are declared below: `_begin_step`, `_move_rows`, `_moved`, `_check_rebuild`,
`_end_step`; `_choose_reach`, `_share_out`, `_store`, `_build_lists`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol, Self, TypeVar

import numpy as np

from hpcdem.core.clock import Clock
from hpcdem.core.comm import Comm, SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.core.memory import aligned, take_rows
from hpcdem.core.timers import Timers
from hpcdem.engine.rebuild import AT_A_GLANCE, RebuildState
from hpcdem.halo.exchange import Sends, connect
from hpcdem.halo.migrate import Migration
from hpcdem.halo.ownership import Ownership

FRESH, LISTS, STORAGE = 0, 1, 2
"""Result of a check: nothing outdated; lists outdated; storage, order and ghosts outdated too."""


class Histories(Protocol):
    """Histories of rows: entries (m, v) f8 in sequence, of which each row has a certain number."""

    rows: np.ndarray

    def counts(self) -> np.ndarray:
        """Number of entries of each row (n,)."""
        ...

    def take(self, order: np.ndarray) -> Self:
        """Return the histories of the rows in `order`."""
        ...

    def joined(self, counts: np.ndarray, rows: np.ndarray) -> Self:
        """Append rows that have so many entries each."""
        ...


H = TypeVar("H", bound=Histories)


class Model(ABC):
    """comm: halo.comm; threads: per rank; outdir: folder of results; log and stop: see runtime (None: no log, no stop
    requests); balance_on: strip boundaries follow the load. A subclass has `clear`, which empties it and calls
    `restart`.

    closed: ready to step; rebuilds: number of rebuilds of the lists; halo: the exchange of ghosts of a closed model.
    """

    rebuild_state: RebuildState
    closed: bool
    moves_as_one = False
    """Rows are moved in one piece."""
    moves_ghosts = False
    """A rank moves its ghosts too, with velocities that it gets: positions are not sent."""

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
        """Return to step 0: open, with the first ownership."""
        self.release()
        self.clock = Clock()
        self.ownership = Ownership(self.comm, self.balance_on)
        self.rebuilds = 0
        self.closed = False

    def release(self) -> None:
        """Free what MPI holds for this simulation. Not collective."""
        if self.halo is not None:
            self.halo.close()
        self.halo = None

    def count(self, n: int) -> int:
        """Sum an integer over the ranks. Collective."""
        return int(self.comm.sum_into(np.array([n], dtype=np.int64))[0])

    # ---- one step ------------------------------------------------------------------------------------------------

    def step(self) -> int:
        """Advance everything by one dt. The code is the same for every physics and any number of ranks.

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
        if self.moves_ghosts:
            with timers("halo"):
                halo.finish()
            with timers("move"):
                self._move_rows(-halo.n_left, 0)
                self._move_rows(halo.n_own, halo.n_own + halo.n_right)
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
        """Take up to `steps` steps, fewer if there is an external request. Returns the request (0: none)."""
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
        """Do what must precede the motion. The model is closed."""

    @abstractmethod
    def _move_rows(self, first: int, last: int) -> None:
        """Move the rows first : last by dt, counted from the first owned one. Not collective."""

    @abstractmethod
    def _moved(self) -> None:
        """Called after all rows have moved. Not collective."""

    @abstractmethod
    def _check_rebuild(self, glance: bool = False) -> tuple[int, int]:
        """Measure the largest displacement since the last rebuild and set the step of the next check.

        glance: a quick check between two checks; it becomes a full check if a row has accelerated so much that the next
        one might be too late, and changes nothing otherwise.

        Returns what is outdated (FRESH, LISTS, STORAGE) and the external request. Depends on global maxima only.
        """

    @abstractmethod
    def _end_step(self, outdated: int) -> None:
        """Renew what is outdated after all rows and ghosts have moved, and apply the rest of a step."""

    # ---- from open to closed -------------------------------------------------------------------------------------

    def close_as_saved(self) -> None:
        """Close a restored model: its rebuild state stays as it was. Collective."""
        self._close(frozen=True)

    def _close(self, frozen: bool = False) -> None:
        """Find order, owners, ghosts and lists at the present positions. frozen: keep the rebuild state unchanged
        (restart). Collective."""
        with self.timers("neighbour"):
            cell = self._choose_reach(frozen)
        cell, number = self._share_out(cell)
        with self.timers("neighbour"):
            order = self.ownership.order(cell, number)
            cell = cell[order]
        with self.timers("halo"):
            self._store(order, cell)
        with self.timers("neighbour"):
            self.rebuilds += 1
            self._build_lists(order, cell, frozen)

    @abstractmethod
    def _choose_reach(self, frozen: bool) -> np.ndarray:
        """Choose skin and cell size of the next lists from global values, unless they are frozen. Returns the cells
        (n,) i8 of the rows held here."""

    @abstractmethod
    def _share_out(self, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Send every row to the owner of its column. Returns cells and ids (n,) i8 of the rows owned now."""

    @abstractmethod
    def _store(self, order: np.ndarray, cell: np.ndarray) -> None:
        """Store owned rows in this order, with their ghosts; cell (n,) i8: in the new order."""

    @abstractmethod
    def _build_lists(self, order: np.ndarray, cell: np.ndarray, frozen: bool) -> None:
        """Build the lists and the tables of the kernels."""

    def _send_home(
        self,
        cell: np.ndarray,
        histories: H,
        tables: Sequence[np.ndarray],
        extent: tuple[float, float] | None = None,
        cost: np.ndarray | float = 1.0,
        least: int = 1,
        left: Callable[[np.ndarray, np.ndarray], object] = lambda leave, to: None,
    ) -> tuple[np.ndarray, H, Sequence[np.ndarray]]:
        """Move strip boundaries if that pays, then send rows of the tables (n, w) f8 and their histories to the owners
        of their columns.

        extent, cost, least: see `Ownership.renew`; left: receives the destinations. Returns cells, histories and tables
        of the rows owned now. Collective.
        """
        with self.timers("balance"):
            owners, side = self.ownership, self.rebuild_state.side
            owners.renew(owners.places(cell), side, self.clock.step, self.timers.seconds(), extent, cost, least)
        with self.timers("migrate"):
            leave = owners.strays(cell)
            migration = Migration(self.comm, len(cell), leave, owners.owner_of(owners.places(cell[leave])))
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

    def _connect(self, rows: np.ndarray, order: np.ndarray, sends: Sends) -> np.ndarray:
        """Make the storage of rows[order] with ghosts, which a new halo keeps current; sends: which rows others copy,
        see `Ownership.sends`. Collective."""
        around = self.ownership.period, self.ownership.widening
        storage, self.halo = connect(self.comm, rows, order, sends, self.threads, *around, keep=not self.moves_ghosts)
        return storage

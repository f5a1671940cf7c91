"""Distribution of cells to ranks: cuts of one line during the life of a model, and when they move.

The line consists of the columns (`Ownership`: discs, blocks in the plane), or is a curve through the cells of space
(`Curve`: blocks in space). Cuts determine which rank computes, never the result. Measured times may therefore enter
here, and only here.
"""

from __future__ import annotations

import numpy as np

from hpcdem.core.cells import COLUMN, columns, keys
from hpcdem.core.comm import Comm
from hpcdem.core.errors import UsageError
from hpcdem.decomp import balance, strips
from hpcdem.decomp.curve import Grid, overlapping
from hpcdem.halo.exchange import Sends

MOST_COLUMNS = 1 << 24


class Ownership:
    """Strip boundaries (ranks + 1,) i8 in columns of width `side` [m]; none before the first `renew`.

    balance_on: boundaries follow the measured load; otherwise they move only on request (`wanted`). The *place* of a
    cell is its position on the line that is cut: its column.
    """

    def __init__(self, comm: Comm, balance_on: bool) -> None:
        self.comm, self.balance_on = comm, balance_on
        self.borders = np.zeros(0, np.int64)
        self.side = 1.0
        self.wanted = True
        """Particles came or went: cut again at the next chance, whatever was measured."""
        self.around = 0
        """Number of columns of a periodic model, 0 to around - 1; 0 for others."""
        self.period = 0.0
        """Its length [m]."""
        self.widening = 0.0
        """Velocity of its right side relative to the left one [m/s]."""
        self._busy, self._step = 0.0, 0

    def cells(self, points: np.ndarray, side: float) -> np.ndarray:
        """Return the cells (n,) i8 of points (n, dim) [m] of this rank. Collective."""
        found: np.ndarray = keys(points, side)
        return found

    def places(self, cell: np.ndarray) -> np.ndarray:
        """Return the places of cells (n,) i8."""
        found: np.ndarray = columns(cell)
        return found

    def order(self, cell: np.ndarray, number: np.ndarray) -> np.ndarray:
        """Return the indices that sort rows by cell and number (n,) i8: the one order of the whole model."""
        return strips.global_order(cell, number)

    def owner_of(self, place: np.ndarray) -> np.ndarray:
        """Return the rank that owns each place."""
        return strips.owner_of(place, self.borders)

    def strays(self, cell: np.ndarray) -> np.ndarray:
        """Return the indices of the cells that other ranks own."""
        return strips.strays(cell, self.borders, self.comm.rank) if self.comm.size > 1 else cell[:0]

    def sends(self, cell: np.ndarray, depth: int, boxes: np.ndarray | None = None) -> Sends:
        """Return the owned rows that other ranks need, see `exchange.Halo`. Collective.

        cell (n,) i8: of the owned rows, ascending; depth: how many columns of each neighbour are copied. Every rank
        except the first and the last has at least as many columns; of a periodic model all have.
        """
        rank, out, n = self.comm.rank, dict[int, slice | np.ndarray](), len(cell)
        begins, ends = 0, self.around
        if rank > 0:
            begins = int(self.borders[rank])
        if rank + 1 < self.comm.size:
            ends = int(self.borders[rank + 1])
        if rank > 0 or self.around:
            out[rank - 1] = slice(0, int(np.searchsorted(cell, (begins + depth) * COLUMN - COLUMN // 2)))
        if rank + 1 < self.comm.size or self.around:
            out[rank + 1] = slice(int(np.searchsorted(cell, (ends - depth) * COLUMN - COLUMN // 2)), n)
        return out

    def renew(
        self,
        place: np.ndarray,
        side: float,
        step: int,
        busy: float,
        extent: tuple[float, float] | None,
        cost: np.ndarray | float = 1.0,
        least: int = 1,
    ) -> None:
        """Choose boundaries for particles (or elements) at places (n,) i8 of this rank. Collective.

        busy: seconds of work of this rank so far; extent: x range of possible positions [m], if known; cost: (n,),
        relative cost of each row, if known; least: smallest number of columns of a rank. Raises UsageError if a new
        model has fewer columns than ranks. A model that lost columns later, or was restored with fewer, continues with
        idle ranks.
        """
        first_time = not len(self.borders)
        if self.comm.size == 1:
            self.borders, self.side = np.array([0, 1]), side
            return
        if not first_time:
            self._follow_side(side, least)
        self.side = side
        weight = cost
        if not (self.wanted or first_time):
            found = self._uneven(float(np.sum(np.broadcast_to(cost, len(place)))), step, busy)
            if found is None:
                return
            weight = found * cost
        self.borders = self._cut(place, weight, least, extent, first_time and step == 0)
        self.wanted = False
        self._busy, self._step = busy, step

    def _follow_side(self, side: float, least: int) -> None:
        """Keep the boundaries at their positions in space when the side of cells changes."""
        if self.around:  # every rank needs one of the columns
            self.wanted |= self.side != side
            return
        if self.side != side:
            self.borders = strips.separate(np.rint(self.borders * (self.side / side)).astype(np.int64))
        if least > 1:
            self.borders = strips.separate(self.borders, least)

    def _cut(
        self,
        place: np.ndarray,
        weight: np.ndarray | float,
        least: int,
        extent: tuple[float, float] | None,
        starts: bool,
    ) -> np.ndarray:
        """Return boundaries with equal weight between them; starts: too many ranks are rejected. Collective."""
        first, columns = self._span(place)
        if columns == 0:
            first, columns = 0, 1
        elif starts or self.around:
            self._refuse_too_many_ranks(columns, extent)
        total = np.zeros(min(columns, MOST_COLUMNS))
        np.add.at(total, np.minimum(place - first, len(total) - 1), weight)
        self.comm.sum_into(total)
        return strips.cut(self.comm.bcast(total), first, self.comm.size, least)

    def _uneven(self, owned: float, step: int, busy: float) -> float | None:
        """Return the relative cost of a particle of this rank if the load is uneven, else None. Collective when due.

        owned: number of particles, weighted with their cost.
        """
        if not self.balance_on or step - self._step < balance.PATIENCE:
            return None
        mine = busy - self._busy
        total = self.comm.bcast(self.comm.sum_into(np.array([mine, owned])))  # the same on all ranks, to the last bit
        largest = float(self.comm.max_into(np.array([mine]))[0])
        self._busy, self._step = busy, step
        if balance.imbalance(largest, float(total[0]) / self.comm.size) < balance.TOLERANCE:
            return None
        return balance.cost_per_particle(mine, owned, float(total[0]), float(total[1]))

    def _span(self, cx: np.ndarray) -> tuple[int, int]:
        """Return the first occupied column and the number of columns up to the last, over all ranks; (0, 0) without
        particles. Of a periodic model these are all of its columns."""
        if self.around:
            return 0, self.around
        ends = np.array([-cx.min(), cx.max()] if len(cx) else [-strips.FARTHEST, -strips.FARTHEST])
        self.comm.max_into(ends)
        first, columns = -int(ends[0]), int(ends[1] + ends[0]) + 1
        return (first, columns) if columns > 0 else (0, 0)

    def _refuse_too_many_ranks(self, columns: int, extent: tuple[float, float] | None) -> None:
        """Raise UsageError if a rank would never have a column: the job was started with too many ranks."""
        if extent is not None and not self.around:
            ends, _ = strips.cells(np.array(extent), np.zeros(2), self.side)
            columns = max(columns, int(ends[1] - ends[0]) + 1)
        if columns < self.comm.size:
            raise UsageError(
                f"{self.comm.size} ranks are too many for this model: its width in columns of {self.side:g} m (the "
                f"largest contact, bond or clump, plus skin) is {columns}, so at most {columns} ranks fit; start it "
                "with fewer"
            )


class Curve(Ownership):
    """Boundaries (ranks + 1,) i8 on Hilbert's curve through the cells of space (decomp/curve.py).

    The place of a cell is its key. A rank may own nothing.

    No sum depends on the order of elements in space, so the grid may change when the side of cells or the population
    changes.
    """

    grid: Grid | None = None

    def cells(self, points: np.ndarray, side: float) -> np.ndarray:
        if self.grid is None or self.grid.side != side or self.wanted:
            ends = np.full(6, -np.inf)
            if len(points):
                ends[:3], ends[3:] = -points.min(axis=0), points.max(axis=0)
            self.comm.max_into(ends)
            ends = np.where(np.isfinite(ends), ends, 0.0)
            self.grid, self.wanted = Grid.around(-ends[:3], ends[3:], side), True
        return self.grid.keys(points)

    def places(self, cell: np.ndarray) -> np.ndarray:
        return cell

    def strays(self, cell: np.ndarray) -> np.ndarray:
        return np.flatnonzero(self.owner_of(cell) != self.comm.rank) if self.comm.size > 1 else cell[:0]

    def sends(self, cell: np.ndarray, depth: int, boxes: np.ndarray | None = None) -> Sends:
        """Return the rows whose boxes (n, 6), lowest x, y and z, then highest [m], overlap the box around the rows of a
        cell of another rank beside theirs. Each rank sends the boxes of its cells to the owners of the cells beside.
        Collective."""
        comm, grid, rank = self.comm, self.grid, self.comm.rank
        if comm.size == 1:
            return {}
        assert grid is not None and boxes is not None
        mine, first = np.unique(cell, return_index=True)
        around = np.empty((0, 6)) if not len(mine) else np.hstack([
            np.minimum.reduceat(boxes[:, :3], first), np.maximum.reduceat(boxes[:, 3:], first)
        ])  # fmt: skip
        owners = self.owner_of(grid.beside(mine))
        parcels = {}
        for p in np.unique(owners[owners != rank]).tolist():
            at = (owners == p).any(axis=1)
            parcels[p] = np.concatenate([mine[at], around[at].reshape(-1).view(np.int64)])
        out: dict[int, slice | np.ndarray] = {p: slice(0, 0) for p in parcels}
        for p, parcel in comm.exchange(parcels).items():
            theirs, places = np.split(parcel, [len(parcel) // 7])
            out[p] = overlapping(cell, boxes, grid.beside(theirs), places.view(np.float64).reshape(-1, 6))
        return dict(sorted(out.items()))

    def _follow_side(self, side: float, least: int) -> None:
        pass

    def _cut(
        self,
        place: np.ndarray,
        weight: np.ndarray | float,
        least: int,
        extent: tuple[float, float] | None,
        starts: bool,
    ) -> np.ndarray:
        mine, of = np.unique(place, return_inverse=True)
        total = np.bincount(of, np.broadcast_to(weight, len(place)), len(mine))
        cells, weights = (np.concatenate(part) for part in zip(*self.comm.allgather((mine, total))))
        cells, of = np.unique(cells, return_inverse=True)
        if starts and len(cells) < self.comm.size:
            raise UsageError(
                f"{self.comm.size} ranks are too many for this model: it has elements in {len(cells)} cubes of "
                f"{self.side:g} m (the largest element or joint, twice, plus the margin of contact), so at most "
                f"{len(cells)} ranks fit; start it with fewer"
            )
        at = strips.cut(np.bincount(of, weights, len(cells)), 0, self.comm.size)
        return np.append(cells, cells[-1:] + 1)[np.minimum(at, len(cells))] if len(cells) else np.zeros_like(at)


def warm_up(cell: np.ndarray, ids: np.ndarray) -> None:
    """Call each kernel of the decomposition once, with these cells (n,) i8 and ids (n,) i8."""
    strips.global_order(cell, ids)
    strips.strays(columns(cell), np.array([-1, 0, 1]), 0)
    boxes, place = np.zeros((1, 6)), np.zeros(1, np.int64)
    overlapping(place, boxes, Grid(1.0, (0, 0, 0), 1).beside(place), boxes)

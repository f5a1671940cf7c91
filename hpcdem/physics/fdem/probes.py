"""A quantity of a few objects of a model of blocks, requested again and again, as histories do.

Where the objects are is found once per storage; asking then touches them alone. What is combined over ranks is exact:
each number comes from the one rank that has it, sums are rounded once.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.comm import SerialComm
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem import sides
from hpcdem.physics.fdem.simulation import Blocks

if TYPE_CHECKING:
    from hpcdem.physics.fdem.local import Evaluation, Local

_NAN = np.array([np.nan]).view(np.int64)[0]


class Probe(ABC):
    """A quantity at numbers (n,) of elements, nodes or joints. Every method is collective."""

    def __init__(self, sim: Blocks, numbers: np.ndarray) -> None:
        """Set up the probe. Not collective."""
        self.sim, self.numbers = sim, numbers
        self.local: Local | None = None
        self._at, self._n = np.empty(0, np.int64), 0

    def find(self) -> None:
        """Find the objects in the present storage."""
        self.sim.close_model()
        if self.local is not self.sim.local:
            self.local = self.sim.local
            self._find()

    @abstractmethod
    def _find(self) -> None:
        """Set `_at`: places (k,) of what this rank has among the `_n` values of all ranks."""

    @abstractmethod
    def _mine(self, seen: Evaluation | Local | None) -> np.ndarray:
        """The part (k,) on this rank, see `_at`."""

    def values(self, seen: Evaluation | Local | None = None) -> np.ndarray:
        """(n,) on all ranks; NaN for what is not there. seen: forces that are known already (of the storage in which
        the objects were found last); None: as they are now."""
        if seen is None:
            self.find()
        return self._gathered(self._mine(seen))

    def _gathered(self, mine: np.ndarray) -> np.ndarray:
        """(n,) of all ranks. Bits are added up as integers, of which all but one rank's are zero."""
        comm = self.sim.comm
        bits = np.zeros(self._n, np.int64)
        bits[self._at] = np.ascontiguousarray(mine, np.float64).view(np.int64) - _NAN
        return (comm.sum_into(bits) + _NAN).view(np.float64)

    def total(self, seen: Evaluation | Local | None = None) -> float:
        """Sum of those that are there, rounded once."""
        if seen is None:
            self.find()
        mine = self._mine(seen)
        return exact_sum(mine[~np.isnan(mine)], self.sim.comm)

    def _parts(self, seen: Evaluation | Local | None) -> tuple[Any, np.ndarray]:
        """Values that are combined over the ranks of a communicator: each rank has some of them."""
        if seen is None:
            self.find()
        return self.sim.comm, self._mine(seen)

    def reduced(self, how: str, seen: Evaluation | Local | None = None) -> float:
        """sum, mean, minimum or maximum of those that are there, or of "" the first of all; NaN where missing."""
        if how == "":
            return float(self.values(seen)[0])
        comm, mine = self._parts(seen)
        mine = mine[~np.isnan(mine)]
        count = int(comm.sum_into(np.array([len(mine)], np.int64))[0])
        if not count:
            return math.nan
        if how == "minimum":
            return float(comm.min_into(np.array([mine.min(initial=math.inf)]))[0])
        if how == "maximum":
            return float(comm.max_into(np.array([mine.max(initial=-math.inf)]))[0])
        total = exact_sum(mine, comm)
        return total / count if how == "mean" else total


class ForceProbe(Probe):
    """A component of reaction or unbalanced force [N/m] of nodes: a sum over corners that several ranks may have."""

    def __init__(self, sim: Blocks, name: str, nodes: np.ndarray) -> None:
        """Set up the probe. Not collective."""
        super().__init__(sim, nodes)
        self.name = name
        self._place = np.empty(0, np.int64)
        self._nodes, self._corners = np.empty(0, np.int64), (np.empty(0, np.int64), np.empty(0, np.int64))
        self._nothing = np.empty(0)

    def _find(self) -> None:
        """The nodes that have these points, each with the owner of its lowest corner, in the order of corners."""
        sim, local = self.sim, self.sim.local
        cells = sim.the_mesh().cells
        points = sides.points(cells, self.numbers)
        place = np.full(len(sim.the_mesh().points), -1, np.int64)
        place[points] = np.arange(len(points))
        lead = local.nodes.first_corners
        point = cells[lead // 4, lead % 4]
        wanted = (place >= 0)[cells]
        if sides.are_there(self.numbers):
            some = sides.present(cells, self.numbers, sim.alive)
            chosen = sides.corners(cells, some, len(place)) & np.repeat(sim.alive, 4)
            wanted = sim.with_nodes(chosen, sim.node.reshape(-1)).reshape(cells.shape)
        self._nodes = np.flatnonzero(local.nodes.mine & wanted.reshape(-1)[lead])
        corner, point = lead[self._nodes], point[self._nodes]
        if self.name.startswith("unbalanced"):
            number = sim.number[sim.owned]
            i, k = np.nonzero(local.nodes.alone)
            some = wanted[number[i], k]
            self._corners = i[some], k[some]
            corner = np.concatenate([corner, 4 * number[i[some]] + k[some]])
            point = np.concatenate([point, cells[number[i[some]], k[some]]])
        parts = sim.comm.allgather((corner, place[point]))
        every = np.concatenate([part[0] for part in parts])
        order = np.argsort(every)
        self._place = np.concatenate([part[1] for part in parts])[order]
        self._at, self._n = np.searchsorted(every[order], corner), len(every)
        self._nothing = np.where(sim.node_exists()[points], 0.0, np.nan)

    def _mine(self, seen: Evaluation | Local | None) -> np.ndarray:
        sim = self.sim
        seen = sim.evaluate() if seen is None else seen
        axis = "xyz".index(self.name[-1])
        found = seen.outside[self._nodes, axis]
        if self.name.startswith("unbalanced"):
            i, k = self._corners
            alone = seen.force[sim.owned][i, sim.stride * k + axis]
            found = np.concatenate([found + seen.felt[self._nodes, axis], alone])
        return found

    def values(self, seen: Evaluation | Local | None = None) -> np.ndarray:
        found = super().values(seen)
        out = self._nothing.copy()
        np.add.at(out, self._place, found)
        return out

    def _parts(self, seen: Evaluation | Local | None) -> tuple[Any, np.ndarray]:
        return SerialComm(), self.values(seen)

    def reduced(self, how: str, seen: Evaluation | Local | None = None) -> float:
        return self.total(seen) if how == "sum" else super().reduced(how, seen)

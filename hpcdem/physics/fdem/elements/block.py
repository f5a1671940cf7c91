"""The elements of one kind that a rank owns, as laws of elements see them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hpcdem.physics.fdem.elements import flow
from hpcdem.physics.fdem.elements.kind import Kind, Tables

if TYPE_CHECKING:
    from hpcdem.physics.fdem.state import State


class ElementBlock:
    """rows: see `Tables`; c: their constants; s0 (n, parts, 4 or 8) [Pa]: stress without strain of their parts, may be
    without rows in models whose elements are elastic; stored (count, k): owned elements that each is stored as, volume
    (count, k): the part of its volume that each of these has; place, parts: see `Tables`.

    said, uncrept, initial, like s0: without plastic and creep strain, without creep strain alone, without plastic
    strain. model (count,): row of the model of elements; creeping (m,): which can creep. law (n, parts): rows of the
    table of yield surfaces; flowing (m + 3,): which can yield, see `flow.flows`; alone: which are elements of their
    own, no parts of others.
    """

    def __init__(
        self, sim: State, kind: Kind, rows: np.ndarray, c: np.ndarray, s0: np.ndarray, stored: np.ndarray,
        volume: np.ndarray, *tables: np.ndarray,
    ) -> None:  # fmt: skip
        self.sim, self.kind, self.rows, self.c, self._tables = sim, kind, rows.astype(np.int32), c, tables
        self.s0 = s0.reshape(-1, len(kind.parts), kind.stresses)
        self.stored, self.volume, self.count = stored, volume, len(stored)
        self.said, self.uncrept, self.initial = (np.zeros((0, *self.s0.shape[1:])) for _ in range(3))
        self.creeping = self.model = self.flowing = np.zeros(0, np.int64)
        self.law, self.alone = np.zeros((0, len(kind.parts)), np.int32), np.arange(self.count)

    def remember(self) -> None:
        """Some elements of the model yield or creep."""
        self.said, self.uncrept, self.initial = (np.zeros_like(self.s0) for _ in range(3))

    @property
    def tables(self) -> Tables:
        """For kernels."""
        sim = self.sim
        return self.kind.tables(self.rows, sim.n_left, sim.x.reshape(-1), sim.x.shape[1], self.c, *self._tables)

    def histories(self, memory: np.ndarray, width: int) -> np.ndarray:
        """What their parts remember (count, parts, width), of the rows of owned elements."""
        part = np.arange(len(self.kind.parts))
        rows = memory.reshape(len(memory), memory.shape[1] // width, width)  # a rank may own none
        return rows[self.stored[:, :1] + part // self.kind.in_row, part % self.kind.in_row]

    def places(self) -> np.ndarray:
        """(count, corners) where corners begin in x."""
        g = self.tables
        if len(g.place):
            return g.place[: self.count]
        return g.width * g.rows[: self.count, None] + self.kind.stride * np.arange(self.kind.corners)

    def of_parts(self, s0: np.ndarray, c: np.ndarray) -> np.ndarray:
        """Stress without strain (n, parts, k) [Pa], also where hexahedra have one each, in their constants c."""
        kind = self.kind
        return s0 if len(s0) else np.repeat(c[:, None, : kind.stresses], len(kind.parts), axis=1)

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Means by volume (count, k) of what their parts have (count, parts, k)."""
        if values.shape[1] == 1:
            return values[:, 0].copy()
        weight = np.empty((self.count, values.shape[1], 1))
        flow.weights(self.tables, self.count, weight)
        return (weight * values).sum(axis=1) / weight.sum(axis=1)

    def spread(self, values: np.ndarray, out: np.ndarray) -> None:
        """Values (count, ...) of elements into those of owned elements (n_own, ...)."""
        out[self.stored] = values[:, None]

    def share_out(self, values: np.ndarray, out: np.ndarray) -> None:
        """Sums (count,) of elements into those of owned elements (n_own,), by volume."""
        out[self.stored] = values[:, None] * self.volume

"""The elements of one kind that a rank owns."""

from __future__ import annotations

from collections.abc import Callable
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

    first (count,): the first of the elements that each is stored as; model (count + 3,) i4: row of the model of
    elements; alone: which are elements of their own, no parts of others.

    stiff: like c, with the largest moduli that the elements can have, by which the time step is found, `stiffer`
    (count,) times those of their models, None: once; without: elements that have no moduli in c, as a user law
    or a larger element makes their forces.

    elastic, uncrept, initial, like s0: without plastic and creep strain, without creep strain alone, without plastic
    strain. creeping (m,): which can creep. law (n, parts): rows of the table of yield surfaces; flowing (m + 3,): which
    can yield, see `flow.flows`. over_parts: volume (count,) over that of what each is stored as, None: the same.
    """

    over_parts: Callable[[], np.ndarray] | None = None
    stiffer: np.ndarray | None = None

    def __init__(
        self, sim: State, kind: Kind, rows: np.ndarray, c: np.ndarray, s0: np.ndarray, stored: np.ndarray,
        volume: np.ndarray, *tables: np.ndarray,
    ) -> None:  # fmt: skip
        self.sim, self.kind, self.rows, self.c, self._tables = sim, kind, rows.astype(np.int32), c, tables
        self.s0 = s0.reshape(-1, len(kind.parts), kind.stresses)
        self.stored, self.volume, self.count = stored, volume, len(stored)
        self.first = np.ascontiguousarray(stored[:, 0])
        self.stiff, self.without = c, np.zeros(0, np.int64)
        self.elastic, self.uncrept, self.initial = (np.zeros((0, *self.s0.shape[1:])) for _ in range(3))
        self.creeping = self.flowing = np.zeros(0, np.int64)
        self.model = np.zeros(self.count + 3, np.int32)
        self.model[: self.count] = sim.element_row[sim.number[self.first + sim.n_left]]
        self.law, self.alone = np.zeros((0, len(kind.parts)), np.int32), np.arange(self.count)

    @property
    def tables(self) -> Tables:
        """Return the tables for kernels."""
        sim = self.sim
        return self.kind.tables(self.rows, sim.n_left, sim.x.reshape(-1), sim.x.shape[1], self.c, *self._tables)

    # ---- moduli and stress without strain --------------------------------------------------------------------------

    @property
    def moduli(self) -> np.ndarray:
        """Columns of moduli in c."""
        return np.array([self.kind.lame, self.kind.two_mu])

    def set_apart(self) -> None:
        """`stiff` is no longer c."""
        if self.stiff is self.c:
            self.stiff = self.c.copy()

    def stiffen(self, at: np.ndarray, ratio: np.ndarray) -> None:
        """Multiply the stiffness `stiff` of the elements `at`."""
        self.set_apart()
        self.stiff[np.ix_(at, self.moduli)] *= ratio[:, None]
        self.stiffer = np.ones(self.count) if self.stiffer is None else self.stiffer
        self.stiffer[at] *= ratio

    def take_moduli(self, at: np.ndarray) -> None:
        """The elements `at` have none any more in c."""
        self.set_apart()
        self.without = np.concatenate([self.without, at])
        self.c[np.ix_(at, self.moduli)] = 0.0

    def follow(self, part: np.ndarray) -> None:
        """Moduli are so much (n_own,) of the largest ones."""
        every = np.arange(self.count)
        self.c[np.ix_(every, self.moduli)] = self.stiff[np.ix_(every, self.moduli)] * part[self.first, None]
        self.c[np.ix_(self.without, self.moduli)] = 0.0

    def lay(self, initial: np.ndarray, heat: np.ndarray, free: bool) -> None:
        """Stress without strain is the initial one (n_own, 4 or 6) [Pa] and that of heat (n_own,), none if (0,); free:
        without that across the plane."""
        if len(self.s0):
            flow.lay(self.first, initial, heat, free, self.s0)
        else:  # one of all parts
            found = np.zeros((self.count, 1, self.kind.stresses))
            flow.lay(self.first, initial, heat, free, found)
            self.c[: self.count, : self.kind.stresses - 2] = found[:, 0, :-2]

    def of_parts(self, s0: np.ndarray, c: np.ndarray) -> np.ndarray:
        """Stress without strain (n, parts, k) [Pa], also where hexahedra have one each, in their constants c."""
        kind = self.kind
        return s0 if len(s0) else np.repeat(c[:, None, : kind.stresses], len(kind.parts), axis=1)

    def flat(self, s0: np.ndarray | None = None) -> np.ndarray:
        """Stress without strain, a row for each element."""
        s0 = self.s0 if s0 is None else s0
        return s0.reshape(len(s0), s0.shape[1] * s0.shape[2])

    # ---- state variables of elements, and tables of owned elements ---------------------------------------------------

    def remember(self) -> None:
        """Allocate the histories of elements; called if some elements of the model yield or creep."""
        self.elastic, self.uncrept, self.initial = (np.zeros_like(self.s0) for _ in range(3))

    def histories(self, memory: np.ndarray, width: int) -> np.ndarray:
        """Return the state variables of their parts (count, parts, width) from the rows of owned elements."""
        part = np.arange(len(self.kind.parts))
        rows = memory.reshape(len(memory), memory.shape[1] // width, width)  # a rank may own none
        return rows[self.stored[:, :1] + part // self.kind.in_row, part % self.kind.in_row]

    def places(self) -> np.ndarray:
        """(count, corners) where corners begin in x."""
        g = self.tables
        if len(g.place):
            return g.place[: self.count]
        return g.width * g.rows[: self.count, None] + self.kind.stride * np.arange(self.kind.corners)

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

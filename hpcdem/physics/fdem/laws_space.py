"""Tetrahedra and hexahedra that yield, creep or obey a law of the user: what `Local` does for the elements of the
plane."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcdem.physics.fdem import user_laws
from hpcdem.physics.fdem.elements.block import ElementBlock
from hpcdem.physics.fdem.elements.kind import HEXAHEDRON, TETRAHEDRON
from hpcdem.physics.fdem.hexahedra import PARTS
from hpcdem.physics.fdem.hexes import Hexes
from hpcdem.physics.fdem.kernels import (
    hexes,
    space,
    tets,
)
from hpcdem.physics.fdem.local import Local, element_table

NORMAL = [0, 1, 3]
"""Places of xx, yy and zz in a row of stress."""


@dataclass(frozen=True)
class LawHere:
    """A law of the user on this rank: its table of properties, and which owned tetrahedra, which hexahedra have it."""

    law: user_laws.UserLaw
    table: np.ndarray
    tets: np.ndarray
    hexes: np.ndarray


class LawsSpace(Local):
    """rows: see `LocalSpace`. What `Local` has of quads is of hexahedra here: a stress without strain (count + 3, 10,
    8) for each of their ten tetrahedra, see hexes.py."""

    rows: np.ndarray
    hexes: Hexes | None
    stiff_hexes: np.ndarray
    _stress: np.ndarray
    """Initial stress (n_own, 6) [Pa]."""

    def _make_memories(self) -> None:
        """What is remembered of yielding and creep, and what of it is in the stress without strain. s0 is what was said
        of it."""
        sim, count = self.sim, self.count
        self.plastic, self.creeps = "plastic" in sim.cold, "creep" in sim.cold
        self.yields = bool(sim.yielding().any())
        self.quad_rows = np.empty(0, np.int32)
        of_hexes = self.hexes
        many = of_hexes.count + 3 if of_hexes is not None and of_hexes.remember else 0
        self.quad_s0 = np.zeros((many, hexes.PARTS, tets.STRESSES))
        every = np.arange(count)[:, None]
        self.solids = [
            ElementBlock(sim, TETRAHEDRON, self.rows, self.c, self.s0, every, np.ones(every.shape)),
            ElementBlock(sim, HEXAHEDRON, *self._of_hexes()),
        ]
        alone = np.ones(count, bool)
        if of_hexes is not None:
            alone[of_hexes.rows - sim.n_left] = False
        self.solids[0].alone = np.flatnonzero(alone)
        self._make_laws()
        if not (self.plastic or self.creeps):
            self._begin_warm()
            return
        number = sim.number[self.rows[:count]]
        self.law = np.zeros(count + 3, np.int32)
        self.law[:count] = sim.element_row[number]
        apart = np.empty(0, np.int32)
        self.quad_law = np.zeros((many, hexes.PARTS), np.int32)
        if of_hexes is not None:
            apart = of_hexes.rows[:, 0]
            self.law[of_hexes.rows - sim.n_left] = 0
            self.quad_law[: len(apart)] = of_hexes.model[:, None]
        self._make_creep()
        self.solids[0].creeping = np.flatnonzero(alone & sim.creeping()[number])
        if self.plastic:
            self._make_strength(self.rows[:count], apart)
        self._begin_warm()

    def _of_hexes(self) -> tuple[np.ndarray, ...]:
        """Of the block of hexahedra: what `ElementBlock` takes."""
        if (own := self.hexes) is None:
            nobody = np.empty((0, PARTS), np.int64)
            return nobody[:, 0], np.empty((0, hexes.HEX)), self.quad_s0, nobody, np.empty((0, PARTS))
        stored = own.rows - self.sim.n_left
        return own.rows[:, 0], own.h, self.quad_s0, stored, own.part_of_volume(), own.place, own.parts

    def _make_laws(self) -> None:
        """As in the plane: in the tables of forces elements with a law of the user have no moduli; stiff, stiff_hexes:
        by those the time step is found. lawful: some have one."""
        sim, rows, own = self.sim, self.sim.element_rows, self.hexes
        self.laws: list[Any] = []
        number = user_laws.numbers(sim)[sim.number[sim.owned]]
        self.lawful = bool((number > 0).any())
        if not self.lawful:
            return
        self.law_row = sim.element_row[sim.number[sim.owned]].astype(np.int64)
        models, bound = element_table(sim), np.array(rows.column(user_laws.BOUND))
        modulus = models[:, space.LAME] + models[:, space.MU2]
        ratio = np.divide(bound, modulus, out=np.ones(len(rows)), where=bound > 0.0)
        at, part = np.flatnonzero(number), np.zeros(sim.n_own, bool)
        if self.stiff is self.c:
            self.stiff = self.c.copy()
        columns = np.array([tets.LAMBDA, tets.TWO_MU])
        self.stiff[np.ix_(at, columns)] *= ratio[self.law_row[at], None]
        self.without_moduli = [(self.c, at, columns)]
        of_hexes = np.empty(0, np.int64)
        if own is not None:
            if self.stiff_hexes is own.h:
                self.stiff_hexes = own.h.copy()
            self.law_row_of_hexes, of_hexes = own.model.astype(np.int64), number[own.begin]
            part[own.rows - sim.n_left] = True
            which = np.flatnonzero(of_hexes)
            columns, more = np.array([hexes.H_LAMBDA, hexes.H_TWO_MU]), ratio[own.model[which]]
            self.stiff_hexes[np.ix_(which, columns)] *= more[:, None]
            own.omega2[which] *= more
            own.modulus[which] *= more
            self.without_moduli = *self.without_moduli, (own.h, which, columns)
        self._clear_moduli()
        for k, law in enumerate(user_laws.of_rows(rows)):
            alone, whole = np.flatnonzero((number == 1 + k) & ~part), np.flatnonzero(of_hexes == 1 + k)
            if len(alone) or len(whole):
                self.laws.append(LawHere(law, law.table(rows), alone, whole))

    def _make_warm(self) -> None:
        """What elements have before temperatures change it."""
        self.heated = False
        self.warms = any(bool(one.any()) for one in self.sim.warms())
        self.stiff = self.c.copy() if self.warms else self.c
        h = np.empty((0, hexes.HEX)) if self.hexes is None else self.hexes.h
        self.stiff_hexes = h.copy() if self.warms else h
        self.initial_part: np.ndarray | None = None
        self._stress_said = self._stress

    def _moduli(self) -> Iterable[tuple[np.ndarray, np.ndarray, list[int], np.ndarray]]:
        yield self.c, self.stiff, [tets.LAMBDA, tets.TWO_MU], np.arange(self.count)
        if (own := self.hexes) is not None:
            yield own.h, self.stiff_hexes, [hexes.H_LAMBDA, hexes.H_TWO_MU], own.begin

    def _scale_initial(self, ratio: np.ndarray) -> None:
        self._stress = self._stress_said * ratio[:, None]

    def _begin_warm(self) -> None:
        """Moduli, strengths and stress without strain at the temperatures of now."""
        if self.warms:
            self._follow_elements()
        self.heated = self._find_stress_without_strain()

    def _find_stress_without_strain(self) -> bool:
        """As in the plane: what was said of it and what heat brings, less the part of plastic and creep strain."""
        heat = self.sim.surface_loads.eigenstress(self.sim)
        if self.lawful:
            bulk = np.array(self.sim.element_rows.column("bulk"))[self.law_row]
            self.thermal = np.zeros(self.count) if heat is None else heat / (-3.0 * bulk)
        if heat is None and not (self.heated or self.plastic or self.creeps) and self.sim.stress0 is None:
            return False  # of a table of zeros that nobody has written to nothing is in the memory
        self.s0[: self.count, :6] = self._stress
        if heat is not None:
            self.s0[: self.count, NORMAL] += heat[:, None]
        if (own := self.hexes) is not None:
            own.h[: own.count, :6] = self.s0[own.begin, :6]
            if len(self.quad_s0):
                self.quad_s0[:, :, :6] = own.h[:, None, :6]
        self._relieve()
        return heat is not None

    def obey(self) -> None:
        """Elements flow and creep, as those of this step do before its forces."""
        sim = self.sim
        if self.yields:
            self.flow(self.plastic_state(), sim.clock.step)
        if self._creeps_now():
            self.creep(sim.cold["creep"], [of.s0 for of in self.solids], keep=sim.options.dynamic)
        if self.laws:
            self._obey(sim.cold[user_laws.COLUMN], self.s0, self.quad_s0)

    def _obey(self, memory: np.ndarray, s0: np.ndarray, quad_s0: np.ndarray, every: bool = True) -> None:
        """As in the plane, all laws at once."""
        sim, own, one_thread = self.sim, self.hexes, self.sim.threads == 1
        dt, small = (sim.clock.dt if sim.options.dynamic else 0.0), not sim.options.large_strain
        for one in self.laws:
            loops, how = one.law.loops, (one.table, dt, small, memory)
            if len(one.tets):
                (loops.tets if one_thread else loops.tets_threaded)(
                    sim.threads, one.tets, self.rows, sim.n_left, sim.x, self.c, self._stress, self.thermal,
                    self.law_row, *how, s0,
                )  # fmt: skip
            if own is not None and len(one.hexes):
                (loops.hexes if one_thread else loops.hexes_threaded)(
                    sim.threads, one.hexes, own.begin, own.place, sim.x, own.parts, self._stress, self.thermal,
                    self.law_row_of_hexes, *how, quad_s0,
                )  # fmt: skip

    def law_states(self) -> np.ndarray:
        """As in the plane; of hexahedra the mean of their tetrahedra by volume."""
        sim, own = self.sim, self.hexes
        memory = self.obeyed(self.s0.copy(), self.quad_s0.copy()) if self.laws else sim.cold[user_laws.COLUMN]
        found = memory[:, : 1 + (memory.shape[1] - 1) // sim.element_parts].copy()
        if own is not None and found.shape[1] > 1:
            mean = (own.shares()[:, :, None] * own.histories(memory[:, 1:])).sum(axis=1)
            found[own.rows - sim.n_left, 1:] = mean[:, None]
        return found

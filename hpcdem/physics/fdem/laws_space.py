"""Tetrahedra that yield or creep: what `Local` does for the elements of the plane, by plastic_tets.py and
creep_tets.py."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from hpcdem.physics.fdem.kernels import creep_tets, plastic_tets, tets
from hpcdem.physics.fdem.local import Local, creep_table

NORMAL = [0, 1, 3]
"""Places of xx, yy and zz in a row of stress."""


class LawsSpace(Local):
    """rows: see `LocalSpace`. There are no quads: what `Local` does with theirs finds none."""

    rows: np.ndarray
    _stress: np.ndarray
    """Initial stress (n_own, 6) [Pa]."""

    def _make_memories(self) -> None:
        """What is remembered of yielding and creep, and what of it is in the stress without strain. s0 is what was said
        of it."""
        sim, count = self.sim, self.count
        self.plastic, self.creeps = "plastic" in sim.cold, "creep" in sim.cold
        self.yields = bool(sim.yielding().any())
        self.quad_rows, self.quad_s0 = np.empty(0, np.int32), np.empty((0, 0))
        if not (self.plastic or self.creeps):
            self._begin_warm()
            return
        number = sim.number[self.rows[:count]]
        self.law = np.zeros(count + 3, np.int32)
        self.law[:count] = sim.element_row[number]
        self.said, self.uncrept, self.initial = (np.zeros((count, tets.STRESSES)) for _ in range(3))
        self.quad_said = self.quad_uncrept = self.quad_initial = self.quad_s0
        if self.creeps:
            self.creep_table, self.creep_law = creep_table(sim.element_rows), self.law.copy()
            self.creeping, self.creeping_quads = np.flatnonzero(sim.creeping()[number]), np.empty(0, np.int64)
        if self.plastic:
            yielding = np.flatnonzero(sim.yielding()[number])
            self.yielding, fill = len(yielding), np.repeat(yielding[-1:], 3)
            self.who_yields = np.concatenate([yielding, fill]).astype(np.int32)
            self.quad_law = np.empty((0, 4), np.int32)
            self._make_strength(self.rows[:count])
        self._begin_warm()

    def _make_warm(self) -> None:
        """What elements have before temperatures change it."""
        self.warms = any(bool(one.any()) for one in self.sim.warms())
        self.stiff = self.c.copy() if self.warms else self.c
        self.initial_part: np.ndarray | None = None
        self._stress_said = self._stress

    def _moduli(self) -> Iterable[tuple[np.ndarray, np.ndarray, list[int], np.ndarray]]:
        yield self.c, self.stiff, [tets.LAMBDA, tets.TWO_MU], np.arange(self.count)

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
        self.s0[: self.count, :6] = self._stress
        if heat is not None:
            self.s0[: self.count, NORMAL] += heat[:, None]
        self._relieve()
        return heat is not None

    def _relieve_crept(self, who: np.ndarray, quads: np.ndarray, s0: np.ndarray, quad_s0: np.ndarray) -> None:
        memory = self.sim.cold["creep"]
        creep_tets.relieve_all(who, self.rows, self.sim.n_left, self.c, self.uncrept, memory, s0)

    def _relieve_flowed(self, base: np.ndarray, quad_base: np.ndarray, s0: np.ndarray, quad_s0: np.ndarray) -> None:
        memory = self.sim.cold["plastic"]
        plastic_tets.relieve_all(self.rows[: self.count], self.sim.n_left, self.c, base, memory, s0)

    def _renew_strength(self) -> None:
        if len(self.strength.history):
            rows = self.rows[: self.count]
            plastic_tets.renew_all(rows, self.sim.n_left, self.law, self.strength, self.yield_table)

    def obey(self) -> None:
        """Elements flow and creep, as those of this step do before its forces."""
        sim = self.sim
        if self.yields:
            self.flow(self.plastic_state(), sim.clock.step)
        if self._creeps_now():
            self.creep(sim.cold["creep"], self.s0, self.quad_s0, keep=sim.options.dynamic)

    def obeyed_state(self) -> list[np.ndarray]:
        """What `obey` changes."""
        found = [*self.plastic_state()] if self.yields else []
        return found + ([self.sim.cold["creep"], self.s0] if self._creeps_now() else [])

    def flow(self, state: tuple[np.ndarray, ...], step: int) -> None:
        memory, s0, _, table, history = state
        sim = self.sim
        kernel: Any = plastic_tets.flows if sim.threads == 1 else plastic_tets.flows_threaded
        kernel(
            sim.threads, self.yielding, self.who_yields, self.rows, sim.n_left, sim.x, self.c, self.initial, self.law,
            self.strength._replace(history=history), not sim.options.large_strain, step, memory, s0, table,
        )  # fmt: skip

    def creep(self, memory: np.ndarray, s0: np.ndarray, quad_s0: np.ndarray, keep: bool) -> None:
        sim = self.sim
        kernel: Any = creep_tets.creep if sim.threads == 1 else creep_tets.creep_threaded
        kernel(
            sim.threads, self.creeping, self.rows, sim.n_left, sim.x, self.c, self.uncrept, self.creep_law,
            self.creep_table, not sim.options.large_strain, sim.creep.passed, keep, memory, s0,
        )  # fmt: skip

    def linear(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Constants (count + 3, 16) and stress without strain (count + 3, 8) [Pa] of the elastic tetrahedra that those
        that creep are within this creep step; of quads nothing. Not to be changed."""
        sim, nothing = self.sim, self.quad_s0
        if not (self.creeps and sim.creep.passed > 0.0):
            return self.c, self.s0, nothing, nothing
        c, s0 = self.c.copy(), self.s0.copy()
        creep_tets.as_elastic(
            self.creeping, self.rows, sim.n_left, self.c, self.uncrept, self.creep_law, self.creep_table,
            sim.creep.passed, sim.cold["creep"], c, s0,
        )  # fmt: skip
        return c, s0, nothing, nothing

    def creep_memory(self, memory: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """What the elements that creep remember in memory (n_own, 16): (n, 16), and the rows (n,) of their models."""
        return [(memory[self.rows[self.creeping] - self.sim.n_left], self.creep_law[self.creeping])]

    def creep_strains(self) -> np.ndarray:
        """Creep strain and strain of the Kelvin unit, xx, yy, xy, zz, xz, yz each (n_own, 12), along the axes of
        space."""
        sim, out = self.sim, np.zeros((self.sim.n_own, 12))
        small, memory = not sim.options.large_strain, self.crept()[0]
        creep_tets.strains(self.rows[: self.count], sim.n_left, sim.x, self.c, small, memory, out)
        return out

    def remembered(self, flow: bool) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None]:
        """Stress without strain (n + 3, 8) [Pa] after this moment, and what is remembered then of yielding and creep.
        flow: after the flow of this moment; else that of the last step."""
        plastic, s0, crept = None, self.s0, None
        if self.plastic and flow:
            plastic, s0, _ = self.flowed()
        if self.creeps:
            crept, s0, _ = self.crept(*(() if plastic is None else (s0, self.quad_s0)))
        return s0, plastic, crept

    def remembered_energy(self, plastic: np.ndarray | None, crept: np.ndarray | None) -> np.ndarray:
        """(n_own,) [J] by which the elastic energy differs from that of elements with their stress without strain as
        initial stress; plastic, crept: what is remembered."""
        sim, rows, more = self.sim, self.rows[: self.count], np.zeros(self.sim.n_own)
        if crept is not None:
            creep_tets.stored(rows, sim.n_left, self.c, self.said, self.creep_law, self.creep_table, crept, more)
        if plastic is not None:
            initial = self.initial
            if crept is not None:
                initial, every = self.said.copy(), np.arange(self.count)
                creep_tets.relieve_all(every, rows, sim.n_left, self.c, self.said, crept, initial)
            plastic_tets.locked_in(rows, sim.n_left, self.c, initial, plastic, more)
        return more

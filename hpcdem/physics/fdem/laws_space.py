"""Tetrahedra and hexahedra that yield or creep: what `Local` does for the elements of the plane, by plastic_tets.py,
creep_tets.py, plastic_hexes.py and creep_hexes.py."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcdem.physics.fdem import user_laws
from hpcdem.physics.fdem.hexahedra import PARTS
from hpcdem.physics.fdem.hexes import Hexes
from hpcdem.physics.fdem.kernels import (
    creep_hexes,
    creep_tets,
    hexes,
    plastic_hexes,
    plastic_tets,
    plasticity,
    space,
    tets,
)
from hpcdem.physics.fdem.local import Local, creep_table, element_table

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
    slot_link: np.ndarray
    slot_size: np.ndarray
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
        self._make_laws()
        if not (self.plastic or self.creeps):
            self._begin_warm()
            return
        number = sim.number[self.rows[:count]]
        self.law = np.zeros(count + 3, np.int32)
        self.law[:count] = sim.element_row[number]
        self.said, self.uncrept, self.initial = (np.zeros((count, tets.STRESSES)) for _ in range(3))
        self.quad_said, self.quad_uncrept, self.quad_initial = (np.zeros_like(self.quad_s0) for _ in range(3))
        yields, creeps, apart = sim.yielding()[number], sim.creeping()[number], np.empty(0, np.int32)
        self.quad_law, self.creeping_quads = np.zeros((many, hexes.PARTS), np.int32), np.empty(0, np.int64)
        if of_hexes is not None:
            apart = of_hexes.rows[:, 0]
            parts = (apart - sim.n_left)[:, None] + np.arange(PARTS)
            self.law[parts] = 0
            self.quad_law[: len(apart)] = of_hexes.model[:, None]
            self.creep_law_of_hexes = of_hexes.model.astype(np.int32)
            self.hexes_yield = yields[parts[:, 0]]
            self.creeping_quads = np.flatnonzero(creeps[parts[:, 0]])
            yields[parts] = creeps[parts] = False
        if self.creeps:
            self.creep_table, self.creep_law = creep_table(sim.element_rows), self.law.copy()
            self.creeping = np.flatnonzero(creeps)
        if self.plastic:
            yielding = np.flatnonzero(yields)
            self.yielding, fill = len(yielding), np.repeat(yielding[-1:], 3)
            self.who_yields = np.concatenate([yielding, fill]).astype(np.int32)
            self._make_strength(self.rows[:count], apart)
        self._begin_warm()

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

    def _quad_count(self) -> int:
        return 0 if self.hexes is None else self.hexes.count

    def _relieve_crept(self, who: np.ndarray, quads: np.ndarray, s0: np.ndarray, quad_s0: np.ndarray) -> None:
        memory = self.sim.cold["creep"]
        creep_tets.relieve_all(who, self.rows, self.sim.n_left, self.c, self.uncrept, memory, s0)
        if self.hexes is not None and len(quads):
            creep_hexes.relieve_all(quads, self.hexes.begin, self.hexes.h, self.quad_uncrept, memory, quad_s0)

    def _relieve_flowed(self, base: np.ndarray, quad_base: np.ndarray, s0: np.ndarray, quad_s0: np.ndarray) -> None:
        memory = self.sim.cold["plastic"]
        plastic_tets.relieve_all(self.rows[: self.count], self.sim.n_left, self.c, base, memory, s0)
        if self.hexes is not None:
            plastic_hexes.relieve_all(self.hexes.count, self.hexes.begin, self.hexes.h, quad_base, memory, quad_s0)

    def _renew_strength(self) -> None:
        if len(self.strength.history):
            rows = self.rows[: self.count]
            plastic_tets.renew_all(rows, self.sim.n_left, self.law, self.strength, self.yield_table)
            if self.hexes is not None:
                own = self.hexes
                plastic_hexes.renew_all(own.count, own.begin, self.quad_law, self.strength, self.yield_table)

    def obey(self) -> None:
        """Elements flow and creep, as those of this step do before its forces."""
        sim = self.sim
        if self.yields:
            self.flow(self.plastic_state(), sim.clock.step)
        if self._creeps_now():
            self.creep(sim.cold["creep"], self.s0, self.quad_s0, keep=sim.options.dynamic)
        if self.laws:
            self._obey(sim.cold[user_laws.COLUMN], self.s0, self.quad_s0)

    def obeyed_state(self) -> list[np.ndarray]:
        """What `obey` changes."""
        found = [*self.plastic_state()] if self.yields else []
        if self.laws:
            found += [self.sim.cold[user_laws.COLUMN], self.s0, self.quad_s0]
        return found + ([self.sim.cold["creep"], self.s0, self.quad_s0] if self._creeps_now() else [])

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

    def flow(self, state: tuple[np.ndarray, ...], step: int) -> None:
        memory, s0, quad_s0, table, history = state
        sim, small, own = self.sim, not self.sim.options.large_strain, self.hexes
        kernel: Any = plastic_tets.flows if sim.threads == 1 else plastic_tets.flows_threaded
        kernel(
            sim.threads, self.yielding, self.who_yields, self.rows, sim.n_left, sim.x, self.c, self.initial, self.law,
            self.strength._replace(history=history), small, step, memory, s0, table,
        )  # fmt: skip
        if own is not None:
            kernel = plastic_hexes.flows if sim.threads == 1 else plastic_hexes.flows_threaded
            kernel(
                sim.threads, own.count, own.begin, own.place, sim.x, own.parts, own.h, self.quad_initial, self.quad_law,
                self.hexes_yield, self.strength._replace(history=history), small, step, memory, quad_s0, table,
            )  # fmt: skip

    def creep(self, memory: np.ndarray, s0: np.ndarray, quad_s0: np.ndarray, keep: bool) -> None:
        sim, own = self.sim, self.hexes
        how = self.creep_table, not sim.options.large_strain, sim.creep.passed, keep, memory
        kernel: Any = creep_tets.creep if sim.threads == 1 else creep_tets.creep_threaded
        kernel(sim.threads, self.creeping, self.rows, sim.n_left, sim.x, self.c, self.uncrept, self.creep_law, *how, s0)
        if own is not None and len(self.creeping_quads):
            kernel = creep_hexes.creep if sim.threads == 1 else creep_hexes.creep_threaded
            kernel(
                sim.threads, self.creeping_quads, own.begin, own.place, sim.x, own.parts, own.h, self.quad_uncrept,
                self.creep_law_of_hexes, *how, quad_s0,
            )  # fmt: skip

    def linear(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Constants (count + 3, 16) and stress without strain (count + 3, 8) [Pa] of the elastic tetrahedra that those
        that creep are within this creep step; of hexahedra (count + 3, 20) and (count + 3, 10, 8). Not to be
        changed."""
        sim, own = self.sim, self.hexes
        h, quad_s0 = np.empty((0, hexes.HEX)) if own is None else own.h, self.quad_s0
        if not (self.creeps and sim.creep.passed > 0.0):
            return self.c, self.s0, h, quad_s0
        c, s0, h, quad_s0 = self.c.copy(), self.s0.copy(), h.copy(), quad_s0.copy()
        how = self.creep_table, sim.creep.passed, sim.cold["creep"]
        creep_tets.as_elastic(self.creeping, self.rows, sim.n_left, self.c, self.uncrept, self.creep_law, *how, c, s0)
        if own is not None and len(self.creeping_quads):
            creep_hexes.as_elastic(
                self.creeping_quads, own.begin, own.h, self.quad_uncrept, self.creep_law_of_hexes, *how, h, quad_s0
            )
        return c, s0, h, quad_s0

    def creep_memory(self, memory: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """What the elements that creep, and the tetrahedra of hexahedra, remember in memory (n_own, 16 or 32): (n, 16),
        and the rows (n,) of their models."""
        of_tets = memory[self.rows[self.creeping] - self.sim.n_left, : creep_tets.MEMORY]
        found = [(of_tets, self.creep_law[self.creeping])]
        if self.hexes is not None and len(self.creeping_quads):
            parts = self.hexes.histories(memory)[self.creeping_quads].reshape(-1, creep_tets.MEMORY)
            found.append((parts, np.repeat(self.creep_law_of_hexes[self.creeping_quads], hexes.PARTS)))
        return found

    def creep_strains(self) -> np.ndarray:
        """Creep strain and strain of the Kelvin unit, xx, yy, xy, zz, xz, yz each (n_own, 12), along the axes of
        space."""
        sim, out = self.sim, np.zeros((self.sim.n_own, 12))
        small, memory = not sim.options.large_strain, self.crept()[0]
        creep_tets.strains(self.rows[: self.count], sim.n_left, sim.x, self.c, small, memory, out)
        if (own := self.hexes) is not None:
            found = np.empty((own.count, 12))
            creep_hexes.strains(own.count, own.begin, own.place, sim.x, own.parts, own.h, small, memory, found)
            out[own.rows - sim.n_left] = found[:, None]
        return out

    def _surfaces(self) -> np.ndarray:
        """As in the plane; of parts of a hexahedron that of its first tetrahedron."""
        of = self.law[: self.count].astype(np.int64)
        if (own := self.hexes) is not None:
            of[own.rows - self.sim.n_left] = self.quad_law[: own.count, :1]
        return of

    def plastic_columns(self, at: slice | np.ndarray) -> np.ndarray:
        """As in the plane; parts of a hexahedron have the mean of its tetrahedra, and of their work the part of their
        volume."""
        memory = self.flowed()[0]
        found = memory[:, : plasticity.MEMORY].copy()
        if (own := self.hexes) is not None:
            parts = own.histories(memory)[:, :, : plasticity.MEMORY]
            share = own.shares()[:, :, None]
            mean = (share * parts).sum(axis=1)
            latest = [plasticity.IN_SHEAR, plasticity.IN_TENSION]
            mean[:, latest] = parts[:, :, latest].max(axis=1)
            work = parts[:, :, plasticity.WORK].sum(axis=1)
            found[own.rows - self.sim.n_left] = mean[:, None]
            found[own.rows - self.sim.n_left, plasticity.WORK] = work[:, None] * own.part_of_volume()
        return found[at]

    def lost_by_creep(self) -> np.ndarray:
        """As in the plane; parts of a hexahedron have the part of their volume."""
        found = self.crept()[0].reshape(self.sim.n_own, self.sim.element_parts, -1)[:, :, creep_tets.LOST].sum(axis=1)
        if (own := self.hexes) is not None:
            rows = own.rows - self.sim.n_left
            found[rows] = found[rows].sum(axis=1, keepdims=True) * own.part_of_volume()
        return found

    def hexes_store(self, plastic: np.ndarray | None, crept: np.ndarray | None) -> Callable[..., None]:
        """What adds `remembered_energy` to energies of some hexahedra, see `Hexes.spread`."""
        own, base = self.hexes, self.quad_initial if plastic is not None else None
        assert own is not None

        def add(which: np.ndarray, energy: np.ndarray) -> None:
            nonlocal base
            if crept is not None:
                creep_hexes.stored(
                    which, own.begin, own.parts, own.h, self.quad_said, self.creep_law_of_hexes, self.creep_table,
                    crept, energy,
                )  # fmt: skip
            if plastic is not None:
                if crept is not None:
                    base, every = self.quad_said.copy(), np.arange(own.count)
                    creep_hexes.relieve_all(every, own.begin, own.h, self.quad_said, crept, base)
                plastic_hexes.locked_in(which, own.begin, own.parts, own.h, base, plastic, energy)

        return add

    def remembered(self, flow: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray | None, np.ndarray | None]:
        """Stress without strain (n + 3, 8) [Pa] after this moment, that of hexahedra (count + 3, 10, 8), and what is
        remembered then of yielding and creep. flow: after the flow of this moment; else that of the last step."""
        plastic, s0, quad_s0, crept = None, self.s0, self.quad_s0, None
        if self.plastic and flow:
            plastic, s0, quad_s0 = self.flowed()
        if self.creeps:
            crept, s0, quad_s0 = self.crept(*(() if plastic is None else (s0, quad_s0)))
        if self.laws:
            s0, quad_s0 = s0.copy(), quad_s0.copy()
            self.obeyed(s0, quad_s0)
        return s0, quad_s0, plastic, crept

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

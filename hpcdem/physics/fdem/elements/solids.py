"""The elements that a rank owns: what makes the stress in them, of any kind and in both dimensions.

The loops over forces know elastic elements only. All else is stress without strain (`ElementBlock.s0`): what was
assigned, what heat brings, less that of plastic and creep strain; and moduli, which may follow temperatures.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.memory import sparse_zeros
from hpcdem.physics.fdem import by_temperature, user_laws
from hpcdem.physics.fdem.elements.creeping import Creeping
from hpcdem.physics.fdem.elements.user_laws import UserLaws
from hpcdem.physics.fdem.elements.yielding import Yielding
from hpcdem.physics.fdem.moduli import moduli

if TYPE_CHECKING:
    from hpcdem.physics.fdem.elements.block import ElementBlock
    from hpcdem.physics.fdem.state import State


class Solids:
    """The elements that a rank owns, with everything that determines their stress.

    blocks: the elements, one block for each kind; whole: elements whose forces replace those of their parts, or None;
    yielding, creeping, laws: tables of plasticity, creep and user laws; temperature_dependent: a property follows a
    table over temperature; heated: there is thermal stress; initial (n_own, 4 or 6) [Pa]: initial stress, scaled to the
    present moduli; initial_part (n_own,): this scale relative to the largest moduli, None for 1."""

    initial_part: np.ndarray | None = None
    heated = False

    def __init__(
        self, sim: State, blocks: Sequence[ElementBlock], temperature_dependent: bool, whole: Any = None
    ) -> None:
        self.sim, self.blocks, self.temperature_dependent, self.whole = sim, blocks, temperature_dependent, whole
        if temperature_dependent:
            for of in blocks:
                of.set_apart()
        if sim.stress0 is None:
            self.initial = sparse_zeros((sim.n_own, len(blocks[0].kind.components)))
        else:
            self.initial = sim.initial_stresses(sim.number[sim.owned])
        self._assigned = self.initial.copy() if temperature_dependent else self.initial
        self.yielding, self.creeping = Yielding(sim, blocks), Creeping(sim, blocks)
        self.remembers = self.yielding.some or self.creeping.some
        if self.remembers:
            for of in blocks:
                of.remember()
        self.laws = UserLaws(sim, blocks, self.initial, self.yielding.on)
        if temperature_dependent:
            self._follow()
        self.heated = self._find_stress_without_strain()

    @property
    def stressed(self) -> bool:
        """Elements have stress without strain, but for user laws."""
        return self.sim.stress0 is not None or self.remembers or self.heated

    # ---- what temperatures change ----------------------------------------------------------------------------------

    def follow_heat(self) -> None:
        """Temperatures have changed: moduli, strengths and stress without strain are those of now."""
        if self.temperature_dependent:
            self._follow()
        if self.temperature_dependent or self.heated:
            self._find_stress_without_strain()

    def _follow(self) -> None:
        """Moduli, initial stress and strength of elements at their temperatures."""
        sim = self.sim
        part = by_temperature.part_of_young(sim)
        if part is not None:
            for of in self.blocks:
                of.follow(part)
        if sim.stress0 is not None:
            stress_row = sim.stress0_row[sim.number[sim.owned]]
            before = by_temperature.part_of_young(sim, stress_row, by_temperature.unstressed(sim))
            if part is not None or before is not None:
                ratio = np.ones(sim.n_own) if part is None else part.copy()
                if before is not None:
                    ratio /= np.where(stress_row > 0, before, 1.0)
                self.initial_part = ratio
                self.initial[:] = self._assigned * ratio[:, None]
        self.yielding.follow_heat()

    def _find_stress_without_strain(self) -> bool:
        """Compute the stress without strain of all elements: initial stress plus thermal stress, less the part of
        plastic and creep strain. Returns whether there is thermal stress."""
        sim, heat = self.sim, self.sim.surface_loads.eigenstress(self.sim)
        self.laws.take_heat(heat)
        if heat is None and not (self.heated or self.remembers or self.laws.some) and sim.stress0 is None:
            return False  # of a table of zeros that nobody has written to nothing is in the memory
        brought = np.zeros(0) if heat is None else np.ascontiguousarray(heat)
        for of in self.blocks:
            of.lay(self.initial, brought, sim.options.plane_stress)
        if self.whole is not None:
            self.whole.take_stress(self.blocks[0].flat())
        self._relieve()
        self.laws.lay()
        return heat is not None

    def _relieve(self) -> None:
        """Stress without strain, with that of what elements remember."""
        if not self.remembers:
            return
        blocks, yielding, creeping = self.blocks, self.yielding, self.creeping
        for of in blocks:
            of.elastic[:] = of.uncrept[:] = of.s0
        if creeping.some:
            creeping.relieve([(of, np.arange(of.count), of.uncrept, of.s0) for of in blocks])
        for of in blocks:
            of.initial[:] = of.s0
        if yielding.some:
            yielding.relieve([(of.initial, of.s0) for of in blocks])
        if yielding.some and creeping.some:  # some that creep may have yielded before, with another model
            yielding.relieve([(of.elastic, of.uncrept) for of in blocks])
            creeping.relieve([(of, of.creeping, of.uncrept, of.s0) for of in blocks])

    # ---- in a step -------------------------------------------------------------------------------------------------

    def move_on(self, every: bool) -> None:
        """Update plastic flow, creep and user laws before the forces of this step.

        every: include the laws that the loop over forces would update itself."""
        sim = self.sim
        if self.yielding.on:
            self.yielding.flow(sim.clock.step, every=every)
        if self.creeping.now:
            self.creeping.creep(sim.cold["creep"], [of.s0 for of in self.blocks], keep=sim.options.dynamic)
        if self.laws.here:
            self.laws.update(sim.cold[user_laws.COLUMN], [of.s0 for of in self.blocks], every=every)

    def changing(self) -> list[np.ndarray]:
        """Arrays that `move_on`, or the loop over forces, changes."""
        sim, found = self.sim, list[np.ndarray]()
        if self.yielding.on:
            memory, s0, *rest = self.yielding.state()
            found += [memory, *s0, *rest]
        if self.creeping.now:
            found.append(sim.cold["creep"])
        if self.laws.here:
            found.append(sim.cold[user_laws.COLUMN])
        return found + [of.s0 for of in self.blocks if self.laws.here or self.creeping.now]

    # ---- at this moment --------------------------------------------------------------------------------------------

    def linear(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Constants and stress without strain (n, parts, k) [Pa] of the elastic elements that those of the blocks are
        at this moment: those that creep within this creep step, others after the flow of this moment. Not to be
        changed."""
        found = [(of.c, of.s0) for of in self.blocks]
        if self.creeping.some and self.sim.creep.passed > 0.0:
            found = self.creeping.as_elastic(found)
        if self.yielding.on:
            for k, (of, flowed) in enumerate(zip(self.blocks, self.yielding.flowed()[1])):
                c, s0 = found[k]
                flowed[of.creeping] = s0[of.creeping]
                found[k] = c, flowed
        return found

    def remembered(self, flow: bool) -> tuple[list[np.ndarray], np.ndarray | None, np.ndarray | None]:
        """Stress without strain [Pa] of the blocks after this moment, and what is remembered then of yielding and of
        creep. flow: after the flow of this moment; else that of the last step."""
        plastic = crept = None
        s0 = [of.s0 for of in self.blocks]
        if self.yielding.some and flow:
            plastic, s0 = self.yielding.flowed()
        if plastic is None and (self.creeping.some or self.laws.here):
            s0 = [one.copy() for one in s0]
        if self.creeping.some:
            crept = self.creeping.crept(s0)
        if self.laws.here:
            self.laws.updated(s0)
        return s0, plastic, crept

    def remembered_energy(self, plastic: np.ndarray | None, crept: np.ndarray | None) -> np.ndarray:
        """(n_own,) [J], in the plane [J/m], by which the elastic energy differs from that of elements with their stress
        without strain as initial stress; plastic, crept: what is remembered."""
        initial, more = [of.initial for of in self.blocks], np.zeros(self.sim.n_own)
        found = [np.zeros(of.count) for of in self.blocks]
        if crept is not None:
            found = self.creeping.stored(crept)
            if plastic is not None:
                initial = [of.elastic.copy() for of in self.blocks]
                with_ = [(of, np.arange(of.count), of.elastic, s0) for of, s0 in zip(self.blocks, initial)]
                self.creeping.relieve(with_, crept)
        for of, energy in zip(self.blocks, found):
            of.share_out(energy, more)
        if plastic is not None:
            self.yielding.add_locked_in(initial, plastic, more)
        return more

    def other_energies(self) -> list[np.ndarray]:
        """Further elastic energy: thermal; NaN where a user law declares no stored energy."""
        found = [self._energy_of_heat()] if self.heated else []
        if self.laws.some:
            of_users = user_laws.numbers(self.sim)[self.sim.number[self.sim.owned]] > 0
            found.append(np.where(of_users, np.nan, 0.0))
        return found

    def _energy_of_heat(self) -> np.ndarray:
        """Elastic energy (n_own,) [J/m] that thermal stress p means where there is no strain, beside the mean m of the
        initial stress: (p^2 + 2 p m) A / (2 K), see moduli.py."""
        sim, number = self.sim, self.sim.number[self.sim.owned]
        stress = np.asarray(sim.surface_loads.eigenstress(sim))
        of = moduli(sim.element_rows, sim.options.plane_stress)
        bulk = of.bulk[sim.element_row[number]]
        initial = sim.initial_stresses(number) if sim.stress0 is not None else np.zeros((sim.n_own, 4))
        if (part := by_temperature.part_of_young(sim)) is not None:
            bulk = bulk * part
        if self.initial_part is not None:
            initial = initial * self.initial_part[:, None]
        mean = initial[:, of.normal].sum(axis=1) / len(of.normal)
        energy = stress * (0.5 * stress + mean) / bulk * sim.areas[number]
        for block in self.blocks:
            if block.over_parts is not None:
                energy[block.stored] *= block.over_parts()[:, None]
        if self.whole is not None:
            self.whole.gather(energy)
        return np.asarray(energy)

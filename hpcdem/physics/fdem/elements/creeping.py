"""Elements that a rank owns and that creep (kernels/creep.py, its clock creep.py)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hpcdem.physics.fdem.kernels import creep

if TYPE_CHECKING:
    from hpcdem.physics.fdem.elements.block import ElementBlock
    from hpcdem.physics.fdem.properties import Rows
    from hpcdem.physics.fdem.state import State


def creep_table(rows: Rows) -> np.ndarray:
    """The table of creep laws (rows, 3) of kernels/creep.py; models that do not creep have zeros."""
    shear, kelvin, maxwell = (rows.column(n) for n in ("kelvin_shear", "kelvin_viscosity", "maxwell_viscosity"))
    table = np.zeros((len(rows), creep.LAW))
    unit = (shear > 0.0) & (kelvin > 0.0)
    table[unit, creep.KELVIN], table[unit, creep.PER_KELVIN] = shear[unit], 1.0 / kelvin[unit]
    table[maxwell > 0.0, creep.PER_MAXWELL] = 1.0 / maxwell[maxwell > 0.0]
    return table


class Creeping:
    """Creep of the elements in `blocks`. some: an element of the model has crept; table: `creep_table`."""

    def __init__(self, sim: State, blocks: Sequence[ElementBlock]) -> None:
        self.sim, self.blocks, self.some = sim, blocks, "creep" in sim.cold
        if self.some:
            self.table = creep_table(sim.element_rows)
            creeps = sim.creeping()
            for of in blocks:
                of.creeping = of.alone[creeps[sim.number[of.first[of.alone] + sim.n_left]]]

    @property
    def now(self) -> bool:
        """The next forces are those after some creep, or begin it."""
        sim = self.sim
        return self.some and sim.creep.on and (sim.options.dynamic or sim.creep.passed > 0.0)

    def creep(self, memory: np.ndarray, s0: Sequence[np.ndarray], keep: bool) -> None:
        """Elements creep for the time that has passed, see `creep.creep`: memory, if they keep it, and stress without
        strain of the blocks [Pa] become those after it."""
        sim = self.sim
        how = self.table, not sim.options.large_strain, sim.creep.passed, keep, memory
        for of, stress in zip(self.blocks, s0):
            if len(of.creeping):
                creep.creep(sim.threads, of.creeping, of.tables, of.uncrept, of.model, *how, stress)

    def keep(self) -> None:
        """Elements have crept for the time that has passed, and remember it."""
        self.creep(self.sim.cold["creep"], [of.s0 for of in self.blocks], keep=True)

    def crept(self, s0: Sequence[np.ndarray] | None = None) -> np.ndarray:
        """Compute the creep state that the next forces will use, and the stress without strain s0 of the blocks after
        it, without changing the model."""
        memory = self.sim.cold["creep"].copy()
        if self.now:
            self.creep(memory, [of.s0.copy() for of in self.blocks] if s0 is None else s0, keep=True)
        return memory

    def relieve(
        self, of: Iterable[tuple[ElementBlock, np.ndarray, np.ndarray, np.ndarray]], memory: np.ndarray | None = None
    ) -> None:
        """Stress without strain, the last of each, of some elements: that of their creep strain less than that before
        it. memory: what they remember of creep."""
        for one, who, base, s0 in of:
            if len(who):
                creep.relieve_all(who, one.tables, base, self.sim.cold["creep"] if memory is None else memory, s0)

    def stored(self, memory: np.ndarray) -> list[np.ndarray]:
        """Elastic energy (count,) [J] that this memory means besides, in the elements of each block."""
        found = [np.zeros(of.count) for of in self.blocks]
        for of, energy in zip(self.blocks, found):
            if of.count:
                creep.stored(np.arange(of.count), of.tables, of.elastic, of.model, self.table, memory, energy)
        return found

    def lost(self) -> np.ndarray:
        """Energy dissipated by creep of owned elements (n_own,) [J], in the plane [J/m]."""
        memory, found = self.crept(), np.zeros(self.sim.n_own)
        for of in self.blocks:
            of.share_out(of.histories(memory, self.sim.memory("creep"))[:, :, creep.LOST].sum(axis=1), found)
        return found

    def memory(self, memory: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Creep state of the parts of creeping elements in memory (n, 10 or 16), and the rows (n,) of their models in
        the table."""
        found = []
        for of in self.blocks:
            parts = of.histories(memory, self.sim.memory("creep"))[of.creeping]
            found.append((parts.reshape(-1, parts.shape[2]), np.repeat(of.model[of.creeping], parts.shape[1])))
        return found

    def as_elastic(self, of: Sequence[tuple[np.ndarray, np.ndarray]]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Constants and stress without strain (n, parts, k) [Pa] of the elastic elements that those of the blocks are
        within this creep step."""
        found, sim = [(c.copy(), s0.copy()) for c, s0 in of], self.sim
        for one, like in zip(self.blocks, found):
            if len(one.creeping):
                how = self.table, sim.creep.passed, sim.cold["creep"]
                creep.as_elastic(one.creeping, one.tables, one.uncrept, one.model, *how, *like)
        return found

    def strains(self) -> np.ndarray:
        """Creep strain and strain of the Kelvin unit, xx, yy, xy, in space zz, xz, yz besides, each (n_own, 6 or 12),
        along the axes of space; means over the parts of elements by volume."""
        sim = self.sim
        out, memory = np.zeros((sim.n_own, 6 if sim.dim == 2 else 12)), self.crept()
        for of in self.blocks:
            found = np.zeros((of.count, out.shape[1]))
            if of.count:
                creep.strains(of.count, of.tables, not sim.options.large_strain, memory, found)
            of.spread(found, out)
        return out

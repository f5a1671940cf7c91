"""Elements that a rank owns and that yield: their yield surfaces, and when they flow (flow.py)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from hpcdem.physics.fdem import by_temperature
from hpcdem.physics.fdem.elements import flow as plastic_flow
from hpcdem.physics.fdem.elements.kind import QUAD, TETRAHEDRON
from hpcdem.physics.fdem.kernels import plasticity, strength
from hpcdem.physics.fdem.principal import principal
from hpcdem.physics.fdem.properties import MECH_MOHR_COULOMB, SOFTENS, Rows, softening_rows, softening_table

if TYPE_CHECKING:
    from hpcdem.physics.fdem.elements.block import ElementBlock
    from hpcdem.physics.fdem.state import State
    from hpcdem.physics.fdem.tables import Table

Flow = tuple[np.ndarray, list[np.ndarray], np.ndarray, np.ndarray]
"""Arrays changed by plastic flow: histories of yielding (n_own, 9 or more), stresses without strain of the blocks [Pa],
yield surfaces (rows, 4), strains that strength follows."""


def yield_table(rows: Rows) -> np.ndarray:
    """The table of yield surfaces (rows, 4) of plasticity.py; models that do not yield have infinite strength."""
    yields = np.array([rows.name(row) == MECH_MOHR_COULOMB.name for row in range(len(rows))])
    friction, dilation = (np.radians(rows.column(name)) for name in ("friction", "dilation"))
    cohesion = np.where(yields, rows.column("cohesion"), math.inf)
    table = np.empty((len(rows), plasticity.YIELD))
    table[:, plasticity.N_PHI] = np.tan(0.25 * math.pi + 0.5 * friction) ** 2
    table[:, plasticity.N_PSI] = np.tan(0.25 * math.pi + 0.5 * dilation) ** 2
    table[:, plasticity.STRENGTH] = 2.0 * cohesion * np.sqrt(table[:, plasticity.N_PHI])
    apex = np.divide(cohesion, np.tan(friction), out=np.full(len(rows), math.inf), where=friction > 0.0)
    table[:, plasticity.TENSILE] = np.where(yields, np.minimum(rows.column("tensile"), apex), math.inf)
    return table


def strength_tables(rows: Rows, of: np.ndarray, tables: list[Table], history: np.ndarray) -> strength.Strength:
    """The arrays of strength.py; of (own rows,): the row of the model of each. Strengths are the largest that tables
    over temperature have."""
    pieces = [np.column_stack([one.times, one.values]) for one in tables]
    return strength.Strength(
        len(rows),
        of.astype(np.int64),
        np.column_stack([rows.column(name)[of] for name in SOFTENS]),
        np.column_stack([rows.column(softening_table(name)) for name in SOFTENS]).astype(np.int64),
        np.cumsum([0, *map(len, pieces)]),
        np.concatenate([np.empty((0, 2)), *pieces]),
        history,
    )


class Yielding:
    """Plasticity of the elements in `blocks`. some: an element of the model has yielded; on: some can yield and are not
    forced to be elastic now; strength, table: see strength.py and `yield_table`."""

    strength: strength.Strength
    table: np.ndarray

    def __init__(self, sim: State, blocks: Sequence[ElementBlock]) -> None:
        self.sim, self.blocks = sim, blocks
        self.some, self.on = "plastic" in sim.cold, bool(sim.yielding().any())
        if self.some:
            self._make_strength()

    def _make_strength(self) -> None:
        """The table of yield surfaces; parts of elements whose strength follows tables have a row of their own."""
        sim = self.sim
        of_models = yield_table(sim.element_rows)
        history = sim.cold.get("softening", np.zeros((0, strength.HISTORY)))
        softens = softening_rows(sim.element_rows) if len(history) else np.zeros(len(of_models), bool)
        of, element, first = [], [], len(of_models)
        for one in self.blocks:
            one.law = np.zeros((len(one.s0), len(one.kind.parts)), np.int32)
            one.law[one.alone] = one.model[one.alone, None]
            law = one.law[: one.count]
            own = softens[law]
            of.append(law[own])
            element.append(one.first[np.nonzero(own)[0]])
            law[own] = first + np.arange(int(own.sum()))
            first += int(own.sum())
        self.strength = strength_tables(sim.element_rows, np.concatenate(of), sim.followed, history)
        self.table = np.concatenate([of_models, np.zeros((first - len(of_models), plasticity.YIELD))])
        self._strength_element = np.concatenate(element)
        self._renew()
        for one in self.blocks:
            can = np.isfinite(self.table[one.law[one.alone], plasticity.STRENGTH]).any(axis=1)
            # Only tetrahedra are gathered from anywhere, the others in the order of storage.
            who = one.alone[can] if one.kind is TETRAHEDRON else one.alone[: one.count * bool(can.any())]
            one.flowing = np.concatenate([who, np.repeat(who[-1:], 3)])

    def _renew(self) -> None:
        """The yield surfaces of parts of elements that have one of their own."""
        if len(self.strength.history):
            for of in self.blocks:
                plastic_flow.renew_all(of.tables, of.count, of.law, self.strength, self.table)

    def follow_heat(self) -> None:
        """Strengths are those of the temperatures of now."""
        if not self.some or not len(self.strength.of):
            return
        sim, at, of = self.sim, self._strength_element, self.strength.of
        t = cache(lambda name: by_temperature.means(sim, name)[at])
        for column, name in ((strength.COHESION, "cohesion"), (strength.TENSILE, "tensile")):
            self.strength.values[:, column] = by_temperature.values(sim, sim.element_rows, name, of, t)
        self._renew()

    def relieve(self, of: Sequence[tuple[np.ndarray, np.ndarray]]) -> None:
        """Stress without strain of the blocks: that of their plastic strain less than base, both (n, parts, k) [Pa]."""
        for one, (base, s0) in zip(self.blocks, of):
            if one.count:
                plastic_flow.relieve_all(one.tables, one.count, base, self.sim.cold["plastic"], s0)

    @contextmanager
    def off(self) -> Iterator[None]:
        """Elements are elastic meanwhile, with what they remember of flow."""
        on, self.on = self.on, False
        try:
            yield
        finally:
            self.on = on

    def state(self) -> Flow:
        """Arrays that plastic flow changes."""
        return self.sim.cold["plastic"], [of.s0 for of in self.blocks], self.table, self.strength.history

    def flow(self, step: int, state: Flow | None = None, every: bool = True) -> None:
        """Elements outside their yield surface at the present positions flow: `state`, or copies of that, becomes the
        one after it. step: in which they do; every: quads too, which within a step flow in the loop over their
        forces."""
        memory, after, table, history = self.state() if state is None else state
        sim, soft = self.sim, self.strength._replace(history=history)
        for of, s0 in zip(self.blocks, after):
            if len(of.flowing) and (every or of.kind is not QUAD):
                plastic_flow.flows(
                    sim.threads, of.tables, len(of.flowing) - 3, of.flowing, of.initial, of.law, soft,
                    not sim.options.large_strain, step, memory, s0, table,
                )  # fmt: skip

    def flowed(self) -> tuple[np.ndarray, list[np.ndarray]]:
        """Compute the plastic state and the stress without strain [Pa] of the blocks that the next forces will use:
        copies."""
        memory, s0, table, history = self.state()
        after = memory.copy(), [one.copy() for one in s0], table.copy(), history.copy()
        if self.on:
            self.flow(self.sim.clock.step, after)
        return after[0], after[1]

    def beyond(self, stress: np.ndarray) -> np.ndarray:
        """Distance [Pa] of the stress of owned elements (n_own, 4 or 6), before plastic flow, outside their strength:
        the larger of shear and tension, negative inside (n_own,)."""
        whole, row = np.zeros((len(stress), 6)), np.zeros(self.sim.n_own, np.int64)
        whole[:, : stress.shape[1]] = stress
        low, _, high = principal(whole[:, [0, 2, 4, 2, 1, 5, 4, 5, 3]].reshape(-1, 3, 3))[0].T
        for of in self.blocks:  # of several parts that of the first one
            of.spread(of.law[: of.count, 0], row)
        surface = self.table[row]
        shear = surface[:, plasticity.N_PHI] * high - low - surface[:, plasticity.STRENGTH]
        return np.maximum(shear, high - surface[:, plasticity.TENSILE])

    def columns(self, at: slice | np.ndarray) -> np.ndarray:
        """Columns `plasticity.MEMORY` (n, 9) of what owned elements remember of yielding, after the flow of this
        moment: means over their parts by volume, the latest steps, the sum of the work."""
        sim, memory = self.sim, self.flowed()[0]
        found, latest = np.zeros((sim.n_own, plasticity.MEMORY)), [plasticity.IN_SHEAR, plasticity.IN_TENSION]
        for of in self.blocks:
            if of.count:
                parts = of.histories(memory, sim.memory("plastic"))[:, :, : plasticity.MEMORY]
                mean = of.mean(parts)
                mean[:, latest] = parts[:, :, latest].max(axis=1)
                of.spread(mean, found)
                of.share_out(parts[:, :, plasticity.WORK].sum(axis=1), found[:, plasticity.WORK])
        return found[at]

    def add_locked_in(self, initial: Sequence[np.ndarray], memory: np.ndarray, more: np.ndarray) -> None:
        """Add the energy (n_own,) that plastic strain means, see flow.py; initial: stress without it of the blocks."""
        found = np.zeros(self.sim.n_own)
        for of, base in zip(self.blocks, initial):
            if of.count:
                energy = np.zeros(of.count)
                plastic_flow.locked_in(of.tables, np.arange(of.count), base, memory, energy)
                of.share_out(energy, found)
        more += found

"""User laws of the elements that a rank owns (laws: physics/fdem/user_laws.py; loops: kernels/user_laws.py)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.physics.fdem import user_laws
from hpcdem.physics.fdem.elements.kind import QUAD, TRIANGLE
from hpcdem.physics.fdem.kernels.elements import BLOCK
from hpcdem.physics.fdem.moduli import moduli

if TYPE_CHECKING:
    from hpcdem.physics.fdem.elements.block import ElementBlock
    from hpcdem.physics.fdem.state import State


@dataclass(frozen=True, eq=False)
class LawHere:
    """A user law on this rank, with its table of properties and the elements of each block that have it (who)."""

    law: user_laws.UserLaw
    table: np.ndarray
    who: tuple[np.ndarray, ...]

    def some(self, of: ElementBlock) -> np.ndarray:
        """Find the blocks of the kernel of triangles that contain an element with this law: (blocks,) bool."""
        found = np.zeros(-(-of.count // BLOCK), bool)
        if of.kind is TRIANGLE:
            found[self.who[0] // BLOCK] = True
        return found


class UserLaws:
    """User laws of the elements in `blocks`, whose initial stress is initial (n_own, 4 or 6) [Pa].

    some: whether an owned element has a user law; here: the laws of owned elements; with_forces: for each block, the
    law that the loop over forces evaluates (in the plane, the law of most elements) and its `LawHere.some`. The other
    laws are evaluated before that loop, with the same bits."""

    def __init__(self, sim: State, blocks: Sequence[ElementBlock], initial: np.ndarray, yields: bool) -> None:
        self.sim, self.blocks, self.initial, self.here = sim, blocks, initial, list[LawHere]()
        self.thermal = np.zeros(0)
        self.with_forces: list[tuple[LawHere, np.ndarray] | None] = [None for _ in blocks]
        rows = sim.element_rows
        laws = user_laws.of_rows(rows)
        number = user_laws.numbers(sim)[sim.number[sim.owned]] if laws else np.zeros(0, np.int64)
        self.some = bool((number > 0).any())
        if not self.some:
            return
        self._number = number
        of_model, bound = moduli(rows, sim.options.plane_stress), np.array(rows.column(user_laws.BOUND))
        modulus = of_model.lame + 2.0 * of_model.shear
        ratio = np.divide(bound, modulus, out=np.ones(len(rows)), where=bound > 0.0)
        for of in blocks:
            at = np.flatnonzero(number[of.first])
            of.stiffen(at, ratio[of.model[at]])
            of.take_moduli(at)
        for k, law in enumerate(laws):
            who = tuple(of.alone[number[of.first[of.alone]] == 1 + k] for of in blocks)
            if any(map(len, who)):
                self.here.append(LawHere(law, law.table(rows), who))
        for k, of in enumerate(blocks):
            many = [len(one.who[k]) for one in self.here]
            if any(many) and (of.kind is TRIANGLE or (of.kind is QUAD and not yields)):
                one = self.here[int(np.argmax(many))]
                self.with_forces[k] = one, one.some(of)

    def take_heat(self, heat: np.ndarray | None) -> None:
        """Set the thermal strain of elements in space: thermal stress (n_own,) [Pa] divided by -3 K."""
        self.thermal = np.zeros(0)
        if self.some and heat is not None and self.sim.dim == 3:
            row = self.sim.element_row[self.sim.number[self.sim.owned]]
            self.thermal = heat / (-3.0 * np.array(self.sim.element_rows.column("bulk"))[row])

    def lay(self) -> None:
        """Reset elements with a user law to their initial stress: plastic and creep strain are of earlier models."""
        for of in self.blocks if self.here else ():
            at = np.flatnonzero(self._number[of.first])
            if len(of.s0):
                of.s0[at, :, : self.initial.shape[1]] = self.initial[of.first[at], None]

    def before(self, k: int) -> bool:
        """Return whether a law of block k is evaluated before the loop over forces."""
        runs = self.with_forces[k]
        return any(len(one.who[k]) and (runs is None or one is not runs[0]) for one in self.here)

    def forces(self, k: int, usual: Any, *args: Any) -> None:
        """Run the loop over the forces of block k with arguments args: `usual` if that loop evaluates no user law."""
        runs, sim = self.with_forces[k], self.sim
        if runs is None:
            usual(*args)
            return
        from hpcdem.physics.fdem.kernels.user_laws import LawTables

        (one, some), of, memory = runs, self.blocks[k], sim.cold[user_laws.COLUMN]
        given = LawTables(some, of.model, one.table, self._dt(), sim.n_left, memory, self._width(memory))
        one.law.loops.with_forces(of.kind)(args[0], given, *args[1:])

    def _dt(self) -> float:
        return float(self.sim.clock.dt) if self.sim.options.dynamic else 0.0

    def _width(self, memory: np.ndarray) -> int:
        """Number of state variables of a part of an element."""
        return (memory.shape[1] - 1) // self.sim.element_parts

    def update(self, memory: np.ndarray, s0: Sequence[np.ndarray], every: bool) -> None:
        """Evaluate laws at the present positions: update memory (see `user_laws.begin`) and the stress s0 [Pa] of the
        blocks. every: include the laws that the loop over forces evaluates."""
        for one in self.here:
            for k, who in enumerate(one.who):
                runs = self.with_forces[k]
                if len(who) and (every or runs is None or one is not runs[0]):
                    self._find(one, k, memory, s0[k])

    def _find(self, one: LawHere, k: int, memory: np.ndarray, s0: np.ndarray) -> None:
        sim, of = self.sim, self.blocks[k]
        one.law.loops.find(
            sim.threads, one.who[k], of.tables, self.initial, self.thermal, of.model, one.table, self._dt(),
            not sim.options.large_strain, memory, self._width(memory), s0,
        )  # fmt: skip

    def updated(self, s0: Sequence[np.ndarray] | None = None) -> np.ndarray:
        """Compute the state variables (see `user_laws.begin`) that the next forces will use, and the stress s0 [Pa] of
        the blocks, without changing the model."""
        memory = self.sim.cold[user_laws.COLUMN].copy()
        self.update(memory, [of.s0.copy() for of in self.blocks] if s0 is None else s0, every=True)
        return memory

    def states(self) -> np.ndarray:
        """Average the states of user laws over the parts of each element by volume: (n_own, 1 + states)."""
        memory = self.updated() if self.here else self.sim.cold[user_laws.COLUMN]
        width = self._width(memory)
        found = memory[:, : 1 + width].copy()
        for of in self.blocks if width else ():
            if of.count:
                of.spread(of.mean(of.histories(memory[:, 1:], width)), found[:, 1:])
        return found

    def trying(self, law: user_laws.UserLaw, kind: str) -> None:
        """Compile the kernels of a law for a kind of elements of which no element has it: those that steps and
        outputs call are called here or by the next forces."""
        nobody, sim = np.zeros(0, np.int64), self.sim
        one = LawHere(law, np.zeros(len(law.columns)), tuple(nobody for _ in self.blocks))
        memory = sim.cold[user_laws.COLUMN] = np.zeros((sim.n_own, 1 + sim.element_parts * len(law.states)))
        for k, of in enumerate(self.blocks):
            if of.kind.name == kind:
                self._find(one, k, memory, of.s0)
                of.mean(np.zeros((of.count, len(of.kind.parts), 1)))
                if of.kind in (TRIANGLE, QUAD):
                    self.with_forces[k] = one, one.some(of)

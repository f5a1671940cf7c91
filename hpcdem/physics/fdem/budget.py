"""The energy budget of a model of blocks: what is stored, what was done and lost, and by how much it does not add up.

Work is booked per element, in columns that travel with it; sums over the model are exact, so neither ranks, threads nor
a restart change a bit of them. Commands between two steps interrupt the account: what is stored before and after them
is compared, and the difference booked as theirs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.account import closed
from hpcdem.engine import budget as engine
from hpcdem.numerics.exact_sum import exact_sum, from_integer
from hpcdem.physics.fdem.kernels import energy, plasticity

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

STORED = ("kinetic", "strain", "joints")
WORK = ("joints", "contact", "viscous", "gravity", "outside", "plastic", "creep")
"""Names of the columns of energy.WORK, and of the work lost by plastic flow and by creep, which elements carry with
their state of plasticity."""


class Budget(engine.Budget["Blocks", float]):
    """The account of one model. accounts: work of each kind [J/m], in space [J]; commands: changes by commands of what
    is stored; discs: the part of the work from outside that discs did, this rank's share, as an integer of
    exact_sum.as_integer; heat: changes of what is stored by temperatures, of_joints: those of them in joints; by_heat:
    that is what interrupts the account now."""

    def __init__(self) -> None:
        super().__init__(STORED, WORK, 0.0)
        self.commands = dict.fromkeys(STORED, 0.0)
        self.heat = self.of_joints = 0.0
        self.by_heat = False
        self.discs = 0
        self._before = np.empty((0, 0))

    # ---- called by the step ----------------------------------------------------------------------------------------

    def before_forces(self, sim: Blocks) -> None:
        """A step begins: take up the account again after an interruption; keep the velocities. Collective."""
        if not self.running:
            self.begin(sim)
            sim.cold["work"] = np.zeros((sim.n_own, energy.WORK))
        with sim.timers("energy"):
            self._before = sim.v.copy()

    def after_forces(self, sim: Blocks) -> None:
        """Velocities are new, positions still old: book the work of this moment's forces."""
        local, pairs = sim.local, sim.local.pairs
        with sim.timers("energy"):
            local.book(
                self._before, sim.v, 0.5, 0.5, local.of_joints, pairs.pushed, local.felt, local.outside,
                sim.cold["work"],
            )  # fmt: skip

    # ---- interruptions ---------------------------------------------------------------------------------------------

    def _book_change(self, change: dict[str, float]) -> None:
        for name in STORED:
            if self.by_heat:
                self.heat += change[name]
                self.of_joints += change[name] if name == "joints" else 0.0
            else:
                self.commands[name] += change[name]

    def pause(self, sim: Blocks, by_heat: bool = False) -> None:
        """A command, or heat, is about to change the model: bring the account to the whole step. Collective."""
        if self.running:
            self.by_heat = by_heat
            super().pause(sim)
            del sim.cold["work"]
        elif self.by_heat and not by_heat:  # what heat did since then is its own
            stored, _ = self._read(sim)
            self._book_change({name: stored[name] - self.left[name] for name in STORED})
            self.left, self.by_heat = stored, False

    # ---- readings --------------------------------------------------------------------------------------------------

    def reading(self, sim: Blocks) -> dict[str, float]:
        """The budget now, see `diagnostics.energies`. Collective."""
        stored, start, work = self.now(sim)
        change = sum(stored.values()) - sum(start.values())
        by_commands = sum(self.commands.values())
        of_discs, of_loads = self._of_discs(sim), sim.surface_loads.work_done()
        in_joints = stored["joints"] - start["joints"] - self.commands["joints"] - self.of_joints
        joints_lost = -work["joints"] - in_joints
        found = {
            "kinetic": stored["kinetic"],
            "strain": stored["strain"],
            "joints": stored["joints"],
            "joints_lost": joints_lost,
            "contact": -work["contact"],
            "viscous_lost": -work["viscous"],
            "plastic_lost": -work["plastic"],
            "creep_lost": -work["creep"],
            "work_gravity": work["gravity"],
            "work_outside": work["outside"] - of_discs - sum(of_loads.values()),
            "work_discs": of_discs,
            "work_bolts": of_loads.get("bolts", 0.0),
            "work_liners": of_loads.get("liners", 0.0),
            "work_heat": self.heat,
            "commands": by_commands,
        }
        given = work["gravity"] + work["outside"] + self.heat + by_commands
        taken = joints_lost - work["contact"] - work["viscous"] - work["plastic"] - work["creep"]
        flows = [joints_lost, *(work[name] for name in WORK[1:]), self.heat, by_commands]
        flows += [sum(map(abs, part.values())) for part in (stored, start)]
        return closed(found, change + taken - given, flows)

    def add_from_discs(self, work: int) -> None:
        """Say how much of the work from outside discs did, this rank's share, as an integer of
        exact_sum.as_integer."""
        self.discs += work

    def _of_discs(self, sim: Blocks) -> float:
        return from_integer(sum(sim.comm.allgather(self.discs)))

    def _booked(self, sim: Blocks) -> dict[str, float]:
        """Work booked in the columns of the elements, summed over the model."""
        columns = sim.cold["work"]
        return {name: exact_sum(columns[:, k], sim.comm) for k, name in enumerate(WORK)}

    def _read(self, sim: Blocks) -> tuple[dict[str, float], dict[str, float]]:
        seen, local = sim.evaluate(), sim.local
        with sim.timers("energy"):
            kinetic = np.empty(sim.n_own)
            local.kinetic(sim.v, seen.v_next, kinetic)
            _, strain = local.stresses()
            in_joints = local.stored_in_joints()
            half = np.zeros((sim.n_own, energy.WORK))
            if local.yielding.some:
                half[:, WORK.index("plastic")] = -local.yielding.columns(slice(None))[:, plasticity.WORK]
            if local.creeping.some:
                half[:, WORK.index("creep")] = -local.creeping.lost()
            local.book(sim.v, sim.v, 0.5, 0.0, seen.of_joints, seen.pushed, seen.felt, seen.outside, half)
            stored = dict(zip(STORED, (exact_sum(part, sim.comm) for part in (kinetic, strain, in_joints))))
            return stored, {name: exact_sum(half[:, k], sim.comm) for k, name in enumerate(WORK)}

    # ---- state on disk ---------------------------------------------------------------------------------------------

    def state(self, sim: Blocks) -> dict[str, Any]:
        """The budget as JSON values; columns of the elements are saved with the elements. Collective."""
        return {
            "accounts": self.accounts, "commands": self.commands, "start": self.start, "left": self.left,
            "running": self.running, "heat": self.heat, "of_joints": self.of_joints, "by_heat": self.by_heat,
            "discs": hex(sum(sim.comm.allgather(self.discs))),
        }  # fmt: skip

    @staticmethod
    def restored(state: dict[str, Any], first: bool) -> Budget:
        """Inverse of `state`; first: this rank takes the share of all ranks."""
        made = Budget()
        made.discs = int(state.get("discs", "0x0"), 16) if first else 0
        made.accounts, made.commands = {**made.accounts, **state["accounts"]}, dict(state["commands"])
        made.heat, made.by_heat = state.get("heat", 0.0), state.get("by_heat", False)
        made.of_joints = state.get("of_joints", 0.0)
        made.start, made.left, made.running = state["start"], state["left"], state["running"]
        return made

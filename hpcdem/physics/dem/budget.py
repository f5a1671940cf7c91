"""The energy budget of a run: what is stored, what was done and lost, and by how much it does not add up.

`Budget` is the account; it is there only after SET energy. The step calls it before it moves particles and around the
forces; the passes are in physics/dem/kernels/energy.py and read only, so a run with it has the same bits as one
without. All sums are exact integers (numerics/exact_sum.py): neither ranks, threads nor a restart change a bit of them.

When the account is taken up, interrupted and read: engine/budget.py.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from hpcdem.engine import budget as engine
from hpcdem.numerics.exact_sum import BINS_SHAPE, as_integer, from_integer
from hpcdem.physics.dem.kernels import energy, mass
from hpcdem.physics.dem.simulation import Simulation

EMPTIED = 512
"""Number of steps after which the bins of exact sums are emptied into integers, long before they are full."""


# Called with the tuple of _wall_slots, which mypy cannot count.
_wall_work: Any = energy.wall_work
_wall_losses: Any = energy.wall_losses
_wall_energy: Any = energy.wall_energy


@dataclass(frozen=True)
class Energy:
    """Energy budget in joules; `relative` has no unit. Flows count since the start of the account: work_* was done on
    the model, loss_* it lost, commands and box came with commands and with particles deleted by the BOX.

    closing: change of what is stored + losses - work - commands - box; relative: that over the largest flow (over
    what is stored, where nothing flowed).
    """

    kinetic_translation: float
    kinetic_rotation: float
    elastic_normal: float
    elastic_shear: float
    elastic_bonds: float
    elastic_rolling: float
    work_gravity: float
    work_walls: float
    work_driven: float
    loss_friction: float
    loss_local_damping: float
    loss_lattice_damping: float
    loss_bonds: float
    loss_opened: float
    loss_stiffness: float
    loss_laws: float
    loss_rolling: float
    commands: float
    box: float
    work_blocks: float
    closing: float
    relative: float


NAMES = tuple(f.name for f in fields(Energy))
STORED, FLOWS = NAMES[: energy.STORED], NAMES[energy.STORED : -2]
"""Flows are those of the kernels, then stored energy changed by commands, gone with particles that left the BOX, and
work done by blocks that touch the particles."""


class Budget(engine.Budget[Simulation, int]):
    """The account of one simulation. running: a CYC or IMPLE continues."""

    def __init__(self) -> None:
        super().__init__(STORED, FLOWS, 0)
        self.finite = True
        self._bins = np.zeros((energy.FLOWS, *BINS_SHAPE), np.int64)
        self._steps = 0
        self._at_rebuild: tuple[int, int] | None = None
        self._shear, self._bonds = np.empty(0), np.empty(0, np.int32)
        self._wall_shear, self._wall_side = np.empty(0), np.empty(0)
        self._normal, self._memory = np.empty(0), np.empty((0, 0))

    # ---- called by the step ----------------------------------------------------------------------------------------

    def before_move(self, sim: Simulation) -> None:
        """Book the coming kick."""
        with sim.timers("energy"):
            _kicks(sim, True, self._bins)
        self._steps += 1
        if self._steps % EMPTIED == 0:
            self._empty()

    def before_rebuild(self, sim: Simulation) -> None:
        """The lists may be rebuilt without some particles: note what is stored with them."""
        self._at_rebuild = sim.lost, sum(self._stored(sim, whole_step=False).values())

    def before_forces(self, sim: Simulation) -> None:
        """Keep the histories of the slots."""
        if self._at_rebuild is not None:
            lost, stored = self._at_rebuild
            self._at_rebuild = None
            if sim.lost != lost:
                self.accounts["box"] += sum(self._stored(sim, whole_step=False).values()) - stored
        lists = sim.lists
        self._shear = _copied(lists.fs, self._shear)
        self._wall_shear = _copied(lists.slot_fs, self._wall_shear)
        self._wall_side = _copied(lists.slot_side, self._wall_side)
        self._bonds = _copied(lists.bond, self._bonds) if sim.bonds else lists.bond
        if sim.own_laws:
            self._normal, self._memory = _copied(lists.u_made, self._normal), _copied(lists.memory, self._memory)

    def after_forces(self, sim: Simulation) -> None:
        """Book what contacts and bonds lost in this step."""
        lists, p, b, dt = sim.lists, sim.particles, sim.lists.blocks, sim.clock.dt
        spheres = mass.SPHERES[sim.settings.disk]
        n_mat = len(sim.materials)
        with sim.timers("energy"):
            for t in range(lists.n_blocks):
                energy.pair_losses(
                    t, p.hot, p.ihot, b.cut, b.lo, b.poff, lists.ptr, lists.partner, lists.fs, lists.bond,
                    lists.u_made, self._shear, self._bonds, sim.pair_laws, sim.bond_laws, n_mat, dt, spheres,
                    self._bins,
                )  # fmt: skip
            if sim.own_laws.loops is not None:
                sim.own_laws.loops.lost(
                    *_own_pairs(sim), self._bins, lists.u_made, self._shear, self._normal, self._memory, dt
                )
            if sim.rolling is not None:
                sim.rolling.book_lost(sim, self._bins[energy.TURNED], self._bins[energy.BONDS])
            _wall_losses(*_wall_slots(sim), self._wall_shear, self._wall_side, sim.wall_laws, n_mat, dt, self._bins)

    # ---- readings --------------------------------------------------------------------------------------------------

    def _read(self, sim: Simulation) -> tuple[dict[str, int], dict[str, int]]:
        bins = np.zeros_like(self._bins)
        _kicks(sim, False, bins)
        return self._stored(sim), {**self._nothing, **dict(zip(FLOWS, map(self._integer, bins)))}

    def _booked(self, sim: Simulation) -> dict[str, int]:
        self._empty()
        return self._nothing

    def _book_change(self, change: dict[str, int]) -> None:
        self.accounts["commands"] += sum(change.values())

    def evaluate(self, sim: Simulation) -> Energy:
        """The budget now. The model must be closed. Collective."""
        found = self.now(sim)
        total = [_summed(sim, list(part.values())) for part in found]
        if sim.comm.any(not self.finite):
            return Energy(*[float("nan")] * len(NAMES))
        now, start, flows = total
        given = sum(-flow if name.startswith("loss") else flow for name, flow in zip(FLOWS, flows))
        closing = sum(now) - sum(start) - given
        scale = max(map(abs, flows)) or max(sum(now), sum(start))
        relative = closing / scale if scale else 0.0
        return Energy(*[from_integer(v) for v in (*now, *flows, closing)], relative)  # type: ignore[call-arg]

    def add_from_blocks(self, work: int) -> None:
        """Book work that blocks did on particles, this rank's share, as an integer of exact_sum.as_integer."""
        self.accounts["work_blocks"] += work

    # ---- checkpoints -----------------------------------------------------------------------------------------------

    def state(self, sim: Simulation) -> dict[str, Any]:
        """The budget as JSON values; whole integers, so nothing is rounded. Collective."""
        self._empty()
        accounts, left, start = (
            [hex(v) for v in _summed(sim, list(part.values()))]
            for part in (self.accounts, self.left, self.start or self.left)
        )
        return {
            "accounts": accounts,
            "start": None if self.start is None else start,
            "left": left,
            "running": self.running,
            "finite": not sim.comm.any(not self.finite),
        }

    @staticmethod
    def restored(state: dict[str, Any], first: bool) -> Budget:
        """Restore the budget from `state`; first: this rank takes all of it, the others nothing."""
        budget = Budget()

        def share(names: tuple[str, ...], numbers: list[str]) -> dict[str, int]:
            return {name: int(v, 16) if first else 0 for name, v in zip(names, numbers, strict=True)}

        accounts = list(state["accounts"])
        for row in range(energy.LAWS if len(accounts) < len(FLOWS) - 1 else energy.TURNED, energy.FLOWS):
            if len(accounts) < len(FLOWS):  # in files of earlier versions
                accounts.insert(row, "0x0")
        accounts += ["0x0"] * (len(FLOWS) - len(accounts))
        left, start = (
            [*(one or []), *["0x0"] * (len(STORED) - len(one or []))] for one in (state["left"], state["start"])
        )
        budget.accounts, budget.left = share(FLOWS, accounts), share(STORED, left)
        budget.start = None if state["start"] is None else share(STORED, start)
        budget.running, budget.finite = state["running"], state["finite"]
        return budget

    # ---- ours ------------------------------------------------------------------------------------------------------

    def _integer(self, bins: np.ndarray) -> int:
        value = as_integer(bins)
        self.finite &= value is not None
        return value or 0

    def _empty(self) -> None:
        for name, bins in zip(FLOWS, self._bins):
            self.accounts[name] += self._integer(bins)
        self._bins[:] = 0

    def _stored(self, sim: Simulation, whole_step: bool = True) -> dict[str, int]:
        return dict(zip(STORED, map(self._integer, _stored_bins(sim, whole_step))))


def stored_energy(sim: Simulation) -> float:
    """Kinetic and elastic energy at the whole step [J], exactly summed. Needs no account. Collective."""
    sim.prepare_kernels("energy")
    values = [as_integer(bins) for bins in _stored_bins(sim)]
    if sim.comm.any(None in values):
        return float("nan")
    return from_integer(sum(_summed(sim, [v or 0 for v in values])))


def _stored_bins(sim: Simulation, whole_step: bool = True) -> np.ndarray:
    """Energy stored in particles and contacts of this rank (5, 2, 2112) i8; motion at the whole step or half a step
    before."""
    lists, p, s, b = sim.lists, sim.particles, sim.settings, sim.lists.blocks
    bins = np.zeros((energy.STORED, *BINS_SHAPE), np.int64)
    spheres, n_mat = mass.SPHERES[s.disk], len(sim.materials)
    for t in range(lists.n_blocks):
        energy.kinetic(
            t, p.hot, p.n_left, b.cut, b.lo, b.foff, lists.force, sim.body, s.gx, s.gy, s.lsm, whole_step, bins
        )  # fmt: skip
        energy.pair_energy(
            t, p.hot, p.ihot, b.cut, b.lo, b.poff, lists.ptr, lists.partner, lists.fs, lists.bond, lists.u_made,
            sim.pair_laws, sim.bond_laws, n_mat, spheres, bins,
        )  # fmt: skip
    if sim.clumps:
        c = sim.clumps.bodies
        energy.kinetic(0, c.hot, 0, *c.mine_as_block(), c.force, c.body, s.gx, s.gy, s.lsm, whole_step, bins)
    if sim.own_laws.loops is not None:
        sim.own_laws.loops.stored(*_own_pairs(sim), bins)
    if sim.rolling is not None:
        sim.rolling.book_stored(sim, bins[energy.ROLLING], bins[energy.BONDED])
    _wall_energy(*_wall_slots(sim), sim.wall_laws, n_mat, bins)
    return bins


def _own_pairs(sim: Simulation) -> tuple[Any, ...]:
    """Pairs and user laws, for their sums of energy."""
    lists, p = sim.lists, sim.particles
    return (
        lists.n_blocks, p.hot, p.ihot, *lists.blocks, lists.ptr, lists.partner, lists.fs, sim.pair_laws,
        len(sim.materials), sim.own_table, lists.memory, sim.own_laws.initial, float(sim.stamp),
    )  # fmt: skip


def _kicks(sim: Simulation, whole: bool, bins: np.ndarray) -> None:
    lists, p, s, b, dt = sim.lists, sim.particles, sim.settings, sim.lists.blocks, sim.clock.dt
    for t in range(lists.n_blocks):
        energy.kicks(
            t, p.hot, p.n_left, b.cut, b.lo, b.foff, lists.force, sim.body, s.gx, s.gy, s.lsm, dt, whole, 1.0, bins
        )
    if sim.clumps:
        c = sim.clumps.bodies
        energy.kicks(0, c.hot, 0, *c.mine_as_block(), c.force, c.body, s.gx, s.gy, s.lsm, dt, whole, 1.0, bins)
    if sim.walls.v.any():
        _wall_work(*_wall_slots(sim), sim.wall_laws, len(sim.materials), dt if whole else 0.5 * dt, bins)


def _wall_slots(sim: Simulation) -> Any:
    """Particles, walls where they are now, and slots."""
    lists, p = sim.lists, sim.particles
    sim.walls.put_ends(sim._wall_table)
    return p.hot, p.ihot, sim._wall_table, lists.slot_row, lists.slot_wall, lists.slot_fs, lists.slot_side


def _copied(values: np.ndarray, into: np.ndarray) -> np.ndarray:
    if into.shape != values.shape or into is values:
        return values.copy()
    np.copyto(into, values)
    return into


def _summed(sim: Simulation, mine: list[int]) -> list[int]:
    return [sum(column) for column in zip(*sim.comm.allgather(mine))]

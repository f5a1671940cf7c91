"""Moments between discs: PROP rfric, rolling resistance, and PROP moment, that of bonds (kernels/rolling.py)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.fields import MATERIAL, RADIUS
from hpcdem.physics.dem.kernels import mass, rolling
from hpcdem.physics.dem.kernels.motion import INERTIA, KICK_SPIN, MASS

CONSTANT, SPRING = "a", "c"
"""Types of Ai et al. 2011, as SET rolling names them."""


def columns(sim: Any) -> int:
    """Columns that contacts remember; 0 without moments."""
    there = (sim.materials.rows["rfric"] > 0.0).any() or sim.bond_types.rows["moment"].any()
    return rolling.WIDTH if there else 0


def begin(sim: Any, given: Mapping[str, float]) -> None:
    """Open the model if it gets moments with these properties: contacts begin to remember. Collective."""
    if given.get("rfric") and not columns(sim):
        sim.open_model()


class Rolling:
    """Rolling resistance of a closed model (physics.dem.simulation.Simulation), valid until its tables change."""

    def __init__(self, sim: Any) -> None:
        """Collective. CommandError for a model with contacts that would not follow."""
        _refuse(sim)
        p, lists, rows, s = sim.particles, sim.lists, sim.materials.rows, sim.settings
        b, n_mat, spheres = lists.blocks, len(rows), mass.SPHERES[s.disk]
        of = np.stack([rows["rfric"], rows["rdamp"]], axis=1)
        of_pairs = np.minimum(of[:, None], of[None]).reshape(-1, 2)
        inverse = np.zeros(len(p.hot))
        body, radius = sim.body, p.hot[p.owned, RADIUS]
        turns = body[:, KICK_SPIN] != 0.0
        at_touch = body[:, INERTIA] + body[:, MASS] * radius * radius
        inverse[p.owned] = np.divide(1.0, at_touch, out=np.zeros(len(body)), where=turns)
        sim.halo.fill(inverse)
        self.lost, self.lost_at_walls = np.zeros(len(lists.row)), np.zeros(len(lists.slot_row))
        self.lost_of_bonds = np.zeros(len(lists.row))
        self._bends = sim.bond_types.rows["moment"] != 0.0
        self._args = (
            lists.n_blocks, p.hot, p.ihot, b.cut, b.lo, b.poff, b.foff, lists.ptr, lists.partner, lists.bond,
            lists.u_made, lists.fs, lists.memory, sim.pair_laws, sim.bond_laws, self._bends, of_pairs,
            lists.wptr, sim._wall_table, lists.slot_row, lists.slot_wall, lists.slot_side, lists.slot_memory,
            sim.wall_laws, of, n_mat, inverse, sim.clock.dt, s.rolling == CONSTANT, spheres, float(sim.stamp),
            lists.force, self.lost, self.lost_at_walls, self.lost_of_bonds, lists.tally,
        )  # fmt: skip
        self._of, self._of_pairs, self._inverse = of, of_pairs, inverse

    def push(self) -> None:
        """Add the torques at the present places and spins."""
        rolling.torques(*self._args)

    def book_lost(self, sim: Any, bins: np.ndarray, of_bonds: np.ndarray) -> None:
        """Add what was lost in the last step to exact bins: by rolling, and by bonds that broke."""
        self._book(sim, self.lost, self.lost_at_walls, bins)
        self._book(sim, self.lost_of_bonds, np.empty(0), of_bonds)

    def book_stored(self, sim: Any, bins: np.ndarray, of_bonds: np.ndarray) -> None:
        """Add what the springs store to exact bins: those of rolling, and those of bonds."""
        memory, stored = sim.lists.memory, sim.lists.memory[:, rolling.STORED]
        bent = memory[:, rolling.STAMP] > float(sim.stamp)
        self._book(sim, np.where(bent, 0.0, stored), sim.lists.slot_memory[:, rolling.STORED].copy(), bins)
        self._book(sim, np.where(bent, stored, 0.0), np.empty(0), of_bonds)

    def _book(self, sim: Any, of_slots: np.ndarray, of_walls: np.ndarray, bins: np.ndarray) -> None:
        lists, b = sim.lists, sim.lists.blocks
        rolling.book(lists.n_blocks, b.cut, b.lo, b.poff, lists.ptr, of_slots, of_walls, bins)

    def stiffnesses(self, sim: Any) -> tuple[np.ndarray, np.ndarray]:
        """kr, or that of bonds, of the pair slots and of the wall slots [N m/rad]; 0 without, and of type A."""
        lists, p, b = sim.lists, sim.particles, sim.lists.blocks
        pairs, walls = np.zeros(len(lists.row)), np.zeros(len(lists.slot_row))
        n_mat, spheres = len(sim.materials), mass.SPHERES[sim.settings.disk]
        for t in range(lists.n_blocks):
            rolling.stiffnesses(
                t, p.hot, p.ihot, b.cut, b.lo, b.poff, lists.ptr, lists.partner, lists.bond, sim.pair_laws,
                sim.bond_laws, self._bends, self._of_pairs, n_mat, spheres, sim.settings.rolling == CONSTANT, pairs,
            )  # fmt: skip
        if sim.settings.rolling == CONSTANT:
            return pairs, walls
        rolling.stiffnesses_at_walls(
            p.hot, p.ihot, sim._wall_table, lists.slot_row, lists.slot_wall, lists.slot_side, sim.wall_laws, self._of,
            n_mat, spheres, walls,
        )  # fmt: skip
        return pairs, walls

    def rates(self, sim: Any) -> np.ndarray:
        """Sum of kr / I of the contacts of the owned particles (n_own,) [1/s2]."""
        return self._over_inertia(sim, *self.stiffnesses(sim))

    def most(self) -> float:
        """Bound of kr/I over kn/m of any contact, at least 1: of linear springs with a wall 6 mu_r^2, of bonds 8/3."""
        return max(1.0, 6.0 * float(self._of[:, rolling.FRICTION].max()) ** 2, 8.0 / 3.0 if self._bends.any() else 1.0)

    @property
    def damped(self) -> bool:
        """Return whether there are dashpots."""
        return bool((self._of[:, rolling.DAMPING] > 0.0).any())

    def fastest(self, sim: Any) -> float:
        """Largest sum of C/I of the dashpots of a disc as they are [1/s]. Collective."""
        if not self.damped:
            return 0.0
        p, lists, n_mat = sim.particles, sim.lists, len(sim.materials)
        pairs, walls = self.stiffnesses(sim)

        def dashpots(kr: np.ndarray, damping: np.ndarray, inverse: np.ndarray) -> np.ndarray:
            return 2.0 * damping * np.sqrt(np.divide(kr, inverse, out=np.zeros(len(kr)), where=inverse > 0.0))

        material, of = p.ihot[:, MATERIAL], rolling.DAMPING
        for k, row, partner, _, _ in self._pieces(sim):
            damping = np.where(lists.bond[k] == 0, self._of_pairs[material[row] * n_mat + material[partner], of], 0.0)
            pairs[k] = dashpots(pairs[k], damping, self._inverse[row] + self._inverse[partner])
        walls = dashpots(walls, self._of[material[lists.slot_row], of], self._inverse[lists.slot_row])
        return float(sim.comm.max_into(np.array([self._over_inertia(sim, pairs, walls).max(initial=0.0)]))[0])

    def _pieces(self, sim: Any) -> Iterator[tuple[slice, np.ndarray, np.ndarray, int, int]]:
        """Yield of each block its slots, their rows and partners, first and last owned row."""
        lists = sim.lists
        for t, (row, partner, first, last) in enumerate(lists.pieces()):
            begin = lists.ptr[lists.blocks.poff[t]]
            yield slice(begin, begin + len(row)), row, partner, first, last

    def _over_inertia(self, sim: Any, pairs: np.ndarray, walls: np.ndarray) -> np.ndarray:
        """Sum over the contacts of the owned particles (n_own,), by numbers of the slots, over I."""
        lists, n_left = sim.lists, sim.particles.n_left
        total = np.zeros(len(sim.body))
        np.add.at(total, lists.slot_row - n_left, walls)
        for k, row, partner, first, last in self._pieces(sim):
            for of in (row, partner):
                mine = (of >= first) & (of < last)
                np.add.at(total, of[mine] - n_left, pairs[k][mine])
        return np.divide(total, sim.body[:, INERTIA], out=np.zeros(len(total)), where=sim.body[:, KICK_SPIN] != 0.0)


def _refuse(sim: Any) -> None:
    others = {
        "clumps, whose shape resists rolling": bool(sim.clumps),
        "a user law, whose normal stiffness is not known": bool(sim.own_laws),
        "contacts with blocks, which have their own law": sim.coupled,
    }
    name = "PROP moment (bonds)" if sim.bond_types.rows["moment"].any() else "PROP rfric (rolling resistance)"
    for what, there in others.items():
        if there:
            raise CommandError(f"{name} does not support {what}; use a model without it, or without moments")

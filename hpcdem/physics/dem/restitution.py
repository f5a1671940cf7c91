"""SET restitution: dashpots in the contacts of discs with each other and with walls (kernels/dashpots.py)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.dem.kernels import dashpots
from hpcdem.physics.dem.kernels.motion import KICK_X


class Dashpots:
    """Dashpots of the contacts of a closed model (physics.dem.simulation.Simulation), valid until its tables change."""

    def __init__(self, sim: Any) -> None:
        """Collective. CommandError for a model with contacts that would not follow."""
        _refuse(sim)
        log_e = math.log(sim.settings.restitution)
        self.beta = -log_e / math.hypot(math.pi, log_e)
        mobility = np.zeros((len(sim.particles.hot), 2))
        if sim.clock.dt > 0.0:
            mobility[sim.particles.owned] = sim.body[:, KICK_X : KICK_X + 2] / sim.clock.dt
        sim.halo.fill(mobility)
        self.mobility = mobility
        self._on_walls = np.zeros((len(sim.lists.slot_row), 2))
        self._rates = np.zeros(len(mobility))

    def push(self, sim: Any) -> None:
        """Add the forces at the present places and velocities."""
        self._into(sim, sim.lists.force)

    def fastest(self, sim: Any) -> float:
        """Largest sum of c/m of a particle's contacts as they are [1/s]: none of their motions against each other dies
        away faster than at twice this rate. Collective."""
        self._rates[:] = 0.0
        self._into(sim, sim.lists.force.copy())
        return float(sim.comm.max_into(np.array([self._rates.max(initial=0.0)]))[0])

    def on_walls(self, sim: Any) -> np.ndarray:
        """Forces on the particles of the wall slots as they are (slots, 2) [N]."""
        self._into(sim, sim.lists.force.copy())
        return self._on_walls

    def _into(self, sim: Any, force: np.ndarray) -> None:
        p, lists = sim.particles, sim.lists
        b = lists.blocks
        dashpots.forces(
            lists.n_blocks, p.hot, p.ihot, b.cut, b.lo, b.poff, b.foff, lists.ptr, lists.partner, lists.bond,
            sim.pair_laws, lists.wptr, sim.walls.table(), lists.slot_row, lists.slot_wall, lists.slot_side,
            sim.wall_laws, len(sim.materials), self.mobility, self.beta, force, self._rates, self._on_walls,
        )  # fmt: skip


def _refuse(sim: Any) -> None:
    others = {
        "clumps, whose discs have no mass of their own": bool(sim.clumps),
        "a user law, whose stiffness is not known": bool(sim.own_laws),
        "contacts with blocks, which have their own law": sim.coupled,
        "SET energy, whose budget does not include dashpots": sim.settings.energy > 0 or sim.energy is not None,
    }
    for what, there in others.items():
        if there:
            raise CommandError(f"SET restitution does not support {what}; SET restitution 1 removes the dashpots")

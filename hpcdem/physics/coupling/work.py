"""The energy that goes across the contacts of discs and faces: work done on both sides, and what contacts store."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from hpcdem.core.account import closed
from hpcdem.numerics.exact_sum import BINS_SHAPE, as_integer, from_integer
from hpcdem.physics.coupling.kernels import disc_faces
from hpcdem.physics.dem.budget import EMPTIED
from hpcdem.physics.fdem import diagnostics as of_blocks

ON_DISCS, ON_FACES = 0, 1
"""The two sides of the work done across the contacts."""


class Work:
    """Work between discs and blocks of a coupled model. start: energy stored by contacts before the first step [J],
    None before. Integers are those of exact_sum.as_integer, and this rank's share."""

    def __init__(self, both: Any) -> None:
        self.both = both
        self.start: float | None = None
        self._bins = np.zeros((2, *BINS_SHAPE), np.int64)
        self._done = [0, 0]
        self._booked = 0

    def begin(self) -> None:
        """Note what is stored, if that was not done before. Collective."""
        if self.start is None:
            self.start = self._stored()

    def _stored(self) -> float:
        """Elastic energy of the contacts between the two [J]."""
        return math.fsum(self.both.contacts()["energy"])

    def step_done(self) -> None:
        """Record that a step was booked: bins are emptied long before they are full."""
        self._booked += 1
        if self._booked >= EMPTIED:
            self.empty()

    def book_discs(self, kick: bool) -> None:
        """Book half a step's work of the present forces on the discs; kick: with the velocities of the coming half
        step."""
        particles, link, s = self.both.particles, self.both.links(), self.both.particles.settings
        p = particles.particles
        forces = particles.lists.owned_forces() if kick else np.empty((0, 3))
        with particles.timers("energy"):
            disc_faces.work_on_discs(
                kick, link.disc_row, link.disc_force, p.hot, p.n_left, particles.body, forces, s.gx, s.gy, s.lsm,
                particles.clock.dt, self._bins[ON_DISCS],
            )  # fmt: skip

    def book_faces(self) -> None:
        """Book half a step's work of the present forces on the blocks, whose velocities are those after the kick once
        they stepped."""
        blocks, link = self.both.blocks, self.both.links()
        e = link.face_number // 4
        if link.made_for[1] == blocks.rebuilds and blocks.closed:
            rows = link.face_row
        else:  # storage was left at the end of the step
            order = np.argsort(blocks.number)
            rows = order[np.searchsorted(blocks.number, e, sorter=order)] if len(e) else e
        with blocks.timers("energy"):
            disc_faces.work_on_faces(
                link.face_force, rows, link.face_k, link.face_k2, blocks.v, blocks.clock.dt, self._bins[ON_FACES]
            )

    def empty(self) -> None:
        """Move what was booked since the last call to the accounts."""
        if not self._booked:
            return
        self._booked = 0
        for side in (ON_DISCS, ON_FACES):
            value = as_integer(self._bins[side]) or 0
            self._done[side] += value
            if side == ON_DISCS and self.both.particles.energy is not None:
                self.both.particles.energy.add_from_blocks(value)
            if side == ON_FACES and self.both.blocks.budget is not None and self.both.blocks.budget.start is not None:
                self.both.blocks.budget.add_from_discs(value)
        self._bins[:] = 0

    def energies(self) -> dict[str, float]:
        """Energy that went across the contacts since the account began [J]: work_on_particles, work_on_blocks; stored:
        elastic energy of the contacts now, stored_before: at the beginning; lost: by their friction, and by errors of
        the time step. With accounts of both models also closing: what does not add up in all, and relative: that over
        the largest flow."""
        discs, faces = map(from_integer, self._sums())
        stored = self._stored()
        before = self.start or 0.0
        found = {"work_on_particles": discs, "work_on_blocks": faces, "stored": stored, "stored_before": before}
        found["lost"] = -(discs + faces) - (stored - before)
        if self.both.particles.energy is not None and self.both.blocks.budget is not None:
            one, other = self.both.particles.energy.evaluate(self.both.particles), of_blocks.energies(self.both.blocks)
            flows = [abs(v) for name, v in vars(one).items() if name not in ("closing", "relative")]
            flows += [abs(v) for name, v in other.items() if name not in ("closing", "relative")]
            return closed(found, one.closing + other["closing"], flows)
        return found

    def _sums(self) -> list[int]:
        """Work on both sides, of all ranks. Collective."""
        parts = self.both.comm.allgather(tuple(self._done))
        return [sum(part[side] for part in parts) for side in (ON_DISCS, ON_FACES)]

    def state(self) -> dict[str, Any]:
        """The work as JSON values. Collective."""
        return {"done": [hex(v) for v in self._sums()], "start": self.start}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore from `state`; rank 0 receives the work of all."""
        self._done = [int(v, 16) if self.both.comm.rank == 0 else 0 for v in state["done"]]
        self.start = state["start"]
        self._bins[:] = 0

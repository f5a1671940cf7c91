"""Joints that broke: from the tables of the kernels to what all ranks know."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.physics.fdem.kernels.joint_law import MODE
from hpcdem.physics.fdem.kernels.joints import BROKEN
from hpcdem.physics.fdem.state import Crack
from hpcdem.physics.fdem.topology import AGAIN

MANY = 2000
"""Reciprocal of a share of opened faces: from one face in this many on, about half of the memory pages with states of
faces are private to a rank."""


def waiting(sim: Any) -> list[Crack]:
    """Joints that broke since the last rebuild, in order of steps, see `Crack`. Collective."""
    local, clock, rebuild_state = sim.local, sim.clock, sim.rebuild_state
    slots = np.flatnonzero(local.slot_state == BROKEN)
    face = local.slot_face[slots]
    slots = slots[sim.broken[np.minimum(face, sim.partner[face])] <= 1]
    mine = np.column_stack([local.slot_face[slots].astype(float), local.slot_history[slots, MODE:]])
    rows = np.concatenate(sim.comm.allgather(mine)) if sim.comm.size > 1 else mine
    if not len(rows):
        return []
    faces = rows[:, 0].astype(np.int64)
    lower = np.minimum(faces, sim.partner[faces])
    order = np.lexsort((faces, lower))  # both sides report, the lower face first
    rows, lower = rows[order], lower[order]
    assert (lower[0::2] == lower[1::2]).all(), "a joint broke on one side only"
    first, joints = rows[0::2], lower[0::2]
    both = rows[0::2] + rows[1::2]
    dt = clock.dt if sim.options.dynamic else 0.0
    began = rebuild_state.time if dt else sim.reported_time() + sim.creep.passed
    return [
        Crack(
            int(joints[k]), float(first[k, 1]), int(first[k, 2]), float(both[k, 3]),
            began + (int(first[k, 2]) - rebuild_state.step) * dt, int(first[k, 4]), float(both[k, 5]),
        )
        for k in np.lexsort((joints, first[:, 2])).tolist()
    ]  # fmt: skip


def collect(sim: Any) -> None:
    """Joints that broke since the last rebuild become free faces, on all ranks. Collective."""
    rows, again = waiting(sim), np.flatnonzero(sim.broken > 1)
    if rows or len(again):
        sim.event_rows += rows
        joints = np.array([row[0] for row in rows], np.int64)
        sim.broken[joints] = 1
        sim.broken[again] = sim.broken[again] == AGAIN
        sim.open_faces(np.append(joints, again))
        sim.opened_apart += len(rows) + len(again)
        if sim.opened_apart > len(sim.open) // MANY:
            sim.share_changes()
        sim.surface_loads.joints_opened()

"""Joints that slide: how far the two sides have gone from each other, which stay partners whatever they do.

The law acts on the whole joint, wherever its sides are. That is right as long as slip and opening are small beside it:
the log says where they are not, and where nothing of a side faces the other any more the run ends.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hpcdem.physics.fdem.kernels.joints import BROKEN

if TYPE_CHECKING:
    from hpcdem.physics.fdem.local import Local
    from hpcdem.physics.fdem.state import State

FAR, GONE = 0.1, 1.0
"""Slips or openings, relative to the size of a joint: from the first one on the log reports them, at the second one the
run ends."""


def part(sim: State, local: Local) -> float:
    """The largest slip or opening of this rank's joints that slide, over their size. Not collective."""
    return float(_rows(sim, local)[:, 0].max(initial=0.0))


def check(sim: State, local: Local, error: type[Exception]) -> None:
    """Say which joint that slides has gone farthest, if that is too far; `error` if it is gone. The model is closed.
    Collective."""
    rows = _rows(sim, local)
    mine = rows[np.lexsort((rows[:, 1], -rows[:, 0]))[:1]]
    found = sorted((-row[0], row[1], row[2]) for each in sim.comm.allgather(mine) for row in each)
    share, face, displacement = (-found[0][0], int(found[0][1]), found[0][2]) if found else (0.0, 0, 0.0)
    if share <= FAR:
        return
    mesh = sim.the_mesh()
    at = ", ".join(f"{c:g}" for c in mesh.points[mesh.face_points(np.array([face]))][0].mean(axis=0))
    name = sim.joint_rows.name(sim.joint_row[face]).replace("_", "-")
    text = (
        f"face-joint {face} ({name}) at ({at}) has slipped or opened by {displacement:.3g} m, {share:.2g} of its size. "
        "Its sides still interact over the whole joint"
    )
    advice = (
        "use longer edges along the joint, or classic-intrinsic-cohesive-interface, whose broken faces are contacts"
    )
    if share > GONE:
        raise error(f"{text}; the run stops, because this is more than its size. For larger slip {advice}")
    if sim.log is not None:
        sim.log.warn_once("joints slide far", f"{text}. For larger slip {advice}")


def _rows(sim: State, local: Local) -> np.ndarray:
    """Rows of sliding joints of this rank (n, 3): slip or opening over the size of the joint, lower face, slip or
    opening [m]."""
    slots = np.flatnonzero(local.slot_state[: local.slots] > BROKEN)
    if not len(slots):
        return np.empty((0, 3))
    face = local.slot_face[slots]
    displacement = np.hypot(*local.joint_means(slots)[:, :2].T)
    size = sim.the_mesh().joint_lengths(face, sim.partner)
    return np.column_stack([displacement / size, np.minimum(face, sim.partner[face]), displacement])

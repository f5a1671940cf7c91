"""Broken joints whose faces lie opposite each other, while blocks and fluid go by implicit steps: they are joints
without strength for that time, which transmit compression by their penalty and friction, and free faces again
afterwards.

What they remember of their slip (SLIPPED, the line that friction unloads along) is kept in between by face, so that
one command after another ends where both would have ended at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hpcdem.physics.fdem.histories import FIRST, KEY, STATE, WORDS, Histories
from hpcdem.physics.fdem.kernels.joint_law import DAMAGE, MODE, SLIPPED
from hpcdem.physics.fdem.kernels.joints import BROKEN
from hpcdem.physics.fdem.topology import AGAIN, CRACK

if TYPE_CHECKING:
    from hpcdem.physics.fdem.equilibrium import Nodes
    from hpcdem.physics.fdem.simulation import Blocks

APART = 0.1
"""Opening and slip over the length of a joint up to which its faces count as opposite each other."""


def opposite(sim: Blocks, x: np.ndarray) -> np.ndarray:
    """Lower faces of joints that are open and lie opposite each other at these positions of the nodes (nn, dim); none
    where surfaces may overlap."""
    lower = np.flatnonzero(sim.open & sim.joint_exists() & (sim.joint_row > 0))
    if not sim.options.collision or not len(lower):
        return lower[:0]
    mesh, node = sim.the_mesh(), sim.node.reshape(-1)
    one, other = (mesh.face_corners(faces) for faces in (lower, sim.partner[lower]))
    point = mesh.cells.reshape(-1)
    order = (point[one][:, :, None] == point[other][:, None, :]).argmax(axis=2)
    a, p = x[node[one]], x[node[np.take_along_axis(other, order, axis=1)]]
    side = np.roll(a + p, -1, axis=1) - (a + p)
    length = 0.5 * np.sqrt((side * side).sum(axis=2)).max(axis=1)
    return lower[np.abs(p - a).max(axis=(1, 2)) <= APART * length]


def join(sim: Blocks, nodes: Nodes) -> np.ndarray:
    """Let such joints press and slide with friction, see `opposite`; the model is closed, before and after. Returns
    their lower faces. Collective."""
    lower = opposite(sim, nodes.x)
    if not len(lower):
        return lower
    sim.before_change()
    faces = np.concatenate([lower, sim.partner[lower]])
    sim.open[faces] = False
    sim.broken[lower] = np.where(sim.broken[lower] > 0, AGAIN, CRACK)
    row_of = np.full(len(sim.alive), -1, np.int64)
    row_of[sim.number] = np.arange(len(sim.number))
    mine = faces[row_of[faces // 4] >= 0]
    rows = np.zeros((len(mine), WORDS))
    rows.view(np.int64)[:, KEY] = -1 - mine % 4
    rows[:, STATE] = BROKEN
    rows[:, FIRST + DAMAGE : FIRST + DAMAGE + 3] = rows[:, [FIRST + MODE]] = 1.0
    rows[:, FIRST + SLIPPED : FIRST + SLIPPED + 3] = np.reshape(
        [sim.slid.get(face, (0.0, 0.0, 0.0)) for face in mine.tolist()], (-1, 3)
    )
    known = sim.histories
    sim.histories = Histories.of(
        len(sim.number), np.concatenate([known.owners(), row_of[mine // 4]]), np.concatenate([known.rows, rows])
    )
    sim.changed(topology=True)
    sim.close_model()
    return lower


def part(sim: Blocks) -> None:
    """Store the histories of broken joints of a closed model and make their faces free. Collective."""
    local = sim.local
    slots = np.flatnonzero(local.slot_state == BROKEN)
    if sim.comm.any(len(slots) > 0):
        mine = local.slot_face[slots], local.slot_history[slots, SLIPPED : SLIPPED + 3]
        for faces, slid in sim.comm.allgather(mine):
            sim.slid.update(zip(faces.tolist(), map(tuple, slid.tolist())))
        sim._renew_lists()


def beside(sim: Blocks, lower: np.ndarray) -> np.ndarray:
    """(ne,) bool: elements with a corner on these joints."""
    mesh = sim.the_mesh()
    on = np.zeros(len(mesh.points), bool)
    on[mesh.face_points(lower)] = True
    return (on[mesh.cells] & (mesh.cells >= 0)).any(axis=1)

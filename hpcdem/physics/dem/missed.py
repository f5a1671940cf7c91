"""Whether a contact began unseen: asked where somebody has gone farther than the lists allow, before they are rebuilt.

Lists hold all pairs that can meet while nobody goes farther than half the skin (a fast particle: its reach). Where one
has gone farther, most often nothing has happened: a pair is missed only if both went towards each other. If one was,
the run stops, as forces are missing in it. What is asked depends on places alone: the answer is the same on any
ranks.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.core.errors import PhysicsError
from hpcdem.core.fields import GID, RADIUS, X, Y
from hpcdem.physics.dem.guards import NAMED
from hpcdem.physics.dem.kernels.walls import closest


def stop_on_missed(sim: Any) -> None:
    """PhysicsError, on all ranks, if particles touch each other or a wall and are not in the lists. Collective."""
    p, lists = sim.particles, sim.lists
    hot, gid = p.hot[p.owned], p["gid"]
    way = np.hypot(hot[:, X] - sim.origin[:, 0], hot[:, Y] - sim.origin[:, 1])
    reach = np.full(len(p), 0.5 * sim.rebuild_state.skin)
    rows, at = sim.fast.among(gid)
    reach[rows] = sim.fast.reach[at]
    far = np.flatnonzero(way + sim.walls.longest_travel() > reach)
    parts = sim.comm.allgather((gid[far].copy(), p.clump[far].copy(), hot[far][:, [X, Y, RADIUS]]))
    theirs, clumps, places = (np.concatenate([part[k] for part in parts]) for k in range(3))
    known = _Listed(sim)
    found: list[tuple[int, str]] = []
    for other, clump, (x, y, r) in zip(theirs.tolist(), clumps.tolist(), places.tolist()):
        near = np.hypot(hot[:, X] - x, hot[:, Y] - y) < hot[:, RADIUS] + r
        near &= (gid != other) & ((clump < 0) | (p.clump != clump))
        found += [
            (min(g, other), f"particles {min(g, other)} and {max(g, other)}")
            for g in gid[near].tolist()
            if not known.pair(g, other)
        ]
    slots = set(zip(lists.slot_row.tolist(), lists.slot_wall.tolist()))
    for w, wall in enumerate(sim.walls.table()):
        for c in far.tolist():
            _, _, qx, qy = closest(wall, hot[c, X], hot[c, Y])
            if np.hypot(qx - hot[c, X], qy - hot[c, Y]) < hot[c, RADIUS] and (c + p.n_left, w) not in slots:
                found.append((int(gid[c]), f"particle {gid[c]} and wall {sim.walls.id[w]}"))
    every = sorted({one for part in sim.comm.allgather(sorted(found)[:NAMED]) for one in part})[:NAMED]
    if every:
        names = "; ".join(name for _, name in every)
        raise PhysicsError(
            f"step {sim.clock.step + 1}: contacts began unseen, as somebody went farther than half the skin of the "
            f"contact search, {0.5 * sim.rebuild_state.skin:g} m, within {sim.rebuild_state.age} steps: {names}. The "
            f"time step {sim.clock.dt:g} s is too large for such motion"
        )


class _Listed:
    """The pairs in the lists of this rank, by ids."""

    def __init__(self, sim: Any) -> None:
        lists, gids = sim.lists, sim.particles.ihot[:, GID]
        self._pieces = [(gids[row], gids[partner]) for row, partner, _, _ in lists.pieces()]

    def pair(self, one: int, other: int) -> bool:
        """Whether it is there."""
        return any(bool((((a == one) & (b == other)) | ((a == other) & (b == one))).any()) for a, b in self._pieces)

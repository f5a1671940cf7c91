"""Check for missed contacts before a rebuild, if a particle went farther than the lists allow.

Lists hold all pairs that can meet while nobody goes farther than half the skin (a fast particle: its reach). Where one
has gone farther, most often nothing has happened: a pair is missed only if both went towards each other. If one was,
the run stops, as forces are missing in it. What is queried depends on places alone: the answer is the same on any
ranks.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.core.errors import PhysicsError
from hpcdem.core.fields import GID, RADIUS, X, Y
from hpcdem.physics.dem import periodic
from hpcdem.physics.dem.guards import NAMED
from hpcdem.physics.dem.kernels.walls import closest


def stop_on_missed(sim: Any) -> None:
    """PhysicsError, on all ranks, if particles touch each other or a wall and are not in the lists. Collective."""
    p, lists = sim.particles, sim.lists
    hot, gid = p.hot[p.owned], p["gid"]
    travelled = np.hypot(hot[:, X] - sim.origin[:, 0], hot[:, Y] - sim.origin[:, 1])
    reach = np.full(len(p), 0.5 * sim.rebuild_state.skin)
    rows, at = sim.fast.among(gid)
    reach[rows] = sim.fast.reach[at]
    far = np.flatnonzero(travelled + periodic.travel(sim)[0] + sim.walls.longest_travel() > reach)
    parts = sim.comm.allgather((gid[far].copy(), p.clump[far].copy(), hot[far][:, [X, Y, RADIUS]]))
    theirs, clumps, places = (np.concatenate([part[k] for part in parts]) for k in range(3))
    if period := sim.settings.period:  # those past the sides as well
        theirs, clumps = np.tile(theirs, 3), np.tile(clumps, 3)
        places = np.concatenate([places + [shift, 0.0, 0.0] for shift in (0.0, period, -period)])
    one, other = _touching(hot[:, [X, Y, RADIUS]], places)
    real = (gid[one] != theirs[other]) & ((clumps[other] < 0) | (p.clump[one] != clumps[other]))
    pairs = _pairs(gid[one[real]], theirs[other[real]])
    found = [(a, f"particles {a} and {b}") for a, b in sorted(set(map(tuple, pairs.tolist())) - _listed(sim, theirs))]
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
            f"step {sim.clock.step + 1}: contacts were missed, as a particle or wall travelled farther than half the "
            f"skin of the contact search, {0.5 * sim.rebuild_state.skin:g} m, within {sim.rebuild_state.age} steps: "
            f"{names}. The time step {sim.clock.dt:g} s is too large for such motion"
        )


def _touching(discs: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of discs (n, 3) and of others (m, 3), x, y and radius [m], that overlap."""
    if not len(discs) or not len(others):
        return np.empty(0, np.int64), np.empty(0, np.int64)
    from scipy.spatial import cKDTree  # seldom needed, and slow to import

    near = cKDTree(discs[:, :2]).query_ball_point(others[:, :2], others[:, 2] + discs[:, 2].max())
    other = np.repeat(np.arange(len(others)), [len(rows) for rows in near])
    one = np.concatenate([np.array(rows, np.int64) for rows in near])
    apart = np.hypot(discs[one, 0] - others[other, 0], discs[one, 1] - others[other, 1])
    touch = apart < discs[one, 2] + others[other, 2]
    return one[touch], other[touch]


def _pairs(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(n, 2) ids, the lower one first."""
    return np.sort(np.column_stack([one, other]), axis=1)


def _listed(sim: Any, gids: np.ndarray) -> set[tuple[int, ...]]:
    """Pairs in the lists of this rank of which one has one of these ids."""
    of = sim.particles.ihot[:, GID]
    found = [_pairs(of[row], of[partner]) for row, partner, _, _ in sim.lists.pieces()]
    return {pair for part in found for pair in map(tuple, part[np.isin(part, gids).any(axis=1)].tolist())}

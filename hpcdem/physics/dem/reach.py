"""Reach of the next lists of particles: skin, side of cells, and particles fast enough for their own reach.

It depends on global values and the clock only, so lists are equal on any number of ranks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcdem.core.fields import RADIUS, X, Y
from hpcdem.engine.rebuild import LONGEST_WAIT, RebuildState
from hpcdem.physics.dem import guards, periodic
from hpcdem.physics.dem.kernels import fast, neighbours
from hpcdem.physics.dem.kernels.fast import Fast

NARROW, WIDE = 0.3, 0.6
"""Width of the skin over the largest radius, at rest and in fast motion."""
SHORT_LIVED, LONG_LIVED = 60, 200
"""Ages of neighbour lists, in steps: lists that lasted a shorter time call for the wide skin, lists that lasted longer
for the narrow one."""
EVERYWHERE = (-math.inf, math.inf, -math.inf, math.inf)
Box = tuple[float, float, float, float]


@dataclass
class ListState(RebuildState):
    """Skin over the largest radius; longest bond [m] as last seen; columns that partners may lie apart; period [m] of
    a periodic model when the lists were built."""

    skin_factor: float = NARROW
    bond_reach: float = 0.0
    columns: int = 1
    period: float = 0.0


def choose(sim: Any, frozen: bool, box: Box | None) -> bool:
    """Skin and cell side for the next lists, from global values only.

    Returns whether a particle is outside the box (left, right, bottom, top) [m]: it rides on the same reduction.
    """
    periodic.bring_in(sim, frozen)
    rebuild_state, p = sim.rebuild_state, sim.particles
    seen = np.array([0.0, sim._longest2, 0.0])
    seen[0], seen[2] = neighbours.gauge(p.hot, p.n_left, p.n_own, box if box is not None else EVERYWHERE)
    if sim.clumps and box is not None:
        x, y = sim.clumps.centres(p)
        seen[2] = guards.outside(x, y, box).any()
    sim.comm.max_into(seen)
    sim.largest_radius, outside = float(seen[0]), bool(seen[2])
    if frozen:
        return outside
    rebuild_state.bond_reach = math.sqrt(seen[1])
    limit = 0.5 * NARROW * sim.largest_radius / fast.LIFE
    first_class = _first_fast_class(sim, limit)
    if first_class is not None:
        rebuild_state.skin_factor = NARROW if fast.LIFE / 2**first_class >= SHORT_LIVED else WIDE
    else:
        rebuild_state.adapt_skin(NARROW, WIDE, SHORT_LIVED, LONG_LIVED)
    rebuild_state.skin = max(rebuild_state.skin_factor * sim.largest_radius, sim.least_skin)
    side = 2.0 * sim.largest_radius + rebuild_state.skin
    while 0.0 < side < max(rebuild_state.bond_reach + rebuild_state.skin, 1.000001 * sim.clumps.reach):
        side *= 1.05  # in steps, so that the rebuild_state seldom changes
    rebuild_state.side = side if side > 0.0 else 1.0
    if sim.settings.period:
        periodic.fit(sim)
    _choose_fast(sim, first_class, limit)
    return outside


def _first_fast_class(sim: Any, limit: float) -> int | None:
    """The class of speed (fast.classes) from which on particles get a reach of their own; None: nobody does.
    limit [m]: way per step from which on one is faster than lists of usual skin can bear."""
    if sim._drift is None or sim.settings.period:  # the search for free paths does not see images
        return None
    p, dt = sim.particles, sim.clock.dt
    before, _ = sim.fast.among(p["gid"])  # who was fast remains so till it is slow in both respects
    sim._drift[before] = np.maximum(sim._drift[before], fast.strides(p.hot[before], dt))
    _, classes = fast.classes(sim._drift, limit)
    counts = np.append(np.bincount(classes, minlength=fast.CLASSES), len(p))
    sim.comm.sum_into(counts)
    return fast.slowest_class(counts[:-1], int(counts[-1]), sim.walls.fastest() * dt, limit)


def _choose_fast(sim: Any, first_class: int | None, limit: float) -> None:
    """Reach of the fast particles, and how many columns it spans; arguments as in `_first_fast_class`."""
    rebuild_state, p, dt = sim.rebuild_state, sim.particles, sim.clock.dt
    before, drift = len(sim.fast), sim._drift
    sim.fast, rebuild_state.columns, sim._drift = Fast.none(), 1, None
    if drift is None or first_class is None:
        if before:
            sim.check_soon()
        return
    which, classes = fast.classes(drift, limit)
    which = which[classes >= first_class]
    hot = p.hot[which]
    path = np.maximum(drift[which], fast.strides(hot, dt))
    rows = np.column_stack([hot[:, X], hot[:, Y], hot[:, RADIUS], path])
    parts = sim.comm.allgather((p["gid"][which], p.clump[which], rows))
    gid, clump, rows = (np.concatenate([part[k] for part in parts]) for k in range(3))
    order = np.argsort(gid)
    gid, clump, rows = gid[order], clump[order], rows[order]
    half, gravity = 0.5 * rebuild_state.skin, math.hypot(sim.settings.gx, sim.settings.gy)
    most = fast.NEARLY * (0.5 * fast.MOST_COLUMNS * rebuild_state.side - sim.largest_radius)
    wanted = fast.wanted_reach(rows[:, 3], gravity, dt)
    asked = np.argsort(-rows[:, 3], kind="stable")[: fast.ASKED]
    # Nothing is known here of the faces of blocks: beside them nobody is alone.
    asked = asked[(wanted[asked] > most) & (not sim.coupled)]
    slow, gaps = np.ones(len(p), bool), np.empty(len(asked))
    slow[which] = False
    fast.nearest(p.hot, slow, rows[asked, :2], gaps)
    sim.comm.min_into(gaps)
    walls = np.hstack([sim.walls.p1, sim.walls.p2])
    free = fast.free_path(asked, gaps, rows[:, :3], clump, walls, half)
    reach = np.clip(wanted, half, max(half, most))
    alone = free >= reach
    widest = float(reach[~alone].max(initial=half))
    rebuild_state.columns = max(1, math.ceil(2.0 * (sim.largest_radius + widest) / rebuild_state.side))
    sim.fast = Fast(gid, np.where(alone, free, reach), alone)
    margin = np.append(sim.fast.reach, half)
    pace = np.append(rows[:, 3], limit * 2.0**first_class)
    fall = 2.0 * gravity * dt * dt
    wait = min(fast.wait(float(r), float(s), fall) for r, s in zip(margin, pace, strict=True))
    rebuild_state.pace = rebuild_state.countdown = max(1, min(rebuild_state.countdown, int(min(wait, LONGEST_WAIT))))


def measure_fast(sim: Any, fall: float, found: np.ndarray) -> None:
    """Write the result of fast.survey for the owned fast particles into found (4,)."""
    if not len(sim._fast_rows):
        return
    p, at = sim.particles, sim._fast_at
    fast.survey(
        p.hot, p.n_left, sim.origin, sim._fast_rows, sim.fast.reach[at], sim.fast.alone[at], sim.clock.dt,
        fall, (None if sim.clumps else sim.walls.box()) or EVERYWHERE, found,
    )  # fmt: skip

"""Stops a run when particles leave the BOX, move too far or are not finite, and names them."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.errors import PhysicsError
from hpcdem.core.fields import GID, RADIUS, X, Y
from hpcdem.physics.dem.kernels import motion, slips
from hpcdem.physics.dem.kernels.neighbours import NO_ROWS
from hpcdem.physics.dem.particles import Particles

LARGEST_STRIDE = 0.5
"""A particle that moves more than this fraction of its radius in one step stops the run."""
NAMED = 10
"""Largest number of particles named in a message."""


def outside(x: np.ndarray, y: np.ndarray, box: tuple[float, float, float, float]) -> np.ndarray:
    """Flags (n,) of the centres (x, y) [m] that have left the box (left, right, bottom, top) [m]."""
    left, right, bottom, top = box
    return ~((x >= left) & (x <= right) & (y >= bottom) & (y <= top))


def _first(particles: Particles, which: np.ndarray) -> np.ndarray:
    """Rows of the flagged particles of the lowest ids, at most NAMED: a message must not depend on the ranks."""
    at = np.flatnonzero(which)
    return at[np.argsort(particles["gid"][at])][:NAMED]


def places(particles: Particles, which: np.ndarray, comm: Comm) -> str:
    """Flagged particles by id, place and velocity, over all ranks: the lowest ids, at most NAMED. Collective."""
    at = _first(particles, which)
    columns = [particles[name][at].tolist() for name in ("gid", "x", "y", "vx", "vy")]
    rows = sorted(row for part in comm.allgather(list(zip(*columns))) for row in part)[:NAMED]
    return "; ".join(f"{g} at ({x:g}, {y:g}), velocity ({vx:g}, {vy:g})" for g, x, y, vx, vy in rows)


def stop_on_runaway(
    particles: Particles, origin: np.ndarray, dt: float, step: int, broken: bool, mixed_laws: bool, comm: Comm,
    alone: np.ndarray,
) -> None:  # fmt: skip
    """Name the particles that cannot be right, and stop on all ranks: raises PhysicsError. Collective.

    origin (n_own, 2): where they were when the lists were built; broken: a number is not finite somewhere; mixed_laws:
    there are pairs of materials without a common law; alone (m,): owned particles that can meet nobody, however fast.
    """
    p = particles
    hot = p.hot[p.owned]
    speed = np.hypot(p["vx"], p["vy"])
    with np.errstate(invalid="ignore"):
        too_fast = ~(speed * dt <= LARGEST_STRIDE * hot[:, RADIUS])
    too_fast[alone] = False
    bad = too_fast | ~np.isfinite(hot[:, :5]).all(axis=1)
    mine = []
    for c in _first(p, bad):
        known = np.isfinite(hot[c, :2]).all()  # else tell where it was when the lists were built
        x, y = hot[c, :2] if known else origin[c]
        mine.append((int(p["gid"][c]), float(x), float(y), float(p["vx"][c]), float(p["vy"][c]), comm.rank))
    rows = sorted(row for part in comm.allgather(mine) for row in part)[:NAMED]
    total = int(comm.sum_into(np.array([bad.sum()], dtype=np.int64))[0])
    what = "a number is not finite" if broken else "a particle moves over half its radius per step"
    guess = f"the time step {dt:g} s is probably too large, or particles were created with overlaps"
    if broken and mixed_laws:
        guess = "some particles have different laws, and no law is assigned to pairs of them"
    named = "\n".join(
        f"  particle {g} at ({x:g}, {y:g}), velocity ({vx:g}, {vy:g}), rank {rank}" for g, x, y, vx, vy, rank in rows
    )
    raise PhysicsError(f"step {step}: {what} ({total} particles); {guess}\n{named}")


def name_slipped(sim: Any) -> None:
    """A line in the log for particles that have slipped through a row of GLINE or a wall, each once. Collective."""
    p, walls = sim.particles, sim.walls
    mine = walls.side == 0
    if not sim.rows and not mine.any():
        return
    origin = np.empty((len(p.hot), 2))
    origin[p.owned] = sim.origin
    chain = None
    if sim.rows:
        sim.halo.fill(origin)
        sim.halo.move_images(origin, period=sim.rebuild_state.period)
        chain = slips.neighbours_in_rows(p.ihot[:, GID], p.hot[:, [X, Y]], origin, sim.rows, sim.rebuild_state.side)
        sim.halo.fill(chain)
        for k in range(0, chain.shape[1], 2):
            sim.halo.move_images(chain[:, k:], period=sim.rebuild_state.period if k % 4 else 0.0)
    paths = np.where(mine[:, None], walls.paths(), np.nan)
    kinds = slips.found(sim.lists, p.hot, origin, chain, walls.table()[:, :4].copy(), paths)
    if not sim.comm.any(bool(kinds.any())):
        return
    for kind, what in ((slips.ROW, "a row of GLINE"), (slips.WALL, "a wall")):
        which = kinds == kind
        which[which] = ~np.isin(p["gid"][which], list(sim._named))
        gids = np.concatenate(sim.comm.allgather(p["gid"][which].copy())).tolist()
        if gids:
            sim._named.update(gids)
            names = places(p, which, sim.comm)
            more = f"; and {len(gids) - NAMED} more" if len(gids) > NAMED else ""
            if sim.log is not None:
                sim.log.warn(f"step {sim.clock.step}: {len(gids)} particles passed through {what}: {names}{more}")


def drop_outside(sim: Any, box: tuple[float, float, float, float]) -> None:
    """Particles whose centre, or that of their clump, has left the BOX are deleted, with a line in the log;
    PhysicsError if they ran away, which the next look would no longer see. Collective."""
    x, y = sim.clumps.centres(sim.particles)
    gone = outside(x, y, box)
    _refuse_runaways(sim, gone)
    names = places(sim.particles, gone, sim.comm)
    number = sim.remove(gone)
    sim.lost += number
    if sim.log is not None:
        more = f"; and {number - NAMED} more" if number > NAMED else ""
        sim.log.info(f"step {sim.clock.step}: {number} particles left the BOX and were deleted: {names}{more}")


def _refuse_runaways(sim: Any, which: np.ndarray) -> None:
    """PhysicsError if one of the flagged owned particles (n_own,) bool of an open model is not finite, or goes too
    far in a step. Collective."""
    p, found = sim.particles, np.zeros(4)
    places, hot = p.positions()[which], p.hot[p.owned][which]
    motion.survey(hot, 0, len(hot), places, sim.clock.dt, NO_ROWS, found)
    sim.comm.max_into(found)
    if found[motion.BROKEN] or found[motion.STRIDE] > LARGEST_STRIDE:
        broken = bool(found[motion.BROKEN])
        mixed = sim.own_laws.mixed(sim.materials.rows)
        stop_on_runaway(p, p.positions(), sim.clock.dt, sim.clock.step, broken, mixed, sim.comm, NO_ROWS)


def refuse_lost_bonds(sim: Any, hist: Any) -> None:
    """Stop the run unless every bond has found its place in the new lists (a bond is remembered by both its ends)."""
    if sim.bonds == 0:
        return
    found = np.array([hist.bonded(), sim.lists.bonds_placed], np.int64)
    sim.comm.sum_into(found)
    if found[0] != 2 * found[1]:
        raise PhysicsError(
            f"step {sim.clock.step}: {found[0] // 2 - found[1]} bonds were lost when the lists were rebuilt; "
            f"longest bond {sim.rebuild_state.bond_reach:g} m, column {sim.rebuild_state.side:g} m. Particles "
            "move too far in a step: the time step is probably too large"
        )
    sim.bonds = int(found[1])

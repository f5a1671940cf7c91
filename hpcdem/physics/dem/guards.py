"""What must not happen to particles, and who they are when it does: leaving the BOX, running away, losing a number."""

from __future__ import annotations

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.errors import PhysicsError
from hpcdem.core.fields import RADIUS
from hpcdem.physics.dem.particles import Particles

LARGEST_STRIDE = 0.5
"""A particle that moves more than this fraction of its radius in one step stops the run."""
NAMED = 10
"""Most particles named in a message."""


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
    guess = f"the time step {dt:g} s is probably too large, or particles were made overlapping"
    if broken and mixed_laws:
        guess = "there are particles of different laws, and a pair of both has no law"
    named = "\n".join(
        f"  particle {g} at ({x:g}, {y:g}), velocity ({vx:g}, {vy:g}), rank {rank}" for g, x, y, vx, vy, rank in rows
    )
    raise PhysicsError(f"step {step}: {what} ({total} particles); {guess}\n{named}")

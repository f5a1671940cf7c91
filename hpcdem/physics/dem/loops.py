"""Masses, tables of laws and argument lists of the kernels, from materials, walls and settings."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcdem.core.memory import aligned
from hpcdem.physics.dem import periodic, rolling
from hpcdem.physics.dem.kernels import contacts, mass, motion, pair_forces
from hpcdem.physics.dem.kernels import walls as wall_kernels


def refresh(sim: Any) -> None:
    """Masses, law tables and argument lists of the kernels, from materials, walls and settings. Collective."""
    p, s, lists = sim.particles, sim.settings, sim.lists
    rows, n_mat = sim.materials.rows, len(sim.materials)
    dt, b = sim.clock.dt, lists.blocks
    sim.body = aligned((p.n_own, 8))
    motion.fill_body(
        p.hot, p.ihot, p.icold, p.n_left, rows["density"].copy(), rows["damp"].copy(), mass.shape(s.disk), dt,
        sim.body,
    )  # fmt: skip
    if sim.clumps:
        sim.clumps.fill(p, rows["density"].copy(), rows["damp"].copy(), dt, sim.body)
    sim.own_table, bounds = sim.own_laws.tables(rows) if sim.own_laws else (None, None)
    sim.own_laws.compile_loops(sim)
    sim.pair_laws = contacts.pair_table(rows, sim.own_laws.which(rows), bounds)
    sim.wall_laws = _wall_laws(sim.walls, rows)
    sim.bond_laws = contacts.bond_laws(sim.bond_types.rows)
    sim._pushed, sim._push = _pressures(sim)
    sim._wall_table = sim.walls.table()
    sim._walls_move = sim.walls.moves
    sim._mover = periodic.snapping(sim, motion.move.on(lists.n_blocks))
    sim._pair_forces = (sim.own_laws.loops or pair_forces).forces.on(lists.n_blocks)
    sim._wall_forces = wall_kernels.forces.on(lists.n_blocks)
    sim._move_args = (
        p.hot, p.cold, p.n_left, b.cut, b.lo, b.foff, lists.force, sim.body, s.gx, s.gy, s.lsm, dt,
    )  # fmt: skip
    sim._pair_args = (
        p.hot, p.ihot, *b, lists.ptr, lists.row, lists.partner, lists.fs, lists.bond, lists.u_made, lists.force,
        sim.pair_laws, contacts.bond_table(sim.bond_laws), n_mat, dt, mass.SPHERES[s.disk], lists.tally,
    )  # fmt: skip
    if sim.own_laws.loops is not None:
        sim._pair_args += sim.own_table, lists.memory, sim.own_laws.initial
    sim._wall_args = (
        p.hot, p.ihot, b.lo, b.foff, lists.force, lists.wptr, sim._wall_table, lists.slot_row, lists.slot_wall,
        lists.slot_fs, lists.slot_side, lists.new_side, sim.wall_laws, n_mat, dt,
    )  # fmt: skip
    sim._tables_stale = False
    sim.dashpots = None
    if s.restitution < 1.0:
        sim.prepare_kernels("restitution")
        from hpcdem.physics.dem.restitution import Dashpots  # brings kernels of their own

        sim.dashpots = Dashpots(sim)
    sim.rolling = None
    if rolling.columns(sim):
        sim.prepare_kernels("rolling")
        sim.rolling = rolling.Rolling(sim)
    for physics in sim.physics:
        physics.prepare(sim)


def _wall_laws(walls: Any, rows: np.ndarray) -> np.ndarray:
    """The table of kernels.walls.wall_table, each distinct wall computed once: a polyline has many equal segments."""
    properties = np.stack([walls.kn, walls.ks, walls.fric], axis=1)
    if len(walls) < 2:
        return wall_kernels.wall_table(rows, *properties.T)
    distinct, of = np.unique(properties, axis=0, return_inverse=True)
    table = wall_kernels.wall_table(rows, *distinct.T).reshape(len(distinct), len(rows), 4)
    return table[of.reshape(-1)].reshape(-1, 4)


def pressed(sim: Any) -> np.ndarray:
    """Forces (n_own, 2) [N] of PROP xp, yp on the owned particles: pressure 2 R thickness."""
    p, rows = sim.particles, sim.materials.rows
    force = np.stack([rows["xp"], rows["yp"]], axis=1)[p["material"]]
    return force * (2.0 * p["radius"] * sim.settings.thickness)[:, None]


def _pressures(sim: Any) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the force table that PROP xp, yp push on, and their forces (n, 2) [N]. They are few, the particles of
    a side of the model, and usually none."""
    rows = sim.materials.rows
    if not (rows["xp"].any() or rows["yp"].any()):
        return np.empty(0, np.int64), np.empty((0, 2))
    force = pressed(sim)
    which = np.flatnonzero(force.any(axis=1))
    return sim.lists.force_rows()[which], force[which]

"""Looking at a simulation without touching it: contacts, wall forces, energy, critical time step, frames.

Sums that are written to files are exact (order-free), so that files do not depend on the rank count.
"""

from __future__ import annotations

import math

import numpy as np

from hpcdem.io.frame import Frame, Table
from hpcdem.io.slabs import to_slabs
from hpcdem.physics.dem import contacts, mass
from hpcdem.physics.dem import walls as wall_kernels
from hpcdem.physics.exact_sum import exact_sum
from hpcdem.simulation import Simulation

FN, FS, FORCE_X, FORCE_Y, AT_X, AT_Y, OVERLAP, STIFFNESS = range(8)


def contact_rows(sim: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Touching or bonded pairs, each once over all ranks: (m, 8) f8 [columns above] and (m, 3) i8 [gid, gid, bond
    type]."""
    lists, p = sim.lists, sim.particles
    out, iout = np.empty((lists.n_pairs, 8)), np.empty((lists.n_pairs, 3), np.int64)
    n = 0
    for t in range(lists.n_blocks):
        n += contacts.report(
            t, p.hot, p.ihot, lists.blocks, lists.ptr, lists.partner, lists.fs, lists.bond, lists.u_made,
            sim.pair_laws, sim.bond_laws, len(sim.materials), mass.SPHERES[sim.settings.disk], out[n:], iout[n:],
        )  # fmt: skip
    return out[:n], iout[:n]


def wall_rows(sim: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Wall contacts of the owned particles: (m, 8) f8 and (m, 2) i8 [gid, wall row]; forces are those on the
    particle."""
    lists, p = sim.lists, sim.particles
    sim._wall_table[:, 0:2], sim._wall_table[:, 2:4] = sim.walls.p1, sim.walls.p2
    m = len(lists.slot_row)
    out, iout = np.empty((m, 8)), np.empty((m, 2), np.int64)
    n = wall_kernels.report(
        p.hot, p.ihot, sim._wall_table, lists.slot_row, lists.slot_wall, lists.slot_fs, lists.slot_side,
        sim.wall_laws, len(sim.materials), out, iout,
    )  # fmt: skip
    return out[:n], iout[:n]


def wall_forces(sim: Simulation) -> np.ndarray:
    """Force on each wall (n_walls, 2) [N], exactly summed. Collective."""
    return _sum_by_wall(sim, *wall_rows(sim))


def _sum_by_wall(sim: Simulation, out: np.ndarray, iout: np.ndarray) -> np.ndarray:
    """The opposite of the forces in wall rows of all ranks, exactly summed per wall (n_walls, 2) [N]. Collective."""
    total = np.zeros((len(sim.walls), 2))
    parts = sim.comm.allgather((iout[:, 1].copy(), out[:, FORCE_X : FORCE_Y + 1].copy()))
    wall = np.concatenate([w for w, _ in parts])
    force = np.concatenate([f for _, f in parts])
    for w in np.unique(wall):
        mine = force[wall == w]
        total[w] = -_fsum(mine[:, 0]), -_fsum(mine[:, 1])
    return total


def _fsum(values: np.ndarray) -> float:
    """Exact sum; NaN where a value is not finite (fsum would raise, and a broken state must still be written)."""
    return math.fsum(values) if np.isfinite(values).all() else math.nan


def kinetic_energy(sim: Simulation) -> float:
    """Sum of (m v^2 + I w^2) / 2 over all particles [J], exactly summed. Collective."""
    p, body = sim.particles, sim.body
    v2 = p["vx"] * p["vx"] + p["vy"] * p["vy"]
    return exact_sum(0.5 * (body[:, 0] * v2 + body[:, 1] * p["spin"] * p["spin"]), sim.comm)


def critical_dt(sim: Simulation) -> float:
    """0.8 min sqrt(m / sum k) over the particles that are free to move [s]; inf without contacts. Collective.

    k: tangent normal stiffness of each touching contact of the particle (PFC's estimate).
    """
    p, lists = sim.particles, sim.lists
    stiffness = np.zeros(len(p))
    for t in range(lists.n_blocks):
        contacts.stiffness(
            t, p.hot, p.ihot, lists.blocks, lists.ptr, lists.partner, sim.pair_laws, len(sim.materials), p.n_left,
            stiffness,
        )  # fmt: skip
    wout, wiout = wall_rows(sim)
    order = np.argsort(p["gid"])
    np.add.at(stiffness, order[np.searchsorted(p["gid"], wiout[:, 0], sorter=order)], wout[:, STIFFNESS])
    counts = (stiffness > 0.0) & ((p["fix"] & 3) != 3)
    best = float(np.sqrt(sim.body[counts, 0] / stiffness[counts]).min()) if counts.any() else math.inf
    return 0.8 * -float(sim.comm.max_into(np.array([-best]))[0])


def frame(sim: Simulation) -> Frame:
    """Everything that is written at an output time. The model must be closed. Collective."""
    p, s, comm = sim.particles, sim.settings, sim.comm
    columns: dict[str, np.ndarray] = {
        name: p[name].copy() for name in ("gid", "x", "y", "radius", "vx", "vy", "spin", "angle", "birth")
    }
    force = sim.lists.owned_forces()
    columns["fx"], columns["fy"], columns["torque"] = force[:, 0].copy(), force[:, 1].copy(), force[:, 2].copy()
    columns["mass"], columns["inertia"] = sim.body[:, 0].copy(), sim.body[:, 1].copy()
    rows = sim.materials.rows
    for name in ("density", "fric", "shear", "poiss", "kn", "ks", "damp"):
        columns[name] = rows[name][p["material"]]
    columns["hertz"] = rows["hertz"][p["material"]].astype(np.int8)
    columns["fix"] = p["fix"].astype(np.uint8)
    columns["color"], columns["group"] = p["color"].astype(np.int32), p["group"].astype(np.int32)

    out, iout = contact_rows(sim)
    pair_columns = {
        "id1": iout[:, 0], "id2": iout[:, 1], "fn": out[:, FN], "fs": out[:, FS], "fx": out[:, FORCE_X],
        "fy": out[:, FORCE_Y], "x": out[:, AT_X], "y": out[:, AT_Y], "overlap": out[:, OVERLAP],
    }  # fmt: skip
    touching, bonded = out[:, OVERLAP] >= 0.0, iout[:, 2] > 0
    bonds = {name: values[bonded] for name, values in pair_columns.items()}
    types = sim.bond_types.rows[iout[bonded, 2]]
    bonds["kind"] = types["kind"].astype(np.int8)
    for name in ("ebmod", "gbmod", "tstrength", "sstrength"):
        bonds[name] = types[name].copy()

    output_order = sim.walls.in_output_order()
    place = np.empty(len(output_order), np.int32)
    place[output_order] = np.arange(len(output_order))
    wout, wiout = wall_rows(sim)
    wall_contacts = {
        "id1": wiout[:, 0], "wall": place[wiout[:, 1]], "fn": wout[:, FN], "fs": wout[:, FS], "fx": wout[:, FORCE_X],
        "fy": wout[:, FORCE_Y], "x": wout[:, AT_X], "y": wout[:, AT_Y], "overlap": wout[:, OVERLAP],
    }  # fmt: skip
    tables: dict[str, Table] = {
        "particles": to_slabs(comm, ("gid",), columns),
        "contacts": to_slabs(comm, ("id1", "id2"), {k: v[touching] for k, v in pair_columns.items()}),
        "bonds": to_slabs(comm, ("id1", "id2"), bonds),
        "wall_contacts": to_slabs(comm, ("id1", "wall"), wall_contacts),
    }
    w = sim.walls
    names = ("id", "p1", "p2", "kn", "ks", "fric", "color", "v")
    walls = {name: getattr(w, name)[output_order] for name in names}
    walls["force"] = _sum_by_wall(sim, wout, wiout)[output_order]
    box = w.box() or (math.nan,) * 4
    settings: dict[str, float | str] = {
        "left": box[0], "right": box[1], "bottom": box[2], "height": box[3] - box[2],
        "gx": s.gx, "gy": s.gy, "disk": s.disk, "frac": s.frac, "lsm": s.lsm,
    }  # fmt: skip
    return Frame(sim.clock.step, sim.clock.time, sim.clock.dt, settings, walls, tables, list(sim.groups))

"""Looking at a simulation without touching it: contacts, wall forces, energy, critical time step, frames.

Sums that are written to files are exact (order-free), so that files do not depend on the rank count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hpcdem.io.frame import Frame, Table
from hpcdem.io.slabs import to_slabs
from hpcdem.physics.dem import contacts, mass, totals
from hpcdem.physics.dem import walls as wall_kernels
from hpcdem.physics.exact_sum import BINS_SHAPE, rounded_sums
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
    """The opposite of the forces in wall rows of all ranks, exactly summed per wall (n_walls, 2) [N]; NaN where one is
    not finite. Collective."""
    n_walls = len(sim.walls)
    contacts_of = sim.comm.sum_into(np.bincount(iout[:, 1], minlength=n_walls))
    used = np.flatnonzero(contacts_of)
    place = np.zeros(n_walls, np.int64)
    place[used] = np.arange(len(used))
    bins = np.zeros((2 * len(used), *BINS_SHAPE), np.int64)
    fx, fy = (out[:, column].copy().view(np.int64) for column in (FORCE_X, FORCE_Y))
    totals.by_wall(len(out), iout, fx, fy, place, bins)
    total = np.zeros((n_walls, 2))
    total[used] = -rounded_sums(bins, sim.comm).reshape(-1, 2)
    return total


def kinetic_energy(sim: Simulation) -> float:
    """Sum of (m v^2 + I w^2) / 2 over all particles [J], exactly summed. Collective."""
    bins = np.zeros((1, *BINS_SHAPE), np.int64)
    totals.kinetic(sim.particles.hot, sim.particles.n_left, sim.body, bins[0])
    return float(rounded_sums(bins, sim.comm)[0])


@dataclass(frozen=True)
class Totals:
    """The whole model in a few numbers.

    kinetic [J]; unbalanced: largest unbalanced force of a free particle over the mean normal contact force, 0 without
    contacts; contacts: pairs that touch or are bonded; critical_dt: 0.8 min sqrt(m / sum k) over the particles that are
    free to move [s], inf without contacts, k being the tangent normal stiffness of each touching contact of the
    particle (PFC's estimate).
    """

    kinetic: float
    unbalanced: float
    particles: int
    contacts: int
    critical_dt: float


def survey(sim: Simulation) -> Totals:
    """One look at all particles and contacts. Sums are exact. Collective."""
    p, lists, comm, s = sim.particles, sim.lists, sim.comm, sim.settings
    bins = np.zeros((2, *BINS_SHAPE), np.int64)
    stiffness = np.zeros(len(p))
    counts = np.array([len(p), 0], np.int64)
    for t in range(lists.n_blocks):
        counts[1] += totals.pairs(
            t, p.hot, p.ihot, lists.blocks, lists.ptr, lists.partner, lists.bond, lists.u_made, sim.pair_laws,
            sim.bond_laws, len(sim.materials), mass.SPHERES[s.disk], p.n_left, bins[0], stiffness,
        )  # fmt: skip
    out, iout = wall_rows(sim)
    totals.add_wall_stiffness(
        len(out), iout, out[:, STIFFNESS].copy(), p.ihot, lists.slot_row, lists.slot_wall, p.n_left, stiffness
    )
    totals.kinetic(p.hot, p.n_left, sim.body, bins[1])
    largest, shortest = totals.extremes(p.icold, sim.body, lists.owned_forces(), s.gx, s.gy, stiffness)
    broken = math.isnan(largest)
    largest, shortest, broken = comm.max_into(np.array([0.0 if broken else largest, -shortest, broken])).tolist()
    comm.sum_into(counts)
    normal, kinetic = rounded_sums(bins, comm).tolist()
    particles, touching = counts.tolist()
    ratio = 0.0
    if normal > 0.0:
        ratio = math.nan if broken else largest / (normal / max(touching, 1))
    return Totals(kinetic, ratio, particles, touching, 0.8 * math.sqrt(-shortest))


def critical_dt(sim: Simulation) -> float:
    """The largest time step that is thought stable [s], see `Totals`; inf without contacts. Collective."""
    return survey(sim).critical_dt


def frame(sim: Simulation) -> Frame:
    """Everything that is written at an output time. The model must be closed. Collective."""
    p, s, comm = sim.particles, sim.settings, sim.comm
    columns: dict[str, np.ndarray] = {
        name: p[name] for name in ("gid", "x", "y", "radius", "vx", "vy", "spin", "angle", "birth")
    }
    force = sim.lists.owned_forces()
    columns["fx"], columns["fy"], columns["torque"] = force[:, 0], force[:, 1], force[:, 2]
    columns["mass"], columns["inertia"] = sim.body[:, 0], sim.body[:, 1]
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
    touching, bonded = np.flatnonzero(out[:, OVERLAP] >= 0.0), np.flatnonzero(iout[:, 2] > 0)
    types = sim.bond_types.rows[iout[:, 2]]
    bond_columns = pair_columns | {"kind": types["kind"].astype(np.int8)}
    for name in ("ebmod", "gbmod", "tstrength", "sstrength"):
        bond_columns[name] = types[name]

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
        "contacts": to_slabs(comm, ("id1", "id2"), pair_columns, touching),
        "bonds": to_slabs(comm, ("id1", "id2"), bond_columns, bonded),
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

"""Quantities of a simulation that can be queried without changing it: contacts, wall forces, energy, critical time
step, frames.

Sums that are written to files are exact (order-free), so that files do not depend on the rank count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hpcdem.core.fields import ANGLE, FIELDS, FIX, GID, MATERIAL, RADIUS
from hpcdem.core.material import PROPERTIES
from hpcdem.core.units import declared
from hpcdem.io.frame import Frame, Table
from hpcdem.io.slabs import to_slabs
from hpcdem.numerics.exact_sum import BINS_SHAPE, exact_sum, rounded_sums
from hpcdem.numerics.fingerprint import as_text, of_rows
from hpcdem.physics.dem import loops, periodic
from hpcdem.physics.dem.kernels import contacts, laws, mass, modes, rigid, totals
from hpcdem.physics.dem.kernels import walls as wall_kernels
from hpcdem.physics.dem.kernels.motion import CLUMPED, INERTIA, MASS
from hpcdem.physics.dem.simulation import Simulation

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
    sim.walls.put_ends(sim._wall_table)
    m = len(lists.slot_row)
    out, iout = np.empty((m, 8)), np.empty((m, 2), np.int64)
    n = wall_kernels.report(
        p.hot, p.ihot, sim._wall_table, lists.slot_row, lists.slot_wall, lists.slot_fs, lists.slot_side,
        sim.wall_laws, len(sim.materials), out, iout,
    )  # fmt: skip
    return out[:n], iout[:n]


def wall_forces(sim: Simulation) -> np.ndarray:
    """Force on each wall (n_walls, 2) [N], exactly summed. Collective."""
    out, iout = wall_rows(sim)
    if sim.dashpots is not None:
        of_slots, lists = sim.dashpots.on_walls(sim), sim.lists
        more = np.zeros((len(of_slots), out.shape[1]))
        more[:, FORCE_X], more[:, FORCE_Y] = of_slots.T
        rows = np.column_stack([np.zeros(len(of_slots), np.int64), lists.slot_wall])
        out, iout = np.concatenate([out, more]), np.concatenate([iout, rows])
    return _sum_by_wall(sim, out, iout)


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
    _kinetic(sim, bins[0])
    return float(rounded_sums(bins, sim.comm)[0])


def _kinetic(sim: Simulation, bins: np.ndarray) -> None:
    """Kinetic energy of this rank's particles and clumps into bins (2, 2112) i8."""
    totals.kinetic(sim.particles.hot, sim.particles.n_left, sim.body, bins)
    if sim.clumps:
        c = sim.clumps.bodies
        totals.kinetic(c.hot, 0, c.body[: c.mine], bins)


@dataclass(frozen=True)
class Totals:
    """The whole model in a few numbers.

    kinetic [J]; unbalanced: largest unbalanced force of a free particle over the mean normal contact force, 0 without
    contacts; contacts: pairs that touch or are bonded; critical_dt: 0.8 min sqrt(m / sum k) over the particles that are
    free to move [s], inf without contacts, k being the tangent stiffness of each contact and bond of the particle
    (PFC's estimate), the normal or the shear one, whichever is larger, of bonds that of their stiffer state; of a clump
    sum k (1/m + a^2/I) takes the place of sum k / m, a being the distance of the member from the centre; deepest: the
    largest overlap of a pair or a wall contact over the (smaller) radius.
    """

    kinetic: float
    unbalanced: float
    particles: int
    contacts: int
    critical_dt: float
    deepest: float = 0.0


def survey(sim: Simulation) -> Totals:
    """Evaluate all particles and contacts once. Sums are exact. Collective."""
    p, lists, comm, s = sim.particles, sim.lists, sim.comm, sim.settings
    bins = np.zeros((2, *BINS_SHAPE), np.int64)
    counts = np.array([len(p), 0], np.int64)
    deepest = 0.0
    for t in range(lists.n_blocks):
        touching, deep = totals.pairs(
            t, p.hot, p.ihot, lists.blocks, lists.ptr, lists.partner, lists.bond, lists.u_made, sim.pair_laws,
            sim.bond_laws, len(sim.materials), mass.SPHERES[s.disk], bins[0],
        )  # fmt: skip
        counts[1] += touching
        deepest = max(deepest, deep)
    stiffness, deep = _stiffnesses(sim)
    _kinetic(sim, bins[1])
    largest, shortest = totals.extremes(p.icold, sim.body, lists.owned_forces(), s.gx, s.gy, stiffness)
    if sim.clumps:
        of_clumps = _extremes_of_clumps(sim, stiffness)
        # Not max(): it drops NaN.
        largest = math.nan if math.isnan(largest) or math.isnan(of_clumps[0]) else max(largest, of_clumps[0])
        shortest = min(shortest, of_clumps[1])
    broken = math.isnan(largest)
    extremes = np.array([0.0 if broken else largest, -shortest, broken, max(deepest, deep)])
    largest, shortest, broken, deepest = comm.max_into(extremes).tolist()
    comm.sum_into(counts)
    normal, kinetic = rounded_sums(bins, comm).tolist()
    particles, touching = counts.tolist()
    ratio = 0.0
    if normal > 0.0:
        ratio = math.nan if broken else largest / (normal / max(touching, 1))
    return Totals(kinetic, ratio, particles, touching, 0.8 * math.sqrt(-shortest), deepest)


def _stiffnesses(sim: Simulation) -> tuple[np.ndarray, float]:
    """Sum of the stiffness of the contacts and bonds of each owned particle (n_own,) [N/m]; the largest overlap with a
    wall over the radius."""
    p, lists = sim.particles, sim.lists
    out = np.zeros(len(p))
    for t in range(lists.n_blocks):
        totals.stiffness(
            t, p.hot, p.ihot, lists.blocks, lists.ptr, lists.partner, lists.bond, lists.u_made, sim.pair_laws,
            sim.bond_laws, len(sim.materials), mass.SPHERES[sim.settings.disk], p.n_left, out,
        )  # fmt: skip
    rows, contacts_of = wall_rows(sim)
    deepest = totals.add_wall_stiffness(
        len(rows), contacts_of, rows[:, STIFFNESS].copy(), rows[:, OVERLAP].copy(), p.hot, p.ihot, lists.slot_row,
        lists.slot_wall, p.n_left, out,
    )  # fmt: skip
    if sim.rolling is not None:
        out = np.maximum(out, sim.rolling.rates(sim) * sim.body[:, MASS])
    return out, deepest


def _extremes_of_clumps(sim: Simulation, stiffness: np.ndarray) -> tuple[float, float]:
    """Compute `totals.extremes` for the clumps of this rank; stiffness (n_own,) [N/m]: of the particles. Collective."""
    p, c, s = sim.particles, sim.clumps.bodies, sim.settings
    member, total = np.zeros(len(p.hot)), np.zeros(c.n)
    member[p.owned] = stiffness
    sim.halo.fill(member)
    rigid.stiffness(c.start, c.row, c.arm, c.body, member, total)
    return totals.extremes(c.cold.view(np.int64)[: c.mine], c.body[: c.mine], c.force[: c.mine], s.gx, s.gy, total)


def clumps(sim: Simulation) -> dict[str, np.ndarray]:
    """The clumps of the whole model, on every rank, in the order of ids: id, x, y, vx, vy, spin, angle, area, mass,
    inertia, members (number). The model must be closed. Collective."""
    names = ("x", "y", "vx", "vy", "spin")
    columns: dict[str, np.ndarray] = {name: np.empty(0) for name in ("id", *names, "angle", "area", "mass", "inertia")}
    columns["id"] = columns["members"] = np.empty(0, np.int64)
    if sim.clumps:
        c = sim.clumps.bodies
        columns |= {name: c.hot[: c.mine, k] for k, name in enumerate(names)}
        columns["id"], columns["members"] = c.hot.view(np.int64)[: c.mine, GID], np.diff(c.start)[: c.mine]
        columns["angle"], columns["area"] = c.cold[: c.mine, ANGLE], c.area[: c.mine]
        columns["mass"], columns["inertia"] = c.body[: c.mine, MASS], c.body[: c.mine, INERTIA]
    parts = sim.comm.allgather({name: values.copy() for name, values in columns.items()})
    whole = {name: np.concatenate([part[name] for part in parts]) for name in columns}
    order = np.argsort(whole["id"])
    return {name: values[order] for name, values in whole.items()}


def lightest(sim: Simulation) -> float:
    """The least mass that a contact of a free particle or clump has to move [kg], inf if nothing is free: of a clump
    1 / (1/m + a^2/I), a being the distance of its farthest member from the centre. Collective."""
    p = sim.particles
    free = (p["fix"] != 7) & (sim.body[:, CLUMPED] == 0.0)
    masses = [sim.body[free, MASS]]
    if sim.clumps:
        c = sim.clumps.bodies
        moving = c.cold.view(np.int64)[:, FIX] != 7
        mass, inertia = c.body[moving, MASS], c.body[moving, INERTIA]
        masses.append(1.0 / (1.0 / mass + c.reach()[moving] ** 2 / inertia))
    return float(sim.comm.min_into(np.array([min(m.min(initial=math.inf) for m in masses)]))[0])


@dataclass(frozen=True, order=True)
class Overlap:
    """A contact that has come too close: overlap U over the smaller radius, ids (the second that of a wall if `wall`),
    contact point [m], U [m], rows of the material table."""

    ratio: float
    id1: int
    id2: int
    wall: bool
    x: float
    y: float
    u: float
    materials: tuple[int, ...]


def overlaps_beyond(sim: Simulation, ratio: float, most: int) -> tuple[list[Overlap], int]:
    """The worst contacts with an overlap above `ratio` times the smaller radius, deepest first, at most so many; and
    how many there are. Collective."""
    p = sim.particles
    row_of = dict(zip(p.ihot[:, GID].tolist(), range(len(p.hot))))
    found = []
    out, iout = contact_rows(sim)
    for k in np.flatnonzero(out[:, OVERLAP] > ratio * p.hot[:, RADIUS].min(initial=math.inf)):
        a, b = (row_of[g] for g in iout[k, :2].tolist())
        depth = float(out[k, OVERLAP] / min(p.hot[a, RADIUS], p.hot[b, RADIUS]))
        materials = int(p.ihot[a, MATERIAL]), int(p.ihot[b, MATERIAL])
        found.append(Overlap(depth, int(iout[k, 0]), int(iout[k, 1]), False, *_place_of(out[k]), materials))
    out, iout = wall_rows(sim)
    for k in np.flatnonzero(out[:, OVERLAP] > ratio * p.hot[:, RADIUS].min(initial=math.inf)):
        a = row_of[int(iout[k, 0])]
        depth, wall = float(out[k, OVERLAP] / p.hot[a, RADIUS]), int(sim.walls.id[iout[k, 1]])
        found.append(Overlap(depth, int(iout[k, 0]), wall, True, *_place_of(out[k]), (int(p.ihot[a, MATERIAL]),)))
    found = [overlap for overlap in found if overlap.ratio > ratio]
    worst = sorted(found, key=lambda o: (-o.ratio, o.id1, o.id2))[:most]
    everyone = sorted(
        (o for part in sim.comm.allgather(worst) for o in part), key=lambda o: (-o.ratio, o.id1, o.id2)
    )  # fmt: skip
    return everyone[:most], sim.count(len(found))


def _place_of(row: np.ndarray) -> tuple[float, float, float]:
    return float(row[AT_X]), float(row[AT_Y]), float(row[OVERLAP])


def critical_dt(sim: Simulation) -> float:
    """The largest time step that is thought stable [s], see `Totals`; inf without contacts. Collective."""
    p, s = sim.particles, sim.settings
    stiffness, _ = _stiffnesses(sim)
    _, shortest = totals.extremes(p.icold, sim.body, sim.lists.owned_forces(), s.gx, s.gy, stiffness)
    if sim.clumps:
        shortest = min(shortest, _extremes_of_clumps(sim, stiffness)[1])
    return 0.8 * math.sqrt(float(sim.comm.min_into(np.array([shortest]))[0]))


def stiffest_bond(sim: Simulation) -> float:
    """The largest stiffness of the bonds there are, normal or shear [N/m]; 0 without any. Collective."""
    p, lists = sim.particles, sim.lists
    found = np.zeros(1)
    for t in range(lists.n_blocks if sim.bonds else 0):
        found[0] = max(found[0], contacts.stiffest_bond(
            t, p.hot, p.ihot, lists.blocks, lists.ptr, lists.partner, lists.bond, lists.u_made, sim.pair_laws,
            sim.bond_laws, len(sim.materials), mass.SPHERES[sim.settings.disk],
        ))  # fmt: skip
    return float(sim.comm.max_into(found)[0])


MOST_LANCZOS, EVERY_LANCZOS = 60, 5
"""Largest number of products with the stiffness, and number of products between checks of the convergence of the
frequency."""


def highest_frequency(sim: Simulation, within: float = 1e-3) -> float:
    """The largest eigenfrequency omega [rad/s] of small motions with the present contacts and bonds; 0 without any.

    omega^2 is the largest eigenvalue of M^-1/2 K M^-1/2 (K: physics/dem/kernels/modes.py), by Lanczos iterations (Golub
    & Van Loan, Matrix Computations, ch. 10) from a start that depends on the ids alone, until it changes by less than
    `within` in a few of them. It is approached from below. Products are exact sums, so it does not depend on ranks. An
    undamped leap-frog is stable for dt < 2 / omega. Reads only. Collective.
    """
    p, lists, comm = sim.particles, sim.lists, sim.comm
    n_bodies, mine = (sim.clumps.bodies.n, len(p) + sim.clumps.bodies.mine) if sim.clumps else (0, len(p))
    # Rows of particles, then of clumps; those from `mine` on are also another rank's, which counts them.
    scale, x = np.empty((len(p) + n_bodies, 3)), np.empty((len(p) + n_bodies, 3))
    modes.begin(p.ihot, p.n_left, sim.body, scale[: len(p)], x[: len(p)])
    if sim.clumps:
        c = sim.clumps.bodies
        modes.begin(c.hot.view(np.int64), 0, c.body, scale[len(p) :], x[len(p) :])

    def dot(a: np.ndarray, b: np.ndarray) -> float:
        return exact_sum(a[:mine] * b[:mine], comm)

    before, length = np.zeros_like(x), math.sqrt(dot(x, x))
    diagonal: list[float] = []
    beside: list[float] = []
    found = 0.0
    if length == 0.0:
        return 0.0
    x /= length
    motion, force = np.zeros((len(p.hot), 3)), np.zeros((len(lists.force), 3))
    while len(diagonal) < MOST_LANCZOS:
        y = scale * _stiffness_times(sim, scale * x, motion, force)
        diagonal.append(dot(x, y))
        y -= diagonal[-1] * x + (beside[-1] * before if beside else 0.0)
        length = math.sqrt(dot(y, y))
        done = not length > 1e-12 * max(map(abs, diagonal))
        if done or len(diagonal) % EVERY_LANCZOS == 0:
            largest = float(np.linalg.eigvalsh(np.diag(diagonal) + np.diag(beside, -1))[-1])
            if done or largest - found <= 2.0 * within * largest:
                found = max(found, largest)
                break
            found = largest
        beside.append(length)
        before, x = x, y / length
    return math.sqrt(max(found, 0.0))


def _stiffness_times(sim: Simulation, u: np.ndarray, motion: np.ndarray, force: np.ndarray) -> np.ndarray:
    """K u (n, 3) for motions u of the owned particles, then of the clumps of this rank; motion, force: room per storage
    and force row. Members of clumps move as these do, and what acts on them acts on the clumps."""
    p, lists, b = sim.particles, sim.lists, sim.lists.blocks
    motion[p.owned] = u[: len(p)]
    if sim.clumps:
        c = sim.clumps.bodies
        rigid.motions_of_members(c.start, c.row, c.arm, u[len(p) :], motion)
    sim.halo.fill(motion)
    out = np.zeros_like(u)
    turning, turning_at_walls = np.empty((2, 0)) if sim.rolling is None else sim.rolling.stiffnesses(sim)
    for t in range(lists.n_blocks):
        modes.pairs(
            t, p.hot, p.ihot, b.cut, b.lo, b.hi, b.poff, b.foff, lists.ptr, lists.partner, lists.bond, lists.u_made,
            sim.pair_laws, sim.bond_laws, len(sim.materials), mass.SPHERES[sim.settings.disk], turning, motion, force,
        )  # fmt: skip
        first, last = b.foff[t] + b.cut[t] - b.lo[t], b.foff[t] + b.cut[t + 1] - b.lo[t]
        out[b.cut[t] - p.n_left : b.cut[t + 1] - p.n_left] = force[first:last]
    sim.walls.put_ends(sim._wall_table)
    modes.walls(
        p.hot, p.ihot, sim._wall_table, lists.slot_row, lists.slot_wall, lists.slot_side, sim.wall_laws,
        len(sim.materials), p.n_left, turning_at_walls, motion, out,
    )  # fmt: skip
    if sim.clumps:
        member = np.zeros_like(motion)
        member[p.owned] = out[: len(p)]
        sim.halo.fill(member)
        rigid.forces_of_members(c.start, c.row, c.arm, member, out[len(p) :])
    return out


def fingerprint(sim: Simulation) -> dict[str, str]:
    """128 bits for what the next step depends on: particles (all fields, with the forces on them), contacts (shear
    forces, bonds, sides at walls: what a checkpoint holds) and walls, as hexadecimal text. The same on any number of
    ranks and threads. Collective.
    """
    p, w = sim.particles, sim.walls
    columns = {name: p[name] for name in (*FIELDS, *p.extra)}
    if sim.closed:
        force = sim.lists.owned_forces()
        columns |= {name: force[:, k] for k, name in enumerate(("fx", "fy", "torque"))}
    rows = sim.clumps.rows(p)
    if rows is not None:
        columns |= {f"clump {k}": rows[:, k] for k in range(rows.shape[1])}
    hist = sim.lists.histories(p.ihot, float(sim.stamp)) if sim.closed else sim.hist
    owner = np.repeat(p["gid"], hist.counts())
    once = (hist.partner > owner) | (hist.partner < 0)  # the owner of the lower id tells of a pair
    remembered = [column[once] for column in (owner, hist.partner, hist.fs, hist.extra, hist.bond, *hist.memory.T)]
    sums = np.array([of_rows(list(columns.values())), of_rows(remembered)], np.uint64)
    sim.comm.sum_into(sums)  # integers without sign go round, as they should
    bend = w.bend.T if w.bend.any() else ()
    walls = of_rows([w.ids_of_earlier_versions(), *w.p1.T, *w.p2.T, *w.v.T, w.kn, w.ks, w.fric, *bend])
    return {"particles": as_text(sums[0]), "contacts": as_text(sums[1]), "walls": as_text(walls)}


def storage_rows(sim: Simulation, gid: np.ndarray) -> np.ndarray:
    """Rows of the hot table, ghosts among them, of particles with these ids."""
    known = sim.particles.ihot[:, GID]
    order = np.argsort(known)
    return order[np.searchsorted(known, gid, sorter=order)]


def _law_columns(law: np.ndarray, poisson: np.ndarray, out: np.ndarray, opened: np.ndarray) -> dict[str, np.ndarray]:
    """Compute the columns of frames of ZDEM for the law of each contact: kn, ks of linear pairs, the smaller friction,
    1 if it slips, secant normal and tangent shear stiffness [N/m].

    law (m, 4): rows of a law table; poisson (m,): mean of the two; out: as contact_rows; opened (m,): bonds in tension,
    whose stiffness is that of the bond. Of Hertz pairs ks = 3 (1 - nu) / (2 - nu) K sqrt(U) (Mindlin).
    """
    hertz = law[:, 0] == laws.HERTZ
    fn, u = out[:, FN], out[:, OVERLAP]
    secant = np.divide(fn, u, out=np.zeros(len(out)), where=u != 0.0)
    shear = np.where(hertz, 3.0 * (1.0 - poisson) / (2.0 - poisson) * secant, law[:, 2])
    slip = (np.abs(out[:, FS]) >= law[:, 3] * np.maximum(fn, 0.0)) & ~opened
    return {
        "law_kn": np.where(hertz, 0.0, law[:, 1]), "law_ks": np.where(hertz, 0.0, law[:, 2]), "law_fric": law[:, 3],
        "law_slip": slip.astype(np.int8), "law_realkn": secant, "law_realks": shear,
    }  # fmt: skip


def _pair_laws(
    sim: Simulation, out: np.ndarray, iout: np.ndarray, types: np.ndarray
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Laws of pairs, and the forces at which their bonds break in tension and in shear [N]; types: of bonds."""
    p, rows, n = sim.particles, sim.materials.rows, len(sim.materials)
    a, b = (storage_rows(sim, iout[:, k]) for k in (0, 1))
    first, second = p.ihot[a, MATERIAL], p.ihot[b, MATERIAL]
    bonded, opened = iout[:, 2] > 0, (iout[:, 2] > 0) & (out[:, OVERLAP] < 0.0)
    law = sim.pair_laws[first * n + second]
    poisson = 0.5 * (rows["poiss"][first] + rows["poiss"][second])
    columns = _law_columns(law, poisson, out, bonded)
    elastic = types["kind"] == laws.ELASTIC_BOND
    ratio = np.divide(types["gbmod"], types["ebmod"], out=np.zeros(len(types)), where=types["ebmod"] > 0.0)
    tangent = np.where(law[:, 0] == laws.HERTZ, 2.0 * (1.0 - poisson) / (2.0 - poisson), 0.0)
    in_tension = np.where(elastic, ratio, tangent) * columns["law_realkn"]
    use = opened & (elastic | (law[:, 0] == laws.HERTZ))
    columns["law_realks"] = np.where(use, in_tension, columns["law_realks"])
    ra, rb = p.hot[a, RADIUS], p.hot[b, RADIUS]
    mean = 2.0 * ra * rb / (ra + rb)
    keep = bonded & (types["conserving"] != 0.0) & elastic
    section = math.pi * mean * mean if mass.SPHERES[sim.settings.disk] else 2.0 * mean
    columns["law_realks"] = np.where(keep, types["gbmod"] * section / (ra + rb), columns["law_realks"])
    area = np.where(elastic, section, 1.0)
    return columns, {"law_tension": types["tstrength"] * area, "law_shear": types["sstrength"] * area}


def _wall_laws(sim: Simulation, out: np.ndarray, iout: np.ndarray) -> dict[str, np.ndarray]:
    """Laws of wall contacts."""
    material = sim.particles.ihot[storage_rows(sim, iout[:, 0]), MATERIAL]
    law = sim.wall_laws[iout[:, 1] * len(sim.materials) + material]
    return _law_columns(law, sim.materials.rows["poiss"][material], out, np.zeros(len(out), bool))


def frame(sim: Simulation) -> Frame:
    """Gather all columns that are written at an output time."""
    p, s, comm = sim.particles, sim.settings, sim.comm
    columns: dict[str, np.ndarray] = {
        name: p[name] for name in ("gid", "x", "y", "radius", "vx", "vy", "spin", "angle", "birth")
    }
    force = sim.lists.owned_forces()
    columns["fx"], columns["fy"], columns["torque"] = force[:, 0], force[:, 1], force[:, 2]
    columns["mass"], columns["inertia"] = sim.body[:, 0], sim.body[:, 1]
    rows = sim.materials.rows
    for name in (name for name, one in PROPERTIES.items() if one.in_frames):
        columns[name] = rows[name][p["material"]]
    if rows["xp"].any() or rows["yp"].any():
        columns["push_x"], columns["push_y"] = loops.pressed(sim).T
    columns["hertz"] = rows["hertz"][p["material"]].astype(np.int8)
    columns["fix"] = p["fix"].astype(np.uint8)
    if sim.clumps:
        columns["clump"] = p.clump
        columns["clump_x"], columns["clump_y"] = sim.clumps.centres(p)
    columns.update({name: p[name].copy() for name in p.extra})
    if s.period:
        columns["x"], crossed = periodic.inside(sim, p["x"])
        columns[periodic.LAPS] += crossed
        if s.widening:
            columns["vx"] = p["vx"] - crossed * s.widening
    columns["color"], columns["group"] = p["color"].astype(np.int32), p["group"].astype(np.int32)

    out, iout = contact_rows(sim)
    pair_columns = {
        "id1": iout[:, 0], "id2": iout[:, 1], "fn": out[:, FN], "fs": out[:, FS], "fx": out[:, FORCE_X],
        "fy": out[:, FORCE_Y], "x": out[:, AT_X], "y": out[:, AT_Y], "overlap": out[:, OVERLAP],
    }  # fmt: skip
    touching, bonded = np.flatnonzero(out[:, OVERLAP] >= 0.0), np.flatnonzero(iout[:, 2] > 0)
    types = sim.bond_types.rows[iout[:, 2]]
    bond_columns = pair_columns | {"kind": types["kind"].astype(np.int8), "rubber": types["rubber"].astype(np.int8)}
    if sim.bond_types.rows["conserving"].any():
        bond_columns["conserving"] = types["conserving"].astype(np.int8)
    pair_laws, bond_laws = _pair_laws(sim, out, iout, types)
    pair_columns |= pair_laws
    bond_columns |= pair_laws | bond_laws
    for name in ("ebmod", "gbmod", "tstrength", "sstrength"):
        bond_columns[name] = types[name]

    output_order = sim.walls.in_output_order()
    place = np.empty(len(output_order), np.int32)
    place[output_order] = np.arange(len(output_order))
    wout, wiout = wall_rows(sim)
    wall_contacts = {
        "id1": wiout[:, 0], "wall": place[wiout[:, 1]], "fn": wout[:, FN], "fs": wout[:, FS], "fx": wout[:, FORCE_X],
        "fy": wout[:, FORCE_Y], "x": wout[:, AT_X], "y": wout[:, AT_Y], "overlap": wout[:, OVERLAP],
        **_wall_laws(sim, wout, wiout),
    }  # fmt: skip
    for table in (pair_columns, bond_columns, wall_contacts) if s.period else ():
        table["x"] = periodic.inside(sim, table["x"])[0]
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
    if s.period:
        box = s.side, s.side + s.period, *box[2:]
    settings: dict[str, float | str] = {
        "left": box[0], "right": box[1], "bottom": box[2], "height": box[3] - box[2],
        "gx": s.gx, "gy": s.gy, "disk": s.disk, "frac": s.frac, "lsm": s.lsm,
    }  # fmt: skip
    if s.period:
        settings["period"] = s.period
    if units := declared(s.units):
        settings["units"] = units
    return Frame(sim.clock.step, sim.clock.time, sim.clock.dt, settings, walls, tables, list(sim.groups))

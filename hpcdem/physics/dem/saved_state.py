"""The whole state to a file and back, bit for bit, on any number of ranks and threads."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.clock import Clock
from hpcdem.core.comm import Comm
from hpcdem.core.errors import CommandError
from hpcdem.core.fields import (
    AREA,
    CLUMP,
    CLUMP_ANGLE,
    CLUMP_SPIN,
    CLUMP_VX,
    CLUMP_VY,
    CLUMP_WIDTH,
    CLUMP_X,
    CLUMP_Y,
    FIELDS,
    FX,
    MEMBERS,
    MOMENT,
    OFFSET_X,
    OFFSET_Y,
    TORQUE,
)
from hpcdem.engine import checkpoint as engine
from hpcdem.engine.checkpoint import take_newest
from hpcdem.halo.migrate import Trail
from hpcdem.io import checkpoint
from hpcdem.io.frame import Table
from hpcdem.io.slabs import ask, holders, order_of, to_slabs
from hpcdem.physics.dem import periodic, user_laws
from hpcdem.physics.dem.budget import Budget
from hpcdem.physics.dem.clumps import Clumps
from hpcdem.physics.dem.flexing_base import Base
from hpcdem.physics.dem.kernels.contacts import LONGEST2
from hpcdem.physics.dem.kernels.fast import Fast
from hpcdem.physics.dem.kernels.neighbours import Histories
from hpcdem.physics.dem.land import Land
from hpcdem.physics.dem.particles import free_rows
from hpcdem.physics.dem.reach import ListState
from hpcdem.physics.dem.settings import Settings
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.dem.walls import Walls
from hpcdem.physics.particle_physics import PHYSICS
from hpcdem.physics.user_files import UnknownLaw


def save(sim: Simulation, path: Path | str) -> None:
    """SAV: write the state. Reads only: a run that saves resumes exactly like one that does not. Collective."""
    engine.save(sim, path, lambda: (state_of(sim), tables_of(sim)))


def state_of(sim: Simulation) -> dict[str, Any]:
    """Return everything that is not a per-particle table, as JSON values (floats survive JSON bit for bit)."""
    closed = sim.closed
    longest2 = np.array([sim.lists.longest_bond2() if closed else sim._longest2])
    breaks = sim.breaks.copy()
    if closed:
        breaks = breaks + sim.uncollected_breaks()
    walls = {name: getattr(sim.walls, name).tolist() for name in Walls.COLUMNS}
    return {
        "clock": dataclasses.asdict(sim.clock),
        "settings": dataclasses.asdict(sim.settings),
        "lattice": dataclasses.asdict(sim.rebuild_state),
        "fast": sim.fast.state(),
        "closed": closed,
        "longest2": float(sim.comm.max_into(longest2)[0]),
        "walls": walls,
        "materials": sim.materials.as_floats().tolist(),
        "bond_types": sim.bond_types.as_floats().tolist(),
        "groups": sim.groups,
        "next_gid": sim.next_gid,
        "makers": sim.makers,
        "streams": sim.streams,
        "breaks": sim.comm.sum_into(breaks).tolist(),
        "bonds": sim.bonds_left(),
        "clumps": {"number": sim.clumps.number, "reach": sim.clumps.reach},
        "lost": sim.lost,
        "rows": sim.rows,
        "energy": sim.energy.state(sim) if sim.energy is not None else None,
        "surface": {str(k): land.state() for k, land in sim.lands.items()},
        "pair_laws": sim.own_laws.state(),
        "stamp": sim.stamp,
        "physics": [[physics.name, physics.parameters()] for physics in sim.physics],
        "rebuilds": sim.rebuilds,
        "history_wishes": {str(k): list(v) for k, v in sim.history_requests.items()},
        "history_origins": {str(k): list(v) for k, v in sim.history_origins.items()},
        "progress": sim.progress,
        "position": sim.position,
        "script": sim.script,
        "plots": sim.plots,
        "drawing": sim.drawing,
        "bases": [base.state() for base in sim.bases],
    }


def tables_of(sim: Simulation) -> dict[str, Table]:
    """The per-particle tables of the state, as slabs. Collective."""
    p = sim.particles
    columns = {name: p[name].copy() for name in (*FIELDS, *p.extra)}
    if sim.closed:
        force = sim.lists.owned_forces()
        for k, name in enumerate(("fx", "fy", "torque")):
            columns[name] = force[:, k].copy()
        hist, origin = sim.lists.histories(p.ihot, float(sim.stamp)), sim.origin
    else:
        hist, origin = sim.hist, p.positions()
    columns["x0"], columns["y0"] = origin[:, 0].copy(), origin[:, 1].copy()
    owner = np.repeat(p["gid"], hist.counts())
    once, walls = hist.partner > owner, hist.partner < 0
    pairs = {
        "gid": owner[once], "partner": hist.partner[once], "fs": hist.fs[once], "extra": hist.extra[once],
        "bond": hist.bond[once].astype(np.int64),
        **{f"{MEMORY}{k}": column.copy() for k, column in enumerate(hist.memory[once].T)},
    }  # fmt: skip
    wall_contacts = {
        "gid": owner[walls], "wall": -1 - hist.partner[walls], "fs": hist.fs[walls], "extra": hist.extra[walls],
    }  # fmt: skip
    if not sim.own_laws:  # which walls do not follow
        wall_contacts |= {f"{MEMORY}{k}": column.copy() for k, column in enumerate(hist.memory[walls].T)}
    return {
        "particles": to_slabs(sim.comm, ("gid",), columns),
        # A pair whose partners live on two ranks is remembered by both; the lower gid's owner writes it.
        "pairs": to_slabs(sim.comm, ("gid", "partner"), pairs),
        "wall_contacts": to_slabs(sim.comm, ("gid", "wall"), wall_contacts),
        **_clump_tables(sim),
    }


def add_physics(sim: Simulation, name: str, parameters: dict[str, Any]) -> None:
    """Physics beside motion, by its name, with its parameters. CommandError for what there is not. Collective."""
    if name not in PHYSICS:
        raise CommandError(f"there is no physics '{name}'; available: {', '.join(PHYSICS)}")
    sim.prepare_kernels(name)
    kind: Any = PHYSICS[name]()
    try:
        physics = kind(**parameters)
    except TypeError as error:
        raise CommandError(f"{name}: {str(error).partition('() ')[2]}") from None
    sim.add_physics(physics)


MEMORY = "memory"
"""Beginning of the names of the columns that hold what contacts keep for a user law or for rolling resistance, in the
tables of pairs and of wall contacts."""
CLUMP_STATE = {
    "x": CLUMP_X, "y": CLUMP_Y, "vx": CLUMP_VX, "vy": CLUMP_VY, "spin": CLUMP_SPIN, "angle": CLUMP_ANGLE, "area": AREA,
    "inertia": MOMENT,
}  # fmt: skip
"""Columns of the table `clumps`, which its first member's owner writes, besides id and number of members."""


def _clump_tables(sim: Simulation) -> dict[str, Table]:
    """Return the table of clumps, each once, and the positions of their members in them."""
    rows = sim.clumps.rows(sim.particles)
    if rows is None:
        return {}
    gid, clump, size = sim.particles["gid"], sim.particles.clump, rows.view(np.int64)[:, MEMBERS]
    first, member = clump == gid, clump >= 0
    clumps = {"id": clump[first], **{name: rows[first, k] for name, k in CLUMP_STATE.items()}, "members": size[first]}
    members = {
        "gid": gid[member], "clump": clump[member], "dx": rows[member, OFFSET_X], "dy": rows[member, OFFSET_Y],
    }  # fmt: skip
    return {"clumps": to_slabs(sim.comm, ("id",), clumps), "clump_members": to_slabs(sim.comm, ("gid",), members)}


def _take_clumps(sim: Simulation, tables: checkpoint.Tables) -> None:
    """The rows of clumps of the particles of this rank. Collective."""
    p, comm = sim.particles, sim.comm
    p.rigid = free_rows(len(p))
    clumps, members = tables["clumps"], tables["clump_members"]
    state = np.zeros((len(clumps["id"]), CLUMP_WIDTH))
    for name, k in CLUMP_STATE.items():
        state[:, k] = clumps[name]
    numbers = state.view(np.int64)
    numbers[:, CLUMP], numbers[:, MEMBERS] = clumps["id"], clumps["members"]
    of = holders(comm, clumps["id"], members["clump"])
    rows = ask(comm, of, members["clump"], lambda asked: state[np.searchsorted(clumps["id"], asked)])
    rows[:, OFFSET_X], rows[:, OFFSET_Y] = members["dx"], members["dy"]
    _, gid, rows = comm.to_ranks(holders(comm, p["gid"], members["gid"]), members["gid"], rows)
    p.rigid[np.searchsorted(p["gid"], gid)] = rows


def restore(sim: Simulation, path: Path | str) -> dict[str, Any]:
    """Take the state of a file written by `save`, on any number of ranks and threads. Collective.

    Returns where the run that saved was: "script" (its text), "position" (index of the statement), "progress" (of the
    CYC or IMPLE in which it was, or None); what to do with it is the caller's affair. CommandError if the file is
    missing, foreign or damaged; the simulation is then as it was.
    """
    state, tables = engine.read(sim.comm, path, None, "particles: a PCDC script can restore it")
    apply_state(sim, state, tables)
    return {name: state[name] for name in ("script", "position", "progress")}


def restore_newest(sim: Simulation, folders: list[Path], before: float = math.inf) -> dict[str, Any] | None:
    """Take the newest whole checkpoint among the .sav files of some folders; None if missing. before: that of
    this time of the model [s] or the last one before it, UsageError if missing. Collective.

    The newest is the one that is farthest in the script, then that of the latest step: clocks may go wrong. What an
    earlier run left in a folder does not count. Returns what `restore` returns, and "path". A damaged file is named in
    the log and the one before it is tried.
    """
    taken = take_newest(folders, sim, before, lambda path: restore(sim, path), UnknownLaw)
    if taken is None:
        return None
    path, state = taken
    sim.resumed = True
    return {**state, "path": path}


def apply_state(sim: Simulation, state: dict[str, Any], tables: checkpoint.Tables) -> None:
    """Take a state that was read; tables: this rank's slabs, which are let go of. UnknownLaw if it has a user
    law that was not named. Collective."""
    laws = user_laws.ModelLaws.restored(state)
    sim.clear()
    sim.own_laws, sim.stamp = laws, state.get("stamp", 1)
    sim.clock = Clock(**state["clock"])
    sim.settings = Settings(**state["settings"])
    if sim.settings.period:
        periodic.begin(sim)
    sim.rebuild_state = ListState(**state["lattice"])
    sim.fast = Fast.restored(state.get("fast", []))
    sim.walls.take_columns(state["walls"])
    for name in ("materials", "bond_types"):
        getattr(sim, name).take_floats(np.array(state[name], dtype=np.float64))
    for name in ("groups", "next_gid", "streams"):
        setattr(sim, name, state[name])
    sim.history_requests = {int(k): (int(v[0]), str(v[1])) for k, v in state["history_wishes"].items()}
    sim.makers = [(int(first), int(line)) for first, line in state.get("makers", [])]
    origins = state.get("history_origins", {})
    sim.history_origins = {int(k): (int(v[0]), float(v[1])) for k, v in origins.items()}
    sim.plots = [(int(y), int(x)) for y, x in state["plots"]]
    if state.get("drawing") is not None:
        sim.drawing = int(state["drawing"][0]), tuple(state["drawing"][1])
    sim.bases = [Base.restored(base) for base in state.get("bases", [])]
    sim.bonds = state["bonds"]
    sim.lost = state.get("lost", 0)
    sim.rows = [(int(first), int(end)) for first, end in state.get("rows", [])]
    if state.get("energy") is not None:
        sim.prepare_kernels("energy")
        sim.energy = Budget.restored(state["energy"], sim.comm.rank == 0)
    sim.lands = {int(k): Land.restored(land) for k, land in state.get("surface", {}).items()}
    sim._longest2 = state["longest2"]
    sim.restart_step = sim.clock.step
    if sim.comm.rank == 0:
        sim.breaks[:] = state["breaks"]
    for name, parameters in state.get("physics", []):
        add_physics(sim, name, parameters)
    origin = _take_particles(sim, tables)
    sim.trail.begin()
    sim.clumps = Clumps(**state.get("clumps", {}))
    if sim.clumps:
        sim.prepare_kernels("clumps")
        _take_clumps(sim, tables)
    tables.clear()  # the close needs the room
    if state["closed"]:
        _close_as_it_was(sim, state, origin)
    if not sim.coupled:
        sim.trail = Trail()
    sim.rebuilds = state["rebuilds"]


def _take_particles(sim: Simulation, tables: checkpoint.Tables) -> np.ndarray:
    """Slabs of particles and their histories; the first close sends them to their owners. Returns their positions at
    the last rebuild (n, 2) [m]. Collective."""
    columns, comm = tables["particles"], sim.comm
    sim.particles.append(**{name: columns[name] for name in (*FIELDS, *sim.particles.extra)})
    sim.hist = histories(comm, columns["gid"], tables["pairs"], tables["wall_contacts"])
    return np.column_stack([columns["x0"], columns["y0"]])


def histories(
    comm: Comm, gid: np.ndarray, pairs: Mapping[str, np.ndarray], walls: Mapping[str, np.ndarray]
) -> Histories:
    """Assemble the histories of the particles of this rank, gid (n,) i8: ascending over all ranks. Collective.

    pairs: each pair once, on any rank: gid < partner, fs, extra, bond, memory; walls: gid, wall, fs, extra,
    memory (see `Histories`).
    """
    columns = sum(name.startswith(MEMORY) for name in pairs)
    memory = np.empty((len(pairs["gid"]), columns))
    for k in range(columns):
        memory[:, k] = pairs[f"{MEMORY}{k}"]
    none = np.zeros(len(walls["gid"]), np.int64)
    at_walls = [walls.get(f"{MEMORY}{k}", np.zeros(len(none))) for k in range(columns)]
    owner = np.concatenate([pairs["gid"], pairs["partner"], walls["gid"]])
    entries = (
        np.concatenate([pairs["partner"], pairs["gid"], -1 - walls["wall"]]),
        np.concatenate([pairs["fs"], pairs["fs"], walls["fs"]]),
        np.concatenate([pairs["extra"], pairs["extra"], walls["extra"]]),
        np.concatenate([pairs["bond"], pairs["bond"], none]),
        np.concatenate([memory, memory, np.reshape(at_walls, (columns, len(none))).T]),
    )
    _, owner, partner, fs, extra, bond, memory = comm.to_ranks(holders(comm, gid, owner), owner, *entries)
    # Of each particle: pairs with higher ids, pairs with lower ones, walls.
    kind = np.where(partner > owner, 0, np.where(partner < 0, 2, 1))
    order = order_of([owner, kind])
    ptr = np.searchsorted(owner[order], np.concatenate([gid, [np.iinfo(np.int64).max]])).astype(np.int64)
    return Histories.of_columns(ptr, partner[order], fs[order], extra[order], bond[order], memory[order])


def _close_as_it_was(sim: Simulation, state: dict[str, Any], origin: np.ndarray) -> None:
    """Lists as they were when the state was saved: built from the positions and walls of that rebuild, then the present
    positions put in. Order, ownership and lists depend on the former alone."""
    p, walls = sim.particles, sim.walls
    saved_lattice = dataclasses.replace(sim.rebuild_state)
    travel, bent = walls.travel.copy(), walls.bent.copy()
    now = walls.p1.copy(), walls.p2.copy()
    gid, moving = p["gid"].copy(), np.hstack([p.positions(), p.cold[:, FX : TORQUE + 1]])
    p["x"][:], p["y"][:] = origin.T
    walls.p1, walls.p2 = walls.at_last_list()
    period = sim.settings.period
    sim.settings.period = saved_lattice.period or period
    sim.close_as_saved()
    sim.settings.period = sim.halo.period = period
    walls.p1, walls.p2, walls.travel, walls.bent = now[0], now[1], travel, bent
    sim.rebuild_state = saved_lattice
    gid, moving = sim.trail.follow(sim.comm, p["gid"], gid, moving)
    order = np.argsort(gid)
    moving = moving[order[np.searchsorted(gid, p["gid"], sorter=order)]]
    p["x"][:], p["y"][:] = moving[:, :2].T
    sim.lists.set_owned_forces(moving[:, 2:])
    if sim.clumps:
        sim.clumps.sum_forces(p, sim.halo, sim.lists)
    sim.lists.tally[:, LONGEST2] = state["longest2"]
    sim._longest2 = state["longest2"]
    sim.halo.refresh()
    sim.tables_changed()
    sim.refresh_tables()

"""LOAD of a frame: the state of a model as far as a file all_<step>.dat of ZDEM or hpcdem holds it.

Taken over are particles with ids, velocities, properties, fixed directions, colours and groups; walls; shear forces of
contacts; bonds; stored forces; time step, gravity, mass rule, step and time. A text has fewer digits than a checkpoint,
and says nothing of clumps, histories and the script: the run continues near the old one, not with its bits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.core.fields import BOX_IDS, FX, FY, TORQUE, sides_of_box
from hpcdem.core.material import PROPERTIES
from hpcdem.io.dat import read_dat
from hpcdem.io.frame import Frame
from hpcdem.io.slabs import ask, holders
from hpcdem.physics.dem.kernels import laws, mass
from hpcdem.physics.dem.saved_state import histories
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.dem.walls import OLD_SIDES

WRITTEN = (*(name for name, one in PROPERTIES.items() if one.in_frames), "hertz")


def load_frame(
    sim: Simulation, path: Path | str, x: tuple[float, float] | None = None, y: tuple[float, float] | None = None
) -> int:
    """Make a new model from a frame and return the number of particles. x, y: keep only centres in these ranges [m].
    Collective.
    """
    comm = sim.comm
    try:
        frame = _checked(comm, read_dat(path, comm=comm), str(path))
    except HpcdemError as problem:
        raise CommandError(str(problem)) from None
    p = frame.tables["particles"].columns
    keep = np.ones(len(p["gid"]), bool)
    for bounds, values in ((x, p["x"]), (y, p["y"])):
        if bounds is not None:
            keep &= (values >= bounds[0]) & (values < bounds[1])
    of_file, kept = sim.count(len(keep)), sim.count(int(keep.sum()))
    if not kept:
        raise CommandError(f"none of the {of_file} particles of {path} lies within the bounds of x and y")
    discs = _Discs(comm, p["gid"], np.column_stack([p["x"], p["y"], p["radius"], keep]))
    p = {name: values[keep] for name, values in p.items()}
    sim.clear()
    _take_settings(sim, frame)
    rows = _take_walls(sim, frame)
    material = _materials(sim, p)
    groups = np.array([sim.group_number(name) for name in frame.group_names], np.int64)
    contacts, unknown = _links(sim, frame, discs)
    at_walls = _wall_contacts(frame, rows, discs)
    sim.next_gid = int(comm.max_into(np.array([p["gid"].max(initial=-1)]))[0]) + 1
    sim.note_maker(0)
    optional = {name: p[name] for name in ("vx", "vy", "spin", "angle", "fix", "color") if name in p}
    sim.particles.append(
        x=p["x"], y=p["y"], radius=p["radius"], gid=p["gid"], group=groups[p["group"]], material=material,
        birth=frame.step, **optional,
    )  # fmt: skip
    for name, column in (("fx", FX), ("fy", FY), ("torque", TORQUE)):
        if name in p:
            sim.particles.cold[:, column] = p[name]
    sim.hist = histories(comm, p["gid"], contacts, at_walls)
    sim.bonds = sim.count(int((contacts["bond"] > 0).sum()))
    longest = contacts["length"][contacts["bond"] > 0]
    sim._longest2 = float(comm.max_into(np.array([np.max(longest, initial=0.0)]))[0]) ** 2
    sim.ownership.wanted = True
    sim.check_soon()
    _report(sim, path, p, kept, unknown)
    return kept


class _Discs:
    """x, y, radius [m] of the discs of a frame and whether they are kept, for those who ask by id. gid (n,): this
    rank's slab of them; rows (n, 4)."""

    def __init__(self, comm: Comm, gid: np.ndarray, rows: np.ndarray) -> None:
        self.comm, self.gid, self._rows = comm, gid, rows

    def of(self, ids: np.ndarray) -> np.ndarray:
        """(m, 4), zeros where a row does not exist. Collective."""

        def answer(asked: np.ndarray) -> np.ndarray:
            out = np.zeros((len(asked), 4))
            here = np.isin(asked, self.gid)
            out[here] = self._rows[np.searchsorted(self.gid, asked[here])]
            return out

        return ask(self.comm, holders(self.comm, self.gid, ids), ids, answer)


def _checked(comm: Comm, frame: Frame, path: str) -> Frame:
    """The frame, if a model can be made of it. Collective."""
    p = frame.tables["particles"].columns
    gid = p.get("gid", np.empty(0, np.int64))
    if not comm.any(len(gid) > 0):
        raise HpcdemError(f"{path}: contains no particles")
    for name in ("x", "y", "radius"):
        if name not in p:
            raise HpcdemError(f"{path}: its particles have no {name}")

    def refuse(wrong: np.ndarray, what: str) -> None:
        comm.agree(f"{path}: {what.format(gid[wrong][0])}" if wrong.any() else None)

    whole = np.isfinite(p["x"]) & np.isfinite(p["y"]) & np.isfinite(p["radius"]) & (p["radius"] > 0.0)
    refuse(~whole, "particle {} has no position or size")
    for name in ("vx", "vy", "spin"):
        if name in p:
            refuse(~np.isfinite(p[name]), f"{name} of particle {{}} is not a number")
    for name in ("angle", "fx", "fy", "torque"):
        if name in p and comm.any(not np.isfinite(p[name]).all()):
            p[name] = np.zeros(len(gid))
    again = np.zeros(len(gid), bool)
    again[1:] = gid[1:] == gid[:-1]
    refuse((gid < 0) | again, "ids of particles must not be negative, and each must be unique")
    if not np.isfinite([frame.walls["p1"], frame.walls["p2"]]).all():
        raise HpcdemError(f"{path}: an end of a wall is not a number")
    ids = frame.walls["id"].tolist()
    if len(set(ids)) < len(ids):
        raise HpcdemError(f"{path}: two walls have the same id")
    return frame


def _take_settings(sim: Simulation, frame: Frame) -> None:
    s, found = sim.settings, frame.settings
    for name in ("gx", "gy", "lsm"):
        value = found.get(name, math.nan)
        if isinstance(value, float) and math.isfinite(value):
            setattr(s, name, value)
    if found.get("disk") in mass.SPHERES:
        s.disk = str(found["disk"])
    if math.isfinite(frame.dt) and frame.dt > 0.0:
        s.dt = float(frame.dt)
    sim.clock.step, sim.clock.time = int(frame.step), float(frame.time) if math.isfinite(frame.time) else 0.0


def _take_walls(sim: Simulation, frame: Frame) -> np.ndarray:
    """Make the walls; returns the row (n,) of each wall of the frame. Those without length are left out (-1)."""
    w = frame.walls
    of_box = sides_of_box(w["id"])
    side_of = {i: side for side, i in BOX_IDS.items()} | {-k: side for k, side in enumerate(OLD_SIDES, 1)}
    rows = np.full(len(w["id"]), -1, np.int64)
    for k, ident in enumerate(w["id"].tolist()):
        p1, p2 = tuple(w["p1"][k].tolist()), tuple(w["p2"][k].tolist())
        if p1 == p2:
            continue
        if ident in of_box and ident in side_of:
            rows[k] = sim.walls.put_side(side_of[ident], p1, p2)
        elif ident >= 0:
            rows[k] = sim.walls.put(ident, p1, p2)
        else:
            raise CommandError(f"wall {ident} of the frame is none of BOX, and its id is negative")
        for name in ("kn", "ks", "fric", "color", "v"):
            values = np.asarray(w[name][k])
            getattr(sim.walls, name)[rows[k]] = np.where(np.isfinite(values), values, 0)
    return rows


def _rows(comm: Comm, columns: np.ndarray, row: Callable[[list[float]], int]) -> np.ndarray:
    """The row (n,) of a table of properties for each row of `columns` (n, k); `row` makes it, on all ranks alike and in
    ascending order of properties. Collective."""
    distinct, of = np.unique(columns, axis=0, return_inverse=True)
    every = np.unique(np.concatenate(comm.allgather(distinct)), axis=0)
    made = {tuple(values): row(values) for values in every.tolist()}
    return np.array([made[tuple(values)] for values in distinct.tolist()], np.int64)[of.reshape(-1)]


def _materials(sim: Simulation, p: dict[str, np.ndarray]) -> np.ndarray:
    """Row of the material table (n,) of each particle. Collective."""
    n = len(p["gid"])
    columns = {name: np.nan_to_num(np.asarray(p.get(name, np.zeros(n)), float)) for name in WRITTEN}
    if "density" not in p and "mass" in p:
        columns["density"] = p["mass"] / mass.volume(p["radius"], sim.settings.disk)
    for axis in "xy":
        push = p.get(f"push_{axis}", np.zeros(n))
        columns[f"{axis}p"] = push / (2.0 * p["radius"] * sim.settings.thickness)
    table = np.stack([*columns.values()], axis=1)
    return _rows(sim.comm, table, lambda values: sim.materials.row(**dict(zip(columns, values))))


_PAIR = {"gid": np.int64, "partner": np.int64, "fs": np.float64, "bond": np.int64, "length": np.float64,
         "extra": np.float64}  # fmt: skip


def _links(sim: Simulation, frame: Frame, discs: _Discs) -> tuple[dict[str, np.ndarray], int]:
    """Pairs that remember something, each once and on the rank that has the lower id: columns of `_PAIR`; and how many
    bonds of the frame have no strength in it, and are left out. Collective."""
    parts = [
        {"id1": np.empty(0, np.int64), "table": np.empty(0, np.int64)} | {k: np.empty(0, t) for k, t in _PAIR.items()}
    ]
    unknown = 0
    for k, name in enumerate(("bonds", "contacts")):
        table = frame.tables[name].columns
        if not sim.count(len(table.get("id1", ()))):
            continue
        a, b = discs.of(table["id1"]), discs.of(table["id2"])
        here = (a[:, 3] > 0.0) & (b[:, 3] > 0.0)
        a, b = a[here], b[here]
        t = {key: np.asarray(values)[here] for key, values in table.items()}
        kind = np.zeros(len(t["id1"]), np.int64)
        if name == "bonds":
            kind = _bond_types(sim, t)
            unknown = sim.count(int((kind == 0).sum()))
        dx, dy = b[:, 0] - a[:, 0], b[:, 1] - a[:, 1]
        length = np.hypot(dx, dy)
        overlap = a[:, 2] + b[:, 2] - length
        # The sign of the shear force from the force on id1: fx = s tx - fn nx with t = (-ny, nx).
        along = (t["fy"] * dx - t["fx"] * dy) if {"fx", "fy"} <= t.keys() else t["fs"]
        two_rt = 4.0 * a[:, 2] * b[:, 2] / (a[:, 2] + b[:, 2])
        parts.append({
            "id1": t["id1"], "table": np.full(len(kind), k),
            "gid": np.minimum(t["id1"], t["id2"]), "partner": np.maximum(t["id1"], t["id2"]),
            "fs": np.copysign(np.abs(np.nan_to_num(t["fs"])), along), "bond": kind, "length": length,
            "extra": np.where(kind > 0, np.maximum(overlap, 0.5e-3 * two_rt), 0.0),
        })  # fmt: skip
    both = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    _, *columns = sim.comm.to_ranks(holders(sim.comm, discs.gid, both["gid"]), *both.values())
    both = dict(zip(both, columns))
    # A bonded pair that touches stands in both tables: bonds precede, and the first one counts.
    order = np.lexsort((both["id1"], both["table"], both["partner"], both["gid"]))
    gid, partner = both["gid"][order], both["partner"][order]
    first = np.ones(len(order), bool)
    first[1:] = (gid[1:] != gid[:-1]) | (partner[1:] != partner[:-1])
    return {key: both[key][order[first]] for key in _PAIR}, unknown


def _bond_types(sim: Simulation, t: dict[str, np.ndarray]) -> np.ndarray:
    """Row of the bond types (m,), 0 where the frame does not say how strong the bond is. Collective."""
    n = len(t["id1"])
    if "kind" in t:
        names = ("kind", "ebmod", "gbmod", "tstrength", "sstrength")
        columns = {name: np.nan_to_num(np.asarray(t.get(name, np.zeros(n)), float)) for name in names}
    else:  # of ZDEM: forces at which the bond breaks, as of a contact bond
        columns = {"kind": np.full(n, float(laws.CONTACT_BOND))}
        columns |= {name: np.nan_to_num(t.get(word, np.zeros(n))) for name, word in _FORCES.items()}
        columns["kind"][(columns["tstrength"] <= 0.0) & (columns["sstrength"] <= 0.0)] = 0.0
    for mark in ("rubber", "conserving"):
        columns[mark] = np.nan_to_num(np.asarray(t.get(mark, np.zeros(n)), float))
    table = np.stack([*columns.values()], axis=1)
    return _rows(sim.comm, table, lambda v: sim.bond_types.row(**dict(zip(columns, v))) if v[0] > 0.0 else 0)


_FORCES = {"tstrength": "n_bond", "sstrength": "s_bond"}


def _wall_contacts(frame: Frame, rows: np.ndarray, discs: _Discs) -> dict[str, np.ndarray]:
    """Contacts with walls: gid, wall (its row), fs, extra (side), of the particles that are kept. Collective."""
    t = frame.tables["wall_contacts"].columns
    found = discs.of(np.asarray(t.get("id1", ()), np.int64))
    if not len(found):
        return {"gid": np.empty(0, np.int64), "wall": np.empty(0, np.int64), "fs": np.empty(0), "extra": np.empty(0)}
    row = rows[t["wall"]]
    here = (found[:, 3] > 0.0) & (row >= 0)
    centre = found[here, :2]
    p1, p2 = (np.asarray(frame.walls[name], float)[t["wall"][here]] for name in ("p1", "p2"))
    edge = p2 - p1
    share = np.clip(((centre - p1) * edge).sum(axis=1) / (edge * edge).sum(axis=1), 0.0, 1.0)
    to = p1 + share[:, None] * edge - centre  # from the particle to the wall, unless its centre is behind it
    left = np.where(edge[:, 0] * (centre - p1)[:, 1] - edge[:, 1] * (centre - p1)[:, 0] >= 0.0, 1.0, -1.0)
    on_face = (share > 0.0) & (share < 1.0)
    fx, fy = (t[name][here] if name in t else np.zeros(len(centre)) for name in ("fx", "fy"))
    behind = fx * to[:, 0] + fy * to[:, 1] > 0.0  # the wall pushes it back to the side it came from
    to[behind], left[behind] = -to[behind], -left[behind]
    along = fy * to[:, 0] - fx * to[:, 1]
    return {
        "gid": t["id1"][here].astype(np.int64), "wall": row[here],
        "fs": np.copysign(np.abs(np.nan_to_num(t["fs"][here])), along), "extra": np.where(on_face, left, 0.0),
    }  # fmt: skip


def _report(sim: Simulation, path: Path | str, p: dict[str, Any], number: int, unknown: int) -> None:
    if sim.log is None:
        return
    lacking = [name for name in ("vx", "mass", "fric", "damp") if name not in p]
    more = f"; the file has no {', '.join(lacking)}" if lacking else ""
    sim.log.info(
        f"LOAD: {path} is a frame: {number} particles, {len(sim.walls)} walls and {sim.bonds} bonds of step "
        f"{sim.clock.step}, with velocities, properties, time step and gravity{more}"
    )
    if unknown:
        sim.log.warn(
            f"{path} does not contain the strength of {unknown} of its bonds (frames of ZDEM have n_bond and s_bond "
            "only), so these are omitted. Create them with PROP and bond keys"
        )

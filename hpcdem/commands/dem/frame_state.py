"""LOAD of a frame: the state of a model as far as a file all_<step>.dat of ZDEM or hpcdem holds it.

Taken over are particles with ids, velocities, properties, fixed directions, colours and groups; walls; shear forces of
contacts; bonds; stored forces; time step, gravity, mass rule, step and time. A text has fewer digits than a checkpoint,
and says nothing of clumps, histories and the script: the run goes on near the old one, not with its bits.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.core.fields import BOX_IDS, FX, FY, TORQUE, sides_of_box
from hpcdem.io.agreed import on_first
from hpcdem.io.dat import read_dat
from hpcdem.io.frame import Frame
from hpcdem.physics.dem.kernels import laws, mass
from hpcdem.physics.dem.kernels.histories import Histories
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.dem.walls import OLD_SIDES

PROPERTIES = ("density", "fric", "shear", "poiss", "damp", "kn", "ks", "hertz")


def load_frame(
    sim: Simulation, path: Path | str, x: tuple[float, float] | None = None, y: tuple[float, float] | None = None
) -> int:
    """A new model from a frame; x, y: keep only centres in these ranges [m]. Returns the number of particles.
    Collective."""
    try:
        frame = on_first(sim.comm, lambda: _checked(read_dat(path), str(path)))
    except HpcdemError as problem:
        raise CommandError(str(problem)) from None
    p = frame.tables["particles"].columns
    keep = np.ones(len(p["gid"]), bool)
    for bounds, values in ((x, p["x"]), (y, p["y"])):
        if bounds is not None:
            keep &= (values >= bounds[0]) & (values < bounds[1])
    if not keep.any():
        raise CommandError(f"none of the {len(keep)} particles of {path} lies within the bounds of x and y")
    p = {name: values[keep] for name, values in p.items()}
    sim.clear()
    _take_settings(sim, frame)
    rows = _take_walls(sim, frame)
    material = _materials(sim, frame, p)
    groups = np.array([sim.group_number(name) for name in frame.group_names], np.int64)
    contacts, bonds, unknown = _links(sim, frame, p["gid"])
    at_walls = _wall_contacts(frame, rows, p)
    sim.next_gid = int(p["gid"].max()) + 1
    sim.note_maker(0)
    if sim.comm.rank == 0:
        optional = {name: p[name] for name in ("vx", "vy", "spin", "angle", "fix", "color") if name in p}
        sim.particles.append(
            x=p["x"], y=p["y"], radius=p["radius"], gid=p["gid"], group=groups[p["group"]], material=material,
            birth=frame.step, **optional,
        )  # fmt: skip
        for name, column in (("fx", FX), ("fy", FY), ("torque", TORQUE)):
            if name in p:
                sim.particles.cold[:, column] = p[name]
        sim.hist = _histories(p["gid"], contacts, at_walls)
    sim.bonds = bonds
    longest = contacts["length"][contacts["bond"] > 0]
    sim._longest2 = float(np.max(longest, initial=0.0)) ** 2
    sim.ownership.wanted = True
    sim.look_soon()
    _tell(sim, path, p, bonds, unknown)
    return len(p["gid"])


def _checked(frame: Frame, path: str) -> Frame:
    """The frame, if a model can be made of it."""
    p = frame.tables["particles"].columns
    if not len(p.get("gid", ())):
        raise HpcdemError(f"{path}: holds no particles")
    for name in ("x", "y", "radius"):
        if name not in p:
            raise HpcdemError(f"{path}: its particles have no {name}")
    whole = np.isfinite(p["x"]) & np.isfinite(p["y"]) & np.isfinite(p["radius"]) & (p["radius"] > 0.0)
    if not whole.all():
        raise HpcdemError(f"{path}: particle {p['gid'][~whole][0]} has no place or size")
    for name in ("vx", "vy", "spin", "angle", "fx", "fy", "torque"):
        if name in p and not np.isfinite(p[name]).all():
            if name in ("vx", "vy", "spin"):
                raise HpcdemError(f"{path}: {name} of particle {p['gid'][~np.isfinite(p[name])][0]} is not a number")
            p[name] = np.zeros(len(p["gid"]))
    gid = p["gid"]
    if (gid < 0).any() or len(np.unique(gid)) < len(gid):
        raise HpcdemError(f"{path}: ids of particles must not be negative, and each can stand there once")
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


def _materials(sim: Simulation, frame: Frame, p: dict[str, np.ndarray]) -> np.ndarray:
    """Row of the material table (n,) of each particle."""
    n = len(p["gid"])
    columns = {name: np.nan_to_num(np.asarray(p.get(name, np.zeros(n)), float)) for name in PROPERTIES}
    if "density" not in p and "mass" in p:
        columns["density"] = p["mass"] / mass.volume(p["radius"], sim.settings.disk)
    for axis in "xy":
        push = p.get(f"push_{axis}", np.zeros(n))
        columns[f"{axis}p"] = push / (2.0 * p["radius"] * sim.settings.thickness)
    names = list(columns)
    distinct, row_of = np.unique(np.stack([columns[name] for name in names], axis=1), axis=0, return_inverse=True)
    rows = [sim.materials.row(**dict(zip(names, values))) for values in distinct.tolist()]
    return np.array(rows, np.int64)[row_of.reshape(-1)]


def _links(sim: Simulation, frame: Frame, gid: np.ndarray) -> tuple[dict[str, np.ndarray], int, int]:
    """Pairs that remember something, each once: gid, partner, fs, extra, bond, length; how many are bonded; how many
    bonds of the frame have no strength in it, and are left out."""
    parts: list[dict[str, np.ndarray]] = []
    unknown = 0
    place = {name: np.asarray(frame.tables["particles"].columns[name], float) for name in ("x", "y", "radius")}
    all_ids = frame.tables["particles"].columns["gid"]
    for name in ("bonds", "contacts"):
        table = frame.tables[name].columns
        if not len(table.get("id1", ())):
            continue
        here = np.isin(table["id1"], gid) & np.isin(table["id2"], gid)
        t = {key: np.asarray(values)[here] for key, values in table.items()}
        kind = np.zeros(len(t["id1"]), np.int64)
        if name == "bonds":
            kind, lost = _bond_types(sim, t)
            unknown += lost
        a, b = (np.searchsorted(all_ids, t[key]) for key in ("id1", "id2"))
        dx, dy = place["x"][b] - place["x"][a], place["y"][b] - place["y"][a]
        length = np.hypot(dx, dy)
        overlap = place["radius"][a] + place["radius"][b] - length
        # The sign of the shear force from the force on id1: fx = s tx - fn nx with t = (-ny, nx).
        along = (t["fy"] * dx - t["fx"] * dy) if {"fx", "fy"} <= t.keys() else t["fs"]
        two_rt = 4.0 * place["radius"][a] * place["radius"][b] / (place["radius"][a] + place["radius"][b])
        parts.append({
            "gid": t["id1"].astype(np.int64), "partner": t["id2"].astype(np.int64),
            "fs": np.copysign(np.abs(np.nan_to_num(t["fs"])), along), "bond": kind, "length": length,
            "extra": np.where(kind > 0, np.maximum(overlap, 0.5e-3 * two_rt), 0.0),
        })  # fmt: skip
    if not parts:
        empty, whole = np.empty(0), np.empty(0, np.int64)
        return {"gid": whole, "partner": whole, "fs": empty, "bond": whole, "length": empty, "extra": empty}, 0, 0
    both = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    low, high = np.minimum(both["gid"], both["partner"]), np.maximum(both["gid"], both["partner"])
    both |= {"gid": low, "partner": high}
    # A bonded pair that touches stands in both tables: bonds come first, and the first one counts.
    _, first = np.unique(np.stack([low, high], axis=1), axis=0, return_index=True)
    both = {key: values[first] for key, values in both.items()}
    return both, int((both["bond"] > 0).sum()), unknown


def _bond_types(sim: Simulation, t: dict[str, np.ndarray]) -> tuple[np.ndarray, int]:
    """Row of the bond types (m,), 0 where the frame does not say how strong the bond is; how many these are."""
    n = len(t["id1"])
    if "kind" in t:
        names = ("kind", "ebmod", "gbmod", "tstrength", "sstrength")
        columns = {name: np.nan_to_num(np.asarray(t.get(name, np.zeros(n)), float)) for name in names}
    else:  # of ZDEM: forces at which the bond breaks, as of a contact bond
        columns = {"kind": np.full(n, float(laws.CONTACT_BOND))}
        columns |= {name: np.nan_to_num(t.get(word, np.zeros(n))) for name, word in _FORCES.items()}
        columns["kind"][(columns["tstrength"] <= 0.0) & (columns["sstrength"] <= 0.0)] = 0.0
    columns["rubber"] = np.nan_to_num(np.asarray(t.get("rubber", np.zeros(n)), float))
    distinct, row_of = np.unique(np.stack([*columns.values()], axis=1), axis=0, return_inverse=True)
    rows = [sim.bond_types.row(**dict(zip(columns, v))) if v[0] > 0.0 else 0 for v in distinct.tolist()]
    found = np.array(rows, np.int64)[row_of.reshape(-1)] if n else np.empty(0, np.int64)
    return found, int((found == 0).sum())


_FORCES = {"tstrength": "n_bond", "sstrength": "s_bond"}


def _wall_contacts(frame: Frame, rows: np.ndarray, p: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Contacts with walls: gid, partner (-1 - row), fs, extra (side), of the particles that are kept."""
    t = frame.tables["wall_contacts"].columns
    if not len(t.get("id1", ())):
        return {"gid": np.empty(0, np.int64), "partner": np.empty(0, np.int64), "fs": np.empty(0), "extra": np.empty(0)}
    row = rows[t["wall"]]
    here = np.isin(t["id1"], p["gid"]) & (row >= 0)
    at = np.searchsorted(p["gid"], t["id1"][here])
    centre = np.stack([p["x"], p["y"]], axis=1)[at]
    p1, p2 = (np.asarray(frame.walls[name], float)[t["wall"][here]] for name in ("p1", "p2"))
    edge = p2 - p1
    share = np.clip(((centre - p1) * edge).sum(axis=1) / (edge * edge).sum(axis=1), 0.0, 1.0)
    to = p1 + share[:, None] * edge - centre  # from the particle to the wall, unless its centre is behind it
    left = np.where(edge[:, 0] * (centre - p1)[:, 1] - edge[:, 1] * (centre - p1)[:, 0] >= 0.0, 1.0, -1.0)
    on_face = (share > 0.0) & (share < 1.0)
    fx, fy = (t[name][here] if name in t else np.zeros(len(at)) for name in ("fx", "fy"))
    behind = fx * to[:, 0] + fy * to[:, 1] > 0.0  # the wall pushes it back to the side it came from
    to[behind], left[behind] = -to[behind], -left[behind]
    along = fy * to[:, 0] - fx * to[:, 1]
    return {
        "gid": t["id1"][here].astype(np.int64), "partner": -1 - row[here],
        "fs": np.copysign(np.abs(np.nan_to_num(t["fs"][here])), along), "extra": np.where(on_face, left, 0.0),
    }  # fmt: skip


def _histories(gid: np.ndarray, pairs: dict[str, np.ndarray], walls: dict[str, np.ndarray]) -> Histories:
    """Entries of both partners of each pair, then of walls, by particle; gid (n,): ascending."""
    none = np.zeros(len(walls["gid"]), np.int64)
    owner = np.concatenate([pairs["gid"], pairs["partner"], walls["gid"]])
    partner = np.concatenate([pairs["partner"], pairs["gid"], walls["partner"]])
    fs, extra = (np.concatenate([pairs[k], pairs[k], walls[k]]) for k in ("fs", "extra"))
    bond = np.concatenate([pairs["bond"], pairs["bond"], none]).astype(np.int32)
    order = np.argsort(owner, kind="stable")
    ptr = np.searchsorted(owner[order], np.concatenate([gid, [np.iinfo(np.int64).max]])).astype(np.int64)
    return Histories.of_columns(ptr, partner[order], fs[order], extra[order], bond[order])


def _tell(sim: Simulation, path: Path | str, p: dict[str, Any], bonds: int, unknown: int) -> None:
    if sim.log is None:
        return
    lacking = [name for name in ("vx", "mass", "fric", "damp") if name not in p]
    more = f"; the file has no {', '.join(lacking)}" if lacking else ""
    sim.log.info(
        f"LOAD: {path} is a frame: {len(p['gid'])} particles, {len(sim.walls)} walls and {bonds} bonds of step "
        f"{sim.clock.step}, with velocities, properties, time step and gravity{more}"
    )
    if unknown:
        sim.log.warn(
            f"{path} does not say how strong {unknown} of its bonds are (frames of ZDEM have n_bond and s_bond only), "
            "so these are left out: PROP with bond keys makes them"
        )

"""START, LOAD, BALL, GEN, GLINE, DEL, EXP: who is there."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np

from hpcdem.commands.dem.frame_state import load_frame
from hpcdem.commands.dem.properties import chosen
from hpcdem.core import limits
from hpcdem.core.comm import Comm
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.core.fields import FIX_BITS
from hpcdem.core.selection import Selection
from hpcdem.io.dat import is_frame
from hpcdem.io.files import write_sections
from hpcdem.io.parts import read_lines, share
from hpcdem.numerics.rng import uniforms
from hpcdem.physics.dem import periodic
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.pre import packing
from hpcdem.pre.rows import row

NO_GROUP = "***"
STREAM = 2026
"""First of the two streams of random numbers of TWIN."""
FAILURES = 1000
"""Consecutive failed attempts after which GEN stops; derived from two published facts, see docs/physics.md."""


def start(sim: Simulation) -> None:
    """START: a new, empty model."""
    sim.clear()


def load(
    sim: Simulation,
    file: Path | str,
    scale: float = 1.0,
    x: tuple[float, float] | None = None,
    y: tuple[float, float] | None = None,
) -> int:
    """LOAD: make a new model from rows "x y r [group]" [m], or from a frame all_<step>.dat of ZDEM or hpcdem with its
    complete state (commands/dem/frame_state.py).

    Parameters
    ----------
    file : path of the file.
    scale : factor on all lengths, if the file has rows.
    x, y : load only centres in these ranges, (least, greatest), in the units of the file.

    Returns
    -------
    int : number of particles.
    """
    if sim.comm.bcast(is_frame(file) if sim.comm.rank == 0 else None):
        if scale != 1.0:
            raise CommandError(f"scale {scale:g} is for files of x y r; {file} is a frame, with stiffnesses and forces")
        return load_frame(sim, file, x, y)
    if not scale > 0.0:
        raise CommandError(f"scale must be positive, got {scale:g}")
    comm = sim.comm
    rows, names = _read_xyr(sim, Path(file))
    keep = np.ones(len(rows), bool)
    for bounds, column in ((x, rows[:, 0]), (y, rows[:, 1])):
        if bounds is not None:
            keep &= (column >= bounds[0]) & (column < bounds[1])
    of_file, rows, names = sim.count(len(rows)), rows[keep] * scale, names[keep]
    kept = sim.count(len(rows))
    if not kept:
        raise CommandError(f"none of the {of_file} particles of {file} lies within the bounds of x and y")
    check_circles(comm, rows)
    if sim.log is not None and kept < of_file:
        sim.log.info(f"LOAD: {kept} of {of_file} particles lie within the bounds")
    sim.clear()
    # Groups are numbered in the order of the file.
    mine, first, group = np.unique(names, return_index=True, return_inverse=True)
    in_order = np.argsort(first)
    for part in comm.allgather(mine[in_order].tolist()):
        for name in part:
            sim.group_number(name)
    numbers = np.array([sim.group_number(name) for name in mine.tolist()], np.int64)
    add_part(sim, rows, comm.exscan(len(rows)), kept, numbers[group.reshape(-1)], 0)
    return kept


def _read_xyr(sim: Simulation, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read this rank's share of a file of particles: rows x, y, r (n, 3), and groups (n,) str. Collective."""
    size, error = 0, None
    if sim.comm.rank == 0:
        try:
            with path.open("rb") as file:
                size = file.seek(0, os.SEEK_END)
        except OSError as problem:
            error = f"cannot read {path}: {problem.strerror}"
    _agree(sim, error)
    try:
        text = read_lines(sim.comm, path, 0, sim.comm.bcast(size))
    except HpcdemError as problem:
        raise CommandError(str(problem)) from None
    lines = text.decode("utf-8", "replace").splitlines()
    rows: list[tuple[float, float, float]] = []
    groups: list[str] = []
    for number, line in enumerate(lines, sim.comm.exscan(len(lines)) + 1):
        words = line.split("#")[0].split()
        if not words:
            continue
        try:
            x, y, r = map(float, words[:3])
            if len(words) > 4 or "_" in "".join(words[:3]) or not np.isfinite([x, y, r]).all() or r <= 0.0:
                raise ValueError
        except ValueError:
            shown = "".join(c if c.isprintable() else " " for c in line.strip()[:60])
            error = f"{path}:{number}: read '{shown}', expected x y r [group] with r > 0"
            break
        rows.append((x, y, r))
        groups.append(words[3] if len(words) == 4 else NO_GROUP)
    _agree(sim, error)
    if not sim.count(len(rows)):
        raise CommandError(f"{path}: contains no particles, expected rows x y r [group]")
    return np.array(rows).reshape(-1, 3), np.array(groups, dtype=str)


def _agree(sim: Simulation, error: str | None) -> None:
    """Raise as CommandError on all ranks, so that the script line is named."""
    try:
        sim.comm.agree(error)
    except HpcdemError as problem:
        raise CommandError(str(problem)) from None


def ball(
    sim: Simulation, id: int | None, x: float, y: float, rad: float, color: int = 0, group: str = NO_GROUP
) -> None:
    """BALL: create one particle.

    Parameters
    ----------
    x, y : coordinates of the centre [m].
    rad : radius [m].
    id : id of the particle (default: the next free one).
    color, group : colour by name or number; name of the group.
    """
    limits.check_circle(x, y, rad)
    if id is not None:
        if id < 0:
            raise CommandError(f"id must not be negative, got {id}")
        if sim.comm.any(bool((sim.particles["gid"] == id).any())):
            raise CommandError(f"a particle with id {id} exists already")
        for number, land in sim.lands.items():
            if land.made_disc(id):
                raise CommandError(f"id {id} was that of a disc which SURFACE {number} deposited; choose another one")
    add(sim, np.array([[x, y, rad]]), sim.group_number(group), color, first_gid=id)


def gen(
    sim: Simulation,
    num: int,
    rad: list[float],
    x: tuple[float, float],
    y: tuple[float, float],
    color: int = 0,
    group: str = NO_GROUP,
) -> int:
    """GEN num: insert particles at random positions without overlap; across periodic boundaries too, if these bound x.

    Scripts request far more particles than fit. The command stops after FAILURES consecutive attempts without success
    or, with SET gentry, after that many attempts per requested particle.

    Parameters
    ----------
    num : number of particles requested.
    rad : radii, of which each particle gets one at random; a repeated one is more likely [m].
    x, y : bounds of the rectangle, (least, greatest) [m].
    color, group : colour by name or number; name of the group.

    Returns
    -------
    int : number of particles created.
    """
    limits.check_rectangle(rad, x, y, grid=False)
    limits.check_attempts(num, sim.settings.gentry)
    existing = _near(sim, rad, x, y)
    factor = sim.settings.gentry
    ends = {"attempts": max(int(factor * num), num)} if factor > 0.0 else {"in_a_row": FAILURES}
    around = periodic.spans(sim, x)
    rows, tried = packing.insert_randomly(
        num, np.array(rad), x, y, existing, sim.settings.seed, sim.streams, **ends, around=around
    )
    sim.streams += 1
    made = add(sim, rows, sim.group_number(group), color)
    if sim.log is not None:
        cover = float(np.pi * (rows[:, 2] ** 2).sum() / ((x[1] - x[0]) * (y[1] - y[0])))
        sim.log.info(
            f"GEN: {num} requested, {made} placed in {tried} attempts, {100.0 * cover:.1f} % of the area covered"
        )
    return made


def gen_grid(
    sim: Simulation,
    rad: list[float],
    x: tuple[float, float],
    y: tuple[float, float],
    idmin: int | None = None,
    color: int = 0,
    group: str = NO_GROUP,
) -> int:
    """GEN grid: create a particle at each node of a square lattice of spacing 2 max(rad).

    Parameters
    ----------
    rad : radii, of which each particle gets one at random; a repeated one is more likely [m].
    x, y : bounds of the rectangle, (least, greatest) [m].
    idmin : id of the first particle (default: the next free one).
    color, group : colour by name or number; name of the group.

    Returns
    -------
    int : number of particles created.
    """
    limits.check_rectangle(rad, x, y, grid=True)
    total = math.prod(packing.nodes(np.array(rad), x, y))
    first, end = share(total, sim.comm)
    rows = packing.lattice(np.array(rad), x, y, sim.settings.seed, sim.streams, first, end)
    sim.streams += 1
    if idmin is not None and idmin < sim.next_gid and sim.count(len(sim.particles)):
        raise CommandError(f"idmin {idmin}: ids below {sim.next_gid} are or were in use")
    return add_part(sim, rows, first, total, sim.group_number(group), color, first_gid=idmin)


def gline(
    sim: Simulation,
    p1: tuple[float, float],
    p2: tuple[float, float],
    rad: float,
    cratio: float = 1.0,
    kn: float | None = None,
    ks: float | None = None,
    fric: float | None = None,
    color: int = 0,
    group: str = NO_GROUP,
) -> int:
    """GLINE: create a row of particles from p1 towards p2 with spacing 2 rad cratio; overlaps are not checked.

    Parameters
    ----------
    p1, p2 : end points, (x, y) [m].
    rad : radius [m].
    cratio : distance of neighbouring centres over the sum of their radii.
    kn, ks, fric : normal and shear stiffness [N/m] and friction coefficient.
    color, group : colour by name or number; name of the group.

    Returns
    -------
    int : number of particles created.
    """
    limits.check_row(p1, p2, rad, cratio)
    centres = row(p1, p2, rad, cratio)
    material = {name: v for name, v in (("kn", kn), ("ks", ks), ("fric", fric)) if v is not None}
    rows = np.column_stack([centres, np.full(len(centres), rad)])
    sim.rows.append((sim.next_gid, sim.next_gid + len(rows)))
    return add(sim, rows, sim.group_number(group), color, material=sim.materials.row(**material))


def delete(sim: Simulation, where: Selection | None = None) -> int:
    """DEL: remove particles with their contacts and bonds, and return their number. Their ids are not reused."""
    which = chosen(sim, where)
    if not sim.comm.any(bool(which.any())):
        return 0
    sim.open_model()
    return sim.remove(chosen(sim, where))


def twin(sim: Simulation, number: int, where: Selection | None = None) -> int:
    """TWIN: displace one free particle by 1e-5 of its radius, to compare runs that differ only by this displacement.

    Parameters
    ----------
    number : number of the twin; it determines the particle and the direction. 0 is the undisturbed model.
    where : particles from which one is drawn; members of clumps and particles fixed in x or y are excluded.

    Returns
    -------
    int : id of the particle; -1 for twin 0.

    Raises
    ------
    CommandError : if the selection contains no free particle.
    """
    which = chosen(sim, where) & (sim.particles["fix"] & (FIX_BITS["x"] | FIX_BITS["y"]) == 0)
    if sim.clumps:
        which &= sim.particles.clump < 0
    drawn = np.concatenate(sim.comm.allgather(sim.particles["gid"][which]))
    if not len(drawn):
        raise CommandError("none of the selected particles is free to move")
    if number == 0:
        return -1
    gid = int(drawn[uniforms(number, STREAM, drawn).argmin()])
    angle = 2.0 * math.pi * float(uniforms(number, STREAM + 1, np.array([gid]))[0])
    sim.open_model()
    p = sim.particles
    one = np.flatnonzero(p["gid"] == gid)
    for name, part in (("x", math.cos(angle)), ("y", math.sin(angle))):
        p[name][one] += 1e-5 * p["radius"][one] * part
    sim.ownership.wanted = True
    sim.check_soon()
    return gid


def export(sim: Simulation, file: Path | str, group: bool = False, where: Selection | None = None) -> None:
    """EXP: write rows "x y r [group]" in the order of ids, with 13 significant digits.

    Parameters
    ----------
    file : path of the file.
    group : bool: write the names of groups as a fourth column.
    where : particles to write (default: all).
    """
    p = sim.particles
    which = chosen(sim, where)
    mine = (
        np.column_stack([p["gid"][which], p["group"][which]]),
        np.column_stack([p["x"][which], p["y"][which], p["radius"][which]]),
    )
    parts = sim.comm.gather(mine)
    text = ""
    if parts is not None:
        ints, reals = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
        order = np.argsort(ints[:, 0])
        lines = []
        for (_, of), (x, y, r) in zip(ints[order], reals[order], strict=True):
            lines.append(f"{x:.12e}   {y:.12e}   {r:.12e}" + (f"   {sim.groups[of]}" if group else ""))
        text = "\n".join(lines) + "\n"
    write_sections(file, sim.comm, lambda: [text.encode()])


def check_circles(comm: Comm, rows: np.ndarray) -> None:
    """Check (n, 3) rows x, y, r of all ranks with limits.check_circle. Collective."""

    def worst(of: np.ndarray) -> np.ndarray:
        if not len(of):
            return of
        size = np.abs(of[:, :2]).max(axis=1) / of[:, 2]
        return of[[size.argmax(), of[:, 2].argmin(), of[:, 2].argmax()]]

    for circle in worst(np.concatenate(comm.allgather(worst(rows)))):
        limits.check_circle(*circle)


def _near(sim: Simulation, radii: list[float], x: tuple[float, float], y: tuple[float, float]) -> np.ndarray:
    """(n, 3) [x, y, r] of the particles of all ranks that can touch one of these radii in this rectangle."""
    p = sim.particles
    largest = float(sim.comm.max_into(np.array([p["radius"].max(initial=0.0)]))[0])
    reach = max(largest, *radii) + max(radii)
    period = sim.settings.period
    places = periodic.places(sim)
    mine = []
    for at in (places - period, places, places + period) if period else (places,):
        near = (at > x[0] - reach) & (at < x[1] + reach) & (p["y"] > y[0] - reach) & (p["y"] < y[1] + reach)
        mine.append(np.column_stack([at[near], p["y"][near], p["radius"][near]]))
    return np.concatenate(sim.comm.allgather(np.concatenate(mine)))


def add(
    sim: Simulation,
    rows: np.ndarray,
    group: int,
    color: int,
    first_gid: int | None = None,
    material: int = 0,
) -> int:
    """Add particles from (n, 3) rows x, y, r [m], equal on all ranks. Each rank stores a share of them until the next
    cycle sends them to their owners.
    """
    first, end = share(len(rows), sim.comm)
    return add_part(sim, rows[first:end], first, len(rows), group, color, first_gid, material)


def add_part(
    sim: Simulation,
    rows: np.ndarray,
    before: int,
    total: int,
    group: np.ndarray | int,
    color: int,
    first_gid: int | None = None,
    material: int = 0,
) -> int:
    """Add rows of which each rank has its own part, beginning at row `before` of `total`. group: one for all rows or
    (n,) i8, one per row.
    """
    sim.open_model()
    if sim.settings.period:
        periodic.refuse_outside(sim, rows[:, 0], sim.settings.side, sim.settings.side + sim.settings.period)
    first = sim.next_gid if first_gid is None else first_gid
    sim.next_gid = max(sim.next_gid, first + total)
    sim.note_maker(first)
    if len(rows):
        sim.particles.append(
            x=rows[:, 0], y=rows[:, 1], radius=rows[:, 2], gid=first + before + np.arange(len(rows)), group=group,
            color=color, material=material, birth=sim.clock.step,
        )  # fmt: skip
        sim.hist = sim.hist.extended(len(rows))
    sim.ownership.wanted = True
    sim.check_soon()
    return total

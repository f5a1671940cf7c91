"""CLUMP: rigid bodies made of discs, from a file or of particles that are there."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from hpcdem.commands.dem.particles import NO_GROUP, add, check_circles
from hpcdem.commands.dem.properties import chosen
from hpcdem.core import limits
from hpcdem.core.errors import CommandError, HpcdemError
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
    MEMBERS,
    MOMENT,
    OFFSET_X,
    OFFSET_Y,
)
from hpcdem.core.selection import Selection
from hpcdem.io.agreed import on_first
from hpcdem.io.clumps import Clumps as File
from hpcdem.io.clumps import read_clumps
from hpcdem.physics.dem.simulation import Simulation

MOST_MEMBERS = 10**5
"""Largest number of particles in a clump."""


def clump(
    sim: Simulation,
    file: Path | str,
    x: float = 0.0,
    y: float = 0.0,
    angle: float = 0.0,
    scale: float = 1.0,
    color: int = 0,
    group: str = NO_GROUP,
) -> int:
    """CLUMP file: create rigid bodies of discs from a clump file, scaled, rotated about the origin of the file, then
    translated.

    Mass and inertia are density times the area and polar second moment of area in the file.

    Parameters
    ----------
    file : path of the clump file.
    x, y : translation [m].
    angle : rotation angle, anticlockwise [rad].
    scale : factor on all lengths.
    color, group : colour by name or number; name of the group.

    Returns
    -------
    int : number of rigid bodies created.
    """
    _need_discs(sim)
    sim.prepare_kernels("clumps")
    try:
        bodies = on_first(sim.comm, lambda: read_clumps(file))
    except HpcdemError as problem:
        raise CommandError(str(problem)) from None
    if not (math.isfinite(scale) and scale > 0.0):
        raise CommandError(f"scale must be positive, got {scale:g}")
    for name, value in (("x", x), ("y", y), ("angle", angle)):
        if not math.isfinite(value):
            raise CommandError(f"{name} must be a finite number, got {value:g}")
    rows, rigid = _members(bodies, x, y, angle, scale, sim.next_gid)
    check_circles(sim.comm, rows)
    first = sim.next_gid
    add(sim, rows, sim.group_number(group), color)
    p = sim.particles
    new = np.flatnonzero(p["gid"] >= first)
    mine = rigid[p["gid"][new] - first]
    sim.clumps.begin(p)[new] = mine
    p["angle"][new] = mine[:, CLUMP_ANGLE]
    sim.clumps.number += len(bodies)
    sim.clumps.reach = max(sim.clumps.reach, _reach(bodies) * scale)
    if sim.log is not None:
        sim.log.info(f"CLUMP: {len(bodies)} clumps, {len(rows)} discs in all")
    return len(bodies)


def _members(bodies: File, x: float, y: float, angle: float, scale: float, first: int) -> tuple[np.ndarray, np.ndarray]:
    """Discs as rows x, y, r (m, 3) [m], and their rows of clumps (m, 12), ids from `first` on."""
    c, s = math.cos(angle), math.sin(angle)
    sizes = np.diff(bodies.start)
    of = np.repeat(np.arange(len(bodies)), sizes)
    rigid = np.zeros((len(of), CLUMP_WIDTH))
    bits = rigid.view(np.int64)
    bits[:, CLUMP], bits[:, MEMBERS] = first + bodies.start[of], sizes[of]
    bx, by = scale * bodies.x, scale * bodies.y
    rigid[:, CLUMP_X], rigid[:, CLUMP_Y] = (bx * c - by * s + x)[of], (bx * s + by * c + y)[of]
    rigid[:, CLUMP_ANGLE] = (bodies.angle + angle)[of]
    rigid[:, AREA], rigid[:, MOMENT] = (scale**2 * bodies.area)[of], (scale**4 * bodies.inertia)[of]
    rigid[:, OFFSET_X], rigid[:, OFFSET_Y] = scale * bodies.dx, scale * bodies.dy
    # numpy's cos of a column takes another routine, rounded differently, if the result happens to lie beside it.
    turned = np.array([(math.cos(a), math.sin(a)) for a in (bodies.angle + angle).tolist()]).reshape(-1, 2)[of]
    dx, dy = rigid[:, OFFSET_X], rigid[:, OFFSET_Y]
    px = rigid[:, CLUMP_X] + (dx * turned[:, 0] - dy * turned[:, 1])
    py = rigid[:, CLUMP_Y] + (dx * turned[:, 1] + dy * turned[:, 0])
    return np.column_stack([px, py, scale * bodies.r]), rigid


def _reach(bodies: File) -> float:
    """Largest distance between the centres of two discs of a body [m]."""
    return max(
        widest(bodies.dx[a:b], bodies.dy[a:b]) for a, b in zip(bodies.start[:-1].tolist(), bodies.start[1:].tolist())
    )


def widest(x: np.ndarray, y: np.ndarray) -> float:
    """Return the largest distance between two of these points [m]; of many points an upper bound, too large by less
    than a tenth.
    """
    if len(x) <= 256:
        return float(np.hypot(x[:, None] - x, y[:, None] - y).max())
    turns = np.linspace(0.0, math.pi, 8, endpoint=False)
    spans = np.ptp(np.outer(np.cos(turns), x) + np.outer(np.sin(turns), y), axis=1)
    return float(spans.max() / math.cos(math.pi / 16))


def join(sim: Simulation, where: Selection | None = None, group: str | None = None, color: int | None = None) -> int:
    """CLUMP RANGE: join the selected particles into one clump and return their number.

    Area and polar second moment of area are the sums of those of the discs, overlaps counted twice; the clump keeps the
    momentum and angular momentum of the particles. Raises CommandError if the particles are bonded to each other or
    differ in density, damping or fixed directions.
    """
    _need_discs(sim)
    sim.prepare_kernels("clumps")
    sim.open_model()
    p = sim.particles
    which = chosen(sim, where)
    mine = tuple(p[name][which].copy() for name in ("gid", "x", "y", "radius", "vx", "vy", "spin", "material", "fix"))
    parts = sim.comm.allgather((*mine, p.clump[which].copy()))
    gid, x, y, r, vx, vy, spin, material, fix, clump_of = (np.concatenate(column) for column in zip(*parts))
    if len(gid) < 2:
        raise CommandError(f"a clump is made of two particles or more, RANGE has {len(gid)}")
    if len(gid) > MOST_MEMBERS:
        raise CommandError(f"{len(gid)} particles are too many for one clump, at most {MOST_MEMBERS}")
    if (clump_of >= 0).any():
        raise CommandError(f"particle {gid[clump_of >= 0].min()} belongs to a clump already")
    for name, values in (("density", sim.materials.rows["density"]), ("damp", sim.materials.rows["damp"])):
        found = np.unique(values[material])
        if len(found) > 1:
            raise CommandError(f"the particles of a clump need one {name}, these have {found[0]:g} and {found[-1]:g}")
    if len(np.unique(fix)) > 1:
        raise CommandError("some of the particles are fixed (FIX) and others are not; a clump is fixed as a whole")
    of = np.repeat(p["gid"], sim.hist.counts())
    between = np.isin(of, gid) & np.isin(sim.hist.partner, gid)
    if sim.comm.any(bool((sim.hist.bond[between] != 0).any())):
        raise CommandError("some of these particles are bonded: remove the bonds with BOND break")
    order = np.argsort(gid)
    gid, x, y, r, vx, vy, spin = (v[order] for v in (gid, x, y, r, vx, vy, spin))
    row = _joined(x, y, r, vx, vy, spin)
    row.view(np.int64)[[CLUMP, MEMBERS]] = gid[0], len(gid)
    sim.hist = sim.hist.keep(~between)
    rigid, members = sim.clumps.begin(p), np.flatnonzero(which)
    rigid[members] = row
    rigid[members, OFFSET_X] = p["x"][members] - row[CLUMP_X]
    rigid[members, OFFSET_Y] = p["y"][members] - row[CLUMP_Y]
    p["angle"][members] = 0.0
    sim.clumps.set_motion(p, which)
    sim.clumps.number += 1
    sim.clumps.reach = max(sim.clumps.reach, widest(x, y))
    if group is not None:
        p["group"][members] = sim.group_number(group)
    if color is not None:
        p["color"][members] = color
    sim.ownership.wanted = True
    sim.check_soon()
    return len(gid)


def _joined(
    x: np.ndarray, y: np.ndarray, r: np.ndarray, vx: np.ndarray, vy: np.ndarray, spin: np.ndarray
) -> np.ndarray:
    """The row of a clump of these discs of one density: centre, velocity and spin of all, area and moment."""
    area = math.pi * r * r
    total = math.fsum(area)

    def mean(values: np.ndarray) -> float:
        return math.fsum(area * values) / total

    row = np.zeros(CLUMP_WIDTH)
    cx, cy, u, v = mean(x), mean(y), mean(vx), mean(vy)
    own = 0.5 * r * r
    moment = math.fsum(area * (own + (x - cx) ** 2 + (y - cy) ** 2))
    turning = math.fsum(area * (own * spin + (x - cx) * (vy - v) - (y - cy) * (vx - u)))
    row[[CLUMP_X, CLUMP_Y, CLUMP_VX, CLUMP_VY, CLUMP_SPIN]] = cx, cy, u, v, turning / moment
    row[[AREA, MOMENT]] = total, moment
    limits.check_circle(cx, cy, math.sqrt(total / math.pi))
    return row


def _need_discs(sim: Simulation) -> None:
    if sim.settings.period:
        raise CommandError("clumps do not support periodic sides (PERIODIC)")
    if sim.settings.disk != "on":
        raise CommandError(
            f"the mass of a clump is density times area, so clumps need SET disk on; it is {sim.settings.disk}"
        )

"""WALL and BOX."""

from __future__ import annotations

import math

import numpy as np

from hpcdem.core import limits
from hpcdem.core.errors import CommandError
from hpcdem.physics.dem import periodic as periodic_sides
from hpcdem.physics.dem.simulation import Simulation


def wall(
    sim: Simulation,
    id: int,
    nodes: tuple[tuple[float, float], tuple[float, float]] | None = None,
    kn: float | None = None,
    ks: float | None = None,
    fric: float | None = None,
    color: int | None = None,
    xv: float | None = None,
    yv: float | None = None,
    delete: bool = False,
) -> None:
    """WALL: make a wall from node to node, or change or delete the wall with this id; omitted properties keep their
    values.

    Parameters
    ----------
    id : id of the wall.
    nodes : end points, ((x, y), (x, y)) [m]; both sides act, unless set(wallside="left").
    kn, ks, fric : normal and shear stiffness [N/m], for particles of the linear law, and friction coefficient.
    color : colour by name or number.
    xv, yv : velocity [m/s]; it holds until it is changed.
    delete : bool: remove the wall with its contacts; accepts only id.
    """
    if id < 0:
        raise CommandError(f"wall id must not be negative, got {id}")
    if sim.walls.find(id) is not None:
        _leave_bending(sim, id, nodes is not None or bool(xv) or bool(yv) or delete)
    if delete:
        if any(given is not None for given in (nodes, kn, ks, fric, color, xv, yv)):
            raise CommandError(f"wall {id}: delete accepts only the id")
        _delete(sim, id)
        return
    if nodes is not None:
        _place(sim, id, nodes)
        _continue_around(sim)
    at = sim.walls.parts(id)
    for name, value in (("kn", kn), ("ks", ks), ("fric", fric)):
        if value is not None and value < 0.0:
            raise CommandError(f"{name} must not be negative, got {value:g}")
    _set(sim, at, kn, ks, fric)
    if color is not None:
        sim.walls.color[at] = color
    for axis, value in enumerate((xv, yv)):
        if value is not None:
            sim.walls.v[at, axis] = value
    sim.check_soon()


def box(
    sim: Simulation,
    left: float,
    right: float,
    bottom: float,
    height: float,
    kn: float = 0.0,
    ks: float = 0.0,
    fric: float = 0.0,
) -> None:
    """BOX: make four walls around the model; particles that leave the box are deleted.

    Parameters
    ----------
    left, right, bottom, height : left, right and bottom coordinate and height above the bottom [m].
    kn, ks, fric : normal and shear stiffness [N/m] and friction coefficient of the walls.
    """
    if right <= left or height <= 0.0:
        raise CommandError(f"BOX is empty: left {left:g}, right {right:g}, height {height:g}")
    if sim.settings.period:
        raise CommandError("BOX has walls at its left and right side: it must precede PERIODIC, which removes them")
    top = bottom + height
    corners = {
        "left": ((left, top), (left, bottom)),
        "right": ((right, bottom), (right, top)),
        "bottom": ((left, bottom), (right, bottom)),
        "top": ((right, top), (left, top)),
    }  # inside lies to the left of P1 -> P2
    for side, nodes in corners.items():
        limits.check_nodes(*nodes, name=f"the {side} side of the BOX")
    for side, (p1, p2) in corners.items():
        forget(sim, sim.walls.of_side(side))
        _set(sim, sim.walls.put_side(side, p1, p2), kn, ks, fric)


def _leave_bending(sim: Simulation, id: int, moves: bool) -> None:
    """CommandError for a segment of a wall, and for a wall that a plate bends, where the command would move it."""
    sim.walls.parts(id)
    if moves and any(base.wall == id for base in sim.bases):
        raise CommandError(
            f"wall {id} bends on an elastic plate, which alone can move it; end it with FLEXURE off first"
        )


def _place(sim: Simulation, id: int, nodes: tuple[tuple[float, float], tuple[float, float]]) -> None:
    """Make a wall between two nodes, or replace the one with this id."""
    if not np.isfinite(nodes).all():
        raise CommandError(f"nodes of wall {id} must be finite numbers, got {nodes}")
    limits.check_nodes(*nodes, name=f"wall {id}")
    before = sim.walls.find(id)
    if before is not None and sim.walls.side[before]:
        raise CommandError(f"wall {id} is a side of BOX, and only BOX can move it; choose another id")
    if before is not None:
        _remove(sim, sim.walls.parts(id)[1:])
    forget(sim, sim.walls.find(id))
    sim.walls.put(id, *nodes, one_sided=sim.settings.wallside == "left")


def periodic(sim: Simulation, x: tuple[float, float] | None = None, xv: float | None = None) -> None:
    """PERIODIC: make x = left and x = right periodic sides: particles that leave through one enter through the other,
    and are in contact across them. Horizontal walls that span both continue without an end; BOX loses its left and
    right walls. The right side can move.

    Parameters
    ----------
    x : coordinates of the sides, (left, right) [m]; those of BOX, if there is one (default: sides that are periodic
        already).
    xv : velocity of the right side relative to the left one [m/s], negative to shorten; 0 ends it. The strain rate is
        xv / (right - left): particles that are not fixed along x get the velocities of a homogeneous strain, and those
        that pass the sides change their velocity by xv (default: unchanged).
    """
    if xv is not None and not math.isfinite(xv):
        raise CommandError(f"xv must be a finite number, got {xv:g}")
    if x is not None:
        _make_periodic(sim, x)
    elif xv is None or not sim.settings.period:
        raise CommandError("give x, the left and the right side, before or with xv")
    if xv is not None:
        sim.open_model()
        periodic_sides.strain(sim, xv)
        sim.check_soon()


def _make_periodic(sim: Simulation, x: tuple[float, float]) -> None:
    left, right = x
    limits.check_nodes((left, 0.0), (right, 0.0), name="PERIODIC")
    if not left < right:
        raise CommandError(f"left must be below right, got {left:g} and {right:g}")
    if sim.settings.period:
        raise CommandError("the sides of this model are periodic already")
    if sim.clumps:
        raise CommandError(f"PERIODIC does not support clumps, and there are {sim.clumps.number}")
    if sim.bases:
        raise CommandError(f"PERIODIC does not support FLEXURE, and {sim.bases[0].name} bends; end it with off first")
    if sim.coupled:
        raise CommandError("PERIODIC does not support particles that are coupled to blocks")
    box = sim.walls.box()
    if box is not None and box[:2] != (left, right):
        raise CommandError(f"x must be the sides of BOX, {box[0]:g} and {box[1]:g} m, got {left:g} and {right:g}")
    sim.open_model()
    periodic_sides.refuse_outside(sim, sim.particles["x"], left, right)
    for side in ("left", "right") if box is not None else ():
        row = sim.walls.of_side(side)
        assert row is not None
        _remove_whole(sim, int(sim.walls.id[row]))
    sim.settings.side, sim.settings.period = periodic_sides.rounded_sides(left, right)
    periodic_sides.begin(sim)
    _continue_around(sim)
    sim.check_soon()


def _continue_around(sim: Simulation) -> None:
    """Horizontal walls that span both periodic sides have no end."""
    if not sim.settings.period:
        return
    w, left, rounding = sim.walls, sim.settings.side, periodic_sides.unit(sim)
    low, high = np.minimum(w.p1[:, 0], w.p2[:, 0]), np.maximum(w.p1[:, 0], w.p2[:, 0])
    w.around |= (w.p1[:, 1] == w.p2[:, 1]) & (low <= left + rounding) & (high >= left + sim.settings.period - rounding)


def _delete(sim: Simulation, id: int) -> None:
    """Remove a wall. CommandError for a side of BOX and for a wall that a HIST follows."""
    row = sim.walls.row(id)
    if sim.walls.side[row]:
        raise CommandError(f"wall {id} is a side of BOX, which cannot be deleted")
    _remove_whole(sim, id)


def _remove_whole(sim: Simulation, id: int) -> None:
    """Remove a wall with all of its segments. CommandError for one that a HIST follows."""
    for number, (_, what) in sim.history_requests.items():
        name, *of = what.split()
        if of[:1] == ["wall"] and str(id) in of[1].split("|"):
            raise CommandError(f"wall {id} cannot be deleted: HIST {number} records its {name}")
    _remove(sim, sim.walls.parts(id))
    sim.tables_changed()
    sim.check_soon()


def _remove(sim: Simulation, rows: np.ndarray) -> None:
    """Take walls out of the table, with their contacts."""
    for row in rows[::-1].tolist():
        forget(sim, row)
        partner = sim.hist.partner
        partner[partner < -1 - row] += 1
        sim.walls.remove(row)


def forget(sim: Simulation, row: int | None) -> None:
    """Open the model for a new or replaced wall and discard contacts with the old one."""
    sim.open_model()
    if row is not None:
        sim.hist = sim.hist.keep(sim.hist.partner != -1 - row)


def _set(sim: Simulation, at: int | np.ndarray, kn: float | None, ks: float | None, fric: float | None) -> None:
    for name, value in (("kn", kn), ("ks", ks), ("fric", fric)):
        if value is not None:
            getattr(sim.walls, name)[at] = value
    sim.tables_changed()

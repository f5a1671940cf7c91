"""FLEXURE: a base that bends under its load like an elastic plate on a fluid (flexural isostasy)."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from hpcdem.commands.dem import output
from hpcdem.commands.dem.properties import chosen
from hpcdem.core.errors import CommandError
from hpcdem.core.fields import FIX_X, FIX_Y
from hpcdem.core.selection import Selection
from hpcdem.core.units import with_prefix
from hpcdem.engine.due import Task
from hpcdem.physics.dem.flexing_base import SAMPLES, SHORTEST, STEEP, Base
from hpcdem.physics.dem.flexure import ENDS, parameter, rigidity_of
from hpcdem.physics.dem.simulation import Simulation

COLUMNS = "step,time,base,x,deflection,equilibrium,load,moment"
FEWEST, FINE, COARSE, MOST = 50, 20.0, 4.0, 2000
"""Smallest number of segments of a base; default number per flexural parameter; smallest number per flexural parameter;
largest number of segments."""
STRAIGHT = 1e-6
"""Largest difference of heights of a straight base, over its length."""


def flexure(
    sim: Simulation,
    wall: int | None = None,
    where: Selection | None = None,
    *,
    rigidity: float | None = None,
    young: float | None = None,
    poisson: float = 0.25,
    te: float | None = None,
    contrast: float | None = None,
    x: tuple[float, float] | None = None,
    left: str = "infinite",
    right: str = "infinite",
    load: tuple[float, float] | None = None,
    compensated: bool = False,
    interval: int = 1000,
    relax: float = 0.5,
    speed: float | None = None,
    segments: int | None = None,
    off: bool = False,
) -> None:
    """FLEXURE: a horizontal wall, or a row of particles fixed in x and y, bends under the contact forces on it like an
    elastic plate on a fluid: rigidity w'''' + contrast g w = load.

    Parameters
    ----------
    wall : id of the wall, which becomes a polyline; or instead where: the particles of the row.
    rigidity : flexural rigidity [N m]; or instead young [Pa], poisson and te: Young's modulus, Poisson's ratio and
        elastic thickness [m].
    contrast : density of the fluid below minus density of the infill of the deflection, particles excluded [kg/m3].
    x : left and right end of the plate, if it is longer than the base [m].
    left, right : "infinite" (continues without load), "free" or "broken", "clamped" or "fixed".
    load : constant line load: x [m] and size, positive downwards [N/m].
    compensated : bool: the mean load of the first interval is in equilibrium with the undeformed base.
    interval : steps between two solutions of the plate: the base moves in the first half and rests in the second half.
    relax : fraction of the distance to equilibrium by which the base moves in an interval, 0 to 1.
    speed : largest speed of the base [m/s] (default: 1e-3 of the largest radius per step).
    segments : number of segments of the base (default: 20 per flexural parameter, at least 50).
    off : bool: end the flexure; the base keeps its present shape.
    """
    if (wall is None) == (where is None):
        raise CommandError("give either a wall or the particles of a row")
    if off:
        _off(sim, wall, where)
        return
    stiffness = _rigidity(rigidity, young, poisson, te)
    if contrast is None or not contrast > 0.0:
        raise CommandError(f"contrast must be above 0, got {contrast}: without it nothing restores the plate")
    gravity = -sim.settings.gy
    if not gravity > 0.0:
        raise CommandError("the plate needs gravity that points down; SET gravity must precede it")
    _check_coupling(interval, relax, speed)
    for name, end in (("left", left), ("right", right)):
        if end not in ENDS:
            raise CommandError(f"{name} must be {', '.join(ENDS)}, got {end}")
    row, first, last, level = _wall_extent(sim, wall) if wall is not None else _row_extent(sim, where)
    alpha = parameter(stiffness, contrast * gravity)
    number = _segments(last - first, alpha, segments)
    nodes = _nodes(first, last, number, x, alpha)
    if load is not None and not nodes[0] <= load[0] <= nodes[-1]:
        raise CommandError(f"the load at {load[0]:g} m lies outside the plate, {nodes[0]:g} to {nodes[-1]:g} m")
    base = Base(
        -1 if wall is None else wall, row, level, first, last, nodes, stiffness, contrast, ENDS[left], ENDS[right],
        (first, 0.0) if load is None else (float(load[0]), float(load[1])), compensated, int(interval), sim.clock.step,
        relax, speed or 0.0,
    )  # fmt: skip
    _check(sim, base)
    if wall is not None:
        _split(sim, base)
    sim.bases.append(base)
    if sim.log is not None:
        sim.log.info(
            f"FLEXURE: {base.name}, {first:g} to {last:g} m, on a plate from {nodes[0]:g} m ({base.left}) to "
            f"{nodes[-1]:g} m ({base.right}): flexural rigidity {stiffness:.4g} N m, flexural parameter "
            f"{with_prefix(alpha, 'm', system=sim.settings.units)}, {number} segments"
        )


def _check_coupling(interval: int, relax: float, speed: float | None) -> None:
    if not interval >= SHORTEST:
        raise CommandError(f"interval must be at least {SHORTEST} steps, got {interval}")
    for name, value, most in (("relax", relax, 1.0), ("speed", speed, math.inf)):
        if value is not None and not 0.0 < value <= most:
            upto = " and at most 1" if most == 1.0 else ""
            raise CommandError(f"{name} must be above 0{upto}, got {value:g}")


def _rigidity(rigidity: float | None, young: float | None, poisson: float, te: float | None) -> float:
    if (rigidity is None) == (young is None and te is None):
        raise CommandError("give either rigidity, or young and te")
    if rigidity is None:
        for name, value in (("young", young), ("te", te)):
            if value is None or not value > 0.0:
                raise CommandError(f"{name} must be above 0, got {value}")
        if not -1.0 < poisson < 0.5:
            raise CommandError(f"poisson must be above -1 and below 0.5, got {poisson:g}")
        assert young is not None and te is not None
        rigidity = rigidity_of(young, poisson, te)
    if not (rigidity > 0.0 and math.isfinite(rigidity)):
        raise CommandError(f"rigidity must be above 0, got {rigidity:g}")
    return rigidity


def _wall_extent(sim: Simulation, wall: int) -> tuple[np.ndarray, float, float, float]:
    """Return no particles, and left end, right end and height of a wall. CommandError if it cannot bend."""
    w, row = sim.walls, sim.walls.row(wall)
    if w.side[row]:
        raise CommandError(
            f"wall {wall} is a side of BOX, which cannot bend; create a WALL above it, as high as it may sink"
        )
    _refuse_twice(sim, wall, np.empty(0, np.int64))
    if len(w.parts(wall)) > 1:
        raise CommandError(f"wall {wall} has been bent and is no longer straight; create a new wall")
    (x1, y1), (x2, y2) = w.p1[row], w.p2[row]
    if abs(y1 - y2) > STRAIGHT * abs(x1 - x2):
        raise CommandError(
            f"wall {wall} from ({x1:g}, {y1:g}) to ({x2:g}, {y2:g}) is not horizontal, as the plate must be"
        )
    return np.empty(0, np.int64), float(min(x1, x2)), float(max(x1, x2)), float(y1)


def _row_extent(sim: Simulation, where: Selection | None) -> tuple[np.ndarray, float, float, float]:
    """Ids, ends and height of a row of particles. CommandError if it cannot bend. Collective."""
    p, which = sim.particles, chosen(sim, where)
    columns = (p[name][which].copy() for name in ("gid", "x", "y", "radius", "fix", "vx", "vy"))
    parts = sim.comm.allgather(tuple(columns))
    gid, x, y, radius, fix, vx, vy = (np.concatenate([part[k] for part in parts]) for k in range(7))
    if len(gid) < 2:
        raise CommandError(f"a row needs at least two particles; the selection contains {len(gid)}")
    order = np.argsort(gid)
    gid, x, y, radius, fix, vx, vy = (column[order] for column in (gid, x, y, radius, fix, vx, vy))
    free = gid[(fix & (FIX_X | FIX_Y)) != (FIX_X | FIX_Y)]
    if len(free):
        raise CommandError(f"{len(free)} particles of the row are not fixed in x and y, the first has id {free[0]}")
    moving = gid[(vx != 0.0) | (vy != 0.0)]
    if len(moving):
        raise CommandError(
            f"{len(moving)} particles of the row move already, the first has id {moving[0]}; the plate alone "
            "can move a row"
        )
    if np.ptp(y) > STRAIGHT * np.ptp(x):
        raise CommandError(f"the row is not horizontal: heights from {y.min():g} to {y.max():g} m")
    if sim.clumps and sim.comm.any(bool((p.clump[which] >= 0).any())):
        raise CommandError("the row contains members of clumps, which cannot move separately")
    _refuse_twice(sim, -1, gid)
    return gid, float((x - radius).min()), float((x + radius).max()), float(y[0])


def _refuse_twice(sim: Simulation, wall: int, row: np.ndarray) -> None:
    for base in sim.bases:
        if (wall >= 0 and base.wall == wall) or len(np.intersect1d(base.row, row)):
            raise CommandError(f"{base.name} bends already; end it with off first")


def _segments(length: float, alpha: float, wanted: int | None) -> int:
    number = max(FEWEST, math.ceil(FINE * length / alpha)) if wanted is None else wanted
    if not COARSE * length / alpha <= number <= MOST:
        raise CommandError(
            f"{number} segments of a base of {length:g} m; the flexural parameter of {alpha:g} m needs at "
            f"least {math.ceil(COARSE * length / alpha)}, and at most {MOST} are possible"
        )
    return number


def _nodes(first: float, last: float, number: int, x: tuple[float, float] | None, alpha: float) -> np.ndarray:
    """Nodes of the plate [m]: the ends of the segments of the base, and on both sides of it at similar distances."""
    start, end = (first, last) if x is None else (float(x[0]), float(x[1]))
    if not (start <= first and last <= end):
        raise CommandError(
            f"the plate from {start:g} to {end:g} m does not contain the base from {first:g} to {last:g} m"
        )
    size = max((last - first) / number, alpha / FINE)
    if end - start > MOST * size:
        raise CommandError(f"the plate of {end - start:g} m is too long for {MOST} nodes; use infinite ends")
    sides = (np.linspace(a, b, math.ceil((b - a) / size) + 1) for a, b in ((start, first), (last, end)))
    before, after = sides
    return np.concatenate([before[:-1], np.linspace(first, last, number + 1), after[1:]])


def _split(sim: Simulation, base: Base) -> None:
    """Make the wall a polyline; its contacts continue with the segments below them. Collective."""
    walls, row = sim.walls, sim.walls.row(base.wall)
    inner = base.x[base.nodes][1:-1]
    inner = inner if walls.p1[row, 0] < walls.p2[row, 0] else inner[::-1]
    sim.open_model()
    rows = walls.split(row, inner)
    hist = sim.hist
    owner = np.repeat(np.arange(len(sim.particles)), hist.counts())
    at = np.flatnonzero(hist.partner == -1 - row)
    ascending = rows if walls.p1[rows[0], 0] < walls.p2[rows[-1], 0] else rows[::-1]
    segment = np.searchsorted(np.sort(inner), sim.particles["x"][owner[at]], side="right")
    hist.partner[at] = -1 - ascending[segment]
    sim.tables_changed()
    sim.check_soon()


def _off(sim: Simulation, wall: int | None, where: Selection | None) -> None:
    if wall is not None:
        chosen_ones = [base for base in sim.bases if base.wall == wall]
    else:
        gids = np.concatenate(sim.comm.allgather(sim.particles["gid"][chosen(sim, where)].copy()))
        rows = [base for base in sim.bases if base.wall < 0]
        chosen_ones = [base for base in rows if len(np.intersect1d(base.row, gids)) or not base.exists(sim)]
    if not chosen_ones:
        raise CommandError(f"off: {f'wall {wall}' if wall is not None else 'the selected row'} does not bend")
    for base in chosen_ones:
        sim.bases.remove(base)
        base.halt(sim, ends=True)


def _check(sim: Simulation, base: Base) -> None:
    """CommandError for a model that the coupling does not support."""
    if sim.settings.period:
        raise CommandError("FLEXURE does not support periodic sides (PERIODIC)")
    if sim.coupled:
        raise CommandError("FLEXURE does not support models with blocks: their weight would not reach the plate")
    if base.wall >= 0:
        if sim.settings.energy > 0 or sim.energy is not None:
            raise CommandError(
                "the energy budget (SET energy) does not support a wall that bends by FLEXURE; use a row of fixed "
                "particles"
            )
        if sim.walls.v[sim.walls.parts(base.wall)].any():
            raise CommandError(f"wall {base.wall} has a velocity (WALL xv, yv); the plate of FLEXURE alone can move it")
    elif sim.own_laws:
        raise CommandError(
            "a row that FLEXURE bends does not support user laws, whose forces are not known; use a wall"
        )


# ---- while the particles step ----------------------------------------------------------------------------------------


def check(sim: Simulation) -> None:
    """Raise CommandError if the model no longer allows flexure since FLEXURE was given."""
    for base in sim.bases:
        _check(sim, base)
        base.plate(sim)


def tasks(sim: Simulation) -> list[Task]:
    """Return the periodic tasks of the bases: samples, solutions and halts."""
    found = []
    for base in sim.bases:
        every = max(1, (base.interval - base.motion) // SAMPLES)
        found.append(Task(base.interval, base.origin + base.motion, partial(_act, sim, base.halt)))
        found.append(Task(every, base.origin, partial(_sample, sim, base)))
        found.append(Task(base.interval, base.origin, partial(_exchange, sim, base)))
    return found


def _sample(sim: Simulation, base: Base, _: object) -> None:
    if base.rests(sim.clock.step):
        with sim.timers("flexure"):
            base.sample(sim)


def _act(sim: Simulation, act: Callable[[Simulation], None], _: object = None) -> None:
    """Change velocities of a base between two steps."""
    with sim.timers("flexure"):
        if sim.energy is not None:
            sim.energy.pause(sim)
        act(sim)
        sim.refresh_tables()
        if sim.energy is not None:
            sim.energy.begin(sim)


def _exchange(sim: Simulation, base: Base, _: object) -> None:
    if not base.samples:
        base.sample(sim)
    _act(sim, base.exchange)
    steepest = float(np.abs(base.shape[base.nodes, 1]).max())
    if steepest > STEEP and sim.log is not None:
        sim.log.warn_once(
            f"steep {base.label}",
            f"step {sim.clock.step}: the slope of {base.name} reaches {steepest:.2g}; the theory of plates is for "
            "small slopes",
        )


def write(sim: Simulation) -> None:
    """Rows of `flexure.csv`, one per node, and a line in the log. Collective."""
    step, rows = sim.clock.step, []
    for base in sim.bases:
        plate, now = base.plate(sim), base.now(step)
        numbers = (
            base.x, now[:, 0], base.goal[:, 0], plate.pressure(base.loads), plate.moment(base.goal, base.acting(plate)),
        )  # fmt: skip
        head = f"{step},{sim.clock.time!r},{base.label}"
        rows += [",".join([head, *map(repr, row)]) for row in np.stack(numbers, axis=1).tolist()]
        if sim.log is not None and sim.log.wants(step):
            deepest = int(np.argmax(now[:, 0]))
            shown = partial(with_prefix, system=sim.settings.units)
            sim.log.info(
                f"{base.name}: deflection {shown(float(now[deepest, 0]), 'm')} at x = {base.x[deepest]:g} m, in "
                f"equilibrium {shown(float(base.goal[:, 0].max()), 'm')}; load {shown(base.loads[:, ::2].sum(), 'N/m')}"
                f", restoring force {shown(plate.buoyancy(now), 'N/m')}"
            )
    if rows:
        output.append(sim, "flexure.csv", COLUMNS, rows)

"""Periodic sides in x: what leaves through one side enters through the other.

The columns beside a side are copied past the other one as ghosts, moved by the length L of the model (images), by any
number of ranks, of which one is its own neighbour. The kernels see neighbours as anywhere else, and a pair across the
sides is computed from both of them, as at the boundary of two ranks. L is a whole number of columns.

The sides, L and all positions near a side are multiples of one power of two, the spacing of floating-point numbers at
the farthest image. Then x + L and x - L are exact, both sides see the same distance, and their forces are opposite to
the last bit.

The right side can move relative to the left one, with the velocity V (widening): L = L0 + V t. An image past the right
side is then faster by V, one past the left side slower, and a particle that leaves through one side enters through the
other with its velocity changed by V: a homogeneous strain rate V / L of the medium of all images. Velocities near a
side are multiples of a power of two as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from hpcdem.core.cells import COLUMN, columns, keys
from hpcdem.core.errors import CommandError
from hpcdem.core.fields import FIX_X, VX, X

LAPS = "laps"
FIELDS = {LAPS: ("1", "crossings of the periodic sides to the right; x + laps * period is continuous", 0.0)}
FASTEST = 4096.0
FEWEST = 3
"""Smallest number of columns of cells: with fewer, a particle could meet another one on both sides."""


def spacing(left: float, length: float) -> float:
    """Return the power of two [m] of which the sides and the positions beside them are multiples."""
    return math.ulp(max(abs(left), abs(left + length)) + length)


def _rounded(x: Any, unit: float) -> Any:
    return np.rint(x / unit) * unit


def rounded_sides(left: float, right: float) -> tuple[float, float]:
    """Return the left side and the length [m] that models with these sides have."""
    for _ in range(2):  # the spacing may be that of a larger number afterwards
        unit = spacing(left, right - left)
        left, right = float(_rounded(left, unit)), float(_rounded(right, unit))
    return left, right - left


def unit(sim: Any) -> float:
    """Return the power of two [m] of which the length and the positions beside the sides are multiples."""
    s = sim.settings
    return spacing(s.side, s.period) * (2.0 if s.widening else 1.0)  # it may double from one step to the next


def speed_unit(widening: float) -> float:
    """Return the power of two [m/s] of which the velocity of the right side and velocities beside the sides are
    multiples: sums of both are exact for particles up to FASTEST times as fast as it."""
    return math.ulp(FASTEST * abs(widening))


def begin(sim: Any) -> None:
    """Prepare an open model for the periodic sides in its settings."""
    sim.particles.extend(FIELDS)
    _continue_walls(sim)
    sim.ownership.wanted = True


def _continue_walls(sim: Any) -> None:
    s = sim.settings
    sim.walls.far = s.side - s.period, s.side + 2.0 * s.period


def strain(sim: Any, velocity: float) -> None:
    """Let the right side move at this velocity [m/s] relative to the left one from now on. The velocities of particles
    that are not fixed along x change with their distance from the left side, as in a homogeneous strain."""
    s, p = sim.settings, sim.particles
    velocity = float(_rounded(velocity, speed_unit(velocity))) if velocity else 0.0
    change = (velocity - s.widening) / s.period
    free = (p["fix"] & FIX_X) == 0
    p["vx"][free] += change * (p["x"][free] - s.side)
    s.widening = velocity
    s.period = float(_rounded(s.period, unit(sim)))
    s.since, s.length = sim.clock.time, s.period


def widen(sim: Any) -> None:
    """Move the right side, if it moves, to where it is at the end of this step."""
    s, clock = sim.settings, sim.clock
    if not s.widening:
        return
    s.period = float(_rounded(s.length + s.widening * (clock.time + clock.dt - s.since), unit(sim)))
    sim.halo.period = s.period


def travel(sim: Any) -> tuple[float, float]:
    """Return the part of each partner in the approach of a pair across the sides by their motion since the lists were
    built [m], and in a step."""
    s = sim.settings
    if not s.widening:
        return 0.0, 0.0
    return 0.5 * abs(s.period - sim.rebuild_state.period), 0.5 * abs(s.widening) * sim.clock.dt


def check(sim: Any) -> None:
    """CommandError where moving sides are not supported."""
    s = sim.settings
    if not s.widening:
        return
    what = "SET energy: the work of the sides is not in the budget" if s.energy else "SET damp lsm" if s.lsm else ""
    if what:
        raise CommandError(f"PERIODIC xv does not support {what}")


def inside(sim: Any, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return positions x (n,) [m] brought between the sides, and the crossings (n,) that this took."""
    left, length = sim.settings.side, sim.settings.period
    laps = np.floor((x - left) / length)
    for _ in range(2):  # the quotient may be rounded up
        at = x - laps * length
        laps += (at >= left + length).astype(float) - (at < left)
    return x - laps * length, laps


def places(sim: Any) -> np.ndarray:
    """Return x (n_own,) [m] of the owned particles, between periodic sides if there are any. They leave these by up to
    half the skin until lists are rebuilt."""
    x: np.ndarray = sim.particles["x"]
    return inside(sim, x)[0] if sim.settings.period else x


def spans(sim: Any, x: tuple[float, float]) -> bool:
    """Return whether an interval x [m] is that between the periodic sides."""
    s = sim.settings
    return bool(s.period) and rounded_sides(*x) == (s.side, s.period)


def bring_in(sim: Any, frozen: bool) -> None:
    """Bring the particles of an open model between its sides, if these are periodic. frozen: they are where they were
    when the lists were built, with later velocities."""
    if not sim.settings.period:
        return
    x, velocity = sim.particles["x"], sim.particles["vx"]
    x[:] = _rounded(x, unit(sim))
    x[:], laps = inside(sim, x)
    sim.particles[LAPS][:] += laps
    if (widening := sim.settings.widening) and not frozen:
        velocity[:] = _rounded(velocity, speed_unit(widening)) - laps * widening


def snapping(sim: Any, move: Callable[..., None]) -> Callable[..., None]:
    """Return a loop of `kernels.motion` for a closed model. Between periodic sides it also rounds the positions of the
    particles that have images, and if the sides move, their velocities."""
    if not sim.halo.images:
        return move
    p, widening = sim.particles, sim.settings.widening

    def moved(blocks: int, first: int, last: int, *rest: Any) -> None:
        move(blocks, first, last, *rest)
        for rows in sim.halo.images:
            hot = p.hot[p.n_left + max(first, rows.start) : p.n_left + min(last, rows.stop)]
            hot[:, X] = _rounded(hot[:, X], unit(sim))
            if widening:
                hot[:, VX] = _rounded(hot[:, VX], speed_unit(widening))

    return moved


def fit(sim: Any) -> None:
    """Enlarge the cells until the model has a whole number of columns. CommandError if these are too few, or a wall is
    too near to a side."""
    s, state = sim.settings, sim.rebuild_state
    number = int(s.period / state.side)
    if number < FEWEST:
        raise CommandError(
            f"PERIODIC: the length {s.period:g} m must be at least {FEWEST} times the reach of contacts and bonds, "
            f"{state.side:g} m (the largest diameter or bond, plus skin)"
        )
    state.side, state.period = s.period / number, s.period
    _continue_walls(sim)
    _check_walls(sim, state.side)


def _check_walls(sim: Any, margin: float) -> None:
    walls, left, right = sim.walls, sim.settings.side, sim.settings.side + sim.settings.period
    for row in np.flatnonzero(~walls.around).tolist():
        ends = walls.p1[row, 0], walls.p2[row, 0]
        if min(ends) < left + margin or max(ends) > right - margin:
            raise CommandError(
                f"PERIODIC: wall {walls.id[row]} reaches from x = {min(ends):g} to {max(ends):g} m. A wall must be "
                f"horizontal and span both sides, {left:g} and {right:g} m, or keep {margin:g} m away from them"
            )


def cells(sim: Any, hot: np.ndarray) -> np.ndarray:
    """Return the cells (n,) i8 of rows that begin with x, y [m]. Between periodic sides column 0 begins at the left
    one, and cells of images follow from those of the particles."""
    s, side = sim.settings, sim.rebuild_state.side
    if not s.period:
        plain: np.ndarray = keys(hot, side)
        return plain
    number = round(s.period / side)
    sim.ownership.around, sim.ownership.period, sim.ownership.widening = number, s.period, s.widening
    x, laps = inside(sim, hot[:, X])
    found = keys(np.column_stack([x - s.side, hot[:, 1]]), side)
    column = columns(found)
    return found + (np.clip(column, 0, number - 1) - column + laps.astype(np.int64) * number) * COLUMN


def with_ghosts(sim: Any, cell: np.ndarray) -> np.ndarray:
    """Add the cells of ghosts to those of the owned particles."""
    p = sim.particles
    return np.concatenate([cells(sim, p.hot[: p.n_left]), cell, cells(sim, p.hot[p.owned.stop :])])


def refuse_outside(sim: Any, x: np.ndarray, left: float, right: float) -> None:
    """CommandError if a position x (n,) [m] on any rank is not between the sides. Collective."""
    ends = sim.comm.max_into(np.array([-x.min(initial=np.inf), x.max(initial=-np.inf)]))
    if -ends[0] < left or ends[1] > right:
        raise CommandError(
            f"particles from x = {-ends[0]:g} to {ends[1]:g} m are outside the periodic sides, {left:g} and {right:g} m"
        )

"""Many steps: a number of them, or until something is reached."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import connectivity, diagnostics
from hpcdem.physics.fdem.joints import laws_of
from hpcdem.physics.fdem.kernels import joint_law
from hpcdem.physics.fdem.simulation import Blocks

RATIO = 1e-5
"""Ratio of unbalanced forces at which a model counts as being in equilibrium, if no other is requested."""
EVERY = 50
"""Number of steps between two evaluations of the balance."""
WINDOW = 20_000
"""Smallest number of static steps within which the balance must improve."""
CROSSINGS = 10.0
"""Smallest window, in times that a wave takes to cross the model and return."""
BETTER = 0.9
"""Fraction of the smallest ratio so far below which a ratio counts as progress."""
SLIDES = 0.2
"""Fraction of the mean velocity of a body that all its corners must have for the body to count as sliding; fixed
corners do not move."""
LIMIT_STATIC, LIMIT_DYNAMIC = 1_000_000, 10_000_000
"""Numbers of steps after which a run towards a ratio has failed, static and dynamic, if no other limit is given."""


@dataclass(frozen=True)
class Solved:
    """Outcome of `solve`. ratio: unbalanced over contributing forces at the last evaluation, NaN if there was none;
    reason: "ratio", "cycles", "time", "request" (a signal or limit asked to stop); without equilibrium "no progress" or
    "limit", see `Watch`."""

    steps: int
    ratio: float
    reason: str
    request: int = 0


@dataclass
class Watch:
    """Progress of a run towards a ratio. It uses global numbers, so it decides alike on all ranks.

    window: steps in which the least ratio must fall by a tenth, 0: any number. Since what came slowly so far may
    continue slowly, it is never shorter than the way from the beginning to the last progress. When a joint breaks that
    begins again. limit: steps in all, 0: any number. began, changed, progress: steps at which the run began, the last
    joint broke, the ratio was last better; least: the ratio then; broken: joints then.
    """

    window: int
    limit: int
    began: int
    changed: int = 0
    progress: int = 0
    least: float = math.inf
    broken: int = -1

    def failed(self, step: int, ratio: float, broken: int) -> str:
        """Return the reason why the run cannot reach the ratio, "" if it may; broken: joints so far."""
        if broken != self.broken:
            self.least, self.progress, self.broken = ratio, step, broken
            self.changed = step
        elif ratio <= BETTER * self.least:
            self.least, self.progress = ratio, step
        if self.limit and step - self.began >= self.limit:
            return "limit"
        stuck = step - self.progress >= max(self.window, self.progress - self.changed)
        return "no progress" if self.window and stuck else ""


@dataclass(frozen=True)
class Moving:
    """A body (elements that are connected) that moves: number of elements, the lowest of them, its middle [m], its
    velocity [m/s; in static mode m per step]."""

    elements: int
    first: int
    x: float
    y: float
    vx: float
    vy: float

    def __str__(self) -> str:
        return (
            f"the body of {self.elements} element{'s' * (self.elements > 1)} around ({self.x:.6g}, {self.y:.6g}), with "
            f"element {self.first}, slides or falls away by ({self.vx:.3g}, {self.vy:.3g})"
        )


def advance(sim: Blocks, steps: int) -> int:
    """Take up to `steps` steps, fewer if there is an external request. Returns the request (0: none)."""
    if steps < 0:
        raise CommandError(f"the number of steps must not be negative, got {steps}")
    return sim.advance(steps)


def solve(
    sim: Blocks,
    ratio: float | None = None,
    cycles: int | None = None,
    time: float | None = None,
    every: int = EVERY,
    window: int | None = None,
    limit: int | None = None,
) -> Solved:
    """Step until the sum of unbalanced over the sum of contributing nodal forces falls below `ratio` (1e-5 if none
    of the three is given), or after so many steps, or so much model time [s], whichever is first.

    every: steps between two looks at the ratio. window, limit: see `watch`; they end the run without equilibrium.
    """
    if ratio is None and cycles is None and time is None:
        ratio = RATIO
    given = {"ratio": ratio, "cycles": cycles, "time": time, "every": every}
    for name, value in given.items():
        if value is not None and not value > 0:
            raise CommandError(f"{name} must be positive, got {value}")
    if time is not None and not sim.options.dynamic:
        raise CommandError("time does not pass in static mode: use cycles or ratio")
    sim.close_model()
    clock = sim.clock
    watched = watch(sim, window, limit, ends=cycles is not None or time is not None)
    end = math.inf if time is None else clock.time + time
    done, found = 0, math.nan
    while (cycles is None or done < cycles) and clock.time < end - 0.5 * clock.dt:
        request = sim.step()
        sim.close_model()
        done += 1
        sim.timers.count(1, len(sim.number[sim.owned]))
        if request:
            return Solved(done, found, "request", request)
        if ratio is not None and (done % every == 0 or done == cycles):
            found = diagnostics.unbalanced_ratio(sim)
            why = "ratio" if found < ratio else watched.failed(clock.step, found, diagnostics.joint_counts(sim)[2])
            if why:
                return Solved(done, found, why)
    return Solved(done, found, "cycles" if cycles is not None and done >= cycles else "time")


def watch(sim: Blocks, window: int | None = None, limit: int | None = None, ends: bool = False) -> Watch:
    """A watch over a run towards a ratio that begins now. window, limit [steps]; 0: none; None: what is usual.

    ends: the run ends by itself, so that usually there is neither. Otherwise the limit is 1 000 000 static or
    10 000 000 dynamic steps, and the window of static runs ten times as long as a wave takes there and back, at
    least 20 000 steps; waves decay slowly where damping is low, so
    dynamic runs have no such limit."""
    for name, value in (("window", window), ("limit", limit)):
        if value is not None and value < 0:
            raise CommandError(f"{name} must not be negative, got {value}")
    static = not sim.options.dynamic
    if window is None:
        window = 0 if ends or not static else max(WINDOW, math.ceil(CROSSINGS * _crossing(sim)))
    if limit is None:
        limit = 0 if ends else LIMIT_STATIC if static else LIMIT_DYNAMIC
    return Watch(window, limit, sim.clock.step)


def _crossing(sim: Blocks) -> float:
    """Estimate how many static steps a wave takes through the model and back, twice: 4 n sqrt(1 + P / E), n: edges
    along it; masses are those of the stiffest part, joints with the penalty P."""
    size = float(np.ptp(sim.the_mesh().points, axis=0).max())
    tied = sim.joint_row[sim.closed_faces()]
    laws = laws_of(sim.joint_rows)
    penalty = joint_law.stiffest(sim.joint_rows.column, laws, tied, lambda: np.array(sim.mean_edge)).max(initial=0.0)
    young = np.array(sim.element_rows.column("young"))[sim.element_row[sim.alive]].min()
    return 4.0 * size / sim.mean_edge * math.sqrt(1.0 + penalty / young)


def sliding_body(sim: Blocks) -> Moving | None:
    """The fastest body, if it slides or falls as a whole: all its corners move, and it would go more than rounding
    (1e-6 of an edge in 10 000 steps). Equal on all ranks. Collective."""
    hold = np.where(sim.closed_faces() & np.repeat(sim.alive, 4), sim.partner, -1)
    of_elements = connectivity.bodies(hold)
    names = [f"{name}_{axis}" for name in ("position", "velocity") for axis in "xy"]
    mine = diagnostics.owned_values(sim, "corner", names)
    rows = np.concatenate(sim.comm.allgather(np.column_stack(list(mine.values()))))
    rows = rows[np.argsort(rows[:, 0])]
    element = rows[:, 0].astype(np.int64) // 4
    _, body = np.unique(of_elements[element], return_inverse=True)
    count = np.bincount(body)
    x, y, vx, vy = (np.bincount(body, column) / count for column in rows[:, 1:].T)
    least = np.full(len(count), math.inf)
    np.minimum.at(least, body, np.hypot(rows[:, 3], rows[:, 4]))
    speed = np.hypot(vx, vy)
    speed[(least < SLIDES * speed) | (1e4 * speed * sim.clock.dt < 1e-6 * sim.mean_edge)] = 0.0
    k = int(speed.argmax())
    if speed[k] == 0.0:
        return None
    members = np.unique(element[body == k])
    return Moving(len(members), int(members[0]), float(x[k]), float(y[k]), float(vx[k]), float(vy[k]))

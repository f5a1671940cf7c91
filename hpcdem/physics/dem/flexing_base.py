"""A wall or a row of fixed particles that an elastic plate carries: what it remembers, and how they act on each other.

In the first half of an interval of steps the base moves. In the second it rests, and the contact forces of the discs
are sampled: during the motion they contain inertia and damping, with which the coupling could oscillate. Their mean
loads the plate (flexure.py), and the base approaches its equilibrium shape in the next interval: by the share `relax`
of the distance, and not faster than `speed`. Forces are summed in the order of ids, so nothing depends on ranks.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.fields import FIX_Y
from hpcdem.physics.dem import diagnostics
from hpcdem.physics.dem.diagnostics import AT_X, FORCE_Y
from hpcdem.physics.dem.flexure import Plate

SAMPLES = 10
"""Number of samples of the load in an interval."""
SHORTEST = 4
"""Smallest number of steps of an interval."""
SLOWLY = 1e-3
"""Displacement of the base in a step over the largest radius, unless the speed of the base is given."""
STEEP = 0.1
"""Slope above which plate theory is inaccurate."""
_TABLES = ("shape", "before", "goal", "loads", "sums", "reference")


@dataclass
class Base:
    """wall: its id, -1 for a row; row (m,): ids of its particles, ascending; level: height without deflection [m];
    first, last: ends of the base in x [m]; x: nodes of the plate [m]; rigidity [N m]; contrast of density [kg/m3];
    left, right: conditions of its ends; load: x [m] and size [N/m] of a constant line load; compensated: the load of
    the first interval is in equilibrium; interval: steps, from the step `origin` on; relax; speed [m/s], 0: `SLOWLY`.

    shape, before: where the base is at the end and was at the beginning of the present interval; goal: equilibrium with
    loads, the mean of the last interval; sums, samples: of the present one; reference: compensated loads.
    """

    wall: int
    row: np.ndarray
    level: float
    first: float
    last: float
    x: np.ndarray
    rigidity: float
    contrast: float
    left: str
    right: str
    load: tuple[float, float]
    compensated: bool
    interval: int
    origin: int
    relax: float
    speed: float
    samples: int = 0
    referred: bool = False
    shape: np.ndarray = field(default_factory=lambda: np.empty(0))
    before: np.ndarray = field(default_factory=lambda: np.empty(0))
    goal: np.ndarray = field(default_factory=lambda: np.empty(0))
    loads: np.ndarray = field(default_factory=lambda: np.empty(0))
    sums: np.ndarray = field(default_factory=lambda: np.empty(0))
    reference: np.ndarray = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        for name in _TABLES:
            if not getattr(self, name).size:
                shape = (len(self.x), 2) if name in ("shape", "before", "goal") else (len(self.x) - 1, 4)
                setattr(self, name, np.zeros(shape))

    @property
    def name(self) -> str:
        """The base in messages."""
        return (
            f"wall {self.wall}" if self.wall >= 0 else f"the row of {len(self.row)} particles at y = {self.level:g} m"
        )

    @property
    def label(self) -> str:
        """The base in files."""
        return f"wall {self.wall}" if self.wall >= 0 else f"row {self.row[0]}"

    def state(self) -> dict[str, Any]:
        """Return everything as JSON values."""
        values = ((one.name, getattr(self, one.name)) for one in dataclasses.fields(self))
        return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in values}

    @classmethod
    def restored(cls, state: dict[str, Any]) -> Base:
        """Return the base of a state."""
        taken = {name: np.array(state[name], np.float64) for name in ("x", *_TABLES)}
        return cls(**{**state, **taken, "row": np.array(state["row"], np.int64), "load": tuple(state["load"])})

    def plate(self, sim: Any) -> Plate:
        """The plate with the present gravity. CommandError without one that points down."""
        gravity = -sim.settings.gy
        if not gravity > 0.0:
            raise CommandError(f"FLEXURE: the plate under {self.name} needs gravity that points down (SET gravity)")
        return Plate(self.x, self.rigidity, self.contrast * gravity, self.left, self.right)

    @property
    def nodes(self) -> slice:
        """Nodes of the plate under the base."""
        first, last = np.searchsorted(self.x, [self.first, self.last])
        return slice(int(first), int(last) + 1)

    def now(self, step: int) -> np.ndarray:
        """Return the shape (n, 2) of the base at a step: deflection [m] and slope."""
        share = min(1.0, (step - self.origin) % self.interval / self.motion)
        return self.before + (self.shape - self.before) * share

    @property
    def motion(self) -> int:
        """Steps of an interval in which the base moves."""
        return self.interval // 2

    def rests(self, step: int) -> bool:
        """Return whether the base has been at rest before a step, as at the end of an interval."""
        passed = (step - self.origin) % self.interval
        return passed == 0 or passed > self.motion

    # ---- loads ---------------------------------------------------------------------------------------------------

    def sample(self, sim: Any) -> None:
        """Add the present contact forces. The model is closed. Collective."""
        x, force = (_on_wall if self.wall >= 0 else _on_row)(sim, self)
        self.sums += self.plate(sim).loads(x, force / sim.settings.thickness)
        self.samples += 1

    def acting(self, plate: Plate) -> np.ndarray:
        """Return the loads that bend the plate: without those that are compensated, with the constant one."""
        at, size = self.load
        return self.loads - self.reference + plate.loads(np.array([at]), np.array([size]))

    # ---- motion --------------------------------------------------------------------------------------------------

    def exchange(self, sim: Any) -> None:
        """Bend the plate by the mean load of the interval, and give the base its velocity of the next. Collective."""
        plate = self.plate(sim)
        self.loads = self.sums / max(self.samples, 1)
        if self.compensated and not self.referred:
            self.reference, self.referred = self.loads.copy(), True
        self.goal = sim.comm.bcast(plate.solve(self.acting(plate)) if sim.comm.rank == 0 else None)
        if not np.isfinite(self.goal).all():
            raise CommandError(f"step {sim.clock.step}: the load on {self.name} is not finite")
        self.sums[:], self.samples = 0.0, 0
        span = self.motion * sim.clock.dt
        step = self.relax * (self.goal - self.shape)
        most = (self.speed or SLOWLY * sim.largest_radius / sim.clock.dt) * span
        largest = float(np.abs(step[self.nodes, 0]).max())
        if largest > most:
            step *= most / largest
        self.before, self.shape = self.shape, self.shape + step
        self._check_space(sim)
        (self._move_wall if self.wall >= 0 else self._move_row)(sim, plate, span)
        sim.check_soon()

    def halt(self, sim: Any, ends: bool = False) -> None:
        """Bring the base to rest, for good if it ends: particles of a row may then be gone. Collective."""
        if self.wall >= 0:
            sim.walls.bend[sim.walls.parts(self.wall)] = 0.0
            sim.tables_changed()
        else:
            sim.particles["vy"][self._held(sim) if ends else self._members(sim)] = 0.0
        sim.check_soon()

    def _check_space(self, sim: Any) -> None:
        box = sim.walls.box()
        lowest = self.level - float(self.shape[self.nodes, 0].max())
        if box is not None and lowest <= box[2] < self.level:
            raise CommandError(
                f"step {sim.clock.step}: {self.name} sinks to {lowest:g} m, below the bottom of the BOX at {box[2]:g} "
                "m; place the bottom lower"
            )

    def _move_wall(self, sim: Any, plate: Plate, span: float) -> None:
        walls, rows = sim.walls, sim.walls.parts(self.wall)
        down = self.shape[self.nodes, 0]
        down = down if walls.p1[rows[0], 0] < walls.p2[rows[-1], 0] else down[::-1]
        walls.bend[rows, 0] = (self.level - down[:-1] - walls.p1[rows, 1]) / span
        walls.bend[rows, 1] = (self.level - down[1:] - walls.p2[rows, 1]) / span
        sim.tables_changed()

    def _move_row(self, sim: Any, plate: Plate, span: float) -> None:
        p, mine = sim.particles, self._members(sim)
        p["vy"][mine] = (self.level - plate.deflection(self.shape, p["x"][mine]) - p["y"][mine]) / span

    def exists(self, sim: Any) -> bool:
        """Return whether any particle of the row is left. Collective."""
        return bool(sim.comm.any(bool(np.isin(sim.particles["gid"], self.row).any())))

    def _held(self, sim: Any) -> np.ndarray:
        """Flags (n_own,) of the particles of the row that are fixed in y."""
        p = sim.particles
        held: np.ndarray = np.isin(p["gid"], self.row) & (p["fix"] & FIX_Y != 0)
        return held

    def _members(self, sim: Any) -> np.ndarray:
        """Flags (n_own,) of the particles of the row. CommandError if some are gone or free. Collective."""
        mine = self._held(sim)
        fixed = sim.count(int(mine.sum()))
        if fixed < len(self.row):
            raise CommandError(
                f"step {sim.clock.step}: {len(self.row) - fixed} particles of {self.name}, which FLEXURE moves, were "
                "deleted or freed in y; FLEXURE off ends it"
            )
        return mine


def _on_wall(sim: Any, base: Base) -> tuple[np.ndarray, np.ndarray]:
    """x [m] and force downwards [N] of the contacts of a wall, in the order of ids. Collective."""
    out, iout = diagnostics.wall_rows(sim)
    mine = np.isin(iout[:, 1], sim.walls.parts(base.wall))
    return _in_order(sim, iout[mine], out[mine, AT_X], out[mine, FORCE_Y])


def _on_row(sim: Any, base: Base) -> tuple[np.ndarray, np.ndarray]:
    """x [m] and force downwards [N] of the contacts of a row with other particles, in the order of ids. Collective."""
    out, iout = diagnostics.contact_rows(sim)
    first, second = (np.isin(iout[:, k], base.row) for k in (0, 1))
    mine = first != second
    return _in_order(sim, iout[mine, :2], out[mine, AT_X], np.where(first[mine], -1.0, 1.0) * out[mine, FORCE_Y])


def _in_order(sim: Any, ids: np.ndarray, x: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    parts = sim.comm.allgather((ids.copy(), x.copy(), force.copy()))
    ids, x, force = (np.concatenate([part[k] for part in parts]) for k in range(3))
    order = np.lexsort(ids.T)
    return x[order], force[order]

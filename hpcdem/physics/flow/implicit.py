"""Implicit steps of flow, alone or with blocks in static equilibrium: backward Euler, all unknowns at once.

One variable u per flow node says how its fluid is: u > 0 is a pressure u p0 in a full node, u < 0 a saturation 1 + u
without pressure. The residual of a node is the fluid that its balance lacks,

    R = V (s + p / K) - W_before - dt sum(q) + leak-off - given,

with flows q, volumes V and leak-off of the explicit steps (kernels.py), all at the end of the step. Volumes and cubic
law follow the opening of joints, pressures push on their faces; Newton's method takes all four derivatives, so fluid of
any bulk modulus in channels of any width converges. At u = 0 the derivative has a jump (semi-smooth Newton method, Qi &
Sun 1993). Seepage faces, and rates that take more than there is, are complementarities: max(u, R) = 0 and
min(u + 1, R) = 0. Packs of proppant that bear have one more unknown at each node, the pressure w on their walls, with
the equation w = w(V): the state fulfils it at any time, and the matrix stays sparse.

The nodes of a well are one room (wells.py): one variable y, that of its first node, says what all of them hold, y < 0:
the saturation 1 + y, y > 0: the head y p0 above the lowest of them, p = max(y p0 - (E - E_lowest), 0). Its equation is
the sum of theirs. A rate with a limit y_l of the pressure: the median of what the room lacks R, of what came in and of
y - y_l is 0, so that the rate comes in below the limit, less at it, nothing above.

Everything here is known to all ranks and is the same on all: the numbers of a solve are few beside its factors.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.network import LINKS
from hpcdem.physics.flow.wells import Asked, Well

if TYPE_CHECKING:
    from hpcdem.physics.flow.model import Flow

LEAST_PRESSURE = 1e4
"""Smallest scale of pressure p0 [Pa]."""
ROUNDING = 1e-8
"""Part of the fluid of a node, and of what would flow if pressure and height did not balance, that counts as flowing:
where nothing flows any more the rest is rounding."""
PLACES = 4e7 * 2.0**-52
"""Part of the largest coordinate by which a channel that widens counts as one that takes fluid up: blocks come to rest
within four times their rounding, of which 10^-7 is enough balance (coupled.py)."""


@dataclass
class Balance:
    """A state of the fluid at trial positions and variables.

    residual (n,): R [m2], with conditions; plain: without; sizes: sum of the sizes of what it is made of; rounding:
    what else counts as such, where pressure and height nearly balance, and blocks hardly move; fluid, volume (n,) [m2];
    state (n, kernels.STATE); held (n,) bool: nodes whose variable is known, by a condition or by a complementarity;
    pumped: by well the fluid that came in [m2], None: what its nodes lack; table (l, kernels.CHANNEL), q [m2/s], lost
    [m2] (l,): of the links of channels, see kernels.py; packs (2, n): what packs of proppant push with [Pa], and its
    derivative by the volume; slow (l,): flow over that of the cubic law, None: it is laminar. In space m3 for m2.
    """

    residual: np.ndarray
    plain: np.ndarray
    sizes: np.ndarray
    rounding: np.ndarray
    fluid: np.ndarray
    volume: np.ndarray
    state: np.ndarray
    held: np.ndarray
    pumped: list[float | None]
    table: np.ndarray
    q: np.ndarray
    lost: np.ndarray
    packs: np.ndarray | None = None
    slow: np.ndarray | None = None


@dataclass
class Step:
    """One implicit step: before, after [s]; fluid (n,) [m2]: at its beginning; conditions (rows, 2): at its end;
    known (n,) bool: nodes of which they say the pressure; asked: by well."""

    before: float
    after: float
    fluid: np.ndarray
    conditions: np.ndarray
    known: np.ndarray
    asked: list[Asked]

    @property
    def dt(self) -> float:
        return self.after - self.before


@dataclass
class Fluid:
    """The network of a model, as arrays. u (n,): variable of each flow node; first (n,): rows of the nodes whose
    variable counts for them, tied (n,) bool: another one's; wells: with the rows of their nodes; at (m, 4): nodes of
    the blocks at the corners a, b of the lower face and p, q of the other (p faces b), in space (m, 6): a, b, c and p,
    q, r (p faces a, r faces b); ends (l, 2): of links, `of` each channel; face_at (k, dim), face_node (k, dim): nodes
    of the blocks and flow nodes at the corners of faces of this rank that fluid pushes on, first the sides of channels,
    beyond the flow nodes the shore (faces.Shore); face_key (k,): their numbers; shore_before: its state when a step
    begins."""

    flow: Flow
    p0: float
    u: np.ndarray = field(init=False)
    conditions: np.ndarray | None = field(init=False, default=None)
    thicken: Callable[[np.ndarray, np.ndarray], None] | None = field(init=False, default=None)
    packs: Callable[[np.ndarray], np.ndarray] | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        flow, blocks = self.flow, self.flow.blocks
        network, self.dim = flow.network, blocks.dim
        self.numbers, self.channels = network.nodes, network.channels
        self.n, self.m = len(network.nodes), len(network.channels)
        row_of = np.full(len(network.there), -1, np.int64)
        row_of[network.nodes] = np.arange(self.n)
        self.ends = row_of[network.ends]
        lower, other = self.channels, blocks.partner[self.channels]
        self.at = np.column_stack([self._corners(faces) for faces in (lower, other)])
        self.of = np.repeat(np.arange(self.m), LINKS[self.dim])
        self.law = (flow.row[self.channels] - 1).astype(np.int64)[self.of]
        self.laws, self.bulk = flow.laws(), flow.fluid("fluid_bulk")
        sides, wet = flow.pushed() if flow.pushes else (np.empty(0, np.int64),) * 2
        self.face_key = faces = np.concatenate([sides, wet])
        self.of_channels = len(sides)
        self.face_at, self.face_node = self._corners(faces), row_of[blocks.the_mesh().face_points(faces)]
        self.face_node[self.face_node < 0] = self.n + np.arange(len(flow.shore))
        self.shore_node = np.where(flow.shore.node >= 0, row_of[flow.shore.node], -1)
        half, fourth, *weights = blocks.the_mesh().on_sides(faces)
        self.on_sides = half, blocks.node.reshape(-1)[fourth], *weights
        self.condition = flow.condition[self.numbers]
        self.held_rows = row_of[flow.held]
        leads = blocks.local.leads[self.numbers]
        self.lead = blocks.node.reshape(-1)[leads]
        self.side = np.repeat([-1.0, 1.0], len(self.ends))
        self.end = self.ends.T.reshape(-1)
        self.both = np.tile(np.arange(len(self.ends)), 2)
        self.fluid = self._gathered(flow.nodes[:, kernels.W])
        p, s = self._gathered(flow.state[: flow.owned, kernels.P]), self._gathered(flow.state[: flow.owned, kernels.S])
        self.first = np.arange(self.n)
        self.wells: list[tuple[Well, np.ndarray]] = []
        for well in flow.wells:
            rows = row_of[well.points[network.there[well.points]]]
            if len(rows):
                self.wells.append((well, rows))
                self.first[rows] = rows[0]
        self.tied = self.first != np.arange(self.n)
        self._find_packs()
        self.volume = np.empty(0)
        self.u = self._variables(np.where(p > 0.0, p / self.p0, s - 1.0))

    def _find_packs(self) -> None:
        """Packs that bear, with the grains that are in them now."""
        slurry = self.flow.slurry
        moves = self.flow.blocks.options.mechanical
        self.packs = slurry.packs(self._gathered) if slurry is not None and moves else None

    @property
    def layers(self) -> int:
        """Unknowns of each flow node."""
        return 1 if self.packs is None else 2

    def _variables(self, u: np.ndarray) -> np.ndarray:
        """Return the variables from those of each node alone: a well has that of its lowest node."""
        for _, rows in self.wells:
            u[rows[0]] = u[rows].max()
        return u

    def _corners(self, faces: np.ndarray) -> np.ndarray:
        """(k, dim) nodes of the blocks at the corners of faces."""
        blocks = self.flow.blocks
        return blocks.node.reshape(-1)[blocks.the_mesh().face_corners(faces)]

    def _gathered(self, mine: np.ndarray) -> np.ndarray:
        """Values (n,) of all flow nodes from those of this rank."""
        comm, numbers = self.flow.blocks.comm, self.flow.number
        out = np.zeros(self.n)
        for number, values in comm.allgather((numbers, mine)) if comm.size > 1 else [(numbers, mine)]:
            out[np.searchsorted(self.numbers, number)] = values
        return out

    # ---- a state -------------------------------------------------------------------------------------------------

    def state_of(self, u: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Pressure, saturation and potential energy (n, kernels.STATE) at these variables and positions (nn, dim)."""
        state, at = np.empty((self.n, kernels.STATE)), x[self.lead]
        along = sum(g * at[:, k] for k, g in enumerate(self.flow._gravity()))
        state[:, kernels.E] = -self.flow.fluid("fluid_density") * along
        own = self._own(u, state[:, kernels.E])
        state[:, kernels.P] = np.maximum(own, 0.0) * self.p0
        state[:, kernels.S] = np.minimum(1.0 + own, 1.0)
        return state

    def _own(self, u: np.ndarray, energy: np.ndarray) -> np.ndarray:
        """Return the variable of each node (n,); nodes of a well follow that of its first node, less their height above
        the lowest."""
        own = u.copy()
        for _, rows in self.wells:
            y, above = u[rows[0]], (energy[rows] - energy[rows].min()) / self.p0
            own[rows] = np.maximum(y - above, 0.0) if y > 0.0 else y
        return own

    def volumes(self, table: np.ndarray) -> np.ndarray:
        """Volumes (n,) [m2] of the nodes, by the table of links."""
        return np.bincount(self.end, table[self.both, kernels.HALF], self.n)

    def begin(self, dt: float, x: np.ndarray, passes: bool = True) -> tuple[Step, np.ndarray]:
        """A step of dt [s] from here, and the variables (n,) to begin with. passes: time does, else conditions are
        those of now."""
        flow = self.flow
        slurry = flow.slurry
        self.thicken = None if slurry is None else slurry.everywhere(self._gathered)
        self._find_packs()
        conditions = flow.conditions_at(flow.time + dt if passes else flow.time)
        does, value = conditions[self.condition].T
        energy = self.state_of(self.u, x)[:, kernels.E]
        level = (does == kernels.SURFACE) & (value > energy)
        known = level | (does == kernels.PRESSURE)
        u = np.where(known, np.where(level, value - energy, value) / self.p0, self.u)
        asked = []
        for well, rows in self.wells:
            one = flow.asked_of(well, flow.time, dt, passes)
            if one.pressure is not None:
                known[rows], u[rows[0]] = True, (one.pressure + float(np.ptp(energy[rows]))) / self.p0
            asked.append(one)
        flow.find_shore()
        self.shore_before, self.conditions = flow.state[len(flow.held) :].copy(), conditions
        return Step(flow.time, flow.time + dt, self.fluid, conditions, known, asked), u

    def show(self, state: np.ndarray, volume: np.ndarray | None = None) -> None:
        """Loads are those of this state, and of packs in rooms of this volume (n,), None: as they are, from now on."""
        self.flow.show(state[self.held_rows], self.conditions)
        if self.packs is not None and self.flow.slurry is not None:
            self.flow.slurry.show(self.packs(self.volume if volume is None else volume)[0, self.held_rows])

    def balance(self, step: Step, u: np.ndarray, x: np.ndarray) -> Balance:
        """Residual of the nodes at these variables (n,) and positions of the blocks' nodes (nn, dim)."""
        table = self.table_at(x)
        if self.thicken is not None:
            self.thicken(self.ends, table)
        does, value = step.conditions[self.condition].T
        state = self.state_of(u, x)
        slow = self.flow.slowness(self.ends, table, state)
        if slow is not None:
            table[:, kernels.CONDUCT] *= slow
        q, lost = np.empty(len(table)), np.zeros(len(table))
        since = self.flow.since[self.channels][self.of]
        leaks = bool(np.isfinite(since).any())
        wet = state.copy()
        wet[:, kernels.S] = np.maximum(wet[:, kernels.S], 0.0)  # trial states may lack it
        threads = self.flow.blocks.threads
        kernels.flows(
            threads, self.ends, self.law, self.laws, since, leaks, step.before, step.after, table, wet, q, lost
        )
        volume = self.volumes(table)
        fluid = volume * (state[:, kernels.S] + state[:, kernels.P] / self.bulk)
        dt, stored = step.dt, fluid - step.fluid
        into = np.bincount(self.end, self.side * q[self.both], self.n) * dt
        passing = np.bincount(self.end, np.abs(q)[self.both], self.n) * dt
        gone = np.bincount(self.end, lost[self.both], self.n)
        rate = np.where(does == kernels.RATE, value, 0.0) * dt
        plain = stored - into + gone
        residual = plain - rate
        seeps = (does == kernels.SURFACE) & ~step.known
        scale = np.maximum(volume, 1e-300)
        out = seeps & (u * scale >= residual)
        dry = (does == kernels.RATE) & (value < 0.0) & ((u + 1.0) * scale <= residual)
        held = step.known | out | dry
        residual = np.where(step.known, 0.0, np.where(out, u * scale, np.where(dry, (u + 1.0) * scale, residual)))
        sizes = np.abs(stored) + passing + gone + np.abs(rate) + ROUNDING * np.abs(fluid)
        pumped = [
            self._well_lacks(rows, asked, u, (plain, volume, state[:, kernels.E]), residual, held, sizes)
            for (_, rows), asked in zip(self.wells, step.asked)
        ]
        head = (np.abs(state[:, kernels.P]) + np.abs(state[:, kernels.E]))[self.ends].sum(axis=1)
        level = np.bincount(self.end, (np.abs(table[:, kernels.CONDUCT]) * head)[self.both], self.n) * dt
        if self.flow.blocks.options.mechanical:
            wall = (table[:, kernels.HALF] / table[:, kernels.APERTURE])[self.both]
            level += PLACES / ROUNDING * float(np.abs(x).max()) * np.bincount(self.end, wall, self.n)
        packs = None if self.packs is None else self.packs(volume)
        return Balance(
            residual, plain, sizes, ROUNDING * level, fluid, volume, state, held, pumped, table, q, lost, packs, slow
        )

    def _well_lacks(
        self, rows: np.ndarray, asked: Asked, u: np.ndarray, of: tuple[np.ndarray, np.ndarray, np.ndarray],
        residual: np.ndarray, held: np.ndarray, sizes: np.ndarray,
    ) -> float | None:  # fmt: skip
        """The equation of a well goes to its first node; of: plain, volume and energy of all nodes. What came in [m2];
        None: what the nodes lack, as their pressure is given."""
        plain, volume, energy = of
        first, y = rows[0], u[rows[0]]
        residual[rows] = 0.0
        sizes[first] += abs(asked.amount)
        if asked.pressure is not None:
            return None
        came, capacity = float(plain[rows].sum()), max(float(volume[rows].sum()), 1e-300)
        lacks = came - asked.amount
        if asked.amount > 0.0 and math.isfinite(asked.limit):
            over = y - (asked.limit + float(np.ptp(energy[rows]))) / self.p0
            # Compared by what it would store: a larger weight lets Newton's method jump over the limit and back.
            at_limit = (over * capacity * self.p0 / self.bulk, over * capacity, None)
            candidates = [(lacks, lacks, asked.amount), at_limit, (came, came, 0.0)]
            _, lacks, found = sorted(candidates, key=lambda one: one[0])[1]
        elif asked.amount < 0.0 and (y + 1.0) * capacity <= lacks:
            lacks, found = (y + 1.0) * capacity, None
        else:
            found = asked.amount
        residual[first] = lacks
        held[rows] = found is None
        return found

    def table_at(self, x: np.ndarray) -> np.ndarray:
        """Apertures, conductances and halves of volumes of links (l, kernels.CHANNEL) at these positions (nn, dim)."""
        dim, table = self.dim, np.empty((len(self.ends), kernels.CHANNEL))
        width = self.at.shape[1] * dim
        corners = np.ascontiguousarray(x[self.at].reshape(self.m, width))
        near = width * np.arange(self.m)[:, None] + dim * np.arange(dim)
        threads = self.flow.blocks.threads
        kernels.geometry(threads, near, near + dim * dim, self.law, self.laws, corners, self.flow.viscosity, table)
        return table

    # ---- the end of a step ---------------------------------------------------------------------------------------

    def take(self, step: Step, now: Balance, u: np.ndarray) -> np.ndarray:
        """The fluid is that of this balance: what flows out of one node has flowed into another, to rounding. What
        came in at each node (n,) [m2]."""
        flow = self.flow
        does, value = step.conditions[self.condition].T
        rate = np.where(does == kernels.RATE, value, 0.0) * step.dt
        as_found = now.held | self.tied
        given = np.where(as_found, now.plain, rate)
        fluid = np.where(as_found, now.fluid, now.fluid - now.plain + rate)
        for (well, rows), came in zip(self.wells, now.pumped):
            missing = 0.0 if came is None else came - float(now.plain[rows].sum())
            given[rows[0]] = now.plain[rows[0]] + missing
            fluid[rows[0]] = now.fluid[rows[0]] + missing
            self._note_well(well, rows, step, now.state, float(now.plain[rows].sum()) if came is None else came)
        gone = np.bincount(self.end, now.lost[self.both], self.n)
        mine = np.searchsorted(self.numbers, flow.number)
        nodes = flow.nodes
        nodes[:, kernels.W], nodes[:, kernels.V] = fluid[mine], now.volume[mine]
        nodes[:, kernels.GIVEN] += given[mine]
        nodes[:, kernels.LEAKED] += gone[mine]
        nodes[:, kernels.INFLOW] = given[mine] / step.dt
        self.show(now.state, now.volume)
        self.volume = now.volume
        if flow.blocks.options.mechanical:  # what is shown of channels, and grains, follow where the blocks are now
            flow.find_geometry()
        if flow.carried is not None:
            each = LINKS[self.dim]
            of = each * np.searchsorted(self.channels, flow.channels_here)
            flow.carried = step.dt * now.q[(of[:, None] + np.arange(each)).reshape(-1)]
        p, s = now.state[:, kernels.P], now.state[:, kernels.S]
        self.fluid, self.u = fluid, self._variables(np.where(p > 0.0, p / self.p0, s - 1.0))
        flow.time = step.after
        return given

    def _note_well(self, well: Well, rows: np.ndarray, step: Step, state: np.ndarray, came: float) -> None:
        """Record the action of a well in a step."""
        well.pressure = float(state[rows[np.argmax(state[rows, kernels.E])], kernels.P])
        well.rate = came / step.dt
        well.injected += came
        self.flow.report_stage(well, step.before, step.after)


def reference_pressure(flow: Flow, stress: float) -> float:
    """p0 [Pa]: estimate of the largest pressure now or later; stress: that of the rock, 0 if it is at rest."""
    table = flow.conditions_at(flow.time)
    used = table[np.unique(flow.condition)]
    pressures = used[used[:, 0] == kernels.PRESSURE, 1]
    own = flow.state[: flow.owned, kernels.P].max(initial=0.0)
    held = [flow.asked_of(well, flow.time, 0.0, False) for well in flow.wells]
    of_wells = max((one.pressure for one in held if one.pressure is not None), default=0.0)
    o, mesh = flow.blocks.options, flow.blocks.the_mesh()
    points, gravity = mesh.points[flow.network.nodes], np.array([o.gx, o.gy, o.gz][: mesh.dim])
    energy = flow.fluid("fluid_density") * np.ptp(points @ gravity) if len(points) else 0.0
    largest = float(flow.blocks.comm.max_into(np.array([own]))[0])
    return max(largest, float(pressures.max(initial=0.0)), of_wells, float(energy), stress, LEAST_PRESSURE)

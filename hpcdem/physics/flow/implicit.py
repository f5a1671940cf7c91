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

from hpcdem.physics.fdem.linear import Pieces
from hpcdem.physics.flow import kernels, kernels_space
from hpcdem.physics.flow.network import LINKS
from hpcdem.physics.flow.wells import Asked, Well

if TYPE_CHECKING:
    from hpcdem.physics.flow.model import Flow

LEAST_PRESSURE = 1e4
"""p0 is at least this [Pa]."""
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
    beyond the flow nodes the shore (model.Shore); face_key (k,): their numbers; shore_before: its state when a step
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
        """From those of each node by itself: of a well that of its lowest node."""
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
        options = self.flow.blocks.options
        state = np.empty((self.n, kernels.STATE))
        at = x[self.lead]
        along = options.gx * at[:, 0] + options.gy * at[:, 1]
        if self.dim == 3:
            along += options.gz * at[:, 2]
        state[:, kernels.E] = -self.flow.fluid("fluid_density") * along
        own = self._own(u, state[:, kernels.E])
        state[:, kernels.P] = np.maximum(own, 0.0) * self.p0
        state[:, kernels.S] = np.minimum(1.0 + own, 1.0)
        return state

    def _own(self, u: np.ndarray, energy: np.ndarray) -> np.ndarray:
        """What the variable of each node would be by itself (n,)."""
        own = u.copy()
        for _, rows in self.wells:
            y, above = u[rows[0]], (energy[rows] - energy[rows].min()) / self.p0
            own[rows] = np.maximum(y - above, 0.0) if y > 0.0 else y
        return own

    def rooms(self, table: np.ndarray) -> np.ndarray:
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
        """What the nodes lack at these variables (n,) and positions of the blocks' nodes (nn, dim)."""
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
        flows = kernels.flows if threads == 1 else kernels.flows_threaded
        flows(threads, self.ends, self.law, self.laws, since, leaks, step.before, step.after, table, wet, q, lost)
        volume = self.rooms(table)
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
        came, room = float(plain[rows].sum()), max(float(volume[rows].sum()), 1e-300)
        lacks = came - asked.amount
        if asked.amount > 0.0 and math.isfinite(asked.limit):
            over = y - (asked.limit + float(np.ptp(energy[rows]))) / self.p0
            # Compared by what it would store: a larger weight lets Newton's method jump over the limit and back.
            at_limit = (over * room * self.p0 / self.bulk, over * room, None)
            ways = [(lacks, lacks, asked.amount), at_limit, (came, came, 0.0)]
            _, lacks, found = sorted(ways, key=lambda one: one[0])[1]
        elif asked.amount < 0.0 and (y + 1.0) * room <= lacks:
            lacks, found = (y + 1.0) * room, None
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
        begin, args = width * np.arange(self.m), (self.law, self.laws, corners, self.flow.viscosity, table)
        threads, of = self.flow.blocks.threads, kernels if dim == 2 else kernels_space
        near = begin if dim == 2 else begin[:, None] + 3 * np.arange(3)
        geometry = of.geometry if threads == 1 else of.geometry_threaded
        geometry(threads, near, near + (4 if dim == 2 else 9), *args)
        return table

    def _opens(self, x: np.ndarray, delta: np.ndarray) -> np.ndarray:
        """Derivatives of apertures delta (m,) of channels by the positions of their corners `at`, (m, dim corners)."""
        law = self.laws[self.law[:: LINKS[self.dim]]]
        moves = (delta > law[:, kernels.LEAST]) & (delta < law[:, kernels.MOST])
        dilate = law[:, kernels.DILATE, None]
        at, k = x[self.at], self.dim
        near, far = at[:, :k], at[:, k:]
        if k == 2:
            way = 0.5 * ((near[:, 1] + far[:, 0]) - (near[:, 0] + far[:, 1]))
            h = np.hypot(way[:, 0], way[:, 1])
            across, along = np.column_stack([way[:, 1], -way[:, 0]]) / h[:, None], way / h[:, None]
            slip = 0.5 * ((((far[:, 1] - near[:, 0]) + (far[:, 0] - near[:, 1])) * along).sum(axis=1))
            size, along = np.abs(slip), np.sign(slip)[:, None] * along
        else:
            middle = 0.5 * (near + far[:, [0, 2, 1]])
            across = np.cross(middle[:, 1] - middle[:, 0], middle[:, 2] - middle[:, 0])
            across /= np.linalg.norm(across, axis=1)[:, None]
            away = (far.sum(axis=1) - near.sum(axis=1)) / 3.0
            slip = away - (away * across).sum(axis=1)[:, None] * across
            size = np.linalg.norm(slip, axis=1)
            along = slip / np.maximum(size, 1e-300)[:, None]
        gains = law[:, kernels.DILATE] * size < law[:, kernels.GAIN]
        opens = across + np.where(gains[:, None], dilate, 0.0) * along
        side = np.repeat([-1.0, 1.0], k)[:, None] / k
        return (np.where(moves, 1.0, 0.0)[:, None, None] * side * opens[:, None, :]).reshape(self.m, -1)

    # ---- derivatives ---------------------------------------------------------------------------------------------

    def pieces(self, step: Step, now: Balance, u: np.ndarray, x: np.ndarray, first: int) -> list[Pieces]:
        """Derivatives for Newton's method, as pieces of a matrix (see linear.py) whose "nodes" from `first` on are flow
        nodes, then their packs if some bear: of channels, on rank 0, of faces of this rank, and of nodes, on rank 0."""
        rank = self.flow.blocks.comm.rank
        mine = slice(None) if rank == 0 else slice(0, 0)
        own = [Pieces(one.key[mine], one.node[mine], one.stiffness[mine]) for one in self._own_pieces(now, u, first)]
        made = [
            self._channel_pieces(step, now, u, x, first, mine), *own,
            *self._face_pieces(self._rises(u, now)[0], x, first + self.first, len(self.face_key)),
        ]  # fmt: skip
        if now.slow is not None:
            made.append(self._turbulent_pieces(step, now, u, first, mine))
        if now.packs is not None:
            packs = first + self.n + np.arange(self.n)
            made += self._pack_pieces(now, x, packs, mine)
            made += self._face_pieces(np.ones(self.n), x, packs, self.of_channels)
        return made

    def _pack_pieces(self, now: Balance, x: np.ndarray, packs: np.ndarray, mine: slice) -> list[Pieces]:
        """Of w - w(V) by w itself, and by the corners of the channels around each node. packs (n,): their "nodes"."""
        assert now.packs is not None
        dim, ends = self.dim, self.ends[mine]
        own = np.zeros((len(packs[mine]), dim, dim))
        own[:, 0, 0] = 1.0
        table = now.table[mine]
        by_x = self._opens(x, now.table[:: LINKS[dim], kernels.APERTURE])[self.of][mine]
        by_x *= (table[:, kernels.HALF] / table[:, kernels.APERTURE])[:, None]
        width = by_x.shape[1]
        out = np.zeros((len(ends), width + 2 * dim, width + 2 * dim))
        for end in range(2):
            out[:, width + dim * end, :width] = -now.packs[1, ends[:, end], None] * by_x
        nodes = np.column_stack([self.at[self.of][mine], packs[ends]])
        key = np.arange(self.n)[mine]
        return [Pieces(self.channels[self.of][mine], nodes, out), Pieces(key, packs[mine][:, None], own)]

    def _rises(self, u: np.ndarray, now: Balance) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of pressure and saturation (n,) by the variable that counts for each node."""
        full = (u > 0.0)[self.first]
        pressed = full & (~self.tied | (now.state[:, kernels.P] > 0.0))
        return np.where(pressed, self.p0, 0.0), np.where(full, 0.0, 1.0)

    def _own_pieces(self, now: Balance, u: np.ndarray, first: int) -> list[Pieces]:
        """Of storage; and nodes whose variable is another's are no unknowns of their own."""
        p_u, s_u = self._rises(u, now)
        room = np.maximum(now.volume, 1e-300)
        diagonal = np.where(now.held, room, now.volume * (s_u + p_u / self.bulk))
        tied = np.flatnonzero(self.tied)
        made = []
        for key, node, values in ((np.arange(self.n), self.first, diagonal), (tied, tied, room[tied])):
            stiffness = np.zeros((len(key), self.dim, self.dim))
            stiffness[:, 0, 0] = values
            made.append(Pieces(key, first + node[:, None], stiffness))
        return made

    def _channel_pieces(
        self, step: Step, now: Balance, u: np.ndarray, x: np.ndarray, first: int, mine: slice
    ) -> Pieces:
        """Of flow, leak-off and volume of channels by the variables at their ends and the corners of their faces."""
        ends, state = self.ends[mine], now.state
        delta, conduct, half, weight = now.table[mine].T
        m, dt = len(ends), step.dt
        p_u, s_u = self._rises(u, now)
        s_u = np.where(u[self.first] > -1.0, s_u, 0.0)
        p, s, e = (state[:, k][ends] for k in (kernels.P, kernels.S, kernels.E))
        s = np.maximum(s, 0.0)
        head = (p[:, 0] - p[:, 1]) + (e[:, 0] - e[:, 1]) * weight
        mean, down = 0.5 * (s[:, 0] + s[:, 1]), (head > 0.0) == (conduct > 0.0)
        up = np.where(down, s[:, 0], s[:, 1])
        wet = np.minimum(mean, up)
        part, slope = wet * wet * (3.0 - 2.0 * wet), 6.0 * wet * (1.0 - wet)
        of_mean = mean <= up
        by_s = np.column_stack([np.where(of_mean, 0.5, down), np.where(of_mean, 0.5, ~down)])
        sign = np.array([1.0, -1.0])
        by_u = conduct[:, None] * (
            part[:, None] * sign * p_u[ends] + (head * slope)[:, None] * by_s * s_u[ends]
        )  # of q
        leak_u = np.zeros((m, 2))
        at = np.flatnonzero(now.lost[mine] > 0.0)
        if len(at):
            over = 0.5 * p[at].sum(axis=1) - self.laws[self.law[mine][at], kernels.PORE]
            power = np.where(self.laws[self.law[mine][at], kernels.FRONT] > 0.0, 0.5, 1.0)
            held = mean[at]
            by_part = now.lost[mine][at] / np.maximum(held * held * (3.0 - 2.0 * held), 1e-300)
            leak_u[at] = 0.5 * (
                (now.lost[mine][at] * power / over)[:, None] * p_u[ends[at]]
                + (by_part * 6.0 * held * (1.0 - held))[:, None] * s_u[ends[at]]
            )
        by_x = self._opens(x, now.table[:: LINKS[self.dim], kernels.APERTURE])[self.of][mine]
        # Blocks that stand still need no columns.
        dim, first_row = self.dim, by_x.shape[1] if self.flow.blocks.options.mechanical else 0
        fill = state[:, kernels.S] + state[:, kernels.P] / self.bulk
        out = np.zeros((m, first_row + 2 * dim, first_row + 2 * dim))
        cubic = 3.0 if now.slow is None else np.where(now.slow[mine] < 1.0, 12.0 / 7.0, 3.0)  # of q by delta
        for end in range(2):
            row = first_row + dim * end
            out[:, row, first_row::dim] = sign[end] * dt * by_u + leak_u
            if first_row:
                stored = half / delta * fill[ends[:, end]]
                out[:, row, :first_row] = (stored + sign[end] * dt * cubic * now.q[mine] / delta)[:, None] * by_x
            out[now.held[ends[:, end]], row, :] = 0.0
        of_fluid = first + self.first[ends]
        nodes = np.column_stack([self.at[self.of][mine], of_fluid]) if first_row else of_fluid
        return Pieces(self.channels[self.of][mine], nodes, out)

    def _turbulent_pieces(self, step: Step, now: Balance, u: np.ndarray, first: int, mine: slice) -> Pieces:
        """Of turbulent flow by the pressures in a channel, beside those of its conductance: this goes with the size of
        the gradient to the power -3/7, so with the flows F into its nodes and the heads h along its links, -3/7 F F^T /
        sum(q h)."""
        assert now.slow is not None
        links = LINKS[self.dim]
        ends, q = self.ends[mine].reshape(-1, links, 2), now.q[mine].reshape(-1, links)
        state = now.state
        conduct, weight = (now.table[mine, k].reshape(-1, links) for k in (kernels.CONDUCT, kernels.WEIGHT))
        p, e = state[:, kernels.P][ends], state[:, kernels.E][ends]
        head = (p[..., 0] - p[..., 1]) + (e[..., 0] - e[..., 1]) * weight
        nodes = ends[:, 0] if links == 1 else ends[:, [1, 2, 0], 0]
        side = (ends[:, None, :, 1] == nodes[:, :, None]).astype(float) - (ends[:, None, :, 0] == nodes[:, :, None])
        # Of full channels the same twice: what is half full flows slower by the same gradient.
        into, full = ((side * flow[:, None]).sum(axis=2) for flow in (q, conduct * head))
        power = np.maximum((conduct * head * head).sum(axis=1), 1e-300)
        fast = now.slow[mine].reshape(-1, links)[:, 0] < 1.0
        rate = np.where(fast, -3.0 / 7.0 * step.dt, 0.0) / power
        values = (rate[:, None] * into)[:, :, None] * (full * self._rises(u, now)[0][nodes])[:, None, :]
        values[now.held[nodes]] = 0.0
        k, dim = nodes.shape[1], self.dim
        out = np.zeros((len(nodes), k * dim, k * dim))
        out[:, ::dim, ::dim] = values
        return Pieces(self.channels[mine], first + self.first[nodes], out)

    def _face_pieces(self, p_u: np.ndarray, x: np.ndarray, variable: np.ndarray, count: int) -> list[Pieces]:
        """Of the forces on the first `count` faces by variables at their ends: kernels.loads, and in space those on
        sides of hexahedra. p_u (n,): derivatives of pressures by them; variable (n,): their "nodes"."""
        if len(self.shore_node):  # there pressures follow the lowest node of a well, or nothing that is unknown
            shore = self.flow.state[len(self.held_rows) :, kernels.P]
            p_u = np.append(p_u, np.where((self.shore_node >= 0) & (shore > 0.0), p_u[self.shore_node], 0.0))
            variable = np.append(variable, variable[np.maximum(self.shore_node, 0)])
        at, dim = x[self.face_at[:count]], self.dim
        way = at[:, 1:] - at[:, :1]
        if dim == 2:
            normal = np.column_stack([way[:, 0, 1], -way[:, 0, 0]]) / 6.0
        else:
            normal = np.cross(way[:, 0], way[:, 1]) / 24.0
        weight = (1.0 + np.eye(dim)) * p_u[self.face_node[:count]][:, None]
        if dim == 2:
            return [self._pushed(slice(count), weight, normal, self.face_at[:count], variable)]
        half, fourth, g, e = (one[self.on_sides[0] < count] for one in self.on_sides)
        rest = np.delete(np.arange(len(at)), half)
        share = np.concatenate([weight[half], np.zeros((len(half), 1, dim))], axis=1)
        share -= g[:, :, None] * (e[:, :, None] * weight[half]).sum(axis=1)[:, None]
        ends = np.column_stack([self.face_at[half], fourth])
        return [
            self._pushed(rest, weight[rest], normal[rest], self.face_at[rest], variable),
            self._pushed(half, share, normal[half], ends, variable),
        ]

    def _pushed(
        self, of: slice | np.ndarray, weight: np.ndarray, normal: np.ndarray, ends: np.ndarray, variable: np.ndarray
    ) -> Pieces:
        """Of some faces (k,): weight (k, ends, dim) of each variable on each end, ends (k, ends): their nodes."""
        (k, m, dim), key = weight.shape, self.face_key[of]
        out = np.zeros((k, (m + dim) * dim, (m + dim) * dim))
        for end in range(m):
            for by in range(dim):
                out[:, dim * end : dim * end + dim, dim * (m + by)] = weight[:, end, by, None] * normal
        return Pieces(key, np.column_stack([ends, variable[self.face_node[of]]]), out)

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
        """What a well did in a step."""
        well.pressure = float(state[rows[np.argmax(state[rows, kernels.E])], kernels.P])
        well.rate = came / step.dt
        well.injected += came
        self.flow.tell_stage(well, step.before, step.after)


def reference_pressure(flow: Flow, stress: float) -> float:
    """p0 [Pa]: about the largest pressure that there is or will be; stress: of the rock, 0 if it stands still."""
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

"""The nodes at elements of a rank that do not move by themselves: of several corners, with conditions or loads, or of
elements whose forces are stored (kernels/nodes.py, in space kernels/space.py)."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hpcdem.core.memory import sparse_zeros
from hpcdem.halo.exchange import Halo
from hpcdem.numerics.on_threads import OnThreads
from hpcdem.physics.fdem import build, ghosts
from hpcdem.physics.fdem.kernels import nodes as moving
from hpcdem.physics.fdem.kernels import space
from hpcdem.physics.fdem.user_functions import Placed

if TYPE_CHECKING:
    from hpcdem.physics.fdem.loads import Loads
    from hpcdem.physics.fdem.node_conditions import NodeCondition
    from hpcdem.physics.fdem.state import State

ALPHA = 0.8
"""Local damping of the static mode."""
COLUMNS = {
    2: {"x": (moving.AT_X, moving.FORCE_X), "y": (moving.AT_Y, moving.FORCE_Y)},
    3: {axis: (space.AT + k, space.FORCE + k) for k, axis in enumerate("xyz")},
}
"""By dimensions, columns of value and force along an axis in the table of node conditions."""


def conditions_now(sim: State, placed: Placed, time: float, middle: float, dt: float) -> np.ndarray:
    """The table of node conditions, with a row of its own for each node whose condition is a function."""
    columns = COLUMNS[sim.dim]

    def how(one: NodeCondition, field: str) -> tuple[int, float, float]:
        kind, _, axis = field.partition("_")
        at, force = columns[axis]
        if kind == "force":
            return force, time, getattr(one, f"part_{axis}")
        velocity = getattr(one, f"does_{axis}") == moving.VELOCITY
        return (at, middle, 1.0) if velocity else (at, time, dt)

    return placed.filled(sim.conditions_at(time, middle, dt), how)


class NodeSet:
    """special (n_own, 4) bool: corners of owned elements at these nodes, there are `some`; shared: some have corners of
    other ranks. width: words of a row of forces; stride: from one corner of a row to the next.

    lead (n,): a corner, element * 4 + k, of each; begin (n + 1,), corner, place, again: see `build.place_nodes`, but
    corners of other ranks' elements, wanted (w,), have forces behind those of the rows of storage, which `halo` renews;
    mass (n,); kick: dt / mass; condition, share: rows of the table of conditions and the part of its force, where other
    ranks' elements are at the node; outside (n, dim), felt (n, 2 dim): forces from outside, and all."""

    kick: np.ndarray
    halo: Halo
    wanted: np.ndarray
    shared = False
    _table: np.ndarray | None
    _renewed: np.ndarray | None = None
    _kernel: OnThreads = moving.move

    def __init__(self, sim: State, special: np.ndarray, width: int, stride: int) -> None:
        self.sim, self.special, self.width, self.stride = sim, special, width, stride
        mesh, own = sim.the_mesh(), sim.owned
        number = sim.number[own]
        node = sim.node[number]
        real = node >= 0
        special[real] |= sim.shared_nodes[node[real]] | (sim.corner_row.reshape(-1, 4)[number][real] > 0)
        special &= real
        self.some = bool(special.any())
        nothing = np.empty(0, np.int64)
        mine = node[real]
        low = int(mine.min(initial=len(sim.shared_nodes)))
        scratch = np.full(max(int(mine.max(initial=-1)) + 1 - low, 0), -1, np.int32)
        args = sim.number, sim.n_left, sim.n_own, special, sim.node, sim.member_begin, low, scratch
        n = build.special_nodes(*args, nothing, nothing, nothing)
        self.lead, self._start, self._one = (np.empty(n, np.int64) for _ in range(3))
        if n:
            build.special_nodes(*args, self.lead, self._start, self._one)
        self.begin, self.mass = np.zeros(n + 1, np.int64), np.empty(n)
        lead = mesh.cells[self.lead // 4, self.lead % 4]
        row, part = sim.rows_of_nodes(self.lead, sim.node)
        self.functions = Placed(sim.acting(), row, mesh.points[lead])
        self.condition = self.functions.of
        self.share = np.where(np.isnan(part), self._one / np.maximum(sim.point_corners[lead], 1), part)
        self.outside, self.felt = np.zeros((n, sim.dim)), np.zeros((n, 2 * sim.dim))

    def find_corners(self) -> int:
        """Find the corners of the nodes. Returns a corner of an element of which no owner is known, or -1.
        Collective."""
        sim, own = self.sim, self.sim.owned
        m = int(self._one.sum())
        self.corner, self.place, self.again = (np.empty(m, np.int64) for _ in range(3))
        build.place_nodes(
            self.lead, self._start, self._one, sim.member, sim.where, sim.the_mesh().cells, sim.v.shape[1], self.width,
            self.stride, self.begin, self.corner, self.place, self.again,
        )  # fmt: skip
        row = self.corner // self.width
        away = np.flatnonzero((row < own.start) | (row >= own.stop))
        self.shared = sim.comm.any(len(away) > 0)
        self.wanted = np.empty(0, np.int64)
        return self._request(away) if self.shared else -1

    def _request(self, away: np.ndarray) -> int:
        """Request the forces at the corners `away` (k,), of other ranks' elements, from their owners. Returns a corner
        of which no owner is known, or -1. Collective."""
        sim = self.sim
        wanted, which = np.unique(self.code_of(self.corner[away]), return_inverse=True)
        owner = ghosts.owners(sim, wanted // 4)
        lost = int(wanted[owner < 0].max(initial=-1))
        if sim.comm.any(lost >= 0):
            return lost
        order = np.argsort(owner, kind="stable")
        place = np.empty(len(order), np.int64)
        place[order] = np.arange(len(order))
        self.corner[away] = self.width * len(sim.number) + self.stride * place[which]
        self.wanted, owner = wanted[order], owner[order]
        parcels = {p: self.wanted[owner == p] for p in np.unique(owner).tolist()}
        sends = {p: 4 * sim.where[came // 4] + came % 4 for p, came in sim.comm.exchange(parcels).items()}
        self.halo = Halo(sim.comm, 4 * len(sim.number), dict(sends), behind=True)
        sim.halo.followers.append(self.halo)
        return -1

    def code_of(self, corner: np.ndarray) -> np.ndarray:
        """Return the corners, element * 4 + k, by their positions in the forces (m,)."""
        row, k = np.divmod(corner, self.width)
        held = (row >= 0) & (row < len(self.sim.number))
        out = np.where(corner < 0, -1 - corner, 4 * self.sim.number[np.where(held, row, 0)] + k // self.stride)
        behind = corner >= self.width * len(self.sim.number)
        out[behind] = self.wanted[(corner[behind] - self.width * len(self.sim.number)) // self.stride]
        return out

    def table(self, some: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Make a table of zeros for forces at corners (4 rows + w, stride): those of the rows of storage, then those of
        other ranks' elements. Returns it, and its rows of storage (n, width). some: else one row, which nobody uses."""
        count = 4 * len(self.sim.number) if some else 4
        table = sparse_zeros((count + len(self.wanted) if some else count, self.stride))
        return table, table[:count].reshape(-1, self.width)

    def tables(self, loads: Loads, some: bool) -> tuple[np.ndarray, np.ndarray]:
        """Make that of loads, and return that of the forces, of which `move` renews the end with the least effort."""
        loads.at_corners, loads.applied = self.table(loads.some)
        table, rows = self.table(some)
        if self.shared:
            self.halo.add_ghost_field(table)
            self._renewed = table
        return table, rows

    def _fetch(self, table: np.ndarray) -> None:
        if table is self._renewed:
            self.halo.refresh()
        else:
            self.halo.fill(table)

    def masses_of_corners(self, mass: np.ndarray) -> np.ndarray:
        """Return masses of the corners (4 rows + w,) from those of rows (n, 4); those of other ranks' elements are what
        their owners have. Collective."""
        if not self.shared:
            return mass.reshape(-1)
        out = np.concatenate([mass.reshape(-1), np.empty(len(self.wanted))])
        self.halo.fill(out)
        return out

    def set_masses(self, mass: np.ndarray, dt: float) -> None:
        """Set the masses of nodes from those of corners (rows, 4), and the time step [s]. Collective."""
        sim = self.sim
        build.weigh(self.begin, self.corner, self.stride, self.masses_of_corners(mass), self.mass)
        self.kick = dt / self.mass
        self._table = None if sim.conditions_vary() else sim.conditions_at(0.0, 0.0, dt)

    @property
    def pulled(self) -> tuple[np.ndarray, np.ndarray]:
        """`begin` and `corner` of the corners that have forces."""
        return self.begin, self.corner

    def _where(self) -> tuple[np.ndarray, np.ndarray]:
        """Return where their corners are, as the kernel takes it besides."""
        return self.place, self.again

    def move(self, force: np.ndarray, loads: Loads) -> None:
        """New velocities from the forces on their corners, those of elements and loads; force: see `table`.
        Collective."""
        if not (self.some or self.shared):
            return
        sim, clock = self.sim, self.sim.clock
        loads.find()
        if self.shared:
            self._fetch(force)
            if loads.some:
                self._fetch(loads.at_corners)
        table = self._table
        if table is None:
            now, half = sim.time_now(), 0.5 * clock.dt if sim.options.dynamic else 0.0
            table = conditions_now(sim, self.functions, now, now + half, clock.dt)
        self._kernel.on(sim.threads)(
            sim.threads, self.begin, self.corner, *self._where(), self.kick, self.condition, self.share, table,
            loads.some, force, loads.at_corners, sim.v, 0.0 if sim.options.dynamic else ALPHA, self.outside, self.felt,
        )  # fmt: skip

    # ---- who they are ----------------------------------------------------------------------------------------------

    @cached_property
    def first_corners(self) -> np.ndarray:
        """Lowest corner (element * 4 + k) of each. Not to be changed."""
        out = self.lead.copy()
        several = self._start >= 0
        out[several] = self.sim.member[self._start[several]]
        return out

    @cached_property
    def mine(self) -> np.ndarray:
        """Return whether the lowest corner of each node is on an element of this rank, bool."""
        row, own = self.sim.where[self.first_corners // 4], self.sim.owned
        return (row >= own.start) & (row < own.stop)

    @cached_property
    def alone(self) -> np.ndarray:
        """(n_own, 4) bool: corners of owned elements that move by themselves. Not to be changed."""
        return ~self.special & (self.sim.the_mesh().cells[self.sim.number[self.sim.owned]] >= 0)


class NodeSetSpace(NodeSet):
    """Only the corners of nodes are kept. Of hexahedra only one corner at each of their points has forces."""

    _kernel = space.move
    _pulled: tuple[np.ndarray, np.ndarray] | None = None

    def pull(self, true_mass: np.ndarray) -> None:
        """Only corners with masses (rows, 4) have forces. Collective."""
        some = self.masses_of_corners(true_mass)[self.corner // self.stride] > 0.0
        before = np.concatenate([[0], np.cumsum(some)])
        self._pulled = before[self.begin], self.corner[some]

    @property
    def pulled(self) -> tuple[np.ndarray, np.ndarray]:
        return super().pulled if self._pulled is None else self._pulled

    def _where(self) -> tuple[np.ndarray, np.ndarray]:
        return self.pulled

    def find_corners(self) -> int:
        lost = super().find_corners()
        self.corner = self.corner.astype(np.int32)
        self.place = self.again = np.empty(0, np.int64)
        return lost

"""Flow nodes and channels of a rank: who holds them, what is in them, their apertures, what flows along their links.

A flow node belongs to the rank that owns the first element around it, which sees both faces of all channels that end
there; the state of nodes at the other ends comes by messages from their owners. Sums at a node go by the numbers of
channels, so the bits depend on neither ranks nor threads.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

from hpcdem.core.account import closed
from hpcdem.core.errors import PhysicsError
from hpcdem.physics.field.model import Travelling
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.assignments import FlowAssignments
from hpcdem.physics.flow.network import LINKS, TRIANGLE, at_nodes, links_of

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

_ACCOUNT = {"given": kernels.GIVEN, "leaked": kernels.LEAKED, "removed": kernels.REMOVED}
"""Columns of the nodes in the fluid account."""


class Slurry(Protocol):
    """Interface to the grains in the fluid; rows of nodes and channels are those of the flow. values: their
    properties."""

    values: dict[str, float]

    def check_start(self) -> None:
        """CommandError if it cannot move in this run. Collective."""

    def thicken(self, ends: np.ndarray, table: np.ndarray) -> None:
        """Conductance and weight of this rank's channels, in place. Not collective."""

    def everywhere(self, gathered: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray, np.ndarray], None]:
        """Conductance and weight of all channels of the model; gathered: values of all flow nodes from those of this
        rank."""

    def packs(self, gathered: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray] | None:
        """Return the function of volumes of nodes (n,) [m2] that gives the pressure of all packs, and its derivative:
        rows (2, n); None if no pack carries load."""

    def show(self, pushes: np.ndarray) -> None:
        """Packs of the nodes held here push with so much [Pa]. Not collective."""

    def filled(self) -> None:
        """A command has given fluid to nodes, or taken it."""

    def flowed(self) -> None:
        """The fluid has flowed by a step, also an implicit one. Collective."""


class Channels(Travelling, FlowAssignments):
    """number (n,): flow nodes owned here, ascending; nodes (n, kernels.NODE): what they hold; held (n + copies,):
    numbers of the first rows of state (n + copies + more, kernels.STATE). channels_here (m,): channels of this rank,
    ascending; sides: where the corners of both their faces begin in x (m, dim); channel_table (l, kernels.CHANNEL): of
    their links."""

    of_nodes: ClassVar[str] = "flow_nodes"
    columns: ClassVar[Mapping[str, tuple[str, int]]] = {
        "fluid": ("nodes", kernels.W), "volume": ("nodes", kernels.V), "given": ("nodes", kernels.GIVEN),
        "leaked": ("nodes", kernels.LEAKED), "removed": ("nodes", kernels.REMOVED),
        "inflow": ("nodes", kernels.INFLOW), "pressure": ("state", kernels.P), "saturation": ("state", kernels.S),
    }  # fmt: skip
    widths: ClassVar[Mapping[str, int]] = {"nodes": kernels.NODE, "state": kernels.STATE}
    nodes: np.ndarray

    def __init__(self, blocks: Blocks) -> None:
        FlowAssignments.__init__(self, blocks)
        Travelling.__init__(self)
        self._start_clock(blocks.clock.time)
        self.removed = dict.fromkeys(_ACCOUNT, 0.0)
        """Accounts of nodes that are gone [m2]."""
        self.held = np.empty(0, np.int64)
        self.frozen = False
        """Blocks have moved since flow was switched off: fluid that the pressures of now need is to be given."""
        self.slurry: Slurry | None = None
        """Grains in the fluid, which make it heavier and more viscous."""
        self.kept = np.empty(0)
        """Part of the fluid of this rank's nodes (n,) that the last change of channels left there."""
        self.carried: np.ndarray | None = None
        """Volumes [m2] that flowed along the channels of this rank in the last cycle; None: nobody asks."""
        self._leaked_before = np.empty(0)

    @property
    def owned(self) -> int:
        """Flow nodes of this rank. Not collective."""
        return len(self.number)

    @property
    def _on(self) -> bool:
        return self.blocks.options.hydraulic and len(self.network.channels) > 0

    # ---- tables ------------------------------------------------------------------------------------------------------

    def reach(self, blocks: Any, middle: np.ndarray) -> float:
        """Largest distance from the first element around a flow node to the others there [m]; middle (n_own, dim):
        of the owned elements."""
        network, comm = self.network, blocks.comm
        if not len(network.channels):
            return 0.0
        mesh, faces = blocks.the_mesh(), network.channels
        cells = mesh.cells
        torn = np.zeros(len(network.there), bool)
        torn[mesh.face_points(faces[blocks.open[faces]])] = True
        torn &= network.there
        if not torn.any():
            return 0.0
        total = len(cells)
        corner = np.arange(cells.size).reshape(cells.shape)
        use = (cells >= 0) & blocks.alive[:, None]
        first = np.full(len(torn), -1, np.int64)
        first[cells[use][::-1]] = corner[use][::-1] // 4
        own = cells[blocks.number]
        mine, k = np.nonzero((own >= 0) & torn[own])
        wanted, at, beside = first[own[mine, k]], mine, blocks.partner[4 * blocks.number[mine] + k]
        if mesh.dim == 3:  # all faces that end there
            at = np.repeat(np.flatnonzero(torn[own].any(axis=1)), 4)
            beside = blocks.partner[4 * blocks.number[at] + np.tile(np.arange(4), len(at) // 4)]
        other = (beside >= 0) & blocks.alive[beside // 4]
        mine, wanted = np.append(mine, at[other]), np.append(wanted, beside[other] // 4)
        home = blocks.number * comm.size // total
        _, number, places = comm.to_ranks(home, blocks.number, np.ascontiguousarray(middle))
        target = wanted * comm.size // total
        source, asked = comm.to_ranks(target, wanted)
        order = np.argsort(number)
        _, came = comm.to_ranks(source, places[order[np.searchsorted(number[order], asked)]])
        found = np.empty_like(came)
        found[np.argsort(target, kind="stable")] = came
        offset = middle[mine] - found
        return math.sqrt(float(comm.max_into(np.array([(offset * offset).sum(axis=1).max(initial=0.0)]))[0]))

    def _bind(self, loaded: np.ndarray, more: int) -> np.ndarray:
        """Elements have other rows or owners, or there are other channels. The state has rows of these flow nodes too
        (k,), and so many more behind. Rows of the state of all nodes of the mesh (np,), -1: they are not held here.
        Collective."""
        blocks, network = self.blocks, self.network
        leads = blocks.local.leads[network.nodes]
        row = blocks.where[leads // 4]
        own = (row >= blocks.owned.start) & (row < blocks.owned.stop)
        mine, leads, row = network.nodes[own], leads[own], row[own]
        at = blocks.where[np.column_stack([network.channels, blocks.partner[network.channels]]) // 4]
        beside = ((at >= blocks.owned.start) & (at < blocks.owned.stop)).any(axis=1)
        self.channels_here = network.channels[np.isin(network.corners, mine).any(axis=1) | beside]
        corners = blocks.the_mesh().face_points(self.channels_here)
        self._forget(~network.there[self.number])
        _, wanted = self._fetch(mine, np.setdiff1d(np.concatenate([corners.reshape(-1), loaded]), mine), more)
        self.held = np.concatenate([mine, wanted])
        local = np.full(len(network.there), -1, np.int64)
        local[self.held] = np.arange(len(self.held))
        self._corners = local[corners]
        self._ends = ends = links_of(self._corners)
        self._begin, self._channel, self._side = at_nodes(ends, len(mine))
        self._lead = row * blocks.x.shape[1] + blocks.local.stride * (leads % 4)
        self._q, self._lost_fluid = np.zeros(len(ends)), np.zeros(len(ends))
        self._sums = np.zeros((2, len(self.held)))
        self.note_leaks()
        self._law_table, self._slow = self.laws(), np.empty(len(ends))
        self.channel_table, self._flowing = (np.empty((len(ends), kernels.CHANNEL)) for _ in range(2))
        self.carried = None if self.carried is None else np.empty(0)
        self._leaked_before = np.empty(0)
        self._find_sides()
        self.find_geometry()
        return local

    def _find_sides(self) -> None:
        """Find both faces of this rank's channels, and their laws. PhysicsError on all ranks if a rank does not hold
        both. Collective."""
        blocks, faces = self.blocks, self.channels_here
        other = blocks.partner[faces]
        lost = faces[(blocks.where[faces // 4] < 0) | (blocks.where[other // 4] < 0)][:1]
        first = int(blocks.comm.max_into(np.append(lost, -1)[:1])[0])
        if first >= 0:
            raise PhysicsError(
                f"step {blocks.clock.step}: the channel on face {first} spans more than a column of "
                f"{blocks.rebuild_state.side:g} m: its sides have moved too far apart"
            )
        corners = blocks.the_mesh().face_corners
        self.sides = self._begins(corners(faces)), self._begins(corners(other))
        self._law = np.repeat((self.row[faces] - 1).astype(np.int64), LINKS[blocks.dim])

    def _begins(self, corner: np.ndarray) -> np.ndarray:
        """Start of corners, element * 4 + k, in x, flat."""
        return self.blocks.where[corner // 4] * self.blocks.x.shape[1] + self.blocks.local.stride * (corner % 4)

    def _book_gone(self, gone: np.ndarray) -> None:
        """Add the removed nodes to the account of removed fluid."""
        self.nodes[gone, kernels.REMOVED] += self.nodes[gone, kernels.W]
        for name, column in _ACCOUNT.items():
            self.removed[name] = self._sum(self.nodes[gone, column], self.removed[name])

    def _shrink(self) -> None:
        """Update the volumes of the nodes after a change of channels; fluid of volume that disappears is removed."""
        before = self.nodes[:, kernels.V].copy()
        self._find_volumes()
        self.kept = np.ones(len(self.number))
        if self.frozen and (self._on or self._reshaped):
            self._keep_pressures()
            self.frozen = not self._on
        elif self._reshaped:
            less = np.flatnonzero((self.nodes[:, kernels.V] < before) & (before > 0.0))
            self.kept[less] = self.nodes[less, kernels.V] / before[less]
            w = self.nodes[less, kernels.W] * self.kept[less]
            self.nodes[less, kernels.REMOVED] += self.nodes[less, kernels.W] - w
            self.nodes[less, kernels.W] = w
            self._find_state(slice(None))

    def _keep_pressures(self) -> None:
        """Keep pressures and saturations: the fluid required is supplied, and fluid without volume is removed."""
        p, s = self.state[: self.owned, kernels.P], self.state[: self.owned, kernels.S]
        w = self.nodes[:, kernels.V] * (s + p / self.fluid("fluid_bulk"))
        self.nodes[:, kernels.GIVEN] += w - self.nodes[:, kernels.W]
        self.nodes[:, kernels.W] = w

    def note_leaks(self, broken: np.ndarray | None = None) -> None:
        """Leak-off begins where a joint is open, or among these that broke, and has it. Not collective."""
        channels = self.network.channels
        at = channels[self.blocks.open[channels]]
        if broken is not None:
            at = np.union1d(at, channels[np.isin(channels, broken)])
        new = at[(self.column("leak_off")[self.row[at]] > 0.0) & np.isinf(self.since[at])]
        self.since[new] = self.time
        self._since = np.repeat(self.since[self.channels_here], LINKS[self.blocks.dim])
        self._leaks = bool(np.isfinite(self.since).any())

    def find_geometry(self) -> None:
        """Apertures and conductances where the blocks are now. Not collective."""
        blocks, to = self.blocks, self.channel_table
        kernels.geometry(blocks.threads, *self.sides, self._law, self._law_table, blocks.x, self.viscosity, to)
        if self.slurry is not None:
            self.slurry.thicken(self._ends, self.channel_table)

    def update_volumes(self) -> None:
        """Room of nodes where the blocks are now. Not collective."""
        self.find_geometry()
        self._find_volumes()

    def _find_volumes(self) -> None:
        kernels.volumes(self._begin, self._channel, self.channel_table, self.nodes)

    def _find_state(self, at: np.ndarray | slice) -> None:
        """Pressure and saturation of owned nodes from their fluid."""
        w, v = self.nodes[at, kernels.W], self.nodes[at, kernels.V]
        full = w >= v
        own = self.state[: len(self.number)]
        own[at, kernels.P] = np.where(full, self.fluid("fluid_bulk") * ((w - v) / v), 0.0)
        own[at, kernels.S] = np.where(full, 1.0, w / v)

    def _take_heights(self) -> None:
        """Potential energy of the owned nodes, where the first element around each has them."""
        flat, rho = self.blocks.x.reshape(-1), self.fluid("fluid_density")
        along = sum(g * flat[self._lead + k] for k, g in enumerate(self._gravity()))
        self.state[: len(self.number), kernels.E] = -rho * along

    # ---- what flows --------------------------------------------------------------------------------------------------

    def slowness(
        self, ends: np.ndarray, table: np.ndarray, state: np.ndarray, out: np.ndarray | None = None
    ) -> np.ndarray | None:
        """Flow (m,) over that of the cubic law in links with these ends (m, 2) and table, by the state of nodes, in
        `out` if it is given; None: it is laminar at any Reynolds number. Not collective."""
        if not self.fluid("turbulence") > 0.0:
            return None
        out = np.empty(len(ends)) if out is None else out
        kernels.slowness(LINKS[self.blocks.dim], ends, table, self.fluid("fluid_density"), state, out)
        return out

    def _flowing_table(self) -> np.ndarray:
        """The table of links, where flow is turbulent with the conductances of this moment. Not collective."""
        slow = self.slowness(self._ends, self.channel_table, self.state, self._slow)
        if slow is None:
            return self.channel_table
        np.copyto(self._flowing, self.channel_table)
        self._flowing[:, kernels.CONDUCT] *= slow
        return self._flowing

    def _find_flows(self, dt: float) -> None:
        kernels.flows(
            self.blocks.threads, self._ends, self._law, self._law_table, self._since, self._leaks, self.time,
            self.time + dt, self._flowing_table(), self.state, self._q, self._lost_fluid,
        )  # fmt: skip

    def mean_flows(self) -> np.ndarray:
        """Flow (m,) [m2/s] of the links of this rank's channels from their first end on: the mean of the last cycle, of
        which `carried` is kept, or where flow is switched off that of this moment. Not collective."""
        if self.carried is None or not self.blocks.options.hydraulic or len(self.carried) != len(self._ends):
            self._find_flows(0.0)
            return self._q
        return self.carried / (self.sub_steps * self.dt)

    def leaked(self) -> np.ndarray:
        """Leak-off of each of this rank's nodes (n,) to the rock in the last cycle [m2], if `carried` is kept; nothing
        while flow is switched off. Not collective."""
        nodes = self.nodes[:, kernels.LEAKED]
        if self.carried is None or not self.blocks.options.hydraulic or len(self._leaked_before) != len(nodes):
            return np.zeros(len(nodes))
        return nodes - self._leaked_before

    def limit(self) -> float:
        """The longest sub-step that is stable, with a factor of two in reserve [s]."""
        args = self._begin, self._channel, self._ends, self.channel_table, self.nodes, self.state
        least = kernels.longest_step(*args, self.fluid("fluid_bulk"))
        return float(self.blocks.comm.min_into(np.array([least]))[0])

    # ---- queries -----------------------------------------------------------------------------------------------------

    @property
    def links(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Rows of the ends (m, 2) of the links of this rank's channels, and links by its nodes, see network.at_nodes.
        Not collective."""
        return self._ends, self._begin, self._channel, self._side

    def apertures(self) -> np.ndarray:
        """Apertures of this rank's channels [m], read-only. Not collective."""
        return self.channel_table[:: LINKS[self.blocks.dim], kernels.APERTURE]

    def fluxes(self) -> np.ndarray:
        """Compute the flow in this rank's channels (m,) [m2/s] from `_q`: from the first corner on, in space its size:
        that of sum q_ij (x_j - x_i) / A, exact for a pressure that is linear, as half of sum cot(angle) e e^T over the
        sides of a triangle is A. Not collective."""
        if LINKS[self.blocks.dim] == 1:
            return self._q
        x, (one, other) = self.blocks.x.reshape(-1), (of[..., None] + np.arange(3) for of in self.sides)
        at = 0.5 * (x[one] + x[other[:, TRIANGLE.facing]])
        offset = at[:, [2, 0, 1]] - at[:, [1, 2, 0]]
        area = 0.5 * np.linalg.norm(np.cross(offset[:, 0], offset[:, 1]), axis=1)
        return np.linalg.norm((self._q.reshape(-1, 3, 1) * offset).sum(axis=1), axis=1) / area

    def account(self) -> dict[str, float]:
        """Volumes of fluid at its density without pressure, since there are channels [m2]: given by conditions and at
        the beginning, stored, leaked into the rock, removed with channels that were taken away; closing: what does not
        add up, relative: that over the largest."""
        self.blocks.close_model()
        found = {"stored": self._sum(self.nodes[:, kernels.W])}
        for name, column in _ACCOUNT.items():
            found[name] = self._sum(self.nodes[:, column], self.removed[name])
        return closed(found, found["given"] - found["stored"] - found["leaked"] - found["removed"])

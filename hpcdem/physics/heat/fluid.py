"""Heat in the fluid of channels: conduction and advection along them, exchange with the rock on both sides.

A flow node holds the heat rho C W T, W: its fluid at the density without pressure; so what flows out of one node flows
into another one. Fluid that comes or goes otherwise (conditions, wells, leak-off) has the temperature of its node. The
fluid has sub-steps of its own, as short as flow needs them; meanwhile the rock stays as it is and gets the sum of what
the walls took. Owners of nodes and their neighbours are those of the flow.

In space a channel is three links, as in the flow. Nodes own their parts of a triangle up to its medians, so a link
carries what crosses the piece of median between its ends (physics/proppant/kernels.py), conducts by the cotangent
of the angle opposite it, and passes a sixth of the triangle's heat on to each wall at each end: every corner gets a
third. Areas and volumes are those of the whole triangle: m3 for m2, J for J/m, W/K for W/(m K).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import reduce
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.fdem.properties import JOINT
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.field import assigned
from hpcdem.physics.field.model import MANY, Assigned, Travelling
from hpcdem.physics.flow import kernels as flowing
from hpcdem.physics.flow.network import LINKS, SHAPES, conducting, links_of
from hpcdem.physics.heat import kernels
from hpcdem.physics.heat.properties import FLUID_HEAT

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks
    from hpcdem.physics.flow.model import Flow


class Rock(Protocol):
    """Interface to the heat of elements that the fluid uses, see `Heat`."""

    blocks: Blocks
    t: np.ndarray
    accounts: dict[str, float]


SAFETY = 0.9
"""Fraction of the stability limit up to which a sub-step is accepted."""
SCANT = 1e-4
"""Fraction of its volume below which the fluid of a node does not limit sub-steps: it takes the temperature of the
fluid that passes."""
LEAST = 1e-3
"""Smallest length of a link along the flow, over its own length."""


class FluidHeat(Assigned, Travelling):
    """The heat of the fluid of a model with heat. Methods are collective unless they say otherwise.

    row (4 ne,): of the table of properties, by joint, 0: none; held (np,): row of the prescribed temperatures of the
    heat, by node, 0: none; number (n,): flow nodes owned here; given, had (n,): heat that came with fluid and by
    conditions [J/m], and the fluid at the end of the last cycle [m2]; state (n + copies, kernels.FLUID_STATE): of them
    and of other ranks' nodes beside this rank's elements.
    """

    of_objects: ClassVar[str] = JOINT
    model = FLUID_HEAT
    kind_of_model: ClassVar[str] = "thermal"
    alike: ClassVar[tuple[str, ...]] = ("conductivity", "capacity", "second_order")
    of_nodes: ClassVar[str] = "fluid_heat"
    columns: ClassVar[Mapping[str, tuple[str, int]]] = {
        "temperature": ("state", kernels.T), "given": ("given", -1), "had": ("had", -1),
    }  # fmt: skip
    widths: ClassVar[Mapping[str, int]] = {"state": kernels.FLUID_STATE, "given": 0, "had": 0}
    given: np.ndarray
    had: np.ndarray

    def __init__(self, heat: Rock, flow: Flow) -> None:
        Assigned.__init__(self, heat.blocks)
        Travelling.__init__(self)
        self.heat, self.flow = heat, flow
        self.held = np.zeros(len(self.blocks.the_mesh().points), np.int32)
        self.rho_c = 0.0
        self.sub_steps = 0
        self.rate = 0.0
        self._warned_obtuse = False
        self._new = np.empty(0, np.int64)
        flow.carried = np.empty(0)
        flow.more["temperature"] = lambda: self.state[: len(self.number), kernels.T]

    # ---- what is given --------------------------------------------------------------------------------------------

    def assign(self, joints: np.ndarray | None, given: Mapping[str, Value]) -> None:
        """Channels among these joints (None: all channels) have these properties; the fluid of those that had none has
        the temperature of the rock beside it."""
        at = self.flow.network.channels if joints is None else self.blocks.numbers_of_joints(joints)
        dry = at[self.flow.row[at] == 0]
        if len(dry) or not len(at):
            which = f"joint {dry[0]} is no channel" if len(dry) else "no channels yet"
            raise CommandError(f"{which}: assign face-joint c-model hydraulic-porous-medium first")
        super().assign(at, given)

    def prescribe(self, nodes: np.ndarray | None, row: int) -> None:
        """Fluid at flow nodes among these points (None: all) has this row of the prescribed temperatures."""
        at = self.flow.flow_nodes(nodes)
        with self.changing():
            self.held[at] = row

    def initial(self, points: np.ndarray, temperature: float) -> None:
        """Flow nodes among these points (n,) have this temperature now."""
        self.blocks.close_model()
        mine = np.isin(self.number, points)
        before = self.content()
        self.state[: len(self.number)][mine, kernels.T] = temperature
        self.heat.accounts["commands"] += self.content() - before
        self._refresh()

    def check(self) -> None:
        """CommandError if a channel lacks a thermal model. Not collective."""
        channels = self.flow.network.channels
        bare = channels[self.row[channels] == 0]
        if self.rows and len(bare):
            raise CommandError(
                f"channel {bare[0]} has no thermal model ({len(bare)} in all), but other channels have one: assign "
                "face-joint c-model thermal-fluid to all"
            )

    # ---- what is queried -------------------------------------------------------------------------------------------

    @property
    def on(self) -> bool:
        """Return whether there are channels with heat."""
        return bool(self.rows) and len(self.flow.network.channels) > 0

    def content(self) -> float:
        """Heat in the fluid [J/m], above the zero of the scale, at the end of the last cycle."""
        return exact_sum(self.rho_c * self.had * self.state[: len(self.number), kernels.T], self.blocks.comm)

    # ---- tables of this rank -------------------------------------------------------------------------------------

    def bind(self) -> None:
        """Elements have other rows or owners, there are other channels, or something was set."""
        blocks, flow = self.blocks, self.flow
        self._forget(~flow.network.there[self.number])
        if not self.on:
            return
        mine, channels = flow.number, flow.channels_here
        new, _ = self._fetch(mine, flow.held[len(mine) :])
        self._new = np.flatnonzero(new)
        self._ends, self._begin, self._channel, self._side = flow.links
        corner = self.walls(channels)
        row = blocks.where[corner // 4]
        self._walls = np.ascontiguousarray(np.where(row >= 0, row * self.heat.t.shape[1] + corner % 4, -1))
        self._sides, self._length_over_width, part_of_wall = self.shapes(channels)
        self._exchange = part_of_wall * np.repeat(self.transfers(channels), self.links)
        self._length = reduce(np.hypot, self._sides.T)
        self.wall_heat = np.zeros((len(self._ends), 4))
        self._held = self.held[mine].astype(np.int64) - 1
        self._warn_obtuse()

    def _warn_obtuse(self) -> None:
        """Report flat triangles that conduct from cold to warm, as flat tetrahedra do (model.py). Rank 0 only."""
        log, network = self.blocks.log, self.flow.network
        if self._warned_obtuse or log is None or self.links == 1 or self.constant("conductivity") == 0.0:
            return
        self._warned_obtuse = True
        ends = np.sort(network.ends, axis=1)
        _, at = np.unique(ends[:, 0] * len(network.there) + ends[:, 1], return_inverse=True)
        each = 1.0 / self.shapes(network.channels)[1]
        total, size = (np.bincount(at.reshape(-1), one) for one in (each, np.abs(each)))
        against = int((total < -1e-12 * size).sum())
        if against:
            log.warn_once(
                "obtuse channels",
                f"{against} of {len(total)} edges have negative conductance in the fluid, as angles of triangles are "
                "obtuse: at low flow, temperatures may leave the range of their neighbours",
            )

    def _book_gone(self, gone: np.ndarray) -> None:
        comm, accounts = self.blocks.comm, self.heat.accounts
        accounts["removed"] += exact_sum(self.rho_c * self.had[gone] * self._column("temperature")[gone], comm)
        accounts["given"] += exact_sum(self.given[gone], comm)

    def take_new(self) -> None:
        """New nodes have the temperature of the rock around them; what all hold by the present capacity."""
        before = self.content()
        n, t = len(self.number), self.heat.t.reshape(-1)
        for i in self._new.tolist():
            at = slice(self._begin[i], self._begin[i + 1])
            first = np.where(self._side[at] < 0.0, 0, 2)
            walls = np.column_stack([first, first + 1])
            self.state[i, kernels.T] = t[self._walls[self._channel[at][:, None], walls]].mean()
        self.had[self._new] = self.flow.nodes[self._new, flowing.W]
        self._new = self._new[:0]
        self.rho_c = self.flow.fluid("fluid_density") * self.constant("capacity")
        self.heat.accounts["commands"] += self.content() - before
        self.state[:n, kernels.U] = self.state[:n, kernels.T]
        self._refresh()

    def transfers(self, channels: np.ndarray) -> np.ndarray:
        """Transfer coefficients of channels (m,) [W/(m2 K)]. Not collective."""
        return self.column("transfer_coeficient")[self.row[channels]]

    @property
    def links(self) -> int:
        """Links of each channel."""
        return LINKS[self.blocks.dim]

    def walls(self, channels: np.ndarray) -> np.ndarray:
        """Corners (l, 4), element * 4 + k, beside the links of channels (m,): at each end on the lower face and on the
        other one. Not collective."""
        mesh = self.blocks.the_mesh()
        other = mesh.face_corners(self.blocks.partner[channels])[:, SHAPES[self.blocks.dim].facing]
        sides = links_of(mesh.face_corners(channels)), links_of(other)
        return np.stack(sides, axis=2).reshape(-1, 4)

    def shapes(self, channels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`network.conducting` of channels (m,), in the mesh. Not collective."""
        return conducting(self.blocks.reference.points[self.blocks.the_mesh().face_points(channels)])

    def lengths(self, sides: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Compute the lengths of links (l,) along the flow in their channels [m], never exactly 0; sides (l, dim): from
        end to end [m]. Not collective."""
        length = reduce(np.hypot, sides.T)
        if self.links == 1:
            return length
        flow = np.repeat((sides * q[:, None]).reshape(-1, 3, 3).sum(axis=1), 3, axis=0)
        size = np.linalg.norm(flow, axis=1)
        along = np.abs((sides * flow).sum(axis=1)) / np.where(size > 0.0, size, 1.0)
        return np.maximum(np.where(size > 0.0, along, length), LEAST * length)

    def put(self, nodes: np.ndarray, t: np.ndarray, brought: np.ndarray) -> None:
        """Nodes (n,) have these temperatures, after an implicit step in which so much heat [J/m] came from outside."""
        at, own = np.searchsorted(nodes, self.number), self.state[: len(self.number)]
        w = self.flow.nodes[:, flowing.W]
        self.given += brought[at] + self.rho_c * (w - self.had) * own[:, kernels.T]  # what came before has its old one
        own[:, kernels.T], self.had = t[at], w.copy()
        self._refresh()

    def add_to_limit(self, corner: np.ndarray) -> None:
        """Add the largest heat that walls can pass to corners (flat) per degree [W/(m K)]. Not collective."""
        there = self._walls >= 0
        np.add.at(corner, self._walls[there], np.repeat(self._exchange, 4)[there.reshape(-1)])

    def begin_cycle(self, period: float) -> None:
        """Flow of a cycle of heat that takes so long [s]: the mean of the last cycle of flow, or that of this moment
        where it is at rest."""
        flow, n = self.flow, len(self.number)
        q, delta = flow.mean_flows(), np.repeat(flow.apertures(), self.links)
        w0, w, volume = self.had, flow.nodes[:, flowing.W], flow.nodes[:, flowing.V]
        least = np.minimum(w0, w)
        self._period, self._passed, self._w0, self._leaked = period, 0.0, w0.copy(), flow.leaked()
        wet = np.minimum(np.divide(least, volume, out=np.zeros(n), where=volume > 0.0), 1.0)
        self.state[:n, kernels.S], self.state[:n, kernels.X], self.state[:n, kernels.FULL] = wet, part(wet), w0
        self._refresh()
        self._q, wet = self.crossing(q, self.state[:, kernels.S], self._ends, flow.held[self._ends])
        self._conduct = self.constant("conductivity") * delta * wet / self._length_over_width
        self._second = self.constant("second_order") > 0.0
        if self._second and self.links > 1:
            self._length = self.lengths(self._sides, self._q)
        self.rate = self._least_rate(w0, w, least)

    def crossing(
        self, q: np.ndarray, s: np.ndarray, ends: np.ndarray, points: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compute the flows along links (l,) and the least saturation of their channels; s (n,): of nodes, ends (l, 2):
        rows of them, points (l, 2): of the mesh. In a full triangle it is what crosses the medians; the less a corner
        holds, the less of what only goes around, as that would have to pass through it. Between held nodes, which have
        inflow at the same place, nothing is carried: a front begins at them. Not collective."""
        least = np.minimum(s[ends[:, 0]], s[ends[:, 1]])
        if self.links > 1:
            least = np.repeat(least.reshape(-1, self.links).min(axis=1), self.links)
            q = q - part(least) * np.repeat(q.reshape(-1, self.links).mean(axis=1), self.links)
            q[(self.held[points] > 0).all(axis=1)] = 0.0
        return q, least

    def _least_rate(self, w0: np.ndarray, w: np.ndarray, least: np.ndarray) -> float:
        """Sub-steps of this cycle over its length [1/s] that keep temperatures between those around them: what flows
        in and, of second order, out is never more than the node holds after a sub-step, as its fluid goes from w0 to
        w (n,); least (n,): of both [m2]."""
        ends, period, total = self._ends, self._period, len(self.state)
        passes = np.zeros(len(w))
        for end in range(2):
            into = self._q if end else -self._q
            counts = np.abs(into) if self._second else np.maximum(into, 0.0)
            passes += np.bincount(ends[:, end], counts, total)[: len(w)]
        more = (np.maximum(w - w0, 0.0) + self._leaked) / period if period > 0.0 else 0.0
        scant = SCANT * self.flow.nodes[:, flowing.V]
        there = least > scant
        most = np.where(there, least, w)
        rate = np.divide(np.where(there, np.maximum(passes - more, 0.0), 0.0), most, out=np.zeros(len(w)),
                         where=most > 0.0)  # fmt: skip
        drained = ~there & (w > scant)  # filled just now: what has come in is all that is there
        rate[drained] = np.maximum(passes[drained] / (w + self._leaked)[drained] - 1.0 / period, 0.0)
        conduct = self._conduct if self.links == 1 else np.maximum(self._conduct, 0.0)
        for end in range(2):
            passed = np.bincount(ends[:, end], conduct, total)[: len(w)]
            rate += np.divide(passed, self.rho_c * least, out=np.zeros(len(w)), where=there)
        return float(self.blocks.comm.max_into(np.array([rate.max(initial=0.0)]))[0])

    def _find_upstream(self) -> None:
        n, t = len(self.number), self.heat.t.reshape(-1)
        kernels.upstream(self._begin, self._channel, self._side, self._ends, self._q, self._length, self._held,
                         self.state[:n], self.state)  # fmt: skip
        kernels.rises(self._begin, self._channel, self._side, self._ends, self._conduct, self._walls, self._exchange, t,
                      self._held, self.rho_c, self.state[:n], self.state)  # fmt: skip
        self._refresh()

    def advance(self, dt: float, table: np.ndarray) -> None:
        """The fluid during a sub-step of the rock dt [s]; `wall_heat` (m, 4) [W/m] is the mean of what its walls get.
        table: prescribed temperatures."""
        n, t = len(self.number), self.heat.t.reshape(-1)
        count = max(1, math.ceil(dt * self.rate / SAFETY * (1.0 - 1e-12)))
        if count > MANY:
            raise CommandError(
                f"heat in the fluid would need {count} sub-steps in one of the rock of {dt:.3g} s. Reduce these by "
                "model time-step thermal, or use implicit steps (model solve thermal)"
            )
        self.sub_steps = count
        w1 = self.flow.nodes[:, flowing.W]
        short = dt / count
        self.wall_heat[:] = 0.0
        face, fresh = np.empty(len(self._ends)), np.empty(n)
        lost = short / self._period * self._leaked if self._period > 0.0 else self._leaked
        for k in range(count):
            share = min(1.0, (self._passed + (k + 1) * short) / self._period) if self._period > 0.0 else 1.0
            w = self._w0 + share * (w1 - self._w0) if share < 1.0 else w1.copy()
            if self._second:
                self._find_upstream()
            kernels.faces(self._ends, self._q, self._length, self._second, short, self.state, face)
            kernels.carry(
                short, self._begin, self._channel, self._side, self._ends, self._q, face, self._conduct, self._walls,
                self._exchange, t, self._held, table, self.had, w,
                lost, self.rho_c, self.state, fresh, self.given,
            )  # fmt: skip
            self.state[:n, kernels.T], self.state[:n, kernels.FULL], self.had = fresh, w, w
            self._refresh()
            kernels.to_walls(short / dt, self._ends, self._walls, self._exchange, t, self.state, self.wall_heat)
        self._passed += dt

    def add_wall_heat(self, q: np.ndarray) -> None:
        """Add what the walls get to the heat at corners q (flat) [W/m]. Not collective."""
        kernels.from_walls(self._walls, self.wall_heat, q)

    # ---- state on disk -------------------------------------------------------------------------------------------

    def saved_state(self) -> dict[str, Any]:
        """State as JSON values."""
        return {"rows": self._saved_properties(), "rho_c": self.rho_c}

    def saved_tables(self) -> dict[str, dict[str, np.ndarray]]:
        """Channels with their properties, prescribed nodes, of all ranks."""
        rows = {"heat_channels": self.row, "heat_flow_nodes": self.held}
        return {name: assigned.numbered(row) for name, row in rows.items()}

    def restore(self, state: Mapping[str, Any], tables: Mapping[str, Mapping[str, np.ndarray]]) -> None:
        """Inverse of these."""
        self._restore_properties(state["rows"])
        self.rho_c = state["rho_c"]
        assigned.put_back(self.row, tables["heat_channels"])
        assigned.put_back(self.held, tables["heat_flow_nodes"])
        self._restore_rows(tables)


def part(s: np.ndarray) -> np.ndarray:
    """Part of the exchange at saturations (n,), that of the transmissivity: kernels.part of the flow."""
    return s * s * (3.0 - 2.0 * s)

"""Fluid in fractures as a load on blocks: what is said of it, its clock and its step.

What is said (channels, conditions) is known to all ranks by the numbers of the mesh. What moves is shared out: a flow
node belongs to the rank that owns the first element around it, which sees both faces of all channels that end there;
state of nodes at the other ends comes by messages from their owners. Sums at a node go by the numbers of channels, so
the bits depend on neither ranks nor threads.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

from hpcdem.core.account import closed
from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.core.units import counted, with_prefix
from hpcdem.physics.fdem.groups import CHANNEL, FLOW_NODE, JOINT
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.field import assigned
from hpcdem.physics.field.assigned import Number
from hpcdem.physics.field.model import Assigned, Field, Travelling
from hpcdem.physics.flow import account, kernels, kernels_space
from hpcdem.physics.flow.network import LINKS, Network, around, at_nodes, faces_of, links_of, sides_and_free
from hpcdem.physics.flow.properties import FLUID, POROUS
from hpcdem.physics.flow.wells import PRESSURE as HELD
from hpcdem.physics.flow.wells import QUANTITIES as OF_WELLS
from hpcdem.physics.flow.wells import RATE, Asked, Stage, Well

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

LOOK = 100
"""Cycles of flow after which an estimated sub-step is estimated again."""
GLANCE = 8
"""Sub-steps after which it is seen whether one has come to half the stability limit before that: pieces that turn as
they fly apart shorten their channels faster than a look comes."""
SAFETY = 0.8
"""Part of half the stability limit that an estimated sub-step may be when blocks move."""
FAR = 2.0
"""Times the stability limit: where a sub-step is longer any full node that nothing holds overshoots ever further."""
MANY = 100_000
"""Sub-steps in a cycle that are too many to be meant."""
_PROPERTIES = tuple(one.name for one in POROUS.properties)
_COLUMNS = ("fluid", "volume", "given", "leaked", "removed", "inflow", "pressure", "saturation")
"""Of nodes, as they are saved: kernels.W .. INFLOW, then P and S."""
_ACCOUNT = {"given": kernels.GIVEN, "leaked": kernels.LEAKED, "removed": kernels.REMOVED}
"""Columns of nodes in the account."""
BY_CONDITION, BY_WELL = 1, 2
"""Bits of what says that water stands before a face, should it be free."""


@dataclass(frozen=True)
class Condition:
    """What is prescribed at a flow node: kernels.FREE, PRESSURE [Pa], SURFACE (its height [m] against gravity) or RATE
    [m2/s]."""

    does: int = kernels.FREE
    value: Number = 0.0


NODE_QUANTITIES: dict[str, tuple[str, str]] = {
    "pressure": ("Pa", "pressure of the fluid"),
    "saturation": ("1", "part of the room that is filled"),
    "fluid": ("m2", "volume of the fluid at its density without pressure"),
    "volume": ("m2", "room for fluid: half of each channel"),
    "inflow": ("m2/s", "fluid that a condition brings, in the last sub-step"),
    "temperature": ("K", "temperature of the fluid; NaN without a thermal model of it"),
    "concentration": ("1", "volume of proppant over that of the slurry; NaN without proppant"),
    "proppant": ("m2", "volume of proppant; NaN without it"),
    "pack_pressure": ("Pa", "what a pack of proppant presses its walls apart with; NaN without proppant"),
}
CHANNEL_QUANTITIES: dict[str, tuple[str, str]] = {
    "pressure": ("Pa", "mean pressure of its ends"),
    "saturation": ("1", "mean saturation of its ends"),
    "aperture": ("m", "hydraulic aperture"),
    "flow_rate": ("m2/s", "volume that flows along the lower face of the joint, from its first corner on"),
    "velocity": ("m/s", "that over the aperture"),
    "temperature": ("K", "mean temperature of the fluid at its ends; NaN without a thermal model of it"),
    "concentration": ("1", "mean concentration of proppant at its ends; NaN without it"),
    "pack_pressure": ("Pa", "mean pressure of packs at its ends; NaN without proppant"),
}
_OF_OTHERS = ("temperature", "concentration", "proppant", "pack_pressure")
"""Of these, what other physics keep."""
QUANTITIES = {FLOW_NODE: NODE_QUANTITIES, CHANNEL: CHANNEL_QUANTITIES}
"""What can be asked of flow nodes and channels: unit and meaning."""


@dataclass
class Shore:
    """Corners of wet free faces at which no channel ends: what is said of them gives the pressure there.

    at (k,): where they begin in x, flat; row (k,): of the conditions; node (k,): points of the mesh, the lowest flow
    node of their well, -1: they belong to none; ref (k,): its row in the state; apart (k, dim): from that node to the
    corner, in the mesh [m], as the node may be in motion on another rank.
    """

    at: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    row: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    node: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    ref: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    apart: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))

    def __len__(self) -> int:
        return len(self.at)


class Slurry(Protocol):
    """What grains in the fluid do to it; rows of nodes and channels are those of the flow. values: their properties."""

    values: dict[str, float]

    def check_start(self) -> None:
        """CommandError if it cannot move in this run. Collective."""

    def thicken(self, ends: np.ndarray, table: np.ndarray) -> None:
        """Conductance and weight of this rank's channels, in place. Not collective."""

    def everywhere(self, gathered: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray, np.ndarray], None]:
        """The same for all channels of the model; gathered: values of all flow nodes from those of this rank."""

    def packs(self, gathered: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray] | None:
        """None if no pack bears; else what all packs push with in rooms of nodes (n,) [m2], and its derivative: rows
        (2, n)."""

    def show(self, pushes: np.ndarray) -> None:
        """Packs of the nodes held here push with so much [Pa]. Not collective."""

    def filled(self) -> None:
        """A command has given fluid to nodes, or taken it."""

    def flowed(self) -> None:
        """The fluid has flowed by a step, also an implicit one. Collective."""


class Flow(Assigned, Travelling, Field):
    """The fluid of a model of blocks. Methods are collective unless they say otherwise; CommandError, alike on all
    ranks, for what makes no sense.

    row (4 ne,): of the table of properties, by joint, 0: no channel; since (4 ne,): flow time at which leak-off began
    [s], inf: it has not; condition (np,): row of the conditions; said_wet (4 ne,): bits, see `BY_CONDITION`. number
    (n,): flow nodes owned here, ascending; nodes (n, kernels.NODE): what they hold; held (n + copies,): numbers of the
    first rows of state (n + copies + shore, kernels.STATE).
    """

    name: ClassVar[str] = "fluid"
    kernel_kind: ClassVar[str] = "flow"
    of_objects: ClassVar[str] = JOINT
    model = POROUS
    kind_of_model: ClassVar[str] = "hydraulic"
    alike = FLUID
    stiffens: ClassVar[bool] = True

    def __init__(self, blocks: Blocks) -> None:
        Assigned.__init__(self, blocks)
        Travelling.__init__(self)
        mesh = blocks.the_mesh()
        self.since = np.full(mesh.cells.size, math.inf)
        self.condition = np.zeros(len(mesh.points), np.int32)
        self.said_wet = np.zeros(mesh.cells.size, np.int8)
        self._fluid: dict[str, float] = {}
        self.conditions: list[Condition] = [Condition()]
        self.wells: list[Well] = []
        self.nodes = np.empty((0, kernels.NODE))
        self.state = np.empty((0, kernels.STATE))
        self.removed = dict.fromkeys(_ACCOUNT, 0.0)
        """Accounts of nodes that are gone [m2]."""
        self.energy: dict[str, float] | None = dict.fromkeys(account.ENTRIES, 0.0)
        """Of implicit steps [J/m], in space [J], see `energies`; None: not known any more."""
        self._start_clock(blocks.clock.time)
        self.implicit_dt = 0.0
        self.since_peak = self.passed = 0
        self._network: Network | None = None
        self._reshaped = False
        self._found_for: list[float] = []
        self._checked = False
        """The length of a sub-step that was said is one that can be."""
        self.held = np.empty(0, np.int64)
        self.shore = Shore()
        self.frozen = False
        """Blocks have moved since flow was switched off: fluid that the pressures of now need is to be given."""
        self.more: dict[str, Callable[[], np.ndarray]] = {}
        """By name quantities (n,) of this rank's flow nodes that other physics keep."""
        self.slurry: Slurry | None = None
        """Grains in the fluid, which make it heavier and more viscous."""
        self.p0 = 0.0
        """Pressure that the variables of implicit steps are measured by, while these are being done [Pa]; else 0."""
        self.condensed: np.ndarray | None = None
        """Positions (nn, dim) of the nodes of the blocks at which these have eliminated the elements."""
        self.kept = np.empty(0)
        """Part of the fluid of this rank's nodes (n,) that the last change of channels left there."""
        self.carried: np.ndarray | None = None
        self._leaked_before = np.empty(0)
        """Volumes [m2] that flowed along the channels of this rank in the last cycle; None: nobody asks."""
        self._told: tuple[float, float] = (0.0, 0.0)
        self._told_wet = ""
        self._wet, self._wet_rows = np.empty(0, np.int64), np.empty((0, blocks.dim), np.int64)
        """Wet free faces of this rank, and rows of the state at their corners."""
        self._loads: list[tuple[np.ndarray, ...]] = []
        """What kernels take of sides of channels, and of those."""

    @property
    def stays(self) -> bool:
        return True

    @property
    def keeps_time(self) -> bool:
        return self.blocks.options.hydraulic

    @property
    def implicit(self) -> bool:
        """Implicit steps are being done."""
        return self.p0 > 0.0

    # ---- what is said --------------------------------------------------------------------------------------------

    def assign(self, joints: np.ndarray | None, given: Mapping[str, Value]) -> None:
        """Joints (None: all) are channels with these properties. Fluid that has no room any more goes with it; new room
        is dry."""
        at = self._numbers(joints)
        if not len(at):
            raise CommandError("there is no joint here that could be a channel")
        super().assign(at, given)

    def _have_it(self) -> np.ndarray:
        return self.network.channels

    def _assigned(self) -> None:
        self._found_for, self._fluid, self._network, self._reshaped = [], {}, None, True

    def prescribe(self, nodes: np.ndarray | None, does: int, value: Number) -> None:
        """What holds at flow nodes among these points (None: all) from now on, see `Condition`. A pressure or a level
        wets free faces all of whose corners are among the points; without points it is said of joints alone."""
        at = self.flow_nodes(nodes)
        said_at = np.flatnonzero(self.condition) if nodes is None else self.blocks.numbers_of_nodes(nodes)
        beside = said_at[~self.network.there[said_at]]
        for well in self.wells:
            both = np.intersect1d(well.points, at)
            if len(both):
                raise CommandError(f"node {both[0]} belongs to well '{well.name}', whose stages say what holds there")
        values = assigned.checked(self.blocks.tables, value, "a condition of a flow node")
        if does == kernels.PRESSURE and values.min() < 0.0:
            raise CommandError(f"the pressure of a fluid must not be negative, got {values.min():g} Pa")
        self.blocks.before_change()
        row = assigned.row_of(self.conditions, Condition(does, value))
        self.condition[at], self.condition[beside] = row, 0 if does == kernels.RATE else row
        if does == kernels.RATE:
            self._dry(np.union1d(at, beside))
        elif nodes is not None:
            self.said_wet[around(self.blocks.the_mesh(), said_at)[0]] |= BY_CONDITION
        self.blocks.changed(stiffness=False)

    def _dry(self, points: np.ndarray) -> None:
        """No condition says any more that water stands before faces with a corner among these points."""
        self.said_wet[around(self.blocks.the_mesh(), points)[1]] &= ~BY_CONDITION

    def drill(self, name: str, nodes: np.ndarray | None) -> None:
        """Flow nodes among these points (None: all) are a well."""
        if any(well.name == name for well in self.wells):
            raise CommandError(f"there is a well '{name}' already")
        try:
            at = self.flow_nodes(nodes)
        except CommandError as error:
            raise CommandError(f"well '{name}' has no flow node: {error}") from None
        for well in self.wells:
            both = np.intersect1d(well.points, at)
            if len(both):
                raise CommandError(f"node {both[0]} belongs to well '{well.name}' already")
        held = at[self.condition[at] > 0]
        if len(held):
            raise CommandError(f"node {held[0]} of well '{name}' has a condition: node boundary remove comes first")
        self.blocks.before_change()
        wall = at[:0]
        if nodes is not None:
            asked = self.blocks.numbers_of_nodes(nodes)
            wall = np.setdiff1d(asked, at)
            self.said_wet[around(self.blocks.the_mesh(), asked)[0]] |= BY_WELL
        self.condition[wall] = 0
        self.wells.append(Well(name, at, wall=wall))
        self.blocks.changed(stiffness=False)

    def well(self, name: str) -> Well:
        """The one of this name. Not collective."""
        found = next((well for well in self.wells if well.name == name), None)
        if found is None:
            known = ", ".join(f"'{well.name}'" for well in self.wells) or "none so far"
            raise CommandError(f"there is no well '{name}'; there is {known}")
        return found

    def stage(self, name: str, does: str, value: Number, duration: float, limit: float) -> None:
        """One more stage of a well, see `Stage`; duration [s] of flow time."""
        well = self.well(name)
        values = assigned.checked(self.blocks.tables, value, f"the {does} of a well")
        if does == HELD and values.min() < 0.0:
            raise CommandError(f"the pressure of a well must not be negative, got {values.min():g} Pa")
        if not duration > 0.0:
            raise CommandError(f"a stage of a well takes some time, got {duration:g} s")
        if not limit >= 0.0 or (math.isfinite(limit) and does != RATE):
            raise CommandError("limit, a pressure that is not negative, goes with a rate")
        self.blocks.before_change()
        well.add(Stage(does, value, 0.0, duration, limit), self.time)
        self.blocks.changed(stiffness=False)

    def well_value(self, name: str, quantity: str) -> float:
        """A quantity of `wells.QUANTITIES`. Not collective."""
        if quantity not in OF_WELLS:
            raise CommandError(f"there is no quantity {quantity} of a well; there are {', '.join(OF_WELLS)}")
        well = self.well(name)
        return float(well.number(self.time) if quantity == "stage" else getattr(well, quantity))

    def set_clock(self, time: float) -> None:
        """The clock of flow shows this time [s]; stages of wells and leak-off go on as they were."""
        ahead = time - self.time
        super().set_clock(time)
        self.since += ahead
        for well in self.wells:
            well.stages = [replace(one, begin=one.begin + ahead, end=one.end + ahead) for one in well.stages]

    def remove_conditions(self, nodes: np.ndarray | None) -> None:
        """Take back what is prescribed at these points (None: all)."""
        self._unset(self.condition, nodes)
        if nodes is None:
            self.said_wet &= ~BY_CONDITION
        else:
            self._dry(nodes)

    def fill(self, nodes: np.ndarray | None, pressure: float | None = None, saturation: float | None = None) -> None:
        """Flow nodes among these points (None: all) hold fluid of this pressure [Pa], or fill this part of their
        room."""
        if (pressure is None) == (saturation is None):
            raise CommandError("flow nodes begin with a pressure or with a saturation: one of them")
        given = pressure if saturation is None else saturation
        assert given is not None
        if not math.isfinite(given) or given < 0.0 or (saturation is not None and saturation > 1.0):
            what = "the pressure must not be negative" if saturation is None else "the saturation lies between 0 and 1"
            raise CommandError(f"{what}, got {given:g}")
        at = self.flow_nodes(nodes)
        self.blocks.close_model()
        mine = np.isin(self.number, at)
        part = saturation if pressure is None else 1.0 + pressure / self.fluid("fluid_bulk")
        w = self.nodes[mine, kernels.V] * part
        self.nodes[mine, kernels.GIVEN] += w - self.nodes[mine, kernels.W]
        self.nodes[mine, kernels.W] = w
        self._find_state(mine)
        self._refresh()
        self.find_shore()
        if self.slurry is not None:
            self.slurry.filled()

    def flow_nodes(self, points: np.ndarray | None) -> np.ndarray:
        """Those of these points (None: all) that are flow nodes."""
        there = self.network.there
        if not len(self.network.channels):
            raise CommandError("there are no channels yet: assign face-joint c-model hydraulic-porous-medium first")
        asked = np.flatnonzero(there) if points is None else self.blocks.numbers_of_nodes(points)
        found = asked[there[asked]]
        if not len(found):
            raise CommandError(f"no channel ends at node {asked[0]}" + " nor at the others" * (len(asked) > 1))
        if len(found) < len(asked) and self.blocks.log is not None:
            self.blocks.log.info(
                f"no channel ends at {len(asked) - len(found)} of the {len(asked)} nodes: what is said of them counts "
                "for free faces alone"
            )
        return found

    def uses_table(self, name: str) -> bool:
        """Whether a node or a stage that is not over follows this table. Not collective."""
        stages = (one for well in self.wells for one in well.stages)
        return any(one.value == name and one.end > self.time for one in stages) or any(
            one.value == name for one in assigned.in_use(self.conditions, self.condition)
        )

    def fluid(self, name: str) -> float:
        """A property of the fluid. Not collective."""
        if not self._fluid:
            self._fluid = dict(zip(_PROPERTIES, self.rows[self.row[np.argmax(self.row > 0)] - 1]))
        return self._fluid[name]

    @property
    def viscosity(self) -> float:
        """Dynamic viscosity of the fluid [Pa s]: the kinematic one times the density (C-26). Not collective."""
        return self.fluid("viscosity") * self.fluid("fluid_density")

    # ---- what is asked -------------------------------------------------------------------------------------------

    @property
    def network(self) -> Network:
        """Channels and flow nodes of all ranks. Not collective."""
        if self._network is None:
            blocks, mesh = self.blocks, self.blocks.the_mesh()
            channels = np.flatnonzero((self.row > 0) & blocks.joint_exists())
            self._network = Network.of(mesh, channels)
        return self._network

    def numbers(self, kind: str) -> np.ndarray:
        """Of all flow nodes or channels, ascending. Not collective."""
        return self.network.nodes if kind == FLOW_NODE else self.network.channels

    def owned_values(self, kind: str, names: list[str]) -> dict[str, np.ndarray]:
        """Columns of this rank's flow nodes or channels (those on whose lower face its elements lie), with their
        "number"."""
        self.blocks.close_model()
        if self.frozen:
            self.find_rooms()
        if kind == FLOW_NODE:
            made = {
                "number": self.number, "pressure": self.state[: len(self.number), kernels.P],
                "saturation": self.state[: len(self.number), kernels.S], "fluid": self.nodes[:, kernels.W],
                "volume": self.nodes[:, kernels.V], "inflow": self.nodes[:, kernels.INFLOW],
                **{name: self._of_others(name)[: self.owned] for name in _OF_OTHERS},
            }  # fmt: skip
        else:
            blocks = self.blocks
            row = blocks.where[self._channels // 4]
            mine = (row >= blocks.owned.start) & (row < blocks.owned.stop)
            ends, aperture = self._corners[mine], self.apertures()[mine]
            self._find_flows(0.0)
            flux = self.fluxes()[mine]
            wanted = [name for name in names if name in _OF_OTHERS]
            others = {name: self._of_others(name, copies=True)[ends].mean(axis=1) for name in wanted}
            made = {
                "number": self._channels[mine], "aperture": aperture, "flow_rate": flux,
                "pressure": self.state[ends, kernels.P].mean(axis=1),
                "saturation": self.state[ends, kernels.S].mean(axis=1),
                "velocity": flux / aperture, **others,
            }  # fmt: skip
        return {name: made[name].copy() for name in ("number", *names)}

    def _of_others(self, name: str, copies: bool = False) -> np.ndarray:
        """A quantity of other physics of the flow nodes held here, NaN where there is none; with copies, then
        collective, those of other ranks too."""
        own = self.more[name]() if name in self.more else np.full(self.owned, math.nan)
        out = np.append(own, np.full(len(self.held) - len(own), math.nan))
        if copies and self._copies is not None:
            column = self.state[: len(out), kernels.P]
            kept = column.copy()
            column[:] = out
            self._copies.refresh()
            out = column.copy()
            column[:] = kept
        return out

    def places_of(self, channels: np.ndarray) -> np.ndarray:
        """Where channels (k,) are among those of this rank, -1: not there. Not collective."""
        at = np.minimum(np.searchsorted(self._channels, channels), max(len(self._channels) - 1, 0))
        return np.where(self._channels[at] == channels, at, -1) if len(self._channels) else np.full(len(channels), -1)

    def fluxes(self) -> np.ndarray:
        """What flows in this rank's channels (m,) [m2/s] at `_q`: from the first corner on, in space its size: that of
        sum q_ij (x_j - x_i) / A, exact for a pressure that is linear, as half of sum cot(angle) e e^T over the sides of
        a triangle is A. Not collective."""
        if self.blocks.dim == 2:
            return self._q
        x, (one, other) = self.blocks.x.reshape(-1), self._sides
        a, b, c, p, q, r = (x[at[:, None] + np.arange(3)] for at in (*one.T, *other.T))
        at = 0.5 * np.stack([a + p, b + r, c + q], axis=1)
        way = at[:, [2, 0, 1]] - at[:, [1, 2, 0]]
        area = 0.5 * np.linalg.norm(np.cross(way[:, 0], way[:, 1]), axis=1)
        return np.linalg.norm((self._q.reshape(-1, 3, 1) * way).sum(axis=1), axis=1) / area

    @property
    def links(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Rows of the ends (m, 2) of the links of this rank's channels, and links by its nodes, see network.at_nodes.
        Not collective."""
        return self._ends, self._begin, self._channel, self._side

    @property
    def sides(self) -> tuple[np.ndarray, np.ndarray]:
        """Where both faces of this rank's channels begin in x (m,), in space their corners (m, 3). Not collective."""
        return self._sides

    @property
    def channels_here(self) -> np.ndarray:
        """Numbers of this rank's channels (m,), ascending. Not collective."""
        return self._channels

    @property
    def channel_table(self) -> np.ndarray:
        """Of the links of this rank's channels (m, kernels.CHANNEL). Not to be changed. Not collective."""
        return self._table

    def apertures(self) -> np.ndarray:
        """Of this rank's channels [m]. Not to be changed. Not collective."""
        return self._table[:: LINKS[self.blocks.dim], kernels.APERTURE]

    def mean_flows(self) -> np.ndarray:
        """Flow (m,) [m2/s] of the links of this rank's channels from their first end on: the mean of the last cycle, of
        which `carried` is kept, or where flow is switched off that of this moment. Not collective."""
        if self.carried is None or not self.blocks.options.hydraulic or len(self.carried) != len(self._ends):
            self._find_flows(0.0)
            return self._q
        return self.carried / (self.sub_steps * self.dt)

    def values(self, kind: str, name: str, numbers: np.ndarray | None = None) -> np.ndarray:
        """A quantity of `QUANTITIES` of flow nodes or channels (None: all), on all ranks; NaN where there is none."""
        if name not in QUANTITIES[kind]:
            raise CommandError(f"there is no quantity {name} of a {kind}; there are {', '.join(QUANTITIES[kind])}")
        mine = self.owned_values(kind, [name])
        numbers = self.numbers(kind) if numbers is None else numbers
        found = np.full(int(max(numbers.max(initial=-1), mine["number"].max(initial=-1))) + 1, math.nan)
        found[mine["number"]] = mine[name]
        return self._on_all_ranks(found[numbers])

    def link_flows(self) -> np.ndarray:
        """What flows at this moment along the links (l,) of all channels [m2/s], on all ranks."""
        blocks, links = self.blocks, LINKS[self.blocks.dim]
        blocks.close_model()
        self._find_flows(0.0)
        row = blocks.where[self._channels // 4]
        mine = (row >= blocks.owned.start) & (row < blocks.owned.stop)
        found = np.full((len(self.network.channels), links), math.nan)
        found[np.searchsorted(self.network.channels, self._channels[mine])] = self._q.reshape(-1, links)[mine]
        return self._on_all_ranks(found.reshape(-1))

    def _on_all_ranks(self, values: np.ndarray) -> np.ndarray:
        """Values (n,), NaN but on one rank at most: to the last bit."""
        bits, nothing = values.view(np.int64), np.array([math.nan]).view(np.int64)[0]
        return (self.blocks.comm.sum_into(bits - nothing) + nothing).view(np.float64)

    def account(self) -> dict[str, float]:
        """Volumes of fluid at its density without pressure, since there are channels [m2]: given by conditions and at
        the beginning, stored, leaked into the rock, removed with channels that were taken away; closing: what does not
        add up, relative: that over the largest."""
        self.blocks.close_model()
        found = {"stored": self._sum(self.nodes[:, kernels.W])}
        for name, column in _ACCOUNT.items():
            found[name] = self._sum(self.nodes[:, column], self.removed[name])
        return closed(found, found["given"] - found["stored"] - found["leaked"] - found["removed"])

    def energies(self) -> dict[str, float]:
        """The energy of the fluid and the blocks in implicit steps [J/m], in space [J]: `account.ENTRIES`, what does
        not add up (closing), over the largest (relative). CommandError where packs of grains took some."""
        if self.energy is None:
            raise CommandError("no account of energy is kept where grains bear: what their packs take is not known")
        return account.closed(self.energy)

    @property
    def owned(self) -> int:
        """Flow nodes of this rank. Not collective."""
        return len(self.number)

    # ---- tables of this rank -------------------------------------------------------------------------------------

    @property
    def _on(self) -> bool:
        return self.blocks.options.hydraulic and len(self.network.channels) > 0

    @property
    def pushes(self) -> bool:
        """Fluid loads blocks, also where it does not flow at present."""
        return len(self.network.channels) > 0 and not self.blocks.options.one_way

    def pushed(self) -> tuple[np.ndarray, np.ndarray]:
        """Faces of owned elements that fluid pushes on, ascending: sides of channels, and wet free faces."""
        sides, free = self._sides_and_free()
        return sides, free[self._is_wet(free)]

    def _is_wet(self, free: np.ndarray) -> np.ndarray:
        """Free faces (k,) before which water is said to stand, and on which no stress is prescribed."""
        return (self.said_wet[free] > 0) & ~self.blocks.stressed(free)

    def _sides_and_free(self) -> tuple[np.ndarray, np.ndarray]:
        """Faces of owned elements, ascending: sides of channels, and free ones."""
        blocks, mesh = self.blocks, self.blocks.the_mesh()
        faces = faces_of(mesh, np.sort(blocks.number[blocks.owned]))
        channel = np.zeros(mesh.cells.size, bool)
        channel[self.network.channels] = True
        closed, again = blocks.closed_faces(), np.flatnonzero(blocks.broken > 1)
        if len(again):  # free faces but for the static solve, see physics/fdem/pressed.py
            closed = closed.copy()
            closed[again] = closed[blocks.partner[again]] = False
        return sides_and_free(blocks.partner, faces, closed, channel)

    def wet_faces(self) -> dict[str, np.ndarray]:
        """Free faces that fluid pushes on, on all ranks: number, element * 4 + face, ascending, size [m], in space
        [m2], and mean pressure of their corners [Pa]."""
        self.blocks.close_model()
        faces, mean = self._wet, self.state[self._wet_rows, kernels.P].mean(axis=1)
        comm = self.blocks.comm
        parts = comm.allgather((faces, mean)) if comm.size > 1 else [(faces, mean)]
        faces, mean = (np.concatenate(column) for column in zip(*parts, strict=True))
        order = np.argsort(faces)
        faces, mean = faces[order], mean[order]
        return {"number": faces, "size": self.blocks.the_mesh().face_sizes(faces), "pressure": mean}

    def _tell_wet(self, free: np.ndarray) -> None:
        """A word in the log about the free faces (k,) of this rank where they are others than before. Collective."""
        blocks, mesh = self.blocks, self.blocks.the_mesh()
        said_wet, stressed = self.said_wet[free] > 0, blocks.stressed(free)
        between = self.network.there[mesh.face_points(free)].all(axis=1)
        kinds = said_wet & ~stressed, said_wet & stressed, between & ~said_wet & ~stressed
        wet, total, dry = blocks.comm.sum_into(np.array([kind.sum() for kind in kinds], np.int64)).tolist()
        told = []
        if wet:
            told.append(f"water stands before {wet} free faces, as conditions and wells say, and pushes on them")
        if total:
            told.append(f"{total} with water have a prescribed stress, which is all that acts there")
        if dry:
            told.append(
                f"{dry} free faces between flow nodes are dry: no condition says that water stands before them (node "
                "boundary hydraulic-constant-flow-boundary pressure, flow-surface, or well create, with a range that "
                "holds their nodes)"
            )
        text = "; ".join(told)
        if blocks.log is not None and text != self._told_wet:
            blocks.log.info(f"flow: {text or 'no free face is wet any more'}")
        self._told_wet = text

    def corners(self, blocks: Any) -> np.ndarray:
        out = np.zeros((blocks.n_own, 4), bool)
        if self.pushes:
            mesh, faces = blocks.the_mesh(), np.concatenate(self.pushed())
            for corner in (mesh.face_corners(faces), mesh.on_sides(faces)[1]):
                out[blocks.where[corner // 4] - blocks.n_left, corner % 4] = True
        return out

    def springs(self, blocks: Any) -> np.ndarray | None:
        """A channel that cannot drain is as stiff as its fluid: K / aperture, in each step. By the aperture without
        opening and the length in the mesh: where things are must not count, as a restart finds masses again."""
        if not self.pushes or not self._on or blocks.options.flow_every > 1:
            return None
        return self.springs_of(blocks, self.fluid("fluid_bulk"))

    def springs_of(self, blocks: Any, modulus: float) -> np.ndarray:
        """Stiffness (n_own, 4) that what fills the channels brings to corners, by its modulus [Pa]."""
        faces, mesh = self._sides_and_free()[0], self.blocks.the_mesh()
        laws = self.laws()[self.row[np.minimum(faces, blocks.partner[faces])] - 1]
        delta = np.clip(laws[:, kernels.INITIAL], laws[:, kernels.LEAST], laws[:, kernels.MOST])
        each = modulus / mesh.dim * mesh.face_sizes(faces) / delta
        out = np.zeros((blocks.n_own, 4))
        for corner in mesh.face_corners(faces).T:
            np.add.at(out, (blocks.where[corner // 4] - blocks.n_left, corner % 4), each)
        return out

    def _sides_of(self, faces: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray, int]:
        """Where both faces of channels begin in x, in space their corners; the laws of their links; and a face that
        this rank does not hold, or -1."""
        blocks, width = self.blocks, self.blocks.x.shape[1]
        other = blocks.partner[faces]
        one, two = blocks.where[faces // 4], blocks.where[other // 4]
        lost = faces[(one < 0) | (two < 0)]
        stride = blocks.local.stride
        near, far = faces % 4, other % 4
        if blocks.dim == 3:
            near, far = (blocks.the_mesh().face_corners(of) % 4 for of in (faces, other))
            one, two = one[:, None], two[:, None]
        sides = np.maximum(one, 0) * width + stride * near, np.maximum(two, 0) * width + stride * far
        law = np.repeat((self.row[np.minimum(faces, other)] - 1).astype(np.int64), LINKS[blocks.dim])
        return sides, law, int(lost[0]) if len(lost) else -1

    def laws(self) -> np.ndarray:
        """The table of channel laws (rows, kernels.LAW)."""
        of = {name: np.array([row[k] for row in self.rows]) for k, name in enumerate(_PROPERTIES)}
        inside = of["matrix_porosity"] * (1.0 / of["fluid_bulk"] + of["matrix_porosity_compressibility"])
        viscous, on = of["viscosity"] * of["fluid_density"], of["leak_off"] > 0.0
        front = on & (of["matrix_saturation"] < 1.0)
        empty = of["matrix_porosity"] * (1.0 - of["matrix_saturation"])
        room = np.where(front, 0.5 * empty, inside / math.pi)
        leak = np.where(on, np.sqrt(of["matrix_permeability"] * room / viscous), 0.0)
        apertures = [of[f"aperature_{name}"] for name in ("initial", "minumum", "maximum")]
        dilation = np.tan(np.radians(of["shear_dilation"])), of["shear_dilation_limit"]
        return np.ascontiguousarray(np.column_stack([*apertures, leak, of["matrix_pore_pressure"], *dilation, front]))

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
        way = middle[mine] - found
        return math.sqrt(float(comm.max_into(np.array([(way * way).sum(axis=1).max(initial=0.0)]))[0]))

    def storage_rebuilt(self) -> None:
        """Elements have other rows or owners, or there are other channels."""
        blocks, network, comm = self.blocks, self.network, self.blocks.comm
        if not len(network.channels):
            self._forget_nodes(np.ones(len(self.number), bool))
            self._wet, self._wet_rows = self._wet[:0], self._wet_rows[:0]
            return
        points, mesh = len(network.there), blocks.the_mesh()
        leads = blocks.local.leads[network.nodes]
        row = blocks.where[leads // 4]
        own = (row >= blocks.owned.start) & (row < blocks.owned.stop)
        mine, leads, row = network.nodes[own], leads[own], row[own]
        at = blocks.where[network.channels // 4]
        beside = (at >= blocks.owned.start) & (at < blocks.owned.stop)
        self._channels = network.channels[np.isin(network.corners, mine).any(axis=1) | beside]
        corners = mesh.face_points(self._channels)
        sides = self._wet = np.empty(0, np.int64)
        if self.pushes:
            sides, free = self._sides_and_free()
            self._wet = free[self._is_wet(free)]
            self._tell_wet(free)
        self.shore, beyond = self._shore_of(np.concatenate([sides, self._wet]))
        loaded = mesh.face_points(np.concatenate([sides, self._wet]))
        of_loads = loaded.reshape(-1)[~beyond], self.shore.node[self.shore.node >= 0]
        wanted = np.setdiff1d(np.concatenate([corners.reshape(-1), *of_loads]), mine)
        self._forget_nodes(~network.there[self.number])
        n = len(self.number)
        had = np.column_stack([self.nodes, self.state[:n, : kernels.E]])
        rows, wanted = self._fetch(had, mine, wanted, kernels.STATE, len(self.shore))
        self.nodes = np.ascontiguousarray(rows[:, : kernels.NODE])
        self.state[: len(mine), : kernels.E] = rows[:, kernels.NODE :]
        count = len(mine) + len(wanted)
        self.held = np.concatenate([mine, wanted])
        local = np.full(points, -1, np.int64)
        local[mine], local[wanted] = np.arange(len(mine)), len(mine) + np.arange(len(wanted))
        self._corners = local[corners]
        self._ends = ends = links_of(self._corners)
        self._begin, self._channel, self._side = at_nodes(self._ends, len(mine))
        self._lead = row * blocks.x.shape[1] + blocks.local.stride * (leads % 4)
        self._q, self._lost_fluid = np.zeros(len(ends)), np.zeros(len(ends))
        self._sums = np.zeros((2, count))
        self.note_leaks()
        self.shore.ref = np.where(self.shore.node >= 0, local[self.shore.node], -1)
        at = local[loaded]
        at.reshape(-1)[beyond] = count + np.arange(len(self.shore))
        self._wet_rows = at[len(sides) :]
        self._loads = [self._bound(sides, at[: len(sides)]), self._bound(self._wet, self._wet_rows)]
        self._sides, self._law, lost = self._sides_of(self._channels)
        self._law_table = self.laws()
        self._table, self._flowing = (np.empty((len(ends), kernels.CHANNEL)) for _ in range(2))
        self._slow = np.empty(len(ends))
        self.carried = None if self.carried is None else np.empty(0)
        self._leaked_before = np.empty(0)
        self.find_geometry()
        lost = int(comm.max_into(np.array([lost], np.int64))[0])
        if lost >= 0:
            raise PhysicsError(
                f"step {blocks.clock.step}: the channel on face {lost} spans more than a column of "
                f"{blocks.rebuild_state.side:g} m: its sides have parted too far"
            )
        self._shrink()
        self._take_heights()
        self._refresh()
        self.find_shore()
        self._reshaped = self._checked = False
        if self._found_for != self._given():
            self._find_step()
        if not blocks.options.mechanical:
            blocks.clock.dt = self.sub_steps * self.dt

    def _forget_nodes(self, gone: np.ndarray) -> None:
        """Fluid of nodes (n,) bool that are no longer there is gone with them; their accounts are kept."""
        if not self.blocks.comm.any(bool(gone.any())):
            return
        self.nodes[gone, kernels.REMOVED] += self.nodes[gone, kernels.W]
        for name, column in _ACCOUNT.items():
            self.removed[name] = self._sum(self.nodes[gone, column], self.removed[name])
        self.state = self.state[: len(gone)][~gone]
        self.number, self.nodes = self.number[~gone], self.nodes[~gone]

    def _shrink(self) -> None:
        """Room of the nodes after a change of channels: fluid that has no room any more is gone."""
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

    def find_geometry(self) -> None:
        """Apertures and conductances where the blocks are now. Not collective."""
        blocks, (one, other) = self.blocks, self._sides
        of = kernels if blocks.dim == 2 else kernels_space
        kernel = of.geometry if blocks.threads == 1 else of.geometry_threaded
        kernel(blocks.threads, one, other, self._law, self._law_table, blocks.x, self.viscosity, self._table)
        if self.slurry is not None:
            self.slurry.thicken(self._ends, self._table)

    def find_rooms(self) -> None:
        """Room of nodes where the blocks are now. Not collective."""
        self.find_geometry()
        self._find_volumes()

    def _find_volumes(self) -> None:
        kernels.volumes(self._begin, self._channel, self._table, self.nodes)

    def _find_state(self, at: np.ndarray | slice) -> None:
        """Pressure and saturation of owned nodes from their fluid."""
        w, v = self.nodes[at, kernels.W], self.nodes[at, kernels.V]
        full = w >= v
        own = self.state[: len(self.number)]
        own[at, kernels.P] = np.where(full, self.fluid("fluid_bulk") * ((w - v) / v), 0.0)
        own[at, kernels.S] = np.where(full, 1.0, w / v)

    def _take_heights(self) -> None:
        """Potential energy of the owned nodes, where the first element around each has them."""
        o, flat = self.blocks.options, self.blocks.x.reshape(-1)
        rho, along = self.fluid("fluid_density"), o.gx * flat[self._lead] + o.gy * flat[self._lead + 1]
        if self.blocks.dim == 3:
            along += o.gz * flat[self._lead + 2]
        self.state[: len(self.number), kernels.E] = -rho * along

    def _begins(self, corner: np.ndarray) -> np.ndarray:
        """Where corners, element * 4 + k, begin in x, flat."""
        return self.blocks.where[corner // 4] * self.blocks.x.shape[1] + self.blocks.local.stride * (corner % 4)

    def _shore_of(self, faces: np.ndarray) -> tuple[Shore, np.ndarray]:
        """Of faces (m,) that fluid pushes on; and which of all their corners belong to it, flat, bool. Rows of the
        state come with `storage_rebuilt`."""
        network, mesh, o = self.network, self.blocks.the_mesh(), self.blocks.options
        points, corner = (of.reshape(-1) for of in (mesh.face_points(faces), mesh.face_corners(faces)))
        beyond = ~network.there[points]
        points, corner = points[beyond], corner[beyond]
        row = self.condition[points].astype(np.int64)
        node = np.full(len(points), -1, np.int64)
        down = np.array([o.gx, o.gy, o.gz][: mesh.dim])
        for well in self.wells:
            at = well.points[network.there[well.points]]
            mine = (node < 0) & (row == 0) & np.isin(points, well.wall)
            if len(at) and mine.any():
                node[mine] = at[np.argmax(mesh.points[at] @ down)]
        apart = np.where((node >= 0)[:, None], mesh.points[points] - mesh.points[node], 0.0)
        return Shore(self._begins(corner), row, node, np.full(len(points), -1, np.int64), apart), beyond

    def find_shore(self, conditions: np.ndarray | None = None) -> None:
        """Pressures at the shore where it is now, by a table of conditions (None: that of now). Not collective."""
        shore = self.shore
        if not len(shore):
            return
        flat, rho = self.blocks.x.reshape(-1), self.fluid("fluid_density")
        energy = -rho * sum(g * flat[shore.at + k] for k, g in enumerate(self._gravity()))
        does, value = (self.conditions_at(self.time) if conditions is None else conditions)[shore.row].T
        p = np.where(does == kernels.SURFACE, np.maximum(value - energy, 0.0), value)
        of_well = np.flatnonzero(shore.ref >= 0)
        lowest = self.state[shore.ref[of_well], kernels.P]
        drop = rho * sum(g * shore.apart[of_well, k] for k, g in enumerate(self._gravity()))
        p[of_well] = np.where(lowest > 0.0, np.maximum(lowest + drop, 0.0), 0.0)
        self.state[len(self.held) :, kernels.P] = p

    def show(self, rows: np.ndarray | float, conditions: np.ndarray | None = None) -> None:
        """The state of the nodes held here is this; that of the shore follows. Not collective."""
        self.state[: len(self.held)] = rows
        self.find_shore(conditions)

    def _bound(self, faces: np.ndarray, nodes: np.ndarray) -> tuple[np.ndarray, ...]:
        """What the kernels of loads take of these faces (m,), with the rows of the state at their corners (m, dim)."""
        corner, of, blocks = self.blocks.the_mesh().face_corners(faces), self.blocks.local, self.blocks
        at = of.force_width * blocks.where[corner // 4] + of.stride * (corner % 4)
        if blocks.dim == 2:
            return np.ascontiguousarray(self._begins(corner)[:, 0]), at, nodes
        half, fourth, *weights = blocks.the_mesh().on_sides(faces)
        last = of.force_width * blocks.where[fourth // 4] + of.stride * (fourth % 4)
        rest = np.delete(np.arange(len(faces)), half)
        return at[rest], nodes[rest], np.column_stack([at[half], last]), nodes[half], *weights

    def note_leaks(self, broken: np.ndarray | None = None) -> None:
        """Leak-off begins where a joint is open, or among these that broke, and has it. Not collective."""
        channels = self.network.channels
        at = channels[self.blocks.open[channels]]
        if broken is not None:
            at = np.union1d(at, channels[np.isin(channels, broken)])
        leaks = np.array([False, *(row[_PROPERTIES.index("leak_off")] > 0.0 for row in self.rows)])
        new = at[leaks[self.row[at]] & np.isinf(self.since[at])]
        self.since[new] = self.time
        self._since = np.repeat(self.since[self._channels], LINKS[self.blocks.dim])
        self._leaks = bool(np.isfinite(self.since).any())

    def joints_opened(self) -> None:
        """Joints broke: their faces are open now."""
        if len(self.network.channels) and self.blocks.closed:
            self.note_leaks()

    def elements_removed(self, elements: np.ndarray) -> None:
        """Channels beside these elements are gone, with their fluid."""
        self._network, self._reshaped, self._found_for = None, True, []

    def mesh_replaced(self) -> None:
        """There is another mesh: `of_mesh` says that this is gone with the one before."""
        self.close()

    # ---- the clock -----------------------------------------------------------------------------------------------

    def limit(self) -> float:
        """The longest sub-step that is stable, with a factor of two in reserve [s]."""
        args = self._begin, self._channel, self._ends, self._table, self.nodes, self.state
        least = kernels.longest_step(*args, self.fluid("fluid_bulk"))
        return float(self.blocks.comm.min_into(np.array([least]))[0])

    def _given(self) -> list[float]:
        """What the length of a sub-step follows from, beside the channels."""
        o = self.blocks.options
        switches = [float(o.mechanical), float(o.dynamic), float(o.flow_every), float(o.flow_steps), o.flow_dt]
        return [*switches, *self._gravity(), self.blocks.clock.dt if o.mechanical else 0.0]

    def _find_step(self) -> None:
        """Sub-steps of a cycle and their length, from what was said and what is stable."""
        blocks, o, limit = self.blocks, self.blocks.options, self.limit()
        self._found_for, self._checked = self._given(), False
        period = 0.0 if not o.mechanical or not o.dynamic else o.flow_every * blocks.clock.dt
        if o.flow_dt > 0.0:
            self.sub_steps, self.dt = max(1, o.flow_steps), o.flow_dt
        elif period == 0.0:
            self.sub_steps, self.dt = max(1, o.flow_steps), limit
        else:
            need = period / (SAFETY * limit) if limit > 0.0 else math.inf
            self.sub_steps = o.flow_steps or max(1, math.ceil(min(need, 1e15)))
            self.dt = period / self.sub_steps
        if not o.flow_steps and self.sub_steps > MANY:
            raise CommandError(
                f"flow would need {self.sub_steps} sub-steps of {limit:.3g} s in {o.flow_every} mechanical steps; "
                "model time-step hydraulic gives it a clock of its own, model solve hydraulic takes implicit steps"
            )
        self._tell_step(limit)

    def _outrun(self) -> bool:
        """An estimated sub-step is more than half the stability limit, before it is looked at again. Collective."""
        o = self.blocks.options
        if o.flow_dt > 0.0 or o.flow_steps > 0 or self.cycles % max(1, GLANCE // self.sub_steps):
            return False
        return self.dt > self.limit()

    def _tell_step(self, limit: float) -> None:
        log = self.blocks.log
        known, before = self._told
        if log is None or (abs(self.dt - known) <= 0.1 * known and abs(limit - before) <= 0.1 * before):
            return
        self._told, said = (self.dt, limit), partial(with_prefix, unit="s")
        log.info(
            f"flow: {counted(self.sub_steps, 'sub-step')} of {said(self.dt)} in each cycle; the stability limit is "
            f"{said(2.0 * limit)}, half of it {said(limit)}"
        )
        if self.dt > limit * (1.0 + 1e-9):
            log.warn_once(
                f"flow step {self.dt > 2.0 * limit}",
                f"the hydraulic time step {self.dt:g} s is {self.dt / (2.0 * limit):.2f} of the stability limit "
                f"{2.0 * limit:.4g} s; a run that blows up should be repeated with a smaller one",
            )

    def check_start(self) -> None:
        o, conditions = self.blocks.options, self.conditions
        if not self._on:
            return
        if o.mechanical and not o.dynamic and o.flow_dt == 0.0:
            raise CommandError("in static runs time of flow passes by model time-step hydraulic, which comes first")
        surface = [row for row in np.unique(self.condition).tolist() if conditions[row].does == kernels.SURFACE]
        if surface and not any(self._gravity()):
            raise CommandError("flow-surface needs gravity: model gravity comes first")
        self.check_wells()
        if not self._checked and (o.flow_dt > 0.0 or o.flow_steps > 0):
            self._refuse_far()
            self._checked = True

    def _refuse_far(self) -> None:
        """CommandError for a sub-step with which the flow would certainly blow up. Collective."""
        if not self.dt > FAR * 2.0 * self.limit():
            return
        n = self.owned
        rise = np.abs(np.diff(self.state[self._ends, kernels.E], axis=1)[:, 0]) * self._table[:, kernels.WEIGHT]
        each = np.abs(self._table[:, kernels.CONDUCT]) * (self.fluid("fluid_bulk") + kernels.STEEPEST * rise)
        rate = sum(np.bincount(ends, each, len(self.state))[:n] for ends in self._ends.T)
        does = np.array([one.does for one in self.conditions])[self.condition[self.number]]
        held = np.isin(does, (kernels.PRESSURE, kernels.SURFACE))
        held |= np.isin(self.number, np.concatenate([self.number[:0], *(well.points for well in self.wells)]))
        stable = np.divide(self.nodes[:, kernels.V], rate, out=np.full(n, math.inf), where=(rate > 0.0) & ~held)
        least = stable.min(initial=math.inf)
        least = float(self.blocks.comm.min_into(np.array([least]))[0])
        if self.dt > FAR * least:
            said_by = "time-step" if self.blocks.options.flow_dt > 0.0 else "sub-step"
            first = self._lowest(self.number[stable == least])
            raise CommandError(
                f"model {said_by} hydraulic: sub-steps of {self.dt:.4g} s are {self.dt / least:.3g} times what is "
                f"stable at flow node {first}, {least:.4g} s, and the flow would blow up: make them shorter, or use "
                "model solve hydraulic, which takes implicit steps"
            )

    def check_wells(self) -> None:
        """CommandError for one that would pump into nothing."""
        for well in self.wells:
            if well.will_act(self.time) and not self.network.there[well.points].any():
                raise CommandError(f"well '{well.name}' has no flow node any more: what was around it is taken out")

    def follow(self) -> None:
        """Flow for as long as the step that the elements have moved by."""
        blocks, o = self.blocks, self.blocks.options
        if not self._on:
            self.frozen |= blocks.options.mechanical and len(self.network.channels) > 0
            return
        self.waited += 1
        if o.mechanical and self.waited < o.flow_every:
            return
        self.waited = 0
        with blocks.timers("flow"):
            if o.mechanical:
                self.find_rooms()
                if any(self._gravity()):
                    self._take_heights()
                    self._refresh()
            if o.mechanical and (self.cycles % LOOK == 0 or self._found_for != self._given() or self._outrun()):
                self._find_step()
            if self.carried is not None:
                self.carried = np.zeros(len(self._ends))
                self._leaked_before = self.nodes[:, kernels.LEAKED].copy()
            condition = self.condition[self.number]
            for _ in range(self.sub_steps):
                self._sub_step(condition)
            self.find_shore()
            self.cycles += 1
        if self.cycles % LOOK == 0:
            self._check()

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
        slow = self.slowness(self._ends, self._table, self.state, self._slow)
        if slow is None:
            return self._table
        np.copyto(self._flowing, self._table)
        self._flowing[:, kernels.CONDUCT] *= slow
        return self._flowing

    def _find_flows(self, dt: float) -> None:
        threads, table = self.blocks.threads, self._flowing_table()
        kernel = kernels.flows if threads == 1 else kernels.flows_threaded
        kernel(
            threads, self._ends, self._law, self._law_table, self._since, self._leaks, self.time, self.time + dt,
            table, self.state, self._q, self._lost_fluid,
        )  # fmt: skip

    def _sub_step(self, condition: np.ndarray) -> None:
        """condition (n,): rows of the conditions of the owned nodes."""
        blocks, before, after = self.blocks, self.time, self.time + self.dt
        told = self.dt, condition, self.conditions_at(after), self.fluid("fluid_bulk"), self.nodes, self.state
        if blocks.threads == 1:
            into, gone = self._sums
            kernels.sub_step(
                self._ends, self._law, self._law_table, self._since, self._leaks, before, after, self._flowing_table(),
                self._q, self._lost_fluid, into, gone, *told,
            )  # fmt: skip
        else:
            self._find_flows(self.dt)
            links = self._begin, self._channel, self._side, self._q, self._leaks, self._lost_fluid
            kernels.fill_threaded(blocks.threads, *links, *told)
        self.time = after
        if self.carried is not None:
            self.carried += self.dt * self._q
        if self.wells:
            self._pump(before)
        self._refresh()

    def _pump(self, before: float) -> None:
        """What wells did since then."""
        there = self.network.there
        points = [well.points[there[well.points]] for well in self.wells]
        at = np.concatenate(points)
        row = np.minimum(np.searchsorted(self.number, at), max(len(self.number) - 1, 0))
        mine = self.number[row] == at if len(self.number) else np.zeros(len(at), bool)
        row = row[mine]
        room = np.zeros((3, len(at)))
        room[:2, mine], room[2, mine] = self.nodes[row, : kernels.V + 1].T, self.state[row, kernels.E]
        room = self.blocks.comm.sum_into(room)
        if not np.isfinite(room).all():
            raise self._blown_up(int(at[~np.isfinite(room).all(axis=0)][0]))
        after, bulk = np.empty(len(at)), self.fluid("fluid_bulk")
        value_at = partial(assigned.now, self.blocks.tables)
        ends = np.cumsum([len(one) for one in points])
        for well, begin, end in zip(self.wells, [0, *ends[:-1].tolist()], ends.tolist()):
            if end > begin:
                after[begin:end] = well.filled(room[:, begin:end], before, self.time, bulk, value_at)
            self.tell_stage(well, before, self.time)
        came = (after - room[0])[mine]
        self.nodes[row, kernels.W] = after[mine]
        self.nodes[row, kernels.GIVEN] += came
        self.nodes[row, kernels.INFLOW] = came / (self.time - before)
        self._find_state(row)

    def tell_stage(self, well: Well, before: float, after: float) -> None:
        """A word in the log if another stage of a well is on than before."""
        stage, log = well.number(after), self.blocks.log
        if log is not None and stage != well.number(before):
            does = well.stages[stage - 1].does.replace("_", "-") if stage else "no stage any more"
            log.info(f"well '{well.name}': {f'stage {stage}, ' * bool(stage)}{does}, at {after:.6g} s of flow")

    def asked_of(self, well: Well, time: float, dt: float, passes: bool) -> Asked:
        """What a well does in an implicit step of dt [s] from this time on; passes: time does, else in so long by what
        it does now. Not collective."""
        value = partial(assigned.now, self.blocks.tables)
        if passes:
            return well.asked(time, time + dt, value)
        return well.asked_now(time, dt, value)

    def leaked(self) -> np.ndarray:
        """What each of this rank's nodes (n,) lost to the rock in the last cycle [m2], where `carried` is kept; nothing
        where flow is switched off. Not collective."""
        nodes = self.nodes[:, kernels.LEAKED]
        if self.carried is None or not self.blocks.options.hydraulic or len(self._leaked_before) != len(nodes):
            return np.zeros(len(nodes))
        return nodes - self._leaked_before

    def conditions_at(self, time: float) -> np.ndarray:
        """The table of conditions (rows, 2) at a flow time: heights as potential energies."""
        table = np.zeros((len(self.conditions), 2))
        height = self.fluid("fluid_density") * math.hypot(*self._gravity())
        for row, one in enumerate(self.conditions):
            value = assigned.now(self.blocks.tables, one.value, time)
            table[row] = one.does, value * height if one.does == kernels.SURFACE else value
        return table

    def _check(self) -> None:
        """Stop on all ranks if the flow has blown up."""
        first = self._lowest(self.number[~np.isfinite(self.nodes[:, kernels.W])])
        if first >= 0:
            raise self._blown_up(first)

    def _blown_up(self, node: int) -> PhysicsError:
        """What is raised where the fluid of a node is not finite. Collective."""
        return PhysicsError(
            f"step {self.blocks.clock.step}: the fluid at flow node {node} is not finite; the hydraulic time step "
            f"{self.dt:g} s is probably too large (stable: {2.0 * self.limit():g} s)"
        )

    # ---- forces --------------------------------------------------------------------------------------------------

    def add_to(self, applied: np.ndarray) -> None:
        if not self.implicit:  # by the places of now in each step: a run that goes on has no others
            self.find_shore()
        self.push(self.state, kernels.P, applied)

    def push(self, state: np.ndarray, column: int, applied: np.ndarray, free: bool = True) -> None:
        """Add a pressure on sides of channels, and on wet free faces if asked, to what is applied to corners: a column
        of rows like those of `state`, copies too. Not collective."""
        if not self.pushes:
            return
        at = self.blocks.x, state, column, applied
        for of in self._loads if free else self._loads[:1]:
            if self.blocks.dim == 2:
                edge, corner, nodes = of
                kernels.loads(edge, corner, nodes, *at)
            else:
                corner, nodes, on_sides, nodes_there, g, e = of
                kernels_space.loads(corner, nodes, *at)
                kernels_space.loads_on_sides(on_sides, nodes_there, g, e, *at)

    def balanced(self) -> None:
        if self._on and not self.pushes:
            return
        self._keep_pressures()

    def _keep_pressures(self) -> None:
        """Pressures and saturations are those of before: fluid that this takes is given, what has no room left goes."""
        p, s = self.state[: self.owned, kernels.P], self.state[: self.owned, kernels.S]
        w = self.nodes[:, kernels.V] * (s + p / self.fluid("fluid_bulk"))
        self.nodes[:, kernels.GIVEN] += w - self.nodes[:, kernels.W]
        self.nodes[:, kernels.W] = w

    # ---- state on disk -------------------------------------------------------------------------------------------

    def saved_state(self) -> dict[str, Any]:
        """All but the columns, as JSON values."""
        return {
            **self._saved_clock(), "rows": self._saved_properties(),
            "conditions": [asdict(one) for one in self.conditions], "removed": self.removed,
            "implicit_dt": self.implicit_dt, "since_peak": self.since_peak, "passed": self.passed,
            "reshaped": self._reshaped, "found_for": self._found_for, "wells": [well.saved() for well in self.wells],
            "energy": self.energy, "p0": self.p0, "frozen": self.frozen,
        }  # fmt: skip

    def saved_tables(self) -> dict[str, dict[str, np.ndarray]]:
        """Channels with their properties, prescribed nodes, and faces said to be wet, of all ranks; see `condensed`."""
        channels, faces = assigned.numbered(self.row), np.flatnonzero(self.said_wet)
        at = {} if self.condensed is None else {"flow_condensed": dict(zip("xyz", self.condensed.T))}
        return at | {
            "flow_channels": {**channels, "since": self.since[channels["number"]]},
            "flow_conditions": assigned.numbered(self.condition),
            "flow_wet": {"number": faces, "said": self.said_wet[faces].astype(np.int64)},
        }  # fmt: skip

    def saved_rows(self) -> dict[str, dict[str, np.ndarray]]:
        """What this rank's flow nodes hold."""
        held = [*self.nodes.T, *self.state[: len(self.number), : kernels.E].T]
        columns = {name: np.ascontiguousarray(values) for name, values in zip(_COLUMNS, held)}
        return {"flow_nodes": {"number": self.number, **columns}}

    def _wet_of_before(self) -> None:
        """Checkpoints that do not say which faces are wet: those whose nodes all have a pressure or a level, or are of
        one well."""
        does = np.array([one.does for one in self.conditions])[self.condition]
        held = np.isin(does, (kernels.PRESSURE, kernels.SURFACE))
        self.said_wet[around(self.blocks.the_mesh(), np.flatnonzero(held))[0]] |= BY_CONDITION
        for well in self.wells:
            self.said_wet[around(self.blocks.the_mesh(), well.points)[0]] |= BY_WELL

    @staticmethod
    def restored(blocks: Blocks, state: Mapping[str, Any], tables: Mapping[str, Mapping[str, np.ndarray]]) -> None:
        """Inverse of these: the blocks have this fluid; nodes go to their owners with the first storage."""
        made = Flow.of(blocks)
        made._restore_properties(state["rows"])
        made._restore_clock(state)
        made.wells = [Well.restored(one) for one in state["wells"]]
        made.conditions = [Condition(**one) for one in state["conditions"]]
        made.removed = dict(state["removed"])
        made.energy, made.p0 = state.get("energy", made.energy), state.get("p0", 0.0)
        if "flow_condensed" in tables:
            at = tables["flow_condensed"]
            made.condensed = np.column_stack([at[axis] for axis in "xyz" if axis in at])
        made.implicit_dt = state.get("implicit_dt", 0.0)
        made.since_peak, made.passed = state.get("since_peak", 0), state.get("passed", 0)
        made._reshaped, made._found_for = state["reshaped"], state["found_for"]
        channels, points, nodes = (tables[f"flow_{name}"] for name in ("channels", "conditions", "nodes"))
        assigned.put_back(made.row, channels)
        made.since[channels["number"]] = channels["since"]
        assigned.put_back(made.condition, points)
        if "flow_wet" in tables:
            made.said_wet[tables["flow_wet"]["number"]] = tables["flow_wet"]["said"]
        else:
            made._wet_of_before()
        made.frozen = state.get("frozen", False)
        made.number = nodes["number"].astype(np.int64)
        held = np.column_stack([nodes[name] for name in _COLUMNS])
        made.nodes = np.ascontiguousarray(held[:, : kernels.NODE])
        made.state = np.zeros((len(made.number), kernels.STATE))
        made.state[:, : kernels.E] = held[:, kernels.NODE :]

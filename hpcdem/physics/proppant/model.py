"""Proppant in the fluid of a model of blocks: what is assigned to it, and its step.

Grains move between the flow nodes with the slurry of each cycle of flow, and settle in it, in sub-steps of their own
(kernels.py). They make the slurry heavier and more viscous, bridge in narrow channels, and where a node is filled to
the limit they are a pack: nothing but fluid passes, and the walls lean on it. Rows of nodes and channels are those of
the flow, whose order of sums is kept: bits depend on neither ranks nor threads.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from hpcdem.core.account import closed
from hpcdem.core.errors import CommandError
from hpcdem.numerics.exact_sum import exact_sum
from hpcdem.physics.field import assigned
from hpcdem.physics.field.model import CHECK_EVERY, MANY
from hpcdem.physics.flow import kernels as flowing
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.network import LINKS
from hpcdem.physics.proppant import kernels, settling
from hpcdem.physics.proppant.assignments import RATE, ProppantAssignments
from hpcdem.physics.proppant.properties import NAMES

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

COURANT = 0.1
"""Fraction of its slurry that a node may lose in a sub-step, or slightly more where the flow has just changed."""
STALE = 10.0
"""Longest step of flow without a warning, over the time in which a node loses its slurry."""
SWEEPS = 4
"""Number of sweeps over the nodes for the factors of their inflow."""
NO_STOKES = 1.0
"""Reynolds number of a single grain above which Stokes' law is inaccurate."""


class Proppant(ProppantAssignments):
    """The proppant of a model with fluid. Methods are collective unless they say otherwise; CommandError, alike on all
    ranks, for what makes no sense.

    nodes (n, kernels.NODE), state (n + copies, kernels.STATE): rows of the flow.
    """

    name: ClassVar[str] = "proppant"
    kernel_kind: ClassVar[str] = "proppant"
    of_nodes: ClassVar[str] = "proppant_nodes"
    columns: ClassVar[Mapping[str, tuple[str, int]]] = {
        "proppant": ("nodes", kernels.N), "came": ("nodes", kernels.CAME), "left": ("nodes", kernels.LEFT),
        "room": ("nodes", kernels.ROOM), "volume": ("nodes", kernels.VOLUME), "given": ("given", -1),
        "packed": ("state", kernels.PACKED),
    }  # fmt: skip
    """given: fluid that conditions have supplied."""
    widths: ClassVar[Mapping[str, int]] = {"nodes": kernels.NODE, "given": 0, "state": kernels.STATE}
    nodes: np.ndarray
    given: np.ndarray

    def __init__(self, blocks: Blocks, flow: Flow) -> None:
        super().__init__(blocks, flow)
        self.accounts = dict.fromkeys(("came", "left", "removed"), 0.0)
        """Amounts of removed nodes, and lost with removed volume [m2]."""
        self._start_clock(flow.time)
        self.sub_steps = 1
        self._held: np.ndarray | None = None
        self._refused = self._logged_speed = 0.0
        flow.slurry = self
        flow.carried = np.empty(0) if flow.carried is None else flow.carried
        flow.more["concentration"] = lambda: self.state[: len(self.number), kernels.C]
        flow.more["proppant"] = lambda: self.nodes[:, kernels.N]
        flow.more["pack_pressure"] = lambda: self.state[: len(self.number), kernels.PUSHES]

    @classmethod
    def new(cls, blocks: Blocks) -> Proppant:
        return cls(blocks, Flow.of(blocks))

    def fill(self, nodes: np.ndarray | None, concentration: float) -> None:
        """The slurry of flow nodes among these points (None: all) has this concentration now."""
        limit = self.values["proppant_concentration_limit"]
        if not 0.0 <= concentration <= limit:
            raise CommandError(
                f"the concentration of proppant must lie between 0 and that of a pack, {limit:g}, got {concentration:g}"
            )
        at = self._nodes(nodes)
        self.blocks.close_model()
        self.update_slurry()
        mine = np.isin(self.number, at)
        if concentration > 0.0 and not self.blocks.comm.any(bool((self.nodes[mine, kernels.ROOM] > 0.0).any())):
            raise CommandError("these flow nodes are dry: set flow-node initial pressure or saturation first")
        new = concentration * self.nodes[mine, kernels.ROOM]
        self.nodes[mine, kernels.CAME] += new - self.nodes[mine, kernels.N]
        self.nodes[mine, kernels.N] = new
        self._settle()
        self.flow.find_geometry()

    # ---- what is queried -------------------------------------------------------------------------------------------

    @property
    def on(self) -> bool:
        """Return whether proppant moves. Not collective."""
        return self.blocks.options.proppant and self.blocks.options.hydraulic and len(self.flow.network.channels) > 0

    def account(self) -> dict[str, float]:
        """Volumes of proppant [m2]: came by conditions and at the beginning, stored (suspended, packed), left with
        fluid that was removed, removed with channels; closing: what does not add up, relative: over the largest."""
        self.blocks.close_model()
        n, packed = self.nodes[:, kernels.N], self.state[: len(self.number), kernels.PACKED]
        found = {"stored": self._sum(n), "packed": self._sum(n * packed)}
        for name, column in (("came", kernels.CAME), ("left", kernels.LEFT)):
            found[name] = self._sum(self.nodes[:, column], self.accounts[name])
        found["removed"] = self.accounts["removed"]
        return closed(found, found["came"] - found["stored"] - found["left"] - found["removed"])

    def speed(self) -> float:
        """Settling velocity of a single grain [m/s], upwards if negative. Not collective."""
        flow, v = self.flow, self.values
        law = settling.stokes if v["proppant_stokes"] > 0.0 else settling.terminal
        gravity = math.hypot(*self._gravity())
        return law(v["proppant_size"], v["proppant_density"], flow.fluid("fluid_density"), flow.viscosity, gravity)

    def everywhere(self, gathered: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray, np.ndarray], None]:
        """`thicken` for all channels of the model; gathered: values of all flow nodes from those of this rank."""
        own = self.state[: len(self.number)]
        found = {k: gathered(own[:, k]) for k in (kernels.C, kernels.PACKED, kernels.THICK)}
        state = np.zeros((len(found[kernels.C]), kernels.STATE))
        for k, values in found.items():
            state[:, k] = values
        return lambda ends, table: self._thicken(ends, state, table)

    def packs(self, gathered: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray] | None:
        """Return the function of volumes (n,) [m2] of all flow nodes that gives the pressure of packs (137) [Pa] and
        its derivative, rows (2, n); None if no pack carries load. Grains stay at their positions."""
        modulus = self.values["proppant_modulus"]
        if not modulus > 0.0 or not self.on or self.blocks.options.one_way:
            return None
        full = self.values["proppant_concentration_limit"] / np.maximum(gathered(self.nodes[:, kernels.N]), 1e-300)

        def pushed(volume: np.ndarray) -> np.ndarray:
            strain = 1.0 - full * volume
            return modulus * np.stack([np.maximum(strain, 0.0), np.where(strain > 0.0, -full, 0.0)])

        return pushed

    def show(self, pushes: np.ndarray) -> None:
        """Packs of the nodes held here, copies too, push with so much [Pa]. Not collective."""
        self.state[:, kernels.PUSHES] = pushes

    def thicken(self, ends: np.ndarray, table: np.ndarray) -> None:
        """Apply the effect of proppant to the channels of this rank. Not collective."""
        if self._held is self.flow.held:  # else rows are about to be found
            self._thicken(ends, self.state, table)

    def _thicken(self, ends: np.ndarray, state: np.ndarray, table: np.ndarray) -> None:
        v = self.values
        limit, size = v["proppant_concentration_limit"], v["proppant_size"]
        kernels.thicken(
            LINKS[self.blocks.dim], ends, state, v["aperature_factor"], kernels.kozeny_carman(limit, size),
            v["proppant_density"] / self.flow.fluid("fluid_density") - 1.0, table,
        )  # fmt: skip

    # ---- tables of this rank -------------------------------------------------------------------------------------

    def corners(self, blocks: Any) -> np.ndarray:
        return self.flow.corners(blocks)

    def springs(self, blocks: Any) -> np.ndarray | None:
        """A pack is as stiff as its modulus over the aperture without opening, as the flow counts its fluid."""
        modulus = self.values.get("proppant_modulus", 0.0)
        return self.flow.springs_of(blocks, modulus) if modulus > 0.0 and self.flow.pushes else None

    def storage_rebuilt(self) -> None:
        flow, comm, network = self.flow, self.blocks.comm, self.flow.network
        self._forget(~network.there[self.number])
        if not len(network.channels):
            return
        mine = flow.number
        new, _ = self._fetch(mine, flow.held[len(mine) :])
        self.nodes[:, kernels.ROOM_BEFORE] = self.nodes[:, kernels.ROOM]
        self._held = flow.held
        if comm.any(bool(new.any())):
            self.given[new] = flow.nodes[new, flowing.GIVEN]
        lost = self.nodes[:, kernels.N] * (1.0 - flow.kept)
        self.nodes[:, kernels.N] -= lost
        if comm.any(bool(lost.any())):
            self.accounts["removed"] += exact_sum(lost, comm)
            self.nodes[:, [kernels.ROOM, kernels.VOLUME]] *= flow.kept[:, None]
        self._carries = np.repeat(self.carries[flow.channels_here], LINKS[self.blocks.dim])
        self._out, self._falls = np.zeros((len(self._carries), 2)), np.zeros(len(self._carries))
        self._takes = np.zeros(len(mine))
        self._prescribed = self.condition[mine].astype(np.int64)
        self._settle()
        flow.find_geometry()

    def _book_gone(self, gone: np.ndarray) -> None:
        comm = self.blocks.comm
        self.accounts["removed"] += exact_sum(self.nodes[gone, kernels.N], comm)
        for name, column in (("came", kernels.CAME), ("left", kernels.LEFT)):
            self.accounts[name] += exact_sum(self.nodes[gone, column], comm)

    def _settle(self) -> None:
        v = self.values
        kernels.settle(
            1.0, v["proppant_concentration_limit"], v["viscosity_power"], v["proppant_modulus"], self.nodes, self.state
        )
        self._refresh()

    def update_slurry(self) -> None:
        """Set the slurry of the nodes to its present volume after commands. Not collective."""
        now = self._slurry_volumes()
        self.nodes[:, kernels.ROOM_BEFORE] = now
        self.given = self.flow.nodes[:, flowing.GIVEN].copy()
        self.time = self.flow.time

    def _slurry_volumes(self) -> np.ndarray:
        """Update the volume of each node and its space for slurry, and return the latter."""
        volume = self.flow.nodes[:, flowing.V]
        self.nodes[:, kernels.VOLUME] = volume
        self.nodes[:, kernels.ROOM] = now = np.minimum(self.flow.nodes[:, flowing.W], volume)
        return now

    def filled(self) -> None:
        """A command has given fluid to nodes, or taken it; their proppant stays."""
        if self._held is self.flow.held:
            self.update_slurry()
            self._settle()

    def elements_removed(self, elements: np.ndarray) -> None:
        self._held = None

    def mesh_replaced(self) -> None:
        self.close()

    # ---- the step ------------------------------------------------------------------------------------------------

    def check_start(self) -> None:
        channels = self.flow.network.channels
        if not self.on:
            return
        if not self.carries[channels].any():
            raise CommandError("no channel carries proppant: use model option proppant off, or assign it again")
        v, flow = self.speed(), self.flow
        size, density = self.values["proppant_size"], flow.fluid("fluid_density")
        found = settling.reynolds(v, size, density, flow.viscosity)
        if self.blocks.log is not None and v != self._logged_speed:
            self._logged_speed = v
            stokes = self.values["proppant_stokes"] > 0.0
            law = "Stokes" if stokes else "Schiller and Naumann"
            self.blocks.log.info(f"proppant: a grain settles by {v:.4g} m/s after {law}, Reynolds number {found:.3g}")
            if stokes and found > NO_STOKES:
                slow = settling.terminal(size, self.values["proppant_density"], density, flow.viscosity,
                                         math.hypot(*self._gravity()))  # fmt: skip
                self.blocks.log.warn(
                    f"proppant-stokes: at a Reynolds number of {found:.3g} Stokes' law does not hold; after Schiller "
                    f"and Naumann a grain settles by {slow:.4g} m/s"
                )

    def follow(self) -> None:
        if self.flow.frozen and self.values["proppant_modulus"] > 0.0:  # packs give way
            self.flow.update_volumes()
            self._slurry_volumes()
            self._settle()
        self.flowed()

    def flowed(self) -> None:
        flow = self.flow
        dt = flow.time - self.time
        if not dt > 0.0:
            return
        if not self.on:
            self.update_slurry()
            return
        with self.blocks.timers("proppant"):
            self._advance(dt)
        self.cycles += 1
        if not self.blocks.options.mechanical:  # else the flow does, before it continues
            flow.find_geometry()

    def _advance(self, dt: float) -> None:
        """Advance by the time [s] for which the fluid has flowed."""
        flow, v, nodes, comm = self.flow, self.values, self.nodes, self.blocks.comm
        nodes[:, kernels.ROOM_BEFORE] = nodes[:, kernels.ROOM]
        self._slurry_volumes()
        ends, begin, channel, side = flow.links
        assert flow.carried is not None
        q, table, speed = flow.carried / dt, flow.channel_table, self.speed()
        if (links := LINKS[self.blocks.dim]) > 1:
            q -= np.repeat(q.reshape(-1, links).mean(axis=1), links)
        self._find_falls()
        fall = self._falls
        if flow.implicit or self.cycles % CHECK_EVERY == 0:
            least = kernels.fastest(begin, channel, side, q, table, fall, speed, flow.nodes, nodes)
            least = float(comm.min_into(np.array([least]))[0])
            self.sub_steps = max(1, math.ceil(dt / (COURANT * least)))
            if self.sub_steps > MANY:
                raise CommandError(
                    f"proppant would need {self.sub_steps} sub-steps in a step of flow of {dt:.3g} s: reduce the time "
                    "step of flow"
                )
            self._warn_stale(dt, least)
        count = self.sub_steps
        short = dt / count
        self._sources(dt, count)
        limit, narrow = v["proppant_concentration_limit"], v["proppant_size_factor"] * v["proppant_size"]
        refused = 0.0
        for k in range(1, count + 1):
            part = k / count
            refused += kernels.pour(short, limit, nodes, self.state)
            kernels.carry(ends, fall, self._carries, q, table, flow.state, narrow, speed, self.state, self._out)
            kernels.give(begin, channel, side, self._out, short, nodes, self.state)
            self._refresh()
            kernels.come(begin, channel, side, ends, self._out, short, nodes, self.state)
            for _ in range(SWEEPS):
                kernels.take(begin, channel, side, ends, self._out, short, limit, part, nodes, self.state, self._takes)
                self.state[: len(nodes), kernels.TAKES] = self._takes
                self._refresh()
            kernels.move(
                begin, channel, side, ends, self._out, short, part, limit, v["viscosity_power"], v["proppant_modulus"],
                nodes, self.state,
            )  # fmt: skip
            self._refresh()
        self.time = flow.time
        self._report_refused(refused)

    def _warn_stale(self, dt: float, least: float) -> None:
        """Grains that move far by one flow around loops, which their weight would have changed meanwhile."""
        flow, log = self.flow, self.blocks.log
        if dt > STALE * least and len(flow.network.ends) >= len(flow.network.nodes) and log is not None:
            log.warn_once(
                "proppant stale",
                f"a step of flow of {dt:.3g} s is {dt / least:.3g} times as long as grains need from node to node: "
                f"currents driven by their weight need steps of at most {STALE * least:.3g} s",
            )

    def _find_falls(self) -> None:
        """Find the vertical extent of this rank's channels at their present positions."""
        down = np.array(self._gravity())
        down /= max(float(np.sqrt((down * down).sum())), 1e-300)
        kernels.falls(*self.flow.sides, self.blocks.x, down, self._falls)

    def _sources(self, dt: float, count: int) -> None:
        """Inflow and outflow by conditions in each sub-step of the owned nodes."""
        flow, tables = self.flow, self.blocks.tables
        came = flow.nodes[:, flowing.GIVEN] - self.given
        self.given = flow.nodes[:, flowing.GIVEN].copy()
        kinds = np.array([kind == RATE for kind, _ in self.conditions])[self._prescribed]
        value = np.array([assigned.now(tables, value, flow.time) for _, value in self.conditions])[self._prescribed]
        slurry = np.maximum(self.nodes[:, kernels.ROOM_BEFORE], 1e-300)
        leaves = np.minimum(came, 0.0) / slurry
        self.nodes[:, kernels.SOURCE] = np.where(
            kinds, value * (dt / count), np.where(came > 0.0, value * came, leaves) / count
        )

    def _report_refused(self, refused: float) -> None:
        self._refused += refused
        log = self.blocks.log
        if self.cycles % CHECK_EVERY == CHECK_EVERY - 1 or self.flow.implicit:
            total = float(self.blocks.comm.sum_into(np.array([self._refused]))[0])
            self._refused = 0.0
            if total > 0.0 and log is not None:
                log.warn_once(
                    "proppant refused", f"inflow nodes of proppant are packed: {total:.3g} m2 of it could not enter"
                )

    # ---- forces --------------------------------------------------------------------------------------------------

    def add_to(self, applied: np.ndarray) -> None:
        if self.values["proppant_modulus"] > 0.0:
            self.flow.push(self.state, kernels.PUSHES, applied, free=False)

    # ---- state on disk -------------------------------------------------------------------------------------------

    def saved_state(self) -> dict[str, Any]:
        return {
            "values": self.values, "conditions": [list(one) for one in self.conditions], "accounts": self.accounts,
            **self._saved_clock(),
        }  # fmt: skip

    def saved_tables(self) -> dict[str, dict[str, np.ndarray]]:
        """Channels that carry it, and prescribed nodes, of all ranks."""
        return {
            "proppant_channels": {"number": np.flatnonzero(self.carries)},
            "proppant_conditions": assigned.numbered(self.condition),
        }

    @staticmethod
    def restored(blocks: Blocks, state: Mapping[str, Any], tables: Mapping[str, Mapping[str, np.ndarray]]) -> None:
        """Inverse of these: the blocks have this proppant; nodes go to their owners with the first storage."""
        made = Proppant.of(blocks)
        made.values = {name: float(state["values"][name]) for name in NAMES}
        made.conditions = [(str(kind), value) for kind, value in state["conditions"]]
        made.accounts = dict(state["accounts"])
        made._restore_clock(state)
        made.carries[tables["proppant_channels"]["number"]] = True
        assigned.put_back(made.condition, tables["proppant_conditions"])
        made._restore_rows(tables)

"""Fluid in fractures as a load on blocks: its clock, its step and what is saved.

All ranks know the assignments (assignments.py), the state is distributed (channels.py), and pressure loads faces
(faces.py); values.py says what can be asked of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.units import counted, with_prefix
from hpcdem.physics.field import assigned
from hpcdem.physics.field.model import CHECK_EVERY
from hpcdem.physics.flow import account, kernels
from hpcdem.physics.flow.assignments import Condition
from hpcdem.physics.flow.values import Values
from hpcdem.physics.flow.wells import Well

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

GLANCE = 8
"""Number of sub-steps between checks whether an estimated sub-step exceeds half the stability limit: pieces that rotate
as they fly apart shorten their channels faster than the regular check notices."""
SAFETY = 0.8
"""Fraction of half the stability limit up to which an estimated sub-step is accepted when blocks move."""
FAR = 2.0
"""Times the stability limit: where a sub-step is longer any full node that nothing holds overshoots ever further."""


class Flow(Values):
    """The fluid of a model of blocks. Methods are collective unless they say otherwise; CommandError, alike on all
    ranks, for what makes no sense."""

    name: ClassVar[str] = "fluid"
    kernel_kind: ClassVar[str] = "flow"
    label: ClassVar[str] = "flow"
    word: ClassVar[str] = "hydraulic"

    def __init__(self, blocks: Blocks) -> None:
        super().__init__(blocks)
        self.energy: dict[str, float] | None = dict.fromkeys(account.ENTRIES, 0.0)
        """Energies of implicit steps [J/m], in space [J], see `energies`; None: not known any more."""
        self.implicit_dt = 0.0
        self.since_peak = self.passed = 0
        self.condensed: np.ndarray | None = None
        """Positions (nn, dim) of the nodes of the blocks at which these have eliminated the elements."""
        self._checked = False
        """The length of a sub-step that was set is one that can be."""
        self._logged: tuple[float, float] = (0.0, 0.0)

    @property
    def stays(self) -> bool:
        return True

    @property
    def keeps_time(self) -> bool:
        return self.blocks.options.hydraulic

    def energies(self) -> dict[str, float]:
        """The energy of the fluid and the blocks in implicit steps [J/m], in space [J]: `account.ENTRIES`, what does
        not add up (closing), over the largest (relative). CommandError where packs of grains took some."""
        if self.energy is None:
            raise CommandError("the energy budget does not support packs of grains that carry load")
        return account.closed(self.energy)

    def fill(self, nodes: np.ndarray | None, pressure: float | None = None, saturation: float | None = None) -> None:
        """Flow nodes among these points (None: all) contain fluid at this pressure [Pa], or at this saturation."""
        if (pressure is None) == (saturation is None):
            raise CommandError("give either a pressure or a saturation")
        given = pressure if saturation is None else saturation
        assert given is not None
        if not math.isfinite(given) or given < 0.0 or (saturation is not None and saturation > 1.0):
            what = "the pressure must not be negative" if saturation is None else "the saturation must lie from 0 to 1"
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

    def storage_rebuilt(self) -> None:
        """Elements have other rows or owners, or there are other channels."""
        if not len(self.network.channels):
            self._forget(np.ones(len(self.number), bool))
            self._wet, self._wet_rows = self._wet[:0], self._wet_rows[:0]
            return
        self._bind_faces()
        self._shrink()
        self._take_heights()
        self._refresh()
        self.find_shore()
        self._reshaped = self._checked = False
        if self._found_for != self._given():
            self._find_step()
        if not self.blocks.options.mechanical:
            self.blocks.clock.dt = self.sub_steps * self.dt

    def joints_opened(self) -> None:
        """Joints broke: their faces are open now."""
        if len(self.network.channels) and self.blocks.closed:
            self.note_leaks()

    def mesh_replaced(self) -> None:
        """Release the flow of the replaced mesh; `of_mesh` reports that it is removed with it."""
        self.close()

    def balanced(self) -> None:
        if self._on and not self.pushes:
            return
        self._keep_pressures()

    # ---- the clock ---------------------------------------------------------------------------------------------------

    def _given(self) -> list[float]:
        """Return everything except the channels that determines the length of a sub-step."""
        o = self.blocks.options
        switches = [float(o.mechanical), float(o.dynamic), float(o.flow_every), float(o.flow_steps), o.flow_dt]
        return [*switches, *self._gravity(), self.blocks.clock.dt if o.mechanical else 0.0]

    def _find_step(self) -> None:
        """Sub-steps of a cycle and their length, from what was set and what is stable."""
        blocks, o, limit = self.blocks, self.blocks.options, self.limit()
        self._found_for, self._checked = self._given(), False
        period = 0.0 if not o.mechanical or not o.dynamic else o.flow_every * blocks.clock.dt
        instead = (
            f"{o.flow_every} mechanical steps; model time-step hydraulic gives it its own clock, model solve hydraulic "
            "uses implicit steps"
        )
        self._divide(o.flow_steps, o.flow_dt, period, limit, SAFETY * limit, instead)
        self._report_step(limit)

    def _outrun(self) -> bool:
        """An estimated sub-step is more than half the stability limit, before it is checked again. Collective."""
        o = self.blocks.options
        if o.flow_dt > 0.0 or o.flow_steps > 0 or self.cycles % max(1, GLANCE // self.sub_steps):
            return False
        return self.dt > self.limit()

    def _report_step(self, limit: float) -> None:
        log = self.blocks.log
        known, before = self._logged
        if log is None or (abs(self.dt - known) <= 0.1 * known and abs(limit - before) <= 0.1 * before):
            return
        self._logged, shown = (self.dt, limit), partial(with_prefix, unit="s")
        log.info(
            f"flow: {counted(self.sub_steps, 'sub-step')} of {shown(self.dt)} in each cycle; the stability limit is "
            f"{shown(2.0 * limit)}, half of it {shown(limit)}"
        )
        if self.dt > limit * (1.0 + 1e-9):
            log.warn_once(
                f"flow step {self.dt > 2.0 * limit}",
                f"the hydraulic time step {self.dt:g} s is {self.dt / (2.0 * limit):.2f} of the stability limit "
                f"{2.0 * limit:.4g} s. Reduce it if the run becomes unstable",
            )

    def check_start(self) -> None:
        o, conditions = self.blocks.options, self.conditions
        if not self._on:
            return
        if o.mechanical and not o.dynamic and o.flow_dt == 0.0:
            raise CommandError("static runs need model time-step hydraulic for the time of flow")
        surface = [row for row in np.unique(self.condition).tolist() if conditions[row].does == kernels.SURFACE]
        if surface and not any(self._gravity()):
            raise CommandError("flow-surface needs gravity: set model gravity first")
        self.check_wells()
        if not self._checked and (o.flow_dt > 0.0 or o.flow_steps > 0):
            self._refuse_far()
            self._checked = True

    def _refuse_far(self) -> None:
        """CommandError for a sub-step with which the flow would certainly blow up. Collective."""
        if not self.dt > FAR * 2.0 * self.limit():
            return
        n = self.owned
        rise = np.abs(np.diff(self.state[self._ends, kernels.E], axis=1)[:, 0]) * self.channel_table[:, kernels.WEIGHT]
        each = np.abs(self.channel_table[:, kernels.CONDUCT]) * (self.fluid("fluid_bulk") + kernels.STEEPEST * rise)
        rate = sum(np.bincount(ends, each, len(self.state))[:n] for ends in self._ends.T)
        does = np.array([one.does for one in self.conditions])[self.condition[self.number]]
        held = np.isin(does, (kernels.PRESSURE, kernels.SURFACE))
        held |= np.isin(self.number, np.concatenate([self.number[:0], *(well.points for well in self.wells)]))
        stable = np.divide(self.nodes[:, kernels.V], rate, out=np.full(n, math.inf), where=(rate > 0.0) & ~held)
        least = stable.min(initial=math.inf)
        least = float(self.blocks.comm.min_into(np.array([least]))[0])
        if self.dt > FAR * least:
            setting = "time-step" if self.blocks.options.flow_dt > 0.0 else "sub-step"
            first = self._lowest(self.number[stable == least])
            raise CommandError(
                f"model {setting} hydraulic: sub-steps of {self.dt:.4g} s are {self.dt / least:.3g} times what is "
                f"stable at flow node {first}, {least:.4g} s, so the flow would become unstable. Reduce them, or use "
                "model solve hydraulic, which uses implicit steps"
            )

    # ---- the step ----------------------------------------------------------------------------------------------------

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
                self.update_volumes()
                if any(self._gravity()):
                    self._take_heights()
                    self._refresh()
            if o.mechanical and (self.cycles % CHECK_EVERY == 0 or self._found_for != self._given() or self._outrun()):
                self._find_step()
            if self.carried is not None:
                self.carried = np.zeros(len(self._ends))
                self._leaked_before = self.nodes[:, kernels.LEAKED].copy()
            condition = self.condition[self.number]
            for _ in range(self.sub_steps):
                self._sub_step(condition)
            self.find_shore()
            self.cycles += 1
        if self.cycles % CHECK_EVERY == 0:
            self._check(self.number[~np.isfinite(self.nodes[:, kernels.W])])

    def _sub_step(self, condition: np.ndarray) -> None:
        """condition (n,): rows of the conditions of the owned nodes."""
        blocks, before, after = self.blocks, self.time, self.time + self.dt
        arguments = self.dt, condition, self.conditions_at(after), self.fluid("fluid_bulk"), self.nodes, self.state
        if blocks.threads == 1:
            into, gone = self._sums
            kernels.sub_step(
                self._ends, self._law, self._law_table, self._since, self._leaks, before, after, self._flowing_table(),
                self._q, self._lost_fluid, into, gone, *arguments,
            )  # fmt: skip
        else:
            self._find_flows(self.dt)
            links = self._begin, self._channel, self._side, self._q, self._leaks, self._lost_fluid
            kernels.fill(blocks.threads, *links, *arguments)
        self.time = after
        if self.carried is not None:
            self.carried += self.dt * self._q
        if self.wells:
            self._pump(before)
        self._refresh()

    def _pump(self, before: float) -> None:
        """Apply the wells since the last call."""
        there = self.network.there
        points = [well.points[there[well.points]] for well in self.wells]
        at = np.concatenate(points)
        row = np.minimum(np.searchsorted(self.number, at), max(len(self.number) - 1, 0))
        mine = self.number[row] == at if len(self.number) else np.zeros(len(at), bool)
        row = row[mine]
        collected = np.zeros((3, len(at)))
        collected[:2, mine], collected[2, mine] = self.nodes[row, : kernels.V + 1].T, self.state[row, kernels.E]
        collected = self.blocks.comm.sum_into(collected)
        if not np.isfinite(collected).all():
            self._check(at[~np.isfinite(collected).all(axis=0)])
        after, bulk = np.empty(len(at)), self.fluid("fluid_bulk")
        value_at = partial(assigned.now, self.blocks.tables)
        ends = np.cumsum([len(one) for one in points])
        for well, begin, end in zip(self.wells, [0, *ends[:-1].tolist()], ends.tolist()):
            if end > begin:
                after[begin:end] = well.filled(collected[:, begin:end], before, self.time, bulk, value_at)
            self.report_stage(well, before, self.time)
        came = (after - collected[0])[mine]
        self.nodes[row, kernels.W] = after[mine]
        self.nodes[row, kernels.GIVEN] += came
        self.nodes[row, kernels.INFLOW] = came / (self.time - before)
        self._find_state(row)

    def _check(self, bad: np.ndarray) -> None:
        """Stop on all ranks if the flow has blown up at one of these nodes (n,)."""
        first = self._lowest(bad)
        if first >= 0:
            raise self._blown_up(f"the fluid at flow node {first}", 2.0 * self.limit())

    # ---- state on disk -----------------------------------------------------------------------------------------------

    def saved_state(self) -> dict[str, Any]:
        """Return everything but the columns, as JSON values."""
        return {
            **self._saved_clock(), "rows": self._saved_properties(),
            "conditions": [asdict(one) for one in self.conditions], "removed": self.removed,
            "implicit_dt": self.implicit_dt, "since_peak": self.since_peak, "passed": self.passed,
            "reshaped": self._reshaped, "found_for": self._found_for, "wells": [well.saved() for well in self.wells],
            "energy": self.energy, "p0": self.p0, "frozen": self.frozen,
        }  # fmt: skip

    def saved_tables(self) -> dict[str, dict[str, np.ndarray]]:
        """Channels with their properties, prescribed nodes, and faces assigned as wet, of all ranks; see
        `condensed`.
        """
        channels, faces = assigned.numbered(self.row), np.flatnonzero(self.wet_bits)
        at = {} if self.condensed is None else {"flow_condensed": dict(zip("xyz", self.condensed.T))}
        return at | {
            "flow_channels": {**channels, "since": self.since[channels["number"]]},
            "flow_conditions": assigned.numbered(self.condition),
            "flow_wet": {"number": faces, "said": self.wet_bits[faces].astype(np.int64)},
        }  # fmt: skip

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
        channels, points = tables["flow_channels"], tables["flow_conditions"]
        assigned.put_back(made.row, channels)
        made.since[channels["number"]] = channels["since"]
        assigned.put_back(made.condition, points)
        if "flow_wet" in tables:
            made.wet_bits[tables["flow_wet"]["number"]] = tables["flow_wet"]["said"]
        else:
            made._wet_of_before()
        made.frozen = state.get("frozen", False)
        made._restore_rows(tables)

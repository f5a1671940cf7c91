"""A field that diffuses in the elements of blocks: its tables of a rank, its clock and its step.

What commands say of it (conditions.py) is known to all ranks by the numbers of the mesh. Values belong to corners of
elements and travel with them, as positions do (columns of `State.cold`); what flows between them is that of elements of
any kind (elements.py). Corners that are connected are one node (nodes.py). Where joints break corners part with the
value that they have: each side of a crack has its own.

A field is a subclass that says what it is called, its properties, capacity and conductivity. Heat (physics/heat) and
moisture (physics/moisture) are two.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.units import counted, with_prefix
from hpcdem.physics.fdem import by_temperature, user_laws
from hpcdem.physics.fdem.moduli import moduli
from hpcdem.physics.field import assigned, elements, kernels
from hpcdem.physics.field.conditions import Conditions
from hpcdem.physics.field.elements import Conduction
from hpcdem.physics.field.faces import FaceCondition
from hpcdem.physics.field.model import CHECK_EVERY, Tables
from hpcdem.physics.field.nodes import Nodes

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

SAFETY = 0.9
"""Fraction of the stability limit up to which an estimated sub-step is accepted."""
SPREAD = 0.1
"""Largest distance of the corners of one node in opening joints, over the mean edge."""


class Diffusing(Conditions):
    """A field of a model of blocks. t (n, w): values at the corners of all elements held here; at: its nodes there."""

    kept: ClassVar[tuple[str, ...]] = ("switched_on", "own_steps", "own_dt")
    """Attributes that checkpoints hold in addition."""
    at: Nodes
    conduction: Conduction

    def __init__(self, blocks: Blocks) -> None:
        super().__init__(blocks)
        self._start_clock(blocks.clock.time)
        self.switched_on, self.own_steps, self.own_dt = True, 0, 0.0
        self.t = np.empty((0, 3))
        self._stale = True
        self._checked = False
        self._stiffness_of: np.ndarray | None = None
        self._stiffness, self._wide = np.empty(0), np.empty(0, bool)
        self._found_for: tuple[float, ...] = ()
        self._logged_dt = 0.0
        self._warned_obtuse = False
        self._limit = math.inf

    @property
    def stays(self) -> bool:
        return True

    @property
    def on(self) -> bool:
        """Return whether the field flows. Not collective."""
        return self.switched_on and bool(self.rows)

    @property
    def keeps_time(self) -> bool:
        return self.on

    def find_contacts(self) -> None:
        """Find where the field crosses from surface to surface now; the model is closed. Not collective."""

    def clock(self, on: bool | None = None, steps: int | None = None, dt: float | None = None) -> None:
        """Set whether the field flows; sub-steps of a cycle, 0: as many as are needed; their length [s], 0: by the
        clock of the blocks."""
        if (steps is not None and steps < 0) or (dt is not None and not 0.0 <= dt < math.inf):
            raise CommandError(f"sub-steps of {self.name} and their length must not be negative")
        with self.changing():
            self.switched_on = self.switched_on if on is None else on
            self.own_steps = self.own_steps if steps is None else steps
            self.own_dt = self.own_dt if dt is None else dt

    def means(self) -> np.ndarray:
        """(n_own,) of the corners of elements; the model is closed. Not collective."""
        return by_temperature.means(self.blocks, self.quantity)

    def eigenstress(self, blocks: Any) -> np.ndarray | None:
        if not self.expands or self.quantity not in blocks.cold:
            return None
        if self._stiffness_of is not blocks.number:  # whatever changes it makes storage of its own
            number = blocks.number[blocks.owned]
            of = moduli(blocks.element_rows, blocks.options.plane_stress)
            bulk = of.bulk[blocks.element_row[number]]
            self._stiffness = len(of.normal) * bulk * self.column(self.expansion)[self.row[number]]
            self._wide, self._stiffness_of = blocks.the_mesh().cells[number, 3] >= 0, blocks.number
        t, free, out = blocks.cold[self.quantity], blocks.cold[self.unstressed][:, 0], np.empty(blocks.n_own)
        kernels.eigenstress(self._wide, t, self._stiffness, free, out)
        if len(blocks.the_mesh().hexes):
            of = blocks.hex_rows()
            out[of.rows] = self._stiffness[of.rows] * (free[of.rows] - of.means(t)[:, None])
        part = by_temperature.part_of_young(blocks)
        return out if part is None else out * part

    def corners(self, blocks: Any) -> np.ndarray:
        return np.zeros((blocks.n_own, 4), bool)

    def add_to(self, applied: np.ndarray) -> None:
        """Do nothing: the stress of the field is in the elements."""

    def reach(self, blocks: Any, middle: np.ndarray) -> float:
        """Elements around a node of the field."""
        cells, stride = blocks.the_mesh().cells[blocks.number], blocks.stride
        far = np.zeros(1)
        for k in range(4):
            there = cells[:, k] >= 0
            if there.any():
                offset = blocks.x[there, stride * k : stride * k + blocks.dim] - middle[there]
                far[0] = max(far[0], float((offset * offset).sum(axis=1).max()))
        return 2.0 * math.sqrt(float(blocks.comm.max_into(far)[0])) + SPREAD * float(blocks.mean_edge)

    # ---- tables of this rank -------------------------------------------------------------------------------------

    def storage_rebuilt(self) -> None:
        """Elements have other rows or owners, or something was set."""
        blocks, halo = self.blocks, self.blocks.halo
        self._make_columns()
        cold, own = blocks.cold, blocks.owned
        width = cold[self.quantity].shape[1]
        before = self._content()
        was = cold[self.quantity].copy()
        self.t, weight = (np.zeros((len(blocks.number), width)) for _ in range(2))
        self.t[own], weight[own] = cold[self.quantity], cold[self.capacities]
        halo.fill(self.t)
        halo.fill(weight)
        each = self._capacities()[self.row[blocks.number]]
        self._corner_capacity = each[:, None] * blocks.local.true_mass[:, :width]
        changed = not np.array_equal(cold[self.capacities], self._corner_capacity[own])
        cold[self.capacities] = self._corner_capacity[own].copy()
        cold[self.quantity] = self.t[own]  # one place for both
        self.conduction = Conduction(blocks, width, self._conductivities)
        self._q = np.zeros_like(self.t)
        self._bind_others()
        self._make_nodes()
        kernels.unite(self.at.begin, self.at.corner, weight.reshape(-1), self.t.reshape(-1))
        united = blocks.comm.any(not np.array_equal(was, cold[self.quantity]))
        if united:
            halo.fill(self.t)
            blocks.local.follow_heat()
        if blocks.comm.any(changed) or united:
            self.accounts["commands"] += self._content() - before
        self._bound()
        self._checked = False
        self._find_step()
        if not blocks.options.mechanical and self._sets_pace():
            blocks.clock.dt = self.sub_steps * self.dt

    def _bind_others(self) -> None:
        """Conductances are known, nodes not yet."""

    def _bound(self) -> None:
        """Complete the tables of this rank; called when only the length of sub-steps is missing."""

    def _sets_pace(self) -> bool:
        """The clock of the model is that of this field where blocks are at rest."""
        pace = (one for one in self.blocks.surface_loads if one.keeps_time)
        return next(pace, self) is self

    def _warn_obtuse(self) -> None:
        """Warn where obtuse angles give negative conductance: values of explicit steps may leave the range of their
        neighbours. Rank 0 only."""
        blocks = self.blocks
        if self._warned_obtuse or blocks.log is None:
            return
        self._warned_obtuse = True
        number = np.flatnonzero(blocks.alive & (self.row > 0))
        against, edges, obtuse = elements.against(blocks.the_mesh(), number, self.at.number, self._conductivities)
        if against:
            blocks.log.warn_once(
                f"obtuse {self.name}",
                f"{against} of {edges} edges have negative conductance for {self.name}, as angles of {obtuse} are "
                f"obtuse: near steep fronts {self.several} may leave the range of their neighbours",
            )

    def _make_nodes(self) -> None:
        """Make the nodes for the present connections of faces, and update what depends on them. Collective."""
        self.at = Nodes(self.blocks, self.name, self._corner_capacity, self.held)
        self._warn_obtuse()
        self.exposed.bind(self.t.shape[1])
        self._find_limit()
        self._stale = False
        self.find_contacts()

    def renew_nodes(self) -> None:
        """Nodes are those of the joints that hold now; the model is closed."""
        if self._stale:
            self._make_nodes()

    def _find_limit(self) -> None:
        """Longest stable sub-step of nodes that are not held [s], by Gershgorin's circles: C over half the sum of
        conductances and of their sizes, and of the transfer at faces; infinite where missing."""
        corner = self.conduction.sizes.copy()
        self.exposed.add_sizes(self.time, corner.reshape(-1))
        self._add_to_limit(corner)
        total, capacity = self.at.sums(corner), self.at.capacity
        free = (self.at.held < 0) & (total > 0.0)
        least = float((capacity[free] / total[free]).min(initial=math.inf))
        self._limit = float(self.blocks.comm.min_into(np.array([least]))[0])

    def limit(self) -> float:
        """The stability limit of a sub-step [s]."""
        return self._limit

    def _add_to_limit(self, corner: np.ndarray) -> None:
        """Add what else passes to corners (n, w), per degree."""

    # ---- the clock -----------------------------------------------------------------------------------------------

    def _given_clock(self) -> tuple[int, float]:
        """Sub-steps of a cycle, 0: as many as are needed, and their length [s], 0: that of the blocks."""
        return self.own_steps, self.own_dt

    def _cycle_time(self) -> float:
        """Return the length of a cycle by the clock of others [s]; 0: the field has its own clock."""
        o = self.blocks.options
        if o.mechanical:
            return self._period() if o.dynamic else 0.0
        return 0.0 if self._sets_pace() else self.blocks.clock.dt

    def _period(self) -> float:
        """Time of blocks in motion that a cycle stands for [s]."""
        return self._every() * self.blocks.clock.dt

    def _every(self) -> int:
        """Steps of the blocks between two cycles."""
        return 1

    def _given(self) -> tuple[float, ...]:
        """Return everything except the limit that determines the length of a sub-step."""
        return (*map(float, self._given_clock()), self._cycle_time(), self._limit)

    def _find_step(self) -> None:
        """Sub-steps of a cycle and their length, from what was given and what is stable."""
        o = self.blocks.options
        self._found_for = self._given()
        if not self.on:
            return
        limit, period, (steps, dt) = SAFETY * self._limit, self._cycle_time(), self._given_clock()
        if dt == period == 0.0 and not math.isfinite(limit) and not o.mechanical:
            raise CommandError(
                f"{self.name} cannot flow: all nodes are prescribed. Use {self.set_step} to give it a clock"
            )
        instead = f"a cycle of {period:.3g} s; {self.set_step} gives it a clock of its own"
        self._divide(steps, dt, period, limit, limit, instead)
        self._report_step()

    def _report_step(self) -> None:
        log = self.blocks.log
        if log is None or not math.isfinite(self.dt) or abs(self.dt - self._logged_dt) <= 0.1 * self._logged_dt:
            return
        self._logged_dt, shown = self.dt, partial(with_prefix, unit="s")
        log.info(
            f"{self.name}: {counted(self.sub_steps, 'sub-step')} of {shown(self.dt)} in each cycle; the stability "
            f"limit is {shown(self._limit)}"
        )
        if self.dt > self._limit:
            log.warn_once(
                f"{self.name} step",
                f"the {self.word} time step {self.dt:g} s is {self.dt / self._limit:.2f} of the stability limit "
                f"{self._limit:.4g} s. Reduce it if the run becomes unstable{self.otherwise}",
            )

    def check_complete(self) -> None:
        blocks = self.blocks
        bare = np.flatnonzero((self.row == 0) & blocks.alive & self.on)
        if len(bare):
            at = ", ".join(f"{c:g}" for c in blocks.the_mesh().centroids(bare[:1])[0])
            raise CommandError(
                f"element {bare[0]} at ({at}) has no {self.kind_of_model} model ({len(bare)} in all), but other "
                f"elements have one: assign {self.command} to all"
            )

    def check_elements(self) -> None:
        """CommandError if an element lacks a model. Not collective."""
        self.check_complete()
        blocks = self.blocks
        if blocks.dim == 2 and self.expands and user_laws.in_use(blocks):
            raise CommandError(
                f"{user_laws.some(blocks)} has a user law, which does not support the out-of-plane strain of "
                f"{self.name}: set {self.expansion.replace('_', '-')} to 0"
            )

    def check_start(self) -> None:
        if not self.rows or self._checked:
            return
        self.check_elements()
        o = self.blocks.options
        if self.on and o.mechanical and not o.dynamic and self._given_clock()[1] == 0.0 == self._cycle_time():
            raise CommandError(
                f"static runs need {self.set_step} for the time of {self.name}; or use {self.switch_off} to keep "
                f"{self.several} constant"
            )
        self._checked = True

    def joints_opened(self) -> None:
        """Joints broke: nothing is conducted across them any more."""
        self._stale = True

    def mesh_replaced(self) -> None:
        """Do nothing: `of_mesh` reports that this is removed with the mesh."""

    def follow(self) -> None:
        """Advance the field by the step that the elements have moved."""
        blocks = self.blocks
        if not self.on:
            return
        self.waited += 1
        self._step_done()
        if self._waits():
            return
        self.waited = 0
        with blocks.timers(self.name):
            self.renew_nodes()
            self._begin_cycle()
            if self._found_for != self._given():
                self._find_step()
            if (
                blocks.budget is not None
                and blocks.options.dynamic
                and (self.expands or blocks.local.temperature_dependent)
            ):
                blocks.budget.pause(blocks, by_heat=True)
            self._sub_steps()
            self.cycles += 1
            self._cycle_done()
            blocks.local.follow_heat()
        if self.cycles % CHECK_EVERY == 0:
            self._check_finite()

    def _step_done(self) -> None:
        """The blocks have moved by a step."""

    def _waits(self) -> bool:
        """Return whether more steps of the blocks come before the next cycle."""
        return self.blocks.options.mechanical and self.waited < self._every()

    def _begin_cycle(self) -> None:
        """Nodes are those of the joints that hold now; the length of sub-steps is that of the last cycle."""

    def _sub_steps(self) -> None:
        for _ in range(self.sub_steps):
            self._sub_step()

    def _cycle_done(self) -> None:
        """Sub-steps are done."""

    def _own_corners(self) -> tuple[int, int]:
        """Range of this rank's corners in t, flat."""
        width, own = self.t.shape[1], self.blocks.owned
        return width * own.start, width * own.stop

    def held_at(self, time: float) -> np.ndarray:
        """Prescribed temperatures (rows,) at a time of heat."""
        return np.array([assigned.now(self.blocks.tables, one, time) for one in self.prescribed[1:]], np.float64)

    def inflow(self, time: float, dt: float) -> np.ndarray:
        """Compute the inflow (n, w) to the corners of the elements held here, per second, with the conditions of faces
        at a time of the field; book what they bring in dt [s]. Collective if the field also flows in from elsewhere."""
        t, q, given = (part.reshape(-1) for part in (self.t, self._q, self.blocks.cold[self.given]))
        self.conduction.conduct(t, q)
        self.exposed.add_inflow(time, dt, *self._own_corners(), t, q, given)
        if self._add_inflow(self._q):
            self.blocks.halo.fill(self._q)  # elements of other ranks touch more than is held here
        return self._q

    def _add_inflow(self, q: np.ndarray) -> bool:
        """Add what flows to corners (n, w) otherwise; whether it must be known of other ranks' elements."""
        return False

    def _sub_step(self) -> None:
        blocks = self.blocks
        q = self.inflow(self.time, self.dt).reshape(-1)
        self.time += self.dt
        first, last = self._own_corners()
        t, given, at = self.t.reshape(-1), blocks.cold[self.given].reshape(-1), self.at
        kernels.warm(
            blocks.threads, at.begin, at.corner, at.capacity, at.held, self.held_at(self.time), first, last, self.dt, q,
            t, given,
        )  # fmt: skip
        blocks.halo.fill(self.t)

    def _check_finite(self) -> None:
        """Stop on all ranks if it has blown up."""
        blocks = self.blocks
        first = self._lowest(blocks.number[blocks.owned][~np.isfinite(blocks.cold[self.quantity]).all(axis=1)])
        if first >= 0:
            raise self._blown_up(f"the {self.quantity} of element {first}", self._limit)

    # ---- state on disk -------------------------------------------------------------------------------------------

    def saved_state(self) -> dict[str, Any]:
        """Return everything but the columns, as JSON values; those of elements are saved with these."""
        own = {name: getattr(self, name) for name in ("prescribed", "accounts", *self.kept)}
        faces = [asdict(one) for one in self.exposed.conditions]
        return {"rows": self._saved_properties(), "faces": faces, "time": self.time, "cycles": self.cycles,
                "waited": self.waited, **own}  # fmt: skip

    @property
    def _assigned_rows(self) -> dict[str, np.ndarray]:
        """Return the saved rows of elements, nodes and faces, of all ranks, by names of tables."""
        rows = {"elements": self.row, "points": self.held, "faces": self.exposed.row}
        return {f"{self.name}_{name}": row for name, row in rows.items()}

    def saved_tables(self) -> Tables:
        """Elements with their properties, prescribed nodes and faces, of all ranks."""
        return {name: assigned.numbered(row) for name, row in self._assigned_rows.items()}

    @classmethod
    def restored(cls, blocks: Blocks, state: Mapping[str, Any], tables: Mapping[str, Mapping[str, np.ndarray]]) -> Self:
        """Inverse of these: the blocks have this field."""
        made = cls.of(blocks)
        made._restore_properties(state["rows"])
        made._restore_clock(state)
        made.exposed.conditions = [FaceCondition(**one) for one in state["faces"]]
        for name in ("prescribed", "accounts", *made.kept):
            setattr(made, name, state.get(name, getattr(made, name)))
        for name, row in made._assigned_rows.items():
            assigned.put_back(row, tables[name])
        return made

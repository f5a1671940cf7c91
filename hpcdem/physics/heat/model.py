"""Heat in the elements of blocks: a field that diffuses (physics/field/diffusing.py), with thermal stress, heat that
passes where surfaces touch and that of their friction, and fluid in channels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.pairs_space import Surface
from hpcdem.physics.field.assigned import Number
from hpcdem.physics.field.diffusing import SAFETY, Diffusing
from hpcdem.physics.field.model import Tables
from hpcdem.physics.field.sides import facing
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat import friction, kernels, kernels_space
from hpcdem.physics.heat.fluid import FluidHeat
from hpcdem.physics.heat.properties import ISO_HEAT

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

RARELY, MOST = 1e-2, 10
"""Part of the stability limit for which heat by itself waits while blocks move, and steps of these, at most."""
NEAR, DEEP = 1e-3, 0.2
"""Largest gap, and largest overlap, of faces in thermal contact, over the mean edge."""
HEAT_OF_FRICTION = "heat_of_friction"
"""Column of elements: of corners heat of friction that waits for the next cycle [J/m]."""


class Heat(Diffusing):
    """The heat of a model of blocks: temperatures [K], content [J/m], capacity [J/(m K)]."""

    name: ClassVar[str] = "heat"
    kernel_kind: ClassVar[str] = "heat"
    quantity: ClassVar[str] = "temperature"
    unstressed: ClassVar[str] = "unstressed"
    word: ClassVar[str] = "thermal"
    model = ISO_HEAT
    kind_of_model: ClassVar[str] = "thermal"
    several: ClassVar[str] = "temperatures"
    low_to_high: ClassVar[str] = "colder to the warmer"
    otherwise: ClassVar[str] = ", or with model solve thermal"
    expansion: ClassVar[str] = "expansion_coeficient"
    kept: ClassVar[tuple[str, ...]] = ("every", "owed")

    def __init__(self, blocks: Blocks) -> None:
        super().__init__(blocks)
        self.every, self.owed = 1, 0.0
        """Steps of blocks in motion before the next cycle, and the time [s] that has passed in those since the last."""
        self.fluid: FluidHeat | None = None
        self._beside: FluidHeat | None = None
        """The fluid in sub-steps with it."""
        self._passes = False
        self._pairs_of: Any = None
        self._facing = np.empty((2, 0, 3), np.int64), np.empty(0)
        self._touch = np.empty((0, 4), np.int64), np.empty((0, 4)), np.empty(0)
        self._has_friction = False
        self._power: np.ndarray | None = None

    set_step: ClassVar[str] = "model time-step thermal"
    switch_off: ClassVar[str] = "model option thermal off"

    # ---- what is assigned and prescribed -------------------------------------------------------------------------

    def of_fluid(self) -> FluidHeat:
        """The heat of the fluid, made on the first call. Not collective."""
        if self.fluid is None:
            flow = Flow.there(self.blocks)
            if flow is None:
                raise CommandError("no channels yet: assign face-joint c-model hydraulic-porous-medium first")
            self._need_model()
            self.fluid = FluidHeat(self, flow)
        return self.fluid

    @property
    def flowing(self) -> FluidHeat | None:
        """The heat of the fluid, None without channels that have it. Not collective."""
        return self.fluid if self.fluid is not None and self.fluid.on else None

    def initial(self, nodes: np.ndarray | None, value: float) -> None:
        """Set the initial value of the field, and of the fluid at these nodes."""
        super().initial(nodes, value)
        if (fluid := self.flowing) is not None:
            fluid.initial(self.blocks.numbers_of_nodes(nodes), value)

    def prescribe_fluid(self, nodes: np.ndarray | None, temperature: Number) -> None:
        """Prescribe the temperature of the fluid at flow nodes among these nodes."""
        if (fluid := self.flowing) is None:
            raise CommandError("the fluid has no thermal model: assign face-joint c-model thermal-fluid first")
        fluid.prescribe(nodes, self._row_of(temperature))

    def remove_conditions(self, nodes: np.ndarray | None, rock: bool = True, fluid: bool = True) -> None:
        """Nodes (None: all) are no longer held, nor is the fluid at them."""
        if rock:
            super().remove_conditions(nodes)
        if fluid and self.fluid is not None:
            self._unset(self.fluid.held, nodes)

    def _all_held(self) -> np.ndarray:
        return self.held if self.fluid is None else np.append(self.held, self.fluid.held)

    # ---- what is queried -------------------------------------------------------------------------------------------

    @property
    def on(self) -> bool:
        """Heat flows. Not collective."""
        return self.blocks.options.thermal and bool(self.rows)

    def _booked(self) -> np.ndarray:
        booked = super()._booked()
        return booked if self.fluid is None else np.append(booked, self.fluid.given)

    def _stored_besides(self) -> dict[str, float]:
        return {"fluid": self.fluid.content() if self.fluid is not None else 0.0}

    # ---- tables of this rank -------------------------------------------------------------------------------------

    def _capacities(self) -> np.ndarray:
        return self.column("capacity")

    def _bind_others(self) -> None:
        blocks, cold, row = self.blocks, self.blocks.cold, self.row[self.blocks.number]
        along, across = (self.column(name)[row] for name in ("conductivity", "conductivity_across"))
        heat = self.column("capacity")[row] * blocks.element_rows.column("density")[blocks.element_row[blocks.number]]
        self._effusivity = np.sqrt(np.sqrt(along * across) * heat)
        parts = self.column("friction_heat")[self.row]
        self._has_friction = bool((parts[blocks.alive] > 0.0).any())
        if self._has_friction and HEAT_OF_FRICTION not in cold:
            cold[HEAT_OF_FRICTION] = np.zeros_like(cold[self.given])
        if self.fluid is not None:
            self.fluid.bind()

    def _bound(self) -> None:
        if (fluid := self.flowing) is not None:
            fluid.take_new()

    def _conductivities(self, elements: np.ndarray) -> np.ndarray:
        row = self.row[elements]
        along, across, angle, dip = (
            self.column(name)[row]
            for name in ("conductivity", "conductivity_across", "conductivity_angle", "conductivity_dip")
        )
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        normal = np.sin(np.radians(dip)) * np.array([-s, c, np.zeros(len(s))])
        normal[2] = np.cos(np.radians(dip))
        less = np.where(along == across, 0.0, across - along)  # no rounding where the angle has no meaning
        x, y, z = normal
        one = [along + less * x * x, along + less * y * y, less * x * y]
        return np.column_stack([*one, along + less * z * z, less * x * z, less * y * z])

    @property
    def passes(self) -> bool:
        """Heat crosses where surfaces touch. Not collective."""
        some = self.blocks.options.collision and bool((self.column("transfer_coeficient") > 0.0).any())
        return some and bool((self._transfers[self.blocks.alive] > 0.0).any())

    @property
    def _transfers(self) -> np.ndarray:
        """Transfer coefficients (ne,) of the elements."""
        return self.column("transfer_coeficient")[self.row]

    def find_contacts(self) -> None:
        """Find where faces touch now, for pairs with an element of this rank; the model is closed. Not collective."""
        self._passes, slots = self.passes, 0
        while True:
            ends = 2 * self.blocks.dim
            self._touch = np.empty((slots, ends), np.int64), np.empty((slots, ends)), np.empty(slots)
            if not self._passes or not len(self.blocks.local.pairs):
                return
            found = (self._touching_in_space if self.blocks.dim == 3 else self._touching)()
            if found == slots:
                return
            slots = found

    def _touching(self) -> int:
        """Fill what there is room for of places where faces touch; how many there are."""
        blocks, pairs = self.blocks, self.blocks.local.pairs
        new = (np.diff(pairs.first, prepend=-1) != 0) | (np.diff(pairs.second, prepend=-1) != 0)
        edge, h = float(blocks.mean_edge), self._transfers[blocks.number]
        return kernels.touching(
            pairs.first[new], pairs.second[new], pairs.start, pairs.free, pairs.element, blocks.the_mesh().cells,
            blocks.where, blocks.x, h, NEAR * edge, DEEP * edge, self.t.shape[1], *self._touch,
        )  # fmt: skip

    def _touching_in_space(self) -> int:
        """Contacts in space: every free face with those of its targets, each pair of faces once."""
        blocks, pairs = self.blocks, self.blocks.local.pairs
        if self._pairs_of is not pairs:
            self._pairs_of = pairs
            free = Surface.of(blocks).free
            face = np.repeat(pairs.face[pairs.first], 4)
            other = (4 * pairs.element[pairs.second][:, None] + np.arange(4)).reshape(-1)
            both = np.column_stack([face, other])[free[other]]
            corners, share = facing(blocks.the_mesh(), np.flatnonzero(free), both)
            self._facing = 4 * blocks.where[corners // 4] + corners % 4, share
        edge, h = float(blocks.mean_edge), self._transfers[blocks.number]
        (first, second), share = self._facing
        return kernels_space.touching(first, second, share, blocks.x, h, NEAR * edge, DEEP * edge, *self._touch)

    @property
    def contacts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """corner, weight and pass_on of kernels.touching. Not to be changed. Not collective."""
        return self._touch

    def _add_most_of_contacts(self, corner: np.ndarray) -> None:
        """Add the transfer of free faces to corners (n, w) under the assumption that they are in contact everywhere."""
        blocks, h = self.blocks, self._transfers
        most = h[blocks.alive].max()
        at = np.flatnonzero(blocks.face_exists() & ~blocks.closed_faces() & np.repeat(h > 0.0, 4))
        at = at[blocks.where[at // 4] >= 0]
        at, ends, part = self.exposed.parts_of(at)
        each = 2.0 * part * h[at // 4] * most / (h[at // 4] + most)
        for end in ends.T:
            np.add.at(corner, (blocks.where[end // 4], end % 4), each)

    def _add_to_limit(self, corner: np.ndarray) -> None:
        if self.passes:
            self._add_most_of_contacts(corner)
        if (fluid := self.flowing) is not None:
            fluid.add_to_limit(corner.reshape(-1))

    def mesh_replaced(self) -> None:
        if self.fluid is not None:
            self.fluid.close()

    # ---- the clock -----------------------------------------------------------------------------------------------

    def _given_clock(self) -> tuple[int, float]:
        return self.blocks.options.heat_steps, self.blocks.options.heat_dt

    def _cycle_time(self) -> float:
        return self._of_fluid() or super()._cycle_time()

    def _of_fluid(self) -> float:
        """Time of a cycle of flow that heat goes with [s], 0: it does not."""
        fluid = self.flowing if self.blocks.options.hydraulic else None
        return fluid.flow.sub_steps * fluid.flow.dt if fluid is not None else 0.0

    def _period(self) -> float:
        """Time of blocks in motion that a cycle stands for [s]."""
        dt = self.blocks.clock.dt
        if not self._may_wait:
            return self.blocks.options.flow_every * dt
        return self.owed if self.owed and not self.waited else self.every * dt

    def _every(self) -> int:
        return self.every if self._may_wait else self.blocks.options.flow_every

    def check_elements(self) -> None:
        """Check the elements like those of any field, and that every transfer coefficient is used. Not collective."""
        self.check_complete()
        blocks = self.blocks
        passes = np.flatnonzero((self._transfers > 0.0) & blocks.alive)
        if (
            len(passes)
            and not blocks.options.collision
            and all(one.environment is None for one in self.exposed.conditions)
        ):
            raise CommandError(
                f"element {passes[0]} has a transfer-coeficient, but no face has an environment-temperature and "
                "contact is off: use model option collision on"
            )
        if self.fluid is not None:
            self.fluid.check()
        self._check_friction()
        super().check_elements()

    def _check_friction(self) -> None:
        """CommandError if heat of friction is wanted where nothing can slide in time. Not collective."""
        blocks, o = self.blocks, self.blocks.options
        warm = np.flatnonzero((self.column("friction_heat")[self.row] > 0.0) & blocks.alive)
        if len(warm) and self.on and o.mechanical and not (o.dynamic and o.collision):
            raise CommandError(
                f"element {warm[0]} has friction-heat, but "
                + ("contact is off: use model option collision on" if o.dynamic else
                   "static runs have no sliding velocity: use model option thermal off, or dynamic on")
            )  # fmt: skip

    def check_start(self) -> None:
        if self.on and not self._checked and self.blocks.options.heat_dt > 0.0 and self._of_fluid() > 0.0:
            raise CommandError(
                "heat in fluid needs the clock of flow: use model time-step thermal 0, or model option hydraulic off "
                "to keep the present flow"
            )
        super().check_start()

    def _step_done(self) -> None:
        if self._may_wait:
            self.owed += self.blocks.clock.dt
        if self._has_friction and self.blocks.options.mechanical:
            self._add_friction_heat()

    def _waits(self) -> bool:
        fluid = self.flowing
        if fluid is not None and self.blocks.options.hydraulic:
            return fluid.flow.waited > 0  # heat goes with the fluid
        return super()._waits()

    def _begin_cycle(self) -> None:
        if self.blocks.options.mechanical:
            self.find_contacts()
        if self.owed and not self._may_wait:
            self._catch_up()

    def _sub_steps(self) -> None:
        self._take_friction()
        self._beside = fluid = self.flowing
        if fluid is not None:
            fluid.begin_cycle(self.sub_steps * self.dt)
        for _ in range(self.sub_steps):
            if fluid is not None:
                fluid.advance(self.dt, self.held_at(self.time + self.dt))
            self._sub_step()
        self._beside = None

    def _cycle_done(self) -> None:
        self._power, self.owed = None, 0.0
        self.every = max(1, int(min(RARELY * self._limit / self.blocks.clock.dt, MOST))) if self._may_wait else 1

    def _catch_up(self) -> None:
        """Heat in rock flows for the time that it waited for, before something else set its pace."""
        count = max(1, math.ceil(self.owed / (SAFETY * self._limit)))
        self.dt, self._found_for = self.owed / count, ()
        for _ in range(count):
            self._sub_step()
        self.owed = 0.0

    @property
    def _may_wait(self) -> bool:
        """Heat alone, without friction, by the clock of blocks in motion, with sub-steps without a report."""
        o = self.blocks.options
        by_itself = o.mechanical and o.dynamic and self.flowing is None and not self._has_friction
        return by_itself and o.flow_every == 1 and o.heat_steps == 0 and o.heat_dt == 0.0

    def _add_friction_heat(self) -> None:
        """Surfaces have slid for a step."""
        blocks = self.blocks
        pairs: Any = blocks.local.pairs
        if len(pairs):
            out = np.zeros(self.t.shape)
            how = self._effusivity, self.column("friction_heat")[self.row[blocks.number]], blocks.clock.dt, out
            if blocks.dim == 3:
                kernels_space.friction_heat(
                    pairs.first, pairs.second, pairs.face, pairs.face_row, pairs.row, pairs.touching, blocks.v,
                    pairs.out, pairs.history, *how,
                )  # fmt: skip
            else:
                friction.friction_heat(
                    pairs.first, pairs.second, pairs.start, pairs.row, pairs.quad, blocks.x, blocks.v, pairs.history,
                    *how,
                )  # fmt: skip
            blocks.cold[HEAT_OF_FRICTION] += out[blocks.owned]

    def _take_friction(self) -> None:
        """Distribute the heat of friction evenly over this cycle."""
        if self._has_friction:
            friction_heat = self.blocks.cold[HEAT_OF_FRICTION]
            self.blocks.cold[self.given] += friction_heat
            self._power = friction_heat / (self.sub_steps * self.dt)
            friction_heat[:] = 0.0

    def _add_inflow(self, q: np.ndarray) -> bool:
        if self._passes:
            kernels.through_contacts(*self._touch, self.t.reshape(-1), q.reshape(-1))
        if self._beside is not None:
            self._beside.add_wall_heat(q.reshape(-1))
        if self._power is not None:
            q[self.blocks.owned] += self._power
        return self._passes or self._beside is not None or self._has_friction

    # ---- state on disk -------------------------------------------------------------------------------------------

    def saved_state(self) -> dict[str, Any]:
        return {**super().saved_state(), "fluid": self.fluid.saved_state() if self.fluid is not None else None}

    def saved_tables(self) -> Tables:
        return super().saved_tables() | (self.fluid.saved_tables() if self.fluid is not None else {})

    def saved_rows(self) -> Tables:
        return self.fluid.saved_rows() if self.fluid is not None else {}

    @classmethod
    def restored(cls, blocks: Blocks, state: Mapping[str, Any], tables: Mapping[str, Mapping[str, np.ndarray]]) -> Self:
        made = super().restored(blocks, state, tables)
        if state.get("fluid") is not None:
            made.of_fluid().restore(state["fluid"], tables)
        return made

"""Assignments of fluid: channels and their properties, conditions of flow nodes, wells and their stages. All of it is
known to all ranks by the numbers of the mesh.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.units import counted
from hpcdem.physics.fdem.groups import FLOW_NODE, JOINT
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.field import assigned
from hpcdem.physics.field.assigned import Number
from hpcdem.physics.field.model import Assigned, Field
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.network import Network, around
from hpcdem.physics.flow.properties import FLUID, POROUS
from hpcdem.physics.flow.wells import PRESSURE as HELD
from hpcdem.physics.flow.wells import QUANTITIES as OF_WELLS
from hpcdem.physics.flow.wells import RATE, Asked, Stage, Well

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

BY_CONDITION, BY_WELL = 1, 2
"""Bits of the reasons why there is water in front of a face, should the face be free: a condition, a well."""


def nodes_not(numbers: np.ndarray) -> str:
    """Begin a message about nodes that lack something: `node 3 and 4 others are not`."""
    others = len(numbers) - 1
    return f"node {numbers[0]} " + (f"and {counted(others, 'other')} are not" if others else "is not")


@dataclass(frozen=True)
class Condition:
    """Condition of a flow node: kernels.FREE, PRESSURE [Pa], SURFACE (its height [m] against gravity) or RATE
    [m2/s]."""

    does: int = kernels.FREE
    value: Number = 0.0


class FlowAssignments(Assigned, Field):
    """row (4 ne,): of the table of properties, by joint, 0: no channel; since (4 ne,): flow time at which leak-off
    began [s], inf: it has not; condition (np,): row of the conditions; wet_bits (4 ne,): see `BY_CONDITION`."""

    of_objects: ClassVar[str] = JOINT
    model = POROUS
    kind_of_model: ClassVar[str] = "hydraulic"
    alike = FLUID
    stiffens: ClassVar[bool] = True

    def __init__(self, blocks: Blocks) -> None:
        super().__init__(blocks)
        mesh = blocks.the_mesh()
        self.since = np.full(mesh.cells.size, math.inf)
        self.condition = np.zeros(len(mesh.points), np.int32)
        self.wet_bits = np.zeros(mesh.cells.size, np.int8)
        self.conditions: list[Condition] = [Condition()]
        self.wells: list[Well] = []
        self._fluid: dict[str, float] = {}
        self._network: Network | None = None
        self._reshaped = False
        self._found_for: list[float] = []

    # ---- channels ----------------------------------------------------------------------------------------------------

    def assign(self, joints: np.ndarray | None, given: Mapping[str, Value]) -> None:
        """Make joints (None: all) channels with these properties. Fluid of volume that disappears is removed; new
        volume is dry.
        """
        at = self._numbers(joints)
        if not len(at):
            raise CommandError("no joint here can be a channel")
        super().assign(at, given)

    def _have_it(self) -> np.ndarray:
        return self.network.channels

    def _assigned(self) -> None:
        self._found_for, self._fluid, self._network, self._reshaped = [], {}, None, True

    def elements_removed(self, elements: np.ndarray) -> None:
        """Channels beside these elements are gone, with their fluid."""
        self._network, self._reshaped, self._found_for = None, True, []

    @property
    def network(self) -> Network:
        """Channels and flow nodes of all ranks. Not collective."""
        if self._network is None:
            blocks, mesh = self.blocks, self.blocks.the_mesh()
            channels = np.flatnonzero((self.row > 0) & blocks.joint_exists())
            self._network = Network.of(mesh, channels)
        return self._network

    def numbers(self, kind: str) -> np.ndarray:
        """Numbers of all flow nodes or channels, ascending. Not collective."""
        return self.network.nodes if kind == FLOW_NODE else self.network.channels

    def flow_nodes(self, points: np.ndarray | None) -> np.ndarray:
        """Return those of these points (None: all) that are flow nodes."""
        there = self.network.there
        if not len(self.network.channels):
            raise CommandError("no channels yet: assign face-joint c-model hydraulic-porous-medium first")
        asked = np.flatnonzero(there) if points is None else self.blocks.numbers_of_nodes(points)
        found = asked[there[asked]]
        if not len(found):
            raise CommandError(f"{nodes_not(asked)} at the end of a channel")
        if len(found) < len(asked) and self.blocks.log is not None:
            self.blocks.log.info(
                f"{len(asked) - len(found)} of {len(asked)} nodes are not flow nodes: their conditions apply to free "
                "faces only"
            )
        return found

    def fluid(self, name: str) -> float:
        """A property of the fluid. Not collective."""
        if not self._fluid:
            self._fluid = dict(zip(self._names, self.rows[self.row[np.argmax(self.row > 0)] - 1]))
        return self._fluid[name]

    @property
    def viscosity(self) -> float:
        """Dynamic viscosity of the fluid [Pa s]: the kinematic one times the density (C-26). Not collective."""
        return self.fluid("viscosity") * self.fluid("fluid_density")

    def laws(self) -> np.ndarray:
        """The table of channel laws (rows, kernels.LAW)."""
        of = {name: self.column(name)[1:] for name in self._names}
        inside = of["matrix_porosity"] * (1.0 / of["fluid_bulk"] + of["matrix_porosity_compressibility"])
        viscous, on = of["viscosity"] * of["fluid_density"], of["leak_off"] > 0.0
        front = on & (of["matrix_saturation"] < 1.0)
        empty = of["matrix_porosity"] * (1.0 - of["matrix_saturation"])
        volume = np.where(front, 0.5 * empty, inside / math.pi)
        leak = np.where(on, np.sqrt(of["matrix_permeability"] * volume / viscous), 0.0)
        apertures = [of[f"aperature_{name}"] for name in ("initial", "minumum", "maximum")]
        dilation = np.tan(np.radians(of["shear_dilation"])), of["shear_dilation_limit"]
        return np.ascontiguousarray(np.column_stack([*apertures, leak, of["matrix_pore_pressure"], *dilation, front]))

    # ---- conditions --------------------------------------------------------------------------------------------------

    def prescribe(self, nodes: np.ndarray | None, does: int, value: Number) -> None:
        """Assign a condition to flow nodes among these points (None: all), see `Condition`. A pressure or a level wets
        free faces all of whose corners are among the points; without points it is assigned to joints alone."""
        at = self.flow_nodes(nodes)
        nodes_with_condition = np.flatnonzero(self.condition) if nodes is None else self.blocks.numbers_of_nodes(nodes)
        beside = nodes_with_condition[~self.network.there[nodes_with_condition]]
        for well in self.wells:
            both = np.intersect1d(well.points, at)
            if len(both):
                raise CommandError(f"node {both[0]} belongs to well '{well.name}', whose stages control it")
        values = assigned.checked(self.blocks.tables, value, "a condition of a flow node")
        if does == kernels.PRESSURE and values.min() < 0.0:
            raise CommandError(f"the pressure of a fluid must not be negative, got {values.min():g} Pa")
        self.blocks.before_change()
        row = assigned.row_of(self.conditions, Condition(does, value))
        self.condition[at], self.condition[beside] = row, 0 if does == kernels.RATE else row
        if does == kernels.RATE:
            self._dry(np.union1d(at, beside))
        elif nodes is not None:
            self.wet_bits[around(self.blocks.the_mesh(), nodes_with_condition)[0]] |= BY_CONDITION
        self.blocks.changed(stiffness=False)

    def _dry(self, points: np.ndarray) -> None:
        """Unset the bit of wet faces by conditions at faces with a corner among these points."""
        self.wet_bits[around(self.blocks.the_mesh(), points)[1]] &= ~BY_CONDITION

    def remove_conditions(self, nodes: np.ndarray | None) -> None:
        """Take back what is prescribed at these points (None: all)."""
        self._unset(self.condition, nodes)
        if nodes is None:
            self.wet_bits &= ~BY_CONDITION
        else:
            self._dry(nodes)

    def conditions_at(self, time: float) -> np.ndarray:
        """The table of conditions (rows, 2) at a flow time: heights as potential energies."""
        table = np.zeros((len(self.conditions), 2))
        height = self.fluid("fluid_density") * math.hypot(*self._gravity())
        for row, one in enumerate(self.conditions):
            value = assigned.now(self.blocks.tables, one.value, time)
            table[row] = one.does, value * height if one.does == kernels.SURFACE else value
        return table

    def uses_table(self, name: str) -> bool:
        """Return whether a node or an unfinished stage follows this table. Not collective."""
        stages = (one for well in self.wells for one in well.stages)
        return any(one.value == name and one.end > self.time for one in stages) or any(
            one.value == name for one in assigned.in_use(self.conditions, self.condition)
        )

    def _wet_of_before(self) -> None:
        """Checkpoints that do not say which faces are wet: those whose nodes all have a pressure or a level, or are of
        one well."""
        does = np.array([one.does for one in self.conditions])[self.condition]
        held = np.isin(does, (kernels.PRESSURE, kernels.SURFACE))
        self.wet_bits[around(self.blocks.the_mesh(), np.flatnonzero(held))[0]] |= BY_CONDITION
        for well in self.wells:
            self.wet_bits[around(self.blocks.the_mesh(), well.points)[0]] |= BY_WELL

    # ---- wells -------------------------------------------------------------------------------------------------------

    def drill(self, name: str, nodes: np.ndarray | None) -> None:
        """Flow nodes among these points (None: all) are a well."""
        if any(well.name == name for well in self.wells):
            raise CommandError(f"well '{name}' exists already")
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
            raise CommandError(f"node {held[0]} of well '{name}' has a condition: use node boundary remove first")
        self.blocks.before_change()
        wall = at[:0]
        if nodes is not None:
            asked = self.blocks.numbers_of_nodes(nodes)
            wall = np.setdiff1d(asked, at)
            self.wet_bits[around(self.blocks.the_mesh(), asked)[0]] |= BY_WELL
        self.condition[wall] = 0
        self.wells.append(Well(name, at, wall=wall))
        self.blocks.changed(stiffness=False)

    def well(self, name: str) -> Well:
        """The one of this name. Not collective."""
        found = next((well for well in self.wells if well.name == name), None)
        if found is None:
            known = ", ".join(f"'{well.name}'" for well in self.wells) or "none so far"
            raise CommandError(f"there is no well '{name}'; available: {known}")
        return found

    def stage(self, name: str, does: str, value: Number, duration: float, limit: float) -> None:
        """Add a stage of a well, see `Stage`; duration [s] of flow time."""
        well = self.well(name)
        values = assigned.checked(self.blocks.tables, value, f"the {does} of a well")
        if does == HELD and values.min() < 0.0:
            raise CommandError(f"the pressure of a well must not be negative, got {values.min():g} Pa")
        if not duration > 0.0:
            raise CommandError(f"the time of a stage of a well must be positive, got {duration:g} s")
        if not limit >= 0.0 or (math.isfinite(limit) and does != RATE):
            raise CommandError("limit, a pressure that is not negative, needs a rate")
        self.blocks.before_change()
        well.add(Stage(does, value, 0.0, duration, limit), self.time)
        self.blocks.changed(stiffness=False)

    def well_value(self, name: str, quantity: str) -> float:
        """A quantity of `wells.QUANTITIES`. Not collective."""
        if quantity not in OF_WELLS:
            raise CommandError(f"there is no quantity {quantity} of a well; available: {', '.join(OF_WELLS)}")
        well = self.well(name)
        return float(well.number(self.time) if quantity == "stage" else getattr(well, quantity))

    def check_wells(self) -> None:
        """CommandError for one that would pump into nothing."""
        for well in self.wells:
            if well.will_act(self.time) and not self.network.there[well.points].any():
                raise CommandError(f"well '{well.name}' has no flow nodes left: the surrounding elements were removed")

    def report_stage(self, well: Well, before: float, after: float) -> None:
        """A word in the log if another stage of a well is on than before."""
        stage, log = well.number(after), self.blocks.log
        if log is not None and stage != well.number(before):
            does = well.stages[stage - 1].does.replace("_", "-") if stage else "no stage left"
            log.info(f"well '{well.name}': {f'stage {stage}, ' * bool(stage)}{does}, at {after:.6g} s of flow")

    def asked_of(self, well: Well, time: float, dt: float, passes: bool) -> Asked:
        """Return the action of a well in an implicit step of dt [s] from this time on; passes: its stages advance with
        time, otherwise the present one lasts. Not collective."""
        value = partial(assigned.now, self.blocks.tables)
        if passes:
            return well.asked(time, time + dt, value)
        return well.asked_now(time, dt, value)

    def set_clock(self, time: float) -> None:
        """The clock of flow shows this time [s]; stages of wells and leak-off continue as they were."""
        ahead = time - self.time
        super().set_clock(time)
        self.since += ahead
        for well in self.wells:
            well.stages = [replace(one, begin=one.begin + ahead, end=one.end + ahead) for one in well.stages]

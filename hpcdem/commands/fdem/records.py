"""Records of a model of blocks: a history, a chart and its curves."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.commands.fdem.recorded import MODEL, UNITS, WELL
from hpcdem.core.fields import unit_in
from hpcdem.physics import supports
from hpcdem.physics.fdem import diagnostics, user_laws
from hpcdem.physics.fdem.groups import BOLT_ELEMENT, BOLT_NODE, CHANNEL, LINER_ELEMENT, NODE, SUPPORTS
from hpcdem.physics.fields import kinds
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.values import QUANTITIES as OF_FLOW
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.proppant.model import Proppant

if TYPE_CHECKING:
    from hpcdem.physics.fdem.local import Local
    from hpcdem.physics.fdem.probes import Probe
    from hpcdem.physics.fdem.simulation import Blocks

_FORCES = ("reaction_x", "reaction_y", "reaction_z")
OF_LENGTHS = (CHANNEL, BOLT_ELEMENT, BOLT_NODE, LINER_ELEMENT)
"""Objects whose values are per metre, or of one bolt, in space too."""


def _of_joints(kind: int) -> Callable[[Any], float]:
    return lambda blocks: float(diagnostics.joint_counts(blocks)[kind])


def _energy(name: str) -> Callable[[Any], float]:
    return lambda blocks: float(diagnostics.energies(blocks)[name])


def _of_field(field: Callable[[], type[Any]], name: str) -> Callable[[Any], float]:
    def measure(blocks: Blocks) -> float:
        found = field().there(blocks)
        if found is None:
            return 0.0
        return float(found.time if name == "time" else found.account()[name])

    return measure


_OF_MODEL: dict[str, Callable[[Any], float]] = {
    "time": lambda blocks: float(blocks.clock.time),
    "creep_time": lambda blocks: float(blocks.creep.time),
    "cycle": lambda blocks: float(blocks.clock.step),
    "ratio": lambda blocks: float(diagnostics.unbalanced_ratio(blocks)),
    "intact_joints": _of_joints(0),
    "yielded_joints": _of_joints(1),
    "broken_joints": _of_joints(2),
    "kinetic_energy": _energy("kinetic"),
    "strain_energy": _energy("strain"),
    "joint_energy": _energy("joints"),
    "joint_loss": _energy("joints_lost"),
    "contact_energy": _energy("contact"),
    "viscous_loss": _energy("viscous_lost"),
    "plastic_loss": _energy("plastic_lost"),
    "creep_loss": _energy("creep_lost"),
    "gravity_work": _energy("work_gravity"),
    "outside_work": _energy("work_outside"),
    "disc_work": _energy("work_discs"),
    "bolt_work": _energy("work_bolts"),
    "liner_work": _energy("work_liners"),
    "heat_work": _energy("work_heat"),
    "energy_error": _energy("closing"),
    "flow_time": _of_field(lambda: Flow, "time"),
    "fluid_given": _of_field(lambda: Flow, "given"),
    "fluid_stored": _of_field(lambda: Flow, "stored"),
    "fluid_leaked": _of_field(lambda: Flow, "leaked"),
    **{f"proppant_{name}": _of_field(lambda: Proppant, name) for name in ("came", "stored", "packed", "left")},
    "heat_time": _of_field(lambda: Heat, "time"),
    "heat_given": _of_field(lambda: Heat, "given"),
    "heat_stored": _of_field(lambda: Heat, "stored"),
    "heat_in_fluid": _of_field(lambda: Heat, "fluid"),
    **{
        f"{one.name}_{part}": _of_field(one.load_type, part)
        for one in kinds().values()
        for part in ("time", "given", "stored")
    },
}
_OF_SEVERAL: dict[str, Callable[[np.ndarray], float]] = {
    "": lambda values: values[0], "sum": lambda values: math.fsum(values.tolist()),
    "mean": lambda values: math.fsum(values.tolist()) / len(values), "minimum": np.min, "maximum": np.max,
}  # fmt: skip
ENERGIES = tuple(
    name for name, unit in UNITS[MODEL].items()
    if unit == "J/m" and name not in ("heat_given", "heat_stored", "heat_in_fluid")
)  # fmt: skip


@dataclass
class History:
    """A recorded quantity. kind: of object, MODEL, or WELL, whose name is `how`; value: name of the quantity; numbers:
    of the objects; how: "", or sum, mean, minimum, maximum of several; every: steps between two records; rows: (step,
    time, value); filed: number of rows already written; dim: dimensions of space, for the unit.
    """

    kind: str
    value: str
    numbers: list[int] = field(default_factory=list)
    how: str = ""
    every: int = 1
    rows: list[tuple[int, float, float]] = field(default_factory=list)
    filed: int = 0
    dim: int = 2

    def __post_init__(self) -> None:
        self._probe: Probe | None = None
        self._waits: tuple[int, float, Local, int] | None = None

    @property
    def unit(self) -> str:
        unit = UNITS[self.kind].get(self.value) or user_laws.unit(self.value)
        return unit if self.kind in OF_LENGTHS else unit_in(unit, self.dim, content=True)

    @property
    def waits(self) -> bool:
        """Return whether the record of this step needs the forces of the next one."""
        return self._waits is not None

    def record(self, blocks: Blocks, goes_on: bool) -> None:
        """Record the value of this step, once. goes_on: more steps follow, in which the forces at the present positions
        are computed anyway; forces of supports are taken from there (`take`). Collective.
        """
        clock = blocks.clock
        if self.waits or (self.rows and self.rows[-1][0] == clock.step):
            return
        if goes_on and self.kind == NODE and self.value in _FORCES:
            probe = self._probe_of(blocks)
            probe.find()
            assert probe.local is not None
            probe.local.awaited = True  # a rebuild in the next step must not free these tables
            self._waits = int(clock.step), float(blocks.reported_time()), probe.local, probe.local.passes
        else:
            self.rows.append((int(clock.step), float(blocks.reported_time()), self.measure(blocks)))

    def take(self, blocks: Blocks) -> None:
        """Complete a record that waits for forces. Collective."""
        if self._waits is None:
            return
        step, time, local, passes = self._waits
        self._waits = None
        if local.passes == passes + 1:
            self.rows.append((step, time, self._probe_of(blocks).reduced(self.how, local)))
        elif step == blocks.clock.step:
            self.rows.append((step, time, self.measure(blocks)))

    def _probe_of(self, blocks: Blocks) -> Probe:
        if self._probe is None or self._probe.sim is not blocks:
            self._probe = diagnostics.probe(blocks, self.value, self.numbers)
        return self._probe

    def measure(self, blocks: Any) -> float:
        """Return the present value. Collective, equal on all ranks."""
        if self.kind == MODEL:
            return _OF_MODEL[self.value](blocks)
        if self.kind == WELL:
            flow = Flow.there(blocks)
            return math.nan if flow is None else flow.well_value(self.how, self.value)
        if self.kind in SUPPORTS:
            values = supports.of(blocks, self.kind).values(self.kind, self.value, np.array(self.numbers, np.int64))
            return float(_OF_SEVERAL[self.how](values))
        if self.kind in OF_FLOW:
            values = Flow.of(blocks).values(self.kind, self.value, np.array(self.numbers, np.int64))
            values = values[~np.isnan(values)] if self.how else values
            return float(_OF_SEVERAL[self.how](values)) if len(values) else math.nan
        return self._probe_of(blocks).reduced(self.how)


@dataclass
class Curve:
    """A curve of a chart. x, y: names of histories (x "": the time), with factors; or points (x, y). style: line or
    points.
    """

    label: str
    x: str = ""
    y: str = ""
    scale_x: float = 1.0
    scale_y: float = 1.0
    points: list[tuple[float, float]] = field(default_factory=list)
    style: str = "line"


@dataclass
class Chart:
    """A diagram and its curves."""

    title: str = ""
    x_label: str = ""
    y_label: str = ""
    curves: list[Curve] = field(default_factory=list)

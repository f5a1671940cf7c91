"""Fluid in fractures: channels, what is prescribed at flow nodes, how they begin, and their clock."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from hpcdem.commands.fdem import assignments
from hpcdem.commands.fdem.choices import chosen, points
from hpcdem.commands.fdem.heat import assign
from hpcdem.commands.fdem.needed import needed
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.groups import JOINT, Range
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.field.assigned import Number
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow import wells as w
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.properties import POROUS
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.heat.properties import FLUID_HEAT
from hpcdem.physics.proppant.assignments import CONCENTRATION, RATE, checked
from hpcdem.physics.proppant.model import Proppant
from hpcdem.physics.proppant.properties import PROPPANT, split

_DOES = {"pressure": kernels.PRESSURE, "flow_surface": kernels.SURFACE, "flow_rate": kernels.RATE}


def model(project: Project, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Make joints channels with these properties (physics.flow.properties)."""
    joints = chosen(project, JOINT, where)
    assign(project, Flow, "fluid in their joints", joints, properties)
    proppant = Proppant.there(project.blocks)
    if proppant is not None:
        proppant.leave(joints)


def with_proppant(project: Project, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Make joints channels whose fluid carries proppant (physics.proppant.properties)."""
    fluid, grains = split(dict(properties))
    joints = chosen(project, JOINT, where)
    checked(grains)
    model(project, fluid, where)
    Proppant.of(project.ready()).assign(joints, grains)


def proppant_condition(
    project: Project,
    proppant_volumetric_concentration: Number | None = None,
    proppant_volumetric_flow_rate: Number | None = None,
    where: Range | None = None,
) -> None:
    """Prescribe the concentration of inflowing slurry at flow nodes [1], or the volume rate of inflowing proppant at
    each [m2/s]; the latest condition applies.
    """
    given = {CONCENTRATION: proppant_volumetric_concentration, RATE: proppant_volumetric_flow_rate}
    chosen = {kind: value for kind, value in given.items() if value is not None}
    if len(chosen) != 1:
        raise CommandError(
            "proppant inflow at a flow node needs one of proppant-volumetric-concentration and "
            "proppant-volumetric-flow-rate"
        )
    proppant = needed(project, Proppant)
    kind, value = assignments.from_now(project, proppant.time, chosen).popitem()
    proppant.prescribe(points(project, where), kind, value)


def joint_property(project: Project, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Change properties of cohesive models, of channels, and of heat in channels; without a range, of all joints that
    have them.
    """
    of_fluid = {name: value for name, value in properties.items() if POROUS.has(name)}
    of_heat = {name: value for name, value in properties.items() if FLUID_HEAT.has(name)}
    of_grains = {name: value for name, value in properties.items() if PROPPANT.has(name)}
    others = {name: value for name, value in properties.items() if name not in of_fluid | of_heat | of_grains}
    if of_fluid:
        needed(project, Flow).adjust(chosen(project, JOINT, where), of_fluid)
    if of_heat:
        needed(project, Heat).of_fluid().adjust(chosen(project, JOINT, where), of_heat)
    if of_grains:
        if where is not None:
            raise CommandError("all channels have the same proppant: change its properties without a range")
        needed(project, Proppant).adjust(of_grains)
    if others:
        assignments.joint_property(project, others, where)


def condition(
    project: Project,
    pressure: Number | None = None,
    flow_surface: Number | tuple[float, ...] | None = None,
    flow_rate: Number | None = None,
    where: Range | None = None,
) -> None:
    """Prescribe at flow nodes a pressure [Pa], the level of a free surface [m] or a point on it, or the rate of each
    node [m2/s]; the latest condition applies.
    """
    if isinstance(flow_surface, (tuple, list)):
        flow_surface = _level(project, flow_surface)
    given: dict[str, Number | None] = {"pressure": pressure, "flow_surface": flow_surface, "flow_rate": flow_rate}
    chosen = {name: value for name, value in given.items() if value is not None}
    if len(chosen) != 1:
        raise CommandError(f"a flow node has one of {', '.join(given)}, got {' and '.join(chosen) or 'none'}")
    flow = needed(project, Flow)
    name, value = assignments.from_now(project, flow.time, chosen).popitem()
    flow.prescribe(points(project, where), _DOES[name], value)


def _level(project: Project, point: Sequence[float]) -> float:
    """Return the height of a point [m], against gravity."""
    if len(point) != project.dim:
        raise CommandError(f"flow-surface: a point of {project.dim} numbers is needed, got {len(point)}")
    o = project.blocks.options
    down = (o.gx, o.gy, o.gz)[: project.dim]
    size = math.hypot(*down)
    if size == 0.0:
        raise CommandError("flow-surface by a point needs gravity to define the vertical: set model gravity first")
    return -math.fsum(a * b for a, b in zip(point, down)) / size


def remove_conditions(project: Project, where: Range | None = None, fluid: bool = True, grains: bool = True) -> None:
    """Remove the conditions of flow nodes; does nothing without fluid."""
    for wanted, found in ((fluid, Flow.there(project.ready())), (grains, Proppant.there(project.ready()))):
        if wanted and found is not None:
            found.remove_conditions(points(project, where))


def initial(
    project: Project,
    pressure: float | None = None,
    saturation: float | None = None,
    concentration: float | None = None,
    where: Range | None = None,
) -> None:
    """Set the present fluid of flow nodes: its pressure [Pa] or saturation [1], and the concentration of proppant in it
    [1].
    """
    nodes = points(project, where)
    grains = None if concentration is None else needed(project, Proppant)
    if (pressure, saturation) != (None, None) or grains is None:
        needed(project, Flow).fill(nodes, pressure, saturation)
    if grains is not None and concentration is not None:
        grains.fill(nodes, concentration)


def well(project: Project, name: str, where: Range | None = None) -> None:
    """Make flow nodes a well, see physics/flow/wells.py."""
    needed(project, Flow).drill(name, points(project, where))


def stage(
    project: Project,
    name: str,
    rate: Number | None = None,
    pressure: Number | None = None,
    shut_in: bool = False,
    time: float | None = None,
    limit: float | None = None,
) -> None:
    """Add a stage of a well: a rate [m2/s] limited by a pressure (limit [Pa]), a pressure [Pa], or shut in. time:
    duration in flow time [s]; None: unlimited.
    """
    given = {w.RATE: rate, w.PRESSURE: pressure, w.SHUT: 0.0 if shut_in else None}
    chosen = {does: value for does, value in given.items() if value is not None}
    if len(chosen) != 1:
        raise CommandError(f"a stage of a well is one of rate, pressure, shut_in, got {' and '.join(chosen) or 'none'}")
    does, value = assignments.from_now(project, needed(project, Flow).time, chosen).popitem()
    duration, most = (math.inf if one is None else one for one in (time, limit))
    needed(project, Flow).stage(name, does, value, duration, most)


def sub_step(
    project: Project, mechanical: int | None = None, hydraulic: int | None = None, thermal: int | None = None
) -> None:
    """Set the steps of the blocks between two cycles of flow and heat, and the sub-steps of such a cycle."""
    if (mechanical, hydraulic) != (None, None):
        project.blocks.flow_clock(every=mechanical, steps=hydraulic)
    if thermal is not None:
        project.blocks.heat_clock(steps=thermal)

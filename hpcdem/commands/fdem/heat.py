"""Heat in elements and in fluid: thermal models, what is prescribed at nodes and faces, initial temperatures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hpcdem.commands.fdem import assignments
from hpcdem.commands.fdem.choices import chosen, points
from hpcdem.commands.fdem.needed import begun, needed
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.groups import ELEMENT, FACE, JOINT, OnBoundary, Range
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.field.assigned import Number
from hpcdem.physics.fields import kinds
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.heat.properties import ISO_HEAT


def model(project: Project, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Let elements conduct heat with these properties (physics.heat.properties)."""
    assign(project, Heat, "heat", chosen(project, ELEMENT, where), properties)


def assign(
    project: Project, physics: type[Any], what: str, numbers: np.ndarray | None, properties: Mapping[str, Value]
) -> None:
    """Assign properties to a physics of blocks (Heat, Flow). If they are rejected, a physics created for them is
    removed again. Raises CommandError next to particles, where blocks do not support `what`.
    """
    if project.coupled is not None:
        raise CommandError(f"coupled blocks do not support {what}")
    with begun(project, physics) as found:
        found.assign(numbers, properties)


def element_property(project: Project, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Change mechanical and thermal properties of elements; without a range, of all elements that have them."""
    thermal = {name: value for name, value in properties.items() if ISO_HEAT.has(name)}
    others = {name: value for name, value in properties.items() if name not in thermal}
    if thermal:
        needed(project, Heat).adjust(chosen(project, ELEMENT, where), thermal)
    for kind in kinds().values():
        mine = {name: value for name, value in others.items() if kind.model.has(name)}
        others = {name: value for name, value in others.items() if name not in mine}
        if mine:
            found = kind.load_type().there(project.ready())
            if found is None:
                raise CommandError(f"no {kind.name} yet: assign element c-model {kind.word} first")
            found.adjust(chosen(project, ELEMENT, where), mine)
    if others:
        assignments.element_property(project, others, where)


def fluid_model(project: Project, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Assign thermal properties to the fluid of channels; without a range, of all channels."""
    needed(project, Heat).of_fluid().assign(chosen(project, JOINT, where), properties)


def condition(project: Project, temperature: Number, where: Range | None = None) -> None:
    """Prescribe the temperature of nodes [K]."""
    heat = needed(project, Heat)
    heat.prescribe(points(project, where), **assignments.from_now(project, heat.time, {"value": temperature}))


def fluid_condition(project: Project, temperature: Number, where: Range | None = None) -> None:
    """Prescribe the temperature of the fluid at flow nodes [K]."""
    heat = needed(project, Heat)
    given = assignments.from_now(project, heat.time, {"temperature": temperature})
    heat.prescribe_fluid(points(project, where), **given)


def initial_fluid(project: Project, temperature: float, where: Range | None = None) -> None:
    """Set the present temperature of the fluid at flow nodes [K]."""
    needed(project, Heat).of_fluid().initial(project.blocks.numbers_of_nodes(points(project, where)), temperature)


def face_condition(
    project: Project,
    heat_flux: Number | None = None,
    transfer_coeficient: float | None = None,
    environment_temperature: Number | None = None,
    where: Range | None = None,
) -> None:
    """Prescribe the heat flux into faces [W/m2], or heat transfer [W/(m2 K)] from an environment of this temperature;
    the default coefficient is that of the elements. Without a range: all faces on the surface of the model.
    """
    given: dict[str, Any] = {"flux": heat_flux, "transfer": transfer_coeficient, "environment": environment_temperature}
    values = {name: value for name, value in given.items() if value is not None}
    if not values:
        raise CommandError("heat through faces is one of heat_flux, transfer_coeficient, environment_temperature")
    heat = needed(project, Heat)
    faces = chosen(project, FACE, (OnBoundary(),) if where is None else where)
    heat.expose(faces, **assignments.from_now(project, heat.time, values))


def remove_conditions(project: Project, where: Range | None = None, rock: bool = True, fluid: bool = True) -> None:
    """Remove prescribed temperatures of nodes and of the fluid at them; does nothing without heat."""
    found = Heat.there(project.ready())
    if found is not None:
        found.remove_conditions(points(project, where), rock, fluid)


def remove_face_conditions(project: Project, where: Range | None = None) -> None:
    """Make faces adiabatic again; does nothing without heat."""
    found = Heat.there(project.ready())
    if found is not None:
        found.remove_face_conditions(chosen(project, FACE, where))


def initial(project: Project, temperature: float, where: Range | None = None) -> None:
    """Set the present temperature of nodes and of the fluid at them [K]; the elements around them are then free of
    thermal stress.
    """
    needed(project, Heat).initial(points(project, where), temperature)

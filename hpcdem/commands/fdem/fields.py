"""Fields that diffuse in elements (physics/fields.py), by their names: models, what is prescribed at nodes and faces,
initial values, their clocks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hpcdem.commands.fdem import assignments
from hpcdem.commands.fdem.choices import chosen, points
from hpcdem.commands.fdem.heat import assign
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.groups import ELEMENT, FACE, OnBoundary, Range
from hpcdem.physics.fdem.tables import Value
from hpcdem.physics.field.assigned import Number
from hpcdem.physics.fields import kinds


def of(project: Project, name: str) -> Any:
    """Return the field of the model. Raises CommandError if the model lacks it."""
    if name not in kinds():
        raise CommandError(f"there is no field {name}; available: {', '.join(kinds())}")
    found = kinds()[name].load_type().there(project.ready())
    if found is None:
        raise CommandError(f"no {name} yet: assign element c-model {kinds()[name].word} first")
    return found


def model(project: Project, name: str, properties: Mapping[str, Value], where: Range | None = None) -> None:
    """Let the field diffuse in elements with these properties."""
    assign(project, kinds()[name].load_type(), name, chosen(project, ELEMENT, where), properties)


def condition(project: Project, name: str, value: Number, where: Range | None = None) -> None:
    """Prescribe the value at nodes."""
    found = of(project, name)
    found.prescribe(points(project, where), **assignments.from_now(project, found.time, {"value": value}))


def face_condition(
    project: Project,
    name: str,
    flux: Number | None = None,
    transfer: float | None = None,
    environment: Number | None = None,
    where: Range | None = None,
) -> None:
    """Prescribe the inflow through faces, or exchange with an environment of this value; the default coefficient is
    that of the elements. Without a range: all faces on the surface of the model.
    """
    every = {"flux": flux, "transfer": transfer, "environment": environment}
    given: dict[str, Any] = {word: value for word, value in every.items() if value is not None}
    if not given:
        raise CommandError(f"{name} through faces is one of flux, transfer, environment")
    found = of(project, name)
    faces = chosen(project, FACE, (OnBoundary(),) if where is None else where)
    found.expose(faces, **assignments.from_now(project, found.time, given))


def remove(project: Project, name: str, kind: str, where: Range | None = None) -> None:
    """Remove the conditions of nodes or faces; does nothing without the field."""
    found = kinds()[name].load_type().there(project.ready())
    if found is not None and kind == FACE:
        found.remove_face_conditions(chosen(project, FACE, where))
    elif found is not None:
        found.remove_conditions(points(project, where))


def initial(project: Project, name: str, value: float, where: Range | None = None) -> None:
    """Set the present value at nodes; the elements around them are then free of stress caused by the field."""
    of(project, name).initial(points(project, where), value)


def clock(
    project: Project, field: str, flows: bool | None = None, sub_steps: int | None = None,
    time_step: float | None = None, current_time: float | None = None,
) -> None:  # fmt: skip
    """Set whether the field flows, the sub-steps of a cycle, their length [s], and the present time of its clock
    [s]."""
    found = of(project, field)
    found.clock(flows, sub_steps, time_step)
    if current_time is not None:
        found.set_clock(current_time)


def account(project: Project, name: str) -> dict[str, float]:
    """Return the budget of the field: given, stored and lost, see `Diffusing.account`. Collective."""
    return dict(of(project, name).account())

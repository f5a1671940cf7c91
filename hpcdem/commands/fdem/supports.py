"""Commands that bolts and liners share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from hpcdem.commands.fdem.assignments import from_now
from hpcdem.commands.fdem.choices import everything
from hpcdem.commands.fdem.project import Project
from hpcdem.physics.fdem.groups import Range
from hpcdem.physics.supports import of


def put_into(project: Project, group: str | None, set_name: str, of: Mapping[str, np.ndarray]) -> None:
    """Add objects, by kind, to a group; None: to none."""
    if group is not None:
        for kind, numbers in of.items():
            project.groups[kind].assign(numbers, group, set_name)


def assign(project: Project, kind: str, properties: Mapping[str, float], where: Range | None) -> None:
    """Assign properties to elements of this kind."""
    elements = everything(project, kind, where)
    of(project.ready(), kind).assign(elements, properties)


def delete(project: Project, kind: str, where: Range | None) -> None:
    """Remove elements of this kind; the numbers of the others do not change."""
    elements = everything(project, kind, where)
    of(project.ready(), kind).delete(elements)


def condition(project: Project, kind: str, changes: Mapping[str, Any], where: Range | None) -> None:
    """Prescribe components of nodes of this kind, see the class of their conditions."""
    nodes = everything(project, kind, where)
    blocks = project.ready()
    of(blocks, kind).condition(nodes, **from_now(project, blocks.time_now(), changes))


def remove_conditions(project: Project, kind: str, where: Range | None = None, stems: tuple[str, ...] = ()) -> None:
    """Remove conditions of nodes of this kind; stems: only these components, does and at, or force."""
    nodes, support = everything(project, kind, where), of(project.ready(), kind)
    if not stems:
        support.remove_conditions(nodes)
        return
    blank = asdict(support.conditions[0])
    support.condition(nodes, **{name: value for name, value in blank.items() if name.partition("_")[0] in stems})

"""Bolts and liners alike: which class has the objects of a kind, and what is said to all of them the same way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from hpcdem.core.errors import CommandError
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem.structures import Structure
from hpcdem.physics.liners.model import Liners

if TYPE_CHECKING:
    from hpcdem.commands.fdem.project import Project
    from hpcdem.physics.fdem.groups import Range

ALL: tuple[type[Structure], ...] = (Bolts, Liners)
QUANTITIES: Mapping[str, Mapping[str, tuple[str, str]]] = {
    kind: of for support in ALL for kind, of in support.quantities.items()
}
"""What can be asked of each kind of object: unit and meaning."""


def class_of(kind: str) -> type[Structure]:
    """The class that has the objects of this kind (groups.SUPPORTS)."""
    return next(one for one in ALL if kind in one.parts)


def of(blocks: Any, kind: str) -> Structure:
    """Those of a model that have the objects of this kind. CommandError if there are none."""
    support = class_of(kind)
    found = support.there(blocks)
    if found is None:
        raise CommandError(f"there are no {support.name} yet: {support.word} create comes first")
    return found


def assign(project: Project, kind: str, properties: Mapping[str, float], where: Range | None) -> None:
    """Properties of elements of this kind."""
    from hpcdem.commands.fdem.choices import everything

    elements = everything(project, kind, where)
    of(project.ready(), kind).assign(elements, properties)


def delete(project: Project, kind: str, where: Range | None) -> None:
    """Take elements of this kind out; the numbers of the others stay."""
    from hpcdem.commands.fdem.choices import everything

    elements = everything(project, kind, where)
    of(project.ready(), kind).delete(elements)


def condition(project: Project, kind: str, changes: Mapping[str, Any], where: Range | None) -> None:
    """Prescribe components of nodes of this kind, see the class of their conditions."""
    from hpcdem.commands.fdem.choices import everything

    nodes = everything(project, kind, where)
    of(project.ready(), kind).condition(nodes, **changes)


def remove_conditions(project: Project, kind: str, where: Range | None = None) -> None:
    """Nodes of this kind are free again."""
    from hpcdem.commands.fdem.choices import everything

    nodes = everything(project, kind, where)
    of(project.ready(), kind).remove_conditions(nodes)

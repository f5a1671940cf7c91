"""A physics of blocks that a command needs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeVar

from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.surface_loads import SurfaceLoad
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.proppant.model import Proppant

LACKS: dict[type[SurfaceLoad], str] = {
    Flow: "no channels yet: assign face-joint c-model hydraulic-porous-medium first",
    Heat: "no heat yet: assign element c-model thermal-iso-heat first",
    Proppant: "no proppant yet: assign face-joint c-model hydraulic-porous-proppant-medium first",
}
_P = TypeVar("_P", bound=SurfaceLoad)


def needed(project: Project, physics: type[_P], use: bool = True) -> _P:
    """Return this physics of the model. Raises CommandError if missing. use: see `Project.ready`."""
    found = physics.there(project.ready(use=use))
    if found is None:
        raise CommandError(LACKS[physics])
    return found


@contextmanager
def begun(project: Project, physics: type[_P]) -> Iterator[_P]:
    """Return this physics of the model, or a new one, which is removed again if the command is rejected."""
    blocks = project.ready()
    known, found = physics.there(blocks), physics.of(blocks)
    try:
        yield found
    except CommandError:
        if known is None:
            blocks.surface_loads.remove(found)
        raise

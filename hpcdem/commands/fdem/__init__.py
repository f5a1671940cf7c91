"""The commands of a model of blocks: one function per command, called by the language PCDC and by Python programs.

The first argument is the `Project`: the simulation and what a script has prepared for it. All are collective and
raise CommandError for what makes no sense, equal on all ranks. Modules are imported when they are first used, as most
bring numba and kernels, which takes a second.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hpcdem.commands.fdem import (
        assignments,
        bolts,
        charts,
        checkpoints,
        clocks,
        coupling,
        cracks,
        fields,
        flow,
        frames,
        geometry,
        heat,
        histories,
        liners,
        meshes,
        pictures,
        queries,
        settings,
        steps,
        summary,
        supports,
    )
    from hpcdem.commands.fdem.project import Project

__all__ = [
    "Project", "assignments", "bolts", "charts", "checkpoints", "clocks", "coupling", "cracks", "flow", "frames",
    "fields", "geometry", "heat", "histories", "liners", "meshes", "pictures", "queries", "settings", "steps",
    "summary", "supports",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name == "Project":
        return import_module("hpcdem.commands.fdem.project").Project
    if name in __all__:
        return import_module(f"hpcdem.commands.fdem.{name}")
    raise AttributeError(f"module {__name__} has no attribute {name}")

"""The commands of ZDEM, one function each.

Modules are imported when they are first used, as most bring numba and kernels, which takes a second.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hpcdem.commands.dem import (
        bonds,
        checkpoints,
        clumps,
        cycles,
        flexure,
        history,
        particles,
        physics,
        properties,
        queries,
        sections,
        settings,
        surface,
        walls,
    )

__all__ = [
    "bonds", "checkpoints", "clumps", "cycles", "flexure", "history", "particles", "physics", "properties", "queries",
    "sections", "settings", "surface", "walls",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name in __all__:
        return import_module(f"hpcdem.commands.dem.{name}")
    raise AttributeError(f"module {__name__} has no attribute {name}")

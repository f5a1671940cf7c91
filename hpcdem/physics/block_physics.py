"""Physics that belong to blocks and are saved with them: which there are.

Each is a `SurfaceLoad` (physics/fdem/surface_loads.py), which may move with the steps, bring stiffness to corners, hold
energy and have columns in checkpoints. physics/bolts is the worked example. Discs are saved with their particles.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from hpcdem.physics.fields import kinds

if TYPE_CHECKING:
    from hpcdem.physics.fdem.free_field import FreeField
    from hpcdem.physics.fdem.structures import Structure
    from hpcdem.physics.fdem.water import Water
    from hpcdem.physics.flow.model import Flow
    from hpcdem.physics.heat.model import Heat
    from hpcdem.physics.proppant.model import Proppant


def _bolts() -> type[Structure]:
    from hpcdem.physics.bolts.model import Bolts

    return Bolts


def _fluid() -> type[Flow]:
    from hpcdem.physics.flow.model import Flow

    return Flow


def _liners() -> type[Structure]:
    from hpcdem.physics.liners.model import Liners

    return Liners


def _free_field() -> type[FreeField]:
    from hpcdem.physics.fdem.free_field import FreeField

    return FreeField


def _heat() -> type[Heat]:
    from hpcdem.physics.heat.model import Heat

    return Heat


def _proppant() -> type[Proppant]:
    from hpcdem.physics.proppant.model import Proppant

    return Proppant


def _water() -> type[Water]:
    from hpcdem.physics.fdem.water import Water

    return Water


PHYSICS: Mapping[str, Callable[[], type[Any]]] = {
    "bolts": _bolts, "liners": _liners, "free_field": _free_field, "fluid": _fluid, "proppant": _proppant,
    "heat": _heat, "water": _water, **{name: kind.load_type for name, kind in kinds().items()},
}  # fmt: skip
"""Loaders of the classes; importing them loads numba and kernels, which takes a second."""

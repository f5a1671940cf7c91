"""Physics that belong to blocks and are saved with them: which there are.

Each is a `SurfaceLoad` (physics/fdem/surface_loads.py), which may move with the steps, bring stiffness to corners, hold
energy and have columns in checkpoints. physics/bolts is the worked example. Discs are saved with their particles.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hpcdem.physics.bolts.model import Bolts
    from hpcdem.physics.fdem.free_field import FreeField


def _bolts() -> type[Bolts]:
    from hpcdem.physics.bolts.model import Bolts

    return Bolts


def _free_field() -> type[FreeField]:
    from hpcdem.physics.fdem.free_field import FreeField

    return FreeField


PHYSICS: Mapping[str, Callable[[], type[Bolts] | type[FreeField]]] = {"bolts": _bolts, "free_field": _free_field}
"""How to get each class: its import brings kernels, which must wait for their cache folder."""

"""Forces on free faces that other physics compute: discs that touch them, later fluid, heat, bolts."""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

import numpy as np

from hpcdem.core.errors import CommandError

ORDER = ("discs", "fluid", "heat", "bolts")
"""In which they are added up, whoever came first: sums keep their bits."""


class SurfaceLoad(Protocol):
    """What blocks ask of one; `name` is one of ORDER."""

    name: ClassVar[str]

    def corners(self, blocks: Any) -> np.ndarray:
        """(n_own, 4) bool: corners of owned elements that may get such a force."""

    def add_to(self, applied: np.ndarray) -> None:
        """Add the present ones to what is applied to corners (n, 8), in storage order [N/m]. Not collective."""

    def storage_rebuilt(self) -> None:
        """Elements have other rows or owners. Collective."""

    def mesh_replaced(self) -> None:
        """There is another mesh."""


class SurfaceLoads:
    """The surface loads of a model, in the order of ORDER."""

    def __init__(self) -> None:
        self._loads: list[SurfaceLoad] = []

    def __bool__(self) -> bool:
        return bool(self._loads)

    def __contains__(self, name: str) -> bool:
        return any(load.name == name for load in self._loads)

    def add(self, load: SurfaceLoad) -> None:
        """Take one more; the model is open. CommandError if there is one of this name."""
        if load.name in self:
            raise CommandError(f"these blocks have a surface load of {load.name} already")
        self._loads = sorted([*self._loads, load], key=lambda one: ORDER.index(one.name))

    def remove(self, load: SurfaceLoad) -> None:
        """Forget it."""
        self._loads.remove(load)

    def corners(self, blocks: Any, out: np.ndarray) -> None:
        """Set the corners of out (n_own, 4) bool that may get a force of any of them."""
        for load in self._loads:
            out |= load.corners(blocks)

    def add_to(self, applied: np.ndarray) -> None:
        """Add all of them to what is applied to corners (n, 8) [N/m]. Not collective."""
        for load in self._loads:
            load.add_to(applied)

    def storage_rebuilt(self) -> None:
        """Elements have other rows or owners. Collective."""
        for load in self._loads:
            load.storage_rebuilt()

    def mesh_replaced(self) -> None:
        """There is another mesh."""
        for load in self._loads:
            load.mesh_replaced()

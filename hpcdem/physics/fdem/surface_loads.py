"""Forces on corners of elements that other physics compute: discs that touch free faces, rock bolts, liners, the ground
beyond free-field sides, fluid; and the stress that heat brings to them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any, ClassVar, Self

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fields import FIELDS

ORDER = ("discs", "fluid", "proppant", "heat", *FIELDS, "bolts", "liners", "free_field", "water")
"""Order in which the loads are added up, independent of the order in which they were created: sums are then equal to
the bit."""
SHARED_OUT = ("flow_nodes", "proppant_nodes", "fluid_heat")
"""Tables of checkpoints of which each rank has a part, see `SurfaceLoad.saved_rows`."""


class SurfaceLoad(ABC):
    """Interface of a load on the surfaces of blocks; `name` is one of ORDER; of_mesh: it is removed with the mesh for
    which it was made.
    """

    name: ClassVar[str]
    of_mesh: ClassVar[bool] = False
    kernel_kind: ClassVar[str] = ""
    """Kind of the kernels that it needs besides those of blocks, see `session.KINDS`."""
    of_both: ClassVar[bool] = False
    """Whether the kernels are the same in the plane and in space."""
    own_clock: ClassVar[bool] = False
    """Whether its conditions follow tables over a time of its own, which also passes where blocks are at rest."""

    @property
    def keeps_time(self) -> bool:
        """Return whether model time advances although the blocks are at rest; the first such load determines it. Not
        collective."""
        return False

    @classmethod
    def there(cls, blocks: Any) -> Self | None:
        """Return the load of a model, None if it has none. Not collective."""
        return next((load for load in blocks.surface_loads if isinstance(load, cls)), None)

    @classmethod
    def of(cls, blocks: Any) -> Self:
        """Return the load of a model, made on the first call. Not collective."""
        found = cls.there(blocks)
        if found is None:
            found = cls.new(blocks)
            blocks.surface_loads.add(found)
        return found

    @classmethod
    def new(cls, blocks: Any) -> Self:
        """Create the load for a model that has none. Not collective."""
        return cls(blocks)  # type: ignore[call-arg]

    @property
    def stays(self) -> bool:
        """Return whether its forces stay constant while the static solver iterates."""
        return False

    @abstractmethod
    def corners(self, blocks: Any) -> np.ndarray:
        """(n_own, 4) bool: corners of owned elements that may get such a force."""

    @abstractmethod
    def add_to(self, applied: np.ndarray) -> None:
        """Add the present ones to what is applied to corners (n, 8), in storage order [N/m]. Not collective."""

    @abstractmethod
    def storage_rebuilt(self) -> None:
        """Elements have other rows or owners. Collective."""

    @abstractmethod
    def mesh_replaced(self) -> None:
        """Handle a replaced mesh."""

    def springs(self, blocks: Any) -> np.ndarray | None:
        """(n_own, 4) stiffness [N/m per m] that it brings to corners of owned elements, for masses and time step."""
        return None

    def reach(self, blocks: Any, middle: np.ndarray) -> float:
        """Largest distance of elements that must be held by one rank because of it [m]; the model is open, middle
        (n, 2): of the owned elements. Collective."""
        return 0.0

    def joints_opened(self) -> None:  # noqa: B027 - most have nothing to do here
        """Joints broke since the last lists: all ranks know. Not collective."""

    def dashpots(self, blocks: Any) -> np.ndarray | None:
        """(n_own, 4) dashpots [N s/m per m] that it brings to corners of owned elements, for the time step."""
        return None

    def check_complete(self) -> None:  # noqa: B027 - most have nothing to do here
        """CommandError if some elements lack what others have of this physics. Not collective."""

    def check_start(self) -> None:  # noqa: B027 - most have nothing to do here
        """CommandError if no step can be done with it. Not collective."""

    def follow(self) -> None:  # noqa: B027 - most have nothing to do here
        """The elements have moved by a step; their new positions are there, ghosts too. Collective."""

    def eigenstress(self, blocks: Any) -> np.ndarray | None:
        """(n_own,) stress xx, yy and zz [Pa] that it brings to owned elements without strain; None: none ever. Not
        collective."""
        return None

    def balance(self) -> tuple[np.ndarray, np.ndarray]:
        """Return this rank's share of its own unbalanced and contributing forces [N/m], for the ratio of the model."""
        return np.empty(0), np.empty(0)

    def work_done(self) -> float:
        """Return the work done on the blocks since the energy budget began, if the load keeps its own account; equal on
        all ranks [J/m]."""
        return 0.0

    def elements_removed(self, elements: np.ndarray) -> None:  # noqa: B027 - most have nothing to do here
        """Update the load for removed elements; the model is open. Collective."""

    def uses_table(self, name: str) -> bool:
        """Return whether something of it follows this table of time. Not collective."""
        return False

    def balanced(self) -> None:  # noqa: B027 - most have nothing to do here
        """The static solve found equilibrium with the present forces. Collective."""

    def stop(self) -> None:  # noqa: B027 - most have nothing to do here
        """Set all velocities to zero. Not collective."""

    def saved_state(self) -> dict[str, Any] | None:
        """Return what a checkpoint holds of it, as JSON values; None: it is saved elsewhere. Collective."""
        return None

    def saved_tables(self) -> dict[str, dict[str, np.ndarray]]:
        """Columns that a checkpoint holds of it, by the name of their table; equal on all ranks."""
        return {}

    def saved_rows(self) -> dict[str, dict[str, np.ndarray]]:
        """Columns that a checkpoint holds of this rank's rows, with their "number". Names of these tables are in
        `SHARED_OUT`."""
        return {}


class SurfaceLoads:
    """The surface loads of a model, in the order of ORDER."""

    def __init__(self) -> None:
        self._loads: list[SurfaceLoad] = []

    def __bool__(self) -> bool:
        return bool(self._loads)

    def __iter__(self) -> Iterator[SurfaceLoad]:
        return iter(self._loads)

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
        """Handle a replaced or deleted mesh."""
        for load in self._loads:
            load.mesh_replaced()
        self._loads = [load for load in self._loads if not load.of_mesh]

    def springs(self, blocks: Any, out: np.ndarray) -> None:
        """Add the stiffness that all of them bring to corners of owned elements, out (n_own, 4) [N/m per m]."""
        for load in self._loads:
            found = load.springs(blocks)
            if found is not None:
                out += found

    def eigenstress(self, blocks: Any) -> np.ndarray | None:
        """The sum of what all of them bring, see `SurfaceLoad.eigenstress`; None: none. Not collective."""
        found = [one for load in self._loads if (one := load.eigenstress(blocks)) is not None]
        return np.sum(found, axis=0) if len(found) > 1 else next(iter(found), None)

    def reach(self, blocks: Any, middle: np.ndarray) -> float:
        """Largest distance of elements that must be held by one rank because of them [m]. Collective."""
        return max((load.reach(blocks, middle) for load in self._loads), default=0.0)

    def joints_opened(self) -> None:
        """Joints broke since the last lists. Not collective."""
        for load in self._loads:
            load.joints_opened()

    def dashpots(self, blocks: Any, out: np.ndarray) -> None:
        """Add the dashpots that all of them bring to corners of owned elements, out (n_own, 4) [N s/m per m]."""
        for load in self._loads:
            found = load.dashpots(blocks)
            if found is not None:
                out += found

    def check_start(self) -> None:
        """CommandError if no step can be done with them. Not collective."""
        for load in self._loads:
            load.check_start()

    def follow(self) -> None:
        """The elements have moved by a step. Collective."""
        for load in self._loads:
            load.follow()

    def balance(self) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Return this rank's share of their own unbalanced and contributing forces [N/m]. Not collective."""
        found = [load.balance() for load in self._loads]
        return [one for one, _ in found], [other for _, other in found]

    def work_done(self) -> dict[str, float]:
        """Return the work done on the blocks by each load that keeps its own account, by name [J/m]. Not collective."""
        return {load.name: load.work_done() for load in self._loads}

    def elements_removed(self, elements: np.ndarray) -> None:
        """Update the load for removed elements; the model is open. Collective."""
        for load in self._loads:
            load.elements_removed(elements)

    def saved_state(self) -> dict[str, dict[str, Any]]:
        """Return by name the parts of a checkpoint, as JSON values. Collective."""
        found = {load.name: load.saved_state() for load in self._loads}
        return {name: state for name, state in found.items() if state is not None}

    def saved_tables(self) -> dict[str, dict[str, np.ndarray]]:
        """Columns that a checkpoint holds of them, by the name of their table; equal on all ranks."""
        return {name: columns for load in self._loads for name, columns in load.saved_tables().items()}

    def saved_rows(self) -> dict[str, dict[str, np.ndarray]]:
        """Columns that a checkpoint holds of what is distributed among the ranks."""
        return {name: columns for load in self._loads for name, columns in load.saved_rows().items()}

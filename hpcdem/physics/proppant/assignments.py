"""Assignments of proppant: the channels that carry it, its properties, its inflow at nodes. All of it is known to all
ranks by the numbers of the mesh.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.field import assigned
from hpcdem.physics.field.assigned import Number
from hpcdem.physics.field.model import Field, Travelling
from hpcdem.physics.flow.assignments import nodes_not
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.proppant.properties import PROPPANT

if TYPE_CHECKING:
    from hpcdem.physics.fdem.simulation import Blocks

CONCENTRATION, RATE = "concentration", "rate"


def checked(given: Mapping[str, Any]) -> dict[str, float]:
    """Check the given properties and complete them by defaults."""
    for name, value in given.items():
        if not isinstance(value, (int, float)):
            raise CommandError(f"all channels have the same proppant: {name} must be a number")
    return PROPPANT.complete(given)


class ProppantAssignments(Travelling, Field):
    """values: properties by name; carries (4 ne,) bool: channels that grains can pass, by joint; condition (np,): row
    of the conditions (kind, value), by node."""

    def __init__(self, blocks: Blocks, flow: Flow) -> None:
        super().__init__()
        self.blocks, self.flow = blocks, flow
        mesh = blocks.the_mesh()
        self.values: dict[str, float] = {}
        self.carries = np.zeros(mesh.cells.size, bool)
        self.condition = np.zeros(len(mesh.points), np.int32)
        self.conditions: list[tuple[str, Number]] = [("", 0.0)]

    @property
    def stays(self) -> bool:
        """Return whether the load stays constant during a static solve: a pack pushes less the farther the walls go."""
        return not self.values.get("proppant_modulus", 0.0) > 0.0

    def assign(self, joints: np.ndarray | None, given: Mapping[str, Any]) -> None:
        """Channels among these joints (None: all) carry proppant with these properties."""
        at = self.blocks.numbers_of_joints(joints)
        self._say(given, {} if not self.carries.any() else self.values)
        self.blocks.before_change()
        self.carries[at] = True
        self.blocks.changed()

    def leave(self, joints: np.ndarray | None) -> None:
        """Channels among these joints (None: all) carry none any more."""
        at = self.blocks.numbers_of_joints(joints)
        self.blocks.before_change()
        self.carries[at] = False
        self.blocks.changed()

    def _nodes(self, points: np.ndarray | None) -> np.ndarray:
        """Return those of these points (None: all) at the end of a channel that carries proppant."""
        network = self.flow.network
        asked = self.flow.flow_nodes(points)
        found = np.intersect1d(asked, network.corners[self.carries[network.channels]])
        if not len(found):
            raise CommandError(f"{nodes_not(asked)} at the end of a channel that carries proppant")
        return found

    def adjust(self, given: Mapping[str, Any]) -> None:
        """Change some properties."""
        self._say({**self.values, **given}, {})
        self.blocks.before_change()
        self.blocks.changed()

    def _say(self, given: Mapping[str, Any], before: Mapping[str, float]) -> None:
        values = checked(given)
        for name in before:
            if before[name] != values[name]:
                raise CommandError(
                    f"all channels have the same proppant, but {name} is {before[name]:g} and {values[name]:g}"
                )
        limit = values["proppant_concentration_limit"]
        for kind, value in assigned.in_use(self.conditions, self.condition):
            if kind == CONCENTRATION and assigned.checked(self.blocks.tables, value, kind).max() > limit:
                raise CommandError(
                    f"the inflow of slurry would exceed the concentration of a pack, {limit:g}: change the inflow first"
                )
        self.values = values

    def prescribe(self, nodes: np.ndarray | None, kind: str, value: Number) -> None:
        """The concentration of slurry that comes in at flow nodes among these points (None: all) from now on, or a
        volume rate of proppant [m2/s] at each of them."""
        at = self._nodes(nodes)
        values = assigned.checked(self.blocks.tables, value, f"the {kind} of proppant")
        limit = self.values["proppant_concentration_limit"]
        if values.min() < 0.0 or (kind == CONCENTRATION and values.max() > limit):
            most = f" and at most that of a pack, {limit:g}" if kind == CONCENTRATION else ""
            wrong = values.min() if values.min() < 0.0 else values.max()
            raise CommandError(f"the {kind} of proppant must not be negative{most}, got {wrong:g}")
        self.blocks.before_change()
        self.condition[at] = assigned.row_of(self.conditions, (kind, value))
        self.blocks.changed(stiffness=False)

    def remove_conditions(self, nodes: np.ndarray | None) -> None:
        """Take back what is prescribed at these points (None: all)."""
        self._unset(self.condition, nodes)

    def uses_table(self, name: str) -> bool:
        return any(value == name for _, value in assigned.in_use(self.conditions, self.condition))

"""Groups of elements, nodes, faces, joints and parts of bolts and liners, and ranges that choose among them.

A group belongs to a set; an object is in one group of each set at most. Objects are numbered for the whole model
(`connectivity`): a group is an ascending array of numbers, and knows neither ranks nor how many objects there are.
Nodes may be sides of points (sides.py).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import CommandError

ELEMENT, NODE, FACE, JOINT = "element", "node", "element-face", "face-joint"
BOLT_ELEMENT, BOLT_NODE = "bolt-element", "bolt-node"
LINER_ELEMENT, LINER_NODE = "liner-element", "liner-node"
SUPPORTS = (BOLT_ELEMENT, BOLT_NODE, LINER_ELEMENT, LINER_NODE)
FLOW_NODE, CHANNEL = "flow-node", "flow-channel"
FLOW = {FLOW_NODE: NODE, CHANNEL: JOINT}
"""Kinds of objects whose numbers, groups and positions are those of nodes and joints."""
KINDS = (ELEMENT, NODE, FACE, JOINT, *SUPPORTS)
SHOWN = {"elements": ELEMENT, "joints": JOINT, "channels": CHANNEL}
"""Kinds of objects of a picture from which a range can choose."""
DEFAULT = "default"
"""Set of groups whose set is not named."""


class Groups:
    """Groups of one kind of object: set name -> group name -> ascending numbers."""

    def __init__(self, kind: str, groups: Mapping[str, Mapping[str, np.ndarray]] | None = None) -> None:
        self.kind = kind
        self.sets: dict[str, dict[str, np.ndarray]] = {}
        for set_name, of in (groups or {}).items():
            for name, numbers in of.items():
                self.assign(numbers, name, set_name)

    def assign(self, numbers: Iterable[int], group: str, set_name: str = DEFAULT) -> None:
        """Put objects into a group; they leave the one of the set that they were in."""
        new = np.unique(np.asarray(numbers, np.int64))
        groups = self.sets.setdefault(set_name, {})
        for other, members in groups.items():
            if other != group:
                groups[other] = np.setdiff1d(members, new, assume_unique=True)
        groups[group] = np.union1d(groups.get(group, np.empty(0, np.int64)), new)

    def members(self, group: str, set_name: str = DEFAULT) -> np.ndarray:
        """Numbers of a group. CommandError if there is no such set or group, with those there are."""
        groups = self.of_set(set_name)
        if group not in groups:
            elsewhere = [s for s, of in self.sets.items() if group in of]
            raise CommandError(
                f"set '{set_name}' has no group '{group}' of {self.kind}s; it has {_listed(groups)}"
                + (f". There is a group '{group}' in set {_listed(elsewhere)}" if elsewhere else "")
            )
        return groups[group]

    def of_set(self, set_name: str) -> dict[str, np.ndarray]:
        """The groups of a set. CommandError if missing."""
        if set_name not in self.sets:
            raise CommandError(f"there is no set '{set_name}' of {self.kind}s; available: {_listed(self.sets)}")
        return self.sets[set_name]

    def state(self) -> dict[str, dict[str, list[list[int]]]]:
        """The groups as JSON values: each as runs [first, last] of numbers."""
        return {s: {name: runs(numbers) for name, numbers in of.items()} for s, of in self.sets.items()}

    @staticmethod
    def restored(kind: str, state: Mapping[str, Mapping[str, Sequence[Sequence[int]]]]) -> Groups:
        """Inverse of `state`."""
        made = Groups(kind)
        for set_name, of in state.items():
            for name, rows in of.items():
                made.sets.setdefault(set_name, {})[name] = of_runs(rows)
        return made


def of_runs(rows: Sequence[Sequence[int]]) -> np.ndarray:
    """Inverse of `runs`."""
    return np.concatenate([np.empty(0, np.int64), *(np.arange(a, b + 1, dtype=np.int64) for a, b in rows)])


def runs(numbers: np.ndarray) -> list[list[int]]:
    """Ascending numbers as runs [first, last]."""
    if not len(numbers):
        return []
    ends = np.flatnonzero(np.diff(numbers) != 1)
    first, last = np.concatenate([[0], ends + 1]), np.concatenate([ends, [len(numbers) - 1]])
    return np.column_stack([numbers[first], numbers[last]]).tolist()


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"'{name}'" for name in names) or "none so far"


# ---- ranges --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class InGroup:
    """Members of a group."""

    group: str
    set_name: str = DEFAULT


@dataclass(frozen=True)
class InSet:
    """Members of any group of a set."""

    set_name: str


@dataclass(frozen=True)
class Ids:
    """Numbers from first to last."""

    first: int
    last: int


@dataclass(frozen=True)
class Span:
    """Objects from low to high along an axis of the mesh, 0: x, 1: y. Elements are tested by their centre, faces and
    joints by both ends."""

    axis: int
    low: float
    high: float


@dataclass(frozen=True)
class OnLayer:
    """Objects on the lines of a geometry layer; elements: inside of it."""

    layer: str


@dataclass(frozen=True)
class Sized:
    """Elements with an area [m2] from low to high; in space faces."""

    low: float
    high: float


@dataclass(frozen=True)
class InCircle:
    """All points in a circle, in space a sphere [m], in the mesh. Elements: their centre."""

    centre: tuple[float, ...]
    radius: float


@dataclass(frozen=True)
class Along:
    """Within a distance [m] of the lines of a geometry layer, faces and joints at an angle to them of at most so much
    [degrees], in the mesh. Elements: their centre."""

    layer: str
    distance: float = 0.0
    angle: float = 0.0


@dataclass(frozen=True)
class Near:
    """All points within a distance [m] of the lines, in space the surfaces, of a geometry layer, in the mesh. Elements:
    their centre."""

    layer: str
    within: float = 0.0


@dataclass(frozen=True)
class Crossed:
    """A ray from the middle crosses the lines of a geometry layer as often as `count` or by an even number more often:
    1 is inside."""

    layer: str
    direction: tuple[float, ...] = (1.0, 0.0)
    count: int = 1


@dataclass(frozen=True)
class Not:
    """Objects that a term does not select."""

    term: Term


@dataclass(frozen=True)
class OnBoundary:
    """Objects on a surface of the model."""


@dataclass(frozen=True)
class OfElements:
    """Faces, joints and nodes of the elements of a group; joints: both elements are in it; nodes: on their side."""

    group: str
    set_name: str = DEFAULT


@dataclass(frozen=True)
class OfElement:
    """Faces and nodes of the elements from first to last; nodes: on their side."""

    first: int
    last: int


@dataclass(frozen=True)
class Between:
    """Joints with an element in each of two groups."""

    one: str
    other: str
    set_name: str = DEFAULT


@dataclass(frozen=True)
class OnCrack:
    """Joints on a crack of the mesh."""


@dataclass(frozen=True)
class Present:
    """Other terms of the range look at where things are now, not at where they are in the mesh."""


@dataclass(frozen=True)
class UseHidden:
    """Elements that are hidden, and what belongs to them, are chosen too."""

    on: bool = True


@dataclass(frozen=True)
class Around:
    """Joints of which one of these elements is a side."""

    elements: tuple[int, ...]


Term = (
    InGroup
    | Around
    | InSet
    | Ids
    | Span
    | OnLayer
    | OnBoundary
    | OfElements
    | OfElement
    | Between
    | OnCrack
    | Present
    | UseHidden
    | Sized
    | InCircle
    | Along
    | Near
    | Crossed
    | Not
)
Range = tuple[Term, ...]
"""Terms of a range, all of which must hold."""

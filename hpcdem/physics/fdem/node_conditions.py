"""Prescribed motions, forces and constraints of nodes, and their combination at one node.

A move constraint leaves a subspace of motions: all, a plane (across a vector), a line (along one), none. Constraints of
one node meet in their common part; components of motion that are prescribed besides must lie in it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hpcdem.physics.fdem.kernels import nodes as moving
from hpcdem.physics.fdem.kernels import space
from hpcdem.physics.user_files import MARK

Number = float | str
"""A value of a condition: a number, the name of a table of values over model time, or of a function of place and time
(user_functions.py)."""
STRAIGHT = 1e-9
"""Sine of the angle below which two directions count as the same."""


class Contradiction(Exception):
    """Conditions that no motion fulfils: the two that contradict, in words."""


@dataclass(frozen=True)
class NodeCondition:
    """Condition of nodes. does_x, _y, _z: moving.FREE, VELOCITY, ACCELERATION; at_x, _y, _z: its value; force;
    constraint (moving.UNBOUND, ..., in space space.ACROSS too) and its unit vector. older: bits of the components of
    motion (1, 2, 4) and force (8, 16, 32) that were set anew of other corners of the node: they count once these are
    nodes of their own. side_x, _y, _z: of the force, 0: shared by all corners at the point, else by those there with
    the same number. part_x, _y, _z: factors of the force. damp: local damping, negative: that of the model."""

    does_x: int = moving.FREE
    at_x: Number = 0.0
    does_y: int = moving.FREE
    at_y: Number = 0.0
    force_x: Number = 0.0
    force_y: Number = 0.0
    constraint: int = moving.UNBOUND
    direction: tuple[float, ...] = (0.0, 0.0)
    does_z: int = moving.FREE
    at_z: Number = 0.0
    force_z: Number = 0.0
    older: int = 0
    side_x: int = 0
    side_y: int = 0
    side_z: int = 0
    part_x: float = 1.0
    part_y: float = 1.0
    part_z: float = 1.0
    damp: float = -1.0

    def motion(self, axis: str) -> str:
        """Describe a prescribed component."""
        kind = "velocity" if getattr(self, f"does_{axis}") == moving.VELOCITY else "acceleration"
        return f"{kind}-{axis} {_text(getattr(self, f'at_{axis}'))}"

    def push(self, axis: str) -> str:
        """Describe a force."""
        return f"force-{axis} {_text(getattr(self, f'force_{axis}'))}"


KINDS = "motion", "force", "constraint"
"""Parts of a condition that can be removed separately."""


def without(one: NodeCondition, kinds: Sequence[str]) -> NodeCondition:
    """The rest of a condition when these kinds of it are taken back."""
    blank, left = NodeCondition(), one
    of = {"motion": ("does", "at"), "force": ("force", "side", "part")}
    for kind, bits in (("motion", 7), ("force", 56)):
        if kind in kinds:
            names = [f"{stem}_{axis}" for stem in of[kind] for axis in "xyz"]
            left = replace(left, older=left.older & ~bits, **{name: getattr(blank, name) for name in names})
    return replace(left, constraint=blank.constraint, direction=blank.direction) if "constraint" in kinds else left


_CONSTRAINTS = {
    moving.FIXED: "held (type 1)",
    moving.ALONG: "bound to the direction {} (type 2)",
    space.ACROSS: "bound to the plane across {} (type 3)",
}


def _text(value: Number) -> str:
    return f"'{value.partition(MARK)[0]}'" if isinstance(value, str) else format(value, "g")


def restored(state: Mapping[str, Any]) -> NodeCondition:
    """Return the condition of a checkpoint; earlier ones call the direction `way`."""
    given = dict(state)
    given["direction"] = tuple(given.pop("way", None) or given["direction"])
    return NodeCondition(**given)


def _vector(direction: Sequence[float]) -> str:
    return f"({', '.join(f'{c:g}' for c in direction)})"


def bound(
    kind: int, direction: tuple[float, ...], other: int, other_direction: tuple[float, ...], dim: int
) -> tuple[int, tuple[float, ...]]:
    """The constraint of a node that has both of these."""
    if other == moving.UNBOUND or kind == moving.FIXED:
        return kind, direction
    if kind == moving.UNBOUND or other == moving.FIXED:
        return other, other_direction
    one, two = np.array(direction), np.array(other_direction)
    across, same = _cross(one, two), abs(float(one @ two))
    if kind == other:
        if math.sqrt(float(across @ across)) <= STRAIGHT:
            return kind, direction
        return (moving.FIXED, (0.0, 0.0)) if kind == moving.ALONG else (moving.ALONG, _unit(across))
    line = direction if kind == moving.ALONG else other_direction
    return (moving.ALONG, line) if same <= STRAIGHT else (moving.FIXED, (0.0, 0.0))


def _cross(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    if len(one) == 2:
        return np.array([one[0] * two[1] - one[1] * two[0]])
    return np.array([one[k - 2] * two[k - 1] - one[k - 1] * two[k - 2] for k in range(3)])


def _unit(vector: np.ndarray) -> tuple[float, ...]:
    vector = np.where(np.abs(vector) <= STRAIGHT * np.abs(vector).max(), 0.0, vector)
    return tuple((vector / math.sqrt(float(vector @ vector))).tolist())


def acting(one: NodeCondition, dim: int) -> NodeCondition:
    """Components that a node with this condition prescribes, or its constraint, or both if they do not affect each
    other. Raises Contradiction if no motion satisfies them."""
    axes = "xyz"[:dim]
    given = [axis for axis in axes if getattr(one, f"does_{axis}") != moving.FREE]
    if one.constraint == moving.UNBOUND or not given:
        return one
    if one.constraint == moving.FIXED:
        for axis in given:
            if getattr(one, f"at_{axis}") != 0.0:
                raise Contradiction(f"{_constraint(one)} and {one.motion(axis)}")
        return _moved(one, {}, keep=True)
    return _on_a_line(one, given) if one.constraint == moving.ALONG else _in_a_plane(one, given)


def _constraint(one: NodeCondition) -> str:
    return _CONSTRAINTS[one.constraint].format(_vector(one.direction))


def _moved(one: NodeCondition, values: dict[str, tuple[int, Number]], keep: bool = False) -> NodeCondition:
    """The condition with these components (kind, value) prescribed and no others; keep: keep the constraint too."""
    changes: dict[str, Any] = {}
    for axis in "xyz":
        changes[f"does_{axis}"], changes[f"at_{axis}"] = values.get(axis, (moving.FREE, 0.0))
    if not keep:
        changes |= {"constraint": moving.UNBOUND, "direction": (0.0, 0.0)}
    return replace(one, **changes)


def _on_a_line(one: NodeCondition, given: list[str]) -> NodeCondition:
    direction = dict(zip("xyz", one.direction))
    assigned = {axis: (getattr(one, f"does_{axis}"), getattr(one, f"at_{axis}")) for axis in given}
    for axis, (_, value) in assigned.items():
        if direction[axis] == 0.0 and value != 0.0:
            raise Contradiction(f"{_constraint(one)} and {one.motion(axis)}")
    leading = [axis for axis in given if direction[axis] != 0.0]
    if not leading:
        return _moved(one, {}, keep=True)
    kinds = {assigned[axis][0] for axis in leading}
    alone = [axis for axis in direction if direction[axis] != 0.0]
    if len(alone) == 1:  # along an axis
        return _moved(one, {axis: assigned.get(axis, (assigned[leading[0]][0], 0.0)) for axis in direction})
    if len(kinds) > 1 or any(isinstance(assigned[axis][1], str) for axis in leading):
        if all(value == 0.0 for _, value in assigned.values()):
            return _moved(one, {axis: (moving.VELOCITY, 0.0) for axis in direction})
        raise Contradiction(
            f"{_constraint(one)} and {' and '.join(map(one.motion, leading))}: along an oblique line all "
            "prescribed components must be numbers of one kind (velocity or acceleration)"
        )
    first = max(leading, key=lambda axis: abs(direction[axis]))
    speed = float(assigned[first][1]) / direction[first]
    for axis in leading:
        if abs(float(assigned[axis][1]) - speed * direction[axis]) > STRAIGHT * abs(speed):
            raise Contradiction(f"{_constraint(one)} and {' and '.join(map(one.motion, given))}")
    kind = assigned[first][0]
    return _moved(
        one, {axis: (kind, assigned[axis][1] if axis in assigned else speed * direction[axis]) for axis in direction}
    )


def _in_a_plane(one: NodeCondition, given: list[str]) -> NodeCondition:
    normal = dict(zip("xyz", one.direction))
    assigned = {axis: (getattr(one, f"does_{axis}"), getattr(one, f"at_{axis}")) for axis in given}
    touched = [axis for axis in normal if normal[axis] != 0.0]
    if len(touched) == 1:  # across an axis
        (axis,) = touched
        if assigned.get(axis, (moving.FREE, 0.0))[1] != 0.0:
            raise Contradiction(f"{_constraint(one)} and {one.motion(axis)}")
        return _moved(one, {**assigned, axis: (moving.VELOCITY, 0.0)})
    known = [axis for axis in given if normal[axis] != 0.0]
    if not known:
        return one
    still = all(assigned[axis][1] == 0.0 for axis in known)
    kinds = {assigned[axis][0] for axis in known}
    if not still and (len(kinds) > 1 or any(isinstance(assigned[axis][1], str) for axis in known)):
        raise Contradiction(
            f"{_constraint(one)} and {' and '.join(map(one.motion, known))}: across an oblique vector all "
            "prescribed components must be numbers of one kind (velocity or acceleration)"
        )
    kind = assigned[known[0]][0]
    out = 0.0 if still else sum(normal[axis] * float(assigned[axis][1]) for axis in known)
    left = [axis for axis in touched if axis not in assigned]
    if not left:
        size = max(abs(normal[axis] * float(assigned[axis][1])) for axis in known) if not still else 0.0
        if abs(out) > STRAIGHT * size:
            raise Contradiction(f"{_constraint(one)} and {' and '.join(map(one.motion, known))}")
        return _moved(one, assigned)
    if len(left) == 1:
        return _moved(one, {**assigned, left[0]: (kind, -out / normal[left[0]] if out else 0.0)})
    if not still:
        raise Contradiction(
            f"{_constraint(one)} and {one.motion(known[0])}: in a plane oblique to that axis, "
            "prescribe the value 0 or a second component"
        )
    # One component is zero and the others lie in a plane: a line.
    along = _cross(np.array([float(axis == known[0]) for axis in "xyz"]), np.array(one.direction))
    rest = {axis: of for axis, of in assigned.items() if axis != known[0]}
    line = replace(_moved(one, rest, keep=True), constraint=moving.ALONG, direction=_unit(along))
    return acting(line, 3) if rest else line


def as_before(one: NodeCondition, dim: int) -> NodeCondition:
    """Conditions of files of versions in which a constraint preceded all others: what acted then."""
    try:
        acting(one, dim)
    except Contradiction:
        given = [getattr(one, f"at_{axis}") for axis in "xyz"[:dim]]
        if one.constraint == moving.ALONG and all(isinstance(value, float) for value in given):
            speed = sum(part * value for part, value in zip(one.direction, given))
            return _moved(one, {axis: (moving.VELOCITY, speed * part) for axis, part in zip("xyz", one.direction)})
        return _moved(one, {}, keep=True)
    return one


def together(rows: Sequence[NodeCondition], dim: int) -> NodeCondition:
    """Combine the conditions of the corners of one node. Raises Contradiction if no motion satisfies them."""
    found, kind, direction = NodeCondition(), moving.UNBOUND, (0.0, 0.0)
    for k, axis in enumerate("xyz"[:dim]):
        motion = _latest([one for one in rows if getattr(one, f"does_{axis}") != moving.FREE], 1 << k)
        force = _latest([one for one in rows if getattr(one, f"force_{axis}") != 0.0], 8 << k)
        for several, names in ((motion, ("does", "at")), (force, ("force", "side"))):
            values = [{f"{name}_{axis}": getattr(one, f"{name}_{axis}") for name in names} for one in several]
            compared = names if names[0] == "does" else names[:1]  # sides may share one force
            if len({tuple(one[f"{name}_{axis}"] for name in compared) for one in values}) > 1:
                conflicts = dict.fromkeys(one.motion(axis) if names[0] == "does" else one.push(axis) for one in several)
                raise Contradiction(" and ".join(conflicts))
            found = replace(found, **values[0] if values else {})
    for one in rows:
        kind, direction = bound(kind, direction, one.constraint, one.direction, dim)  # type: ignore[assignment]
    return replace(found, constraint=kind, direction=direction, damp=max(one.damp for one in rows))


def _latest(assigned: list[NodeCondition], bit: int) -> list[NodeCondition]:
    """Conditions that are not older than others, else all."""
    return [one for one in assigned if not one.older & bit] or assigned

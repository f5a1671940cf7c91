"""Conditions of nodes and tractions on faces: rows of tables, and the row of each corner or face."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.memory import sparse_zeros
from hpcdem.physics.fdem import node_conditions, sides, user_functions
from hpcdem.physics.fdem.assignments import COMPONENTS
from hpcdem.physics.fdem.initial_stress import InitialStress
from hpcdem.physics.fdem.kernels import nodes as moving
from hpcdem.physics.fdem.kernels import space
from hpcdem.physics.fdem.node_conditions import Contradiction, NodeCondition, Number
from hpcdem.physics.fdem.topology import Numbers, place

TRACTIONS = {
    2: ("xx", "yy", "xy", "normal", "incoming_x", "incoming_y", "dip"),
    3: ("xx", "yy", "xy", "normal", "zz", "xz", "yz", "incoming_x", "incoming_y", "incoming_z"),
}  # fmt: skip
"""Columns of the table of tractions."""


@dataclass(frozen=True)
class Traction:
    """Stress on faces [Pa]: components, along the normal, and in the plane along the face (dip), counter-clockwise
    about the body. quiet: waves leave through the face; incoming_x, _y, _z: the velocity of one that comes in through
    it [m/s]."""

    xx: Number = 0.0
    yy: Number = 0.0
    xy: Number = 0.0
    normal: Number = 0.0
    quiet: bool = False
    incoming_x: Number = 0.0
    incoming_y: Number = 0.0
    zz: Number = 0.0
    xz: Number = 0.0
    yz: Number = 0.0
    incoming_z: Number = 0.0
    dip: Number = 0.0


@dataclass(frozen=True)
class Relaxation:
    """Forces that elements which were removed leave behind: corners (element * 4 + k), forces (n, 2) [N/m], from
    when on and for how long they die down (model time, or steps in static mode)."""

    corner: np.ndarray
    force: np.ndarray
    begin: float
    span: float
    in_steps: bool


class Conditions(InitialStress):
    """Conditions of nodes and faces. Methods that assign raise CommandError, alike on all ranks, and then change
    nothing."""

    def clear_conditions(self) -> None:
        """Remove all conditions."""
        self.conditions: list[NodeCondition] = [NodeCondition()]
        self.loads: list[Traction] = [Traction()]
        self.relaxations: list[Relaxation] = []
        self.sided = False
        """Conditions were assigned to single sides of points: corners of one node may have different rows."""
        self._acting: list[NodeCondition] | None = None
        self._make_conditions(0)

    def _make_conditions(self, elements: int) -> None:
        self.corner_row = sparse_zeros(4 * elements, np.int32)
        """Rows of conditions of corners; corners that are one node have the combination of theirs (`rows_of_nodes`)."""
        self.load_row = sparse_zeros(4 * elements, np.int32)

    def remove_table(self, name: str) -> None:
        """Delete a table; CommandError while a condition uses it."""
        if name not in self.tables:
            raise CommandError(f"there is no table '{name}'")
        if name in self.followed_tables():
            raise CommandError(f"table '{name}' is used by a boundary condition")
        # Rows that nothing follows any more are evaluated with the others.
        self.conditions = [NodeCondition() if name in asdict(one).values() else one for one in self.conditions]
        self.loads = [Traction() if name in asdict(one).values() else one for one in self.loads]
        self._acting = None
        del self.tables[name]

    def followed_tables(self) -> list[str]:
        """Tables over time that conditions of nodes and faces follow."""
        used: set[str] = set()
        of_both: list[tuple[list[Any], np.ndarray]] = [
            (self.conditions, self.corner_row), (self.loads, self.load_row)
        ]  # fmt: skip
        for rows, column in of_both:
            for row, one in enumerate(rows):
                texts = {value for value in asdict(one).values() if isinstance(value, str)}
                if texts and (column == row).any():
                    used |= texts
        return [name for name in self.tables if name in used]

    def velocity_condition(
        self,
        nodes: Numbers,
        vx: Number | None = None,
        vy: Number | None = None,
        ax: Number | None = None,
        ay: Number | None = None,
        vz: Number | None = None,
        az: Number | None = None,
    ) -> None:
        """Prescribe velocity [m/s] or acceleration [m/s2] of components; the others stay as they are (free or not).

        Of one component the last one said counts; CommandError if it contradicts a move constraint of the node."""
        changes: dict[str, Any] = {}
        self._only_in_space("velocity or acceleration in z", vz, az)
        for axis, speed, push in (("x", vx, ax), ("y", vy, ay), ("z", vz, az)):
            if speed is not None and push is not None:
                raise CommandError(f"velocity and acceleration in {axis} cannot both be prescribed")
            if speed is not None:
                changes[f"does_{axis}"], changes[f"at_{axis}"] = moving.VELOCITY, self._value(f"velocity {axis}", speed)
            if push is not None:
                changes[f"does_{axis}"] = moving.ACCELERATION
                changes[f"at_{axis}"] = self._value(f"acceleration {axis}", push)
        if not changes:
            raise CommandError("a velocity condition needs a velocity or an acceleration")
        self._condition(nodes, changes)

    def force_condition(
        self, nodes: Numbers, fx: Number | None = None, fy: Number | None = None, fz: Number | None = None
    ) -> None:
        """Nodal force [N per m of thickness, in space N] of a point, shared by the elements' corners there."""
        self._only_in_space("a force in z", fz)
        given = {"force_x": fx, "force_y": fy, "force_z": fz}
        changes = {name: self._value(name, value) for name, value in given.items() if value is not None}
        if not changes:
            raise CommandError("a force condition needs a force")
        self._condition(nodes, changes)

    def move_constraint(self, nodes: Numbers, kind: int, direction: tuple[float, ...] = (0.0, 0.0)) -> None:
        """1: fixed, 2: moves along `direction` only, 3 (in space): only across it; besides constraints that are there
        already. 0: takes them back."""
        if kind == space.ACROSS and self.dim == 2:
            raise CommandError("a move constraint of type 3 (across a vector) is for three dimensions")
        if kind not in (moving.UNBOUND, moving.FIXED, moving.ALONG, space.ACROSS):
            raise CommandError(f"a move constraint is 0 (free), 1 (fixed), 2 or 3 (along, across a vector), got {kind}")
        unit: tuple[float, ...] = (0.0, 0.0)
        if kind in (moving.ALONG, space.ACROSS):
            vector = self._vector("direction", direction).tolist()
            if not any(vector):
                raise CommandError("a move constraint along a vector needs a vector that is not zero")
            unit = tuple(c / math.hypot(*vector) for c in vector)
        self._condition(nodes, {"constraint": kind, "direction": unit})

    def _condition(self, nodes: Any, changes: dict[str, Any]) -> None:
        chosen = self.corners_of_nodes(nodes)
        mesh, at = self._mesh(), np.flatnonzero(chosen)
        points = np.unique(mesh.cells.reshape(-1)[at])
        for name, value in changes.items():
            user_functions.check(name, value, mesh.points[points], self.time_now())
        some = nodes is not None and sides.are_there(np.asarray(nodes).reshape(-1))
        node = self.clusters()[0].reshape(-1) if some or self.sided else None
        if some and node is not None and _takes_back(changes):
            at = np.flatnonzero(self.with_nodes(chosen, node))
        self.before_change()

        def say() -> tuple[list[NodeCondition], bool, np.ndarray]:
            rows, column, sided = self.conditions.copy(), self.corner_row[at], self.sided
            others = np.flatnonzero(self.with_nodes(chosen, node) & ~chosen) if node is not None else at[:0]
            others = others[self.corner_row[others] > 0]
            before = self.corner_row[others]
            try:
                self._say(at, changes, some)
                self._make_older(others, changes)
                self.sided |= some
                self._acting = None
                if node is not None:
                    self._together(np.unique(node[at]), node)
            except CommandError:
                self.conditions, self.sided, self._acting = rows, sided, None
                self.corner_row[at], self.corner_row[others] = column, before
                raise
            return self.conditions, self.sided, self.corner_row

        self.conditions, self.sided, self.corner_row = self.per_node(say)
        self._acting = None
        self.changed(stiffness=False)

    def _say(self, at: np.ndarray, changes: dict[str, Any], some: bool) -> None:
        """Corners (n,) get these conditions; some: sides of points."""
        forces = [name[-1] for name in changes if name.startswith("force")]
        clear = sum(
            (1 << k) * (f"does_{axis}" in changes) | (8 << k) * (axis in forces) for k, axis in enumerate("xyz")
        )
        old, side = self.corner_row[at], np.zeros(len(at), np.int64)
        if some and forces:
            side = self._new_sides(at, forces)
        more = np.zeros(len(at), bool)
        for row, number in np.unique(np.column_stack([old, side]), axis=0).tolist():
            one, mine = self.conditions[row], (old == row) & (side == number)
            wanted = replace(one, **changes, older=one.older & ~clear, **{f"side_{axis}": number for axis in forces})
            if changes.get("constraint"):
                kind, direction = node_conditions.bound(
                    one.constraint, one.direction, wanted.constraint, wanted.direction, self.dim
                )
                more |= mine & ((kind, direction) != (wanted.constraint, wanted.direction))
                wanted = replace(wanted, constraint=kind, direction=direction)
            self._checked(wanted, at[mine])
            self.corner_row[at[mine]] = _row_of(self.conditions, wanted)
        if more.any():
            count = len(np.unique(self._mesh().cells.reshape(-1)[at[more]]))
            self.note(
                f"{count} of these nodes have a move constraint already, which remains in force (type 0 removes "
                "constraints)"
            )

    def _new_sides(self, at: np.ndarray, forces: Sequence[str]) -> np.ndarray:
        """(n,) numbers of the side that corners are for forces along axes, which they share: one that no other corner
        at the point has."""
        cells = self._mesh().cells.reshape(-1)
        has = self.corner_row > 0
        has[at] = False
        others = np.flatnonzero(has)
        sides = np.array([max(getattr(one, f"side_{axis}") for axis in forces) for one in self.conditions])
        most = np.zeros(len(self._mesh().points), np.int64)
        np.maximum.at(most, cells[others], sides[self.corner_row[others]])
        return 1 + most[cells[at]]

    def _make_older(self, others: np.ndarray, changes: dict[str, Any]) -> None:
        """Overrule earlier assignments at other corners of these nodes, as long as the corners are one node."""
        for row in np.unique(self.corner_row[others]).tolist():
            one, older = self.conditions[row], 0
            for k, axis in enumerate("xyz"):
                if changes.get(f"does_{axis}") and getattr(one, f"does_{axis}"):
                    older |= 1 << k
                if f"force_{axis}" in changes and getattr(one, f"force_{axis}") != 0.0:
                    older |= 8 << k
            if older & ~one.older:
                new = _row_of(self.conditions, replace(one, older=one.older | older))
                self.corner_row[others[self.corner_row[others] == row]] = new

    def _checked(self, one: NodeCondition | Sequence[NodeCondition], at: np.ndarray) -> NodeCondition:
        """Combine this condition, or those of one node. CommandError, with the position of the first of these corners,
        if no motion satisfies them."""
        try:
            one = one if isinstance(one, NodeCondition) else node_conditions.together(one, self.dim)
            return node_conditions.acting(one, self.dim)
        except Contradiction as error:
            mesh = self._mesh()
            point = int(mesh.cells.reshape(-1)[at[0]])
            raise CommandError(
                f"conditions contradict each other at node {point} at {place(mesh.points[point])}: {error}. Remove one "
                "of them first (node boundary remove, or type 0 of a move constraint), or exclude it by the range"
            ) from None

    def acting(self) -> list[NodeCondition]:
        """Combined conditions by row (`rows_of_nodes`). Read-only."""
        if self._acting is None:
            self._acting = [node_conditions.acting(one, self.dim) for one in self.conditions]
            self._of_sides: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        return self._acting

    def rows_of_nodes(self, corners: np.ndarray, node: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of `acting` of the nodes of corners (n,), and what part of a force falls on each (n,), NaN where that is
        the part of the corners at the point. node (ne, 4): of all corners. CommandError if conditions of corners that
        are one node contradict each other."""
        self.acting()
        row, part = self.corner_row[corners].astype(np.int64), np.full(len(corners), np.nan)
        if self.sided:
            node = node.reshape(-1)
            if self._of_sides is None:
                held = np.flatnonzero((self.corner_row > 0) & (node >= 0))
                self._of_sides = self._together(np.unique(node[held]), node)
            numbers, rows, parts = self._of_sides
            if len(numbers):
                at = np.minimum(np.searchsorted(numbers, node[corners]), len(numbers) - 1)
                found = numbers[at] == node[corners]
                row[found], part[found] = rows[at[found]], parts[at[found]]
        return row, part

    def _together(self, nodes: np.ndarray, node: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Find the rows of `acting` and the parts of these nodes, see `rows_of_nodes`; node (4 ne,): of all corners."""
        acting, cells = self.acting(), self._mesh().cells.reshape(-1)
        some = np.zeros(int(node.max(initial=-1)) + 2, bool)
        some[nodes[nodes >= 0]] = True
        at = np.flatnonzero(some[node])
        at = at[np.argsort(node[at], kind="stable")]
        nodes, begin = np.unique(node[at], return_index=True)
        if not len(nodes):
            return nodes, nodes, np.empty(0)
        of = self.corner_row[at]
        rows, part = np.minimum.reduceat(of, begin).astype(np.int64), np.full(len(nodes), np.nan)
        of_side = np.array([bool(one.side_x or one.side_y or one.side_z) for one in self.conditions])
        several = np.flatnonzero((rows != np.maximum.reduceat(of, begin)) | of_side[rows])
        beside = np.zeros(len(self._mesh().points), bool)
        beside[cells[at[begin[several]]]] = True
        beside = np.flatnonzero((node >= 0) & beside[cells])
        beside = beside[np.argsort(cells[beside], kind="stable")]
        end = np.append(begin[1:], len(at))
        for i in several.tolist():
            mine = at[begin[i] : end[i]]
            point = cells[mine[0]]
            peers = beside[np.searchsorted(cells[beside], point) : np.searchsorted(cells[beside], point, "right")]
            conditions = [self.conditions[row] for row in np.unique(self.corner_row[mine]).tolist()]
            one = self._checked(conditions, mine)
            parts: dict[str, Any] = {}
            for axis in "xyz"[: self.dim]:
                if getattr(one, f"force_{axis}") != 0.0:
                    share = [self._shares(corners, axis, one) for corners in (mine, peers)]
                    parts[f"part_{axis}"] = share[0] / share[1]
            rows[i], part[i] = _row_of(acting, replace(one, older=0, **parts)), 1.0
        return nodes, rows, part

    def _shares(self, corners: np.ndarray, axis: str, one: NodeCondition) -> int:
        """Number of these corners that share the force of a node along an axis."""
        rows = [self.conditions[row] for row in self.corner_row[corners].tolist()]
        wanted = getattr(one, f"force_{axis}"), getattr(one, f"side_{axis}")
        return sum((getattr(of, f"force_{axis}"), getattr(of, f"side_{axis}")) == wanted for of in rows)

    def damp_nodes(self, nodes: Numbers, alpha: float) -> None:
        """Local damping of nodes: what drives one is less by this part of its size against its motion. It takes the
        place of that of the model, 0.8 in static mode and 0 in dynamic runs."""
        if not 0.0 <= alpha <= 1.0:
            raise CommandError(f"local damping lies from 0 to 1, got {alpha:g}")
        self._condition(nodes, {"damp": float(alpha)})
        self.changed()

    def safety(self) -> float:
        """Part of the stability limit that is taken: local damping makes a force against the motion 1 + alpha times as
        large."""
        return self.options.safety / math.sqrt(1.0 + self.most_damped())

    def most_damped(self) -> float:
        """The largest local damping that a node has of its own."""
        damped = [one.damp for row, one in enumerate(self.conditions) if one.damp and (self.corner_row == row).any()]
        return max([0.0, *damped])

    def stress_condition(
        self,
        faces: Numbers,
        xx: Number | None = None,
        yy: Number | None = None,
        xy: Number | None = None,
        normal: Number | None = None,
        quiet: bool | None = None,
        incoming_x: Number | None = None,
        incoming_y: Number | None = None,
        zz: Number | None = None,
        xz: Number | None = None,
        yz: Number | None = None,
        incoming_z: Number | None = None,
        dip: Number | None = None,
    ) -> None:
        """Traction t = sigma n [Pa] on the current face, n its current outward normal, plus `normal` n (negative:
        pressure), plus, in the plane, `dip` along the face, counter-clockwise about the body.

        quiet: besides, dashpots of the impedances rho c_p along n and rho c_s across take up what arrives (Lysmer and
        Kuhlemeyer 1969): plane waves along n leave without reflection, a stress that is given enters as a wave of half
        its size. They act in dynamic runs; the static stage needs the stress that the ground beyond would give.
        incoming_x, incoming_y, incoming_z [m/s]: velocity of a plane wave along n that comes in through quiet faces:
        their dashpots see the velocity less twice this."""
        self._only_in_space("stress zz, xz, yz or incoming z of faces", zz, xz, yz, incoming_z)
        if dip is not None and self.dim == 3:
            raise CommandError("dip is for two dimensions: in three use stress-xy, -xz and -yz for shear on faces")
        given = {"xx": xx, "yy": yy, "xy": xy, "normal": normal, "zz": zz, "xz": xz, "yz": yz, "dip": dip}
        changes = {name: self._value(f"stress {name}", value) for name, value in given.items() if value is not None}
        waves = {"incoming_x": incoming_x, "incoming_y": incoming_y, "incoming_z": incoming_z}
        changes |= {name: self._value(name, value) for name, value in waves.items() if value is not None}
        if quiet is not None:
            changes["quiet"] = bool(quiet)
        if not changes:
            raise CommandError("a stress condition needs a stress, or quiet")
        at = self.numbers_of_faces(faces)
        for row in np.unique(self.load_row[at]).tolist():
            wanted = replace(self.loads[row], **changes)
            if not wanted.quiet and any(getattr(wanted, name) != 0.0 for name in waves):
                axes = " and ".join(f"incoming-{axis}" for axis in "xyz"[: self.dim])
                raise CommandError(f"waves enter through quiet faces only: add quiet on to {axes}")
        middles = self._mesh().points[self._mesh().face_points(at)].mean(axis=1)
        for name, value in changes.items():
            user_functions.check(f"stress {name}", value, middles, self.time_now())
        self.before_change()

        def say() -> tuple[list[Traction], np.ndarray]:
            change_rows(self.loads, self.load_row, at, changes)
            return self.loads, self.load_row

        self.loads, self.load_row = self.per_node(say)
        self.changed(stiffness=quiet is not None)  # dashpots limit the time step

    def remove_conditions(self, nodes: Numbers = None, kinds: Sequence[str] = node_conditions.KINDS) -> None:
        """Take back velocities and accelerations, forces, constraints of nodes (these kinds); None: of all, those too
        that have no element at this moment."""
        at = self.corners_of_nodes(nodes, whole=True) if nodes is not None else slice(None)
        self.before_change()

        def take_back() -> tuple[list[NodeCondition], np.ndarray]:
            column = self.corner_row[at]
            for row in np.unique(column).tolist():
                left = node_conditions.without(self.conditions[row], kinds)
                column[self.corner_row[at] == row] = _row_of(self.conditions, left)
            self.corner_row[at] = column
            return self.conditions, self.corner_row

        self.conditions, self.corner_row = self.per_node(take_back)
        self._acting = None
        self.changed(stiffness=False)

    def remove_stress_conditions(self, faces: Numbers = None) -> None:
        """Take back tractions of faces."""
        at = self.numbers_of_faces(faces)
        self.before_change()
        was_quiet = bool(self.quiet_faces()[at].any())
        self.load_row[at] = 0
        self.changed(stiffness=was_quiet)

    def conditions_at(self, time: float, middle: float, dt: float) -> np.ndarray:
        """The table of what node conditions come to (rows, 10), in space (rows, 14), at a moment: forces at `time`,
        velocities in the middle of the step; accelerations as change of velocity over dt."""
        plane = self.dim == 2
        out = np.zeros((len(self.acting()), moving.CONDITION if plane else space.CONDITION))
        does = (moving.DOES_X, moving.DOES_Y) if plane else range(space.DOES, space.DOES + 3)
        at = (moving.AT_X, moving.AT_Y) if plane else range(space.AT, space.AT + 3)
        force, constraint = (moving.FORCE_X, moving.CONSTRAINT) if plane else (space.FORCE, space.CONSTRAINT)
        first = moving.DIRECTION_X if plane else space.WAY
        for row, one in enumerate(self.acting()):
            for k, axis in enumerate("xyz"[: self.dim]):
                kind, value = getattr(one, f"does_{axis}"), getattr(one, f"at_{axis}")
                out[row, does[k]] = kind
                if kind == moving.VELOCITY:
                    out[row, at[k]] = self._now(value, middle)
                elif kind == moving.ACCELERATION:
                    out[row, at[k]] = self._now(value, time) * dt
                out[row, force + k] = self._now(getattr(one, f"force_{axis}"), time) * getattr(one, f"part_{axis}")
            out[row, constraint], out[row, moving.DAMP if plane else space.NODE_DAMP] = one.constraint, one.damp
            out[row, first : first + len(one.direction)] = one.direction
        return out

    def conditions_vary(self) -> bool:
        """Return whether a node condition follows a table or a function."""
        return any(isinstance(value, str) for one in self.acting() for value in asdict(one).values())

    def loads_at(self, time: float) -> np.ndarray:
        """The table of tractions at a moment, columns `TRACTIONS`."""
        names = TRACTIONS[self.dim]
        return np.array([[self._now(getattr(one, name), time) for name in names] for one in self.loads])

    def stressed(self, faces: np.ndarray) -> np.ndarray:
        """Flag the faces (k,) bool on which a stress is prescribed, counting all loads there."""
        names = ("normal", "dip", *COMPONENTS[self.dim])
        rows = [any(getattr(one, name) != 0.0 for name in names) for one in self.loads]
        return np.array(rows)[self.load_row[faces]]

    def quiet_faces(self) -> np.ndarray:
        """(4 ne,) bool: faces with dashpots."""
        quiet = np.array([one.quiet for one in self.loads])
        return self._of_rows(quiet, self.load_row, lambda: np.ones(1, bool))


def change_rows(rows: list, column: np.ndarray, at: np.ndarray, changes: dict[str, Any]) -> None:
    """Give objects `at` rows with these changes, which are added where missing."""
    old = column[at]
    for row in np.unique(old).tolist():
        column[at[old == row]] = _row_of(rows, replace(rows[row], **changes))


def _row_of(rows: list, wanted: Any) -> int:
    """The row of this one, a new one if missing."""
    if wanted not in rows:
        rows.append(wanted)
    return rows.index(wanted)


def _takes_back(changes: Mapping[str, Any]) -> bool:
    """Return whether a change removes a condition, which then applies to the whole node."""
    return changes.get("constraint") == moving.UNBOUND or any(
        name.startswith("force") and value == 0.0 for name, value in changes.items()
    )

"""What a model of blocks is made of: mesh, models of elements, faces and joints, boundary conditions, options.

All of it is known to every rank, by the numbers of the mesh: what is said once is the same everywhere, whoever owns an
element. What moves is in `simulation.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from hpcdem.errors import CommandError, HpcdemError
from hpcdem.model.blocks import connectivity, properties
from hpcdem.model.blocks import mesh as meshes
from hpcdem.model.blocks.mesh import Mesh
from hpcdem.model.blocks.properties import ELEMENT, FACE, JOINT, MODULI, Rows
from hpcdem.model.blocks.tables import Table
from hpcdem.physics.fdem import nodes as moving

Numbers = np.ndarray | Sequence[int] | None
"""Numbers of elements, nodes, faces or joints; None: all."""
Number = float | str
"""A value of a boundary condition: a number, or the name of a table of values over model time."""

SAFETY = 0.8
"""Part of the stability limit that is used as time step."""


@dataclass(frozen=True)
class NodeCondition:
    """What is prescribed at nodes. does_x, does_y: moving.FREE, VELOCITY, ACCELERATION; at_x, at_y: its value; force;
    constraint (moving.UNBOUND, ...) and its unit vector."""

    does_x: int = moving.FREE
    at_x: Number = 0.0
    does_y: int = moving.FREE
    at_y: Number = 0.0
    force_x: Number = 0.0
    force_y: Number = 0.0
    constraint: int = moving.UNBOUND
    way: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Traction:
    """Stress on faces [Pa]: components, and along the normal."""

    xx: Number = 0.0
    yy: Number = 0.0
    xy: Number = 0.0
    normal: Number = 0.0


@dataclass(frozen=True)
class Options:
    """Switches and numbers of the whole model, see `Blocks`. dt: the user's time step [s], 0 if estimated."""

    gx: float = 0.0
    gy: float = 0.0
    dynamic: bool = True
    collision: bool = True
    large_strain: bool = True
    dt: float = 0.0
    auto: bool = False
    safety: float = SAFETY
    mass_scaling: float = 0.0


@dataclass
class Fading:
    """Forces that elements which were taken out leave behind: corners (element * 4 + k), forces (n, 2) [N/m], from
    when on and for how long they die down (model time, or steps in static mode)."""

    corner: np.ndarray
    force: np.ndarray
    begin: float
    span: float
    in_steps: bool


class Scene:
    """Mesh and assignments. Methods that assign raise CommandError, alike on all ranks, and change nothing then."""

    def __init__(self) -> None:
        self.clear_scene()

    def clear_scene(self) -> None:
        """Nothing is there."""
        self.mesh: Mesh | None = None
        self.options = Options()
        self.tables: dict[str, Table] = {}
        self.element_rows, self.face_rows, self.joint_rows = Rows(), Rows(), Rows()
        self.conditions: list[NodeCondition] = [NodeCondition()]
        self.loads: list[Traction] = [Traction()]
        self.fading: list[Fading] = []
        self._closed: np.ndarray | None = None
        self._make_arrays(0, 0)

    def _make_arrays(self, elements: int, points: int) -> None:
        self.partner = np.full(4 * elements, -1, np.int64)
        self.alive = np.ones(elements, bool)
        """Elements that were not taken out."""
        self.element_row = np.zeros(elements, np.int32)
        self.joint_row = np.zeros(4 * elements, np.int32)
        """Of both faces of a joint."""
        self.open = np.zeros(4 * elements, bool)
        """Faces that do not hold on to their partner (any more): broken, cracked, or the partner was taken out."""
        self.broken = np.zeros(4 * elements, np.uint8)
        """By the lower face: 1 if the joint broke."""
        self.face_row = np.zeros(4 * elements, np.int32)
        self.point_row = np.zeros(points, np.int32)
        self.load_row = np.zeros(4 * elements, np.int32)
        self.stress0: np.ndarray | None = None
        """(elements, 4) xx, yy, xy, zz [Pa] at zero strain, if there is any."""

    # What the simulation does when something has changed.

    def _before_change(self) -> None:
        """Assignments are about to change."""

    def _changed(self, topology: bool = False, stiffness: bool = True) -> None:
        """Assignments have changed; topology: also who hangs together with whom; stiffness: perhaps the stable time
        step too."""

    # ---- numbers -------------------------------------------------------------------------------------------------

    def _mesh(self) -> Mesh:
        if self.mesh is None:
            raise CommandError("there is no mesh yet")
        return self.mesh

    def numbers_of_elements(self, elements: Any) -> np.ndarray:
        """Checked element numbers, ascending; None: all that are there. CommandError for others."""
        return self._numbers(elements, self.alive, "element")

    def numbers_of_nodes(self, nodes: Any) -> np.ndarray:
        """Checked node numbers (points of the mesh); None: all."""
        return self._numbers(nodes, np.ones(len(self._mesh().points), bool), "node")

    def numbers_of_faces(self, faces: Any) -> np.ndarray:
        """Checked face numbers; None: all faces of elements that are there."""
        return self._numbers(faces, self.face_exists(), "face")

    def numbers_of_joints(self, joints: Any) -> np.ndarray:
        """Checked numbers of inner edges (lower faces); None: all between elements that are there."""
        face = np.arange(len(self.partner))
        inner = (self.partner > face) & self.alive[face // 4]
        inner[inner] &= self.alive[self.partner[inner] // 4]
        return self._numbers(joints, inner, "joint (the lower face of an inner edge)")

    def face_exists(self) -> np.ndarray:
        """(4 ne,) bool."""
        exists = np.repeat(self.alive, 4)
        exists[3::4] &= self._mesh().cells[:, 3] >= 0
        return exists

    def _numbers(self, given: Any, there: np.ndarray, what: str) -> np.ndarray:
        self._mesh()
        if given is None:
            return np.flatnonzero(there)
        asked = np.asarray(given)
        if asked.dtype == bool or (asked.size and not np.issubdtype(asked.dtype, np.integer)):
            raise CommandError(f"numbers of {what}s must be integers, got {asked.dtype}")
        asked = np.unique(asked.astype(np.int64).reshape(-1))
        bad = asked[(asked < 0) | (asked >= len(there))]
        if not len(bad):
            bad = asked[~there[asked]]
        if len(bad):
            raise CommandError(f"there is no {what} {bad[0]}")
        return asked

    # ---- mesh ----------------------------------------------------------------------------------------------------

    def _take(self, mesh: Mesh) -> None:
        try:
            meshes.check(mesh)
        except HpcdemError as error:
            raise CommandError(str(error)) from None
        self._put(mesh)

    def _put(self, mesh: Mesh) -> None:
        kept = self.options, self.tables
        self.clear_scene()
        self.options, self.tables = kept
        self.mesh = mesh
        self._make_arrays(len(mesh.cells), len(mesh.points))
        self.partner = connectivity.face_partners(mesh.cells, len(mesh.points))
        if len(mesh.cracks):
            rows = meshes.crack_rows(mesh, mesh.edges())
            self._open_faces(mesh.edges().faces[rows, 0])

    def _open_faces(self, lower: np.ndarray) -> None:
        for faces in (lower, self.partner[lower]):
            self.open[faces] = True
            if self._closed is not None:
                self._closed[faces] = False

    def closed_faces(self) -> np.ndarray:
        """(4 ne,) bool: faces that hang together with their partner, by a joint or as one body. Not to be changed."""
        if self._closed is None:
            self._closed = (self.partner >= 0) & ~self.open
        return self._closed

    # ---- models --------------------------------------------------------------------------------------------------

    def element_model(self, elements: Numbers, name: str, properties: Mapping[str, float]) -> None:
        """Assign a model (model.blocks.properties) with all its properties to elements."""
        self._assign(self.element_rows, self.element_row, self.numbers_of_elements(elements), ELEMENT, name, properties)

    def element_property(self, elements: Numbers, properties: Mapping[str, float]) -> None:
        """Change some properties of elements that have a model. The stress follows the strain (total form)."""
        at = self.numbers_of_elements(elements)
        self._adjust(self.element_rows, self.element_row, at, "element", properties, _keep_moduli)

    def face_model(self, faces: Numbers, name: str, properties: Mapping[str, float]) -> None:
        """Assign a contact model to faces, also to those that will be free only when a joint breaks."""
        self._assign(self.face_rows, self.face_row, self.numbers_of_faces(faces), FACE, name, properties)

    def face_property(self, faces: Numbers, properties: Mapping[str, float]) -> None:
        """Change some properties of the contact model of faces."""
        self._adjust(self.face_rows, self.face_row, self.numbers_of_faces(faces), "face", properties)

    def joint_model(self, joints: Numbers, name: str, properties: Mapping[str, float]) -> None:
        """Assign a cohesive model to inner edges: elements on both sides get nodes of their own, tied by tractions.

        Joints that are broken stay broken. None: all inner edges."""
        at = self.numbers_of_joints(joints)
        self._assign(
            self.joint_rows, self.joint_row, np.concatenate([at, self.partner[at]]), JOINT, name, properties, True
        )

    def joint_property(self, joints: Numbers, properties: Mapping[str, float]) -> None:
        """Change some properties of joints that have a model; None: of all that have one."""
        if joints is None:
            joints = np.flatnonzero((self.joint_row > 0) & (self.partner > np.arange(len(self.partner))))
        at = self.numbers_of_joints(joints)
        self._adjust(self.joint_rows, self.joint_row, np.concatenate([at, self.partner[at]]), "joint", properties)

    def _assign(
        self, rows: Rows, column: np.ndarray, at: np.ndarray, on: str, name: str, given: Mapping[str, float],
        topology: bool = False,
    ) -> None:  # fmt: skip
        model = properties.model(name, on)
        values = model.complete(given)
        self._before_change()
        column[at] = rows.row(model, values)
        self._changed(topology)

    def _adjust(
        self, rows: Rows, column: np.ndarray, at: np.ndarray, what: str, given: Mapping[str, float],
        keep: Callable[[dict[str, float], Mapping[str, float]], dict[str, float]] | None = None,
    ) -> None:  # fmt: skip
        bare = at[column[at] == 0]
        if len(bare):
            raise CommandError(f"{what} {bare[0]} has no model whose properties could be changed")
        changed = {}
        for row in np.unique(column[at]).tolist():
            model, old = properties.MODELS[rows.name(row)], rows.values(row)
            for name in given:
                model.property(name)
            values = keep(old, given) if keep else {**old, **given}
            changed[row] = model, model.complete(values)
        self._before_change()
        old_rows = column[at]
        for row, (model, values) in changed.items():
            column[at[old_rows == row]] = rows.row(model, values)
        self._changed()

    def initial_stress(
        self,
        elements: Numbers,
        xx: float = 0.0,
        yy: float = 0.0,
        xy: float = 0.0,
        zz: float = 0.0,
        gradient: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        """Stress [Pa] at zero strain, tension positive; gradient: component -> (per m in x, per m in y) at the centroid
        as it lies in the mesh."""
        at = self.numbers_of_elements(elements)
        mesh = self._mesh()
        names = ("xx", "yy", "xy", "zz")
        values = np.tile(_finite("initial stress", [xx, yy, xy, zz]), (len(at), 1))
        for name, slope in (gradient or {}).items():
            if name not in names:
                raise CommandError(f"a stress gradient is one of {', '.join(names)}, got {name}")
            centre = connectivity.centroids(mesh.points, mesh.cells[at])
            values[:, names.index(name)] += centre @ _finite(f"gradient of {name}", list(slope))
        self._before_change()
        if self.stress0 is None:
            self.stress0 = np.zeros((len(mesh.cells), 4))
        self.stress0[at] = values
        self._changed()

    # ---- boundary conditions -------------------------------------------------------------------------------------

    def table(self, name: str, pairs: Sequence[tuple[float, float]]) -> None:
        """Make or replace a table of (time [s], value)."""
        made = Table.of(pairs, name)
        self._before_change()
        self.tables[name] = made
        self._changed(stiffness=False)

    def remove_table(self, name: str) -> None:
        """Delete a table; CommandError while a condition uses it."""
        if name not in self.tables:
            raise CommandError(f"there is no table '{name}'")
        used_conditions = {self.conditions[r] for r in np.unique(self.point_row)}
        used_loads = {self.loads[r] for r in np.unique(self.load_row)}
        for one in (*used_conditions, *used_loads):
            if name in asdict(one).values():
                raise CommandError(f"table '{name}' is used by a boundary condition")
        del self.tables[name]

    def _value(self, what: str, value: Number) -> Number:
        if isinstance(value, str):
            if value not in self.tables:
                known = ", ".join(f"'{n}'" for n in self.tables) or "none"
                raise CommandError(f"{what}: there is no table '{value}' (tables: {known})")
            return value
        return float(_finite(what, [value])[0])

    def velocity_condition(
        self,
        nodes: Numbers,
        vx: Number | None = None,
        vy: Number | None = None,
        ax: Number | None = None,
        ay: Number | None = None,
    ) -> None:
        """Prescribe velocity [m/s] or acceleration [m/s2] of components; the others stay as they are (free or not).

        Precedence at one node: move constraint, velocity, acceleration, force."""
        changes: dict[str, Any] = {}
        for axis, speed, push in (("x", vx, ax), ("y", vy, ay)):
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

    def force_condition(self, nodes: Numbers, fx: Number | None = None, fy: Number | None = None) -> None:
        """Nodal force [N per m of thickness] of a point, shared by the elements' corners there."""
        given = {"force_x": fx, "force_y": fy}
        changes = {name: self._value(name, value) for name, value in given.items() if value is not None}
        if not changes:
            raise CommandError("a force condition needs a force")
        self._condition(nodes, changes)

    def move_constraint(self, nodes: Numbers, kind: int, direction: tuple[float, float] = (0.0, 0.0)) -> None:
        """0: free, 1: fixed, 2: moves along `direction` only."""
        if kind not in (moving.UNBOUND, moving.FIXED, moving.ALONG):
            raise CommandError(f"a move constraint is 0 (free), 1 (fixed) or 2 (along a vector), got {kind}")
        way = (0.0, 0.0)
        if kind == moving.ALONG:
            x, y = _finite("direction", list(direction)).tolist()
            if x == 0.0 == y:
                raise CommandError("a move constraint along a vector needs a vector that is not zero")
            way = (x / math.hypot(x, y), y / math.hypot(x, y))
        self._condition(nodes, {"constraint": kind, "way": way})

    def _condition(self, nodes: Any, changes: dict[str, Any]) -> None:
        at = self.numbers_of_nodes(nodes)
        self._before_change()
        self._change_rows(self.conditions, self.point_row, at, changes)
        self._changed(stiffness=False)

    def stress_condition(
        self,
        faces: Numbers,
        xx: Number | None = None,
        yy: Number | None = None,
        xy: Number | None = None,
        normal: Number | None = None,
    ) -> None:
        """Traction t = sigma n [Pa] on the current face, n its current outward normal, plus `normal` n (negative:
        pressure)."""
        given = {"xx": xx, "yy": yy, "xy": xy, "normal": normal}
        changes = {name: self._value(f"stress {name}", value) for name, value in given.items() if value is not None}
        if not changes:
            raise CommandError("a stress condition needs a stress")
        at = self.numbers_of_faces(faces)
        self._before_change()
        self._change_rows(self.loads, self.load_row, at, changes)
        self._changed(stiffness=False)

    @staticmethod
    def _change_rows(rows: list, column: np.ndarray, at: np.ndarray, changes: dict[str, Any]) -> None:
        old = column[at]
        for row in np.unique(old).tolist():
            wanted = replace(rows[row], **changes)
            if wanted not in rows:
                rows.append(wanted)
            column[at[old == row]] = rows.index(wanted)

    def remove_conditions(self, nodes: Numbers = None) -> None:
        """Take back velocities, accelerations, forces and constraints of nodes."""
        at = self.numbers_of_nodes(nodes)
        self._before_change()
        self.point_row[at] = 0
        self._changed(stiffness=False)

    def remove_stress_conditions(self, faces: Numbers = None) -> None:
        """Take back tractions of faces."""
        at = self.numbers_of_faces(faces)
        self._before_change()
        self.load_row[at] = 0
        self._changed(stiffness=False)

    # ---- options -------------------------------------------------------------------------------------------------

    def gravity(self, gx: float, gy: float) -> None:
        """Acceleration of gravity [m/s2]."""
        x, y = _finite("gravity", [gx, gy]).tolist()
        self._set(gx=x, gy=y)

    def option(
        self, dynamic: bool | None = None, collision: bool | None = None, large_strain: bool | None = None
    ) -> None:
        """dynamic (on): motion in time; off: dynamic relaxation to the static state. collision (on): contact.
        large_strain (on): rotations of any size; off: geometry of the mesh."""
        given = {"dynamic": dynamic, "collision": collision, "large_strain": large_strain}
        self._set(**{name: bool(value) for name, value in given.items() if value is not None})

    def time_step(
        self,
        value: float | None = None,
        auto: bool | None = None,
        safety: float | None = None,
        mass_scaling: float | None = None,
    ) -> None:
        """value [s]: use this time step (0: estimate it). auto: estimate it anew every 100 steps (off: once, at the
        first step). safety (0.8): part of the stability limit that is used. mass_scaling [s]: add mass to nodes until
        this step is stable; 0: none."""
        changes: dict[str, Any] = {}
        for name, number in (("dt", value), ("mass_scaling", mass_scaling)):
            if number is not None:
                changes[name] = float(_finite("a time step", [number])[0])
                if changes[name] < 0.0:
                    raise CommandError(f"a time step must not be negative, got {number:g}")
        if safety is not None:
            if not 0.0 < safety <= 1.0:
                raise CommandError(f"the safety factor of the time step must lie in (0, 1], got {safety:g}")
            changes["safety"] = float(safety)
        if auto is not None:
            changes["auto"] = bool(auto)
        self._set(**changes)

    def _set(self, **changes: Any) -> None:
        self._before_change()
        self.options = replace(self.options, **changes)
        self._changed()

    # ---- tables of the kernels -----------------------------------------------------------------------------------

    def conditions_at(self, time: float, middle: float, dt: float) -> np.ndarray:
        """The table of node conditions (rows, 9) at a moment: forces at `time`, velocities in the middle of the step;
        accelerations as change of velocity over dt."""
        out = np.zeros((len(self.conditions), moving.CONDITION))
        for row, one in enumerate(self.conditions):
            for does, at, kind, value in (
                (moving.DOES_X, moving.AT_X, one.does_x, one.at_x), (moving.DOES_Y, moving.AT_Y, one.does_y, one.at_y),
            ):  # fmt: skip
                out[row, does] = kind
                if kind == moving.VELOCITY:
                    out[row, at] = self._now(value, middle)
                elif kind == moving.ACCELERATION:
                    out[row, at] = self._now(value, time) * dt
            out[row, moving.FORCE_X] = self._now(one.force_x, time)
            out[row, moving.FORCE_Y] = self._now(one.force_y, time)
            out[row, moving.CONSTRAINT] = one.constraint
            out[row, moving.WAY_X], out[row, moving.WAY_Y] = one.way
        return out

    def conditions_vary(self) -> bool:
        """Whether a node condition follows a table."""
        return any(isinstance(value, str) for one in self.conditions for value in asdict(one).values())

    def loads_at(self, time: float) -> np.ndarray:
        """The table of tractions (rows, 4) [Pa] at a moment."""
        return np.array([[self._now(v, time) for v in (one.xx, one.yy, one.xy, one.normal)] for one in self.loads])

    def _now(self, value: Number, time: float) -> float:
        return self.tables[value](time) if isinstance(value, str) else value

    # ---- state on disk -------------------------------------------------------------------------------------------

    def scene_state(self) -> dict[str, Any]:
        """All but the arrays, as JSON values."""
        return {
            "options": asdict(self.options),
            "tables": {name: table.pairs() for name, table in self.tables.items()},
            "element_rows": self.element_rows.state(),
            "face_rows": self.face_rows.state(),
            "joint_rows": self.joint_rows.state(),
            "conditions": [asdict(one) for one in self.conditions],
            "loads": [asdict(one) for one in self.loads],
            "fading": [
                {**asdict(one), "corner": one.corner.tolist(), "force": one.force.tolist()} for one in self.fading
            ],
        }

    def take_scene_state(self, state: dict[str, Any]) -> None:
        """Inverse of `scene_state`."""
        self._closed = None
        self.options = Options(**state["options"])
        self.tables = {name: Table.of(pairs, name) for name, pairs in state["tables"].items()}
        self.element_rows = Rows.restored(state["element_rows"])
        self.face_rows = Rows.restored(state["face_rows"])
        self.joint_rows = Rows.restored(state["joint_rows"])
        self.conditions = [NodeCondition(**{**one, "way": tuple(one["way"])}) for one in state["conditions"]]
        self.loads = [Traction(**one) for one in state["loads"]]
        self.fading = [
            Fading(
                np.array(one["corner"], np.int64), np.array(one["force"]).reshape(-1, 2), one["begin"], one["span"],
                one["in_steps"],
            )
            for one in state["fading"]
        ]  # fmt: skip


def _finite(what: str, values: list) -> np.ndarray:
    try:
        numbers = np.array(values, np.float64)
    except (TypeError, ValueError):
        raise CommandError(f"{what} must be a number, got {values}") from None
    if not np.isfinite(numbers).all():
        raise CommandError(f"{what} must be finite, got {', '.join(f'{v:g}' for v in numbers)}")
    return numbers


def _keep_moduli(old: dict[str, float], given: Mapping[str, float]) -> dict[str, float]:
    """Which two moduli stay when some are changed: Young's modulus and Poisson's ratio, or shear and bulk modulus."""
    changed = [name for name in MODULI if name in given]
    stays = {name: value for name, value in old.items() if name not in MODULI}
    if not changed:
        pair = ["young", "poisson_ratio"]
    elif len(changed) == 1:
        pair = ["young", "poisson_ratio"] if changed[0] in ("young", "poisson_ratio") else ["shear", "bulk"]
    else:
        pair = []
    return {**stays, **{name: old[name] for name in pair}, **given}

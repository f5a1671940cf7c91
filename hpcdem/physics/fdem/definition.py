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

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.core.memory import sparse_zeros
from hpcdem.numerics.random_field import RandomField
from hpcdem.physics.fdem import mesh as meshes
from hpcdem.physics.fdem import node_conditions, properties, sides, user_functions
from hpcdem.physics.fdem.kernels import nodes as moving
from hpcdem.physics.fdem.kernels import space
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.moduli import moduli
from hpcdem.physics.fdem.node_conditions import Contradiction, NodeCondition, Number
from hpcdem.physics.fdem.properties import (
    BARTON_BANDIS,
    COHESIVE,
    COULOMB_JOINT,
    ELEMENT,
    FACE,
    JOINT,
    MECH_BURGERS,
    MECH_MOHR_COULOMB,
    MODELS,
    Model,
    Rows,
    softening_rows,
    softening_table,
    temperature_table,
)
from hpcdem.physics.fdem.tables import AXES, PLASTIC_STRAIN, TEMPERATURE, Drawn, Over, Table, Value
from hpcdem.physics.fdem.user_functions import FUNCTIONS

Numbers = np.ndarray | Sequence[int] | None
"""Numbers of elements, nodes, faces or joints; None: all."""
SAFETY = 0.8
"""Part of the stability limit that is used as time step."""
OVERLAP = REFUSE, RELAX, KEEP = "refuse", "relax", "keep"
"""What becomes of bodies that overlap before the first step."""
DEEP_OVERLAP = WARN, STOP = "warn", "stop"
"""What becomes of a run in which they come to overlap too deep."""
POTENTIAL = DISTANCE, MUNJIZA = "distance", "munjiza"
"""What contact in space presses with: the distance to the nearest side of an element, over a length of its body, or
four times the smallest of its barycentric coordinates (Munjiza 2004)."""
SLIDING = (COULOMB_JOINT.name, BARTON_BANDIS.name)
"""Models of joints that slide and never break."""
AGAIN, CRACK = 2, 3
"""In `broken`: a joint that broke before, or never was whole, and is a joint again for so long (pressed.py)."""
RAYLEIGH = {"both": (1.0, 1.0), "mass": (2.0, 0.0), "stiffness": (0.0, 2.0)}
"""Parts of Rayleigh damping, and the factors of both that make its ratio what was said at its frequency."""


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


COMPONENTS = {2: ("xx", "yy", "xy", "zz"), 3: ("xx", "yy", "xy", "zz", "xz", "yz")}
ACROSS = 3
"""Place of zz there."""
"""Of stress, in the order of all tables, by dimensions of space."""
TRACTIONS = {
    2: ("xx", "yy", "xy", "normal", "incoming_x", "incoming_y", "dip"),
    3: ("xx", "yy", "xy", "normal", "zz", "xz", "yz", "incoming_x", "incoming_y", "incoming_z"),
}  # fmt: skip
"""Columns of the table of tractions."""


@dataclass(frozen=True)
class Options:
    """Switches and numbers of the whole model, see `Blocks`. dt: the user's time step [s], 0 if estimated. At most one
    of dt, auto and mass_scaling is set; auto_every: steps between two estimates. overlap: one of `OVERLAP`,
    deep_overlap: of `DEEP_OVERLAP`; potential: of `POTENTIAL`, in space. mechanical, hydraulic: blocks move, fluid
    flows; one_way: fluid does not push; proppant: grains move in it; flow_every: steps of the blocks between two cycles
    of flow, of flow_steps sub-steps (0: as many as are needed) of flow_dt [s] (0: the time of those steps, or a stable
    one); thermal: heat flows, in cycles as often as those of flow, of heat_steps sub-steps of heat_dt [s] likewise.
    mass_damping [1/s], stiffness_damping [s]: Rayleigh damping, of dynamic runs. static_since: step at which static
    mode was switched on. plane_stress: a model of the plane is a plate whose faces bear nothing, else in plane strain,
    see moduli.py."""

    gx: float = 0.0
    gy: float = 0.0
    gz: float = 0.0
    dynamic: bool = True
    collision: bool = True
    large_strain: bool = True
    dt: float = 0.0
    auto: bool = False
    auto_every: int = 100
    safety: float = SAFETY
    mass_scaling: float = 0.0
    overlap: str = REFUSE
    deep_overlap: str = WARN
    static_since: int = 0
    potential: str = DISTANCE
    mechanical: bool = True
    hydraulic: bool = True
    one_way: bool = False
    proppant: bool = True
    flow_every: int = 1
    flow_steps: int = 0
    flow_dt: float = 0.0
    thermal: bool = True
    heat_steps: int = 0
    heat_dt: float = 0.0
    mass_damping: float = 0.0
    stiffness_damping: float = 0.0
    plane_stress: bool = False


@dataclass(frozen=True)
class Relaxation:
    """Forces that elements which were taken out leave behind: corners (element * 4 + k), forces (n, 2) [N/m], from
    when on and for how long they die down (model time, or steps in static mode)."""

    corner: np.ndarray
    force: np.ndarray
    begin: float
    span: float
    in_steps: bool


class ModelDefinition:
    """Mesh and assignments. Methods that assign raise CommandError, alike on all ranks, and change nothing then."""

    def __init__(self) -> None:
        self.clear_definition()

    def clear_definition(self) -> None:
        """Nothing is there."""
        self.mesh: Mesh | None = None
        self.options = Options()
        self.tables: dict[str, Table] = {}
        self.fields: dict[str, RandomField] = {}
        self.varied: list[list[str]] = []
        """Kinds of objects and properties of theirs that differ from object to object by a table or a field."""
        self.followed: list[Table] = []
        """Tables over plastic strain or temperature, as they were given: rows hold their numbers, from 1 on."""
        self.element_rows, self.face_rows, self.joint_rows = Rows(), Rows(), Rows()
        self.conditions: list[NodeCondition] = [NodeCondition()]
        self.loads: list[Traction] = [Traction()]
        self.relaxations: list[Relaxation] = []
        self.born = np.empty(0, np.int64)
        """Elements that came back after they were taken out, ascending."""
        self.birthplace = np.empty((0, 4, 2))
        """Where their corners were then [m]."""
        self._reference: Mesh | None = None
        self._closed: np.ndarray | None = None
        self.sided = False
        """Conditions were said of single sides of points: corners of one node may have different rows."""
        self._acting: list[NodeCondition] | None = None
        self._make_arrays(0)

    def _make_arrays(self, elements: int) -> None:
        self.partner = np.full(4 * elements, -1, np.int64)
        self.alive, self.touches = np.ones((2, elements), bool)
        """Elements that were not taken out."""
        self.element_row = np.zeros(elements, np.int32)
        self.joint_row = sparse_zeros(4 * elements, np.int32)
        """Of both faces of a joint."""
        self.open = sparse_zeros(4 * elements, bool)
        """Faces that do not hold on to their partner (any more): broken, cracked, or the partner was taken out."""
        self.broken = sparse_zeros(4 * elements, np.uint8)
        """By the lower face: 1 if the joint broke; more, while it is a joint again, see pressed.py."""
        self.slid: dict[int, tuple[float, ...]] = {}
        """By face what broken joints remember of their slip at three points [m], see pressed.py."""
        self.face_row = sparse_zeros(4 * elements, np.int32)
        self.corner_row = sparse_zeros(4 * elements, np.int32)
        """Of conditions of nodes; corners that are one node have what theirs come to (`rows_of_nodes`)."""
        self.load_row = sparse_zeros(4 * elements, np.int32)
        self.stress0: np.ndarray | None = None
        """(elements, 4), in space (elements, 6): `COMPONENTS` [Pa] at zero strain, as it was said, if there is any."""
        self.stress0_row = sparse_zeros(elements, np.int32)
        """Row of the element models for whose moduli it was said; 0: the element had no model yet."""

    # What the simulation does when something has changed.

    def before_change(self) -> None:
        """Assignments are about to change."""

    def changed(self, topology: bool = False, stiffness: bool = True) -> None:
        """Assignments have changed; topology: also who hangs together with whom; stiffness: perhaps the stable time
        step too."""

    def note(self, text: str) -> None:
        """A line for the log."""

    # ---- numbers -------------------------------------------------------------------------------------------------

    @property
    def dim(self) -> int:
        """Dimensions of space; without a mesh 2."""
        return 2 if self.mesh is None else self.mesh.dim

    def refuse_in_space(self, what: str) -> None:
        """CommandError for what is there in the plane only."""
        if self.dim == 3:
            raise CommandError(f"{what}: this version has it in two dimensions only")

    def _mesh(self) -> Mesh:
        if self.mesh is None:
            raise CommandError("there is no mesh yet")
        return self.mesh

    def numbers_of_elements(self, elements: Any) -> np.ndarray:
        """Checked element numbers, ascending; None: all that are there. CommandError for others."""
        at = self.existing(elements, self.alive, "element")
        if elements is not None:
            self.refuse_parts(at)
        return at

    def refuse_parts(self, at: np.ndarray) -> None:
        """CommandError if these elements (n,) are some parts of a macro-element, and not the others."""
        mesh = self._mesh()
        if len(mesh.macros):
            of, macro = mesh.macro_of()[at], mesh.macro
            count = np.bincount(of[of >= 0], minlength=len(mesh.macros))
            part = np.flatnonzero((count > 0) & (count < macro.parts))
            if len(part):
                first = mesh.macros[part[0], -1]
                raise CommandError(
                    f"elements {first} to {first + macro.parts - 1} are one {macro.name}: they go together, only "
                    f"{count[part[0]]} of them were given"
                )

    def numbers_of_nodes(self, nodes: Any) -> np.ndarray:
        """Checked numbers of points of the mesh with an element that is there; None: all of them. Of sides (sides.py)
        their points."""
        asked = None if nodes is None else np.asarray(nodes)
        if asked is not None and np.issubdtype(asked.dtype, np.integer):
            asked = sides.points(self._mesh().cells, asked.reshape(-1))
        return self.existing(asked, self.node_exists(), "node")

    def corners_of_nodes(self, nodes: Any, whole: bool = False) -> np.ndarray:
        """(4 ne,) bool: corners at these nodes (sides.py), those of elements that were taken out too; None: all. whole:
        and those that are one node with them."""
        mesh = self._mesh()
        self.numbers_of_nodes(nodes)
        if nodes is None:
            return mesh.cells.reshape(-1) >= 0
        given = np.asarray(nodes, np.int64).reshape(-1)
        found = sides.corners(mesh.cells, given, len(mesh.points))
        if whole and sides.are_there(given):
            found = self.with_nodes(found, self.clusters()[0].reshape(-1))
        return found

    @staticmethod
    def with_nodes(corners: np.ndarray, node: np.ndarray) -> np.ndarray:
        """Corners (4 ne,) bool, and those that are one of the nodes (4 ne,) with them."""
        of = np.zeros(int(node.max(initial=-1)) + 2, bool)  # the last one: of none
        of[node[corners]] = True
        of[-1] = False
        return corners | of[node]

    def clusters(self) -> tuple[np.ndarray, np.ndarray]:
        """Nodes of corners (ne, 4), as faces hang together now, -1 of elements that were taken out, and their lowest
        corners."""
        mesh = self._mesh()
        apart = (self.joint_row > 0) | self.open
        apart |= np.repeat(~self.alive, 4)
        node, lead = mesh.corner_clusters(self.partner, apart)
        node[~self.alive] = -1
        return node, lead

    def node_exists(self) -> np.ndarray:
        """(np,) bool."""
        corners = self._mesh().cells[self.alive]
        exists = np.zeros(len(self._mesh().points), bool)
        exists[corners[corners >= 0]] = True
        return exists

    def numbers_of_faces(self, faces: Any) -> np.ndarray:
        """Checked face numbers; None: all faces of elements that are there."""
        return self.existing(faces, self.face_exists(), "face")

    def numbers_of_joints(self, joints: Any) -> np.ndarray:
        """Checked numbers of inner edges (lower faces); None: all between elements that are there."""
        return self.existing(joints, self.joint_exists(), "joint (the lower face of an inner edge)")

    def joint_exists(self) -> np.ndarray:
        """(4 ne,) bool: lower faces of edges between elements that are there."""
        face = np.arange(len(self.partner))
        inner = (self.partner > face) & self.alive[face // 4]
        inner[inner] &= self.alive[self.partner[inner] // 4]
        inner[inner] = ~self._mesh().inside_macros(face[inner])
        return inner

    def face_exists(self) -> np.ndarray:
        """(4 ne,) bool."""
        exists = np.repeat(self.alive, 4)
        exists[3::4] &= self._mesh().cells[:, 3] >= 0
        return exists

    def existing(self, given: Any, there: np.ndarray, what: str) -> np.ndarray:
        self._mesh()
        if given is None:
            return np.flatnonzero(there)
        asked = np.asarray(given)
        if asked.dtype == bool or (asked.size and not np.issubdtype(asked.dtype, np.integer)):
            raise CommandError(f"numbers of {what}s must be integers, got {asked.dtype}")
        asked = np.unique(asked.astype(np.int64).reshape(-1))
        bad = asked[(asked < 0) | (asked >= len(there))]
        gone = ""
        if not len(bad):
            bad = asked[~there[asked]]
            gone = "" if self.alive.all() else "; elements were taken out"
        if len(bad):
            raise CommandError(f"there is no {what} {bad[0]}{gone}")
        return asked

    # ---- mesh ----------------------------------------------------------------------------------------------------

    def _take(self, mesh: Mesh) -> None:
        try:
            meshes.check(mesh)
        except HpcdemError as error:
            raise CommandError(str(error)) from None
        self._put(mesh)

    def _put(self, mesh: Mesh) -> None:
        kept = self.options, self.tables, self.fields
        self.clear_definition()
        self.options, self.tables, self.fields = kept
        self.mesh = mesh
        self._make_arrays(len(mesh.cells))
        self.partner = mesh.face_partners()
        if len(mesh.cracks):
            rows = meshes.crack_rows(mesh, mesh.edges())
            self.open_faces(mesh.edges().faces[rows, 0])

    def open_faces(self, lower: np.ndarray) -> None:
        for faces in (lower, self.partner[lower]):
            self.open[faces] = True
            if self._closed is not None:
                self._closed[faces] = False

    def closed_faces(self) -> np.ndarray:
        """(4 ne,) bool: faces that hang together with their partner, by a joint or as one body. Not to be changed."""
        if self._closed is None:
            self._closed = (self.partner >= 0) & ~self.open
        return self._closed

    @property
    def reference(self) -> Mesh:
        """Where elements are free of strain: the mesh, and for those that came back where they did, with points of
        their own there (macro-elements share those of their parts)."""
        mesh = self._mesh()
        if self._reference is None:
            self._reference = mesh.with_own_points(self.born, self.birthplace) if len(self.born) else mesh
        return self._reference

    def take_births(self, born: np.ndarray, places: np.ndarray) -> None:
        """Elements (n,) have come back, their corners at places (n, 4, dim) [m]."""
        stay = ~np.isin(self.born, born)
        number = np.concatenate([self.born[stay], born])
        order = np.argsort(number, kind="stable")
        self.born = number[order]
        known = self.birthplace[stay].reshape(-1, 4, self.dim)
        self.birthplace = np.concatenate([known, places])[order]
        self._reference = None

    # ---- models --------------------------------------------------------------------------------------------------

    def set_element_model(self, elements: Numbers, name: str, properties: Mapping[str, Value]) -> None:
        """Assign a model (model.blocks.properties) with all its properties to elements."""
        model = MODELS.get(name)
        if model is not None and self.dim not in model.dims:
            raise CommandError(
                f"{model.doc} is not for {self.dim} dimensions: element_law(dim={self.dim}) declares one that is"
            )
        at = self.numbers_of_elements(elements)
        self._assign(self.element_rows, (self.element_row, at), at, ELEMENT, name, properties)
        self._note_moduli(at)

    def yielding(self) -> np.ndarray:
        """(ne,) bool: elements that are there and have a model that can yield."""
        return self._has_model(MECH_MOHR_COULOMB)

    def creeping(self) -> np.ndarray:
        """(ne,) bool: elements that are there and have a model that can creep."""
        return self._has_model(MECH_BURGERS)

    def slides(self) -> np.ndarray:
        """(4 ne,) bool: joints, by their lower faces, with a model that slides and never breaks."""
        names = [self.joint_rows.name(row) for row in range(len(self.joint_rows))]
        return self.joint_exists() & np.isin(names, SLIDING)[self.joint_row]

    def _has_model(self, model: Model) -> np.ndarray:
        names = [self.element_rows.name(row) for row in range(len(self.element_rows))]
        return self.alive & np.array([name == model.name for name in names])[self.element_row]

    def softens(self) -> bool:
        """Whether an element that is there can yield, and has a strength that follows a table."""
        return bool(softening_rows(self.element_rows)[self.element_row[self.alive]].any())

    def warms(self) -> tuple[np.ndarray, np.ndarray]:
        """Elements (ne,) and joints (4 ne,) bool with a property that follows a table over temperature or another
        field."""
        elements, joints = (
            np.any([rows.column(temperature_table(p.name)) > 0.0 for p in of.properties if p.warms], axis=0)
            for rows, of in ((self.element_rows, MECH_MOHR_COULOMB), (self.joint_rows, COHESIVE))
        )
        return self.alive & elements[self.element_row], self.joint_exists() & joints[self.joint_row]

    def _note_moduli(self, at: np.ndarray) -> None:
        """Initial stresses of elements that had no model belong to the moduli of the one that they have now; where
        nothing was said of the stress across the plane, it is that of plane strain, in plane stress 0."""
        new = at[self.stress0_row[at] == 0]
        self.stress0_row[new] = self.element_row[new]
        if self.stress0 is not None:
            new = at[np.isnan(self.stress0[at, ACROSS]) & (self.element_row[at] > 0)]
            nu = np.nan_to_num(self.element_rows.column("poisson_ratio"))[self.element_row[new]]
            nu = 0.0 * nu if self.options.plane_stress else nu
            self.stress0[new, ACROSS] = nu * (self.stress0[new, 0] + self.stress0[new, 1])

    def element_property(self, elements: Numbers, properties: Mapping[str, Value]) -> None:
        """Change some properties of elements that have a model. The stress follows the strain (total form)."""
        at = self.numbers_of_elements(elements)
        self._adjust(self.element_rows, (self.element_row, at), at, ELEMENT, properties, _keep_moduli)

    def face_model(self, faces: Numbers, name: str, properties: Mapping[str, Value]) -> None:
        """Assign a contact model to faces, also to those that will be free only when a joint breaks."""
        at = self.numbers_of_faces(faces)
        self._assign(self.face_rows, (self.face_row, at), at, FACE, name, properties)

    def face_property(self, faces: Numbers, properties: Mapping[str, Value]) -> None:
        """Change some properties of the contact model of faces; None: of all that have one."""
        if faces is None:
            faces = np.flatnonzero((self.face_row > 0) & self.face_exists())
        at = self.numbers_of_faces(faces)
        self._adjust(self.face_rows, (self.face_row, at), at, FACE, properties)

    def joint_model(self, joints: Numbers, name: str, properties: Mapping[str, Value]) -> None:
        """Assign a cohesive model to inner edges: elements on both sides get nodes of their own, tied by tractions.

        Joints that are broken stay broken: a model that slides, which would never act there, is refused. None: all
        inner edges."""
        at = self.numbers_of_joints(joints)
        if name in SLIDING:
            self._refuse_cracks(at, name)
        self._assign(self.joint_rows, self._both_sides(at), at, JOINT, name, properties, True)

    def _refuse_cracks(self, joints: np.ndarray, name: str) -> None:
        """CommandError if some of these joints are cracks."""
        self.before_change()  # those that broke just now are known from here on
        if len(cracks := joints[self.open[joints]]):
            at = ", ".join(f"{c:g}" for c in self._mesh().points[self._mesh().face_points(cracks)][0].mean(axis=0))
            raise CommandError(
                f"face-joint {cracks[0]} at ({at}) is a crack ({len(cracks)} in all): its sides are free and meet by "
                f"contact, so {name.replace('_', '-')} would not act there. mesh create embed, in the place of crack, "
                "makes edges along a line that are whole; a range leaves out what broke"
            )

    def joint_property(self, joints: Numbers, properties: Mapping[str, Value]) -> None:
        """Change some properties of joints that have a model; None: of all that have one."""
        if joints is None:
            joints = np.flatnonzero((self.joint_row > 0) & self.joint_exists())
        at = self.numbers_of_joints(joints)
        self._adjust(self.joint_rows, self._both_sides(at), at, JOINT, properties)

    def _both_sides(self, joints: np.ndarray) -> tuple[np.ndarray, ...]:
        return self.joint_row, joints, self.joint_row, self.partner[joints]

    def _assign(
        self, rows: Rows, columns: Sequence[np.ndarray], of: np.ndarray, on: str, name: str, given: Mapping[str, Value],
        topology: bool = False,
    ) -> None:  # fmt: skip
        """Give objects a model. columns: where the row of each object goes, as (array, places (n,)) in turn."""
        model = properties.model(name, on)
        all_of_them = np.arange(len(of))
        made = [(all_of_them, model, self.complete(on, of, model, {}, given))]
        self._put_rows(rows, columns, made, on, given, all_of_them)
        self.changed(topology)

    def _adjust(
        self, rows: Rows, columns: Sequence[np.ndarray], of: np.ndarray, on: str, given: Mapping[str, Value],
        keep: Callable[[dict[str, Any], Mapping[str, Any]], dict[str, Any]] | None = None,
    ) -> None:  # fmt: skip
        """Change properties of objects that have a model; keep: what stays of the old ones beside the new."""
        if not len(of):
            raise CommandError(f"no {on} has a model whose properties could be changed: {on} c-model comes first")
        old = columns[0][columns[1]]
        bare = of[old == 0]
        if len(bare):
            raise CommandError(f"{on} {bare[0]} has no model whose properties could be changed")
        present, which = np.unique(old, return_inverse=True)
        names = np.array([rows.name(row) for row in present.tolist()])
        which = which.reshape(-1)
        if not all(map(_is_number, given.values())):
            old, names, which = old, names[which], np.arange(len(of))  # one set for each object
        else:
            old, of = present, of[np.unique(which, return_index=True)[1]]  # one for each that there is
        made = []
        for name in np.unique(names).tolist():
            at, model = np.flatnonzero(names == name), properties.MODELS[name]
            before = {p.name: rows.column(p.name)[old[at]] for p in model.properties}
            made.append((at, model, self.complete(on, of[at], model, before, given, keep)))
        self._put_rows(rows, columns, made, on, given, which)
        self.changed()

    def _put_rows(
        self, rows: Rows, columns: Sequence[np.ndarray], made: Sequence[tuple[np.ndarray, Model, np.ndarray]], on: str,
        given: Mapping[str, Value], which: np.ndarray,
    ) -> None:  # fmt: skip
        """Make rows of complete sets of properties, (1, k) for all of these places or one for each, and give each
        object the one at the place `which` (n,)."""
        self.before_change()
        number = np.zeros(sum(len(at) for at, *_ in made), np.int32)
        for at, model, values in made:
            number[at] = rows.numbers(model, values)
        for column, at in zip(columns[0::2], columns[1::2]):
            column[at] = number[which]
        for name, value in given.items():
            if _differs(value) and [on, name] not in self.varied:
                self.varied.append([on, name])

    def complete(
        self, on: str, of: np.ndarray, model: Model, before: Mapping[str, np.ndarray], given: Mapping[str, Value],
        keep: Callable[[dict[str, Any], Mapping[str, Any]], dict[str, Any]] | None = None,
    ) -> np.ndarray:  # fmt: skip
        """Complete, checked properties of objects `of` (n,): (n, properties), or (1, properties) if none of them
        differs from object to object. CommandError names the first object whose value cannot be."""
        given = self._with_tables(model, given)
        each = {name: self._spread(on, of, name, v) for name, v in given.items() if not _is_number(v)}
        new = {name: each.get(name, value) for name, value in given.items()}
        for name in new:
            if self.dim not in model.property(name).dims:
                raise CommandError(f"in {'two' if self.dim == 2 else 'three'} dimensions there is no {name}")
        wanted: dict[str, Any] = keep(dict(before), new) if keep else model.changed(before, new)
        if not each and not before:
            return self._checked_softening(model, np.array([list(model.complete(wanted).values())]))
        found = model.complete_each(wanted, len(of)) if all(map(_can_be_number, wanted.values())) else None
        if found is not None:
            return self._checked_softening(model, found)
        for i, number in enumerate(of.tolist()):
            try:
                model.complete({name: v[i] if isinstance(v, np.ndarray) else v for name, v in wanted.items()})
            except CommandError as error:
                if not each:
                    raise
                raise CommandError(f"{on} {number}: {error}") from None
        raise AssertionError("both ways to complete properties agree")

    def _with_tables(self, model: Model, given: Mapping[str, Value]) -> dict[str, Value]:
        """Properties of which those with a table over plastic strain have their value before any flow, those with one
        over temperature the largest, and those that can have one the number of their table."""
        out = dict(given)
        of_moduli = "young" in given or "shear" in given or "bulk" in given
        if of_moduli and model.has(temperature_table("young")):
            out[temperature_table("young")] = 0.0
        for name, value in given.items():
            for table in (softening_table(name), temperature_table(name)):
                if model.has(table):
                    out[table] = 0.0
            if isinstance(value, Over) and value.axis == PLASTIC_STRAIN:
                if not model.property(name).softens:
                    raise CommandError(f"{name} of {model.name} cannot follow a table over plastic strain")
                number = self._kept(model, name, value.table)
                if self.followed[number - 1].times[0] < 0.0:
                    raise CommandError(f"{name}: table '{value.table}' begins at a negative plastic strain")
                out[name], out[softening_table(name)] = self.followed[number - 1](0.0), float(number)
            elif isinstance(value, Over) and value.axis >= TEMPERATURE:
                if not model.has(temperature_table(name)):
                    raise CommandError(f"{name} of {model.name} cannot follow a table over {AXES[value.axis]}")
                number = self._kept(model, name, value.table, AXES[value.axis] if value.axis > TEMPERATURE else "")
                values = self.followed[number - 1].values
                if name in ("gf1", "gf2") and values.min() == 0.0:
                    raise CommandError(
                        f"{name}: table '{value.table}' has a fracture energy of 0; it must be > 0 (N/m)"
                    )
                out[name], out[temperature_table(name)] = float(values.max()), float(number)
        return out

    def _kept(self, model: Model, name: str, table: str, over: str = "") -> int:
        """The number, from 1 on, of a table as it is now among those that rows follow (over another field than
        temperature: its name); CommandError if a value of it is
        none that this property can have."""
        self._value(name, table)
        found = replace(self.tables[table], over=over)
        for one in found.values.tolist():
            model.property(name).check(one)
        known = [(one.pairs(), one.over) for one in self.followed]
        if (found.pairs(), over) not in known:
            known.append((found.pairs(), over))
            self.followed.append(found)
        return 1 + known.index((found.pairs(), over))

    def _checked_softening(self, model: Model, values: np.ndarray) -> np.ndarray:
        """The complete sets of properties (n, k); CommandError if flow makes dilation larger than friction."""
        if model.has(softening_table("dilation")):
            place = {p.name: k for k, p in enumerate(model.properties)}
            pair = [place[name] for one in ("dilation", "friction") for name in (one, softening_table(one))]
            for row in np.unique(values[:, pair], axis=0):
                tables = [self.followed[int(number) - 1] if number else None for number in row[[1, 3]]]
                if any(tables):
                    at = np.unique(np.concatenate([one.times for one in tables if one]))
                    dilation, friction = (one.at(at) if one else value for one, value in zip(tables, row[[0, 2]]))
                    above = np.flatnonzero(dilation > friction)
                    if len(above):
                        raise CommandError(f"dilation is above friction at a plastic strain of {at[above[0]]:g}")
        return values

    def _spread(self, on: str, of: np.ndarray, name: str, value: Value) -> np.ndarray:
        """One number for each object."""
        if isinstance(value, Over):
            if value.table not in self.tables:
                self._value(name, value.table)
            places = self._places(on, of)
            if value.axis >= self.dim:
                self._only_in_space(f"{AXES[value.axis]} for table '{value.table}' of {name} to be over", value)
            return self.tables[value.table].at(places[:, value.axis])
        if isinstance(value, Drawn):
            if value.field not in self.fields:
                known = ", ".join(f"'{n}'" for n in self.fields) or "none"
                raise CommandError(f"{name}: there is no field '{value.field}' (fields: {known})")
            mesh = self._mesh()
            numbers = mesh.of_one(of) if on == ELEMENT else mesh.of_one_side(of)
            return self.fields[value.field].values(on, numbers, self._places(on, of))
        numbers = np.asarray(value, np.float64)
        if numbers.shape != (len(of),):
            raise CommandError(f"{name}: {len(of)} numbers are needed, one for each {on}, got {numbers.shape}")
        return numbers

    def _places(self, on: str, of: np.ndarray) -> np.ndarray:
        """(n, 2), in space (n, 3) [m] in the mesh: centres of elements, middles of faces and joints. Hexahedra and
        their sides are one object."""
        return self._mesh().centroids(of) if on == ELEMENT else self._mesh().side_middles(of)

    def initial_stress(
        self,
        elements: Numbers,
        xx: float = 0.0,
        yy: float = 0.0,
        xy: float = 0.0,
        zz: float | None = None,
        gradient: Mapping[str, tuple[float, ...]] | None = None,
        xz: float = 0.0,
        yz: float = 0.0,
    ) -> None:
        """Stress [Pa] at zero strain, tension positive; gradient: component -> (per m in x, per m in y, in space in z)
        at the centroid as it lies in the mesh. It is the stress of a strain by the moduli of this moment, and changes
        with them, see `initial_stresses`. In the plane zz, if nothing is said of it, is that of plane strain, Poisson's
        ratio times xx + yy, and in space and in plane stress 0."""
        at = self.numbers_of_elements(elements)
        mesh = self._mesh()
        names = COMPONENTS[mesh.dim]
        if mesh.dim == 2 and (xz != 0.0 or yz != 0.0):
            raise CommandError("in two dimensions there is no stress xz and yz")
        given = {"xx": xx, "yy": yy, "xy": xy, "zz": 0.0 if zz is None else zz, "xz": xz, "yz": yz}
        values = np.tile(finite("initial stress", [given[name] for name in names]), (len(at), 1))
        for name, slope in (gradient or {}).items():
            if name not in names:
                raise CommandError(f"a stress gradient is one of {', '.join(names)}, got {name}")
            values[:, names.index(name)] += mesh.centroids(at) @ self._vector(f"gradient of {name}", slope)
        if self.options.plane_stress and (values[:, ACROSS] != 0.0).any():
            raise CommandError(
                f"an initial stress zz of {values[values[:, ACROSS] != 0.0, ACROSS][0]:g} Pa cannot be in plane "
                "stress, where the stress across the plane is 0: leave stress-zz out, or say model plane-strain"
            )
        if mesh.dim == 2 and zz is None and "zz" not in (gradient or {}):
            values[:, ACROSS] = math.nan  # until there are moduli
        self.before_change()
        if self.stress0 is None:
            self.stress0 = np.zeros((len(mesh.cells), len(names)))
        self.stress0[at] = values
        self.stress0_row[at] = self.element_row[at]
        self._note_moduli(at)
        self.changed()

    def initial_stresses(self, elements: np.ndarray) -> np.ndarray:
        """Stress [Pa] (n, 4), in space (n, 6), of elements (n,) at zero strain, by their present moduli.

        What was said fixes a strain: mean stress over 3 K and deviator over 2 G with the moduli of that moment. So the
        mean follows the bulk modulus and the deviator the shear modulus. (In plane stress both are of the plane, and
        the bulk modulus K_2, see moduli.py.)"""
        assert self.stress0 is not None
        out = self.stress0[elements]
        said, now = self.stress0_row[elements], self.element_row[elements]
        ratio = np.ones((len(out), 2))
        of = moduli(self.element_rows, self.options.plane_stress)
        for c, modulus in enumerate((of.bulk, of.shear)):
            other = (said > 0) & (modulus[said] != modulus[now])
            ratio[other, c] = modulus[now[other]] / modulus[said[other]]
        other = (ratio != 1.0).any(axis=1)  # the rest keeps every bit
        normal = of.normal
        mean = out[other][:, normal].mean(axis=1, keepdims=True)
        scaled = ratio[other, 1:] * (out[other] - np.where(np.isin(np.arange(out.shape[1]), normal), mean, 0.0))
        scaled[:, normal] += ratio[other, :1] * mean
        out[other] = scaled
        return out

    # ---- boundary conditions -------------------------------------------------------------------------------------

    def table(self, name: str, pairs: Sequence[tuple[float, float]]) -> None:
        """Make or replace a table of (time [s], value)."""
        made = Table.of(pairs, name)
        self.before_change()
        self.tables[name] = made
        self.changed(stiffness=False)

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
        rows = [self.conditions[r] for r in np.unique(self.corner_row)] + [
            self.loads[r] for r in np.unique(self.load_row)
        ]
        said = {value for one in rows for value in asdict(one).values() if isinstance(value, str)}
        return [name for name in self.tables if name in said]

    def random_field(self, name: str, field: RandomField) -> None:
        """Make or replace a random field; properties that were drawn from one of this name stay."""
        self.fields[name] = field

    def remove_field(self, name: str) -> None:
        """Delete a random field; properties that were drawn from it stay."""
        if name not in self.fields:
            raise CommandError(f"there is no field '{name}'")
        del self.fields[name]

    def _value(self, what: str, value: Number) -> Number:
        if isinstance(value, str) and value not in FUNCTIONS:
            if value not in self.tables:
                known = ", ".join(f"'{n}'" for n in self.tables) or "none"
                raise CommandError(f"{what}: there is no table '{value}' (tables: {known})")
        if isinstance(value, str):
            return value
        return float(finite(what, [value])[0])

    def time_now(self) -> float:
        """What tables and functions of conditions are read at, see `State.time_now`."""
        return 0.0

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
        way: tuple[float, ...] = (0.0, 0.0)
        if kind in (moving.ALONG, space.ACROSS):
            vector = self._vector("direction", direction).tolist()
            if not any(vector):
                raise CommandError("a move constraint along a vector needs a vector that is not zero")
            way = tuple(c / math.hypot(*vector) for c in vector)
        self._condition(nodes, {"constraint": kind, "way": way})

    def _vector(self, what: str, given: Sequence[float]) -> np.ndarray:
        """One number for each dimension of space. CommandError if there are others."""
        if len(given) != self.dim:
            raise CommandError(f"{what}: a vector of {self.dim} numbers is needed, got {len(given)}")
        return finite(what, list(given))

    def _only_in_space(self, what: str, *values: Any) -> None:
        if self.dim == 2 and any(value is not None for value in values):
            raise CommandError(f"in two dimensions there is no {what}")

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
        rows, column, sided = self.conditions.copy(), self.corner_row[at], self.sided
        others = np.flatnonzero(self.with_nodes(chosen, node) & ~chosen) if node is not None else at[:0]
        others = others[self.corner_row[others] > 0]
        before = self.corner_row[others]
        self.before_change()
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
                kind, way = node_conditions.bound(one.constraint, one.way, wanted.constraint, wanted.way, self.dim)
                more |= mine & ((kind, way) != (wanted.constraint, wanted.way))
                wanted = replace(wanted, constraint=kind, way=way)
            self._checked(wanted, at[mine])
            self.corner_row[at[mine]] = _row_of(self.conditions, wanted)
        if more.any():
            count = len(np.unique(self._mesh().cells.reshape(-1)[at[more]]))
            self.note(
                f"{count} of these nodes have a move constraint already, which holds besides the new one (type 0 takes "
                "constraints back)"
            )

    def _new_sides(self, at: np.ndarray, forces: Sequence[str]) -> np.ndarray:
        """(n,) numbers of the side that corners are for forces along axes, which they share: one that no other corner
        at the point has."""
        cells = self._mesh().cells.reshape(-1)
        has = self.corner_row > 0
        has[at] = False
        others = np.flatnonzero(has)
        said = np.array([max(getattr(one, f"side_{axis}") for axis in forces) for one in self.conditions])
        most = np.zeros(len(self._mesh().points), np.int64)
        np.maximum.at(most, cells[others], said[self.corner_row[others]])
        return 1 + most[cells[at]]

    def _make_older(self, others: np.ndarray, changes: dict[str, Any]) -> None:
        """What was said before of other corners of these nodes gives way, as long as they are one node."""
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
        """What this condition, or those of one node, come to. CommandError, with the place of the first of these
        corners, if no motion fulfils them."""
        try:
            one = one if isinstance(one, NodeCondition) else node_conditions.together(one, self.dim)
            return node_conditions.acting(one, self.dim)
        except Contradiction as error:
            mesh = self._mesh()
            point = int(mesh.cells.reshape(-1)[at[0]])
            raise CommandError(
                f"conditions contradict each other at node {point} at {place(mesh.points[point])}: {error}. One of "
                "them is taken back first (node boundary remove, or type 0 of a move constraint), or the range leaves "
                "the node out"
            ) from None

    def acting(self) -> list[NodeCondition]:
        """What rows of conditions come to, by row (`rows_of_nodes`). Not to be changed."""
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
        """Of these nodes, rows of `acting` and parts, see `rows_of_nodes`; node (4 ne,): of all corners."""
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
        """How many of these corners share the force that a node has along an axis."""
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
        return max(0.0, *(self.conditions[row].damp for row in np.unique(self.corner_row).tolist()))

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
        self._only_in_space("stress zz, xz and yz, and incoming z, on faces", zz, xz, yz, incoming_z)
        if dip is not None and self.dim == 3:
            raise CommandError("dip is for two dimensions: shear on faces in three is stress-xy, stress-xz, stress-yz")
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
                raise CommandError(f"a wave comes in through quiet faces only: quiet on goes with {axes}")
        middles = self._mesh().points[self._mesh().face_points(at)].mean(axis=1)
        for name, value in changes.items():
            user_functions.check(f"stress {name}", value, middles, self.time_now())
        self.before_change()
        self._change_rows(self.loads, self.load_row, at, changes)
        self.changed(stiffness=quiet is not None)  # dashpots limit the time step

    @staticmethod
    def _change_rows(rows: list, column: np.ndarray, at: np.ndarray, changes: dict[str, Any]) -> None:
        old = column[at]
        for row in np.unique(old).tolist():
            column[at[old == row]] = _row_of(rows, replace(rows[row], **changes))

    def remove_conditions(self, nodes: Numbers = None, kinds: Sequence[str] = node_conditions.KINDS) -> None:
        """Take back velocities and accelerations, forces, constraints of nodes (these kinds); None: of all, those too
        that have no element at this moment."""
        at = self.corners_of_nodes(nodes, whole=True) if nodes is not None else slice(None)
        self.before_change()
        column = self.corner_row[at]
        for row in np.unique(column).tolist():
            left = node_conditions.without(self.conditions[row], kinds)
            column[self.corner_row[at] == row] = _row_of(self.conditions, left)
        self.corner_row[at] = column
        self._acting = None
        self.changed(stiffness=False)

    def remove_stress_conditions(self, faces: Numbers = None) -> None:
        """Take back tractions of faces."""
        at = self.numbers_of_faces(faces)
        self.before_change()
        was_quiet = bool(self.quiet_faces()[at].any())
        self.load_row[at] = 0
        self.changed(stiffness=was_quiet)

    # ---- options -------------------------------------------------------------------------------------------------

    def gravity(self, gx: float, gy: float, gz: float = 0.0) -> None:
        """Acceleration of gravity [m/s2]."""
        x, y, z = finite("gravity", [gx, gy, gz]).tolist()
        if z != 0.0 and self.mesh is not None:
            self._only_in_space("gravity in z", z)
        self._set(gx=x, gy=y, gz=z)

    def option(
        self,
        dynamic: bool | None = None,
        collision: bool | None = None,
        large_strain: bool | None = None,
        overlap: str | None = None,
        potential: str | None = None,
        deep_overlap: str | None = None,
        plane_stress: bool | None = None,
    ) -> None:
        """dynamic (on): motion in time; off: dynamic relaxation to the static state. collision (on): contact.
        plane_stress (off): a model of the plane is a plate; off: in plane strain; said before stress is.
        large_strain (on): rotations of any size; off: geometry of the mesh. overlap ("refuse"): of bodies that overlap
        before the first step: refuse it; "relax": a static stage moves them apart; "keep": they start as they are.
        deep_overlap ("warn"): of bodies that come to overlap by more than a tenth of an altitude: say where; "stop":
        end the run. potential ("distance"): of contact in space, see `POTENTIAL`."""
        given = {"dynamic": dynamic, "collision": collision, "large_strain": large_strain}
        changes: dict[str, Any] = {name: bool(value) for name, value in given.items() if value is not None}
        for name, value, known in (
            ("overlap", overlap, OVERLAP), ("deep_overlap", deep_overlap, DEEP_OVERLAP)
        ):  # fmt: skip
            if value is not None and value not in known:
                raise CommandError(f"{name.replace('_', '-')} is one of {', '.join(known)}, got {value}")
            if value is not None:
                changes[name] = value
        if potential is not None:
            if self.mesh is not None:
                self._only_in_space("choice of the potential of contact", potential)
            if potential not in POTENTIAL:
                raise CommandError(f"the potential of contact is one of {', '.join(POTENTIAL)}, got {potential}")
            changes["potential"] = potential
        if plane_stress is not None and plane_stress != self.options.plane_stress:
            self._check_plane(plane_stress)
            changes["plane_stress"] = plane_stress
        self._set(**changes)

    def _check_plane(self, stress: bool) -> None:
        """CommandError where it is too late for plane stress or plane strain, or in space."""
        word = "model plane-stress" if stress else "model plane-strain"
        if self.mesh is not None and self.mesh.dim == 3:
            raise CommandError(f"{word} is for models of the plane")
        if self.stress0 is not None:
            raise CommandError(f"{word} comes before element initial: the stress across the plane depends on it")

    def parts(
        self,
        mechanical: bool | None = None,
        hydraulic: bool | None = None,
        one_way: bool | None = None,
        thermal: bool | None = None,
        proppant: bool | None = None,
    ) -> None:
        """What is computed: motion of the blocks (on), flow (on), heat (on), grains in the fluid (on); one_way (off):
        fluid does not push on blocks."""
        given = {
            "mechanical": mechanical, "hydraulic": hydraulic, "one_way": one_way, "thermal": thermal,
            "proppant": proppant,
        }  # fmt: skip
        self._set(**{name: bool(value) for name, value in given.items() if value is not None})

    def flow_clock(self, every: int | None = None, steps: int | None = None, dt: float | None = None) -> None:
        """every: steps of the blocks between two cycles of flow; steps: sub-steps of a cycle, 0: as many as are needed;
        dt [s]: of a sub-step, 0: the time in which the blocks move, or without motion a stable one."""
        self._set(**self._clock(("flow_every", every, 1), ("flow_steps", steps, 0), flow_dt=dt))

    def heat_clock(self, steps: int | None = None, dt: float | None = None) -> None:
        """steps: sub-steps of a cycle of heat, 0: as many as are needed; dt [s]: of one, as that of flow."""
        self._set(**self._clock(("heat_steps", steps, 0), heat_dt=dt))

    @staticmethod
    def _clock(*counts: tuple[str, int | None, int], **steps: float | None) -> dict[str, Any]:
        """Checked counts (name, number, the least one) and time steps, those that were given."""
        changes: dict[str, Any] = {}
        for name, number, least in counts:
            if number is not None:
                if number < least:
                    raise CommandError(f"a number of sub-steps must be at least {least}, got {number}")
                changes[name] = int(number)
        for name, dt in steps.items():
            if dt is not None:
                changes[name] = float(finite("a time step", [dt])[0])
                if changes[name] < 0.0:
                    raise CommandError(f"a time step must not be negative, got {dt:g}")
        return changes

    def time_step(
        self,
        value: float | None = None,
        auto: bool | None = None,
        safety: float | None = None,
        mass_scaling: float | None = None,
    ) -> None:
        """How the time step of the dynamic mode is found. Without anything said: estimated at the first step and after
        changes of the model.

        value [s]: it is this. mass_scaling [s]: it is this, and nodes get the mass that makes it stable. auto on: it is
        estimated again every 100 steps (`estimate_every`), too. Of these three the one that was said last holds and
        ends the other two; 0 (off) takes it back. safety (0.8): part of the stability limit that is used, by estimates
        and mass scaling.

        CommandError for two of the three at once, and for a safety factor beside a value.
        """
        changes: dict[str, Any] = {}
        for name, number in (("dt", value), ("mass_scaling", mass_scaling)):
            if number is not None:
                changes[name] = float(finite("a time step", [number])[0])
                if changes[name] < 0.0:
                    raise CommandError(f"a time step must not be negative, got {number:g}")
        if safety is not None:
            if not 0.0 < safety <= 1.0:
                raise CommandError(f"the safety factor of the time step must lie in (0, 1], got {safety:g}")
            changes["safety"] = float(safety)
        if auto is not None:
            changes["auto"] = bool(auto)
        wanted = [name for name in ("dt", "mass_scaling", "auto") if changes.get(name)]
        if len(wanted) > 1:
            one, other = ({"dt": "value", "mass_scaling": "mass scaling"}.get(name, name) for name in wanted[:2])
            raise CommandError(f"{one} and {other} exclude each other: both say what the time step is")
        if wanted == ["dt"] and safety is not None:
            raise CommandError("value and safety exclude each other: a time step that is given is taken as it is")
        if wanted:
            changes = {"dt": 0.0, "mass_scaling": 0.0, "auto": False, **changes}
        self._set(**changes)

    def estimate_every(self, steps: int) -> None:
        """Steps after which an automatic time step is estimated again (100)."""
        if steps < 1:
            raise CommandError(f"steps between two estimates of the time step: at least 1 is needed, got {steps}")
        self._set(auto_every=int(steps))

    def rayleigh(self, ratio: float, frequency: float | None = None, part: str = "both") -> None:
        """Rayleigh damping C = alpha M + beta K, dynamic runs: `ratio` of the critical one at `frequency` [Hz].

        part "both": xi = (alpha / omega + beta omega) / 2 is least there, alpha = xi omega, beta = xi / omega; "mass":
        alpha = 2 xi omega alone; "stiffness": beta = 2 xi / omega alone. M: true masses, K: stiffness of the elements,
        without joints and contact. ratio 0: no more. CommandError in static mode.
        """
        if part not in RAYLEIGH:
            raise CommandError(f"the part of Rayleigh damping is one of {', '.join(RAYLEIGH)}, got {part}")
        xi = float(finite("the ratio of Rayleigh damping", [ratio])[0])
        if not 0.0 <= xi < 1.0:
            raise CommandError(f"the ratio of Rayleigh damping must lie in [0, 1), got {xi:g}")
        if xi == 0.0:
            self._set(mass_damping=0.0, stiffness_damping=0.0)
            return
        if frequency is None:
            raise CommandError("Rayleigh damping needs the frequency at which it has its ratio")
        omega = 2.0 * math.pi * float(finite("the frequency of Rayleigh damping", [frequency])[0])
        if omega <= 0.0:
            raise CommandError(f"the frequency of Rayleigh damping must be positive, got {frequency:g} Hz")
        of_mass, of_stiffness = RAYLEIGH[part]
        self._set(mass_damping=of_mass * xi * omega, stiffness_damping=of_stiffness * xi / omega)

    def _set(self, **changes: Any) -> None:
        options = replace(self.options, **changes)
        if not options.dynamic and (options.mass_damping or options.stiffness_damping):
            raise CommandError(
                "Rayleigh damping acts in dynamic runs only: it is said after dynamic on, and taken back by ratio 0 "
                "before dynamic off"
            )
        self.before_change()
        self.options = options
        self.changed()

    # ---- tables of the kernels -----------------------------------------------------------------------------------

    def conditions_at(self, time: float, middle: float, dt: float) -> np.ndarray:
        """The table of what node conditions come to (rows, 10), in space (rows, 14), at a moment: forces at `time`,
        velocities in the middle of the step; accelerations as change of velocity over dt."""
        plane = self.dim == 2
        out = np.zeros((len(self.acting()), moving.CONDITION if plane else space.CONDITION))
        does = (moving.DOES_X, moving.DOES_Y) if plane else range(space.DOES, space.DOES + 3)
        at = (moving.AT_X, moving.AT_Y) if plane else range(space.AT, space.AT + 3)
        force, constraint, way = (
            (moving.FORCE_X, moving.CONSTRAINT, moving.WAY_X) if plane else (space.FORCE, space.CONSTRAINT, space.WAY)
        )
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
            out[row, way : way + len(one.way)] = one.way
        return out

    def conditions_vary(self) -> bool:
        """Whether a node condition follows a table or a function."""
        return any(isinstance(value, str) for one in self.acting() for value in asdict(one).values())

    def loads_at(self, time: float) -> np.ndarray:
        """The table of tractions at a moment, columns `TRACTIONS`."""
        names = TRACTIONS[self.dim]
        return np.array([[self._now(getattr(one, name), time) for name in names] for one in self.loads])

    def gravity_down(self) -> float:
        """Gravity against the last axis [m/s2]."""
        return -(self.options.gz if self.dim == 3 else self.options.gy)

    def stressed(self, faces: np.ndarray) -> np.ndarray:
        """Those of these faces (k,) on which a stress is prescribed, bool: the total of what acts there."""
        names = ("normal", "dip", *COMPONENTS[self.dim])
        rows = [any(getattr(one, name) != 0.0 for name in names) for one in self.loads]
        return np.array(rows)[self.load_row[faces]]

    def quiet_faces(self) -> np.ndarray:
        """(4 ne,) bool: faces with dashpots."""
        return np.array([one.quiet for one in self.loads])[self.load_row]

    def _now(self, value: Number, time: float) -> float:
        if isinstance(value, str):
            return 0.0 if value in FUNCTIONS else self.tables[value](time)  # of functions see `Placed`
        return value

    # ---- state on disk -------------------------------------------------------------------------------------------

    def definition_state(self) -> dict[str, Any]:
        """All but the arrays, as JSON values."""
        return {
            "options": asdict(self.options),
            "slid": [[face, *values] for face, values in sorted(self.slid.items())],
            "tables": {name: table.pairs() for name, table in self.tables.items()},
            "fields": {name: _plain(asdict(field)) for name, field in self.fields.items()},
            "varied": self.varied,
            "softening": [table.pairs() for table in self.followed],
            "softening_over": [table.over for table in self.followed],
            "element_rows": self.element_rows.state(),
            "face_rows": self.face_rows.state(),
            "joint_rows": self.joint_rows.state(),
            "conditions": [asdict(one) for one in self.conditions],
            "sided": self.sided,
            "loads": [asdict(one) for one in self.loads],
            "fading": [
                {**asdict(one), "corner": one.corner.tolist(), "force": one.force.tolist()} for one in self.relaxations
            ],
        }

    def take_definition_state(self, state: dict[str, Any]) -> None:
        """Inverse of `definition_state`."""
        self._closed = None
        self.options = Options(**state["options"])
        self.slid = {int(row[0]): tuple(row[1:]) for row in state.get("slid", [])}
        self.tables = {name: Table.of(pairs, name) for name, pairs in state["tables"].items()}
        self.fields = {name: RandomField(**_bounds(field)) for name, field in state.get("fields", {}).items()}
        self.varied = [list(one) for one in state.get("varied", [])]
        followed = [Table.of(pairs) for pairs in state.get("softening", [])]
        over = state.get("softening_over", [""] * len(followed))
        self.followed = [replace(table, over=name) for table, name in zip(followed, over, strict=True)]
        self.element_rows = Rows.restored(state["element_rows"])
        self.face_rows = Rows.restored(state["face_rows"])
        self.joint_rows = Rows.restored(state["joint_rows"])
        self.conditions = [NodeCondition(**{**one, "way": tuple(one["way"])}) for one in state["conditions"]]
        if "sided" not in state:
            self.conditions = [node_conditions.as_before(one, self.dim) for one in self.conditions]
        self.sided, self._acting = state.get("sided", False), None
        self.loads = [Traction(**one) for one in state["loads"]]
        self.relaxations = [
            Relaxation(
                np.array(one["corner"], np.int64), np.array(one["force"]).reshape(len(one["corner"]), -1),
                one["begin"], one["span"], one["in_steps"],
            )
            for one in state["fading"]
        ]  # fmt: skip


def _row_of(rows: list, wanted: Any) -> int:
    """The row of this one, a new one if there is none."""
    if wanted not in rows:
        rows.append(wanted)
    return rows.index(wanted)


def _takes_back(changes: Mapping[str, Any]) -> bool:
    """Nothing is prescribed any more by such a condition: that is so of the whole node."""
    return changes.get("constraint") == moving.UNBOUND or any(
        name.startswith("force") and value == 0.0 for name, value in changes.items()
    )


def place(at: np.ndarray) -> str:
    """As messages say it."""
    return f"({', '.join(f'{c:g}' for c in at)})"


def _is_number(value: Value) -> bool:
    return not isinstance(value, (Over, Drawn, np.ndarray))


def _differs(value: Value) -> bool:
    """From object to object."""
    return isinstance(value, Drawn) or (isinstance(value, Over) and value.axis < PLASTIC_STRAIN)


def _can_be_number(value: Any) -> bool:
    try:
        np.asarray(value, np.float64)
    except (TypeError, ValueError):
        return False
    return True


_OPEN = {"least": -math.inf, "greatest": math.inf}
"""JSON knows no infinity."""


def _plain(field: dict[str, Any]) -> dict[str, Any]:
    return {name: None if value == _OPEN.get(name, 0) and name in _OPEN else value for name, value in field.items()}


def _bounds(field: dict[str, Any]) -> dict[str, Any]:
    return {name: _OPEN[name] if value is None else value for name, value in field.items()}


def finite(what: str, values: list) -> np.ndarray:
    try:
        numbers = np.array(values, np.float64)
    except (TypeError, ValueError):
        raise CommandError(f"{what} must be a number, got {values}") from None
    if not np.isfinite(numbers).all():
        raise CommandError(f"{what} must be finite, got {', '.join(f'{v:g}' for v in numbers)}")
    return numbers


def _keep_moduli(old: dict[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Which two moduli stay when some are changed: Young's modulus and Poisson's ratio, or shear and bulk modulus."""
    creeps = "maxwell_shear" in old
    rigidities = ["maxwell_shear" if creeps else "shear", "bulk"]
    moduli = ["young", "poisson_ratio", *rigidities]
    changed = [name for name in moduli if name in given]
    stays = {name: value for name, value in old.items() if name not in moduli}
    if not changed:
        pair = moduli if creeps else ["young", "poisson_ratio"]
    elif len(changed) == 1:
        pair = ["young", "poisson_ratio"] if changed[0] in ("young", "poisson_ratio") else rigidities
    else:
        pair = []
    stays.pop("kelvin_strain_zz", None)  # it follows
    return {**stays, **{name: old[name] for name in pair}, **given}

"""Models and properties of elements, faces and joints, tables and random fields that they follow."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.memory import sparse_zeros
from hpcdem.numerics.random_field import RandomField
from hpcdem.physics.fdem import properties
from hpcdem.physics.fdem.node_conditions import Number
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
from hpcdem.physics.fdem.settings import Settings
from hpcdem.physics.fdem.tables import AXES, PLASTIC_STRAIN, TEMPERATURE, Drawn, Over, Table, Value
from hpcdem.physics.fdem.topology import Numbers, finite
from hpcdem.physics.fdem.user_functions import FUNCTIONS

COMPONENTS = {2: ("xx", "yy", "xy", "zz"), 3: ("xx", "yy", "xy", "zz", "xz", "yz")}
"""Components of stress, in the order of all tables, by dimensions of space."""
ACROSS = 3
"""Index of the component zz in that order."""
Column = tuple[Any, ...]
"""Name of an array of the rows of tables, and the columns in which objects store their row: indices (n,), of joints on
both sides."""
SLIDING = (COULOMB_JOINT.name, BARTON_BANDIS.name)
"""Models of joints that slide and never break."""


class Assignments(Settings):
    """Models and properties assigned to objects: rows of tables, and the row of each object. Methods that assign raise
    CommandError, alike on all ranks, and change nothing then."""

    tables: dict[str, Table]
    fields: dict[str, RandomField]

    def clear_assignments(self) -> None:
        """Remove all models."""
        self.tables, self.fields = {}, {}
        self.varied: list[list[str]] = []
        """Kinds of objects and properties of theirs that differ from object to object by a table or a field."""
        self.followed: list[Table] = []
        """Tables over plastic strain or temperature, as they were given: rows hold their numbers, from 1 on."""
        self.element_rows, self.face_rows, self.joint_rows = Rows(), Rows(), Rows()
        self._make_assignments(0)

    def _make_assignments(self, elements: int) -> None:
        self.element_row = np.zeros(elements, np.int32)
        self.face_row = sparse_zeros(4 * elements, np.int32)
        self.stress0 = None
        self.stress0_row = sparse_zeros(elements, np.int32)
        """Row of the element models for whose moduli it was set; 0: the element had no model yet."""

    def set_element_model(self, elements: Numbers, name: str, properties: Mapping[str, Value]) -> None:
        """Assign a model (model.blocks.properties) with all its properties to elements."""
        model = MODELS.get(name)
        if model is not None and self.dim not in model.dims:
            raise CommandError(
                f"{model.doc} is not for {self.dim} dimensions: element_law(dim={self.dim}) declares one that is"
            )
        at = self.numbers_of_elements(elements)
        self.refuse_laws(at, name, properties)
        self._assign(self.element_rows, ("element_row", at), at, ELEMENT, name, properties)
        self._note_moduli(at)

    def refuse_laws(self, at: np.ndarray, name: str, properties: Mapping[str, Value]) -> None:
        """CommandError if a macro-element among these elements (n,) cannot have this model ("": the one that it has)
        with these properties."""
        mesh = self._mesh()
        only = mesh.macro.only(name, [word for word, value in properties.items() if _follows_field(value)])
        if only and len(bad := at[mesh.macro_of()[at] >= 0]):
            first = mesh.of_one(bad[:1])[0]
            raise CommandError(
                f"the {mesh.macro.name} of elements {first} to {first + mesh.macro.stored - 1} can have {only}"
            )

    def yielding(self) -> np.ndarray:
        """(ne,) bool: elements that are there and have a model that can yield."""
        return self._has_model(MECH_MOHR_COULOMB)

    def creeping(self) -> np.ndarray:
        """(ne,) bool: elements that are there and have a model that can creep."""
        return self._has_model(MECH_BURGERS)

    def slides(self) -> np.ndarray:
        """(4 ne,) bool: joints, by their lower faces, with a model that slides and never breaks."""
        names = [self.joint_rows.name(row) for row in range(len(self.joint_rows))]
        return self._of_rows(np.isin(names, SLIDING), self.joint_row, self.joint_exists)

    def _has_model(self, model: Model) -> np.ndarray:
        names = [self.element_rows.name(row) for row in range(len(self.element_rows))]
        return self._of_rows(np.array([name == model.name for name in names]), self.element_row, lambda: self.alive)

    @staticmethod
    def _of_rows(rows: np.ndarray, row: np.ndarray, there: Callable[[], np.ndarray]) -> np.ndarray:
        """(n,) bool: which of the objects that are there have one of these rows (k,) bool. Costs nothing for none."""
        return there() & rows[row] if rows.any() else sparse_zeros(len(row), bool)

    def softens(self) -> bool:
        """Return whether an existing element can yield and has a strength that follows a table."""
        rows = softening_rows(self.element_rows)
        return bool(self._of_rows(rows, self.element_row, lambda: self.alive).any())

    def temperature_dependent(self) -> tuple[np.ndarray, np.ndarray]:
        """Elements (ne,) and joints (4 ne,) bool with a property that follows a table over temperature or another
        field."""
        elements, joints = (
            np.any(
                [rows.column(temperature_table(p.name)) > 0.0 for p in of.properties if p.temperature_dependent], axis=0
            )
            for rows, of in ((self.element_rows, MECH_MOHR_COULOMB), (self.joint_rows, COHESIVE))
        )
        return (
            self._of_rows(elements, self.element_row, lambda: self.alive),
            self._of_rows(joints, self.joint_row, self.joint_exists),
        )

    def _note_moduli(self, at: np.ndarray) -> None:
        """Initial stresses of elements that had no model belong to the moduli of the one that they have now; where
        nothing was assigned to the stress across the plane, it is that of plane strain, in plane stress 0."""

        def note() -> tuple[np.ndarray, np.ndarray | None]:
            new = at[self.stress0_row[at] == 0]
            self.stress0_row[new] = self.element_row[new]
            if self.stress0 is not None:
                new = at[np.isnan(self.stress0[at, ACROSS]) & (self.element_row[at] > 0)]
                nu = np.nan_to_num(self.element_rows.column("poisson_ratio"))[self.element_row[new]]
                nu = 0.0 * nu if self.options.plane_stress else nu
                self.stress0[new, ACROSS] = nu * (self.stress0[new, 0] + self.stress0[new, 1])
            return self.stress0_row, self.stress0

        self.stress0_row, self.stress0 = self.per_node(note)

    def element_property(self, elements: Numbers, properties: Mapping[str, Value]) -> None:
        """Change some properties of elements that have a model. The stress follows the strain (total form)."""
        at = self.numbers_of_elements(elements)
        self.refuse_laws(at, "", properties)
        self._adjust(self.element_rows, ("element_row", at), at, ELEMENT, properties, _keep_moduli)

    def face_model(self, faces: Numbers, name: str, properties: Mapping[str, Value]) -> None:
        """Assign a contact model to faces, also to those that will be free only when a joint breaks."""
        at = self.numbers_of_faces(faces)
        self._assign(self.face_rows, ("face_row", at), at, FACE, name, properties)

    def face_property(self, faces: Numbers, properties: Mapping[str, Value]) -> None:
        """Change some properties of the contact model of faces; None: of all that have one."""
        if faces is None:
            faces = self.per_node(lambda: np.flatnonzero((self.face_row > 0) & self.face_exists()))
        at = self.numbers_of_faces(faces)
        self._adjust(self.face_rows, ("face_row", at), at, FACE, properties)

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
                f"face-joint {cracks[0]} at ({at}) is a crack ({len(cracks)} in all), so {name.replace('_', '-')} has "
                "no effect there. Use mesh create embed instead of crack, or exclude cracks by a range"
            )

    def joint_property(self, joints: Numbers, properties: Mapping[str, Value]) -> None:
        """Change some properties of joints that have a model; None: of all that have one."""
        if joints is None:
            joints = self.per_node(lambda: np.flatnonzero((self.joint_row > 0) & self.joint_exists()))
        at = self.numbers_of_joints(joints)
        self._adjust(self.joint_rows, self._both_sides(at), at, JOINT, properties)

    def _both_sides(self, joints: np.ndarray) -> Column:
        return "joint_row", joints, self.per_node(lambda: self.partner[joints])

    def _assign(
        self, rows: Rows, column: Column, of: np.ndarray, on: str, name: str, given: Mapping[str, Value],
        topology: bool = False,
    ) -> None:  # fmt: skip
        """Give objects a model."""
        model = properties.model(name, on)
        values = self.complete(on, of, model, {}, given)
        which = np.arange(len(of)) if len(values) > 1 else np.zeros(1, np.int64)
        self._put_rows(rows, column, [(which, model, values)], on, given, which)
        self.changed(topology)

    def _adjust(
        self, rows: Rows, column: Column, of: np.ndarray, on: str, given: Mapping[str, Value],
        keep: Callable[[dict[str, Any], Mapping[str, Any]], dict[str, Any]] | None = None,
    ) -> None:  # fmt: skip
        """Change properties of objects that have a model; keep: what stays of the old ones beside the new."""
        if not len(of):
            raise CommandError(f"no {on} has a model whose properties could be changed: assign {on} c-model first")

        def find() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            old = getattr(self, column[0])[column[1]]
            bare = of[old == 0]
            if len(bare):
                raise CommandError(f"{on} {bare[0]} has no model whose properties could be changed")
            return old, *np.unique(old, return_inverse=True)

        old, present, which = self.per_node(find)
        names = np.array([rows.name(row) for row in present.tolist()])
        which = which.reshape(-1)
        if not all(map(_is_number, given.values())):
            old, names, which = old, names[which], np.arange(len(of))  # one set for each object
        else:
            old, of = present, of[np.unique(which, return_index=True)[1]]  # one for each that exists
        made = []
        for name in np.unique(names).tolist():
            at, model = np.flatnonzero(names == name), properties.MODELS[name]
            before = {p.name: rows.column(p.name)[old[at]] for p in model.properties}
            made.append((at, model, self.complete(on, of[at], model, before, given, keep)))
        self._put_rows(rows, column, made, on, given, which)
        self.changed()

    def _put_rows(
        self, rows: Rows, column: Column, made: Sequence[tuple[np.ndarray, Model, np.ndarray]], on: str,
        given: Mapping[str, Value], which: np.ndarray,
    ) -> None:  # fmt: skip
        """Make rows of complete sets of properties, (1, k) for all of these places or one for each, and give each
        object the one at the place `which` (n,), or (1,) for all."""
        self.before_change()
        number = np.zeros(sum(len(at) for at, *_ in made), np.int32)
        for at, model, values in made:
            number[at] = rows.numbers(model, values)

        def put() -> np.ndarray:
            array: np.ndarray = getattr(self, column[0])
            for at in column[1:]:
                array[at] = number[which]
            return array

        setattr(self, column[0], self.per_node(put))
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
                raise CommandError(f"{name} is for {'three' if self.dim == 2 else 'two'} dimensions")
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
            elif isinstance(value, Over) and _follows_field(value):
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
        """Expand a value to one number for each object."""
        if isinstance(value, Over):
            if value.table not in self.tables:
                self._value(name, value.table)
            places = self._places(on, of)
            if value.axis >= self.dim:
                self._only_in_space(f"{name}: a table over {AXES[value.axis]} ('{value.table}')", value)
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

    def _now(self, value: Number, time: float) -> float:
        if isinstance(value, str):
            return 0.0 if value in FUNCTIONS else self.tables[value](time)  # of functions see `Placed`
        return value

    def table(self, name: str, pairs: Sequence[tuple[float, float]]) -> None:
        """Make or replace a table of (time [s], value)."""
        made = Table.of(pairs, name)
        self.before_change()
        self.tables[name] = made
        self.changed(stiffness=False)


def _is_number(value: Value) -> bool:
    return not isinstance(value, (Over, Drawn, np.ndarray))


def _follows_field(value: Value) -> bool:
    """A table over temperature or another field."""
    return isinstance(value, Over) and value.axis >= TEMPERATURE


def _differs(value: Value) -> bool:
    """Return whether a value differs between objects."""
    return isinstance(value, Drawn) or (isinstance(value, Over) and value.axis < PLASTIC_STRAIN)


def _can_be_number(value: Any) -> bool:
    try:
        np.asarray(value, np.float64)
    except (TypeError, ValueError):
        return False
    return True


def _keep_moduli(old: dict[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Choose the two moduli that stay when some are changed: Young's modulus and Poisson's ratio, or shear and bulk
    modulus."""
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

"""Laws of elements that users write, in a Python file of their own.

    from hpcdem import Property, StateVariable, element_law

    @element_law(
        properties=[Property("limit", "Pa", "yield stress in shear", low_itself=False)],
        state=[StateVariable("slip", "1", "plastic shear")],
    )
    def clay(e11, e22, e12, slip, bulk, shear, limit):
        ...
        return s11, s22, s12, s33, slip

A law is compiled by numba. It takes numbers by these names and returns the stress [Pa] that belongs to them, tension
positive, and then its state variables in the order in which they were declared:

- e11, e22, e12: strain U - 1 in the frame that turns with the element (with small strains: that of the mesh); evol:
  its volume strain, e11 + e22, in a quad that of the overlay, which the built-in laws take;
- its state variables, as they are after the step before;
- what it needs of the properties that every solid has (density, damp_factor, young, poisson_ratio, shear, bulk,
  friction, penalty) and of its own;
- i11, i22, i12, i33: initial stress [Pa], which is added to what the law returns; dt: time step [s], 0 in static runs.

A law of space, @element_law(dim=3), takes e11, e22, e12, e33, e13, e23, of i11 to i23 what it needs, and returns s11,
s22, s12, s33, s13, s23; evol is e11 + e22 + e33. Its strain is that without thermal expansion.

It is called once per step and element, of a quad for each of its four triangles, of a hexahedron for each of its ten
tetrahedra. The time step follows from
`stiffness`: a number [Pa], or a function of properties, that the slope of the law is never above; without it
lambda + 2 mu of the moduli.

Only the file is known by its text: a law has the name FILE:FUNCTION and a digest of the text, which stands in
checkpoints. The file named in a checkpoint is never opened: the script names the file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import properties as known
from hpcdem.physics.fdem.properties import ELEMENT, MODELS, USER, Model, Property
from hpcdem.physics.user_files import (
    MARK,
    Declared,
    StateVariable,
    UnknownLaw,
    Wrong,
    agreed,
    check_what_returns,
    checked,
    in_turn,
    law_of,
    made_of,
    numba_message,
    stiffness_of,
)
from hpcdem.runtime import kept

if TYPE_CHECKING:
    from hpcdem.physics.fdem.properties import Rows
    from hpcdem.physics.fdem.state import State

BOUND = "stiffness bound"
"""The property of a law's elements that the time step follows; a name that no law can declare."""
VOLUME, STEP = "evol", "dt"
STRAIN = {2: ("e11", "e22", "e12"), 3: ("e11", "e22", "e12", "e33", "e13", "e23")}
INITIAL = {2: ("i11", "i22", "i12", "i33"), 3: ("i11", "i22", "i12", "i33", "i13", "i23")}
STRESS = {2: ("s11", "s22", "s12", "s33"), 3: ("s11", "s22", "s12", "s33", "s13", "s23")}
"""By dimensions, as `NORMAL`: places of normal components."""
NORMAL = {2: (0, 1), 3: (0, 1, 3)}
COLUMN = "law"
"""Of `State.cold`: 1 + the place of the element's law in `of_rows`, then its state variables; where there are quads,
those of each of their four triangles, triangles have the first; where there are hexahedra those of two of their ten
tetrahedra, see elements/kind.py."""
OWN = "own"
"""Of the tables of properties, see kernels/user_laws.py."""
ACROSS = 1e-9
"""Stress across the plane over that in it that is rounding."""
STEP_OF_STRAIN = 1e-9
"""For the slope of a law at zero strain."""
_COMPILED: set[tuple[str, int, str]] = set()
"""Laws whose loops are compiled in this process, for so many threads and elements of this kind."""
_SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
_TINY: dict[str, tuple[Any, Any]] = {
    "triangle": (_SQUARE[:3], [[0, 1, 2, -1]]),
    "quad": (_SQUARE, [[0, 1, 2, 3]]),
    "tetrahedron": (np.eye(4, 3), [[3, 0, 1, 2]]),
    "hexahedron": (np.eye(4, 3), [[3, 0, 1, 2]]),
}
"""By kinds of elements, points and cells for which the loops of a law are compiled; those over hexahedra need none."""
OF_LAW = "law_"
"""How state variables are called as quantities."""


@dataclass(frozen=True)
class _Declared(Declared):
    """A law of elements; dim: dimensions that it is for."""

    dim: int = 2


@dataclass(frozen=True)
class UserLaw(Model):
    """A law of a file. title: FILE:FUNCTION; columns: of the table of properties; loops, evaluate: compiled,
    see kernels/user_laws.py."""

    title: str = ""
    states: tuple[StateVariable, ...] = ()
    columns: tuple[str, ...] = ()
    loops: Any = None
    evaluate: Any = None

    def table(self, rows: Rows) -> np.ndarray:
        """The table of properties of the kernels, flat; elements with other models have rows of zeros."""
        own = np.array([rows.name(row) == self.name for row in range(len(rows))])
        columns = [own if name == OWN else np.where(own, rows.column(name), 0.0) for name in self.columns]
        return np.ascontiguousarray(np.array(columns, float).T).reshape(-1)


def element_law(
    properties: Sequence[Property] = (),
    state: Sequence[StateVariable] = (),
    stiffness: float | Callable[..., float] | None = None,
    dim: int = 2,
) -> Callable[[Callable[..., Any]], Declared]:
    """Declares a function as law of elements: properties of its own, state variables, and what its slope is never above
    [Pa], a number or a function of properties (by their names); dim: 2 or 3, dimensions that it is for."""
    return lambda function: _Declared(
        getattr(function, "py_func", function), tuple(properties), tuple(state), stiffness, dim
    )


def load(sim: State, path: Path, law: str) -> UserLaw:
    """The law 'file.py:function' of a file, checked, on all ranks from the text that rank 0 reads; its loops are
    compiled once elements have it, see `compile_loops`. CommandError with file and line. Collective."""

    def take(text: str, path: str, name: str, function: str) -> UserLaw:
        found = MODELS.get(name)
        if found is None:
            found = MODELS[name] = _made(text, path, name, function)
            _COMPILED.difference_update([one for one in _COMPILED if one[0] == name])
        assert isinstance(found, UserLaw)
        return found

    return agreed(sim, path, law, "law", take)


def _made(text: str, path: str, name: str, function: str) -> UserLaw:
    """The law of a text. Wrong."""
    declared = law_of(text, path, name, function, _Declared, "element_law")
    if declared.dim not in STRAIN:
        raise Wrong(declared.line, f"dim of a law is 2 or 3, got {declared.dim!r}")
    base, strain = [p.name for p in USER.properties], STRAIN[declared.dim]
    arguments = checked(declared, Property, base, (*strain, VOLUME, *INITIAL[declared.dim], STEP), strain)
    return _compiled(declared, name, path, tuple(arguments), declared.line)


def _compiled(declared: _Declared, name: str, path: str, names: tuple[str, ...], line: int) -> UserLaw:
    from numba import njit
    from numba.core.errors import NumbaError

    kernel = njit(error_model="numpy", nogil=True)(declared.function)
    from hpcdem.physics.fdem.kernels import user_laws as kernels

    wanted = [*STRESS[declared.dim], *(s.name for s in declared.state)]
    columns = [p.name for p in (*USER.properties, *declared.properties) if p.name in names] + [OWN]
    columns += [OWN] * (-len(columns) % 4)
    states = [s.name for s in declared.state]
    evaluate = kernels.at_strain(kernel, names, states, columns, declared.dim)
    loops = kernels.loops(kernel, names, states, columns, declared.dim)
    values, place = made_of(kernel, path), None
    if values is not None:
        place = kept.folder(name, values, repr((names, states, columns, declared.dim)))
        kept.keep(evaluate, place, "evaluate")
        for what, made in loops._asdict().items():
            if made is not None:
                kept.keep(made.one, place, what)
                kept.keep(made.several, place, f"{what}_threaded")
    if place is None or not kept.knows(place, "evaluate"):  # what is kept has passed this
        check_what_returns(kernel, len(names), wanted, path, line)
    try:
        rest = np.zeros(len(STRAIN[declared.dim])), np.zeros(len(states))
        evaluate(np.zeros((0, len(columns))), *rest, np.zeros((0, len(wanted))))
    except NumbaError as error:
        raise Wrong(line, numba_message(error)) from None
    title, _, _ = name.partition(MARK)
    bound = Property(BOUND, "Pa", "upper bound of the slope of the law", optional=True, low_itself=False,
                     internal=True)  # fmt: skip

    def derive(values: dict[str, Any]) -> None:
        known._elastic(values)
        file, _, function = title.rpartition(":")
        _derive(declared, f"{file}:{line}: law '{function}'", evaluate, columns, values)

    return UserLaw(
        name, ELEMENT, f"the law of {title}", (*USER.properties, *declared.properties, bound), derive, title=title,
        dims=(declared.dim,), states=declared.state, columns=tuple(columns), loops=loops,
        evaluate=evaluate,
    )  # fmt: skip


def _derive(declared: _Declared, law: str, evaluate: Any, columns: Sequence[str], values: dict[str, Any]) -> None:
    """The stiffness bound of properties (numbers or arrays), and a look at the law at zero strain. law: its place and
    name. CommandError."""
    shape = np.broadcast_shapes(*(np.shape(value) for value in values.values()))
    full = {name: np.broadcast_to(np.asarray(value, float), shape).reshape(-1) for name, value in values.items()}
    n = full["bulk"].size
    modulus = full["bulk"] + 4.0 / 3.0 * full["shear"]
    declared_stiffness = stiffness_of(declared, law, full, "Pa")
    bound = modulus if declared_stiffness is None else declared_stiffness
    table = np.ascontiguousarray(np.array([full.get(name, np.ones(n)) for name in columns]).T)
    begin = np.array([state.initial for state in declared.state])
    stress, strain = STRESS[declared.dim], STRAIN[declared.dim]
    width = len(stress) + len(begin)
    what = (*stress, *(state.name for state in declared.state))

    def at(k: int, size: float) -> np.ndarray:
        out, e = np.empty((n, width)), np.zeros(len(strain))
        e[k] = size
        evaluate(table, e, begin, out)
        return out

    rest = at(0, 0.0)
    wrong = ~np.isfinite(rest)
    if wrong.any():
        i, k = np.argwhere(wrong)[0]
        described = ", ".join(f"{name} {full[name][i]:g}" for name in columns if name != OWN)
        raise CommandError(f"{law}: {what[k]} is {rest[i, k]:g} at zero strain with {described}")
    for k in NORMAL[declared.dim]:
        for small in (STEP_OF_STRAIN, -STEP_OF_STRAIN):
            slope = (at(k, small)[:, k] - rest[:, k]) / small
            steep = ~(slope <= bound * (1.0 + 1e-6) + 1e-12 * np.abs(rest[:, k]) / STEP_OF_STRAIN)
            if steep.any():
                i = int(np.flatnonzero(steep)[0])
                raise CommandError(
                    f"{law}: d{what[k]}/d{strain[k]} is {slope[i]:g} Pa at zero strain, above its stiffness "
                    f"{bound[i]:g} Pa, which sets the time step: give element_law a larger stiffness="
                )
    values[BOUND] = bound.reshape(shape) if shape else float(bound[0])


def _compile(law: UserLaw, blocks: State, kinds: Collection[str]) -> None:
    """The loops over elements of these kinds with arguments of the types that they will have: those of a tiny model of
    the class and the threads of `blocks`."""
    from hpcdem.physics.fdem.mesh import Mesh  # brings kernels

    for kind in kinds:
        sim: Any = type(blocks)(SerialComm(), blocks.threads)
        sim.take_mesh(Mesh.of(*_TINY[kind]))
        sim.set_element_model(None, "mech_iso_elastic", {"density": 1.0, "young": 1.0, "poisson_ratio": 0.0})
        sim.close_model()
        sim.local.laws.trying(law, kind)
        sim.local.forces()
        _COMPILED.add((law.name, blocks.threads, kind))


# ---- of a model ------------------------------------------------------------------------------------------------------


def of_rows(rows: Rows) -> list[UserLaw]:
    """Laws of users among the models of elements, in the order in which they came: the same on all ranks."""
    names = dict.fromkeys(name for name, _ in rows.rows if MARK in name)
    return [law for name in names if isinstance(law := MODELS[name], UserLaw)]


def numbers(sim: State) -> np.ndarray:
    """(ne,) 1 + the place of the law of each element in `of_rows`; 0: it is not a user's."""
    place = {law.name: 1 + k for k, law in enumerate(of_rows(sim.element_rows))}
    return np.array([place.get(name, 0) for name, _ in sim.element_rows.rows], np.int64)[sim.element_row]


def in_use(sim: State) -> list[UserLaw]:
    """User laws of present elements."""
    found = np.unique(numbers(sim)[sim.alive])
    return [law for k, law in enumerate(of_rows(sim.element_rows)) if 1 + k in found]


def check_plane_stress(sim: State) -> None:
    """CommandError for a law in use that gives a stress across the plane of a model in plane stress: it has no strain
    there by which that could be made 0."""
    for law in in_use(sim):
        table = law.table(sim.element_rows).reshape(-1, len(law.columns))
        table = table[table[:, law.columns.index(OWN)] == 1.0]
        out = np.empty((len(table), len(STRESS[2]) + len(law.states)))
        for strain in ((1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0), (-1e-3, -2e-3, 1e-3)):
            law.evaluate(table, np.array(strain), np.array([state.initial for state in law.states]), out)
            across = np.abs(out[:, 3])
            if (across > ACROSS * np.abs(out[:, :3]).max(axis=1)).any():
                raise CommandError(
                    f"law {law.title} gives a stress s33 of {across.max():g} Pa at the strain e11, e22, e12 {strain}: "
                    "in plane stress it must be 0, and s11, s22 those that belong to it"
                )


def some(sim: State) -> str:
    """Name an element that has a user law, for messages."""
    return f"element {np.flatnonzero((numbers(sim) > 0) & sim.alive)[0]}"


def begin(sim: State) -> None:
    """State variables of owned elements whose law is another one than before begin with their initial values."""
    laws = of_rows(sim.element_rows)
    if not laws:
        return
    n, parts = len(sim.number), sim.element_parts
    width = max(len(law.states) for law in laws)
    before = sim.cold.get(COLUMN, np.zeros((n, 1)))
    then = before[:, 1:].reshape(n, parts, -1) if before.shape[1] > 1 else np.zeros((n, parts, 0))
    states = np.zeros((n, parts, max(width, then.shape[2])))
    states[:, :, : then.shape[2]] = then
    now = numbers(sim)[sim.number].astype(np.float64)
    for k, law in enumerate(laws):
        new = (now == 1 + k) & (before[:, 0] != now)
        states[new] = 0.0
        states[new, :, : len(law.states)] = [state.initial for state in law.states]
    sim.cold[COLUMN] = np.column_stack([now, states.reshape(n, -1)])


def _kinds(sim: State, law: UserLaw, some: np.ndarray) -> list[str]:
    """Kinds of the selected elements (ne,) bool."""
    simple, several = ("triangle", "quad") if law.dims == (2,) else ("tetrahedron", "hexahedron")
    mesh = sim.the_mesh()
    whole = mesh.cells[:, 3] >= 0 if mesh.dim == 2 else np.zeros(len(mesh.cells), bool)
    if mesh.dim == 3 and len(mesh.hexes):
        whole = mesh.macro_of() >= 0
    return [kind for kind, there in ((simple, not whole[some].all()), (several, whole[some].any())) if there]


def compile_loops(sim: State) -> None:
    """Compile the loops over elements of the kinds that have user laws, unless compiled already. Collective."""
    laws = of_rows(sim.element_rows)
    number = numbers(sim) if laws else np.empty(0, np.int64)
    for k, law in enumerate(laws):
        some = sim.alive & (number == 1 + k)
        kinds = _kinds(sim, law, some) if some.any() else []
        missing = [kind for kind in kinds if (law.name, sim.threads, kind) not in _COMPILED]
        if not sim.comm.any(len(missing) > 0):
            continue
        spent = in_turn(sim.comm, lambda law=law, missing=missing: _compile(law, sim, missing))  # type: ignore[misc]
        if spent and sim.log is not None:
            sim.log.info(f"law {law.title} is compiled for {' and '.join(kinds)} elements: {spent:.1f} s")


def forget(sim: State, mine: np.ndarray) -> None:
    """State variables of owned elements (bool) take their initial values at the next `begin`."""
    if COLUMN in sim.cold:
        sim.cold[COLUMN][mine, 0] = 0.0


def quantity(sim: State, variable: str) -> str:
    """The name as quantity of a state variable. CommandError unless a law that elements have has one of this name."""
    found = quantities(sim)
    if OF_LAW + variable not in found:
        known_ = ", ".join(name.removeprefix(OF_LAW) for name in found) or "none"
        raise CommandError(f"no user law of the elements has a state variable '{variable}'; available: {known_}")
    return OF_LAW + variable


def quantities(sim: State) -> list[str]:
    """State variables of the laws that elements have, as quantities."""
    return list(dict.fromkeys(OF_LAW + state.name for law in in_use(sim) for state in law.states))


def unit(name: str) -> str:
    """Unit of such a quantity."""
    laws = [law for law in MODELS.values() if isinstance(law, UserLaw)]
    return next(state.unit for law in reversed(laws) for state in law.states if OF_LAW + state.name == name)


def values(sim: State, name: str, memory: np.ndarray) -> np.ndarray:
    """Such a quantity of the owned elements (n_own,), NaN for those whose law has no such variable; memory (n_own, 1 +
    states): see `begin`, of quads the mean of their triangles."""
    out = np.full(len(memory), math.nan)
    for k, law in enumerate(of_rows(sim.element_rows)):
        names = [OF_LAW + state.name for state in law.states]
        if name in names:
            mine = memory[:, 0] == 1 + k
            out[mine] = memory[mine, 1 + names.index(name)]
    return out


def check_restored(state: Mapping[str, Any]) -> None:
    """UnknownLaw unless the laws that rows of a checkpoint name are there, with the same texts."""
    for name, _ in state["element_rows"]:
        if MARK not in name or name in MODELS:
            continue
        title = name.partition(MARK)[0]
        other = any(one.partition(MARK)[0] == title for one in MODELS)
        raise UnknownLaw(
            f"the checkpoint has elements with the law {title}, "
            + (
                f"but {title.rpartition(':')[0]} has changed since: a run cannot resume with a changed law"
                if other
                else "which this script does not use: add element law 'FILE:FUNCTION' before model restore"
            )
        )

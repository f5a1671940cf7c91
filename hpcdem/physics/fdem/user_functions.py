"""Boundary conditions as functions of place and time, which users write in a Python file of their own.

    def wave(x, y, t):
        return 0.1 * math.sin(300.0 * t - x)

A function takes numbers by these names: x, y, in space z [m]: where the node, or the middle of the face, lies in the
mesh (it stays the same when things move, as in ranges of commands); t [s]: model time, at which tables are read too. It
returns one number in the unit of the condition. It is compiled by numba and evaluated in each step at the nodes and
faces that have it. Files are read, named in checkpoints and refused as those of laws (user_files.py).
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.user_files import MARK, UnknownLaw, Wrong, agreed, compiled, executed

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from hpcdem.engine.model import Model

ARGUMENTS = "x", "y", "z", "t"


@dataclass(frozen=True)
class UserFunction:
    """title: FILE:FUNCTION; arguments: their names; loop: a kernel (places (n, 3), t, out (n,))."""

    title: str
    arguments: tuple[str, ...]
    loop: Any

    def at(self, places: np.ndarray, time: float) -> np.ndarray:
        """Values (n,) at places (n, 2), in space (n, 3) [m] and a time [s]."""
        out, wide = np.empty(len(places)), np.zeros((len(places), 3))
        wide[:, : places.shape[1]] = places
        self.loop(wide, float(time), out)
        return out


FUNCTIONS: dict[str, UserFunction] = {}
"""Those that were loaded, by name and digest."""


def load(sim: Model, path: Path, function: str) -> str:
    """The name of the function 'file.py:function' of a file, which is checked and compiled, on all ranks from the text
    that rank 0 reads. CommandError with file and line. Collective."""
    return agreed(sim, path, function, "function", _take)


def _take(text: str, path: str, name: str, function: str) -> str:
    if name not in FUNCTIONS:
        FUNCTIONS[name] = _made(text, path, name, function)
    return name


def _made(text: str, path: str, name: str, function: str) -> UserFunction:
    from numba import njit, types

    made = executed(text, path, name).get(function)
    made = getattr(made, "py_func", made)
    if not inspect.isfunction(made):
        raise Wrong(0, f"there is no function '{function}' in it")
    line = made.__code__.co_firstlineno
    names = tuple(inspect.signature(made).parameters)
    if not names or set(names) - set(ARGUMENTS):
        raise Wrong(
            line,
            f"a boundary condition must be a function of {', '.join(ARGUMENTS)}, but '{function}' is a function of "
            f"{names}",
        )
    kernel = njit(error_model="numpy", nogil=True)(made)
    found = compiled(kernel, (types.float64,) * len(names), path, line)
    if found != types.float64:
        raise Wrong(line, f"'{function}' must return one float (0.0, not 0), it returns {found}")
    call = njit(error_model="numpy")(lambda at, *arguments: kernel(*arguments))
    for argument in names:
        call = _with_one_more(call, ARGUMENTS.index(argument))

    @njit(error_model="numpy", nogil=True)
    def loop(places, t, out):
        for i in range(len(places)):
            out[i] = call((places[i, 0], places[i, 1], places[i, 2], t))

    compiled(loop, (types.float64[:, ::1], types.float64, types.float64[::1]), path, line)
    return UserFunction(name.partition(MARK)[0], names, loop)


def _with_one_more(call: Any, k: int) -> Any:
    """A function of where and when (x, y, z, t), and more numbers, that calls one with the k-th before them."""
    from numba import njit

    return njit(error_model="numpy")(lambda at, *arguments: call(at, at[k], *arguments))


def check(what: str, value: Any, places: np.ndarray, time: float) -> None:
    """CommandError if a value is a function that is not finite at one of these places (n, 2 or 3) [m] now, or asks for
    a coordinate that they do not have."""
    if not isinstance(value, str) or value not in FUNCTIONS:
        return
    function = FUNCTIONS[value]
    axes = "xyz"[: places.shape[1]]
    if "z" in function.arguments and "z" not in axes:
        raise CommandError(
            f"{what}: {function.title} is a function of z, and a model in two dimensions has x and y only"
        )
    found = function.at(places, time)
    wrong = ~np.isfinite(found)
    if wrong.any():
        where = ", ".join(f"{axis} {c:g}" for axis, c in zip(axes, places[wrong][0].tolist()))
        raise CommandError(f"{what}: {function.title} is {found[wrong][0]:g} at {where}, t {time:g}")


def used(one: DataclassInstance) -> dict[str, UserFunction]:
    """Functions of a condition by the name of the field."""
    given = asdict(one).items()
    return {field: FUNCTIONS[value] for field, value in given if isinstance(value, str) and value in FUNCTIONS}


def check_restored(state: Mapping[str, Any]) -> None:
    """UnknownLaw unless the functions that conditions of a checkpoint name are there, with the same texts."""
    for one in (*state["conditions"], *state["loads"]):
        for value in one.values():
            if isinstance(value, str) and MARK in value and value not in state["tables"] and value not in FUNCTIONS:
                title = value.partition(MARK)[0]
                raise UnknownLaw(
                    f"the checkpoint has conditions that follow the function {title}, which this script does not use "
                    "with the same text: add node function 'FILE:FUNCTION' before model restore"
                )


class Placed:
    """Rows of a table of conditions for each object whose condition is a function: behind those of all.

    conditions: by row; of (n,): row of each object; places (n, 2 or 3) [m]. After that `of` are the new rows.
    """

    def __init__(self, conditions: Sequence[DataclassInstance], of: np.ndarray, places: np.ndarray) -> None:
        functions = [used(one) for one in conditions]
        at = np.flatnonzero(np.array([bool(one) for one in functions])[of])
        self.rows = of[at]
        self.of = of.copy()
        self.of[at] = len(conditions) + np.arange(len(at))
        self.parts = []
        for row in np.unique(self.rows).tolist():
            mine = np.flatnonzero(self.rows == row)
            for field, function in functions[row].items():
                self.parts.append((conditions[row], field, function, mine, places[at[mine]]))

    def filled(self, table: np.ndarray, how: Callable[[Any, str], tuple[int, float, float]]) -> np.ndarray:
        """The table with these rows; how: column, time [s] and factor of a field of a condition."""
        if not len(self.rows):
            return table
        extra = table[self.rows]
        for one, field, function, mine, places in self.parts:
            column, time, factor = how(one, field)
            extra[mine, column] = function.at(places, time) * factor
        return np.concatenate([table, extra])

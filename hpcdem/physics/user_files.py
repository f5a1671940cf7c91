"""Python files of users: laws of elements and of pairs of discs, conditions. Rank 0 reads them, and all ranks execute
that text.

Only the file is known by its text: what it defines has the name FILE:FUNCTION and a digest of the text, which stands in
checkpoints. The file named in a checkpoint is never opened: the script names the file.
"""

from __future__ import annotations

import builtins
import hashlib
import inspect
import math
import re
import socket
import sys
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.runtime.kept import store
from hpcdem.runtime.kernels import turn_of
from hpcdem.runtime.launch import patient_barrier

if TYPE_CHECKING:
    from hpcdem.core.comm import Comm
    from hpcdem.engine.model import Model

REPORT_SECONDS = 0.1
"""Seconds of compiling that the log tells."""
MARK = "#"
"""Between the name of a law and the digest of its text."""
Made = TypeVar("Made")
LawKind = TypeVar("LawKind", bound="Declared")


@dataclass(frozen=True)
class StateVariable:
    """State variable of an element or a contact; initial: its value when the element gets the law, or discs touch."""

    name: str
    unit: str
    doc: str = ""
    initial: float = 0.0


@dataclass(frozen=True)
class Declared:
    """A function that is declared as a law, with properties and state variables of its own; stiffness: what it is never
    stiffer than, a number or a function of properties."""

    function: Callable[..., Any]
    properties: tuple[Any, ...]
    state: tuple[StateVariable, ...]
    stiffness: float | Callable[..., float] | None

    @property
    def line(self) -> int:
        """Return where its function begins in its file."""
        return self.function.__code__.co_firstlineno


class Wrong(Exception):
    """Error in a file; line: 0 if it has none."""

    def __init__(self, line: int, message: str) -> None:
        super().__init__(message)
        self.line = line


class UnknownLaw(CommandError):
    """A checkpoint has a law that was not named before."""


def agreed(sim: Model, path: Path, what: str, kind: str, take: Callable[[str, str, str, str], Made]) -> Made:
    """Return the result of `take` for (text, path, name with digest, function) of 'file.py:function', on all ranks from
    the text that rank 0 reads. kind: what it is, in messages. CommandError with file and line. Collective."""
    file, _, function = what.rpartition(":")
    if not file.endswith(".py") or not function.isidentifier():
        raise CommandError(f"a {kind} is named 'file.py:function', got '{what}'")
    text, problem = "", ""
    if sim.comm.rank == 0:
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            problem = f"{file} cannot be read: {getattr(error, 'strerror', None) or error}"
    text, problem = sim.comm.bcast((text, problem))
    if problem:
        raise CommandError(problem)
    name = f"{Path(file).name}:{function}{MARK}{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    message, made = None, []

    def act() -> None:
        nonlocal message
        try:
            made.append(take(text, str(path), name, function))
        except Wrong as wrong:
            message = f"{file}:{wrong.line}: {wrong}" if wrong.line else f"{file}: {wrong}"

    spent = in_turn(sim.comm, act)
    try:
        sim.comm.agree(message)
    except HpcdemError as error:
        raise CommandError(str(error)) from None
    report(sim, kind, Path(file).name, function, spent)
    return made[0]


def report(sim: Model, kind: str, file: str, function: str, spent: float) -> None:
    """Report in the log what was compiled, of which file and function, in how many seconds; nothing of 0."""
    if spent and sim.log is not None:
        sim.log.info(f"{kind} {file}:{function} is compiled: {spent:.1f} s")


def in_turn(comm: Comm, act: Callable[[], None]) -> float:
    """Call act on one rank of each machine type first, then on one of each host, then on the rest, so that the others
    load what the first compile (`made_of`). Returns the seconds that compilation took if that is worth a report, else
    0. Collective."""
    from numba.core import event

    began = time.perf_counter()
    turn = turn_of(comm.allgather((socket.gethostname(), store()[0].name)), comm.rank)
    with event.install_recorder("numba:compile") as compiling:
        for now in range(3):
            if now == turn:
                act()
            patient_barrier(comm)
    spent = time.perf_counter() - began
    return spent if compiling.buffer and spent > REPORT_SECONDS else 0.0


def made_of(function: Callable[..., Any], path: str) -> str | None:
    """Return the sources of a function of the file `path` when it is compiled, besides the text of the file: values of
    the global names that it and the functions that it calls use. None if there is something among them of another file,
    or for which this is unknown: then compiled code must not be kept."""
    parts: list[str] = []
    seen: set[FunctionType] = set()

    def describe(name: str, thing: Any) -> bool:
        options = getattr(thing, "targetoptions", None)
        thing = getattr(thing, "py_func", thing)
        if isinstance(thing, FunctionType):
            parts.append(f"{name}: {thing.__qualname__} {options and sorted(options.items())}")
            if thing in seen:
                return True
            seen.add(thing)
            cells = zip(thing.__code__.co_freevars, thing.__closure__ or ())
            used = [(f"{name}.{free}", cell.cell_contents) for free, cell in cells]
            used += [(f"{name} {k}", value) for k, value in enumerate(thing.__defaults__ or ())]
            used += [(one, thing.__globals__[one]) for one in _names(thing.__code__) if one in thing.__globals__]
            return thing.__code__.co_filename == path and all(describe(*one) for one in used)
        if any(thing is one for one in (math, np, *vars(builtins).values(), *vars(math).values())):
            parts.append(f"{name}: {thing!r}")
            return True
        if type(thing) is tuple:
            return all(describe(f"{name}[{k}]", value) for k, value in enumerate(thing))
        parts.append(f"{name}: {thing!r}")
        return type(thing) in (bool, int, float)

    return "\n".join(parts) if describe("", function) else None


def _names(code: CodeType) -> list[str]:
    """Names that are used in it and in what is defined in it."""
    inner = [one for const in code.co_consts if isinstance(const, CodeType) for one in _names(const)]
    return [*code.co_names, *inner]


def executed(text: str, path: str, name: str) -> dict[str, Any]:
    """The names of a text of the user, after it ran. Wrong."""
    code: Any
    try:
        code = compile(text, path, "exec")
    except (SyntaxError, ValueError) as error:
        raise Wrong(getattr(error, "lineno", 0) or 0, f"{getattr(error, 'msg', error)}") from None
    module = ModuleType(f"law of {name}")
    module.__file__ = path
    try:
        exec(code, vars(module))
    except (Exception, SystemExit) as error:  # whatever the user's own code does
        raise Wrong(_last_line(error, path), _message(error)) from None
    sys.modules[module.__name__] = module  # where numba looks for the modules of kernels that were kept
    return vars(module)


def law_of(text: str, path: str, name: str, function: str, kind: type[LawKind], decorator: str) -> LawKind:
    """The law of this kind of a text, declared by a decorator of this name. Wrong."""
    names = executed(text, path, name)
    if function not in names:
        laws = [key for key, value in names.items() if isinstance(value, kind)]
        raise Wrong(0, f"there is no law '{function}' in it; available: {', '.join(laws) or 'none'}")
    declared = names[function]
    if isinstance(declared, kind):
        return declared
    code = getattr(getattr(declared, "function", declared), "__code__", None)
    line = code.co_firstlineno if code is not None and code.co_filename == path else 0
    raise Wrong(line, f"'{function}' is not declared as a law: write @{decorator}(), with brackets, before it")


def checked(
    declared: Declared, of: type, base: Sequence[str], given: Sequence[str], needed: Sequence[str]
) -> list[str]:
    """The names of the arguments of a law, in their order. Wrong.

    of: class of properties; base: properties that exist anyway; given: other arguments, of which it must take those
    of `needed`."""
    line, own, states = declared.line, declared.properties, declared.state
    for kind, things, wanted in (("property", own, of), ("state variable", states, StateVariable)):
        strange = [thing for thing in things if not isinstance(thing, wanted)]
        if strange:
            raise Wrong(line, f"a {kind} is declared by {wanted.__name__}(...), got {strange[0]!r}")
    every = [*base, *(p.name for p in own), *(s.name for s in states), *given]
    for name in (*(p.name for p in own), *(s.name for s in states)):
        if not isinstance(name, str) or not name.isidentifier():
            raise Wrong(line, f"{name!r} cannot be the name of an argument")
        if every.count(name) > 1:
            raise Wrong(line, f"'{name}' is reserved or declared twice: choose another name")
    for state in states:
        if not math.isfinite(state.initial):
            raise Wrong(line, f"state variable '{state.name}': its initial value {state.initial} is not finite")
    arguments = inspect.signature(declared.function).parameters
    for argument in arguments.values():
        if argument.kind is not inspect.Parameter.POSITIONAL_OR_KEYWORD or argument.name not in every:
            raise Wrong(line, f"'{argument}' is not an argument of a law; available: {', '.join(every)}")
        if argument.default is not inspect.Parameter.empty:
            raise Wrong(
                line, f"'{argument}': arguments of a law cannot have defaults; use {of.__name__}(..., default=)"
            )
    lost = [one for one in (*needed, *(s.name for s in states)) if one not in arguments]
    if lost:
        raise Wrong(line, f"the law does not accept {', '.join(lost)}")
    takes = set(arguments)
    if callable(declared.stiffness):
        takes_too = inspect.signature(declared.stiffness).parameters
        others = [n for n in takes_too if n not in {*base, *(p.name for p in own)}]
        if others:
            raise Wrong(line, f"stiffness accepts properties only, and '{others[0]}' is not a property")
        takes |= set(takes_too)
    idle = [p.name for p in own if p.name not in takes]
    if idle:
        raise Wrong(line, f"property '{idle[0]}' is declared, but neither the law nor its stiffness uses it")
    return list(arguments)


def check_what_returns(kernel: Any, count: int, wanted: Sequence[str], path: str, line: int, what: str = "law") -> None:
    """Wrong unless a kernel of `count` floats returns as many as wanted; what: it is."""
    from numba import types

    found: Any = compiled(kernel, (types.float64,) * count, path, line)
    given = list(getattr(found, "types", [found]))
    if len(given) != len(wanted) or not isinstance(found, types.BaseTuple):
        raise Wrong(line, f"the {what} must return {len(wanted)} numbers ({', '.join(wanted)}), it returns {found}")
    for one, type_ in zip(wanted, given):
        if type_ != types.float64:
            raise Wrong(line, f"the {what} must return {one} as a float (0.0, not 0), it returns {type_}")


def stiffness_of(declared: Declared, law: str, values: Mapping[str, np.ndarray], unit: str) -> np.ndarray | None:
    """Return the largest stiffness of a law (n,) for properties (n,) by name; None if it does not say. law: its place
    and name. CommandError."""
    if declared.stiffness is None:
        return None
    if callable(declared.stiffness):
        of = list(inspect.signature(declared.stiffness).parameters)
        n = len(next(iter(values.values())))
        bound = np.empty(n)
        for i in range(n):
            try:
                bound[i] = float(declared.stiffness(**{name: float(values[name][i]) for name in of}))
            except (Exception, SystemExit) as error:  # the user's own code
                raise CommandError(f"{law}: its stiffness fails: {_message(error)}") from None
    else:
        bound = np.full(len(next(iter(values.values()))), float(declared.stiffness))
    wrong = ~(np.isfinite(bound) & (bound > 0.0))
    if wrong.any():
        raise CommandError(f"{law}: its stiffness must be a number above 0 ({unit}), got {bound[wrong][0]:g}")
    return bound


def compiled(kernel: Any, types: Any, path: str, line: int) -> Any:
    """Compile a kernel for arguments of these types; the type that it returns. Wrong, at `line` if numba knows none."""
    from numba.core.errors import NumbaError

    try:
        kernel.compile(types)
    except NumbaError as error:
        raise Wrong(_numba_line(error, path) or line, numba_message(error)) from None
    except Exception as error:  # numba hands on what its passes meet in the user's own code
        raise Wrong(line, f"numba: {type(error).__name__}: {error}") from None
    return kernel.overloads[tuple(types)].signature.return_type


def _message(error: BaseException) -> str:
    """Return the message of an error in a user's code."""
    if isinstance(error, SystemExit):
        code = "" if error.code is None else repr(error.code)
        return f"sys.exit({code}) would end the whole run: remove it"
    return f"{type(error).__name__}: {error}"


def _last_line(error: BaseException, path: str) -> int:
    lines = [at.lineno or 0 for at in traceback.extract_tb(error.__traceback__) if at.filename == path]
    return lines[-1] if lines else 0


def _numba_line(error: Any, path: str) -> int:
    """The line of the file in what numba says, the last one: that of the cause."""
    found = re.findall(r'File "([^"\n]+)", line (\d+)', re.sub(r"\x1b\[[0-9;]*m", "", str(error)))
    lines = [int(line) for file, line in found if Path(file).name == Path(path).name]
    place = getattr(error, "loc", None)
    if not lines and place is not None and place.line is not None and str(place.filename).endswith(Path(path).name):
        return int(place.line)
    return lines[-1] if lines else 0


def numba_message(error: Any) -> str:
    """Without colours, its first lines in one."""
    lines = [line.strip() for line in re.sub(r"\x1b\[[0-9;]*m", "", str(error)).splitlines()]
    parts = [line for line in lines if line and not line.startswith(("File ", "Failed in nopython", "During:", "^"))]
    return "numba: " + " ".join(parts[:2]).partition(" def ")[0].replace(">>> ", "")

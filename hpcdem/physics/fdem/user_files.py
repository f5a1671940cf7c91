"""Python files of users: laws of elements, conditions. Rank 0 reads them, and all ranks execute that text.

Only the file is known by its text: what it defines has the name FILE:FUNCTION and a digest of the text, which stands in
checkpoints. What a checkpoint names is never looked for: the script names the file.
"""

from __future__ import annotations

import builtins
import hashlib
import math
import re
import socket
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.runtime.kernels import cache_folder, turn_of
from hpcdem.runtime.launch import patient_barrier

if TYPE_CHECKING:
    from hpcdem.physics.model import Model

TOLD = 0.1
"""Seconds of compiling that the log tells."""
MARK = "#"
"""Between the name of a law and the digest of its text."""
Made = TypeVar("Made")


class Wrong(Exception):
    """What is wrong with a file; line: 0 if it has none."""

    def __init__(self, line: int, message: str) -> None:
        super().__init__(message)
        self.line = line


class UnknownLaw(CommandError):
    """A checkpoint has a law that was not named before."""


def agreed(sim: Model, path: Path, what: str, kind: str, take: Callable[[str, str, str, str], Made]) -> Made:
    """What `take` makes of (text, path, name with digest, function) of 'file.py:function', on all ranks from the text
    that rank 0 reads. kind: what it is, in messages. CommandError with file and line. Collective.

    One rank of each machine type goes first, then one of each host, then the rest: what the first ones compile is kept
    for the others (`made_of`)."""
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
    from numba.core import event

    began, message, made = time.perf_counter(), None, []
    turn = turn_of(sim.comm.allgather((socket.gethostname(), cache_folder()[0].name)), sim.comm.rank)
    with event.install_recorder("numba:compile") as compiling:
        for now in range(3):
            if now == turn:
                try:
                    made.append(take(text, str(path), name, function))
                except Wrong as wrong:
                    message = f"{file}:{wrong.line}: {wrong}" if wrong.line else f"{file}: {wrong}"
            patient_barrier(sim.comm)
    try:
        sim.comm.agree(message)
    except HpcdemError as error:
        raise CommandError(str(error)) from None
    spent = time.perf_counter() - began
    if compiling.buffer and spent > TOLD and sim.log is not None:
        sim.log.info(f"{kind} {Path(file).name}:{function} is compiled: {spent:.1f} s")
    return made[0]


def made_of(function: Callable[..., Any], path: str) -> str | None:
    """What a function of the file `path` is made of when it is compiled, besides the text of the file: values of the
    global names that it and the functions that it calls use. None if there is something among them of another file, or
    of which that cannot be told: then what is compiled must not be kept."""
    told: list[str] = []
    seen: set[FunctionType] = set()

    def tell(name: str, thing: Any) -> bool:
        options = getattr(thing, "targetoptions", None)
        thing = getattr(thing, "py_func", thing)
        if isinstance(thing, FunctionType):
            told.append(f"{name}: {thing.__qualname__} {options and sorted(options.items())}")
            if thing in seen:
                return True
            seen.add(thing)
            cells = zip(thing.__code__.co_freevars, thing.__closure__ or ())
            used = [(f"{name}.{free}", cell.cell_contents) for free, cell in cells]
            used += [(f"{name} {k}", value) for k, value in enumerate(thing.__defaults__ or ())]
            used += [(one, thing.__globals__[one]) for one in _names(thing.__code__) if one in thing.__globals__]
            return thing.__code__.co_filename == path and all(tell(*one) for one in used)
        if any(thing is one for one in (math, np, *vars(builtins).values(), *vars(math).values())):
            told.append(f"{name}: {thing!r}")
            return True
        if type(thing) is tuple:
            return all(tell(f"{name}[{k}]", value) for k, value in enumerate(thing))
        told.append(f"{name}: {thing!r}")
        return type(thing) in (bool, int, float)

    return "\n".join(told) if tell("", function) else None


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
    except Exception as error:  # whatever the user's own code does
        raise Wrong(_last_line(error, path), f"{type(error).__name__}: {error}") from None
    sys.modules[module.__name__] = module  # where numba looks for the modules of kernels that were kept
    return vars(module)


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
    told = [line for line in lines if line and not line.startswith(("File ", "Failed in nopython", "During:", "^"))]
    return "numba: " + " ".join(told[:2]).partition(" def ")[0].replace(">>> ", "")

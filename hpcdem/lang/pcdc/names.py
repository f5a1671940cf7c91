"""Variables and functions of a script whose names begin with ``m_``: they are saved with the model.

Variables are numbers, texts, truth values and vectors. A function is saved as the text of its ``def``. Whoever restores
a file takes these functions into his script: they are Python that is run when the script calls them, like the script
itself, so a file is restored only from a source that one would take a script from. Nothing of it runs by restoring:
what is not a plain ``def`` (no decorator, nothing but plain values as defaults, no annotations) is refused.
"""

from __future__ import annotations

import ast
import math
import textwrap
from collections.abc import Iterator, Mapping
from types import FunctionType
from typing import Any

from hpcdem.core.errors import CommandError
from hpcdem.lang.pcdc.source import Source
from hpcdem.lang.pcdc.vector import Vector

PREFIX = "m_"
LONGEST = 1_000_000
"""Largest number of characters of a function."""


def collected(namespace: Mapping[str, Any], sources: Mapping[str, Source]) -> tuple[dict[str, Any], list[str]]:
    """Collect the variables of a namespace to be saved, as JSON values, and the reasons why other m_ names are not.

    sources: scripts by file name, to find the text of functions in. CommandError for a function that could not be
    restored.
    """
    variables: dict[str, Any] = {}
    functions: dict[str, str] = {}
    left_out: list[str] = []
    for name, value in namespace.items():
        if not name.startswith(PREFIX):
            continue
        if isinstance(value, FunctionType):
            functions[name] = _text(name, value, sources)
            continue
        kept = _kept(value)
        if kept is None:
            left_out.append(
                f"{name} is not saved: it is a {type(value).__name__}, not a number, text, truth value or Vector"
            )
        else:
            variables[name] = kept
    return {"variables": variables, "functions": functions}, left_out


def _kept(value: Any) -> list[Any] | None:
    """[kind, value], or None for what cannot be kept. Numbers of numpy become those of Python."""
    kind = type(value).__name__
    if isinstance(value, bool) or kind in ("bool_", "bool"):
        return ["bool", bool(value)]
    if isinstance(value, Vector):
        return ["Vector", [_number(v) for v in value]]
    if isinstance(value, str):
        return ["str", str(value)]
    if isinstance(value, int) or (hasattr(value, "dtype") and value.ndim == 0 and value.dtype.kind in "iu"):
        return ["int", str(int(value))]
    if isinstance(value, float) or (hasattr(value, "dtype") and value.ndim == 0 and value.dtype.kind == "f"):
        return ["float", _number(value)]
    return None


def _number(value: float) -> float | str:
    """JSON has no infinity."""
    return float(value) if math.isfinite(value) else repr(float(value))


def _text(name: str, function: FunctionType, sources: Mapping[str, Source]) -> str:
    """Return the def of a function as written in its script."""
    code = function.__code__
    source = sources.get(code.co_filename)
    if source is not None:
        for node in ast.walk(ast.parse(source.python)):
            if isinstance(node, ast.FunctionDef) and code.co_firstlineno in (node.lineno, *_decorators(node)):
                lines = source.lines[node.lineno - 1 : node.end_lineno]
                text = textwrap.dedent("\n".join(lines))
                if node.name != name:
                    raise CommandError(f"{name} cannot be saved: it is an alias of the function {node.name}")
                if code.co_freevars:
                    raise CommandError(
                        f"{name} cannot be saved: it uses {code.co_freevars[0]} of the function around it"
                    )
                checked(name, node)
                return text
    raise CommandError(f"{name} cannot be saved: it is not a function defined by a def of the script")


def _decorators(node: ast.FunctionDef) -> list[int]:
    return [decorator.lineno for decorator in node.decorator_list]


def checked(name: str, node: ast.AST) -> None:
    """CommandError unless a syntax tree is a plain def of this name, which does nothing when it is made."""
    if not isinstance(node, ast.FunctionDef) or node.name != name or not name.startswith(PREFIX):
        raise CommandError(f"{name} is not a plain def of that name")
    if node.decorator_list:
        raise CommandError(f"{name} has a decorator: only a plain def can be saved and restored")
    arguments = node.args
    for default in (*arguments.defaults, *(d for d in arguments.kw_defaults if d is not None)):
        if not _is_plain(default):
            raise CommandError(
                f"{name} has the default value {ast.unparse(default)}: only numbers, texts, True, False and None can "
                "be saved and restored"
            )
    every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs, arguments.vararg, arguments.kwarg]
    if node.returns is not None or any(a is not None and a.annotation is not None for a in every):
        raise CommandError(f"{name} has annotations: only a plain def can be saved and restored")


def _is_plain(node: ast.expr) -> bool:
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.UAdd, ast.USub)):
        node = node.operand
    return isinstance(node, ast.Constant) and isinstance(node.value, (int, float, str, bool, type(None)))


def restored_variables(names: Mapping[str, Any]) -> dict[str, Any]:
    """The variables in what `collected` made. CommandError for what it cannot have made."""
    found: dict[str, Any] = {}
    for name, kept in _items(names, "variables"):
        try:
            kind, value = kept
            found[name] = _MADE[kind](value)
        except (KeyError, TypeError, ValueError) as error:
            raise CommandError(f"the file is damaged: variable {name} is {kept!r:.60}") from error
    return found


def restored_functions(names: Mapping[str, Any]) -> dict[str, str]:
    """The texts of the functions in what `collected` made; their defs are checked by `checked`, once they are read."""
    found: dict[str, str] = {}
    for name, text in _items(names, "functions"):
        if not isinstance(text, str) or len(text) > LONGEST:
            raise CommandError(f"the file is damaged: {name} is not the text of a function")
        found[name] = text
    return found


def plain_def(name: str, source: Source) -> None:
    """CommandError unless the Python text of a source is one plain def of this name."""
    body = ast.parse(source.python).body
    if len(body) != 1:
        raise CommandError(f"the text of {name} is not one def, but {len(body)} statements")
    checked(name, body[0])


def _items(names: Mapping[str, Any], what: str) -> Iterator[tuple[str, Any]]:
    given = names.get(what, {})
    if not isinstance(given, dict):
        raise CommandError(f"the file is damaged: its {what} are not a table")
    for name, value in given.items():
        if not (isinstance(name, str) and name.startswith(PREFIX) and name.isidentifier()):
            raise CommandError(f"the file is damaged: {name!r:.60} is no name that can be restored")
        yield name, value


def _float(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise TypeError
    return float(value)


def _typed(kind: type) -> Any:
    def made(value: Any) -> Any:
        if type(value) is not kind:
            raise TypeError
        return value

    return made


_MADE = {
    "bool": _typed(bool),
    "str": _typed(str),
    "int": lambda value: int(_typed(str)(value)),
    "float": _float,
    "Vector": lambda value: Vector(*(_float(v) for v in value)),
}

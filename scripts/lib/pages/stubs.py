"""What editors and mypy see of methods that are made from the table of a language: hpcdem/__init__.pyi,
hpcdem/api/blocks.pyi and particles.pyi."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterable, Iterator
from inspect import Parameter
from pathlib import Path
from types import ModuleType
from typing import Any

import hpcdem
from hpcdem.api import blocks, particles
from hpcdem.api.methods import Models
from hpcdem.api.objects import quantities

WIDTH = 120
_HEAD = '''\
"""{doc}

Made by ``scripts/pages``; do not edit it."""

'''
_NAMES = {
    "collections.abc": ("Callable", "Iterable", "Mapping", "Sequence"),
    "typing": ("Any", "Literal", "Unpack", "overload"),
    "hpcdem.api.types": ("File", "Number", "Piece", "Point", "Selected", "Value", "Where"),
    "hpcdem.commands.fdem": ("Project",),
    "hpcdem.core.material": ("Material",),
}
"""What signatures are written with."""


def files() -> dict[Path, str]:
    """Every stub, by its path."""
    folder = Path(hpcdem.__file__).parent
    made = {folder / f"api/{module.__name__.rpartition('.')[2]}.pyi": stub(module) for module in (blocks, particles)}
    return {folder / "__init__.pyi": top(), **made}


def top() -> str:
    """Of the package, whose names are loaded when they are first used."""
    doc = inspect.getdoc(hpcdem) or ""
    names = [f"from {module} import {name} as {name}" for name, module in hpcdem._NAMES.items()]
    return _HEAD.format(doc=doc) + "\n".join(sorted(names)) + "\n\n_NAMES: dict[str, str]\n"


def stub(module: ModuleType) -> str:
    """Of a module of methods."""
    classes = [of for of in vars(module).values() if inspect.isclass(of) and of.__module__ == module.__name__]
    body = "\n\n".join("\n".join(_class(of)) for of in classes) + "\n"
    bases = {base.__module__: base for of in classes for base in of.__bases__ if base.__module__ != "builtins"}
    own_bases = {where: tuple(sorted({base.__name__ for of in classes for base in of.__bases__})) for where in bases}
    lines = []
    for where, names in {**_NAMES, **own_bases}.items():
        if used := [name for name in names if re.search(rf"\b{name}\b", body)]:
            lines.append(f"from {where} import {', '.join(used)}")
    top = [line for line in lines if "hpcdem" not in line]
    own = [_wrapped(line) for line in sorted(set(lines) - set(top))]
    doc = (inspect.getdoc(module) or "").partition("\n")[0]
    return _HEAD.format(doc=doc) + "\n".join([*top, "", "import numpy as np", "", *own, "", body])


def _wrapped(line: str) -> str:
    if len(line) <= WIDTH:
        return line
    start, _, names = line.partition(" import ")
    return f"{start} import (\n" + "".join(f"    {name},\n" for name in names.split(", ")) + ")"


def _class(of: type) -> Iterator[str]:
    bases = ", ".join(base.__name__ for base in of.__bases__ if base is not object)
    yield f"class {of.__name__}({bases}):" if bases else f"class {of.__name__}:"
    yield from _doc(of, 1)
    for name, kind in inspect.get_annotations(of).items():
        yield f"    {name}: {kind}"
    if names := quantities(getattr(of, "kind", "")):
        literal = ", ".join(f'"{name}"' for name in names)
        first = Parameter("name", Parameter.POSITIONAL_OR_KEYWORD, annotation=f"Literal[{literal}] | str")
        yield from _def("__getitem__", [first], "np.ndarray", "")
    for name, value in vars(of).items():
        made = getattr(value, "made_by", None)
        if isinstance(made, Models):
            yield from _overloads(name, made)
        elif inspect.isfunction(value) and not name.startswith("__"):
            signature = inspect.signature(value)
            yield from _def(name, list(signature.parameters.values())[1:], signature.return_annotation, value)


def _overloads(name: str, made: Models) -> Iterator[str]:
    """One for each model, with its properties."""
    rows = list(made.rows())
    for model, row in rows:
        literal = ", ".join(f'"{word}"' for word in model.keyword.spellings())
        first = Parameter("name", Parameter.POSITIONAL_OR_KEYWORD, annotation=f"Literal[{literal}]")
        if len(rows) > 1:
            yield "    @overload"
        yield from _def(name, [first, *(one.parameter for one in row.arguments)], "None", row.docstring)


def _def(name: str, parameters: list[Parameter], returned: str, doc: Any) -> Iterator[str]:
    parts = ["self", *_parts(parameters)]
    line = f"    def {name}({', '.join(parts)}) -> {returned}:"
    if len(line) > WIDTH:
        line = "\n".join([f"    def {name}(", *(f"        {part}," for part in parts), f"    ) -> {returned}:"])
    text = [] if name.startswith("_") else list(_doc(doc, 2))
    yield from [line, *text] if text else [f"{line} ..."]


def _parts(parameters: Iterable[Parameter]) -> Iterator[str]:
    placed = True
    for one in parameters:
        if one.kind is Parameter.KEYWORD_ONLY and placed:
            placed = False
            yield "*"
        placed = placed and one.kind is not Parameter.VAR_POSITIONAL
        star = "*" if one.kind is Parameter.VAR_POSITIONAL else "**" if one.kind is Parameter.VAR_KEYWORD else ""
        default = " = ..." if callable(one.default) else f" = {one.default!r}"
        default = "" if one.default is Parameter.empty else default
        yield f"{star}{one.name}: {one.annotation}{default}"


def _doc(of: Any, depth: int) -> Iterator[str]:
    """A docstring, in lines of the width of the package."""
    text = of if isinstance(of, str) else inspect.getdoc(of) or ""
    lines = []
    for line in text.split("\n"):
        indent = "    " if " : " in line else ""
        lines += textwrap.wrap(line, WIDTH - 4 * depth - 3, subsequent_indent=indent, break_on_hyphens=False) or [""]
    lines[0] = '"""' + lines[0]
    if len(lines) > 1:
        yield from ("    " * depth + line if line else "" for line in [*lines, '"""'])
    else:
        yield "    " * depth + lines[0] + '"""'

"""Methods that are made from the functions of `hpcdem.commands.dem`: signature and docstring are theirs.

They are read from the text of the module, as most modules there bring kernels, which takes a second, and must not be
imported before the first simulation has settled them.
"""

from __future__ import annotations

import ast
import functools
import inspect
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from inspect import Parameter
from pathlib import Path
from typing import Any, TypeVar

from hpcdem.api.methods import bound, dressed, tokens
from hpcdem.api.program import carried_out, spelt
from hpcdem.commands import dem
from hpcdem.core.errors import CommandError, ScriptError
from hpcdem.core.fields import FIX_BITS
from hpcdem.core.material import Material
from hpcdem.core.place import place
from hpcdem.core.selection import Selection
from hpcdem.lang.zdem.execute import check_units
from hpcdem.lang.zdem.parser import parse_text
from hpcdem.lang.zdem.table import COLORS

MATERIAL_WORDS = tuple(Material.__annotations__)
OF_BOTH = {"start", "save", "restore", "resume", "finish", "cycle", "imple", "energy"}
"""Methods that also apply to models without particles. The others create the particles first: the kernels must be
chosen before the modules that contain some are imported."""
FIELDS_READ = {
    "box": "BOX", "wall": "WALL", "ball": "BALL", "gen": "GEN", "gen_grid": "GEN", "gline": "GLINE", "prop": "PROP",
    "bond": "PROP", "set": "SET",
}  # fmt: skip
"""Methods whose values are checked against declared units, and the commands that define these units."""
Method = TypeVar("Method", bound=Callable[..., Any])
Kind = TypeVar("Kind", bound=type)


# ---- values as functions take them -----------------------------------------------------------------------------------


def color_number(color: str | int | None) -> Any:
    """Return the number of a colour given by name or number; CommandError for others."""
    if color is None or (isinstance(color, int) and color in COLORS.values()):
        return color
    if isinstance(color, str) and color.lower() in COLORS:
        return COLORS[color.lower()]
    raise CommandError(f"expected a colour, {', '.join(f'{n} ({i})' for n, i in COLORS.items())}, got {color!r}")


def _radii(rad: Iterable[float] | float) -> list[float]:
    return [float(r) for r in (rad if isinstance(rad, Iterable) else [rad])]


def _degrees(dofs: tuple[str, ...]) -> tuple[str, ...]:
    wrong = [d for d in dofs if d not in FIX_BITS]
    if wrong or not dofs:
        raise CommandError(f"expected one or more of {', '.join(FIX_BITS)}" + (f", not {wrong[0]!r}" if wrong else ""))
    return dofs


@functools.lru_cache(maxsize=256)
def _parsed(text: str) -> Selection | None:
    return parse_text(f"RES model\nDEL RANGE {text}", "where").statements[1].selection


def selection(where: str | Selection | None) -> Selection | None:
    """Return the selected particles. Raises CommandError for an invalid selection."""
    if where is None or isinstance(where, Selection):
        return where
    if not isinstance(where, str) or "\n" in where:
        raise CommandError(f"where: expected the text of a RANGE or a selection, got {where!r}")
    try:
        return _parsed(where)
    except ScriptError as error:
        raise CommandError(f"where '{where}': {error.message.removeprefix('DEL RANGE: ')}") from None


@dataclass(frozen=True)
class Taken:
    """Conversion of an argument of a method. type: in a signature, a name of `hpcdem.api.types`; make: converts the
    value for the function, from the simulation and the value.
    """

    type: str
    make: Callable[[Any, Any], Any]


TAKEN = {
    "where": Taken("Selected", lambda sim, where: selection(where)),
    "color": Taken("str | int", lambda sim, color: color_number(color)),
    "dofs": Taken("str", lambda sim, dofs: _degrees(dofs)),
    "legend": Taken("File", lambda sim, file: None if file is None else sim._existing(file)),
    "num": Taken("int", lambda sim, num: int(num)),
    "list[float]": Taken("Iterable[float]", lambda sim, radii: _radii(radii)),
}
"""Conversions by name of the argument or by its type."""
READ = Taken("File", lambda sim, file: sim._existing(file))
WRITTEN = Taken("File", lambda sim, file: sim.directory / file)


# ---- methods ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Function:
    """Method made from a function of `hpcdem.commands.dem`.

    order: positional arguments, if they differ from those of the function; ``name?`` is optional though the function
    requires it, ``name!`` is required; the others are keywords. file: how a file name is converted; alone: not allowed
    for particles coupled to blocks; reads_only: the method changes nothing.
    """

    name: str
    order: str = ""
    file: Taken = READ
    alone: bool = False
    reads_only: bool = False

    @functools.cached_property
    def node(self) -> ast.FunctionDef:
        """Syntax tree of the function."""
        module, _, name = self.name.partition(".")
        return _functions(module)[0][name]

    @functools.cached_property
    def own(self) -> list[Parameter]:
        """Arguments of the function."""
        return [one for one in _parameters(self.node, self.name.partition(".")[0]) if one.name != "folder"]

    @functools.cached_property
    def taken(self) -> dict[str, Taken]:
        """Conversions of arguments that are not passed unchanged."""
        known = {**TAKEN, "file": self.file}
        return {one.name: known[key] for one in self.own for key in (one.name, one.annotation) if key in known}

    @functools.cached_property
    def parameters(self) -> list[Parameter]:
        """Parameters of the method."""
        own = {one.name: replaced(one, self.taken.get(one.name)) for one in self.own}
        if not self.order:
            return list(own.values())
        found = []
        for name, mark, _ in tokens(self.order):
            one = own.pop(name)
            if mark == "*":
                one = Parameter(name, Parameter.VAR_POSITIONAL, annotation=one.annotation)
            elif mark:
                one = one.replace(default=None if mark == "?" else Parameter.empty)
                one = one.replace(annotation=_optional(one.annotation) if mark == "?" else one.annotation)
            found.append(one)
        return found + [one.replace(kind=max(one.kind, Parameter.KEYWORD_ONLY)) for one in own.values()]

    @property
    def docstring(self) -> str:
        return ast.get_docstring(self.node) or ""

    def method(self, owner: type, name: str) -> Callable[..., Any]:
        """Make the method for a class."""
        parameters = self.parameters
        more = any(one.kind is Parameter.VAR_KEYWORD for one in parameters)
        known = [one for one in parameters if one.kind is not Parameter.VAR_KEYWORD]
        usual = {one.name: one.default for one in known if one.default is not Parameter.empty}
        module, _, function = self.name.partition(".")
        folder = any(one.arg == "folder" for one in self.node.args.kwonlyargs)

        def call(self_: Any, *values: Any, **options: Any) -> Any:
            given = {**usual, **bound(known, values, options, more)}
            if self.alone:
                self_._refuse_coupled(name)
            engine = self_.engine
            given |= {key: self.taken[key].make(self_, value) for key, value in given.items() if key in self.taken}
            if folder:
                given["folder"] = self_.directory
            return getattr(getattr(dem, module), function)(engine, **given)

        returned = ast.unparse(self.node.returns) if self.node.returns is not None else "None"
        return dressed(call, owner, name, self, parameters, returned)


def _optional(kind: str) -> str:
    return kind if kind.endswith("None") else f"{kind} | None"


def replaced(one: Parameter, taken: Taken | None) -> Parameter:
    """Return an argument of a function as it appears in a method."""
    kind = one.annotation if taken is None else taken.type
    if one.default is None and kind != "Selected":
        kind = _optional(kind)
    return one.replace(annotation=kind)


@functools.cache
def _functions(module: str) -> tuple[dict[str, ast.FunctionDef], dict[str, Any]]:
    """Functions of a module, and the constants that are texts."""
    spec = find_spec(f"hpcdem.commands.dem.{module}")
    assert spec is not None and spec.origin is not None
    body = ast.parse(Path(spec.origin).read_text(encoding="utf-8")).body
    constants = {
        one.targets[0].id: one.value.value
        for one in body
        if isinstance(one, ast.Assign) and isinstance(one.targets[0], ast.Name) and isinstance(one.value, ast.Constant)
    }
    return {one.name: one for one in body if isinstance(one, ast.FunctionDef)}, constants


def _parameters(node: ast.FunctionDef, module: str) -> Iterator[Parameter]:
    """Yield all parameters but the first, the simulation."""
    given = node.args
    placed = given.args[1:]
    defaults = [None] * (len(placed) - len(given.defaults)) + list(given.defaults)
    for how, names, values in (
        (Parameter.POSITIONAL_OR_KEYWORD, placed, defaults),
        (Parameter.KEYWORD_ONLY, given.kwonlyargs, given.kw_defaults),
        (Parameter.VAR_KEYWORD, [given.kwarg] if given.kwarg else [], [None]),
    ):
        for one, value in zip(names, values):
            kind = ast.unparse(one.annotation) if one.annotation is not None else "Any"
            yield Parameter(one.arg, how, default=_value(value, module), annotation=kind)


def _value(node: ast.expr | None, module: str) -> Any:
    """A default; texts may be constants of the module, or of the one that it has them from."""
    if node is None:
        return Parameter.empty
    if isinstance(node, ast.Name):
        return next(of[1][node.id] for of in map(_functions, (module, "particles")) if node.id in of[1])
    return ast.literal_eval(node) if not isinstance(node, ast.Call) else None


def commands(cls: Kind) -> Kind:
    """Turn rows into methods, whose errors name file and line of the program."""
    for name, found in list(vars(cls).items()):
        if isinstance(found, Function):
            setattr(cls, name, command(found.method(cls, name), edits=not found.reads_only))
    return cls


def command(method: Method, edits: bool = True) -> Method:
    """Wrap a command so that its errors, and those of invalid values, name file and line of the program. edits: it may
    change the particles.
    """

    signature = inspect.signature(method)
    names = [name for name, one in signature.parameters.items() if name != "self" and one.kind is not one.VAR_KEYWORD]
    names += MATERIAL_WORDS if "properties" in signature.parameters else ()

    @functools.wraps(method)
    def call(self: Any, *values: Any, **options: Any) -> Any:
        at, options = place(), spelt(options, names)
        if self._engine is not None:
            self._engine.line = at[1]

        def carry_out() -> Any:
            if "properties" in signature.parameters:
                for name in options:
                    if name not in names:
                        raise TypeError(f"got an unexpected keyword argument '{name}'")
            if method.__name__ not in OF_BOTH:
                _ = self.engine
            value = method(self, *values, **options)
            if self._engine is not None and self._engine.settings.units and method.__name__ in FIELDS_READ:
                given = signature.bind(self, *values, **options).arguments
                given |= given.pop("options", {}) | given.pop("properties", {})
                check_units(self._engine, FIELDS_READ[method.__name__], given)
            return value

        def done() -> Any:
            value = carried_out(at, method.__name__, carry_out, names=names)
            if self._engine is not None:
                self._engine.edited |= edits
            return value

        return self._asked((method.__name__, values, options), done)

    return call  # type: ignore[return-value]


def query(method: Method) -> Method:
    """Wrap a command that changes nothing."""
    return command(method, edits=False)

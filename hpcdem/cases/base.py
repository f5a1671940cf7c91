"""Base of all cases: checked parameters, the script text made from them, and its execution.

A case is a pydantic model. Its fields become the first lines of the script (``width = 0.052   # m, ...``), except
choices, which choose between pieces of text. `model` and `loading` are the rest: constant text in which the fields are
variables.
"""

from __future__ import annotations

import dataclasses
import math
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, ValidationError
from pydantic.fields import FieldInfo

from hpcdem.core import validation
from hpcdem.core.errors import CommandError, ScriptError
from hpcdem.core.nearest import hint
from hpcdem.core.place import place

DIVIDER = "# ---- {} "
WIDTH = 100
"""Characters of a comment line."""


def quantity(default: float, unit: str, doc: str, **bounds: Any) -> Any:
    """Declare a parameter with a unit, which becomes a variable of the script. bounds: gt, ge, lt, le."""
    return Field(default, description=doc, json_schema_extra={"unit": unit}, **bounds)


def choice(default: Any, doc: str) -> Any:
    """Declare a parameter that selects between pieces of the script: a truth value or one of several words (Literal),
    never free text, as it is written in a comment of the script.
    """
    return Field(default, description=doc, json_schema_extra={"chooses": True})


def unit_of(field: FieldInfo) -> str:
    """Return the unit of a parameter, "1" for a pure number."""
    extra = field.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def chooses(field: FieldInfo) -> bool:
    """Return whether the field chooses between pieces of text."""
    extra = field.json_schema_extra
    return isinstance(extra, dict) and bool(extra.get("chooses"))


class Case(BaseModel):
    """Parameters of a model. An invalid one raises ScriptError with the line that gave it.

    name: on the command line and of the files; title: one line; needs: extras of the package that the script requires;
    result: a dataclass whose fields are variables of the script after `loading`.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, validate_default=True)

    name: ClassVar[str]
    title: ClassVar[str]
    needs: ClassVar[str] = ""
    result: ClassVar[type[Any]]

    _carrier: Any = PrivateAttr(default=None)

    def __init__(self, **given: Any) -> None:
        try:
            super().__init__(**given)
        except ValidationError as error:
            raise ScriptError(*place(), explained(type(self), error)) from None

    def __setattr__(self, name: str, value: Any) -> None:
        try:
            super().__setattr__(name, value)
        except ValidationError:
            kind = type(self).__name__
            raise ScriptError(
                *place(), f"{kind} cannot be changed: give {name} to the constructor, {kind}({name}={value!r})"
            ) from None

    # ---- text ------------------------------------------------------------------------------------------------------

    def model(self) -> str:
        """Return the lines that make the model: mesh, properties, conditions."""
        raise NotImplementedError

    def loading(self) -> str:
        """Return the lines that load the model and print the result."""
        raise NotImplementedError

    def script(self) -> str:
        """Return the text of a complete script."""
        return "".join(self._pieces())

    def _pieces(self) -> tuple[str, str]:
        """Return the text executed by `build` and the text executed by `load`."""
        head = [f"# {line}".rstrip() for line in self._head()]
        parameters = [self._parameter(name, field) for name, field in self._variables()]
        model = "\n".join([*head, "", _divider("parameters"), *parameters, "", _divider("model"), self.model().strip()])
        return f"{model}\n\n", f"{_divider('loading')}\n{self.loading().strip()}\n"

    def _head(self) -> Iterator[str]:
        yield f"{self.title}."
        yield ""
        yield f"  hpcdem {self.name}.sc       figures, histories and frames in data/"
        yield "  hpcdem movie data"
        yield ""
        yield f"Written by: {self.command()}"
        yield "SI units, tension is positive." + (f" Needs the extra [{self.needs}]." if self.needs else "")

    def command(self) -> str:
        """Return the command line that writes this script."""
        return " ".join([f"hpcdem case {self.name}", *(_option(name, getattr(self, name)) for name in self._given())])

    def _given(self) -> list[str]:
        """Parameters that differ from their defaults."""
        return [name for name, field in type(self).model_fields.items() if getattr(self, name) != field.default]

    def _variables(self) -> Iterator[tuple[str, FieldInfo]]:
        return ((name, field) for name, field in type(self).model_fields.items() if not chooses(field))

    def _parameter(self, name: str, field: FieldInfo) -> str:
        unit = unit_of(field)
        doc = field.description if unit in ("", "1") else f"{unit}, {field.description}"
        return f"{f'{name} = {number(getattr(self, name))}':30s} # {doc}"

    # ---- in the running session ------------------------------------------------------------------------------------

    def build(self) -> None:
        """Make a new model in this run, executed by the calling script or program. Collective."""
        self._build(None)

    def load(self) -> Any:
        """Load the model made by `build` and return the results. Collective."""
        if self._carrier is None:
            raise ScriptError(*place(), f"{type(self).__name__}.load: no model yet. Call build() first")
        model, loading = self._pieces()
        lines = model.count("\n")  # so messages have the lines of the whole script
        self._carrier.carry_out("\n" * lines + loading)
        names = self._carrier.names
        return self.result(**{field.name: names[field.name] for field in dataclasses.fields(self.result)})

    def run(self, outdir: str | Path | None = None) -> Any:
        """Make the model, load it and return the results. Collective.

        outdir: output folder, for programs that run several cases (default: the folder of the session). In a PCDC
        script use the option --outdir.
        """
        self._build(outdir)
        result = self.load()
        if outdir is not None:
            self._carrier.close()
        return result

    def _build(self, outdir: str | Path | None) -> None:
        from hpcdem.cases.run import Carrier

        try:
            self._carrier = Carrier(f"{self.name}.sc", outdir)
        except CommandError as error:
            raise ScriptError(*place(), f"{type(self).__name__}.run: {error}") from None
        self._carrier.carry_out(self._pieces()[0])


def explained(kind: type[Case], error: ValidationError) -> str:
    """Explain the first error of the parameters."""
    first = error.errors()[0]
    if not first["loc"]:  # several that do not go together
        return f"{kind.__name__}: {validation.message(first)}"
    name = str(first["loc"][0])
    known = kind.model_fields
    if name not in known:
        return f"{kind.__name__} has no parameter '{name}'{hint(name, known) or '.'} Known: {', '.join(known)}"
    unit = unit_of(known[name])
    what = known[name].description if unit in ("", "1") else f"{known[name].description}, {unit}"
    expected = validation.message(first) or validation.expected(first)
    return f"{kind.__name__}: {name} is {first['input']}, expected {expected} ({what})"


def number(value: Any) -> str:
    """Return a value as text of a script: 0.052, 2700, 30e9, 5e-6. It reads back as the same number."""
    if isinstance(value, bool) or not isinstance(value, float):
        return repr(value)
    size = abs(value)
    if size == 0.0 or 1e-3 <= size < 1e5:
        text = f"{value:.12g}"
    else:
        power = 3 * math.floor(math.log10(size) / 3)
        text = f"{value / 10.0**power:.12g}e{power}"
    return text if float(text) == value else repr(value)


def _option(name: str, value: Any) -> str:
    word = name.replace("_", "-")
    if isinstance(value, bool):
        return f"--{word}" if value else f"--no-{word}"
    return f"--{word} {shlex.quote(value) if isinstance(value, str) else number(value)}"


def _divider(title: str) -> str:
    return DIVIDER.format(title).ljust(WIDTH, "-")


def refuse_thin_ring(inner: float, outer: float, size: float) -> None:
    """Raise ValueError for a ring between two radii [m] that is too thin for elements of this size [m]."""
    if inner >= 0.9 * outer:
        raise ValueError(f"inner is {inner:g}, expected at most 0.9 of outer, {0.9 * outer:g} m")
    if size > 0.25 * (outer - inner):
        most = 0.25 * (outer - inner)
        raise ValueError(f"size is {size:g}, expected at most a quarter of outer - inner, {most:g} m")

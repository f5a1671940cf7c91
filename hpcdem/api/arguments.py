"""Values of Python as arguments of a PCDC command: the same names, kinds and rules as a line of a script."""

from __future__ import annotations

import functools
import os
from collections.abc import Iterable, Mapping
from typing import Any, get_args

import numpy as np

from hpcdem.core.errors import CommandError, ScriptError
from hpcdem.core.nearest import hint
from hpcdem.lang.pcdc import bindings, parser, rules, trial
from hpcdem.lang.pcdc.keywords import matching
from hpcdem.lang.pcdc.kinds import FunctionName, Kind, TableName, fitting
from hpcdem.lang.pcdc.lexer import short
from hpcdem.lang.pcdc.table import PCDC, Command, Model, Option
from hpcdem.physics.fdem import groups as g
from hpcdem.physics.fdem.tables import AXES, Drawn, Over

Where = str | g.Term | tuple[g.Term, ...] | None
"""Text of a RANGE, or terms of `hpcdem.physics.fdem.groups` that must all be satisfied; None: everything."""
_WORDS = {
    g.ELEMENT: "element",
    g.NODE: "node",
    g.FACE: "element-face",
    g.JOINT: "face-joint",
    **{kind: kind for kind in g.SUPPORTS},
    g.FLOW_NODE: "node",
    g.CHANNEL: "face-joint",
}


def arguments(command: Command, given: Mapping[str, Any], ranged: bool = False, dim: int = 2) -> dict[str, Any]:
    """Check and convert the arguments of a command without models, by their Python names; None is omitted. ranged: the
    command has a range; dim: dimensions of the model. Raises ValueError with the name of the wrong argument,
    CommandError for a value that no model could accept."""
    _there(command.name, command.dims, dim)
    options = (*command.leading, *command.options)
    found = _read(options, given, command.name, dim)
    if command.needs_option and not any(option.name in found for option in command.options):
        raise ValueError(f"needs at least one of {_listed(command.options)}")
    rules.check(command, found, () if ranged else None)
    trial.check(command, _known(found), None)
    return found


def model_arguments(command: Command, name: str, given: Mapping[str, Any], dim: int = 2) -> dict[str, Any]:
    """Arguments of a command that names a constitutive model or condition, checked as those of other commands."""
    _there(command.name, command.dims, dim)
    model = _model(command, name)
    _there(f"model {model.keyword}", model.dims, dim)
    leading = {option.name: given[option.name] for option in model.leading if option.name in given}
    first = _read(model.leading, leading, f"model {model.keyword}", dim)
    given = {name: value for name, value in given.items() if name not in first}
    properties = _read(model.options, given, f"model {model.keyword}", dim)
    if model.any_of and not properties:
        raise ValueError(f"needs at least one of {_listed(model.options)}")
    if model.one_of and not any(all(word in properties for word in words) for words in model.one_of):
        sets = " or ".join(" and ".join(map(trial.python, words)) for words in model.one_of)
        raise ValueError(f"model {model.keyword} needs {sets}")
    found = {"model": model.keyword.name, **first, "properties": properties}
    trial.check(command, {**found, "properties": _known(properties)}, None)
    return found


def _there(word: str, dims: tuple[int, ...], dim: int) -> None:
    if dim not in dims:
        what = "use sim.start(dim=3) for three dimensions" if dim == 2 else "three dimensions are not supported"
        raise ValueError(f"{word} is for {dims[0]} dimensions; {what}")


def _known(given: dict[str, Any]) -> dict[str, Any]:
    """Remove arrays, whose values were checked one by one."""
    return {name: value for name, value in given.items() if not isinstance(value, np.ndarray)}


def _model(command: Command, name: str) -> Model:
    if not isinstance(name, str):
        raise ValueError(f"expected the name of a model, got {name!r}")
    typed = name.replace("_", "-")
    found = matching(typed, command.models)
    if len(found) != 1:
        names = [model.keyword.name for model in command.models]
        raise ValueError(f"there is no model '{name}'; available: {', '.join(names)}{hint(typed, names)}")
    return found[0]


def _read(options: tuple[Option, ...], given: Mapping[str, Any], of: str, dim: int) -> dict[str, Any]:
    """Values by the names of the table, as the parser hands them over."""
    found = {}
    for name, value in given.items():
        if value is None:
            continue
        option = _option(options, name, of)
        if not option.values and not option.more:
            if not isinstance(value, (bool, np.bool_)):
                raise ValueError(f"{name}: expected True or False, got {_shown(value)}")
            if not value:
                continue
        _there(name, option.dims, dim)
        if option.repeated:
            found[option.name] = [_values(option, one, name, dim) for one in _items(value, name)]
        else:
            found[option.name] = _values(option, value, name, dim)
    missing = [option for option in options if option.required and option.name not in found and dim in option.dims]
    if missing:
        raise ValueError(f"{of} needs {_listed(missing)}")
    return {option.name: found[option.name] for option in options if option.name in found}


def _option(options: tuple[Option, ...], name: str, of: str) -> Option:
    typed = name.replace("_", "-")
    for option in options:
        if option.keyword.is_exactly(typed):
            return option
    names = [trial.python(option.name) for option in options]
    raise ValueError(f"{of} has no {name}; it has {', '.join(names)}{hint(name, names)}")


def _values(option: Option, given: Any, name: str, dim: int) -> Any:
    """Return what follows a keyword in a script: one value, a tuple of several, or a dict where more words may
    follow."""
    if option.more:
        parts = given if isinstance(given, dict) and "value" in given else {"value": given}
        more = {word: value for word, value in parts.items() if word != "value"}
        return {"value": _plain(option, parts["value"], name, dim), **_read(option.more, more, name, dim)}
    return _plain(option, given, name, dim)


def _plain(option: Option, given: Any, name: str, dim: int) -> Any:
    kinds = [fitting(kind, dim) for kind in option.values if dim in kind.dims]
    if not kinds:
        return True
    if len(kinds) == 1 and not kinds[0].many:
        return _one(kinds[0], given, name)
    items = _items(given, name)
    if len(kinds) == 1:
        if not items:
            raise ValueError(f"{name}: expected {kinds[0].meaning}, got none")
        return [_one(kinds[0], item, name) for item in items]
    if not len([kind for kind in kinds if not kind.optional]) <= len(items) <= len(kinds):
        raise ValueError(f"{name}: expected {len(kinds)} values, got {_shown(given)}")
    return tuple(_one(kind, item, name) for kind, item in zip(kinds, items))


def _items(given: Any, name: str) -> list[Any]:
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise ValueError(f"{name}: expected a list of values, got {_shown(given)}")
    return list(given)


def _one(kind: Kind, value: Any, name: str) -> Any:
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if kind.varied and isinstance(value, (Over, Drawn)):
        if isinstance(value, Over) and AXES[value.axis] not in kind.axes:
            raise ValueError(f"{name} cannot be a table over {AXES[value.axis]}")
        return value
    if kind.varied and isinstance(value, np.ndarray) and value.ndim == 1:
        return np.array([_one(kind, item, name) for item in value.tolist()], np.float64)
    if kind.tabled and isinstance(value, FunctionName):
        return value
    if kind.tabled and isinstance(value, str):
        return TableName(value)
    try:
        return kind.check(value)
    except (TypeError, ValueError, OverflowError):
        meaning = "True or False" if kind.pattern.strip("[]") == "on|off" else kind.meaning
        raise ValueError(f"{name}: expected {meaning.rstrip(',')}, got {_shown(value)}") from None


def _listed(options: Iterable[Option]) -> str:
    return ", ".join(trial.python(option.name) for option in options)


def _shown(value: Any) -> str:
    return short(repr(value))


# ---- ranges --------------------------------------------------------------------------------------------------------


def chosen_by(where: Where, kind: str) -> g.Range | None:
    """A range of objects of a kind, see `Where`. CommandError for what is none."""
    if where is None:
        return None
    if isinstance(where, str):
        return _parsed(where, kind)
    terms = where if isinstance(where, tuple) else (where,)
    if not terms or not all(isinstance(term, get_args(g.Term)) for term in terms):
        raise CommandError(f"where: expected the text of a RANGE or terms of it, got {_shown(where)}")
    return terms


@functools.lru_cache(maxsize=256)
def _parsed(text: str, kind: str) -> g.Range | None:
    line = f"{_WORDS[kind]} group 'x' range {text}"
    try:
        if "\n" in text:
            raise CommandError(f"where: expected one line, got {_shown(text)}")
        statement = parser.parse(line, "where", 0, "", PCDC, dim=None)
    except ScriptError as error:
        raise CommandError(f"where '{short(text)}': {error.message.removeprefix(': ')}") from None
    if statement.expressions:
        raise CommandError(f"where '{short(text)}': square brackets work in scripts only; use an f-string in Python")
    return bindings.where(statement.range)

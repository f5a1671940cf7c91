"""Methods that are made from rows of the table of the PCDC language, which says what a command takes: its names, kinds,
units, defaults and texts. A class of methods says which command each of its methods is, and the order of arguments.

Signature and docstring are there at run time, for help() and notebooks; `scripts/pages` writes them down for
editors and mypy.
"""

from __future__ import annotations

import functools
import inspect
import itertools
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from inspect import Parameter
from typing import Any, TypeVar

from hpcdem.api.program import HELP, carried_out, spelt
from hpcdem.core.deprecated import renamed_arguments
from hpcdem.core.place import place
from hpcdem.lang.pcdc.table import PCDC, SHORT, Command, Model, Option
from hpcdem.lang.pcdc.trial import python
from hpcdem.physics.fdem import groups as g

WHERE = "text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all"
DIMENSIONS: dict[tuple[int, ...], str] = {(2,): "in the plane", (3,): "in three dimensions"}
"""Dimensions in which a word is available, if not in both."""
WIDTH = 109
"""Width of docstrings."""
Kind = TypeVar("Kind", bound=type)
Chosen = str | Callable[[Mapping[str, Any]], str]


# ---- arguments -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Argument:
    """An argument of a method. option: its row of the table; word: row of a word that follows the values of the option
    and is a separate argument; type: a name of `hpcdem.api.types`.
    """

    name: str
    type: str
    default: Any
    how: Any
    option: Option | None
    word: Option | None = None
    text: str = ""

    @property
    def parameter(self) -> Parameter:
        return Parameter(self.name, self.how, default=self.default, annotation=self.annotation)

    @property
    def annotation(self) -> str:
        """Type of the argument, with None where that is its default."""
        return f"{self.type} | None" if self.default is None and not self.type.endswith("None") else self.type


WHERE_ARGUMENT = Argument("where", "Where", None, Parameter.KEYWORD_ONLY, None, text=WHERE)


def type_of(option: Option) -> str:
    """Return the type of the values of an option; if it may be repeated, of all of them."""
    if option.repeated:
        return f"Iterable[{_item(option)}]" if option.more else f"Sequence[{_one(option)}]"
    return _one(option)


def _one(option: Option) -> str:
    kinds = option.values
    if not kinds:
        return "bool"
    if len(kinds) == 1:
        return f"Sequence[{kinds[0].python}]" if kinds[0].many else kinds[0].python
    if any(kind.dims != (2, 3) or kind.optional for kind in kinds[2:]):
        return f"tuple[{kinds[0].python}, ...]"
    pair = f"tuple[{', '.join(kind.python for kind in kinds)}]"
    return f"{kinds[0].python} | {pair}" if kinds[1].optional else pair


def _item(option: Option) -> str:
    """Convert one of several values that words follow: a tuple in their order, as long as needed or longer."""
    first = [_one(option)] if option.values else []
    parts = [*first, *map(_one, option.more)]
    least = len(first) + sum(word.required for word in option.more)
    longer = [f"tuple[{', '.join(parts[:n])}]" for n in range(max(least, 1), len(parts) + 1)]
    return " | ".join((["str"] if first == ["str"] and least == 1 else []) + longer)


def tokens(order: str) -> Iterator[tuple[str, str, str]]:
    """Return name, mark and default of each word of an order."""
    for token in order.split():
        found = re.fullmatch(r"(\*?)(\w+)([?!]?)(?:=(\w+))?", token)
        assert found, order
        yield found[2], found[1] or found[3], found[4] or ""


@dataclass(frozen=True)
class Row:
    """Method made from a command of the table.

    order: positional arguments; ``name?`` is optional, ``name=True`` is True by default, ``*names`` are all that
    follow. The others of the command are keywords. model: the constitutive model or condition whose properties they
    are; where: kind of object that `where` selects, if it is not that of the class; only, without: options by their
    words; names: Python names of arguments, by the word of the language, or by ``option.word`` for one that follows its
    values; types: of arguments whose kinds are not specific enough; doc: replaces the text of the command; loose: other
    keywords are passed to the table, which reports errors; earlier: present name of an argument by its deprecated name.
    """

    command: str
    order: str = ""
    model: str = ""
    where: Chosen = ""
    only: str = ""
    without: str = ""
    names: Mapping[str, str] = field(default_factory=dict)
    types: Mapping[str, str] = field(default_factory=dict)
    doc: str = ""
    loose: bool = False
    earlier: Mapping[str, str] = field(default_factory=dict)

    @functools.cached_property
    def row(self) -> Command:
        return PCDC.command(self.command)

    @functools.cached_property
    def model_row(self) -> Model | None:
        """The model or condition that is named."""
        return next((one for one in self.row.models if one.keyword.name == self.model), None)

    @functools.cached_property
    def arguments(self) -> list[Argument]:
        """Arguments of the method."""
        there = {one.name: one for one in self._all()}
        found = []
        for name, mark, default in tokens(self.order):
            one = there.pop(name)
            how = Parameter.VAR_POSITIONAL if mark == "*" else Parameter.POSITIONAL_OR_KEYWORD
            value = _usual(one) if mark == "?" else True if default == "True" else Parameter.empty
            kind = one.option.values[0].python if mark == "*" and one.option is not None else one.type
            found.append(Argument(name, kind, value, how, one.option, one.word, one.text))
        if self.row.ranged:
            there["where"] = WHERE_ARGUMENT
        return [*found, *there.values()]

    def _all(self) -> Iterator[Argument]:
        """Yield all arguments of the command as keywords."""
        named = self.model_row or self.row
        options = (*named.leading, *named.options)
        for name, option in {option.name: option for option in options}.items():
            if option.refused or name in self.without.split() or (self.only and name not in self.only.split()):
                continue
            yield self._argument(option)
            if self.loose:
                yield from (
                    Argument(
                        python(word), type_of(option), None, Parameter.KEYWORD_ONLY, option, text=f"as {option.name}"
                    )
                    for word in option.keyword.fulls[1:]
                )
            if option.more and not option.repeated:
                yield from (self._argument(option, word) for word in option.more)

    def _argument(self, option: Option, word: Option | None = None) -> Argument:
        one = word or option
        path = f"{option.name}.{one.name}" if word else option.name
        name = self.names.get(path) or python(SHORT.get(path, one.name))
        kind = self.types.get(name, type_of(one))
        needed = option.required and set(option.dims) >= set(self.row.dims)
        needed = needed and word is None and not (self.loose and option.also)
        default = Parameter.empty if needed else _usual_of(one)
        return Argument(name, kind, default, Parameter.KEYWORD_ONLY, option, word, self._text(one))

    def _text(self, option: Option) -> str:
        """Describe an argument for the docstring."""
        unit = f" [{option.unit}]" if option.unit not in ("", "1") else ""
        space = DIMENSIONS.get(option.dims, "") if self.row.dims == (2, 3) else ""
        default = {"'default'": "", "off": "", "on": "True"}.get(option.default, option.default)
        more = [text for text in (space, f"default: {default}" if default else "") if text]
        text = f"{option.doc}{unit}" + (f" ({'; '.join(more)})" if more else "")
        if option.repeated and option.more:
            first = [python(option.name)] if option.values else []
            words = {python(word.name): self._text(word) for word in option.more}
            text += f"; each is ({', '.join([*first, *words])})"
            text += "".join(f"; {name}: {doc}" for name, doc in words.items())
        return text

    def packed(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return the arguments of a method call by the names of the table."""
        found: dict[str, Any] = {}
        more: dict[str, dict[str, Any]] = {}
        known = {one.name: one for one in self.arguments}
        for name, value in given.items():
            one = known.get(name)
            if one is None or one.option is None:
                if name != "where":
                    found[name] = value
            elif self.loose:
                found[name] = value  # as it is spelt
            elif value is not None and one.word is not None:
                more.setdefault(one.option.name, {})[python(one.word.name)] = value
            elif value is not None and not (one.option.repeated and _is_empty(value)):
                found[python(one.option.name)] = _shaped(one.option, value)
        for name, words in more.items():
            key = python(name)
            option = next(one.option for one in known.values() if one.option is not None and one.option.name == name)
            if key not in found and not (name == "group" and option.default != "none"):
                raise TypeError(f"{_called(known.values(), name, words)} needs {key}")
            found[key] = {"value": found.get(key, g.DEFAULT), **words}
        return found

    def method(self, owner: type, name: str) -> Callable[..., None]:
        """Make the method for a class."""
        arguments = self.arguments
        parameters = [one.parameter for one in arguments]
        kind = self.where or getattr(owner, "kind", "")

        def call(self_: Any, *values: Any, **options: Any) -> None:
            given = bound(parameters, values, options, self.loose)
            chosen = kind if isinstance(kind, str) else kind(given)
            self_._do(self.command, self.packed(given), given.get("where"), chosen, self.model or None)

        return dressed(call, owner, name, self, parameters)

    @property
    def docstring(self) -> str:
        summary = self.doc or (self.model_row.doc if self.model_row else self.row.doc)
        if where := DIMENSIONS.get(self.row.dims):
            summary = f"{where[0].upper()}{where[1:]}: {summary[0].lower()}{summary[1:]}"
        rows = [(one.name, one.text) for one in self.arguments if one.text]
        return _docstring(summary, rows)


@dataclass(frozen=True)
class Models:
    """A method that names a constitutive model, bolt or liner and gives its properties."""

    command: str
    doc: str

    @functools.cached_property
    def row(self) -> Command:
        return PCDC.command(self.command)

    def rows(self) -> Iterator[tuple[Model, Row]]:
        """Return a method for each model."""
        for model in self.row.models:
            yield model, Row(self.command, model=model.keyword.name, loose=True)

    def method(self, owner: type, name: str) -> Callable[..., None]:
        keyword, rest = Parameter.KEYWORD_ONLY, Parameter.VAR_KEYWORD
        parameters = [
            Parameter("name", Parameter.POSITIONAL_OR_KEYWORD, annotation="str"),
            Parameter("where", keyword, default=None, annotation="Where"),
            Parameter("properties", rest, annotation="Value"),
        ]

        def call(self_: Any, *values: Any, **options: Any) -> None:
            given = bound(parameters[:2], values, options, loose=True)
            model, where = given.pop("name"), given.pop("where", None)
            self_._do(self.command, given, where, getattr(owner, "kind", ""), model)

        return dressed(call, owner, name, self, parameters)

    @property
    def docstring(self) -> str:
        rows = [("where", WHERE), *((one.keyword.name, ", ".join(_of(one))) for one in self.row.models)]
        return _docstring(self.doc, rows)


def _of(model: Model) -> Iterator[str]:
    return (python(option.name) for option in (*model.leading, *model.options) if not option.refused)


def _usual(one: Argument) -> Any:
    """The default of what is left out."""
    return _usual_of(one.word or one.option) if one.option is not None else None


def _usual_of(option: Option | None) -> Any:
    if option is None:
        return None
    return () if option.repeated else None if option.values else False


def _is_empty(value: Any) -> bool:
    return hasattr(value, "__len__") and not isinstance(value, str) and len(value) == 0


def _shaped(option: Option, value: Any) -> Any:
    """A value as the table has it: tuples with words after the first, and words, in full."""
    if option.repeated and option.more:
        return value if isinstance(value, str) else [_named(option, one) for one in value]
    kinds = option.values
    if len(kinds) == 2 and kinds[1].optional and not isinstance(value, Iterable):
        return (value,)
    if len(kinds) == 1 and isinstance(value, str) and value.replace("_", "-") in kinds[0].words:
        return value.replace("_", "-")
    return value


def _named(option: Option, given: Any) -> dict[str, Any]:
    """("hole", 0.05) as {"value": "hole", "size": 0.05}."""
    names = [*(["value"] if option.values else []), *(python(word.name) for word in option.more)]
    start = {} if option.values else {"value": True}
    if isinstance(given, Mapping):
        return {**start, **given}
    parts = (given,) if isinstance(given, str) else tuple(given)
    if not 1 <= len(parts) <= len(names):
        raise TypeError(f"expected {', '.join(names[1:])} in addition to the name of the layer, got {given!r}")
    return {**start, **dict(zip(names, parts))}


def _called(arguments: Iterable[Argument], option: str, words: Mapping[str, Any]) -> str:
    """The argument that a word is."""
    return next(
        one.name
        for one in arguments
        if one.word is not None and one.option is not None and one.option.name == option
        and python(one.word.name) in words
    )  # fmt: skip


# ---- methods ---------------------------------------------------------------------------------------------------------


_DRESSED: set[type] = {object}
"""Classes whose methods report errors with file and line of the program."""


def commands(cls: Kind) -> Kind:
    """Turn rows into methods. Errors in public methods of the class, and of its bases that are no such class, name file
    and line of the program and the method.
    """
    _DRESSED.add(cls)
    others = (of for of in cls.__mro__[:0:-1] if of not in _DRESSED)
    for name, found in [item for of in (*others, cls) for item in vars(of).items()]:
        if isinstance(found, Row | Models):
            found = found.method(cls, name)
        if inspect.isfunction(found) and (name == "__getitem__" or not name.startswith("_")):
            setattr(cls, name, _documented(found))
        elif isinstance(found, property) and not name.startswith("_") and found.fget is not None:
            setattr(cls, name, property(_documented(found.fget)))
    return cls


def _documented(method: Callable[..., Any]) -> Callable[..., Any]:
    name = method.__name__
    names = [parameter for parameter in inspect.signature(method).parameters if parameter != "self"]
    earlier = getattr(getattr(method, "made_by", None), "earlier", {})

    @functools.wraps(method)
    def call(self: Any, *values: Any, **options: Any) -> Any:
        word, options = self._word, spelt(options, names)
        options = renamed_arguments(name, earlier, options)
        full = (f"{word}[...]" if name == "__getitem__" else f"{word}.{name}") if word else name
        advice = f"see help(sim.{word})" if word else HELP
        return carried_out(place(), full, lambda: method(self, *values, **options), advice, names)

    return call


def dressed(
    call: Callable[..., Any], owner: type, name: str, made_by: Any, parameters: list[Parameter], returned: str = "None"
) -> Callable[..., Any]:
    """Give a method its name, signature and docstring. made_by: its row, which has the docstring."""
    own = Parameter("self", Parameter.POSITIONAL_OR_KEYWORD)
    call.__name__, call.__qualname__, call.__module__ = name, f"{owner.__qualname__}.{name}", owner.__module__
    call.__doc__ = made_by.docstring
    call.__annotations__ = {one.name: one.annotation for one in parameters} | {"return": returned}
    signature = inspect.Signature([own, *parameters], return_annotation=returned)
    for attribute, value in (("__signature__", signature), ("made_by", made_by)):
        setattr(call, attribute, value)
    return call


def _docstring(summary: str, rows: list[tuple[str, str]]) -> str:
    """Make the docstring in numpy style."""
    lines = [
        summary,
        *(["", "Parameters", "----------"] if rows else []),
        *(f"{name} : {text}." for name, text in rows),
    ]
    return "\n".join(lines)


def refer(classes: Iterable[type]) -> None:
    """Rewrite docstrings so that they use the Python names of methods and arguments, with lines of limited width."""
    made = [(of, name, value) for of in classes for name, value in vars(of).items() if hasattr(value, "made_by")]
    names: dict[str, str] = {}
    for of, name, value in made:
        row = value.made_by
        command = f"{row.command} {row.model}" if isinstance(row, Row) and row.model else row.command
        word = getattr(of, "_word", "")
        names[command] = f"`{word}.{name}`" if word else f"`{name}`"
    calls = re.compile(rf"(?<![\w-])({'|'.join(sorted(names, key=len, reverse=True))})(?![\w-])")
    for _, _, value in made:
        arguments = value.made_by.arguments if isinstance(value.made_by, Row) else ()
        words = sorted({one.option.name for one in arguments if one.option and "-" in one.option.name}, key=len)
        own = re.compile(rf"(?<![\w-])({'|'.join(words[::-1]) or '$.'})(?![\w-])")
        text = calls.sub(lambda found: names[found[1]], value.__doc__)
        text = re.sub(r"\b(on|off):", lambda found: f"{found[1] == 'on'}:", text)
        text = own.sub(lambda found: python(found[1]), text).replace("`pcdc.", "`").replace("pcdc.", "")
        value.__doc__ = "\n".join(itertools.chain(*map(_wrapped, text.split("\n"))))


def _wrapped(line: str) -> list[str]:
    indent = "    " if " : " in line else ""
    return textwrap.wrap(line, WIDTH, subsequent_indent=indent, break_on_hyphens=False) or [""]


def bound(
    parameters: list[Parameter], values: tuple[Any, ...], options: Mapping[str, Any], loose: bool = False
) -> dict[str, Any]:
    """Return the arguments of a call by the names of the parameters. Raises TypeError in the words of Python; loose:
    further names are accepted too."""
    placed = [one for one in parameters if one.kind is Parameter.POSITIONAL_OR_KEYWORD]
    rest = next((one for one in parameters if one.kind is Parameter.VAR_POSITIONAL), None)
    found = {one.name: value for one, value in zip(placed, values)}
    known = {one.name for one in parameters if one is not rest}
    for name, value in options.items():
        if name not in known and not loose:
            raise TypeError(f"got an unexpected keyword argument '{name}'")
        if name in found:
            raise TypeError(f"got multiple values for argument '{name}'")
        found[name] = value
    if rest is not None:
        found[rest.name] = values[len(placed) :]
    elif len(values) > len(placed):
        least = sum(one.default is Parameter.empty for one in placed)
        takes = f"{len(placed) + 1}" if least == len(placed) else f"from {least + 1} to {len(placed) + 1}"
        keywords = sum(one.kind is Parameter.KEYWORD_ONLY and one.name in options for one in parameters)
        beside = f" positional arguments (and {keywords} keyword-only argument{'s' * (keywords > 1)})" * (keywords > 0)
        raise TypeError(f"takes {takes} positional arguments but {len(values) + 1}{beside} were given")
    for what, how in (("positional", Parameter.POSITIONAL_OR_KEYWORD), ("keyword-only", Parameter.KEYWORD_ONLY)):
        needed = (one for one in parameters if one.kind is how and one.default is Parameter.empty)
        if missing := [repr(one.name) for one in needed if one.name not in found]:
            plural = "s" if len(missing) > 1 else ""
            raise TypeError(f"missing {len(missing)} required {what} argument{plural}: {_listed(missing)}")
    return {one.name: True for one in parameters if one.default is True} | found


def _listed(names: list[str]) -> str:
    if len(names) < 3:
        return " and ".join(names)
    return ", ".join(names[:-1]) + ", and " + names[-1]

"""Kinds of values: how many words, of which sort, and what may stand for them.

A value in the script is a token; a value of the language is a number, text, tuple or one of the few classes below. What
is written in square brackets is known only when the line is carried out, and is then checked by the same functions.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, NoReturn

from hpcdem.core.limits import LARGEST
from hpcdem.core.nearest import hint
from hpcdem.core.picture_words import EYES, eye_of, section_of
from hpcdem.lang.pcdc.lexer import Escape, Number, Text, Token, Vector, Word, short
from hpcdem.physics.fdem.tables import AXES, PLASTIC_STRAIN, TEMPERATURE


@dataclass(frozen=True)
class Pending:
    """A value that depends on expressions: `make` takes the values of all expressions of the line and returns it, or
    raises ValueError with what was read and what was expected."""

    make: Callable[[tuple[Any, ...]], Any]


@dataclass(frozen=True)
class TableName:
    """``table 'name'`` instead of a number: a function of time."""

    name: str


@dataclass(frozen=True)
class FunctionName:
    """``function 'file.py:name'`` instead of a number: a function of place and time."""

    name: str


@dataclass(frozen=True)
class Kind:
    """pattern: as the reference shows it; meaning: as messages say it; check: of a value of Python, ValueError (the
    message is not shown) if it is not of this kind."""

    pattern: str
    meaning: str
    check: Callable[[Any], Any]
    many: bool = False
    """Accepts all following values, at least one, or one [expression] that is a list of them."""
    optional: bool = False
    """May be omitted; only for the last value."""
    tabled: bool = False
    """Also accepts ``table 'name'`` or ``function 'file.py:name'``."""
    words: tuple[str, ...] = ()
    """Words accepted as values."""
    dims: tuple[int, ...] = (2, 3)
    """Dimensions of space in which the value exists."""
    varied: bool = False
    """Also accepts ``table 'name' over x`` or ``field 'name'``, for values that vary in space."""
    softens: bool = False
    """Also accepts ``table 'name' over plastic-strain``."""
    temperature_dependent: bool = False
    """Also accepts ``table 'name' over temperature``, or over another field of elements."""
    python: str = "float"
    """Type in a Python program, a name of `hpcdem.api.types`."""

    @property
    def axes(self) -> tuple[str, ...]:
        """Quantities over which a table for this value can be given; z only in space."""
        there = {
            PLASTIC_STRAIN: self.softens,
            **dict.fromkeys(range(TEMPERATURE, len(AXES)), self.temperature_dependent),
        }
        return tuple(axis for k, axis in enumerate(AXES) if there.get(k, True))


def varied(kind: Kind, softens: bool = False, temperature_dependent: bool = False) -> Kind:
    """A kind that may also be a table or a field, for a property of elements, faces or joints."""
    made = replace(
        kind,
        varied=True,
        softens=softens,
        temperature_dependent=temperature_dependent,
        python="Value" if kind.python == "float" else kind.python,
    )
    return replace(made, pattern=f"{kind.pattern}|table <s> over {'|'.join(made.axes)}|field <s>")


class Unfit(ValueError):
    """A value is not of the kind it should be."""


class TooLarge(Unfit):
    """The value has the right kind but is larger than any number of a model."""


def number(low: float = -math.inf, high: float = math.inf, above: bool = False) -> Callable[[Any], float]:
    """A check for a number in [low, high] that is no larger than there is any; `above`: low itself is excluded."""

    def check(value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, numbers.Real):
            raise Unfit
        value = float(value)
        if not low <= value <= high or (above and value == low):
            raise Unfit
        if not abs(value) <= LARGEST:
            raise TooLarge
        return value

    return check


def whole(low: float = -math.inf, high: float = 2**53) -> Callable[[Any], int]:
    """A check for a whole number in [low, high]; 100000.0 is one."""
    real = number(low, high)

    def check(value: Any) -> int:
        value = real(value) if not isinstance(value, numbers.Integral) or isinstance(value, bool) else int(value)
        if value != int(value) or not low <= value <= high:
            raise Unfit
        return int(value)

    return check


def _one_of(*numbers_: int) -> Callable[[Any], int]:
    """A check for one of these numbers."""

    def check(value: Any) -> int:
        found = whole()(value)
        if found not in numbers_:
            raise Unfit
        return found

    return check


def _string(value: Any) -> str:
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        raise Unfit
    return value


def _read_by(read: Callable[[str], Any]) -> Callable[[Any], str]:
    """A check for a text that `read` understands."""

    def check(value: Any) -> str:
        text = _string(value)
        try:
            read(text)
        except ValueError:
            raise Unfit from None
        return text

    return check


def _file(value: Any) -> str:
    text = _string(value).replace("\\", "/")
    if len(text.rpartition("/")[2].encode()) > 255 or text.endswith("/"):
        raise Unfit
    return text


_TRUE, _FALSE = ("on", "true", "yes"), ("off", "false", "no")


def _boolean(value: Any) -> bool:
    if isinstance(value, str) and value.lower() in _TRUE + _FALSE:
        return value.lower() in _TRUE
    if type(value).__name__ not in ("bool", "bool_"):
        raise Unfit
    return bool(value)


_coordinate = number()


def _vector(*sizes: int) -> Callable[[Any], tuple[float, ...]]:
    """A check for a vector of one of so many components."""

    def check(value: Any) -> tuple[float, ...]:
        if isinstance(value, str):
            raise Unfit
        try:
            items = tuple(_coordinate(v) for v in value)
        except TypeError:
            raise Unfit from None
        if len(items) not in sizes:
            raise Unfit
        return items

    return check


def _either(one: Callable[[Any], Any], other: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A check for what either takes."""

    def check(value: Any) -> Any:
        try:
            return one(value)
        except Unfit:
            return other(value)

    return check


def _listed(check: Callable[[Any], Any]) -> Callable[[Any], list]:
    """A check for a list of such values."""

    def check_all(value: Any) -> list:
        if isinstance(value, str) or not isinstance(value, Iterable):
            raise Unfit
        return [check(v) for v in value]

    return check_all


FLOAT = Kind("<f>", "a number", number())
POSITIVE = Kind("<f>", "a number above 0", number(0.0, above=True))
PART = Kind("<f>", "a number above 0, at most 1", number(0.0, 1.0, above=True))
NOT_NEGATIVE = Kind("<f>", "a number, not negative", number(0.0))
TABLED = Kind(
    "<f>|table <s>|function <s>",
    "a number, table 'name' or function 'file.py:name'",
    number(),
    tabled=True,
    python="Number",
)
TABLED_STEP = Kind(
    "<f>|table <s>", "a number, not negative, or table 'name'", number(0.0), tabled=True, python="float | str"
)
COUNT = Kind("<i>", "a whole number above 0", whole(1), python="int")
ZERO_OR_MORE = Kind("<i>", "a whole number, not negative", whole(0), python="int")
POINTS = Kind("3", "3, the points of a joint,", whole(3, 3), python="int")
FREEDOM = Kind("0|1|2", "0 free, 1 fixed or 2 along a vector (3 is for three dimensions)", whole(0, 2), python="int")
DIMENSIONS = Kind("2|3", "2 or 3", whole(2, 3), python="int")
SPLIT = Kind("5|6|12", "5, 6 or 12", _one_of(5, 6, 12), python="int")
FIRST_ID = Kind("[<i>]", "a whole number, not negative", whole(0), optional=True, python="int")
LAST_ID = Kind("[<i>]", "a whole number, not negative", whole(0), optional=True, python="int")
CHOSEN = Kind("0|1", "0 or 1", _one_of(0, 1), python="int")
SECOND_POSITIVE = Kind("[<f>]", "a number above 0", number(0.0, above=True), optional=True)
STRING = Kind("<s>", "a text in quotes", _string, python="str")
FILE = Kind("<s>", "the name of a file in quotes", _file, python="File")
BOOL = Kind("on|off", "on or off", _boolean, words=("on", "off", "true", "false", "yes", "no"), python="bool")
OPTIONAL_BOOL = replace(BOOL, pattern="[on|off]", optional=True)
OPTIONAL_FLOAT = Kind("[<f>]", "a number", number(), optional=True)
PAIRS = Kind("<f> <f>, <f> <f> ...", "pairs of numbers, time and value", number(), many=True)
VECTOR = Kind("<v>", "a vector (x,y)", _vector(2), python="Point")
OPTIONAL_VECTOR = Kind("[<v>]", "a vector (x,y)", _vector(2), optional=True, python="Point")
VECTORS = Kind("<v> <v> ...", "vectors (x,y)", _vector(2), many=True, python="Point")
"""Vectors of the plane in models of any dimension, as in tables and charts."""
PLACES = Kind("<v> <v> [...]", "vectors (x,y)", _vector(2), many=True, python="Point")
CORNER = Kind("(<f>,<f>)", "a vector (x,y)", _vector(2), python="Point")
"""Corner of a picture; two components in space, too."""
EYE = Kind(
    "<s>", f"one of {', '.join(EYES)}, or a direction towards the eye as '1,-2,0.5'", _read_by(eye_of), python="str"
)
SECTION = Kind("<s>", "a plane, 'x=1.5', 'x<1.5', 'x>1.5', or a point and a normal as '0,0,2,0,1,1'",
               _read_by(section_of), python="str")  # fmt: skip
THIRD_COUNT, THIRD_POSITIVE = (replace(kind, dims=(3,)) for kind in (COUNT, POSITIVE))
"""Additional value in three dimensions."""
_FREEDOM = replace(FREEDOM, meaning="0 free, 1 fixed, 2 along a vector or 3 across it", check=whole(0, 3))
LEVEL = Kind(
    "<f>|<v>|table <s>",
    "a number, a vector (x,y) or table 'name'",
    _either(number(), _vector(2)),
    tabled=True,
    python="Number | Point",
)
_IN_SPACE = (
    {FREEDOM.pattern: _FREEDOM}
    | {
        kind.pattern: replace(kind, meaning=kind.meaning.replace("(x,y)", "(x,y,z)"), check=_vector(3))
        for kind in (VECTOR, OPTIONAL_VECTOR, PLACES)
    }
    | {
        LEVEL.pattern: replace(
            LEVEL, meaning=LEVEL.meaning.replace("(x,y)", "(x,y,z)"), check=_either(number(), _vector(3))
        )
    }
)
_IN_ANY = (
    {FREEDOM.pattern: _FREEDOM}
    | {
        kind.pattern: replace(kind, meaning=f"{kind.meaning} or (x,y,z)", check=_vector(2, 3))
        for kind in (VECTOR, OPTIONAL_VECTOR, PLACES)
    }
    | {LEVEL.pattern: replace(LEVEL, check=_either(number(), _vector(2, 3)))}
)


def fitting(kind: Kind, dim: int | None) -> Kind:
    """The kind in a model of this number of dimensions; None: unknown."""
    return kind if dim == 2 else (_IN_ANY if dim is None else _IN_SPACE).get(kind.pattern, kind)


STRINGS = Kind("<s> ...", "texts in quotes", _string, many=True, python="str")


def limited(low: float, high: float, low_itself: bool, unit: str = "") -> Kind:
    """A number in [low, high] or ]low, high]."""
    if math.isinf(high):
        if low == 0.0:
            return NOT_NEGATIVE if low_itself else POSITIVE
        bounds = f", at least {low:g}" if low_itself else f" above {low:g}"
    else:
        bounds = f" from {low:g} to {high:g}" if low_itself else f" above {low:g}, at most {high:g}"
    meaning = f"an angle{bounds} [degrees]" if unit == "degrees" else f"a number{bounds}"
    return Kind("<f>", meaning, number(low, high, above=not low_itself))


def choice(*words: str) -> Kind:
    """One of these words, bare or in quotes."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or value.lower() not in words:
            raise Unfit
        return value.lower()

    return Kind("|".join(words), "one of " + ", ".join(words), check, words=words,
                python=f"Literal[{', '.join(map(repr, words))}]".replace("'", '"'))  # fmt: skip


# ---- from tokens to values -----------------------------------------------------------------------------------------


class Expressions:
    """Collects the Python expressions of a line; their numbers stand in the pending values."""

    def __init__(self) -> None:
        self.codes: list[str] = []

    def add(self, escape: Escape) -> int:
        self.codes.append(escape.code)
        return len(self.codes) - 1


def read_value(kind: Kind, token: Token, what: str, expressions: Expressions) -> Any:
    """The value of a token, perhaps pending. ValueError says what was read and what was expected."""
    if isinstance(token, Word):
        if token.text.lower() not in kind.words:
            _fail(kind, str(token), what, _advice(kind, token))
        return kind.check(token.text.lower())
    raw = _raw(token, expressions)
    if isinstance(raw, Pending):
        return Pending(
            lambda values: _checked(kind, raw.make(values), f"{_shown(raw.make(values))} from {token}", what)
        )
    return _checked(kind, raw, str(token), what)


def read_list(kind: Kind, token: Escape, what: str, expressions: Expressions) -> Pending:
    """A list of values of this kind from one expression."""
    raw = _raw(token, expressions)
    every = Kind(kind.pattern, f"a list of {kind.meaning}", _listed(kind.check))

    def make(values: tuple[Any, ...]) -> list:
        given = raw.make(values)
        given = given if isinstance(given, str) or not isinstance(given, Iterable) else list(given)
        try:
            return [kind.check(given)]
        except (Unfit, TypeError):
            return _checked(every, given, f"{_shown(given)} from {token}", what)

    return Pending(make)


def _raw(token: Token, expressions: Expressions) -> Any:
    """Number, text or tuple of a token, or Pending. Never a word."""
    if isinstance(token, Number):
        return token.value
    if isinstance(token, Escape):
        return _pending(token, expressions)
    if isinstance(token, Text):
        if token.plain is not None:
            return token.plain
        parts = [part if isinstance(part, str) else _pending(part, expressions) for part in token.parts]
        return Pending(lambda values: "".join(str(p.make(values)) if isinstance(p, Pending) else p for p in parts))
    assert isinstance(token, Vector)
    items = [_raw(item, expressions) for item in token.items]
    if any(isinstance(item, Pending) for item in items):
        return Pending(lambda values: tuple(i.make(values) if isinstance(i, Pending) else i for i in items))
    return tuple(items)


def _pending(escape: Escape, expressions: Expressions) -> Pending:
    index = expressions.add(escape)
    if escape.sign > 0:
        return Pending(lambda values: values[index])

    def negative(values: tuple[Any, ...]) -> Any:
        try:
            return -values[index]
        except TypeError:
            raise ValueError(
                f"read {_shown(values[index])} from {escape}, expected values that are not negative"
            ) from None

    return Pending(negative)


def _checked(kind: Kind, value: Any, shown: str, what: str) -> Any:
    advice = ""
    try:
        return kind.check(value)
    except TooLarge:
        advice = f"; no number is larger than {LARGEST:g}"
    except (Unfit, OverflowError, TypeError):
        pass
    _fail(kind, shown, what, advice)


def _fail(kind: Kind, shown: str, what: str, advice: str = "") -> NoReturn:
    raise ValueError(f"read {shown}, expected {kind.meaning} for {what}{advice}")


def _advice(kind: Kind, word: Word) -> str:
    if kind.words:
        return hint(word.text, kind.words)
    if "quotes" in kind.meaning:
        return f"; write {word}, or [{short(word.text)}] for a variable of Python"
    return f"; put Python variables in brackets: [{short(word.text)}]"


def _shown(value: Any) -> str:
    return short(repr(value))

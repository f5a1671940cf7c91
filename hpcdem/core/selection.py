"""Selection of the particles that a command acts on: RANGE of the ZDEM language and ``where=`` of the Python API.

A selection is a small immutable object. ``selection.mask(p)`` gives one bool per particle; tests look at centres only::

    Interval("y", 0.0, 500.0) & Group("sed")

Bounds may be expressions of the model's extents, written ``{top}-1000.0``. They are turned into numbers once, at the
moment of the command, by ``selection.resolve(extents)``, so that every rank uses the same numbers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeAlias

import numpy as np

from hpcdem.core.errors import CommandError

VARIABLES = ("left", "right", "bottom", "top")
"""Names available in expressions: min(x - r), max(x + r), min(y - r), max(y + r) of the particles that are not fixed in
both x and y."""


@dataclass(frozen=True)
class Expression:
    """A number that depends on the extents of the model, in postfix order so that it is evaluated without recursion.

    `program` holds numbers, names of VARIABLES and the operators ``+ - * /``; `text` is what the user wrote.
    """

    text: str
    program: tuple[float | str, ...]

    def __str__(self) -> str:
        """The selection as messages print it."""
        return f"'{self.text if len(self.text) <= 40 else self.text[:37] + '...'}'"

    def value(self, extents: Mapping[str, float]) -> float:
        """The number for these extents [m]; CommandError where it does not exist."""
        stack: list[float] = []
        for item in self.program:
            if not isinstance(item, str):
                stack.append(item)
            elif item in VARIABLES:
                stack.append(self._extent(item, extents))
            else:
                right, left = stack.pop(), stack.pop()
                if item == "/" and right == 0.0:
                    raise CommandError(f"{self} divides by zero")
                stack.append(_OPERATORS[item](left, right))
        if not math.isfinite(stack[0]):
            raise CommandError(f"{self} is not a finite number")
        return stack[0]

    def _extent(self, name: str, extents: Mapping[str, float]) -> float:
        value = extents.get(name, math.nan)
        if not math.isfinite(value):
            raise CommandError(f"{self}: {{{name}}} has no value, there is no free particle")
        return float(value)


_OPERATORS = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
}

Value: TypeAlias = float | Expression
Particles: TypeAlias = Mapping[str, Any]


def number(value: Value, extents: Mapping[str, float]) -> float:
    """Return `value` itself, or evaluate its expression with these extents."""
    return value.value(extents) if isinstance(value, Expression) else value


def has_expressions(value: object) -> bool:
    """True if `value` (a selection, a number, or tuples of these) holds an expression that is still to be resolved."""
    if isinstance(value, Selection):
        return any(has_expressions(getattr(value, f.name)) for f in fields(value))  # type: ignore[arg-type]
    if isinstance(value, tuple):
        return any(has_expressions(item) for item in value)
    return isinstance(value, Expression)


def _resolved(value: Any, extents: Mapping[str, float]) -> Any:
    if isinstance(value, Selection):
        return value.resolve(extents)
    if isinstance(value, tuple):
        return tuple(_resolved(item, extents) for item in value)
    return number(value, extents)


class Selection:
    """Base of all selections. `p` maps "x", "y" [m], "gid", "group" to arrays of shape (n,), and "group_names" to the
    list of names that "group" points into."""

    def mask(self, p: Particles) -> np.ndarray:
        """Return one bool per particle, shape (n,)."""
        raise NotImplementedError

    def resolve(self, extents: Mapping[str, float]) -> Selection:
        """Return this selection with numbers instead of expressions. Raises CommandError for an expression without a
        value."""
        return replace(self, **{f.name: _resolved(getattr(self, f.name), extents) for f in fields(self)})  # type: ignore

    def __and__(self, other: Selection) -> Selection:
        return Chain((self, other), ("and",))

    def __or__(self, other: Selection) -> Selection:
        return Chain((self, other), ("or",))


def _plain(value: Value) -> float:
    if isinstance(value, Expression):
        raise CommandError(f"'{value.text}' must be resolved with the extents of the model first")
    return value


@dataclass(frozen=True)
class Interval(Selection):
    """Centres with low <= axis < high. The upper bound is open so that layers that meet share no particle."""

    axis: str
    low: Value
    high: Value

    def mask(self, p: Particles) -> np.ndarray:
        c = p[self.axis]
        inside: np.ndarray = (c >= _plain(self.low)) & (c < _plain(self.high))
        return inside


def even_odd(rings: Sequence[np.ndarray], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Flag the points (n,) inside rings of corners (m, 2), by the even-odd rule.

    Like an interval, an area includes its lower and left boundary and excludes its upper and right one: where two areas
    share an edge, every point belongs to exactly one of them.
    """
    inside = np.zeros(np.shape(x), dtype=bool)
    for ring in rings:
        for (xa, ya), (xb, yb) in zip(ring.tolist(), np.roll(ring, -1, axis=0).tolist()):
            (y0, x0), (y1, x1) = sorted([(ya, xa), (yb, xb)])
            # A ray to +x crosses the edge if the edge spans the centre's height and lies to its right. The sign of a
            # cross product needs no division; lower end first makes it the same number for both neighbours.
            spans = (y0 <= y) & (y < y1)
            right = (x1 - x0) * (y - y0) - (x - x0) * (y1 - y0) > 0.0
            inside ^= spans & right
    return inside


@dataclass(frozen=True)
class Polygon(Selection):
    """Centres inside a polygon by the even-odd rule; corners ((x, y), ...) in either orientation."""

    corners: tuple[tuple[Value, Value], ...]

    def mask(self, p: Particles) -> np.ndarray:
        corners = np.array([(_plain(x), _plain(y)) for x, y in self.corners])
        return even_odd([corners], p["x"], p["y"])


@dataclass(frozen=True)
class Ellipse(Selection):
    """Centres with (x - x0)^2/a^2 + (y - y0)^2/b^2 <= 1. A half axis of zero encloses nothing."""

    x0: Value
    y0: Value
    a: Value
    b: Value

    def mask(self, p: Particles) -> np.ndarray:
        a, b = _plain(self.a), _plain(self.b)
        if a <= 0.0 or b <= 0.0:
            return np.zeros(np.shape(p["x"]), dtype=bool)
        inside: np.ndarray = ((p["x"] - _plain(self.x0)) / a) ** 2 + ((p["y"] - _plain(self.y0)) / b) ** 2 <= 1.0
        return inside


@dataclass(frozen=True, init=False)
class Group(Selection):
    """Particles of any of the named groups (a particle is in one group); upper and lower case are the same."""

    names: tuple[str, ...]

    def __init__(self, *names: str) -> None:
        object.__setattr__(self, "names", tuple(name.lower() for name in names))

    def mask(self, p: Particles) -> np.ndarray:
        wanted = [row for row, name in enumerate(p["group_names"]) if name.lower() in self.names]
        return np.isin(p["group"], wanted)

    def resolve(self, extents: Mapping[str, float]) -> Selection:
        return self


@dataclass(frozen=True)
class Ids(Selection):
    """Particles with first <= gid <= last."""

    first: int
    last: int

    def mask(self, p: Particles) -> np.ndarray:
        inside: np.ndarray = (p["gid"] >= self.first) & (p["gid"] <= self.last)
        return inside

    def resolve(self, extents: Mapping[str, float]) -> Selection:
        return self


@dataclass(frozen=True)
class Chain(Selection):
    """Terms joined by "and" / "or", evaluated from left to right with equal precedence."""

    terms: tuple[Selection, ...]
    joins: tuple[str, ...]

    def mask(self, p: Particles) -> np.ndarray:
        result = self.terms[0].mask(p)
        for join, term in zip(self.joins, self.terms[1:]):
            result = result & term.mask(p) if join == "and" else result | term.mask(p)
        return result

    def resolve(self, extents: Mapping[str, float]) -> Selection:
        return Chain(tuple(term.resolve(extents) for term in self.terms), self.joins)


def _sides(first: Selection, second: Selection) -> bool:
    """Return whether these two intervals form a rectangle."""
    both = isinstance(first, Interval) and isinstance(second, Interval)
    return both and first.axis != second.axis  # type: ignore[attr-defined]


def chain(terms: Sequence[Selection], joins: Sequence[str]) -> Selection:
    """Combine RANGE terms into one selection, as written: ``len(joins) == len(terms) - 1``, each "and", "or", or ""
    where two terms follow each other without a word.

    ``x (a b) y (c d)`` is one shape, the rectangle of the manual, before "and" and "or" are evaluated from left to
    right; other terms without a word between them are joined by "and".

    A particle has one group, so ``group a and group b`` could only be empty; scripts mean "both groups" with it
    (ductile base of the ZDEM manual, section 5.8). Group terms next to each other joined by "and" are therefore taken
    as one term that selects all these groups.
    """
    merged_terms: list[Selection] = [terms[0]]
    merged_joins: list[str] = []
    for join, term in zip(joins, terms[1:]):
        previous = merged_terms[-1]
        if join != "or" and isinstance(term, Group) and isinstance(previous, Group):
            merged_terms[-1] = Group(*previous.names, *term.names)
        elif not join and _sides(previous, term) and "or" in merged_joins:
            merged_terms[-1] = previous & term
        else:
            merged_terms.append(term)
            merged_joins.append(join or "and")
    return merged_terms[0] if len(merged_terms) == 1 else Chain(tuple(merged_terms), tuple(merged_joins))

"""Words in the manual's notation, and how they may be shortened.

``geom{etry}``: what stands outside of braces must be typed, what stands inside may be, letter by letter from the left.
A word of several parts is written and matched part by part: ``a{s}-l{ayer}`` is read in ``a-l``, ``as-l``, ``a-layer``
and ``as-layer``, in upper and lower case.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol, TypeVar

_PART = re.compile(r"([a-z0-9]+)(?:\{([a-z0-9]+)\})?|\{([a-z0-9]+)\}")


@dataclass(frozen=True)
class Keyword:
    """notation: as above; also: other spellings in the same notation, read but not shown first."""

    notation: str
    also: tuple[str, ...] = ()
    _parts: tuple[tuple[tuple[str, str], ...], ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_parts", tuple(_parts(text) for text in (self.notation, *self.also)))

    @cached_property
    def name(self) -> str:
        """The word in full."""
        return "-".join(full for _, full in self._parts[0])

    def accepts(self, typed: str) -> bool:
        """Return whether `typed` is this word or an abbreviation of it."""
        segments = typed.lower().split("-")
        return any(_match(segments, parts) for parts in self._parts)

    @cached_property
    def fulls(self) -> tuple[str, ...]:
        """The word in full, in all its spellings."""
        return tuple("-".join(full for _, full in parts) for parts in self._parts)

    def is_exactly(self, typed: str) -> bool:
        """Return whether `typed` is this word in full."""
        return typed.lower() in self.fulls

    def spellings(self) -> list[str]:
        """Return all spellings: in full, then with each part in full or abbreviated as far as allowed."""
        short = (itertools.product(*(dict.fromkeys(reversed(part)) for part in parts)) for parts in self._parts)
        return list(dict.fromkeys([*self.fulls, *("-".join(one) for one in itertools.chain(*short))]))

    def shortest(self) -> str:
        """The compulsory letters."""
        return "-".join(least for least, _ in self._parts[0])

    def __str__(self) -> str:
        return self.name


def _parts(notation: str) -> tuple[tuple[str, str], ...]:
    """(compulsory letters, whole part) of each part. ValueError for what is no notation."""
    found = []
    for text in notation.split("-"):
        match = _PART.fullmatch(text)
        if match is None or not match[1]:
            raise ValueError(f"{notation!r} is no keyword in the manual's notation")
        found.append((match[1], match[1] + (match[2] or "")))
    return tuple(found)


def _match(segments: list[str], parts: tuple[tuple[str, str], ...]) -> bool:
    return len(segments) == len(parts) and all(
        typed.startswith(least) and full.startswith(typed) for typed, (least, full) in zip(segments, parts, strict=True)
    )


class HasKeyword(Protocol):
    """A row of the table: it is found by its keyword."""

    @property
    def keyword(self) -> Keyword: ...


Row = TypeVar("Row", bound=HasKeyword)


def matching(typed: str, rows: Iterable[Row]) -> list[Row]:
    """The rows that a word may mean: one if it is clear, none if it is unknown. A word written in full is clear."""
    rows = list(rows)
    exact = [row for row in rows if row.keyword.is_exactly(typed)]
    return exact or [row for row in rows if row.keyword.accepts(typed)]


def beginning(typed: str, rows: Sequence[Row]) -> list[Row]:
    """The rows whose words begin like `typed`, for completion and for candidates of a word that is too short."""
    segments = typed.lower().split("-")
    found = []
    for row in rows:
        fulls = row.keyword.name.split("-")
        if len(segments) <= len(fulls) and all(full.startswith(s) for s, full in zip(segments, fulls)):
            found.append(row)
    return found

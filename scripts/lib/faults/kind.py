"""What a kind of fault is: a function that lets a run of a case begin, or go on, and disturbs it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from faults.case import Case


@dataclass(frozen=True)
class Kind:
    """name; about: how it is made and what must hold, for the report; call; least and most ranks of the run."""

    name: str
    about: str
    call: Callable[[Case], None]
    least: int = 1
    most: int = 3
    rare: bool = False


KINDS: dict[str, Kind] = {}


def kind(name: str, about: str, least: int = 1, most: int = 3, rare: bool = False) -> Callable:
    """Enter a function into the table. rare: takes much longer than the others, so it comes seldom."""

    def enter(call: Callable[[Case], None]) -> Callable[[Case], None]:
        KINDS[name] = Kind(name, about, call, least, most, rare)
        return call

    return enter

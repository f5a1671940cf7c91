"""Bolts and liners alike: which class has the objects of a kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hpcdem.core.errors import CommandError
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.fdem.structures import Structure
from hpcdem.physics.liners.model import Liners

ALL: tuple[type[Structure], ...] = (Bolts, Liners)
QUANTITIES: Mapping[str, Mapping[str, tuple[str, str]]] = {
    kind: of for support in ALL for kind, of in support.quantities.items()
}
"""Quantities of each kind of object that can be queried: unit and meaning."""


def class_of(kind: str) -> type[Structure]:
    """The class that has the objects of this kind (groups.SUPPORTS)."""
    return next(one for one in ALL if kind in one.parts)


def of(blocks: Any, kind: str) -> Structure:
    """Return the supports of the model that have objects of this kind. Raises CommandError if it has none."""
    support = class_of(kind)
    found = support.there(blocks)
    if found is None:
        raise CommandError(f"no {support.name} yet: use {support.word} create first")
    return found

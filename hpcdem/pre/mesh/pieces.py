"""Lines that a mesh is made from, each with its role and a mesh size of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

OUTLINE, HOLE, LINE = "outline", "hole", "line"


@dataclass(frozen=True)
class Piece:
    """A piece of the input of a mesh. layers: of geometry, or else a shape: its kind and values; role: it bounds the
    mesh, bounds a hole, or is followed by the mesh where it lies inside; size: of edges there [m], None: general size;
    what: its name in messages.
    """

    role: str
    what: str
    layers: Sequence[str] = ()
    shape: tuple[Any, ...] = ()
    size: float | None = None

"""Lines that a mesh is made from, each with its role and a mesh size of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

OUTLINE, HOLE, LINE = "outline", "hole", "line"


@dataclass(frozen=True)
class Piece:
    """layers: of geometry; or a shape of its own: its kind and values; role: it bounds the mesh, a hole in it, or the
    mesh follows it, as far as it lies inside; size: of edges there [m], None: that of the whole; what: messages call it
    so."""

    role: str
    what: str
    layers: Sequence[str] = ()
    shape: tuple[Any, ...] = ()
    size: float | None = None

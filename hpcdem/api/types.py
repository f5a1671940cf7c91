"""Types of what methods take and give, as their signatures name them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypedDict

import numpy as np

from hpcdem.core.selection import Selection
from hpcdem.lang.pcdc.kinds import FunctionName
from hpcdem.physics.fdem import groups as g
from hpcdem.physics.fdem.tables import Drawn, Over

Point = tuple[float, ...]
"""Coordinates: two numbers, three in a model of three dimensions."""
File = str | Path
Number = float | str | FunctionName
"""Value of a condition: a number, the name of a table of time, or a function from `nodes.function`."""
Value = float | Over | Drawn | np.ndarray
"""Value of a property: a number; the result of `tables.over` or `fields.drawn`; an array with one value per selected
object (n,)."""
Where = str | g.Term | tuple[g.Term, ...] | None
"""Text of a RANGE, or terms of `hpcdem.physics.fdem.groups` that must all be satisfied; None: everything."""
Selected = str | Selection | None
"""Text of a RANGE of ZDEM, or an object of `hpcdem.core.selection`; None: all particles."""


class Piece(TypedDict, total=False):
    """A line or points in a mesh: array, points [m], or layer, names of layers; mesh_size: element size there [m]."""

    array: Sequence[Point]
    layer: Sequence[str]
    mesh_size: float


class Solved(TypedDict, total=False):
    """Outcome of `solve`: reason, ratio of unbalanced to total forces (NaN if not computed), steps. Empty before the
    first call.
    """

    reason: str
    ratio: float
    steps: int

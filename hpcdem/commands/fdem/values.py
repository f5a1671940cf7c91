"""Conversions of values of commands that need no model: also used when a line is read (lang/pcdc/trial.py).

This module imports no kernels, so a script is checked without the second that they take to load.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.pre.mesh.disc_sets import DiscSet, Poles
from hpcdem.pre.mesh.fracture_sets import FractureSet, Length, Orientation
from hpcdem.pre.mesh.pieces import HOLE as HOLE
from hpcdem.pre.mesh.pieces import LINE as LINE
from hpcdem.pre.mesh.pieces import OUTLINE as OUTLINE
from hpcdem.pre.mesh.pieces import Piece as Piece
from hpcdem.pre.mesh.sizes import skew_grid, spaced

FIGURES = (".png", ".pdf", ".svg")
DEFAULT_LAYER = "default"
"""Layer of shapes without a named layer."""


def grid_lines(
    first: tuple[float, ...], second: tuple[float, ...], cells: tuple[int, ...], ratio: tuple[float, ...]
) -> tuple[np.ndarray, ...]:
    """Return the coordinates along x, y and in space z [m] of a regular mesh between two corners [m], with the given
    cells along each axis; ratio: see `spaced`.
    """
    if not len(first) == len(second) == len(cells) == len(ratio):
        raise CommandError("corners, cells and ratio need a number for each dimension of space")
    return tuple(spaced(min(a, b), max(a, b), n, r) for a, b, n, r in zip(first, second, cells, ratio))


def brick(
    corner: tuple[float, ...],
    ends: Sequence[tuple[float, ...]],
    cells: tuple[int, ...],
    ratio: tuple[float, ...] | None = None,
) -> np.ndarray:
    """Return the points of a regular mesh with edges from a corner to two or three end points [m], see
    `sizes.skew_grid`.
    """
    ratio = ratio or (1.0,) * len(corner)
    if not len(corner) == len(ends) == len(cells) == len(ratio) or any(len(end) != len(corner) for end in ends):
        raise CommandError("ends, n and ratio need a number for each dimension of space")
    return skew_grid(corner, ends, cells, ratio)


def fracture_set(
    orientation: tuple[str, float, float],
    length: tuple[str, float, float, float, float | None],
    density: tuple[str, float],
    scanline: float,
    ends_at: float,
    reached: bool,
) -> FractureSet:
    """Return the statistics of fractures. orientation: (kind, mean, spread) [degrees]; length: (kind, value, spread,
    least, greatest) [m]; density: (p10, p20 or p21, value); scanline [degrees]; ends_at, reached: see FractureSet.
    """
    return FractureSet(
        Orientation(*orientation), length_law(length), *density, scanline,
        "reached" if reached else "random", ends_at,
    )  # fmt: skip


def disc_set(
    orientation: tuple[str, float, float, float],
    radius: tuple[str, float, float, float, float | None],
    density: tuple[str, float],
    along: tuple[float, ...],
    reached: bool,
) -> DiscSet:
    """Return the statistics of discs. orientation: (kind, dip, dip direction, spread) [degrees]; radius: (kind, value,
    spread, least, greatest) [m]; density: (p10, p30 or p32, value); along: direction of the scan line; reached: see
    DiscSet.
    """
    return DiscSet(Poles(*orientation), length_law(radius), *density, along, reached)


def length_law(given: tuple[str, float, float, float, float | None]) -> Length:
    """(kind, value, spread, least, greatest or None) [m]."""
    return Length(*given[:4], math.inf if given[4] is None else given[4])


def history_name(name: str) -> str:
    """Check a name that becomes part of a file name. Raises CommandError if it cannot."""
    if any(char in '/\\:*?"<>|' for char in name) or len(name.encode()) > 200:
        raise CommandError(f"'{name}' cannot be part of a file name; a history has a file of its name")
    return name


def frames_name(name: str) -> None:
    """Check the first part of file names. Raises CommandError if it is invalid."""
    if "/" in name:
        raise CommandError(
            f"'{name}' is the first part of the names of files in the folder of the results; it cannot contain a folder"
        )


def result_name(path: str) -> None:
    """Raise CommandError if a result would be written outside the output folder."""
    if not os.path.isabs(path) and os.path.normpath(path).split(os.sep)[0] == os.pardir:
        raise CommandError(f"'{path}' lies outside the folder of the results; give an absolute path for another folder")


def figure_name(path: str) -> None:
    """Raise CommandError if figures cannot be written to this kind of file or to this folder."""
    result_name(path)
    if Path(path).suffix.lower() not in FIGURES:
        raise CommandError(f"'{path}': a figure is a file *.png, *.pdf or *.svg")

"""Target edge lengths: a base size with refinement near layers as a function of position, or a size along a line."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from hpcdem.core.errors import CommandError
from hpcdem.pre.mesh import optional
from hpcdem.pre.mesh.geometry import Curve, sampled

GROWTH = 0.2
"""Default growth of edges with the distance from a refined layer: neighbours differ by a fifth."""
MOST_ELEMENTS = 20_000_000
"""Largest number of elements; more are refused before the mesh is made."""
FLAT = 1e-9
"""Fraction of the square, or cube, of the longest edge: edges that span less are flat."""
MOST_SAMPLES = 500_000
"""Largest number of points along a refined layer."""


@dataclass(frozen=True)
class Refinement:
    """Edges of length `size` [m] on a layer; away from it they grow by `growth` times the distance up to the base size.

    `distance` [m], if given, says instead where the base size is reached.
    """

    layer: str
    size: float
    growth: float = GROWTH
    distance: float | None = None


class SizeField:
    """h(x): the least of a base size and of one size per refinement that grows with the distance from its layer."""

    def __init__(self, base: float, refined: Sequence[tuple[Refinement, Sequence[Curve]]] = ()) -> None:
        positive(base, "mesh size")
        self.base = float(base)
        self.parts: list[tuple[np.ndarray, cKDTree, float, float]] = []
        """Points along each refined layer (n, 2), their tree, the size there [m], its growth with distance."""
        self.named = [(refinement.layer, float(refinement.size)) for refinement, _ in refined]
        self.areas: list[tuple[Any, float]] = []
        """Polygons of shapely with a size of their own [m]."""
        for refinement, curves in refined:
            positive(refinement.size, f"mesh size near layer '{refinement.layer}'")
            if refinement.size >= base:
                raise CommandError(
                    f"mesh size near layer '{refinement.layer}' is {refinement.size:g}, which does not refine the mesh "
                    f"size {base:g}"
                )
            growth = refinement.growth
            if refinement.distance is not None:
                positive(refinement.distance, f"distance of the refinement near layer '{refinement.layer}'")
                growth = (base - refinement.size) / refinement.distance
            positive(growth, f"growth of the mesh size near layer '{refinement.layer}'")
            # Half an edge between samples: distances are met within 3 % of the size where they matter.
            spacing = 0.5 * refinement.size
            if sum(c.length() for c in curves) / spacing > MOST_SAMPLES:
                raise CommandError(
                    f"mesh size {refinement.size:g} near layer '{refinement.layer}' is too small for its length"
                )
            points = np.concatenate([sampled(c, spacing) for c in curves])
            self.parts.append((points, cKDTree(points), float(refinement.size), float(growth)))

    @property
    def smallest(self) -> float:
        """The least size anywhere [m]."""
        return min([self.base, *(size for _, _, size, _ in self.parts), *(size for _, size in self.areas)])

    def __call__(self, at: np.ndarray) -> np.ndarray:
        """(n,) size at the points (n, 2) [m]."""
        out = np.full(len(at), self.base)
        for _, tree, size, growth in self.parts:
            far, _ = tree.query(at)
            np.minimum(out, size + growth * far, out=out)
        for polygon, size in self.areas:
            out[optional.shapely().contains_xy(polygon, at[:, 0], at[:, 1]) & (out > size)] = size
        return out

    def parts_of(self, points: np.ndarray, length: float, most: float = math.inf) -> np.ndarray:
        """Divide a line by the target size: return fractions (n + 1,) of its length, 0 and 1 included.

        points (m, 2): the line, in equal steps; length: its true length, along arcs [m]; most: a bound of the size
        there. It gets the least number n of edges such that none is longer than the size allows: n = ceil(integral of
        ds / h), and equal shares of the integral.
        """
        inverse = np.maximum(1.0 / self(points), 1.0 / most)
        step = length / (len(points) - 1)
        share = np.concatenate([[0.0], np.cumsum(0.5 * (inverse[1:] + inverse[:-1]) * step)])
        n = max(1, math.ceil(share[-1] - 1e-6))
        cuts = np.interp(np.arange(n + 1) / n * share[-1], share, np.linspace(0.0, 1.0, len(points)))
        cuts[0], cuts[-1] = 0.0, 1.0
        return cuts

    def on(self, layer: str) -> float:
        """The size on a refined layer itself [m], infinite on others: samples stand a little apart from it."""
        return min([math.inf, *(size for name, size in self.named if name == layer)])

    def samples_for(self, length: float) -> np.ndarray:
        """(m,) fractions of a line of this length [m] at which `parts_of` wants to know it."""
        if not self.parts:
            return np.array([0.0, 1.0])
        return np.linspace(0.0, 1.0, int(min(max(4.0 * length / self.smallest, 2.0), 20_000.0)) + 1)


def positive(value: float, what: str) -> None:
    """CommandError unless the value is a positive number."""
    if not (math.isfinite(value) and value > 0.0):
        raise CommandError(f"{what} must be positive, not {value:g}")


def not_too_many(elements: float, what: str) -> None:
    """Raise CommandError for too many elements; what: their source, in words."""
    if not elements <= MOST_ELEMENTS:
        raise CommandError(f"{what} would make about {elements:.2g} elements, at most {MOST_ELEMENTS:.0g} allowed")


def spaced(start: float, end: float, n: int, ratio: float = 1.0) -> np.ndarray:
    """(n + 1,) coordinates from start to end [m]; each of the n intervals is `ratio` times the one before."""
    if not (math.isfinite(start) and math.isfinite(end) and end > start):
        raise CommandError(f"a structured mesh needs an upper bound above the lower one, not {start:g} to {end:g}")
    return between((start,), (end,), n, ratio)[:, 0]


def between(first: Sequence[float], last: Sequence[float], n: int, ratio: float = 1.0) -> np.ndarray:
    """(n + 1, dim) points from the first to the last [m]; each of the n intervals is `ratio` times the one before."""
    if n < 1:
        raise CommandError(f"a structured mesh needs at least one element in each direction, not {n}")
    if not (math.isfinite(ratio) and ratio > 0.0):
        raise CommandError(f"the ratio of neighbouring elements must be positive, not {ratio:g}")
    not_too_many(n, f"{n} intervals in one direction")
    k = np.arange(n + 1)
    if ratio == 1.0:
        part = k / n
    elif abs(n * math.log(ratio)) > 600.0:
        raise CommandError(f"with the ratio {ratio:g}, {n} elements differ too much in size")
    else:
        part = np.expm1(k * math.log(ratio)) / math.expm1(n * math.log(ratio))
    start, end = np.array(first, np.float64), np.array(last, np.float64)
    out = start + (end - start) * part[:, None]
    out[-1] = end
    return out


def skew_grid(
    corner: Sequence[float], ends: Sequence[Sequence[float]], cells: Sequence[int], ratio: Sequence[float]
) -> np.ndarray:
    """Points of a grid [m], (ny + 1, nx + 1, 2) or (nz + 1, ny + 1, nx + 1, 3), in the parallelogram or parallelepiped
    whose edges lead from a corner to two or three ends; cells and ratio along each, see `between`. Along the axes
    the coordinates are those of `spaced`; where the edges are left-handed the first runs backwards in the grid."""
    dim, at = len(corner), np.array(corner, np.float64)
    edges = np.array(ends, np.float64) - at
    longest = float(np.sqrt((edges * edges).sum(axis=1)).max())
    turn = float(np.linalg.det(edges)) if np.isfinite(edges).all() else math.nan
    if not abs(turn) > FLAT * longest**dim:
        raise CommandError(
            f"the edges from {_place(corner)} to {', '.join(map(_place, ends))} span no "
            + ("area" if dim == 2 else "volume")
        )
    not_too_many(float(np.prod(np.array(cells, np.float64))), f"cells {' '.join(map(str, cells))}")
    out = at.reshape((1,) * dim + (dim,))
    for axis, (end, n, r) in enumerate(zip(ends, cells, ratio, strict=True)):
        shape = [1] * dim
        shape[dim - 1 - axis] = n + 1
        line = between(corner, end, n, r).reshape(*shape, dim)
        out = np.where(out == at, line, np.where(line == at, out, out + (line - at)))
    return np.asarray(out if turn > 0.0 else out[..., ::-1, :])


def _place(at: Sequence[float]) -> str:
    return f"({', '.join(f'{c:g}' for c in at)})"

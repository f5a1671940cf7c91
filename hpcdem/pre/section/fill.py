"""Discs that fill the polygons of a section: none lies across a boundary between two layers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.core.selection import even_odd
from hpcdem.numerics.rng import uniforms
from hpcdem.pre.mesh import optional
from hpcdem.pre.section import check
from hpcdem.pre.section.shapes import Section

POROSITY = 0.2
"""Porosity of the filling. That of a dense packing of discs of similar radii is 0.16 to 0.18; layers a few discs thick
are looser."""
ROUNDS, RENEW = 300, 10
"""Largest number of rounds of relaxation, and number of rounds between two searches for neighbours."""
DONE = 0.02
"""Overlap over the sum of two radii below which the relaxation ends."""
SKIN = 0.6
"""Margin of the search for neighbours, over the largest radius."""
MOST_DISCS = 20_000_000
MOST_POINTS = 4 * MOST_DISCS
"""Largest number of lattice points over the box of a polygon: an inclined layer as thin as a disc would need an
unlimited number."""


@dataclass(frozen=True)
class Filled:
    """Discs in polygons. rows (n, 3): x, y, r [m]; shape (n,): polygon of each disc; overlap: largest remaining
    overlap, over the sum of two radii, or beyond a boundary, over the radius.
    """

    rows: np.ndarray
    shape: np.ndarray
    overlap: float


def filled(section: Section, radii: np.ndarray, porosity: float, seed: int, stream: int, file: str) -> Filled:
    """Fill the visible part of each polygon with discs of radii [m] drawn at random from a list, to this porosity, and
    move them apart until they hardly overlap. Equal arguments give equal bits.

    CommandError for an impossible porosity, and for a polygon narrower than a disc.
    """
    if not 0.1 <= porosity < 1.0:
        raise CommandError(f"porosity: a number from 0.1 to below 1, got {porosity:g}")
    rows, shape, worst = [np.empty((0, 3))], [np.empty(0, np.int64)], 0.0
    for number, area in enumerate(visible(section, file)):
        if area.is_empty:
            continue
        wanted = (1.0 - porosity) * area.area
        expected = int(wanted / (np.pi * float(np.mean(radii**2)))) + 1
        if expected > MOST_DISCS:
            raise CommandError(
                f"'{section.polygons[number].name}' would need {expected} discs, at most {MOST_DISCS} allowed; "
                "check scale and rad"
            )
        made, overlap = _fill(area, radii, wanted, expected, seed, (stream << 20) + 2 * number, section, number)
        rows.append(made)
        shape.append(np.full(len(made), number))
        worst = max(worst, overlap)
    return Filled(np.concatenate(rows), np.concatenate(shape), worst)


def visible(section: Section, file: str) -> list[Any]:
    """The part of each polygon that no later one covers."""
    shapely = optional.shapely()
    made = check.polygons(section, file)
    parts = []
    for k, one in enumerate(made):
        above = [other for other in made[k + 1 :] if other.intersects(one)]
        parts.append(shapely.difference(one, shapely.union_all(above)) if above else one)
    return parts


def _fill(
    area: Any, radii: np.ndarray, wanted: float, expected: int, seed: int, stream: int, section: Section, number: int
) -> tuple[np.ndarray, float]:
    shapely = optional.shapely()
    inner = shapely.buffer(area, -float(radii.max()))
    if inner.is_empty:
        shape = section.polygons[number]
        raise CommandError(
            f"the polygon '{shape.name}' ({shape.where}) is too narrow for a disc of radius {radii.max():g} m; use "
            "smaller radii, or exclude it with only"
        )
    draws = uniforms(seed, stream, np.arange(4 * expected + 8))
    r = radii[np.minimum((draws * len(radii)).astype(np.int64), len(radii) - 1)]
    r = r[: max(int(np.searchsorted(np.cumsum(np.pi * r * r), wanted, side="right")), 1)]
    return _relaxed(area, _scattered(inner, len(r), seed, stream + 1), r)


def _scattered(area: Any, n: int, seed: int, stream: int) -> np.ndarray:
    """(n, 2) points evenly inside of an area, a quarter of their distance off a triangular lattice: points at random
    would be dense in some places, and discs travel slowly."""
    shapely = optional.shapely()
    rings = [
        shapely.get_coordinates(ring)[:-1]
        for part in shapely.get_parts(area) for ring in (part.exterior, *part.interiors)
    ]  # fmt: skip
    x0, y0, x1, y1 = area.bounds
    side = float(np.sqrt(area.area / n / np.sqrt(0.75)))
    while True:
        columns, rows = int((x1 - x0) / side) + 2, int((y1 - y0) / (side * np.sqrt(0.75))) + 2
        if columns * rows > MOST_POINTS:
            raise CommandError(
                f"the polygon at ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) m is hardly wider than its discs; use smaller "
                "radii, or exclude it with only"
            )
        row, column = np.divmod(np.arange(columns * rows), columns)
        at = np.column_stack([x0 + side * (column + 0.5 * (row % 2) - 0.25), y0 + side * np.sqrt(0.75) * row])
        at += 0.5 * side * (uniforms(seed, stream, np.arange(2 * len(at))).reshape(-1, 2) - 0.5)
        at = at[even_odd(rings, at[:, 0], at[:, 1])]
        if len(at) >= n:
            chosen = np.argsort(uniforms(seed, stream, np.arange(2 * columns * rows, 2 * columns * rows + len(at))))
            return at[np.sort(chosen[:n])]
        side *= 0.99


def _relaxed(area: Any, at: np.ndarray, r: np.ndarray) -> tuple[np.ndarray, float]:
    """Overlapping discs are moved apart by half of what they overlap, the larger one less, and those at boundaries
    inwards, again and again."""
    from scipy.spatial import cKDTree

    shapely = optional.shapely()
    edge = shapely.boundary(area)
    shapely.prepare(area)
    shapely.prepare(edge)
    largest = float(r.max(initial=0.0))
    weight = r * r
    for turn in range(ROUNDS):
        if turn % RENEW == 0:
            i, j = cKDTree(at).query_pairs((2.0 + SKIN) * largest, output_type="ndarray").T
            close = np.hypot(*(at[j] - at[i]).T) < r[i] + r[j] + SKIN * largest
            i, j = i[close], j[close]
            outer = np.flatnonzero(shapely.distance(edge, shapely.points(at)) < r + 0.5 * SKIN * largest)
        away = at[j] - at[i]
        apart = np.hypot(*away.T)
        depth = np.maximum(r[i] + r[j] - apart, 0.0)
        step = np.where(apart > 0.0, depth / np.maximum(apart, 1e-300), 0.0)[:, None] * away
        share = (weight[j] / (weight[i] + weight[j]))[:, None]
        move = np.zeros_like(at)
        for axis in (0, 1):
            move[:, axis] = np.bincount(j, ((1.0 - share) * step)[:, axis], len(at)) - np.bincount(
                i, (share * step)[:, axis], len(at)
            )
        at = at + move
        beyond = _pushed_in(area, edge, at, r, outer)
        if max(float((depth / (r[i] + r[j])).max(initial=0.0)), beyond) < DONE:
            break
    i, j = cKDTree(at).query_pairs(2.0 * largest, output_type="ndarray").T
    between = 1.0 - np.hypot(*(at[j] - at[i]).T) / (r[i] + r[j])
    outside = 1.0 - shapely.distance(edge, shapely.points(at)) / r
    return np.column_stack([at, r]), max(float(between.max(initial=0.0)), float(outside.max(initial=0.0)))


def _pushed_in(area: Any, edge: Any, at: np.ndarray, r: np.ndarray, outer: np.ndarray) -> float:
    """Move those of `outer` that cross the edge inwards, in place; the farthest that one was beyond it, over its
    radius."""
    shapely = optional.shapely()
    points = shapely.points(at[outer])
    far = shapely.distance(edge, points)
    inside = shapely.contains(area, points)
    signed = np.where(inside, far, -far)
    crossing = np.flatnonzero(signed < r[outer])
    if not len(crossing):
        return 0.0
    lines = shapely.shortest_line(edge, points[crossing])
    nearest = shapely.get_coordinates(lines).reshape(-1, 2, 2)[:, 0]
    rows, signed = outer[crossing], signed[crossing]
    normal = (at[rows] - nearest) * np.sign(signed)[:, None]
    size = np.hypot(*normal.T)
    usable = size > 1e-12 * r[rows]
    rows, nearest, normal, size = rows[usable], nearest[usable], normal[usable], size[usable]
    at[rows] = nearest + normal / size[:, None] * r[rows][:, None]
    return float(((r[rows] - signed[usable]) / r[rows]).max(initial=0.0))

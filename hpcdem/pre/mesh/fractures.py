"""Discrete fracture networks in the plane: sets of straight traces with given statistics.

The centres of a set are a Poisson process; angle and length of each trace are independent of it and of each other. The
window in which centres are drawn is larger than the region by half the greatest length, and traces are then cut by the
region: so the densities hold in the mean up to its rim (no fracture is missing because its centre lies outside).

Every number is a function of (seed, number of the set, number of the trace): `physics.rng`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import special

from hpcdem.core.errors import CommandError
from hpcdem.numerics.rng import uniform
from hpcdem.pre.mesh import optional
from hpcdem.pre.mesh.fracture_sets import FractureSet
from hpcdem.pre.mesh.geometry import Curve, sampled

MOST = 1_000_000
"""Largest number of traces of one set; more are a mistake of units."""
DRAWS = 8
"""Number of random numbers reserved for each trace."""


@dataclass(frozen=True)
class Fractures:
    """Straight traces."""

    ends: np.ndarray = field(default_factory=lambda: np.empty((0, 2, 2)))
    """(n, 2, 2) f8: trace, end, x y [m]."""
    sets: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    """(n,) i8 number of the fracture set of each trace."""

    def __len__(self) -> int:
        return len(self.ends)

    def lengths(self) -> np.ndarray:
        """(n,) [m]."""
        return np.hypot(*(self.ends[:, 1] - self.ends[:, 0]).T)

    def of_set(self, number: int) -> Fractures:
        """The traces of one set."""
        return Fractures(self.ends[self.sets == number], self.sets[self.sets == number])


def joined(*parts: Fractures) -> Fractures:
    """Join all traces, in the order given."""
    return Fractures(np.concatenate([p.ends for p in parts]), np.concatenate([p.sets for p in parts]))


def of_curves(curves: Sequence[Curve], number: int, size: float) -> Fractures:
    """Return the segments of curves as traces of one set; arcs in steps of at most `size` [m]."""
    rows = []
    for curve in curves:
        if curve.segments:
            xy = sampled(curve, size) if curve.bulges.any() else curve.points
            xy = np.concatenate([xy, xy[:1]]) if curve.closed else xy
            rows.append(np.stack([xy[:-1], xy[1:]], axis=1))
    ends = np.concatenate(rows) if rows else np.empty((0, 2, 2))
    return Fractures(ends, np.full(len(ends), number, np.int64))


def network(sets: Sequence[FractureSet], region: Any, seed: int, least: float = 0.0, first: int = 0) -> Fractures:
    """Generate traces of several sets in a region, equal for any number of ranks.

    region: a polygon of shapely (see `regions.polygon_of`), possibly with holes; least: pieces cut off by its boundary
    that are shorter than this are discarded [m]; first: number of the first set.
    """
    if seed < 0:
        raise CommandError(f"the seed must not be negative, but is {seed}")
    for k, one in enumerate(sets):
        one.check(f"fracture set {first + k}")
    older = np.empty((0, 2, 2))
    made = []
    for k, one in enumerate(sets):
        whole = _drawn(one, region, seed, first + k)
        if one.ends_at > 0.0:
            whole = _ended(whole, older, one.ends_at, seed, first + k)
        older = np.concatenate([older, whole])
        ends, _ = clipped(whole, region)
        ends = ends[np.hypot(*(ends[:, 1] - ends[:, 0]).T) > least]
        made.append(Fractures(ends, np.full(len(ends), first + k, np.int64)))
    return joined(*made) if made else Fractures()


def clipped(ends: np.ndarray, region: Any) -> tuple[np.ndarray, np.ndarray]:
    """Parts of traces (n, 2, 2) inside a polygon of shapely, and the trace each comes from. A trace may fall apart."""
    shapely = optional.shapely()
    if not len(ends):
        return np.empty((0, 2, 2)), np.empty(0, np.int64)
    shapely.prepare(region)
    lines = shapely.linestrings(ends)
    inside = shapely.contains_properly(region, lines)
    touched = shapely.intersects(region, lines)
    parts, origin = [], []
    for i in np.flatnonzero(touched):
        if inside[i]:
            parts.append(ends[i])
            origin.append(i)
            continue
        cut = shapely.get_parts(shapely.intersection(lines[i], region))
        for piece in cut[shapely.get_type_id(cut) == 1]:
            xy = shapely.get_coordinates(piece)
            parts.append(_as_drawn(np.array([xy[0], xy[-1]]), ends[i]))
            origin.append(i)
    return np.array(parts).reshape(-1, 2, 2), np.array(origin, np.int64)


def _as_drawn(piece: np.ndarray, trace: np.ndarray) -> np.ndarray:
    """A piece in the direction of its trace."""
    return piece if (piece[1] - piece[0]) @ (trace[1] - trace[0]) >= 0.0 else piece[::-1]


def _drawn(one: FractureSet, region: Any, seed: int, number: int) -> np.ndarray:
    """(n, 2, 2) whole traces whose centres lie in the window of the region."""
    x0, y0, x1, y1 = region.bounds
    half = 0.5 * one.length.longest()
    x0, y0, x1, y1 = x0 - half, y0 - half, x1 + half, y1 + half
    expected = one.p20() * (x1 - x0) * (y1 - y0)
    if not expected < 0.5 * MOST:
        raise CommandError(f"fracture set {number}: {expected:.3g} traces expected, at most {MOST // 2} allowed")
    stream = 2 * number
    if one.stop == "random":
        n = poisson(expected, uniform(seed, stream + 1, 0))
        return _traces(one, (x0, y0, x1, y1), seed, stream, np.arange(n))
    return _until_reached(one, region, (x0, y0, x1, y1), seed, number, expected)


def _until_reached(
    one: FractureSet, region: Any, window: tuple[float, float, float, float], seed: int, number: int, expected: float
) -> np.ndarray:
    """Traces in sequence until the density in the region is nearest to the requested one."""
    goal = one.density * region.area
    batch = max(64, int(expected))
    parts: list[np.ndarray] = []
    share: list[np.ndarray] = []
    start = 0
    while math.fsum(float(s.sum()) for s in share) < goal:
        if start >= MOST:
            raise CommandError(f"fracture set {number}: {MOST} traces do not reach the density {one.density:g}")
        some = _traces(one, window, seed, 2 * number, np.arange(start, start + batch))
        ends, origin = clipped(some, region)
        lengths = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        # P20 counts a trace where its centre is, as the process does.
        counts = _centres_inside(some, region) if one.measure == "p20" else np.bincount(origin, lengths, batch)
        parts.append(some)
        share.append(counts)
        start += batch
    total = np.cumsum(np.concatenate(share))
    enough = int(np.searchsorted(total, goal - 1e-12 * goal))
    before = total[enough - 1] if enough else 0.0
    n = enough + 1 if total[enough] - goal <= goal - before else enough
    return np.concatenate(parts)[:n]


def _centres_inside(ends: np.ndarray, region: Any) -> np.ndarray:
    return optional.shapely().contains_xy(region, *ends.mean(axis=1).T).astype(np.float64)


def _traces(
    one: FractureSet, window: tuple[float, float, float, float], seed: int, stream: int, numbers: np.ndarray
) -> np.ndarray:
    x0, y0, x1, y1 = window
    u = np.array([[uniform(seed, stream, DRAWS * int(i) + k) for k in range(4)] for i in numbers]).reshape(-1, 4)
    centre = np.column_stack([x0 + (x1 - x0) * u[:, 0], y0 + (y1 - y0) * u[:, 1]])
    angle, half = one.orientation.angles(u[:, 2]), 0.5 * one.length.lengths(u[:, 3])
    half_trace = np.column_stack([half * np.cos(angle), half * np.sin(angle)])
    return np.stack([centre - half_trace, centre + half_trace], axis=1)


def _ended(ends: np.ndarray, older: np.ndarray, share: float, seed: int, number: int) -> np.ndarray:
    """Let traces end where they first meet an older one that stops them; each half grows from the centre by itself."""
    out = ends.copy()
    for i, (a, b) in enumerate(ends):
        others = np.concatenate([older, out[:i]])
        t, who = crossings(a, b, others)
        for sign, end in ((-1.0, 0), (1.0, 1)):
            half_trace = (t - 0.5) * sign
            order = np.argsort(half_trace, kind="stable")
            for k in order[half_trace[order] > 0.0]:
                # One number per pair of traces and side: it does not depend on what else is met.
                draw = uniform(seed, 2 * number + 1, 1 + 2 * (i * (MOST + len(older)) + int(who[k])) + end)
                if draw < share:
                    out[i, end] = a + t[k] * (b - a)
                    break
    return out


def crossings(a: np.ndarray, b: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Intersect the segment a-b with the segments `others` (m, 2, 2). Returns fractions (k,) of a-b and rows (k,) of
    others."""
    u, v, w = b - a, others[:, 1] - others[:, 0], others[:, 0] - a
    cross = u[0] * v[:, 1] - u[1] * v[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / cross
        s = (w[:, 0] * u[1] - w[:, 1] * u[0]) / cross
    hit = np.flatnonzero((cross != 0.0) & (t >= 0.0) & (t <= 1.0) & (s >= 0.0) & (s <= 1.0))
    return t[hit], hit


def poisson(mean: float, u: float) -> int:
    """Inverse of the Poisson distribution: the least n with P(N <= n) >= u."""
    n = max(math.floor(mean + math.sqrt(mean) * float(special.ndtri(min(max(u, 1e-16), 1.0 - 1e-16)))), 0)
    while special.pdtr(n, mean) < u:
        n += 1
    while n > 0 and special.pdtr(n - 1, mean) >= u:
        n -= 1
    return n

"""Discrete fracture networks in the plane: sets of straight traces with given statistics.

The centres of a set are a Poisson process; angle and length of each trace are independent of it and of each other. The
window in which centres are drawn is larger than the region by half the greatest length, and traces are then cut by the
region: so the densities hold in the mean up to its rim (no fracture is missing because its centre lies outside).

Densities (Dershowitz & Herda 1992): P20 traces per area [1/m2], P21 trace length per area [1/m], P10 traces per length
of a scan line [1/m]. For mean length E[l] and the angle a between trace and scan line

    P21 = P20 E[l],    P10 = P21 E[|sin a|].

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
from hpcdem.pre.mesh.geometry import Curve, sampled

MOST = 1_000_000
"""Traces of one set at most; more is a slip of units."""
DRAWS = 8
"""Numbers set aside per trace."""


# --- how angles and lengths are distributed ----------------------------------------------------------------------


@dataclass(frozen=True)
class Orientation:
    """Angle of traces [degrees, counter-clockwise from x]; a trace at a and one at a + 180 are the same.

    kind: "fixed"; "uniform" (mean +- spread); "normal" (spread: standard deviation); "fisher", in the plane the
    distribution of von Mises, with density exp(kappa cos(a - mean)) (spread: kappa).
    """

    kind: str
    mean: float
    spread: float = 0.0

    KINDS = ("fixed", "uniform", "normal", "fisher")

    def check(self, name: str) -> None:
        """CommandError for what makes no sense."""
        _known(self.kind, self.KINDS, f"{name}: orientation")
        _finite(self.mean, f"{name}: angle")
        _finite(self.spread, f"{name}: spread of the angle")
        if self.spread < 0.0:
            raise CommandError(f"{name}: the spread of the angle must not be negative, but is {self.spread:g}")

    def angles(self, u: np.ndarray) -> np.ndarray:
        """Inverse distribution: uniform numbers (n,) to angles [rad]."""
        mean = math.radians(self.mean)
        if self.kind == "fixed" or (self.spread == 0.0 and self.kind != "fisher"):
            return np.full(len(u), mean)
        if self.kind == "uniform":
            return mean + math.radians(self.spread) * (2.0 * u - 1.0)
        if self.kind == "normal":
            return mean + math.radians(self.spread) * special.ndtri(np.clip(u, 2.0**-54, 1.0 - 2.0**-53))
        # The density is smooth and periodic: the trapezoidal rule on a fine grid is as good as exact.
        reach = min(math.pi, 12.0 / math.sqrt(self.spread)) if self.spread > 0.0 else math.pi
        grid = np.linspace(-reach, reach, 20_001)
        density = np.exp(self.spread * (np.cos(grid) - 1.0))
        below = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
        return mean + np.interp(u, below / below[-1], grid)


@dataclass(frozen=True)
class Length:
    """Length of traces [m], cut off below `least` and above `greatest` (and drawn again from what remains).

    kind: "fixed" (value); "exponential" (value: mean); "lognormal" (value, spread: mean and standard deviation of the
    length itself); "power" (density proportional to l ** -value between least and greatest). value and spread describe
    the distribution before it is cut off.
    """

    kind: str
    value: float
    spread: float = 0.0
    least: float = 0.0
    greatest: float = math.inf

    KINDS = ("fixed", "exponential", "lognormal", "power")

    def check(self, name: str) -> None:
        """CommandError for what makes no sense."""
        _known(self.kind, self.KINDS, f"{name}: length")
        _finite(self.value, f"{name}: length")
        if self.kind != "power" and self.value <= 0.0:
            raise CommandError(f"{name}: the length must be positive, not {self.value:g}")
        if not 0.0 <= self.least < self.greatest or math.isnan(self.greatest):
            raise CommandError(f"{name}: lengths from {self.least:g} to {self.greatest:g} make no sense")
        if self.kind == "power" and not (self.least > 0.0 and math.isfinite(self.greatest)):
            raise CommandError(f"{name}: a power law needs a least length above 0 and a greatest one")
        if self.kind == "lognormal" and not (math.isfinite(self.spread) and self.spread > 0.0):
            raise CommandError(f"{name}: a lognormal length needs a positive standard deviation, not {self.spread:g}")
        if self.kind != "fixed" and not self._share() > 1e-9:
            raise CommandError(f"{name}: hardly any length lies between {self.least:g} and {self.greatest:g}")

    def lengths(self, u: np.ndarray) -> np.ndarray:
        """Inverse distribution: uniform numbers (n,) to lengths [m]."""
        if self.kind == "fixed":
            return np.full(len(u), self.value)
        low, high = self._below(self.least), self._below(self.greatest)
        return np.clip(self._inverse(low + u * (high - low)), self.least, self.greatest)

    def mean(self) -> float:
        """E[l] after the cut-off [m]: midpoint rule over the inverse distribution, refined towards both ends."""
        # u = t2 (3 - 2 t) crowds points at both ends, where the inverse of an unbounded distribution is steep.
        t = (np.arange(100_000) + 0.5) / 100_000
        return float((self.lengths(t * t * (3.0 - 2.0 * t)) * 6.0 * t * (1.0 - t)).mean())

    def longest(self) -> float:
        """The greatest length that need be reckoned with [m]: all but one in 1e9 traces are shorter."""
        return self.value if self.kind == "fixed" else float(self.lengths(np.array([1.0 - 1e-9]))[0])

    def _share(self) -> float:
        return float(self._below(self.greatest) - self._below(self.least))

    def _normal(self) -> tuple[float, float]:
        """Mean and standard deviation of ln l."""
        variance = math.log1p((self.spread / self.value) ** 2)
        return math.log(self.value) - 0.5 * variance, math.sqrt(variance)

    def _below(self, length: float) -> float:
        if self.kind == "power":
            return self._power(length) / self._power(self.greatest)
        if length == 0.0 or math.isinf(length):
            return 0.0 if length == 0.0 else 1.0
        if self.kind == "exponential":
            return -math.expm1(-length / self.value)
        mean, deviation = self._normal()
        return float(special.ndtr((math.log(length) - mean) / deviation))

    def _inverse(self, u: np.ndarray) -> np.ndarray:
        if self.kind == "exponential":
            return -self.value * np.log1p(-np.minimum(u, 1.0 - 2.0**-53))
        if self.kind == "lognormal":
            mean, deviation = self._normal()
            return np.exp(mean + deviation * special.ndtri(np.clip(u, 2.0**-54, 1.0 - 2.0**-53)))
        top, n = math.log(self.greatest / self.least), 1.0 - self.value
        if abs(n * top) < 1e-12:
            return self.least * np.exp(u * top)
        return self.least * np.exp(np.log1p(u * math.expm1(n * top)) / n)

    def _power(self, length: float) -> float:
        """Integral of l ** -value from `least`, in units of its integrand there."""
        top, n = math.log(length / self.least), 1.0 - self.value
        return top if abs(n * top) < 1e-12 else math.expm1(n * top) / n


# --- sets and networks -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FractureSet:
    """One set of fractures.

    measure: "p10", "p20" or "p21" with its `density`; `scanline` [degrees], the direction of the line for p10.
    stop: "random", the number is drawn from the Poisson distribution, so density is met in the mean; "reached", traces
    are made until p20 or p21 is met in the region itself, as nearly as whole traces can.
    ends_at: share of crossings with traces of earlier sets (and earlier traces of the same set) at which a trace, as it
    grows from its centre, ends. Ended traces are shorter, so p21 is then lower than asked for.
    """

    orientation: Orientation
    length: Length
    measure: str
    density: float
    scanline: float = 0.0
    stop: str = "random"
    ends_at: float = 0.0

    def check(self, name: str) -> None:
        """CommandError for what makes no sense."""
        self.orientation.check(name)
        self.length.check(name)
        _known(self.measure, ("p10", "p20", "p21"), f"{name}: density")
        _known(self.stop, ("random", "reached"), f"{name}: stop")
        _finite(self.scanline, f"{name}: direction of the scan line")
        if not (math.isfinite(self.density) and self.density > 0.0):
            raise CommandError(f"{name}: the density must be positive, not {self.density:g}")
        if not 0.0 <= self.ends_at <= 1.0:
            raise CommandError(f"{name}: the share of ended traces lies between 0 and 1, not {self.ends_at:g}")
        if self.stop == "reached" and self.measure == "p10":
            raise CommandError(f"{name}: only p20 and p21 can be made until they are reached, p10 holds in the mean")
        if self.stop == "reached" and self.ends_at > 0.0 and self.measure == "p21":
            raise CommandError(f"{name}: p21 cannot be reached exactly by traces that end at others; take stop random")

    def p20(self) -> float:
        """Centres per area [1/m2] that give the density asked for."""
        if self.measure == "p20":
            return self.density
        if self.measure == "p21":
            return self.density / self.length.mean()
        t = (np.arange(20_000) + 0.5) / 20_000
        sine = float(np.abs(np.sin(self.orientation.angles(t) - math.radians(self.scanline))).mean())
        if sine < 1e-6:
            raise CommandError("a scan line along the fractures meets none of them: p10 says nothing")
        return self.density / (self.length.mean() * sine)


@dataclass(frozen=True)
class Fractures:
    """Straight traces."""

    ends: np.ndarray = field(default_factory=lambda: np.empty((0, 2, 2)))
    """(n, 2, 2) f8: trace, end, x y [m]."""
    sets: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    """(n,) i8 number of the set of each."""

    def __len__(self) -> int:
        return len(self.ends)

    def lengths(self) -> np.ndarray:
        """(n,) [m]."""
        return np.hypot(*(self.ends[:, 1] - self.ends[:, 0]).T)

    def of_set(self, number: int) -> Fractures:
        """The traces of one set."""
        return Fractures(self.ends[self.sets == number], self.sets[self.sets == number])


def joined(*parts: Fractures) -> Fractures:
    """All traces, in the order given."""
    return Fractures(np.concatenate([p.ends for p in parts]), np.concatenate([p.sets for p in parts]))


def of_curves(curves: Sequence[Curve], number: int, size: float) -> Fractures:
    """The segments of curves as traces of one set; arcs in steps of `size` [m] at most."""
    rows = []
    for curve in curves:
        if curve.segments:
            xy = sampled(curve, size) if curve.bulges.any() else curve.points
            xy = np.concatenate([xy, xy[:1]]) if curve.closed else xy
            rows.append(np.stack([xy[:-1], xy[1:]], axis=1))
    ends = np.concatenate(rows) if rows else np.empty((0, 2, 2))
    return Fractures(ends, np.full(len(ends), number, np.int64))


def network(sets: Sequence[FractureSet], region: Any, seed: int, least: float = 0.0, first: int = 0) -> Fractures:
    """Traces of several sets in a region.

    region: a polygon of shapely (see `regions.polygon_of`), which may have holes; least: pieces cut off by its rim that
    are shorter are left out [m]; first: number of the first set. The same for any number of ranks, machine by machine.
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
        raise CommandError(f"fracture set {number}: {expected:.3g} traces are expected, more than {MOST // 2}")
    stream = 2 * number
    if one.stop == "random":
        n = poisson(expected, uniform(seed, stream + 1, 0))
        return _traces(one, (x0, y0, x1, y1), seed, stream, np.arange(n))
    return _until_reached(one, region, (x0, y0, x1, y1), seed, number, expected)


def _until_reached(
    one: FractureSet, region: Any, window: tuple[float, float, float, float], seed: int, number: int, expected: float
) -> np.ndarray:
    """Traces one after the other until the density in the region is nearest to the one asked for."""
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
    way = np.column_stack([half * np.cos(angle), half * np.sin(angle)])
    return np.stack([centre - way, centre + way], axis=1)


def _ended(ends: np.ndarray, older: np.ndarray, share: float, seed: int, number: int) -> np.ndarray:
    """Let traces end where they first meet an older one that stops them; each half grows from the centre by itself."""
    out = ends.copy()
    for i, (a, b) in enumerate(ends):
        others = np.concatenate([older, out[:i]])
        t, who = crossings(a, b, others)
        for sign, end in ((-1.0, 0), (1.0, 1)):
            way = (t - 0.5) * sign
            order = np.argsort(way, kind="stable")
            for k in order[way[order] > 0.0]:
                # One number per pair of traces and side: it does not depend on what else is met.
                draw = uniform(seed, 2 * number + 1, 1 + 2 * (i * (MOST + len(older)) + int(who[k])) + end)
                if draw < share:
                    out[i, end] = a + t[k] * (b - a)
                    break
    return out


def crossings(a: np.ndarray, b: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the segment a-b crosses segments `others` (m, 2, 2): fractions of a-b, and which of the others."""
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


def _known(kind: str, kinds: tuple[str, ...], what: str) -> None:
    if kind not in kinds:
        raise CommandError(f"{what} '{kind}' is not known, choose from {', '.join(kinds)}")


def _finite(value: float, what: str) -> None:
    if not math.isfinite(value):
        raise CommandError(f"{what} must be finite, not {value:g}")

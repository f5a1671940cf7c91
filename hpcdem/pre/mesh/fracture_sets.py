"""Statistics of a set of fractures: how angles and lengths are distributed, and how many there are.

Densities (Dershowitz & Herda 1992): P20 traces per area [1/m2], P21 trace length per area [1/m], P10 traces per length
of a scan line [1/m]. For mean length E[l] and the angle a between trace and scan line

    P21 = P20 E[l],    P10 = P21 E[|sin a|].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from hpcdem.core.errors import CommandError


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
    """Length of traces [m], truncated below `least` and above `greatest` (drawn from the remaining distribution).

    kind: "fixed" (value); "exponential" (value: mean); "lognormal" (value, spread: mean and standard deviation of the
    length); "power" (density proportional to l ** -value between least and greatest). value and spread describe the
    distribution before truncation.
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
            raise CommandError(f"{name}: lengths from {self.least:g} to {self.greatest:g} are not a valid range")
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

    def mean(self, power: int = 1) -> float:
        """Return E[l ** power] after truncation [m]: midpoint rule over the inverse distribution, refined at
        both ends.
        """
        # u = t2 (3 - 2 t) crowds points at both ends, where the inverse of an unbounded distribution is steep.
        t = (np.arange(100_000) + 0.5) / 100_000
        return float((self.lengths(t * t * (3.0 - 2.0 * t)) ** power * 6.0 * t * (1.0 - t)).mean())

    def longest(self) -> float:
        """Return a practical upper bound of the length [m]: all but one in 1e9 traces are shorter."""
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


@dataclass(frozen=True)
class FractureSet:
    """One set of fractures.

    measure: "p10", "p20" or "p21" with its `density`; `scanline` [degrees], the direction of the line for p10.
    stop: "random", the number is drawn from the Poisson distribution, so density is met in the mean; "reached", traces
    are made until p20 or p21 is met in the region itself, as nearly as whole traces can.
    ends_at: share of crossings with traces of earlier sets (and earlier traces of the same set) at which a trace, as it
    grows from its centre, ends. Ended traces are shorter, so p21 is then lower than requested.
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
            raise CommandError(f"{name}: the fraction of ended traces must be from 0 to 1, not {self.ends_at:g}")
        if self.stop == "reached" and self.measure == "p10":
            raise CommandError(f"{name}: only p20 and p21 can be reached exactly; p10 holds on average")
        if self.stop == "reached" and self.ends_at > 0.0 and self.measure == "p21":
            raise CommandError(f"{name}: p21 cannot be reached exactly by traces that end at others: use stop random")

    def p20(self) -> float:
        """Centres per area [1/m2] that give the requested density."""
        if self.measure == "p20":
            return self.density
        if self.measure == "p21":
            return self.density / self.length.mean()
        t = (np.arange(20_000) + 0.5) / 20_000
        sine = float(np.abs(np.sin(self.orientation.angles(t) - math.radians(self.scanline))).mean())
        if sine < 1e-6:
            raise CommandError("a scan line along the fractures meets none of them, so p10 is undefined")
        return self.density / (self.length.mean() * sine)


def _known(kind: str, kinds: tuple[str, ...], what: str) -> None:
    if kind not in kinds:
        raise CommandError(f"{what} '{kind}' is not known, choose from {', '.join(kinds)}")


def _finite(value: float, what: str) -> None:
    if not math.isfinite(value):
        raise CommandError(f"{what} must be finite, not {value:g}")

"""Statistics of a set of discs in space: how normals and radii are distributed, and how many there are.

As `fracture_sets.py` for traces in the plane; `fracture_discs.py` makes the discs. Densities (Dershowitz & Herda 1992):
P30 discs per volume [1/m3], P32 area per volume [1/m], P10 discs per length of a scan line [1/m]. For the radius r and
the angle a between normal and scan line

    P32 = P30 E[pi r2],    P10 = P32 E[|cos a|]    (half of P32, if all directions are alike).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.pre.mesh.fracture_sets import Length
from hpcdem.pre.mesh.solids import _frame

GRID = 400
"""Number of steps of the mean over directions, along each of the two angles."""


@dataclass(frozen=True)
class Poles:
    """Normals of discs. kind: "fixed", or "fisher" about the mean with density kappa exp(kappa cos a) / (4 pi sinh
    kappa) (Fisher 1953; kappa 0: uniform). dip: of the mean [degrees]; towards: dip direction [degrees], clockwise from
    y as seen from above.
    """

    kind: str
    dip: float
    towards: float = 0.0
    kappa: float = 0.0

    def check(self, name: str) -> None:
        """CommandError for what makes no sense."""
        if self.kind not in ("fixed", "fisher"):
            raise CommandError(f"{name}: in three dimensions the orientation must be fixed or fisher, not {self.kind}")
        if not all(map(math.isfinite, (self.dip, self.towards, self.kappa))) or self.kappa < 0.0:
            raise CommandError(f"{name}: angles must be finite, and the spread not negative")
        if self.kind == "fixed" and self.kappa:
            raise CommandError(f"{name}: a fixed orientation has no spread")

    def mean(self) -> np.ndarray:
        """Unit normal of the mean, upwards."""
        dip, towards = math.radians(self.dip), math.radians(self.towards)
        return np.array([math.sin(dip) * math.sin(towards), math.sin(dip) * math.cos(towards), math.cos(dip)])

    def normals(self, u: np.ndarray) -> np.ndarray:
        """Uniform numbers (n, 2) to unit vectors (n, 3)."""
        mean = self.mean()
        if self.kind == "fixed":
            return np.tile(mean, (len(u), 1))
        k = self.kappa
        if k > 1e-9:  # inverse of (exp(k) - exp(k c)) / (exp(k) - exp(-k)), free of overflow
            cosine = 1.0 + np.log1p(u[:, 0] * math.expm1(-2.0 * k)) / k
        else:
            cosine = 1.0 - 2.0 * u[:, 0]
        sine, turn = np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0)), 2.0 * math.pi * u[:, 1]
        one, other = _frame(mean)
        return cosine[:, None] * mean + (sine * np.cos(turn))[:, None] * one + (sine * np.sin(turn))[:, None] * other

    def mean_cosine(self, along: Sequence[float]) -> float:
        """E[|cos|] of the angle between normal and a direction."""
        direction = np.array(along, np.float64)
        middle = (np.arange(GRID) + 0.5) / GRID
        u = np.stack(np.meshgrid(middle, middle, indexing="ij"), axis=-1).reshape(-1, 2)
        return float(np.abs(self.normals(u) @ direction).mean() / math.sqrt(direction @ direction))


@dataclass(frozen=True)
class DiscSet:
    """One set of discs. measure: "p10", "p30" or "p32" with its density; along: direction of the scan line of p10;
    reached: generate discs until p30 or p32 is met in the bodies as closely as whole discs allow, instead of a number
    from the Poisson distribution.
    """

    poles: Poles
    radius: Length
    measure: str
    density: float
    along: Sequence[float] = (0.0, 0.0, 1.0)
    reached: bool = False

    def check(self, name: str) -> None:
        """CommandError for what makes no sense."""
        self.poles.check(name)
        self.radius.check(name)
        if not (math.isfinite(self.density) and self.density > 0.0):
            raise CommandError(f"{name}: the density must be positive, not {self.density:g}")
        if not any(self.along):
            raise CommandError(f"{name}: the scan line needs a direction")
        if self.reached and self.measure == "p10":
            raise CommandError(f"{name}: only p30 and p32 can be reached exactly; p10 holds on average")

    def p30(self) -> float:
        """Centres per volume [1/m3] that give the requested density."""
        if self.measure == "p30":
            return self.density
        area = math.pi * self.radius.mean(2)
        if self.measure == "p32":
            return self.density / area
        cosine = self.poles.mean_cosine(self.along)
        if cosine < 1e-6:
            raise CommandError("a scan line along the discs meets none of them, so p10 is undefined")
        return self.density / (area * cosine)

"""Closed forms of a plane hydraulic fracture that is driven from its middle at a constant rate (KGD).

All in SI units per metre of thickness. young: E' = E / (1 - nu^2) [Pa]; rate: Q of both wings [m2/s]; viscosity: of the
fluid, dynamic [Pa s]; energy: of fracture G [N/m]; time [s]. K' = 4 sqrt(2 / pi) K_Ic, mu' = 12 mu.

Sources: Spence & Sharp 1985, Detournay 2004, Garagash 2006 (International Journal of Solids and Structures 43, 5811),
Adachi & Detournay 2008; Carter 1957.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import scipy


@dataclass(frozen=True)
class Fracture:
    """Fracture of a closed-form solution: half length [m], opening in the middle [m], net pressure in the middle
    [Pa]."""

    length: float
    opening: float
    pressure: float


def toughness(young: float, energy: float) -> float:
    """K_Ic [Pa m^1/2] of a fracture energy."""
    return math.sqrt(young * energy)


def viscous_part(young: float, energy: float, viscosity: float, rate: float) -> float:
    """M = mu' E'^3 Q / K'^4: below about 0.005 toughness alone decides, above 1 viscosity."""
    k = 4.0 * math.sqrt(2.0 / math.pi) * toughness(young, energy)
    return 12.0 * viscosity * young**3 * rate / k**4


def tough(young: float, energy: float, rate: float, time: float) -> Fracture:
    """A fluid without viscosity: equal pressure p = K_Ic / sqrt(pi L) in an ellipse of the volume Q t."""
    k = toughness(young, energy)
    length = (young * rate * time / (2.0 * math.sqrt(math.pi) * k)) ** (2.0 / 3.0)
    pressure = k / math.sqrt(math.pi * length)
    return Fracture(length, 4.0 * pressure * length / young, pressure)


def slightly_viscous(young: float, energy: float, viscosity: float, rate: float, time: float) -> Fracture:
    """`tough` with what a little viscosity changes: the pressure along the fracture in first order of M."""
    base, m = tough(young, energy, rate, time), viscous_part(young, energy, viscosity, rate)
    volume, opening, pressure = _slopes()
    longer = (1.0 + m * volume) ** (-2.0 / 3.0)
    return Fracture(
        base.length * longer,
        base.opening * math.sqrt(longer) * (1.0 + m * opening),
        base.pressure / math.sqrt(longer) * (1.0 + m * pressure),
    )


@cache
def _slopes() -> tuple[float, float, float]:
    """Relative changes of volume, opening and pressure in the middle by M, at the same length and K_I.

    At x = s L the flow in the ellipse, which grows by L ~ t^(2/3) and w_0 ~ t^(1/3), is q = (w_0 L / t) (acos(s) / 2 +
    s sqrt(1 - s^2) / 6), and takes dp/ds = -mu' L q / w^3. This drop, g, measured from the tip condition K_I = K_Ic,
    changes volume and opening by the weights of a pressure in a straight crack.
    """

    def steep(s: float) -> float:
        return (0.5 * math.acos(s) + s * math.sqrt(1.0 - s * s) / 6.0) / (1.0 - s * s) ** 1.5

    def mean(
        reach: Callable[[float], float],
    ) -> float:  # of -(integral of steep from 0), weighted; reach(s): part of the weight beyond s
        return -float(
            scipy.integrate.quad(lambda a: steep(math.sin(a)) * reach(math.sin(a)) * math.cos(a), 0.0, 0.5 * math.pi)[0]
        )

    # Parts of the weights 2 / pi / sqrt(1 - s^2), 4 / pi sqrt(1 - s^2) and ln(...) / pi that lie beyond s.
    at_tip = mean(lambda s: 2.0 / math.pi * math.acos(s))
    of_volume = mean(lambda s: 2.0 / math.pi * (math.acos(s) - s * math.sqrt(1.0 - s * s)))
    of_opening = mean(
        lambda s: 2.0 / math.pi * (math.acos(s) - s * math.log((1.0 + math.sqrt(1.0 - s * s)) / max(s, 1e-300)))
    )
    # mu' L^2 / (w_0^2 t p) in the ellipse, over M: w_0 = 4 p L / E', Q t = 2 pi p L^2 / E', K_Ic^2 = pi L p^2.
    scale = 2.0 * math.pi * (4.0 * math.sqrt(2.0 / math.pi)) ** 4 * math.pi**2 / 16.0 / (2.0 * math.pi) ** 2
    return scale * (of_volume - at_tip), scale * (of_opening - at_tip), -scale * at_tip


def viscous(young: float, viscosity: float, rate: float, time: float) -> Fracture:
    """Compute the fracture without toughness and without lag between fluid and tip; constants of the self-similar
    solution (0.6152, 1.127, 0.5466)."""
    mu = 12.0 * viscosity
    return Fracture(
        0.6152 * (young * rate**3 * time**4 / mu) ** (1.0 / 6.0),
        1.127 * (mu * rate**3 / young) ** (1.0 / 6.0) * time ** (1.0 / 3.0),
        0.5466 * (young * young * mu / time) ** (1.0 / 3.0),
    )


def resolution(young: float, energy: float, strength: float, confinement: float, edge: float) -> float:
    """R = h (T + sigma_0)^2 / (E' G): a joint must lose its confinement before it opens; the pressure is in error by
    about 4 % R, the opening by 1.8 % R, above 1 the fracture snaps from joint to joint."""
    return edge * (strength + confinement) ** 2 / (young * energy)

"""Closed forms of elastic bodies in space.

A cantilever of length L, square section b x b, loaded by the force F at its end: bending and shear (Timoshenko),
w = F L^3 / (3 E I) + F L / (k G A), I = b^4 / 12, k = 10 (1 + nu) / (12 + 11 nu) (Cowper 1966).

A spherical cavity of radius a in a body under the stress T along z far away (Goodier 1933): on the equator
s_zz / T = 1 + (4 - 5 nu) / (2 (7 - 5 nu)) (a / r)^3 + 9 / (2 (7 - 5 nu)) (a / r)^5.

A thick sphere a < r < b with the pressure p inside (Lame): with f = p a^3 / (b^3 - a^3),
s_r = f (1 - b^3 / r^3), s_t = f (1 + b^3 / (2 r^3)), u = r (s_t - nu (s_r + s_t)) / E.

Torsion of a square bar of the side b (Saint-Venant): angle = M L / (G J), J = b^4 (1 / 3 - 64 / pi^5 sum
tanh(n pi / 2) / n^5, n odd).

A penny-shaped crack of radius a with the pressure p inside (Sneddon 1946): the opening 8 (1 - nu^2) p a / (pi E)
sqrt(1 - r^2 / a^2), whose volume is 16 (1 - nu^2) p a^3 / (3 E).
"""

from __future__ import annotations

import math


def cantilever(force: float, length: float, side: float, young: float, nu: float) -> float:
    k = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu)
    shear = young / (2.0 * (1.0 + nu))
    return 4.0 * force * length**3 / (young * side**4) + force * length / (k * shear * side**2)


def goodier(r: float, nu: float) -> float:
    """s_zz / T on the equator; r: over the radius of the cavity."""
    c = 2.0 * (7.0 - 5.0 * nu)
    return 1.0 + (4.0 - 5.0 * nu) / c / r**3 + 9.0 / c / r**5


def thick_sphere(r, a: float, b: float, p: float, young: float, nu: float):
    """Radial and tangential stress, radial movement."""
    f = p * a**3 / (b**3 - a**3)
    radial, along = f * (1.0 - b**3 / r**3), f * (1.0 + 0.5 * b**3 / r**3)
    return radial, along, r / young * (along - nu * (radial + along))


def square_torsion(side: float) -> float:
    """J [m4]."""
    total = sum(math.tanh(0.5 * math.pi * n) / n**5 for n in range(1, 40, 2))
    return side**4 * (1.0 / 3.0 - 64.0 / math.pi**5 * total)


def penny(r, a: float, p: float, young: float, nu: float):
    """Opening at r."""
    return 8.0 * (1.0 - nu**2) * p * a / (math.pi * young) * (1.0 - (r / a) ** 2) ** 0.5

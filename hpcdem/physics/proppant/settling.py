"""The speed at which a single grain settles in a fluid at rest.

Drag over rho v^2 / 2 times the cross-section: 24 / Re (1 + 0.15 Re^0.687) up to Re = 1000, 0.44 beyond (Schiller &
Naumann 1933), Re = rho v d / mu. At the terminal speed it balances the weight in the fluid, (rho_p - rho) g pi d^3 / 6.
Stokes' 24 / Re is the limit of small Re.
"""

from __future__ import annotations

import math
from functools import lru_cache

NEWTON = 1000.0
"""Reynolds number above which the drag coefficient is 0.44."""


def drag(reynolds: float) -> float:
    """The drag coefficient."""
    return 24.0 / reynolds * (1.0 + 0.15 * reynolds**0.687) if reynolds < NEWTON else 0.44


def stokes(size: float, density: float, fluid: float, viscosity: float, gravity: float) -> float:
    """Terminal speed [m/s] after Stokes, up if negative: diameter [m], densities of grain and fluid [kg/m3], dynamic
    viscosity [Pa s], gravity [m/s2]."""
    return (density - fluid) * size * size * gravity / (18.0 * viscosity)


@lru_cache(maxsize=8)
def terminal(size: float, density: float, fluid: float, viscosity: float, gravity: float) -> float:
    """Settling velocity after Schiller and Naumann."""
    from scipy.optimize import brentq  # as long to import as all of this package

    slow = stokes(size, density, fluid, viscosity, gravity)
    if slow == 0.0:
        return 0.0
    weight = abs(density - fluid) * gravity * size * (4.0 / 3.0)

    def lacks(v: float) -> float:
        return drag(fluid * v * size / viscosity) * fluid * v * v - weight

    most = abs(slow)  # what drags more is slower
    v = brentq(lacks, 1e-9 * most, most, xtol=1e-15 * most, rtol=1e-14) if lacks(most) > 0.0 else most
    return math.copysign(v, slow)


def reynolds(v: float, size: float, fluid: float, viscosity: float) -> float:
    """Compute the Reynolds number of a grain of this speed [m/s]."""
    return fluid * abs(v) * size / viscosity

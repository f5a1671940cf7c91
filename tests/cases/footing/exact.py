"""Bearing capacity of a strip footing on weightless soil (Prandtl 1920, Reissner 1924).

Below the footing a wedge in which the pressure p is a principal stress, beside it one in which the load of the surface
q is, between them a fan of 90 degrees. Along the fan's slip lines s, the mean stress in the plane plus c cot(phi),
grows by exp(2 tan(phi) theta): with theta = pi / 2, and p + c cot(phi) = s (1 + sin phi) at one end, q + c cot(phi) =
s (1 - sin phi) at the other,

    p = c N_c + q N_q,   N_q = exp(pi tan(phi)) (1 + sin phi) / (1 - sin phi),   N_c = (N_q - 1) / tan(phi)

and for phi -> 0 p = (2 + pi) c + q. A wedge below a rough footing moves with it, below a smooth one it parts in the
middle: both bear the same. With psi = phi p is the limit load; with psi < phi the load may be less.
"""

from __future__ import annotations

import math


def pressure(cohesion: float, friction: float, load: float) -> float:
    """p [Pa] from c [Pa], phi [degrees], q [Pa]."""
    if friction == 0.0:
        return (2.0 + math.pi) * cohesion + load
    phi = math.radians(friction)
    nq = math.exp(math.pi * math.tan(phi)) * (1.0 + math.sin(phi)) / (1.0 - math.sin(phi))
    return cohesion * (nq - 1.0) / math.tan(phi) + load * nq

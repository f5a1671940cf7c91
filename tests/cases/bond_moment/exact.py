"""Elastic bonds that carry a moment (Potyondy & Cundall 2004): the bending of one, and a cantilever of bonded discs.

Section of half height Rt, discs: A = 2 Rt, I = 2/3 Rt^3 (1 m thick); spheres: A = pi Rt^2, I = pi Rt^4/4. L = Ra + Rb.

    M = E I/L theta,  breaks where |M| Rt/I - Fn/A > T:  pure bending at theta = T L/(E Rt)

Cantilever of n + 1 equal touching discs, the first held, P across the last, l = n L from centre to centre. Bond k is at
(k + 1/2) L, carries M_k = P (l - (k + 1/2) L) and the shear force P:

    tip = sum of M_k/(E I/L) (l - (k + 1/2) L) + n P/(G A/L)  ->  P l^3/(3 E I) (1 - 1/(4 n^2)) + P l/(G A)

The largest stress is at the first bond: P (l - L/2) Rt/I.
"""

from __future__ import annotations

import math

R, E, G, T = 0.5, 2e8, 1e8, 1e6
"""Radius [m], moduli and tensile strength [Pa]."""


def section(spheres: bool, rt: float = R) -> tuple[float, float]:
    """Area [m2] and second moment [m4]."""
    return (math.pi * rt**2, math.pi * rt**4 / 4.0) if spheres else (2.0 * rt, 2.0 * rt**3 / 3.0)


def tip(n: int, load: float) -> float:
    """Deflection [m] of the end of the cantilever of discs."""
    (area, inertia), length = section(False), 2.0 * R
    arms = [(n - k - 0.5) * length for k in range(n)]
    return load * sum(arm * arm for arm in arms) / (E * inertia / length) + n * load / (G * area / length)

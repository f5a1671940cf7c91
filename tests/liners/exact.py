"""A circular tunnel of radius R in an elastic plane under the stress P vertically and K P horizontally, lined before
anything has moved (Einstein and Schwartz 1979): thrust T, positive in compression, and moment M per thickness.

C = E R (1 - nu_s^2) / (E_s A_s (1 - nu^2)), F = E R^3 (1 - nu_s^2) / (E_s I_s (1 - nu^2)), theta from the horizontal.

T = P R / 2 [(1 + K) (1 - a0) + (1 - K) t2 cos 2 theta], M = P R^2 / 2 (1 - K) m2 cos 2 theta with
a0 = C F (1 - nu) / (C + F + C F (1 - nu)) and

full slip: t2 = m2 = 1 - 2 a2, a2 = (F + 6) (1 - nu) / (2 F (1 - nu) + 6 (5 - 6 nu));
no slip: t2 = 1 + 2 a2, m2 = (1 - 2 a2 + 2 b2) / 2, a2 = beta b2,
beta = ((6 + F) C (1 - nu) + 2 F nu) / (3 F + 3 C + 2 C F (1 - nu)),
b2 = C (1 - nu) / (2 (C (1 - nu) + 4 nu - 6 beta - 3 beta C (1 - nu))).

Their moment is that of Fluegge's shell, E I (w'' + w) / R^2 of the deflection w. Beams know how much their
cross-sections turn, (w'' - v') / R^2, v: along the ring. The two differ by the strain (v' + w) / R over R, so by
T2 I / (A R), T2: the part of T with cos 2 theta; in bonded liners of soft rock M is so small that this shows.
"""

from __future__ import annotations


def ratios(young: float, nu: float, radius: float, ea: float, ei: float) -> tuple[float, float]:
    """C and F; ea, ei: stiffness of the liner in plane strain."""
    plane = young / (1.0 - nu**2)
    return plane * radius / ea, plane * radius**3 / ei


def amplitudes(c: float, f: float, nu: float, slips: bool) -> tuple[float, float, float]:
    """1 - a0, t2 and m2."""
    a0 = c * f * (1.0 - nu) / (c + f + c * f * (1.0 - nu))
    if slips:
        a2 = (f + 6.0) * (1.0 - nu) / (2.0 * f * (1.0 - nu) + 6.0 * (5.0 - 6.0 * nu))
        return 1.0 - a0, 1.0 - 2.0 * a2, 1.0 - 2.0 * a2
    beta = ((6.0 + f) * c * (1.0 - nu) + 2.0 * f * nu) / (3.0 * f + 3.0 * c + 2.0 * c * f * (1.0 - nu))
    b2 = c * (1.0 - nu) / (2.0 * (c * (1.0 - nu) + 4.0 * nu - 6.0 * beta - 3.0 * beta * c * (1.0 - nu)))
    a2 = beta * b2
    return 1.0 - a0, 1.0 + 2.0 * a2, 0.5 * (1.0 - 2.0 * a2 + 2.0 * b2)

"""A beam on two supports, a load P [N/m] in the middle; span S, height H, per metre of thickness, plane strain.

Deflection of the axis under the load against the axis above the supports (Timoshenko beam; E' = E/(1 - nu2), I =
H3/12):

    P S3 / (48 E' I) + P S / (4 k G H),  k = 5/6: shear; a sixth of the whole for H/S = 1/4.

A concentrated load relieves the fibre opposite to it (Stokes, Wilson 1891; von Karman & Seewald 1927; Timoshenko &
Goodier, section 40): largest stress 3 P S / (2 H2) (1 - 0.1773 H/S). Brittle strength is reached first there, so

    P = 2 T H2 / (3 S) / (1 - 0.1773 H/S).

The largest load is above that, as the stress softens over a length E G_f/T2 that is not small beside H: the size
effect.

Work of fracture (RILEM 50-FMC 1985): all work until the halves are apart is G_f times the ligament. The load falls as
one over the square of the deflection u at the end, when both halves turn about the last ligament; what is left at an
end at P_e, u_e is P_e u_e (Elices, Guinea & Planas 1992).
"""

from __future__ import annotations


def stiffness(young: float, poisson: float, span: float, height: float) -> float:
    """Load over deflection [Pa]."""
    plane, shear = young / (1.0 - poisson**2), young / (2.0 * (1.0 + poisson))
    return 1.0 / (span**3 / (4.0 * plane * height**3) + span / (4.0 * 5.0 / 6.0 * shear * height))


def first_crack(strength: float, span: float, height: float) -> float:
    """Load [N/m]."""
    return 2.0 * strength * height**2 / (3.0 * span) / (1.0 - 0.1773 * height / span)

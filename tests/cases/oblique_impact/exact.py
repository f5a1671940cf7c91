"""V14: a turning ball glances off a rough wall, sliding all the time.

Linear contact, no damping: e = 1, so the normal impulse is 2 m vn. While the surface slides, friction is mu Fn at every
moment and its impulse mu times the normal one (Whittaker; Maw, Barber & Fawcett 1976 for the limit of gross slip):

    change of vt = -mu (1 + e) vn,   change of spin = -(mu (1 + e) m vn) l / I,   l = R up to half the overlap

The surface still slides at the end if vt exceeds mu (1 + e) vn (1 + m R^2 / I): 3.5 mu 2 vn for spheres, 3 mu 2 vn
for disks. Numbers: R = 1, mu = 0.3, vn = 0.01, vt = 0.05 > 0.021. Contact time 200 steps; largest overlap vn / w =
6e-4 R.
"""

from __future__ import annotations

import math

RADIUS, DENSITY, MU, VN, VT, DT, CONTACT_STEPS = 1.0, 2000.0, 0.3, 0.01, 0.05, 1e-3, 200
W = math.pi / (CONTACT_STEPS * DT)
LOST = MU * 2.0 * VN


def spin(mass: float, inertia: float) -> float:
    """Spin after the impact [rad/s]."""
    return -mass * RADIUS * LOST / inertia

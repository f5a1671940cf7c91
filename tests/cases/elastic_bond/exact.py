"""V19, V20, V22: the elastic bond (model 1) of two equal spheres.

Bond of cross-section A = pi Rt^2 (between disks: 2 Rt x 1 m), Rt = 2 Ra Rb / (Ra + Rb), length L = Ra + Rb. Overlap U:

    U >= 0: Fn = K U^(3/2), ks of Mindlin: the contact alone, as if there were no bond
    U < 0:  Fn = E A / L U (tension), ks = G A / L
    Fs = sum of ks d(way) through both; no Coulomb slip while the bond holds
    breaks in tension if -Fn > T A, that is at the gap T L / E: nothing is left
    breaks in shear if |Fs| > C A + mu max(Fn, 0): min(|Fs|, mu max(Fn, 0)) is left

Numbers for R = 60 m, E = 200 MPa, T = 20 MPa, C = 40 MPa: A = 11309.7 m^2, E A / L = 1.88496e10 N/m, T A =
2.26195e11 N, gap 12 m; C A = 4.52389e11 N.
"""

from __future__ import annotations

import math

RADIUS, SHEAR, NU, MU = 60.0, 2.9e9, 0.2, 0.3
E, G, T, C = 2e8, 1.5e8, 2e7, 4e7
AREA, LENGTH = math.pi * RADIUS**2, 2.0 * RADIUS
K = 2.0 * SHEAR * math.sqrt(2.0 * RADIUS) / (3.0 * (1.0 - NU))
STIFFNESS, STRENGTH, GAP = E * AREA / LENGTH, T * AREA, T * LENGTH / E


def normal_force(u: float) -> float:
    """Fn [N] of the bonded pair."""
    return K * u**1.5 if u >= 0.0 else STIFFNESS * u


def shear_stiffness(u: float) -> float:
    """ks [N/m] of the bonded pair."""
    if u < 0.0:
        return G * AREA / LENGTH
    return 2.0 * (3.0 * SHEAR**2 * (1.0 - NU) * RADIUS * normal_force(u)) ** (1.0 / 3.0) / (2.0 - NU)

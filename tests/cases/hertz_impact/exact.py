"""V7, V8: Hertz impact (Hertz 1881; Johnson, Contact Mechanics, 11.4).

Fn = K U^(3/2) with K = 2 G sqrt(2 Rt) / (3 (1 - nu)), Rt = 2 Ra Rb / (Ra + Rb) (R at a wall), effective mass
M = ma mb / (ma + mb) (m at a wall). Energy: M (v^2 - U'^2) / 2 = (2/5) K U^(5/2), hence

    Umax = (5 M v^2 / (4 K))^(2/5),   Fmax = K Umax^(3/2)
    duration = 2 (Umax / v) int_0^1 dz / sqrt(1 - z^(5/2)) = 2.94328 Umax / v

the integral being (2/5) B(2/5, 1/2) with Euler's beta function. The rebound is elastic.
"""

from __future__ import annotations

import math

from scipy.special import beta

RADIUS, G, NU, DENSITY, V = 60.0, 2.9e9, 0.2, 2500.0, 1.0
MASS = DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
DURATION = 0.8 * beta(0.4, 0.5)


class Impact:
    """Largest overlap [m], duration [s], largest force [N] for an effective mass and radius Rt."""

    def __init__(self, mass: float, rt: float = RADIUS) -> None:
        k = 2.0 * G * math.sqrt(2.0 * rt) / (3.0 * (1.0 - NU))
        self.overlap = (5.0 * mass * V**2 / (4.0 * k)) ** 0.4
        self.duration = DURATION * self.overlap / V
        self.force = k * self.overlap**1.5


PAIR, WALL = Impact(0.5 * MASS), Impact(MASS)

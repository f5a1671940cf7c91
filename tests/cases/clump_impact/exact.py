"""A dumbbell falls on a smooth floor: two discs of radius R, L apart, moving as one body of mass M and inertia I.

Lying flat both discs touch at once, and M y'' = -2 k u is the impact of a ball on a spring 2 k: it leaves with the
speed v0 after pi sqrt(M / 2k), the largest overlap being v0 sqrt(M / 2k), and does not turn. The steps of the program
are

    u(n) = u(1) sin(n q) / sin(q),   u(1) = v0 dt,   2 cos(q) = 2 - w^2 dt^2,   w^2 = 2 k / M

At an angle theta to the floor only the lower disc touches, a = (L/2) cos(theta) beside the centre. In the limit of a
stiff floor the body does not turn while it touches, and what moves up and down with the disc is the mass

    1/mu = 1/M + a^2/I     (of a push j at the disc: dV = j/M, dW = j a/I, so its own speed changes by j/mu)

so that it leaves with the push j = 2 mu v0: V = -v0 + j/M, |W| = j a/I. Kinetic energy and the speed v0 of the disc
relative to the floor are those before. The contact lasts pi sqrt(mu / k); the body turns by as much as that, so what a
floor of finite stiffness does is away from the limit by k^(-1/2).
"""

from __future__ import annotations

import math

import numpy as np

R, L, DENSITY, K, V0 = 0.5, 3.0, 2.0, 1e5, 0.7
AREA = 2.0 * math.pi * R**2
MOMENT = AREA * (0.5 * R**2 + 0.25 * L**2)
MASS, INERTIA = DENSITY * AREA, DENSITY * MOMENT


def flat(n: np.ndarray, dt: float) -> np.ndarray:
    """Overlap u(n) [m] while it lies on the floor."""
    q = math.acos(1.0 - K / MASS * dt**2)
    return V0 * dt * np.sin(n * q) / math.sin(q)


def oblique(theta: float) -> tuple[float, float]:
    """Velocity upwards [m/s] and spin [rad/s] after the impact; the disc at -L/2 is the lower one, 0 < theta < pi/2."""
    a = 0.5 * L * math.cos(theta)
    mu = 1.0 / (1.0 / MASS + a**2 / INERTIA)
    push = 2.0 * mu * V0
    return -V0 + push / MASS, -a * push / INERTIA


def contact_time(theta: float, k: float) -> float:
    """[s] on a floor of stiffness k [N/m]."""
    a = 0.5 * L * math.cos(theta)
    return math.pi / math.sqrt(k * (1.0 / MASS + a**2 / INERTIA))

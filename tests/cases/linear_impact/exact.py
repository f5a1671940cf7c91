"""V3, V4: a ball runs into a fixed one, linear contact, with and without lattice-solid damping.

After Li et al. 2018, tests 1 and 2. x is the way of the moving ball since it touched (negative: overlap), k = kn /
2 the two equal springs in series, eta the viscous damping of the moving ball, w^2 = k / m, b = eta / (2 m):

    m x'' = -k x - eta x',  x(0) = 0, x'(0) = -v0
    x(t) = -(v0 / wd) exp(-b t) sin(wd t),   wd^2 = w^2 - b^2
    contact time pi / wd; speed when it ends v0 exp(-b pi / wd)
    largest overlap at tan(wd t) = wd / b
    afterwards only the damping acts: x = v1 / (2 b) (1 - exp(-2 b (t - t1)))

The program takes steps: v <- (1 - 2 b dt) v - w^2 dt x, x <- x + dt v, that is

    x(n+1) - (2 - 2 b dt - w^2 dt^2) x(n) + (1 - 2 b dt) x(n-1) = 0,   x(0) = 0, x(1) = -(1 - 2 b dt) v0 dt
    x(n) = x(1) r^(n-1) sin(n q) / sin(q),   r^2 = 1 - 2 b dt,   2 r cos(q) = 2 - 2 b dt - w^2 dt^2

which the tests ask for to rounding. The damping force takes the velocity half a step late, so the distance to the
continuous law is of first order in dt where eta is not zero, and of second order otherwise.
"""

from __future__ import annotations

import math

import numpy as np

RADIUS, DENSITY, KN, V0 = 50.0, 2500.0, 11e9, 0.1
MASS = DENSITY * 2.0 * math.sqrt(3.0) * RADIUS**2
W = math.sqrt(0.5 * KN / MASS)


class Exact:
    """The continuous motion for a damping eta [N s/m]."""

    def __init__(self, eta: float) -> None:
        self.b = b = eta / (2.0 * MASS)
        self.wd = math.sqrt(W**2 - b**2)
        self.contact_time = math.pi / self.wd
        self.exit_speed = V0 * math.exp(-b * self.contact_time)
        self.deepest_at = math.atan2(self.wd, b) / self.wd
        self.deepest = -self.way(self.deepest_at)

    def way(self, t: float) -> float:
        """x(t) [m]."""
        if t <= self.contact_time:
            return -V0 / self.wd * math.exp(-self.b * t) * math.sin(self.wd * t)
        rest = t - self.contact_time
        if self.b == 0.0:
            return self.exit_speed * rest
        return self.exit_speed / (2.0 * self.b) * -math.expm1(-2.0 * self.b * rest)


def by_steps(n: np.ndarray, eta: float, dt: float) -> np.ndarray:
    """x(n) [m] as long as the balls touch."""
    loss = eta * dt / MASS
    r = math.sqrt(1.0 - loss)
    q = math.acos((2.0 - loss - (W * dt) ** 2) / (2.0 * r))
    return -(1.0 - loss) * V0 * dt * r ** (n - 1.0) * np.sin(n * q) / math.sin(q)

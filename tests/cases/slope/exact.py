"""V15, V16: a ball on a slope of angle a: sliding, at rest, rolling.

The normal force is N = m g cos a throughout. Down the slope:

    fixed spin, tan a > mu:   m x'' = m g sin a - mu N                       x'' = g (sin a - mu cos a)
    fixed spin, tan a < mu:   at rest, friction m g sin a, the shear spring stretched by m g sin a / ks
    free, rolling:            m x'' = m g sin a - F,  I w' = F l,  x'' = l w'   x'' = g sin a / (1 + I / (m l^2))

l = R - U/2 is the arm of the contact; with U << R and I = m R^2 / 2 (disk) or 2/5 m R^2 (sphere) this is 2/3 or 5/7
g sin a. Rolling needs F = g sin a m I / (I + m l^2) <= mu N, i.e. tan a <= mu (1 + m l^2 / I): 3 mu or 3.5 mu.
Beyond, the ball slides and turns, x'' = g (sin a - mu cos a), and I w' = mu N l.
"""

from __future__ import annotations

import math

GRAVITY, RADIUS, DENSITY = 9.8, 1.0, 1000.0


def sliding(angle: float, mu: float) -> float:
    """Acceleration down the slope [m/s^2]."""
    return GRAVITY * (math.sin(angle) - mu * math.cos(angle))


def rolling(angle: float, inertia_ratio: float) -> float:
    """Acceleration down the slope [m/s^2]; inertia_ratio = I / (m R^2)."""
    return GRAVITY * math.sin(angle) / (1.0 + inertia_ratio)

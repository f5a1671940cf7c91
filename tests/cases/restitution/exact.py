"""A collision with a spring and a dashpot.

m U'' + c U' + S U = 0 with c = 2 beta sqrt(m S): U = V/wd exp(-b t) sin(wd t), b = c / 2m, wd = sqrt(S/m - b^2). It
is over at t = pi / wd, at the speed e V, e = exp(-pi b / wd). With beta = b sqrt(m/S), e = exp(-pi beta / sqrt(1 -
beta^2)).
"""

from __future__ import annotations

import math


def beta_by_bisection(e: float) -> float:
    """The beta of an e, found without the formula that the program uses."""
    low, high = 0.0, 1.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (
            (middle, high) if math.exp(-math.pi * middle / math.sqrt(1.0 - middle * middle)) > e else (low, middle)
        )
    return low


def linear(mass: float, stiffness: float, e: float, speed: float) -> tuple[float, float]:
    """Duration [s] and largest overlap [m] of an effective mass on a linear spring."""
    w, beta = math.sqrt(stiffness / mass), beta_by_bisection(e)
    wd = w * math.sqrt(1.0 - beta * beta)
    at = math.atan2(wd, beta * w) / wd
    return math.pi / wd, speed / wd * math.exp(-beta * w * at) * math.sin(wd * at)


def hertz(mass: float, factor: float, e: float, speed: float, steps: int = 200_000) -> tuple[float, float, float]:
    """Duration [s], largest overlap [m] and e of m U'' = -K U^1.5 - sqrt(5) beta sqrt(m K) U^0.25 U', by midpoints in
    steps of a thousandth of a percent of the elastic duration; K: factor [N/m^1.5]."""
    beta = beta_by_bisection(e)
    c = math.sqrt(5.0) * beta * math.sqrt(mass * factor)
    deepest = (1.25 * mass * speed * speed / factor) ** 0.4
    dt = 3.0 * deepest / speed / steps
    u, v, t, most = 0.0, speed, 0.0, 0.0
    while True:
        half_u = u + 0.5 * dt * v
        half_v = v - 0.5 * dt * (factor * max(u, 0.0) ** 1.5 + c * max(u, 0.0) ** 0.25 * v) / mass
        above = max(half_u, 0.0)
        u, v, t = u + dt * half_v, v - dt * (factor * above**1.5 + c * above**0.25 * half_v) / mass, t + dt
        most = max(most, u)
        if u <= 0.0:
            return t, most, -v / speed

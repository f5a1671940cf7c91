"""V1, V2: a ball in vacuum, as the leap-frog moves it.

Nothing touches the ball; the force is m (0, -g), the local damping adds -alpha |F| sgn(v) with sgn(0) = +1.
From rest the first step sees v = 0, hence a = -g (1 + alpha); from then on v < 0 and a = -g (1 - alpha):

    v(n) = -g dt [ (1 + alpha) + (n - 1) (1 - alpha) ]
    y(n) = y0 + dt sum v = y0 - g dt^2 [ (1 + alpha) n + (1 - alpha) n (n - 1) / 2 ]

With alpha = 0 this is y0 - g dt^2 n (n + 1) / 2: below the law y0 - g t^2 / 2 by g dt t / 2, because velocity
stands at half steps and the start is taken as one. Mass does not enter.
"""

from __future__ import annotations

G, DT, STEPS, Y0 = 9.8, 0.01, 500, 100.0


def height(n: int, alpha: float = 0.0) -> float:
    """y after n steps [m]."""
    return Y0 - G * DT**2 * ((1.0 + alpha) * n + (1.0 - alpha) * n * (n - 1) / 2.0)


def thrown(n: int, v0: float, alpha: float) -> float:
    """y after n steps [m] while still going up: gravity and damping pull together, a = -g (1 + alpha)."""
    return Y0 + v0 * n * DT - G * (1.0 + alpha) * DT**2 * n * (n + 1) / 2.0

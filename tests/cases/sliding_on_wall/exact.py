"""V5, V6: a ball pressed against a wall, pushed along it: it sticks, slips, stops and swings back.

After Li et al. 2018, tests 3 and 4. The ball can only move along the wall (y); its overlap U stays as it is, so Fn
= k U is constant, with k = kn / 2 for normal and shear alike (equal springs of ball and wall in series). w^2 = k /
m, b = eta / (2 m), wd^2 = w^2 - b^2; friction carries at most mu Fn, reached at the stretch ys = mu Fn / k = mu U.

    stick   m y'' = -k y - eta y':         y = (v0 / wd) exp(-b t) sin(wd t)        until y = ys, at t1 with speed v1
    slip    m y'' = -mu Fn - eta y':       v = v1 - a s                              (eta = 0; a = mu Fn / m = w^2 ys)
                                           v = (v1 + a/2b) exp(-2 b s) - a/2b        (s = t - t1)
            until v = 0, at t2 and y2
    swing   the spring is stretched by ys: y = y2 - ys + ys exp(-b s) (cos(wd s) + (b / wd) sin(wd s))   (s = t - t2)

The swing reaches -ys at most and so never slips again.
"""

from __future__ import annotations

import math

import scipy

RADIUS, DENSITY, K, OVERLAP, MU, V0 = 50.0, 2500.0, 11e9, 0.220573, 0.1, 1.0
MASS = DENSITY * 2.0 * math.sqrt(3.0) * RADIUS**2
FN = 0.5 * K * OVERLAP
STRETCH = MU * OVERLAP
W = math.sqrt(0.5 * K / MASS)


class Exact:
    """The continuous motion for a damping eta [N s/m]; times [s], places [m]."""

    def __init__(self, eta: float) -> None:
        self.b = b = eta / (2.0 * MASS)
        self.wd = wd = math.sqrt(W**2 - b**2)
        self.slips_at = t1 = scipy.optimize.brentq(
            lambda t: self._stick(t)[0] - STRETCH, 0.0, 0.5 * math.pi / wd, xtol=1e-15
        )
        v1 = self._stick(t1)[1]
        a = W**2 * STRETCH
        if b == 0.0:
            s = v1 / a
            way = 0.5 * v1 * s
        else:
            s = math.log1p(2.0 * b * v1 / a) / (2.0 * b)
            way = (v1 - a * s) / (2.0 * b)
        self.stops_at, self.stops_y = t1 + s, STRETCH + way
        self.centre = self.stops_y - STRETCH

    def _stick(self, t: float) -> tuple[float, float]:
        e, c, s = math.exp(-self.b * t), math.cos(self.wd * t), math.sin(self.wd * t)
        return V0 / self.wd * e * s, V0 * e * (c - self.b / self.wd * s)

    def swing(self, t: float) -> float:
        """y(t) after the stop [m]."""
        s = t - self.stops_at
        wave = math.cos(self.wd * s) + self.b / self.wd * math.sin(self.wd * s)
        return self.centre + STRETCH * math.exp(-self.b * s) * wave

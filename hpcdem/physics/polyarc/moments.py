"""Area, centroid and polar second moment of area of outlines of arcs, exact.

An outline is the polygon of its vertices (shoelace sums) and a circular segment on every edge. For a segment of radius
R and central angle t, with x along the chord and y outwards from its middle, integration gives

    area     = R^2 (t - sin t) / 2
    int y    = R^3 (3/4 sin(t/2) + sin(3t/2) / 12 - (t/2) cos(t/2))
    int x2+y2 = R^4 (t/2 + (t/4) cos t - (3/4) sin t)

which is the usual form about the centre of the arc (area, centroid at 4 R sin^3(t/2) / (3 (t - sin t)), polar moment
R^4 (t/4 - sin t (2 + cos t) / 12)) shifted to the chord. Shifted like this the leading terms are gone and the power
series of what is left can be used for small t, where the closed forms cancel.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hpcdem.physics.polyarc.outlines import Outlines

_SERIES = 1.0
"""Central angles below this [rad] take the series; its terms then fall by a factor of 40 or more."""


@njit(cache=True, nogil=True, error_model="numpy")
def segment(chord, t):
    """Area [m2], int y [m3] and int (x2 + y2) [m4] of a circular segment about the middle of its chord [m]."""
    if t < 1e-30:
        return 0.0, 0.0, 0.0
    radius = chord / (2.0 * np.sin(0.5 * t))
    if t < _SERIES:
        area = first = second = 0.0
        sign, term, h, half = -1.0, t, 0.5 * t, 0.5 * t  # t^n / n! and (t/2)^n / n!
        power = 3.0  # 3^n
        n = 1
        while n < 25:
            n += 2
            term *= t * t / (n * (n - 1))
            half *= h * h / (n * (n - 1))
            power *= 9.0
            area -= sign * term * 0.5
            first += sign * half * (0.75 + power / 12.0 - n)
            second += sign * term * 0.25 * (n - 3.0)
            sign = -sign
    else:
        h = 0.5 * t
        area = 0.5 * (t - np.sin(t))
        first = 0.75 * np.sin(h) + np.sin(3.0 * h) / 12.0 - h * np.cos(h)
        second = 0.5 * t + 0.25 * t * np.cos(t) - 0.75 * np.sin(t)
    return radius**2 * area, radius**3 * first, radius**4 * second


def moments(outlines: Outlines) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Area [m2], centroid x and y [m], polar second moment of area about the centroid [m4]: (n,) f8 each."""
    return _moments(outlines.start, outlines.x, outlines.y, outlines.theta)


@njit(cache=True, nogil=True, error_model="numpy")
def _moments(start, x, y, theta):
    n = len(start) - 1
    area, cx, cy, polar = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    for k in range(n):
        a, b = start[k], start[k + 1]
        # About the middle of the vertices, so that a place far from the origin costs no digits.
        ox, oy = x[a:b].mean(), y[a:b].mean()
        s = sx = sy = j = 0.0
        for i in range(a, b):
            e = i + 1 if i + 1 < b else a
            x1, y1, x2, y2 = x[i] - ox, y[i] - oy, x[e] - ox, y[e] - oy
            cross = x1 * y2 - x2 * y1
            s += cross / 2.0
            sx += cross * (x1 + x2) / 6.0
            sy += cross * (y1 + y2) / 6.0
            j += cross * (x1 * x1 + x1 * x2 + x2 * x2 + y1 * y1 + y1 * y2 + y2 * y2) / 12.0
            dx, dy = x2 - x1, y2 - y1
            chord = np.sqrt(dx * dx + dy * dy)
            if theta[i] > 0.0 and chord > 0.0:
                part, first, second = segment(chord, theta[i])
                nx, ny = dy / chord, -dx / chord
                mx, my = 0.5 * (x1 + x2), 0.5 * (y1 + y2)
                s += part
                sx += part * mx + first * nx
                sy += part * my + first * ny
                j += part * (mx * mx + my * my) + 2.0 * first * (mx * nx + my * ny) + second
        gx, gy = sx / s, sy / s
        area[k], cx[k], cy[k] = s, ox + gx, oy + gy
        polar[k] = j - s * (gx * gx + gy * gy)
    return area, cx, cy, polar

"""Wedges of sediment that prograde on a flat floor: closed forms of the height h(x, t), with a source.

Delta (Kenyon & Turcotte 1985, Geol. Soc. Am. Bull. 96, 1457): a river fills up to the level H behind a mouth that
advances at the velocity U, and the front diffuses, h_t = K h_xx. With the distance from the mouth, s = x - U t,

    h_t - U h_s = K h_ss,  h(0, t) = H,  h(s, 0) = 0.

The Laplace transform in time, h^ = H/p exp(-m s), gives K m^2 - U m - p = 0, m = (U + sqrt(U^2 + 4 K p)) / (2 K), and
its inverse is that of Ogata & Banks 1961 with the drift -U:

    h = H/2 [erfc((s + U t) / sqrt(4 K t)) + exp(-U s / K) erfc((s - U t) / sqrt(4 K t))].

For t much larger than K / U^2 the front has the constant form H exp(-U s / K). The area of the front has the transform
H / (p m) = H (sqrt(U^2 + 4 K p) - U) / (2 p^2); with T = U^2 t / (4 K)

    A = 2 H K / U [(T + 1/2) erf(sqrt(T)) + sqrt(T / pi) exp(-T) - T],

that is 2 H sqrt(K t / pi) at first (a mouth at rest) and H K / U at last. The river brings H U t + A.

Fan: the river brings the area q per time to x = 0, and the slope cannot exceed S. The deposit is a triangle,
q t = S x^2 / 2, hence its toe is at x = sqrt(2 q t / S) and its height is sqrt(2 q t S).
"""

from __future__ import annotations

import math

import numpy as np


def front(s: np.ndarray, t: float, level: float, speed: float, diffusion: float) -> np.ndarray:
    """Height [m] of the delta at distances s (n,) [m] from its mouth, H behind it."""
    wide, path = math.sqrt(4.0 * diffusion * t), speed * t

    def part(v: float) -> float:
        return math.erfc((v + path) / wide) + math.exp(-speed * v / diffusion) * math.erfc((v - path) / wide)

    return 0.5 * level * np.array([part(v) for v in np.maximum(s, 0.0).tolist()])


def front_area(t: float, level: float, speed: float, diffusion: float) -> float:
    """Area [m2] of the front at time t [s]."""
    big = speed**2 * t / (4.0 * diffusion)
    root = math.sqrt(big)
    inner = (big + 0.5) * math.erf(root) + root / math.sqrt(math.pi) * math.exp(-big) - big
    return 2.0 * level * diffusion / speed * inner


def toe(rate: float, t: float, slope: float) -> float:
    """Position [m] of the toe of the fan."""
    return math.sqrt(2.0 * rate * t / slope)

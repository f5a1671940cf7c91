"""Grain shapes as outlines of arcs, in a frame of their own at angle 0, about the centre of the circumscribed circle.

circle      two half circles
ellipse     four arcs after P. L. Rosin, "A note on the least squares fitting of ellipses" and later notes on four-arc
            ovals, as the manual of PPDEM's pre-processor quotes them, with the junction corrected (see `oval`)
polygons    three, four or five vertices on the circle, edges rounded
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.core.errors import CommandError
from hpcdem.numerics.rng import uniform
from hpcdem.physics.polyarc.moments import moments
from hpcdem.physics.polyarc.outlines import Outlines, uniform_outlines

SIDES = {"triangle": 3, "quadrilateral": 4, "pentagon": 5}
SHAPES = ("circle", "ellipse", *SIDES)
APPLIES = {
    "l_over_d": ("ellipse",), "size_rule": ("ellipse",), "deviation": tuple(SIDES), "roundness": tuple(SIDES),
}  # fmt: skip
"""Which shapes have these parameters. The manual lists an angle deviation and a roundness of ellipses too, without
saying what they are: their outline follows from the axes."""
SIZE_RULES = ("major", "minor", "area")
"""Which length of an ellipse is its size: the long axis, the short axis, or the diameter of the circle of its area."""
NARROWEST = 5.0
"""An edge of a polygon spans at least twice this angle [degrees] of the circle."""
LONGEST = 20.0
"""Largest L/D of an ellipse."""
DEVIATION, ANGLE = 11, 12
"""Streams of random numbers; see numerics/rng.py."""


def largest_deviation(sides: int) -> float:
    """Angle deviations [degrees] must stay below this."""
    return 180.0 / sides - NARROWEST


def check_shape(shape: str, l_over_d: float, size_rule: str, deviation: float, roundness: float) -> None:
    """CommandError unless there are grains of this shape."""
    if shape not in SHAPES:
        raise CommandError(f"shape '{shape}', expected one of {', '.join(SHAPES)}")
    if size_rule not in SIZE_RULES:
        raise CommandError(f"size rule '{size_rule}', expected one of {', '.join(SIZE_RULES)}")
    if shape == "ellipse" and not 1.0 <= l_over_d <= LONGEST:
        raise CommandError(f"L/D {l_over_d:g}, expected 1 to {LONGEST:g}")
    if shape in SIDES:
        limit = largest_deviation(SIDES[shape])
        if not 0.0 <= deviation < limit:
            raise CommandError(f"angle deviation {deviation:g}, expected 0 to below {limit:g} degrees for a {shape}")
        if not 0.0 <= roundness <= 1.0:
            raise CommandError(f"roundness {roundness:g}, expected 0 (straight edges) to 1 (a circle)")


def bodies(
    shape: str,
    size: np.ndarray,
    l_over_d: float = 1.0,
    size_rule: str = "major",
    deviation: float = 0.0,
    roundness: float = 0.0,
    seed: int = 0,
) -> tuple[Outlines, np.ndarray]:
    """Outlines of grains of these sizes [m] at angle 0 about their centres, and the radii (n,) f8 [m] of the circles
    about the centres that hold them. Grain k takes its random numbers by k, so it does not depend on the others."""
    check_shape(shape, l_over_d, size_rule, deviation, roundness)
    size = np.asarray(size, np.float64)
    if shape in SIDES:
        return polygons(SIDES[shape], size, deviation, roundness, seed), 0.5 * size
    a, b = half_axes(size, l_over_d if shape == "ellipse" else 1.0, size_rule)
    return oval(a, b), a


def half_axes(size: np.ndarray, l_over_d: float, size_rule: str) -> tuple[np.ndarray, np.ndarray]:
    """Half axes a >= b (n,) f8 [m] of four-arc ellipses of these sizes."""
    if l_over_d == 1.0:
        return 0.5 * size, 0.5 * size
    if size_rule == "major":
        a = 0.5 * size
    elif size_rule == "minor":
        a = 0.5 * size * l_over_d
    else:
        of_unit = float(moments(oval(np.ones(1), np.full(1, 1.0 / l_over_d)))[0][0])
        a = 0.5 * size * math.sqrt(math.pi / of_unit)
    return a, a / l_over_d


def oval(a: np.ndarray, b: np.ndarray) -> Outlines:
    """Four-arc ellipses of half axes a >= b (n,) f8 [m]; two half circles each if all a equal b.

    With Q = sqrt(a^2 + 6 a b + b^2): end arcs about (+-h, 0), h = (a - b)(a + b + Q) / (a - b + Q), of radius a - h;
    flat ones about (0, -+k), k = (a - b)(a + 3 b + Q) / (4 b), of radius b + k. The junction of the first quadrant is
    the point of the end arc in the direction in which both centres lie: (h, 0) + (a - h)(h, k) / sqrt(h^2 + k^2), and
    lies on the ellipse. (The manual prints a - b for a - h; that point lies on neither arc.)
    """
    if (a == b).all():
        zero = np.zeros_like(a)
        return uniform_outlines(np.stack([a, -a], 1), np.stack([zero, zero], 1), np.full((len(a), 2), math.pi))
    q = np.sqrt(a * a + 6.0 * a * b + b * b)
    h = (a - b) * (a + b + q) / (a - b + q)
    k = (a - b) * (a + 3.0 * b + q) / (4.0 * b)
    far = np.hypot(h, k)
    x, y = h + (a - h) * h / far, (a - h) * k / far
    flat, end = 2.0 * np.arctan2(h, k), 2.0 * np.arctan2(k, h)
    return uniform_outlines(
        np.stack([x, -x, -x, x], 1), np.stack([y, y, -y, -y], 1), np.stack([flat, end, flat, end], 1)
    )


def polygons(sides: int, size: np.ndarray, deviation: float, roundness: float, seed: int) -> Outlines:
    """Polygons with vertices on circles of these diameters [m] at 360 j / sides degrees, each off by up to
    `deviation` [degrees] at random. Over an edge that spans the angle alpha of the circle stands an arc of central
    angle roundness x alpha: a straight edge for 0, the circle itself for 1."""
    n = len(size)
    off = (2.0 * numbers(seed, DEVIATION, n * sides) - 1.0).reshape(n, sides)
    at = 2.0 * math.pi * np.arange(sides) / sides + math.radians(deviation) * off
    alpha = np.diff(at, axis=1, append=at[:, :1] + 2.0 * math.pi)
    r = 0.5 * size[:, None]
    return uniform_outlines(r * np.cos(at), r * np.sin(at), roundness * alpha)


@njit(cache=True, nogil=True, error_model="numpy")
def numbers(seed, stream, n):
    """(n,) f8: the first uniform numbers of a stream, in [0, 1)."""
    out = np.empty(n)
    for k in range(n):
        out[k] = uniform(seed, stream, k)
    return out

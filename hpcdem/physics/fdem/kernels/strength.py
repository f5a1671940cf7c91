"""Strength that follows tables of plastic strain: elements that soften or harden as they flow.

Cohesion, friction and dilation follow k_s, tensile strength follows k_t, each triangle (of a quad too) for itself:

    k_s = sum sqrt(e : e / 2) of the deviator of the plastic strain of flow in shear,   k_t = sum of l_t

(l: multipliers of plasticity.py; both as in FLAC's softening model). Where a triangle flows in shear and in tension in
one step, the multipliers follow from the principal plastic strains: dilation and tension only lengthen, so l_s = -sum
of those below zero, l_t = volume - (N_psi - 1) l_s, and k_s grows by l_s sqrt((1 + N_psi + N_psi^2) / 3), as on the
plane f_s. What flows in a step flows with the strength before it; the new one holds from the next forces on. At rest
the stress is on the surface of the strength that belongs to its k.

A triangle with such a table has a row of its own in the table of yield surfaces, behind those of the models.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

HISTORY = 2
"""Columns of what a triangle remembers besides (n, 2), or (n, 8) where there are quads: k_s, k_t."""
COHESION, FRICTION, DILATION, TENSILE = range(4)
SHEAR_NOW, TENSION_NOW = 1, 2
"""Bits of the flow of a step, see plasticity.py."""
DEGREE = math.pi / 180.0


class Strength(NamedTuple):
    """Tables of strengths for kernels: first own row of the table of yield surfaces; of (own rows,): the row of the
    model; values (own rows, 4): cohesion, friction, dilation [degrees], tensile strength before any flow; number (rows,
    4): of their tables, from 1 on, 0: none; begin (tables + 1,), points (m, 2): the tables, one behind the other;
    history (n_own, 2 or 8), see `HISTORY`."""

    first: int
    of: np.ndarray
    values: np.ndarray
    number: np.ndarray
    begin: np.ndarray
    points: np.ndarray
    history: np.ndarray


@njit(cache=True, error_model="numpy")
def _at(strain, number, otherwise, begin, points):
    """Value of a table, or `otherwise` without a table; it is constant beyond its ends."""
    if number == 0:
        return otherwise
    k, end = begin[number - 1], begin[number] - 1
    if strain <= points[k, 0]:
        return points[k, 1]
    while k < end and points[k + 1, 0] < strain:
        k += 1
    if k == end:
        return points[k, 1]
    part = (strain - points[k, 0]) / (points[k + 1, 0] - points[k, 0])
    return points[k, 1] + part * (points[k + 1, 1] - points[k, 1])


@njit(cache=True, error_model="numpy")
def renew(row, history, strength, table):
    """The row of a part of an element in the table of yield surfaces (rows, 4) as it is after its flow; history (2,):
    of this part."""
    of = strength.of[row - strength.first]
    shear, tension = history[0], history[1]
    values, number, begin, points = strength.values, strength.number, strength.begin, strength.points
    own = row - strength.first
    cohesion = _at(shear, number[of, COHESION], values[own, COHESION], begin, points)
    friction = DEGREE * _at(shear, number[of, FRICTION], values[own, FRICTION], begin, points)
    dilation = DEGREE * _at(shear, number[of, DILATION], values[own, DILATION], begin, points)
    tensile = _at(tension, number[of, TENSILE], values[own, TENSILE], begin, points)
    root = math.tan(0.25 * math.pi + 0.5 * friction)
    table[row, 0], table[row, 1] = root * root, math.tan(0.25 * math.pi + 0.5 * dilation) ** 2
    table[row, 2] = 2.0 * cohesion * root
    table[row, 3] = min(tensile, cohesion / math.tan(friction)) if friction > 0.0 else tensile


@njit(cache=True, error_model="numpy")
def flowed(row, history, bits, e11, e22, e12, e33, shear, volume, strength, table):
    """A part has flowed by this plastic strain, `shear` and `volume` of it: its strength afterwards."""
    shortened = 0.0
    if bits != SHEAR_NOW and bits != TENSION_NOW:
        mean, half = 0.5 * (e11 + e22), 0.5 * (e11 - e22)
        radius = math.sqrt(half * half + e12 * e12)
        low, high = mean - radius, mean + radius
        shortened = -(min(low, 0.0) + min(high, 0.0) + min(e33, 0.0))
    grown(row, history, bits, shear, volume, shortened, strength, table)


@njit(cache=True, error_model="numpy")
def grown(row, history, bits, shear, volume, shortened, strength, table):
    """Return the strength after flow by a plastic strain from its `shear` and `volume` and, where it flowed in both
    ways, what its negative principal values sum up to, without sign."""
    if bits == SHEAR_NOW:
        tension = 0.0
    elif bits == TENSION_NOW:
        shear, tension = 0.0, volume
    else:
        m = table[row, 1]
        l_s = shortened
        shear, tension = l_s * math.sqrt((1.0 + m + m * m) / 3.0), max(volume - (m - 1.0) * l_s, 0.0)
    history[0] += shear
    history[1] += tension
    renew(row, history, strength, table)

"""The laws of the blocks: scalars in, scalars out, one formula each.

Tension is positive. A joint's opening o is positive when it opens; both o and the slip s are the other side minus this
one, in the frame of this side (normal outward, tangent along the counter-clockwise edge). Seen from the other side o
and s are the same two numbers, bit for bit, because all differences and directions change sign together.

Sources: Munjiza 2004 (combined finite-discrete element method: potential contact, joint softening), Lei et al. 2016
and Lisjak & Grasselli 2014 (intrinsic cohesive zone with friction), Cundall 1987 (local damping).
"""

from __future__ import annotations

import math

from numba import njit

TINY = 1e-300


@njit(cache=True, error_model="numpy")
def rotation(f11, f12, f21, f22):
    """Cosine and sine of the rotation R of F = R U in the plane."""
    p, q = f11 + f22, f21 - f12
    inverse = 1.0 / math.sqrt(p * p + q * q)
    return p * inverse, q * inverse


@njit(cache=True, error_model="numpy")
def stretch(f11, f12, f21, f22, cs, sn):
    """Strain U - 1 = R^T F - 1 (11, 22, 12); its 12 and 21 are equal but for rounding."""
    e12 = 0.5 * ((cs * f12 + sn * f22) + (cs * f21 - sn * f11))
    return cs * f11 + sn * f21 - 1.0, cs * f22 - sn * f12 - 1.0, e12


@njit(cache=True, error_model="numpy")
def turned(s11, s22, s12, cs, sn):
    """R S R^T for a symmetric S: xx, yy, xy."""
    cc, ss, both = cs * cs, sn * sn, cs * sn
    return (
        cc * s11 - 2.0 * both * s12 + ss * s22,
        ss * s11 + 2.0 * both * s12 + cc * s22,
        both * (s11 - s22) + (cc - ss) * s12,
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def hooke(e11, e22, e12, e33, lame, two_mu, free):
    """Stress 11, 22, 12, 33 [Pa] of a strain; free: 1 where the strain 33 is free (plane stress: 33 is 0), else 0."""
    e33 = e33 - free * e33
    p = lame * (e11 + e22 + e33)
    return p + two_mu * e11, p + two_mu * e22, two_mu * e12, (p - free * p) + two_mu * e33


@njit(cache=True, error_model="numpy")
def damped(f, v, alpha):
    """Force with local damping: F - alpha |F| sgn(v)."""
    drag = alpha * abs(f)
    return f - (drag if v > 0.0 else (-drag if v < 0.0 else 0.0))


@njit(cache=True, error_model="numpy")
def outside(s11, s22, s12, s33, n_phi, strength, tensile):
    """Return by how much [Pa] a stress is outside the yield surface of plasticity.py, below zero: inside; the larger of
    shear and tension."""
    mean, half = 0.5 * (s11 + s22), 0.5 * (s11 - s22)
    radius = math.sqrt(half * half + s12 * s12)
    high, low = mean + radius, mean - radius
    high, low = (s33 if s33 > high else high), (s33 if s33 < low else low)
    shear, tension = n_phi * high - low - strength, high - tensile
    return shear if shear > tension else tension

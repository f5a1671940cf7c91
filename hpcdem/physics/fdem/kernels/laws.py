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

A, B, C = 0.63, 1.8, 6.0
"""Shape of the softening curve (Munjiza 2004, fitted to concrete of Evans & Marathe 1968)."""
RISE, FALL = A + C * B, (A + B) * (1.0 - A - B)
SOFTENING_AREA = 0.386307294743943
"""Integral of `softening` from 0 to 1: G_f = SOFTENING_AREA * strength * critical opening."""
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


@njit(cache=True, error_model="numpy")
def softening(d):
    """Strength that is left, over the full one, at damage d from 0 to 1 (C = 6 as two factors)."""
    return softening_curve(d, math.exp(d * RISE / FALL))


@njit(cache=True, error_model="numpy")
def softening_curve(d, e):
    """The same, where e is exp(d RISE / FALL)."""
    rest = 1.0 - d
    cube = rest * rest * rest
    left = max((1.0 - (A + B - 1.0) / (A + B) * e) * (A * rest + B * (cube * cube)), 0.0)
    left = 0.0 if d >= 1.0 else left
    return 1.0 if d <= 0.0 else left


@njit(cache=True, error_model="numpy")
def intact_point(o, s, kop, tensile, overlay, tan_phi, cohesion, half_shear):
    """Normal and shear stress of a joint point before its peak; o, s: opening and slip over the length of the joint.

    sigma = P_overlay o, o < 0;  T (2 r - r^2), r = o / o_p = o P_open / (2 T), o >= 0
    tau = tau_lim (2 q - q^2) sign(s), q = |s| / s_p, s_p = 2 tau_p / P_shear, tau_p = c + max(-sigma, 0) tan(phi),
    tau_lim = max(0, c - sigma tan(phi))

    kop = P_open / (2 T) (0 if T = 0), half_shear = P_shear / 2. The third number is how much is left to the peak,
    1 - max(r, q): negative behind it.
    """
    r = o * kop
    sigma = overlay * o if o < 0.0 else tensile * (r * (2.0 - r))
    bare = cohesion - sigma * tan_phi
    limit = bare if bare > 0.0 else 0.0
    peak = limit if sigma < 0.0 else cohesion
    q = abs(s) * half_shear / (peak if peak > TINY else TINY)
    tau = limit * (q * (2.0 - q))
    left = 1.0 - (q if q > r else r)
    return sigma, tau if s > 0.0 else -tau, left


@njit(cache=True, error_model="numpy")
def damaged_point(
    o, s, h, per_h, kop, tensile, overlay, tan_phi, cohesion, per_o_t, per_s_t, per_kop, per_half_shear, o_u, s_u,
    damage,
):  # fmt: skip
    """The first half of `yielded_point`: what the point remembers now (o_u, s_u, damage), and the squares of both
    parts of D as they are now."""
    opened = (tensile > 0.0) & (o * per_h * kop > 1.0)
    first = (o - h * per_kop) * per_o_t if opened else 0.0
    o_u = max(o_u, o) if opened else o_u
    size = abs(s)
    s_p = slip_at_peak(o, h, per_h, overlay, tan_phi, cohesion, per_half_shear)
    slid = size > s_p
    second = (size - s_p) * per_s_t if slid else 0.0
    s_u = max(s_u, size) if slid else s_u
    d2 = first * first + second * second
    damage = min(1.0, math.sqrt(d2)) if d2 > damage * damage else damage
    return o_u, s_u, damage, first * first, second * second


@njit(cache=True, error_model="numpy")
def slip_at_peak(o, h, per_h, overlay, tan_phi, cohesion, per_half_shear):
    """s_p [m] of `yielded_point`."""
    pressed = overlay * (o * per_h) if o < 0.0 else 0.0
    return h * (cohesion - pressed * tan_phi) * per_half_shear


@njit(cache=True, error_model="numpy")
def softened_point(
    o, s, h, per_h, kop, tensile, overlay, tan_phi, cohesion, per_half_shear, o_u, s_u, left
):  # fmt: skip
    """The second half of `yielded_point`: sigma and tau, where `left` of the strength is left."""
    strain = o * per_h
    r = strain * kop
    share = (o / o_u if o < o_u else 1.0) if o_u > 0.0 else r * (2.0 - r)
    sigma = overlay * strain if o < 0.0 else left * tensile * share
    limit = max(0.0, left * cohesion - sigma * tan_phi)
    size = abs(s)
    q = size / max(slip_at_peak(o, h, per_h, overlay, tan_phi, cohesion, per_half_shear), TINY)
    share = (size / s_u if size < s_u else 1.0) if s_u > 0.0 else q * (2.0 - q)
    return sigma, math.copysign(limit * share, s)


@njit(cache=True, error_model="numpy")
def yielded_point(
    o, s, h, per_h, kop, tensile, overlay, tan_phi, cohesion, per_o_t, per_s_t, per_kop, per_half_shear, o_u, s_u,
    damage,
):  # fmt: skip
    """The same for a joint that has passed its peak somewhere, with what the point remembers.

    o, s, h: opening, slip, length of the joint [m]; o_t, s_t: openings beyond the peak at which nothing is left [m]
    (per_...: one over it; per_o_t, per_s_t: 0 where there is nothing to lose); o_u, s_u: largest o and |s| beyond the
    peak (0: never); damage D, never falls:

    D = min(1, sqrt((<o - o_p> / o_t)^2 + (<|s| - s_p> / s_t)^2)), strengths T and c are multiplied by f(D).
    Below o_u (s_u) unloading and reloading follow the line through the origin.

    Returns sigma, tau, o_u, s_u, damage, and the squares of both parts of D as they are now. (In two halves without
    jumps: softening.py has them as loops over joints, with the exponential of f between them.)
    """
    o_u, s_u, damage, first2, second2 = damaged_point(
        o, s, h, per_h, kop, tensile, overlay, tan_phi, cohesion, per_o_t, per_s_t, per_kop, per_half_shear, o_u, s_u,
        damage,
    )  # fmt: skip
    sigma, tau = softened_point(
        o, s, h, per_h, kop, tensile, overlay, tan_phi, cohesion, per_half_shear, o_u, s_u, softening(damage)
    )
    return sigma, tau, o_u, s_u, damage, first2, second2


@njit(cache=True, error_model="numpy")
def damped(f, v, alpha):
    """Force with local damping: F - alpha |F| sgn(v)."""
    drag = alpha * abs(f)
    return f - (drag if v > 0.0 else (-drag if v < 0.0 else 0.0))


@njit(cache=True, error_model="numpy")
def outside(s11, s22, s12, s33, n_phi, strength, tensile):
    """By how much [Pa] a stress is outside the yield surface of plasticity.py, below zero: inside; the larger of shear
    and tension."""
    mean, half = 0.5 * (s11 + s22), 0.5 * (s11 - s22)
    radius = math.sqrt(half * half + s12 * s12)
    high, low = mean + radius, mean - radius
    high, low = (s33 if s33 > high else high), (s33 if s33 < low else low)
    shear, tension = n_phi * high - low - strength, high - tensile
    return shear if shear > tension else tension

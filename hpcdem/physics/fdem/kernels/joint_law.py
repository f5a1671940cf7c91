"""Laws of joints: what the two sides of a point do to each other. Scalars in, scalars out; nothing else of hpcdem knows
these formulas. An edge of the plane, a triangle of space and half a side of a hexahedron only say where they are
evaluated (joints.py, joints_space.py, joints_hexes.py), their loops when (elements.py, softening.py), the static solve
and the account of energy ask here for slopes and for what is stored.

The opening o is positive when it opens, tension is positive; the slip s is signed in the plane, in space its size. h is
the length of the joint: of an edge its own, of a face the root of its area.

Beside the cohesive law, whose joints break, there are laws of joints that were there before and that slide: `slide`.
There s is the slip less the part that stays when the joint is unloaded; sigma and tau follow from o and s by
stiffnesses per area, whatever the length of the joint.

    Coulomb:  sigma = k_n (o - d), tau = k_s s, |tau| <= c - sigma tan(phi), d = tan(psi) path up to a limit of the path
    Barton-Bandis:  sigma = -k_ni v / (1 - v / V_m), v = d - o > 0; beyond v_c, where -sigma = JCS, along the tangent;
        |tau| <= -sigma tan(phi_m), phi_m = phi_r + m i, i = JRC log10(JCS / -sigma), at most 70 degrees
        d grows by tan(D m i), m > 0, D: a half
        m from path / peak: (0.3, 0), (0.6, 0.75), (1, 1), (2, 0.85), (4, 0.7), (10, 0.5), (25, 0.4), (100, 0);
        below 0.3, where it would be negative, phi_m grows with the path from nothing to phi_r (m = -phi_r / i at 0)

path: slip path, without its elastic part; d: opening by dilation. An open joint has neither stress.

Sources: Munjiza 2004 (softening), Lei et al. 2016 and Lisjak & Grasselli 2014 (intrinsic cohesive zone with friction);
Barton & Choubey 1977 (strength), Bandis et al. 1983 (closure), Barton et al. 1985 (mobilised JRC, dilation).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels.laws import TINY

# Columns of the table of joint laws (rows, 8), for joints before their peak (intact_point), and of the table (rows, 4)
# of what else they need behind it: one over o_t, s_t, kop and half the shear penalty.
KOP, TENSILE, OVERLAY, TAN_PHI, COHESION, HALF_SHEAR = range(6)
PER_O_T, PER_S_T, PER_KOP, PER_HALF_SHEAR = range(4)

# History of a joint past its peak, per Gauss point from a to b: largest opening and slip, damage; then how it
# broke (0: it has not), at which step, and the kinetic energy of the element at that moment; and step and kinetic
# energy when it passed its peak.
OPENED, SLIPPED, DAMAGE, MODE, STEP, KINETIC, PEAK_STEP, PEAK_KINETIC = 0, 3, 6, 9, 10, 11, 12, 13
HISTORY = 14
# What a joint that slides remembers: along both ways of its frame the part of the slip that stays (in the plane along
# its tangent [m], in space parts of the mid-edges), what its law makes of the third, and the path [m].
STAYS, STAYS_TOO, OWN, PATH = 0, 3, 6, 9

LAW = 6
"""Column of the table (rows, 8): number of the law."""
COHESIVE, COULOMB, BARTON_BANDIS = range(3)
K_N, K_S = 0, 1
TAN_FRICTION, HOLDS, TEARS, TAN_DILATION, DILATES_UP_TO = 2, 3, 4, 5, 7
"""Of Coulomb's law, behind the stiffnesses [Pa/m]: cohesion, tensile strength [Pa], path [m]. OWN: 1 where it is torn,
which leaves neither of both."""
RESIDUAL, JRC, JCS, PART, V_M = 2, 3, 4, 5, 7
PEAK, V_C, SLOPE_C = range(3)
"""Of Barton-Bandis, the second row in the other table: angle [degrees], part of the angle that dilates, closure [m];
path at the peak, closure [m] and slope [Pa/m] at JCS. OWN: opening by dilation [m]."""
MOBILISED = ((0.3, 0.0), (0.6, 0.75), (1.0, 1.0), (2.0, 0.85), (4.0, 0.7), (10.0, 0.5), (25.0, 0.4), (100.0, 0.0))
STEEPEST = 70.0
PIECE, MOST = 1.0 / 64.0, 4096
"""Of the path to the peak that slides at once at most; into how many parts slip is cut at most."""
DEGREE = math.pi / 180.0

A, B, C = 0.63, 1.8, 6.0
"""Shape of the softening curve (Munjiza 2004, fitted to concrete of Evans & Marathe 1968)."""
RISE, FALL = A + C * B, (A + B) * (1.0 - A - B)
SOFTENING_AREA = 0.386307294743943
"""Integral of `softening` from 0 to 1: G_f = SOFTENING_AREA * strength * critical opening."""
LEAST = 1e-3
"""Part of the slope at the origin that a joint point keeps in the tangent near and beyond its peak."""
FLAT = 1e-12
"""Opening and slip over the length of a joint that are rounding."""


PENALTIES = ("penalty_normal", "penalty_overlay", "penalty_shear")


def tables(column: Callable[[str], np.ndarray], of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The tables (n, 8) and (n, 4) from properties (n,) and the numbers of laws (n,); rows of zeros are no joints."""
    tensile, cohesion, gf1, gf2 = (column(name) for name in ("tensile_strength", "cohesion", "gf1", "gf2"))
    opening, overlay, shear = (column(name) for name in PENALTIES)
    law, beyond = np.zeros((len(tensile), 8)), np.zeros((len(tensile), 4))
    with np.errstate(divide="ignore", invalid="ignore"):
        law[:, KOP] = np.where(tensile > 0.0, opening / (2.0 * tensile), 0.0)
        beyond[:, PER_KOP] = np.where(tensile > 0.0, 2.0 * tensile / opening, 0.0)
        beyond[:, PER_O_T] = np.where(tensile > 0.0, SOFTENING_AREA * tensile / gf1, 0.0)
        beyond[:, PER_S_T] = np.where(cohesion > 0.0, SOFTENING_AREA * cohesion / gf2, 0.0)
        beyond[:, PER_HALF_SHEAR] = np.where(shear > 0.0, 2.0 / shear, 0.0)
    law[:, TENSILE], law[:, OVERLAY], law[:, COHESION] = tensile, overlay, cohesion
    law[:, TAN_PHI] = np.tan(np.radians(column("friction")))
    law[:, HALF_SHEAR] = 0.5 * shear
    if not of.any():
        return law, beyond
    normal, along, friction = (column(name) for name in ("normal_stiffness", "shear_stiffness", "friction"))
    own = np.zeros(law.shape)
    own[:, K_N], own[:, K_S], own[:, LAW] = normal, along, of
    own[:, TAN_FRICTION], own[:, HOLDS], own[:, TEARS] = np.tan(np.radians(friction)), cohesion, tensile
    own[:, TAN_DILATION], own[:, DILATES_UP_TO] = np.tan(np.radians(column("dilation"))), column("dilation_limit")
    law = np.where((of == COULOMB)[:, None], own, law)
    jrc, jcs, closure, size = (column(name) for name in ("jrc", "jcs", "closure_maximum", "joint_size"))
    own[:, RESIDUAL], own[:, JRC], own[:, JCS], own[:, V_M] = friction, jrc, jcs, closure
    own[:, PART] = column("dilation_part")
    law = np.where((of == BARTON_BANDIS)[:, None], own, law)
    with np.errstate(divide="ignore", invalid="ignore"):
        crushed = jcs * closure / (normal * closure + jcs)
        peak = size / 500.0 * (jrc / size) ** 0.33
        own = np.column_stack([peak, crushed, normal / (1.0 - crushed / closure) ** 2, 0.0 * peak])
    return law, np.where((of > COHESIVE)[:, None], 0.0, beyond) + np.where((of == BARTON_BANDIS)[:, None], own, 0.0)


def stiffest(
    column: Callable[[str], np.ndarray], of: np.ndarray, row: np.ndarray, h: Callable[[], np.ndarray]
) -> np.ndarray:
    """Return the largest penalty of joints with these rows [Pa]: no slope of a stress over o / h or s / h is above it.

    h: lengths [m], or one, if some law asks."""
    found = np.max([column(name) for name in PENALTIES], axis=0)[row]
    if not of.any():
        return found
    law, beyond = tables(column, of)
    steepest = np.maximum(np.maximum(law[:, K_N], law[:, K_S]), beyond[:, SLOPE_C])
    return np.where(of[row] > COHESIVE, steepest[row] * h(), found)


def ways(strength: np.ndarray, penalty: np.ndarray, energy: np.ndarray, h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Opening or slip up to the peak, and from there until nothing is left [m]."""
    return 2.0 * h * strength / penalty, energy / (SOFTENING_AREA * strength)


@njit(cache=True, error_model="numpy")
def growth(d):
    """The exponential of the softening curve."""
    return math.exp(d * RISE / FALL)


@njit(cache=True, error_model="numpy")
def softening(d):
    """Strength that is left, over the full one, at damage d from 0 to 1 (C = 6 as two factors)."""
    return softening_curve(d, growth(d))


@njit(cache=True, error_model="numpy")
def softening_curve(d, e):
    """Return the strength that is left, as `softening`, for e = exp(d RISE / FALL)."""
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
    """Evaluate a point of a joint that has passed its peak somewhere, with the history of the point.

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
def intact_slopes(o, s, law):
    """Derivatives of `intact_point` by its row: sigma by o, tau by o, tau by s, how much is left to the peak, and tau.
    What has no strength and lies flat is closed and sticks: which way it moves rounding would say."""
    kop, tensile, overlay, tan_phi = law[KOP], law[TENSILE], law[OVERLAY], law[TAN_PHI]
    cohesion, half_shear = law[COHESION], law[HALF_SHEAR]
    sigma, tau, left = intact_point(o, s, kop, tensile, overlay, tan_phi, cohesion, half_shear)
    r = o * kop
    flat = abs(o) <= FLAT and abs(s) <= FLAT
    normal = overlay if o < 0.0 or (flat and tensile == 0.0) else 2.0 * tensile * kop * max(1.0 - r, LEAST)
    if flat and cohesion == 0.0:
        return normal, 0.0, 2.0 * half_shear if tan_phi > 0.0 else 0.0, 1.0, tau
    limit = max(cohesion - sigma * tan_phi, 0.0)
    peak = max(limit if sigma < 0.0 else cohesion, TINY)
    q = abs(s) * half_shear / peak
    shear = limit * half_shear / peak * 2.0 * max(1.0 - q, LEAST)
    skew = 0.0
    if q < 1.0 and limit > 0.0:
        skew = -tan_phi * (q * q if sigma < 0.0 else q * (2.0 - q)) * (1.0 if s > 0.0 else -1.0)
    return normal, skew * normal, shear, left, tau


@njit(cache=True, error_model="numpy")
def softening_slope(d):
    """Derivative of softening by the damage d, 0 beyond its ends."""
    if d <= 0.0 or d >= 1.0:
        return 0.0
    k, power, rest = (A + B - 1.0) / (A + B), RISE / FALL, 1.0 - d
    e = math.exp(d * power)
    fifth = rest**5
    return -k * power * e * (A * rest + B * fifth * rest) - (1.0 - k * e) * (A + 6.0 * B * fifth)


@njit(cache=True, error_model="numpy")
def yielded_slopes(
    o, s, h, kop, tensile, overlay, tan_phi, cohesion, per_o_t, per_s_t, per_kop, per_half_shear, o_u, s_u, damage
):
    """Derivatives [Pa/m] of sigma and tau of yielded_point by o and s: sigma by o, by s, tau by o, by s."""
    per_h, size, sign = 1.0 / h, abs(s), 1.0 if s >= 0.0 else -1.0
    now_o, now_s, now_d, _, _ = damaged_point(
        o, s, h, per_h, kop, tensile, overlay, tan_phi, cohesion, per_o_t, per_s_t, per_kop, per_half_shear, o_u, s_u,
        damage,
    )  # fmt: skip
    s_p = slip_at_peak(o, h, per_h, overlay, tan_phi, cohesion, per_half_shear)
    rise = -overlay * tan_phi * per_half_shear if o < 0.0 else 0.0  # of s_p by o
    d_o = d_s = 0.0
    if now_d > damage and now_d < 1.0:
        first = max(o - h * per_kop, 0.0) * per_o_t if tensile > 0.0 else 0.0
        second = max(size - s_p, 0.0) * per_s_t
        d_o = (first * per_o_t - second * per_s_t * rise) / now_d
        d_s = second * per_s_t * sign / now_d
    f, fall = softening(now_d), softening_slope(now_d)
    r = o * per_h * kop
    sigma, _ = softened_point(o, s, h, per_h, kop, tensile, overlay, tan_phi, cohesion, per_half_shear, now_o, now_s, f)
    if o < 0.0:
        sigma_o, sigma_s = overlay * per_h, 0.0
    else:
        if now_o > 0.0:
            share, slope = (o / now_o, 1.0 / now_o) if o < now_o else (1.0, 0.0)
        else:
            share, slope = r * (2.0 - r), 2.0 * (1.0 - r) * kop * per_h
        sigma_o, sigma_s = tensile * (fall * d_o * share + f * slope), tensile * fall * d_s * share
    limit = f * cohesion - sigma * tan_phi
    limit_o, limit_s = cohesion * fall * d_o - tan_phi * sigma_o, cohesion * fall * d_s - tan_phi * sigma_s
    if limit <= 0.0:
        limit = limit_o = limit_s = 0.0
    share_o = 0.0
    if now_s > 0.0:
        share, share_s = (size / now_s, 1.0 / now_s) if size < now_s else (1.0, 0.0)
    else:
        q, per = size / max(s_p, TINY), 1.0 / max(s_p, TINY)
        share, share_s, share_o = q * (2.0 - q), 2.0 * (1.0 - q) * per, -2.0 * (1.0 - q) * q * per * rise
    return (
        sigma_o, sigma_s, sign * (limit_o * share + limit * share_o), sign * limit_s * share + limit * share_s,
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def point(o, s, h, law, beyond, history, g):
    """`yielded_point` at Gauss point g of a joint in any state, by the rows of the tables and what it remembers (14,),
    which stays as it is."""
    return yielded_point(
        o, s, h, 1.0 / h, law[KOP], law[TENSILE], law[OVERLAY], law[TAN_PHI], law[COHESION], beyond[PER_O_T],
        beyond[PER_S_T], beyond[PER_KOP], beyond[PER_HALF_SHEAR], history[OPENED + g], history[SLIPPED + g],
        history[DAMAGE + g],
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def slopes(o, s, h, law, beyond, history, g):
    """Derivatives [Pa/m] of sigma and tau of `point`: sigma by o, by s, tau by o, by s; and tau."""
    sigma_o, sigma_s, tau_o, tau_s = yielded_slopes(
        o, s, h, law[KOP], law[TENSILE], law[OVERLAY], law[TAN_PHI], law[COHESION], beyond[PER_O_T], beyond[PER_S_T],
        beyond[PER_KOP], beyond[PER_HALF_SHEAR], history[OPENED + g], history[SLIPPED + g], history[DAMAGE + g],
    )  # fmt: skip
    _, tau, _, _, _, _, _ = point(o, s, h, law, beyond, history, g)
    return sigma_o, sigma_s, tau_o, tau_s, tau


@njit(cache=True, nogil=True, error_model="numpy")
def stored(o, s, h, law, beyond, history, g):
    """Energy per area [J/m2] that a point of a joint gives back when it is unloaded."""
    sigma, tau, o_u, s_u, damage, _, _ = point(o, s, h, law, beyond, history, g)
    size = abs(s)
    if o < 0.0 or o_u > 0.0:
        normal = 0.5 * sigma * o
    elif law[KOP] > 0.0:
        o_p = h / law[KOP]
        r = o / o_p
        normal = softening(damage) * law[TENSILE] * o_p * (r * r - r * r * r / 3.0)
    else:
        normal = 0.0
    if s_u > 0.0 or size == 0.0 or tau == 0.0:
        return normal + 0.5 * tau * s
    # tau = limit (2 q - q^2), q = s / s_p: int tau ds = limit s_p (q^2 - q^3 / 3)
    peak = law[COHESION] - (sigma * law[TAN_PHI] if o < 0.0 else 0.0)
    s_p = h * peak / law[HALF_SHEAR]
    q = size / s_p
    limit = abs(tau) / (q * (2.0 - q))
    return normal + limit * s_p * (q * q - q * q * q / 3.0)


@njit(cache=True, nogil=True, error_model="numpy")
def breaks(history, first2, second2):
    """Return whether a joint has no strength left at two of its three points; then it has none, and a mode. first2,
    second2: largest squares of both parts of the damage."""
    gone = 0
    for g in range(3):
        gone += history[DAMAGE + g] >= 1.0
    if gone < 2:
        return False
    both = first2 + second2
    history[MODE] = 1.0 + (second2 / both if both > 0.0 else 0.0)
    for g in range(3):
        history[DAMAGE + g] = 1.0
    return True


# ---- joints that slide ---------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def slide(o, s, law, beyond, own, path):
    """Normal stress and size of the shear stress [Pa] at a point whose other side is o away and, but for what stays,
    has slipped by s >= 0 [m]; how much more of the slip stays, and OWN and PATH from now on."""
    if law[LAW] == COULOMB:
        return _coulomb(o, s, law, own, path)
    return _barton_bandis(o, s, law, beyond, own, path)


@njit(cache=True, nogil=True, error_model="numpy")
def slide_slopes(o, s, law, beyond, own, path):
    """Derivatives [Pa/m] of sigma and tau of `slide`: sigma by o, by s, tau by o, by s; and tau."""
    _, tau, more, now, _ = slide(o, s, law, beyond, own, path)
    if law[LAW] == COULOMB:
        a, b, c, d = _coulomb_slopes(o, more, law, now, path)
    else:
        a, b, c, d = _barton_bandis_slopes(o, s, law, beyond, own, path)
    return a, b, c, d + LEAST * law[K_S], tau


@njit(cache=True, nogil=True, error_model="numpy")
def slide_stored(o, s, law, beyond, own, path):
    """Energy per area [J/m2] that the point gives back."""
    sigma, tau, _, own, _ = slide(o, s, law, beyond, own, path)
    if law[LAW] == COULOMB:
        normal = 0.5 * sigma * sigma / law[K_N]
    else:
        v = min(max(own - o, 0.0), beyond[V_C])
        part, more = v / law[V_M], max(own - o - v, 0.0)
        normal = -law[K_N] * law[V_M] * law[V_M] * (part + math.log1p(-part))
        normal += more * (law[K_N] * v / (1.0 - part) + 0.5 * beyond[SLOPE_C] * more)
    return normal + 0.5 * tau * tau / law[K_S]


@njit(cache=True, nogil=True, error_model="numpy")
def _coulomb(o, s, law, torn, path):
    e = o - law[TAN_DILATION] * min(path, law[DILATES_UP_TO])
    sigma = law[K_N] * e
    if law[TEARS] > 0.0 and sigma > law[TEARS]:
        torn = 1.0
    holds, tears = (0.0, 0.0) if torn > 0.0 else (law[HOLDS], law[TEARS])
    if sigma > tears:
        return 0.0, 0.0, s, torn, path
    tau, limit = law[K_S] * s, max(holds - sigma * law[TAN_FRICTION], 0.0)
    if tau <= limit:
        return sigma, tau, 0.0, torn, path
    more = 0.0
    if law[TAN_DILATION] > 0.0 and path < law[DILATES_UP_TO]:
        rise = law[K_N] * law[TAN_DILATION]
        more = min((tau - limit) / (law[K_S] + rise * law[TAN_FRICTION]), law[DILATES_UP_TO] - path)
        sigma -= rise * more
        limit = max(holds - sigma * law[TAN_FRICTION], 0.0)
    more = max(more, s - limit / law[K_S])
    return sigma, limit, more, torn, path + more


@njit(cache=True, nogil=True, error_model="numpy")
def _coulomb_slopes(o, more, law, torn, path):
    """Return the slopes of Coulomb's law from the present slip and whether the point is torn."""
    dilates = law[TAN_DILATION] > 0.0 and path < law[DILATES_UP_TO]
    sigma = law[K_N] * (o - law[TAN_DILATION] * min(path, law[DILATES_UP_TO]))
    if sigma > (0.0 if torn > 0.0 else law[TEARS]):
        return LEAST * LEAST * law[K_N], 0.0, 0.0, 0.0
    if more == 0.0:
        return law[K_N], 0.0, 0.0, law[K_S]
    holds = 0.0 if torn > 0.0 else law[HOLDS]
    if holds - sigma * law[TAN_FRICTION] <= 0.0:
        return law[K_N], 0.0, 0.0, 0.0
    rise = law[K_N] * law[TAN_DILATION] if dilates and path + more < law[DILATES_UP_TO] else 0.0
    whole = law[K_S] + rise * law[TAN_FRICTION]
    by_o, by_s = law[K_N] * law[TAN_FRICTION] / whole, law[K_S] / whole
    sigma_o, sigma_s = law[K_N] - rise * by_o, -rise * by_s
    return sigma_o, sigma_s, -law[TAN_FRICTION] * sigma_o, -law[TAN_FRICTION] * sigma_s


@njit(cache=True, nogil=True, error_model="numpy")
def _pressure(v, law, beyond):
    """-sigma [Pa] at a closure, and its slope [Pa/m]."""
    at = min(max(v, 0.0), beyond[V_C])
    rest = 1.0 - at / law[V_M]
    slope = law[K_N] / (rest * rest)
    return law[K_N] * at / rest + (slope * (v - at) if v > at else 0.0), slope if v > 0.0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _mobilised(path, pressure, law, beyond):
    """Friction angle that is mobilised, and the part of it that is roughness, m i [degrees]."""
    mobilised = path / max(beyond[PEAK], TINY)
    if mobilised < 0.3:
        return law[RESIDUAL] * mobilised / 0.3, 0.0
    rough = max(law[JRC] * math.log10(law[JCS] / max(pressure, TINY)), 0.0)
    share = 0.0
    for k in range(len(MOBILISED) - 1):
        low, high = MOBILISED[k], MOBILISED[k + 1]
        if low[0] <= mobilised < high[0]:
            share = low[1] + (high[1] - low[1]) * (mobilised - low[0]) / (high[0] - low[0])
    rough = min(share * rough, max(STEEPEST - law[RESIDUAL], 0.0))
    return law[RESIDUAL] + rough, rough


@njit(cache=True, nogil=True, error_model="numpy")
def _excess(x, o, s, law, beyond, opened, path, tan_dilation):
    """Shear stress over strength [Pa] if x more of the slip stays; the strength."""
    pressure, _ = _pressure(opened + tan_dilation * x - o, law, beyond)
    angle, _ = _mobilised(path + x, pressure, law, beyond)
    limit = pressure * math.tan(DEGREE * angle)
    return law[K_S] * (s - x) - limit, limit


@njit(cache=True, nogil=True, error_model="numpy")
def _pieces(o, s, law, beyond, opened, path):
    """Into how many parts, a power of two, what slides beyond the strength is cut, none of which is much of the path to
    the peak: dilation is that at the beginning of a part. And slip beyond the strength [m]."""
    over, _ = _excess(0.0, o, s, law, beyond, opened, path, 0.0)
    n, beyond_strength = 1, over / law[K_S]
    while law[JRC] > 0.0 and n < MOST and beyond_strength > n * PIECE * beyond[PEAK]:
        n *= 2
    return n, beyond_strength


@njit(cache=True, nogil=True, error_model="numpy")
def _barton_bandis(o, s, law, beyond, opened, path):
    pressure, _ = _pressure(opened - o, law, beyond)
    if pressure <= 0.0:
        return 0.0, 0.0, s, opened, path
    n, far = _pieces(o, s, law, beyond, opened, path)
    if far <= 0.0:
        return -pressure, law[K_S] * s, 0.0, opened, path
    return _slid(o, s, law, beyond, opened, path, n, far)


@njit(cache=True, nogil=True, error_model="numpy")
def _slid(o, s, law, beyond, opened, path, n, far):
    """`_barton_bandis` of a point that slides; n, far: `_pieces`."""
    more = 0.0
    for k in range(1, n + 1):
        slip = s - far * (1.0 - k / n) - more
        pressure, _ = _pressure(opened - o, law, beyond)
        tan_dilation = math.tan(DEGREE * law[PART] * _mobilised(path, pressure, law, beyond)[1])
        over, _ = _excess(0.0, o, slip, law, beyond, opened, path, 0.0)
        if over <= 0.0:
            continue
        low, high = 0.0, slip
        for _ in range(60):  # more slides than is too little, less than all
            x = 0.5 * (low + high)
            over, _ = _excess(x, o, slip, law, beyond, opened, path, tan_dilation)
            if over > 0.0:
                low = x
            else:
                high = x
        opened, path, more = opened + tan_dilation * high, path + high, more + high
    pressure, _ = _pressure(opened - o, law, beyond)
    return -pressure, law[K_S] * (s - more), more, opened, path


@njit(cache=True, nogil=True, error_model="numpy")
def _barton_bandis_slopes(o, s, law, beyond, opened, path):
    """Return the slopes of Barton-Bandis from the previous history; where the joint slides, by differences with the
    same parts."""
    pressure, slope = _pressure(opened - o, law, beyond)
    if pressure <= 0.0:
        return LEAST * LEAST * law[K_N], 0.0, 0.0, 0.0
    n, far = _pieces(o, s, law, beyond, opened, path)
    if far <= 0.0:
        return slope, 0.0, 0.0, law[K_S]
    d, ends = 1e-6 * beyond[V_C], np.empty((4, 2))
    for k, (by_o, by_s) in enumerate(((d, 0.0), (-d, 0.0), (0.0, d), (0.0, -d))):
        _, far = _pieces(o + by_o, s + by_s, law, beyond, opened, path)
        ends[k, 0], ends[k, 1], _, _, _ = _slid(o + by_o, s + by_s, law, beyond, opened, path, n, max(far, 0.0))
    per = 0.5 / d
    return (
        (ends[0, 0] - ends[1, 0]) * per, (ends[2, 0] - ends[3, 0]) * per,
        (ends[0, 1] - ends[1, 1]) * per, (ends[2, 1] - ends[3, 1]) * per,
    )  # fmt: skip

"""A joint between two edges: where its three Gauss points are, and the loop-free part of its law.

The edge of an element runs from corner a to corner b, the partner's the other way: from p, which faces b, to q, which
faces a. Everything is written so that the partner, for which a and b, p and q, and the outer points have changed
places, gets the opposite forces bit for bit: sums of two are commutative, and the three points are added as (first +
last) + middle. So both sides can work on their own, each with a copy of what the joint remembers.
"""

from __future__ import annotations

import math

from numba import njit

from hpcdem.physics.fdem.kernels import laws

NEAR = 0.5 * (1.0 + math.sqrt(0.6))
"""Shape function of the nearer end at an outer Gauss point; 1 - NEAR of the other."""
FAR = 0.5 * (1.0 - math.sqrt(0.6))
AT_NEAR, AT_MIDDLE, AT_FAR = 5.0 / 18.0 * NEAR, 8.0 / 18.0 * 0.5, 5.0 / 18.0 * FAR
"""Weight of a point times shape function of an end: the nearer outer point, the middle, the farther one."""

# Columns of the table of joint laws (rows, 8), for joints before their peak (laws.intact_point), and of the table
# (rows, 4) of what else they need behind it: one over o_t, s_t, kop and half the shear penalty.
KOP, TENSILE, OVERLAY, TAN_PHI, COHESION, HALF_SHEAR = range(6)
PER_O_T, PER_S_T, PER_KOP, PER_HALF_SHEAR = range(4)

# What a joint remembers behind its peak, per Gauss point from a to b: largest opening and slip, damage; then how it
# broke (0: it has not), at which step, and the kinetic energy of the element at that moment; and step and kinetic
# energy when it passed its peak.
OPENED, SLIPPED, DAMAGE, MODE, STEP, KINETIC, PEAK_STEP, PEAK_KINETIC = 0, 3, 6, 9, 10, 11, 12, 13
HISTORY = 14

NONE, INTACT, YIELDED, BROKEN = 0, 1, 2, 3
"""State of an edge. BROKEN: its strength is gone; it presses and rubs until contact takes over at the next rebuild."""


@njit(cache=True, error_model="numpy")
def openings(ax, ay, bx, by, px, py, qx, qy):
    """Mid-line (tx, ty) from a to b [m], its length squared, and opening and slip at both ends times that length."""
    tx, ty = 0.5 * ((bx + px) - (ax + qx)), 0.5 * ((by + py) - (ay + qy))
    ux, uy, wx, wy = qx - ax, qy - ay, px - bx, py - by
    return tx, ty, tx * tx + ty * ty, ux * ty - uy * tx, ux * tx + uy * ty, wx * ty - wy * tx, wx * tx + wy * ty


@njit(cache=True, error_model="numpy")
def end_forces(tx, ty, s0, s1, s2, t0, t1, t2):
    """Forces [N/m] on the ends a and b of this side from the stresses at the three points."""
    na, nb = (AT_NEAR * s0 + AT_FAR * s2) + AT_MIDDLE * s1, (AT_FAR * s0 + AT_NEAR * s2) + AT_MIDDLE * s1
    ta, tb = (AT_NEAR * t0 + AT_FAR * t2) + AT_MIDDLE * t1, (AT_FAR * t0 + AT_NEAR * t2) + AT_MIDDLE * t1
    return na * ty + ta * tx, ta * ty - na * tx, nb * ty + tb * tx, tb * ty - nb * tx


@njit(cache=True, nogil=True, error_model="numpy")
def points_now(ax, ay, bx, by, px, py, qx, qy, law, beyond, history):
    """Mid-line from a to b (tx, ty) [m], and normal (s0, s1, s2) and shear (t0, t1, t2) stresses [Pa] at the points
    from a to b, of a joint in any state.

    law (8,), beyond (4,): rows of the tables; history (14,): stays as it is, zero before the peak.
    """
    tx, ty, h2, oa, sa, ob, sb = openings(ax, ay, bx, by, px, py, qx, qy)
    h = math.sqrt(h2)
    inverse = 1.0 / h
    oa, sa, ob, sb = oa * inverse, sa * inverse, ob * inverse, sb * inverse
    s0, t0 = _point_now(NEAR * oa + FAR * ob, NEAR * sa + FAR * sb, h, inverse, law, beyond, history, 0)
    s1, t1 = _point_now(0.5 * (oa + ob), 0.5 * (sa + sb), h, inverse, law, beyond, history, 1)
    s2, t2 = _point_now(FAR * oa + NEAR * ob, FAR * sa + NEAR * sb, h, inverse, law, beyond, history, 2)
    return tx, ty, s0, s1, s2, t0, t1, t2


@njit(cache=True, nogil=True, error_model="numpy")
def _point_now(o, s, h, inverse, law, beyond, history, g):
    sigma, tau, _, _, _, _, _ = laws.yielded_point(
        o, s, h, inverse, law[KOP], law[TENSILE], law[OVERLAY], law[TAN_PHI], law[COHESION], beyond[PER_O_T],
        beyond[PER_S_T], beyond[PER_KOP], beyond[PER_HALF_SHEAR], history[OPENED + g], history[SLIPPED + g],
        history[DAMAGE + g],
    )  # fmt: skip
    return sigma, tau

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


@njit(cache=True, error_model="numpy")
def mode(opened2, slid2):
    """How a joint broke, from the largest squares of both parts of its damage: from 1 (opened) to 2 (slid)."""
    return 1.0 + (slid2 / (opened2 + slid2) if opened2 + slid2 > 0.0 else 0.0)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def yielded_points(ax, ay, bx, by, px, py, qx, qy, table, beyond, row, history, slot, state):
    """Stresses at the points of a joint that has passed its peak, which remembers more by it.

    table (rows, 8), beyond (rows, 4): of the laws, and the row of this one; history (slots, 12), and the slot. (Rows
    are not handed over as such: counting references to views takes longer than the law.) Returns the mid-line from a to
    b (tx, ty) [m], normal (s0, s1, s2) and shear (t0, t1, t2) stresses [Pa] at the points from a to b, and the state:
    BROKEN when two of the three points have no strength left; history[slot, MODE] then says how, from 1 (opened) to 2
    (slid). At a joint before its peak, whose history is zero, this is the law of `laws.intact_point`. (Inlined: the
    nine numbers would go through memory, a fifth of the time of a joint.)
    """
    tx, ty, h2, oa, sa, ob, sb = openings(ax, ay, bx, by, px, py, qx, qy)
    h = math.sqrt(h2)
    inverse = 1.0 / h
    oa, sa, ob, sb = oa * inverse, sa * inverse, ob * inverse, sb * inverse
    kop, tensile, overlay = table[row, KOP], table[row, TENSILE], table[row, OVERLAY]
    tan_phi, cohesion = table[row, TAN_PHI], table[row, COHESION]
    per_o_t, per_s_t = beyond[row, PER_O_T], beyond[row, PER_S_T]
    per_kop, per_half_shear = beyond[row, PER_KOP], beyond[row, PER_HALF_SHEAR]
    s0, t0, o0, u0, d0, f0, g0 = laws.yielded_point(
        NEAR * oa + FAR * ob, NEAR * sa + FAR * sb, h, inverse, kop, tensile, overlay, tan_phi, cohesion, per_o_t,
        per_s_t, per_kop, per_half_shear, history[slot, OPENED], history[slot, SLIPPED], history[slot, DAMAGE],
    )  # fmt: skip
    s1, t1, o1, u1, d1, f1, g1 = laws.yielded_point(
        0.5 * (oa + ob), 0.5 * (sa + sb), h, inverse, kop, tensile, overlay, tan_phi, cohesion, per_o_t,
        per_s_t, per_kop, per_half_shear,
        history[slot, OPENED + 1], history[slot, SLIPPED + 1], history[slot, DAMAGE + 1],
    )  # fmt: skip
    s2, t2, o2, u2, d2, f2, g2 = laws.yielded_point(
        FAR * oa + NEAR * ob, FAR * sa + NEAR * sb, h, inverse, kop, tensile, overlay, tan_phi, cohesion, per_o_t,
        per_s_t, per_kop, per_half_shear,
        history[slot, OPENED + 2], history[slot, SLIPPED + 2], history[slot, DAMAGE + 2],
    )  # fmt: skip
    gone = (d0 >= 1.0) + (d1 >= 1.0) + (d2 >= 1.0)
    if state == YIELDED and gone >= 2:
        state = BROKEN
        history[slot, MODE] = mode(max(f0, f1, f2), max(g0, g1, g2))
        d0 = d1 = d2 = 1.0
    history[slot, OPENED], history[slot, OPENED + 1], history[slot, OPENED + 2] = o0, o1, o2
    history[slot, SLIPPED], history[slot, SLIPPED + 1], history[slot, SLIPPED + 2] = u0, u1, u2
    history[slot, DAMAGE], history[slot, DAMAGE + 1], history[slot, DAMAGE + 2] = d0, d1, d2
    return tx, ty, s0, s1, s2, t0, t1, t2, state


@njit(cache=True, nogil=True, error_model="numpy")
def yielded_edge(ax, ay, bx, by, px, py, qx, qy, table, beyond, row, history, slot, state):
    """Forces on a and b of a joint that has passed its peak (fax, fay, fbx, fby [N/m]), and its state; see
    `yielded_points`."""
    tx, ty, s0, s1, s2, t0, t1, t2, state = yielded_points(
        ax, ay, bx, by, px, py, qx, qy, table, beyond, row, history, slot, state
    )
    fax, fay, fbx, fby = end_forces(tx, ty, s0, s1, s2, t0, t1, t2)
    return fax, fay, fbx, fby, state


@njit(cache=True, nogil=True, error_model="numpy")
def past_peak(ax, ay, bx, by, px, py, qx, qy, law):
    """How much is left to the peak at the worst of the three points; negative behind it."""
    _, _, h2, oa, sa, ob, sb = openings(ax, ay, bx, by, px, py, qx, qy)
    inverse = 1.0 / h2
    oa, sa, ob, sb = oa * inverse, sa * inverse, ob * inverse, sb * inverse
    left = math.inf
    for g in range(3):
        o = NEAR * oa + FAR * ob if g == 0 else (0.5 * (oa + ob) if g == 1 else FAR * oa + NEAR * ob)
        s = NEAR * sa + FAR * sb if g == 0 else (0.5 * (sa + sb) if g == 1 else FAR * sa + NEAR * sb)
        _, _, here = laws.intact_point(
            o, s, law[KOP], law[TENSILE], law[OVERLAY], law[TAN_PHI], law[COHESION], law[HALF_SHEAR]
        )
        left = min(left, here)
    return left

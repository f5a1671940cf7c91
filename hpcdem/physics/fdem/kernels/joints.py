"""A joint between two edges: where its three Gauss points are, and what forces stresses there make.

The edge of an element runs from corner a to corner b, the partner's the other way: from p, which faces b, to q, which
faces a. Everything is written so that the partner, for which a and b, p and q, and the outer points have changed
places, gets the opposite forces bit for bit: sums of two are commutative, and the three points are added as (first +
last) + middle. So both sides can work on their own, each with a copy of what the joint remembers.
"""

from __future__ import annotations

import math

from numba import njit

from hpcdem.physics.fdem.kernels import joint_law
from hpcdem.physics.fdem.kernels.joint_law import COHESIVE, LAW, OWN, PATH, STAYS

NEAR = 0.5 * (1.0 + math.sqrt(0.6))
"""Shape function of the nearer end at an outer Gauss point; 1 - NEAR of the other."""
FAR = 0.5 * (1.0 - math.sqrt(0.6))
AT_NEAR, AT_MIDDLE, AT_FAR = 5.0 / 18.0 * NEAR, 8.0 / 18.0 * 0.5, 5.0 / 18.0 * FAR
"""Weight of a point times shape function of an end: the nearer outer point, the middle, the farther one."""

NONE, INTACT, YIELDED, BROKEN = 0, 1, 2, 3
"""State of an edge. BROKEN: its strength is gone; its compression and friction act until contact takes over at the next
rebuild. Joints that slide (joint_law.slide) have a state above it, BROKEN + the number of their law, all the time."""


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
    if law[LAW] > COHESIVE:
        return points_slide(ax, ay, bx, by, px, py, qx, qy, law, beyond, history, False)
    tx, ty, h2, oa, sa, ob, sb = openings(ax, ay, bx, by, px, py, qx, qy)
    h = math.sqrt(h2)
    inverse = 1.0 / h
    oa, sa, ob, sb = oa * inverse, sa * inverse, ob * inverse, sb * inverse
    s0, t0, _, _, _, _, _ = joint_law.point(NEAR * oa + FAR * ob, NEAR * sa + FAR * sb, h, law, beyond, history, 0)
    s1, t1, _, _, _, _, _ = joint_law.point(0.5 * (oa + ob), 0.5 * (sa + sb), h, law, beyond, history, 1)
    s2, t2, _, _, _, _, _ = joint_law.point(FAR * oa + NEAR * ob, FAR * sa + NEAR * sb, h, law, beyond, history, 2)
    return tx, ty, s0, s1, s2, t0, t1, t2


@njit(cache=True, nogil=True, error_model="numpy")
def points_slide(ax, ay, bx, by, px, py, qx, qy, law, beyond, history, keep):
    """Return the stresses of a joint that slides; keep: its history is updated."""
    tx, ty, h2, oa, sa, ob, sb = openings(ax, ay, bx, by, px, py, qx, qy)
    inverse = 1.0 / math.sqrt(h2)
    oa, sa, ob, sb = oa * inverse, sa * inverse, ob * inverse, sb * inverse
    s0, t0 = _slides(NEAR * oa + FAR * ob, NEAR * sa + FAR * sb, law, beyond, history, 0, keep)
    s1, t1 = _slides(0.5 * (oa + ob), 0.5 * (sa + sb), law, beyond, history, 1, keep)
    s2, t2 = _slides(FAR * oa + NEAR * ob, FAR * sa + NEAR * sb, law, beyond, history, 2, keep)
    return tx, ty, s0, s1, s2, t0, t1, t2


@njit(cache=True, nogil=True, error_model="numpy")
def _slides(o, s, law, beyond, history, g, keep):
    s -= history[STAYS + g]
    sigma, tau, more, own, path = joint_law.slide(o, abs(s), law, beyond, history[OWN + g], history[PATH + g])
    if keep:
        history[STAYS + g] += math.copysign(more, s)
        history[OWN + g], history[PATH + g] = own, path
    return sigma, math.copysign(tau, s)


@njit(cache=True, nogil=True, error_model="numpy")
def sliding_edge(x, at, over, law, beyond, history):
    """Forces [N/m] on the ends a and b of a joint that slides; what it remembers moves on. at, over: where its own and
    the partner's edge begin in flat x."""
    tx, ty, s0, s1, s2, t0, t1, t2 = points_slide(
        x[at], x[at + 1], x[at + 2], x[at + 3], x[over], x[over + 1], x[over + 2], x[over + 3], law, beyond, history,
        True,
    )  # fmt: skip
    return end_forces(tx, ty, s0, s1, s2, t0, t1, t2)

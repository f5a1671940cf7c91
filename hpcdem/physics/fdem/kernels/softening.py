"""Joints past their peak: the law of joint_law.py as loops over lanes (numerics/lanes.py), and how they break.

Each loop has no jumps and no calls, so it becomes vector instructions; only the exponential of the softening curve is
computed one by one, in a loop of its own.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.numerics.lanes import CAPACITY, U, four_columns, lane, put_four_columns
from hpcdem.physics.fdem.kernels import joint_law, joints
from hpcdem.physics.fdem.kernels.joint_law import HISTORY
from hpcdem.physics.fdem.kernels.joints import BROKEN, FAR, NEAR, YIELDED

(
    AX, AY, BX, BY, PX, PY, QX, QY, KOP, TENSILE, OVERLAY, TAN_PHI, COHESION, _, _, _,
    PER_O_T, PER_S_T, PER_KOP, PER_HALF_SHEAR, OPENED0, OPENED1, OPENED2, SLIPPED0, SLIPPED1, SLIPPED2, D0, D1, D2, _,
    _, _, TX, TY, H, PER_H, O0, O1, O2, S0, S1, S2, E0, E1, E2, FAX, FAY, FBX, FBY, OPENED, SLIPPED,
) = (lane(k) for k in range(51))  # fmt: skip
"""Corners, law, history in the order of joint_law.py; what is between; forces on a and b, and the largest squares of
both parts of the damage."""
LANES = 51
_1, _2, _3, _FOUR, _EIGHT = U(1), U(2), U(3), U(4), U(8)
_HISTORY = U(HISTORY)


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(n, slot, edge, x, partner, kind, table, beyond, history, lanes):
    for e in range(U(0), U(n), _FOUR):
        i0, i1, i2, i3 = U(slot[e]), U(slot[e + _1]), U(slot[e + _2]), U(slot[e + _3])
        at = (U(edge[e]), U(edge[e + _1]), U(edge[e + _2]), U(edge[e + _3]))
        four_columns(lanes, AX + e, x, at)
        at = (U(partner[i0]), U(partner[i1]), U(partner[i2]), U(partner[i3]))
        four_columns(lanes, PX + e, x, at)
        w0, w1, w2, w3 = U(kind[i0]), U(kind[i1]), U(kind[i2]), U(kind[i3])
        at = (w0 * _FOUR, w1 * _FOUR, w2 * _FOUR, w3 * _FOUR)
        four_columns(lanes, PER_O_T + e, beyond, at)
        at = (w0 * _EIGHT, w1 * _EIGHT, w2 * _EIGHT, w3 * _EIGHT)
        four_columns(lanes, KOP + e, table, at)
        at = (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR)
        four_columns(lanes, COHESION + e, table, at)
        at = (i0 * _HISTORY, i1 * _HISTORY, i2 * _HISTORY, i3 * _HISTORY)
        four_columns(lanes, OPENED0 + e, history, at)
        at = (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR)
        four_columns(lanes, SLIPPED1 + e, history, at)
        at = (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR)
        four_columns(lanes, D2 + e, history, at)


@njit(cache=True, nogil=True, error_model="numpy")
def _put_histories(n, slot, history, lanes):
    """Write the histories of joints back; four columns at a time, the last ones as they came."""
    for e in range(U(0), U(n), _FOUR):
        i0, i1, i2, i3 = U(slot[e]), U(slot[e + _1]), U(slot[e + _2]), U(slot[e + _3])
        at = (i0 * _HISTORY, i1 * _HISTORY, i2 * _HISTORY, i3 * _HISTORY)
        put_four_columns(history, at, lanes, OPENED0 + e)
        at = (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR)
        put_four_columns(history, at, lanes, SLIPPED1 + e)
        at = (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR)
        put_four_columns(history, at, lanes, D2 + e)


@njit(cache=True, nogil=True, error_model="numpy")
def _open(n, lanes):
    """Opening and slip of the points [m], and length of the joint."""
    for e in range(U(n)):
        tx, ty, h2, oa, sa, ob, sb = joints.openings(
            lanes[AX + e], lanes[AY + e], lanes[BX + e], lanes[BY + e],
            lanes[PX + e], lanes[PY + e], lanes[QX + e], lanes[QY + e],
        )  # fmt: skip
        h = math.sqrt(h2)
        inverse = 1.0 / h
        oa, sa, ob, sb = oa * inverse, sa * inverse, ob * inverse, sb * inverse
        lanes[TX + e], lanes[TY + e], lanes[H + e], lanes[PER_H + e] = tx, ty, h, inverse
        lanes[O0 + e], lanes[S0 + e] = NEAR * oa + FAR * ob, NEAR * sa + FAR * sb
        lanes[O1 + e], lanes[S1 + e] = 0.5 * (oa + ob), 0.5 * (sa + sb)
        lanes[O2 + e], lanes[S2 + e] = FAR * oa + NEAR * ob, FAR * sa + NEAR * sb


@njit(cache=True, nogil=True, error_model="numpy")
def _damage(n, lanes):
    for e in range(U(n)):
        h, inverse = lanes[H + e], lanes[PER_H + e]
        kop, tensile, overlay = lanes[KOP + e], lanes[TENSILE + e], lanes[OVERLAY + e]
        tan_phi, cohesion = lanes[TAN_PHI + e], lanes[COHESION + e]
        per_o_t, per_s_t = lanes[PER_O_T + e], lanes[PER_S_T + e]
        per_kop, per_half_shear = lanes[PER_KOP + e], lanes[PER_HALF_SHEAR + e]
        o0, u0, d0, f0, g0 = joint_law.damaged_point(
            lanes[O0 + e], lanes[S0 + e], h, inverse, kop, tensile, overlay, tan_phi, cohesion, per_o_t, per_s_t,
            per_kop, per_half_shear, lanes[OPENED0 + e], lanes[SLIPPED0 + e], lanes[D0 + e],
        )  # fmt: skip
        o1, u1, d1, f1, g1 = joint_law.damaged_point(
            lanes[O1 + e], lanes[S1 + e], h, inverse, kop, tensile, overlay, tan_phi, cohesion, per_o_t, per_s_t,
            per_kop, per_half_shear, lanes[OPENED1 + e], lanes[SLIPPED1 + e], lanes[D1 + e],
        )  # fmt: skip
        o2, u2, d2, f2, g2 = joint_law.damaged_point(
            lanes[O2 + e], lanes[S2 + e], h, inverse, kop, tensile, overlay, tan_phi, cohesion, per_o_t, per_s_t,
            per_kop, per_half_shear, lanes[OPENED2 + e], lanes[SLIPPED2 + e], lanes[D2 + e],
        )  # fmt: skip
        lanes[OPENED0 + e], lanes[OPENED1 + e], lanes[OPENED2 + e] = o0, o1, o2
        lanes[SLIPPED0 + e], lanes[SLIPPED1 + e], lanes[SLIPPED2 + e] = u0, u1, u2
        lanes[D0 + e], lanes[D1 + e], lanes[D2 + e] = d0, d1, d2
        lanes[OPENED + e], lanes[SLIPPED + e] = max(f0, f1, f2), max(g0, g1, g2)


@njit(cache=True, nogil=True, error_model="numpy")
def _exponentials(n, lanes):
    for e in range(U(n)):
        lanes[E0 + e] = joint_law.growth(lanes[D0 + e])
        lanes[E1 + e] = joint_law.growth(lanes[D1 + e])
        lanes[E2 + e] = joint_law.growth(lanes[D2 + e])


@njit(cache=True, nogil=True, error_model="numpy")
def _forces(n, lanes):
    for e in range(U(n)):
        h, inverse = lanes[H + e], lanes[PER_H + e]
        kop, tensile, overlay = lanes[KOP + e], lanes[TENSILE + e], lanes[OVERLAY + e]
        tan_phi, cohesion, per_half_shear = lanes[TAN_PHI + e], lanes[COHESION + e], lanes[PER_HALF_SHEAR + e]
        s0, t0 = joint_law.softened_point(
            lanes[O0 + e], lanes[S0 + e], h, inverse, kop, tensile, overlay, tan_phi, cohesion, per_half_shear,
            lanes[OPENED0 + e], lanes[SLIPPED0 + e], joint_law.softening_curve(lanes[D0 + e], lanes[E0 + e]),
        )  # fmt: skip
        s1, t1 = joint_law.softened_point(
            lanes[O1 + e], lanes[S1 + e], h, inverse, kop, tensile, overlay, tan_phi, cohesion, per_half_shear,
            lanes[OPENED1 + e], lanes[SLIPPED1 + e], joint_law.softening_curve(lanes[D1 + e], lanes[E1 + e]),
        )  # fmt: skip
        s2, t2 = joint_law.softened_point(
            lanes[O2 + e], lanes[S2 + e], h, inverse, kop, tensile, overlay, tan_phi, cohesion, per_half_shear,
            lanes[OPENED2 + e], lanes[SLIPPED2 + e], joint_law.softening_curve(lanes[D2 + e], lanes[E2 + e]),
        )  # fmt: skip
        fax, fay, fbx, fby = joints.end_forces(lanes[TX + e], lanes[TY + e], s0, s1, s2, t0, t1, t2)
        lanes[FAX + e], lanes[FAY + e], lanes[FBX + e], lanes[FBY + e] = fax, fay, fbx, fby


@njit(cache=True, nogil=True, error_model="numpy")
def yielded_edges(n, slot, edge, x, partner, kind, state, table, beyond, history, lanes):
    """Forces of n joints on their ends a and b [N/m] into the lanes FAX to FBY; histories and states move on.

    slot, edge (CAPACITY,) i8: the first n are slots and where their own edges begin in x; the next up to three are
    filled up here. partner, kind, state: by slot, see `elements.triangles`; x, table, beyond, history: flat.

    A joint is BROKEN when two of its three points have no strength left; its MODE then says how, from 1 (opened) to 2
    (slid). Returns how many break now: their slots are then the first in `edge`, which is used up.
    """
    whole = (n + 3) // 4 * 4
    for m in range(n, whole):
        slot[m], edge[m] = slot[n - 1], edge[n - 1]
    _gather(whole, slot, edge, x, partner, kind, table, beyond, history, lanes)
    _open(whole, lanes)
    _damage(whole, lanes)
    _exponentials(whole, lanes)
    _forces(whole, lanes)
    _put_histories(whole, slot, history, lanes)
    broken = 0
    for m in range(n):
        at = slot[m] * HISTORY
        if state[slot[m]] == YIELDED and joint_law.breaks(
            history[at : at + HISTORY], lanes[OPENED + U(m)], lanes[SLIPPED + U(m)]
        ):
            state[slot[m]] = BROKEN
            edge[broken] = slot[m]
            broken += 1
    return broken


@njit(cache=True, nogil=True, error_model="numpy")
def lanes_and_lists():
    """Room for `yielded_edges`: lanes, slots, edges."""
    return np.empty(LANES * CAPACITY), np.empty(CAPACITY, np.int64), np.empty(CAPACITY, np.int64)

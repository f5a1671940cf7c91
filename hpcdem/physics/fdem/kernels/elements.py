"""Forces of elements and joints, and the kick they give: the loop that takes most of the time of an intact body.

A triangle computes the forces on its own corners: from its stress, from the joints on its three edges (the partner
does the same on its side, with the same numbers: see joints.py), and takes those of contacts as they come. Nothing is
sent to a neighbour, so neither threads nor ranks meet. Triangles go through in blocks of `BLOCK`:

1. rows of triangle and partners' edges are turned into lanes (numerics/lanes.py);
2. stress and joints before their peak are plain loops over lanes, which become vector instructions; the loop over
   stresses is made for a law, so that a user law (user_laws.py) runs instead of the elastic one;
3. joints past their peak, of which each block has a list, go through lanes of their own (softening.py) and overwrite
   what step 2 found for them;
4. contact forces are added, and corners that move by themselves are kicked: v += f dt / m. For the others the forces
   are stored; nodes.py adds them up.

Row layouts: x (n, 8): the three corners and the first one again, so that any edge is four numbers in a row; v (n, 6).
With quads in the mesh x and v are (n, 12): up to four corners, then the first two again. Forces (n, 8).
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import CAPACITY, U, four_columns, lane, put_four_columns, put_two_columns, two_columns
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem.kernels import joint_law, joints, laws, softening
from hpcdem.physics.fdem.kernels.joint_law import HISTORY, KINETIC, PEAK_KINETIC, PEAK_STEP, STEP
from hpcdem.physics.fdem.kernels.joints import BROKEN, INTACT, NONE, YIELDED

BLOCK = 64
"""Triangles worked on together: their lanes stay in the first-level cache."""

# Columns of the table of triangles (n, 12): inverse of the reference matrix [X2 - X1, X3 - X1], Lame's lambda, 2 mu,
# viscosity [Pa s], mass of a corner [kg/m] (for gravity), dt / m of the three corners, 0 where nodes.py moves it, and
# whether the strain across the plane is free: 1 in plane stress, where lambda is that of the plane (moduli.py), else 0.
INVERSE, LAMBDA, TWO_MU, ETA, WEIGHT, KICK, FREE = 0, 4, 5, 6, 7, 8, 11
TRIANGLE = 12
# Columns of the table of quads (n, 32): the inverses of their four triangles (`PARTS`), areas of these, lambda, 2 mu,
# viscosity, masses of the four corners, whether the strain across the plane is free.
Q_INVERSE, Q_AREA, Q_LAMBDA, Q_TWO_MU, Q_ETA, Q_WEIGHT, Q_FREE = 0, 16, 20, 21, 22, 23, 27
QUAD = 32
PARTS = np.array([[0, 1, 2], [0, 2, 3], [1, 2, 3], [1, 3, 0]])
"""Two overlays of two triangles each."""

FORCE = 8

# What a pass leaves behind per thread (int64): joints that broke, joints that passed their peak.
NEW_BROKEN, NEW_YIELDED = 0, 1
TALLY = 8

(
    X1, Y1, X2, Y2, X3, Y3, _, _, VX1, VY1, VX2, VY2, VX3, VY3, _, _, CA, CB, CC, CD, LAM, MU2, VISC, MASS,
    K1, K2, K3, FREED, PX, PY, QX, QY, KOP, TENSILE, OVERLAY, TAN_PHI, COHESION, HALF_SHEAR, _, _,
    FX1, FY1, FX2, FY2, FX3, FY3, S11, S22, S12, S33,
) = (lane(k) for k in range(50))  # fmt: skip
EDGE_FORCE = 50
"""First lane of the joint forces: (fx, fy) on the first and the last corner of each of the three edges."""
LEFT0, LEFT1, LEFT2 = (lane(62 + k) for k in range(3))
LANES = 65
A0, A1, A2, A3 = (lane(EDGE_FORCE + 4 * k) for k in range(4))
_1, _2, _3, _FOUR, _SIX, _EIGHT, _TWELVE, _SIXTEEN, _QUAD = U(1), U(2), U(3), U(4), U(6), U(8), U(12), U(16), U(QUAD)
_NEXT = lane(1)
_B = lane(2)
"""From the force on the first corner of an edge to that on its last."""


@njit(cache=True, nogil=True, error_model="numpy")
def gather(n, first, rows, wide, x, v, c, s0, stressed, lanes):
    """Rows of the triangles first : first + n into lanes, in groups of four (rows is long enough)."""
    wx, wv = U(12 if wide else 8), U(12 if wide else 6)
    for e in range(U(0), U(n), _FOUR):
        i = U(first) + e
        r0, r1, r2, r3 = U(rows[i]), U(rows[i + _1]), U(rows[i + _2]), U(rows[i + _3])
        at = (r0 * wx, r1 * wx, r2 * wx, r3 * wx)
        four_columns(lanes, X1 + e, x, at)
        two_columns(lanes, X3 + e, x, (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR))
        at = (r0 * wv, r1 * wv, r2 * wv, r3 * wv)
        four_columns(lanes, VX1 + e, v, at)
        two_columns(lanes, VX3 + e, v, (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR))
        q0 = i * _TWELVE
        q1, q2, q3 = q0 + _TWELVE, q0 + U(24), q0 + U(36)
        four_columns(lanes, CA + e, c, (q0, q1, q2, q3))
        four_columns(lanes, LAM + e, c, (q0 + _FOUR, q1 + _FOUR, q2 + _FOUR, q3 + _FOUR))
        four_columns(lanes, K1 + e, c, (q0 + _EIGHT, q1 + _EIGHT, q2 + _EIGHT, q3 + _EIGHT))
        if stressed:
            q0 = i * _FOUR
            four_columns(lanes, S11 + e, s0, (q0, q0 + _FOUR, q0 + _EIGHT, q0 + _TWELVE))


@njit(cache=True, nogil=True, error_model="numpy")
def _gather_edge(n, first, k, x, partner, law, table, lanes):
    """The partners' edges and the laws of edge k."""
    for e in range(U(0), U(n), _FOUR):
        q0 = (U(first) + e) * _3 + U(k)
        q1, q2, q3 = q0 + _3, q0 + _SIX, q0 + U(9)
        four_columns(lanes, PX + e, x, (U(partner[q0]), U(partner[q1]), U(partner[q2]), U(partner[q3])))
        w0, w1, w2, w3 = U(law[q0]) * _EIGHT, U(law[q1]) * _EIGHT, U(law[q2]) * _EIGHT, U(law[q3]) * _EIGHT
        four_columns(lanes, KOP + e, table, (w0, w1, w2, w3))
        four_columns(lanes, COHESION + e, table, (w0 + _FOUR, w1 + _FOUR, w2 + _FOUR, w3 + _FOUR))


@njit(cache=True, error_model="numpy")
def elastic(e, e11, e22, e12, trace, dt, lanes):
    """Stress 11, 22, 12, 33 [Pa] of a strain, without the initial one; trace: e11 + e22."""
    p, m = lanes[LAM + e] * trace, lanes[MU2 + e]
    return p + m * e11, p + m * e22, m * e12, p - lanes[FREED + e] * p


def stress_loop(law):
    """The loop that makes corner forces of strain, viscous parts included: f_l = sigma n s / 2, n s of the face
    opposite to l. law: a kernel like `elastic`."""

    @njit(nogil=True, error_model="numpy")
    def loop(n, small, beta, dt, lanes):
        for e in range(U(n)):
            x1, y1 = lanes[X1 + e], lanes[Y1 + e]
            ux, uy, wx, wy = lanes[X2 + e] - x1, lanes[Y2 + e] - y1, lanes[X3 + e] - x1, lanes[Y3 + e] - y1
            a, b, c, d = lanes[CA + e], lanes[CB + e], lanes[CC + e], lanes[CD + e]
            f11, f12, f21, f22 = ux * a + wx * c, ux * b + wx * d, uy * a + wy * c, uy * b + wy * d
            cs, sn = laws.rotation(f11, f12, f21, f22)
            cs, sn = (1.0 if small else cs), (0.0 if small else sn)
            e11, e22, e12 = laws.stretch(f11, f12, f21, f22, cs, sn)
            vx1, vy1 = lanes[VX1 + e], lanes[VY1 + e]
            dux, duy, dwx, dwy = lanes[VX2 + e] - vx1, lanes[VY2 + e] - vy1, lanes[VX3 + e] - vx1, lanes[VY3 + e] - vy1
            g11, g12, g21, g22 = dux * a + dwx * c, dux * b + dwx * d, duy * a + dwy * c, duy * b + dwy * d
            s11, s22, s12, s33 = law(e, e11, e22, e12, e11 + e22, dt, lanes)
            s11, s22, s12 = lanes[S11 + e] + s11, lanes[S22 + e] + s22, lanes[S12 + e] + s12
            d11, d22, eta = cs * g11 + sn * g21, cs * g22 - sn * g12, lanes[VISC + e] + beta * lanes[MU2 + e]
            swell = beta * lanes[LAM + e] * (d11 + d22)
            s11, s22 = s11 + (eta * d11 + swell), s22 + (eta * d22 + swell)
            s12 = s12 + 0.5 * eta * ((cs * g12 + sn * g22) + (cs * g21 - sn * g11))
            xx, yy, xy = laws.turned(s11, s22, s12, cs, sn)
            if small:
                inverse = 1.0 / (a * d - b * c)
                ux, wx, uy, wy = d * inverse, -b * inverse, -c * inverse, a * inverse
            fx1, fy1 = 0.5 * (xx * (wy - uy) - xy * (wx - ux)), 0.5 * (xy * (wy - uy) - yy * (wx - ux))
            fx2, fy2 = 0.5 * (xy * wx - xx * wy), 0.5 * (yy * wx - xy * wy)
            lanes[FX1 + e], lanes[FY1 + e], lanes[FX2 + e], lanes[FY2 + e] = fx1, fy1, fx2, fy2
            lanes[FX3 + e], lanes[FY3 + e] = -fx1 - fx2, -fy1 - fy2

    return loop


elastic_stress = stress_loop(elastic)


@njit(cache=True, nogil=True, error_model="numpy")
def _elastic_block(b, n, first, rows, small, beta, law, lanes):
    """Corner forces of a block of elastic triangles."""
    elastic_stress(n, small, beta, 0.0, lanes)


def _edge_loop(a, b, out, left_of):
    """The loop over the joints on one edge, from the corner whose x is lane a to that of lane b; forces into `out` and
    the three lanes behind it. One function each: distances between lanes must be constants."""
    xa, ya, xb, yb = a, a + _NEXT, b, b + _NEXT
    near, far = joints.NEAR, joints.FAR

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(n, lanes):
        for e in range(U(n)):
            tx, ty, h2, oa, sa, ob, sb = joints.openings(
                lanes[xa + e], lanes[ya + e], lanes[xb + e], lanes[yb + e],
                lanes[PX + e], lanes[PY + e], lanes[QX + e], lanes[QY + e],
            )  # fmt: skip
            inverse = 1.0 / (h2 + laws.TINY)  # an edge without partner is compared with itself: length 0
            oa, sa, ob, sb = oa * inverse, sa * inverse, ob * inverse, sb * inverse
            kop, tensile, overlay = lanes[KOP + e], lanes[TENSILE + e], lanes[OVERLAY + e]
            tan_phi, cohesion, half_shear = lanes[TAN_PHI + e], lanes[COHESION + e], lanes[HALF_SHEAR + e]
            s0, t0, left0 = joint_law.intact_point(
                near * oa + far * ob, near * sa + far * sb, kop, tensile, overlay, tan_phi, cohesion, half_shear
            )
            s1, t1, left1 = joint_law.intact_point(
                0.5 * (oa + ob), 0.5 * (sa + sb), kop, tensile, overlay, tan_phi, cohesion, half_shear
            )
            s2, t2, left2 = joint_law.intact_point(
                far * oa + near * ob, far * sa + near * sb, kop, tensile, overlay, tan_phi, cohesion, half_shear
            )
            fax, fay, fbx, fby = joints.end_forces(tx, ty, s0, s1, s2, t0, t1, t2)
            lanes[out + e], lanes[out + _NEXT + e] = fax, fay
            lanes[out + _B + e], lanes[out + _B + _NEXT + e] = fbx, fby
            left = left0 if left0 < left1 else left1
            lanes[left_of + e] = left if left < left2 else left2

    return loop


_edge_loop_0, _edge_loop_1 = _edge_loop(X1, X2, A0, LEFT0), _edge_loop(X2, X3, A1, LEFT1)
_edge_loop_2 = _edge_loop(X3, X1, A2, LEFT2)


@njit(cache=True, nogil=True, error_model="numpy")
def _any_past_peak(n, lanes):
    """Negative if a joint of the block has passed its peak."""
    bits = lanes.view(np.int64)
    found = np.int64(0)
    for e in range(U(n)):
        found |= bits[LEFT0 + e] | bits[LEFT1 + e] | bits[LEFT2 + e]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _any_quad_past_peak(n, lanes):
    """Return a negative number if a joint of these quads has passed its peak."""
    bits = lanes.view(np.int64)
    found = np.int64(0)
    for e in range(U(n)):
        found |= bits[Q_LEFT0 + e] | bits[Q_LEFT1 + e] | bits[Q_LEFT2 + e] | bits[Q_LEFT3 + e]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _sum(n, gx, gy, drag, lanes):
    """Stress, gravity, drag on the mass, joints of each corner; edge k begins at corner k and ends at the next one."""
    for e in range(U(n)):
        m = lanes[MASS + e]
        wx, wy = m * (gx - drag * lanes[VX1 + e]), m * (gy - drag * lanes[VY1 + e])
        lanes[FX1 + e] = (lanes[FX1 + e] + wx) + (lanes[A0 + e] + lanes[A2 + _B + e])
        lanes[FY1 + e] = (lanes[FY1 + e] + wy) + (lanes[A0 + _NEXT + e] + lanes[A2 + _B + _NEXT + e])
        wx, wy = m * (gx - drag * lanes[VX2 + e]), m * (gy - drag * lanes[VY2 + e])
        lanes[FX2 + e] = (lanes[FX2 + e] + wx) + (lanes[A1 + e] + lanes[A0 + _B + e])
        lanes[FY2 + e] = (lanes[FY2 + e] + wy) + (lanes[A1 + _NEXT + e] + lanes[A0 + _B + _NEXT + e])
        wx, wy = m * (gx - drag * lanes[VX3 + e]), m * (gy - drag * lanes[VY3 + e])
        lanes[FX3 + e] = (lanes[FX3 + e] + wx) + (lanes[A2 + e] + lanes[A1 + _B + e])
        lanes[FY3 + e] = (lanes[FY3 + e] + wy) + (lanes[A2 + _NEXT + e] + lanes[A1 + _B + _NEXT + e])


@njit(cache=True, nogil=True, error_model="numpy")
def _kick(n, alpha, lanes):
    for e in range(U(n)):
        vx1, vy1, vx2, vy2 = lanes[VX1 + e], lanes[VY1 + e], lanes[VX2 + e], lanes[VY2 + e]
        vx3, vy3, k1, k2, k3 = lanes[VX3 + e], lanes[VY3 + e], lanes[K1 + e], lanes[K2 + e], lanes[K3 + e]
        lanes[VX1 + e] = vx1 + k1 * laws.damped(lanes[FX1 + e], vx1, alpha)
        lanes[VY1 + e] = vy1 + k1 * laws.damped(lanes[FY1 + e], vy1, alpha)
        lanes[VX2 + e] = vx2 + k2 * laws.damped(lanes[FX2 + e], vx2, alpha)
        lanes[VY2 + e] = vy2 + k2 * laws.damped(lanes[FY2 + e], vy2, alpha)
        lanes[VX3 + e] = vx3 + k3 * laws.damped(lanes[FX3 + e], vx3, alpha)
        lanes[VY3 + e] = vy3 + k3 * laws.damped(lanes[FY3 + e], vy3, alpha)


@njit(cache=True, nogil=True, error_model="numpy")
def _put_velocities(n, first, rows, wide, v, lanes):
    wv = U(12 if wide else 6)
    whole = U(n // 4 * 4)
    for e in range(U(0), whole, _FOUR):
        i = U(first) + e
        r0, r1, r2, r3 = U(rows[i]), U(rows[i + _1]), U(rows[i + _2]), U(rows[i + _3])
        at = (r0 * wv, r1 * wv, r2 * wv, r3 * wv)
        put_four_columns(v, at, lanes, VX1 + e)
        at = (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR)
        put_two_columns(v, at, lanes, VX3 + e)
        if wide:
            at = (at[0] + _2, at[1] + _2, at[2] + _2, at[3] + _2)
            put_four_columns(v, at, lanes, VX1 + e)
    for e in range(whole, U(n)):
        at = U(rows[U(first) + e]) * wv
        for c in range(U(6)):
            v[at + c] = lanes[VX1 + c * U(CAPACITY) + e]
        if wide:
            for c in range(U(4)):
                v[at + _SIX + c] = lanes[VX1 + c * U(CAPACITY) + e]


@njit(cache=True, nogil=True, error_model="numpy")
def _kinetic(e, lanes):
    """Kinetic energy [J/m] of a triangle at the half step before."""
    v2 = 0.0
    for c in (VX1, VY1, VX2, VY2, VX3, VY3):
        v2 += lanes[c + U(e)] ** 2
    return 0.5 * lanes[MASS + U(e)] * v2


@njit(cache=True, nogil=True, error_model="numpy")
def _slow_joints(
    b, n, first, rows, wide, x, partner, law, kind, state, history, head, follow, table, beyond, step, lanes, room,
    tally,
):  # fmt: skip
    """Joints past their peak: those on the list of block b, and those that get there now."""
    if _any_past_peak(n, lanes) < 0:
        for e in range(n):
            for k in range(3):
                slot = 3 * (first + e) + k
                if law[slot] != 0 and lanes[(LEFT0, LEFT1, LEFT2)[k] + U(e)] < 0.0:
                    law[slot], state[slot] = 0, YIELDED
                    follow[slot], head[b] = head[b], slot
                    for m in range(HISTORY):
                        history[slot, m] = 0.0
                    history[slot, PEAK_STEP], history[slot, PEAK_KINETIC] = step, _kinetic(e, lanes)
                    tally[NEW_YIELDED] += 1
    soft, slots, edges = room
    width = U(12 if wide else 8)
    m = 0
    slot = head[b]
    while slot >= 0:
        edge = U(rows[slot // 3]) * width + U(2 * (slot % 3))
        if state[slot] > BROKEN:
            to, at = (A0, A1, A2)[slot % 3] + U(slot // 3 - first), 8 * kind[slot]
            fax, fay, fbx, fby = joints.sliding_edge(
                x, edge, U(partner[slot]), table[at : at + 8], beyond[at // 2 : at // 2 + 4], history[slot]
            )
            lanes[to], lanes[to + _NEXT], lanes[to + _B], lanes[to + _B + _NEXT] = fax, fay, fbx, fby
        else:
            slots[m], edges[m] = slot, edge
            m += 1
        slot = follow[slot]
    broken = softening.yielded_edges(
        m, slots, edges, x, partner, kind, state, table, beyond, history.reshape(history.size), soft
    )
    for q in range(m):
        e, k = slots[q] // 3 - first, slots[q] % 3
        out, q = (A0, A1, A2)[k] + U(e), U(q)
        lanes[out], lanes[out + _NEXT] = soft[softening.FAX + q], soft[softening.FAY + q]
        lanes[out + _B], lanes[out + _B + _NEXT] = soft[softening.FBX + q], soft[softening.FBY + q]
    for q in range(broken):
        slot = edges[q]
        history[slot, STEP], history[slot, KINETIC] = step, _kinetic(slot // 3 - first, lanes)
        tally[NEW_BROKEN] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _add_contacts(b, contact_begin, contact_lane, contact_slot, pushed, lanes):
    for m in range(contact_begin[b], contact_begin[b + 1]):
        e, slot = contact_lane[m], contact_slot[m]
        for c in range(6):
            lanes[FX1 + U(c * CAPACITY + e)] += pushed[slot, c]


@njit(cache=True, nogil=True, error_model="numpy")
def _store(n, first, rows, special, force, lanes):
    """Forces of triangles whose corners nodes.py moves."""
    for e in range(n):
        if special[first + e]:
            for c in range(6):
                force[rows[first + e], c] = lanes[FX1 + U(c * CAPACITY + e)]


@njit(cache=True, nogil=True, error_model="numpy")
def _store_joints(n, first, rows, force, lanes):
    """Sum of the joint forces on each corner, for the energy budget."""
    for e in range(U(n)):
        r = U(rows[first + np.int64(e)])
        for c in range(U(2)):
            way = c * U(CAPACITY) + e
            force[r, c] = lanes[A0 + way] + lanes[A2 + _B + way]
            force[r, c + _2] = lanes[A1 + way] + lanes[A0 + _B + way]
            force[r, c + _FOUR] = lanes[A2 + way] + lanes[A1 + _B + way]


def triangle_blocks(stress, more=0):
    """The work on all blocks of triangles. stress: a kernel like `_elastic_block`, which is handed the first argument;
    more: lanes that it needs besides."""
    size = (LANES + more) * CAPACITY

    @njit(nogil=True, error_model="numpy")
    def work(
        own_law, t, threads, count, rows, wide, x, v, c, s0, stressed, small, partner, law, kind, state, history, head,
        follow, table, beyond, contact_begin, contact_lane, contact_slot, pushed, special, some_special, force,
        of_joints, keep_joints, gx, gy, drag, beta, alpha, step, tally,
    ):  # fmt: skip
        lanes = np.zeros(size)
        x, v, c, s0 = x.reshape(x.size), v.reshape(v.size), c.reshape(c.size), s0.reshape(s0.size)
        flat_table, flat_beyond = table.reshape(table.size), beyond.reshape(beyond.size)
        room = softening.lanes_and_lists()
        blocks = len(head)
        for b in range(blocks * t // threads, blocks * (t + 1) // threads):
            first = b * BLOCK
            n = min(BLOCK, count - first)
            gather(n, first, rows, wide, x, v, c, s0, stressed, lanes)
            stress(b, n, first, rows, small, beta, own_law, lanes)
            _gather_edge(n, first, 0, x, partner, law, flat_table, lanes)
            _edge_loop_0(n, lanes)
            _gather_edge(n, first, 1, x, partner, law, flat_table, lanes)
            _edge_loop_1(n, lanes)
            _gather_edge(n, first, 2, x, partner, law, flat_table, lanes)
            _edge_loop_2(n, lanes)
            if head[b] >= 0 or _any_past_peak(n, lanes) < 0:
                _slow_joints(
                    b, n, first, rows, wide, x, partner, law, kind, state, history, head, follow, flat_table,
                    flat_beyond, step, lanes, room, tally[t],
                )  # fmt: skip
            if keep_joints:
                _store_joints(n, first, rows, of_joints, lanes)
            _sum(n, gx, gy, drag, lanes)
            _add_contacts(b, contact_begin, contact_lane, contact_slot, pushed, lanes)
            if some_special[b]:
                _store(n, first, rows, special, force, lanes)
            _kick(n, alpha, lanes)
            _put_velocities(n, first, rows, wide, v, lanes)

    return work


_triangles = triangle_blocks(_elastic_block)


@on_threads
def triangles(threads, *args):
    """Forces on the corners of all owned triangles at the present positions; corners that move by themselves are
    kicked, forces on the others are stored. Joint histories move on.

    count: triangles, in storage order; rows (count + 3,) i4: their storage rows; wide: x and v are (n, 12); c
    (count, 12), see `TRIANGLE`; s0 (count, 4) [Pa]: initial stress xx, yy, xy, zz, read if `stressed`; small: small
    strains; partner (3 count,) i4: where in x the partner's edge begins, law (3 count,) i4: row of the table of joint
    laws as long as the joint is before its peak, else 0; kind: that row whatever its state; state, history: see
    joints.py; head (blocks,), follow (3 count,) i4: lists of joints past their peak; contact_*: which contact forces
    `pushed` (k, 8) fall on which lane of which block; special (count,), some_special (blocks,) bool; force, of_joints
    (n, 8) [N/m]; drag [1/s], beta [s]: Rayleigh damping; alpha: local damping; tally (threads, 8) i8.
    """
    for t in prange(threads):
        _triangles(None, t, threads, *args)


# ---- quads ---------------------------------------------------------------------------------------------------------


# Lanes of quads: corners and velocities as above and those of the fourth, then the joint and the forces as above.
X4, Y4, VX4, VY4, FX4, FY4 = lane(6), lane(7), lane(14), lane(15), lane(46), lane(47)
QUAD_ROW = 66
"""First lane of the row of the table of quads, of which seven times four columns are needed."""
Q_C, Q_LAM, Q_MU2, Q_VISC, Q_FREED = (lane(QUAD_ROW + k) for k in (Q_INVERSE, Q_LAMBDA, Q_TWO_MU, Q_ETA, Q_FREE))
Q_M1, Q_M2, Q_M3, Q_M4 = (lane(QUAD_ROW + Q_WEIGHT + k) for k in range(4))
Q_LEFT0, Q_LEFT1, Q_LEFT2, Q_LEFT3 = (lane(QUAD_ROW + 28 + k) for k in range(4))
B1, B2, B3, B4 = (lane(QUAD_ROW + 32 + 2 * k) for k in range(4))
"""Forces of joints on the corners."""
Q_S0 = lane(QUAD_ROW + 40)
"""First lane of the stresses without strain: 11, 22, 12, 33 of each triangle."""
QUAD_LANES = QUAD_ROW + 56
Q_YIELD, Q_OUTSIDE = lane(QUAD_LANES), lane(QUAD_LANES + 16)
"""Of quads that can yield (plastic_quads.py): the yield surface of each triangle; by how much overlays are outside."""
YIELDING_LANES = QUAD_LANES + 18
QUAD_BLOCK = 48
"""Quads worked on together; they have fewer joints than `CAPACITY`."""


@njit(cache=True, nogil=True, error_model="numpy")
def _part(x1, y1, x2, y2, x3, y3, a, b, c, d, small):
    """Sides, rotation and strain of a triangle of a quad; a, b, c, d: the inverse of its reference matrix."""
    ux, uy, wx, wy = x2 - x1, y2 - y1, x3 - x1, y3 - y1
    f11, f12, f21, f22 = ux * a + wx * c, ux * b + wx * d, uy * a + wy * c, uy * b + wy * d
    cs, sn = laws.rotation(f11, f12, f21, f22)
    if small:
        cs, sn = 1.0, 0.0
        inverse = 1.0 / (a * d - b * c)
        ux, wx, uy, wy = d * inverse, -b * inverse, -c * inverse, a * inverse
    e11, e22, e12 = laws.stretch(f11, f12, f21, f22, cs, sn)
    return ux, uy, wx, wy, cs, sn, e11, e22, e12


@njit(cache=True, nogil=True, error_model="numpy")
def part_stretch(p, xy, c, small):
    """Return sides, rotation and strain of triangle p of a quad with corners xy (8,) and row c (32,) of the table."""
    i, j, k = 2 * PARTS[p, 0], 2 * PARTS[p, 1], 2 * PARTS[p, 2]
    return _part(
        xy[i], xy[i + 1], xy[j], xy[j + 1], xy[k], xy[k + 1], c[4 * p], c[4 * p + 1], c[4 * p + 2], c[4 * p + 3], small
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _rate(vx1, vy1, vx2, vy2, vx3, vy3, a, b, c, d, cs, sn):
    """Strain rate of a triangle of a quad in its turned frame."""
    ux, uy, wx, wy = vx2 - vx1, vy2 - vy1, vx3 - vx1, vy3 - vy1
    g11, g12, g21, g22 = ux * a + wx * c, ux * b + wx * d, uy * a + wy * c, uy * b + wy * d
    return cs * g11 + sn * g21, cs * g22 - sn * g12, 0.5 * ((cs * g12 + sn * g22) + (cs * g21 - sn * g11))


@njit(cache=True, nogil=True, error_model="numpy")
def _part_rate(p, vel, c, cs, sn):
    """Return the strain rate of triangle p of a quad with the velocities vel (8,) and the row c (32,) of the table."""
    i, j, k = 2 * PARTS[p, 0], 2 * PARTS[p, 1], 2 * PARTS[p, 2]
    return _rate(
        vel[i], vel[i + 1], vel[j], vel[j + 1], vel[k], vel[k + 1], c[4 * p], c[4 * p + 1], c[4 * p + 2], c[4 * p + 3],
        cs, sn,
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _part_forces(ux, uy, wx, wy, cs, sn, s11, s22, s12):
    """Forces of a triangle of a quad on its first two corners: half of those of its overlay, which are half of
    sigma n s each."""
    xx, yy, xy = laws.turned(s11, s22, s12, cs, sn)
    fx1, fy1 = 0.25 * (xx * (wy - uy) - xy * (wx - ux)), 0.25 * (xy * (wy - uy) - yy * (wx - ux))
    return fx1, fy1, 0.25 * (xy * wx - xx * wy), 0.25 * (yy * wx - xy * wy)


@njit(cache=True, error_model="numpy")
def elastic_pair(e, a11, a22, a12, b11, b22, b12, mean, one, two, dt, lanes):
    """Stress 11, 22, 12, 33 [Pa] of the two triangles of an overlay, a and b, without the initial one. mean: e11 + e22
    of both; one, two: their areas in the mesh."""
    pressure, two_mu = lanes[Q_LAM + e] * mean, lanes[Q_MU2 + e]
    across = pressure - lanes[Q_FREED + e] * pressure
    return (
        pressure + two_mu * a11, pressure + two_mu * a22, two_mu * a12, across,
        pressure + two_mu * b11, pressure + two_mu * b22, two_mu * b12, across,
    )  # fmt: skip


def overlay_loop(overlay, law=elastic_pair, reports_yield=False):
    """The loop that adds the forces of an overlay (0, 1) of quads, the triangles i, j, k and i, k, l. law: a kernel
    like `elastic_pair`; reports_yield: it also reports by how much the stress without the viscous part is outside.

    Mixed discretisation: strain per triangle, its volumetric part the mean of the overlay (Marti & Cundall 1982).
    """
    p, q = PARTS[2 * overlay : 2 * overlay + 2].tolist()
    (xi, xj, xk, xl), (vi, vj, vk, vl), (fi, fj, fk, fl) = (
        tuple(lane(first + 2 * corner) for corner in (*p, q[2])) for first in (0, 8, 40)
    )
    c1, c2 = (Q_C + lane(4 * part) for part in (2 * overlay, 2 * overlay + 1))
    area1, area2 = (lane(QUAD_ROW + Q_AREA + part) for part in (2 * overlay, 2 * overlay + 1))
    z1, z2 = (Q_S0 + lane(4 * part) for part in (2 * overlay, 2 * overlay + 1))
    l1, l2 = (Q_YIELD + lane(4 * part) for part in (2 * overlay, 2 * overlay + 1))
    out = Q_OUTSIDE + lane(overlay)
    first = overlay == 0

    @njit(nogil=True, error_model="numpy")
    def loop(n, small, beta, dt, lanes):
        for e in range(U(n)):
            x1, y1, x2, y2 = lanes[xi + e], lanes[xi + _NEXT + e], lanes[xj + e], lanes[xj + _NEXT + e]
            x3, y3, x4, y4 = lanes[xk + e], lanes[xk + _NEXT + e], lanes[xl + e], lanes[xl + _NEXT + e]
            a, b, c, d = lanes[c1 + e], lanes[c1 + _NEXT + e], lanes[c1 + _B + e], lanes[c1 + _B + _NEXT + e]
            f, g, h, m = lanes[c2 + e], lanes[c2 + _NEXT + e], lanes[c2 + _B + e], lanes[c2 + _B + _NEXT + e]
            ux1, uy1, wx1, wy1, cs1, sn1, a11, a22, a12 = _part(x1, y1, x2, y2, x3, y3, a, b, c, d, small)
            ux2, uy2, wx2, wy2, cs2, sn2, b11, b22, b12 = _part(x1, y1, x3, y3, x4, y4, f, g, h, m, small)
            lame, two_mu, eta = lanes[Q_LAM + e], lanes[Q_MU2 + e], lanes[Q_VISC + e]
            one, two = lanes[area1 + e], lanes[area2 + e]
            mean = (one * (a11 + a22) + two * (b11 + b22)) / (one + two)
            shift, other = 0.5 * (mean - (a11 + a22)), 0.5 * (mean - (b11 + b22))
            s11, s22, s12, s33, t11, t22, t12, t33 = law(
                e, a11 + shift, a22 + shift, a12, b11 + other, b22 + other, b12, mean, one, two, dt, lanes
            )
            s11, s22, s12 = lanes[z1 + e] + s11, lanes[z1 + _NEXT + e] + s22, lanes[z1 + _B + e] + s12
            t11, t22, t12 = lanes[z2 + e] + t11, lanes[z2 + _NEXT + e] + t22, lanes[z2 + _B + e] + t12
            s33, t33 = lanes[z1 + _B + _NEXT + e] + s33, lanes[z2 + _B + _NEXT + e] + t33
            if reports_yield:
                far = laws.outside(
                    s11, s22, s12, s33, lanes[l1 + e], lanes[l1 + _B + e], lanes[l1 + _B + _NEXT + e]
                )  # fmt: skip
                farther = laws.outside(
                    t11, t22, t12, t33, lanes[l2 + e], lanes[l2 + _B + e], lanes[l2 + _B + _NEXT + e]
                )  # fmt: skip
                lanes[out + e] = farther if farther > far else far
            x1, y1, x2, y2 = lanes[vi + e], lanes[vi + _NEXT + e], lanes[vj + e], lanes[vj + _NEXT + e]
            x3, y3, x4, y4 = lanes[vk + e], lanes[vk + _NEXT + e], lanes[vl + e], lanes[vl + _NEXT + e]
            a11, a22, a12 = _rate(x1, y1, x2, y2, x3, y3, a, b, c, d, cs1, sn1)
            b11, b22, b12 = _rate(x1, y1, x3, y3, x4, y4, f, g, h, m, cs2, sn2)
            rate = (one * (a11 + a22) + two * (b11 + b22)) / (one + two)
            eta, swell, shift = eta + beta * two_mu, beta * lame * rate, 0.5 * (rate - (a11 + a22))
            s11, s22 = s11 + (eta * (a11 + shift) + swell), s22 + (eta * (a22 + shift) + swell)
            shift = 0.5 * (rate - (b11 + b22))
            t11, t22 = t11 + (eta * (b11 + shift) + swell), t22 + (eta * (b22 + shift) + swell)
            s12, t12 = s12 + eta * a12, t12 + eta * b12
            ax1, ay1, ax2, ay2 = _part_forces(ux1, uy1, wx1, wy1, cs1, sn1, s11, s22, s12)
            bx1, by1, bx3, by3 = _part_forces(ux2, uy2, wx2, wy2, cs2, sn2, t11, t22, t12)
            if first:
                x1 = y1 = x2 = y2 = x3 = y3 = x4 = y4 = 0.0
            else:
                x1, y1, x2, y2 = lanes[fi + e], lanes[fi + _NEXT + e], lanes[fj + e], lanes[fj + _NEXT + e]
                x3, y3, x4, y4 = lanes[fk + e], lanes[fk + _NEXT + e], lanes[fl + e], lanes[fl + _NEXT + e]
            lanes[fi + e], lanes[fi + _NEXT + e] = (x1 + ax1) + bx1, (y1 + ay1) + by1
            lanes[fj + e], lanes[fj + _NEXT + e] = x2 + ax2, y2 + ay2
            lanes[fk + e], lanes[fk + _NEXT + e] = (x3 - (ax1 + ax2)) + bx3, (y3 - (ay1 + ay2)) + by3
            lanes[fl + e], lanes[fl + _NEXT + e] = x4 - (bx1 + bx3), y4 - (by1 + by3)

    return loop


overlay_loop_0, overlay_loop_1 = overlay_loop(0), overlay_loop(1)
_quad_edge_loop_0, _quad_edge_loop_1 = _edge_loop(X1, X2, A0, Q_LEFT0), _edge_loop(X2, X3, A1, Q_LEFT1)
_quad_edge_loop_2, _quad_edge_loop_3 = _edge_loop(X3, X4, A2, Q_LEFT2), _edge_loop(X4, X1, A3, Q_LEFT3)


@njit(cache=True, nogil=True, error_model="numpy")
def mean_trace(overlay, xy, c, small):
    """Mean by area of e11 + e22 over the two triangles of an overlay (0, 1) of a quad."""
    mean, area = 0.0, 0.0
    for p in (2 * overlay, 2 * overlay + 1):
        _, _, _, _, _, _, e11, e22, _ = part_stretch(p, xy, c, small)
        mean += c[Q_AREA + p] * (e11 + e22)
        area += c[Q_AREA + p]
    return mean / area


@njit(cache=True, nogil=True, error_model="numpy")
def quad_stress(xy, c, s0, small, stress):
    """Mean stress (4,) xx, yy, xy, zz [Pa] of a quad over its four triangles by area, without the viscous part; s0
    (16,) [Pa]: their stresses without strain."""
    stress[:] = 0.0
    areas = 0.0
    for overlay in range(2):
        mean = mean_trace(overlay, xy, c, small)
        for p in (2 * overlay, 2 * overlay + 1):
            _, _, _, _, cs, sn, e11, e22, e12 = part_stretch(p, xy, c, small)
            shift, m = 0.5 * (mean - (e11 + e22)), c[Q_TWO_MU]
            s11 = s0[4 * p] + (c[Q_LAMBDA] * mean + m * (e11 + shift))
            s22 = s0[4 * p + 1] + (c[Q_LAMBDA] * mean + m * (e22 + shift))
            xx, yy, xy_ = laws.turned(s11, s22, s0[4 * p + 2] + m * e12, cs, sn)
            share = c[Q_AREA + p]
            areas += share
            stress[0] += share * xx
            stress[1] += share * yy
            stress[2] += share * xy_
            stress[3] += share * (s0[4 * p + 3] + (1.0 - c[Q_FREE]) * (c[Q_LAMBDA] * mean))
    for q in range(4):
        stress[q] /= areas


@njit(cache=True, nogil=True, error_model="numpy")
def quad_energy(xy, c, s0, small):
    """Elastic energy [J/m] of a quad: the mean of its two overlays."""
    total = 0.0
    for overlay in range(2):
        mean = mean_trace(overlay, xy, c, small)
        for p in (2 * overlay, 2 * overlay + 1):
            _, _, _, _, _, _, e11, e22, e12 = part_stretch(p, xy, c, small)
            shift = 0.5 * (mean - (e11 + e22))
            density = _energy(e11 + shift, e22 + shift, e12, c[Q_LAMBDA], c[Q_TWO_MU], s0[4 * p : 4 * p + 4])
            total += 0.5 * c[Q_AREA + p] * density
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def _energy(e11, e22, e12, lam, two_mu, s0):
    """Elastic energy per volume [J/m3]: (sigma0 + sigma / 2) : epsilon."""
    trace = e11 + e22
    elastic = 0.5 * (lam * trace * trace + two_mu * (e11 * e11 + e22 * e22 + 2.0 * e12 * e12))
    return elastic + s0[0] * e11 + s0[1] * e22 + 2.0 * s0[2] * e12


@njit(cache=True, nogil=True, error_model="numpy")
def _quad_kinetic(c, vel):
    """Return the kinetic energy of a quad."""
    v2 = 0.0
    for m in range(4):
        v2 += c[Q_WEIGHT + m] * (vel[2 * m] ** 2 + vel[2 * m + 1] ** 2)
    return 0.5 * v2


@njit(cache=True, nogil=True, error_model="numpy")
def gather_stresses(n, item, s0, lanes):
    """Stresses without strain of quads into lanes; item (n,): places in s0."""
    for e in range(U(0), U(n), _FOUR):
        i0, i1, i2, i3 = U(item[e]), U(item[e + _1]), U(item[e + _2]), U(item[e + _3])
        at = (i0 * _SIXTEEN, i1 * _SIXTEEN, i2 * _SIXTEEN, i3 * _SIXTEEN)
        for k in range(U(0), _SIXTEEN, _FOUR):
            to = Q_S0 + k * U(CAPACITY) + e
            four_columns(lanes, to, s0, (at[0] + k, at[1] + k, at[2] + k, at[3] + k))


@njit(cache=True, nogil=True, error_model="numpy")
def gather_quads(n, item, row, x, v, c, s0, stressed, lanes):
    """Rows of quads into lanes, in groups of four; item, row (n,): places in the tables c and s0, and in x and v."""
    if stressed:
        gather_stresses(n, item, s0, lanes)
    for e in range(U(0), U(n), _FOUR):
        r0, r1, r2, r3 = U(row[e]), U(row[e + _1]), U(row[e + _2]), U(row[e + _3])
        at = (r0 * _TWELVE, r1 * _TWELVE, r2 * _TWELVE, r3 * _TWELVE)
        four_columns(lanes, X1 + e, x, at)
        four_columns(lanes, VX1 + e, v, at)
        at = (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR)
        four_columns(lanes, X3 + e, x, at)
        four_columns(lanes, VX3 + e, v, at)
        i0, i1, i2, i3 = U(item[e]), U(item[e + _1]), U(item[e + _2]), U(item[e + _3])
        at = (i0 * _QUAD, i1 * _QUAD, i2 * _QUAD, i3 * _QUAD)
        for k in range(U(0), U(28), _FOUR):
            to = Q_C + k * U(CAPACITY) + e
            four_columns(lanes, to, c, (at[0] + k, at[1] + k, at[2] + k, at[3] + k))


@njit(cache=True, nogil=True, error_model="numpy")
def _gather_quad_edge(n, item, base, k, x, partner, law, table, lanes):
    """The partners' edges and the laws of edge k."""
    for e in range(U(0), U(n), _FOUR):
        first = U(base + k)
        q0, q1 = first + _FOUR * U(item[e]), first + _FOUR * U(item[e + _1])
        q2, q3 = first + _FOUR * U(item[e + _2]), first + _FOUR * U(item[e + _3])
        four_columns(lanes, PX + e, x, (U(partner[q0]), U(partner[q1]), U(partner[q2]), U(partner[q3])))
        w0, w1, w2, w3 = U(law[q0]) * _EIGHT, U(law[q1]) * _EIGHT, U(law[q2]) * _EIGHT, U(law[q3]) * _EIGHT
        four_columns(lanes, KOP + e, table, (w0, w1, w2, w3))
        four_columns(lanes, COHESION + e, table, (w0 + _FOUR, w1 + _FOUR, w2 + _FOUR, w3 + _FOUR))


@njit(cache=True, nogil=True, error_model="numpy")
def _slow_quad_joints(
    n, first, rows, x, v, c, partner, law, kind, base, state, history, table, beyond, step, lanes, room, tally
):  # fmt: skip
    """Joints of n quads past their peak, and those that get there now."""
    soft, slots, edges = room
    m = 0
    for e in range(n):
        for k in range(4):
            slot = base + 4 * (first + e) + k
            if law[slot] != 0 and lanes[(Q_LEFT0, Q_LEFT1, Q_LEFT2, Q_LEFT3)[k] + U(e)] < 0.0:
                law[slot], state[slot] = 0, YIELDED
                history[slot] = 0.0
                history[slot, PEAK_STEP] = step
                history[slot, PEAK_KINETIC] = _quad_kinetic(c[first + e], v[rows[first + e]])
                tally[NEW_YIELDED] += 1
            edge = U(12) * U(rows[first + e]) + U(2 * k)
            if state[slot] > BROKEN:
                to, at = (A0, A1, A2, A3)[k] + U(e), 8 * kind[slot]
                fax, fay, fbx, fby = joints.sliding_edge(
                    x, edge, U(partner[slot]), table[at : at + 8], beyond[at // 2 : at // 2 + 4], history[slot]
                )
                lanes[to], lanes[to + _NEXT], lanes[to + _B], lanes[to + _B + _NEXT] = fax, fay, fbx, fby
            elif state[slot] > INTACT:
                slots[m], edges[m] = slot, edge
                m += 1
    broken = softening.yielded_edges(
        m, slots, edges, x, partner, kind, state, table, beyond, history.reshape(history.size), soft
    )
    for q in range(m):
        e, k = (slots[q] - base) // 4 - first, (slots[q] - base) % 4
        out, q = (A0, A1, A2, A3)[k] + U(e), U(q)
        lanes[out], lanes[out + _NEXT] = soft[softening.FAX + q], soft[softening.FAY + q]
        lanes[out + _B], lanes[out + _B + _NEXT] = soft[softening.FBX + q], soft[softening.FBY + q]
    for q in range(broken):
        slot = edges[q]
        i = (slot - base) // 4
        history[slot, STEP], history[slot, KINETIC] = step, _quad_kinetic(c[i], v[rows[i]])
        tally[NEW_BROKEN] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _sum_quads(n, gx, gy, drag, lanes):
    """Stress, gravity, drag on the mass, joints of each corner; edge k begins at corner k and ends at the next one."""
    for e in range(U(n)):
        bx1, by1 = lanes[A0 + e] + lanes[A3 + _B + e], lanes[A0 + _NEXT + e] + lanes[A3 + _B + _NEXT + e]
        bx2, by2 = lanes[A1 + e] + lanes[A0 + _B + e], lanes[A1 + _NEXT + e] + lanes[A0 + _B + _NEXT + e]
        bx3, by3 = lanes[A2 + e] + lanes[A1 + _B + e], lanes[A2 + _NEXT + e] + lanes[A1 + _B + _NEXT + e]
        bx4, by4 = lanes[A3 + e] + lanes[A2 + _B + e], lanes[A3 + _NEXT + e] + lanes[A2 + _B + _NEXT + e]
        lanes[B1 + e], lanes[B1 + _NEXT + e], lanes[B2 + e], lanes[B2 + _NEXT + e] = bx1, by1, bx2, by2
        lanes[B3 + e], lanes[B3 + _NEXT + e], lanes[B4 + e], lanes[B4 + _NEXT + e] = bx3, by3, bx4, by4
        lanes[FX1 + e] = (lanes[FX1 + e] + lanes[Q_M1 + e] * (gx - drag * lanes[VX1 + e])) + bx1
        lanes[FY1 + e] = (lanes[FY1 + e] + lanes[Q_M1 + e] * (gy - drag * lanes[VY1 + e])) + by1
        lanes[FX2 + e] = (lanes[FX2 + e] + lanes[Q_M2 + e] * (gx - drag * lanes[VX2 + e])) + bx2
        lanes[FY2 + e] = (lanes[FY2 + e] + lanes[Q_M2 + e] * (gy - drag * lanes[VY2 + e])) + by2
        lanes[FX3 + e] = (lanes[FX3 + e] + lanes[Q_M3 + e] * (gx - drag * lanes[VX3 + e])) + bx3
        lanes[FY3 + e] = (lanes[FY3 + e] + lanes[Q_M3 + e] * (gy - drag * lanes[VY3 + e])) + by3
        lanes[FX4 + e] = (lanes[FX4 + e] + lanes[Q_M4 + e] * (gx - drag * lanes[VX4 + e])) + bx4
        lanes[FY4 + e] = (lanes[FY4 + e] + lanes[Q_M4 + e] * (gy - drag * lanes[VY4 + e])) + by4


@njit(cache=True, nogil=True, error_model="numpy")
def _put_quads(n, row, at, force, lanes):
    """Eight lanes from `at` on into rows of forces (flat)."""
    for e in range(U(0), U(n), _FOUR):
        r0, r1, r2, r3 = U(row[e]), U(row[e + _1]), U(row[e + _2]), U(row[e + _3])
        to = (r0 * _EIGHT, r1 * _EIGHT, r2 * _EIGHT, r3 * _EIGHT)
        put_four_columns(force, to, lanes, at + e)
        to = (to[0] + _FOUR, to[1] + _FOUR, to[2] + _FOUR, to[3] + _FOUR)
        put_four_columns(force, to, lanes, at + U(4 * CAPACITY) + e)


@njit(cache=True, nogil=True, error_model="numpy")
def finish_quads(
    first, n, item, row, tied, rows, x, v, c, base, partner, law, kind, state, history, table, beyond, slot_of, pushed,
    force, of_joints, keep_joints, gx, gy, drag, step, lanes, room, tally,
):  # fmt: skip
    """Joints, gravity and contacts of a block of quads whose forces of stress are in the lanes, and the sum of all; x,
    table, beyond, force, of_joints: flat; tied: the block before had joints. Returns whether this one has."""
    whole = (n + 3) // 4 * 4
    if tied:
        lanes[A0 : A0 + U(16 * CAPACITY)] = 0.0
    some = latest = np.uint8(NONE)
    for slot in range(base + 4 * first, base + 4 * (first + n)):
        some, latest = some | state[slot], max(latest, state[slot])
    tied = some != NONE
    if tied:
        _gather_quad_edge(whole, item, base, 0, x, partner, law, table, lanes)
        _quad_edge_loop_0(whole, lanes)
        _gather_quad_edge(whole, item, base, 1, x, partner, law, table, lanes)
        _quad_edge_loop_1(whole, lanes)
        _gather_quad_edge(whole, item, base, 2, x, partner, law, table, lanes)
        _quad_edge_loop_2(whole, lanes)
        _gather_quad_edge(whole, item, base, 3, x, partner, law, table, lanes)
        _quad_edge_loop_3(whole, lanes)
        if latest > INTACT or _any_quad_past_peak(n, lanes) < 0:
            _slow_quad_joints(
                n, first, rows, x, v, c, partner, law, kind, base, state, history, table, beyond, step, lanes, room,
                tally,
            )  # fmt: skip
    _sum_quads(whole, gx, gy, drag, lanes)
    for e in range(n):
        slot = slot_of[first + e]
        if slot >= 0:
            for m in range(FORCE):
                lanes[FX1 + U(m * CAPACITY + e)] += pushed[slot, m]
    # The last quad may be in its group several times: all of them must be alike.
    for e in range(n, whole):
        for m in range(FORCE):
            lanes[FX1 + U(m * CAPACITY + e)] = lanes[FX1 + U(m * CAPACITY + n - 1)]
            lanes[B1 + U(m * CAPACITY + e)] = lanes[B1 + U(m * CAPACITY + n - 1)]
    _put_quads(whole, row, FX1, force, lanes)
    if keep_joints:
        _put_quads(whole, row, B1, of_joints, lanes)
    return tied


@njit(cache=True, nogil=True, error_model="numpy")
def name_quads(first, n, rows, item, row):
    """Places of the quads first : first + n in their tables and in x, the last one again up to a multiple of four."""
    for e in range((n + 3) // 4 * 4):
        item[e] = first + min(e, n - 1)
        row[e] = rows[item[e]]


@njit(cache=True, nogil=True, error_model="numpy")
def _elastic_quads(n, item, row, small, beta, law, lanes):
    """Corner forces of a block of elastic quads."""
    overlay_loop_0(n, small, beta, 0.0, lanes)
    overlay_loop_1(n, small, beta, 0.0, lanes)


def quad_blocks(stress, more=0):
    """The work on all blocks of quads. stress: a kernel like `_elastic_quads`, which is handed the first argument;
    more: lanes that it needs besides."""
    size = (QUAD_LANES + more) * CAPACITY

    @njit(nogil=True, error_model="numpy")
    def work(
        own_law, t, threads, count, rows, x, v, c, s0, stressed, small, base, partner, law, kind, state, history, table,
        beyond, slot_of, pushed, force, of_joints, keep_joints, gx, gy, drag, beta, step, tally,
    ):  # fmt: skip
        lanes = np.zeros(size)
        item, row = np.empty(QUAD_BLOCK, np.int64), np.empty(QUAD_BLOCK, np.int64)
        flat_x, flat_v, flat_c, flat_s0 = x.reshape(x.size), v.reshape(v.size), c.reshape(c.size), s0.reshape(s0.size)
        flat_table, flat_beyond = table.reshape(table.size), beyond.reshape(beyond.size)
        flat_force, flat_of_joints = force.reshape(force.size), of_joints.reshape(of_joints.size)
        room = softening.lanes_and_lists()
        begin, end = count * t // threads, count * (t + 1) // threads
        tied = False
        for first in range(begin, end, QUAD_BLOCK):
            n = min(QUAD_BLOCK, end - first)
            whole = (n + 3) // 4 * 4
            name_quads(first, n, rows, item, row)
            gather_quads(whole, item, row, flat_x, flat_v, flat_c, flat_s0, stressed, lanes)
            stress(whole, item, row, small, beta, own_law, lanes)
            tied = finish_quads(
                first, n, item, row, tied, rows, flat_x, v, c, base, partner, law, kind, state, history, flat_table,
                flat_beyond, slot_of, pushed, flat_force, flat_of_joints, keep_joints, gx, gy, drag, step, lanes, room,
                tally[t],
            )  # fmt: skip

    return work


_quads = quad_blocks(_elastic_quads)


@on_threads
def quads(threads, *args):
    """Forces on the corners of all owned quads, stored. Arguments as for `triangles`; c (count, 32), see `QUAD`; s0
    (count, 16) [Pa]: stress without strain 11, 22, 12, 33 of each of their triangles; the slots of the quads' edges
    follow those of the triangles from `base` on, four each; slot_of (count,) i4: row of `pushed`, or -1."""
    for t in prange(threads):
        _quads(None, t, threads, *args)


# ---- motion --------------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def _drift(t, threads, first, last, x, v, dt):
    wide = x.shape[1] == 12
    n = last - first
    for r in range(U(first + n * t // threads), U(first + n * (t + 1) // threads)):
        if wide:
            for c in range(12):
                x[r, c] += v[r, c] * dt
        else:
            x1, y1 = x[r, 0] + v[r, 0] * dt, x[r, 1] + v[r, 1] * dt
            x[r, 0], x[r, 1] = x1, y1
            for c in range(2, 6):
                x[r, c] += v[r, c] * dt
            x[r, 6], x[r, 7] = x1, y1


@on_threads
def drift(threads, *args):
    """x += v dt for the storage rows first : last."""
    for t in prange(threads):
        _drift(t, threads, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def triangle_stretch(xy, c, small):
    """Rotation (cos, sin) and strain (11, 22, 12) of a triangle with the corners xy (6,)."""
    ux, uy, wx, wy = xy[2] - xy[0], xy[3] - xy[1], xy[4] - xy[0], xy[5] - xy[1]
    f11, f12 = ux * c[0] + wx * c[2], ux * c[1] + wx * c[3]
    f21, f22 = uy * c[0] + wy * c[2], uy * c[1] + wy * c[3]
    cs, sn = laws.rotation(f11, f12, f21, f22)
    if small:
        cs, sn = 1.0, 0.0
    e11, e22, e12 = laws.stretch(f11, f12, f21, f22, cs, sn)
    return cs, sn, e11, e22, e12


@njit(cache=True, nogil=True, error_model="numpy")
def triangle_stress(xy, c, s0, small, stress):
    """Stress (4,) xx, yy, xy, zz [Pa] of a triangle with the corners xy (6,), without the viscous part."""
    cs, sn, e11, e22, e12 = triangle_stretch(xy, c, small)
    p, m = c[LAMBDA] * (e11 + e22), c[TWO_MU]
    stress[0], stress[1], stress[2] = laws.turned(s0[0] + (p + m * e11), s0[1] + (p + m * e22), s0[2] + m * e12, cs, sn)
    stress[3] = s0[3] + (1.0 - c[FREE]) * p


@njit(cache=True, nogil=True, error_model="numpy")
def triangle_energy(xy, c, s0, small):
    """Elastic energy per area [J/m3] of a triangle."""
    _, _, e11, e22, e12 = triangle_stretch(xy, c, small)
    return _energy(e11, e22, e12, c[LAMBDA], c[TWO_MU], s0)

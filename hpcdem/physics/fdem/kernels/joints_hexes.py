"""Joints between hexahedra: each half of a side, a triangle, is a joint with the law and the memory of those between
tetrahedra (joints_space.py). Only what lies between the corners is different: over the side the opening is bilinear,
as the corners of the quad have it, so that a uniform traction pushes on the corners as the stress of hexahedra does,
by quarters on a parallelogram; of triangles alone it would be thirds and sixths.

With l_0, l_1, l_2 the shape functions of a triangle, 1 the corner that only this half has, and u the opening at the
four corners of the side (3: the corner that only the other half has), at any point of it

    u = sum l_i u_i - l_0 l_2 w,    w = sum g_i u_i,    g = 2 (A_2, -A_3, A_0, -A_1) / A

A_i: triangle of the side at its corner i, A = A_0 + A_2 = A_1 + A_3. Of any linear opening w is zero; on a
parallelogram u is the bilinear one, on every flat quad a uniform traction gives (A_i + A) / 6 to its corners, which is
the mean of both ways to cut it. At the three Gauss points that is the opening of a triangle whose corners have
u_i - e_i w, e = (5, -1, 5) / 36: so corners are moved, by halves on both sides, and the loops of joints_space.py do
the rest. Forces go back the same way.

Everything is written so that the other side gets the opposite forces bit for bit, as there.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import U, four_columns, lane
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem.kernels import joint_law, joints_space
from hpcdem.physics.fdem.kernels.elements import NEW_BROKEN, NEW_YIELDED
from hpcdem.physics.fdem.kernels.hexes import H_MASS
from hpcdem.physics.fdem.kernels.joint_law import KINETIC, PEAK_KINETIC, PEAK_STEP, STEP
from hpcdem.physics.fdem.kernels.joints import BROKEN, INTACT, YIELDED
from hpcdem.physics.fdem.kernels.joints_space import LAW, LEFT, PER_H, J, P
from hpcdem.physics.fdem.tetrahedra import FACES, STRIDE

BLOCK = 32
CORNERS, WEIGHTS = 8, 8
"""Columns of the tables of halves: where corners begin in x, a, b, c of the half on this side and d, the other one of
the side, then those opposite to them; g of these four, e of the first three, and 1 / h [1/m]."""
PER_LENGTH = 7

# Lanes of a block, in the places of those of tets.py: the corners a, b, c of face 0, moved; corners and weights.
A, B, C = (lane(STRIDE * int(corner)) for corner in FACES[0])
NEAR, FAR, W = lane(16), lane(32), lane(48)
_NEXT = lane(1)
_4, _8 = U(4), U(8)


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(n, first, at, weights, law, x, table, lanes):
    """Corners, weights and laws (n + 3,) of n halves."""
    for e in range(U(0), U(n), _4):
        i = first + np.int64(e)
        for m in range(CORNERS):
            of = U(at[i, m]), U(at[i + 1, m]), U(at[i + 2, m]), U(at[i + 3, m])
            four_columns(lanes, NEAR + U(STRIDE * m) * _NEXT + e, x, of)
        q = U(i) * U(WEIGHTS)
        of = q, q + U(WEIGHTS), q + U(2 * WEIGHTS), q + U(3 * WEIGHTS)
        four_columns(lanes, W + e, weights, of)
        four_columns(lanes, W + _4 * _NEXT + e, weights, (of[0] + _4, of[1] + _4, of[2] + _4, of[3] + _4))
        k = np.int64(e)
        rows = U(law[k]) * _8, U(law[k + 1]) * _8, U(law[k + 2]) * _8, U(law[k + 3]) * _8
        four_columns(lanes, LAW + e, table, rows)
        four_columns(lanes, LAW + _4 * _NEXT + e, table, (rows[0] + _4, rows[1] + _4, rows[2] + _4, rows[3] + _4))


@njit(cache=True, error_model="numpy", forceinline=True)
def _weights(e, lanes):
    return (
        lanes[W + e], lanes[W + _NEXT + e], lanes[W + U(2) * _NEXT + e], lanes[W + U(3) * _NEXT + e],
        lanes[W + _4 * _NEXT + e], lanes[W + U(5) * _NEXT + e], lanes[W + U(6) * _NEXT + e],
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def _half_w(a, b, c, d, p, r, q, s, ga, gb, gc, gd):
    return 0.5 * ((ga * (p - a) + (gb * (r - b) + gc * (q - c))) + gd * (s - d))


@njit(cache=True, nogil=True, error_model="numpy")
def _move(n, lanes):
    """Corners of this side and of the other one (opposite a, c, b) where the joints of triangles look for them."""
    for axis in range(U(3)):
        near, far = NEAR + axis * _NEXT, FAR + axis * _NEXT
        for e in range(U(n)):
            a, b, c = lanes[near + e], lanes[near + _4 * _NEXT + e], lanes[near + _8 * _NEXT + e]
            p, r, q = lanes[far + e], lanes[far + _4 * _NEXT + e], lanes[far + _8 * _NEXT + e]
            d, s = lanes[near + U(12) * _NEXT + e], lanes[far + U(12) * _NEXT + e]
            ga, gb, gc, gd, ea, eb, ec = _weights(e, lanes)
            w = _half_w(a, b, c, d, p, r, q, s, ga, gb, gc, gd)
            to = axis * _NEXT + e
            lanes[A + to], lanes[B + to], lanes[C + to] = a + ea * w, b + eb * w, c + ec * w
            lanes[P + to], lanes[P + _4 * _NEXT + to], lanes[P + _8 * _NEXT + to] = p - ea * w, q - ec * w, r - eb * w
    for e in range(U(n)):
        lanes[PER_H + e] = lanes[W + U(PER_LENGTH) * _NEXT + e]


@njit(cache=True, nogil=True, error_model="numpy")
def _share(n, lanes):
    """Forces of the corners that were moved, from J on, to those of the side; the fourth behind them."""
    for axis in range(U(3)):
        for e in range(U(n)):
            at = J + axis * _NEXT + e
            fa, fb, fc = lanes[at], lanes[at + U(3) * _NEXT], lanes[at + U(6) * _NEXT]
            ga, gb, gc, gd, ea, eb, ec = _weights(e, lanes)
            back = ea * fa + (eb * fb + ec * fc)
            lanes[at], lanes[at + U(3) * _NEXT], lanes[at + U(6) * _NEXT] = (
                fa - ga * back, fb - gb * back, fc - gc * back,
            )  # fmt: skip
            lanes[NEAR + axis * _NEXT + e] = -gd * back


@njit(cache=True, error_model="numpy", forceinline=True)
def _add_one(to, k, force, lanes):
    force[to] += lanes[k]
    force[to + U(1)] += lanes[k + _NEXT]
    force[to + U(2)] += lanes[k + U(2) * _NEXT]


@njit(cache=True, nogil=True, error_model="numpy")
def _add(n, first, at, force, lanes):
    """Forces of n halves to those of their corners, one half after the other."""
    for e in range(U(n)):
        i = U(first) + e
        _add_one(U(at[i, U(0)]), J + e, force, lanes)
        _add_one(U(at[i, U(1)]), J + U(3) * _NEXT + e, force, lanes)
        _add_one(U(at[i, U(2)]), J + U(6) * _NEXT + e, force, lanes)
        _add_one(U(at[i, U(3)]), NEAR + e, force, lanes)


@njit(cache=True, nogil=True, error_model="numpy")
def _kinetic(i, place, h, v):
    """Kinetic energy [J] of a hexahedron at the half step before."""
    found = 0.0
    for k in range(8):
        at = place[i, k]
        found += h[i, H_MASS + k] * (v[at] ** 2 + (v[at + 1] ** 2 + v[at + 2] ** 2))
    return 0.5 * found


@njit(cache=True, nogil=True, error_model="numpy")
def _slow(
    n, first, slot, hexahedron, weights, place, h, v, kind, state, history, table, beyond, step, lanes, room, tally
):  # fmt: skip
    """Joints past their peak, and those that get there now."""
    own, over, out, part, moved = room
    for e in range(n):
        s, k = slot[first + e], U(e)
        if state[s] == INTACT and lanes[LEFT + k] < 0.0:
            state[s] = YIELDED
            history[s, PEAK_STEP], history[s, PEAK_KINETIC] = step, _kinetic(hexahedron[first + e], place, h, v)
            tally[NEW_YIELDED] += 1
        if state[s] <= INTACT:
            continue
        for m in range(3):
            for axis in range(3):
                to = U(axis) * _NEXT + k
                moved[STRIDE * m + axis] = lanes[(A if m == 0 else (B if m == 1 else C)) + to]
                moved[12 + STRIDE * m + axis] = lanes[P + U(STRIDE * m) * _NEXT + to]
        remembered = history[s]
        joints_space.face_now(
            moved, own, over, weights[first + e, PER_LENGTH], table[kind[s]], beyond[kind[s]], remembered, part, out
        )
        for m in range(9):
            lanes[J + U(m) * _NEXT + k] = out[m]
        if state[s] == YIELDED and joint_law.breaks(remembered, part[0], part[1]):
            state[s] = BROKEN
            remembered[STEP], remembered[KINETIC] = step, _kinetic(hexahedron[first + e], place, h, v)
            tally[NEW_BROKEN] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _forces(
    t, threads, begin, slot, hexahedron, at, weights, place, h, x, v, kind, state, history, table, beyond, keep,
    of_joints, force, step, tally,
):  # fmt: skip
    lanes = np.zeros(joints_space.LANES * np.int64(_NEXT))
    x, v, force = x.reshape(x.size), v.reshape(v.size), force.reshape(force.size)
    of_joints = of_joints.reshape(of_joints.size)
    flat_weights, flat_table = weights.reshape(weights.size), table.reshape(table.size)
    law = np.zeros(BLOCK + 3, np.int32)
    room = np.array([0, 4, 8]), np.array([12, 16, 20], np.int32), np.empty(22), np.empty(2), np.empty(24)
    hexahedra = len(begin) - 1
    last = begin[hexahedra * (t + 1) // threads]
    first = begin[hexahedra * t // threads]
    while first < last:
        n = min(BLOCK, last - first)
        behind = False
        for e in range(n):
            s = slot[first + e]
            law[e] = kind[s] if state[s] == INTACT else 0
            behind |= state[s] > INTACT
        for e in range(n, n + 3):
            law[e] = 0
        _gather(n, first, at, flat_weights, law, x, flat_table, lanes)
        _move(n, lanes)
        joints_space._loop_0(n, lanes)
        if behind or joints_space._any_past_peak(n, lanes) < 0:
            _slow(
                n, first, slot, hexahedron, weights, place, h, v, kind, state, history, table, beyond, step, lanes,
                room, tally[t],
            )  # fmt: skip
        _share(n, lanes)
        _add(n, first, at, force, lanes)
        if keep:
            _add(n, first, at, of_joints, lanes)
        first += n


@on_threads
def forces(threads, *args):
    """Add the forces of joints on sides of hexahedra to those of their corners; histories move on.

    begin (count + 1,): which halves of sides belong to each hexahedron; of these slot (m,), hexahedron (m,), at
    (m + 3, 8) i4 and weights (m + 3, 8), see `CORNERS`; place, h: see `hexes.forces`; kind, state, history, table,
    beyond, step, tally: see `tets.forces`; x, v, force (n, 16); keep: to of_joints (n, 16) [N] too.
    """
    for t in prange(threads):
        _forces(t, threads, *args)

"""A joint between two faces of tetrahedra: where its three Gauss points are, what is there, and the loops over joints.
What joints.py, softening.py and parts of build.py are in the plane; laws and what a joint remembers are the same.

Both faces begin at the same point (`tetrahedra.canonical`) and run opposite ways: a of this side is opposite p, b
opposite r, c opposite q. Mid-surface, opening o and slip s (a vector, the other side minus this one) are those of the
present positions; the joint's length h is the root of its area in the mesh. Gauss points lie at two thirds of the way
to each corner. The shear stress acts along the present slip, so that modes II and III are one law of its size.

Everything is written so that the other side, for which a, b, c and p, q, r have changed places, gets the opposite
forces bit for bit: sums of two are commutative, and sums of three are first + (second + third).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.numerics.lanes import U, four_columns, lane
from hpcdem.physics.fdem.kernels import joint_law, laws
from hpcdem.physics.fdem.kernels.elements import NEW_BROKEN, NEW_YIELDED
from hpcdem.physics.fdem.kernels.joint_law import (
    COHESIVE,
    DAMAGE,
    HISTORY,
    KINETIC,
    OPENED,
    OWN,
    PATH,
    PEAK_KINETIC,
    PEAK_STEP,
    SLIPPED,
    STAYS,
    STAYS_TOO,
    STEP,
)
from hpcdem.physics.fdem.kernels.joints import BROKEN, INTACT, NONE, YIELDED
from hpcdem.physics.fdem.tetrahedra import FACES, ROW, STRIDE

SIXTH, HALF = 1.0 / 6.0, 0.5
"""A value at a Gauss point: a sixth of the sum over the corners and half of the one at the near corner."""

# Lanes behind them: partner's corners, law, 1 / h of the four faces, forces on a, b, c, and how much is
# left to the peak.
FIRST = 72
"""So many lanes are those of tets.py, the first sixteen of them corners."""
P, LAW, PER_H, J, LEFT = lane(FIRST), lane(FIRST + 12), lane(FIRST + 20), lane(FIRST + 24), lane(FIRST + 33)
LANES = FIRST + 34
_NEXT = lane(1)
_1, _2, _3, _4, _8 = (U(k) for k in (1, 2, 3, 4, 8))


@njit(cache=True, error_model="numpy", forceinline=True)
def opened(ax, ay, az, bx, by, bz, cx, cy, cz, px, py, pz, qx, qy, qz, rx, ry, rz):
    """Unit normal from this side to the other, area [m2], and what the other side is away at the Gauss points near a,
    b and c [m]."""
    mx, my, mz = ax + px, ay + py, az + pz
    ux, uy, uz = 0.5 * ((bx + rx) - mx), 0.5 * ((by + ry) - my), 0.5 * ((bz + rz) - mz)
    wx, wy, wz = 0.5 * ((cx + qx) - mx), 0.5 * ((cy + qy) - my), 0.5 * ((cz + qz) - mz)
    nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
    size = math.sqrt(nx * nx + (ny * ny + nz * nz))
    inverse = 1.0 / (size + laws.TINY)
    d0x, d0y, d0z = px - ax, py - ay, pz - az
    d1x, d1y, d1z = rx - bx, ry - by, rz - bz
    d2x, d2y, d2z = qx - cx, qy - cy, qz - cz
    sx, sy, sz = SIXTH * (d0x + (d1x + d2x)), SIXTH * (d0y + (d1y + d2y)), SIXTH * (d0z + (d1z + d2z))
    return (
        nx * inverse, ny * inverse, nz * inverse, 0.5 * size,
        sx + HALF * d0x, sy + HALF * d0y, sz + HALF * d0z,
        sx + HALF * d1x, sy + HALF * d1y, sz + HALF * d1z,
        sx + HALF * d2x, sy + HALF * d2y, sz + HALF * d2z,
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def parted(dx, dy, dz, nx, ny, nz):
    """Opening, slip and its size [m]."""
    o = dx * nx + (dy * ny + dz * nz)
    sx, sy, sz = dx - o * nx, dy - o * ny, dz - o * nz
    return o, sx, sy, sz, math.sqrt(sx * sx + (sy * sy + sz * sz))


@njit(cache=True, error_model="numpy", forceinline=True)
def _intact(dx, dy, dz, nx, ny, nz, per_h, kop, tensile, overlay, tan_phi, cohesion, half_shear):
    """Traction at a point before its peak [Pa], and how much is left to it."""
    o, sx, sy, sz, size = parted(dx, dy, dz, nx, ny, nz)
    sigma, tau, left = joint_law.intact_point(
        o * per_h, size * per_h, kop, tensile, overlay, tan_phi, cohesion, half_shear
    )
    along = abs(tau) / (size + laws.TINY)
    return sigma * nx + along * sx, sigma * ny + along * sy, sigma * nz + along * sz, left


@njit(cache=True, error_model="numpy", forceinline=True)
def _corner_forces(area, t0, t1, t2):
    """Forces [N] along one axis on the corners from the tractions at their points: int N_i t dA."""
    third = area / 3.0
    both = SIXTH * (t0 + (t1 + t2))
    return third * (both + HALF * t0), third * (both + HALF * t1), third * (both + HALF * t2)


def face_loop(k):
    """The loop over the joints on face k of a block of tetrahedra, before their peak; forces into the lanes from J on.
    One function each: distances between lanes must be constants."""
    a, b, c = (lane(STRIDE * int(corner)) for corner in FACES[k])
    size = PER_H + lane(k)

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(n, lanes):
        for e in range(U(n)):
            nx, ny, nz, area, d0x, d0y, d0z, d1x, d1y, d1z, d2x, d2y, d2z = opened(
                lanes[a + e], lanes[a + _NEXT + e], lanes[a + _2 * _NEXT + e],
                lanes[b + e], lanes[b + _NEXT + e], lanes[b + _2 * _NEXT + e],
                lanes[c + e], lanes[c + _NEXT + e], lanes[c + _2 * _NEXT + e],
                lanes[P + e], lanes[P + _NEXT + e], lanes[P + _2 * _NEXT + e],
                lanes[P + _4 * _NEXT + e], lanes[P + U(5) * _NEXT + e], lanes[P + U(6) * _NEXT + e],
                lanes[P + _8 * _NEXT + e], lanes[P + U(9) * _NEXT + e], lanes[P + U(10) * _NEXT + e],
            )  # fmt: skip
            per_h, kop, tensile = lanes[size + e], lanes[LAW + e], lanes[LAW + _NEXT + e]
            overlay, tan_phi = lanes[LAW + _2 * _NEXT + e], lanes[LAW + _3 * _NEXT + e]
            cohesion, half_shear = lanes[LAW + _4 * _NEXT + e], lanes[LAW + U(5) * _NEXT + e]
            t0x, t0y, t0z, left0 = _intact(
                d0x, d0y, d0z, nx, ny, nz, per_h, kop, tensile, overlay, tan_phi, cohesion, half_shear
            )
            t1x, t1y, t1z, left1 = _intact(
                d1x, d1y, d1z, nx, ny, nz, per_h, kop, tensile, overlay, tan_phi, cohesion, half_shear
            )
            t2x, t2y, t2z, left2 = _intact(
                d2x, d2y, d2z, nx, ny, nz, per_h, kop, tensile, overlay, tan_phi, cohesion, half_shear
            )
            f0, f1, f2 = _corner_forces(area, t0x, t1x, t2x)
            lanes[J + e], lanes[J + _3 * _NEXT + e], lanes[J + U(6) * _NEXT + e] = f0, f1, f2
            f0, f1, f2 = _corner_forces(area, t0y, t1y, t2y)
            lanes[J + _NEXT + e], lanes[J + _4 * _NEXT + e], lanes[J + U(7) * _NEXT + e] = f0, f1, f2
            f0, f1, f2 = _corner_forces(area, t0z, t1z, t2z)
            lanes[J + _2 * _NEXT + e], lanes[J + U(5) * _NEXT + e], lanes[J + _8 * _NEXT + e] = f0, f1, f2
            left = left0 if left0 < left1 else left1
            lanes[LEFT + e] = left if left < left2 else left2

    return loop


def face_sum(k):
    """The loop that adds the forces of face k to those of the corners, from the lane `first` on."""
    of = tuple(lane(STRIDE * int(corner)) for corner in FACES[k])
    a, b, c = of

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(n, first, lanes):
        for e in range(U(n)):
            for m in range(_3):
                lanes[first + a + m * _NEXT + e] += lanes[J + m * _NEXT + e]
                lanes[first + b + m * _NEXT + e] += lanes[J + (_3 + m) * _NEXT + e]
                lanes[first + c + m * _NEXT + e] += lanes[J + (U(6) + m) * _NEXT + e]

    return loop


_loop_0, _loop_1, _loop_2, _loop_3 = (face_loop(k) for k in range(4))
_sum_0, _sum_1, _sum_2, _sum_3 = (face_sum(k) for k in range(4))


@njit(cache=True, nogil=True, error_model="numpy")
def gather_face(n, first, k, x, link, law, table, lanes):
    """Partners' corners and laws of face k; x, link, table: flat."""
    for e in range(U(0), U(n), _4):
        q0 = (U(first) + e) * _4 + U(k)
        q1, q2, q3 = q0 + _4, q0 + _8, q0 + U(12)
        for m in range(_3):
            at = (
                U(link[q0 * _3 + m]), U(link[q1 * _3 + m]), U(link[q2 * _3 + m]), U(link[q3 * _3 + m])
            )  # fmt: skip
            four_columns(lanes, P + m * _4 * _NEXT + e, x, at)
        w0, w1, w2, w3 = U(law[q0]) * _8, U(law[q1]) * _8, U(law[q2]) * _8, U(law[q3]) * _8
        four_columns(lanes, LAW + e, table, (w0, w1, w2, w3))
        four_columns(lanes, LAW + _4 * _NEXT + e, table, (w0 + _4, w1 + _4, w2 + _4, w3 + _4))


@njit(cache=True, nogil=True, error_model="numpy")
def _any_past_peak(n, lanes):
    """Negative if a joint of the block has passed its peak."""
    bits = lanes.view(np.int64)
    found = np.int64(0)
    for e in range(U(n)):
        found |= bits[LEFT + e]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def mid_edges(x, a, b, c, p, q, r):
    """Edges of the mid-surface from the corner of a to those of b and c [m], which change places from the other side;
    corners: where they begin in flat x."""
    return (
        0.5 * ((x[b] + x[r]) - (x[a] + x[p])), 0.5 * ((x[b + 1] + x[r + 1]) - (x[a + 1] + x[p + 1])),
        0.5 * ((x[b + 2] + x[r + 2]) - (x[a + 2] + x[p + 2])), 0.5 * ((x[c] + x[q]) - (x[a] + x[p])),
        0.5 * ((x[c + 1] + x[q + 1]) - (x[a + 1] + x[p + 1])), 0.5 * ((x[c + 2] + x[q + 2]) - (x[a + 2] + x[p + 2])),
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def unloaded(sx, sy, sz, size, mid, law, history, g):
    """Slip and its size [m] at point g less the part that stays; mid: see `mid_edges`."""
    if law[joint_law.LAW] == COHESIVE:
        return sx, sy, sz, size
    along, too = history[STAYS + g], history[STAYS_TOO + g]
    sx -= along * mid[0] + too * mid[3]
    sy -= along * mid[1] + too * mid[4]
    sz -= along * mid[2] + too * mid[5]
    return sx, sy, sz, math.sqrt(sx * sx + (sy * sy + sz * sz))


@njit(cache=True, nogil=True, error_model="numpy")
def _slides(dx, dy, dz, nx, ny, nz, mid, law, beyond, history, g):
    """Traction at point g of a joint that slides [Pa]; what it remembers moves on."""
    o, sx, sy, sz, size = parted(dx, dy, dz, nx, ny, nz)
    sx, sy, sz, size = unloaded(sx, sy, sz, size, mid, law, history, g)
    sigma, tau, more, own, path = joint_law.slide(o, size, law, beyond, history[OWN + g], history[PATH + g])
    along = tau / (size + laws.TINY)
    if more > 0.0:
        ux, uy, uz, wx, wy, wz = mid
        uu, ww = ux * ux + (uy * uy + uz * uz), wx * wx + (wy * wy + wz * wz)
        uw, scale = ux * wx + (uy * wy + uz * wz), more / (size + laws.TINY)
        su, sw = sx * ux + (sy * uy + sz * uz), sx * wx + (sy * wy + sz * wz)
        scale /= uu * ww - uw * uw
        history[STAYS + g] += scale * (ww * su - uw * sw)
        history[STAYS_TOO + g] += scale * (uu * sw - uw * su)
    history[OWN + g], history[PATH + g] = own, path
    return sigma * nx + along * sx, sigma * ny + along * sy, sigma * nz + along * sz


@njit(cache=True, nogil=True, error_model="numpy")
def _behind(dx, dy, dz, nx, ny, nz, h, mid, law, beyond, history, g, part):
    """Traction at point g past the peak [Pa]; updates the history; part (2,): largest squares of both parts
    of the damage."""
    if law[joint_law.LAW] > COHESIVE:
        return _slides(dx, dy, dz, nx, ny, nz, mid, law, beyond, history, g)
    o, sx, sy, sz, size = parted(dx, dy, dz, nx, ny, nz)
    sigma, tau, o_u, s_u, damage, first2, second2 = joint_law.point(o, size, h, law, beyond, history, g)
    history[OPENED + g], history[SLIPPED + g], history[DAMAGE + g] = o_u, s_u, damage
    part[0], part[1] = max(part[0], first2), max(part[1], second2)
    along = tau / (size + laws.TINY)
    return sigma * nx + along * sx, sigma * ny + along * sy, sigma * nz + along * sz


@njit(cache=True, nogil=True, error_model="numpy")
def face_now(x, own, link, per_h, law, beyond, history, part, out):
    """Forces (9,) [N] on the corners a, b, c of this side of a joint in any state, and into the rest of out (22,) unit
    normal (3), area [m2], tractions at the points (9) [Pa]; history (14,) moves on.

    own, link (3,): where a, b, c and p, q, r begin in flat x; law (8,), beyond (4,): rows of the tables; part (2,):
    see `_behind`."""
    a, b, c, p, q, r = own[0], own[1], own[2], link[0], link[1], link[2]
    nx, ny, nz, area, d0x, d0y, d0z, d1x, d1y, d1z, d2x, d2y, d2z = opened(
        x[a], x[a + 1], x[a + 2], x[b], x[b + 1], x[b + 2], x[c], x[c + 1], x[c + 2], x[p], x[p + 1], x[p + 2],
        x[q], x[q + 1], x[q + 2], x[r], x[r + 1], x[r + 2],
    )  # fmt: skip
    part[0] = part[1] = 0.0
    h, mid = 1.0 / per_h, mid_edges(x, a, b, c, p, q, r)
    t0x, t0y, t0z = _behind(d0x, d0y, d0z, nx, ny, nz, h, mid, law, beyond, history, 0, part)
    t1x, t1y, t1z = _behind(d1x, d1y, d1z, nx, ny, nz, h, mid, law, beyond, history, 1, part)
    t2x, t2y, t2z = _behind(d2x, d2y, d2z, nx, ny, nz, h, mid, law, beyond, history, 2, part)
    out[0], out[3], out[6] = _corner_forces(area, t0x, t1x, t2x)
    out[1], out[4], out[7] = _corner_forces(area, t0y, t1y, t2y)
    out[2], out[5], out[8] = _corner_forces(area, t0z, t1z, t2z)
    out[9], out[10], out[11], out[12] = nx, ny, nz, area
    out[13], out[14], out[15] = t0x, t0y, t0z
    out[16], out[17], out[18] = t1x, t1y, t1z
    out[19], out[20], out[21] = t2x, t2y, t2z


@njit(cache=True, nogil=True, error_model="numpy")
def _slow_joints(
    b, k, n, first, rows, x, c, link, law, kind, state, history, head, follow, table, beyond, kinetic, step, lanes,
    room, tally,
):  # fmt: skip
    """Joints past their peak on face k: those on the list of block b, and those that get there now. A joint is BROKEN
    when two of its three points have no strength left, see `softening.yielded_edges`."""
    list_ = 4 * b + k
    if _any_past_peak(n, lanes) < 0:
        for e in range(n):
            slot = 4 * (first + e) + k
            if law[slot] != 0 and lanes[LEFT + U(e)] < 0.0:
                law[slot], state[slot] = 0, YIELDED
                follow[slot], head[list_] = head[list_], slot
                for m in range(HISTORY):
                    history[slot, m] = 0.0
                history[slot, PEAK_STEP], history[slot, PEAK_KINETIC] = step, _kinetic(e, kinetic, lanes)
                tally[NEW_YIELDED] += 1
    own, out, part = room
    slot = head[list_]
    while slot >= 0:
        e = slot // 4 - first
        for m in range(3):
            own[m] = ROW * rows[first + e] + STRIDE * FACES[k, m]
        remembered = history[slot]
        face_now(
            x, own, link[slot], c[4 * (first + e) + k], table[kind[slot]], beyond[kind[slot]], remembered, part, out
        )
        for m in range(9):
            lanes[J + U(m) * _NEXT + U(e)] = out[m]
        if state[slot] == YIELDED and joint_law.breaks(remembered, part[0], part[1]):
            state[slot] = BROKEN
            remembered[STEP], remembered[KINETIC] = step, _kinetic(e, kinetic, lanes)
            tally[NEW_BROKEN] += 1
        slot = follow[slot]


@njit(cache=True, nogil=True, error_model="numpy")
def _kinetic(e, first, lanes):
    """Kinetic energy [J] of a tetrahedron at the half step before; first: lanes of velocities and of the mass of a
    corner."""
    v2 = 0.0
    for k in range(4):
        for m in range(3):
            v2 += lanes[first[0] + U(STRIDE * k + m) * _NEXT + U(e)] ** 2
    return 0.5 * lanes[first[1] + U(e)] * v2


@njit(cache=True, nogil=True, error_model="numpy")
def add_joints(
    b, n, first, rows, x, sizes, link, law, kind, state, history, head, follow, table, beyond, flat_table, keep, force,
    at_force, kinetic, step, lanes, room, tally,
):  # fmt: skip
    """Forces of the joints of a block of tetrahedra, into the lanes of forces from at_force on; and, if they are to be
    kept, into the rows `force` (n, 16). x, sizes, flat_table: flat; kinetic: see `_kinetic`; the others as in
    `elements.triangles`, with a list of joints past their peak for each face of a block."""
    flat_link = link.reshape(link.size)
    for e in range(U(0), U(n), _4):
        q = (U(first) + e) * _4
        four_columns(lanes, PER_H + e, sizes, (q, q + _4, q + _8, q + U(12)))
    if keep:
        for e in range(n):
            force[rows[first + e]] = 0.0
    for k in range(4):
        gather_face(n, first, k, x, flat_link, law, flat_table, lanes)
        if k == 0:
            _loop_0(n, lanes)
        elif k == 1:
            _loop_1(n, lanes)
        elif k == 2:
            _loop_2(n, lanes)
        else:
            _loop_3(n, lanes)
        if head[4 * b + k] >= 0 or _any_past_peak(n, lanes) < 0:
            _slow_joints(
                b, k, n, first, rows, x, sizes, link, law, kind, state, history, head, follow, table, beyond, kinetic,
                step, lanes, room, tally,
            )  # fmt: skip
        if k == 0:
            _sum_0(n, at_force, lanes)
        elif k == 1:
            _sum_1(n, at_force, lanes)
        elif k == 2:
            _sum_2(n, at_force, lanes)
        else:
            _sum_3(n, at_force, lanes)
        if keep:
            for e in range(n):
                for m in range(3):
                    at = STRIDE * FACES[k, m]
                    for axis in range(3):
                        force[rows[first + e], at + axis] += lanes[J + U(3 * m + axis) * _NEXT + U(e)]


@njit(cache=True, nogil=True, error_model="numpy")
def rooms():
    """Scratch of `face_now`: places of corners, forces, parts of the damage."""
    return np.empty(3, np.int64), np.empty(22), np.empty(2)


# ---- tables --------------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def links(number, rows, points, cells, where, partner, closed, joint_row, face, link, sizes, law, kind, state):
    """Joints of tetrahedra in these storage rows into slots, four each: face (slots,): the face of each; link (slots,
    3): where the partner's corners begin in x, else the own ones, so that nothing is open; sizes (slots,): 1 / h [1/m].
    Returns a face whose partner is not held by this rank though a joint ties them, or -1."""
    lost = np.int64(-1)
    for i in range(len(rows)):
        r = rows[i]
        e = number[r]
        for k in range(4):
            slot, f = 4 * i + k, 4 * e + k
            face[slot] = f
            law[slot] = kind[slot] = 0
            state[slot] = NONE
            a, b, c = cells[e, FACES[k, 0]], cells[e, FACES[k, 1]], cells[e, FACES[k, 2]]
            ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
            wx, wy, wz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
            nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
            sizes[slot] = 1.0 / math.sqrt(0.5 * math.sqrt(nx * nx + (ny * ny + nz * nz)))
            link[slot, 0], link[slot, 1], link[slot, 2] = (
                ROW * r + STRIDE * FACES[k, 0], ROW * r + STRIDE * FACES[k, 2], ROW * r + STRIDE * FACES[k, 1]
            )  # fmt: skip
            if not closed[f] or joint_row[f] == 0:
                continue
            g = partner[f]
            over = where[g // 4]
            if over < 0:
                lost = f
                continue
            for m in range(3):
                link[slot, m] = ROW * over + STRIDE * FACES[g % 4, m]
            law[slot] = kind[slot] = joint_row[f]
            state[slot] = INTACT
    return lost


SHEAR = 19
"""Column of `faces_now`: the shear force on this side."""


@njit(cache=True, nogil=True, error_model="numpy")
def faces_now(slots, own, over, per_h, kind, state, history, x, table, beyond, out):
    """Mean opening and slip [m], normal and shear stress [Pa] of joints, normal (3) and shear stress (3) at the points
    near the corners of the slot's face, and on this side the forces on these corners (9) and the shear force (3) [N],
    into out (n, 22); histories stay."""
    _, found, part = rooms()
    remembered = np.empty(HISTORY)
    for i in range(len(slots)):
        s = slots[i]
        for m in range(HISTORY):
            remembered[m] = history[s, m] if state[s] > INTACT else 0.0
        face_now(x, own[i], over[i], per_h[i], table[kind[s]], beyond[kind[s]], remembered, part, found)
        nx, ny, nz, area = found[9], found[10], found[11], found[12]
        dx = dy = dz = 0.0
        for m, other in ((0, 0), (1, 2), (2, 1)):
            at, to = own[i, m], over[i, other]
            dx, dy, dz = dx + (x[to] - x[at]), dy + (x[to + 1] - x[at + 1]), dz + (x[to + 2] - x[at + 2])
        o, _, _, _, size = parted(dx / 3.0, dy / 3.0, dz / 3.0, nx, ny, nz)
        out[i, 0], out[i, 1] = o, size
        for g in range(3):
            sigma, _, _, _, tau = parted(found[13 + 3 * g], found[14 + 3 * g], found[15 + 3 * g], nx, ny, nz)
            out[i, 4 + g], out[i, 7 + g] = sigma, tau
        tx = (found[13] + (found[16] + found[19])) / 3.0
        ty = (found[14] + (found[17] + found[20])) / 3.0
        tz = (found[15] + (found[18] + found[21])) / 3.0
        sigma, sx, sy, sz, tau = parted(tx, ty, tz, nx, ny, nz)
        out[i, 2], out[i, 3] = sigma, tau
        for m in range(9):
            out[i, 10 + m] = found[m]
        out[i, SHEAR], out[i, SHEAR + 1], out[i, SHEAR + 2] = area * sx, area * sy, area * sz

"""Contact of tetrahedra by potentials (Munjiza 2004), with friction: the loop over pairs of detect_space.py.

A pair is a free face, the contactor, and a tetrahedron, the target. Inside the target phi = min s_k lambda_k, lambda_k
its barycentric coordinates: s_k = 4 (Munjiza), or H_k / h with the altitudes H_k and a length h of its body, so that
phi is the distance to the nearest side over h. The part of the face inside takes the force -P int phi dA along its
normal; it falls on the corners of the face by the first moments of phi, and its opposite on those of the target by
lambda at the centre of the force. phi vanishes on all sides of the target, so that energy is kept.

phi is linear in each of four regions, where one of the s_k lambda_k is the smallest. They are cut out of the face one
after the other as convex polygons, so all integrals are exact. Places in the face are (u, v) = (N_2, N_3), its shape
functions.

Friction: each pair remembers a force F_s in the plane of the face, F_s -= P_s sqrt(A) v_s dt, |F_s| <= tan(phi) F_n,
with A the area inside the target and v_s the sliding speed at the centre of the force (Cundall & Strack 1979).

What reference_contact.py computes plainly. Each pair writes its 21 forces to a row of its own; elements then collect
theirs in the order of pairs.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import U
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem.kernels.tets import ROW, STRIDE
from hpcdem.physics.fdem.tetrahedra import FACES

# Columns of the table of pairs (m, 6): normal and shear penalty [Pa], tangent of the friction angle, and normal damping
# as in contact.py: the part of T [Pa] of this face, exponent b, dashpot [Pa s/m].
PENALTY, SHEAR, TAN_PHI, LARGEST_STRESS, EXPONENT, DASHPOT = range(6)
LAW = 6
# What a pair remembers (m, 5): F_s [N], largest phi and the normal stress there [Pa].
FRICTION, LARGEST, STRESS = 0, 3, 4
MEMORY = 5
# Faces that a target can be touched at (q, 15): their corners as combinations of the target's sides from its first
# corner (3 x 3), and the properties that the pair then has.
CHOICE = 9 + LAW
FORCES = 21
"""Words of a row of forces: corners of the face, then of the target, x, y, z each."""

AGAINST = 0.1
"""Cosine of the angle between two normals below which faces look against, or across, each other. (Sides of a block that
stands on a face look across it, also when they lean a little.)"""

# Scratch: four polygons of at most twelve corners (u, v), distances of their corners from a cut, lambda_k and
# s_k lambda_k at the corners of the face (4, 3), inward normals of the sides of the target (4, 3), of length 6 V / H_k.
_MOST = 24
_FIRST, _SECOND, _THIRD, _FOURTH = (U(k * _MOST) for k in range(4))
_DISTANCE = U(96)
_LAMBDA, _G, _NORMALS = 108, 120, 132
SCRATCH = 144
_0, _1, _2, _3, _4 = (U(k) for k in range(5))
_NEXT = U(3)
"""From s_k lambda_k at the first corner of the face to that of the next k."""
_AT_G = U(_G)


@njit(cache=True, nogil=True, error_model="numpy")
def _cut(n, at, to, a, b, c, tie, w):
    """The part of a polygon, n corners from w[at], where a + b u + c v >= 0: its corners, and where they are: at `to`,
    or still at `at` if it is the whole. tie: what is zero everywhere belongs to it."""
    most, least = -math.inf, math.inf
    for i in range(n):
        d = a + (b * w[at + _2 * i] + c * w[at + _2 * i + _1])
        w[_DISTANCE + i] = d
        most = d if d > most else most
        least = d if d < least else least
    if least >= 0.0 and (most > 0.0 or tie):
        return n, at
    if most <= 0.0:
        return _0, at
    m = _0
    last = at + _2 * (n - _1)
    d0, u0, v0 = w[_DISTANCE + n - _1], w[last], w[last + _1]
    for i in range(n):
        d1, u1, v1 = w[_DISTANCE + i], w[at + _2 * i], w[at + _2 * i + _1]
        if (d0 > 0.0 and d1 < 0.0) or (d0 < 0.0 and d1 > 0.0):
            part = d0 / (d0 - d1)
            w[to + _2 * m] = u0 + part * (u1 - u0)
            w[to + _2 * m + _1] = v0 + part * (v1 - v0)
            m += _1
        if d1 >= 0.0:
            w[to + _2 * m], w[to + _2 * m + _1] = u1, v1
            m += _1
        d0, u0, v0 = d1, u1, v1
    return m, to


@njit(cache=True, nogil=True, error_model="numpy")
def _integrate(n, at, a, b, c, w):
    """Integrals over a polygon of g = a + b u + c v, g u, g v and 1, and the largest g at a corner."""
    u0, v0, u1, v1 = w[at], w[at + _1], w[at + _2], w[at + _3]
    g0, g1 = a + (b * u0 + c * v0), a + (b * u1 + c * v1)
    zero = of_u = of_v = area = 0.0
    deepest = max(g0, g1)
    for i in range(_2, n):
        u2, v2 = w[at + _2 * i], w[at + _2 * i + _1]
        g2 = a + (b * u2 + c * v2)
        double = (u1 - u0) * (v2 - v0) - (v1 - v0) * (u2 - u0)
        all_three = g0 + (g1 + g2)
        zero += double * all_three
        of_u += double * (all_three * (u0 + (u1 + u2)) + (g0 * u0 + (g1 * u1 + g2 * u2)))
        of_v += double * (all_three * (v0 + (v1 + v2)) + (g0 * v0 + (g1 * v1 + g2 * v2)))
        area += double
        deepest = max(deepest, g2)
        u1, v1, g1 = u2, v2, g2
    return zero / 6.0, of_u / 24.0, of_v / 24.0, 0.5 * area, deepest


@njit(cache=True, nogil=True, error_model="numpy")
def _integrals(w):
    """Integrals of phi = min g_k, phi u, phi v and 1 over the part of the face where phi > 0, and the largest phi;
    g_k at the corners of the face are in the scratch. The area of the whole face is 1/2."""
    for i in range(U(6)):
        w[_FIRST + i] = 0.0
    w[_FIRST + _2] = w[_FIRST + U(5)] = 1.0
    n, at = _3, _FIRST
    for k in range(_4):
        g = _AT_G + _NEXT * k
        a = w[g]
        n, at = _cut(n, at, _SECOND if at == _FIRST else _FIRST, a, w[g + _1] - a, w[g + _2] - a, False, w)
        if n < _3:
            return 0.0, 0.0, 0.0, 0.0, 0.0
    zero = of_u = of_v = area = deepest = 0.0
    for k in range(_4):
        g = _AT_G + _NEXT * k
        a = w[g]
        b, c = w[g + _1] - a, w[g + _2] - a
        m, here = n, at
        for j in range(_4):
            if j == k:
                continue
            g = _AT_G + _NEXT * j
            a2 = w[g]
            # Where two are equal all over the face the part belongs to the first one.
            m, here = _cut(
                m, here, _FOURTH if here == _THIRD else _THIRD, a2 - a, (w[g + _1] - a2) - b, (w[g + _2] - a2) - c,
                j > k, w,
            )  # fmt: skip
            if m < _3:
                break
        if m < _3:
            continue
        one, two, three, four, five = _integrate(m, here, a, b, c, w)
        zero, of_u, of_v, area, deepest = zero + one, of_u + two, of_v + three, area + four, max(deepest, five)
        if here == at:
            break
    return zero, of_u, of_v, area, deepest


@njit(cache=True, nogil=True, error_model="numpy")
def _may_overlap(a, b, c, t, length, x, w):
    """Fill the scratch for a face with corners from x[a], x[b], x[c] and a target with its first from x[t]; length: h
    [m], 0: Munjiza's potential. Returns whether no side of the target and not the face separate them, and the cross
    product of the sides of the face (twice its area along its normal)."""
    ux, uy, uz = x[t + 4] - x[t], x[t + 5] - x[t + 1], x[t + 6] - x[t + 2]
    vx, vy, vz = x[t + 8] - x[t], x[t + 9] - x[t + 1], x[t + 10] - x[t + 2]
    wx, wy, wz = x[t + 12] - x[t], x[t + 13] - x[t + 1], x[t + 14] - x[t + 2]
    px, py, pz = x[b] - x[a], x[b + 1] - x[a + 1], x[b + 2] - x[a + 2]
    qx, qy, qz = x[c] - x[a], x[c + 1] - x[a + 1], x[c + 2] - x[a + 2]
    nx, ny, nz = py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx
    rx, ry, rz = x[a] - x[t], x[a + 1] - x[t + 1], x[a + 2] - x[t + 2]
    d0 = -(nx * rx + (ny * ry + nz * rz))
    d1, d2 = d0 + (nx * ux + (ny * uy + nz * uz)), d0 + (nx * vx + (ny * vy + nz * vz))
    d3 = d0 + (nx * wx + (ny * wy + nz * wz))
    if max(max(d0, d1), max(d2, d3)) <= 0.0 or min(min(d0, d1), min(d2, d3)) >= 0.0:
        return False, nx, ny, nz
    n1x, n1y, n1z = vy * wz - vz * wy, vz * wx - vx * wz, vx * wy - vy * wx
    n2x, n2y, n2z = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
    n3x, n3y, n3z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    det = ux * n1x + (uy * n1y + uz * n1z)
    w[_NORMALS + 3], w[_NORMALS + 4], w[_NORMALS + 5] = n1x, n1y, n1z
    w[_NORMALS + 6], w[_NORMALS + 7], w[_NORMALS + 8] = n2x, n2y, n2z
    w[_NORMALS + 9], w[_NORMALS + 10], w[_NORMALS + 11] = n3x, n3y, n3z
    for k in range(3):
        w[_NORMALS + k] = -(w[_NORMALS + 3 + k] + (w[_NORMALS + 6 + k] + w[_NORMALS + 9 + k]))
    inverse = 1.0 / det
    for i in range(3):
        sx, sy, sz = rx, ry, rz
        if i == 1:
            sx, sy, sz = x[b] - x[t], x[b + 1] - x[t + 1], x[b + 2] - x[t + 2]
        elif i == 2:
            sx, sy, sz = x[c] - x[t], x[c + 1] - x[t + 1], x[c + 2] - x[t + 2]
        one = (n1x * sx + (n1y * sy + n1z * sz)) * inverse
        two = (n2x * sx + (n2y * sy + n2z * sz)) * inverse
        three = (n3x * sx + (n3y * sy + n3z * sz)) * inverse
        w[_LAMBDA + i], w[_LAMBDA + 3 + i] = 1.0 - (one + (two + three)), one
        w[_LAMBDA + 6 + i], w[_LAMBDA + 9 + i] = two, three
    for k in range(0, 12, 3):
        one, two, three = w[_LAMBDA + k], w[_LAMBDA + k + 1], w[_LAMBDA + k + 2]
        if max(one, max(two, three)) <= 0.0:
            return False, nx, ny, nz
        s = 4.0
        if length > 0.0:
            ax, ay, az = w[_NORMALS + k], w[_NORMALS + k + 1], w[_NORMALS + k + 2]
            s = det / (length * math.sqrt(ax * ax + (ay * ay + az * az)))
        w[_G + k], w[_G + k + 1], w[_G + k + 2] = s * one, s * two, s * three
    return True, nx, ny, nz


@njit(cache=True, nogil=True, error_model="numpy")
def _damped(p, law, history, wanted, deepest, against, approach):
    """Normal stress [Pa] of pair p after damping, see `contact._damp`; its history moves on. wanted: without damping;
    deepest: largest phi; against: the face looks against the nearest side of the target."""
    if deepest >= history[p, LARGEST]:
        stress = min(wanted, law[LARGEST_STRESS])
        history[p, LARGEST], history[p, STRESS] = deepest, stress
    else:
        stress = min(wanted, history[p, STRESS] * (deepest / history[p, LARGEST]) ** law[EXPONENT])
    if law[DASHPOT] > 0.0 and against:
        stress = max(0.0, stress + law[DASHPOT] * approach)
    return stress


@njit(cache=True, nogil=True, error_model="numpy")
def _nearest(px, py, pz, a, b, c, near):
    """Square of the distance of a point from a triangle with the corners a, b, c (3,); near (3,) scratch (Ericson 2005,
    5.1.5)."""
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for k in range(3):
        p = px if k == 0 else (py if k == 1 else pz)
        ab, ac = b[k] - a[k], c[k] - a[k]
        d1, d2 = d1 + ab * (p - a[k]), d2 + ac * (p - a[k])
        d3, d4 = d3 + ab * (p - b[k]), d4 + ac * (p - b[k])
        d5, d6 = d5 + ab * (p - c[k]), d6 + ac * (p - c[k])
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        s, t = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        s, t = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        s, t = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s, t = d1 / (d1 - d3), 0.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s, t = 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        s = 1.0 - t
    else:
        s, t = vb / (va + (vb + vc)), vc / (va + (vb + vc))
    for k in range(3):
        near[k] = a[k] + (s * (b[k] - a[k]) + t * (c[k] - a[k]))
    return (px - near[0]) ** 2 + ((py - near[1]) ** 2 + (pz - near[2]) ** 2)


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(begin, end, choices, px, py, pz, nx, ny, nz, t, x, corner, near):
    """Return which of the faces choices[begin:end] the pair touches: the one nearest to the centre of the force (px,
    py, pz) among those that do not look the same way as the contactor, with the normal (nx, ny, nz), if there are any.
    corner (3, 3), near (3,): scratch."""
    best, nearest, against = begin, math.inf, False
    for q in range(begin, end):
        for i in range(3):
            for k in range(3):
                corner[i, k] = x[t + k]
                for m in range(3):
                    corner[i, k] += choices[q, 3 * i + m] * (x[t + STRIDE * (m + 1) + k] - x[t + k])
        distance = _nearest(px, py, pz, corner[0], corner[1], corner[2], near)
        ax, ay, az = corner[1, 0] - corner[0, 0], corner[1, 1] - corner[0, 1], corner[1, 2] - corner[0, 2]
        bx, by, bz = corner[2, 0] - corner[0, 0], corner[2, 1] - corner[0, 1], corner[2, 2] - corner[0, 2]
        mx, my, mz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        sizes = math.sqrt((nx * nx + (ny * ny + nz * nz)) * (mx * mx + (my * my + mz * mz)))
        opposed = nx * mx + (ny * my + nz * mz) < AGAINST * sizes
        if (opposed and not against) or (opposed == against and distance < nearest):
            best, nearest, against = q, distance, opposed
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _boxes(t, threads, place, x, box):
    n = len(place)
    x = x.reshape(x.size)
    for i in range(n * t // threads, n * (t + 1) // threads):
        p = place[i]
        for k in range(3):
            a, b, c, d = x[p + k], x[p + 4 + k], x[p + 8 + k], x[p + 12 + k]
            box[i, k] = min(min(a, b), min(c, d))
            box[i, 3 + k] = max(max(a, b), max(c, d))


@njit(cache=True, nogil=True, error_model="numpy")
def _forces(
    t, threads, first, second, corner, place, length, box, x, v, law, chosen, choice_begin, choices, history, touching,
    out, dt,
):  # fmt: skip
    x, v = x.reshape(x.size), v.reshape(v.size)
    w, one_law, triangle, near = np.zeros(SCRATCH), np.zeros(LAW), np.zeros((3, 3)), np.zeros(3)
    m = len(first)
    before = -1
    a = b = c = 0
    low_x = low_y = low_z = high_x = high_y = high_z = 0.0
    for p in range(m * t // threads, m * (t + 1) // threads):
        if first[p] != before:
            before = first[p]
            a, b, c = corner[before, 0], corner[before, 1], corner[before, 2]
            low_x, high_x = min(x[a], min(x[b], x[c])), max(x[a], max(x[b], x[c]))
            low_y, high_y = min(x[a + 1], min(x[b + 1], x[c + 1])), max(x[a + 1], max(x[b + 1], x[c + 1]))
            low_z, high_z = min(x[a + 2], min(x[b + 2], x[c + 2])), max(x[a + 2], max(x[b + 2], x[c + 2]))
        s = second[p]
        meets = (
            low_x <= box[s, 3] and box[s, 0] <= high_x and low_y <= box[s, 4] and box[s, 1] <= high_y
            and low_z <= box[s, 5] and box[s, 2] <= high_z
        )  # fmt: skip
        zero = 0.0
        nx = ny = nz = of_u = of_v = area = deepest = 0.0
        if meets:
            some, nx, ny, nz = _may_overlap(a, b, c, place[s], length[s], x, w)
            if some:
                zero, of_u, of_v, area, deepest = _integrals(w)
        if not (zero > 0.0 and area > 0.0):
            if touching[p] > 0:
                touching[p] = 0
                for k in range(MEMORY):
                    history[p, k] = 0.0
            continue
        touching[p] = 1
        at = place[s]
        double = math.sqrt(nx * nx + (ny * ny + nz * nz))
        n_2, n_3 = of_u / zero, of_v / zero
        n_1 = 1.0 - (n_2 + n_3)
        l_1 = n_1 * w[_LAMBDA + 3] + (n_2 * w[_LAMBDA + 4] + n_3 * w[_LAMBDA + 5])
        l_2 = n_1 * w[_LAMBDA + 6] + (n_2 * w[_LAMBDA + 7] + n_3 * w[_LAMBDA + 8])
        l_3 = n_1 * w[_LAMBDA + 9] + (n_2 * w[_LAMBDA + 10] + n_3 * w[_LAMBDA + 11])
        l_0 = 1.0 - (l_1 + (l_2 + l_3))
        for k in range(LAW):
            one_law[k] = law[p, k]
        if len(chosen) > 0 and chosen[p] >= 0:
            q = _choose(
                choice_begin[chosen[p]], choice_begin[chosen[p] + 1], choices,
                n_1 * x[a] + (n_2 * x[b] + n_3 * x[c]), n_1 * x[a + 1] + (n_2 * x[b + 1] + n_3 * x[c + 1]),
                n_1 * x[a + 2] + (n_2 * x[b + 2] + n_3 * x[c + 2]), nx, ny, nz, at, x, triangle, near,
            )  # fmt: skip
            for k in range(LAW):
                one_law[k] = choices[q, 9 + k]
        per = 1.0 / double
        ex, ey, ez = nx * per, ny * per, nz * per
        vx = n_1 * v[a] + (n_2 * v[b] + n_3 * v[c])
        vy = n_1 * v[a + 1] + (n_2 * v[b + 1] + n_3 * v[c + 1])
        vz = n_1 * v[a + 2] + (n_2 * v[b + 2] + n_3 * v[c + 2])
        vx -= (l_0 * v[at] + l_1 * v[at + 4]) + (l_2 * v[at + 8] + l_3 * v[at + 12])
        vy -= (l_0 * v[at + 1] + l_1 * v[at + 5]) + (l_2 * v[at + 9] + l_3 * v[at + 13])
        vz -= (l_0 * v[at + 2] + l_1 * v[at + 6]) + (l_2 * v[at + 10] + l_3 * v[at + 14])
        approach = vx * ex + (vy * ey + vz * ez)
        inside = area * double
        normal = one_law[PENALTY] * zero * double
        if one_law[LARGEST_STRESS] < math.inf or one_law[EXPONENT] != 1.0 or one_law[DASHPOT] > 0.0:
            side, least = 0, math.inf
            for k in range(4):
                g = n_1 * w[_G + 3 * k] + (n_2 * w[_G + 3 * k + 1] + n_3 * w[_G + 3 * k + 2])
                if g < least:
                    side, least = k, g
            side = _NORMALS + 3 * side
            against = nx * w[side] + (ny * w[side + 1] + nz * w[side + 2]) > 0.0
            normal = inside * _damped(p, one_law, history, normal / inside, deepest, against, approach)
        fx, fy, fz = history[p, 0], history[p, 1], history[p, 2]
        along = fx * ex + (fy * ey + fz * ez)
        k_dt = one_law[SHEAR] * math.sqrt(inside) * dt
        fx = (fx - along * ex) - k_dt * (vx - approach * ex)
        fy = (fy - along * ey) - k_dt * (vy - approach * ey)
        fz = (fz - along * ez) - k_dt * (vz - approach * ez)
        most = one_law[TAN_PHI] * normal
        size = math.sqrt(fx * fx + (fy * fy + fz * fz))
        if size > most:
            part = most / size
            fx, fy, fz = part * fx, part * fy, part * fz
        history[p, 0], history[p, 1], history[p, 2] = fx, fy, fz
        fx, fy, fz = fx - normal * ex, fy - normal * ey, fz - normal * ez
        row = out[p]
        row[0], row[1], row[2] = n_1 * fx, n_1 * fy, n_1 * fz
        row[3], row[4], row[5] = n_2 * fx, n_2 * fy, n_2 * fz
        row[6], row[7], row[8] = n_3 * fx, n_3 * fy, n_3 * fz
        row[9], row[10], row[11] = -l_0 * fx, -l_0 * fy, -l_0 * fz
        row[12], row[13], row[14] = -l_1 * fx, -l_1 * fy, -l_1 * fz
        row[15], row[16], row[17] = -l_2 * fx, -l_2 * fy, -l_2 * fz
        row[18], row[19], row[20] = -l_3 * fx, -l_3 * fy, -l_3 * fz


@njit(cache=True, nogil=True, error_model="numpy")
def _collect(t, threads, begin, entry, touching, out, pushed):
    n = len(begin) - 1
    for i in range(n * t // threads, n * (t + 1) // threads):
        for c in range(ROW):
            pushed[i, c] = 0.0
        for m in range(begin[i], begin[i + 1]):
            p, face = entry[m] >> 3, entry[m] & 3
            if touching[p] == 0:
                continue
            if entry[m] & 4:
                for c in range(4):
                    for k in range(3):
                        pushed[i, STRIDE * c + k] += out[p, 9 + 3 * c + k]
            else:
                for c in range(3):
                    for k in range(3):
                        pushed[i, STRIDE * FACES[face, c] + k] += out[p, 3 * c + k]


@on_threads
def forces(threads, place, box, first, second, corner, length, x, v, law, chosen, choice_begin, choices, history,
           touching, out, dt, begin, entry, pushed):  # fmt: skip
    """Forces of all pairs, and their sums by elements; histories move on by dt.

    place (n,) i8: where the targets begin in x and v (flat), length (n,) [m]: h, 0: Munjiza's potential, box (n, 6):
    room for their bounds; first, second (m,) i8: contactor and target of each pair, pairs in the order of contactors;
    corner (c, 3) i8: where the corners of the contactors begin; law (m, 6), history (m, 5), choices (q, 15): see above;
    chosen (m,) i8: pairs whose properties are chosen, number in choice_begin, else -1, or (0,); touching (m,) u1: pairs
    that overlap; out (m, 21) [N]: forces on the corners of the face and of the target, valid where they touch; begin
    (k + 1,), entry: pair * 8 + face of each element with pairs, + 4: it is the target; pushed (k, 16) [N].
    """
    for t in prange(threads):
        _boxes(t, threads, place, x, box)
    for t in prange(threads):
        _forces(t, threads, first, second, corner, place, length, box, x, v, law, chosen, choice_begin, choices,
                history, touching, out, dt)  # fmt: skip
    for t in prange(threads):
        _collect(t, threads, begin, entry, touching, out, pushed)


@njit(cache=True, nogil=True, error_model="numpy")
def add(rows, pushed, force):
    """Sums of elements (k, 16) to the rows of forces (n, 16) of theirs."""
    for i in range(len(rows)):
        for c in range(ROW):
            force[rows[i], c] += pushed[i, c]


@njit(cache=True, nogil=True, error_model="numpy")
def _parts(t, threads, first, second, corner, place, x, touching, part):
    x, w = x.reshape(x.size), np.zeros(SCRATCH)
    for p in range(len(first) * t // threads, len(first) * (t + 1) // threads):
        part[p] = 0.0
        if touching[p] == 0:
            continue
        a, b, c = corner[first[p], 0], corner[first[p], 1], corner[first[p], 2]
        if _may_overlap(a, b, c, place[second[p]], 0.0, x, w)[0]:
            part[p] = 0.25 * _integrals(w)[4]


@on_threads
def parts(threads, *args):
    """Return how deep the face of each pair is in its target, over its altitude there: part (m,), at most 1/4, 0 where
    they do not touch. Arguments as those of `forces`."""
    for t in prange(threads):
        _parts(t, threads, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def depths(first, second, corner, place, x, depth):
    """Return how deep the contactor of each pair is in the target: depth (m, 4) [m], and where. It is the distance to
    the nearest side of the target, so no more than the radius of its inscribed sphere."""
    x, w = x.reshape(x.size), np.zeros(SCRATCH)
    for p in range(len(first)):
        for k in range(4):
            depth[p, k] = 0.0
        a, b, c = corner[first[p], 0], corner[first[p], 1], corner[first[p], 2]
        some, _, _, _ = _may_overlap(a, b, c, place[second[p]], 1.0, x, w)
        if some:
            zero, of_u, of_v, area, deepest = _integrals(w)
            if zero > 0.0 and area > 0.0:
                depth[p, 0] = deepest
                for k in range(3):
                    depth[p, 1 + k] = x[a + k] + (of_u * (x[b + k] - x[a + k]) + of_v * (x[c + k] - x[a + k])) / zero

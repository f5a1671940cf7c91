"""Arithmetic of flat triangular shells that may turn by any angle.

Element e of (m,) has the nodes ends[e], counter-clockwise as seen from outside of the rock. Its frame (3, 3) has two
unit vectors in its plane, which turn with it as the rotation of its deformation gradient says, and the normal, away
from the rock. Tensors in the plane are 11, 22, 12, of strains and curvatures 2 x 12. Moments are positive with tension
on the side away from the rock. Rotations of nodes are unit quaternions, their postures.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.liners import kernels
from hpcdem.physics.liners.kernels import BENDS, COS_SMOOTH, HAS_YIELDED, IN_BEAMS, IN_COMPRESSION, IN_TENSION, REMOVED

# Columns of the table of elements (m, 8): area; stiffness E t / (1 - nu^2) and nu times it, of the membrane and, times
# t^2 / 12, of the plate; that of rotations about the normal [N m]; forces and moment at which they yield.
AREA, MEMBRANE, PLATE, NU, DRILL, TENSION, COMPRESSION, PLASTIC_MOMENT = range(8)
# Columns of form (m, 12): strain of the membrane, and three rotations in the frame of the element of each corner.
TURNS = 3
# Columns of force and plastic (m, 12): of the membrane, and of the plate at the middles of the sides 01, 12, 20.
OF_MEMBRANE, OF_PLATE = slice(0, 3), slice(3, 12)


@njit(cache=True, nogil=True, error_model="numpy")
def dot(a, b):
    """a . b in space."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, nogil=True, error_model="numpy")
def cross(a, b, out):
    """out = a x b."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True, nogil=True, error_model="numpy")
def lie(a, b, c, frame):
    """Fill frame (3, 3): along the side from a to b, across it, and the normal. Returns where b and c lie in it: the
    first coordinate of b, both of c."""
    u, w = b - a, c - a
    cross(u, w, frame[2])
    size = math.sqrt(dot(frame[2], frame[2]))
    length = math.sqrt(dot(u, u))
    for k in range(3):
        frame[2, k] /= size
        frame[0, k] = u[k] / length
    cross(frame[2], frame[0], frame[1])
    return length, dot(w, frame[0]), dot(w, frame[1])


@njit(cache=True, nogil=True, error_model="numpy")
def turned(q, spin, dt):
    """Turn a unit quaternion (4,) by spin dt (3,)."""
    angle = math.sqrt(dot(spin, spin)) * dt
    if angle == 0.0:
        return
    cosine, part = math.cos(0.5 * angle), math.sin(0.5 * angle) * dt / angle
    x, y, z = part * spin[0], part * spin[1], part * spin[2]
    a, b, c, d = q[0], q[1], q[2], q[3]
    q[0] = cosine * a - x * b - y * c - z * d
    q[1] = cosine * b + x * a + y * d - z * c
    q[2] = cosine * c + y * a + z * b - x * d
    q[3] = cosine * d + z * a + x * c - y * b
    size = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for k in range(4):
        q[k] /= size


@njit(cache=True, nogil=True, error_model="numpy")
def matrix(q, out):
    """Rotation (3, 3) of a unit quaternion."""
    a, b, c, d = q[0], q[1], q[2], q[3]
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - 2.0 * (c * c + d * d), 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)
    out[1, 0], out[1, 1], out[1, 2] = 2.0 * (b * c + a * d), 1.0 - 2.0 * (b * b + d * d), 2.0 * (c * d - a * b)
    out[2, 0], out[2, 1], out[2, 2] = 2.0 * (b * d - a * c), 2.0 * (c * d + a * b), 1.0 - 2.0 * (b * b + c * c)


@njit(cache=True, nogil=True, error_model="numpy")
def rotation(m, out):
    """Rotation vector (3,) [rad] of a matrix, below half a turn."""
    out[0], out[1], out[2] = 0.5 * (m[2, 1] - m[1, 2]), 0.5 * (m[0, 2] - m[2, 0]), 0.5 * (m[1, 0] - m[0, 1])
    sine = math.sqrt(dot(out, out))
    if sine > 1e-9:
        angle = math.atan2(sine, 0.5 * (m[0, 0] + m[1, 1] + m[2, 2] - 1.0))
        for k in range(3):
            out[k] *= angle / sine


@njit(cache=True, nogil=True, error_model="numpy")
def shape(a, b, c, slope, posture, seat, frame, form):
    """Frame and form of an element with corners at a, b, c whose nodes have these postures (3, 4); slope (3, 2): of
    shape functions as installed; seat (3, 3, 3): of each corner, the frame as installed as seen from its node."""
    length, x, y = lie(a, b, c, frame)
    f11, f12 = length * slope[1, 0] + x * slope[2, 0], length * slope[1, 1] + x * slope[2, 1]
    f21, f22 = y * slope[2, 0], y * slope[2, 1]
    size = math.sqrt((f11 + f22) * (f11 + f22) + (f21 - f12) * (f21 - f12))
    cosine, sine = (f11 + f22) / size, (f21 - f12) / size
    form[0] = cosine * f11 + sine * f21 - 1.0
    form[1] = cosine * f22 - sine * f12 - 1.0
    form[2] = 2.0 * (cosine * f12 + sine * f22)
    for k in range(3):
        first, second = frame[0, k], frame[1, k]
        frame[0, k], frame[1, k] = cosine * first + sine * second, cosine * second - sine * first
    turn, now = np.empty((3, 3)), np.empty((3, 3))
    for n in range(3):
        matrix(posture[n], turn)
        for i in range(3):
            for j in range(3):
                now[i, j] = 0.0
                for k in range(3):
                    for m in range(3):
                        now[i, j] += frame[i, k] * turn[k, m] * seat[n, j, m]
        rotation(now, form[TURNS + 3 * n : TURNS + 3 * n + 3])


@njit(cache=True, nogil=True, error_model="numpy")
def returned(first, second, low, high, low_2, high_2, nu):
    """Principal values that lie in a box [low, high] x [low_2, high_2], nearest to these by the energy of a plate:
    stiffness 1, nu."""
    p, q = min(max(first, low), high), min(max(second, low_2), high_2)
    over, over_2 = first - p, second - q
    by_first, by_second = second - nu * over, first - nu * over_2  # what the other is where one alone yields
    held, held_2 = min(max(by_second, low), high), min(max(by_first, low_2), high_2)
    if over != 0.0 and held_2 == by_first:
        return p, by_first
    if over_2 != 0.0 and held == by_second:
        return by_second, q
    if over != 0.0 and held_2 != q:  # a corner, where one has drawn the other to its opposite side
        return p, held_2
    if over_2 != 0.0 and held != p:
        return held, q
    return p, q


@njit(cache=True, nogil=True, error_model="numpy")
def principal(t):
    """Larger and smaller principal value of t (3,), cosine and sine of twice the angle from axis 1 to the larger."""
    middle, half = 0.5 * (t[0] + t[1]), 0.5 * (t[0] - t[1])
    radius = math.sqrt(half * half + t[2] * t[2])
    if radius == 0.0:
        return middle, middle, 1.0, 0.0
    return middle + radius, middle - radius, half / radius, t[2] / radius


@njit(cache=True, nogil=True, error_model="numpy")
def back(first, second, cosine, sine, out):
    """The tensor (3,) of principal values."""
    middle, radius = 0.5 * (first + second), 0.5 * (first - second)
    out[0], out[1], out[2] = middle + radius * cosine, middle - radius * cosine, radius * sine


@njit(cache=True, nogil=True, error_model="numpy")
def flow(old, trial, new, stiff, nu, plastic):
    """Add the plastic strain (3,) between a trial and what is left of it; returns its work, per area."""
    square = stiff * (1.0 - nu * nu)
    d1, d2 = trial[0] - new[0], trial[1] - new[1]
    e1, e2, e3 = (d1 - nu * d2) / square, (d2 - nu * d1) / square, 2.0 * (trial[2] - new[2]) / (stiff * (1.0 - nu))
    plastic[0] += e1
    plastic[1] += e2
    plastic[2] += e3
    return 0.5 * ((old[0] + new[0]) * e1 + (old[1] + new[1]) * e2 + (old[2] + new[2]) * e3)


@njit(cache=True, nogil=True, error_model="numpy")
def elastic(old, strain, stiff, nu, out):
    """out (3,) = old + D strain, strain (3,) with 2 x 12."""
    out[0] = old[0] + stiff * (strain[0] + nu * strain[1])
    out[1] = old[1] + stiff * (strain[1] + nu * strain[0])
    out[2] = old[2] + stiff * 0.5 * (1.0 - nu) * strain[2]


@njit(cache=True, nogil=True, error_model="numpy")
def bend(ends, x, posture, elements, slope, curve, seat, frame, form, force, plastic, state, work):
    """New forces of membranes and moments at the middles of the sides, from the new places and postures.

    N += D de, held between the yield forces in its principal directions; M += D dk in each point, held below the moment
    that a section bears at the force across it in its principal directions; dk = curve (9, 6) times the rotations about
    the axes in the plane. What is beyond flows, associated.
    """
    now, turns, trial, new = np.zeros(12), np.zeros(6), np.zeros(3), np.zeros(3)
    bent, nodes, corner = np.zeros(3), np.zeros((3, 4)), np.zeros((3, 3))
    for e in range(len(ends)):
        if state[e] & REMOVED:
            continue
        for k in range(3):
            nodes[k], corner[k] = posture[ends[e, k]], x[ends[e, k]]
        shape(corner[0], corner[1], corner[2], slope[e], nodes, seat[e], frame[e], now)
        nu, tension, compression = elements[e, NU], elements[e, TENSION], elements[e, COMPRESSION]
        area, stiff = elements[e, AREA], elements[e, MEMBRANE]
        yields = not math.isinf(tension)
        state[e] &= ~(IN_TENSION | IN_COMPRESSION | BENDS)
        old = force[e, 0:3]
        elastic(old, now[0:3] - form[e, 0:3], stiff, nu, trial)
        new[:] = trial
        if yields:
            first, second, cosine, sine = principal(trial)
            n1, n2 = returned(first, second, -compression, tension, -compression, tension, nu)
            if n1 != first or n2 != second:
                back(n1, n2, cosine, sine, new)
                if n1 == tension or n2 == tension:
                    state[e] |= IN_TENSION | HAS_YIELDED
                if n1 == -compression or n2 == -compression:
                    state[e] |= IN_COMPRESSION | HAS_YIELDED
                work[IN_BEAMS] += area * flow(old, trial, new, stiff, nu, plastic[e, 0:3])
        force[e, 0:3] = new
        for k in range(3):
            for c in range(2):
                turns[2 * k + c] = now[TURNS + 3 * k + c] - form[e, TURNS + 3 * k + c]
        form[e] = now
        stiff = elements[e, PLATE]
        for p in range(3):
            at = 3 + 3 * p
            for r in range(3):
                bent[r] = 0.0
                for c in range(6):
                    bent[r] += curve[e, 3 * p + r, c] * turns[c]
            old = force[e, at : at + 3]
            elastic(old, bent, stiff, nu, trial)
            new[:] = trial
            if yields:
                first, second, cosine, sine = principal(trial)
                middle, half = 0.5 * (force[e, 0] + force[e, 1]), 0.5 * (force[e, 0] - force[e, 1])
                along = half * cosine + force[e, 2] * sine
                most = kernels.largest_moment(middle + along, tension, compression, elements[e, PLASTIC_MOMENT])
                most_2 = kernels.largest_moment(middle - along, tension, compression, elements[e, PLASTIC_MOMENT])
                m1, m2 = returned(first, second, -most, most, -most_2, most_2, nu)
                if m1 != first or m2 != second:
                    back(m1, m2, cosine, sine, new)
                    state[e] |= BENDS | HAS_YIELDED
                    work[IN_BEAMS] += area / 3.0 * flow(old, trial, new, stiff, nu, plastic[e, at : at + 3])
            force[e, at : at + 3] = new


@njit(cache=True, nogil=True, error_model="numpy")
def push(ends, elements, slope, curve, frame, at_points, form, force, state, pressure, shear, total, on_rock):
    """Add forces and moments of elements and bond on nodes, total (n, 6), and of points on the rock, on_rock (3 m, 3).

    Moments of a corner belong to its rotation against the frame: their sum is carried by forces at the corners.
    """
    moment, grown = np.zeros((3, 3)), np.zeros((3, 2))
    for e in range(len(ends)):
        if state[e] & REMOVED:
            continue
        area = elements[e, AREA]
        u11, u22, u12 = 1.0 + form[e, 0], 1.0 + form[e, 1], 0.5 * form[e, 2]
        volume = u11 * u22 - u12 * u12
        n11, n22, n12 = force[e, 0], force[e, 1], force[e, 2]
        t11, t22 = u11 * n11 + u12 * n12, u22 * n22 + u12 * n12
        t12 = 0.5 * ((u11 + u22) * n12 + u12 * (n11 + n22))
        sx = sy = sz = 0.0
        for k in range(3):
            gx, gy = slope[e, k, 0], slope[e, k, 1]
            grown[k, 0], grown[k, 1] = (u22 * gx - u12 * gy) / volume, (u11 * gy - u12 * gx) / volume
            for c in range(2):
                moment[k, c] = 0.0
                for r in range(9):
                    moment[k, c] += curve[e, r, 2 * k + c] * force[e, 3 + r]
                moment[k, c] *= area / 3.0
            moment[k, 2] = elements[e, DRILL] * form[e, TURNS + 3 * k + 2]
            sx += moment[k, 0]
            sy += moment[k, 1]
            sz += moment[k, 2]
        for k in range(3):
            i, gx, gy = ends[e, k], grown[k, 0], grown[k, 1]
            f1 = -area * (t11 * gx + t12 * gy) - 0.5 * gy * sz
            f2 = -area * (t12 * gx + t22 * gy) + 0.5 * gx * sz
            f3 = gy * sx - gx * sy
            for c in range(3):
                total[i, c] += f1 * frame[e, 0, c] + f2 * frame[e, 1, c] + f3 * frame[e, 2, c]
                total[i, 3 + c] -= (
                    moment[k, 0] * frame[e, 0, c] + moment[k, 1] * frame[e, 1, c] + moment[k, 2] * frame[e, 2, c]
                )
            kernels.hold(3 * e + k, i, at_points, pressure, shear, total, on_rock)


@njit(cache=True, nogil=True, error_model="numpy")
def frames(ends, x, frame, state, mean, at_points):
    """Unit vectors across and along the rock at points, at_points (3 m, 3, 3): across the mean of the elements at a
    node, by their angles there, or else a liner could not slide along a polyhedron; where it has a corner, more than
    SMOOTH from the mean, across the element itself. Those along it are the element's, laid into that plane."""
    mean[:] = 0.0
    way = np.zeros(3)
    for e in range(len(ends)):
        if state[e] & REMOVED:
            continue
        for k in range(3):
            i = ends[e, k]
            u, w = x[ends[e, (k + 1) % 3]] - x[i], x[ends[e, (k + 2) % 3]] - x[i]
            cross(u, w, way)
            angle = math.atan2(math.sqrt(dot(way, way)), dot(u, w))
            for c in range(3):
                mean[i, c] += angle * frame[e, 2, c]
    for e in range(len(ends)):
        for k in range(3):
            i, at = ends[e, k], at_points[3 * e + k]
            size = math.sqrt(dot(mean[i], mean[i]))
            at[0], at[1], at[2] = frame[e, 2], frame[e, 0], frame[e, 1]
            if size > 0.0 and dot(mean[i], frame[e, 2]) > COS_SMOOTH * size:
                for c in range(3):
                    at[0, c] = mean[i, c] / size
                lift = dot(at[0], frame[e, 0])
                for c in range(3):
                    at[1, c] = frame[e, 0, c] - lift * at[0, c]
                size = math.sqrt(dot(at[1], at[1]))
                for c in range(3):
                    at[1, c] /= size
                cross(at[0], at[1], at[2])


@njit(cache=True, nogil=True, error_model="numpy")
def turn_nodes(posture, spin, dt):
    """Turn all nodes over a step."""
    for i in range(len(posture)):
        turned(posture[i], spin[i], dt)


@njit(cache=True, nogil=True, error_model="numpy")
def place(ends, x, state, slope, frame):
    """Frames (m, 3, 3) of elements at x, which turn with their deformation gradients; slope (m, 3, 2): as installed."""
    form, seat, still = np.zeros(12), np.zeros((3, 3, 3)), np.zeros((3, 4))
    still[:, 0] = 1.0
    for e in range(len(ends)):
        shape(x[ends[e, 0]], x[ends[e, 1]], x[ends[e, 2]], slope[e], still, seat, frame[e], form)

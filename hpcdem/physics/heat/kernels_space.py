"""Kernels of heat in space: friction, and where faces touch."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.tetrahedra import FACES

MOST = 10
"""Corners of a triangle that is cut five times, with room."""


@njit(cache=True, nogil=True, error_model="numpy")
def friction_heat(first, second, face, face_row, row, touching, v, force, history, effusivity, part, dt, out):
    """Heat of friction, see `friction.friction_heat`: add that (rows, 4) [J] of a step dt [s] to the corners of the
    elements held here.

    first, second (m,): pairs of contactors and targets; face (contactors,): theirs; face_row, row: storage rows of
    both; touching (m,), force (m, 21) [N], history (m, 5) [N]: see `ContactSpace`, of this step. By the parts of the
    force that corners take, the heat is shared out, and the speed of sliding is that of both walls.
    """
    mine, theirs = np.empty(3), np.empty(4)
    for p in range(len(first)):
        hx, hy, hz = history[p, 0], history[p, 1], history[p, 2]
        if touching[p] == 0 or (hx == 0.0 and hy == 0.0 and hz == 0.0):
            continue
        i, j, corners = face_row[first[p]], row[second[p]], FACES[face[first[p]] % 4]
        fx = force[p, 0] + (force[p, 3] + force[p, 6])
        fy = force[p, 1] + (force[p, 4] + force[p, 7])
        fz = force[p, 2] + (force[p, 5] + force[p, 8])
        size = fx * fx + (fy * fy + fz * fz)
        vx = vy = vz = 0.0
        for k in range(3):
            mine[k] = (force[p, 3 * k] * fx + (force[p, 3 * k + 1] * fy + force[p, 3 * k + 2] * fz)) / size
            at = 4 * corners[k]
            vx, vy, vz = vx + mine[k] * v[i, at], vy + mine[k] * v[i, at + 1], vz + mine[k] * v[i, at + 2]
        for k in range(4):
            at = 9 + 3 * k
            theirs[k] = -(force[p, at] * fx + (force[p, at + 1] * fy + force[p, at + 2] * fz)) / size
            at = 4 * k
            vx, vy, vz = vx - theirs[k] * v[j, at], vy - theirs[k] * v[j, at + 1], vz - theirs[k] * v[j, at + 2]
        heat = -dt * (hx * vx + (hy * vy + hz * vz))
        share = effusivity[i] / (effusivity[i] + effusivity[j])
        for k in range(3):
            out[i, corners[k]] += mine[k] * (part[i] * share * heat)
        for k in range(4):
            out[j, k] += theirs[k] * (part[j] * (1.0 - share) * heat)


@njit(cache=True, nogil=True, error_model="numpy")
def _cut(n, polygon, other, a, b, c):
    """The part of a polygon (n corners, columns u, v) where a + b u + c v >= 0 into `other`: its number of corners."""
    m, last = 0, n - 1
    before = a + (b * polygon[last, 0] + c * polygon[last, 1])
    for i in range(n):
        here = a + (b * polygon[i, 0] + c * polygon[i, 1])
        if (before < 0.0) != (here < 0.0):
            part = before / (before - here)
            for axis in range(2):
                other[m, axis] = polygon[last, axis] + part * (polygon[i, axis] - polygon[last, axis])
            m += 1
        if here >= 0.0:
            other[m, 0], other[m, 1] = polygon[i, 0], polygon[i, 1]
            m += 1
        before, last = here, i
    return m


@njit(cache=True, nogil=True, error_model="numpy")
def _seen(one, two, near, deep, polygon, other, onto):
    """The part of a face, corners one (3, 3), that sees a second one, two (3, 3), along its normal, no farther than
    `near` above and `deep` below it [m]: corners of a polygon in `polygon`, as parts (u, v) of the sides of the first,
    and `onto` (3, 2 + 1): of the second face the same as a linear function of them, u' = onto[0] . (1, u, v), v' =
    onto[1]; gap onto[2]. Returns the number of corners, and the area of the first face [m2]."""
    ux, uy, uz = one[1, 0] - one[0, 0], one[1, 1] - one[0, 1], one[1, 2] - one[0, 2]
    wx, wy, wz = one[2, 0] - one[0, 0], one[2, 1] - one[0, 1], one[2, 2] - one[0, 2]
    nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
    double = math.sqrt(nx * nx + (ny * ny + nz * nz))
    px, py, pz = two[1, 0] - two[0, 0], two[1, 1] - two[0, 1], two[1, 2] - two[0, 2]
    qx, qy, qz = two[2, 0] - two[0, 0], two[2, 1] - two[0, 1], two[2, 2] - two[0, 2]
    mx, my, mz = py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx
    against = nx * mx + (ny * my + nz * mz)
    if 2.0 * against > -double * math.sqrt(mx * mx + (my * my + mz * mz)):
        return 0, 0.0
    # Where the normal through one[0] + u U + w W meets the plane of the second: two[0] + u' P + v' Q, gap along n.
    for column in range(3):
        if column == 0:
            x, y, z = one[0, 0] - two[0, 0], one[0, 1] - two[0, 1], one[0, 2] - two[0, 2]
        elif column == 1:
            x, y, z = ux, uy, uz
        else:
            x, y, z = wx, wy, wz
        slip = (x * mx + (y * my + z * mz)) / against  # times -n
        onto[2, column] = -slip * double
        x, y, z = x - slip * nx, y - slip * ny, z - slip * nz
        # u' = (r x Q) . m / m^2 and v' = (P x r) . m / m^2.
        m2 = mx * mx + (my * my + mz * mz)
        onto[0, column] = ((y * qz - z * qy) * mx + ((z * qx - x * qz) * my + (x * qy - y * qx) * mz)) / m2
        onto[1, column] = ((py * z - pz * y) * mx + ((pz * x - px * z) * my + (px * y - py * x) * mz)) / m2
    polygon[0, 0] = polygon[0, 1] = polygon[1, 1] = polygon[2, 0] = 0.0
    polygon[1, 0] = polygon[2, 1] = 1.0
    n = 3
    for cut in range(5):
        if cut < 2:
            a, b, c = onto[cut, 0], onto[cut, 1], onto[cut, 2]
        elif cut == 2:
            a, b, c = 1.0 - (onto[0, 0] + onto[1, 0]), -(onto[0, 1] + onto[1, 1]), -(onto[0, 2] + onto[1, 2])
        elif cut == 3:
            a, b, c = near - onto[2, 0], -onto[2, 1], -onto[2, 2]
        else:
            a, b, c = deep + onto[2, 0], onto[2, 1], onto[2, 2]
        n = _cut(n, polygon, other, a, b, c)
        if n < 3:
            return 0, 0.0
        polygon[:n] = other[:n]
    return n, 0.5 * double


@njit(cache=True, nogil=True, error_model="numpy")
def touching(first, second, share, x, h, near, deep, corner, weight, pass_on):
    """Return where faces touch: how many places, and as many rows of the rest as there are; see `kernels.touching`.

    first, second (m, 3): corners of pairs of triangles, 4 row + k of storage; share (m,): which part of their heat
    counts; x (n, 16); h (rows,) [W/(m2 K)]. The part of a face that sees the other one is a polygon; triangles from the
    mean of its corners to its sides pass a third of their heat on at each of their corners, at the mean that of the
    means of all: so linear temperatures give the exact heat. corner (n, 6) in t, flat, of four columns, weight (n, 6),
    pass_on (n,) [W/K].
    """
    n = 0
    one, two, onto = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    polygon, scratch = np.empty((MOST, 2)), np.empty((MOST, 2))
    x = x.reshape(x.size)
    for p in range(len(first)):
        mine, theirs = first[p], second[p]
        i, j = mine[0] // 4, theirs[0] // 4
        if h[i] <= 0.0 or h[j] <= 0.0:
            continue
        for k in range(3):
            for axis in range(3):
                one[k, axis], two[k, axis] = x[4 * mine[k] + axis], x[4 * theirs[k] + axis]
        many, area = _seen(one, two, near, deep, polygon, scratch, onto)
        if many < 3:
            continue
        if n + many <= len(pass_on):
            third = share[p] * (2.0 * h[i] * h[j] / (h[i] + h[j]) * area / 3.0)
            middle_u = middle_v = whole = 0.0
            for m in range(many):
                middle_u, middle_v = middle_u + polygon[m, 0] / many, middle_v + polygon[m, 1] / many
                pass_on[n + m] = 0.0
            for m in range(many):
                o = (m + 1) % many
                # Twice its area in the plane of (u, v) is its part of that of the face.
                part = (polygon[m, 0] - middle_u) * (polygon[o, 1] - middle_v)
                part -= (polygon[m, 1] - middle_v) * (polygon[o, 0] - middle_u)
                whole += part
                pass_on[n + m] += third * part
                pass_on[n + o] += third * part
            for m in range(many):
                pass_on[n + m] += third * whole / many
            for m in range(many):
                u, v = polygon[m, 0], polygon[m, 1]
                s = onto[0, 0] + (onto[0, 1] * u + onto[0, 2] * v)
                t = onto[1, 0] + (onto[1, 1] * u + onto[1, 2] * v)
                for k in range(3):
                    corner[n + m, k], corner[n + m, 3 + k] = mine[k], theirs[k]
                weight[n + m, 0], weight[n + m, 1], weight[n + m, 2] = 1.0 - (u + v), u, v
                weight[n + m, 3], weight[n + m, 4], weight[n + m, 5] = -(1.0 - (s + t)), -s, -t
        n += many
    return n

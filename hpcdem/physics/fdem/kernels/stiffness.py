"""Tangent stiffness of elements and of joints: what the forces of elements.py and joints.py change by
when corners move, per element and per joint.

An element, with B the operator that makes strains of the movements of its corners (t = e11 + e22, d = e11 - e22,
g = 2 e12, which splits sigma : e into three squares):

    K = sum over its triangles of A [mu (d d^T + g g^T) + (grad N_i . sigma grad N_j) 1] + A (lambda + mu) t t^T

For a triangle t is its own, for an overlay of a quad (two triangles, halved) the mean by area: the mixed discretisation
of elements.py, Marti & Cundall 1982. With small strains gradients are those of the mesh and the second term (the stress
turns with the element) is left out: then K is the exact derivative of the forces, which are linear. With large strains
gradients and areas are the present ones, and K the derivative up to terms of the order of the strain.

A joint: K = sum over its three points of W [o; s]^T C [o; s], C: derivative of (sigma, tau) by opening and slip over
the length. Friction makes tau depend on the opening, so C is not symmetric; that the mid-line turns is left out. Behind
the peak C is the derivative of `joint_law.point` from what the point remembers of the last balance: along the curve,
which falls, where damage grows, else along the line through the origin.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels import joint_law, joints
from hpcdem.physics.fdem.kernels.elements import (
    LAMBDA,
    PARTS,
    Q_AREA,
    Q_LAMBDA,
    Q_TWO_MU,
    TWO_MU,
    quad_stress,
    triangle_stress,
)
from hpcdem.physics.fdem.kernels.joints import INTACT


@njit(cache=True, error_model="numpy")
def gradients(x, i, j, k, c, at, small, g):
    """Gradients (3, 2) [1/m] of the shape functions of a triangle with the corners i, j, k of the row x (flat), and its
    area: those of the mesh, whose inverse matrix begins at c[at], or the present ones."""
    if small:
        a, b, p, d = c[at], c[at + 1], c[at + 2], c[at + 3]
        area = 0.5 / (a * d - b * p)
    else:
        ux, uy, wx, wy = (
            x[2 * j] - x[2 * i],
            x[2 * j + 1] - x[2 * i + 1],
            x[2 * k] - x[2 * i],
            x[2 * k + 1] - x[2 * i + 1],
        )
        det = ux * wy - uy * wx
        a, b, p, d = wy / det, -wx / det, -uy / det, ux / det
        area = 0.5 * det
    g[1, 0], g[1, 1], g[2, 0], g[2, 1] = a, b, p, d
    g[0, 0], g[0, 1] = -a - p, -b - d
    return area


@njit(cache=True, error_model="numpy")
def _shear_part(g, area, mu, stress, small, at, out):
    """Add the parts of K that belong to one triangle; at (3,): its corners in the element."""
    for i in range(3):
        for j in range(3):
            gx, gy, hx, hy = g[i, 0], g[i, 1], g[j, 0], g[j, 1]
            # d = (gx, -gy), g = (gy, gx) for a movement of the corner
            xx, yy = area * mu * (gx * hx + gy * hy), area * mu * (gy * hy + gx * hx)
            xy, yx = area * mu * (gy * hx - gx * hy), area * mu * (gx * hy - gy * hx)
            if not small:
                turn = area * (gx * (stress[0] * hx + stress[2] * hy) + gy * (stress[2] * hx + stress[1] * hy))
                xx += turn
                yy += turn
            p, q = 2 * at[i], 2 * at[j]
            out[p, q] += xx
            out[p, q + 1] += xy
            out[p + 1, q] += yx
            out[p + 1, q + 1] += yy


@njit(cache=True, nogil=True, error_model="numpy")
def triangles(rows, x, c, s0, small, out):
    """K (n, 6, 6) [N/m per m] of triangles. rows (n,): their storage rows in x; c (n, 12), s0 (n, 4): their constants
    and initial stresses, see elements.py."""
    g, stress, at = np.empty((3, 2)), np.empty(4), np.arange(3)
    for i in range(len(rows)):
        xy, k = x[rows[i]], out[i]
        k[:] = 0.0
        area = gradients(xy, 0, 1, 2, c[i], 0, small, g)
        triangle_stress(xy, c[i], s0[i], small, stress)
        mu = 0.5 * c[i, TWO_MU]
        _shear_part(g, area, mu, stress, small, at, k)
        bulk = area * (c[i, LAMBDA] + mu)
        for p in range(6):
            for q in range(6):
                k[p, q] += bulk * g[p // 2, p % 2] * g[q // 2, q % 2]


@njit(cache=True, nogil=True, error_model="numpy")
def quads(rows, x, c, s0, small, out):
    """The same for quads: K (n, 8, 8); c (n, 32). The stress that turns is the mean of the quad."""
    g, stress, mean, at = np.empty((3, 2)), np.empty(4), np.empty(8), np.empty(3, np.int64)
    for i in range(len(rows)):
        xy, k = x[rows[i]], out[i]
        k[:] = 0.0
        quad_stress(xy, c[i], s0[i], small, stress)
        mu = 0.5 * c[i, Q_TWO_MU]
        for overlay in range(2):
            areas = now = 0.0
            mean[:] = 0.0
            for p in (2 * overlay, 2 * overlay + 1):
                for q in range(3):
                    at[q] = PARTS[p, q]
                area = gradients(xy, at[0], at[1], at[2], c[i], 4 * p, small, g)
                _shear_part(g, 0.5 * area, mu, stress, small, at, k)
                weight = c[i, Q_AREA + p]
                areas += weight
                now += area
                for q in range(3):
                    mean[2 * at[q]] += weight * g[q, 0]
                    mean[2 * at[q] + 1] += weight * g[q, 1]
            bulk = 0.5 * now * (c[i, Q_LAMBDA] + mu) / (areas * areas)
            for p in range(8):
                for q in range(8):
                    k[p, q] += bulk * mean[p] * mean[q]


@njit(cache=True, nogil=True, error_model="numpy")
def intact_joints(slots, face, at, kind, state, where, cells, x, table, out, left):
    """K (n, 8, 8) [N/m per m] of the joints in these slots, for the ends a, b of this side, then p, q of the other (p
    faces b), and how much is left (n,) to the peak at the worst point; negative behind it, also where a joint has a
    history of that."""
    flat = x.reshape(x.size)
    row = np.empty((2, 8))
    for i in range(len(slots)):
        slot = slots[i]
        f, p = face[slot], at[slot]
        r, k = where[f // 4], f % 4
        k2 = (k + 1) % (4 if cells[f // 4, 3] >= 0 else 3)
        tx, ty, h2, oa, sa, ob, sb = joints.openings(
            x[r, 2 * k], x[r, 2 * k + 1], x[r, 2 * k2], x[r, 2 * k2 + 1], flat[p], flat[p + 1], flat[p + 2], flat[p + 3]
        )
        inverse = 1.0 / h2
        oa, sa, ob, sb = oa * inverse, sa * inverse, ob * inverse, sb * inverse
        unit = math.sqrt(inverse)
        tx, ty = tx * unit, ty * unit
        law = table[kind[slot]]
        out[i] = 0.0
        left[i] = 1.0 if state[slot] == INTACT else -1.0
        for point in range(3):
            near = joints.NEAR if point == 0 else (0.5 if point == 1 else joints.FAR)
            far = 1.0 - near
            weight = 8.0 / 18.0 if point == 1 else 5.0 / 18.0
            normal, rub, shear, here, _ = joint_law.intact_slopes(near * oa + far * ob, near * sa + far * sb, law)
            left[i] = min(left[i], here)
            for end, share in enumerate((-near, -far, far, near)):
                row[0, 2 * end], row[0, 2 * end + 1] = share * ty, -share * tx
                row[1, 2 * end], row[1, 2 * end + 1] = share * tx, share * ty
            for m in range(8):
                for n in range(8):
                    out[i, m, n] += weight * (
                        row[0, m] * normal * row[0, n] + row[1, m] * (rub * row[0, n] + shear * row[1, n])
                    )


@njit(cache=True, nogil=True, error_model="numpy")
def yielded_joints(slots, face, at, kind, history, where, cells, x, table, beyond, out):
    """`intact_joints` for joints that are, or come, behind their peak: K (n, 8, 8), from their histories (slots, 14),
    zero for those that have not passed it."""
    flat = x.reshape(x.size)
    row = np.empty((2, 8))
    for i in range(len(slots)):
        slot = slots[i]
        f, p = face[slot], at[slot]
        r, k = where[f // 4], f % 4
        k2 = (k + 1) % (4 if cells[f // 4, 3] >= 0 else 3)
        tx, ty, h2, oa, sa, ob, sb = joints.openings(
            x[r, 2 * k], x[r, 2 * k + 1], x[r, 2 * k2], x[r, 2 * k2 + 1], flat[p], flat[p + 1], flat[p + 2], flat[p + 3]
        )
        h = math.sqrt(h2)
        inverse = 1.0 / h
        oa, sa, ob, sb = oa * inverse, sa * inverse, ob * inverse, sb * inverse
        tx, ty = tx * inverse, ty * inverse
        law, more, past = table[kind[slot]], beyond[kind[slot]], history[slot]
        out[i] = 0.0
        for point in range(3):
            near = joints.NEAR if point == 0 else (0.5 if point == 1 else joints.FAR)
            far = 1.0 - near
            weight = h * (8.0 / 18.0 if point == 1 else 5.0 / 18.0)
            sigma_o, sigma_s, tau_o, tau_s = joints.slopes(
                near * oa + far * ob, near * sa + far * sb, h, law, more, past, point
            )
            for end, share in enumerate((-near, -far, far, near)):
                row[0, 2 * end], row[0, 2 * end + 1] = share * ty, -share * tx
                row[1, 2 * end], row[1, 2 * end + 1] = share * tx, share * ty
            for m in range(8):
                for n in range(8):
                    out[i, m, n] += weight * (
                        row[0, m] * (sigma_o * row[0, n] + sigma_s * row[1, n])
                        + row[1, m] * (tau_o * row[0, n] + tau_s * row[1, n])
                    )

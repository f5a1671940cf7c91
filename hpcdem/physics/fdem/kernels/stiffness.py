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
the peak C is the derivative of `laws.yielded_point` from what the point remembers of the last balance: along the curve,
which falls, where damage grows, else along the line through the origin.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels import joints, laws
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

LEAST = 1e-3
"""Part of the slope at the origin that a joint point keeps in the tangent near and beyond its peak."""
FLAT = 1e-12
"""Opening and slip over the length of a joint that are rounding."""


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


@njit(cache=True, error_model="numpy")
def slopes(o, s, kop, tensile, overlay, tan_phi, cohesion, half_shear):
    """Derivatives of laws.intact_point: sigma by o, tau by o, tau by s, and how much is left to the peak. What has no
    strength and lies flat is closed and sticks: which way it moves rounding would say."""
    sigma, _, left = laws.intact_point(o, s, kop, tensile, overlay, tan_phi, cohesion, half_shear)
    r = o * kop
    flat = abs(o) <= FLAT and abs(s) <= FLAT
    normal = overlay if o < 0.0 or (flat and tensile == 0.0) else 2.0 * tensile * kop * max(1.0 - r, LEAST)
    if flat and cohesion == 0.0:
        return normal, 0.0, 2.0 * half_shear if tan_phi > 0.0 else 0.0, 1.0
    limit = max(cohesion - sigma * tan_phi, 0.0)
    peak = max(limit if sigma < 0.0 else cohesion, laws.TINY)
    q = abs(s) * half_shear / peak
    shear = limit * half_shear / peak * 2.0 * max(1.0 - q, LEAST)
    rub = 0.0
    if q < 1.0 and limit > 0.0:
        rub = -tan_phi * (q * q if sigma < 0.0 else q * (2.0 - q)) * (1.0 if s > 0.0 else -1.0)
    return normal, rub * normal, shear, left


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
            normal, rub, shear, here = slopes(
                near * oa + far * ob, near * sa + far * sb, law[joints.KOP], law[joints.TENSILE], law[joints.OVERLAY],
                law[joints.TAN_PHI], law[joints.COHESION], law[joints.HALF_SHEAR],
            )  # fmt: skip
            left[i] = min(left[i], here)
            for end, share in enumerate((-near, -far, far, near)):
                row[0, 2 * end], row[0, 2 * end + 1] = share * ty, -share * tx
                row[1, 2 * end], row[1, 2 * end + 1] = share * tx, share * ty
            for m in range(8):
                for n in range(8):
                    out[i, m, n] += weight * (
                        row[0, m] * normal * row[0, n] + row[1, m] * (rub * row[0, n] + shear * row[1, n])
                    )


@njit(cache=True, error_model="numpy")
def softening_slope(d):
    """Derivative of laws.softening by the damage d, 0 beyond its ends."""
    if d <= 0.0 or d >= 1.0:
        return 0.0
    k, power, rest = (laws.A + laws.B - 1.0) / (laws.A + laws.B), laws.RISE / laws.FALL, 1.0 - d
    e = math.exp(d * power)
    fifth = rest**5
    return -k * power * e * (laws.A * rest + laws.B * fifth * rest) - (1.0 - k * e) * (laws.A + 6.0 * laws.B * fifth)


@njit(cache=True, error_model="numpy")
def yielded_slopes(
    o, s, h, kop, tensile, overlay, tan_phi, cohesion, per_o_t, per_s_t, per_kop, per_half_shear, o_u, s_u, damage
):
    """Derivatives [Pa/m] of sigma and tau of laws.yielded_point by o and s: sigma by o, by s, tau by o, by s."""
    per_h, size, sign = 1.0 / h, abs(s), 1.0 if s >= 0.0 else -1.0
    now_o, now_s, now_d, _, _ = laws.damaged_point(
        o, s, h, per_h, kop, tensile, overlay, tan_phi, cohesion, per_o_t, per_s_t, per_kop, per_half_shear, o_u, s_u,
        damage,
    )  # fmt: skip
    s_p = laws.slip_at_peak(o, h, per_h, overlay, tan_phi, cohesion, per_half_shear)
    rise = -overlay * tan_phi * per_half_shear if o < 0.0 else 0.0  # of s_p by o
    d_o = d_s = 0.0
    if now_d > damage and now_d < 1.0:
        first = max(o - h * per_kop, 0.0) * per_o_t if tensile > 0.0 else 0.0
        second = max(size - s_p, 0.0) * per_s_t
        d_o = (first * per_o_t - second * per_s_t * rise) / now_d
        d_s = second * per_s_t * sign / now_d
    f, fall = laws.softening(now_d), softening_slope(now_d)
    r = o * per_h * kop
    sigma, _ = laws.softened_point(
        o, s, h, per_h, kop, tensile, overlay, tan_phi, cohesion, per_half_shear, now_o, now_s, f
    )
    if o < 0.0:
        sigma_o, sigma_s = overlay * per_h, 0.0
    else:
        if now_o > 0.0:
            share, slope = (o / now_o, 1.0 / now_o) if o < now_o else (1.0, 0.0)
        else:
            share, slope = r * (2.0 - r), 2.0 * (1.0 - r) * kop * per_h
        sigma_o, sigma_s = tensile * (fall * d_o * share + f * slope), tensile * fall * d_s * share
    limit = f * cohesion - sigma * tan_phi
    limit_o, limit_s = cohesion * fall * d_o - tan_phi * sigma_o, cohesion * fall * d_s - tan_phi * sigma_s
    if limit <= 0.0:
        limit = limit_o = limit_s = 0.0
    share_o = 0.0
    if now_s > 0.0:
        share, share_s = (size / now_s, 1.0 / now_s) if size < now_s else (1.0, 0.0)
    else:
        q, per = size / max(s_p, laws.TINY), 1.0 / max(s_p, laws.TINY)
        share, share_s, share_o = q * (2.0 - q), 2.0 * (1.0 - q) * per, -2.0 * (1.0 - q) * q * per * rise
    return (
        sigma_o, sigma_s, sign * (limit_o * share + limit * share_o), sign * limit_s * share + limit * share_s,
    )  # fmt: skip


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
            sigma_o, sigma_s, tau_o, tau_s = yielded_slopes(
                near * oa + far * ob, near * sa + far * sb, h, law[joints.KOP], law[joints.TENSILE],
                law[joints.OVERLAY], law[joints.TAN_PHI], law[joints.COHESION], more[joints.PER_O_T],
                more[joints.PER_S_T], more[joints.PER_KOP], more[joints.PER_HALF_SHEAR], past[joints.OPENED + point],
                past[joints.SLIPPED + point], past[joints.DAMAGE + point],
            )  # fmt: skip
            for end, share in enumerate((-near, -far, far, near)):
                row[0, 2 * end], row[0, 2 * end + 1] = share * ty, -share * tx
                row[1, 2 * end], row[1, 2 * end + 1] = share * tx, share * ty
            for m in range(8):
                for n in range(8):
                    out[i, m, n] += weight * (
                        row[0, m] * (sigma_o * row[0, n] + sigma_s * row[1, n])
                        + row[1, m] * (tau_o * row[0, n] + tau_s * row[1, n])
                    )

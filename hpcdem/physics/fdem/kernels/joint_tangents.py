"""Tangent stiffness of joints: what their forces change by when corners move; of elements: elements/tangent.py.

A joint of the plane: K = sum over its three points of W [o; s]^T C [o; s], C: derivative of (sigma, tau) by opening and
slip over the length. Friction makes tau depend on the opening, so C is not symmetric; that the mid-line turns is left
out. In space: K = sum over its points of A / 3 N_a N_b C, with the traction t = sigma n + tau s / |s| at opening o,
slip s:

    C = sigma_o n n^T + sigma_s n m^T + tau_o m n^T + tau_s m m^T + tau / |s| (1 - n n^T - m m^T),   m = s / |s|

Behind the peak the slopes are those of `joint_law.point` from what the point remembers of the last balance: along the
curve, which falls, where damage grows, else along the line through the origin.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels import joint_law, joints, laws
from hpcdem.physics.fdem.kernels.joints import INTACT
from hpcdem.physics.fdem.kernels.joints_space import mid_edges, opened, parted, slopes, unloaded
from hpcdem.physics.fdem.tetrahedra import FACES, ROW, STRIDE

POINTS = 3
"""Gauss points of a joint of triangles."""


@njit(cache=True, nogil=True, error_model="numpy")
def intact_edges(slots, face, at, cells, kind, state, history, where, x, table, beyond, out, left):
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
def yielded_edges(slots, face, at, cells, kind, state, history, where, x, table, beyond, out):
    """`intact_edges` for joints that are, or come, behind their peak: K (n, 8, 8), from their histories (slots, 14),
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


@njit(cache=True, error_model="numpy")
def _add(area, g, nx, ny, nz, mx, my, mz, sigma_o, sigma_s, tau_o, tau_s, aside, c, out):
    """Add what point g brings to K (18, 18): of a, b, c on this side, p, q, r on the other."""
    n, m = (nx, ny, nz), (mx, my, mz)
    for i in range(3):
        for j in range(3):
            unit = 1.0 if i == j else 0.0
            c[i, j] = (
                n[i] * (sigma_o * n[j] + sigma_s * m[j]) + m[i] * (tau_o * n[j] + tau_s * m[j])
                + aside * (unit - n[i] * n[j] - m[i] * m[j])
            )  # fmt: skip
    for a in range(6):
        w = _share(a, g)
        for b in range(6):
            both = area / 3.0 * w * _share(b, g)
            for i in range(3):
                for j in range(3):
                    out[3 * a + i, 3 * b + j] += both * c[i, j]


@njit(cache=True, error_model="numpy")
def _share(corner, g):
    """How what a corner does counts at point g, near the corner g of this side; r is opposite b, q opposite c."""
    if corner < 3:
        return -(2.0 / 3.0 if corner == g else 1.0 / 6.0)
    over = 0 if corner == 3 else (2 if corner == 4 else 1)
    return 2.0 / 3.0 if over == g else 1.0 / 6.0


@njit(cache=True, error_model="numpy")
def _face(x, r, k, link, d):
    """Unit normal and area of a joint at face k of the storage row r, see `joints_space.opened`; into d (3, 3) what the
    other side is away at its points."""
    a, b, c = ROW * r + STRIDE * FACES[k, 0], ROW * r + STRIDE * FACES[k, 1], ROW * r + STRIDE * FACES[k, 2]
    p, q, e = link[0], link[1], link[2]
    found = opened(
        x[a], x[a + 1], x[a + 2], x[b], x[b + 1], x[b + 2], x[c], x[c + 1], x[c + 2], x[p], x[p + 1], x[p + 2],
        x[q], x[q + 1], x[q + 2], x[e], x[e + 1], x[e + 2],
    )  # fmt: skip
    d[0, 0], d[0, 1], d[0, 2] = found[4], found[5], found[6]
    d[1, 0], d[1, 1], d[1, 2] = found[7], found[8], found[9]
    d[2, 0], d[2, 1], d[2, 2] = found[10], found[11], found[12]
    return found[0], found[1], found[2], found[3]


@njit(cache=True, nogil=True, error_model="numpy")
def intact_triangles(slots, face, link, sizes, kind, state, history, where, x, table, beyond, out, left):
    """K (n, 18, 18) [N/m] of the joints in these slots, for the corners a, b, c of this side, then p, q, r of the other
    (opposite a, c, b), and how much is left (n,) to the peak at the worst point; negative behind it, also where a joint
    has a history of that."""
    flat, d, c = x.reshape(x.size), np.empty((POINTS, 3)), np.empty((3, 3))
    for i in range(len(slots)):
        slot = slots[i]
        f, per_h, law = face[slot], sizes[slot], table[kind[slot]]
        nx, ny, nz, area = _face(flat, where[f // 4], f % 4, link[slot], d)
        out[i] = 0.0
        left[i] = 1.0 if state[slot] == INTACT else -1.0
        for g in range(POINTS):
            o, sx, sy, sz, size = parted(d[g, 0], d[g, 1], d[g, 2], nx, ny, nz)
            normal, rub, shear, here, tau = joint_law.intact_slopes(o * per_h, size * per_h, law)
            left[i] = min(left[i], here)
            aside = abs(tau) / size if size > laws.TINY else shear * per_h
            per = 1.0 / (size + laws.TINY)
            _add(
                area, g, nx, ny, nz, sx * per, sy * per, sz * per, normal * per_h, 0.0, rub * per_h, shear * per_h,
                aside, c, out[i],
            )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def yielded_triangles(slots, face, link, sizes, kind, state, history, where, x, table, beyond, out):
    """`intact_triangles` for joints that are, or come, behind their peak: K (n, 18, 18), from their histories (slots,
    14), zero for those that have not passed it."""
    flat, d, c = x.reshape(x.size), np.empty((POINTS, 3)), np.empty((3, 3))
    for i in range(len(slots)):
        slot = slots[i]
        f, h = face[slot], 1.0 / sizes[slot]
        law, more, past = table[kind[slot]], beyond[kind[slot]], history[slot]
        nx, ny, nz, area = _face(flat, where[f // 4], f % 4, link[slot], d)
        own, over = ROW * where[f // 4] + STRIDE * FACES[f % 4], link[slot]
        mid = mid_edges(flat, own[0], own[1], own[2], over[0], over[1], over[2])
        out[i] = 0.0
        for g in range(POINTS):
            o, sx, sy, sz, size = parted(d[g, 0], d[g, 1], d[g, 2], nx, ny, nz)
            sx, sy, sz, size = unloaded(sx, sy, sz, size, mid, law, past, g)
            sigma_o, sigma_s, tau_o, tau_s, tau = slopes(o, size, h, law, more, past, g)
            aside = tau / size if size > laws.TINY else tau_s
            per = 1.0 / (size + laws.TINY)
            _add(area, g, nx, ny, nz, sx * per, sy * per, sz * per, sigma_o, sigma_s, tau_o, tau_s, aside, c, out[i])

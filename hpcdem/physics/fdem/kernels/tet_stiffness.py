"""Tangent stiffness of tetrahedra and of the joints between them: what stiffness.py and plastic_stiffness.py are in the
plane, with their formulas.

    K_ab = V [lambda g_a g_b^T + mu g_b g_a^T + (mu g_a . g_b + g_a . sigma g_b) 1],   g_a = grad N_a

With small strains gradients are those of the mesh and the term with the stress is left out.

Where stresses flow dr = T ds holds along the principal axes of the trial stress, T: `principal_slopes`, and for the
shear between two of them

    d s_ij = G (r_i - r_j) / (s_i - s_j) d g_ij;   if s_i = s_j: G (T_ii - T_ij) d g_ij.

A joint: K = sum over its points of A / 3 N_a N_b C, with the traction t = sigma n + tau s / |s| at opening o, slip s:

    C = sigma_o n n^T + sigma_s n m^T + tau_o m n^T + tau_s m m^T + tau / |s| (1 - n n^T - m m^T),   m = s / |s|
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hpcdem.numerics.lanes import CAPACITY, U, lane
from hpcdem.physics.fdem.kernels import joint_law, laws, tets
from hpcdem.physics.fdem.kernels.joints import INTACT
from hpcdem.physics.fdem.kernels.joints_space import mid_edges, opened, parted, slopes, unloaded
from hpcdem.physics.fdem.kernels.plastic_stiffness import KEPT, principal_slopes
from hpcdem.physics.fdem.kernels.plasticity import N_PHI, N_PSI, STRENGTH, TENSILE
from hpcdem.physics.fdem.kernels.tets import LAMBDA, TWO_MU
from hpcdem.physics.fdem.tetrahedra import FACES, ROW, STRIDE

_PER = lane(1)
POINTS = 3
"""Gauss points of a joint."""


@njit(cache=True, error_model="numpy")
def gradients(x, c, small, g):
    """Gradients (4, 3) [1/m] of the shape functions of a tetrahedron by its rows of x and c, and its volume: those of
    the mesh, or the present ones."""
    a = np.empty((3, 3))
    if small:
        for i in range(3):
            for j in range(3):
                a[i, j] = c[3 * i + j]
        volume = 1.0 / tets.per_volume(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8])
    else:
        m = np.empty((3, 3))
        for k in range(3):
            for axis in range(3):
                m[axis, k] = x[STRIDE * (k + 1) + axis] - x[axis]
        for i in range(3):
            for j in range(3):
                p, q, r, s = (j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3
                a[i, j] = m[p, r] * m[q, s] - m[p, s] * m[q, r]
        det = m[0, 0] * a[0, 0] + m[1, 0] * a[0, 1] + m[2, 0] * a[0, 2]
        for i in range(3):
            for j in range(3):
                a[i, j] /= det
        volume = det / 6.0
    for j in range(3):
        g[0, j] = -(a[0, j] + a[1, j] + a[2, j])
        g[1, j], g[2, j], g[3, j] = a[0, j], a[1, j], a[2, j]
    return volume


@njit(cache=True, error_model="numpy")
def trial(x, c, s0, small, lanes, stress):
    """Stress (6,) [Pa] of an elastic tetrahedron in the frame that turns with it, and that frame."""
    for k in range(ROW):
        lanes[tets.X + U(k) * _PER] = x[k]
    e11, e22, e12, e33, e13, e23, r = tets.strain(
        lanes, tets.X, c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], small
    )
    p, m = c[LAMBDA] * (e11 + (e22 + e33)), c[TWO_MU]
    stress[0], stress[1], stress[2] = s0[0] + (p + m * e11), s0[1] + (p + m * e22), s0[2] + m * e12
    stress[3], stress[4], stress[5] = s0[3] + (p + m * e33), s0[4] + m * e13, s0[5] + m * e23
    return r


@njit(cache=True, nogil=True, error_model="numpy")
def elastic(rows, x, c, s0, small, out):
    """K (n, 12, 12) [N/m] of tetrahedra. rows (n,): their storage rows in x; c (n, 16), s0 (n, 8): their constants and
    stresses without strain, see tets.py."""
    g, stress, lanes = np.empty((4, 3)), np.empty(6), np.zeros(tets.LANES * CAPACITY)
    for i in range(len(rows)):
        xyz, k, lame, mu = x[rows[i]], out[i], c[i, LAMBDA], 0.5 * c[i, TWO_MU]
        volume = gradients(xyz, c[i], small, g)
        r = trial(xyz, c[i], s0[i], small, lanes, stress)
        xx, yy, xy, zz, xz, yz = tets.turned(stress[0], stress[1], stress[2], stress[3], stress[4], stress[5], r)
        for a in range(4):
            tx = xx * g[a, 0] + xy * g[a, 1] + xz * g[a, 2]
            ty = xy * g[a, 0] + yy * g[a, 1] + yz * g[a, 2]
            tz = xz * g[a, 0] + yz * g[a, 1] + zz * g[a, 2]
            for b in range(4):
                both = mu * (g[a, 0] * g[b, 0] + g[a, 1] * g[b, 1] + g[a, 2] * g[b, 2])
                if not small:
                    both += tx * g[b, 0] + ty * g[b, 1] + tz * g[b, 2]
                for p in range(3):
                    for q in range(3):
                        value = lame * g[a, p] * g[b, q] + mu * g[b, p] * g[a, q]
                        k[3 * a + p, 3 * b + q] = volume * (value + both if p == q else value)


@njit(cache=True, nogil=True, error_model="numpy")
def trials(rows, x, c, s0, small, stress, turn):
    """Trial stresses (n, 3, 3) [Pa] of tetrahedra in the frames that turn with them, and these frames (n, 3, 3)."""
    lanes, s = np.zeros(tets.LANES * CAPACITY), np.empty(6)
    for i in range(len(rows)):
        r = trial(x[rows[i]], c[i], s0[i], small, lanes, s)
        for k in range(9):
            turn[i, k // 3, k % 3] = r[k]
        stress[i, 0, 0], stress[i, 1, 1], stress[i, 2, 2] = s[0], s[1], s[3]
        stress[i, 0, 1] = stress[i, 1, 0] = s[2]
        stress[i, 0, 2] = stress[i, 2, 0] = s[4]
        stress[i, 1, 2] = stress[i, 2, 1] = s[5]


@njit(cache=True, error_model="numpy")
def lost_by_flow(s, surface, lame, two_mu, slope, lost):
    """Into lost (6, 6) [Pa] what flow takes of the elastic stiffness along the principal axes of a trial stress s (3,)
    [Pa], for the strains 11, 22, 33 and the shears 12, 13, 23; slope (3, 3): room. Returns whether it flows."""
    r1, r2, r3, bits = principal_slopes(
        s[0], s[1], s[2], surface[N_PHI], surface[N_PSI], surface[STRENGTH], surface[TENSILE], lame + two_mu, lame,
        slope,
    )  # fmt: skip
    if bits == 0:
        return False
    r = (r1, r2, r3)
    lost[:] = 0.0
    for p in range(3):
        total = lame * (slope[p, 0] + slope[p, 1] + slope[p, 2])
        for q in range(3):
            lost[p, q] = (lame + two_mu if p == q else lame) - (total + two_mu * slope[p, q])
    for k in range(3):
        p, q = (0, 0, 1)[k], (1, 2, 2)[k]
        apart = s[q] - s[p]
        turn = (r[q] - r[p]) / apart if apart > 0.0 else slope[q, q] - slope[q, p]
        lost[3 + k, 3 + k] = 0.5 * two_mu * (1.0 - turn)
    return True


@njit(cache=True, error_model="numpy")
def strains_along(g, axes, b):
    """Into b (6, 12) the strains along axes (3, 3), by columns, per movement of the corners; g (4, 3): gradients."""
    for a in range(4):
        for axis in range(3):
            for p in range(3):
                along = g[a, 0] * axes[0, p] + g[a, 1] * axes[1, p] + g[a, 2] * axes[2, p]
                b[p, 3 * a + axis] = along * axes[axis, p]
            for k in range(3):
                p, q = (0, 0, 1)[k], (1, 2, 2)[k]
                b[3 + k, 3 * a + axis] = (g[a, 0] * axes[0, p] + g[a, 1] * axes[1, p] + g[a, 2] * axes[2, p]) * axes[
                    axis, q
                ] + (g[a, 0] * axes[0, q] + g[a, 1] * axes[1, q] + g[a, 2] * axes[2, q]) * axes[axis, p]


@njit(cache=True, nogil=True, error_model="numpy")
def plastic(rows, x, c, principal, axes, law, table, small, out):
    """Take from the stiffness out (n, 12, 12) of tetrahedra in the storage rows (n,) what their flow at these positions
    takes. principal (n, 3) [Pa]: trial stresses, ascending; axes (n, 3, 3): theirs in space, by columns; law (n,): row
    of the table (rows, 4) of yield surfaces. Returns how many flow."""
    g, slope, lost, b = np.empty((4, 3)), np.empty((3, 3)), np.empty((6, 6)), np.empty((6, 12))
    flowing = 0
    for i in range(len(rows)):
        if not lost_by_flow(principal[i], table[law[i]], c[i, LAMBDA], c[i, TWO_MU], slope, lost):
            continue
        flowing += 1
        volume = (1.0 - KEPT) * gradients(x[rows[i]], c[i], small, g)
        strains_along(g, axes[i], b)
        for m in range(12):
            for p in range(6):
                part = 0.0
                for q in range(6):
                    part += b[q, m] * lost[q, p]
                part *= volume
                for n in range(12):
                    out[i, m, n] -= part * b[p, n]
    return flowing


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
def intact_joints(slots, face, link, sizes, kind, state, where, x, table, out, left):
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
def yielded_joints(slots, face, link, sizes, kind, history, where, x, table, beyond, out):
    """`intact_joints` for joints that are, or come, behind their peak: K (n, 18, 18), from their histories (slots, 14),
    zero for those that have not passed it."""
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

"""What plastic flow takes from the tangent stiffness of elements: the derivative of the return of stresses that
plasticity.py makes (the consistent tangent of Simo & Taylor 1985, for a return in principal stresses: Clausen, Damkilde
& Andersen 2007).

The principal stresses r to which s1 <= s2 <= s3 return are linear in these as long as the same planes are active: dr =
T ds, with T from the formulas of plasticity.py. The axes turn with those of the trial stress, so the shear stress
between the axes of the high and the low stress in the plane changes by

    d s_hl = G (r_h - r_l) / (s_h - s_l) d g_hl

Along these axes dr = T D de in the plane; what is added to the elastic stiffness is A B^T (C - C_elastic) B. In a quad
B has the volume of the overlay (mixed discretisation); that its two triangles share their pressure afterwards makes no
forces, see plastic_quads.py.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels.elements import (
    FREE,
    LAMBDA,
    PARTS,
    Q_AREA,
    Q_FREE,
    Q_LAMBDA,
    Q_TWO_MU,
    TWO_MU,
    mean_trace,
    part_stretch,
    triangle_stretch,
)
from hpcdem.physics.fdem.kernels.plasticity import (
    HIGH,
    LOW,
    N_PHI,
    N_PSI,
    SIDE,
    STRENGTH,
    TENSILE,
    plane_stress_return,
    principal_return,
)
from hpcdem.physics.fdem.kernels.stiffness import gradients
from hpcdem.physics.fdem.kernels.strength import SHEAR_NOW, TENSION_NOW

KEPT = 1e-6
"""Part of the elastic stiffness that an element keeps in the tangent: at the tip of the surface there is none."""


@njit(cache=True, nogil=True, error_model="numpy")
def principal_slopes(s1, s2, s3, n, m, k, t, a, b, slopes):
    """Derivative T (3, 3) of what `plasticity.principal_return` gives by s1, s2, s3, and the stresses themselves; the
    same arguments. A stress inside has the unit matrix."""
    r1, r2, r3, bits = principal_return(s1, s2, s3, n, m, k, t, a, b)
    slopes[:] = 0.0
    p, along, aside, back = a - b * m - b * n + a * n * m, a - b * m, b * (1.0 - m), a * m - b
    if bits == 0:
        slopes[0, 0] = slopes[1, 1] = slopes[2, 2] = 1.0
    elif bits == SHEAR_NOW:
        if r1 == r2:
            per = back / (2.0 * p - (a - b))
            slopes[2, 0], slopes[2, 1], slopes[2, 2] = per, per, 1.0 - 2.0 * n * per
            slopes[0] = slopes[1] = n * slopes[2]
        elif r2 == r3:
            per = along / (2.0 * p - n * m * (a - b))
            slopes[0, 0], slopes[0, 1], slopes[0, 2] = 1.0 - 2.0 * per, n * per, n * per
            slopes[1] = slopes[2] = slopes[0] / n
        else:
            slopes[0, 0], slopes[0, 2] = 1.0 - along / p, n * along / p
            slopes[1, 0], slopes[1, 1], slopes[1, 2] = -aside / p, 1.0, n * aside / p
            slopes[2, 0], slopes[2, 2] = back / p, 1.0 - n * back / p
    elif bits == TENSION_NOW:
        if r1 < t and r2 < t:
            slopes[0, 0] = slopes[1, 1] = 1.0
            slopes[0, 2] = slopes[1, 2] = -b / a
        elif r1 < t:
            slopes[0, 0], slopes[0, 1], slopes[0, 2] = 1.0, -b / (a + b), -b / (a + b)
    elif n * t - k < r2 < t:
        det = a * a - b * b
        slopes[1, 0] = (-a * aside - back * b) / det
        slopes[1, 1] = 1.0
        slopes[1, 2] = ((a * n - (n * a - b)) * aside - (p - n * back) * b) / det
    return r1, r2, r3, bits


@njit(cache=True, nogil=True, error_model="numpy")
def _plane_slopes(low, high, n, m, k, t, a, b, slopes):
    """The same in plane stress, of the high stress in row and column 2 and of the low one in 0, and where they go."""
    t = min(t, k / n)
    r_low, r_high, where = plane_stress_return(low, high, n, m, k, t, a, b)
    slopes[:] = 0.0
    p, along, back = a - b * m - b * n + a * n * m, a - b * m, a * m - b
    if where == SIDE:
        slopes[2, 2], slopes[2, 0] = 1.0 - n * back / p, back / p
        slopes[0, 2], slopes[0, 0] = n * along / p, 1.0 - along / p
    elif where == HIGH and r_low < t:
        slopes[0, 0], slopes[0, 2] = 1.0, -b / a
    elif where == LOW and r_high > -k:
        slopes[2, 2], slopes[2, 0] = 1.0, -b / a
    elif where == 0.0:
        slopes[0, 0] = slopes[2, 2] = 1.0
    return r_low, r_high, where


@njit(cache=True, nogil=True, error_model="numpy")
def _lost(s11, s22, s12, s33, law, lame, two_mu, free, slopes, lost):
    """By how much the stiffness of a stress [Pa] is below the elastic one: lost (2, 2) of the high and the low stress
    in the plane by their strains, and of the shear between them, which is returned; then cosine and sine of twice the
    angle of the high one. False at the end: it does not flow."""
    mean, half = 0.5 * (s11 + s22), 0.5 * (s11 - s22)
    radius = math.sqrt(half * half + s12 * s12)
    high, low = mean + radius, mean - radius
    a, b = lame + two_mu, lame
    n, m, k, t = law[N_PHI], law[N_PSI], law[STRENGTH], law[TENSILE]
    if free != 0.0:
        h, g = 2, 0
        r_low, r_high, bits = _plane_slopes(low, high, n, m, k, t, a, b, slopes)
    elif s33 > high:
        h, g = 1, 0
        r1, r2, r3, bits = principal_slopes(low, high, s33, n, m, k, t, a, b, slopes)
        r_high, r_low = r2, r1
    elif s33 < low:
        h, g = 2, 1
        r1, r2, r3, bits = principal_slopes(s33, low, high, n, m, k, t, a, b, slopes)
        r_high, r_low = r3, r2
    else:
        h, g = 2, 0
        r1, r2, r3, bits = principal_slopes(low, s33, high, n, m, k, t, a, b, slopes)
        r_high, r_low = r3, r1
    if bits == 0:
        return 0.0, 1.0, 0.0, False
    for i, row in enumerate((h, g)):
        total = b * (slopes[row, 0] + slopes[row, 1] + slopes[row, 2])
        for j, column in enumerate((h, g)):
            lost[i, j] = (a if i == j else b) - (total + (a - b) * slopes[row, column])
    if radius > 0.0:
        turn, c2, s2 = (r_high - r_low) / (high - low), half / radius, s12 / radius
    else:
        turn, c2, s2 = slopes[h, h] - slopes[h, g], 1.0, 0.0
    return 0.5 * two_mu * (1.0 - turn), c2, s2, True


@njit(cache=True, nogil=True, error_model="numpy")
def _take(rows, count, c2, s2, lost, shear, weight, out):
    """Take weight B^T lost B from out; rows (3, 8): t = e_xx + e_yy, d = e_xx - e_yy, g = 2 e_xy by the movements of
    the first `count` / 2 corners, which become the strains along the principal axes, at twice whose angle c2, s2."""
    for p in range(count):
        t, d, g = rows[0, p], rows[1, p], rows[2, p]
        turned = d * c2 + g * s2
        rows[0, p], rows[1, p], rows[2, p] = 0.5 * (t + turned), 0.5 * (t - turned), g * c2 - d * s2
    weight *= 1.0 - KEPT
    for p in range(count):
        high = weight * (rows[0, p] * lost[0, 0] + rows[1, p] * lost[1, 0])
        low = weight * (rows[0, p] * lost[0, 1] + rows[1, p] * lost[1, 1])
        aside = weight * shear * rows[2, p]
        for q in range(count):
            out[p, q] -= high * rows[0, q] + low * rows[1, q] + aside * rows[2, q]


@njit(cache=True, nogil=True, error_model="numpy")
def triangles(rows, x, c, s0, law, table, small, out):
    """Take from the stiffness out (n, 6, 6) of triangles in the storage rows (n,) what their flow at these positions
    takes. c (n, 12); s0 (n, 4) [Pa]: stress without strain before the flow; law (n,): row of the table (rows, 4) of
    yield surfaces. Returns how many flow."""
    g, slopes, lost, b = np.empty((3, 2)), np.empty((3, 3)), np.empty((2, 2)), np.zeros((3, 8))
    flowing = 0
    for i in range(len(rows)):
        xy = x[rows[i]]
        cs, sn, e11, e22, e12 = triangle_stretch(xy, c[i], small)
        pressure, two_mu = c[i, LAMBDA] * (e11 + e22), c[i, TWO_MU]
        s11, s22 = s0[i, 0] + (pressure + two_mu * e11), s0[i, 1] + (pressure + two_mu * e22)
        shear, c2, s2, flows = _lost(
            s11, s22, s0[i, 2] + two_mu * e12, s0[i, 3] + pressure, table[law[i]], c[i, LAMBDA], two_mu, c[i, FREE],
            slopes, lost,
        )  # fmt: skip
        if not flows:
            continue
        flowing += 1
        area = gradients(xy, 0, 1, 2, c[i], 0, small, g)
        for k in range(3):
            b[0, 2 * k], b[0, 2 * k + 1] = g[k, 0], g[k, 1]
            b[1, 2 * k], b[1, 2 * k + 1] = g[k, 0], -g[k, 1]
            b[2, 2 * k], b[2, 2 * k + 1] = g[k, 1], g[k, 0]
        cc, ss = cs * cs - sn * sn, 2.0 * cs * sn
        _take(b, 6, cc * c2 - ss * s2, ss * c2 + cc * s2, lost, shear, area, out[i])
    return flowing


@njit(cache=True, nogil=True, error_model="numpy")
def quads(rows, x, c, s0, law, table, small, out):
    """The same for quads: out (n, 8, 8); c (n, 32); s0 (n, 16); law (n, 4). Returns how many triangles flow."""
    g, slopes, lost, b = np.empty((3, 2)), np.empty((3, 3)), np.empty((2, 2)), np.zeros((3, 8))
    mean, at = np.empty(8), np.empty(3, np.int64)
    flowing = 0
    for i in range(len(rows)):
        xy, lame, two_mu = x[rows[i]], c[i, Q_LAMBDA], c[i, Q_TWO_MU]
        for overlay in range(2):
            trace, areas = mean_trace(overlay, xy, c[i], small), 0.0
            mean[:] = 0.0
            for p in (2 * overlay, 2 * overlay + 1):
                gradients(xy, PARTS[p, 0], PARTS[p, 1], PARTS[p, 2], c[i], 4 * p, small, g)
                areas += c[i, Q_AREA + p]
                for k in range(3):
                    mean[2 * PARTS[p, k]] += c[i, Q_AREA + p] * g[k, 0]
                    mean[2 * PARTS[p, k] + 1] += c[i, Q_AREA + p] * g[k, 1]
            for p in (2 * overlay, 2 * overlay + 1):
                _, _, _, _, cs, sn, e11, e22, e12 = part_stretch(p, xy, c[i], small)
                shift, pressure, o = 0.5 * (trace - (e11 + e22)), lame * trace, 4 * p
                s11 = s0[i, o] + (pressure + two_mu * (e11 + shift))
                s22 = s0[i, o + 1] + (pressure + two_mu * (e22 + shift))
                shear, c2, s2, flows = _lost(
                    s11, s22, s0[i, o + 2] + two_mu * e12, s0[i, o + 3] + pressure, table[law[i, p]], lame, two_mu,
                    c[i, Q_FREE], slopes, lost,
                )  # fmt: skip
                if not flows:
                    continue
                flowing += 1
                area = gradients(xy, PARTS[p, 0], PARTS[p, 1], PARTS[p, 2], c[i], 4 * p, small, g)
                b[:] = 0.0
                for k in range(8):
                    b[0, k] = mean[k] / areas
                for k in range(3):
                    at[k] = 2 * PARTS[p, k]
                    b[1, at[k]], b[1, at[k] + 1] = g[k, 0], -g[k, 1]
                    b[2, at[k]], b[2, at[k] + 1] = g[k, 1], g[k, 0]
                cc, ss = cs * cs - sn * sn, 2.0 * cs * sn
                _take(b, 8, cc * c2 - ss * s2, ss * c2 + cc * s2, lost, shear, 0.5 * area, out[i])
    return flowing

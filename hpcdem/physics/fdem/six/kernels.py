"""Forces, stress and stiffness of six-node triangles, at three Gauss points.

F = sum x_a grad N_a = R U there, stress = s0 + D (U - 1), viscous parts and the measure of strain as of triangles
(elements.py); f_a = -sum w det F stress F^-T grad N_a, with small strains -sum w stress grad N_a.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.physics.fdem.kernels import laws
from hpcdem.physics.fdem.kernels.elements import _energy

GAUSS, PARTS = 3, 4
# Columns of constants (n, 35): inverses of the reference matrix at the Gauss points and the centroids of the parts,
# weights of Gauss points [m2], lambda, 2 mu [Pa], viscosity [Pa s], whether the strain across the plane is free.
WEIGHT, LAMBDA, TWO_MU, ETA, FREE = 28, 28 + GAUSS, 29 + GAUSS, 30 + GAUSS, 31 + GAUSS
CONSTANTS = 32 + GAUSS


def _slopes() -> np.ndarray:
    """(7, 6, 2) derivatives of the shape functions by the second and the third area coordinate, at the Gauss points and
    the centroids of the parts. Those of the nodes between are 3/4 of the usual ones; the rest goes to the corners."""
    a, b = 2.0 / 3.0, 1.0 / 6.0
    of_parts = [(a, b, b), (b, a, b), (b, b, a), (1.0 / 3.0,) * 3]
    out = np.empty((GAUSS + PARTS, 6, 2))
    for k, (p, q, r) in enumerate([*of_parts[:3], *of_parts]):
        corners = np.array([[1.0 - 4.0 * p, 1.0 - 4.0 * p], [4.0 * q - 1.0, 0.0], [0.0, 4.0 * r - 1.0]])
        between = np.array([[4.0 * (p - q), -4.0 * q], [4.0 * r, 4.0 * q], [-4.0 * r, 4.0 * (p - r)]])
        out[k, :3] = corners + 0.125 * (between + between[[2, 0, 1]])
        out[k, 3:] = 0.75 * between
    return out


SLOPES = _slopes()


@njit(cache=True, error_model="numpy")
def _gradient(i, p, row, corner, x, c):
    """sum x_a grad N_a at the point p (11, 12, 21, 22)."""
    h11, h12, h21, h22, m = 0.0, 0.0, 0.0, 0.0, c[i, 4 * p : 4 * p + 4]
    for a in range(6):
        r, k, d, e = row[i, a], 2 * corner[i, a], SLOPES[p, a, 0], SLOPES[p, a, 1]
        h11, h12, h21, h22 = h11 + x[r, k] * d, h12 + x[r, k] * e, h21 + x[r, k + 1] * d, h22 + x[r, k + 1] * e
    return h11 * m[0] + h12 * m[2], h11 * m[1] + h12 * m[3], h21 * m[0] + h22 * m[2], h21 * m[1] + h22 * m[3]


@njit(cache=True, error_model="numpy")
def _strained(i, p, row, corner, x, c, s0, small):
    """F (11, 12, 21, 22), cosine and sine of its rotation, strain (11, 22, 12) and stress (11, 22, 12, 33) [Pa] before
    the rotation."""
    f11, f12, f21, f22 = _gradient(i, p, row, corner, x, c)
    cs, sn = laws.rotation(f11, f12, f21, f22)
    cs, sn = (1.0 if small else cs), (0.0 if small else sn)
    e11, e22, e12 = laws.stretch(f11, f12, f21, f22, cs, sn)
    s11, s22, s12, s33 = laws.hooke(e11, e22, e12, 0.0, c[i, LAMBDA], c[i, TWO_MU], 0.0)
    s33 = (1.0 - c[i, FREE]) * s33
    stress = s0[i, 0] + s11, s0[i, 1] + s22, s0[i, 2] + s12, s0[i, 3] + s33
    return (f11, f12, f21, f22), (cs, sn), (e11, e22, e12), stress


@njit(cache=True, nogil=True, error_model="numpy")
def _forces(t, threads, row, corner, x, v, c, s0, elastic, small, beta, force):
    n = len(row)
    for i in range(n * t // threads, n * (t + 1) // threads):
        for p in range(GAUSS):
            (f11, f12, f21, f22), (cs, sn), _, (s11, s22, s12, _) = _strained(i, p, row, corner, x, c, s0, small)
            g11, g12, g21, g22 = _gradient(i, p, row, corner, v, c)
            d11, d22, eta = cs * g11 + sn * g21, cs * g22 - sn * g12, c[i, ETA] + beta * c[i, TWO_MU]
            swell = beta * c[i, LAMBDA] * (d11 + d22)
            s11, s22 = elastic * s11 + (eta * d11 + swell), elastic * s22 + (eta * d22 + swell)
            s12 = elastic * s12 + 0.5 * eta * ((cs * g12 + sn * g22) + (cs * g21 - sn * g11))
            xx, yy, xy = laws.turned(s11, s22, s12, cs, sn)
            if small:
                f11, f12, f21, f22 = 1.0, 0.0, 0.0, 1.0
            p11, p12, p21, p22 = xx * f22 - xy * f12, xy * f11 - xx * f21, xy * f22 - yy * f12, yy * f11 - xy * f21
            w, m = c[i, WEIGHT + p], c[i, 4 * p : 4 * p + 4]
            t11, t12 = w * (p11 * m[0] + p12 * m[1]), w * (p11 * m[2] + p12 * m[3])
            t21, t22 = w * (p21 * m[0] + p22 * m[1]), w * (p21 * m[2] + p22 * m[3])
            for a in range(6):
                r, k = row[i, a], 2 * corner[i, a]
                force[r, k] -= t11 * SLOPES[p, a, 0] + t12 * SLOPES[p, a, 1]
                force[r, k + 1] -= t21 * SLOPES[p, a, 0] + t22 * SLOPES[p, a, 1]


@njit(cache=True, nogil=True, error_model="numpy")
def forces(threads, *args):
    """Add forces [N/m] to rows (n, 8). row, corner (m, 6): where each node is in the rows of x, v and force; c: see
    `CONSTANTS`; s0 (m, 4) [Pa]: stress without strain; elastic: 1, or 0 for viscous forces alone."""
    for t in range(threads):
        _forces(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def forces_threaded(threads, row, corner, x, v, c, s0, elastic, small, beta, force):
    """The same on several threads."""
    for t in prange(threads):
        _forces(t, threads, row, corner, x, v, c, s0, elastic, small, beta, force)


@njit(cache=True, nogil=True, error_model="numpy")
def stresses(row, corner, x, c, s0, small, stress, energy):
    """Stress xx, yy, xy, zz [Pa] at the centroids of the parts (m, 4, 4), and elastic energy (m,) [J/m]."""
    for i in range(len(row)):
        for p in range(GAUSS, GAUSS + PARTS):
            _, (cs, sn), _, (s11, s22, s12, s33) = _strained(i, p, row, corner, x, c, s0, small)
            xx, yy, xy = laws.turned(s11, s22, s12, cs, sn)
            out = stress[i, p - GAUSS]
            out[0], out[1], out[2], out[3] = xx, yy, xy, s33
        energy[i] = 0.0
        for p in range(GAUSS):
            _, _, (e11, e22, e12), _ = _strained(i, p, row, corner, x, c, s0, small)
            energy[i] += c[i, WEIGHT + p] * _energy(e11, e22, e12, c[i, LAMBDA], c[i, TWO_MU], s0[i])


@njit(cache=True, nogil=True, error_model="numpy")
def stiffness(row, corner, x, c, s0, small, out):
    """K (m, 12, 12) [N/m per m] as of triangles (stiffness.py)."""
    g = np.empty((6, 2))
    for i in range(len(row)):
        out[i] = 0.0
        for p in range(GAUSS):
            (f11, f12, f21, f22), (cs, sn), _, (s11, s22, s12, _) = _strained(i, p, row, corner, x, c, s0, small)
            xx, yy, xy = laws.turned(s11, s22, s12, cs, sn)
            if small:  # the mesh counts, and stress does not turn
                f11, f12, f21, f22, xx, yy, xy = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
            m, det, lam, mu = c[i, 4 * p : 4 * p + 4], f11 * f22 - f12 * f21, c[i, LAMBDA], 0.5 * c[i, TWO_MU]
            for a in range(6):
                gx = (SLOPES[p, a, 0] * m[0] + SLOPES[p, a, 1] * m[2]) / det
                gy = (SLOPES[p, a, 0] * m[1] + SLOPES[p, a, 1] * m[3]) / det
                g[a, 0], g[a, 1] = gx * f22 - gy * f21, gy * f11 - gx * f12
            w = c[i, WEIGHT + p] * det
            for a, b in np.ndindex((6, 6)):
                turn = g[a, 0] * (xx * g[b, 0] + xy * g[b, 1]) + g[a, 1] * (xy * g[b, 0] + yy * g[b, 1])
                both = mu * (g[a, 0] * g[b, 0] + g[a, 1] * g[b, 1]) + turn
                for k, q in np.ndindex((2, 2)):
                    each = lam * g[a, k] * g[b, q] + mu * g[a, q] * g[b, k]
                    out[i, 2 * a + k, 2 * b + q] += w * (each + (both if k == q else 0.0))

"""Forces and stress of six-node triangles, at three Gauss points.

F = sum x_a grad N_a = R U there, stress = s0 + D (U - 1), viscous parts and the measure of strain as of triangles
(elements.py); f_a = -sum w det F stress F^-T grad N_a, with small strains -sum w stress grad N_a. Their stiffness is in
elements/tangent.py. g: `kind.Tables`, not named here since the table of kinds is made with the columns below.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem.kernels import laws
from hpcdem.physics.fdem.kernels.elements import _energy

GAUSS, PARTS = 3, 4
# Columns of constants (n, 23): inverses of the reference matrix at the centroids of the parts, of which the first three
# are the Gauss points, areas [m2] for which these stand together (a third each), lambda, 2 mu [Pa], viscosity [Pa s],
# whether the strain across the plane is free.
AREA, LAMBDA, TWO_MU, ETA, FREE = (4 * PARTS + k for k in (0, GAUSS, GAUSS + 1, GAUSS + 2, GAUSS + 3))
CONSTANTS = FREE + 1


def _slopes() -> np.ndarray:
    """(4, 6, 2) derivatives of the shape functions by the second and the third area coordinate, at the centroids of the
    parts. Those of the nodes between are 3/4 of the usual ones; the rest goes to the corners."""
    a, b = 2.0 / 3.0, 1.0 / 6.0
    out = np.empty((PARTS, 6, 2))
    for k, (p, q, r) in enumerate([(a, b, b), (b, a, b), (b, b, a), (1.0 / 3.0,) * 3]):
        corners = np.array([[1.0 - 4.0 * p, 1.0 - 4.0 * p], [4.0 * q - 1.0, 0.0], [0.0, 4.0 * r - 1.0]])
        between = np.array([[4.0 * (p - q), -4.0 * q], [4.0 * r, 4.0 * q], [-4.0 * r, 4.0 * (p - r)]])
        out[k, :3] = corners + 0.125 * (between + between[[2, 0, 1]])
        out[k, 3:] = 0.75 * between
    return out


SLOPES = _slopes()


@njit(cache=True, error_model="numpy")
def gradient(i, p, place, x, c):
    """sum x_a grad N_a at the point p (11, 12, 21, 22); place (n, 6): where each node begins in flat x."""
    h11, h12, h21, h22, m = 0.0, 0.0, 0.0, 0.0, c[i, 4 * p : 4 * p + 4]
    for a in range(6):
        at, d, e = place[i, a], SLOPES[p, a, 0], SLOPES[p, a, 1]
        h11, h12, h21, h22 = h11 + x[at] * d, h12 + x[at] * e, h21 + x[at + 1] * d, h22 + x[at + 1] * e
    return h11 * m[0] + h12 * m[2], h11 * m[1] + h12 * m[3], h21 * m[0] + h22 * m[2], h21 * m[1] + h22 * m[3]


@njit(cache=True, error_model="numpy")
def strain(i, p, place, x, c, small):
    """F (11, 12, 21, 22), cosine and sine of its rotation, and strain (11, 22, 12) before the rotation."""
    f11, f12, f21, f22 = gradient(i, p, place, x, c)
    cs, sn = laws.rotation(f11, f12, f21, f22)
    cs, sn = (1.0 if small else cs), (0.0 if small else sn)
    return (f11, f12, f21, f22), (cs, sn), laws.stretch(f11, f12, f21, f22, cs, sn)


@njit(cache=True, error_model="numpy")
def _stress(i, e, c, said):
    """Stress (11, 22, 12, 33) [Pa] of a strain (11, 22, 12); said (4,): that without strain."""
    s11, s22, s12, s33 = laws.hooke(e[0], e[1], e[2], 0.0, c[i, LAMBDA], c[i, TWO_MU], 0.0)
    s33 = (1.0 - c[i, FREE]) * s33
    return said[0] + s11, said[1] + s22, said[2] + s12, said[3] + s33


@njit(cache=True, nogil=True, error_model="numpy")
def _forces(t, threads, g, from_v, to, v, s0, elastic, small, beta, force):
    place, x, c, v, force = g.place, g.x, g.c, v.reshape(v.size), force.reshape(force.size)
    n = len(place)
    for i in range(n * t // threads, n * (t + 1) // threads):
        for p in range(GAUSS):
            (f11, f12, f21, f22), (cs, sn), e = strain(i, p, place, x, c, small)
            s11, s22, s12, _ = _stress(i, e, c, s0[i, p])
            g11, g12, g21, g22 = gradient(i, p, from_v, v, c)
            d11, d22, eta = cs * g11 + sn * g21, cs * g22 - sn * g12, c[i, ETA] + beta * c[i, TWO_MU]
            swell = beta * c[i, LAMBDA] * (d11 + d22)
            s11, s22 = elastic * s11 + (eta * d11 + swell), elastic * s22 + (eta * d22 + swell)
            s12 = elastic * s12 + 0.5 * eta * ((cs * g12 + sn * g22) + (cs * g21 - sn * g11))
            xx, yy, xy = laws.turned(s11, s22, s12, cs, sn)
            if small:
                f11, f12, f21, f22 = 1.0, 0.0, 0.0, 1.0
            p11, p12, p21, p22 = xx * f22 - xy * f12, xy * f11 - xx * f21, xy * f22 - yy * f12, yy * f11 - xy * f21
            w, m = c[i, AREA + p] / 3.0, c[i, 4 * p : 4 * p + 4]
            t11, t12 = w * (p11 * m[0] + p12 * m[1]), w * (p11 * m[2] + p12 * m[3])
            t21, t22 = w * (p21 * m[0] + p22 * m[1]), w * (p21 * m[2] + p22 * m[3])
            for a in range(6):
                at = to[i, a]
                force[at] -= t11 * SLOPES[p, a, 0] + t12 * SLOPES[p, a, 1]
                force[at + 1] -= t21 * SLOPES[p, a, 0] + t22 * SLOPES[p, a, 1]


@on_threads
def forces(threads, g, *args):
    """Add forces [N/m] to rows (n, 8). from_v, to (m, 6): where velocities of each node begin, and its forces; s0
    (m, 3, 4) [Pa]: stress without strain at the Gauss points; elastic: 1, or 0 for viscous forces alone."""
    for t in prange(threads):
        _forces(t, threads, g, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def stresses(g, s0, small, stress, energy):
    """Stress xx, yy, xy, zz [Pa] at the centroids of the parts (m, 4, 4), and elastic energy (m,) [J/m]."""
    place, x, c, mean = g.place, g.x, g.c, np.empty(4)
    for i in range(len(place)):
        energy[i] = 0.0
        for p in range(PARTS):
            _, (cs, sn), e = strain(i, p, place, x, c, small)
            for k in range(4):
                mean[k] = s0[i, p, k] if p < GAUSS else (s0[i, 0, k] + s0[i, 1, k] + s0[i, 2, k]) / 3.0
            s11, s22, s12, s33 = _stress(i, e, c, mean)
            xx, yy, xy = laws.turned(s11, s22, s12, cs, sn)
            stress[i, p, 0], stress[i, p, 1], stress[i, p, 2], stress[i, p, 3] = xx, yy, xy, s33
            if p < GAUSS:
                energy[i] += c[i, AREA + p] / 3.0 * _energy(e[0], e[1], e[2], c[i, LAMBDA], c[i, TWO_MU], mean)

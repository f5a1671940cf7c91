"""Stability limits of the explicit scheme, and the fictitious masses of dynamic relaxation.

omega^2 of a corner of mass m is at most the sum of

- element: (3 / rho) (lambda + 2 mu) sum |grad N_l|^2 (2-D constant strain; of a quad: its worst triangle),
- joints: 2 k / m, k = half the largest penalty of each joint at the corner,
- contact: 2 k / m, k = 3 P (1 / h_t + 1 / h_c) L / 2 per face of length L, h: altitudes.

dt < (2 / omega) (sqrt(1 + xi^2) - xi) with viscous damping, xi = eta omega_e^2 / (2 (lambda + 2 mu) omega) +
c / (m omega), c: what the dashpots of the contacts can give at the corner, twice as much between two of them; and
(alpha / omega + beta omega_e^2 / omega) / 2 of Rayleigh damping.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels.elements import (
    ETA,
    LAMBDA,
    PARTS,
    Q_AREA,
    Q_ETA,
    Q_LAMBDA,
    Q_TWO_MU,
    Q_WEIGHT,
    TWO_MU,
    WEIGHT,
)


@njit(cache=True, nogil=True, error_model="numpy")
def gradients2(a, b, c, d):
    """Sum over the corners of |grad N|^2 [1/m2] of a triangle with the inverse reference matrix [[a, b], [c, d]]."""
    return a * a + b * b + c * c + d * d + (a + c) ** 2 + (b + d) ** 2


@njit(cache=True, nogil=True, error_model="numpy")
def _stable(omega2, omega_e2, eta, modulus, drag):
    """Time step of one corner."""
    if omega2 <= 0.0:
        return math.inf
    omega = math.sqrt(omega2)
    xi = 0.5 * eta * omega_e2 / (modulus * omega) + drag / omega
    return 2.0 / omega * (math.sqrt(1.0 + xi * xi) - xi)


@njit(cache=True, nogil=True, error_model="numpy")
def _omega_triangle(c):
    """Bound of omega^2 [1/s2] by the stiffness alone, true mass."""
    det = c[0] * c[3] - c[1] * c[2]
    rho = 6.0 * c[WEIGHT] * det  # m = rho A / 3, A = 1 / (2 det)
    return 3.0 / rho * (c[LAMBDA] + c[TWO_MU]) * gradients2(c[0], c[1], c[2], c[3])


@njit(cache=True, nogil=True, error_model="numpy")
def omegas2(c):
    """Return the bound of omega^2 [1/s2] of triangles (n,)."""
    out = np.empty(len(c))
    for i in range(len(c)):
        out[i] = _omega_triangle(c[i])
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _omega_quad(c):
    """Return the bound of omega^2 of a quad: the largest of its four triangles (the mean volume strain of an overlay
    stores less energy)."""
    area = mass = worst = 0.0
    for p in range(4):
        area += 0.5 * c[Q_AREA + p]
        mass += c[Q_WEIGHT + p]
        worst = max(worst, gradients2(c[4 * p], c[4 * p + 1], c[4 * p + 2], c[4 * p + 3]))
    return 3.0 * area / mass * (c[Q_LAMBDA] + c[Q_TWO_MU]) * worst


@njit(cache=True, nogil=True, error_model="numpy")
def corner_step(omega_e2, true_mass, mass, spring, dashpot, drag, eta, modulus):
    """Stable time step of a corner; added mass lowers what the element and the drag on its mass give in proportion."""
    own = omega_e2 * true_mass / mass
    return _stable(own + 2.0 * spring / mass, own, eta, modulus, (dashpot + 0.5 * drag * true_mass) / mass)


@njit(cache=True, nogil=True, error_model="numpy")
def time_step(triangles, quads, triangle_rows, quad_rows, first, springs, dashpots, drag, beta, safety, target, mass):
    """Largest stable time step over the corners of the owned elements [s].

    triangles, quads: tables of elements.py; first: storage row of the first owned element; springs (n_own, 4) [N/m per
    m] of joints and contact; dashpots (n_own, 4) [N s/m per m] of contact; drag [1/s], beta [s]: Rayleigh damping; mass
    (n, 4): true masses. With target > 0 masses are raised until safety times the limit is no less than it.
    """
    least = math.inf
    for i in range(len(triangle_rows) + len(quad_rows)):
        if i < len(triangle_rows):
            r, n, c = triangle_rows[i], 3, triangles[i]
            omega2, eta, modulus = _omega_triangle(c), c[ETA], c[LAMBDA] + c[TWO_MU]
        else:
            r, n, c = quad_rows[i - len(triangle_rows)], 4, quads[i - len(triangle_rows)]
            omega2, eta, modulus = _omega_quad(c), c[Q_ETA], c[Q_LAMBDA] + c[Q_TWO_MU]
        eta += beta * modulus
        for k in range(n):
            true, spring, dashpot = mass[r, k], springs[r - first, k], dashpots[r - first, k]
            dt = corner_step(omega2, true, true, spring, dashpot, drag, eta, modulus)
            while safety * dt < target:
                mass[r, k] *= max((target / (safety * dt)) ** 2, 1.0 + 1e-6)
                dt = corner_step(omega2, true, mass[r, k], spring, dashpot, drag, eta, modulus)
            least = min(least, dt)
    return least


@njit(cache=True, nogil=True, error_model="numpy")
def _row_sums(a, b, c, d, lam, mu, area, out):
    """Largest sum of |K| in the two rows of each corner of a constant-strain triangle, added to out (3,) [N/m per m]:
    K_(li)(mj) = A (lambda g_li g_mj + mu g_lj g_mi + mu delta_ij g_l . g_m)."""
    g = np.empty((3, 2))
    g[1, 0], g[1, 1], g[2, 0], g[2, 1] = a, b, c, d
    g[0, 0], g[0, 1] = -a - c, -b - d
    for k in range(3):
        most = 0.0
        for i in range(2):
            row = 0.0
            for m in range(3):
                both = g[k, 0] * g[m, 0] + g[k, 1] * g[m, 1]
                for j in range(2):
                    row += abs(lam * g[k, i] * g[m, j] + mu * g[k, j] * g[m, i] + (mu * both if i == j else 0.0))
            most = max(most, row)
        out[k] += area * most


@njit(cache=True, nogil=True, error_model="numpy")
def static_masses(triangles, quads, triangle_rows, quad_rows, first, springs, alpha, mass):
    """Fictitious masses for a time step of 1: m = 1.25 (1 + alpha) / 4 sum |K_ij| over a row of the stiffness of
    elements, joints and contacts.

    Gershgorin: omega^2 <= sum |K_ij| / m. Local damping makes a force that acts against the motion 1 + alpha times as
    large, so (1 + alpha) omega^2 must stay below 4; joints in a regular mesh reach the bound. 1.25: reserve.
    springs: as for `time_step`; both sides of a joint count.
    """
    factor = 0.25 * 1.25 * (1.0 + alpha)
    sums = np.empty(4)
    part = np.empty(3)
    for i in range(len(triangle_rows)):
        r, c = triangle_rows[i], triangles[i]
        part[:] = 0.0
        area = 0.5 / (c[0] * c[3] - c[1] * c[2])
        _row_sums(c[0], c[1], c[2], c[3], c[LAMBDA], 0.5 * c[TWO_MU], area, part)
        for k in range(3):
            mass[r, k] = factor * (part[k] + 2.0 * springs[r - first, k])
    for i in range(len(quad_rows)):
        r, c = quad_rows[i], quads[i]
        sums[:] = 0.0
        for p in range(4):
            part[:] = 0.0
            _row_sums(
                c[4 * p], c[4 * p + 1], c[4 * p + 2], c[4 * p + 3], c[Q_LAMBDA], 0.5 * c[Q_TWO_MU], 0.5 * c[Q_AREA + p],
                part,
            )  # fmt: skip
            for k in range(3):
                sums[PARTS[p, k]] += part[k]
        for k in range(4):
            mass[r, k] = factor * (sums[k] + 2.0 * springs[r - first, k])

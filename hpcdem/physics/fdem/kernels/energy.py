"""Work done by the forces on the corners, and energy stored in joints: passes of the energy budget. They only read.

Work over a step from t_n to t_n+1 is taken with the mean of the forces at both ends, sum (f_n + f_n+1) / 2 . v dt; so
the forces of one moment are booked with the mean of the velocities before and after (both half steps), and kinetic
energy at t_n is m v- . v+ / 2. For an undamped linear model the sum with the potential energy is then constant
(leap-frog).
"""

from __future__ import annotations

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
    TWO_MU,
    _part,
    _part_forces,
    _part_rate,
    _rate,
    part_stretch,
)

# Columns of the work of an element (n_own, 8) [J/m]; the last are for nodes of which it has the lowest corner.
BY_JOINTS, BY_CONTACT, VISCOUS, GRAVITY, OUTSIDE = range(5)
WORK = 8


@njit(cache=True, nogil=True, error_model="numpy")
def _viscous_triangle(xy, vel, c, small, beta, out):
    """Corner forces (6,) of the viscous stress, with that of the Rayleigh damping beta [s]."""
    ux, uy, wx, wy, cs, sn, _, _, _ = _part(xy[0], xy[1], xy[2], xy[3], xy[4], xy[5], c[0], c[1], c[2], c[3], small)
    r11, r22, r12 = _rate(vel[0], vel[1], vel[2], vel[3], vel[4], vel[5], c[0], c[1], c[2], c[3], cs, sn)
    eta, swell = c[ETA] + beta * c[TWO_MU], beta * c[LAMBDA] * (r11 + r22)
    fx1, fy1, fx2, fy2 = _part_forces(ux, uy, wx, wy, cs, sn, eta * r11 + swell, eta * r22 + swell, eta * r12)
    # Those of a triangle of a quad are half as large.
    out[0], out[1], out[2], out[3] = 2.0 * fx1, 2.0 * fy1, 2.0 * fx2, 2.0 * fy2
    out[4], out[5] = -out[0] - out[2], -out[1] - out[3]


@njit(cache=True, nogil=True, error_model="numpy")
def _viscous_quad(xy, vel, c, small, beta, out):
    """Compute the corner forces (8,) of the viscous stress of a quad."""
    out[:] = 0.0
    eta = c[Q_ETA] + beta * c[Q_TWO_MU]
    for overlay in range(2):
        rate, area = 0.0, 0.0
        for p in (2 * overlay, 2 * overlay + 1):
            _, _, _, _, cs, sn, _, _, _ = part_stretch(p, xy, c, small)
            r11, r22, _ = _part_rate(p, vel, c, cs, sn)
            rate += c[Q_AREA + p] * (r11 + r22)
            area += c[Q_AREA + p]
        rate /= area
        for p in (2 * overlay, 2 * overlay + 1):
            ux, uy, wx, wy, cs, sn, _, _, _ = part_stretch(p, xy, c, small)
            r11, r22, r12 = _part_rate(p, vel, c, cs, sn)
            shift, swell = 0.5 * (rate - (r11 + r22)), beta * c[Q_LAMBDA] * rate
            xx, yy = eta * (r11 + shift) + swell, eta * (r22 + shift) + swell
            fx1, fy1, fx2, fy2 = _part_forces(ux, uy, wx, wy, cs, sn, xx, yy, eta * r12)
            i, j, k = 2 * PARTS[p, 0], 2 * PARTS[p, 1], 2 * PARTS[p, 2]
            out[i] += fx1
            out[i + 1] += fy1
            out[j] += fx2
            out[j + 1] += fy2
            out[k] -= fx1 + fx2
            out[k + 1] -= fy1 + fy2


@njit(cache=True, nogil=True, error_model="numpy")
def book(
    first, n_own, triangle_rows, quad_rows, c, q, small, x, before, after, a, b, of_joints, mass, gx, gy, drag, beta,
    dt, work,
):  # fmt: skip
    """Add to work (n_own, 8) what joints, viscosity and gravity did on the owned elements.

    first: storage row of the first owned element; small: small strains; before, after (n, w): velocities before and
    after the kick, taken with the weights a and b; of_joints (n, 8) [N/m]; mass (n, 4): true masses [kg/m]; drag [1/s],
    beta [s]: Rayleigh damping.
    """
    force = np.zeros(8)
    for i in range(len(triangle_rows) + len(quad_rows)):
        if i < len(triangle_rows):
            r, n = triangle_rows[i], 3
            _viscous_triangle(x[r], before[r], c[i], small, beta, force)
        else:
            r, n = quad_rows[i - len(triangle_rows)], 4
            _viscous_quad(x[r], before[r], q[i - len(triangle_rows)], small, beta, force)
        joint = viscous = pull = 0.0
        for k in range(2 * n):
            v = a * before[r, k] + b * after[r, k]
            joint += of_joints[r, k] * v
            viscous += (force[k] - drag * mass[r, k // 2] * before[r, k]) * v
            pull += mass[r, k // 2] * (gx if k % 2 == 0 else gy) * v
        work[r - first, BY_JOINTS] += joint * dt
        work[r - first, VISCOUS] += viscous * dt
        work[r - first, GRAVITY] += pull * dt


@njit(cache=True, nogil=True, error_model="numpy")
def book_contact(rows, first, corners, pushed, before, after, a, b, dt, work):
    """Add what contact did on the owned elements in the storage rows `rows`; pushed (k, 8) [N/m]."""
    for i in range(len(rows)):
        r = rows[i]
        done = 0.0
        for k in range(2 * corners[i]):
            done += pushed[i, k] * (a * before[r, k] + b * after[r, k])
        work[r - first, BY_CONTACT] += done * dt


@njit(cache=True, nogil=True, error_model="numpy")
def book_nodes(begin, place, felt, outside, before, after, a, b, dt, first, n_own, width, work):
    """Add what was done from outside on nodes whose lowest corner is owned: applied forces and conditions."""
    before, after = before.reshape(before.size), after.reshape(after.size)
    for i in range(len(begin) - 1):
        p = place[begin[i]]
        r = p // width - first
        if r < 0 or r >= n_own:
            continue
        vx, vy = a * before[p] + b * after[p], a * before[p + 1] + b * after[p + 1]
        work[r, OUTSIDE] += ((felt[i, 2] + outside[i, 0]) * vx + (felt[i, 3] + outside[i, 1]) * vy) * dt


@njit(cache=True, nogil=True, error_model="numpy")
def kinetic(first, n_own, cells, number, before, after, mass, out):
    """Kinetic energy (n_own,) [J/m]: m v- . v+ / 2; mass (n, 4) as the motion sees it."""
    for i in range(n_own):
        r = first + i
        n = 4 if cells[number[r], 3] >= 0 else 3
        total = 0.0
        for k in range(2 * n):
            total += mass[r, k // 2] * before[r, k] * after[r, k]
        out[i] = 0.5 * total

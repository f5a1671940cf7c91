"""Heat of friction where surfaces slide: the work of the tangential forces of contact over a step, -F_s v_s dt, goes
to both walls.

F_s, what an edge remembers of its friction (physics/fdem/kernels/contact.py), and the sliding speed v_s at the centre
of the force are those by which the contact works on the blocks. Each wall takes the share of its effusivity
e = sqrt(k rho c): e_1 / (e_1 + e_2), as two half spaces that have one temperature where they touch; its corners take it
by the same weights as the force. What the springs of friction store comes back when they let go.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels.contact import edge_integral


@njit(cache=True, error_model="numpy")
def _coordinates(x, row, corners, px, py, out):
    """Barycentric coordinates (3,) of a point in the triangle of these corners of an element."""
    cx, cy = x[row, 2 * corners[2]], x[row, 2 * corners[2] + 1]
    ux, uy = x[row, 2 * corners[0]] - cx, x[row, 2 * corners[0] + 1] - cy
    wx, wy = x[row, 2 * corners[1]] - cx, x[row, 2 * corners[1] + 1] - cy
    area, dx, dy = ux * wy - uy * wx, px - cx, py - cy
    out[0], out[1] = (dx * wy - dy * wx) / area, (ux * dy - uy * dx) / area
    out[2] = 1.0 - out[0] - out[1]


@njit(cache=True, nogil=True, error_model="numpy")
def friction_heat(first, second, start, row, quad, x, v, history, effusivity, part, dt, out):
    """Add the heat (rows, w) [J/m] of a step dt [s] to the corners of the elements held here.

    first, second (m,): pairs of bodies; start, row, quad (bodies,): see pairs.Bodies; x, v (rows, .): positions and the
    velocities of the step; history (m, 6): F_s [N/m] by edges of the first, then of the second; effusivity
    [W s^1/2/(m2 K)], part (rows,): how much of its share an element takes.
    """
    a, b, mine, other = np.empty(3), np.empty(3), np.empty(3, np.int64), np.empty(3, np.int64)
    for p in range(len(first)):
        for edge in range(6):
            force = history[p, edge]
            if force == 0.0:
                continue
            one, two = (first[p], second[p]) if edge < 3 else (second[p], first[p])
            i, j, k = row[one], row[two], edge % 3
            corners, others = 4 if quad[one] else 3, 4 if quad[two] else 3
            for m in range(3):
                mine[m], other[m] = (start[one] + m) % corners, (start[two] + m) % others
            c, d = mine[k], mine[(k + 1) % 3]
            ex, ey = x[i, 2 * d] - x[i, 2 * c], x[i, 2 * d + 1] - x[i, 2 * c + 1]
            size = math.sqrt(ex * ex + ey * ey)
            _coordinates(x, j, other, x[i, 2 * c], x[i, 2 * c + 1], a)
            _coordinates(x, j, other, x[i, 2 * d], x[i, 2 * d + 1], b)
            zero, moment, _, _ = edge_integral(a[0], a[1], a[2], b[0], b[1], b[2], 1e30 if quad[two] else 0.0)
            if zero <= 0.0:  # they have parted in this step
                continue
            t = moment / zero
            vx, vy = (1.0 - t) * v[i, 2 * c] + t * v[i, 2 * d], (1.0 - t) * v[i, 2 * c + 1] + t * v[i, 2 * d + 1]
            for m in range(3):
                a[m] += t * (b[m] - a[m])
                vx -= a[m] * v[j, 2 * other[m]]
                vy -= a[m] * v[j, 2 * other[m] + 1]
            heat = -force * (vx * ex + vy * ey) / size * dt
            share = effusivity[i] / (effusivity[i] + effusivity[j])
            to_one, to_two = part[i] * share * heat, part[j] * (1.0 - share) * heat
            out[i, c] += (1.0 - t) * to_one
            out[i, d] += t * to_one
            for m in range(3):
                out[j, other[m]] += a[m] * to_two

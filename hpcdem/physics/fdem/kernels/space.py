"""Everything of tetrahedra but their forces: tables, nodes and conditions, limits of stability. What `build`, `nodes`
and `limits` are in the plane; their comments are not repeated here.

omega^2 of a corner of mass m is at most (4 / rho) (lambda + 2 mu) sum |grad N_l|^2 of its element.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import U
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem.kernels import laws
from hpcdem.physics.fdem.kernels.limits import corner_step
from hpcdem.physics.fdem.kernels.nodes import ACCELERATION, FREE, VELOCITY
from hpcdem.physics.fdem.kernels.tets import ETA, INVERSE, LAMBDA, ROW, STRIDE, TWO_MU, WEIGHT

UNBOUND, FIXED, ALONG, ACROSS = 0, 1, 2, 3
"""Move constraints of a node: along a vector only, in the plane across it only."""
# Columns of the table of conditions at the present moment (rows, 14): what x, y and z do, at which value, the nodal
# force, the constraint and its unit vector, local damping (negative: that of the model).
DOES, AT, FORCE, CONSTRAINT, WAY, NODE_DAMP = 0, 3, 6, 9, 10, 13
CONDITION = 14
# Columns of the table of tractions at the present moment (rows, 7) [Pa].
XX, YY, XY, NORMAL, ZZ, XZ, YZ, INCOMING = range(8)  # and two more of the last
TRACTION = 7

# Columns of the table of element models, see build.py.
RHO, LAME, MU2, YOUNG, DAMP = range(5)


# ---- tables --------------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def corners(points, cells, number, x):
    """Rows of x as the mesh has them."""
    for i in range(len(number)):
        x[i] = 0.0
        for k in range(4):
            for c in range(3):
                x[i, STRIDE * k + c] = points[cells[number[i], k], c]


@njit(cache=True, nogil=True, error_model="numpy")
def middles(x, out):
    """Means of the corners (n, 3) [m] and the largest distance of a corner from it."""
    far2 = 0.0
    for i in range(len(x)):
        for c in range(3):
            out[i, c] = 0.25 * ((x[i, c] + x[i, 4 + c]) + (x[i, 8 + c] + x[i, 12 + c]))
        for k in range(4):
            d2 = 0.0
            for c in range(3):
                d2 += (x[i, STRIDE * k + c] - out[i, c]) ** 2
            far2 = max(far2, d2)
    return math.sqrt(far2)


@njit(cache=True, nogil=True, error_model="numpy")
def _inverse(points, cell, out):
    """Inverse of [X2 - X1, X3 - X1, X4 - X1] by rows, and the volume."""
    a = np.empty((3, 3))
    for k in range(3):
        for c in range(3):
            a[c, k] = points[cell[k + 1], c] - points[cell[0], c]
    for i in range(3):
        for j in range(3):
            p, q, r, s = (j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3
            out[3 * i + j] = a[p, r] * a[q, s] - a[p, s] * a[q, r]
    det = a[0, 0] * out[0] + (a[1, 0] * out[1] + a[2, 0] * out[2])
    for k in range(9):
        out[k] /= det
    return det / 6.0


@njit(cache=True, nogil=True, error_model="numpy")
def masses(number, points, cells, row, models, mass):
    """True masses (n, 4) [kg] of the corners: a quarter of the element's."""
    room = np.empty(9)
    for i in range(len(number)):
        e = number[i]
        mass[i] = models[row[e], RHO] * _inverse(points, cells[e], room) / 4.0


@njit(cache=True, nogil=True, error_model="numpy")
def constants(number, points, cells, row, models, viscous, rows, mass, c):
    """Rows of the table of tetrahedra (tets.py); rows: storage rows; mass (n, 4)."""
    for i in range(len(rows)):
        r = rows[i]
        e = number[r]
        m = models[row[e]]
        _inverse(points, cells[e], c[i, INVERSE : INVERSE + 9])
        c[i, LAMBDA], c[i, TWO_MU], c[i, WEIGHT] = m[LAME], m[MU2], mass[r, 0]
        length = 0.0
        for k in range(4):
            for j in range(k):
                d2 = 0.0
                for axis in range(3):
                    d2 += (points[cells[e, k], axis] - points[cells[e, j], axis]) ** 2
                length += math.sqrt(d2) / 6.0
        c[i, ETA] = m[DAMP] * 2.0 * length * math.sqrt(m[RHO] * m[YOUNG]) if viscous else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def survey(x, v, origin, first, n_own, out):
    """See `build.survey`; origin (n_own, 12) without spare words."""
    path2 = speed2 = broken = inverted = 0.0
    for i in range(n_own):
        r = first + i
        for k in range(0, ROW, STRIDE):
            d2 = v2 = 0.0
            for c in range(3):
                d2 += (x[r, k + c] - origin[i, k // STRIDE * 3 + c]) ** 2
                v2 += v[r, k + c] ** 2
            if not (d2 < np.inf and v2 < np.inf):
                broken = 1.0
                continue
            path2, speed2 = max(path2, d2), max(speed2, v2)
        if volume(x[r]) <= 0.0:
            inverted = 1.0
    out[0], out[1], out[2], out[3] = path2, speed2, broken, inverted


@njit(cache=True, nogil=True, error_model="numpy")
def volume(x):
    """Return the volume of a tetrahedron from its row of x [m3]."""
    ux, uy, uz = x[4] - x[0], x[5] - x[1], x[6] - x[2]
    wx, wy, wz = x[8] - x[0], x[9] - x[1], x[10] - x[2]
    tx, ty, tz = x[12] - x[0], x[13] - x[1], x[14] - x[2]
    return ((uy * wz - uz * wy) * tx + (uz * wx - ux * wz) * ty + (ux * wy - uy * wx) * tz) / 6.0


# ---- nodes ---------------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def tractions(corner, row, share, table, x, applied):
    """Add a third of A sigma n of each loaded face to its corners: corner (m, 3), where they begin in x and `applied`
    (both flat), counter-clockwise from outside; row (m,) of the table (rows, 10) [Pa]; share (m,): of it."""
    x, applied = x.reshape(x.size), applied.reshape(applied.size)
    for m in range(len(corner)):
        a, b, d = corner[m, 0], corner[m, 1], corner[m, 2]
        ux, uy, uz = x[b] - x[a], x[b + 1] - x[a + 1], x[b + 2] - x[a + 2]
        wx, wy, wz = x[d] - x[a], x[d + 1] - x[a + 1], x[d + 2] - x[a + 2]
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx  # 2 A n
        nx, ny, nz = share[m] * nx, share[m] * ny, share[m] * nz
        s = table[row[m]]
        fx = (s[XX] * nx + s[XY] * ny + s[XZ] * nz + s[NORMAL] * nx) / 6.0
        fy = (s[XY] * nx + s[YY] * ny + s[YZ] * nz + s[NORMAL] * ny) / 6.0
        fz = (s[XZ] * nx + s[YZ] * ny + s[ZZ] * nz + s[NORMAL] * nz) / 6.0
        for k in range(3):
            at = corner[m, k]
            applied[at] += fx
            applied[at + 1] += fy
            applied[at + 2] += fz


@njit(cache=True, nogil=True, error_model="numpy")
def dashpots(corner, along, across, row, table, x, v, applied):
    """Take A / 3 (z_p w_n n + z_s w_s s) from each corner of faces through which waves leave, see `nodes.dashpots`;
    corner (m, 3): where they begin in x, v and `applied` (all flat)."""
    x, v, applied = x.reshape(x.size), v.reshape(v.size), applied.reshape(applied.size)
    for m in range(len(corner)):
        a, b, d = corner[m, 0], corner[m, 1], corner[m, 2]
        ux, uy, uz = x[b] - x[a], x[b + 1] - x[a + 1], x[b + 2] - x[a + 2]
        wx, wy, wz = x[d] - x[a], x[d + 1] - x[a + 1], x[d + 2] - x[a + 2]
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        double = math.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx / double, ny / double, nz / double
        s = table[row[m]]
        shear = double / 6.0 * across[m]
        more = double / 6.0 * along[m] - shear
        for k in range(3):
            at = corner[m, k]
            vx, vy, vz = v[at] - 2.0 * s[INCOMING], v[at + 1] - 2.0 * s[INCOMING + 1], v[at + 2] - 2.0 * s[INCOMING + 2]
            normal = more * (vx * nx + vy * ny + vz * nz)
            applied[at] -= normal * nx + shear * vx
            applied[at + 1] -= normal * ny + shear * vy
            applied[at + 2] -= normal * nz + shear * vz


@njit(cache=True, nogil=True, error_model="numpy")
def _move(
    t, threads, begin, corner, pull_begin, pull_corner, kick, condition, share, table, some_applied, force, applied, v,
    alpha, outside, felt,
):  # fmt: skip
    force, applied, v = force.reshape(force.size), applied.reshape(applied.size), v.reshape(v.size)
    n = len(kick)
    f, before, w, drawn = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(n * t // threads, n * (t + 1) // threads):
        q, k = condition[i], kick[i]
        fx = fy = fz = ex = ey = ez = 0.0
        for m in range(pull_begin[i], pull_begin[i + 1]):
            at = U(pull_corner[m])
            fx, fy, fz = fx + force[at], fy + force[at + U(1)], fz + force[at + U(2)]
        if some_applied:
            for m in range(begin[i], begin[i + 1]):
                at = U(corner[m])
                ex, ey, ez = ex + applied[at], ey + applied[at + U(1)], ez + applied[at + U(2)]
        if q > 0:
            ex += share[i] * table[q, FORCE]
            ey += share[i] * table[q, FORCE + 1]
            ez += share[i] * table[q, FORCE + 2]
        fx, fy, fz = fx + ex, fy + ey, fz + ez
        m = begin[i]
        while corner[m] >= v.size:
            m += 1
        at = U(corner[m])
        vx, vy, vz = v[at], v[at + U(1)], v[at + U(2)]
        drag = alpha if table[q, NODE_DAMP] < 0.0 else table[q, NODE_DAMP]
        wx = vx + k * laws.damped(fx, vx, drag)
        wy = vy + k * laws.damped(fy, vy, drag)
        wz = vz + k * laws.damped(fz, vz, drag)
        if q > 0:
            f[0], f[1], f[2] = fx, fy, fz
            before[0], before[1], before[2] = vx, vy, vz
            w[0], w[1], w[2] = wx, wy, wz
            _apply_condition(k, drag, table[q], f, before, w, drawn, outside[i])
            wx, wy, wz = w[0], w[1], w[2]
        felt[i, 0], felt[i, 1], felt[i, 2], felt[i, 3], felt[i, 4], felt[i, 5] = fx, fy, fz, ex, ey, ez
        for m in range(begin[i], begin[i + 1]):
            at = U(corner[m])
            if at < v.size:
                v[at], v[at + U(1)], v[at + U(2)] = wx, wy, wz


@njit(cache=True, nogil=True, error_model="numpy")
def _apply_condition(k, alpha, condition, f, before, w, drawn, outside):
    """The velocity w of a node with conditions, and what they had to add so that it moves like that."""
    for c in range(3):
        drawn[c] = 0.0
        if condition[DOES + c] == VELOCITY:
            w[c] = condition[AT + c]
        elif condition[DOES + c] == ACCELERATION:
            w[c] = before[c] + condition[AT + c]
    kind = condition[CONSTRAINT]
    if kind == FIXED:
        w[0] = w[1] = w[2] = 0.0
    elif kind == ALONG or kind == ACROSS:
        _bind(kind, k, alpha, condition, f, before, w, drawn)
    for c in range(3):
        outside[c] = 0.0
        if kind == ALONG or kind == ACROSS:
            outside[c] = -drawn[c]
        elif kind == FIXED or condition[DOES + c] != FREE:
            outside[c] = (w[c] - before[c]) / k - f[c]


@njit(cache=True, nogil=True, error_model="numpy")
def _bind(kind, k, alpha, condition, f, before, w, drawn):
    """The velocity w of a node that moves along a vector only, or across it only; drawn: the part of its force that is
    carried. Damping acts on the other part alone: on a carried force it would act as friction."""
    free = condition[DOES] == FREE and condition[DOES + 1] == FREE and condition[DOES + 2] == FREE
    along = pull = 0.0
    for c in range(3):
        along += w[c] * condition[WAY + c]
        pull += f[c] * condition[WAY + c]
    for c in range(3):
        n = condition[WAY + c]
        carried = f[c] - pull * n if kind == ALONG else pull * n
        w[c] = along * n if kind == ALONG else w[c] - along * n
        drawn[c] = carried
    if alpha > 0.0 and free and kind == ALONG:
        speed = 0.0
        for c in range(3):
            speed += before[c] * condition[WAY + c]
        speed += k * laws.damped(pull, speed, alpha)
        for c in range(3):
            w[c] = speed * condition[WAY + c]
    elif alpha > 0.0 and free:
        speed = 0.0
        for c in range(3):
            w[c] = before[c] + k * laws.damped(f[c] - drawn[c], before[c], alpha)
            speed += w[c] * condition[WAY + c]
        for c in range(3):
            w[c] -= speed * condition[WAY + c]


@njit(cache=True, nogil=True, error_model="numpy")
def _kick(t, threads, first, kick, force, v, alpha):
    n = len(kick)
    for i in range(n * t // threads, n * (t + 1) // threads):
        r = first + i
        for k in range(4):
            q = kick[i, k]
            for c in range(STRIDE * k, STRIDE * k + STRIDE):
                v[r, c] += q * laws.damped(force[r, c], v[r, c], alpha)


@on_threads
def kick(threads, *args):
    """New velocities of corners that are nodes by themselves: v (n, 16) += kick force, of the storage rows from `first`
    on; kick (n_own, 4): dt / mass, 0 for corners that `move` moves."""
    for t in prange(threads):
        _kick(t, threads, *args)


@on_threads
def move(threads, *args):
    """New velocities of the nodes from the forces of their corners, see `nodes.move`; corner (m,): where they begin in
    `force`, `applied` and v (flat), those of other ranks' elements beyond the end of v; pull_begin, pull_corner: the
    same of those that can have a force; table (rows, 14); outside (n, 3) [N], felt (n, 6)."""
    for t in prange(threads):
        _move(t, threads, *args)


# ---- limits --------------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def _omega2(c):
    """Bound of omega^2 [1/s2] by the stiffness alone, true mass: m = rho V / 4."""
    det = c[0] * (c[4] * c[8] - c[5] * c[7]) + c[1] * (c[5] * c[6] - c[3] * c[8]) + c[2] * (c[3] * c[7] - c[4] * c[6])
    rho = 24.0 * c[WEIGHT] * det
    squares = 0.0
    for k in range(3):
        column = 0.0
        for j in range(3):
            squares += c[3 * j + k] ** 2
            column += c[3 * j + k]
        squares += column**2
    return 4.0 / rho * (c[LAMBDA] + c[TWO_MU]) * squares


@njit(cache=True, nogil=True, error_model="numpy")
def omegas2(c):
    """Return the bound of omega^2 [1/s2] of tetrahedra (n,)."""
    out = np.empty(len(c))
    for i in range(len(c)):
        out[i] = _omega2(c[i])
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def time_step(c, rows, first, springs, dashpots, drag, beta, safety, target, mass):
    """Largest stable time step over the corners of tetrahedra [s], see `limits.time_step`; springs (n_own, 4) [N/m],
    dashpots [N s/m]: of contact, k = P A (1 / h_t + 1 / h_c) / 3 per face of the area A."""
    least = math.inf
    for i in range(len(rows)):
        modulus = c[i, LAMBDA] + c[i, TWO_MU]
        omega2, eta = _omega2(c[i]), c[i, ETA] + beta * modulus
        for k in range(4):
            true, spring, dashpot = mass[rows[i], k], springs[rows[i] - first, k], dashpots[rows[i] - first, k]
            dt = corner_step(omega2, true, true, spring, dashpot, drag, eta, modulus)
            while safety * dt < target:
                mass[rows[i], k] *= max((target / (safety * dt)) ** 2, 1.0 + 1e-6)
                dt = corner_step(omega2, true, mass[rows[i], k], spring, dashpot, drag, eta, modulus)
            least = min(least, dt)
    return least


@njit(cache=True, nogil=True, error_model="numpy")
def static_masses(c, rows, first, springs, alpha, mass):
    """Fictitious masses for a time step of 1, see `limits.static_masses`; springs: see `time_step`."""
    factor = 0.25 * 1.25 * (1.0 + alpha)
    g = np.empty((4, 3))
    for i in range(len(rows)):
        lam, mu, q = c[i, LAMBDA], 0.5 * c[i, TWO_MU], c[i]
        det = (
            q[0] * (q[4] * q[8] - q[5] * q[7]) + q[1] * (q[5] * q[6] - q[3] * q[8]) + q[2] * (q[3] * q[7] - q[4] * q[6])
        )
        for a in range(3):
            g[0, a] = -(q[a] + q[3 + a] + q[6 + a])
            g[1, a], g[2, a], g[3, a] = q[a], q[3 + a], q[6 + a]
        for k in range(4):
            most = 0.0
            for a in range(3):
                row = 0.0
                for m in range(4):
                    both = g[k, 0] * g[m, 0] + g[k, 1] * g[m, 1] + g[k, 2] * g[m, 2]
                    for b in range(3):
                        more = mu * both if a == b else 0.0
                        row += abs(lam * g[k, a] * g[m, b] + mu * g[k, b] * g[m, a] + more)
                most = max(most, row)
            mass[rows[i], k] = factor * (most / (6.0 * det) + 2.0 * springs[rows[i] - first, k])

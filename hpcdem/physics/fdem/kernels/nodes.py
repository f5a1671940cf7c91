"""Nodes that do not move independently: connected corners, boundary conditions, quads.

A node is a set of corners at one place that move as one; its corners stand in the order of elements, and their forces
are added in that order. A rank treats every node of which it owns a corner, from the forces of all its corners (those
of other ranks' elements come by the halo), so all ranks get the same bits.
"""

from __future__ import annotations

import math

from numba import njit, prange

from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem.kernels import laws

FREE, VELOCITY, ACCELERATION = 0, 1, 2
"""What a component does."""
UNBOUND, FIXED, ALONG = 0, 1, 2
"""Move constraints of a node."""

# Columns of the table of conditions at the present moment (rows, 10): what x and y do and at which value, the nodal
# force, the constraint and its unit vector, local damping (negative: that of the model).
DOES_X, AT_X, DOES_Y, AT_Y, FORCE_X, FORCE_Y, CONSTRAINT, DIRECTION_X, DIRECTION_Y, DAMP = range(10)
CONDITION = 10
# Columns of the table of tractions at the present moment (rows, 7): stresses [Pa], velocity of the incoming wave [m/s],
# stress along the face, counter-clockwise [Pa].
XX, YY, XY, NORMAL, INCOMING_X, INCOMING_Y, DIP = range(7)
TRACTION = 7


@njit(cache=True, nogil=True, error_model="numpy")
def tractions(edges, corner_a, corner_b, row, table, x, applied):
    """Add half of L sigma n of each loaded face to its two corners.

    edges, corner_a, corner_b (m,): where the edge begins in x, and its corners in `applied` (both flat); row (m,) of
    the table (rows, 7): xx, yy, xy, normal [Pa], ...
    """
    x, applied = x.reshape(x.size), applied.reshape(applied.size)
    for m in range(len(edges)):
        p, a, b, q = edges[m], corner_a[m], corner_b[m], row[m]
        nx, ny = x[p + 3] - x[p + 1], x[p] - x[p + 2]
        fx = 0.5 * (table[q, XX] * nx + table[q, XY] * ny + table[q, NORMAL] * nx - table[q, DIP] * ny)
        fy = 0.5 * (table[q, XY] * nx + table[q, YY] * ny + table[q, NORMAL] * ny + table[q, DIP] * nx)
        applied[a] += fx
        applied[a + 1] += fy
        applied[b] += fx
        applied[b + 1] += fy


@njit(cache=True, nogil=True, error_model="numpy")
def dashpots(edges, corners, places, along, across, row, table, x, v, applied):
    """Take L / 2 (z_p w_n n + z_s w_s s) from both corners of faces through which waves leave, w = v - 2 v_in: a wave
    v_in that comes in would move the face by twice itself if nothing were there.

    edges (m,): where the edge begins in x; corners, places (m, 2): its ends in `applied` and in v (all flat); along,
    across (m,): impedances rho c_p and rho c_s [Pa s/m]; row (m,) of the table of tractions.
    """
    x, v, applied = x.reshape(x.size), v.reshape(v.size), applied.reshape(applied.size)
    for m in range(len(edges)):
        p = edges[m]
        lx, ly = x[p + 2] - x[p], x[p + 3] - x[p + 1]
        length = math.sqrt(lx * lx + ly * ly)
        nx, ny = ly / length, -lx / length
        for end in range(2):
            vx = v[places[m, end]] - 2.0 * table[row[m], INCOMING_X]
            vy = v[places[m, end] + 1] - 2.0 * table[row[m], INCOMING_Y]
            vn = vx * nx + vy * ny
            normal, shear = 0.5 * length * along[m] * vn, 0.5 * length * across[m]
            applied[corners[m, end]] -= normal * nx + shear * (vx - vn * nx)
            applied[corners[m, end] + 1] -= normal * ny + shear * (vy - vn * ny)


@njit(cache=True, nogil=True, error_model="numpy")
def relax(corner, force, left, applied):
    """Add forces (m, dim) that die down: `left` (m,) is what is left of each, 1 to 0."""
    applied = applied.reshape(applied.size)
    for m in range(len(corner)):
        for c in range(force.shape[1]):
            applied[corner[m] + c] += left[m] * force[m, c]


@njit(cache=True, nogil=True, error_model="numpy")
def _move(
    t, threads, begin, corner, place, again, kick, condition, share, table, some_applied, force, applied, v, alpha,
    outside, felt,
):  # fmt: skip
    force, applied, v = force.reshape(force.size), applied.reshape(applied.size), v.reshape(v.size)
    n = len(kick)
    for i in range(n * t // threads, n * (t + 1) // threads):
        fx = fy = ex = ey = 0.0
        for m in range(begin[i], begin[i + 1]):
            fx += force[corner[m]]
            fy += force[corner[m] + 1]
            if some_applied:
                ex += applied[corner[m]]
                ey += applied[corner[m] + 1]
        q = condition[i]
        ex += share[i] * table[q, FORCE_X]
        ey += share[i] * table[q, FORCE_Y]
        fx += ex
        fy += ey
        k, drag = kick[i], alpha if table[q, DAMP] < 0.0 else table[q, DAMP]
        vx, vy = v[place[begin[i]]], v[place[begin[i]] + 1]
        wx, wy = vx + k * laws.damped(fx, vx, drag), vy + k * laws.damped(fy, vy, drag)
        if q > 0:
            if table[q, DOES_X] != FREE:
                wx = table[q, AT_X] if table[q, DOES_X] == VELOCITY else vx + table[q, AT_X]
            if table[q, DOES_Y] != FREE:
                wy = table[q, AT_Y] if table[q, DOES_Y] == VELOCITY else vy + table[q, AT_Y]
            if table[q, CONSTRAINT] == FIXED:
                wx = wy = 0.0
            elif table[q, CONSTRAINT] == ALONG:
                along = wx * table[q, DIRECTION_X] + wy * table[q, DIRECTION_Y]
                if drag > 0.0 and table[q, DOES_X] == FREE and table[q, DOES_Y] == FREE:
                    # Damping sees the force along the line alone: that across it is carried, and would act as friction.
                    along = vx * table[q, DIRECTION_X] + vy * table[q, DIRECTION_Y]
                    along += k * laws.damped(fx * table[q, DIRECTION_X] + fy * table[q, DIRECTION_Y], along, drag)
                wx, wy = along * table[q, DIRECTION_X], along * table[q, DIRECTION_Y]
            # What the conditions had to add so that the node does this.
            outside[i, 0] = outside[i, 1] = 0.0
            if table[q, CONSTRAINT] == ALONG:
                across = fy * table[q, DIRECTION_X] - fx * table[q, DIRECTION_Y]
                outside[i, 0], outside[i, 1] = across * table[q, DIRECTION_Y], -across * table[q, DIRECTION_X]
            else:
                fixed = table[q, CONSTRAINT] == FIXED
                if fixed or table[q, DOES_X] != FREE:
                    outside[i, 0] = (wx - vx) / k - fx
                if fixed or table[q, DOES_Y] != FREE:
                    outside[i, 1] = (wy - vy) / k - fy
        felt[i, 0], felt[i, 1], felt[i, 2], felt[i, 3] = fx, fy, ex, ey
        for m in range(begin[i], begin[i + 1]):
            p = place[m]
            v[p], v[p + 1] = wx, wy
            p = again[m]
            if p >= 0:
                v[p], v[p + 1] = wx, wy


@on_threads
def move(threads, *args):
    """New velocities of the nodes from the forces of their corners.

    begin (n + 1,), corner (m,): where the forces of the corners of node i begin in `force` and `applied` (flat), in
    the order of elements; place, again (m,): the same in v, and where v has the corner a second time, or -1; kick (n,):
    dt / m; condition (n,): row of the table (rows, 10), 0: none; share (n,): part of the force of its point that falls
    on the node; alpha: local damping of nodes that have none of their own. Fills outside (n, 2): what the conditions
    had to add [N/m], and felt (n, 4): all forces without that, and those of them that are applied from outside.
    """
    for t in prange(threads):
        _move(t, threads, *args)

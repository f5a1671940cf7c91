"""The loops of a field that diffuses in elements: conduction, exchange at faces, sums at nodes, stress that it brings.

Words are those of heat. Temperatures stand at the corners of elements, rows t (n, w) in storage order, ghosts too; w is
3, with quads in the mesh, and in space, 4. Corners that are one node of the field carry equal copies. Sources:
Fourier's law with linear triangles (manual, 7.6.1, (93) to (99)), transfer after Newton ((100), (101)), thermal strain
after Duhamel and Neumann.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.physics.fdem.kernels.elements import PARTS

PAIRS = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
"""Pairs of corners between which heat flows, of triangles the first three, of quads and tetrahedra all."""
FLUX, TRANSFER, ENVIRONMENT = range(3)
"""Columns of the table of conditions of faces [W/m2, W/(m2 K), K]."""


@njit(cache=True, nogil=True, error_model="numpy")
def _pair(a, b):
    """Row of PAIRS."""
    low, high = min(a, b), max(a, b)
    if high == 3:
        return 3 + low
    return 0 if high == 1 else (1 if low == 1 else 2)


@njit(cache=True, nogil=True, error_model="numpy")
def conductances(number, points, cells, k, out):
    """Conductances [W/(m K), per metre of thickness] between the corners of elements, (n, 3) or (n, 6).

    k (n, 3): conductivity xx, yy, xy. A triangle: -A grad N_a . k . grad N_b; a quad is the mean of its two overlays of
    two triangles, as its stress is.
    """
    for i in range(len(number)):
        e = number[i]
        out[i] = 0.0
        quad = cells[e, 3] >= 0
        for p in range(4 if quad else 1):
            one, two, three = PARTS[p]
            a, b, c = cells[e, one], cells[e, two], cells[e, three]
            ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
            wx, wy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
            det = ux * wy - uy * wx
            share = (0.25 if quad else 0.5) / det
            # det times the gradients of the shape functions of the second and third corner, and of the first.
            bx, by, cx, cy = wy, -wx, -uy, ux
            ax, ay = -(bx + cx), -(by + cy)
            xx, yy, xy = k[i, 0], k[i, 1], k[i, 2]
            out[i, _pair(one, two)] -= share * (ax * (xx * bx + xy * by) + ay * (xy * bx + yy * by))
            out[i, _pair(two, three)] -= share * (bx * (xx * cx + xy * cy) + by * (xy * cx + yy * cy))
            out[i, _pair(three, one)] -= share * (cx * (xx * ax + xy * ay) + cy * (xy * ax + yy * ay))


@njit(cache=True, nogil=True, error_model="numpy")
def _conduct(part, threads, t, g, q):
    n = len(t)
    wide = t.shape[1] == 4
    for r in range(n * part // threads, n * (part + 1) // threads):
        a, b, c = t[r, 0], t[r, 1], t[r, 2]
        ab, bc, ca = g[r, 0] * (b - a), g[r, 1] * (c - b), g[r, 2] * (a - c)
        if wide:
            d = t[r, 3]
            ad, bd, cd = g[r, 3] * (d - a), g[r, 4] * (d - b), g[r, 5] * (d - c)
            q[r, 0], q[r, 1], q[r, 2] = (ab - ca) + ad, (bc - ab) + bd, (ca - bc) + cd
            q[r, 3] = -((ad + bd) + cd)
        else:
            q[r, 0], q[r, 1], q[r, 2] = ab - ca, bc - ab, ca - bc


@njit(cache=True, nogil=True, error_model="numpy")
def conduct(threads, *args):
    """Heat q (n, w) [W/m] that flows to the corners of all elements held here by conduction in them."""
    for part in range(threads):
        _conduct(part, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def conduct_threaded(threads, t, g, q):
    """The same on several threads."""
    for part in prange(threads):
        _conduct(part, threads, t, g, q)


@njit(cache=True, nogil=True, error_model="numpy")
def through_faces(corner, half, row, table, first, last, t, q, dt, given):
    """Heat through faces: a flux, and transfer from an environment, an equal part of the face at each of its corners.

    corner (m, 2 or 3): in t, flat; half (m,): half lengths [m], in space thirds of areas [m2]; row (m,), table (rows,
    3): conditions; t, q, given: flat; faces first : last are this rank's, what they bring in dt [s] is booked in given
    [J/m].
    """
    for i in range(len(corner)):
        one = table[row[i]]
        for end in range(corner.shape[1]):
            at = corner[i, end]
            heat = half[i] * (one[FLUX] + one[TRANSFER] * (one[ENVIRONMENT] - t[at]))
            q[at] += heat
            if first <= at < last:
                given[at - first] += dt * heat


@njit(cache=True, nogil=True, error_model="numpy")
def _warm(part, threads, begin, corner, capacity, held, table, first, last, dt, q, t, given):
    n = len(begin) - 1
    for i in range(n * part // threads, n * (part + 1) // threads):
        total = 0.0
        for m in range(begin[i], begin[i + 1]):
            total += q[corner[m]]
        lead = corner[begin[i]]
        old = t[lead]
        if held[i] >= 0:
            new = table[held[i]]
            if first <= lead < last:
                given[lead - first] += capacity[i] * (new - old) - dt * total
        else:
            new = old + dt * total / capacity[i]
        for m in range(begin[i], begin[i + 1]):
            t[corner[m]] = new


@njit(cache=True, nogil=True, error_model="numpy")
def warm(threads, *args):
    """Temperatures after dt [s] of heat q that flows to them, (99).

    begin (n + 1,), corner: corners of each node in t, flat, by the numbers of their elements; capacity (n,) [J/(m K)];
    held (n,): row of the table of prescribed temperatures, -1: free; t, q, given: flat; corners first : last are this
    rank's, what conditions bring is booked in given [J/m].
    """
    for part in range(threads):
        _warm(part, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def warm_threaded(threads, begin, corner, capacity, held, table, first, last, dt, q, t, given):
    """The same on several threads."""
    for part in prange(threads):
        _warm(part, threads, begin, corner, capacity, held, table, first, last, dt, q, t, given)


@njit(cache=True, nogil=True, error_model="numpy")
def unite(begin, corner, weight, t):
    """Corners of a node that differ get the mean of them by their capacity before, weight (flat), or the plain one."""
    for i in range(len(begin) - 1):
        first = t[corner[begin[i]]]
        differ = False
        total = mass = plain = 0.0
        for m in range(begin[i], begin[i + 1]):
            at = corner[m]
            differ |= t[at] != first
            total += weight[at] * t[at]
            mass += weight[at]
            plain += t[at]
        if differ:
            mean = total / mass if mass > 0.0 else plain / (begin[i + 1] - begin[i])
            for m in range(begin[i], begin[i + 1]):
                t[corner[m]] = mean


@njit(cache=True, nogil=True, error_model="numpy")
def sums(begin, corner, values, out):
    """Sums (n,) at nodes of values at corners (flat)."""
    for i in range(len(begin) - 1):
        total = 0.0
        for m in range(begin[i], begin[i + 1]):
            total += values[corner[m]]
        out[i] = total


@njit(cache=True, nogil=True, error_model="numpy")
def thermal_stress(quad, t, stiffness, unstressed, out):
    """-3 K alpha (T - T_0) (n,) [Pa] of elements, T: mean of the corners; stiffness (n,): 3 K alpha [Pa/K]; t (n, w):
    of these elements alone."""
    for i in range(len(t)):
        total = (t[i, 0] + t[i, 1]) + t[i, 2]
        mean = (total + t[i, 3]) / 4.0 if quad[i] else total / 3.0
        out[i] = stiffness[i] * (unstressed[i] - mean)

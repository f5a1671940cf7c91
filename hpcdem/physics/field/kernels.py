"""The loops of a field that diffuses in elements, beside conduction (elements.py): exchange at faces, sums at nodes.

Words are those of heat. Temperatures stand at the corners of elements, rows t (n, w) in storage order, ghosts too; w is
3, with quads in the mesh, and in space, 4. Corners that are one node of the field carry equal copies. Source of the
transfer: Newton (manual, (100), (101)).
"""

from __future__ import annotations

from numba import njit, prange

from hpcdem.numerics.on_threads import on_threads

FLUX, TRANSFER, ENVIRONMENT = range(3)
"""Columns of the table of conditions of faces [W/m2, W/(m2 K), K]."""


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


@on_threads
def warm(threads, *args):
    """Temperatures after dt [s] of heat q that flows to them, (99).

    begin (n + 1,), corner: corners of each node in t, flat, by the numbers of their elements; capacity (n,) [J/(m K)];
    held (n,): row of the table of prescribed temperatures, -1: free; t, q, given: flat; corners first : last are this
    rank's, what conditions bring is booked in given [J/m].
    """
    for part in prange(threads):
        _warm(part, threads, *args)


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
def eigenstress(wide, t, stiffness, unstressed, out):
    """-d K alpha (T - T_0) (n,) [Pa] of elements, T: mean of the corners t (n, w), of those that are wide of four; d:
    directions in which they are held, 3, in plane stress 2; stiffness (n,): d K alpha [Pa/K]. Stress after Duhamel and
    Neumann."""
    for i in range(len(t)):
        total = (t[i, 0] + t[i, 1]) + t[i, 2]
        mean = (total + t[i, 3]) / 4.0 if wide[i] else total / 3.0
        out[i] = stiffness[i] * (unstressed[i] - mean)

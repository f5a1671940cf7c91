"""What a field in space has of its own: conductances of tetrahedra, and conduction in hexahedra. All other loops are
those of kernels.py, for which a tetrahedron is a row with four corners. Source: Fourier's law with linear tetrahedra
(manual, 7.6.1).
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.physics.fdem.hexahedra import OVERLAYS
from hpcdem.physics.field.kernels import PAIRS

_ENDS = np.sort(OVERLAYS[:, PAIRS], axis=2)
HEX_PAIRS = np.unique(_ENDS.reshape(-1, 2), axis=0)
"""Pairs of corners of a hexahedron between which heat flows (24, 2)."""
OVERLAY_PAIRS = np.array([[int(np.flatnonzero((HEX_PAIRS == ends).all(axis=1))[0]) for ends in of] for of in _ENDS])
"""Which of them those of each of its tetrahedra are (10, 6)."""


@njit(cache=True, nogil=True, error_model="numpy")
def conductances(number, points, cells, k, out):
    """Conductances [W/K] between the corners of tetrahedra, (n, 6), in the order of PAIRS: -V grad N_a . k . grad N_b.

    k (n, 6): conductivity xx, yy, xy, zz, xz, yz. With the normals of the faces times their areas, s = 3 V grad N, this
    is -(s_a . k . s_b) / (9 V), the sum of the manual.
    """
    slope = np.empty((4, 3))
    for i in range(len(number)):
        e = number[i]
        a, b, c, d = cells[e, 0], cells[e, 1], cells[e, 2], cells[e, 3]
        ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        wx, wy, wz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
        tx, ty, tz = points[d, 0] - points[a, 0], points[d, 1] - points[a, 1], points[d, 2] - points[a, 2]
        # Six times the volume times the gradients of the shape functions.
        slope[1, 0], slope[1, 1], slope[1, 2] = wy * tz - wz * ty, wz * tx - wx * tz, wx * ty - wy * tx
        slope[2, 0], slope[2, 1], slope[2, 2] = ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux
        slope[3, 0], slope[3, 1], slope[3, 2] = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        det = ux * slope[1, 0] + (uy * slope[1, 1] + uz * slope[1, 2])
        for axis in range(3):
            slope[0, axis] = -(slope[1, axis] + (slope[2, axis] + slope[3, axis]))
        xx, yy, xy, zz, xz, yz = k[i, 0], k[i, 1], k[i, 2], k[i, 3], k[i, 4], k[i, 5]
        for pair in range(6):
            one, two = slope[PAIRS[pair, 0]], slope[PAIRS[pair, 1]]
            flow = one[0] * (xx * two[0] + (xy * two[1] + xz * two[2]))
            flow += one[1] * (xy * two[0] + (yy * two[1] + yz * two[2]))
            flow += one[2] * (xz * two[0] + (yz * two[1] + zz * two[2]))
            out[i, pair] = -flow / (6.0 * det)


@njit(cache=True, nogil=True, error_model="numpy")
def _conduct_hexes(part, threads, corners, g, t, q):
    n, heat = len(corners), np.empty(8)
    for i in range(n * part // threads, n * (part + 1) // threads):
        heat[:] = 0.0
        for p in range(len(HEX_PAIRS)):
            a, b = HEX_PAIRS[p, 0], HEX_PAIRS[p, 1]
            flow = g[i, p] * (t[corners[i, b]] - t[corners[i, a]])
            heat[a] += flow
            heat[b] -= flow
        for k in range(8):
            q[corners[i, k]] = heat[k]


@njit(cache=True, nogil=True, error_model="numpy")
def conduct_hexes(threads, *args):
    """Heat that flows to the corners of hexahedra by conduction in them, stored in q (flat); t: flat; corners (n, 8):
    where theirs are; g (n, 24) [W/K]: between HEX_PAIRS."""
    for part in range(threads):
        _conduct_hexes(part, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def conduct_hexes_threaded(threads, corners, g, t, q):
    """The same on several threads."""
    for part in prange(threads):
        _conduct_hexes(part, threads, corners, g, t, q)

"""What kernels.py lacks in space: apertures and conductances of triangular channels, and loads on their faces.

Pressure is linear over a channel, so what flows to its corners, -q . n s / 2 each (the manual's 7.5.1), is the sum of
what goes along its sides, d^3 cot(angle opposite) / (24 mu) times the difference of the head. So a channel is three
links, each of a third of its area, see network.py.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.physics.fdem.kernels import joints_space
from hpcdem.physics.flow.kernels import APERTURE, CONDUCT, DILATE, GAIN, HALF, INITIAL, LEAST, MOST, WEIGHT


@njit(cache=True, error_model="numpy")
def _conduct(over, area, ax, ay, az, bx, by, bz):
    """delta^3 cot(angle between a and b) / (24 mu) [m3 / (Pa s)]; over: delta^3 / (24 mu)."""
    return over * ((ax * bx + (ay * by + az * bz)) / (2.0 * area))


@njit(cache=True, nogil=True, error_model="numpy")
def _geometry(t, threads, one, other, law, laws, x, viscosity, out):
    x = x.reshape(x.size)
    n = len(one)
    for k in range(n * t // threads, n * (t + 1) // threads):
        a, b, c = one[k, 0], one[k, 1], one[k, 2]
        p, q, r = other[k, 0], other[k, 1], other[k, 2]  # p is opposite a, r opposite b, q opposite c
        nx, ny, nz, area, d0x, d0y, d0z, d1x, d1y, d1z, d2x, d2y, d2z = joints_space.opened(
            x[a], x[a + 1], x[a + 2], x[b], x[b + 1], x[b + 2], x[c], x[c + 1], x[c + 2], x[p], x[p + 1], x[p + 2],
            x[q], x[q + 1], x[q + 2], x[r], x[r + 1], x[r + 2],
        )  # fmt: skip
        o, _, _, _, slip = joints_space.parted(
            (d0x + (d1x + d2x)) / 3.0, (d0y + (d1y + d2y)) / 3.0, (d0z + (d1z + d2z)) / 3.0, nx, ny, nz
        )
        row = laws[law[3 * k]]
        delta = min(max(row[INITIAL] + o + min(row[DILATE] * slip, row[GAIN]), row[LEAST]), row[MOST])
        mx, my, mz = x[a] + x[p], x[a + 1] + x[p + 1], x[a + 2] + x[p + 2]
        ux, uy, uz = x[b] + x[r] - mx, x[b + 1] + x[r + 1] - my, x[b + 2] + x[r + 2] - mz
        wx, wy, wz = x[c] + x[q] - mx, x[c + 1] + x[q + 1] - my, x[c + 2] + x[q + 2] - mz
        ux, uy, uz, wx, wy, wz = 0.5 * ux, 0.5 * uy, 0.5 * uz, 0.5 * wx, 0.5 * wy, 0.5 * wz
        vx, vy, vz = wx - ux, wy - uy, wz - uz
        over = delta * delta * delta / (24.0 * viscosity)
        for m in range(3):
            out[3 * k + m, APERTURE] = delta
            out[3 * k + m, HALF] = delta * area / 6.0
            out[3 * k + m, WEIGHT] = 1.0
        out[3 * k, CONDUCT] = _conduct(over, area, ux, uy, uz, wx, wy, wz)
        out[3 * k + 1, CONDUCT] = _conduct(over, area, -ux, -uy, -uz, vx, vy, vz)
        out[3 * k + 2, CONDUCT] = _conduct(over, area, wx, wy, wz, vx, vy, vz)


@njit(cache=True, nogil=True, error_model="numpy")
def geometry(threads, *args):
    """Aperture [m], conductance [m3 / (Pa s)] and half of the volume [m3] of the links of channels, out (3 m, 4). one,
    other (m, 3): where the corners of both faces begin in x; law (3 m,): rows of laws; viscosity: dynamic [Pa s].

    The aperture follows the mean opening, and the size of the mean slip, of the present mid-surface."""
    for t in range(threads):
        _geometry(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def geometry_threaded(threads, one, other, law, laws, x, viscosity, out):
    """The same on several threads."""
    for t in prange(threads):
        _geometry(t, threads, one, other, law, laws, x, viscosity, out)


@njit(cache=True, nogil=True, error_model="numpy")
def loads(corner, nodes, x, state, column, applied):
    """Add the pressure on faces, a column of state, to what is applied to corners [N]: linear between the nodes (k, 3),
    A (2 p1 + p2 + p3) / 12 on the first. corner (k, 3): where they begin in x and in `applied`, both flat."""
    x, applied = x.reshape(x.size), applied.reshape(applied.size)
    for m in range(len(corner)):
        a, b, c = corner[m, 0], corner[m, 1], corner[m, 2]
        ux, uy, uz = x[b] - x[a], x[b + 1] - x[a + 1], x[b + 2] - x[a + 2]
        wx, wy, wz = x[c] - x[a], x[c + 1] - x[a + 1], x[c + 2] - x[a + 2]
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx  # 2 A n, outward
        total = state[nodes[m, 0], column] + (state[nodes[m, 1], column] + state[nodes[m, 2], column])
        for k in range(3):
            push = (total + state[nodes[m, k], column]) / 24.0
            at = corner[m, k]
            applied[at] -= push * nx
            applied[at + 1] -= push * ny
            applied[at + 2] -= push * nz


@njit(cache=True, nogil=True, error_model="numpy")
def loads_on_sides(corner, nodes, g, e, x, state, column, applied):
    """`loads` on halves of sides of hexahedra, whose opening is bilinear (fdem/kernels/joints_hexes.py): corner (k, 4),
    the last one that which only the other half has; nodes (k, 3); g (k, 4), e (k, 3)."""
    x, applied, push = x.reshape(x.size), applied.reshape(applied.size), np.empty(3)
    for m in range(len(corner)):
        a, b, c = corner[m, 0], corner[m, 1], corner[m, 2]
        ux, uy, uz = x[b] - x[a], x[b + 1] - x[a + 1], x[b + 2] - x[a + 2]
        wx, wy, wz = x[c] - x[a], x[c + 1] - x[a + 1], x[c + 2] - x[a + 2]
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx  # 2 A n, outward
        total = state[nodes[m, 0], column] + (state[nodes[m, 1], column] + state[nodes[m, 2], column])
        back = 0.0
        for k in range(3):
            push[k] = (total + state[nodes[m, k], column]) / 24.0
            back += e[m, k] * push[k]
        for k in range(4):
            at, share = corner[m, k], -g[m, k] * back + (push[k] if k < 3 else 0.0)
            applied[at] -= share * nx
            applied[at + 1] -= share * ny
            applied[at + 2] -= share * nz

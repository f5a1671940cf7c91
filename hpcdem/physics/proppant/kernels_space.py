"""What kernels.py lacks in space: how grains settle in triangular channels, and how these are thickened.

Nodes own their parts of a triangle up to its medians (the median dual). A link carries what crosses the piece of median
between its two ends, from the middle of their side to the centre. These pieces add up to nothing, so what crosses them
in a uniform field does too. What flows along the three links (flow/kernels_space.py) brings the same to each node, but
for a part that goes around the triangle: what crosses the medians is q minus the mean of its three.
"""

from __future__ import annotations

import math

from numba import njit

from hpcdem.physics.flow import kernels as flowing
from hpcdem.physics.proppant.kernels import resistance, weight


@njit(cache=True, error_model="numpy")
def _across(down, ax, ay, az, nx, ny, nz):
    return (down[0] * (ay * nz - az * ny) + down[1] * (az * nx - ax * nz) + down[2] * (ax * ny - ay * nx)) / 6.0


@njit(cache=True, nogil=True, error_model="numpy")
def falls(one, other, x, down, out):
    """What a unit velocity down (3,), a direction, brings across the medians of links, out (3 m,) [m]. one, other (m,
    3): where the corners of both faces begin in x. Of the velocity only what is in the plane of the triangle counts."""
    x = x.reshape(x.size)
    for k in range(len(one)):
        a, b, c = one[k, 0], one[k, 1], one[k, 2]
        p, q, r = other[k, 0], other[k, 1], other[k, 2]  # p is opposite a, r opposite b, q opposite c
        mx, my, mz = x[a] + x[p], x[a + 1] + x[p + 1], x[a + 2] + x[p + 2]
        ux, uy, uz = x[b] + x[r] - mx, x[b + 1] + x[r + 1] - my, x[b + 2] + x[r + 2] - mz
        wx, wy, wz = x[c] + x[q] - mx, x[c + 1] + x[q + 1] - my, x[c + 2] + x[q + 2] - mz
        ux, uy, uz, wx, wy, wz = 0.5 * ux, 0.5 * uy, 0.5 * uz, 0.5 * wx, 0.5 * wy, 0.5 * wz
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        size = math.sqrt(nx * nx + (ny * ny + nz * nz))
        nx, ny, nz = nx / size, ny / size, nz / size
        out[3 * k] = _across(down, -(ux + wx), -(uy + wy), -(uz + wz), nx, ny, nz)
        out[3 * k + 1] = _across(down, 2.0 * ux - wx, 2.0 * uy - wy, 2.0 * uz - wz, nx, ny, nz)
        out[3 * k + 2] = _across(down, 2.0 * wx - ux, 2.0 * wy - uy, 2.0 * wz - uz, nx, ny, nz)


@njit(cache=True, nogil=True, error_model="numpy")
def thicken(ends, state, factor, permeability, heavier, channels):
    """The same as kernels.thicken. The three parts of a triangle are one behind the other, so that its links keep their
    shares: one of a negative conductance has to be outweighed by the others."""
    for k in range(len(ends) // 3):
        delta, total = channels[3 * k, flowing.APERTURE], 0.0
        for m in range(3):
            total += resistance(state, ends[3 * k + m, 0], delta, factor, permeability)
        for m in range(3 * k, 3 * k + 3):
            channels[m, flowing.CONDUCT] *= 3.0 / total
            channels[m, flowing.WEIGHT] = weight(state, ends[m, 0], ends[m, 1], heavier)

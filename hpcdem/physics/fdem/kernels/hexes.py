"""Forces of hexahedra: the mean of two overlays of five tetrahedra, each with one volumetric strain (mixed
discretisation, Marti & Cundall 1982): with T the mean of the traces by volume a tetrahedron has the strain

    e* = e + (T - tr e) / 3 1

So it is one of tets.py with (lambda + 2 mu / 3) (T - tr e) besides in its stress without strain, and likewise of the
rates. Its corners are in six rows of storage (hexahedra.py); forces go to the first of those at each corner.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import U, four_columns, lane, put_four_columns
from hpcdem.physics.fdem.hexahedra import OVERLAYS, PARTS
from hpcdem.physics.fdem.kernels import tets
from hpcdem.physics.fdem.kernels.limits import corner_step
from hpcdem.physics.fdem.kernels.tet_stiffness import gradients, trial
from hpcdem.physics.fdem.kernels.tets import (
    C11,
    C12,
    C13,
    C21,
    C22,
    C23,
    C31,
    C32,
    C33,
    LAM,
    LAMBDA,
    MU2,
    ROW,
    S11,
    S12,
    S13,
    S22,
    S23,
    S33,
    STRIDE,
    TWO_MU,
    VISC,
    C,
    F,
    V,
    X,
)

BLOCK = 32
VOLUME = 13
"""Column of the table of tetrahedra (tets.TET) with the volume in the mesh [m3]."""
HX, HV, HF = lane(72), lane(104), lane(136)
TRACE, RATE = lane(168), lane(173)
T, D, SUM = (lane(178 + k) for k in range(3))
HM, H11 = lane(181), lane(189)
TRACE_NOW, RATE_NOW = lane(197), lane(198)
"""Of the tetrahedron that is worked on: distances between lanes must be constants in loops of vectors."""
LANES = 199
VOL = lane(32 + VOLUME)
_4, _8, _PER = U(4), U(8), lane(1)


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(n, first, place, x, v, mass, s0, lanes):
    for e in range(U(0), U(n), _4):
        i = first + np.int64(e)
        for c in range(8):
            at = U(place[i, c]), U(place[i + 1, c]), U(place[i + 2, c]), U(place[i + 3, c])
            four_columns(lanes, HX + U(4 * c) * _PER + e, x, at)
            four_columns(lanes, HV + U(4 * c) * _PER + e, v, at)
        q = U(first) * _8 + e * _8
        of = (q, q + _8, q + U(16), q + U(24))
        four_columns(lanes, HM + e, mass, of)
        four_columns(lanes, HM + _4 * _PER + e, mass, (of[0] + _4, of[1] + _4, of[2] + _4, of[3] + _4))
        four_columns(lanes, H11 + e, s0, of)
        four_columns(lanes, H11 + _4 * _PER + e, s0, (of[0] + _4, of[1] + _4, of[2] + _4, of[3] + _4))


@njit(cache=True, nogil=True, error_model="numpy")
def _copy(n, of, to, lanes):
    for e in range(U(n)):
        lanes[to + e] = lanes[of + e]


@njit(cache=True, nogil=True, error_model="numpy")
def _take(n, j, begin, c, lanes):
    """Tetrahedron j of n hexahedra, whose rows of c begin at `begin`, into the lanes of tets.py."""
    for k in range(4):
        corner, to = U(4 * OVERLAYS[j, k]) * _PER, U(4 * k) * _PER
        for m in range(U(3)):
            step = m * _PER
            for e in range(U(n)):
                lanes[X + to + step + e] = lanes[HX + corner + step + e]
            for e in range(U(n)):
                lanes[V + to + step + e] = lanes[HV + corner + step + e]
    for e in range(U(0), U(n), _4):
        q = (U(begin) + e) * U(16)
        for k in range(U(4)):
            at = q + k * _4
            four_columns(lanes, C + k * _4 * _PER + e, c, (at, at + U(16), at + U(32), at + U(48)))


@njit(cache=True, nogil=True, error_model="numpy")
def _trace(n, j, small, lanes):
    """Traces of strain and rate of tetrahedron j, and what they bring to the mean."""
    for e in range(U(n)):
        c11, c12, c13 = lanes[C11 + e], lanes[C12 + e], lanes[C13 + e]
        c21, c22, c23 = lanes[C21 + e], lanes[C22 + e], lanes[C23 + e]
        c31, c32, c33 = lanes[C31 + e], lanes[C32 + e], lanes[C33 + e]
        f = tets.gradient(lanes, X + e, c11, c12, c13, c21, c22, c23, c31, c32, c33)
        r = tets.frame(f, small)
        e11, e22, _, e33, _, _ = tets.in_frame(r, f)
        rate = tets.gradient(lanes, V + e, c11, c12, c13, c21, c22, c23, c31, c32, c33)
        d11, d22, _, d33, _, _ = tets.in_frame(r, rate)
        trace, flow, w = e11 + (e22 + e33) - 3.0, d11 + (d22 + d33), lanes[VOL + e]
        lanes[TRACE_NOW + e], lanes[RATE_NOW + e] = trace, flow
        lanes[T + e] += w * trace
        lanes[D + e] += w * flow
        lanes[SUM + e] += w
    _copy(n, TRACE_NOW, TRACE + U(j) * _PER, lanes)
    _copy(n, RATE_NOW, RATE + U(j) * _PER, lanes)


@njit(cache=True, nogil=True, error_model="numpy")
def _shift(n, j, beta, lanes):
    """Stress without strain of tetrahedron j, with what the mean of the traces brings."""
    _copy(n, TRACE + U(j) * _PER, TRACE_NOW, lanes)
    _copy(n, RATE + U(j) * _PER, RATE_NOW, lanes)
    for e in range(U(n)):
        m = lanes[MU2 + e]
        bulk, eta = lanes[LAM + e] + m / 3.0, lanes[VISC + e] + beta * m
        more = bulk * (lanes[T + e] - lanes[TRACE_NOW + e])
        more += (beta * lanes[LAM + e] + eta / 3.0) * (lanes[D + e] - lanes[RATE_NOW + e])
        lanes[S11 + e], lanes[S22 + e] = lanes[H11 + e] + more, lanes[H11 + _PER + e] + more
        lanes[S12 + e], lanes[S33 + e] = lanes[H11 + U(2) * _PER + e], lanes[H11 + U(3) * _PER + e] + more
        lanes[S13 + e], lanes[S23 + e] = lanes[H11 + U(4) * _PER + e], lanes[H11 + U(5) * _PER + e]


@njit(cache=True, nogil=True, error_model="numpy")
def _add(n, j, lanes):
    for k in range(4):
        corner, of = HF + U(4 * OVERLAYS[j, k]) * _PER, F + U(4 * k) * _PER
        for m in range(U(3)):
            for e in range(U(n)):
                lanes[corner + m * _PER + e] += 0.5 * lanes[of + m * _PER + e]


@njit(cache=True, nogil=True, error_model="numpy")
def _weigh(n, gx, gy, gz, drag, lanes):
    """Gravity and drag on the mass of each corner; these are the first forces."""
    for c in range(U(8)):
        force, speed = HF + _4 * c * _PER, HV + _4 * c * _PER
        for e in range(U(n)):
            m = lanes[HM + c * _PER + e]
            lanes[force + e] = m * (gx - drag * lanes[speed + e])
            lanes[force + _PER + e] = m * (gy - drag * lanes[speed + _PER + e])
            lanes[force + U(2) * _PER + e] = m * (gz - drag * lanes[speed + U(2) * _PER + e])
            lanes[force + U(3) * _PER + e] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _put(n, first, begin, place, force, lanes):
    for e in range(n):
        at = begin[first + e]
        for k in range(PARTS * ROW):
            force[at + k] = 0.0
    whole = n // 4 * 4
    for c in range(8):
        lanes_at = HF + U(4 * c) * _PER
        for k in range(0, whole, 4):
            i = first + k
            at = U(place[i, c]), U(place[i + 1, c]), U(place[i + 2, c]), U(place[i + 3, c])
            put_four_columns(force, at, lanes, lanes_at + U(k))
        for k in range(whole, n):
            for m in range(3):
                force[place[first + k, c] + m] = lanes[lanes_at + U(m) * _PER + U(k)]


@njit(cache=True, nogil=True, error_model="numpy")
def _forces(t, threads, count, begin, place, x, v, c, mass, s0, small, force, gx, gy, gz, drag, beta):
    lanes = np.zeros(LANES * np.int64(_PER))
    x, v, c, force = x.reshape(x.size), v.reshape(v.size), c.reshape(c.size), force.reshape(force.size)
    mass, s0 = mass.reshape(mass.size), s0.reshape(s0.size)
    blocks = -(-count // BLOCK)
    for b in range(blocks * t // threads, blocks * (t + 1) // threads):
        first = b * BLOCK
        n = min(BLOCK, count - first)
        _gather(n, first, place, x, v, mass, s0, lanes)
        _weigh(n, gx, gy, gz, drag, lanes)
        for overlay in range(2):
            for e in range(U(n)):
                lanes[T + e] = lanes[D + e] = lanes[SUM + e] = 0.0
            for j in range(5):
                _take(n, 5 * overlay + j, (5 * overlay + j) * count + first, c, lanes)
                _trace(n, j, small, lanes)
            for e in range(U(n)):
                lanes[T + e] /= lanes[SUM + e]
                lanes[D + e] /= lanes[SUM + e]
            for j in range(5):
                _take(n, 5 * overlay + j, (5 * overlay + j) * count + first, c, lanes)
                _shift(n, j, beta, lanes)
                tets.stress_forces(n, small, beta, lanes)
                _add(n, 5 * overlay + j, lanes)
        _put(n, first, begin, place, force, lanes)


@njit(cache=True, nogil=True, error_model="numpy")
def forces(threads, *args):
    """Forces on the corners of hexahedra, stored; nothing on the other corners of their rows.

    count: hexahedra; begin (count,), place (count + 3, 8) i4: where their rows, and the corners, begin in x (n, 16) and
    force (n, 16) [N]; c (10 count + 3, 16): `tets.TET`, of the first tetrahedron of all hexahedra, then of the second
    ...; mass (count + 3, 8) [kg] of the corners; s0 (count + 3, 8) [Pa]: stress without strain; others: see
    `tets.forces`.
    """
    for t in range(threads):
        _forces(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def forces_threaded(threads, count, begin, place, x, v, c, mass, s0, small, force, gx, gy, gz, drag, beta):
    """The same on several threads."""
    for t in prange(threads):
        _forces(t, threads, count, begin, place, x, v, c, mass, s0, small, force, gx, gy, gz, drag, beta)


@njit(cache=True, error_model="numpy")
def _parts(i, count, place, x, c, s0, small, rows, traces, lanes, room):
    """Corners of the ten tetrahedra of hexahedron i into rows (10, 16), traces of their strains, and of each overlay
    the mean (2,)."""
    flat, mean = x.reshape(x.size), np.zeros(2)
    for overlay in range(2):
        whole = 0.0
        for j in range(5 * overlay, 5 * overlay + 5):
            for k in range(4):
                for m in range(3):
                    rows[j, STRIDE * k + m] = flat[place[i, OVERLAYS[j, k]] + m]
            q = c[j * count + i]
            for k in range(ROW):
                lanes[X + U(k) * _PER] = rows[j, k]
            e11, e22, _, e33, _, _, _ = tets.strain(
                lanes, X, q[0], q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8], small
            )
            traces[j] = e11 + e22 + e33
            mean[overlay] += q[VOLUME] * traces[j]
            whole += q[VOLUME]
        mean[overlay] /= whole
    return mean


@njit(cache=True, nogil=True, error_model="numpy")
def stresses(which, count, place, x, c, s0, small, stress, energy):
    """Stress (n, 6) xx, yy, xy, zz, xz, yz [Pa], without the viscous part, and elastic energy (n,) [J] of the hexahedra
    `which` (n,): means by volume, see `tets.stresses`."""
    rows, traces, lanes, shifted, s = (
        np.zeros((10, ROW)), np.empty(10), np.zeros(tets.LANES * np.int64(_PER)), np.zeros(8), np.empty(6)
    )  # fmt: skip
    for n in range(len(which)):
        i = which[n]
        mean = _parts(i, count, place, x, c, s0, small, rows, traces, lanes, s)
        stress[n], energy[n], whole = 0.0, 0.0, 0.0
        for j in range(10):
            q = c[j * count + i]
            shift = mean[j // 5] - traces[j]
            for k in range(6):
                shifted[k] = s0[i, k]
            for k in (0, 1, 3):
                shifted[k] += (q[LAMBDA] + q[TWO_MU] / 3.0) * shift
            r = trial(rows[j], q, shifted, small, lanes, s)
            found = tets.turned(s[0], s[1], s[2], s[3], s[4], s[5], r)
            for k in range(6):
                stress[n, k] += q[VOLUME] * found[k]
            whole += q[VOLUME]
            e11, e22, e12, e33, e13, e23, _ = tets.strain(
                lanes, X, q[0], q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8], small
            )
            e11, e22, e33 = e11 + shift / 3.0, e22 + shift / 3.0, e33 + shift / 3.0
            o = s0[i]
            normal = (s[0] + o[0]) * e11 + (s[1] + o[1]) * e22 + (s[3] + o[3]) * e33
            shear = (s[2] + o[2]) * e12 + (s[4] + o[4]) * e13 + (s[5] + o[5]) * e23
            energy[n] += 0.25 * q[VOLUME] * (normal + 2.0 * shear)
        for k in range(6):
            stress[n, k] /= whole


@njit(cache=True, nogil=True, error_model="numpy")
def stiffness(count, place, x, c, s0, small, out):
    """K (count, 24, 24) [N/m] of hexahedra, see tet_stiffness.py: deviators tetrahedron by tetrahedron, the volume by
    overlays."""
    rows, traces, lanes, shifted, s = (
        np.zeros((10, ROW)), np.empty(10), np.zeros(tets.LANES * np.int64(_PER)), np.zeros(8), np.empty(6)
    )  # fmt: skip
    g, whole = np.empty((4, 3)), np.empty(24)
    for i in range(count):
        mean = _parts(i, count, place, x, c, s0, small, rows, traces, lanes, s)
        k = out[i]
        k[:] = 0.0
        for overlay in range(2):
            whole[:] = 0.0
            total = 0.0
            for j in range(5 * overlay, 5 * overlay + 5):
                q = c[j * count + i]
                volume = 0.5 * gradients(rows[j], q, small, g)
                for m in range(6):
                    shifted[m] = s0[i, m]
                for m in (0, 1, 3):
                    shifted[m] += (q[LAMBDA] + q[TWO_MU] / 3.0) * (mean[overlay] - traces[j])
                r = trial(rows[j], q, shifted, small, lanes, s)
                xx, yy, xy, zz, xz, yz = tets.turned(s[0], s[1], s[2], s[3], s[4], s[5], r)
                mu = 0.5 * q[TWO_MU]
                total += volume
                for a in range(4):
                    at = 3 * OVERLAYS[j, a]
                    tx = xx * g[a, 0] + xy * g[a, 1] + xz * g[a, 2]
                    ty = xy * g[a, 0] + yy * g[a, 1] + yz * g[a, 2]
                    tz = xz * g[a, 0] + yz * g[a, 1] + zz * g[a, 2]
                    for b in range(4):
                        to = 3 * OVERLAYS[j, b]
                        both = mu * (g[a, 0] * g[b, 0] + g[a, 1] * g[b, 1] + g[a, 2] * g[b, 2])
                        if not small:
                            both += tx * g[b, 0] + ty * g[b, 1] + tz * g[b, 2]
                        for m in range(3):
                            for n in range(3):
                                value = mu * (g[b, m] * g[a, n] - 2.0 / 3.0 * g[a, m] * g[b, n])
                                k[at + m, to + n] += volume * (value + both if m == n else value)
                    for m in range(3):
                        whole[at + m] += volume * g[a, m]
            bulk = (c[5 * overlay * count + i, LAMBDA] + c[5 * overlay * count + i, TWO_MU] / 3.0) / total
            for m in range(24):
                for n in range(24):
                    k[m, n] += bulk * whole[m] * whole[n]


@njit(cache=True, nogil=True, error_model="numpy")
def time_step(omega2, eta, modulus, place, springs, dashpots, drag, beta, safety, target, mass):
    """Largest stable time step over the corners of hexahedra [s], see `space.time_step`; omega2 (n,): the largest of
    their tetrahedra, which bounds that of the hexahedron as mass and stiffness are the means of the overlays."""
    least = math.inf
    for i in range(len(omega2)):
        damp = eta[i] + beta * modulus[i]
        for k in range(8):
            r, at = place[i, k] // ROW, place[i, k] % ROW // STRIDE
            true, spring, dashpot = mass[r, at], springs[i, k], dashpots[i, k]
            dt = corner_step(omega2[i], true, true, spring, dashpot, drag, damp, modulus[i])
            while safety * dt < target:
                mass[r, at] *= max((target / (safety * dt)) ** 2, 1.0 + 1e-6)
                dt = corner_step(omega2[i], true, mass[r, at], spring, dashpot, drag, damp, modulus[i])
            least = min(least, dt)
    return least

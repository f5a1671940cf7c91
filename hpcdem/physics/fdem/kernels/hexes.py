"""Forces of hexahedra: the mean of two overlays of five tetrahedra, each with one volumetric strain (mixed
discretisation, Marti & Cundall 1982): with T the mean of the traces by volume a tetrahedron has the strain

    e* = e + (T - tr e) / 3 1

and likewise the rate. Of its stress only the pressure depends on the others of its overlay, and that is the same in any
frame, so that one pass over the tetrahedra is enough: each adds its own part of the stress to the forces, its area
vectors A to those of the corners, and its trace to the mean; the pressure of the overlay times A comes last. Strains
and rates go through the rotation together: R^T (2 mu F + eta dF/dt). (reference.py has the same, step by step.)

Corners of hexahedra are in six rows of storage (hexahedra.py); forces go to the first of those at each corner.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import U, four_columns, lane, put_four_columns
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem.hexahedra import OVERLAYS
from hpcdem.physics.fdem.kernels import tets
from hpcdem.physics.fdem.kernels.limits import corner_step
from hpcdem.physics.fdem.kernels.tets import ETA, LAMBDA, ROW, STRIDE, TET, TWO_MU

BLOCK = 32
PARTS = len(OVERLAYS)
WORDS = 10
"""Of a tetrahedron: inverse of its reference matrix by rows, and its part of the volume of its overlay."""
SHARE = 9
IN_ROW = 2
"""Tetrahedra of a hexahedron of which a row of storage remembers something."""
VOLUME = 13
"""Column of the table of tetrahedra (tets.TET) with the volume in the mesh [m3], see `tetrahedron`."""
HEX = 20
"""Columns of the table of hexahedra: stress without strain (6) [Pa], volume of an overlay (2) [m3], masses of the
corners (8) [kg], lambda, 2 mu [Pa], viscosity [Pa s]."""
H_VOLUME, H_MASS, H_LAMBDA, H_TWO_MU, H_ETA = 6, 8, 16, 17, 18

CORNERS = tuple(tuple(corners) for corners in OVERLAYS.tolist())

HX, HV, HF, HA = (lane(32 * k) for k in range(4))
"""Of the corners: way from the first one; 2 mu times that and eta times the velocity; force; area vectors."""
H = lane(128)
E, Y, C, SH, F, A = H + lane(20), H + lane(29), H + lane(38), H + lane(47), H + lane(48), H + lane(57)
"""Of a tetrahedron: its sides, and those of the second kind; constants; forces and area vectors of corners 2, 3, 4."""
P = H + lane(66)
LANES = 128 + 67
_1, _2, _3, _4, _5, _6, _7, _8 = (lane(k) for k in range(1, 9))
_PER, _ROWS = lane(1), U(4)
_WORD = U(BLOCK)
_MASS, _LAMBDA, _TWO_MU, _ETA = (lane(k) for k in (H_MASS, H_LAMBDA, H_TWO_MU, H_ETA))


@njit(cache=True, nogil=True, error_model="numpy")
def gather(n, first, place, x, v, h, lanes):
    """Corners, velocities and constants of n hexahedra into lanes."""
    for e in range(U(0), U(n), _ROWS):
        i = first + np.int64(e)
        for c in range(8):
            at = U(place[i, c]), U(place[i + 1, c]), U(place[i + 2, c]), U(place[i + 3, c])
            four_columns(lanes, HX + U(4 * c) * _PER + e, x, at)
            four_columns(lanes, HV + U(4 * c) * _PER + e, v, at)
        q = U(i) * U(HEX)
        of = (q, q + U(HEX), q + U(2 * HEX), q + U(3 * HEX))
        for k in range(U(0), U(HEX), _ROWS):
            four_columns(lanes, H + k * _PER + e, h, (of[0] + k, of[1] + k, of[2] + k, of[3] + k))


@njit(cache=True, nogil=True, error_model="numpy")
def _weigh(n, gx, gy, gz, drag, lanes):
    """Gravity and drag on the mass of each corner; these are the first forces."""
    for c in range(U(8)):
        force, speed = HF + c * _4, HV + c * _4
        for e in range(U(n)):
            m = lanes[H + _MASS + c * _PER + e]
            lanes[force + e] = m * (gx - drag * lanes[speed + e])
            lanes[force + _1 + e] = m * (gy - drag * lanes[speed + _1 + e])
            lanes[force + _2 + e] = m * (gz - drag * lanes[speed + _2 + e])
            lanes[force + _3 + e] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def relate(n, beta, lanes):
    """Corners from the first one on, and what strains and rates are made of together."""
    for c in range(U(7), U(0), U(-1)):
        for axis in range(U(3)):
            to, of = HX + c * _4 + axis * _PER, HX + axis * _PER
            for e in range(U(n)):
                lanes[to + e] -= lanes[of + e]
    for axis in range(U(3)):
        for e in range(U(n)):
            lanes[HX + axis * _PER + e] = 0.0
    for c in range(U(8)):
        for axis in range(U(3)):
            to, of = HV + c * _4 + axis * _PER, HX + c * _4 + axis * _PER
            for e in range(U(n)):
                m = lanes[H + _TWO_MU + e]
                eta = lanes[H + _ETA + e] + beta * m
                lanes[to + e] = m * lanes[of + e] + eta * lanes[to + e]


@njit(cache=True, nogil=True, error_model="numpy")
def load(n, first, j, s0, lanes):
    """Stress without strain of tetrahedron j of n hexahedra, where that of the hexahedra stands."""
    for e in range(U(0), U(n), _ROWS):
        q = ((U(first) + e) * U(PARTS) + U(j)) * U(tets.STRESSES)
        step = U(PARTS * tets.STRESSES)
        of = (q, q + step, q + U(2) * step, q + U(3) * step)
        four_columns(lanes, H + e, s0, of)
        four_columns(lanes, H + _4 + e, s0, (of[0] + _ROWS, of[1] + _ROWS, of[2] + _ROWS, of[3] + _ROWS))


@njit(cache=True, error_model="numpy", forceinline=True)
def _one_side(of, to, a, b, e, lanes):
    a, b, to = of + a + e, of + b + e, to + e
    lanes[to], lanes[to + _1], lanes[to + _2] = (
        lanes[b] - lanes[a], lanes[b + _1] - lanes[a + _1], lanes[b + _2] - lanes[a + _2],
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def _sides(n, corners, lanes):
    """Sides of a tetrahedron from its first corner, of both kinds."""
    a, b, c, d = U(corners[0]) * _4, U(corners[1]) * _4, U(corners[2]) * _4, U(corners[3]) * _4
    for e in range(U(n)):
        _one_side(HX, E, a, b, e, lanes)
        _one_side(HX, E + _3, a, c, e, lanes)
        _one_side(HX, E + _6, a, d, e, lanes)
        _one_side(HV, Y, a, b, e, lanes)
        _one_side(HV, Y + _3, a, c, e, lanes)
        _one_side(HV, Y + _6, a, d, e, lanes)


@njit(cache=True, nogil=True, error_model="numpy")
def take(n, j, begin, parts, lanes):
    """Constants, from `begin` in `parts` on, and sides of tetrahedron j of n hexahedra. (Distances between lanes must
    be constants in loops of vectors: hence the list.)"""
    for k in range(U(WORDS)):
        to, of = C + k * _PER, begin + k * _WORD
        for e in range(U(n)):
            lanes[to + e] = parts[of + e]
    if j == 0:
        _sides(n, CORNERS[0], lanes)
    elif j == 1:
        _sides(n, CORNERS[1], lanes)
    elif j == 2:
        _sides(n, CORNERS[2], lanes)
    elif j == 3:
        _sides(n, CORNERS[3], lanes)
    elif j == 4:
        _sides(n, CORNERS[4], lanes)
    elif j == 5:
        _sides(n, CORNERS[5], lanes)
    elif j == 6:
        _sides(n, CORNERS[6], lanes)
    elif j == 7:
        _sides(n, CORNERS[7], lanes)
    elif j == 8:
        _sides(n, CORNERS[8], lanes)
    else:
        _sides(n, CORNERS[9], lanes)


@njit(cache=True, error_model="numpy", forceinline=True)
def _share(of, to, a, b, c, d, e, lanes):
    f2, f3, f4 = lanes[of + e], lanes[of + _3 + e], lanes[of + _6 + e]
    lanes[to + a + e] -= f2 + (f3 + f4)
    lanes[to + b + e] += f2
    lanes[to + c + e] += f3
    lanes[to + d + e] += f4


@njit(cache=True, error_model="numpy", forceinline=True)
def _sum_up(n, corners, lanes):
    """Forces and area vectors of a tetrahedron to those of its corners."""
    a, b, c, d = U(corners[0]) * _4, U(corners[1]) * _4, U(corners[2]) * _4, U(corners[3]) * _4
    for e in range(U(n)):
        _share(F, HF, a, b, c, d, e, lanes)
        _share(F + _1, HF + _1, a, b, c, d, e, lanes)
        _share(F + _2, HF + _2, a, b, c, d, e, lanes)
        _share(A, HA, a, b, c, d, e, lanes)
        _share(A + _1, HA + _1, a, b, c, d, e, lanes)
        _share(A + _2, HA + _2, a, b, c, d, e, lanes)


@njit(cache=True, nogil=True, error_model="numpy")
def _add(n, j, lanes):
    """Forces and area vectors of tetrahedron j to those of its corners, see `take`."""
    if j == 0:
        _sum_up(n, CORNERS[0], lanes)
    elif j == 1:
        _sum_up(n, CORNERS[1], lanes)
    elif j == 2:
        _sum_up(n, CORNERS[2], lanes)
    elif j == 3:
        _sum_up(n, CORNERS[3], lanes)
    elif j == 4:
        _sum_up(n, CORNERS[4], lanes)
    elif j == 5:
        _sum_up(n, CORNERS[5], lanes)
    elif j == 6:
        _sum_up(n, CORNERS[6], lanes)
    elif j == 7:
        _sum_up(n, CORNERS[7], lanes)
    elif j == 8:
        _sum_up(n, CORNERS[8], lanes)
    else:
        _sum_up(n, CORNERS[9], lanes)


@njit(cache=True, error_model="numpy", forceinline=True)
def _product(a1, a2, a3, b1, b2, b3):
    return a1 * b1 + (a2 * b2 + a3 * b3)


@njit(cache=True, error_model="numpy", forceinline=True)
def slope(at, e, lanes):
    """Sides from lane `at` on, times the inverse of those in the mesh, by rows."""
    ux, uy, uz = lanes[at + e], lanes[at + _1 + e], lanes[at + _2 + e]
    at = at + _3
    wx, wy, wz = lanes[at + e], lanes[at + _1 + e], lanes[at + _2 + e]
    at = at + _3
    tx, ty, tz = lanes[at + e], lanes[at + _1 + e], lanes[at + _2 + e]
    c11, c12, c13 = lanes[C + e], lanes[C + _1 + e], lanes[C + _2 + e]
    c21, c22, c23 = lanes[C + _3 + e], lanes[C + _4 + e], lanes[C + _5 + e]
    c31, c32, c33 = lanes[C + _6 + e], lanes[C + _7 + e], lanes[C + _8 + e]
    return (
        _product(ux, wx, tx, c11, c21, c31), _product(ux, wx, tx, c12, c22, c32), _product(ux, wx, tx, c13, c23, c33),
        _product(uy, wy, ty, c11, c21, c31), _product(uy, wy, ty, c12, c22, c32), _product(uy, wy, ty, c13, c23, c33),
        _product(uz, wz, tz, c11, c21, c31), _product(uz, wz, tz, c12, c22, c32), _product(uz, wz, tz, c13, c23, c33),
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def stress(beta, r, e, lanes):
    """Stress of a tetrahedron but for the pressure that strains bring, in the frame r that turns with it; and what it
    brings to the pressure of its overlay."""
    f, h = slope(E, e, lanes), slope(Y, e, lanes)
    h11, h22, h12, h33, h13, h23 = tets.in_frame(r, h)
    whole = h11 + (h22 + h33)
    trace = _product(r[0], r[3], r[6], f[0], f[3], f[6]) + (
        _product(r[1], r[4], r[7], f[1], f[4], f[7]) + _product(r[2], r[5], r[8], f[2], f[5], f[8])
    )
    lame, m = lanes[H + _LAMBDA + e], lanes[H + _TWO_MU + e]
    eta = lanes[H + _ETA + e] + beta * m
    of_rate = beta * lame / eta if beta > 0.0 else 0.0
    third = whole / 3.0
    p = lame * (trace - 3.0) + (of_rate * (whole - m * trace) + (third - m))
    return (
        lanes[H + e] + (h11 - third), lanes[H + _1 + e] + (h22 - third), lanes[H + _2 + e] + h12,
        lanes[H + _3 + e] + (h33 - third), lanes[H + _4 + e] + h13, lanes[H + _5 + e] + h23, p,
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def _pull_one(force, area, xx, yy, xy, zz, xz, yz, x, y, z, lanes):
    lanes[area], lanes[area + _1], lanes[area + _2] = x, y, z
    lanes[force] = _product(xx, xy, xz, x, y, z)
    lanes[force + _1] = _product(xy, yy, yz, x, y, z)
    lanes[force + _2] = _product(xz, yz, zz, x, y, z)


@njit(cache=True, error_model="numpy", forceinline=True)
def _pull(s, a2, a3, a4, e, lanes):
    """Forces and area vectors of corners 2, 3, 4, of a stress in space."""
    xx, yy, xy, zz, xz, yz = s
    _pull_one(F + e, A + e, xx, yy, xy, zz, xz, yz, a2[0], a2[1], a2[2], lanes)
    _pull_one(F + _3 + e, A + _3 + e, xx, yy, xy, zz, xz, yz, a3[0], a3[1], a3[2], lanes)
    _pull_one(F + _6 + e, A + _6 + e, xx, yy, xy, zz, xz, yz, a4[0], a4[1], a4[2], lanes)


@njit(cache=True, nogil=True, error_model="numpy")
def _large(n, beta, lanes):
    """Forces of a tetrahedron of each hexahedron but for the pressure of its overlay, area vectors (of its present
    shape: -1/12 of the cross products of its sides, for a mean of two overlays), and its part of that pressure."""
    for e in range(U(n)):
        f = slope(E, e, lanes)
        r = tets.rotation(f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8])
        s11, s22, s12, s33, s13, s23, p = stress(beta, r, e, lanes)
        lanes[P + e] += lanes[SH + e] * p
        s = tets.turned(s11, s22, s12, s33, s13, s23, r)
        ux, uy, uz = lanes[E + e], lanes[E + _1 + e], lanes[E + _2 + e]
        wx, wy, wz = lanes[E + _3 + e], lanes[E + _4 + e], lanes[E + _5 + e]
        tx, ty, tz = lanes[E + _6 + e], lanes[E + _7 + e], lanes[E + _8 + e]
        k = -1.0 / 12.0
        _pull(
            s, (k * (wy * tz - wz * ty), k * (wz * tx - wx * tz), k * (wx * ty - wy * tx)),
            (k * (ty * uz - tz * uy), k * (tz * ux - tx * uz), k * (tx * uy - ty * ux)),
            (k * (uy * wz - uz * wy), k * (uz * wx - ux * wz), k * (ux * wy - uy * wx)), e, lanes,
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _small(n, beta, lanes):
    """Compute the forces with small strains: area vectors are those of the mesh."""
    for e in range(U(n)):
        s11, s22, s12, s33, s13, s23, p = stress(beta, (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), e, lanes)
        lanes[P + e] += lanes[SH + e] * p
        c11, c12, c13 = lanes[C + e], lanes[C + _1 + e], lanes[C + _2 + e]
        c21, c22, c23 = lanes[C + _3 + e], lanes[C + _4 + e], lanes[C + _5 + e]
        c31, c32, c33 = lanes[C + _6 + e], lanes[C + _7 + e], lanes[C + _8 + e]
        k = -0.5 / tets.per_volume(c11, c12, c13, c21, c22, c23, c31, c32, c33)
        _pull(
            (s11, s22, s12, s33, s13, s23), (k * c11, k * c12, k * c13), (k * c21, k * c22, k * c23),
            (k * c31, k * c32, k * c33), e, lanes,
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _press(n, lanes):
    """The pressure of an overlay: forces of its corners; both sums begin again."""
    for c in range(U(8)):
        for axis in range(U(3)):
            at = c * _4 + axis * _PER
            for e in range(U(n)):
                lanes[HF + at + e] += lanes[P + e] * lanes[HA + at + e]
                lanes[HA + at + e] = 0.0
    for e in range(U(n)):
        lanes[P + e] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _put(n, first, place, force, lanes):
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
def _forces(t, threads, count, place, x, v, parts, h, own, s0, small, force, gx, gy, gz, drag, beta):
    lanes = np.zeros(LANES * np.int64(_PER))
    x, v, force = x.reshape(x.size), v.reshape(v.size), force.reshape(force.size)
    parts, h, s0 = parts.reshape(parts.size), h.reshape(h.size), s0.reshape(s0.size)
    blocks = -(-count // BLOCK)
    for b in range(blocks * t // threads, blocks * (t + 1) // threads):
        first = b * BLOCK
        n = min(BLOCK, count - first)
        gather(n, first, place, x, v, h, lanes)
        _weigh(n, gx, gy, gz, drag, lanes)
        relate(n, beta, lanes)
        for overlay in range(2):
            for j in range(5 * overlay, 5 * overlay + 5):
                take(n, j, U((b * PARTS + j) * WORDS * BLOCK), parts, lanes)
                if own:
                    load(n, first, j, s0, lanes)
                if small:
                    _small(n, beta, lanes)
                else:
                    _large(n, beta, lanes)
                _add(n, j, lanes)
            _press(n, lanes)
        _put(n, first, place, force, lanes)


@on_threads
def forces(threads, *args):
    """Forces on the corners of hexahedra, stored; of their rows nothing else is touched.

    count: hexahedra; place (count + 3, 8) i4: where the corners begin in x (n, 16) and force (n, 16) [N]; parts
    (blocks, 10, 10, 32): constants of the tetrahedra, `WORDS`; h (count + 3, 20): `HEX`; own: each tetrahedron
    has a stress without strain of its own, s0 (count + 3, 10, 8) [Pa]; others: see `tets.forces`.
    """
    for t in prange(threads):
        _forces(t, threads, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def add(rows, corner_of, pushed, force):
    """Sums of elements (k, 16) to the forces (n, 16) of theirs; corner_of (n, 4): where those of each corner are."""
    force = force.reshape(force.size)
    for i in range(len(rows)):
        for k in range(4):
            at = corner_of[rows[i], k]
            for axis in range(3):
                force[at + axis] += pushed[i, STRIDE * k + axis]


@njit(cache=True, error_model="numpy")
def tetrahedron(i, j, parts, h, q):
    """Row (16,) of the table of tetrahedra of tetrahedron j of hexahedron i, with its volume besides."""
    for k in range(9):
        q[k] = parts[i // BLOCK, j, k, i % BLOCK]
    q[LAMBDA], q[TWO_MU], q[ETA] = h[i, H_LAMBDA], h[i, H_TWO_MU], h[i, H_ETA]
    q[VOLUME] = h[i, H_VOLUME + j // 5] * parts[i // BLOCK, j, SHARE, i % BLOCK]


@njit(cache=True, error_model="numpy")
def traces_of(i, place, x, parts, h, small, rows, constants, traces, lanes):
    """Corners of the ten tetrahedra of hexahedron i into rows (10, 16), their constants (10, 16), traces of their
    strains, and of each overlay the mean (2,)."""
    flat, mean = x.reshape(x.size), np.zeros(2)
    for overlay in range(2):
        for j in range(5 * overlay, 5 * overlay + 5):
            tetrahedron(i, j, parts, h, constants[j])
            for k in range(4):
                for m in range(3):
                    rows[j, STRIDE * k + m] = flat[place[i, OVERLAYS[j, k]] + m]
            q = constants[j]
            for k in range(ROW):
                lanes[tets.X + U(k) * _PER] = rows[j, k]
            e11, e22, _, e33, _, _, _ = tets.strain(
                lanes, tets.X, q[0], q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8], small
            )
            traces[j] = e11 + e22 + e33
            mean[overlay] += parts[i // BLOCK, j, SHARE, i % BLOCK] * traces[j]
    return mean


@njit(cache=True, nogil=True, error_model="numpy")
def stresses(which, place, x, parts, h, own, s0, small, stress, energy):
    """Stress (n, 6) xx, yy, xy, zz, xz, yz [Pa], without the viscous part, and elastic energy (n,) [J] of the hexahedra
    `which` (n,): means by volume, see `tets.stresses`; own, s0: see `forces`."""
    rows, traces, lanes, shifted, s = (
        np.zeros((PARTS, ROW)), np.empty(PARTS), np.zeros(tets.LANES * np.int64(_PER)), np.zeros(8), np.empty(6)
    )  # fmt: skip
    constants = np.zeros((PARTS, TET))
    for n in range(len(which)):
        i = which[n]
        mean = traces_of(i, place, x, parts, h, small, rows, constants, traces, lanes)
        stress[n], energy[n], whole = 0.0, 0.0, 0.0
        for j in range(PARTS):
            q = constants[j]
            shift = mean[j // 5] - traces[j]
            for k in range(6):
                shifted[k] = s0[i, j, k] if own else h[i, k]
            for k in (0, 1, 3):
                shifted[k] += (q[LAMBDA] + q[TWO_MU] / 3.0) * shift
            r = tets.trial(rows[j], q, shifted, small, lanes, s)
            found = tets.turned(s[0], s[1], s[2], s[3], s[4], s[5], r)
            for k in range(6):
                stress[n, k] += q[VOLUME] * found[k]
            whole += q[VOLUME]
            e11, e22, e12, e33, e13, e23, _ = tets.strain(
                lanes, tets.X, q[0], q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8], small
            )
            e11, e22, e33 = e11 + shift / 3.0, e22 + shift / 3.0, e33 + shift / 3.0
            o = s0[i, j] if own else h[i]
            normal = (s[0] + o[0]) * e11 + (s[1] + o[1]) * e22 + (s[3] + o[3]) * e33
            shear = (s[2] + o[2]) * e12 + (s[4] + o[4]) * e13 + (s[5] + o[5]) * e23
            energy[n] += 0.25 * q[VOLUME] * (normal + 2.0 * shear)
        for k in range(6):
            stress[n, k] /= whole


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

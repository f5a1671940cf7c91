"""Forces of tetrahedra: stress of large rotations from the corners, joints (joints_space.py), gravity, drag; what
`elements` is in the plane.

A tetrahedron computes the forces on its own corners, in blocks of `BLOCK`: rows are turned into lanes
(numerics/lanes.py), the formulas are plain loops over lanes, forces go back to rows. space.py adds them up by nodes.

Row layouts: x, v and forces (n, 16): four corners of x, y, z and a spare word each. Stresses: 11, 22, 12, 33, 13, 23,
the first four as in the plane.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import U, four_columns, lane, put_four_columns
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem.kernels import joints_space
from hpcdem.physics.fdem.tetrahedra import ROW as ROW
from hpcdem.physics.fdem.tetrahedra import STRIDE as STRIDE

BLOCK = 32
"""Tetrahedra worked on together: their lanes stay in the first-level cache."""

# Columns of the table of tetrahedra (n, 16): inverse of the reference matrix [X2 - X1, X3 - X1, X4 - X1] by rows,
# Lame's lambda, 2 mu, viscosity [Pa s], mass of a corner [kg] (for gravity).
INVERSE, LAMBDA, TWO_MU, ETA, WEIGHT = 0, 9, 10, 11, 12
TET = 16
STRESSES = 8
"""Columns of the table of stresses without strain, of which six are used."""

X, V, C = (lane(k) for k in (0, 16, 32))
S11, S22, S12, S33, S13, S23 = (lane(48 + k) for k in range(6))
F = lane(56)
LANES = joints_space.FIRST
C11, C12, C13, C21, C22, C23, C31, C32, C33, LAM, MU2, VISC, MASS = (lane(32 + k) for k in range(13))
_4, _8, _12, _16 = U(4), U(8), U(12), U(16)
_PER_LANE = lane(1)


@njit(cache=True, error_model="numpy", forceinline=True)
def _nearer(a11, a12, a13, a21, a22, a23, a31, a32, a33):
    """One step of Newton's iteration for the rotation: (A + A^-T) / 2."""
    c11, c12, c13 = a22 * a33 - a23 * a32, a23 * a31 - a21 * a33, a21 * a32 - a22 * a31
    c21, c22, c23 = a32 * a13 - a33 * a12, a33 * a11 - a31 * a13, a31 * a12 - a32 * a11
    c31, c32, c33 = a12 * a23 - a13 * a22, a13 * a21 - a11 * a23, a11 * a22 - a12 * a21
    h = 0.5 / (a11 * c11 + (a12 * c12 + a13 * c13))
    return (
        0.5 * a11 + h * c11, 0.5 * a12 + h * c12, 0.5 * a13 + h * c13,
        0.5 * a21 + h * c21, 0.5 * a22 + h * c22, 0.5 * a23 + h * c23,
        0.5 * a31 + h * c31, 0.5 * a32 + h * c32, 0.5 * a33 + h * c33,
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def rotation(f11, f12, f13, f21, f22, f23, f31, f32, f33):
    """The rotation R of F = R U by rows: five steps of Newton's iteration (Higham 1986), which leaves nothing but
    rounding up to strains of 0.3."""
    r = _nearer(f11, f12, f13, f21, f22, f23, f31, f32, f33)
    r = _nearer(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8])
    r = _nearer(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8])
    r = _nearer(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8])
    return _nearer(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8])


@njit(cache=True, error_model="numpy", forceinline=True)
def _product(a1, a2, a3, b1, b2, b3):
    return a1 * b1 + (a2 * b2 + a3 * b3)


@njit(cache=True, error_model="numpy", forceinline=True)
def turned(s11, s22, s12, s33, s13, s23, r):
    """R S R^T: 11, 22, 12, 33, 13, 23."""
    a11, a12, a13 = (
        _product(r[0], r[1], r[2], s11, s12, s13),
        _product(r[0], r[1], r[2], s12, s22, s23),
        _product(r[0], r[1], r[2], s13, s23, s33),
    )
    a21, a22, a23 = (
        _product(r[3], r[4], r[5], s11, s12, s13),
        _product(r[3], r[4], r[5], s12, s22, s23),
        _product(r[3], r[4], r[5], s13, s23, s33),
    )
    a31, a32, a33 = (
        _product(r[6], r[7], r[8], s11, s12, s13),
        _product(r[6], r[7], r[8], s12, s22, s23),
        _product(r[6], r[7], r[8], s13, s23, s33),
    )
    return (
        _product(a11, a12, a13, r[0], r[1], r[2]), _product(a21, a22, a23, r[3], r[4], r[5]),
        _product(a11, a12, a13, r[3], r[4], r[5]), _product(a31, a32, a33, r[6], r[7], r[8]),
        _product(a11, a12, a13, r[6], r[7], r[8]), _product(a21, a22, a23, r[6], r[7], r[8]),
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def gradient(x, at, c11, c12, c13, c21, c22, c23, c31, c32, c33):
    """[a2 - a1, a3 - a1, a4 - a1] C by rows, of what the corners have, four words from `at` on each apart by `step`
    lanes."""
    a1, b1, c1 = x[at], x[at + _PER_LANE], x[at + U(2) * _PER_LANE]
    at = at + _4 * _PER_LANE
    ux, uy, uz = x[at] - a1, x[at + _PER_LANE] - b1, x[at + U(2) * _PER_LANE] - c1
    at = at + _4 * _PER_LANE
    wx, wy, wz = x[at] - a1, x[at + _PER_LANE] - b1, x[at + U(2) * _PER_LANE] - c1
    at = at + _4 * _PER_LANE
    tx, ty, tz = x[at] - a1, x[at + _PER_LANE] - b1, x[at + U(2) * _PER_LANE] - c1
    return (
        _product(ux, wx, tx, c11, c21, c31), _product(ux, wx, tx, c12, c22, c32), _product(ux, wx, tx, c13, c23, c33),
        _product(uy, wy, ty, c11, c21, c31), _product(uy, wy, ty, c12, c22, c32), _product(uy, wy, ty, c13, c23, c33),
        _product(uz, wz, tz, c11, c21, c31), _product(uz, wz, tz, c12, c22, c32), _product(uz, wz, tz, c13, c23, c33),
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def in_frame(r, g):
    """Symmetric part of R^T G: 11, 22, 12, 33, 13, 23."""
    return (
        _product(r[0], r[3], r[6], g[0], g[3], g[6]), _product(r[1], r[4], r[7], g[1], g[4], g[7]),
        0.5 * (_product(r[0], r[3], r[6], g[1], g[4], g[7]) + _product(r[1], r[4], r[7], g[0], g[3], g[6])),
        _product(r[2], r[5], r[8], g[2], g[5], g[8]),
        0.5 * (_product(r[0], r[3], r[6], g[2], g[5], g[8]) + _product(r[2], r[5], r[8], g[0], g[3], g[6])),
        0.5 * (_product(r[1], r[4], r[7], g[2], g[5], g[8]) + _product(r[2], r[5], r[8], g[1], g[4], g[7])),
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def frame(f, small):
    """The frame in which strain is measured, by rows."""
    r = rotation(f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8])
    return (
        1.0 if small else r[0], 0.0 if small else r[1], 0.0 if small else r[2],
        0.0 if small else r[3], 1.0 if small else r[4], 0.0 if small else r[5],
        0.0 if small else r[6], 0.0 if small else r[7], 1.0 if small else r[8],
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def strain(x, at, c11, c12, c13, c21, c22, c23, c31, c32, c33, small):
    """Strain U - 1 (11, 22, 12, 33, 13, 23) of a tetrahedron in the frame that turns with it, and that frame; arguments
    as for `gradient`."""
    f = gradient(x, at, c11, c12, c13, c21, c22, c23, c31, c32, c33)
    r = frame(f, small)
    e11, e22, e12, e33, e13, e23 = in_frame(r, f)
    return e11 - 1.0, e22 - 1.0, e12, e33 - 1.0, e13, e23, r


@njit(cache=True, error_model="numpy", forceinline=True)
def per_volume(c11, c12, c13, c21, c22, c23, c31, c32, c33):
    """One over the volume of a tetrahedron in the mesh [1/m3], by the inverse of its sides."""
    return 6.0 * _product(c11, c12, c13, c22 * c33 - c23 * c32, c23 * c31 - c21 * c33, c21 * c32 - c22 * c31)


@njit(cache=True, error_model="numpy")
def trial(x, c, s0, small, lanes, stress):
    """Stress (6,) [Pa] of an elastic tetrahedron in the frame that turns with it, and that frame."""
    for k in range(ROW):
        lanes[X + U(k) * _PER_LANE] = x[k]
    e11, e22, e12, e33, e13, e23, r = strain(lanes, X, c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], small)
    p, m = c[LAMBDA] * (e11 + (e22 + e33)), c[TWO_MU]
    stress[0], stress[1], stress[2] = s0[0] + (p + m * e11), s0[1] + (p + m * e22), s0[2] + m * e12
    stress[3], stress[4], stress[5] = s0[3] + (p + m * e33), s0[4] + m * e13, s0[5] + m * e23
    return r


@njit(cache=True, nogil=True, error_model="numpy")
def stress_forces(n, small, beta, lanes):
    """Corner forces of stress, viscous parts included: f_l = -V sigma grad N_l, with the present shape functions, or
    those of the mesh if strains are small."""
    for e in range(U(n)):
        c11, c12, c13 = lanes[C11 + e], lanes[C12 + e], lanes[C13 + e]
        c21, c22, c23 = lanes[C21 + e], lanes[C22 + e], lanes[C23 + e]
        c31, c32, c33 = lanes[C31 + e], lanes[C32 + e], lanes[C33 + e]
        f = gradient(lanes, X + e, c11, c12, c13, c21, c22, c23, c31, c32, c33)
        r = frame(f, small)
        e11, e22, e12, e33, e13, e23 = in_frame(r, f)
        e11, e22, e33 = e11 - 1.0, e22 - 1.0, e33 - 1.0
        d11, d22, d12, d33, d13, d23 = in_frame(r, gradient(lanes, V + e, c11, c12, c13, c21, c22, c23, c31, c32, c33))
        m, eta = lanes[MU2 + e], lanes[VISC + e] + beta * lanes[MU2 + e]
        p = lanes[LAM + e] * (e11 + (e22 + e33)) + beta * lanes[LAM + e] * (d11 + (d22 + d33))
        s11 = lanes[S11 + e] + ((p + m * e11) + eta * d11)
        s22 = lanes[S22 + e] + ((p + m * e22) + eta * d22)
        s33 = lanes[S33 + e] + ((p + m * e33) + eta * d33)
        s12 = lanes[S12 + e] + (m * e12 + eta * d12)
        s13 = lanes[S13 + e] + (m * e13 + eta * d13)
        s23 = lanes[S23 + e] + (m * e23 + eta * d23)
        xx, yy, xy, zz, xz, yz = turned(s11, s22, s12, s33, s13, s23, r)
        # V grad N of the corners 2, 3, 4 in the mesh: rows of C over 6 det C; now: cof(F) times that.
        k11, k12, k13 = f[4] * f[8] - f[5] * f[7], f[5] * f[6] - f[3] * f[8], f[3] * f[7] - f[4] * f[6]
        k21, k22, k23 = f[7] * f[2] - f[8] * f[1], f[8] * f[0] - f[6] * f[2], f[6] * f[1] - f[7] * f[0]
        k31, k32, k33 = f[1] * f[5] - f[2] * f[4], f[2] * f[3] - f[0] * f[5], f[0] * f[4] - f[1] * f[3]
        k11, k12, k13 = (1.0 if small else k11), (0.0 if small else k12), (0.0 if small else k13)
        k21, k22, k23 = (0.0 if small else k21), (1.0 if small else k22), (0.0 if small else k23)
        k31, k32, k33 = (0.0 if small else k31), (0.0 if small else k32), (1.0 if small else k33)
        det = _product(c11, c12, c13, c22 * c33 - c23 * c32, c23 * c31 - c21 * c33, c21 * c32 - c22 * c31)
        h = -1.0 / (6.0 * det)
        g1, g2, g3 = (
            _product(k11, k12, k13, c11, c12, c13),
            _product(k21, k22, k23, c11, c12, c13),
            _product(k31, k32, k33, c11, c12, c13),
        )
        fx2, fy2, fz2 = (
            _product(xx, xy, xz, g1, g2, g3),
            _product(xy, yy, yz, g1, g2, g3),
            _product(xz, yz, zz, g1, g2, g3),
        )
        g1, g2, g3 = (
            _product(k11, k12, k13, c21, c22, c23),
            _product(k21, k22, k23, c21, c22, c23),
            _product(k31, k32, k33, c21, c22, c23),
        )
        fx3, fy3, fz3 = (
            _product(xx, xy, xz, g1, g2, g3),
            _product(xy, yy, yz, g1, g2, g3),
            _product(xz, yz, zz, g1, g2, g3),
        )
        g1, g2, g3 = (
            _product(k11, k12, k13, c31, c32, c33),
            _product(k21, k22, k23, c31, c32, c33),
            _product(k31, k32, k33, c31, c32, c33),
        )
        fx4, fy4, fz4 = (
            _product(xx, xy, xz, g1, g2, g3),
            _product(xy, yy, yz, g1, g2, g3),
            _product(xz, yz, zz, g1, g2, g3),
        )
        fx2, fy2, fz2, fx3, fy3, fz3 = h * fx2, h * fy2, h * fz2, h * fx3, h * fy3, h * fz3
        fx4, fy4, fz4 = h * fx4, h * fy4, h * fz4
        _put_force(lanes, F + e, -(fx2 + (fx3 + fx4)), -(fy2 + (fy3 + fy4)), -(fz2 + (fz3 + fz4)))
        _put_force(lanes, F + _4 * _PER_LANE + e, fx2, fy2, fz2)
        _put_force(lanes, F + _8 * _PER_LANE + e, fx3, fy3, fz3)
        _put_force(lanes, F + _12 * _PER_LANE + e, fx4, fy4, fz4)


@njit(cache=True, error_model="numpy", forceinline=True)
def _put_force(lanes, at, x, y, z):
    lanes[at], lanes[at + _PER_LANE], lanes[at + U(2) * _PER_LANE] = x, y, z


@njit(cache=True, nogil=True, error_model="numpy")
def _weigh(n, gx, gy, gz, drag, lanes):
    """Gravity and drag on the mass of each corner."""
    for k in range(4):
        force, speed = F + U(4 * k) * _PER_LANE, V + U(4 * k) * _PER_LANE
        for e in range(U(n)):
            m = lanes[MASS + e]
            lanes[force + e] += m * (gx - drag * lanes[speed + e])
            lanes[force + _PER_LANE + e] += m * (gy - drag * lanes[speed + _PER_LANE + e])
            lanes[force + U(2) * _PER_LANE + e] += m * (gz - drag * lanes[speed + U(2) * _PER_LANE + e])


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(n, first, rows, x, v, c, s0, stressed, lanes):
    """Rows of the tetrahedra first : first + n into lanes, in groups of four (rows is long enough)."""
    for e in range(U(0), U(n), _4):
        i = U(first) + e
        at = (
            U(rows[i]) * _16, U(rows[i + U(1)]) * _16, U(rows[i + U(2)]) * _16, U(rows[i + U(3)]) * _16,
        )  # fmt: skip
        q = i * _16
        of = (q, q + _16, q + U(32), q + U(48))
        for k in range(U(4)):
            step = k * _4
            here = (at[0] + step, at[1] + step, at[2] + step, at[3] + step)
            four_columns(lanes, X + step * _PER_LANE + e, x, here)
            four_columns(lanes, V + step * _PER_LANE + e, v, here)
            four_columns(lanes, C + step * _PER_LANE + e, c, (of[0] + step, of[1] + step, of[2] + step, of[3] + step))
        if stressed:
            q = i * _8
            of = (q, q + _8, q + _16, q + U(24))
            four_columns(lanes, S11 + e, s0, of)
            four_columns(lanes, S13 + e, s0, (of[0] + _4, of[1] + _4, of[2] + _4, of[3] + _4))


@njit(cache=True, nogil=True, error_model="numpy")
def _put(n, first, rows, force, lanes):
    whole = U(n // 4 * 4)
    for e in range(U(0), whole, _4):
        i = U(first) + e
        at = (
            U(rows[i]) * _16, U(rows[i + U(1)]) * _16, U(rows[i + U(2)]) * _16, U(rows[i + U(3)]) * _16,
        )  # fmt: skip
        for k in range(U(4)):
            step = k * _4
            put_four_columns(
                force, (at[0] + step, at[1] + step, at[2] + step, at[3] + step), lanes, F + step * _PER_LANE + e
            )
    for e in range(whole, U(n)):
        at = U(rows[U(first) + e]) * _16
        for k in range(_16):
            force[at + k] = lanes[F + k * _PER_LANE + e]


@njit(cache=True, nogil=True, error_model="numpy")
def _forces(
    t,
    threads,
    count,
    rows,
    x,
    v,
    c,
    s0,
    stressed,
    small,
    force,
    gx,
    gy,
    gz,
    drag,
    beta,
    jointed,
    sizes,
    link,
    law,
    kind,
    state,
    history,
    head,
    follow,
    table,
    beyond,
    keep,
    of_joints,
    step,
    tally,
):
    lanes = np.zeros(joints_space.LANES * np.int64(_PER_LANE))
    x, v, c, s0, force = (
        x.reshape(x.size),
        v.reshape(v.size),
        c.reshape(c.size),
        s0.reshape(s0.size),
        force.reshape(force.size),
    )
    flat_table, room, kinetic = table.reshape(table.size), joints_space.rooms(), (V, MASS)
    blocks = -(-count // BLOCK)
    for b in range(blocks * t // threads, blocks * (t + 1) // threads):
        first = b * BLOCK
        n = min(BLOCK, count - first)
        _gather(n, first, rows, x, v, c, s0, stressed, lanes)
        stress_forces(n, small, beta, lanes)
        if jointed:
            joints_space.add_joints(
                b, n, first, rows, x, sizes, link, law, kind, state, history, head, follow, table, beyond, flat_table,
                keep, of_joints, F, kinetic, step, lanes, room, tally[t],
            )  # fmt: skip
        _weigh(n, gx, gy, gz, drag, lanes)
        _put(n, first, rows, force, lanes)


@on_threads
def forces(threads, *args):
    """Forces on the corners of tetrahedra, stored. Joint histories move on.

    count: tetrahedra; rows (count + 3,) i4: their storage rows; x, v (n, 16); c (count + 3, 16): `TET`; s0 (count + 3,
    8) [Pa]: stress without strain, unless not `stressed`; small: no rotations; force (n, 16) [N]; gx, gy, gz [m/s2];
    drag [1/s], beta [s]: Rayleigh damping. With `jointed`, four slots per tetrahedron: sizes, link, see
    `joints_space.links`; law, kind, state, history, follow, table, beyond, tally: see `elements.triangles`; head (4
    blocks,): lists of joints past their peak by block and face; keep: forces of joints into of_joints (n, 16) [N].
    """
    for t in prange(threads):
        _forces(t, threads, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def stresses(x, rows, c, s0, small, first, stress, energy):
    """Stress (n, 6) xx, yy, xy, zz, xz, yz [Pa], without the viscous part, and elastic energy (n,) [J], or (0,): not
    wanted, of tetrahedra in the storage rows `rows`; first: of those, the row of the first of `stress`. Energy: (s0 +
    sigma / 2) : epsilon V."""
    lanes = np.zeros(LANES * np.int64(_PER_LANE))
    for i in range(len(rows)):
        for k in range(16):
            lanes[X + U(k) * _PER_LANE] = x[rows[i], k]
        q = c[i]
        e11, e22, e12, e33, e13, e23, r = strain(lanes, X, q[0], q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8], small)
        p, m = q[LAMBDA] * (e11 + (e22 + e33)), q[TWO_MU]
        s11, s22, s33 = p + m * e11, p + m * e22, p + m * e33
        s12, s13, s23 = m * e12, m * e13, m * e23
        out = stress[rows[i] - first]
        out[0], out[1], out[2], out[3], out[4], out[5] = turned(
            s0[i, 0] + s11, s0[i, 1] + s22, s0[i, 2] + s12, s0[i, 3] + s33, s0[i, 4] + s13, s0[i, 5] + s23, r
        )
        if len(energy):
            per = per_volume(q[0], q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8])
            normal = (s0[i, 0] + 0.5 * s11) * e11 + (s0[i, 1] + 0.5 * s22) * e22 + (s0[i, 3] + 0.5 * s33) * e33
            shear = (s0[i, 2] + 0.5 * s12) * e12 + (s0[i, 4] + 0.5 * s13) * e13 + (s0[i, 5] + 0.5 * s23) * e23
            energy[rows[i] - first] = (normal + 2.0 * shear) / per


@njit(cache=True, nogil=True, error_model="numpy")
def _drift(t, threads, first, last, x, v, dt):
    n = last - first
    for r in range(U(first + n * t // threads), U(first + n * (t + 1) // threads)):
        for c in range(ROW):
            x[r, c] += v[r, c] * dt


@on_threads
def drift(threads, *args):
    """x += v dt for the storage rows first : last."""
    for t in prange(threads):
        _drift(t, threads, *args)

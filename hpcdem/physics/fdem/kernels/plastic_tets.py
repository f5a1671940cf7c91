"""Plastic flow of tetrahedra after Mohr and Coulomb: what plasticity.py is in the plane, with its return of principal
stresses and its formulas.

Principal stresses and their axes are found by Jacobi's rotations (Golub & Van Loan, Matrix Computations, 8.5): where
two stresses are equal, as on the edges of the yield surface, the roots of the cubic have lost half of their digits. The
plastic strain has the axes of the trial stress. Most stresses are far inside, which is seen without their axes: with
the mean p and r = sqrt(J_2 / 3) the principal stresses are p + 2 r cos(t), p + 2 r cos(t +- 120 degrees), so that

    f_s <= (N_phi - 1) p + 2 r sqrt(1 + N_phi + N_phi^2) - 2 c sqrt(N_phi),   f_t <= p + 2 r - T.

-D e_p is added to the initial stress, so the loop over the forces of tetrahedra is the elastic one.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import CAPACITY, U, four_columns, lane
from hpcdem.physics.fdem.kernels import plasticity, strength, tets
from hpcdem.physics.fdem.kernels.plasticity import (
    E11,
    E12,
    E22,
    E33,
    IN_SHEAR,
    IN_TENSION,
    SHEAR,
    VOLUME,
    WORK,
    principal_return,
)
from hpcdem.physics.fdem.kernels.strength import SHEAR_NOW, TENSION_NOW
from hpcdem.physics.fdem.kernels.tets import (
    BLOCK,
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
    S11,
    S12,
    S13,
    S22,
    S23,
    S33,
    TWO_MU,
    C,
    X,
)

# Columns of what an element remembers (n, 11): those of the plane, then the two other shear components of the plastic
# strain; plastic work [J].
E13, E23 = plasticity.MEMORY, plasticity.MEMORY + 1
MEMORY = plasticity.MEMORY + 2
SWEEPS = 5
"""Each of three rotations; the rest falls with its square at least, and is rounding after four."""

_M = tets.LANES
L_PHI, L_PSI, L_STRENGTH, L_TENSILE, OUTSIDE = (lane(_M + k) for k in range(5))
# Of those that may be outside: law, moduli, 1 / volume; the stress, which becomes diagonal; its axes, by columns.
P_PHI, P_PSI, P_STRENGTH, P_TENSILE, P_LAM, P_MU2, P_PER = (lane(_M + 5 + k) for k in range(7))
T11, T22, T12, T33, T13, T23 = (lane(_M + 12 + k) for k in range(6))
X1, Y1, Z1, X2, Y2, Z2, X3, Y3, Z3 = (lane(_M + 18 + k) for k in range(9))
# What flows: plastic strain, how, and its measures.
P11, P22, P12, P33, P13, P23, HOW, P_SHEAR, P_VOLUME, P_WORK, P_SHORT = (lane(_M + 27 + k) for k in range(11))
LANES = _M + 38
_4, _8, _16, _PER = U(4), U(8), U(16), lane(1)
_LANE = np.int64(CAPACITY)


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(n, first, who, rows, x, c, s0, law, table, lanes):
    """Corners, constants, stress without strain and yield surfaces of who[first : first + n] into lanes."""
    for e in range(U(0), U(n), _4):
        at = U(first) + e
        a, b = U(who[at]), U(who[at + U(1)])
        d, f = U(who[at + U(2)]), U(who[at + U(3)])
        r = U(rows[a]) * _16, U(rows[b]) * _16, U(rows[d]) * _16, U(rows[f]) * _16
        q = a * _16, b * _16, d * _16, f * _16
        for k in range(U(4)):
            step = k * _4
            four_columns(lanes, X + step * _PER + e, x, (r[0] + step, r[1] + step, r[2] + step, r[3] + step))
            four_columns(lanes, C + step * _PER + e, c, (q[0] + step, q[1] + step, q[2] + step, q[3] + step))
        q = a * _8, b * _8, d * _8, f * _8
        four_columns(lanes, S11 + e, s0, q)
        four_columns(lanes, S13 + e, s0, (q[0] + _4, q[1] + _4, q[2] + _4, q[3] + _4))
        four_columns(
            lanes, L_PHI + e, table, (U(law[a]) * _4, U(law[b]) * _4, U(law[d]) * _4, U(law[f]) * _4)
        )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def most_outside(s11, s22, s12, s33, s13, s23, n_phi, k, tensile):
    """By how much [Pa] a stress is outside the yield surface at most; not above zero: it is inside."""
    p = (s11 + (s22 + s33)) / 3.0
    d11, d22, d33 = s11 - p, s22 - p, s33 - p
    squares = 0.5 * (d11 * d11 + (d22 * d22 + d33 * d33)) + (s12 * s12 + (s13 * s13 + s23 * s23))
    size = 2.0 * math.sqrt(squares / 3.0)
    shear, tension = (n_phi - 1.0) * p + size * math.sqrt(1.0 + n_phi + n_phi * n_phi) - k, p + size - tensile
    return shear if shear > tension else tension


@njit(cache=True, nogil=True, error_model="numpy")
def _try(n, small, lanes):
    """Trial stresses, in the place of those without strain, and by how much they are outside at most."""
    for e in range(U(n)):
        e11, e22, e12, e33, e13, e23, _ = tets.strain(
            lanes, X + e, lanes[C11 + e], lanes[C12 + e], lanes[C13 + e], lanes[C21 + e], lanes[C22 + e],
            lanes[C23 + e], lanes[C31 + e], lanes[C32 + e], lanes[C33 + e], small,
        )  # fmt: skip
        p, m = lanes[LAM + e] * (e11 + (e22 + e33)), lanes[MU2 + e]
        s11, s22, s33 = lanes[S11 + e] + (p + m * e11), lanes[S22 + e] + (p + m * e22), lanes[S33 + e] + (p + m * e33)
        s12, s13, s23 = lanes[S12 + e] + m * e12, lanes[S13 + e] + m * e13, lanes[S23 + e] + m * e23
        lanes[S11 + e], lanes[S22 + e], lanes[S12 + e] = s11, s22, s12
        lanes[S33 + e], lanes[S13 + e], lanes[S23 + e] = s33, s13, s23
        lanes[OUTSIDE + e] = most_outside(
            s11, s22, s12, s33, s13, s23, lanes[L_PHI + e], lanes[L_STRENGTH + e], lanes[L_TENSILE + e]
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(n, lanes, which):
    """Those that may be outside, side by side; which (BLOCK,) i8: which they are. Returns their number."""
    m = 0
    for k in range(n):
        e, at = U(k), U(m)
        if lanes[OUTSIDE + e] > 0.0:
            for c in range(U(6)):
                lanes[T11 + c * U(CAPACITY) + at] = lanes[S11 + c * U(CAPACITY) + e]
            for c in range(U(4)):
                lanes[P_PHI + c * U(CAPACITY) + at] = lanes[L_PHI + c * U(CAPACITY) + e]
            lanes[P_LAM + at], lanes[P_MU2 + at] = lanes[LAM + e], lanes[MU2 + e]
            lanes[P_PER + at] = tets.per_volume(
                lanes[C11 + e], lanes[C12 + e], lanes[C13 + e], lanes[C21 + e], lanes[C22 + e], lanes[C23 + e],
                lanes[C31 + e], lanes[C32 + e], lanes[C33 + e],
            )  # fmt: skip
            which[m] = k
            m += 1
    return m


def _rotation(pp, qq, pq, rp, rq, p, q):
    """The loop that makes the stress component pq zero by a turn of two axes. pp ...: lanes of the stress; p, q: first
    of the three lanes of these axes. One function each: distances between lanes must be constants."""
    p2, p3, q2, q3 = p + lane(1), p + lane(2), q + lane(1), q + lane(2)

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(n, lanes):
        for e in range(U(n)):
            d, b = lanes[qq + e] - lanes[pp + e], 2.0 * lanes[pq + e]
            whole = abs(d) + math.sqrt(d * d + b * b)
            t = (b if d >= 0.0 else -b) / (whole if whole > 0.0 else 1.0)
            cs = 1.0 / math.sqrt(1.0 + t * t)
            sn, more = t * cs, 0.5 * t * b
            lanes[pp + e], lanes[qq + e], lanes[pq + e] = lanes[pp + e] - more, lanes[qq + e] + more, 0.0
            u, w = lanes[rp + e], lanes[rq + e]
            lanes[rp + e], lanes[rq + e] = cs * u - sn * w, sn * u + cs * w
            u, w = lanes[p + e], lanes[q + e]
            lanes[p + e], lanes[q + e] = cs * u - sn * w, sn * u + cs * w
            u, w = lanes[p2 + e], lanes[q2 + e]
            lanes[p2 + e], lanes[q2 + e] = cs * u - sn * w, sn * u + cs * w
            u, w = lanes[p3 + e], lanes[q3 + e]
            lanes[p3 + e], lanes[q3 + e] = cs * u - sn * w, sn * u + cs * w

    return loop


_rotate_12 = _rotation(T11, T22, T12, T13, T23, X1, X2)
_rotate_13 = _rotation(T11, T33, T13, T12, T23, X1, X3)
_rotate_23 = _rotation(T22, T33, T23, T12, T13, X2, X3)


@njit(cache=True, nogil=True, error_model="numpy")
def find_axes(n, lanes):
    """Principal stresses of the first n, in the place of the diagonal of the stress, and their axes."""
    for e in range(U(n)):
        lanes[X1 + e], lanes[Y1 + e], lanes[Z1 + e] = 1.0, 0.0, 0.0
        lanes[X2 + e], lanes[Y2 + e], lanes[Z2 + e] = 0.0, 1.0, 0.0
        lanes[X3 + e], lanes[Y3 + e], lanes[Z3 + e] = 0.0, 0.0, 1.0
    for _ in range(SWEEPS):
        _rotate_12(n, lanes)
        _rotate_13(n, lanes)
        _rotate_23(n, lanes)


@njit(cache=True, error_model="numpy", forceinline=True)
def _in_order(s, x, y, z, t, u, v, w):
    """Two stresses, each with its axis, the smaller one first."""
    turn = s > t
    return (
        t if turn else s, u if turn else x, v if turn else y, w if turn else z,
        s if turn else t, x if turn else u, y if turn else v, z if turn else w,
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def return_all(n, lanes):
    """Plastic strains of n principal stresses, how they flow, and shear, volume and work of the flow."""
    for e in range(U(n)):
        s1, x1, y1, z1, s2, x2, y2, z2 = _in_order(
            lanes[T11 + e], lanes[X1 + e], lanes[Y1 + e], lanes[Z1 + e],
            lanes[T22 + e], lanes[X2 + e], lanes[Y2 + e], lanes[Z2 + e],
        )  # fmt: skip
        s2, x2, y2, z2, s3, x3, y3, z3 = _in_order(
            s2, x2, y2, z2, lanes[T33 + e], lanes[X3 + e], lanes[Y3 + e], lanes[Z3 + e]
        )
        s1, x1, y1, z1, s2, x2, y2, z2 = _in_order(s1, x1, y1, z1, s2, x2, y2, z2)
        lame, two_mu = lanes[P_LAM + e], lanes[P_MU2 + e]
        r1, r2, r3, how = principal_return(
            s1, s2, s3, lanes[P_PHI + e], lanes[P_PSI + e], lanes[P_STRENGTH + e], lanes[P_TENSILE + e], lame + two_mu,
            lame,
        )  # fmt: skip
        d1, d2, d3 = s1 - r1, s2 - r2, s3 - r3
        common, per = lame / (3.0 * lame + two_mu) * (d1 + d2 + d3), 1.0 / two_mu
        flows = how > 0.0
        e1, e2, e3 = (d1 - common) * per, (d2 - common) * per, (d3 - common) * per
        e1, e2, e3 = e1 if flows else 0.0, e2 if flows else 0.0, e3 if flows else 0.0
        lanes[P11 + e] = e1 * (x1 * x1) + e2 * (x2 * x2) + e3 * (x3 * x3)
        lanes[P22 + e] = e1 * (y1 * y1) + e2 * (y2 * y2) + e3 * (y3 * y3)
        lanes[P12 + e] = e1 * (x1 * y1) + e2 * (x2 * y2) + e3 * (x3 * y3)
        lanes[P33 + e] = e1 * (z1 * z1) + e2 * (z2 * z2) + e3 * (z3 * z3)
        lanes[P13 + e] = e1 * (x1 * z1) + e2 * (x2 * z2) + e3 * (x3 * z3)
        lanes[P23 + e] = e1 * (y1 * z1) + e2 * (y2 * z2) + e3 * (y3 * z3)
        lanes[HOW + e] = how
        volume = e1 + e2 + e3
        third = volume / 3.0
        g1, g2, g3 = e1 - third, e2 - third, e3 - third
        lanes[P_SHEAR + e] = math.sqrt(0.5 * (g1 * g1 + g2 * g2 + g3 * g3))
        lanes[P_VOLUME + e] = volume
        lanes[P_WORK + e] = (r1 * e1 + r2 * e2 + r3 * e3) / lanes[P_PER + e]
        lanes[P_SHORT + e] = -((e1 if e1 < 0.0 else 0.0) + (e2 if e2 < 0.0 else 0.0) + (e3 if e3 < 0.0 else 0.0))


@njit(cache=True, error_model="numpy")
def relieve(i, j, c, base, memory, s0):
    """Into row i of s0 the stress [Pa] of a tetrahedron without strain: base less D e_p; j: its row of memory."""
    e11, e22, e33 = memory[j, E11], memory[j, E22], memory[j, E33]
    two_mu = c[i, TWO_MU]
    pressure = c[i, LAMBDA] * (e11 + e22 + e33)
    s0[i, 0] = base[i, 0] - (pressure + two_mu * e11)
    s0[i, 1] = base[i, 1] - (pressure + two_mu * e22)
    s0[i, 2] = base[i, 2] - two_mu * memory[j, E12]
    s0[i, 3] = base[i, 3] - (pressure + two_mu * e33)
    s0[i, 4] = base[i, 4] - two_mu * memory[j, E13]
    s0[i, 5] = base[i, 5] - two_mu * memory[j, E23]


@njit(cache=True, nogil=True, error_model="numpy")
def _remember(m, first, first_row, who, rows, which, lanes, c, base, law, table, soft, step, memory, s0):
    """Add what has flowed to memory and s0."""
    for k in range(m):
        e, i = U(k), who[first + which[k]]
        j, bits = rows[i] - first_row, np.int64(lanes[HOW + U(k)])
        if bits == 0:
            continue
        memory[j, E11] += lanes[P11 + e]
        memory[j, E22] += lanes[P22 + e]
        memory[j, E12] += lanes[P12 + e]
        memory[j, E33] += lanes[P33 + e]
        memory[j, E13] += lanes[P13 + e]
        memory[j, E23] += lanes[P23 + e]
        memory[j, SHEAR] += lanes[P_SHEAR + e]
        memory[j, VOLUME] += lanes[P_VOLUME + e]
        if bits & SHEAR_NOW:
            memory[j, IN_SHEAR] = step + 1.0
        if bits & TENSION_NOW:
            memory[j, IN_TENSION] = step + 1.0
        memory[j, WORK] += lanes[P_WORK + e]
        if law[i] >= soft.first:
            strength.grown(law[i], j, 0, bits, lanes[P_SHEAR + e], lanes[P_VOLUME + e], lanes[P_SHORT + e], soft, table)
        relieve(i, j, c, base, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def _flow(t, threads, count, who, rows, first_row, x, c, base, law, soft, small, step, memory, s0, table):
    lanes = np.zeros(LANES * _LANE)
    which = np.zeros(BLOCK, np.int64)
    flat_x, flat_c, flat_s0 = x.reshape(x.size), c.reshape(c.size), s0.reshape(s0.size)
    flat_table = table.reshape(table.size)
    blocks = -(-count // BLOCK)
    for b in range(blocks * t // threads, blocks * (t + 1) // threads):
        first = b * BLOCK
        n = min(BLOCK, count - first)
        _gather(n, first, who, rows, flat_x, flat_c, flat_s0, law, flat_table, lanes)
        _try(n, small, lanes)
        m = _choose(n, lanes, which)
        if m > 0:
            find_axes(m, lanes)
            return_all(m, lanes)
            _remember(m, first, first_row, who, rows, which, lanes, c, base, law, table, soft, step, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def flows(threads, *args):
    """Let tetrahedra that are outside their yield surface at the present positions flow.

    count: of them; who (count + 3,): which can yield; rows (n + 3,) i4: storage rows of all, of which the first owned
    one is `first_row`; x (n, 16); c (n + 3, 16), see `tets.TET`; base (n, 8) [Pa]: initial stress; law (n + 3,): row of
    `table`; soft: see strength.py; small: small strains; step: number of this step. They become those after the flow:
    memory (n_own, 11), see `MEMORY`; s0 (n + 3, 8) [Pa]: stress without strain; table (rows, 4) of yield surfaces, see
    `plasticity.YIELD`.
    """
    for t in range(threads):
        _flow(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def flows_threaded(threads, count, who, rows, first_row, x, c, base, law, soft, small, step, memory, s0, table):
    """The same on several threads."""
    for t in prange(threads):
        _flow(t, threads, count, who, rows, first_row, x, c, base, law, soft, small, step, memory, s0, table)


@njit(cache=True, nogil=True, error_model="numpy")
def relieve_all(rows, first, c, base, memory, s0):
    """`relieve` for tetrahedra in these storage rows (n,); arguments as for `flows`."""
    for i in range(len(rows)):
        relieve(i, rows[i] - first, c, base, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def renew_all(rows, first, law, soft, table):
    """Yield surfaces of those that have one of their own, see `strength.renew`; law (n,)."""
    for i in range(len(rows)):
        if law[i] >= soft.first:
            strength.renew(law[i], rows[i] - first, 0, soft, table)


@njit(cache=True, nogil=True, error_model="numpy")
def locked_in(rows, first, c, base, memory, out):
    """Add to out (n_own,) what the elastic energy [J] differs by from that of an element with the initial stress s0,
    see `plasticity.locked_in`."""
    for i in range(len(rows)):
        j, q = rows[i] - first, c[i]
        e11, e22, e12, e33 = memory[j, E11], memory[j, E22], memory[j, E12], memory[j, E33]
        e13, e23 = memory[j, E13], memory[j, E23]
        trace = e11 + e22 + e33
        squares = e11 * e11 + e22 * e22 + e33 * e33 + 2.0 * (e12 * e12 + e13 * e13 + e23 * e23)
        own = base[i, 0] * e11 + base[i, 1] * e22 + base[i, 3] * e33
        own += 2.0 * (base[i, 2] * e12 + base[i, 4] * e13 + base[i, 5] * e23)
        stored = 0.5 * (q[LAMBDA] * trace * trace + q[TWO_MU] * squares) - own
        out[j] += stored / tets.per_volume(q[0], q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8])

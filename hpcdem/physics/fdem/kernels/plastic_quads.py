"""Plastic flow of quads by mixed discretisation (Marti & Cundall 1982): the return of stresses of plasticity.py in each
of the four triangles of a quad, with the volume of an overlay shared by its two triangles.

The strain of a triangle is that of elements.py: its e11 + e22 is the mean by area over its overlay. After the flow the
two triangles of an overlay have, in general, not the same pressure in the plane, P = (s11 + s22) / 2, any more. Their
volumes then change, against each other, until they have: by d11 = d22 = d with d = (P - mean P) / (2 (lambda + mu)),
whose mean by area is zero, so that this does no work. Without it each triangle alone would have to follow the dilation
of its flow, and the forces would not be those of the elastic energy; FLAC takes the mean of the stresses for the same
reason. d is kept with the plastic strain that stresses depend on, and is not counted as plastic strain. As both
triangles have one pressure the loop over quads is the elastic one.

Sixteen quads are worked on together as 64 triangles: triangle p of quad e is entry 16 p + e of the lanes.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import CAPACITY, U, four_columns, lane, two_columns
from hpcdem.physics.fdem.kernels.elements import BLOCK, PARTS, Q_AREA, Q_LAMBDA, Q_TWO_MU, _part
from hpcdem.physics.fdem.kernels.plasticity import (
    CA,
    CB,
    CC,
    CD,
    E11,
    E12,
    E22,
    E33,
    IN_SHEAR,
    IN_TENSION,
    L_PHI,
    L_STRENGTH,
    L_TENSILE,
    LAM,
    LANES,
    MEMORY,
    MU2,
    OUTSIDE,
    P11,
    P12,
    P22,
    P33,
    P_LAM,
    P_SHEAR,
    P_VOLUME,
    P_WORK,
    S11,
    S12,
    S22,
    S33,
    SHEAR,
    SHEAR_NOW,
    TENSION_NOW,
    VOLUME,
    WORK,
    _measure,
    _return,
)

TILE = BLOCK // 4
"""Quads worked on together."""
_FOUR, _EIGHT, _TWELVE, _SIXTEEN, _QUAD = U(4), U(8), U(12), U(16), U(32)
_NEXT = lane(1)
# Until something flows the lanes of what has flowed are free: eight for the corners, four for the areas.
CORNERS, AREAS = P11, P_LAM


@njit(cache=True, error_model="numpy")
def _pressure(e11, e22, e33, lame, two_mu):
    """(s11 + s22) / 2 [Pa] of a strain."""
    return lame * (e11 + e22 + e33) + 0.5 * two_mu * (e11 + e22)


@njit(cache=True, nogil=True, error_model="numpy")
def _share(j, overlay, q, memory):
    """The two triangles of an overlay of a quad, row j of memory, get one pressure."""
    p1 = 2 * overlay
    o1, o2 = p1 * MEMORY, (p1 + 1) * MEMORY
    lame, two_mu, one, two = q[Q_LAMBDA], q[Q_TWO_MU], q[Q_AREA + p1], q[Q_AREA + p1 + 1]
    first = _pressure(memory[j, o1 + E11], memory[j, o1 + E22], memory[j, o1 + E33], lame, two_mu)
    second = _pressure(memory[j, o2 + E11], memory[j, o2 + E22], memory[j, o2 + E33], lame, two_mu)
    mean = (one * first + two * second) / (one + two)
    per = 1.0 / (2.0 * lame + two_mu)
    first, second = (mean - first) * per, (mean - second) * per
    memory[j, o1 + E11] += first
    memory[j, o1 + E22] += first
    memory[j, o2 + E11] += second
    memory[j, o2 + E22] += second


@njit(cache=True, nogil=True, error_model="numpy")
def _relieve(i, j, p, q, base, memory, s0):
    """Into row i of s0 the stress [Pa] of triangle p without strain: its initial stress less D e_p; j: its row of
    memory."""
    o, to = p * MEMORY, 4 * p
    e11, e22, e12, e33 = memory[j, o + E11], memory[j, o + E22], memory[j, o + E12], memory[j, o + E33]
    two_mu = q[i, Q_TWO_MU]
    pressure = q[i, Q_LAMBDA] * (e11 + e22 + e33)
    s0[i, to] = base[i, 0] - (pressure + two_mu * e11)
    s0[i, to + 1] = base[i, 1] - (pressure + two_mu * e22)
    s0[i, to + 2] = base[i, 2] - two_mu * e12
    s0[i, to + 3] = base[i, 3] - (pressure + two_mu * e33)


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(n, item, row, x, q, s0, law, table, lanes):
    """Corners, moduli, stress without strain and yield surfaces of n quads into lanes; item, row (n,): places in the
    tables q, s0 and law, and in x."""
    for e in range(U(0), U(n), _FOUR):
        r0, r1, r2, r3 = U(row[e]), U(row[e + U(1)]), U(row[e + U(2)]), U(row[e + U(3)])
        at = r0 * _TWELVE, r1 * _TWELVE, r2 * _TWELVE, r3 * _TWELVE
        four_columns(lanes, CORNERS + e, x, at)
        at = at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR
        four_columns(lanes, CORNERS + U(4 * CAPACITY) + e, x, at)
        i0, i1, i2, i3 = U(item[e]), U(item[e + U(1)]), U(item[e + U(2)]), U(item[e + U(3)])
        at = i0 * _QUAD + _SIXTEEN, i1 * _QUAD + _SIXTEEN, i2 * _QUAD + _SIXTEEN, i3 * _QUAD + _SIXTEEN
        four_columns(lanes, AREAS + e, q, at)
        two_columns(lanes, LAM + e, q, (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR))
        for p in range(U(4)):
            to, k = e + p * U(TILE), _FOUR * p
            at = i0 * _QUAD + k, i1 * _QUAD + k, i2 * _QUAD + k, i3 * _QUAD + k
            four_columns(lanes, CA + to, q, at)
            at = i0 * _SIXTEEN + k, i1 * _SIXTEEN + k, i2 * _SIXTEEN + k, i3 * _SIXTEEN + k
            four_columns(lanes, S11 + to, s0, at)
            at = (
                U(law[_FOUR * i0 + p]) * _FOUR, U(law[_FOUR * i1 + p]) * _FOUR,
                U(law[_FOUR * i2 + p]) * _FOUR, U(law[_FOUR * i3 + p]) * _FOUR,
            )  # fmt: skip
            four_columns(lanes, L_PHI + to, table, at)


@njit(cache=True, error_model="numpy")
def _outside(s11, s22, s12, s33, n, k, t):
    """By how much [Pa] a stress is outside; the larger of both surfaces."""
    mean, half = 0.5 * (s11 + s22), 0.5 * (s11 - s22)
    radius = math.sqrt(half * half + s12 * s12)
    high, low = mean + radius, mean - radius
    high, low = (s33 if s33 > high else high), (s33 if s33 < low else low)
    shear, tension = n * high - low - k, high - t
    return shear if shear > tension else tension


def _try_overlay(overlay):
    """The loop that puts trial stresses of an overlay (0, 1) in the place of those without strain, and how much they
    are outside. One function each: distances between lanes must be constants."""
    p, q = PARTS[2 * overlay : 2 * overlay + 2].tolist()
    xi, xj, xk, xl = (CORNERS + lane(2 * corner) for corner in (*p, q[2]))
    one, two = (AREAS + lane(2 * overlay + part) for part in (0, 1))
    first, second = U(2 * overlay * TILE), U((2 * overlay + 1) * TILE)

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(n, small, lanes):
        for e in range(U(n)):
            x1, y1, x2, y2 = lanes[xi + e], lanes[xi + _NEXT + e], lanes[xj + e], lanes[xj + _NEXT + e]
            x3, y3, x4, y4 = lanes[xk + e], lanes[xk + _NEXT + e], lanes[xl + e], lanes[xl + _NEXT + e]
            f, g = first + e, second + e
            _, _, _, _, _, _, a11, a22, a12 = _part(
                x1, y1, x2, y2, x3, y3, lanes[CA + f], lanes[CB + f], lanes[CC + f], lanes[CD + f], small
            )
            _, _, _, _, _, _, b11, b22, b12 = _part(
                x1, y1, x3, y3, x4, y4, lanes[CA + g], lanes[CB + g], lanes[CC + g], lanes[CD + g], small
            )
            lame, two_mu = lanes[LAM + e], lanes[MU2 + e]
            mean = (lanes[one + e] * (a11 + a22) + lanes[two + e] * (b11 + b22)) / (lanes[one + e] + lanes[two + e])
            pressure = lame * mean
            shift = 0.5 * (mean - (a11 + a22))
            s11, s22 = (
                lanes[S11 + f] + (pressure + two_mu * (a11 + shift)),
                lanes[S22 + f] + (pressure + two_mu * (a22 + shift)),
            )
            s12, s33 = lanes[S12 + f] + two_mu * a12, lanes[S33 + f] + pressure
            shift = 0.5 * (mean - (b11 + b22))
            t11, t22 = (
                lanes[S11 + g] + (pressure + two_mu * (b11 + shift)),
                lanes[S22 + g] + (pressure + two_mu * (b22 + shift)),
            )
            t12, t33 = lanes[S12 + g] + two_mu * b12, lanes[S33 + g] + pressure
            lanes[LAM + f], lanes[MU2 + f], lanes[LAM + g], lanes[MU2 + g] = lame, two_mu, lame, two_mu
            lanes[S11 + f], lanes[S22 + f], lanes[S12 + f], lanes[S33 + f] = s11, s22, s12, s33
            lanes[S11 + g], lanes[S22 + g], lanes[S12 + g], lanes[S33 + g] = t11, t22, t12, t33
            lanes[OUTSIDE + f] = _outside(
                s11, s22, s12, s33, lanes[L_PHI + f], lanes[L_STRENGTH + f], lanes[L_TENSILE + f]
            )
            lanes[OUTSIDE + g] = _outside(
                t11, t22, t12, t33, lanes[L_PHI + g], lanes[L_STRENGTH + g], lanes[L_TENSILE + g]
            )

    return loop


_try_overlay_0, _try_overlay_1 = _try_overlay(0), _try_overlay(1)


@njit(cache=True, nogil=True, error_model="numpy")
def _remember(m, first, first_row, rows, who, bits, lanes, q, base, step, flowed, memory, s0):
    """Add what has flowed to memory and s0; flowed (TILE, 2): scratch, zero between calls."""
    for k in range(m):
        e, at, p = U(k), who[k] % TILE, who[k] // TILE
        j, o = rows[first + at] - first_row, p * MEMORY
        memory[j, o + E11] += lanes[P11 + e]
        memory[j, o + E22] += lanes[P22 + e]
        memory[j, o + E12] += lanes[P12 + e]
        memory[j, o + E33] += lanes[P33 + e]
        memory[j, o + SHEAR] += lanes[P_SHEAR + e]
        memory[j, o + VOLUME] += lanes[P_VOLUME + e]
        if bits[k] & SHEAR_NOW:
            memory[j, o + IN_SHEAR] = step + 1.0
        if bits[k] & TENSION_NOW:
            memory[j, o + IN_TENSION] = step + 1.0
        memory[j, o + WORK] += lanes[P_WORK + e]
        flowed[at, p // 2] = 1
    for at in range(TILE):
        for overlay in range(2):
            if flowed[at, overlay] != 0:
                flowed[at, overlay] = 0
                i = first + at
                j = rows[i] - first_row
                _share(j, overlay, q[i], memory)
                _relieve(i, j, 2 * overlay, q, base, memory, s0)
                _relieve(i, j, 2 * overlay + 1, q, base, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def _flow(t, threads, count, rows, first_row, x, q, base, law, table, small, step, memory, s0):
    lanes = np.zeros(LANES * CAPACITY)
    who, bits, flowed = np.zeros(BLOCK, np.int64), np.zeros(BLOCK, np.int64), np.zeros((TILE, 2), np.int64)
    item, row = np.empty(TILE, np.int64), np.empty(TILE, np.int64)
    flat_x, flat_q, flat_s0 = x.reshape(x.size), q.reshape(q.size), s0.reshape(s0.size)
    flat_law, flat_table = law.reshape(law.size), table.reshape(table.size)
    begin, end = count * t // threads, count * (t + 1) // threads
    for first in range(begin, end, TILE):
        n = min(TILE, end - first)
        for e in range(TILE):
            item[e] = first + min(e, n - 1)
            row[e] = rows[item[e]]
        _gather(TILE, item, row, flat_x, flat_q, flat_s0, flat_law, flat_table, lanes)
        _try_overlay_0(TILE, small, lanes)
        _try_overlay_1(TILE, small, lanes)
        for p in range(4):
            for e in range(n, TILE):
                lanes[OUTSIDE + U(p * TILE + e)] = -1.0
        m = _return(BLOCK, lanes, 2.0, who, bits)
        if m > 0:
            _measure(m, lanes)
            _remember(m, first, first_row, rows, who, bits, lanes, q, base, step, flowed, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def flows(threads, *args):
    """Let the triangles of quads that are outside their yield surface at the present positions flow.

    Arguments as for `plasticity.flows`: count: quads; rows (count,) i4: their rows of x (n, 12); q (count, 32), see
    `elements.QUAD`; base (count, 4) [Pa]; law (count, 4): of each of their triangles; memory (n_own, 36): the nine
    columns of each of them; s0 (count, 16) [Pa].
    """
    for t in range(threads):
        _flow(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def flows_threaded(threads, count, rows, first_row, x, q, base, law, table, small, step, memory, s0):
    """The same on several threads."""
    for t in prange(threads):
        _flow(t, threads, count, rows, first_row, x, q, base, law, table, small, step, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def relieve_all(rows, first, q, base, memory, s0):
    """Stresses [Pa] of quads without strain: s0 (count, 16); arguments as for `flows`."""
    for i in range(len(rows)):
        for p in range(4):
            _relieve(i, rows[i] - first, p, q, base, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def locked_in(rows, first, q, base, memory, out):
    """`plasticity.locked_in` for quads: the triangles count half."""
    for i in range(len(rows)):
        j = rows[i] - first
        for p in range(4):
            o = p * MEMORY
            e11, e22, e12, e33 = memory[j, o + E11], memory[j, o + E22], memory[j, o + E12], memory[j, o + E33]
            trace = e11 + e22 + e33
            squares = e11 * e11 + e22 * e22 + 2.0 * e12 * e12 + e33 * e33
            own = base[i, 0] * e11 + base[i, 1] * e22 + 2.0 * base[i, 2] * e12 + base[i, 3] * e33
            density = 0.5 * (q[i, Q_LAMBDA] * trace * trace + q[i, Q_TWO_MU] * squares) - own
            out[j] += 0.5 * q[i, Q_AREA + p] * density

"""Plastic flow of quads by mixed discretisation (Marti & Cundall 1982): the return of stresses of plasticity.py in each
of the four triangles of a quad, with the volume of an overlay shared by its two triangles.

The strain of a triangle is that of elements.py: its e11 + e22 is the mean by area over its overlay. After the flow the
two triangles of an overlay have, in general, not the same pressure in the plane, P = (s11 + s22) / 2, any more. Their
volumes then change, against each other, until they have: by d11 = d22 = d with d = (P - mean P) / (2 (lambda + mu)),
whose mean by area is zero, so that this does no work. Without it each triangle alone would have to follow the dilation
of its flow, and the forces would not be those of the elastic energy; FLAC takes the mean of the stresses for the same
reason. d is kept with the plastic strain that stresses depend on, and is not counted as plastic strain. As both
triangles have one pressure the loop over quads is the elastic one.

The loop over quads that can yield is that of elements.py, which besides says of each overlay whether its stress is
outside. Quads that are go through the return of stresses, `TILE` at a time as four times as many triangles: triangle p
of quad e is entry p TILE + e of the lanes, what belongs to the quad is entry e. Then the forces of the block are
computed again. After a block of which most flows the next one is not asked first: all of it goes through the return,
which leaves alone what is inside, and its forces are computed once. Which way a block goes changes no bit.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import CAPACITY, U, four_columns, lane, put_four_columns, two_columns
from hpcdem.physics.fdem.kernels import elements, laws, plasticity, softening, strength
from hpcdem.physics.fdem.kernels.elements import (
    PARTS,
    Q_AREA,
    Q_LAMBDA,
    Q_OUTSIDE,
    Q_TWO_MU,
    Q_YIELD,
    QUAD_BLOCK,
    YIELDING_LANES,
    _part,
    finish_quads,
    gather_quads,
    gather_stresses,
    name_quads,
    overlay_loop_0,
    overlay_loop_1,
)
from hpcdem.physics.fdem.kernels.plasticity import (
    CA,
    CB,
    CC,
    CD,
    E11,
    E12,
    E22,
    E33,
    HOW,
    LAM,
    MEMORY,
    MU2,
    OUTSIDE,
    P11,
    P12,
    P22,
    P33,
    P_LAM,
    P_MU2,
    P_PER_AREA,
    P_PHI,
    P_SHEAR,
    P_STRENGTH,
    P_TENSILE,
    P_VOLUME,
    P_WORK,
    S11,
    S12,
    S22,
    S33,
    T11,
    T12,
    T22,
    T33,
)

TILE = 16
"""Quads whose stresses return together."""
_FOUR, _EIGHT, _TWELVE, _SIXTEEN, _QUAD = U(4), U(8), U(12), U(16), U(32)
_NEXT, _SECOND, _THIRD, _FOURTH = (lane(k) for k in range(1, 5))
CORNERS, AREAS, BASE, REMEMBERED = (lane(plasticity.LANES + k) for k in (0, 8, 12, 16))
"""Of the return besides: corners, areas, initial stress, what is remembered."""
LANES = plasticity.LANES + 16 + MEMORY
M11, M22, M12, M33, M_SHEAR, M_VOLUME, M_IN_SHEAR, M_IN_TENSION, M_WORK = (REMEMBERED + lane(k) for k in range(MEMORY))
_LAST = U(MEMORY - 4)
"""The last four columns of what is remembered begin here."""


@njit(cache=True, error_model="numpy")
def _pressure(e11, e22, e33, lame, two_mu):
    """(s11 + s22) / 2 [Pa] of a strain."""
    return lame * (e11 + e22 + e33) + 0.5 * two_mu * (e11 + e22)


@njit(cache=True, nogil=True, error_model="numpy")
def _relieve(i, j, p, q, base, memory, s0):
    """Into row i of s0 the stress [Pa] of triangle p without strain: its initial stress less D e_p; j: its row of
    memory."""
    o, to = p * MEMORY, 4 * p
    e11, e22, e12, e33 = memory[j, o + E11], memory[j, o + E22], memory[j, o + E12], memory[j, o + E33]
    two_mu = q[i, Q_TWO_MU]
    pressure = q[i, Q_LAMBDA] * (e11 + e22 + e33)
    s0[i, to] = base[i, to] - (pressure + two_mu * e11)
    s0[i, to + 1] = base[i, to + 1] - (pressure + two_mu * e22)
    s0[i, to + 2] = base[i, to + 2] - two_mu * e12
    s0[i, to + 3] = base[i, to + 3] - (pressure + two_mu * e33)


@njit(cache=True, nogil=True, error_model="numpy")
def _gather_yield(n, item, law, table, lanes):
    """Yield surfaces of n quads into the lanes of elements.py."""
    for e in range(U(0), U(n), _FOUR):
        i0, i1, i2, i3 = U(item[e]), U(item[e + U(1)]), U(item[e + U(2)]), U(item[e + U(3)])
        for p in range(U(4)):
            at = (
                U(law[_FOUR * i0 + p]) * _FOUR, U(law[_FOUR * i1 + p]) * _FOUR,
                U(law[_FOUR * i2 + p]) * _FOUR, U(law[_FOUR * i3 + p]) * _FOUR,
            )  # fmt: skip
            four_columns(lanes, Q_YIELD + p * _FOURTH + e, table, at)


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(item, row, first_row, x, q, base, s0, law, table, memory, lanes):
    """Corners, moduli, stress without strain, yield surfaces and what is remembered of `TILE` quads into lanes; item,
    row: places in the tables q, base, s0 and law, and in x."""
    for e in range(U(0), U(TILE), _FOUR):
        r0, r1, r2, r3 = U(row[e]), U(row[e + U(1)]), U(row[e + U(2)]), U(row[e + U(3)])
        at = r0 * _TWELVE, r1 * _TWELVE, r2 * _TWELVE, r3 * _TWELVE
        four_columns(lanes, CORNERS + e, x, at)
        at = at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR
        four_columns(lanes, CORNERS + _FOURTH + e, x, at)
        i0, i1, i2, i3 = U(item[e]), U(item[e + U(1)]), U(item[e + U(2)]), U(item[e + U(3)])
        at = i0 * _QUAD + _SIXTEEN, i1 * _QUAD + _SIXTEEN, i2 * _QUAD + _SIXTEEN, i3 * _QUAD + _SIXTEEN
        four_columns(lanes, AREAS + e, q, at)
        two_columns(lanes, LAM + e, q, (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR))
        width, own = U(4 * MEMORY), U(first_row)
        j0, j1, j2, j3 = (r0 - own) * width, (r1 - own) * width, (r2 - own) * width, (r3 - own) * width
        for p in range(U(4)):
            to, k, o = e + p * U(TILE), _FOUR * p, p * U(MEMORY)
            at = i0 * _QUAD + k, i1 * _QUAD + k, i2 * _QUAD + k, i3 * _QUAD + k
            four_columns(lanes, CA + to, q, at)
            at = i0 * _SIXTEEN + k, i1 * _SIXTEEN + k, i2 * _SIXTEEN + k, i3 * _SIXTEEN + k
            four_columns(lanes, S11 + to, s0, at)
            four_columns(lanes, BASE + to, base, at)
            at = (
                U(law[_FOUR * i0 + p]) * _FOUR, U(law[_FOUR * i1 + p]) * _FOUR,
                U(law[_FOUR * i2 + p]) * _FOUR, U(law[_FOUR * i3 + p]) * _FOUR,
            )  # fmt: skip
            four_columns(lanes, P_PHI + to, table, at)
            at = j0 + o, j1 + o, j2 + o, j3 + o
            four_columns(lanes, M11 + to, memory, at)
            at = at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR
            four_columns(lanes, M_SHEAR + to, memory, at)
            at = j0 + o + _LAST, j1 + o + _LAST, j2 + o + _LAST, j3 + o + _LAST
            four_columns(lanes, M_VOLUME + to, memory, at)


@njit(cache=True, nogil=True, error_model="numpy")
def _put(n, item, row, first_row, s0, memory, lanes):
    """Stress without strain and what is remembered of n quads go back; the last one may do so several times."""
    for e in range(U(0), U(n), _FOUR):
        i0, i1, i2, i3 = U(item[e]), U(item[e + U(1)]), U(item[e + U(2)]), U(item[e + U(3)])
        width, own = U(4 * MEMORY), U(first_row)
        j0, j1 = (U(row[e]) - own) * width, (U(row[e + U(1)]) - own) * width
        j2, j3 = (U(row[e + U(2)]) - own) * width, (U(row[e + U(3)]) - own) * width
        for p in range(U(4)):
            to, k, o = e + p * U(TILE), _FOUR * p, p * U(MEMORY)
            at = i0 * _SIXTEEN + k, i1 * _SIXTEEN + k, i2 * _SIXTEEN + k, i3 * _SIXTEEN + k
            put_four_columns(s0, at, lanes, S11 + to)
            at = j0 + o, j1 + o, j2 + o, j3 + o
            put_four_columns(memory, at, lanes, M11 + to)
            at = at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR
            put_four_columns(memory, at, lanes, M_SHEAR + to)
            at = j0 + o + _LAST, j1 + o + _LAST, j2 + o + _LAST, j3 + o + _LAST
            put_four_columns(memory, at, lanes, M_VOLUME + to)


def _try_overlay(overlay):
    """The loop that finds trial stresses of an overlay (0, 1), and how much they are outside. One function each:
    distances between lanes must be constants."""
    p, q = PARTS[2 * overlay : 2 * overlay + 2].tolist()
    xi, xj, xk, xl = (CORNERS + lane(2 * corner) for corner in (*p, q[2]))
    one, two = (AREAS + lane(2 * overlay + part) for part in (0, 1))
    first, second = U(2 * overlay * TILE), U((2 * overlay + 1) * TILE)

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(small, lanes):
        for e in range(U(TILE)):
            x1, y1, x2, y2 = lanes[xi + e], lanes[xi + _NEXT + e], lanes[xj + e], lanes[xj + _NEXT + e]
            x3, y3, x4, y4 = lanes[xk + e], lanes[xk + _NEXT + e], lanes[xl + e], lanes[xl + _NEXT + e]
            f, g = first + e, second + e
            a, b, c, d = lanes[CA + f], lanes[CB + f], lanes[CC + f], lanes[CD + f]
            _, _, _, _, _, _, a11, a22, a12 = _part(x1, y1, x2, y2, x3, y3, a, b, c, d, small)
            lanes[P_PER_AREA + f] = 4.0 * (a * d - b * c)
            a, b, c, d = lanes[CA + g], lanes[CB + g], lanes[CC + g], lanes[CD + g]
            _, _, _, _, _, _, b11, b22, b12 = _part(x1, y1, x3, y3, x4, y4, a, b, c, d, small)
            lanes[P_PER_AREA + g] = 4.0 * (a * d - b * c)
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
            lanes[T11 + f], lanes[T22 + f], lanes[T12 + f], lanes[T33 + f] = s11, s22, s12, s33
            lanes[T11 + g], lanes[T22 + g], lanes[T12 + g], lanes[T33 + g] = t11, t22, t12, t33
            lanes[P_LAM + f], lanes[P_MU2 + f], lanes[P_LAM + g], lanes[P_MU2 + g] = lame, two_mu, lame, two_mu
            far = laws.outside(s11, s22, s12, s33, lanes[P_PHI + f], lanes[P_STRENGTH + f], lanes[P_TENSILE + f])
            farther = laws.outside(t11, t22, t12, t33, lanes[P_PHI + g], lanes[P_STRENGTH + g], lanes[P_TENSILE + g])
            lanes[OUTSIDE + f], lanes[OUTSIDE + g] = far, farther

    return loop


_try_overlay_0, _try_overlay_1 = _try_overlay(0), _try_overlay(1)


@njit(cache=True, nogil=True, error_model="numpy")
def _add(step, lanes):
    """What flows is added to what is remembered."""
    now = step + 1.0
    for e in range(U(4 * TILE)):
        lanes[M11 + e] += lanes[P11 + e]
        lanes[M22 + e] += lanes[P22 + e]
        lanes[M12 + e] += lanes[P12 + e]
        lanes[M33 + e] += lanes[P33 + e]
        lanes[M_SHEAR + e] += lanes[P_SHEAR + e]
        lanes[M_VOLUME + e] += lanes[P_VOLUME + e]
        lanes[M_WORK + e] += lanes[P_WORK + e]
        how, shear, tension = lanes[HOW + e], lanes[M_IN_SHEAR + e], lanes[M_IN_TENSION + e]
        lanes[M_IN_SHEAR + e] = now if (how == 1.0) | (how == 3.0) else shear
        lanes[M_IN_TENSION + e] = now if how >= 2.0 else tension


def _share_overlay(overlay):
    """The loop that gives the two triangles of an overlay one pressure, if any of them flows."""
    one, two = (AREAS + lane(2 * overlay + part) for part in (0, 1))
    first, second = U(2 * overlay * TILE), U((2 * overlay + 1) * TILE)

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(lanes):
        for e in range(U(TILE)):
            f, g = first + e, second + e
            lame, two_mu, area, other = lanes[LAM + e], lanes[MU2 + e], lanes[one + e], lanes[two + e]
            a11, a22, b11, b22 = lanes[M11 + f], lanes[M22 + f], lanes[M11 + g], lanes[M22 + g]
            p = _pressure(a11, a22, lanes[M33 + f], lame, two_mu)
            q = _pressure(b11, b22, lanes[M33 + g], lame, two_mu)
            mean = (area * p + other * q) / (area + other)
            per = 1.0 / (2.0 * lame + two_mu)
            flows = lanes[HOW + f] + lanes[HOW + g] > 0.0
            p, q = ((mean - p) * per if flows else 0.0), ((mean - q) * per if flows else 0.0)
            lanes[M11 + f], lanes[M22 + f], lanes[M11 + g], lanes[M22 + g] = a11 + p, a22 + p, b11 + q, b22 + q

    return loop


_share_overlay_0, _share_overlay_1 = _share_overlay(0), _share_overlay(1)


def _relieve_part(p):
    """The loop that finds the stress of triangle p without strain: its initial stress less D e_p."""
    first = U(p * TILE)

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(lanes):
        for e in range(U(TILE)):
            f, lame, two_mu = first + e, lanes[LAM + e], lanes[MU2 + e]
            e11, e22, e12, e33 = lanes[M11 + f], lanes[M22 + f], lanes[M12 + f], lanes[M33 + f]
            pressure = lame * (e11 + e22 + e33)
            lanes[S11 + f] = lanes[BASE + f] - (pressure + two_mu * e11)
            lanes[S22 + f] = lanes[BASE + _NEXT + f] - (pressure + two_mu * e22)
            lanes[S12 + f] = lanes[BASE + _SECOND + f] - two_mu * e12
            lanes[S33 + f] = lanes[BASE + _THIRD + f] - (pressure + two_mu * e33)

    return loop


_relieve_0, _relieve_1, _relieve_2, _relieve_3 = (_relieve_part(p) for p in range(4))


@njit(cache=True, nogil=True, error_model="numpy")
def _weaken(n, item, row, first_row, law, soft, table, lanes):
    """Strengths that follow what has flowed."""
    for e in range(n):
        for p in range(4):
            f, own = U(p * TILE + e), law[item[e], p]
            how = np.int64(lanes[HOW + f])
            if how > 0 and own >= soft.first:
                strength.flowed(
                    own, row[e] - first_row, p, how, lanes[P11 + f], lanes[P22 + f], lanes[P12 + f], lanes[P33 + f],
                    lanes[P_SHEAR + f], lanes[P_VOLUME + f], soft, table,
                )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _any_outside(lanes):
    """Negative if no triangle of the tile is outside."""
    bits = lanes.view(np.int64)
    found = np.int64(-1)
    for e in range(U(4 * TILE)):
        found &= bits[OUTSIDE + e]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _how_many(n, lanes):
    """Of the first n quads of the tile flow."""
    found = 0
    for e in range(U(n)):
        how = lanes[HOW + e] + lanes[HOW + U(TILE) + e] + lanes[HOW + U(2 * TILE) + e] + lanes[HOW + U(3 * TILE) + e]
        found += 1 if how > 0.0 else 0
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _flow_tile(n, item, row, first_row, x, q, base, law, soft, small, step, memory, s0, table, lanes):
    """The flow of n quads, in place; returns how many of them flow. item, row (TILE,): the first n are theirs; x, q,
    base, memory and s0 are flat."""
    for e in range(n, TILE):
        item[e], row[e] = item[n - 1], row[n - 1]
    flat_law, flat_table = law.reshape(law.size), table.reshape(table.size)
    _gather(item, row, first_row, x, q, base, s0, flat_law, flat_table, memory, lanes)
    _try_overlay_0(small, lanes)
    _try_overlay_1(small, lanes)
    if _any_outside(lanes) < 0:
        return 0
    plasticity.return_all(4 * TILE, lanes)
    plasticity.measure(4 * TILE, lanes)
    _add(step, lanes)
    _share_overlay_0(lanes)
    _share_overlay_1(lanes)
    _relieve_0(lanes)
    _relieve_1(lanes)
    _relieve_2(lanes)
    _relieve_3(lanes)
    _put(n, item, row, first_row, s0, memory, lanes)
    if len(soft.of) > 0:
        _weaken(n, item, row, first_row, law, soft, table, lanes)
    return _how_many(n, lanes)


@njit(cache=True, nogil=True, error_model="numpy")
def _flow(t, threads, count, rows, first_row, x, q, base, law, soft, small, step, memory, s0, table):
    lanes = np.zeros(LANES * CAPACITY)
    item, row = np.empty(TILE, np.int64), np.empty(TILE, np.int64)
    flat_x, flat_q, flat_base = x.reshape(x.size), q.reshape(q.size), base.reshape(base.size)
    flat_memory, flat_s0 = memory.reshape(memory.size), s0.reshape(s0.size)
    begin, end = count * t // threads, count * (t + 1) // threads
    for first in range(begin, end, TILE):
        n = min(TILE, end - first)
        name_quads(first, n, rows, item, row)
        _flow_tile(
            n, item, row, first_row, flat_x, flat_q, flat_base, law, soft, small, step, flat_memory, flat_s0, table,
            lanes,
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def flows(threads, *args):
    """Let the triangles of quads that are outside their yield surface at the present positions flow.

    Arguments as for `plasticity.flows`: count: quads; rows (count,) i4: their rows of x (n, 12); q (count, 32), see
    `elements.QUAD`; base (count, 16) [Pa], law (count, 4): of each of their triangles; memory (n_own, 36): the nine
    columns of each of them; s0 (count, 16) [Pa].
    """
    for t in range(threads):
        _flow(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def flows_threaded(threads, count, rows, first_row, x, q, base, law, soft, small, step, memory, s0, table):
    """The same on several threads."""
    for t in prange(threads):
        _flow(t, threads, count, rows, first_row, x, q, base, law, soft, small, step, memory, s0, table)


_look_0, _look_1 = elements.overlay_loop(0, looks=True), elements.overlay_loop(1, looks=True)


@njit(cache=True, nogil=True, error_model="numpy")
def _outside_of(n, item, row, lanes, who, whose):
    """The quads of a block of which an overlay is outside: their item and row into who, whose. Returns their number."""
    m = 0
    for k in range(n):
        e = U(k)
        if lanes[Q_OUTSIDE + e] > 0.0 or lanes[Q_OUTSIDE + _NEXT + e] > 0.0:
            who[m], whose[m] = item[k], row[k]
            m += 1
    return m


@njit(cache=True, nogil=True, error_model="numpy")
def _yielding(
    t, threads, count, rows, x, v, c, s0, stressed, small, base, partner, law, kind, state, history, table, beyond,
    slot_of, pushed, force, of_joints, keep_joints, gx, gy, drag, beta, step, tally, first_row, initial, yields, soft,
    memory, surfaces,
):  # fmt: skip
    lanes, tile = np.zeros(YIELDING_LANES * CAPACITY), np.zeros(LANES * CAPACITY)
    item, row = np.empty(QUAD_BLOCK, np.int64), np.empty(QUAD_BLOCK, np.int64)
    who, whose = np.empty(QUAD_BLOCK + TILE, np.int64), np.empty(QUAD_BLOCK + TILE, np.int64)
    flat_x, flat_v, flat_c, flat_s0 = x.reshape(x.size), v.reshape(v.size), c.reshape(c.size), s0.reshape(s0.size)
    flat_table, flat_beyond = table.reshape(table.size), beyond.reshape(beyond.size)
    flat_force, flat_of_joints = force.reshape(force.size), of_joints.reshape(of_joints.size)
    flat_yields, flat_surfaces = yields.reshape(yields.size), surfaces.reshape(surfaces.size)
    flat_initial, flat_memory = initial.reshape(initial.size), memory.reshape(memory.size)
    room = softening.lanes_and_lists()
    begin, end = count * t // threads, count * (t + 1) // threads
    tied = most = False
    for first in range(begin, end, QUAD_BLOCK):
        n = min(QUAD_BLOCK, end - first)
        whole = (n + 3) // 4 * 4
        name_quads(first, n, rows, item, row)
        if most:
            who[:n], whose[:n], m = item[:n], row[:n], n
        else:
            gather_quads(whole, item, row, flat_x, flat_v, flat_c, flat_s0, stressed, lanes)
            _gather_yield(whole, item, flat_yields, flat_surfaces, lanes)
            _look_0(whole, small, beta, 0.0, lanes)
            _look_1(whole, small, beta, 0.0, lanes)
            m = _outside_of(n, item, row, lanes, who, whose)
        flowing = 0
        for k in range(0, m, TILE):
            flowing += _flow_tile(
                min(TILE, m - k), who[k:], whose[k:], first_row, flat_x, flat_c, flat_initial, yields, soft, small,
                step, flat_memory, flat_s0, surfaces, tile,
            )  # fmt: skip
        if most:
            gather_quads(whole, item, row, flat_x, flat_v, flat_c, flat_s0, stressed, lanes)
        elif m > 0:
            gather_stresses(whole, item, flat_s0, lanes)
        if most or m > 0:
            overlay_loop_0(whole, small, beta, 0.0, lanes)
            overlay_loop_1(whole, small, beta, 0.0, lanes)
        most = 2 * flowing > n
        tied = finish_quads(
            first, n, item, row, tied, rows, flat_x, v, c, base, partner, law, kind, state, history, flat_table,
            flat_beyond, slot_of, pushed, flat_force, flat_of_joints, keep_joints, gx, gy, drag, step, lanes, room,
            tally[t],
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def yielding(threads, *args):
    """`elements.quads` for quads some of which can yield, after their `flows`. Arguments of both, in this order; of the
    second: first_row, base (as initial), law (as yields), soft, memory, table (as surfaces)."""
    for t in range(threads):
        _yielding(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def yielding_threaded(
    threads, count, rows, x, v, c, s0, stressed, small, base, partner, law, kind, state, history, table, beyond,
    slot_of, pushed, force, of_joints, keep_joints, gx, gy, drag, beta, step, tally, first_row, initial, yields, soft,
    memory, surfaces,
):  # fmt: skip
    """The same on several threads."""
    for t in prange(threads):
        _yielding(
            t, threads, count, rows, x, v, c, s0, stressed, small, base, partner, law, kind, state, history, table,
            beyond, slot_of, pushed, force, of_joints, keep_joints, gx, gy, drag, beta, step, tally, first_row, initial,
            yields, soft, memory, surfaces,
        )  # fmt: skip


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
            b = 4 * p
            own = base[i, b] * e11 + base[i, b + 1] * e22 + 2.0 * base[i, b + 2] * e12 + base[i, b + 3] * e33
            density = 0.5 * (q[i, Q_LAMBDA] * trace * trace + q[i, Q_TWO_MU] * squares) - own
            out[j] += 0.5 * q[i, Q_AREA + p] * density

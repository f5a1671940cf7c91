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
outside. Quads that are go through the return of stresses, as four times as many triangles: triangle p of quad e is
entry p BLOCK + e of the lanes there. Corners, moduli and stresses without strain are read from the lanes of a block,
and what is remembered has lanes of each triangle, as its rows have columns. Then the forces of the block are computed
again. After a block of which most flows the next one is not asked first: all of it goes through the return, which
leaves alone what is inside, and its forces are computed once. Which way a block goes changes no bit.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import CAPACITY, U, four_columns, lane, put_four_columns
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem.kernels import elements, laws, plasticity, softening, strength
from hpcdem.physics.fdem.kernels.elements import (
    PARTS,
    Q_AREA,
    Q_C,
    Q_FREED,
    Q_LAM,
    Q_MU2,
    Q_OUTSIDE,
    Q_S0,
    Q_YIELD,
    QUAD_ROW,
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
    HOW,
    MEMORY,
    OUTSIDE,
    P11,
    P12,
    P22,
    P33,
    P_LAM,
    P_MU2,
    P_PHI,
    P_SHEAR,
    P_SIZE,
    P_STRENGTH,
    P_TENSILE,
    P_VOLUME,
    P_WORK,
    T11,
    T12,
    T22,
    T33,
)

BLOCK = elements.QUAD_BLOCK
"""Quads worked on together; four times as many triangles fit the lanes."""
_FOUR, _EIGHT, _TWELVE, _SIXTEEN, _QUAD = U(4), U(8), U(12), U(16), U(32)
_NEXT, _SECOND, _THIRD, _FOURTH = (lane(k) for k in range(1, 5))
_AREAS = lane(QUAD_ROW + Q_AREA)
BASE, REMEMBERED = lane(plasticity.LANES), lane(plasticity.LANES + 16)
"""Of the return besides: initial stress of each triangle, what each remembers."""
LANES = plasticity.LANES + 16 + 4 * MEMORY


@njit(cache=True, error_model="numpy")
def _pressure(e11, e22, e33, lame, two_mu, free):
    """(s11 + s22) / 2 [Pa] of a strain; free: as of `laws.hooke`."""
    return lame * (e11 + e22 + (e33 - free * e33)) + 0.5 * two_mu * (e11 + e22)


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
def _gather(n, item, row, first_row, base, law, table, memory, filled, lanes):
    """Initial stress, yield surfaces and what is remembered of n quads into lanes. filled: the row of the table that is
    in all of the lanes, negative if they differ; returned as it is then."""
    only, same = law[_FOUR * U(item[0])], True
    for e in range(U(n)):
        for p in range(U(4)):
            same &= law[_FOUR * U(item[e]) + p] == only
    if same and only != filled:
        for k in range(U(4)):
            value = table[U(only) * _FOUR + k]
            for e in range(U(4 * BLOCK)):
                lanes[P_PHI + k * U(CAPACITY) + e] = value
    for e in range(U(0), U(n), _FOUR):
        i0, i1, i2, i3 = U(item[e]), U(item[e + U(1)]), U(item[e + U(2)]), U(item[e + U(3)])
        for k in range(U(0), _SIXTEEN, _FOUR):
            at = i0 * _SIXTEEN + k, i1 * _SIXTEEN + k, i2 * _SIXTEEN + k, i3 * _SIXTEEN + k
            four_columns(lanes, BASE + k * U(CAPACITY) + e, base, at)
        if not same:
            for p in range(U(4)):
                at = (
                    U(law[_FOUR * i0 + p]) * _FOUR, U(law[_FOUR * i1 + p]) * _FOUR,
                    U(law[_FOUR * i2 + p]) * _FOUR, U(law[_FOUR * i3 + p]) * _FOUR,
                )  # fmt: skip
                four_columns(lanes, P_PHI + p * U(BLOCK) + e, table, at)
        width, own = U(4 * MEMORY), U(first_row)
        j0, j1 = (U(row[e]) - own) * width, (U(row[e + U(1)]) - own) * width
        j2, j3 = (U(row[e + U(2)]) - own) * width, (U(row[e + U(3)]) - own) * width
        for k in range(U(0), width, _FOUR):
            four_columns(lanes, REMEMBERED + k * U(CAPACITY) + e, memory, (j0 + k, j1 + k, j2 + k, j3 + k))
    return np.int64(only) if same else np.int64(-1)


@njit(cache=True, nogil=True, error_model="numpy")
def _put(n, item, row, first_row, s0, memory, block, lanes):
    """Stress without strain and what is remembered of n quads go back; the last one may do so several times."""
    for e in range(U(0), U(n), _FOUR):
        i0, i1, i2, i3 = U(item[e]), U(item[e + U(1)]), U(item[e + U(2)]), U(item[e + U(3)])
        for k in range(U(0), _SIXTEEN, _FOUR):
            at = i0 * _SIXTEEN + k, i1 * _SIXTEEN + k, i2 * _SIXTEEN + k, i3 * _SIXTEEN + k
            put_four_columns(s0, at, block, Q_S0 + k * U(CAPACITY) + e)
        width, own = U(4 * MEMORY), U(first_row)
        j0, j1 = (U(row[e]) - own) * width, (U(row[e + U(1)]) - own) * width
        j2, j3 = (U(row[e + U(2)]) - own) * width, (U(row[e + U(3)]) - own) * width
        for k in range(U(0), width, _FOUR):
            put_four_columns(memory, (j0 + k, j1 + k, j2 + k, j3 + k), lanes, REMEMBERED + k * U(CAPACITY) + e)


def _try_overlay(overlay):
    """The loop that finds trial stresses of an overlay (0, 1), and how much they are outside. One function each:
    distances between lanes must be constants."""
    p, q = PARTS[2 * overlay : 2 * overlay + 2].tolist()
    xi, xj, xk, xl = (lane(2 * corner) for corner in (*p, q[2]))
    one, two = (_AREAS + lane(2 * overlay + part) for part in (0, 1))
    c1, c2 = (Q_C + lane(4 * part) for part in (2 * overlay, 2 * overlay + 1))
    z1, z2 = (Q_S0 + lane(4 * part) for part in (2 * overlay, 2 * overlay + 1))
    first, second = U(2 * overlay * BLOCK), U((2 * overlay + 1) * BLOCK)

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(n, small, block, lanes):
        for e in range(U(n)):
            x1, y1, x2, y2 = block[xi + e], block[xi + _NEXT + e], block[xj + e], block[xj + _NEXT + e]
            x3, y3, x4, y4 = block[xk + e], block[xk + _NEXT + e], block[xl + e], block[xl + _NEXT + e]
            f, g = first + e, second + e
            a, b, c, d = block[c1 + e], block[c1 + _NEXT + e], block[c1 + _SECOND + e], block[c1 + _THIRD + e]
            _, _, _, _, _, _, a11, a22, a12 = _part(x1, y1, x2, y2, x3, y3, a, b, c, d, small)
            a, b, c, d = block[c2 + e], block[c2 + _NEXT + e], block[c2 + _SECOND + e], block[c2 + _THIRD + e]
            _, _, _, _, _, _, b11, b22, b12 = _part(x1, y1, x3, y3, x4, y4, a, b, c, d, small)
            lanes[P_SIZE + f], lanes[P_SIZE + g] = 0.5 * block[one + e], 0.5 * block[two + e]
            lame, two_mu = block[Q_LAM + e], block[Q_MU2 + e]
            mean = (block[one + e] * (a11 + a22) + block[two + e] * (b11 + b22)) / (block[one + e] + block[two + e])
            pressure = lame * mean
            across = pressure - block[Q_FREED + e] * pressure
            shift = 0.5 * (mean - (a11 + a22))
            s11, s22 = (
                block[z1 + e] + (pressure + two_mu * (a11 + shift)),
                block[z1 + _NEXT + e] + (pressure + two_mu * (a22 + shift)),
            )
            s12, s33 = block[z1 + _SECOND + e] + two_mu * a12, block[z1 + _THIRD + e] + across
            shift = 0.5 * (mean - (b11 + b22))
            t11, t22 = (
                block[z2 + e] + (pressure + two_mu * (b11 + shift)),
                block[z2 + _NEXT + e] + (pressure + two_mu * (b22 + shift)),
            )
            t12, t33 = block[z2 + _SECOND + e] + two_mu * b12, block[z2 + _THIRD + e] + across
            lanes[T11 + f], lanes[T22 + f], lanes[T12 + f], lanes[T33 + f] = s11, s22, s12, s33
            lanes[T11 + g], lanes[T22 + g], lanes[T12 + g], lanes[T33 + g] = t11, t22, t12, t33
            lanes[P_LAM + f], lanes[P_MU2 + f], lanes[P_LAM + g], lanes[P_MU2 + g] = lame, two_mu, lame, two_mu
            far = laws.outside(s11, s22, s12, s33, lanes[P_PHI + f], lanes[P_STRENGTH + f], lanes[P_TENSILE + f])
            farther = laws.outside(t11, t22, t12, t33, lanes[P_PHI + g], lanes[P_STRENGTH + g], lanes[P_TENSILE + g])
            lanes[OUTSIDE + f], lanes[OUTSIDE + g] = far, farther

    return loop


_try_overlay_0, _try_overlay_1 = _try_overlay(0), _try_overlay(1)


def _remembered(p):
    """Lanes of what triangle p remembers, in the order of its columns."""
    return tuple(REMEMBERED + lane(MEMORY * p + k) for k in range(MEMORY))


def _add_part(p):
    """The loop that adds what flows in triangle p to what it remembers."""
    m11, m22, m12, m33, m_shear, m_volume, m_in_shear, m_in_tension, m_work = _remembered(p)
    first = U(p * BLOCK)

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(n, step, lanes):
        now = step + 1.0
        for e in range(U(n)):
            f = first + e
            lanes[m11 + e] += lanes[P11 + f]
            lanes[m22 + e] += lanes[P22 + f]
            lanes[m12 + e] += lanes[P12 + f]
            lanes[m33 + e] += lanes[P33 + f]
            lanes[m_shear + e] += lanes[P_SHEAR + f]
            lanes[m_volume + e] += lanes[P_VOLUME + f]
            lanes[m_work + e] += lanes[P_WORK + f]
            how, shear, tension = lanes[HOW + f], lanes[m_in_shear + e], lanes[m_in_tension + e]
            lanes[m_in_shear + e] = now if (how == 1.0) | (how == 3.0) else shear
            lanes[m_in_tension + e] = now if how >= 2.0 else tension

    return loop


_add_0, _add_1, _add_2, _add_3 = (_add_part(p) for p in range(4))


def _share_overlay(overlay):
    """The loop that gives the two triangles of an overlay one pressure, if any of them flows."""
    one, two = (_AREAS + lane(2 * overlay + part) for part in (0, 1))
    first, second = U(2 * overlay * BLOCK), U((2 * overlay + 1) * BLOCK)
    m11, m22, _, m33 = _remembered(2 * overlay)[:4]
    n11, n22, _, n33 = _remembered(2 * overlay + 1)[:4]

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(n, block, lanes):
        for e in range(U(n)):
            f, g = first + e, second + e
            lame, two_mu, area, other = block[Q_LAM + e], block[Q_MU2 + e], block[one + e], block[two + e]
            a11, a22, b11, b22 = lanes[m11 + e], lanes[m22 + e], lanes[n11 + e], lanes[n22 + e]
            p = _pressure(a11, a22, lanes[m33 + e], lame, two_mu, block[Q_FREED + e])
            q = _pressure(b11, b22, lanes[n33 + e], lame, two_mu, block[Q_FREED + e])
            mean = (area * p + other * q) / (area + other)
            per = 1.0 / (2.0 * lame + two_mu)
            flows = lanes[HOW + f] + lanes[HOW + g] > 0.0
            p, q = ((mean - p) * per if flows else 0.0), ((mean - q) * per if flows else 0.0)
            lanes[m11 + e], lanes[m22 + e], lanes[n11 + e], lanes[n22 + e] = a11 + p, a22 + p, b11 + q, b22 + q

    return loop


_share_overlay_0, _share_overlay_1 = _share_overlay(0), _share_overlay(1)


def _relieve_part(p):
    """The loop that finds the stress of triangle p without strain: its initial stress less D e_p."""
    (m11, m22, m12, m33), base, z = _remembered(p)[:4], BASE + lane(4 * p), Q_S0 + lane(4 * p)

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(n, block, lanes):
        for e in range(U(n)):
            s11, s22, s12, s33 = laws.hooke(
                lanes[m11 + e], lanes[m22 + e], lanes[m12 + e], lanes[m33 + e], block[Q_LAM + e], block[Q_MU2 + e],
                block[Q_FREED + e],
            )  # fmt: skip
            block[z + e], block[z + _NEXT + e] = lanes[base + e] - s11, lanes[base + _NEXT + e] - s22
            block[z + _SECOND + e] = lanes[base + _SECOND + e] - s12
            block[z + _THIRD + e] = lanes[base + _THIRD + e] - s33

    return loop


_relieve_0, _relieve_1, _relieve_2, _relieve_3 = (_relieve_part(p) for p in range(4))


@njit(cache=True, nogil=True, error_model="numpy")
def _weaken(n, item, row, first_row, law, soft, table, lanes):
    """Strengths that follow what has flowed."""
    for e in range(n):
        for p in range(4):
            f, own = U(p * BLOCK + e), law[item[e], p]
            how = np.int64(lanes[HOW + f])
            if how > 0 and own >= soft.first:
                history = soft.history[row[e] - first_row, 2 * p : 2 * p + 2]
                strength.flowed(
                    own, history, how, lanes[P11 + f], lanes[P22 + f], lanes[P12 + f], lanes[P33 + f],
                    lanes[P_SHEAR + f], lanes[P_VOLUME + f], soft, table,
                )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _none_outside(n, lanes):
    """Negative if no triangle of n quads is outside."""
    bits = lanes.view(np.int64)
    found = np.int64(-1)
    for e in range(U(n)):
        found &= bits[OUTSIDE + e] & bits[OUTSIDE + U(BLOCK) + e]
        found &= bits[OUTSIDE + U(2 * BLOCK) + e] & bits[OUTSIDE + U(3 * BLOCK) + e]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _how_many(n, lanes):
    """Return how many of the first n quads flow."""
    found = 0
    for e in range(U(n)):
        how = lanes[HOW + e] + lanes[HOW + U(BLOCK) + e] + lanes[HOW + U(2 * BLOCK) + e] + lanes[HOW + U(3 * BLOCK) + e]
        found += 1 if how > 0.0 else 0
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _flow_block(
    n, item, row, first_row, base, law, soft, small, step, memory, s0, table, filled, block, lanes
):  # fmt: skip
    """The flow of n quads of which corners, moduli and stresses are in the lanes `block`, in place and in s0; returns
    how many of them flow, and `filled`, see `_gather`. item, row: theirs, the last one again up to a multiple of four;
    base, memory and s0 are flat."""
    flat_law, flat_table, whole = law.reshape(law.size), table.reshape(table.size), (n + 3) // 4 * 4
    filled = _gather(whole, item, row, first_row, base, flat_law, flat_table, memory, filled, lanes)
    _try_overlay_0(whole, small, block, lanes)
    _try_overlay_1(whole, small, block, lanes)
    if _none_outside(n, lanes) < 0:
        return 0, filled
    plasticity.return_all(4 * BLOCK, block[Q_FREED], lanes)
    plasticity.measure(4 * BLOCK, block[Q_FREED], lanes)
    _add_0(whole, step, lanes)
    _add_1(whole, step, lanes)
    _add_2(whole, step, lanes)
    _add_3(whole, step, lanes)
    _share_overlay_0(whole, block, lanes)
    _share_overlay_1(whole, block, lanes)
    _relieve_0(whole, block, lanes)
    _relieve_1(whole, block, lanes)
    _relieve_2(whole, block, lanes)
    _relieve_3(whole, block, lanes)
    _put(whole, item, row, first_row, s0, memory, block, lanes)
    if len(soft.of) > 0:
        _weaken(n, item, row, first_row, law, soft, table, lanes)
        filled = np.int64(-1)
    return _how_many(n, lanes), filled


@njit(cache=True, nogil=True, error_model="numpy")
def flow(g, t, threads, count, who, base, law, soft, small, step, memory, s0, table):
    """Let quads flow before the loop over their forces, as looks do, see elements/flow.py."""
    block, lanes = np.zeros(YIELDING_LANES * CAPACITY), np.zeros(LANES * CAPACITY)
    item, row = np.empty(BLOCK, np.int64), np.empty(BLOCK, np.int64)
    flat_q, flat_base = g.c.reshape(g.c.size), base.reshape(base.size)
    flat_memory, flat_s0 = memory.reshape(memory.size), s0.reshape(s0.size)
    begin, end = count * t // threads, count * (t + 1) // threads
    filled = np.int64(-1)
    for first in range(begin, end, BLOCK):
        n = min(BLOCK, end - first)
        name_quads(first, n, g.rows, item, row)
        gather_quads((n + 3) // 4 * 4, item, row, g.x, g.x, flat_q, flat_s0, True, block)
        _, filled = _flow_block(
            n, item, row, g.first, flat_base, law, soft, small, step, flat_memory, flat_s0, table, filled, block,
            lanes,
        )  # fmt: skip


_look_0, _look_1 = elements.overlay_loop(0, reports_yield=True), elements.overlay_loop(1, reports_yield=True)


@njit(cache=True, nogil=True, error_model="numpy")
def _outside_of(n, item, row, lanes, who, whose):
    """The quads of a block of which an overlay is outside: their item and row into who, whose, the last one again up to
    a multiple of four. Returns their number."""
    m = 0
    for k in range(n):
        e = U(k)
        if lanes[Q_OUTSIDE + e] > 0.0 or lanes[Q_OUTSIDE + _NEXT + e] > 0.0:
            who[m], whose[m] = item[k], row[k]
            m += 1
    for k in range(m, (m + 3) // 4 * 4):
        who[k], whose[k] = who[m - 1], whose[m - 1]
    return m


@njit(cache=True, nogil=True, error_model="numpy")
def _yielding(
    t, threads, soft, count, rows, x, v, c, s0, stressed, small, base, partner, law, kind, state, history, table,
    beyond, slot_of, pushed, force, of_joints, keep_joints, gx, gy, drag, beta, step, tally, first_row, initial, yields,
    memory, surfaces,
):  # fmt: skip
    lanes, some, tile = (
        np.zeros(YIELDING_LANES * CAPACITY), np.zeros(YIELDING_LANES * CAPACITY), np.zeros(LANES * CAPACITY)
    )  # fmt: skip
    item, row = np.empty(BLOCK, np.int64), np.empty(BLOCK, np.int64)
    who, whose = np.empty(BLOCK, np.int64), np.empty(BLOCK, np.int64)
    flat_x, flat_v, flat_c, flat_s0 = x.reshape(x.size), v.reshape(v.size), c.reshape(c.size), s0.reshape(s0.size)
    flat_table, flat_beyond = table.reshape(table.size), beyond.reshape(beyond.size)
    flat_force, flat_of_joints = force.reshape(force.size), of_joints.reshape(of_joints.size)
    flat_yields, flat_surfaces = yields.reshape(yields.size), surfaces.reshape(surfaces.size)
    flat_initial, flat_memory = initial.reshape(initial.size), memory.reshape(memory.size)
    room = softening.lanes_and_lists()
    begin, end = count * t // threads, count * (t + 1) // threads
    tied, most, filled = False, False, np.int64(-1)
    for first in range(begin, end, BLOCK):
        n = min(BLOCK, end - first)
        whole = (n + 3) // 4 * 4
        name_quads(first, n, rows, item, row)
        gather_quads(whole, item, row, flat_x, flat_v, flat_c, flat_s0, True, lanes)
        m = n
        if not most:
            _gather_yield(whole, item, flat_yields, flat_surfaces, lanes)
            _look_0(whole, small, beta, 0.0, lanes)
            _look_1(whole, small, beta, 0.0, lanes)
            m = _outside_of(n, item, row, lanes, who, whose)
        flowing = 0
        if m == n:
            flowing, filled = _flow_block(
                n, item, row, first_row, flat_initial, yields, soft, small, step, flat_memory, flat_s0, surfaces,
                filled, lanes, tile,
            )  # fmt: skip
        elif m > 0:
            gather_quads((m + 3) // 4 * 4, who, whose, flat_x, flat_v, flat_c, flat_s0, True, some)
            flowing, filled = _flow_block(
                m, who, whose, first_row, flat_initial, yields, soft, small, step, flat_memory, flat_s0, surfaces,
                filled, some, tile,
            )  # fmt: skip
            gather_stresses(whole, item, flat_s0, lanes)
        if m > 0:
            overlay_loop_0(whole, small, beta, 0.0, lanes)
            overlay_loop_1(whole, small, beta, 0.0, lanes)
        most = 2 * flowing > n
        tied = finish_quads(
            first, n, item, row, tied, rows, flat_x, v, c, base, partner, law, kind, state, history, flat_table,
            flat_beyond, slot_of, pushed, flat_force, flat_of_joints, keep_joints, gx, gy, drag, step, lanes, room,
            tally[t],
        )  # fmt: skip


@on_threads
def yielding(threads, soft, *args):
    """`elements.quads` for quads some of which can yield, after their `flow`. Arguments of both, in this order; of the
    second: soft, which leads, and first_row, base (as initial), law (as yields), memory, table (as surfaces)."""
    for t in prange(threads):
        _yielding(t, threads, soft, *args)

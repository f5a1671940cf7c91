"""Loops over elements that have a law of the user: the work on all blocks of elements.py, with this law in the place of
the elastic one.

A law takes numbers and returns numbers, so it is evaluated for lanes (numerics/lanes.py), as the built-in ones are.
Elements with another model go through the same loop and keep their elastic stress; blocks without any that has the law
take the loop of elements.py. In a quad the law is that of each of its four triangles, with the volume of the overlay as
their strains have it (mixed discretisation, Marti & Cundall 1982); the two triangles of an overlay then get the mean of
their pressures in the plane by area, which is what forces of that volume do work with. All kernels here are made for
one law; what is compiled is kept apart from the kernels of hpcdem (runtime/kept.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lane_arguments import arguments, storing
from hpcdem.numerics.lanes import CAPACITY, U, four_columns, lane
from hpcdem.physics.fdem.kernels import elements
from hpcdem.physics.fdem.kernels.elements import BLOCK, LANES, Q_S0, QUAD_BLOCK, QUAD_LANES, S11, S12, S22, S33

GIVEN = ("e11", "e22", "e12", "evol", "dt")
"""Arguments of a law: strain in the frame that turns with the element, its volume strain e11 + e22 (of a quad: of the
overlay, whose sum e11 + e22 is but for rounding), time step [s], 0 in static runs."""
INITIAL = ("i11", "i22", "i12", "i33")
"""Stress at zero strain there [Pa]."""
OWN = "own"
"""Of the columns of the table of properties: 1 for elements with this law, 0 for others."""
SHARED = 1e-12
"""Difference of pressures in a quad, over its stresses, that is put down to rounding."""
_1, _2, _3, _FOUR = U(1), U(2), U(3), U(4)


class Obeying(NamedTuple):
    """What the kernels of a law need: some (blocks,) bool: blocks of triangles with an element that has it; row (count
    + 3,) i4: of each element, in the flat table of properties, `table`; dt [s]; first_row: storage row of the first
    owned element; memory (n_own, 1 + parts states): what these remember, from column 1 on, of a quad's four triangles
    one after the other, `width` columns each."""

    some: np.ndarray
    row: np.ndarray
    table: np.ndarray
    dt: float
    first_row: int
    memory: np.ndarray
    width: int


class Loops(NamedTuple):
    """The kernels of a law, on one thread and on several: in the place of `elements.triangles` and `elements.quads`,
    and those that find stress and states only."""

    triangles: Any
    triangles_threaded: Any
    quads: Any
    quads_threaded: Any
    look: Any
    look_quads: Any


def loops(law: Any, names: Sequence[str], states: Sequence[str], columns: Sequence[str]) -> Loops:
    """The loops over elements of a law, a kernel of the arguments `names`; columns: of the table of properties, a
    multiple of four, one of them `OWN`."""
    n_states, n_columns = len(states), len(columns)

    def evaluated(first: int, part: int, initial: Sequence[Any]) -> Any:
        """A kernel (e, values, lanes): stress of the law; states go into their lanes. first: lane of the first column;
        states of the parts follow; initial: lanes of the initial stress."""
        begin = first + n_columns + 1 + part * n_states
        places = dict(zip(INITIAL, initial))
        places |= {name: lane(first + k) for k, name in enumerate(columns)}
        places |= {name: lane(begin + k) for k, name in enumerate(states)}
        given, store = arguments(names, GIVEN, places), storing(n_states, 4, begin)

        @njit(error_model="numpy")
        def evaluate(e, values, lanes):
            found = law(*given(lanes, e, values))
            store(lanes, e, found)
            return found[0], found[1], found[2], found[3]

        return evaluate

    @njit(nogil=True, error_model="numpy")
    def gather(n, of, first, table, lanes):
        """Properties of n elements into lanes from `first` on; of: their rows of the table, some more behind them.
        Where all have the row of the block before they are there already; the lane behind says which that was."""
        lanes_of, row, filled = U(first) * U(CAPACITY), of[0], U(first + n_columns) * U(CAPACITY)
        same = True
        for e in range(n):
            same &= of[e] == row
        if same:
            if lanes[filled] != row + 1.0:
                for k in range(U(n_columns)):
                    for e in range(U(BLOCK)):
                        lanes[lanes_of + k * U(CAPACITY) + e] = table[U(row) * U(n_columns) + k]
            lanes[filled] = row + 1.0
            return
        lanes[filled] = 0.0
        width = U(n_columns)
        for e in range(U(0), U(n), _FOUR):
            r0, r1, r2, r3 = U(of[e]) * width, U(of[e + _1]) * width, U(of[e + _2]) * width, U(of[e + _3]) * width
            for k in range(U(0), width, _FOUR):
                four_columns(lanes, lanes_of + k * U(CAPACITY) + e, table, (r0 + k, r1 + k, r2 + k, r3 + k))

    # ---- triangles -------------------------------------------------------------------------------------------------

    own = lane(LANES + list(columns).index(OWN))
    first_state, keep = LANES + n_columns + 1, LANES + n_columns + 1 + n_states
    of_triangle = evaluated(LANES, 0, (S11, S22, S12, S33))

    @njit(error_model="numpy")
    def chosen(e, e11, e22, e12, trace, dt, lanes):
        """The law for its elements, elasticity for others."""
        s11, s22, s12, s33 = elements.elastic(e, e11, e22, e12, trace, dt, lanes)
        t11, t22, t12, t33 = of_triangle(e, (e11, e22, e12, trace, dt), lanes)
        obeys = lanes[own + e] == 1.0
        return t11 if obeys else s11, t22 if obeys else s22, t12 if obeys else s12, t33 if obeys else s33

    def stress_of_block(loop: Any) -> Any:
        @njit(nogil=True, error_model="numpy")
        def stress(b, n, first, rows, small, beta, obeying, lanes):
            if not obeying.some[b]:
                elements.elastic_stress(n, small, beta, 0.0, lanes)
                return
            memory = obeying.memory
            gather(n, obeying.row[first:], LANES, obeying.table, lanes)
            for k in range(n_states):
                at = U(first_state + k) * U(CAPACITY)
                for e in range(n):
                    lanes[at + U(e)] = memory[rows[first + e] - obeying.first_row, 1 + k]
            loop(n, small, beta, obeying.dt, lanes)
            for k in range(n_states):
                at = U(first_state + k) * U(CAPACITY)
                for e in range(n):
                    if lanes[own + U(e)] == 1.0:
                        memory[rows[first + e] - obeying.first_row, 1 + k] = lanes[at + U(e)]

        return stress

    blocks = elements.triangle_blocks(stress_of_block(elements.stress_loop(chosen)), n_columns + 1 + n_states)
    looking = stress_of_block(elements.stress_loop(chosen, keep))

    @njit(nogil=True, error_model="numpy")
    def triangles(threads, obeying, *args):
        for t in range(threads):
            blocks(obeying, t, threads, *args)

    @njit(parallel=True, error_model="numpy")
    def triangles_threaded(
        threads, obeying, count, rows, wide, x, v, c, s0, stressed, small, partner, law, kind, state, history, head,
        follow, table, beyond, contact_begin, contact_lane, contact_slot, pushed, special, some_special, force,
        of_joints, keep_joints, gx, gy, drag, beta, alpha, step, tally,
    ):  # fmt: skip
        for t in prange(threads):
            blocks(
                obeying, t, threads, count, rows, wide, x, v, c, s0, stressed, small, partner, law, kind, state,
                history, head, follow, table, beyond, contact_begin, contact_lane, contact_slot, pushed, special,
                some_special, force, of_joints, keep_joints, gx, gy, drag, beta, alpha, step, tally,
            )  # fmt: skip

    @njit(nogil=True, error_model="numpy")
    def look(obeying, count, rows, wide, x, v, c, base, small, s0):
        """Stress [Pa] of the elements with this law into their rows of s0 (count + 3, 4); base, as this: initial."""
        lanes = np.zeros((keep + 4) * CAPACITY)
        x, v, c, base = x.reshape(x.size), v.reshape(v.size), c.reshape(c.size), base.reshape(base.size)
        for b in range(len(obeying.some)):
            if obeying.some[b]:
                first = b * BLOCK
                n = min(BLOCK, count - first)
                elements.gather(n, first, rows, wide, x, v, c, base, True, lanes)
                looking(b, n, first, rows, small, 0.0, obeying, lanes)
                for e in range(n):
                    if lanes[own + U(e)] == 1.0:
                        for k in range(4):
                            s0[first + e, k] = lanes[U(keep + k) * U(CAPACITY) + U(e)]

    # ---- quads -----------------------------------------------------------------------------------------------------

    own_quad = lane(QUAD_LANES + list(columns).index(OWN))
    first_of_quad = QUAD_LANES + n_columns + 1
    keep_quad = first_of_quad + 4 * n_states
    parts = [evaluated(QUAD_LANES, p, [Q_S0 + lane(4 * p + k) for k in range(4)]) for p in range(4)]

    def chosen_pair(of_first: Any, of_second: Any) -> Any:
        @njit(error_model="numpy")
        def pair(e, a11, a22, a12, b11, b22, b12, mean, one, two, dt, lanes):
            """The same of the two triangles of an overlay, which share their pressure in the plane."""
            s11, s22, s12, s33, t11, t22, t12, t33 = elements.elastic_pair(
                e, a11, a22, a12, b11, b22, b12, mean, one, two, dt, lanes
            )
            u11, u22, u12, u33 = of_first(e, (a11, a22, a12, mean, dt), lanes)
            v11, v22, v12, v33 = of_second(e, (b11, b22, b12, mean, dt), lanes)
            apart = 0.5 * ((u11 + u22) - (v11 + v22))
            size = (abs(u11) + abs(u22)) + (abs(v11) + abs(v22))
            share = (apart if abs(apart) > SHARED * size else 0.0) / (one + two)
            p, q = -two * share, one * share
            obeys = lanes[own_quad + e] == 1.0
            return (
                u11 + p if obeys else s11, u22 + p if obeys else s22, u12 if obeys else s12, u33 if obeys else s33,
                v11 + q if obeys else t11, v22 + q if obeys else t22, v12 if obeys else t12, v33 if obeys else t33,
            )  # fmt: skip

        return pair

    pairs = chosen_pair(parts[0], parts[1]), chosen_pair(parts[2], parts[3])

    def stress_of_quads(overlay_0: Any, overlay_1: Any) -> Any:
        @njit(nogil=True, error_model="numpy")
        def stress(n, item, row, small, beta, obeying, lanes):
            memory = obeying.memory
            gather(n, obeying.row[item[0] :], QUAD_LANES, obeying.table, lanes)
            for p in range(4):
                for k in range(n_states):
                    at, column = U(first_of_quad + p * n_states + k) * U(CAPACITY), 1 + p * obeying.width + k
                    for e in range(n):
                        lanes[at + U(e)] = memory[row[e] - obeying.first_row, column]
            overlay_0(n, small, beta, obeying.dt, lanes)
            overlay_1(n, small, beta, obeying.dt, lanes)
            for p in range(4):
                for k in range(n_states):
                    at, column = U(first_of_quad + p * n_states + k) * U(CAPACITY), 1 + p * obeying.width + k
                    for e in range(n):
                        if lanes[own_quad + U(e)] == 1.0:
                            memory[row[e] - obeying.first_row, column] = lanes[at + U(e)]

        return stress

    steps = [elements.overlay_loop(overlay, pair) for overlay, pair in enumerate(pairs)]
    looks = [elements.overlay_loop(overlay, pair, keep_quad + 8 * overlay) for overlay, pair in enumerate(pairs)]
    blocks_of_quads = elements.quad_blocks(stress_of_quads(*steps), n_columns + 1 + 4 * n_states)
    looking_at_quads = stress_of_quads(*looks)

    @njit(nogil=True, error_model="numpy")
    def quads(threads, obeying, *args):
        for t in range(threads):
            blocks_of_quads(obeying, t, threads, *args)

    @njit(parallel=True, error_model="numpy")
    def quads_threaded(
        threads, obeying, count, rows, x, v, c, s0, stressed, small, base, partner, law, kind, state, history, table,
        beyond, slot_of, pushed, force, of_joints, keep_joints, gx, gy, drag, beta, step, tally,
    ):  # fmt: skip
        for t in prange(threads):
            blocks_of_quads(
                obeying, t, threads, count, rows, x, v, c, s0, stressed, small, base, partner, law, kind, state,
                history, table, beyond, slot_of, pushed, force, of_joints, keep_joints, gx, gy, drag, beta, step, tally,
            )  # fmt: skip

    @njit(nogil=True, error_model="numpy")
    def look_quads(obeying, count, rows, x, v, c, base, small, s0):
        """The same of quads: s0, base (count, 16)."""
        lanes = np.zeros((keep_quad + 16) * CAPACITY)
        item, row = np.empty(QUAD_BLOCK, np.int64), np.empty(QUAD_BLOCK, np.int64)
        x, v, c, base = x.reshape(x.size), v.reshape(v.size), c.reshape(c.size), base.reshape(base.size)
        for first in range(0, count, QUAD_BLOCK):
            n = min(QUAD_BLOCK, count - first)
            whole = (n + 3) // 4 * 4
            elements.name_quads(first, n, rows, item, row)
            elements.gather_quads(whole, item, row, x, v, c, base, True, lanes)
            looking_at_quads(whole, item, row, small, 0.0, obeying, lanes)
            for e in range(n):
                if lanes[own_quad + U(e)] == 1.0:
                    for k in range(16):
                        s0[first + e, k] = lanes[U(keep_quad + k) * U(CAPACITY) + U(e)]

    return Loops(triangles, triangles_threaded, quads, quads_threaded, look, look_quads)


def at_strain(law: Any, names: Sequence[str], states: Sequence[str], columns: Sequence[str]) -> Callable[..., Any]:
    """A kernel that evaluates a law at one strain with each row of properties: (table (n, columns), strain (3,),
    initial states (states,), out (n, 4 + states))."""
    places = {name: lane(len(states) + k) for k, name in enumerate(columns)}
    places |= {name: lane(k) for k, name in enumerate(states)}
    places |= dict.fromkeys(INITIAL, lane(len(states) + len(columns)))
    given = arguments(names, GIVEN, places)
    n_states, n_columns = len(states), len(columns)
    size = (n_states + n_columns + 1) * CAPACITY

    @njit(nogil=True, error_model="numpy")
    def evaluate(table, strain, initial, out):
        lanes = np.zeros(size)
        for i in range(len(table)):
            for k in range(n_states):
                lanes[k * CAPACITY] = initial[k]
            for k in range(n_columns):
                lanes[(n_states + k) * CAPACITY] = table[i, k]
            values = (strain[0], strain[1], strain[2], strain[0] + strain[1], 0.0)
            found = law(*given(lanes, U(0), values))
            for k in range(4 + n_states):
                out[i, k] = found[k]

    return evaluate

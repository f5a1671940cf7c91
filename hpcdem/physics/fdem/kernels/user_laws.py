"""Loops over the triangles that have a law of the user: their stresses, and what their states become.

A law takes numbers and returns numbers, so its loop runs over lanes (numerics/lanes.py) as those of the built-in laws
do. The stress of a law is put in the place of the initial stress, and its element has no moduli in the table of
triangles: the loop over all triangles (elements.py) adds the viscous part and makes forces of it. All kernels here are
made for one law; what is compiled is kept apart from the kernels of hpcdem (runtime/kept.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lane_arguments import arguments, storing
from hpcdem.numerics.lanes import CAPACITY, U, four_columns, lane, put_four_columns, two_columns
from hpcdem.physics.fdem.kernels import laws
from hpcdem.physics.fdem.kernels.elements import BLOCK

GIVEN = ("e11", "e22", "e12", "dt")
"""Arguments of a law: strain in the frame that turns with the element, time step [s], 0 in static runs."""
INITIAL = ("i11", "i22", "i12", "i33")
"""Stress at zero strain there [Pa]."""

X1, Y1, X2, Y2, X3, Y3, CA, CB, CC, CD, I11, I22, I12, I33, S11, S22, S12, S33 = (lane(k) for k in range(18))
_STATES = 18
"""First lane of the states, then those of the properties."""
_1, _2, _3, _FOUR, _EIGHT, _TWELVE = U(1), U(2), U(3), U(4), U(8), U(12)


def loops(law: Any, names: Sequence[str], states: Sequence[str], columns: Sequence[str]) -> tuple[Any, Any]:
    """The loop over elements of a law, on one thread and on several.

    law: a kernel of the arguments `names`; columns: of the table of properties, a multiple of four.

    Of the kernels: which (n + 3,) i4: the elements among the triangles; rows: storage rows of these in x, of which the
    first owned one is `first_row`; wide: x is (rows, 12); c (triangles, 12), see `elements.TRIANGLE`; base (triangles,
    4) [Pa]: initial stress; row (triangles,) i4: of the table (rows, columns) of properties; dt [s]; small: small
    strains; memory (n_own, 1 + states at least): states from column 1 on; s0 (triangles, 4) [Pa]: becomes stress.
    """
    n_states, n_columns = len(states), len(columns)
    first_column = _STATES + n_states
    n_lanes = first_column + n_columns
    places = dict(zip(INITIAL, (I11, I22, I12, I33)))
    places |= {name: lane(first_column + k) for k, name in enumerate(columns)}
    places |= {name: lane(_STATES + k) for k, name in enumerate(states)}
    given, store = arguments(names, GIVEN, places), storing(n_states, 4, _STATES)

    @njit(nogil=True, error_model="numpy")
    def gather(n, which, rows, wide, x, c, base, row, table, lanes):
        wx = U(12 if wide else 8)
        for e in range(U(0), U(n), _FOUR):
            i0, i1, i2, i3 = U(which[e]), U(which[e + _1]), U(which[e + _2]), U(which[e + _3])
            at = U(rows[i0]) * wx, U(rows[i1]) * wx, U(rows[i2]) * wx, U(rows[i3]) * wx
            four_columns(lanes, X1 + e, x, at)
            two_columns(lanes, X3 + e, x, (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR))
            four_columns(lanes, CA + e, c, (i0 * _TWELVE, i1 * _TWELVE, i2 * _TWELVE, i3 * _TWELVE))
            four_columns(lanes, I11 + e, base, (i0 * _FOUR, i1 * _FOUR, i2 * _FOUR, i3 * _FOUR))
            width = U(n_columns)
            r0, r1, r2, r3 = U(row[i0]) * width, U(row[i1]) * width, U(row[i2]) * width, U(row[i3]) * width
            for k in range(U(0), width, _FOUR):
                to = (U(first_column) + k) * U(CAPACITY) + e
                four_columns(lanes, to, table, (r0 + k, r1 + k, r2 + k, r3 + k))

    @njit(nogil=True, error_model="numpy")
    def stress(n, small, dt, lanes):
        for e in range(U(n)):
            x1, y1 = lanes[X1 + e], lanes[Y1 + e]
            ux, uy, wx, wy = lanes[X2 + e] - x1, lanes[Y2 + e] - y1, lanes[X3 + e] - x1, lanes[Y3 + e] - y1
            a, b, c, d = lanes[CA + e], lanes[CB + e], lanes[CC + e], lanes[CD + e]
            f11, f12, f21, f22 = ux * a + wx * c, ux * b + wx * d, uy * a + wy * c, uy * b + wy * d
            cs, sn = laws.rotation(f11, f12, f21, f22)
            cs, sn = (1.0 if small else cs), (0.0 if small else sn)
            e11, e22, e12 = laws.stretch(f11, f12, f21, f22, cs, sn)
            found = law(*given(lanes, e, (e11, e22, e12, dt)))
            lanes[S11 + e], lanes[S22 + e] = lanes[I11 + e] + found[0], lanes[I22 + e] + found[1]
            lanes[S12 + e], lanes[S33 + e] = lanes[I12 + e] + found[2], lanes[I33 + e] + found[3]
            store(lanes, e, found)

    @njit(nogil=True, error_model="numpy")
    def run(t, threads, count, which, rows, first_row, wide, x, c, base, row, table, dt, small, memory, s0):
        lanes = np.zeros(n_lanes * CAPACITY)
        x, c, base = x.reshape(x.size), c.reshape(c.size), base.reshape(base.size)
        table, s0 = table.reshape(table.size), s0.reshape(s0.size)
        blocks = -(-count // BLOCK)
        for b in range(blocks * t // threads, blocks * (t + 1) // threads):
            first = b * BLOCK
            n = min(BLOCK, count - first)
            mine = which[first:]
            gather(n, mine, rows, wide, x, c, base, row, table, lanes)
            for k in range(n_states):
                for e in range(n):
                    lanes[U(_STATES + k) * U(CAPACITY) + U(e)] = memory[rows[mine[e]] - first_row, 1 + k]
            stress(n, small, dt, lanes)
            whole = U(n // 4 * 4)
            for e in range(U(0), whole, _FOUR):
                i0, i1, i2, i3 = U(mine[e]), U(mine[e + _1]), U(mine[e + _2]), U(mine[e + _3])
                put_four_columns(s0, (i0 * _FOUR, i1 * _FOUR, i2 * _FOUR, i3 * _FOUR), lanes, S11 + e)
            for e in range(whole, U(n)):
                for k in range(U(4)):
                    s0[U(mine[e]) * _FOUR + k] = lanes[S11 + k * U(CAPACITY) + e]
            for k in range(n_states):
                for e in range(n):
                    memory[rows[mine[e]] - first_row, 1 + k] = lanes[U(_STATES + k) * U(CAPACITY) + U(e)]

    @njit(nogil=True, error_model="numpy")
    def on_one(threads, *args):
        for t in range(threads):
            run(t, threads, *args)

    @njit(parallel=True, error_model="numpy")
    def on_several(threads, count, which, rows, first_row, wide, x, c, base, row, table, dt, small, memory, s0):
        for t in prange(threads):
            run(t, threads, count, which, rows, first_row, wide, x, c, base, row, table, dt, small, memory, s0)

    return on_one, on_several


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
            found = law(*given(lanes, U(0), (strain[0], strain[1], strain[2], 0.0)))
            for k in range(4 + n_states):
                out[i, k] = found[k]

    return evaluate

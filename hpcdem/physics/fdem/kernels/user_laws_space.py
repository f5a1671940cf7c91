"""Loops over tetrahedra and hexahedra that have a law of the user, before the forces of a step: stress of the law
becomes their stress without strain, and in the table of forces they have no moduli.

A law takes numbers and returns numbers, as in the plane (user_laws.py); its strain is without that of heat. In a
hexahedron the law is that of each of its ten tetrahedra, with the volume strain of its overlay (mixed discretisation,
Marti & Cundall 1982); the five of an overlay then get the mean of their pressures by volume, which is what forces of
that volume do work with. All kernels here are made for one law.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lane_arguments import arguments, storing
from hpcdem.numerics.lanes import CAPACITY, U, lane
from hpcdem.physics.fdem.hexahedra import OVERLAYS
from hpcdem.physics.fdem.kernels import tets
from hpcdem.physics.fdem.kernels.hexes import BLOCK as HEX_BLOCK
from hpcdem.physics.fdem.kernels.hexes import IN_ROW, PARTS, SHARE, WORDS
from hpcdem.physics.fdem.kernels.tets import BLOCK, C11, C12, C13, C21, C22, C23, C31, C32, C33, C, X

STRAIN = ("e11", "e22", "e12", "e33", "e13", "e23")
GIVEN = (*STRAIN, "evol", "dt")
"""Arguments of a law: strain in the frame that turns with the element, less that of heat, its volume strain, time step
[s], 0 in static runs."""
INITIAL = ("i11", "i22", "i12", "i33", "i13", "i23")
"""Initial stress there [Pa]."""
_E, _I, _S, _REST = 48, 54, 60, 66
"""First lanes of strain, initial stress, stress of the law; of what each law has besides."""
_AT_E, _AT_S = lane(_E), lane(_S)
_1, _2, _3, _4, _5 = (lane(k) for k in range(1, 6))
_NORMAL = np.array([0, 1, 3])
_FIVE = PARTS // 2


class Loops(NamedTuple):
    """The kernels of a law, on one thread and on several."""

    tets: Any
    tets_threaded: Any
    hexes: Any
    hexes_threaded: Any


@njit(error_model="numpy")
def strains(n, small, lanes):
    """Strain of n tetrahedra in the frames that turn with them."""
    for e in range(U(n)):
        e11, e22, e12, e33, e13, e23, _ = tets.strain(
            lanes, X + e, lanes[C11 + e], lanes[C12 + e], lanes[C13 + e], lanes[C21 + e], lanes[C22 + e],
            lanes[C23 + e], lanes[C31 + e], lanes[C32 + e], lanes[C33 + e], small,
        )  # fmt: skip
        at = _AT_E + e
        lanes[at], lanes[at + _1], lanes[at + _2], lanes[at + _3] = e11, e22, e12, e33
        lanes[at + _4], lanes[at + _5] = e13, e23


def loops(law: Any, names: Sequence[str], states: Sequence[str], columns: Sequence[str]) -> Loops:
    """The loops over elements of a law, a kernel of the arguments `names`; columns: of the table of properties.

    In all of them: law_of: rows of the flat `table` of properties; thermal (n_own,): strain of heat; small: small
    strains; memory (n_own, 1 + states, with hexahedra 1 + 2 states): what elements remember, from column 1 on, becomes
    that after this moment.
    """
    n_states, n_columns = len(states), len(columns)
    first_state = _REST + n_columns
    size = (first_state + n_states) * CAPACITY
    places = {name: lane(_I + k) for k, name in enumerate(INITIAL)}
    places |= {name: lane(_REST + k) for k, name in enumerate(columns)}
    places |= {name: lane(first_state + k) for k, name in enumerate(states)}
    given, store = arguments(names, GIVEN, places), storing(n_states, 6, first_state)

    @njit(error_model="numpy")
    def evaluate(n, dt, lanes):
        """Stress and states of n elements from their strain."""
        for e in range(U(n)):
            at = _AT_E + e
            e11, e22, e12, e33 = lanes[at], lanes[at + _1], lanes[at + _2], lanes[at + _3]
            values = (e11, e22, e12, e33, lanes[at + _4], lanes[at + _5], e11 + (e22 + e33), dt)
            found = law(*given(lanes, e, values))
            at = _AT_S + e
            lanes[at], lanes[at + _1], lanes[at + _2] = found[0], found[1], found[2]
            lanes[at + _3], lanes[at + _4], lanes[at + _5] = found[3], found[4], found[5]
            store(lanes, e, found)

    @njit(error_model="numpy")
    def of_law(e, row, table, base, lanes):
        """Properties and initial stress of one."""
        for k in range(n_columns):
            lanes[(_REST + k) * CAPACITY + e] = table[row * n_columns + k]
        for k in range(6):
            lanes[(_I + k) * CAPACITY + e] = base[k]

    # ---- tetrahedra ------------------------------------------------------------------------------------------------

    @njit(nogil=True, error_model="numpy")
    def some_tets(t, threads, who, rows, first_row, x, c, base, thermal, law_of, table, dt, small, memory, s0):
        lanes = np.zeros(size)
        blocks = -(-len(who) // BLOCK)
        for b in range(blocks * t // threads, blocks * (t + 1) // threads):
            first = b * BLOCK
            n = min(BLOCK, len(who) - first)
            for e in range(n):
                i = who[first + e]
                for k in range(tets.ROW):
                    lanes[k * CAPACITY + e] = x[rows[i], k]
                for k in range(9):
                    lanes[U(k) * U(CAPACITY) + C + U(e)] = c[i, k]
                of_law(e, law_of[i], table, base[i], lanes)
                for k in range(n_states):
                    lanes[(first_state + k) * CAPACITY + e] = memory[rows[i] - first_row, 1 + k]
            strains(n, small, lanes)
            for e in range(n):
                for k in _NORMAL:
                    lanes[(_E + k) * CAPACITY + e] -= thermal[who[first + e]]
            evaluate(n, dt, lanes)
            for e in range(n):
                i = who[first + e]
                for k in range(6):
                    s0[i, k] = lanes[(_S + k) * CAPACITY + e] + base[i, k]
                for k in range(n_states):
                    memory[rows[i] - first_row, 1 + k] = lanes[(first_state + k) * CAPACITY + e]

    @njit(nogil=True, error_model="numpy")
    def of_tets(threads, *args):
        """who (m,): which of the owned elements; rows (n + 3,): their storage rows, of which the first owned one is
        `first_row`; x (n, 16); c (n + 3, 16); base (n_own, 6) [Pa]: initial stress; s0 (n + 3, 8) [Pa]: becomes the
        stress."""
        for t in range(threads):
            some_tets(t, threads, *args)

    @njit(parallel=True, error_model="numpy")
    def of_tets_threaded(threads, who, rows, first_row, x, c, base, thermal, law_of, table, dt, small, memory, s0):
        for t in prange(threads):
            some_tets(
                t, threads, who, rows, first_row, x, c, base, thermal, law_of, table, dt, small, memory, s0
            )  # fmt: skip

    # ---- hexahedra -------------------------------------------------------------------------------------------------

    @njit(nogil=True, error_model="numpy")
    def some_hexes(
        t, threads, which, begin, place, x, parts, base, thermal, law_of, table, dt, small, memory, s0
    ):  # fmt: skip
        lanes, flat = np.zeros(size), x.reshape(x.size)
        width = (memory.shape[1] - 1) // IN_ROW
        for n in range(len(which) * t // threads, len(which) * (t + 1) // threads):
            i = which[n]
            b, own = i // HEX_BLOCK, i % HEX_BLOCK
            for j in range(PARTS):
                for k in range(4):
                    for m in range(3):
                        lanes[(tets.STRIDE * k + m) * CAPACITY + j] = flat[place[i, OVERLAYS[j, k]] + m]
                for k in range(9):
                    lanes[U(k) * U(CAPACITY) + C + U(j)] = parts[b, j, k, own]
                of_law(j, law_of[i], table, base[begin[i]], lanes)
                for k in range(n_states):
                    at = 1 + (j % IN_ROW) * width + k
                    lanes[(first_state + k) * CAPACITY + j] = memory[begin[i] + j // IN_ROW, at]
            strains(PARTS, small, lanes)
            for overlay in range(2):
                mean = 0.0
                for j in range(_FIVE * overlay, _FIVE * overlay + _FIVE):
                    trace = 0.0
                    for k in _NORMAL:
                        trace += lanes[(_E + k) * CAPACITY + j]
                    lanes[_S * CAPACITY + j] = trace
                    mean += parts[b, j, SHARE, own] * trace
                for j in range(_FIVE * overlay, _FIVE * overlay + _FIVE):
                    more = (mean - lanes[_S * CAPACITY + j]) / 3.0 - thermal[begin[i]]
                    for k in _NORMAL:
                        lanes[(_E + k) * CAPACITY + j] += more
            evaluate(PARTS, dt, lanes)
            for overlay in range(2):
                mean = 0.0
                for j in range(_FIVE * overlay, _FIVE * overlay + _FIVE):
                    for k in _NORMAL:
                        mean += parts[b, j, SHARE, own] * lanes[(_S + k) * CAPACITY + j]
                for j in range(_FIVE * overlay, _FIVE * overlay + _FIVE):
                    apart = mean
                    for k in _NORMAL:
                        apart -= lanes[(_S + k) * CAPACITY + j]
                    for k in range(6):
                        s0[i, j, k] = lanes[(_S + k) * CAPACITY + j] + base[begin[i], k]
                    for k in _NORMAL:
                        s0[i, j, k] += apart / 3.0
                    for k in range(n_states):
                        at = 1 + (j % IN_ROW) * width + k
                        memory[begin[i] + j // IN_ROW, at] = lanes[(first_state + k) * CAPACITY + j]

    @njit(nogil=True, error_model="numpy")
    def of_hexes(threads, *args):
        """which (m,): of the hexahedra; begin (count,): first owned element of each; place, parts: see `hexes.forces`;
        base (n_own, 6) [Pa]; s0 (count + 3, 10, 8) [Pa]: becomes the stress of their tetrahedra."""
        for t in range(threads):
            some_hexes(t, threads, *args)

    @njit(parallel=True, error_model="numpy")
    def of_hexes_threaded(
        threads, which, begin, place, x, parts, base, thermal, law_of, table, dt, small, memory, s0
    ):  # fmt: skip
        for t in prange(threads):
            some_hexes(
                t, threads, which, begin, place, x, parts, base, thermal, law_of, table, dt, small, memory, s0
            )  # fmt: skip

    return Loops(of_tets, of_tets_threaded, of_hexes, of_hexes_threaded)


def try_loops(loops: Loops, n_states: int, threads: int) -> None:
    """Call the kernels of a law with arguments of the types that they will have; no element has it."""
    nobody, rows, x = np.empty(0, np.int64), np.zeros(3, np.int32), np.zeros((0, tets.ROW))
    how = np.zeros((0, 6)), np.zeros(0), nobody, np.zeros(0), 0.0, True, np.zeros((0, 1 + n_states))
    place, parts = np.zeros((3, 8), np.int32), np.zeros((0, PARTS, WORDS, HEX_BLOCK))
    (loops.tets if threads == 1 else loops.tets_threaded)(
        threads, nobody, rows, 0, x, np.zeros((3, tets.TET)), *how, np.zeros((3, tets.STRESSES))
    )
    (loops.hexes if threads == 1 else loops.hexes_threaded)(
        threads, nobody, nobody, place, x, parts, *how, np.zeros((3, PARTS, tets.STRESSES))
    )


def at_strain(law: Any, names: Sequence[str], states: Sequence[str], columns: Sequence[str]) -> Callable[..., Any]:
    """A kernel that evaluates a law at one strain with each row of properties: (table (n, columns), strain (6,),
    initial states (states,), out (n, 6 + states))."""
    n_states, n_columns = len(states), len(columns)
    places = {name: lane(k) for k, name in enumerate(states)}
    places |= {name: lane(n_states + k) for k, name in enumerate(columns)}
    places |= dict.fromkeys(INITIAL, lane(n_states + n_columns))
    given = arguments(names, GIVEN, places)
    size = (n_states + n_columns + 1) * CAPACITY

    @njit(nogil=True, error_model="numpy")
    def evaluate(table, strain, initial, out):
        lanes = np.zeros(size)
        for i in range(len(table)):
            for k in range(n_states):
                lanes[k * CAPACITY] = initial[k]
            for k in range(n_columns):
                lanes[(n_states + k) * CAPACITY] = table[i, k]
            e11, e22, e33 = strain[0], strain[1], strain[3]
            values = (e11, e22, strain[2], e33, strain[4], strain[5], e11 + (e22 + e33), 0.0)
            found = law(*given(lanes, U(0), values))
            for k in range(6 + n_states):
                out[i, k] = found[k]

    return evaluate

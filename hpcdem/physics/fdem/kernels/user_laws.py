"""Laws of users in elements of any kind.

A law takes numbers and returns numbers, so it is evaluated for lanes (numerics/lanes.py), as the built-in ones are. In
an element of several parts (elements/kind.py) the law is that of each part, with the volume strain of its overlay
(mixed discretisation, Marti & Cundall 1982); the parts of an overlay then get the mean of their pressures by volume,
which is what forces of that volume do work with.

`find` does this before the forces of a step: the stress of the law becomes the stress of these elements without strain,
and in the tables of forces they have no moduli. In the plane the loops over forces (elements.py) do it themselves, with
the law in place of the elastic one, for one law of each kind of elements: those with another model go through the same
loop and keep their elastic stress. Both come to the same bits. All kernels here are made for one law; what is compiled
is kept apart from the kernels of hpcdem (runtime/kept.py).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lane_arguments import arguments, storing
from hpcdem.numerics.lanes import CAPACITY, U, four_columns, lane
from hpcdem.numerics.on_threads import OnThreads
from hpcdem.physics.fdem.elements import parts
from hpcdem.physics.fdem.elements.kind import QUAD, TRIANGLE, Kind
from hpcdem.physics.fdem.kernels import elements, tets
from hpcdem.physics.fdem.kernels.elements import BLOCK, LANES, Q_S0, QUAD_LANES, S11, S12, S22, S33

STRAIN = {2: ("e11", "e22", "e12"), 3: ("e11", "e22", "e12", "e33", "e13", "e23")}
"""Arguments of a law, by dimensions: strain in the frame that turns with the element, in space less that of heat."""
GIVEN = {dim: (*strain, "evol", "dt") for dim, strain in STRAIN.items()}
"""Its volume strain besides, e11 + e22, in space e11 + e22 + e33 (of a part: of its overlay, whose sum that is but for
rounding); time step [s], 0 in static runs."""
INITIAL = {2: ("i11", "i22", "i12", "i33"), 3: ("i11", "i22", "i12", "i33", "i13", "i23")}
"""Stress at zero strain there [Pa]."""
OWN = "own"
"""Of the columns of the table of properties: 1 for elements with this law, 0 for others."""
AT_ONCE = 32
"""Parts of elements of which `find` does the law together."""
_1, _2, _3, _FOUR = U(1), U(2), U(3), U(4)
_C, _E, _VOLUME, _I, _S, _REST = 16, 25, 31, 32, 38, 44
"""First lanes of inverse of the reference matrix, strain, its trace, initial stress, stress of the law; of what each
law has besides. Before them corners, four words each."""
_AT_C, _AT_E, _AT_VOLUME = lane(_C), lane(_E), lane(_VOLUME)
_WORD = tuple(lane(k) for k in range(9))
_X2, _X3 = lane(4), lane(8)


class LawTables(NamedTuple):
    """Tables of a user law for the loops over forces.

    some (blocks,) bool: blocks of triangles that contain an element with the law; row (n + 3,) i4: row of each element
    in the flat table of properties `table`; dt [s]; first_row: storage row of the first owned element; memory
    (n_own, 1 + parts states): state variables from column 1 on, `width` columns for each part."""

    some: np.ndarray
    row: np.ndarray
    table: np.ndarray
    dt: float
    first_row: int
    memory: np.ndarray
    width: int


class Loops(NamedTuple):
    """Kernels of a law: they update stress and states (find), or in the plane replace `elements.triangles` and
    `elements.quads`."""

    find: OnThreads
    triangle: OnThreads | None = None
    quad: OnThreads | None = None

    def with_forces(self, kind: Kind) -> Any:
        """Make the loop that replaces the one over the forces of elements of a kind in the plane."""
        return getattr(self, kind.name)


class _Law:
    """A law in lanes: call, a kernel of the arguments `names`, which returns stress and states."""

    def __init__(
        self, call: Any, names: Sequence[str], states: Sequence[str], columns: Sequence[str], dim: int
    ) -> None:
        self.call, self.names, self.states, self.columns, self.dim = call, names, states, columns, dim

    def at(self, columns: int, states: int, initial: Sequence[Any]) -> Any:
        """The kernel (e, values, lanes) by which every loop calls the law: stress of the strain `values`, see `GIVEN`;
        states go into their lanes. columns, states: first lanes of these; initial: lanes of the initial stress."""
        places: Mapping[str, Any] = {
            **dict(zip(INITIAL[self.dim], initial)),
            **{name: lane(columns + k) for k, name in enumerate(self.columns)},
            **{name: lane(states + k) for k, name in enumerate(self.states)},
        }
        law, given = self.call, arguments(self.names, GIVEN[self.dim], places)
        store = storing(len(self.states), len(INITIAL[self.dim]), states)

        @njit(error_model="numpy")
        def evaluate(e, values, lanes):
            found = law(*given(lanes, e, values))
            store(lanes, e, found)
            return found

        return evaluate


def loops(law: Any, names: Sequence[str], states: Sequence[str], columns: Sequence[str], dim: int) -> Loops:
    """The loops over elements of a law, a kernel of the arguments `names`; columns: of the table of properties, a
    multiple of four, one of them `OWN`."""
    one = _Law(law, names, states, columns, dim)
    return Loops(_finding(one)) if dim == 3 else Loops(_finding(one), _triangles(one), _quads(one))


# ---- before the forces ---------------------------------------------------------------------------------------------


@njit(error_model="numpy")
def _strain_of_triangles(n, small, lanes):
    """Strain of parts whose corners and constants are in the lanes, and its trace."""
    for e in range(U(n)):
        c, at = _AT_C + e, _AT_E + e
        _, _, _, _, _, _, e11, e22, e12 = elements._part(
            lanes[e], lanes[_WORD[1] + e], lanes[_X2 + e], lanes[_X2 + _WORD[1] + e], lanes[_X3 + e],
            lanes[_X3 + _WORD[1] + e], lanes[c], lanes[c + _WORD[1]], lanes[c + _WORD[2]], lanes[c + _WORD[3]], small,
        )  # fmt: skip
        lanes[at], lanes[at + _WORD[1]], lanes[at + _WORD[2]], lanes[_AT_VOLUME + e] = e11, e22, e12, e11 + e22


@njit(error_model="numpy")
def _strain_of_tetrahedra(n, small, lanes):
    """Compute the strain of tetrahedra whose corners and constants are in the lanes, and its trace."""
    for e in range(U(n)):
        c, at = _AT_C + e, _AT_E + e
        e11, e22, e12, e33, e13, e23, _ = tets.strain(
            lanes, tets.X + e, lanes[c], lanes[c + _WORD[1]], lanes[c + _WORD[2]], lanes[c + _WORD[3]],
            lanes[c + _WORD[4]], lanes[c + _WORD[5]], lanes[c + _WORD[6]], lanes[c + _WORD[7]], lanes[c + _WORD[8]],
            small,
        )  # fmt: skip
        lanes[at], lanes[at + _WORD[1]], lanes[at + _WORD[2]], lanes[at + _WORD[3]] = e11, e22, e12, e33
        lanes[at + _WORD[4]], lanes[at + _WORD[5]], lanes[_AT_VOLUME + e] = e13, e23, e11 + e22 + e33


@njit(error_model="numpy")
def _share_strain(g, i, first, normal, thermal, lanes):
    """The parts of element i, in the lanes from `first` on, get the mean trace of their overlay, less heat."""
    n, each = parts.count(g), parts.count(g) // parts.overlays(g)
    for begin in range(0, n if each > 1 else 0, each):
        mean = whole = 0.0
        for p in range(begin, begin + each):
            volume = parts.volume(g, i, p)
            mean += volume * lanes[_VOLUME * CAPACITY + first + p]
            whole += volume
        mean /= whole
        for p in range(begin, begin + each):
            more = (mean - lanes[_VOLUME * CAPACITY + first + p]) / len(normal)
            for k in normal:
                lanes[(_E + k) * CAPACITY + first + p] += more
            lanes[_VOLUME * CAPACITY + first + p] = mean
    if thermal != 0.0:
        for p in range(n):
            for k in normal:
                lanes[(_E + k) * CAPACITY + first + p] -= thermal


def _evaluation(one: _Law) -> Any:
    """A kernel that finds stress, into lanes from `_S` on, and states of n parts from their strain."""
    width = len(INITIAL[one.dim])
    put, two, three, four, five = storing(width, 0, _S), *_WORD[2:6]
    evaluate = one.at(_REST, _REST + len(one.columns), [lane(_I + k) for k in range(width)])

    @njit(error_model="numpy")
    def plane(n, dt, lanes):
        for e in range(U(n)):
            at = _AT_E + e
            put(
                lanes,
                e,
                evaluate(e, (lanes[at], lanes[at + _WORD[1]], lanes[at + two], lanes[_AT_VOLUME + e], dt), lanes),
            )

    @njit(error_model="numpy")
    def space(n, dt, lanes):
        for e in range(U(n)):
            at = _AT_E + e
            e11, e22, e33 = lanes[at], lanes[at + _WORD[1]], lanes[at + three]
            rest = lanes[at + four], lanes[at + five], e11 + (e22 + e33), dt
            put(lanes, e, evaluate(e, (e11, e22, lanes[at + two], e33, *rest), lanes))

    return plane if one.dim == 2 else space


def _finding(one: _Law) -> OnThreads:
    """`Loops.find`."""
    n_states, n_columns, width = len(one.states), len(one.columns), len(INITIAL[one.dim])
    first_state = _REST + n_columns
    size = (first_state + n_states) * CAPACITY
    evaluate = _evaluation(one)
    strain = _strain_of_triangles if one.dim == 2 else _strain_of_tetrahedra
    normal, corners, words = ((0, 1), 3, 4) if one.dim == 2 else ((0, 1, 3), 4, 9)
    axes, inverse = one.dim, storing(words, 0, _C)

    @njit(error_model="numpy")
    def take(g, i, first, base, own, row, table, memory, per_part, lanes):
        """Load the data of element i, owned element `own`, into lanes from place `first` on. (Rows are indexed: views
        of them are counted, which takes longer.)"""
        for p in range(parts.count(g)):
            e = first + p
            for k in range(corners):
                at = parts.corner(g, i, parts.end(g, p, k))
                for axis in range(axes):
                    lanes[(tets.STRIDE * k + axis) * CAPACITY + e] = g.x[at + axis]
            inverse(lanes, U(e), parts.inverse(g, i, p))
            for k in range(n_columns):
                lanes[(_REST + k) * CAPACITY + e] = table[row * n_columns + k]
            for k in range(width):
                lanes[(_I + k) * CAPACITY + e] = base[own, k]
            j, at = parts.place(g, i, p, per_part)
            for k in range(n_states):
                lanes[(first_state + k) * CAPACITY + e] = memory[j, 1 + at + k]

    @njit(error_model="numpy")
    def put(g, i, first, base, own, memory, per_part, s0, lanes):
        """Back into their rows."""
        for p in range(parts.count(g)):
            e = first + p
            j, at = parts.place(g, i, p, per_part)
            for k in range(width):
                s0[i, p, k] = lanes[(_S + k) * CAPACITY + e]
            for k in range(n_states):
                memory[j, 1 + at + k] = lanes[(first_state + k) * CAPACITY + e]
        parts.share(g, i, s0)
        for p in range(parts.count(g)):
            for k in range(width):
                s0[i, p, k] += base[own, k]

    @njit(nogil=True, error_model="numpy")
    def some(t, threads, who, g, base, thermal, row, table, dt, small, memory, per_part, s0):
        lanes, n = np.zeros(size), parts.count(g)
        together, end = AT_ONCE // n, len(who) * (t + 1) // threads
        for first in range(len(who) * t // threads, end, together):
            m = min(together, end - first)
            for k in range(m):
                i = who[first + k]
                take(g, i, k * n, base, g.rows[i] - g.first, row[i], table, memory, per_part, lanes)
            strain(m * n, small, lanes)
            for k in range(m if n > 1 or len(thermal) else 0):
                i = who[first + k]
                _share_strain(g, i, k * n, normal, thermal[g.rows[i] - g.first] if len(thermal) else 0.0, lanes)
            evaluate(m * n, dt, lanes)
            for k in range(m):
                i = who[first + k]
                put(g, i, k * n, base, g.rows[i] - g.first, memory, per_part, s0, lanes)

    def find(threads, who, g, *args):
        """who (m,): which elements of g, see `kind.Tables`; base (n_own, 4 or 6) [Pa]: initial stress of owned
        elements; thermal (n_own,): strain of heat, or (0,); row (n,): of the flat table of properties `table`; small:
        small strains; memory (n_own, 1 + parts states): what owned elements remember, `per_part` columns each part from
        column 1 on, becomes that after this moment; s0 (n, parts, 4 or 8) [Pa]: becomes the stress."""
        for t in prange(threads):
            some(t, threads, who, g, *args)

    return OnThreads(find, cache=False)


def at_strain(
    law: Any, names: Sequence[str], states: Sequence[str], columns: Sequence[str], dim: int
) -> Callable[..., Any]:
    """A kernel that evaluates a law at one strain with each row of properties: (table (n, columns), strain (3 or 6,),
    initial states (states,), out (n, 4 or 6 + states))."""
    n_states, n_columns, width = len(states), len(columns), len(INITIAL[dim])
    evaluate, first = _evaluation(_Law(law, names, states, columns, dim)), _REST + n_columns
    size, normal = (first + n_states) * CAPACITY, (0, 1) if dim == 2 else (0, 1, 3)

    @njit(nogil=True, error_model="numpy")
    def at_one(table, strain, initial, out):
        lanes = np.zeros(size)
        for k in range(len(strain)):
            lanes[(_E + k) * CAPACITY] = strain[k]
        for k in normal:
            lanes[_VOLUME * CAPACITY] += strain[k]
        for i in range(len(table)):
            for k in range(n_states):
                lanes[(first + k) * CAPACITY] = initial[k]
            for k in range(n_columns):
                lanes[(_REST + k) * CAPACITY] = table[i, k]
            evaluate(1, 0.0, lanes)
            for k in range(width):
                out[i, k] = lanes[(_S + k) * CAPACITY]
            for k in range(n_states):
                out[i, width + k] = lanes[(first + k) * CAPACITY]

    return at_one


# ---- within the loops over forces of the plane -----------------------------------------------------------------------


def _moving(one: _Law, first: int, kind: Kind) -> tuple[Any, Any]:
    """Kernels that take properties and states of n elements into lanes from `first` on, and put states back: of the row
    of each in storage, of[e] in the table of properties."""
    n_columns, n_states, n_parts = len(one.columns), len(one.states), len(kind.parts)
    lanes_of, behind, own = lane(first), lane(first + n_columns), lane(first + list(one.columns).index(OWN))
    first_state = first + n_columns + 1

    @njit(nogil=True, error_model="numpy")
    def gather(n, of, table, lanes):
        """Properties of n elements; of: their rows of the table, some more behind them. Where all have the row of the
        block before they are there already; the lane behind says which that was."""
        row, same = of[0], True
        for e in range(n):
            same &= of[e] == row
        if same:
            if lanes[behind] != row + 1.0:
                for k in range(U(n_columns)):
                    for e in range(U(BLOCK)):
                        lanes[lanes_of + k * U(CAPACITY) + e] = table[U(row) * U(n_columns) + k]
            lanes[behind] = row + 1.0
            return
        lanes[behind] = 0.0
        width = U(n_columns)
        for e in range(U(0), U(n), _FOUR):
            r0, r1, r2, r3 = U(of[e]) * width, U(of[e + _1]) * width, U(of[e + _2]) * width, U(of[e + _3]) * width
            for k in range(U(0), width, _FOUR):
                four_columns(lanes, lanes_of + k * U(CAPACITY) + e, table, (r0 + k, r1 + k, r2 + k, r3 + k))

    @njit(nogil=True, error_model="numpy")
    def take(n, of, rows, tables, lanes):
        gather(n, of, tables.table, lanes)
        for p in range(n_parts):
            for k in range(n_states):
                at, column = U(first_state + p * n_states + k) * U(CAPACITY), 1 + p * tables.width + k
                for e in range(n):
                    lanes[at + U(e)] = tables.memory[rows[e] - tables.first_row, column]

    @njit(nogil=True, error_model="numpy")
    def put(n, rows, tables, lanes):
        for p in range(n_parts):
            for k in range(n_states):
                at, column = U(first_state + p * n_states + k) * U(CAPACITY), 1 + p * tables.width + k
                for e in range(n):
                    if lanes[own + U(e)] == 1.0:
                        tables.memory[rows[e] - tables.first_row, column] = lanes[at + U(e)]

    return take, put


def _triangles(one: _Law) -> OnThreads:
    """Make the loops that replace `elements.triangles`."""
    first_state, own = LANES + len(one.columns) + 1, lane(LANES + list(one.columns).index(OWN))
    evaluate, (take, put) = one.at(LANES, first_state, (S11, S22, S12, S33)), _moving(one, LANES, TRIANGLE)

    @njit(error_model="numpy")
    def chosen(e, e11, e22, e12, trace, dt, lanes):
        """The law for its elements, elasticity for others."""
        s11, s22, s12, s33 = elements.elastic(e, e11, e22, e12, trace, dt, lanes)
        found = evaluate(e, (e11, e22, e12, trace, dt), lanes)
        has_law = lanes[own + e] == 1.0
        return (
            found[0] if has_law else s11, found[1] if has_law else s22, found[2] if has_law else s12,
            found[3] if has_law else s33,
        )  # fmt: skip

    loop = elements.stress_loop(chosen)

    @njit(nogil=True, error_model="numpy")
    def stress(b, n, first, rows, small, beta, tables, lanes):
        if not tables.some[b]:
            elements.elastic_stress(n, small, beta, 0.0, lanes)
            return
        take(n, tables.row[first:], rows[first:], tables, lanes)
        loop(n, small, beta, tables.dt, lanes)
        put(n, rows[first:], tables, lanes)

    blocks = elements.triangle_blocks(stress, len(one.columns) + 1 + len(one.states))

    def triangles(threads, tables, *args):
        for t in prange(threads):
            blocks(tables, t, threads, *args)

    return OnThreads(triangles, cache=False)


def _quads(one: _Law) -> OnThreads:
    """Make the loops that replace `elements.quads`."""
    n_columns, n_states = len(one.columns), len(one.states)
    own, (take, put) = lane(QUAD_LANES + list(one.columns).index(OWN)), _moving(one, QUAD_LANES, QUAD)
    of_part = [
        one.at(QUAD_LANES, QUAD_LANES + n_columns + 1 + p * n_states, [Q_S0 + lane(4 * p + k) for k in range(4)])
        for p in range(4)
    ]

    def pair(of_first: Any, of_second: Any) -> Any:
        @njit(error_model="numpy")
        def chosen(e, a11, a22, a12, b11, b22, b12, mean, one, two, dt, lanes):
            """Choose the two triangles of an overlay, which share their pressure in the plane: `parts.share`."""
            s11, s22, s12, s33, t11, t22, t12, t33 = elements.elastic_pair(
                e, a11, a22, a12, b11, b22, b12, mean, one, two, dt, lanes
            )
            u = of_first(e, (a11, a22, a12, mean, dt), lanes)
            v = of_second(e, (b11, b22, b12, mean, dt), lanes)
            first, second = u[0] + u[1], v[0] + v[1]
            size = abs(u[0]) + abs(u[1]) + abs(v[0]) + abs(v[1])
            apart = abs(first - second) > 2.0 * parts.SHARED * size
            shared = (one * first + two * second) / (one + two)
            p, q = 0.5 * (shared - first if apart else 0.0), 0.5 * (shared - second if apart else 0.0)
            has_law = lanes[own + e] == 1.0
            return (
                u[0] + p if has_law else s11, u[1] + p if has_law else s22, u[2] if has_law else s12,
                u[3] if has_law else s33, v[0] + q if has_law else t11, v[1] + q if has_law else t22,
                v[2] if has_law else t12, v[3] if has_law else t33,
            )  # fmt: skip

        return chosen

    overlay_0 = elements.overlay_loop(0, pair(of_part[0], of_part[1]))
    overlay_1 = elements.overlay_loop(1, pair(of_part[2], of_part[3]))

    @njit(nogil=True, error_model="numpy")
    def stress(n, item, row, small, beta, tables, lanes):
        take(n, tables.row[item[0] :], row, tables, lanes)
        overlay_0(n, small, beta, tables.dt, lanes)
        overlay_1(n, small, beta, tables.dt, lanes)
        put(n, row, tables, lanes)

    blocks = elements.quad_blocks(stress, n_columns + 1 + 4 * n_states)

    def quads(threads, tables, *args):
        for t in prange(threads):
            blocks(tables, t, threads, *args)

    return OnThreads(quads, cache=False)

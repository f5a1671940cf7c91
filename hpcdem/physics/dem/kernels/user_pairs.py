"""The force loop with user laws: that of pair_forces.py, with other functions instead of the contact law.

There are no bonds in a model with such laws. Pairs that have a built-in one are computed beside, in the same order.
What a contact remembers lies in the memory of its slot, behind a stamp: the number of the last evaluation of forces in
which the discs touched, and behind the point the number of its law. A contact whose stamp is not that of the evaluation
before is a new one; so nothing has to be cleared where discs part, or get another law. All kernels here are made for
the laws of a model and kept apart from those of hpcdem (runtime/kept.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange

from hpcdem.core.fields import MATERIAL, RADIUS, SPIN, VX, VY, X, Y
from hpcdem.numerics.lane_arguments import arguments, storing
from hpcdem.numerics.lanes import CAPACITY, GROUP, U, four_columns, lane, offset
from hpcdem.numerics.on_threads import OnThreads
from hpcdem.physics.dem.kernels import energy, laws
from hpcdem.physics.dem.kernels.contacts import USER
from hpcdem.physics.dem.kernels.pair_forces import (
    DVX,
    DVY,
    ENOUGH,
    FORCE,
    FS,
    LANES,
    MODEL,
    SLOTS,
    WHOLE,
    E,
    collect,
    contact_lanes,
    gather,
    geometry,
    put,
    scatter,
)
from hpcdem.physics.dem.materials import MOST_LAWS

GIVEN = ("u", "fs", "two_rt", "sliding", "approach", "dt")
"""Arguments of a law: overlap [m] of discs that touch, shear force after the step before [N], 2 Rt [m], sliding speed
and speed at which the overlap grows [m/s], time step [s]."""
NORMAL = E
"""Lane of the normal force: that of the modulus of bonds, which these pairs do not have."""


class Kernel(NamedTuple):
    """A law: its kernel and the names of its arguments, its state variables, the columns of properties, a multiple of
    four; its energy function, or None, and the names of its arguments."""

    law: Any
    arguments: tuple[str, ...]
    states: tuple[str, ...]
    columns: tuple[str, ...]
    energy: Any
    of_energy: tuple[str, ...]


class Loops(NamedTuple):
    """Kernels of the laws of a model: the force loop; the sums of energies."""

    forces: OnThreads
    stored: Any
    lost: Any


def loops(of: Sequence[Kernel]) -> Loops:
    """The loops with these laws; pairs with the second have the model USER + 1.

    The force loops take the arguments of pair_forces.forces, then the table of properties (pairs of materials,
    columns), the memory of the slots (m, 1 + states), initial states (laws, states), and the stamp of this evaluation.
    """
    n_states, n_columns = max(len(one.states) for one in of), max(len(one.columns) for one in of)
    first_column = LANES + n_states
    n_lanes = first_column + n_columns
    alone = len(of) == 1
    given, store = _lanes_of(of[0], first_column)
    law, some_lanes = of[0].law, _some_lanes(of, first_column)

    @njit(nogil=True, error_model="numpy")
    def pair(e, slots, ihot, row, partner, n_mat):
        k = U(slots[e])
        return offset(ihot[U(row[k]), MATERIAL] * n_mat + ihot[U(partner[k]), MATERIAL], n_columns)

    @njit(nogil=True, error_model="numpy")
    def gather_own(n, slots, ihot, row, partner, n_mat, table, memory, initial, stamp, lanes):
        for e in range(U(0), U(n), U(GROUP)):
            at0 = pair(e, slots, ihot, row, partner, n_mat)
            at1 = pair(e + U(1), slots, ihot, row, partner, n_mat)
            at2 = pair(e + U(2), slots, ihot, row, partner, n_mat)
            at3 = pair(e + U(3), slots, ihot, row, partner, n_mat)
            for k in range(U(0), U(n_columns), U(4)):
                to = (U(first_column) + k) * U(CAPACITY) + e
                four_columns(lanes, to, table, (at0 + k, at1 + k, at2 + k, at3 + k))
        if n_states > 0:
            for e in range(U(n)):
                k = U(slots[e])
                number = lanes[MODEL + e] - USER
                lasts = memory[k, 0] == (stamp - 1.0) + number / MOST_LAWS
                which = U(max(number, 0.0))
                for s in range(U(n_states)):
                    lanes[(U(LANES) + s) * U(CAPACITY) + e] = memory[k, s + U(1)] if lasts else initial[which, s]

    @njit(nogil=True, error_model="numpy")
    def own_lanes(n, lanes, dt):
        for e in range(U(n)):
            _, nx, ny, u, two_rt, arm_i, arm_j, sliding = geometry(lanes, e)
            approach = 0.0 - (nx * lanes[DVX + e] + ny * lanes[DVY + e])
            found = law(*given(lanes, e, (u, lanes[FS + e], two_rt, sliding, approach, dt)))
            put(lanes, e, found[0], found[1], nx, ny, arm_i, arm_j)
            lanes[NORMAL + e] = found[0]
            store(lanes, e, found)

    @njit(nogil=True, error_model="numpy")
    def mixed_lanes(n, slots, fs, lanes, dt):
        contact_lanes(n, lanes, dt)
        for e in range(U(n)):
            lanes[NORMAL + e] = 0.0
            if lanes[MODEL + e] >= USER:
                lanes[FS + e] = fs[slots[e]]
        some_lanes(n, lanes, dt)

    @njit(nogil=True, error_model="numpy")
    def block(
        t, hot, ihot, cut, lo, hi, poff, foff, ptr, row, partner, fs, bond, u_made, force, pairs, n_mat, dt, table,
        memory, initial, stamp,
    ):  # fmt: skip
        lanes, slots = np.zeros(n_lanes * CAPACITY), np.zeros(CAPACITY, np.int64)
        flat_hot, flat_ihot, flat_pairs = hot.reshape(hot.size), ihot.reshape(ihot.size), pairs.reshape(pairs.size)
        flat, ibits, flat_table = force.reshape(force.size), fs.view(np.int64), table.reshape(table.size)
        first, end = lo[t], cut[t + 1]
        shift = np.int64(foff[t] - first)
        at, stop = ptr[poff[t]], ptr[poff[t] + max(end - first, 0)]
        cleared = first
        n, far = 0, first - 1
        while at < stop or n > 0:
            upto = min(at + SLOTS, stop)
            n, _, far = collect(at, upto, flat_hot, row, partner, bond, ibits, slots, n, np.int64(0), far)
            at = upto
            if n < ENOUGH and at < stop:
                continue
            ready = n // WHOLE * WHOLE if at < stop else n
            for e in range(n, n + GROUP):
                slots[e] = slots[max(n - 1, 0)]  # the last group is filled up with a pair that is there
            gather(
                ready, np.int64(0), slots, flat_hot, flat_ihot, row, partner, ibits, bond, u_made, flat_pairs,
                flat_pairs, False, n_mat, lanes,
            )  # fmt: skip
            own = U(0)
            for e in range(U(ready)):
                own += U(lanes[MODEL + e] >= USER)
            if own > U(0):
                gather_own(ready, slots, ihot, row, partner, n_mat, flat_table, memory, initial, stamp, lanes)
            if alone and own == U(ready):
                own_lanes(ready, lanes, dt)
            else:
                mixed_lanes(ready, slots, fs, lanes, dt)
            for e in range(U(ready)):
                k = U(slots[e])
                u_made[k] = lanes[NORMAL + e]
                number = lanes[MODEL + e] - USER
                memory[k, 0] = stamp + number / MOST_LAWS if number >= 0.0 else 0.0
                for s in range(U(n_states)):
                    memory[k, s + U(1)] = lanes[(U(LANES) + s) * U(CAPACITY) + e]
            for r in range((cleared + shift) * FORCE, (far + 1 + shift) * FORCE):
                flat[r] = 0.0
            cleared = max(cleared, far + 1)
            scatter(ready, slots, row, partner, ibits, lanes, flat, shift)
            for e in range(ready, n):
                slots[e - ready] = slots[e]
            n -= ready
        for r in range((cleared + shift) * FORCE, (hi[t] + shift) * FORCE):
            flat[r] = 0.0

    def forces(
        n_blocks, hot, ihot, cut, lo, hi, poff, foff, ptr, row, partner, fs, bond, u_made, force,
        pairs, bonds, n_mat, dt, spheres, tally, table, memory, initial, stamp,
    ):  # fmt: skip
        for t in prange(n_blocks):
            block(
                t, hot, ihot, cut, lo, hi, poff, foff, ptr, row, partner, fs, bond, u_made, force, pairs, n_mat, dt,
                table, memory, initial, stamp,
            )  # fmt: skip

    return Loops(OnThreads(forces, cache=False), *_sums(of, n_states, n_columns))


def _lanes_of(one: Kernel, first_column: int) -> tuple[Any, Any]:
    """Kernels that find the arguments of a law in the lanes, and put its state variables there."""
    places = {name: lane(LANES + k) for k, name in enumerate(one.states)}
    places |= {name: lane(first_column + k) for k, name in enumerate(one.columns)}
    return arguments(one.arguments, GIVEN, places), storing(len(one.states), 2, LANES)


def _some_lanes(of: Sequence[Kernel], first_column: int) -> Any:
    """A kernel (n, lanes, dt) for those pairs of n that follow one of these laws."""
    if not of:

        @njit(nogil=True, error_model="numpy")
        def nothing(n, lanes, dt):
            return

        return nothing
    before, law, model = _some_lanes(of[:-1], first_column), of[-1].law, USER + len(of) - 1.0
    given, store = _lanes_of(of[-1], first_column)

    @njit(nogil=True, error_model="numpy")
    def some(n, lanes, dt):
        before(n, lanes, dt)
        for e in range(U(n)):
            if lanes[MODEL + e] == model:
                _, nx, ny, u, two_rt, arm_i, arm_j, sliding = geometry(lanes, e)
                approach = 0.0 - (nx * lanes[DVX + e] + ny * lanes[DVY + e])
                found = law(*given(lanes, e, (u, lanes[FS + e], two_rt, sliding, approach, dt)))
                put(lanes, e, found[0], found[1], nx, ny, arm_i, arm_j)
                lanes[NORMAL + e] = found[0]
                store(lanes, e, found)

    return some


def _energies(of: Sequence[Kernel], n_states: int) -> Any:
    """A kernel (law, own, values) of what a contact stores [J] in its normal and shear direction. own: state variables
    and properties of the contact; values: u, fs, two_rt."""
    if not of:

        @njit(nogil=True, error_model="numpy")
        def nothing(which, own, values):
            return 0.0, 0.0

        return nothing
    before, last, number = _energies(of[:-1], n_states), of[-1], len(of) - 1
    if last.energy is None:
        return before
    places = {name: U(k) for k, name in enumerate(last.states)}
    places |= {name: U(n_states + k) for k, name in enumerate(last.columns)}
    function, given = last.energy, arguments(last.of_energy, GIVEN[:3], places)

    @njit(nogil=True, error_model="numpy")
    def of_law(which, own, values):
        return function(*given(own, U(0), values)) if which == number else before(which, own, values)

    return of_law


def _sums(of: Sequence[Kernel], n_states: int, n_columns: int) -> tuple[Any, Any]:
    """Kernels that book what contacts store and lose, beside kernels/energy.py."""
    energies = _energies(of, n_states)

    @njit(nogil=True, error_model="numpy")
    def recall(k, which, stamp, memory, initial, own):
        """State variables of slot k into own; returns whether it remembers them."""
        lasts = memory[k, 0] == stamp + which / MOST_LAWS
        for s in range(n_states):
            own[s] = memory[k, s + 1] if lasts else initial[which, s]
        return lasts

    @njit(nogil=True, error_model="numpy")
    def stored(
        n_blocks, hot, ihot, cut, lo, hi, poff, foff, ptr, partner, fs, pairs, n_mat, table, memory, initial, stamp, out
    ):  # fmt: skip
        own = np.empty(n_states + n_columns)
        for t in range(n_blocks):
            p = poff[t] - lo[t]
            for i in range(cut[t], cut[t + 1]):
                for k in range(ptr[p + i], ptr[p + i + 1]):
                    j = partner[k]
                    q = ihot[i, MATERIAL] * n_mat + ihot[j, MATERIAL]
                    if not pairs[q, 0] >= USER:
                        continue
                    d2, _, _, u, two_rt = laws.pair_geometry(
                        hot[j, X] - hot[i, X], hot[j, Y] - hot[i, Y], hot[i, RADIUS], hot[j, RADIUS]
                    )
                    if d2 <= (hot[i, RADIUS] + hot[j, RADIUS]) ** 2:
                        which = np.int64(pairs[q, 0] - USER)
                        recall(k, which, stamp, memory, initial, own)
                        own[n_states:] = table[q]
                        normal, shear = energies(which, own, (u, fs[k], two_rt))
                        energy.book(out, energy.NORMAL, normal)
                        energy.book(out, energy.SHEAR, shear)

    @njit(nogil=True, error_model="numpy")
    def lost(
        n_blocks, hot, ihot, cut, lo, hi, poff, foff, ptr, partner, fs, pairs, n_mat, table, memory, initial, stamp,
        out, u_made, fs_before, fn_before, memory_before, dt,
    ):  # fmt: skip
        own = np.empty(n_states + n_columns)
        for t in range(n_blocks):
            p = poff[t] - lo[t]
            for i in range(cut[t], cut[t + 1]):
                for k in range(ptr[p + i], ptr[p + i + 1]):
                    j = partner[k]
                    q = ihot[i, MATERIAL] * n_mat + ihot[j, MATERIAL]
                    if not pairs[q, 0] >= USER:
                        continue
                    ri, rj = hot[i, RADIUS], hot[j, RADIUS]
                    dx, dy = hot[j, X] - hot[i, X], hot[j, Y] - hot[i, Y]
                    which = np.int64(pairs[q, 0] - USER)
                    lasts = recall(k, which, stamp - 1.0, memory_before, initial, own)
                    touches = dx * dx + dy * dy <= (ri + rj) * (ri + rj)
                    if not (lasts or touches):
                        continue
                    own[n_states:] = table[q]
                    dvx, dvy = hot[j, VX] - hot[i, VX], hot[j, VY] - hot[i, VY]
                    _, nx, ny, u, two_rt = laws.pair_geometry(dx, dy, ri, rj)
                    _, _, _, u_before, _ = laws.pair_geometry(dx - dvx * dt, dy - dvy * dt, ri, rj)
                    arm_i, arm_j = ri - 0.5 * u, rj - 0.5 * u
                    sliding = laws.sliding_speed(nx, ny, dvx, dvy, hot[i, SPIN], hot[j, SPIN], arm_i, arm_j)
                    work = 0.0
                    u_before, u = max(u_before, 0.0), max(u, 0.0)
                    if lasts or u_before > 0.0:
                        normal, shear = energies(which, own, (u_before, fs_before[k], two_rt))
                        work += normal + shear
                    fn, shear_force = (fn_before[k] if lasts else 0.0), fs_before[k]
                    if touches:
                        recall(k, which, stamp, memory, initial, own)
                        normal, shear = energies(which, own, (u, fs[k], two_rt))
                        work -= normal + shear
                        fn, shear_force = fn + u_made[k], shear_force + fs[k]
                    work += 0.5 * fn * (u - u_before) + 0.5 * shear_force * sliding * dt
                    energy.book(out, energy.LAWS, work)

    return stored, lost

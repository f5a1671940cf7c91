"""The force loop with a law of the user: that of pair_forces.py, with another function in the place of the contact law.

There are no bonds in a model with such a law. Pairs that have a built-in one are computed beside, in the same order.
What a contact remembers lies in the memory of its slot, behind a stamp: the number of the last evaluation of forces in
which the discs touched. A contact whose stamp is not that of the evaluation before is a new one; so nothing has to be
cleared where discs part. All kernels here are made for one law and kept apart from those of hpcdem (runtime/kept.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit, prange

from hpcdem.core.fields import MATERIAL
from hpcdem.numerics.lane_arguments import arguments, storing
from hpcdem.numerics.lanes import CAPACITY, GROUP, U, four_columns, lane, offset
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

GIVEN = ("u", "fs", "two_rt", "sliding", "approach", "dt")
"""Arguments of a law: overlap [m] of discs that touch, shear force after the step before [N], 2 Rt [m], sliding speed
and speed at which the overlap grows [m/s], time step [s]."""
NORMAL = E
"""Lane of the normal force: that of the modulus of bonds, of which there are none."""


def loops(law: Any, names: Sequence[str], states: Sequence[str], columns: Sequence[str]) -> tuple[Any, Any]:
    """The force loop with a law, on one thread and on several.

    law: a kernel of the arguments `names`; columns: of the table of properties of pairs of materials, a multiple of
    four. The loops take the arguments of pair_forces.forces, then that table (pairs of materials, columns), the memory
    of the slots (m, 1 + states), initial states (states,), and the stamp of this evaluation.
    """
    n_states, n_columns = len(states), len(columns)
    first_column = LANES + n_states
    n_lanes = first_column + n_columns
    places = {name: lane(LANES + k) for k, name in enumerate(states)}
    places |= {name: lane(first_column + k) for k, name in enumerate(columns)}
    given, store = arguments(names, GIVEN, places), storing(n_states, 2, LANES)

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
                lasts = memory[k, 0] == stamp - 1.0
                for s in range(U(n_states)):
                    lanes[(U(LANES) + s) * U(CAPACITY) + e] = memory[k, s + U(1)] if lasts else initial[s]

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
            if lanes[MODEL + e] == USER:
                _, nx, ny, u, two_rt, arm_i, arm_j, sliding = geometry(lanes, e)
                approach = 0.0 - (nx * lanes[DVX + e] + ny * lanes[DVY + e])
                found = law(*given(lanes, e, (u, fs[slots[e]], two_rt, sliding, approach, dt)))
                put(lanes, e, found[0], found[1], nx, ny, arm_i, arm_j)
                lanes[NORMAL + e] = found[0]
                store(lanes, e, found)

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
                own += U(lanes[MODEL + e] == USER)
            if own > U(0):
                gather_own(ready, slots, ihot, row, partner, n_mat, flat_table, memory, initial, stamp, lanes)
            if own == U(ready):
                own_lanes(ready, lanes, dt)
            else:
                mixed_lanes(ready, slots, fs, lanes, dt)
            for e in range(U(ready)):
                k = U(slots[e])
                u_made[k] = lanes[NORMAL + e]
                memory[k, 0] = stamp if lanes[MODEL + e] == USER else 0.0
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

    @njit(nogil=True, error_model="numpy")
    def on_one(
        n_blocks, hot, ihot, cut, lo, hi, poff, foff, ptr, row, partner, fs, bond, u_made, force,
        pairs, bonds, n_mat, dt, spheres, tally, table, memory, initial, stamp,
    ):  # fmt: skip
        for t in range(n_blocks):
            block(
                t, hot, ihot, cut, lo, hi, poff, foff, ptr, row, partner, fs, bond, u_made, force, pairs, n_mat, dt,
                table, memory, initial, stamp,
            )  # fmt: skip

    @njit(parallel=True, error_model="numpy")
    def on_several(
        n_blocks, hot, ihot, cut, lo, hi, poff, foff, ptr, row, partner, fs, bond, u_made, force,
        pairs, bonds, n_mat, dt, spheres, tally, table, memory, initial, stamp,
    ):  # fmt: skip
        for t in prange(n_blocks):
            block(
                t, hot, ihot, cut, lo, hi, poff, foff, ptr, row, partner, fs, bond, u_made, force, pairs, n_mat, dt,
                table, memory, initial, stamp,
            )  # fmt: skip

    return on_one, on_several

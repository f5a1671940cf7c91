"""Forces of contacts and bonds: the loop that takes most of the time of a run.

The list is cut into blocks of consecutive rows, one per thread (neighbours.py). A block owns the rows
``cut[t] : cut[t+1]`` of the particle storage and adds to a force array of its own, which also takes what falls on
rows outside the block; those entries are never read. Every owned particle therefore receives the same terms in the
same order whatever the number of blocks and ranks, and no result depends on them.

A block goes through its slots in four passes over a hundred or so pairs at a time, which stay in the first-level
cache:

1. `collect`: which slots are contacts (they touch) or bonds; no jumps, since nobody can guess who touches;
2. `gather`: rows of the two particles and of their laws into lanes (numerics/lanes.py);
3. `contact_lanes` or, where there are bonds, `_bond_lanes`: geometry and laws, in vector instructions;
4. `scatter`: forces to the two particles, in the order of the slots; histories back to the slots.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.core import fields
from hpcdem.numerics.lanes import (
    CAPACITY,
    GROUP,
    U,
    add_in_turn,
    as_bits,
    as_number,
    differences,
    four_columns,
    lane,
    no_farther,
    offset,
    two_columns,
)
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.dem.kernels import laws
from hpcdem.physics.dem.kernels.contacts import LONGEST2, SHEAR_BREAKS, TENSION_BREAKS

SLOTS = 64
"""Number of slots examined between two tests whether a batch is full."""
WHOLE = 8
"""Pairs are worked on in multiples of this, the widest vectors, except the last of a block."""
ENOUGH = CAPACITY - SLOTS - 16
"""Pairs that are worked on together, at least."""

# Lanes. The first four, and MODEL to MU, E to SHEAR, FX to TORQUE_J are filled or read together, in this order.
LANES = 23
(
    DX, DY, DVX, DVY, SPIN_I, RADIUS_I, SPIN_J, RADIUS_J, MODEL, A, B, MU, FX, FY, TORQUE_I, TORQUE_J,
    FS, E, G, TENSILE, SHEAR, U_MADE, FAILURE,
) = (lane(number) for number in range(LANES))  # fmt: skip

_X, _Y, _SPIN, _RADIUS, _MATERIAL = (U(c) for c in (fields.X, fields.Y, fields.SPIN, fields.RADIUS, fields.MATERIAL))
_ONE, _TWO, _THREE, _FOUR = U(1), U(2), U(3), U(4)
_ROW = fields.WIDTH
_LAW = 4
FORCE = 4
"""Width of a row of forces."""


@njit(cache=True, nogil=True, error_model="numpy")
def collect(a, b, hot, row, partner, bond, ibits, slots, n, tied, far):
    """Append the slots among a : b that touch or are bonded to slots[:n]; the others forget their shear force.

    hot: flat rows; ibits: shear forces as int64 bits. Returns (n, whether there is a bond among the collected, largest
    partner row seen).
    """
    n = U(n)
    for k in range(U(a), U(b)):
        i, j = offset(row[k], _ROW), offset(partner[k], _ROW)
        dx = hot[j + _X] - hot[i + _X]
        dy = hot[j + _Y] - hot[i + _Y]
        reach = hot[i + _RADIUS] + hot[j + _RADIUS]
        kind = np.int64(bond[k])
        active = as_number(no_farther(dx * dx + dy * dy, reach * reach) | (-kind >> 63))
        ibits[k] &= active
        slots[n] = k
        n += U(-active)
        tied |= kind
        far = max(far, np.int64(partner[k]))
    return np.int64(n), tied, far


@njit(cache=True, nogil=True, error_model="numpy")
def gather(n, tied, slots, hot, ihot, row, partner, ibits, bond, u_made, pairs, bonds, springs, n_mat, lanes):
    """The rows of the first n pairs into lanes, in groups of four."""
    bits = lanes.view(np.int64)
    for e in range(U(0), U(n), _FOUR):
        k0, k1, k2, k3 = U(slots[e]), U(slots[e + _ONE]), U(slots[e + _TWO]), U(slots[e + _THREE])
        i0, i1, i2, i3 = offset(row[k0], _ROW), offset(row[k1], _ROW), offset(row[k2], _ROW), offset(row[k3], _ROW)
        j0, j1 = offset(partner[k0], _ROW), offset(partner[k1], _ROW)
        j2, j3 = offset(partner[k2], _ROW), offset(partner[k3], _ROW)
        differences(lanes, DX + e, hot, (j0, j1, j2, j3), (i0, i1, i2, i3))
        two_columns(lanes, SPIN_I + e, hot, (i0 + _SPIN, i1 + _SPIN, i2 + _SPIN, i3 + _SPIN))
        two_columns(lanes, SPIN_J + e, hot, (j0 + _SPIN, j1 + _SPIN, j2 + _SPIN, j3 + _SPIN))
        q0 = offset(ihot[i0 + _MATERIAL] * n_mat + ihot[j0 + _MATERIAL], _LAW)
        q1 = offset(ihot[i1 + _MATERIAL] * n_mat + ihot[j1 + _MATERIAL], _LAW)
        q2 = offset(ihot[i2 + _MATERIAL] * n_mat + ihot[j2 + _MATERIAL], _LAW)
        q3 = offset(ihot[i3 + _MATERIAL] * n_mat + ihot[j3 + _MATERIAL], _LAW)
        four_columns(lanes, MODEL + e, pairs, (q0, q1, q2, q3))
        bits[FS + e], bits[FS + e + _ONE] = ibits[k0], ibits[k1]
        bits[FS + e + _TWO], bits[FS + e + _THREE] = ibits[k2], ibits[k3]
        if tied != 0:
            b0, b1, b2, b3 = (
                offset(bond[k0], _LAW), offset(bond[k1], _LAW), offset(bond[k2], _LAW), offset(bond[k3], _LAW),
            )  # fmt: skip
            four_columns(lanes, E + e, bonds, (b0, b1, b2, b3))
            if springs:
                lanes[U_MADE + e], lanes[U_MADE + e + _ONE] = u_made[k0], u_made[k1]
                lanes[U_MADE + e + _TWO], lanes[U_MADE + e + _THREE] = u_made[k2], u_made[k3]


@njit(cache=True, error_model="numpy")
def geometry(lanes, e):
    """laws.pair_geometry of pair e, arms of i and j, sliding speed."""
    ri, rj = lanes[RADIUS_I + e], lanes[RADIUS_J + e]
    d2, nx, ny, u, two_rt = laws.pair_geometry(lanes[DX + e], lanes[DY + e], ri, rj)
    arm_i, arm_j = ri - 0.5 * u, rj - 0.5 * u
    sliding = laws.sliding_speed(
        nx, ny, lanes[DVX + e], lanes[DVY + e], lanes[SPIN_I + e], lanes[SPIN_J + e], arm_i, arm_j
    )
    return d2, nx, ny, u, two_rt, arm_i, arm_j, sliding


@njit(cache=True, error_model="numpy")
def put(lanes, e, fn, fs, nx, ny, arm_i, arm_j):
    """Forces and torques of pair e from its normal and shear force."""
    lanes[FS + e] = fs
    lanes[FX + e] = fs * -ny - fn * nx
    lanes[FY + e] = fs * nx - fn * ny
    lanes[TORQUE_I + e] = fs * arm_i
    lanes[TORQUE_J + e] = fs * arm_j


@njit(cache=True, nogil=True, error_model="numpy")
def contact_lanes(n, lanes, dt):
    """Contact law of n touching pairs."""
    for e in range(U(n)):
        _, nx, ny, u, two_rt, arm_i, arm_j, sliding = geometry(lanes, e)
        fn, ks = laws.contact(lanes[MODEL + e], lanes[A + e], lanes[B + e], two_rt, u)
        fs = laws.coulomb(lanes[FS + e] + ks * sliding * dt, lanes[MU + e] * fn)
        put(lanes, e, fn, fs, nx, ny, arm_i, arm_j)


@njit(cache=True, nogil=True, error_model="numpy")
def _bond_lanes(n, lanes, dt, spheres, springs, longest):
    """Apply the law of n pairs that touch or are bonded or both; FAILURE says which bonds break now.

    springs: there are contact bonds. Returns the larger of `longest` and the longest bonded distance squared, as bits,
    and whether there is any failure.
    """
    bits = lanes.view(np.int64)
    some = np.int64(0)
    for e in range(U(n)):
        d2, nx, ny, u, two_rt, arm_i, arm_j, sliding = geometry(lanes, e)
        model, a, b, mu = lanes[MODEL + e], lanes[A + e], lanes[B + e], lanes[MU + e]
        bonded, elastic = lanes[TENSILE + e] >= 0.0, lanes[E + e] >= 0.0
        area = laws.bond_area(two_rt, spheres)
        length = lanes[RADIUS_I + e] + lanes[RADIUS_J + e]
        # `springs` is the same for all pairs: without contact bonds their law is left out of the loop.
        kind = laws.CONTACT_BOND if springs and not elastic else laws.ELASTIC_BOND
        fn, ks, _, _ = laws.pair_state(
            kind, model, a, b, lanes[E + e], lanes[G + e], two_rt, length, spheres, lanes[U_MADE + e], u
        )
        fs = lanes[FS + e] + ks * sliding * dt
        failure = laws.bond_failure(kind, fn, fs, lanes[TENSILE + e], lanes[SHEAR + e], mu, area)
        failure = failure if bonded else laws.HOLDS
        free = (failure != laws.HOLDS) | (not bonded)
        fn = 0.0 if free and fn < 0.0 else fn
        slips = laws.coulomb(fs, mu * fn)
        put(lanes, e, fn, slips if free else fs + 0.0, nx, ny, arm_i, arm_j)
        bits[FAILURE + e] = failure
        some |= failure
        longest = max(longest, as_bits(d2) if bonded else 0)
    return longest, some


@njit(cache=True, nogil=True, error_model="numpy")
def _break_bonds(n, lanes, slots, row, bond, begin):
    """Carry out the failures of n pairs; returns breaks (in tension, in shear) of pairs whose earlier partner the block
    owns, so that each counts once."""
    bits = lanes.view(np.int64)
    in_tension, in_shear = 0, 0
    for e in range(U(n)):
        failure = bits[FAILURE + e]
        if failure != laws.HOLDS:
            k = slots[e]
            bond[k] = 0
            if row[k] >= begin:
                if failure == laws.BREAKS_IN_TENSION:
                    in_tension += 1
                else:
                    in_shear += 1
    return in_tension, in_shear


@njit(cache=True, nogil=True, error_model="numpy")
def scatter(n, slots, row, partner, ibits, lanes, force, shift):
    """Add the lanes of forces to the rows of a flat force table, pair after pair; put the histories back."""
    bits = lanes.view(np.int64)
    whole = n // GROUP * GROUP
    for e in range(U(0), U(whole), _FOUR):
        k0, k1, k2, k3 = U(slots[e]), U(slots[e + _ONE]), U(slots[e + _TWO]), U(slots[e + _THREE])
        i0, i1 = offset(row[k0] + shift, FORCE), offset(row[k1] + shift, FORCE)
        i2, i3 = offset(row[k2] + shift, FORCE), offset(row[k3] + shift, FORCE)
        j0, j1 = offset(partner[k0] + shift, FORCE), offset(partner[k1] + shift, FORCE)
        j2, j3 = offset(partner[k2] + shift, FORCE), offset(partner[k3] + shift, FORCE)
        add_in_turn(force, (i0, i1, i2, i3), (j0, j1, j2, j3), lanes, FX + e)
        ibits[k0], ibits[k1] = bits[FS + e], bits[FS + e + _ONE]
        ibits[k2], ibits[k3] = bits[FS + e + _TWO], bits[FS + e + _THREE]
    for e in range(U(whole), U(n)):
        k = slots[e]
        i, j = offset(row[k] + shift, FORCE), offset(partner[k] + shift, FORCE)
        force[i] += lanes[FX + e]
        force[i + _ONE] += lanes[FY + e]
        force[i + _TWO] += lanes[TORQUE_I + e]
        force[j] -= lanes[FX + e]
        force[j + _ONE] -= lanes[FY + e]
        force[j + _TWO] += lanes[TORQUE_J + e]
        ibits[k] = bits[FS + e]


@njit(cache=True, nogil=True, error_model="numpy")
def _block(
    t, hot, ihot, cut, lo, hi, poff, foff, ptr, row, partner, fs, bond, u_made, force,
    pairs, bonds, n_mat, dt, spheres, tally,
):  # fmt: skip
    """Forces of block t at the current positions; shear histories move on by dt, bonds may break.

    hot (n, 8) f8 and ihot, the same memory as int64; cut .. foff: neighbours.Blocks; row, partner (m,) i4, fs (m,)
    f8 [N], bond (m,) i4 (row of `bonds`), u_made (m,) f8 [m]; force (k, 4) f8: fx, fy, torque; tables: contacts.py.
    """
    lanes, slots = np.zeros(LANES * CAPACITY), np.zeros(CAPACITY, np.int64)
    table, itable, law_table = hot.reshape(hot.size), ihot.reshape(ihot.size), pairs.reshape(pairs.size)
    bond_table, springs = bonds.reshape(bonds.size), (bonds[1:, 0] < 0.0).any()
    flat, ibits = force.reshape(force.size), fs.view(np.int64)
    first, begin, end = lo[t], cut[t], cut[t + 1]
    shift = np.int64(foff[t] - first)
    at, stop = ptr[poff[t]], ptr[poff[t] + max(end - first, 0)]
    cleared, longest, in_tension, in_shear = first, np.int64(0), 0, 0
    n, tied, far = 0, np.int64(0), first - 1
    while at < stop or n > 0:
        upto = min(at + SLOTS, stop)
        n, tied, far = collect(at, upto, table, row, partner, bond, ibits, slots, n, tied, far)
        at = upto
        if n < ENOUGH and at < stop:
            continue
        ready = n // WHOLE * WHOLE if at < stop else n
        for e in range(n, n + GROUP):
            slots[e] = slots[max(n - 1, 0)]  # the last group is filled up with a pair that is there
        gather(
            ready,
            tied,
            slots,
            table,
            itable,
            row,
            partner,
            ibits,
            bond,
            u_made,
            law_table,
            bond_table,
            springs,
            n_mat,
            lanes,
        )
        if tied == 0:
            contact_lanes(ready, lanes, dt)
        else:
            longest, some = _bond_lanes(ready, lanes, dt, spheres, springs, longest)
            if some != 0:
                broken = _break_bonds(ready, lanes, slots, row, bond, begin)
                in_tension += broken[0]
                in_shear += broken[1]
        for r in range((cleared + shift) * FORCE, (far + 1 + shift) * FORCE):
            flat[r] = 0.0
        cleared = max(cleared, far + 1)
        scatter(ready, slots, row, partner, ibits, lanes, flat, shift)
        for e in range(ready, n):
            slots[e - ready] = slots[e]
        n -= ready
        if n == 0:
            tied = np.int64(0)
    for r in range((cleared + shift) * FORCE, (hi[t] + shift) * FORCE):
        flat[r] = 0.0
    bits = tally.view(np.int64)
    bits[t, LONGEST2] = longest
    tally[t, TENSION_BREAKS] += in_tension
    tally[t, SHEAR_BREAKS] += in_shear


@on_threads
def forces(n_blocks, *args):
    """All blocks, see `_block`."""
    for t in prange(n_blocks):
        _block(t, *args)

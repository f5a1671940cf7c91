"""Creep of tetrahedra after Burgers: what creep.py is in the plane, with its formulas, for the five components of a
deviator: 11, 22, 12, 13, 23 (33 = -11 - 22)."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import CAPACITY, U, lane
from hpcdem.physics.fdem.kernels import creep as plane
from hpcdem.physics.fdem.kernels import tets
from hpcdem.physics.fdem.kernels.creep import KELVIN, LOST, PER_KELVIN, PER_MAXWELL, factors, stress_then
from hpcdem.physics.fdem.kernels.tets import LAMBDA, TWO_MU

C13, C23, K13, K23, S13, S23 = range(plane.MEMORY, plane.MEMORY + 6)
MEMORY = plane.MEMORY + 6
"""Columns of what an element remembers (n, 16): those of the plane, then the two other shear components; lost [J]."""
CREPT = (plane.C11, plane.C22, plane.C12, C13, C23)
IN_KELVIN = (plane.K11, plane.K22, plane.K12, K13, K23)
BEFORE = (plane.S11, plane.S22, plane.S12, S13, S23)
"""Columns of creep strain, strain of the Kelvin unit, stress at the beginning of the creep step, by component."""
PLACES = (0, 1, 2, 4, 5)
"""Columns of the components in tables of stresses, see `tets.STRESSES`."""
_PER = lane(1)


@njit(cache=True, error_model="numpy")
def squares(a):
    """a : a of a deviator."""
    a33 = a[0] + a[1]
    return a[0] * a[0] + a[1] * a[1] + a33 * a33 + 2.0 * (a[2] * a[2] + a[3] * a[3] + a[4] * a[4])


@njit(cache=True, error_model="numpy")
def relieve(two_mu, base, crept, s0):
    """Into s0 (8,) the stress [Pa] of a tetrahedron without strain: base less 2 G_M times its creep strain (5,)."""
    for k in range(5):
        s0[PLACES[k]] = base[PLACES[k]] - two_mu * crept[k]
    s0[3] = base[3] + two_mu * (crept[0] + crept[1])


@njit(cache=True, error_model="numpy", forceinline=True)
def _deviator(a11, a22, a12, a33, a13, a23):
    third = (a11 + (a22 + a33)) / 3.0
    return a11 - third, a22 - third, a12, a13, a23


@njit(cache=True, error_model="numpy")
def _strain(x, c, small, lanes):
    """Strain (11, 22, 12, 33, 13, 23) of a tetrahedron and its frame, by its rows of x and c; lanes: scratch."""
    for k in range(16):
        lanes[tets.X + U(k) * _PER] = x[k]
    return tets.strain(lanes, tets.X, c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], small)


@njit(cache=True, error_model="numpy")
def _per_volume(q):
    return tets.per_volume(q[0], q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8])


@njit(cache=True, error_model="numpy")
def creep_one(x, c, per_volume, base, table, small, dt, keep, memory, s0, lanes, room):
    """Let a tetrahedron creep by its rows of all tables, see `creep`; table (3,): of its model; room (3, 5)."""
    crept, way, both_ends = room[0], room[1], room[2]
    two_mu, per_kelvin = c[TWO_MU], table[PER_KELVIN]
    e11, e22, e12, e33, e13, e23, _ = _strain(x, c, small, lanes)
    e = _deviator(e11, e22, e12, e33, e13, e23)
    b = _deviator(base[0], base[1], base[2], base[3], base[4], base[5])
    back, kelvin, maxwell, div, ratio = factors(dt, two_mu, table[KELVIN], per_kelvin, table[PER_MAXWELL])
    for k in range(5):
        before, stress, old = memory[IN_KELVIN[k]], memory[BEFORE[k]], memory[CREPT[k]]
        both_ends[k] = stress + stress_then(e[k], b[k], old, before, stress, two_mu, back, kelvin + maxwell, div)
        then = ratio * before + both_ends[k] * kelvin
        way[k] = then - before
        crept[k] = old + (way[k] + both_ends[k] * maxwell)
        if keep:
            memory[CREPT[k]], memory[IN_KELVIN[k]] = crept[k], then
            # By its spring, so that asking again at these positions (dt = 0) finds the same bits.
            memory[BEFORE[k]] = b[k] + two_mu * (e[k] - crept[k])
    relieve(two_mu, base, crept, s0)
    if keep and dt > 0.0:
        lost = 0.5 * squares(both_ends) * maxwell
        if per_kelvin > 0.0:
            lost += 2.0 * squares(way) / (per_kelvin * dt)
        memory[LOST] += lost / per_volume


@njit(cache=True, nogil=True, error_model="numpy")
def _creep(t, threads, who, rows, first_row, x, c, base, law, table, small, dt, keep, memory, s0):
    n, lanes, room = len(who), np.zeros(tets.LANES * CAPACITY), np.empty((3, 5))
    for m in range(n * t // threads, n * (t + 1) // threads):
        i = who[m]
        j = rows[i] - first_row
        per = _per_volume(c[i])
        creep_one(x[rows[i]], c[i], per, base[i], table[law[i]], small, dt, keep, memory[j], s0[i], lanes, room)


@njit(cache=True, nogil=True, error_model="numpy")
def creep(threads, *args):
    """Let tetrahedra creep for dt [s], at the end of which they are at the present positions, see `creep.creep`.

    who (m,): which; rows (n + 3,) i4: storage rows of all, of which the first owned one is `first_row`; x (n, 16);
    c (n + 3, 16), see `tets.TET`; base (n, 8) [Pa]: stress without strain and creep; law (n + 3,): row of the table
    (rows, 3) of models, see `creep.LAW`; small: small strains; keep: they remember it; memory (n_own, 16), see
    `MEMORY`; s0 (n + 3, 8) [Pa]: stress without strain now.
    """
    for t in range(threads):
        _creep(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def creep_threaded(threads, who, rows, first_row, x, c, base, law, table, small, dt, keep, memory, s0):
    """The same on several threads."""
    for t in prange(threads):
        _creep(t, threads, who, rows, first_row, x, c, base, law, table, small, dt, keep, memory, s0)


@njit(cache=True, error_model="numpy")
def columns(of, memory, out):
    """Five columns of what a tetrahedron remembers."""
    for k in range(5):
        out[k] = memory[of[k]]


@njit(cache=True, nogil=True, error_model="numpy")
def relieve_all(who, rows, first, c, base, memory, s0):
    """`relieve` for the tetrahedra `who` (m,)."""
    crept = np.empty(5)
    for m in range(len(who)):
        i = who[m]
        columns(CREPT, memory[rows[i] - first], crept)
        relieve(c[i, TWO_MU], base[i], crept, s0[i])


@njit(cache=True, error_model="numpy")
def stored_one(two_mu, base, table, memory, a):
    """What `stored` adds for a tetrahedron by its rows of all tables, per volume [J/m3]; a (5,): room."""
    columns(CREPT, memory, a)
    density = 0.5 * two_mu * squares(a) + base[3] * (a[0] + a[1])
    density -= base[0] * a[0] + base[1] * a[1]
    density -= 2.0 * (base[2] * a[2] + base[4] * a[3] + base[5] * a[4])
    if table[PER_KELVIN] > 0.0:
        columns(IN_KELVIN, memory, a)
        density += table[KELVIN] * squares(a)
    return density


@njit(cache=True, nogil=True, error_model="numpy")
def stored(rows, first, c, base, law, table, memory, out):
    """Add to out (n_own,) what the elastic energy [J] differs by from that of an element with the initial stress s0 =
    base - 2 G_M e_c, and what the springs of the Kelvin units store, see `creep.stored`."""
    a = np.empty(5)
    for i in range(len(rows)):
        j = rows[i] - first
        out[j] += stored_one(c[i, TWO_MU], base[i], table[law[i]], memory[j], a) / _per_volume(c[i])


@njit(cache=True, error_model="numpy")
def strains_one(x, c, small, memory, out, share, lanes, a):
    """Add `share` of what `strains` finds for a tetrahedron by its rows of all tables."""
    _, _, _, _, _, _, r = _strain(x, c, small, lanes)
    for part in range(2):
        columns(IN_KELVIN if part else CREPT, memory, a)
        found = tets.turned(a[0], a[1], a[2], -(a[0] + a[1]), a[3], a[4], r)
        for k in range(6):
            out[6 * part + k] += share * found[k]


@njit(cache=True, nogil=True, error_model="numpy")
def strains(rows, first, x, c, small, memory, out):
    """Creep strain and Kelvin strain, xx, yy, xy, zz, xz, yz each, along the axes of space: added to out (n, 12)."""
    lanes, a = np.zeros(tets.LANES * CAPACITY), np.empty(5)
    for i in range(len(rows)):
        j = rows[i] - first
        strains_one(x[rows[i]], c[i], small, memory[j], out[j], 1.0, lanes, a)


@njit(cache=True, error_model="numpy")
def elastic_one(two_mu, base, table, dt, memory, s0):
    """`as_elastic` for a tetrahedron by its rows of all tables. Returns its 2 mu [Pa]."""
    back, kelvin, maxwell, div, _ = factors(dt, two_mu, table[KELVIN], table[PER_KELVIN], table[PER_MAXWELL])
    mean = (base[0] + base[1] + base[3]) / 3.0
    for k in range(5):
        start = base[PLACES[k]] - (mean if k < 2 else 0.0)
        s0[PLACES[k]] = stress_then(
            0.0, start, memory[CREPT[k]], memory[IN_KELVIN[k]], memory[BEFORE[k]], two_mu, back, kelvin + maxwell, div
        )
    s0[3] = mean - (s0[0] + s0[1])
    s0[0] += mean
    s0[1] += mean
    return 1.0 / div


@njit(cache=True, nogil=True, error_model="numpy")
def as_elastic(who, rows, first, c, base, law, table, dt, memory, like, s0):
    """The elastic element that a tetrahedron is within this creep step: into like (count + 3, 16) its moduli, into s0
    (count + 3, 8) [Pa] its stress without strain, see `creep.as_elastic`; other arguments as for `creep`."""
    for m in range(len(who)):
        i = who[m]
        two_mu = c[i, TWO_MU]
        like[i, TWO_MU] = elastic_one(two_mu, base[i], table[law[i]], dt, memory[rows[i] - first], s0[i])
        like[i, LAMBDA] = c[i, LAMBDA] + (two_mu - like[i, TWO_MU]) / 3.0

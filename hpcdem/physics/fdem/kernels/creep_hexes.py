"""Creep of hexahedra after Burgers: that of creep_tets.py in each of their ten tetrahedra. It changes no volume, so the
pressure that the tetrahedra of an overlay share has no part in it. What they remember is where plastic_hexes.py has it.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import CAPACITY
from hpcdem.physics.fdem.hexahedra import OVERLAYS
from hpcdem.physics.fdem.kernels import creep_tets, hexes, tets
from hpcdem.physics.fdem.kernels.creep_tets import CREPT, MEMORY
from hpcdem.physics.fdem.kernels.hexes import H_LAMBDA, H_TWO_MU, IN_ROW, PARTS, VOLUME
from hpcdem.physics.fdem.kernels.tets import STRIDE


@njit(cache=True, error_model="numpy")
def _memory(begin, j, memory):
    """What tetrahedron j remembers (16,)."""
    o = MEMORY * (j % IN_ROW)
    return memory[begin + j // IN_ROW, o : o + MEMORY]


@njit(cache=True, error_model="numpy")
def _rows(i, j, corners, x, parts, h, xyz, q):
    """Corners (16,) and constants (16,) of tetrahedron j of hexahedron i."""
    hexes.tetrahedron(i, j, parts, h, q)
    for k in range(4):
        at = corners[i, OVERLAYS[j, k]]
        for axis in range(3):
            xyz[STRIDE * k + axis] = x[at + axis]


@njit(cache=True, nogil=True, error_model="numpy")
def _creep(t, threads, who, begin, corners, x, parts, h, base, law, table, small, dt, keep, memory, s0):
    n, lanes, room = len(who), np.zeros(tets.LANES * CAPACITY), np.empty((3, 5))
    x, xyz, q = x.reshape(x.size), np.zeros(tets.ROW), np.zeros(tets.TET)
    for m in range(n * t // threads, n * (t + 1) // threads):
        i = who[m]
        for j in range(PARTS):
            _rows(i, j, corners, x, parts, h, xyz, q)
            per = 2.0 / q[VOLUME]  # each overlay counts half
            creep_tets.creep_one(
                xyz, q, per, base[i, j], table[law[i]], small, dt, keep, _memory(begin[i], j, memory), s0[i, j], lanes,
                room,
            )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def creep(threads, *args):
    """Let the hexahedra `who` (m,) creep, see `creep_tets.creep`.

    begin (count,): the first row of each of memory (n_own, 32); corners, x, parts, h: see `hexes.forces`; base (count +
    3, 10, 8) [Pa]: stress without strain and creep; law (count,): row of the table (rows, 3); s0 (count + 3, 10, 8)
    [Pa]: stress without strain now.
    """
    for t in range(threads):
        _creep(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def creep_threaded(threads, who, begin, corners, x, parts, h, base, law, table, small, dt, keep, memory, s0):
    """The same on several threads."""
    for t in prange(threads):
        _creep(t, threads, who, begin, corners, x, parts, h, base, law, table, small, dt, keep, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def relieve_all(who, begin, h, base, memory, s0):
    """`creep_tets.relieve` for the hexahedra `who` (m,)."""
    crept = np.empty(5)
    for i in who:
        for j in range(PARTS):
            creep_tets.columns(CREPT, _memory(begin[i], j, memory), crept)
            creep_tets.relieve(h[i, H_TWO_MU], base[i, j], crept, s0[i, j])


@njit(cache=True, nogil=True, error_model="numpy")
def stored(which, begin, parts, h, base, law, table, memory, out):
    """`creep_tets.stored` for the hexahedra `which` (n,): added to out (n,) [J]."""
    a, q = np.empty(5), np.zeros(tets.TET)
    for n in range(len(which)):
        i = which[n]
        for j in range(PARTS):
            hexes.tetrahedron(i, j, parts, h, q)
            density = creep_tets.stored_one(h[i, H_TWO_MU], base[i, j], table[law[i]], _memory(begin[i], j, memory), a)
            out[n] += 0.5 * q[VOLUME] * density


@njit(cache=True, nogil=True, error_model="numpy")
def strains(count, begin, corners, x, parts, h, small, memory, out):
    """`creep_tets.strains` of hexahedra, means by volume: into out (count, 12)."""
    lanes, a, x = np.zeros(tets.LANES * CAPACITY), np.empty(5), x.reshape(x.size)
    xyz, q = np.zeros(tets.ROW), np.zeros(tets.TET)
    for i in range(count):
        out[i] = 0.0
        whole = h[i, hexes.H_VOLUME] + h[i, hexes.H_VOLUME + 1]
        for j in range(PARTS):
            _rows(i, j, corners, x, parts, h, xyz, q)
            share = q[VOLUME] / whole
            creep_tets.strains_one(xyz, q, small, _memory(begin[i], j, memory), out[i], share, lanes, a)


@njit(cache=True, nogil=True, error_model="numpy")
def as_elastic(who, begin, h, base, law, table, dt, memory, like, s0):
    """The elastic hexahedron that one is within this creep step, see `creep_tets.as_elastic`: moduli into like (count +
    3, 20)."""
    for i in who:
        two_mu, now = h[i, H_TWO_MU], 0.0
        for j in range(PARTS):
            m = _memory(begin[i], j, memory)
            now = creep_tets.elastic_one(two_mu, base[i, j], table[law[i]], dt, m, s0[i, j])
        like[i, H_TWO_MU] = now
        like[i, H_LAMBDA] = h[i, H_LAMBDA] + (two_mu - now) / 3.0

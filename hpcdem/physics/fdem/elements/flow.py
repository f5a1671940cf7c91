"""Plastic flow of elements, once for all kinds: what plasticity.py does to the stress of a part of an element
(kind.py), where it is remembered, and what follows from it.

Elements go through in blocks. Those of a block are gathered into lanes (numerics/lanes.py) and their trial stresses
found, as in the loop over their forces; those that are outside their yield surface, or may be, are put side by side and
return. In the plane this is `plasticity.plastic_strain`. In space principal stresses and their axes are found by
Jacobi's rotations (Golub & Van Loan, Matrix Computations, 8.5): where two stresses are equal, as on the edges of the
yield surface, the roots of the cubic have lost half of their digits. The plastic strain has the axes of the trial
stress. Most stresses are far inside, which is seen without their axes: with the mean p and r = sqrt(J_2 / 3) the
principal stresses are p + 2 r cos(t), p + 2 r cos(t +- 120 degrees), so that

    f_s <= (N_phi - 1) p + 2 r sqrt(1 + N_phi + N_phi^2) - 2 c sqrt(N_phi),   f_t <= p + 2 r - T.

The trace of the strain of a part is the mean of its overlay; after the flow its parts have, in general, not the same
pressure any more. Their volumes then change, against each other, until they have: by (mean P - P) / (lambda + 2 mu / d)
with P = tr sigma / d, whose mean by volume is zero, so that this does no work. Without it each part alone would have to
follow the dilation of its flow, and the forces would not be those of the elastic energy; FLAC takes the mean of the
stresses for the same reason. This is kept with the plastic strain that stresses depend on, and not counted as such.

-D e_p is added to the initial stress, so that loops over forces are the elastic ones. (In a step quads flow within the
loop over their forces, plastic_quads.py.)
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import CAPACITY, U, four_columns, lane, two_columns
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem.elements import parts
from hpcdem.physics.fdem.elements.kind import HEXAHEDRON, QUAD, TETRAHEDRON, TRIANGLE, Kind
from hpcdem.physics.fdem.elements.parts import _by_kind as by_kind
from hpcdem.physics.fdem.kernels import elements, hexes, laws, plastic_quads, plasticity, strength, tets
from hpcdem.physics.fdem.kernels.plasticity import (
    E11,
    E12,
    E13,
    E22,
    E23,
    E33,
    HOW,
    IN_SHEAR,
    IN_TENSION,
    L_PHI,
    L_STRENGTH,
    L_TENSILE,
    MEMORY,
    MEMORY_IN_SPACE,
    OUTSIDE,
    P11,
    P12,
    P13,
    P22,
    P23,
    P33,
    P_LAM,
    P_MU2,
    P_PHI,
    P_SHEAR,
    P_SHORT,
    P_SIZE,
    P_VOLUME,
    P_WORK,
    S11,
    S12,
    S13,
    S22,
    S23,
    S33,
    SHEAR,
    STRENGTH,
    T11,
    VOLUME,
    WORK,
)
from hpcdem.physics.fdem.kernels.strength import SHEAR_NOW, TENSION_NOW

_LANE = np.int64(CAPACITY)
_1, _2, _3, _4, _8, _12, _16 = (U(k) for k in (1, 2, 3, 4, 8, 12, 16))


def width(kind: Kind) -> int:
    """Columns of what a part remembers."""
    return MEMORY if kind.dim == 2 else MEMORY_IN_SPACE


def _relieve(kind: Kind) -> Any:
    count, wide, space = len(kind.parts), width(kind), kind.dim == 3

    @njit(error_model="numpy", forceinline=True)
    def relieve(g, i, base, memory, s0):
        lame, two_mu, free = parts.moduli(g, i)
        for p in range(count):
            j, o = parts.place(g, i, p, wide)
            s11, s22, s12, s33 = laws.hooke(
                memory[j, o + E11], memory[j, o + E22], memory[j, o + E12], memory[j, o + E33], lame, two_mu, free
            )
            s0[i, p, 0], s0[i, p, 1] = base[i, p, 0] - s11, base[i, p, 1] - s22
            s0[i, p, 2], s0[i, p, 3] = base[i, p, 2] - s12, base[i, p, 3] - s33
            if space:
                s0[i, p, 4] = base[i, p, 4] - two_mu * memory[j, o + E13]
                s0[i, p, 5] = base[i, p, 5] - two_mu * memory[j, o + E23]

    return relieve


relieve = by_kind(_relieve)
"""relieve(g, i, base, memory, s0): into s0 (count, parts, 4 or more) [Pa] the stresses of an element without strain:
base less D e_p."""


@njit(cache=True, nogil=True, error_model="numpy")
def relieve_all(g, count, base, memory, s0):
    """Apply `relieve` to the first elements of g."""
    for i in range(count):
        relieve(g, i, base, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def lay(first, initial, heat, free, s0):
    """Stress without strain (count or more, parts, 4 or more) [Pa] of elements that do not remember: the initial one of
    the owned elements (n_own, 4 or 6), and of heat (n_own,), stress 11, 22, 33, without rows: none; first (count,):
    which of these each is; free: without that across the plane."""
    for i in range(len(first)):
        r = first[i]
        for p in range(s0.shape[1]):
            for k in range(initial.shape[1]):
                s0[i, p, k] = initial[r, k]
            if len(heat):
                s0[i, p, 0], s0[i, p, 1] = s0[i, p, 0] + heat[r], s0[i, p, 1] + heat[r]
                s0[i, p, 3] += heat[r]
            if free:
                s0[i, p, 3] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def weights(g, count, out):
    """`parts.weight` of the first elements of g, into out (count, parts, 1)."""
    for i in range(count):
        for p in range(out.shape[1]):
            out[i, p, 0] = parts.weight(g, i, p)


@njit(cache=True, nogil=True, error_model="numpy")
def renew_all(g, count, law, soft, table):
    """Yield surfaces of those parts that have one of their own, see `strength.renew`; law (count, parts)."""
    for i in range(count):
        for p in range(law.shape[1]):
            if law[i, p] >= soft.first:
                history = parts.memory(g, i, p, soft.history, strength.HISTORY)
                strength.renew(law[i, p], history, soft, table)


def _locked_in(kind: Kind) -> Any:
    count, wide, space = len(kind.parts), width(kind), kind.dim == 3

    @njit(error_model="numpy")
    def locked_in(g, who, base, memory, out):
        for n in range(len(who)):
            i = who[n]
            lame, two_mu, free = parts.moduli(g, i)
            for p in range(count):
                m, b = parts.memory(g, i, p, memory, wide), base[i, p]
                e11, e22, e12, e33 = m[E11], m[E22], m[E12], m[E33] - free * m[E33]
                trace, squares = e11 + e22 + e33, e11 * e11 + e22 * e22 + 2.0 * e12 * e12 + e33 * e33
                own = b[0] * e11 + b[1] * e22 + 2.0 * b[2] * e12 + b[3] * e33
                if space:
                    squares += 2.0 * (m[E13] * m[E13] + m[E23] * m[E23])
                    own += 2.0 * (b[4] * m[E13] + b[5] * m[E23])
                density = 0.5 * (lame * trace * trace + two_mu * squares) - own
                out[n] += parts.weight(g, i, p) * density

    return locked_in


_locked_in_of = by_kind(_locked_in)


@njit(cache=True, nogil=True, error_model="numpy")
def locked_in(g, who, base, memory, out):
    """Add to out (n,) what the elastic energy [J, in the plane J/m] of the elements who (n,) differs by from that of
    some with the initial stress s0: with e = U - 1 it is V [(e - e_p) : D (e - e_p) / 2 + base : (e - e_p)] =
    V [e : D e / 2 + s0 : e] + V [e_p : D e_p / 2 - base : e_p], s0 = base - D e_p."""
    _locked_in_of(g, who, base, memory, out)


# ---- trial stresses ------------------------------------------------------------------------------------------------
# Of each kind: how many elements are worked on together, how many lanes they need, of their own and in the tile (loops
# over one array only become vector loops for certain), `gather`, which brings them there (returning whether any of them
# can yield), and `look`, which finds the trial stresses of an overlay: part j of element e of the block becomes entry j
# block + e of the tile.


def _of_triangles() -> tuple[int, int, int, Any, Any]:
    x1, y1, x2, y2, x3, y3, ca, cb, cc, cd, lam, mu2 = (lane(plasticity.LANES + k) for k in range(12))

    @njit(nogil=True, error_model="numpy")
    def gather(b, n, first, who, g, s0, law, table, lanes, tile):
        rows, x, w, wide = g.rows, g.x, U(g.width), g.c.reshape(g.c.size)
        for e in range(U(0), U(n), _4):
            i = U(first) + e
            r = U(rows[i]) * w, U(rows[i + _1]) * w, U(rows[i + _2]) * w, U(rows[i + _3]) * w
            four_columns(tile, x1 + e, x, r)
            two_columns(tile, x3 + e, x, (r[0] + _4, r[1] + _4, r[2] + _4, r[3] + _4))
            q0 = i * _12
            q = q0, q0 + _12, q0 + U(24), q0 + U(36)
            four_columns(tile, ca + e, wide, q)
            two_columns(tile, lam + e, wide, (q[0] + _4, q[1] + _4, q[2] + _4, q[3] + _4))
            q0 = i * _4
            four_columns(tile, S11 + e, s0, (q0, q0 + _4, q0 + _8, q0 + _12))
            q = U(law[i, 0]) * _4, U(law[i + _1, 0]) * _4, U(law[i + _2, 0]) * _4, U(law[i + _3, 0]) * _4
            four_columns(tile, L_PHI + e, table, q)
        return True

    @njit(nogil=True, error_model="numpy")
    def look(b, n, first, overlay, g, s0, law, table, small, lanes, tile):
        free = g.c[0, elements.FREE]
        for e in range(U(n)):
            x, y = tile[x1 + e], tile[y1 + e]
            ux, uy, wx, wy = tile[x2 + e] - x, tile[y2 + e] - y, tile[x3 + e] - x, tile[y3 + e] - y
            a, b, c, d = tile[ca + e], tile[cb + e], tile[cc + e], tile[cd + e]
            f11, f12, f21, f22 = ux * a + wx * c, ux * b + wx * d, uy * a + wy * c, uy * b + wy * d
            cs, sn = laws.rotation(f11, f12, f21, f22)
            cs, sn = (1.0 if small else cs), (0.0 if small else sn)
            e11, e22, e12 = laws.stretch(f11, f12, f21, f22, cs, sn)
            p, m = tile[lam + e] * (e11 + e22), tile[mu2 + e]
            s11, s22 = tile[S11 + e] + (p + m * e11), tile[S22 + e] + (p + m * e22)
            s12, s33 = tile[S12 + e] + m * e12, tile[S33 + e] + (p - free * p)
            tile[S11 + e], tile[S22 + e], tile[S12 + e], tile[S33 + e] = s11, s22, s12, s33
            tile[OUTSIDE + e] = laws.outside(
                s11, s22, s12, s33, tile[L_PHI + e], tile[L_STRENGTH + e], tile[L_TENSILE + e]
            )  # fmt: skip

    return elements.BLOCK, 0, 12, gather, look


def _of_tetrahedra() -> tuple[int, int, int, Any, Any]:
    x, c, per = lane(plasticity.LANES), lane(plasticity.LANES + 16), lane(1)
    c11, c12, c13, c21, c22, c23, c31, c32, c33 = (c + lane(k) for k in range(9))
    lam, mu2 = c + lane(tets.LAMBDA), c + lane(tets.TWO_MU)

    @njit(nogil=True, error_model="numpy")
    def gather(b, n, first, who, g, s0, law, table, lanes, tile):
        wide = g.c.reshape(g.c.size)
        for e in range(U(0), U(n), _4):
            at = U(first) + e
            i0, i1, i2, i3 = U(who[at]), U(who[at + _1]), U(who[at + _2]), U(who[at + _3])
            r = U(g.rows[i0]) * _16, U(g.rows[i1]) * _16, U(g.rows[i2]) * _16, U(g.rows[i3]) * _16
            q = i0 * _16, i1 * _16, i2 * _16, i3 * _16
            for k in range(_4):
                step = k * _4
                four_columns(tile, x + step * per + e, g.x, (r[0] + step, r[1] + step, r[2] + step, r[3] + step))
                four_columns(tile, c + step * per + e, wide, (q[0] + step, q[1] + step, q[2] + step, q[3] + step))
            q = i0 * _8, i1 * _8, i2 * _8, i3 * _8
            four_columns(tile, S11 + e, s0, q)
            two_columns(tile, S13 + e, s0, (q[0] + _4, q[1] + _4, q[2] + _4, q[3] + _4))
            q = U(law[i0, 0]) * _4, U(law[i1, 0]) * _4, U(law[i2, 0]) * _4, U(law[i3, 0]) * _4
            four_columns(tile, L_PHI + e, table, q)
        return True

    @njit(nogil=True, error_model="numpy")
    def look(b, n, first, overlay, g, s0, law, table, small, lanes, tile):
        for e in range(U(n)):
            e11, e22, e12, e33, e13, e23, _ = tets.strain(
                tile, x + e, tile[c11 + e], tile[c12 + e], tile[c13 + e], tile[c21 + e], tile[c22 + e],
                tile[c23 + e], tile[c31 + e], tile[c32 + e], tile[c33 + e], small,
            )  # fmt: skip
            p, m = tile[lam + e] * (e11 + (e22 + e33)), tile[mu2 + e]
            s11, s22 = tile[S11 + e] + (p + m * e11), tile[S22 + e] + (p + m * e22)
            s33, s12 = tile[S33 + e] + (p + m * e33), tile[S12 + e] + m * e12
            s13, s23 = tile[S13 + e] + m * e13, tile[S23 + e] + m * e23
            tile[S11 + e], tile[S22 + e], tile[S12 + e] = s11, s22, s12
            tile[S33 + e], tile[S13 + e], tile[S23 + e] = s33, s13, s23
            tile[OUTSIDE + e] = plasticity.most_outside(
                s11, s22, s12, s33, s13, s23, tile[L_PHI + e], tile[L_STRENGTH + e], tile[L_TENSILE + e]
            )  # fmt: skip

    return tets.BLOCK, 0, 32, gather, look


def _of_hexahedra() -> tuple[int, int, int, Any, Any]:
    size, count, each, words = hexes.BLOCK, hexes.PARTS, hexes.PARTS // 2, hexes.WORDS * hexes.BLOCK
    eta, shares, pressure = hexes.H + lane(hexes.H_ETA), hexes.SH, hexes.P

    @njit(nogil=True, error_model="numpy")
    def gather(b, n, first, who, g, s0, law, table, lanes, tile):
        some = False
        for i in range(first, first + n):
            for j in range(count):
                some |= table[4 * law[i, j] + STRENGTH] < np.inf
            if some:
                break
        if some:
            hexes.gather(n, first, g.place, g.x, g.x, g.c.reshape(g.c.size), lanes)
            for e in range(U(size)):
                lanes[eta + e] = 0.0
            hexes.relate(n, 0.0, lanes)
        return some

    @njit(nogil=True, error_model="numpy")
    def one(n, to, small, lanes, tile):
        """But for the pressure of strains, of a tetrahedron of each, from place `to` on."""
        for e in range(U(n)):
            r = tets.frame(hexes.slope(hexes.E, e, lanes), small)
            s11, s22, s12, s33, s13, s23, p = hexes.stress(0.0, r, e, lanes)
            lanes[pressure + e] += lanes[shares + e] * p
            tile[S11 + to + e], tile[S22 + to + e], tile[S12 + to + e] = s11, s22, s12
            tile[S33 + to + e], tile[S13 + to + e], tile[S23 + to + e] = s33, s13, s23

    @njit(nogil=True, error_model="numpy")
    def look(b, n, first, overlay, g, s0, law, table, small, lanes, tile):
        flat = g.parts.reshape(g.parts.size)
        for e in range(U(size)):
            lanes[pressure + e] = 0.0
        for k in range(each):
            j = each * overlay + k
            hexes.take(n, j, U((b * count + j) * words), flat, lanes)
            hexes.load(n, first, j, s0, lanes)
            one(n, U(k * size), small, lanes, tile)
        for k in range(each):
            to, j = U(k * size), each * overlay + k
            for e in range(U(0), U(n), _4):
                i = first + np.int64(e)
                at = U(law[i, j]) * _4, U(law[i + 1, j]) * _4, U(law[i + 2, j]) * _4, U(law[i + 3, j]) * _4
                four_columns(tile, L_PHI + to + e, table, at)
            for e in range(U(n)):
                at, p = to + e, lanes[pressure + e]
                s11, s22, s33 = tile[S11 + at] + p, tile[S22 + at] + p, tile[S33 + at] + p
                tile[S11 + at], tile[S22 + at], tile[S33 + at] = s11, s22, s33
                tile[OUTSIDE + at] = plasticity.most_outside(
                    s11, s22, tile[S12 + at], s33, tile[S13 + at], tile[S23 + at], tile[L_PHI + at],
                    tile[L_STRENGTH + at], tile[L_TENSILE + at],
                )  # fmt: skip

    return size, hexes.LANES, 0, gather, look


# ---- the flow of a moment ------------------------------------------------------------------------------------------


@njit(nogil=True, error_model="numpy")
def _all_inside(n, to, tile):
    """Negative if none of n stresses from place `to` on is outside."""
    bits = tile.view(np.int64)
    found = np.int64(-1)
    for e in range(U(n)):
        found &= bits[OUTSIDE + to + e]
    return found


def _pressure(kind: Kind) -> Any:
    @njit(error_model="numpy", forceinline=True)
    def plane(g, j, o, memory, lame, two_mu, free):
        e11, e22, e33 = memory[j, o + E11], memory[j, o + E22], memory[j, o + E33]
        return lame * (e11 + e22 + (e33 - free * e33)) + 0.5 * two_mu * (e11 + e22)

    @njit(error_model="numpy", forceinline=True)
    def space(g, j, o, memory, lame, two_mu, free):
        return (lame + two_mu / 3.0) * (memory[j, o + E11] + (memory[j, o + E22] + memory[j, o + E33]))

    return plane if kind.dim == 2 else space


pressure = by_kind(_pressure)
"""pressure(g, j, o, memory, lame, two_mu, free): mean of the normal stresses [Pa], in the plane of 11 and 22, of a
plastic strain, see `parts.place`."""


def _share(kind: Kind) -> Any:
    each, wide, dim = kind.each, width(kind), float(kind.dim)
    normal = np.array([E11, E22] if kind.dim == 2 else [E11, E22, E33])

    @njit(error_model="numpy")
    def share(g, i, overlay, memory):
        lame, two_mu, free = parts.moduli(g, i)
        mean = whole = 0.0
        for p in range(each * overlay, each * overlay + each):
            volume, (j, o) = parts.volume(g, i, p), parts.place(g, i, p, wide)
            mean += volume * pressure(g, j, o, memory, lame, two_mu, free)
            whole += volume
        mean, per = mean / whole, 1.0 / (dim * lame + two_mu)
        for p in range(each * overlay, each * overlay + each):
            j, o = parts.place(g, i, p, wide)
            more = (mean - pressure(g, j, o, memory, lame, two_mu, free)) * per
            for k in normal:
                memory[j, o + k] += more

    return share


def _flow(kind: Kind) -> Any:
    if kind is QUAD:
        return plastic_quads.flow
    if kind.laws:  # that can only be elastic
        return None
    block, size, more, gather, look = {
        TRIANGLE.name: _of_triangles, TETRAHEDRON.name: _of_tetrahedra, HEXAHEDRON.name: _of_hexahedra,
    }[kind.name]()  # fmt: skip
    each, overlays, wide, space = kind.each, kind.overlays, width(kind), kind.dim == 3
    components, share = len(kind.components), _share(kind)

    @njit(nogil=True, error_model="numpy")
    def choose(n, first, overlay, who, g, tile, which):
        """Collect the parts that are, or may be, outside the yield surface; which (each block,) i8: which they are.
        Returns their number."""
        m = 0
        for j in range(each):
            for e in range(n):
                of, at = U(j * block + e), U(m)
                if tile[OUTSIDE + of] > 0.0:
                    for k in range(U(components)):
                        tile[T11 + k * U(CAPACITY) + at] = tile[S11 + k * U(CAPACITY) + of]
                    for k in range(_4):
                        tile[P_PHI + k * U(CAPACITY) + at] = tile[L_PHI + k * U(CAPACITY) + of]
                    i = who[first + e]
                    lame, two_mu, _ = parts.moduli(g, i)
                    tile[P_LAM + at], tile[P_MU2 + at] = lame, two_mu
                    tile[P_SIZE + at] = parts.weight(g, i, each * overlay + j)
                    which[m] = j * block + e
                    m += 1
        return m

    @njit(nogil=True, error_model="numpy")
    def remember(m, first, overlay, who, g, which, tile, base, law, table, soft, step, memory, s0, flows):
        """Add what has flowed to memory, of elements of one part also to s0; flows (block, overlays) bool: of which
        others some has."""
        for k in range(m):
            at, bits = U(k), np.int64(tile[HOW + U(k)])
            if bits == 0:
                continue
            e, p = which[k] % block, each * overlay + which[k] // block
            i = who[first + e]
            j, o = parts.place(g, i, p, wide)
            memory[j, o + E11] += tile[P11 + at]
            memory[j, o + E22] += tile[P22 + at]
            memory[j, o + E12] += tile[P12 + at]
            memory[j, o + E33] += tile[P33 + at]
            if space:
                memory[j, o + E13] += tile[P13 + at]
                memory[j, o + E23] += tile[P23 + at]
            memory[j, o + SHEAR] += tile[P_SHEAR + at]
            memory[j, o + VOLUME] += tile[P_VOLUME + at]
            if bits & SHEAR_NOW:
                memory[j, o + IN_SHEAR] = step + 1.0
            if bits & TENSION_NOW:
                memory[j, o + IN_TENSION] = step + 1.0
            memory[j, o + WORK] += tile[P_WORK + at]
            if law[i, p] >= soft.first:
                history = parts.memory(g, i, p, soft.history, strength.HISTORY)
                if space:
                    strength.grown(
                        law[i, p], history, bits, tile[P_SHEAR + at], tile[P_VOLUME + at], tile[P_SHORT + at], soft,
                        table,
                    )  # fmt: skip
                else:
                    strength.flowed(
                        law[i, p], history, bits, tile[P11 + at], tile[P22 + at], tile[P12 + at], tile[P33 + at],
                        tile[P_SHEAR + at], tile[P_VOLUME + at], soft, table,
                    )  # fmt: skip
            if each > 1:
                flows[e, overlay] = True
            else:
                relieve(g, i, base, memory, s0)

    @njit(nogil=True, error_model="numpy")
    def work(g, t, threads, count, who, base, law, soft, small, step, memory, s0, table):
        lanes, tile = np.zeros(size * _LANE), np.zeros((plasticity.LANES + more) * _LANE)
        which, flows = np.zeros(each * block, np.int64), np.zeros((block, overlays), np.bool_)
        flat_s0, flat_table = s0.reshape(s0.size), table.reshape(table.size)
        blocks = -(-count // block)
        for b in range(blocks * t // threads, blocks * (t + 1) // threads):
            first = b * block
            n = min(block, count - first)
            if not gather(b, n, first, who, g, flat_s0, law, flat_table, lanes, tile):
                continue
            some = False
            for overlay in range(overlays):
                look(b, n, first, overlay, g, flat_s0, law, flat_table, small, lanes, tile)
                found = np.int64(-1)
                for j in range(each):
                    found &= _all_inside(n, U(j * block), tile)
                if found < 0:
                    continue
                m = choose(n, first, overlay, who, g, tile, which)
                if m == 0:
                    continue
                if space:
                    plasticity.find_axes(m, tile)
                    plasticity.return_in_space(m, tile)
                else:
                    free = parts.moduli(g, who[first])[2]
                    plasticity.return_all(m, free, tile)
                    plasticity.measure(m, free, tile)
                if each > 1 and not some:
                    flows[:] = False
                    some = True
                remember(m, first, overlay, who, g, which, tile, base, law, table, soft, step, memory, s0, flows)
            if some:
                for e in range(n):
                    flowed = False
                    for overlay in range(overlays):
                        if flows[e, overlay]:
                            flowed = True
                            share(g, who[first + e], overlay, memory)
                    if flowed:
                        relieve(g, who[first + e], base, memory, s0)

    return work


_flow_of = by_kind(_flow)


@on_threads
def flows(threads, g, count, who, base, law, soft, *args):
    """Let elements that are outside their yield surface at the present positions flow.

    g: tables of elements (kind.py); count: of them; who (count + 3,): which can yield, of all kinds but tetrahedra all,
    in order; base (.., parts, 4 or 8) [Pa]: initial stress; law (.., parts): row of `table`; soft: see strength.py;
    small: small strains; step: number of this step. They become those after the flow: memory, see plasticity.py; s0
    (.., parts, 4 or 8) [Pa]: stress without strain; table (rows, 4) of yield surfaces, see `plasticity.YIELD`.
    """
    for t in prange(threads):
        _flow_of(g, t, threads, count, who, base, law, soft, *args)

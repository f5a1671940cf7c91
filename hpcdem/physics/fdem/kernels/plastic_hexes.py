"""Plastic flow of hexahedra by mixed discretisation (Marti & Cundall 1982): the return of stresses of plastic_tets.py
in each of their ten tetrahedra, whose trial pressure is that of their overlay (hexes.py).

After the flow the tetrahedra of an overlay have one pressure again, by volumes that change against each other, see
plastic_quads.py: the traces of their plastic strains become the mean by volume. What they remember is in the rows of
the six tetrahedra that store a hexahedron: two of the ten in each of the first five.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import CAPACITY, U, four_columns
from hpcdem.physics.fdem.hexahedra import OVERLAYS
from hpcdem.physics.fdem.kernels import hexes, plastic_tets, strength, tets
from hpcdem.physics.fdem.kernels.hexes import (
    _ETA,
    _LAMBDA,
    _ROWS,
    _TWO_MU,
    BLOCK,
    H_LAMBDA,
    H_TWO_MU,
    H_VOLUME,
    IN_ROW,
    PARTS,
    SH,
    SHARE,
    WORDS,
    E,
    H,
    P,
)
from hpcdem.physics.fdem.kernels.plastic_stiffness import KEPT
from hpcdem.physics.fdem.kernels.plastic_tets import (
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
    OUTSIDE,
    P11,
    P12,
    P13,
    P22,
    P23,
    P33,
    P_LAM,
    P_MU2,
    P_PER,
    P_PHI,
    P_SHEAR,
    P_SHORT,
    P_VOLUME,
    P_WORK,
    SHEAR,
    SHEAR_NOW,
    T11,
    TENSION_NOW,
    VOLUME,
    WORK,
    most_outside,
)
from hpcdem.physics.fdem.kernels.tet_stiffness import gradients, lost_by_flow, strains_along, trial
from hpcdem.physics.fdem.kernels.tets import S11, S12, S13, S22, S23, S33

FIVE = PARTS // 2
_LANE = np.int64(CAPACITY)


@njit(cache=True, nogil=True, error_model="numpy")
def _try(n, to, small, lanes, tile):
    """Trial stress, but for the pressure of strains, of a tetrahedron of each hexahedron, from place `to` on."""
    for e in range(U(n)):
        f = hexes.slope(E, e, lanes)
        r = tets.frame(f, small)
        s11, s22, s12, s33, s13, s23, p = hexes.stress(0.0, r, e, lanes)
        lanes[P + e] += lanes[SH + e] * p
        tile[S11 + to + e], tile[S22 + to + e], tile[S12 + to + e] = s11, s22, s12
        tile[S33 + to + e], tile[S13 + to + e], tile[S23 + to + e] = s33, s13, s23


@njit(cache=True, nogil=True, error_model="numpy")
def _look(n, overlay, first, law, table, lanes, tile):
    """The whole trial stresses of an overlay, and by how much they are outside at most."""
    for k in range(FIVE):
        to = U(k * BLOCK)
        for e in range(U(0), U(n), _ROWS):
            i, j = first + np.int64(e), FIVE * overlay + k
            at = U(law[i, j]) * _ROWS, U(law[i + 1, j]) * _ROWS, U(law[i + 2, j]) * _ROWS, U(law[i + 3, j]) * _ROWS
            four_columns(tile, L_PHI + to + e, table, at)
        for e in range(U(n)):
            at, p = to + e, lanes[P + e]
            s11, s22, s33 = tile[S11 + at] + p, tile[S22 + at] + p, tile[S33 + at] + p
            tile[S11 + at], tile[S22 + at], tile[S33 + at] = s11, s22, s33
            tile[OUTSIDE + at] = most_outside(
                s11, s22, tile[S12 + at], s33, tile[S13 + at], tile[S23 + at], tile[L_PHI + at], tile[L_STRENGTH + at],
                tile[L_TENSILE + at],
            )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(n, overlay, first, yields, parts, h, lanes, tile, which):
    """Those that may be outside, side by side; which (160,) i8: which they are. Returns their number."""
    m = 0
    for k in range(FIVE):
        for e in range(n):
            of, at = U(k * BLOCK + e), U(m)
            i, j = first + e, FIVE * overlay + k
            if not (yields[i] and tile[OUTSIDE + of] > 0.0):
                continue
            for c in range(U(6)):
                tile[T11 + c * U(CAPACITY) + at] = tile[S11 + c * U(CAPACITY) + of]
            for c in range(U(4)):
                tile[P_PHI + c * U(CAPACITY) + at] = tile[L_PHI + c * U(CAPACITY) + of]
            tile[P_LAM + at], tile[P_MU2 + at] = lanes[H + _LAMBDA + U(e)], lanes[H + _TWO_MU + U(e)]
            share = parts[i // BLOCK, j, SHARE, i % BLOCK]
            tile[P_PER + at] = 2.0 / (h[i, H_VOLUME + overlay] * share)  # each overlay counts half
            which[m] = k * BLOCK + e
            m += 1
    return m


@njit(cache=True, error_model="numpy")
def place(j):
    """Which row of its hexahedron remembers tetrahedron j, from which column on, and as which part of that row."""
    return j // IN_ROW, MEMORY * (j % IN_ROW), j % IN_ROW


@njit(cache=True, error_model="numpy")
def relieve(i, row, h, base, memory, s0):
    """Into row i of s0 the stress [Pa] of the tetrahedra of a hexahedron without strain: base less D e_p; row: of its
    memory, the first one."""
    two_mu = h[i, H_TWO_MU]
    for j in range(PARTS):
        more, o, _ = place(j)
        m = memory[row + more]
        e11, e22, e33 = m[o + E11], m[o + E22], m[o + E33]
        pressure = h[i, H_LAMBDA] * (e11 + e22 + e33)
        s0[i, j, 0] = base[i, j, 0] - (pressure + two_mu * e11)
        s0[i, j, 1] = base[i, j, 1] - (pressure + two_mu * e22)
        s0[i, j, 2] = base[i, j, 2] - two_mu * m[o + E12]
        s0[i, j, 3] = base[i, j, 3] - (pressure + two_mu * e33)
        s0[i, j, 4] = base[i, j, 4] - two_mu * m[o + E13]
        s0[i, j, 5] = base[i, j, 5] - two_mu * m[o + E23]


@njit(cache=True, nogil=True, error_model="numpy")
def _remember(m, overlay, first, begin, which, tile, law, table, soft, step, memory, flows):
    """Add what has flowed to memory; flows (32,) bool: hexahedra of which some does."""
    for k in range(m):
        at, bits = U(k), np.int64(tile[HOW + U(k)])
        if bits == 0:
            continue
        e, j = which[k] % BLOCK, FIVE * overlay + which[k] // BLOCK
        i = first + e
        flows[e] = True
        more, o, part = place(j)
        row = begin[i] + more
        memory[row, o + E11] += tile[P11 + at]
        memory[row, o + E22] += tile[P22 + at]
        memory[row, o + E12] += tile[P12 + at]
        memory[row, o + E33] += tile[P33 + at]
        memory[row, o + E13] += tile[P13 + at]
        memory[row, o + E23] += tile[P23 + at]
        memory[row, o + SHEAR] += tile[P_SHEAR + at]
        memory[row, o + VOLUME] += tile[P_VOLUME + at]
        if bits & SHEAR_NOW:
            memory[row, o + IN_SHEAR] = step + 1.0
        if bits & TENSION_NOW:
            memory[row, o + IN_TENSION] = step + 1.0
        memory[row, o + WORK] += tile[P_WORK + at]
        if law[i, j] >= soft.first:
            strength.grown(
                law[i, j], row, part, bits, tile[P_SHEAR + at], tile[P_VOLUME + at], tile[P_SHORT + at], soft, table
            )


@njit(cache=True, error_model="numpy")
def _share(i, overlay, row, parts, memory):
    """The tetrahedra of an overlay get one trace of their plastic strains."""
    mean = 0.0
    for j in range(FIVE * overlay, FIVE * overlay + FIVE):
        more, o, _ = place(j)
        m = memory[row + more]
        mean += parts[i // BLOCK, j, SHARE, i % BLOCK] * (m[o + E11] + (m[o + E22] + m[o + E33]))
    for j in range(FIVE * overlay, FIVE * overlay + FIVE):
        more, o, _ = place(j)
        m = memory[row + more]
        third = (mean - (m[o + E11] + (m[o + E22] + m[o + E33]))) / 3.0
        m[o + E11] += third
        m[o + E22] += third
        m[o + E33] += third


@njit(cache=True, nogil=True, error_model="numpy")
def _flow(
    t, threads, count, begin, corners, x, parts, h, base, law, yields, soft, small, step, memory, s0, table
):  # fmt: skip
    lanes, tile = np.zeros(hexes.LANES * _LANE), np.zeros(plastic_tets.LANES * _LANE)
    which, flows = np.zeros(FIVE * BLOCK, np.int64), np.zeros(BLOCK, np.bool_)
    flat_x, flat_parts, flat_h = x.reshape(x.size), parts.reshape(parts.size), h.reshape(h.size)
    flat_s0, flat_table = s0.reshape(s0.size), table.reshape(table.size)
    blocks = -(-count // BLOCK)
    for b in range(blocks * t // threads, blocks * (t + 1) // threads):
        first = b * BLOCK
        n = min(BLOCK, count - first)
        if not yields[first : first + n].any():
            continue
        hexes.gather(n, first, corners, flat_x, flat_x, flat_h, lanes)
        for e in range(U(BLOCK)):
            lanes[H + _ETA + e] = 0.0
        hexes.relate(n, 0.0, lanes)
        flows[:] = False
        for overlay in range(2):
            for e in range(U(BLOCK)):
                lanes[P + e] = 0.0
            for k in range(FIVE):
                j = FIVE * overlay + k
                hexes.take(n, j, U((b * PARTS + j) * WORDS * BLOCK), flat_parts, lanes)
                hexes.load(n, first, j, flat_s0, lanes)
                _try(n, U(k * BLOCK), small, lanes, tile)
            _look(n, overlay, first, law, flat_table, lanes, tile)
            m = _choose(n, overlay, first, yields, parts, h, lanes, tile, which)
            if m > 0:
                plastic_tets.find_axes(m, tile)
                plastic_tets.return_all(m, tile)
                _remember(m, overlay, first, begin, which, tile, law, table, soft, step, memory, flows)
        for e in range(n):
            if flows[e]:
                for overlay in range(2):
                    _share(first + e, overlay, begin[first + e], parts, memory)
                relieve(first + e, begin[first + e], h, base, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def flows(threads, *args):
    """Let hexahedra that are outside their yield surface at the present positions flow, see `plastic_tets.flows`.

    count: of all; begin (count,): the first row of each of them of memory; corners, x, parts, h: see `hexes.forces`;
    base (count + 3, 10, 8) [Pa]: initial stress; law (count + 3, 10) i4: row of `table`; yields (count,) bool: which
    can. They become those after the flow: memory (n_own, 22), s0 (count + 3, 10, 8) [Pa], table (rows, 4).
    """
    for t in range(threads):
        _flow(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def flows_threaded(
    threads, count, begin, corners, x, parts, h, base, law, yields, soft, small, step, memory, s0, table
):  # fmt: skip
    """The same on several threads."""
    for t in prange(threads):
        _flow(
            t, threads, count, begin, corners, x, parts, h, base, law, yields, soft, small, step, memory, s0, table
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def relieve_all(count, begin, h, base, memory, s0):
    """`relieve` for all of them; arguments as for `flows`."""
    for i in range(count):
        relieve(i, begin[i], h, base, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def renew_all(count, begin, law, soft, table):
    """Yield surfaces of those that have one of their own, see `strength.renew`."""
    for i in range(count):
        for j in range(PARTS):
            if law[i, j] >= soft.first:
                more, _, part = place(j)
                strength.renew(law[i, j], begin[i] + more, part, soft, table)


@njit(cache=True, nogil=True, error_model="numpy")
def locked_in(which, begin, parts, h, base, memory, out):
    """Add to out (n,) what the elastic energy [J] of the hexahedra `which` (n,) differs by from that of some with the
    initial stress s0, see `plasticity.locked_in`."""
    for n in range(len(which)):
        i = which[n]
        for j in range(PARTS):
            more, o, _ = place(j)
            m, b = memory[begin[i] + more], base[i, j]
            e11, e22, e12, e33, e13, e23 = m[o + E11], m[o + E22], m[o + E12], m[o + E33], m[o + E13], m[o + E23]
            trace = e11 + e22 + e33
            squares = e11 * e11 + e22 * e22 + e33 * e33 + 2.0 * (e12 * e12 + e13 * e13 + e23 * e23)
            own = b[0] * e11 + b[1] * e22 + b[3] * e33 + 2.0 * (b[2] * e12 + b[4] * e13 + b[5] * e23)
            stored = 0.5 * (h[i, H_LAMBDA] * trace * trace + h[i, H_TWO_MU] * squares) - own
            out[n] += 0.5 * h[i, H_VOLUME + j // FIVE] * parts[i // BLOCK, j, SHARE, i % BLOCK] * stored


@njit(cache=True, nogil=True, error_model="numpy")
def trials(which, corners, x, parts, h, s0, small, stress, turn):
    """Trial stresses (n, 10, 3, 3) [Pa] of the tetrahedra of the hexahedra `which` (n,) in the frames that turn with
    them, and these frames (n, 10, 3, 3); other arguments as for `flows`."""
    rows, constants, traces = np.zeros((PARTS, tets.ROW)), np.zeros((PARTS, tets.TET)), np.empty(PARTS)
    lanes, s = np.zeros(tets.LANES * _LANE), np.empty(6)
    for n in range(len(which)):
        i = which[n]
        mean = hexes.traces_of(i, corners, x, parts, h, small, rows, constants, traces, lanes)
        for j in range(PARTS):
            r = trial(rows[j], constants[j], s0[i, j], small, lanes, s)
            more = (h[i, H_LAMBDA] + h[i, H_TWO_MU] / 3.0) * (mean[j // FIVE] - traces[j])
            for k in range(9):
                turn[n, j, k // 3, k % 3] = r[k]
            stress[n, j, 0, 0], stress[n, j, 1, 1], stress[n, j, 2, 2] = s[0] + more, s[1] + more, s[3] + more
            stress[n, j, 0, 1] = stress[n, j, 1, 0] = s[2]
            stress[n, j, 0, 2] = stress[n, j, 2, 0] = s[4]
            stress[n, j, 1, 2] = stress[n, j, 2, 1] = s[5]


@njit(cache=True, nogil=True, error_model="numpy")
def soften(which, corners, x, parts, h, principal, axes, law, table, small, out):
    """Take from the stiffness out (n, 24, 24) of the hexahedra `which` (n,) what their flow takes, see
    `tet_stiffness.plastic`: of tetrahedra with the volume strain of their overlay. principal (n, 10, 3), axes (n, 10,
    3, 3)."""
    rows, constants, traces = np.zeros((PARTS, tets.ROW)), np.zeros((PARTS, tets.TET)), np.empty(PARTS)
    lanes, g, mean = np.zeros(tets.LANES * _LANE), np.empty((4, 3)), np.empty(24)
    slope, lost, b, all_b = np.empty((3, 3)), np.empty((6, 6)), np.empty((6, 12)), np.empty((6, 24))
    for n in range(len(which)):
        i = which[n]
        hexes.traces_of(i, corners, x, parts, h, small, rows, constants, traces, lanes)
        for overlay in range(2):
            mean[:] = 0.0
            whole = 0.0
            for j in range(FIVE * overlay, FIVE * overlay + FIVE):
                volume = gradients(rows[j], constants[j], small, g)
                whole += volume
                for a in range(4):
                    for axis in range(3):
                        mean[3 * OVERLAYS[j, a] + axis] += volume * g[a, axis]
            for j in range(FIVE * overlay, FIVE * overlay + FIVE):
                if not lost_by_flow(
                    principal[n, j], table[law[i, j]], h[i, H_LAMBDA], h[i, H_TWO_MU], slope, lost
                ):  # fmt: skip
                    continue
                volume = 0.5 * (1.0 - KEPT) * gradients(rows[j], constants[j], small, g)
                strains_along(g, axes[n, j], b)
                all_b[:] = 0.0
                for p in range(3):
                    for m in range(24):
                        all_b[p, m] = mean[m] / (3.0 * whole)
                for a in range(4):
                    for axis in range(3):
                        for p in range(6):
                            more = b[p, 3 * a + axis] - (g[a, axis] / 3.0 if p < 3 else 0.0)
                            all_b[p, 3 * OVERLAYS[j, a] + axis] += more
                for m in range(24):
                    for p in range(6):
                        part = 0.0
                        for q in range(6):
                            part += all_b[q, m] * lost[q, p]
                        part *= volume
                        for k in range(24):
                            out[n, m, k] -= part * all_b[p, k]

"""Plastic flow after Mohr and Coulomb with a tension cut-off: where stresses outside the yield surface return to.

Principal stresses s1 <= s2 <= s3 (tension positive; in plane strain the one out of the plane is among them),
N_a = (1 + sin a) / (1 - sin a), friction angle phi, dilation angle psi, cohesion c, tensile strength T <= c / tan(phi):

    shear     f_s = -s1 + N_phi s3 - 2 c sqrt(N_phi) <= 0,   potential g_s = -s1 + N_psi s3
    tension   f_t = s3 - T <= 0,                             potential g_t = s3

The plastic strain of a step is that of Koiter: a sum of l dg/ds, l >= 0, over the surfaces that are active at its end;
the stress is the trial stress less D times it, D with a = K + 4 G / 3 on the diagonal and b = K - 2 G / 3 beside it. By
symmetry f_s also holds for the pairs (s2, s3), (s1, s2), and f_t for s2, s1. So the end lies in one of

- the plane f_s: l = f_s / p, p = a - b N_psi - b N_phi + a N_phi N_psi;
- its edge s1 = s2: pairs (s1, s3) and (s2, s3) active, [p q; q p] l = f, q = p - (a - b);
- its edge s2 = s3: pairs (s1, s3) and (s1, s2), q = p - N_phi N_psi (a - b);
- the plane s3 = T, its edge s2 = s3 = T, its corner s1 = s2 = s3 = T;
- the line of both planes, s3 = T, s1 = N_phi T - 2 c sqrt(N_phi), and its two ends s2 = s1 and s2 = s3.

They are tried in this order. Where two planes meet the matrix of their multipliers has positive principal minors (both
planes: a^2 - b^2), so that there is one answer (Cottle, Pang & Stone 1992, theorem 3.3.7). The plastic work is not
negative as long as psi <= phi. Formulas of the planes: Itasca, FLAC; of edges and corners: Clausen, Damkilde & Andersen
2007 (Computers & Structures 85, 1795).

In plane stress the third principal stress is held at 0 and the strain across the plane is what it takes. Of the two in
the plane, l <= h, the six planes leave a polygon; their parts in the plane of D dg/ds have a' = lambda' + 2 G and b' =
lambda' (moduli.py) in the place of a and b:

    h, l > 0    h <= t = min(T, 2 c sqrt(N_phi) / N_phi)  (tension, or shear with the stress 0 as the low one)
    l < 0 < h   N_phi h - l <= 2 c sqrt(N_phi)
    h, l < 0    -l <= 2 c sqrt(N_phi)                      (shear with the stress 0 as the high one)

The end lies on the side of one of them, or at a corner: h = l = t, h = l = -2 c sqrt(N_phi), (h, l) = (t, N_phi t -
2 c sqrt(N_phi)) or (0, -2 c sqrt(N_phi)), where two flow (principal minors: a'^2 - b'^2, N_phi N_psi (a'^2 - b'^2), so
one answer again). The strain across the plane has no stiffness: only what flows in the plane is taken from the stress.

Strains are split in the frame that turns with the element: sigma = sigma_0 + D (U - 1 - e_p), where e_p is the plastic
strain. This is incremental (e_p depends on the way), objective for rotations of any size (the rate is that of Green and
Naghdi), and as long as nothing yields the very formula of an elastic element. -D e_p is added to the initial stress,
so the loop over triangles is the elastic one.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import CAPACITY, U, four_columns, lane, two_columns
from hpcdem.physics.fdem.kernels import laws, strength
from hpcdem.physics.fdem.kernels.elements import BLOCK, FREE, LAMBDA, TWO_MU
from hpcdem.physics.fdem.kernels.strength import SHEAR_NOW, TENSION_NOW

SHEAR_PAST, TENSION_PAST = 4, 8
"""Bits of the state of an element, besides SHEAR_NOW, TENSION_NOW."""

# Columns of the table of element models (rows, 4): N_phi, N_psi, 2 c sqrt(N_phi) [Pa], tensile strength [Pa]; infinite
# strength: this model does not yield.
N_PHI, N_PSI, STRENGTH, TENSILE = range(4)
YIELD = 4
# Columns of what an element remembers (n, 9), or (n, 36) where there are quads: for each of their four triangles
# (plastic_quads.py), triangles have the first nine; plastic strain 11, 22, 12, 33 in the frame that turns with it;
# shear and volume of the plastic strain along the way; 1 + the last step in which it yielded in shear, in tension (0:
# never); plastic work [J/m].
E11, E22, E12, E33, SHEAR, VOLUME, IN_SHEAR, IN_TENSION, WORK = range(9)
MEMORY = 9

(
    X1, Y1, X2, Y2, X3, Y3, CA, CB, CC, CD, LAM, MU2, S11, S22, S12, S33, L_PHI, L_PSI, L_STRENGTH, L_TENSILE, OUTSIDE,
    T11, T22, T12, T33, P_PHI, P_PSI, P_STRENGTH, P_TENSILE, P_LAM, P_MU2, P_PER_AREA,
    P11, P22, P12, P33, HOW, P_SHEAR, P_VOLUME, P_WORK,
) = (lane(k) for k in range(40))  # fmt: skip
"""Of all triangles of a block; then of those that are outside: trial stress, law, moduli, 1 / area; what flows."""
LANES = 40
_1, _2, _3, _FOUR, _TWELVE = U(1), U(2), U(3), U(4), U(12)


@njit(cache=True, error_model="numpy", forceinline=True)
def principal_return(s1, s2, s3, n, m, k, t, a, b):
    """Where the principal stresses s1 <= s2 <= s3 [Pa] return to, in this order, and SHEAR_NOW | TENSION_NOW, a float.

    n, m: N_phi, N_psi; k = 2 c sqrt(N_phi); t: tensile strength, at most k / (n - 1); a = K + 4 G / 3, b = K - 2 G / 3
    [Pa]. Without jumps, so that loops over lanes become vector loops: every end is computed, and one is chosen.
    """
    shear, tension = n * s3 - s1 - k, s3 - t
    p = a - b * m - b * n + a * n * m
    along, aside, back = a - b * m, b * (1.0 - m), a * m - b
    one = shear / p
    r1, r2, r3 = s1 + one * along, s2 + one * aside, s3 - one * back
    # the edges s1 = s2 and s2 = s3 of the plane f_s
    e3 = s3 - (shear + (n * s3 - s2 - k)) / (p + (p - (a - b))) * back
    e1 = n * e3 - k
    g1 = s1 + (shear + (n * s2 - s1 - k)) / (p + (p - n * m * (a - b))) * along
    g3 = (g1 + k) / n
    low_edge, high_edge = r1 > r2, r2 > r3
    r1 = e1 if low_edge else (g1 if high_edge else r1)
    r2 = e1 if low_edge else (g3 if high_edge else r2)
    r3 = e3 if low_edge else (g3 if high_edge else r3)
    # the plane s3 = T, its edge and its corner
    low = n * t - k
    t1, t2 = s1 - b * (tension / a), s2 - b * (tension / a)
    edge = t2 > t
    t1 = s1 - b * ((tension + (s2 - t)) / (a + b)) if edge else t1
    t2 = t if edge else t2
    t1 = t if t1 > t else t1
    # both planes, and the ends of their line
    det = a * a - b * b
    one, two = (a * shear - (n * a - b) * tension) / det, (p * tension - back * shear) / det
    b2 = min(max(s2 + one * aside - two * b, low), t)
    in_shear, in_tension = (shear > 0.0) & (r3 <= t), (tension > 0.0) & (t1 >= low)
    r1 = r1 if in_shear else (t1 if in_tension else low)
    r2 = r2 if in_shear else (t2 if in_tension else b2)
    r3 = r3 if in_shear else t
    how = 1.0 if in_shear else (2.0 if in_tension else 3.0)
    outside = (shear > 0.0) | (tension > 0.0)
    return r1 if outside else s1, r2 if outside else s2, r3 if outside else s3, how if outside else 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def plastic_strain(s11, s22, s12, s33, n, m, k, t, lame, two_mu):
    """Plastic strain (11, 22, 12, 33) that brings a trial stress [Pa] back, and SHEAR_NOW | TENSION_NOW, a float; zero,
    and 0, for a stress that is not outside. lame, two_mu: moduli [Pa]; others see `principal_return`."""
    mean, half = 0.5 * (s11 + s22), 0.5 * (s11 - s22)
    radius = math.sqrt(half * half + s12 * s12)
    high, low = mean + radius, mean - radius
    above, below = s33 > high, s33 < low
    s1, s3 = (s33 if below else low), (s33 if above else high)
    s2 = high if above else (low if below else s33)
    r1, r2, r3, how = principal_return(s1, s2, s3, n, m, k, t, lame + two_mu, lame)
    r_low, r_high, r33 = (r2 if below else r1), (r2 if above else r3), (r3 if above else (r1 if below else r2))
    d_high, d_low, d33 = high - r_high, low - r_low, s33 - r33
    common = lame / (3.0 * lame + two_mu) * (d_high + d_low + d33)
    per = 1.0 / two_mu
    e_mean = (0.5 * (d_high + d_low) - common) * per
    along = 0.5 * (d_high - d_low) * per / radius if radius > 0.0 else 0.0  # else both are equal
    e11, e22, e12, e33 = e_mean + along * half, e_mean - along * half, along * s12, (d33 - common) * per
    flows = how > 0.0
    return e11 if flows else 0.0, e22 if flows else 0.0, e12 if flows else 0.0, e33 if flows else 0.0, how


SIDE, HIGH, LOW, HIGH_CORNER, LOW_CORNER = 1.0, 2.0, 3.0, 4.0, 5.0
"""Where a stress returns to in plane stress: the side between the stresses of either sign, those of the high and of the
low one (with the corner of equal stresses), and the corners between them."""


@njit(cache=True, error_model="numpy", forceinline=True)
def plane_stress_return(low, high, n, m, k, t, a, b):
    """Where the principal stresses of the plane low <= high [Pa] return to in plane stress, low and high, and to which
    part (0: they are inside); t: at most k / n; a = lambda' + 2 G, b = lambda'; others see `principal_return`."""
    shear, p = n * high - low - k, a - b * m - b * n + a * n * m
    one, end = shear / p, n * t - k
    r_low, r_high = low + one * (a - b * m), high - one * (a * m - b)
    under, over = low - b * ((high - t) / a), high + b * ((-k - low) / a)
    of_high, of_low = (high > t) & (under >= end), (low < -k) & (over <= 0.0)
    side = (shear > 0.0) & (r_high >= 0.0) & (r_high <= t)
    corner = HIGH_CORNER if r_high > t else LOW_CORNER
    where = HIGH if of_high else (LOW if of_low else (SIDE if side else corner))
    outside = (shear > 0.0) | (high > t) | (low < -k)
    c_low, c_high = (end if r_high > t else -k), (t if r_high > t else 0.0)
    r_low = min(under, t) if of_high else (-k if of_low else (r_low if side else c_low))
    r_high = t if of_high else (max(over, -k) if of_low else (r_high if side else c_high))
    return r_low if outside else low, r_high if outside else high, where if outside else 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def plane_stress_strain(s11, s22, s12, s33, n, m, k, t, lame, two_mu):
    """`plastic_strain` in plane stress; lame: lambda'. The strain 33 is that of the flow."""
    mean, half = 0.5 * (s11 + s22), 0.5 * (s11 - s22)
    radius = math.sqrt(half * half + s12 * s12)
    high, low = mean + radius, mean - radius
    sheared = k / n < t
    r_low, r_high, where = plane_stress_return(low, high, n, m, k, k / n if sheared else t, lame + two_mu, lame)
    d_high, d_low, per = high - r_high, low - r_low, 1.0 / two_mu
    common = lame / (2.0 * lame + two_mu) * (d_high + d_low)
    e_mean, e_half = (0.5 * (d_high + d_low) - common) * per, 0.5 * (d_high - d_low) * per
    along = e_half / radius if radius > 0.0 else 0.0
    # Of h and l what is not of the side between them, with m e33 = -that of h in shear, e33 = -m that of l.
    e_high, e_low = e_mean + e_half, e_mean - e_half
    of_high = e_high + e_low if where == HIGH else e_high + m * e_low
    of_low = e_high + e_low if where == LOW else e_low + e_high / m
    e33 = -of_high / m if sheared & ((where == HIGH) | (where == HIGH_CORNER)) else 0.0
    e33 = -m * of_low if (where == LOW) | (where == LOW_CORNER) else e33
    in_tension = (where == HIGH) & (not sheared)
    how = 2.0 if in_tension else (3.0 if (where == HIGH_CORNER) & (not sheared) else 1.0)
    flows = where > 0.0
    return (
        e_mean + along * half if flows else 0.0, e_mean - along * half if flows else 0.0, along * s12 if flows else 0.0,
        e33 if flows else 0.0, how if flows else 0.0,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def relieve(i, j, c, base, memory, s0):
    """Into row i of s0 the stress [Pa] of a triangle without strain: its initial stress less D e_p; j: its row of
    memory."""
    e11, e22, e12, e33 = memory[j, E11], memory[j, E22], memory[j, E12], memory[j, E33]
    s11, s22, s12, s33 = laws.hooke(e11, e22, e12, e33, c[i, LAMBDA], c[i, TWO_MU], c[i, FREE])
    s0[i, 0], s0[i, 1] = base[i, 0] - s11, base[i, 1] - s22
    s0[i, 2], s0[i, 3] = base[i, 2] - s12, base[i, 3] - s33


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(n, first, rows, wide, x, c, s0, law, table, lanes):
    """Corners, moduli, stress without strain and yield surfaces of the triangles first : first + n into lanes."""
    wx = U(12 if wide else 8)
    for e in range(U(0), U(n), _FOUR):
        i = U(first) + e
        at = U(rows[i]) * wx, U(rows[i + _1]) * wx, U(rows[i + _2]) * wx, U(rows[i + _3]) * wx
        four_columns(lanes, X1 + e, x, at)
        two_columns(lanes, X3 + e, x, (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR))
        q0 = i * _TWELVE
        q1, q2, q3 = q0 + _TWELVE, q0 + U(24), q0 + U(36)
        four_columns(lanes, CA + e, c, (q0, q1, q2, q3))
        two_columns(lanes, LAM + e, c, (q0 + _FOUR, q1 + _FOUR, q2 + _FOUR, q3 + _FOUR))
        q0 = i * _FOUR
        four_columns(lanes, S11 + e, s0, (q0, q0 + _FOUR, q0 + U(8), q0 + _TWELVE))
        four_columns(
            lanes, L_PHI + e, table,
            (U(law[i]) * _FOUR, U(law[i + _1]) * _FOUR, U(law[i + _2]) * _FOUR, U(law[i + _3]) * _FOUR),
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _try(n, small, free, lanes):
    """Trial stresses, in the place of those without strain, and by how much they are outside."""
    for e in range(U(n)):
        x1, y1 = lanes[X1 + e], lanes[Y1 + e]
        ux, uy, wx, wy = lanes[X2 + e] - x1, lanes[Y2 + e] - y1, lanes[X3 + e] - x1, lanes[Y3 + e] - y1
        a, b, c, d = lanes[CA + e], lanes[CB + e], lanes[CC + e], lanes[CD + e]
        f11, f12, f21, f22 = ux * a + wx * c, ux * b + wx * d, uy * a + wy * c, uy * b + wy * d
        cs, sn = laws.rotation(f11, f12, f21, f22)
        cs, sn = (1.0 if small else cs), (0.0 if small else sn)
        e11, e22, e12 = laws.stretch(f11, f12, f21, f22, cs, sn)
        p, m = lanes[LAM + e] * (e11 + e22), lanes[MU2 + e]
        s11, s22 = lanes[S11 + e] + (p + m * e11), lanes[S22 + e] + (p + m * e22)
        s12, s33 = lanes[S12 + e] + m * e12, lanes[S33 + e] + (p - free * p)
        lanes[S11 + e], lanes[S22 + e], lanes[S12 + e], lanes[S33 + e] = s11, s22, s12, s33
        lanes[OUTSIDE + e] = laws.outside(
            s11, s22, s12, s33, lanes[L_PHI + e], lanes[L_STRENGTH + e], lanes[L_TENSILE + e]
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _all_inside(n, lanes):
    """Negative if no stress is outside."""
    bits = lanes.view(np.int64)
    found = np.int64(-1)
    for e in range(U(n)):
        found &= bits[OUTSIDE + e]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(n, lanes, who):
    """Those that are outside, side by side; who (BLOCK,) i8: which they are. Returns their number."""
    m = 0
    for k in range(n):
        e, at = U(k), U(m)
        if lanes[OUTSIDE + e] > 0.0:
            for c in range(U(8)):  # stress and law
                lanes[T11 + c * U(CAPACITY) + at] = lanes[S11 + c * U(CAPACITY) + e]
            lanes[P_LAM + at], lanes[P_MU2 + at] = lanes[LAM + e], lanes[MU2 + e]
            lanes[P_PER_AREA + at] = 2.0 * (lanes[CA + e] * lanes[CD + e] - lanes[CB + e] * lanes[CC + e])
            who[m] = k
            m += 1
    return m


def _return_loop(strain):
    """The loop that finds plastic strains of n trial stresses, and how they flow."""

    @njit(nogil=True, error_model="numpy")
    def loop(n, lanes):
        for e in range(U(n)):
            e11, e22, e12, e33, how = strain(
                lanes[T11 + e], lanes[T22 + e], lanes[T12 + e], lanes[T33 + e], lanes[P_PHI + e], lanes[P_PSI + e],
                lanes[P_STRENGTH + e], lanes[P_TENSILE + e], lanes[P_LAM + e], lanes[P_MU2 + e],
            )  # fmt: skip
            lanes[P11 + e], lanes[P22 + e], lanes[P12 + e], lanes[P33 + e], lanes[HOW + e] = e11, e22, e12, e33, how

    return loop


_return_all, _return_in_plane_stress = _return_loop(plastic_strain), _return_loop(plane_stress_strain)


@njit(cache=True, nogil=True, error_model="numpy")
def return_all(n, free, lanes):
    """Plastic strains of n trial stresses, and how they flow; free: as of `laws.hooke`."""
    if free == 0.0:
        _return_all(n, lanes)
    else:
        _return_in_plane_stress(n, lanes)


@njit(cache=True, nogil=True, error_model="numpy")
def measure(m, free, lanes):
    """Shear, volume and work of the m plastic strains."""
    for e in range(U(m)):
        e11, e22, e12, e33 = lanes[P11 + e], lanes[P22 + e], lanes[P12 + e], lanes[P33 + e]
        s11, s22, s12, s33 = laws.hooke(e11, e22, e12, e33, lanes[P_LAM + e], lanes[P_MU2 + e], free)
        volume = e11 + e22 + e33
        third = volume / 3.0
        d11, d22, d33 = e11 - third, e22 - third, e33 - third
        work = (lanes[T11 + e] - s11) * e11 + (lanes[T22 + e] - s22) * e22
        work += 2.0 * (lanes[T12 + e] - s12) * e12 + (lanes[T33 + e] - s33) * e33
        lanes[P_SHEAR + e] = math.sqrt(0.5 * (d11 * d11 + d22 * d22 + d33 * d33 + 2.0 * e12 * e12))
        lanes[P_VOLUME + e] = volume
        lanes[P_WORK + e] = work / lanes[P_PER_AREA + e]


@njit(cache=True, nogil=True, error_model="numpy")
def _remember(m, first, first_row, rows, who, lanes, c, base, law, table, soft, step, memory, s0):
    """Add what has flowed to memory and s0."""
    for k in range(m):
        e, i = U(k), first + who[k]
        j, bits = rows[i] - first_row, np.int64(lanes[HOW + U(k)])
        memory[j, E11] += lanes[P11 + e]
        memory[j, E22] += lanes[P22 + e]
        memory[j, E12] += lanes[P12 + e]
        memory[j, E33] += lanes[P33 + e]
        memory[j, SHEAR] += lanes[P_SHEAR + e]
        memory[j, VOLUME] += lanes[P_VOLUME + e]
        if bits & SHEAR_NOW:
            memory[j, IN_SHEAR] = step + 1.0
        if bits & TENSION_NOW:
            memory[j, IN_TENSION] = step + 1.0
        memory[j, WORK] += lanes[P_WORK + e]
        if law[i] >= soft.first:
            strength.flowed(
                law[i], j, 0, bits, lanes[P11 + e], lanes[P22 + e], lanes[P12 + e], lanes[P33 + e],
                lanes[P_SHEAR + e], lanes[P_VOLUME + e], soft, table,
            )  # fmt: skip
        relieve(i, j, c, base, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def _flow(t, threads, count, rows, first_row, wide, x, c, base, law, soft, small, step, memory, s0, table):
    lanes = np.zeros(LANES * CAPACITY)
    who = np.zeros(BLOCK, np.int64)
    flat_x, flat_c, flat_s0 = x.reshape(x.size), c.reshape(c.size), s0.reshape(s0.size)
    flat_table, free = table.reshape(table.size), c[0, FREE]
    blocks = -(-count // BLOCK)
    for b in range(blocks * t // threads, blocks * (t + 1) // threads):
        first = b * BLOCK
        n = min(BLOCK, count - first)
        _gather(n, first, rows, wide, flat_x, flat_c, flat_s0, law, flat_table, lanes)
        _try(n, small, free, lanes)
        if _all_inside(n, lanes) < 0:
            continue
        m = _choose(n, lanes, who)
        if m > 0:
            return_all(m, free, lanes)
            measure(m, free, lanes)
            _remember(m, first, first_row, rows, who, lanes, c, base, law, table, soft, step, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def flows(threads, *args):
    """Let the triangles that are outside their yield surface at the present positions flow.

    count: triangles; rows (count + 3,) i4: their rows of x, of which the first owned one is `first_row`; wide: x is
    (n, 12); c (count + 3, 12), see `elements.TRIANGLE`; base (count, 4) [Pa]: initial stress; law (count + 3,): row of
    `table`; soft: see strength.py; small: small strains; step: number of this step. They become those after the flow:
    memory (n_own, 9), see `MEMORY`; s0 (count + 3, 4) [Pa]: stress without strain; table (rows, 4) of yield surfaces,
    see `YIELD`.
    """
    for t in range(threads):
        _flow(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def flows_threaded(threads, count, rows, first_row, wide, x, c, base, law, soft, small, step, memory, s0, table):
    """The same on several threads."""
    for t in prange(threads):
        _flow(t, threads, count, rows, first_row, wide, x, c, base, law, soft, small, step, memory, s0, table)


@njit(cache=True, nogil=True, error_model="numpy")
def relieve_all(rows, first, c, base, memory, s0):
    """`relieve` for triangles: s0 (count, 4) [Pa]; arguments as for `flows`."""
    for i in range(len(rows)):
        relieve(i, rows[i] - first, c, base, memory, s0)


@njit(cache=True, error_model="numpy")
def kept_energy(j, o, base, b, lame, two_mu, free, memory):
    """Of `locked_in` per volume [J/m3]; o, b: first columns of memory (row j) and of base (a row)."""
    e11, e22, e12, e33 = memory[j, o + E11], memory[j, o + E22], memory[j, o + E12], memory[j, o + E33]
    e33 = e33 - free * e33
    trace = e11 + e22 + e33
    squares = e11 * e11 + e22 * e22 + 2.0 * e12 * e12 + e33 * e33
    own = base[b] * e11 + base[b + 1] * e22 + 2.0 * base[b + 2] * e12 + base[b + 3] * e33
    return 0.5 * (lame * trace * trace + two_mu * squares) - own


@njit(cache=True, nogil=True, error_model="numpy")
def locked_in(rows, first, c, base, memory, out):
    """Add to out (n_own,) what the elastic energy [J/m] differs by from that of an element with the initial stress s0:
    with e = U - 1 it is A [(e - e_p) : D (e - e_p) / 2 + base : (e - e_p)] = A [e : D e / 2 + s0 : e] +
    A [e_p : D e_p / 2 - base : e_p], s0 = base - D e_p."""
    for i in range(len(rows)):
        j = rows[i] - first
        area = 0.5 / (c[i, 0] * c[i, 3] - c[i, 1] * c[i, 2])
        out[j] += area * kept_energy(j, 0, base[i], 0, c[i, LAMBDA], c[i, TWO_MU], c[i, FREE], memory)

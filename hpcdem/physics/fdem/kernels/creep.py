"""Creep of the deviator after Burgers: a Maxwell and a Kelvin unit in series, the volume elastic.

S, e: deviators of stress and strain, G_M, eta_M: spring and dashpot of the Maxwell unit, G_K, eta_K: of the Kelvin unit
with its strain e_K:

    e' = S' / (2 G_M) + S / (2 eta_M) + e_K',      S = 2 G_K e_K + 2 eta_K e_K'       (' : rate)

Over a creep step dt both rates are taken with the mean of its ends (trapezoidal rule, second order, stable for any dt):

    e_K+ = [B e_K + (S + S+) dt / (4 eta_K)] / A,   A, B = 1 +- G_K dt / (2 eta_K)
    S+ = [e+ + s_0 / (2 G_M) - e_c - (B / A - 1) e_K - c S] / X,   c = dt / 4 (1 / eta_M + 1 / (A eta_K)),
    X = 1 / (2 G_M) + c

where + is the end of the step, s_0 the deviator of the initial stress and e_c = e - (S - s_0) / (2 G_M) the creep
strain: all that is not in the spring of the Maxwell unit. (FLAC's Burgers model, Itasca; manual of PCDC, 7.2.5, in
increments.) An element without Kelvin unit has 1 / eta_K = 0, one without dashpot 1 / eta_M = 0.

Strains are those of the frame that turns with the element, sigma = sigma_0 + D (U - 1 - e_c), as for plastic flow
(plasticity.py): -D e_c is added to the initial stress, so the loop over triangles is the elastic one. Within a creep
step S+ depends on the strain as in an elastic element with 2 G = 1 / X.

In plane stress the strain across the plane is such that the stress there is 0 at the end of the step: with K the bulk
modulus, p_0 the mean of the initial stress and h33 the deviator S+ that there is without strain, z = e33 follows from
p_0 + K (e11 + e22 + z) + h33 + (2 z - e11 - e22) / (3 X) = 0, as S+ is linear in the strain. Creep strains are
deviators there too; sigma = sigma_0 + D' (U - 1 - e_c) in the plane, D' with lambda' (moduli.py).

What is lost in a step is (S + S+) / 2 : de_M + 2 eta_K de_K : de_K / dt, never negative, de_M that of the dashpot of
the Maxwell unit; the spring of the Kelvin unit stores G_K e_K : e_K.
"""

from __future__ import annotations

from numba import njit, prange

from hpcdem.physics.fdem.kernels import laws
from hpcdem.physics.fdem.kernels.elements import (
    FREE,
    LAMBDA,
    Q_AREA,
    Q_FREE,
    Q_LAMBDA,
    Q_TWO_MU,
    QUAD,
    TRIANGLE,
    TWO_MU,
    mean_trace,
    part_stretch,
    triangle_stretch,
)

# Columns of the table of element models (rows, 3): G_K [Pa], 1 / eta_K, 1 / eta_M [1/(Pa s)]; zero: there is none.
KELVIN, PER_KELVIN, PER_MAXWELL = range(3)
LAW = 3
# Columns of what an element remembers (n, 10), or (n, 40) where there are quads: for each of their four triangles
# (triangles have the first ten); deviators 11, 22, 12 in the frame that turns with it (33 = -11 - 22):
# creep strain, strain of the Kelvin unit, stress [Pa] at the beginning of the creep step; then what was lost [J/m].
C11, C22, C12, K11, K22, K12, S11, S22, S12, LOST = range(10)
MEMORY = 10
SHARED = 1e-12
"""Difference of pressures in a quad, over its stresses, that is put down to rounding."""


@njit(cache=True, error_model="numpy")
def squares(a11, a22, a12):
    """a : a of a deviator."""
    a33 = a11 + a22
    return a11 * a11 + a22 * a22 + a33 * a33 + 2.0 * a12 * a12


@njit(cache=True, error_model="numpy")
def factors(dt, two_mu, kelvin, per_kelvin, per_maxwell):
    """B / A - 1, dt / (4 A eta_K), dt / (4 eta_M), X of the formulas above, and B / A."""
    half = 0.5 * dt * kelvin * per_kelvin
    a = 1.0 + half
    ratio = (1.0 - half) / a
    of_kelvin, of_maxwell = 0.25 * dt * per_kelvin / a, 0.25 * dt * per_maxwell
    return ratio - 1.0, of_kelvin, of_maxwell, 1.0 / two_mu + (of_kelvin + of_maxwell), ratio


@njit(cache=True, error_model="numpy")
def stress_then(e, start, creep, kelvin, s, two_mu, back, of_both, x):
    """One component of S+ [Pa]; e: of the strain then, start: of s_0; creep, kelvin, s: of e_c, e_K, S;
    back = B / A - 1, of_both = c."""
    return (e + start / two_mu - creep - back * kelvin - of_both * s) / x


@njit(cache=True, error_model="numpy")
def relieve(i, o, lame, two_mu, free, base, e11, e22, e12, s0):
    """Into row i of s0, from column o on, the stress [Pa] of a triangle without strain: base there less D e_c, which is
    2 G_M e_c unless the strain across the plane is free."""
    s11, s22, s12, s33 = laws.hooke(e11, e22, e12, -(e11 + e22), lame, two_mu, free)
    s0[i, o], s0[i, o + 1] = base[i, o] - s11, base[i, o + 1] - s22
    s0[i, o + 2], s0[i, o + 3] = base[i, o + 2] - s12, base[i, o + 3] - s33


@njit(cache=True, error_model="numpy")
def _bulk(lame, two_mu):
    """K of lambda' and 2 G."""
    return lame * two_mu / (two_mu - lame) + two_mu / 3.0


@njit(cache=True, error_model="numpy")
def _across(trace, mean, h11, h22, weight, bulk):
    """z of the formulas above; h11, h22: S+ without strain, weight: 1 / X."""
    return -((mean - (h11 + h22)) + (bulk - weight / 3.0) * trace) / (bulk + 2.0 / 3.0 * weight)


@njit(cache=True, error_model="numpy")
def _share(i, o, one, two, s0):
    """Two triangles of a quad (areas one, two) have one pressure in the plane, that of their overlay, in row i of s0
    from column o on. Their strains have the same volume and their deviators 33 the same history, so this does nothing,
    unless they yielded before, each for itself, with another model. What is rounded stays."""
    p, q = 0.5 * (s0[i, o] + s0[i, o + 1]), 0.5 * (s0[i, o + 4] + s0[i, o + 5])
    size = abs(s0[i, o]) + abs(s0[i, o + 1]) + abs(s0[i, o + 4]) + abs(s0[i, o + 5])
    if abs(p - q) > SHARED * size:
        mean = (one * p + two * q) / (one + two)
        for k in range(2):
            s0[i, o + k] += mean - p
            s0[i, o + 4 + k] += mean - q


@njit(cache=True, error_model="numpy")
def _deviator(e11, e22, e33):
    """11, 22 of a strain."""
    third = (e11 + e22 + e33) / 3.0
    return e11 - third, e22 - third


@njit(cache=True, error_model="numpy")
def _part(i, j, p, x11, x22, e12, lame, two_mu, free, base, row, table, dt, keep, memory):
    """Creep strain (11, 22, 12) of triangle p of an element (of a triangle: 0) after dt, and what it loses [J/m3]; x11,
    x22, e12: its strain. i, j, row: rows of base, memory and table; it remembers this if it keeps it."""
    g, per_kelvin, per_maxwell = table[row, KELVIN], table[row, PER_KELVIN], table[row, PER_MAXWELL]
    back, kelvin, maxwell, div, ratio = factors(dt, two_mu, g, per_kelvin, per_maxwell)
    both, o, b = kelvin + maxwell, p * MEMORY, 4 * p
    mean = (base[i, b] + base[i, b + 1] + base[i, b + 3]) / 3.0
    b11, b22, b12 = base[i, b] - mean, base[i, b + 1] - mean, base[i, b + 2]
    k11, k22, k12 = memory[j, o + K11], memory[j, o + K22], memory[j, o + K12]
    s11, s22, s12 = memory[j, o + S11], memory[j, o + S22], memory[j, o + S12]
    z = 0.0
    if free != 0.0:
        h11 = stress_then(0.0, b11, memory[j, o + C11], k11, s11, two_mu, back, both, div)
        h22 = stress_then(0.0, b22, memory[j, o + C22], k22, s22, two_mu, back, both, div)
        z = _across(x11 + x22, mean, h11, h22, 1.0 / div, _bulk(lame, two_mu))
    e11, e22 = _deviator(x11, x22, z)
    t11 = stress_then(e11, b11, memory[j, o + C11], k11, s11, two_mu, back, both, div)
    t22 = stress_then(e22, b22, memory[j, o + C22], k22, s22, two_mu, back, both, div)
    t12 = stress_then(e12, b12, memory[j, o + C12], k12, s12, two_mu, back, both, div)
    s11, s22, s12 = s11 + t11, s22 + t22, s12 + t12
    n11, n22, n12 = ratio * k11 + s11 * kelvin, ratio * k22 + s22 * kelvin, ratio * k12 + s12 * kelvin
    d11, d22, d12 = n11 - k11, n22 - k22, n12 - k12
    c11 = memory[j, o + C11] + (d11 + s11 * maxwell)
    c22 = memory[j, o + C22] + (d22 + s22 * maxwell)
    c12 = memory[j, o + C12] + (d12 + s12 * maxwell)
    if not keep:
        return c11, c22, c12, 0.0
    memory[j, o + C11], memory[j, o + C22], memory[j, o + C12] = c11, c22, c12
    memory[j, o + K11], memory[j, o + K22], memory[j, o + K12] = n11, n22, n12
    # By its spring, so that asking again at these positions (dt = 0) finds the same bits.
    if free != 0.0:
        h11 = stress_then(0.0, b11, c11, 0.0, 0.0, two_mu, 0.0, 0.0, 1.0 / two_mu)
        h22 = stress_then(0.0, b22, c22, 0.0, 0.0, two_mu, 0.0, 0.0, 1.0 / two_mu)
        e11, e22 = _deviator(x11, x22, _across(x11 + x22, mean, h11, h22, 1.0 / (1.0 / two_mu), _bulk(lame, two_mu)))
    memory[j, o + S11], memory[j, o + S22] = b11 + two_mu * (e11 - c11), b22 + two_mu * (e22 - c22)
    memory[j, o + S12] = b12 + two_mu * (e12 - c12)
    if dt == 0.0:
        return c11, c22, c12, 0.0
    lost = 0.5 * squares(s11, s22, s12) * maxwell
    if per_kelvin > 0.0:
        lost += 2.0 * squares(d11, d22, d12) / (per_kelvin * dt)
    return c11, c22, c12, lost


@njit(cache=True, nogil=True, error_model="numpy")
def _creep(t, threads, who, rows, first_row, x, c, base, law, table, small, dt, keep, memory, s0):
    n = len(who)
    for k in range(n * t // threads, n * (t + 1) // threads):
        i = who[k]
        j = rows[i] - first_row
        _, _, e11, e22, e12 = triangle_stretch(x[rows[i]], c[i], small)
        lame, two_mu, free = c[i, LAMBDA], c[i, TWO_MU], c[i, FREE]
        c11, c22, c12, lost = _part(
            i, j, 0, e11, e22, e12, lame, two_mu, free, base, law[i], table, dt, keep, memory
        )  # fmt: skip
        relieve(i, 0, lame, two_mu, free, base, c11, c22, c12, s0)
        if keep:
            memory[j, LOST] += lost * 0.5 / (c[i, 0] * c[i, 3] - c[i, 1] * c[i, 2])


@njit(cache=True, nogil=True, error_model="numpy")
def _creep_quads(t, threads, who, rows, first_row, x, q, base, law, table, small, dt, keep, memory, s0):
    n = len(who)
    for k in range(n * t // threads, n * (t + 1) // threads):
        i = who[k]
        j, xy, lame, two_mu, free = rows[i] - first_row, x[rows[i]], q[i, Q_LAMBDA], q[i, Q_TWO_MU], q[i, Q_FREE]
        for overlay in range(2):
            mean = mean_trace(overlay, xy, q[i], small)
            for p in (2 * overlay, 2 * overlay + 1):
                _, _, _, _, _, _, e11, e22, e12 = part_stretch(p, xy, q[i], small)
                shift = 0.5 * (mean - (e11 + e22))
                c11, c22, c12, lost = _part(
                    i, j, p, e11 + shift, e22 + shift, e12, lame, two_mu, free, base, law[i], table, dt, keep, memory
                )
                relieve(i, 4 * p, lame, two_mu, free, base, c11, c22, c12, s0)
                if keep:
                    memory[j, p * MEMORY + LOST] += lost * 0.5 * q[i, Q_AREA + p]
            _share(i, 8 * overlay, q[i, Q_AREA + 2 * overlay], q[i, Q_AREA + 2 * overlay + 1], s0)


@njit(cache=True, nogil=True, error_model="numpy")
def creep(threads, *args):
    """Let triangles creep for dt [s], at the end of which they are at the present positions. keep: they remember it,
    and their stress now is what the next creep step begins with; else only s0 is what it would be.

    who (m,): which triangles; rows (count + 3,) i4: their rows of x, of which the first owned one is `first_row`;
    c (count + 3, 12), see `elements.TRIANGLE`; base (count, 4) [Pa]: stress without strain and creep; law (count + 3,):
    row of the table (rows, 3) of models, see `LAW`; small: small strains; memory (n_own, 10), see `MEMORY`;
    s0 (count + 3, 4) [Pa]: stress without strain now.
    """
    for t in range(threads):
        _creep(t, threads, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def creep_quads(threads, *args):
    """The same of quads, by mixed discretisation: the volume of the strain is the mean of the overlay, each of the four
    triangles creeps for itself. x (n, 12); q (count, 32), see `elements.QUAD`, takes the place of c; base (count, 16),
    law (count,), memory (n_own, 40), s0 (count, 16): of their four triangles, one behind the other."""
    for t in range(threads):
        _creep_quads(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def creep_threaded(threads, who, rows, first_row, x, c, base, law, table, small, dt, keep, memory, s0):
    """The same on several threads."""
    for t in prange(threads):
        _creep(t, threads, who, rows, first_row, x, c, base, law, table, small, dt, keep, memory, s0)


@njit(cache=True, parallel=True, error_model="numpy")
def creep_quads_threaded(threads, who, rows, first_row, x, q, base, law, table, small, dt, keep, memory, s0):
    """The same on several threads."""
    for t in prange(threads):
        _creep_quads(t, threads, who, rows, first_row, x, q, base, law, table, small, dt, keep, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def relieve_all(who, rows, first, c, base, memory, s0):
    """`relieve` for the triangles `who` (m,)."""
    for k in range(len(who)):
        i = who[k]
        j = rows[i] - first
        c11, c22, c12 = memory[j, C11], memory[j, C22], memory[j, C12]
        relieve(i, 0, c[i, LAMBDA], c[i, TWO_MU], c[i, FREE], base, c11, c22, c12, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def relieve_quads(who, rows, first, q, base, memory, s0):
    """The same of quads, with one pressure in each overlay."""
    for k in range(len(who)):
        i = who[k]
        j = rows[i] - first
        for p in range(4):
            o = p * MEMORY
            c11, c22, c12 = memory[j, o + C11], memory[j, o + C22], memory[j, o + C12]
            relieve(i, 4 * p, q[i, Q_LAMBDA], q[i, Q_TWO_MU], q[i, Q_FREE], base, c11, c22, c12, s0)
        for overlay in range(2):
            _share(i, 8 * overlay, q[i, Q_AREA + 2 * overlay], q[i, Q_AREA + 2 * overlay + 1], s0)


@njit(cache=True, error_model="numpy")
def _elastic(i, j, p, lame, two_mu, free, base, row, table, dt, memory, s0):
    """Stress [Pa] without strain of triangle p of an element within this creep step, into row i of s0, and its lambda
    and 2 G."""
    back, kelvin, maxwell, div, _ = factors(
        dt, two_mu, table[row, KELVIN], table[row, PER_KELVIN], table[row, PER_MAXWELL]
    )
    both, o, b = kelvin + maxwell, p * MEMORY, 4 * p
    mean = (base[i, b] + base[i, b + 1] + base[i, b + 3]) / 3.0
    for k in range(3):
        start = base[i, b + k] - (mean if k < 2 else 0.0)
        s0[i, b + k] = stress_then(
            0.0, start, memory[j, o + C11 + k], memory[j, o + K11 + k], memory[j, o + S11 + k], two_mu, back, both, div
        )
    weight = 1.0 / div
    if free != 0.0:
        bulk = _bulk(lame, two_mu)
        z = _across(0.0, mean, s0[i, b], s0[i, b + 1], weight, bulk)
        mean, own = mean + (bulk - weight / 3.0) * z, bulk - weight / 3.0
        s0[i, b + 3], lame = 0.0, own * weight / (own + weight)
    else:
        s0[i, b + 3], lame = mean - (s0[i, b] + s0[i, b + 1]), lame + (two_mu - weight) / 3.0
    s0[i, b] += mean
    s0[i, b + 1] += mean
    return lame, weight


@njit(cache=True, nogil=True, error_model="numpy")
def as_elastic(who, rows, first, c, base, law, table, dt, memory, like, s0):
    """The elastic element that a triangle is within this creep step: into like (count + 3, 12) its moduli, into s0
    (count + 3, 4) [Pa] its stress without strain; other arguments as for `creep`."""
    for k in range(len(who)):
        i = who[k]
        for m in range(TRIANGLE):
            like[i, m] = c[i, m]
        like[i, LAMBDA], like[i, TWO_MU] = _elastic(
            i, rows[i] - first, 0, c[i, LAMBDA], c[i, TWO_MU], c[i, FREE], base, law[i], table, dt, memory, s0
        )


@njit(cache=True, nogil=True, error_model="numpy")
def quads_as_elastic(who, rows, first, q, base, law, table, dt, memory, like, s0):
    """The same of quads: like (count, 32), s0 (count, 16) [Pa]; other arguments as for `creep_quads`."""
    for k in range(len(who)):
        i = who[k]
        for m in range(QUAD):
            like[i, m] = q[i, m]
        for p in range(4):
            like[i, Q_LAMBDA], like[i, Q_TWO_MU] = _elastic(
                i, rows[i] - first, p, q[i, Q_LAMBDA], q[i, Q_TWO_MU], q[i, Q_FREE], base, law[i], table, dt, memory, s0
            )
        for overlay in range(2):
            _share(i, 8 * overlay, q[i, Q_AREA + 2 * overlay], q[i, Q_AREA + 2 * overlay + 1], s0)


@njit(cache=True, error_model="numpy")
def _stored(i, j, p, lame, two_mu, free, base, row, table, memory):
    """Of triangle p of an element, see `stored` [J/m3]."""
    o, b = p * MEMORY, 4 * p
    e11, e22, e12 = memory[j, o + C11], memory[j, o + C22], memory[j, o + C12]
    density = 0.5 * two_mu * squares(e11, e22, e12)
    if free != 0.0:  # the strain across the plane stores nothing
        density += 0.5 * (lame - two_mu) * (e11 + e22) * (e11 + e22)
    density -= base[i, b] * e11 + base[i, b + 1] * e22 + 2.0 * base[i, b + 2] * e12 - base[i, b + 3] * (e11 + e22)
    if table[row, PER_KELVIN] > 0.0:
        density += table[row, KELVIN] * squares(memory[j, o + K11], memory[j, o + K22], memory[j, o + K12])
    return density


@njit(cache=True, nogil=True, error_model="numpy")
def stored(rows, first, c, base, law, table, memory, out):
    """Add to out (n_own,) what the elastic energy [J/m] differs by from that of an element with the initial stress
    s0 = base - 2 G_M e_c (see `plasticity.locked_in`), and what the springs of the Kelvin units store; base (count, 4)
    [Pa]: initial stress."""
    for i in range(len(rows)):
        j = rows[i] - first
        density = _stored(i, j, 0, c[i, LAMBDA], c[i, TWO_MU], c[i, FREE], base, law[i], table, memory)
        out[j] += density * 0.5 / (c[i, 0] * c[i, 3] - c[i, 1] * c[i, 2])


@njit(cache=True, nogil=True, error_model="numpy")
def stored_in_quads(rows, first, q, base, law, table, memory, out):
    """The same of quads: the triangles count half; base (count, 16) [Pa]."""
    for i in range(len(rows)):
        j = rows[i] - first
        for p in range(4):
            density = _stored(i, j, p, q[i, Q_LAMBDA], q[i, Q_TWO_MU], q[i, Q_FREE], base, law[i], table, memory)
            out[j] += 0.5 * q[i, Q_AREA + p] * density


@njit(cache=True, error_model="numpy")
def _turned(j, o, share, cs, sn, memory, out):
    """A share of the creep strain and of the Kelvin strain in row j of memory, from column o on, along the axes of
    space, is added to row j of out."""
    for k in (0, 3):
        xx, yy, xy = laws.turned(memory[j, o + k], memory[j, o + k + 1], memory[j, o + k + 2], cs, sn)
        out[j, k] += share * xx
        out[j, k + 1] += share * yy
        out[j, k + 2] += share * xy


@njit(cache=True, nogil=True, error_model="numpy")
def strains(rows, first, x, c, small, memory, out):
    """Creep strain and Kelvin strain, xx, yy, xy each, along the axes of space: added to out (n_own, 6)."""
    for i in range(len(rows)):
        cs, sn, _, _, _ = triangle_stretch(x[rows[i]], c[i], small)
        _turned(rows[i] - first, 0, 1.0, cs, sn, memory, out)


@njit(cache=True, nogil=True, error_model="numpy")
def strains_of_quads(rows, first, x, q, small, memory, out):
    """The same of quads: the mean over their triangles by area."""
    for i in range(len(rows)):
        areas = q[i, Q_AREA] + q[i, Q_AREA + 1] + q[i, Q_AREA + 2] + q[i, Q_AREA + 3]
        for p in range(4):
            _, _, _, _, cs, sn, _, _, _ = part_stretch(p, x[rows[i]], q[i], small)
            _turned(rows[i] - first, p * MEMORY, q[i, Q_AREA + p] / areas, cs, sn, memory, out)

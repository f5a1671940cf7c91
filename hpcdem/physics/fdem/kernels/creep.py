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

What is lost in a step is (S + S+) / 2 : de_M + 2 eta_K de_K : de_K / dt, never negative, de_M that of the dashpot of
the Maxwell unit; the spring of the Kelvin unit stores G_K e_K : e_K.
"""

from __future__ import annotations

from numba import njit, prange

from hpcdem.physics.fdem.kernels import laws
from hpcdem.physics.fdem.kernels.elements import LAMBDA, TRIANGLE, TWO_MU

# Columns of the table of element models (rows, 3): G_K [Pa], 1 / eta_K, 1 / eta_M [1/(Pa s)]; zero: there is none.
KELVIN, PER_KELVIN, PER_MAXWELL = range(3)
LAW = 3
# Columns of what an element remembers (n, 10), deviators 11, 22, 12 in the frame that turns with it (33 = -11 - 22):
# creep strain, strain of the Kelvin unit, stress [Pa] at the beginning of the creep step; then what was lost [J/m].
C11, C22, C12, K11, K22, K12, S11, S22, S12, LOST = range(10)
MEMORY = 10


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
def relieve(i, c, base, e11, e22, e12, s0):
    """Into row i of s0 the stress [Pa] of a triangle without strain: base less 2 G_M e_c."""
    two_mu = c[i, TWO_MU]
    s0[i, 0] = base[i, 0] - two_mu * e11
    s0[i, 1] = base[i, 1] - two_mu * e22
    s0[i, 2] = base[i, 2] - two_mu * e12
    s0[i, 3] = base[i, 3] + two_mu * (e11 + e22)


@njit(cache=True, error_model="numpy")
def _strain(xy, c, small):
    """Deviator of the strain (11, 22, 12) of a triangle with the corners xy (6,)."""
    ux, uy, wx, wy = xy[2] - xy[0], xy[3] - xy[1], xy[4] - xy[0], xy[5] - xy[1]
    f11, f12 = ux * c[0] + wx * c[2], ux * c[1] + wx * c[3]
    f21, f22 = uy * c[0] + wy * c[2], uy * c[1] + wy * c[3]
    cs, sn = laws.rotation(f11, f12, f21, f22)
    cs, sn = (1.0 if small else cs), (0.0 if small else sn)
    e11, e22, e12 = laws.stretch(f11, f12, f21, f22, cs, sn)
    third = (e11 + e22) / 3.0
    return e11 - third, e22 - third, e12


@njit(cache=True, nogil=True, error_model="numpy")
def _creep(t, threads, who, rows, first_row, x, c, base, law, table, small, dt, keep, memory, s0):
    n = len(who)
    for k in range(n * t // threads, n * (t + 1) // threads):
        i = who[k]
        r = rows[i]
        j = r - first_row
        e11, e22, e12 = _strain(x[r], c[i], small)
        two_mu, row = c[i, TWO_MU], law[i]
        g, per_kelvin, per_maxwell = table[row, KELVIN], table[row, PER_KELVIN], table[row, PER_MAXWELL]
        back, kelvin, maxwell, div, ratio = factors(dt, two_mu, g, per_kelvin, per_maxwell)
        both = kelvin + maxwell
        mean = (base[i, 0] + base[i, 1] + base[i, 3]) / 3.0
        b11, b22, b12 = base[i, 0] - mean, base[i, 1] - mean, base[i, 2]
        k11, k22, k12 = memory[j, K11], memory[j, K22], memory[j, K12]
        s11, s22, s12 = memory[j, S11], memory[j, S22], memory[j, S12]
        t11 = stress_then(e11, b11, memory[j, C11], k11, s11, two_mu, back, both, div)
        t22 = stress_then(e22, b22, memory[j, C22], k22, s22, two_mu, back, both, div)
        t12 = stress_then(e12, b12, memory[j, C12], k12, s12, two_mu, back, both, div)
        s11, s22, s12 = s11 + t11, s22 + t22, s12 + t12
        n11, n22, n12 = ratio * k11 + s11 * kelvin, ratio * k22 + s22 * kelvin, ratio * k12 + s12 * kelvin
        d11, d22, d12 = n11 - k11, n22 - k22, n12 - k12
        c11 = memory[j, C11] + (d11 + s11 * maxwell)
        c22 = memory[j, C22] + (d22 + s22 * maxwell)
        c12 = memory[j, C12] + (d12 + s12 * maxwell)
        relieve(i, c, base, c11, c22, c12, s0)
        if not keep:
            continue
        memory[j, C11], memory[j, C22], memory[j, C12] = c11, c22, c12
        memory[j, K11], memory[j, K22], memory[j, K12] = n11, n22, n12
        # By its spring, so that asking again at these positions (dt = 0) finds the same bits.
        memory[j, S11], memory[j, S22] = b11 + two_mu * (e11 - c11), b22 + two_mu * (e22 - c22)
        memory[j, S12] = b12 + two_mu * (e12 - c12)
        if dt > 0.0:
            lost = 0.5 * squares(s11, s22, s12) * maxwell
            if per_kelvin > 0.0:
                lost += 2.0 * squares(d11, d22, d12) / (per_kelvin * dt)
            memory[j, LOST] += lost * 0.5 / (c[i, 0] * c[i, 3] - c[i, 1] * c[i, 2])


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


@njit(cache=True, parallel=True, error_model="numpy")
def creep_threaded(threads, who, rows, first_row, x, c, base, law, table, small, dt, keep, memory, s0):
    """The same on several threads."""
    for t in prange(threads):
        _creep(t, threads, who, rows, first_row, x, c, base, law, table, small, dt, keep, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def relieve_all(who, rows, first, c, base, memory, s0):
    """`relieve` for the triangles `who` (m,)."""
    for k in range(len(who)):
        i = who[k]
        j = rows[i] - first
        relieve(i, c, base, memory[j, C11], memory[j, C22], memory[j, C12], s0)


@njit(cache=True, nogil=True, error_model="numpy")
def as_elastic(who, rows, first, c, base, law, table, dt, memory, like, s0):
    """The elastic element that a triangle is within this creep step: into like (count + 3, 12) its moduli, into s0
    (count + 3, 4) [Pa] its stress without strain; other arguments as for `creep`."""
    for k in range(len(who)):
        i = who[k]
        j = rows[i] - first
        two_mu, row = c[i, TWO_MU], law[i]
        back, kelvin, maxwell, div, _ = factors(
            dt, two_mu, table[row, KELVIN], table[row, PER_KELVIN], table[row, PER_MAXWELL]
        )
        both = kelvin + maxwell
        mean = (base[i, 0] + base[i, 1] + base[i, 3]) / 3.0
        for q in range(3):
            start = base[i, q] - (mean if q < 2 else 0.0)
            s0[i, q] = stress_then(
                0.0, start, memory[j, C11 + q], memory[j, K11 + q], memory[j, S11 + q], two_mu, back, both, div
            )
        s0[i, 3] = mean - (s0[i, 0] + s0[i, 1])
        s0[i, 0] += mean
        s0[i, 1] += mean
        for q in range(TRIANGLE):
            like[i, q] = c[i, q]
        like[i, TWO_MU] = 1.0 / div
        like[i, LAMBDA] = c[i, LAMBDA] + (two_mu - 1.0 / div) / 3.0


@njit(cache=True, nogil=True, error_model="numpy")
def stored(rows, first, c, base, law, table, memory, out):
    """Add to out (n_own,) what the elastic energy [J/m] differs by from that of an element with the initial stress
    s0 = base - 2 G_M e_c (see `plasticity.locked_in`), and what the springs of the Kelvin units store; base (count, 4)
    [Pa]: initial stress."""
    for i in range(len(rows)):
        j = rows[i] - first
        e11, e22, e12 = memory[j, C11], memory[j, C22], memory[j, C12]
        density = 0.5 * c[i, TWO_MU] * squares(e11, e22, e12)
        density -= base[i, 0] * e11 + base[i, 1] * e22 + 2.0 * base[i, 2] * e12 - base[i, 3] * (e11 + e22)
        if table[law[i], PER_KELVIN] > 0.0:
            density += table[law[i], KELVIN] * squares(memory[j, K11], memory[j, K22], memory[j, K12])
        out[j] += density * 0.5 / (c[i, 0] * c[i, 3] - c[i, 1] * c[i, 2])


@njit(cache=True, nogil=True, error_model="numpy")
def strains(rows, first, x, c, small, memory, out):
    """Creep strain and Kelvin strain, xx, yy, xy each, along the axes of space: into out (n_own, 6)."""
    for i in range(len(rows)):
        r = rows[i]
        j = r - first
        xy = x[r]
        ux, uy, wx, wy = xy[2] - xy[0], xy[3] - xy[1], xy[4] - xy[0], xy[5] - xy[1]
        cs, sn = laws.rotation(
            ux * c[i, 0] + wx * c[i, 2], ux * c[i, 1] + wx * c[i, 3], uy * c[i, 0] + wy * c[i, 2],
            uy * c[i, 1] + wy * c[i, 3],
        )  # fmt: skip
        cs, sn = (1.0 if small else cs), (0.0 if small else sn)
        for q in range(2):
            at = 3 * q
            out[j, at], out[j, at + 1], out[j, at + 2] = laws.turned(
                memory[j, at], memory[j, at + 1], memory[j, at + 2], cs, sn
            )

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
modulus, p_0 the mean of the initial stress and h33 the deviator S+ without strain, z = e33 follows from
p_0 + K (e11 + e22 + z) + h33 + (2 z - e11 - e22) / (3 X) = 0, as S+ is linear in the strain. Creep strains are
deviators there too; sigma = sigma_0 + D' (U - 1 - e_c) in the plane, D' with lambda' (moduli.py).

What is lost in a step is (S + S+) / 2 : de_M + 2 eta_K de_K : de_K / dt, never negative, de_M that of the dashpot of
the Maxwell unit; the spring of the Kelvin unit stores G_K e_K : e_K.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem.elements import parts
from hpcdem.physics.fdem.kernels import laws

# Columns of the table of element models (rows, 3): G_K [Pa], 1 / eta_K, 1 / eta_M [1/(Pa s)]; zero: not present.
KELVIN, PER_KELVIN, PER_MAXWELL = range(3)
LAW = 3
PLACES = (0, 1, 2, 4, 5)
"""Columns of the components of a deviator in rows of stresses: 11, 22, 12, in space 13, 23 (33 = -11 - 22)."""
CREPT, IN_KELVIN, BEFORE, LOST = (0, 1, 2, 10, 11), (3, 4, 5, 12, 13), (6, 7, 8, 14, 15), 9
"""Columns of what a part of an element remembers, by these components, in the frame that turns with it: creep strain,
strain of the Kelvin unit, stress [Pa] at the beginning of the creep step; and what was lost [J], in the plane [J/m]."""
MEMORY = {2: 10, 3: 16}
"""Columns of a part, by dimensions; where they are: `parts.place`."""


@njit(cache=True, error_model="numpy", forceinline=True)
def _place(g, i, p):
    """Row and first column of what part p of element i remembers."""
    return parts.place(g, i, p, 3 * parts.components(g) - 2)


@njit(cache=True, error_model="numpy", forceinline=True)
def _added(k, a, sums):
    """Component k of a deviator a joins the sums of which `_square` makes a : a."""
    normal, across, shear = sums
    return (normal + a * a, across + a, shear) if k < 2 else (normal, across, shear + a * a)


@njit(cache=True, error_model="numpy", forceinline=True)
def _square(sums):
    normal, across, shear = sums
    return normal + across * across + 2.0 * shear


@njit(cache=True, error_model="numpy", forceinline=True)
def factors(dt, two_mu, kelvin, per_kelvin, per_maxwell):
    """B / A - 1, dt / (4 A eta_K), dt / (4 eta_M), X of the formulas above, and B / A."""
    half = 0.5 * dt * kelvin * per_kelvin
    a = 1.0 + half
    ratio = (1.0 - half) / a
    of_kelvin, of_maxwell = 0.25 * dt * per_kelvin / a, 0.25 * dt * per_maxwell
    return ratio - 1.0, of_kelvin, of_maxwell, 1.0 / two_mu + (of_kelvin + of_maxwell), ratio


@njit(cache=True, error_model="numpy", forceinline=True)
def stress_then(e, start, creep, kelvin, s, two_mu, back, of_both, x):
    """One component of S+ [Pa]; e: of the strain then, start: of s_0; creep, kelvin, s: of e_c, e_K, S;
    back = B / A - 1, of_both = c."""
    return (e + start / two_mu - creep - back * kelvin - of_both * s) / x


@njit(cache=True, error_model="numpy", forceinline=True)
def _mean(s, i, p):
    return (s[i, p, 0] + s[i, p, 1] + s[i, p, 3]) / 3.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _relieve(size, i, p, moduli, base, s0):
    """Into s0, where its creep strain is, the stress [Pa] of a part without strain: base less D e_c, which is 2 G_M e_c
    unless the strain across the plane is free."""
    lame, two_mu, free = moduli
    e11, e22 = s0[i, p, 0], s0[i, p, 1]
    s11, s22, _, s33 = laws.hooke(e11, e22, 0.0, -(e11 + e22), lame, two_mu, free)
    s0[i, p, 0], s0[i, p, 1], s0[i, p, 3] = base[i, p, 0] - s11, base[i, p, 1] - s22, base[i, p, 3] - s33
    for k in range(2, size):
        s0[i, p, PLACES[k]] = base[i, p, PLACES[k]] - two_mu * s0[i, p, PLACES[k]]


@njit(cache=True, error_model="numpy", forceinline=True)
def _bulk(lame, two_mu):
    """K of lambda' and 2 G."""
    return lame * two_mu / (two_mu - lame) + two_mu / 3.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _across(trace, mean, h11, h22, weight, bulk):
    """z of the formulas above; h11, h22: S+ without strain, weight: 1 / X."""
    return -((mean - (h11 + h22)) + (bulk - weight / 3.0) * trace) / (bulk + 2.0 / 3.0 * weight)


@njit(cache=True, error_model="numpy", forceinline=True)
def _creep_part(size, i, p, j, o, e, base, moduli, unit, per_kelvin, dt, keep, memory, s0):
    """Let a part creep, see `creep`: rows i, p of base and s0, p of e (parts, 4 or 6), its strains, j of memory, from
    column o on. size: components of a deviator; unit: its `factors`. Returns what it loses [J/m3]."""
    lame, two_mu, free = moduli
    back, kelvin, maxwell, div, ratio = unit
    both, mean, across = kelvin + maxwell, _mean(base, i, p), e[p, 3]
    if free != 0.0:
        h11 = stress_then(
            0.0, base[i, p, 0] - mean, memory[j, o + CREPT[0]], memory[j, o + IN_KELVIN[0]], memory[j, o + BEFORE[0]],
            two_mu, back, both, div,
        )  # fmt: skip
        h22 = stress_then(
            0.0, base[i, p, 1] - mean, memory[j, o + CREPT[1]], memory[j, o + IN_KELVIN[1]], memory[j, o + BEFORE[1]],
            two_mu, back, both, div,
        )  # fmt: skip
        across = _across(e[p, 0] + e[p, 1], mean, h11, h22, 1.0 / div, _bulk(lame, two_mu))
    third, nothing = (e[p, 0] + e[p, 1] + across) / 3.0, (0.0, 0.0, 0.0)
    of_stress, of_kelvin = nothing, nothing
    for k in range(size):
        now, start = e[p, PLACES[k]] - (third if k < 2 else 0.0), base[i, p, PLACES[k]] - (mean if k < 2 else 0.0)
        before, stress, old = memory[j, o + IN_KELVIN[k]], memory[j, o + BEFORE[k]], memory[j, o + CREPT[k]]
        ends = stress + stress_then(now, start, old, before, stress, two_mu, back, both, div)
        then = ratio * before + ends * kelvin
        change = then - before
        crept = old + (change + ends * maxwell)
        s0[i, p, PLACES[k]] = crept
        if keep:
            memory[j, o + CREPT[k]], memory[j, o + IN_KELVIN[k]] = crept, then
            of_stress, of_kelvin = _added(k, ends, of_stress), _added(k, change, of_kelvin)
    _relieve(size, i, p, moduli, base, s0)
    if not keep:
        return 0.0
    # By its spring, so that asking again at these positions (dt = 0) finds the same bits.
    if free != 0.0:
        c11, c22, soft = memory[j, o + CREPT[0]], memory[j, o + CREPT[1]], 1.0 / two_mu
        h11 = stress_then(0.0, base[i, p, 0] - mean, c11, 0.0, 0.0, two_mu, 0.0, 0.0, soft)
        h22 = stress_then(0.0, base[i, p, 1] - mean, c22, 0.0, 0.0, two_mu, 0.0, 0.0, soft)
        across = _across(e[p, 0] + e[p, 1], mean, h11, h22, 1.0 / soft, _bulk(lame, two_mu))
        third = (e[p, 0] + e[p, 1] + across) / 3.0
    for k in range(size):
        now, start = e[p, PLACES[k]] - (third if k < 2 else 0.0), base[i, p, PLACES[k]] - (mean if k < 2 else 0.0)
        memory[j, o + BEFORE[k]] = start + two_mu * (now - memory[j, o + CREPT[k]])
    if dt == 0.0:
        return 0.0
    lost = 0.5 * _square(of_stress) * maxwell
    if per_kelvin > 0.0:
        lost += 2.0 * _square(of_kelvin) / (per_kelvin * dt)
    return lost


@njit(cache=True, nogil=True, error_model="numpy")
def _creep(t, threads, who, g, base, law, table, small, dt, keep, memory, s0):
    (e, frames), n, size = parts.room(g), len(who), parts.components(g) - 1
    for m in range(n * t // threads, n * (t + 1) // threads):
        i = who[m]
        parts.strains(g, i, small, e, frames)
        moduli, row = parts.moduli(g, i), law[i]
        per_kelvin = table[row, PER_KELVIN]
        unit = factors(dt, moduli[1], table[row, KELVIN], per_kelvin, table[row, PER_MAXWELL])
        for p in range(parts.count(g)):
            j, o = _place(g, i, p)
            lost = _creep_part(size, i, p, j, o, e, base, moduli, unit, per_kelvin, dt, keep, memory, s0)
            if keep:
                memory[j, o + LOST] += lost * parts.weight(g, i, p)
        parts.share(g, i, s0)


@on_threads
def creep(threads, who, g, *args):
    """Let elements creep for dt [s], at the end of which they are at the present positions. keep: they remember it,
    and their stress now is what the next creep step begins with; else only s0 is what it would be.

    who (m,): which elements of g, see `kind.Tables`; base (n, parts, 4 or 8) [Pa]: stress without strain and creep of
    their parts; law (n,): row of the table (rows, 3) of models, see `LAW`; small: small strains; memory: of owned
    elements, see `MEMORY`; s0, as base: stress without strain now.
    """
    for t in prange(threads):
        _creep(t, threads, who, g, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def relieve_all(who, g, base, memory, s0):
    """Into s0 [Pa] the stress without strain of the elements `who` (m,)."""
    size = parts.components(g) - 1
    for i in who:
        moduli = parts.moduli(g, i)
        for p in range(parts.count(g)):
            j, o = _place(g, i, p)
            for k in range(size):
                s0[i, p, PLACES[k]] = memory[j, o + CREPT[k]]
            _relieve(size, i, p, moduli, base, s0)
        parts.share(g, i, s0)


@njit(cache=True, error_model="numpy", forceinline=True)
def _elastic(size, i, p, j, o, base, moduli, unit, memory, s0):
    """Stress [Pa] without strain of a part within this creep step, into s0; its lambda and 2 G. See `_creep_part`."""
    lame, two_mu, free = moduli
    back, kelvin, maxwell, div, _ = unit
    weight, mean = 1.0 / div, _mean(base, i, p)
    for k in range(size):
        before, stress, old = memory[j, o + IN_KELVIN[k]], memory[j, o + BEFORE[k]], memory[j, o + CREPT[k]]
        start = base[i, p, PLACES[k]] - (mean if k < 2 else 0.0)
        s0[i, p, PLACES[k]] = stress_then(0.0, start, old, before, stress, two_mu, back, kelvin + maxwell, div)
    if free != 0.0:
        own = _bulk(lame, two_mu) - weight / 3.0
        mean += own * _across(0.0, mean, s0[i, p, 0], s0[i, p, 1], weight, _bulk(lame, two_mu))
        s0[i, p, 3], lame = 0.0, own * weight / (own + weight)
    else:
        s0[i, p, 3], lame = mean - (s0[i, p, 0] + s0[i, p, 1]), lame + (two_mu - weight) / 3.0
    s0[i, p, 0] += mean
    s0[i, p, 1] += mean
    return lame, weight


@njit(cache=True, nogil=True, error_model="numpy")
def as_elastic(who, g, base, law, table, dt, memory, like, s0):
    """The elastic element that one is within this creep step: into like, a copy of its constants, its moduli, into s0
    [Pa] its stress without strain; other arguments as for `creep`."""
    size = parts.components(g) - 1
    for i in who:
        moduli, row, lame, two_mu = parts.moduli(g, i), law[i], 0.0, 0.0
        unit = factors(dt, moduli[1], table[row, KELVIN], table[row, PER_KELVIN], table[row, PER_MAXWELL])
        for p in range(parts.count(g)):
            j, o = _place(g, i, p)
            lame, two_mu = _elastic(size, i, p, j, o, base, moduli, unit, memory, s0)
        parts.put_moduli(g, i, lame, two_mu, like)
        parts.share(g, i, s0)


@njit(cache=True, error_model="numpy", forceinline=True)
def _stored(size, i, p, j, o, base, moduli, kelvin, memory):
    """Return what `stored` adds for a part [J/m3]; kelvin: G_K, 0: there is no Kelvin unit."""
    lame, two_mu, free = moduli
    crept = in_kelvin = (0.0, 0.0, 0.0)
    normal = shear = 0.0
    for k in range(size):
        a = memory[j, o + CREPT[k]]
        crept, in_kelvin = _added(k, a, crept), _added(k, memory[j, o + IN_KELVIN[k]], in_kelvin)
        if k < 2:
            normal += base[i, p, PLACES[k]] * a
        else:
            shear += base[i, p, PLACES[k]] * a
    density = 0.5 * two_mu * _square(crept)
    if free != 0.0:  # the strain across the plane stores nothing
        density += 0.5 * (lame - two_mu) * crept[1] * crept[1]
    density -= normal + 2.0 * shear - base[i, p, 3] * crept[1]
    return density + kelvin * _square(in_kelvin)


@njit(cache=True, nogil=True, error_model="numpy")
def stored(who, g, base, law, table, memory, out):
    """Add to out (m,) what the elastic energy [J], in the plane [J/m], of these elements differs by from that of
    elements with the initial stress s0 = base - 2 G_M e_c (see `plasticity.locked_in`), and what the springs of the
    Kelvin units store; base [Pa]: initial stress."""
    size = parts.components(g) - 1
    for m in range(len(who)):
        i = who[m]
        moduli, row = parts.moduli(g, i), law[i]
        kelvin = table[row, KELVIN] if table[row, PER_KELVIN] > 0.0 else 0.0
        for p in range(parts.count(g)):
            j, o = _place(g, i, p)
            out[m] += parts.weight(g, i, p) * _stored(size, i, p, j, o, base, moduli, kelvin, memory)


@njit(cache=True, nogil=True, error_model="numpy")
def strains(n, g, small, memory, out):
    """Creep strain and Kelvin strain, xx, yy, xy each, in space zz, xz, yz besides, along the axes of space: means over
    the parts of elements by volume, into out (n, 6 or 12)."""
    size, s, each = parts.components(g) - 1, np.zeros(parts.components(g)), out.shape[1] // 2
    for i in range(n):
        out[i], whole = 0.0, 0.0
        for p in range(parts.count(g)):
            whole += parts.volume(g, i, p)
        for p in range(parts.count(g)):
            _, frame = parts.strain(g, i, p, small)
            share, (j, o) = parts.volume(g, i, p) / whole, _place(g, i, p)
            for m in range(2):
                for k in range(size):
                    s[PLACES[k]] = memory[j, o + (IN_KELVIN[k] if m else CREPT[k])]
                s[3] = -(s[0] + s[1])
                found = parts.turned(g, s, frame)
                for k in range(each):
                    out[i, each * m + k] += share * found[k]

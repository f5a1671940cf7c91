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

import numpy as np
from numba import njit, prange

from hpcdem.physics.fdem.elements import parts
from hpcdem.physics.fdem.kernels import laws

# Columns of the table of element models (rows, 3): G_K [Pa], 1 / eta_K, 1 / eta_M [1/(Pa s)]; zero: there is none.
KELVIN, PER_KELVIN, PER_MAXWELL = range(3)
LAW = 3
PLACES = (0, 1, 2, 4, 5)
"""Columns of the components of a deviator in rows of stresses: 11, 22, 12, in space 13, 23 (33 = -11 - 22)."""
CREPT, IN_KELVIN, BEFORE, LOST = (0, 1, 2, 10, 11), (3, 4, 5, 12, 13), (6, 7, 8, 14, 15), 9
"""Columns of what a part of an element remembers, by these components, in the frame that turns with it: creep strain,
strain of the Kelvin unit, stress [Pa] at the beginning of the creep step; and what was lost [J], in the plane [J/m]."""
MEMORY = {2: 10, 3: 16}
"""Columns of a part, by dimensions; where they are: `parts.memory`."""


@njit(cache=True, error_model="numpy", forceinline=True)
def _memory(g, i, p, memory):
    """What part p of element i remembers."""
    return parts.memory(g, i, p, memory, 0, 3 * parts.components(g) - 2)


@njit(cache=True, error_model="numpy", forceinline=True)
def squares(a):
    """a : a of a deviator (3 or 5,)."""
    a33, shear = a[0] + a[1], a[2] * a[2]
    for k in range(3, len(a)):
        shear += a[k] * a[k]
    return a[0] * a[0] + a[1] * a[1] + a33 * a33 + 2.0 * shear


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
def _deviator(s, out):
    """Of a stress or strain (4 or 6,); returns its mean."""
    mean = (s[0] + s[1] + s[3]) / 3.0
    out[0], out[1] = s[0] - mean, s[1] - mean
    for k in range(2, len(out)):
        out[k] = s[PLACES[k]]
    return mean


@njit(cache=True, error_model="numpy", forceinline=True)
def _columns(of, memory, out):
    """Components (3 or 5,) of what a part remembers."""
    for k in range(len(out)):
        out[k] = memory[of[k]]


@njit(cache=True, error_model="numpy", forceinline=True)
def relieve(moduli, base, crept, s0):
    """Into s0 the stress [Pa] of a part without strain: base less D e_c, which is 2 G_M e_c unless the strain across
    the plane is free."""
    lame, two_mu, free = moduli
    s11, s22, _, s33 = laws.hooke(crept[0], crept[1], crept[2], -(crept[0] + crept[1]), lame, two_mu, free)
    s0[0], s0[1], s0[3] = base[0] - s11, base[1] - s22, base[3] - s33
    for k in range(2, len(crept)):
        s0[PLACES[k]] = base[PLACES[k]] - two_mu * crept[k]


@njit(cache=True, error_model="numpy", forceinline=True)
def _bulk(lame, two_mu):
    """K of lambda' and 2 G."""
    return lame * two_mu / (two_mu - lame) + two_mu / 3.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _across(trace, mean, h11, h22, weight, bulk):
    """z of the formulas above; h11, h22: S+ without strain, weight: 1 / X."""
    return -((mean - (h11 + h22)) + (bulk - weight / 3.0) * trace) / (bulk + 2.0 / 3.0 * weight)


@njit(cache=True, error_model="numpy", forceinline=True)
def creep_part(e, base, law, moduli, dt, keep, memory, s0, room):
    """Let a part creep by its rows of all tables, see `creep`; e (4 or 6,): its strain, law (3,): of its model, room:
    five of (3 or 5,), are filled. Returns what it loses [J/m3]."""
    lame, two_mu, free = moduli
    start, now, crept, way, both_ends = room
    back, kelvin, maxwell, div, ratio = factors(dt, two_mu, law[KELVIN], law[PER_KELVIN], law[PER_MAXWELL])
    both, mean = kelvin + maxwell, _deviator(base, start)
    if free != 0.0:
        for k in range(2):
            before, stress, old = memory[IN_KELVIN[k]], memory[BEFORE[k]], memory[CREPT[k]]
            way[k] = stress_then(0.0, start[k], old, before, stress, two_mu, back, both, div)
        e[3] = _across(e[0] + e[1], mean, way[0], way[1], 1.0 / div, _bulk(lame, two_mu))
    _deviator(e, now)
    for k in range(len(crept)):
        before, stress, old = memory[IN_KELVIN[k]], memory[BEFORE[k]], memory[CREPT[k]]
        both_ends[k] = stress + stress_then(now[k], start[k], old, before, stress, two_mu, back, both, div)
        then = ratio * before + both_ends[k] * kelvin
        way[k] = then - before
        crept[k] = old + (way[k] + both_ends[k] * maxwell)
        if keep:
            memory[CREPT[k]], memory[IN_KELVIN[k]] = crept[k], then
    relieve(moduli, base, crept, s0)
    if not keep:
        return 0.0
    # By its spring, so that asking again at these positions (dt = 0) finds the same bits.
    if free != 0.0:
        h11 = stress_then(0.0, start[0], crept[0], 0.0, 0.0, two_mu, 0.0, 0.0, 1.0 / two_mu)
        h22 = stress_then(0.0, start[1], crept[1], 0.0, 0.0, two_mu, 0.0, 0.0, 1.0 / two_mu)
        e[3] = _across(e[0] + e[1], mean, h11, h22, 1.0 / (1.0 / two_mu), _bulk(lame, two_mu))
        _deviator(e, now)
    for k in range(len(crept)):
        memory[BEFORE[k]] = start[k] + two_mu * (now[k] - crept[k])
    if dt == 0.0:
        return 0.0
    lost = 0.5 * squares(both_ends) * maxwell
    if law[PER_KELVIN] > 0.0:
        lost += 2.0 * squares(way) / (law[PER_KELVIN] * dt)
    return lost


@njit(cache=True, nogil=True, error_model="numpy")
def _creep(t, threads, who, g, base, law, table, small, dt, keep, memory, s0):
    (e, frames), n, size = parts.room(g), len(who), parts.components(g) - 1
    room = np.empty(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    for m in range(n * t // threads, n * (t + 1) // threads):
        i = who[m]
        parts.strains(g, i, small, e, frames)
        moduli, of_model = parts.moduli(g, i), table[law[i]]
        for p in range(len(e)):
            own = _memory(g, i, p, memory)
            lost = creep_part(e[p], base[i, p], of_model, moduli, dt, keep, own, s0[i, p], room)
            if keep:
                own[LOST] += lost * parts.weight(g, i, p)
        parts.share(g, i, s0[i])


@njit(cache=True, nogil=True, error_model="numpy")
def creep(threads, *args):
    """Let elements creep for dt [s], at the end of which they are at the present positions. keep: they remember it,
    and their stress now is what the next creep step begins with; else only s0 is what it would be.

    who (m,): which elements of g, see `kind.Tables`; base (n, parts, 4 or 8) [Pa]: stress without strain and creep of
    their parts; law (n,): row of the table (rows, 3) of models, see `LAW`; small: small strains; memory: of owned
    elements, see `MEMORY`; s0, as base: stress without strain now.
    """
    for t in range(threads):
        _creep(t, threads, *args)


@njit(cache=True, parallel=True, error_model="numpy")
def creep_threaded(threads, who, g, base, law, table, small, dt, keep, memory, s0):
    """The same on several threads."""
    for t in prange(threads):
        _creep(t, threads, who, g, base, law, table, small, dt, keep, memory, s0)


@njit(cache=True, nogil=True, error_model="numpy")
def relieve_all(who, g, base, memory, s0):
    """`relieve` for the elements `who` (m,)."""
    crept = np.empty(parts.components(g) - 1)
    for i in who:
        moduli = parts.moduli(g, i)
        for p in range(parts.count(g)):
            _columns(CREPT, _memory(g, i, p, memory), crept)
            relieve(moduli, base[i, p], crept, s0[i, p])
        parts.share(g, i, s0[i])


@njit(cache=True, error_model="numpy")
def _elastic(moduli, base, law, dt, memory, s0, room):
    """Stress [Pa] without strain of a part within this creep step, into s0, and its lambda and 2 G."""
    lame, two_mu, free = moduli
    back, kelvin, maxwell, div, _ = factors(dt, two_mu, law[KELVIN], law[PER_KELVIN], law[PER_MAXWELL])
    weight, mean = 1.0 / div, _deviator(base, room)
    for k in range(len(room)):
        before, stress, old = memory[IN_KELVIN[k]], memory[BEFORE[k]], memory[CREPT[k]]
        s0[PLACES[k]] = stress_then(0.0, room[k], old, before, stress, two_mu, back, kelvin + maxwell, div)
    if free != 0.0:
        own = _bulk(lame, two_mu) - weight / 3.0
        mean += own * _across(0.0, mean, s0[0], s0[1], weight, _bulk(lame, two_mu))
        s0[3], lame = 0.0, own * weight / (own + weight)
    else:
        s0[3], lame = mean - (s0[0] + s0[1]), lame + (two_mu - weight) / 3.0
    s0[0] += mean
    s0[1] += mean
    return lame, weight


@njit(cache=True, nogil=True, error_model="numpy")
def as_elastic(who, g, base, law, table, dt, memory, like, s0):
    """The elastic element that one is within this creep step: into like, a copy of its constants, its moduli, into s0
    [Pa] its stress without strain; other arguments as for `creep`."""
    room = np.empty(parts.components(g) - 1)
    for i in who:
        moduli, lame, two_mu = parts.moduli(g, i), 0.0, 0.0
        for p in range(parts.count(g)):
            own = _memory(g, i, p, memory)
            lame, two_mu = _elastic(moduli, base[i, p], table[law[i]], dt, own, s0[i, p], room)
        parts.put_moduli(g, i, lame, two_mu, like)
        parts.share(g, i, s0[i])


@njit(cache=True, error_model="numpy")
def _stored(moduli, base, law, memory, a):
    """What `stored` adds for a part [J/m3]; a (3 or 5,): is filled."""
    lame, two_mu, free = moduli
    _columns(CREPT, memory, a)
    density = 0.5 * two_mu * squares(a)
    if free != 0.0:  # the strain across the plane stores nothing
        density += 0.5 * (lame - two_mu) * (a[0] + a[1]) * (a[0] + a[1])
    normal, shear = base[0] * a[0] + base[1] * a[1], 0.0
    for k in range(2, len(a)):
        shear += base[PLACES[k]] * a[k]
    density -= normal + 2.0 * shear - base[3] * (a[0] + a[1])
    if law[PER_KELVIN] > 0.0:
        _columns(IN_KELVIN, memory, a)
        density += law[KELVIN] * squares(a)
    return density


@njit(cache=True, nogil=True, error_model="numpy")
def stored(who, g, base, law, table, memory, out):
    """Add to out (m,) what the elastic energy [J], in the plane [J/m], of these elements differs by from that of
    elements with the initial stress s0 = base - 2 G_M e_c (see `plasticity.locked_in`), and what the springs of the
    Kelvin units store; base [Pa]: initial stress."""
    a = np.empty(parts.components(g) - 1)
    for m in range(len(who)):
        i = who[m]
        moduli = parts.moduli(g, i)
        for p in range(parts.count(g)):
            own = _memory(g, i, p, memory)
            out[m] += parts.weight(g, i, p) * _stored(moduli, base[i, p], table[law[i]], own, a)


@njit(cache=True, nogil=True, error_model="numpy")
def strains(n, g, small, memory, out):
    """Creep strain and Kelvin strain, xx, yy, xy each, in space zz, xz, yz besides, along the axes of space: means over
    the parts of elements by volume, into out (n, 6 or 12)."""
    a, s, each = np.empty(parts.components(g) - 1), np.zeros(parts.components(g)), out.shape[1] // 2
    for i in range(n):
        out[i], whole = 0.0, 0.0
        for p in range(parts.count(g)):
            whole += parts.volume(g, i, p)
        for p in range(parts.count(g)):
            _, frame = parts.strain(g, i, p, small)
            share, own = parts.volume(g, i, p) / whole, _memory(g, i, p, memory)
            for m in range(2):
                _columns(IN_KELVIN if m else CREPT, own, a)
                s[3] = -(a[0] + a[1])
                for k in range(len(a)):
                    s[PLACES[k]] = a[k]
                found = parts.turned(g, s, frame)
                for k in range(each):
                    out[i, each * m + k] += share * found[k]

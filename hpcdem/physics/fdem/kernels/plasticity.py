"""Mohr-Coulomb plastic flow with a tension cut-off: the return of stresses from outside the yield surface.

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
planes: a^2 - b^2), so that the solution is unique (Cottle, Pang & Stone 1992, theorem 3.3.7). The plastic work is not
negative as long as psi <= phi. Formulas of the planes: Itasca, FLAC; of edges and corners: Clausen, Damkilde & Andersen
2007 (Computers & Structures 85, 1795).

In plane stress the third principal stress is held at 0 and the strain across the plane is what it takes. Of the two in
the plane, l <= h, the six planes leave a polygon; their parts in the plane of D dg/ds have a' = lambda' + 2 G and b' =
lambda' (moduli.py) instead of a and b:

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

from numba import njit

from hpcdem.numerics.lanes import U, lane
from hpcdem.physics.fdem.kernels import laws
from hpcdem.physics.fdem.kernels.strength import SHEAR_NOW as SHEAR_NOW
from hpcdem.physics.fdem.kernels.strength import TENSION_NOW as TENSION_NOW

SHEAR_PAST, TENSION_PAST = 4, 8
"""Bits of the state of an element, besides SHEAR_NOW, TENSION_NOW."""

# Columns of the table of element models (rows, 4): N_phi, N_psi, 2 c sqrt(N_phi) [Pa], tensile strength [Pa]; infinite
# strength: this model does not yield.
N_PHI, N_PSI, STRENGTH, TENSILE = range(4)
YIELD = 4
# Columns of what a part of an element remembers (elements/kind.py), 9 of the plane, 11 in space: plastic strain 11, 22,
# 12, 33 in the frame that turns with it; shear and volume of the plastic strain along the way; 1 + the last step in
# which it yielded in shear, in tension (0: never); plastic work [J], in the plane [J/m]; in space the plastic strain
# 13, 23.
E11, E22, E12, E33, SHEAR, VOLUME, IN_SHEAR, IN_TENSION, WORK, E13, E23 = range(11)
MEMORY = 9
MEMORY_IN_SPACE = 11
SWEEPS = 5
"""Each of three rotations; the rest falls with its square at least, and is rounding after four."""

# A tile: of the parts that are tried their stress, yield surface, and by how much they are outside (at most); then of
# those that are outside stress, surface, moduli, and volume; in space axes of the stress, by columns, which becomes
# diagonal; what flows: plastic strain, how, and its measures.
S11, S22, S12, S33, S13, S23, L_PHI, L_PSI, L_STRENGTH, L_TENSILE, OUTSIDE = (lane(k) for k in range(11))
T11, T22, T12, T33, T13, T23, P_PHI, P_PSI, P_STRENGTH, P_TENSILE, P_LAM, P_MU2, P_SIZE = (
    lane(11 + k) for k in range(13)
)
X1, Y1, Z1, X2, Y2, Z2, X3, Y3, Z3 = (lane(24 + k) for k in range(9))
P11, P22, P12, P33, P13, P23, HOW, P_SHEAR, P_VOLUME, P_WORK, P_SHORT = (lane(33 + k) for k in range(11))
LANES = 44


@njit(cache=True, error_model="numpy", forceinline=True)
def principal_return(s1, s2, s3, n, m, k, t, a, b):
    """Return where the principal stresses s1 <= s2 <= s3 [Pa] return to, in this order, and SHEAR_NOW | TENSION_NOW, a
    float.

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
    """Return where the principal stresses of the plane low <= high [Pa] return to in plane stress, low and high, and to
    which part (0: they are inside); t: at most k / n; a = lambda' + 2 G, b = lambda'; others see `principal_return`."""
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


@njit(cache=True, error_model="numpy", forceinline=True)
def most_outside(s11, s22, s12, s33, s13, s23, n_phi, k, tensile):
    """Return by how much [Pa] a stress is outside the yield surface at most; not above zero: it is inside."""
    p = (s11 + (s22 + s33)) / 3.0
    d11, d22, d33 = s11 - p, s22 - p, s33 - p
    squares = 0.5 * (d11 * d11 + (d22 * d22 + d33 * d33)) + (s12 * s12 + (s13 * s13 + s23 * s23))
    size = 2.0 * math.sqrt(squares / 3.0)
    shear, tension = (n_phi - 1.0) * p + size * math.sqrt(1.0 + n_phi + n_phi * n_phi) - k, p + size - tensile
    return shear if shear > tension else tension


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
        lanes[P_WORK + e] = work * lanes[P_SIZE + e]


def _rotation(pp, qq, pq, rp, rq, p, q):
    """The loop that makes the stress component pq zero by a turn of two axes. pp ...: lanes of the stress; p, q: first
    of the three lanes of these axes. One function each: distances between lanes must be constants."""
    p2, p3, q2, q3 = p + lane(1), p + lane(2), q + lane(1), q + lane(2)

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(n, lanes):
        for e in range(U(n)):
            d, b = lanes[qq + e] - lanes[pp + e], 2.0 * lanes[pq + e]
            whole = abs(d) + math.sqrt(d * d + b * b)
            t = (b if d >= 0.0 else -b) / (whole if whole > 0.0 else 1.0)
            cs = 1.0 / math.sqrt(1.0 + t * t)
            sn, more = t * cs, 0.5 * t * b
            lanes[pp + e], lanes[qq + e], lanes[pq + e] = lanes[pp + e] - more, lanes[qq + e] + more, 0.0
            u, w = lanes[rp + e], lanes[rq + e]
            lanes[rp + e], lanes[rq + e] = cs * u - sn * w, sn * u + cs * w
            u, w = lanes[p + e], lanes[q + e]
            lanes[p + e], lanes[q + e] = cs * u - sn * w, sn * u + cs * w
            u, w = lanes[p2 + e], lanes[q2 + e]
            lanes[p2 + e], lanes[q2 + e] = cs * u - sn * w, sn * u + cs * w
            u, w = lanes[p3 + e], lanes[q3 + e]
            lanes[p3 + e], lanes[q3 + e] = cs * u - sn * w, sn * u + cs * w

    return loop


_rotate_12 = _rotation(T11, T22, T12, T13, T23, X1, X2)
_rotate_13 = _rotation(T11, T33, T13, T12, T23, X1, X3)
_rotate_23 = _rotation(T22, T33, T23, T12, T13, X2, X3)


@njit(cache=True, nogil=True, error_model="numpy")
def find_axes(n, lanes):
    """Principal stresses of the first n, instead of the diagonal of the stress, and their axes."""
    for e in range(U(n)):
        lanes[X1 + e], lanes[Y1 + e], lanes[Z1 + e] = 1.0, 0.0, 0.0
        lanes[X2 + e], lanes[Y2 + e], lanes[Z2 + e] = 0.0, 1.0, 0.0
        lanes[X3 + e], lanes[Y3 + e], lanes[Z3 + e] = 0.0, 0.0, 1.0
    for _ in range(SWEEPS):
        _rotate_12(n, lanes)
        _rotate_13(n, lanes)
        _rotate_23(n, lanes)


@njit(cache=True, error_model="numpy", forceinline=True)
def _in_order(s, x, y, z, t, u, v, w):
    """Two stresses, each with its axis, the smaller one first."""
    turn = s > t
    return (
        t if turn else s, u if turn else x, v if turn else y, w if turn else z,
        s if turn else t, x if turn else u, y if turn else v, z if turn else w,
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def return_in_space(n, lanes):
    """Plastic strains of n principal stresses, how they flow, and shear, volume and work of the flow."""
    for e in range(U(n)):
        s1, x1, y1, z1, s2, x2, y2, z2 = _in_order(
            lanes[T11 + e], lanes[X1 + e], lanes[Y1 + e], lanes[Z1 + e],
            lanes[T22 + e], lanes[X2 + e], lanes[Y2 + e], lanes[Z2 + e],
        )  # fmt: skip
        s2, x2, y2, z2, s3, x3, y3, z3 = _in_order(
            s2, x2, y2, z2, lanes[T33 + e], lanes[X3 + e], lanes[Y3 + e], lanes[Z3 + e]
        )
        s1, x1, y1, z1, s2, x2, y2, z2 = _in_order(s1, x1, y1, z1, s2, x2, y2, z2)
        lame, two_mu = lanes[P_LAM + e], lanes[P_MU2 + e]
        r1, r2, r3, how = principal_return(
            s1, s2, s3, lanes[P_PHI + e], lanes[P_PSI + e], lanes[P_STRENGTH + e], lanes[P_TENSILE + e], lame + two_mu,
            lame,
        )  # fmt: skip
        d1, d2, d3 = s1 - r1, s2 - r2, s3 - r3
        common, per = lame / (3.0 * lame + two_mu) * (d1 + d2 + d3), 1.0 / two_mu
        flows = how > 0.0
        e1, e2, e3 = (d1 - common) * per, (d2 - common) * per, (d3 - common) * per
        e1, e2, e3 = e1 if flows else 0.0, e2 if flows else 0.0, e3 if flows else 0.0
        lanes[P11 + e] = e1 * (x1 * x1) + e2 * (x2 * x2) + e3 * (x3 * x3)
        lanes[P22 + e] = e1 * (y1 * y1) + e2 * (y2 * y2) + e3 * (y3 * y3)
        lanes[P12 + e] = e1 * (x1 * y1) + e2 * (x2 * y2) + e3 * (x3 * y3)
        lanes[P33 + e] = e1 * (z1 * z1) + e2 * (z2 * z2) + e3 * (z3 * z3)
        lanes[P13 + e] = e1 * (x1 * z1) + e2 * (x2 * z2) + e3 * (x3 * z3)
        lanes[P23 + e] = e1 * (y1 * z1) + e2 * (y2 * z2) + e3 * (y3 * z3)
        lanes[HOW + e] = how
        volume = e1 + e2 + e3
        third = volume / 3.0
        g1, g2, g3 = e1 - third, e2 - third, e3 - third
        lanes[P_SHEAR + e] = math.sqrt(0.5 * (g1 * g1 + g2 * g2 + g3 * g3))
        lanes[P_VOLUME + e] = volume
        lanes[P_WORK + e] = (r1 * e1 + r2 * e2 + r3 * e3) * lanes[P_SIZE + e]
        lanes[P_SHORT + e] = -((e1 if e1 < 0.0 else 0.0) + (e2 if e2 < 0.0 else 0.0) + (e3 if e3 < 0.0 else 0.0))

"""Contact of triangles by potentials (Munjiza 2004), with friction: the loop over the pairs that detect.py found.

phi = 3 min(lambda_k) inside a triangle, lambda_k its barycentric coordinates. An edge of one triangle, the contactor,
with length L and outward normal n takes the force -P L n int phi dt from the other, the target, t from 0 to 1 along the
edge; it falls on the two ends by the first moment of phi, and its opposite on the corners of the target by lambda at
the centre of the force. Free edges of both triangles are contactors (the opposite sides of an inner edge would take
opposite forces). phi along an edge is piecewise linear, so all integrals are exact.

A row of the list has one set of properties for all its edges. Where edges of a pair differ it stands in several rows,
each with some of the edges; where the target has faces of several kinds the row has one edge, and takes the properties
of the face that this edge touches, as it lies now (`_choose`).

Friction: each (edge, target) remembers a force F_s along the edge, F_s -= P_s l v_s dt, |F_s| <= tan(phi) F_n, with l
the part of the edge inside the target and v_s the sliding speed at the centre of the force (Cundall & Strack 1979).

Pairs go through in batches (numerics/lanes.py): first those that do not overlap are sorted out, then the law is
evaluated without jumps. Each pair writes its twelve forces to a row of its own; elements then collect theirs in the
order of partners.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from hpcdem.numerics.lanes import (
    CAPACITY,
    GROUP,
    U,
    as_bits,
    four_columns,
    lane,
    put_four_columns,
    put_two_columns,
    two_columns,
)
from hpcdem.numerics.on_threads import on_threads

BATCH = 32
"""Number of pairs examined between two tests whether a batch is full."""
ENOUGH = 32
"""Pairs that are worked on together, at least."""

# Columns of the table of pairs (m, 4): normal penalty, shear penalty [Pa], tangent of the friction angle, and a code.
# Code, an integer (its bits): 1 where the first triangle is half of a quad, 2 the second (its third edge lies inside),
# and 4 << k for each contactor k, edges 0 to 2 of the first triangle, then those of the second.
PENALTY, SHEAR, TAN_PHI, CODE = range(4)
PAIR = 4
ALL_EDGES = 4 * 63
# What a pair remembers (m, 6): F_s [N/m] of the edges of the first, then of the second triangle.
EDGES = 6
# Normal damping, where a model asks for it: table (m, 4) of the parts of T [Pa] of the edges of the first and of the
# second triangle, as both press where surfaces lie on each other, exponent b, dashpot [Pa s/m]; history (m, 12):
# largest overlap [m] of the six edges, then the normal stress there [Pa].
LARGEST_STRESS, EXPONENT, DASHPOT = 0, 2, 3
DAMPER = 4
# Faces that a target can be touched at (q, 11): a corner of the target at which the face begins (END 1) or ends (-1),
# the face as a combination of the target's first two edges from its first corner, and the properties it then has.
CORNER, END, ALONG_2, ALONG_3, PROPERTIES = 0, 1, 2, 3, 4
CHOICE = PROPERTIES + 3 + DAMPER

(AX1, AY1, AX2, AY2, AX3, AY3, _, _, BX1, BY1, BX2, BY2, BX3, BY3, _, _,
 AVX1, AVY1, AVX2, AVY2, AVX3, AVY3, _, _, BVX1, BVY1, BVX2, BVY2, BVX3, BVY3, _, _,
 P, PS, MU, WHICH, FS, _, _, _, _, _) = (lane(k) for k in range(42))  # fmt: skip
_A = ((AX1, AY1), (AX2, AY2), (AX3, AY3))
_B = ((BX1, BY1), (BX2, BY2), (BX3, BY3))
_VA = ((AVX1, AVY1), (AVX2, AVY2), (AVX3, AVY3))
_VB = ((BVX1, BVY1), (BVX2, BVY2), (BVX3, BVY3))
_IN_B = tuple(tuple(lane(42 + 3 * c + k) for k in range(3)) for c in range(3))
"""Lanes of the barycentric coordinates of the corners of A in B; and the other way round."""
_IN_A = tuple(tuple(lane(51 + 3 * c + k) for k in range(3)) for c in range(3))
ON = 72
"""First of the lanes of the six edges: 1 where it is a contactor, else 0."""
_ON = tuple(lane(ON + k) for k in range(6))
WITHIN_A, WITHIN_B = lane(78), lane(79)
"""1 where the triangle is half of a quad, else 0."""
LESS = lane(80)
"""What damping leaves of the normal force of the edge at hand."""
FORCES = 60
"""First of the lanes of the forces (fx, fy) on the three corners of A, then of B."""
LANES = 81
ROOM = CAPACITY
_ONE, _TWO, _THREE, _FOUR = U(1), U(2), U(3), U(4)
_NEXT, _AFTER, _LAST = lane(1), lane(2), lane(4)
"""From the x of a corner to its y, to the next corner, to the one after that."""


@njit(cache=True, nogil=True, error_model="numpy")
def _corners(a, n, slots, first, second, place, x, lanes, at_a, at_b):
    """Rows of both triangles of n pairs into lanes; slots[a:] are their numbers."""
    for e in range(U(0), U(n), _FOUR):
        i = U(a) + e
        k0, k1, k2, k3 = slots[i], slots[i + _ONE], slots[i + _TWO], slots[i + _THREE]
        p = U(place[first[k0]]), U(place[first[k1]]), U(place[first[k2]]), U(place[first[k3]])
        four_columns(lanes, at_a + e, x, p)
        p = (p[0] + _FOUR, p[1] + _FOUR, p[2] + _FOUR, p[3] + _FOUR)
        two_columns(lanes, at_a + U(4 * CAPACITY) + e, x, p)
        p = U(place[second[k0]]), U(place[second[k1]]), U(place[second[k2]]), U(place[second[k3]])
        four_columns(lanes, at_b + e, x, p)
        p = (p[0] + _FOUR, p[1] + _FOUR, p[2] + _FOUR, p[3] + _FOUR)
        two_columns(lanes, at_b + U(4 * CAPACITY) + e, x, p)


@njit(cache=True, error_model="numpy", forceinline=True)
def _beyond(x0, y0, x1, y1, ax, ay, bx, by, cx, cy):
    """Return whether three points all lie to the right of, or on, the line from 0 to 1."""
    ux, uy = x1 - x0, y1 - y0
    a = ux * (ay - y0) - uy * (ax - x0)
    b = ux * (by - y0) - uy * (bx - x0)
    c = ux * (cy - y0) - uy * (cx - x0)
    most = a if a > b else b
    most = most if most > c else c
    return most <= 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _apart(n, lanes, flags):
    """flags[e] = 1 where no edge separates the two triangles of pair e."""
    for e in range(U(n)):
        ax1, ay1, ax2, ay2 = lanes[AX1 + e], lanes[AY1 + e], lanes[AX2 + e], lanes[AY2 + e]
        ax3, ay3, bx1, by1 = lanes[AX3 + e], lanes[AY3 + e], lanes[BX1 + e], lanes[BY1 + e]
        bx2, by2, bx3, by3 = lanes[BX2 + e], lanes[BY2 + e], lanes[BX3 + e], lanes[BY3 + e]
        apart = (
            _beyond(ax1, ay1, ax2, ay2, bx1, by1, bx2, by2, bx3, by3)
            | _beyond(ax2, ay2, ax3, ay3, bx1, by1, bx2, by2, bx3, by3)
            | _beyond(ax3, ay3, ax1, ay1, bx1, by1, bx2, by2, bx3, by3)
            | _beyond(bx1, by1, bx2, by2, ax1, ay1, ax2, ay2, ax3, ay3)
            | _beyond(bx2, by2, bx3, by3, ax1, ay1, ax2, ay2, ax3, ay3)
            | _beyond(bx3, by3, bx1, by1, ax1, ay1, ax2, ay2, ax3, ay3)
        )
        flags[e] = 0 if apart else 1


def _coordinates(corners, points, out):
    """The loop that fills the barycentric coordinates of three points in a triangle."""
    (x1, y1), (x2, y2), (x3, y3) = corners
    (px1, py1), (px2, py2), (px3, py3) = points
    (a1, a2, a3), (b1, b2, b3), (c1, c2, c3) = out

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(n, lanes):
        for e in range(U(n)):
            cx, cy = lanes[x3 + e], lanes[y3 + e]
            ux, uy = lanes[x1 + e] - cx, lanes[y1 + e] - cy
            wx, wy = lanes[x2 + e] - cx, lanes[y2 + e] - cy
            inverse = 1.0 / (ux * wy - uy * wx)
            ux, uy, wx, wy = ux * inverse, uy * inverse, wx * inverse, wy * inverse
            dx, dy = lanes[px1 + e] - cx, lanes[py1 + e] - cy
            one, two = dx * wy - dy * wx, ux * dy - uy * dx
            lanes[a1 + e], lanes[a2 + e], lanes[a3 + e] = one, two, (1.0 - one) - two
            dx, dy = lanes[px2 + e] - cx, lanes[py2 + e] - cy
            one, two = dx * wy - dy * wx, ux * dy - uy * dx
            lanes[b1 + e], lanes[b2 + e], lanes[b3 + e] = one, two, (1.0 - one) - two
            dx, dy = lanes[px3 + e] - cx, lanes[py3 + e] - cy
            one, two = dx * wy - dy * wx, ux * dy - uy * dx
            lanes[c1 + e], lanes[c2 + e], lanes[c3 + e] = one, two, (1.0 - one) - two

    return loop


_a_in_b, _b_in_a = _coordinates(_B, _A, _IN_B), _coordinates(_A, _B, _IN_A)


@njit(cache=True, error_model="numpy", forceinline=True)
def _clip(a, d, t0, t1):
    """The part of t0..t1 in which a + t d >= 0."""
    root = -a / d
    t0 = root if (d > 0.0) & (root > t0) else t0
    t1 = root if (d < 0.0) & (root < t1) else t1
    return t0, -1.0 if (d == 0.0) & (a < 0.0) else t1


@njit(cache=True, error_model="numpy", forceinline=True)
def _crossing(a, da, b, db, t0, t1):
    """Return where a + t da = b + t db, or t0 if that is not between t0 and t1."""
    t = (a - b) / (db - da)
    return t if (t > t0) & (t < t1) else t0


@njit(cache=True, error_model="numpy", forceinline=True)
def _lowest(a1, d1, a2, d2, a3, d3, t):
    p, q, r = a1 + t * d1, a2 + t * d2, a3 + t * d3
    p = p if p < q else q
    p = p if p < r else r
    return p if p > 0.0 else 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def edge_integral(a1, a2, a3, b1, b2, b3, aside):
    """Integrals of phi and t phi along an edge, and the length inside, for an edge of length 1; and largest phi / 3.

    a_k, b_k: lambda_k of the target at both ends; aside: added to lambda_2 in phi (large where the third edge of the
    target lies inside a quad: phi is then 3 min(lambda_1, lambda_3), and continues in the other half).
    """
    d1, d2, d3 = b1 - a1, b2 - a2, b3 - a3
    t0, t1 = _clip(a1, d1, 0.0, 1.0)
    t0, t1 = _clip(a2, d2, t0, t1)
    t0, t1 = _clip(a3, d3, t0, t1)
    t1 = t1 if t1 > t0 else t0
    a2 += aside
    p = _crossing(a1, d1, a2, d2, t0, t1)
    q = _crossing(a2, d2, a3, d3, t0, t1)
    r = _crossing(a3, d3, a1, d1, t0, t1)
    low, high = (p if p < q else q), (q if p < q else p)
    top = r if r > high else high
    high = high if r > high else r
    first, second = (low if low < high else high), (high if low < high else low)
    f0 = _lowest(a1, d1, a2, d2, a3, d3, t0)
    f1 = _lowest(a1, d1, a2, d2, a3, d3, first)
    f2 = _lowest(a1, d1, a2, d2, a3, d3, second)
    f3 = _lowest(a1, d1, a2, d2, a3, d3, top)
    f4 = _lowest(a1, d1, a2, d2, a3, d3, t1)
    w0, w1, w2, w3 = first - t0, second - first, top - second, t1 - top
    zero = (w0 * (f0 + f1) + w1 * (f1 + f2)) + (w2 * (f2 + f3) + w3 * (f3 + f4))
    one = (
        w0 * ((2.0 * t0 + first) * f0 + (t0 + 2.0 * first) * f1)
        + w1 * ((2.0 * first + second) * f1 + (first + 2.0 * second) * f2)
    ) + (
        w2 * ((2.0 * second + top) * f2 + (second + 2.0 * top) * f3)
        + w3 * ((2.0 * top + t1) * f3 + (top + 2.0 * t1) * f4)
    )
    deepest = f1 if f1 > f2 else f2
    deepest = deepest if deepest > f3 else f3
    deepest = deepest if deepest > f0 else f0
    deepest = deepest if deepest > f4 else f4
    return 1.5 * zero, 0.5 * one, t1 - t0, deepest


@njit(cache=True, error_model="numpy", forceinline=True)
def _edge(
    xa, ya, xb, yb, ua, wa, ub, wb, u1, w1, u2, w2, u3, w3, a1, a2, a3, b1, b2, b3, aside, penalty, stiff, mu, old,
    less, dt,
):  # fmt: skip
    """One edge of the contactor, from (xa, ya) to (xb, yb), in the target: normal force times `less` and friction.

    u, w: velocities of the ends a, b and of the target's corners 1, 2, 3; a_k, b_k, aside: see `edge_integral`;
    penalty: 0 where the edge is no contactor, so that nothing acts; old: F_s so far. Returns F_s, the force (x, y) on
    the contactor, where along the edge it acts, and the barycentric coordinates of that place in the target.
    """
    zero, one, length, _ = edge_integral(a1, a2, a3, b1, b2, b3, aside)
    ex, ey = xb - xa, yb - ya
    size = math.sqrt(ex * ex + ey * ey)
    inverse = 1.0 / size
    ex, ey = ex * inverse, ey * inverse
    t = one / zero if zero > 0.0 else 0.0
    l1, l2, l3 = a1 + t * (b1 - a1), a2 + t * (b2 - a2), a3 + t * (b3 - a3)
    vx, vy = ua + t * (ub - ua), wa + t * (wb - wa)
    vx -= (l1 * u1 + l2 * u2) + l3 * u3
    vy -= (l1 * w1 + l2 * w2) + l3 * w3
    normal = penalty * size * zero * less
    shear = old - stiff * length * (vx * ex + vy * ey) * dt
    most = mu * normal
    shear = shear if shear < most else most
    shear = shear if shear > -most else -most
    # On the contactor: -normal (ey, -ex) + shear (ex, ey).
    return shear, shear * ex - normal * ey, shear * ey + normal * ex, t, l1, l2, l3


def _edge_loop(side, m):
    """The loop over edge m of triangle A (side 0) or B in the other one; it adds to the lanes FORCES... One function
    each: distances between lanes must be constants."""
    own, other = (_A, _B) if side == 0 else (_B, _A)
    mine, other = (_VA, _VB) if side == 0 else (_VB, _VA)
    m2 = (m + 1) % 3
    (xa, ya), (xb, yb), (ua, wa), (ub, wb) = own[m], own[m2], mine[m], mine[m2]
    (u1, w1), (u2, w2), (u3, w3) = other
    (a1, a2, a3), (b1, b2, b3) = (_IN_B, _IN_A)[side][m], (_IN_B, _IN_A)[side][m2]
    old, aside, on = lane(36 + 3 * side + m), (WITHIN_B, WITHIN_A)[side], lane(ON + 3 * side + m)
    first, second, target = (lane(FORCES + k) for k in (6 * side + 2 * m, 6 * side + 2 * m2, 6 - 6 * side))

    @njit(cache=True, nogil=True, error_model="numpy")
    def loop(n, dt, lanes):
        for e in range(U(n)):
            shear, fx, fy, t, l1, l2, l3 = _edge(
                lanes[xa + e], lanes[ya + e], lanes[xb + e], lanes[yb + e],
                lanes[ua + e], lanes[wa + e], lanes[ub + e], lanes[wb + e],
                lanes[u1 + e], lanes[w1 + e], lanes[u2 + e], lanes[w2 + e], lanes[u3 + e], lanes[w3 + e],
                lanes[a1 + e], lanes[a2 + e], lanes[a3 + e], lanes[b1 + e], lanes[b2 + e], lanes[b3 + e],
                1e30 * lanes[aside + e], lanes[on + e] * lanes[P + e], lanes[PS + e], lanes[MU + e], lanes[old + e],
                lanes[LESS + e], dt,
            )  # fmt: skip
            lanes[old + e] = shear
            rest = 1.0 - t
            lanes[first + e] += rest * fx
            lanes[first + _NEXT + e] += rest * fy
            lanes[second + e] += t * fx
            lanes[second + _NEXT + e] += t * fy
            lanes[target + e] -= l1 * fx
            lanes[target + _NEXT + e] -= l1 * fy
            lanes[target + _AFTER + e] -= l2 * fx
            lanes[target + _AFTER + _NEXT + e] -= l2 * fy
            lanes[target + _LAST + e] -= l3 * fx
            lanes[target + _LAST + _NEXT + e] -= l3 * fy

    return loop


_edge_a0, _edge_a1, _edge_a2 = _edge_loop(0, 0), _edge_loop(0, 1), _edge_loop(0, 2)
_edge_b0, _edge_b1, _edge_b2 = _edge_loop(1, 0), _edge_loop(1, 1), _edge_loop(1, 2)


@njit(cache=True, nogil=True, error_model="numpy")
def _damp(n, side, m, slots, dampers, largest, lanes):
    """Compute what damping leaves of the normal force of edge m of triangle A (side 0) or B, into the lane LESS; the
    history moves on.

    While surfaces approach sigma = min(sigma_try, T_side), T_side the part of T of edges of this triangle, sigma_try
    the mean normal stress on the part inside; below the largest overlap o_max it is min(sigma_try, sigma(o_max) (o /
    o_max)^b). o: largest of 3-lambda depth times the mean altitude of the target. A dashpot adds c v, v the speed of
    approach at the centre of the force, without pulling (Cundall & Strack 1979), on edges that look against the nearest
    side of the target: others, at acute corners, would hold back what parts.
    """
    size = U(CAPACITY)
    on = U((ON + 3 * side + m) * CAPACITY)
    x_a, x_b = U((8 * side + 2 * m) * CAPACITY), U((8 * side + 2 * ((m + 1) % 3)) * CAPACITY)
    v_a, v_b, v_t = x_a + U(16 * CAPACITY), x_b + U(16 * CAPACITY), U((24 - 8 * side) * CAPACITY)
    from_a, from_b = U((42 + 9 * side + 3 * m) * CAPACITY), U((42 + 9 * side + 3 * ((m + 1) % 3)) * CAPACITY)
    target, within = U((8 - 8 * side) * CAPACITY), WITHIN_B if side == 0 else WITHIN_A
    for e in range(U(n)):
        k = slots[e]
        most, exponent = dampers[DAMPER * k + LARGEST_STRESS + side], dampers[DAMPER * k + EXPONENT]
        dashpot = dampers[DAMPER * k + DASHPOT]
        lanes[LESS + e] = 1.0
        if (most == math.inf and exponent == 1.0 and dashpot == 0.0) or lanes[on + e] == 0.0:
            continue
        a, b, t = from_a + e, from_b + e, target + e
        zero, one, length, deepest = edge_integral(
            lanes[a], lanes[a + size], lanes[a + _TWO * size], lanes[b], lanes[b + size], lanes[b + _TWO * size],
            1e30 * lanes[within + e],
        )  # fmt: skip
        at = 2 * EDGES * k + 3 * side + m
        if not (zero > 0.0 and length > 0.0):
            largest[at] = largest[at + EDGES] = 0.0
            continue
        x1, y1 = lanes[t], lanes[t + size]
        ux, uy = lanes[t + _TWO * size] - x1, lanes[t + _THREE * size] - y1
        wx, wy = lanes[t + _FOUR * size] - x1, lanes[t + U(5) * size] - y1
        around = math.sqrt(ux * ux + uy * uy) + math.sqrt(wx * wx + wy * wy)
        around += math.sqrt((wx - ux) ** 2 + (wy - uy) ** 2)
        overlap = deepest * 3.0 * (ux * wy - uy * wx) / around
        wanted = lanes[P + e] * zero / length
        if overlap >= largest[at]:
            stress = min(wanted, most)
            largest[at], largest[at + EDGES] = overlap, stress
        else:
            stress = min(wanted, largest[at + EDGES] * (overlap / largest[at]) ** exponent)
        if dashpot > 0.0:
            place, c = one / zero, v_t + e
            ex, ey = lanes[x_b + e] - lanes[x_a + e], lanes[x_b + size + e] - lanes[x_a + size + e]
            vx = lanes[v_a + e] + place * (lanes[v_b + e] - lanes[v_a + e])
            vy = lanes[v_a + size + e] + place * (lanes[v_b + size + e] - lanes[v_a + size + e])
            least, against = math.inf, 0.0
            for k3 in range(_THREE):
                part = lanes[a + k3 * size] + place * (lanes[b + k3 * size] - lanes[a + k3 * size])
                vx -= part * lanes[c + _TWO * k3 * size]
                vy -= part * lanes[c + (_TWO * k3 + _ONE) * size]
                if part < least and (k3 != _ONE or lanes[within + e] == 0.0):
                    q, r = t + _TWO * ((k3 + _ONE) % _THREE) * size, t + _TWO * ((k3 + _TWO) % _THREE) * size
                    least = part
                    against = ex * (lanes[r] - lanes[q]) + ey * (lanes[r + size] - lanes[q + size])
            approach = (vx * ey - vy * ex) / math.sqrt(ex * ex + ey * ey)
            if against < 0.0:
                stress = max(0.0, stress + dashpot * approach)
        lanes[LESS + e] = stress / wanted


@njit(cache=True, error_model="numpy")
def inside(xa, ya, xb, yb, x1, y1, x2, y2, x3, y3):
    """The part t0..t1 of the edge from a to b that lies in a triangle; t1 <= t0: none."""
    ux, uy, wx, wy = x1 - x3, y1 - y3, x2 - x3, y2 - y3
    det = ux * wy - uy * wx
    a1, b1 = ((xa - x3) * wy - (ya - y3) * wx) / det, ((xb - x3) * wy - (yb - y3) * wx) / det
    a2, b2 = (ux * (ya - y3) - uy * (xa - x3)) / det, (ux * (yb - y3) - uy * (xb - x3)) / det
    t0, t1 = _clip(a1, b1 - a1, 0.0, 1.0)
    t0, t1 = _clip(a2, b2 - a2, t0, t1)
    return _clip((1.0 - a1) - a2, (a1 - b1) + (a2 - b2), t0, t1)


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(n, slots, first, second, x_place, x, pairs, dampers, chosen, choice_begin, choices):
    """Properties of those of n rows whose target has faces of several kinds, into pairs and dampers: of the face that
    is nearest to the middle of the part inside, among those that look against the edge if there are any."""
    for e in range(n):
        k = slots[e]
        c = chosen[k]
        if c < 0:
            continue
        code = as_bits(pairs[PAIR * k + CODE]) >> 2
        m = 0
        while code >> m & 1 == 0:
            m += 1
        own, other = (first[k], second[k]) if m < 3 else (second[k], first[k])
        a, b, t = x_place[own] + 2 * (m % 3), x_place[own] + 2 * ((m + 1) % 3), x_place[other]
        ex, ey = x[b] - x[a], x[b + 1] - x[a + 1]
        t0, t1 = inside(
            x[a], x[a + 1], x[b], x[b + 1], x[t], x[t + 1], x[t + 2], x[t + 3], x[t + 4], x[t + 5]
        )  # fmt: skip
        middle = 0.5 * (t0 + t1) if t1 > t0 else 0.5
        px, py = x[a] + middle * ex, x[a + 1] + middle * ey
        best, nearest, against = -1, math.inf, False
        for q in range(choice_begin[c], choice_begin[c + 1]):
            face = choices[q]
            corner = t + 2 * int(face[CORNER])
            gx = face[ALONG_2] * (x[t + 2] - x[t]) + face[ALONG_3] * (x[t + 4] - x[t])
            gy = face[ALONG_2] * (x[t + 3] - x[t + 1]) + face[ALONG_3] * (x[t + 5] - x[t + 1])
            gx, gy = face[END] * gx, face[END] * gy  # away from the corner
            dx, dy = px - x[corner], py - x[corner + 1]
            along = min(1.0, max(0.0, (dx * gx + dy * gy) / (gx * gx + gy * gy)))
            distance = (dx - along * gx) ** 2 + (dy - along * gy) ** 2
            opposed = face[END] * (ex * gx + ey * gy) < 0.0
            if best < 0 or (opposed and not against) or (opposed == against and distance < nearest):
                best, nearest, against = q, distance, opposed
        for p in range(3):
            pairs[PAIR * k + p] = choices[best, PROPERTIES + p]
        for p in range(min(len(dampers), DAMPER)):
            dampers[DAMPER * k + p] = choices[best, PROPERTIES + 3 + p]


@njit(cache=True, nogil=True, error_model="numpy")
def _edges(n, dt, lanes):
    """Compute the forces of all edges of both triangles in the other one."""
    for e in range(U(n)):
        lanes[LESS + e] = 1.0
    _edge_a0(n, dt, lanes)
    _edge_a1(n, dt, lanes)
    _edge_a2(n, dt, lanes)
    _edge_b0(n, dt, lanes)
    _edge_b1(n, dt, lanes)
    _edge_b2(n, dt, lanes)


_A_SIDE, _B_SIDE = np.int64(0), np.int64(1)
_FIRST, _SECOND, _THIRD = np.int64(0), np.int64(1), np.int64(2)
"""Not literals, for each of which numba would compile `_damp` once more."""


@njit(cache=True, nogil=True, error_model="numpy")
def _damped_edges(n, slots, dampers, largest, dt, lanes):
    """Compute the forces of all edges of both triangles with normal damping."""
    _damp(n, _A_SIDE, _FIRST, slots, dampers, largest, lanes)
    _edge_a0(n, dt, lanes)
    _damp(n, _A_SIDE, _SECOND, slots, dampers, largest, lanes)
    _edge_a1(n, dt, lanes)
    _damp(n, _A_SIDE, _THIRD, slots, dampers, largest, lanes)
    _edge_a2(n, dt, lanes)
    _damp(n, _B_SIDE, _FIRST, slots, dampers, largest, lanes)
    _edge_b0(n, dt, lanes)
    _damp(n, _B_SIDE, _SECOND, slots, dampers, largest, lanes)
    _edge_b1(n, dt, lanes)
    _damp(n, _B_SIDE, _THIRD, slots, dampers, largest, lanes)
    _edge_b2(n, dt, lanes)


@njit(cache=True, nogil=True, error_model="numpy")
def _law(n, slots, first, second, x_place, v_place, x, v, pairs, history, dampers, largest, dt, lanes):
    """Forces of n overlapping pairs into the lanes FORCES...; their histories move on by dt."""
    _corners(0, n, slots, first, second, x_place, x, lanes, AX1, BX1)
    _corners(0, n, slots, first, second, v_place, v, lanes, AVX1, BVX1)
    for e in range(U(0), U(n), _FOUR):
        k0, k1, k2, k3 = U(slots[e]), U(slots[e + _ONE]), U(slots[e + _TWO]), U(slots[e + _THREE])
        four_columns(lanes, P + e, pairs, (k0 * _FOUR, k1 * _FOUR, k2 * _FOUR, k3 * _FOUR))
        six = U(EDGES)
        at = (k0 * six, k1 * six, k2 * six, k3 * six)
        four_columns(lanes, FS + e, history, at)
        two_columns(
            lanes, FS + U(4 * CAPACITY) + e, history, (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR)
        )
    for e in range(U(n)):
        code = as_bits(lanes[WHICH + e])
        lanes[_ON[0] + e] = 1.0 if code & 4 != 0 else 0.0
        lanes[_ON[1] + e] = 1.0 if code & 8 != 0 else 0.0
        lanes[_ON[2] + e] = 1.0 if code & 16 != 0 else 0.0
        lanes[_ON[3] + e] = 1.0 if code & 32 != 0 else 0.0
        lanes[_ON[4] + e] = 1.0 if code & 64 != 0 else 0.0
        lanes[_ON[5] + e] = 1.0 if code & 128 != 0 else 0.0
        lanes[WITHIN_A + e] = 1.0 if code & 1 != 0 else 0.0
        lanes[WITHIN_B + e] = 1.0 if code & 2 != 0 else 0.0
    for c in range(U(12)):
        for e in range(U(n)):
            lanes[U(FORCES * CAPACITY) + c * U(CAPACITY) + e] = 0.0
    _a_in_b(n, lanes)
    _b_in_a(n, lanes)
    if len(dampers) > 0:
        _damped_edges(n, slots, dampers, largest, dt, lanes)
    else:
        _edges(n, dt, lanes)


@njit(cache=True, nogil=True, error_model="numpy")
def _put(n, slots, out, history, lanes):
    """Forces and histories of n pairs from lanes to their rows."""
    forces, twelve, six = U(FORCES * CAPACITY), U(12), U(EDGES)
    whole = n // GROUP * GROUP
    for e in range(U(0), U(whole), _FOUR):
        k0, k1, k2, k3 = U(slots[e]), U(slots[e + _ONE]), U(slots[e + _TWO]), U(slots[e + _THREE])
        for c in range(U(0), U(12), _FOUR):
            at = (k0 * twelve + c, k1 * twelve + c, k2 * twelve + c, k3 * twelve + c)
            put_four_columns(out, at, lanes, forces + c * U(CAPACITY) + e)
        at = (k0 * six, k1 * six, k2 * six, k3 * six)
        put_four_columns(history, at, lanes, FS + e)
        at = (at[0] + _FOUR, at[1] + _FOUR, at[2] + _FOUR, at[3] + _FOUR)
        put_two_columns(history, at, lanes, FS + U(4 * CAPACITY) + e)
    for e in range(U(whole), U(n)):
        k = U(slots[e])
        for c in range(U(12)):
            out[k * twelve + c] = lanes[forces + c * U(CAPACITY) + e]
        for c in range(U(EDGES)):
            history[k * six + c] = lanes[FS + c * U(CAPACITY) + e]


@njit(cache=True, nogil=True, error_model="numpy")
def _forces(
    t, threads, first, second, x_place, v_place, x, v, pairs, history, dampers, largest, chosen, choice_begin, choices,
    touching, out, dt,
):  # fmt: skip
    lanes, slots = np.zeros(LANES * CAPACITY), np.zeros(ROOM, np.int64)
    candidates, flags = np.zeros(BATCH + GROUP, np.int64), np.zeros(BATCH + GROUP, np.int64)
    x, v, pairs, history = (
        x.reshape(x.size),
        v.reshape(v.size),
        pairs.reshape(pairs.size),
        history.reshape(history.size),
    )
    dampers, largest, out = dampers.reshape(dampers.size), largest.reshape(largest.size), out.reshape(out.size)
    m = len(first)
    at, stop = m * t // threads, m * (t + 1) // threads
    n = 0
    while at < stop or n > 0:
        upto = min(at + BATCH, stop)
        count = upto - at
        if count > 0:
            for e in range(count + GROUP):
                candidates[e] = min(at + e, stop - 1)
            _corners(0, count, candidates, first, second, x_place, x, lanes, AX1, BX1)
            _apart(count, lanes, flags)
            for e in range(count):
                k = at + e
                slots[n] = k
                n += flags[e]
                if touching[k] > flags[e]:
                    for q in range(EDGES):
                        history[EDGES * k + q] = 0.0
                    for q in range(min(len(largest), 2 * EDGES)):
                        largest[2 * EDGES * k + q] = 0.0
                touching[k] = flags[e]
        at = upto
        if n < ENOUGH and at < stop:
            continue
        for e in range(n, n + GROUP):
            slots[e] = slots[max(n - 1, 0)]
        if len(chosen) > 0:
            _choose(n, slots, first, second, x_place, x, pairs, dampers, chosen, choice_begin, choices)
        if n > 0:
            _law(n, slots, first, second, x_place, v_place, x, v, pairs, history, dampers, largest, dt, lanes)
        _put(n, slots, out, history, lanes)
        n = 0


@on_threads
def forces(threads, *args):
    """Forces of all pairs; histories move on by dt.

    first, second (m,) i8: bodies of each pair; x_place, v_place (bodies,) i8: where their corners begin in x and v
    (flat); pairs (m, 4), history (m, 6), dampers (m, 4), largest (m, 12): see above, the last two without rows if
    nothing is damped; chosen (m,) i8: rows whose properties are chosen, number in choice_begin, else -1; choice_begin
    (n + 1,) i8: rows of choices (q, 11); without rows if no pair has one; touching (m,) u1: pairs that overlap; out
    (m, 12) [N/m]: forces on the corners of the first and of the second body, valid where they touch.
    """
    for t in prange(threads):
        _forces(t, threads, *args)


@njit(cache=True, error_model="numpy")
def _coordinates_in(px, py, x, t):
    """Barycentric coordinates of a point in the triangle with corners from x[t]."""
    x3, y3 = x[t + 4], x[t + 5]
    ux, uy, wx, wy = x[t] - x3, x[t + 1] - y3, x[t + 2] - x3, x[t + 3] - y3
    inverse = 1.0 / (ux * wy - uy * wx)
    one, two = ((px - x3) * wy - (py - y3) * wx) * inverse, (ux * (py - y3) - uy * (px - x3)) * inverse
    return one, two, (1.0 - one) - two


@njit(cache=True, nogil=True, error_model="numpy")
def _parts(t, threads, first, second, x_place, x, pairs, touching, part):
    x, pairs = x.reshape(x.size), pairs.reshape(pairs.size)
    for k in range(len(first) * t // threads, len(first) * (t + 1) // threads):
        part[k] = 0.0
        if touching[k] == 0:
            continue
        code = as_bits(pairs[PAIR * k + CODE])
        for side in range(2):
            own, other = (first[k], second[k]) if side == 0 else (second[k], first[k])
            o, target, aside = x_place[own], x_place[other], 1e30 if code >> (1 - side) & 1 else 0.0
            for m in range(3):
                if code >> (2 + 3 * side + m) & 1 == 0:
                    continue
                a, b = o + 2 * m, o + 2 * ((m + 1) % 3)
                a1, a2, a3 = _coordinates_in(x[a], x[a + 1], x, target)
                b1, b2, b3 = _coordinates_in(x[b], x[b + 1], x, target)
                part[k] = max(part[k], edge_integral(a1, a2, a3, b1, b2, b3, aside)[3])


@on_threads
def parts(threads, *args):
    """Return how deep the contactors of each row are in the other body, over its altitude there: part (m,), at most
    1/3, 0 where they do not touch. Arguments as those of `forces`."""
    for t in prange(threads):
        _parts(t, threads, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def depths(first, second, free, x_place, x, depth):
    """Return how deep the free edges (bits of `free`) of the two bodies of each pair are in the other one: depth (m, 3)
    [m], and where. It is the distance to the nearest side of the target, so no more than the radius of its inscribed
    circle."""
    x = x.reshape(x.size)
    for p in range(len(first)):
        depth[p] = 0.0
        for side in range(2):
            own, other = (first[p], second[p]) if side == 0 else (second[p], first[p])
            o, t = x_place[own], x_place[other]
            for m in range(3):
                if free[own] >> m & 1 == 0:
                    continue
                a, b = o + 2 * m, o + 2 * ((m + 1) % 3)
                t0, t1 = inside(
                    x[a], x[a + 1], x[b], x[b + 1], x[t], x[t + 1], x[t + 2], x[t + 3], x[t + 4], x[t + 5]
                )  # fmt: skip
                if not t1 > t0:
                    continue
                for k in range(9):
                    part = t0 + (t1 - t0) * k / 8
                    px, py = x[a] + part * (x[b] - x[a]), x[a + 1] + part * (x[b + 1] - x[a + 1])
                    least = math.inf
                    for c in range(3):
                        q, r = t + 2 * c, t + 2 * ((c + 1) % 3)
                        gx, gy = x[r] - x[q], x[r + 1] - x[q + 1]
                        least = min(least, (gx * (py - x[q + 1]) - gy * (px - x[q])) / math.sqrt(gx * gx + gy * gy))
                    if least > depth[p, 0]:
                        depth[p, 0], depth[p, 1], depth[p, 2] = least, px, py


@njit(cache=True, nogil=True, error_model="numpy")
def _collect(t, threads, begin, entry, start, corners, touching, out, pushed):
    n = len(corners)
    for i in range(n * t // threads, n * (t + 1) // threads):
        for c in range(8):
            pushed[i, c] = 0.0
        nc = corners[i]
        for m in range(begin[i], begin[i + 1]):
            k = entry[m] >> 1
            if touching[k] == 0:
                continue
            from_ = 6 * (entry[m] & 1)
            for c in range(3):
                at = start[m] + c
                at = 2 * (at if at < nc else at - nc)
                pushed[i, at] += out[k, from_ + 2 * c]
                pushed[i, at + 1] += out[k, from_ + 2 * c + 1]


@on_threads
def collect(threads, *args):
    """Sum of the contact forces on the corners of each element of the contact set, in the order of partners.

    begin (n + 1,), entry (k,): pair * 2 + side, start (k,): the element's corner that is the body's first; corners
    (n,): 3 or 4; pushed (n, 8) [N/m].
    """
    for t in prange(threads):
        _collect(t, threads, *args)

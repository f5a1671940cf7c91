"""Compute tangent stiffness and stored energy of joints at their points of evaluation, for edges in the plane and
triangles in space. (Loops over forces have passes of their own: elements.py, softening.py, joints_space.py,
joints_hexes.py. Stiffness of elements: elements/tangent.py.)

A point has an opening o along the normal n and a slip s along m; in the plane s is signed and m the tangent, in space s
is the size of the slip and m its direction. With the traction t = sigma n + tau m and the share N_a of each corner in
the movement of the point, below zero on this side,

    K = sum over points W N_a N_b C
    C = sigma_o n n^T + sigma_s n m^T + tau_o m n^T + tau_s m m^T + tau / s (1 - n n^T - m m^T)

Friction makes tau depend on the opening, so C is not symmetric; that n turns is left out. Behind the peak the slopes
are those of `joint_law.slopes` from what the point remembers of the last balance: along the curve, which falls, where
damage grows, else along the line through the origin.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels import joint_law, joints, laws
from hpcdem.physics.fdem.kernels.joint_law import COHESIVE, LAW, OWN, PATH, STAYS
from hpcdem.physics.fdem.kernels.joints import BROKEN, FAR, INTACT, NEAR
from hpcdem.physics.fdem.kernels.joints_space import mid_edges, opened, parted, unloaded

POINTS = 3
EDGE = np.array([[-NEAR, -FAR, FAR, NEAR], [-0.5, -0.5, 0.5, 0.5], [-FAR, -NEAR, NEAR, FAR]])
TRIANGLE = np.full((POINTS, 6), 1.0 / 6.0) + 0.5 * np.eye(POINTS)[:, [0, 1, 2, 0, 2, 1]]
TRIANGLE[:, :3] *= -1.0
"""Shares (points, corners) of a, b of this side, then p, q of the other, p opposite b; of a, b, c, then p, q, r,
opposite a, c, b."""
OF_EDGE, OF_TRIANGLE = np.array([5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0]), np.ones(POINTS)
"""Weights of points: of the length of an edge, of a third of the area of a triangle."""


@njit(cache=True, nogil=True, error_model="numpy")
def _look(x, own, over, per_h, law, history, n, o, s, m):
    """Opening o (3,) and slip s (3,) [m], less what stays of it, along m (3, dim), of the points of a joint, its normal
    n (dim,); own, over (dim,): where the corners of both sides begin in flat x. Returns what its `weights` are parts
    of, in the plane its length [m], in space [m2], and its length."""
    slides = law[LAW] > COHESIVE
    if len(own) == 2:
        a, b, p, q = own[0], own[1], over[0], over[1]
        tx, ty, h2, oa, sa, ob, sb = joints.openings(x[a], x[a + 1], x[b], x[b + 1], x[p], x[p + 1], x[q], x[q + 1])
        h = math.sqrt(h2)
        inverse = 1.0 / h  # as loops over forces have it: what a point remembers is o and s to the last bit
        oa, sa, ob, sb = oa * inverse, sa * inverse, ob * inverse, sb * inverse
        n[0], n[1] = ty * inverse, -tx * inverse
        o[0], o[1], o[2] = NEAR * oa + FAR * ob, 0.5 * (oa + ob), FAR * oa + NEAR * ob
        s[0], s[1], s[2] = NEAR * sa + FAR * sb, 0.5 * (sa + sb), FAR * sa + NEAR * sb
        for g in range(POINTS):
            m[g, 0], m[g, 1] = tx * inverse, ty * inverse
            if slides:
                s[g] -= history[STAYS + g]
        return h, h
    a, b, c, p, q, r = own[0], own[1], own[2], over[0], over[1], over[2]
    found = opened(
        x[a], x[a + 1], x[a + 2], x[b], x[b + 1], x[b + 2], x[c], x[c + 1], x[c + 2], x[p], x[p + 1], x[p + 2],
        x[q], x[q + 1], x[q + 2], x[r], x[r + 1], x[r + 2],
    )  # fmt: skip
    away = (
        (found[4], found[5], found[6]), (found[7], found[8], found[9]), (found[10], found[11], found[12]),
    )  # fmt: skip
    n[0], n[1], n[2] = found[0], found[1], found[2]
    mid = mid_edges(x, a, b, c, p, q, r)
    for g in range(POINTS):
        o[g], sx, sy, sz, size = parted(away[g][0], away[g][1], away[g][2], n[0], n[1], n[2])
        sx, sy, sz, size = unloaded(sx, sy, sz, size, mid, law, history, g)
        per = 1.0 / (size + laws.TINY)
        s[g], m[g, 0], m[g, 1], m[g, 2] = size, sx * per, sy * per, sz * per
    return found[3] / 3.0, 1.0 / per_h


@njit(cache=True, nogil=True, error_model="numpy")
def _slopes(o, s, h, law, beyond, history, g):
    """Derivatives [Pa/m] of sigma and tau at point g past the peak by opening and slip, less what stays of it: sigma
    by o, by s, tau by o, by s; and tau [Pa]."""
    if law[LAW] == COHESIVE:
        return joint_law.slopes(o, s, h, law, beyond, history, g)
    sign = math.copysign(1.0, s)
    sigma_o, sigma_s, tau_o, tau_s, tau = joint_law.slide_slopes(
        o, abs(s), law, beyond, history[OWN + g], history[PATH + g]
    )
    return sigma_o, sign * sigma_s, sign * tau_o, tau_s, sign * tau


@njit(cache=True, nogil=True, error_model="numpy")
def _add(weight, share, n, m, sigma_o, sigma_s, tau_o, tau_s, aside, c, out):
    """Add what a point brings to K; share: its row of `EDGE` or `TRIANGLE`; c (dim, dim): room."""
    dim, corners = len(n), len(share)
    for i in range(dim):
        for j in range(dim):
            unit = 1.0 if i == j else 0.0
            c[i, j] = weight * (
                n[i] * (sigma_o * n[j] + sigma_s * m[j]) + m[i] * (tau_o * n[j] + tau_s * m[j])
                + aside * (unit - n[i] * n[j] - m[i] * m[j])
            )  # fmt: skip
    for a in range(corners):
        for b in range(corners):
            both = share[a] * share[b]
            for i in range(dim):
                for j in range(dim):
                    out[dim * a + i, dim * b + j] += both * c[i, j]


@njit(cache=True, nogil=True, error_model="numpy")
def stiffness(slots, own, over, per_h, kind, state, history, x, table, beyond, softening, out, left):
    """K (n, m, m) [N/m, in the plane per m] of joints, see `hpcdem.physics.fdem.joints.Joints`, for the corners in the
    order of `EDGE` or `TRIANGLE`, and how much is left (n,) to the peak at the worst point; negative behind it, also
    where a joint has a history of that. softening: joints pass, or are past, their peak by their histories (slots, 14);
    those that slide always."""
    dim = own.shape[1]
    share, weights = (EDGE, OF_EDGE) if dim == 2 else (TRIANGLE, OF_TRIANGLE)
    n, o, s, m, c = np.empty(dim), np.empty(POINTS), np.empty(POINTS), np.empty((POINTS, dim)), np.empty((dim, dim))
    for i in range(len(slots)):
        slot = slots[i]
        law, more, past, slides = table[kind[slot]], beyond[kind[slot]], history[slot], state[slot] > BROKEN
        size, h = _look(x, own[i], over[i], per_h[i], law, past, n, o, s, m)
        out[i] = 0.0
        left[i] = 1.0 if state[slot] == INTACT else -1.0
        if not slides and (left[i] > 0.0 or not softening):
            per = 1.0 / h
            for g in range(POINTS):
                normal, skew, shear, here, tau = joint_law.intact_slopes(o[g] * per, s[g] * per, law)
                left[i] = min(left[i], here)
                aside = abs(tau / s[g]) if abs(s[g]) > laws.TINY else shear * per
                _add(size * weights[g], share[g], n, m[g], normal * per, 0.0, skew * per, shear * per, aside, c, out[i])
        if left[i] < 0.0 and (slides or softening):
            out[i] = 0.0
            for g in range(POINTS):
                sigma_o, sigma_s, tau_o, tau_s, tau = _slopes(o[g], s[g], h, law, more, past, g)
                aside = tau / s[g] if abs(s[g]) > laws.TINY else tau_s
                _add(size * weights[g], share[g], n, m[g], sigma_o, sigma_s, tau_o, tau_s, aside, c, out[i])


@njit(cache=True, nogil=True, error_model="numpy")
def _stored(o, s, h, law, beyond, history, g):
    """Energy per area [J/m2] that a point gives back when it is unloaded."""
    if law[LAW] == COHESIVE:
        return joint_law.stored(o, s, h, law, beyond, history, g)
    return joint_law.slide_stored(o, abs(s), law, beyond, history[OWN + g], history[PATH + g])


@njit(cache=True, nogil=True, error_model="numpy")
def stored(slots, own, over, per_h, kind, state, history, x, table, beyond, out):
    """Return the energy that joints (see `stiffness`) release when they are unloaded (n,) [J], in the plane [J/m]."""
    dim = own.shape[1]
    n, o, s, m = np.empty(dim), np.empty(POINTS), np.empty(POINTS), np.empty((POINTS, dim))
    for i in range(len(slots)):
        law, more, past = table[kind[slots[i]]], beyond[kind[slots[i]]], history[slots[i]]
        size, h = _look(x, own[i], over[i], per_h[i], law, past, n, o, s, m)
        one, two, three = (
            _stored(o[0], s[0], h, law, more, past, 0), _stored(o[1], s[1], h, law, more, past, 1),
            _stored(o[2], s[2], h, law, more, past, 2),
        )  # fmt: skip
        if dim == 2:
            out[i] = size * (5.0 / 18.0 * (one + three) + 8.0 / 18.0 * two)
        else:
            out[i] = size * (one + (two + three))

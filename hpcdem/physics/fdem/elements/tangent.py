"""Tangent stiffness of elements, once for all kinds: what their forces change by when corners move.

A part of an element (kind.py) with the gradients g_a of its shape functions, its volume V (in the plane an area) and
its stress sigma has, with the trace of its strain taken as the mean over its overlay,

    K_ab = V [mu (g_b g_a^T - 2 / d g_a g_b^T) + (mu g_a . g_b + g_a . sigma g_b) 1],   d: 2 in the plane, 3 in space
    K    = sum over parts K_ab + sum over overlays (lambda + 2 mu / d) V T T^T,         T = sum V_i g_i / sum V_i

and where there are two overlays each counts half (mixed discretisation: Marti & Cundall 1982). With small strains
gradients are those of the mesh and the term with the stress, which turns with the element, is left out: then K is the
exact derivative of the forces. With large strains gradients and volumes are the present ones, and K the derivative up
to terms of the order of the strain. A part of a six-node triangle is a Gauss point of all its nodes.

Where stresses flow, K loses sum V B^T C B: C is what the derivative of the return of stresses (plasticity.py) lacks of
the elastic stiffness (the consistent tangent of Simo & Taylor 1985, for a return in principal stresses: Clausen,
Damkilde & Andersen 2007). The principal stresses r to which s1 <= s2 <= s3 return are linear in these as long as the
same planes are active, dr = T ds, with T from the formulas of plasticity.py. The axes turn with those of the trial
stress, so that the shear stress between two of them changes by

    d s_ij = G (r_i - r_j) / (s_i - s_j) d g_ij;   if s_i = s_j: G (T_ii - T_ij) d g_ij.

B makes strains along these axes of the movements of corners, with the mean trace. That the parts of an overlay share
their trace after the flow makes no forces.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from hpcdem.physics.fdem.elements import parts
from hpcdem.physics.fdem.elements.kind import Kind
from hpcdem.physics.fdem.elements.parts import _by_kind as by_kind
from hpcdem.physics.fdem.kernels import tets
from hpcdem.physics.fdem.kernels.plasticity import (
    HIGH,
    LOW,
    N_PHI,
    N_PSI,
    SIDE,
    STRENGTH,
    TENSILE,
    plane_stress_return,
    principal_return,
)
from hpcdem.physics.fdem.kernels.strength import SHEAR_NOW, TENSION_NOW
from hpcdem.physics.fdem.six import kernels as six

KEPT = 1e-6
"""Part of the elastic stiffness that an element keeps in the tangent, which would be zero at the tip of the yield
surface."""
PAIRS = ((0, 1), (0, 2), (1, 2))


@njit(error_model="numpy")
def _plane_inverse(m, out):
    """Inverse of m (2, 2), and its determinant."""
    det = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
    out[0, 0], out[0, 1], out[1, 0], out[1, 1] = m[1, 1] / det, -m[0, 1] / det, -m[1, 0] / det, m[0, 0] / det
    return det


@njit(error_model="numpy")
def _space_inverse(m, out):
    """Invert m (3, 3)."""
    for i in range(3):
        for j in range(3):
            p, q, r, s = (j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3
            out[i, j] = m[p, r] * m[q, s] - m[p, s] * m[q, r]
    det = m[0, 0] * out[0, 0] + m[1, 0] * out[0, 1] + m[2, 0] * out[0, 2]
    for i in range(3):
        for j in range(3):
            out[i, j] /= det
    return det


def _gradients(kind: Kind) -> Any:
    dim, ends = kind.dim, np.array(kind.parts)
    invert, full = (_plane_inverse, 2.0) if dim == 2 else (_space_inverse, 6.0)

    @njit(error_model="numpy")
    def mesh_volume(c):
        if dim == 2:
            return 0.5 / (c[0] * c[3] - c[1] * c[2])
        return 1.0 / tets.per_volume(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8])

    @njit(error_model="numpy")
    def gradients(g, i, p, small, out):
        m, a = np.empty((dim, dim)), np.empty((dim, dim))
        if small:
            c = parts.inverse(g, i, p)
            for k in range(dim):
                for j in range(dim):
                    a[k, j] = c[dim * k + j]
            volume = mesh_volume(c)
        else:
            first = parts.corner(g, i, ends[p, 0])
            for k in range(dim):
                at = parts.corner(g, i, ends[p, k + 1])
                for j in range(dim):
                    m[j, k] = g.x[at + j] - g.x[first + j]
            volume = invert(m, a) / full
        for j in range(dim):
            out[0, j] = 0.0
            for k in range(dim):
                out[k + 1, j] = a[k, j]
                out[0, j] -= a[k, j]
        return volume

    @njit(error_model="numpy")
    def of_six_nodes(g, i, p, small, out):
        m11, m12, m21, m22 = parts.inverse(g, i, p)
        f11, f12, f21, f22 = six.gradient(i, p, g.place, g.x, g.c)
        volume, det = parts.volume(g, i, p), f11 * f22 - f12 * f21
        for a in range(6):
            d, e = six.SLOPES[p, a, 0], six.SLOPES[p, a, 1]
            x, y = d * m11 + e * m21, d * m12 + e * m22
            out[a, 0], out[a, 1] = (x, y) if small else ((x * f22 - y * f21) / det, (y * f11 - x * f12) / det)
        return volume if small else volume * det

    return gradients if len(kind.parts[0]) == dim + 1 else of_six_nodes


gradients = by_kind(_gradients)
"""gradients(g, i, p, small, out): of the shape functions of a part into out (its nodes, d) [1/m], those of the mesh or
the present ones, and its volume."""


@njit(error_model="numpy")
def trial(g, i, s0, small, s, frames):
    """Stresses s (parts, 4 or 6) [Pa] of an elastic element with the stress s0 (parts, 4 or more) without strain, in
    the frames that turn with its parts."""
    lame, two_mu, free = parts.moduli(g, i)
    parts.strains(g, i, small, s, frames)
    for p in range(len(s)):
        pressure = lame * parts.trace(g, s, p)
        for k in range(s.shape[1]):
            s[p, k] = s0[p, k] + two_mu * s[p, k]
        s[p, 0] += pressure
        s[p, 1] += pressure
        s[p, 3] += pressure - free * pressure


def _elastic(kind: Kind) -> Any:
    dim, corners, overlays, each, counts = kind.dim, np.array(kind.parts), kind.overlays, kind.each, 1.0 / kind.overlays
    size, nodes = dim * kind.corners, corners.shape[1]
    normal, shear = ((0, 1), ((0, 1, 2),)) if dim == 2 else ((0, 1, 3), ((0, 1, 2), (0, 2, 4), (1, 2, 5)))

    @njit(error_model="numpy")
    def elastic(g, who, s0, small, out):
        s, frames = parts.room(g)
        slope, whole, t = np.empty((nodes, dim)), np.empty(size), np.zeros((dim, dim))
        for n in range(len(who)):
            i, k = who[n], out[n]
            lame, two_mu, _ = parts.moduli(g, i)
            mu = 0.5 * two_mu
            k[:] = 0.0
            if not small:
                trial(g, i, s0[i], small, s, frames)
            for overlay in range(overlays):
                whole[:] = 0.0
                total = 0.0
                for p in range(each * overlay, each * overlay + each):
                    volume = counts * gradients(g, i, p, small, slope)
                    total += volume
                    if not small:
                        turned = parts.turned(g, s[p], frames[p])
                        for a in range(dim):
                            t[a, a] = turned[normal[a]]
                        for a, b, c in shear:
                            t[a, b] = t[b, a] = turned[c]
                    for a in range(nodes):
                        at = dim * corners[p, a]
                        for b in range(nodes):
                            to, both = dim * corners[p, b], 0.0
                            for q in range(dim):
                                both += slope[a, q] * slope[b, q]
                            both *= mu
                            if not small:
                                for q in range(dim):
                                    for r in range(dim):
                                        both += slope[a, q] * t[q, r] * slope[b, r]
                            for q in range(dim):
                                for r in range(dim):
                                    value = mu * (slope[b, q] * slope[a, r] - 2.0 / dim * slope[a, q] * slope[b, r])
                                    k[at + q, to + r] += volume * (value + both if q == r else value)
                        for q in range(dim):
                            whole[at + q] += volume * slope[a, q]
                bulk = (lame + two_mu / dim) / total
                for q in range(size):
                    for r in range(size):
                        k[q, r] += bulk * whole[q] * whole[r]

    return elastic


_elastic_of = by_kind(_elastic)


@njit(cache=True, nogil=True, error_model="numpy")
def elastic(g, who, s0, small, out):
    """K (n, m, m) [N/m, in the plane per m] of the elements who (n,) of the tables g, elastic, with their stress
    without strain s0 (count, parts, 4 or more) [Pa]."""
    _elastic_of(g, who, s0, small, out)


@njit(cache=True, nogil=True, error_model="numpy")
def trials(g, who, s0, small, stress, turn):
    """Trial stresses (n, parts, 3, 3) [Pa] of the elements who (n,) in the frames that turn with their parts, and these
    frames (n, parts, 3, 3)."""
    s, frames = parts.room(g)
    stress[:] = 0.0
    turn[:] = 0.0
    for n in range(len(who)):
        trial(g, who[n], s0[who[n]], small, s, frames)
        for p in range(len(s)):
            of, r, f = stress[n, p], turn[n, p], frames[p]
            of[0, 0], of[1, 1], of[2, 2], of[0, 1] = s[p, 0], s[p, 1], s[p, 3], s[p, 2]
            if len(f) == 2:
                r[0, 0], r[0, 1], r[1, 0], r[1, 1], r[2, 2] = f[0], -f[1], f[1], f[0], 1.0
            else:
                of[0, 2], of[1, 2] = s[p, 4], s[p, 5]
                for k in range(9):
                    r[k // 3, k % 3] = f[k]
            of[1, 0], of[2, 0], of[2, 1] = of[0, 1], of[0, 2], of[1, 2]


def _soften(kind: Kind) -> Any:
    dim, corners, overlays, each, counts = kind.dim, np.array(kind.parts), kind.overlays, kind.each, 1.0 / kind.overlays
    size, nodes = dim * kind.corners, corners.shape[1]

    @njit(error_model="numpy")
    def soften(g, who, principal, axes, law, table, small, out):
        slope, lost, b, along = np.empty((3, 3)), np.empty((6, 6)), np.empty((6, size)), np.empty(3)
        slopes, volumes, mean = np.empty((each, nodes, dim)), np.empty(each), np.empty(size)
        for n in range(len(who)):
            i = who[n]
            lame, two_mu, free = parts.moduli(g, i)
            for overlay in range(overlays):
                mean[:] = 0.0
                total = 0.0
                for j in range(each):
                    p = each * overlay + j
                    volumes[j] = gradients(g, i, p, small, slopes[j])
                    total += volumes[j]
                    for a in range(nodes):
                        for q in range(dim):
                            mean[dim * corners[p, a] + q] += volumes[j] * slopes[j, a, q]
                for j in range(each):
                    p = each * overlay + j
                    if not lost_by_flow(principal[n, p], table[law[i, p]], lame, two_mu, free, slope, lost):
                        continue
                    axis = axes[n, p]
                    b[:] = 0.0
                    for q in range(3):
                        share = 0.0  # of the mean trace; none across the plane
                        for r in range(dim):
                            share += axis[r, q] * axis[r, q]
                        for m in range(size):
                            b[q, m] = share / dim * mean[m] / total
                        for a in range(nodes):
                            for r in range(dim):
                                b[q, dim * corners[p, a] + r] -= share / dim * slopes[j, a, r]
                    for a in range(nodes):
                        for q in range(3):
                            along[q] = 0.0
                            for r in range(dim):
                                along[q] += slopes[j, a, r] * axis[r, q]
                        for r in range(dim):
                            m = dim * corners[p, a] + r
                            for q in range(3):
                                b[q, m] += along[q] * axis[r, q]
                            for q, (u, v) in enumerate(PAIRS):
                                b[3 + q, m] += along[u] * axis[r, v] + along[v] * axis[r, u]
                    volume = counts * (1.0 - KEPT) * volumes[j]
                    for m in range(size):
                        for q in range(6):
                            part = 0.0
                            for u in range(6):
                                part += b[u, m] * lost[u, q]
                            part *= volume
                            for r in range(size):
                                out[n, m, r] -= part * b[q, r]

    return soften


_soften_of = by_kind(_soften)


@njit(cache=True, nogil=True, error_model="numpy")
def soften(g, who, principal, axes, law, table, small, out):
    """Take from the stiffness out (n, m, m) of the elements who (n,) what their flow takes.

    principal (n, parts, 3) [Pa]: of trial stresses, ascending, in plane stress with that across the plane in the
    middle; axes (n, parts, 3, 3): theirs, by columns; law (count, parts): rows of the table (rows, 4) of yield
    surfaces."""
    _soften_of(g, who, principal, axes, law, table, small, out)


@njit(cache=True, nogil=True, error_model="numpy")
def principal_slopes(s1, s2, s3, n, m, k, t, a, b, slopes):
    """Derivative T (3, 3) of what `plasticity.principal_return` gives by s1, s2, s3, and the stresses themselves; the
    same arguments. A stress inside has the unit matrix."""
    r1, r2, r3, bits = principal_return(s1, s2, s3, n, m, k, t, a, b)
    slopes[:] = 0.0
    p, along, aside, back = a - b * m - b * n + a * n * m, a - b * m, b * (1.0 - m), a * m - b
    if bits == 0:
        slopes[0, 0] = slopes[1, 1] = slopes[2, 2] = 1.0
    elif bits == SHEAR_NOW:
        if r1 == r2:
            per = back / (2.0 * p - (a - b))
            slopes[2, 0], slopes[2, 1], slopes[2, 2] = per, per, 1.0 - 2.0 * n * per
            slopes[0] = slopes[1] = n * slopes[2]
        elif r2 == r3:
            per = along / (2.0 * p - n * m * (a - b))
            slopes[0, 0], slopes[0, 1], slopes[0, 2] = 1.0 - 2.0 * per, n * per, n * per
            slopes[1] = slopes[2] = slopes[0] / n
        else:
            slopes[0, 0], slopes[0, 2] = 1.0 - along / p, n * along / p
            slopes[1, 0], slopes[1, 1], slopes[1, 2] = -aside / p, 1.0, n * aside / p
            slopes[2, 0], slopes[2, 2] = back / p, 1.0 - n * back / p
    elif bits == TENSION_NOW:
        if r1 < t and r2 < t:
            slopes[0, 0] = slopes[1, 1] = 1.0
            slopes[0, 2] = slopes[1, 2] = -b / a
        elif r1 < t:
            slopes[0, 0], slopes[0, 1], slopes[0, 2] = 1.0, -b / (a + b), -b / (a + b)
    elif n * t - k < r2 < t:
        det = a * a - b * b
        slopes[1, 0] = (-a * aside - back * b) / det
        slopes[1, 1] = 1.0
        slopes[1, 2] = ((a * n - (n * a - b)) * aside - (p - n * back) * b) / det
    return r1, r2, r3, bits


@njit(cache=True, nogil=True, error_model="numpy")
def plane_slopes(low, high, n, m, k, t, a, b, slopes):
    """Return the slopes in plane stress, of the high stress in row and column 2 and of the low one in 0, and where they
    go."""
    t = min(t, k / n)
    r_low, r_high, where = plane_stress_return(low, high, n, m, k, t, a, b)
    slopes[:] = 0.0
    p, along, back = a - b * m - b * n + a * n * m, a - b * m, a * m - b
    if where == SIDE:
        slopes[2, 2], slopes[2, 0] = 1.0 - n * back / p, back / p
        slopes[0, 2], slopes[0, 0] = n * along / p, 1.0 - along / p
    elif where == HIGH and r_low < t:
        slopes[0, 0], slopes[0, 2] = 1.0, -b / a
    elif where == LOW and r_high > -k:
        slopes[2, 2], slopes[2, 0] = 1.0, -b / a
    elif where == 0.0:
        slopes[0, 0] = slopes[2, 2] = 1.0
    return r_low, r_high, where


@njit(cache=True, error_model="numpy")
def lost_by_flow(s, surface, lame, two_mu, free, slope, lost):
    """Into lost (6, 6) [Pa] what flow takes of the elastic stiffness along the principal axes of a trial stress s (3,)
    [Pa], for the strains 11, 22, 33 and the shears `PAIRS`; slope (3, 3): room. Returns whether it flows."""
    n, m, k, t, a, b = surface[N_PHI], surface[N_PSI], surface[STRENGTH], surface[TENSILE], lame + two_mu, lame
    if free == 0.0:
        r1, r2, r3, bits = principal_slopes(s[0], s[1], s[2], n, m, k, t, a, b, slope)
    else:
        r1, r3, bits = plane_slopes(s[0], s[2], n, m, k, t, a, b, slope)
        r2 = s[1]
    if bits == 0:
        return False
    r = (r1, r2, r3)
    lost[:] = 0.0
    for p in range(3):
        total = b * (slope[p, 0] + slope[p, 1] + slope[p, 2])
        for q in range(3):
            lost[p, q] = (a if p == q else b) - (total + (a - b) * slope[p, q])
    for q, (u, v) in enumerate(PAIRS):
        apart = s[v] - s[u]
        turn = (r[v] - r[u]) / apart if apart > 0.0 else slope[v, v] - slope[v, u]
        lost[3 + q, 3 + q] = 0.5 * two_mu * (1.0 - turn)
    return True

"""Particle-particle contacts and bonds: their tables, what they report, how bonds are made and broken.

The force loop itself is pair_forces.py. A block owns consecutive rows of the list (neighbours.py); what several blocks
see is counted by the one that owns the earlier partner.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.core.fields import GID, MATERIAL, RADIUS, X, Y
from hpcdem.physics.dem.kernels import laws

# Columns of the pair law table (row = material_i * n_materials + material_j).
MODEL, A, B, MU = range(4)
# Columns of the bond type table; row 0 is "no bond".
KIND, E_MOD, G_MOD, TENSILE, SHEAR = range(5)
# Columns of a block's tally (float64): longest bonded distance squared, breaks in tension, breaks in shear.
LONGEST2, TENSION_BREAKS, SHEAR_BREAKS = range(3)


@njit(cache=True, error_model="numpy")
def _direction(dx, dy, d):
    """Unit vector from the earlier to the later partner; +x if both centres are in one place (rows from one corner)."""
    if d == 0.0:
        return 1.0, 0.0
    inverse = 1.0 / d
    return dx * inverse, dy * inverse


@njit(cache=True, nogil=True, error_model="numpy")
def report(t, hot, ihot, blocks, ptr, partner, fs, bond, u_made, pairs, bonds, n_mat, spheres, out, iout):
    """Touching or bonded pairs of block t as rows, each pair once in the whole model; returns the number of rows.

    out (m, 8) f8: Fn, Fs, Fx, Fy (on the first), x, y, overlap, tangent stiffness; iout (m, 3) i8: gid, gid, bond type;
    pairs are turned so that the lower gid comes first. Nothing of the state changes.
    """
    cut, lo, _, poff, _ = blocks
    n = 0
    p = poff[t] - lo[t]
    for i in range(cut[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            j = partner[k]
            dx = hot[j, X] - hot[i, X]
            dy = hot[j, Y] - hot[i, Y]
            ri, rj = hot[i, RADIUS], hot[j, RADIUS]
            reach = ri + rj
            d2 = dx * dx + dy * dy
            kind = bond[k]
            if kind == 0 and d2 > reach * reach:
                continue
            d = math.sqrt(d2)
            nx, ny = _direction(dx, dy, d)
            u = reach - d
            two_rt = 4.0 * ri * rj / reach
            q = ihot[i, MATERIAL] * n_mat + ihot[j, MATERIAL]
            if u >= 0.0:
                fn, _ = laws.contact(pairs[q, MODEL], pairs[q, A], pairs[q, B], two_rt, u)
                stiffness = laws.tangent_normal_stiffness(pairs[q, MODEL], pairs[q, A], two_rt, u)
            elif bonds[kind, KIND] == laws.ELASTIC_BOND:
                area = laws.bond_area(two_rt, spheres)
                fn, _ = laws.elastic_bond(bonds[kind, E_MOD], bonds[kind, G_MOD], area, reach, u)
                stiffness = bonds[kind, E_MOD] * area / reach
            else:
                fn, _ = laws.contact_bond(pairs[q, MODEL], pairs[q, A], pairs[q, B], two_rt, u_made[k], u)
                stiffness = laws.tangent_normal_stiffness(pairs[q, MODEL], pairs[q, A], two_rt, u_made[k])
            s = fs[k]
            ax = s * -ny - fn * nx
            ay = s * nx - fn * ny
            la = ri - 0.5 * u
            swap = ihot[i, GID] > ihot[j, GID]
            out[n, 0] = fn
            out[n, 1] = s
            out[n, 2] = -ax if swap else ax
            out[n, 3] = -ay if swap else ay
            out[n, 4] = hot[i, X] + la * nx
            out[n, 5] = hot[i, Y] + la * ny
            out[n, 6] = u
            out[n, 7] = stiffness
            iout[n, 0] = ihot[j, GID] if swap else ihot[i, GID]
            iout[n, 1] = ihot[i, GID] if swap else ihot[j, GID]
            iout[n, 2] = kind
            n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def stiffness(t, hot, ihot, blocks, ptr, partner, pairs, n_mat, n_left, out):
    """Add the tangent normal stiffness of every touching pair of block t to its owned particles, out (n_own,) f8
    [N/m]."""
    cut, lo, _, poff, _ = blocks
    a, b = cut[t], cut[t + 1]
    p = poff[t] - lo[t]
    for i in range(lo[t], b):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            j = partner[k]
            dx = hot[j, X] - hot[i, X]
            dy = hot[j, Y] - hot[i, Y]
            reach = hot[i, RADIUS] + hot[j, RADIUS]
            u = reach - math.sqrt(dx * dx + dy * dy)
            if u < 0.0:
                continue
            q = ihot[i, MATERIAL] * n_mat + ihot[j, MATERIAL]
            two_rt = 4.0 * hot[i, RADIUS] * hot[j, RADIUS] / reach
            kn = laws.tangent_normal_stiffness(pairs[q, MODEL], pairs[q, A], two_rt, u)
            if a <= i:
                out[i - n_left] += kn
            if a <= j < b:
                out[j - n_left] += kn


@njit(cache=True, nogil=True, error_model="numpy")
def make_bonds(t, hot, ihot, blocks, ptr, partner, bond, u_made, pairs, n_mat, chosen, renewed, fresh, tolerate, rext):
    """Bond the pairs of block t with both ends chosen: d - (Ra + Rb) rext <= tolerate, or renew the bond they have.

    chosen (n,) bool per storage row; renewed (types,) i4: new type of each existing type; fresh: type of a new bond.
    Returns bonds made, counted where the block owns the earlier partner, and the longest bonded distance squared.
    """
    cut, lo, _, poff, _ = blocks
    made = 0
    longest2 = 0.0
    p = poff[t] - lo[t]
    for i in range(lo[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            j = partner[k]
            dx = hot[j, X] - hot[i, X]
            dy = hot[j, Y] - hot[i, Y]
            d2 = dx * dx + dy * dy
            if chosen[i] and chosen[j]:
                reach = hot[i, RADIUS] + hot[j, RADIUS]
                d = math.sqrt(d2)
                if bond[k] != 0:
                    bond[k] = renewed[bond[k]]
                elif d - reach * rext <= tolerate:
                    bond[k] = fresh
                    two_rt = 4.0 * hot[i, RADIUS] * hot[j, RADIUS] / reach
                    u_made[k] = max(reach - d, 0.5e-3 * two_rt)
                    if i >= cut[t]:
                        made += 1
            if bond[k] != 0:
                longest2 = max(longest2, d2)
    return made, longest2


@njit(cache=True, nogil=True, error_model="numpy")
def break_bonds(t, blocks, ptr, partner, bond, chosen):
    """Remove the bonds of block t with both ends chosen; returns how many (of pairs whose earlier end the block
    owns)."""
    cut, lo, _, poff, _ = blocks
    gone = 0
    p = poff[t] - lo[t]
    for i in range(lo[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            if bond[k] != 0 and chosen[i] and chosen[partner[k]]:
                bond[k] = 0
                if i >= cut[t]:
                    gone += 1
    return gone


@njit(cache=True, nogil=True, error_model="numpy")
def overstretched(t, hot, ihot, blocks, ptr, partner, bond, u_made, pairs, bonds, n_mat, spheres, chosen):
    """Bonds of block t with both ends chosen that are past their tensile limit where they are: how many (of pairs whose
    earlier end the block owns), and the widest gap [m] at which one of them would hold."""
    cut, lo, _, poff, _ = blocks
    number, widest = 0, 0.0
    p = poff[t] - lo[t]
    for i in range(cut[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            j, kind = partner[k], bond[k]
            if kind == 0 or not (chosen[i] and chosen[j]):
                continue
            ri, rj = hot[i, RADIUS], hot[j, RADIUS]
            reach = ri + rj
            u = reach - math.sqrt((hot[j, X] - hot[i, X]) ** 2 + (hot[j, Y] - hot[i, Y]) ** 2)
            two_rt = 4.0 * ri * rj / reach
            area = laws.bond_area(two_rt, spheres)
            law = bonds[kind]
            if law[KIND] == laws.ELASTIC_BOND:
                fn, _ = laws.elastic_bond(law[E_MOD], law[G_MOD], area, reach, u)
                limit = law[TENSILE] * area
            else:
                q = ihot[i, MATERIAL] * n_mat + ihot[j, MATERIAL]
                fn, _ = laws.contact_bond(pairs[q, MODEL], pairs[q, A], pairs[q, B], two_rt, u_made[k], u)
                limit = law[TENSILE]
            if u < 0.0 and laws.bond_failure(law[KIND], fn, 0.0, law[TENSILE], law[SHEAR], 0.0, area) == (
                laws.BREAKS_IN_TENSION
            ):
                number += 1
                widest = max(widest, limit * u / fn)
    return number, widest


def bond_table(bonds: np.ndarray) -> np.ndarray:
    """Bond types for the force loop: (types, 4) f8 [E, G, tensile, shear].

    bonds (types, 5) f8: columns KIND to SHEAR. A negative tensile strength says "no bond" (row 0), a negative modulus
    "contact bond", so that a row is as wide as four lanes.
    """
    table = bonds[:, E_MOD : SHEAR + 1].copy()
    table[bonds[:, KIND] == laws.CONTACT_BOND, 0] = -1.0
    table[bonds[:, KIND] == 0.0, 2] = -1.0
    return table


def pair_table(materials: np.ndarray) -> np.ndarray:
    """Pair laws of all material pairs: (n*n, 4) f8 [MODEL, A, B, MU].

    materials: structured columns as a dict-like record array with hertz, kn, ks, shear, poiss, fric.
    Hertz pairs use mean moduli, linear pairs springs in series, friction is the smaller of the two (PFC).
    A mixed pair gets NaN: the caller refuses it when it can occur.
    """
    n = len(materials)
    table = np.full((n, n, 4), np.nan)
    for i in range(n):
        for j in range(n):
            a, b = materials[i], materials[j]
            mu = min(a["fric"], b["fric"])
            if a["hertz"] and b["hertz"]:
                g, nu = 0.5 * (a["shear"] + b["shear"]), 0.5 * (a["poiss"] + b["poiss"])
                table[i, j] = laws.HERTZ, laws.hertz_normal_factor(g, nu), laws.mindlin_shear_factor(g, nu), mu
            elif not a["hertz"] and not b["hertz"]:
                kn, ks = laws.series_stiffness(a["kn"], b["kn"]), laws.series_stiffness(a["ks"], b["ks"])
                table[i, j] = laws.LINEAR, kn, ks, mu
    return table.reshape(n * n, 4)

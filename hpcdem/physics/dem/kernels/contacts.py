"""Particle-particle contacts and bonds: their tables, what they report, how bonds are made and broken.

The force loop itself is pair_forces.py. A block owns consecutive rows of the list (neighbours.py); what several blocks
see is counted by the one that owns the earlier partner.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from hpcdem.core.fields import GID, MATERIAL, RADIUS, X, Y
from hpcdem.physics.dem.kernels import laws

# Columns of the pair law table (row = material_i * n_materials + material_j).
MODEL, A, B, MU = range(4)
USER = 32.0
"""MODEL of pairs with the first user law; the second has one more; built-in laws are below. A and B are what its
stiffnesses are never above, MU is not used."""
# Columns of the bond type table; row 0 is "no bond".
KIND, E_MOD, G_MOD, TENSILE, SHEAR = range(5)
# Columns of a block's tally (float64): longest bonded distance squared, breaks in tension, breaks in shear.
LONGEST2, TENSION_BREAKS, SHEAR_BREAKS = range(3)


@njit(cache=True, error_model="numpy", forceinline=True)
def pair_law(i, j, row, u_made, hot, ihot, pairs, bonds, n_mat, spheres, two_rt, u):
    """laws.pair_state of the particles in storage rows i and j with a bond of table row `row` (0: none), at overlap
    u [m]: (Fn, ks, kn, energy of Fn). u_made: the normal force of a user law, whose energy is in user_pairs.py.
    """
    q = ihot[i, MATERIAL] * n_mat + ihot[j, MATERIAL]
    if pairs[q, MODEL] >= USER:
        return u_made, pairs[q, B], pairs[q, A], math.nan
    return laws.pair_state(
        bonds[row, KIND], pairs[q, MODEL], pairs[q, A], pairs[q, B], bonds[row, E_MOD], bonds[row, G_MOD], two_rt,
        hot[i, RADIUS] + hot[j, RADIUS], spheres, u_made, u,
    )  # fmt: skip


class PairState(NamedTuple):
    """A pair as it lies: whether it touches or is bonded (if not, all is zero), normal from the earlier to the later
    partner, overlap and 2 Rt [m], and what laws.pair_state says of it [N, N/m, N/m, J]."""

    active: bool
    nx: float
    ny: float
    u: float
    two_rt: float
    fn: float
    ks: float
    kn: float
    energy: float


@njit(cache=True, error_model="numpy", forceinline=True)
def pair_state(i, j, row, u_made, hot, ihot, pairs, bonds, n_mat, spheres):
    """The state of a pair; arguments as `pair_law`."""
    dx, dy, ri, rj = hot[j, X] - hot[i, X], hot[j, Y] - hot[i, Y], hot[i, RADIUS], hot[j, RADIUS]
    if row == 0 and dx * dx + dy * dy > (ri + rj) * (ri + rj):  # most pairs: neither root nor division
        return PairState(False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    _, nx, ny, u, two_rt = laws.pair_geometry(dx, dy, ri, rj)
    fn, ks, kn, energy = pair_law(i, j, row, u_made, hot, ihot, pairs, bonds, n_mat, spheres, two_rt, u)
    return PairState(True, nx, ny, u, two_rt, fn, ks, kn, energy)


@njit(cache=True, error_model="numpy")
def stiffest(i, j, row, u_made, at, hot, ihot, pairs, bonds, n_mat, spheres):
    """(kn, ks) [N/m] of a pair in the state `at`; of a bonded one the larger ones of its bond and its contact, as
    it may open or close in any step. Without friction a contact has no shear spring: it slips."""
    if row == 0:
        slips = pairs[ihot[i, MATERIAL] * n_mat + ihot[j, MATERIAL], MU] == 0.0
        return at.kn, 0.0 if slips else at.ks
    _, ks_closed, kn_closed, _ = pair_law(i, j, row, u_made, hot, ihot, pairs, bonds, n_mat, spheres, at.two_rt, 0.0)
    _, ks_open, kn_open, _ = pair_law(i, j, row, u_made, hot, ihot, pairs, bonds, n_mat, spheres, at.two_rt, -1.0)
    return max(at.kn, kn_closed, kn_open), max(at.ks, ks_closed, ks_open)


@njit(cache=True, nogil=True, error_model="numpy")
def stiffest_bond(t, hot, ihot, blocks, ptr, partner, bond, u_made, pairs, bonds, n_mat, spheres):
    """The largest stiffness [N/m], normal or shear, of the bonds of block t; 0 without any."""
    cut, lo, _, poff, _ = blocks
    largest = 0.0
    p = poff[t] - lo[t]
    for i in range(cut[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            if bond[k] != 0:
                j = partner[k]
                at = pair_state(i, j, bond[k], u_made[k], hot, ihot, pairs, bonds, n_mat, spheres)
                _, ks, kn, _ = pair_law(
                    i, j, bond[k], u_made[k], hot, ihot, pairs, bonds, n_mat, spheres, at.two_rt, -1.0
                )
                largest = max(largest, kn, ks)
    return largest


@njit(cache=True, nogil=True, error_model="numpy")
def report(t, hot, ihot, blocks, ptr, partner, fs, bond, u_made, pairs, bonds, n_mat, spheres, out, iout):
    """Touching or bonded pairs of block t as rows, each pair once in the whole model; returns the number of rows.

    out (m, 8) f8: Fn, Fs, Fx, Fy (on the first), x, y, overlap, tangent stiffness; iout (m, 3) i8: gid, gid, bond type;
    pairs are turned so that the lower gid leads. Nothing of the state changes.
    """
    cut, lo, _, poff, _ = blocks
    n = 0
    p = poff[t] - lo[t]
    for i in range(cut[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            j = partner[k]
            at = pair_state(i, j, bond[k], u_made[k], hot, ihot, pairs, bonds, n_mat, spheres)
            if not at.active:
                continue
            ax = fs[k] * -at.ny - at.fn * at.nx
            ay = fs[k] * at.nx - at.fn * at.ny
            arm = hot[i, RADIUS] - 0.5 * at.u
            swap = ihot[i, GID] > ihot[j, GID]
            out[n, 0] = at.fn
            out[n, 1] = fs[k]
            out[n, 2] = -ax if swap else ax
            out[n, 3] = -ay if swap else ay
            out[n, 4] = hot[i, X] + arm * at.nx
            out[n, 5] = hot[i, Y] + arm * at.ny
            out[n, 6] = at.u
            out[n, 7] = at.kn
            iout[n, 0] = ihot[j, GID] if swap else ihot[i, GID]
            iout[n, 1] = ihot[i, GID] if swap else ihot[j, GID]
            iout[n, 2] = bond[k]
            n += 1
    return n


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
            ri, rj = hot[i, RADIUS], hot[j, RADIUS]
            d2, _, _, u, two_rt = laws.pair_geometry(hot[j, X] - hot[i, X], hot[j, Y] - hot[i, Y], ri, rj)
            if chosen[i] and chosen[j]:
                if bond[k] != 0:
                    bond[k] = renewed[bond[k]]
                elif math.sqrt(d2) - (ri + rj) * rext <= tolerate:
                    bond[k] = fresh
                    u_made[k] = max(u, 0.5e-3 * two_rt)
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
            j, row = partner[k], bond[k]
            if row == 0 or not (chosen[i] and chosen[j]):
                continue
            at = pair_state(i, j, row, u_made[k], hot, ihot, pairs, bonds, n_mat, spheres)
            law, area = bonds[row], laws.bond_area(at.two_rt, spheres)
            limit = law[TENSILE] * area if law[KIND] == laws.ELASTIC_BOND else law[TENSILE]
            if at.u < 0.0 and laws.bond_failure(law[KIND], at.fn, 0.0, law[TENSILE], law[SHEAR], 0.0, area) == (
                laws.BREAKS_IN_TENSION
            ):
                number += 1
                widest = max(widest, limit * at.u / at.fn)
    return number, widest


def bond_laws(types: np.ndarray) -> np.ndarray:
    """Bond types (materials.BOND_TYPE) for the kernels: (types, 5) f8, columns KIND to SHEAR. A shear modulus below 0
    says "conserving"."""
    table = np.column_stack([types[name] for name in ("kind", "ebmod", "gbmod", "tstrength", "sstrength")])
    keep = types["conserving"] != 0.0
    table[keep, G_MOD] = np.where(types["kind"] == laws.CONTACT_BOND, -1.0, -types["gbmod"])[keep]
    return table


def bond_table(bonds: np.ndarray) -> np.ndarray:
    """Bond types for the force loop: (types, 4) f8 [E, G, tensile, shear].

    bonds (types, 5) f8: see `bond_laws`. A negative tensile strength says "no bond" (row 0), a negative modulus
    "contact bond", so that a row is as wide as four lanes.
    """
    table = bonds[:, E_MOD : SHEAR + 1].copy()
    table[bonds[:, KIND] == laws.CONTACT_BOND, 0] = -1.0
    table[bonds[:, KIND] == 0.0, 2] = -1.0
    return table


def pair_table(materials: np.ndarray, which: np.ndarray, bounds: np.ndarray | None = None) -> np.ndarray:
    """Pair laws of all material pairs: (n*n, 4) f8 [MODEL, A, B, MU].

    materials: structured columns as a dict-like record array with kn, ks, shear, poiss, fric; which (n, n): see
    user_laws.ModelLaws; bounds (n, n, 2): stiffnesses [N/m] of pairs with a user law.
    Hertz pairs use mean moduli, linear pairs springs in series, friction is the smaller of the two (PFC).
    A mixed pair gets NaN: the caller refuses it when it can occur.
    """
    n = len(materials)
    table = np.full((n, n, 4), np.nan)
    for i in range(n):
        for j in range(n):
            a, b = materials[i], materials[j]
            mu = min(a["fric"], b["fric"])
            if which[i, j] > 0.0 and bounds is not None:
                table[i, j] = USER + which[i, j] - 1.0, *bounds[i, j], mu
            elif which[i, j] < 0.0:
                g, nu = 0.5 * (a["shear"] + b["shear"]), 0.5 * (a["poiss"] + b["poiss"])
                table[i, j] = laws.HERTZ, laws.hertz_normal_factor(g, nu), laws.mindlin_shear_factor(g, nu), mu
            elif which[i, j] == 0.0:
                kn, ks = laws.series_stiffness(a["kn"], b["kn"]), laws.series_stiffness(a["ks"], b["ks"])
                table[i, j] = laws.LINEAR, kn, ks, mu
    return table.reshape(n * n, 4)

"""Numbers about the whole model from one pass over lists and particles: sums (exact, hence free of order), counts, and
extremes. Nothing of the state changes."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.core.fields import FIX, FIX_X, FIX_Y, GID, RADIUS, SPIN, VX, VY
from hpcdem.numerics.exact_sum import add_to_bins
from hpcdem.physics.dem.kernels.contacts import pair_state, stiffest
from hpcdem.physics.dem.kernels.motion import CLUMPED, INERTIA, MASS

_ROOM = 256


@njit(cache=True, nogil=True, error_model="numpy")
def _empty_into(bins, n, bits):
    for k in range(n):
        add_to_bins(bins, bits[k])


@njit(cache=True, nogil=True, error_model="numpy")
def stiffness(t, hot, ihot, blocks, ptr, partner, bond, u_made, pair_laws, bonds, n_mat, spheres, n_left, out):
    """Add the stiffness of the pairs of block t that touch or are bonded to its owned particles, out (n_own,) f8 [N/m]:
    the larger of the normal and the shear one, see contacts.stiffest."""
    cut, lo, _, poff, _ = blocks
    a, b = cut[t], cut[t + 1]
    p = poff[t] - lo[t]
    for i in range(lo[t], b):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            j = partner[k]
            at = pair_state(i, j, bond[k], u_made[k], hot, ihot, pair_laws, bonds, n_mat, spheres)
            if not at.active:
                continue
            kn, ks = stiffest(i, j, bond[k], u_made[k], at, hot, ihot, pair_laws, bonds, n_mat, spheres)
            if a <= i:
                out[i - n_left] += max(kn, ks)
            if a <= j < b:
                out[j - n_left] += max(kn, ks)


@njit(cache=True, nogil=True, error_model="numpy")
def pairs(t, hot, ihot, blocks, ptr, partner, bond, u_made, pair_laws, bonds, n_mat, spheres, bins):
    """Block t: the sizes of its normal forces |Fn| into bins (2, 2112) i8.

    Returns how many pairs touch or are bonded, and the largest overlap over the smaller radius; each pair counts once
    in the whole model, in the sum too.
    """
    cut, lo, _, poff, _ = blocks
    p = poff[t] - lo[t]
    forces = np.empty(_ROOM)
    bits = forces.view(np.int64)
    n, count, deepest = 0, 0, 0.0
    for i in range(cut[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            j = partner[k]
            at = pair_state(i, j, bond[k], u_made[k], hot, ihot, pair_laws, bonds, n_mat, spheres)
            if not at.active:
                continue
            if n == _ROOM:
                _empty_into(bins, n, bits)
                n = 0
            forces[n] = abs(at.fn)
            n += 1
            count += 1
            deepest = max(deepest, at.u / min(hot[i, RADIUS], hot[j, RADIUS]))
    _empty_into(bins, n, bits)
    return count, deepest


@njit(cache=True, nogil=True, error_model="numpy")
def add_wall_stiffness(
    n, wall_contacts, wall_stiffness, overlaps, hot, ihot, slot_row, slot_wall, n_left, stiffness
):  # fmt: skip
    """Add the stiffness [N/m] of n wall contacts (gid, wall row) to their particles, stiffness (n_own,) f8; returns the
    largest overlap over radius.

    The contacts are some of the slots, in the order of the slots.
    """
    k, deepest = 0, 0.0
    for c in range(n):
        while ihot[slot_row[k], GID] != wall_contacts[c, 0] or slot_wall[k] != wall_contacts[c, 1]:
            k += 1
        stiffness[slot_row[k] - n_left] += wall_stiffness[c]
        deepest = max(deepest, overlaps[c] / hot[slot_row[k], RADIUS])
        k += 1
    return deepest


@njit(cache=True, nogil=True, error_model="numpy")
def kinetic(hot, n_left, body, bins):
    """(m v^2 + I w^2) / 2 [J] of the owned particles into bins (2, 2112) i8; nothing of members of clumps."""
    energies = np.empty(_ROOM)
    bits = energies.view(np.int64)
    for start in range(0, len(body), _ROOM):
        n = min(_ROOM, len(body) - start)
        for k in range(n):
            c = start + k
            i = n_left + c
            vx, vy, w = hot[i, VX], hot[i, VY], hot[i, SPIN]
            if body[c, CLUMPED] != 0.0:
                energies[k] = 0.0
                continue
            energies[k] = 0.5 * (body[c, MASS] * (vx * vx + vy * vy) + body[c, INERTIA] * w * w)
        _empty_into(bins, n, bits)


@njit(cache=True, nogil=True, error_model="numpy")
def extremes(icold, body, force, gx, gy, stiffness):
    """Return for the owned particles without members of clumps: largest force (fx, fy) + m g in the directions that are
    not fixed [N] (NaN if any is), and least m / sum k [s^2] of those that move and touch something (infinite
    without)."""
    largest, shortest, broken = 0.0, math.inf, False
    for c in range(len(body)):
        if body[c, CLUMPED] != 0.0:
            continue
        fix = icold[c, FIX]
        fx = 0.0 if fix & FIX_X else force[c, 0] + body[c, MASS] * gx
        fy = 0.0 if fix & FIX_Y else force[c, 1] + body[c, MASS] * gy
        size = math.hypot(fx, fy)
        broken |= size != size
        largest = max(largest, size)
        if stiffness[c] > 0.0 and fix & (FIX_X | FIX_Y) != (FIX_X | FIX_Y):
            shortest = min(shortest, body[c, MASS] / stiffness[c])
    return math.nan if broken else largest, shortest


@njit(cache=True, nogil=True, error_model="numpy")
def by_wall(n, contacts, fx_bits, fy_bits, place, bins):
    """The forces (fx, fy) of n wall contacts, as int64 bits, into the bins (2 per wall, 2, 2112) i8 of their walls.

    place (n_walls,): where each wall's bins are.
    """
    for c in range(n):
        at = 2 * place[contacts[c, 1]]
        add_to_bins(bins[at], fx_bits[c])
        add_to_bins(bins[at + 1], fy_bits[c])

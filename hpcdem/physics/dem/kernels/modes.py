"""The stiffness of the present contacts and bonds as a linear map, for the highest frequency of the model.

A small motion (ux, uy, turn) per particle strains each contact and bond along n and along t: the normal spring by
(u_b - u_a) . n, the shear spring by (u_b - u_a) . t - turn_a la - turn_b lb (docs/physics.md, Contacts). With their
tangent stiffnesses the energy is u K u / 2. What turning of n does to the forces there are is left out: its stiffness
is Fn / d, small against dFn/dU as overlaps are small. Nothing of the state changes, and no matrix is made.
"""

from __future__ import annotations

import math

from numba import njit

from hpcdem.core.fields import GID, RADIUS
from hpcdem.numerics.rng import uniform
from hpcdem.physics.dem.kernels.contacts import pair_state, stiffest
from hpcdem.physics.dem.kernels.motion import INERTIA, KICK_X, MASS
from hpcdem.physics.dem.kernels.walls import NONE, end_of_slots, wall_state


@njit(cache=True, nogil=True, error_model="numpy")
def begin(ihot, n_left, body, scale, out):
    """scale (n_own, 3) f8: 1/sqrt(m), 1/sqrt(I), 0 where a direction is fixed and for members of clumps; out (n_own,
    3): random numbers of the ids, zero there."""
    for c in range(len(body)):
        for axis in range(3):
            inertia = body[c, INERTIA if axis == 2 else MASS]
            free = body[c, KICK_X + axis] != 0.0
            scale[c, axis] = 1.0 / math.sqrt(inertia) if free else 0.0
            out[c, axis] = uniform(11, axis, ihot[n_left + c, GID]) - 0.5 if free else 0.0


@njit(cache=True, error_model="numpy")
def _spring(force, i, j, nx, ny, kn, ks, arm_i, arm_j, u, at_i, at_j):
    """Add the forces of a pair on rows at_i and at_j of `force`, from the motions u of i and j."""
    dx, dy = u[j, 0] - u[i, 0], u[j, 1] - u[i, 1]
    fn = kn * (nx * dx + ny * dy)
    fs = ks * (nx * dy - ny * dx - u[i, 2] * arm_i - u[j, 2] * arm_j)
    force[at_i, 0] -= fn * nx - fs * ny
    force[at_i, 1] -= fn * ny + fs * nx
    force[at_i, 2] -= fs * arm_i
    force[at_j, 0] += fn * nx - fs * ny
    force[at_j, 1] += fn * ny + fs * nx
    force[at_j, 2] -= fs * arm_j


@njit(cache=True, nogil=True, error_model="numpy")
def pairs(
    t, hot, ihot, cut, lo, hi, poff, foff, ptr, partner, bond, u_made, pair_laws, bonds, n_mat, spheres,
    turning, u, force,
):  # fmt: skip
    """K u of the pairs of block t, into its rows of force (k, 3) f8, as in the force loop: the same terms in the same
    order for each owned particle on any number of blocks and ranks. u (n, 3) f8 per storage row.

    Stiffnesses are those of contacts.stiffest; turning (slots,), or empty: of rolling [N m/rad].
    """
    shift, p = foff[t] - lo[t], poff[t] - lo[t]
    for r in range(foff[t], foff[t] + hi[t] - lo[t]):
        force[r, 0] = force[r, 1] = force[r, 2] = 0.0
    for i in range(lo[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            j = partner[k]
            at = pair_state(i, j, bond[k], u_made[k], hot, ihot, pair_laws, bonds, n_mat, spheres)
            if not at.active:
                continue
            kn, ks = stiffest(i, j, bond[k], u_made[k], at, hot, ihot, pair_laws, bonds, n_mat, spheres)
            arm_i, arm_j = hot[i, RADIUS] - 0.5 * at.u, hot[j, RADIUS] - 0.5 * at.u
            _spring(force, i, j, at.nx, at.ny, kn, ks, arm_i, arm_j, u, shift + i, shift + j)
            if len(turning) > 0:
                torque = turning[k] * (u[i, 2] - u[j, 2])
                force[shift + i, 2] += torque
                force[shift + j, 2] -= torque


@njit(cache=True, nogil=True, error_model="numpy")
def walls(hot, ihot, table, slot_row, slot_wall, slot_side, wall_laws, n_mat, n_left, turning, u, out):
    """Add K u of the contacts with walls to the owned particles, out (n_own, 3) f8; turning: see `pairs`."""
    first = 0
    while first < len(slot_row):
        last = end_of_slots(slot_row, first, len(slot_row))
        i = slot_row[first]
        c = i - n_left
        for k in range(first, last):
            at = wall_state(k, first, last, hot, ihot, table, slot_row, slot_wall, slot_side, wall_laws, n_mat)
            if at.where == NONE:
                continue
            nx, ny, arm = at.nx, at.ny, hot[i, RADIUS] - 0.5 * at.u
            fn = at.kn * (nx * u[i, 0] + ny * u[i, 1])
            fs = (at.ks if at.mu > 0.0 else 0.0) * (nx * u[i, 1] - ny * u[i, 0] + u[i, 2] * arm)
            out[c, 0] += fn * nx - fs * ny
            out[c, 1] += fn * ny + fs * nx
            out[c, 2] += fs * arm
            if len(turning) > 0:
                out[c, 2] += turning[k] * u[i, 2]
        first = last

"""Compute the sums of the energy budget: stored energy and flows (docs/physics.md, Energy). Reads only.

Flows are booked in passes beside those of the step: `kicks` and `wall_work` before the particles move, `pair_losses`
and `wall_losses` after the forces, with the shear forces of the step before. What is stored is summed when somebody
asks. Every number of a particle or contact goes into exact bins (numerics/exact_sum.py), a pair where its earlier
partner is owned, so no sum depends on ranks, threads or order.

Velocities stand at half steps. A kick v -> v' = v + F dt/m changes (m v^2)/2 by exactly F . (v + v')/2 dt; all work is
therefore taken with the mean of the velocities before and after the kick. At the whole step between, the motion is
given m v . v'/2, and half of the kick is that with v alone: from one whole step to the next all forces then do the work
(F before + F now)/2 dx, the trapezium, exactly. (m v . v'/2 is (m v^2)/2 of the mean velocity less m (F dt/m)^2/8; it
is what a leap-frog keeps constant together with the energy of linear springs.)
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hpcdem.core.fields import MATERIAL, RADIUS, SPIN, VX, VY, X, Y
from hpcdem.numerics.exact_sum import add_to_bins
from hpcdem.numerics.lanes import as_bits
from hpcdem.physics.dem.kernels import laws
from hpcdem.physics.dem.kernels.contacts import MODEL, USER, A, B, pair_law, pair_state
from hpcdem.physics.dem.kernels.motion import ALPHA, CLUMPED, INERTIA, KICK_SPIN, KICK_X, KICK_Y, MASS
from hpcdem.physics.dem.kernels.walls import (
    NONE,
    P1X,
    P1Y,
    P2X,
    P2Y,
    WVX,
    WVY,
    end_of_slots,
    heir,
    meeting,
    wall_state,
)  # fmt: skip

# Flows [J], the rows of bins (11, 2, 2112): work done on the model, then what it loses; LAWS: in pairs with a user law
# (user_pairs.py); TURNED: by rolling resistance (rolling.py).
GRAVITY, WALLS, DRIVEN, FRICTION, LOCAL, LATTICE, BONDS, OPENED, STIFFNESS, LAWS, TURNED = range(11)
FLOWS = 11
# What is stored [J], rows of bins (6, 2, 2112).
TRANSLATION, ROTATION, NORMAL, SHEAR, BONDED, ROLLING = range(6)
STORED = 6


@njit(cache=True, error_model="numpy")
def book(bins, row, value):
    if value != 0.0:
        add_to_bins(bins[row], as_bits(value))


# ---- particles -----------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def kicks(t, hot, n_left, cut, lo, foff, force, body, gx, gy, eta, dt, whole, sign, bins):
    """Work of gravity, of what drives fixed particles, and losses by damping in the coming kick of block t.

    whole: the whole kick, otherwise the half up to the whole step; sign: 1 to book, -1 to take back. Arguments else as
    motion.move. Members of clumps are skipped; the clumps themselves come in the same way as particles (rigid.py).
    """
    shift = foff[t] - lo[t]
    span, to_mean = (sign * dt, 0.5) if whole else (sign * 0.5 * dt, 0.0)
    for i in range(cut[t], cut[t + 1]):
        c, r = i - n_left, shift + i
        if body[c, CLUMPED] != 0.0:
            continue
        m, alpha = body[c, MASS], body[c, ALPHA]
        gravity, driven, lattice, local = 0.0, 0.0, 0.0, 0.0
        for axis in range(2):
            v, f, kick = hot[i, VX + axis], force[r, axis], body[c, KICK_X + axis]
            weight = m * (gx if axis == 0 else gy)
            if kick == 0.0:  # fixed: it keeps its velocity because something pushes against all forces
                gravity += weight * v
                driven -= (f + weight) * v
                continue
            drag = eta * v
            net = f + weight - drag
            kept = laws.damped(net, v, alpha)
            mean = v + to_mean * (kept * kick)
            gravity += weight * mean
            lattice += drag * mean
            local += (net - kept) * mean
        w, f, kick = hot[i, SPIN], force[r, 2], body[c, KICK_SPIN]
        if kick == 0.0:
            driven -= f * w
        else:
            kept = laws.damped(f, w, alpha)
            local += (f - kept) * (w + to_mean * (kept * kick))
        book(bins, GRAVITY, gravity * span)
        book(bins, DRIVEN, driven * span)
        book(bins, LATTICE, lattice * span)
        book(bins, LOCAL, local * span)


@njit(cache=True, nogil=True, error_model="numpy")
def kinetic(t, hot, n_left, cut, lo, foff, force, body, gx, gy, eta, whole_step, stored):
    """Kinetic energy of the owned particles of block t at the whole step, or at the half step before it; nothing of
    members of clumps."""
    shift = foff[t] - lo[t]
    for i in range(cut[t], cut[t + 1]):
        c, r = i - n_left, shift + i
        if body[c, CLUMPED] != 0.0:
            continue
        m, alpha = body[c, MASS], body[c, ALPHA]
        vx, vy, w = hot[i, VX], hot[i, VY], hot[i, SPIN]
        next_vx, next_vy, next_w = vx, vy, w
        if whole_step:
            next_vx += laws.damped(force[r, 0] + m * gx - eta * vx, vx, alpha) * body[c, KICK_X]
            next_vy += laws.damped(force[r, 1] + m * gy - eta * vy, vy, alpha) * body[c, KICK_Y]
            next_w += laws.damped(force[r, 2], w, alpha) * body[c, KICK_SPIN]
        book(stored, TRANSLATION, 0.5 * m * (vx * next_vx + vy * next_vy))
        book(stored, ROTATION, 0.5 * body[c, INERTIA] * w * next_w)


# ---- pairs ---------------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def pair_losses(
    t, hot, ihot, cut, lo, poff, ptr, partner, fs, bond, u_made, fs_before, bond_before, pairs, bonds, n_mat, dt,
    spheres, bins,
):  # fmt: skip
    """Compute the losses of the pairs of block t in the step whose forces have just been computed.

    fs_before, bond_before: shear forces and bonds of the slots before that. The work done on the spring of a pair in
    the step is (Fs before + Fs now)/2 ds, the trapezium that belongs to work with mean velocities. Of it are stored
    Fs^2/(2 ks) now less before; the rest is booked:

    - slip: (Fs before + Fs now)/2 times the part of ds that did not strain the spring, to FRICTION, or to BONDS in the
      step in which a bond breaks, together with the energy of its normal force;
    - STIFFNESS: Fs^2/2 (1/ks before - 1/ks now), Fs that before the step: what an incremental law loses when the spring
      stiffens with the overlap, and gains when it softens;
    - OPENED: Fs^2/(2 ks) and the work of the step, of a contact that opens.
    """
    p = poff[t] - lo[t]
    for i in range(cut[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            before, now, tied = fs_before[k], fs[k], bond_before[k]
            if before == 0.0 and now == 0.0 and tied == bond[k]:
                continue
            j = partner[k]
            if pairs[ihot[i, MATERIAL] * n_mat + ihot[j, MATERIAL], MODEL] >= USER:
                continue
            dx, dy = hot[j, X] - hot[i, X], hot[j, Y] - hot[i, Y]
            dvx, dvy = hot[j, VX] - hot[i, VX], hot[j, VY] - hot[i, VY]
            ri, rj, made = hot[i, RADIUS], hot[j, RADIUS], u_made[k]
            d2, nx, ny, u, two_rt = laws.pair_geometry(dx, dy, ri, rj)
            arm_i, arm_j = ri - 0.5 * u, rj - 0.5 * u
            sliding = laws.sliding_speed(nx, ny, dvx, dvy, hot[i, SPIN], hot[j, SPIN], arm_i, arm_j)
            _, _, _, u_before, _ = laws.pair_geometry(dx - dvx * dt, dy - dvy * dt, ri, rj)
            _, ks_before, _, _ = pair_law(i, j, tied, made, hot, ihot, pairs, bonds, n_mat, spheres, two_rt, u_before)
            if tied == 0 and d2 > (ri + rj) * (ri + rj):
                book(bins, OPENED, laws.shear_energy(before, ks_before) + 0.5 * before * sliding * dt)
                continue
            fn, ks, _, energy = pair_law(i, j, tied, made, hot, ihot, pairs, bonds, n_mat, spheres, two_rt, u)
            if tied == 0 or bond[k] == 0:  # a bond that holds does not slip
                slip = (before + ks * sliding * dt - now) / ks if ks > 0.0 else sliding * dt
                loss = 0.5 * (before + now) * slip
                if tied != 0 and u < 0.0:  # strained up to now; its force has not pulled in the rest of the last step
                    loss += energy - 0.5 * fn * (u - u_before)
                elif tied != 0:  # from now on the spring is that of the contact
                    _, left, _, _ = pair_law(i, j, 0, made, hot, ihot, pairs, bonds, n_mat, spheres, two_rt, u)
                    loss += laws.shear_energy(now, ks) - laws.shear_energy(now, left)
                book(bins, FRICTION if tied == 0 else BONDS, loss)
            book(bins, STIFFNESS, laws.shear_energy(before, ks_before) - laws.shear_energy(before, ks))


@njit(cache=True, nogil=True, error_model="numpy")
def pair_energy(
    t, hot, ihot, cut, lo, poff, ptr, partner, fs, bond, u_made, pairs, bonds, n_mat, spheres, stored
):  # fmt: skip
    """Elastic energy of the pairs of block t with a built-in law: NORMAL and SHEAR where they touch, BONDED where a
    bond is open."""
    p = poff[t] - lo[t]
    for i in range(cut[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            j = partner[k]
            at = pair_state(i, j, bond[k], u_made[k], hot, ihot, pairs, bonds, n_mat, spheres)
            if not at.active or pairs[ihot[i, MATERIAL] * n_mat + ihot[j, MATERIAL], MODEL] >= USER:
                continue
            shear = laws.shear_energy(fs[k], at.ks)
            if at.u >= 0.0:
                book(stored, NORMAL, at.energy)
                book(stored, SHEAR, shear)
            else:
                book(stored, BONDED, at.energy + shear)


# ---- walls ---------------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def wall_work(hot, ihot, walls, slot_row, slot_wall, slot_fs, slot_side, laws_table, n_mat, span, bins):
    """Work that moving walls do in `span` [s] with the present forces: that on the particle times the wall's speed."""
    first = 0
    while first < len(slot_row):
        last = end_of_slots(slot_row, first, len(slot_row))
        for k in range(first, last):
            wall = walls[slot_wall[k]]
            if wall[WVX] == 0.0 and wall[WVY] == 0.0:
                continue
            at = wall_state(k, first, last, hot, ihot, walls, slot_row, slot_wall, slot_side, laws_table, n_mat)
            if at.where != NONE:
                fx, fy = slot_fs[k] * -at.ny - at.fn * at.nx, slot_fs[k] * at.nx - at.fn * at.ny
                book(bins, WALLS, (fx * wall[WVX] + fy * wall[WVY]) * span)
        first = last


@njit(cache=True, error_model="numpy")
def _jump(where, u, advance, law, two_r, was, u_before, advance_before):
    """Normal energy that is lost because a wall contact is another one than before the step: on a face, at an end, or
    dropped there in favour of another wall's, and not because it began or opened. way, way_before: what the motion of
    the step adds to the overlaps now and before."""
    if was == where or (was == NONE and u <= advance) or (where == NONE and u_before + advance_before <= 0.0):
        return 0.0
    loss = 0.0
    if was != NONE:
        fn, _, _, energy = laws.contact_state(law[MODEL], law[A], law[B], two_r, u_before)
        loss += energy + 0.5 * fn * advance_before
    if where != NONE:
        fn, _, _, energy = laws.contact_state(law[MODEL], law[A], law[B], two_r, u)
        loss -= energy - 0.5 * fn * advance
    return loss


@njit(cache=True, nogil=True, error_model="numpy")
def wall_losses(
    hot, ihot, walls, slot_row, slot_wall, slot_fs, slot_side, fs_before, side_before, laws_table, n_mat, dt, bins
):  # fmt: skip
    """Compute the losses of the contacts with walls, as `pair_losses`; fs_before and side_before: histories before the
    forces, of which those that went from wall to wall go with them here."""
    before_walls = walls.copy()
    for w in range(len(walls)):
        before_walls[w, P1X] -= walls[w, WVX] * dt
        before_walls[w, P1Y] -= walls[w, WVY] * dt
        before_walls[w, P2X] -= walls[w, WVX] * dt
        before_walls[w, P2Y] -= walls[w, WVY] * dt
    first = 0
    stored = np.zeros(len(slot_row))
    while first < len(slot_row):
        last = end_of_slots(slot_row, first, len(slot_row))
        i = slot_row[first]
        x, y, r = hot[i, X], hot[i, Y], hot[i, RADIUS]
        x_before, y_before = x - hot[i, VX] * dt, y - hot[i, VY] * dt
        for k in range(first, last):
            if fs_before[k] != 0.0:
                law = laws_table[slot_wall[k] * n_mat + ihot[i, MATERIAL]]
                was, _, _, _, u_before = meeting(
                    k, first, last, x_before, y_before, r, before_walls, slot_wall, side_before
                )
                if was != NONE:
                    ks = laws.contact(law[MODEL], law[A], law[B], 2.0 * r, u_before)[1]
                    stored[k] = laws.shear_energy(fs_before[k], ks)
        for k in range(first, last):
            q = heir(k, first, last, x, y, r, walls, slot_wall, side_before) if fs_before[k] != 0.0 else k
            if q != k:
                fs_before[q], stored[q] = fs_before[q] + fs_before[k], stored[q] + stored[k]
                fs_before[k] = stored[k] = 0.0
        for k in range(first, last):
            before, now, wall = fs_before[k], slot_fs[k], walls[slot_wall[k]]
            vx, vy = hot[i, VX] - wall[WVX], hot[i, VY] - wall[WVY]
            law = laws_table[slot_wall[k] * n_mat + ihot[i, MATERIAL]]
            was, _, mx, my, u_before = meeting(
                k, first, last, x_before, y_before, r, before_walls, slot_wall, side_before
            )
            where, _, nx, ny, u = meeting(k, first, last, x, y, r, walls, slot_wall, side_before)
            if was == NONE and where == NONE:
                continue
            advance, advance_before = (nx * vx + ny * vy) * dt, (mx * vx + my * vy) * dt
            book(bins, OPENED, _jump(where, u, advance, law, 2.0 * r, was, u_before, advance_before))
            if before == 0.0 and now == 0.0:
                continue
            if where == NONE:
                sliding = my * vx - mx * vy - hot[i, SPIN] * r
                book(bins, OPENED, stored[k] + 0.5 * before * sliding * dt)
                continue
            _, ks = laws.contact(law[MODEL], law[A], law[B], 2.0 * r, u)
            sliding = ny * vx - nx * vy - hot[i, SPIN] * (r - 0.5 * u)
            slip = (before + ks * sliding * dt - now) / ks if ks > 0.0 else sliding * dt
            book(bins, FRICTION, 0.5 * (before + now) * slip)
            book(bins, STIFFNESS, stored[k] - laws.shear_energy(before, ks))
        first = last


@njit(cache=True, nogil=True, error_model="numpy")
def wall_energy(hot, ihot, walls, slot_row, slot_wall, slot_fs, slot_side, laws_table, n_mat, stored):
    """Elastic energy of the contacts with walls."""
    first = 0
    while first < len(slot_row):
        last = end_of_slots(slot_row, first, len(slot_row))
        for k in range(first, last):
            at = wall_state(k, first, last, hot, ihot, walls, slot_row, slot_wall, slot_side, laws_table, n_mat)
            if at.where != NONE:
                book(stored, NORMAL, at.energy)
                book(stored, SHEAR, laws.shear_energy(slot_fs[k], at.ks))
        first = last

"""Moments between discs: rolling resistance where they touch each other and walls, and the moments of bonds.

After Ai, Chen, Rotter & Ooi 2011 (Powder Technology 206: 269), with the rate of relative rotation w = w_i - w_j, the
rolling radius Rr = Ri Rj / (Ri + Rj) (R at a wall) and the limit M_max = mu_r Rr Fn:

- type A, constant directional torque: M = M_max sgn(w);
- type C, elastic-plastic spring and dashpot: a spring Mk of stiffness kr, loaded by w dt and cut to |Mk| <= M_max;
  below the limit the dashpot C w is added, C = 2 eta_r sqrt(Ir kr) with 1/Ir = sum of 1/(I + m R^2); none at the limit.

kr = 3 kn mu_r^2 Rr^2 for discs: a uniform bed of springs of width B has kn B^2/12 and carries at most Fn B/6 without
tension, which is M_max for B = 6 mu_r Rr (Jiang et al. 2005). Spheres: 2.25 instead of 3. kn is dFn/dU.

Bonds with a moment (Potyondy & Cundall 2004) have a spring E I/L against w, and break in tension where the stress at
the outer fibre, -Fn/A + |M| Rt/I, exceeds T. I = pi Rt^4/4 between spheres, 2/3 Rt^3 x 1 m between discs.

The torque on i is -M, that on j is +M. A pass of its own, after the forces: models without it do not pay for it. Pairs
are worked through by the owners of both partners, with the same arithmetic.
"""

from __future__ import annotations

import math

from numba import njit, prange

from hpcdem.core.fields import GID, MATERIAL, RADIUS, SPIN, X, Y
from hpcdem.numerics.exact_sum import add_to_bins
from hpcdem.numerics.lanes import as_bits
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.dem.kernels import laws
from hpcdem.physics.dem.kernels.contacts import E_MOD, MODEL, TENSILE, TENSION_BREAKS, A, B, pair_law
from hpcdem.physics.dem.kernels.walls import NONE, end_of_slots, heir, meeting

# What a contact remembers: the stamp of live memory (histories.py), Mk [N m] and torque with the dashpot [N m], both
# for the relative rotation of the lower id, and what its spring stores [J].
STAMP, SPRING, TORQUE, STORED = range(4)
WIDTH = 4
OF_BOND = 0.5
"""Added to the stamp of the moment of a bond."""
# Columns of the properties of a pair of materials, or of a material at a wall.
FRICTION, DAMPING = range(2)


@njit(cache=True, error_model="numpy")
def stiffness(law, two_rt, radius, u, mu, spheres):
    """kr [N m/rad] of a contact with the row `law` of a table of laws at overlap u; radius: Rr [m]."""
    kn = laws.tangent_normal_stiffness(law[MODEL], law[A], two_rt, u)
    return (2.25 if spheres else 3.0) * kn * mu * mu * radius * radius


@njit(cache=True, error_model="numpy")
def torque(spring, kr, limit, damping, inverse_inertia, rate, dt, constant):
    """Mk, M [N m] and stored energy [J] after a step at relative rotation `rate` [rad/s]; constant: type A."""
    if constant:
        return 0.0, (limit if rate > 0.0 else -limit if rate < 0.0 else 0.0), 0.0
    moved = spring + kr * rate * dt
    held = laws.coulomb(moved, limit)
    total = held
    if held == moved and inverse_inertia > 0.0:
        total += 2.0 * damping * math.sqrt(kr / inverse_inertia) * rate
    return held, total, 0.5 * held * held / kr if kr > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def _step(memory, k, law, two_rt, radius, u, of, inverse_inertia, rate, dt, constant, spheres, stamp):
    """Advance the memory of slot k; returns its torque [N m] and what was lost in the step [J]."""
    fn, _ = laws.contact(law[MODEL], law[A], law[B], two_rt, u)
    kr = stiffness(law, two_rt, radius, u, of[FRICTION], spheres)
    limit = of[FRICTION] * radius * fn
    held, total, stored = torque(memory[k, SPRING], kr, limit, of[DAMPING], inverse_inertia, rate, dt, constant)
    lost = memory[k, STORED] - stored + 0.5 * (memory[k, TORQUE] + total) * rate * dt
    memory[k, SPRING], memory[k, TORQUE], memory[k, STORED] = held, total, stored
    memory[k, STAMP] = stamp if held != 0.0 or total != 0.0 else 0.0
    return total, lost


@njit(cache=True, error_model="numpy")
def _open(memory, k, rate, dt):
    """Clear the memory of slot k, whose contact has opened; returns what that lost [J]."""
    lost = memory[k, STORED] + 0.5 * memory[k, TORQUE] * rate * dt
    for column in range(WIDTH):
        memory[k, column] = 0.0
    return lost


@njit(cache=True, error_model="numpy")
def second_moment(two_rt, spheres):
    """Return the second moment of the cross-section of a bond about its middle [m^4]."""
    rt = 0.5 * two_rt
    return 0.25 * math.pi * rt**4 if spheres else 2.0 / 3.0 * rt**3


@njit(cache=True, error_model="numpy")
def _bend(
    t, k, i, j, hot, ihot, u, two_rt, bond, u_made, fs, memory, pairs, bonds, n_mat, spheres, rate, dt, stamp, tally,
    own,
):  # fmt: skip
    """Advance the moment of the bond of slot k, which may break; returns its torque [N m] and what was lost [J]. own:
    the block owns the earlier partner."""
    row = bond[k]
    area, inertia = laws.bond_area(two_rt, spheres), second_moment(two_rt, spheres)
    stiff = bonds[row, E_MOD] * inertia / (hot[i, RADIUS] + hot[j, RADIUS])
    held = memory[k, SPRING] + stiff * rate * dt
    stored = 0.5 * held * held / stiff
    fn, ks, _, _ = pair_law(i, j, row, u_made[k], hot, ihot, pairs, bonds, n_mat, spheres, two_rt, u)
    lost = memory[k, STORED] - stored + 0.5 * (memory[k, TORQUE] + held) * rate * dt
    if 0.5 * two_rt * abs(held) / inertia - fn / area > bonds[row, TENSILE]:
        # of the rest that the bond stores, energy.pair_losses books what it finds: all but the shear of an open one
        lost += stored + (laws.shear_energy(fs[k], ks) if u < 0.0 else 0.0)
        bond[k] = 0
        if own:
            tally[t, TENSION_BREAKS] += 1
        for column in range(WIDTH):
            memory[k, column] = 0.0
        return 0.0, lost
    memory[k, SPRING], memory[k, TORQUE], memory[k, STORED] = held, held, stored
    memory[k, STAMP] = stamp + OF_BOND
    return held, lost


@njit(cache=True, nogil=True, error_model="numpy")
def _of_pairs(
    t, hot, ihot, cut, lo, poff, foff, ptr, partner, bond, u_made, fs, memory, pairs, bonds, bends, properties, n_mat,
    inverse_inertia, dt, constant, spheres, stamp, force, lost, lost_of_bonds, tally,
):  # fmt: skip
    """The part of `torques` between the discs of block t."""
    shift, p = foff[t] - lo[t], poff[t] - lo[t]
    for i in range(lo[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            j = partner[k]
            dx, dy, ri, rj = hot[j, X] - hot[i, X], hot[j, Y] - hot[i, Y], hot[i, RADIUS], hot[j, RADIUS]
            side = 1.0 if ihot[i, GID] < ihot[j, GID] else -1.0  # their order in storage changes
            rate = side * (hot[i, SPIN] - hot[j, SPIN])
            q = ihot[i, MATERIAL] * n_mat + ihot[j, MATERIAL]
            lost[k] = lost_of_bonds[k] = 0.0
            if memory[k, STAMP] == stamp + OF_BOND and bond[k] == 0:  # broken by its forces, or by a command
                lost_of_bonds[k] = _open(memory, k, rate, dt)
            if bends[bond[k]] and memory[k, STAMP] == stamp:
                lost[k] = _open(memory, k, rate, dt)
            resists = bond[k] == 0 and properties[q, FRICTION] > 0.0 and dx * dx + dy * dy < (ri + rj) * (ri + rj)
            if not (resists or bends[bond[k]]):
                if memory[k, STAMP] != 0.0:
                    lost[k] = _open(memory, k, rate, dt)
                continue
            _, _, _, u, two_rt = laws.pair_geometry(dx, dy, ri, rj)
            if resists:
                total, lost[k] = _step(
                    memory, k, pairs[q], two_rt, 0.25 * two_rt, u, properties[q],
                    inverse_inertia[i] + inverse_inertia[j], rate, dt, constant, spheres, stamp,
                )  # fmt: skip
            else:
                total, lost_of_bonds[k] = _bend(
                    t, k, i, j, hot, ihot, u, two_rt, bond, u_made, fs, memory, pairs, bonds, n_mat, spheres, rate, dt,
                    stamp, tally, i >= cut[t],
                )  # fmt: skip
            if i >= cut[t]:
                force[shift + i, 2] -= side * total
            if cut[t] <= j < cut[t + 1]:
                force[shift + j, 2] += side * total


@njit(cache=True, nogil=True, error_model="numpy")
def _of_walls(
    t, hot, ihot, lo, foff, wptr, walls, slot_row, slot_wall, slot_side, memory, table, properties, n_mat,
    inverse_inertia, dt, constant, spheres, stamp, force, lost,
):  # fmt: skip
    """Add the moments at the wall contacts of the owned particles of block t."""
    shift = foff[t] - lo[t]
    first = wptr[t]
    while first < wptr[t + 1]:
        last = end_of_slots(slot_row, first, wptr[t + 1])
        i = slot_row[first]
        x, y, r, rate = hot[i, X], hot[i, Y], hot[i, RADIUS], hot[i, SPIN]
        for k in range(first, last):
            if memory[k, STAMP] != 0.0:  # at the end of a wall, its neighbour there takes over
                q = heir(k, first, last, x, y, r, walls, slot_wall, slot_side)
                if q != k:
                    for column in range(SPRING, WIDTH):
                        memory[q, column] += memory[k, column]
                        memory[k, column] = 0.0
                    memory[q, STAMP], memory[k, STAMP] = stamp, 0.0
        for k in range(first, last):
            where, _, _, _, u = meeting(k, first, last, x, y, r, walls, slot_wall, slot_side)
            m = ihot[i, MATERIAL]
            lost[k] = 0.0
            if where == NONE or properties[m, FRICTION] == 0.0:
                if memory[k, STAMP] != 0.0:
                    lost[k] = _open(memory, k, rate, dt)
                continue
            total, lost[k] = _step(
                memory, k, table[slot_wall[k] * n_mat + m], 2.0 * r, r, u, properties[m], inverse_inertia[i], rate, dt,
                constant, spheres, stamp,
            )  # fmt: skip
            force[shift + i, 2] -= total
        first = last


@on_threads
def torques(
    n_blocks, hot, ihot, cut, lo, poff, foff, ptr, partner, bond, u_made, fs, memory, pairs, bonds, bends, of_pairs,
    wptr, walls, slot_row, slot_wall, slot_side, slot_memory, table, of_walls, n_mat, inverse_inertia, dt, constant,
    spheres, stamp, force, lost, lost_at_walls, lost_of_bonds, tally,
):  # fmt: skip
    """Add the torques of all contacts to force, and move their memories on by dt.

    of_pairs (n_mat^2, 2), of_walls (n_mat, 2): mu_r and eta_r; inverse_inertia (n,): 1/(I + m R^2) per storage row, 0
    where a disc keeps its spin; memory (slots, 4), slot_memory (wall slots, 4): see above; bonds: contacts.bond_laws;
    bends (types,) bool: those with a moment; lost, lost_at_walls, lost_of_bonds: what each lost in the step [J].
    """
    for t in prange(n_blocks):
        _of_pairs(
            t, hot, ihot, cut, lo, poff, foff, ptr, partner, bond, u_made, fs, memory, pairs, bonds, bends, of_pairs,
            n_mat, inverse_inertia, dt, constant, spheres, stamp, force, lost, lost_of_bonds, tally,
        )  # fmt: skip
        _of_walls(
            t, hot, ihot, lo, foff, wptr, walls, slot_row, slot_wall, slot_side, slot_memory, table, of_walls, n_mat,
            inverse_inertia, dt, constant, spheres, stamp, force, lost_at_walls,
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def book(n_blocks, cut, lo, poff, ptr, of_slots, of_wall_slots, bins):
    """Add numbers of the slots, each pair once in the whole model, and of the wall slots to exact bins (2, 2112)."""
    for t in range(n_blocks):
        p = poff[t] - lo[t]
        for k in range(ptr[p + cut[t]], ptr[p + cut[t + 1]]):
            if of_slots[k] != 0.0:
                add_to_bins(bins, as_bits(of_slots[k]))
    for k in range(len(of_wall_slots)):
        if of_wall_slots[k] != 0.0:
            add_to_bins(bins, as_bits(of_wall_slots[k]))


@njit(cache=True, nogil=True, error_model="numpy")
def stiffnesses(
    t, hot, ihot, cut, lo, poff, ptr, partner, bond, pairs, bonds, bends, of_pairs, n_mat, spheres, constant, out
):  # fmt: skip
    """kr of the slots of block t that touch, E I/L of bonds with a moment, into out (slots,) [N m/rad], else 0."""
    p = poff[t] - lo[t]
    for i in range(lo[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            j = partner[k]
            _, _, _, u, two_rt = laws.pair_geometry(
                hot[j, X] - hot[i, X], hot[j, Y] - hot[i, Y], hot[i, RADIUS], hot[j, RADIUS]
            )
            q = ihot[i, MATERIAL] * n_mat + ihot[j, MATERIAL]
            touches = bond[k] == 0 and u > 0.0 and not constant
            mu = of_pairs[q, FRICTION]
            if bends[bond[k]]:
                out[k] = bonds[bond[k], E_MOD] * second_moment(two_rt, spheres) / (hot[i, RADIUS] + hot[j, RADIUS])
                continue
            out[k] = stiffness(pairs[q], two_rt, 0.25 * two_rt, u, mu, spheres) if touches and mu > 0.0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def stiffnesses_at_walls(hot, ihot, walls, slot_row, slot_wall, slot_side, table, of_walls, n_mat, spheres, out):
    """Return the rolling stiffnesses of wall slots."""
    first = 0
    while first < len(slot_row):
        last = end_of_slots(slot_row, first, len(slot_row))
        i = slot_row[first]
        r, m = hot[i, RADIUS], ihot[i, MATERIAL]
        for k in range(first, last):
            where, _, _, _, u = meeting(k, first, last, hot[i, X], hot[i, Y], r, walls, slot_wall, slot_side)
            mu = of_walls[m, FRICTION]
            acts = where != NONE and mu > 0.0
            out[k] = stiffness(table[slot_wall[k] * n_mat + m], 2.0 * r, r, u, mu, spheres) if acts else 0.0
        first = last

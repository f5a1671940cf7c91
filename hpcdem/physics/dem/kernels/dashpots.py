"""Dashpots beside the normal springs of contacts: discs part with a given share of the speed at which they met.

Fn = Fs(U) + c dU/dt, Fs being the spring, with c = f beta sqrt(m S), S = Fs / U the secant stiffness, m the effective
mass, 1/m the sum of those of the partners along the normal (0 where one keeps its velocity), and

    beta = -ln e / sqrt(pi^2 + ln^2 e).

Springs that are linear: f = 2, the damped oscillator, whose speed at the next zero of U is exp(-pi beta / sqrt(1 -
beta^2)) = e times the first. Hertz: f = sqrt(5), c ~ U^(1/4) (Tsuji, Tanaka & Ishida 1992), for which Antypov & Elliott
(2011) found that this e holds exactly, whatever the speed. Both are true up to U = 0: shortly before, the dashpot pulls
more than the spring pushes, and that pull acts.

Bonds and slip know the spring only. A pair is worked through by the owners of both partners, with the same arithmetic.
"""

from __future__ import annotations

import math

from numba import njit, prange

from hpcdem.core.fields import MATERIAL, RADIUS, VX, VY, X, Y
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.dem.kernels import laws
from hpcdem.physics.dem.kernels.contacts import MODEL, A, B
from hpcdem.physics.dem.kernels.walls import NONE, WVX, WVY, end_of_slots, meeting


@njit(cache=True, error_model="numpy")
def coefficient(law, two_rt, u, inverse_mass, beta):
    """c [N s/m] of a contact with the row `law` of a table of laws; inverse_mass [1/kg]: along the normal. 0 where both
    sides keep their velocities."""
    if inverse_mass <= 0.0 or u <= 0.0:
        return 0.0
    fn, _ = laws.contact(law[MODEL], law[A], law[B], two_rt, u)
    factor = math.sqrt(5.0) if law[MODEL] == laws.HERTZ else 2.0
    return factor * beta * math.sqrt(fn / (u * inverse_mass))


@njit(cache=True, nogil=True, error_model="numpy")
def _of_pairs(t, hot, ihot, cut, lo, poff, foff, ptr, partner, bond, pairs, n_mat, mobility, beta, force, rates):
    """The part of `forces` between the discs of block t."""
    shift = foff[t] - lo[t]
    p = poff[t] - lo[t]
    for i in range(lo[t], cut[t + 1]):
        for k in range(ptr[p + i], ptr[p + i + 1]):
            j = partner[k]
            dx, dy, ri, rj = hot[j, X] - hot[i, X], hot[j, Y] - hot[i, Y], hot[i, RADIUS], hot[j, RADIUS]
            if bond[k] != 0 or dx * dx + dy * dy >= (ri + rj) * (ri + rj):
                continue
            _, nx, ny, u, two_rt = laws.pair_geometry(dx, dy, ri, rj)
            of_i = nx * nx * mobility[i, 0] + ny * ny * mobility[i, 1]
            of_j = nx * nx * mobility[j, 0] + ny * ny * mobility[j, 1]
            law = pairs[ihot[i, MATERIAL] * n_mat + ihot[j, MATERIAL]]
            c = coefficient(law, two_rt, u, of_i + of_j, beta)
            push = -c * (nx * (hot[j, VX] - hot[i, VX]) + ny * (hot[j, VY] - hot[i, VY]))
            if i >= cut[t]:
                force[shift + i, 0] -= push * nx
                force[shift + i, 1] -= push * ny
                rates[i] += c * of_i
            if cut[t] <= j < cut[t + 1]:
                force[shift + j, 0] += push * nx
                force[shift + j, 1] += push * ny
                rates[j] += c * of_j


@njit(cache=True, nogil=True, error_model="numpy")
def _of_walls(
    t, hot, ihot, lo, foff, wptr, walls, slot_row, slot_wall, slot_side, table, n_mat, mobility, beta, force, rates,
    on_walls,
):  # fmt: skip
    """Add the forces of dashpots at the wall contacts of the owned particles of block t."""
    shift = foff[t] - lo[t]
    first = wptr[t]
    while first < wptr[t + 1]:
        last = end_of_slots(slot_row, first, wptr[t + 1])
        i = slot_row[first]
        r = hot[i, RADIUS]
        for k in range(first, last):
            where, _, nx, ny, u = meeting(k, first, last, hot[i, X], hot[i, Y], r, walls, slot_wall, slot_side)
            on_walls[k, 0], on_walls[k, 1] = 0.0, 0.0
            if where == NONE:
                continue
            wall, law = walls[slot_wall[k]], table[slot_wall[k] * n_mat + ihot[i, MATERIAL]]
            of_i = nx * nx * mobility[i, 0] + ny * ny * mobility[i, 1]
            c = coefficient(law, 2.0 * r, u, of_i, beta)
            push = c * (nx * (hot[i, VX] - wall[WVX]) + ny * (hot[i, VY] - wall[WVY]))
            on_walls[k, 0], on_walls[k, 1] = -push * nx, -push * ny
            force[shift + i, 0] -= push * nx
            force[shift + i, 1] -= push * ny
            rates[i] += c * of_i
        first = last


@on_threads
def forces(
    n_blocks, hot, ihot, cut, lo, poff, foff, ptr, partner, bond, pairs, wptr, walls, slot_row, slot_wall, slot_side,
    table, n_mat, mobility, beta, force, rates, on_walls,
):  # fmt: skip
    """Add the forces of all dashpots to force.

    mobility (n, 2): 1/m along x and y, 0 where a disc keeps its velocity; rates (n,): the sum of c/m of the contacts of
    each owned particle is added [1/s]; on_walls (slots, 2): force on the particle of each wall slot [N].
    """
    for t in prange(n_blocks):
        _of_pairs(t, hot, ihot, cut, lo, poff, foff, ptr, partner, bond, pairs, n_mat, mobility, beta, force, rates)
        _of_walls(
            t, hot, ihot, lo, foff, wptr, walls, slot_row, slot_wall, slot_side, table, n_mat, mobility, beta, force,
            rates, on_walls,
        )  # fmt: skip

"""Particle-wall contacts.

A wall is a segment P1-P2. Inside the segment the normal is the wall's; beyond an end the end point is a point
obstacle. Two-sided walls push a particle to the side on which its centre was when the contact began (kept per
contact, so that the overlap may exceed the radius); one-sided walls, and the BOX, push to the left of P1 -> P2.
Rt = R, overlap U = R - distance and the particle's own moduli: the law found in published states of ZDEM (Hertz
force of the floor equals the weight above it).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange

from hpcdem.core.fields import GID, MATERIAL, RADIUS, SPIN, VX, VY, X, Y
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.dem.kernels import laws
from hpcdem.physics.dem.kernels.contacts import MODEL, MU, A, B

# Columns of the wall table used by the kernels.
P1X, P1Y, P2X, P2Y, WVX, WVY, ONE_SIDED = range(7)

NONE, FACE, END1, END2 = 0, 1, 2, 3


@njit(cache=True, error_model="numpy")
def closest(wall, x, y):
    """Return where a point meets a wall: (FACE, END1 or END2; signed distance to the line, left positive; nearest
    point)."""
    ex, ey = wall[P2X] - wall[P1X], wall[P2Y] - wall[P1Y]
    length = math.sqrt(ex * ex + ey * ey)
    ex /= length
    ey /= length
    rx, ry = x - wall[P1X], y - wall[P1Y]
    along = rx * ex + ry * ey
    h = ex * ry - ey * rx
    if along <= 0.0:
        return END1, h, wall[P1X], wall[P1Y]
    if along >= length:
        return END2, h, wall[P2X], wall[P2Y]
    return FACE, h, wall[P1X] + along * ex, wall[P1Y] + along * ey


@njit(cache=True, error_model="numpy")
def geometry(wall, x, y, r, side):
    """Contact of a disc with a wall: (where, side, n_x, n_y, overlap, nearest point). where is NONE without contact.

    n points from the particle to the wall. `side` is the stored side (+1 left, -1 right, 0 none yet).
    """
    where, h, qx, qy = closest(wall, x, y)
    if where == FACE:
        if wall[ONE_SIDED] != 0.0:
            if h <= -r or h >= r:
                return NONE, 0.0, 0.0, 0.0, 0.0, qx, qy
            side = 1.0
        elif side == 0.0:
            if abs(h) >= r:
                return NONE, 0.0, 0.0, 0.0, 0.0, qx, qy
            side = 1.0 if h >= 0.0 else -1.0
        u = r - side * h
        if u < 0.0:
            return NONE, 0.0, 0.0, 0.0, 0.0, qx, qy
        ex, ey = wall[P2X] - wall[P1X], wall[P2Y] - wall[P1Y]
        length = math.sqrt(ex * ex + ey * ey)
        return FACE, side, side * ey / length, -side * ex / length, u, qx, qy
    dx, dy = qx - x, qy - y
    d = math.sqrt(dx * dx + dy * dy)
    if d >= r or d == 0.0:
        return NONE, 0.0, 0.0, 0.0, 0.0, qx, qy
    return where, 0.0, dx / d, dy / d, r - d, qx, qy  # round the end it may come to the other side


@njit(cache=True, error_model="numpy")
def _cover(k, first, last, walls, slot_wall, slot_side, x, y, r, px, py):
    """The slot by which the particle meets the end point (px, py) of slot k as well: by the face of a wall that passes
    through this point, else by an end there with a lower number; -1 if none does."""
    found = -1
    for q in range(first, last):
        if q == k:
            continue
        where, _, _, _, _, qx, qy = geometry(walls[slot_wall[q]], x, y, r, slot_side[q])
        if where == FACE:
            _, _, qx, qy = closest(walls[slot_wall[q]], px, py)
        if where == NONE or abs(qx - px) > 1e-9 * r or abs(qy - py) > 1e-9 * r:
            continue
        if where == FACE:
            return q
        if q < k and found < 0:
            found = q
    return found


@njit(cache=True, error_model="numpy")
def heir(k, first, last, x, y, r, walls, slot_wall, slot_side):
    """The slot that continues with the shear force of slot k, of a particle with the slots first : last: where the
    particle has come to an end of its wall, that of the wall by which it meets this end as well; else k itself.

    The number means the same at the new wall: the tangent belongs to the normal from the particle to the wall.
    """
    where, _, px, py = closest(walls[slot_wall[k]], x, y)
    if where == FACE:
        return k
    q = _cover(k, first, last, walls, slot_wall, slot_side, x, y, r, px, py)
    return q if q >= 0 else k


@njit(cache=True, error_model="numpy")
def meeting(k, first, last, x, y, r, walls, slot_wall, slot_side):
    """Geometry of wall slot k, of a particle with the slots first : last and this place and radius: (where, side, n_x,
    n_y, U)."""
    where, side, nx, ny, u, qx, qy = geometry(walls[slot_wall[k]], x, y, r, slot_side[k])
    if where > FACE and _cover(k, first, last, walls, slot_wall, slot_side, x, y, r, qx, qy) >= 0:
        where = NONE
        side = 0.0
    return where, side, nx, ny, u


class WallState(NamedTuple):
    """The contact of a wall slot as it lies: where (NONE: no contact, the rest is zero), side, normal from particle to
    wall, overlap [m], what laws.contact_state says of it [N, N/m, N/m, J], and friction."""

    where: int
    side: float
    nx: float
    ny: float
    u: float
    fn: float
    ks: float
    kn: float
    energy: float
    mu: float


@njit(cache=True, error_model="numpy")
def wall_state(k, first, last, hot, ihot, walls, slot_row, slot_wall, slot_side, laws_table, n_mat):
    """The state of wall slot k, of a particle with the slots first : last."""
    i = slot_row[k]
    r = hot[i, RADIUS]
    where, side, nx, ny, u = meeting(k, first, last, hot[i, X], hot[i, Y], r, walls, slot_wall, slot_side)
    if where == NONE:
        return WallState(where, side, nx, ny, u, 0.0, 0.0, 0.0, 0.0, 0.0)
    law = laws_table[slot_wall[k] * n_mat + ihot[i, MATERIAL]]
    fn, ks, kn, energy = laws.contact_state(law[MODEL], law[A], law[B], 2.0 * r, u)
    return WallState(where, side, nx, ny, u, fn, ks, kn, energy, law[MU])


@njit(cache=True, error_model="numpy")
def end_of_slots(slot_row, first, stop):
    """One past the last slot, before `stop`, of the particle of slot `first`."""
    last = first + 1
    while last < stop and slot_row[last] == slot_row[first]:
        last += 1
    return last


@njit(cache=True, nogil=True, error_model="numpy")
def _block(
    t, hot, ihot, lo, foff, force, wptr, walls, slot_row, slot_wall, slot_fs, slot_side, new_side, laws_table, n_mat, dt
):  # fmt: skip
    """Add the wall forces on the owned particles of block t; shear histories move on by dt.

    Slots wptr[t] : wptr[t+1] are sorted by row, then wall. Sides are renewed after all slots of a particle were seen.
    """
    shift = foff[t] - lo[t]
    k = wptr[t]
    while k < wptr[t + 1]:
        i = slot_row[k]
        first, last = k, end_of_slots(slot_row, k, wptr[t + 1])
        vx, vy, w, r = hot[i, VX], hot[i, VY], hot[i, SPIN], hot[i, RADIUS]
        if last - first > 1:
            for k in range(first, last):
                if slot_fs[k] != 0.0:
                    q = heir(k, first, last, hot[i, X], hot[i, Y], r, walls, slot_wall, slot_side)
                    if q != k:
                        slot_fs[q] += slot_fs[k]
                        slot_fs[k] = 0.0
        for k in range(first, last):
            at = wall_state(k, first, last, hot, ihot, walls, slot_row, slot_wall, slot_side, laws_table, n_mat)
            new_side[k] = at.side
            if at.where == NONE:
                slot_fs[k] = 0.0
                continue
            wall = walls[slot_wall[k]]
            arm = r - 0.5 * at.u
            vs = at.ny * (vx - wall[WVX]) + at.nx * (wall[WVY] - vy) - w * arm
            s = laws.coulomb(slot_fs[k] + at.ks * vs * dt, at.mu * at.fn)
            slot_fs[k] = s
            force[shift + i, 0] += s * -at.ny - at.fn * at.nx
            force[shift + i, 1] += s * at.nx - at.fn * at.ny
            force[shift + i, 2] += s * arm
        for k in range(first, last):
            slot_side[k] = new_side[k]
        k = last


@on_threads
def forces(n_blocks, *args):
    """All blocks, see `_block`."""
    for t in prange(n_blocks):
        _block(t, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def report(hot, ihot, walls, slot_row, slot_wall, slot_fs, slot_side, laws_table, n_mat, out, iout):
    """Wall contacts as rows: out (m, 8) f8: Fn, Fs, Fx, Fy (on the particle), x, y, overlap, tangent stiffness;
    iout (m, 2) i8: gid, wall row. Returns the number of rows; nothing of the state changes."""
    n = 0
    k = 0
    while k < len(slot_row):
        first, last = k, end_of_slots(slot_row, k, len(slot_row))
        for k in range(first, last):
            at = wall_state(k, first, last, hot, ihot, walls, slot_row, slot_wall, slot_side, laws_table, n_mat)
            if at.where == NONE:
                continue
            i, s = slot_row[k], slot_fs[k]
            arm = hot[i, RADIUS] - 0.5 * at.u
            out[n, 0] = at.fn
            out[n, 1] = s
            out[n, 2] = s * -at.ny - at.fn * at.nx
            out[n, 3] = s * at.nx - at.fn * at.ny
            out[n, 4] = hot[i, X] + arm * at.nx
            out[n, 5] = hot[i, Y] + arm * at.ny
            out[n, 6] = at.u
            out[n, 7] = at.kn
            iout[n, 0] = ihot[i, GID]
            iout[n, 1] = slot_wall[k]
            n += 1
        k = last
    return n


def wall_table(materials: np.ndarray, kn: np.ndarray, ks: np.ndarray, fric: np.ndarray) -> np.ndarray:
    """Wall laws: (n_walls * n_materials, 4) f8 [MODEL, A, B, MU].

    Hertz particles: their own G and nu, the wall's kn, ks unused; linear ones: springs in series with the wall's.
    """
    table = np.empty((len(kn), len(materials), 4))
    for w in range(len(kn)):
        for m, mat in enumerate(materials):
            mu = min(mat["fric"], fric[w])
            if mat["hertz"]:
                a = laws.hertz_normal_factor(mat["shear"], mat["poiss"])
                table[w, m] = laws.HERTZ, a, laws.mindlin_shear_factor(mat["shear"], mat["poiss"]), mu
            else:
                table[w, m] = (
                    laws.LINEAR,
                    laws.series_stiffness(mat["kn"], kn[w]),
                    laws.series_stiffness(mat["ks"], ks[w]),
                    mu,
                )
    return table.reshape(len(kn) * len(materials), 4)

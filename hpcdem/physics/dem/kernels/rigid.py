"""Rigid clumps: bodies made of discs that move as one.

The clumps that have a member on this rank stand in a table of their own, in the layout of the particles, and are moved
by the same loop (motion.py): forces and torques of the members, summed in the order of their ids, take the place of
the contact forces of a particle. Where a member is follows from centre, angle and its place in the body, so that a
body never changes its shape, however often it turns:

    x_i = c + R(a) d_i,      v_i = v + w z x R(a - w dt/2) d_i,      w_i = w

(velocities stand half a step behind positions, as those of particles do). Ranks that share a clump compute it from
equal numbers in equal order, hence to equal bits; only the forces on members at the borders are exchanged.

Like all of physics, this does not depend on ranks: rows are those of the storage [left ghosts | owned | right ghosts].
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from hpcdem.core.fields import (
    ANGLE,
    AREA,
    CLUMP,
    CLUMP_ANGLE,
    CLUMP_SPIN,
    CLUMP_VX,
    CLUMP_X,
    FIX,
    GID,
    MATERIAL,
    MEMBERS,
    MOMENT,
    OFFSET_X,
    OFFSET_Y,
    RADIUS,
    SPIN,
    VX,
    VY,
    WIDTH,
    X,
    Y,
)
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.dem.kernels.motion import ALPHA, CLUMPED, INERTIA, KICK_SPIN, KICK_X, KICK_Y, MASS


class Bodies:
    """The clumps with a member on this rank, those first whose first member is owned here (`mine` of n).

    hot, cold, body (n, 8) f8: as those of particles; the gid is that of the clump. force (n, 4) f8: fx, fy, torque
    about the centre. Members of clump b are start[b] : start[b + 1], in the order of their ids, of row (m,) i8 (storage
    rows), offset (m, 2) [m] in the frame of the clump, arm (m, 2) [m] from its centre now, and source (m,) i8: where
    the force on the member stands, a row of the lists' forces, or -1 - storage row of a ghost. speaker (n,) i8: storage
    row of the first owned member. area (n,) [m2], moment (n,) [m4].
    """

    def __init__(self, rows: np.ndarray, body: np.ndarray, n: int, mine: int) -> None:
        self.n, self.mine = n, mine
        self.row, self.of = rows, body
        self.start = np.searchsorted(body, np.arange(n + 1)).astype(np.int64)
        self.hot, self.cold, self.body = np.zeros((n, WIDTH)), np.zeros((n, WIDTH)), np.zeros((n, WIDTH))
        self.force = np.zeros((n, 4))
        self.offset, self.arm = np.empty((len(rows), 2)), np.zeros((len(rows), 2))
        self.source = np.empty(len(rows), np.int64)
        self.speaker = np.empty(n, np.int64)
        self.area, self.moment = np.empty(n), np.empty(n)

    def blocks(self, parts: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """cut, lo, foff of so many blocks, as the loops of motion.py and energy.py take them."""
        return _blocks(self.n, parts)

    def mine_as_block(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the members as one block with those that this rank counts."""
        return _blocks(self.mine, 1)

    def write_back(self, rigid: np.ndarray, n_left: int, n_own: int) -> None:
        """Put the present state into the rows of the owned members."""
        own = (self.row >= n_left) & (self.row < n_left + n_own)
        rigid[self.row[own], CLUMP_X : CLUMP_ANGLE + 1] = self._state()[self.of[own]]

    def read(self, rigid: np.ndarray) -> None:
        """Take the state from the rows of the owned members."""
        state = rigid[self.speaker]
        self.hot[:, X : SPIN + 1] = state[:, CLUMP_X : CLUMP_SPIN + 1]
        self.cold[:, ANGLE] = state[:, CLUMP_ANGLE]

    def _state(self) -> np.ndarray:
        return np.column_stack([self.hot[:, X : SPIN + 1], self.cold[:, ANGLE]])

    def reach(self) -> np.ndarray:
        """Farthest centre of a member from that of its clump (n,) [m]."""
        far = np.zeros(self.n)
        np.maximum.at(far, self.of, np.hypot(self.offset[:, 0], self.offset[:, 1]))
        return far


def _blocks(n: int, parts: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    cut = (np.arange(parts + 1, dtype=np.int64) * n) // parts
    return cut, cut[:-1].copy(), cut[:-1].copy()


def gather(
    ihot: np.ndarray, rigid: np.ndarray, n_left: int, n_own: int, cut: np.ndarray, lo: np.ndarray, foff: np.ndarray
) -> Bodies | None:
    """The clumps of a rank. ihot (n, 8), rigid (n, 12): storage with ghosts; cut, lo, foff: blocks of the force rows.

    None if a member of a clump with an owned member is neither owned nor a ghost: then the columns were too narrow.
    """
    numbers = rigid.view(np.int64)
    rows = np.flatnonzero(numbers[:, CLUMP] >= 0)
    rows = rows[np.argsort(ihot[rows, GID])]
    gid, clump = ihot[rows, GID], numbers[rows, CLUMP]
    own = (rows >= n_left) & (rows < n_left + n_own)
    leads = gid == clump
    first = clump[leads]  # ascending, as ids are
    at = np.minimum(np.searchsorted(first, clump), max(len(first) - 1, 0))
    whole = first[at] == clump if len(first) else np.zeros(len(clump), bool)
    if not whole[own].all():
        return None
    touched = np.bincount(at[own], minlength=len(first)) > 0
    number = np.full(len(first), -1)
    here = np.flatnonzero(touched)
    mine = own[leads][here]
    number[here[np.argsort(~mine, kind="stable")]] = np.arange(len(here))
    body = np.where(whole, number[at] if len(first) else -1, -1)
    order = np.argsort(body, kind="stable")
    order = order[np.searchsorted(body[order], 0) :]
    rows, body, own = rows[order], body[order], own[order]
    bodies = Bodies(rows, body, len(here), int(mine.sum()))
    if (np.diff(bodies.start) != numbers[rows[bodies.start[:-1]], MEMBERS]).any():
        return None
    bodies.offset[:] = rigid[rows, OFFSET_X : OFFSET_Y + 1]
    _, seen = np.unique(body[own], return_index=True)
    bodies.speaker[:] = rows[own][seen]
    bodies.area[:], bodies.moment[:] = rigid[bodies.speaker, AREA], rigid[bodies.speaker, MOMENT]
    bodies.hot[:, RADIUS] = np.sqrt(bodies.area / math.pi)
    bodies.hot.view(np.int64)[:, GID] = numbers[bodies.speaker, CLUMP]
    block = np.searchsorted(cut, rows, side="right") - 1
    block = np.clip(block, 0, len(lo) - 1)
    bodies.source[:] = np.where(own, foff[block] + rows - lo[block], -1 - rows)
    bodies.read(rigid)
    turn(bodies.cold, bodies.start, bodies.offset, bodies.arm)
    return bodies


@njit(cache=True, nogil=True, error_model="numpy")
def turn(cold, start, offset, arm):
    """Places of the members about the centre, from the angles of the clumps."""
    for b in range(len(start) - 1):
        c, s = math.cos(cold[b, ANGLE]), math.sin(cold[b, ANGLE])
        for k in range(start[b], start[b + 1]):
            dx, dy = offset[k, 0], offset[k, 1]
            arm[k, 0], arm[k, 1] = dx * c - dy * s, dx * s + dy * c


@njit(cache=True, nogil=True, error_model="numpy")
def member_velocities(chosen, hot, rigid, n_left):
    """Velocities of the owned members `chosen` (indices) from the state of their clumps, at the present angle."""
    for c in chosen:
        i = n_left + c
        a, w = rigid[i, CLUMP_ANGLE], rigid[i, CLUMP_SPIN]
        dx, dy = rigid[i, OFFSET_X], rigid[i, OFFSET_Y]
        hot[i, VX] = rigid[i, CLUMP_VX] - w * (dx * math.sin(a) + dy * math.cos(a))
        hot[i, VY] = rigid[i, CLUMP_VX + 1] + w * (dx * math.cos(a) - dy * math.sin(a))
        hot[i, SPIN] = w


@njit(cache=True, nogil=True, error_model="numpy")
def fill(hot, ihot, icold, n_left, n_own, density, damp, dt, start, row, speaker, area, moment, bcold, bbody, body):
    """The body tables: bbody (n, 8) of the clumps, and of their owned members in body (n_own, 8), which are marked
    CLUMPED, cannot be kicked, and have their share of mass by the area of their discs.

    density, damp: per material. A clump has those of its first owned member, and its fixed directions; commands keep
    these equal in a clump.
    """
    ints = bcold.view(np.int64)
    for b in range(len(start) - 1):
        i = speaker[b]
        material, fix = ihot[i, MATERIAL], icold[i - n_left, FIX]
        m, inertia = density[material] * area[b], density[material] * moment[b]
        ints[b, FIX] = fix
        bbody[b, MASS], bbody[b, INERTIA], bbody[b, ALPHA], bbody[b, CLUMPED] = m, inertia, damp[material], 0.0
        bbody[b, KICK_X] = 0.0 if fix & 1 else dt / m
        bbody[b, KICK_Y] = 0.0 if fix & 2 else dt / m
        bbody[b, KICK_SPIN] = 0.0 if fix & 4 else dt / inertia
        square = 0.0
        for k in range(start[b], start[b + 1]):
            square += hot[row[k], RADIUS] ** 2
        for k in range(start[b], start[b + 1]):
            c = row[k] - n_left
            if 0 <= c < n_own:
                share = m * (hot[row[k], RADIUS] ** 2 / square)
                body[c, MASS], body[c, INERTIA] = share, 0.5 * share * hot[row[k], RADIUS] ** 2
                body[c, ALPHA], body[c, CLUMPED] = damp[material], 1.0
                body[c, KICK_X] = body[c, KICK_Y] = body[c, KICK_SPIN] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _sum(t, parts, start, source, arm, force, far, out):
    n = len(start) - 1
    for b in range(n * t // parts, n * (t + 1) // parts):
        x, y, torque = 0.0, 0.0, 0.0
        for k in range(start[b], start[b + 1]):
            r = source[k]
            if r >= 0:
                fx, fy, m = force[r, 0], force[r, 1], force[r, 2]
            else:
                fx, fy, m = far[-1 - r, 0], far[-1 - r, 1], far[-1 - r, 2]
            x += fx
            y += fy
            torque += m + (arm[k, 0] * fy - arm[k, 1] * fx)
        out[b, 0], out[b, 1], out[b, 2] = x, y, torque


@on_threads
def sum_forces(parts, *args):
    """Force and torque on each clump from those on its members, into out (n, 4) f8. far (n_storage, .): those of the
    ghosts."""
    for t in prange(parts):
        _sum(t, parts, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def _place(t, parts, bhot, bcold, start, row, offset, arm, hot, cold, n_left, n_own, dt):
    n = len(start) - 1
    for b in range(n * t // parts, n * (t + 1) // parts):
        x, y, vx, vy, w, a = bhot[b, X], bhot[b, Y], bhot[b, VX], bhot[b, VY], bhot[b, SPIN], bcold[b, ANGLE]
        half = a - 0.5 * w * dt
        c, s, hc, hs = math.cos(a), math.sin(a), math.cos(half), math.sin(half)
        for k in range(start[b], start[b + 1]):
            dx, dy = offset[k, 0], offset[k, 1]
            ax, ay = dx * c - dy * s, dx * s + dy * c
            arm[k, 0], arm[k, 1] = ax, ay
            i = row[k]
            if n_left <= i < n_left + n_own:
                hot[i, X], hot[i, Y] = x + ax, y + ay
                hot[i, VX] = vx - w * (dx * hs + dy * hc)
                hot[i, VY] = vy + w * (dx * hc - dy * hs)
                hot[i, SPIN] = w
                cold[i - n_left, ANGLE] = a


@on_threads
def place(parts, *args):
    """Owned members go where their clumps are."""
    for t in prange(parts):
        _place(t, parts, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def stiffness(start, row, arm, bbody, member, out):
    """Compute for each clump the stiffness [N/m] that gives mass over stiffness its meaning, out (n,) f8, from those of
    its members, member (n_storage,): sum of k (1 + |arm|^2 m / I).

    A contact spring k at a lever arm h bears the mass 1 / (1/m + h^2/I); the sum over the springs of a body bounds its
    highest frequency, and h is at most the distance of the member.
    """
    for b in range(len(start) - 1):
        total, ratio = 0.0, bbody[b, MASS] / bbody[b, INERTIA]
        for k in range(start[b], start[b + 1]):
            total += member[row[k]] * (1.0 + (arm[k, 0] ** 2 + arm[k, 1] ** 2) * ratio)
        out[b] = total


@njit(cache=True, nogil=True, error_model="numpy")
def motions_of_members(start, row, arm, motion, out):
    """Small motions (ux, uy, turn) of the clumps as motions of their members, into out (n_storage, 3)."""
    for b in range(len(start) - 1):
        for k in range(start[b], start[b + 1]):
            out[row[k], 0] = motion[b, 0] - motion[b, 2] * arm[k, 1]
            out[row[k], 1] = motion[b, 1] + motion[b, 2] * arm[k, 0]
            out[row[k], 2] = motion[b, 2]


@njit(cache=True, nogil=True, error_model="numpy")
def forces_of_members(start, row, arm, member, out):
    """The transpose: forces and torques member (n_storage, 3) of the members as those of the clumps, out (n, 3)."""
    for b in range(len(start) - 1):
        x, y, torque = 0.0, 0.0, 0.0
        for k in range(start[b], start[b + 1]):
            fx, fy = member[row[k], 0], member[row[k], 1]
            x += fx
            y += fy
            torque += member[row[k], 2] + (arm[k, 0] * fy - arm[k, 1] * fx)
        out[b, 0], out[b, 1], out[b, 2] = x, y, torque

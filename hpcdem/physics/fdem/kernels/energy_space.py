"""The passes of the energy budget in space, see energy.py. They only read."""

from __future__ import annotations

from numba import njit

from hpcdem.physics.fdem.kernels import joints_space
from hpcdem.physics.fdem.kernels.energy import BY_CONTACT, BY_JOINTS, GRAVITY, OUTSIDE, VISCOUS
from hpcdem.physics.fdem.kernels.joints import NONE
from hpcdem.physics.fdem.tetrahedra import FACES, ROW, STRIDE


@njit(cache=True, nogil=True, error_model="numpy")
def book(first, n_own, before, after, a, b, of_joints, damping, mass, gx, gy, gz, dt, work):
    """Add to work (n_own, 8) what joints, damping and gravity did on the owned elements.

    first: storage row of the first owned element; before, after (n, 16): velocities before and after the kick, taken
    with the weights a and b; of_joints, damping (n, 16) [N]; mass (n, 4): true masses [kg].
    """
    pull = (gx, gy, gz)
    for i in range(n_own):
        r = first + i
        joint = viscous = weight = 0.0
        for k in range(4):
            for m in range(3):
                q = STRIDE * k + m
                v = a * before[r, q] + b * after[r, q]
                joint += of_joints[r, q] * v
                viscous += damping[r, q] * v
                weight += mass[r, k] * pull[m] * v
        work[i, BY_JOINTS] += joint * dt
        work[i, VISCOUS] += viscous * dt
        work[i, GRAVITY] += weight * dt


@njit(cache=True, nogil=True, error_model="numpy")
def book_contact(rows, first, pushed, before, after, a, b, dt, work):
    """Add what contact did on the owned elements in the storage rows `rows`; pushed (k, 16) [N]."""
    for i in range(len(rows)):
        r = rows[i]
        done = 0.0
        for k in range(4):
            for m in range(3):
                q = STRIDE * k + m
                done += pushed[i, q] * (a * before[r, q] + b * after[r, q])
        work[r - first, BY_CONTACT] += done * dt


@njit(cache=True, nogil=True, error_model="numpy")
def book_nodes(begin, corner, felt, outside, before, after, a, b, dt, first, n_own, work):
    """Add what was done from outside on nodes whose lowest corner is owned: applied forces and conditions."""
    before, after = before.reshape(before.size), after.reshape(after.size)
    for i in range(len(begin) - 1):
        p = corner[begin[i]]
        r = p // ROW - first
        if r < 0 or r >= n_own:
            continue
        done = 0.0
        for m in range(3):
            done += (felt[i, 3 + m] + outside[i, m]) * (a * before[p + m] + b * after[p + m])
        work[r, OUTSIDE] += done * dt


@njit(cache=True, nogil=True, error_model="numpy")
def kinetic(first, n_own, before, after, mass, out):
    """Kinetic energy (n_own,) [J]: m v- . v+ / 2; mass (n, 4) as the motion sees it."""
    for i in range(n_own):
        r = first + i
        total = 0.0
        for k in range(4):
            for m in range(3):
                q = STRIDE * k + m
                total += mass[r, k] * before[r, q] * after[r, q]
        out[i] = 0.5 * total


@njit(cache=True, nogil=True, error_model="numpy")
def stored_in_joints(slots, face, link, sizes, kind, state, history, where, x, table, beyond, first, out):
    """Half of what each joint stores, added to the element of the slot: out (n_own,) [J]."""
    flat = x.reshape(x.size)
    for s in range(slots):
        if state[s] == NONE:
            continue
        r, k = where[face[s] // 4], face[s] % 4
        a, b, c = (ROW * r + STRIDE * FACES[k, 0], ROW * r + STRIDE * FACES[k, 1], ROW * r + STRIDE * FACES[k, 2])
        p, q, t = link[s, 0], link[s, 1], link[s, 2]
        nx, ny, nz, area, d0x, d0y, d0z, d1x, d1y, d1z, d2x, d2y, d2z = joints_space.opened(
            flat[a], flat[a + 1], flat[a + 2], flat[b], flat[b + 1], flat[b + 2], flat[c], flat[c + 1], flat[c + 2],
            flat[p], flat[p + 1], flat[p + 2], flat[q], flat[q + 1], flat[q + 2], flat[t], flat[t + 1], flat[t + 2],
        )  # fmt: skip
        h, law, more = 1.0 / sizes[s], table[kind[s]], beyond[kind[s]]
        mid = joints_space.mid_edges(flat, a, b, c, p, q, t)
        one = joints_space.stored(d0x, d0y, d0z, nx, ny, nz, h, mid, law, more, history[s], 0)
        two = joints_space.stored(d1x, d1y, d1z, nx, ny, nz, h, mid, law, more, history[s], 1)
        three = joints_space.stored(d2x, d2y, d2z, nx, ny, nz, h, mid, law, more, history[s], 2)
        out[r - first] += 0.5 * area / 3.0 * (one + (two + three))

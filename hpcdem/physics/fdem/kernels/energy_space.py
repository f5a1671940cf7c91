"""The passes of the energy budget in space, see energy.py. They only read."""

from __future__ import annotations

from numba import njit

from hpcdem.physics.fdem.kernels.energy import BY_CONTACT, BY_JOINTS, GRAVITY, OUTSIDE, VISCOUS
from hpcdem.physics.fdem.tetrahedra import ROW, STRIDE


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

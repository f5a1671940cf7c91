"""Leap-frog motion with local and lattice-solid damping (ZDEM manual ch. 8; Cundall 1987; Li 2021).

    F  = contact forces + m g - eta v          eta: SET damp lsm
    F += -alpha |F_k| sgn(v_k), k = x, y       alpha: PROP damp; likewise for the torque
    v(t + dt/2) = v(t - dt/2) + F/m dt,  x(t + dt) = x(t) + v(t + dt/2) dt

A fixed component keeps the velocity it has.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from hpcdem.fields import ANGLE, FIX, FIX_SPIN, FIX_X, FIX_Y, RADIUS, SPIN, VX, VY, X, Y
from hpcdem.physics.dem import laws

# What a check of the motion returns per block (float64), all to be reduced by maximum.
PATH2, SPEED2, STRIDE, BROKEN = range(4)


@njit(cache=True, nogil=True)
def _block(t, hot, cold, icold, n_left, cut, lo, foff, force, body, gx, gy, eta, dt):
    """Move the owned particles of block t by dt. body (n, 4) f8: mass [kg], inertia [kg m^2], alpha, spare."""
    shift = foff[t] - lo[t]
    for i in range(cut[t], cut[t + 1]):
        c = i - n_left
        m = body[c, 0]
        alpha = body[c, 2]
        fix = icold[c, FIX]
        r = shift + i
        if not fix & FIX_X:
            v = hot[i, VX]
            hot[i, VX] = v + laws.damped(force[r, 0] + m * gx - eta * v, v, alpha) / m * dt
        if not fix & FIX_Y:
            v = hot[i, VY]
            hot[i, VY] = v + laws.damped(force[r, 1] + m * gy - eta * v, v, alpha) / m * dt
        if not fix & FIX_SPIN:
            w = hot[i, SPIN]
            hot[i, SPIN] = w + laws.damped(force[r, 2], w, alpha) / body[c, 1] * dt
        hot[i, X] += hot[i, VX] * dt
        hot[i, Y] += hot[i, VY] * dt
        cold[c, ANGLE] += hot[i, SPIN] * dt


@njit(cache=True, nogil=True)
def move(n_blocks, *args):
    """All blocks, one after the other."""
    for t in range(n_blocks):
        _block(t, *args)


@njit(cache=True, parallel=True)
def move_threaded(n_blocks, hot, cold, icold, n_left, cut, lo, foff, force, body, gx, gy, eta, dt):
    """All blocks, one thread each."""
    for t in prange(n_blocks):
        _block(t, hot, cold, icold, n_left, cut, lo, foff, force, body, gx, gy, eta, dt)


@njit(cache=True, nogil=True)
def survey(hot, n_left, n_own, origin, dt, out):
    """Largest path since the list was built squared, speed squared, |v| dt / R, and 1 if a number is not finite.

    origin (n_own, 2) f8: positions when the list was built. out (4,) f8. All four are maxima, so their global
    value does not depend on how particles are shared out. A running maximum would drop NaN; it is asked for on its own.
    """
    path2 = 0.0
    speed2 = 0.0
    stride = 0.0
    broken = 0.0
    for c in range(n_own):
        i = n_left + c
        dx = hot[i, X] - origin[c, 0]
        dy = hot[i, Y] - origin[c, 1]
        d2 = dx * dx + dy * dy
        v2 = hot[i, VX] * hot[i, VX] + hot[i, VY] * hot[i, VY]
        if not (d2 < np.inf and v2 < np.inf and abs(hot[i, SPIN]) < np.inf):
            broken = 1.0
            continue
        path2 = max(path2, d2)
        speed2 = max(speed2, v2)
        stride = max(stride, math.sqrt(v2) * abs(dt) / hot[i, RADIUS])
    out[PATH2], out[SPEED2], out[STRIDE], out[BROKEN] = path2, speed2, stride, broken

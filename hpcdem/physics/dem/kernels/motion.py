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

from hpcdem.core.fields import ANGLE, FIX, FIX_SPIN, FIX_X, FIX_Y, MATERIAL, RADIUS, SPIN, VX, VY, X, Y
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.dem.kernels import laws

# Columns of the body table (n_own, 8) f8: mass [kg], inertia [kg m^2], local damping alpha, 1 for members of clumps
# (they are moved with their clump, rigid.py; their mass is only a share of its), and what turns a force into a change
# of velocity: dt / m for x and y, dt / I for the spin, zero where the component is fixed.
MASS, INERTIA, ALPHA, CLUMPED, KICK_X, KICK_Y, KICK_SPIN = range(7)

# What a check of the motion returns per block (float64), all to be reduced by maximum.
PATH2, SPEED2, STRIDE, BROKEN = range(4)


@njit(cache=True, nogil=True, error_model="numpy")
def _block(t, first, last, hot, cold, n_left, cut, lo, foff, force, body, gx, gy, eta, dt):
    """Move those of the owned particles first : last that belong to block t by dt."""
    shift = foff[t] - lo[t]
    for i in range(max(cut[t], n_left + first), min(cut[t + 1], n_left + last)):
        c = i - n_left
        r = shift + i
        m, alpha = body[c, MASS], body[c, ALPHA]
        vx, vy, w = hot[i, VX], hot[i, VY], hot[i, SPIN]
        vx += laws.damped(force[r, 0] + m * gx - eta * vx, vx, alpha) * body[c, KICK_X]
        vy += laws.damped(force[r, 1] + m * gy - eta * vy, vy, alpha) * body[c, KICK_Y]
        w += laws.damped(force[r, 2], w, alpha) * body[c, KICK_SPIN]
        hot[i, VX], hot[i, VY], hot[i, SPIN] = vx, vy, w
        hot[i, X] += vx * dt
        hot[i, Y] += vy * dt
        cold[c, ANGLE] += w * dt


@on_threads
def move(n_blocks, *args):
    """All blocks, see `_block`."""
    for t in prange(n_blocks):
        _block(t, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def fill_body(hot, ihot, icold, n_left, density, damp, shape, dt, body):
    """The body table of the owned particles; density, damp: per material; shape: mass.shape of the rule."""
    factor, cubed, gyration = shape
    for c in range(len(body)):
        i = n_left + c
        r, material, fix = hot[i, RADIUS], ihot[i, MATERIAL], icold[c, FIX]
        volume = factor * r * r
        if cubed:
            volume *= r
        m = density[material] * volume
        inertia = gyration * m * r * r
        body[c, MASS], body[c, INERTIA], body[c, ALPHA], body[c, CLUMPED] = m, inertia, damp[material], 0.0
        body[c, KICK_X] = 0.0 if fix & FIX_X else dt / m
        body[c, KICK_Y] = 0.0 if fix & FIX_Y else dt / m
        body[c, KICK_SPIN] = 0.0 if fix & FIX_SPIN else dt / inertia


@njit(cache=True, nogil=True, error_model="numpy")
def _survey(hot, n_left, first, end, origin, dt, out):
    """Add the owned particles first : end to what `survey` has found."""
    path2, speed2, stride, broken = out[PATH2], out[SPEED2], out[STRIDE], out[BROKEN]
    for c in range(first, end):
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


@njit(cache=True, nogil=True, error_model="numpy")
def survey(hot, n_left, n_own, origin, dt, without, out):
    """Largest path since the list was built squared, speed squared, |v| dt / R, and 1 if a number is not finite; of all
    but the owned particles `without` (m,) i8, ascending.

    origin (n_own, 2) f8: positions when the list was built. out (4,) f8. All four are maxima, so their global value
    does not depend on how particles are shared out. A running maximum would drop NaN, so NaN is tested separately.
    """
    out[PATH2], out[SPEED2], out[STRIDE], out[BROKEN] = 0.0, 0.0, 0.0, 0.0
    first = 0
    for c in without:
        _survey(hot, n_left, first, c, origin, dt, out)
        first = c + 1
    _survey(hot, n_left, first, n_own, origin, dt, out)

"""The contact and bond laws: scalars in, scalars out, one formula each.

Signs: overlap U = Ra + Rb - d > 0 in compression; normal force Fn > 0 in compression, < 0 in tension.
The shear force Fs is one scalar along the current tangent t = (-n_y, n_x), n from a to b; it is the same number
whichever particle is called a, so a pair's history survives a change of order.

Sources: Cundall & Strack 1979 (linear springs, Coulomb slip), Mindlin & Deresiewicz through Cundall 1988
(Hertz-Mindlin), Morgan 2015 (elastic bond with tensile strength and cohesion), Itasca PFC (contact bond).
"""

from __future__ import annotations

import math

from numba import njit

LINEAR, HERTZ = 0, 1
ELASTIC_BOND, CONTACT_BOND = 1, 2  # 0: no bond
HOLDS, BREAKS_IN_TENSION, BREAKS_IN_SHEAR = 0, 1, 2


@njit(cache=True, error_model="numpy")
def series_stiffness(ka, kb):
    """Two springs in series [N/m]: ka kb / (ka + kb); zero if either is zero."""
    if ka <= 0.0 or kb <= 0.0:
        return 0.0
    return ka * kb / (ka + kb)


@njit(cache=True, error_model="numpy", forceinline=True)
def pair_geometry(dx, dy, ri, rj):
    """Return the geometry of a pair of discs, the centre of the second at (dx, dy) from that of the first: (distance
    squared [m^2], n_x, n_y, overlap U [m], 2 Rt [m]).

    The normal is +x if both centres are in one place (rows from one corner).
    """
    d2 = dx * dx + dy * dy
    d = math.sqrt(d2)
    inverse = 1.0 / d
    nx = dx * inverse if d != 0.0 else 1.0
    ny = dy * inverse if d != 0.0 else 0.0
    reach = ri + rj
    return d2, nx, ny, reach - d, 4.0 * ri * rj / reach


@njit(cache=True, error_model="numpy")
def sliding_speed(nx, ny, dvx, dvy, wi, wj, arm_i, arm_j):
    """Speed [m/s] at which the shear spring of a pair is strained: (dv . t) - w_i arm_i - w_j arm_j."""
    return nx * dvy - ny * dvx - wi * arm_i - wj * arm_j


@njit(cache=True, error_model="numpy")
def hertz_normal_factor(g, nu):
    """Factor A of Fn = A sqrt(2 Rt U) U [Pa]: A = 2 G / (3 (1 - nu)), mean moduli of the pair."""
    return 2.0 * g / (3.0 * (1.0 - nu))


@njit(cache=True, error_model="numpy")
def mindlin_shear_factor(g, nu):
    """Factor B of the tangent shear stiffness ks = B sqrt(2 Rt U) [Pa]: B = 2 G / (2 - nu).

    The usual form ks = 2 (3 G^2 (1-nu) Rt Fn)^(1/3) / (2 - nu) with Fn = A sqrt(2 Rt U) U reduces to this one,
    because 3 G^2 (1-nu) Rt A sqrt(2 Rt) = G^3 (2 Rt)^(3/2): no cube root is needed.
    """
    return 2.0 * g / (2.0 - nu)


@njit(cache=True, error_model="numpy")
def contact(model, a, b, two_rt, u):
    """Normal force Fn [N] and shear stiffness ks [N/m] of a touching pair (u >= 0).

    LINEAR: a, b are the pair's normal and shear stiffness. HERTZ: a, b are the two factors above and
    two_rt = 2 Rt = 4 Ra Rb / (Ra + Rb) (2 R at a wall) [m].
    """
    if model == HERTZ:
        s = math.sqrt(two_rt * u)
        return a * s * u, b * s
    return a * u, b


@njit(cache=True, error_model="numpy")
def tangent_normal_stiffness(model, a, two_rt, u):
    """dFn/dU [N/m] at overlap u: 1.5 A sqrt(2 Rt U), or the spring itself."""
    if model == HERTZ:
        return 1.5 * a * math.sqrt(two_rt * u)
    return a


@njit(cache=True, error_model="numpy")
def normal_energy(model, fn, u):
    """Elastic energy [J] of a normal force fn at overlap u: the integral of Fn dU from 0.

    2/5 Fn U for Fn ~ U^(3/2) (HERTZ), Fn U / 2 for a spring; open bonds are springs, whatever the contact.
    """
    return 0.4 * fn * u if model == HERTZ else 0.5 * fn * u


@njit(cache=True, error_model="numpy")
def shear_energy(fs, ks):
    """Elastic energy [J] of a shear force in a spring of the present stiffness: Fs^2 / (2 ks); 0 without stiffness."""
    return 0.5 * fs * fs / ks if ks > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def coulomb(fs, limit):
    """Shear force cut to |Fs| <= limit. Adding 0.0 turns -0.0 into 0.0, so that an empty history is all zero bits."""
    if fs > limit:
        fs = limit
    elif fs < -limit:
        fs = -limit
    return fs + 0.0


@njit(cache=True, error_model="numpy")
def bond_area(two_rt, spheres):
    """Cross-section of a bond [m^2]: pi Rt^2 between spheres, 2 Rt x 1 m between disks."""
    if spheres:
        return math.pi * 0.25 * two_rt * two_rt
    return two_rt


@njit(cache=True, error_model="numpy")
def elastic_bond(e, g, area, length, u):
    """Open elastic bond (u < 0): Fn = E A/L U (tension), ks = G A/L. No moment is carried."""
    return e * area / length * u, g * area / length


@njit(cache=True, error_model="numpy")
def contact_bond(model, a, b, two_rt, u_made, u):
    """Open contact bond (u < 0): the contact's own springs also act in tension.

    For Hertz contacts the tangent stiffnesses at the overlap `u_made` [m] of the moment of bonding are used.
    """
    if model == HERTZ:
        s = math.sqrt(two_rt * u_made)
        return 1.5 * a * s * u, b * s
    return a * u, b


@njit(cache=True, error_model="numpy", forceinline=True)
def contact_state(model, a, b, two_rt, u):
    """Return the state of a touching pair (u >= 0) or wall contact: (Fn [N], shear stiffness ks, dFn/dU [N/m], energy
    of Fn [J])."""
    fn, ks = contact(model, a, b, two_rt, u)
    return fn, ks, tangent_normal_stiffness(model, a, two_rt, u), normal_energy(model, fn, u)


@njit(cache=True, error_model="numpy", forceinline=True)
def pair_state(kind, model, a, b, e, g, two_rt, length, spheres, u_made, u):
    """Return the state of any pair at overlap u: of its contact if it touches, else of its bond, zeros if there is
    neither.

    kind: of the bond, 0: none; model, a, b: see `contact`; e, g, length (Ra + Rb) and spheres: see `elastic_bond` and
    `bond_area`; u_made: see `contact_bond`. g below 0: of a conserving bond, which has its own shear stiffness where
    the pair touches too. Everything that asks for the state of a pair asks here.
    """
    if kind == CONTACT_BOND:
        tension, shear = contact_bond(model, a, b, two_rt, u_made, u)
        stiffness = tangent_normal_stiffness(model, a, two_rt, u_made)
    else:
        area = bond_area(two_rt, spheres)
        tension, shear = elastic_bond(e, abs(g), area, length, u)
        stiffness = e * area / length
    if u >= 0.0:
        fn, ks, kn, energy = contact_state(model, a, b, two_rt, u)
        return fn, shear if g < 0.0 else ks, kn, energy
    if kind == 0:
        return 0.0, 0.0, 0.0, 0.0
    return tension, shear, stiffness, normal_energy(LINEAR, tension, u)


@njit(cache=True, error_model="numpy")
def bond_failure(kind, fn, fs, tensile, shear, mu, area):
    """HOLDS, BREAKS_IN_TENSION or BREAKS_IN_SHEAR.

    ELASTIC_BOND: tensile and shear are strengths [Pa], the shear limit is C A + mu max(Fn, 0).
    CONTACT_BOND: they are forces [N] and the shear limit is S alone.
    """
    if kind == ELASTIC_BOND:
        tensile = tensile * area
        shear = shear * area + mu * max(fn, 0.0)
    if fn < 0.0 and -fn > tensile:
        return BREAKS_IN_TENSION
    if abs(fs) > shear:
        return BREAKS_IN_SHEAR
    return HOLDS


@njit(cache=True, error_model="numpy")
def damped(force, velocity, alpha):
    """Local damping (Cundall): F - alpha |F| sgn(v), sgn(0) = +1."""
    if velocity < 0.0:
        return force + alpha * abs(force)
    return force - alpha * abs(force)

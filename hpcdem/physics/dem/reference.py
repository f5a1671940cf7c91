"""Plain form of pair_forces.py, walls.py and motion.py: one pair, wall contact or particle at a time, without lanes,
blocks and threads. Read it beside them; tests compare both."""

from __future__ import annotations

import numpy as np

from hpcdem.core.fields import RADIUS, SPIN, VX, VY, X, Y
from hpcdem.physics.dem.kernels import laws
from hpcdem.physics.dem.kernels.contacts import E_MOD, G_MOD, KIND, SHEAR, TENSILE
from hpcdem.physics.dem.kernels.walls import END1, END2, FACE, NONE, ONE_SIDED, P1X, P2X, P2Y, WVX, WVY


def pair_forces(
    hot: np.ndarray, material: np.ndarray, pairs: np.ndarray, fs: np.ndarray, bond: np.ndarray, u_made: np.ndarray,
    pair_laws: np.ndarray, bond_laws: np.ndarray, spheres: bool, dt: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[int]]:  # fmt: skip
    """Contacts and bonds: forces (n, 3) [N, N, N m] on all particles, shear forces (m,) [N] and bond types (m,) of all
    pairs after the step, and how many bonds broke [in tension, in shear].

    hot (n, 8), material (n,): particles; pairs (m, 2): their rows; u_made (m,) [m]: overlap at bonding; pair_laws
    (materials, materials, 4), bond_laws (types, 5): contacts.py.
    """
    x, v, spin, radius = hot[:, [X, Y]], hot[:, [VX, VY]], hot[:, SPIN], hot[:, RADIUS]
    force, fs, bond, broken = np.zeros((len(hot), 3)), fs.copy(), bond.copy(), [0, 0]
    for k, (i, j) in enumerate(pairs):
        length, d = radius[i] + radius[j], float(np.linalg.norm(x[j] - x[i]))
        u, two_rt = length - d, 4.0 * radius[i] * radius[j] / length
        if u < 0.0 and bond[k] == 0:
            fs[k] = 0.0
            continue
        n = (x[j] - x[i]) / d
        t = np.array([-n[1], n[0]])
        arm_i, arm_j = radius[i] - 0.5 * u, radius[j] - 0.5 * u
        slide = (v[j] - v[i]) @ t - spin[i] * arm_i - spin[j] * arm_j
        model, a, b, mu = pair_laws[material[i], material[j]]
        law = bond_laws[bond[k]]
        fn, ks, _, _ = laws.pair_state(
            law[KIND], model, a, b, law[E_MOD], law[G_MOD], two_rt, length, spheres, u_made[k], u
        )
        fs[k] += ks * slide * dt
        if bond[k] != 0:
            area = laws.bond_area(two_rt, spheres)
            failure = laws.bond_failure(law[KIND], fn, fs[k], law[TENSILE], law[SHEAR], mu, area)
            if failure != laws.HOLDS:
                broken[failure - laws.BREAKS_IN_TENSION] += 1
                bond[k], fn = 0, max(fn, 0.0)
        if bond[k] == 0:
            fs[k] = np.clip(fs[k], -mu * fn, mu * fn)
        f = fs[k] * t - fn * n
        force[i] += *f, fs[k] * arm_i
        force[j] += *-f, fs[k] * arm_j
    return force, fs, bond, broken


def wall_contact(
    wall: np.ndarray, x: np.ndarray, r: float, side: float
) -> tuple[int, np.ndarray, float, float, np.ndarray]:
    """Locate the contact of a disc and a wall: part (NONE, FACE, END1, END2), normal (2,) to it, overlap [m], side (0,
    +1 left, -1 right; as given: the one stored), nearest point (2,) [m]."""
    p1, p2 = wall[P1X : P1X + 2], wall[P2X : P2Y + 1]
    length = float(np.linalg.norm(p2 - p1))
    e = (p2 - p1) / length
    left = np.array([-e[1], e[0]])
    along, h = (x - p1) @ e, (x - p1) @ left
    if 0.0 < along < length:
        q = p1 + along * e
        if abs(h) >= r and (wall[ONE_SIDED] or side == 0.0):
            return NONE, np.zeros(2), 0.0, 0.0, q
        side = 1.0 if wall[ONE_SIDED] else (side or (1.0 if h >= 0.0 else -1.0))
        if side * h > r:
            return NONE, np.zeros(2), 0.0, 0.0, q
        return FACE, -side * left, r - side * h, side, q
    where, q = (END1, p1) if along <= 0.0 else (END2, p2)
    d = float(np.linalg.norm(q - x))
    if d >= r or d == 0.0:
        return NONE, np.zeros(2), 0.0, 0.0, q
    return where, (q - x) / d, r - d, 0.0, q


def wall_forces(
    hot: np.ndarray, material: np.ndarray, walls: np.ndarray, slots: np.ndarray, fs: np.ndarray, side: np.ndarray,
    wall_laws: np.ndarray, dt: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Contacts with walls: forces (n, 3) [N, N, N m], and shear forces (m,) [N] and sides (m,) of all slots after the
    step. walls (w, 7): walls.py; slots (m, 2): row of the particle, of the wall; wall_laws (w, materials, 4)."""
    force, fs, new_side = np.zeros((len(hot), 3)), fs.copy(), np.zeros(len(slots))
    continues = np.full(len(slots), -1)  # the slot of another wall that the disc meets and that continues from this end
    for k, (i, w) in enumerate(slots):
        x, r = hot[i, [X, Y]], hot[i, RADIUS]
        q, p1, e = wall_contact(walls[w], x, r, side[k])[-1], walls[w, P1X : P1X + 2], walls[w, P2X : P2Y + 1]
        if not (np.array_equal(q, p1) or np.array_equal(q, e)):
            continue
        faces: list[int] = []
        ends: list[int] = []
        for m in np.flatnonzero((slots[:, 0] == i) & (np.arange(len(slots)) != k)):
            other, _, _, _, point = wall_contact(walls[slots[m, 1]], x, r, side[m])
            if other == FACE:
                point = wall_contact(walls[slots[m, 1]], q, r, 0.0)[-1]
            if other != NONE and np.abs(point - q).max() <= 1e-9 * r and (other == FACE or m < k):
                (faces if other == FACE else ends).append(m)
        continues[k] = [*faces, *ends, -1][0]
    for k in np.flatnonzero((continues >= 0) & (fs != 0.0)):
        fs[continues[k]] += fs[k]
        fs[k] = 0.0
    for k, (i, w) in enumerate(slots):
        x, r = hot[i, [X, Y]], hot[i, RADIUS]
        where, n, u, new_side[k], q = wall_contact(walls[w], x, r, side[k])
        if where in (END1, END2) and continues[k] >= 0:
            where = NONE
        if where == NONE:
            fs[k] = new_side[k] = 0.0
            continue
        t, arm = np.array([-n[1], n[0]]), r - 0.5 * u
        model, a, b, mu = wall_laws[w, material[i]]
        fn, ks, _, _ = laws.contact_state(model, a, b, 2.0 * r, u)
        slide = (walls[w, [WVX, WVY]] - hot[i, [VX, VY]]) @ t - hot[i, SPIN] * arm
        fs[k] = np.clip(fs[k] + ks * slide * dt, -mu * fn, mu * fn)
        force[i] += *(fs[k] * t - fn * n), fs[k] * arm
    return force, fs, new_side


def move(
    place: np.ndarray, velocity: np.ndarray, force: np.ndarray, inertia: np.ndarray, fixed: np.ndarray,
    alpha: np.ndarray, gravity: tuple[float, float], eta: float, dt: float,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Places and velocities (n, 3) after the step: x, y, angle [m, m, rad].

    force (n, 3) [N, N, N m]: of contacts; inertia (n, 3): m, m, I; fixed (n, 3) bool; alpha (n,): local damping; eta
    [kg/s]: lattice-solid damping.
    """
    force = force + inertia * (*gravity, 0.0) - velocity * (eta, eta, 0.0)
    force -= alpha[:, None] * np.abs(force) * np.where(velocity < 0.0, -1.0, 1.0)
    velocity = np.where(fixed, velocity, velocity + force / inertia * dt)
    return place + velocity * dt, velocity

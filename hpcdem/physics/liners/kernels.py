"""Arithmetic of liners that does not depend on what their elements are: the bond to the rock, the motion of the nodes.

Elements (m,) have k nodes each, ends (m, k), and point k e + j is where the part of element e at its end j is bound to
the rock: on a corner of the host. There frame (k m, d, d) has the unit vector across the rock, away from it, and those
along it. Nodes have d components of translation and one or three of rotation; in the plane forces, moments and masses
are per metre of thickness. Pressure of the bond is positive.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels import laws

# Columns of the table of conditions (n, 18), of component c of x, y, z and the rotations about x, y, z: what it does is
# DOES + 2 c, at which value AT + 2 c, the force or moment on the node FORCE + c.
DOES, AT, FORCE = 0, 1, 12
# Bits of the state of an element, and of the bond at a point.
IN_TENSION, IN_COMPRESSION, BENDS, HAS_YIELDED, REMOVED = 1, 2, 4, 8, 32
SLIPS, SLIPPED, PARTED, OPEN = 1, 2, 4, 8
# Columns of the table of points (k m, 5): stiffness across and along, tensile strength, cohesion [N], tan(friction).
ACROSS, ALONG, BOND_TENSION, COHESION, FRICTION = range(5)
# Columns of the table of beams (m, 5): E A / L0, E I / L0; forces and moment at which they yield.
AXIAL, BENDING, TENSION, COMPRESSION, PLASTIC_MOMENT = range(5)
# Columns of the table of nodes (n, 5): mass, rotational inertia, weight along x, y and z [N].
MASS, INERTIA, WEIGHT = range(3)
# Work (5,) [J]: on the rock; lost in elements and in the bond; by conditions; by gravity.
ON_ROCK, IN_BEAMS, IN_BOND, BY_CONDITIONS, BY_GRAVITY = range(5)
WORK = 5
SMOOTH = 22.5
"""Elements that lean from the mean of those at a node by this angle [degrees] or more make a corner there."""
COS_SMOOTH = math.cos(math.radians(SMOOTH))


@njit(cache=True, nogil=True, error_model="numpy")
def largest_moment(force, tension, compression, plastic):
    """Return the largest moment at a force across the section: M = 4 Mp (Nt - N) (N + Nc) / (Nt + Nc)^2, of a rectangle
    the exact limit."""
    if math.isinf(tension):
        return math.inf
    both = tension + compression
    return max(0.0, 4.0 * plastic * (tension - force) * (force + compression) / (both * both))


@njit(cache=True, nogil=True, error_model="numpy")
def apart(one, other, direction):
    """(one - other) . way, of vectors (d,)."""
    found = 0.0
    for c in range(len(direction)):
        found += (one[c] - other[c]) * direction[c]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def bond(ends, frame, state, bound, points, step, rock, gap, slip, pressure, shear, bond_state, work):
    """New pressures (k m,) and shear forces (k m, d - 1) [N] of the bond, from the ways of the nodes and of the rock.

    p = -K_n gap, 0 where a parted one is open; it parts where p < -T. f -= K_s ds, |f| <= C + p tan(phi), without C
    where it has parted. On the liner act p away from the rock and f along it; slip: plastic part of s [m].
    """
    corners, along = ends.shape[1], shear.shape[1]
    slid, trial = np.zeros(along), np.zeros(along)
    for q in range(len(gap)):
        e = q // corners
        bond_state[q] &= ~(SLIPS | OPEN)
        if not bound[q] or state[e] & REMOVED:
            continue
        i = ends[e, q % corners]
        open_by = apart(step[i], rock[q], frame[q, 0])
        k, p = points[q, ACROSS], pressure[q]
        gap[q] += open_by
        new = -k * gap[q]
        if not bond_state[q] & PARTED and new < -points[q, BOND_TENSION]:
            bond_state[q] |= PARTED
        if bond_state[q] & PARTED and new < 0.0:
            new = 0.0
            bond_state[q] |= OPEN
        work[IN_BOND] -= 0.5 * (p + new) * open_by + 0.5 * (new * new - p * p) / k
        pressure[q] = new
        k = points[q, ALONG]
        if k == 0.0:
            continue
        most = max(0.0, (0.0 if bond_state[q] & PARTED else points[q, COHESION]) + new * points[q, FRICTION])
        for a in range(along):
            slid[a] = apart(step[i], rock[q], frame[q, 1 + a])
            trial[a] = shear[q, a] - k * slid[a]
        size = abs(trial[0]) if along == 1 else math.sqrt(trial[0] * trial[0] + trial[1] * trial[1])
        slips = size > most
        if slips:
            bond_state[q] |= SLIPS | SLIPPED
        for a in range(along):
            held, f = trial[a], shear[q, a]
            if slips:
                held = math.copysign(most, trial[a]) if along == 1 else trial[a] * (most / size)
                slip[q, a] += (held - trial[a]) / k
            work[IN_BOND] -= 0.5 * (f + held) * slid[a] + 0.5 * (held * held - f * f) / k
            shear[q, a] = held


@njit(cache=True, nogil=True, error_model="numpy")
def given(conditions, nodes, parts, dim, total, on_rock):
    """Compute the forces of conditions and gravity, total (n, len(parts)); nothing on the rock, on_rock (k m, d)
    [N]."""
    for i in range(len(total)):
        for c in range(len(parts)):
            total[i, c] = conditions[i, FORCE + parts[c]]
        for c in range(dim):
            total[i, c] += nodes[i, WEIGHT + c]
    on_rock[:] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def hold(q, i, frame, pressure, shear, total, on_rock):
    """Add what the bond at point q does on node i, and the opposite on the rock."""
    for c in range(frame.shape[1]):
        f = pressure[q] * frame[q, 0, c]
        for a in range(shear.shape[1]):
            f += shear[q, a] * frame[q, 1 + a, c]
        total[i, c] += f
        on_rock[q, c] = -f


@njit(cache=True, nogil=True, error_model="numpy")
def move(x, v, spin, parts, total, conditions, nodes, dt, alpha, reaction, step, work):
    """Move the nodes over a step dt with the forces and moments on them, and give them new rates of rotation; parts:
    components of the conditions present; alpha: local damping. Fills step (n, d), the displacement of each, and
    reaction (n, len(parts)), what conditions had to add."""
    dim = x.shape[1]
    for i in range(len(x)):
        if nodes[i, MASS] == 0.0:
            step[i] = 0.0
            continue
        by_gravity = 0.0
        for c in range(len(parts)):
            does, at, force = DOES + 2 * parts[c], AT + 2 * parts[c], FORCE + parts[c]
            inert, old = nodes[i, MASS if c < dim else INERTIA], v[i, c] if c < dim else spin[i, c - dim]
            new = old + dt / inert * laws.damped(total[i, c], old, alpha)
            reaction[i, c] = 0.0
            if conditions[i, does] != 0.0:
                new = conditions[i, at]
                reaction[i, c] = inert * (new - old) / dt - total[i, c]
            mean = 0.5 * dt * (old + new)
            work[BY_CONDITIONS] += (reaction[i, c] + conditions[i, force]) * mean
            if c < dim:
                by_gravity += nodes[i, WEIGHT + c] * mean
                step[i, c], v[i, c] = new * dt, new
                x[i, c] += new * dt
            else:
                spin[i, c - dim] = new
        work[BY_GRAVITY] += by_gravity


@njit(cache=True, nogil=True, error_model="numpy")
def host_points(point, row, corner, x, stride, seen):
    """Return where the rock is at points (k,) whose host is held here: corner of storage row of x, of which one begins
    every `stride` words; fills seen (all points, d)."""
    for m in range(len(point)):
        q = point[m]
        for c in range(seen.shape[1]):
            seen[q, c] = x[row[m], stride * corner[q] + c]


@njit(cache=True, nogil=True, error_model="numpy")
def add(point, row, corner, on_rock, stride, applied):
    """Add forces of points (k,) on the rock to the corners of their hosts, applied (rows, 4 stride) [N]."""
    for m in range(len(point)):
        q = point[m]
        for c in range(on_rock.shape[1]):
            applied[row[m], stride * corner[q] + c] += on_rock[q, c]


# ---- beams, the elements in the plane: the rock is to the left on the way from the first node to the last ------------


@njit(cache=True, nogil=True, error_model="numpy")
def shape(ax, ay, bx, by, turn_a, turn_b, angle):
    """Length [m], unit vector, and the rotations of both ends against the chord of a beam that was installed at this
    angle, within half a turn."""
    ux, uy = bx - ax, by - ay
    length = math.sqrt(ux * ux + uy * uy)
    chord = math.atan2(uy, ux) - angle
    first, second = turn_a - chord, turn_b - chord
    first -= 2.0 * math.pi * math.floor(first / (2.0 * math.pi) + 0.5)
    second -= 2.0 * math.pi * math.floor(second / (2.0 * math.pi) + 0.5)
    return length, ux / length, uy / length, first, second


@njit(cache=True, nogil=True, error_model="numpy")
def frames(ends, along, state, mean, frame):
    """Unit vectors across and along the rock at points, frame (2 m, 2, 2): along the mean of both beams at a node, or
    else a liner could not slide along a polygon; where it has a corner, more than SMOOTH from the mean, along the beam
    itself."""
    mean[:] = 0.0
    for e in range(len(ends)):
        if not state[e] & REMOVED:
            for k in range(2):
                mean[ends[e, k], 0] += along[e, 0]
                mean[ends[e, k], 1] += along[e, 1]
    for e in range(len(ends)):
        for k in range(2):
            i, q = ends[e, k], 2 * e + k
            size = math.sqrt(mean[i, 0] * mean[i, 0] + mean[i, 1] * mean[i, 1])
            tx, ty = along[e, 0], along[e, 1]
            if size > 0.0 and (mean[i, 0] * along[e, 0] + mean[i, 1] * along[e, 1]) > COS_SMOOTH * size:
                tx, ty = mean[i, 0] / size, mean[i, 1] / size
            frame[q, 0, 0], frame[q, 0, 1] = ty, -tx
            frame[q, 1, 0], frame[q, 1, 1] = tx, ty


@njit(cache=True, nogil=True, error_model="numpy")
def hinges(first, second, most, k):
    """Moments of both ends within `most`, and the plastic rotations (of k = E I / L) that bring them there."""
    turn_a = turn_b = 0.0
    a, b = first, second
    for _ in range(2):
        if (abs(a) > most and abs(b) > most) or (turn_a != 0.0 and abs(b) > most) or (turn_b != 0.0 and abs(a) > most):
            to_a, to_b = math.copysign(most, a), math.copysign(most, b)
            over_a, over_b = first - to_a, second - to_b
            turn_a, turn_b = (2.0 * over_a - over_b) / (6.0 * k), (2.0 * over_b - over_a) / (6.0 * k)
            a, b = to_a, to_b
        elif abs(a) > most:
            turn_a = (a - math.copysign(most, a)) / (4.0 * k)
            a, b = math.copysign(most, a), second - 2.0 * k * turn_a
        elif abs(b) > most:
            turn_b = (b - math.copysign(most, b)) / (4.0 * k)
            b, a = math.copysign(most, b), first - 2.0 * k * turn_b
    return a, b, turn_a, turn_b


@njit(cache=True, nogil=True, error_model="numpy")
def bend(ends, x, turn, elements, angle, along, form, force, plastic, state, work):
    """New axial forces and end moments, force (m, 3), from the new positions and rotations.

    form (m, 3): length and rotations of the ends against the chord, before and then now. N += E A / L0 dL, held between
    the yield forces; M of both ends += E I / L0 (4 2; 2 4) of the rotations, held below the moment at this force.
    """
    for e in range(len(ends)):
        a, b = ends[e, 0], ends[e, 1]
        if state[e] & REMOVED:
            continue
        length, tx, ty, first, second = shape(x[a, 0], x[a, 1], x[b, 0], x[b, 1], turn[a], turn[b], angle[e])
        along[e, 0], along[e, 1] = tx, ty
        k, bending = elements[e, AXIAL], elements[e, BENDING]
        du, da, db = length - form[e, 0], first - form[e, 1], second - form[e, 2]
        da -= 2.0 * math.pi * math.floor(da / (2.0 * math.pi) + 0.5)
        db -= 2.0 * math.pi * math.floor(db / (2.0 * math.pi) + 0.5)
        form[e, 0], form[e, 1], form[e, 2] = length, first, second
        n, ma, mb = force[e, 0], force[e, 1], force[e, 2]
        trial = n + k * du
        new = min(max(trial, -elements[e, COMPRESSION]), elements[e, TENSION])
        state[e] &= ~(IN_TENSION | IN_COMPRESSION | BENDS)
        if trial > new:
            state[e] |= IN_TENSION | HAS_YIELDED
        elif trial < new:
            state[e] |= IN_COMPRESSION | HAS_YIELDED
        most = largest_moment(new, elements[e, TENSION], elements[e, COMPRESSION], elements[e, PLASTIC_MOMENT])
        try_a, try_b = ma + bending * (4.0 * da + 2.0 * db), mb + bending * (2.0 * da + 4.0 * db)
        new_a, new_b, pa, pb = hinges(try_a, try_b, most, bending)
        if pa != 0.0 or pb != 0.0:
            state[e] |= BENDS | HAS_YIELDED
        stretched = (trial - new) / k
        plastic[e, 0] += stretched
        plastic[e, 1] += pa
        plastic[e, 2] += pb
        force[e, 0], force[e, 1], force[e, 2] = new, new_a, new_b
        work[IN_BEAMS] += 0.5 * ((n + new) * stretched + (ma + new_a) * pa + (mb + new_b) * pb)


@njit(cache=True, nogil=True, error_model="numpy")
def push(ends, along, frame, form, force, state, pressure, shear, total, on_rock):
    """Add forces and moments of beams and bond on nodes, total (n, 3), and of points on the rock, on_rock (2 m, 2)."""
    for e in range(len(ends)):
        if state[e] & REMOVED:
            continue
        a, b = ends[e, 0], ends[e, 1]
        tx, ty = along[e, 0], along[e, 1]
        across = (force[e, 1] + force[e, 2]) / form[e, 0]
        fx, fy = force[e, 0] * tx + across * ty, force[e, 0] * ty - across * tx
        total[a, 0] += fx
        total[a, 1] += fy
        total[a, 2] -= force[e, 1]
        total[b, 0] -= fx
        total[b, 1] -= fy
        total[b, 2] -= force[e, 2]
        for k in range(2):
            hold(2 * e + k, ends[e, k], frame, pressure, shear, total, on_rock)

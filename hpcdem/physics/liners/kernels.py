"""Arithmetic of liners: beams that may turn by any angle, their bond to the rock, and the motion of their nodes.

Element e of (m,) is a beam from node ends[e, 0] to ends[e, 1], the rock to its left. Point 2 e + k of (2 m,) is where
half of it is bound to the rock: its end k on a corner of the host. Forces, moments and masses are per metre of
thickness. Angles and moments count counter-clockwise; pressure of the bond is positive.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels import laws

# Columns of the table of conditions (n, 9): what x, y and the rotation do, at which value; forces and moment.
DOES_X, AT_X, DOES_Y, AT_Y, DOES_TURN, AT_TURN, FORCE_X, FORCE_Y, MOMENT = range(9)
# Bits of the state of an element, and of the bond at a point.
IN_TENSION, IN_COMPRESSION, BENDS, HAS_YIELDED, REMOVED = 1, 2, 4, 8, 32
SLIPS, SLIPPED, PARTED, OPEN = 1, 2, 4, 8
# Columns of the table of elements (m, 5): E A / L0, E I / L0; forces and moment at which they yield.
AXIAL, BENDING, TENSION, COMPRESSION, PLASTIC_MOMENT = range(5)
# Columns of the table of points (2 m, 5): stiffness across and along, tensile strength, cohesion [N/m], tan(friction).
ACROSS, ALONG, BOND_TENSION, COHESION, FRICTION = range(5)
# Columns of the table of nodes (n, 4): mass, rotational inertia, weight along x and y [N/m].
MASS, INERTIA, WEIGHT_X, WEIGHT_Y = range(4)
# Work (5,) [J/m]: on the rock; lost in beams and in the bond; by conditions; by gravity.
ON_ROCK, IN_BEAMS, IN_BOND, BY_CONDITIONS, BY_GRAVITY = range(5)
WORK = 5
SMOOTH = 22.5
"""Beams that meet at twice this angle [degrees] or more make a corner."""
COS_SMOOTH = math.cos(math.radians(SMOOTH))


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
def tangents(ends, along, state, mean, tangent):
    """Unit vectors along the rock at points, tangent (2 m, 2): the mean of both beams at a node, or else a liner could
    not slide along a polygon; where it has a corner, more than SMOOTH from the mean, that of the beam itself."""
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
            tangent[q, 0], tangent[q, 1] = along[e, 0], along[e, 1]
            if size > 0.0 and (mean[i, 0] * along[e, 0] + mean[i, 1] * along[e, 1]) > COS_SMOOTH * size:
                tangent[q, 0], tangent[q, 1] = mean[i, 0] / size, mean[i, 1] / size


@njit(cache=True, nogil=True, error_model="numpy")
def largest_moment(force, tension, compression, plastic):
    """At an axial force: M = 4 Mp (Nt - N) (N + Nc) / (Nt + Nc)^2, of a rectangle the exact plastic limit."""
    if math.isinf(tension):
        return math.inf
    both = tension + compression
    return max(0.0, 4.0 * plastic * (tension - force) * (force + compression) / (both * both))


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
def bond(ends, tangent, state, bound, points, step, rock, gap, slip, pressure, shear, bond_state, work):
    """New pressures and shear forces (2 m,) [N/m] of the bond, from the ways of the nodes and of the rock.

    p = -K_n gap, 0 where a parted one is open; it parts where p < -T. f -= K_s ds, |f| <= C + p tan(phi), without C
    where it has parted. On the liner act p away from the rock and f along it; slip: plastic part of s [m].
    """
    for q in range(len(gap)):
        e = q // 2
        bond_state[q] &= ~(SLIPS | OPEN)
        if not bound[q] or state[e] & REMOVED:
            continue
        i, tx, ty = ends[e, q % 2], tangent[q, 0], tangent[q, 1]
        dx, dy = step[i, 0] - rock[q, 0], step[i, 1] - rock[q, 1]
        open_by, slid = dx * ty - dy * tx, dx * tx + dy * ty
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
        k, f = points[q, ALONG], shear[q]
        if k == 0.0:
            continue
        most = max(0.0, (0.0 if bond_state[q] & PARTED else points[q, COHESION]) + new * points[q, FRICTION])
        trial = f - k * slid
        held = min(max(trial, -most), most)
        if held != trial:
            bond_state[q] |= SLIPS | SLIPPED
            slip[q] += (held - trial) / k
        work[IN_BOND] -= 0.5 * (f + held) * slid + 0.5 * (held * held - f * f) / k
        shear[q] = held


@njit(cache=True, nogil=True, error_model="numpy")
def node_forces(ends, along, tangent, form, force, state, pressure, shear, nodes, conditions, total, on_rock):
    """Forces and moments on nodes, total (n, 3), and of points on the rock, on_rock (2 m, 2) [N/m]."""
    for i in range(len(total)):
        total[i, 0] = conditions[i, FORCE_X] + nodes[i, WEIGHT_X]
        total[i, 1] = conditions[i, FORCE_Y] + nodes[i, WEIGHT_Y]
        total[i, 2] = conditions[i, MOMENT]
    on_rock[:] = 0.0
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
            q, i = 2 * e + k, ends[e, k]
            tx, ty = tangent[q, 0], tangent[q, 1]
            fx, fy = pressure[q] * ty + shear[q] * tx, shear[q] * ty - pressure[q] * tx
            total[i, 0] += fx
            total[i, 1] += fy
            on_rock[q, 0], on_rock[q, 1] = -fx, -fy


@njit(cache=True, nogil=True, error_model="numpy")
def move(x, v, turn, spin, total, conditions, nodes, dt, alpha, reaction, step, work):
    """Move and turn the nodes over a step dt with the forces and moments on them; alpha: local damping. Fills step
    (n, 2), the way of each, and reaction (n, 3), what conditions had to add."""
    for i in range(len(x)):
        m, j = nodes[i, MASS], nodes[i, INERTIA]
        if m == 0.0:
            step[i, 0] = step[i, 1] = 0.0
            continue
        vx = v[i, 0] + dt / m * laws.damped(total[i, 0], v[i, 0], alpha)
        vy = v[i, 1] + dt / m * laws.damped(total[i, 1], v[i, 1], alpha)
        w = spin[i] + dt / j * laws.damped(total[i, 2], spin[i], alpha)
        reaction[i, 0] = reaction[i, 1] = reaction[i, 2] = 0.0
        if conditions[i, DOES_X] != 0.0:
            vx = conditions[i, AT_X]
            reaction[i, 0] = m * (vx - v[i, 0]) / dt - total[i, 0]
        if conditions[i, DOES_Y] != 0.0:
            vy = conditions[i, AT_Y]
            reaction[i, 1] = m * (vy - v[i, 1]) / dt - total[i, 1]
        if conditions[i, DOES_TURN] != 0.0:
            w = conditions[i, AT_TURN]
            reaction[i, 2] = j * (w - spin[i]) / dt - total[i, 2]
        mean_x, mean_y, mean_w = 0.5 * dt * (v[i, 0] + vx), 0.5 * dt * (v[i, 1] + vy), 0.5 * dt * (spin[i] + w)
        work[BY_CONDITIONS] += (reaction[i, 0] + conditions[i, FORCE_X]) * mean_x
        work[BY_CONDITIONS] += (reaction[i, 1] + conditions[i, FORCE_Y]) * mean_y
        work[BY_CONDITIONS] += (reaction[i, 2] + conditions[i, MOMENT]) * mean_w
        work[BY_GRAVITY] += nodes[i, WEIGHT_X] * mean_x + nodes[i, WEIGHT_Y] * mean_y
        step[i, 0], step[i, 1] = vx * dt, vy * dt
        v[i, 0], v[i, 1], spin[i] = vx, vy, w
        x[i, 0] += vx * dt
        x[i, 1] += vy * dt
        turn[i] += w * dt


@njit(cache=True, nogil=True, error_model="numpy")
def host_points(point, row, corner, x, seen):
    """Where the rock is at points (k,) whose host is held here: corner of storage row of x; fills seen (2 m, 2)."""
    for m in range(len(point)):
        q = point[m]
        seen[q, 0], seen[q, 1] = x[row[m], 2 * corner[q]], x[row[m], 2 * corner[q] + 1]


@njit(cache=True, nogil=True, error_model="numpy")
def add(point, row, corner, on_rock, applied):
    """Add forces of points (k,) on the rock to the corners of their hosts, applied (rows, 8) [N/m]."""
    for m in range(len(point)):
        q = point[m]
        applied[row[m], 2 * corner[q]] += on_rock[q, 0]
        applied[row[m], 2 * corner[q] + 1] += on_rock[q, 1]


@njit(cache=True, nogil=True, error_model="numpy")
def work_on_rock(before, after, rock, work):
    """Add what the mean of the forces (2 m, 2) at both ends of a step did on the rock."""
    for q in range(len(rock)):
        work[ON_ROCK] += 0.5 * (before[q, 0] + after[q, 0]) * rock[q, 0]
        work[ON_ROCK] += 0.5 * (before[q, 1] + after[q, 1]) * rock[q, 1]


def stored(force: np.ndarray, elements: np.ndarray) -> np.ndarray:
    """Elastic energy (m,) [J/m] of beams: N^2 L / (2 E A) + L (Ma^2 - Ma Mb + Mb^2) / (6 E I)."""
    n, a, b = force.T
    with np.errstate(divide="ignore", invalid="ignore"):
        found = n**2 / (2.0 * elements[:, AXIAL]) + (a * a - a * b + b * b) / (6.0 * elements[:, BENDING])
    return np.where(elements[:, AXIAL] > 0.0, found, 0.0)

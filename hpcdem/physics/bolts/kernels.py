"""Arithmetic of bolts: forces of bars and grout, and the motion of their nodes along them.

A node moves along the bar by itself; across it goes with the rock. Rows of nodes (n,) are bar after bar; element e of
(m,) lies between the nodes first[e] and first[e] + 1. Vectors are (n, d), in the plane d = 2, where forces and masses
are per metre of thickness, in space 3.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels import laws

FREE, VELOCITY, ACCELERATION = 0, 1, 2
"""What a component of a node does."""
# Columns of the table of conditions (n, 9) at a moment, of the component c: what it does is DOES + 2 c, at which value
# AT + 2 c, the force on the node FORCE + c.
DOES, AT, FORCE = 0, 1, 6
# Bits of the state of an element, and of the grout at a node.
IN_TENSION, IN_COMPRESSION, WAS_IN_TENSION, WAS_IN_COMPRESSION, RUPTURED = 1, 2, 4, 8, 16
SLIPS, SLIPPED = 1, 2
# Columns of the table of elements (m, 5): E A / L0 and L0, forces at which they yield [N/m], strain at rupture.
STIFFNESS, LENGTH, TENSION, COMPRESSION, FAILURE = range(5)
# Columns of the table of nodes (n, 7): mass, dashpot, grout: stiffness, cohesion and friction on both its faces.
MASS, DRAG, GROUT, ROCK_COHESION, ROCK_FRICTION, BOLT_COHESION, BOLT_FRICTION = range(7)
# Work (5,) [J/m], in space [J]: on the rock; lost in bars, in the grout, and by dashpots; by conditions.
ON_ROCK, IN_BARS, IN_GROUT, IN_DASHPOTS, BY_CONDITIONS = range(5)
WORK = 5
CRUSHED = 0.5
"""An element that is shorter than so much of its length has buckled: it carries nothing any more."""


@njit(cache=True, nogil=True, error_model="numpy")
def dot(a, b):
    """a . b, of vectors (d,)."""
    found = a[0] * b[0] + a[1] * b[1]
    if len(a) == 3:
        found += a[2] * b[2]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def apart(a, b):
    """Distance of two places (d,)."""
    ux, uy = b[0] - a[0], b[1] - a[1]
    square = ux * ux + uy * uy
    if len(a) == 3:
        uz = b[2] - a[2]
        square += uz * uz
    return math.sqrt(square)


@njit(cache=True, nogil=True, error_model="numpy")
def led(conditions, dim):
    """Return whether a node moves as its conditions (9,) say, in one direction at least."""
    found = conditions[DOES] != FREE or conditions[DOES + 2] != FREE
    return found or (dim == 3 and conditions[DOES + 4] != FREE)


@njit(cache=True, nogil=True, error_model="numpy")
def directions(first, x, state, along, tangent):
    """Unit vectors along elements (m, d), and at nodes (n, d) along the mean of those beside them that are whole; where
    none is, they stay."""
    new, dim = np.zeros(tangent.shape), x.shape[1]
    for e in range(len(first)):
        i = first[e]
        if state[e] & RUPTURED:
            continue
        length = apart(x[i], x[i + 1])
        for c in range(dim):
            along[e, c] = (x[i + 1, c] - x[i, c]) / length
            new[i, c] += along[e, c]
            new[i + 1, c] += along[e, c]
    for i in range(len(x)):
        size = math.sqrt(dot(new[i], new[i]))
        if size > 0.0:
            for c in range(dim):
                tangent[i, c] = new[i, c] / size


@njit(cache=True, nogil=True, error_model="numpy")
def host_points(node, row, weight, x, stride, seen):
    """Compute the position of the rock at nodes whose host is held here: rows (k,) of seen (n, d + 1) get weight (n, 4)
    times the corners of x (rows, 4 stride or more), of which one begins every `stride` words."""
    dim = seen.shape[1] - 1
    for m in range(len(node)):
        i, r = node[m], row[m]
        for d in range(dim):
            p = 0.0
            for c in range(4):
                if weight[i, c] != 0.0:
                    p += weight[i, c] * x[r, stride * c + d]
            seen[i, d] = p


@njit(cache=True, nogil=True, error_model="numpy")
def node_forces(first, along, tangent, force, grout, plate, hosted, carrier, share, conditions, total, on_rock):
    """Forces of bars and conditions on the nodes, total (n, d), and of nodes on the rock, on_rock (n, d) [N/m].

    The rock at a node gets the force of the grout, what bars pull across the bar, and under a plate all of it. Nodes
    without a host are carried, across the bar, by the nodes carrier (n, 2), share (n,) by the second.
    """
    dim = total.shape[1]
    for i in range(len(total)):
        for c in range(dim):
            total[i, c] = conditions[i, FORCE + c]
    for e in range(len(first)):
        i = first[e]
        for c in range(dim):
            f = force[e] * along[e, c]
            total[i, c] += f
            total[i + 1, c] -= f
    on_rock[:] = 0.0
    across = np.zeros(dim)
    for i in range(len(total)):
        leads = led(conditions[i], dim)
        f = dot(total[i], tangent[i])
        for c in range(dim):
            across[c] = 0.0 if leads else total[i, c] - f * tangent[i, c]
        if hosted[i]:
            for c in range(dim):
                on_rock[i, c] += across[c] - grout[i] * tangent[i, c]
                if plate[i] and not leads:
                    on_rock[i, c] += (f + grout[i]) * tangent[i, c]
        else:
            for k in range(2):
                by, part = carrier[i, k], share[i] if k == 1 else 1.0 - share[i]
                if by >= 0:
                    for c in range(dim):
                        on_rock[by, c] += part * across[c]


@njit(cache=True, nogil=True, error_model="numpy")
def move(
    first, x, v, point, before, tangent, total, grout, plate, hosted, carrier, share, conditions, nodes, dt, alpha,
    reaction, step, rock, work,
):  # fmt: skip
    """Move the nodes over a step dt in which the rock at them went from before to point (n, d) [m].

    Along the bar with the force of bars, conditions and grout: m dw / dt = F - c w, the dashpot at the mean velocity
    (any c dt / m is stable); alpha: local damping in its place. Fills step (n, d), the way of each node, rock (n, d),
    that of the rock, and reaction (n, d), what conditions had to add [N/m].
    """
    dim = x.shape[1]
    for i in range(len(x)):
        if hosted[i]:
            for c in range(dim):
                rock[i, c] = point[i, c] - before[i, c]
    for i in range(len(x)):
        if not hosted[i]:
            rock[i] = 0.0
            for k in range(2):
                by, part = carrier[i, k], share[i] if k == 1 else 1.0 - share[i]
                if by >= 0:
                    for c in range(dim):
                        rock[i, c] += part * rock[by, c]
    for i in range(len(x)):
        f = dot(total[i], tangent[i]) + grout[i]
        m, drag = nodes[i, MASS], 0.0
        w = dot(v[i], tangent[i])
        if plate[i] and hosted[i]:
            for c in range(dim):
                step[i, c] = rock[i, c]
        else:
            if alpha > 0.0:
                new = w + dt / m * laws.damped(f, w, alpha)
            else:
                drag = nodes[i, DRAG]
                g = 0.5 * drag * dt / m
                new = ((1.0 - g) * w + dt / m * f) / (1.0 + g)
            slide = new * dt - dot(rock[i], tangent[i])
            for c in range(dim):
                step[i, c] = rock[i, c] + slide * tangent[i, c]
        for c in range(dim):
            does, at = conditions[i, DOES + 2 * c], conditions[i, AT + 2 * c]
            if does != FREE:
                step[i, c] = dt * (at if does == VELOCITY else v[i, c] + at * dt)
        mean = 0.5 * (w + dot(step[i], tangent[i]) / dt)
        work[IN_DASHPOTS] += drag * mean * mean * dt
        for c in range(dim):
            reaction[i, c] = 0.0
            if conditions[i, DOES + 2 * c] != FREE:
                held = (grout[i] - drag * mean) * tangent[i, c]
                reaction[i, c] = m * (step[i, c] / dt - v[i, c]) / dt - total[i, c] - held
            both = 0.5 * (v[i, c] * dt + step[i, c])  # forces of a moment, see energy.py
            work[BY_CONDITIONS] += (reaction[i, c] + conditions[i, FORCE + c]) * both
            v[i, c] = step[i, c] / dt
            x[i, c] += step[i, c]


@njit(cache=True, nogil=True, error_model="numpy")
def stretch(first, x, elements, length, force, state, plastic, work):
    """New axial forces (m,) [N/m] from the new positions; length (m,): before, and then now.

    f += E A / L0 du, held between both yield forces; what goes beyond is plastic lengthening. An element that has
    become longer than L0 by the failure strain, or shorter than CRUSHED L0, is broken for good.
    """
    for e in range(len(first)):
        now = apart(x[first[e]], x[first[e] + 1])
        du, f = now - length[e], force[e]
        length[e] = now
        state[e] &= ~(IN_TENSION | IN_COMPRESSION)
        if state[e] & RUPTURED:
            continue
        k = elements[e, STIFFNESS]
        trial = f + k * du
        new = min(max(trial, -elements[e, COMPRESSION]), elements[e, TENSION])
        if trial > new:
            state[e] |= IN_TENSION | WAS_IN_TENSION
        elif trial < new:
            state[e] |= IN_COMPRESSION | WAS_IN_COMPRESSION
        plastic[e] += (trial - new) / k
        grown = now - elements[e, LENGTH]
        if grown >= elements[e, FAILURE] * elements[e, LENGTH] or now < CRUSHED * elements[e, LENGTH]:
            state[e] |= RUPTURED
            new = 0.0
        force[e] = new
        work[IN_BARS] += 0.5 * (f + new) * du - 0.5 * (new * new - f * f) / k


@njit(cache=True, nogil=True, error_model="numpy")
def hold(tangent, step, rock, hosted, nodes, normal, grout, slip, state, work):
    """New forces of the grout (n,) [N/m] along the bar on it, from the ways of node and rock.

    f += K (du of the rock - du of the bar), |f| <= S = min over both faces of C - sigma_n tan phi, sigma_n = min(0,
    normal): stress across the bar in its host, tension positive. slip: of the bar against the rock [m].
    """
    for i in range(len(grout)):
        k = nodes[i, GROUT]
        state[i] &= ~SLIPS
        if not hosted[i] or k == 0.0:
            continue
        du = dot(rock[i] - step[i], tangent[i])
        sigma, f = min(0.0, normal[i]), grout[i]
        most = min(
            nodes[i, ROCK_COHESION] - sigma * nodes[i, ROCK_FRICTION],
            nodes[i, BOLT_COHESION] - sigma * nodes[i, BOLT_FRICTION],
        )
        trial = f + k * du
        new = min(max(trial, -most), most)
        if new != trial:
            state[i] |= SLIPS | SLIPPED
            slip[i] -= (trial - new) / k
        grout[i] = new
        work[IN_GROUT] += 0.5 * (f + new) * du - 0.5 * (new * new - f * f) / k


@njit(cache=True, nogil=True, error_model="numpy")
def add(node, row, weight, on_rock, stride, applied):
    """Add forces of nodes (k,) on the rock to the corners of their hosts, applied (rows, 4 stride) [N/m]."""
    for m in range(len(node)):
        i, r = node[m], row[m]
        for c in range(4):
            if weight[i, c] != 0.0:
                for d in range(on_rock.shape[1]):
                    applied[r, stride * c + d] += weight[i, c] * on_rock[i, d]


@njit(cache=True, nogil=True, error_model="numpy")
def across(stress, tangent, out):
    """Normal stress across unit vectors t (n, d), of stresses (n, 4 or 6): xx, yy, xy, zz, in space xz, yz.

    In the plane that in it; in space the mean in all directions across, (tr s - t s t) / 2.
    """
    for i in range(len(tangent)):
        s, tx, ty = stress[i], tangent[i, 0], tangent[i, 1]
        if tangent.shape[1] == 2:
            out[i] = s[0] * ty * ty + s[1] * tx * tx - 2.0 * s[2] * tx * ty
        else:
            tz = tangent[i, 2]
            along = s[0] * tx * tx + s[1] * ty * ty + s[3] * tz * tz
            along += 2.0 * (s[2] * tx * ty + s[4] * tx * tz + s[5] * ty * tz)
            out[i] = 0.5 * (s[0] + s[1] + s[3] - along)


def first_nodes(bar: np.ndarray) -> np.ndarray:
    """First node of each element, from the bar of each node (n,)."""
    return np.flatnonzero(bar[1:] == bar[:-1])

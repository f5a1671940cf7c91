"""Arithmetic of bolts: forces of bars and grout, and the motion of their nodes along them.

A node moves along the bar by itself; across it goes with the rock. Rows of nodes (n,) are bar after bar; element e of
(m,) lies between the nodes first[e] and first[e] + 1. Forces and masses are per metre of thickness.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels import laws

FREE, VELOCITY, ACCELERATION = 0, 1, 2
"""What a component of a node does."""
# Columns of the table of conditions (n, 6) at a moment: what x and y do, at which value, and the force on the node.
DOES_X, AT_X, DOES_Y, AT_Y, FORCE_X, FORCE_Y = range(6)
# Bits of the state of an element, and of the grout at a node.
IN_TENSION, IN_COMPRESSION, WAS_IN_TENSION, WAS_IN_COMPRESSION, RUPTURED = 1, 2, 4, 8, 16
SLIPS, SLIPPED = 1, 2
# Columns of the table of elements (m, 5): E A / L0 and L0, forces at which they yield [N/m], strain at rupture.
STIFFNESS, LENGTH, TENSION, COMPRESSION, FAILURE = range(5)
# Columns of the table of nodes (n, 7): mass, dashpot, grout: stiffness, cohesion and friction on both its faces.
MASS, DRAG, GROUT, ROCK_COHESION, ROCK_FRICTION, BOLT_COHESION, BOLT_FRICTION = range(7)
# Work (5,) [J/m]: on the rock; lost in bars, in the grout, and by dashpots; by conditions.
ON_ROCK, IN_BARS, IN_GROUT, IN_DASHPOTS, BY_CONDITIONS = range(5)
WORK = 5
CRUSHED = 0.5
"""An element that is shorter than so much of its length has buckled: it carries nothing any more."""


@njit(cache=True, nogil=True, error_model="numpy")
def directions(first, x, state, along, tangent):
    """Unit vectors along elements (m, 2), and at nodes (n, 2) along the mean of those beside them that are whole; where
    none is, they stay."""
    new = np.zeros(tangent.shape)
    for e in range(len(first)):
        i = first[e]
        if state[e] & RUPTURED:
            continue
        ux, uy = x[i + 1, 0] - x[i, 0], x[i + 1, 1] - x[i, 1]
        length = math.sqrt(ux * ux + uy * uy)
        along[e, 0], along[e, 1] = ux / length, uy / length
        for k in (i, i + 1):
            new[k, 0] += along[e, 0]
            new[k, 1] += along[e, 1]
    for i in range(len(x)):
        size = math.sqrt(new[i, 0] ** 2 + new[i, 1] ** 2)
        if size > 0.0:
            tangent[i, 0], tangent[i, 1] = new[i, 0] / size, new[i, 1] / size


@njit(cache=True, nogil=True, error_model="numpy")
def host_points(node, row, weight, x, seen):
    """Where the rock is at nodes whose host is held here: rows (k,) of seen (n, 3) get weight (n, 4) times the corners
    of x (rows, 8 or more)."""
    for m in range(len(node)):
        i, r = node[m], row[m]
        px = py = 0.0
        for c in range(4):
            if weight[i, c] != 0.0:
                px += weight[i, c] * x[r, 2 * c]
                py += weight[i, c] * x[r, 2 * c + 1]
        seen[i, 0], seen[i, 1] = px, py


@njit(cache=True, nogil=True, error_model="numpy")
def node_forces(first, along, tangent, force, grout, plate, hosted, carrier, share, conditions, total, on_rock):
    """Forces of bars and conditions on the nodes, total (n, 2), and of nodes on the rock, on_rock (n, 2) [N/m].

    The rock at a node gets the force of the grout, what bars pull across the bar, and under a plate all of it. Nodes
    without a host are carried, across the bar, by the nodes carrier (n, 2), share (n,) by the second.
    """
    for i in range(len(total)):
        total[i, 0], total[i, 1] = conditions[i, FORCE_X], conditions[i, FORCE_Y]
    for e in range(len(first)):
        i = first[e]
        fx, fy = force[e] * along[e, 0], force[e] * along[e, 1]
        total[i, 0] += fx
        total[i, 1] += fy
        total[i + 1, 0] -= fx
        total[i + 1, 1] -= fy
    on_rock[:] = 0.0
    for i in range(len(total)):
        tx, ty = tangent[i, 0], tangent[i, 1]
        led = conditions[i, DOES_X] != FREE or conditions[i, DOES_Y] != FREE
        f = total[i, 0] * tx + total[i, 1] * ty
        across_x, across_y = (0.0, 0.0) if led else (total[i, 0] - f * tx, total[i, 1] - f * ty)
        if hosted[i]:
            on_rock[i, 0] += across_x - grout[i] * tx
            on_rock[i, 1] += across_y - grout[i] * ty
            if plate[i] and not led:
                on_rock[i, 0] += (f + grout[i]) * tx
                on_rock[i, 1] += (f + grout[i]) * ty
        else:
            for k in range(2):
                c, part = carrier[i, k], share[i] if k == 1 else 1.0 - share[i]
                if c >= 0:
                    on_rock[c, 0] += part * across_x
                    on_rock[c, 1] += part * across_y


@njit(cache=True, nogil=True, error_model="numpy")
def move(
    first, x, v, point, before, tangent, total, grout, plate, hosted, carrier, share, conditions, nodes, dt, alpha,
    reaction, step, rock, work,
):  # fmt: skip
    """Move the nodes over a step dt in which the rock at them went from before to point (n, 2) [m].

    Along the bar with the force of bars, conditions and grout: m dw / dt = F - c w, the dashpot at the mean velocity
    (any c dt / m is stable); alpha: local damping in its place. Fills step (n, 2), the way of each node, rock (n, 2),
    that of the rock, and reaction (n, 2), what conditions had to add [N/m].
    """
    for i in range(len(x)):
        if hosted[i]:
            rock[i, 0], rock[i, 1] = point[i, 0] - before[i, 0], point[i, 1] - before[i, 1]
    for i in range(len(x)):
        if not hosted[i]:
            rock[i, 0] = rock[i, 1] = 0.0
            for k in range(2):
                c, part = carrier[i, k], share[i] if k == 1 else 1.0 - share[i]
                if c >= 0:
                    rock[i, 0] += part * rock[c, 0]
                    rock[i, 1] += part * rock[c, 1]
    for i in range(len(x)):
        tx, ty = tangent[i, 0], tangent[i, 1]
        f = total[i, 0] * tx + total[i, 1] * ty + grout[i]
        m, drag = nodes[i, MASS], 0.0
        w = v[i, 0] * tx + v[i, 1] * ty
        if plate[i] and hosted[i]:
            dx, dy = rock[i, 0], rock[i, 1]
        else:
            if alpha > 0.0:
                new = w + dt / m * laws.damped(f, w, alpha)
            else:
                drag = nodes[i, DRAG]
                g = 0.5 * drag * dt / m
                new = ((1.0 - g) * w + dt / m * f) / (1.0 + g)
            slide = new * dt - (rock[i, 0] * tx + rock[i, 1] * ty)
            dx, dy = rock[i, 0] + slide * tx, rock[i, 1] + slide * ty
        reaction[i, 0] = reaction[i, 1] = 0.0
        led_x, led_y = conditions[i, DOES_X] != FREE, conditions[i, DOES_Y] != FREE
        if led_x:
            at = conditions[i, AT_X]
            dx = dt * (at if conditions[i, DOES_X] == VELOCITY else v[i, 0] + at * dt)
        if led_y:
            at = conditions[i, AT_Y]
            dy = dt * (at if conditions[i, DOES_Y] == VELOCITY else v[i, 1] + at * dt)
        mean = 0.5 * (w + (dx * tx + dy * ty) / dt)
        if led_x:
            reaction[i, 0] = m * (dx / dt - v[i, 0]) / dt - total[i, 0] - (grout[i] - drag * mean) * tx
        if led_y:
            reaction[i, 1] = m * (dy / dt - v[i, 1]) / dt - total[i, 1] - (grout[i] - drag * mean) * ty
        work[IN_DASHPOTS] += drag * mean * mean * dt
        mean_x, mean_y = 0.5 * (v[i, 0] * dt + dx), 0.5 * (v[i, 1] * dt + dy)  # forces of a moment, see energy.py
        work[BY_CONDITIONS] += (reaction[i, 0] + conditions[i, FORCE_X]) * mean_x
        work[BY_CONDITIONS] += (reaction[i, 1] + conditions[i, FORCE_Y]) * mean_y
        step[i, 0], step[i, 1] = dx, dy
        v[i, 0], v[i, 1] = dx / dt, dy / dt
        x[i, 0] += dx
        x[i, 1] += dy


@njit(cache=True, nogil=True, error_model="numpy")
def stretch(first, x, elements, length, force, state, plastic, work):
    """New axial forces (m,) [N/m] from the new positions; length (m,): before, and then now.

    f += E A / L0 du, held between both yield forces; what goes beyond is plastic lengthening. An element that has
    become longer than L0 by the failure strain, or shorter than CRUSHED L0, is broken for good.
    """
    for e in range(len(first)):
        i = first[e]
        ux, uy = x[i + 1, 0] - x[i, 0], x[i + 1, 1] - x[i, 1]
        now = math.sqrt(ux * ux + uy * uy)
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
        tx, ty = tangent[i, 0], tangent[i, 1]
        du = (rock[i, 0] - step[i, 0]) * tx + (rock[i, 1] - step[i, 1]) * ty
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
def add(node, row, weight, on_rock, applied):
    """Add forces of nodes (k,) on the rock to the corners of their hosts, applied (rows, 8) [N/m]."""
    for m in range(len(node)):
        i, r = node[m], row[m]
        for c in range(4):
            if weight[i, c] != 0.0:
                applied[r, 2 * c] += weight[i, c] * on_rock[i, 0]
                applied[r, 2 * c + 1] += weight[i, c] * on_rock[i, 1]


@njit(cache=True, nogil=True, error_model="numpy")
def work_on_rock(before, after, rock, work):
    """Add what the mean of the forces (n, 2) at both ends of a step did on the rock."""
    for i in range(len(rock)):
        work[ON_ROCK] += 0.5 * (before[i, 0] + after[i, 0]) * rock[i, 0]
        work[ON_ROCK] += 0.5 * (before[i, 1] + after[i, 1]) * rock[i, 1]


def first_nodes(bar: np.ndarray) -> np.ndarray:
    """First node of each element, from the bar of each node (n,)."""
    return np.flatnonzero(bar[1:] == bar[:-1])

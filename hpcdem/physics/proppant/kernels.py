"""Proppant between flow nodes: what channels carry, what nodes give and take, and what that does to the fluid.

Finite volumes after 7.7 of the manual, (119) to (137). Proppant N [m2] of a node moves along a channel with the slurry
and settles in it: C q and C delta (1 - mean C)^5.65 v (Richardson & Zaki 1954), each of the node that it comes from.
Two factors per node keep this within bounds and its volume the same: `GIVES`, of all that leaves a node, so that no
more leaves than is there, and `TAKES`, of all that comes, so that a node is filled to the limit and not beyond.
"""

from __future__ import annotations

import math

from numba import njit

from hpcdem.physics.flow import kernels as flowing

# Columns of nodes, copies too (n, 5): concentration, factors of what leaves and what comes, 1 if it is packed, pressure
# of the pack on its walls [Pa].
C, GIVES, TAKES, PACKED, PUSHES = range(5)
STATE = 5
# Columns of owned nodes (n, 7): proppant, what came and what left by conditions [m2]; room for slurry at the end of the
# last step, and that now [m2]; what comes by conditions in a sub-step [m2], negative: part of the room that leaves; all
# room between the walls [m2].
N, CAME, LEFT, ROOM_BEFORE, ROOM, SOURCE, VOLUME = range(7)
NODE = 7
# Columns of what channels carry (m, 2) [m2/s]: from the first end, from the last.
FORTH, BACK = range(2)
HINDERED = 5.65
FULL, LOOSE = 1e-6, 0.99
"""A node is packed from its limit less this on, until its concentration is below this part of the limit."""
EMPTY = 0.1
"""Part of the volume of a node below which its slurry does not shorten sub-steps."""
NEAR = 0.999
"""Part of the limit beyond which the viscosity of a slurry does not grow."""


@njit(cache=True, nogil=True, error_model="numpy")
def carry(ends, one, other, carries, x, q, channels, fluid, narrow, vx, vy, state, out):
    """What channels carry, out (m, 2) [m2/s]: volume rates of proppant. one, other (m,): where both faces begin in x;
    carries (m,) bool; q (m,): flow of slurry [m2/s]; fluid: state of the flow's nodes, grains settle in as much of a
    channel as is filled at both ends; narrow [m]: least aperture that grains pass; vx, vy: velocity of
    a single grain [m/s]. Slurry that flows brings none into a pack and takes none out of it; grains settle into one
    that is not quite full, and out of one with room below."""
    x = x.reshape(x.size)
    for c in range(len(ends)):
        a, b = ends[c, 0], ends[c, 1]
        forth = back = 0.0
        delta = channels[c, flowing.APERTURE]
        if carries[c] and delta >= narrow:
            i, j = one[c], other[c]
            wx = (x[i + 2] - x[i]) + (x[j] - x[j + 2])
            wy = (x[i + 3] - x[i + 1]) + (x[j + 1] - x[j + 3])
            along = (vx * wx + vy * wy) / math.sqrt(wx * wx + wy * wy)
            filled = delta * min(fluid[a, flowing.S], fluid[b, flowing.S])
            slip = along * filled * max(1.0 - 0.5 * (state[a, C] + state[b, C]), 0.0) ** HINDERED  # 0: crushed pack
            flow = q[c] if state[a, PACKED] == 0.0 and state[b, PACKED] == 0.0 else 0.0
            forth = state[a, C] * (max(flow, 0.0) + max(slip, 0.0))
            back = state[b, C] * (max(-flow, 0.0) + max(-slip, 0.0))
        out[c, FORTH], out[c, BACK] = forth, back


@njit(cache=True, nogil=True, error_model="numpy")
def fastest(begin, channel, side, q, channels, speed, fluid, nodes):
    """Shortest time [s] in which a node could lose its slurry: room over flow and settling out of it. fluid (n,
    flowing.NODE): of the nodes; of one that is nearly empty a part of its volume counts, its factor does the rest."""
    least = math.inf
    for i in range(len(nodes)):
        rate = 0.0
        for m in range(begin[i], begin[i + 1]):
            c = channel[m]
            rate += max(-side[m] * q[c], 0.0) + speed * channels[c, flowing.APERTURE]
        if rate > 0.0:
            least = min(least, max(nodes[i, ROOM], EMPTY * fluid[i, flowing.V]) / rate)
    return least


@njit(cache=True, nogil=True, error_model="numpy")
def pour(dt, limit, nodes, state):
    """A sub-step's share of what conditions bring, as far as it finds room, or take. Returns what found none [m2]."""
    refused = 0.0
    for i in range(len(nodes)):
        source, packed = nodes[i, SOURCE], state[i, PACKED] > 0.0
        if source > 0.0:
            most = 0.0 if packed else max(limit * nodes[i, ROOM] - nodes[i, N], 0.0)
            came = min(source, most)
            refused += source - came
            nodes[i, N] += came
            nodes[i, CAME] += came
        elif source < 0.0 and not packed:
            left = min(-source * nodes[i, N], nodes[i, N])
            nodes[i, N] -= left
            nodes[i, LEFT] += left
    return refused


@njit(cache=True, nogil=True, error_model="numpy")
def give(begin, channel, side, out, dt, nodes, state):
    """Factors of what leaves the owned nodes in dt [s]; nothing comes yet."""
    for i in range(len(nodes)):
        leaves = 0.0
        for m in range(begin[i], begin[i + 1]):
            leaves += out[channel[m], FORTH if side[m] < 0.0 else BACK]
        leaves *= dt
        state[i, GIVES] = min(1.0, nodes[i, N] / leaves) if leaves > 0.0 else 1.0
        state[i, TAKES] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def take(begin, channel, side, ends, out, dt, limit, part, nodes, state, takes):
    """Factors of what comes to the owned nodes, takes (n,): what leaves is what the others take by their present
    factors, and so never more than at the end; part: of the way from the room before to the room now."""
    for i in range(len(nodes)):
        comes = leaves = 0.0
        for m in range(begin[i], begin[i + 1]):
            c = channel[m]
            if side[m] < 0.0:
                far = ends[c, 1]
                leaves += state[i, GIVES] * out[c, FORTH] * state[far, TAKES]
                comes += state[far, GIVES] * out[c, BACK]
            else:
                far = ends[c, 0]
                leaves += state[i, GIVES] * out[c, BACK] * state[far, TAKES]
                comes += state[far, GIVES] * out[c, FORTH]
        room = (1.0 - part) * nodes[i, ROOM_BEFORE] + part * nodes[i, ROOM]
        free = (limit * room - nodes[i, N]) + dt * leaves
        takes[i] = min(max(free, 0.0) / (dt * comes), 1.0) if comes > 0.0 else 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def move(begin, channel, side, ends, out, dt, part, limit, modulus, nodes, state):
    """A sub-step: proppant of the owned nodes, then their concentration, whether they are packed, and the pressure of
    the pack: the modulus times what its room lacks for it (137), which no way there changes."""
    for i in range(len(nodes)):
        into = 0.0
        for m in range(begin[i], begin[i + 1]):
            c = channel[m]
            far = ends[c, 1] if side[m] < 0.0 else ends[c, 0]
            mine, its = (FORTH, BACK) if side[m] < 0.0 else (BACK, FORTH)
            comes = state[far, GIVES] * out[c, its] * state[i, TAKES]
            leaves = state[i, GIVES] * out[c, mine] * state[far, TAKES]
            into += comes - leaves
        nodes[i, N] = max(nodes[i, N] + dt * into, 0.0)
    settle(part, limit, modulus, nodes, state)


@njit(cache=True, nogil=True, error_model="numpy")
def settle(part, limit, modulus, nodes, state):
    """Concentration, pack and its pressure of the owned nodes by their proppant and room. A pack is pressed by its
    walls; of what fluid leaves it, it becomes no denser."""
    for i in range(len(nodes)):
        room = (1.0 - part) * nodes[i, ROOM_BEFORE] + part * nodes[i, ROOM]
        n = nodes[i, N]
        c = n / room if n > 0.0 and room > 0.0 else 0.0
        if c > limit:  # fluid has gone from between the grains, or walls have come closer
            c = max(limit, n / nodes[i, VOLUME])
        packed = state[i, PACKED] > 0.0
        packed = c >= LOOSE * limit if packed else c >= limit - FULL
        state[i, C], state[i, PACKED] = c, 1.0 if packed else 0.0
        state[i, PUSHES] = modulus * (1.0 - limit / c) if c > limit else 0.0


@njit(cache=True, error_model="numpy")
def _resistance(c, packed, limit, power, pack):
    """Of half a channel over that of the fluid alone: a slurry is at most as stiff as the fluid in a pack."""
    if packed > 0.0:
        return pack
    return min((1.0 - min(c, NEAR * limit) / limit) ** power, pack)


@njit(cache=True, nogil=True, error_model="numpy")
def thicken(ends, state, limit, power, factor, permeability, heavier, channels):
    """What proppant does to channels (m, flowing.CHANNEL): their conductance, of two halves one behind the other, and
    the weight of what is in them over that of the fluid. power: beta of (134); factor: aperture of a pack over that of
    the channel, 0: by its permeability [m2]; heavier: rho_p / rho_f - 1. A pack rests on its walls."""
    for c in range(len(ends)):
        a, b, delta = ends[c, 0], ends[c, 1], channels[c, flowing.APERTURE]
        pack = 1.0 / (factor * factor * factor) if factor > 0.0 else max(delta * delta / (12.0 * permeability), 1.0)
        one = _resistance(state[a, C], state[a, PACKED], limit, power, pack)
        other = _resistance(state[b, C], state[b, PACKED], limit, power, pack)
        channels[c, flowing.CONDUCT] *= 2.0 / (one + other)
        solid = 0.5 * ((1.0 - state[a, PACKED]) * state[a, C] + (1.0 - state[b, PACKED]) * state[b, C])
        channels[c, flowing.WEIGHT] = 1.0 + heavier * solid


def kozeny_carman(limit: float, size: float) -> float:
    """Permeability [m2] of a pack of this concentration and diameter of grains [m]: phi^3 d^2 / (180 (1 - phi)^2)."""
    return (1.0 - limit) ** 3 * size * size / (180.0 * limit * limit)

"""Proppant between flow nodes: what channels carry, what nodes give and take, and what that does to the fluid.

Finite volumes after 7.7 of the manual, (119) to (137). Proppant N [m2] of a node moves along a channel with the slurry
and settles in it: C q and C delta (1 - mean C)^5.65 v (Richardson & Zaki 1954), each of the node that it comes from.
Two factors per node keep this within bounds and its volume the same: `GIVES`, of all that leaves a node, so that no
more leaves than is there, and `TAKES`, of all that comes, so that a node is filled to the limit and not beyond. In
space "channels" are the links of triangles, m2 are m3.

There nodes own their parts of a triangle up to its medians (the median dual). A link carries what crosses the piece of
median between its two ends, from the middle of their side to the centre. These pieces add up to nothing, so what
crosses them in a uniform field does too. What flows along the three links (flow/kernels.py) brings the same to each
node, but for a part that goes around the triangle: what crosses the medians is q minus the mean of its three.
"""

from __future__ import annotations

import math

from numba import njit

from hpcdem.physics.flow import kernels as flowing

# Columns of nodes, copies too (n, 6): concentration, factors of what leaves and what comes, 1 if it is packed, pressure
# of the pack on its walls [Pa], viscosity of the slurry over that of the fluid.
C, GIVES, TAKES, PACKED, PUSHES, THICK = range(6)
STATE = 6
# Columns of owned nodes (n, 8): proppant, what came and what left by conditions [m2]; room for slurry at the end of the
# last step, and that now [m2]; what comes by conditions in a sub-step [m2], negative: part of the room that leaves; all
# room between the walls [m2]; what channels bring in a sub-step if it finds room [m2].
N, CAME, LEFT, ROOM_BEFORE, ROOM, SOURCE, VOLUME, COMES = range(8)
NODE = 8
# Columns of what channels carry (m, 2) [m2/s]: from the first end, from the last.
FORTH, BACK = range(2)
HINDERED = 5.65
FULL, LOOSE = 1e-6, 0.99
"""A node is packed from its limit less this on, until its concentration is below this part of the limit."""
EMPTY = 0.1
"""Part of the volume of a node below which its slurry does not shorten sub-steps."""
NEAR = 0.999
"""Part of the limit beyond which the viscosity of a slurry does not grow."""


@njit(cache=True, error_model="numpy")
def _across(down, ax, ay, az, nx, ny, nz):
    return (down[0] * (ay * nz - az * ny) + down[1] * (az * nx - ax * nz) + down[2] * (ax * ny - ay * nx)) / 6.0


@njit(cache=True, nogil=True, error_model="numpy")
def falls(one, other, x, down, out):
    """Compute the transport along links by a unit velocity down (dim,), out (l,). one, other (m, dim): where the
    corners of both faces of channels begin in x. Of an edge the cosine of its angle to it; of a triangle what crosses
    the medians [m]: of the velocity only what is in its plane counts."""
    x = x.reshape(x.size)
    for k in range(len(one)):
        a, b, p, q = one[k, 0], one[k, 1], other[k, 0], other[k, 1]
        if one.shape[1] == 2:  # p is opposite b
            wx, wy = (x[b] - x[a]) + (x[p] - x[q]), (x[b + 1] - x[a + 1]) + (x[p + 1] - x[q + 1])
            out[k] = (down[0] * wx + down[1] * wy) / math.sqrt(wx * wx + wy * wy)
            continue
        c, r = one[k, 2], other[k, 2]  # p is opposite a, r opposite b, q opposite c
        mx, my, mz = x[a] + x[p], x[a + 1] + x[p + 1], x[a + 2] + x[p + 2]
        ux, uy, uz = x[b] + x[r] - mx, x[b + 1] + x[r + 1] - my, x[b + 2] + x[r + 2] - mz
        wx, wy, wz = x[c] + x[q] - mx, x[c + 1] + x[q + 1] - my, x[c + 2] + x[q + 2] - mz
        ux, uy, uz, wx, wy, wz = 0.5 * ux, 0.5 * uy, 0.5 * uz, 0.5 * wx, 0.5 * wy, 0.5 * wz
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        size = math.sqrt(nx * nx + (ny * ny + nz * nz))
        nx, ny, nz = nx / size, ny / size, nz / size
        out[3 * k] = _across(down, -(ux + wx), -(uy + wy), -(uz + wz), nx, ny, nz)
        out[3 * k + 1] = _across(down, 2.0 * ux - wx, 2.0 * uy - wy, 2.0 * uz - wz, nx, ny, nz)
        out[3 * k + 2] = _across(down, 2.0 * wx - ux, 2.0 * wy - uy, 2.0 * wz - uz, nx, ny, nz)


@njit(cache=True, nogil=True, error_model="numpy")
def carry(ends, fall, carries, q, channels, fluid, narrow, speed, state, out):
    """Compute the flow of proppant in channels, out (m, 2) [m2/s]: volume rates of proppant. fall (m,): see `falls`;
    carries (m,) bool; q (m,): flow of slurry [m2/s]; fluid: state of the flow's nodes, grains settle in as much of a
    channel as is filled at both ends; narrow [m]: least aperture that grains pass; speed: of a single grain that
    settles [m/s]. Slurry that flows brings none into a pack and takes none out of it; grains settle into one that is
    not quite full, and out of one with room below."""
    for c in range(len(ends)):
        a, b = ends[c, 0], ends[c, 1]
        forth = back = 0.0
        delta = channels[c, flowing.APERTURE]
        if carries[c] and delta >= narrow and (state[a, C] > 0.0 or state[b, C] > 0.0):
            filled = delta * min(fluid[a, flowing.S], fluid[b, flowing.S])
            hindered = max(1.0 - 0.5 * (state[a, C] + state[b, C]), 0.0) ** HINDERED  # 0: crushed pack
            slip = speed * fall[c] * filled * hindered
            flow = q[c] if state[a, PACKED] == 0.0 and state[b, PACKED] == 0.0 else 0.0
            forth = state[a, C] * (max(flow, 0.0) + max(slip, 0.0))
            back = state[b, C] * (max(-flow, 0.0) + max(-slip, 0.0))
        out[c, FORTH], out[c, BACK] = forth, back


@njit(cache=True, nogil=True, error_model="numpy")
def fastest(begin, channel, side, q, channels, fall, speed, fluid, nodes):
    """Shortest time [s] in which a node could lose its slurry: room over flow and settling out of it. fluid (n,
    flowing.NODE): of the nodes; of one that is nearly empty a part of its volume counts, its factor does the rest."""
    least = math.inf
    for i in range(len(nodes)):
        rate = 0.0
        for m in range(begin[i], begin[i + 1]):
            c = channel[m]
            rate += max(-side[m] * q[c], 0.0) + abs(speed * fall[c]) * channels[c, flowing.APERTURE]
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
def come(begin, channel, side, ends, out, dt, nodes, state):
    """Compute what channels bring to the owned nodes in dt [s]."""
    for i in range(len(nodes)):
        comes = 0.0
        for m in range(begin[i], begin[i + 1]):
            c = channel[m]
            far, its = (ends[c, 1], BACK) if side[m] < 0.0 else (ends[c, 0], FORTH)
            comes += state[far, GIVES] * out[c, its]
        nodes[i, COMES] = comes * dt


@njit(cache=True, nogil=True, error_model="numpy")
def take(begin, channel, side, ends, out, dt, limit, part, nodes, state, takes):
    """Factors of what comes to the owned nodes, takes (n,): what leaves is what the others take by their present
    factors, and so never more than at the end; part: of the way from the room before to the room now."""
    for i in range(len(nodes)):
        comes = nodes[i, COMES]
        room = (1.0 - part) * nodes[i, ROOM_BEFORE] + part * nodes[i, ROOM]
        free = limit * room - nodes[i, N]
        if comes <= max(free, 0.0):
            takes[i] = 1.0
            continue
        leaves = 0.0
        for m in range(begin[i], begin[i + 1]):
            c = channel[m]
            far, mine = (ends[c, 1], FORTH) if side[m] < 0.0 else (ends[c, 0], BACK)
            leaves += state[i, GIVES] * out[c, mine] * state[far, TAKES]
        takes[i] = min(max(free + dt * leaves, 0.0) / comes, 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def move(begin, channel, side, ends, out, dt, part, limit, power, modulus, nodes, state):
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
    settle(part, limit, power, modulus, nodes, state)


@njit(cache=True, nogil=True, error_model="numpy")
def settle(part, limit, power, modulus, nodes, state):
    """Concentration, viscosity, pack and its pressure of the owned nodes by their proppant and room. power: beta of
    (134). A pack is pressed by its walls; of what fluid leaves it, it becomes no denser."""
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
        state[i, THICK] = (1.0 - min(c, NEAR * limit) / limit) ** power if c > 0.0 else 1.0


@njit(cache=True, error_model="numpy")
def resistance(state, node, delta, factor, permeability):
    """Return the resistance of a channel's part at a node over that of the fluid alone, see `thicken`: a slurry is at
    most as stiff as the fluid in a pack."""
    pack = 1.0 / (factor * factor * factor) if factor > 0.0 else max(delta * delta / (12.0 * permeability), 1.0)
    return pack if state[node, PACKED] > 0.0 else min(state[node, THICK], pack)


@njit(cache=True, error_model="numpy")
def weight(state, a, b, heavier):
    """Return the weight of the content between two nodes over that of the fluid alone. A pack rests on its walls."""
    return 1.0 + heavier * 0.5 * ((1.0 - state[a, PACKED]) * state[a, C] + (1.0 - state[b, PACKED]) * state[b, C])


@njit(cache=True, nogil=True, error_model="numpy")
def thicken(links, ends, state, factor, permeability, heavier, channels):
    """Apply the effect of proppant to the links of channels (l, flowing.CHANNEL): their conductance, and the weight of
    what is in them over that of the fluid. factor: aperture of a pack over that of the channel, 0: by its permeability
    [m2]; heavier: rho_p / rho_f - 1. The parts of a channel at its corners are one behind the other, so that links of a
    triangle keep their shares: one of a negative conductance has to be outweighed by the others."""
    for first in range(0, len(ends), links):
        delta, total, parts = channels[first, flowing.APERTURE], 0.0, links
        for c in range(first, first + links):
            total += resistance(state, ends[c, 0], delta, factor, permeability)
        if links == 1:  # an edge has two ends
            total += resistance(state, ends[first, 1], delta, factor, permeability)
            parts = 2
        for c in range(first, first + links):
            channels[c, flowing.CONDUCT] *= parts / total
            channels[c, flowing.WEIGHT] = weight(state, ends[c, 0], ends[c, 1], heavier)


def kozeny_carman(limit: float, size: float) -> float:
    """Permeability [m2] of a pack of this concentration and diameter of grains [m]: phi^3 d^2 / (180 (1 - phi)^2)."""
    return (1.0 - limit) ** 3 * size * size / (180.0 * limit * limit)

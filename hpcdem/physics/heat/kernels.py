"""The loops of heat beside those of any field in elements (physics/field): where faces touch, and fluid in channels."""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def touching(first, second, start, free, element, cells, where, x, h, near, deep, wide, corner, weight, pass_on):
    """Return where faces of bodies touch: how many places, and as many rows of the rest as there are.

    first, second (m,): pairs of bodies; start, free, element (bodies,): see pairs.Bodies; h (rows,) [W/(m2 K)]:
    transfer coefficients of the elements held here, of two bodies in contact the harmonic mean of both. Faces that look
    against each other pass heat on where their distance is at most `near` [m], their overlap at most `deep` [m]; half
    of that length at each of its ends, where corner (n, 4) in t, flat, of `wide` columns, with weight (n, 4), negative
    on the second face, give the difference of temperature; pass_on (n,) [W/(m K)].
    """
    n = 0
    for p in range(len(first)):
        one, two = first[p], second[p]
        e, f = element[one], element[two]
        i, j = where[e], where[f]
        if h[i] <= 0.0 or h[j] <= 0.0:
            continue
        mean = 2.0 * h[i] * h[j] / (h[i] + h[j])
        corners, others = 4 if cells[e, 3] >= 0 else 3, 4 if cells[f, 3] >= 0 else 3
        for k in range(3):
            if free[one] >> k & 1 == 0:
                continue
            a, b = (start[one] + k) % corners, (start[one] + (k + 1) % 3) % corners
            ax, ay, wx, wy = x[i, 2 * a], x[i, 2 * a + 1], x[i, 2 * b] - x[i, 2 * a], x[i, 2 * b + 1] - x[i, 2 * a + 1]
            h2 = wx * wx + wy * wy
            length = math.sqrt(h2)
            for m in range(3):
                if free[two] >> m & 1 == 0:
                    continue
                c, d = (start[two] + m) % others, (start[two] + (m + 1) % 3) % others
                cx, cy, dx, dy = x[j, 2 * c] - ax, x[j, 2 * c + 1] - ay, x[j, 2 * d] - ax, x[j, 2 * d + 1] - ay
                vx, vy = dx - cx, dy - cy
                if 2.0 * (wx * vx + wy * vy) > -length * math.sqrt(vx * vx + vy * vy):
                    continue
                # Places of d and c along the first face, and how far they are outside of it.
                sd, sc = (dx * wx + dy * wy) / h2, (cx * wx + cy * wy) / h2
                gd, gc = (dx * wy - dy * wx) / length, (cx * wy - cy * wx) / length
                low, high = max(0.0, sd), min(1.0, sc)
                rise = (gc - gd) / (sc - sd)
                for limit, sign in ((near, 1.0), (deep, -1.0)):
                    over = limit - sign * (gd - rise * sd)
                    slope = sign * rise
                    if slope > 0.0:
                        high = min(high, over / slope)
                    elif slope < 0.0:
                        low = max(low, over / slope)
                    elif over < 0.0:
                        high = low
                if not high > low:
                    continue
                for end in range(2):
                    if n < len(pass_on):
                        s = low if end == 0 else high
                        u = (s - sd) / (sc - sd)  # from d to c
                        corner[n, 0], corner[n, 1], corner[n, 2], corner[n, 3] = (
                            wide * i + a, wide * i + b, wide * j + d, wide * j + c,
                        )  # fmt: skip
                        weight[n, 0], weight[n, 1], weight[n, 2], weight[n, 3] = 1.0 - s, s, u - 1.0, -u
                        pass_on[n] = 0.5 * mean * length * (high - low)
                    n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def through_contacts(corner, weight, pass_on, t, q):
    """Add the heat that passes from face to face where they touch, see `touching`; the first half of the corners are
    those of the first face; t, q: flat."""
    many = corner.shape[1]
    half = many // 2
    for n in range(len(pass_on)):
        here = there = 0.0
        for k in range(half):
            here += weight[n, k] * t[corner[n, k]]
            there += weight[n, half + k] * t[corner[n, half + k]]
        apart = here + there
        for k in range(many):
            q[corner[n, k]] -= pass_on[n] * weight[n, k] * apart


# ---- fluid in channels -----------------------------------------------------------------------------------------------

# Columns of flow nodes: temperature; saturation, and the part of the exchange with walls that goes with it; the
# temperature of what flows in, by its rate, and how far that comes from [m]; their fluid [m2]; how fast they get warmer
# by other heat than what flows in [K/s].
T, S, X, U, FROM, FULL, RISE = range(7)
FLUID_STATE = 7
LITTLE_MORE = 1.0 + 1e-6
"""Rounding of what nodes leak, a difference of sums, over what the balance of a node says."""


@njit(cache=True, nogil=True, error_model="numpy")
def upstream(begin, channel, side, ends, q, length, held, own, state):
    """Columns U and FROM of own nodes (n, k); where nothing flows in they are the node's own and 1, or where it is held
    0; held (n,): -1: free."""
    for i in range(len(own)):
        total = heat = way = 0.0
        for m in range(begin[i], begin[i + 1]):
            c = channel[m]
            into = side[m] * q[c]
            if into > 0.0:
                total += into
                heat += into * state[ends[c, 0 if side[m] > 0.0 else 1], T]
                way += into * length[c]
        own[i, U], own[i, FROM] = own[i, T], 1.0 if held[i] < 0 else 0.0
        if total > 0.0:
            own[i, U], own[i, FROM] = heat / total, way / total


@njit(cache=True, nogil=True, error_model="numpy")
def rises(begin, channel, side, ends, conduct, walls, exchange, t, held, rho_c, own, state):
    """Column RISE of own nodes (n, k), see `carry`; 0 where they are held or dry."""
    for i in range(len(own)):
        got, capacity = 0.0, rho_c * own[i, FULL]
        for m in range(begin[i], begin[i + 1]):
            c, end = channel[m], 0 if side[m] < 0.0 else 1
            got += conduct[c] * (state[ends[c, 1 - end], T] - own[i, T])
            for k in range(2 * end, 2 * end + 2):
                got += exchange[c] * own[i, X] * (t[walls[c, k]] - own[i, T])
        own[i, RISE] = got / capacity if held[i] < 0 and capacity > 0.0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def faces(ends, q, length, second, dt, state, out):
    """Temperatures out (m,) of what flows in channels, q (m,) [m2/s]: that of the node upstream (first order), or with
    the slope that the limiter of van Leer (1974) leaves, in the middle of dt [s], between those of both ends (second
    order). From a held node into which nothing flows, that of the middle of the channel: a front begins at the node."""
    for c in range(len(ends)):
        up, down = (ends[c, 0], ends[c, 1]) if q[c] > 0.0 else (ends[c, 1], ends[c, 0])
        value = state[up, T]
        out[c] = value
        rise = state[down, T] - value
        if second and rise != 0.0 and q[c] != 0.0 and state[up, FULL] > 0.0:
            if state[up, FROM] == 0.0:
                later = 0.5 * rise
                if state[down, FULL] > 0.0:
                    later += 0.25 * dt * (state[down, RISE] - abs(q[c]) / state[down, FULL] * rise)
                out[c] = value + (min(max(later, 0.0), rise) if rise > 0.0 else max(min(later, 0.0), rise))
                continue
            r = (value - state[up, U]) / state[up, FROM] * length[c] / rise
            if r > 0.0:
                beyond = r / (1.0 + r) * rise
                later = beyond * (1.0 - dt * abs(q[c]) / state[up, FULL]) + 0.5 * dt * state[up, RISE]
                out[c] = value + (min(max(later, 0.0), beyond) if rise > 0.0 else max(min(later, 0.0), beyond))


@njit(cache=True, nogil=True, error_model="numpy")
def carry(
    dt, begin, channel, side, ends, q, face, conduct, walls, exchange, t, held, table, before, after, leaked, rho_c,
    state, out, given,
):  # fmt: skip
    """Temperatures out (n,) of own flow nodes after dt [s], with fluid before, after, and leaked to the rock (n,) [m2]
    of heat capacity rho_c [J/(m3 K)]; the walls (m, 4) in t, flat, two at each end, count with the new temperature of
    the node, and so does what leaks: a node that hands all that comes to the rock stays between the temperatures
    around it. A node that more passes than it holds has the temperature of that; the heat that it lacks, as good as
    none, counts as given.

    face (m,): temperatures of what flows; conduct, exchange (m,) [W/(m K)]; held (n,): row of the table of prescribed
    temperatures, -1: free; given (n,) [J/m]: heat by conditions is booked.
    """
    for i in range(len(out)):
        old = state[i, T]
        net = comes = carried = conducts = conducted = wall = passes = 0.0
        for m in range(begin[i], begin[i + 1]):
            c, end = channel[m], 0 if side[m] < 0.0 else 1
            into = side[m] * q[c]
            net += into
            comes += max(into, 0.0)
            carried += into * (face[c] - old)
            conducts += max(conduct[c], 0.0)
            conducted += conduct[c] * (state[ends[c, 1 - end], T] - old)
            a = exchange[c] * state[i, X]
            for k in range(2 * end, 2 * end + 2):
                passes += a
                wall += a * (t[walls[c, k]] - old)
        came = (after[i] - before[i]) - dt * net
        gone = min(max(-came, 0.0), LITTLE_MORE * leaked[i])  # it mixes with what flows in before it goes
        capacity = rho_c * after[i]
        new, whole = old, rho_c * (after[i] + gone) + dt * passes
        most = dt * (rho_c * comes + conducts + passes)
        scant = most > LITTLE_MORE * whole
        if held[i] >= 0 or scant:
            new = old + dt * (rho_c * carried + conducted + wall) / most if held[i] < 0 else table[held[i]]
            brought = rho_c * old * came
            brought += capacity * (new - old) - dt * (rho_c * carried + conducted + wall - passes * (new - old))
        else:
            if whole > 0.0:
                new = old + dt * (rho_c * carried + conducted + wall) / whole
            brought = rho_c * old * (came + gone) - rho_c * gone * new
        given[i] += brought
        out[i] = new


@njit(cache=True, nogil=True, error_model="numpy")
def to_walls(share, ends, walls, exchange, t, state, out):
    """Add this share of what flows from the fluid to the walls (m, 4) at each end of channels [W/m]."""
    for c in range(len(ends)):
        for k in range(4):
            if walls[c, k] >= 0:
                node = ends[c, k // 2]
                out[c, k] += share * exchange[c] * state[node, X] * (state[node, T] - t[walls[c, k]])


@njit(cache=True, nogil=True, error_model="numpy")
def from_walls(walls, heat, q):
    """Add the heat (m, 4) [W/m] of walls to that of their corners q, flat."""
    for c in range(len(walls)):
        for k in range(4):
            if walls[c, k] >= 0:
                q[walls[c, k]] += heat[c, k]

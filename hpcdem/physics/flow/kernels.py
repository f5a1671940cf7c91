"""The arithmetic of flow in channels: apertures, flows, volumes and pressures of nodes, loads on faces.

What flows goes along links (network.py): in the plane each channel is one, in space three, and each row of the table of
"channels" is that of a link. A link may have a negative conductance, opposite an obtuse angle.

Node state (n, 3): pressure [Pa], saturation, and potential energy of the fluid per volume by its height, -rho g . x
[Pa]. Flows are those of the manual, 7.5.1, with its slips corrected; nodes keep the volume of their fluid at reference
density W, so that what flows out of one flows into another: p = K (W / V - 1), or s = W / V where that is below 1.
"""

from __future__ import annotations

import math

from numba import njit, prange

from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.fdem.kernels import joints, joints_space

P, S, E = range(3)
STATE = 3
# Columns of the table of channel laws (rows, 8); FRONT: 1 where leak-off fills empty pores, else 0.
INITIAL, LEAST, MOST, LEAK, PORE, DILATE, GAIN, FRONT = range(8)
LAW = 8
# What is prescribed at nodes.
FREE, PRESSURE, SURFACE, RATE = range(4)
# Columns of the table of channels (m, 4) of `geometry`; the last: weight of what flows over that of the fluid alone.
APERTURE, CONDUCT, HALF, WEIGHT = range(4)
CHANNEL = 4
# Columns of nodes (n, 6): fluid, room for it, and what came and went [m2]; by conditions in the last sub-step [m2/s].
W, V, GIVEN, LEAKED, REMOVED, INFLOW = range(6)
NODE = 6
STEEPEST = 1.125
"""Largest f(s) / s of `part`."""
TURBULENT = (96.0 / 0.3164) ** (4.0 / 3.0)
"""Reynolds number, of twice the aperture, from which flow is turbulent: there 96 / Re of plates is what Blasius' 0.3164
Re^-1/4 is, 2039."""


@njit(cache=True, error_model="numpy")
def part(s):
    """Part of the transmissivity at a saturation (81)."""
    return s * s * (3.0 - 2.0 * s)


@njit(error_model="numpy", forceinline=True)
def _edge(x, one, other, k):
    """Length, mean opening, size of the mean slip, of an edge."""
    a, b, p, q = one[k, 0], one[k, 1], other[k, 0], other[k, 1]  # p is opposite b
    _, _, h2, oa, sa, ob, sb = joints.openings(x[a], x[a + 1], x[b], x[b + 1], x[p], x[p + 1], x[q], x[q + 1])
    h = math.sqrt(h2)
    return h, 0.5 * (oa + ob) / h, abs(0.5 * (sa + sb) / h)


@njit(error_model="numpy", forceinline=True)
def _triangle(x, one, other, k):
    """Area, mean opening, size of the mean slip, of the present mid-surface of a triangle, and the cotangents of its
    angles."""
    a, b, c = one[k, 0], one[k, 1], one[k, 2]
    p, q, r = other[k, 0], other[k, 1], other[k, 2]  # p is opposite a, r opposite b, q opposite c
    nx, ny, nz, area, d0x, d0y, d0z, d1x, d1y, d1z, d2x, d2y, d2z = joints_space.opened(
        x[a], x[a + 1], x[a + 2], x[b], x[b + 1], x[b + 2], x[c], x[c + 1], x[c + 2], x[p], x[p + 1], x[p + 2],
        x[q], x[q + 1], x[q + 2], x[r], x[r + 1], x[r + 2],
    )  # fmt: skip
    opening, _, _, _, slip = joints_space.parted(
        (d0x + (d1x + d2x)) / 3.0, (d0y + (d1y + d2y)) / 3.0, (d0z + (d1z + d2z)) / 3.0, nx, ny, nz
    )
    mx, my, mz = x[a] + x[p], x[a + 1] + x[p + 1], x[a + 2] + x[p + 2]
    ux, uy, uz = x[b] + x[r] - mx, x[b + 1] + x[r + 1] - my, x[b + 2] + x[r + 2] - mz
    wx, wy, wz = x[c] + x[q] - mx, x[c + 1] + x[q + 1] - my, x[c + 2] + x[q + 2] - mz
    ux, uy, uz, wx, wy, wz = 0.5 * ux, 0.5 * uy, 0.5 * uz, 0.5 * wx, 0.5 * wy, 0.5 * wz
    vx, vy, vz = wx - ux, wy - uy, wz - uz
    cot_a, cot_b = ux * wx + (uy * wy + uz * wz), -ux * vx + (-uy * vy + -uz * vz)
    cot_c = wx * vx + (wy * vy + wz * vz)
    return area, opening, slip, cot_a / (2.0 * area), cot_b / (2.0 * area), cot_c / (2.0 * area)


@njit(error_model="numpy", forceinline=True)
def _aperture(laws, row, opening, slip):
    gain = min(laws[row, DILATE] * slip, laws[row, GAIN])
    return min(max(laws[row, INITIAL] + opening + gain, laws[row, LEAST]), laws[row, MOST])


@njit(cache=True, nogil=True, error_model="numpy")
def _geometry(t, threads, one, other, law, laws, x, viscosity, out):
    x, n = x.reshape(x.size), len(one)
    first, last = n * t // threads, n * (t + 1) // threads
    if one.shape[1] == 2:
        for c in range(first, last):
            h, opening, slip = _edge(x, one, other, c)
            delta = _aperture(laws, law[c], opening, slip)
            out[c, APERTURE], out[c, HALF], out[c, WEIGHT] = delta, 0.5 * delta * h, 1.0
            out[c, CONDUCT] = delta * delta * delta / (12.0 * viscosity * h)
        return
    for k in range(first, last):
        area, opening, slip, cot_a, cot_b, cot_c = _triangle(x, one, other, k)
        c = 3 * k
        delta = _aperture(laws, law[c], opening, slip)
        for m in range(c, c + 3):
            out[m, APERTURE], out[m, HALF], out[m, WEIGHT] = delta, delta * area / 6.0, 1.0
        over = delta * delta * delta / (24.0 * viscosity)
        out[c, CONDUCT], out[c + 1, CONDUCT], out[c + 2, CONDUCT] = over * cot_a, over * cot_b, over * cot_c


@on_threads
def geometry(threads, *args):
    """Aperture [m] (79) with what slip adds, conductance [m2 / (Pa s)] and half of the volume [m2] of the links of
    channels, out (l, 4), in space [m3 / (Pa s)] and [m3]. one, other (m, dim): where the corners of both faces begin in
    x; law (l,): rows of laws; viscosity: dynamic [Pa s].

    An edge is one link, delta^3 / (12 mu L). Pressure is linear over a triangle, so what flows to its corners, -q . n s
    / 2 each (the manual's 7.5.1), is the sum of what goes along its sides, three links of a third of its area each:
    delta^3 cot(angle opposite) / (24 mu)."""
    for t in prange(threads):
        _geometry(t, threads, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def slowness(links, ends, channels, density, state, out):
    """Flow over that of the cubic law, out (m,), 1 where it is laminar, by the heads at the ends of links (m, 2).

    Darcy and Weisbach: the head falls by f rho v^2 / (4 delta), f = 96 / Re, from `TURBULENT` on Blasius' (1913). With
    the Reynolds number R that the cubic law would give, 96 R = f Re^2, so Re / R = (TURBULENT / R)^(3/7). links: of
    each channel, network.LINKS; in space the size of the gradient is that of the triangle. density [kg/m3]: of the
    fluid; that of a slurry follows from its weight, viscosities from conductances.
    """
    for first in range(0, len(ends), links):
        delta = channels[first, APERTURE]
        power = pairs = weight = 0.0
        for c in range(first, first + links):
            a, b = ends[c, 0], ends[c, 1]
            head = (state[a, P] - state[b, P]) + (state[a, E] - state[b, E]) * channels[c, WEIGHT]
            power += channels[c, CONDUCT] * head * head
            pairs += channels[c, CONDUCT] * channels[first + (c - first + 1) % links, CONDUCT]
            weight += channels[c, WEIGHT] / links
        if links == 1:
            size = 2.0 * channels[first, HALF] / delta  # L
            over = channels[first, CONDUCT] * size  # delta^3 / (12 mu)
        else:
            # Cotangents of a triangle: the sum of their products by pairs is 1, that of cot h^2 is 2 A |grad h|^2.
            size = 6.0 * channels[first, HALF] / delta  # A
            over = 2.0 * math.sqrt(max(pairs, 0.0))
        q = math.sqrt(max(over * power / size, 0.0))
        reynolds = 2.0 * density * weight * q * over * 12.0 / (delta * delta * delta)
        factor = (TURBULENT / reynolds) ** (3.0 / 7.0) if reynolds > TURBULENT else 1.0
        for c in range(first, first + links):
            out[c] = factor


@njit(cache=True, nogil=True, error_model="numpy")
def volumes(begin, channel, channels, nodes):
    """Room for fluid of the owned nodes [m2]: halves of their channels."""
    for i in range(len(nodes)):
        v = 0.0
        for m in range(begin[i], begin[i + 1]):
            v += channels[channel[m], HALF]
        nodes[i, V] = v


@njit(cache=True, nogil=True, error_model="numpy")
def longest_step(begin, channel, ends, channels, nodes, state, bulk):
    """Half of what is stable [s]: the least V / (sum of conductances (K + rise of f |dE|)) of the owned nodes."""
    least = math.inf
    for i in range(len(nodes)):
        k = 0.0
        for m in range(begin[i], begin[i + 1]):
            c = channel[m]
            rise = abs(state[ends[c, 0], E] - state[ends[c, 1], E]) * channels[c, WEIGHT]
            k += abs(channels[c, CONDUCT]) * (bulk + STEEPEST * rise)
        if k > 0.0:
            least = min(least, 0.5 * nodes[i, V] / k)
    return least


@njit(cache=True, error_model="numpy")
def _along(c, ends, channels, state):
    """Return the flow in a channel from its first end on."""
    a, b = ends[c, 0], ends[c, 1]
    head = (state[a, P] - state[b, P]) + (state[a, E] - state[b, E]) * channels[c, WEIGHT]
    s = 0.5 * (state[a, S] + state[b, S])
    up = state[a, S] if (head > 0.0) == (channels[c, CONDUCT] > 0.0) else state[b, S]
    return channels[c, CONDUCT] * part(min(s, up)) * head


@njit(cache=True, error_model="numpy")
def _leaking(c, ends, row, began, before, after, channels, state):
    """Return the leak-off of each end of a channel in a sub-step."""
    a, b = ends[c, 0], ends[c, 1]
    over = 0.5 * (state[a, P] + state[b, P]) - row[PORE]
    if over > 0.0 and row[LEAK] > 0.0 and began <= before:
        length = 2.0 * channels[c, HALF] / channels[c, APERTURE]  # in space an area
        roots = math.sqrt(after - began) - math.sqrt(before - began)
        drive = math.sqrt(over) if row[FRONT] > 0.0 else over
        s = 0.5 * (state[a, S] + state[b, S])
        return 2.0 * part(s) * row[LEAK] * drive * length * roots  # half of both walls, to each end
    return 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _flows(t, threads, ends, law, laws, since, leaks, before, after, channels, state, q, lost):
    n = len(ends)
    for c in range(n * t // threads, n * (t + 1) // threads):
        q[c] = _along(c, ends, channels, state)
        if leaks:
            lost[c] = _leaking(c, ends, laws[law[c]], since[c], before, after, channels, state)


@on_threads
def flows(threads, *args):
    """Flow q (m,) [m2/s] from the first to the last end of channels, and what each end loses to the rock in a sub-step
    lost (m,) [m2], by the state of their ends (m, 2).

    The saturation in `part` is the mean of both ends, at most that of the end that it flows from: dry nodes give
    nothing away. since (m,) [s]: when leak-off began (inf: it has not); before, after: times of the sub-step.
    """
    for t in prange(threads):
        _flows(t, threads, *args)


@njit(cache=True, error_model="numpy")
def _take(i, into, leaks, gone, dt, condition, table, bulk, nodes, state):
    """A sub-step of a node: `into` [m2/s] comes, `gone` [m2] leaks away."""
    w, v = nodes[i, W] + dt * into, nodes[i, V]
    if leaks:
        gone = min(gone, max(w, 0.0))
        w -= gone
        nodes[i, LEAKED] += gone
    does, value = table[condition[i], 0], table[condition[i], 1]
    if does == FREE:
        nodes[i, INFLOW] = 0.0
    else:
        if does == RATE:
            more = max(dt * value, -max(w, 0.0))
        else:
            p = value - state[i, E] if does == SURFACE else value
            if does == PRESSURE or p > 0.0:
                more = v * (1.0 + p / bulk) - w
            else:
                more = min(v - w, 0.0)
        w += more
        nodes[i, GIVEN] += more
        nodes[i, INFLOW] = more / dt
    nodes[i, W] = w
    if w >= v:
        state[i, P], state[i, S] = bulk * ((w - v) / v), 1.0
    else:
        state[i, P], state[i, S] = 0.0, w / v


@njit(cache=True, nogil=True, error_model="numpy")
def sub_step(
    ends, law, laws, since, leaks, before, after, channels, q, lost, into, gone, dt, condition, table, bulk, nodes,
    state,
):  # fmt: skip
    """A sub-step dt [s] of the owned nodes: their fluid, pressure and saturation after what flows in channels and leaks
    away, as in `flows`. into, gone (n,): what comes to all nodes, copies too [m2/s], and leaks from them [m2].

    condition (nodes,): row of the table (rows, 2) of what is prescribed and its value: pressure [Pa]; energy of the
    surface [Pa]: hydrostatic below it, above it fluid can leave (a seepage face); rate [m2/s], as far as there is fluid
    to take. One pass over the channels: a node's sum is in the order of channels, as in `fill`.
    """
    into[:] = 0.0
    if leaks:
        gone[:] = 0.0
    for c in range(len(ends)):
        a, b = ends[c, 0], ends[c, 1]
        flow = _along(c, ends, channels, state)
        q[c] = flow
        into[a] -= flow
        into[b] += flow
        if leaks:
            leak = _leaking(c, ends, laws[law[c]], since[c], before, after, channels, state)
            lost[c] = leak
            gone[a] += leak
            gone[b] += leak
    for i in range(len(nodes)):
        _take(i, into[i], leaks, gone[i], dt, condition, table, bulk, nodes, state)


@njit(cache=True, nogil=True, error_model="numpy")
def _fill(t, threads, begin, channel, side, q, leaks, lost, dt, condition, table, bulk, nodes, state):
    n = len(nodes)
    for i in range(n * t // threads, n * (t + 1) // threads):
        into = gone = 0.0
        for m in range(begin[i], begin[i + 1]):
            into += side[m] * q[channel[m]]
            if leaks:
                gone += lost[channel[m]]
        _take(i, into, leaks, gone, dt, condition, table, bulk, nodes, state)


@on_threads
def fill(threads, *args):
    """Update the nodes as `sub_step` does after `flows`, on several threads. begin (n + 1,), channel, side (k,): see
    network.at_nodes."""
    for t in prange(threads):
        _fill(t, threads, *args)


@njit(cache=True, nogil=True, error_model="numpy")
def loads(at, to, nodes, g, e, x, state, column, applied):
    """Add the pressure on faces, a column of state, to what is applied to corners [N/m], in space [N]: linear between
    the nodes (k, dim), L (2 p1 + p2) / 6 or A (2 p1 + p2 + p3) / 12 on the first. at, to (k, dim): where corners begin
    in x, and in `applied` (flat).

    Of halves of sides of hexahedra, whose opening is bilinear (fdem/kernels/joints_hexes.py), to (k, 4) has the corner
    that only the other half has at the end, g (k, 4) and e (k, 3) share the pressure out; of other faces they have no
    rows.
    """
    x, applied = x.reshape(x.size), applied.reshape(applied.size)
    edges, bilinear = nodes.shape[1] == 2, to.shape[1] == 4
    for m in range(len(at)):
        a, b = at[m, 0], at[m, 1]
        ux, uy = x[b] - x[a], x[b + 1] - x[a + 1]
        p, q = state[nodes[m, 0], column], state[nodes[m, 1], column]
        if edges:
            first, last, i, j = (2.0 * p + q) / 6.0, (p + 2.0 * q) / 6.0, to[m, 0], to[m, 1]
            applied[i] -= first * uy  # outward, as long as the face
            applied[i + 1] += first * ux
            applied[j] -= last * uy
            applied[j + 1] += last * ux
            continue
        c, r = at[m, 2], state[nodes[m, 2], column]
        uz, wx, wy, wz = x[b + 2] - x[a + 2], x[c] - x[a], x[c + 1] - x[a + 1], x[c + 2] - x[a + 2]
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx  # 2 A n, outward
        total, back = p + (q + r), 0.0
        if bilinear:
            for k in range(3):
                back += e[m, k] * ((total + state[nodes[m, k], column]) / 24.0)
        for k in range(3):
            push, corner = (total + state[nodes[m, k], column]) / 24.0, to[m, k]
            if bilinear:
                push -= g[m, k] * back
            applied[corner] -= push * nx
            applied[corner + 1] -= push * ny
            applied[corner + 2] -= push * nz
        if bilinear:
            push, corner = g[m, 3] * back, to[m, 3]
            applied[corner] += push * nx
            applied[corner + 1] += push * ny
            applied[corner + 2] += push * nz

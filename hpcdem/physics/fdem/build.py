"""The tables of the kernels for the elements that a rank holds, made from the definition at a rebuild."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.physics.fdem.kernels import joints
from hpcdem.physics.fdem.kernels.elements import (
    ETA,
    INVERSE,
    LAMBDA,
    PARTS,
    Q_AREA,
    Q_ETA,
    Q_INVERSE,
    Q_LAMBDA,
    Q_TWO_MU,
    Q_WEIGHT,
    TWO_MU,
    WEIGHT,
    quad_energy,
    quad_stress,
    triangle_energy,
    triangle_stress,
)
from hpcdem.physics.fdem.kernels.joints import INTACT, NONE

# Columns of the table of element models (rows, 5).
RHO, LAME, MU2, YOUNG, DAMP = range(5)


@njit(cache=True, nogil=True, error_model="numpy")
def middles(x, cells, number, out):
    """Means of the corners (n, 2) [m] and the largest distance of a corner from it."""
    far2 = 0.0
    for i in range(len(number)):
        n = 4 if cells[number[i], 3] >= 0 else 3
        cx = cy = 0.0
        for k in range(n):
            cx += x[i, 2 * k]
            cy += x[i, 2 * k + 1]
        cx, cy = cx / n, cy / n
        out[i, 0], out[i, 1] = cx, cy
        for k in range(n):
            far2 = max(far2, (x[i, 2 * k] - cx) ** 2 + (x[i, 2 * k + 1] - cy) ** 2)
    return math.sqrt(far2)


@njit(cache=True, nogil=True, error_model="numpy")
def corners(points, cells, number, x):
    """Rows of x as the mesh has them; see elements.py for the layout."""
    wide = x.shape[1] == 12
    for i in range(len(number)):
        e = number[i]
        n = 4 if cells[e, 3] >= 0 else 3
        x[i] = 0.0
        for k in range(n):
            x[i, 2 * k], x[i, 2 * k + 1] = points[cells[e, k], 0], points[cells[e, k], 1]
        for k in range(2 if wide else 1):
            x[i, 2 * (n + k)], x[i, 2 * (n + k) + 1] = points[cells[e, k], 0], points[cells[e, k], 1]


@njit(cache=True, nogil=True, error_model="numpy")
def _inverse(points, a, b, c):
    """Inverse of [b - a, c - a] by rows, and the area."""
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    wx, wy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    det = ux * wy - uy * wx
    return wy / det, -wx / det, -uy / det, ux / det, 0.5 * det


@njit(cache=True, nogil=True, error_model="numpy")
def _length(points, cells, e, n):
    """Mean length of an edge."""
    total = 0.0
    for k in range(n):
        p, q = cells[e, k], cells[e, (k + 1) % n]
        total += math.sqrt((points[p, 0] - points[q, 0]) ** 2 + (points[p, 1] - points[q, 1]) ** 2)
    return total / n


@njit(cache=True, nogil=True, error_model="numpy")
def _part(points, cells, e, p):
    return _inverse(points, cells[e, PARTS[p, 0]], cells[e, PARTS[p, 1]], cells[e, PARTS[p, 2]])


@njit(cache=True, nogil=True, error_model="numpy")
def masses(number, points, cells, row, models, mass):
    """True masses (n, 4) [kg/m] of the corners: a third of a triangle, of a quad the mean of its two overlays."""
    for i in range(len(number)):
        e = number[i]
        rho = models[row[e], RHO]
        mass[i] = 0.0
        if cells[e, 3] < 0:
            mass[i, :3] = rho * _inverse(points, cells[e, 0], cells[e, 1], cells[e, 2])[4] / 3.0
        else:
            for p in range(4):
                area = _part(points, cells, e, p)[4]
                for q in range(3):
                    mass[i, PARTS[p, q]] += rho * area / 6.0


@njit(cache=True, nogil=True, error_model="numpy")
def constants(number, points, cells, row, models, viscous, triangle_rows, quad_rows, mass, c, q):
    """Rows of the tables of triangles and quads (elements.py), all but the kicks. triangle_rows, quad_rows: storage
    rows; mass (n, 4)."""
    for i in range(len(triangle_rows)):
        r = triangle_rows[i]
        e = number[r]
        m = models[row[e]]
        one, two, three, four, _ = _inverse(points, cells[e, 0], cells[e, 1], cells[e, 2])
        c[i, INVERSE], c[i, INVERSE + 1], c[i, INVERSE + 2], c[i, INVERSE + 3] = one, two, three, four
        c[i, LAMBDA], c[i, TWO_MU], c[i, WEIGHT] = m[LAME], m[MU2], mass[r, 0]
        c[i, ETA] = m[DAMP] * 2.0 * _length(points, cells, e, 3) * math.sqrt(m[RHO] * m[YOUNG]) if viscous else 0.0
    for i in range(len(quad_rows)):
        r = quad_rows[i]
        e = number[r]
        m = models[row[e]]
        for p in range(4):
            one, two, three, four, area = _part(points, cells, e, p)
            at = Q_INVERSE + 4 * p
            q[i, at], q[i, at + 1], q[i, at + 2], q[i, at + 3] = one, two, three, four
            q[i, Q_AREA + p] = area
            q[i, Q_WEIGHT + p] = mass[r, p]
        q[i, Q_LAMBDA], q[i, Q_TWO_MU] = m[LAME], m[MU2]
        q[i, Q_ETA] = m[DAMP] * 2.0 * _length(points, cells, e, 4) * math.sqrt(m[RHO] * m[YOUNG]) if viscous else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def links(number, rows, n, first, width, where, partner, closed, joint_row, face, at, law, kind, state):
    """Edges of elements of n edges in the given storage rows, into slots first, first + 1, ...

    face (slots,): the face of each slot; at: where the partner's edge begins in x, else where the own one does. Returns
    a face whose partner is not held by this rank though a joint ties them, or -1.
    """
    lost = np.int64(-1)
    for i in range(len(rows)):
        r = rows[i]
        for k in range(n):
            slot = first + n * i + k
            f = 4 * number[r] + k
            face[slot] = f
            at[slot] = r * width + 2 * k
            law[slot] = kind[slot] = 0
            state[slot] = NONE
            if not closed[f] or joint_row[f] == 0:
                continue
            g = partner[f]
            over = where[g // 4]
            if over < 0:
                lost = f
                continue
            at[slot] = over * width + 2 * (g % 4)
            law[slot] = kind[slot] = joint_row[f]
            state[slot] = INTACT
    return lost


@njit(cache=True, nogil=True, error_model="numpy")
def cluster_members(node, sizes, begin, member):
    """Corners (element * 4 + k) of the nodes with more than one, ascending: those of node i are member[begin[i]] ...

    begin (nn + 1,): zero rows for nodes with one corner.
    """
    for i in range(len(sizes)):
        begin[i + 1] = begin[i] + (sizes[i] if sizes[i] > 1 else 0)
    filled = begin[:-1].copy()
    for c in range(node.size):
        i = node[c // 4, c % 4]
        if i >= 0 and sizes[i] > 1:
            member[filled[i]] = c
            filled[i] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def special_nodes(number, n_left, n_own, corner_special, node, begin, low, local, corner_of, start, one):
    """Nodes of the owned special corners (n_own, 4) bool, each once, in storage order; returns their number.

    local i4, all -1, for the nodes from `low` on, is used and handed back so. corner_of: corner (element * 4 + k) by
    which the node was found, start: where its members begin in `member`, or -1 for a node of one corner; with arrays of
    length 0 only counted.
    """
    n = 0
    write = len(corner_of) > 0
    for i in range(n_own):
        e = number[n_left + i]
        for k in range(4):
            if not corner_special[i, k]:
                continue
            j = node[e, k]
            if local[j - low] >= 0:
                continue
            local[j - low] = n
            if write:
                corner_of[n] = 4 * e + k
                start[n] = begin[j] if begin[j + 1] > begin[j] else -1
                one[n] = begin[j + 1] - begin[j] if begin[j + 1] > begin[j] else 1
            n += 1
    for i in range(n_own):
        e = number[n_left + i]
        for k in range(4):
            if corner_special[i, k]:
                local[node[e, k] - low] = -1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def place_nodes(corner_of, start, one, member, where, cells, width, force_width, stride, begin, corner, place, again):
    """Find the positions of the corners of special nodes in the tables: in the forces (n, force_width), in v (n,
    width), a second position in v, or -1; stride: words from one corner of a row to the next.

    Returns a corner c whose element is not held by this rank, or -1; its position in the forces is -1 - c.
    """
    lost = np.int64(-1)
    for i in range(len(corner_of)):
        begin[i + 1] = begin[i] + one[i]
        for m in range(one[i]):
            c = corner_of[i] if start[i] < 0 else member[start[i] + m]
            r, k = where[c // 4], c % 4
            at = begin[i] + m
            if r < 0:
                lost = c
                corner[at], place[at], again[at] = -1 - c, 0, -1
                continue
            n = 4 if cells[c // 4, 3] >= 0 else 3
            corner[at], place[at], again[at] = force_width * r + stride * k, width * r + stride * k, -1
            if width == 12 and k < 2:
                again[at] = width * r + 2 * (n + k)
    return lost


@njit(cache=True, nogil=True, error_model="numpy")
def weigh(begin, corner, stride, mass, out):
    """Masses of special nodes, sums of those of their corners: mass (4 n,), of which corner / stride is that of a
    corner."""
    for i in range(len(out)):
        total = 0.0
        for m in range(begin[i], begin[i + 1]):
            total += mass[corner[m] // stride]
        out[i] = total


@njit(cache=True, nogil=True, error_model="numpy")
def survey(x, v, origin, first, n_own, cells, number, out):
    """Largest path since the lists were built squared, speed squared, 1 if a number is not finite, 1 if an element is
    turned inside out. All are maxima. origin (n_own, w)."""
    path2 = speed2 = broken = inverted = 0.0
    for i in range(n_own):
        r = first + i
        n = 4 if cells[number[r], 3] >= 0 else 3
        for k in range(n):
            dx, dy = x[r, 2 * k] - origin[i, 2 * k], x[r, 2 * k + 1] - origin[i, 2 * k + 1]
            d2 = dx * dx + dy * dy
            v2 = v[r, 2 * k] ** 2 + v[r, 2 * k + 1] ** 2
            if not (d2 < np.inf and v2 < np.inf):
                broken = 1.0
                continue
            path2, speed2 = max(path2, d2), max(speed2, v2)
        ux, uy = x[r, 2] - x[r, 0], x[r, 3] - x[r, 1]
        wx, wy = x[r, 4] - x[r, 0], x[r, 5] - x[r, 1]
        if ux * wy - uy * wx <= 0.0:
            inverted = 1.0
        if n == 4:
            sx, sy = x[r, 6] - x[r, 0], x[r, 7] - x[r, 1]
            if wx * sy - wy * sx <= 0.0:
                inverted = 1.0
    out[0], out[1], out[2], out[3] = path2, speed2, broken, inverted


@njit(cache=True, nogil=True, error_model="numpy")
def longest_link(middle, slots, face, partner, where, state):
    """Largest distance squared between the middles of owned elements and of the partners of their joints [m2]."""
    longest2 = 0.0
    for s in range(slots):
        if state[s] == NONE:
            continue
        a, b = where[face[s] // 4], where[partner[face[s]] // 4]
        d2 = 0.0
        for c in range(middle.shape[1]):
            d2 += (middle[a, c] - middle[b, c]) ** 2
        longest2 = max(longest2, d2)
    return longest2


@njit(cache=True, nogil=True, error_model="numpy")
def edges_now(slots, own, over, per_h, kind, state, history, x, table, beyond, out):
    """Mean opening and slip [m], mean normal and shear stress [Pa], normal (3) and shear (3) stress at the points along
    the edge, and forces on the ends (4) of joints, into out (n, 14); histories stay as they are. Shear as this side
    feels it along its edge."""
    for i in range(len(slots)):
        s, a, b, p, q = slots[i], own[i, 0], own[i, 1], over[i, 0], over[i, 1]
        ax, ay, bx, by, px, py, qx, qy = x[a], x[a + 1], x[b], x[b + 1], x[p], x[p + 1], x[q], x[q + 1]
        tx, ty, s0, s1, s2, t0, t1, t2 = joints.points_now(
            ax, ay, bx, by, px, py, qx, qy, table[kind[s]], beyond[kind[s]], history[s]
        )
        fax, fay, fbx, fby = joints.end_forces(tx, ty, s0, s1, s2, t0, t1, t2)
        _, _, h2, oa, sa, ob, sb = joints.openings(ax, ay, bx, by, px, py, qx, qy)
        h = math.sqrt(h2)
        fx, fy = fax + fbx, fay + fby
        out[i, 0], out[i, 1] = 0.5 * (oa + ob) / h, 0.5 * (sa + sb) / h
        out[i, 2], out[i, 3] = (fx * ty - fy * tx) / h2, (fx * tx + fy * ty) / h2
        out[i, 4], out[i, 5], out[i, 6], out[i, 7], out[i, 8], out[i, 9] = s0, s1, s2, t0, t1, t2
        out[i, 10], out[i, 11], out[i, 12], out[i, 13] = fax, fay, fbx, fby


@njit(cache=True, nogil=True, error_model="numpy")
def stresses(x, triangle_rows, quad_rows, c, q, s0, quad_s0, small, first, stress, energy):
    """Stress (n_own, 4) [Pa] and elastic energy (n_own,) [J/m], or (0,): not wanted, of the owned elements; first:
    storage row of the first; s0 (count, 4), quad_s0 (count, 16) [Pa], see elements.py.

    Energy: (s0 + sigma / 2) : epsilon A, of a quad the mean of its overlays.
    """
    for i in range(len(triangle_rows)):
        r = triangle_rows[i]
        triangle_stress(x[r], c[i], s0[i], small, stress[r - first])
        if len(energy):
            area = 0.5 / (c[i, 0] * c[i, 3] - c[i, 1] * c[i, 2])
            energy[r - first] = area * triangle_energy(x[r], c[i], s0[i], small)
    for i in range(len(quad_rows)):
        r = quad_rows[i]
        quad_stress(x[r, :8], q[i], quad_s0[i], small, stress[r - first])
        if len(energy):
            energy[r - first] = quad_energy(x[r], q[i], quad_s0[i], small)


@njit(cache=True, nogil=True, error_model="numpy")
def relink(state, slots, each, lists, head, follow):
    """Make the lists of joints past their peak, `lists` of them for each block of `each` slots, from their states
    (slots,)."""
    for b in range(len(head)):
        head[b] = -1
    for s in range(slots):
        if state[s] > INTACT:
            b = lists * (s // each) + s % lists
            follow[s], head[b] = head[b], s

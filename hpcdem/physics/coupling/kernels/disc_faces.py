"""Contact of discs with the free faces of elements (docs/blocks.md, Particles and blocks).

A face is a segment from its first end to its second, the element to its left, so its outer side is to the right. A disc
meets it in its nearest point q = (1 - t) p1 + t p2, t from 0 to 1: overlap U = R - |q - c|, normal n = (q - c)/|q - c|
from the disc to the face. The law is that of discs at walls (physics/dem/kernels/laws.py); force and friction act in q,
so they are shared by the two ends as 1 - t and t without a moment that is left over.

Which faces count. Of the distance of the centre to the surface only local minima are contacts: the inside of a face if
the centre is on its outer side; an end only if the neighbouring face along the surface ends there too as seen from the
disc. Contacts of a disc whose normals are nearly the same share the load, see `share`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcdem.core.cells import COLUMN, first_not_before, index
from hpcdem.core.fields import GID, MATERIAL, RADIUS, SPIN, VX, VY, X, Y
from hpcdem.numerics.exact_sum import add_to_bins
from hpcdem.numerics.lanes import as_bits
from hpcdem.physics.dem.kernels import laws
from hpcdem.physics.dem.kernels.motion import ALPHA, KICK_SPIN, KICK_X, KICK_Y, MASS

# Columns of the ends of faces (n, 8): places [m] and velocities [m/s].
P1X, P1Y, P2X, P2Y, V1X, V1Y, V2X, V2Y = range(8)
ENDS = 8
# Columns of the law table (element models * materials, 4), as of walls.
MODEL, A, B, MU = range(4)
FACE, END1, END2 = 0, 1, 2
# Columns of the scratch table of one disc.
WHERE, ALONG, SIDE, DISTANCE, NX, NY, OVERLAP, COUNTS, HISTORY = range(9)
SCRATCH = 9


@njit(cache=True, error_model="numpy")
def closest(p1x, p1y, p2x, p2y, x, y):
    """Return where a point meets a face: (FACE, END1 or END2; t; distance to the line, positive outside; nearest
    point)."""
    ex, ey = p2x - p1x, p2y - p1y
    length2 = ex * ex + ey * ey
    rx, ry = x - p1x, y - p1y
    along = rx * ex + ry * ey
    side = (ey * rx - ex * ry) / math.sqrt(length2)
    if along <= 0.0:
        return END1, 0.0, side, p1x, p1y
    if along >= length2:
        return END2, 1.0, side, p2x, p2y
    t = along / length2
    return FACE, t, side, (1.0 - t) * p1x + t * p2x, (1.0 - t) * p1y + t * p2y


@njit(cache=True, error_model="numpy")
def share(ax, ay, bx, by):
    """Return the degree to which two contacts with these normals are the same: cos of twice the angle between them,
    from 1 (equal normals) to 0 (45 degrees and more)."""
    c = ax * bx + ay * by
    return max(0.0, 2.0 * c * c - 1.0) if c > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def _meet(first, last, x, y, r, slot_face, slot_before, slot_after, ends, seen):
    """Geometry of the slots first : last of a disc into the rows of `seen`, and which of them count. Returns whether
    the centre is outside of all elements near."""
    nearest, at = math.inf, -1
    for k in range(first, last):
        face = ends[slot_face[k]]
        where, t, side, qx, qy = closest(face[P1X], face[P1Y], face[P2X], face[P2Y], x, y)
        dx, dy = qx - x, qy - y
        d = math.sqrt(dx * dx + dy * dy)
        s = seen[k - first]
        s[WHERE], s[ALONG], s[SIDE], s[DISTANCE], s[OVERLAP] = where, t, side, d, r - d
        s[NX], s[NY] = (dx / d, dy / d) if d > 0.0 else (0.0, 0.0)
        if d < nearest:
            nearest, at = d, k
    for k in range(first, last):
        s = seen[k - first]
        s[COUNTS] = 0.0
        if s[OVERLAP] <= 0.0 or s[DISTANCE] == 0.0:
            continue
        if s[WHERE] == FACE:
            s[COUNTS] = 1.0 if s[SIDE] > 0.0 else 0.0
            continue
        other = slot_before[k] if s[WHERE] == END1 else slot_after[k]
        if other < 0:
            s[COUNTS] = 1.0 if s[SIDE] >= 0.0 else 0.0
            continue
        o = seen[other - first]
        facing = END2 if s[WHERE] == END1 else END1
        s[COUNTS] = 1.0 if o[WHERE] == facing and (s[SIDE] >= 0.0 or o[SIDE] >= 0.0) else 0.0
    if nearest >= r:
        return True
    s = seen[at - first]
    if s[WHERE] == FACE or s[SIDE] > 0.0:
        return s[SIDE] > 0.0
    other = slot_before[at] if s[WHERE] == END1 else slot_after[at]
    return s[DISTANCE] > 0.0 and (s[SIDE] == 0.0 or (other >= 0 and seen[other - first, SIDE] >= 0.0))


@njit(cache=True, error_model="numpy")
def _weight(k, n, seen):
    """Part of its force that contact k of n has: U over the sum of U of all that share with it. Equal normals have
    together what the mean overlap has; normals 45 degrees apart do not know of each other."""
    s = seen[k]
    total = s[OVERLAP]
    for j in range(n):
        if j != k and seen[j, COUNTS] > 0.0:
            total += share(s[NX], s[NY], seen[j, NX], seen[j, NY]) * seen[j, OVERLAP]
    return s[OVERLAP] / total


@njit(cache=True, error_model="numpy")
def _inherit(first, last, slot_on, slot_fs, seen):
    """Copy the history that a new contact inherits: the friction of that contact of the disc whose normal is nearest to
    its own, as far as they share. Into HISTORY."""
    for k in range(first, last):
        s = seen[k - first]
        s[HISTORY] = slot_fs[k]
        if s[COUNTS] == 0.0 or slot_on[k]:
            continue
        best = 0.0
        for j in range(first, last):
            if slot_on[j]:
                c = share(s[NX], s[NY], seen[j - first, NX], seen[j - first, NY])
                if c > best:
                    best = c
                    s[HISTORY] = c * slot_fs[j]


@njit(cache=True, nogil=True, error_model="numpy")
def forces(
    again, disc_row, disc_begin, hot, ihot, slot_face, slot_before, slot_after, slot_on, slot_fs, ends, face_model,
    laws_table, n_mat, dt, seen, disc_force, slot_force,
):  # fmt: skip
    """Forces of all slots; friction moves on by dt.

    disc_row (nd,): rows of discs in hot; disc_begin (nd + 1,): their slots, in ascending order of faces; slot_face: row
    in ends (nf, 8) and face_model (nf,); slot_before, slot_after: slots of the same disc with the neighbours of the
    face along the surface, or -1; slot_on, slot_fs: whether it touched, friction [N]. seen (most slots, 9): scratch.
    Fills disc_force (nd, 3) [N, N m] and slot_force (ns, 4): on the two ends of the face [N].

    again: the forces as they were, of the contacts that touched then; nothing moves on. Returns the gid of a disc whose
    centre is inside an element, or -1.
    """
    inside = np.int64(-1)
    slot_force[:] = 0.0
    for d in range(len(disc_row)):
        first, last, i = disc_begin[d], disc_begin[d + 1], disc_row[d]
        x, y, r = hot[i, X], hot[i, Y], hot[i, RADIUS]
        if not _meet(first, last, x, y, r, slot_face, slot_before, slot_after, ends, seen) and not again:
            inside = max(inside, ihot[i, GID])
        if again:
            for k in range(first, last):
                if not slot_on[k]:
                    seen[k - first, COUNTS] = 0.0
                seen[k - first, HISTORY] = slot_fs[k]
        else:
            _inherit(first, last, slot_on, slot_fs, seen)
        vx, vy, w = hot[i, VX], hot[i, VY], hot[i, SPIN]
        sum_x = sum_y = torque = 0.0
        for k in range(first, last):
            s = seen[k - first]
            if s[COUNTS] == 0.0:
                if not again:
                    slot_on[k] = False
                    slot_fs[k] = 0.0
                continue
            f = slot_face[k]
            law = laws_table[face_model[f] * n_mat + ihot[i, MATERIAL]]
            fn, ks = laws.contact(law[MODEL], law[A], law[B], 4.0 * r, s[OVERLAP])
            nx, ny, t, lever = s[NX], s[NY], s[ALONG], s[DISTANCE]
            fs = s[HISTORY]
            if not again:
                ux = (1.0 - t) * ends[f, V1X] + t * ends[f, V2X]
                uy = (1.0 - t) * ends[f, V1Y] + t * ends[f, V2Y]
                slide = ny * (vx - ux) + nx * (uy - vy) - w * lever
                fs = laws.coulomb(fs + ks * slide * dt, law[MU] * fn)
                slot_on[k] = True
                slot_fs[k] = fs
            part = _weight(k - first, last - first, seen)
            fx, fy = part * (-fs * ny - fn * nx), part * (fs * nx - fn * ny)
            sum_x += fx
            sum_y += fy
            torque += part * fs * lever
            slot_force[k, 0], slot_force[k, 1] = -(1.0 - t) * fx, -(1.0 - t) * fy
            slot_force[k, 2], slot_force[k, 3] = -t * fx, -t * fy
        disc_force[d, 0], disc_force[d, 1], disc_force[d, 2] = sum_x, sum_y, torque
    return inside


@njit(cache=True, nogil=True, error_model="numpy")
def contacts(
    disc_row, disc_begin, hot, ihot, slot_face, slot_before, slot_after, slot_on, slot_fs, ends, face_model, laws_table,
    n_mat, seen, out, at,
):  # fmt: skip
    """The contacts that touch: out (m, 6) normal force, friction [N], both with their part of the load, x, y of the
    contact point, overlap [m], elastic energy [J]; at (m, 2): slot, disc. Returns their number. Only looks."""
    n = 0
    for d in range(len(disc_row)):
        first, last, i = disc_begin[d], disc_begin[d + 1], disc_row[d]
        x, y, r = hot[i, X], hot[i, Y], hot[i, RADIUS]
        _meet(first, last, x, y, r, slot_face, slot_before, slot_after, ends, seen)
        for k in range(first, last):
            if not slot_on[k]:
                seen[k - first, COUNTS] = 0.0
        for k in range(first, last):
            s = seen[k - first]
            if s[COUNTS] == 0.0:
                continue
            law = laws_table[face_model[slot_face[k]] * n_mat + ihot[i, MATERIAL]]
            u = s[OVERLAP]
            fn, ks, _, energy = laws.contact_state(law[MODEL], law[A], law[B], 4.0 * r, u)
            part = _weight(k - first, last - first, seen)
            out[n, 0], out[n, 1] = part * fn, part * slot_fs[k]
            out[n, 2], out[n, 3] = x + s[DISTANCE] * s[NX], y + s[DISTANCE] * s[NY]
            out[n, 4] = u
            out[n, 5] = part * (energy + laws.shear_energy(slot_fs[k], ks))
            at[n, 0], at[n, 1] = k, d
            n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def work_on_discs(kick, disc_row, disc_force, hot, n_left, body, all_forces, gx, gy, eta, dt, bins):
    """Book half a step's work of disc_force: with the velocities there are, or (kick) with those after the coming kick
    by all_forces (n_own, 3), as motion.move will make them."""
    for d in range(len(disc_row)):
        i = disc_row[d]
        c = i - n_left
        vx, vy, w = hot[i, VX], hot[i, VY], hot[i, SPIN]
        if kick:
            m, alpha = body[c, MASS], body[c, ALPHA]
            vx += laws.damped(all_forces[c, 0] + m * gx - eta * vx, vx, alpha) * body[c, KICK_X]
            vy += laws.damped(all_forces[c, 1] + m * gy - eta * vy, vy, alpha) * body[c, KICK_Y]
            w += laws.damped(all_forces[c, 2], w, alpha) * body[c, KICK_SPIN]
        done = 0.5 * dt * (disc_force[d, 0] * vx + disc_force[d, 1] * vy + disc_force[d, 2] * w)
        if done != 0.0:
            add_to_bins(bins, as_bits(done))


@njit(cache=True, nogil=True, error_model="numpy")
def work_on_faces(face_force, face_row, face_k, face_k2, v, dt, bins):
    """Book half a step's work of face_force (n, 4) with the velocities v of the corners of elements."""
    for f in range(len(face_row)):
        i, a, b = face_row[f], 2 * face_k[f], 2 * face_k2[f]
        done = 0.5 * dt * (
            face_force[f, 0] * v[i, a] + face_force[f, 1] * v[i, a + 1]
            + face_force[f, 2] * v[i, b] + face_force[f, 3] * v[i, b + 1]
        )  # fmt: skip
        if done != 0.0:
            add_to_bins(bins, as_bits(done))


# ---- what travels ----------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def pack(face_row, face_k, face_k2, x, v, out):
    """Ends of faces into out (n, 8): place of the element in x and v, and corners of the face."""
    for f in range(len(face_row)):
        i, a, b = face_row[f], 2 * face_k[f], 2 * face_k2[f]
        out[f, P1X], out[f, P1Y], out[f, P2X], out[f, P2Y] = x[i, a], x[i, a + 1], x[i, b], x[i, b + 1]
        out[f, V1X], out[f, V1Y], out[f, V2X], out[f, V2Y] = v[i, a], v[i, a + 1], v[i, b], v[i, b + 1]


@njit(cache=True, nogil=True, error_model="numpy")
def gather(order, of_face, arrived, face_force):
    """Add up arrived (m, 4) by faces, in the order `order`: by face, then by gid."""
    face_force[:] = 0.0
    for m in order:
        f = of_face[m]
        for c in range(4):
            face_force[f, c] += arrived[m, c]


@njit(cache=True, nogil=True, error_model="numpy")
def apply(face_force, face_row, face_k, face_k2, applied):
    """Add the forces of faces (ascending by number) to the corners (n, 8) of their elements."""
    for f in range(len(face_row)):
        i, a, b = face_row[f], 2 * face_k[f], 2 * face_k2[f]
        applied[i, a] += face_force[f, 0]
        applied[i, a + 1] += face_force[f, 1]
        applied[i, b] += face_force[f, 2]
        applied[i, b + 1] += face_force[f, 3]


@njit(cache=True, nogil=True, error_model="numpy")
def add_to_discs(sign, disc_row, disc_force, cut, lo, foff, force):
    """Add sign times the forces on discs to the table that moves them (neighbours.Blocks)."""
    for d in range(len(disc_row)):
        i = disc_row[d]
        t = 0
        while cut[t + 1] <= i:
            t += 1
        for c in range(3):
            force[foff[t] - lo[t] + i, c] += sign * disc_force[d, c]


# ---- search ----------------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def near(hot, rows, sorted_keys, side, places, capacity, pairs):
    """Discs nearer to faces than R + room: pairs (m, 2) of disc row and face; returns how many there are, also if they
    are more than fit in.

    rows: of the discs in hot, in the order of their cells sorted_keys of this side [m], which is at least the largest
    radius plus room; places (nf, 4): ends of faces.
    """
    n = 0
    for f in range(len(places)):
        x1, y1, x2, y2 = places[f]
        left, right = index(min(x1, x2) - side, side), index(max(x1, x2) + side, side)
        low, high = index(min(y1, y2) - side, side), index(max(y1, y2) + side, side)
        for c in range(left, right + 1):
            begin = first_not_before(sorted_keys, c * COLUMN + low, 0, len(rows))
            end = first_not_before(sorted_keys, c * COLUMN + high + 1, begin, len(rows))
            for k in range(begin, end):
                i = rows[k]
                x, y = hot[i, X], hot[i, Y]
                _, _, _, qx, qy = closest(x1, y1, x2, y2, x, y)
                reach = hot[i, RADIUS] + capacity
                if (x - qx) * (x - qx) + (y - qy) * (y - qy) < reach * reach:
                    if n < len(pairs):
                        pairs[n, 0], pairs[n, 1] = i, f
                    n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def centres_inside(hot, ihot, rows, sorted_keys, side, corners, number):
    """The lowest gid whose centre is inside an element, and that element; (-1, -1) if no centre is. corners (ne, 8):
    of triangles the first corner twice."""
    gid, element = np.int64(-1), np.int64(-1)
    for e in range(len(corners)):
        x, y = corners[e, 0::2], corners[e, 1::2]
        for c in range(index(x.min(), side), index(x.max(), side) + 1):
            begin = first_not_before(sorted_keys, c * COLUMN + index(y.min(), side), 0, len(rows))
            end = first_not_before(sorted_keys, c * COLUMN + index(y.max(), side) + 1, begin, len(rows))
            for k in range(begin, end):
                i = rows[k]
                within = True
                for a in range(4):
                    b = (a + 1) % 4
                    turn = (x[b] - x[a]) * (hot[i, Y] - y[a]) - (y[b] - y[a]) * (hot[i, X] - x[a])
                    within &= turn >= 0.0
                if within and (gid < 0 or ihot[i, GID] < gid):
                    gid, element = ihot[i, GID], number[e]
    return gid, element


@njit(cache=True, nogil=True, error_model="numpy")
def neighbours_along(faces, cells, partner, closed, before, after):
    """The free faces before and after each of these free faces on the surface of its body: about their common point
    from element to element through closed faces."""
    for m in range(len(faces)):
        for way in range(2):
            e, k = faces[m] // 4, faces[m] % 4
            while True:
                n = 4 if cells[e, 3] >= 0 else 3
                k = (k + 1) % n if way == 1 else (k + n - 1) % n
                f = 4 * e + k
                if not closed[f]:
                    break
                e, k = partner[f] // 4, partner[f] % 4
            if way == 1:
                after[m] = f
            else:
                before[m] = f


@njit(cache=True, nogil=True, error_model="numpy")
def link(disc_begin, slot_number, before, after, slot_before, slot_after):
    """Slots of the same disc with the face before and after; slot_number (ns,): of the face; before, after: by slot."""
    for d in range(len(disc_begin) - 1):
        for k in range(disc_begin[d], disc_begin[d + 1]):
            slot_before[k] = slot_after[k] = -1
            for j in range(disc_begin[d], disc_begin[d + 1]):
                if slot_number[j] == before[k]:
                    slot_before[k] = j
                if slot_number[j] == after[k]:
                    slot_after[k] = j

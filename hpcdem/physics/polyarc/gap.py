"""The gap between two convex outlines of arcs, exact: their distance, or how deep they overlap.

A convex body K is the set of points below all its tangents, u . p <= h(u) for every direction u, and
h(u) = max over K of u . p is its support function. Bodies A and B at distance D (from the centre of A to that of B) are
apart by

    gap = max over u of  u . D - hA(u) - hB(-u)

which is the distance if it is positive (the best u is the direction of the shortest line between them), and otherwise
minus the least way by which one must be moved to part them. The support function of an outline of arcs is
h(u) = u . O + R for the normals u of an arc (centre O, radius R), and u . V for directions between the normals of two
neighbours (corner V): the circle of directions falls into sectors, and merged with the sectors of the other body into
few, in each of which what is to be made large is R - |W| or reached at an end of the sector. (This walk around the
Minkowski sum of two convex bodies is that of rotating callipers.)
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hpcdem.physics.polyarc.outlines import STRAIGHT, Outlines

_NO_TURN = 1e-12
"""Corners that turn by less [rad] are none: arcs that go over into one another."""

Fans = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def fans(outlines: Outlines) -> Fans:
    """The sectors of convex outlines: start (n + 1,) i8, first normal of each sector as an angle [rad, 0 to 2 pi,
    rising within an outline], its cosine and sine, centre x, y [m] and radius [m] of what has these normals.

    Outlines that bulge inwards at a corner by rounding only count as convex.
    """
    return _fans(outlines.start, outlines.x, outlines.y, outlines.theta)


@njit(cache=True, nogil=True, error_model="numpy")
def _fans(start, x, y, theta):
    m = len(x)
    at = np.zeros(len(start), np.int64)
    angle, px, py, rho = np.empty(2 * m), np.empty(2 * m), np.empty(2 * m), np.empty(2 * m)
    two_pi = 2.0 * np.pi
    n = 0
    for k in range(len(start) - 1):
        a, b = start[k], start[k + 1]
        at[k] = n
        for i in range(a, b):
            e = i + 1 if i + 1 < b else a
            f = e + 1 if e + 1 < b else a
            dx, dy = x[e] - x[i], y[e] - y[i]
            direction = np.arctan2(dy, dx) - 0.5 * np.pi
            first = direction - 0.5 * theta[i]
            if theta[i] >= STRAIGHT:
                radius = np.sqrt(dx * dx + dy * dy) / (2.0 * np.sin(0.5 * theta[i]))
                angle[n] = first % two_pi
                px[n], py[n], rho[n] = x[i] - radius * np.cos(first), y[i] - radius * np.sin(first), radius
                n += 1
            last = direction + 0.5 * theta[i]
            following = np.arctan2(y[f] - y[e], x[f] - x[e]) - 0.5 * np.pi - 0.5 * theta[e]
            turn = (following - last) % two_pi
            if _NO_TURN < turn < two_pi - 1e-6:
                angle[n] = last % two_pi
                px[n], py[n], rho[n] = x[e], y[e], 0.0
                n += 1
        # Rising angles: the list is cyclic, so it only has to be turned to its smallest.
        count = n - at[k]
        low = at[k] + np.argmin(angle[at[k] : n])
        if low != at[k]:
            turned = np.empty((4, count))
            for q in range(count):
                s = at[k] + (low - at[k] + q) % count
                turned[0, q], turned[1, q], turned[2, q], turned[3, q] = angle[s], px[s], py[s], rho[s]
            for q in range(count):
                s = at[k] + q
                angle[s], px[s], py[s], rho[s] = turned[0, q], turned[1, q], turned[2, q], turned[3, q]
    at[len(start) - 1] = n
    return at, angle[:n], np.cos(angle[:n]), np.sin(angle[:n]), px[:n], py[:n], rho[:n]


@njit(cache=True, nogil=True, error_model="numpy")
def gap(fan, i, j, dx, dy, angle_i, angle_j, enough):
    """Gap between body i, turned by angle_i, and body j, turned by angle_j, whose centre is (dx, dy) from that of i.

    Returns the gap [m] and the direction (ux, uy) from i to j in which it is. As soon as some direction shows a gap
    above `enough`, that is returned instead of the largest.
    """
    start, phi, cosine, sine, px, py, rho = fan
    two_pi = 2.0 * np.pi
    ca, sa = np.cos(angle_i), np.sin(angle_i)
    ex, ey = ca * dx + sa * dy, ca * dy - sa * dx  # the distance in the frame of i
    turn = (angle_j - angle_i + np.pi) % two_pi  # how -j lies in it
    ct, st = np.cos(turn), np.sin(turn)
    a0, na = start[i], start[i + 1] - start[i]
    b0, nb = start[j], start[j + 1] - start[j]
    # The first sector of -j that begins at or after direction 0.
    b = 0
    while b < nb and phi[b0 + b] + turn < two_pi:
        b += 1
    wrapped = b < nb
    b_first = b if wrapped else 0
    best = -np.inf
    ux = uy = 0.0
    ka, kb = 0, 0  # sectors begun of either body
    # Before their first beginnings the last sectors hold.
    wa = a0 + na - 1
    wb = b0 + (b_first + nb - 1) % nb
    cu = su = c_first = s_first = 0.0
    fresh = False
    for step in range(na + nb + 1):
        # Where the next sector begins.
        next_a = phi[a0 + ka] if ka < na else np.inf
        if kb < nb:
            sb = b0 + (b_first + kb) % nb
            next_b = phi[sb] + turn
            if next_b >= two_pi:
                next_b -= two_pi
        else:
            sb = b0
            next_b = np.inf
        if step == na + nb:  # the way back to the first beginning
            c, s = c_first, s_first
            take_a = False
        elif next_a <= next_b:
            c, s = cosine[a0 + ka], sine[a0 + ka]
            take_a = True
        else:
            c, s = ct * cosine[sb] - st * sine[sb], st * cosine[sb] + ct * sine[sb]
            take_a = False
        # The sector that ends here.
        wx = px[wa] + ct * px[wb] - st * py[wb] - ex
        wy = py[wa] + st * px[wb] + ct * py[wb] - ey
        r = rho[wa] + rho[wb]
        value = -(wx * c + wy * s + r)
        if value > best:
            best, ux, uy = value, c, s
            if best > enough:
                break
        if fresh:
            # Inside it: -W / |W|, if that is among its directions.
            norm = np.sqrt(wx * wx + wy * wy)
            if norm - r > best and norm > 0.0:
                vx, vy = -wx / norm, -wy / norm
                before = cu * vy - su * vx
                after = vx * s - vy * c
                if cu * s - su * c < -_NO_TURN:
                    inside = before >= 0.0 or after >= 0.0
                else:  # the second half keeps out what is opposite to a sector without width
                    inside = before >= 0.0 and after >= 0.0 and vx * (cu + c) + vy * (su + s) >= -_NO_TURN
                if inside:
                    best, ux, uy = norm - r, vx, vy
                    if best > enough:
                        break
        else:
            c_first, s_first = c, s
        fresh = True
        cu, su = c, s
        if step == na + nb:
            break
        if take_a:
            wa = a0 + ka
            ka += 1
        else:
            wb = sb
            kb += 1
    return best, ca * ux - sa * uy, sa * ux + ca * uy


@njit(cache=True, nogil=True, error_model="numpy")
def farthest(fan, k, angle, ux, uy):
    """The point of body k, turned by `angle`, that is farthest in direction (ux, uy), from its centre: x, y [m]."""
    start, phi, _, _, px, py, rho = fan
    c, s = np.cos(angle), np.sin(angle)
    vx, vy = c * ux + s * uy, c * uy - s * ux
    at = np.arctan2(vy, vx) % (2.0 * np.pi)
    w = start[k + 1] - 1
    for q in range(start[k], start[k + 1]):
        if phi[q] > at:
            break
        w = q
    x, y = px[w] + rho[w] * vx, py[w] + rho[w] * vy
    return c * x - s * y, s * x + c * y

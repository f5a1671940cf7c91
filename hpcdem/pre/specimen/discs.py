"""Discs that stand for an outline: all inside it, and its line followed within a given gap by few of them.

The candidates are the largest discs that touch the outline at a point from inside (their centres are the medial axis).
The first is the largest of all; then always the one is taken that brings most of the outline that is not yet followed
within the gap (the greedy way to cover a set, after Chvatal 1979, Math. Oper. Res. 4, 233-235).

A disc of radius r in a corner of half angle b leaves r (1 / sin b - 1) of it free, so a sharp corner asks for a disc of
gap / (1 / sin b - 1), and a straight edge between two discs of radius r for one every 2 sqrt(2 r gap).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from hpcdem.core.errors import CommandError
from hpcdem.physics.polyarc.moments import moments
from hpcdem.physics.polyarc.outlines import STRAIGHT, Outlines, arc_circles

GAP = 0.03
"""Largest gap between the outline and the discs, over the size of the grain."""
FINEST, COARSEST = 0.002, 0.25


@dataclass(frozen=True)
class Discs:
    """Discs start[k] to start[k + 1] of outline k: start (n + 1,) i8; x, y, r (m,) f8 [m] in the frame of the outline.

    coverage (n,) f8: area of the union of the discs over that of the outline; gap (n,) f8 [m]: largest distance from
    the outline to the nearest disc.
    """

    start: np.ndarray
    x: np.ndarray
    y: np.ndarray
    r: np.ndarray
    coverage: np.ndarray
    gap: np.ndarray


def inscribed(outlines: Outlines, size: np.ndarray, gap: float = GAP) -> Discs:
    """Discs inside convex outlines of these sizes (n,) f8 [m]. gap: largest distance of a point of the outline from
    the discs, over the size. Outlines that are alike but for their scale get discs that are.
    Raises CommandError."""
    if not FINEST <= gap <= COARSEST:
        raise CommandError(f"gap {gap:g} of the size between outline and discs, expected {FINEST:g} to {COARSEST:g}")
    scale = 1.0 / np.asarray(size, np.float64)
    k = outlines.owner
    unit = Outlines(outlines.start, outlines.x * scale[k], outlines.y * scale[k], outlines.theta)
    which, same = _different(unit)
    few = unit.taken(which)
    radius, cx, cy, first = arc_circles(few)
    parts = []
    for a, b in zip(few.start[:-1], few.start[1:]):
        arcs = slice(a, b)
        parts.append(
            _cover(few.x[arcs], few.y[arcs], few.theta[arcs], radius[arcs], cx[arcs], cy[arcs], first[arcs], gap)
        )
    area = moments(few)[0]
    number = np.array([len(rows) for rows, _ in parts])
    covered = np.array([union_area(*rows.T) for rows, _ in parts]) / area
    worst = np.array([far for _, far in parts])
    begin = np.concatenate([[0], np.cumsum(number)])
    start = np.concatenate([[0], np.cumsum(number[same])]).astype(np.int64)
    rows = np.concatenate([rows for rows, _ in parts])
    taken = np.repeat(begin[:-1][same] - start[:-1], number[same]) + np.arange(start[-1])
    x, y, r = (rows[taken] * np.repeat(size, number[same])[:, None]).T
    return Discs(start, x.copy(), y.copy(), r.copy(), covered[same], worst[same] * size)


def _different(unit: Outlines) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of outlines that differ by more than rounding, and for each outline which of them it is."""
    if not unit.arcs_each:
        return np.arange(len(unit)), np.arange(len(unit))
    rows = np.stack([unit.x, unit.y, unit.theta], 1).reshape(len(unit), -1).round(12) + 0.0
    _, which, same = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return which, same.reshape(-1)


@njit(cache=True, nogil=True, error_model="numpy")
def _inside(px, py, x, y, theta, radius, cx, cy, first):
    """Distance from a point inside to the outline."""
    n = len(x)
    least = np.inf
    for i in range(n):
        least = min(least, np.sqrt((px - x[i]) ** 2 + (py - y[i]) ** 2))
        e = i + 1 if i + 1 < n else 0
        if theta[i] < STRAIGHT:
            dx, dy = x[e] - x[i], y[e] - y[i]
            length = np.sqrt(dx * dx + dy * dy)
            along = ((px - x[i]) * dx + (py - y[i]) * dy) / length
            if 0.0 <= along <= length:
                least = min(least, ((py - y[i]) * dx - (px - x[i]) * dy) / length)
        else:
            qx, qy = px - cx[i], py - cy[i]
            if (np.arctan2(qy, qx) - first[i]) % (2.0 * np.pi) <= theta[i]:
                least = min(least, radius[i] - np.sqrt(qx * qx + qy * qy))
    return least


@njit(cache=True, nogil=True, error_model="numpy")
def _largest(px, py, mx, my, own, x, y, theta, radius, cx, cy, first):
    """Radius of the largest disc inside that touches the outline at p, a point of arc `own` with inward normal m."""
    n = len(x)
    r = radius[own]
    for i in range(n):
        if i == own:
            continue
        e = i + 1 if i + 1 < n else 0
        for v in (i, e):
            # |p + r m - V| = r
            wx, wy = x[v] - px, y[v] - py
            ahead = wx * mx + wy * my
            if ahead > 0.0:
                r = min(r, (wx * wx + wy * wy) / (2.0 * ahead))
        if theta[i] < STRAIGHT:
            # Distance to the edge grows by k . m, the disc by 1.
            dx, dy = x[e] - x[i], y[e] - y[i]
            length = np.sqrt(dx * dx + dy * dy)
            kx, ky = -dy / length, dx / length
            slower = 1.0 - (kx * mx + ky * my)
            if slower > 0.0:
                r = min(r, max((px - x[i]) * kx + (py - y[i]) * ky, 0.0) / slower)
        else:
            # |p + r m - O| = R - r
            qx, qy = px - cx[i], py - cy[i]
            below = 2.0 * (qx * mx + qy * my + radius[i])
            if below > 0.0:
                s = max(radius[i] ** 2 - qx * qx - qy * qy, 0.0) / below
                tx, ty = qx + s * mx, qy + s * my
                if s < r and (np.arctan2(ty, tx) - first[i]) % (2.0 * np.pi) <= theta[i]:
                    r = s
    return r


@njit(cache=True, nogil=True, error_model="numpy")
def _points(x, y, theta, radius, cx, cy, first, step):
    """Points of the outline no farther than `step` from each other, their arcs and inward normals; near the ends of an
    arc they stand closer, down to step / 16, for the small discs of sharp corners."""
    n = len(x)
    px, py, mx, my = [0.0], [0.0], [0.0], [0.0]
    own = [0]
    for i in range(n):
        e = i + 1 if i + 1 < n else 0
        dx, dy = x[e] - x[i], y[e] - y[i]
        chord = np.sqrt(dx * dx + dy * dy)
        length = chord if theta[i] < STRAIGHT else radius[i] * theta[i]
        number = int(np.ceil(length / step)) + 1
        at = [q / number for q in range(1, number)]
        for q in range(5):
            near = min(step / length, 0.5) / 2.0**q
            at.append(near)
            at.append(1.0 - near)
        for t in at:
            if theta[i] < STRAIGHT:
                px.append(x[i] + t * dx)
                py.append(y[i] + t * dy)
                mx.append(-dy / chord)
                my.append(dx / chord)
            else:
                angle = first[i] + t * theta[i]
                c, s = np.cos(angle), np.sin(angle)
                px.append(cx[i] + radius[i] * c)
                py.append(cy[i] + radius[i] * s)
                mx.append(-c)
                my.append(-s)
            own.append(i)
        # The end itself is to be followed, but no disc touches it: a normal of 0.
        px.append(x[i])
        py.append(y[i])
        mx.append(0.0)
        my.append(0.0)
        own.append(i)
    return np.array(px[1:]), np.array(py[1:]), np.array(mx[1:]), np.array(my[1:]), np.array(own[1:])


@njit(cache=True, nogil=True, error_model="numpy")
def _cover(x, y, theta, radius, cx, cy, first, gap):
    """(m, 3) discs x, y, r for one outline of size 1, and the largest distance from the outline to them."""
    px, py, mx, my, own = _points(x, y, theta, radius, cx, cy, first, 0.5 * gap)
    n = len(px)
    discs = np.zeros((n, 3))
    for k in range(n):
        if mx[k] != 0.0 or my[k] != 0.0:
            r = _largest(px[k], py[k], mx[k], my[k], own[k], x, y, theta, radius, cx, cy, first)
            discs[k, 0], discs[k, 1] = px[k] + r * mx[k], py[k] + r * my[k]
            # Rounding must not push it out.
            r = min(r, _inside(discs[k, 0], discs[k, 1], x, y, theta, radius, cx, cy, first))
            discs[k, 2] = max(r, 0.0) * (1.0 - 1e-12)
    # Points between the checked ones are at most a quarter of the gap from one of them.
    near = 0.75 * gap
    far = np.full(n, np.inf)
    chosen = np.empty((n, 3))
    count = 0
    pick = np.argmax(discs[:, 2])
    while True:
        chosen[count] = discs[pick]
        count += 1
        for p in range(n):
            apart = np.sqrt((px[p] - discs[pick, 0]) ** 2 + (py[p] - discs[pick, 1]) ** 2) - discs[pick, 2]
            far[p] = min(far[p], max(apart, 0.0))
        most, largest = 0, 0.0
        for k in range(n):
            if discs[k, 2] <= 0.0:
                continue
            gain = 0
            for p in range(n):
                if far[p] > near:
                    reach = discs[k, 2] + near
                    if (px[p] - discs[k, 0]) ** 2 + (py[p] - discs[k, 1]) ** 2 <= reach * reach:
                        gain += 1
            if gain > most or (gain == most and gain > 0 and discs[k, 2] > largest):
                most, largest, pick = gain, discs[k, 2], k
        if most == 0:
            break
    count = _pruned(chosen, count, px, py, near)
    fx, fy, _, _, _ = _points(x, y, theta, radius, cx, cy, first, 0.05 * gap)
    worst = 0.0
    for p in range(len(fx)):
        least = np.inf
        for c in range(count):
            least = min(least, np.sqrt((fx[p] - chosen[c, 0]) ** 2 + (fy[p] - chosen[c, 1]) ** 2) - chosen[c, 2])
        worst = max(worst, least)
    return chosen[:count].copy(), worst


@njit(cache=True, nogil=True, error_model="numpy")
def _pruned(chosen, count, px, py, near):
    """Leave out discs without which all points are followed still, the smallest first; how many are left. The first,
    the largest, stays."""
    followed = np.zeros(len(px), np.int64)
    by = np.zeros((count, len(px)), np.bool_)
    for c in range(count):
        reach = chosen[c, 2] + near
        for p in range(len(px)):
            by[c, p] = (px[p] - chosen[c, 0]) ** 2 + (py[p] - chosen[c, 1]) ** 2 <= reach * reach
            followed[p] += by[c, p]
    keep = np.ones(count, np.bool_)
    for c in np.argsort(chosen[:count, 2]):
        if c == 0:
            continue
        needed = False
        for p in range(len(px)):
            if by[c, p] and followed[p] == 1:
                needed = True
                break
        if not needed:
            keep[c] = False
            for p in range(len(px)):
                followed[p] -= by[c, p]
    left = 0
    for c in range(count):
        if keep[c]:
            chosen[left] = chosen[c]
            left += 1
    return left


@njit(cache=True, nogil=True, error_model="numpy")
def union_area(x, y, r):
    """Area [m2] of the union of discs, exact: by Green's theorem, half the integral of x dy - y dx over the arcs of the
    circles that lie in no other disc."""
    n = len(x)
    area = 0.0
    begin, end = np.empty(2 * n), np.empty(2 * n)
    for i in range(n):
        hidden = 0
        swallowed = False
        for j in range(n):
            if j == i:
                continue
            dx, dy = x[j] - x[i], y[j] - y[i]
            d = np.sqrt(dx * dx + dy * dy)
            # Of equal discs the first counts.
            if d <= r[j] - r[i] and (d < r[j] - r[i] or r[j] > r[i] or j < i):
                swallowed = True
                break
            if d >= r[i] + r[j] or d <= r[i] - r[j]:
                continue
            half = np.arccos(min(max((d * d + r[i] ** 2 - r[j] ** 2) / (2.0 * d * r[i]), -1.0), 1.0))
            low = (np.arctan2(dy, dx) - half) % (2.0 * np.pi)
            high = low + 2.0 * half
            begin[hidden], end[hidden] = low, min(high, 2.0 * np.pi)
            hidden += 1
            if high > 2.0 * np.pi:
                begin[hidden], end[hidden] = 0.0, high - 2.0 * np.pi
                hidden += 1
        if swallowed:
            continue
        order = np.argsort(begin[:hidden])
        free = 0.0
        for q in range(hidden + 1):
            to = begin[order[q]] if q < hidden else 2.0 * np.pi
            if to > free:
                area += (
                    0.5
                    * r[i]
                    * (r[i] * (to - free) + x[i] * (np.sin(to) - np.sin(free)) - y[i] * (np.cos(to) - np.cos(free)))
                )
            if q < hidden:
                free = max(free, end[order[q]])
    return area

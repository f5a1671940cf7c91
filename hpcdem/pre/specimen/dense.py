"""Dense placement: all grains in the box, by their true outlines.

1. Random sequential addition, large grains first: a grain is put where it touches nobody, or after TRIES attempts where
   it overlaps least.
2. Relaxation: overlapping grains are moved and turned apart, pair after pair, by how deep they overlap, the heavier
   one less; walls push in. This is the projection of positions known from constrained dynamics (and, for discs, close
   to the force-biased packing of Jodrey & Tory 1985), without masses, times or forces that mean anything.
3. Where the overlaps no longer become less, the box is too small for this: it is made a little higher.

It ends when in a whole round nothing is nearer than a millionth of the smallest radius.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hpcdem.numerics.rng import uniform
from hpcdem.physics.polyarc.gap import fans, farthest, gap
from hpcdem.physics.polyarc.moments import moments
from hpcdem.physics.polyarc.outlines import Outlines

PLACES = 31
"""Stream of random numbers."""
TRIES = 40
"""Attempts to find room for a grain."""
APART, AIM = 1e-6, 1e-3
"""Gap of grains that count as apart, over the smallest radius; gap to which others are moved, over the smaller radius
of the two."""
SKIN = 0.5
"""Pairs nearer than this, over the smallest radius, are in the list."""
PATIENCE = 50
"""Rounds in which the overlaps must become less by a fifth, or the box is made higher."""
_TURN = 0.1
"""Most that a grain is turned for one neighbour [rad]."""
_FACE = 0.05
"""Directions that differ by less [rad] belong to one face, so that edges that lie flat on each other do not rock."""
_LEVELS = 16


def pack(
    body: Outlines, reach: np.ndarray, angle: np.ndarray, width: float, height: float, seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, int, int]:
    """Places for grains in the rectangle from (0, 0) to (width, height) [m].

    body: convex outlines about their centres at angle 0; reach (n,) [m]: circles about them; angle (n,) [rad]: as they
    should lie. Returns x, y (n,) [m], angle (n,) [rad] as far as they had to be turned, the height that was needed [m],
    how many grains found room at once, and the rounds of relaxation.
    """
    fan = fans(body)
    is_round = bool((np.abs(fan[6] - np.repeat(reach, np.diff(fan[0]))) <= 1e-12 * reach.max()).all())
    area = moments(body)[0]
    angle = angle.copy()
    order = np.argsort(-reach, kind="stable")
    level = _levels(reach)
    x, y, added = _add(fan, reach, angle, order, level, width, height, seed, TRIES, is_round)
    tall, sweeps = _relax(fan, reach, area, x, y, angle, level, width, height, is_round)
    return x, y, angle, float(tall), int(added), int(sweeps)


def closest(body: Outlines, reach: np.ndarray, x: np.ndarray, y: np.ndarray, angle: np.ndarray) -> float:
    """The smallest gap between any two grains [m], at most half the smallest radius; negative if grains overlap."""
    skin = SKIN * float(reach.min())
    level = _levels(reach)
    first, second = _pairs(x, y, reach, level, skin)
    return min(skin, float(_closest(fans(body), x, y, angle, first, second)))


def _levels(reach: np.ndarray) -> np.ndarray:
    """(n,) i8: 0 for the largest grains and those above half their radius, 1 above a quarter, ..."""
    return np.minimum(np.log2(reach.max() / reach).astype(np.int64), _LEVELS - 1)


# --- which grains are near: a grid for each level of size --------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def _grid(reach, level, left, right, bottom, top, skin):
    """Cell side, columns, rows, first cell and largest radius of each level, and the number of all cells."""
    side, most = np.zeros(_LEVELS), np.zeros(_LEVELS)
    columns, rows, first = np.zeros(_LEVELS, np.int64), np.zeros(_LEVELS, np.int64), np.zeros(_LEVELS, np.int64)
    for k in range(len(reach)):
        most[level[k]] = max(most[level[k]], reach[k])
    total = 0
    # Not many more cells than grains, though a level may hold only a few small ones.
    least = np.sqrt((right - left) * (top - bottom) / (4.0 * len(reach) + 16.0))
    for q in range(_LEVELS):
        first[q] = total
        if most[q] > 0.0:
            side[q] = max(2.0 * most[q] + skin, least)
            columns[q] = int((right - left) / side[q]) + 1
            rows[q] = int((top - bottom) / side[q]) + 1
            total += columns[q] * rows[q]
    return side, columns, rows, first, most, total


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _cell(v, low, side, number):
    return min(max(int((v - low) / side), 0), number - 1)


@njit(cache=True, nogil=True, error_model="numpy")
def _pairs(x, y, reach, level, skin):
    """Pairs whose circles are nearer than the skin: first and second (p,) i8, each pair once."""
    left, right = (x - reach).min(), (x + reach).max()
    bottom, top = (y - reach).min(), (y + reach).max()
    side, columns, rows, begin, most, total = _grid(reach, level, left, right, bottom, top, skin)
    n = len(x)
    head, following = np.full(total, -1, np.int64), np.full(n, -1, np.int64)
    for k in range(n - 1, -1, -1):
        q = level[k]
        cell = begin[q] + _cell(x[k], left, side[q], columns[q]) * rows[q] + _cell(y[k], bottom, side[q], rows[q])
        following[k] = head[cell]
        head[cell] = k
    capacity = 4 * n + 64
    first, second = np.empty(capacity, np.int64), np.empty(capacity, np.int64)
    found = 0
    for i in range(n):
        for q in range(level[i], _LEVELS):
            if columns[q] == 0:
                continue
            far = reach[i] + most[q] + skin
            for a in range(
                _cell(x[i] - far, left, side[q], columns[q]), _cell(x[i] + far, left, side[q], columns[q]) + 1
            ):
                for b in range(
                    _cell(y[i] - far, bottom, side[q], rows[q]), _cell(y[i] + far, bottom, side[q], rows[q]) + 1
                ):
                    j = head[begin[q] + a * rows[q] + b]
                    while j >= 0:
                        if q > level[i] or j > i:
                            dx, dy, near = x[j] - x[i], y[j] - y[i], reach[i] + reach[j] + skin
                            if dx * dx + dy * dy < near * near:
                                if found == capacity:
                                    capacity *= 2
                                    wider_first, wider_second = (
                                        np.empty(capacity, np.int64),
                                        np.empty(capacity, np.int64),
                                    )
                                    wider_first[:found], wider_second[:found] = first, second
                                    first, second = wider_first, wider_second
                                first[found], second[found] = i, j
                                found += 1
                        j = following[j]
    return first[:found], second[:found]


# --- addition ----------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def _gap(fan, reach, is_round, i, j, dx, dy, angle_i, angle_j, enough):
    """`gap`, without the outlines where circles decide."""
    far = np.sqrt(dx * dx + dy * dy)
    apart = far - reach[i] - reach[j]
    if apart > enough or is_round:
        if far > 0.0:
            return apart, dx / far, dy / far
        return apart, 1.0, 0.0
    return gap(fan, i, j, dx, dy, angle_i, angle_j, enough)


@njit(cache=True, nogil=True, error_model="numpy")
def _add(fan, reach, angle, order, level, width, height, seed, tries, is_round):
    """Random sequential addition in the given order; x, y [m] and how many found room."""
    n = len(reach)
    x, y = np.empty(n), np.empty(n)
    apart = APART * reach.min()
    side, columns, rows, begin, most, total = _grid(reach, level, 0.0, width, 0.0, height, apart)
    head, following = np.full(total, -1, np.int64), np.full(n, -1, np.int64)
    added = 0
    for place in range(n):
        i = order[place]
        right, top = farthest(fan, i, angle[i], 1.0, 0.0)[0], farthest(fan, i, angle[i], 0.0, 1.0)[1]
        left, bottom = farthest(fan, i, angle[i], -1.0, 0.0)[0], farthest(fan, i, angle[i], 0.0, -1.0)[1]
        best = -np.inf
        for t in range(tries):
            u, v = uniform(seed, PLACES, 2 * (place * tries + t)), uniform(seed, PLACES, 2 * (place * tries + t) + 1)
            px = apart - left + u * max(width - right + left - 2.0 * apart, 0.0)
            py = apart - bottom + v * max(height - top + bottom - 2.0 * apart, 0.0)
            worst = apart
            for q in range(_LEVELS):
                if columns[q] == 0:
                    continue
                far = reach[i] + most[q] + apart
                for a in range(
                    _cell(px - far, 0.0, side[q], columns[q]), _cell(px + far, 0.0, side[q], columns[q]) + 1
                ):
                    for b in range(_cell(py - far, 0.0, side[q], rows[q]), _cell(py + far, 0.0, side[q], rows[q]) + 1):
                        j = head[begin[q] + a * rows[q] + b]
                        while j >= 0 and worst > best:
                            found = _gap(fan, reach, is_round, i, j, x[j] - px, y[j] - py, angle[i], angle[j], apart)
                            worst = min(worst, found[0])
                            j = following[j]
            if worst > best:
                best = worst
                x[i], y[i] = px, py
                if best >= apart:
                    added += 1
                    break
        q = level[i]
        cell = begin[q] + _cell(x[i], 0.0, side[q], columns[q]) * rows[q] + _cell(y[i], 0.0, side[q], rows[q])
        following[i] = head[cell]
        head[cell] = i
    return x, y, added


# --- relaxation --------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def _face(fan, k, angle, ux, uy):
    """Return where the part of body k that faces (ux, uy) begins and ends, along the direction a quarter turn further
    [m]."""
    c, s = np.cos(_FACE), np.sin(_FACE)
    ax, ay = farthest(fan, k, angle, c * ux + s * uy, c * uy - s * ux)
    bx, by = farthest(fan, k, angle, c * ux - s * uy, c * uy + s * ux)
    return ux * ay - uy * ax, ux * by - uy * bx


@njit(cache=True, nogil=True, error_model="numpy")
def _relax(fan, reach, area, x, y, angle, level, width, height, is_round):
    """Moves and turns the grains until nothing overlaps; the height that was needed [m] and the rounds."""
    n = len(x)
    skin, apart = SKIN * reach.min(), APART * reach.min()
    ease = 1.0 / area  # to be moved
    twist = 2.0 / (area * reach * reach)  # to be turned
    if is_round:
        twist[:] = 0.0
    first, second = _pairs(x, y, reach, level, skin)
    x0, y0 = x.copy(), y.copy()
    before = np.inf
    sweeps = since = 0
    while True:
        moved = 0
        overlap = 0.0  # sum of overlaps over radii
        for p in range(len(first)):
            i, j = first[p], second[p]
            dx, dy = x[j] - x[i], y[j] - y[i]
            g, ux, uy = _gap(fan, reach, is_round, i, j, dx, dy, angle[i], angle[j], apart)
            if g >= apart:
                continue
            small = min(reach[i], reach[j])
            moved += 1
            overlap += max(-g, 0.0) / small
            by = AIM * small - g
            if is_round:
                arm_i = arm_j = 0.0
            else:
                # Where they touch, along the tangent: the middle of what both faces share.
                low_i, high_i = _face(fan, i, angle[i], ux, uy)
                high_j, low_j = _face(fan, j, angle[j], -ux, -uy)
                over = ux * dy - uy * dx
                middle = 0.5 * (max(low_i, over - low_j) + min(high_i, over - high_j))
                arm_i, arm_j = -middle, over - middle
            share = by / (ease[i] + ease[j] + arm_i * arm_i * twist[i] + arm_j * arm_j * twist[j])
            x[i] -= share * ease[i] * ux
            y[i] -= share * ease[i] * uy
            x[j] += share * ease[j] * ux
            y[j] += share * ease[j] * uy
            angle[i] -= min(max(share * twist[i] * arm_i, -_TURN), _TURN)
            angle[j] += min(max(share * twist[j] * arm_j, -_TURN), _TURN)
        for i in range(n):
            for wall in range(4):
                nx, ny = (1.0, -1.0, 0.0, 0.0)[wall], (0.0, 0.0, 1.0, -1.0)[wall]
                base = (0.0, -width, 0.0, -height)[wall]
                capacity = nx * x[i] + ny * y[i] - base
                if capacity - reach[i] >= apart:
                    continue
                ax, ay = farthest(fan, i, angle[i], -nx, -ny)
                g = capacity + nx * ax + ny * ay
                if g >= apart:
                    continue
                low, high = _face(fan, i, angle[i], -nx, -ny)
                moved += 1
                overlap += max(-g, 0.0) / reach[i]
                arm = 0.5 * (low + high)
                share = (AIM * reach[i] - g) / (ease[i] + arm * arm * twist[i])
                x[i] += share * ease[i] * nx
                y[i] += share * ease[i] * ny
                angle[i] += min(max(share * twist[i] * arm, -_TURN), _TURN)
        if moved == 0:
            return height, sweeps
        sweeps += 1
        since += 1
        if since == PATIENCE:
            if overlap > 0.8 * before:
                # By as much as the overlaps would fill, within bounds.
                grow = 1.0 + min(max(0.2 * overlap / n, 5e-4), 0.02)
                height *= grow
                for i in range(n):
                    y[i] *= grow
                before = np.inf
            else:
                before = overlap
            since = 0
        far = 0.0
        for i in range(n):
            far = max(far, (x[i] - x0[i]) ** 2 + (y[i] - y0[i]) ** 2)
        if far > 0.25 * skin * skin:
            first, second = _pairs(x, y, reach, level, skin)
            x0[:], y0[:] = x, y


@njit(cache=True, nogil=True, error_model="numpy")
def _closest(fan, x, y, angle, first, second):
    least = np.inf
    for p in range(len(first)):
        i, j = first[p], second[p]
        least = min(least, gap(fan, i, j, x[j] - x[i], y[j] - y[i], angle[i], angle[j], np.inf)[0])
    return least

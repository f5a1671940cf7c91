"""Particles that are much faster than all others: a reach of their own in the lists.

Lists hold until somebody has gone half the skin. Where a few discs are far faster than the rest (one fell through the
floor, some roll down the surface), these few would have all lists built for them every few steps. So each of them gets
a *reach* h: how far it may go before the lists are rebuilt. A pair stands in the list if

    d <= R_i + R_j + h_i + h_j,

with half the skin as the reach of all others. Such a pair may lie several columns apart, which is why the halo is that
many columns wide meanwhile. Pairs of the ordinary search and these are merged in the one order of the list, row by row,
partner by partner, so sums do not know who is fast.

A particle that is *alone* meets nobody on its reach, however far that is: all others and all walls are farther away.
It has no pairs, and its reach grows as it flies off.

Choice and reach come from global numbers: counts, maxima, and a short list that all ranks know (`Fast`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from hpcdem.core.cells import COLUMN, column, first_not_before, row
from hpcdem.core.fields import RADIUS, VX, VY, X, Y

U = np.uint64
LIFE = 100
"""Steps that lists shall last, as far as the reach allows."""
MOST_COLUMNS = 6
"""Widest halo, in columns."""
FEWEST, MOST, SHARE = 16, 1000, 100
"""At most so many are treated as fast: the number of particles over SHARE, but not less than FEWEST or more than
MOST."""
FLEETING = 30
"""Lists that lasted fewer steps are reason enough to ask who is fast: building them takes about three steps."""
GAIN = 4.0
"""Lists must last at least so many times longer."""
CLASSES = 32
"""Classes of speed, each twice as fast as the one before."""
ASKED = 32
"""Largest number of particles, the fastest, that are tested for being alone."""
NEARLY = 0.999
"""Of the free way of a particle that is alone, for rounding."""

# What `survey` says, each reduced by maximum: one over the steps that may pass unseen; 1 if the lists are due, 2 if
# they are late; |v| dt / R of those that are not alone; 1 if a number is not finite.
HURRY, DUE, FAST_STRIDE, FAST_BROKEN = range(4)
STALE, LATE = 1.0, 2.0


@dataclass
class Fast:
    """The fast particles of the whole model, equal on all ranks: gid (m,) i8 ascending, reach (m,) f8 [m], alone (m,)
    bool."""

    gid: np.ndarray
    reach: np.ndarray
    alone: np.ndarray

    @staticmethod
    def none() -> Fast:
        """Nobody."""
        return Fast(np.empty(0, np.int64), np.empty(0), np.empty(0, bool))

    def __len__(self) -> int:
        return len(self.gid)

    def among(self, gids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the fast ones in a table with these ids (n,), ascending, and where they stand in this list."""
        if not len(self):
            return np.empty(0, np.int64), np.empty(0, np.int64)
        at = np.minimum(np.searchsorted(self.gid, gids), len(self) - 1)
        rows = np.flatnonzero(self.gid[at] == gids)
        return rows, at[rows]

    def state(self) -> list:
        """Return the state as JSON values, for checkpoints."""
        return [list(row) for row in zip(self.gid.tolist(), self.reach.tolist(), self.alone.tolist(), strict=True)]

    @staticmethod
    def restored(rows: list) -> Fast:
        """Restore from the result of `state`."""
        gid, reach, alone = zip(*rows, strict=True) if rows else ((), (), ())
        return Fast(np.array(gid, np.int64), np.array(reach, float), np.array(alone, bool))


# ---- who is fast -------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def drift(hot, n_left, n_own, origin, age):
    """Way since the lists were built per step (n_own,) [m]: that of vibration averages out. origin (n_own, 2) [m]."""
    out = np.empty(n_own)
    for c in range(n_own):
        i = n_left + c
        out[c] = math.sqrt((hot[i, X] - origin[c, 0]) ** 2 + (hot[i, Y] - origin[c, 1]) ** 2) / age
    return out


def strides(hot: np.ndarray, dt: float) -> np.ndarray:
    """Way per step at the present speed (n,) [m], of rows (n, 8)."""
    return np.sqrt(hot[:, VX] * hot[:, VX] + hot[:, VY] * hot[:, VY]) * abs(dt)


def classes(way: np.ndarray, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Find the particles that move farther than `limit` [m] per step, as indices of way (n,) [m], and the class of
    each: class k is above limit 2^k, the last one open. Exact, so that it does not matter which rank counts whom."""
    which = np.flatnonzero(way > limit)
    _, exponent = np.frexp(way[which] / limit)
    return which, np.clip(exponent - 1, 0, CLASSES - 1)


def slowest_class(counts: np.ndarray, number: int, walls: float, limit: float) -> int | None:
    """The class from which on particles are treated as fast; None if that would not help.

    counts (CLASSES,): particles of each class; number: of all; walls [m]: the way of the fastest wall per step.
    """
    occupied = np.flatnonzero(counts)
    few = min(max(FEWEST, number // SHARE), MOST)
    if not len(occupied) or counts[occupied[-1]] > few:
        return None
    faster = np.cumsum(counts[::-1])[::-1]
    first = int(np.flatnonzero(faster <= few)[0])
    rest = max(limit * 2.0**first, walls)
    return first if limit * 2.0 ** int(occupied[-1]) >= GAIN * rest else None


@njit(cache=True, nogil=True, error_model="numpy")
def nearest(hot, slow, places, out):
    """Way from each place (k, 2) [m] to the surface of the nearest slow particle, into out (k,).

    hot (n, 8); slow (n,) bool.
    """
    for k in range(len(places)):
        x, y = places[k, 0], places[k, 1]
        least = np.inf
        for i in range(len(hot)):
            d = math.sqrt((hot[i, X] - x) ** 2 + (hot[i, Y] - y) ** 2) - hot[i, RADIUS]
            least = min(least, d if slow[i] else np.inf)
        out[k] = least


def free_path(
    asked: np.ndarray, gaps: np.ndarray, places: np.ndarray, clump: np.ndarray, walls: np.ndarray, half: float
) -> np.ndarray:
    """Compute the distance that fast particles can move without contact (m,) [m]; negative: not at all, or not asked.

    asked (k,): for which of them, and the way gaps (k,) [m] from their centres to the surface of the nearest slow one;
    places (m, 3): x, y, radius [m]; clump (m,) i8: the clump of each, -1 for none; walls (w, 4): ends [m]; half: the
    skin [m].
    """
    out = np.full(len(places), -1.0)
    x, y, r = places.T
    for k, gap in zip(asked, gaps, strict=True):
        way = gap - r[k] - half
        for x1, y1, x2, y2 in walls:
            ex, ey = x2 - x1, y2 - y1
            along = min(max(((x[k] - x1) * ex + (y[k] - y1) * ey) / (ex * ex + ey * ey), 0.0), 1.0)
            way = min(way, math.hypot(x[k] - x1 - along * ex, y[k] - y1 - along * ey) - r[k] - half)
        others = (np.arange(len(x)) != k) & ((clump < 0) | (clump != clump[k]))
        between = np.sqrt((x[others] - x[k]) ** 2 + (y[others] - y[k]) ** 2) - r[others] - r[k]
        out[k] = NEARLY * min(way, 0.5 * between.min(initial=np.inf))
    return out


def wanted_reach(way: np.ndarray, gravity: float, dt: float) -> np.ndarray:
    """Reach (m,) [m] for LIFE steps of so much way each (m,) [m], and a fall in them."""
    return LIFE * way + 0.5 * gravity * (LIFE * dt) ** 2


# ---- how far have they gone --------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def wait(margin, stride, fall):
    """Steps (as a float) that may pass unseen with so much room [m] left at this stride [m] per step: half of it, in
    case things speed up. fall [m]: what gravity adds to the stride in a step, counted twice."""
    steps = np.inf
    if stride > 0.0:
        steps = 0.5 * margin / stride
    if fall > 0.0:
        steps = min(steps, math.sqrt(0.5 * margin / fall))
    return steps


@njit(cache=True, nogil=True, error_model="numpy")
def survey(hot, n_left, origin, rows, reach, alone, dt, fall, box, out):
    """Look at the fast ones: owned rows (m,) with this reach. origin (n_own, 2): where they were when the lists were
    built; box: left, right, bottom, top [m], the lists are due when one has left it. out (4,): HURRY and so on."""
    left, right, bottom, top = box
    for k in range(len(rows)):
        c = rows[k]
        i = n_left + c
        x, y = hot[i, X], hot[i, Y]
        path = math.sqrt((x - origin[c, 0]) ** 2 + (y - origin[c, 1]) ** 2)
        stride = math.sqrt(hot[i, VX] ** 2 + hot[i, VY] ** 2) * abs(dt)
        if not (path < np.inf and stride < np.inf):
            out[FAST_BROKEN] = 1.0
            continue
        margin = reach[k] - path
        if not alone[k]:
            out[FAST_STRIDE] = max(out[FAST_STRIDE], stride / hot[i, RADIUS])
        if margin < 0.0:
            out[DUE] = LATE
        elif margin < stride or not (left <= x <= right and bottom <= y <= top):
            out[DUE] = max(out[DUE], STALE)
        else:
            out[HURRY] = max(out[HURRY], 1.0 / wait(margin, stride, fall))


# ---- their pairs -------------------------------------------------------------------------------------------------


def pairs(
    hot: np.ndarray, cell: np.ndarray, rows: np.ndarray, reach: np.ndarray, half: float, columns: int, clump: np.ndarray
) -> np.ndarray:
    """Pairs of the fast ones with anybody, from the storage of a rank.

    rows (m,): storage rows of the fast, ascending, and their reach [m]; half [m]: the reach of the others; columns: how
    many lie between partners at most; the rest as in neighbours.build. Returns row * 2^32 + partner (k,) i8, ascending.
    """
    reaches = np.full(len(hot), half)
    reaches[rows] = reach
    is_fast = np.zeros(len(hot), bool)
    is_fast[rows] = True
    out = np.empty(64 * len(rows), np.int64)
    while (n := int(_pairs(hot, cell, rows, reaches, is_fast, columns, clump, out))) > len(out):
        out = np.empty(n, np.int64)
    return np.sort(out[:n])


@njit(cache=True, nogil=True, error_model="numpy")
def _pairs(hot, cell, rows, reaches, is_fast, columns, clump, out):
    """Returns the number of pairs; those past the end of `out` are counted only."""
    n = 0
    for i in rows:
        at, level = column(cell[i]), row(cell[i])
        for c in range(at - columns, at + columns + 1):
            first = first_not_before(cell, c * COLUMN + level - columns, 0, len(cell))
            end = first_not_before(cell, c * COLUMN + level + columns + 1, first, len(cell))
            for j in range(first, end):
                if j == i or (is_fast[j] and j < i):  # of two fast ones the later leaves the pair to the earlier
                    continue
                if len(clump) > 0 and clump[i] >= 0 and clump[i] == clump[j]:
                    continue
                dx, dy = hot[j, X] - hot[i, X], hot[j, Y] - hot[i, Y]
                far = hot[i, RADIUS] + hot[j, RADIUS] + reaches[i] + reaches[j]
                if dx * dx + dy * dy <= far * far:
                    if n < len(out):
                        out[n] = min(i, j) * COLUMN + max(i, j)
                    n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def merge(t, begin, n, more, cut, lo, poff, ptr, row, partner, fs, bond, u_made):
    """Put the pairs `more` (ascending) of block t that its list of n slots from `begin` on does not hold into their
    places, without histories. There must be room. Returns the number of slots."""
    a, b = cut[t], cut[t + 1]
    fresh = np.empty(len(more), np.int64)
    m = 0
    for key in more:
        i, j = key // COLUMN, key % COLUMN
        if not (lo[t] <= i < b and (i >= a or a <= j < b)):
            continue
        first, end = ptr[poff[t] + i - lo[t]], ptr[poff[t] + i - lo[t] + 1]
        known = False
        for k in range(first, end):
            known |= partner[k] == j
        if not known:
            fresh[m] = key
            m += 1
    source, into, e = begin + n - 1, begin + n + m - 1, m - 1
    i = b - 1
    while e >= 0:  # from the end, so that nothing is overwritten before it has moved
        first = ptr[poff[t] + i - lo[t]]
        ptr[poff[t] + i - lo[t] + 1] = into + 1
        while source >= first or (e >= 0 and fresh[e] // COLUMN == i):
            if e >= 0 and fresh[e] // COLUMN == i and (source < first or partner[source] < fresh[e] % COLUMN):
                row[into], partner[into] = i, fresh[e] % COLUMN
                fs[into], bond[into], u_made[into] = 0.0, 0, 0.0
                e -= 1
            else:
                row[into], partner[into] = row[source], partner[source]
                fs[into], bond[into], u_made[into] = fs[source], bond[source], u_made[source]
                source -= 1
            into -= 1
        i -= 1
    return n + m

"""The pair list: who may touch whom until someone has moved half the skin.

Particles are stored in one global order, (column, row, gid), a column being a vertical slice of the plane at least
one reach wide. A rank holds a contiguous piece of that order, ``[left ghosts | owned | right ghosts]``. List rows
follow storage order, each pair stands in the row of its earlier partner, and left ghosts have rows too, with the pairs
that touch an owned particle. This is what makes a particle's sum of forces the same on any rank count.

Threads repeat it one level down: a block of consecutive rows has its own list, including the pairs that reach in from
the rows before it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit, prange

from hpcdem.fields import GID, RADIUS, WIDTH, X, Y
from hpcdem.physics.dem import walls as wall_kernels
from hpcdem.physics.dem.contacts import LONGEST2


class Blocks(NamedTuple):
    """Rows of the blocks: owned rows cut[t] : cut[t+1]; rows lo[t] : hi[t] may receive force from block t; poff and
    foff: where the block's row pointers and force rows begin."""

    cut: np.ndarray
    lo: np.ndarray
    hi: np.ndarray
    poff: np.ndarray
    foff: np.ndarray


@dataclass
class Histories:
    """What contacts remember, per owned particle (CSR): partner gid (-1 - w for wall w), shear force [N], a second
    number (overlap at bonding of a pair [m]; side of a wall contact) and the bond type. Both partners of a pair carry
    it."""

    ptr: np.ndarray
    partner: np.ndarray
    fs: np.ndarray
    extra: np.ndarray
    bond: np.ndarray

    @staticmethod
    def empty(n: int) -> Histories:
        """No memory for n particles."""
        return Histories(
            np.zeros(n + 1, np.int64), np.empty(0, np.int64), np.empty(0), np.empty(0), np.empty(0, np.int32)
        )

    def counts(self) -> np.ndarray:
        """Number of entries per particle (n,)."""
        return np.diff(self.ptr)

    def rows(self) -> np.ndarray:
        """Entries packed as (m, 4) f8 rows for travel: partner and bond as int64 bits."""
        out = np.empty((len(self.partner), 4))
        bits = out.view(np.int64)
        bits[:, 0], out[:, 1], out[:, 2], bits[:, 3] = self.partner, self.fs, self.extra, self.bond
        return out

    @staticmethod
    def from_rows(counts: np.ndarray, rows: np.ndarray) -> Histories:
        """Inverse of `counts` and `rows`."""
        ptr = np.concatenate(([0], np.cumsum(counts, dtype=np.int64)))
        bits = rows.view(np.int64)
        return Histories(
            ptr, bits[:, 0].copy(), rows[:, 1].copy(), rows[:, 2].copy(), bits[:, 3].astype(np.int32)
        )  # fmt: skip

    def take(self, order: np.ndarray) -> Histories:
        """The histories of the particles in `order` (indices, with or without some left out)."""
        counts = self.counts()[order]
        ptr = np.concatenate(([0], np.cumsum(counts, dtype=np.int64)))
        index = np.repeat(self.ptr[:-1][order] - ptr[:-1], counts) + np.arange(ptr[-1])
        return Histories(ptr, self.partner[index], self.fs[index], self.extra[index], self.bond[index])

    def extended(self, n: int) -> Histories:
        """With n more particles at the end that remember nothing."""
        ptr = np.concatenate((self.ptr, np.full(n, self.ptr[-1])))
        return Histories(ptr, self.partner, self.fs, self.extra, self.bond)

    def keep(self, mask: np.ndarray) -> Histories:
        """Only the entries where mask (m,) is true."""
        owner = np.repeat(np.arange(len(self.ptr) - 1), self.counts())[mask]
        ptr = np.concatenate(([0], np.cumsum(np.bincount(owner, minlength=len(self.ptr) - 1), dtype=np.int64)))
        return Histories(ptr, self.partner[mask], self.fs[mask], self.extra[mask], self.bond[mask])


@njit(cache=True, nogil=True)
def _fill(
    t, begin, room, hot, ihot, cx, cy, n_left, n_own, cut, lo, hi, poff, skin, bond2,
    hptr, hpartner, hfs, hextra, hbond, ptr, partner, fs, bond, u_made,
):  # fmt: skip
    """List of block t into slots begin : begin + room; nothing past the room is written.

    Returns slots needed, bonds placed (counted where the block owns the earlier partner), longest bonded distance
    squared.
    """
    a, b, last = cut[t], cut[t + 1], hi[t]
    n = 0
    bonds_here = 0
    longest2 = 0.0
    col = 0
    other = lo[t]
    for i in range(lo[t], b):
        ptr[poff[t] + i - lo[t]] = begin + n
        if i == lo[t] or cx[i] != col:
            col = cx[i]
            while other < last and cx[other] <= col:
                other += 1
        while other < last and cx[other] == col + 1 and cy[other] < cy[i] - 1:
            other += 1
        xi, yi, ri, gi = hot[i, X], hot[i, Y], hot[i, RADIUS], ihot[i, GID]
        own_i = n_left <= i < n_left + n_own
        j = i + 1
        in_column = True
        while True:
            if in_column and (j >= last or cx[j] != col or cy[j] > cy[i] + 1):
                in_column = False
                j = other
            if not in_column and (j >= last or cx[j] != col + 1 or cy[j] > cy[i] + 1):
                break
            if i < a and (j < a or j >= b):
                j += 1
                continue
            dx = hot[j, X] - xi
            dy = hot[j, Y] - yi
            d2 = dx * dx + dy * dy
            reach = ri + hot[j, RADIUS] + skin
            near = d2 <= reach * reach
            if near or d2 <= bond2:
                found = -1
                c = i - n_left if own_i else j - n_left
                g = ihot[j, GID] if own_i else gi
                for q in range(hptr[c], hptr[c + 1]):
                    if hpartner[q] == g:
                        found = q
                        break
                if near or (found >= 0 and hbond[found] != 0):
                    if n < room:
                        k = begin + n
                        partner[k] = j
                        if found >= 0:
                            fs[k], bond[k], u_made[k] = hfs[found], hbond[found], hextra[found]
                            if hbond[found] != 0:
                                longest2 = max(longest2, d2)
                                if i >= a:
                                    bonds_here += 1
                        else:
                            fs[k], bond[k], u_made[k] = 0.0, 0, 0.0
                    n += 1
            j += 1
    ptr[poff[t] + b - lo[t]] = begin + n
    return n, bonds_here, longest2


@njit(cache=True, nogil=True)
def _fill_blocks(n_blocks, need, placed, longest2, begin, room, *args):
    for t in range(n_blocks):
        need[t], placed[t], longest2[t] = _fill(t, begin[t], room[t], *args)


@njit(cache=True, parallel=True)
def _fill_blocks_threaded(
    n_blocks, need, placed, longest2, begin, room, hot, ihot, cx, cy, n_left, n_own, cut, lo, hi, poff, skin, bond2,
    hptr, hpartner, hfs, hextra, hbond, ptr, partner, fs, bond, u_made,
):  # fmt: skip
    for t in prange(n_blocks):
        need[t], placed[t], longest2[t] = _fill(
            t, begin[t], room[t], hot, ihot, cx, cy, n_left, n_own, cut, lo, hi, poff, skin, bond2,
            hptr, hpartner, hfs, hextra, hbond, ptr, partner, fs, bond, u_made,
        )  # fmt: skip


@njit(cache=True, nogil=True)
def _collect(blocks, n_blocks, n_left, ihot, ptr, partner, fs, bond, u_made, count, at, hpartner, hfs, hextra, hbond):
    """Histories of the owned particles from the pair slots. With an empty hpartner only counts."""
    cut, lo, _, poff, _ = blocks
    only_count = len(hpartner) == 0
    for t in range(n_blocks):
        a, b = cut[t], cut[t + 1]
        p = poff[t] - lo[t]
        for i in range(lo[t], b):
            for k in range(ptr[p + i], ptr[p + i + 1]):
                if fs[k] == 0.0 and bond[k] == 0:
                    continue
                j = partner[k]
                if a <= i < b:
                    c = i - n_left
                    if only_count:
                        count[c] += 1
                    else:
                        q = at[c]
                        at[c] += 1
                        hpartner[q], hfs[q], hextra[q], hbond[q] = ihot[j, GID], fs[k], u_made[k], bond[k]
                if a <= j < b:
                    c = j - n_left
                    if only_count:
                        count[c] += 1
                    else:
                        q = at[c]
                        at[c] += 1
                        hpartner[q], hfs[q], hextra[q], hbond[q] = ihot[i, GID], fs[k], u_made[k], bond[k]


class ContactLists:
    """Pair slots and wall slots of this rank, cut into blocks, with the force rows they add to.

    Built by `build`; `histories` hands back what the slots remember. All arrays are plain numpy for the kernels.

    Pair slots: partner (storage row), fs [N], bond (type), u_made [m]; row i of block t has the slots ptr[poff[t] + i -
    lo[t]] up to the next. Wall slots: slot_row, slot_wall, slot_fs [N], slot_side; block t has wptr[t] : wptr[t+1].
    """

    ptr: np.ndarray
    partner: np.ndarray
    fs: np.ndarray
    bond: np.ndarray
    u_made: np.ndarray
    wptr: np.ndarray
    slot_row: np.ndarray
    slot_wall: np.ndarray
    slot_fs: np.ndarray
    slot_side: np.ndarray
    new_side: np.ndarray
    n_pairs: int

    def __init__(self, n_left: int, n_own: int, blocks: Blocks) -> None:
        self.n_left, self.n_own, self.blocks = n_left, n_own, blocks
        self.n_blocks = len(blocks.lo)
        self.force = np.zeros((int((blocks.hi - blocks.lo).sum()), 4))
        self.tally = np.zeros((self.n_blocks, WIDTH))
        self.bonds_placed = 0

    def histories(self, ihot: np.ndarray) -> Histories:
        """What the contacts of the owned particles remember now."""
        count = np.zeros(self.n_own, np.int64)
        args = (self.blocks, self.n_blocks, self.n_left, ihot, self.ptr, self.partner, self.fs, self.bond, self.u_made)
        none_i, none_f, none_b = np.empty(0, np.int64), np.empty(0), np.empty(0, np.int32)
        _collect(*args, count, none_i, none_i, none_f, none_f, none_b)
        alive = (self.slot_fs != 0.0) | (self.slot_side != 0.0)
        wall_row = self.slot_row[alive] - self.n_left
        wall_count = np.bincount(wall_row, minlength=self.n_own)
        ptr = np.concatenate(([0], np.cumsum(count + wall_count, dtype=np.int64)))
        m = int(ptr[-1])
        hist = Histories(ptr, np.empty(m, np.int64), np.empty(m), np.empty(m), np.zeros(m, np.int32))
        if m == 0:
            return hist
        at = ptr[:-1].copy()
        _collect(*args, count, at, hist.partner, hist.fs, hist.extra, hist.bond)
        if len(wall_row):  # the wall entries of a particle follow its pair entries
            first = np.concatenate(([0], np.cumsum(wall_count)))[wall_row]
            q = at[wall_row] + np.arange(len(wall_row)) - first
            hist.partner[q] = -1 - self.slot_wall[alive]
            hist.fs[q], hist.extra[q] = self.slot_fs[alive], self.slot_side[alive]
        return hist

    def owned_forces(self) -> np.ndarray:
        """Sum of contact forces and torque on each owned particle, (n_own, 3) f8 copy."""
        out = np.empty((self.n_own, 3))
        cut, lo, _, _, foff = self.blocks
        for t in range(self.n_blocks):
            a, b = cut[t], cut[t + 1]
            out[a - self.n_left : b - self.n_left] = self.force[foff[t] + a - lo[t] : foff[t] + b - lo[t], :3]
        return out

    def set_owned_forces(self, values: np.ndarray) -> None:
        """Inverse of `owned_forces`."""
        cut, lo, _, _, foff = self.blocks
        for t in range(self.n_blocks):
            a, b = cut[t], cut[t + 1]
            self.force[foff[t] + a - lo[t] : foff[t] + b - lo[t], :3] = values[a - self.n_left : b - self.n_left]

    def longest_bond2(self) -> float:
        """Longest bonded distance squared at the last build or force evaluation [m^2]."""
        return float(self.tally[:, LONGEST2].max())


def make_blocks(cx: np.ndarray, n_left: int, n_own: int, n_blocks: int) -> Blocks:
    """Cut the owned rows into n_blocks runs of equal length, and find the rows each may touch (cx ascending)."""
    cut = n_left + (np.arange(n_blocks + 1, dtype=np.int64) * n_own) // n_blocks
    lo, hi = cut[:-1].copy(), cut[:-1].copy()
    for t in range(n_blocks):
        if cut[t + 1] > cut[t]:
            lo[t] = np.searchsorted(cx, cx[cut[t]] - 1, side="left")
            hi[t] = np.searchsorted(cx, cx[cut[t + 1] - 1] + 1, side="right")
    # Left ghosts and earlier rows beyond the previous column cannot reach in, so they are no rows of the list.
    rows = np.maximum(cut[1:] - lo, 0) + 1
    poff = np.concatenate(([0], np.cumsum(rows)[:-1])).astype(np.int64)
    foff = np.concatenate(([0], np.cumsum(hi - lo)[:-1])).astype(np.int64)
    return Blocks(cut, lo, hi, poff, foff)


def build(
    hot: np.ndarray,
    cx: np.ndarray,
    cy: np.ndarray,
    n_left: int,
    n_own: int,
    hist: Histories,
    walls: np.ndarray,
    skin: float,
    bond_reach: float,
    n_blocks: int,
) -> ContactLists:
    """Make the lists for particles stored in global order.

    hot (n, 8) f8 rows [left ghosts | owned | right ghosts]; cx, cy (n,) i8 cells; hist: of the owned particles in
    storage order; walls (w, 8) f8; skin [m]; bond_reach [m]: bonded pairs are listed up to this distance.
    """
    ihot = hot.view(np.int64)
    lists = ContactLists(n_left, n_own, make_blocks(cx, n_left, n_own, n_blocks))
    blocks = lists.blocks
    span = np.maximum(blocks.cut[1:] - blocks.lo, 0)
    lists.ptr = np.zeros(int((span + 1).sum()), np.int64)
    need, placed, longest2 = np.zeros(n_blocks, np.int64), np.zeros(n_blocks, np.int64), np.zeros(n_blocks)
    room = 4 * span + 64
    packed = (hist.ptr, hist.partner, hist.fs, hist.extra, hist.bond)
    fill = _fill_blocks if n_blocks == 1 else _fill_blocks_threaded
    while True:
        begin = np.concatenate(([0], np.cumsum(room)[:-1])).astype(np.int64)
        m = int(room.sum())
        slots = (lists.ptr, np.empty(m, np.int32), np.empty(m), np.empty(m, np.int32), np.empty(m))
        fill(
            n_blocks, need, placed, longest2, begin, room, hot, ihot, cx, cy, n_left, n_own,
            blocks.cut, blocks.lo, blocks.hi, blocks.poff, skin, bond_reach**2, *packed, *slots,
        )  # fmt: skip
        if (need <= room).all():
            break
        room = np.maximum(room, need + need // 8 + 64)
    _, lists.partner, lists.fs, lists.bond, lists.u_made = slots
    lists.bonds_placed = int(placed.sum())
    lists.tally[:, LONGEST2] = longest2
    lists.n_pairs = int(need.sum())
    _wall_slots(lists, hot, hist, walls, skin)
    return lists


def _wall_slots(lists: ContactLists, hot: np.ndarray, hist: Histories, walls: np.ndarray, skin: float) -> None:
    """Slots of particles near walls, with their histories."""
    n = room = lists.n_own // 4 + 64
    while n >= room:
        room = n + 64
        rows, which = np.empty(room, np.int64), np.empty(room, np.int64)
        n = wall_kernels.near(hot, lists.n_left, lists.n_own, walls, skin, hist.ptr, hist.partner, rows, which)
    lists.slot_row, lists.slot_wall = rows[:n].copy(), which[:n].copy()
    lists.slot_fs, lists.slot_side, lists.new_side = np.zeros(n), np.zeros(n), np.zeros(n)
    old = np.flatnonzero(hist.partner < 0)
    if len(old):
        owner = np.repeat(np.arange(lists.n_own), hist.counts())[old]
        n_walls = len(walls)
        key = (lists.slot_row - lists.n_left) * n_walls + lists.slot_wall
        old_key = owner * n_walls + (-1 - hist.partner[old])
        # A wall that is gone takes its histories with it; the others are all in the list, by construction of `near`.
        known = -1 - hist.partner[old] < n_walls
        at = np.searchsorted(key, old_key[known])
        lists.slot_fs[at], lists.slot_side[at] = hist.fs[old[known]], hist.extra[old[known]]
    lists.wptr = np.searchsorted(lists.slot_row, lists.blocks.cut).astype(np.int64)

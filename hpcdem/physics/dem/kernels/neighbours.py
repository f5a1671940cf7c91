"""The pair list: who may touch whom until someone has moved half the skin.

Particles are stored in one global order, (column, row, gid), a column being a vertical slice of the plane at least
one reach wide. A rank holds a contiguous piece of that order, ``[left ghosts | owned | right ghosts]``. List rows
follow storage order, each pair stands in the row of its earlier partner, and left ghosts have rows too, with the pairs
that touch an owned particle. This is what makes a particle's sum of forces the same on any rank count.

Threads repeat it one level down: a block of consecutive rows has its own list, including the pairs that reach in from
the rows before it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numba import njit, prange

from hpcdem.core.cells import COLUMN, column
from hpcdem.core.fields import GID, RADIUS, WIDTH, X, Y
from hpcdem.core.memory import aligned
from hpcdem.numerics.on_threads import on_threads
from hpcdem.physics.dem.kernels import fast, histories, wall_slots
from hpcdem.physics.dem.kernels.contacts import LONGEST2
from hpcdem.physics.dem.kernels.histories import BOND, EXTRA, PARTNER, SHEAR, Histories
from hpcdem.physics.dem.kernels.histories import WIDTH as ENTRY

__all__ = ["Blocks", "ContactLists", "Histories", "build", "make_blocks"]

U = np.uint64
USUAL = 8
"""As many contacts as a particle usually has, or more."""
SLOTS_PER_ROW = 6
"""Room for the list at first; discs of similar size need half of it."""
SLOTS_IN_CLUMPS = 24
"""The same where members of clumps lie upon each other; such pairs leave the list again."""
NO_ROWS, NO_REACH = np.empty(0, np.int64), np.empty(0)


class Blocks(NamedTuple):
    """Rows of the blocks: owned rows cut[t] : cut[t+1]; rows lo[t] : hi[t] may receive force from block t; poff and
    foff: where the block's row pointers and force rows begin."""

    cut: np.ndarray
    lo: np.ndarray
    hi: np.ndarray
    poff: np.ndarray
    foff: np.ndarray


@njit(cache=True, nogil=True, error_model="numpy")
def _find_pairs(t, begin, room, hot, cell, cut, lo, hi, poff, skin, bond2, ptr, row, partner):
    """Pairs of block t into the slots begin : begin + room, row by row: nearer than contact plus skin, or than the root
    of bond2. Returns the slots needed; an upper bound if the room is too small."""
    a, b, last = cut[t], cut[t + 1], hi[t]
    k = U(begin)
    overflow = 0
    s = lo[t]
    above = right = right_end = s
    ptr[poff[t]] = begin
    while s < b:
        # All particles of a cell have the same candidates: the rest of their cell and the cell above, which follow
        # each other in storage, and the three cells next to them in the next column, which do so too.
        key = cell[s]
        e = s + 1
        while e < last and cell[e] == key:
            e += 1
        above = max(above, e)
        while above < last and cell[above] <= key + 1:
            above += 1
        right = max(right, above)
        while right < last and cell[right] < key + COLUMN - 1:
            right += 1
        right_end = max(right_end, right)
        while right_end < last and cell[right_end] <= key + COLUMN + 1:
            right_end += 1
        for i in range(s, min(e, b)):
            first, first_end, second, second_end = i + 1, above, right, right_end
            if i < a:  # a row that reaches in from before the block: pairs with the block only
                first, first_end = max(first, a), min(first_end, b)
                second, second_end = max(second, a), min(second_end, b)
            wish = max(first_end - first, 0) + max(second_end - second, 0)
            if overflow > 0 or np.int64(k) - begin + wish > room:
                overflow += wish
                continue
            # Written for every candidate, kept if near: a jump that nobody can foresee would cost more.
            xi, yi, ri = hot[U(i), X], hot[U(i), Y], hot[U(i), RADIUS]
            for j in range(U(first), U(max(first, first_end))):
                dx = hot[j, X] - xi
                dy = hot[j, Y] - yi
                reach = ri + hot[j, RADIUS] + skin
                row[k], partner[k] = i, j
                k += U(dx * dx + dy * dy <= max(reach * reach, bond2))
            for j in range(U(second), U(max(second, second_end))):
                dx = hot[j, X] - xi
                dy = hot[j, Y] - yi
                reach = ri + hot[j, RADIUS] + skin
                row[k], partner[k] = i, j
                k += U(dx * dx + dy * dy <= max(reach * reach, bond2))
            ptr[poff[t] + i + 1 - lo[t]] = k
        s = e
    return np.int64(k) - begin + overflow


@njit(cache=True, nogil=True, error_model="numpy")
def _drop_siblings(t, clump, cut, lo, poff, ptr, row, partner):
    """Keep the pairs of block t that are not members of the same clump; returns how many."""
    begin = ptr[poff[t]]
    k = first = begin
    for i in range(lo[t], cut[t + 1]):
        last = ptr[poff[t] + i + 1 - lo[t]]
        for q in range(first, last):
            j = partner[q]
            row[k], partner[k] = i, j
            k += (clump[i] < 0) | (clump[i] != clump[j])
        first = last
        ptr[poff[t] + i + 1 - lo[t]] = k
    return k - begin


@njit(cache=True, nogil=True, error_model="numpy")
def _remember(begin, end, ihot, n_left, n_own, where, hptr, hrows, hbits, row, partner, fs, bond, u_made, memory):
    """Give the slots begin : end what their pairs remember, which stands with both ends."""
    for k in range(U(begin), U(end)):
        i, j = np.int64(row[k]), np.int64(partner[k])
        own_i = n_left <= i < n_left + n_own
        gid = ihot[U(j if own_i else i), GID]
        c = U(where[U((i if own_i else j) - n_left)])
        first, last = hptr[c], hptr[c + U(1)]
        found, q = np.int64(-1), first
        if first + USUAL <= len(hbits):  # always as many, so that no jump depends on their number
            for d in range(USUAL):
                q = first + d
                found = q if (hbits[U(q), PARTNER] == gid) & (q < last) else found
            q = first + USUAL
        while q < last:
            found = q if hbits[U(q), PARTNER] == gid else found
            q += 1
        at = U(max(found, 0))
        fs[k] = hrows[at, SHEAR] if found >= 0 else 0.0
        bond[k] = hbits[at, BOND] if found >= 0 else 0
        u_made[k] = hrows[at, EXTRA] if found >= 0 else 0.0
        for m in range(memory.shape[1]):
            memory[k, m] = hrows[at, ENTRY + m] if found >= 0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _drop_far(t, hot, cut, lo, poff, skin, ptr, row, partner, fs, bond, u_made, memory):
    """Keep the pairs of block t that are near or bonded. Returns slots, bonds (counted where the block owns the earlier
    partner), longest bonded distance squared."""
    begin = ptr[poff[t]]
    k = first = begin
    bonds_here = 0
    longest2 = 0.0
    for i in range(lo[t], cut[t + 1]):
        last = ptr[poff[t] + i + 1 - lo[t]]
        for q in range(first, last):
            j = partner[q]
            dx = hot[j, X] - hot[i, X]
            dy = hot[j, Y] - hot[i, Y]
            d2 = dx * dx + dy * dy
            reach = hot[i, RADIUS] + hot[j, RADIUS] + skin
            bonded = bond[q] != 0
            row[k], partner[k], fs[k], bond[k], u_made[k] = i, j, fs[q], bond[q], u_made[q]
            for m in range(memory.shape[1]):
                memory[k, m] = memory[q, m]
            longest2 = max(longest2, d2 if bonded else 0.0)
            bonds_here += bonded & (i >= cut[t])
            k += bonded | (d2 <= reach * reach)
        first = last
        ptr[poff[t] + i + 1 - lo[t]] = k
    return k - begin, bonds_here, longest2


@njit(cache=True, nogil=True, error_model="numpy")
def _fill(
    t, begin, room, more, hot, ihot, cell, clump, n_left, n_own, cut, lo, hi, poff, skin, bond2,
    where, hptr, hrows, hbits, ptr, row, partner, fs, bond, u_made, memory,
):  # fmt: skip
    """List of block t into slots begin : begin + room; nothing past the room is written.

    bond2 [m^2]: bonded pairs are listed up to this distance, negative without bonds; more (k,) i8: pairs of fast
    particles (fast.py). Returns slots needed, bonds placed, longest bonded distance squared.
    """
    n, placed, longest2 = _fill_near(
        t, begin, room, hot, ihot, cell, clump, n_left, n_own, cut, lo, hi, poff, skin, bond2,
        where, hptr, hrows, hbits, ptr, row, partner, fs, bond, u_made, memory,
    )  # fmt: skip
    if len(more) == 0 or n + len(more) > room:
        return n + len(more), placed, longest2
    n = fast.merge(t, begin, n, more, cut, lo, poff, ptr, row, partner, fs, bond, u_made)
    if len(hrows) > 0:  # of a restart, where lists are those of earlier places, fast ones may touch by now
        _remember(
            begin, begin + n, ihot, n_left, n_own, where, hptr, hrows, hbits, row, partner, fs, bond, u_made, memory
        )
    else:
        memory[begin : begin + n] = 0.0
    return n, placed, longest2


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_near(
    t, begin, room, hot, ihot, cell, clump, n_left, n_own, cut, lo, hi, poff, skin, bond2,
    where, hptr, hrows, hbits, ptr, row, partner, fs, bond, u_made, memory,
):  # fmt: skip
    """The pairs that are nearer than contact plus skin, or bonded; as `_fill`."""
    n = _find_pairs(t, begin, room, hot, cell, cut, lo, hi, poff, skin, bond2, ptr, row, partner)
    if n > room:
        return n, 0, 0.0
    if len(clump) > 0:
        n = _drop_siblings(t, clump, cut, lo, poff, ptr, row, partner)
    if len(hrows) == 0:
        fs[begin : begin + n], bond[begin : begin + n], u_made[begin : begin + n] = 0.0, 0, 0.0
        memory[begin : begin + n] = 0.0
        return n, 0, 0.0
    _remember(begin, begin + n, ihot, n_left, n_own, where, hptr, hrows, hbits, row, partner, fs, bond, u_made, memory)
    if bond2 < 0.0:
        return n, 0, 0.0
    return _drop_far(t, hot, cut, lo, poff, skin, ptr, row, partner, fs, bond, u_made, memory)


@on_threads
def _fill_blocks(n_blocks, need, placed, longest2, begin, room, *args):
    for t in prange(n_blocks):
        need[t], placed[t], longest2[t] = _fill(t, begin[t], room[t], *args)


class ContactLists:
    """Pair slots and wall slots of this rank, cut into blocks, with the force rows they add to.

    Built by `build`; `histories` hands back what the slots remember. All arrays are plain numpy for the kernels.

    Pair slots: row and partner (storage rows, row < partner), fs [N], bond (type), u_made [m] (of a user law its
    normal force [N]) and memory of that law or of rolling (slots, columns); row i of block t has the slots ptr[poff[t]
    + i - lo[t]] up to the next; slots of a block follow each other. Wall slots: slot_row, slot_wall, slot_fs [N],
    slot_side, slot_memory, sorted by row, then wall; block t has wptr[t] : wptr[t+1].
    """

    ptr: np.ndarray
    row: np.ndarray
    partner: np.ndarray
    fs: np.ndarray
    bond: np.ndarray
    u_made: np.ndarray
    memory: np.ndarray
    wptr: np.ndarray
    slot_row: np.ndarray
    slot_wall: np.ndarray
    slot_fs: np.ndarray
    slot_side: np.ndarray
    slot_memory: np.ndarray
    new_side: np.ndarray
    n_pairs: int

    def pieces(self) -> Iterator[tuple[np.ndarray, np.ndarray, int, int]]:
        """Of each block: row and partner of its pair slots, its first owned storage row and the one after its last.

        All pairs of a particle are in the piece that owns it, in one order for any ranks and threads."""
        b = self.blocks
        for t in range(self.n_blocks):
            first, end = self.ptr[b.poff[t]], self.ptr[b.poff[t] + max(b.cut[t + 1] - b.lo[t], 0)]
            yield self.row[first:end], self.partner[first:end], int(b.cut[t]), int(b.cut[t + 1])

    def __init__(self, n_left: int, n_own: int, blocks: Blocks) -> None:
        self.n_left, self.n_own, self.blocks = n_left, n_own, blocks
        self.n_blocks = len(blocks.lo)
        self.force = aligned((int((blocks.hi - blocks.lo).sum()), 4))
        self.force[:] = 0.0
        self.tally = np.zeros((self.n_blocks, WIDTH))
        self.bonds_placed = 0

    def histories(self, ihot: np.ndarray, stamp: float = 0.0) -> Histories:
        """Return what the contacts of the owned particles remember now; stamp: see `histories.taken_out`."""
        return histories.taken_out(self, ihot, stamp)

    def force_rows(self) -> np.ndarray:
        """Rows (n_own,) of `force` in which the owned particles have their sums."""
        rows = np.empty(self.n_own, np.int64)
        cut, lo, _, _, foff = self.blocks
        for t in range(self.n_blocks):
            a, b = cut[t], cut[t + 1]
            rows[a - self.n_left : b - self.n_left] = foff[t] - lo[t] + np.arange(a, b)
        return rows

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


@njit(cache=True, nogil=True, error_model="numpy")
def gauge(hot, n_left, n_own, box):
    """Largest radius of the owned particles [m], and 1 if a centre is outside box (left, right, bottom, top) [m]."""
    left, right, bottom, top = box
    largest = 0.0
    inside = True
    for i in range(n_left, n_left + n_own):
        largest = max(largest, hot[i, RADIUS])
        x, y = hot[i, X], hot[i, Y]
        inside &= (x >= left) & (x <= right) & (y >= bottom) & (y <= top)
    return largest, 0.0 if inside else 1.0


def make_blocks(cell: np.ndarray, n_left: int, n_own: int, n_blocks: int, columns: int = 1) -> Blocks:
    """Cut the owned rows into n_blocks runs of equal length, and find the rows each may touch (cell ascending), up to
    so many columns away."""
    cut = n_left + (np.arange(n_blocks + 1, dtype=np.int64) * n_own) // n_blocks
    lo, hi = cut[:-1].copy(), cut[:-1].copy()
    for t in range(n_blocks):
        if cut[t + 1] > cut[t]:
            # All of the columns before and after: rows beyond them cannot reach in, so they are no rows of the list.
            lo[t] = np.searchsorted(cell, int(column(cell[cut[t]]) - columns) * COLUMN - COLUMN // 2)
            hi[t] = np.searchsorted(cell, int(column(cell[cut[t + 1] - 1]) + columns + 1) * COLUMN - COLUMN // 2)
    rows = np.maximum(cut[1:] - lo, 0) + 1
    poff = np.concatenate(([0], np.cumsum(rows)[:-1])).astype(np.int64)
    foff = np.concatenate(([0], np.cumsum(hi - lo)[:-1])).astype(np.int64)
    return Blocks(cut, lo, hi, poff, foff)


def build(
    hot: np.ndarray,
    cell: np.ndarray,
    n_left: int,
    n_own: int,
    hist: Histories,
    where: np.ndarray,
    walls: np.ndarray,
    side: float,
    largest: float,
    skin: float,
    bond_reach: float,
    n_blocks: int,
    clump: np.ndarray | None = None,
    fast_ones: fast.Fast | None = None,
    columns: int = 1,
    left: float = 0.0,
) -> ContactLists:
    """Make the lists for particles stored in global order.

    hot (n, 8) f8 rows [left ghosts | owned | right ghosts]; cell (n,) i8: keys of their cells of this side [m]; hist:
    of the owned particles, that of the c-th stands at where[c]; walls (w, 8) f8; largest radius [m]; skin [m];
    bond_reach [m]: bonded pairs are listed up to this distance, 0 without bonds; clump (n,) i8: number of the rigid
    clump of each row, -1 for none: members of one clump are no pairs (None: no clumps); fast_ones: particles
    with a reach of their own, whose partners lie up to so many columns away; left [m]: x where column 0 begins.
    """
    ihot = hot.view(np.int64)
    lists = ContactLists(n_left, n_own, make_blocks(cell, n_left, n_own, n_blocks, columns))
    blocks = lists.blocks
    span = np.maximum(blocks.cut[1:] - blocks.lo, 0)
    lists.ptr = np.zeros(int((span + 1).sum()), np.int64)
    need, placed, longest2 = np.zeros(n_blocks, np.int64), np.zeros(n_blocks, np.int64), np.zeros(n_blocks)
    room = (SLOTS_PER_ROW if clump is None else SLOTS_IN_CLUMPS) * span + 64
    siblings = np.empty(0, np.int64) if clump is None else clump
    bond2 = bond_reach**2 if bond_reach > 0.0 else -1.0
    more, fast_rows, reach = NO_ROWS, NO_ROWS, NO_REACH
    if fast_ones is not None and len(fast_ones):
        fast_rows, at = fast_ones.among(ihot[:, GID])
        reach = fast_ones.reach[at]
        more = fast.pairs(hot, cell, fast_rows, reach, 0.5 * skin, columns, siblings)
    while True:
        begin = np.concatenate(([0], np.cumsum(room)[:-1])).astype(np.int64)
        m = int(room.sum()) + 1  # a candidate is written before it is known to be near
        slots = (
            lists.ptr, np.empty(m, np.int32), np.empty(m, np.int32), np.empty(m), np.empty(m, np.int32), np.empty(m),
            np.empty((m, hist.memory.shape[1])),
        )  # fmt: skip
        _fill_blocks(
            n_blocks, need, placed, longest2, begin, room, more, hot, ihot, cell, siblings, n_left, n_own,
            blocks.cut, blocks.lo, blocks.hi, blocks.poff, skin, bond2,
            where, hist.ptr, hist.rows, hist.rows.view(np.int64), *slots,
        )  # fmt: skip
        if (need <= room).all():
            break
        room = np.maximum(room, need)  # candidates come and go within what the first round found
    _, lists.row, lists.partner, lists.fs, lists.bond, lists.u_made, lists.memory = slots
    lists.bonds_placed = int(placed.sum())
    lists.tally[:, LONGEST2] = longest2
    lists.n_pairs = int(need.sum())
    wall_slots.place(lists, hot, cell, hist, where, walls, side, largest, skin, fast_rows, reach, left)
    return lists

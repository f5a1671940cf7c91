"""Histories of contacts while there are no lists: out of the slots of the old ones, for those of the new ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit, prange

from hpcdem.core.fields import GID
from hpcdem.numerics.on_threads import on_threads

U = np.uint64
# Columns of an entry: partner gid (-1 - w for wall w) and bond type, as int64 bits, and two numbers.
PARTNER, SHEAR, EXTRA, BOND = range(4)
WIDTH = 4
"""Columns of an entry; the memory of a user law (user_pairs.py) or of rolling (rolling.py) follows it."""


@dataclass
class Histories:
    """Histories of contacts by owned particle (CSR): the entries of particle c are rows[ptr[c] : ptr[c+1]].

    ptr (n + 1,) i8; rows (m, 4 + memory) f8: partner, shear force [N], a second number (overlap at bonding of a pair
    [m], normal force of a user law [N]; side of a wall contact), bond type, memory of a user law or of
    rolling. Both partners of a pair carry it. The walls of a particle follow its pairs.
    """

    ptr: np.ndarray
    rows: np.ndarray

    @staticmethod
    def empty(n: int) -> Histories:
        """No memory for n particles."""
        return Histories(np.zeros(n + 1, np.int64), np.empty((0, WIDTH)))

    @staticmethod
    def of_columns(
        ptr: np.ndarray,
        partner: np.ndarray,
        fs: np.ndarray,
        extra: np.ndarray,
        bond: np.ndarray,
        memory: np.ndarray | None = None,
    ) -> Histories:
        """Build histories from one array (m,) per column, and (m, columns) of a user law."""
        out = Histories(ptr, np.empty((len(partner), WIDTH + (0 if memory is None else memory.shape[1]))))
        out.rows[:, SHEAR], out.rows[:, EXTRA] = fs, extra
        if memory is not None:
            out.rows[:, WIDTH:] = memory
        out.partner[:], out.bond[:] = partner, bond
        return out

    @property
    def partner(self) -> np.ndarray:
        """View (m,) i8: gid of the other particle, or -1 - w for wall w."""
        return self.rows.view(np.int64)[:, PARTNER]

    @property
    def fs(self) -> np.ndarray:
        """View (m,) f8: shear force [N]."""
        return self.rows[:, SHEAR]

    @property
    def extra(self) -> np.ndarray:
        """View (m,) f8: overlap at bonding [m], or side of a wall contact."""
        return self.rows[:, EXTRA]

    @property
    def bond(self) -> np.ndarray:
        """View (m,) i8: bond type, 0 for none."""
        return self.rows.view(np.int64)[:, BOND]

    @property
    def memory(self) -> np.ndarray:
        """View (m, columns) f8: the memory of a user law."""
        return self.rows[:, WIDTH:]

    def resized(self, columns: int) -> Histories:
        """Return histories with this number of columns of memory; new columns are 0."""
        if WIDTH + columns == self.rows.shape[1]:
            return self
        rows = np.zeros((len(self.rows), WIDTH + columns))
        kept = min(rows.shape[1], self.rows.shape[1])
        rows[:, :kept] = self.rows[:, :kept]
        return Histories(self.ptr, rows)

    def counts(self) -> np.ndarray:
        """Number of entries per particle (n,)."""
        return np.diff(self.ptr)

    def bonded(self) -> int:
        """Number of entries with a bond: each bond counts at both its ends."""
        return _count_bonds(self.rows.view(np.int64))

    def take(self, order: np.ndarray) -> Histories:
        """The histories of the particles in `order` (indices, with or without some left out)."""
        ptr = _starts(self.ptr[1:][order] - self.ptr[:-1][order])
        out = Histories(ptr, np.empty((int(ptr[-1]), self.rows.shape[1])))
        _take(order, self.ptr, self.rows, out.ptr, out.rows)
        return out

    def joined(self, counts: np.ndarray, rows: np.ndarray) -> Histories:
        """Append particles with these numbers of entries."""
        return Histories(_starts(np.concatenate([self.counts(), counts])), np.concatenate([self.rows, rows]))

    def extended(self, n: int) -> Histories:
        """Append n particles without histories."""
        return Histories(np.concatenate((self.ptr, np.full(n, self.ptr[-1]))), self.rows)

    def keep(self, mask: np.ndarray) -> Histories:
        """Only the entries where mask (m,) is true."""
        owner = np.repeat(np.arange(len(self.ptr) - 1), self.counts())[mask]
        return Histories(_starts(np.bincount(owner, minlength=len(self.ptr) - 1)), self.rows[mask])


def _starts(counts: np.ndarray) -> np.ndarray:
    return np.concatenate(([0], np.cumsum(counts, dtype=np.int64)))


@njit(cache=True, nogil=True, error_model="numpy")
def _count_bonds(rows):
    n = 0
    for row in rows:
        n += row[BOND] != 0
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def _take(order, ptr, rows, new_ptr, new_rows):
    for c in range(len(order)):
        shift = ptr[order[c]] - new_ptr[c]
        for q in range(new_ptr[c], new_ptr[c + 1]):
            for column in range(rows.shape[1]):
                new_rows[q, column] = rows[q + shift, column]


def taken_out(lists: Any, ihot: np.ndarray, stamp: float) -> Histories:
    """Collect the histories of the contacts of the owned particles. lists: neighbours.ContactLists; ihot (n, 8): their
    storage; stamp: what the memory of contacts that touch is not below of (user_pairs.py)."""
    b, n_blocks = lists.blocks, lists.n_blocks
    totals, found = np.zeros(n_blocks, np.int64), np.zeros(n_blocks, np.int64)
    alive, count = np.empty(len(lists.partner), np.int32), np.empty(lists.n_own, np.int64)
    pairs = (lists.ptr, lists.row, lists.partner, lists.fs, lists.bond)
    _count_blocks(
        n_blocks, totals, found, lists.n_left, b.cut, b.lo, b.poff, *pairs, lists.memory, stamp,
        lists.wptr, lists.slot_row, lists.slot_fs, lists.slot_side, lists.slot_memory, alive, count,
    )  # fmt: skip
    ends = np.cumsum(totals)
    ptr = np.empty(lists.n_own + 1, np.int64)
    ptr[-1] = ends[-1]
    out = Histories(ptr, np.empty((int(ends[-1]), WIDTH + lists.memory.shape[1])))
    _hand_out_blocks(
        n_blocks, ends - totals, found, lists.n_left, ihot, b.cut, b.poff, *pairs, lists.u_made, lists.memory, stamp,
        lists.wptr, lists.slot_row, lists.slot_wall, lists.slot_fs, lists.slot_side, lists.slot_memory, alive, count,
        ptr, out.rows, out.rows.view(np.int64),
    )  # fmt: skip
    return out


# ---- out of the slots --------------------------------------------------------------------------------------------
# A block hands out what its own particles remember: the pairs inside it and its side of the pairs across its ends.


@njit(cache=True, nogil=True, error_model="numpy")
def _count(
    t, n_left, cut, lo, poff, ptr, row, partner, fs, bond, memory, stamp, wptr, slot_row, slot_fs, slot_side,
    slot_memory, alive, count,
):  # fmt: skip
    """Entries per particle of block t. alive: the slots that remember something. Returns (entries, such slots)."""
    a, b = cut[t], cut[t + 1]
    begin, end = ptr[poff[t]], ptr[poff[t] + max(b - lo[t], 0)]
    for c in range(a - n_left, b - n_left):
        count[c] = 0
    n = U(begin)
    if memory.shape[1] > 0:
        for k in range(U(begin), U(end)):
            alive[n] = k
            n += U((fs[k] != 0.0) | (bond[k] != 0) | (memory[k, 0] >= stamp))
    else:
        for k in range(U(begin), U(end)):
            alive[n] = k
            n += U((fs[k] != 0.0) | (bond[k] != 0))
    found = np.int64(n) - begin
    total = 0
    for s in range(U(begin), n):
        k = U(alive[s])
        i, j = np.int64(row[k]), np.int64(partner[k])
        if i >= a:
            count[U(i - n_left)] += 1
            total += 1
        if a <= j < b:
            count[U(j - n_left)] += 1
            total += 1
    for k in range(wptr[t], wptr[t + 1]):
        if slot_fs[k] != 0.0 or slot_side[k] != 0.0 or (slot_memory.shape[1] > 0 and slot_memory[k, 0] != 0.0):
            count[slot_row[k] - n_left] += 1
            total += 1
    return total, found


@njit(cache=True, nogil=True, error_model="numpy")
def _hand_out(
    t, first, found, n_left, ihot, cut, poff, ptr, row, partner, fs, bond, u_made, memory, stamp,
    wptr, slot_row, slot_wall, slot_fs, slot_side, slot_memory, alive, count, hptr, rows, bits,
):  # fmt: skip
    """Entries of the particles of block t, from entry `first` on."""
    a, b = cut[t], cut[t + 1]
    at = count
    for c in range(a - n_left, b - n_left):
        n = count[c]
        hptr[c] = first
        at[c] = first
        first += n
    begin, wide = ptr[poff[t]], memory.shape[1] > 0
    for s in range(U(begin), U(begin + found)):
        k = U(alive[s])
        i, j = np.int64(row[k]), np.int64(partner[k])
        lasts = bond[k] != 0  # nothing of broken ones
        if wide:
            lasts |= memory[k, 0] >= stamp
        if i >= a:
            q = U(at[U(i - n_left)])
            at[U(i - n_left)] = q + U(1)
            bits[q, PARTNER], bits[q, BOND] = ihot[U(j), GID], bond[k]
            rows[q, SHEAR], rows[q, EXTRA] = fs[k], u_made[k] if lasts else 0.0
            if wide:
                for c in range(memory.shape[1]):
                    rows[q, WIDTH + c] = memory[k, c] if memory[k, 0] >= stamp else 0.0
        if a <= j < b:
            q = U(at[U(j - n_left)])
            at[U(j - n_left)] = q + U(1)
            bits[q, PARTNER], bits[q, BOND] = ihot[U(i), GID], bond[k]
            rows[q, SHEAR], rows[q, EXTRA] = fs[k], u_made[k] if lasts else 0.0
            if wide:
                for c in range(memory.shape[1]):
                    rows[q, WIDTH + c] = memory[k, c] if memory[k, 0] >= stamp else 0.0
    for k in range(wptr[t], wptr[t + 1]):
        if slot_fs[k] != 0.0 or slot_side[k] != 0.0 or (slot_memory.shape[1] > 0 and slot_memory[k, 0] != 0.0):
            q = at[slot_row[k] - n_left]
            at[slot_row[k] - n_left] = q + 1
            bits[q, PARTNER], bits[q, BOND] = -1 - slot_wall[k], 0
            rows[q, SHEAR], rows[q, EXTRA] = slot_fs[k], slot_side[k]
            rows[q, WIDTH:] = slot_memory[k]


@on_threads
def _count_blocks(n_blocks, totals, found, *args):
    for t in prange(n_blocks):
        totals[t], found[t] = _count(t, *args)


@on_threads
def _hand_out_blocks(n_blocks, first, found, *args):
    for t in prange(n_blocks):
        _hand_out(t, first[t], found[t], *args)

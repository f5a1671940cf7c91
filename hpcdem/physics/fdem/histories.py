"""Histories of contacts and of joints past their peak, copied from the tables of kernels: rows that belong to elements,
move with them, and are written back at the next rebuild.

A row is 20 words: key, state, and up to eighteen numbers. Keys of joints are -1 - edge (0..3); keys of contacts are the
other body's number * 2 + half of this element, bodies being element * 2 + half (quads have two, see `pairs.py`); in
space the other element * 8 + local face, + 4 if the face is the other one's, see `pairs_space.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcdem.physics.fdem.kernels import joint_law, joints

WORDS = 20
KEY, STATE, FIRST = 0, 1, 2


@dataclass
class Histories:
    """Rows rows[ptr[i] : ptr[i + 1]] belong to the i-th of the owned elements; ptr (n + 1,) i8, rows (m, 14) f8.

    Keys are int64 bits.
    """

    ptr: np.ndarray
    rows: np.ndarray

    @staticmethod
    def empty(n: int) -> Histories:
        """n elements without any."""
        return Histories(np.zeros(n + 1, np.int64), np.empty((0, WORDS)))

    @staticmethod
    def of(n: int, owner: np.ndarray, rows: np.ndarray) -> Histories:
        """Make histories from rows and the element (0 .. n - 1) of each, in any order."""
        key = rows.view(np.int64)[:, KEY]
        order = np.lexsort((key, owner))
        ptr = np.concatenate(([0], np.cumsum(np.bincount(owner, minlength=n)))).astype(np.int64)
        return Histories(ptr, np.ascontiguousarray(rows[order]))

    def counts(self) -> np.ndarray:
        """Rows per element (n,)."""
        return np.diff(self.ptr)

    def owners(self) -> np.ndarray:
        """Element of each row (m,)."""
        return np.repeat(np.arange(len(self.ptr) - 1), self.counts())

    def keys(self) -> np.ndarray:
        """(m,) i8."""
        return self.rows.view(np.int64)[:, KEY]

    def take(self, which: np.ndarray) -> Histories:
        """Histories of the elements `which`, in that order."""
        counts = self.counts()[which]
        if not len(self.rows):
            return Histories.empty(len(which))
        ends = np.cumsum(counts)
        at = np.repeat(self.ptr[which] - (ends - counts), counts) + np.arange(int(counts.sum()))
        return Histories(np.concatenate(([0], ends)).astype(np.int64), self.rows[at])

    def joined(self, counts: np.ndarray, rows: np.ndarray) -> Histories:
        """Append the histories of more elements."""
        ends = self.ptr[-1] + np.cumsum(counts)
        return Histories(
            np.concatenate([self.ptr, ends]).astype(np.int64), np.ascontiguousarray(np.concatenate([self.rows, rows]))
        )

    def keep(self, rows: np.ndarray) -> Histories:
        """Keep the flagged rows (m,) bool."""
        owner = self.owners()[rows]
        ptr = np.concatenate(([0], np.cumsum(np.bincount(owner, minlength=len(self.ptr) - 1))))
        return Histories(ptr.astype(np.int64), np.ascontiguousarray(self.rows[rows]))

    def without_partners(self, gone: np.ndarray, dim: int) -> Histories:
        """Remove contacts with elements flagged in `gone` (ne,); dim: dimensions of space."""
        key = self.keys()
        other = np.where(key >= 0, key // (8 if dim == 3 else 4), 0)
        return self.keep((key < 0) | ~gone[other])

    def without_joints(self, number: np.ndarray, forget: np.ndarray) -> Histories:
        """Remove the joints on faces flagged in `forget` (4 ne,); number (n,): the elements. Sliding joints lose only
        the mark that they are torn: stresses depend on the rest."""
        key = self.keys()
        face = 4 * number[self.owners()] + np.where(key < 0, -1 - key, 0)
        chosen, state = (key < 0) & forget[face], self.rows[:, STATE]
        torn = np.flatnonzero(chosen & (state == joints.BROKEN + joint_law.COULOMB))
        self.rows[torn, FIRST + joint_law.OWN : FIRST + joint_law.OWN + 3] = 0.0
        return self.keep(~chosen | (state > joints.BROKEN))

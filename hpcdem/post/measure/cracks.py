"""Breaking of bonds between frames, and damage of particles.

A bond is broken if a frame holds both its particles but not the bond any more; a bond that goes with a deleted particle
is not. What a frame does not tell is whether it broke in tension or in shear: instead `parted` says whether the two
particles have come apart or still touch. The log of the run counts both kinds, see `read_log`.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.io.disk import explain
from hpcdem.post.measure.grains import Grains
from hpcdem.post.measure.images import inside

LEVELS = 0.1, 0.5
"""Damage from which on particles are counted."""
_LOG = re.compile(r"step (\d+) \|.*\((\d+) broken in tension, (\d+) in shear\)")


@dataclass(frozen=True)
class Change:
    """Bonds from one frame to the next: pairs of ids (m, 2) that broke, their places (m, 2) [m] in the frame before and
    whether they came apart (m,); pairs that were made (k, 2); how many went with deleted particles."""

    broken: np.ndarray
    place: np.ndarray
    parted: np.ndarray
    made: np.ndarray
    lost: int


def change(before: Grains, after: Grains) -> Change:
    """Compare the bonds of two frames; `contacts` of the later one must have been read."""
    old, new, touching = _keys(before.bonds, after.bonds, after.contacts)
    gone = ~np.isin(old, new)
    there = np.isin(before.bonds, after.gid).all(axis=1)
    broke = gone & there
    row = np.searchsorted(before.gid, before.bonds[broke])
    x = before.x[row]
    across = x[:, 1] - x[:, 0]
    if before.period:
        across -= before.period * np.rint(across / before.period)
    place = np.stack([inside(before, x[:, 0] + 0.5 * across), before.y[row].mean(axis=1)], axis=1)
    parted = ~np.isin(old[broke], touching)
    made = after.bonds[~np.isin(new, old)]
    return Change(before.bonds[broke], place, parted, made, int((gone & ~there).sum()))


def _keys(*tables: np.ndarray) -> list[np.ndarray]:
    """Make one number per pair of ids, in whichever order, equal over the tables (m, 2)."""
    ids, place = np.unique(np.concatenate([t.ravel() for t in tables]), return_inverse=True)
    ends = np.sort(place.reshape(-1, 2), axis=1)
    numbers = ends[:, 0] * max(len(ids), 1) + ends[:, 1]
    return np.split(numbers, np.cumsum([len(t) for t in tables])[:-1])


class Damage:
    """Bonds that particles ever had and those that broke, both counted at either end; added up frame by frame."""

    def __init__(self, ids: np.ndarray) -> None:
        """ids: of all particles that will ever have a bond."""
        self._ids = np.unique(ids)
        self._had, self._broke = np.zeros(len(self._ids), np.int64), np.zeros(len(self._ids), np.int64)

    def add(self, made: np.ndarray, broken: np.ndarray) -> None:
        """Bonds (m, 2) that were made and that broke since the last frame."""
        for counts, pairs in ((self._had, made), (self._broke, broken)):
            counts += np.bincount(np.searchsorted(self._ids, pairs.ravel()), minlength=len(counts))

    def of(self, gid: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Bonds had, bonds broken, and damage (their ratio; NaN for particles never bonded) of particles, (n,) each."""
        known = np.isin(gid, self._ids)
        row = np.searchsorted(self._ids, gid[known])
        had, broke = np.zeros(len(gid), np.int64), np.zeros(len(gid), np.int64)
        had[known], broke[known] = self._had[row], self._broke[row]
        with np.errstate(invalid="ignore", divide="ignore"):
            return had, broke, np.where(had > 0, broke / had, np.nan)


def read_log(path: str | os.PathLike) -> np.ndarray:
    """(n, 3): step and the bonds broken so far in tension and in shear, from the progress lines of a log. Raises
    HpcdemError."""
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            found = [_LOG.search(line) for line in file]
    except OSError as failure:
        raise HpcdemError(explain(path, failure, "read")) from None
    rows = np.array([[int(w) for w in m.groups()] for m in found if m is not None], np.int64).reshape(-1, 3)
    if not len(rows):
        raise HpcdemError(f"{os.fspath(path)}: no line reports bonds broken in tension and in shear")
    return rows

"""Thrusts as breaks of a marker layer, from the displacements of its grains. *Forward* is +x."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy


def _pieces(x: np.ndarray, width: float, *values: np.ndarray) -> list[np.ndarray]:
    """Means of values over the pieces of `width` of a layer that hold grains, from left to right."""
    piece = np.floor((x - x.min()) / width).astype(np.int64)
    _, inverse, count = np.unique(piece, return_inverse=True, return_counts=True)
    return [np.bincount(inverse, v) / count for v in values]


@dataclass(frozen=True)
class Break:
    """A break of a marker layer: place along the undeformed layer [m]; heave and throw [m], the slip of the left side
    over the right one; vergence +1 where the left side went up (forethrust), -1 where the right one did."""

    at: float
    heave: float
    throw: float

    @property
    def slip(self) -> float:
        return float(np.hypot(self.heave, self.throw))

    @property
    def dip(self) -> float:
        """Dip of the slip [degrees]."""
        return float(np.degrees(np.arctan2(abs(self.throw), self.heave)))

    @property
    def vergence(self) -> int:
        return 1 if self.throw > 0.0 else -1


def breaks(
    x: np.ndarray, dx: np.ndarray, dy: np.ndarray, width: float, least: float, shortening: float = 0.4
) -> list[Break]:
    """Thrusts crossing a marker layer, from left to right.

    x: undeformed places of the layer's grains [m]; dx, dy: their displacements. The layer is cut into pieces of `width`
    with their mean displacements. A thrust is a run of neighbouring pieces (one quiet joint between them is bridged)
    that approach each other by more than `shortening` of their width, with a slip of at least `least` [m] altogether.
    Limbs that only turn shorten by 1 - cos(angle), 0.4 beyond 53 degrees, and are not counted; nor is a vertical fault.
    """
    at, u, v = _pieces(x, width, x, dx, dy)
    converging = (u[:-1] - u[1:]) / np.diff(at) > shortening
    joined = scipy.ndimage.binary_closing(np.pad(converging, 2), np.ones(3))[2:-2] if len(converging) else converging
    label, number = scipy.ndimage.label(joined)
    found = []
    for run in scipy.ndimage.find_objects(label, number):
        # A piece on the edge of the run may hold grains of both sides: compare the ones beyond.
        first, last = max(run[0].start - 1, 0), min(run[0].stop + 1, len(at) - 1)
        candidate = Break(float((at[first] + at[last]) / 2.0), float(u[first] - u[last]), float(v[first] - v[last]))
        if candidate.slip >= least:
            found.append(candidate)
    return found


def advance(x: np.ndarray, dx: np.ndarray, width: float, moved: float) -> float:
    """How far a layer has been moved: undeformed place of its last piece (of `width`, mean of its grains) that went
    forward by more than `moved` [m]."""
    at, u = _pieces(x, width, x, dx)
    on_the_move = at[u > moved]
    return float(on_the_move[-1] + width / 2.0 if len(on_the_move) else x.min())


def heaves(x: np.ndarray, dx: np.ndarray, width: float) -> np.ndarray:
    """Approach of neighbouring pieces (of `width`) of a layer [m], by their mean displacements, from left to right; 0
    where they part."""
    (u,) = _pieces(x, width, dx)
    return np.maximum(u[:-1] - u[1:], 0.0)

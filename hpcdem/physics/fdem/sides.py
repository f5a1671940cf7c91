"""Nodes as ranges, groups, histories and conditions name them: a point of the mesh, or a side of one.

Elements that may part have corners of their own at a common point. A number below SIDE is a point, with all corners
there; SIDE + (element * 4 + k) is the node of that element's corner alone. Both stand in one ascending array.
"""

from __future__ import annotations

import numpy as np

SIDE = 1 << 40


def are_there(numbers: np.ndarray) -> bool:
    """Return whether some of these numbers are sides."""
    return bool(len(numbers)) and int(numbers.max()) >= SIDE


def points(cells: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Points of the sides, ascending and unique."""
    numbers = np.asarray(numbers, np.int64)
    if not are_there(numbers):
        return numbers
    side = numbers >= SIDE
    return np.unique(np.concatenate([numbers[~side], cells.reshape(-1)[numbers[side] - SIDE]]))


def present(cells: np.ndarray, numbers: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Numbers without sides of missing elements, (ne,) bool; where a point has none left, the point."""
    side = numbers >= SIDE
    gone = side & ~there[np.where(side, numbers - SIDE, 0) // 4]
    if not gone.any():
        return numbers
    left = numbers[~gone]
    return np.union1d(left, np.setdiff1d(points(cells, numbers[gone]), points(cells, left)))


def corners(cells: np.ndarray, numbers: np.ndarray, n_points: int) -> np.ndarray:
    """(4 ne,) bool: the corners that they name."""
    numbers = np.asarray(numbers, np.int64)
    side = numbers >= SIDE
    flags = np.zeros(n_points + 1, bool)  # the last one is for the fourth corner of triangles
    flags[numbers[~side]] = True
    found = flags[cells].reshape(-1)
    found[numbers[side] - SIDE] = True
    return found


def numbers(cells: np.ndarray, chosen: np.ndarray, there: np.ndarray) -> np.ndarray:
    """The numbers of corners (4 ne,) bool: points of which all corners of elements that are there (ne,) bool are
    chosen, and sides."""
    cells, exist = cells.reshape(-1), np.repeat(there, 4) & (cells.reshape(-1) >= 0)
    chosen = chosen & exist
    some, missing = np.zeros((2, int(cells.max(initial=-1)) + 1), bool)
    some[cells[chosen]] = True
    missing[cells[exist & ~chosen]] = True
    whole = np.flatnonzero(some & ~missing)
    at = np.flatnonzero(chosen)
    return np.concatenate([whole, SIDE + at[missing[cells[at]]]])

"""Clump files for tests: bodies of a few kinds on a lattice."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from hpcdem.io.clumps import Clumps, write_clumps


def of_discs(dx: list[float], dy: list[float], r: list[float]) -> tuple[float, float, np.ndarray]:
    """Area [m2], polar second moment of area [m4] and discs (n, 3) of a body that is the sum of its discs, about its
    centroid; overlaps count twice."""
    discs = np.column_stack([dx, dy, r]).astype(float)
    area = math.pi * discs[:, 2] ** 2
    discs[:, :2] -= (area @ discs[:, :2]) / area.sum()
    moment = area @ (0.5 * discs[:, 2] ** 2 + (discs[:, :2] ** 2).sum(axis=1))
    return float(area.sum()), float(moment), discs


def bodies(kinds: list[tuple[float, float, np.ndarray]], places: np.ndarray, angles: np.ndarray) -> Clumps:
    """Body k is of kind k modulo their number, at places[k] with angles[k]."""
    chosen = [kinds[k % len(kinds)] for k in range(len(places))]
    discs = np.concatenate([kind[2] for kind in chosen])
    sizes = [len(kind[2]) for kind in chosen]
    return Clumps(
        places[:, 0], places[:, 1], angles, np.array([kind[0] for kind in chosen]),
        np.array([kind[1] for kind in chosen]), np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64), discs[:, 0],
        discs[:, 1], discs[:, 2],
    )  # fmt: skip


def kinds(r: float) -> list[tuple[float, float, np.ndarray]]:
    """A rod of seven discs, a triangle, a hook, a pair of unlike discs, one of them in the other's hole, and a disc."""
    return [
        of_discs([1.2 * r * k for k in range(7)], [0.0] * 7, [r] * 7),
        of_discs([0.0, 1.6 * r, 0.8 * r], [0.0, 0.0, 1.4 * r], [r] * 3),
        of_discs([0.0, 1.5 * r, 3.0 * r, 3.0 * r, 3.0 * r], [0.0, 0.0, 0.0, 1.5 * r, 3.0 * r], [r, r, 0.8 * r, r, r]),
        of_discs([0.0, 1.3 * r], [0.0, 0.2 * r], [1.2 * r, 0.7 * r]),
        of_discs([0.0], [0.0], [r]),
    ]


def write_lattice(path: Path, r: float, columns: int, rows: int, seed: int = 3) -> Clumps:
    """Columns by rows bodies of all kinds, turned at random, far enough from each other not to touch; the lowest left
    corner of the lattice is the origin."""
    rng = np.random.default_rng(seed)
    pitch = 10.0 * r
    places = np.array([((i + 0.5) * pitch, (j + 0.5) * pitch) for j in range(rows) for i in range(columns)])
    clumps = bodies(kinds(r), places, rng.uniform(0.0, 2.0 * math.pi, len(places)))
    write_clumps(path, clumps)
    return clumps

"""Blocks in or behind walls, which hold particles only."""

from __future__ import annotations

import numpy as np

from hpcdem.physics.coupling.model import Coupled


def beyond(both: Coupled) -> list[tuple[int, int, float, float]]:
    """Walls of the particles that cut an element, or BOX sides beyond which one is: their ids, the first such
    element, and its first corner [m]. Collective."""
    both.blocks.close_model()
    walls, blocks = both.particles.walls, both.blocks
    own = blocks.owned
    number = blocks.number[own]
    keep = blocks.alive[number]
    number, x = number[keep], blocks.x[own][keep][:, :8]
    # The first corner of a triangle stands twice, which makes its fourth edge one without length.
    ends = np.stack([x.reshape(-1, 4, 2), np.roll(x.reshape(-1, 4, 2), -1, axis=1)], axis=2)
    low, high = x.reshape(-1, 4, 2).min(axis=1), x.reshape(-1, 4, 2).max(axis=1)
    found = []
    box = walls.box()
    sides = {} if box is None else {
        "left": low[:, 0] < box[0], "right": high[:, 0] > box[1], "bottom": low[:, 1] < box[2],
        "top": high[:, 1] > box[3],
    }  # fmt: skip
    for k in range(len(walls)):
        wall = int(walls.id[k])
        side = walls.side_of(k)
        hit = sides[side] if side in sides else _cuts(ends, walls.p1[k], walls.p2[k])
        first = int(number[hit].min(initial=np.iinfo(np.int64).max))
        at = x[number == first][:1, :2]
        found.append((wall, first, *(at[0].tolist() if len(at) else (0.0, 0.0))))
    return [min(each) for each in zip(*both.comm.allgather(found)) if min(each)[1] < np.iinfo(np.int64).max]


def _cuts(ends: np.ndarray, p1: np.ndarray, p2: np.ndarray) -> np.ndarray:
    """(n,) bool: elements, ends (n, 4, 2, 2) of their edges [m], of which an edge crosses the line from p1 to p2."""

    def side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        u, w = b - a, c - a
        return u[..., 0] * w[..., 1] - u[..., 1] * w[..., 0]

    a, b = ends[:, :, 0], ends[:, :, 1]
    across = side(p1, p2, a) * side(p1, p2, b) < 0.0
    return (across & (side(a, b, p1) * side(a, b, p2) < 0.0)).any(axis=1)

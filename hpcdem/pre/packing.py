"""GEN: random sequential insertion, and the square lattice of GEN GRID. Arrays in, arrays out.

Every attempt is a pure function of (seed, stream, attempt number): the packing does not depend on the rank count.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hpcdem.numerics.rng import uniform


@njit(cache=True)
def _insert(
    attempts, in_a_row, wanted, radii, x0, x1, y0, y1, around, seed, stream, cell, head, nxt, px, py, pr, n_old, out
):  # fmt: skip
    """Place discs one by one; returns (placed, attempts used). head (nx, ny) i8, nxt (m,) i8: linked cells, which hold
    images too if the sides of the rectangle are periodic (around)."""
    nx, ny = head.shape
    n = n_old
    placed = 0
    tried = 0
    last = 0
    while placed < wanted and tried < attempts and tried - last < in_a_row:
        r = radii[min(int(uniform(seed, stream, 3 * tried) * len(radii)), len(radii) - 1)]
        u = uniform(seed, stream, 3 * tried + 1)
        v = uniform(seed, stream, 3 * tried + 2)
        tried += 1
        if x1 - x0 < 2.0 * r or y1 - y0 < 2.0 * r:
            continue
        x = x0 + u * (x1 - x0) if around else x0 + r + u * (x1 - x0 - 2.0 * r)
        y = y0 + r + v * (y1 - y0 - 2.0 * r)
        cx = min(max(int((x - x0) / cell) + 1, 0), nx - 1)
        cy = min(max(int((y - y0) / cell) + 1, 0), ny - 1)
        free = True
        for a in range(max(cx - 1, 0), min(cx + 2, nx)):
            for b in range(max(cy - 1, 0), min(cy + 2, ny)):
                k = head[a, b]
                while k >= 0:
                    dx, dy, reach = px[k] - x, py[k] - y, pr[k] + r
                    if dx * dx + dy * dy < reach * reach:
                        free = False
                        break
                    k = nxt[k]
                if not free:
                    break
            if not free:
                break
        if free:
            px[n], py[n], pr[n] = x, y, r
            nxt[n] = head[cx, cy]
            head[cx, cy] = n
            out[placed] = n
            n += 1
            placed += 1
            last = tried
            for side in range(2 if around else 0):
                image = x + (x1 - x0) if side == 0 else x - (x1 - x0)
                if x0 - cell < image < x1 + cell:
                    px[n], py[n], pr[n] = image, y, r
                    cx = min(max(int(np.floor((image - x0) / cell)) + 1, 0), nx - 1)
                    nxt[n] = head[cx, cy]
                    head[cx, cy] = n
                    n += 1
    return placed, tried


def insert_randomly(
    number: int,
    radii: np.ndarray,
    x: tuple[float, float],
    y: tuple[float, float],
    existing: np.ndarray,
    seed: int,
    stream: int,
    attempts: int | None = None,
    in_a_row: int | None = None,
    around: bool = False,
) -> tuple[np.ndarray, int]:
    """Discs placed at random in a rectangle, whole, without overlap with each other or with `existing` (m, 3) [x, y,
    r].

    Each attempt draws a radius from the list (repeats weight it) and a place. Ends with `number` discs, after so many
    attempts, or after so many failures in a row (None: no such end). around: the left and right side are periodic.
    Returns ((n, 3) f8 rows x, y, r [m] with
    n <= number, attempts used).
    """
    (x0, x1), (y0, y1) = x, y
    radii = np.asarray(radii, dtype=np.float64)
    largest = max(float(radii.max()), float(existing[:, 2].max()) if len(existing) else 0.0)
    reach = largest + float(radii.max())
    near = (
        (existing[:, 0] > x0 - reach) & (existing[:, 0] < x1 + reach)
        & (existing[:, 1] > y0 - reach) & (existing[:, 1] < y1 + reach)
    )  # fmt: skip
    old = existing[near]
    area = max(x1 - x0, 0.0) * max(y1 - y0, 0.0)
    endless = np.iinfo(np.int64).max
    attempts, in_a_row = (endless if n is None else n for n in (attempts, in_a_row))
    capacity = int(min(number, attempts, area / (np.pi * float(radii.min()) ** 2) + 1.0))
    cell = reach
    shape = (int((x1 - x0) / cell) + 3, int((y1 - y0) / cell) + 3)
    total = len(old) + (3 if around else 1) * capacity
    px, py, pr = np.empty(total), np.empty(total), np.empty(total)
    px[: len(old)], py[: len(old)], pr[: len(old)] = old.T
    head, nxt = np.full(shape, -1, np.int64), np.full(total, -1, np.int64)
    # Neighbours outside the rectangle fall into the rim cells: a disc inside is at most `reach`, one cell, away from
    # any it could touch.
    ox = np.clip(((old[:, 0] - x0) // cell).astype(np.int64) + 1, 0, shape[0] - 1)
    oy = np.clip(((old[:, 1] - y0) // cell).astype(np.int64) + 1, 0, shape[1] - 1)
    for k in range(len(old)):
        nxt[k] = head[ox[k], oy[k]]
        head[ox[k], oy[k]] = k
    out = np.empty(capacity, np.int64)
    placed, tried = _insert(
        attempts, in_a_row, capacity, radii, x0, x1, y0, y1, around, seed, stream, cell, head, nxt, px, py, pr,
        len(old), out,
    )  # fmt: skip
    new = out[:placed]
    return np.column_stack([px[new], py[new], pr[new]]), int(tried)


def nodes(radii: np.ndarray, x: tuple[float, float], y: tuple[float, float]) -> tuple[int, int]:
    """Return how many nodes a square lattice of spacing 2 max(radii) has along x and y of a rectangle [m]."""
    spacing = 2.0 * float(np.max(radii))
    nx, ny = (max(int(np.floor((b - a) / spacing + 1e-9)), 0) for a, b in (x, y))
    return nx, ny


def lattice(
    radii: np.ndarray, x: tuple[float, float], y: tuple[float, float], seed: int, stream: int, first: int, end: int
) -> np.ndarray:
    """Nodes first .. end - 1 of this lattice, row by row from the lower left, a listed radius drawn at each.

    Returns (n, 3) f8 rows x, y, r [m]; every node keeps half a spacing from the edges.
    """
    radii = np.asarray(radii, dtype=np.float64)
    spacing = 2.0 * float(radii.max())
    row, column = np.divmod(np.arange(first, end), max(nodes(radii, x, y)[0], 1))
    draw = np.array([uniform(seed, stream, k) for k in range(first, end)])
    chosen = radii[np.minimum((draw * len(radii)).astype(np.int64), len(radii) - 1)]
    return np.column_stack([x[0] + spacing * (column + 0.5), y[0] + spacing * (row + 0.5), chosen])

"""Square grids over particles: sums over what lies near each node, and values between nodes.

Nodes lie at whole multiples of the spacing, so that grids of different frames fall on each other. Sums are taken in the
order of the particles, one neighbouring place of the node after the other: a node's sum has the same bits whichever
columns are requested.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hpcdem.core.errors import HpcdemError

MOST_NODES = 20_000_000
"""Largest number of nodes; more indicate a stray particle or a spacing in the wrong unit."""
_AROUND = tuple((row, column) for row in (-1, 0, 1) for column in (-1, 0, 1))


@dataclass(frozen=True)
class Grid:
    """Spacing [m], number of columns and rows of nodes, and the place of the first node in multiples of the spacing."""

    size: float
    nx: int
    ny: int
    column: int = 0
    row: int = 0

    @property
    def x(self) -> np.ndarray:
        """(nx,) [m]."""
        return self.size * np.arange(self.column, self.column + self.nx)

    @property
    def y(self) -> np.ndarray:
        """(ny,) [m]."""
        return self.size * np.arange(self.row, self.row + self.ny)


def cover(size: float, x: np.ndarray, y: np.ndarray, radius: np.ndarray) -> Grid:
    """The smallest grid with every disc between its outermost nodes. HpcdemError if it would be too large."""
    low = [np.floor(np.min(c - radius) / size) for c in (x, y)]
    high = [np.ceil(np.max(c + radius) / size) for c in (x, y)]
    nx, ny = (high[k] - low[k] + 1 for k in (0, 1))
    if not nx * ny <= MOST_NODES:
        raise HpcdemError(
            f"a grid of {size:g} m over {np.ptp(x):g} m x {np.ptp(y):g} m would have more than {MOST_NODES} nodes: "
            "choose a larger one with -g"
        )
    return Grid(size, int(nx), int(ny), int(low[0]), int(low[1]))


def sums(
    grid: Grid,
    x: np.ndarray,
    y: np.ndarray,
    values: Mapping[str, np.ndarray],
    reach: float,
    moments: bool = False,
    columns: tuple[int, int] | None = None,
) -> dict[str, np.ndarray]:
    """Sums over the particles nearer to each node than reach x spacing; reach <= 1.5.

    values: (n,) each. Returns arrays (ny, number of columns) by name: "number" and every value; with `moments` also
    "x y xx xy yy", dx/size and dy/size from the node and their products, and "name x", "name y" for each value times
    those. columns: first and last + 1 of the columns wanted, all by default.
    """
    first, last = columns or (0, grid.nx)
    width = last - first
    names = ["number", *values]
    if moments:
        names += ["x", "y", "xx", "xy", "yy", *(f"{name} {axis}" for name in values for axis in "xy")]
    total = {name: np.zeros(grid.ny * width) for name in names}
    a, b = x / grid.size - grid.column, y / grid.size - grid.row
    near = np.floor(a + 0.5).astype(np.int64), np.floor(b + 0.5).astype(np.int64)
    if columns is not None:
        some = np.flatnonzero((near[0] >= first - 1) & (near[0] <= last))
        a, b, near = a[some], b[some], (near[0][some], near[1][some])
        values = {name: v[some] for name, v in values.items()}
    for row, column in _AROUND:
        i, j = near[0] + column, near[1] + row
        dx, dy = a - i, b - j
        inside = (dx * dx + dy * dy < reach * reach) & (i >= first) & (i < last) & (j >= 0) & (j < grid.ny)
        at = np.flatnonzero(inside)
        node = j[at] * width + (i[at] - first)

        def add(name: str, weights: np.ndarray | None = None) -> None:
            total[name] += np.bincount(node, weights, grid.ny * width)  # noqa: B023

        add("number")
        if moments:
            dx, dy = dx[at], dy[at]
            for name, v in {"x": dx, "y": dy, "xx": dx * dx, "xy": dx * dy, "yy": dy * dy}.items():
                add(name, v)
        for name, v in values.items():
            v = v[at]
            add(name, v)
            if moments:
                add(f"{name} x", v * dx)
                add(f"{name} y", v * dy)
    return {name: v.reshape(grid.ny, width) for name, v in total.items()}


def touched(grid: Grid, x: np.ndarray, y: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """(ny, nx): whether a disc reaches into the square cell around the node."""
    result = np.zeros(grid.ny * grid.nx, dtype=bool)
    a, b, r = x / grid.size - grid.column, y / grid.size - grid.row, radius / grid.size
    i0, j0 = np.floor(a + 0.5).astype(np.int64), np.floor(b + 0.5).astype(np.int64)
    for row, column in _AROUND:
        i, j = i0 + column, j0 + row
        dx, dy = np.maximum(np.abs(a - i) - 0.5, 0.0), np.maximum(np.abs(b - j) - 0.5, 0.0)
        hit = (dx * dx + dy * dy <= r * r) & (i >= 0) & (i < grid.nx) & (j >= 0) & (j < grid.ny)
        result[(j * grid.nx + i)[hit]] = True
    return result.reshape(grid.ny, grid.nx)


def between(grid: Grid, table: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n, k): the table (ny, nx, k) interpolated bilinearly at points inside the grid.

    Nodes that are NaN are ignored and the weights of the others normalised to a sum of one; NaN where none is left. So
    a table that is constant where it is known comes back constant.
    """
    a, b = x / grid.size - grid.column, y / grid.size - grid.row
    i = np.clip(np.floor(a).astype(np.int64), 0, grid.nx - 2)
    j = np.clip(np.floor(b).astype(np.int64), 0, grid.ny - 2)
    a, b = a - i, b - j
    total, weight = np.zeros((len(x), table.shape[2])), np.zeros(len(x))
    flat, known = table.reshape(-1, table.shape[2]), ~np.isnan(table).any(axis=2).ravel()
    for row, column in ((0, 0), (0, 1), (1, 0), (1, 1)):
        node = (j + row) * grid.nx + i + column
        w = np.where(known[node], (a if column else 1.0 - a) * (b if row else 1.0 - b), 0.0)
        total += np.where(w > 0.0, w, 0.0)[:, None] * np.where(known[node][:, None], flat[node], 0.0)
        weight += w
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(weight[:, None] > 0.0, total / weight[:, None], np.nan)

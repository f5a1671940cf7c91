"""Meshes by rule: rectangles of quads or triangles, even or graded, and the equilateral lattice.

Points and elements are numbered row by row from the lower left. The four sides are the layers `left`, `right`, `bottom`
and `top`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.pre.mesh.sizes import not_too_many, spaced

DIAGONALS = {
    "right": "one diagonal, from lower left to upper right",
    "left": "one diagonal, from upper left to lower right",
    "alternate": "one diagonal, its direction changing from rectangle to rectangle (union jack)",
    "both": "both diagonals: four triangles about a point in the middle",
}


def rectangle(
    xs: np.ndarray,
    ys: np.ndarray,
    kind: str = "quad",
    diagonal: str = "alternate",
    group: tuple[str, str] | None = None,
) -> Mesh:
    """Rectangles between the grid lines xs and ys (ascending, see `spaced`), as quads or cut into triangles.

    kind: "quad" or "tri"; diagonal: a key of DIAGONALS; group: (set, group) for all elements.
    """
    xs, ys = (np.asarray(v, np.float64) for v in (xs, ys))
    for v, name in ((xs, "x"), (ys, "y")):
        if v.ndim != 1 or len(v) < 2 or not np.isfinite(v).all() or not (np.diff(v) > 0.0).all():
            raise CommandError(f"grid lines in {name} must be finite and ascend")
    _not_too_many(len(xs) - 1, len(ys) - 1, kind, diagonal)
    return of_grid(np.stack(np.meshgrid(xs, ys), axis=-1), kind, diagonal, group)


def _not_too_many(nx: int, ny: int, kind: str, diagonal: str) -> None:
    not_too_many(nx * ny * (1 if kind == "quad" else 4 if diagonal == "both" else 2), f"cells {nx} {ny}")


def of_grid(
    grid: np.ndarray, kind: str = "quad", diagonal: str = "alternate", group: tuple[str, str] | None = None
) -> Mesh:
    """Elements between the points of a grid (ny + 1, nx + 1, 2), counter-clockwise; `left` is its first column,
    `bottom` its first row."""
    if kind not in ("quad", "tri"):
        raise CommandError(f"a structured mesh consists of 'quad' or 'tri', not '{kind}'")
    if kind == "tri" and diagonal not in DIAGONALS:
        raise CommandError(f"diagonal '{diagonal}' is not known, choose from {', '.join(DIAGONALS)}")
    ny, nx = grid.shape[0] - 1, grid.shape[1] - 1
    _not_too_many(nx, ny, kind, diagonal)
    points = grid.reshape(-1, 2)
    j, i = (v.ravel() for v in np.mgrid[:ny, :nx])
    a = j * (nx + 1) + i
    quads = np.column_stack([a, a + 1, a + nx + 2, a + nx + 1])
    if kind == "quad":
        cells = quads
    elif diagonal == "both":
        middle = len(points) + np.arange(len(quads))
        points = np.concatenate([points, 0.25 * points[quads].sum(axis=1)])
        cells = _interleaved([np.column_stack([quads[:, k], quads[:, (k + 1) % 4], middle]) for k in range(4)])
    else:
        turned = {"right": np.zeros(len(a), bool), "left": np.ones(len(a), bool), "alternate": (i + j) % 2 == 1}[
            diagonal
        ]
        # The diagonal joins the first and the third corner; counting corners from the next one turns it.
        q = np.where(turned[:, None], np.roll(quads, -1, axis=1), quads)
        cells = _interleaved([q[:, [0, 1, 2]], q[:, [0, 2, 3]]])
    across, up = np.arange(nx + 1), np.arange(ny + 1) * (nx + 1)
    sides = {"left": up, "right": up + nx, "bottom": across, "top": across + ny * (nx + 1)}
    return _named(points, cells, sides, group)


def equilateral(
    corner: Sequence[float], width: float, height: float, size: float, group: tuple[str, str] | None = None
) -> Mesh:
    """A lattice of equilateral triangles with horizontal edges near `size` [m], filling a rectangle exactly.

    The number of edges in a row and of rows is the nearest that fits, which stretches the triangles a little; every
    second row is shifted by half an edge, and half triangles close the left and right side.
    """
    x0, y0 = float(corner[0]), float(corner[1])
    if not all(math.isfinite(v) for v in (x0, y0, width, height, size)) or min(width, height, size) <= 0.0:
        raise CommandError(
            f"an equilateral mesh needs a positive width, height and size, not {width:g}, {height:g}, {size:g}"
        )
    not_too_many(width / size * height / size * 2.31, f"size {size:g}")
    not_too_many(max(width, height) / size, f"size {size:g}")
    nx, ny = max(1, round(width / size)), max(1, round(height / (size * math.sqrt(0.75))))
    xs, ys = spaced(x0, x0 + width, nx), spaced(y0, y0 + height, ny)
    half = np.concatenate([xs[:1], 0.5 * (xs[1:] + xs[:-1]), xs[-1:]])
    rows = [xs if j % 2 == 0 else half for j in range(ny + 1)]
    first = np.concatenate([[0], np.cumsum([len(r) for r in rows])])
    points = np.concatenate([np.column_stack([r, np.full(len(r), y)]) for r, y in zip(rows, ys)])
    layers = []
    for j in range(ny):
        even, odd = (first[j], first[j + 1]) if j % 2 == 0 else (first[j + 1], first[j])
        k = np.arange(nx + 1)
        on_even = np.column_stack([even + k[:-1], even + k[1:], odd + k[1:]])  # base on the unshifted row
        on_odd = np.column_stack([odd + k, odd + k + 1, even + k])
        if j % 2 == 0:  # the shifted row lies above: triangles based on it stand on their heads
            on_odd = on_odd[:, [1, 0, 2]]
        else:
            on_even = on_even[:, [1, 0, 2]]
        row = np.empty((2 * nx + 1, 3), np.int64)
        row[0::2], row[1::2] = on_odd, on_even
        layers.append(row)
    sides = {
        "left": first[:-1],
        "right": first[1:] - 1,
        "bottom": np.arange(first[0], first[1]),
        "top": np.arange(first[ny], first[ny + 1]),
    }
    return _named(points, np.concatenate(layers), sides, group)


def _interleaved(parts: list[np.ndarray]) -> np.ndarray:
    return np.stack(parts, axis=1).reshape(-1, parts[0].shape[1])


def _named(points: np.ndarray, cells: np.ndarray, sides: dict[str, np.ndarray], group: tuple[str, str] | None) -> Mesh:
    layers = {name: np.column_stack([p[:-1], p[1:]]) for name, p in sides.items()}
    groups = {group[0]: {group[1]: np.arange(len(cells))}} if group else {}
    return Mesh.of(points, cells, groups, layers)

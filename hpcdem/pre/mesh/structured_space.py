"""Boxes of tetrahedra by rule. Points are numbered along x, then y, then z. The six sides are the layers `left` and
`right` (x), `front` and `back` (y), `bottom` and `top` (z)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.tetrahedra import volumes
from hpcdem.pre.mesh.sizes import not_too_many

SPLITS = (5, 6, 12)
"""Numbers of tetrahedra into which a box can be divided: 5, mirrored from box to box; 6 about one diagonal (Kuhn); 12
about a point in the middle."""
SIDES = (("left", 0, 0), ("right", 0, -1), ("front", 1, 0), ("back", 1, -1), ("bottom", 2, 0), ("top", 2, -1))


def box(lines: Sequence[np.ndarray], split: int = 6, group: tuple[str, str] | None = None) -> Mesh:
    """Tetrahedra between the grid lines in x, y and z (ascending); group: (set, group) for all of them."""
    return of_grid(_grid(lines, split), split, group)


def _grid(lines: Sequence[np.ndarray], split: int = 6) -> np.ndarray:
    """(nz + 1, ny + 1, nx + 1, 3) points where grid lines cross."""
    if not all(len(line) > 1 and np.isfinite(line).all() and (np.diff(line) > 0.0).all() for line in lines):
        raise CommandError("grid lines must be finite and ascend")
    n = [len(line) - 1 for line in lines]
    not_too_many(float(np.prod(np.array(n, np.float64))) * split, f"cells {' '.join(map(str, n))}")
    z, y, x = np.meshgrid(lines[2], lines[1], lines[0], indexing="ij")
    return np.stack([x, y, z], axis=-1)


def of_grid(grid: np.ndarray, split: int = 6, group: tuple[str, str] | None = None) -> Mesh:
    """Tetrahedra between the points of a grid (nz + 1, ny + 1, nx + 1, 3) with right-handed edges."""
    if split not in SPLITS:
        raise CommandError(f"a box is split into {', '.join(map(str, SPLITS))} tetrahedra, not into {split}")
    n = np.array(grid.shape[2::-1]) - 1
    not_too_many(float(np.prod(n)) * split, f"cells {' '.join(map(str, n))}")
    points = grid.reshape(-1, 3)
    number = np.arange(len(points)).reshape(*(n + 1)[::-1])
    corner: dict[tuple[int, ...], np.ndarray] = {
        (i, j, k): number[k : n[2] + k, j : n[1] + j, i : n[0] + i].ravel() for i, j, k in np.ndindex(2, 2, 2)
    }
    if split == 12:
        middle = len(points) + np.arange(int(np.prod(n)))
        points = np.concatenate([points, sum(points[c] for c in corner.values()) / 8.0])
        parts = [[*(corner[at] for at in face), middle] for face in _faces()]
        cells = _upright(points, parts)
    elif split == 6:
        parts = []
        for order in permutations(range(3)):
            at, path = [0, 0, 0], [corner[0, 0, 0]]
            for axis in order:
                at[axis] = 1
                path.append(corner[tuple(at)])
            parts.append(path)
        cells = _upright(points, parts)
    else:
        k, j, i = (v.ravel() for v in np.indices(tuple(n[::-1])))
        odd = ((i + j + k) % 2 == 1)[:, None]
        even: list[list[tuple[int, ...]]] = [[(0, 0, 0), (1, 1, 0), (1, 0, 1), (0, 1, 1)]]
        even += [[a, *(_step(a, axis) for axis in range(3))] for a in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1))]
        turned = [[(1 - a[0], a[1], a[2]) for a in part] for part in even]
        corners = [np.column_stack([corner[a] for a in part]) for part in even]
        others = [np.column_stack([corner[a] for a in part]) for part in turned]
        cells = _upright(points, [list(np.where(odd, other, one).T) for one, other in zip(corners, others)])
    layers = {name: _triangles_on(cells, _side(number, axis, end)) for name, axis, end in SIDES}
    groups = {group[0]: {group[1]: np.arange(len(cells))}} if group else {}
    return Mesh.of(points, cells, groups, layers)


def hexes(lines: Sequence[np.ndarray], group: tuple[str, str] | None = None) -> Mesh:
    """Hexahedra between the grid lines in x, y and z, with the layers of `box`."""
    return hexes_of_grid(_grid(lines), group)


def hexes_of_grid(grid: np.ndarray, group: tuple[str, str] | None = None) -> Mesh:
    """Hexahedra between the points of a grid, see `of_grid`."""
    made = of_grid(grid, 6)
    n = np.array(grid.shape[2::-1]) - 1
    number = np.arange(len(made.points)).reshape(*(n + 1)[::-1])
    corner = {(i, j, k): number[k : n[2] + k, j : n[1] + j, i : n[0] + i].ravel() for i, j, k in np.ndindex(2, 2, 2)}
    ring = ((0, 0), (1, 0), (1, 1), (0, 1))
    points = np.column_stack([corner[i, j, k] for k in (0, 1) for i, j in ring])
    found = Mesh.of_hexes(made.points, points)
    layers = {name: _triangles_on(found.cells, _side(number, axis, end)) for name, axis, end in SIDES}
    groups = {group[0]: {group[1]: np.arange(len(found.cells))}} if group else {}
    return Mesh.of(found.points, found.cells, groups, layers, macros=found.macros)


def _step(at: tuple[int, int, int], axis: int) -> tuple[int, ...]:
    return tuple(1 - c if k == axis else c for k, c in enumerate(at))


def _faces() -> list[list[tuple[int, ...]]]:
    """List the two triangles of each side of a box, cut alike on opposite sides, by their corners."""
    found = []
    for axis in range(3):
        for end in (0, 1):
            a, b, c, d = (
                tuple(np.insert(at, axis, end).tolist()) for at in ((0, 0), (1, 0), (1, 1), (0, 1))
            )  # fmt: skip
            found += [[a, b, c], [a, c, d]]
    return found


def _upright(points: np.ndarray, parts: list[list[np.ndarray]]) -> np.ndarray:
    """(n, 4) tetrahedra, box after box, all with a positive volume."""
    cells = np.stack([np.column_stack(part) for part in parts], axis=1).reshape(-1, 4)
    turned = volumes(points, cells) < 0.0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    return cells


def _side(number: np.ndarray, axis: int, end: int) -> np.ndarray:
    return np.take(number, end, axis=2 - axis).ravel()


def _triangles_on(cells: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(k, 3) faces of tetrahedra whose points are all among these."""
    on = np.isin(cells, points)
    at = np.flatnonzero(on.sum(axis=1) == 3)
    return cells[at][on[at]].reshape(-1, 3)


def layers(points: np.ndarray, triangles: np.ndarray, heights: np.ndarray) -> Mesh:
    """Tetrahedra between copies of triangles (m, 3) with these points (n, 2) at heights that ascend: each prism is cut
    into three by the numbers of its points, so that neighbours fit."""
    n = len(points)
    every = np.concatenate([np.column_stack([points, np.full(n, z)]) for z in heights])
    low = np.sort(triangles, axis=1)
    parts = []
    for k in range(len(heights) - 1):
        (a, b, c), (d, e, f) = (low + k * n).T, (low + (k + 1) * n).T
        parts += [[a, b, c, f], [a, b, e, f], [a, d, e, f]]
    return Mesh.of(every, _upright(every, parts))


def sector(radii: np.ndarray, parts: int, turn: float, heights: np.ndarray) -> Mesh:
    """Layers of a sector from the x axis on by `turn` [rad] in so many parts, with circles of these radii, the first 0:
    diagonals both ways in turn."""
    m = parts + 1
    angle = np.linspace(0.0, turn, m)
    rings = np.stack([np.outer(radii[1:], np.cos(angle)), np.outer(radii[1:], np.sin(angle))], axis=-1)
    points = np.concatenate([np.zeros((1, 2)), rings.reshape(-1, 2)])
    j = np.arange(parts)
    first = np.column_stack([np.zeros(parts, np.int64), 1 + j, 2 + j])
    i, j = (k.reshape(-1) for k in np.meshgrid(np.arange(len(radii) - 2), j, indexing="ij"))
    a, b = 1 + i * m + j, 1 + (i + 1) * m + j
    even = ((i + j) % 2 == 0)[:, None]
    one = np.where(even, np.column_stack([a, b, b + 1]), np.column_stack([a, b, a + 1]))
    two = np.where(even, np.column_stack([a, b + 1, a + 1]), np.column_stack([b, b + 1, a + 1]))
    return layers(points, np.concatenate([first, one, two]), heights)

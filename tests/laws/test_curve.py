"""Hilbert's curve over the cells of space, and the rows that others need along it."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.decomp.curve import MOST_LEVELS, Grid, cube_of, key_of, overlapping


@pytest.mark.parametrize("levels", [1, 2, 3, 4])
def test_the_curve_passes_each_cube_once_from_neighbour_to_neighbour(levels: int) -> None:
    cubes = np.array([cube_of(key, levels) for key in range(8**levels)])
    assert [key_of(*cube, levels) for cube in cubes.tolist()] == list(range(8**levels))
    assert (np.abs(np.diff(cubes, axis=0)).sum(axis=1) == 1).all()


def test_a_fine_grid_has_keys_of_its_own() -> None:
    last = (1 << MOST_LEVELS) - 1
    for cube in ((0, 0, 0), (last, last, last), (last, 0, 12345), (7, last - 3, 1 << 19)):
        key = key_of(*cube, MOST_LEVELS)
        assert 0 <= key < 1 << 60 and cube_of(key, MOST_LEVELS) == cube


def test_a_grid_covers_the_model_and_counts_what_lies_outside_to_its_faces() -> None:
    points = np.array([[-2.5, 0.0, 9.9], [3.4, 7.0, 10.1]])
    grid = Grid.around(points[0], points[1], 0.5)
    assert grid.levels == 4 and grid.side == 0.5  # 15 cubes along y
    assert len(np.unique(grid.keys(points))) == 2
    outside = grid.keys(np.array([[1e30, 3.0, 10.0], [1e9, 3.0, 10.0], [np.nan, 3.0, 10.0]]))
    assert len(np.unique(outside)) == 1
    assert Grid.around(points[0], points[0], 0.5).levels == 1
    assert Grid.around(-1e9 * np.ones(3), 1e9 * np.ones(3), 1e-3).levels == MOST_LEVELS


def test_cubes_beside_are_all_within_one_side() -> None:
    """Of any two points not farther apart than a side along each axis, one lies beside the cube of the other."""
    rng = np.random.default_rng(3)
    a = rng.uniform(-1.0, 9.0, (500, 3))  # some outside of the grid
    b = a + rng.uniform(-1.0, 1.0, (500, 3))
    grid = Grid.around(np.zeros(3), np.full(3, 7.5), 1.0)
    beside = grid.beside(grid.keys(a))
    assert beside.shape == (500, 27)
    assert (beside == grid.keys(b)[:, None]).any(axis=1).all()


def test_rows_are_needed_where_boxes_overlap() -> None:
    """Compared with all pairs."""
    rng = np.random.default_rng(5)
    points = rng.uniform(0.0, 6.0, (400, 3))
    grid = Grid.around(np.zeros(3), np.full(3, 6.0), 1.0)
    key = grid.keys(points)
    order = np.argsort(key, kind="stable")
    key, points = key[order], points[order]
    boxes = np.hstack([points - 0.3, points + 0.3])
    mine, others = boxes[:250], boxes[250:]
    meet = ((mine[:, None, :3] <= others[:, 3:]) & (others[:, :3] <= mine[:, None, 3:])).all(axis=2).any(axis=1)
    found = overlapping(key[:250], mine, grid.beside(key[250:]), others)
    assert found.tolist() == np.flatnonzero(meet).tolist() and 0 < len(found) < 250
    assert len(overlapping(key[:0], mine[:0], grid.beside(key[250:]), others)) == 0

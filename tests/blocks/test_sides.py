"""Numbers of nodes: points, and the sides of points at which elements have parted."""

from __future__ import annotations

import numpy as np

from hpcdem.physics.fdem import guards, sides
from hpcdem.physics.fdem.sides import SIDE

CELLS = np.array([[0, 1, 2, -1], [1, 3, 2, -1], [3, 4, 5, 2]])
"""Two triangles and a quad; the point 2 belongs to all of them."""
SOME = np.array([0, 5, SIDE + 4 * 1 + 2, SIDE + 4 * 2 + 3])
"""The points 0 and 5, and two sides of the point 2."""


def test_points_and_corners_of_numbers() -> None:
    assert sides.are_there(SOME) and not sides.are_there(SOME[:2]) and not sides.are_there(SOME[:0])
    assert sides.points(CELLS, SOME).tolist() == [0, 2, 5] and sides.points(CELLS, SOME[:2]).tolist() == [0, 5]
    assert np.flatnonzero(sides.corners(CELLS, SOME, 6)).tolist() == [0, 6, 10, 11]


def test_a_side_of_a_missing_element_is_none() -> None:
    """The point stands in for its sides where none of them is left."""
    there = np.array([True, False, True])
    assert sides.present(CELLS, SOME, there).tolist() == [0, 5, SIDE + 11]
    assert sides.present(CELLS, SOME, np.array([True, False, False])).tolist() == [0, 2, 5]
    assert sides.present(CELLS, SOME, np.ones(3, bool)) is SOME


def test_numbers_of_corners() -> None:
    """A point of which all corners are chosen, but for missing elements; else its sides."""
    chosen = np.zeros(12, bool)
    chosen[[0, 2, 6, 11, 5]] = True  # point 0; all of point 2; one of two of point 3
    assert sides.numbers(CELLS, chosen, np.ones(3, bool)).tolist() == [0, 2, SIDE + 5]
    chosen[2] = False
    assert sides.numbers(CELLS, chosen, np.ones(3, bool)).tolist() == [0, SIDE + 5, SIDE + 6, SIDE + 11]
    assert sides.numbers(CELLS, chosen, np.array([False, True, True])).tolist() == [2, SIDE + 5]


def test_twice_the_area_of_a_triangle() -> None:
    x = np.array([[9.0, 9.0, 1.0, 2.0, 4.0, 3.0, 2.0, 7.0]])
    assert guards._turn(x, 2, 4, 6).tolist() == [3.0 * 5.0 - 1.0 * 1.0]

"""What a mesh in space is like: closed forms of cubes and of a regular tetrahedron."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.pre.mesh.quality import quality
from tests.space.support import box, hexes


def test_cubes():
    found = quality(hexes((2, 1, 1), (2.0, 1.0, 1.0)))
    assert (found.hexahedra, found.tetrahedra, found.points, found.edges, found.inner_edges) == (2, 0, 12, 22, 2)
    assert found.area == pytest.approx(2.0) and found.edge_least == found.edge_greatest == 1.0
    assert found.angle_least == pytest.approx(90.0) and found.angle_greatest == pytest.approx(90.0)
    assert found.aspect_mean == pytest.approx(1.0) and "2 hexahedra" in found.lines()[0]


def test_a_regular_tetrahedron():
    found = quality(Mesh.of(np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]), [[0, 1, 3, 2]]))
    assert found.angle_least == pytest.approx(np.degrees(np.arccos(1.0 / 3.0)))
    assert found.angle_greatest == pytest.approx(found.angle_least) and found.aspect_greatest == pytest.approx(1.0)
    assert found.altitude_least == pytest.approx(np.sqrt(2.0 / 3.0) * np.sqrt(8.0)) and found.edges == 4


def test_cubes_of_tetrahedra():
    """Six in each around its diagonal: angles of 45 to 90 degrees."""
    found = quality(box((1, 1, 1), (1.0, 1.0, 1.0)))
    assert found.tetrahedra == 6 and found.angle_least == pytest.approx(45.0)
    assert found.angle_greatest == pytest.approx(90.0) and found.edge_greatest == pytest.approx(np.sqrt(3.0))

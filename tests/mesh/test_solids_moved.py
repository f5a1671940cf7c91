"""Bodies and surfaces in space that are moved, turned, scaled and mirrored."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.pre.mesh import solids

SQUARE = ((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 1.0, 0.0), (0.5, 1.5, 0.0))
TETRAHEDRON = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
SOLIDS = {
    "box": ((0.0, 1.0, 2.0), (2.0, 4.0, 3.0)), "sphere": ((1.0, 2.0, 3.0), 0.7),
    "cylinder": ((0.0, 0.0, 0.0), (1.0, 2.0, 0.5), 0.4), "cone": ((0.0, 0.0, 0.0), (1.0, 2.0, 0.5), 0.4, 0.2),
    "extrude": (SQUARE, (0.0, 0.0, 1.5)), "revolve": (SQUARE, (0.0, -1.0, 0.0), (1.0, 0.0, 0.0), 130.0),
    "shell": (tuple(map(tuple, TETRAHEDRON.reshape(-1, 3).tolist())),), "polygon": (SQUARE,),
    "disc": ((1.0, 0.0, 2.0), (0.3, 0.2, 1.0), 0.6), "plane": ((1.0, 0.0, 2.0), (0.3, 0.2, 1.0)),
}  # fmt: skip


@pytest.mark.some_of_each
@pytest.mark.parametrize("mirror", [(1.0, 1.0, 1.0), (1.0, -1.0, 1.0)], ids=["turned", "mirrored"])
@pytest.mark.parametrize("kind", SOLIDS)
def test_distances_go_along(kind, mirror):
    """A point that goes the same way is as far from it as before, times the scale."""
    solid = solids.made(kind, *SOLIDS[kind])
    points = np.random.default_rng(5).uniform(-2, 4, (200, 3))
    axis, about, way, size = np.array([1.0, 2.0, -0.5]), np.array([0.3, -1.0, 0.2]), np.array([5.0, 0.0, -1.0]), 1.7
    moved = solids.transformed(solid, way, 40.0, size * np.array(mirror), about, axis)
    n, t = axis / np.linalg.norm(axis), np.radians(40.0)
    p = (points - about) * mirror * size
    p = p * np.cos(t) + np.cross(n, p) * np.sin(t) + np.outer(p @ n, n) * (1.0 - np.cos(t))  # Rodrigues
    assert moved.distance(p + about + way) == pytest.approx(size * solid.distance(points), rel=1e-9, abs=1e-9)


def test_a_box_stays_one_and_can_be_stretched():
    box = solids.made("box", (0.0, 0.0, 0.0), (1.0, 2.0, 3.0))
    turned = solids.transformed(box, (1.0, 0.0, 0.0), 90.0, (1.0, 2.0, 1.0))
    assert isinstance(turned, solids.Box) and turned.bounds().tolist() == [[-3.0, 0.0, 0.0], [1.0, 1.0, 3.0]]
    assert isinstance(solids.transformed(box, rotate=10.0), solids.Extruded)


@pytest.mark.parametrize(
    ("kind", "how", "message"),
    [("sphere", {"scale": (1.0, 2.0, 1.0)}, r"factors \(1, 2, 1\) would make a sphere oval"),
     ("box", {"scale": (1.0, 0.0, 1.0)}, "factors and axis not zero"),
     ("box", {"rotate": 10.0, "axis": (0.0, 0.0, 0.0)}, "factors and axis not zero")],
)  # fmt: skip
def test_what_cannot_be_is_refused(kind, how, message):
    with pytest.raises(CommandError, match=message):
        solids.transformed(solids.made(kind, *SOLIDS[kind]), **how)


def test_in_a_script(tmp_path):
    """The hole of a mesh is where its layer went; ranges know it."""
    from tests.pcdc.test_plastic import run

    text = """
pcdc model new dim 3
pcdc geometry create box (0,0,0) (1,1,1) as-layer 'a'
pcdc geometry create cylinder (0,0,0) (0,0,2) 0.3 as-layer 'b'
pcdc geometry transform 'a' scale 2 move (1,0,0)
pcdc geometry transform 'b' rotate 90 axis (1,0,0)
pcdc geometry scale (1,1,-1) layer 'a'
pcdc geometry translate (0,0,5)
"""
    layers = run(tmp_path, text).project.layers
    assert layers["a"][0].bounds().tolist() == [[1.0, 0.0, 3.0], [3.0, 2.0, 5.0]]
    assert np.allclose(layers["b"][0].second, (0.0, -2.0, 5.0))

"""Inner points in the middle of their neighbours: where they are, what stays, and outlines that would turn triangles
over."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.mesh import Mesh, check
from hpcdem.pre.mesh import geometry
from hpcdem.pre.mesh.geometry import Layers
from hpcdem.pre.mesh.quality import quality
from hpcdem.pre.mesh.sizes import Refinement
from hpcdem.pre.mesh.smooth import smoothed
from hpcdem.pre.mesh.triangulate import Meshed, MeshSettings, Region, triangulate

STAR = [(r * math.cos(a), r * math.sin(a)) for a, r in ((0.2 * math.pi * k, (1.0, 0.3)[k % 2]) for k in range(10))]
COMB = [(0, 0), (9, 0), (9, 5), (8, 5), (8, 1), (6, 1), (6, 5), (5, 5), (5, 1), (1, 1), (1, 5), (0, 5)]


def meshed(curves: dict, size: float, smooth: bool = True, **wishes) -> Meshed:
    layers = Layers()
    for name, curve in curves.items():
        layers.add(name, curve)
    wishes = {"irregular": True} | wishes
    made = triangulate(layers, MeshSettings([Region("o", "rock")], size, smooth=smooth, **wishes))
    check(made.mesh)
    return made


def off_the_middle(mesh: Mesh) -> np.ndarray:
    """(np,) distance from the mean of the neighbours [m]; NaN for points of the outline and of layers."""
    edges = mesh.edges()
    total, count = np.zeros_like(mesh.points), np.zeros(len(mesh.points))
    for a, b in (edges.points.T, edges.points.T[::-1]):
        np.add.at(total, a, mesh.points[b])
        np.add.at(count, a, 1.0)
    far = np.hypot(*(mesh.points - total / count[:, None]).T)
    far[edges.points[~edges.inner]] = np.nan
    for pairs in (*mesh.layers.values(), mesh.cracks):
        far[np.asarray(pairs, np.int64).reshape(-1)] = np.nan
    return far


@pytest.mark.usefixtures("gmsh")
@pytest.mark.parametrize(
    "curves, size, wishes",
    [
        ({"o": geometry.rectangle((0, 0), (3, 2))}, 0.2, {}),
        ({"o": geometry.rectangle((0, 0), (3, 2))}, 0.2, {"irregular": False}),
        ({"o": geometry.rectangle((-1e6, 0), (-1e6 + 0.03, 0.02))}, 0.002, {}),
        ({"o": geometry.circle((0, 0), 5), "h": geometry.circle((1, 0), 0.5)}, 1.0,
         {"holes": ["h"], "refine": [Refinement("h", 0.1)]}),
        ({"o": geometry.rectangle((0, 0), (3, 2)), "l": geometry.polyline([(0.5, 1), (2, 1.5), (2.5, 0.4)])}, 0.2,
         {"inside": ["l"]}),
        ({"o": geometry.rectangle((0, 0), (3, 2)), "c": geometry.polyline([(0.5, 1), (2, 1.5)])}, 0.2,
         {"cracks": [("c", 0)]}),
    ],
)  # fmt: skip
def test_points_are_in_the_middle_of_their_neighbours(curves, size, wishes):
    """To rounding; lines stay where they are, and so do the area, the elements and the sizes."""
    made, plain = meshed(curves, size, **wishes), meshed(curves, size, smooth=False, **wishes)
    mesh, before = made.mesh, plain.mesh
    far = off_the_middle(mesh)
    reach = np.abs(mesh.points).max()
    assert np.isfinite(far).sum() > 20 and np.nanmax(far) < 1e-9 * size + 1e-14 * reach
    assert np.nanmax(off_the_middle(before)) > 0.05 * quality(before).edge_least
    stay = np.isnan(far)
    assert np.array_equal(mesh.cells, before.cells) and np.array_equal(mesh.points[stay], before.points[stay])
    one, two = quality(mesh), quality(before)
    assert one.area == pytest.approx(two.area, rel=1e-9) and one.angle_least >= 20.0
    assert one.edge_mean == pytest.approx(two.edge_mean, rel=0.03) and made.notes == plain.notes


@pytest.mark.usefixtures("gmsh")
@pytest.mark.parametrize("outline, size", [(STAR, 0.09), (COMB, 0.5), (COMB, 0.9), (COMB, 3.0)])
def test_outlines_that_are_not_convex(outline, size):
    """No triangle turns over or becomes sharper than 20 degrees, if it was not before."""
    made, plain = (meshed({"o": geometry.polygon(outline)}, size, smooth) for smooth in (True, False))
    assert quality(made.mesh).angle_least >= min(20.0, quality(plain.mesh).angle_least) - 1e-9
    assert quality(made.mesh).area == pytest.approx(quality(plain.mesh).area, rel=1e-9)


def test_triangles_that_would_turn_over_keep_their_corners():
    """A point beside the inner corner of an L belongs, by the mean of its neighbours, outside of it: it stays."""
    points = np.array([[0, 0], [4, 0], [4, 0.2], [0.2, 0.2], [0.2, 4], [0, 4], [0.1, 0.1]], float)
    cells = np.array([[0, 1, 6, -1], [1, 2, 6, -1], [2, 3, 6, -1], [3, 4, 6, -1], [4, 5, 6, -1], [5, 0, 6, -1]])
    held = np.arange(7) < 6
    out, stayed = smoothed(points, cells, held)
    mean = points[:6].mean(axis=0)
    assert mean.min() > 1.0  # far outside of the arms
    assert stayed == 1 and np.array_equal(out, points)


def test_nothing_to_move():
    points = np.array([[0, 0], [1, 0], [0, 1], [7, 7]], float)  # the last belongs to no triangle
    out, stayed = smoothed(points, np.array([[0, 1, 2, -1]]), np.array([True, True, True, False]))
    assert np.array_equal(out, points) and stayed == 0


@pytest.mark.usefixtures("gmsh")
def test_quads_are_refused():
    with pytest.raises(CommandError, match="smooth supports triangles only"):
        meshed({"o": geometry.rectangle((0, 0), (3, 2))}, 0.2, kind="quad", irregular=False)

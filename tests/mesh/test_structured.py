"""Structured meshes: counts, areas, gradings; edges that lie on lines, cracks that follow them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.mesh import check
from hpcdem.pre.mesh import geometry, structured
from hpcdem.pre.mesh.cracks import edges_on, follow, with_layer
from hpcdem.pre.mesh.fractures import Fractures, of_curves
from hpcdem.pre.mesh.quality import corner_angles, quality
from hpcdem.pre.mesh.sizes import spaced
from hpcdem.pre.mesh.structured import DIAGONALS, equilateral, rectangle


@pytest.mark.parametrize("diagonal", DIAGONALS)
def test_triangles(diagonal):
    mesh = rectangle(spaced(1.0, 4.0, 6), spaced(0.0, 2.0, 4), "tri", diagonal, ("s", "g"))
    check(mesh)
    per = 4 if diagonal == "both" else 2
    assert len(mesh.cells) == 24 * per and len(mesh.points) == 35 + 24 * (per == 4)
    np.testing.assert_allclose(mesh.areas(), 0.25 / per)
    assert {n: len(p) for n, p in mesh.layers.items()} == {"left": 4, "right": 4, "bottom": 6, "top": 6}
    for name, axis, value in (("left", 0, 1.0), ("right", 0, 4.0), ("bottom", 1, 0.0), ("top", 1, 2.0)):
        assert (mesh.points[mesh.layers[name], axis] == value).all()
    assert len(mesh.groups["s"]["g"]) == len(mesh.cells)


@pytest.mark.parametrize(("diagonal", "slope"), [("right", 1.0), ("left", -1.0)])
def test_diagonals_lean_as_their_name_says(diagonal, slope):
    mesh = rectangle(spaced(0, 3, 3), spaced(0, 3, 3), "tri", diagonal)
    edges = mesh.edges()
    way = mesh.points[edges.points[:, 1]] - mesh.points[edges.points[:, 0]]
    leaning = (way != 0.0).all(axis=1)
    assert leaning.sum() == 9
    np.testing.assert_array_equal(way[leaning, 1] / way[leaning, 0], slope)


def test_alternate_diagonals_meet_in_every_second_point():
    mesh = rectangle(spaced(0, 4, 4), spaced(0, 4, 4), "tri", "alternate")
    degree = np.bincount(mesh.edges().points.ravel(), minlength=25).reshape(5, 5)
    inner = degree[1:4, 1:4]
    np.testing.assert_array_equal(inner, [[8, 4, 8], [4, 8, 4], [8, 4, 8]])


def test_grading():
    """n intervals a, a q, ... : a = W (q - 1) / (q^n - 1)."""
    x = spaced(2.0, 12.0, 20, 1.1)
    assert x[0] == 2.0 and x[-1] == 12.0
    np.testing.assert_allclose(np.diff(x)[0], 10.0 * 0.1 / (1.1**20 - 1.0), rtol=1e-12)
    np.testing.assert_allclose(np.diff(x)[1:] / np.diff(x)[:-1], 1.1, rtol=1e-10)
    np.testing.assert_allclose(spaced(0.0, 1.0, 7, 0.5), 1.0 - spaced(0.0, 1.0, 7, 2.0)[::-1], atol=1e-15)
    mesh = rectangle(x, spaced(0.0, 1.0, 3))
    check(mesh)
    assert math.isclose(mesh.areas().sum(), 10.0, rel_tol=1e-13)


def test_equilateral():
    """Edge 1, height 4 rows of sqrt(3)/2: 2 nx + 1 triangles a row, all equilateral but the halves at the sides."""
    mesh = equilateral((1.0, -1.0), 8.0, 4.0 * math.sqrt(0.75), 1.0)
    check(mesh)
    assert len(mesh.cells) == 4 * 17
    assert math.isclose(mesh.areas().sum(), 32.0 * math.sqrt(0.75), rel_tol=1e-13)
    least = np.nanmin(corner_angles(mesh), axis=1)
    whole = least > 45.0
    assert whole.sum() == 4 * 15
    np.testing.assert_allclose(least[whole], 60.0, rtol=1e-12)
    np.testing.assert_allclose(least[~whole], 30.0, rtol=1e-12)
    assert {n: len(p) for n, p in mesh.layers.items()} == {"left": 4, "right": 4, "bottom": 8, "top": 8}
    odd = equilateral((0.0, 0.0), 3.0, 2.0, 0.7)
    check(odd)
    assert math.isclose(odd.areas().sum(), 6.0, rel_tol=1e-13)


@pytest.mark.parametrize(
    "call",
    [
        lambda: spaced(1.0, 1.0, 3),
        lambda: spaced(0.0, math.inf, 3),
        lambda: spaced(0.0, 1.0, 0),
        lambda: spaced(0.0, 1.0, 3, 0.0),
        lambda: spaced(0.0, 1.0, 1000, 10.0),
        lambda: rectangle(np.array([0.0, 2.0, 1.0]), spaced(0, 1, 1)),
        lambda: rectangle(spaced(0, 1, 1), spaced(0, 1, 1), "hex"),
        lambda: rectangle(spaced(0, 1, 1), spaced(0, 1, 1), "tri", "zigzag"),
        lambda: equilateral((0.0, 0.0), 1.0, -1.0, 0.1),
        lambda: equilateral((0.0, math.nan), 1.0, 1.0, 0.1),
    ],
)
def test_nonsense_is_refused(call):
    with pytest.raises(CommandError):
        call()


def test_quality_of_known_shapes():
    """Right triangles of legs 1: angles 45 and 90, altitude sqrt(1/2), aspect 2 (sqrt 3 / 4) / (1 / 2) = sqrt 3."""
    q = quality(rectangle(spaced(0, 4, 4), spaced(0, 3, 3), "tri", "right"))
    assert (q.triangles, q.quads, q.points, q.edges, q.inner_edges) == (24, 0, 20, 43, 29)
    assert math.isclose(q.angle_least, 45.0) and math.isclose(q.angle_greatest, 90.0)
    assert math.isclose(q.altitude_least, math.sqrt(0.5)) and math.isclose(q.aspect_greatest, math.sqrt(3.0))
    assert math.isclose(q.edge_mean, (31.0 + 12.0 * math.sqrt(2.0)) / 43.0)
    q = quality(rectangle(spaced(0, 4, 4), spaced(0, 3, 3)))
    assert q.aspect_greatest == 1.0 and math.isclose(q.altitude_least, math.sqrt(0.5)) and q.quads == 12
    assert any("12 quads" in line for line in q.lines())


def test_edges_on_a_line_and_on_an_arc():
    mesh = rectangle(spaced(0, 10, 20), spaced(0, 6, 12))
    assert len(edges_on(mesh, [geometry.polyline([(2.0, 3.0), (7.0, 3.0)])])) == 10
    assert len(edges_on(mesh, [geometry.polyline([(2.0, 3.01), (7.0, 3.01)])])) == 0
    assert len(edges_on(mesh, [geometry.polyline([(2.0, 3.01), (7.0, 3.01)])], tolerance=0.02)) == 10
    assert len(edges_on(mesh, [geometry.rectangle((1.0, 1.0), (3.0, 2.0))])) == 12
    named = with_layer(mesh, "bed", edges_on(mesh, [geometry.polyline([(0.0, 3.0), (10.0, 3.0)])]))
    check(named)
    assert len(named.layers["bed"]) == 20 and len(mesh.layers) == 4
    # A ring of quads about a hole: its inner edges are chords of the circle, its spokes are not.
    turn = np.arange(16) * (2.0 * math.pi / 16)
    xy = np.concatenate([r * np.column_stack([np.cos(turn), np.sin(turn)]) for r in (1.0, 1.5)])
    k = np.arange(16)
    ring = structured.Mesh.of(xy, np.column_stack([k, 16 + k, 16 + (k + 1) % 16, (k + 1) % 16]))
    check(ring)
    assert len(edges_on(ring, [geometry.circle((0.0, 0.0), 1.0)])) == 16
    assert len(edges_on(ring, [geometry.arc((0.0, 0.0), 1.5, -10.0, 100.0)])) == 4
    assert len(edges_on(ring, [geometry.circle((0.0, 0.0), 1.2)])) == 0


def test_a_crack_on_grid_lines_is_exact_and_an_inclined_one_stays_near():
    mesh = rectangle(spaced(0, 10, 20), spaced(0, 6, 12), "tri", "both")
    straight = of_curves([geometry.polyline([(2.0, 1.0), (2.0, 3.0), (6.0, 3.0)])], 4, 1.0)
    cracked = follow(mesh, straight)
    check(cracked)
    along = mesh.points[cracked.cracks]
    assert len(cracked.cracks) == 12 and set(cracked.crack_sets) == {4}
    assert math.isclose(np.hypot(*(along[:, 1] - along[:, 0]).T).sum(), 6.0)
    inclined = Fractures(np.array([[(1.0, 1.0), (9.0, 4.7)]]), np.array([0]))
    cracked = follow(mesh, inclined)
    check(cracked)
    curve = geometry.polyline([(1.0, 1.0), (9.0, 4.7)])
    assert geometry.distance(curve, mesh.points[np.unique(cracked.cracks)]).max() < 0.36  # largest edge 0.5, half 0.354
    # One way from end to end: two ends, everything else has two edges.
    degree = np.bincount(np.bincount(cracked.cracks.ravel())[np.unique(cracked.cracks)])
    assert degree[1] == 2 and len(degree) == 3
    assert len(follow(mesh, Fractures(np.array([[(1.0, 1.0), (1.01, 1.0)]]), np.array([0]))).cracks) == 0
    along_rim = follow(mesh, Fractures(np.array([[(0.0, 0.0), (10.0, 0.0)]]), np.array([0])))
    assert len(along_rim.cracks) == 0


def test_a_trace_between_two_bodies_is_refused():
    one = rectangle(spaced(0, 1, 2), spaced(0, 1, 2))
    both = structured.Mesh.of(
        np.concatenate([one.points, one.points + (3.0, 0.0)]), np.concatenate([one.cells, one.cells + len(one.points)])
    )
    with pytest.raises(CommandError, match="different bodies"):
        follow(both, Fractures(np.array([[(0.5, 0.5), (3.5, 0.5)]]), np.array([0])))

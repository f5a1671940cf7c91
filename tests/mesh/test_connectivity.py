"""Who is next to whom: counts that follow from topology, walks, and what `check` refuses."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.physics.fdem import connectivity as cn
from hpcdem.physics.fdem.mesh import Mesh, check, crack_rows, edge_rows
from hpcdem.pre.mesh import structured
from hpcdem.pre.mesh.cracks import edges_on, with_cracks
from hpcdem.pre.mesh.geometry import polyline
from hpcdem.pre.mesh.sizes import spaced
from tests.tables import each


def grid(nx: int, ny: int, kind: str = "quad", diagonal: str = "alternate") -> Mesh:
    return structured.rectangle(spaced(0.0, nx, nx), spaced(0.0, ny, ny), kind, diagonal)


def ring() -> Mesh:
    """Eight unit squares about a missing one."""
    whole = grid(3, 3)
    return Mesh.of(whole.points, np.delete(whole.cells, 4, axis=0))


def jointed(mesh: Mesh, rows: np.ndarray, edges: cn.Edges) -> np.ndarray:
    flag = np.zeros(4 * len(mesh.cells), bool)
    flag[edges.faces[rows, 0]] = True
    return flag


MESHES = {
    "quads": grid(5, 3),
    "triangles": grid(5, 3, "tri"),
    "crossed": grid(4, 4, "tri", "both"),
    "equilateral": structured.equilateral((0.0, 0.0), 6.0, 4.0, 0.7),
    "ring": ring(),
    "mixed": Mesh.of([(0, 0), (1, 0), (1, 1), (0, 1), (2, 0.5)], [(0, 1, 2, 3), (1, 4, 2, -1)]),
}


@pytest.mark.parametrize("name", MESHES)
def test_edges_are_counted_once_and_numbered_by_their_lower_face(name):
    mesh = MESHES[name]
    check(mesh)
    edges = mesh.edges()
    # Euler: V - E + F = 1 - holes.
    assert len(mesh.points) - len(edges) + len(mesh.cells) == 1 - (name == "ring")
    # Each element has three or four faces, inner edges two of them.
    assert cn.corner_counts(mesh.cells).sum() == len(edges) + edges.inner.sum()
    assert (np.diff(edges.faces[:, 0]) > 0).all()
    assert (edges.faces[edges.inner, 1] > edges.faces[edges.inner, 0]).all()
    # From the other element the same edge runs the other way.
    other = cn.face_points(mesh.cells, edges.faces[edges.inner, 1])
    np.testing.assert_array_equal(other, edges.points[edges.inner, ::-1])
    partner = cn.face_partners(mesh.cells, len(mesh.points))
    np.testing.assert_array_equal(partner[partner[partner >= 0]], np.flatnonzero(partner >= 0))


@pytest.mark.parametrize("name", MESHES)
def test_nodes_without_and_with_all_joints(name):
    mesh = MESHES[name]
    partner = cn.face_partners(mesh.cells, len(mesh.points))
    node, lead = cn.corner_clusters(mesh.cells, partner, np.zeros(len(partner), bool))
    assert len(lead) == len(mesh.points)
    point_of_node = mesh.cells.ravel()[lead]
    here = mesh.cells >= 0
    np.testing.assert_array_equal(point_of_node[node[here]], mesh.cells[here])
    assert (node[~here] == -1).all() and (np.diff(lead) > 0).all()
    node, lead = cn.corner_clusters(mesh.cells, partner, np.ones(len(partner), bool))
    assert len(lead) == here.sum()
    np.testing.assert_array_equal(node[here], np.arange(here.sum()))


@pytest.mark.parametrize(("start", "end", "more"), [(1, 5, 3), (0, 5, 5), (0, 6, 7)])
def test_a_crack_of_k_edges_makes_k_minus_1_k_or_k_plus_1_nodes_more(start, end, more):
    """Inside the body both tips hang together; at a surface the tip opens as well; a crack right through has none."""
    mesh = grid(6, 4, "tri")
    edges = mesh.edges()
    rows = cn.find_edges(edges, edges_on(mesh, [polyline([(start, 2), (end, 2)])]), len(mesh.points))
    assert len(rows) == end - start and (rows >= 0).all()
    partner = cn.face_partners(mesh.cells, len(mesh.points))
    _, lead = cn.corner_clusters(mesh.cells, partner, jointed(mesh, rows, edges))
    assert len(lead) == len(mesh.points) + more
    cut = partner.copy()
    cut[edges.faces[rows]] = -1
    assert cn.bodies(cut).max() == (1 if more == 7 else 0)
    # The surface of the cut body: outline 20, and both sides of the crack.
    loops = cn.boundary_loops(mesh.cells, cut)
    assert sum(map(len, loops)) == 20 + 2 * len(rows)
    assert len(loops) == {3: 2, 5: 1, 7: 2}[more]


def test_outlines_run_counter_clockwise_and_holes_clockwise():
    mesh = ring()
    loops = cn.boundary_loops(mesh.cells, cn.face_partners(mesh.cells, len(mesh.points)))
    assert [len(loop) for loop in loops] == [12, 4]
    for loop, area in zip(loops, (9.0, -1.0)):
        ends = cn.face_points(mesh.cells, loop)
        np.testing.assert_array_equal(ends[:, 1], np.roll(ends[:, 0], -1))
        x, y = mesh.points[ends[:, 0]].T
        assert 0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() == area
        assert loop[0] == loop.min()


def test_bodies_that_touch_in_a_point_keep_apart():
    mesh = Mesh.of([(0, 0), (1, 0), (1, 1), (0, 1), (2, 1), (2, 2), (1, 2)], [(0, 1, 2, 3), (2, 4, 5, 6)])
    check(mesh)
    partner = cn.face_partners(mesh.cells, len(mesh.points))
    np.testing.assert_array_equal(cn.bodies(partner), [0, 1])
    node, lead = cn.corner_clusters(mesh.cells, partner, np.zeros(8, bool))
    assert len(lead) == 8 and node[0, 2] != node[1, 0]
    assert [list(loop) for loop in cn.boundary_loops(mesh.cells, partner)] == [[0, 1, 2, 3], [4, 5, 6, 7]]


def test_nothing_depends_on_how_corners_are_turned():
    """The same triangles, each beginning with another corner: the same edges and nodes by place."""
    mesh = grid(7, 5, "tri")
    turned = mesh.cells.copy()
    for e in range(len(turned)):
        turned[e, :3] = np.roll(turned[e, :3], e % 3)
    one, other = mesh.edges(), Mesh.of(mesh.points, turned).edges()
    key = [sorted(map(tuple, np.sort(e.points, axis=1).tolist())) for e in (one, other)]
    assert key[0] == key[1]


def test_areas_and_centroids():
    """A trapezium 0 <= x <= 2 - y/2, 0 <= y <= 2: area 3; moments: x 7/3, y 8/3 (by integration)."""
    mesh = Mesh.of([(0, 0), (2, 0), (1, 2), (0, 2), (5, 0)], [(0, 1, 2, 3), (1, 4, 2, -1)])
    np.testing.assert_allclose(mesh.areas(), [3.0, 3.0])
    np.testing.assert_allclose(mesh.centroids(), [(7 / 9, 8 / 9), (8 / 3, 2 / 3)])


def test_nearest_point_and_element():
    mesh = grid(3, 3)
    assert cn.nearest_point(mesh.points, (1.2, 0.9)) == 5
    assert cn.nearest_point(mesh.points, (0.5, 0.5)) == 0  # four are as near: the lowest
    assert cn.nearest_point(mesh.points, (0.5, 0.5), among=np.array([9, 5])) == 5
    assert cn.nearest_element(mesh.points, mesh.cells, (1.5, 1.5)) == 4
    assert cn.nearest_element(mesh.points, mesh.cells, (1.0, 1.5)) == 3  # on the edge of two
    assert cn.nearest_element(mesh.points, mesh.cells, (9.0, 2.5)) == 8
    assert cn.nearest_element(mesh.points, mesh.cells, (1.5, 1.5), among=np.array([0, 7])) == 7
    # An obtuse triangle: its centroid is far, but the point lies in it.
    long = Mesh.of([(0, 0), (10, 0), (0, 1), (10, 1)], [(0, 1, 2), (1, 3, 2)])
    assert cn.nearest_element(long.points, long.cells, (0.1, 0.95)) == 0
    assert cn.nearest_element(long.points, long.cells, (9.9, 0.5)) == 1


def test_edges_of_layers_and_cracks():
    mesh = with_cracks(grid(4, 2), np.array([(7, 6), (6, 1)]), 3)
    edges = mesh.edges()
    assert len(edge_rows(mesh, edges, "left")) == 2 and len(edge_rows(mesh, edges, "top")) == 4
    assert not edges.inner[edge_rows(mesh, edges, "bottom")].any()
    assert edges.inner[crack_rows(mesh, edges)].all() and mesh.crack_sets.tolist() == [3, 3]
    check(mesh)
    again = with_cracks(mesh, np.array([(6, 7), (7, 8)]), 5)
    assert dict(zip(map(tuple, again.cracks.tolist()), again.crack_sets.tolist())) == {(1, 6): 3, (6, 7): 3, (7, 8): 5}
    assert len(with_cracks(mesh, mesh.layers["left"], 1).cracks) == 2  # a rim cannot crack
    with pytest.raises(HpcdemError, match="no edges of a layer 'fault'"):
        edge_rows(mesh, edges, "fault")
    with pytest.raises(HpcdemError, match="no element has an edge between points 0 and 14"):
        with_cracks(mesh, np.array([(0, 14)]), 1)


SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
WRONG = {
    "no elements": (SQUARE, np.empty((0, 4)), {}, "there are no elements"),
    "nan": ([*SQUARE[:3], (0.0, np.nan)], [(0, 1, 2, 3)], {}, r"point 3 is not finite"),
    "unknown point": (SQUARE, [(0, 1, 2, 4)], {}, r"element 0 names .*\[0, 1, 2, 4\], .* numbered 0 to 3"),
    "no corner": (SQUARE, [(0, 1, -1, 3)], {}, r"element 0 names points"),
    "inverted": (SQUARE, [(0, 1, 2), (0, 3, 2)], {}, r"element 1 at \(0, 0\) .* runs clockwise"),
    "inverted quad": (SQUARE, [(3, 2, 1, 0)], {}, "runs clockwise"),
    "flat": ([*SQUARE, (2.0, 0.0)], [(0, 1, 2, 3), (0, 1, 4, -1)], {}, "element 1 .* is flat"),
    "corner twice": (SQUARE, [(0, 1, 2, 3), (0, 1, 1, -1)], {}, "element 1 .* is flat"),
    "folded": (SQUARE, [(0, 1, 3, 2)], {}, "element 0 .* is folded or concave"),
    "concave": ([*SQUARE[:2], (0.2, 0.2), SQUARE[3]], [(0, 1, 2, 3)], {}, "is folded or concave"),
    "lost point": ([*SQUARE, (5.0, 5.0)], [(0, 1, 2, 3)], {}, r"point 4 at \(5, 5\) belongs to no element"),
    "points twice": (
        [*SQUARE, (1.0, 1e-12), (2.0, 0.0), (2.0, 1.0)],
        [(0, 1, 2, 3), (4, 5, 6, 2)],
        {},
        "points 1 and 4 coincide at .* merge",
    ),
    "element twice": (SQUARE, [(0, 1, 2, 3), (2, 3, 0, 1)], {}, "element 0 .* is a duplicate of element 1"),
    "three on an edge": (
        [(0, 0), (1, 0), (0, 1), (1, 1), (0.5, -1), (0.5, -2)],
        [(0, 1, 2), (0, 1, 3), (0, 4, 1), (5, 4, 0)],
        {},
        r"edge between points 0 and 1 at \(0, 0\) is used by more than two elements: 0, 1, 2",
    ),
    "same side": ([(0, 0), (1, 0), (0, 1), (1, 1)], [(0, 1, 2), (0, 1, 3)], {}, "element 0 .* same side .* element 1"),
    "group out": (SQUARE, [(0, 1, 2, 3)], {"groups": {"s": {"g": [1]}}}, "'g' of set 's' names .* outside 0 to 0"),
    "two groups": (
        SQUARE,
        [(0, 1, 2), (0, 2, 3)],
        {"groups": {"s": {"g": [0, 1], "h": [1]}}},
        "element 1 is in two groups of set 's'",
    ),
    "layer": (SQUARE, [(0, 1, 2, 3)], {"layers": {"a": [(0, 2)]}}, "layer 'a' has an edge between points 0 and 2"),
    "crack outside": (SQUARE, [(0, 1, 2, 3)], {"cracks": [(0, 1)]}, "a crack joins points 0 and 1"),
    "crack nowhere": (SQUARE, [(0, 1, 2, 3)], {"cracks": [(0, 2)]}, "a crack joins points 0 and 2"),
}  # fmt: skip


@each("name", WRONG)
def test_check_names_the_element_or_point(name):
    points, cells, more, message = WRONG[name]
    with pytest.raises(HpcdemError, match=message) as error:
        check(Mesh.of(points, cells, **more), "model.msh")
    assert str(error.value).startswith("model.msh: ")


def test_check_is_content_with_any_scale_and_place():
    mesh = grid(6, 4, "tri")
    for scale, shift in ((1e-7, 0.0), (1e7, 0.0), (1.0, 4e6)):
        check(Mesh.of(mesh.points * scale + shift, mesh.cells))


def test_linear_time():
    """A fan about one point is the worst case of any search through the elements of a point."""
    n = 100_000
    angle = np.linspace(0.0, 1.5, n + 1)
    points = np.concatenate([[(0.0, 0.0)], np.column_stack([np.cos(angle), np.sin(angle)])])
    k = np.arange(n)
    cells = np.column_stack([np.zeros(n, np.int64), k + 1, k + 2, np.full(n, -1)])
    edges = cn.edges_of(cells, len(points))
    assert len(edges) == 2 * n + 1
    partner = cn.face_partners(cells, len(points))
    assert len(cn.corner_clusters(cells, partner, np.zeros(4 * n, bool))[1]) == n + 2
    assert [len(loop) for loop in cn.boundary_loops(cells, partner)] == [n + 2]

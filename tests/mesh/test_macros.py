"""Macro-elements in the mesh: what their parts have in common, in the plane (six-node triangles) and in space."""

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.physics.fdem.mesh import Mesh, check
from hpcdem.pre.mesh import cracks
from hpcdem.pre.mesh.fractures import Fractures
from hpcdem.pre.mesh.geometry import polyline
from hpcdem.pre.mesh.quadratic import quadratic
from hpcdem.pre.mesh.remade import without
from hpcdem.pre.mesh.solids import Plane
from hpcdem.pre.mesh.structured_space import hexes
from tests.blocks.support import rectangle


@pytest.fixture(params=["six nodes", "hexahedra"])
def mesh(request):
    if request.param == "hexahedra":
        return hexes([np.linspace(0.0, 1.0, 3)] * 3)
    return quadratic(rectangle(2, 2, 1.0, 1.0)).mesh


def test_parts_fill_the_whole_and_share_its_number(mesh):
    check(mesh)
    macro = mesh.macro
    assert (np.bincount(mesh.macro_of()) == macro.stored).all()
    assert mesh.areas().sum() == pytest.approx(1.0, rel=1e-14)
    first, of = macro.places(mesh.cells, mesh.macros)
    own = mesh.cells[macro.elements(mesh.macros)].reshape(len(mesh.macros), -1)
    assert (np.take_along_axis(own, first, axis=1) == mesh.macros[:, :-1]).all()
    real = own >= 0
    assert (np.take_along_axis(mesh.macros, of, axis=1)[real] == own[real]).all()


def test_faces_inside_are_those_between_two_parts_of_one(mesh):
    partner, of = mesh.face_partners(), mesh.macro_of()
    faces = np.flatnonzero(partner >= 0)
    same = of[faces // 4] == of[partner[faces] // 4]
    assert 0 < same.sum() < len(faces)
    assert (mesh.inside_macros(faces) == same).all()


def test_parts_of_one_have_one_centroid(mesh):
    middles = mesh.centroids().reshape(len(mesh.macros), mesh.macro.stored, -1)
    corners = mesh.points[mesh.macros[:, : mesh.macro.shape]]
    assert (middles == corners.mean(axis=1)[:, None]).all()


def test_what_loses_a_part_is_gone(mesh):
    left = without(mesh, np.array([1]))
    assert len(left.mesh.macros) == len(mesh.macros) - 1
    assert (left.parent >= mesh.macro.stored).all()
    check(left.mesh)


def test_a_crack_through_one_is_refused(mesh):
    edges = mesh.edges()
    inner = edges.inner & mesh.inside_macros(edges.faces[:, 0])
    cracked = Mesh.of(mesh.points, mesh.cells, cracks=edges.points[inner][:1], macros=mesh.macros)
    with pytest.raises(HpcdemError, match=f"a crack through a {mesh.macro.name}"):
        check(cracked)


def test_layers_groups_and_cracks_of_triangles_stay_where_they_are():
    before = rectangle(2, 2, 1.0, 1.0)
    edges = before.edges()
    before = Mesh.of(
        before.points, before.cells, {"s": {"a": [0, 3]}}, {"all": edges.points[~edges.inner]},
        edges.points[edges.inner][:2], [0, 1],
    )  # fmt: skip
    mesh = quadratic(before).mesh
    check(mesh)
    assert mesh.groups["s"]["a"].tolist() == [0, 1, 2, 3, 12, 13, 14, 15]
    found = mesh.edges()
    rows = mesh.find_edges(found, mesh.layers["all"])
    assert sorted(rows) == np.flatnonzero(~found.inner).tolist()
    ends = mesh.points[mesh.cracks]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(
        np.linalg.norm(np.diff(before.points[before.cracks], axis=1), axis=2).sum()
    )
    assert len(mesh.crack_sets) == 4
    with pytest.raises(CommandError, match="already has six-node triangles"):
        quadratic(mesh)
    with pytest.raises(CommandError, match="mesh of triangles only"):
        quadratic(rectangle(1, 1, 1.0, 1.0, kind="quad"))


def test_cracks_on_a_line_keep_to_the_sides_of_macros():
    """y = 1/4 runs along edges inside the six-node triangles of squares of 1/2, y = 1/2 along their sides."""
    mesh = quadratic(rectangle(2, 2, 1.0, 1.0)).mesh
    assert len(cracks.edges_on(mesh, [polyline([(0.0, 0.25), (1.0, 0.25)])])) == 0
    assert len(cracks.edges_on(mesh, [polyline([(0.0, 0.5), (1.0, 0.5)])])) == 4
    line = Fractures(np.array([[[0.0, 0.25], [1.0, 0.25]]]), np.array([1]))
    cracked = cracks.follow(mesh, line)
    rows = mesh.find_edges(edges := mesh.edges(), cracked.cracks)
    assert len(rows) and not mesh.inside_macros(edges.faces[rows, 0]).any()
    check(cracked)


def test_faces_on_a_plane_are_sides_of_hexahedra():
    """The diagonal plane of a cube runs along faces between the tetrahedra that store it, and none of its sides."""
    mesh = hexes([np.linspace(0.0, 1.0, 2)] * 3)
    inner = mesh.edges()
    at = mesh.points[inner.points[inner.inner]]
    plane = next(Plane(tuple(a), tuple(np.cross(b - a, c - a))) for a, b, c in at)
    assert len(cracks.faces_on(mesh, [plane])) == 0

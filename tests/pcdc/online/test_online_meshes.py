"""Meshes in the words of the online commands: the same as in hpcdem's own, and what is new in them."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import ScriptError
from hpcdem.physics.fdem.mesh import Mesh, check
from tests.pcdc.test_excavation import Desk
from tests.tables import each


@pytest.fixture
def desk(tmp_path) -> Desk:
    return Desk(tmp_path)


def mesh_of(tmp_path, text: str) -> Mesh:
    mesh = Desk(tmp_path)(text).project.mesh
    check(mesh)
    return mesh


def same(one: Mesh, other: Mesh) -> None:
    assert (one.points == other.points).all() and (one.cells == other.cells).all()
    assert (one.hexes == other.hexes).all()
    for name, rows in other.layers.items():
        assert (one.layers[name] == rows).all(), name
    assert {s: {n: r.tolist() for n, r in of.items()} for s, of in one.groups.items()} == {
        s: {n: r.tolist() for n, r in of.items()} for s, of in other.groups.items()
    }


BRICKS = [
    ("", "p0 (0.1,-0.3) p1 (2.7,-0.3) p2 (0.1,1.1) n 7 5 triangle off", "(0.1,-0.3) (2.7,1.1) cells 7 5 type quad"),
    ("", "p0 (0.1,-0.3) p1 (2.7,-0.3) p2 (0.1,1.1) n 7 5 r 1.1 0.7 group 'r' set 'd'",
     "(0.1,-0.3) (2.7,1.1) cells 7 5 ratio 1.1 0.7 group 'r' set 'd'"),
    (" dim 3", "p0 (0,0,-0.1) p1 (2,0,-0.1) p2 (0,3,-0.1) p3 (0,0,0.7) n 2 3 2 tri off r 1 1.2 1",
     "(0,0,-0.1) (2,3,0.7) cells 2 3 2 type hex ratio 1 1.2 1"),
    (" dim 3", "p0 (0,0,-0.1) p1 (2,0,-0.1) p2 (0,3,-0.1) p3 (0,0,0.7) n 2 3 2 tetra on",
     "(0,0,-0.1) (2,3,0.7) cells 2 3 2"),
]  # fmt: skip


@pytest.mark.parametrize(("dim", "vendor", "own"), BRICKS)
def test_a_brick_along_the_axes_is_a_structured_mesh(tmp_path, dim, vendor, own):
    one, other = (
        mesh_of(tmp_path, f"pcdc model new{dim}\npcdc {words}\n")
        for words in (f"element create brick {vendor}", f"mesh structured {own}")
    )
    same(one, other)


@pytest.mark.parametrize("p1_p2", ["p1 (6,1) p2 (2,5)", "p1 (2,5) p2 (6,1)"])
def test_a_skew_brick(tmp_path, p1_p2):
    mesh = mesh_of(tmp_path, f"pcdc element create brick p0 (1,1) {p1_p2} n 4 4 triangle off\n")
    # parallelogram of the edges (5, 0) and (1, 4)
    assert mesh.areas().sum() == pytest.approx(20.0) and mesh.areas() == pytest.approx(np.full(16, 1.25))
    for x, y in ((1, 1), (6, 1), (2, 5), (7, 5)):
        assert (np.hypot(*(mesh.points - (x, y)).T) < 1e-12).any()


def test_a_skew_brick_in_space(tmp_path):
    line = "pcdc element create brick p0 (0,0,0) p1 (2,0,0) p2 (1,2,0) p3 (0,1,3) n 2 2 3 tri [b] ratio 1 1 1.5\n"
    for b in (True, False):
        mesh = mesh_of(tmp_path, f"b = {b}\npcdc model new dim 3\n" + line)
        assert mesh.areas().sum() == pytest.approx(12.0)
        assert len(mesh.hexes) == (0 if b else 12)


RIM = "pcdc geometry create polygon (0,0) (6,0) (6,4) (0,4) as-layer 'rim'\n"
LINE = "pcdc geometry create polyline (-1,2) (3,2.5) (7,2) as-layer 'bed'\n"


def test_geometry_with_one_size_is_mesh_create(tmp_path):
    shapes = RIM + "pcdc geometry create polyline (1,2) (3,2.5) (5,2) as-layer 'bed'\n"
    one = mesh_of(tmp_path, shapes + "pcdc element create geometry layer 'rim' m-s 0.7 is-b layer 'bed' m-s 0.7\n")
    other = mesh_of(tmp_path, shapes + "pcdc mesh create from-layer 'rim' size 0.7 embed 'bed'\n")
    same(one, other)


def lengths(mesh: Mesh, pairs: np.ndarray) -> np.ndarray:
    return np.hypot(*(mesh.points[pairs[:, 1]] - mesh.points[pairs[:, 0]]).T)


def test_sizes_of_pieces_and_lines_that_are_cut_off(tmp_path):
    mesh = mesh_of(tmp_path, RIM + LINE + "pcdc element create geometry layer 'rim' mesh-size 0.8 layer 'bed' m-s 0.2 "
                   "circle center (1.5,1) radius 0.5 m-s 0.1\n")  # fmt: skip
    assert mesh.areas().sum() == pytest.approx(24.0)  # the circle is filled, the rim the first piece
    assert set(mesh.layers) == {"rim", "bed"}
    bed = lengths(mesh, mesh.layers["bed"])
    assert bed.sum() == pytest.approx(2 * np.hypot(3.0, 0.375)) and bed.max() <= 0.21 < 2.0 * bed.min()
    from_centre = np.hypot(*(mesh.points - (1.5, 1.0)).T)
    around = np.abs(from_centre - 0.5) < 1e-9
    assert around.sum() >= np.pi / 0.1  # points of the circle, no further apart than its size
    far = mesh.edges().points
    far = far[(np.hypot(*(mesh.points[far].mean(axis=1) - (5.5, 0.3)).T) < 0.6)]
    assert lengths(mesh, far).mean() > 0.4


def test_a_boundary_of_several_lines_an_arc_among_them(tmp_path):
    mesh = mesh_of(
        tmp_path,
        """
pcdc geometry create polyline (-1,0) (1,0) as-layer 'floor'
pcdc geometry create polyline (1,0) (1,1) (-1,1) (-1,0) as-layer 'rest'
pcdc element create geometry layer 'floor' 'rest' m-s 0.3 arc center (0,0) start-point (0.5,0) end-point (-0.5,0) \\
m-s 0.1
""",
    )
    assert mesh.areas().sum() == pytest.approx(2.0)
    assert lengths(mesh, mesh.layers["floor"]).sum() == pytest.approx(2.0)
    assert (np.abs(np.hypot(*mesh.points.T) - 0.5) < 1e-9).sum() >= 16


def test_a_patch_with_points_and_the_size_of_the_rest(tmp_path):
    mesh = mesh_of(tmp_path, RIM + LINE + "pcdc element create geometry-patch b-c-p layer 'rim' m-s 0.5 c-polyline "
                   "array (2,1) (4,1) m-s 0.2 c-point array (1,3) (9,9) m-s 0.15 g-m-s 0.9 tol 1e-3\n")  # fmt: skip
    assert (np.hypot(*(mesh.points - (1.0, 3.0)).T) < 1e-12).sum() == 1
    assert mesh.points.max() <= 6.0
    assert lengths(mesh, mesh.layers["rim"]).max() <= 0.5 + 1e-9
    on = np.abs(mesh.points[:, 1] - 1.0) < 1e-9
    assert ((mesh.points[on, 0] >= 2.0) & (mesh.points[on, 0] <= 4.0)).sum() >= 11


def test_a_patch_joins_points_within_its_tolerance(tmp_path):
    text = "pcdc element create geometry-patch b-c-p array (0,0) (4,0) (4.0004,0.0002) (4,3) (0,3) m-s 1 tolerance {}\n"
    assert mesh_of(tmp_path, text.format(1e-3)).areas().sum() == pytest.approx(12.0, rel=1e-12)
    assert mesh_of(tmp_path, text.format(1e-6)).areas().sum() > 12.0 + 1e-4


def test_inner_boundaries_are_holes_or_filled(tmp_path):
    mesh = mesh_of(
        tmp_path,
        """
outer = [(0,0), (6,0), (6,4), (0,4)]
pcdc element create geometry-boundary boundary [outer] m-s 1 inner-boundary (1,1) (2,1) (2,2) (1,2) m-s 0.25 ...
inner-boundary (4,1) (5,1) (5,3) (4,3) m-s 0.5 filled on
""".replace("...\n", "\\\n"),
    )
    assert mesh.areas().sum() == pytest.approx(23.0)  # 24 without the first one
    inside = np.all(np.abs(mesh.centroids() - (4.5, 2.0)) < (0.5, 1.0), axis=1)
    assert mesh.areas()[inside].sum() == pytest.approx(2.0)  # edges follow the second one


def test_a_hollow_circle(tmp_path):
    mesh = mesh_of(tmp_path, "pcdc element create h-cir c (1,2) r 4 m-s 0.8 i-r 1 m-s 0.2\n")
    radius = np.hypot(*(mesh.points - (1.0, 2.0)).T)
    assert radius.min() > 1.0 - 1e-9 and radius.max() < 4.0 + 1e-9
    assert (radius < 1.0 + 1e-9).sum() >= 2 * np.pi / 0.2 and (radius > 4.0 - 1e-9).sum() >= 2 * np.pi * 4 / 0.8
    area = mesh.areas().sum()
    assert 0.98 * np.pi * 15 < area < np.pi * 15


HOSTILE = [
    ("element create brick p0 (0,0) p1 (2,0) p2 (4,0) n 2 2", "span no area"),
    ("element create brick p0 (0,0) p1 (2,0) p2 (0,0) n 2 2", "span no area"),
    ("element create brick p0 (0,0) p1 (2,0) p2 (0,1) n 2", "a whole number above 0 for 'n' is expected"),
    ("element create brick p0 (0,0) p1 (2,0) p2 (0,1) n 0 2", "expected a whole number above 0"),
    ("element create brick p0 (0,0) p1 (2,0) p2 (0,1) n 2 2 ratio 0 1", "expected a number above 0"),
    ("element create brick p0 (0,0) p1 (2,0) n 2 2", "lacks p2"),
    ("element create brick p0 (0,0) p1 (2,0) p2 (0,1) n 100000 100000", "at most 2e\\+07"),
    ("element create brick p0 (0,0) p1 (2,0) p2 (0,1) n 99 9 ratio 1e40 1", "differ too much in size"),
    ("element create geometry layer 'rim'", "mesh-size is missing"),
    ("element create geometry layer 'nothing' m-s 1", "there is no geometry layer 'nothing'"),
    ("element create geometry layer 'bed' m-s 1", "layer 'bed' cannot bound a region"),
    ("element create geometry layer 'rim' m-s 1 circle center (0,0) m-s 1", "lacks r{adius}"),
    ("element create geometry layer 'rim' m-s 1 arc center (0,0) start-point (1,0) end-point (0,2)",
     "1 and 2 m away from its centre"),
    ("element create geometry layer 'rim' m-s 1e-6", "at most"),
    ("element create geometry-patch b-c-p m-s 1", "needs array, points, or layer"),
    ("element create geometry-patch c-polyline layer 'bed' m-s 1", "lacks b{oundary}-c{lose}-p{olyline}"),
    ("element create geometry-boundary boundary (0,0) (1,0) m-s 1", "2 points given, at least 3 needed"),
    ("element create geometry-boundary boundary (0,0) (2,2) (2,0) (0,2) m-s 1", "cross or touch"),
    ("element create hollow-circle c (0,0) r 1 m-s 0.2 i-r 2", "inner-radius is below radius"),
]  # fmt: skip


@each(("line", "message"), HOSTILE)
def test_what_is_refused(desk, line, message):
    with pytest.raises(ScriptError, match=message):
        desk(RIM + LINE + f"pcdc {line}\n")


def test_not_in_space(desk):
    with pytest.raises(ScriptError, match="'element create geometry' is for two dimensions"):
        desk("pcdc model new dim 3\npcdc element create geometry layer 'rim' m-s 1\n")

"""Bodies and surfaces in space: what is inside, what lies on them, meshes of them, files of other programs."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.physics.fdem.mesh import Mesh, check
from hpcdem.pre.mesh import cad, fill, solids
from hpcdem.pre.mesh.solids import made, on_surface

L_SHAPE = ((0, 0, 0), (2, 0, 0), (2, 0, 1), (1, 0, 1), (1, 0, 2), (0, 0, 2))
"""In the plane of x and z, area 3."""
BODIES = [
    (("box", (0, 0, 0), (1, 2, 3)), 6.0, 1e-12),
    (("sphere", (1, 2, 3), 2.0), 32.0 / 3.0 * math.pi, 0.05),
    (("cylinder", (0, 0, 0), (1, 2, 2), 1.0), 3.0 * math.pi, 0.05),
    (("cone", (0, 0, 0), (0, 3, 0), 2.0, 1.0), 7.0 * math.pi, 0.05),
    (("cone", (0, 0, 0), (2, 0, 1), 1.0, 0.0), math.sqrt(5.0) / 3.0 * math.pi, 0.05),
    (("extrude", L_SHAPE, (0, 2, 0)), 6.0, 1e-12),
    (("extrude", L_SHAPE, (0.5, 2, 1)), 6.0, 1e-12),
    # Pappus: the area times the way of its centre, sum of two squares: (2 x 1 at x 1) + (1 x 1 at x 0.5).
    (("revolve", L_SHAPE, (0, 0, 0), (0, 0, 1), 360.0), 2.0 * math.pi * 2.5, 0.05),
    (("revolve", L_SHAPE, (-1, 0, 0), (0, 0, 1), 90.0), 0.5 * math.pi * 5.5, 0.05),
    (("revolve", L_SHAPE, (0, 0, 0), (0, 0, 2), 270.0), 1.5 * math.pi * 2.5, 0.05),
]
NAMES = ["-".join(map(str, (k, *one[0][:1]))) for k, one in enumerate(BODIES)]


@pytest.mark.parametrize(("given", "volume", "_"), BODIES, ids=NAMES)
def test_the_inside_has_the_volume_of_the_closed_form(given: tuple, volume: float, _: float) -> None:
    """By a lattice of points in its bounds, which it comes near to on all sides."""
    body = made(*given)
    low, high = body.bounds()
    n = 60
    at = np.stack(np.meshgrid(*(a + (b - a) * (np.arange(n) + 0.5) / n for a, b in zip(low, high)), indexing="ij"), -1)
    inside = body.distance(at.reshape(-1, 3)) < 0.0
    assert inside.mean() * np.prod(high - low) == pytest.approx(volume, rel=0.01)
    if given[0] != "revolve":
        for axis in range(3):
            along = at.reshape(-1, 3)[inside, axis]
            assert min(along.min() - low[axis], high[axis] - along.max()) > 0.0
            assert max(along.min() - low[axis], high[axis] - along.max()) < 0.1 * (high - low)[axis]


@pytest.mark.parametrize(("given", "volume", "error"), BODIES, ids=NAMES)
def test_a_mesh_fills_it_and_its_faces_lie_on_it(given: tuple, volume: float, error: float, gmsh: object) -> None:
    body = made(*given)
    found = fill.filled(fill.MeshSettings([body], 0.25 if given[-1] == 0.0 else 0.5), "rock")
    mesh = Mesh.of(found.points, found.cells)
    check(mesh)
    assert mesh.areas().sum() == pytest.approx(volume, rel=max(error, 1e-9))
    edges = mesh.edges()
    free = mesh.points[edges.points[~edges.inner]]
    assert on_surface(body, free, 1e-6).all()
    # An inner face with its three corners on one curved part counts as well.
    assert on_surface(body, mesh.points[edges.points[edges.inner]], 1e-6).mean() <= (0.02 if error > 0.01 else 0.0)
    assert (body.distance(mesh.centroids()) < 1e-9).all()
    assert np.abs(body.distance(free.reshape(-1, 3))).max() < 1e-6


@pytest.mark.parametrize("given", [one for one, _, _ in BODIES], ids=NAMES)
def test_distances_to_a_body_differ_by_no_more_than_the_points(given: tuple) -> None:
    """|d(a) - d(b)| <= |a - b|, and the sign changes at the surface only."""
    body = made(*given)
    low, high = body.bounds()
    rng = np.random.default_rng(3)
    a = low - 0.5 + (high - low + 1.0) * rng.random((4000, 3))
    b = a + rng.normal(size=a.shape) * 0.05
    apart = np.linalg.norm(a - b, axis=1)
    da, db = body.distance(a), body.distance(b)
    assert (np.abs(da - db) <= apart * (1.0 + 1e-9) + 1e-12).all()


def test_bodies_come_back_from_a_checkpoint_as_they_were() -> None:
    surfaces = [made("polygon", L_SHAPE), made("disc", (0, 1, 2), (1, 1, 0), 2.0), made("plane", (0, 1, 2), (1, 1, 0))]
    every = [made(*given) for given, _, _ in BODIES] + surfaces + [cube()]
    assert solids.restored(json.loads(json.dumps(solids.state(every)))) == every


def test_surfaces_are_flat() -> None:
    at = np.array([[0.5, 0.0, 0.5], [1.5, 0.0, 1.5], [0.5, 0.3, 0.5], [3.0, 0.0, 0.5]])
    assert made("polygon", L_SHAPE).distance(at) == pytest.approx([0.0, 0.5, 0.3, 1.0])
    assert made("disc", (0.5, 0, 0.5), (0, 3, 0), 1.0).distance(at) == pytest.approx([0, math.sqrt(2) - 1, 0.3, 1.5])
    assert made("plane", (0, 0, 0), (0, 2, 0)).distance(at) == pytest.approx([0, 0, 0.3, 0])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("cone", (0, 0, 0), (0, 0, 1), 1.0, 1.0), "two radii that differ"),
        (("polygon", ((0, 0, 0), (1, 0, 0))), "three corners, got 2"),
        (("polygon", ((0, 0, 0), (1, 0, 0), (2, 0, 0))), "on one line"),
        (("polygon", ((0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0))), "in one plane"),
        (("extrude", L_SHAPE, (1, 0, 1)), "must not lie in the plane"),
        (("revolve", L_SHAPE, (0, 0, 0), (0, 1, 0), 360.0), "must lie in the plane"),
        (("revolve", L_SHAPE, (1, 0, 0), (0, 0, 1), 360.0), "must not cross"),
        (("revolve", L_SHAPE, (0, 0, 0), (0, 0, 1), 400.0), "from 0 to 360"),
        (("disc", (0, 0, 0), (0, 0, 0), 1.0), "normal"),
        (("plane", (0, 0, 0), (0, 0, 0)), "normal"),
    ],
)
def test_what_has_no_volume_or_area_is_refused(given: tuple, said: str) -> None:
    with pytest.raises(CommandError, match=said):
        made(*given)


# --- files --------------------------------------------------------------------------------------------------------

CORNERS = [(x, y, z) for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)]
SIDES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
CUBE = [tuple(CORNERS[k] for k in part) for a, b, c, d in SIDES for part in ((a, b, c), (a, c, d))]
"""Triangles, outwards; files need not keep to that."""


def cube() -> solids.Shell:
    return made("shell", tuple(corner for triangle in CUBE for corner in triangle))


def stl(path: Path, triangles: list) -> Path:
    rows = ["solid rock"]
    for triangle in triangles:
        rows += ["facet normal 0 0 0", "outer loop", *(f"vertex {x} {y} {z}" for x, y, z in triangle), "endloop"]
        rows.append("endfacet")
    path.write_text("\n".join([*rows, "endsolid rock", ""]))
    return path


def test_a_shell_of_triangles_becomes_a_body(tmp_path: Path, gmsh: object) -> None:
    pytest.importorskip("meshio")
    (body,) = cad.read(stl(tmp_path / "cube.stl", [t[::-1] if k % 3 == 0 else t for k, t in enumerate(CUBE)]))
    at = np.array([[0.5, 0.5, 0.5], [0.5, 0.5, 1.25], [2.0, 2.0, 0.5], [0.5, 0.9, 0.5]])
    assert body.distance(at) == pytest.approx([-0.5, 0.25, math.sqrt(2), -0.1])
    found = fill.filled(fill.MeshSettings([body], 0.4, holes=[made("sphere", (0.5, 0.5, 0.5), 0.3)]), "rock")
    mesh = Mesh.of(found.points, found.cells)
    check(mesh)
    assert mesh.areas().sum() == pytest.approx(1.0 - 0.036 * math.pi, rel=0.06)


def binary(triangles: list, head: bytes = b"solid by some program", more: bytes = b"") -> bytes:
    """A binary STL file."""
    table = np.zeros(len(triangles), [("normal", "<f4", (3,)), ("at", "<f4", (3, 3)), ("more", "<u2")])
    table["at"] = triangles
    return head.ljust(80) + len(triangles).to_bytes(4, "little") + table.tobytes() + more


def test_binary_shells_with_bytes_at_their_end_in_millimetres(tmp_path: Path) -> None:
    """The head of a binary file may begin as text does."""
    path, notes = tmp_path / "cube.stl", []
    for more in (b"", b"\0" * 50, b"facet"):
        path.write_bytes(binary(CUBE, more=more))
        (body,) = cad.read(path, scale=1e-3, notes=notes)
        np.testing.assert_allclose(body.bounds(), [[0, 0, 0], [1e-3] * 3], atol=1e-12)
    assert notes[1] == notes[0] == "files *.stl define no unit: 1 unit = 0.001 m, set by scale"
    assert notes[2] == "ignored 50 bytes after the last triangle" and notes[4].startswith("ignored 5 bytes")
    path.write_bytes(binary(CUBE)[:-60])
    with pytest.raises(HpcdemError, match=r"cube\.stl: .*its header declares 12 triangles, it has 10"):
        cad.read(path)
    text = stl(path, CUBE).read_text()
    path.write_text(text.upper() + "\n  made by some program \0\0 vertex \n")
    assert len(cad.read(path)[0].triangles()) == 12
    path.write_text(text[: len(text) // 2])
    with pytest.raises(HpcdemError, match=r"cube\.stl: .* a facet is damaged, or the end is missing"):
        cad.read(path)


def test_faces_of_a_drawing_become_a_body(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new()
    for side in SIDES:
        drawing.modelspace().add_3dface([CORNERS[k] for k in side], dxfattribs={"layer": "ore"})
    drawing.modelspace().add_3dface([(5, 5, 5), (6, 5, 5), (6, 6, 5)], dxfattribs={"layer": "else"})
    drawing.saveas(tmp_path / "ore.dxf")
    (body,) = cad.read(tmp_path / "ore.dxf", "ore")
    assert len(body.triangles()) == 12 and body.distance(np.array([[0.5, 0.5, 0.25]])) == pytest.approx([-0.25])
    with pytest.raises(HpcdemError, match=r"ore\.dxf: the shell is not closed"):
        cad.read(tmp_path / "ore.dxf")
    whole = drawing.blocks.new("ore")
    for side in SIDES:
        whole.add_3dface([CORNERS[k] for k in side])
    drawing.header["$INSUNITS"] = 5
    drawing.modelspace().add_blockref("ore", (10, 0, 0), dxfattribs={"xscale": -1, "layer": "mirrored"})
    drawing.saveas(tmp_path / "ore.dxf")
    (body,) = cad.read(tmp_path / "ore.dxf", "mirrored")
    np.testing.assert_allclose(body.bounds(), [[0.09, 0, 0], [0.1, 0.01, 0.01]], atol=1e-9)
    with pytest.raises(HpcdemError, match=r"layer 'gold' has no 3DFACE .layers with some: 'else', 'mirrored', 'ore'"):
        cad.read(tmp_path / "ore.dxf", "gold")


PARTS = """
import gmsh, sys
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
box, tube = occ.addBox(0, 0, 0, 2, 1, 1), occ.addCylinder(2, 0.5, 0.5, 1, 0, 0, 0.4)
occ.fragment([(3, box)], [(3, tube)])
occ.synchronize()
gmsh.write(sys.argv[1])
gmsh.model.add("flat")
occ.addRectangle(0, 0, 0, 1, 1)
occ.synchronize()
gmsh.write(sys.argv[2])
"""


@pytest.mark.slow
def test_solids_of_a_cad_file_hang_together_and_are_groups(tmp_path: Path, gmsh: object) -> None:
    subprocess.run([sys.executable, "-c", PARTS, tmp_path / "parts.brep", tmp_path / "flat.brep"], check=True)
    (small, _), (one, other) = cad.read(tmp_path / "parts.brep", scale=1e-3), cad.read(tmp_path / "parts.brep")
    np.testing.assert_allclose(small.bounds(), 1e-3 * one.bounds(), atol=1e-9)
    found = fill.filled(fill.MeshSettings([one, other], 0.3, regions=[("one", [one]), ("other", [other])]), "rest")
    mesh = Mesh.of(found.points, found.cells)
    check(mesh)
    volumes = [mesh.areas()[found.groups[name]].sum() for name in ("one", "other")]
    assert volumes == pytest.approx([2.0, 0.16 * math.pi], rel=0.07) and "rest" not in found.groups
    inside = np.flatnonzero(one.distance(mesh.centroids()) < 0.0)
    assert (inside == found.groups["one"]).all()
    edges = mesh.edges()
    between = np.isin(edges.faces[edges.inner] // 4, found.groups["one"]).sum(axis=1) == 1
    assert mesh.face_sizes(edges.faces[edges.inner, 0][between]).sum() == pytest.approx(0.16 * math.pi, rel=0.1)
    with pytest.raises(HpcdemError, match=r"flat\.brep: contains no readable solid: it has surfaces or lines"):
        cad.read(tmp_path / "flat.brep")


@pytest.mark.some_of_each
@pytest.mark.parametrize("name", ["rock.step", "rock.brep", "rock.stl", "rock.dxf"])
@pytest.mark.parametrize("content", [b"", b"solid nothing", bytes(range(256)) * 8])
def test_hostile_files_are_refused_by_name(tmp_path: Path, name: str, content: bytes, gmsh: object) -> None:
    for package in ("meshio", "ezdxf"):
        pytest.importorskip(package)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(HpcdemError, match=name):
        cad.read(tmp_path / name)


@pytest.mark.parametrize(
    ("triangles", "said"),
    [
        (CUBE[:-1], "the shell is not closed"),
        ([*CUBE, *(tuple((x + 3.0, y, z) for x, y, z in t) for t in CUBE)], "make 2 shells, expected one"),
        ([*CUBE, ((0, 0, 0), (0, 0, float("nan")), (1, 0, 0))], "not finite"),
        ([((0, 0, 0), (0, 0, 0), (0, 0, 0))], "coincide"),
    ],
)
def test_shells_that_are_none_are_refused(tmp_path: Path, triangles: list, said: str) -> None:
    pytest.importorskip("meshio")
    with pytest.raises(HpcdemError, match=rf"cube\.stl: .*{said}"):
        cad.read(stl(tmp_path / "cube.stl", triangles))
    with pytest.raises(CommandError, match=r"rock\.obj: bodies are read from files"):
        cad.read(stl(tmp_path / "rock.obj", CUBE))

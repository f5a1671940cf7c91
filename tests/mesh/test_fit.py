"""Meshes whose faces lie on each other and do not hang together: what is told, and what `mesh glue` makes of them."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.fdem import Project, meshes
from hpcdem.commands.fdem.project import joined
from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem.connectivity import bodies
from hpcdem.physics.fdem.mesh import Mesh, check
from hpcdem.pre.mesh import fit, glue, structured, structured_space
from tests.pcdc.fake import FakeBlocks

NAME = ("s", "b")


def lines(*ends: tuple[float, float, int]) -> tuple[np.ndarray, ...]:
    return tuple(np.linspace(a, b, n + 1) for a, b, n in ends)


def block(z0: float, z1: float, nx: int, ny: int, kind: int | str = 6, nz: int = 1, name: str = "a") -> Mesh:
    """A block of the unit square from z0 to z1: hexahedra, or tetrahedra that split boxes into so many."""
    grid = lines((0, 1, nx), (0, 1, ny), (z0, z1, nz))
    return structured_space.hexes(grid, ("s", name)) if kind == "hex" else structured_space.box(grid, kind, ("s", name))


def plate(y0: float, y1: float, nx: int, kind: str = "tri", x0: float = 0.0, x1: float = 1.0, name: str = "a") -> Mesh:
    """The same in the plane."""
    return structured.rectangle(*lines((x0, x1, nx), (y0, y1, 1)), kind, "right", ("s", name))


def one_numbering(mesh: Mesh) -> Mesh:
    """The same mesh in which points in one place are one, as a file may have it."""
    _, first, number = np.unique(np.round(mesh.points, 9), axis=0, return_index=True, return_inverse=True)
    number = number.reshape(-1)
    if mesh.dim == 2:
        return Mesh.of(mesh.points[first], np.where(mesh.cells >= 0, number[mesh.cells], -1))
    n = len(mesh.hexes)
    return Mesh.of_hexes(mesh.points[first], number[mesh.hexes[:, :8]], more=number[mesh.cells[6 * n :]])


HALVES = {
    "whole": (block(0, 1, 2, 2), block(1, 2, 2, 2), (0, 0, 0)),
    "halves of the plane": (plate(0, 1, 3), plate(1 + 1e-7, 2, 3, "quad"), (3, 0, 0)),
    "halves": (block(0, 1, 2, 2), block(1 + 1e-7, 2, 2, 2), (8, 0, 0)),
    "hanging, in the plane": (plate(0, 1, 3, "quad"), plate(1, 2, 2), (0, 0, 4)),
    "hanging": (block(0, 1, 1, 1), block(1, 2, 2, 2), (0, 0, 8)),
    "a hexahedron on tetrahedra": (block(0, 1, 2, 2, "hex"), block(1, 2, 2, 2, 5), (4, 4 / 2, 0)),
}


@pytest.mark.parametrize("name", HALVES)
def test_what_does_not_fit_is_counted_with_places(name: str) -> None:
    one, other, (own, cut, parts) = HALVES[name]
    both = joined(one, other)
    found = fit.fit(one_numbering(both) if name == "whole" else both)
    assert found.bodies == (1 if name == "whole" else 2)
    assert (len(found.own), len(found.cut), len(found.parts)) == (own, cut, parts)
    assert all(np.allclose(at[:, -1], 1.0, atol=1e-6) for at in (found.own, found.cut, found.parts))
    assert ("mesh glue" in found.description()) == (name != "whole")


GLUED = [
    *((below, above, ((2, 2), (2, 2))) for below in (5, 6, "hex") for above in (5, 6, 12, "hex")),
    (6, 6, ((2, 2), (4, 4))), ("hex", 6, ((1, 2), (3, 2))), (5, "hex", ((3, 2), (2, 3))), (12, 5, ((3, 2), (2, 3))),
]  # fmt: skip
"""Kind below and above, and cells of each."""


@pytest.mark.parametrize(("below", "above", "cells"), GLUED)
def test_blocks_of_all_kinds_are_glued(below: int | str, above: int | str, cells: tuple) -> None:
    """Same and other diagonals, hanging points, sizes that divide each other and that do not."""
    one, other = block(0, 1, *cells[0], below), block(1 + 1e-7, 2, *cells[1], above, 2, "b")
    made = glue.glued(joined(one, other))
    mesh = made.mesh
    check(mesh)
    found = fit.fit(mesh)
    assert found.bodies == 1 and found.description() == "" and mesh.areas().sum() == pytest.approx(2.0)
    edges = mesh.edges()
    whole = mesh.points[mesh.face_points(edges.faces[~edges.inner, 0])]
    for side in range(6):  # nothing is free but the sides of the whole, and they are covered
        at = np.abs(whole[:, :, side % 3] - ((0.0, 0.0, 0.0), (1.0, 1.0, 2.0))[side // 3][side % 3]).max(axis=1) < 1e-6
        assert mesh.face_sizes(edges.faces[~edges.inner, 0][at]).sum() == pytest.approx((2, 2, 1)[side % 3])
    sizes = {name: mesh.areas()[rows].sum() for name, rows in mesh.groups["s"].items()}
    assert sizes == pytest.approx({"a": 1.0, "b": 1.0})
    for name in ("left", "top"):
        rows = mesh.find_edges(edges, mesh.layers[name])
        assert mesh.face_sizes(edges.faces[rows, 0]).sum() == pytest.approx({"left": 2.0, "top": 2.0}[name], abs=1e-6)
    if cells[0] == cells[1] and "hex" in (below, above):
        assert made.cut == 0 and len(mesh.hexes) == len(one.hexes) + len(
            other.hexes
        )  # points change their numbers only


def test_what_cannot_be_glued_is_reported_with_its_position() -> None:
    small = structured_space.box(lines((0.25, 0.75, 1), (0.25, 0.75, 1), (1, 2, 1)), 6, NAME)
    found = glue.glued(joined(block(0, 1, 2, 2), small)).mesh  # faces that are covered in part are cut around it
    check(found)
    assert found.areas().sum() == pytest.approx(1.25) and bodies(found.face_partners()).max() == 0
    flat = block(0, 1, 2, 2), block(1, 2, 2, 2, 5)
    at = (0.5, 0.5, 1.0)  # in the middle of the seam
    bent = [Mesh.of(np.where((m.points == at).all(axis=1)[:, None], (0.5, 0.5, 1.1), m.points), m.cells) for m in flat]
    found = fit.fit(joined(*bent))
    assert len(found.cut) == 2 and len(found.own) == 4 and not len(found.parts)
    with pytest.raises(CommandError, match=r"are warped and cut along different diagonals: they cannot be glued"):
        glue.glued(joined(*bent))


@pytest.mark.parametrize("kind", [6, "hex"])
def test_seams_within_one_body(kind: int | str) -> None:
    """A base with two blocks on it, side by side: once both hang on the base the seam between them is in one body, with
    points of its own on either side, and finer on one."""

    def part(x: tuple, z: tuple, n: int, name: str) -> Mesh:
        grid = lines((*x, n), (0, 1, n), (*z, n))
        return (
            structured_space.hexes(grid, ("s", name))
            if kind == "hex"
            else structured_space.box(grid, kind, ("s", name))
        )

    mesh = joined(joined(part((0, 2), (0, 1), 2, "a"), part((0, 1), (1, 2), 1, "b")), part((1, 2), (1, 2), 2, "c"))
    for pair in ("ac", "ab"):
        sides = [np.isin(np.arange(len(mesh.cells)), mesh.groups["s"][name]) for name in pair]
        mesh = glue.glued(mesh, between=(sides[0], sides[1])).mesh
    assert fit.fit(mesh).bodies == 1 and len(fit.fit(mesh).parts)
    mesh = glue.glued(mesh).mesh
    check(mesh)
    assert fit.fit(mesh).description() == "" and mesh.areas().sum() == pytest.approx(4.0)


def test_a_whole_stays_as_it_is() -> None:
    mesh = block(0, 1, 2, 2)
    assert glue.glued(mesh).mesh is mesh


def test_groups_and_histories_follow_their_faces() -> None:
    """Of a coarse block below a fine one: what named the top of the coarse one names its pieces, on its side."""
    project = Project(FakeBlocks(), ".", "data")
    project.clear(3)
    project.add_mesh(block(0, 1, 1, 1))
    project.add_mesh(block(1, 2, 2, 2, 6, 1, "b"))
    mesh = project.mesh
    free = fit.free_faces(mesh)
    seam = (np.abs(free.at[:, :, 2] - 1.0) < 1e-9).all(axis=1)
    lower = seam & (free.faces // 4 < 6)
    project.groups["element-face"].assign(free.faces[lower], "top of a", "f")
    project.groups["element-face"].assign(free.faces[seam & ~lower], "bottom of b", "f")
    project.groups["face-joint"].assign(free.faces[lower], "seam", "j")
    project.groups["node"].assign(np.flatnonzero(np.abs(mesh.points[:, 2] - 1.0) < 1e-9), "seam", "n")
    meshes.glue(project)
    mesh, groups = project.mesh, {kind: of.sets for kind, of in project.groups.items()}
    assert len(project.alive) == len(mesh.cells) == 6 + 24 + 8
    assert len(groups["node"]["n"]["seam"]) == 9 and len(groups["element"]["s"]["a"]) == 14
    faces = groups["element-face"]["f"]
    for name, of in (("top of a", "a"), ("bottom of b", "b")):
        assert len(faces[name]) == 8 and np.isin(faces[name] // 4, groups["element"]["s"][of]).all()
    np.testing.assert_array_equal(np.sort(mesh.face_partners()[faces["top of a"]]), faces["bottom of b"])
    joints = np.minimum(faces["top of a"], mesh.face_partners()[faces["top of a"]])
    np.testing.assert_array_equal(groups["face-joint"]["j"]["seam"], np.sort(joints))

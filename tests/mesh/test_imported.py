"""Meshes from files: what is taken over, and what is refused with file and element."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.physics.fdem.mesh import check
from hpcdem.pre.mesh.imported import import_mesh

HEAD = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
NAMES = '$PhysicalNames\n3\n1 7 "fault"\n2 1 "rock"\n2 2 "clay"\n$EndPhysicalNames\n'


def msh(nodes: list[tuple], elements: list[tuple], names: str = NAMES) -> str:
    """A file of gmsh, version 2.2. nodes: x y z; elements: type, physical group, points (from 1)."""
    lines = [HEAD + names + "$Nodes", str(len(nodes))]
    lines += [f"{i} {' '.join(map(repr, map(float, xyz)))}" for i, xyz in enumerate(nodes, 1)]
    lines += ["$EndNodes", "$Elements", str(len(elements))]
    lines += [f"{i} {kind} 2 {tag} 1 {' '.join(map(str, p))}" for i, (kind, tag, *p) in enumerate(elements, 1)]
    return "\n".join([*lines, "$EndElements", ""])


SQUARES = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0), (9, 9, 0)]
TWO = [(1, 7, 2, 5), (2, 1, 1, 2, 5), (2, 1, 1, 5, 4), (3, 2, 2, 5, 6, 3)]
"""A fault between two triangles of rock and a quad of clay that runs clockwise; point 7 is used by nothing."""


@pytest.fixture
def read(meshio, tmp_path):
    def reading(text: str, name: str = "m.msh", **how):
        (tmp_path / name).write_text(text)
        return import_mesh(tmp_path / name, **how)

    return reading


def test_gmsh(read):
    mesh = read(msh(SQUARES, TWO), scale=0.5)
    check(mesh)
    assert len(mesh.points) == 6 and len(mesh.cells) == 3
    np.testing.assert_allclose(mesh.areas(), [0.125, 0.125, 0.25])
    assert {g: rows.tolist() for g, rows in mesh.groups["physical"].items()} == {"rock": [0, 1], "clay": [2]}
    np.testing.assert_array_equal(mesh.points[mesh.layers["fault"][0]], [(0.5, 0.0), (0.5, 0.5)])


def test_gmsh_writes_and_we_read(gmsh, meshio, tmp_path):
    """The present format of gmsh, by gmsh itself: areas of a square with an inner disc, each a group."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        disc = gmsh.model.occ.addDisk(0.5, 0.5, 0, 0.25, 0.25)
        box = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
        gmsh.model.occ.fragment([(2, box)], [(2, disc)])
        gmsh.model.occ.synchronize()
        by_area = sorted((gmsh.model.occ.getMass(2, t), t) for _, t in gmsh.model.getEntities(2))
        for name, (_, tag) in zip(("inner", "outer"), by_area):
            gmsh.model.addPhysicalGroup(2, [tag], name=name)
        gmsh.model.mesh.setSize(gmsh.model.getEntities(0), 0.1)
        gmsh.model.mesh.generate(2)
        files = []
        for version in (2.2, 4.1):
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            files.append(tmp_path / f"v{version}.msh")
            gmsh.write(str(files[-1]))
    finally:
        gmsh.finalize()
    one, other = (import_mesh(f) for f in files)
    np.testing.assert_allclose(one.areas().sum(), 1.0)
    inner = one.areas()[one.groups["physical"]["inner"]].sum()
    assert 0.95 * np.pi / 16 < inner < np.pi / 16
    np.testing.assert_allclose(other.areas(), one.areas(), rtol=1e-12)


def test_abaqus_sets(read):
    text = """*NODE
1, 0, 0
2, 1, 0
3, 1, 1
4, 0, 1
5, 2, 0
6, 2, 1
*ELEMENT, TYPE=CPE4, ELSET=ALL
1, 1, 2, 3, 4
2, 2, 5, 6, 3
*ELSET, ELSET=RIGHT
2
"""
    mesh = read(text, "m.inp")
    check(mesh)
    assert len(mesh.cells) == 2
    # They overlap, so one has a set of its own.
    groups = {g: (s, rows.tolist()) for s, of in mesh.groups.items() for g, rows in of.items()}
    assert groups["RIGHT"][1] == [1] and groups["ALL"][1] == [0, 1]
    assert sorted(s for s, _ in groups.values()) in (["RIGHT", "physical"], ["ALL", "physical"])


def test_merging_points(read):
    apart = [*SQUARES[:6], (1 + 1e-7, 0, 0), (1, 1 - 1e-7, 0)]
    elements = [(3, 1, 1, 2, 5, 4), (3, 2, 7, 3, 6, 8)]
    with pytest.raises(HpcdemError, match=r"m\.msh .*: points 1 and 6 lie in the same place|points 1 and 6"):
        read(msh([*apart[:6], (1 + 1e-12, 0, 0), (1, 1 - 1e-12, 0)], elements))
    assert read(msh(apart, elements)).edges().inner.sum() == 0
    merged = read(msh(apart, elements), merge=1e-6)
    assert merged.edges().inner.sum() == 1 and len(merged.points) == 6
    with pytest.raises(HpcdemError, match="merging points nearer than 2 makes a line of element 1"):
        read(msh(apart, elements), merge=2.0)


BAD = {
    "flat": (SQUARES, [TWO[1], (2, 1, 1, 2, 3)], r"m\.msh: element 2 \(triangle of points \[1, 2, 3\], .*\) is flat"),
    "folded": (SQUARES, [TWO[1], (3, 1, 2, 3, 5, 6)], r"m\.msh: element 2 \(quad .* is flat, folded or concave"),
    "corner twice": (SQUARES, [(2, 1, 1, 2, 2)], r"m\.msh: element 1 has the same point twice: \[1, 2, 2\]"),
    "out of plane": ([*SQUARES[:5], (2, 1, 0.5)], TWO, r"m\.msh: point 6 lies at z = 0\.5"),
    "not finite": ([*SQUARES[:5], (2, float("nan"), 0)], TWO, r"m\.msh: point 6 is not finite"),
    "volume": (SQUARES, [TWO[1], (4, 1, 1, 2, 3, 4)], r"m\.msh: block 2 holds 1 .* 'tetra'.* after element 1"),
    "curved": (SQUARES, [(9, 1, 1, 2, 5, 3, 4, 6)], r"m\.msh: block 1 holds 1 elements of type 'triangle6'"),
    "lines only": (SQUARES, [TWO[0]], r"m\.msh: there are no triangles and no quads \(element types: line\)"),
    "twice": (SQUARES, [TWO[1], (2, 1, 5, 1, 2)], r"element 0 .* is there again as element 1"),
    "three": (SQUARES, [*TWO, (2, 1, 2, 5, 7)], "used by more than two elements"),
    "line off": (SQUARES, [(1, 7, 1, 6), *TWO[1:]], r"m\.msh: lines of the group 'fault' are not edges"),
    "line in the void": (SQUARES, [(1, 7, 1, 7), *TWO[1:]], r"m\.msh: lines of the group 'fault' are not edges"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_refused_with_file_and_element(read, name):
    nodes, elements, message = BAD[name]
    with pytest.raises(HpcdemError, match=message):
        read(msh(nodes, elements))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "hello",
        HEAD,
        msh(SQUARES, TWO)[:-60],
        msh(SQUARES, TWO).replace("2.2 0 8", "9.9 0 8"),
        msh(SQUARES, [(2, 1, 1, 2, 55)]),
    ],
)
def test_broken_files(read, capfd, text):
    with pytest.raises(HpcdemError, match=r"m\.msh"):
        read(text)
    out, err = capfd.readouterr()
    assert out == "" and err == ""


def test_files_of_other_kinds(read, tmp_path):
    with pytest.raises(HpcdemError, match=r"m\.xyz: this is not a mesh that can be read"):
        read("hello", "m.xyz")
    with pytest.raises(CommandError, match="no such file"):
        import_mesh(tmp_path / "none.msh")
    with pytest.raises(CommandError, match="scale"):
        read(msh(SQUARES, TWO), scale=0.0)

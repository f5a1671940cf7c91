"""Meshes from files: what is taken over, and what is refused with file and element."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.fdem import Project, meshes
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.physics.fdem.mesh import check
from hpcdem.pre.mesh import imported
from hpcdem.pre.mesh.imported import import_mesh
from tests.pcdc.fake import FakeBlocks

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
    def reading(text: str, name: str = "m.msh", whole: bool = False, **how):
        (tmp_path / name).write_text(text)
        found = imported.read(tmp_path / name, **how)
        return found if whole else found.mesh

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
    # Halves with points of their own are two bodies; a slit within a body is refused.
    assert read(msh([*apart[:6], (1 + 1e-12, 0, 0), (1, 1 - 1e-12, 0)], elements)).edges().inner.sum() == 0
    slit = [*apart[:6], (1 + 1e-12, 0, 0), (0, 2, 0), (1, 2, 0), (2, 2, 0)]
    with pytest.raises(HpcdemError, match=r"m\.msh: points 2 and 7 coincide at \(1, 0\) of one body"):
        read(msh(slit, [(3, 1, 1, 2, 5, 4), (3, 2, 7, 3, 6, 5), (3, 1, 4, 5, 9, 8), (3, 1, 5, 6, 10, 9)]), merge=0.0)
    assert read(msh(apart, elements)).edges().inner.sum() == 0
    merged = read(msh(apart, elements), merge=1e-6)
    assert merged.edges().inner.sum() == 1 and len(merged.points) == 6
    with pytest.raises(HpcdemError, match="merging points nearer than 2 m collapses an edge of element 1"):
        read(msh(apart, elements), merge=2.0)


BAD = {
    "flat": (SQUARES, [TWO[1], (2, 1, 1, 2, 3)], r"m\.msh: element 2 \(triangle of points 1, 2, 3, at .*\) is flat"),
    "folded": (SQUARES, [TWO[1], (3, 1, 2, 3, 5, 6)], r"m\.msh: element 2 \(quad .* is flat, folded or concave"),
    "corner twice": (SQUARES, [(2, 1, 1, 2, 2)], r"m\.msh: element 1 has the same point twice: 1, 2, 2"),
    "out of plane": ([*SQUARES[:5], (2, 1, 0.5)], TWO, r"m\.msh: point 6 lies at z = 0\.5"),
    "not finite": ([*SQUARES[:5], (2, float("nan"), 0)], TWO, r"m\.msh: point 6 is not finite"),
    "volume": (SQUARES, [TWO[1], (4, 1, 1, 2, 3, 4)], r"m\.msh: 1 tetrahedra .* element 2: .*model new dim 3"),
    "pyramid": (SQUARES, [TWO[1], (7, 1, 1, 2, 3, 4, 5)], r"m\.msh: 1 pyramids .* element 2: only triangles"),
    "lines only": (SQUARES, [TWO[0]], r"m\.msh: there are no triangles and no quads \(elements: 1 of line"),
    "twice": (SQUARES, [TWO[1], (2, 1, 5, 1, 2)], r"element 1 .* is a duplicate of element 2"),
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
        msh(SQUARES, TWO).replace("$Elements\n4", "$Elements\n3"),
        msh(SQUARES, TWO).replace("$Nodes\n7", "$Nodes\n99999999999"),
    ],
)
def test_broken_files(read, capfd, text):
    with pytest.raises(HpcdemError, match=r"m\.msh"):
        read(text)
    out, err = capfd.readouterr()
    assert out == "" and err == ""


def test_files_of_other_kinds(read, tmp_path):
    with pytest.raises(HpcdemError, match=r"m\.xyz: files \*\.xyz are not supported; known: .*\.vtu"):
        read("hello", "m.xyz")
    with pytest.raises(CommandError, match="no such file"):
        import_mesh(tmp_path / "none.msh")
    with pytest.raises(CommandError, match="scale"):
        read(msh(SQUARES, TWO), scale=0.0)


def names(sets) -> dict[str, list[int]]:
    """Members by group, whatever the set."""
    return {name: rows.tolist() for of in sets.values() for name, rows in of.items()}


STRIP = """*HEADING
*NODE, NSET=ALL
10, 0., 0.
20, 1., 0.
30, 2.D0, 0.
40, 0., 1.
50, 1., 1.
60, 2., 1., 0.
"""
QUADS = "*ELEMENT, TYPE=CPE4{}\n100, 10, 20, 50, 40\n*ELEMENT, TYPE=CPE4{}\n200, 20, 30, 60, 50\n"
DECKS = {
    "a block without a set before one with it": (QUADS.format("", ", ELSET=B"), {"B": [1]}, {}),
    "one name on two blocks": (QUADS.format(", ELSET=B", ", ELSET=B"), {"B": [0, 1]}, {}),
    "names know no capitals": (QUADS.format(", ELSET=b", "") + "*Elset, elset=B\n200\n", {"b": [0, 1]}, {}),
    "bars first": ("*ELEMENT, TYPE=T2D2, ELSET=BARS\n1, 10, 20\n2, 20, 30\n" + QUADS.format(", ELSET=A", ", ELSET=B"),
                   {"A": [0], "B": [1]}, {}),
    "generated, with gaps": (QUADS.format("", "") + "*ELSET, ELSET=G, GENERATE\n50, 250, 50\n", {"G": [0, 1]}, {}),
    "generated, to any": (QUADS.format("", "") + "*ELSET, ELSET=G, GENERATE\n2, 4000000000\n", {"G": [0, 1]}, {}),
    "sets of sets, the later first": (
        QUADS.format(", ELSET=A", ", ELSET=B")
        + "*ELSET, ELSET=TOP\nMID,\n*ELSET, ELSET=MID\nA, 200\n*ELSET, ELSET=TOP\nTOP\n",
        {"A": [0], "B": [1], "TOP": [0, 1], "MID": [0, 1]}, {}),
    "two lines of one element, and a keyword of two lines": (
        "*ELEMENT,\nTYPE=CPE4RH, ELSET = 'A b'\n100, 10, 20,\n50, 40\n**\n  200, 20, 30, 60, 50,\n",
        {"A b": [0, 1]}, {}),
    "points by elements": (QUADS.format(", ELSET=A", "") + "*NSET, NSET=N, ELSET=A\n*NSET, NSET=N\n60\n*NSET, NSET=M\nN"
                           "\n", {"A": [0]}, {"N": [0, 1, 3, 4, 5], "M": [0, 1, 3, 4, 5]}),
}  # fmt: skip


@pytest.mark.parametrize("case", DECKS)
def test_sets_of_abaqus_are_read_by_numbers(read, case):
    text, elements, nodes = DECKS[case]
    found = read(STRIP + text, "m.inp", whole=True)
    assert names(found.mesh.groups) == elements
    assert names(found.nodes) == {"ALL": [0, 1, 2, 3, 4, 5], **nodes}
    assert np.allclose(found.mesh.areas(), 1.0)


@pytest.mark.parametrize("seed", range(8))
def test_any_order_of_blocks_and_sets(read, seed):
    """Decks of a strip of quads, triangles and bars in random blocks, sets and numbers, beside what they say."""
    random = np.random.default_rng(seed)
    n = 6
    ids = random.permutation(np.arange(1, 60))[: 3 * n + 3].tolist()
    number = {(x, y): int(k) for k, (x, y) in enumerate(((x, y) for y in range(3) for x in range(n + 1)), 101)}
    lines = ["*NODE"]
    for (x, y), k in sorted(number.items(), key=lambda item: random.random()):
        lines += [f"{k}, {x}., {y}.", *(["*NODE", "** more"] * (random.random() < 0.2))]
    elements = {}  # number -> label, corners
    for x in range(n):
        a, b, c, d, e, f = (number[at] for at in ((x, 0), (x + 1, 0), (x + 1, 1), (x, 1), (x + 1, 2), (x, 2)))
        elements[ids.pop()] = "CPE4R", (a, b, c, d)
        elements[ids.pop()] = "CPE3", (d, c, e)
        elements[ids.pop()] = "CPE3H", (d, e, f)
    elements[ids.pop()] = elements[ids.pop()] = "T2D2", (101, 102)
    sets: dict[str, set[int]] = {}
    order, file = random.permutation(list(elements)).tolist(), []
    while order:
        label = elements[order[0]][0]
        block = [k for k in order if elements[k][0] == label][: random.integers(1, 5)]
        order = [k for k in order if k not in block]
        name = random.choice(["", "A", "b", "C"])
        lines.append(f"*Element, type={label}" + f", elset={random.choice([name, name.upper()])}" * bool(name))
        for k in block:
            lines += [f"{k}, " + ", ".join(map(str, elements[k][1]))]
        file += [k for k in block if label != "T2D2"]
        if name:
            sets.setdefault(name, set()).update(block)
    some = random.choice(file, 5).tolist()
    lines += ["*ELSET, ELSET=LIST", ", ".join(map(str, some)), "*ELSET, ELSET=ALSO", ", ".join(["LIST", *sets]),
              "*ELSET, ELSET=ODD, GENERATE", "1, 59, 2"]  # fmt: skip
    sets |= {"LIST": set(some), "ALSO": set(some).union(*sets.values()), "ODD": {k for k in elements if k % 2}}
    found = read("\n".join(lines), "m.inp", whole=True)
    got = {name.upper(): {file[e] for e in rows} for name, rows in names(found.mesh.groups).items()}
    assert got == {name.upper(): whole & set(file) for name, whole in sets.items() if whole & set(file)}
    middle = {(round(x, 6), round(y, 6)) for x, y in found.mesh.centroids()}
    assert len(middle) == 3 * n and found.mesh.areas().sum() == pytest.approx(2 * n)


def test_several_sections_of_nodes_and_an_included_file(read, tmp_path):
    (tmp_path / "more.inc").write_text("*NODE\n7, 2., 0.\n8, 2., 1.\n")
    text = (
        "*NODE\n1, 0., 0.\n2, 1., 0.\n*NODE\n3, 1., 1.\n4, 0., 1.\n*INCLUDE, INPUT=more.inc\n"
        "*ELEMENT, TYPE=CPS8R\n1, 1, 2, 3, 4, 1, 2, 3, 4\n*ELEMENT, TYPE=CPEG4\n2, 2, 7, 8, 3\n"
        "*MATERIAL, NAME=ROCK\n*DENSITY\n2000.,\n*STEP\n*BOUNDARY\n1, 1\n*BOUNDARY\n2, 1\n"
    )
    found = read(text, "m.inp", whole=True)
    assert len(found.mesh.points) == 6 and len(found.mesh.cells) == 2
    assert [file.name for file in found.files] == ["m.inp", "more.inc"]  # nothing is written over these
    assert any("*MATERIAL" in note and "*BOUNDARY (2 times)" in note for note in found.notes)
    assert any("between the corners of 1 elements (CPS8R)" in note for note in found.notes)
    assert any("the plane stress of CPS8R" in note for note in found.notes)


def test_a_file_may_be_included_between_lines_of_data(read, tmp_path):
    (tmp_path / "points.txt").write_text("** without a keyword\n1, 0., 0.\n2, 1., 0.\n3, 1., 1.\n")
    (tmp_path / "corner.txt").write_text("1, 1, 2, 3\n")
    text = (
        "*NODE\n*INCLUDE, INPUT=points.txt\n4, 0., 1.\n*ELEMENT, TYPE=CPE3, ELSET=A\n*INCLUDE, INPUT=corner.txt\n"
        "2, 1, 3, 4\n"
    )
    found = read(text, "m.inp", whole=True)
    assert found.mesh.groups["physical"]["A"].tolist() == [0, 1]
    assert [file.name for file in found.files] == ["corner.txt", "m.inp", "points.txt"]


SQUARE = "*NODE\n1, 0., 0.\n2, 1., 0.\n3, 1., 1.\n4, 0., 1.\n*ELEMENT, TYPE=CPE3\n1, 1, 2, 3\n2, 1, 3, 4\n"


@pytest.mark.parametrize(("encoding", "first", "second"), [("gbk", "灰岩", "泥岩"), ("latin-1", "É", "Ü")])
def test_names_that_are_not_in_utf_8_stay_apart(tmp_path, encoding, first, second):
    sets = f"** {second}\x85, ".encode(encoding, "ignore") + f"\n*ELSET, ELSET={first}\n1\n".encode(encoding)
    sets += f"*ELSET, ELSET={second}\n2\n".encode(encoding)
    (tmp_path / "m.inp").write_bytes(SQUARE.encode() + sets)
    assert names(imported.read(tmp_path / "m.inp").mesh.groups) == {first: [0], second: [1]}
    gmsh = (
        f'$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 "{first}"\n2 2 "{second}"\n$EndPhysicalNames\n'
        "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n"
        "$Elements\n2\n1 2 2 1 1 1 2 3\n2 2 2 2 1 1 3 4\n$EndElements\n"
    )
    (tmp_path / "m.msh").write_bytes(gmsh.encode(encoding))
    assert names(imported.read(tmp_path / "m.msh").mesh.groups) == {first: [0], second: [1]}
    (tmp_path / "m.msh").write_text(gmsh.replace("\n1 0 0 0", f"\n{2**60} 0 0 0"))
    with pytest.raises(HpcdemError, match=r"\$Nodes .* contains something that is not a number"):
        imported.read(tmp_path / "m.msh")


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("*PART, NAME=P\n*END PART\n*PART, NAME=p\n", ":11: part p is defined twice"),
        ("*INCLUDE\n", r":9: \*INCLUDE needs INPUT="),
        (f"*NODE\n{10**25}, 0., 0.\n", ":10: 10000000000000000000000000 is too large for the number of a node"),
    ],
)
def test_what_would_be_lost_in_an_abaqus_file_is_refused(read, more, said):
    with pytest.raises(HpcdemError, match=said):
        read(SQUARE + more, "m.inp")


def test_the_face_of_a_shell_is_no_side_in_the_plane(read):
    found = read(SQUARE + "*SURFACE, NAME=S\n1, SPOS\n2, S1\n", "m.inp", whole=True)
    assert found.mesh.layers["S"].tolist() == [[0, 2]] and "the sides SPOS of CPE3 in the surface S" in found.notes


def test_names_in_quotes_before_a_dot(read):
    text = (
        f'*PART, NAME="a part"\n{SQUARE}*ELSET, ELSET="a set"\n2\n*END PART\n*ASSEMBLY, NAME=A\n'
        '*INSTANCE, NAME="part one", PART="a part"\n*END INSTANCE\n'
        '*ELSET, ELSET=PICKED\n"part one"."a set", "part one".1\n*END ASSEMBLY\n'
    )
    assert names(read(text, "m.inp").groups) == {"a set": [1], "PICKED": [0, 1]}


PARTS = """*PART, NAME=BLOCK
*NODE
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 0., 0., 1.
6, 1., 0., 1.
7, 1., 1., 1.
8, 0., 1., 1.
*ELEMENT, TYPE=C3D8R, ELSET=ROCK
1, 1, 2, 3, 4, 5, 6, 7, 8
*NSET, NSET=BASE
1, 2, 3, 4
*SURFACE, NAME=TOP
ROCK, S2
*END PART
*PART, NAME=SPARE
*NODE
1, 0., 0., 0.
*END PART
*ASSEMBLY, NAME=A
*INSTANCE, NAME=ONE, PART=BLOCK
*END INSTANCE
*INSTANCE, NAME=TWO, PART=BLOCK
0., 0., 2.
0., 0., 2., 1., 0., 2., 90.
*END INSTANCE
*NODE
1, 9., 9., 9.
*ELSET, ELSET=PICKED, INSTANCE=TWO
1,
*ELSET, ELSET=EACH
ONE.1, TWO.ROCK
*ELSET, ELSET=_INNER, INTERNAL, INSTANCE=ONE
1,
*NSET, NSET=FEET
ONE.BASE
*SURFACE, NAME=SIDE
_INNER, S6
TWO.1, S4
*SURFACE, NAME=SKIN
PICKED
*END ASSEMBLY
"""


def test_instances_stand_where_the_assembly_has_them(read):
    """The second is lifted by 2, then turned by 90 degrees about x through (0, 0, 2): (x, y, z) to (x, -z, y + 2)."""
    found = read(PARTS, "m.inp", dim=3, whole=True)
    mesh = found.mesh
    check(mesh)
    assert len(mesh.points) == 16 and mesh.areas().sum() == pytest.approx(2.0)
    for half, low, high in ((mesh.points[:8], (0, 0, 0), (1, 1, 1)), (mesh.points[8:], (0, -1, 2), (1, 0, 3))):
        np.testing.assert_allclose([half.min(axis=0), half.max(axis=0)], [low, high], atol=1e-12)
    first, second = list(range(6)), list(range(6, 12))
    groups = names(mesh.groups)
    assert groups["ROCK"] == groups["EACH"] == first + second and groups["PICKED"] == groups["TWO.ROCK"] == second
    assert mesh.groups["instance"]["ONE"].tolist() == first == groups["ONE.ROCK"]
    assert names(found.nodes)["FEET"] == names(found.nodes)["ONE.BASE"] == [0, 1, 2, 3]
    faces = {name: mesh.points[mesh.face_points(np.array(rows))] for name, rows in names(found.faces).items()}
    np.testing.assert_allclose(faces["ONE.TOP"][..., 2], 1.0)
    np.testing.assert_allclose(faces["TWO.TOP"][..., 1], -1.0)
    assert len(faces["TOP"]) == 4 and len(faces["SKIN"]) == 12 and len(faces["SIDE"]) == 4
    np.testing.assert_allclose(sorted(faces["SIDE"][..., 0].ravel()), [0.0] * 6 + [1.0] * 6)
    assert set(mesh.layers) == set(faces) and "_INNER" not in groups


@pytest.mark.parametrize("label", ["C3D4", "C3D4H", "C3D10M", "C3D10HS", "C3D4P", "DC3D4"])
def test_relatives_of_an_element_are_known(read, label):
    points = "1, 2, 3, 4" + ", 1, 2, 3, 4, 1, 2" * ("10" in label)
    text = (
        f"*NODE\n1, 0,0,0\n2, 1,0,0\n3, 0,1,0\n4, 0,0,1\n*ELEMENT, TYPE={label}\n7, {points}\n*SURFACE, NAME=S\n7, S3\n"
    )
    found = read(text, "m.inp", dim=3, whole=True)
    (face,) = names(found.faces)["S"]
    assert found.mesh.areas()[0] == pytest.approx(1 / 6)
    assert np.allclose(found.mesh.points[found.mesh.face_points(np.array([face]))].sum(axis=2), 1.0)  # 2 - 4 - 3


BAD_DECKS = {
    "no point": ("*ELEMENT, TYPE=CPE4\n1, 10, 20, 50, 99\n", r"m\.inp: element 1 has the node 99, which is not in"),
    "twice": ("*NODE\n10, 5., 0.\n", r"m\.inp:10: node 10 is defined twice, at different positions"),
    "element twice": (QUADS.format("", "") + "*ELEMENT, TYPE=CPE4\n100, 20, 30, 60, 50\n", r"m\.inp:14: element 100"),
    "too few": ("*ELEMENT, TYPE=CPE4\n1, 10, 20, 50\n", r"m\.inp:10: element 1 has 3 points, CPE4 has 4"),
    "no such set": (QUADS.format("", "") + "*ELSET, ELSET=A\nB\n", r"m\.inp:14: unknown \*ELSET 'B'"),
    "generation": (QUADS.format("", "") + "*NGEN\n10, 20, 5\n", r"m\.inp:13: \*NGEN makes points .* is not supported"),
    "no number": ("*NODE\n70, x, 0.\n", r"m\.inp:10: expected a number, not 'x'"),
    "not finite": ("*NODE\n70, inf, 0.\n", r"m\.inp:10: expected a finite number"),
    "wedges": ("*ELEMENT, TYPE=C3D6\n7, 10, 20, 30, 40, 50, 60\n", r"1 wedges .*element 7: only triangles"),
    "flat": ("*ELEMENT, TYPE=CPE3\n7, 10, 20, 30\n", r"element 7 .triangle of points 10, 20, 30, at .0, 0.. is flat"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD_DECKS)
def test_what_a_deck_lacks_is_reported_with_its_line(read, name):
    text, said = BAD_DECKS[name]
    with pytest.raises(HpcdemError, match=said):
        read(STRIP + text, "m.inp")


def test_surfaces_through_hexahedra_are_none_of_their_sides(read):
    """Shells on the top, and across the middle, of a cube."""
    cube = PARTS[PARTS.index("*NODE") : PARTS.index("*NSET")]
    found = read(cube + "*ELEMENT, TYPE=S4R, ELSET=SKIN\n2, 5, 6, 7, 8\n3, 1, 3, 7, 5\n", "m.inp", dim=3, whole=True)
    (rows,) = (np.array(rows) for rows in names(found.faces).values())
    assert len(rows) == 2 and np.allclose(found.mesh.points[found.mesh.face_points(rows)][..., 2], 1.0)
    assert any("2 surfaces of the group 'SKIN' are not faces" in note for note in found.notes)


def test_sets_become_groups_of_the_model(tmp_path):
    """Of two files one after the other; what the second names follows the first."""
    (tmp_path / "m.inp").write_text(
        STRIP + QUADS.format(", ELSET=A", ", ELSET=B") + "*SURFACE, NAME=END\nB, S2\n*STEP\n"
    )
    blocks = FakeBlocks()
    project = Project(blocks, tmp_path, tmp_path / "data")
    meshes.import_file(project, "m.inp")
    meshes.import_file(project, "m.inp", group="second", set_name="file", scale=2.0)
    sets = {kind: names(groups.sets) for kind, groups in project.groups.items() if groups.sets}
    assert sets == {
        "element": {"A": [0, 2], "B": [1, 3], "second": [2, 3]},
        "node": {"ALL": list(range(12))},
        "element-face": {"END": [5, 13]},
    }
    assert blocks.log.lines[1:6] == [
        "m.inp: from (0, 0) to (2, 1) m, one body",
        "m.inp: groups of elements, set 'physical': 'A', 'B'",
        "m.inp: groups of nodes, set 'physical': 'ALL'",
        "m.inp: groups of element-faces, set 'physical': 'END'",
        "m.inp: left out: *STEP",
    ]


def test_sets_of_a_file_follow_elements_that_were_added_one_by_one(tmp_path):
    (tmp_path / "m.inp").write_text(STRIP + QUADS.format(", ELSET=A", ", ELSET=B") + "*SURFACE, NAME=END\nB, S2\n")
    project = Project(FakeBlocks(), tmp_path, tmp_path / "data")
    meshes.add_nodes(project, [(9.0, 0.0), (10.0, 0.0), (9.0, 1.0)])
    meshes.add_element(project, (0, 1, 2))
    meshes.import_file(project, "m.inp", group="second", set_name="file")
    sets = {kind: names(groups.sets) for kind, groups in project.groups.items() if groups.sets}
    assert sets["node"] == {"ALL": [3, 4, 5, 6, 7, 8]} and sets["element-face"] == {"END": [9]}
    assert sets["element"]["second"] == [1, 2]


def test_what_is_left_out_of_a_deck_is_named(read):
    text = QUADS.format(", ELSET=A", "") + (
        "*ELEMENT, TYPE=T2D2, ELSET=BARS\n1, 10, 20\n2, 20, 30\n*ELSET, ELSET=A\n900\n*NSET, NSET=A\n900\n"
        "*SURFACE, NAME=ROUND, TYPE=CYLINDER\n0,0\n*NODE\n77, 5, 5\n*NSET, NSET=REF\n77\n"
    )
    found = read(STRIP + text, "m.inp", whole=True)
    for said in (
        "2 elements of type T2D2 (1, 2)",
        "elements 900 of the set A",
        "nodes 900 of the set A",
        "ROUND",
        "sets without an element that is read: 'BARS'",
        "1 points of the set 'REF' that belong to no element",
    ):
        assert any(said in note for note in found.notes), (said, found.notes)


def test_all_of_gmsh_is_read_by_its_numbers(gmsh, tmp_path):
    """SaveAll with part of the entities named, parameters of points, two groups of one surface, text and binary."""
    files = []
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        one, two = (gmsh.model.occ.addRectangle(x, 0, 0, 1, 1) for x in (0, 1))
        gmsh.model.occ.fragment([(2, one)], [(2, two)])
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [one], name="left part")
        gmsh.model.addPhysicalGroup(1, [2], name="fault")
        gmsh.model.addPhysicalGroup(0, [1], name="corner")
        gmsh.model.mesh.setSize(gmsh.model.getEntities(0), 0.5)
        gmsh.model.mesh.generate(2)

        def write(version: float, binary: int, **more: int) -> None:
            for name, value in {
                "MshFileVersion": version,
                "Binary": binary,
                "SaveAll": 0,
                "SaveParametric": 0,
                **more,
            }.items():
                gmsh.option.setNumber(f"Mesh.{name}", value)
            files.append(tmp_path / f"{len(files)}.msh")
            gmsh.write(str(files[-1]))

        for parametric in (0, 1):
            for binary in (0, 1):
                write(4.1, binary, SaveAll=1, SaveParametric=parametric)
        gmsh.model.addPhysicalGroup(2, [one, two], name="all")
        for version in (2.2, 4.1):
            write(version, 0)
            write(version, 1)
        write(2.2, 0, SaveParametric=1)
        gmsh.model.mesh.setOrder(2)
        for version in (2.2, 4.1):
            write(version, 0)
    finally:
        gmsh.finalize()
    for k, file in enumerate(files):
        found = imported.read(file)
        mesh, groups = found.mesh, names(found.mesh.groups)
        check(mesh)
        assert mesh.areas().sum() == pytest.approx(2.0) and mesh.areas()[groups["left part"]].sum() == pytest.approx(
            1.0
        )
        assert ("all" in groups) == (k > 3) and (k < 4 or groups["all"] == list(range(len(mesh.cells)))), file
        assert (
            np.allclose(mesh.points[mesh.layers["fault"]][..., 0], 1.0) and len(found.faces["physical"]["fault"]) == 4
        )
        np.testing.assert_array_equal(mesh.points[found.nodes["physical"]["corner"]], [(0.0, 0.0)])
        assert any("between the corners" in note for note in found.notes) == (k > 8)


def test_numbers_of_the_file_are_reported(read):
    """Points 11, 12, ... of a file whose elements begin at 501; inverted hexahedra are turned, folded ones refused."""
    nodes = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n" + "".join(
        f"{i} {x} {y} {z}\n" for i, (x, y, z) in enumerate(nodes, 11)
    )
    one = text + "$EndNodes\n$Elements\n1\n501 5 2 1 1 {}\n$EndElements\n"
    assert read(one.format("15 16 17 18 11 12 13 14"), dim=3).areas().sum() == pytest.approx(1.0)
    with pytest.raises(
        HpcdemError, match=r"m\.msh: hexahedron 501 at \(0, 0, 0\) with the points 11, 12, 13, 14, 15, 17"
    ):
        read(one.format("11 12 13 14 15 17 16 18"), dim=3)
    with pytest.raises(HpcdemError, match=r"element 501 names point 99, which is not in the file"):
        read(one.format("11 12 13 14 15 16 17 99"), dim=3)
    with pytest.raises(HpcdemError, match=r"element 501 has the same point twice: 11, 12, 13, 14, 15, 16, 17, 17"):
        read(one.format("11 12 13 14 15 16 17 17"), dim=3)

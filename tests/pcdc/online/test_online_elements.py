"""Elements in the words of the online commands: densified, glued, deleted, hidden, counted; the mesh moved."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.physics.fdem import connectivity, diagnostics
from hpcdem.physics.fdem.mesh import check
from tests.pcdc.test_excavation import Desk


@pytest.fixture
def desk(tmp_path) -> Desk:
    return Desk(tmp_path)


QUADS = "pcdc element create brick p0 (0,0) p1 (8,0) p2 (0,4) n 8 4 triangle off\n"
ROCK = "pcdc element c-model mech-iso-e property den 2500 y 2e9 p-r 0.25\npcdc model option dynamic off\n"
PATCH = (
    ROCK
    + """
pcdc node boundary apply mech-vel-b-c v-x 0 range x 0 0
pcdc node boundary apply mech-vel-b-c v-y 0 range y 0 0
pcdc element-face boundary apply m-s-b-c stress-xx 3e6 range x {0} {0}
pcdc model solve elastic
"""
)


def test_quads_are_halved_and_neighbours_follow(desk):
    mesh = desk(QUADS + "pcdc element densify pattern 1 1 max-length 0.25 0.25 range x 3 4 y 1 2\n").project.mesh
    check(mesh)
    assert mesh.areas().sum() == pytest.approx(32.0)
    inside = np.all(np.abs(mesh.centroids() - (3.5, 1.5)) < 0.5, axis=1)
    assert mesh.areas()[inside].max() <= 0.0625 + 1e-12 and inside.sum() >= 16
    # of two neighbours one is at most twice as fine: areas of neighbours differ by four, or eight where one is cut
    partner = mesh.face_partners().reshape(-1, 4)
    areas, rows = mesh.areas(), np.flatnonzero(partner.ravel() >= 0)
    ratio = areas[rows // 4] / areas[partner.ravel()[rows] // 4]
    assert ratio.max() <= 8.0 + 1e-9
    # far from it nothing changes, and elements keep their numbers
    assert (mesh.cells[:2] >= 0).all() and (mesh.areas()[:2] == 1.0).all()


def test_along_one_direction_only(desk):
    mesh = desk(QUADS + "pcdc element densify pattern 0 1 max-length 9 0.5\n").project.mesh
    assert len(mesh.cells) == 64 and mesh.areas() == pytest.approx(np.full(64, 0.5))
    assert (np.ptp(mesh.points[mesh.cells][:, :, 1], axis=1) == 0.5).all()


def test_groups_layers_and_histories_follow(desk):
    desk(
        QUADS
        + """
pcdc element group 'left' set 'g' range x 0 2
pcdc node group 'rim' set 'g' range x 0 0
pcdc element-face group 'rim' set 'g' range x 0 0
pcdc history create 'h' element id 9 value stress-xx
pcdc element densify max-length 0.5 range x 0 1
"""
    )
    project = desk.project
    centres = project.mesh.centroids()
    assert sorted(project.groups["element"].members("left", "g").tolist()) == np.flatnonzero(centres[:, 0] < 2).tolist()
    assert len(project.groups["element-face"].members("rim", "g")) == 8
    assert len(project.mesh.layers["left"]) == 8
    assert project.histories["h"].numbers == [9]
    x, y = centres[9]
    assert 1.0 < x < 2.0 and 1.0 < y < 2.0


@pytest.mark.parametrize("words", ["max-length 0.5 range x 2 4 y 1 3", "pattern 1 0 max-length 0.2 1 range x 5 6"])
def test_the_patch_test_is_exact(desk, words):
    """Uniform stress in an elastic block, whatever pieces it is made of."""
    desk(QUADS + f"pcdc element densify {words}\n" + PATCH.format(8))
    pcdc = desk.pcdc
    assert np.array(pcdc.values("element", "stress-xx")) == pytest.approx(3e6, rel=1e-9)
    assert np.abs(pcdc.values("element", "stress-yy")).max() < 3e6 * 1e-8
    assert np.abs(pcdc.values("element", "stress-xy")).max() < 3e6 * 1e-8


SMALL_ON_LARGE = """
pcdc element create brick p0 (0,0) p1 (2,0) p2 (0,2) n 2 2 triangle off group 'large' set 'b'
pcdc element create brick p0 (2,0) p1 (4,0) p2 (2,2) n 7 7 triangle [split] group 'small' set 'b'
"""


@pytest.mark.parametrize("split", [True, False])
def test_small_elements_are_glued_on_large_faces(desk, split):
    desk(f"split = {split}\n" + SMALL_ON_LARGE + "pcdc element glue range group 'small' set 'b'\n" + PATCH.format(4))
    stress = np.array(desk.pcdc.values("element", "stress-xx"))
    assert stress == pytest.approx(3e6, rel=1e-8)
    assert len(desk.pcdc.numbers("element", group="small", set="b")) >= 49


def test_without_glue_they_part(desk):
    with pytest.raises(HpcdemError, match="can move"):
        desk("split = True\n" + SMALL_ON_LARGE + PATCH.format(4))


def test_a_small_block_on_a_part_of_a_large_face(desk):
    desk("pcdc element create brick p0 (0,0) p1 (3,0) p2 (0,1) n 3 1 tri off\n"
         "pcdc element create brick p0 (1.2,1) p1 (1.8,1) p2 (1.2,1.5) n 3 2 tri off\npcdc element glue\n")  # fmt: skip
    mesh = desk.project.mesh
    check(mesh)
    assert mesh.areas().sum() == pytest.approx(3.3)
    assert len(np.unique(mesh.points.round(9), axis=0)) == len(mesh.points)


def test_small_elements_on_large_faces_in_space(desk):
    desk(
        """
pcdc model new dim 3
pcdc element create brick p0 (0,0,0) p1 (2,0,0) p2 (0,2,0) p3 (0,0,2) n 1 1 1 triangle off
pcdc element create brick p0 (2,0,0) p1 (4,0,0) p2 (2,2,0) p3 (2,0,2) n 2 3 3
pcdc element glue
"""
        + ROCK
        + """
pcdc node boundary apply mech-vel-b-c v-x 0 range x 0 0
pcdc node boundary apply mech-vel-b-c v-y 0 range y 0 0
pcdc node boundary apply mech-vel-b-c v-z 0 range z 0 0
pcdc element-face boundary apply m-s-b-c stress-xx 3e6 range x 4 4
pcdc model solve elastic
"""
    )
    assert np.array(desk.pcdc.values("element", "stress-xx")) == pytest.approx(3e6, rel=1e-8)


def test_deleted_before_and_after_the_first_model(tmp_path):
    early = Desk(tmp_path)(QUADS + "pcdc element group 'a' set 'g' range x 0 4\n"
                           "pcdc element delete range x 2 6 y 0 2\n" + PATCH.format(8))  # fmt: skip
    mesh = early.project.mesh
    check(mesh)
    assert len(mesh.cells) == 32 - 8 and mesh.areas().sum() == pytest.approx(24.0)
    assert len(early.project.groups["element"].members("a", "g")) == 12
    late = Desk(tmp_path)(QUADS + ROCK + "pcdc element delete range x 2 6 y 0 2\n" + PATCH.format(8).replace(ROCK, ""))
    assert len(late.project.mesh.cells) == 32 and late.project.alive.sum() == 24
    at = [dict(zip(map(tuple, d.project.mesh.points.tolist()), d.pcdc.values("node", "displacement-x").tolist()))
          for d in (early,)]  # fmt: skip
    there = np.unique(late.project.mesh.cells[late.project.alive])
    values = dict(zip(there.tolist(), late.pcdc.values("node", "displacement-x").tolist()))
    for node, value in values.items():
        assert value == pytest.approx(at[0][tuple(late.project.mesh.points[node].tolist())], rel=1e-9, abs=1e-18)


def test_hexahedra_are_deleted_whole(desk):
    desk("pcdc model new dim 3\npcdc element create brick p0 (0,0,0) p1 (2,0,0) p2 (0,2,0) p3 (0,0,2) n 2 2 2 tri off\n"
         "pcdc element delete range id 0 0\n")  # fmt: skip
    mesh = desk.project.mesh
    check(mesh)
    assert len(mesh.hexes) == 7 and mesh.areas().sum() == pytest.approx(7.0 * mesh.areas().sum() / 7.0)
    assert mesh.points.min() == 0.0 and len(mesh.points) == 26


def test_scaled_and_moved(desk):
    mesh = desk(QUADS + "pcdc model scale (0.5,2)\npcdc model translate (1,-3)\n").project.mesh
    assert mesh.points.min(axis=0).tolist() == [1.0, -3.0] and mesh.points.max(axis=0).tolist() == [5.0, 5.0]
    assert mesh.areas() == pytest.approx(np.ones(32))


HOSTILE = [
    ("element densify max-length 0.5 range x 9 9", "the range selects no element"),
    ("element densify pattern 0 0 max-length 0.5", "has no effect"),
    ("element densify pattern 2 0 max-length 0.5", "0 or 1"),
    ("element densify max-length 0", "above 0"),
    ("element densify pattern 1 1", "lacks m{aximum}-l{ength}"),
    ("element densify max-length 1e-6", "at most 2e\\+07"),
    ("element delete", "this would remove all elements"),
    ("element glue between 'a' 'b' range x 0 1", "cannot be combined"),
    ("model scale (0,1)", "factors above 0"),
    ("model scale (-1,1)", "factors above 0"),
    ("model scale (1e-300,1)", "flat|same place|lie in"),
]


@pytest.mark.parametrize(("line", "message"), HOSTILE)
def test_what_is_refused(desk, line, message):
    with pytest.raises(HpcdemError, match=message):
        desk(QUADS + f"pcdc {line}\n")


@pytest.mark.parametrize("line", ["element densify max-length 0.5", "model scale (1,2)", "model translate (1,2)",
                                  "element glue"])  # fmt: skip
def test_not_after_the_first_model(desk, line):
    with pytest.raises(HpcdemError, match="before the first of them is assigned"):
        desk(QUADS + ROCK + f"pcdc {line}\n")


def test_triangles_are_not_densified(desk):
    with pytest.raises(HpcdemError, match="selects no quad"):
        desk("pcdc element create brick p0 (0,0) p1 (8,0) p2 (0,4) n 8 4\npcdc element densify max-length 0.5\n")


TWO = """
pcdc element create brick p0 (0,0) p1 (4,0) p2 (0,1) n 4 1 triangle [tri] group 'plate' set 'b'
pcdc element create brick p0 (1,{0}) p1 (2,{0}) p2 (1,{1}) n 2 2 triangle [tri] group 'stone' set 'b'
pcdc element c-model mech-iso-e property den 2500 y 1e9 p-r 0.25
pcdc node boundary apply mech-m-b-c type 1 range face-of 'plate' set 'b'
"""
FALL = "pcdc node initial velocity (0,-9) range face-of 'stone' set 'b'\npcdc model step 400\n"


def depth(desk: Desk) -> float:
    y = np.array(desk.pcdc.values("node", "position-y"))[desk.pcdc.numbers("node", group="s")]
    return float(y.min())


@pytest.mark.parametrize("tri", [True, False])
def test_elements_that_touch_nothing(tmp_path, tri):
    text = f"tri = {tri}\n" + TWO.format(1.001, 2.001) + "pcdc node group 's' range face-of 'stone' set 'b'\n"
    found = {}
    for word in ("on", "off"):
        line = f"pcdc element collision {word} range group 'stone' set 'b'\n"
        found[word] = depth(Desk(tmp_path)(text + line + FALL))
    assert found["on"] > 0.97 and found["off"] < 0.9
    # overlaps of such elements are none of anybody's business
    depth(Desk(tmp_path)(f"tri = {tri}\n" + TWO.format(0.5, 1.5) + "pcdc element collision off range group 'stone' set "
                         "'b'\npcdc node group 's' range face-of 'stone' set 'b'\npcdc model step 1\n"))  # fmt: skip


def test_elements_that_touch_nothing_in_space(tmp_path):
    found = {}
    for word in ("on", "off"):
        desk = Desk(tmp_path)(f"""
pcdc model new dim 3
pcdc element create brick p0 (0,0,0) p1 (3,0,0) p2 (0,3,0) p3 (0,0,1) n 3 3 1 group 'plate' set 'b'
pcdc element create brick p0 (1,1,1.001) p1 (2,1,1.001) p2 (1,2,1.001) p3 (1,1,2.001) n 1 1 1 group 'stone' set 'b'
pcdc element c-model mech-iso-e property den 2500 y 1e9 p-r 0.25
pcdc node boundary apply mech-m-b-c type 1 range face-of 'plate' set 'b'
pcdc node initial velocity (0,0,-9) range face-of 'stone' set 'b'
pcdc element collision {word} range group 'stone' set 'b'
pcdc model step 200
""")
        found[word] = min(np.array(desk.pcdc.values("node", "position-z"))[32:])
    assert found["on"] > 0.97 > 0.9 > found["off"]


def test_the_switch_of_contact_is_saved(tmp_path):
    text = "tri = True\n" + TWO.format(1.001, 2.001) + "pcdc element collision off range group 'stone' set 'b'\n" + FALL
    whole = Desk(tmp_path)(text + "pcdc model step 50\n")
    Desk(tmp_path)(text + "pcdc model save 'a.sav'\n")
    after = Desk(tmp_path)("pcdc model restore 'a.sav'\npcdc model step 50\n")
    one, other = (np.array(d.pcdc.values("node", "position-y")) for d in (whole, after))
    assert (one == other).all() and one.min() < 0.9


def test_hidden_from_ranges(desk, tmp_path):
    desk(QUADS + "pcdc element group 'low' range y 0 2\npcdc element hide range y 0 1\n")
    numbers = desk.pcdc.numbers
    assert len(numbers("element", y=(0, 4))) == 24 and len(numbers("element", group="low")) == 8
    desk("pcdc element group 'all' range y 0 4 use-hidden on\npcdc element group 'seen' set 's' range y 0 4\n"
         "pcdc node group 'foot' range y 0 0 use-hidden on\n")  # fmt: skip
    assert len(desk.project.groups["element"].members("all")) == 32
    assert len(desk.project.groups["element"].members("seen", "s")) == 24
    assert len(desk.project.groups["node"].members("foot")) == 9
    with pytest.raises(HpcdemError, match="is hidden"):
        desk("pcdc node group 'foot2' range y 0 0\n")
    desk(ROCK + "pcdc model save 'a.sav'\n")
    again = Desk(tmp_path)("pcdc model restore 'a.sav'\n")
    assert again.project.hidden.sum() == 8
    again("pcdc element hide off\n")
    assert not again.project.hidden.any()


def test_hidden_from_pictures(desk, monkeypatch):
    """Frames say which elements are hidden, and pictures are drawn without them."""
    from hpcdem.commands.fdem import frames
    from hpcdem.post.view import paper

    drawn = {}
    monkeypatch.setattr(paper, "draw", lambda moment, path, view, only=None: drawn.update(only or {}))
    desk(QUADS + ROCK + "pcdc element hide range y 0 1\npcdc output image 'a'\n")
    assert drawn["elements"].tolist() == list(range(8, 32))
    assert frames.frame(desk.project).elements.columns["hidden"].sum() == 8


def test_summaries(desk):
    desk.project.blocks.log = desk.log
    desk(QUADS + ROCK + "pcdc element group 'low' set 'g' range y 0 2\npcdc element hide range y 0 1\n"
         "pcdc element delete range x 0 1 y 3 4\npcdc element list summary range use-hidden on\n"
         "pcdc element-face list summary\npcdc face-joint list summary range x 0 8 use-hidden on\n")  # fmt: skip
    told = "\n".join(desk.log.lines)
    assert "31 elements: 31 mech-iso-elastic, 31 in group 'default', 16 in group 'low' of set 'g'" in told
    assert "124 element-faces: " in told and "50 face-joints: 50 without model" in told


def test_nodes_and_elements_one_by_one(desk):
    desk("pcdc element create brick p0 (0,0) p1 (2,0) p2 (0,1) n 2 1 triangle off\n"
         "pcdc model add node (3,0) (3,1)\npcdc model add element 2 6 7 5\npcdc model add node (2.5,2)\n"
         "pcdc model add element 8 7 5\n")  # fmt: skip
    mesh = desk.project.whole_mesh()
    check(mesh)
    assert mesh.cells[2:].tolist() == [[2, 6, 7, 5], [8, 5, 7, -1]] and mesh.areas().tolist() == [1.0, 1.0, 1.0, 0.5]
    assert mesh.edges().inner.sum() == 3
    desk(PATCH.format(3).replace("stress-xx 3e6 range x 3 3", "stress-xx 3e6 range x 3 3 y 0 1"))
    assert len(desk.pcdc.values("element", "stress-xx")) == 4


def test_a_tetrahedron_by_itself(desk):
    desk("pcdc model new dim 3\npcdc model add node (0,0,0) (1,0,0) (0,1,0) (0,0,1)\npcdc model add element 0 2 1 3\n")
    assert desk.project.whole_mesh().areas() == pytest.approx([1.0 / 6.0])


ADDED = [
    ("model add node (5,5)\npcdc element group 'a'", "point 45 at \\(5, 5\\) belongs to no element"),
    ("model add element 0 1 99", "there is no node 99"),
    ("model add element 0 1 2", "flat"),
    ("model add element 0 1 10 9", "more than two elements|is a duplicate|same side"),
    ("model add element 0 1", "the line ends where"),
    ("element from", "is rejected: a mesh of another program"),
]


@pytest.mark.parametrize(("line", "message"), ADDED)
def test_what_cannot_be_added(desk, line, message):
    with pytest.raises(HpcdemError, match=message):
        desk(QUADS + f"pcdc {line}\npcdc element group 'all'\n")


PARTS = {
    "in the middle": ["(0.7,0.9) (1.9,0.9) (0.7,2.2)"],
    "at a corner": ["(0,0) (1.2,0) (0,0.8)"],
    "at a side": ["(1.1,0) (2.3,0) (1.1,1)"],
    "two that meet": ["(0.5,0.5) (1.5,0.5) (0.5,1.5)", "(1.5,0.7) (2.4,0.7) (1.5,1.9)"],
    "askew": ["(1,0.3) (2.5,0.8) (0.6,1.5)"],
}


@pytest.mark.some_of_each
@pytest.mark.parametrize("name", PARTS)
@pytest.mark.parametrize("split", [True, False])
def test_small_blocks_on_parts_of_large_faces_in_space(desk, name, split):
    """They become one body. Of tetrahedra an elastic stress in it is uniform to rounding; hexahedra that stay beside
    tetrahedra share forces at their corners otherwise."""
    text = f"split = {split}\npcdc model new dim 3\n"
    text += "pcdc element create brick p0 (0,0,0) p1 (3,0,0) p2 (0,3,0) p3 (0,0,1) n 2 1 1 triangle [split]\n"
    for at in PARTS[name]:
        p0, p1, p2 = (one.rstrip(")") + ",1)" for one in at.split())
        p3 = p0.replace(",1)", ",1.6)")
        text += f"pcdc element create brick p0 {p0} p1 {p1} p2 {p2} p3 {p3} n 3 2 1 triangle [split]\n"
    desk(text)
    volume = desk.project.mesh.areas().sum()
    desk("pcdc element glue\n")
    mesh = desk.project.mesh
    check(mesh)
    assert mesh.areas().sum() == pytest.approx(volume, rel=1e-12)
    assert connectivity.bodies(mesh.face_partners()).max() == 0
    desk(
        ROCK
        + """
pcdc node boundary apply mech-vel-b-c v-x 0 range x 0 0
pcdc node boundary apply mech-vel-b-c v-y 0 range y 0 0
pcdc node boundary apply mech-vel-b-c v-z 0 range z 0 0
pcdc element-face boundary apply m-s-b-c stress-xx 3e6 stress-yy 3e6 stress-zz 3e6
pcdc model solve elastic
"""
    )
    for axis in "xyz":
        found = np.array(desk.pcdc.values("element", f"stress-{axis}{axis}"))
        assert found == pytest.approx(3e6, rel=1e-5) if split else found.min() > 0.0


def test_joints_between_fine_and_coarse_elements_break(tmp_path):
    """A bar of quads that is fine in its middle, pulled to half and to one and a half of its tensile strength."""
    for part, broken in ((0.5, False), (1.5, True)):
        desk = Desk(tmp_path)(
            f"pull = {part * 1e6}\n"
            + QUADS
            + "pcdc element densify max-length 0.5 range x 3 5\n"
            + """
pcdc element c-model mech-iso-e property den 2500 y 2e9 p-r 0.25 d-f 0.1
pcdc face-joint c-model c-i-c-i property f 30 c 5e6 t-s 1e6 gf1 5 gf2 50 p-n 2e11 p-s 2e11 range x 2.9 5.1
pcdc node boundary apply mech-vel-b-c v-x 0 range x 0
pcdc table 'slow' data 0 0, 0.04 [pull], 1 [pull]
pcdc element-face boundary apply m-s-b-c s-xx table 'slow' range x 8
pcdc model solve time 0.045
"""
        )
        counts = diagnostics.joint_counts(desk.blocks)
        assert (counts[2] > 0) == broken, counts
        cells = desk.project.mesh.cells
        assert (cells[:, 3] < 0).any() and sum(counts) > 50  # triangles where a coarse quad has points on its sides

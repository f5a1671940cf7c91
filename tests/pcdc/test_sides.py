"""Both sides of a joint: ranges, groups, conditions, histories and values name the one that is meant."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.physics.fdem.sides import SIDE
from tests.pcdc.test_excavation import Desk

MESHES = {
    "tri": "pcdc mesh structured (0,0) (0.1,0.2) cells 1 2 diagonal both",
    "quad": "pcdc mesh structured (0,0) (0.1,0.2) cells 1 2 type quad",
    "tet": "pcdc model new dim 3\npcdc mesh structured (0,0,0) (0.1,0.2,0.1) cells 1 2 1 type tet",
    "hex": "pcdc model new dim 3\npcdc mesh structured (0,0,0) (0.1,0.2,0.1) cells 1 2 1 type hex",
}
ROCK = "pcdc element c-model mech-iso-e property density 2500 young 20e9 poisson-ratio 0\n"
GROUPS = "pcdc element group 'a' range y 0 0.1\npcdc element group 'b' range y 0.1 0.2\n"
JOINT = (
    "pcdc face-joint c-model c-i-c-i property friction 30 cohesion 6e6 tensile-strength 2.4e6 gf1 40 gf2 150 "
    "penalty-normal 8e10 {}\n"
)
STATIC = "pcdc model option dynamic off\n"


def two_blocks(kind: str, joint: bool = True) -> str:
    between = JOINT.format("range between 'a' 'b'") if joint else ""
    return f"{MESHES[kind]}\n{GROUPS}{ROCK}{between}{STATIC}"


def held(word: str, speed: float, where: str, dim: int) -> str:
    along = " velocity-z 0" * (dim == 3)
    return f"pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y {speed}{along} range {where}\n"


def dim_of(kind: str) -> int:
    return 3 if kind in ("tet", "hex") else 2


@pytest.mark.some_of_each
@pytest.mark.parametrize("kind", MESHES)
@pytest.mark.parametrize("said_by", ["face-of", "group of nodes", "elements", "before the joint"])
def test_a_joint_opens_between_two_groups(tmp_path: Path, kind: str, said_by: str):
    """a is held, b goes 1e-7 m in each of ten steps: the joint opens by 1e-6 m."""
    desk, dim = Desk(tmp_path), dim_of(kind)
    desk(two_blocks(kind, joint=said_by != "before the joint"))
    pcdc = desk.pcdc
    of = {"a": "face-of 'a'", "b": "face-of 'b'"}
    if said_by == "group of nodes":
        desk("pcdc node group 'na' range face-of 'a'\npcdc node group 'nb' set 'other' range face-of 'b'\n")
        of = {"a": "group 'na'", "b": "group 'nb' set 'other'"}
    elif said_by == "elements":
        first = {name: pcdc.numbers("element", group=name) for name in "ab"}
        of = {name: f"element {numbers.min()} {numbers.max()}" for name, numbers in first.items()}
    desk(held("a", 0.0, of["a"], dim) + held("b", 1e-7, of["b"], dim))
    if said_by == "before the joint":
        desk(JOINT.format("range between 'a' 'b'"))
    middle = pcdc.numbers("node", y=(0.1, 0.1))
    assert set(middle) <= set(pcdc.numbers("node", face_of="a")) & set(pcdc.numbers("node", face_of="b"))
    desk("pcdc model step 10\n")
    assert pcdc.values("joint", "opening", between=("a", "b")) == pytest.approx(1e-6, rel=1e-9)
    for name, way in (("a", 0.0), ("b", 1e-6)):
        assert pcdc.values("node", "displacement-y", face_of=name) == pytest.approx(way, abs=1e-15)
    of_side = pcdc.values("node", "displacement-y", element=int(pcdc.numbers("element", group="b")[0]))
    assert of_side == pytest.approx(1e-6)
    # What holds a pulls as b does the other way: as the joint does.
    both = [pcdc.total("node", "reaction-y", face_of=name) for name in "ab"]
    size = "length" if dim == 2 else "joint-area"
    pull = pcdc.values("joint", "normal-stress", between=("a", "b")) @ pcdc.values("joint", size, between=("a", "b"))
    assert pull > 0.0 and both == pytest.approx([-pull, pull])
    assert pcdc.total("node", "reaction-y") == pytest.approx(0.0, abs=1e-6 * pull)


def test_where_nothing_parts_the_node_is_one(tmp_path: Path):
    """Without a joint what is said last of a component counts for both sides, and it is taken back from both."""
    desk = Desk(tmp_path)(two_blocks("quad", joint=False))
    desk(held("a", 0.0, "face-of 'a'", 2) + held("b", 1e-7, "face-of 'b'", 2) + "pcdc model step 1\n")
    assert desk.pcdc.values("node", "displacement-y", y=(0.1, 0.2)) == pytest.approx(1e-7)
    desk(held("a", 0.0, "face-of 'a'", 2) + "pcdc model step 1\n")
    assert desk.pcdc.values("node", "displacement-y", y=(0.1, 0.1)) == pytest.approx(1e-7)
    desk("pcdc node boundary remove range face-of 'a'\n")
    blocks = desk.blocks
    blocks.close_model()
    corners = np.flatnonzero(blocks.the_mesh().cells.reshape(-1) >= 0)
    row = blocks.rows_of_nodes(corners, blocks.node)[0]
    y = blocks.the_mesh().points[blocks.the_mesh().cells.reshape(-1)[corners], 1]
    assert (row[y < 0.15] == 0).all() and (row[y > 0.15] > 0).all()


@pytest.mark.parametrize("kind", ["quad", "tet"])
def test_saved_in_between(tmp_path: Path, kind: str):
    """Conditions, groups and histories by side are those of a restored model, bit by bit."""
    dim = dim_of(kind)
    at = "(0.04,0.11{})", "(0.04,0.09{})"
    near = [one.format(",0.03" * (dim == 3)) for one in at]
    script = (
        two_blocks(kind) + "pcdc node group 'nb' range face-of 'b'\n" + held("a", 0.0, "face-of 'a'", dim)
        + f"pcdc history create 'up' node nearest {near[0]} value displacement-y\n"
        f"pcdc history create 'low' node nearest {near[1]} value displacement-y\n"
        "pcdc history create 'pull' node value reaction-y sum range face-of 'b'\n"
        "pcdc history create 'side' node value displacement-y mean range face-of 'b' y 0.1 0.1\n"
    )  # fmt: skip
    more = held("b", 1e-7, "group 'nb'", dim) + "pcdc model step 4\n"
    one = Desk(tmp_path)(script + more + "pcdc model step 4\n")
    (tmp_path / "other").mkdir()
    two = Desk(tmp_path / "other")(script + more + "pcdc model save 'half.sav'\n")
    three = Desk(tmp_path / "other")("pcdc model restore 'half.sav'\npcdc model step 4\n")
    assert two.blocks.sided and three.blocks.sided
    for name in ("up", "low", "pull", "side"):
        assert np.array_equal(one.pcdc.history(name), three.pcdc.history(name)), name
    assert one.pcdc.history("up")[-1, 2] == pytest.approx(8e-7) and one.pcdc.history("low")[-1, 2] == 0.0
    assert one.pcdc.history("side")[-1, 2] == pytest.approx(8e-7) and one.pcdc.history("pull")[-1, 2] > 1e3
    for desk in (one, three):
        desk("pcdc model step 1\n")
    for name in ("position-y", "reaction-y"):
        assert np.array_equal(one.pcdc.values("node", name), three.pcdc.values("node", name))


@pytest.mark.parametrize("kind", MESHES)
def test_a_crack_opens_on_record(tmp_path: Path, kind: str):
    """A crack without a model: histories of its opening and slip, of both sides, and a word where nothing can come."""
    dim = dim_of(kind)
    desk = Desk(tmp_path)
    line = "polyline (0,0.1) (0.1,0.1)" if dim == 2 else "plane (0.05,0.1,0.05) (0,1,0)"
    desk(f"{MESHES[kind]}\npcdc geometry create {line} as-layer 'crack'\npcdc mesh intersect layer 'crack'\n")
    desk(GROUPS + ROCK + STATIC)
    at = ("0.03,{:g}" + ",0.04" * (dim == 3)).format
    desk(
        f"pcdc history create 'open' joint nearest ({at(0.1)}) value opening\n"
        f"pcdc history create 'slip' joint value slip max range crack\n"
        f"pcdc history create 'up' node nearest ({at(0.12)}) value displacement-y\n"
        f"pcdc history create 'low' node nearest ({at(0.08)}) value displacement-y\n"
        + held("a", 0.0, "face-of 'a'", dim) + held("b", 2e-7, "face-of 'b'", dim)
        + "pcdc node boundary mech-vel-b-c velocity-x 1e-7 range face-of 'b'\npcdc model step 10\n"
    )  # fmt: skip
    last = {name: desk.pcdc.history(name)[-1, 2] for name in ("open", "slip", "up", "low")}
    assert last == pytest.approx({"open": 2e-6, "slip": 1e-6 if dim == 3 else -1e-6, "up": 2e-6, "low": 0.0}, abs=1e-14)
    if kind == "quad":
        lone = desk.pcdc.numbers("joint", crack=True)[0]
        desk.blocks.log = desk.log
        desk(f"pcdc history create 'no' joint id {lone} value normal-stress\n")
        assert any("normal-stress is nan until face-joint c-model" in line for line in desk.log.lines)


def test_forces_of_one_side(tmp_path: Path):
    """A force on the nodes of b is shared by the corners of b, whatever a has there; both can have one."""
    desk = Desk(tmp_path)(two_blocks("tri"))
    desk("pcdc node boundary mech-f-b-c force-y 8 range face-of 'b' y 0.1 0.1\n")

    def pushed() -> list[float]:
        return [desk.pcdc.total("node", "unbalanced-y", face_of=name) for name in "ab"]

    assert pushed() == pytest.approx([0.0, 16.0])
    desk("pcdc node boundary mech-f-b-c force-y -3 range face-of 'a' y 0.1 0.1\n")
    assert pushed() == pytest.approx([-6.0, 16.0])
    desk("pcdc node boundary mech-f-b-c force-x 5 range y 0.1 0.1\n")
    assert pushed() == pytest.approx([-6.0, 16.0])
    assert desk.pcdc.total("node", "unbalanced-x") == pytest.approx(10.0)
    desk("pcdc node boundary mech-f-b-c force-y 0 range face-of 'a'\n")
    assert pushed() == pytest.approx([0.0, 16.0])
    desk("pcdc node boundary mech-f-b-c force-y 1 range y 0.1 0.1\n")
    assert sum(pushed()) == pytest.approx(2.0)


def test_nodes_of_two_groups_are_both_sides(tmp_path: Path):
    """Where both groups meet: nodes of both; a group of nodes keeps the side, and loses it to another one."""
    desk = Desk(tmp_path)(two_blocks("quad"))
    desk(
        "pcdc node group 'rim' set 's' range face-of 'a' face-of 'b'\n"
        "pcdc node group 'of a' range face-of 'a'\npcdc node group 'b side' range face-of 'b' y 0.1 0.1\n"
        "pcdc node group 'taken' range x 0 0\n"
    )
    sets = desk.project.groups["node"].sets
    middle = desk.pcdc.numbers("node", y=(0.1, 0.1))
    assert sets["s"]["rim"].tolist() == middle.tolist()
    left, right = (desk.pcdc.numbers("node", x=(x, x), y=(0.1, 0.1))[0] for x in (0.0, 0.1))
    cells = desk.project.mesh.cells
    for name, element in (("of a", 0), ("b side", 1)):
        numbers = sets["default"][name]
        assert (numbers[numbers >= SIDE] - SIDE).tolist() == [4 * element + cells[element].tolist().index(right)]
    assert left in sets["default"]["taken"]
    with pytest.raises(HpcdemError, match="there is no element 7; numbers range from 0 to 1"):
        desk("pcdc node group 'x' range element 7\n")

"""Excavate, then line: ranges after elements were taken out, on the real simulation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.fdem import Project
from hpcdem.core.errors import HpcdemError
from hpcdem.lang.pcdc.execute import Interpreter
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from tests.pcdc.fake import Noted

BOX = """
pcdc mesh structured (0,0) (6,4) cells 6 4 diagonal right group 'rock' set 'domain'
pcdc geometry create rectangle (2,1) (4,3) as-layer 'outline'
pcdc geometry create rectangle (2.9,1) (4,3) as-layer 'half'
pcdc element group 'void' set 'stage' range geometry 'outline'
pcdc element c-model mech-iso-e property density 2500 young 20e9 p-r 0.2
pcdc face-joint c-model c-i-c-i property cohesion 8e6 tensile-s 3e6 gf1 100 gf2 500 friction 30
pcdc element-face c-model contact-m-c property friction 30
pcdc element initial stress-xx -2e6 stress-yy -4e6
pcdc model option dynamic off
pcdc node boundary mech-m-b-c type 1 range boundary
pcdc history create 'all' element value stress-yy min every 10
"""
OUT = BOX + "pcdc element c-model null range group 'void' set 'stage'\npcdc model step 200\n"


class Desk:
    """Scripts on a real model on one rank."""

    def __init__(self, folder: Path) -> None:
        self.log = Noted()
        self.blocks = Blocks(outdir=folder / "data", log=None)
        self.project = Project(self.blocks, folder, folder / "data")
        self.interpreter = Interpreter(self.project)
        self.count = 0

    def __call__(self, text: str) -> Desk:
        self.count += 1
        self.interpreter.run(self.interpreter.read(text, f"part{self.count}.sc"))
        return self

    @property
    def pcdc(self):
        return self.interpreter.namespace["pcdc"]


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path)


AFTERWARDS = [
    "face-joint property tensile-s 1e6",
    "face-joint property tensile-s 1e6 range x 1 5",
    "face-joint property cohesion 1e6 range y 1 1",
    "face-joint c-model c-i-c-i property cohesion 1e6 tensile-s 1e6 gf1 10 gf2 10 range y 0 4",
    "element property young 10e9 range x 0 6",
    "element property density 2000 range group 'rock' set 'domain'",
    "element initial stress-xx -1e6 range id 0 99",
    "element-face c-model contact-m-c property friction 20 range geometry 'outline'",
    "element-face property friction 10",
    "element-face property friction 10 range x 0 6",
    "element-face boundary m-s-b-c stress-normal -1e5 range geometry 'outline'",
    "element-face boundary remove range x 0 6",
    "node boundary mech-m-b-c type 1 range x 0 6",
    "node boundary remove range x 0 6",
    "node initial velocity (0,0) range geometry 'outline'",
    "node boundary mech-vel-b-c velocity-x 0 range x 2 4 y 1 3",
    "history create 'more' node value position-x mean range x 2 4",
    "mesh intersect layer 'half' follow",
]


@pytest.mark.parametrize("line", AFTERWARDS)
def test_ranges_that_touch_what_was_removed(desk, line):
    """Each acts on what is there, and the model runs on."""
    desk(OUT + f"pcdc {line}\npcdc model step 5\n")
    assert not np.isnan(diagnostics.values(desk.blocks, "position_x")[desk.blocks.node_exists()]).any()


def test_what_was_chosen_is_what_is_there(desk):
    desk(OUT)
    blocks, pcdc = desk.blocks, desk.pcdc
    assert len(pcdc.numbers("element")) == int(blocks.alive.sum()) == 48 - 8
    assert len(pcdc.numbers("node")) == 35 - 1 == int(blocks.node_exists().sum())
    assert len(pcdc.numbers("joint")) == int(blocks.joint_exists().sum())
    assert not np.isnan(pcdc.values("element", "stress-yy")).any() and len(pcdc.values("joint", "damage")) == len(
        pcdc.numbers("joint")
    )
    assert not np.isnan(pcdc.values("node", "reaction-x")).any()
    assert sum(diagnostics.joint_counts(blocks)) == int(blocks.joint_exists().sum())
    desk("pcdc element property young 5e9 range x 1 5\n")
    young = np.array(blocks.element_rows.column("young"))[blocks.element_row]
    centre = blocks.mesh.centroids()[:, 0]
    assert (young[blocks.alive & (centre > 1) & (centre < 5)] == 5e9).all() and (young[~blocks.alive] == 20e9).all()
    assert desk.pcdc.history("all")[-1, 2] == pytest.approx(np.nanmin(diagnostics.values(blocks, "stress_yy")))


@pytest.mark.parametrize(
    ("line", "message"),
    [("element property young 1e9 range group 'void' set 'stage'", r"no element: all that it selects \(8\) was"),
     ("element property young 1e9 range id 18", r"element 18 was removed \(element c-model null\)"),
     ("node boundary mech-m-b-c type 1 range x 3 3 y 2 2", r"selects no node: all that it selects \(1\) was removed"),
     ("face-joint property gf1 3 range face-of 'void' set 'stage'", "selects no face-joint: all that it selects"),
     ("element property young 1e9 range id 480", "there is no element 480; numbers range from 0 to 47"),
     ("history create 'one' element id 18 value stress-xx", "element 18 was removed"),
     ("element c-model null range group 'void' set 'stage'", "selects no element: all that it selects")],
)  # fmt: skip
def test_what_is_gone_is_reported_to_be_gone(desk, line, message):
    with pytest.raises(HpcdemError, match=message):
        desk(OUT + f"pcdc {line}\n")


@pytest.mark.parametrize(
    ("before", "line", "message"),
    [("", "face-joint property tensile-s 1e6", "no face-joint has a model whose properties could be changed"),
     ("", "element-face property friction 20", "no element-face has a model whose properties could be changed"),
     ("", "element property young 1e9", "element 0 has no model whose properties could be changed"),
     ("pcdc element c-model mech-iso-e property density 2500 young 20e9 p-r 0.2\n",
      "face-joint property gf1 9 range x 1 2", "face-joint 1 has no model")],
)  # fmt: skip
def test_a_property_where_no_model_is(desk, before, line, message):
    with pytest.raises(HpcdemError, match=message):
        desk("pcdc mesh structured (0,0) (6,4) cells 6 4 diagonal right\n" + before + f"pcdc {line}\n")


def test_excavate_then_line(desk):
    """A lining of half the void: it carries only what comes after it, and its joints can be told from the others."""
    desk(OUT + "pcdc element group 'lining' set 'stage' range geometry 'half'\n")
    void = desk.project.groups["element"].members("void", "stage")
    lining = desk.project.groups["element"].members("lining", "stage")
    before = diagnostics.values(desk.blocks, "stress_yy", np.flatnonzero(desk.blocks.alive))
    stay = np.flatnonzero(desk.blocks.alive)
    desk("pcdc element c-model mech-iso-e property density 2400 young 30e9 p-r 0.2 range group 'lining' set 'stage'\n")
    assert desk.project.alive[lining].all() and not desk.project.alive[void].any()
    assert np.array_equal(desk.project.alive, desk.blocks.alive)
    assert np.array_equal(diagnostics.values(desk.blocks, "stress_yy", stay), before)
    assert np.abs(diagnostics.values(desk.blocks, "stress_yy", lining)).max() < 1e-3
    desk(
        "pcdc face-joint c-model c-i-c-i property cohesion 4e6 tensile-s 2e6 gf1 50 gf2 90 range "
        "face-of 'lining' set 'stage'\n"
        "pcdc model save 'lined.sav'\n"
        "pcdc element-face boundary m-s-b-c stress-normal -2e5 range geometry 'outline'\npcdc model step 300\n"
    )
    carried = diagnostics.values(desk.blocks, "stress_yy", lining)
    assert np.abs(carried).max() > 1e3
    again = Desk(desk.project.directory)
    again(
        "pcdc model restore 'lined.sav'\n"
        "pcdc element-face boundary m-s-b-c stress-normal -2e5 range geometry 'outline'\npcdc model step 300\n"
    )
    assert np.array_equal(diagnostics.values(again.blocks, "stress_yy", lining), carried)
    assert np.array_equal(again.project.alive, desk.project.alive)


def test_places_are_those_of_the_mesh_unless_it_says_present(desk):
    desk("pcdc mesh structured (0,0) (1,1) cells 1 1 diagonal right group 'a'\n"
         "pcdc mesh structured (3,0) (4,1) cells 1 1 diagonal right group 'b'\n"
         "pcdc geometry create rectangle (2.4,-1) (5,2) as-layer 'box'\n"
         "pcdc element c-model mech-iso-e property density 2500 young 20e9 p-r 0.2\n"
         "pcdc node initial velocity (100,0) range face-of 'a'\n")  # fmt: skip
    while desk.pcdc.node(0).position.X < 1.6:
        desk("pcdc model step 10\n")
    pcdc = desk.pcdc
    for kind, b in (("element", [2, 3]), ("node", [4, 5, 6, 7]), ("joint", [10])):
        both = sorted([*b, *{"element": [0, 1], "node": [0, 1, 2, 3], "joint": [2]}[kind]])
        desk(
            f"pcdc {'face-joint' if kind == 'joint' else kind} group 'mesh' set 's' range x 1.5 5\n"
            f"pcdc {'face-joint' if kind == 'joint' else kind} group 'now' set 't' range x 1.5 5 present\n"
        )
        assert pcdc.numbers(kind, group="mesh", set="s").tolist() == b
        assert pcdc.numbers(kind, group="now", set="t").tolist() == both
    desk("pcdc element group 'in' set 'u' range geometry 'box'\npcdc element group 'in now' set 'v' "
         "range geometry 'box' present\n")  # fmt: skip
    assert pcdc.numbers("element", group="in", set="u").tolist() == [2, 3]
    desk("pcdc element-face group 'f' set 'w' range x 1.5 2.8 present\n")
    assert {f // 4 for f in pcdc.numbers("face", group="f", set="w")} == {0, 1}
    with pytest.raises(HpcdemError, match="selects elements by their present centres"):
        desk("pcdc node group 'x' range geometry 'box' present\n")
    with pytest.raises(HpcdemError, match="present needs x, y or geometry"):
        desk("pcdc node group 'x' range group 'a' present\n")

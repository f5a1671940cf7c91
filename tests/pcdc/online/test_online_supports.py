"""Bolts and supports from point to point, and fluid said of elements."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.physics.bolts.model import Bolts
from hpcdem.physics.flow.model import Flow
from tests.pcdc.test_excavation import Desk


@pytest.fixture
def desk(tmp_path) -> Desk:
    return Desk(tmp_path)


ROCK = """
pcdc element create brick p0 (0,0) p1 (6,0) p2 (0,6) n 6 6 triangle off
pcdc element c-model mech-iso-e property den 2500 y 2e9 p-r 0.25
pcdc model option dynamic off
pcdc node boundary apply mech-vel-b-c v-y 0 range y 0 0
pcdc node boundary apply mech-vel-b-c v-x 0 range x 0 0
pcdc element-face boundary apply m-s-b-c s-n 1e6 range y 6 6
"""
STEEL = ("c-model mech-e-p property den 7850 y 200e9 diameter 0.03 t-y-f 2e5 s-s-r-b 1e9 grout-thickness 0.02 "
         "c-r-g 1e6 c-g-b 1e6 spac 1\n")  # fmt: skip


def bars(desk: Desk) -> np.ndarray:
    return Bolts.there(desk.blocks).nodes["x"]


def test_a_bolt_in_the_rock_is_that_of_bolt_create(tmp_path):
    found = []
    for words in ("bolt-element create (2.3,1.2) (2.9,4.7) m-s 0.3",
                  "support-element create (2.3,1.2) (2.9,4.7) m-s 0.3",
                  "bolt create polyline (2.3,1.2) (2.9,4.7) length 0.3"):  # fmt: skip
        element = "bolt" if words.startswith("bolt create") else words.split()[0]
        desk = Desk(tmp_path)(ROCK + f"pcdc {words}\npcdc {element} " + STEEL + "pcdc model step 200\n")
        found.append((bars(desk), np.array(desk.pcdc.values("bolt-element", "axial-force"))))
    assert np.abs(found[2][1]).max() > 0.0
    for other in found[:2]:
        assert (other[0] == found[2][0]).all() and (other[1] == found[2][1]).all()


def test_what_is_outside_is_cut_off(desk):
    desk(ROCK + "pcdc element c-model null range x 2 4 y 2 4\n"
         "pcdc bolt-element create (-1,3) (7,3) m-s 0.5 group 'b' set 's'\n")  # fmt: skip
    x = bars(desk)
    assert x[:, 1] == pytest.approx(np.full(len(x), 3.0))
    bolts = Bolts.there(desk.blocks)
    assert sorted(set(bolts.nodes["bar"].ravel().tolist())) == [0, 1]
    assert x[:, 0].min() == pytest.approx(0.0) and x[:, 0].max() == pytest.approx(6.0)
    assert not ((x[:, 0] > 2.0 + 1e-9) & (x[:, 0] < 4.0 - 1e-9)).any()
    assert (bolts.nodes["host"] >= 0).all()
    assert len(desk.project.groups["bolt-element"].members("b", "s")) == 8


def test_only_in_elements_of_a_range(desk):
    desk(ROCK + "pcdc bolt-element create (-1,3.5) (7,3.5) range x 2 5\n")
    x = bars(desk)[:, 0]
    assert x.min() == pytest.approx(2.0) and x.max() == pytest.approx(5.0) and np.diff(x).max() <= 0.2 + 1e-12


def test_in_space(desk):
    desk("pcdc model new dim 3\npcdc element create brick p0 (0,0,0) p1 (3,0,0) p2 (0,3,0) p3 (0,0,3) n 3 3 3\n"
         "pcdc element c-model mech-iso-e property den 2500 y 2e9 p-r 0.25\n"
         "pcdc bolt-element create (1.4,1.3,-2) (1.4,1.3,2.5) m-s 0.25\n")  # fmt: skip
    x = bars(desk)
    assert x[:, 2].min() == pytest.approx(0.0) and x[:, 2].max() == pytest.approx(2.5)


def test_nodes_of_supports_have_conditions_and_groups(desk):
    desk(
        ROCK
        + "pcdc support-element create (3.2,2.1) (3.2,5.9)\npcdc support-element "
        + STEEL
        + """
pcdc support-node group 'head' range y 5.8 6
pcdc support-node boundary apply s-n-f-b-c force-y -1e4 range group 'head'
pcdc support-element group 'all'
pcdc model step 100
"""
    )
    before = np.array(desk.pcdc.values("bolt-element", "axial-force"))
    desk("pcdc support-node boundary remove range group 'head'\npcdc model step 300\n")
    after = np.array(desk.pcdc.values("bolt-element", "axial-force"))
    assert before[-1] < after[-1]
    assert len(desk.project.groups["bolt-element"].members("all")) == len(after)


WATER = "hydr-p-m f-den 1000 f-bulk 2e9 visc 1e-6 a-i 1e-4 a-min 1e-5 a-max 1e-3"


def test_fluid_said_of_elements_is_in_the_joints_around_them(tmp_path):
    desk = Desk(tmp_path)(ROCK + f"pcdc element c-model {WATER} range x 2 3 y 2 3\n")
    joints = Flow.there(desk.blocks).network.channels
    assert len(joints) == 4
    ends = desk.project.mesh.points[desk.project.mesh.face_points(joints)]
    assert ends.min() == 2.0 and ends.max() == 3.0
    every = Desk(tmp_path)(ROCK + f"pcdc element c-model {WATER}\n")
    other = Desk(tmp_path)(ROCK + f"pcdc face-joint c-model {WATER}\n")
    assert (Flow.there(every.blocks).network.channels == Flow.there(other.blocks).network.channels).all()


HOSTILE = [
    ("bolt-element create (10,1) (12,1)", "no part of the bolt lies in the rock"),
    ("bolt-element create (1,1) (1,1)", "coincide"),
    ("bolt-element create (1,1) (2,2) m-s 0", "above 0"),
    ("bolt-element create (1,1) (2,2) m-s 1e-12", "more than"),
    ("bolt-element create (1,1)", "the line ends where a vector"),
    ("support-node boundary apply s-n-c velocity-x 0", "no bolt"),
]


@pytest.mark.parametrize(("line", "message"), HOSTILE)
def test_what_is_refused(desk, line, message):
    with pytest.raises(HpcdemError, match=message):
        desk(ROCK + f"pcdc {line}\n")

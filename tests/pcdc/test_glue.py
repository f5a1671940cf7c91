"""Bodies that were meshed separately are glued: coincident faces become joints."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.fdem import groups as g
from hpcdem.physics.fdem.mesh import check
from hpcdem.pre.mesh.glue import glued
from tests.blocks.support import joined, rectangle
from tests.pcdc.test_excavation import Desk

TWO = """
pcdc mesh structured (0,0) (2,1) cells 4 2 diagonal right group 'a' set 'bodies'
pcdc mesh structured (2,0) (4,1) cells 4 2 diagonal right group 'b' set 'bodies'
"""
ONE = "pcdc mesh structured (0,0) (4,1) cells 8 2 diagonal right group 'a' set 'bodies'\n"
PULL = """
pcdc element c-model mech-iso-e property density 2500 young 20e9 p-r 0.2
pcdc model option dynamic off
pcdc node boundary mech-m-b-c type 1 range x 0 0
pcdc node boundary mech-f-b-c force-x 1e4 range x 4 4
pcdc model solve elastic
"""


@pytest.fixture
def desk(tmp_path) -> Desk:
    return Desk(tmp_path)


def test_two_halves_are_a_whole(desk, tmp_path):
    desk(TWO + "pcdc node group 'end' set 'n' range x 2 2\npcdc mesh glue\n" + PULL)
    mesh = desk.project.mesh
    check(mesh)
    assert len(mesh.points) == 27 and len(mesh.cells) == 32
    assert len(desk.pcdc.numbers("node", group="end", set="n")) == 3
    whole = Desk(tmp_path)(ONE + PULL)
    one, two = (
        dict(zip(map(tuple, np.round(d.project.mesh.points, 9).tolist()), d.pcdc.values("node", "displacement-x")))
        for d in (desk, whole)
    )
    assert one.keys() == two.keys() and max(one.values()) > 1e-6
    for p, u in one.items():
        assert u == pytest.approx(two[p], rel=1e-9, abs=1e-18)


def test_without_it_they_part_and_with_a_joint_they_hold_up_to_its_strength(desk, tmp_path):
    with pytest.raises(HpcdemError, match=r"the body of 16 elements .* can move"):
        desk(TWO + PULL)
    joint = "pcdc face-joint c-model c-i-c-i property cohesion 9e6 tensile-s [t] gf1 0.05 gf2 50 pen-n 1e12 range " \
            "between 'a' 'b' set 'bodies'\n"  # fmt: skip
    loads = PULL.replace("pcdc model solve elastic\n", joint + "pcdc model step 4000\n")
    for t, broken in ((1e5, 0), (1e4, 2)):
        found = Desk(tmp_path)(f"t = {t}\n" + TWO + "pcdc mesh glue between 'a' 'b' set 'bodies'\n" + loads)
        assert diagnostics.joint_counts(found.blocks)[2] == broken, t  # the bar carries 3e4 Pa


def test_what_is_reported(desk):
    desk.project.blocks.log = desk.log
    desk(TWO + "pcdc mesh structured (0,1) (2,2) cells 4 2 diagonal right group 'c' set 'bodies'\npcdc mesh glue\n")
    assert "glue: 6 faces of different bodies are joints now, 8 points were merged" in desk.log.lines[-1]


def test_only_those_between_two_groups(desk):
    desk(TWO + "pcdc mesh structured (0,1) (2,2) cells 4 2 diagonal right group 'c' set 'bodies'\n"
         "pcdc mesh glue between 'a' 'c' set 'bodies'\n")  # fmt: skip
    from hpcdem.commands.fdem.choices import chosen

    assert len(chosen(desk.project, g.JOINT, (g.Between("a", "c", "bodies"),))) == 4
    with pytest.raises(HpcdemError, match="selects no face-joint"):
        chosen(desk.project, g.JOINT, (g.Between("a", "b", "bodies"),))


@pytest.mark.parametrize(
    ("second", "line", "message"),
    [("(2.1,0) (4,1) cells 4 2", "", "no faces of different bodies coincide within 0.0004[0-9]* m"),
     ("(2,0) (4,1) cells 4 2", "tolerance 0.6", "too large: points .* of one element"),
     ("(1,0) (2,1) cells 2 2", "", "lie on the same side of their common face at"),
     ("(2,1) (4,2) cells 4 2", "", "no faces of different bodies coincide"),
     ("(2,0) (4,1) cells 4 2", "between 'a' 'a' set 'bodies'", "no faces of different bodies coincide"),
     ("(2,0) (4,1) cells 4 2", "between 'a' 'z' set 'bodies'", "has no group 'z' of elements")],
)  # fmt: skip
def test_refusals(desk, second, line, message):
    with pytest.raises(HpcdemError, match=message):
        desk("pcdc mesh structured (0,0) (2,1) cells 4 2 diagonal right group 'a' set 'bodies'\n"
             f"pcdc mesh structured {second} diagonal right group 'b' set 'bodies'\n"
             f"pcdc mesh glue {line}\n")  # fmt: skip
    assert not desk.project.in_use


@pytest.mark.some_of_each
@pytest.mark.parametrize(("second", "joints"), [("(2,0) (4,1) cells 4 3", 4), ("(2,0.25) (4,1.25) cells 4 2", 3)])
@pytest.mark.parametrize("kind", ["tri", "quad"])
def test_edges_of_other_lengths(desk, second, joints, kind):
    """Points at 0, 1/2, 1 meet 0, 1/3, 2/3, 1, or 1/4, 3/4, 5/4 (one of these is beyond the edge)."""
    desk("pcdc mesh structured (0,0) (2,1) cells 4 2 type quad group 'a' set 'bodies'\n"
         f"pcdc mesh structured {second} type {kind} diagonal right group 'b' set 'bodies'\n")  # fmt: skip
    before, area = len(desk.project.mesh.cells), desk.project.mesh.areas().sum()
    desk("pcdc mesh glue\npcdc face-joint group 'seam' set 'j' range between 'a' 'b' set 'bodies'\n")
    mesh = desk.project.mesh
    check(mesh)
    assert (
        mesh.areas().sum() == pytest.approx(area) and len(desk.pcdc.numbers("joint", group="seam", set="j")) == joints
    )
    assert sum(len(desk.pcdc.numbers("element", group=name, set="bodies")) for name in "ab") == len(mesh.cells) > before


def test_the_tolerance_decides(desk):
    text = ("pcdc mesh structured (0,0) (2,1) cells 4 2 diagonal right\n"
            "pcdc mesh structured (2.003,0) (4,1) cells 4 2 diagonal right\n")  # fmt: skip
    with pytest.raises(HpcdemError, match="no faces of different bodies coincide within"):
        desk(text + "pcdc mesh glue tolerance 0.002\n")
    desk("pcdc mesh glue tolerance 0.004\n")
    x = desk.project.mesh.points[:, 0]
    assert (np.abs(x - 2.0) < 0.1).sum() == 3 and (x[np.abs(x - 2.0) < 0.1] == 2.0).all()


def test_it_comes_before_models(desk):
    with pytest.raises(HpcdemError, match="bodies are glued before the first of them is assigned"):
        desk(TWO + "pcdc element c-model mech-iso-e property density 2500 young 20e9 p-r 0.2\npcdc mesh glue\n")


def test_bodies_that_share_a_corner_only_stay_apart_there():
    """Four squares, three of them glued in a chain: the point in the middle is one for those that share faces."""
    four = joined(*(rectangle(1, 1, 1.0, 1.0, x0=x, y0=y) for x, y in ((0, 0), (1, 0), (0, 1), (1, 1))))
    made = glued(four, between=(np.arange(8) < 2, np.arange(8) < 6))
    assert made.faces == 2 and (np.hypot(*(made.mesh.points - 1.0).T) < 1e-9).sum() == 2
    assert glued(four).faces == 4 and len(glued(four).mesh.points) == 9


CUBE = """
pcdc model new dim 3
pcdc mesh structured (0,0,0) (1,1,1) cells {} type {} group 'a' set 'bodies'
pcdc mesh structured (0,0,1) (1,1,2) cells {} type {} group 'b' set 'bodies'
pcdc mesh glue
pcdc element c-model mech-iso-e property density 2500 young 1e9 p-r 0
pcdc model option dynamic off
pcdc node boundary mech-m-b-c type 1 range z 0 0
pcdc element-face boundary m-s-b-c stress-zz 1e6 range z 2 2
pcdc model solve elastic
"""


SEAMS = [
    (("1 1 1", "tet"), ("2 2 1", "tet"), 1e-12),
    (("3 2 1", "hex"), ("2 3 1", "tet"), 1e-12),
    (("2 2 1", "hex"), ("2 2 1", "tet split 5"), 3e-5),
]
"""Below, above, and how far off [m]: hexahedra next to tetrahedra share loads differently (docs/blocks_space.md)."""


@pytest.mark.parametrize(("below", "above", "off"), SEAMS)
def test_a_uniform_pull_goes_through_the_seam(desk, below, above, off):
    """u = sigma z / E at every node, whatever the pieces: 1e6 / 1e9 = 1e-3 per metre."""
    desk(CUBE.format(*below, *above))
    z = desk.project.mesh.points[:, 2]
    np.testing.assert_allclose(desk.pcdc.values("node", "displacement-z"), 1e-3 * z, rtol=0.0, atol=off)

"""`mesh quadratic`: what becomes of groups and faces, when it is refused, what an import says of it."""

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.lang.pcdc import check
from hpcdem.physics.fdem import groups as g
from hpcdem.pre.mesh import imported

MESH = """
pcdc mesh structured (0,0) (2,1) cells 2 1 diagonal left group 'rock'
pcdc node group 'left' range x 0 0
pcdc element-face group 'top' range y 1 1
pcdc mesh quadratic
"""


def test_groups_take_what_is_new_on_them(bench):
    bench(MESH)
    project = bench.project
    mesh, groups = project.mesh, project.groups
    assert len(mesh.macros) == 4 and len(mesh.points) == 6 + 9
    left = groups[g.NODE].members("left", g.DEFAULT)
    assert left.tolist() == np.flatnonzero(mesh.points[:, 0] == 0.0).tolist() and len(left) == 3
    top = groups[g.FACE].members("top", g.DEFAULT)
    assert len(top) == 4 and (mesh.points[mesh.face_points(top)][:, :, 1] == 1.0).all()
    assert len(groups[g.ELEMENT].members("rock", g.DEFAULT)) == 16
    assert any("4 six-node triangles of 4 elements each, 15 points" in line for line in bench.blocks.log.lines)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("mesh quadratic", "already has six-node triangles"),
        ("element c-model mech-iso-elastic property den 2500 young 1e9 poisson-r 0.2\npcdc mesh quadratic", "before"),
    ],
)
def test_twice_and_late_are_refused(bench, more, message):
    with pytest.raises(HpcdemError, match=message):
        bench(f"{MESH}pcdc {more}\n")


def test_a_line_inside_them_cracks_nothing_unless_it_is_followed(bench):
    """The middle of a row of six-node triangles is a line of edges inside them."""
    line = "pcdc geometry create polyline (0,0.25) (2,0.25) as-layer 'l'\npcdc mesh intersect layer 'l'"
    mesh = "pcdc mesh structured (0,0) (2,1) cells 4 2 diagonal right\npcdc mesh quadratic\n"
    with pytest.raises(HpcdemError, match="no joint lies on layer 'l'; follow uses"):
        bench(f"{mesh}{line}\n")
    bench(f"pcdc model new\n{mesh}{line} follow\n")
    made = bench.project.mesh
    rows = made.find_edges(edges := made.edges(), made.cracks)
    assert len(rows) and not made.inside_macros(edges.faces[rows, 0]).any()


def test_an_import_of_second_order_names_the_command(tmp_path):
    nodes = "1,0,0\n2,1,0\n3,0,1\n4,.5,0\n5,.5,.5\n6,0,.5\n"
    (tmp_path / "a.inp").write_text(f"*NODE\n{nodes}*ELEMENT, TYPE=CPE6\n1,1,2,3,4,5,6\n")
    found = imported.read(tmp_path / "a.inp")
    assert len(found.mesh.points) == 3
    assert any("their edges are straight; mesh quadratic makes six-node triangles" in note for note in found.notes)


ELEMENTS = "element c-model {} property den 2500 young 1e9 poisson-r 0.2"


@pytest.mark.parametrize(
    ("line", "refused"),
    [
        (ELEMENTS.format("mech-mohr-coulomb") + " cohesion 1e6 friction 30", True),
        (ELEMENTS.format("mech-burgers") + " maxwell-viscosity 1e15", True),
        (ELEMENTS.format("user 'clay.py:clay'"), True),
        ("element property young table 't' over temperature", True),
        (ELEMENTS.format("mech-iso-elastic"), False),
        ("element c-model thermal-iso-heat property conductivity 2.5 capacity 900", False),
        ("element c-model null range group 'hole'", False),
    ],
)
def test_check_knows_what_six_node_triangles_cannot_have(line, refused):
    """Before anything is run; where a range, a loop or a choice leaves it open, as a warning."""
    said = "line 5, mesh quadratic, makes six-node triangles, which can have"
    if not refused:
        assert said not in check.summary(f"{MESH}pcdc {line}\n", "a.sc")
        return
    with pytest.raises(HpcdemError, match=rf"^a.sc:6: .*{said}"):
        check.summary(f"{MESH}pcdc {line}\n", "a.sc")
    assert f"warning: line 6: {said}" in check.summary(f"{MESH}pcdc {line} range x 0 1\n", "a.sc")
    assert f"warning: line 7: {said}" in check.summary(f"{MESH}if True:\n    pcdc {line}\n", "a.sc")
    assert said not in check.summary(f"{MESH}pcdc model new\npcdc {line}\n", "a.sc")

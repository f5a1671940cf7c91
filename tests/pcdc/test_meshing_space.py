"""Meshes in three dimensions as scripts ask for them: networks, cracks, groups of bodies, files."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.fdem.choices import chosen
from hpcdem.core.errors import HpcdemError
from hpcdem.physics.fdem import groups as g
from tests.conftest import absent
from tests.mesh.test_solids import CUBE, stl


@pytest.fixture(autouse=True)
def needs_gmsh():
    for name in ("gmsh", "shapely"):
        if importlib.util.find_spec(name) is None:
            absent(name, f"no package {name} here: install the extra [mesh]")


NETWORK = """
pcdc model new dim 3
pcdc geometry create box (0,0,0) (2,2,2) as-layer 'rock'
pcdc geometry create fractures orientation fisher 30 spread 30 towards 90 radius power 3 least 0.3 greatest 0.6 \\
    p32 0.5 reached inside 'rock' seed 2 as-layer 'set 1'
pcdc geometry create plane (0,0,0.5) (0,0.1,1) as-layer 'fault'
"""
JOINTS = """
pcdc element c-model mech-iso-e property density 2700 young 50e9 poisson-ratio 0.25
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 8e6 tensile-strength 2e6 gf1 50 gf2 200 p-n 5e11
pcdc face-joint group 'set 1' range geometry 'set 1'
pcdc face-joint group 'fault' range geometry 'fault'
pcdc face-joint property friction 12 range group 'fault'
"""


def test_a_network_that_is_cut_in(bench):
    """Joints of the network have their group and their properties, and are cracks; those of an embedded plane not."""
    bench(NETWORK + "pcdc mesh create from-layer 'rock' size 0.5 crack 'set 1' embed 'fault'\n" + JOINTS)
    project = bench.project
    mesh = project.mesh
    cracked, of_set, of_fault = (
        chosen(project, g.JOINT, (term,))
        for term in (g.OnCrack(), g.InGroup("set 1", g.DEFAULT), g.InGroup("fault", g.DEFAULT))
    )
    assert len(of_set) > 20 and set(of_set) - set(of_fault) == set(cracked) - set(of_fault)
    assert mesh.face_sizes(of_fault).sum() == pytest.approx(4.0 * math.sqrt(1.01), rel=1e-6)
    assert 0.3 < mesh.face_sizes(of_set).sum() / 8.0 < 0.55
    assert any(line.startswith("layer 'set 1': ") for line in bench.blocks.log.lines)


def test_a_network_that_is_followed(bench):
    bench(NETWORK + "pcdc mesh structured (0,0,0) (2,2,2) cells 8 8 8\npcdc mesh intersect layer 'set 1' follow\n"
          + "".join(line for line in JOINTS.splitlines(True) if "fault" not in line))  # fmt: skip
    project = bench.project
    cracked = chosen(project, g.JOINT, (g.OnCrack(),))
    assert len(cracked) and set(cracked) == set(chosen(project, g.JOINT, (g.InGroup("set 1", g.DEFAULT),)))
    bench("pcdc geometry create plane (1,1,1) (0,0,1) as-layer 'middle'\npcdc mesh intersect layer 'middle'\n")
    added = np.setdiff1d(chosen(project, g.JOINT, (g.OnCrack(),)), cracked)
    assert 64 <= len(added) <= 128 and np.allclose(project.mesh.points[project.mesh.face_points(added)][:, :, 2], 1.0)


def test_bodies_are_groups(bench, tmp_path: Path):
    stl(tmp_path / "cube.stl", CUBE)
    bench(
        "pcdc model new dim 3\n"
        f"pcdc geometry import '{tmp_path / 'cube.stl'}' as-layer 'part'\n"
        "pcdc geometry create cone (1,0.5,0.5) (2,0.5,0.5) 0.4 0.2 as-layer 'part'\n"
        "pcdc geometry create polygon (0.2,0.2,1) (0.8,0.2,1) (0.8,0.8,1) as-layer 'rim'\n"
        "pcdc geometry create extrude layer 'rim' along (0,0,1) as-layer 'part'\n"
        "pcdc geometry create revolve layer 'rim' axis (1,0,0) about (0,0.2,1) angle 90 as-layer 'turned'\n"
        "pcdc mesh create from-layer 'part' size 0.5 bodies set 'body'\n".replace(
            " set 'body'", " group 'x' set 'body'"
        )
    )
    groups, mesh = bench.project.groups[g.ELEMENT], bench.project.mesh
    volumes = [float(mesh.areas()[groups.members(f"part {k}", "body")].sum()) for k in (1, 2, 3)]
    assert volumes == pytest.approx([1.0, 0.28 / 3.0 * math.pi, 0.18], rel=0.25)
    assert len(mesh.cells) == sum(len(groups.members(f"part {k}", "body")) for k in (1, 2, 3))
    assert len(bench.project.layers["turned"]) == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("geometry create fractures orientation fisher 3 radius fixed 1 inside 'rock' seed 1 as-layer 'd'",
         "fractures need one density: p10, p30 or p32"),
        ("geometry create fractures orientation fisher 3 length fixed 1 p32 1 inside 'rock' seed 1 as-layer 'd'",
         "'length' is for two dimensions"),
        ("geometry create fractures orientation fisher 3 p32 1 inside 'rock' seed 1 as-layer 'd'", r"lacks rad\{ius\}"),
        ("geometry create fractures orientation normal 3 radius fixed 1 p32 1 inside 'rock' seed 1 as-layer 'd'",
         "fixed or fisher, not normal"),
        ("geometry create fractures orientation fixed 3 radius fixed 1 p32 1 inside 'fault' seed 1 as-layer 'd'",
         "fractures need a layer with bodies"),
        ("geometry create extrude layer 'rock' along (0,0,1) as-layer 'd'", "other shapes than polygons"),
        ("geometry create cone (0,0,0) (0,0,1) 1 1 as-layer 'd'", "two radii that differ"),
        ("geometry create arc (0,0,0) 1 0 90 as-layer 'd'", "'geometry create arc' is for two dimensions"),
        ("mesh create from-layer 'fault' size 1", "the outline is a body, but the layer has a plane"),
        ("mesh create from-layer 'rock' size 1 crack 'rock'", "layer 'rock' has bodies"),
        ("geometry import 'none.step' as-layer 'd'", r"none\.step"),
    ],
)  # fmt: skip
def test_what_cannot_be(bench, text, said):
    bench("pcdc model new dim 3\npcdc geometry create box (0,0,0) (2,2,2) as-layer 'rock'\n"
          "pcdc geometry create plane (0,0,0.5) (0,0.1,1) as-layer 'fault'\n")  # fmt: skip
    with pytest.raises(HpcdemError, match=said):
        bench(f"pcdc {text}\n")

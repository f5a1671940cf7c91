"""Meshes by Gmsh as scripts ask for them."""

from __future__ import annotations

import importlib.util
import math

import numpy as np
import pytest

from hpcdem.commands.fdem.choices import chosen
from hpcdem.core.errors import HpcdemError
from hpcdem.physics.fdem import groups as g
from tests.conftest import absent


@pytest.fixture(autouse=True)
def needs_gmsh():
    for name in ("gmsh", "shapely"):
        if importlib.util.find_spec(name) is None:
            absent(name, f"no package {name} here: install the extra [mesh]")


KIRSCH = """
m_R, m_a = 20.0, 1.0
pcdc model new dim 2
pcdc geom create circle (0,0) [m_R] as-layer 'out'
pcdc geom create circle (0,0) [m_a] as-layer 'hole'
pcdc mesh create from-layer 'out' size [m_R/12] refine-layer 'hole' size [m_a/16] hole 'hole' group 'rock' set 'domain'
pcdc element-face group 'rim' set 'bc' range geometry 'out'
"""


def test_the_disk_with_a_hole(bench):
    bench(KIRSCH)
    project = bench.project
    around = len(chosen(project, g.FACE, (g.OnLayer("hole"),)))
    rim = project.groups[g.FACE].members("rim", "bc")
    assert around >= 96 and len(rim) >= 2 * math.pi * 20 / (20 / 12)

    def polygon(n: int, r: float) -> float:
        return 0.5 * n * r * r * math.sin(2 * math.pi / n)

    area = float(project.mesh.areas().sum())
    assert area == pytest.approx(polygon(len(rim), 20) - polygon(around, 1), rel=1e-3)
    assert len(project.groups[g.ELEMENT].members("rock", "domain")) == len(project.mesh.cells)
    boundary = chosen(project, g.FACE, (g.OnBoundary(),))
    assert len(boundary) == around + len(rim) and set(rim) <= set(boundary)
    bench("pcdc mesh quality\n")
    assert any(line.startswith("angles") for line in bench.blocks.log.lines)


def test_regions_lines_points_and_fractures(bench):
    bench(
        "pcdc geometry create rectangle (0,0) (10,6) as-layer 'out'\n"
        "pcdc geometry create rectangle (6,0) (10,6) as-layer 'right'\n"
        "pcdc geometry create polyline (1,1) (4,5) as-layer 'line'\n"
        "pcdc geometry create point (8,3) as-layer 'gauge'\n"
        "pcdc geometry create fractures orientation fixed 30 length fixed 1 p21 0.5 reached inside 'out' seed 7 "
        "as-layer 'dfn'\n"
        "pcdc mesh create from-layer 'out' size 0.4 region 'right' group 'sand' embed 'line' embed 'gauge' crack 'dfn' "
        "group 'rock' set 'domain'\n"
    )
    project, mesh = bench.project, bench.project.mesh
    groups = project.groups[g.ELEMENT]
    areas = mesh.areas()
    assert areas[groups.members("sand", "domain")].sum() == pytest.approx(24.0, rel=1e-9)
    assert areas[groups.members("rock", "domain")].sum() == pytest.approx(36.0, rel=1e-9)
    length = sum(c.length() for c in project.layers["dfn"])
    assert length == pytest.approx(0.5 * 60, abs=0.51)  # P21 to half a fracture
    assert len(chosen(project, g.NODE, (g.OnLayer("gauge"),))) == 1
    on_line = mesh.layers["line"]
    assert np.hypot(*(mesh.points[on_line[:, 0]] - mesh.points[on_line[:, 1]]).T).sum() == pytest.approx(5.0)
    cracks = chosen(project, g.JOINT, (g.OnCrack(),))
    ends = mesh.points[mesh.cracks]
    cracked = np.hypot(*(ends[:, 1] - ends[:, 0]).T).sum()
    assert len(cracks) == len(mesh.cracks) and 0.8 * length < cracked < 1.2 * length


def test_the_same_seed_makes_the_same_fractures(bench):
    text = ("pcdc geometry create rectangle (0,0) (10,6) as-layer 'out'\n"
            "pcdc geometry create fractures orientation normal 30 spread 10 length exponential 1 greatest 4 p20 1 "
            "inside 'out' seed [seed] as-layer 'dfn'\n")  # fmt: skip

    def network(seed: int) -> list:
        bench("pcdc model new\nseed = " + str(seed) + "\n" + text)
        return [c.points.tolist() for c in bench.project.layers["dfn"]]

    first = network(3)
    assert network(3) == first and network(4) != first
    bench("pcdc geometry create fractures orientation normal 30 spread 10 length exponential 1 greatest 4 p20 1 "
          "inside 'out' seed 4 as-layer 'second'\n")  # fmt: skip
    second = [c.points.tolist() for c in bench.project.layers["second"]]
    assert second != network(4)  # another set of the same network


def test_smooth_moves_points_but_not_those_on_lines(bench):
    script = "pcdc model new\npcdc geometry create rectangle (0,0) (10,6) as-layer 'out'\n"
    script += "pcdc geometry create polyline (2,1) (8,5) as-layer 'line'\n"
    meshes = []
    for words in ("irregular", "irregular smooth"):
        bench(f"{script}pcdc mesh create from-layer 'out' size 0.5 embed 'line' {words}\n")
        meshes.append(bench.project.whole_mesh())
    plain, smooth = meshes
    moved = np.hypot(*(plain.points - smooth.points).T) > 0.0
    edges = plain.edges()
    stay = np.unique([*edges.points[~edges.inner].ravel(), *plain.layers["line"].ravel()])
    assert not moved[stay].any() and moved.sum() > 0.9 * (len(plain.points) - len(stay))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("mesh create from-layer 'ou' size 1", "there is no geometry layer 'ou' (layers so far: 'out')"),
        ("mesh create from-layer 'out' size 1 type quad smooth", "smooth supports triangles only"),
        ("mesh create from-layer 'out' size 1 hole 'h'", "there is no geometry layer 'h'"),
        ("geometry create fractures orientation fixed 0 length fixed 1 inside 'out' seed 1 as-layer 'd'",
         "one density"),
        ("geometry create fractures orientation fixed 0 length power 2 p20 1 inside 'out' seed 1 as-layer 'd'",
         "a power law needs a least length"),
        ("geometry create fractures orientation fixed 0 length fixed 1 p10 1 inside 'out' seed 1 as-layer 'd'",
         "a scan line along the fractures meets none"),
    ],
)  # fmt: skip
def test_settings_that_make_no_sense(bench, line, message):
    with pytest.raises(HpcdemError) as caught:
        bench(f"pcdc geometry create rectangle (0,0) (10,6) as-layer 'out'\npcdc {line}\n")
    assert str(caught.value).startswith("script.sc:2: pcdc ") and message in str(caught.value)

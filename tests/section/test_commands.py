"""SECTION of discs and geometry import of blocks: the same groups from each file, bonds cut across a fault."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, particles, properties, sections
from hpcdem.commands.dem.bonds import _slots
from hpcdem.commands.fdem import geometry as blocks
from hpcdem.commands.fdem import meshes
from hpcdem.commands.fdem.project import Project
from hpcdem.core.errors import CommandError, ScriptError
from hpcdem.core.selection import Interval, even_odd
from hpcdem.lang.zdem.parser import parse_text
from hpcdem.physics.fdem.connectivity import areas
from hpcdem.physics.fdem.groups import ELEMENT
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.pre.section.crossing import crossing
from tests.section import made
from tests.support import model

R = 20.0


def bed(folder: Path):
    """A square lattice of discs that touch, over the section and 100 m above it."""
    sim = model(folder)
    particles.gen_grid(sim, [R], (0.0, made.SIZE[0]), (-17.0, made.SIZE[1] + 100.0), idmin=0)
    properties.prop(sim, kn=1e6, ks=1e6, density=2500.0)
    return sim


def expected(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Names of the groups that discs have by their centres."""
    group = np.full(len(x), "***", object)
    for name, rings in made.LAYERS.items():
        for ring in rings:
            group[even_odd([np.array(ring, float)], x, y)] = name.lower().replace(" ", "_")
    return group


FILES = {
    "geojson": lambda folder: (made.geojson(folder / "s.geojson"), {}),
    "dxf": lambda folder: (made.dxf(folder / "s.dxf"), {}),
    "svg": lambda folder: (made.svg(folder / "s.svg"), {"scale": 10.0}),
    "shp": lambda folder: (made.shapefiles(folder)[0], {"attribute": "FORMATION"}),
    "png": lambda folder: ((files := made.image(folder / "s.png"))[0], {"scale": 10.0, "legend": files[1]}),
}


def test_each_format_gives_the_same_groups(tmp_path):
    for kind, make in FILES.items():
        sim = bed(tmp_path)
        file, words = make(tmp_path)
        count = sections.section(sim, file, **words)
        p = sim.particles
        group = np.array(sim.groups, object)[p["group"]]
        if kind == "png":  # its boundaries are sides of pixels
            assert (group != expected(p["x"], p["y"])).sum() <= 5
        else:
            assert (group == expected(p["x"], p["y"])).all(), kind
        assert count == (p["y"] < 1000.0).sum() > 2400


def test_attributes_become_properties(tmp_path):
    sim = bed(tmp_path)
    sections.section(sim, made.geojson(tmp_path / "s.geojson"), where=Interval("x", 0.0, 3000.0))
    p = sim.particles
    group = np.array(sim.groups, object)[p["group"]]
    fric = sim.materials.rows["fric"][p["material"]]
    for name, given in made.ATTRIBUTES.items():
        here = group == name.lower().replace(" ", "_")
        assert here.any() and (fric[here] == given["fric"]).all() and (p["x"][here] < 3000.0).all()
    assert (p["color"][group == "lower_sand"] == 2).all()
    assert (sim.materials.rows["kn"][p["material"]] == 1e6).all()


def ends(sim) -> set[tuple[int, int]]:
    """Ids of the pairs that are bonded."""
    lists, p = sim.lists, sim.particles
    slots = _slots(lists)
    slots = slots[lists.bond[slots] != 0]
    gid = p["gid"]
    first, second = gid[lists.row[slots]], gid[lists.partner[slots]]
    return {tuple(sorted(pair)) for pair in zip(first.tolist(), second.tolist())}


def across(sim, pairs) -> set[tuple[int, int]]:
    """Those of the pairs that cross the fault."""
    at = {int(g): (x, y) for g, x, y in zip(sim.particles["gid"], sim.particles["x"], sim.particles["y"])}
    pairs = sorted(pairs)
    first, second = (np.array([at[pair[k]] for pair in pairs]) for k in (0, 1))
    return {pair for pair, cut in zip(pairs, crossing(first, second, [np.array(made.FAULT)])) if cut}


@pytest.mark.parametrize("kind", ["geojson", "svg", "dxf"])
def test_a_fault_cuts_the_bonds_that_cross_it_and_no_others(tmp_path, kind):
    sim = bed(tmp_path)
    made_bonds = bonds.bond(sim, ebmod=1e8, gbmod=1e8, tstrength=1e6, sstrength=1e6)
    before = ends(sim)
    wanted = across(sim, before)
    file, words = FILES[kind](tmp_path)
    assert len(before) == made_bonds and 10 < len(wanted) < 40
    assert sections.section(sim, file, only=["F1"], tstrength=1e3, sstrength=1e3, **words) == len(wanted)
    assert ends(sim) == before
    types = sim.bond_types.rows[sim.lists.bond[_slots(sim.lists)]]
    assert (types["tstrength"] == 1e3).sum() == len(wanted) and (types["tstrength"] == 1e6).sum() == len(
        before - wanted
    )
    assert (types["ebmod"][types["tstrength"] > 0.0] == 1e8).all()
    above = Interval("y", 400.0, 2000.0)
    upper = {p for p in wanted if min(value_of(sim, g) for g in p) >= 400.0}
    assert sections.section(sim, file, cut=True, where=above, **words) == len(upper) > 0
    assert ends(sim) == before - upper
    assert sections.section(sim, file, cut=True, **words) == len(wanted) - len(upper)
    assert ends(sim) == before - wanted and sim.bonds_left() == made_bonds - len(wanted)


def value_of(sim, gid: int) -> float:
    return float(sim.particles["y"][sim.particles["gid"] == gid][0])


def test_discs_and_blocks_of_one_file(tmp_path):
    """Polygons filled with discs, and meshed: areas of the groups agree with those of the drawing."""
    file = made.geojson(tmp_path / "s.geojson")
    sim = model(tmp_path)
    assert sections.section(sim, file, rad=[60.0, 80.0], porosity=0.35) == len(sim.particles)
    p = sim.particles
    group = np.array(sim.groups, object)[p["group"]]
    assert (group == expected(p["x"], p["y"])).all()
    assert {int(c) for c in p["color"][group == "lower_sand"]} == {2}
    assert {int(c) for c in p["color"][group == "shale"]} == {2}  # the third name, without a colour of its own
    assert (sim.materials.rows["fric"][p["material"]][group == "basement"] == 0.6).all()
    for name, area in made.AREAS.items():
        discs = np.pi * (p["radius"][group == name.lower().replace(" ", "_")] ** 2).sum()
        assert discs == pytest.approx(0.65 * area, rel=0.06)

    pytest.importorskip("gmsh")
    project = Project(Blocks(), tmp_path, tmp_path)
    blocks.import_file(project, "s.geojson", "outline", named=True)
    assert list(project.layers) == ["basement", "Lower Sand", "shale", "F1", "outline"]
    meshes.create(project, "outline", 150.0, region=[(name, None) for name in made.LAYERS], crack=["F1"])
    mesh = project.mesh
    of = areas(mesh.points, mesh.cells)
    for name, area in made.AREAS.items():
        assert of[project.groups[ELEMENT].sets["default"][name]].sum() == pytest.approx(area, rel=1e-9)
    cut = np.concatenate([mesh.points[row[:2]] for row in np.asarray(mesh.cracks)])
    assert cut.min(axis=0) == pytest.approx([2000.0, 200.0]) and cut.max(axis=0) == pytest.approx([2250.0, 700.0])


def test_geometry_goes_out_and_comes_in_again(tmp_path):
    made.geojson(tmp_path / "s.geojson")
    project = Project(Blocks(), tmp_path, tmp_path)
    blocks.import_file(project, "s.geojson", "all", origin=(100.0, 50.0), to=(1.0, 2.0), scale=2.0)
    blocks.export(project, ["all"], "map.geojson", scale=2.0, origin=(100.0, 50.0), to=(1.0, 2.0))
    blocks.import_file(project, "map.geojson", "again", origin=(100.0, 50.0), to=(1.0, 2.0), scale=2.0)
    pairs = list(zip(project.layers["all"], project.layers["again"], strict=True))
    assert len(pairs) == 5
    for one, other in pairs:
        assert one.points == pytest.approx(other.points, abs=1e-9 * 8000.0)
    blocks.export(project, ["all"], "metres.csv")
    assert (tmp_path / "metres.csv").read_text().splitlines()[1] == "all,polygon,0,0,-199.0,-98.0"
    with pytest.raises(CommandError, match="exported to files"):
        blocks.export(project, ["all"], "plan.svg")
    with pytest.raises(CommandError, match="has the name 'basement', which is a layer already"):
        blocks.import_file(project, "s.geojson", "basement", named=True)


def test_what_cannot_act_is_refused(tmp_path):
    sim = bed(tmp_path)
    file = made.geojson(tmp_path / "s.geojson")
    _, faults = made.shapefiles(tmp_path)
    for words, message in (
        ({"rad": [1.0], "cut": True}, "either fills polygons"),
        ({"porosity": 0.2}, "give rad"),
        ({"rad": [1.0], "where": Interval("x", 0.0, 1.0)}, "do not accept a RANGE"),
        ({"only": ["basement"], "cut": True}, "no line that bonds could cross"),
        ({"only": ["F1"]}, "no polygon; lines need cut"),
        ({"rad": [-1.0]}, "radii above 0"),
    ):
        with pytest.raises(CommandError, match=message):
            sections.section(sim, file, **words)
    text = file.read_text().replace('"fric": 0.6', '"fric": "rough"')
    file.write_text(text)
    with pytest.raises(CommandError, match="'basement': fric is a number, the file has 'rough'"):
        sections.section(sim, file)
    for line, message in (
        ("SECTION a.geojson rad discrete 1 cut", "rad and cut exclude each other"),
        ("SECTION a.geojson porosity 0.2", "give rad"),
        ("SECTION a.kml", "a.kml: unknown ending of a section; known: .geojson"),
        ("SECTION a.geojson tstrength 1 n_bond 2", "different bond models"),
        ("SECTION a.geojson rad discrete 1 RANGE x 0 1", "select polygons by only"),
        ("SECTION a.geojson only a|", "names with"),
    ):
        with pytest.raises(ScriptError, match=message):
            parse_text(f"START\n{line}\n")
    statement = parse_text("START\nSECTION A.geojson only Sand | shale|F1 cut RANGE y 0 1\n").statements[1]
    assert statement.get("only") == ("Sand", "shale", "F1") and statement.get("file") == "A.geojson"


SCRIPT = """\
START
SET disk on
SET dt 1e-4
SET print 50
SECTION s.geojson rad discrete 70.0 90.0 porosity 0.3
PROP density 2500 kn 1e8 ks 1e8 damp 0.4
CYC 50
PROP ebmod 1e8 gbmod 1e8 tstrength 1e9 sstrength 1e9 tolerate 15.0
SECTION s.geojson only f1 tstrength 1e8 sstrength 1e8
CYC 50
SECTION s.geojson cut
SECTION s.geojson only shale|basement RANGE x 0.0 2000.0
CYC 50
"""


def test_the_same_on_two_ranks(tmp_path, resident):
    from hpcdem.io.frames import read_frame

    found = {}
    for ranks in (1, 2):
        folder = tmp_path / str(ranks)
        folder.mkdir()
        made.geojson(folder / "s.geojson")
        (folder / "s.py").write_text(SCRIPT)
        done = resident(ranks, "s.py", "--no-figure", cwd=folder)
        assert done.returncode == 0, done.stdout + done.stderr
        found[ranks] = read_frame(folder / "data" / "all_0000000150.vtkhdf")
    one, two = found[1].tables, found[2].tables
    assert len(one["particles"].columns["x"]) > 100 and len(one["bonds"].columns["id1"]) > 100
    for table in ("particles", "bonds"):
        for name, column in one[table].columns.items():
            assert np.array_equal(column, two[table].columns[name]), (table, name)

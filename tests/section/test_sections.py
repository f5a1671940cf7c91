"""A section of known areas in each format, out again, and files that are wrong."""

from __future__ import annotations

import json

import numpy as np
import pytest

from hpcdem.cli import section as program
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.pre.mesh import dxf, geometry, optional
from hpcdem.pre.section import check, fill
from hpcdem.pre.section.crossing import crossing
from hpcdem.pre.section.read import read
from hpcdem.pre.section.shapes import Placement, group_name
from hpcdem.pre.section.write import write
from tests.section import made


def areas(section) -> dict[str, float]:
    found: dict[str, float] = {}
    for shape, area in zip(section.polygons, check.areas(section)):
        found[shape.name] = found.get(shape.name, 0.0) + area
    return found


def in_format(kind: str, folder):
    """The section read from this kind of file."""
    if kind == "geojson":
        return read(made.geojson(folder / "section.geojson"))
    if kind == "dxf":
        return read(made.dxf(folder / "section.dxf"))
    if kind == "svg":
        return read(made.svg(folder / "section.svg"), Placement(unit=10.0))
    if kind == "shp":
        return read(made.shapefiles(folder)[0], attribute="formation")
    path, legend = made.image(folder / "section.png")
    return read(path, Placement(unit=10.0), legend=legend)


KINDS = ("geojson", "dxf", "svg", "shp", "png")


@pytest.mark.parametrize("kind", KINDS)
def test_each_format_has_the_same_areas(tmp_path, kind):
    section = in_format(kind, tmp_path)
    assert areas(section) == pytest.approx(made.AREAS, rel=1e-9)
    points = np.concatenate([ring.points for shape in section.polygons for ring in shape.rings])
    assert points.min(axis=0) == pytest.approx([0.0, 0.0], abs=1e-6)
    assert points.max(axis=0) == pytest.approx(made.SIZE, rel=1e-9)
    assert not [w for w in section.warnings if "overlap" in w or "gap" in w or "closed" in w]
    if kind in ("geojson", "dxf", "svg"):
        (fault,) = section.lines
        assert fault.name == "F1" and fault.rings[0].points == pytest.approx(np.array(made.FAULT), rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "left", "unit"),
    [("geojson", "1 Point of 'well'", "1 unit = 1 m, interpreted as metres"),
     ("dxf", "1 TEXT of 'labels', 1 POINT of 'well'", "kilometres ($INSUNITS 7): 1 unit = 1000 m"),
     ("svg", "1 text of 'labels'", "1 unit = 10 m, set by scale; y upwards from the bottom"),
     ("shp", "", "layers.prj names metre: 1 unit = 1 m, as given in the file")],
)  # fmt: skip
def test_what_is_left_out_and_the_unit_are_named(tmp_path, kind, left, unit):
    section = in_format(kind, tmp_path)
    assert unit in section.notes[0]
    assert [w for w in section.warnings if w.startswith("ignored")] == ([f"ignored: {left}"] if left else [])
    assert "'Lower Sand': " in " ".join(section.notes) and "790000 m2" in " ".join(section.notes)


@pytest.mark.parametrize("ending", ["geojson", "dxf"])
@pytest.mark.parametrize("on_map", [False, True])
def test_out_and_in_again(tmp_path, ending, on_map):
    place = Placement(25.0, (512300.25, -40.5), (17.0, 3.0))
    section = read(made.geojson(tmp_path / "section.geojson"), place)
    write(tmp_path / f"again.{ending}", section.shapes, section.placement if on_map else None)
    again = read(tmp_path / f"again.{ending}", place if on_map else Placement())
    key = lambda shape: (shape.name, shape.polygon, *shape.rings[0].points.min(axis=0).round(3))  # noqa: E731
    size = 25.0 * max(made.SIZE)
    pairs = list(zip(sorted(section.shapes, key=key), sorted(again.shapes, key=key), strict=True))
    for one, other in pairs:
        assert one.name == other.name and one.polygon == other.polygon
        far = one.rings[0].points[:, None] - other.rings[0].points[None]
        assert np.hypot(far[..., 0], far[..., 1]).min(axis=1).max() < 1e-9 * size


def test_along_a_line_of_a_map_and_back(tmp_path):
    """A trace of direction (3, 4) / 5: the distance along it is x, heights are y."""
    ring = [(s * 0.6 + 500_000.0, s * 0.8 + 4e6, z) for s, z in ((0, 0), (1000, 0), (1000, 300), (0, 200))]
    data = {"type": "Feature", "properties": {"name": "a"}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    ring.append(ring[0])
    (tmp_path / "map.geojson").write_text(json.dumps(data))
    place = Placement(line=((500_000.0, 4e6), (500_003.0, 4_000_004.0)))
    section = read(tmp_path / "map.geojson", place)
    assert areas(section) == pytest.approx({"a": 250_000.0}, rel=1e-9)
    assert "up to" in section.notes[1] and float(section.notes[1].split("up to ")[1].split()[0]) < 1e-6
    write(tmp_path / "again.geojson", section.shapes, section.placement)
    back = read(tmp_path / "again.geojson", place)
    assert back.polygons[0].rings[0].points == pytest.approx(section.polygons[0].rings[0].points, abs=1e-6)
    with pytest.raises(HpcdemError, match="line needs heights"):
        read(made.geojson(tmp_path / "flat.geojson"), place)


def test_small_coordinates_are_lengths_only_where_a_file_says_so(tmp_path):
    """A box of 0.8 by 0.1 m might be degrees: scale, the name of a projection, the unit of exported files and .prj
    decide."""
    ring = [[0.0, 0.0], [0.8, 0.0], [0.8, 0.1], [0.0, 0.1], [0.0, 0.0]]
    data = {"type": "Feature", "properties": {"name": "a"}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    path = tmp_path / "box.geojson"
    path.write_text(json.dumps(data))
    with pytest.raises(HpcdemError, match="may be degrees"):
        read(path)
    scaled = read(path, Placement(unit=1.0))
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32648"}}
    path.write_text(json.dumps(data | {"crs": crs}))
    write(tmp_path / "again.geojson", scaled.shapes)
    for section in (scaled, read(path), read(tmp_path / "again.geojson")):
        assert areas(section) == pytest.approx({"a": 0.08}, rel=1e-12)
    write(tmp_path / "again.geojson", scaled.shapes, Placement(1000.0))  # in kilometres
    with pytest.raises(HpcdemError, match=r"0 to 0.0008 and 0 to 0.0001, may be degrees"):
        read(tmp_path / "again.geojson")
    path.write_text(json.dumps(data).replace("0.1]", "90.5]"))  # no latitude
    assert areas(read(path)) == pytest.approx({"a": 0.8 * 90.5})


def test_csv_has_all_points(tmp_path):
    section = read(made.geojson(tmp_path / "section.geojson"))
    write(tmp_path / "out.csv", section.shapes)
    rows = (tmp_path / "out.csv").read_text().splitlines()
    assert rows[0] == "name,kind,shape,ring,x,y"
    assert len(rows) == 1 + 7 + 6 + 6 + 7 + 3
    assert rows[-1] == "F1,line,4,0,2000.0,700.0"


def test_arcs_of_a_drawing(tmp_path):
    """A half circle of radius 10 m on a square, with a hole: arcs stay arcs in DXF, and areas are exact."""
    half = geometry.Curve(
        np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]]), np.array([0, 0, 1.0, 0]), True
    )
    dxf.write(tmp_path / "arc.dxf", {"dome": [half]})
    section = read(tmp_path / "arc.dxf")
    assert areas(section) == pytest.approx({"dome": 400.0 + 50.0 * np.pi}, rel=1e-12)
    (ring,) = section.polygons[0].points(1e-4 * 30.0)
    assert np.hypot(*(ring[ring[:, 1] > 20.0] - [10.0, 20.0]).T) == pytest.approx(10.0)


def test_holes(tmp_path):
    d = "M0 0 H100 V100 H0 Z M20 20 H40 V40 H20 Z M25 25 h5 v5 h-5 z"
    (tmp_path / "h.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path id="a" d="{d}"/></svg>'
    )
    section = read(tmp_path / "h.svg")
    assert [len(shape.rings) for shape in section.polygons] == [2, 1]
    assert check.areas(section) == pytest.approx([10_000.0 - 400.0, 25.0])


# --- what is wrong with polygons ----------------------------------------------------------------------------------


def polygons(folder, *rings, kind="Polygon", names="abcdef"):
    features = [
        {"type": "Feature", "properties": {"name": name},
         "geometry": {"type": kind, "coordinates": [[*ring, ring[0]]] if kind == "Polygon" else ring}}
        for name, ring in zip(names, rings)
    ]  # fmt: skip
    path = folder / "p.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "unit": "m", "features": features}))
    return path


SQUARE = [(0, 0), (100, 0), (100, 100), (0, 100)]


def test_an_overlap_has_its_place_and_size(tmp_path):
    (warning,) = read(polygons(tmp_path, SQUARE, [(90, 0), (200, 0), (200, 100), (90, 100)])).warnings
    assert "'a' (feature 0) and 'b' (feature 1) overlap by 1000 m2 at (95, 50) m, 100 m long and 10 m wide" in warning
    assert "'b', which is later in the file, takes precedence there" in warning


def test_gaps_have_their_place_and_size(tmp_path):
    right = [(100.05, 0), (200, 0), (200, 100), (100.05, 100)]
    (warning,) = read(polygons(tmp_path, SQUARE, right)).warnings
    assert "gap between polygons: 5 m2 at (100.025, 50) m, 100 m long and 0.05 m wide" in warning
    ring = [(0, 0), (100, 0), (100, 100), (0, 100), (0, 60), (60, 60), (60, 40), (0, 40)]
    lid = [(0, 40), (20, 40), (20, 60), (0, 60)]
    (warning,) = read(polygons(tmp_path, ring, lid)).warnings
    assert "gap between polygons: 800 m2 at (40, 50) m, 40 m long and 20 m wide" in warning


def test_a_polygon_that_crosses_itself_is_refused_with_the_place(tmp_path):
    with pytest.raises(HpcdemError, match=r"'a' \(feature 0\): self-intersection at \(50, 50\) m"):
        read(polygons(tmp_path, [(0, 0), (100, 100), (100, 0), (0, 100)]))


def test_rings_that_are_not_closed(tmp_path):
    path = polygons(tmp_path, SQUARE)
    data = json.loads(path.read_text())
    data["features"][0]["geometry"]["coordinates"][0].pop()
    path.write_text(json.dumps(data))
    section = read(path)
    assert areas(section) == {"a": 10_000.0}
    assert "a ring of 'a' is not closed: it ends at (0, 100) in the file, 100 from its start" in section.warnings[0]
    line = [(0, 0), (100, 0), (100, 100), (0, 100), (0, 2)]
    (warning,) = read(polygons(tmp_path, line, kind="LineString")).warnings
    assert "'a' (feature 0) ends at (0, 2), 2 m from its start: it is a line, not a polygon" in warning


# --- files that are wrong -----------------------------------------------------------------------------------------

HOSTILE = {
    "cut.geojson": ('{"type": "FeatureCollection", "features": [', "not a readable GeoJSON"),
    "list.geojson": ("[1, 2]", "it has no type"),
    "deep.geojson": ('{"type":"Feature","a":' + "[" * 100_000 + "]" * 100_000 + "}", "not a readable GeoJSON"),
    "nan.geojson": ('{"type": "LineString", "coordinates": [[0, NaN], [1, 1]]}', "NaN is not a number"),
    "huge.geojson": ('{"type": "LineString", "coordinates": [[0, 1e999], [1, 1]]}', "not a finite number"),
    "text.geojson": ('{"type": "LineString", "coordinates": [["0", "1"], [1, 1]]}', "something other than numbers"),
    "flat.geojson": ('{"type": "Polygon", "coordinates": [[[0, 0], [1, 1], [0, 0]]]}', "2 different points"),
    "one.geojson": ('{"type": "LineString", "coordinates": [[1, 1]]}', "1 different points"),
    "kind.geojson": ('{"type": "Sphere", "coordinates": []}', "unknown geometry 'Sphere'"),
    "none.geojson": ('{"type": "FeatureCollection", "features": []}', "no polygon and no line"),
    "point.geojson": ('{"type": "Point", "coordinates": [1, 2]}', "ignored: 1 Point of 'unnamed'"),
    "degrees.geojson": (
        '{"type": "Point", "coordinates": [1, 2], "crs": {"properties": {"name": "urn:ogc:def:crs:EPSG::4326"}}}',
        "its coordinates are degrees",
    ),
    "likely.geojson": (
        '{"type": "LineString", "coordinates": [[103.5, 29.5], [104.25, 30.0]]}',
        r"103.5 to 104.25 and 29.5 to 30, may be degrees: it names no .*RFC 7946. Project .* or give scale",
    ),
    "cut.svg": ("<svg", "not a readable SVG"),
    "bomb.svg": (
        '<!DOCTYPE s [<!ENTITY a "aaaaaaaaaa">' + "".join(
            f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefghi", "bcdefghij")
        ) + ']><svg xmlns="http://www.w3.org/2000/svg"><title>&j;</title></svg>',
        "not a readable SVG|no polygon",
    ),
    "none.svg": ('<svg xmlns="http://www.w3.org/2000/svg"><text>a</text></svg>', "ignored: 1 text"),
    "cut.shp": ("\x00\x00\x27\x0a" * 30, "not a readable shapefile"),
    "cut.dxf": ("0\nSECTION\n2\nENT", "not a readable DXF|no line"),
    "cut.png": ("\x89PNG", "an image needs a legend"),
    "strange.kml": ("", "unknown ending"),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_in_a_sentence(tmp_path, name):
    text, message = HOSTILE[name]
    (tmp_path / name).write_bytes(text.encode("latin-1"))
    with pytest.raises(HpcdemError, match=message) as told:
        read(tmp_path / name)
    assert name in str(told.value) and "\n" not in str(told.value)


def test_legends_that_are_wrong(tmp_path):
    path, legend = made.image(tmp_path / "s.png")
    for text, message in (("mauvish, a", "s.txt:1: 'mauvish' is not a colour"), ("red", "the colour red has no name"),
                          ("red, a, fric", "read 'fric', expected attribute=value"),
                          ("", "the legend is empty")):  # fmt: skip
        legend.write_text(text)
        with pytest.raises(HpcdemError, match=message):
            read(path, legend=legend)
    legend.write_text("#a0a0a0, basement\nred, nobody\n")
    warnings = " ".join(read(path, legend=legend).warnings)
    assert "no pixel has the colour of 'nobody'" in warnings and "pixels have no colour of the legend" in warnings


def test_degrees_of_a_shapefile_and_a_missing_attribute(tmp_path):
    path, _ = made.shapefiles(tmp_path)
    with pytest.raises(HpcdemError, match=r"record 0 has no attribute 'nobody' .it has FORMATION, fric"):
        read(path, attribute="nobody")
    path.with_suffix(".prj").write_text('GEOGCS["WGS 84",UNIT["degree",0.0174532925]]')
    with pytest.raises(HpcdemError, match=r"degrees .layers.prj.; project"):
        read(path)


def test_a_shapefile_of_small_numbers_without_a_unit(tmp_path):
    import shapefile

    with shapefile.Writer(str(tmp_path / "trace"), shapeType=shapefile.POLYLINE) as out:
        out.field("name", "C")
        out.line([[(103.5, 29.5), (104.25, 30.0)]])
        out.record("F1")
    with pytest.raises(HpcdemError, match=r"29.5 to 30, may be degrees: it has no .prj file"):
        read(tmp_path / "trace.shp")
    assert read(tmp_path / "trace.shp", Placement(unit=1.0)).lines[0].length() == pytest.approx(np.hypot(0.75, 0.5))


def test_values_that_make_no_sense(tmp_path):
    path = made.geojson(tmp_path / "s.geojson")
    with pytest.raises(
        CommandError, match=r"no polygon or line 'salt' .it has 'basement', 'Lower Sand', 'shale', 'F1'"
    ):
        read(path, only=["salt"])
    with pytest.raises(CommandError, match="a legend is for images"):
        read(path, legend=path)
    with pytest.raises(CommandError, match="both of its points"):
        Placement(line=((1.0, 2.0), (1.0, 2.0)))
    with pytest.raises(CommandError, match="metres per unit"):
        Placement(unit=-1.0)
    assert [shape.name for shape in read(path, only=["lower_sand", "f1"]).shapes] == ["Lower Sand", "Lower Sand", "F1"]
    assert group_name(" Lower  Sand (a) ") == "lower__sand__a_"


@pytest.mark.parametrize(("module", "name"), [("shapefile", "pyshp"), ("svgelements", "svgelements")])
def test_a_missing_package_is_named(monkeypatch, module, name):
    import sys

    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(HpcdemError, match=rf"needs the package {name}, which is not installed: .*\[mesh\]"):
        getattr(optional, name)()


# --- images -------------------------------------------------------------------------------------------------------


def test_a_simplified_image_keeps_shared_boundaries(tmp_path):
    """Stairs of 10 m pixels along the fault become a straight line on both sides of it."""
    path, legend = made.image(tmp_path / "s.png")
    rough = read(path, Placement(unit=10.0), legend=legend)
    smooth = read(path, Placement(unit=10.0), legend=legend, simplify=15.0)
    count = lambda section: sum(len(ring.points) for shape in section.polygons for ring in shape.rings)  # noqa: E731
    assert count(smooth) < 0.5 * count(rough)
    assert areas(smooth) == pytest.approx(made.AREAS, rel=2e-3)
    assert not smooth.warnings


def test_specks_of_an_image_go_to_their_neighbours(tmp_path):
    from PIL import Image

    path, legend = made.image(tmp_path / "s.png")
    pixels = np.asarray(Image.open(path)).copy()
    pixels[20:22, 30:32] = (200, 0, 200)
    pixels[50, 60] = (160, 160, 160)
    Image.fromarray(pixels).save(path)
    section = read(path, Placement(unit=10.0), legend=legend)
    assert areas(section) == pytest.approx(made.AREAS, rel=1e-9)
    assert "4 pixels have no colour of the legend and 1 are in pieces of less than 9 pixels" in section.warnings[0]


# --- pairs across a line, and discs -------------------------------------------------------------------------------


def test_pairs_across_a_line_against_shapely():
    random = np.random.default_rng(3)
    first = random.uniform(0, 10, (4000, 2))
    second = first + random.normal(0, 0.7, first.shape)
    line = np.array([(1.0, 1.0), (4.0, 6.0), (5.0, 2.0), (9.0, 9.0)])
    shapely = optional.shapely()
    expected = shapely.intersects(shapely.linestrings(np.stack([first, second], 1)), shapely.LineString(line))
    found = crossing(first, second, [line])
    assert 100 < expected.sum() and (found == expected).all()


def test_pairs_through_corners_and_on_the_line():
    line = np.array([(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)])
    pairs = np.array([
        [(1.0, -1.0), (1.0, 1.0)],  # through the corner
        [(0.5, 0.0), (0.5, 1.0)], [(0.5, 0.0), (0.5, -1.0)],  # ends on the line, which is right of it
        [(0.2, 0.0), (0.8, 0.0)],  # along it
        [(3.0, -1.0), (3.0, 1.0)], [(0.5, 0.1), (0.5, 1.0)],  # beside it
    ])  # fmt: skip
    assert crossing(pairs[:, 0], pairs[:, 1], [line]).tolist() == [True, True, False, False, False, False]


def test_discs_keep_inside_their_polygons(tmp_path):
    section = read(made.geojson(tmp_path / "s.geojson"))
    radii = np.array([60.0, 80.0])
    filled = fill.filled(section, radii, 0.35, 5, 0, "s")
    assert fill.filled(section, radii, 0.35, 5, 0, "s").rows.tobytes() == filled.rows.tobytes()
    made_of = check.polygons(section, "s")
    for k, area in enumerate(made_of):
        rows = filled.rows[filled.shape == k]
        assert np.pi * (rows[:, 2] ** 2).sum() == pytest.approx(0.65 * area.area, abs=np.pi * 80.0**2)
        points = optional.shapely().points(rows[:, :2])
        assert optional.shapely().contains(area, points).all()
        beyond = rows[:, 2] - optional.shapely().distance(area.boundary, points)
        assert (beyond <= (filled.overlap + 1e-9) * rows[:, 2]).all()
    far = filled.rows[:, None, :2] - filled.rows[None, :, :2]
    gap = np.hypot(far[..., 0], far[..., 1]) - (filled.rows[:, None, 2] + filled.rows[None, :, 2])
    np.fill_diagonal(gap, np.inf)
    assert gap.min() >= -(filled.overlap + 1e-9) * 160.0 and filled.overlap < 0.1
    with pytest.raises(CommandError, match=r"'basement' .feature 0. is too narrow for a disc of radius 400 m"):
        fill.filled(section, np.array([400.0]), 0.3, 5, 0, "s")
    with pytest.raises(CommandError, match="porosity"):
        fill.filled(section, radii, 0.01, 5, 0, "s")


def test_an_inclined_layer_as_wide_as_a_disc_is_refused(tmp_path):
    """What is left for the centres of discs is a line; a lattice that meets it would have any number of points."""
    width = 2.0 + 1e-6
    half = width / np.sqrt(2.0)
    ring = [[0.0, 0.0], [1000.0, 1000.0], [1000.0 - half, 1000.0 + half], [-half, half], [0.0, 0.0]]
    text = {"type": "Feature", "properties": {"name": "thin"}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    (tmp_path / "thin.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [text]}))
    section = read(tmp_path / "thin.geojson")
    with pytest.raises(CommandError, match="hardly wider than its discs; use smaller radii"):
        fill.filled(section, np.array([1.0]), 0.2, 5, 0, "thin")


def test_an_area_hardly_larger_than_a_disc_gets_one(tmp_path):
    side = 2.2
    section = read(polygons(tmp_path, [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side], [0.0, 0.0]]))
    rows = fill.filled(section, np.array([1.0]), 0.5, 0, 0, "f").rows
    assert len(rows) == 1 and (np.abs(rows[0, :2] - 0.5 * side) <= 0.1 + 1e-9).all()


def test_a_closed_line_is_no_ring_that_lacks_a_side(tmp_path):
    turn = np.linspace(0.0, 2.0 * np.pi, 41)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    ring[-1] = ring[0]
    assert not read(polygons(tmp_path, ring.tolist(), kind="LineString")).warnings
    assert "close it in the drawing" in read(polygons(tmp_path, ring[:-1].tolist(), kind="LineString")).warnings[0]


def test_a_fault_of_one_point_is_named_and_no_line(tmp_path):
    (tmp_path / "measure").mkdir()
    (tmp_path / "measure" / "faults.csv").write_text(
        "step,fault,x1[m],y1[m],x2[m],y2[m]\n9,1,0,0,30,39\n9,1,0,0,30,40\n9,2,5,5,5,5\n8,3,0,0,1,1\n"
    )
    shapes, short = program._faults(tmp_path, 9)
    assert [shape.name for shape in shapes] == ["fault 1"] and shapes[0].length() == 50.0 and short == ["fault 2"]

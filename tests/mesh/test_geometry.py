"""Geometry layers: lengths and areas of circles and arcs, transformations, refusals, DXF drawings."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from hpcdem.commands.fdem import Project
from hpcdem.commands.fdem import geometry as commands
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.pre.mesh import geometry
from hpcdem.pre.mesh.dxf import read_dxf
from hpcdem.pre.mesh.geometry import Layers, distance, sampled, transformed
from tests.mesh.areas import enclosed_area
from tests.pcdc.fake import FakeBlocks
from tests.tables import each


def test_lengths_and_areas():
    assert geometry.polyline([(0, 0), (3, 4), (3, 5)]).length() == 6.0
    assert math.isclose(geometry.circle((5.0, -2.0), 3.0).length(), 6.0 * math.pi)
    assert math.isclose(enclosed_area(geometry.circle((5.0, -2.0), 3.0)), 9.0 * math.pi, rel_tol=1e-14)
    for start, end in ((0.0, 90.0), (350.0, 10.0), (10.0, 369.0), (-720.0, 1.0)):
        sweep = math.radians((end - start) % 360.0)
        arc = geometry.arc((1.0, 2.0), 4.0, start, end)
        assert math.isclose(arc.length(), 4.0 * sweep, rel_tol=1e-12)
        np.testing.assert_allclose(
            arc.points[0], (1 + 4 * math.cos(math.radians(start)), 2 + 4 * math.sin(math.radians(start)))
        )
        # Closed by its chord it encloses a segment of the circle: r2 (sweep - sin sweep) / 2.
        closed = geometry.Curve(arc.points, arc.bulges, True)
        assert math.isclose(enclosed_area(closed), 8.0 * (sweep - math.sin(sweep)), rel_tol=1e-12, abs_tol=1e-14)
    assert enclosed_area(geometry.rectangle((4, 3), (1, 1))) == 6.0


def test_sampled_points_lie_on_the_curve():
    arc = geometry.arc((1.0, 2.0), 4.0, 30.0, 200.0)
    xy = sampled(arc, 0.1)
    np.testing.assert_allclose(np.hypot(*(xy - (1.0, 2.0)).T), 4.0, rtol=1e-14)
    step = np.hypot(*np.diff(xy, axis=0).T)
    assert step.max() <= 0.1 and np.ptp(step) < 1e-12
    np.testing.assert_array_equal(xy[[0, -1]], arc.points[[0, -1]])
    assert len(sampled(geometry.circle((0, 0), 1.0), 100.0)) == geometry.STEPS_PER_CIRCLE


def test_distance():
    circle = geometry.circle((0.0, 0.0), 2.0)
    np.testing.assert_allclose(distance(circle, np.array([(0, 0), (3, 0), (0, -1), (2, 0)])), [2, 1, 1, 0], atol=1e-15)
    quarter = geometry.arc((0.0, 0.0), 2.0, 0.0, 90.0)
    np.testing.assert_allclose(distance(quarter, np.array([(1, 1), (2, -1), (-2, 0)])), [2 - 2**0.5, 1, 8**0.5])
    np.testing.assert_allclose(distance(geometry.polyline([(0, 0), (2, 0)]), np.array([(1, 1), (-3, 4)])), [1, 5])
    assert distance(geometry.point((1, 1)), np.array([(4, 5)]))[0] == 5.0


@pytest.mark.parametrize(
    "how", [{}, {"rotate": 30.0}, {"scale": 2.0}, {"scale": (-1.0, 1.0)}, {"rotate": 90.0, "about": (3, 1)}]
)
def test_transformed_arcs_stay_arcs(how):
    arc = geometry.arc((1.0, 2.0), 4.0, 30.0, 200.0)
    moved = transformed(arc, translate=(5.0, -1.0), **how)
    factor = 2.0 if how.get("scale") == 2.0 else 1.0
    assert math.isclose(moved.length(), factor * arc.length(), rel_tol=1e-12)
    # What lies on the one, moved, lies on the other.
    some = sampled(arc, 0.5)
    points = transformed(geometry.polyline(some), translate=(5.0, -1.0), **how).points
    assert distance(moved, points).max() < 1e-13 * 10


def test_quarter_turns_are_exact():
    turned = transformed(geometry.rectangle((0, 0), (0.1, 0.3)), rotate=90.0)
    np.testing.assert_array_equal(turned.points, [(0, 0), (0, 0.1), (-0.3, 0.1), (-0.3, 0)])


def test_layers_by_name_and_back_from_arrays():
    layers = Layers()
    layers.add("a", geometry.circle((0, 0), 1), geometry.point((3, 3)))
    layers.add("b", geometry.polygon([(0, 0), (1, 0), (0, 1)]))
    layers.add("a", geometry.polyline([(0, 0), (1, 1)]))
    layers.transform("b", copy_to="c", translate=(1.0, 0.0))
    again = Layers.from_tables(layers.tables())
    assert list(again) == ["a", "b", "c"] and [len(again[n]) for n in again] == [3, 1, 1]
    for name in layers:
        for one, other in zip(layers[name], again[name]):
            np.testing.assert_array_equal(one.points, other.points)
            np.testing.assert_array_equal(one.bulges, other.bulges)
            assert one.closed == other.closed
    layers.remove("c")
    assert "c" not in layers and "c" in again
    with pytest.raises(CommandError, match=r"no geometry layer 'c' \(layers so far: 'a', 'b'\)"):
        layers["c"]
    assert list(Layers.from_tables(Layers().tables())) == []


@each(
    ("call", "message"),
    [
        (lambda: geometry.polyline([(0, 0)]), "1 points given, at least 2"),
        (lambda: geometry.polyline([(0, 0), (0, 0)]), "points 1 and 2 are the same"),
        (lambda: geometry.polyline([(0, 0), (math.nan, 1)]), "must be finite"),
        (lambda: geometry.polyline([(0, 0, 0), (1, 1, 1)]), "two coordinates"),
        (lambda: geometry.polygon([(0, 0), (1, 1)]), "at least 3"),
        (lambda: geometry.polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), "sides 1 and 3 cross"),
        (lambda: geometry.polygon([(0, 0), (2, 0), (2, 1), (1, 0), (0, 1)]), "sides 1 and 3 cross or touch"),
        (lambda: geometry.polygon([(0, 0), (2, 0), (1, 0), (0, 1)]), "sides 1 and 3 cross or touch"),
        (lambda: geometry.rectangle((0, 0), (0, 1)), "no area"),
        (lambda: geometry.circle((0, 0), 0.0), "radius must be positive"),
        (lambda: geometry.circle((0, 0), math.inf), "radius must be positive"),
        (lambda: geometry.arc((0, 0), 1.0, 90.0, 450.0), "are equal"),
        (lambda: transformed(geometry.circle((0, 0), 1), scale=(1, 2)), "ellipses"),
        (lambda: transformed(geometry.circle((0, 0), 1), scale=0.0), "not zero"),
        (lambda: transformed(geometry.circle((0, 0), 1), rotate=math.inf), "finite"),
        (lambda: Layers().add("", geometry.point((0, 0))), "needs a name"),
        (lambda: enclosed_area(geometry.polyline([(0, 0), (1, 0)])), "open curve"),
    ],
)
def test_nonsense_is_refused(call, message):
    with pytest.raises(CommandError, match=message):
        call()


# --- drawings ----------------------------------------------------------------------------------------------------


@pytest.fixture
def drawing(ezdxf, tmp_path):
    """Write a drawing: `drawing(lambda space, document: ...)` returns its path."""

    def make(draw):
        document = ezdxf.new("R2010")
        draw(document.modelspace(), document)
        path = tmp_path / "site.dxf"
        document.saveas(path)
        return path

    return make


def test_drawing(drawing):
    def draw(space, document):
        space.add_line((0, 0), (3, 4), dxfattribs={"layer": "fault"})
        space.add_circle((1, 2), 3, dxfattribs={"layer": "tunnel"})
        space.add_arc((0, 0), 2, 350, 20, dxfattribs={"layer": "tunnel"})
        space.add_point((7, 8), dxfattribs={"layer": "stations"})
        # A stadium: two straight sides of 4, two half circles of radius 1.
        space.add_lwpolyline(
            [(0, 0, 0), (4, 0, 1), (4, 2, 0), (0, 2, 1)], format="xyb", close=True, dxfattribs={"layer": "s"}
        )
        space.add_polyline2d([(0, 0), (1, 0), (1, 0), (1, 1)], dxfattribs={"layer": "bed"})
        space.add_ellipse((0, 0), (4, 0), 0.5, dxfattribs={"layer": "lens"})
        space.add_spline([(0, 0), (1, 1), (2, 0), (3, 1)], dxfattribs={"layer": "horst"})
        space.add_text("a note", dxfattribs={"layer": "notes"})
        block = document.blocks.new("drill")
        block.add_line((0, 0), (1, 0), dxfattribs={"layer": "holes"})
        space.add_blockref("drill", (10, 5), dxfattribs={"rotation": 90})

    path = drawing(draw)
    found = read_dxf(path)
    assert sorted(found) == ["bed", "fault", "holes", "horst", "lens", "s", "stations", "tunnel"]
    assert found["fault"][0].length() == 5.0
    assert math.isclose(enclosed_area(found["tunnel"][0]), 9.0 * math.pi)
    assert math.isclose(found["tunnel"][1].length(), 2.0 * math.radians(30.0))
    assert math.isclose(enclosed_area(found["s"][0]), 8.0 + math.pi) and math.isclose(
        found["s"][0].length(), 8 + 2 * math.pi
    )
    np.testing.assert_array_equal(found["bed"][0].points, [(0, 0), (1, 0), (1, 1)])
    assert math.isclose(enclosed_area(found["lens"][0]), 8.0 * math.pi, rel_tol=1e-3)
    np.testing.assert_allclose(found["horst"][0].points[[0, -1]], [(0, 0), (3, 1)], atol=1e-12)
    np.testing.assert_allclose(found["holes"][0].points, [(10, 5), (10, 6)], atol=1e-12)
    np.testing.assert_array_equal(found["stations"][0].points, [(7, 8)])
    assert list(read_dxf(path, only={"fault"})) == ["fault"]
    with pytest.raises(HpcdemError, match="layer 'Fault' is empty or missing"):
        read_dxf(path, only={"Fault"})


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (
            lambda s, d: s.add_3dface([(0, 0, 0), (1, 0, 0), (0, 1, 1)], dxfattribs={"layer": "top"}),
            r"3DFACE \(handle \w+, layer 'top'\)",
        ),
        (lambda s, d: s.add_polyline3d([(0, 0, 0), (1, 0, 3)]), "two-dimensional"),
        (lambda s, d: s.add_circle((0, 0), 1, dxfattribs={"extrusion": (0, 1, 0)}), "its own plane"),
        (lambda s, d: s.add_line((1, 1), (1, 1)), r"LINE .* points 1 and 2 are the same"),
        (lambda s, d: s.add_text("only a note"), "contains no line"),
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_in_the_plane_is_refused(drawing, draw, message):
    path = drawing(draw)
    with pytest.raises(HpcdemError, match=message) as error:
        read_dxf(path)
    assert str(error.value).startswith(str(path))


def test_blocks_that_are_mirrored_or_repeated(drawing):
    """A block at (10, 5), mirrored in x: x becomes 10 - x. What it has in layer 0 is in the layer of the insertion."""

    def draw(space, document):
        block = document.blocks.new("part")
        block.add_arc((2, 0), 1, 0, 90, dxfattribs={"layer": "arc"})
        block.add_circle((3, 1), 0.5, dxfattribs={"layer": "circle"})
        block.add_lwpolyline([(0, 0, 0), (4, 0, 1), (4, 2, 0), (0, 2, 1)], format="xyb", close=True)
        block.add_ellipse((1, 0), (2, 0), 0.5, 0, math.pi / 2, dxfattribs={"layer": "lens"})
        block.add_line((0, 0), (1, 3), dxfattribs={"layer": "line"})
        space.add_blockref("part", (10, 5), dxfattribs={"xscale": -1, "layer": "mirrored"})
        outer = document.blocks.new("outer")
        outer.add_blockref("part", (0, 0), dxfattribs={"yscale": -1})
        space.add_blockref("outer", (0, 0), dxfattribs={"rotation": 180, "layer": "nested"})
        bolt = document.blocks.new("bolt")
        bolt.add_circle((0, 0), 0.1)
        rows = {"row_count": 2, "column_count": 3, "row_spacing": 2, "column_spacing": 5, "layer": "bolts"}
        space.add_blockref("bolt", (0, 0), dxfattribs=rows)

    found = read_dxf(drawing(draw))
    arc, turned = found["arc"]
    h = math.sqrt(0.5)
    assert sorted(map(tuple, np.round(arc.points[[0, -1]], 9).tolist())) == [(7, 5), (8, 6)]
    np.testing.assert_allclose(arc.points[1], (8 - h, 5 + h), atol=1e-9)
    # Mirrored in y and turned by 180 degrees is mirrored in x.
    np.testing.assert_allclose(turned.points[1], (-2 - h, h), atol=1e-9)
    np.testing.assert_allclose(found["circle"][0].points.mean(axis=0), (7, 6), atol=1e-9)
    (stadium,), (other,) = found["mirrored"], found["nested"]
    assert math.isclose(abs(enclosed_area(stadium)), 8.0 + math.pi) and math.isclose(
        abs(enclosed_area(other)), 8 + math.pi
    )
    assert sorted(map(tuple, np.round(stadium.points, 9).tolist())) == [(6, 5), (6, 7), (10, 5), (10, 7)]
    np.testing.assert_allclose(sorted(found["lens"][0].points[[0, -1]].tolist()), [(7, 5), (9, 6)], atol=1e-6)
    np.testing.assert_allclose(found["line"][0].points, [(10, 5), (9, 8)], atol=1e-9)
    at = sorted(tuple(np.round(one.points.mean(axis=0), 9).tolist()) for one in found["bolts"])
    assert at == [(0, 0), (0, 2), (5, 0), (5, 2), (10, 0), (10, 2)] and "0" not in found


@pytest.mark.parametrize(
    ("code", "scale", "factor", "said"),
    [
        (4, None, 1e-3, r"in millimetres \(\$INSUNITS 4\): 1 unit = 0.001 m, replaced by scale"),
        (4, 1.0, 1.0, "in millimetres .*: 1 unit = 1 m, set by scale"),
        (2, None, 0.3048, "in feet"),
        (0, None, 1.0, "defines no unit .*: 1 unit = 1 m, interpreted as metres"),
        (6, None, 1.0, "in metres"),
    ],
)
def test_units_of_a_drawing(ezdxf, tmp_path, code, scale, factor, said):
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = code
    document.modelspace().add_lwpolyline([(0, 0), (2000, 0), (2000, 1000), (0, 1000)], close=True)
    document.saveas(tmp_path / "site.dxf")
    project = Project(FakeBlocks(), tmp_path, tmp_path / "data")
    commands.import_file(project, "site.dxf", "slope", scale=scale)
    assert abs(enclosed_area(project.layers["slope"][0])) == pytest.approx(2e6 * factor**2)
    (line,) = project.log.lines
    assert re.search(said, line) and f"to ({2000 * factor:g}, {1000 * factor:g}) m" in line


def test_what_leaves_the_plane_is_refused(ezdxf, tmp_path):
    document = ezdxf.new("R2010")
    document.modelspace().add_line((0, 0, 2), (1, 0, 2), dxfattribs={"layer": "level"})
    document.modelspace().add_line((0, 0, 0), (1, 0, 5), dxfattribs={"layer": "slanted"})
    document.modelspace().add_spline([(0, 0, 0), (1, 1, 0), (2, 0, 1)], dxfattribs={"layer": "bent"})
    document.saveas(tmp_path / "high.dxf")
    assert list(read_dxf(tmp_path / "high.dxf", only={"level"})) == ["level"]
    for layer, said in (("slanted", "LINE .* extends from z = 0 to 5"), ("bent", "SPLINE .* extends from z = .* to 1")):
        with pytest.raises(HpcdemError, match=said):
            read_dxf(tmp_path / "high.dxf", only={layer})


def test_no_drawing(ezdxf, tmp_path):
    with pytest.raises(CommandError, match="no such file"):
        read_dxf(tmp_path / "none.dxf")
    for text in ("hello\n", "", "0\nSECTION\n2\nENTITIES\n0\nLINE\n"):
        (tmp_path / "bad.dxf").write_text(text)
        with pytest.raises(HpcdemError, match=r"bad\.dxf"):
            read_dxf(tmp_path / "bad.dxf")
    (tmp_path / "bad.dxf").write_bytes(bytes(range(256)) * 20)
    with pytest.raises(HpcdemError, match=r"bad\.dxf"):
        read_dxf(tmp_path / "bad.dxf")

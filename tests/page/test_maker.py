"""What the page asks for and gets: the library's specimen, and a message that says which row or field is wrong."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.page import maker
from hpcdem.page.limits import LIMITS, MOST_ROWS
from hpcdem.post.specimen import class_colours
from hpcdem.pre.specimen import PLACEMENTS, SHAPES, make_specimen
from tests.tables import each

TYPES = {"f4": "<f4", "i4": "<i4", "u1": "u1"}


def unpacked(content: bytes):
    """Header and arrays, as static/server.js reads them."""
    length = struct.unpack_from("<I", content)[0]
    assert (4 + length) % 4 == 0
    header = json.loads(content[4 : 4 + length])
    arrays = {}
    for entry in header["arrays"]:
        assert entry["offset"] % 4 == 0
        arrays[entry["name"]] = np.frombuffer(
            content, TYPES[entry["type"]], entry["count"], 4 + length + entry["offset"]
        )
    return header, arrays


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("placement", PLACEMENTS)
def test_the_page_gets_the_grains_of_the_library_in_mm(wanted, shape, placement):
    request = wanted(shape=shape, placement=placement)
    header, arrays = unpacked(maker.specimen(request))
    made = make_specimen(maker.request_of(request))
    assert header["placed"] == header["number"] == len(made) == 300
    scale = 1e3 * max(made.width, float(made.y.max()))
    for name, values in (("cx", made.x), ("cy", made.y), ("reach", made.reach)):
        np.testing.assert_allclose(arrays[name], 1e3 * values, rtol=0, atol=1e-7 * scale)
    np.testing.assert_array_equal(arrays["kind"], made.class_of)
    if shape == "circle":
        assert "vx" not in arrays
    else:
        np.testing.assert_array_equal(arrays["start"], made.outlines.start)
        np.testing.assert_allclose(arrays["vx"], 1e3 * made.outlines.x, rtol=0, atol=1e-7 * scale)
        np.testing.assert_allclose(arrays["vy"], 1e3 * made.outlines.y, rtol=0, atol=1e-7 * scale)
        np.testing.assert_allclose(arrays["theta"], made.outlines.theta, rtol=1e-7)
    assert [c["count"] for c in header["classes"]] == made.counts.tolist()
    assert header["box"] == {"width": 1e3 * made.width, "height": 1e3 * made.height}
    left, bottom, right, top = header["extent"]
    assert -1e-9 <= left < right <= header["box"]["width"] * (1 + 1e-12)
    assert -1e-9 <= bottom < top and header["seconds"] > 0.0


def test_counts_of_the_manuals_table(wanted):
    """17, 28, 37, 598, 3320 grains: N f_k / d_k^2 over its sum, rounded by the largest remainder; 200 grains of the
    manual's other table have none of 10 mm, which needs N = 5117."""
    header, _ = unpacked(maker.specimen(wanted(number=4000, shape="circle")))
    assert [c["count"] for c in header["classes"]] == [17, 28, 37, 598, 3320]
    assert header["classes"][0]["needed"] == 241  # 1 / 0.0041505
    rows = [["10", "100"], ["5", "95"], ["1", "75"], ["0.5", "60"]]
    header, _ = unpacked(
        maker.specimen(wanted(number=400, rows=rows, shape="circle", placement="cells", slenderness=0.5))
    )
    assert header["classes"][0]["count"] == 0 and header["classes"][0]["needed"] == header["needed"] == 5117


def test_cu_and_cc_are_null_where_the_curve_does_not_reach(wanted):
    header, _ = unpacked(maker.specimen(wanted()))
    assert header["cu"] == {"target": None, "reached": None}  # 40 % are finer than the last size
    rows = [["4", "100"], ["2", "60"], ["1", "30"], ["0.5", "10"]]
    header, _ = unpacked(maker.specimen(wanted(rows=rows)))
    assert header["cu"]["target"] == pytest.approx(4.0) and header["cc"]["target"] == pytest.approx(1.0)


def test_every_class_has_a_colour_of_its_own():
    for number in (1, 2, 5, MOST_ROWS):
        colours = class_colours(number)
        assert len(set(colours)) == number
        assert all(len(c) == 7 and c[0] == "#" and int(c[1:], 16) >= 0 for c in colours)


@each(
    ("rows", "message"),
    [
        ([["3", "100"], ["2", "abc"]], r"table:2: read '2 abc', expected a size in mm and the per cent finer"),
        ([["3", "100"], ["2", ""]], r"table:2: read '2'"),
        ([["3", "100"], ["2 80", ""]], r"table:2: read '2 80'"),
        ([["3", "100"], ["2", "80 70"]], r"table:2: read '2 80 70'"),
        ([["3", "100"], ["2", "80#"]], r"table:2"),
        ([["3", "100"], ["2", "0,5"]], r"table:2"),
        ([["3", "100"], ["", ""], ["3", "80"]], r"table:3: size 3 mm after 3 mm"),
        ([["3", "100"], ["2", "80"], ["1", "90"]], r"table:3: 90 % finer than 1 mm"),
        ([["3", "90"]], r"table:1: 90 % finer than the largest size"),
        ([["-3", "100"]], r"table:1: size -3 mm"),
        ([["nan", "100"]], r"table:1"),
        ([["3", "101"]], r"table:1: 101 % finer"),
        ([], r"table:1: contains no rows"),
        ([["", ""]], r"table:\d: contains no rows"),
        ([["3", "100"]] * (MOST_ROWS + 1), rf"table: {MOST_ROWS + 1} rows, at most {MOST_ROWS}"),
        (None, r"table: expected rows of two values"),
        ([["1", "2", "3"]], r"table: expected rows of two values"),
        (["3 100"], r"table: expected rows of two values"),
        ([[{"a": 1}, [2]]], r"table:1: read"),
    ],
)
def test_a_wrong_table_is_refused_with_its_row(wanted, rows, message):
    with pytest.raises(HpcdemError, match=message):
        maker.specimen(wanted(rows=rows))


def test_empty_rows_are_passed_over(wanted):
    rows = wanted()["rows"]
    with_gaps = [["", ""], rows[0], [" ", ""], *rows[1:], ["", ""]]
    assert maker.request_of(wanted(rows=with_gaps)) == maker.request_of(wanted())


@each("name", LIMITS)
@each(
    "value",
    ["below", "above", None, True, "7", [1], float("nan"), float("inf"), 10**400, "missing"],
    ids=lambda value: str(value)[:9],
)
def test_a_wrong_number_is_refused_with_the_name_of_its_field(wanted, name, value):
    low, high = LIMITS[name]
    request = wanted(
        **{name: {"below": low - 1, "above": high + 1}.get(value, value) if isinstance(value, str) else value}
    )
    if value == "missing":
        del request[name]
    with pytest.raises(HpcdemError, match=f"^{name}: .*expected"):
        maker.request_of(request)


@pytest.mark.parametrize(("name", "value"), [("number", 300.5), ("seed", 0.1), ("shape", "hexagon"), ("shape", None)])
def test_other_wrong_values(wanted, name, value):
    with pytest.raises(HpcdemError, match=f"^{name}: "):
        maker.request_of(wanted(**{name: value}))


def test_the_limit_of_the_angle_deviation_is_the_shapes(wanted):
    assert maker.request_of(wanted(shape="triangle", deviation=54.5)).deviation == 54.5
    with pytest.raises(HpcdemError, match=r"angle deviation 54.5, expected 0 to below 31 degrees for a pentagon"):
        maker.request_of(wanted(shape="pentagon", deviation=54.5))

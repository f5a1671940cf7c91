"""Whole specimens: counts, box, places without overlap, the same for the same seed."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.pre.specimen import Request, Specimen, make_specimen
from hpcdem.pre.specimen.dense import closest
from tests.specimen.shapes import EXAMPLE, KINDS, WINDOW, shapely_polygons
from tests.tables import each

PER_ARC = 32
"""Chords per arc for shapely: they leave out at most d / 2 (1 - cos(pi / 64)) = 6e-4 d of a half circle, 2e-5 d of
the arcs of the other shapes here."""


def overlaps(made: Specimen, per_arc: int = PER_ARC) -> float:
    """The largest overlap of two grains over the smaller one's area, by shapely: polygons with vertices on the
    outlines, of which nothing but the chords' sagittas is left out."""
    shapely = pytest.importorskip("shapely")
    polygons = shapely_polygons(made.outlines, per_arc)
    assert shapely.is_valid(polygons).all()
    tree = shapely.STRtree(polygons)
    i, j = tree.query(polygons, predicate="intersects")
    i, j = i[i < j], j[i < j]
    if not len(i):
        return 0.0
    area = shapely.area(shapely.intersection(polygons[i], polygons[j]))
    smaller = np.minimum(shapely.area(polygons[i]), shapely.area(polygons[j]))
    return float((area / smaller).max())


def inside(made: Specimen, width: float, height: float) -> bool:
    left, right, bottom, top = made.outlines.boxes().T
    return bool(left.min() >= 0 and right.max() <= width and bottom.min() >= 0 and top.max() <= height)


def test_box() -> None:
    """Manual's example, 200 circles: A = pi/4 (25 + 12 + 187/4) = 65.777 mm2, W = sqrt(1.5 A / 2) = 7.024 mm, H = 2 W;
    its window's grading, 4000 circles: A = 589.28 mm2, 21.02 x 42.05 mm."""
    made = make_specimen(Request(*EXAMPLE, placement="cells"))
    assert 1e6 * made.area.sum() == pytest.approx(65.777, abs=5e-4)
    assert (1e3 * made.width, 1e3 * made.height) == pytest.approx((7.024, 14.047), abs=5.1e-4)
    made = make_specimen(Request(*WINDOW, number=4000))
    assert 1e6 * made.area.sum() == pytest.approx(589.28, abs=5e-3)
    assert (1e3 * made.width, 1e3 * made.height) == pytest.approx((21.02, 42.05), abs=6e-3)
    assert made.counts.tolist() == [17, 28, 37, 598, 3320]


@pytest.mark.some_of_each
@pytest.mark.parametrize("shape", KINDS)
@pytest.mark.parametrize("number", [1000, 4000])
def test_cells(shape: str, number: int) -> None:
    """One grain in each cell of two largest grains, whole; filled row by row; at all places and in random order."""
    made = make_specimen(Request(*WINDOW, shape, number, placement="cells", slenderness=0.5, **KINDS[shape]))
    side = 2.0 * 2.0 * made.reach.max()
    columns = int(made.width / side)
    k = np.arange(number)
    across = made.width / columns
    x, y = made.x - across * (k % columns), made.y - side * (k // columns)
    assert columns > 1 and side == pytest.approx(6e-3)
    for place, room in ((x, across), (y, side)):
        assert (place >= made.reach).all() and (place <= room - made.reach).all()
        part = (place - made.reach) / (room - 2 * made.reach)
        assert np.abs(np.histogram(part, 5, (0, 1))[0] / number - 0.2).max() < 4 * math.sqrt(0.16 / number)
    assert made.density.room[1] == pytest.approx(side * math.ceil(number / columns))
    assert overlaps(made) == 0.0 and inside(made, *made.density.room)
    # No order: the mean place of the many is that of all.
    mean = k[made.class_of == 4].mean() / number
    assert abs(mean - 0.5) < 4 * math.sqrt(1 / 12 / (0.83 * number))


@pytest.mark.parametrize("shape", KINDS)
def test_dense(shape: str) -> None:
    """In the box, at its void ratio, with no overlap: not by our own measure, nor by shapely's."""
    made = make_specimen(Request(*WINDOW, shape, 1500, **KINDS[shape]))
    assert made.density.void_ratio == pytest.approx(0.5, abs=1e-12) and made.density.raised == 1.0
    assert made.density.room == (made.width, made.height) and inside(made, made.width, made.height)
    assert closest(made.body, made.reach, made.x, made.y, made.angle) > 0.0
    assert overlaps(made) == 0.0
    assert 800 < made.density.added < 1500 and made.density.sweeps > 0


def test_overlaps_are_seen() -> None:
    """The check of these tests: grains moved by a hundredth of the smallest radius do overlap."""
    made = make_specimen(Request(*WINDOW, "pentagon", 500, void_ratio=0.35, **KINDS["pentagon"]))
    rng = np.random.default_rng(1)
    x = made.x + rng.uniform(-0.01, 0.01, 500) * made.reach.min()
    moved = Specimen(
        made.request, made.grading, made.class_of, made.size, made.body, x, made.y, made.angle, made.reach, made.width,
        made.height, made.density,
    )  # fmt: skip
    assert overlaps(moved) > 0.0
    assert closest(made.body, made.reach, x, made.y, made.angle) < 0.0


@pytest.mark.parametrize(
    "shape", ["circle", *(pytest.param(one, marks=pytest.mark.slow) for one in ("triangle", "quadrilateral"))]
)
def test_too_dense_raises_the_box(shape: str) -> None:
    """A void ratio that cannot be had: grains still do not overlap, and the room says what was possible (discs of
    random close packing, 0.84 of the area, have 0.19; some 20 grains across a box with hard walls, a little more)."""
    made = make_specimen(Request((2.0, 1.0), (100.0, 60.0), shape, 400, void_ratio=0.03))
    width, height = made.density.room
    assert width == made.width and made.height < height < 1.4 * made.height
    assert made.density.raised == height / made.height
    assert made.density.void_ratio == pytest.approx(width * height / made.area.sum() - 1.0)
    assert 0.03 < made.density.void_ratio < 0.27
    assert overlaps(made) == 0.0 and inside(made, width, height)


def test_sharp_triangles_of_one_size() -> None:
    """Flat edges that meet must not rock on each other for ever."""
    made = make_specimen(Request((1.0,), (100.0,), "triangle", 400, void_ratio=0.4))
    assert made.density.void_ratio == pytest.approx(0.4) and made.density.sweeps < 3000
    assert overlaps(made) == 0.0


def test_wide_grading() -> None:
    """Sizes from 1 to 40: grains of all levels are found."""
    made = make_specimen(Request((40.0, 8.0, 1.0), (100.0, 60.0, 30.0), "ellipse", 3000, void_ratio=0.4))
    assert made.counts[0] >= 1 and inside(made, made.width, made.height)
    assert made.density.void_ratio == pytest.approx(0.4) and overlaps(made) == 0.0


@pytest.mark.parametrize("placement", ["cells", "dense"])
def test_seed(placement: str) -> None:
    request = Request(*WINDOW, "pentagon", 300, placement=placement, **KINDS["pentagon"])
    one, two = (make_specimen(request) for _ in range(2))
    other = make_specimen(Request(**{**request.__dict__, "seed": 1}))
    for name in ("x", "y", "angle"):
        assert (getattr(one, name) == getattr(two, name)).all()
        assert (getattr(one, name) != getattr(other, name)).mean() > 0.9
    assert (one.body.x == two.body.x).all() and (one.body.x != other.body.x).all()


def test_orientations_are_random() -> None:
    made = make_specimen(Request(*WINDOW, "triangle", 2000, void_ratio=3.0))
    # The mean of unit vectors of angle 3 a is near 0 (2000 of them: 1 / sqrt(2000) = 0.022).
    assert abs(np.exp(3j * made.angle).mean()) < 0.08


@pytest.mark.parametrize("shape", KINDS)
def test_width_given(shape: str) -> None:
    """The number of grains follows; the box is what was asked for, its void ratio too, but for whole grains."""
    request = Request(*WINDOW, shape, number=None, width=20e-3, slenderness=1.5, placement="cells", **KINDS[shape])
    made = make_specimen(request)
    assert made.width == 20e-3 and made.height == pytest.approx(30e-3)
    assert 600e-6 / made.area.sum() - 1.0 == pytest.approx(0.5, abs=0.03)


@pytest.mark.some_of_each
@pytest.mark.parametrize("shape", KINDS)
@pytest.mark.parametrize("curve", [EXAMPLE, WINDOW])
def test_grading_by_true_areas(curve: tuple, shape: str) -> None:
    """Within 1 % of the target everywhere at 4000 grains with more than the largest grain's share of an area each, and
    by number as the counts say."""
    made = make_specimen(Request(*curve, shape, 20000, placement="cells", **KINDS[shape]))
    for row in made.rows:
        assert abs(row.by_area - row.target) < 1.0
        assert abs(row.by_number - row.by_area) < 0.7  # polygons of one size differ in area
    assert sum(row.count for row in made.rows) == 20000


@each(
    "words, message",
    [
        ({"number": 0}, "number of grains 0, expected 1 to 1000000"),
        ({"number": None}, "either the number of grains or the width"),
        ({"width": 0.01}, "either the number of grains or the width"),
        ({"number": None, "width": -1.0}, "width -1, expected a number above 0"),
        ({"number": None, "width": 1e-6}, "a box 1e-06 m wide contains .* such grains"),
        ({"number": None, "width": 100.0}, "a box 100 m wide contains .* such grains"),
        ({"slenderness": 0.0}, "slenderness 0, expected"),
        ({"slenderness": math.nan}, "slenderness nan, expected"),
        ({"void_ratio": -0.5}, "void ratio -0.5, expected"),
        ({"void_ratio": math.inf}, "void ratio inf, expected"),
        ({"mass_exponent": 1}, "mass exponent 1, expected 2"),
        ({"placement": "stacked"}, "placement 'stacked', expected one of cells, dense"),
        ({"cell": 0.5}, "cell 0.5 times"),
        ({"seed": -1}, "seed -1, expected"),
        ({"shape": "ellipse", "roundness": 0.3}, "roundness 0.3 applies to triangle, quadrilateral, pentagon grains"),
        ({"deviation": 3.0}, "deviation 3.0 applies to triangle, .* not to circle grains; omit it"),
        ({"shape": "pentagon", "l_over_d": 2.0}, "l over d 2.0 applies to ellipse grains, not to pentagon grains"),
        ({"size_rule": "area"}, "size rule area applies to ellipse grains, not to circle grains"),
        ({"number": 1}, "the box is .* mm wide and .* mm high, the largest grain 0.3 mm long"),
        ({"number": 30, "slenderness": 200.0}, "use more grains, or another slenderness"),
        ({"number": 30, "slenderness": 0.01}, "use more grains, or another slenderness"),
    ],
)
def test_refused(words: dict, message: str) -> None:
    with pytest.raises(CommandError, match=message):
        make_specimen(Request(*WINDOW, **words))


@pytest.mark.slow
@pytest.mark.parametrize("placement", ["cells", "dense"])
@pytest.mark.parametrize("shape", KINDS)
def test_ten_thousand_in_a_minute(shape: str, placement: str) -> None:
    """Time of this process; on a machine of its own that is the time by the clock."""
    make_specimen(
        Request(*WINDOW, shape, 50, slenderness=1.0, void_ratio=3.0, placement=placement, **KINDS[shape])
    )  # compile
    began = time.process_time()
    made = make_specimen(Request(*WINDOW, shape, 10_000, placement=placement, **KINDS[shape]))
    seconds = time.process_time() - began
    print(
        f"{shape} {placement}: {seconds:.2f} s, void ratio {made.density.void_ratio:.4g}, {made.density.sweeps} rounds"
    )
    assert seconds < 60.0
    assert overlaps(made, 16) == 0.0
    if placement == "dense":
        assert made.density.void_ratio == pytest.approx(0.5)

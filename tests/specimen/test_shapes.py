"""Shapes of grains: four-arc ellipses and rounded polygons."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.polyarc.moments import moments
from hpcdem.physics.polyarc.outlines import arc_circles, sampled
from hpcdem.pre.specimen.shapes import SIDES, bodies, oval, polygons


def test_ellipse_by_hand() -> None:
    """a = 1, b = 0.5: Q = sqrt(4.25), h = 0.5 (1.5 + Q) / (0.5 + Q) = 0.695194, k = 0.5 (2.5 + Q) / 2 = 1.140388."""
    o = oval(np.array([1.0]), np.array([0.5]))
    radius, cx, cy, _ = arc_circles(o)
    assert radius == pytest.approx([1.640388, 0.304806, 1.640388, 0.304806], abs=5e-7)
    assert (cx[1], cy[0]) == pytest.approx((-0.695194, -1.140388), abs=5e-7)
    assert (o.x[0], o.y[0]) == pytest.approx((0.853851, 0.260259), abs=5e-7)
    assert np.degrees(o.theta) == pytest.approx([62.73396, 117.26604] * 2, abs=5e-6)
    assert moments(o)[0][0] == pytest.approx(0.98730 * math.pi * 0.5, rel=1e-5)
    assert moments(oval(np.array([1.0]), np.array([0.8])))[0][0] == pytest.approx(0.99862 * math.pi * 0.8, rel=1e-5)


@pytest.mark.parametrize("ratio", [1.0001, 1.1, 1.25, 2.0, 4.0, 20.0])
def test_ellipse_is_smooth_and_passes_where_it_should(ratio: float) -> None:
    """Junctions on the ellipse; the same normal on both sides; the four vertices; 360 degrees in all."""
    a, b = 3.0, 3.0 / ratio
    o = oval(np.array([a]), np.array([b]))
    # Close to a circle h and k are differences of nearly equal numbers.
    tolerance = 1e-12 * max(1.0, 1e-2 / (ratio - 1.0))
    assert (o.x / a) ** 2 + (o.y / b) ** 2 == pytest.approx(np.ones(4), abs=tolerance)
    radius, cx, cy, first = arc_circles(o)
    turn = (np.roll(first, -1) - first - o.theta + math.pi) % (2 * math.pi) - math.pi
    assert np.abs(turn).max() < tolerance
    assert o.theta.sum() == pytest.approx(2 * math.pi, abs=1e-14)
    assert o.boxes()[0] == pytest.approx([-a, a, -b, b], abs=a * tolerance)


def test_ellipse_sizes() -> None:
    size = np.array([2.0])
    for rule, a in (("major", 1.0), ("minor", 3.0)):
        outline, reach = bodies("ellipse", size, 3.0, rule)
        assert reach[0] == a and outline.boxes()[0] == pytest.approx([-a, a, -a / 3, a / 3])
    outline, reach = bodies("ellipse", size, 3.0, "area")
    assert moments(outline)[0][0] == pytest.approx(math.pi, rel=1e-14)
    circle, _ = bodies("ellipse", size, 1.0)
    assert circle.theta.tolist() == [math.pi, math.pi] and circle.boxes()[0] == pytest.approx([-1, 1, -1, 1])


@pytest.mark.parametrize("shape", SIDES)
@pytest.mark.parametrize("roundness", [0.0, 0.3, 1.0])
def test_polygons(shape: str, roundness: float) -> None:
    """Vertices on the circle and anticlockwise, each off by at most the deviation, both ways; central angles together
    360 R degrees; nothing outside the circle; R = 1 is the circle."""
    sides, deviation = SIDES[shape], 12.0
    size = np.linspace(1.0, 2.0, 500)
    o, reach = bodies(shape, size, deviation=deviation, roundness=roundness, seed=3)
    x, y, theta = (v.reshape(-1, sides) for v in (o.x, o.y, o.theta))
    assert np.hypot(x, y) == pytest.approx(np.repeat(size[:, None] / 2, sides, 1), rel=1e-14)
    off = np.degrees(np.arctan2(y, x)) - 360.0 * np.arange(sides) / sides
    off = (off + 180.0) % 360.0 - 180.0
    assert np.abs(off).max() <= deviation and off.min() < -0.9 * deviation and off.max() > 0.9 * deviation
    assert abs(off.mean()) < 3.0 * deviation / math.sqrt(3 * off.size)
    assert theta.sum(1) == pytest.approx(np.full(500, 2 * math.pi * roundness), abs=1e-14)
    inside = np.linalg.norm(sampled(o, 20), axis=2) / reach[:, None]
    assert inside.max() <= 1.0 + 1e-14
    area = moments(o)[0]
    assert (area > 0).all()
    if roundness == 1.0:
        assert inside.min() > 1.0 - 1e-14 and area == pytest.approx(math.pi * size**2 / 4, rel=1e-13)


def test_grains_do_not_depend_on_those_behind_them() -> None:
    few, many = (polygons(4, np.ones(n), 10.0, 0.5, 9) for n in (10, 1000))
    assert (few.x == many.x[:40]).all()
    assert (polygons(4, np.ones(10), 10.0, 0.5, 10).x != few.x).any()


@pytest.mark.parametrize(
    "words, message",
    [
        ({"shape": "hexagon"}, "shape 'hexagon', expected one of circle"),
        ({"shape": "ellipse", "l_over_d": 0.5}, "L/D 0.5, expected 1 to 20"),
        ({"shape": "ellipse", "l_over_d": math.nan}, "L/D nan"),
        ({"shape": "ellipse", "size_rule": "volume"}, "size rule 'volume'"),
        ({"shape": "triangle", "deviation": 55.0}, "expected 0 to below 55 degrees for a triangle"),
        ({"shape": "pentagon", "deviation": -1.0}, "expected 0 to below 31"),
        ({"shape": "triangle", "roundness": 1.1}, "roundness 1.1, expected 0"),
        ({"shape": "triangle", "roundness": math.nan}, "roundness nan"),
    ],
)
def test_refused_shapes(words: dict, message: str) -> None:
    with pytest.raises(CommandError, match=message):
        bodies(size=np.ones(1), **words)

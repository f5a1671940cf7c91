"""Outlines of arcs: moments against closed forms and quadrature, the gap against brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.numerics.rng import uniform
from hpcdem.physics.polyarc.gap import fans, farthest, gap
from hpcdem.physics.polyarc.moments import moments, segment
from hpcdem.physics.polyarc.outlines import Outlines, arc_circles, sampled, uniform_outlines
from hpcdem.pre.specimen.shapes import bodies, oval, polygons
from tests.tables import each


def test_segment_by_hand() -> None:
    """Radius 2, central angle 1.3: 2 (1.3 - sin 1.3) = 0.672884; centroid 4 R sin^3(t/2) / (3 (t - sin t)) = 1.756816
    from the centre; polar moment about the centre R^4 (t/4 - sin t (2 + cos t) / 12) = 2.286844."""
    r, t = 2.0, 1.3
    area, first, second = segment(2 * r * math.sin(t / 2), t)
    h = r * math.cos(t / 2)
    assert area == pytest.approx(0.672884, abs=5e-7)
    assert first / area + h == pytest.approx(1.756816, abs=5e-7)
    # From the middle of the chord to the centre: |p|^2 = |q|^2 + 2 h y + h^2.
    assert second + 2 * h * first + h * h * area == pytest.approx(2.286844, abs=5e-7)


@pytest.mark.parametrize("t", [1e-9, 1e-5, 1e-3, 0.1, 0.99, 1.01, 3.0, 6.0])
def test_segment_for_any_angle(t: float) -> None:
    """Against Gauss-Legendre quadrature over strips along the chord, which cancels nothing: y from 0 to
    R cos(s) - R cos(t/2) = 2 R sin((t/2 + s) / 2) sin((t/2 - s) / 2) at x = R sin s. Beyond half a turn over the angle
    about the centre instead."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    chord, r = 1.0, 0.5 / math.sin(t / 2)
    if t < math.pi:
        s, w = nodes * t / 2, weights * t / 2
        x, dx = r * np.sin(s), r * np.cos(s) * w
        y = 2 * r * np.sin((t / 2 + s) / 2) * np.sin((t / 2 - s) / 2)
        expected = (y * dx).sum(), (y * y / 2 * dx).sum(), ((x * x * y + y**3 / 3) * dx).sum()
    else:
        h = r * math.cos(t / 2)
        s, w = nodes * t / 2, weights * t / 2
        sector = r * r * t / 2, (r**3 / 3 * np.cos(s) * w).sum(), r**4 * t / 4
        triangle = -h * 0.5, -h * h / 3, -h * (h * h / 4 + 1 / 48)  # the part that is not in the sector, h < 0
        area = sector[0] + triangle[0]
        about = sector[1] + triangle[1] * h / abs(h) * -1
        polar = sector[2] + triangle[2]
        expected = area, about - h * area, polar - 2 * h * about + h * h * area
    assert segment(chord, t) == pytest.approx(expected, rel=2e-12)


def test_circle() -> None:
    """Two half circles: pi r^2, and pi r^4 / 2 about the centre, also far from the origin."""
    outline, _ = bodies("circle", np.array([3.0]))
    place = outline.placed(np.array([1e6]), np.array([-2e6]), np.array([0.3]))
    area, x, y, polar = (v[0] for v in moments(place))
    assert (area, x, y) == pytest.approx((math.pi * 2.25, 1e6, -2e6), rel=1e-9)
    assert polar == pytest.approx(math.pi * 1.5**4 / 2, rel=1e-8)
    area, x, y, polar = (v[0] for v in moments(outline))
    assert (area, polar) == pytest.approx((math.pi * 2.25, math.pi * 1.5**4 / 2), rel=1e-14)
    assert abs(x) + abs(y) < 1e-15


@pytest.mark.parametrize(
    "sides, roundness, factor",
    [(3, 0, 0.41350), (3, 0.2, 0.51409), (3, 0.5, 0.67301), (4, 0, 0.63662), (4, 0.2, 0.70351), (4, 0.5, 0.80679),
     (5, 0, 0.75683), (5, 0.2, 0.80299), (5, 0.5, 0.87353), (3, 1, 1), (4, 1, 1), (5, 1, 1)],
)  # fmt: skip
def test_areas_of_regular_polygons_over_their_circle(sides: int, roundness: float, factor: float) -> None:
    """n/2 sin(2 pi / n) r^2 and n segments of radius r sin(pi/n) / sin(R pi/n) and angle 2 pi R / n; the numbers are
    this worked out by hand."""
    area, x, y, _ = (v[0] for v in moments(polygons(sides, np.array([2.0]), 0.0, roundness, 0)))
    assert area / math.pi == pytest.approx(factor, abs=5.1e-6)
    assert math.hypot(x, y) < 1e-15


def test_moments_of_an_irregular_outline_against_a_fine_polygon() -> None:
    """Sums over 3 x 20000 chords; their error falls with the square of the number: 1e-9."""
    outline = polygons(3, np.array([2.0]), 30.0, 0.7, 5).placed(np.array([3.0]), np.array([-1.0]), np.array([0.4]))
    p = sampled(outline, 20000)[0]
    q = np.roll(p, -1, 0)
    cross = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
    area = cross.sum() / 2
    centre = (cross[:, None] * (p + q)).sum(0) / 6 / area
    polar = (cross * (p * p + p * q + q * q).sum(1)).sum() / 12 - area * (centre**2).sum()
    got = [v[0] for v in moments(outline)]
    assert got == pytest.approx([area, *centre, polar], rel=3e-9)


def test_nearly_straight_edges_go_over_into_straight_ones() -> None:
    straight = moments(polygons(4, np.array([1.0]), 10.0, 0.0, 1))
    nearly = moments(polygons(4, np.array([1.0]), 10.0, 1e-10, 1))
    for a, b in zip(straight, nearly):
        assert a == pytest.approx(b, abs=1e-9)
    assert np.isinf(arc_circles(polygons(4, np.array([1.0]), 10.0, 0.0, 1))[0]).all()


@pytest.mark.parametrize("kind", range(5))
def test_boxes_and_samples(kind: int) -> None:
    outline = irregular(kind)
    p = sampled(outline, 5000)[0]
    expected = p[:, 0].min(), p[:, 0].max(), p[:, 1].min(), p[:, 1].max()
    assert outline.boxes()[0] == pytest.approx(expected, abs=1e-6)
    radius, cx, cy, first = arc_circles(outline)
    arc = np.repeat(np.arange(outline.arcs_each), 5000)
    curved = np.isfinite(radius)[arc]
    assert np.hypot(p[:, 0] - cx[arc], p[:, 1] - cy[arc])[curved] == pytest.approx(radius[arc][curved], rel=1e-9)


def irregular(k: int, seed: int = 0) -> Outlines:
    """Bodies of all kinds, one with an arc of more than half a turn."""
    size = np.array([1.0 + uniform(seed, 1, k)])
    if k % 5 == 0:
        return oval(size, size * (0.2 + 0.8 * uniform(seed, 2, k)))
    if k % 5 == 1:
        return polygons(3, size, 54.0, 0.95, 3 + seed)
    if k % 5 == 2:
        return polygons(3, size, 20.0, 0.0, k + seed)
    return polygons(4 if k % 5 == 3 else 5, size, 15.0, uniform(seed, 3, k), k + seed)


def both(a: Outlines, b: Outlines) -> Outlines:
    start = np.concatenate([a.start, b.start[1:] + a.start[-1]])
    return Outlines(start, *(np.concatenate([getattr(a, k), getattr(b, k)]) for k in ("x", "y", "theta")))


def support(outline: Outlines, angle: np.ndarray, per_arc: int = 4000) -> np.ndarray:
    p = sampled(outline, per_arc)[0]
    return np.array([(p @ (math.cos(t), math.sin(t))).max() for t in angle])


@each("case", range(20))
def test_gap_is_the_largest_over_all_directions(case: int) -> None:
    """max over 4000 directions of u . D - hA(u) - hB(-u), supports from sampled outlines; both errors are of second
    order, 1e-6 for arcs, but of first order where the best direction is that of a straight edge."""
    a, b = irregular(case, 1), irregular(case // 5 + case, 7)
    fan = fans(both(a, b))
    far = 2.6 * uniform(0, 5, case)
    way = 2 * math.pi * uniform(0, 6, case)
    dx, dy, ta, tb = far * math.cos(way), far * math.sin(way), 6 * uniform(0, 7, case), 6 * uniform(0, 8, case)
    angle = np.linspace(0, 2 * math.pi, 4000, endpoint=False)
    zero = np.zeros(1)
    ha = support(a.placed(zero, zero, np.array([ta])), angle, 500)
    hb = support(b.placed(zero, zero, np.array([tb])), angle + math.pi, 500)
    expected = (dx * np.cos(angle) + dy * np.sin(angle) - ha - hb).max()
    got, ux, uy = gap(fan, 0, 1, dx, dy, ta, tb, np.inf)
    assert expected - 2e-5 < got < expected + 3e-3
    # In the direction it names, the gap is what it says; from the other body it is the same.
    t = np.array([math.atan2(uy, ux)])
    sides = (
        support(a.placed(zero, zero, np.array([ta])), t)[0],
        support(b.placed(zero, zero, np.array([tb])), t + np.pi)[0],
    )
    assert ux * dx + uy * dy - sum(sides) == pytest.approx(got, abs=1e-6)
    back, vx, vy = gap(fan, 1, 0, -dx, -dy, tb, ta, np.inf)
    assert back == pytest.approx(got, abs=1e-12)
    assert gap(fan, 0, 1, dx, dy, ta, tb, -10.0)[0] <= got + 1e-12
    px, py = farthest(fan, 0, ta, ux, uy)
    assert px * ux + py * uy == pytest.approx(sides[0], abs=1e-6)


def square(side: float) -> Outlines:
    h = side / 2
    return uniform_outlines(np.array([[h, -h, -h, h]]), np.array([[h, h, -h, -h]]), np.zeros((1, 4)))


def test_gap_by_hand() -> None:
    """Two squares of side 2: face to face, corner to corner, corner into face (turned by 45 degrees the half diagonal
    is sqrt 2), one inside the other; a square and a circle at its corner."""
    fan = fans(both(square(2.0), square(2.0)))
    assert gap(fan, 0, 1, 3.0, 0.5, 0.0, 0.0, np.inf)[0] == pytest.approx(1.0, abs=1e-15)
    assert gap(fan, 0, 1, 3.0, 4.0, 0.0, 0.0, np.inf)[0] == pytest.approx(math.hypot(1.0, 2.0), abs=1e-15)
    turned = gap(fan, 0, 1, 2.0, 0.3, 0.0, math.pi / 4, np.inf)
    assert turned[0] == pytest.approx(1.0 - math.sqrt(2.0), abs=1e-15) and turned[1:] == pytest.approx((1.0, 0.0))
    assert gap(fan, 0, 1, 0.0, 0.0, 0.0, 0.0, np.inf)[0] == pytest.approx(-2.0, abs=1e-15)
    circle, _ = bodies("circle", np.array([1.0]))
    fan = fans(both(square(2.0), circle))
    assert gap(fan, 0, 1, 4.0, 5.0, 0.0, 0.0, np.inf)[0] == pytest.approx(5.0 - 0.5, abs=1e-14)
    assert gap(fan, 0, 1, 1.2, 0.3, 0.0, 2.0, np.inf)[0] == pytest.approx(-0.3, abs=1e-15)
    two = fans(both(circle, circle))
    for way in np.linspace(0.0, 6.2, 40):
        dx, dy = 1.7 * math.cos(way), 1.7 * math.sin(way)
        assert gap(two, 0, 1, dx, dy, 0.3 * way, 1.0, np.inf) == pytest.approx((0.7, dx / 1.7, dy / 1.7), abs=1e-14)

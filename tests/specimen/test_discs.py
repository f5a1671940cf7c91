"""Discs inside outlines: none sticks out, the outline is followed, few are enough."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.polyarc.moments import moments
from hpcdem.pre.specimen import Request, make_specimen, sampled
from hpcdem.pre.specimen.discs import GAP, inscribed, union_area
from hpcdem.pre.specimen.files import to_clumps
from hpcdem.pre.specimen.shapes import bodies, oval, polygons
from tests.specimen.shapes import KINDS, WINDOW


def test_union_area_by_hand() -> None:
    """Two unit discs a distance 1 apart: 2 pi - (2 pi / 3 - sqrt(3) / 2); one inside, one apart, equal ones; a ring
    of four around a hole: 4 pi - 4 lenses of unit discs sqrt(2) apart, each pi / 2 - 1."""
    lens = 2 * math.pi / 3 - math.sqrt(3) / 2
    one, two = np.ones(1), np.ones(2)
    assert union_area(0 * one, 0 * one, one) == pytest.approx(math.pi)
    assert union_area(np.array([0.0, 1.0]), 0 * two, two) == pytest.approx(2 * math.pi - lens)
    assert union_area(np.array([5.0, 5.2]), 0 * two, np.array([1.0, 0.3])) == pytest.approx(math.pi)
    assert union_area(np.array([5.0, 9.0]), 0 * two, np.array([1.0, 0.5])) == pytest.approx(1.25 * math.pi)
    assert union_area(3 * two, two, two) == pytest.approx(math.pi)
    x, y = np.array([1.0, -1.0, -1.0, 1.0]) / math.sqrt(2), np.array([1.0, 1.0, -1.0, -1.0]) / math.sqrt(2)
    assert union_area(x, y, np.ones(4)) == pytest.approx(4 * math.pi - 4 * (math.pi / 2 - 1))
    ring = np.array([0, 1, 2, 3, 4, 5]) * math.pi / 3
    assert union_area(2 * np.cos(ring), 2 * np.sin(ring), np.full(6, 1.0 + 1e-9)) == pytest.approx(6 * math.pi)


SIZE = np.array([0.7, 2.0, 2.0])
CASES = {
    "circle": (lambda: bodies("circle", SIZE)[0], 1),
    "ellipse 1.5": (lambda: oval(SIZE / 2, SIZE / 3), 6),
    "ellipse 4": (lambda: oval(SIZE / 2, SIZE / 8), 14),
    "triangle": (lambda: polygons(3, SIZE, 0.0, 0.0, 0), 22),
    "triangle 0.2": (lambda: polygons(3, SIZE, 15.0, 0.2, 1), 18),
    "flat triangle": (lambda: polygons(3, SIZE, 54.0, 0.9, 1), 20),
    "square": (lambda: polygons(4, SIZE, 0.0, 0.0, 0), 20),
    "pentagon 0.5": (lambda: polygons(5, SIZE, 10.0, 0.5, 0), 14),
    "round pentagon": (lambda: polygons(5, SIZE, 10.0, 1.0, 0), 1),
}


@pytest.mark.some_of_each
@pytest.mark.parametrize("gap", [0.01, GAP, 0.1])
@pytest.mark.parametrize("name", CASES)
def test_discs(name: str, gap: float) -> None:
    """No point of the outline inside a disc, none farther from the discs than the gap (4000 points on each arc, 2e-4 d
    apart; the gap that is reported is that of points a twentieth of the gap apart)."""
    size, (made, most) = SIZE, CASES[name]
    outlines = made()
    discs = inscribed(outlines, size, gap)
    area = moments(outlines)[0]
    for k in range(3):
        mine = slice(discs.start[k], discs.start[k + 1])
        x, y, r = discs.x[mine], discs.y[mine], discs.r[mine]
        p = sampled(outlines, 4000)[k]
        far = np.sqrt((p[:, :1] - x) ** 2 + (p[:, 1:] - y) ** 2) - r
        assert far.min() > -1e-12 * size[k]
        assert (np.abs(far.min(0)) < 1e-6 * size[k]).all(), "a disc touches nothing: it could be larger"
        worst = far.min(1).max()
        assert worst <= gap * size[k] and discs.gap[k] == pytest.approx(worst, abs=0.03 * gap * size[k])
        assert discs.coverage[k] == pytest.approx(union_area(x, y, r) / area[k])
        assert discs.coverage[k] <= 1.0 + 1e-12
        if gap == GAP:
            assert len(r) <= most and discs.coverage[k] > 0.9
    # Alike but for their size: the same discs.
    if name in ("circle", "ellipse 4", "triangle", "square"):
        assert discs.r[: discs.start[1]] / 0.7 == pytest.approx(discs.r[discs.start[1] : discs.start[2]] / 2.0)


def test_largest_inscribed_disc_of_a_triangle() -> None:
    """It is the first disc: of a regular triangle in a circle of diameter 2, radius 1/2 about the centre."""
    discs = inscribed(polygons(3, np.array([2.0]), 0.0, 0.0, 0), np.array([2.0]), 0.25)
    assert (discs.x[0], discs.y[0], discs.r[0]) == pytest.approx((0.0, 0.0, 0.5), abs=2e-3)


def test_clumps_have_the_moments_of_the_outlines() -> None:
    """Centroid, area and inertia are those of the outline where it lies, and its discs lie in it."""
    made = make_specimen(Request(*WINDOW, "triangle", 200, **KINDS["triangle"]))
    clumps, discs = to_clumps(made)
    area, cx, cy, polar = made.moments
    assert clumps.x == pytest.approx(cx, rel=1e-9) and clumps.y == pytest.approx(cy, rel=1e-9)
    assert clumps.area == pytest.approx(area, rel=1e-12) and clumps.inertia == pytest.approx(polar, rel=1e-9)
    points = sampled(made.outlines, 200)
    for k in range(200):
        mine = slice(clumps.start[k], clumps.start[k + 1])
        c, s = math.cos(clumps.angle[k]), math.sin(clumps.angle[k])
        x = clumps.x[k] + c * clumps.dx[mine] - s * clumps.dy[mine]
        y = clumps.y[k] + s * clumps.dx[mine] + c * clumps.dy[mine]
        far = np.hypot(points[k][:, :1] - x, points[k][:, 1:] - y) - clumps.r[mine]
        assert far.min() > -1e-12 * made.size[k] and far.min(1).max() <= GAP * made.size[k]


def test_refused_gap() -> None:
    with pytest.raises(CommandError, match=r"gap 0\.5 of the size"):
        inscribed(oval(np.ones(1), np.ones(1)), np.ones(1), 0.5)

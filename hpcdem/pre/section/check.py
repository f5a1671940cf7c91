"""Checks of the polygons and lines of a section: crossings are rejected, overlaps and gaps are reported."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.pre.mesh import optional
from hpcdem.pre.mesh.geometry import Curve, arc_of, polyline
from hpcdem.pre.section.shapes import Section

SMALLEST = 1e-9
"""Fraction of the area of all polygons: overlaps and gaps that are smaller are attributed to rounding."""
NARROW = 1e-3
"""Fraction of the size of the section: gaps that are open to the outside count if they are narrower."""
NEARLY = 0.05
"""Fraction of its length: a line whose ends are nearer to each other may be meant as a ring."""
MOST = 5
"""Number of faults of each kind that are named individually."""


def polygons(section: Section, file: str) -> np.ndarray:
    """The polygons of shapely, in the order of the section. HpcdemError for those that cross themselves, with the
    place."""
    shapely = optional.shapely()
    deviation = section.deviation
    made, wrong = [], []
    for shape in section.polygons:
        outline, *holes = shape.points(deviation)
        one = shapely.Polygon(outline, holes)
        if not one.is_valid:
            reason = shapely.is_valid_reason(one)
            at = re.fullmatch(r"(.*)\[(\S+) (\S+)\]", reason)
            place = f"{at[1].lower()} at ({float(at[2]):g}, {float(at[3]):g}) m" if at else reason.lower()
            wrong.append(f"'{shape.name}' ({shape.where}): {place}")
        made.append(one)
    if wrong:
        raise HpcdemError(
            f"{file}: {len(wrong)} polygons cross or touch themselves: {'; '.join(wrong[:MOST])}"
            + (f"; and {len(wrong) - MOST} more" if len(wrong) > MOST else "")
            + ". Correct them in the drawing"
        )
    found = np.empty(len(made), object)
    found[:] = made
    return found


def outline(section: Section, file: str) -> list[Curve]:
    """Closed curves about all polygons together, and about the gaps between them."""
    shapely = optional.shapely()
    whole = shapely.union_all(polygons(section, file))
    rings = [ring for part in shapely.get_parts(whole) for ring in (part.exterior, *part.interiors)]
    return [polyline(shapely.get_coordinates(ring).tolist(), closed=True) for ring in rings]


def areas(section: Section) -> list[float]:
    """Areas of the polygons without their holes [m2], arcs as arcs."""
    return [_area(shape.rings[0]) - sum(map(_area, shape.rings[1:])) for shape in section.polygons]


def _area(ring: Curve) -> float:
    x, y = (ring.points - ring.points[0]).T
    straight = 0.5 * math.fsum(x * np.roll(y, -1) - y * np.roll(x, -1))
    arcs = []
    for a, b, bulge in map(ring.segment, range(ring.segments)):
        if bulge:
            _, radius, _, sweep = arc_of(a, b, bulge)
            arcs.append(0.5 * radius * radius * (sweep - math.sin(sweep)))
    return abs(straight + math.fsum(arcs))


def warnings(section: Section, file: str) -> list[str]:
    """Overlaps, gaps, rings that are not closed, in words with place and size."""
    found = _nearly_closed(section)
    if section.polygons:
        made = polygons(section, file)
        found += _overlaps(section, made) + _gaps(made)
    return found


def _nearly_closed(section: Section) -> list[str]:
    found = []
    for shape in section.lines:
        if shape.rings[0].closed:
            continue
        first, last = shape.rings[0].points[[0, -1]]
        gap = math.dist(first, last)
        if 0.0 < gap < NEARLY * shape.length() and len(shape.rings[0].points) > 3:
            found.append(
                f"the line '{shape.name}' ({shape.where}) ends at ({last[0]:g}, {last[1]:g}), {gap:g} m from its "
                "start: it is a line, not a polygon; close it in the drawing if it bounds an area"
            )
    return _first(found, "lines that are nearly closed")


def _first(found: list[str], what: str) -> list[str]:
    return found[:MOST] + ([f"{len(found) - MOST} more {what}"] if len(found) > MOST else [])


def _overlaps(section: Section, made: np.ndarray) -> list[str]:
    shapely = optional.shapely()
    first, second = shapely.STRtree(made).query(made, predicate="intersects")
    pairs = first < second
    first, second = first[pairs], second[pairs]
    common = shapely.intersection(made[first], made[second])
    area = shapely.area(common)
    least = SMALLEST * float(shapely.area(made).sum())
    found = []
    for k in np.flatnonzero(area > least):
        one, other = (section.polygons[i] for i in (first[k], second[k]))
        found.append(
            f"'{one.name}' ({one.where}) and '{other.name}' ({other.where}) overlap by {area[k]:.4g} m2 at "
            f"{_place(common[k])}; '{other.name}', which is later in the file, takes precedence there"
        )
    return _first(found, "overlaps")


def _gaps(made: np.ndarray) -> list[str]:
    shapely = optional.shapely()
    whole = shapely.union_all(made)
    least = SMALLEST * float(whole.area)
    size = max(whole.bounds[2] - whole.bounds[0], whole.bounds[3] - whole.bounds[1])
    inner = [shapely.Polygon(ring) for part in shapely.get_parts(whole) for ring in part.interiors]
    wide = 0.5 * NARROW * size
    closed = shapely.buffer(shapely.buffer(whole, wide, join_style="mitre"), -wide, join_style="mitre")
    narrow = [one for one in shapely.get_parts(shapely.difference(closed, whole)) if one.area > least]
    narrow = [one for one in narrow if not any(ring.covers(one) for ring in inner)]
    found = []
    for one in sorted([*(ring for ring in inner if ring.area > least), *narrow], key=lambda one: -one.area):
        found.append(f"gap between polygons: {one.area:.4g} m2 at {_place(one)}; it remains empty")
    return _first(found, "gaps")


def _place(area: Any) -> str:
    """Describe position, length and width of an area by its narrowest enclosing rectangle."""
    shapely = optional.shapely()
    at = shapely.point_on_surface(area)
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(area))
    sides = sorted(float(np.hypot(*(corners[k + 1] - corners[k]))) for k in range(min(2, len(corners) - 1)))
    width, length = (0.0, *sides)[-2:]
    return f"({at.x:.6g}, {at.y:.6g}) m, {length:.4g} m long and {width:.4g} m wide"

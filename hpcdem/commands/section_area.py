"""Areas of the polygons of a section, for estimates before a run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hpcdem.pre.section import check
from hpcdem.pre.section.read import read
from hpcdem.pre.section.shapes import Placement, Point


def of_polygons(
    file: str,
    scale: float | None = None,
    origin: Point = (0.0, 0.0),
    to: Point = (0.0, 0.0),
    line: tuple[Point, Point] | None = None,
    legend: str | None = None,
    attribute: str | None = None,
    only: Sequence[str] = (),
) -> tuple[float, tuple[float, float, float, float]]:
    """Return the area of all polygons [m2], and the bounds x1, x2, y1, y2 of the polygons [m]. Raises HpcdemError."""
    found = read(file, Placement(scale, origin, to, line), legend, attribute, only)
    corners = np.concatenate([one.points for shape in found.polygons for one in shape.rings] or [np.zeros((1, 2))])
    (x1, y1), (x2, y2) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return sum(check.areas(found)), (x1, x2, y1, y2)

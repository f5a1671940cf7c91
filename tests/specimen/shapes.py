"""Requests that several tests use, and outlines as shapely has them."""

from __future__ import annotations

import numpy as np

from hpcdem.physics.polyarc.outlines import Outlines, sampled

EXAMPLE = (10.0, 5.0, 1.0, 0.5), (100.0, 95.0, 75.0, 60.0)
"""The grading of the original's manual."""
WINDOW = (3.0, 2.0, 1.0, 0.5, 0.3), (100.0, 80.0, 65.0, 60.0, 40.0)
"""The grading in the picture of its window."""
KINDS: dict[str, dict] = {
    "circle": {},
    "ellipse": {"l_over_d": 2.0},
    "triangle": {"deviation": 10.0, "roundness": 0.2},
    "quadrilateral": {"deviation": 10.0, "roundness": 0.1},
    "pentagon": {"deviation": 8.0, "roundness": 0.5},
}


def shapely_polygons(outlines: Outlines, per_arc: int) -> np.ndarray:
    """Polygons with vertices on the outlines: they leave out less than rho (1 - cos(theta / 2 per_arc)) at an arc."""
    import shapely

    points = sampled(outlines, per_arc)
    rows = points if outlines.arcs_each else np.split(points, outlines.start[1:-1] * per_arc)
    return np.array([shapely.Polygon(row) for row in rows])

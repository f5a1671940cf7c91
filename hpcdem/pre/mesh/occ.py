"""Bodies and surfaces as OpenCASCADE has them, through Gmsh: called only in processes of its own (fill.py, cad.py).

Coordinates are about `middle` and in units of `unit` [m].
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.pre.mesh import solids as s

Tags = list[tuple[int, int]]

OPTIONS = (("General.Terminal", 0), ("General.NumThreads", 1), ("Mesh.MaxNumThreads3D", 1))
"""Options of Gmsh; one thread, since then equal input gives equal meshes."""


def begun() -> Any:
    """The library, ready for a model."""
    from hpcdem.pre.mesh import optional

    gmsh = optional.gmsh_started()
    for name, value in OPTIONS:
        gmsh.option.setNumber(name, value)
    return gmsh


def body(occ: Any, one: Any, middle: np.ndarray, unit: float) -> Tags:
    """The volumes of a body."""

    def at(point: Any) -> np.ndarray:
        return (np.array(point) - middle) / unit

    match one:
        case s.Box():
            low, high = (one.bounds() - middle) / unit
            return [(3, occ.addBox(*low, *(high - low)))]
        case s.Sphere():
            return [(3, occ.addSphere(*at(one.centre), one.radius / unit))]
        case s.Cylinder():
            a, b = at(one.first), at(one.second)
            return [(3, occ.addCylinder(*a, *(b - a), one.radius / unit))]
        case s.Cone():
            a, b = at(one.first), at(one.second)
            return [(3, occ.addCone(*a, *(b - a), one.radius / unit, one.other / unit))]
        case s.Extruded():
            face = _face(occ, [at(corner) for corner in one.corners])
            return _volumes(occ.extrude([(2, face)], *(np.array(one.vector) / unit)))
        case s.Revolved():
            face = _face(occ, [at(corner) for corner in one.corners])
            turn = math.radians(one.angle)
            return _volumes(occ.revolve([(2, face)], *at(one.about), *one.axis, turn))
        case s.Shell():
            return [(3, _shell(occ, (one.triangles() - middle) / unit))]
        case s.Brep():
            with tempfile.TemporaryDirectory(prefix="hpcdem-") as folder:
                path = Path(folder) / "body.brep"
                path.write_text(one.text, encoding="ascii")
                found = occ.importShapes(str(path))
            occ.translate(found, *(-middle))
            occ.dilate(found, 0.0, 0.0, 0.0, *[1.0 / unit] * 3)
            return _volumes(found)
    raise AssertionError(one)


def surface(occ: Any, one: Any, middle: np.ndarray, unit: float, reach: float) -> Tags:
    """A polygon or disc; of a plane the part within `reach` [m] of the middle."""
    if isinstance(one, s.Polygon):
        return [(2, _face(occ, [(np.array(corner) - middle) / unit for corner in one.corners]))]
    centre, normal = one.plane()
    if isinstance(one, s.Plane):
        centre = middle - ((middle - centre) @ normal) * normal
    radius = (one.radius if isinstance(one, s.Disc) else 2.0 * reach) / unit
    x_axis = s._frame(normal)[0]
    return [(2, occ.addDisk(*((centre - middle) / unit), radius, radius, zAxis=normal.tolist(), xAxis=x_axis.tolist()))]


def _volumes(tags: Tags) -> Tags:
    return [(dim, tag) for dim, tag in tags if dim == 3]


def _face(occ: Any, corners: list[np.ndarray]) -> int:
    points = [occ.addPoint(*corner) for corner in corners]
    lines = [occ.addLine(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
    return int(occ.addPlaneSurface([occ.addCurveLoop(lines)]))


def _shell(occ: Any, triangles: np.ndarray) -> int:
    """A volume within triangles (k, 3, 3), which share their corners and sides."""
    corners, of = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    points = [occ.addPoint(*corner) for corner in corners]
    lines: dict[tuple[int, int], int] = {}
    faces = []
    for row in of.reshape(-1, 3).tolist():
        loop = []
        for a, b in zip(row, row[1:] + row[:1], strict=True):
            key = (min(a, b), max(a, b))
            if key not in lines:
                lines[key] = occ.addLine(points[key[0]], points[key[1]])
            loop.append(lines[key] if (a, b) == key else -lines[key])
        faces.append(occ.addPlaneSurface([occ.addCurveLoop(loop)]))
    return int(occ.addVolume([occ.addSurfaceLoop(faces, sewing=True)]))

"""Parts of a section, and the conversion of file coordinates to model coordinates."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.pre.mesh.geometry import Curve, sampled

Point = tuple[float, float]
METRES = "m"
"""Value of `unit`, a member of GeoJSON files that are written in metres."""
FLAT = 1e-4
"""Largest deviation of a polyline from the arcs that it replaces, over the size of the section."""


@dataclass(frozen=True)
class Shape:
    """One polygon or line. name: of its layer or fault; rings: the outline and the holes of a polygon, or one line, in
    metres of the model; attributes: as in the file; where: what it is in the file, for messages."""

    name: str
    rings: tuple[Curve, ...]
    polygon: bool
    attributes: Mapping[str, Any] = field(default_factory=dict)
    where: str = ""

    def points(self, deviation: float) -> list[np.ndarray]:
        """Points (n, 2) of each ring, arcs replaced by polylines within this deviation [m]; the first is not repeated,
        but at the end of a closed line."""
        return [ring if self.polygon else _ended(ring, curve) for ring, curve in self._flat(deviation)]

    def _flat(self, deviation: float) -> Iterator[tuple[np.ndarray, Curve]]:
        for curve in self.rings:
            yield (sampled(curve, _spacing(curve, deviation)) if curve.bulges.any() else curve.points), curve

    def length(self) -> float:
        """Length of its lines [m]."""
        return math.fsum(ring.length() for ring in self.rings)


def _ended(points: np.ndarray, curve: Curve) -> np.ndarray:
    return np.concatenate([points, points[:1]]) if curve.closed else points


def _spacing(curve: Curve, deviation: float) -> float:
    """Length of edges on arcs: the sagitta s of a chord c on a circle of radius r is c2 / (8 r)."""
    radii = [
        0.25 * math.dist(a, b) * (1.0 + t * t) / abs(t) for a, b, t in map(curve.segment, range(curve.segments)) if t
    ]
    return math.sqrt(8.0 * min(radii) * deviation)


@dataclass(frozen=True)
class Placement:
    """Coordinates of the model from those of the file: (p - origin) unit + to. line: the trace of a section on a map,
    by two points of the file: x is then the distance along it, y the height of the file. Units of the file, but `to`
    and `unit` in metres; unit None: that of the file, else 1."""

    unit: float | None = None
    origin: Point = (0.0, 0.0)
    to: Point = (0.0, 0.0)
    line: tuple[Point, Point] | None = None

    def __post_init__(self) -> None:
        if self.unit is not None and not (math.isfinite(self.unit) and self.unit > 0.0):
            raise CommandError(f"scale: metres per unit of the file, above 0, got {self.unit:g}")
        for name, at in (("origin", self.origin), ("to", self.to), *(("line", at) for at in self.line or ())):
            if len(at) != 2 or not all(math.isfinite(c) for c in at):
                raise CommandError(f"{name}: expected two finite coordinates, got {tuple(at)}")
        if self.line is not None and tuple(self.line[0]) == tuple(self.line[1]):
            raise CommandError(f"line: both of its points are {tuple(self.line[0])}")

    def _along(self) -> tuple[np.ndarray, np.ndarray]:
        """First point and direction of the trace."""
        assert self.line is not None
        first, last = np.array(self.line, float)
        return first, (last - first) / math.dist(first, last)

    def in_plane(self, points: np.ndarray, where: str) -> np.ndarray:
        """(n, 2) points in the plane of the section, from (n, 2 or 3) of the file, whose unit they keep."""
        if self.line is None:
            return points[:, :2]
        if points.shape[1] < 3:
            raise CommandError(f"{where}: line needs heights (z) of the points, and they have x and y only")
        first, along = self._along()
        return np.column_stack([(points[:, :2] - first) @ along, points[:, 2]])

    def beside(self, points: np.ndarray) -> float:
        """Largest distance of points (n, 3) from the trace, in the unit of the file."""
        first, along = self._along()
        return float(np.abs((points[:, :2] - first) @ np.array([-along[1], along[0]])).max(initial=0.0))

    def model(self, curve: Curve) -> Curve:
        """Convert a curve from the plane of the section to the model [m]."""
        return replace(curve, points=(curve.points - np.array(self.origin)) * (self.unit or 1.0) + np.array(self.to))

    def file(self, points: np.ndarray) -> np.ndarray:
        """(n, 2), with a trace (n, 3), in coordinates of the file, from (n, 2) of the model [m]."""
        flat = (points - np.array(self.to)) / (self.unit or 1.0) + np.array(self.origin)
        if self.line is None:
            return flat
        first, along = self._along()
        return np.column_stack([first + flat[:, :1] * along, flat[:, 1]])


@dataclass(frozen=True)
class Section:
    """Shapes in the order of the file; later polygons cover earlier ones. notes, warnings: about the file, to be
    logged."""

    shapes: tuple[Shape, ...]
    placement: Placement = Placement()
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def polygons(self) -> list[Shape]:
        """Return the polygons."""
        return [shape for shape in self.shapes if shape.polygon]

    @property
    def lines(self) -> list[Shape]:
        """Return the lines."""
        return [shape for shape in self.shapes if not shape.polygon]

    @property
    def deviation(self) -> float:
        """Return the tolerance of polylines for arcs [m]."""
        points = np.concatenate([ring.points for shape in self.shapes for ring in shape.rings])
        return FLAT * float(np.ptp(points, axis=0).max())

    def only(self, names: Sequence[str]) -> Section:
        """The shapes of these names, as in the file or as `group_name` has them; CommandError for an unknown one."""
        if not names:
            return self
        wanted = {group_name(name) for name in names}
        known = {group_name(shape.name): shape.name for shape in self.shapes}
        missing = [name for name in names if group_name(name) not in known]
        if missing:
            there = ", ".join(f"'{name}'" for name in known.values())
            raise CommandError(f"the section has no polygon or line '{missing[0]}' (it has {there})")
        return replace(self, shapes=tuple(shape for shape in self.shapes if group_name(shape.name) in wanted))


def group_name(name: str) -> str:
    """The name of a group of particles: lower case, characters that separate or have a meaning in scripts replaced."""
    made = "".join("_" if c in "()=,#!;\"'|{}" or c.isspace() or not c.isprintable() else c for c in name.strip())
    return made.lower() or "_"


def made_curve(points: np.ndarray, closed: bool, where: str) -> Curve:
    """A curve of straight sides; doubled points are left out. CommandError for too few or infinite ones."""
    if not np.isfinite(points).all():
        raise CommandError(f"{where}: a coordinate is not a finite number")
    after = np.roll(points, -1, axis=0)
    keep = (points != after).any(axis=1)
    if not closed and len(keep):
        keep[-1] = True
    points = points[keep]
    if len(points) < (3 if closed else 2):
        raise CommandError(
            f"{where}: it has {len(points)} different points, a {'polygon' if closed else 'line'} has at least "
            f"{3 if closed else 2}"
        )
    return Curve(np.ascontiguousarray(points), np.zeros(len(points)), closed)

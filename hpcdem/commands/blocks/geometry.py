"""Geometry layers: the lines that meshes, cracks and ranges are made from."""

from __future__ import annotations

from collections.abc import Sequence

from hpcdem.commands.blocks.project import Project
from hpcdem.errors import CommandError
from hpcdem.pre.mesh import dxf
from hpcdem.pre.mesh import geometry as shapes
from hpcdem.pre.mesh.once import made_once

Vector = tuple[float, float]


def polyline(project: Project, layer: str, points: Sequence[Vector]) -> None:
    """Straight lines from point to point [m]; closed if the last point is the first."""
    project.layers.add(layer, shapes.polyline(points))


def polygon(project: Project, layer: str, points: Sequence[Vector]) -> None:
    """A closed line that does not cross itself [m]."""
    project.layers.add(layer, shapes.polygon(points))


def rectangle(project: Project, layer: str, first: Vector, second: Vector) -> None:
    """A rectangle along the axes, between two corners [m]."""
    project.layers.add(layer, shapes.rectangle(first, second))


def circle(project: Project, layer: str, centre: Vector, radius: float) -> None:
    """A circle [m]."""
    project.layers.add(layer, shapes.circle(centre, radius))


def arc(project: Project, layer: str, centre: Vector, radius: float, begin: float, end: float) -> None:
    """A part of a circle, counter-clockwise from one angle to the other [degrees]."""
    project.layers.add(layer, shapes.arc(centre, radius, begin, end))


def points(project: Project, layer: str, at: Sequence[Vector]) -> None:
    """Single points [m]."""
    project.layers.add(layer, *(shapes.point(p) for p in at))


def import_file(project: Project, layer: str, path: str, of: str | None = None) -> None:
    """The lines of a DXF file, or of one of its layers. Collective."""
    found = made_once(project.comm, lambda: dxf.read_dxf(project.path(path), {of} if of else None))
    project.layers.add(layer, *(curve for curves in found.values() for curve in curves))


def transform(
    project: Project,
    layer: str,
    scale: float = 1.0,
    rotate: float = 0.0,
    about: Vector = (0.0, 0.0),
    move: Vector = (0.0, 0.0),
) -> None:
    """Scale, then turn [degrees, counter-clockwise] about a point, then move a layer [m]."""
    if scale <= 0.0:
        raise CommandError(f"a scale is above 0, got {scale:g}")
    project.layers.transform(layer, translate=move, rotate=rotate, scale=scale, about=about)


def delete(project: Project, layer: str) -> None:
    """Forget a layer. Meshes that were made from it keep its edges."""
    project.layers.remove(layer)

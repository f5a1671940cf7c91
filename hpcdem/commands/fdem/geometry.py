"""Geometry layers: the lines, in space the solids, that meshes, cracks and ranges are made from."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from hpcdem.core.errors import CommandError
from hpcdem.pre.mesh import dxf, solids
from hpcdem.pre.mesh import geometry as shapes
from hpcdem.pre.mesh.once import made_once

if TYPE_CHECKING:  # brings kernels, and shapes are made when a script is read
    from hpcdem.commands.fdem.project import Project

Vector = tuple[float, ...]


SHAPES: dict[str, Callable[..., shapes.Curve]] = {
    "polyline": shapes.polyline, "polygon": shapes.polygon, "rectangle": shapes.rectangle, "circle": shapes.circle,
    "arc": shapes.arc,
}  # fmt: skip


def shape(kind: str, *values: Any) -> list[Any]:
    """The curves [m] of a polyline or polygon (points), rectangle (two corners), circle (centre, radius), arc (the same
    and two angles [degrees], counter-clockwise), or of single points (point); in space the solid [m] of a box (two
    corners), sphere (centre, radius) or cylinder (middles of its ends, radius)."""
    if kind in solids.KINDS:
        return [solids.made(kind, *values)]
    return [shapes.point(at) for at in values[0]] if kind == "point" else [SHAPES[kind](*values)]


def create(project: Project, kind: str, layer: str, *values: Any) -> None:
    """Add a shape to a layer; see `shape`."""
    if (kind in solids.KINDS) != (project.dim == 3):
        raise CommandError(f"a {kind} is for a model in {2 if project.dim == 3 else 3} dimensions: model new dim")
    project.layers.add(layer, *shape(kind, *values))


def import_file(project: Project, layer: str, path: str, of: str | None = None) -> None:
    """The lines of a DXF file, or of one of its layers. Collective."""
    file = project.to_read(path)
    found = made_once(project.comm, lambda: dxf.read_dxf(file, {of} if of else None))
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

"""Geometry layers: the lines, in space the solids, that meshes, cracks and ranges are made from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.io.agreed import on_first
from hpcdem.pre.mesh import cad, dxf, solids
from hpcdem.pre.mesh import geometry as shapes
from hpcdem.pre.mesh.once import made_once

if TYPE_CHECKING:  # brings kernels, and shapes are made when a script is read
    from hpcdem.commands.fdem.project import Project

Vector = tuple[float, ...]


SHAPES: dict[str, Callable[..., shapes.Curve]] = {
    "polyline": shapes.polyline, "polygon": shapes.polygon, "rectangle": shapes.rectangle, "circle": shapes.circle,
    "arc": shapes.arc,
    "arc-between": shapes.arc_between, "segmented-circle": shapes.segmented_circle,
}  # fmt: skip


def shape(kind: str, *values: Any) -> list[Any]:
    """The curves [m] of a polyline or polygon (points), rectangle (two corners), circle (centre, radius; or, as
    segmented-circle, with the length of its sides), arc (centre, radius and two angles [degrees], counter-clockwise;
    or, as arc-between, centre and ends), or of single points (point); in space the solid [m] of a box (two corners),
    sphere (centre, radius), cylinder or cone (middles of its ends, its radius or radii), or the surface of a polygon
    (corners), disc (centre, normal, radius) or plane (point, normal)."""
    if kind in solids.KINDS and (kind not in SHAPES or len(values[0][0]) == 3):
        return [solids.made(kind, *values)]
    return [shapes.point(at) for at in values[0]] if kind == "point" else [SHAPES[kind](*values)]


def create(project: Project, kind: str, layer: str, *values: Any) -> None:
    """Add a shape to a layer; see `shape`."""
    if kind not in (solids.KINDS if project.dim == 3 else (*SHAPES, "point")):
        raise CommandError(f"a {kind} is for a model in {2 if project.dim == 3 else 3} dimensions: model new dim")
    project.layers.add(layer, *shape(kind, *values))


def extrude(project: Project, layer: str, of: str, along: Vector) -> None:
    """The polygons of a layer, drawn along a way [m], as bodies of another."""
    project.layers.add(layer, *(solids.made("extrude", one.corners, along) for one in _polygons(project, of)))


def revolve(
    project: Project, layer: str, of: str, axis: Vector, about: Vector = (0.0, 0.0, 0.0), angle: float = solids.FULL
) -> None:
    """The polygons of a layer, turned about an axis through a point [m] by an angle [degrees], as bodies of another."""
    made = (solids.made("revolve", one.corners, about, axis, angle) for one in _polygons(project, of))
    project.layers.add(layer, *made)


def _polygons(project: Project, layer: str) -> list[solids.Polygon]:
    found = project.layers[layer]
    if not all(isinstance(one, solids.Polygon) for one in found):
        raise CommandError(f"layer '{layer}' has something beside polygons")
    return found


def import_file(project: Project, layer: str, path: str, of: str | None = None, scale: float | None = None) -> None:
    """The lines of a DXF file, or of one of its layers; in space the solids of a STEP or BREP file, or what the
    triangles of an STL or DXF file enclose. scale: metres in a unit of the file; None: as the file says, else 1.
    Collective."""
    file = project.to_read(path)
    if project.dim == 3 and of is not None and file.suffix.lower() != ".dxf":
        raise CommandError(f"{file}: layers are of DXF files")

    def make() -> tuple[list[Any], list[str]]:
        notes: list[str] = []
        if project.dim == 3:
            return cad.read(file, of, scale, notes), notes
        drawing = dxf.opened(file)
        unit = dxf.metres(drawing, scale, notes)
        found = dxf.curves(drawing, file, {of} if of else None)
        return [shapes.transformed(curve, scale=unit) for curves in found.values() for curve in curves], notes

    made, notes = made_once(project.comm, make)
    project.layers.add(layer, *made)
    if project.log is not None:
        bounds = [
            one.bounds() if project.dim == 3 else (one.points.min(axis=0), one.points.max(axis=0)) for one in made
        ]
        low = np.min([b[0] for b in bounds], axis=0)
        high = np.max([b[1] for b in bounds], axis=0)
        first, last = (", ".join(f"{c:g}" for c in at) for at in (low, high))
        project.log.info(
            f"layer '{layer}': from ({first}) to ({last}) m; {file.name}: {'; '.join(notes) or 'in metres'}"
        )


def transform(
    project: Project,
    layer: str,
    scale: float = 1.0,
    rotate: float = 0.0,
    about: Vector | None = None,
    move: Vector | None = None,
    axis: Vector | None = None,
) -> None:
    """Scale, then turn [degrees, counter-clockwise, in space right-handed about an axis] about a point, then move [m] a
    layer."""
    if scale <= 0.0:
        raise CommandError(f"a scale is above 0, got {scale:g}")
    given = {"about": about, "translate": move, "axis": axis}
    moved(project, [layer], scale=scale, rotate=rotate, **{k: v for k, v in given.items() if v is not None})


def moved(project: Project, layers: Sequence[str] | None = None, **how: Any) -> None:
    """Scale (factors along the axes), turn or translate [m] layers; None: all of them."""
    every = list(project.layers) if layers is None else list(dict.fromkeys(layers))
    for layer in every:
        _ = project.layers[layer]
    changed = {layer: [_transformed(one, **how) for one in project.layers[layer]] for layer in every}
    project.layers.curves.update(changed)


def _transformed(one: Any, **how: Any) -> Any:
    return (shapes if isinstance(one, shapes.Curve) else solids).transformed(one, **how)


def export(project: Project, layers: Sequence[str], path: str) -> None:
    """Write layers to a DXF file in the folder of the results, each as a layer of its name, in metres. Collective."""
    if not path.lower().endswith(".dxf"):
        raise CommandError(f"'{path}': layers are exported to files *.dxf")
    wanted = {layer: project.layers[layer] for layer in dict.fromkeys(layers)}
    project.folder()
    file = project.to_write(project.result(path))
    on_first(project.comm, lambda: dxf.write(file, wanted))


def delete(project: Project, layers: Sequence[str]) -> None:
    """Forget layers. Meshes that were made from them keep their edges."""
    for layer in dict.fromkeys(layers):
        project.layers.remove(layer)

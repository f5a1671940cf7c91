"""Geometry layers: the lines, in space the solids, that meshes, cracks and ranges are made from."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.commands.fdem.values import DEFAULT_LAYER
from hpcdem.core.errors import CommandError
from hpcdem.io.agreed import on_first
from hpcdem.pre.mesh import cad, dxf, solids
from hpcdem.pre.mesh import geometry as shapes
from hpcdem.pre.section.check import outline
from hpcdem.pre.section.read import read
from hpcdem.pre.section.shapes import Placement, Section, Shape
from hpcdem.pre.section.write import FORMATS, write

if TYPE_CHECKING:  # brings kernels, and shapes are made when a script is read
    from hpcdem.commands.fdem.project import Project

Vector = tuple[float, ...]


SHAPES: dict[str, Callable[..., shapes.Curve]] = {
    "polyline": shapes.polyline, "polygon": shapes.polygon, "rectangle": shapes.rectangle, "circle": shapes.circle,
    "arc": shapes.arc,
    "arc-between": shapes.arc_between, "segmented-circle": shapes.segmented_circle,
}  # fmt: skip


def shape(kind: str, *values: Any) -> list[Any]:
    """Return the shapes of a kind. In the plane, curves [m] of a polyline or polygon (points), rectangle (two corners),
    circle (centre, radius; as segmented-circle also the length of its sides), arc (centre, radius, two angles
    [degrees], counter-clockwise; as arc-between centre and end points) or single points (point). In space, a solid [m]:
    box (two corners), sphere (centre, radius), cylinder or cone (centres of the end faces, radius or radii); or a
    surface: polygon (corners), disc (centre, normal, radius) or plane (point, normal).
    """
    if kind in solids.KINDS and (kind not in SHAPES or len(values[0][0]) == 3):
        return [solids.made(kind, *values)]
    return [shapes.point(at) for at in values[0]] if kind == "point" else [SHAPES[kind](*values)]


def create(project: Project, kind: str, layer: str, *values: Any) -> None:
    """Add a shape to a layer; see `shape`."""
    if kind not in (solids.KINDS if project.dim == 3 else (*SHAPES, "point")):
        raise CommandError(f"a {kind} is for a model in {2 if project.dim == 3 else 3} dimensions: model new dim")
    project.layers.add(layer, *shape(kind, *values))


def extrude(project: Project, layer: str, along: Vector, as_layer: str = DEFAULT_LAYER) -> None:
    """Extrude the polygons of a layer along a vector [m] into bodies of another layer."""
    project.layers.add(as_layer, *(solids.made("extrude", one.corners, along) for one in _polygons(project, layer)))


def revolve(
    project: Project, layer: str, axis: Vector, about: Vector = (0.0, 0.0, 0.0), angle: float = solids.FULL,
    as_layer: str = DEFAULT_LAYER,
) -> None:  # fmt: skip
    """Revolve the polygons of a layer about an axis through a point [m] by an angle [degrees] into bodies of another
    layer.
    """
    made = (solids.made("revolve", one.corners, about, axis, angle) for one in _polygons(project, layer))
    project.layers.add(as_layer, *made)


def _polygons(project: Project, layer: str) -> list[solids.Polygon]:
    found = project.layers[layer]
    if not all(isinstance(one, solids.Polygon) for one in found):
        raise CommandError(f"layer '{layer}' contains other shapes than polygons")
    return found


def import_file(
    project: Project,
    file: str,
    as_layer: str = DEFAULT_LAYER,
    dxf_layer: str | None = None,
    scale: float | None = None,
    named: bool = False,
    origin: Vector = (0.0, 0.0),
    to: Vector = (0.0, 0.0),
    line: tuple[Vector, Vector] | None = None,
    legend: str | None = None,
    attribute: str | None = None,
    simplify: float = 0.0,
) -> None:
    """Import the lines of a DXF file, of one of its layers, or of a section in another format; in space the solids of a
    STEP or BREP file, or the bodies bounded by the triangles of an STL or DXF file. Collective.

    scale: metres per unit of the file (default: as given in the file, else 1). For sections, named: each name becomes a
    layer, and as_layer the outline of all polygons; origin, to, line: see `Placement`; legend, attribute, simplify: see
    `read`.
    """
    path = project.to_read(file)
    of_section = {
        "named": named, "origin": tuple(origin) != (0.0, 0.0), "to": tuple(to) != (0.0, 0.0), "line": line is not None,
        "legend": legend is not None, "attribute": attribute is not None, "simplify": bool(simplify),
    }  # fmt: skip
    given = [word for word, is_given in of_section.items() if is_given]
    if project.dim == 3:
        if given:
            raise CommandError(f"{given[0]} of geometry import is for two dimensions")
        if dxf_layer is not None and path.suffix.lower() != ".dxf":
            raise CommandError(f"{path}: layer selects a layer of a DXF file only")
    elif given or path.suffix.lower() != ".dxf":
        if dxf_layer is not None and path.suffix.lower() != ".dxf":
            raise CommandError(f"{path}: layer selects a layer of a DXF file only")
        placement = Placement(
            scale, _pair(origin), _pair(to), None if line is None else (_pair(line[0]), _pair(line[1]))
        )
        beside = None if legend is None else project.to_read(legend)
        only = () if dxf_layer is None else (dxf_layer,)
        found = project.comm.per_node(lambda: read(path, placement, beside, attribute, only, simplify), once=True)
        _add_section(project, found, as_layer, named, path.name)
        return

    def make() -> tuple[list[Any], list[str]]:
        notes: list[str] = []
        if project.dim == 3:
            return cad.read(path, dxf_layer, scale, notes), notes
        drawing = dxf.opened(path)
        unit = dxf.metres(drawing, scale, notes)
        left: Counter[tuple[str, str]] = Counter()
        found = dxf.curves(drawing, path, {dxf_layer} if dxf_layer else None, notes_left=left)
        if left:
            notes.append("ignored: " + ", ".join(f"{n} {kind} of '{layer}'" for (kind, layer), n in left.items()))
        return [shapes.transformed(curve, scale=unit) for curves in found.values() for curve in curves], notes

    made, notes = project.comm.per_node(make, once=True)
    project.layers.add(as_layer, *made)
    if project.log is not None:
        bounds = [
            one.bounds() if project.dim == 3 else (one.points.min(axis=0), one.points.max(axis=0)) for one in made
        ]
        low = np.min([b[0] for b in bounds], axis=0)
        high = np.max([b[1] for b in bounds], axis=0)
        first, last = (", ".join(f"{c:g}" for c in at) for at in (low, high))
        project.log.info(
            f"layer '{as_layer}': from ({first}) to ({last}) m; {path.name}: {'; '.join(notes) or 'in metres'}"
        )


def _pair(at: Vector) -> tuple[float, float]:
    if len(at) != 2:
        raise CommandError(f"a point of a section has two coordinates, got {tuple(at)}")
    return float(at[0]), float(at[1])


def _add_section(project: Project, found: Section, as_layer: str, named: bool, file: str) -> None:
    """Shapes of a section as curves of one layer; named: each in the layer of its name, and the outline of all polygons
    in as_layer."""
    if named:
        names = dict.fromkeys(shape.name for shape in found.shapes)
        taken = [name for name in names if name in project.layers or (name == as_layer and found.polygons)]
        if taken:
            raise CommandError(f"{file} has the name '{taken[0]}', which is a layer already; choose another as-layer")
        for shape in found.shapes:
            project.layers.add(shape.name, *shape.rings)
        if found.polygons:
            project.layers.add(as_layer, *outline(found, file))
    else:
        project.layers.add(as_layer, *(ring for shape in found.shapes for ring in shape.rings))
    if project.log is not None:
        layers = ", ".join(f"'{name}'" for name in (*([as_layer] if found.polygons else []), *names)) if named else ""
        project.log.info(f"{file}: " + (f"layers {layers}" if named else f"layer '{as_layer}'"))
        for note in found.notes:
            project.log.info(f"{file}: {note}")
        for warning in found.warnings:
            project.log.warn(f"{file}: {warning}")


def transform(
    project: Project,
    layer: str,
    scale: float = 1.0,
    rotate: float = 0.0,
    about: Vector | None = None,
    move: Vector | None = None,
    axis: Vector | None = None,
) -> None:
    """Scale a layer, then rotate it about a point [degrees, counter-clockwise, in space right-handed about an axis],
    then translate it [m].
    """
    if scale <= 0.0:
        raise CommandError(f"a scale is above 0, got {scale:g}")
    given = {"about": about, "translate": move, "axis": axis}
    _move(project, [layer], scale=scale, rotate=rotate, **{k: v for k, v in given.items() if v is not None})


def scale(project: Project, factors: Vector, layer: Sequence[str] | None = None) -> None:
    """Multiply the coordinates of layers by factors; None: of all layers."""
    _move(project, layer, scale=factors)


def translate(project: Project, vector: Vector, layer: Sequence[str] | None = None) -> None:
    """Translate layers by a vector [m]; None: all layers."""
    _move(project, layer, translate=vector)


def _move(project: Project, layers: Sequence[str] | None, **how: Any) -> None:
    every = list(project.layers) if layers is None else list(dict.fromkeys(layers))
    for layer in every:
        _ = project.layers[layer]
    changed = {layer: [_transformed(one, **how) for one in project.layers[layer]] for layer in every}
    project.layers.curves.update(changed)


def _transformed(one: Any, **how: Any) -> Any:
    return (shapes if isinstance(one, shapes.Curve) else solids).transformed(one, **how)


def export(
    project: Project,
    layers: Sequence[str],
    file: str,
    scale: float = 1.0,
    origin: Vector = (0.0, 0.0),
    to: Vector = (0.0, 0.0),
    line: tuple[Vector, Vector] | None = None,
) -> None:
    """Write layers to a DXF, GeoJSON or CSV file in the output folder under their names: in metres or, with scale,
    origin, to and line, in the coordinates that `import_file` converts to those of the model. Collective.
    """
    if not file.lower().endswith(FORMATS):
        raise CommandError(f"'{file}': layers are exported to files *.dxf, *.geojson or *.csv")
    placement = Placement(scale, _pair(origin), _pair(to), None if line is None else (_pair(line[0]), _pair(line[1])))
    own = placement != Placement(1.0)
    wanted = {layer: project.layers[layer] for layer in dict.fromkeys(layers)}
    made = [Shape(name, (curve,), curve.closed) for name, curves in wanted.items() for curve in curves]
    points = [shape.name for shape in made if not shape.rings[0].segments]
    if points and not (file.lower().endswith(".dxf") and not own):
        raise CommandError(f"layer '{points[0]}' has single points; export them to a .dxf file in metres")
    project.folder()
    path = project.to_write(project.result(file))
    if file.lower().endswith(".dxf") and not own:
        on_first(project.comm, lambda: dxf.write(path, wanted))
    else:
        on_first(project.comm, lambda: write(path, made, placement))


def delete(project: Project, layers: Sequence[str]) -> None:
    """Delete layers. Meshes made from them keep their edges."""
    for layer in dict.fromkeys(layers):
        project.layers.remove(layer)

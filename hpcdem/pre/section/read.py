"""Read a section from a file of any known format, and check it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.core.section_files import IMAGES, KNOWN, is_section
from hpcdem.pre.mesh import optional
from hpcdem.pre.section import check, drawing, image, maps, svg
from hpcdem.pre.section.found import Found
from hpcdem.pre.section.shapes import Placement, Section, Shape, made_curve

_READERS = {
    ".geojson": maps.read_geojson,
    ".json": maps.read_geojson,
    ".shp": maps.read_shapefile,
    ".svg": svg.read_svg,
    ".dxf": drawing.read_dxf,
}


def read(
    path: str | Path,
    placement: Placement = Placement(),  # noqa: B008
    legend: str | Path | None = None,
    attribute: str | None = None,
    only: Sequence[str] = (),
    simplify: float = 0.0,
) -> Section:
    """Read a section and convert it to metres of the model.

    Parameters
    ----------
    path : file .geojson, .json, .shp, .svg, .dxf, or an image.
    placement : conversion from the coordinates of the file to those of the model.
    legend : for an image: file of colours and names.
    attribute : attribute whose value is the name of a shape, for GeoJSON and shapefiles (default: the first of
        found.NAMES).
    only : names of polygons and lines to read (default: all).
    simplify : length [m]; points of boundaries are removed if the triangles that disappear are smaller than its square;
        shared boundaries remain shared.

    Raises
    ------
    HpcdemError : if the file cannot be read or has no shape, or a polygon crosses itself.
    CommandError : if a value is invalid.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if not is_section(path):
        raise CommandError(f"{path}: unknown ending of a section; known: {KNOWN}")
    if not path.is_file():
        raise CommandError(f"{path}: file not found")
    if legend is not None and ending not in IMAGES:
        raise CommandError(f"{path}: a legend is for images")
    if attribute is not None and ending not in (".geojson", ".json", ".shp"):
        raise CommandError(
            f"{path}: attribute is for GeoJSON and shapefiles; names of this file are those of its layers"
        )
    found = Found(path, placement, attribute)
    if ending in IMAGES:
        image.read_image(found, None if legend is None else Path(legend))
    else:
        try:
            _READERS[ending](found)
        except (OSError, UnicodeError) as error:
            raise found.refuse(f"cannot be read ({error})") from None
    if not found.shapes:
        left = found.left_out()
        raise found.refuse("no polygon and no line" + (f"; ignored: {left}" if left else ""))
    unit = placement.unit or found.metres or 1.0
    placed = replace(placement, unit=unit)
    shapes = tuple(replace(one, rings=tuple(map(placed.model, one.rings))) for one in found.shapes)
    section = Section(shapes, placed).only(only)
    if simplify:
        section = _simplified(section, simplify, path)
    warnings = [*found.warnings, *check.warnings(section, str(path))]
    if found.dropped:
        warnings.append(f"ignored: {found.left_out()}")
    if placement.unit is not None:
        how = "set by scale"
    else:
        how = "as given in the file" if found.metres else "interpreted as metres"
    notes = [f"{found.unit}: 1 unit = {unit:g} m, {how}; {found.axes}"]
    if placement.line is not None:
        notes.append(f"points are up to {found.beside * unit:g} m off the line of the section")
    return replace(section, notes=(*notes, *found.notes, *summary(section)), warnings=tuple(warnings))


def summary(section: Section) -> list[str]:
    """Return the extent, and areas and lengths by name."""
    points = np.concatenate([ring.points for shape in section.shapes for ring in shape.rings])
    (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
    lines = [f"from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) m"]
    areas = check.areas(section)
    for name in dict.fromkeys(shape.name for shape in section.polygons):
        of = [areas[k] for k, shape in enumerate(section.polygons) if shape.name == name]
        lines.append(f"'{name}': {len(of)} polygon{'s' if len(of) > 1 else ''}, {sum(of):.6g} m2")
    for name in dict.fromkeys(shape.name for shape in section.lines):
        long = [shape.length() for shape in section.lines if shape.name == name]
        lines.append(f"'{name}': {len(long)} line{'s' if len(long) > 1 else ''}, {sum(long):.6g} m")
    return lines


def _simplified(section: Section, tolerance: float, path: Path) -> Section:
    shapely = optional.shapely()
    if not tolerance > 0.0:
        raise CommandError(f"simplify: a length above 0, got {tolerance:g}")
    if not hasattr(shapely, "coverage_simplify"):
        raise HpcdemError(f"simplify needs shapely 2.1 or newer, here is {shapely.__version__}: {optional.EXTRA}")
    polygons = check.polygons(section, str(path))
    if not shapely.coverage_is_valid(polygons):
        raise HpcdemError(
            f"{path}: simplify needs polygons that share the points of their boundaries, without overlaps"
        )
    made = iter(shapely.coverage_simplify(polygons, tolerance))
    shapes = []
    for shape in section.shapes:
        if shape.polygon:
            face = next(made)
            rings = [shapely.get_coordinates(ring)[:-1] for ring in (face.exterior, *face.interiors)]
            curves = tuple(made_curve(ring, True, shape.where) for ring in rings)
        else:
            curves = shape.rings
        shapes.append(Shape(shape.name, curves, shape.polygon, shape.attributes, shape.where))
    return replace(section, shapes=tuple(shapes))

"""GeoJSON and shapefiles."""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from hpcdem.core.selection import even_odd
from hpcdem.pre.mesh import optional
from hpcdem.pre.section.found import Found
from hpcdem.pre.section.shapes import METRES

_PARTS = {
    "Point": 0, "MultiPoint": 0, "LineString": 1, "MultiLineString": 2, "Polygon": 3, "MultiPolygon": 4,
}  # fmt: skip
LARGEST_DEGREES = np.array([180.0, 90.0])
"""Longitude and latitude."""
_DEGREES = ("EPSG:4326", "EPSG::4326", "CRS84", "EPSG:4490", "EPSG::4490")


def read_geojson(found: Found) -> None:
    """Polygons and lines of a GeoJSON file (RFC 7946); coordinates are lengths, degrees are refused."""
    try:
        data = json.loads(found.path.read_text(encoding="utf-8-sig"), parse_constant=_not_finite)
    except (ValueError, RecursionError) as error:
        raise found.refuse(f"not a readable GeoJSON file ({str(error) or type(error).__name__})") from None
    if not isinstance(data, dict) or not isinstance(data.get("type"), str):
        raise found.refuse("not a GeoJSON file: it has no type")
    _refuse_degrees(found, json.dumps(data.get("crs", "")))
    found.unit = "GeoJSON defines no unit"
    if data.get("unit") == METRES:
        found.metres, found.unit = 1.0, f"its unit is {METRES}"
    for number, feature in enumerate(_features(found, data)):
        attributes = feature.get("properties") or {}
        if not isinstance(attributes, dict):
            raise found.refuse(f"feature {number}: its properties are not a table of names and values")
        if "id" in feature:
            attributes = {"id": feature["id"], **attributes}
        for part, geometry in enumerate(_geometries(found, feature.get("geometry"), f"feature {number}")):
            where = f"feature {number}" + (f", part {part}" if part else "")
            _geometry(found, geometry, attributes, where)
    if not data.get("crs"):
        _refuse_likely_degrees(
            found, "it names no coordinate system (crs), so they are longitude and latitude by RFC 7946"
        )


def _not_finite(text: str) -> float:
    raise ValueError(f"{text} is not a number")


def _refuse_degrees(found: Found, text: str) -> None:
    if any(name in text for name in _DEGREES):
        raise found.refuse("its coordinates are degrees; project the file to metres (for example UTM) first")


def _refuse_likely_degrees(found: Found, why: str) -> None:
    """HpcdemError where coordinates of unknown unit could be longitudes and latitudes."""
    stated = found.metres or found.placement.unit or not found.shapes
    if not stated and (np.maximum(-found.low, found.high) <= LARGEST_DEGREES).all():
        (x0, y0), (x1, y1) = found.low, found.high
        raise found.refuse(
            f"its coordinates, {x0:g} to {x1:g} and {y0:g} to {y1:g}, may be degrees: {why}. Project the file to "
            "metres (for example UTM), or give scale, metres per unit of the file, if they are lengths"
        )


def _features(found: Found, data: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    if data["type"] == "FeatureCollection":
        if not isinstance(data.get("features"), list):
            raise found.refuse("a FeatureCollection without a list of features")
        for number, one in enumerate(data["features"]):
            if not isinstance(one, dict) or one.get("type") != "Feature":
                raise found.refuse(f"feature {number}: its type is not Feature")
            yield one
    elif data["type"] == "Feature":
        yield data
    else:
        yield {"geometry": data}


def _geometries(found: Found, geometry: Any, where: str, depth: int = 0) -> Iterator[Mapping[str, Any]]:
    """Without collections, which are taken apart; None is a feature without a place."""
    if geometry is None:
        found.drop("feature without geometry")
        return
    if not isinstance(geometry, dict) or depth > 16:
        raise found.refuse(f"{where}: not a geometry")
    if geometry.get("type") != "GeometryCollection":
        yield geometry
        return
    for one in geometry.get("geometries") or ():
        yield from _geometries(found, one, where, depth + 1)


def _geometry(found: Found, geometry: Mapping[str, Any], attributes: Mapping[str, Any], where: str) -> None:
    kind = geometry.get("type")
    if kind not in _PARTS:
        raise found.refuse(f"{where}: unknown geometry {kind!r}; known: {', '.join(_PARTS)}")
    name = found.name(attributes, where)
    at = geometry.get("coordinates")
    if _PARTS[kind] == 0:
        found.drop(kind, name)
        return
    if not at:
        found.drop(f"empty {kind}", name)
        return
    try:
        if kind == "LineString":
            found.add([_points(at)], False, name, where, attributes)
        elif kind == "MultiLineString":
            for one in at:
                found.add([_points(one)], False, name, where, attributes)
        else:
            for rings in [at] if kind == "Polygon" else at:
                found.add([_points(ring) for ring in rings], True, name, where, attributes)
    except (TypeError, ValueError, IndexError) as error:
        raise found.refuse(f"{where}: its coordinates are not those of a {kind} ({error})") from None


def _points(rows: Any) -> np.ndarray:
    """(n, 2) or, where all have heights, (n, 3)."""
    least = min(len(row) for row in rows)
    if least < 2:
        raise ValueError("a position has fewer than two numbers")
    if any(isinstance(value, str | bool) for row in rows for value in row):
        raise ValueError("a position contains something other than numbers")
    return np.array([row[: min(least, 3)] for row in rows], np.float64)


def read_shapefile(found: Found) -> None:
    """Polygons and lines of a shapefile, read by pyshp; names and attributes from its .dbf, the unit from its .prj."""
    shapefile = optional.pyshp()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        _records(found, shapefile)
    found.warnings += dict.fromkeys(str(one.message) for one in caught)


def _records(found: Found, shapefile: Any) -> None:
    try:
        with shapefile.Reader(str(found.path), encoding="utf-8", encodingErrors="replace") as reader:
            _unit(found)
            if not reader.fields:
                found.warnings.append("it has no table of attributes (.dbf), so its shapes have no names")
            for number, shape in enumerate(reader.iterShapes()):
                attributes = reader.record(number).as_dict() if reader.fields else {}
                _shape(found, shapefile, shape, attributes, f"record {number}")
            _refuse_likely_degrees(found, found.unit)
    except OSError as error:
        raise found.refuse(f"cannot be read ({error})") from None
    except (shapefile.ShapefileException, ValueError, IndexError, KeyError, AttributeError, MemoryError,
            OverflowError, TypeError, EOFError) as error:  # fmt: skip
        raise found.refuse(f"not a readable shapefile ({error})") from None
    except Exception as error:  # struct.error of a file that was cut off
        if type(error).__name__ != "error":
            raise
        raise found.refuse(f"not a readable shapefile ({error})") from None


def _unit(found: Found) -> None:
    """Metres in a unit of the .prj file beside it."""
    found.unit = "it has no .prj file"
    beside = next((p for p in (found.path.with_suffix(s) for s in (".prj", ".PRJ")) if p.is_file()), None)
    if beside is None:
        return
    text = beside.read_text(encoding="utf-8", errors="replace")
    if text.lstrip().upper().startswith("GEOGCS"):
        raise found.refuse(
            f"its coordinates are degrees ({beside.name}); project the file to metres (for example UTM) first"
        )
    units = re.findall(r'UNIT\["([^"]*)",\s*([0-9.eE+-]+)', text)
    if units:
        found.metres = float(units[-1][1])
        found.unit = f"{beside.name} names {units[-1][0]}"


def _shape(found: Found, shapefile: Any, shape: Any, attributes: Mapping[str, Any], where: str) -> None:
    kind = shape.shapeTypeName
    name = found.name(attributes, where)
    polygon = shape.shapeType in (shapefile.POLYGON, shapefile.POLYGONZ, shapefile.POLYGONM)
    line = shape.shapeType in (shapefile.POLYLINE, shapefile.POLYLINEZ, shapefile.POLYLINEM)
    if not (polygon or line):
        found.drop(kind, name)
        return
    points = np.array(shape.points, np.float64).reshape(-1, 2)
    if len(getattr(shape, "z", ())) == len(points):
        points = np.column_stack([points, np.array(shape.z, np.float64)])
    parts = [part for part in np.split(points, list(shape.parts)[1:]) if len(part)]
    if not parts:
        found.drop(f"empty {kind}", name)
    elif line:
        for part in parts:
            found.add([part], False, name, where, attributes)
    else:
        for rings in _polygons(parts):
            found.add(rings, True, name, where, attributes)


def _polygons(parts: list[np.ndarray]) -> list[list[np.ndarray]]:
    """Outlines, which turn clockwise, each with the holes, which turn the other way, that lie inside of it."""
    outlines = [[part] for part in parts if _area(part) < 0.0] or [[part] for part in parts]
    for hole in (part for part in parts if _area(part) > 0.0 and not any(part is o[0] for o in outlines)):
        middle = hole[:1] + 0.5 * (hole[1:2] - hole[:1])
        inside = [o for o in outlines if even_odd([o[0][:, :2]], middle[:, 0], middle[:, 1])[0]]
        (min(inside, key=lambda o: abs(_area(o[0]))) if inside else outlines[0]).append(hole)
    return outlines


def _area(ring: np.ndarray) -> float:
    x, y = ring[:, 0] - ring[0, 0], ring[:, 1] - ring[0, 1]
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))

"""Write polygons and lines as GeoJSON, DXF or CSV, in coordinates of the model or of a map."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.io.agreed import atomic_path
from hpcdem.pre.mesh import dxf
from hpcdem.pre.section.shapes import METRES, Placement, Section, Shape

FORMATS = (".geojson", ".dxf", ".csv")


def write(path: str | Path, shapes: Sequence[Shape], placement: Placement | None = None) -> None:
    """Write shapes to a file. placement: write the coordinates of its file; None: metres of the model. Arcs remain arcs
    in DXF and become polylines elsewhere. CommandError for an extension not in FORMATS.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in FORMATS:
        raise CommandError(f"'{path}': expected a file name that ends in {', '.join(FORMATS)}")
    if not shapes:
        raise CommandError(f"'{path}': there is no polygon or line to write")
    if ending == ".dxf":
        _write_dxf(path, shapes, placement)
        return
    deviation = Section(tuple(shapes)).deviation
    text = (_geojson if ending == ".geojson" else _csv)(shapes, placement or Placement(), deviation)
    with atomic_path(path) as temporary:
        Path(temporary).write_text(text, encoding="utf-8", newline="")


def _write_dxf(path: Path, shapes: Sequence[Shape], placement: Placement | None) -> None:
    if placement is not None and placement.line is not None:
        raise CommandError(f"'{path}': a DXF section lies in a plane; write .geojson or .csv along a line of the map")
    layers: dict[str, list[Any]] = {}
    for shape in shapes:
        for ring in shape.rings:
            made = ring if placement is None else type(ring)(placement.file(ring.points), ring.bulges, ring.closed)
            layers.setdefault(shape.name, []).append(made)
    dxf.write(path, layers, 6 if placement is None or placement.unit in (None, 1.0) else 0)


def _geojson(shapes: Sequence[Shape], placement: Placement, deviation: float) -> str:
    features = []
    for shape in shapes:
        rings = shape.points(deviation)
        if shape.polygon:
            turned = [placement.file(_turned(ring, k == 0)) for k, ring in enumerate(rings)]
            geometry: dict[str, Any] = {
                "type": "Polygon",
                "coordinates": [[*ring.tolist(), ring[0].tolist()] for ring in turned],
            }
        else:
            geometry = {"type": "LineString", "coordinates": placement.file(rings[0]).tolist()}
        attributes = {"name": shape.name, **{k: _plain(v) for k, v in shape.attributes.items() if k != "name"}}
        features.append({"type": "Feature", "properties": attributes, "geometry": geometry})
    rows = ",\n".join(json.dumps(feature, ensure_ascii=False) for feature in features)
    unit = f' "unit": "{METRES}",' if placement.unit in (None, 1.0) else ""
    return f'{{"type": "FeatureCollection",{unit} "features": [\n{rows}\n]}}\n'


def _turned(ring: np.ndarray, outline: bool) -> np.ndarray:
    """Outlines counter-clockwise, holes clockwise (RFC 7946)."""
    x, y = ring[:, 0] - ring[0, 0], ring[:, 1] - ring[0, 1]
    left = float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) > 0.0
    return ring if left == outline else ring[::-1]


def _plain(value: Any) -> Any:
    return value if isinstance(value, str | int | float | bool) or value is None else str(value)


def _csv(shapes: Sequence[Shape], placement: Placement, deviation: float) -> str:
    """Rows name, kind, number of the shape, ring, x, y (z)."""
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(["name", "kind", "shape", "ring", "x", "y"] + (["z"] if placement.line is not None else []))
    for number, shape in enumerate(shapes):
        for ring, points in enumerate(shape.points(deviation)):
            points = np.concatenate([points, points[:1]]) if shape.polygon else points
            kind = "polygon" if shape.polygon else "line"
            rows.writerows([shape.name, kind, number, ring, *map(repr, at)] for at in placement.file(points).tolist())
    return out.getvalue()

"""A section of known areas, in every format: two layers above a basement, offset by a normal fault."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

SIZE = (4000.0, 1000.0)
LAYERS = {
    "basement": [[(0, 0), (4000, 0), (4000, 300), (2200, 300), (2150, 400), (0, 400)]],
    "Lower Sand": [[(0, 400), (2150, 400), (2100, 500), (2050, 600), (0, 600)],
                   [(2200, 300), (4000, 300), (4000, 500), (2100, 500), (2150, 400)]],
    "shale": [[(0, 600), (2050, 600), (2100, 500), (4000, 500), (4000, 1000), (0, 1000)]],
}  # fmt: skip
AREAS = {"basement": 1417500.0, "Lower Sand": 790000.0, "shale": 1792500.0}
FAULT = [(2250.0, 200.0), (2150.0, 400.0), (2000.0, 700.0)]
COLOURS = {"basement": "#a0a0a0", "Lower Sand": "#e8c850", "shale": "#508050"}
ATTRIBUTES = {"basement": {"fric": 0.6}, "Lower Sand": {"fric": 0.5, "color": "yellow"}, "shale": {"fric": 0.2}}


def area(ring: list[tuple[float, float]]) -> float:
    """Of a ring of corners."""
    x, y = np.array(ring, float).T
    return 0.5 * abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))))


def geojson(path: Path) -> Path:
    """A map in metres."""
    features = [
        {"type": "Feature", "properties": {"name": name, **ATTRIBUTES[name]},
         "geometry": {"type": "Polygon", "coordinates": [[*ring, ring[0]]]}}
        for name, rings in LAYERS.items() for ring in rings
    ]  # fmt: skip
    features.append({"type": "Feature", "properties": {"name": "F1"},
                     "geometry": {"type": "LineString", "coordinates": FAULT}})  # fmt: skip
    features.append({"type": "Feature", "properties": {"name": "well"},
                     "geometry": {"type": "Point", "coordinates": [1, 2]}})  # fmt: skip
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def dxf(path: Path) -> Path:
    """A drawing in kilometres."""
    import ezdxf

    document = ezdxf.new("R2010", units=7)
    space = document.modelspace()
    for name, rings in LAYERS.items():
        for ring in rings:
            space.add_lwpolyline([(x / 1e3, y / 1e3) for x, y in ring], close=True, dxfattribs={"layer": name})
    space.add_lwpolyline([(x / 1e3, y / 1e3) for x, y in FAULT], dxfattribs={"layer": "F1"})
    space.add_text("shale", dxfattribs={"layer": "labels"})
    space.add_point((1.0, 0.002), dxfattribs={"layer": "well"})
    document.saveas(path)
    return path


def svg(path: Path) -> Path:
    """A page of 400 x 100 mm, a unit of which is 10 m."""

    def d(points: list[tuple[float, float]]) -> str:
        return "M " + " L ".join(f"{x / 10!r} {100 - y / 10!r}" for x, y in points)

    groups = "".join(
        f'<g inkscape:label="{name}">' + "".join(f'<path d="{d(ring)} Z"/>' for ring in rings) + "</g>"
        for name, rings in LAYERS.items()
    )
    path.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '
        f'width="400mm" height="100mm" viewBox="0 0 400 100">{groups}<g id="F1"><path d="{d(FAULT)}"/></g>'
        '<g id="labels"><text x="1" y="2">shale</text></g></svg>'
    )
    return path


def shapefiles(folder: Path) -> tuple[Path, Path]:
    """Polygons, and the fault in a file of its own; metres."""
    import shapefile

    with shapefile.Writer(str(folder / "layers"), shapeType=shapefile.POLYGON) as out:
        out.field("FORMATION", "C")
        out.field("fric", "N", decimal=3)
        for name, rings in LAYERS.items():
            for ring in rings:
                out.poly([[*ring[::-1], ring[-1]]])
                out.record(name, ATTRIBUTES[name]["fric"])
    with shapefile.Writer(str(folder / "faults"), shapeType=shapefile.POLYLINE) as out:
        out.field("FORMATION", "C")
        out.line([FAULT])
        out.record("F1")
    (folder / "layers.prj").write_text('PROJCS["local",GEOGCS["g",UNIT["degree",0.0174532925]],UNIT["metre",1.0]]')
    return folder / "layers.shp", folder / "faults.shp"


def image(path: Path) -> tuple[Path, Path]:
    """A picture of 10 m pixels, with its legend."""
    from PIL import Image, ImageColor

    from hpcdem.core.selection import even_odd

    columns, rows = int(SIZE[0] / 10), int(SIZE[1] / 10)
    x, y = np.meshgrid(10.0 * (np.arange(columns) + 0.5), 10.0 * (np.arange(rows) + 0.5))
    pixels = np.full((rows, columns, 3), 255, np.uint8)
    for name, rings in LAYERS.items():
        for ring in rings:
            pixels[even_odd([np.array(ring, float)], x, y)] = ImageColor.getrgb(COLOURS[name])
    Image.fromarray(pixels[::-1]).save(path)
    legend = path.with_suffix(".txt")
    legend.write_text("".join(f"{COLOURS[n]}, {n}, fric={ATTRIBUTES[n]['fric']}\n" for n in LAYERS) + "white, -\n")
    return path, legend

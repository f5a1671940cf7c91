"""DXF drawings as sections: the name is the layer, closed curves are polygons."""

from __future__ import annotations

from hpcdem.pre.mesh import dxf
from hpcdem.pre.section.found import Found


def read_dxf(found: Found) -> None:
    """Read polygons and lines of the model space; arcs remain arcs. Other kinds are counted."""
    if found.placement.line is not None:
        raise found.refuse(
            "line applies to maps with heights (GeoJSON, shapefiles); a DXF section lies in its x-y plane"
        )
    drawing = dxf.opened(found.path)
    code = int(drawing.header.get("$INSUNITS", 0))
    if code in dxf.UNITS:
        name, found.metres = dxf.UNITS[code]
        found.unit = f"the drawing is in {name} ($INSUNITS {code})"
    else:
        found.unit = "the drawing defines no unit ($INSUNITS)"
    for layer, curves in dxf.curves(drawing, found.path, dropped=found.dropped).items():
        for number, curve in enumerate(curves):
            if curve.segments:
                found.add_curve(curve, layer, f"curve {number} of layer '{layer}'")
            else:
                found.drop("POINT", layer)

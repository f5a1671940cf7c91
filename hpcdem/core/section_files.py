"""Files of geological sections by their endings."""

from __future__ import annotations

from pathlib import Path

DRAWINGS = (".geojson", ".json", ".shp", ".svg", ".dxf")
IMAGES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".gif", ".webp")
KNOWN = ", ".join([*DRAWINGS, *IMAGES])


def is_section(file: str | Path) -> bool:
    """Return whether the file name has an ending of section files."""
    return Path(file).suffix.lower() in (*DRAWINGS, *IMAGES)

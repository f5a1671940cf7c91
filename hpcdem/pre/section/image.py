"""Images with a legend: areas of one colour are polygons, exactly along the sides of pixels."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import HpcdemError
from hpcdem.pre.mesh import optional
from hpcdem.pre.section.found import Found

TOLERANCE = 40
"""Largest difference of red, green or blue (0 to 255) of a pixel from its colour in the legend."""
SPECK = 9
"""Number of pixels below which a piece of one colour is joined to its neighbours: noise of compressed images and
smoothed edges."""
MOST_PIXELS = 50_000_000
OUTSIDE = "-"
"""Name, in a legend, of the colour that is no part of the model."""


@dataclass(frozen=True)
class Entry:
    """A line of a legend."""

    name: str
    colour: tuple[int, int, int]
    attributes: dict[str, Any] = field(default_factory=dict)


def read_legend(path: Path) -> list[Entry]:
    """Rows ``colour, name, attribute=value, ...``: a colour as #rrggbb or by its name, '-' as name of what is outside.
    HpcdemError with the line that is wrong."""
    from PIL import ImageColor

    entries: list[Entry] = []
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeError) as error:
        raise HpcdemError(f"{path}: cannot be read ({error})") from None
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith("//"):
            continue
        colour, *rest = (part.strip() for part in next(csv.reader([line])))
        try:
            red, green, blue = ImageColor.getrgb(colour)[:3]
        except ValueError:
            raise HpcdemError(f"{path}:{number}: '{colour}' is not a colour; expected #rrggbb or a name") from None
        if not rest or not rest[0]:
            raise HpcdemError(f"{path}:{number}: the colour {colour} has no name; expected colour, name")
        wrong = next((part for part in rest[1:] if "=" not in part), None)
        if wrong is not None:
            raise HpcdemError(f"{path}:{number}: read '{wrong}', expected attribute=value")
        given = dict(part.split("=", 1) for part in rest[1:])
        entries.append(Entry(rest[0], (red, green, blue), {k.strip(): _number(v.strip()) for k, v in given.items()}))
    if not entries:
        raise HpcdemError(f"{path}: the legend is empty; expected lines colour, name")
    return entries


def _number(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text


def read_image(found: Found, legend: Path | None) -> None:
    """Areas of the colours of the legend. One unit is a pixel; the lower left corner of the image is (0, 0)."""
    if legend is None:
        raise found.refuse("an image needs a legend: a file with lines colour, name")
    if found.placement.line is not None:
        raise found.refuse("line applies to maps with heights (GeoJSON, shapefiles), not for images")
    entries = read_legend(legend)
    pixels = _pixels(found)
    label = _labels(found, pixels, entries)
    found.unit = "1 unit = 1 pixel"
    found.axes = f"y upwards from the lower edge; the image is {label.shape[1]} x {label.shape[0]} pixels"
    for k, entry in enumerate(entries):
        share = float((label == k).sum())
        if not share and entry.name != OUTSIDE:
            found.warnings.append(f"no pixel has the colour of '{entry.name}' in {legend.name}")
    _trace(found, label, entries)


def _pixels(found: Found) -> np.ndarray:
    """(rows, columns, 4), the lowest row first."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(found.path) as image:
            if image.width * image.height > MOST_PIXELS:
                raise found.refuse(f"{image.width} x {image.height} pixels; at most {MOST_PIXELS} allowed")
            return np.asarray(image.convert("RGBA"))[::-1]
    except (OSError, UnidentifiedImageError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise found.refuse(f"not a readable image ({error})") from None


def _labels(found: Found, pixels: np.ndarray, entries: list[Entry]) -> np.ndarray:
    """(rows, columns) number of the legend's entry of each pixel, -1 for none."""
    from scipy import ndimage

    best = np.full(pixels.shape[:2], TOLERANCE + 1, np.int64)
    label = np.full(pixels.shape[:2], -1, np.int64)
    for k, entry in enumerate(entries):
        far = np.abs(pixels[:, :, :3].astype(np.int64) - entry.colour).max(axis=2)
        nearer = far < best
        best[nearer], label[nearer] = far[nearer], k
    clear = pixels[:, :, 3] < 128
    lost = (label < 0) & ~clear
    specks = np.zeros(label.shape, bool)
    for k in range(len(entries)):
        piece, count = ndimage.label(label == k)
        small = np.bincount(piece.ravel(), minlength=count + 1) < SPECK
        small[0] = False
        specks |= small[piece]
    free = (lost | specks) & ~clear
    if free.any() and (label >= 0)[~free].any():
        near = ndimage.distance_transform_edt(free | clear, return_distances=True, return_indices=True)
        close = free & (near[0] <= 3.0)
        label[close] = label[tuple(near[1][:, close])]
        label[free & ~close] = -1
    if free.any():
        rows, columns = np.nonzero(free)
        found.warnings.append(
            f"{int(lost.sum())} pixels have no colour of the legend and {int(specks.sum())} are in pieces of less than "
            f"{SPECK} pixels, the first at pixel ({columns[0]}, {rows[0]}) from the lower left; "
            f"{int((free & (label >= 0)).sum())} take the colour of their neighbours, "
            f"{int((free & (label < 0)).sum())} are outside"
        )
    label[clear] = -1
    return label


def _trace(found: Found, label: np.ndarray, entries: list[Entry]) -> None:
    """Polygons along the sides of pixels between different labels."""
    shapely = optional.shapely()
    padded = np.pad(label, 1, constant_values=-1)
    row, column = np.nonzero(padded[1:-1, 1:] != padded[1:-1, :-1])  # sides that run upwards, at x = column
    upwards = np.stack([np.stack([column, row], 1), np.stack([column, row + 1], 1)], 1)
    row, column = np.nonzero(padded[1:, 1:-1] != padded[:-1, 1:-1])
    across = np.stack([np.stack([column, row], 1), np.stack([column + 1, row], 1)], 1)
    both = np.concatenate([upwards, across])
    sides = shapely.linestrings(both.astype(float))
    ends, meeting = np.unique(both.reshape(-1, 2), axis=0, return_counts=True)
    junctions = {(x, y) for x, y in ends[meeting > 2].tolist()}
    faces = shapely.get_parts(shapely.polygonize([*sides])) if len(sides) else []
    inside = shapely.get_coordinates(shapely.point_on_surface(faces)).astype(np.int64)
    order = np.lexsort((inside[:, 0], inside[:, 1]))
    for k in order:
        number = int(label[inside[k, 1], inside[k, 0]])
        if number < 0 or entries[number].name == OUTSIDE:
            continue
        entry, face = entries[number], faces[k]
        rings = [_corners(shapely.get_coordinates(ring), junctions) for ring in (face.exterior, *face.interiors)]
        colour = "".join(f"{c:02x}" for c in entry.colour)
        found.add(rings, True, entry.name, f"the area of colour #{colour}", entry.attributes)


def _corners(ring: np.ndarray, junctions: set[tuple[int, int]]) -> np.ndarray:
    """The points where a ring turns, or meets others, so that neighbours share their points; closed."""
    points = ring[:-1]
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turns = before[:, 0] * after[:, 1] != before[:, 1] * after[:, 0]
    met = np.array([(int(x), int(y)) in junctions for x, y in points.tolist()])
    kept = points[turns | met]
    return np.concatenate([kept, kept[:1]])

"""SVG drawings, read by svgelements."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import ParseError

import numpy as np

from hpcdem.core.selection import even_odd
from hpcdem.pre.mesh import optional
from hpcdem.pre.section.found import Found

LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
STEPS = 64
"""Number of straight parts of a curve of a path: a quarter of a circle then deviates by 1.5e-4 of its radius."""


def read_svg(found: Found) -> None:
    """Closed paths and shapes are polygons, open ones lines. Units are those of the view box, with y upwards from the
    bottom of the page. The name is the label of the element or of the nearest group with a label or an id, else its
    own id."""
    elements = optional.svgelements()
    try:
        page = elements.SVG.parse(str(found.path), reify=True)
    except (ParseError, ValueError, TypeError, KeyError, AttributeError, RecursionError, IndexError,
            ZeroDivisionError) as error:  # fmt: skip
        raise found.refuse(f"not a readable SVG drawing ({str(error) or type(error).__name__})") from None
    # The library converts millimetres and inches with six digits only: undone, as units of the view box are needed.
    box = page.viewbox
    matrix = ~elements.Matrix(page.viewbox_transform or "")
    height = float(page.height) if box is None or page.height is None else float(box.height) + float(box.y or 0.0)
    found.unit = "an SVG drawing defines no unit"
    found.axes = f"y upwards from the bottom of the page, which is {height:g} units high"
    _walk(found, elements, page, matrix, height, "")


def _walk(found: Found, elements: Any, at: Any, matrix: Any, height: float, layer: str) -> None:
    for one in at:
        label = _label(one)
        if isinstance(one, elements.Shape):
            own = one.values.get("attributes", {})
            name = label or layer or _id(one) or str(own.get("fill", "")) or "unnamed"
            _shape(found, elements, one * matrix, height, name)
        elif isinstance(one, elements.Group | elements.Use | elements.SVG):
            _walk(found, elements, one, matrix, height, label or _id(one) or layer)
        elif type(one).__name__ not in ("Title", "Desc", "SVGElement", "ClipPath", "Pattern"):
            found.drop(type(one).__name__.lower(), layer)


def _label(one: Any) -> str:
    return str(one.values.get("attributes", {}).get(LABEL, ""))


def _id(one: Any) -> str:
    return str(one.values.get("attributes", {}).get("id", ""))


def _shape(found: Found, elements: Any, one: Any, height: float, name: str) -> None:
    path = elements.Path(one)
    path.reify()
    kind = type(one).__name__.lower()
    where = f"{kind} {_id(one)}".rstrip()
    closed: list[np.ndarray] = []
    lines: list[np.ndarray] = []
    for part in path.as_subpaths():
        points = _points(elements, part)
        if len(points) < 2:
            found.drop(f"{kind} without length", name)
            continue
        points = np.column_stack([points[:, 0], height - points[:, 1]])
        (closed if len(points) > 2 and (points[0] == points[-1]).all() else lines).append(points)
    for rings in _nested(closed):
        found.add(rings, True, name, where)
    for points in lines:
        found.add([points], False, name, where)


def _points(elements: Any, part: Any) -> np.ndarray:
    points: list[tuple[float, float]] = []
    for segment in part:
        if isinstance(segment, elements.Move):
            points.append((segment.end.x, segment.end.y))
        elif isinstance(segment, elements.Close):
            points.append(points[0])
        elif isinstance(segment, elements.Line):
            points.append((segment.end.x, segment.end.y))
        else:
            points += [(p.x, p.y) for p in (segment.point(k / STEPS) for k in range(1, STEPS + 1))]
    return np.array(points, np.float64).reshape(-1, 2)


def _nested(rings: list[np.ndarray]) -> list[list[np.ndarray]]:
    """Outlines with their holes: a ring inside of an odd number of others is a hole of the smallest of them."""
    size = [abs(float(np.ptp(r[:, 0]) * np.ptp(r[:, 1]))) for r in rings]
    within = [
        [j for j, other in enumerate(rings) if j != i and size[j] > size[i] and even_odd([other], *ring[:1].T)[0]]
        for i, ring in enumerate(rings)
    ]
    outlines = {i: [rings[i]] for i, around in enumerate(within) if len(around) % 2 == 0}
    for i, around in enumerate(within):
        if len(around) % 2:
            outlines[min((j for j in around if j in outlines), key=lambda j: size[j])].append(rings[i])
    return list(outlines.values())

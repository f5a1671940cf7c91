"""DXF drawings into geometry layers, read by ezdxf."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.io.agreed import atomic_path
from hpcdem.pre.mesh import geometry, optional
from hpcdem.pre.mesh.geometry import Curve

NOTES = frozenset(
    "TEXT MTEXT DIMENSION ARC_DIMENSION LEADER MULTILEADER TOLERANCE ATTDEF ATTRIB HATCH VIEWPORT IMAGE WIPEOUT".split()
)
"""Entities that annotate a drawing; they are omitted without a warning."""
UNITS = {
    1: ("inches", 0.0254), 2: ("feet", 0.3048), 3: ("miles", 1609.344), 4: ("millimetres", 1e-3),
    5: ("centimetres", 1e-2), 6: ("metres", 1.0), 7: ("kilometres", 1e3), 8: ("microinches", 2.54e-8),
    9: ("mils", 2.54e-5), 10: ("yards", 0.9144), 14: ("decimetres", 0.1), 15: ("decametres", 10.0),
    16: ("hectometres", 100.0), 21: ("US survey feet", 1200.0 / 3937.0),
}  # fmt: skip
"""Name and metres of the codes of $INSUNITS."""
FLATTENING = 1e-4
"""Largest deviation of the polylines that replace splines and ellipses, over their size."""


def opened(path: Path) -> Any:
    """Open a drawing; HpcdemError if the file is none."""
    ezdxf = optional.ezdxf()
    try:
        return ezdxf.readfile(path)
    except FileNotFoundError:
        raise CommandError(f"{path}: there is no such file") from None
    except (OSError, ezdxf.DXFError, UnicodeError, ValueError, KeyError, IndexError) as error:
        raise HpcdemError(f"{path}: not a readable DXF drawing ({error})") from None


def metres(document: Any, scale: float | None, notes: list[str]) -> float:
    """Return the metres per unit of the drawing: as given, else by its header ($INSUNITS), else 1. notes: receives the
    choice.
    """
    code = int(document.header.get("$INSUNITS", 0))
    name, factor = UNITS.get(code, ("", 1.0))
    unit_text = f"the drawing is in {name} ($INSUNITS {code})" if name else "the drawing defines no unit ($INSUNITS)"
    taken = factor if scale is None else scale
    how = "set by scale" if scale is not None else "replaced by scale" if name else "interpreted as metres"
    notes.append(f"{unit_text}: 1 unit = {taken:g} m, {how}")
    return taken


def write(path: Path, layers: Mapping[str, Sequence[Curve]], units: int = 6) -> None:
    """Write a drawing of these curves, by layer. units: a code of UNITS, 0 none. CommandError for an invalid
    layer name.
    """
    ezdxf = optional.ezdxf()
    document = ezdxf.new("R2010", units=units)
    space = document.modelspace()
    for name, curves in layers.items():
        if any(char in '<>/\\":;?*|=`,' for char in name):
            raise CommandError(f"'{name}' is not a valid layer name: it contains one of <>/\\\":;?*|=`,")
        if name not in document.layers:
            document.layers.add(name)
        for curve in curves:
            if not curve.segments:
                space.add_point(tuple(curve.points[0].tolist()), dxfattribs={"layer": name})
                continue
            rows = [(x, y, bulge) for (x, y), bulge in zip(curve.points.tolist(), curve.bulges.tolist())]
            space.add_lwpolyline(rows, format="xyb", close=curve.closed, dxfattribs={"layer": name})
    with atomic_path(path) as temporary:
        document.saveas(temporary)


def read_dxf(path: str | Path, only: set[str] | None = None) -> dict[str, list[Curve]]:
    """Curves of the model space by layer of the drawing, in the units of the drawing, in its order.

    LINE, LWPOLYLINE, POLYLINE (two-dimensional), CIRCLE, ARC, POINT are taken as they are, SPLINE and ELLIPSE as
    polylines, INSERT by what its block contains. Notes (NOTES) are left out. Anything else, and what is not drawn in
    the x-y plane, is refused with its type, handle and layer. `only`: the layers wanted; HpcdemError if one is missing.
    """
    path = Path(path)
    return curves(opened(path), path, only)


def curves(
    document: Any,
    path: Path,
    only: set[str] | None = None,
    dropped: Counter[tuple[str, str]] | None = None,
    notes_left: Counter[tuple[str, str]] | None = None,
) -> dict[str, list[Curve]]:
    """Curves of an opened drawing by layer. notes_left: gets the number of notes by (kind, layer); dropped: that and
    the number of unknown kinds, which are otherwise refused."""
    found: dict[str, list[Curve]] = {}
    for entity, layer in flat(document.modelspace(), str(path), dropped=dropped if dropped is not None else notes_left):
        if only is not None and layer not in only:
            continue
        if dropped is not None and entity.dxftype() not in _READERS:
            dropped[entity.dxftype(), layer] += 1
            continue
        where = f"{path}: {entity.dxftype()} (handle {entity.dxf.handle}, layer '{layer}')"
        try:
            curve = _curve(entity, where)
        except CommandError as error:
            raise HpcdemError(f"{where}: {error}") from None
        found.setdefault(layer, []).append(curve)
    missing = sorted((only or set()) - set(found))
    if missing:
        known = ", ".join(f"'{n}'" for n in found) or "none"
        raise HpcdemError(f"{path}: layer '{missing[0]}' is empty or missing (layers read: {known})")
    if not found:
        raise HpcdemError(f"{path}: the drawing contains no line, arc, circle or point")
    return found


def flat(
    entities: Any, path: str, depth: int = 0, layer: str = "0", dropped: Counter[tuple[str, str]] | None = None
) -> Iterator[tuple[Any, str]]:
    """Entities with inserted blocks taken apart, and the layer of each: what is in layer 0 of a block is in that of the
    insertion. dropped: gets the number of notes by (kind, layer)."""
    for entity in entities:
        kind = entity.dxftype()
        own = str(entity.dxf.layer) if depth == 0 or str(entity.dxf.layer) != "0" else layer
        if kind in NOTES:
            if dropped is not None:
                dropped[kind, own] += 1
            continue
        if kind != "INSERT":
            yield entity, own
        elif depth > 16:
            raise HpcdemError(f"{path}: INSERT (handle {entity.dxf.handle}): more than 16 nested blocks")
        else:
            for one in entity.multi_insert() if entity.mcount > 1 else (entity,):  # rows and columns of a block
                yield from flat(one.virtual_entities(), path, depth + 1, own, dropped)


def _curve(entity: Any, where: str) -> Curve:
    kind = entity.dxftype()
    if kind not in _READERS:
        raise HpcdemError(f"{where}: this type is not supported; known: {', '.join(_READERS)} and INSERT")
    mirrored = False
    if entity.dxf.hasattr("extrusion") and kind not in ("LINE", "POINT", "SPLINE"):
        x, y, z = entity.dxf.extrusion
        if (round(x, 9), round(y, 9), abs(round(z, 9))) != (0.0, 0.0, 1.0):
            raise HpcdemError(
                f"{where}: it has its own plane (extrusion {x:g}, {y:g}, {z:g}); only the x-y plane is supported"
            )
        mirrored = z < 0.0 and kind != "ELLIPSE"  # its points are those of the drawing already
    curve = _READERS[kind](entity, where)
    # What is drawn with z downwards, as mirrored blocks are, has x the other way round.
    return geometry.transformed(curve, scale=(-1.0, 1.0)) if mirrored else curve


def _xy(at: Any) -> tuple[float, float]:
    return float(at[0]), float(at[1])


def _level(points: Any, where: str) -> list[tuple[float, float]]:
    """The points without z; HpcdemError if they do not all have the same."""
    heights = [float(at[2]) for at in points]
    flat = [_xy(at) for at in points]
    low, high = min(heights), max(heights)
    if high - low > 1e-6 * max(math.dist(flat[0], at) for at in flat):
        raise HpcdemError(f"{where}: it extends from z = {low:g} to {high:g}; only the x-y plane is supported")
    return flat


def _line(entity: Any, where: str) -> Curve:
    return geometry.polyline(_level([entity.dxf.start, entity.dxf.end], where))


def _circle(entity: Any, where: str) -> Curve:
    return geometry.circle(_xy(entity.dxf.center), entity.dxf.radius)


def _arc(entity: Any, where: str) -> Curve:
    return geometry.arc(_xy(entity.dxf.center), entity.dxf.radius, entity.dxf.start_angle, entity.dxf.end_angle)


def _point(entity: Any, where: str) -> Curve:
    return geometry.point(_xy(entity.dxf.location))


def _light_polyline(entity: Any, where: str) -> Curve:
    rows = np.array(entity.get_points("xyb"), np.float64).reshape(-1, 3)
    return _with_bulges(rows, bool(entity.closed))


def _heavy_polyline(entity: Any, where: str) -> Curve:
    if not entity.is_2d_polyline:
        raise HpcdemError(f"{where}: only two-dimensional polylines are supported, this is '{entity.get_mode()}'")
    rows = [(*_xy(v.dxf.location), v.dxf.get("bulge", 0.0)) for v in entity.vertices]
    return _with_bulges(np.array(rows, np.float64).reshape(-1, 3), bool(entity.is_closed))


def _with_bulges(rows: np.ndarray, closed: bool) -> Curve:
    """rows (n, 3): x, y, bulge. Doubled points, which drawings often have, are left out."""
    if len(rows) > 1 and (rows[0, :2] == rows[-1, :2]).all():
        rows, closed = rows[:-1], True
    after = np.roll(rows[:, :2], -1, axis=0)
    keep = (rows[:, :2] != after).any(axis=1)
    keep[-1] |= not closed
    rows = rows[keep]
    two_arcs = closed and len(rows) == 2 and rows[:, 2].any()  # a circle is often drawn so
    if not np.isfinite(rows).all() or len(rows) < (3 if closed and not two_arcs else 2):
        raise CommandError(f"polyline: {len(rows)} different points are too few, or they are not finite")
    return Curve(rows[:, :2].copy(), rows[:, 2].copy(), closed)


def _flattened(entity: Any, where: str) -> Curve:
    # A rough polyline first: its size says how much the fine one may deviate.
    rough = np.array(_level(list(entity.flattening(1e300, 8)), where), np.float64)
    size = float(np.ptp(rough, axis=0).max())
    fine = [_xy(p) for p in entity.flattening(FLATTENING * size)] if size > 0.0 else []
    if len(fine) > 2 and math.dist(fine[0], fine[-1]) < 1e-9 * size:
        fine[-1] = fine[0]  # a whole ellipse ends where it began, but for rounding
    return geometry.polyline([p for i, p in enumerate(fine) if i == 0 or p != fine[i - 1]])


_READERS = {
    "LINE": _line,
    "LWPOLYLINE": _light_polyline,
    "POLYLINE": _heavy_polyline,
    "CIRCLE": _circle,
    "ARC": _arc,
    "POINT": _point,
    "SPLINE": _flattened,
    "ELLIPSE": _flattened,
}

"""Geometry layers: named sets of points, polylines and arcs, from which meshes, cracks and ranges are made.

A curve is a row of points with a *bulge* per segment, as in DXF: tan(sweep / 4), 0 for a straight segment, positive if
the arc turns counter-clockwise. So circles and arcs stay what they are until their edges are made, under any
translation, rotation and uniform scaling.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError

Vector = Sequence[float]

MOST_SIDES = 100_000
"""Largest number of straight sides of a circle."""
STEPS_PER_CIRCLE = 8
"""Smallest number of edges of a circle, however coarse the mesh."""


@dataclass(frozen=True)
class Curve:
    """One point, or a chain of straight segments and arcs."""

    points: np.ndarray
    """(n, 2) f8 [m]."""
    bulges: np.ndarray
    """(n,) f8 tan(sweep / 4) of the segment from each point to the next; the last one counts if closed."""
    closed: bool = False

    @property
    def segments(self) -> int:
        """Return the number of segments; 0 for a point."""
        return len(self.points) - (0 if self.closed else 1)

    def segment(self, i: int) -> tuple[np.ndarray, np.ndarray, float]:
        """First point, last point and bulge of segment i."""
        return self.points[i], self.points[(i + 1) % len(self.points)], float(self.bulges[i])

    def length(self) -> float:
        """Length of all segments [m]."""
        return math.fsum(_length(*self.segment(i)) for i in range(self.segments))


def point(at: Vector) -> Curve:
    """Return a single point."""
    return _curve([at], closed=False, least=1, what="point")


def polyline(points: Sequence[Vector], closed: bool = False) -> Curve:
    """Return straight segments through the points; the line is closed if the last point equals the first."""
    xy = [tuple(p) for p in points]
    if len(xy) > 2 and xy[0] == xy[-1]:
        xy, closed = xy[:-1], True
    return _curve(xy, closed=closed, least=3 if closed else 2, what="closed polyline" if closed else "polyline")


def polygon(points: Sequence[Vector]) -> Curve:
    """Return a closed polyline; it must not cross itself."""
    curve = polyline(points, closed=True)
    hit = _self_crossing(curve.points)
    if hit is not None:
        raise CommandError(f"polygon: its sides {hit[0] + 1} and {hit[1] + 1} cross or touch each other")
    return curve


def rectangle(one: Vector, other: Vector) -> Curve:
    """Return the rectangle between two opposite corners [m], counter-clockwise from the lower left."""
    (x0, y0), (x1, y1) = _pair(one, "rectangle"), _pair(other, "rectangle")
    if x0 == x1 or y0 == y1:
        raise CommandError(f"rectangle: the corners ({x0:g}, {y0:g}) and ({x1:g}, {y1:g}) span no area")
    x0, x1, y0, y1 = min(x0, x1), max(x0, x1), min(y0, y1), max(y0, y1)
    return polyline([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], closed=True)


def circle(centre: Vector, radius: float) -> Curve:
    """Return a circle [m], counter-clockwise: two half arcs."""
    x, y = _pair(centre, "circle")
    _positive(radius, "circle: radius")
    return Curve(np.array([[x - radius, y], [x + radius, y]]), np.array([1.0, 1.0]), True)


def segmented_circle(centre: Vector, radius: float, length: float) -> Curve:
    """Return a polygon of at least three equal sides of about this length with its corners on a circle [m], the first
    in the direction of x.
    """
    x, y = _pair(centre, "circle")
    _positive(radius, "circle: radius")
    _positive(length, "circle: segment length")
    sides = max(3, round(2.0 * math.pi * radius / length))
    if sides > MOST_SIDES:
        raise CommandError(f"circle: sides of {length:g} m require {sides} sides, at most {MOST_SIDES} allowed")
    turn = 360.0 / sides
    at = [_cos_sin(k * turn) for k in range(sides)]
    return _curve([(x + radius * c, y + radius * s) for c, s in at], closed=True, least=3, what="circle")


def arc(centre: Vector, radius: float, start: float, end: float) -> Curve:
    """Return an arc [m], counter-clockwise from angle `start` to angle `end` [degrees from the x axis]; less than a
    circle.
    """
    x, y = _pair(centre, "arc")
    _positive(radius, "arc: radius")
    if not (math.isfinite(start) and math.isfinite(end)):
        raise CommandError(f"arc: angles must be finite, not {start:g} and {end:g}")
    sweep = (end - start) % 360.0
    if sweep == 0.0:
        raise CommandError(f"arc: angles {start:g} and {end:g} are equal: use 'circle' for a full circle")
    # Two halves: the bulge of a nearly full circle is not well defined.
    a = np.radians([start, start + 0.5 * sweep, start + sweep])
    xy = np.column_stack([x + radius * np.cos(a), y + radius * np.sin(a)])
    bulge = math.tan(math.radians(sweep) / 8.0)
    return Curve(xy, np.array([bulge, bulge, 0.0]), False)


def arc_between(centre: Vector, start: Vector, end: Vector) -> Curve:
    """Return an arc about a centre, counter-clockwise between two points [m]; CommandError if they are not at the same
    distance from it.
    """
    one, other = (np.array(_pair(at, "arc")) - np.array(_pair(centre, "arc")) for at in (start, end))
    radius, far = float(np.hypot(*one)), float(np.hypot(*other))
    if abs(radius - far) > 1e-6 * max(radius, far):
        raise CommandError(
            f"arc: its ends are {radius:g} and {far:g} m away from its centre; both distances must be equal"
        )
    found = arc(centre, radius, *(math.degrees(math.atan2(at[1], at[0])) for at in (one, other)))
    points = found.points.copy()
    points[0], points[-1] = start, end
    return Curve(points, found.bulges, False)


def transformed(
    curve: Curve,
    translate: Vector = (0.0, 0.0),
    rotate: float = 0.0,
    scale: float | Vector = 1.0,
    about: Vector = (0.0, 0.0),
) -> Curve:
    """Scale a curve, rotate it (counter-clockwise, degrees) about the point `about`, then translate it [m].

    A negative factor mirrors. CommandError if an arc would become an ellipse.
    """
    sx, sy = (scale, scale) if isinstance(scale, int | float) else _pair(scale, "transform scale")
    if not (math.isfinite(sx) and math.isfinite(sy)) or sx == 0.0 or sy == 0.0:
        raise CommandError(f"transform: scale must be finite and not zero, not ({sx:g}, {sy:g})")
    if abs(sx) != abs(sy) and np.any(curve.bulges != 0.0):
        raise CommandError(f"transform: scale ({sx:g}, {sy:g}) would turn arcs into ellipses")
    if not math.isfinite(rotate):
        raise CommandError(f"transform: the angle must be finite, not {rotate:g}")
    centre, offset = np.array(_pair(about, "transform about")), np.array(_pair(translate, "transform translate"))
    c, s = _cos_sin(rotate)
    xy = (curve.points - centre) * (sx, sy)
    xy = np.column_stack([c * xy[:, 0] - s * xy[:, 1], s * xy[:, 0] + c * xy[:, 1]])
    return Curve(xy + centre + offset, curve.bulges * math.copysign(1.0, sx * sy), curve.closed)


def _cos_sin(degrees: float) -> tuple[float, float]:
    """Exact at quarter turns, so that a turned rectangle has straight sides."""
    exact = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}
    turn = degrees % 360.0
    return exact.get(turn, (math.cos(math.radians(turn)), math.sin(math.radians(turn))))


class Layers:
    """Curves, in space solids (solids.py), by layer name, in the order of making."""

    def __init__(self) -> None:
        self.curves: dict[str, list[Any]] = {}

    def add(self, layer: str, *curves: Any) -> None:
        """Append curves or solids to a layer, which is made if it is new."""
        if not layer:
            raise CommandError("a geometry layer needs a name")
        self.curves.setdefault(layer, []).extend(curves)

    def __getitem__(self, layer: str) -> list[Any]:
        if layer not in self.curves:
            known = ", ".join(f"'{n}'" for n in self.curves) or "none"
            raise CommandError(f"there is no geometry layer '{layer}' (layers so far: {known})")
        return self.curves[layer]

    def __contains__(self, layer: str) -> bool:
        return layer in self.curves

    def __iter__(self) -> Iterator[str]:
        return iter(self.curves)

    def remove(self, layer: str) -> None:
        """Remove a layer."""
        del self.curves[self._known(layer)]

    def transform(self, layer: str, copy_to: str | None = None, **how: Any) -> None:
        """Move the curves of a layer (see `transformed`), or add moved copies to another layer."""
        moved = [transformed(c, **how) for c in self[layer]]
        if copy_to is None:
            self.curves[layer] = moved
        else:
            self.add(copy_to, *moved)

    def _known(self, layer: str) -> str:
        _ = self[layer]
        return layer

    def tables(self) -> dict[str, np.ndarray]:
        """Return everything but solids as arrays for a checkpoint: names, and curves in sequence."""
        rows = [(k, c) for k, name in enumerate(self.curves) for c in self.curves[name] if isinstance(c, Curve)]
        return {
            "layer_names": np.array(list(self.curves), dtype=object),
            "curve_layer": np.array([k for k, _ in rows], np.int64),
            "curve_closed": np.array([c.closed for _, c in rows], np.int64),
            "curve_start": np.cumsum([0] + [len(c.points) for _, c in rows]).astype(np.int64),
            "points": np.concatenate([c.points for _, c in rows]) if rows else np.empty((0, 2)),
            "bulges": np.concatenate([c.bulges for _, c in rows]) if rows else np.empty(0),
        }

    @staticmethod
    def from_tables(tables: dict[str, np.ndarray]) -> Layers:
        """The inverse of `tables`."""
        layers = Layers()
        names = [n.decode() if isinstance(n, bytes) else str(n) for n in tables["layer_names"]]
        layers.curves = {name: [] for name in names}
        start = tables["curve_start"]
        for i, k in enumerate(tables["curve_layer"]):
            part = slice(int(start[i]), int(start[i + 1]))
            curve = Curve(tables["points"][part], tables["bulges"][part], bool(tables["curve_closed"][i]))
            layers.curves[names[int(k)]].append(curve)
        return layers


# --- arcs and straight segments ----------------------------------------------------------------------------------


def arc_of(a: np.ndarray, b: np.ndarray, bulge: float) -> tuple[np.ndarray, float, float, float]:
    """Centre, radius, angle of the first point and sweep (signed) of an arc segment [m, rad].

    With the chord c and the bulge t = tan(sweep / 4): radius = c (1 + t2) / (4 |t|), and the centre lies
    c (1 - t2) / (4 t) to the left of the middle of the chord.
    """
    chord = b - a
    left = np.array([-chord[1], chord[0]])
    centre = 0.5 * (a + b) + left * ((1.0 - bulge * bulge) / (4.0 * bulge))
    radius = float(np.hypot(*chord)) * (1.0 + bulge * bulge) / (4.0 * abs(bulge))
    return centre, radius, math.atan2(a[1] - centre[1], a[0] - centre[0]), 4.0 * math.atan(bulge)


def along(a: np.ndarray, b: np.ndarray, bulge: float, t: np.ndarray) -> np.ndarray:
    """(n, 2) points at the fractions t (n,) of the length of a segment; ends are met exactly."""
    t = np.asarray(t, np.float64)
    if bulge == 0.0:
        out = a + t[:, None] * (b - a)
    else:
        centre, radius, start, sweep = arc_of(a, b, bulge)
        angle = start + t * sweep
        out = np.column_stack([centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)])
    out[t == 0.0], out[t == 1.0] = a, b
    return out


def _length(a: np.ndarray, b: np.ndarray, bulge: float) -> float:
    if bulge == 0.0:
        return math.dist(a, b)
    _, radius, _, sweep = arc_of(a, b, bulge)
    return radius * abs(sweep)


def sampled(curve: Curve, spacing: float) -> np.ndarray:
    """(n, 2) points on a curve, none farther than `spacing` from the next [m]; a closed one does not repeat its first.

    Arcs have at least STEPS_PER_CIRCLE steps per turn.
    """
    rows = []
    for i in range(curve.segments):
        a, b, bulge = curve.segment(i)
        n = max(1, math.ceil(_length(a, b, bulge) / spacing - 1e-9), least_steps(bulge))
        rows.append(along(a, b, bulge, np.arange(n) / n))
    if not curve.closed:
        rows.append(curve.points[-1:])
    return np.concatenate(rows)


def least_steps(bulge: float) -> int:
    """Return the least number of edges of a segment, from the angle of its arc (bulge: tangent of a quarter of it)."""
    return max(1, math.ceil(abs(4.0 * math.atan(bulge)) / (2.0 * math.pi) * STEPS_PER_CIRCLE - 1e-9))


def distance(curve: Curve, at: np.ndarray) -> np.ndarray:
    """(n,) distance of the points `at` (n, 2) from the curve itself, arcs as arcs [m]."""
    at = np.asarray(at, np.float64).reshape(-1, 2)
    if not curve.segments:
        return np.hypot(*(at - curve.points[0]).T)
    best = np.full(len(at), np.inf)
    for i in range(curve.segments):
        best = np.minimum(best, distance_to_segment(*curve.segment(i), at))
    return best


def distance_to_segment(a: np.ndarray, b: np.ndarray, bulge: float, at: np.ndarray) -> np.ndarray:
    """(n,) distance of the points `at` (n, 2) from a straight segment or an arc [m]."""
    if bulge == 0.0:
        offset = b - a
        t = np.clip((at - a) @ offset / (offset @ offset), 0.0, 1.0)
        return np.hypot(*(at - a - t[:, None] * offset).T)
    centre, radius, start, sweep = arc_of(a, b, bulge)
    rel = at - centre
    turn = (np.arctan2(rel[:, 1], rel[:, 0]) - start) * math.copysign(1.0, sweep) % (2.0 * math.pi)
    ends = np.minimum(np.hypot(*(at - a).T), np.hypot(*(at - b).T))
    return np.where(turn <= abs(sweep), np.abs(np.hypot(*rel.T) - radius), ends)


# --- checks of the given numbers --------------------------------------------------------------------------


def _curve(points: Sequence[Vector], closed: bool, least: int, what: str) -> Curve:
    xy = np.array([_pair(p, what) for p in points], np.float64).reshape(-1, 2)
    if len(xy) < least:
        raise CommandError(f"{what}: {len(xy)} points given, at least {least} needed")
    after = np.roll(xy, -1, axis=0) if closed else xy[1:]
    same = np.flatnonzero((xy[: len(after)] == after).all(axis=1))
    if len(same) and len(xy) > 1:
        i = int(same[0])
        raise CommandError(
            f"{what}: points {i + 1} and {(i + 1) % len(xy) + 1} are the same, ({xy[i, 0]:g}, {xy[i, 1]:g})"
        )
    return Curve(xy, np.zeros(len(xy)), closed)


def _pair(p: Vector, what: str) -> tuple[float, float]:
    try:
        x, y = (float(v) for v in p)
    except (TypeError, ValueError):
        raise CommandError(f"{what}: two coordinates are needed, not {p!r}") from None
    if not (math.isfinite(x) and math.isfinite(y)):
        raise CommandError(f"{what}: coordinates must be finite, not ({x:g}, {y:g})")
    return x, y


def _positive(value: float, what: str) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise CommandError(f"{what} must be positive, not {value:g}")


def _self_crossing(xy: np.ndarray) -> tuple[int, int] | None:
    """Numbers of two sides of a polygon that meet although they are not neighbours, or neighbours that fold back."""
    a, b = xy, np.roll(xy, -1, axis=0)
    n = len(xy)
    for i in range(n):
        other = np.arange(i + 1, n)
        across = _side(a[i], b[i], a[other]) * _side(a[i], b[i], b[other]) <= 0
        back = _side(a[other], b[other], a[i]) * _side(a[other], b[other], b[i]) <= 0
        lo, hi = np.minimum(a[i], b[i]), np.maximum(a[i], b[i])
        olo, ohi = np.minimum(a[other], b[other]), np.maximum(a[other], b[other])
        box = ((lo <= ohi) & (olo <= hi)).all(axis=1)
        neighbour = (other == i + 1) | ((i == 0) & (other == n - 1))
        hit = np.flatnonzero(across & back & box & ~neighbour)
        if len(hit):
            return i, int(other[hit[0]])
        u, v = b[i] - a[i], b[(i + 1) % n] - a[(i + 1) % n]
        if u[0] * v[1] - u[1] * v[0] == 0.0 and u @ v < 0.0:
            return i, (i + 1) % n
    return None


def _side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
    """1 where r lies to the left of the line from p to q, -1 to the right, 0 on it."""
    u, v = q - p, r - p
    return np.sign(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

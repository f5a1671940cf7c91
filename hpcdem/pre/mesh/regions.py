"""Areas from geometry layers: which closed curves bound what, with shapely."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.pre.mesh import optional
from hpcdem.pre.mesh.geometry import Curve, Layers, along, least_steps
from hpcdem.pre.mesh.sizes import SizeField

GRID = 1e-7
"""Distance over the mesh size below which ends of curves are one point."""


def edges_of_curve(curve: Curve, sizes: SizeField, most: float = math.inf) -> np.ndarray:
    """(m, 2, 2) straight segments of a curve: arcs cut into edges of the mesh size, straight segments whole.

    The points of an arc lie on it; STEPS_PER_CIRCLE of them at least. most: a bound of the size on this curve [m].
    """
    rows = []
    for i in range(curve.segments):
        a, b, bulge = curve.segment(i)
        if bulge == 0.0:
            rows.append(np.array([[a, b]]))
            continue
        length = Curve(np.array([a, b]), np.array([bulge, 0.0])).length()
        t = sizes.samples_for(length)
        cuts = sizes.parts_of(along(a, b, bulge, t), length, most)
        least = least_steps(bulge)
        if len(cuts) - 1 < least:
            cuts = np.arange(least + 1) / least
        xy = along(a, b, bulge, cuts)
        rows.append(np.stack([xy[:-1], xy[1:]], axis=1))
    return np.concatenate(rows) if rows else np.empty((0, 2, 2))


def noded(segments: np.ndarray, grid: float) -> np.ndarray:
    """(m, 2, 2) the same lines cut wherever they cross or touch; ends nearer than `grid` [m] are one."""
    shapely = optional.shapely()
    if not len(segments):
        return segments
    # A power of ten: decimal coordinates of a script then stay what they are.
    step = 10.0 ** math.floor(math.log10(grid))
    lines = shapely.union_all(shapely.linestrings(segments), grid_size=step)
    parts = shapely.get_parts(shapely.line_merge(lines))
    out = []
    for part in parts:
        xy = shapely.get_coordinates(part)
        out.append(np.stack([xy[:-1], xy[1:]], axis=1))
    cut = np.concatenate(out)
    back = _given_back(cut.reshape(-1, 2), np.unique(segments.reshape(-1, 2), axis=0), step)
    return back.reshape(-1, 2, 2)


def _given_back(rounded: np.ndarray, exact: np.ndarray, step: float) -> np.ndarray:
    """Rounded points that are given points get their exact coordinates back."""
    from scipy.spatial import cKDTree

    far, which = cKDTree(exact).query(rounded, distance_upper_bound=2.0 * step)
    return np.where(np.isfinite(far)[:, None], exact[np.minimum(which, len(exact) - 1)], rounded)


def faces(segments: np.ndarray, layer: str, size: float) -> list[Any]:
    """Polygons of shapely bounded by the curves of a layer (m, 2, 2); CommandError where a curve is open."""
    shapely = optional.shapely()
    if not len(segments):
        raise CommandError(f"layer '{layer}' has no lines: it cannot bound a region")
    lines = shapely.linestrings(noded(segments, GRID * size))
    polygons, cuts, dangles, _ = shapely.polygonize_full(lines)
    loose = [g for part in (dangles, cuts) for g in shapely.get_parts(part)]
    if loose:
        (x, y), gap = _loose_end(segments, shapely.get_coordinates(loose[0]))
        raise CommandError(
            f"layer '{layer}' cannot bound a region: a line ends at ({x:g}, {y:g})"
            + (f"; the next end is {gap:g} away" if gap > 0.0 else "")
        )
    return list(shapely.get_parts(polygons))


def _loose_end(segments: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, float]:
    """An end of a loose line that no other line shares, and how far the nearest other loose end is (0: none)."""
    ends, counts = np.unique(np.round(segments.reshape(-1, 2), 12), axis=0, return_counts=True)
    single = ends[counts == 1]
    if not len(single):
        return line[0], 0.0
    far = np.hypot(single[:, None, 0] - line[None, [0, -1], 0], single[:, None, 1] - line[None, [0, -1], 1])
    at = single[np.unravel_index(int(far.argmin()), far.shape)[0]]
    others = np.hypot(*(single - at).T)
    others = others[others > 0.0]
    return at, float(others.min()) if len(others) else 0.0


def polygon_of(layers: Layers, names: Sequence[str], size: float, holes: Sequence[str] = ()) -> Any:
    """The area inside the curves of some layers without that inside others: a polygon of shapely.

    Arcs become polygons with edges of `size` [m].
    """
    shapely = optional.shapely()
    field = SizeField(size)

    def union(these: Sequence[str]) -> Any:
        found = []
        for name in these:
            rows = [edges_of_curve(c, field) for c in layers[name]]
            found += faces(np.concatenate([*rows, np.empty((0, 2, 2))]), name, size)
        return shapely.union_all(found)

    region = shapely.difference(union(names), union(holes)) if holes else union(names)
    if region.is_empty:
        raise CommandError(f"the holes cover layer '{names[0]}' completely")
    return region

"""Measurements of frames, for holding our models beside published ones.

Everything works on plain arrays of grains: centres `x`, `y` and radii `r` [m], one entry each; displacements `dx`, `dy`
[m] belong to the same grains. Models are pushed from the left: the wall stands left of the bed, *forward* is +x. Mirror
x for anything else.

Surface and taper follow the rule of the public program Quantitative-wedge of Li and Yin, the "automated wedge
quantification" of Li et al. 2021 (Front. Earth Sci. 9:636512): the surface is the highest grain of every column of
cells; the crest is its highest point; the toe is the point of the surface farthest from the straight line between crest
and far end; the slope is the straight line fitted to the surface between them, a fifth left out at either end.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import ndimage
from scipy.signal import find_peaks
from scipy.spatial import Delaunay

from hpcdem.io.frames import list_frames, read_frame

# --- frames ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Grains:
    """The particles of a frame in the order of ids, and its walls (id: ((x1, y1), (x2, y2)))."""

    step: int
    gid: np.ndarray
    x: np.ndarray
    y: np.ndarray
    r: np.ndarray
    color: np.ndarray
    group: np.ndarray
    walls: dict[int, tuple[tuple[float, float], tuple[float, float]]]

    def __len__(self) -> int:
        return len(self.gid)

    def take(self, keep: np.ndarray) -> Grains:
        """The grains chosen by a mask or by rows."""
        return Grains(self.step, *(getattr(self, name)[keep] for name in _COLUMNS), self.walls)


_COLUMNS = ("gid", "x", "y", "r", "color", "group")


def grains(path: Path) -> Grains:
    """The grains of one frame file."""
    frame = read_frame(path, ["particles"])
    p = frame.tables["particles"].columns
    order = np.argsort(p["gid"])
    names = np.array([*frame.group_names, ""], dtype=object)
    group = names[np.clip(p["group"], -1, len(names) - 1)]
    columns = (p["gid"], p["x"], p["y"], p["radius"], p["color"], group)
    walls = {
        int(i): (tuple(a.tolist()), tuple(b.tolist()))
        for i, a, b in zip(frame.walls["id"], frame.walls["p1"], frame.walls["p2"])
    }
    return Grains(frame.step, *(np.asarray(c)[order] for c in columns), walls)


def series(folder: Path, first: int = 0, ini: bool = False) -> list[Grains]:
    """All frames of a folder from a step on; those before the first cycle of a command only if asked for."""
    return [grains(f.path) for f in list_frames(folder) if f.step >= first and (ini or not f.ini)]


def common(a: Grains, b: Grains) -> tuple[Grains, Grains]:
    """The grains that both frames hold, in the same order."""
    _, ia, ib = np.intersect1d(a.gid, b.gid, assume_unique=True, return_indices=True)
    return a.take(ia), b.take(ib)


# --- surface and wedge -----------------------------------------------------------------------------------------


def surface(x: np.ndarray, y: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Surface points from left to right: centre of the highest grain in each column of width `cell`; empty ones left
    out."""
    column = np.floor(x / cell).astype(np.int64)
    order = np.lexsort((y, column))
    last = np.flatnonzero(np.diff(column[order], append=np.iinfo(np.int64).max))
    top = order[last]
    return x[top], y[top]


@dataclass(frozen=True)
class Wedge:
    """Crest and toe [m], surface slope between them [degrees, positive where the surface falls to the right]."""

    crest: tuple[float, float]
    toe: tuple[float, float]
    slope: float


def wedge(xs: np.ndarray, ys: np.ndarray, trim: float = 0.2) -> Wedge:
    """Wedge of a surface by the rule in the head of this file.

    Raises ValueError if the crest is the last point, so that there is no slope to measure.
    """
    crest = int(np.argmax(ys))
    px, py = xs[crest:], ys[crest:]
    if len(px) < 3:
        raise ValueError("no surface in front of the crest")
    ex, ey = px[-1] - px[0], py[-1] - py[0]
    away = np.abs(ex * (py - py[0]) - ey * (px - px[0])) / np.hypot(ex, ey)
    toe = int(np.argmax(away))
    skip = int(toe * trim)
    inside = slice(skip, toe - skip + 1)
    if toe - 2 * skip < 1:
        raise ValueError("fewer than two surface points between crest and toe")
    slope = np.polyfit(px[inside], py[inside], 1)[0]
    return Wedge((float(px[0]), float(py[0])), (float(px[toe]), float(py[toe])), float(np.degrees(np.arctan(-slope))))


def front(xs: np.ndarray, ys: np.ndarray, level: float, rise: float) -> float:
    """The last point from the left where the surface stands more than `rise` above `level` [m]; the first point where
    none does."""
    raised = np.flatnonzero(ys > level + rise)
    return float(xs[raised[-1]] if len(raised) else xs[0])


def on(at: np.ndarray, xs: np.ndarray, ys: np.ndarray) -> np.ndarray:
    """Surface heights at given places; NaN outside."""
    return np.interp(at, xs, ys, left=np.nan, right=np.nan)


def uplift(before: tuple[np.ndarray, np.ndarray], after: tuple[np.ndarray, np.ndarray], at: np.ndarray) -> np.ndarray:
    """Change of surface height at fixed places [m]; NaN outside either surface."""
    return on(at, *after) - on(at, *before)


def thickness(x: np.ndarray, y: np.ndarray, r: np.ndarray, cell: float) -> float:
    """Median over columns of the height from the lowest point of a layer's grains to the highest [m]."""
    low = surface(x, -(y - r), cell)[1]
    high = surface(x, y + r, cell)[1]
    return float(np.median(high + low))


def peaks(xs: np.ndarray, ys: np.ndarray, width: float, prominence: float) -> np.ndarray:
    """Places of the highs of a line after a running mean over `width`, each rising `prominence` above the lows that
    part it from higher ones."""
    at = np.arange(xs[0], xs[-1], width / 10.0)
    smooth = ndimage.uniform_filter1d(np.interp(at, xs, ys), 10, mode="nearest")
    padded = np.concatenate([[smooth.min()], smooth, [smooth.min()]])  # highs at the ends count
    found, _ = find_peaks(padded, prominence=prominence)
    return at[found - 1]


# --- strain and bands of shear ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Strain:
    """Mean displacement gradient of square cells in the places of the earlier frame.

    gradient: (rows, columns, 2, 2), ``gradient[..., i, j] = d u_i / d x_j``, NaN where no grains are; area: (rows,
    columns), of the bed in each cell [m2]; x, y: centres of columns and rows [m].
    """

    x: np.ndarray
    y: np.ndarray
    gradient: np.ndarray
    area: np.ndarray

    @property
    def distortion(self) -> np.ndarray:
        """Signed distortional strain: root of the second invariant of the deviator of the Lagrangian strain, positive
        where the top has moved to the right (forward thrusting), negative to the left."""
        f = self.gradient + np.eye(2)
        e = (np.swapaxes(f, -1, -2) @ f - np.eye(2)) / 2.0
        size = np.hypot((e[..., 0, 0] - e[..., 1, 1]) / 2.0, e[..., 0, 1])
        return np.sign(f[..., 0, 1] - f[..., 1, 0]) * size

    @property
    def rate(self) -> np.ndarray:
        """Signed largest shear strain of the linear theory (angle, not quadratic in large steps), signs as above."""
        h = self.gradient
        size = np.hypot(h[..., 0, 0] - h[..., 1, 1], h[..., 0, 1] + h[..., 1, 0])
        return np.sign(h[..., 0, 1] - h[..., 1, 0]) * size


def strain(x: np.ndarray, y: np.ndarray, dx: np.ndarray, dy: np.ndarray, cell: float, reach: float) -> Strain:
    """Gradient of the displacement, linear in the triangles between neighbouring grains, averaged over square cells.

    Triangles with a side longer than `reach` span the surface or holes and are left out.
    """
    points = np.column_stack([x, y])
    corners = Delaunay(points).simplices
    p = points[corners]
    sides = np.linalg.norm(p - np.roll(p, 1, axis=1), axis=2)
    corners, p = corners[sides.max(axis=1) <= reach], p[sides.max(axis=1) <= reach]
    e1, e2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    double = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    u = np.column_stack([dx, dy])[corners]
    d1, d2 = u[:, 1] - u[:, 0], u[:, 2] - u[:, 0]
    # Gradient times area: (d1 x e2 - d2 x e1) / 2, so flat triangles do no harm.
    times_area = np.empty((len(corners), 2, 2))
    sign = np.sign(double)[:, None]
    times_area[:, :, 0] = (d1 * e2[:, 1:2] - d2 * e1[:, 1:2]) / 2.0 * sign
    times_area[:, :, 1] = (d2 * e1[:, 0:1] - d1 * e2[:, 0:1]) / 2.0 * sign

    centre = p.mean(axis=1)
    origin = np.floor(points.min(axis=0) / cell) * cell
    column, row = np.floor((centre - origin) / cell).astype(np.int64).T
    shape = int(row.max()) + 1, int(column.max()) + 1
    flat = row * shape[1] + column
    count = shape[0] * shape[1]
    area = np.bincount(flat, np.abs(double) / 2.0, count)
    total = [np.bincount(flat, times_area[:, i, j], count) for i in (0, 1) for j in (0, 1)]
    with np.errstate(invalid="ignore", divide="ignore"):
        gradient = np.stack([t / area for t in total], axis=-1)
    at = [origin[k] + (np.arange(shape[1 - k]) + 0.5) * cell for k in (0, 1)]
    return Strain(at[0], at[1], gradient.reshape(*shape, 2, 2), area.reshape(shape))


def shear(
    before: Grains, after: Grains, cell: float, reach: float, low: float, past: float, threshold: float = 0.1
) -> tuple[float, float]:
    """Forward and backward shear strain above a threshold between two frames, integrated over the bed [m2].

    Cells below the height `low` (a detachment) and left of `past` (a wall that drags grains along) are left out.
    """
    a, b = common(before, after)
    field = strain(a.x, a.y, b.x - a.x, b.y - a.y, cell, reach)
    rate = np.nan_to_num(field.rate)
    counted = (field.x > past) & (field.y > low)[:, None] & (np.abs(rate) > threshold)
    amount = (rate * field.area)[counted]
    return float(amount[amount > 0.0].sum()), float(-amount[amount < 0.0].sum())


@dataclass(frozen=True)
class Band:
    """A connected band of shear: centre and length [m]; dip [degrees], positive down to the left as forethrusts dip;
    vergence +1 fore, -1 back by the sense of shear; shear: integral of |strain| over its area [m2]."""

    centre: tuple[float, float]
    length: float
    dip: float
    vergence: int
    shear: float


def bands(
    x: np.ndarray, y: np.ndarray, shear: np.ndarray, threshold: float, shortest: float, low: float = -np.inf
) -> list[Band]:
    """Bands of one sense of shear above a threshold, at least `shortest` long and above the height `low`; from left to
    right.

    x, y: centres of columns and rows of the signed field `shear` (rows, columns). A cell belongs to a band if it
    touches it at a side or a corner.
    """
    cell = float(x[1] - x[0])
    found: list[Band] = []
    high = y[:, None] >= low
    for vergence in (1, -1):
        label, number = ndimage.label((np.nan_to_num(shear) * vergence > threshold) & high, np.ones((3, 3)))
        for k in range(1, number + 1):
            rows, columns = np.nonzero(label == k)
            weight = np.abs(shear[rows, columns])
            points = np.column_stack([x[columns], y[rows]])
            centre = np.average(points, axis=0, weights=weight)
            value, vector = np.linalg.eigh(np.atleast_2d(np.cov((points - centre).T, aweights=weight, ddof=0)))
            along = (points - centre) @ vector[:, np.argmax(value)]
            length = float(np.ptp(along)) + cell
            if length < shortest:
                continue
            direction = vector[:, np.argmax(value)]
            dip = float(np.degrees(np.arctan2(direction[1], direction[0])))
            dip = dip - 180.0 if dip > 90.0 else dip + 180.0 if dip <= -90.0 else dip
            found.append(
                Band((float(centre[0]), float(centre[1])), length, dip, vergence, float(weight.sum()) * cell**2)
            )
    return sorted(found, key=lambda b: b.centre[0])


# --- thrusts as breaks of a marker layer -----------------------------------------------------------------------


def _pieces(x: np.ndarray, width: float, *values: np.ndarray) -> list[np.ndarray]:
    """Means of values over the pieces of `width` of a layer that hold grains, from left to right."""
    piece = np.floor((x - x.min()) / width).astype(np.int64)
    _, inverse, count = np.unique(piece, return_inverse=True, return_counts=True)
    return [np.bincount(inverse, v) / count for v in values]


@dataclass(frozen=True)
class Break:
    """A break of a marker layer: place along the undeformed layer [m]; heave and throw [m], the slip of the left side
    over the right one; vergence +1 where the left side went up (forethrust), -1 where the right one did."""

    at: float
    heave: float
    throw: float

    @property
    def slip(self) -> float:
        return float(np.hypot(self.heave, self.throw))

    @property
    def dip(self) -> float:
        """Dip of the slip [degrees]."""
        return float(np.degrees(np.arctan2(abs(self.throw), self.heave)))

    @property
    def vergence(self) -> int:
        return 1 if self.throw > 0.0 else -1


def breaks(
    x: np.ndarray, dx: np.ndarray, dy: np.ndarray, width: float, least: float, shortening: float = 0.4
) -> list[Break]:
    """Thrusts crossing a marker layer, from left to right.

    x: undeformed places of the layer's grains [m]; dx, dy: their displacements. The layer is cut into pieces of `width`
    with their mean displacements. A thrust is a run of neighbouring pieces (one quiet joint between them is bridged)
    that approach each other by more than `shortening` of their width, with a slip of at least `least` [m] altogether.
    Limbs that only turn shorten by 1 - cos(angle), 0.4 beyond 53 degrees, and are not counted; nor is a vertical fault.
    """
    at, u, v = _pieces(x, width, x, dx, dy)
    converging = (u[:-1] - u[1:]) / np.diff(at) > shortening
    joined = ndimage.binary_closing(np.pad(converging, 2), np.ones(3))[2:-2] if len(converging) else converging
    label, number = ndimage.label(joined)
    found = []
    for run in ndimage.find_objects(label, number):
        # A piece on the edge of the run may hold grains of both sides: compare the ones beyond.
        first, last = max(run[0].start - 1, 0), min(run[0].stop + 1, len(at) - 1)
        candidate = Break(float((at[first] + at[last]) / 2.0), float(u[first] - u[last]), float(v[first] - v[last]))
        if candidate.slip >= least:
            found.append(candidate)
    return found


def advance(x: np.ndarray, dx: np.ndarray, width: float, moved: float) -> float:
    """How far a layer has been moved: undeformed place of its last piece (of `width`, mean of its grains) that went
    forward by more than `moved` [m]."""
    at, u = _pieces(x, width, x, dx)
    on_the_move = at[u > moved]
    return float(on_the_move[-1] + width / 2.0 if len(on_the_move) else x.min())


def heaves(x: np.ndarray, dx: np.ndarray, width: float) -> np.ndarray:
    """Approach of neighbouring pieces (of `width`) of a layer [m], by their mean displacements, from left to right; 0
    where they part."""
    (u,) = _pieces(x, width, dx)
    return np.maximum(u[:-1] - u[1:], 0.0)

"""Faults as bands of strain: places where the distortional strain is above a threshold.

Cells of one sense of shear that touch one another are taken together; faults that branch or meet are then taken apart
into straight pieces, the one with most strain first. Strain is positive where the top has moved to the right, as in
sections (`hpcdem.post.section`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from hpcdem.post.measure import triangles
from hpcdem.post.measure.grains import Grains, common


@dataclass(frozen=True)
class Band:
    """A straight band of shear: centre and length [m]; dip [degrees], positive down to the left as forethrusts dip;
    vergence +1 top to the right, -1 to the left, by the sense of shear; shear: integral of |strain| over its area [m2];
    mean: of |strain|; ends: of the straight line through it; area [m2]."""

    centre: tuple[float, float]
    length: float
    dip: float
    vergence: int
    shear: float
    mean: float
    ends: tuple[tuple[float, float], tuple[float, float]]
    area: float

    @property
    def reverse(self) -> bool:
        """Return whether the upper side moved up: a thrust, not a normal fault."""
        return self.dip * self.vergence > 0.0


def bands(
    x: np.ndarray, y: np.ndarray, shear: np.ndarray, threshold: float, shortest: float,
    low: float | np.ndarray = -np.inf, straight: bool = True,
) -> list[Band]:  # fmt: skip
    """Bands of one sense of shear above a threshold, at least `shortest` long and above the height `low` (a number, or
    one per column); from left to right.

    x, y: centres of columns and rows of the signed field `shear` (rows, columns). Cells that touch at a side or a
    corner are one band; with `straight`, each straight piece of them is.
    """
    cell = float(x[1] - x[0]) if len(x) > 1 else float(y[1] - y[0]) if len(y) > 1 else 0.0
    found: list[Band] = []
    high = y[:, None] >= np.asarray(low)
    for vergence in (1, -1):
        label, _ = ndimage.label((np.nan_to_num(shear) * vergence > threshold) & high, np.ones((3, 3)))
        for k, box in enumerate(ndimage.find_objects(label), 1):
            rows, columns = np.nonzero(label[box] == k)
            rows, columns = rows + box[0].start, columns + box[1].start
            weight = np.abs(shear[rows, columns])
            places = np.stack([columns, rows], axis=1).astype(float)
            capped = np.minimum(weight, STRONG * threshold)
            pieces = _straight(places, capped, shortest / cell if cell else 0.0) if straight else [np.arange(len(rows))]
            for some in pieces:
                band = _band(x[columns[some]], y[rows[some]], weight[some], vergence, cell)
                if band.length >= shortest:
                    found.append(band)
    return sorted(found, key=lambda b: b.centre[0])


STRONG = 3.0
"""Multiple of the threshold above which more strain does not make a band more likely."""
_ANGLES = np.radians(np.arange(0.0, 180.0, 3.0))
_NARROW, _WIDEST, _GAP = 1.5, 6.0, 2.5  # cells: half widths of a band, and the largest gap along it


def _straight(places: np.ndarray, weight: np.ndarray, shortest: float) -> list[np.ndarray]:
    """Rows of the cells of each straight band among connected cells; places (n, 2) and lengths in cells.

    Again and again the strip, 2 _NARROW wide, with most weight in one run, among all directions; it is widened as long
    as half of the cells at its sides exist, and removed with them.
    """
    left = np.arange(len(places))
    found: list[np.ndarray] = []
    while len(left) >= shortest:
        run = max(
            (_best_run(places[left], weight[left], a) for a in _ANGLES), key=lambda r: float(weight[left[r]].sum())
        )
        centre, direction = axis_of(places[left[run]], weight[left[run]])
        offset = places[left] - centre
        along, across = offset @ direction, np.abs(offset @ [-direction[1], direction[0]])
        low, high = along[run].min(), along[run].max()
        if high - low + 1.0 < shortest:
            break
        beside = (along >= low - 1.0) & (along <= high + 1.0)
        half = _NARROW
        while half < _WIDEST and (beside & (across > half) & (across <= half + 1.0)).sum() >= high - low + 1.0:
            half += 1.0
        # What is left at its sides is no band of its own.
        inside = beside & (across <= half + 1.0)
        if high - low + 1.0 >= 3.0 * half:
            found.append(left[inside])
        left = left[~inside]
    return found


def _best_run(places: np.ndarray, weight: np.ndarray, angle: float) -> np.ndarray:
    """Rows of the cells, without larger gaps, of the strip in this direction that has most weight."""
    c, s = np.cos(angle), np.sin(angle)
    along, across = places @ [c, s], places @ [-s, c]
    bins = np.floor((across - across.min()) * 2.0).astype(np.int64)
    wide = int(4.0 * _NARROW)
    sums = np.convolve(np.bincount(bins, weight), np.ones(wide))  # of the bins from k - wide + 1 to k
    last = int(np.argmax(sums))
    strip = np.flatnonzero((bins > last - wide) & (bins <= last))
    strip = strip[np.argsort(along[strip], kind="stable")]
    runs = np.split(strip, np.flatnonzero(np.diff(along[strip]) > _GAP) + 1)
    return max(runs, key=lambda r: float(weight[r].sum()))


def axis_of(points: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centre and direction of the line through points by their weights."""
    centre = np.average(points, axis=0, weights=weight)
    value, vector = np.linalg.eigh(np.atleast_2d(np.cov((points - centre).T, aweights=weight, ddof=0)))
    return centre, vector[:, np.argmax(value)]


def _band(x: np.ndarray, y: np.ndarray, weight: np.ndarray, vergence: int, cell: float) -> Band:
    """The line through cells by their weights."""
    points = np.column_stack([x, y])
    centre, direction = axis_of(points, weight)
    along = (points - centre) @ direction
    dip = float(np.degrees(np.arctan2(direction[1], direction[0])))
    dip = dip - 180.0 if dip > 90.0 else dip + 180.0 if dip <= -90.0 else dip
    ends = [centre + direction * (along.min() - cell / 2.0), centre + direction * (along.max() + cell / 2.0)]
    first, last = sorted((float(a), float(b)) for a, b in ends)
    return Band(
        (float(centre[0]), float(centre[1])), float(np.ptp(along)) + cell, dip, vergence,
        float(weight.sum()) * cell**2, float(weight.mean()), (first, last), len(x) * cell**2,
    )  # fmt: skip


def between(before: Grains, after: Grains, cell: float) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """x, y of the centres of columns and rows and the distortional strain (rows, columns) from one frame to another, in
    the places of the later one, by the grains that both hold; None where there are too few of these."""
    a, b = common(before, after)
    if not len(a):
        return None
    try:
        field = triangles.strain(a.x, a.y, b.x - a.x, b.y - a.y, cell, 4.0 * float(np.max(a.r)), later=True)
    except ValueError:
        return None
    return field.x, field.y, field.distortion

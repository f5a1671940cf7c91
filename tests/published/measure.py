"""The measurements that hold our models beside published ones: those of the package and some more, under one name."""

from functools import partial
from pathlib import Path

import numpy as np
import scipy

from hpcdem.io.frames import list_frames
from hpcdem.post.measure import faults
from hpcdem.post.measure.faults import Band
from hpcdem.post.measure.grains import Grains, common, grains
from hpcdem.post.measure.surface import surface
from hpcdem.post.measure.triangles import Strain, strain
from hpcdem.post.measure.wedge import Wedge, wedge
from tests.published.breaks import Break, advance, breaks, heaves

bands = partial(faults.bands, straight=False)
"""Connected bands as they are, also where faults meet."""

__all__ = [
    "Band", "Break", "Grains", "Strain", "Wedge", "advance", "bands", "breaks", "common", "front", "grains", "heaves",
    "on", "peaks", "series", "shear", "strain", "surface", "thickness", "uplift", "wedge",
]  # fmt: skip


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
    smooth = scipy.ndimage.uniform_filter1d(np.interp(at, xs, ys), 10, mode="nearest")
    padded = np.concatenate([[smooth.min()], smooth, [smooth.min()]])  # highs at the ends count
    found, _ = scipy.signal.find_peaks(padded, prominence=prominence)
    return at[found - 1]


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


def series(folder: Path, first: int = 0, ini: bool = False) -> list[Grains]:
    """All frames of a folder from a step on; those before the first cycle of a command only if asked for, after
    the others of the same step."""
    return [grains(f.path, f.ini) for f in list_frames(folder) if f.step >= first and (ini or not f.ini)]

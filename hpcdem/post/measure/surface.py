"""The surface of a bed: profiles, uplift, front, thickness of layers, highs.

The surface is the highest grain of every column of cells, as in the public program Quantitative-wedge of Li and Yin,
the "automated wedge quantification" of Li et al. 2021 (Front. Earth Sci. 9:636512).
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.signal import find_peaks


def surface(x: np.ndarray, y: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Surface points from left to right: centre of the highest grain in each column of width `cell`; empty ones left
    out. x, y: (n,) [m]."""
    column = np.floor(x / cell).astype(np.int64)
    order = np.lexsort((y, column))
    last = np.flatnonzero(np.diff(column[order], append=np.iinfo(np.int64).max))
    top = order[last]
    return x[top], y[top]


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

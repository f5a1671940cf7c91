"""The surface of a bed.

The surface is the highest grain of every column of cells, as in the public program Quantitative-wedge of Li and Yin,
the "automated wedge quantification" of Li et al. 2021 (Front. Earth Sci. 9:636512).
"""

from __future__ import annotations

import numpy as np


def surface(x: np.ndarray, y: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Return surface points from left to right: centre of the highest grain in each column of width `cell`; empty
    columns are omitted. x, y: (n,) [m].
    """
    column = np.floor(x / cell).astype(np.int64)
    order = np.lexsort((y, column))
    last = np.flatnonzero(np.diff(column[order], append=np.iinfo(np.int64).max))
    top = order[last]
    return x[top], y[top]

"""What screen.py paints, plainly: for every pixel the objects whose shape holds its middle, the last one on top."""

from __future__ import annotations

import numpy as np


def discs(x: np.ndarray, y: np.ndarray, radius: np.ndarray, width: int, height: int) -> np.ndarray:
    """(height, width) the disc that each pixel shows, -1 for none; x, y, radius (n,) in pixels."""
    row, column = np.mgrid[0:height, 0:width] + 0.5
    shown = np.full((height, width), -1)
    for k in range(len(x)):
        shown[(column - x[k]) ** 2 + (row - y[k]) ** 2 <= radius[k] ** 2] = k
    return shown


def triangles(corners: np.ndarray, width: int, height: int) -> np.ndarray:
    """The same of triangles (n, 3, 2) in pixels; -2 where the middle of a pixel lies on an edge."""
    row, column = np.mgrid[0:height, 0:width] + 0.5
    shown = np.full((height, width), -1)
    for k, three in enumerate(corners):
        sides = [
            (b[0] - a[0]) * (row - a[1]) - (b[1] - a[1]) * (column - a[0])
            for a, b in zip(three, np.roll(three, -1, axis=0), strict=True)
        ]
        inside = np.all([s > 0 for s in sides], axis=0) | np.all([s < 0 for s in sides], axis=0)
        on = (np.all([s >= 0 for s in sides], axis=0) | np.all([s <= 0 for s in sides], axis=0)) & ~inside
        shown[inside] = k
        shown[on] = -2
    return shown

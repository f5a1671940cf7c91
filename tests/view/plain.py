"""What post/view/screen.py paints, plainly: each pixel shows the last object whose shape holds its middle."""

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


def nearest(corners: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """The triangle (n, 3, 3) in pixels, z towards the eye, that is nearest at the middle of each pixel, -1 for none,
    and how near; the middle of a pixel is taken as it is in each triangle's own coordinates."""
    row, column = np.mgrid[0:height, 0:width] + 0.5
    shown, near = np.full((height, width), -1), np.full((height, width), -np.inf)
    for k, (a, b, c) in enumerate(corners):
        sides = np.array([b[:2] - a[:2], c[:2] - a[:2]]).T
        if abs(np.linalg.det(sides)) < 1e-12:
            continue
        of_b, of_c = np.linalg.solve(sides, np.stack([column - a[0], row - a[1]]).reshape(2, -1)).reshape(2, height, -1)
        depth = a[2] + of_b * (b[2] - a[2]) + of_c * (c[2] - a[2])
        there = (of_b >= 0.0) & (of_c >= 0.0) & (of_b + of_c <= 1.0) & (depth > near)
        shown[there], near[there] = k, depth[there]
    return shown, near

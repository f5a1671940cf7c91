"""Many small discs as a bitmap: each pixel gets the part of it that the discs cover, at their true places and sizes.

A hundred thousand discs are a tenth of a second, where a plotting library that draws curves one after the other needs
seconds. Where discs overlap their colours mix in equal parts; discs that touch leave no bright seam between them.
"""

from __future__ import annotations

import numpy as np

_ENTRIES = 1 << 20
"""Most (disc, pixel) pairs held at once."""
_SMALL = 0.6
"""Discs of a smaller radius [pixels] are dots: their area goes to the four nearest pixels."""


def discs(
    x: np.ndarray, y: np.ndarray, radius: np.ndarray, shades: np.ndarray, kind: np.ndarray, width: int, height: int,
    line: float = 0.0,
) -> np.ndarray:  # fmt: skip
    """RGBA picture (height, width, 4) of bytes, row 0 at the bottom; alpha is the covered part of the pixel.

    x, y (n,): centres in pixels from the left and from the bottom edge; radius (n,) in pixels; shades (m, 3): colours
    as fractions; kind (n,): the colour of each. line: width of circles [pixels]; 0 fills the discs.
    """
    cover = np.zeros((4, height + 2, width + 2))  # sums of cover times colour, and of cover
    half = 0.5 * line
    seen = (x + radius + half > -1) & (x - radius - half < width + 1)
    seen &= (y + radius + half > -1) & (y - radius - half < height + 1) & (radius > 0.0)
    chosen = np.flatnonzero(seen)
    # By size, since the discs of a batch share one window, then from bottom to top, so that a batch is a band of rows.
    size = np.ceil(2.0 * np.log2(np.maximum(radius[chosen] + half, 0.5))).astype(int)
    order = np.lexsort((y[chosen], size))
    chosen, size = chosen[order], size[order]
    for first, last in _batches(radius[chosen] + half, size, width + height):
        part = chosen[first:last]
        _stamp(cover, x[part], y[part], radius[part], shades[kind[part]], line)
    return _bytes(cover[:, 1:-1, 1:-1])


def _batches(reach: np.ndarray, size: np.ndarray, largest: int) -> list[tuple[int, int]]:
    """Runs of discs of one size class with at most _ENTRIES pixels in their windows together (or one disc)."""
    cuts = np.flatnonzero(np.diff(size, prepend=-(10**6))) if len(size) else np.zeros(0, int)
    runs = []
    for a, b in zip(cuts, [*cuts[1:], len(size)]):
        window = min(2.0 * reach[a:b].max() + 3.0, largest)
        step = max(1, int(_ENTRIES / window**2))
        runs += [(k, min(k + step, b)) for k in range(a, b, step)]
    return runs


def _stamp(
    cover: np.ndarray, x: np.ndarray, y: np.ndarray, radius: np.ndarray, shades: np.ndarray, line: float
) -> None:
    """Add a batch of discs to the sums (4, height + 2, width + 2); what is off the picture goes to its rim."""
    columns, du = _window(x, radius.max() + 0.5 * line, cover.shape[2] - 2)
    rows, dv = _window(y, radius.max() + 0.5 * line, cover.shape[1] - 2)
    alpha = _covered(du[:, None, :], dv[:, :, None], radius.astype(np.float32)[:, None, None], line)
    low, high = int(rows.min()), int(rows.max()) + 1
    pixels = ((rows - low) * cover.shape[2])[:, :, None] + columns[:, None, :]
    band = cover[:, low:high].reshape(4, -1)
    for channel in range(4):
        weights = alpha if channel == 3 else alpha * shades[:, channel, None, None]
        band[channel] += np.bincount(pixels.reshape(-1), weights.reshape(-1), band.shape[1])


def _window(at: np.ndarray, reach: float, length: int) -> tuple[np.ndarray, np.ndarray]:
    """Pixels along one axis that discs may touch (n, k), counted from the rim, and how far their middles are off."""
    if 2.0 * reach + 3.0 < length:
        pixels = np.floor(at - reach - 0.5).astype(np.int64)[:, None] + np.arange(int(2.0 * reach + 3.0))
    else:
        pixels = np.broadcast_to(np.arange(length), (len(at), length))
    return np.clip(pixels, -1, length) + 1, (pixels + 0.5 - at[:, None]).astype(np.float32)


def _covered(du: np.ndarray, dv: np.ndarray, radius: np.ndarray, line: float) -> np.ndarray:
    """The covered part of pixels at (du, dv) from the centre: a straight edge through the pixel, corrected so that the
    area of the whole disc is right on the average over its places."""
    one = np.float32(1.0)
    if line > 0.0:
        distance = np.abs(np.sqrt(du * du + dv * dv) - radius)
        return np.clip(np.float32(0.5 * line + 0.5) - distance, 0.0, min(one, np.float32(line)))
    # The ramp of one pixel about the edge adds pi / 12 to the area of a disc.
    edge = np.sqrt(np.maximum(radius * radius - np.float32(1.0 / 12.0), 0.0)) + np.float32(0.5)
    alpha = np.clip(edge - np.sqrt(du * du + dv * dv), 0.0, one)
    small = radius < _SMALL
    if small.any():
        dot = np.maximum(one - np.abs(du), 0.0) * np.maximum(one - np.abs(dv), 0.0) * np.float32(np.pi) * radius**2
        alpha = np.where(small, dot, alpha)
    return alpha


def _bytes(cover: np.ndarray) -> np.ndarray:
    """Sums (4, height, width) to RGBA bytes (height, width, 4); the colour is the mean of all that cover the pixel."""
    result = np.zeros((*cover.shape[1:], 4), np.uint8)
    full = cover[3] > 1.0 / 512.0
    alpha = cover[3][full]
    for channel in range(3):
        result[full, channel] = np.minimum(cover[channel][full] / alpha, 1.0) * 255.0 + 0.5
    result[full, 3] = np.minimum(alpha, 1.0) * 255.0 + 0.5
    return result

"""The ten colours of the ZDEM manual (chapter 9, the values of its colour file), as fractions of red, green, blue."""

from __future__ import annotations

import numpy as np

RGB = np.array(
    [
        [0.85, 0.85, 0.85],
        [0.00, 1.00, 0.00],
        [1.00, 1.00, 0.00],
        [1.00, 0.00, 0.00],
        [0.90, 0.90, 0.90],
        [0.15, 0.15, 0.15],
        [0.50, 0.50, 0.50],
        [0.00, 0.00, 1.00],
        [0.00, 1.00, 1.00],
        [1.00, 0.00, 1.00],
    ]
)


def numbers(color: np.ndarray) -> np.ndarray:
    """Colour numbers brought into 0..9, so that any file can be drawn."""
    return np.asarray(color).astype(np.int64) % len(RGB)

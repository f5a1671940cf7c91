"""When and how to move strip borders. Balancing may change speed, never the answer."""

from __future__ import annotations

import numpy as np

TOLERANCE = 1.1
"""Largest busy time over the mean that is left alone."""
PATIENCE = 500
"""Steps of measurement before borders may move again."""


def imbalance(busy: np.ndarray) -> float:
    """Largest over mean busy time of the ranks [s]; 1 is perfect."""
    mean = float(busy.mean())
    return float(busy.max()) / mean if mean > 0.0 else 1.0


def cost_per_particle(busy: np.ndarray, owned: np.ndarray) -> np.ndarray:
    """Relative cost of a particle on each rank, from measured busy time [s] and particles owned.

    Kept within a factor of two of the mean, so that one noisy measurement cannot throw the borders about.
    """
    rate = np.where(owned > 0, busy / np.maximum(owned, 1), 0.0)
    mean = float(busy.sum()) / max(float(owned.sum()), 1)
    return np.clip(rate / mean, 0.5, 2.0) if mean > 0.0 else np.ones(len(busy))

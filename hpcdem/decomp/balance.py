"""Decide when and how to move strip boundaries. Balancing may change speed, never results."""

from __future__ import annotations

TOLERANCE = 1.1
"""Largest ratio of the longest to the mean busy time that needs no rebalancing."""
PATIENCE = 500
"""Steps measured before boundaries may move again."""


def imbalance(largest: float, mean: float) -> float:
    """Largest over mean busy time of the ranks [s]; 1 is perfect."""
    return largest / mean if mean > 0.0 else 1.0


def cost_per_particle(busy: float, owned: float, all_busy: float, all_owned: float) -> float:
    """Relative cost of a particle of a rank, from measured busy time [s] and particles owned, of this rank and of all.

    Kept within a factor of two of the mean, so that one noisy measurement cannot throw the borders about.
    """
    rate = busy / max(owned, 1.0) if owned > 0.0 else 0.0
    mean = all_busy / max(all_owned, 1.0)
    return min(max(rate / mean, 0.5), 2.0) if mean > 0.0 else 1.0

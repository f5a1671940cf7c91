"""What the page may ask for. The command line alone makes larger specimens."""

from __future__ import annotations

LIMITS: dict[str, tuple[float, float]] = {
    "number": (10, 20_000),
    "slenderness": (0.2, 5.0),
    "void_ratio": (0.1, 3.0),
    "l_over_d": (1.0, 4.0),
    "deviation": (0.0, 54.5),
    "roundness": (0.0, 1.0),
    "seed": (0, 2**53 - 1),  # whole numbers that a browser can hold
}
"""Least and largest value of each field with a slider or a number."""
MOST_ROWS = 60
"""Most rows of the table."""

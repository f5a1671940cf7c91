"""Mass rules of `SET disk` (ZDEM manual ch. 7; Li 2018, 2021 for hex)."""

from __future__ import annotations

import math

import numpy as np

SPHERES = {"on": False, "hex": False, "off": True, "0": True}
"""Whether a mass rule treats discs as spheres (area of bonds, moment of inertia)."""


def shape(disk: str) -> tuple[float, bool, float]:
    """Return the shape that a rule defines: (volume over r^2 or r^3, whether it is r^3, moment of inertia over m r^2).

    4/3 pi r^3 [m^3] (off, 0), pi r^2 [m^2 x 1 m] (on), 2 sqrt(3) r^2 (hex: the cell of a close-packed lattice); 2/5 for
    spheres, 1/2 for disks.
    """
    if SPHERES[disk]:
        return 4.0 / 3.0 * math.pi, True, 0.4
    return (2.0 * math.sqrt(3.0) if disk == "hex" else math.pi), False, 0.5


def volume(radius: np.ndarray, disk: str) -> np.ndarray:
    """Volume used for the mass [m^3, m^2 x 1 m]."""
    factor, cubed, _ = shape(disk)
    area = factor * radius * radius
    return area * radius if cubed else area


def inertia(mass: np.ndarray, radius: np.ndarray, disk: str) -> np.ndarray:
    """Moment of inertia [kg m^2]."""
    return shape(disk)[2] * mass * radius * radius

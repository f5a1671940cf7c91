"""Mass rules of `SET disk` (ZDEM manual ch. 7; Li 2018, 2021 for hex)."""

from __future__ import annotations

import math

import numpy as np

SPHERES = {"on": False, "hex": False, "off": True, "0": True}
"""Which rules make spheres (area of bonds, moment of inertia)."""


def volume(radius: np.ndarray, disk: str) -> np.ndarray:
    """Volume used for the mass: pi r^2 [m^2 x 1 m] (on), 4/3 pi r^3 [m^3] (off, 0), 2 sqrt(3) r^2 (hex: the cell of a
    close-packed lattice)."""
    if SPHERES[disk]:
        return 4.0 / 3.0 * math.pi * radius**3
    return (2.0 * math.sqrt(3.0) if disk == "hex" else math.pi) * radius**2


def inertia(mass: np.ndarray, radius: np.ndarray, disk: str) -> np.ndarray:
    """Moment of inertia [kg m^2]: 2/5 m r^2 for spheres, 1/2 m r^2 for disks."""
    return (0.4 if SPHERES[disk] else 0.5) * mass * radius**2

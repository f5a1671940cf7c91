"""Limit equilibrium of a wedge between two joints without cohesion, by angles as they are read off a stereographic net
(Hoek & Bray 1981, Rock Slope Engineering, chapter 8; Goodman 1989, 8.5 by vectors).

The wedge slides along the line in which the joints A and B meet. Its weight W has the part W sin i along the line,
which plunges by i, and W cos i across it; the latter is carried by both joints. In the plane across the line the
joints lean: their normals, seen along the line, make the angles a and b with the direction that is pressed, on either
side, and balance of forces across gives N_A = W cos i sin b / sin(a + b), N_B = W cos i sin a / sin(a + b). So

    F = (N_A tan(phi_A) + N_B tan(phi_B)) / (W sin i).
"""

from __future__ import annotations

import numpy as np


def pole(dip: float, towards: float) -> np.ndarray:
    """Upward normal of a plane [degrees, dip direction clockwise from y]."""
    dip, towards = np.radians([dip, towards])
    return np.array([np.sin(dip) * np.sin(towards), np.sin(dip) * np.cos(towards), np.cos(dip)])


def line(a: tuple[float, float], b: tuple[float, float]) -> np.ndarray:
    """Unit vector along both planes (dip, direction), downwards."""
    way = np.cross(pole(*a), pole(*b))
    return way * -np.sign(way[2]) / np.linalg.norm(way)


def factors(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
    """A and B of F = A tan(phi_A) + B tan(phi_B), as the charts of Hoek & Bray give them."""
    way = line(a, b)
    plunge = np.arcsin(-way[2])
    up = np.array([0.0, 0.0, 1.0]) - way * way[2]
    up /= np.linalg.norm(up)
    angles = []
    for plane in (a, b):
        angles.append(np.arccos(pole(*plane) @ up))
    both = np.sin(sum(angles)) * np.tan(plunge)
    return float(np.sin(angles[1]) / both), float(np.sin(angles[0]) / both)


def factor(a: tuple[float, float], b: tuple[float, float], friction_a: float, friction_b: float) -> float:
    """Of safety; angles [degrees]."""
    one, other = factors(a, b)
    return one * float(np.tan(np.radians(friction_a))) + other * float(np.tan(np.radians(friction_b)))

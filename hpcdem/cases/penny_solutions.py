"""Closed forms of a penny-shaped hydraulic fracture that is driven from its middle at a constant rate, and the mesh of
a sector of the rock around it.

All in SI units. young: E' = E / (1 - nu^2) [Pa]; rate: Q [m3/s]; viscosity: of the fluid, dynamic [Pa s]; energy: of
fracture G [N/m]; time [s]. K' = 4 sqrt(2 / pi) K_Ic, mu' = 12 mu. A `Fracture` has the radius as its length, and the
net pressure at half of it, as that in the middle has no bound where the fluid is viscous.

Sources: Sneddon 1946; Savitski & Detournay 2002, International Journal of Solids and Structures 39, 6311.
"""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np

from hpcdem.cases.kgd_solutions import Fracture, toughness

A1, B, OMEGA = 0.3581, 0.09269, 2.479
"""Constants of the pressure in the first-order solution without toughness (Savitski & Detournay, 81)."""


def number(young: float, energy: float, viscosity: float, rate: float, time: float) -> float:
    """K' (t^2 / (mu'^5 Q^3 E'^13))^(1/18): from about 3.5 on toughness alone decides, below 1 viscosity."""
    k = 4.0 * math.sqrt(2.0 / math.pi) * toughness(young, energy)
    return float(k * (time**2 / ((12.0 * viscosity) ** 5 * rate**3 * young**13)) ** (1.0 / 18.0))


def tough(young: float, energy: float, rate: float, time: float) -> Fracture:
    """A fluid without viscosity: p = K_Ic sqrt(pi / R) / 2 everywhere in an ellipsoid of the volume Q t."""
    k = toughness(young, energy)
    radius = (3.0 * young * rate * time / (8.0 * math.sqrt(math.pi) * k)) ** 0.4
    pressure = 0.5 * k * math.sqrt(math.pi / radius)
    return Fracture(radius, 8.0 * pressure * radius / (math.pi * young), pressure)


def viscous(young: float, viscosity: float, rate: float, time: float) -> Fracture:
    """Rock without toughness: R = 0.6944 (Q^3 E' t^4 / mu')^(1/9), w_0 = 1.1901 (mu'^2 Q^3 t / E'^2)^(1/9)."""
    m = 12.0 * viscosity
    radius = 0.6944 * (rate**3 * young * time**4 / m) ** (1.0 / 9.0)
    opening = 1.1901 * (m**2 * rate**3 * time / young**2) ** (1.0 / 9.0)
    at = A1 * (OMEGA - 2.0 / (3.0 * 0.5 ** (1.0 / 3.0))) - B * (math.log(0.25) + 1.0)
    return Fracture(radius, opening, at * young * (m / (young * time)) ** (1.0 / 3.0))


def write_sector(file: str, size: float, reach: float, far: float, turn: float, parts: int, grow: float) -> None:
    """A mesh file of a sector of `turn` degrees around the z axis, `far` [m] wide, and as high above and below z = 0:
    circles and layers `size` apart up to `reach`, farther away each `grow` times as far as the one before."""
    import meshio

    from hpcdem.pre.mesh import structured_space  # with kernels, which must not be loaded before those of the run

    fine = np.arange(round(reach / size) + 1) * size
    radii = np.concatenate([fine, fine[-1] + _graded(size, far - fine[-1], grow)])
    up = _graded(size, far, grow)
    heights = np.concatenate([-up[::-1], [0.0], up])
    mesh = structured_space.sector(radii, parts, math.radians(turn), heights)
    own = Path(file).with_suffix(f".{os.getpid()}{Path(file).suffix}")  # all ranks write the same
    meshio.Mesh(mesh.points, [("tetra", mesh.cells)]).write(own)
    os.replace(own, file)


def _graded(first: float, end: float, grow: float) -> np.ndarray:
    """Steps that grow from about `first` on, summed up to `end`."""
    count = max(1, round(math.log(1.0 + end * (grow - 1.0) / first) / math.log(grow)))
    distance = np.cumsum(grow ** np.arange(count))
    return np.asarray(distance * end / distance[-1])

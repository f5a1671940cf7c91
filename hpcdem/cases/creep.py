"""A creep test: a specimen under constant load, compared with its closed form."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import Case, quantity

MOST = 1e6
"""Largest number of elements; more are probably a mistake."""


@dataclass(frozen=True)
class CreepTest:
    """Result of the case.

    at_once, strain: shortening over height immediately after loading, and at the end; exact: closed form at the end;
    error: largest deviation from the closed form, over `exact`; steps: number of creep steps; curve: (time [s],
    shortening over height) pairs.
    """

    at_once: float
    strain: float
    exact: float
    error: float
    steps: int
    curve: list[tuple[float, float]] = field(repr=False)


class Creep(Case):
    """A specimen of Burgers rock under a constant load, in plane strain, with frictionless ends."""

    name: ClassVar[str] = "creep"
    title: ClassVar[str] = "Creep of a rock specimen under constant load"
    result: ClassVar[type] = CreepTest

    width: float = quantity(0.05, "m", "width of the specimen", gt=0)
    height: float = quantity(0.1, "m", "height of the specimen", gt=0)
    size: float = quantity(0.0125, "m", "edges of the cells, of four triangles each", gt=0)
    density: float = quantity(2200.0, "kg/m3", "density", gt=0)
    young: float = quantity(25e9, "Pa", "Young's modulus", gt=0)
    poisson: float = quantity(0.25, "1", "Poisson's ratio", ge=0, lt=0.5)
    maxwell_viscosity: float = quantity(1e16, "Pa s", "viscosity of the Maxwell unit", gt=0)
    kelvin_shear: float = quantity(5e9, "Pa", "shear modulus of the Kelvin unit", gt=0)
    kelvin_viscosity: float = quantity(1e14, "Pa s", "viscosity of the Kelvin unit", gt=0)
    pressure: float = quantity(10e6, "Pa", "on the ends", gt=0)
    time: float = quantity(1e5, "s", "duration of the load", gt=0)
    change: float = quantity(0.05, "1", "creep steps follow this change of stress, over the largest", gt=0, lt=1)

    @model_validator(mode="after")
    def _fits(self) -> Creep:
        least = 0.5 * min(self.width, self.height)
        if self.size > least:
            raise ValueError(f"size is {self.size:g}, expected at most half of width and height, {least:g} m")
        number = 4.0 * self.width * self.height / self.size**2
        if number > MOST:
            raise ValueError(f"size is {self.size:g}, which makes {number:.2g} elements: expected at most {MOST:.0e}")
        return self

    def model(self) -> str:
        return SPECIMEN

    def loading(self) -> str:
        return LOADING


SPECIMEN = """
pcdc model new
pcdc mesh structured (0,0) ([width],[height]) cells [round(width/size)] [round(height/size)] diagonal both \\
    group 'rock' set 'body'
pcdc element c-model mech-burgers property density [density] young [young] poisson-r [poisson] \\
    maxwell-viscosity [maxwell_viscosity] kelvin-shear [kelvin_shear] kelvin-viscosity [kelvin_viscosity]
pcdc model option dynamic off
pcdc model option collision off
pcdc node boundary mech-vel-b-c velocity-y 0 range y 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
pcdc element-face boundary m-s-b-c stress-yy [-pressure] range y [height] [height]
"""
LOADING = """
import numpy as np

# The load is put on: elastic.
pcdc model solve elastic
pcdc node group 'top' set 'ends' range y [height] [height]
at_once = float(-pcdc.values('node', 'displacement-y', group='top', set='ends').mean() / height)

# It stays: creep steps in balance, short while much changes.
pcdc history create 'displacement' node value displacement-y mean range group 'top' set 'ends'
pcdc output vtk 'creep' every 20
pcdc model creep on dt [1e-3*time] change [change] greatest [0.05*time]
pcdc model solve elastic time [time]
pcdc output vtk 'creep'
moved = pcdc.history('displacement')
curve = [(0.0, at_once), *zip(moved[:, 1].tolist(), (-moved[:, 2] / height).tolist())]
steps = len(curve) - 1

# The closed form. Elastic: p (1 - nu^2) / E = p (1 / (4 G) + 3 / (4 (3 K + G))). The shear compliance of Burgers,
# J = 1 / G + t / eta_M + (1 - exp(-G_K t / eta_K)) / G_K, is n(s) / d(s) in the Laplace domain (times s), so that
# 1 / (3 K + G) becomes n / (d + 3 K n): a sum of exponentials by its two roots.
bulk, shear = young / (3 * (1 - 2 * poisson)), young / (2 * (1 + poisson))
s, unit = np.poly1d([1.0, 0.0]), np.poly1d([kelvin_viscosity, kelvin_shear])
n = maxwell_viscosity * s * unit + shear * unit + shear * maxwell_viscosity * s
d = shear * maxwell_viscosity * s * unit
both = d + 3 * bulk * n
def closed_form(t):
    found = n(0.0) / both(0.0)
    for root in both.roots.real:
        found += n(root) / (root * both.deriv()(root)) * math.exp(root * t)
    kelvin = (1 - math.exp(-kelvin_shear * t / kelvin_viscosity)) / kelvin_shear
    return float(pressure * (0.25 * (1 / shear + t / maxwell_viscosity + kelvin) + 0.75 * found))

exact = closed_form(time)
strain = curve[-1][1]
error = max(abs(value - closed_form(t)) for t, value in curve) / exact

print('shortening %.5g %% at once, %.5g %% at the end; closed form %.5g %%, largest difference %.2g %% of it' % (
    100 * at_once, 100 * strain, 100 * exact, 100 * error))
points = [(t, 100 * value) for t, value in curve]
line = [(t, 100 * closed_form(t)) for t in np.linspace(0.0, time, 200).tolist()]
pcdc chart create 'creep' x-label 'time (s)' y-label 'shortening (%)'
pcdc chart add 'creep' values [line] label 'closed form'
pcdc chart add 'creep' values [points] label 'specimen' style points
pcdc chart export 'creep' 'creep.png'
"""

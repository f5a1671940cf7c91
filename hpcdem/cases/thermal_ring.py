"""A ring that is hotter inside than outside, compared with its closed form."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import Case, quantity, refuse_thin_ring


@dataclass(frozen=True)
class Stresses:
    """error: largest difference of the temperature of a node from the closed form, over that between the circles;
    radial, tangential: the same of mean stresses over rings, over the largest stress of the closed form; inside,
    outside [Pa]: tangential stress of the closed form at both circles; profile: (radius [m], temperature, radial and
    tangential stress [Pa]) of the rings; account: closing error of the heat budget."""

    error: float
    radial: float
    tangential: float
    inside: float
    outside: float
    profile: list[tuple[float, float, float, float]] = field(repr=False)
    account: float


class Ring(Case):
    """Parameters of a ring, of which the rock expands."""

    inner: float = quantity(0.1, "m", "radius of the hole", gt=0)
    outer: float = quantity(0.5, "m", "radius of the ring", gt=0)
    size: float = quantity(0.02, "m", "edges of the elements", gt=0)
    density: float = quantity(2500.0, "kg/m3", "density", gt=0)
    young: float = quantity(50e9, "Pa", "Young's modulus", gt=0)
    poisson: float = quantity(0.25, "1", "Poisson's ratio", ge=0, lt=0.5)
    conductivity: float = quantity(3.0, "W/(m K)", "thermal conductivity; the steady state does not depend on it", gt=0)
    capacity: float = quantity(1000.0, "J/(kg K)", "specific heat; the steady state does not depend on it", gt=0)
    expansion: float = quantity(1e-5, "1/K", "linear thermal expansion", gt=0)

    @model_validator(mode="after")
    def _fits(self) -> Ring:
        refuse_thin_ring(self.inner, self.outer, self.size)
        return self


class ThermalRing(Ring):
    """A ring with a temperature on each circle, in its steady state and in equilibrium."""

    name: ClassVar[str] = "thermal-ring"
    title: ClassVar[str] = "Thermal stress in a ring"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Stresses

    inner_temperature: float = quantity(100.0, "K", "temperature of the hole, on any scale of degrees")
    outer_temperature: float = quantity(0.0, "K", "temperature of the outer circle")

    @model_validator(mode="after")
    def _differs(self) -> ThermalRing:
        if self.inner_temperature == self.outer_temperature:
            raise ValueError("inner_temperature and outer_temperature are equal, so no heat flows")
        return self

    def model(self) -> str:
        return MESH.replace("MORE", " refine-layer 'hole' size [0.5*size] distance [2*inner]") + ROCK + HELD

    def loading(self) -> str:
        return CLOSED_FORM + SOLVED


MESH = """
pcdc model new
pcdc geometry create circle (0,0) [outer] as-layer 'outer'
pcdc geometry create circle (0,0) [inner] as-layer 'hole'
pcdc mesh create from-layer 'outer' size [size] hole 'hole' group 'rock' \\
   MORE
"""
"""MORE: further words of the mesh."""
ROCK = """
pcdc element c-model mech-iso-e property density [density] young [young] poisson-r [poisson]
pcdc element c-model therm-iso-h property conductivity [conductivity] capacity [capacity] \\
    expansion-coeficient [expansion]
pcdc model option dynamic off collision off
"""
HELD = """
pcdc node boundary therm-s-b-c temperature [inner_temperature] range geometry 'hole'
pcdc node boundary therm-s-b-c temperature [outer_temperature] range geometry 'outer'

# Three points of the outer circle are held along it: the ring can expand.
import numpy as np
nodes = np.asarray(pcdc.numbers('node'))
at = np.array([pcdc.values('node', 'position-x'), pcdc.values('node', 'position-y')])
east, west, north = (int(nodes[np.argmin(np.hypot(at[0] - x, at[1] - y))])
                     for x, y in ((outer, 0.0), (-outer, 0.0), (0.0, outer)))
pcdc node boundary mech-vel-b-c velocity-y 0 range id [east]
pcdc node boundary mech-vel-b-c velocity-y 0 range id [west]
pcdc node boundary mech-vel-b-c velocity-x 0 range id [north]
"""
CLOSED_FORM = """
# T = T_o + (T_i - T_o) ln(r_o/r)/ln(r_o/r_i), stresses in plane strain (Timoshenko & Goodier 1970, 151).
warmer = inner_temperature - outer_temperature
log = math.log(outer / inner)
unit = young * expansion * warmer / (2 * (1 - poisson) * log)
def closed_form(r):
    far, part = np.log(outer / r), inner**2 / (outer**2 - inner**2) * log
    return (outer_temperature + warmer * far / log,
            unit * (-far - part * (1 - outer**2 / r**2)), unit * (1 - far - part * (1 + outer**2 / r**2)))
inside, outside = float(closed_form(inner)[2]), float(closed_form(outer)[2])
"""
SOLVED = """
pcdc model solve thermal steady
found, radius = np.asarray(pcdc.values('node', 'temperature')), np.hypot(at[0], at[1])
error = float(np.abs(found - closed_form(radius)[0]).max() / abs(warmer))
account = pcdc.heat['relative']

# Stress along and across the radius, means over rings of elements.
x, y = (np.asarray(pcdc.values('element', name)) for name in ('element-position-x', 'element-position-y'))
xx, yy, xy = (np.asarray(pcdc.values('element', 'stress-' + name)) for name in ('xx', 'yy', 'xy'))
area, mean = np.asarray(pcdc.values('element', 'area')), np.asarray(pcdc.values('element', 'mean-temperature'))
r = np.hypot(x, y)
c, s = x / r, y / r
along, across = c*c*xx + s*s*yy + 2*c*s*xy, s*s*xx + c*c*yy - 2*c*s*xy
_, along_there, across_there = closed_form(r)
largest = max(abs(inside), abs(outside))
profile, radial, tangential = [], 0.0, 0.0
for k in range(20):
    ring = (r >= inner + (outer - inner) * k / 20) & (r < inner + (outer - inner) * (k + 1) / 20)
    if ring.any():
        part = area[ring] / area[ring].sum()
        profile.append(tuple(float(part @ values[ring]) for values in (r, mean, along, across)))
        radial = max(radial, float(abs(part @ (along - along_there)[ring])) / largest)
        tangential = max(tangential, float(abs(part @ (across - across_there)[ring])) / largest)
print('temperature: largest difference from the closed form %.3g %% of that between the circles' % (100*error))
print('stress, means over rings: radial %.3g %%, tangential %.3g %% of the largest, %.4g MPa'
      % (100*radial, 100*tangential, 1e-6*largest))
line = [inner + (outer - inner) * k / 100 for k in range(101)]
there = np.array([closed_form(np.float64(one)) for one in line])
pcdc output vtk 'thermal-ring'
pcdc chart create 'thermal-ring' x-label 'radius (m)' y-label 'stress (MPa)'
pcdc chart add 'thermal-ring' values [[(a, 1e-6*b) for a, b in zip(line, there[:, 1])]] label 'radial, closed form'
pcdc chart add 'thermal-ring' values [[(a, 1e-6*b) for a, b in zip(line, there[:, 2])]] label 'tangential, closed form'
pcdc chart add 'thermal-ring' values [[(a, 1e-6*b) for a, _, b, _ in profile]] label 'radial' style points
pcdc chart add 'thermal-ring' values [[(a, 1e-6*b) for a, _, _, b in profile]] label 'tangential' style points
pcdc chart export 'thermal-ring' 'thermal-ring.png' temperature
"""

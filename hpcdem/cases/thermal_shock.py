"""A slab whose surface is chilled at once: cracks that leave each other behind as the cold goes deeper."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import quantity
from hpcdem.cases.rock import PROPERTIES, WAVES, Rock

LEVELS = 20
"""Depths at which cracks are counted, over the depth of the slab."""


@dataclass(frozen=True)
class Shock:
    """griffith [m]: gf1 over the energy of thermal stress that a free surface relieves; curve: (thermal length [m],
    broken joints, energy that joints took over that of thermal stress in the slab without cracks) at ten times; counts:
    (thermal length [m], depth [m], cracks that cross it) at these times; deepest [m]: crack at the end; energy_error:
    of the energy budget, part of its largest flow."""

    griffith: float
    curve: list[tuple[float, float, float]] = field(repr=False)
    counts: list[tuple[float, float, float]] = field(repr=False)
    deepest: float
    energy_error: float


class ThermalShock(Rock):
    """A slab between frictionless walls; its surface is cooled at once, and the cold front moves down."""

    name: ClassVar[str] = "thermal-shock"
    title: ClassVar[str] = "Thermal shock of a slab"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Shock

    tensile_strength: float = quantity(8e6, "Pa", "tensile strength of the joints", gt=0)
    cohesion: float = quantity(40e6, "Pa", "cohesion of the joints", gt=0)
    size: float = quantity(0.003, "m", "edges of the elements", gt=0)
    width: float = quantity(0.24, "m", "width of the slab", gt=0)
    depth: float = quantity(0.12, "m", "depth of the slab", gt=0)
    drop: float = quantity(60.0, "K", "cooling of the surface", gt=0)
    expansion: float = quantity(1e-5, "1/K", "linear thermal expansion", gt=0)
    conductivity: float = quantity(
        3.0, "W/(m K)", "thermal conductivity; the specific heat follows from transits", gt=0
    )
    front: float = quantity(0.08, "m", "thermal length 2 (kappa t)^0.5 at the end", gt=0)
    transits: float = quantity(12.0, "1", "wave transits of the depth until then", ge=5)
    scatter: float = quantity(10.0, "1", "shape of Weibull's distribution of the strength of joints", gt=1)
    seed: int = quantity(1, "1", "seed of the strength field", ge=0)

    @model_validator(mode="after")
    def _fits(self) -> ThermalShock:
        if self.size > min(self.width, self.depth) / 10:
            most = min(self.width, self.depth) / 10
            raise ValueError(f"size is {self.size:g}, expected at most a tenth of width and depth, {most:g} m")
        if self.front > self.depth:
            raise ValueError(f"front is {self.front:g}, expected at most depth, {self.depth:g} m")
        stress = self.young * self.expansion * self.drop / (1.0 - self.poisson)
        if stress <= self.tensile_strength:
            raise ValueError(
                f"thermal stress is {stress:g} Pa, expected more than tensile_strength, {self.tensile_strength:g} Pa"
            )
        self.not_too_many(self.width * self.depth)
        return self

    def model(self) -> str:
        return SLAB + PROPERTIES + HEATED

    def loading(self) -> str:
        return COOLED


SLAB = """
import numpy as np
pcdc model new
pcdc geometry create rectangle (0,[-depth]) ([width],0) as-layer 'outline'
pcdc mesh create from-layer 'outline' size [size] irregular group 'rock' set 'body'
"""
HEATED = (
    WAVES
    + """
# The cold needs as long to pass the slab as waves need to pass it `transits` times.
duration = transits * depth / speed_of_waves
diffusivity = front**2 / (4 * duration)
capacity = conductivity / (density * diffusivity)
pcdc element c-model therm-iso-h property conductivity [conductivity] capacity [capacity] \\
    expansion-coeficient [expansion]

# In the mean the joints have their strength.
pcdc field create 'strength' weibull [tensile_strength / math.gamma(1 + 1 / scatter)] [scatter] seed [int(seed)]
pcdc face-joint property tensile-strength field 'strength'
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 range x [width] [width]
pcdc node boundary mech-vel-b-c velocity-y 0 range y [-depth] [-depth]
pcdc node boundary therm-s-b-c temperature [-drop] range y 0 0
"""
)
COOLED = f"""
# Thermal stress -E alpha T / (1 - nu) along the surface; relieved in plane strain it gives sigma^2 (1 - nu^2) / (2 E),
# and the integral of erfc(x / b)^2 over the depth is b (2 - 2^0.5) / pi^0.5.
shock = young * expansion * drop / (1 - poisson)
density_of_energy = shock**2 * (1 - poisson**2) / (2 * young)
griffith = 0.5 * gf1 / density_of_energy
pcdc model option energy on
pcdc model step 1
every = max(1, int(0.1 * size**2 / diffusivity / pcdc.time))
pcdc model sub-step mechanical [every]
pcdc output vtk 'thermal-shock'
curve, counts, deepest = [], [], 0.0
for part in range(1, 11):
    pcdc model solve time [(part / 10)**2 * duration - pcdc.time]
    pcdc output vtk 'thermal-shock'
    b = front * part / 10
    x, y, state = (np.asarray(pcdc.values('joint', name)) for name in ('joint-position-x', 'joint-position-y', 'state'))
    x, y = x[state == 3], y[state == 3]
    took = pcdc.energies['joints_lost'] / (density_of_energy * b * (2 - math.sqrt(2)) / math.sqrt(math.pi) * width)
    curve.append((b, float(len(x)), float(took)))
    deepest = float(-y.min()) if len(y) else 0.0
    for k in range(1, {LEVELS}):
        at = np.sort(x[np.abs(y + depth * k / {LEVELS}) < 0.75 * size])
        count = 1 + int((np.diff(at) > 3 * size).sum()) if len(at) else 0
        counts.append((b, depth * k / {LEVELS}, float(count)))
energy_error = pcdc.energies['relative']
print('Griffith length %.4g m; %d joints are broken, the deepest crack is %.4g m deep; they took %.3g of the energy'
      % (griffith, curve[-1][1], deepest, curve[-1][2]))
pcdc chart create 'thermal-shock' x-label 'depth (m)' y-label 'spacing of cracks (m)'
for part in (4, 7, 10):
    b = front * part / 10
    points = [(d, width / n) for at, d, n in counts if abs(at - b) < 1e-9 * front and n]
    if points:
        pcdc chart add 'thermal-shock' values [points] label ['thermal length %.3g m' % b] style points
pcdc chart export 'thermal-shock' 'thermal-shock.png' temperature
"""

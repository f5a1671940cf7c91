"""Slurry that is pumped through a slot: the bed that its proppant makes, beside a test in the laboratory."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import Case, quantity


@dataclass(frozen=True)
class Bed:
    """Result of the case.

    bed: (time [s], fraction of the slot filled by the bed, its largest height [m], fraction of the slot above it with
    slurry at least as dense as the inflow); beside: (time [s], bed in the simulation of Huang et al. 2021); difference:
    largest deviation between both, fraction of the slot, NaN before the first of these times; measured: (time [s],
    fraction of the slot with proppant above the bed, Chun et al. 2020); settled: fraction of the proppant in the bed at
    the end; fed: fraction of the slot that all proppant would fill as bed; speed: settling speed of a single grain by
    drag and weight [m/s]; lost: closing error of the proppant budget, relative.
    """

    bed: list[tuple[float, float, float, float]] = field(repr=False)
    beside: list[tuple[float, float]] = field(repr=False)
    difference: float
    measured: list[tuple[float, float]] = field(repr=False)
    settled: float
    fed: float
    speed: float
    lost: float


class ProppantBed(Case):
    """The slot of Chun et al. (2020), a flat vertical fracture: slurry enters at three inlets on the left and leaves on
    the right; sand of 0.45 mm settles to a bed in between.
    """

    name: ClassVar[str] = "proppant-bed"
    title: ClassVar[str] = "Proppant bed in a slot"
    result: ClassVar[type] = Bed

    length: float = quantity(1.2192, "m", "length of the slot, 4 ft", gt=0)
    height: float = quantity(0.3048, "m", "height of the slot, 1 ft", gt=0)
    size: float = quantity(0.0254, "m", "length of the rectangles of two triangles that it is divided into", gt=0)
    layer: float = quantity(7.62e-3, "m", "their height", gt=0)
    aperture: float = quantity(7.62e-3, "m", "aperture of the slot, 0.3 in", gt=0)
    rate: float = quantity(3.785e-4, "m3/s", "injection rate of slurry, 6 gal/min", gt=0)
    concentration: float = quantity(0.07, "1", "volume of grains over that of the slurry", gt=0)
    limit: float = quantity(0.62, "1", "volume fraction of grains in a pack", gt=0, le=0.74)
    grain_size: float = quantity(0.45e-3, "m", "diameter of the grains, 30/50 mesh", gt=0)
    grain_density: float = quantity(2550.0, "kg/m3", "density of the grains", gt=0)
    viscosity: float = quantity(1e-3, "Pa s", "dynamic viscosity of the water", gt=0)
    stokes: bool = quantity(False, "", "grains settle by Stokes' law")
    turbulence: bool = quantity(True, "", "fast flow is turbulent, after Blasius")
    time: float = quantity(30.0, "s", "duration of pumping", gt=0)
    steps: int = quantity(1200, "1", "steps of flow in this time", ge=10)

    @model_validator(mode="after")
    def _fits(self) -> ProppantBed:
        if self.layer > 0.0626 * self.height:
            raise ValueError(f"layer is {self.layer:g}, expected at most a sixteenth of height, {self.height / 16:g} m")
        if self.size > 0.0626 * self.length:
            raise ValueError(f"size is {self.size:g}, expected at most a sixteenth of length, {self.length / 16:g} m")
        if self.grain_density <= 1000.0:
            raise ValueError(f"grain_density is {self.grain_density:g}, expected more than that of water, 1000 kg/m3")
        if self.concentration > 0.5 * self.limit:
            most = 0.5 * self.limit
            raise ValueError(f"concentration is {self.concentration:g}, expected at most half of limit, {most:g}")
        return self

    def model(self) -> str:
        return SLOT

    def loading(self) -> str:
        return PUMPED


SLOT = """
pcdc model new dim 3
pcdc model gravity (0,0,-9.81)
cells_x, cells_z = int(round(length / size)), int(round(height / layer))
pcdc mesh structured (0,[-size],0) ([length],[size],[height]) cells [cells_x] 2 [cells_z] group 'walls'
pcdc element c-model mech-iso-e property density 2700 young 50e9 poisson-r 0.25
pcdc face-joint c-model hydr-p-p-m property fluid-density 1000 fluid-bulk 2.2e9 viscosity [viscosity/1000] \\
    aperature-initial [aperture] aperature-minimum [aperture] proppant-density [grain_density] \\
    proppant-size [grain_size] proppant-concentration-limit [limit] proppant-stokes [stokes] \\
    turbulence [turbulence] range y 0 0
pcdc model option mechanical off
pcdc flow-node initial pressure 1e5
# Inlets at a quarter, a half and three quarters of the height; the outlet beside the highest of them.
near = max(0.51 * height / cells_z, 6.4e-3)
for k in (1, 2, 3):
    pcdc node group 'inlet' set 'ends' range x 0 0 y 0 0 z [0.25*k*height - near] [0.25*k*height + near]
pcdc node group 'outlet' set 'ends' range x [length] [length] y 0 0 z [0.75*height - near] [0.75*height + near]
inlets = len(pcdc.numbers('node', group='inlet', set='ends'))
pcdc node boundary hydra-c-f-b flow-rate [rate/inlets] range group 'inlet' set 'ends'
pcdc node boundary hydra-p-b p-v-c [concentration] range group 'inlet' set 'ends'
pcdc node boundary hydra-c-f-b pressure 1e5 range group 'outlet' set 'ends'
"""
PUMPED = """
import math
import numpy as np
from hpcdem.physics.proppant import settling
# Huang et al. (ARMA 21-1248) computed the bed and found it as Chun et al. (J. Petrol. Sci. Eng. 184, 2020) measured it;
# what is above it is measured. Both as in the documentation of GEOS, as parts of the slot.
measured = [(10, 0.074), (12.5, 0.075), (16, 0.075), (17.5, 0.073), (20, 0.068), (23.5, 0.063), (25.4, 0.063),
            (27.2, 0.069), (29.5, 0.079)]
beside = [(10, 0.131), (12, 0.161), (14, 0.191), (16, 0.220), (18, 0.251), (20, 0.281), (22, 0.310), (24, 0.341),
          (26, 0.371), (28, 0.401), (30, 0.430)]

nodes, all_nodes = np.asarray(pcdc.numbers('flow-node')), np.asarray(pcdc.numbers('node'))
x = np.asarray(pcdc.values('node', 'position-x'))[np.searchsorted(all_nodes, nodes)]
share = np.asarray(pcdc.values('flow-node', 'volume'))
share /= share.sum()
columns = np.round(x / length * cells_x).astype(int)

bed = []
count = 30
for k in range(count):
    pcdc model solve hydraulic time [time/count] dt [time/steps]
    c = np.asarray(pcdc.values('flow-node', 'concentration'))
    lies = c > 0.5 * limit
    heights = np.bincount(columns[lies], share[lies], cells_x + 1) / np.bincount(columns, share) * height
    bed.append((time * (k + 1) / count, float(share[lies].sum()), float(heights.max()),
                float(share[(c > concentration) & ~lies].sum())))
    if k + 1 in (count // 3, count):
        pcdc output vtk 'bed'
account = pcdc.proppant
settled = float(np.asarray(pcdc.values('flow-node', 'proppant'))[lies].sum()) / account['came']
fed, lost = concentration * rate * time / (limit * length * height * aperture), account['relative']
known = [(t, part) for t, part in beside if t <= time]
at = np.interp([t for t, _ in known], [one[0] for one in bed], [one[1] for one in bed])
difference = max((abs(float(a) - part) for a, (_, part) in zip(at, known)), default=math.nan)
fall = settling.stokes if stokes else settling.terminal
speed = fall(grain_size, grain_density, 1000.0, viscosity, 9.81)

pcdc chart create 'proppant-bed' x-label 'time (s)' y-label 'part of the slot (1)'
pcdc chart add 'proppant-bed' values [[(0, 0), (time, fed)]] label 'all that came, as bed'
pcdc chart add 'proppant-bed' values [[(0, 0)] + [(t, part) for t, part, *_ in bed]] label 'bed'
pcdc chart add 'proppant-bed' values [beside] label 'bed, Huang et al. 2021' style points
pcdc chart add 'proppant-bed' values [[(0, 0)] + [(t, part) for t, *_, part in bed]] label 'dense slurry above it'
pcdc chart add 'proppant-bed' values [measured] label 'above it, Chun et al. 2020' style points
pcdc chart export 'proppant-bed' 'proppant-bed.png'
print('the bed takes %.3g of the slot after %.3g s, all that came would take %.3g; at most %.3g m high; at most %.3g '
      'off the simulation of 2021' % (bed[-1][1], time, fed, bed[-1][2], difference))
print('%.3g of what came lies in the bed; %.3g of the slot has dense slurry above it' % (settled, bed[-1][3]))
"""

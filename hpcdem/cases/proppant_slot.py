"""Proppant that settles in a vertical fracture, beside Kynch's solution."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import Case, quantity


@dataclass(frozen=True)
class Settled:
    """Result of the case.

    speed: settling speed of a single grain [m/s]; front, exact_front: downward speed of the front of clear fluid [m/s];
    bed, exact_bed: upward speed of the top of the pack [m/s]; error: mean deviation of the concentration from Kynch's
    solution at three times, over the initial concentration; profiles: (time [s], height [m], concentration, that of the
    solution); pack, exact_pack: final height of the pack [m]; lost: closing error of the proppant budget, relative.
    """

    speed: float
    front: float
    exact_front: float
    bed: float
    exact_bed: float
    error: float
    profiles: list[tuple[float, float, float, float]] = field(repr=False)
    pack: float
    exact_pack: float
    lost: float


class ProppantSlot(Case):
    """A closed vertical fracture filled with slurry: concentration over height and time, and the final pack."""

    name: ClassVar[str] = "proppant-slot"
    title: ClassVar[str] = "Proppant settles in a vertical fracture"
    result: ClassVar[type] = Settled

    height: float = quantity(1.0, "m", "height of the fracture", gt=0)
    size: float = quantity(0.005, "m", "length of its channels", gt=0)
    aperture: float = quantity(5e-3, "m", "aperture of the fracture", gt=0)
    concentration: float = quantity(0.2, "1", "volume of grains over that of the slurry at the beginning", gt=0)
    limit: float = quantity(0.6, "1", "volume fraction of grains in a pack", gt=0, le=0.74)
    grain_size: float = quantity(0.5e-3, "m", "diameter of the grains", gt=0)
    grain_density: float = quantity(2650.0, "kg/m3", "density of the grains", gt=0)
    fluid_density: float = quantity(1000.0, "kg/m3", "density of the fluid", gt=0)
    viscosity: float = quantity(0.1, "Pa s", "dynamic viscosity of the fluid", gt=0)

    @model_validator(mode="after")
    def _fits(self) -> ProppantSlot:
        if self.concentration > 0.5 * self.limit:
            most = 0.5 * self.limit
            raise ValueError(f"concentration is {self.concentration:g}, expected at most half of limit, {most:g}")
        if self.size > 0.05 * self.height:
            raise ValueError(f"size is {self.size:g}, expected at most a twentieth of height, {0.05 * self.height:g} m")
        if self.aperture < 3.0 * self.grain_size:
            raise ValueError(f"aperture is {self.aperture:g}, expected at least 3 grains, {3 * self.grain_size:g} m")
        if self.grain_density <= self.fluid_density:
            raise ValueError("grain_density is not above fluid_density, so grains do not settle")
        return self

    def model(self) -> str:
        return SLOT

    def loading(self) -> str:
        return SETTLE


SLOT = """
pcdc model new
pcdc model gravity (0,-9.81)
cells = int(round(height / size))
pcdc mesh structured ([-0.4*height],0) ([0.4*height],[height]) cells 2 [cells] group 'rock'
pcdc element c-model mech-iso-e property density 2700 young 50e9 poisson-r 0.25
pcdc face-joint c-model hydr-p-p-m property fluid-density [fluid_density] fluid-bulk 2.2e9 \\
    viscosity [viscosity/fluid_density] aperature-initial [aperture] aperature-minimum [aperture] \\
    proppant-density [grain_density] proppant-size [grain_size] proppant-concentration-limit [limit] range x 0 0
pcdc model option mechanical off
pcdc flow-node initial pressure [10*fluid_density*9.81*height]
pcdc flow-node initial concentration [concentration]
"""
SETTLE = """
# Kynch 1952: each concentration rises with the slope of the lower convex hull of the flux C (1 - C)^5.65 v between the
# pack, out of which nothing falls, and the slurry; the clear fluid above sinks with its upper chord.
import numpy as np
from scipy.optimize import brentq
def lacks(v):                                    # of the drag on a grain, Schiller & Naumann 1933
    re = fluid_density * v * grain_size / viscosity
    drag = 24 / re * (1 + 0.15 * re**0.687) if re < 1000 else 0.44
    return 0.75 * drag * fluid_density * v * v / grain_size - (grain_density - fluid_density) * 9.81
speed = brentq(lacks, 1e-12, 1e3, rtol=1e-12)
def flux(c):
    return c * (1 - c)**5.65 * speed
c = np.linspace(concentration, limit, 4001)
f = np.append(flux(c[:-1]), 0.0)
hull = []
for k in range(len(c)):
    while len(hull) > 1 and ((f[hull[-1]] - f[hull[-2]]) * (c[k] - c[hull[-2]])
                             >= (f[k] - f[hull[-2]]) * (c[hull[-1]] - c[hull[-2]])):
        hull.pop()
    hull.append(k)
rises = -np.diff(f[hull]) / np.diff(c[hull])     # from the slurry to the pack: the fastest first
exact_bed, exact_front = float(rises[-1]), (1 - concentration)**5.65 * speed
def kynch(y, t):
    below = np.array([limit - np.sum(np.diff(c[hull])[rises * t < one]) for one in y])
    return np.where(y > height - exact_front * t, 0.0, below)

nodes = np.asarray(pcdc.numbers('flow-node'))
y = np.asarray(pcdc.values('node', 'position-y'))[np.searchsorted(np.asarray(pcdc.numbers('node')), nodes)]
order = np.argsort(y)
y = y[order]
meet = height / (exact_front + float(rises[0]))
times, fronts, beds, profiles, points, error = [0.3 * meet, 0.6 * meet, 0.9 * meet], [], [], [], [], 0.0
pcdc chart create 'proppant-slot' x-label 'concentration (1)' y-label 'height (m)'
before = 0.0
for t in times:
    pcdc model solve hydraulic time [t - before] dt [0.02*meet]
    before = t
    found = np.asarray(pcdc.values('flow-node', 'concentration'))[order]
    exact = kynch(y, t)
    error += float(np.mean(np.abs(found - exact))) / concentration / len(times)
    upper = y > 0.5 * (height - exact_front * t + float(rises[0]) * t)
    fronts.append(float(np.interp(-0.5 * concentration, -found[upper], y[upper])))
    beds.append(float(np.interp(-0.5 * (limit + c[hull[-2]]), -found[~upper], y[~upper])))
    profiles += [(t, float(a), float(b), float(e)) for a, b, e in zip(y, found, exact)]
    points += list(zip(found[::4].tolist(), y[::4].tolist()))
    pcdc chart add 'proppant-slot' values [list(zip(exact.tolist(), y.tolist()))] label ['Kynch, %.3g s' % t]
front = (fronts[0] - fronts[-1]) / (times[-1] - times[0])
bed = (beds[-1] - beds[0]) / (times[-1] - times[0])
pcdc chart add 'proppant-slot' values [points] label 'model' style points
pcdc output vtk 'proppant-slot'
pcdc chart export 'proppant-slot' 'proppant-slot.png' fluid concentration

# Until all of it lies below.
pcdc model solve hydraulic time [20*meet] dt [0.2*meet]
account = pcdc.proppant
pack, exact_pack, lost = account['packed'] / (limit * aperture), concentration / limit * height, account['relative']
print('a grain settles by %.4g m/s; clear fluid above by %.4g, Kynch %.4g m/s; the pack rises by %.4g, Kynch %.4g m/s'
      % (speed, front, exact_front, bed, exact_bed))
print('concentration: in the mean %.3g %% of the first off; pack at the end %.4g m high, expected %.4g m'
      % (100 * error, pack, exact_pack))
"""

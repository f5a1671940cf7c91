"""Steady flow from a hole to a concentric circle, compared with its closed form."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import quantity, refuse_thin_ring
from hpcdem.cases.water import CHANNELS, ROCK, STEADY, Water


@dataclass(frozen=True)
class Radial:
    """inflow, outflow [m2/s]: through the hole and the outer circle; imbalance: their difference over the inflow;
    error: largest difference of the mean pressure on RINGS circles from the closed form, over the difference of both
    pressures; permeability [m2]: that with which the closed form has this inflow; profile: (radius [m], mean pressure
    [Pa], closed form [Pa]) of these rings; account: closing error of the fluid budget."""

    inflow: float
    outflow: float
    imbalance: float
    error: float
    permeability: float
    profile: list[tuple[float, float, float]] = field(repr=False)
    account: float


class RadialFlow(Water):
    """Water flows from a hole under pressure through jointed rock to a concentric circle."""

    name: ClassVar[str] = "radial-flow"
    title: ClassVar[str] = "Steady flow from a hole through jointed rock"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Radial

    inner: float = quantity(1.0, "m", "radius of the hole", gt=0)
    outer: float = quantity(5.0, "m", "radius of the model", gt=0)
    inner_pressure: float = quantity(10e6, "Pa", "pressure in the hole", ge=0)
    outer_pressure: float = quantity(1e6, "Pa", "pressure on the outer circle", ge=0)
    size: float = quantity(0.15, "m", "edges of the elements", gt=0)

    @model_validator(mode="after")
    def _fits(self) -> RadialFlow:
        refuse_thin_ring(self.inner, self.outer, self.size)
        if self.inner_pressure == self.outer_pressure:
            raise ValueError("inner_pressure and outer_pressure are equal, so no water flows")
        return self

    def model(self) -> str:
        return RING + ROCK + CHANNELS.replace(" RANGE", "") + HELD

    def loading(self) -> str:
        return STEADY + RINGS


RING = """
pcdc model new
pcdc geometry create circle (0,0) [outer] as-layer 'outer'
pcdc geometry create circle (0,0) [inner] as-layer 'hole'
pcdc mesh create from-layer 'outer' size [size] hole 'hole' group 'rock'
"""
HELD = """
pcdc flow-node initial pressure [0.5*(inner_pressure + outer_pressure)]
pcdc node boundary hydra-c-f-b pressure [inner_pressure] range geometry 'hole'
pcdc node boundary hydra-c-f-b pressure [outer_pressure] range geometry 'outer'
pcdc node group 'in' set 'wet' range geometry 'hole'
pcdc node group 'out' set 'wet' range geometry 'outer'
"""
RINGS = """
# Means over rings, and p = p_i + (p_o - p_i) ln(r / r_i) / ln(r_o / r_i).
def closed_form(r):
    return inner_pressure + (outer_pressure - inner_pressure) * math.log(r / inner) / math.log(outer / inner)
r = np.hypot(x, y)
profile = []
for k in range(1, 16):
    middle = inner + (outer - inner) * k / 16
    ring = np.abs(r - middle) < 0.7 * size
    # A ring of nodes has its mean radius, in ln r as the pressure is.
    if ring.any():
        mean = math.exp(float(np.log(r[ring]).mean()))
        profile.append((mean, float(pressure[ring].mean()), closed_form(mean)))
error = max(abs(found - exact) for _, found, exact in profile) / abs(inner_pressure - outer_pressure)
permeability = (inflow * viscosity * math.log(outer / inner)
                / (2 * math.pi * (inner_pressure - outer_pressure)))
lattice = math.sqrt(3) * aperture**3 / (12 * size)   # that of equilateral triangles
print('inflow %.5g m2/s, outflow %.5g m2/s' % (inflow, outflow))
print('pressure on rings: largest difference from the closed form %.3g %% of that between the circles' % (100*error))
print('permeability %.4g m2; that of a lattice of equilateral triangles of this size %.4g m2' % (permeability, lattice))
line = [(inner * (outer / inner)**(k / 60), 1e-6 * closed_form(inner * (outer / inner)**(k / 60))) for k in range(61)]
points = [(a, 1e-6 * found) for a, found, _ in profile]
pcdc output vtk 'radial-flow'
pcdc chart create 'radial-flow' x-label 'radius (m)' y-label 'pressure (MPa)'
pcdc chart add 'radial-flow' values [line] label 'closed form'
pcdc chart add 'radial-flow' values [points] label 'means over rings' style points
pcdc chart export 'radial-flow' 'radial-flow.png' fluid pressure
"""

"""Seepage through a dam with vertical faces: the water level inside."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import quantity
from hpcdem.cases.water import CHANNELS, ROCK, STEADY, Water


@dataclass(frozen=True)
class Seepage:
    """Result of the case.

    discharge: mean of inflow and outflow [m2/s]; exact: discharge after Charny [m2/s]; imbalance: difference of inflow
    and outflow over inflow; levels: (x [m], level of the water [m], level after Dupuit [m]); seepage_face: height above
    the lower level of the highest node with outflow [m]; level_error: largest relative deviation of the levels from
    Dupuit up to three quarters of the distance; account: closing error of the fluid budget.
    """

    discharge: float
    exact: float
    imbalance: float
    levels: list[tuple[float, float, float]] = field(repr=False)
    seepage_face: float
    level_error: float
    account: float


class DamSeepage(Water):
    """A rectangular dam between two water levels: free surface, seepage face and discharge."""

    name: ClassVar[str] = "dam-seepage"
    title: ClassVar[str] = "Seepage through a dam with vertical faces"
    result: ClassVar[type] = Seepage

    length: float = quantity(16.0, "m", "width of the dam from side to side", gt=0)
    height: float = quantity(9.0, "m", "height of the dam", gt=0)
    left: float = quantity(8.0, "m", "level of the water on the left", gt=0)
    right: float = quantity(4.0, "m", "level of the water on the right", ge=0)
    size: float = quantity(0.5, "m", "edges of the elements", gt=0)
    gravity: float = quantity(9.81, "m/s2", "acceleration of gravity, downwards", gt=0)

    @model_validator(mode="after")
    def _fits(self) -> DamSeepage:
        if not self.right < self.left <= self.height:
            raise ValueError("right, left, height: expected right below left, and left at most the height")
        if self.size > 0.125 * self.left:
            raise ValueError(f"size is {self.size:g}, expected at most an eighth of left, {0.125 * self.left:g} m")
        return self

    def model(self) -> str:
        return DAM + ROCK + CHANNELS.replace(" RANGE", "") + LEVELS

    def loading(self) -> str:
        return STEADY + SURFACE


DAM = """
pcdc model new
pcdc mesh equilateral (0,0) ([length],[height]) size [size] group 'dam'
pcdc model gravity (0,[-gravity])
"""
LEVELS = """
# Below its level the water presses, above it can come out, but none comes in.
near = 1e-6 * length
pcdc node group 'in' set 'wet' range x [-near] [near]
pcdc node group 'out' set 'wet' range x [length - near] [length + near]
pcdc node boundary hydra-c-f-b flow-surface [left] range group 'in' set 'wet'
pcdc node boundary hydra-c-f-b flow-surface [right] range group 'out' set 'wet'
pcdc flow-node initial saturation 0.2
pcdc flow-node initial pressure [0.2*fluid_density*gravity*left] range y 0 [0.5*(left + right)]
"""
SURFACE = """
# The surface is where the head of the highest wet nodes is; y2 = l2 - (l2 - r2) x / L after Dupuit, whose discharge
# K (l2 - r2) / (2 L) is exact (Charny). K is that of a lattice of equilateral triangles.
head = y + pressure / (fluid_density * gravity)
def dupuit(at):
    return math.sqrt(left**2 - (left**2 - right**2) * at / length)
levels = []
for k in range(1, 8):
    place = k * length / 8
    column = (np.abs(x - place) < 0.51 * size) & (pressure > 0.0)
    if column.any():
        levels.append((place, float(head[column].max()), dupuit(place)))
level_error = max(abs(found - exact) / exact for place, found, exact in levels if place <= 0.76 * length)
conductivity = math.sqrt(3) * aperture**3 / (12 * size) * fluid_density * gravity / viscosity
exact = conductivity * (left**2 - right**2) / (2 * length)
discharge = 0.5 * (inflow + outflow)
leaving = pcdc.values('flow-node', 'inflow')
seeps = (x > length - near) & (leaving < 0.0) & (y > right)
seepage_face = float((y[seeps] - right).max()) if seeps.any() else 0.0
print('discharge %.5g m2/s; after Charny %.5g m2/s (%+.2f %%)'
      % (discharge, exact, 100 * (discharge / exact - 1)))
print('levels up to three quarters of the distance: at most %.3g %% from those of Dupuit; seepage face %.3g m'
      % (100 * level_error, seepage_face))
line = [(k * length / 60, dupuit(k * length / 60)) for k in range(61)]
points = [(place, found) for place, found, _ in levels]
pcdc output vtk 'dam-seepage'
pcdc chart create 'dam-seepage' x-label 'x (m)' y-label 'level of the water (m)'
pcdc chart add 'dam-seepage' values [line] label 'Dupuit'
pcdc chart add 'dam-seepage' values [points] label 'free surface' style points
pcdc chart export 'dam-seepage' 'dam-seepage.png' fluid pressure
"""

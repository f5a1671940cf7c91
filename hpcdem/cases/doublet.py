"""Two wells in jointed rock: cold water goes down one, and comes up the other, at last."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import quantity
from hpcdem.cases.water import WARM, Warm


@dataclass(frozen=True)
class Breakthrough:
    """Result of the case.

    breakthrough: arrival of the front on the straight path, closed form [s]; quarter, exact_quarter: time at which a
    quarter of the temperature difference has arrived, of the model and of the closed form [s]; error: largest deviation
    of the temperature of the produced water from the closed form, from 1.5 times the breakthrough on, over the
    difference between the wells; curve: (time [s], fraction of the difference that has arrived, that of the closed
    form); account: closing error of the heat budget; elements: their number.
    """

    breakthrough: float
    quarter: float
    exact_quarter: float
    error: float
    curve: list[tuple[float, float, float]] = field(repr=False)
    account: float
    elements: int


class Doublet(Warm):
    """A doublet of wells in a plan of jointed rock: the thermal breakthrough curve."""

    name: ClassVar[str] = "doublet"
    title: ClassVar[str] = "Thermal breakthrough between two wells"
    result: ClassVar[type] = Breakthrough

    distance: float = quantity(100.0, "m", "between the wells", gt=0)
    size: float = quantity(3.2, "m", "edges of the elements, all of which are channels", gt=0)
    aperture: float = quantity(2e-4, "m", "hydraulic aperture of the channels", gt=0)
    rate: float = quantity(4e-4, "m2/s", "flow rate of each well, per metre of thickness", gt=0)
    inflow_temperature: float = quantity(293.15, "K", "temperature of the injected water", gt=0)
    rock_temperature: float = quantity(393.15, "K", "initial temperature of rock and water", gt=0)
    duration: float = quantity(2.0, "years", "duration of operation", gt=0)
    steps: int = quantity(200, "1", "implicit steps", ge=20)

    @model_validator(mode="after")
    def _fits(self) -> Doublet:
        if self.inflow_temperature == self.rock_temperature:
            raise ValueError("inflow_temperature and rock_temperature are equal, so no heat flows")
        if self.size > 0.1 * self.distance:
            raise ValueError(f"size is {self.size:g}, expected at most a tenth of distance, {0.1 * self.distance:g} m")
        return self

    def model(self) -> str:
        return PLAN + WARM.replace(" RANGE", "") + FIELD

    def loading(self) -> str:
        return OPERATION


PLAN = """
import numpy as np
wide, high = 2 * distance, 1.5 * distance        # from the middle to the sides
pcdc model new
pcdc mesh equilateral ([-wide],[-high]) ([wide],[high]) size [size] group 'rock'
pcdc element c-model mech-iso-e property density [density] young 50e9 poisson-r 0.25
pcdc element c-model therm-iso-h property conductivity [conductivity] capacity [capacity]
"""
FIELD = """
# The wells are nodes; on the sides the water has the pressure that a doublet without end has there.
nodes = np.asarray(pcdc.numbers('node'))
x, y = (np.asarray(pcdc.values('node', name)) for name in ('position-x', 'position-y'))
cold_well = int(np.argmin(np.hypot(x + 0.5 * distance, y)))
warm_well = int(np.argmin(np.hypot(x - 0.5 * distance, y)))
apart = math.hypot(x[warm_well] - x[cold_well], y[warm_well] - y[cold_well])
conductance = math.sqrt(3) * aperture**3 / (12 * viscosity * size)  # of a lattice of equilateral triangles
unit = rate / (2 * math.pi * conductance)
def pressure(k):
    return unit * math.log(math.hypot(x[k] - x[warm_well], y[k] - y[warm_well])
                           / math.hypot(x[k] - x[cold_well], y[k] - y[cold_well]))
edge = 1e-6 * size
sides = (x < x.min() + edge) | (x > x.max() - edge) | (y < y.min() + edge) | (y > y.max() - edge)
sides = np.flatnonzero(sides & np.isin(nodes, pcdc.numbers('flow-node')))  # at a corner no channel may end
offset = -min(pressure(int(k)) for k in sides) + 10 * unit
for k in sides:
    pcdc node boundary hydra-c-f-b pressure [pressure(int(k)) + offset] range id [int(nodes[k])]
    pcdc node boundary therm-f-b-c temperature [rock_temperature] range id [int(nodes[k])]
pcdc node boundary hydra-c-f-b flow-rate [rate] range id [int(nodes[cold_well])]
pcdc node boundary hydra-c-f-b flow-rate [-rate] range id [int(nodes[warm_well])]
pcdc flow-node initial pressure [offset]
pcdc model solve hydraulic steady
pcdc node initial temperature [rock_temperature]
pcdc node boundary therm-f-b-c temperature [inflow_temperature] range id [int(nodes[cold_well])]
"""
OPERATION = """
# Without conduction a front runs along each stream line, as much slower than the water as rock and water hold more heat
# than the water. That at the angle f to the straight path arrives at 3 t_b (1 - f cot f) / sin(f)^2, with the part
# f / pi of the water (Gringarten & Sauty 1975, without caprock).
cells = 2 / (math.sqrt(3) * size**2)             # nodes per area, three channels each
whole = density * capacity + 3 * cells * size * aperture * fluid_density * fluid_capacity
breakthrough = math.pi * apart**2 * whole / (3 * fluid_density * fluid_capacity * rate)
angle = np.linspace(1e-3, math.pi - 1e-3, 4000)
arrival = 3 * breakthrough * (1 - angle / np.tan(angle)) / np.sin(angle)**2
def closed_form(t):
    return float(np.interp(t, arrival, angle / math.pi, left=0.0))
year = 365.25 * 86400.0
pcdc history create 'up' flow-node value temperature id [int(nodes[warm_well])]
pcdc history create 'time' model value heat-time
pcdc model solve thermal time [duration*year] dt [duration*year/steps]
times, found = (np.asarray(pcdc.history(name))[:, 2] for name in ('time', 'up'))
came = (found - rock_temperature) / (inflow_temperature - rock_temperature)
curve = [(float(t), float(c), closed_form(t)) for t, c in zip(times, came)]
error = max((abs(c - e) for t, c, e in curve if t > 1.5 * breakthrough), default=0.0)
quarter = float(np.interp(0.25, came, times)) if came[-1] > 0.25 else math.inf
exact_quarter = float(np.interp(0.25, angle / math.pi, arrival))
account, elements = pcdc.heat['relative'], len(pcdc.numbers('element'))
print('front on the straight path after %.3g years; a quarter has come after %.3g, closed form %.3g years; from 1.5 '
      'times the front on at most %.3g %% off'
      % (breakthrough / year, quarter / year, exact_quarter / year, 100 * error))
pcdc output vtk 'doublet'
pcdc chart create 'doublet' x-label 'time (years)' y-label 'relative cooling of what comes up (1)'
pcdc chart add 'doublet' values [[(t / year, e) for t, _, e in curve]] label 'closed form, without conduction'
pcdc chart add 'doublet' values [[(t / year, c) for t, c, _ in curve[::max(1, len(curve) // 60)]]] label 'model' \\
    style points
pcdc chart export 'doublet' 'doublet.png' temperature
"""

"""Water that flows along a fracture and takes its temperature into the rock on both sides, beside Lauwerier's form."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import quantity
from hpcdem.cases.water import WARM, Warm


@dataclass(frozen=True)
class Front:
    """Result of the case.

    error: largest deviation of the water temperature from the closed form at the given times, over the difference of
    inflow and initial temperature; rock_error: the corresponding deviation in the rock at the distance `aside`; water,
    rock: (time [s], distance along the fracture [m], relative temperature difference, that of the closed form) at
    quarters of the distance; account: closing error of the heat budget.
    """

    error: float
    rock_error: float
    water: list[tuple[float, float, float, float]] = field(repr=False)
    rock: list[tuple[float, float, float, float]] = field(repr=False)
    account: float


class Lauwerier(Warm):
    """A straight fracture in a slab of rock: temperatures of water and rock over time."""

    name: ClassVar[str] = "lauwerier"
    title: ClassVar[str] = "Heat transport by water in a fracture"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Front

    length: float = quantity(100.0, "m", "length of the fracture", gt=0)
    half: float = quantity(40.0, "m", "rock on each side of it", gt=0)
    size: float = quantity(0.5, "m", "edges at the fracture", gt=0)
    coarse: float = quantity(5.0, "m", "edges far from it", gt=0)
    aperture: float = quantity(1e-3, "m", "hydraulic aperture of the fracture", gt=0)
    speed: float = quantity(0.01, "m/s", "velocity of the water", gt=0)
    along: float = quantity(1e-3, "1", "conductivity of the rock along the fracture over that across", gt=0)
    inflow_temperature: float = quantity(293.15, "K", "temperature of the inflowing water", gt=0)
    rock_temperature: float = quantity(373.15, "K", "initial temperature of rock and water", gt=0)
    first: float = quantity(50.0, "days", "the first of two times", gt=0)
    second: float = quantity(150.0, "days", "the second one", gt=0)
    aside: float = quantity(5.0, "m", "distance from the fracture at which the rock temperature is evaluated", gt=0)
    steps: int = quantity(300, "1", "implicit steps up to the second time", ge=10)

    @model_validator(mode="after")
    def _fits(self) -> Lauwerier:
        if self.inflow_temperature == self.rock_temperature:
            raise ValueError("inflow_temperature and rock_temperature are equal, so no heat flows")
        if not self.first < self.second:
            raise ValueError(f"second is {self.second:g}, expected more than first, {self.first:g} days")
        if self.size > 0.05 * self.length:
            raise ValueError(f"size is {self.size:g}, expected at most a twentieth of length, {0.05 * self.length:g} m")
        if self.coarse < self.size:
            raise ValueError(f"coarse is {self.coarse:g}, expected at least size, {self.size:g} m")
        if self.aside > 0.5 * self.half:
            raise ValueError(f"aside is {self.aside:g}, expected at most half of half, {0.5 * self.half:g} m")
        return self

    def model(self) -> str:
        return FRACTURE + WARM.replace("RANGE", "range geometry 'fracture'")

    def loading(self) -> str:
        return COOLED


FRACTURE = """
pcdc model new
pcdc geometry create polygon (0,[-half]) ([length],[-half]) ([length],0) ([length],[half]) (0,[half]) (0,0) \\
    as-layer 'outline'
pcdc geometry create polyline (0,0) ([length],0) as-layer 'fracture'
pcdc mesh create from-layer 'outline' size [coarse] refine-layer 'fracture' size [size] distance [half] \\
    embed 'fracture' group 'rock'
pcdc element c-model mech-iso-e property density [density] young 50e9 poisson-r 0.25
pcdc element c-model therm-iso-h property conductivity [along*conductivity] conductivity-across [conductivity] \\
    capacity [capacity]
"""
COOLED = """
# Steady flow, which stays as it is, then heat.
near = 1e-6 * length
pcdc node group 'in' set 'wet' range x [-near] [near] y [-near] [near]
pcdc node group 'out' set 'wet' range x [length - near] [length + near] y [-near] [near]
pcdc node boundary hydra-c-f-b pressure [12*viscosity*speed/aperture**2*length] range group 'in' set 'wet'
pcdc node boundary hydra-c-f-b pressure 0 range group 'out' set 'wet'
pcdc model solve hydraulic steady
pcdc node initial temperature [rock_temperature]
pcdc node boundary therm-f-b-c temperature [inflow_temperature] range group 'in' set 'wet'

# Lauwerier 1955: no conduction along the fracture, rock without end.
import numpy as np
from scipy.special import erfc
carried = fluid_density * fluid_capacity * speed * aperture
def closed_form(x, y, t):
    t = t - x / speed
    return erfc((2 * conductivity * x / carried + abs(y))
                * np.sqrt(density * capacity / (4 * conductivity * np.maximum(t, 1e-9)))) * (t > 0)
cold = inflow_temperature - rock_temperature
day = 86400.0
all_nodes = np.asarray(pcdc.numbers('node'))
xs, ys = (np.asarray(pcdc.values('node', name)) for name in ('position-x', 'position-y'))
at = np.searchsorted(all_nodes, pcdc.numbers('flow-node'))
fine = 20 * size
beside = np.abs(np.abs(ys) - aside) < 0.5 * aside
water, rock, error, rock_error, before = [], [], 0.0, 0.0, 0.0
for time in (first * day, second * day):
    pcdc model solve thermal time [time - before] dt [second*day/steps]
    before = time
    t = (np.asarray(pcdc.values('flow-node', 'temperature')) - rock_temperature) / cold
    error = max(error, float(np.abs(t - closed_form(xs[at], 0.0, time)).max()))
    found = (np.asarray(pcdc.values('node', 'temperature')) - rock_temperature) / cold
    rock_error = max(rock_error, float(np.abs(found - closed_form(xs, ys, time))[beside].max()))
    order = np.argsort(xs[at])
    for part in (0.1, 0.25, 0.5, 0.75):
        place = part * length
        water.append((time, place, float(np.interp(place, xs[at][order], t[order])),
                      float(closed_form(np.float64(place), 0.0, time))))
        k = np.argmin(np.hypot(xs - place, ys - aside))
        rock.append((time, float(xs[k]), float(found[k]), float(closed_form(xs[k], ys[k], time))))
    days = '%g days' % (time / day)
    line = [(k * length / 100, float(closed_form(np.float64(k * length / 100), 0.0, time))) for k in range(101)]
    if time == first * day:
        pcdc chart create 'lauwerier' x-label 'distance along the fracture (m)' \\
            y-label 'relative cooling of the water (1)'
    pcdc chart add 'lauwerier' values [line] label ['Lauwerier, ' + days]
    points = [(float(a), float(b)) for a, b in zip(xs[at][order][::8], t[order][::8])]
    pcdc chart add 'lauwerier' values [points] label ['water, ' + days] style points
account = pcdc.heat['relative']
print('water: at most %.3g %% of the difference of temperature from the closed form; rock %g m away: %.3g %%'
      % (100 * error, aside, 100 * rock_error))
pcdc output vtk 'lauwerier'
pcdc chart export 'lauwerier' 'lauwerier.png' temperature
"""

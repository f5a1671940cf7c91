"""A fracture that closes on its proppant after it is shut in."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import Case, quantity


@dataclass(frozen=True)
class Closed:
    """Result of the case.

    opened, exact_opened: aperture in the middle under pressure, of the model and after Sneddon [m]; left, exact_left:
    volume of the fracture at the end over that at the beginning, of the model and for a uniform pack that carries the
    load; curve: (time [s], volume over initial volume, mean pressure of the fluid [Pa], mean stress of the pack [Pa]);
    profile: (position [m], initial aperture [m], final aperture [m]); lost: closing error of the proppant budget,
    relative.
    """

    opened: float
    exact_opened: float
    left: float
    exact_left: float
    curve: list[tuple[float, float, float, float]] = field(repr=False)
    profile: list[tuple[float, float, float]] = field(repr=False)
    lost: float


class ProppantClosure(Case):
    """A straight fracture filled with slurry is shut in: the fluid leaks off into the rock, and the walls close
    on a pack.
    """

    name: ClassVar[str] = "proppant-closure"
    title: ClassVar[str] = "A fracture closes on its proppant"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Closed

    half: float = quantity(5.0, "m", "half of the length of the fracture", gt=0)
    reach: float = quantity(10.0, "1", "from its middle to the sides of the model, over half", ge=4)
    size: float = quantity(0.1, "m", "edges of the elements at the fracture", gt=0)
    coarse: float = quantity(10.0, "m", "edges of the elements at the sides", gt=0)
    young: float = quantity(20e9, "Pa", "Young's modulus of the rock", gt=0)
    poisson: float = quantity(0.25, "1", "Poisson's ratio", ge=0, lt=0.5)
    stress: float = quantity(10e6, "Pa", "pressure in the rock, from all sides", gt=0)
    pressure: float = quantity(12e6, "Pa", "pressure of the slurry at shut-in", gt=0)
    pore: float = quantity(5e6, "Pa", "pressure of the water in the rock", ge=0)
    permeability: float = quantity(1e-16, "m2", "permeability of the rock", gt=0)
    concentration: float = quantity(0.2, "1", "volume of grains over that of the slurry", gt=0)
    limit: float = quantity(0.6, "1", "volume fraction of grains in a pack", gt=0, le=0.74)
    modulus: float = quantity(100e6, "Pa", "modulus of the pack", gt=0)
    grain_size: float = quantity(20e-6, "m", "diameter of the grains", gt=0)
    time: float = quantity(800.0, "s", "duration after shut-in", gt=0)
    steps: int = quantity(100, "1", "steps of flow in this time", ge=10)

    @model_validator(mode="after")
    def _fits(self) -> ProppantClosure:
        if self.size > 0.125 * self.half:
            raise ValueError(f"size is {self.size:g}, expected at most an eighth of half, {0.125 * self.half:g} m")
        if self.concentration > 0.5 * self.limit:
            most = 0.5 * self.limit
            raise ValueError(f"concentration is {self.concentration:g}, expected at most half of limit, {most:g}")
        if not self.pore < self.stress < self.pressure:
            raise ValueError("expected pore below stress, and stress below pressure")
        return self

    def model(self) -> str:
        return FRACTURE

    def loading(self) -> str:
        return SHUT_IN


FRACTURE = """
side, near = reach * half, 1e-6 * half
pcdc model new
pcdc geometry create rectangle ([-side],[-side]) ([side],[side]) as-layer 'outline'
pcdc geometry create polyline ([-half],0) ([half],0) as-layer 'fracture'
pcdc mesh create from-layer 'outline' size [coarse] refine-layer 'fracture' size [size] distance [0.8*side] \\
    embed 'fracture' group 'rock'
pcdc mesh intersect layer 'fracture'
pcdc element c-model mech-iso-e property density 2700 young [young] poisson-r [poisson]
pcdc face-joint c-model hydr-p-p-m property fluid-density 1000 fluid-bulk 2.2e9 viscosity 1e-6 \\
    aperature-initial 1e-6 aperature-minumum 1e-6 leak-off on matrix-permeability [permeability] matrix-porosity 0.1 \\
    matrix-porosity-compressibility 1e-9 matrix-pore-pressure [pore] proppant-density 2650 \\
    proppant-size [grain_size] proppant-concentration-limit [limit] proppant-modulus [modulus] range geometry 'fracture'
# The stress that is there; the sides do not move.
pcdc element initial stress-xx [-stress] stress-yy [-stress] stress-zz [-stress]
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range geometry 'outline'
pcdc model option dynamic off
pcdc model option collision off
pcdc model option large-strain off
pcdc flow-node initial pressure [pressure]
"""
SHUT_IN = """
import numpy as np
# The slurry opens it, after Sneddon (1946) to an ellipse.
pcdc face-joint property proppant-modulus 0
pcdc model solve elastic
pcdc face-joint property proppant-modulus [modulus]
pcdc flow-node initial pressure [pressure]
pcdc flow-node initial concentration [concentration]
plane = young / (1 - poisson**2)
exact_opened = 4 * (pressure - stress) * half / plane
channels = np.asarray(pcdc.numbers('flow-channel'))
nodes = np.asarray(pcdc.numbers('flow-node'))
x = np.asarray(pcdc.values('node', 'position-x'))[np.searchsorted(np.asarray(pcdc.numbers('node')), nodes)]
order = np.argsort(x)
inner = order[1:-1]
def at_nodes(name):
    return np.asarray(pcdc.values('flow-node', name))
first = at_nodes('volume')
each = np.zeros(len(x))                            # length of fracture of each node
each[order] = np.append(np.diff(x[order]), 0) / 2 + np.append(0, np.diff(x[order])) / 2
opened = float((first / each)[inner].max())
pcdc output vtk 'closure'
curve, profiles = [(0.0, 1.0, pressure, 0.0)], [(first / each)[order]]
count = 20
for k in range(count):
    pcdc model solve hydraulic time [time/count] dt [time/steps]
    v, p, push = at_nodes('volume'), at_nodes('pressure'), at_nodes('pack-pressure')
    curve.append((time * (k + 1) / count, float(v.sum() / first.sum()),
                  float((p * each).sum() / each.sum()), float((push * each).sum() / each.sum())))
    if k + 1 in (count // 10, count):
        profiles.append((v / each)[order])
    if k + 1 == count // 4:                        # the ends are packed by now
        half_way = time * (k + 1) / count, p[order].copy(), push[order].copy()
pcdc output vtk 'closure'
# If it closes everywhere likewise: the pack bears what the fluid does not, less what keeps the rock open.
left = curve[-1][1]
fluid = curve[-1][2]
exact_left = (modulus + fluid - stress) / (pressure - stress + modulus * limit / concentration)
profile = [(float(a), float(b), float(c)) for a, b, c in zip(x[order], profiles[0], profiles[-1])]
lost = pcdc.proppant['relative']

pcdc chart create 'proppant-closure' x-label 'x (m)' y-label 'aperture (mm)'
right = x[order] > -1e-6 * half
for found, label in zip(profiles, ('shut in', 'after %.3g s' % (time / 10), 'after %.3g s' % time)):
    points = list(zip(x[order][right].tolist(), (1e3 * found[right]).tolist()))
    pcdc chart add 'proppant-closure' values [points] label [label]
ellipse = exact_opened * np.sqrt(np.maximum(1 - (x[order] / half)**2, 0))
for part, label in ((1.0, 'Sneddon'), (exact_left, 'grains stay')):
    points = list(zip(x[order][right].tolist(), (1e3 * part * ellipse[right]).tolist()))
    pcdc chart add 'proppant-closure' values [points[::max(1, len(points) // 25)]] label [label] style points
pcdc chart export 'proppant-closure' 'proppant-closure.png'
pcdc chart create 'proppant-closure-stress' x-label 'x (m)' y-label ['MPa, after %.3g s' % half_way[0]]
for found, label in ((half_way[1], 'pressure of the fluid'), (half_way[2], 'stress of the pack'),
                     (half_way[1] + half_way[2], 'both')):
    points = list(zip(x[order].tolist(), (1e-6 * found).tolist()))
    pcdc chart add 'proppant-closure-stress' values [points] label [label]
pcdc chart export 'proppant-closure-stress' 'proppant-closure-stress.png'
print('opened to %.4g m, Sneddon %.4g m; %.4g of the volume is left, %.4g if all of it closes likewise'
      % (opened, exact_opened, left, exact_left))
"""

"""A plane hydraulic fracture driven from its middle (KGD), compared with its closed forms."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from pydantic import model_validator

from hpcdem.cases.base import Case, choice, quantity
from hpcdem.cases.kgd_solutions import resolution


@dataclass(frozen=True)
class Fracture:
    """length [m]: half length, to the damage 0.2 (toughness) or to the last joint past its peak (viscosity); opening
    [m] and pressure [Pa, above the confinement] in the middle; front [m]: of the fluid; *_error: relative, to the
    closed form; balance: closing error of the fluid budget; energy_error: closing error of the energy budget over the
    energy pumped in; curve: (time [s], length, opening, pressure) at ten times, or at the end; steps: number of
    implicit steps.
    """

    length: float
    opening: float
    pressure: float
    front: float
    length_error: float
    opening_error: float
    pressure_error: float
    balance: float
    energy_error: float
    steps: int
    curve: list[tuple[float, float, float, float]] = field(repr=False)


class HydraulicFracture(Case):
    """Fluid is pumped into the middle of a plane fracture, which grows along a line of joints (one half is
    modelled).
    """

    name: ClassVar[str] = "hydraulic-fracture"
    title: ClassVar[str] = "Plane hydraulic fracture (KGD)"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Fracture

    regime: Literal["toughness", "viscosity"] = choice(
        "toughness", "closed form and tip: toughness-dominated (low viscosity), or viscosity-dominated (low toughness)"
    )
    young: float = quantity(30e9, "Pa", "Young's modulus of the rock", gt=0)
    poisson: float = quantity(0.25, "1", "Poisson's ratio of the rock", ge=0, lt=0.5)
    energy: float = quantity(100.0, "N/m", "fracture energy", gt=0)
    tensile_strength: float = quantity(5e6, "Pa", "tensile strength", gt=0)
    confinement: float = quantity(1e6, "Pa", "stress that presses on the line", ge=0)
    rate: float = quantity(1e-4, "m2/s", "pumped into both wings", gt=0)
    viscosity: float = quantity(1e-5, "Pa s", "dynamic viscosity of the fluid", gt=0)
    fluid_bulk: float = quantity(1e11, "Pa", "bulk modulus of the fluid", gt=0)
    aperture: float = quantity(2e-7, "m", "hydraulic aperture of closed joints", gt=0)
    time: float = quantity(5.0, "s", "duration of pumping", gt=0)
    reach: float = quantity(4.0, "m", "length of the line of joints", gt=0)
    far: float = quantity(20.0, "1", "size of the model over reach", ge=3)
    size: float = quantity(0.02, "m", "edges on the line", gt=0)
    stiffness: float = quantity(100.0, "1", "penalty of the joints over Young's modulus", ge=10)
    steps_at_most: float = quantity(200.0, "1", "largest time step, as a fraction of the time", ge=10)

    @model_validator(mode="after")
    def _fits(self) -> HydraulicFracture:
        if self.size > 0.1 * self.reach:
            raise ValueError(f"size is {self.size:g}, expected at most a tenth of reach, {0.1 * self.reach:g} m")
        plane = self.young / (1.0 - self.poisson**2)
        r = resolution(plane, self.energy, self.tensile_strength, self.confinement, self.size)
        if r > 1.0 and self.regime == "toughness":
            raise ValueError(
                f"size is {self.size:g}, expected at most {self.size / r:.3g} m: longer joints open in jumps"
            )
        return self

    def model(self) -> str:
        return MODEL

    def loading(self) -> str:
        tip = "0.2" if self.regime == "toughness" else "0.0"
        form = "slightly_viscous(plane, energy, viscosity, rate, t)"
        # Where the lag behind the tip closes surfaces touch in the end, and implicit steps cannot continue.
        parts = "10" if self.regime == "toughness" else "1"
        return (
            LOADING.replace("TIP", tip)
            .replace("PARTS", parts)
            .replace("FORM", form if self.regime == "toughness" else "viscous(plane, viscosity, rate, t)")
        )


MODEL = """
far = far * reach
penalty = stiffness * young
pcdc model new
pcdc geometry create polygon (0,[-far]) ([far],[-far]) ([far],[far]) (0,[far]) as-layer 'outline'
pcdc geometry create polyline (0,0) ([reach],0) as-layer 'line'
pcdc mesh create from-layer 'outline' size [far/6] refine-layer 'line' size [size] distance [far] \\
    embed 'line' irregular smooth group 'rock'
pcdc element c-model mech-iso-e property density 2500 young [young] poisson-r [poisson]
# Before the peak joints take 4/3 h T^2 / P: it belongs to the fracture energy.
brittle = energy - 4/3 * size * tensile_strength**2 / penalty
pcdc face-joint c-model c-i-c-i property friction 30 cohesion [10*tensile_strength] \\
    tensile-strength [tensile_strength] gf1 [brittle] gf2 [50*energy] penalty-normal [penalty] range geometry 'line'
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk [fluid_bulk] viscosity [viscosity/1000] \\
    aperature-initial [aperture] aperature-minumum [0.5*aperture] range geometry 'line'
pcdc element initial stress-xx [-confinement] stress-yy [-confinement]
pcdc model option dynamic off
pcdc model option large-strain off
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
for low, high in ((-far, -far), (far, far)):
    pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y [low] [high]
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range x [far] [far]
pcdc node group 'well' set 'wet' range x 0 0 y 0 0
pcdc model solve elastic
pcdc node boundary hydra-c-f-b flow-rate [0.5*rate] range group 'well' set 'wet'
"""
LOADING = """
import numpy as np
from hpcdem.cases import kgd_solutions as closed_form
plane = young / (1 - poisson**2)
def exact(t):
    return closed_form.FORM
def state():
    joints = pcdc.numbers('flow-channel')
    every = pcdc.numbers('joint')
    at = np.searchsorted(every, joints)
    x = np.asarray(pcdc.values('joint', 'joint-position-x'))[at]
    order = np.argsort(x)
    opening = np.asarray(pcdc.values('flow-channel', 'aperture'))[order]
    state, damage = (np.asarray(pcdc.values('joint', name))[at][order] for name in ('state', 'damage'))
    gone = np.where(state == 3, 1.0, np.where(state == 2, damage, 0.0)) > TIP
    tip = x[order][gone].max() + 0.5 * size if gone.any() else 0.0
    well = float(np.asarray(pcdc.values('flow-node', 'pressure', group='well', set='wet'))[0])
    filled = np.asarray(pcdc.values('flow-channel', 'saturation'))[order] > 0.5
    front = float(x[order][filled].max()) + 0.5 * size
    return tip, float(1.5 * opening[0] - 0.5 * opening[1]), well - confinement, front, x[order], opening
pcdc history create 'pressure' flow-node value pressure mean range group 'well' set 'wet'
pcdc history create 'given' model value fluid-given
curve, first = [], pcdc.cycle
parts = PARTS
for part in range(parts):
    pcdc model solve hydraulic time [time/parts] dt [time/steps_at_most]
    length, opening, pressure, front, x, profile = state()
    t = (part + 1) * time / parts
    curve.append((t, float(length), opening, pressure))
    print('%.4g s: half length %.4g m (%.4g), opening %.4g um (%.4g), net pressure %.4g MPa (%.4g)' % (
        t, length, exact(t).length, 1e6*opening, 1e6*exact(t).opening, 1e-6*pressure, 1e-6*exact(t).pressure))
steps, length = pcdc.cycle - first, float(length)
late = curve[-2:]     # of a fracture that grows joint by joint
length_error = sum(l / exact(t).length - 1 for t, l, o, p in late) / len(late)
opening_error = sum(o / exact(t).opening - 1 for t, l, o, p in late) / len(late)
pressure_error = sum(p / exact(t).pressure - 1 for t, l, o, p in late) / len(late)
balance = pcdc.fluid['relative']
work = pcdc.fluid_energies
energy_error = work['relative']
print('energy of one wing: pumped in %.4g J/m, lost by flow %.4g, stored in rock and joints %.4g, fracture %.4g' % (
    work['pumped'], work['viscous'], work['strain'] + work['joints'], work['fracture']))
print('errors: length %+.2f %%, opening %+.2f %%, net pressure %+.2f %%; %d implicit steps' % (
    100*length_error, 100*opening_error, 100*pressure_error, steps))
pcdc output vtk 'hydraulic-fracture'
last = exact(time)
line = [(a, 1e6 * last.opening * math.sqrt(max(0.0, 1 - (a/last.length)**2)))
        for a in np.linspace(0, last.length, 200).tolist()]
pcdc chart create 'hydraulic-fracture' x-label 'distance from the well (m)' y-label 'opening (um)'
pcdc chart add 'hydraulic-fracture' values [list(zip(x.tolist(), (1e6*profile).tolist()))] label 'model' style points
pcdc chart add 'hydraulic-fracture' values [line] label 'ellipse of the closed form'
pcdc chart export 'hydraulic-fracture' 'hydraulic-fracture.png'
grow = [(t, p / 1e6) for t, l, o, p in curve]
pcdc chart create 'injection' x-label 'time (s)' y-label 'net pressure at the well (MPa)'
pcdc chart add 'injection' values [grow] label 'model' style points
line = [(t, exact(t).pressure / 1e6) for t in np.linspace(0.05*time, time, 100).tolist()]
pcdc chart add 'injection' values [line] label 'closed form'
pcdc chart export 'injection' 'injection.png'
"""

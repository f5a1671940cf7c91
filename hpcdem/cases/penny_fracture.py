"""A penny-shaped hydraulic fracture driven from its middle, compared with its closed forms."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from pydantic import model_validator

from hpcdem.cases.base import Case, choice, quantity
from hpcdem.cases.kgd_solutions import resolution


@dataclass(frozen=True)
class Penny:
    """radius [m]: of the circle with the area that is damaged by 0.2 (toughness) or past its peak (viscosity); opening
    [m] in the middle; pressure [Pa, above the confinement] at half the radius, pressure_well: in the middle; *_error:
    relative, to the closed form, means over the last fifth of the time; balance: closing error of the fluid budget;
    energy_error: closing error of the energy budget over the energy pumped in; curve: (time [s], radius, opening,
    pressure) at twenty times; steps: number of implicit steps.
    """

    radius: float
    opening: float
    pressure: float
    pressure_well: float
    radius_error: float
    opening_error: float
    pressure_error: float
    balance: float
    energy_error: float
    steps: int
    curve: list[tuple[float, float, float, float]] = field(repr=False)


class PennyFracture(Case):
    """Fluid is pumped into the middle of a circular fracture, which grows in a plane of joints (a sector is
    modelled).
    """

    name: ClassVar[str] = "penny-fracture"
    title: ClassVar[str] = "Penny-shaped hydraulic fracture"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Penny

    regime: Literal["toughness", "viscosity"] = choice(
        "toughness", "closed form and tip: toughness-dominated (low viscosity), or viscosity-dominated (low toughness)"
    )
    young: float = quantity(30e9, "Pa", "Young's modulus of the rock", gt=0)
    poisson: float = quantity(0.25, "1", "Poisson's ratio of the rock", ge=0, lt=0.5)
    energy: float = quantity(100.0, "N/m", "fracture energy", gt=0)
    tensile_strength: float = quantity(5e6, "Pa", "tensile strength", gt=0)
    confinement: float = quantity(0.25e6, "Pa", "stress that presses on the plane", ge=0)
    rate: float = quantity(1e-3, "m3/s", "pumped into the whole fracture", gt=0)
    viscosity: float = quantity(1e-5, "Pa s", "dynamic viscosity of the fluid", gt=0)
    fluid_bulk: float = quantity(1e11, "Pa", "bulk modulus of the fluid", gt=0)
    aperture: float = quantity(2e-7, "m", "hydraulic aperture of closed joints", gt=0)
    time: float = quantity(1.0, "s", "duration of pumping", gt=0)
    reach: float = quantity(2.0, "m", "radius of the fine part of the mesh", gt=0)
    far: float = quantity(12.5, "1", "size of the model over reach", ge=3)
    size: float = quantity(0.1, "m", "distance of the circles of nodes", gt=0)
    turn: float = quantity(20.0, "degrees", "angle of the sector", gt=0, le=60)
    parts: int = quantity(2, "1", "elements around it", ge=1, le=12)
    stiffness: float = quantity(100.0, "1", "penalty of the joints over Young's modulus", ge=10)
    steps_at_most: float = quantity(100.0, "1", "largest time step, as a fraction of the time", ge=20)

    @model_validator(mode="after")
    def _fits(self) -> PennyFracture:
        if self.size > 0.2 * self.reach:
            raise ValueError(f"size is {self.size:g}, expected at most a fifth of reach, {0.2 * self.reach:g} m")
        plane = self.young / (1.0 - self.poisson**2)
        r = resolution(plane, self.energy, self.tensile_strength, self.confinement, self.size)
        if r > 2.0 and self.regime == "toughness":
            raise ValueError(
                f"size is {self.size:g}, expected at most {2.0 * self.size / r:.3g} m: longer joints open in jumps"
            )
        return self

    def model(self) -> str:
        return MODEL

    def loading(self) -> str:
        tough = self.regime == "toughness"
        form = "tough(plane, energy, rate, t)" if tough else "viscous(plane, viscosity, rate, t)"
        return LOADING.replace("TIP", "0.2" if tough else "0.0").replace("FORM", form)


MODEL = """
from hpcdem.cases import penny_solutions as closed_form
far = far * reach
penalty = stiffness * young
pcdc model new dim 3
closed_form.write_sector('penny-sector.vtu', size, reach, far, turn, parts, 1.35)
pcdc mesh import 'penny-sector.vtu'
pcdc element c-model mech-iso-e property density 2500 young [young] poisson-r [poisson]
# Before the peak joints take 4/3 h T^2 / P: it belongs to the fracture energy.
brittle = energy - 4/3 * size * tensile_strength**2 / penalty
pcdc face-joint c-model c-i-c-i property friction 30 cohesion [10*tensile_strength] \\
    tensile-strength [tensile_strength] gf1 [brittle] gf2 [50*energy] penalty-normal [penalty] range z 0 0
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk [fluid_bulk] viscosity [viscosity/1000] \\
    aperature-initial [aperture] aperature-minumum [0.5*aperture] range z 0 0
pcdc element initial stress-xx [-confinement] stress-yy [-confinement] stress-zz [-confinement]
pcdc model option dynamic off
pcdc model option large-strain off
# Both sides of the sector are planes of symmetry.
normal = Vector(-math.sin(math.radians(turn)), math.cos(math.radians(turn)), 0)
pcdc geometry create plane (0,0,0) [normal] as-layer 'side'
pcdc node boundary mech-m-b-c type 3 [normal] range geometry 'side'
pcdc node boundary mech-m-b-c type 0 (0,0,0) range x 0 0 y 0 0
pcdc node boundary mech-vel-b-c velocity-y 0 range y 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range x 0 0 y 0 0
pcdc geometry create cylinder (0,0,[-far]) (0,0,[far]) [far] as-layer 'outside'
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 velocity-z 0 range geometry 'outside'
pcdc node group 'well' set 'wet' range x 0 0 y 0 0 z 0 0
pcdc model solve elastic
pcdc node boundary hydra-c-f-b flow-rate [rate*turn/360] range group 'well' set 'wet'
"""
LOADING = """
import numpy as np
plane = young / (1 - poisson**2)
def exact(t):
    return closed_form.FORM
print('toughness number %.3g' % closed_form.number(plane, energy, viscosity, rate, time))
joints = np.asarray(pcdc.numbers('flow-channel'))
at = np.searchsorted(np.asarray(pcdc.numbers('joint')), joints)
def of_joints(name):
    return np.nan_to_num(np.asarray(pcdc.values('joint', name))[at])
area = of_joints('joint-area')
away = np.hypot(of_joints('joint-position-x'), of_joints('joint-position-y'))
nodes = np.asarray(pcdc.numbers('flow-node'))
node_away = np.hypot(*(np.asarray(pcdc.values('node', 'position-' + axis))[nodes] for axis in 'xy'))
def state():
    state, damage = of_joints('state'), of_joints('damage')
    gone = np.where(state == 3, 1.0, np.where(state == 2, damage, 0.0)) > TIP
    radius = math.sqrt(2 * float(area[gone].sum()) / math.radians(turn))
    opening = np.asarray(pcdc.values('flow-channel', 'aperture'))
    near = np.argsort(away)[:3*parts]
    middle = float(np.polyfit(away[near]**2, opening[near], 1)[1])
    pressure = np.asarray(pcdc.values('flow-node', 'pressure')) - confinement
    half = float(pressure[abs(node_away - 0.5*radius) < 0.6*size].mean()) if gone.any() else 0.0
    return radius, middle, half, float(pressure[np.argmin(node_away)]), opening
pcdc history create 'pressure' flow-node value pressure mean range group 'well' set 'wet'
pcdc history create 'given' model value fluid-given
curve, first, tail = [], pcdc.cycle, 20
for part in range(tail):
    pcdc model solve hydraulic time [time/tail] dt [time/steps_at_most]
    radius, opening, pressure, pressure_well, profile = state()
    t = (part + 1) * time / tail
    curve.append((t, radius, opening, pressure))
    print('%.4g s: radius %.4g m (%.4g), opening %.4g um (%.4g), net pressure %.4g MPa (%.4g)' % (
        t, radius, exact(t).length, 1e6*opening, 1e6*exact(t).opening, 1e-6*pressure, 1e-6*exact(t).pressure))
steps, late = pcdc.cycle - first, curve[-4:]    # of a fracture that grows circle by circle
radius_error = sum(r / exact(t).length - 1 for t, r, o, p in late) / len(late)
opening_error = sum(o / exact(t).opening - 1 for t, r, o, p in late) / len(late)
pressure_error = sum(p / exact(t).pressure - 1 for t, r, o, p in late) / len(late)
balance = pcdc.fluid['relative']
work = pcdc.fluid_energies
energy_error = work['relative']
print('energy of the sector: pumped in %.4g J, lost by flow %.4g, stored in rock and joints %.4g, fracture %.4g' % (
    work['pumped'], work['viscous'], work['strain'] + work['joints'], work['fracture']))
print('errors: radius %+.2f %%, opening %+.2f %%, net pressure %+.2f %%; %d implicit steps' % (
    100*radius_error, 100*opening_error, 100*pressure_error, steps))
pcdc output vtk 'penny-fracture'
last = exact(time)
line = [(a, 1e6 * last.opening * math.sqrt(max(0.0, 1 - (a/last.length)**2)))
        for a in np.linspace(0, last.length, 200).tolist()]
inside = away < 1.3 * last.length
pcdc chart create 'penny-fracture' x-label 'distance from the well (m)' y-label 'opening (um)'
pcdc chart add 'penny-fracture' values [list(zip(away[inside].tolist(), (1e6*profile[inside]).tolist()))] \\
    label 'model' style points
pcdc chart add 'penny-fracture' values [line] label 'ellipsoid of the closed form'
pcdc chart export 'penny-fracture' 'penny-fracture.png'
pcdc chart create 'penny-radius' x-label 'time (s)' y-label 'radius (m)'
pcdc chart add 'penny-radius' values [[(t, r) for t, r, o, p in curve]] label 'model' style points
line = [(t, exact(t).length) for t in np.linspace(0.01*time, time, 100).tolist()]
pcdc chart add 'penny-radius' values [line] label 'closed form'
pcdc chart export 'penny-radius' 'penny-radius.png'
"""

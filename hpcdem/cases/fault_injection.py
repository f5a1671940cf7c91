"""Fluid that is pumped into a fault under shear stress until it slips."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import Case, quantity


@dataclass(frozen=True)
class Slipping:
    """Result of the case.

    normal, shear: initial stress on the fault, compression and shear, closed form [Pa]; found_normal, found_shear:
    means over its joints [Pa]; onset: well pressure when the joint next to it yields [Pa]; exact_onset: sigma_n - (tau
    - c) / mu [Pa]; slip: in the middle at the end [m]; exact_slip: slip of a crack of this length in a plane with the
    final pressure everywhere [m]; pressure: mean along the fault at the end [Pa]; injected: volume [m2]; seconds: flow
    time until the onset [s]; curve: (time [s], well pressure [Pa], injected [m2], slip in the middle [m]); account:
    closing error of the fluid budget.
    """

    normal: float
    shear: float
    found_normal: float
    found_shear: float
    onset: float
    exact_onset: float
    slip: float
    exact_slip: float
    pressure: float
    injected: float
    seconds: float
    curve: list[tuple[float, float, float, float]] = field(repr=False)
    account: float


class FaultInjection(Case):
    """A closed, locked fault in stressed rock: injection into its middle raises the pressure until it slips by
    Coulomb's law.
    """

    name: ClassVar[str] = "fault-injection"
    title: ClassVar[str] = "Slip of a fault by fluid injection"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Slipping

    half: float = quantity(20.0, "m", "half of the length of the fault", gt=0)
    angle: float = quantity(30.0, "degrees", "from the x axis to the fault", gt=0, lt=90)
    reach: float = quantity(6.0, "1", "from the middle to the sides of the model, over half", ge=2)
    size: float = quantity(1.0, "m", "edges of the elements at the fault", gt=0)
    coarse: float = quantity(12.0, "m", "edges of the elements at the sides", gt=0)
    stress_xx: float = quantity(-20e6, "Pa", "horizontal stress, compression negative", lt=0)
    stress_yy: float = quantity(-10e6, "Pa", "vertical stress", lt=0)
    density: float = quantity(2700.0, "kg/m3", "density of the rock", gt=0)
    young: float = quantity(30e9, "Pa", "Young's modulus", gt=0)
    poisson: float = quantity(0.25, "1", "Poisson's ratio", ge=0, lt=0.5)
    friction: float = quantity(35.0, "degrees", "friction angle of the fault", gt=0, lt=90)
    cohesion: float = quantity(1e3, "Pa", "cohesion of the fault", gt=0)
    dilation: float = quantity(0.0, "degrees", "by the tangent of this angle times the slip the aperture grows", ge=0,
                               le=80)  # fmt: skip
    aperture: float = quantity(1e-4, "m", "hydraulic aperture of the fault", gt=0)
    viscosity: float = quantity(1e-3, "Pa s", "dynamic viscosity of the fluid", gt=0)
    fluid_density: float = quantity(1000.0, "kg/m3", "density of the fluid", gt=0)
    fluid_bulk: float = quantity(2.2e8, "Pa", "bulk modulus of the fluid; that of water with some gas in it", gt=0)
    rate: float = quantity(5e-5, "m2/s", "volume that is pumped in", gt=0)
    limit: float = quantity(8e6, "Pa", "pressure above which the rate is reduced", gt=0)
    duration: float = quantity(10.0, "s", "duration of pumping", gt=0)
    shut_in: float = quantity(2.0, "s", "duration of shut-in afterwards", gt=0)
    steps: int = quantity(30000, "1", "steps of the model in all that time", ge=1000)

    @model_validator(mode="after")
    def _fits(self) -> FaultInjection:
        if self.size > 0.25 * self.half:
            raise ValueError(f"size is {self.size:g}, expected at most a quarter of half, {0.25 * self.half:g} m")
        if self.coarse < self.size:
            raise ValueError(f"coarse is {self.coarse:g}, expected at least size, {self.size:g} m")
        turn = 2.0 * math.radians(self.angle)
        mean, half = 0.5 * (self.stress_xx + self.stress_yy), 0.5 * (self.stress_xx - self.stress_yy)
        normal, shear = -(mean - half * math.cos(turn)), abs(half * math.sin(turn))
        if shear >= self.cohesion + normal * math.tan(math.radians(self.friction)):
            raise ValueError("stress_xx, stress_yy, angle, friction: the fault slips without fluid")
        least = normal - (shear - self.cohesion) / math.tan(math.radians(self.friction))
        if not least < self.limit < normal:
            raise ValueError(
                f"limit is {self.limit:g}, expected more than the pressure {least:.4g} at which the fault slips, and "
                f"less than {normal:.4g}, which opens it"
            )
        return self

    def model(self) -> str:
        return FAULT

    def loading(self) -> str:
        return PUMPED


FAULT = """
import numpy as np
side, turn = reach * half, math.radians(angle)
tip = Vector(half * math.cos(turn), half * math.sin(turn))

pcdc model new
# Corners in the middle of the sides: points of the mesh that can be held.
pcdc geometry create polygon ([-side],[-side]) (0,[-side]) ([side],[-side]) ([side],0) ([side],[side]) \\
    (0,[side]) ([-side],[side]) ([-side],0) as-layer 'outline'
pcdc geometry create polyline ([-tip[0]],[-tip[1]]) (0,0) ([tip[0]],[tip[1]]) as-layer 'fault'
pcdc mesh create from-layer 'outline' size [coarse] refine-layer 'fault' size [size] distance [0.8*side] \\
    embed 'fault' group 'rock'
pcdc element c-model mech-iso-e property density [density] young [young] poisson-r [poisson] damp-factor 0.3
# The fault: closed, with friction and hardly any cohesion. It is strong until it has closed, and softens so slowly that
# it never parts: friction is what counts.
pcdc face-joint c-model c-i-c-i property friction [friction] cohesion 1e9 tensile-strength 1e9 gf1 1e7 gf2 1e7 \\
    penalty-normal [10*young] penalty-shear [100*young] penalty-overlay [100*young] range geometry 'fault'
pcdc element-face c-model contact-m-c property friction [friction] penalty-normal [10*young] penalty-shear [10*young]
pcdc face-joint c-model hydr-p-m property fluid-density [fluid_density] fluid-bulk [fluid_bulk] \\
    viscosity [viscosity/fluid_density] aperature-initial [aperture] aperature-minumum [0.1*aperture] \\
    shear-dilation [dilation] range geometry 'fault'

# The stress that is there, held by the same stress on the sides; the fault closes.
pcdc element initial stress-xx [stress_xx] stress-yy [stress_yy] stress-zz [poisson*(stress_xx + stress_yy)]
pcdc element-face boundary m-s-b-c stress-xx [stress_xx] stress-yy [stress_yy] range geometry 'outline'
near = 1e-6 * side
pcdc node boundary mech-m-b-c type 2 (1,0) range x [-near] [near] y [-side - near] [-side + near]
pcdc node boundary mech-m-b-c type 2 (1,0) range x [-near] [near] y [side - near] [side + near]
pcdc node boundary mech-m-b-c type 2 (0,1) range x [-side - near] [-side + near] y [-near] [near]
pcdc node boundary mech-m-b-c type 2 (0,1) range x [side - near] [side + near] y [-near] [near]
pcdc model option dynamic off
pcdc model option hydraulic off
pcdc model solve ratio 1e-7
pcdc node reset displacement
pcdc face-joint property cohesion [cohesion] tensile-strength [cohesion] gf1 [cohesion] gf2 [cohesion] \\
    range geometry 'fault'
pcdc model solve ratio 1e-7
pcdc model option hydraulic on
pcdc flow-node initial saturation 1
"""
PUMPED = """
# Compression and shear on the fault, and the pressure at which Coulomb's law lets it slip.
mean, half_way = 0.5 * (stress_xx + stress_yy), 0.5 * (stress_xx - stress_yy)
normal, shear = -(mean - half_way * math.cos(2 * turn)), abs(half_way * math.sin(2 * turn))
mu = math.tan(math.radians(friction))
exact_onset = normal - (shear - cohesion) / mu
found_normal = -float(pcdc.values('joint', 'normal-stress', geometry='fault').mean())
found_shear = float(np.abs(pcdc.values('joint', 'shear-stress', geometry='fault')).mean())

pcdc well create 'well' range x [-near] [near] y [-near] [near]
pcdc well stage 'well' rate [rate] limit [limit] time [duration]
pcdc well stage 'well' shut-in
pcdc model time-step hydraulic [(duration + shut_in)/steps]
every = max(1, steps // 3000)
# Joints beside the well; slip in the middle is the mean of both.
beside = pcdc.numbers('joint', geometry='fault')
places = np.column_stack([pcdc.values('joint', 'joint-position-x', geometry='fault'),
                          pcdc.values('joint', 'joint-position-y', geometry='fault')])
nearest = beside[np.argsort(np.hypot(*places.T), kind='stable')[:2]]
pcdc history create 'time' model value flow-time every [every]
pcdc history create 'pressure' well value pressure well 'well' every [every]
pcdc history create 'injected' well value injected well 'well' every [every]
for k in range(2):
    pcdc history create 'state [k]' joint id [int(nearest[k])] value state every [every]
    pcdc history create 'slip [k]' joint id [int(nearest[k])] value slip every [every]
pcdc output vtk 'fault-injection' every [max(1, steps // 20)]
pcdc model step [steps]
pcdc model step [steps // 5]                     # comes to rest
def recorded(name):
    return pcdc.history(name)[:, 2]
slips = 0.5 * np.abs(recorded('slip 0') + recorded('slip 1'))
curve = list(zip(recorded('time').tolist(), recorded('pressure').tolist(), recorded('injected').tolist(),
                 slips.tolist()))
yielded = np.flatnonzero(np.maximum(recorded('state 0'), recorded('state 1')) >= 2)
onset = curve[yielded[0]][1] if len(yielded) else math.nan
seconds = curve[yielded[0]][0] if len(yielded) else math.nan

# At the end: a crack of length 2 a in an infinite plane whose shear stress drops from tau to mu (sigma_n - p) slips by
# 4 (1 - nu^2) / E (tau - mu (sigma_n - p)) sqrt(a^2 - x^2).
pressure = float(pcdc.values('flow-node', 'pressure').mean())
drop = shear - mu * (normal - pressure)
along = places @ np.array([math.cos(turn), math.sin(turn)])
final = np.abs(pcdc.values('joint', 'slip', geometry='fault'))
def closed_form(s):
    return 4 * (1 - poisson**2) / young * max(drop, 0.0) * math.sqrt(max(half**2 - s**2, 0.0))
slip, exact_slip = float(final[np.argsort(np.abs(along))[:2]].mean()), closed_form(0.5 * size)
injected, account = curve[-1][2], pcdc.fluid['relative']
print('stress on the fault: normal %.5g (closed form %.5g), shear %.5g (%.5g) MPa' % (
    1e-6*found_normal, 1e-6*normal, 1e-6*found_shear, 1e-6*shear))
if len(yielded):
    print('the fault slips beside the well at %.4g MPa after %.3g s; closed form %.4g MPa' % (
        1e-6*onset, seconds, 1e-6*exact_onset))
else:
    print('the fault does not slip: %.4g MPa in the well, needed %.4g MPa' % (1e-6*curve[-1][1], 1e-6*exact_onset))
print('slip in the middle at the end %.4g mm with %.4g MPa; closed form %.4g mm' % (
    1e3*slip, 1e-6*pressure, 1e3*exact_slip))
print('injected %.4g m2' % injected)
pcdc output vtk 'fault-injection'
pcdc chart create 'fault-injection' x-label 'time (s)' y-label 'pressure in the well (MPa)'
pcdc chart add 'fault-injection' values [[(t, 1e-6 * p) for t, p, _, _ in curve]] label 'well'
line = [(0.0, 1e-6 * exact_onset), (curve[-1][0], 1e-6 * exact_onset)]
pcdc chart add 'fault-injection' values [line] label 'Coulomb'
if len(yielded):
    pcdc chart add 'fault-injection' values [[(seconds, 1e-6 * onset)]] label 'first joint yields' style points
pcdc chart export 'fault-injection' 'fault-injection.png' fluid pressure
pcdc chart create 'volume' x-label 'time (s)' y-label 'slip (mm), injected volume (1e-4 m2)'
pcdc chart add 'volume' values [[(t, 1e3 * u) for t, _, _, u in curve]] label 'slip in the middle'
pcdc chart add 'volume' values [[(t, 1e4 * v) for t, _, v, _ in curve]] label 'injected'
pcdc chart export 'volume' 'fault-curves.png'
pcdc chart create 'profile' x-label 'along the fault (m)' y-label 'slip (mm)'
pcdc chart add 'profile' values [sorted(zip(along.tolist(), (1e3 * final).tolist()))] label 'model' style points
pcdc chart add 'profile' values [[(half * k / 50, 1e3 * closed_form(half * k / 50)) for k in range(-50, 51)]] \\
    label 'crack with the pressure of the end'
pcdc chart export 'profile' 'fault-profile.png'
"""

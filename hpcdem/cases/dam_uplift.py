"""Water under a concrete dam on jointed rock: uplift, with and without a grout curtain and a drain."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import quantity
from hpcdem.cases.water import CHANNELS, ROCK, STEADY, Water


@dataclass(frozen=True)
class Uplift:
    """uplift [N/m]: force of the water on the base; linear [N/m]: that of the line between both heads; exact [N/m]: of
    the closed form, whose curtain is impermeable and which has no drain; discharge [m2/s]: what comes out below
    the dam, drained [m2/s]: in the drain; exact_discharge [m2/s]: of the closed form, with the permeability of a
    lattice; error: largest difference of the pressure on the base from the closed form, over that of the head;
    diagram: (x [m], pressure [Pa], closed form [Pa]) along the base; safety: against sliding of a triangular dam;
    imbalance: inflow minus outflow, over inflow; account: closing error of the fluid budget."""

    uplift: float
    linear: float
    exact: float
    discharge: float
    drained: float
    exact_discharge: float
    error: float
    diagram: list[tuple[float, float, float]] = field(repr=False)
    safety: float
    imbalance: float
    account: float


class DamUplift(Water):
    """A triangular dam on jointed rock with water behind it: pressure along the base, uplift, and safety
    against sliding.
    """

    name: ClassVar[str] = "dam-uplift"
    title: ClassVar[str] = "Uplift under a concrete dam on jointed rock"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Uplift

    head: float = quantity(40.0, "m", "level of the water over the base, and height of the dam", gt=0)
    base: float = quantity(32.0, "m", "width of the base", gt=0)
    depth: float = quantity(32.0, "m", "depth of the jointed rock", gt=0)
    aside: float = quantity(48.0, "m", "distance from the dam to the sides of the model", gt=0)
    size: float = quantity(2.0, "m", "edges of the elements", gt=0)
    curtain: float = quantity(0.0, "m", "depth of a grout curtain, 0: none", ge=0)
    curtain_at: float = quantity(0.1, "1", "where it is, from the heel on, over base", ge=0, le=1)
    tightness: float = quantity(0.1, "1", "hydraulic aperture of grouted joints over aperture", gt=0, le=1)
    drain: float = quantity(0.0, "m", "depth of a row of drains, which are open to the air at the base, 0: none", ge=0)
    drain_at: float = quantity(0.25, "1", "where it is, from the heel on, over base", gt=0, lt=1)
    concrete: float = quantity(2400.0, "kg/m3", "density of the dam", gt=0)
    friction: float = quantity(45.0, "degrees", "friction angle of its base", gt=0, lt=90)
    gravity: float = quantity(9.81, "m/s2", "acceleration of gravity, downwards", gt=0)
    aperture: float = quantity(1e-4, "m", "hydraulic aperture of the joints", gt=0)

    @model_validator(mode="after")
    def _fits(self) -> DamUplift:
        if self.size > 0.125 * self.base:
            raise ValueError(f"size is {self.size:g}, expected at most an eighth of base, {0.125 * self.base:g} m")
        for name in ("curtain", "drain"):
            if getattr(self, name) > 0.9 * self.depth:
                most = 0.9 * self.depth
                raise ValueError(f"{name} is {getattr(self, name):g}, expected at most 0.9 of depth, {most:g} m")
        if 0.0 < self.curtain < 2.0 * self.size:
            raise ValueError(f"curtain is {self.curtain:g}, expected 0 or at least two sizes, {2.0 * self.size:g} m")
        return self

    def model(self) -> str:
        return FOUNDATION + ROCK + CHANNELS.replace("RANGE", "\\\n    range face-of 'rock' set 'body'") + GROUT + HELD

    def loading(self) -> str:
        return STEADY + BASE


FOUNDATION = """
# x = 0 is the heel, y = 0 the base; water stands on the left.
pcdc model new
corners = [Vector(-aside, -depth), Vector(base + aside, -depth), Vector(base + aside, 0), Vector(base, 0),
           Vector(0, head), Vector(0, 0), Vector(-aside, 0)]
pcdc geometry create polygon [corners] as-layer 'outline'
pcdc geometry create polygon (0,0) ([base],0) (0,[head]) as-layer 'dam'
if curtain > 0:
    a, b = curtain_at * base - 0.5 * size, curtain_at * base + 0.5 * size
    pcdc geometry create polyline ([a],0) ([a],[-curtain]) ([b],[-curtain]) ([b],0) as-layer 'grout'
if drain > 0:
    pcdc geometry create polyline ([drain_at*base],0) ([drain_at*base],[-drain]) as-layer 'drain'
if curtain > 0 and drain > 0:
    pcdc mesh create from-layer 'outline' size [size] group 'rock' set 'body' region 'dam' embed 'grout' embed 'drain'
elif curtain > 0:
    pcdc mesh create from-layer 'outline' size [size] group 'rock' set 'body' region 'dam' embed 'grout'
elif drain > 0:
    pcdc mesh create from-layer 'outline' size [size] group 'rock' set 'body' region 'dam' embed 'drain'
else:
    pcdc mesh create from-layer 'outline' size [size] group 'rock' set 'body' region 'dam'
pcdc model gravity (0,[-gravity])
"""
GROUT = """
near = 1e-6 * base
if curtain > 0:
    pcdc element group 'grouted' set 'grout' range x [a - near] [b + near] y [-curtain - near] 0
    pcdc face-joint c-model hydr-p-m property fluid-density [fluid_density] fluid-bulk 2.2e9 \\
        viscosity [viscosity/fluid_density] aperature-initial [tightness*aperture] \\
        aperature-minumum [0.01*tightness*aperture] range face-of 'grouted' set 'grout'
"""
HELD = """
weight = fluid_density * gravity
pcdc flow-node initial pressure [0.5*weight*head]
pcdc node group 'in' set 'wet' range y [-near] [near] x [-aside - near] [near]
pcdc node group 'out' set 'wet' range y [-near] [near] x [base - near] [base + aside + near]
pcdc node group 'base' set 'under' range y [-near] [near] x [-near] [base + near]
pcdc node boundary hydra-c-f-b pressure [weight*head] range group 'in' set 'wet'
pcdc node boundary hydra-c-f-b pressure 0 range group 'out' set 'wet'
if drain > 0:                                    # water stands in the drain up to the base
    pcdc node group 'drain' set 'wells' range geometry 'drain'
    pcdc node group 'out' set 'wet' range group 'drain' set 'wells'
    pcdc node boundary hydra-c-f-b flow-surface 0 range group 'drain' set 'wells'
"""
BASE = """
# Along the base; what flows into the drain is counted with what goes out.
under = np.isin(nodes, pcdc.numbers('node', group='base', set='under'))
along = np.argsort(x[under])
s, found = x[under][along], pressure[under][along]
drained = 0.0
if drain > 0:
    drained = -float(pcdc.values('flow-node', 'inflow', group='drain', set='wells').sum())
discharge = outflow - drained

# Conformal: z -> sqrt(tanh(pi z / (2 T))**2 + tan(pi c / (2 T))**2) makes of the layer of depth T, less a curtain of
# depth c at z = 0, a half plane in which heads are held from -U to u1 and from u2 to U, U = 1 / cos(pi c / (2 T)).
turn = 0.5 * math.pi / depth
middle, slit = curtain_at * base, math.tan(turn * curtain)
def plane(at):
    t = np.tanh(turn * (np.asarray(at) - middle))
    return np.where(t < 0.0, -1.0, 1.0) * np.sqrt(t**2 + slit**2)
u1, u2, far = float(plane(0.0)), float(plane(base)), 1.0 / math.cos(turn * curtain)
if curtain_at == 0.0:
    u1 = -slit                                   # the heel is the upstream side of the curtain
theta = math.pi * ((np.arange(20000) + 0.5) / 20000 - 0.5)
def through(u):
    return 0.5 * (u1 + u2) + 0.5 * (u2 - u1) * np.sin(u)
part = np.cumsum(1.0 / np.sqrt(far**2 - through(theta)**2))
def closed_form(at):
    return weight * head * (1.0 - np.interp(plane(at), through(theta), part / part[-1]))
outside = 0.5 * (u2 + far) + 0.5 * (far - u2) * np.sin(theta)
ratio = float((1.0 / np.sqrt((outside - u1) * (outside + far))).sum() / part[-1])
# On both sides of a curtain the pressure is not the same: its nodes are left out.
aside_of_it = np.abs(s - middle) > 0.75 * size if curtain > 0 else np.ones(len(s), bool)
exact_at = closed_form(s)
error = float(np.abs(found - exact_at)[aside_of_it].max() / (weight * head))
diagram = list(zip(s.tolist(), found.tolist(), exact_at.tolist()))
def force(values, at):
    return float((0.5 * (values[1:] + values[:-1]) * np.diff(at)).sum())
fine = np.linspace(0.0, base, 4001)
uplift, exact, linear = force(found, s), force(closed_form(fine), fine), 0.5 * weight * head * base
conductivity = math.sqrt(3) * aperture**3 / (12 * size) * weight / viscosity
exact_discharge = conductivity * head * ratio
carried = 0.5 * concrete * gravity * base * head - uplift
safety = carried * math.tan(math.radians(friction)) / (0.5 * weight * head**2)
print('uplift %.5g MN/m; linear %.5g, closed form %.5g MN/m%s' % (
    1e-6*uplift, 1e-6*linear, 1e-6*exact, ' without the drain' if drain > 0 else ''))
print('pressure on the base: at most %.3g %% of the head from the closed form' % (100 * error))
print('below the dam %.4g m2/s, in the drain %.4g m2/s; closed form %.4g m2/s' % (
    discharge, drained, exact_discharge))
print('safety against sliding %.3f' % safety)
pcdc output vtk 'dam-uplift'
pcdc chart create 'dam-uplift' x-label 'x along the base (m)' y-label 'uplift pressure (kPa)'
pcdc chart add 'dam-uplift' values [[(a, 1e-3 * p) for a, p, _ in diagram]] label 'jointed rock' style points
pcdc chart add 'dam-uplift' values [list(zip(fine.tolist(), (1e-3 * closed_form(fine)).tolist()))] label 'closed form'
pcdc chart add 'dam-uplift' values [[(0.0, 1e-3 * weight * head), (base, 0.0)]] label 'linear'
pcdc chart export 'dam-uplift' 'dam-uplift.png' fluid pressure
"""

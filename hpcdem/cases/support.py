"""A tunnel in yielding rock, supported by bolts and a shell of shotcrete."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from pydantic import model_validator

from hpcdem.cases.base import Case, choice, quantity
from hpcdem.cases.rock import Dimensions
from hpcdem.cases.tunnel import MESH, OUTLINE, ROUND, STRESSED


@dataclass(frozen=True)
class Supported:
    """convergence [m]: mean displacement of the wall towards the centre, at_support: when the bolts were installed;
    crown [m]: displacement of the crown into the tunnel; plastic_radius [m]: of a circle with the area of the tunnel
    and of the rock that has yielded; axial_force [N]: largest of a bolt, tension positive; yielded, broken: elements of
    bolts; slipped: nodes of bolts whose grout has slipped; thrust [N/m]: largest axial force of the liner, tension
    positive; moment [N m/m]: largest of the liner; hinges: elements of the liner that have yielded; ratio: unbalanced
    forces over all at the end.
    """

    convergence: float
    at_support: float
    crown: float
    plastic_radius: float
    axial_force: float
    yielded: int
    broken: int
    slipped: int
    thrust: float
    moment: float
    hinges: int
    ratio: float


class Support(Case):
    """A circular tunnel in Mohr-Coulomb rock under stress. Bolts and a liner are installed after part of the stress is
    released.
    """

    name: ClassVar[str] = "support"
    title: ClassVar[str] = "A tunnel in yielding rock, supported by bolts and shotcrete"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Supported

    dim: Dimensions = choice(2, "dimensions of space: plane strain, or a slice of bolt_spacing with one ring of bolts")
    elements: Literal["tri", "quad"] = choice("quad", "triangles or quads; in three dimensions they are tetrahedra")
    plates: bool = choice(True, "face plates, which tie the heads of the bolts to the wall")
    radius: float = quantity(3.0, "m", "radius of the tunnel", gt=0)
    reach: float = quantity(10.0, "1", "from the centre to the sides of the model, over radius", ge=4)
    size: float = quantity(0.25, "m", "edges of the elements at the tunnel", gt=0)
    coarse: float = quantity(4.0, "m", "edges of the elements at the sides of the model", gt=0)
    stress_xx: float = quantity(-10e6, "Pa", "horizontal stress before the excavation, compression negative", le=0)
    stress_yy: float = quantity(-10e6, "Pa", "vertical stress before the excavation", le=0)
    density: float = quantity(2500.0, "kg/m3", "density", gt=0)
    young: float = quantity(2e9, "Pa", "Young's modulus", gt=0)
    poisson: float = quantity(0.25, "1", "Poisson's ratio", ge=0, lt=0.5)
    cohesion: float = quantity(1e6, "Pa", "cohesion", gt=0)
    friction: float = quantity(30.0, "degrees", "friction angle", gt=0, lt=90)
    dilation: float = quantity(5.0, "degrees", "dilation angle", ge=0, lt=90)
    tensile_strength: float = quantity(0.2e6, "Pa", "tensile strength", ge=0)
    release: float = quantity(0.6, "1", "part of the stress at the wall that is released before the support is put in",
                              ge=0, le=1)  # fmt: skip
    stages: int = quantity(8000, "1", "steps in which the stress at the wall is released", ge=100)
    bolts: int = quantity(16, "1", "number of bolts, 0: none", ge=0, le=1000)
    around: float = quantity(360.0, "degrees", "angle around the crown over which bolts are spread", gt=0, le=360)
    bolt_length: float = quantity(4.0, "m", "length of a bolt", gt=0)
    bolt_spacing: float = quantity(1.0, "m", "from bolt to bolt along the tunnel", gt=0)
    bolt_diameter: float = quantity(0.025, "m", "diameter of a bolt", gt=0)
    bolt_young: float = quantity(200e9, "Pa", "Young's modulus of a bolt", gt=0)
    bolt_yield: float = quantity(250e3, "N", "axial force at which a bolt yields", gt=0)
    pretension: float = quantity(0.0, "N", "tension with which a bolt is put in", ge=0)
    bond_stiffness: float = quantity(1e9, "N/m/m", "stiffness of the grout along a bolt", gt=0)
    bond_cohesion: float = quantity(2e6, "Pa", "cohesion between grout and bolt, and grout and rock", gt=0)
    grout: float = quantity(0.0125, "m", "thickness of the grout", ge=0)
    liner: float = quantity(0.0, "m", "thickness of the shell of shotcrete, 0: none", ge=0)
    liner_young: float = quantity(15e9, "Pa", "Young's modulus of the shotcrete", gt=0)
    liner_poisson: float = quantity(0.2, "1", "Poisson's ratio of the shotcrete", ge=0, lt=0.5)
    liner_strength: float = quantity(25e6, "Pa", "compressive strength of the shotcrete", gt=0)
    liner_tension: float = quantity(2e6, "Pa", "tensile strength of the shotcrete", ge=0)
    liner_bond: float = quantity(20e9, "Pa/m", "stiffness of its bond to the rock, across and along", gt=0)

    @model_validator(mode="after")
    def _fits(self) -> Support:
        if self.size > 0.5 * self.radius:
            raise ValueError(f"size is {self.size:g}, expected at most half of radius, {0.5 * self.radius:g} m")
        if self.coarse < self.size:
            raise ValueError(f"coarse is {self.coarse:g}, expected at least size, {self.size:g} m")
        if self.dilation > self.friction:
            raise ValueError(f"dilation is {self.dilation:g}, expected at most friction, {self.friction:g} degrees")
        if self.radius + self.bolt_length > 0.9 * self.reach * self.radius:
            raise ValueError(f"bolt_length is {self.bolt_length:g}: bolts would end near the boundaries of the model")
        if self.stress_xx == 0.0 and self.stress_yy == 0.0:
            raise ValueError("stress_xx and stress_yy are both 0, expected a stress")
        if self.liner > 0.2 * self.radius:
            raise ValueError(f"liner is {self.liner:g}, expected at most a fifth of radius, {0.2 * self.radius:g} m")
        if self.dim == 3:
            for name in ("elements", "liner"):
                if name in self.model_fields_set:
                    raise ValueError(f"{name} requires dim 2")
            if self.size > 0.7 * self.bolt_spacing:
                raise ValueError(f"size is {self.size:g}, expected at most 0.7 of bolt_spacing in three dimensions")
        if self.pretension > self.bolt_yield:
            raise ValueError(f"pretension is {self.pretension:g}, expected at most bolt_yield, {self.bolt_yield:g} N")
        return self

    def model(self) -> str:
        if self.dim == 3:
            return SLICE + YIELDING + HELD
        mesh = MESH.replace("KIND", "type quad" if self.elements == "quad" else "irregular")
        return OUTLINE + ROUND + mesh + YIELDING + STRESSED

    def loading(self) -> str:
        text = (EXCAVATED + MEASURED).replace(" PLATE", " plate" if self.plates else "")
        if self.dim == 2:
            text = text.replace("LINED", LINED).replace("OF_LINERS", OF_LINERS).replace("TOLD", PRINTED)
            return text.replace("FLAT", "").replace("MIDDLE", "").replace("SPACED", " spacing [bolt_spacing]")
        for name in ("LINED", "OF_LINERS", "TOLD", "SPACED"):
            text = text.replace(name, "")
        text = text.replace("FLAT", ", 0)\n        middle = Vector(0, 0, 0.5*bolt_spacing").replace(
            "MIDDLE", " + middle"
        )
        text = text.replace("'area'", "'volume'").replace("math.fsum(flowed)", "math.fsum(flowed) / bolt_spacing")
        return text.replace(".png' plastic\n", ".png'\n") + PICTURE


SLICE = """
side = reach * radius

pcdc model new dim 3
# Corners in the middle of the sides: lines of the mesh that can be held.
pcdc geometry create polygon ([-side],[-side],0) (0,[-side],0) ([side],[-side],0) ([side],0,0) ([side],[side],0) \\
    (0,[side],0) ([-side],[side],0) ([-side],0,0) as-layer 'rim'
pcdc geometry create extrude layer 'rim' along (0,0,[bolt_spacing]) as-layer 'outline'
pcdc geometry create cylinder (0,0,0) (0,0,[bolt_spacing]) [radius] as-layer 'wall'
pcdc mesh create from-layer 'outline' size [coarse] refine-layer 'wall' size [size] distance [0.8*side] \\
    region 'wall' group 'core' group 'rock'
"""
HELD = """
# The stress that was there before, held by the same stress on the sides.
pcdc element initial stress-xx [stress_xx] stress-yy [stress_yy] stress-zz [poisson*(stress_xx + stress_yy)]
near = 1e-6 * side
for place in (-side, side):
    pcdc element-face boundary m-s-b-c stress-xx [stress_xx] range x [place - near] [place + near]
    pcdc element-face boundary m-s-b-c stress-yy [stress_yy] range y [place - near] [place + near]
    pcdc node boundary mech-vel-b-c velocity-y 0 range x [place - near] [place + near] y [-near] [near]
    pcdc node boundary mech-vel-b-c velocity-x 0 range y [place - near] [place + near] x [-near] [near]
# Halfway between rings of bolts nothing moves across.
for place in (0, bolt_spacing):
    pcdc node boundary mech-vel-b-c velocity-z 0 range z [place - near] [place + near]
"""
YIELDING = """\
pcdc element c-model mech-m-c property density [density] young [young] poisson-r [poisson] friction [friction] \\
    cohesion [cohesion] tensile [tensile_strength] dilation [dilation]
"""
LINED = """\
    if liner:
        pcdc liner create group 'shell' range geometry 'wall'
        pcdc liner c-model beam property density 2400 young [liner_young] poisson-r [liner_poisson] \\
            thickness [liner] tensile-strength [liner_tension] compressive-strength [liner_strength] \\
            normal-stiffness [liner_bond] shear-stiffness [liner_bond]
"""
EXCAVATED = """
import numpy as np
def into():
    # mean displacement of the wall towards the centre, and that of the crown
    ux, uy, px, py = (pcdc.values('node', name, geometry='wall')
                      for name in ('displacement-x', 'displacement-y', 'position-x', 'position-y'))
    px, py = px - ux, py - uy
    return float(np.nanmean(-(ux * px + uy * py) / radius)), -float(uy[np.hypot(px, py - radius).argmin()])

# In balance before; then what the core did to the rock dies down, and meanwhile the support is installed.
pcdc model option dynamic off
pcdc model option collision off
pcdc model solve ratio 1e-7 cycles 1000
pcdc node reset displacement
pcdc element c-model null relax [stages] range group 'core'
curve, done = [(0.0, 1.0)], 0
for part in sorted({k / 20 for k in range(21)} | {release}):
    goes_to = round(part * stages)
    if goes_to > done:
        pcdc model step [goes_to - done]
        curve.append((1e3 * into()[0], 1 - part))
    done = goes_to
    if part != release:
        continue
    at_support = into()[0]
    for k in range(bolts):
        angle = math.radians(90 + around * ((k + 0.5) / bolts - 0.5))
        direction = Vector(math.cos(angle), math.sin(angle)FLAT)
        head, tail = radius * directionMIDDLE, (radius + bolt_length) * directionMIDDLE
        pcdc bolt create polyline [head] [tail] length [size] PLATE group 'bolts'
    if bolts:
        pcdc bolt c-model mech-e-p property density 7850 young [bolt_young] diameter [bolt_diameter] \\
            t-y-f [bolt_yield] s-s-r-b [bond_stiffness] g-t [grout] c-r-g [bond_cohesion] c-g-b [bond_cohesion] \\
            pre-f [pretension]SPACED
LINEDpcdc model solve ratio 1e-6
"""
OF_LINERS = """\
if liner:
    along = pcdc.values('liner-element', 'axial-force')
    ends = [pcdc.values('liner-element', name) for name in ('moment-first', 'moment-last')]
    thrust, moment = float(along[np.abs(along).argmax()]), float(np.abs(ends).max())
    hinges = int((pcdc.values('liner-element', 'liner-state').astype(int) & 8 > 0).sum())
"""
PRINTED = """\
if liner:
    print('liner: largest axial force %.4g MN/m, moment %.4g kN m/m, %d elements have yielded'
          % (thrust/1e6, moment/1e3, hinges))
"""
MEASURED = """
pcdc output vtk 'support'
convergence, crown = into()
ratio = pcdc.ratio
flowed = pcdc.values('element', 'area')[pcdc.values('element', 'plastic-state') > 0]
plastic_radius = math.sqrt(radius**2 + math.fsum(flowed) / math.pi)
axial_force, yielded, broken, slipped = 0.0, 0, 0, 0
if bolts:
    force, state = pcdc.values('bolt-element', 'axial-force'), pcdc.values('bolt-element', 'bolt-state').astype(int)
    axial_force = float(force[np.abs(force).argmax()])
    yielded, broken = int((state & 15 > 0).sum()), int((state & 16 > 0).sum())
    slipped = int((pcdc.values('bolt-node', 'bond-state').astype(int) > 0).sum())
thrust, moment, hinges = 0.0, 0.0, 0
OF_LINERSprint('into the tunnel: mean %.4g mm (%.4g before the support), crown %.4g mm; plastic to %.4g m'
      % (1e3*convergence, 1e3*at_support, 1e3*crown, plastic_radius))
print('bolts: largest force %.4g kN, %d elements yielded, %d broken, grout slipped at %d nodes'
      % (axial_force/1e3, yielded, broken, slipped))
TOLDcurve.append((1e3 * convergence, 0.0))
pcdc chart create 'support' x-label 'convergence (mm)' y-label 'stress at the wall over that before'
pcdc chart add 'support' values [curve] label 'release'
pcdc chart add 'support' values [[(1e3 * at_support, 1 - release)]] label 'support put in' style points
pcdc chart export 'support' 'support.png' plastic
"""
PICTURE = """\
pcdc output image 'support' field 'displacement' eye '1,-0.6,1.5'
"""

"""Brazilian test: a disc of rock pressed across its diameter, which splits in tension."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import choice, quantity
from hpcdem.cases.rock import CRACKS, ELASTIC, JOINTS, SURFACES, WAVES, Dimensions, Rock, in_space


@dataclass(frozen=True)
class Splitting:
    """strength: 2 P / (pi D) at the peak [Pa]; peak_force: P there [N/m]; centre_x, centre_y: mean stress in the
    centre, across and along the load, over 2 P / (pi D) during loading: 1 and -3 in an elastic disc; curve: (shortening
    over diameter, 2 P / (pi D) [Pa]) pairs; tension, mixed, shear: broken joints by mode; energy_error: closing error
    of the energy budget over its largest flow. In three dimensions P is the load per metre of thickness.
    """

    strength: float
    peak_force: float
    centre_x: float
    centre_y: float
    tension: int
    mixed: int
    shear: int
    energy_error: float
    curve: list[tuple[float, float]] = field(repr=False)


class Brazilian(Rock):
    """Brazilian test: a disc of rock between two platens that approach each other."""

    name: ClassVar[str] = "brazilian"
    title: ClassVar[str] = "Brazilian test: a disc of rock splits between two platens"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Splitting

    dim: Dimensions = choice(2, "dimensions of space: a flat disc, or one of this thickness along z")
    thickness: float = quantity(0.025, "m", "thickness of the disc in three dimensions, and of the platens", gt=0)
    size: float = quantity(0.001, "m", "edges of the elements", gt=0)
    cohesion: float = quantity(20e6, "Pa", "cohesion of the joints", gt=0)
    tensile_strength: float = quantity(5e6, "Pa", "tensile strength of the joints", gt=0)
    friction: float = quantity(35.0, "degrees", "friction angle of joints and cracks", ge=0, lt=90)
    diameter: float = quantity(0.05, "m", "diameter of the disc", gt=0)
    flat: float = quantity(0.0, "degrees", "angle, seen from the centre, of its flat ends at the platens", ge=0, le=45)
    guided: bool = choice(
        False,
        "edges (in three dimensions faces) of the mesh along the loaded diameter, so that the crack can "
        "propagate straight",
    )
    joints: bool = choice(True, "with joints, along which it breaks; without them it is elastic")
    platen_friction: float = quantity(0.0, "degrees", "friction angle between platens and disc", ge=0, lt=90)
    transits: float = quantity(40.0, "1", "wave transits of the disc per 0.1 % of shortening", ge=5)
    stop: float = quantity(0.5, "1", "end of the test: fraction of the peak force", gt=0, lt=1)
    most_strain: float = quantity(0.005, "1", "end of the test in any case: shortening over diameter", gt=0, le=0.2)

    @model_validator(mode="after")
    def _fits(self) -> Brazilian:
        if self.size > self.diameter / 8:
            raise ValueError(f"size is {self.size:g}, expected at most an eighth of diameter, {self.diameter / 8:g} m")
        if self.dim == 2 and "thickness" in self.model_fields_set:
            raise ValueError("thickness requires dim 3")
        self.not_too_many(0.25 * math.pi * self.diameter**2, self.thickness if self.dim == 3 else None)
        return self

    def model(self) -> str:
        if self.dim == 2:
            disc = DISC.replace("MESH", GUIDED if self.guided else FREE)
        else:
            disc = THICK.replace("MESH", PLANE if self.guided else "")
            disc = disc.replace("ALONG", "embed 'guide' " if self.guided else "")
        text = disc + ELASTIC + (JOINTS if self.joints else "") + SURFACES + STEEL
        return in_space(text) if self.dim == 3 else text

    def loading(self) -> str:
        text = (LOADING + CRACKS + REPORT).replace("DEEP", " * thickness" if self.dim == 3 else "")
        if self.dim == 2:
            return text
        text = text.replace("velocity-x 0 velocity-y", "velocity-x 0 velocity-z 0 velocity-y")
        return in_space(text) + PICTURE


DISC = """
pcdc model new
# The outline has corners at the ends of the flats, and as many on the left as on the right.
half = math.radians(flat) / 2                    # of a flat end
edges = max(8, math.ceil((math.pi - 2*half) * diameter / (2*size) / 2) * 2)
outline = []
for i in range(2*edges + 2):
    side, step = divmod(i, edges + 1)
    angle = (side - 0.5) * math.pi + half + step * (math.pi - 2*half) / edges
    if flat > 0 or step < edges:
        outline.append(Vector(0.5*diameter*math.cos(angle), 0.5*diameter*math.sin(angle)))
pcdc geometry create polyline [outline + outline[:1]] as-layer 'outline'
MESH
wide, thick, end = 0.4*diameter, 0.1*diameter, 0.5*diameter*math.cos(half)
for low in (-end - thick, end):
    pcdc mesh structured ([-wide/2],[low]) ([wide/2],[low + thick]) \\
        cells [max(4, 2*round(wide/size/6))] [max(2, round(thick/size/3))] type quad group 'platen' set 'body'

pcdc geometry create circle (0,0) [max(0.05*diameter, 1.5*size)] as-layer 'middle'
pcdc element group 'middle' set 'gauge' range geometry 'middle'
"""
THICK = """
pcdc model new dim 3
# The outline has corners at the ends of the flats, and as many on the left as on the right.
half = math.radians(flat) / 2                    # of a flat end
edges = max(8, math.ceil((math.pi - 2*half) * diameter / (2*size) / 2) * 2)
outline = []
for i in range(2*edges + 2):
    side, step = divmod(i, edges + 1)
    angle = (side - 0.5) * math.pi + half + step * (math.pi - 2*half) / edges
    if flat > 0 or step < edges:
        outline.append(Vector(0.5*diameter*math.cos(angle), 0.5*diameter*math.sin(angle), 0))
pcdc geometry create polygon [outline] as-layer 'rim'
pcdc geometry create extrude layer 'rim' along (0,0,[thickness]) as-layer 'outline'
MESHpcdc mesh create from-layer 'outline' size [size] ALONGgroup 'rock' set 'body'
wide, thick, end = 0.4*diameter, 0.1*diameter, 0.5*diameter*math.cos(half)
for low in (-end - thick, end):
    pcdc mesh structured ([-wide/2],[low],0) ([wide/2],[low + thick],[thickness]) \\
        cells [max(4, 2*round(wide/size/6))] [max(2, round(thick/size/3))] [max(2, round(thickness/size/3))] \\
        group 'platen' set 'body'

pcdc geometry create cylinder (0,0,0) (0,0,[thickness]) [max(0.05*diameter, 1.5*size)] as-layer 'middle'
pcdc element group 'middle' set 'gauge' range geometry 'middle'
"""
FREE = """\
pcdc mesh create from-layer 'outline' size [size] irregular group 'rock' set 'body'
"""
GUIDED = """\
pcdc geometry create polyline (0,[-0.49*diameter*math.cos(half)]) (0,[0.49*diameter*math.cos(half)]) as-layer 'guide'
pcdc mesh create from-layer 'outline' size [size] embed 'guide' irregular group 'rock' set 'body'
"""
PLANE = """\
high = 0.49*diameter*math.cos(half)
pcdc geometry create polygon (0,[-high],0) (0,[high],0) (0,[high],[thickness]) (0,[-high],[thickness]) as-layer 'guide'
"""
STEEL = """
pcdc element property density 7850 young 200e9 poisson-ratio 0.3 range group 'platen' set 'body'
pcdc element-face property friction [platen_friction] range face-of 'platen' set 'body'
# The outer sides of the platens are moved.
pcdc node group 'below' set 'moved' range y [-end - thick] [-end - thick]
pcdc node group 'above' set 'moved' range y [end + thick] [end + thick]
"""
LOADING = (
    "import numpy as np\n"
    + WAVES
    + """\
transit = diameter / speed_of_waves
speed = 0.5e-3 * diameter / (transits * transit) # m/s, of either platen, reached within four transits
for name, sense in (('below', 1), ('above', -1)):
    pcdc table create '[name]' values (0,0) ([4*transit],[sense*speed])
    pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y table '[name]' range group '[name]' set 'moved'

pcdc model option energy on
pcdc model step 1                                # the time step is known from here on
every = max(1, round(0.1 * transit / pcdc.time))
for name in ('below', 'above'):
    pcdc history create 'force [name]' node value reaction-y sum every [every] range group '[name]' set 'moved'
    pcdc history create 'displacement [name]' node value displacement-y mean every [every] \\
        range group '[name]' set 'moved'
pcdc history create 'middle xx' element value stress-xx mean every [every] range group 'middle' set 'gauge'
pcdc history create 'middle yy' element value stress-yy mean every [every] range group 'middle' set 'gauge'
pcdc history create 'cracks' model value broken-joints every [every]
pcdc output vtk 'brazilian' every [50*every]

# Load until the force has fallen, or the shortening is reached.
force = strain = peak = 0.0
cracked = False
while strain < most_strain and (not cracked or force >= stop * peak):
    pcdc model solve time [transit]
    below, above = (pcdc.total('node', 'reaction-y', group=name, set='moved') for name in ('below', 'above'))
    force, strain = (below - above) / 2, 2 * speed * (pcdc.time - 2*transit) / diameter
    peak = max(peak, force)
    cracked = cracked or pcdc.history('cracks')[-1, 2] > 0
pcdc output vtk 'brazilian'

# The curve of 2 P / (pi D): the tension that this force brings to the middle of an elastic disc.
below, above, rise, fall, xx, yy = (pcdc.history(name)[:, 2] for name in (
    'force below', 'force above', 'displacement below', 'displacement above', 'middle xx', 'middle yy'))
strain, stress = (rise - fall) / diameter, (below - above) / (math.pi * diameterDEEP)
curve = list(zip(strain.tolist(), stress.tolist()))
strength = float(stress.max())
peak_force = 0.5 * math.pi * diameter * strength
rising = (stress > 0.1 * strength) & (stress < 0.5 * strength) & (np.arange(len(stress)) < stress.argmax())
centre_x, centre_y = (float(np.polyfit(stress[rising], s[rising], 1)[0]) if rising.sum() > 1 else math.nan
                      for s in (xx, yy))
"""
)
REPORT = """
print('strength %.4g MPa at a force of %.4g kN/m' % (strength/1e6, peak_force/1e3))
print('stress in the middle over 2P/(pi D): %.4g across, %.4g along' % (centre_x, centre_y))
print('broken joints: %d in tension, %d mixed, %d in shear' % (tension, mixed, shear))
points = [(100 * e, s / 1e6) for e, s in curve]
pcdc chart create 'brazilian' x-label 'shortening over diameter (%)' y-label '2P/(πD) (MPa)'
pcdc chart add 'brazilian' values [points] label 'disc'
pcdc chart export 'brazilian' 'brazilian.png' cracks
"""
PICTURE = """\
pcdc output image 'brazilian' deformed 10
pcdc output image 'section' section 'z=[thickness/2]' eye '0,0,1'
"""
"""Picture of the disc, with broken joints in its centre."""

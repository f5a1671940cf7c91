"""Direct tension of a specimen of rock: a dog-bone, or a straight bar."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from pydantic import model_validator

from hpcdem.cases.base import choice, quantity
from hpcdem.cases.rock import CRACKS, PROPERTIES, WAVES, Rock


@dataclass(frozen=True)
class Tension:
    """peak [Pa]: largest nominal stress, the force over the neck; peak_joint [Pa]: largest normal stress of a joint at
    one of its three points, where its law is evaluated; peak_joint_mean [Pa]: of their mean; crack_low, crack_high [m]:
    where the broken joints lie along y, from the neck, NaN if none broke; curve: (strain between the ends, nominal
    stress [Pa]) pairs; tension, mixed, shear: broken joints by mode; energy_error: closing error of the energy budget
    over its largest flow."""

    peak: float
    peak_joint: float
    peak_joint_mean: float
    crack_low: float
    crack_high: float
    tension: int
    mixed: int
    shear: int
    energy_error: float
    curve: list[tuple[float, float]] = field(repr=False)


class DirectTension(Rock):
    """Direct tension: both ends of a specimen are pulled until it breaks."""

    name: ClassVar[str] = "tension"
    title: ClassVar[str] = "Direct tension of a specimen of rock"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Tension

    shape: Literal["dog-bone", "bar"] = choice(
        "dog-bone", "dog-bone: narrowed by two arcs; bar: straight, regular mesh"
    )
    path: Literal["free", "line"] = choice(
        "free", "crack path of the dog-bone; free: an irregular mesh; line: straight edges across the neck"
    )
    width: float = quantity(0.050, "m", "width of the ends of the dog-bone", gt=0)
    neck: float = quantity(0.030, "m", "width of the neck, or of the bar", gt=0)
    length: float = quantity(0.150, "m", "length between the ends that are moved", gt=0)
    radius: float = quantity(0.150, "m", "radius of the arcs of the dog-bone", gt=0)
    coarse: float = quantity(0.005, "m", "edges of the elements at the ends of the dog-bone", gt=0)
    damping: float = quantity(1.0, "1", "viscous damping of the elements, part of the critical", ge=0, le=1)
    friction: float = quantity(45.0, "degrees", "friction angle of joints and cracks", ge=0, lt=90)
    cohesion: float = quantity(25e6, "Pa", "cohesion of the joints", gt=0)
    transits: float = quantity(25.0, "1", "wave transits of the specimen while the stress rises to the strength", ge=5)
    stop: float = quantity(0.5, "1", "end of the test: fraction of the peak stress", gt=0, lt=1)

    @model_validator(mode="after")
    def _fits(self) -> DirectTension:
        if self.size > self.neck / 4:
            raise ValueError(f"size is {self.size:g}, expected at most a quarter of neck, {self.neck / 4:g} m")
        if self.shape == "bar":
            return self
        deep = 0.5 * (self.width - self.neck)
        if not 0.0 < deep < self.radius:
            raise ValueError(f"width is {self.width:g}, expected more than neck and less than neck + 2 radius")
        high = (self.radius**2 - (self.radius - deep) ** 2) ** 0.5
        if 2.0 * high >= self.length:
            raise ValueError(f"length is {self.length:g}, expected more than the length of the arcs, {2.0 * high:g} m")
        if self.coarse < self.size:
            raise ValueError(f"coarse is {self.coarse:g}, expected at least size, {self.size:g} m")
        return self

    def model(self) -> str:
        bone = BONE.replace("EMBED", "embed 'neck' " if self.path == "line" else "")
        return (BAR if self.shape == "bar" else bone) + PROPERTIES + ENDS

    def loading(self) -> str:
        return LOADING + CRACKS + REPORT


BONE = """
# The outline: two straight sides, each with an arc of 2 high in the middle.
centre = 0.5 * neck + radius                     # of the arcs, from the axis
high = math.sqrt(radius**2 - (centre - 0.5 * width) ** 2)
pieces = max(8, round(2 * high / size))
angles = [math.asin(high / radius) * (2 * k / pieces - 1) for k in range(pieces + 1)]
side = [(centre - radius * math.cos(a), radius * math.sin(a)) for a in angles]
side = [(0.5 * width, -0.5 * length), *side, (0.5 * width, 0.5 * length)]
outline = [Vector(x, y) for x, y in side + [(-x, y) for x, y in reversed(side)]]

pcdc model new
pcdc geometry create polygon [outline] as-layer 'outline'
pcdc geometry create polyline ([-0.5*neck],0) ([0.5*neck],0) as-layer 'neck'
pcdc mesh create from-layer 'outline' size [coarse] refine-layer 'neck' size [size] distance [0.5*length] \\
    EMBEDirregular smooth group 'rock' set 'body'
"""
BAR = """
pcdc model new
pcdc mesh structured ([-0.5*neck],[-0.5*length]) ([0.5*neck],[0.5*length]) \\
    cells [round(neck/size)] [round(length/size)] diagonal both group 'rock' set 'body'
"""
ENDS = """
pcdc node group 'bottom' set 'ends' range y [-0.5*length] [-0.5*length]
pcdc node group 'top' set 'ends' range y [0.5*length] [0.5*length]
"""
LOADING = (
    WAVES
    + """\
transit = length / speed_of_waves
speed = 0.5 * length * tensile_strength / young / (transits * transit)     # m/s, of either end
for name, sense in (('bottom', -1), ('top', 1)):
    pcdc table create '[name]' values (0,0) ([4*transit],[sense*speed])
    pcdc node boundary mech-vel-b-c velocity-y table '[name]' range group '[name]' set 'ends'

pcdc model option energy on
pcdc model step 1                                # the time step is known from here on
every = max(1, round(0.05 * transit / pcdc.time))
for name in ('bottom', 'top'):
    pcdc history create 'force [name]' node value reaction-y sum every [every] range group '[name]' set 'ends'
    pcdc history create 'displacement [name]' node value displacement-y mean every [every] \\
        range group '[name]' set 'ends'
pcdc history create 'point' joint value normal-stress-largest maximum every [every] range face-of 'rock' set 'body'
pcdc history create 'joint' joint value normal-stress maximum every [every] range face-of 'rock' set 'body'
pcdc history create 'cracks' model value broken-joints every [every]

# Load until the stress has fallen; at the latest at four times the elastic displacement and twice that of softening.
softening = 2.6 * gf1 / tensile_strength
longest = transits * transit * (4 + 2 * softening * young / (tensile_strength * length))
stress = peak = 0.0
while pcdc.time < longest and (peak == 0.0 or stress >= stop * peak):
    pcdc model solve time [transit]
    stress = pcdc.history('force top')[-1, 2] / neck
    peak = max(peak, stress)
pcdc output vtk 'tension'

import numpy as np
bottom, top, low, up = (pcdc.history(name)[:, 2] for name in (
    'force bottom', 'force top', 'displacement bottom', 'displacement top'))
stress, strain = (top - bottom) / (2 * neck), (up - low) / length
curve = list(zip(strain.tolist(), stress.tolist()))
peak = float(stress.max())
peak_joint, peak_joint_mean = (float(np.nanmax(pcdc.history(name)[:, 2])) for name in ('point', 'joint'))
at = pcdc.values('joint', 'joint-position-y')[pcdc.values('joint', 'state') == 3]
crack_low, crack_high = (float(at.min()), float(at.max())) if len(at) else (math.nan, math.nan)
"""
)
REPORT = """
print('strength %.4g MPa (force over the neck), largest stress of a joint %.4g MPa' % (peak/1e6, peak_joint/1e6))
print('broken joints: %d in tension, %d mixed, %d in shear' % (tension, mixed, shear))
points = [(1e6 * e, s / 1e6) for e, s in curve]
pcdc chart create 'tension' x-label 'strain between the ends (1e-6)' y-label 'force over neck (MPa)'
pcdc chart add 'tension' values [points] label 'specimen'
pcdc chart export 'tension' 'tension.png' cracks
"""

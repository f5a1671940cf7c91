"""Uniaxial compression of a specimen of rock."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import choice, quantity
from hpcdem.cases.rock import CRACKS, PROPERTIES, WAVES, Dimensions, Rock, in_space


@dataclass(frozen=True)
class Compression:
    """peak, modulus [Pa], peak_strain: of the curve; curve: (strain, stress [Pa]) pairs, compression positive; tension,
    mixed, shear: broken joints by mode; energy_error: closing error of the energy budget over its largest
    flow."""

    peak: float
    peak_strain: float
    modulus: float
    tension: int
    mixed: int
    shear: int
    energy_error: float
    curve: list[tuple[float, float]] = field(repr=False)


class UCS(Rock):
    """Uniaxial compression of rock between two platens: a rectangle, in three dimensions a cylinder."""

    name: ClassVar[str] = "ucs"
    title: ClassVar[str] = "Uniaxial compression of a specimen of rock"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Compression

    dim: Dimensions = choice(2, "dimensions of space: a rectangle, or a cylinder of this diameter along z")
    gf1: float = quantity(0.5, "N/m", "fracture energy of opening (mode I)", gt=0)
    gf2: float = quantity(5.0, "N/m", "fracture energy of sliding (mode II)", gt=0)
    width: float = quantity(0.052, "m", "width of the specimen", gt=0)
    height: float = quantity(0.108, "m", "height of the specimen", gt=0)
    platens: bool = choice(True, "platens of steel; without them the ends themselves are moved, free along x")
    platen_width: float = quantity(0.056, "m", "width of the platens", gt=0)
    platen_height: float = quantity(0.010, "m", "height of the platens", gt=0)
    platen_friction: float = quantity(0.0, "degrees", "friction angle between platens and specimen", ge=0, lt=90)
    transits: float = quantity(40.0, "1", "wave transits of the specimen per 0.1 % of strain", ge=5)
    stop: float = quantity(0.5, "1", "end of the test: fraction of the peak stress", gt=0, lt=1)
    most_strain: float = quantity(0.01, "1", "end of the test in any case: strain of the specimen", gt=0, le=0.2)

    @model_validator(mode="after")
    def _fits(self) -> UCS:
        if self.size > self.width / 4:
            raise ValueError(f"size is {self.size:g}, expected at most a quarter of width, {self.width / 4:g} m")
        if self.platens and self.platen_width < self.width:
            raise ValueError(f"platen_width is {self.platen_width:g}, expected at least width, {self.width:g} m")
        if self.dim == 3:
            self.not_too_many(math.pi / 4 * self.width**2, self.height)
        else:
            self.not_too_many(self.width * self.height)
        return self

    def model(self) -> str:
        specimen, platens = (CYLINDER, BOXES) if self.dim == 3 else (SPECIMEN, PLATENS)
        return self._placed(
            specimen + (platens if self.platens else "") + PROPERTIES + (STEEL if self.platens else ENDS) + LOADED
        )

    def loading(self) -> str:
        return self._placed(LOADING + CRACKS + REPORT)

    def _placed(self, text: str) -> str:
        """Loaded along y, in space along z."""
        text = text.replace("UP", "yz"[self.dim - 2]).replace("AREA", "area" if self.dim == 3 else "width")
        if self.dim == 3:
            text = in_space(text).replace(", and are free along x", ", and are free across it")
            text += PICTURE if "pcdc chart" in text else ""
        return text


SPECIMEN = """
pcdc model new
pcdc geometry create rectangle (0,0) ([width],[height]) as-layer 'outline'
pcdc mesh create from-layer 'outline' size [size] irregular group 'rock' set 'body'
"""
CYLINDER = """
pcdc model new dim 3
area = math.pi * width**2 / 4
pcdc geometry create cylinder (0,0,0) (0,0,[height]) [width/2] as-layer 'outline'
pcdc mesh create from-layer 'outline' size [size] group 'rock' set 'body'
"""
BOXES = """
half = 0.5 * platen_width
for low in (-platen_height, height):
    pcdc mesh structured ([-half],[-half],[low]) ([half],[half],[low + platen_height]) \\
        cells [max(2, round(platen_width/size/2))] [max(2, round(platen_width/size/2))] \\
        [max(1, round(platen_height/size/2))] group 'platen' set 'body'
"""
PLATENS = """
side = 0.5 * (width - platen_width)
for low in (-platen_height, height):
    pcdc mesh structured ([side],[low]) ([side + platen_width],[low + platen_height]) \\
        cells [max(2, round(platen_width/size/2))] [max(1, round(platen_height/size/2))] type quad \\
        group 'platen' set 'body'
"""
STEEL = """
pcdc element property density 7850 young 200e9 poisson-ratio 0.3 range group 'platen' set 'body'
pcdc element-face property friction [platen_friction] range face-of 'platen' set 'body'

# The outer sides of the platens are moved.
pcdc node group 'below' set 'moved' range UP [-platen_height] [-platen_height]
pcdc node group 'above' set 'moved' range UP [height + platen_height] [height + platen_height]
"""
ENDS = """
# The ends of the specimen are moved along UP, and are free along x.
pcdc node group 'below' set 'moved' range UP 0 0
pcdc node group 'above' set 'moved' range UP [height] [height]
"""
LOADED = """
# Strain is that between the ends of the specimen.
pcdc node group 'bottom' set 'ends' range face-of 'rock' set 'body' UP 0 0
pcdc node group 'top' set 'ends' range face-of 'rock' set 'body' UP [height] [height]
"""
LOADING = (
    "import numpy as np\n"
    + WAVES
    + """\
transit = height / speed_of_waves
speed = 0.5e-3 * height / (transits * transit)   # m/s, of either end, reached within four transits
for name, sense in (('below', 1), ('above', -1)):
    pcdc table create '[name]' values (0,0) ([4*transit],[sense*speed])
    pcdc node boundary mech-vel-b-c velocity-UP table '[name]' range group '[name]' set 'moved'

pcdc model option energy on
pcdc model step 1                                # the time step is known from here on
every = max(1, round(0.1 * transit / pcdc.time))
for name, at in (('below', 'bottom'), ('above', 'top')):
    pcdc history create 'force [name]' node value reaction-UP sum every [every] range group '[name]' set 'moved'
    pcdc history create 'displacement [at]' node value displacement-UP mean every [every] range group '[at]' set 'ends'
pcdc history create 'cracks' model value broken-joints every [every]
pcdc output vtk 'ucs' every [50*every]

# Load until the stress has fallen, or the strain is reached.
stress = strain = peak = 0.0
cracked = False
while strain < most_strain and (not cracked or stress >= stop * peak):
    pcdc model solve time [transit]
    below, above = (pcdc.total('node', 'reaction-UP', group=name, set='moved') for name in ('below', 'above'))
    bottom, top = (pcdc.values('node', 'displacement-UP', group=at, set='ends').mean() for at in ('bottom', 'top'))
    stress, strain = (below - above) / (2 * AREA), (bottom - top) / height
    peak = max(peak, stress)
    cracked = cracked or pcdc.history('cracks')[-1, 2] > 0
pcdc output vtk 'ucs'

# The curve: compression is positive from here on.
below, above, bottom, top = (pcdc.history(name)[:, 2]
                             for name in ('force below', 'force above', 'displacement bottom', 'displacement top'))
stress, strain = (below - above) / (2 * AREA), (bottom - top) / height
curve = list(zip(strain.tolist(), stress.tolist()))
peak, peak_strain = float(stress.max()), float(strain[stress.argmax()])
rising = (stress > 0.1 * peak) & (stress < 0.5 * peak) & (strain < peak_strain)
modulus = float(np.polyfit(strain[rising], stress[rising], 1)[0]) if rising.sum() > 1 else math.nan
"""
)
REPORT = """
print('strength %.4g MPa at a strain of %.4g %%, modulus %.4g GPa' % (peak/1e6, 100*peak_strain, modulus/1e9))
print('broken joints: %d in tension, %d mixed, %d in shear' % (tension, mixed, shear))
points = [(100 * e, s / 1e6) for e, s in curve]
pcdc chart create 'ucs' x-label 'axial strain (%)' y-label 'axial stress (MPa)'
pcdc chart add 'ucs' values [points] label 'specimen'
pcdc chart export 'ucs' 'ucs.png' cracks
"""
PICTURE = """\
pcdc output image 'ucs' deformed 10
pcdc output image 'section' section 'y=0' eye '0,-1,0'
"""
"""Picture of the specimen, with broken joints in its middle."""

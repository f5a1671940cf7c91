"""True triaxial compression: a cube of rock under three pressures, one of which grows until it breaks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import quantity
from hpcdem.cases.rock import CRACKS, ELASTIC, JOINTS, SURFACES, WAVES, Rock, in_space


@dataclass(frozen=True)
class Strength:
    """peak [Pa], peak_strain: greatest stress along z, and its strain; criterion [Pa]: Mohr–Coulomb strength
    under the least pressure p, 2 c sqrt(N) + N p; curve: (strain, stress along z [Pa]) pairs, compression positive;
    tension, mixed, shear: broken joints by mode; energy_error: closing error of the energy budget
    over its largest flow."""

    peak: float
    peak_strain: float
    criterion: float
    tension: int
    mixed: int
    shear: int
    energy_error: float
    curve: list[tuple[float, float]] = field(repr=False)


class Triaxial(Rock):
    """A cube under one pressure along x and another along y, compressed along z."""

    name: ClassVar[str] = "triaxial"
    title: ClassVar[str] = "True triaxial compression of a cube, in three dimensions"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Strength

    side: float = quantity(0.05, "m", "side of the cube", gt=0)
    size: float = quantity(0.005, "m", "edges of the elements", gt=0)
    gf1: float = quantity(0.5, "N/m", "fracture energy of opening (mode I)", gt=0)
    gf2: float = quantity(5.0, "N/m", "fracture energy of sliding (mode II)", gt=0)
    penalty_overlay: float = quantity(10.0, "1", "penalty of closed joints, over young", gt=0)
    least: float = quantity(5e6, "Pa", "pressure along x", ge=0)
    middle: float = quantity(15e6, "Pa", "pressure along y", ge=0)
    transits: float = quantity(20.0, "1", "wave transits of the cube per 0.1 % of strain", ge=5)
    stop: float = quantity(0.7, "1", "end of the test: fraction of the peak stress", gt=0, lt=1)
    most_strain: float = quantity(0.01, "1", "end of the test in any case: strain along z", gt=0, le=0.2)

    @model_validator(mode="after")
    def _fits(self) -> Triaxial:
        if self.size > self.side / 4:
            raise ValueError(f"size is {self.size:g}, expected at most a quarter of side, {self.side / 4:g} m")
        if self.middle < self.least:
            raise ValueError(f"middle is {self.middle:g}, expected at least least, {self.least:g} Pa")
        self.not_too_many(self.side**2, self.side)
        return self

    def model(self) -> str:
        return CUBE + ELASTIC + JOINTS + SURFACES + PRESSED

    def loading(self) -> str:
        return in_space(LOADING + CRACKS + REPORT)


CUBE = """
pcdc model new dim 3
pcdc geometry create box (0,0,0) ([side],[side],[side]) as-layer 'cube'
pcdc mesh create from-layer 'cube' size [size] group 'rock' set 'body'
"""
PRESSED = """
# Pressures grow while waves cross the cube some ten times; the ends move as planes, and are free along them.
near = 1e-6 * side
grown = 10 * side * math.sqrt(density / young)
pcdc table create 'least' values (0,0) ([grown],[-least])
pcdc table create 'middle' values (0,0) ([grown],[-middle])
for place in (0, side):
    pcdc element-face boundary mech-s-b-c stress-normal table 'least' range x [place - near] [place + near]
    pcdc element-face boundary mech-s-b-c stress-normal table 'middle' range y [place - near] [place + near]
pcdc node group 'below' set 'moved' range z [-near] [near]
pcdc node group 'above' set 'moved' range z [side - near] [side + near]
"""
LOADING = (
    "import numpy as np\n"
    + WAVES
    + """\
transit = side / speed_of_waves
speed = 0.5e-3 * side / (transits * transit)     # m/s, of either end, reached within four transits
for name, sense in (('below', 1), ('above', -1)):
    pcdc table create '[name]' values (0,0) ([4*transit],[sense*speed])
    pcdc node boundary mech-vel-b-c velocity-z table '[name]' range group '[name]' set 'moved'

pcdc model option energy on
pcdc model step 1                                # the time step is known from here on
every = max(1, round(0.1 * transit / pcdc.time))
for name in ('below', 'above'):
    pcdc history create 'force [name]' node value reaction-z sum every [every] range group '[name]' set 'moved'
    pcdc history create 'displacement [name]' node value displacement-z mean every [every] \\
        range group '[name]' set 'moved'
pcdc history create 'cracks' model value broken-joints every [every]
pcdc output vtk 'triaxial' every [50*every]

# Load until the stress has fallen, or the strain is reached.
stress = strain = peak = 0.0
cracked = False
while strain < most_strain and (not cracked or stress >= stop * peak):
    pcdc model solve time [transit]
    below, above = (pcdc.total('node', 'reaction-z', group=name, set='moved') for name in ('below', 'above'))
    rise, fall = (pcdc.values('node', 'displacement-z', group=name, set='moved').mean() for name in ('below', 'above'))
    stress, strain = (below - above) / (2 * side**2), (rise - fall) / side
    peak = max(peak, stress)
    cracked = cracked or pcdc.history('cracks')[-1, 2] > 0
pcdc output vtk 'triaxial'

# The curve: compression is positive from here on.
below, above, rise, fall = (pcdc.history(name)[:, 2]
                            for name in ('force below', 'force above', 'displacement below', 'displacement above'))
stress, strain = (below - above) / (2 * side**2), (rise - fall) / side
curve = list(zip(strain.tolist(), stress.tolist()))
peak, peak_strain = float(stress.max()), float(strain[stress.argmax()])
steep = math.tan(math.pi/4 + math.radians(friction)/2)**2
criterion = 2 * cohesion * math.sqrt(steep) + steep * least
"""
)
REPORT = """
print('strength %.4g MPa at a strain of %.4g %%, by the criterion %.4g MPa' % (
    peak/1e6, 100*peak_strain, criterion/1e6))
print('broken joints: %d in tension, %d mixed, %d in shear' % (tension, mixed, shear))
points = [(100 * e, s / 1e6) for e, s in curve]
pcdc chart create 'triaxial' x-label 'axial strain (%)' y-label 'axial stress (MPa)'
pcdc chart add 'triaxial' values [points] label 'cube'
pcdc chart export 'triaxial' 'triaxial.png'
pcdc output image 'triaxial' deformed 10
"""

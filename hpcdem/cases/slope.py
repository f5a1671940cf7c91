"""A slope with benches, excavated stage by stage."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from pydantic import model_validator

from hpcdem.cases.base import choice, quantity
from hpcdem.cases.rock import CRACKS, PROPERTIES, WAVES, Rock


@dataclass(frozen=True)
class Stages:
    """crest_x, crest_y, floor_y [m]: displacement since gravity settled, of the highest crest and of the lowest floor
    (in the middle before the last face); weight, carried [N/m]: of the rock that is left, and the force under it;
    aside [N/m]: sum of the horizontal forces of both sides; ratio: the largest unbalanced ratio at the end of a stage;
    stages: per bench (bench, crest_x, crest_y, floor_y, ratio, weight, carried); tension, mixed, shear: broken joints
    by mode (elastic: 0); energy_error: closing error of the energy budget over its largest flow (elastic: NaN)."""

    crest_x: float
    crest_y: float
    floor_y: float
    weight: float
    carried: float
    aside: float
    ratio: float
    tension: int
    mixed: int
    shear: int
    energy_error: float
    stages: list[tuple[int, float, float, float, float, float, float]] = field(repr=False)


class Slope(Rock):
    """A slope with benches: level ground under gravity, in which benches are excavated from top to bottom."""

    name: ClassVar[str] = "slope"
    title: ClassVar[str] = "A slope with benches, excavated stage by stage"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Stages

    elements: Literal["tri", "quad"] = choice("tri", "triangles or quads")
    joints: bool = choice(False, "with joints that crack; without them the rock is elastic and every stage static")
    benches: int = quantity(4, "1", "number of benches", ge=1, le=50)
    bench_height: float = quantity(2.5, "m", "height of a bench", gt=0)
    bench_width: float = quantity(2.0, "m", "width of the berms between the benches", gt=0)
    face: float = quantity(75.0, "degrees", "angle of the faces of the benches", gt=10, le=90)
    behind: float = quantity(12.0, "m", "from the left side of the model to the highest crest", gt=0)
    before: float = quantity(12.0, "m", "from the lowest toe to the right side of the model", gt=0)
    below: float = quantity(10.0, "m", "from the lowest floor to the bottom of the model", gt=0)
    size: float = quantity(0.5, "m", "edges of the elements at the benches", gt=0)
    coarse: float = quantity(1.5, "m", "edges of the elements at the sides and the bottom", gt=0)
    gravity: float = quantity(9.81, "m/s2", "acceleration of gravity, downwards", gt=0)
    density: float = quantity(2500.0, "kg/m3", "density", gt=0)
    young: float = quantity(1e9, "Pa", "Young's modulus", gt=0)
    poisson: float = quantity(0.3, "1", "Poisson's ratio", ge=0, lt=0.5)
    cohesion: float = quantity(60e3, "Pa", "cohesion of the joints", gt=0)
    tensile_strength: float = quantity(20e3, "Pa", "tensile strength of the joints", gt=0)
    gf1: float = quantity(1.0, "N/m", "fracture energy of opening (mode I)", gt=0)
    gf2: float = quantity(10.0, "N/m", "fracture energy of sliding (mode II)", gt=0)
    relax: float = quantity(5.0, "1", "wave transits of the model while excavated rock is released (joints)", gt=0)
    rest: float = quantity(10.0, "1", "wave transits of the model until the next bench (joints)", gt=0)

    @model_validator(mode="after")
    def _fits(self) -> Slope:
        least = min(self.bench_height, self.bench_width)
        if self.size > least:
            raise ValueError(f"size is {self.size:g}, expected at most the smaller side of a bench, {least:g} m")
        if self.coarse < self.size:
            raise ValueError(f"coarse is {self.coarse:g}, expected at least size, {self.size:g} m")
        return self

    def model(self) -> str:
        kind = "type quad" if self.elements == "quad" else "irregular"
        properties = PROPERTIES.replace("range face-of 'rock' set 'body'", "").replace(" \n", "\n")
        return GROUND.replace("KIND", kind) + (properties if self.joints else ELASTIC) + HELD

    def loading(self) -> str:
        return SETTLED + (CRACKING if self.joints else "") + STAGES.replace(
            "DIG", DYNAMIC if self.joints else STATIC
        ) + (CRACKS if self.joints else NO_CRACKS) + REPORT  # fmt: skip


GROUND = """
# y = 0 is the lowest floor, x = 0 the highest crest. The benches, from the top: excavated polygons.
top = benches * bench_height
run = bench_height / math.tan(math.radians(face)) if face < 90 else 0.0      # of a face, along x
left, right = -behind, benches * run + (benches - 1) * bench_width + before
toe = right - before

pcdc model new
pcdc geometry create polygon ([left],[-below]) ([right],[-below]) ([right],[top]) ([left],[top]) as-layer 'outline'
for k in range(benches):
    crest, high, low = k * (run + bench_width), top - k * bench_height, top - (k + 1) * bench_height
    pcdc geometry create polygon ([crest],[high]) ([crest + run],[low]) ([right],[low]) ([right],[high]) \\
        as-layer 'bench [k+1]'
    pcdc geometry create polyline ([crest],[high]) ([crest + run],[low]) ([right],[low]) as-layer 'lines'
    pcdc geometry create polyline ([crest],[high]) ([crest + run],[low]) as-layer 'faces'
pcdc mesh create from-layer 'outline' size [coarse] refine-layer 'faces' size [size] distance [0.5*(top + below)] \\
    embed 'lines' KIND group 'rock'
for k in range(benches):
    pcdc element group 'bench [k+1]' set 'stage' range geometry 'bench [k+1]'
"""
ELASTIC = """
pcdc element c-model mech-iso-e property density [density] young [young] poisson-r [poisson]
"""
HELD = """
# Rollers on both sides and under the bottom.
near = 1e-6 * (right - left)
for name, x in (('left', left), ('right', right)):
    pcdc node group '[name]' set 'sides' range x [x - near] [x + near]
    pcdc node boundary mech-m-b-c type 2 (0,1) range group '[name]' set 'sides'
pcdc node group 'bottom' set 'base' range y [-below - near] [-below + near]
pcdc node boundary mech-m-b-c type 2 (1,0) range group 'bottom' set 'base'
for name, x in (('left', left), ('right', right)):
    pcdc node boundary mech-m-b-c type 1 (0,0) range x [x - near] [x + near] y [-below - near] [-below + near]
pcdc model gravity (0,[-gravity])
"""
SETTLED = """
# Gravity settles; displacements count from there.
pcdc model option dynamic off
pcdc model solve ratio 1e-6 cycles 50000
pcdc node reset displacement
pcdc output vtk 'slope'
"""
CRACKING = (
    WAVES
    + """\
pcdc node reset velocity
pcdc model option dynamic on
pcdc model option energy on
transit = (top + below) / speed_of_waves
"""
)
STATIC = """\
    pcdc element c-model null relax 200 range group 'bench [k]' set 'stage'
    pcdc model solve ratio 1e-6"""
DYNAMIC = """\
    pcdc element c-model null relax [relax*transit] range group 'bench [k]' set 'stage'
    pcdc model solve time [(relax + rest)*transit]"""
STAGES = """
import numpy as np
numbers, px, py = pcdc.numbers('node'), pcdc.values('node', 'position-x'), pcdc.values('node', 'position-y')
def nearest(x, y):
    return int(numbers[np.hypot(px - x, py - y).argmin()])
crest = nearest(0, top)
stages = []
for k in range(1, benches + 1):
DIG
    pcdc output vtk 'slope'
    crest_x, crest_y = pcdc.node(crest).displacement.X, pcdc.node(crest).displacement.Y
    floor_y = pcdc.node(nearest(0.5 * (toe + right), top - k * bench_height)).displacement.Y
    area = pcdc.values('element', 'area')[np.isfinite(pcdc.values('element', 'stress-yy'))]
    weight = math.fsum(area) * density * gravity
    carried = pcdc.total('node', 'reaction-y', group='bottom', set='base')
    aside = sum(pcdc.total('node', 'reaction-x', group=name, set='sides') for name in ('left', 'right'))
    stages.append((k, crest_x, crest_y, floor_y, pcdc.ratio, weight, carried))
    print('bench %d: crest moved by (%.4g, %.4g) mm, floor %.4g mm; ratio %.2g; weight %.5g, carried %.5g kN/m'
          % (k, 1e3 * crest_x, 1e3 * crest_y, 1e3 * floor_y, pcdc.ratio, weight / 1e3, carried / 1e3))
ratio = max(stage[4] for stage in stages)
"""
NO_CRACKS = """
tension = mixed = shear = 0
energy_error = math.nan
"""
REPORT = """
print('broken joints: %d in tension, %d mixed, %d in shear' % (tension, mixed, shear))
pcdc chart create 'slope' x-label 'bench' y-label 'displacement (mm)'
for column, label in ((1, 'crest, along x'), (2, 'crest, upwards'), (3, 'floor, upwards')):
    points = [(stage[0], 1e3 * stage[column]) for stage in stages]
    pcdc chart add 'slope' values [points] label [label] style points
pcdc chart export 'slope' 'slope.png'
"""

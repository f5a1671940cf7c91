"""A pillar of rock between rooms that are excavated stage by stage, and then loaded until it fails."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import choice, quantity
from hpcdem.cases.rock import CRACKS, PROPERTIES, WAVES, Rock


@dataclass(frozen=True)
class PillarTest:
    """stages: per stage of the excavation (width of the rooms [m], width of the pillar [m], mean vertical stress in it
    [Pa], that of the tributary area [Pa], unbalanced ratio); strength [Pa]: largest mean stress of the pillar,
    at_strength [m]: convergence there; residual [Pa]: stress at the end; empirical [Pa]: strength after Lunder and
    Pakalnis; factor: strength over the stress after the excavation; curve: (convergence [m], mean stress [Pa]) pairs;
    profiles: per stage, and at the strength, (x [m], vertical stress [Pa]) pairs at half the height; stresses are
    positive in compression. tension, mixed, shear: broken joints by mode (without joints: 0); energy_error: closing
    error of the energy budget over its largest flow (without joints: NaN, as it is solved statically).
    """

    stages: list[tuple[float, float, float, float, float]]
    strength: float
    at_strength: float
    residual: float
    empirical: float
    factor: float
    tension: int
    mixed: int
    shear: int
    energy_error: float
    curve: list[tuple[float, float]] = field(repr=False)
    profiles: list[list[tuple[float, float]]] = field(repr=False)


class Pillar(Rock):
    """A pillar between two rooms at depth: the rooms are opened in stages, then the roof is lowered onto the pillar."""

    name: ClassVar[str] = "pillar"
    title: ClassVar[str] = "A pillar of rock between rooms, excavated in stages and loaded until it fails"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = PillarTest

    row: bool = choice(True, "one of an infinite row of pillars; otherwise the pillar between two rooms in wide rock")
    joints: bool = choice(False, "elastic rock with joints that crack; otherwise elastoplastic rock with softening")
    quads: bool = choice(True, "quads; otherwise triangles")
    width: float = quantity(4.0, "m", "width of the pillar after the last stage", gt=0)
    height: float = quantity(4.0, "m", "height of the pillar and of the rooms", gt=0)
    opening: float = quantity(4.0, "m", "width of a room after the last stage", gt=0)
    cover: float = quantity(1.0, "1", "rock above and below the rooms, over height", ge=0.5)
    reach: float = quantity(3.0, "1", "rock beside two rooms, over width + opening (not of a row)", ge=1)
    size: float = quantity(0.2, "m", "edges of the elements in the pillar", gt=0)
    coarse: float = quantity(0.75, "m", "edges of the elements at the sides of the model", gt=0)
    stress_xx: float = quantity(-5e6, "Pa", "horizontal stress before the excavation, compression negative", le=0)
    stress_yy: float = quantity(-10e6, "Pa", "vertical stress before the excavation", lt=0)
    young: float = quantity(20e9, "Pa", "Young's modulus", gt=0)
    friction: float = quantity(35.0, "degrees", "friction angle", ge=0, lt=90)
    dilation: float = quantity(5.0, "degrees", "dilation angle (without joints)", ge=0, lt=90)
    cohesion: float = quantity(8e6, "Pa", "cohesion", gt=0)
    tensile_strength: float = quantity(1.5e6, "Pa", "tensile strength", gt=0)
    residual_cohesion: float = quantity(
        0.2, "1", "residual over initial cohesion and tensile strength (without joints)", ge=0, le=1
    )
    softening: float = quantity(
        0.005, "1", "plastic strain at which the residual values are reached (without joints)", gt=0
    )
    gf1: float = quantity(100.0, "N/m", "fracture energy of opening (mode I)", gt=0)
    gf2: float = quantity(1000.0, "N/m", "fracture energy of sliding (mode II)", gt=0)
    penalty_overlay: float = quantity(10.0, "1", "penalty of closed joints, over young", gt=0)
    openings: int = quantity(4, "1", "stages in which the rooms are opened", ge=1, le=20)
    relax: float = quantity(20.0, "1", "wave transits of the model while excavated rock is released (joints)", gt=0)
    rest: float = quantity(20.0, "1", "wave transits of the model afterwards (joints)", gt=0)
    transits: float = quantity(100.0, "1", "wave transits of the model per convergence of 0.1 % of height", ge=10)
    stop: float = quantity(0.6, "1", "end of the test: fraction of the strength", gt=0, lt=1)
    most_strain: float = quantity(0.01, "1", "end of the test in any case: convergence over height", gt=0, le=0.1)

    @model_validator(mode="after")
    def _fits(self) -> Pillar:
        least = min(self.width, self.height, self.opening / self.openings)
        if self.size > 0.25 * min(self.width, self.height) or self.size > self.opening / self.openings:
            raise ValueError(
                f"size is {self.size:g}, expected at most a quarter of the pillar, and of the excavation of a stage, "
                f"{least:g} m")  # fmt: skip
        if self.coarse < self.size:
            raise ValueError(f"coarse is {self.coarse:g}, expected at least size, {self.size:g} m")
        if self.dilation > self.friction:
            raise ValueError(f"dilation is {self.dilation:g}, expected at most friction, {self.friction:g} degrees")
        self.not_too_many((self.width + self.opening) * (1.0 + 2.0 * self.cover) * self.height)
        return self

    def model(self) -> str:
        kind = "type quad" if self.quads else "irregular"
        sides = ENDLESS if self.row else TWO_ROOMS
        return sides + GROUND.replace("KIND", kind) + (JOINTED if self.joints else YIELDING) + HELD

    def loading(self) -> str:
        text = CRACKING + STAGES + LOADED + CRACKS if self.joints else STAGES + LOADED + NO_CRACKS
        for word, pieces in PIECES.items():
            text = text.replace(word, pieces[self.joints])
        return text + REPORT.replace("SHOWN", "cracks" if self.joints else "plastic")


ENDLESS = """
# A pillar in the middle of its part of the row: by symmetry, its sides are the middles of rooms.
half = 0.5 * opening                             # of a room, as much as there is on either side of the pillar
side = 0.5 * width + half
"""
TWO_ROOMS = """
# A pillar, a room on either side, and rock beside them.
half = opening                                   # as much of a room as there is on either side of the pillar
side = 0.5 * width + half + reach * (width + opening)
"""
GROUND = """\
top = (0.5 + cover) * height                     # y = 0 is half the height of the pillar
wall = 0.5 * width + half                        # rooms are opened from here towards the pillar

pcdc model new
pcdc geometry create polygon ([-side],[-top]) ([side],[-top]) ([side],[top]) ([-side],[top]) as-layer 'outline'
for sense in (-1, 1):
    pcdc geometry create polyline ([-wall],[0.5*sense*height]) ([wall],[0.5*sense*height]) as-layer 'lines'
    for k in range(openings + 1 if side > wall else openings):
        x = sense * (0.5 * width + half * k / openings)
        pcdc geometry create polyline ([x],[-0.5*height]) ([x],[0.5*height]) as-layer 'lines'
    for k in range(openings):                    # excavation of stage k + 1, on this side
        inner, outer = (sense * (wall - half * part / openings) for part in (k + 1, k))
        pcdc geometry create polygon ([inner],[-0.5*height]) ([outer],[-0.5*height]) ([outer],[0.5*height]) \\
            ([inner],[0.5*height]) as-layer 'stage [k+1]'
for k in range(-3, 4):                           # elements are small within the pillar too
    pcdc geometry create polyline ([-0.5*width],[height*k/8]) ([0.5*width],[height*k/8]) as-layer 'fine'
pcdc geometry create polyline ([-0.5*width],[-0.5*height]) ([0.5*width],[-0.5*height]) as-layer 'fine'
pcdc geometry create polyline ([-0.5*width],[0.5*height]) ([0.5*width],[0.5*height]) as-layer 'fine'
pcdc mesh create from-layer 'outline' size [coarse] refine-layer 'fine' size [size] distance [cover*height] \\
    embed 'lines' KIND group 'rock'
for k in range(1, openings + 1):
    pcdc element group 'stage [k]' set 'stage' range geometry 'stage [k]'
near = 1e-6 * top
for name, y in (('floor', -0.5 * height), ('roof', 0.5 * height)):
    pcdc node group '[name]' set 'ends' range x [-0.5*width] [0.5*width] y [y - near] [y + near]
"""
YIELDING = """
# Cohesion and tensile strength fall with plastic strain.
pcdc table create 'cohesion' values (0,[cohesion]) ([softening],[residual_cohesion*cohesion])
pcdc table create 'tensile' values (0,[tensile_strength]) ([softening],[residual_cohesion*tensile_strength])
pcdc element c-model mech-m-c property density [density] young [young] poisson-r [poisson] friction [friction] \\
    dilation [dilation] cohesion table 'cohesion' over plastic-strain tensile table 'tensile' over plastic-strain
"""
JOINTED = """
# Joints are in the pillar and in the excavated and neighbouring rock; roof and floor are elastic.
pcdc element group 'near' set 'jointed' range y [-0.75*height] [0.75*height] x [-wall] [wall]
""" + PROPERTIES.replace("face-of 'rock' set 'body'", "face-of 'near' set 'jointed'").lstrip()
HELD = """
# The stress that was there before, held by rollers at the sides and below, and by the same stress above.
pcdc element initial stress-xx [stress_xx] stress-yy [stress_yy] stress-zz [poisson*(stress_xx + stress_yy)]
for name, x in (('left', -side), ('right', side)):
    pcdc node group '[name]' set 'sides' range x [x - near] [x + near]
    pcdc node boundary mech-vel-b-c velocity-x 0 range group '[name]' set 'sides'
pcdc node boundary mech-vel-b-c velocity-y 0 range y [-top - near] [-top + near]
pcdc element-face boundary m-s-b-c stress-yy [stress_yy] range y [top] [top]
pcdc model option dynamic off
"""
CRACKING = (
    WAVES
    + """\
# Joints take over the stress by closing; displacements count from there.
pcdc model solve ratio 1e-6
pcdc node reset displacement
pcdc node reset velocity
pcdc model option dynamic on
pcdc model option energy on
transit = 2 * top / speed_of_waves
"""
)
STAGES = """
import numpy as np
def pillar(k):
    # Mean vertical stress in the pillar after stage k, by the mean stress theorem, and that along half the height.
    there, yy, area = pcdc.numbers('element'), pcdc.values('element', 'stress-yy'), pcdc.values('element', 'area')
    edge, x, y = wall - half * k / openings, x0[there], y0[there]
    inside = (np.abs(x) < edge) & (np.abs(y) < 0.5 * height) & np.isfinite(yy)
    mean = -math.fsum(yy[inside] * area[inside]) / (2 * edge * (height - closed()))
    band = inside & (np.abs(y) < size)
    number = max(4, round(2 * edge / (1.5 * size)))
    bins = np.floor((x[band] / edge + 1) * 0.5 * number).astype(int)
    force, over, at = (np.bincount(bins, weight, number) for weight in
                       (-yy[band] * area[band], area[band], x[band] * area[band]))
    some = over > 0
    return mean, list(zip((at[some] / over[some]).tolist(), (force[some] / over[some]).tolist()))
x0, y0 = pcdc.values('element', 'element-position-x'), pcdc.values('element', 'element-position-y')   # all are there
def closed():
    # Convergence of roof and floor where the pillar stands.
    return float(pcdc.values('node', 'displacement-y', group='floor', set='ends').mean()
                 - pcdc.values('node', 'displacement-y', group='roof', set='ends').mean())

# Rooms are opened from their far sides, equally on both sides of the pillar.
IN_BALANCE
stages, curve, profiles = [], [(closed(), pillar(0)[0])], []
for k in range(1, openings + 1):
DIG
    pcdc output vtk 'pillar'
    opened = opening * k / openings
    wide = width + 2 * half * (1 - k / openings)
    mean, profile = pillar(k)
    stages.append((opened, wide, mean, -stress_yy * (wide + opened) / wide, pcdc.ratio))
    curve.append((closed(), mean))
    profiles.append(profile)
    print('rooms of %.4g m, pillar of %.4g m: %.5g MPa in the pillar, %.5g MPa by its tributary area'
          % (opened, wide, mean / 1e6, stages[-1][3] / 1e6))
"""
LOADED = """
# The roof comes down: the pillar takes what it can.
pcdc node group 'above' set 'moved' range y [top - near] [top + near]
BEGIN
bears = strength = curve[-1][1]
at_strength, weakest, crushed = curve[-1][0], [], False
while curve[-1][0] < most_strain * height and not (crushed and bears < stop * strength):
    GO
    bears, profile = pillar(openings)
    curve.append((closed(), bears))
    if bears >= strength:
        strength, at_strength, weakest = bears, curve[-1][0], profile
    crushed = crushed or bears < 0.98 * strength
if weakest:
    profiles.append(weakest)
residual = bears
factor = strength / stages[-1][2]
pcdc output vtk 'pillar'
"""
PIECES = {
    "IN_BALANCE": ("pcdc model solve ratio 1e-6\npcdc node reset displacement", "pcdc output vtk 'pillar'"),
    "DIG": (
        """\
    pcdc element c-model null relax 2000 range group 'stage [k]' set 'stage'
    pcdc model solve ratio 1e-6 cycles 200000
    if pcdc.ratio > 1e-6 or closed() > 0.05 * height:   # rubble may come to rest, a pillar it is no more
        raise SystemExit('the pillar does not bear stage %d, rooms of %.4g m' % (k, opening * k / openings))""",
        """\
    pcdc element c-model null relax [relax*transit] range group 'stage [k]' set 'stage'
    pcdc model solve time [(relax + rest)*transit]""",
    ),
    "BEGIN": (
        """\
# Static steps: a wave crosses the model in so many of them as there are elements.
crossing = 2 * top / size
speed = 0.001 * height / (transits * crossing)
pcdc node boundary mech-vel-b-c velocity-y [-speed] range group 'above' set 'moved'""",
        """\
speed = 0.001 * height / (transits * transit)
pcdc table create 'roof' values (0,0) ([10*transit],[-speed])
pcdc node boundary mech-vel-b-c velocity-y table 'roof' range group 'above' set 'moved'""",
    ),
    "GO": ("pcdc model step [max(1, round(0.05*transits*crossing))]", "pcdc model solve time [0.05*transits*transit]"),
}
"""Pieces of rock that yields, and of rock that cracks."""
NO_CRACKS = """
tension = mixed = shear = 0
energy_error = math.nan
"""
REPORT = """
# Lunder & Pakalnis (1997), Determination of the strength of hard-rock mine pillars, CIM Bulletin 90 (1013), 51-55. What
# the rock mass bears, there 0.44 of the strength of specimens, is here the strength of this rock without confinement.
unconfined = 2 * cohesion * math.tan(math.radians(45 + 0.5 * friction))
confinement = 0.46 * math.log10(width / height + 0.75)**(1.4 * height / width) if width > 0.25 * height else 0.0
empirical = unconfined * (0.68 + 0.52 * math.tan(math.acos((1 - confinement) / (1 + confinement))))
print('the pillar bears %.5g MPa, at a convergence of %.4g mm; %.3g times its stress after the excavation'
      % (strength/1e6, 1e3*at_strength, factor))
print('without confinement the rock bears %.4g MPa; after Lunder and Pakalnis the pillar %.4g MPa'
      % (unconfined/1e6, empirical/1e6))
print('broken joints: %d in tension, %d mixed, %d in shear' % (tension, mixed, shear))
points = [(1e3 * u, s / 1e6) for u, s in curve]
dug = [(1e3 * u, s / 1e6) for u, s in curve[:openings + 1]]
pcdc chart create 'pillar' x-label 'convergence (mm)' y-label 'mean stress in the pillar (MPa)'
pcdc chart add 'pillar' values [points] label 'pillar'
pcdc chart add 'pillar' values [dug] label 'stages of excavation' style points
ends = [(0, empirical / 1e6), (points[-1][0], empirical / 1e6)]
pcdc chart add 'pillar' values [ends] label 'Lunder and Pakalnis'
pcdc chart export 'pillar' 'pillar.png' SHOWN
pcdc chart create 'stress' x-label 'from the middle of the pillar (m)' y-label 'vertical stress (MPa)'
for k in range(len(profiles)):
    across = [(x, s / 1e6) for x, s in profiles[k]]
    name = 'rooms of %.3g m' % stages[k][0] if k < openings else 'at the strength'
    pcdc chart add 'stress' values [across] label '[name]'
pcdc chart export 'stress' 'stress.png'
"""

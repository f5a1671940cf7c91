"""A wedge of rock between two joints in a slope, whose friction is divided by a factor until the wedge slides out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import model_validator

from hpcdem.cases.base import Case, quantity


@dataclass(frozen=True)
class Release:
    """Result of the case.

    factor: factor of safety, the mean of `stands`, the largest factor at which the wedge stayed, and `slides`, the
    smallest at which it slid; equilibrium: factor of the closed form; error: relative deviation from it; plunge, trend:
    of the line of intersection of the joints [degrees]; trend_moved: of the displacement of the wedge [degrees]; volume
    [m3]; trials: per trial (factor, displacement [m], unbalanced ratio, steps).
    """

    factor: float
    stands: float
    slides: float
    equilibrium: float
    error: float
    plunge: float
    trend: float
    trend_moved: float
    volume: float
    trials: list[tuple[float, float, float, int]] = field(repr=False)


class Wedge(Case):
    """A slope of intact rock with two joints, which cut a wedge out of its face and its crest."""

    name: ClassVar[str] = "wedge"
    title: ClassVar[str] = "Sliding of a wedge between two joints of a slope"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Release

    height: float = quantity(10.0, "m", "from the point where the joints meet in the face up to the top", gt=0)
    face: float = quantity(65.0, "degrees", "dip of the face, which dips towards y", gt=0, lt=90)
    dip_a: float = quantity(40.0, "degrees", "dip of joint A", gt=0, lt=90)
    towards_a: float = quantity(
        -45.0, "degrees", "dip direction of joint a, clockwise from that of the face", gt=-180, lt=180
    )
    friction_a: float = quantity(35.0, "degrees", "friction angle of joint a", gt=0, lt=80)
    dip_b: float = quantity(70.0, "degrees", "dip of joint B", gt=0, lt=90)
    towards_b: float = quantity(
        75.0, "degrees", "dip direction of joint b, clockwise from that of the face", gt=-180, lt=180
    )
    friction_b: float = quantity(20.0, "degrees", "friction angle of joint b", gt=0, lt=80)
    margin: float = quantity(0.4, "1", "rock around the wedge, over height", gt=0, le=5)
    size: float = quantity(1.5, "m", "edges of the elements at the wedge", gt=0)
    coarse: float = quantity(4.0, "m", "edges of the elements far from it", gt=0)
    gravity: float = quantity(9.81, "m/s2", "acceleration of gravity, downwards", gt=0)
    density: float = quantity(2600.0, "kg/m3", "density", gt=0)
    young: float = quantity(5e9, "Pa", "Young's modulus", gt=0)
    poisson: float = quantity(0.25, "1", "Poisson's ratio", ge=0, lt=0.5)
    first: float = quantity(1.0, "1", "first trial factor", gt=0)
    precision: float = quantity(0.02, "1", "the factor lies in a range of this width over itself", gt=0, le=0.2)
    balance: float = quantity(1e-4, "1", "unbalanced ratio below which the wedge is stable", gt=0, le=1e-2)
    patience: int = quantity(20000, "1", "steps after which it is unstable", ge=1000)
    collapse: float = quantity(1e-3, "1", "displacement with which it slides, over height", gt=0, le=0.1)

    @model_validator(mode="after")
    def _fits(self) -> Wedge:
        if not 0.0 < self.plunge() < self.face:
            raise ValueError(
                f"the joints meet along a line that plunges by {self.plunge():.3g} degrees against the face, "
                f"expected more than 0 and less than face, {self.face:g}: otherwise no wedge can slide out"
            )
        if self.coarse < self.size or self.size > 0.5 * self.height:
            raise ValueError("size: expected at most half of height, and at most coarse")
        return self

    def plunge(self) -> float:
        """Return the plunge of the line of intersection, as seen in the plane perpendicular to the face [degrees]."""
        (ax, ay, az), (bx, by, bz) = (
            (math.sin(d) * math.sin(t), math.sin(d) * math.cos(t), math.cos(d))
            for d, t in ((math.radians(dip), math.radians(towards)) for dip, towards in
                         ((self.dip_a, self.towards_a), (self.dip_b, self.towards_b)))
        )  # fmt: skip
        y, z = az * bx - ax * bz, ax * by - ay * bx
        return math.degrees(math.atan2(-z, y) if y > 0 else math.atan2(z, -y))

    def model(self) -> str:
        return SLOPE

    def loading(self) -> str:
        return EQUILIBRIUM + SEARCH


SLOPE = """
import numpy as np
# Normals, upwards. The joints meet the face in the origin; the face dips towards y, the top is flat.
def normal_of(dip, towards):
    dip, towards = math.radians(dip), math.radians(towards)
    return np.array([math.sin(dip)*math.sin(towards), math.sin(dip)*math.cos(towards), math.cos(dip)])
def meet(*planes):                               # point where three planes (normal, offset) meet
    return np.linalg.solve(np.array([normal for normal, _ in planes]), np.array([offset for _, offset in planes]))
joint_a, joint_b = (normal_of(dip_a, towards_a), 0.0), (normal_of(dip_b, towards_b), 0.0)
front, top = (normal_of(face, 0.0), 0.0), (np.array([0.0, 0.0, 1.0]), height)
low, back = np.zeros(3), meet(joint_a, joint_b, top)
left_a, right_b = meet(joint_a, front, top), meet(joint_b, front, top)
corners = np.array([low, back, left_a, right_b])
volume = abs(float(np.linalg.det(corners[1:]))) / 6

pcdc model new dim 3
around = margin * height
x0, x1 = float(corners[:, 0].min()) - around, float(corners[:, 0].max()) + around
run = 1 / math.tan(math.radians(face))           # of the face, along y
behind = float(corners[:, 1].min()) - around
outline = [(x0, around*run, -around), (x0, -height*run, height), (x0, behind, height), (x0, behind, -around)]
pcdc geometry create polygon [outline] as-layer 'profile'
pcdc geometry create extrude layer 'profile' along ([x1 - x0],0,0) as-layer 'slope'
for name, corner in (('joint a', left_a), ('joint b', right_b)):
    rim = [tuple(float(c) for c in p) for p in (low, back, corner)]
    pcdc geometry create polygon [rim] as-layer '[name]'
pcdc mesh create from-layer 'slope' size [coarse] refine-layer 'joint a' size [size] distance [3*coarse] \\
    refine-layer 'joint b' size [size] distance [3*coarse] crack 'joint a' crack 'joint b' group 'rock'
pcdc element c-model mech-iso-e property density [density] young [young] poisson-r [poisson]
pcdc element-face c-model contact-m-c property friction 75 penalty-normal [young] penalty-shear [young]

# What is not the face or the top is held.
near = 1e-6 * height
for place in (x0, x1):
    pcdc node boundary mech-m-b-c type 1 range x [place - near] [place + near]
pcdc node boundary mech-m-b-c type 1 range y [behind - near] [behind + near]
pcdc node boundary mech-m-b-c type 1 range z [-around - near] [-around + near]
pcdc model gravity (0,0,[-gravity])
pcdc model option dynamic off
pcdc model solve ratio [balance] cycles [patience]
pcdc node reset displacement
pcdc model save 'wedge.sav'

# The middle of the wedge's top shows where it goes.
numbers = pcdc.numbers('node')
places = np.column_stack([pcdc.values('node', 'position-' + axis) for axis in 'xyz'])
inside = ((places @ joint_a[0] > near) & (places @ joint_b[0] > near))
spot = int(numbers[inside][np.linalg.norm(places[inside] - corners[1:].mean(axis=0), axis=1).argmin()])
"""
EQUILIBRIUM = """
# Limit equilibrium: forces normal to both joints and along their line carry the weight (Hoek & Bray 1981, ch. 8).
line = np.cross(joint_a[0], joint_b[0])
line *= -np.sign(line[2]) / np.linalg.norm(line)
press_a, press_b, pull = np.linalg.solve(np.column_stack([joint_a[0], joint_b[0], -line]), np.array([0.0, 0.0, 1.0]))
tan_a, tan_b = math.tan(math.radians(friction_a)), math.tan(math.radians(friction_b))
equilibrium = float((press_a * tan_a + press_b * tan_b) / pull)
plunge = math.degrees(math.asin(-float(line[2])))
trend = math.degrees(math.atan2(float(line[0]), float(line[1])))
"""
SEARCH = """
# Each trial begins with the settled slope; tan(friction) is that of the joints over the factor. Up or down by a
# quarter, then by halves, until the range in which the wedge slides is small enough. The last one shows how.
trials, stands, slides, shown, trend_moved = [], 0.0, math.inf, 0.0, math.nan
while math.isinf(slides) or slides - stands > precision * slides or shown != slides:
    if not math.isinf(slides) and slides - stands <= precision * slides:
        factor = slides                          # once more, to be seen
    elif math.isinf(slides):
        factor = 1.25 * stands if stands > 0 else first
    else:
        factor = 0.5 * (stands + slides) if stands > 0 else slides / 1.25
    if not 0.01 < factor < 100:
        raise SystemExit('no factor of safety between 0.01 and 100: the last was %g' % factor)
    pcdc model restore 'wedge.sav'
    for name, angle in (('joint a', friction_a), ('joint b', friction_b)):
        reduced = math.degrees(math.atan(math.tan(math.radians(angle)) / factor))
        pcdc element-face property friction [reduced] range geometry '[name]'
    steps, moved = 0, 0.0
    while steps < patience and moved < collapse * height:
        pcdc model solve ratio [balance] cycles 500
        steps += pcdc.solved['steps']
        moved_by = pcdc.node(spot).displacement
        moved = math.sqrt(moved_by.X**2 + moved_by.Y**2 + moved_by.Z**2)
        if pcdc.ratio <= balance:
            break
    shown = factor
    if factor != slides:
        stays = moved < collapse * height and pcdc.ratio <= balance
        trials.append((factor, moved, pcdc.ratio, steps))
        if stays:
            stands = factor
        else:
            slides, trend_moved = factor, math.degrees(math.atan2(moved_by.X, moved_by.Y))
        what = 'stays' if stays else 'slides'
        print('factor %.4g: %s, moved by %.4g mm, %d steps' % (factor, what, 1e3 * moved, steps))
factor = 0.5 * (stands + slides)
error = factor / equilibrium - 1
print('factor of safety %.4g, by limit equilibrium %.4g: %.2g %% off' % (factor, equilibrium, 100 * error))
print('the joints meet along a line towards %.4g degrees, the wedge went towards %.4g' % (trend, trend_moved))
pcdc output vtk 'wedge'
pcdc chart create 'wedge' x-label 'factor' y-label 'displacement of the wedge (mm)'
points = sorted((trial[0], 1e3 * trial[1]) for trial in trials)
pcdc chart add 'wedge' values [points] style points
pcdc chart export 'wedge' 'wedge.png'
"""

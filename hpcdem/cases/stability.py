"""Factor of safety of a slope by strength reduction."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from pydantic import model_validator

from hpcdem.cases.base import Case, choice, quantity


@dataclass(frozen=True)
class Stability:
    """Result of the case.

    factor: factor of safety, the mean of `stands`, the largest factor at which the slope reached equilibrium, and
    `falls`, the smallest at which it did not; movement: largest displacement since gravity settled, at the factor
    `stands` [m]; trials: per trial (factor, largest displacement [m], unbalanced ratio, steps).
    """

    factor: float
    stands: float
    falls: float
    movement: float
    trials: list[tuple[float, float, float, int]] = field(repr=False)


class SlopeStability(Case):
    """A slope of one soil under gravity, whose strength is divided by a factor until it fails."""

    name: ClassVar[str] = "stability"
    title: ClassVar[str] = "Factor of safety of a slope by strength reduction"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Stability

    elements: Literal["tri", "quad"] = choice("quad", "triangles or quads")
    height: float = quantity(10.0, "m", "height of the slope", gt=0)
    angle: float = quantity(26.565, "degrees", "angle of the slope", gt=5, le=90)
    behind: float = quantity(12.0, "m", "from the left side of the model to the crest", gt=0)
    before: float = quantity(0.0, "m", "from the toe to the right side of the model", ge=0)
    below: float = quantity(0.0, "m", "from the toe to the bottom of the model", ge=0)
    size: float = quantity(0.5, "m", "edges of the elements", gt=0)
    gravity: float = quantity(9.81, "m/s2", "acceleration of gravity, downwards", gt=0)
    density: float = quantity(2000.0, "kg/m3", "density", gt=0)
    young: float = quantity(100e6, "Pa", "Young's modulus", gt=0)
    poisson: float = quantity(0.3, "1", "Poisson's ratio", ge=0, lt=0.5)
    cohesion: float = quantity(10e3, "Pa", "cohesion", gt=0)
    friction: float = quantity(20.0, "degrees", "friction angle", ge=0, lt=90)
    dilation: float = quantity(0.0, "degrees", "dilation angle", ge=0, lt=90)
    tensile_strength: float = quantity(1e6, "Pa", "tensile strength; limited to cohesion / tan(friction)", ge=0)
    first: float = quantity(1.0, "1", "the factor that is tried first", gt=0)
    precision: float = quantity(0.01, "1", "the factor lies in a range of this width over itself", gt=0, le=0.2)
    balance: float = quantity(1e-6, "1", "unbalanced ratio below which the slope is stable", gt=0, le=1e-3)
    patience: int = quantity(100000, "1", "steps after which it is unstable", ge=1000)
    collapse: float = quantity(0.01, "1", "displacement at failure, over height", gt=0, le=0.5)

    @model_validator(mode="after")
    def _fits(self) -> SlopeStability:
        if (self.before > 0.0) != (self.below > 0.0):
            raise ValueError("before and below: expected both 0, for a slope on a firm base, or none of them")
        if self.size > 0.25 * self.height:
            raise ValueError(f"size is {self.size:g}, expected at most a quarter of height, {0.25 * self.height:g} m")
        if self.angle == 90.0 and self.below == 0.0:
            raise ValueError("angle is 90: a vertical face requires soil before and below it")
        if self.dilation > self.friction:
            raise ValueError(f"dilation is {self.dilation:g}, expected at most friction, {self.friction:g} degrees")
        return self

    def model(self) -> str:
        return GROUND.replace("KIND", "type quad" if self.elements == "quad" else "irregular")

    def loading(self) -> str:
        return SEARCH


GROUND = """
# x = 0 is the crest, y = 0 the toe.
length = height / math.tan(math.radians(angle)) if angle < 90 else 0.0
corners = [Vector(-behind, -below), Vector(length + before, -below)]
if before > 0:
    corners += [Vector(length + before, 0), Vector(length, 0)]
corners += [Vector(0, height), Vector(-behind, height)]

pcdc model new
pcdc geometry create polygon [corners] as-layer 'outline'
pcdc mesh create from-layer 'outline' size [size] KIND group 'soil'

# Gravity settles in soil that does not yield.
pcdc element c-model mech-m-c property density [density] young [young] poisson-r [poisson] friction [friction] \\
    cohesion 1e12 tensile 1e12 dilation [dilation]
# Rollers on the sides, a rough base.
near = 1e-6 * height
pcdc node boundary mech-m-b-c type 2 (0,1) range x [-behind - near] [-behind + near]
if before > 0:
    pcdc node boundary mech-m-b-c type 2 (0,1) range x [length + before - near] [length + before + near]
pcdc node boundary mech-m-b-c type 1 (0,0) range y [-below - near] [-below + near]
pcdc model gravity (0,[-gravity])
pcdc model option dynamic off
pcdc model option collision off
pcdc model solve ratio [balance]
pcdc node reset displacement
pcdc model save 'stability.sav'
"""
SEARCH = """
# Each trial begins with the settled slope; its strength is that of the soil over the factor. Up or down by a quarter,
# then by halves, until the range in which the slope comes down is small enough. The last one shows how.
import numpy as np
trials, stands, falls, movement, shown = [], 0.0, math.inf, 0.0, 0.0
while math.isinf(falls) or falls - stands > precision * falls or shown != falls:
    if not math.isinf(falls) and falls - stands <= precision * falls:
        factor = falls                           # once more, to be seen
    elif math.isinf(falls):
        factor = 1.25 * stands if stands > 0 else first
    else:
        factor = 0.5 * (stands + falls) if stands > 0 else falls / 1.25
    if not 0.01 < factor < 100:
        raise SystemExit('no factor of safety between 0.01 and 100: the last was %g' % factor)
    pcdc model restore 'stability.sav'
    reduced = math.degrees(math.atan(math.tan(math.radians(friction)) / factor))
    pcdc element property friction [reduced] cohesion [cohesion/factor] tensile [tensile_strength/factor] \\
        dilation [min(dilation, reduced)]
    steps, moved = 0, 0.0
    while steps < patience and moved < collapse * height:
        pcdc model solve ratio [balance] cycles 1000
        steps += pcdc.solved['steps']
        moved = float(np.hypot(pcdc.values('node', 'displacement-x'), pcdc.values('node', 'displacement-y')).max())
        if pcdc.ratio <= balance:
            break
    shown = factor
    if factor != falls:
        trials.append((factor, moved, pcdc.ratio, steps))
        if pcdc.ratio <= balance:
            stands, movement = factor, moved
            print('factor %.4g: stands, moved by %.4g mm, %d steps' % (factor, 1e3*moved, steps))
        else:
            falls = factor
            print('factor %.4g: comes down, moved by %.4g mm, %d steps' % (factor, 1e3*moved, steps))
factor = 0.5 * (stands + falls)
print('factor of safety %.4g: stands with %.4g, comes down with %.4g' % (factor, stands, falls))
pcdc output vtk 'stability'
pcdc chart create 'stability' x-label 'factor' y-label 'largest displacement (m)'
stood = [trial[:2] for trial in trials if trial[0] <= stands]
fell = [trial[:2] for trial in trials if trial[0] >= falls]
if stood:
    pcdc chart add 'stability' values [stood] label 'stands' style points
pcdc chart add 'stability' values [fell] label 'comes down' style points
line = [(factor, 0.0), (factor, max(trial[1] for trial in trials))]
pcdc chart add 'stability' values [line] label ['factor of safety %.3g' % factor]
pcdc chart export 'stability' 'stability.png' plastic
"""

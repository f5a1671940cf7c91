"""Three-point bend of a beam of rock, with or without a notch."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from pydantic import model_validator

from hpcdem.cases.base import choice, quantity
from hpcdem.cases.rock import CRACKS, PROPERTIES, Rock


@dataclass(frozen=True)
class Bending:
    """Loads are forces per metre of thickness [N/m], deflections those of the load [m].

    peak, peak_deflection: largest load; first: load at which the first joint has passed its strength; stiffness [Pa]:
    load over deflection below a third of the peak; sagging [Pa]: load over the deflection of mid-span relative to the
    supports, on the axis of the beam; work [J/m]: of the load until the end, minus the kinetic energy then; tail [J/m]:
    further work if the load kept falling with one over the deflection squared; crack [m]: length of all broken joints;
    tension, mixed, shear: broken joints by mode; energy_error: closing error of the energy budget over its largest
    flow; curve: (deflection, load) pairs.
    """

    peak: float
    peak_deflection: float
    first: float
    stiffness: float
    sagging: float
    work: float
    tail: float
    crack: float
    tension: int
    mixed: int
    shear: int
    energy_error: float
    curve: list[tuple[float, float]] = field(repr=False)


class ThreePointBend(Rock):
    """Three-point bending: a beam on two supports is loaded in the middle until it breaks in two."""

    name: ClassVar[str] = "bend"
    title: ClassVar[str] = "Three-point bend of a beam of rock"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Bending

    span: float = quantity(0.200, "m", "distance of the supports", gt=0)
    height: float = quantity(0.050, "m", "height of the beam", gt=0)
    overhang: float = quantity(0.020, "m", "length of the beam beyond each support", gt=0)
    notch: float = quantity(0.020, "m", "depth of the notch at mid-span, a closed cut; 0: none", ge=0)
    path: Literal["line", "free"] = choice(
        "line", "line: edges of the mesh form a straight line from the notch to the load; free: an irregular mesh"
    )
    size: float = quantity(0.0025, "m", "edges of the elements at mid-span", gt=0)
    coarse: float = quantity(0.008, "m", "edges of the elements at the ends", gt=0)
    band: float = quantity(0.015, "m", "distance from mid-span within which elements have joints", gt=0)
    damping: float = quantity(0.05, "1", "viscous damping of the elements, part of the critical", ge=0, le=1)
    friction: float = quantity(35.0, "degrees", "friction angle of joints and cracks", ge=0, lt=90)
    cohesion: float = quantity(20e6, "Pa", "cohesion of the joints", gt=0)
    tensile_strength: float = quantity(4e6, "Pa", "tensile strength of the joints", gt=0)
    gf1: float = quantity(50.0, "N/m", "fracture energy of opening (mode I)", gt=0)
    gf2: float = quantity(500.0, "N/m", "fracture energy of sliding (mode II)", gt=0)
    penalty_overlay: float = quantity(10.0, "1", "penalty of closed joints, over young", gt=0)
    periods: float = quantity(
        4.0, "1", "periods of the lowest mode of the beam until the elastic stress reaches the strength", ge=1
    )
    hurry: float = quantity(3.0, "1", "factor on the loading speed after the load has fallen to 0.7 of its peak",
                            ge=1)  # fmt: skip
    stop: float = quantity(0.03, "1", "end of the test: fraction of the peak load", gt=0, lt=0.7)
    most: float = quantity(100.0, "1",
                           "end of the test in any case: deflection over that of the elastic beam at its strength",
                           gt=1)  # fmt: skip

    @model_validator(mode="after")
    def _fits(self) -> ThreePointBend:
        if self.span < 2.0 * self.height:
            raise ValueError(f"span is {self.span:g}, expected at least twice height, {2.0 * self.height:g} m")
        if self.notch > 0.8 * self.height:
            raise ValueError(f"notch is {self.notch:g}, expected at most 0.8 of height, {0.8 * self.height:g} m")
        if self.size > 0.25 * (self.height - self.notch):
            ligament = 0.25 * (self.height - self.notch)
            raise ValueError(f"size is {self.size:g}, expected at most a quarter of the ligament, {ligament:g} m")
        if self.coarse < self.size:
            raise ValueError(f"coarse is {self.coarse:g}, expected at least size, {self.size:g} m")
        if not self.size <= self.band <= 0.5 * self.span:
            raise ValueError(f"band is {self.band:g}, expected size to half of span, {0.5 * self.span:g} m")
        return self

    def model(self) -> str:
        lines = "" if self.path == "free" else LINE
        cut = NOTCH if self.notch > 0.0 else ""
        embed = ("crack 'notch' " if self.notch > 0.0 else "") + ("embed 'line' " if self.path == "line" else "")
        properties = PROPERTIES.replace("face-of 'rock' set 'body'", "face-of 'middle' set 'jointed'")
        return OUTLINE + cut + lines + MESH.replace("EMBED", f"embed 'gauges' {embed}") + BAND + properties + HELD

    def loading(self) -> str:
        return LOADING + CRACKS + REPORT


OUTLINE = """
left, right = -0.5 * span - overhang, 0.5 * span + overhang

pcdc model new
# Corners at the supports and under the load: there are points of the mesh.
pcdc geometry create polygon ([left],0) ([-0.5*span],0) (0,0) ([0.5*span],0) ([right],0) ([right],[height]) \\
    (0,[height]) ([left],[height]) as-layer 'outline'
pcdc geometry create point ([-0.5*span],[0.5*height]) ([0.5*span],[0.5*height]) as-layer 'gauges'
pcdc geometry create polyline (0,0) (0,[height]) as-layer 'mid-span'
"""
NOTCH = """\
pcdc geometry create polyline (0,0) (0,[notch]) as-layer 'notch'
"""
LINE = """\
pcdc geometry create polyline (0,[notch]) (0,[height]) as-layer 'line'
"""
MESH = """\
pcdc mesh create from-layer 'outline' size [coarse] refine-layer 'mid-span' size [size] distance [0.5*span] \\
    EMBEDirregular group 'rock' set 'body'
"""
BAND = """
# Joints are where cracks may run; the rest is elastic.
pcdc element group 'middle' set 'jointed' range x [-band] [band]
"""
HELD = """
for name, x, y in (('left', -0.5 * span, 0.0), ('right', 0.5 * span, 0.0), ('load', 0.0, height)):
    pcdc node group '[name]' set 'held' range x [x - 1e-6*span] [x + 1e-6*span] y [y - 1e-6*span] [y + 1e-6*span]
pcdc node boundary mech-m-b-c type 1 (0,0) range group 'left' set 'held'
pcdc node boundary mech-m-b-c type 2 (1,0) range group 'right' set 'held'
"""
LOADING = """
# The lowest mode of a beam on two supports limits the loading speed.
plane = young / (1 - poisson**2)
period = 2 * span**2 / (math.pi * height) * math.sqrt(12 * density / plane)
elastic = tensile_strength * span**2 / (6 * plane * height)       # deflection at which the stress is the strength
speed = elastic / (periods * period)
pcdc table create 'slow' values (0,0) ([2*period],[-speed])
pcdc node boundary mech-vel-b-c velocity-y table 'slow' range group 'load' set 'held'

pcdc model option energy on
pcdc model step 1                                # the time step is known from here on
every = max(1, round(period / 100 / pcdc.time))
pcdc history create 'load' node value reaction-y sum every [every] range group 'load' set 'held'
pcdc history create 'displacement' node value displacement-y mean every [every] range group 'load' set 'held'
for name, x in (('left', -0.5 * span), ('middle', 0.0), ('right', 0.5 * span)):
    pcdc history create 'axis [name]' node nearest ([x],[0.5*height]) value displacement-y every [every]
pcdc history create 'yielded' model value yielded-joints every [every]
pcdc history create 'cracks' model value broken-joints every [every]
pcdc output vtk 'bend'

# Load slowly over the peak, then faster to the end: the halves turn evenly, which takes no force.
load = peak = deflection = 0.0
falling = False
while deflection < most * elastic and (not falling or load > stop * peak):
    pcdc model solve time [0.5*period]
    load = -pcdc.history('load')[-200 if falling else -25:, 2].mean()        # tail: over two periods
    peak, deflection = max(peak, load), -pcdc.history('displacement')[-1, 2]
    if not falling and load < 0.7 * peak:
        falling, now = True, pcdc.time
        pcdc output vtk 'bend'
        pcdc table create 'fast' values ([now],[-speed]) ([now + 4*period],[-hurry*speed])
        pcdc node boundary mech-vel-b-c velocity-y table 'fast' range group 'load' set 'held'
pcdc output vtk 'bend'

import numpy as np
loads, deflections, left, middle, right = (-pcdc.history(name)[:, 2]
                                    for name in ('load', 'displacement', 'axis left', 'axis middle', 'axis right'))
curve = list(zip(deflections.tolist(), loads.tolist()))
peak, peak_deflection = float(loads.max()), float(deflections[loads.argmax()])
rising = (loads > 0.1 * peak) & (loads < peak / 3) & (deflections < peak_deflection)
stiffness, sagging = (float(np.polyfit(by[rising], loads[rising], 1)[0]) if rising.sum() > 1 else math.nan
                      for by in (deflections, middle - 0.5 * (left + right)))
yielded = np.flatnonzero(pcdc.history('yielded')[:, 2])
first = float(loads[yielded[0]]) if len(yielded) else math.nan
work = float((0.5 * (loads[1:] + loads[:-1]) * np.diff(deflections)).sum()) - pcdc.energies['kinetic']
tail = max(load, 0.0) * deflection                      # of a load as one over the deflection squared
crack = float(pcdc.values('joint', 'length')[pcdc.values('joint', 'state') == 3].sum())
"""
REPORT = """
ligament = height - notch
print('largest load %.5g N/m at %.4g mm; bending stress %.4g MPa at first crack, %.4g MPa at the largest load'
      % (peak, 1e3 * peak_deflection, 1.5e-6 * first * span / ligament**2, 1.5e-6 * peak * span / ligament**2))
print('work %.4g J/m + tail %.2g J/m: %.4g N/m over the ligament, %.4g N/m over the broken joints'
      % (work, tail, (work + tail) / ligament, (work + tail) / crack if crack else math.nan))
print('broken joints: %d in tension, %d mixed, %d in shear' % (tension, mixed, shear))
points = [(1e3 * u, p / 1e3) for u, p in curve]
pcdc chart create 'bend' x-label 'deflection (mm)' y-label 'load (kN/m)'
pcdc chart add 'bend' values [points] label 'beam'
pcdc chart export 'bend' 'bend.png' cracks
"""

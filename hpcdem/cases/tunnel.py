"""Excavation of a tunnel in stressed rock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from pydantic import model_validator

from hpcdem.cases.base import choice, quantity
from hpcdem.cases.rock import CRACKS, PROPERTIES, WAVES, Rock


@dataclass(frozen=True)
class Excavation:
    """crown, floor, left, right [m]: displacement of these points of the wall into the tunnel; convergence [m]: its
    mean over the nodes of the wall (mean displacement towards the centre); hoop_most, hoop_least [Pa]: largest and
    least compressive stress beside the wall (the larger principal stress of the elements there, compression positive);
    ratio: unbalanced forces over all at the end; tension, mixed, shear: broken joints by mode (elastic: 0);
    energy_error: closing error of the energy budget over its largest flow (elastic: NaN, as it is solved
    statically)."""

    crown: float
    floor: float
    left: float
    right: float
    convergence: float
    hoop_most: float
    hoop_least: float
    ratio: float
    tension: int
    mixed: int
    shear: int
    energy_error: float


class Tunnel(Rock):
    """A tunnel: a circle or a horseshoe is excavated gradually from rock under stress."""

    name: ClassVar[str] = "tunnel"
    title: ClassVar[str] = "Excavation of a tunnel in stressed rock"
    needs: ClassVar[str] = "mesh"
    result: ClassVar[type] = Excavation

    shape: Literal["circular", "horseshoe"] = choice(
        "circular", "circular; horseshoe: a half circle over walls and a level floor"
    )
    elements: Literal["tri", "quad"] = choice("tri", "triangles or quads")
    joints: bool = choice(False, "with joints that crack around the tunnel; without them the rock is elastic")
    radius: float = quantity(2.0, "m", "radius of the tunnel, or of its crown", gt=0)
    wall: float = quantity(2.0, "m", "height of the walls of the horseshoe", gt=0)
    reach: float = quantity(12.0, "1", "from the centre to the sides of the model, over radius", ge=4)
    size: float = quantity(0.2, "m", "edges of the elements at the tunnel", gt=0)
    coarse: float = quantity(4.0, "m", "edges of the elements at the sides of the model", gt=0)
    stress_xx: float = quantity(-10e6, "Pa", "horizontal stress before the excavation, compression negative", le=0)
    stress_yy: float = quantity(-20e6, "Pa", "vertical stress before the excavation", le=0)
    zone: float = quantity(2.5, "1", "radius of the jointed zone, over radius", gt=1)
    relax: float = quantity(20.0, "1", "wave transits of the jointed zone while excavated rock is released", gt=0)
    rest: float = quantity(20.0, "1", "wave transits of the jointed zone afterwards", gt=0)
    cohesion: float = quantity(6e6, "Pa", "cohesion of the joints", gt=0)
    gf1: float = quantity(100.0, "N/m", "fracture energy of opening (mode I)", gt=0)
    gf2: float = quantity(1000.0, "N/m", "fracture energy of sliding (mode II)", gt=0)
    penalty_overlay: float = quantity(10.0, "1", "penalty of closed joints, over young", gt=0)

    @model_validator(mode="after")
    def _fits(self) -> Tunnel:
        if self.size > 0.5 * self.radius:
            raise ValueError(f"size is {self.size:g}, expected at most half of radius, {0.5 * self.radius:g} m")
        if self.coarse < self.size:
            raise ValueError(f"coarse is {self.coarse:g}, expected at least size, {self.size:g} m")
        if self.shape == "horseshoe" and self.wall > 0.5 * self.reach * self.radius:
            most = 0.5 * self.reach * self.radius
            raise ValueError(f"wall is {self.wall:g}, expected at most half the distance to the side, {most:g} m")
        if self.zone > 0.9 * self.reach:
            raise ValueError(f"zone is {self.zone:g}, expected at most 0.9 of reach, {0.9 * self.reach:g}")
        if self.stress_xx == 0.0 and self.stress_yy == 0.0:
            raise ValueError("stress_xx and stress_yy are both 0, expected a stress")
        return self

    def model(self) -> str:
        outline = CIRCLE if self.shape == "circular" else HORSESHOE
        lines = OUTLINE + outline + MESH.replace("KIND", "type quad" if self.elements == "quad" else "irregular")
        return lines + (JOINTED if self.joints else ELASTIC) + STRESSED

    def loading(self) -> str:
        return (CRACKING + CRACKS if self.joints else RELAXING) + MEASURED + REPORT


OUTLINE = """
side = reach * radius

pcdc model new
# Corners in the middle of the sides: points of the mesh that can be held.
pcdc geometry create polygon ([-side],[-side]) (0,[-side]) ([side],[-side]) ([side],0) ([side],[side]) \\
    (0,[side]) ([-side],[side]) ([-side],0) as-layer 'outline'
"""
ROUND = """\
pcdc geometry create circle (0,0) [radius] as-layer 'wall'
"""
CIRCLE = "bottom = -radius\n" + ROUND
HORSESHOE = """\
bottom = -wall
pieces = max(12, round(math.pi * radius / size))
arch = [Vector(radius * math.cos(math.pi * k / pieces), radius * math.sin(math.pi * k / pieces))
        for k in range(pieces + 1)]
arch = [Vector(radius, -wall), Vector(radius, 0), *arch[1:-1], Vector(-radius, 0), Vector(-radius, -wall)]
pcdc geometry create polygon [arch] as-layer 'wall'
"""
MESH = """\
pcdc mesh create from-layer 'outline' size [coarse] refine-layer 'wall' size [size] distance [0.8*side] \\
    region 'wall' group 'core' KIND group 'rock'
"""
ELASTIC = """
pcdc element c-model mech-iso-e property density [density] young [young] poisson-r [poisson]
"""
JOINTED = """
# Joints are near the tunnel only; the rest is elastic.
pcdc geometry create circle (0,0) [zone*radius] as-layer 'zone'
pcdc element group 'near' set 'jointed' range geometry 'zone'
""" + PROPERTIES.replace("face-of 'rock' set 'body'", "face-of 'near' set 'jointed'").lstrip()
STRESSED = """
# The stress that was there before, held by the same stress on the sides.
pcdc element initial stress-xx [stress_xx] stress-yy [stress_yy] stress-zz [poisson*(stress_xx + stress_yy)]
pcdc element-face boundary m-s-b-c stress-xx [stress_xx] stress-yy [stress_yy] range geometry 'outline'
near = 1e-6 * side
for name, x, y, direction in (('left', -side, 0, Vector(1,0)), ('right', side, 0, Vector(1,0)),
                        ('below', 0, -side, Vector(0,1)), ('above', 0, side, Vector(0,1))):
    pcdc node group '[name]' set 'held' range x [x - near] [x + near] y [y - near] [y + near]
    pcdc node boundary mech-m-b-c type 2 [direction] range group '[name]' set 'held'
"""
RELAXING = """
# In balance before, and again after what the core did to the rock has died down.
pcdc model option dynamic off
pcdc model option collision off
pcdc model solve ratio 1e-8 cycles 1000
pcdc node reset displacement
pcdc element c-model null relax 500 range group 'core'
pcdc model solve ratio 1e-7
tension = mixed = shear = 0
energy_error = math.nan
"""
CRACKING = (
    WAVES
    + """\
# Joints take over the stress by closing; displacements count from there.
pcdc model option dynamic off
pcdc model solve ratio 1e-7
pcdc node reset displacement
pcdc node reset velocity

pcdc model option dynamic on
pcdc model option energy on
transit = 2 * zone * radius / speed_of_waves
pcdc element c-model null relax [relax*transit] range group 'core'
pcdc model step 1                                # the time step is known from here on
every = max(1, round(0.1 * transit / pcdc.time))
pcdc history create 'crown' node nearest (0,[radius]) value displacement-y every [every]
pcdc history create 'floor' node nearest (0,[bottom]) value displacement-y every [every]
pcdc history create 'left' node nearest ([-radius],0) value displacement-x every [every]
pcdc history create 'right' node nearest ([radius],0) value displacement-x every [every]
pcdc history create 'cracks' model value broken-joints every [every]
pcdc output vtk 'tunnel' every [50*every]
pcdc model solve time [(relax + rest)*transit]
points = [(1e3 * t, -1e3 * u) for _, t, u in pcdc.history('crown')]
closing = [(1e3 * t, 1e3 * (a - b)) for (_, t, a), (_, _, b) in zip(pcdc.history('left'), pcdc.history('right'))]
pcdc chart create 'tunnel' x-label 'time (ms)' y-label 'into the tunnel (mm)'
pcdc chart add 'tunnel' values [points] label 'crown'
pcdc chart add 'tunnel' values [closing] label 'both walls'
pcdc chart export 'tunnel' 'tunnel.png' cracks
"""
)
MEASURED = """
pcdc output vtk 'tunnel'
import numpy as np
def nodes_of_wall(name):
    return pcdc.values('node', name, geometry='wall')
number = pcdc.numbers('node', geometry='wall')
ux, uy, px, py = (nodes_of_wall(name) for name in ('displacement-x', 'displacement-y', 'position-x', 'position-y'))
px, py = px - ux, py - uy                        # where they were before
def into(x, y, u):
    return float(u[np.hypot(px - x, py - y).argmin()])
crown, floor = -into(0, radius, uy), into(0, bottom, uy)
left, right = into(-radius, 0, ux), -into(radius, 0, ux)
convergence = float(np.nanmean(-(ux * px + uy * py) / np.hypot(px, py)))
x, y, xx, yy, xy = (pcdc.values('element', name) for name in
                    ('element-position-x', 'element-position-y', 'stress-xx', 'stress-yy', 'stress-xy'))
pressed = -0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy)       # the larger compressive stress
away = np.array([np.hypot(px - a, py - b).min() if math.isfinite(a) else math.inf for a, b in zip(x, y)])
beside = (away < 0.8 * size) & np.isfinite(pressed)
hoop_most, hoop_least = float(pressed[beside].max()), float(pressed[beside].min())
ratio = pcdc.ratio
"""
REPORT = """
print('into the tunnel: crown %.4g, floor %.4g, left %.4g, right %.4g, mean %.4g mm'
      % tuple(1e3 * u for u in (crown, floor, left, right, convergence)))
print('compression beside the wall: %.4g to %.4g MPa' % (hoop_least/1e6, hoop_most/1e6))
print('broken joints: %d in tension, %d mixed, %d in shear' % (tension, mixed, shear))
"""

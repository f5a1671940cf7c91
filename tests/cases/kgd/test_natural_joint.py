"""A hydraulic fracture meets a weak joint that holds by friction: it crosses, or opens it and turns (Renshaw & Pollard
1995 at a right angle; Blanton 1986 at others)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.fdem import diagnostics
from tests.conftest import absent
from tests.pcdc.test_time import Rock

STRENGTH, LOW, FRICTION = 5e6, 1e6, 0.6
SCRIPT = """
import math
at, reach, side, size, far, penalty, energy, strength = 0.4, 0.8, 0.4, 0.02, 6.0, 3e12, 100.0, STRENGTH
c, s = math.cos(math.radians(ANGLE)), math.sin(math.radians(ANGLE))
pcdc geometry create polygon (0,[-far]) ([far],[-far]) ([far],[far]) (0,[far]) as-layer 'outline'
pcdc geometry create polyline (0,0) ([at],0) as-layer 'before'
pcdc geometry create polyline ([at],0) ([reach],0) as-layer 'beyond'
pcdc geometry create polyline ([at-side*c],[-side*s]) ([at],0) as-layer 'joint'
pcdc geometry create polyline ([at],0) ([at+side*c],[side*s]) as-layer 'joint'
pcdc mesh create from-layer 'outline' size [far/5] refine-layer 'before' size [size] distance [far] \\
    refine-layer 'beyond' size [size] distance [far] refine-layer 'joint' size [size] distance [far] \\
    embed 'before' embed 'beyond' embed 'joint' irregular smooth group 'rock'
pcdc element c-model mech-iso-e property density 2500 young 30e9 poisson-r 0.25
brittle = energy - 4/3 * size * strength**2 / penalty
for layer in ('before', 'beyond'):
    pcdc face-joint c-model c-i-c-i property friction 30 cohesion [4*strength] tensile-strength [strength] \\
        gf1 [brittle] gf2 [50*energy] penalty-normal [penalty] range geometry [layer]
phi = math.degrees(math.atan(FRICTION))
# Slip takes away next to nothing of its strength: friction stays.
pcdc face-joint c-model c-i-c-i property friction [phi] cohesion 1e5 tensile-strength 1e5 gf1 1 gf2 1e4 \\
    penalty-normal [penalty] range geometry 'joint'
for layer in ('before', 'beyond', 'joint'):
    pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk 1e11 viscosity 1e-8 \\
        aperature-initial 2e-7 aperature-minumum 1e-7 range geometry [layer]
    pcdc face-joint group [layer] set 'part' range geometry [layer]
pcdc element initial stress-xx [-HIGH] stress-yy [-LOW]
pcdc model option dynamic off large-strain off
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
for h in (-far, far):
    pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y [h] [h]
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range x [far] [far]
pcdc model solve elastic
pcdc node boundary hydra-c-f-b flow-rate 5e-5 range x 0 0 y 0 0
pcdc model solve hydraulic time 1.2 dt 0.006
"""


def crosses(angle: float, high: float) -> bool:
    """What criteria say: Renshaw and Pollard at a right angle; Blanton with b = 0.2 at others."""
    if angle == 90.0:
        return high / (STRENGTH + LOW) > 0.35 * (1.0 + 1.0 / FRICTION) / 1.06
    turn = math.cos(2.0 * math.radians(angle)) - 0.2 * math.sin(2.0 * math.radians(angle))
    return turn < 0.0 and (high - LOW) / STRENGTH > -1.0 / turn


@pytest.mark.slow
@pytest.mark.parametrize(
    ("angle", "high"), [(90.0, 2e6), (90.0, 6e6), (90.0, 12e6), (60.0, 2e6), (60.0, 6e6), (30.0, 2e6)]
)
def test_it_crosses_or_turns(tmp_path, angle, high) -> None:
    """Angle between them, and the stress along the fracture; that across it is 1 MPa. Not as Blanton says: at 60
    degrees and 12 MPa, where the joint is near slipping by itself, it slips and the fracture stops."""
    try:
        import gmsh  # noqa: F401
    except ImportError:
        absent("gmsh", "no package gmsh here: install the extra [mesh]")
    text = SCRIPT.replace("ANGLE", repr(angle)).replace("HIGH", repr(high)).replace("STRENGTH", repr(STRENGTH))
    rock = Rock(tmp_path, text.replace("LOW", repr(LOW)).replace("FRICTION", repr(FRICTION)))
    past, slipped = {}, 0.0
    for layer in ("before", "beyond", "joint"):
        joints = rock["pcdc"].numbers("joint", group=layer, set="part")
        state, damage = (diagnostics.values(rock.blocks, name, np.asarray(joints)) for name in ("state", "damage"))
        past[layer] = int(((state == 3) | ((state == 2) & (damage > 0.2))).sum())
        if layer == "joint":
            slipped = int((state >= 2).sum())
    print(angle, high, past, slipped)
    assert past["before"] >= 18
    if crosses(angle, high):
        assert past["beyond"] >= 15 and past["joint"] == 0 and slipped <= 3
    else:
        assert past["beyond"] == 0 and past["joint"] >= 4 and slipped >= 20

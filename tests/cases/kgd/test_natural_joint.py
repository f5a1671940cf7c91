"""A hydraulic fracture meets a weak joint that holds by friction: it crosses, stops, or opens it and turns. Beside
Renshaw & Pollard 1995 (at a right angle) with the extension of Gu & Weng 2010 to others, and Blanton 1986.

They ask different things. For Renshaw, Pollard, Gu and Weng the tip comes near: where its tension has reached the
strength on the joint, has the joint slipped already? For Blanton it has arrived: is less pressure needed to break the
rock beyond, beside which the joint slips by as much as its friction allows, or to open the joint?"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import scipy

from hpcdem.physics.fdem import diagnostics
from tests.conftest import ROOT, absent
from tests.pcdc.test_time import Rock

STRENGTH, LOW = 5e6, 1e6
FOUND = {
    (90.0, 2e6, 0.6): "opens", (90.0, 6e6, 0.6): "crosses", (90.0, 12e6, 0.6): "crosses",
    (75.0, 2e6, 0.6): "opens", (75.0, 6e6, 0.6): "crosses", (75.0, 12e6, 0.6): "crosses",
    (60.0, 2e6, 0.6): "opens", (60.0, 6e6, 0.6): "stops", (60.0, 12e6, 0.6): "stops",
    (60.0, 12e6, 0.75): "crosses", (60.0, 12e6, 0.9): "crosses",
    (45.0, 2e6, 0.6): "opens", (30.0, 2e6, 0.6): "opens",
}  # fmt: skip
"""Angle [degrees], stress along the fracture [Pa], friction of the joint: what happens."""
BEYOND = {(90.0, 12e6, 0.6), (75.0, 12e6, 0.6), (60.0, 12e6, 0.9), (30.0, 2e6, 0.6)}
"""What follows from others, which lie nearer to the criteria; for the figure."""
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


def of_tip(angle: float, friction: float) -> float:
    """Stress [Pa] along the fracture above which its tip breaks the rock at the joint before that slips (Gu & Weng;
    at a right angle nearly that of Renshaw & Pollard); infinity."""
    t = math.radians(angle)
    c, s, c3, s3 = math.cos(0.5 * t), math.sin(0.5 * t), math.cos(1.5 * t), math.sin(1.5 * t)
    tip = c * np.array([[1.0 - s * s3, s * c3], [s * c3, 1.0 + s * s3]])
    across, along = np.array([-math.sin(t), math.cos(t)]), np.array([math.cos(t), math.sin(t)])

    def over(size: float, high: float) -> float:
        return float(np.linalg.eigvalsh(np.diag([-high, -LOW]) + size * tip)[1]) - STRENGTH

    for high in np.arange(LOW, 100e6, 0.1e6):
        stress = np.diag([-high, -LOW]) + scipy.optimize.brentq(over, 0.0, 1e3 * STRENGTH, args=(high,)) * tip
        if abs(along @ stress @ across) < 1e5 - friction * float(across @ stress @ across):
            return float(high)
    return math.inf


def renshaw_pollard(friction: float) -> float:
    """The same at a right angle, with the stress across the fracture for the largest one."""
    return (STRENGTH + LOW) * 0.35 * (1.0 + 1.0 / friction) / 1.06


def blanton(angle: float, friction: float) -> float:
    """Stress [Pa] along the fracture above which less pressure breaks the rock beyond than opens the joint; infinity.
    b for a joint that is long beside what slips."""
    root = math.sqrt(1.0 + math.exp(0.5 * math.pi / friction))
    b = math.log(((1.0 + root) / (1.0 - root)) ** 2) / (2.0 * math.pi)
    turn = math.cos(2.0 * math.radians(angle)) - b * math.sin(2.0 * math.radians(angle))
    return LOW - STRENGTH / turn if turn < 0.0 else math.inf


def test_the_criteria() -> None:
    """By hand; both right-angled ones within a tenth; friction of 0.6 never holds at 60 degrees."""
    assert renshaw_pollard(0.6) == pytest.approx(5.283e6, rel=1e-3)
    assert of_tip(90.0, 0.6) == pytest.approx(renshaw_pollard(0.6), rel=0.1)
    assert blanton(90.0, 0.6) == pytest.approx(LOW + STRENGTH) and blanton(30.0, 0.6) == math.inf
    assert blanton(60.0, 0.6) == pytest.approx(8.726e6, rel=1e-3)
    assert of_tip(60.0, 0.6) == math.inf and of_tip(60.0, 0.9) == pytest.approx(15.2e6, abs=0.2e6)


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "high", "friction"), [one for one in FOUND if one not in BEYOND])
def test_it_crosses_stops_or_opens_the_joint(tmp_path, angle, high, friction) -> None:
    """The stress across the fracture is 1 MPa. Where all criteria agree it is as they say, and within 5 % of them."""
    try:
        import gmsh  # noqa: F401
    except ImportError:
        absent("gmsh", "no package gmsh here: install the extra [mesh]")
    text = SCRIPT.replace("ANGLE", repr(angle)).replace("HIGH", repr(high)).replace("STRENGTH", repr(STRENGTH))
    rock = Rock(tmp_path, text.replace("LOW", repr(LOW)).replace("FRICTION", repr(friction)))
    past, slipped, opened = {}, 0, 0
    for layer in ("before", "beyond", "joint"):
        joints = np.asarray(rock["pcdc"].numbers("joint", group=layer, set="part"))
        state, damage, opening = (diagnostics.values(rock.blocks, n, joints) for n in ("state", "damage", "opening"))
        past[layer] = int(((state == 3) | ((state == 2) & (damage > 0.2))).sum())
        if layer == "joint":
            slipped, opened = int((state >= 2).sum()), int(((state == 3) | (opening > 1e-6)).sum())
    print(angle, high, friction, past, slipped, opened)
    assert past["before"] >= 18
    happens = FOUND[angle, high, friction]
    if happens == "crosses":
        assert past["beyond"] >= 15 and past["joint"] <= 1
    else:
        assert past["beyond"] == 0 and slipped >= 20 and (opened >= 8) == (happens == "opens")
    bounds = [renshaw_pollard(friction) if angle == 90.0 else of_tip(angle, friction), blanton(angle, friction)]
    if high > 1.05 * max(bounds):
        assert happens == "crosses"
    if high < 0.95 * min(bounds):
        assert happens != "crosses"


def draw(path: Path) -> None:
    """What happens, over the angle and the stress along the fracture, and over friction, with the criteria."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.6), sharex=True)
    figure.subplots_adjust(left=0.09, right=0.98, top=0.93, bottom=0.29, wspace=0.25)
    angles, frictions = np.arange(46.0, 90.1, 1.0), np.arange(0.5, 1.01, 0.02)
    looks = {"crosses": ("o", "C2"), "stops": ("s", "C1"), "opens": ("^", "C3")}
    for axes, at, tips, arrived in (
        (left, angles, [of_tip(a, 0.6) for a in angles], [blanton(a, 0.6) for a in angles]),
        (right, frictions, [of_tip(60.0, f) for f in frictions], [blanton(60.0, f) for f in frictions]),
    ):
        axes.plot(np.array(tips) / 1e6, at, "k", lw=1, label="Gu & Weng")
        axes.plot(np.array(arrived) / 1e6, at, "k--", lw=1, label="Blanton")
    left.plot(renshaw_pollard(0.6) / 1e6, 90.0, "k+", ms=10, label="Renshaw & Pollard")
    names = {"crosses": "crosses", "stops": "joint slips, fracture stops", "opens": "opens the joint"}
    for axes, chosen in (
        (left, [(h, a, what) for (a, h, f), what in FOUND.items() if f == 0.6]),
        (right, [(h, f, what) for (a, h, f), what in FOUND.items() if a == 60.0]),
    ):
        for what, (mark, colour) in looks.items():
            points = np.array([(h / 1e6, y) for h, y, w in chosen if w == what])
            axes.plot(*points.reshape(-1, 2).T, mark, color=colour, label=names[what], ls="none", clip_on=False)
        axes.set(xlabel="stress along the fracture (MPa)", xlim=(0.0, 25.0))
    left.set(ylabel="angle between both (degrees)", ylim=(25.0, 92.0))
    right.set(ylabel="friction of the joint", ylim=(0.5, 1.0))
    figure.legend(*left.get_legend_handles_labels(), frameon=False, fontsize=8, ncol=3, loc="lower center")
    for axes, title in ((left, "(a) friction 0.6"), (right, "(b) 60°")):
        axes.set_title(title, loc="left", fontsize=9)
    figure.savefig(path, dpi=200)
    plt.close(figure)


@pytest.mark.figures
def test_the_figure(tmp_path) -> None:
    draw(tmp_path / "natural_joint.png")
    assert (tmp_path / "natural_joint.png").stat().st_size > 20000
    assert "figures/natural_joint.png" in (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    assert (ROOT / "docs" / "figures" / "natural_joint.png").is_file()

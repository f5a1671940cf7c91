"""Two hydraulic fractures grow from one well, beside each other, and one by itself. Into both goes the same, as through
few holes in the casing: each stands in the other's stress, and takes less fluid for its pressure, as cracks do that lie
beside each other (displacement discontinuities of test_shadow.py)."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import scipy

from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.flow.model import Flow
from tests.cases.kgd.test_shadow import discontinuities
from tests.conftest import ROOT, absent
from tests.pcdc.test_time import Rock

APART, SIZE, CONFINEMENT = 0.4, 0.04, 1e6
TIMES = (0.1, 0.2, 0.3, 0.4, 0.5)
SCRIPT = """
heights, reach, size, far, penalty, energy, strength = HEIGHTS, 1.2, SIZE, 8.0, 3e12, 100.0, 5e6
pcdc geometry create polygon (0,[-far]) ([far],[-far]) ([far],[far]) (0,[far]) as-layer 'outline'
for y in heights:
    pcdc geometry create polyline (0,[y]) ([reach],[y]) as-layer 'lines'
pcdc mesh create from-layer 'outline' size [far/6] refine-layer 'lines' size [size] distance [far] embed 'lines' \\
    irregular smooth group 'rock'
pcdc element c-model mech-iso-e property density 2500 young 30e9 poisson-r 0.25
brittle = energy - 4/3 * size * strength**2 / penalty
pcdc face-joint c-model c-i-c-i property friction 30 cohesion [10*strength] tensile-strength [strength] gf1 [brittle] \\
    gf2 [50*energy] penalty-normal [penalty] range geometry 'lines'
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk 1e11 viscosity 1e-8 aperature-initial 2e-7 \\
    aperature-minumum 1e-7 range geometry 'lines'
pcdc element initial stress-xx -5e6 stress-yy [-CONFINEMENT]
pcdc model option dynamic off large-strain off
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
for y in (-far, far):
    pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y [y] [y]
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range x [far] [far]
pcdc model solve elastic
"""
BOTH = """
for y in heights:
    pcdc node boundary hydra-c-f-b flow-rate 5e-5 range x 0 0 y [y] [y]
"""
ONE_WELL = """
pcdc node group 'well' set 'wet' range x 0 0
pcdc well create 'well' range group 'well' set 'wet'
pcdc well stage 'well' rate 1e-4
"""


@pytest.fixture(scope="module")
def pumped(tmp_path_factory):
    """Fractures at these heights into which fluid goes: a function; see `State`."""
    try:
        import gmsh  # noqa: F401
    except ImportError:
        absent("gmsh", "no package gmsh here: install the extra [mesh]")

    @cache
    def made(heights: tuple[float, ...], how: str = BOTH, times: tuple[float, ...] = TIMES) -> list[State]:
        text = SCRIPT + how
        for name, value in (("HEIGHTS", heights), ("SIZE", SIZE), ("CONFINEMENT", CONFINEMENT)):
            text = text.replace(name, repr(value))
        rock = Rock(tmp_path_factory.mktemp("fractures"), text)
        found = []
        for time in times:
            rock(f"pcdc model solve hydraulic time {time - Flow.of(rock.blocks).time!r} dt 0.006\n")
            found.append(State(rock, heights))
        return found

    return made


class State:
    """time [s]; net pressure [Pa]; x (joints,) and openings (fractures, joints), and lengths (fractures,) [m];
    volume [m2] of a wing of one."""

    def __init__(self, rock: Rock, heights: tuple[float, ...]) -> None:
        sim = rock.blocks
        flow = Flow.of(sim)
        joints, middle = flow.numbers("flow-channel"), sim.mesh.points[flow.network.ends].mean(axis=1)
        state, damage = (diagnostics.values(sim, name, joints) for name in ("state", "damage"))
        gone = (state == 3) | ((state == 2) & (damage > 0.2))
        lines = [np.flatnonzero(np.abs(middle[:, 1] - y) < 1e-6) for y in heights]
        lines = [on[np.argsort(middle[on, 0])] for on in lines]
        aperture = flow.values("flow-channel", "aperture")
        self.time, self.pressure = flow.time, float(flow.values("flow-node", "pressure").max()) - CONFINEMENT
        self.x, self.openings = middle[lines[0], 0], np.array([aperture[on] for on in lines])
        self.lengths = [max((middle[on, 0] + 0.5 * SIZE)[gone[on]], default=0.0) for on in lines]
        self.volume = float(self.openings.mean(axis=0).sum()) * SIZE
        middle = 1.5 * self.openings[:, 0].mean() - 0.5 * self.openings[:, 1].mean()
        self.half = half_length(self.volume, float(middle))
        assert flow.account()["relative"] < 1e-12


def half_length(volume: float, middle: float) -> float:
    """Of a wing of an ellipse with this area [m2] and opening in the middle [m]."""
    return 4.0 * volume / (math.pi * middle)


def stiffer(half: float) -> float:
    """p a^2 over the volume of a wing, of one of two cracks that lie APART over that of one by itself, with the same
    `half_length` a."""

    def cracks(length: float) -> tuple[float, float]:
        """a, and p a^2 over the volume, times a modulus."""
        rows = (-0.5 * APART / length, 0.5 * APART / length) if length else (0.0,)
        opening = discontinuities(rows)[1][0]
        volume, n = float(opening.mean()), len(opening) // 2
        a = half_length(volume, float(opening[n - 1 : n + 1].mean()))
        return a * length, a * a / volume

    length = scipy.optimize.brentq(lambda length: cracks(length)[0] - half, 0.5 * half, 1.5 * half, xtol=1e-3 * half)
    return cracks(length)[1] / cracks(0.0)[1]


@pytest.mark.slow
def test_they_shade_each_other(pumped) -> None:
    """Volumes are those of the fluid, p a^2 over them is larger beside each other by what discontinuities say; a as of
    an ellipse with the same opening and volume, for tips go from joint to joint and have a process zone."""
    two, one = pumped((-0.5 * APART, 0.5 * APART)), pumped((0.0,))
    for a, b in zip(two, one):
        stiff = a.pressure * a.half**2 / a.volume / (b.pressure * b.half**2 / b.volume)
        print(a.time, a.lengths, b.lengths, a.half, a.pressure, b.pressure, stiff, stiffer(a.half))
        assert a.volume == pytest.approx(b.volume, rel=0.01)
        assert max(a.lengths) - min(a.lengths) < 1.5 * SIZE and a.pressure > 1.05 * b.pressure
        # Shorter than two process zones they are not cracks yet.
        assert stiff == pytest.approx(stiffer(a.half), rel=0.03 if a.half > 0.2 else 0.1)


@pytest.mark.slow
def test_one_takes_all_where_nothing_shares_it_out(pumped) -> None:
    """At one pressure the longer one grows, and its shade holds the other back."""
    (state,) = pumped((-0.5 * APART, 0.5 * APART), ONE_WELL, (0.1,))
    print(state.lengths, state.openings.max(axis=1))
    assert max(state.lengths) > 0.15 and min(state.lengths) < 0.05


def draw(pumped, path: Path) -> None:
    """Left: openings along the fractures at the end; right: net pressure over time."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.0), layout="constrained")
    two, one = pumped((-0.5 * APART, 0.5 * APART)), pumped((0.0,))
    for row, (mark, name) in enumerate((("o", "lower one of two"), ("^", "upper one of two"))):
        left.plot(two[-1].x, 1e6 * two[-1].openings[row], mark, ms=4, color=f"C{row}", label=name)
    left.plot(one[-1].x, 1e6 * one[-1].openings[0], "k", lw=1, label="one by itself")
    left.set(xlabel="distance from the well (m)", ylabel="opening (µm)", xlim=(0.0, 0.8), ylim=(0.0, None))
    for states, look, name in ((two, "C0o-", f"two, {APART:g} m apart"), (one, "ko-", "one by itself")):
        right.plot([s.time for s in states], [1e-6 * s.pressure for s in states], look, ms=4, lw=1, label=name)
    right.set(xlabel="time (s)", ylabel="net pressure at the well (MPa)", ylim=(0.0, None))
    for axes, letter in ((left, "a"), (right, "b")):
        axes.legend(frameon=False, fontsize=8)
        axes.set_title(f"({letter})", loc="left", fontsize=9)
    figure.savefig(path, dpi=200)
    plt.close(figure)


@pytest.mark.slow
@pytest.mark.figures
def test_the_figure(pumped, tmp_path) -> None:
    draw(pumped, tmp_path / "two_fractures.png")
    assert (tmp_path / "two_fractures.png").stat().st_size > 20000
    assert "figures/two_fractures.png" in (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    assert (ROOT / "docs" / "figures" / "two_fractures.png").is_file()

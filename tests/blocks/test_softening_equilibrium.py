"""The static solve of joints that pass their peak: the tangent, one joint by hand, a beam that splits, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium
from hpcdem.physics.fdem.connectivity import face_points
from hpcdem.physics.fdem.kernels import joint_law
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import JOINT, jointed, model, rectangle
from tests.blocks.test_equilibrium import farthest, refused


def test_slopes_of_the_law():
    """Against differences of the law, loading and unloading, in tension, shear, both and under pressure."""
    rng, met = np.random.default_rng(2), set()
    h, tensile, cohesion, tan_phi, penalty = 0.1, 2e6, 5e6, 0.6, 5e11
    law = (penalty / (2.0 * tensile), tensile, penalty, tan_phi, cohesion)
    o_t, s_t = (2.5886128 * 50.0 / strength for strength in (tensile, cohesion))
    more = 1.0 / o_t, 1.0 / s_t, 2.0 * tensile / penalty, 2.0 / penalty
    for _ in range(2000):
        o, s = rng.choice([-1.0, 1.0, 0.2]) * rng.uniform(0.0, o_t), rng.uniform(-1.0, 1.0) * s_t
        o *= 0.01 if o < 0.0 else 1.0
        o_u, s_u, damage = rng.choice([0.0, 0.3, 1.5]) * o_t, rng.choice([0.0, 0.3]) * s_t, rng.choice([0.0, 0.3, 0.7])
        memory = o_u, s_u, damage
        found = joint_law.yielded_slopes(o, s, h, *law, *more, *memory)
        step = 1e-5 * o_t * (0.01 if o < 0.0 else 1.0)
        ends = [joint_law.yielded_point(*at, h, 1.0 / h, *law, *more, *memory) for at in (
            (o + step, s), (o - step, s), (o, s + 1e-5 * s_t), (o, s - 1e-5 * s_t))]  # fmt: skip
        by_o = [(ends[0][k] - ends[1][k]) / (2.0 * step) for k in (0, 1)]
        by_s = [(ends[2][k] - ends[3][k]) / (2e-5 * s_t) for k in (0, 1)]
        wanted = by_o[0], by_s[0], by_o[1], by_s[1]
        met.add((o > 0.0, ends[0][4] > damage, o < o_u, abs(s) < s_u))
        scale = max(map(abs, wanted)) + 1e-3 * penalty
        assert found == pytest.approx(wanted, abs=2e-3 * scale)
    assert len(met) > 8


SHEAR = {"friction": 0.0, "cohesion": 3e6, "gf2": 80.0}


def pair(mode: str, size: float = 0.1) -> Blocks:
    """Two squares of this size with a joint between them, all of which moves in one direction only."""
    sim = jointed(model(rectangle(2, 1, 2.0 * size, size, kind="quad")), **SHEAR)
    sim.option(dynamic=False, collision=False, large_strain=False)
    sim.velocity_condition(None, **({"vy": 0.0} if mode == "opening" else {"vx": 0.0}))
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 0] < 1e-9), vx=0.0, vy=0.0)
    return sim


def drawn(sim: Blocks, mode: str, way: float, **how) -> equilibrium.Balanced:
    """The right end on by this."""
    end = np.flatnonzero(sim.mesh.points[:, 0] > np.ptp(sim.mesh.points[:, 0]) - 1e-9)
    sim.velocity_condition(end, vx=way if mode == "opening" else 0.0, vy=0.0 if mode == "opening" else way)
    return equilibrium.solve_elastic(sim, softening=True, **how)


@pytest.mark.parametrize("mode", ["opening", pytest.param("slip", marks=pytest.mark.slow)])
def test_one_joint_by_hand(mode):
    """Opened, or slid, and half-way back and on again: the stress is f(D) T with D = (o - o_p) / o_t of the largest
    opening so far, below that on the line to the origin. In the end it breaks; what it took is G_f and the 2/3 o_p T
    before its peak, by the trapezoidal rule to 1 %."""
    strength, energy = (JOINT["tensile_strength"], JOINT["gf1"]) if mode == "opening" else (3e6, 80.0)
    critical, peak = energy / (joint_law.SOFTENING_AREA * strength), 2.0 * 0.1 * strength / JOINT["penalty_normal"]
    stress_name = "normal_stress" if mode == "opening" else "shear_stress"
    sim, taken, before, largest, below = pair(mode), 0.0, (0.0, 0.0), 0.0, 0
    for step in range(200):
        drawn(sim, mode, (-0.5 if 40 <= step < 60 else 1.0) * critical / 80.0)
        if diagnostics.joint_counts(sim)[2]:
            break
        o, stress = (float(diagnostics.values(sim, name)[0]) for name in (mode, stress_name))
        largest, d = max(largest, o), (max(largest, o) - peak) / critical
        line = min(o / largest, 1.0) if d > 0.0 else o / peak * (2.0 - o / peak)
        assert stress == pytest.approx(strength * joint_law.softening(d) * line, rel=1e-5, abs=1e-6 * strength)
        below += d > 0.0 and o < 0.99 * largest
        taken, before = taken + 0.5 * (stress + before[1]) * (o - before[0]), (o, stress)
    assert diagnostics.joint_counts(sim) == (0, 0, 1) and below > 15 and largest > 0.95 * critical
    assert taken == pytest.approx(energy + 2.0 / 3.0 * peak * strength, rel=0.01)
    assert np.abs(diagnostics.values(sim, "stress_xx" if mode == "opening" else "stress_xy")).max() < 1e-6 * strength


def test_without_the_word_joints_stay_before_their_peak():
    sim = pair("opening")
    end = np.flatnonzero(sim.mesh.points[:, 0] > 0.2 - 1e-9)
    sim.velocity_condition(end, vx=2e-5)
    refused(sim, "1 joints would pass their peak")
    equilibrium.solve_elastic(sim, softening=True)
    assert diagnostics.joint_counts(sim) == (0, 1, 0)
    refused(sim, "1 joints are past their peak already")


@pytest.mark.parametrize("way", [7e-5, 9e-5])
def test_what_snaps_back_goes_where_relaxation_goes(way):
    """Squares of a metre store more than the joint takes, T |f'| / o_t is above E' / L: it passes its peak and is far
    down its curve at once, in the state to which steps go."""
    sim, slow = pair("opening", 1.0), pair("opening", 1.0)
    drawn(sim, "opening", way, steps=4)
    end = np.flatnonzero(slow.mesh.points[:, 0] > 2.0 - 1e-9)
    for speed, steps in ((way / 2000, 2000), (0.0, 1000)):
        slow.velocity_condition(end, vx=speed, vy=0.0)
        convergence.advance(slow, steps)
    assert convergence.solve(slow, ratio=1e-9, cycles=20000).reason == "ratio"
    assert diagnostics.joint_counts(sim) == diagnostics.joint_counts(slow)
    broken = diagnostics.joint_counts(sim)[2] == 1
    assert broken == (way > 8e-5)
    assert farthest(sim, slow, ("displacement_x",) if broken else ("stress_xx", "displacement_x", "opening")) < 1e-3


HALF, LENGTH, CRACK, ENERGY = 0.05, 0.6, 0.2, 100.0


def beam(crack: float = CRACK) -> Blocks:
    """A double cantilever beam of quads with joints in its middle, open up to `crack`, held on the right."""
    mesh = rectangle(60, 4, LENGTH, 2.0 * HALF, kind="quad")
    sim = model(mesh)
    sim.option(dynamic=False, collision=False, large_strain=False)
    every = sim.numbers_of_joints(None)
    x, y = mesh.points[face_points(mesh.cells, every)].mean(axis=1).T
    middle = np.abs(y - HALF) < 1e-9
    law = {**JOINT, "tensile_strength": 10e6, "cohesion": 60e6, "gf1": ENERGY, "gf2": 10 * ENERGY}
    sim.joint_model(every[middle], "classic_intrinsic_cohesive_interface", {**law, "penalty_normal": 100 * 50e9})
    changes.crack(sim, every[middle & (x < crack)])
    sim.velocity_condition(np.flatnonzero(mesh.points[:, 0] > LENGTH - 1e-9), vx=0.0, vy=0.0)
    return sim


def parted(sim: Blocks, way: float, **how) -> float:
    """Both arms by this apart in all; the force that it takes [N/m]."""
    x, y = sim.mesh.points.T
    top, low = (np.flatnonzero((x < 1e-9) & (np.abs(y - at) < 1e-9)) for at in (2.0 * HALF, 0.0))
    sim.velocity_condition(top, vy=0.5 * way)
    sim.velocity_condition(low, vy=-0.5 * way)
    equilibrium.solve_elastic(sim, **how)
    return diagnostics.total(sim, "reaction_y", top)


@pytest.mark.slow
def test_an_increment_in_which_several_joints_pass_their_peak_is_cut():
    """Far apart in one go: it takes many increments, and comes to what small movements come to."""
    sim, slow = beam(), beam()
    for _ in range(8):
        parted(slow, 9e-5, softening=True)
    parted(sim, 7.2e-4, softening=True)
    assert diagnostics.joint_counts(sim)[2] > 2
    assert farthest(sim, slow, ("displacement_y",)) < 0.02


def test_a_part_that_comes_loose_is_refused_and_the_joint_is_whole():
    """A square that hangs on a joint and weighs more than it holds: it is named, and nothing is broken."""
    sim = jointed(model(rectangle(2, 1, 0.2, 0.1, kind="quad")), **SHEAR)
    sim.option(dynamic=False, collision=False, large_strain=False)
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 0] < 1e-9), vx=0.0, vy=0.0)
    edges = sim.mesh.edges()
    right = (sim.mesh.points[edges.points][:, :, 0] > 0.2 - 1e-9).all(axis=1)
    sim.stress_condition(edges.faces[right, 0], xx=2.5e6)
    with pytest.raises(CommandError, match=r"did not converge|can move|singular") as told:
        equilibrium.solve_elastic(sim, softening=True)
    assert told.match("it converged with|can move")
    refused(sim, "did not converge|can move|singular", softening=True)
    assert diagnostics.joint_counts(sim) == (1, 0, 0) and not sim.broken.any() and not sim.event_rows

"""A bolt is pulled out of rock that does not move, against the closed form (exact.py)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.bolts import kernels
from hpcdem.physics.fdem import convergence
from tests.bolts import exact
from tests.bolts.support import head, in_fixed_rock

HEAD = np.array([0])
EA = exact.axial_stiffness(200e9, 0.025)
STRENGTH = math.pi * 0.025 * 2e6
"""Of the grout at the bolt, which is the smaller one [N/m]."""


def held(sim, bolts, force: float) -> float:
    """Displacement of the head against the bolt [m] at equilibrium with this pull [N]."""
    bolts.condition(HEAD, force_x=-force)
    assert convergence.solve(sim, ratio=1e-8, cycles=100_000).reason == "ratio"
    return -head(bolts, "displacement_x")


def test_numbers_of_the_specification() -> None:
    """Worked out by hand: E A 9.8175e7 N, beta 3.1915 1/m, S = min(157.08, 235.62) kN/m."""
    assert pytest.approx(9.8175e7, rel=1e-4) == EA and pytest.approx(157.08e3, rel=1e-4) == STRENGTH
    assert exact.head_stiffness(EA, 1e9, 1.0) == pytest.approx(3.123e8, rel=1e-3)
    assert exact.pull(0.0, EA, 1e9, STRENGTH, 1.0)[0] == pytest.approx(49.05e3, rel=1e-3)


def test_stiffness_slip_and_ultimate_load() -> None:
    sim, bolts = in_fixed_rock()
    assert 10e3 / held(sim, bolts, 10e3) == pytest.approx(3.123e8, rel=0.01)
    # The grout of the first node is that of half an element, at the force there; it slips 0.08 % late.
    held(sim, bolts, 49.05e3 * 0.995)
    assert not (bolts.nodes["bond_state"] & kernels.SLIPPED).any()
    held(sim, bolts, 49.05e3 * 1.005)
    assert (bolts.nodes["bond_state"] & kernels.SLIPPED > 0).tolist() == [True] + 40 * [False]
    held(sim, bolts, 157.08e3 * 0.995)
    bolts.condition(HEAD, force_x=-157.08e3 * 1.005)
    assert convergence.solve(sim, ratio=1e-8, cycles=2000).reason == "cycles"  # it slides out
    assert (bolts.nodes["bond_state"] & kernels.SLIPS).all() and (bolts.nodes["slip"] < 0.0).all()


@pytest.mark.slow  # quick: by force, above
def test_ultimate_load_by_displacement() -> None:
    """Drawn out by 1.5 mm, where it slips everywhere after 0.96 mm: what holds it is the strength of all the grout."""
    sim, bolts = in_fixed_rock()
    bolts.condition(HEAD, does_x=kernels.VELOCITY, at_x=-5e-8)
    convergence.advance(sim, 30_000)
    bolts.condition(HEAD, at_x=0.0)
    assert convergence.solve(sim, ratio=1e-7, cycles=100_000).reason == "ratio"
    assert -head(bolts, "reaction_x") == pytest.approx(157.08e3, rel=0.005)
    assert np.abs(bolts.values("bolt-node", "bond_force")) == pytest.approx(STRENGTH, rel=0.005)


@pytest.mark.slow
def test_yield_at_the_head_and_rupture() -> None:
    sim, bolts = in_fixed_rock(tensile_yield_force=100e3, tension_failure_strain=0.02)
    bolts.condition(HEAD, does_x=kernels.VELOCITY, at_x=-1e-7)
    convergence.advance(sim, 6000)
    force, now = bolts.values("bolt-element", "axial_force"), bolts.elements["state"]
    # The first node has grout of its own, so the load is what the first element carries and its strength.
    assert force[0] == 100e3 and now[0] & kernels.IN_TENSION and (now[1:] & kernels.WAS_IN_TENSION == 0).all()
    assert -head(bolts, "reaction_x") == pytest.approx(100e3 + STRENGTH / 80.0, rel=1e-3)
    strain = bolts.values("bolt-element", "axial_strain")
    assert bolts.values("bolt-element", "plastic_strain")[0] == pytest.approx(strain[0] - 100e3 / EA, rel=1e-9)
    while not bolts.elements["state"][0] & kernels.RUPTURED:
        before = bolts.values("bolt-element", "axial_strain")[0]
        convergence.advance(sim, 1)
    assert before < 0.02 <= bolts.values("bolt-element", "axial_strain")[0]
    assert bolts.values("bolt-element", "axial_force")[0] == 0.0
    bolts.condition(HEAD, does_x=kernels.VELOCITY, at_x=1e-7)  # pushed together again it carries nothing
    convergence.advance(sim, 12_000)
    assert bolts.values("bolt-element", "axial_force")[0] == 0.0
    assert (bolts.elements["state"] & kernels.RUPTURED != 0).tolist() == [True] + 39 * [False]


@pytest.mark.parametrize("slipping", [0.3, pytest.param(0.9, marks=pytest.mark.slow)])
def test_another_bolt_while_it_slips(slipping) -> None:
    """2 m of a thinner bar in soft grout that fails at the rock, with a spacing of 1.6 m: the force and the way of the
    head when a part of it slips. 80 elements: the error falls with the square of their length."""
    changes = {
        "young": 150e9, "diameter": 0.02, "shear_stiffness_rock_bolt": 3e8, "grout_thickness": 0.01,
        "cohesion_rock_grout": 0.5e6, "cohesion_grout_bolt": 3e6, "spacing": 1.6,
    }  # fmt: skip
    ea, strength = exact.axial_stiffness(150e9, 0.02), math.pi * 0.04 * 0.5e6
    force, way = exact.pull(slipping, ea, 3e8, strength, 2.0)
    sim, bolts = in_fixed_rock(2.0, 80, **changes)
    assert held(sim, bolts, force) == pytest.approx(way, rel=0.005)
    slips = (bolts.nodes["bond_state"] & kernels.SLIPPED) > 0
    assert slips.sum() * 2.0 / 80 == pytest.approx(slipping, abs=0.03)
    # All of the rock together holds what is pulled, per metre of thickness.
    assert bolts.nodes["bond"].sum() == pytest.approx(force / 1.6, rel=1e-6)


def test_compression_yields_at_its_own_force() -> None:
    sim, bolts = in_fixed_rock(compressive_yield_force=60e3)
    bolts.condition(HEAD, does_x=kernels.VELOCITY, at_x=1e-7)
    convergence.advance(sim, 6000)
    assert bolts.values("bolt-element", "axial_force")[0] == -60e3
    assert bolts.elements["state"][0] == kernels.IN_COMPRESSION | kernels.WAS_IN_COMPRESSION


@pytest.mark.slow
def test_pressure_across_the_bar_adds_friction() -> None:
    """sigma_yy -2 MPa in the rock: S = pi D (C + 2 MPa tan 30) at the bolt; tension adds nothing."""
    found = {}
    for sigma in (-2e6, 2e6):
        sim, bolts = in_fixed_rock(friction_grout_bolt=30.0, friction_rock_grout=30.0)
        sim.initial_stress(None, xx=-7e6, yy=sigma, xy=0.0)
        bolts.condition(HEAD, does_x=kernels.VELOCITY, at_x=-1e-6)
        convergence.advance(sim, 5000)
        found[sigma] = np.abs(bolts.values("bolt-node", "bond_force"))
    assert found[-2e6] == pytest.approx(math.pi * 0.025 * (2e6 + 2e6 * math.tan(math.pi / 6.0)), rel=1e-6)
    assert found[2e6] == pytest.approx(STRENGTH, rel=1e-9)


def test_grout_holds_and_slips_at_the_weaker_face() -> None:
    """One node that holds, one that slips at the rock, pressed, one that slips at the bolt, pulled apart, and two that
    have no grout or no host: forces, slip, states and lost work by hand."""
    n, k = 5, 100.0
    tangent, nodes = np.tile([0.6, 0.8], (n, 1)), np.zeros((n, 7))
    nodes[:, kernels.GROUT] = k, k, k, 0.0, k
    nodes[:, kernels.ROCK_COHESION :] = 10.0, 0.5, 12.0, 0.25
    nodes[2, kernels.ROCK_COHESION] = 20.0
    rock, step = np.zeros((n, 2)), np.zeros((n, 2))
    rock[:] = 0.06, 0.08  # 0.1 along the bar
    step[:] = [0.03, 0.04], [-0.3, -0.4], [0.3, 0.4], [0.3, 0.4], [0.3, 0.4]
    normal, grout, slip = np.array([5.0, -4.0, 3.0, 0.0, 0.0]), np.array([1.0, 2.0, -3.0, 4.0, 5.0]), np.zeros(n)
    state, work = np.array([kernels.SLIPS, 0, kernels.SLIPPED, kernels.SLIPS, 0]), np.zeros(kernels.WORK)
    kernels.hold(tangent, step, rock, np.array([True] * 4 + [False]), nodes, normal, grout, slip, state, work)
    assert grout == pytest.approx([6.0, 12.0, -12.0, 4.0, 5.0], rel=1e-14)
    assert slip == pytest.approx([0.0, -(62.0 - 12.0) / k, (-12.0 + 43.0) / k, 0.0, 0.0], rel=1e-13)
    both = kernels.SLIPS | kernels.SLIPPED
    assert state.tolist() == [0, both, both, 0, 0]
    lost = [0.5 * (f + new) * du - 0.5 * (new**2 - f**2) / k for f, new, du in ((2.0, 12.0, 0.6), (-3.0, -12.0, -0.4))]
    assert work == pytest.approx([0.0, 0.0, sum(lost), 0.0, 0.0], rel=1e-12) and min(lost) > 0.0


def test_stress_across_a_bar() -> None:
    """In the plane n . s n; in space the mean of two directions across."""
    rng = np.random.default_rng(6)
    for dim in (2, 3):
        t, stress, out = rng.normal(size=(4, dim)), rng.normal(size=(4, 6)), np.zeros(4)
        t /= np.linalg.norm(t, axis=1)[:, None]
        kernels.across(stress, t, out)
        for way, (xx, yy, xy, zz, xz, yz), found in zip(t, stress, out, strict=True):
            s = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])[:dim, :dim]
            _, _, across = np.linalg.svd(way[None, :])
            assert found == pytest.approx(np.mean([n @ s @ n for n in across[1:]]), rel=1e-12)

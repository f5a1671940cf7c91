"""Beams and rings without rock against their closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.physics.fdem import convergence
from hpcdem.physics.fdem.structures import VELOCITY
from hpcdem.physics.liners import kernels
from tests.liners.support import SHOTCRETE, annulus, bare, beam, inner_faces, stiffness

EA, EI = stiffness(SHOTCRETE)
HELD = {"does_x": VELOCITY, "does_y": VELOCITY}
CLAMPED = {**HELD, "does_turn": VELOCITY}


def at_rest(sim, ratio: float = 1e-9, cycles: int = 30_000) -> None:
    assert convergence.solve(sim, ratio=ratio, cycles=cycles).reason == "ratio"


def test_numbers_of_the_section() -> None:
    """By hand: E / (1 - 0.04) = 20.8333 GPa, A = 0.1 m, I = 8.3333e-5 m3."""
    assert pytest.approx(2.083333e9, rel=1e-6) == EA and pytest.approx(1.736111e6, rel=1e-6) == EI


def test_cantilever_with_a_force_at_its_end() -> None:
    """w = P L^3 / (3 E I), theta = P L^2 / (2 E I): cubic elements are exact at their nodes, whatever their number."""
    sim, liners = beam(5, 2.0)
    liners.condition(np.array([0]), **CLAMPED)
    liners.condition(np.array([5]), force_y=-100.0)
    at_rest(sim)
    deflection, turned = 100.0 * 8.0 / (3.0 * EI), 100.0 * 4.0 / (2.0 * EI)
    assert deflection == pytest.approx(1.536e-4, rel=1e-9)
    assert liners.values("liner-node", "displacement_y")[5] == pytest.approx(-deflection, rel=1e-6)
    assert liners.values("liner-node", "rotation")[5] == pytest.approx(turned, rel=1e-6)  # it points to -x
    # The rock was below: tension above, on the side away from it, is positive.
    assert liners.values("liner-element", "moment_first") == pytest.approx(
        100.0 * np.array([2.0, 1.6, 1.2, 0.8, 0.4]), rel=1e-6
    )
    assert np.abs(liners.values("liner-element", "shear_force")) == pytest.approx(100.0, rel=1e-6)
    assert liners.values("liner-node", "reaction_y")[0] == pytest.approx(100.0, rel=1e-6)
    assert abs(liners.values("liner-node", "reaction_moment")[0]) == pytest.approx(200.0, rel=1e-6)


@pytest.mark.slow
def test_simply_supported_beam_under_its_weight() -> None:
    """Weight lumped at the nodes of 16 elements: 5 q L^4 / (384 E I) but for 1 / n^2, moment q L^2 / 8."""
    sim, liners = beam(16, 4.0, density=2500.0, young=30e9, poisson_ratio=0.0, thickness=0.15)
    sim.gravity(0.0, -10.0)
    liners.condition(np.array([0, 16]), does_y=VELOCITY)
    liners.condition(np.array([0]), does_x=VELOCITY)
    at_rest(sim)
    q, ei = 2500.0 * 0.15 * 10.0, 30e9 * 0.15**3 / 12.0
    sag = 5.0 * q * 4.0**4 / (384.0 * ei)
    assert sag == pytest.approx(1.4815e-3, rel=1e-4)
    assert liners.values("liner-node", "displacement_y")[8] == pytest.approx(-sag, rel=0.004)
    assert liners.values("liner-element", "moment_last")[7] == pytest.approx(-q * 16.0 / 8.0, rel=1e-6)  # tension below


def test_bar_in_tension_and_the_section_of_steel_sets() -> None:
    sim, liners = beam(3, 1.5, area=4e-3, inertia=2e-5, poisson_ratio=0.0, young=200e9)
    liners.condition(np.array([0]), **CLAMPED)
    liners.condition(np.array([3]), force_x=-8e5)
    at_rest(sim)
    assert liners.values("liner-node", "displacement_x")[3] == pytest.approx(-8e5 * 1.5 / (200e9 * 4e-3), rel=1e-6)
    assert liners.values("liner-element", "axial_force") == pytest.approx(8e5, rel=1e-6)


@pytest.mark.parametrize(
    "turns", [pytest.param(0.25, marks=pytest.mark.slow), pytest.param(1.0, marks=pytest.mark.slow)]
)
def test_a_cantilever_rolls_up(turns) -> None:
    """A moment M = E I theta / L at the end makes an arc of the beam, of radius L / theta; stretching is 0. Chords of
    20 elements: theta is exact, the end lies on the polygon of the arc."""
    sim, liners = beam(20, 2.0)
    theta = 2.0 * math.pi * turns
    liners.condition(np.array([0]), **CLAMPED)
    sim.table("up", [(0.0, 0.0), (1.0, 1.0)])
    for part in np.linspace(0.1, 1.0, 10):  # in steps, so that it is not thrown round
        liners.condition(np.array([20]), moment=float(part * theta * EI / 2.0))
        convergence.advance(sim, 1500)
    at_rest(sim, 1e-7, 40_000)
    assert liners.values("liner-node", "rotation")[20] == pytest.approx(theta, rel=1e-4)
    half = theta / 40.0
    chord = 0.1 * math.sin(theta / 2.0) / math.sin(half)  # of the polygon with sides of 0.1 m
    x, y = (liners.values("liner-node", f"position_{axis}")[20] for axis in "xy")
    assert math.hypot(x, y) == pytest.approx(abs(chord), abs=1e-3)
    assert np.abs(liners.values("liner-element", "axial_strain")).max() < 1e-5
    assert liners.values("liner-element", "moment_last") == pytest.approx(theta * EI / 2.0, rel=1e-4)


def test_ring_under_pressure() -> None:
    """Forces p per length towards the centre on the nodes of a polygon of 48 sides: N = -p R, u = p R^2 / (E A)."""
    radius, p = 2.5, 3e5
    mesh = annulus(radius, 3.0, 48, 1)
    sim, liners = bare(mesh, inner_faces(mesh, radius), thickness=0.25)
    assert len(liners) == len(liners.elements["row"]) == 48  # closed
    ea = stiffness({**SHOTCRETE, "thickness": 0.25})[0]
    x = liners.nodes["x"]
    side = 2.0 * radius * math.sin(math.pi / 48)
    force = -p * side * math.cos(math.pi / 48) * x / radius  # of both sides, half of each
    for i in range(48):
        liners.condition(np.array([i]), force_x=float(force[i, 0]), force_y=float(force[i, 1]))
    at_rest(sim)
    assert liners.values("liner-element", "axial_force") == pytest.approx(-p * radius, rel=0.003)
    u = -(liners.nodes["x"] - liners.nodes["origin"]) @ np.eye(2)
    inwards = (u * liners.nodes["origin"]).sum(axis=1) / radius
    assert inwards == pytest.approx(p * radius**2 / ea, rel=0.006)
    assert np.abs(liners.values("liner-element", "moment_first")).max() < 1e-3 * p * radius * 0.25
    assert (liners.nodes["arc"] >= 0.0).all() and liners.nodes["arc"].max() == pytest.approx(47 * side)


def frequency(count: int) -> float:
    """First bending frequency [Hz] of a free vibration of a cantilever of 2 m, from its crossings of zero."""
    sim, liners = beam(count, 2.0, True)
    sim.time_step(2e-5)
    liners.condition(np.array([0]), **CLAMPED)
    s = liners.nodes["arc"] / 2.0
    k = 1.8751041
    part = (math.cosh(k) + math.cos(k)) / (math.sinh(k) + math.sin(k))
    mode = np.cosh(k * s) - np.cos(k * s) - part * (np.sinh(k * s) - np.sin(k * s))
    slope = k / 2.0 * (np.sinh(k * s) + np.sin(k * s) - part * (np.cosh(k * s) - np.cos(k * s)))
    liners.nodes["v"][:, 1], liners.nodes["spin"][:] = 1e-3 * mode, -1e-3 * slope
    rows = []
    for _ in range(9500):
        sim.step()
        rows.append(liners.nodes["x"][-1, 1])
    y = np.array(rows)
    up = np.flatnonzero((y[:-1] < 0.0) & (y[1:] >= 0.0))
    cross = up + y[up] / (y[up] - y[up + 1])
    return float(1.0 / (np.diff(cross).mean() * 2e-5))


@pytest.mark.slow
def test_natural_frequency_of_a_cantilever() -> None:
    """f = (1.8751 / L)^2 sqrt(E I / (rho A)) / (2 pi) = 11.9 Hz without shear and rotary inertia."""
    exact = (1.8751041 / 2.0) ** 2 * math.sqrt(EI / 240.0) / (2.0 * math.pi)
    assert exact == pytest.approx(11.899, rel=1e-4)
    coarse, fine = (frequency(count) / exact - 1.0 for count in (5, 10))
    assert fine == pytest.approx(-0.0056, abs=0.0005)  # masses in the nodes
    assert coarse / fine == pytest.approx(4.0, rel=0.1)  # the error falls with the square of the length


@pytest.mark.slow
def test_yield_in_tension_compression_and_bending() -> None:
    """Nt = 0.2 MN, Nc = 3 MN; a rectangle bears Mp = (ft + fc) t^2 / 8 = 40 kN m at N = (Nt - Nc) / 2 and
    ft fc t^2 / (2 (ft + fc)) = 9.375 kN m at N = 0."""
    strength = {"tensile_strength": 2e6, "compressive_strength": 30e6}
    for sign, yields, bit in ((1.0, 0.2e6, kernels.IN_TENSION), (-1.0, -3e6, kernels.IN_COMPRESSION)):
        sim, liners = beam(4, 1.0, **strength)
        liners.condition(np.array([0]), **CLAMPED)
        liners.condition(np.arange(1, 5), does_y=VELOCITY, does_turn=VELOCITY)
        liners.condition(np.array([4]), does_x=VELOCITY, at_x=-sign * 2e-6)
        convergence.advance(sim, 3000)
        assert liners.values("liner-element", "axial_force") == pytest.approx(yields, rel=1e-12)
        assert (liners.elements["state"] == bit | kernels.HAS_YIELDED).any()
        strain, plastic = (liners.values("liner-element", f"{name}_strain") for name in ("axial", "plastic"))
        assert plastic.sum() == pytest.approx(strain.sum() - 4 * yields / EA, rel=1e-6)
    for pressed, most in ((0.0, 9375.0), (1e6, 37_500.0)):  # 4 Mp (Nt - N) (N + Nc) / (Nt + Nc)^2
        sim, liners = beam(1, 1.0, **strength)
        liners.condition(np.array([0]), **CLAMPED)
        liners.condition(np.array([1]), does_y=VELOCITY, force_x=pressed, does_turn=VELOCITY, at_turn=1e-5)
        convergence.advance(sim, 4000)
        assert -liners.values("liner-element", "axial_force")[0] == pytest.approx(pressed, abs=1.0)
        ends = [abs(liners.values("liner-element", f"moment_{end}")[0]) for end in ("first", "last")]
        assert ends == pytest.approx([0.5 * most, most], rel=1e-6)  # half of it is carried over to the clamped end
        assert liners.elements["state"][0] == kernels.BENDS | kernels.HAS_YIELDED
        assert liners.values("liner-element", "plastic_rotation")[0] > 0.02


def test_hinges_are_where_plain_loops_find_them() -> None:
    """Both end moments after a step in which one or both yield: no more than allowed, elastic elsewhere."""
    rng = np.random.default_rng(3)
    k = 5.0
    for _ in range(500):
        first, second = rng.uniform(-3.0, 3.0, 2)
        a, b, pa, pb = kernels.hinges(first, second, 1.0, k)
        assert max(abs(a), abs(b)) <= 1.0 + 1e-12
        assert a == pytest.approx(first - k * (4.0 * pa + 2.0 * pb), abs=1e-9)
        assert b == pytest.approx(second - k * (2.0 * pa + 4.0 * pb), abs=1e-9)
        assert (pa == 0.0) or abs(a) == pytest.approx(1.0)
        assert (pb == 0.0) or abs(b) == pytest.approx(1.0)


def test_a_step_of_the_nodes() -> None:
    """Free, damped and led ones in the plane, and one without mass: velocities, reactions, ways and works by hand."""
    parts, dt, alpha = np.array([0, 1, 5]), 0.1, 0.25
    x, v, spin = np.zeros((3, 2)), np.array([[1.0, -2.0], [3.0, 0.5], [9.0, 9.0]]), np.array([[4.0], [-1.0], [9.0]])
    total = np.array([[8.0, 4.0, -6.0], [2.0, -3.0, 5.0], [1.0, 1.0, 1.0]])
    nodes = np.zeros((3, 5))
    nodes[:2] = [2.0, 4.0, 0.0, -20.0, 0.0], [5.0, 8.0, 0.0, -50.0, 0.0]
    conditions = np.zeros((3, 18))
    conditions[1, [kernels.DOES, kernels.AT]] = 1.0, 7.0
    conditions[1, [kernels.DOES + 10, kernels.AT + 10]] = 1.0, 2.0
    conditions[0, kernels.FORCE + 1] = 3.0
    reaction, step, work = np.full((3, 3), np.nan), np.full((3, 2), np.nan), np.zeros(kernels.WORK)
    kernels.move(x, v, spin, parts, total, conditions, nodes, dt, alpha, reaction, step, work)
    vx = [1.0 + 0.05 * 8.0 * 0.75, 7.0]
    vy = [-2.0 + 0.05 * 4.0 * 1.25, 0.5 - 0.02 * 3.0 * 1.25]
    assert v == pytest.approx(np.array([[vx[0], vy[0]], [vx[1], vy[1]], [9.0, 9.0]]), rel=1e-14)
    assert spin[:, 0] == pytest.approx([4.0 - 0.025 * 6.0 * 1.25, 2.0, 9.0], rel=1e-14)
    assert step == pytest.approx(np.array([*(dt * v[:2]), [0.0, 0.0]]), rel=1e-14) and (x == step).all()
    forces = [5.0 * 4.0 / dt - 2.0, 8.0 * 3.0 / dt - 5.0]
    assert reaction[:2] == pytest.approx(np.array([[0.0, 0.0, 0.0], [forces[0], 0.0, forces[1]]]), rel=1e-13)
    driven = forces[0] * 0.5 * dt * 10.0 + forces[1] * 0.5 * dt * 1.0 + 3.0 * 0.5 * dt * (vy[0] - 2.0)
    pulled = 0.5 * dt * (-20.0 * (vy[0] - 2.0) - 50.0 * (vy[1] + 0.5))
    assert work == pytest.approx([0.0, 0.0, 0.0, driven, pulled], rel=1e-12)


def test_what_the_bond_and_conditions_do_on_a_node() -> None:
    conditions, nodes, total, on_rock = (
        np.zeros((1, 18)),
        np.zeros((1, 5)),
        np.full((1, 3), np.nan),
        np.full((2, 2), 9.0),
    )
    conditions[0, kernels.FORCE : kernels.FORCE + 6] = 1.0, 2.0, 3.0, 4.0, 5.0, 6.0
    nodes[0, kernels.WEIGHT :] = 10.0, 20.0, 30.0
    kernels.given(conditions, nodes, np.array([0, 1, 5]), 2, total, on_rock)
    assert total.tolist() == [[11.0, 22.0, 6.0]] and (on_rock == 0.0).all()
    frame = np.zeros((2, 2, 2))
    frame[1] = [0.8, -0.6], [0.6, 0.8]
    kernels.hold(1, 0, frame, np.array([9.0, 5.0]), np.array([[9.0], [10.0]]), total, on_rock)
    assert total[0] == pytest.approx([11.0 + 4.0 + 6.0, 22.0 - 3.0 + 8.0, 6.0])
    assert on_rock == pytest.approx(np.array([[0.0, 0.0], [-10.0, -5.0]]))

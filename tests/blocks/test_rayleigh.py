"""Rayleigh damping against xi(omega) = (alpha / omega + beta omega) / 2, by free vibrations of a bar.

A bar in which nodes move along x only, fixed at x = 0, has modes sin((2 k - 1) pi x / (2 L)). Displacements, projected
on one, are a damped vibration q; sampled every T, q_n+1 = 2 e^(-xi omega T) cos(w T) q_n - e^(-2 xi omega T) q_n-1 with
w = omega sqrt(1 - xi^2), from which xi and omega follow by least squares.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import rectangle
from tests.blocks.test_user_laws import law

RHO, YOUNG, NU = 2500.0, 5e9, 0.25
MODULUS = YOUNG * (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU))
LENGTH = 12.0
FIRST = math.sqrt(MODULUS / RHO) / (4.0 * LENGTH)
"""Frequency of the first mode [Hz]."""


def bar(kind: str = "cross", **options: bool) -> Blocks:
    sim = Blocks()
    sim.take_mesh(rectangle(40, 1, LENGTH, LENGTH / 40, kind=kind))
    changes.element_model(sim, None, "mech_iso_elastic", {"density": RHO, "young": YOUNG, "poisson_ratio": NU})
    sim.option(collision=False, **options)
    sim.move_constraint(None, 2, (1.0, 0.0))
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 0] < 1e-9), vx=0.0)
    return sim


def shape(sim: Blocks, mode: int) -> np.ndarray:
    return np.sin((2 * mode - 1) * math.pi * sim.mesh.points[:, 0] / (2.0 * LENGTH))


def start(sim: Blocks, mode: int) -> None:
    for node, v in enumerate(1e-3 * shape(sim, mode)):
        changes.set_velocity(sim, [node], vx=v)


def vibration(sim: Blocks, mode: int) -> tuple[float, float]:
    """Damping ratio and frequency [Hz] of a mode."""
    start(sim, mode)
    sim.step()
    every = max(1, round(0.08 / ((2 * mode - 1) * FIRST) / sim.clock.dt))
    q = []
    for _ in range(26):
        q.append(float(shape(sim, mode) @ diagnostics.values(sim, "displacement_x")))
        convergence.advance(sim, every)
    q = np.array(q)
    a, b = np.linalg.lstsq(np.column_stack([q[1:-1], q[:-2]]), q[2:], rcond=None)[0]
    span = every * sim.clock.dt
    decay, turn = -0.5 * math.log(-b) / span, math.acos(0.5 * a / math.sqrt(-b)) / span
    omega = math.hypot(decay, turn)
    return decay / omega, omega / (2.0 * math.pi)


@pytest.mark.some_of_each
@pytest.mark.parametrize("part", ["both", "mass", "stiffness"])
@pytest.mark.parametrize("kind", ["cross", "quad"])
def test_damping_ratios_of_three_modes(kind, part):
    """5 % at 1.7 times the first frequency; each part alone has the ratio there too."""
    for mode in (1, 2, 3):
        sim = bar(kind)
        sim.rayleigh(0.05, 1.7 * FIRST, part)
        xi, frequency = vibration(sim, mode)
        assert frequency == pytest.approx((2 * mode - 1) * FIRST, rel=0.01)
        r = frequency / (1.7 * FIRST)
        expected = {"both": 0.5 * 0.05 * (1.0 / r + r), "mass": 0.05 / r, "stiffness": 0.05 * r}[part]
        assert xi == pytest.approx(expected, rel=0.01)
    sim.rayleigh(0.0)
    assert sim.options.mass_damping == sim.options.stiffness_damping == 0.0
    assert abs(vibration(bar(kind), 1)[0]) < 1e-4


@pytest.mark.parametrize("kind", ["cross", "quad"])
def test_what_it_takes_is_in_the_account_of_energy(kind):
    """Small strains: the viscous loss is what motion and strain have less."""
    sim = bar(kind)
    sim.rayleigh(0.05, FIRST)
    start(sim, 2)
    diagnostics.account_energy(sim)
    before = diagnostics.energies(sim)
    convergence.solve(sim, time=2.0 / FIRST)
    found = diagnostics.energies(sim)
    left = found["kinetic"] + found["strain"]
    assert left < 0.1 * before["kinetic"]
    assert found["viscous_lost"] == pytest.approx(before["kinetic"] - left, rel=1e-4)
    assert found["relative"] < 1e-4


def test_the_time_step_follows_it():
    """(2 / w) (sqrt(1 + xi^2) - xi), xi = (alpha / w + beta w) / 2 at the corner, which limits; at it nothing grows."""
    omega = 2.0 / (diagnostics.critical_time_step(bar()) / 0.8)
    for part, frequency in (("stiffness", 0.02 * omega), ("mass", 0.1 * omega), ("both", 0.1 * omega)):
        sim = bar()
        sim.time_step(safety=1.0)
        sim.rayleigh(0.9, frequency, part)
        xi = 0.5 * (sim.options.mass_damping / omega + sim.options.stiffness_damping * omega)
        assert diagnostics.critical_time_step(sim) == pytest.approx(2.0 / omega * (math.sqrt(1.0 + xi * xi) - xi))
        changes.set_velocity(sim, [30], vx=1e-3)
        convergence.advance(sim, 3000)
        assert np.abs(diagnostics.values(sim, "velocity_x")).max() < 1e-3
        sim.time_step(mass_scaling=1.5 * sim.clock.dt)
        convergence.advance(sim, 500)
        assert np.abs(diagnostics.values(sim, "velocity_x")).max() < 1e-3


def test_a_checkpoint_keeps_it(tmp_path):
    sim = bar()
    sim.rayleigh(0.05, FIRST)
    start(sim, 1)
    convergence.advance(sim, 100)
    saved_state.save(sim, tmp_path / "a.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    assert again.options == sim.options
    for one in (sim, again):
        convergence.advance(one, 100)
    assert np.array_equal(diagnostics.values(sim, "velocity_x"), diagnostics.values(again, "velocity_x"))


def test_what_cannot_act_is_refused():
    sim = bar()
    for given, told in (
        ((1.0, 5.0), r"must lie in \[0, 1\)"),
        ((0.1, 5.0, "joints"), "one of both, mass, stiffness"),
        ((0.1, None), "needs the frequency"),
        ((0.1, 0.0), "must be positive"),
    ):
        with pytest.raises(CommandError, match=told):
            sim.rayleigh(*given)
    sim.rayleigh(0.1, 5.0)
    with pytest.raises(CommandError, match="needs a dynamic run"):
        sim.option(dynamic=False)
    sim.rayleigh(0.0)
    sim.option(dynamic=False)
    with pytest.raises(CommandError, match="needs a dynamic run"):
        sim.rayleigh(0.1, 5.0)
    sim.option(dynamic=True)
    rock = {"density": RHO, "young": YOUNG, "poisson_ratio": NU, "limit": 1e6}
    changes.element_model(sim, [3], law(sim, "tresca"), rock)
    sim.rayleigh(0.1, 5.0, "stiffness")
    with pytest.raises(CommandError, match=r"element 3, which has a user law.*part mass only"):
        sim.step()
    sim.rayleigh(0.1, 5.0, "mass")
    sim.step()

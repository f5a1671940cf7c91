"""Waves that leave through faces with dashpots, against the plane wave.

A bar along x in which nodes move along it only (wave of speed c_p) or across it only (c_s) is one-dimensional. A stress
s(t) on its left end sends v(x, t) = s(t - x / c) / (rho c) to the right, away from the end: with dashpots there, half
of it. Elements do not damp; what stays behind is reflected by the right end, or was never a plane wave.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, saved_state
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import near, rectangle

RHO, YOUNG, NU = 2300.0, 20e9, 0.2
MODULUS, MU = YOUNG * (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU)), YOUNG / (2.0 * (1.0 + NU))
C_P, C_S = math.sqrt(MODULUS / RHO), math.sqrt(MU / RHO)
LENGTH, WAVE = 60.0, 16.0
"""Of the bar and of the pulse [m]; 40 elements per pulse."""
STRESS = 1e5


def bar(wave: str, kind: str, turned: float = 0.0) -> tuple[Blocks, float]:
    """The bar with a pulse sin^2 of `STRESS` at its left end; returns the wave speed too [m/s]."""
    flat = rectangle(150, 1, LENGTH, 0.4, kind=kind)
    cos, sin = math.cos(turned), math.sin(turned)
    sim = Blocks()
    sim.take_mesh(Mesh.of(flat.points @ np.array([[cos, sin], [-sin, cos]]), flat.cells))
    changes.element_model(sim, None, "mech_iso_elastic", {"density": RHO, "young": YOUNG, "poisson_ratio": NU})
    speed, along = (C_P, (cos, sin)) if wave == "P" else (C_S, (-sin, cos))
    sim.move_constraint(None, 2, along)
    span = WAVE / speed
    sim.table("pulse", [(t, -STRESS * math.sin(math.pi * t / span) ** 2) for t in np.linspace(0.0, span, 200)])
    left = near(flat, 0, 0.0)
    if wave == "P":
        sim.stress_condition(left, normal="pulse")
    else:
        assert turned == 0.0
        sim.stress_condition(left, xy="pulse")
    sim.option(collision=False)
    diagnostics.account_energy(sim)
    return sim, speed


def end(sim: Blocks, x: float) -> np.ndarray:
    """Faces of the end that was at x before the bar was turned."""
    cells = len(sim.mesh.cells)
    return near(rectangle(150, 1, LENGTH, 0.4, kind="quad" if cells == 150 else "cross"), 0, x)


def until(sim: Blocks, time: float) -> None:
    convergence.solve(sim, time=time - sim.clock.time)


def stored(sim: Blocks) -> float:
    found = diagnostics.energies(sim)
    assert found["relative"] < 1e-4
    return found["kinetic"] + found["strain"]


def fastest(sim: Blocks) -> float:
    return float(np.hypot(diagnostics.values(sim, "velocity_x"), diagnostics.values(sim, "velocity_y")).max())


@pytest.mark.parametrize("wave, kind, turned", [("P", "quad", 0.0), ("P", "cross", 0.6), ("S", "quad", 0.0)])
def test_a_plane_wave_leaves_and_nothing_comes_back(wave, kind, turned):
    """Less than 1 % of the amplitude comes back (asked: 2 %); from a free end all of it."""
    left = {}
    for quiet in (False, True):
        sim, speed = bar(wave, kind, turned)
        if quiet:
            sim.stress_condition(end(sim, LENGTH), quiet=True)
        until(sim, 0.9 * LENGTH / speed)
        before, amplitude = stored(sim), fastest(sim)
        assert amplitude == pytest.approx(STRESS / (RHO * speed), rel=0.01)
        until(sim, 1.5 * LENGTH / speed)
        left[quiet] = math.sqrt(stored(sim) / before)
    assert left[False] == pytest.approx(1.0, abs=1e-3)
    assert left[True] < 0.01


def test_a_stress_beside_quiet_enters_as_half():
    sim, speed = bar("P", "quad")
    for x in (0.0, LENGTH):
        sim.stress_condition(end(sim, x), quiet=True)
    until(sim, 0.7 * LENGTH / speed)
    assert fastest(sim) == pytest.approx(0.5 * STRESS / (RHO * speed), rel=0.01)
    sim.stress_condition(end(sim, LENGTH), quiet=False)
    assert not sim.quiet_faces()[end(sim, LENGTH)].any() and sim.quiet_faces()[end(sim, 0.0)].all()
    before = stored(sim)
    until(sim, 1.4 * LENGTH / speed)
    assert stored(sim) == pytest.approx(before, rel=1e-3)  # came back from the right end
    until(sim, 2.5 * LENGTH / speed)
    assert stored(sim) < 1e-4 * before  # and left through the left one


def test_the_time_step_follows_the_dashpots():
    """Of one element of height h between quiet faces the limit is lower; with it nothing grows."""
    sim, speed = bar("P", "quad")
    free = diagnostics.critical_time_step(sim)
    sim.stress_condition(end(sim, LENGTH), quiet=True)
    quiet = diagnostics.critical_time_step(sim)
    assert 0.2 * free < quiet < free
    sim.remove_stress_conditions(end(sim, LENGTH))
    assert diagnostics.critical_time_step(sim) == free
    tiny = Blocks()
    tiny.take_mesh(rectangle(3, 3, 0.3, 0.3))
    changes.element_model(tiny, None, "mech_iso_elastic", {"density": RHO, "young": YOUNG, "poisson_ratio": NU})
    tiny.stress_condition(tiny.numbers_of_faces(None)[~tiny.closed_faces()[tiny.numbers_of_faces(None)]], quiet=True)
    tiny.time_step(safety=1.0)
    changes.set_velocity(tiny, [5], 1.0, -0.7)
    convergence.advance(tiny, 3000)
    assert fastest(tiny) < 0.02  # what is left falls as a whole, and slows down


def test_a_checkpoint_keeps_them(tmp_path):
    sim, speed = bar("P", "quad")
    sim.stress_condition(end(sim, LENGTH), quiet=True)
    until(sim, 0.95 * LENGTH / speed)
    saved_state.save(sim, tmp_path / "a.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    for one in (sim, again):
        convergence.advance(one, 300)
    assert np.array_equal(diagnostics.values(sim, "velocity_x"), diagnostics.values(again, "velocity_x"))


def test_static_stages_do_not_have_them_and_say_so():
    told = []
    sim, _ = bar("P", "quad")
    sim.log = type(
        "Log", (), {"warn_once": lambda self, key, text: told.append(text), "info": lambda self, text: None}
    )()
    sim.stress_condition(end(sim, LENGTH), quiet=True)
    sim.option(dynamic=False)
    sim.step()
    assert any("quiet faces act in dynamic runs only" in text for text in told)
    with pytest.raises(CommandError, match="needs a stress, or quiet"):
        sim.stress_condition(end(sim, 0.0))

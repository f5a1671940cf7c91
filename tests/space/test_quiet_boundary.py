"""Waves that leave bodies of tetrahedra through faces with dashpots, against the plane wave (tests/blocks/
test_quiet_boundary.py has it in the plane, and how stresses and waves come in)."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, saved_state
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.test_quiet_boundary import C_P, C_S, NU, RHO, STRESS, YOUNG, until
from tests.space.support import box, faces_on

CELL, LENGTH, WAVE = 0.4, 40.0, 12.0
"""Of the bar and of the pulse [m]."""
TURN = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
TURN[:, 2] *= np.linalg.det(TURN)


def bar(wave: str, turned: bool = False) -> tuple[Blocks, float, np.ndarray]:
    """A bar along x, or turned, with a pulse of `STRESS` at its left end; returns the speed of the wave, and the way in
    which all nodes move."""
    made = box((round(LENGTH / CELL), 1, 1), (LENGTH, CELL, CELL), 5)
    turn = TURN if turned else np.eye(3)
    sim = Blocks()
    sim.take_mesh(Mesh.of(made.points @ turn.T, made.cells, made.groups, made.layers))
    changes.element_model(sim, None, "mech_iso_elastic", {"density": RHO, "young": YOUNG, "poisson_ratio": NU})
    speed, along = (C_P, turn[:, 0]) if wave == "P" else (C_S, turn[:, 2])
    sim.move_constraint(None, 2, tuple(along))
    span = WAVE / speed
    sim.table("pulse", [(t, -STRESS * math.sin(math.pi * t / span) ** 2) for t in np.linspace(0.0, span, 200)])
    left = faces_on(sim.mesh, "left")
    if wave == "P":
        sim.stress_condition(left, normal="pulse")
    else:
        sim.stress_condition(left, xz="pulse")
    sim.option(collision=False)
    return sim, speed, along


def fastest(sim: Blocks) -> float:
    return float(np.sqrt(sum(diagnostics.values(sim, f"velocity_{axis}") ** 2 for axis in "xyz")).max())


@pytest.mark.parametrize(("wave", "turned"), [("P", True), ("S", False)])
def test_a_plane_wave_leaves_and_nothing_comes_back(wave: str, turned: bool) -> None:
    """Less than 2 % of the amplitude comes back; from a free end all of it."""
    back = {}
    for quiet in (False, True):
        sim, speed, _ = bar(wave, turned)
        if quiet:
            sim.stress_condition(faces_on(sim.mesh, "right"), quiet=True)
        until(sim, 0.9 * LENGTH / speed)
        amplitude = fastest(sim)
        assert amplitude == pytest.approx(STRESS / (RHO * speed), rel=0.01)
        until(sim, 1.6 * LENGTH / speed)
        back[quiet] = fastest(sim) / amplitude
    assert back[False] == pytest.approx(1.0, abs=0.02) and back[True] < 0.02


@pytest.mark.parametrize("how", ["stress", "velocity"])
def test_waves_come_in_through_quiet_faces(how: str) -> None:
    """A stress beside quiet enters as a wave of half its size, `incoming` as it is; it leaves at the other end."""
    sim, speed, _ = bar("P")
    left, right = (faces_on(sim.mesh, side) for side in ("left", "right"))
    sim.stress_condition(left, quiet=True)
    sim.stress_condition(right, quiet=True)
    wanted = 0.5 * STRESS / (RHO * speed)
    if how == "velocity":
        wanted = 0.01
        span = WAVE / speed
        sim.table("v", [(t, 0.01 * math.sin(math.pi * t / span) ** 2) for t in np.linspace(0.0, span, 200)])
        sim.stress_condition(left, normal=0.0, incoming_x="v", incoming_y=5.0, incoming_z=-3.0)  # only along x it moves
    until(sim, 0.7 * LENGTH / speed)
    assert fastest(sim) == pytest.approx(wanted, rel=0.01)
    until(sim, 1.6 * LENGTH / speed)
    assert fastest(sim) < 0.02 * wanted


def test_the_time_step_follows_the_dashpots_and_nothing_grows() -> None:
    sim = Blocks()
    sim.take_mesh(box((2, 2, 2), (0.3, 0.3, 0.3), shaken=0.2))
    changes.element_model(sim, None, "mech_iso_elastic", {"density": RHO, "young": YOUNG, "poisson_ratio": NU})
    free = diagnostics.critical_time_step(sim)
    outer = np.flatnonzero(~sim.closed_faces())
    sim.stress_condition(outer, quiet=True)
    sim.time_step(safety=1.0)
    assert 0.1 * free < diagnostics.critical_time_step(sim) < free
    changes.set_velocity(sim, [5], 1.0, -0.7, 0.3)
    convergence.advance(sim, 2000)
    assert fastest(sim) < 0.02  # what is left falls as a whole, and slows down
    sim.remove_stress_conditions(outer)
    sim.time_step(safety=0.8)
    assert diagnostics.critical_time_step(sim) == pytest.approx(free)


def test_a_checkpoint_keeps_them_and_static_stages_say_that_they_do_not_act(tmp_path: Path) -> None:
    sim, speed, _ = bar("P")
    right = faces_on(sim.mesh, "right")
    sim.stress_condition(right, quiet=True, incoming_z=0.0)
    until(sim, 0.95 * LENGTH / speed)
    saved_state.save(sim, tmp_path / "a.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    for one in (sim, again):
        convergence.advance(one, 200)
    assert np.array_equal(diagnostics.values(sim, "velocity_x"), diagnostics.values(again, "velocity_x"))
    told: list[str] = []
    log = {"warn_once": lambda self, key, text: told.append(text), "info": lambda self, text: None}
    sim.log = type("Log", (), log)()
    sim.option(dynamic=False)
    sim.step()
    assert any("quiet faces act in dynamic runs only" in text for text in told)
    with pytest.raises(CommandError, match="add quiet on to incoming-x and incoming-y and incoming-z"):
        sim.stress_condition(right, quiet=False, incoming_z=1.0)

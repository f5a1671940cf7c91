"""Tables and functions of time in static mode: a step is one unit of time, from the step on at which the mode was
switched on. Relaxation, the solve at once, creep; the plane and space; checkpoints; what cannot act is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, creep, diagnostics, equilibrium, saved_state, user_functions
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import Table
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.heat.implicit import Implicit
from hpcdem.physics.heat.model import Heat
from tests.blocks.support import JOINT, near, rectangle
from tests.blocks.test_overlaps import Log
from tests.flow.support import WATER, inner
from tests.space import support as space

ROCK = {"density": 2000.0, "young": 1e8, "poisson_ratio": 0.2}


@pytest.mark.parametrize(
    "rows, told",
    [([(0, 1), (2, 1), (1, 3)], "1 follows 2 (pair 3)"), ([(5, 1), (5, 2)], "5 follows 5 (pair 2)")],
)
def test_times_that_do_not_ascend_are_reported_with_their_place(rows, told):
    with pytest.raises(CommandError, match=rf"table 't': times must ascend, but {re.escape(told)}$"):
        Table.of(rows, "t")


def block(kind: str = "cross", law: str = "mech_iso_elastic", **properties: float) -> Blocks:
    """A static body of 1 m on rollers, its corner held."""
    mesh = space.box((2, 2, 2), (1.0, 1.0, 1.0)) if kind == "tet" else rectangle(2, 2, 1.0, 1.0, kind=kind)
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, law, {**ROCK, **properties})
    sim.option(dynamic=False, collision=False)
    last = mesh.dim - 1
    base = np.flatnonzero(mesh.points[:, last] == 0.0)
    sim.velocity_condition(base, **{f"v{'xyz'[last]}": 0.0})
    if mesh.dim == 3:
        sim.velocity_condition(np.flatnonzero((mesh.points[:, :1] == 0.0).all(axis=1)), vx=0.0)
        sim.velocity_condition(np.flatnonzero(mesh.points[:, 1] == 0.0), vy=0.0)
    else:
        sim.velocity_condition(np.flatnonzero((mesh.points == 0.0).all(axis=1)), vx=0.0)
    return sim


def top(sim: Blocks) -> np.ndarray:
    mesh = sim.the_mesh()
    return space.faces_on(mesh, "top") if mesh.dim == 3 else near(mesh, 1, 1.0)


def upper(sim: Blocks) -> np.ndarray:
    """Points of the upper side."""
    points = sim.the_mesh().points
    return np.flatnonzero(points[:, -1] == 1.0)


def stress(sim: Blocks) -> float:
    return float(diagnostics.values(sim, "stress_zz" if sim.dim == 3 else "stress_yy").mean())


@pytest.mark.parametrize("kind", ["cross", "quad", "tet"])
def test_a_ramp_of_stress_acts(kind):
    """By steps, then at once: half of the load after half of the steps, all of it after all, and no more later."""
    sim = block(kind)
    sim.table("load", [(0.0, 0.0), (1000.0, -1e5)])
    sim.stress_condition(top(sim), normal="load")
    convergence.advance(sim, 500)
    assert stress(sim) == pytest.approx(-5e4, rel=0.01)
    equilibrium.solve_elastic(sim, cycles=250)
    assert stress(sim) == pytest.approx(-7.5e4, rel=1e-6)
    convergence.advance(sim, 1500)
    assert stress(sim) == pytest.approx(-1e5, rel=1e-6)
    assert sim.clock.time == 0.0


@pytest.mark.parametrize("kind", ["cross", "tet"])
def test_a_ramp_of_velocity_moves_as_far_by_steps_as_at_once(kind):
    """The sum of the table over the steps, each a unit of time."""
    ways = []
    for at_once in (False, True):
        sim = block(kind)
        sim.table("v", [(0.0, 0.0), (100.0, -1e-6), (200.0, 0.0)])
        sim.velocity_condition(upper(sim), **{"vz" if kind == "tet" else "vy": "v"})
        if at_once:
            equilibrium.solve_elastic(sim, cycles=200)
        else:
            convergence.advance(sim, 200)
        ways.append(diagnostics.values(sim, "displacement_z" if kind == "tet" else "displacement_y", upper(sim)))
    assert ways[0] == pytest.approx(-1e-4, rel=1e-6) and ways[1] == pytest.approx(ways[0], rel=1e-9)


def test_forces_and_functions_of_place_and_time(tmp_path: Path):
    """A nodal force by a table, a stress by a function f(x, y, t)."""
    sim = block()
    (tmp_path / "f.py").write_text("def f(x, t):\n    return -1e3 * min(t, 100.0) + 0.0 * x\n")
    sim.stress_condition(top(sim), normal=user_functions.load(sim, tmp_path / "f.py", "f.py:f"))
    sim.table("force", [(0.0, 0.0), (100.0, -4e4)])
    sim.force_condition(upper(sim), fy="force")
    convergence.solve(sim, cycles=3000)
    assert diagnostics.total(sim, "reaction_y") == pytest.approx(1e5 + 3 * 4e4, rel=1e-3)


def test_creep_reads_tables_at_creep_time():
    """Steps of relaxation and solves within a creep step do not count; the load is that at its end."""
    sim = block("quad", "mech_burgers", maxwell_viscosity=1e18)
    sim.table("load", [(0.0, 0.0), (1000.0, -1e5)])
    sim.stress_condition(top(sim), normal="load")
    creep.switch(sim, True, dt=100.0)
    for n in range(1, 13):
        creep.begin(sim, 1200.0)
        equilibrium.solve_elastic(sim) if n % 2 else convergence.solve(sim, ratio=1e-6)
        creep.finish(sim, 1200.0)
        assert stress(sim) == pytest.approx(max(-1e4 * n, -1e5), rel=1e-4)


@pytest.mark.parametrize("at", [0, 137])
def test_a_checkpoint_within_a_ramp(at, tmp_path: Path):
    """After a stage in motion, so that static mode does not begin at step 0."""
    sim = block()
    sim.option(dynamic=True)
    convergence.advance(sim, 40)
    sim.option(dynamic=False)
    began = sim.clock.time
    sim.table("load", [(0.0, 0.0), (300.0, -1e5)])
    sim.stress_condition(top(sim), normal="load")
    convergence.advance(sim, at)
    saved_state.save(sim, tmp_path / "a.sav", {})
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    for one in (sim, again):
        convergence.advance(one, 100)
    assert sim.time_now() == again.time_now() == pytest.approx(began + at + 100.0)
    assert np.array_equal(diagnostics.values(sim, "position_y"), diagnostics.values(again, "position_y"))


def test_what_happens_at_the_ends_is_reported():
    """Static mode ends: a table that has another value at the model time is named. One that is over within a static
    step is, too."""
    sim, said = block(), []
    sim.log = Log(said)
    sim.table("load", [(0.0, 0.0), (100.0, -1e5)])
    sim.stress_condition(top(sim), normal="load")
    convergence.advance(sim, 200)
    assert not said
    sim.option(dynamic=True)
    assert len(said) == 1 and "table 'load' of a condition goes from -100000 to 0" in said[0]
    sim.table("load", [(0.0, 0.0), (1e-3, -1e5)])
    sim.option(dynamic=False)
    convergence.advance(sim, 2)
    assert "table 'load' of a condition goes from 0 to -100000 within one static step" in said[1]


def test_implicit_steps_refuse_tables_of_blocks_that_continue():
    """They count no static steps; a table that is at its end does nothing."""
    sim = block()
    sim.joint_model(inner(sim.the_mesh()), "classic_intrinsic_cohesive_interface", {**JOINT, "penalty_normal": 1e10})
    sim.table("load", [(0.0, 0.0), (100.0, -1e3)])
    sim.stress_condition(top(sim), normal="load")
    flow = Flow.of(sim)
    flow.assign(inner(sim.the_mesh()), WATER)
    with pytest.raises(CommandError, match=r"table 'load' of a condition still changes.*flow"):
        Coupled(sim, 1.0).__enter__()
    sim = block()
    sim.table("load", [(0.0, 0.0), (100.0, -1e3)])
    sim.stress_condition(top(sim), normal="load")
    heat = Heat.of(sim)
    heat.assign(None, {"conductivity": 3.0, "capacity": 800.0})
    with pytest.raises(CommandError, match=r"table 'load' of a condition still changes.*heat"):
        Implicit(sim)
    equilibrium.solve_elastic(sim, cycles=100)
    run = Implicit(sim)
    run.advance(10.0)
    run.close()
    assert stress(sim) == pytest.approx(-1e3, rel=1e-6)

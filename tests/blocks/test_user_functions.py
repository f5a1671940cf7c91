"""Boundary conditions as functions of place and time that users write."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, saved_state, user_functions, user_laws
from hpcdem.physics.fdem.node_conditions import NodeCondition
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import ROCK, model, near, rectangle, shaken
from tests.pcdc.test_plastic import run

FILE = Path(__file__).with_name("laws") / "rock.py"


def function(sim: Blocks, name: str) -> str:
    return user_functions.load(sim, FILE, f"rock.py:{name}")


def plate() -> Blocks:
    return model(shaken(rectangle(4, 4, 1.0, 1.0), 0.2))


def test_rows_of_functions_stand_behind_those_of_all():
    """Objects with the conditions 1, 0, 2, 1, of which 1 and 2 follow a function."""
    name = function(plate(), "lift")
    ways = [NodeCondition(), NodeCondition(at_y=name), NodeCondition(at_x=name)]
    places = np.arange(8.0).reshape(4, 2)
    placed = user_functions.Placed(ways, np.array([1, 0, 2, 1]), places)
    assert placed.of.tolist() == [3, 0, 4, 5] and placed.rows.tolist() == [1, 2, 1]
    (one, field, of, mine, at), (other, *_, there) = placed.parts
    assert (one, field, of, mine.tolist()) == (ways[1], "at_y", user_functions.FUNCTIONS[name], [0, 2])
    assert at.tolist() == places[[0, 3]].tolist() and other == ways[2] and there.tolist() == [[4.0, 5.0]]


def test_velocity_by_place():
    sim = plate()
    sim.velocity_condition(None, vx=0.0, vy=function(sim, "lift"))
    convergence.advance(sim, 7)
    assert np.array_equal(diagnostics.values(sim, "velocity_y"), 0.1 * sim.mesh.points[:, 1])
    assert np.array_equal(diagnostics.values(sim, "velocity_x"), np.zeros(25))


@pytest.mark.parametrize("dynamic", [True, False])
def test_a_function_that_is_a_number_gives_its_bits(dynamic, tmp_path):
    """Velocity, acceleration, force and traction."""
    (tmp_path / "f.py").write_text("def f(x, t):\n    return 2e4 + 0.0 * x * t\n")
    ends = []
    for own in (False, True):
        sim = plate()
        value = user_functions.load(sim, tmp_path / "f.py", "f.py:f") if own else 2e4
        x = sim.mesh.points[:, 0]
        sim.velocity_condition(np.flatnonzero(x < 1e-9), vx=0.0, vy=0.0)
        if dynamic:
            sim.velocity_condition([12], ax=value)
        sim.force_condition([7, 17], fy=value)
        sim.stress_condition(near(sim.mesh, 0, 1.0), xx=value, normal=value)
        sim.option(dynamic=dynamic)
        convergence.advance(sim, 60)
        ends.append((sim.x, sim.v))
    assert np.array_equal(ends[0][0], ends[1][0]) and np.array_equal(ends[0][1], ends[1][1])
    assert np.abs(ends[0][1]).max() > 0.0


def test_traction_by_place_and_time():
    """Force on a side: L times the value at its middle, half to each end, at the time of the positions."""
    sim = model(rectangle(1, 2, 1.0, 2.0))
    sim.velocity_condition(None, vx=0.0, vy=0.0)
    sim.stress_condition(near(sim.mesh, 0, 1.0), normal=function(sim, "beat"))
    sim.time_step(value=1e-6)
    convergence.advance(sim, 5)
    pull = [-2e6 * np.sin(3e4 * (5e-6 - 1e-4 * y) + 1.0) for y in (0.5, 1.5)]
    on_right = [0.5 * pull[0], 0.5 * (pull[0] + pull[1]), 0.5 * pull[1]]
    places = np.flatnonzero(sim.mesh.points[:, 0] > 0.5)
    found = -diagnostics.values(sim, "reaction_x")[places[np.argsort(sim.mesh.points[places, 1])]]
    assert found == pytest.approx(on_right, rel=1e-12)


WRONG = {
    "syntax": ("def f(x:\n    return x\n", "f.py:1: '(' was never closed"),
    "no such function": ("def g(x):\n    return x\n", "f.py: there is no function 'f' in it"),
    "other arguments": (
        "def f(x, w):\n    return x\n",
        "f.py:1: a boundary condition must be a function of x, y, z, t",
    ),
    "two numbers": ("def f(x):\n    return x, x\n", "f.py:1: 'f' must return one float"),
    "a whole number": ("def f(x):\n    return 1\n", "f.py:1: 'f' must return one float (0.0, not 0)"),
    "a missing name": ("def f(x):\n    a = 1.0\n    return a * z\n", "f.py:3: numba: NameError: name 'z'"),
    "not finite": ("def f(x, y):\n    return y / x\n", "at_y: f.py:f is nan at x 0, y 0, t 0"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_reported_by_file_and_line(case, tmp_path):
    text, message = WRONG[case]
    (tmp_path / "f.py").write_text(text)
    sim = plate()
    with pytest.raises(CommandError) as caught:
        sim.velocity_condition(None, vy=user_functions.load(sim, tmp_path / "f.py", "f.py:f"))
    assert message in str(caught.value)


def test_a_number_that_is_none_later_stops_the_run_and_names_what_is_of_the_user(tmp_path):
    (tmp_path / "f.py").write_text("import math\n\n\ndef late(t):\n    return math.sqrt(1e-5 - t)\n")
    sim = plate()
    law = user_laws.load(sim, FILE, "rock.py:tresca").name
    changes.element_model(sim, [3], law, {**ROCK, "limit": 1e9})
    sim.time_step(value=1e-6)
    function(sim, "lift")  # named, but nothing follows it
    sim.velocity_condition([0, 1], vx=user_functions.load(sim, tmp_path / "f.py", "f.py:late"))
    with pytest.raises(
        PhysicsError, match=r"a number is not finite .*; or it comes from f\.py:late, rock\.py:tresca\n"
    ):
        convergence.advance(sim, 100)


def test_the_static_solve_refuses_it_by_name():
    sim = plate()
    sim.option(dynamic=False)
    sim.velocity_condition(None, vx=0.0, vy=function(sim, "lift"))
    with pytest.raises(CommandError, match=r"follows the function rock\.py:lift"):
        equilibrium.solve_elastic(sim)


def test_a_checkpoint_needs_the_function_with_the_same_text(tmp_path, monkeypatch):
    sim = plate()
    name = function(sim, "lift")
    sim.velocity_condition(None, vy=name)
    convergence.advance(sim, 3)
    saved_state.save(sim, tmp_path / "a.sav")
    found = user_functions.FUNCTIONS.pop(name)
    empty = Blocks()
    with pytest.raises(CommandError, match=r"the function rock\.py:lift, which this script does not use"):
        saved_state.restore(empty, tmp_path / "a.sav")
    assert empty.mesh is None
    monkeypatch.setitem(user_functions.FUNCTIONS, name, found)
    saved_state.restore(empty, tmp_path / "a.sav")
    for one in (sim, empty):
        convergence.advance(one, 5)
    assert np.array_equal(sim.x, empty.x)


def test_in_a_script(tmp_path):
    shutil.copy(FILE, tmp_path)
    text = """
pcdc mesh structured (0,0) (1,2) cells 4 8
pcdc element c-model mech-iso-e property den 2000 young 1e9 poisson-ratio 0.2
pcdc node boundary mech-vel-b-c velocity-y function 'rock.py:lift' range y 1.99 2.01
pcdc element-face boundary m-s-b-c stress-normal function 'rock.py:beat' range x 0 0
pcdc history create 'v' node nearest (0,2) value velocity-y
pcdc model step 5
"""
    pcdc = run(tmp_path, text).namespace["pcdc"]
    assert pcdc.history("v")[-1, 2] == 0.2

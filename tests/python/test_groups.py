"""Methods in groups, both spellings of colour, hints for mistyped words, errors that are of Python's kinds too."""

from __future__ import annotations

import functools
import inspect
import subprocess
import sys
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import hpcdem.sweep
from hpcdem.api import Frame, Simulation, blocks, simulation
from hpcdem.api.program import carried_out, spelt
from hpcdem.core import units
from hpcdem.core.errors import ScriptError, UnknownNameError, WrongTypeError, WrongValueError
from hpcdem.sweep import Sweep
from tests.tables import each

GROUPS = simulation.Particles, simulation.Walls, simulation.Bonds

PROGRAM = """
import math
import hpcdem

def said(kind, make):
    try:
        make()
    except kind as error:
        assert isinstance(error, hpcdem.HpcdemError)
        return str(error)
    raise SystemExit(f"no {kind}")

sim = hpcdem.Simulation(log=False)
assert sim.walls.box(0.0, 10.0, 0.0, 10.0, kn=1e7, ks=1e7) is None
sim.walls.create(0, ((0.0, 1.0), (10.0, 1.0)), kn=1e7, ks=1e7, colour="black")
sim.particles.ball(5.0, 1.49, 0.5, colour="red", group="a")
sim.ball(5.95, 1.5, 0.5, color=2, group="a")
sim.particles.properties(density=2500.0, kn=1e7, ks=1e7)
sim.set(gravity=(0.0, -9.8), dt=1e-3)
assert sim.walls == {i: sim.walls[i] for i in sim.walls} and set(sim.walls) == {0, 100, 101, 102, 103}
assert [w.p1[1] for i, w in sim.walls.items() if i == 0] == [1.0] and len(sim.walls) == 5 and 7 not in sim.walls
assert sim.bonds.create(tstrength=1e9, sstrength=1e9) == sim.bonds.left == sim.bonds_left == 1
assert sorted(sim.bonds()) == sorted(sim.bonds.table()) and sim.bonds()["id1"].tolist() == [0]
sim.cycle(2)
assert sim.walls.force(0) == sim.wall_force(0) and sim.walls.forces() == sim.wall_forces() and sim.wall_force(0)[1] < 0
assert len(sim.particles) == sim.particles.count == 2 and sim.particles["color"].tolist() == sim["color"].tolist()
sim.particles["vx"] = 3.0
assert sim["vx"].tolist() == [3.0, 3.0] and "shear" in sim.particles._ipython_key_completions_()
assert sim.particles.delete("id 1 1") == 1 and sim.count == 1 and repr(sim.particles).startswith("<particles of <Sim")

text = said(TypeError, lambda: sim.particles.ball(1.0, 1.0, 0.5, colr="red"))
assert "program.py:" in text and "ball: there is no argument 'colr'; did you mean 'color'?" in text, text
text = said(TypeError, lambda: sim.prop(densty=1.0))
assert "prop: there is no argument 'densty'; did you mean 'density'?" in text, text
text = said(TypeError, lambda: sim.ball(1.0))
assert "ball: missing" in text and "Simulation.ball()" not in text, text
text = said(ValueError, lambda: sim.ball(1.0, 1.0, 0.5, color="pink"))
assert "expected a colour" in text, text
text = said(KeyError, lambda: sim["mas"])
assert "there is no field 'mas'; did you mean 'mass'?" in text and text[0] != "'", text
text = said(KeyError, lambda: sim.particles.__setitem__("radus", 1.0))
assert "field 'radus' cannot be set; did you mean 'radius'?" in text, text
assert "must be finite" in said(ValueError, lambda: sim.__setitem__("vx", math.nan))
text = said(TypeError, lambda: sim.mesh.structured((0, 0), (1, 1), (2, 2), ration=(1.0, 1.0)))
assert "mesh.structured: there is no argument 'ration'; did you mean 'ratio'?" in text, text
sim.geometry.circle(center=(0.0, 0.0), radius=1.0, as_layer="a")
text = said(ValueError, lambda: sim.geometry.circle(centre=(0.0, 0.0), radius=-1.0, as_layer="b"))
assert "geometry.circle: " in text, text
print("well")
"""


def test_groups_do_what_the_methods_do(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(PROGRAM)
    done = subprocess.run([sys.executable, "program.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and done.stdout.endswith("well\n"), done.stdout + done.stderr


@pytest.mark.parametrize("group", GROUPS)
def test_a_method_of_a_group_is_that_of_the_simulation(group: type) -> None:
    """With its arguments, so editors complete them; nothing is said twice."""
    for name, value in vars(group).items():
        if isinstance(value, simulation.Shared):
            assert getattr(Simulation, value.method.__name__) is value.method
            assert inspect.signature(getattr(group, name)) == inspect.signature(value.method)
            assert inspect.getdoc(getattr(group, name))


def public(of: type) -> list[tuple[str, Callable[..., Any]]]:
    return [(f"{of.__name__}.{n}", f) for n, f in vars(of).items() if inspect.isfunction(f) and not n.startswith("_")]


WORDS = [of for of in vars(blocks).values() if inspect.isclass(of) and issubclass(of, blocks.Words)]
METHODS = [one for of in (Simulation, Frame, Sweep, blocks.BlockCommands, *WORDS) for one in public(of)]


@each(("name", "method"), METHODS)
def test_no_method_takes_what_it_does_not_name(name: str, method: Callable[..., Any]) -> None:
    """`**options: Any` tells an editor nothing. Words of a TypedDict, and numbers of what was added, are told."""
    for parameter in inspect.signature(method).parameters.values():
        if parameter.kind is parameter.VAR_KEYWORD:
            assert "Any" not in str(parameter.annotation), f"{name}(**{parameter.name})"


def test_the_words_of_a_report_are_those_of_measure() -> None:
    from hpcdem.post.measure.scene import Request

    own = set(typing.get_type_hints(hpcdem.sweep.api.Options))
    assert own == set(Request.__dataclass_fields__) - {"folder", "what", "formats", "output", "log", "color_names"}


@pytest.mark.parametrize(
    ("options", "names", "found"),
    [
        ({"colour": 1}, ("color",), {"color": 1}), ({"color": 1}, ("colour", "x"), {"colour": 1}),
        ({"center": 1, "x": 2}, ("centre", "x"), {"centre": 1, "x": 2}), ({"colour": 1}, ("x",), {"colour": 1}),
        ({"colour": 1, "color": 2}, ("color",), {"colour": 1, "color": 2}),
    ],
)  # fmt: skip
def test_words_that_are_spelt_with_two_spellings(options, names, found) -> None:
    assert spelt(options, names) == found


def test_errors_are_of_pythons_own_kinds_too() -> None:
    """Once: what comes from a method within another keeps its place."""
    wrong = (units.system, "cgs", WrongValueError), (float, "x", WrongValueError), (float, [], WrongTypeError)
    for make, value, own in wrong:
        inner = functools.partial(carried_out, ("inner.py", 7), "inner", functools.partial(make, value))
        with pytest.raises(own) as caught:
            carried_out(("outer.py", 3), "outer", inner)
        assert isinstance(caught.value, ScriptError) and str(caught.value).startswith("inner.py:7: inner: ")
        assert isinstance(caught.value, TypeError) == (own is WrongTypeError)
    assert str(UnknownNameError("a.py", 1, "what 'it' is")) == "a.py:1: what 'it' is"
    assert issubclass(UnknownNameError, KeyError) and UnknownNameError("a", 1, "b").exit_code == 2

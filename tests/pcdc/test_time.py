"""solve time on the real simulation: the model time that is asked for passes, whatever was said before it, and the time
step is the one that was said last."""

from __future__ import annotations

import random

import numpy as np
import pytest

from hpcdem.commands.fdem import checkpoints
from hpcdem.core import units
from hpcdem.core.errors import HpcdemError, StoppedWithCheckpoint, UsageError
from hpcdem.physics.fdem import convergence, diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.runtime.run_folder import Retention
from hpcdem.runtime.stop_requests import STOP
from tests.pcdc.fake import Bench, Noted
from tests.pcdc.test_running import Asked

BLOCK = (
    "pcdc mesh structured (0,0) (4,2) cells 8 4 group 'rock'\n"
    "pcdc element c-model mech-iso-elastic property density 2700 young 50e9 poisson-ratio 0.25\n"
    "pcdc node boundary mech-m-b-c type 1 range y -0.001 0.001\npcdc model gravity (0,-10)\n"
)
STATIC = "pcdc model option dynamic off\npcdc model step 40\npcdc model option dynamic on\n"


class Stop(Asked):
    """No signal has come."""

    def local_request(self) -> int:
        return 0


class Rock(Bench):
    """Scripts on the real simulation."""

    def __init__(self, folder, script: str = BLOCK) -> None:
        folder.mkdir(exist_ok=True)
        super().__init__(folder, blocks=Blocks(log=Noted(), outdir=folder / "data"))
        if script:
            self(script)

    @property
    def time(self) -> float:
        """Model time [s]."""
        return self.blocks.clock.time

    def passes(self, time: float) -> None:
        """solve time: ends at the step nearest to the time that is asked for."""
        began = self.time
        self(f"pcdc model solve time {time!r}\n")
        assert abs(self.time - began - time) <= 0.5 * self.blocks.clock.dt * (1.0 + 1e-9)


def resumed(folder, script: str, step: int, monkeypatch) -> Rock:
    """A script that was stopped at a step and went on from its checkpoint."""
    stopped, again = Rock(folder, ""), Rock(folder, "")
    usual = convergence.advance
    monkeypatch.setattr(stopped.blocks, "stop", Stop())
    with monkeypatch.context() as patch, pytest.raises(StoppedWithCheckpoint):
        patch.setattr(convergence, "advance", lambda sim, steps: usual(sim, 1) or STOP * (stopped.project.step == step))
        stopped(script)
    past = checkpoints.take_up(again.project)
    again.interpreter.run(again.interpreter.read(script, "script.sc"), past)
    return again


@pytest.fixture
def rock(tmp_path) -> Rock:
    """A block on a rigid base under gravity."""
    return Rock(tmp_path)


def test_time_passes_after_a_static_stage(rock):
    """The static step is 1: a stage of 0.01 s is not over before it begins (the manual, 7.4.4)."""
    rock(STATIC)
    rock.passes(1e-3)
    assert rock.blocks.clock.step > 100


@pytest.mark.parametrize(
    ("before", "after"),
    [("time-step value 1e-7", "time-step value 5e-6"), ("time-step value 5e-6", "time-step value 1e-7"),
     ("gravity (0,-10)", None)],
)  # fmt: skip
def test_the_number_of_steps_follows_the_present_time_step(rock, before, after):
    """It grew, it shrank, or the material became 10 000 times softer: 100 times larger steps."""
    rock(f"pcdc model {before}\npcdc model step 3\n")
    rock(f"pcdc model {after}\n" if after else "pcdc element property young 5e6\n")
    rock.passes(1e-3)


def _change(choose: random.Random, said: dict) -> str:
    """One command, at random; said: what the time step is after it."""
    what = choose.choice(
        ["static", "value", "value 0", "mass", "mass 0", "auto on", "auto off", "safety", "softer", "less", "renew"]
    )
    if what == "static":
        return STATIC
    if what == "value":
        said.update(value=choose.uniform(1e-7, 3e-6), mass=0.0)
        return f"pcdc model time-step value {said['value']!r}\n"
    if what == "mass":
        said.update(mass=choose.uniform(1e-5, 4e-5), value=0.0)
        return f"pcdc model time-step mass-scaling {said['mass']!r}\n"
    if what == "auto on":
        said.update(mass=0.0, value=0.0)
    if what == "value 0":
        said["value"] = 0.0
    if what == "mass 0":
        said["mass"] = 0.0
        return "pcdc model time-step mass-scaling 0\n"
    if what == "safety":
        said["safety"] = choose.uniform(0.3, 0.9)
        return f"pcdc model time-step safety {said['safety']!r}\n"
    if what == "softer":
        return f"pcdc element property young {choose.uniform(1e9, 60e9)!r}\n"
    if what == "less":
        return f"pcdc element c-model null range id {choose.randrange(40, 64)}\n"
    return f"pcdc model time-step {what}\n" if what != "renew" else "pcdc node reset velocity\n"


@pytest.mark.parametrize("seed", range(8))
def test_in_any_order_the_time_passes_and_the_step_is_the_one_said_last(tmp_path, seed):
    """Twelve commands about the time step, the mode and the stiffness, one after the other, and time that passes."""
    choose = random.Random(seed)
    rock, said = Rock(tmp_path), {"value": 0.0, "mass": 0.0, "safety": 0.8}
    for _ in range(12):
        rock(_change(choose, said))
        rock.passes(choose.choice([3.3e-6, 4.7e-5, 2.1e-4]))
        blocks = rock.blocks
        assert blocks.options.safety == said["safety"]
        assert blocks.clock.dt == (
            said["value"] or said["mass"] or pytest.approx(diagnostics.critical_time_step(blocks))
        )
        assert (diagnostics.added_mass(blocks) > 0.0) == (said["mass"] > diagnostics.critical_time_step(blocks))


def test_mass_scaling_reaches_the_right_velocity_with_its_step_and_ends_with_a_value(rock):
    """A free fall with mass scaling is slow, as its description says; a value that is said after it ends it: g t."""
    rock("pcdc node boundary remove\npcdc model time-step mass-scaling 1e-3\npcdc model step 1\n")
    told = f"(by mass scaling, which adds {diagnostics.added_mass(rock.blocks):.3g} times the mass)"
    assert diagnostics.added_mass(rock.blocks) > 1000.0 and any(told in line for line in rock.blocks.log.lines)
    rock("pcdc node reset velocity\npcdc model time-step value 1e-5\n")
    rock.blocks.clock.time = 0.0
    rock.passes(1e-3)
    assert diagnostics.values(rock.blocks, "velocity_y").mean() == pytest.approx(-10.0 * rock.time, rel=0.01)
    assert diagnostics.added_mass(rock.blocks) == 0.0


@pytest.mark.parametrize(
    ("words", "told"),
    [("value 1e-5 mass-scaling 1e-3", "value and mass-scaling cannot be combined"),
     ("auto on value 1e-6", "value and auto on cannot be combined"),
     ("mass-scaling 1e-5 auto on", "auto on and mass-scaling cannot be combined"),
     ("value 1e-6 safety 0.5", "value and safety cannot be combined"), ("safety 1.5", "at most 1")],
)  # fmt: skip
def test_words_that_do_not_go_together_are_refused_by_their_line(rock, words, told):
    with pytest.raises(HpcdemError, match=rf"script2.sc:1: .*{told}"):
        rock(f"pcdc model time-step {words}\n")
    given = {name.replace("-", "_"): value == "on" if value == "on" else float(value)
             for name, value in zip(words.split()[0::2], words.split()[1::2])}  # fmt: skip
    before = rock.blocks.options
    with pytest.raises(HpcdemError):
        rock.blocks.time_step(**given)
    assert rock.blocks.options == before


def test_the_log_names_the_step_its_limit_and_the_safety_factor(rock):
    rock("pcdc model step 1\npcdc model time-step safety 0.5\npcdc model step 1\n")
    limit = diagnostics.critical_time_step(rock.blocks) / 0.5
    rock(f"pcdc model time-step value {0.9 * limit!r}\npcdc model step 1\n")
    steps = [line for line in rock.blocks.log.lines if line.startswith(("time step", "warning: the time step"))]
    now, longest = (units.with_prefix(value, "s") for value in (0.8 * limit, limit))
    told = f"time step {now} (estimated): 0.80 of the stability limit of {longest}, as the safety factor 0.8 allows"
    assert told in steps[0]
    assert "(estimated): 0.50 of the stability limit" in steps[1] and "(given): 0.90 of the stability limit" in steps[2]
    assert steps[3].startswith("warning: ") and "the safety factor 0.5 allows" in steps[3]


def test_less_than_half_a_step_is_reported(rock):
    rock("pcdc model time-step value 1e-5\npcdc model solve time 4e-6\n")
    assert rock.blocks.clock.step == 0 and "less than half a time step (1e-05 s)" in rock.blocks.log.lines[-3]


@pytest.mark.parametrize("after", [20, 130])
def test_a_stop_in_the_middle_changes_nothing(tmp_path, monkeypatch, after):
    """Static, then dynamic with a step that is followed while the rock is soft: the same end after a restart."""
    script = BLOCK + STATIC + (
        "pcdc element property young 1e7\npcdc model time-step auto on\npcdc node initial velocity (0,-3)\n"
        "pcdc model solve time 0.05\npcdc model time-step value 2e-5\npcdc model solve time 2e-3\n"
    )  # fmt: skip
    straight, again = Rock(tmp_path / "a", script), resumed(tmp_path / "b", script, 40 + after, monkeypatch)
    assert again.blocks.clock == straight.blocks.clock and straight.blocks.clock.step > 200
    for name in ("position_y", "velocity_x"):
        assert np.array_equal(diagnostics.values(again.blocks, name), diagnostics.values(straight.blocks, name))


def test_a_script_goes_back_to_a_time(tmp_path, monkeypatch):
    """Checkpoints each ten steps, of which each second one is spared; the last one before a time is taken up, and what
    came later counts no more."""
    straight, first, again = Rock(tmp_path / "a", ""), Rock(tmp_path / "b", ""), Rock(tmp_path / "b", "")
    script = f"{BLOCK}pcdc model step 55\n"
    straight(script)
    usual = convergence.advance

    def saving(sim, steps):
        if sim.clock.step and sim.clock.step % 10 == 0:
            checkpoints.write_checkpoint(first.project)
        return usual(sim, 1)

    first.project.keep = Retention(1, steps=20)
    with monkeypatch.context() as patch:
        patch.setattr(convergence, "advance", saving)
        first(script)
    assert [int(path.stem) for path in sorted(first.project.outdir.glob("*.sav"))] == [20, 40, 50]
    with pytest.raises(UsageError, match="at or before 1e-09 s of model time"):
        checkpoints.take_up(Rock(tmp_path / "b", "").project, 1e-9)
    past = checkpoints.take_up(again.project, 45.0 * straight.blocks.clock.dt)
    assert again.project.step == 40
    again.interpreter.run(again.interpreter.read(script, "script.sc"), past)
    assert again.blocks.clock == straight.blocks.clock
    assert np.array_equal(*(diagnostics.values(rock.blocks, "position_y") for rock in (again, straight)))
    later = Rock(tmp_path / "b", "")
    checkpoints.take_up(later.project)
    assert later.project.step == 40


def test_a_history_of_forces_is_whole_across_rebuilds(tmp_path):
    """A record reads the forces of the next step, whose rebuild may replace their tables: the numbers are those of
    single steps, after each of which forces are recomputed."""
    text = """
pcdc mesh structured (0,0) (4,1) cells 8 2
pcdc mesh structured (1,1.02) (2,2.02) cells 2 2
pcdc element c-model mech-iso-elastic property density 2700 young 50e9 poisson-ratio 0.25
pcdc node boundary mech-m-b-c type 1 range y -0.001 0.001
pcdc node initial velocity-y 200 range y 1.01 3
pcdc node initial velocity-y -1 range y 0.9 1.005
pcdc history create 'r' node value reaction-y sum every 1 range y -0.001 0.001
"""
    found = []
    for steps in ("pcdc model step 100\n", 100 * "pcdc model step 1\n"):
        rock = Rock(tmp_path / str(len(found)), text)(steps)
        assert rock.blocks.rebuilds > 2
        found.append(rock.project.histories["r"].rows)
    assert found[0] == found[1] and len(found[0]) == 100 and max(abs(value) for *_, value in found[0]) > 1e6

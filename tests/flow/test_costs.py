"""model solve hydraulic auto: explicit or implicit, whatever costs less; long explicit runs are announced. A run that
is stopped in the middle of implicit steps goes on as if it had not been."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.commands.fdem import checkpoints, steps
from hpcdem.core.errors import CommandError, StoppedWithCheckpoint
from hpcdem.lang.pcdc.statement import ScriptError
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.flow import costs
from hpcdem.physics.flow.model import Flow
from hpcdem.runtime.stop_requests import STOP
from tests.pcdc.test_time import Rock, Stop

STRIP = """
pcdc mesh structured (0,0) (4,2) cells 4 2
pcdc element c-model mech-iso-e property density 2500 young 50e9 poisson-r 0.25
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk BULK viscosity 1e-6 \\
    aperature-initial 1e-4 aperature-minumum 1e-5
pcdc model option mechanical off
pcdc flow-node initial saturation 1
pcdc node boundary hydra-c-f-b pressure 1e6 range x 0 0
"""
HALVES = """
pcdc mesh structured (0,-1) (4,1) cells 20 10
pcdc element c-model mech-iso-e property density 2500 young 50e9 poisson-r 0.25
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 1e8 tensile-strength 2e6 gf1 50 gf2 500 \\
    penalty-normal 5e12 range y 0 0
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk BULK viscosity 1e-6 \\
    aperature-initial 1e-5 aperature-minumum 1e-6 range y 0 0
pcdc element initial stress-yy -1e6
pcdc model option dynamic off large-strain off collision off
for y in (-1, 1):
    pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range y [y] [y]
for x in (0, 4):
    pcdc node boundary mech-vel-b-c velocity-x 0 range x [x] [x] y -0.99 0.99
pcdc model solve elastic
pcdc node boundary hydra-c-f-b flow-rate 1e-5 range x 0 0 y 0 0
"""


def said(rock: Rock, words: str) -> list[str]:
    return [line for line in rock.blocks.log.lines if words in line]


@pytest.mark.parametrize(
    ("bulk", "chosen"), [pytest.param(1e6, "explicit", marks=pytest.mark.slow), (1e12, "implicit")]
)
def test_flow_alone_takes_the_cheaper_method(tmp_path, bulk, chosen) -> None:
    """Water that is soft, or stiff: few long sub-steps, or many short ones; the same pressures as by implicit steps."""
    script = STRIP.replace("BULK", f"{bulk:g}")
    rock, other = Rock(tmp_path / "a", script), Rock(tmp_path / "b", script)
    rock("pcdc model solve hydraulic auto time 20\n")
    other("pcdc model solve hydraulic time 20 dt 0.02\n")
    (line,) = said(rock, "solve hydraulic auto")
    assert f"auto: {chosen} steps" in line and "explicit: " in line and "implicit: 100 steps of 0.2 s" in line
    flow, implicit = Flow.of(rock.blocks), Flow.of(other.blocks)
    assert flow.time == pytest.approx(20.0, rel=0.02) and (flow.cycles > 0) == (chosen == "explicit")
    one, two = (each.values("flow-node", "pressure") for each in (flow, implicit))
    assert one == pytest.approx(two, abs=0.02 * two.max()) and np.ptp(two) >= (1e3 if bulk < 1e7 else 0.0)


@pytest.mark.slow
def test_blocks_take_the_cheaper_method(tmp_path) -> None:
    """In static runs by the assigned clock, if that is stable."""
    rock = Rock(tmp_path / "a", HALVES.replace("BULK", "1e6"))
    rock("pcdc model time-step hydraulic 2e-3\npcdc model solve hydraulic auto time 0.1\n")
    assert "auto: explicit steps; explicit: 50 steps of 0.002 s" in said(rock, "auto")[0]
    assert Flow.of(rock.blocks).time == pytest.approx(0.1) and Flow.of(rock.blocks).cycles == 50
    rock("pcdc model time-step hydraulic 5\npcdc model solve hydraulic auto time 10\n")
    assert "auto: implicit" in said(rock, "auto")[1] and "above the stability limit" in said(rock, "auto")[1]
    rock("pcdc model time-step hydraulic 1e-7\npcdc model solve hydraulic auto time 1\n")
    assert "auto: implicit" in said(rock, "auto")[2] and "1e+07 steps of 1e-07 s" in said(rock, "auto")[2]
    assert Flow.of(rock.blocks).time == pytest.approx(11.1) and Flow.of(rock.blocks).cycles == 50
    rock("pcdc model time-step hydraulic 0\npcdc model solve hydraulic auto time 0.1\n")
    assert "auto: implicit" in said(rock, "auto")[3] and "which is not set" in said(rock, "auto")[3]


def test_what_implicit_steps_refuse_is_stepped(tmp_path) -> None:
    """Motion; with the reason. What neither can do is refused."""
    rock = Rock(tmp_path, STRIP.replace("BULK", "1e9"))
    rock("pcdc model option mechanical on\npcdc model solve hydraulic auto time 1e-3\n")
    assert "auto: explicit" in said(rock, "auto")[0] and "dynamic off" in said(rock, "auto")[0]
    assert Flow.of(rock.blocks).cycles > 0
    with pytest.raises(ScriptError, match="velocities"):
        rock(
            "pcdc node boundary mech-vel-b-c velocity-x 1 range x 4 4\n"
            "pcdc model option dynamic off\npcdc model solve hydraulic auto time 1e-3\n"
        )
    with pytest.raises(ScriptError, match="auto needs time"):
        rock("pcdc model solve hydraulic auto steady\n")
    with pytest.raises(ScriptError, match="auto needs hydraulic"):
        rock("pcdc model solve auto\n")
    with pytest.raises(CommandError, match="auto needs a time"):
        steps.solve_hydraulic(rock.project, steady=True, auto=True)


@pytest.mark.parametrize(("command", "short"), [("solve time 100", "solve time 100"), ("step 1000000000", "step 1000")])
def test_long_explicit_runs_are_announced(tmp_path, monkeypatch, command, short) -> None:
    """Sub-steps of a stiff fluid in thin fractures: their length, number and time, before the first of them."""
    for bulk, told in (("1e6", False), ("1e14", True)):
        rock = Rock(tmp_path / bulk, STRIP.replace("BULK", bulk))
        monkeypatch.setattr(rock.blocks, "stop", stop := Stop())
        monkeypatch.setattr(stop, "local_request", lambda: STOP)
        with pytest.raises(StoppedWithCheckpoint):
            rock(f"pcdc model {command if told else short}\n")
        lines = said(rock, "explicit sub-steps")
        assert len(lines) == told
        if told:
            flow = Flow.of(rock.blocks)
            assert f"steps of {flow.dt:.3g} s, about" in lines[0] and "solve hydraulic" in lines[0]
            assert flow.dt < 1e-7 and flow.cycles <= 100


def test_estimates_are_of_the_right_size(tmp_path) -> None:
    """By hand: sub-steps of 1 ms for an hour, of 22 channels; implicit ones of 36 s, dense for 300 of 5000 unknowns."""
    rock = Rock(tmp_path, STRIP.replace("BULK", "1e9"))
    flow = Flow.of(rock.blocks)
    rock("pcdc model time-step hydraulic 1e-3\npcdc model step 1\n")
    found = costs.explicit(flow, 3600.0)
    count = len(flow.network.channels)
    assert found == costs.Cost(3.6e6, 1e-3, 0.0, pytest.approx(3.6e6 * (15e-6 + 11e-9 * count)))
    found = costs.implicit(3600.0, 36.0, 5000, 300)
    assert (found.steps, found.dt) == (100, 36.0) and found.seconds == pytest.approx(500 * (5e-3 + 0.02 + 0.891e-3))
    assert costs.implicit(3600.0, 36.0, 5000, 0).seconds == pytest.approx(500 * (5e-3 + 0.07))


# ---- stops in the middle ---------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("reason", ["signal", pytest.param("limit", marks=pytest.mark.slow)])
def test_a_stop_in_mid_injection_changes_nothing(tmp_path, monkeypatch, reason) -> None:
    """Joints broke before and break after it; the first time a checkpoint, then the run goes on, or its end."""
    script = HALVES.replace("BULK", "2.2e9") + "pcdc history create 'p' flow-node nearest (0,0) value pressure\n"
    script += "pcdc model solve hydraulic time 16 dt 0.5\npcdc model solve hydraulic time 4 dt 0.5\n"
    straight = Rock(tmp_path / "a", script)
    stopped, again = Rock(tmp_path / "b", ""), Rock(tmp_path / "b", "")
    monkeypatch.setattr(stopped.blocks, "stop", stop := Stop())
    monkeypatch.setattr(stop, "reason", reason, raising=False)
    asked: list[int] = []

    def request() -> int:
        if len(asked) == 0 and Flow.of(stopped.blocks).time > 9.0:
            asked.append(diagnostics.joint_counts(stopped.blocks)[2])
            return STOP
        return 0

    monkeypatch.setattr(stop, "local_request", request)
    with pytest.raises(StoppedWithCheckpoint, match=reason):
        stopped(script)
    past = checkpoints.take_up(again.project)
    assert 9.0 < Flow.of(again.blocks).time < 16.0 and asked[0] > 0
    again.interpreter.run(again.interpreter.read(script, "script.sc"), past)
    assert Flow.of(again.blocks).time == Flow.of(straight.blocks).time == pytest.approx(20.0)
    assert again.project.step == straight.project.step
    counts = diagnostics.joint_counts(again.blocks)
    assert counts == diagnostics.joint_counts(straight.blocks) and counts[2] > asked[0]
    for name in ("pressure", "saturation", "fluid"):
        one, other = (Flow.of(rock.blocks).values("flow-node", name) for rock in (straight, again))
        assert np.array_equal(one, other)
    for folder in ("a", "b"):
        assert len((tmp_path / folder / "data" / "cracks.csv").read_text().splitlines()) == 1 + counts[2]
    at = np.flatnonzero((again.blocks.mesh.points == 0.0).all(axis=1))
    assert again["pcdc"].history("p")[-1, 2] == Flow.of(again.blocks).values("flow-node", "pressure", at)[0] > 1e6
    one, other = (rock["pcdc"].history("p") for rock in (straight, again))
    assert one.shape == other.shape and other == pytest.approx(one, rel=1e-9)


def test_durations_in_the_largest_unit_of_which_there_are_two() -> None:
    assert [costs._length(t) for t in (1.5, 119.0, 120.0, 7199.0, 7200.0, 172800.0)] == [
        "1.5 s", "1.2e+02 s", "2 min", "120 min", "2 h", "2 days",
    ]  # fmt: skip

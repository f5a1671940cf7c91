"""model solve towards a ratio that cannot be reached: it ends, says why, and names the body that slides away."""

from __future__ import annotations

import math
from dataclasses import asdict

import pytest

from hpcdem.core.errors import CommandError, EquilibriumError, HpcdemError
from hpcdem.physics.fdem import convergence
from hpcdem.physics.fdem.convergence import Watch
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import joined, model, rectangle
from tests.pcdc.test_time import Rock, resumed

# A block that is held, and one above it that nothing holds.
TWO = (
    "pcdc mesh structured (0,0) (4,2) cells 4 2\npcdc mesh structured (5,3) (6,4) cells 1 1 group 'loose'\n"
    "pcdc element c-model mech-iso-elastic property density 2700 young [young] poisson-ratio 0.25\n"
    "pcdc node boundary mech-m-b-c type 1 range y -0.001 0.001\npcdc model gravity (0,-10)\n"
    "pcdc model option dynamic off\n"
)
LOOSE = r"the body of 2 elements around \(5\.[456].*\), with element 16, slides or falls away by \(.*, -.*\) m per step"


def watched(ratio, window: int, limit: int = 0, steps: int = 1_000_000, broken=lambda n: 0) -> tuple[str, int]:
    """What a watch says of ratio(step), looked at every 50 steps, and when; saved and restored on the way."""
    watch = Watch(window, limit, 0)
    for n in range(50, steps + 1, 50):
        why = watch.failed(n, ratio(n), broken(n))
        if why:
            return why, n
        if n % 10_000 == 0:
            watch = Watch(**asdict(watch))
    return "", steps


@pytest.mark.parametrize(
    "ratio",
    [lambda n: 0.3 * math.exp(-n / 150_000), lambda n: 40.0 / n,
     lambda n: math.exp(-n / 60_000) * (1.1 + math.cos(n / 3000))],
    ids=["exponential", "by the number of steps", "swinging"],
)  # fmt: skip
def test_slow_convergence_continues(ratio):
    assert watched(ratio, 20_000) == ("", 1_000_000)


def test_what_gets_nowhere_ends():
    """At once, after a fall, in a swing that does not die down; not while joints break; at the limit."""
    assert watched(lambda n: 1.0, 20_000) == ("no progress", 20_050)
    assert watched(lambda n: max(1e-3, math.exp(-n / 1000)), 20_000)[0] == "no progress"
    assert watched(lambda n: 1e-3 * (2.0 + math.sin(n / 700)), 20_000)[0] == "no progress"
    # What took 100 000 steps so far may take as many again.
    why, n = watched(lambda n: max(1e-3, math.exp(-n / 14_500)), 20_000)
    assert why == "no progress" and 190_000 < n < 210_000
    assert watched(lambda n: 1.0, 20_000, broken=lambda n: min(n, 300_000) // 15_000) == ("no progress", 320_000)
    assert watched(lambda n: 40.0 / n, 20_000, 70_000) == ("limit", 70_000)
    assert watched(lambda n: 1.0, 0) == ("", 1_000_000)


def test_a_loose_body_is_named_and_the_script_ends(tmp_path):
    with pytest.raises(EquilibriumError, match=rf"script.sc:8: .*for 20000 steps the ratio has not .*{LOOSE}") as told:
        Rock(tmp_path, "young = 50e9\n" + TWO + "pcdc model solve ratio 1e-5\n")
    assert told.value.exit_code == 3


def test_the_script_may_continue_and_look(tmp_path):
    rock = Rock(tmp_path, "young = 50e9\n" + TWO + "pcdc model solve window 3000 on-failure continue\n")
    first = rock.project.solved
    assert first["reason"] == "no progress" and 3000 < first["steps"] < 5000 and first["ratio"] > 0.01
    rock("pcdc element c-model null range group 'loose'\npcdc model solve\nhow = pcdc.solved\n")
    assert rock["how"]["reason"] == "ratio" and rock["how"]["ratio"] <= 1e-5
    rock("pcdc model solve ratio 1e-30 limit 700 on-failure continue\nhow = pcdc.solved\n")
    assert rock["how"]["reason"] == "limit" and rock["how"]["steps"] == 700
    last = rock.blocks.log.lines[-1]
    assert last.startswith("warning: ") and "after 700 steps, the limit" in last and "no body slides away" in last
    rock("pcdc model solve ratio 1e-30 cycles 60\n")
    assert rock.project.solved["reason"] == "cycles" and rock.project.solved["steps"] == 60
    rock("pcdc model option dynamic on\npcdc model solve time 1e-4\n")
    assert rock.project.solved["reason"] == "time" and math.isnan(rock.project.solved["ratio"])
    rock("pcdc model save 'here.sav'\npcdc model new\n")
    assert not rock.project.solved
    rock("pcdc model restore 'here.sav'\n")
    assert rock.project.solved["reason"] == "time" and math.isnan(rock.project.solved["ratio"])


def test_a_restart_in_the_middle_comes_to_the_same_end(tmp_path, monkeypatch):
    """What the watch has seen is part of the checkpoint."""
    script = "young = 50e9\n" + TWO + "pcdc model solve window 3000 on-failure continue\nhow = pcdc.solved\n"
    straight, again = Rock(tmp_path / "a", script), resumed(tmp_path / "b", script, 1730, monkeypatch)
    assert again["how"] == straight["how"] and again.project.step == straight.project.step


def test_a_body_that_is_soon_too_fast_is_no_wrong_time_step(tmp_path):
    """Soft ground: it goes half an edge per step before a window is over."""
    soft = "young = 1e5\n" + TWO + "pcdc model option collision off\n"  # or contacts are searched for in each step
    with pytest.raises(EquilibriumError, match=rf"over half an edge per static step.*{LOOSE}"):
        Rock(tmp_path, soft + "pcdc model solve ratio 1e-5\n")
    rock = Rock(tmp_path, soft + "pcdc model solve on-failure continue\n")
    assert rock.project.solved["reason"] == "runaway"
    rock("pcdc element c-model null range group 'loose'\npcdc node reset velocity\npcdc model solve ratio 1e-5\n")
    assert rock.project.solved["reason"] == "ratio"


@pytest.mark.parametrize(
    ("words", "told"),
    [("cycles 5 window 3", "window needs a run by steps"), ("elastic limit 3", "limit needs a run by steps"),
     ("ratio 1e-4 cycles 5 limit 3", "limit and cycles cannot be combined"), ("on-failure wait", "stop, continue"),
     ("time 1 on-failure stop", "on-failure needs a run by steps"), ("limit -1", "not negative")],
)  # fmt: skip
def test_words_that_do_not_go_together(bench, words, told):
    with pytest.raises(HpcdemError, match=rf"script.sc:1: .*{told}"):
        bench(f"pcdc model solve {words}\n")


def test_the_same_in_python():
    def blocks() -> Blocks:
        sim = model(joined(rectangle(2, 2, 1.0, 1.0), rectangle(1, 1, 0.5, 0.5, y0=3.0)))
        sim.velocity_condition([0, 1, 2], vx=0.0, vy=0.0)
        sim.gravity(0.0, -10.0)
        sim.option(dynamic=False)
        return sim

    sim = blocks()
    found = convergence.solve(sim, window=2000)
    assert found.reason == "no progress" and 2000 < found.steps < 4000 and found.ratio > 0.01
    body = convergence.sliding_body(sim)
    assert body.elements == 2 and body.first == 8 and body.vy < 0.0 and body.x == pytest.approx(0.25, abs=0.01)
    assert (
        convergence.solve(blocks(), limit=300).reason == "limit"
        and convergence.solve(blocks(), cycles=300, ratio=1e-9).reason == "cycles"
    )
    with pytest.raises(CommandError, match="limit must not be negative"):
        convergence.solve(sim, limit=-1)


def test_the_usual_window_grows_with_the_travel_time_of_a_wave():
    """4 n sqrt(1 + P / E) steps, ten times: 300 edges of joints with P = 99 E take 120 000."""
    sim = model(rectangle(300, 1, 300.0, 1.0, kind="quad"))
    sim.option(dynamic=False)
    sim.close_model()
    assert (
        convergence.watch(sim).window == 20_000
        and convergence.watch(sim).limit == 1_000_000
        and convergence.watch(sim, ends=True).limit == 0
    )
    sim.joint_model(None, "classic_intrinsic_cohesive_interface", {
        "cohesion": 1e9, "tensile_strength": 1e9, "gf1": 1e9, "gf2": 1e9, "penalty_normal": 99 * 50e9})  # fmt: skip
    sim.close_model()
    assert convergence.watch(sim).window == pytest.approx(120_000, rel=0.01)
    sim.option(dynamic=True)
    assert convergence.watch(sim).window == 0 and convergence.watch(sim).limit == 10_000_000


@pytest.mark.mpi
def test_all_ranks_end_together_with_exit_code_3(resident, tmp_path):
    (tmp_path / "loose.sc").write_text("young = 50e9\n" + TWO + "pcdc model solve window 2000\n")
    said = []
    for ranks in (1, 2):
        done = resident(ranks, "--no-figure", "loose.sc", cwd=tmp_path, timeout=600)
        assert done.returncode == 3 and "loose.sc:8" in done.stderr
        said.append([line for line in done.stderr.splitlines() if "no equilibrium" in line])
    assert len(said[0]) == 1 and said[0] == said[1]

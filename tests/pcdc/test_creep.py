"""Scripts with elements that creep, on the real simulation."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from hpcdem.commands.fdem import checkpoints, coupling
from hpcdem.core.errors import CommandError, EquilibriumError, StoppedWithCheckpoint
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.lang.pcdc.statement import ScriptError
from hpcdem.physics.fdem import diagnostics
from hpcdem.runtime.stop_requests import STOP
from tests.pcdc.test_time import Rock, Stop, resumed

SHEAR = """
pcdc mesh structured (0,0) (1,1) cells 2 2
pcdc element c-model mech-burgers property den 2500 bulk 20e9 m-s 10e9 m-v 1e16 k-s 5e9 k-v 1e14
pcdc model option dynamic off collision off
pcdc node boundary mech-vel-b-c velocity-x 0 range x -0.01 0.01
pcdc node boundary mech-vel-b-c velocity-y 0 range y -0.01 0.01
pcdc element-face boundary m-s-b-c stress-xx 5e6 range x 0.99 1.01
pcdc element-face boundary m-s-b-c stress-yy -5e6 range y 0.99 1.01
pcdc model solve elastic
pcdc history create 'u' node nearest (1,1) value displacement-x
pcdc history create 'clock' model value creep-time every 2
pcdc history create 'kelvin' element id 0 value kelvin-strain-xx
"""
TIMES = 1e4, 2e4, 5e4, 1e5
STRAINS = 8.98469e-4, 1.142121e-3, 1.442915e-3, 1.543262e-3


def strain(rock: Rock) -> float:
    """Shear strain of the square."""
    return 2.0 * rock["pcdc"].node(8).displacement[0]


@pytest.mark.parametrize("how", ["", "elastic "])
def test_pure_shear(tmp_path, how):
    """By relaxation and at once, from time to time, with a creep step each; histories count creep steps."""
    rock = Rock(tmp_path, SHEAR + "pcdc model creep on dt 2500\npcdc output vtk 'slow' every 4\n")
    for before, time, expected in zip((0.0, *TIMES), TIMES, STRAINS):
        rock(f"pcdc model solve {how}time {time - before!r}\n")
        assert strain(rock) == pytest.approx(expected, rel=2e-3)
        assert rock["pcdc"].creep_time == time and rock["pcdc"].solved["reason"] == "time"
    rows = rock["pcdc"].history("u")
    assert rows[:, 1].tolist() == [2500.0 * k for k in range(1, 41)]
    assert 2.0 * rows[3::4, 2] == pytest.approx([5e6 * compliance(t) for t in rows[3::4, 1]], rel=2e-3)
    clock = rock["pcdc"].history("clock")
    assert np.array_equal(clock[:, 1], clock[:, 2]) and len(clock) == 20 and rock.time == 0.0
    assert rock["pcdc"].history("kelvin")[-1, 2] == rock["pcdc"].element(0).kelvin_strain_xx > 4e-4
    frames = sorted((tmp_path / "data").glob("slow*.vtkhdf"))
    found = [read_mesh_frame(frame) for frame in frames]
    assert [frame.time for frame in found] == [1e4 * k for k in range(11)]
    assert np.array_equal(found[-1].of_elements["creep_strain_xx"], rock["pcdc"].values("element", "creep-strain-xx"))
    assert any("creep time 100000 s after 40 creep steps" in line for line in rock.blocks.log.lines)


def compliance(t: float) -> float:
    return 1e-10 + t / 1e16 + (1.0 - math.exp(-5e9 * t / 1e14)) / 5e9


def test_steps_that_follow_the_stress(tmp_path):
    rock = Rock(tmp_path, SHEAR + "pcdc model creep on dt 100 change 0.02 greatest 5e3\n")
    rock("pcdc model solve elastic time 1e5\n")
    steps = np.diff(rock["pcdc"].history("u")[:, 1])
    assert strain(rock) == pytest.approx(STRAINS[-1], rel=2e-3) and steps.max() == 5e3 and len(steps) < 80
    other = Rock(tmp_path / "b", SHEAR + "pcdc model creep on dt 100 change 0.02 greatest 5e3 least 100\n")
    other("pcdc model solve elastic time 1e4\n")
    assert np.diff(other["pcdc"].history("u")[:, 1])[:-1].min() >= 100.0


def test_in_motion(tmp_path):
    """Without dt; creep time is that of the model from there on; off: elastic again."""
    rock = Rock(tmp_path, SHEAR + "pcdc model option dynamic on energy on\n")
    rock("pcdc model time-step value 1e-6\npcdc model step 10\npcdc element property m-v 1e5\npcdc model creep on\n")
    rock("pcdc history create 'lost' model value creep-loss\npcdc model step 100\n")
    assert rock["pcdc"].creep_time == pytest.approx(1e-4) and rock.time == pytest.approx(1.1e-4)
    assert rock["pcdc"].energies["relative"] < 0.01 and rock["pcdc"].history("lost")[-1, 2] > 0.0
    before = rock["pcdc"].values("element", "creep-work")
    rock("pcdc model creep off\npcdc model step 50\n")
    assert np.array_equal(rock["pcdc"].values("element", "creep-work"), before)
    with pytest.raises(ScriptError, match="dt of creep is for static runs"):
        rock("pcdc model creep on dt 1\n")


@pytest.mark.parametrize("after", [130, 300])
def test_a_stop_in_mid_creep_changes_nothing(tmp_path, monkeypatch, after):
    script = SHEAR + "pcdc model creep on dt 2e3 change 0.1\npcdc model solve ratio 1e-6 time 1e4\n"
    straight, again = Rock(tmp_path / "a", script), resumed(tmp_path / "b", script, after, monkeypatch)
    the_same(straight, again)
    assert straight.project.step > 400


def test_a_stop_between_creep_steps_at_once(tmp_path, monkeypatch):
    script = SHEAR + "pcdc model creep on dt 1e3\npcdc model solve elastic time 1e4 ratio 1e-9\n"
    straight, stopped, again = Rock(tmp_path / "a", script), Rock(tmp_path / "b", ""), Rock(tmp_path / "b", "")
    monkeypatch.setattr(stopped.blocks, "stop", stop := Stop())
    monkeypatch.setattr(stop, "local_request", lambda: STOP * (stopped.blocks.creep.steps == 4))
    with pytest.raises(StoppedWithCheckpoint):
        stopped(script)
    past = checkpoints.take_up(again.project)
    assert again.blocks.creep.time == 4e3
    again.interpreter.run(again.interpreter.read(script, "script.sc"), past)
    the_same(straight, again)


def the_same(straight: Rock, again: Rock) -> None:
    assert again.blocks.clock == straight.blocks.clock and again.blocks.creep == straight.blocks.creep
    for name in ("position_x", "creep_strain_xx", "kelvin_strain_yy", "stress_zz", "creep_work"):
        assert np.array_equal(diagnostics.values(again.blocks, name), diagnostics.values(straight.blocks, name))
    for name in ("u", "clock"):
        assert np.array_equal(again["pcdc"].history(name), straight["pcdc"].history(name))


def test_runs_in_motion_one_after_the_other(tmp_path):
    """Two runs are one, with a file between them or without."""
    fast = SHEAR + "pcdc model option dynamic on\npcdc element property m-v 1e5 k-v 1e4\npcdc model creep on\n"
    whole = Rock(tmp_path / "a", fast + "pcdc model step 60\n")
    the_same(whole, Rock(tmp_path / "b", fast + "pcdc model step 29\npcdc model step 31\n"))
    Rock(tmp_path / "c", fast + "pcdc model step 29\npcdc model save 'a.sav'\n")
    the_same(whole, Rock(tmp_path / "c", "pcdc model restore 'a.sav'\npcdc model step 31\n"))


def test_saved_between_two_runs(tmp_path):
    creep = "pcdc model creep on dt 500 change 0.1 greatest 3000\npcdc model solve elastic time 8e3\n"
    rest = "pcdc model solve elastic time 2e4\n"
    whole = Rock(tmp_path / "a", SHEAR + creep + rest)
    Rock(tmp_path / "b", SHEAR + creep + "pcdc model save 'a.sav'\n")
    the_same(whole, Rock(tmp_path / "b", "pcdc model restore 'a.sav'\n" + rest))


def test_a_creep_step_without_balance(tmp_path):
    """It counts for nothing, and the script ends, or goes on."""
    run = "pcdc model creep on dt 1e3\npcdc model solve ratio 1e-9 time 3e3 limit 100"
    with pytest.raises(EquilibriumError, match="no equilibrium: after 100 steps, the limit"):
        Rock(tmp_path / "a", SHEAR + run + "\n")
    rock = Rock(tmp_path / "b", SHEAR + run + " on-failure continue\n")
    assert rock["pcdc"].solved["reason"] == "limit" and rock["pcdc"].creep_time == 0.0
    assert not rock["pcdc"].values("element", "creep-strain-xx").any()
    rock("pcdc model solve elastic time 1e3\n")
    assert rock["pcdc"].creep_time == 1e3


def test_reset_and_changed_properties(tmp_path):
    """Each word that a property of this model has reaches it, and Kelvin strain is what it says at that moment."""
    rock = Rock(tmp_path, SHEAR + "pcdc model creep on dt 1e3\npcdc model solve elastic time 1e4\n")
    rock("pcdc element reset kelvin-strain range id 0 3\n")
    found = rock["pcdc"].values("element", "kelvin-strain-xx")
    assert not found[:4].any() and found[4:].all()
    words = {
        "young": 2e10, "poisson_ratio": 0.2, "bulk": 15e9, "kelvin_shear": 4e9, "kelvin_viscosity": 2e14,
        "maxwell_shear": 9e9, "maxwell_viscosity": 2e16, "damp_factor": 0.1, "density": 2100.0, "friction": 20.0,
        "kelvin_strain_xx": 1e-5, "kelvin_strain_yy": -3e-5, "kelvin_strain_xy": 2e-5,
    }  # fmt: skip
    for name, value in words.items():
        rock(f"pcdc element property {name.replace('_', '-')} {value!r}\n")
        row = rock.blocks.element_rows.values(int(rock.blocks.element_row[0]))
        assert row[name] == pytest.approx(value), name
        if name.startswith("kelvin_strain"):
            assert rock["pcdc"].values("element", name.replace("_", "-")) == pytest.approx(value)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("model solve time 1", "time does not pass in static runs: use ratio or cycles; or model creep on"),
        ("model creep on change 0.1", "change needs dt"),
        ("model creep on dt 1 least 0.1", "least needs change"),
        ("model creep off dt 1", "off does not accept dt"),
        ("model creep", "on"),
        ("model creep on dt 0", "dt"),
        ("model creep on dt nan", "dt"),
        ("model creep on dt 1 change 2", "change"),
        ("model creep on dt 1 change 0.1 greatest 0.5", "must lie between least"),
        ("model solve elastic time 1 cycles 2", "elastic accepts time or cycles"),
        (
            "element c-model mech-bur property den 1 young 1e9",
            "needs young and poisson-ratio or bulk and maxwell-shear",
        ),
        ("element c-model mech-bur property den 1 bulk 1e9 m-s -1", "m"),
        ("element c-model mech-bur property den 1 bulk 1e9 m-s 1e9 k-v -1", "k"),
        ("element c-model mech-bur property den 1 bulk 1e9 m-s 1e59", "Poisson's ratio -1"),
        ("element reset kelvin-strain range id 99", "99"),
    ],
)
def test_refused_with_its_line(tmp_path, line, told):
    with pytest.raises(ScriptError) as caught:
        Rock(tmp_path, SHEAR + f"pcdc {line}\n")
    assert str(caught.value).startswith("script.sc:13: ") and told in str(caught.value)


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ("pcdc model creep on\npcdc model solve time 1", "need the length of a creep step: model creep on dt"),
        ("pcdc model creep on dt 1\npcdc model solve time 1 cycles 5", "time and cycles cannot be combined"),
        ("pcdc model option dynamic on\npcdc model solve elastic time 1", "use model option dynamic off first"),
        ("pcdc node boundary mech-vel-b-c velocity-x 1 range id 0\npcdc model creep on dt 1\npcdc model solve time 1",
         "node 0 has a prescribed motion in x"),
        ("pcdc element c-model mech-iso-e property den 1 young 1 p-r 0\npcdc model creep on dt 1\n"
         "pcdc model solve time 1", "no element can creep"),
        ("pcdc element c-model mech-iso-e property den 1 young 1 p-r 0\npcdc element reset kelvin-strain",
         "there is no Kelvin strain"),
    ],
)  # fmt: skip
def test_what_cannot_creep_is_refused(tmp_path, lines, told):
    last = 12 + len(lines.splitlines())
    with pytest.raises(ScriptError) as caught:
        Rock(tmp_path, SHEAR + lines + "\n")
    assert str(caught.value).startswith(f"script.sc:{last}: ") and told in str(caught.value)


def test_coupled_blocks_do_not_creep(tmp_path):
    rock = Rock(tmp_path, SHEAR + "pcdc model creep on dt 1\n")
    particles = SimpleNamespace(outdir=tmp_path / "particles", settings=SimpleNamespace(units=""))
    with pytest.raises(CommandError, match="coupled blocks cannot creep: use model creep off"):
        coupling.couple(rock.project, particles)
    rock("pcdc model creep off\n")
    rock.project.coupled = particles
    with pytest.raises(ScriptError, match="model creep would step these blocks without the particles"):
        rock("pcdc model creep on dt 1\n")


def test_creep_of_nothing_is_reported(tmp_path):
    for model in ("mech-iso-e property den 2500 young 1e10 p-r 0.2", ""):
        rock = Rock(tmp_path / (model or "burgers")[:4], SHEAR)
        rock(f"pcdc element c-model {model}\n" if model else "")
        rock("pcdc model creep on dt 1\npcdc model step 1\n")
        assert any("creep is on, but no element can creep" in line for line in rock.blocks.log.lines) == bool(model)


def test_long_creep_steps_are_reported(tmp_path):
    for dt in (3e4, 5e4):
        rock = Rock(
            tmp_path / str(dt), SHEAR + f"pcdc model creep on dt {dt!r}\npcdc model solve elastic time {dt!r}\n"
        )
        assert any("is above 2 eta_K / G_K = 40000 s" in line for line in rock.blocks.log.lines) == (dt > 4e4)

"""Clocks, time steps, tables and conditions in the words of PCDC's online help: what they mean, on ranks and after a
restart."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError
from tests.conftest import ROOT
from tests.pcdc.test_time import Rock, resumed

BLOCK = """\
pcdc model new
pcdc mesh structured (0,0) (3,2) cells 3 2 type quad
pcdc e c-m mech-iso-e prop den 2400 y 3e9 p-r 0.2
pcdc n bou apply mech-vel-b-c v-y 0 range y 0
"""
RAMP = "pcdc table 'ramp' data 0 0, 4e-4 9e5 type relative-time\n"
STEPS = "pcdc table 'dt' data 0 1e-5, 2e-3 4e-5, 4e-3 5e-6\npcdc model time-step table 'dt'\n"
EVERYTHING = (
    BLOCK + RAMP + STEPS + "pcdc model solve-check 7\npcdc model run-time 2.5e-3\n"
    "pcdc e-f apply m-s-b-c s-n -1e5 range y 2\npcdc model step 150\n"
    "pcdc e-f apply m-s-b-c s-n table 'ramp' range x 3\npcdc model solve\n"
    "pcdc node apply mech-f-b-c f-x table 'ramp' range x 0\npcdc model solve time 9e-4 cycle 1000 ratio 1e-30\n"
)


def motion(rock) -> list[bytes]:
    found = [rock.blocks.clock.step, rock.blocks.clock.time]
    return [repr(found).encode(), rock.blocks.x.tobytes(), rock.blocks.v.tobytes()]


def test_a_relative_table_begins_when_a_condition_takes_it(tmp_path):
    """As an absolute one that is moved by the time that has passed."""
    one = Rock(tmp_path / "a", BLOCK + RAMP + "pcdc model gravity 0,-9.8\npcdc model time-step 1e-5\n"
               "pcdc model step 30\npcdc e-f apply m-s-b-c s-n table 'ramp' range x 3\n"
               "pcdc model step 40\n")  # fmt: skip
    now = 30 * 1e-5
    begun = one.blocks.tables[f"ramp from {_after(30)!r}"]
    other = Rock(
        tmp_path / "b", BLOCK + f"pcdc table create 'moved' values ({_after(30)!r},0) ({4e-4 + _after(30)!r},9e5)\n"
        "pcdc model gravity 0,-9.8\npcdc model time-step 1e-5\npcdc model step 30\n"
        "pcdc e-f apply m-s-b-c s-n table 'moved' range x 3\npcdc model step 40\n")  # fmt: skip
    assert begun.times[0] == pytest.approx(now) and motion(one) == motion(other)
    # again later, from that moment on; absolute-time takes it back
    one("pcdc e-f apply m-s-b-c s-n table 'ramp' range y 2\npcdc table 'ramp' type absolute-time\n"
        "pcdc node apply mech-f-b-c f-x table 'ramp' range x 0\n")  # fmt: skip
    assert "ramp from " + repr(_after(70)) in one.blocks.tables and "ramp" in one.blocks.tables_over_time()


def _after(steps: int) -> float:
    """The clock after so many steps of 1e-5 s."""
    time = 0.0
    for _ in range(steps):
        time += 1e-5
    return time


@pytest.mark.parametrize("step", [90, 200, 333])
def test_a_run_that_continues_has_the_same_bits(tmp_path, monkeypatch, step):
    straight = Rock(tmp_path / "a", EVERYTHING)
    again = resumed(tmp_path / "b", EVERYTHING, step, monkeypatch)
    assert motion(again) == motion(straight) and again.project.solved["steps"] == straight.project.solved["steps"]
    assert again.project.relative == {"ramp"} and again.project.step_table == "dt"


def test_settings_stay_in_a_saved_model(tmp_path):
    rock = Rock(tmp_path, EVERYTHING + "pcdc model save 'here'\npcdc model new\npcdc model restore 'here'\n")
    project = rock.project
    assert (tmp_path / "here.sav").is_file()
    assert (project.run_time, project.check_every, project.step_table, project.relative) == (2.5e-3, 7, "dt", {"ramp"})
    rock("pcdc model new\n")
    assert (project.run_time, project.check_every, project.step_table, project.relative) == (0.0, 0, "", set())


@pytest.mark.slow
@pytest.mark.mpi
def test_the_same_bits_on_two_ranks(launch, tmp_path):
    text = EVERYTHING + "print('bits', pcdc.values('node', 'velocity-x').tobytes().hex(), pcdc.time.hex())\n"
    told = []
    for n in (1, 2):
        folder = tmp_path / str(n)
        folder.mkdir()
        (folder / "script.sc").write_text(text)
        done = launch.python(n, "-m", "hpcdem", "script.sc", cwd=folder, timeout=300, env={"PYTHONPATH": str(ROOT)})
        assert done.returncode == 0, done.stderr
        told.append([line for line in done.stdout.splitlines() if line.startswith("bits")])
    assert told[0] == told[1] and len(told[0]) == 1


def test_the_time_step_follows_its_table(tmp_path):
    rock = Rock(tmp_path, BLOCK + STEPS)
    seen = []
    for _ in range(4):
        rock("pcdc model step 100\n")
        seen.append(rock.blocks.clock.dt)
        assert seen[-1] == rock.blocks.tables["dt"](rock.blocks.clock.time)
    assert seen[0] == pytest.approx(1e-5 + 1e-3 * 3e-5 / 2e-3) and seen[0] > seen[1] > seen[2] == seen[3] == 5e-6
    with pytest.raises(HpcdemError, match="the time step uses table 'dt': release it with model time-step value 0"):
        rock("pcdc table delete 'dt'\n")
    rock("pcdc model time-step 2e-5\npcdc table delete 'dt'\npcdc model step 1\n")
    assert rock.blocks.clock.dt == 2e-5
    for words, why in (
        ("table 'none'", "there is no table 'none'"), ("table 'bad'", "table 'bad' has a value that is not above 0"),
        ("update-frequency 5", "update-frequency needs auto on"), ("1e-5 auto", "value and auto on cannot be combined"),
    ):  # fmt: skip
        with pytest.raises(HpcdemError, match=why):
            rock(f"pcdc table 'bad' data 0 1e-5 1 0\npcdc model time-step {words}\n")


def test_an_automatic_time_step_is_estimated_as_often_as_said(tmp_path):
    rock = Rock(tmp_path, BLOCK + "pcdc model time-step auto update-frequency 4\npcdc model step 1\n")
    seen = []
    for _ in range(10):
        rock("pcdc model step 1\n")
        seen.append(rock.blocks.rebuild_state.estimated)
    assert np.diff(sorted(set(seen))).tolist() == [4, 4]


def test_run_time_and_whatever_comes_first(tmp_path):
    rock = Rock(tmp_path, BLOCK + "pcdc model gravity 0,-9.8\npcdc model time-step 1e-5\npcdc model run-time 5e-4\n")
    rock("pcdc model solve\n")
    assert rock.blocks.clock.step == 50 and rock.project.solved["reason"] == "time"
    rock("pcdc model solve cycle 20\n")
    assert rock.blocks.clock.step == 70 and rock.project.solved["reason"] == "cycles"
    rock("pcdc model solve time 1e-4 cycle 20\n")
    assert rock.blocks.clock.step == 80 and rock.project.solved["reason"] == "time"
    rock("pcdc model solve-check 5\npcdc model solve ratio 1e9\n")
    assert rock.blocks.clock.step == 85 and rock.project.solved["reason"] == "ratio"
    # from a start on: what is left of it
    rock("pcdc model reset mechanical start-time 0\npcdc model run-time 1e-3\npcdc model solve\n")
    assert rock.blocks.clock.time == pytest.approx(1e-3) and rock.project.solved["steps"] == 15
    rock("pcdc model solve\n")
    assert rock.blocks.clock.step == 100 and rock.project.solved["steps"] == 0
    assert "run-time 0.001 s, counted from 0 s, has passed: no step is executed" in rock.blocks.log.lines[-1]
    rock("pcdc model solve run-time 1.2e-3\npcdc model run-time 0\npcdc model solve cycle 3\n")
    assert rock.blocks.clock.step == 123
    rock("pcdc model run-time 1\npcdc model dynamic off\npcdc model solve cycle 2\n")
    assert rock.blocks.clock.step == 125 and any("cannot end a static run" in line for line in rock.blocks.log.lines)
    for words, why in (("run-time 1", "run-time: in static runs"), ("elastic run-time 1", "needs a run by steps")):
        with pytest.raises(HpcdemError, match=why):
            rock(f"pcdc model solve {words}\n")


def test_run_time_by_the_clock_of_another_part(tmp_path):
    rock = Rock(
        tmp_path, "pcdc mesh structured (0,0) (2,2) cells 2 2\npcdc e c-m mech-iso-e prop den 2400 y 3e9 p-r 0.2\n"
        "pcdc e c-m therm-iso-h prop con 3 cap 800\npcdc model mech off\npcdc model step 5\npcdc model run-time 100\n"
        "pcdc model reset thermal current-time 40 start-time 0\n")  # fmt: skip
    heat = next(one for one in rock.blocks.surface_loads if one.name == "heat")
    dt = rock.blocks.clock.dt
    rock("pcdc model solve\n")
    assert rock.project.solved["reason"] == "time" and abs(heat.time - 100.0) <= max(0.5 * dt, heat.dt)
    with pytest.raises(HpcdemError, match="thermal has its own time step"):
        rock("pcdc model reset thermal time-step 2 current-time 0\npcdc model solve\n")


def test_clocks_are_set_and_told(tmp_path):
    rock = Rock(
        tmp_path,
        "pcdc mesh structured (0,0) (2,2) cells 2 2\npcdc e c-m mech-iso-e prop den 2400 y 3e9 p-r 0.2\n"
        "pcdc f-j c-m hydr-p-m prop f-den 1000 f-b 2e8 vis 1e-6 a-i 1e-3 a-min 1e-4 a-max 1e-2\n"
        "pcdc e c-m therm-iso-h prop con 3 cap 800\npcdc model mech off\npcdc node hydr-init f-n-s 1\n"
        "pcdc table 'p' data 0 0 10 1e6\npcdc node apply hydra-c-f-b p table 'p' range x 0\n"
        "pcdc well create 'w' range x 2\npcdc well stage 'w' shut-in time 3\npcdc model step 5\n",
    )  # fmt: skip
    flow, heat = (next(one for one in rock.blocks.surface_loads if one.name == name) for name in ("fluid", "heat"))
    passed = flow.time
    rock(
        "pcdc model reset hydraulic current-time 7\npcdc model reset thermal current-time 2 time-step 4\n"
        "pcdc model reset mechanical current-time 0.25\npcdc model query hydraulic time thermal time mechanical time\n"
    )
    assert (flow.time, heat.time, rock.blocks.clock.time) == (7.0, 2.0, 0.25)
    assert rock.blocks.options.heat_dt == 4.0
    told = "\n".join(rock.blocks.log.lines)
    assert "hydraulic time 7 s, time step" in told and "thermal time 2 s" in told and "mechanical time 0.25 s" in told
    # the stage that has begun ends after what was left of it
    assert flow.wells[0].stages[0].end == pytest.approx(3.0 + 7.0 - passed)
    rock("pcdc model step 1\n")
    assert flow.conditions_at(7.0)[1][1] == pytest.approx(7e5)
    for words, why in (
        ("reset proppant-transport current-time 0", "no proppant yet"),
        ("reset mechanical", "mechanical.* needs at least one of start-time, current-time, time-step"),
        ("cycle-option thermal", "thermal.* needs at least one of time-step, cycle-number"),
        ("cycle-option hydraulic c-n 3 proppant-transport c-n 4", "proppant uses the steps of the fluid"),
    ):  # fmt: skip
        with pytest.raises(HpcdemError, match=why):
            rock(f"pcdc model {words}\n")
    with pytest.raises(HpcdemError, match="no heat yet"):
        Rock(tmp_path / "b", BLOCK + "pcdc model query thermal time\n")


def test_conditions_are_taken_back_one_by_one(tmp_path):
    rock = Rock(
        tmp_path, BLOCK + "pcdc node apply mech-f-b-c f-x 5e3 range y 0\n"
        "pcdc node apply mech-m-b-c type 2 (1,0) range y 2\n"
        "pcdc node apply mech-f-b-c f-y 2e3 range y 2\n")  # fmt: skip

    def prescribed() -> set[str]:
        rows = [rock.blocks.conditions[row] for row in np.unique(rock.blocks.corner_row)]
        said = {"motion": any(one.does_y for one in rows), "force": any(one.force_x or one.force_y for one in rows),
                "constraint": any(one.constraint for one in rows)}  # fmt: skip
        return {name for name, is_so in said.items() if is_so}

    assert prescribed() == {"motion", "force", "constraint"}
    rock("pcdc node boundary remove mech-f-b-c\n")
    assert prescribed() == {"motion", "constraint"}
    rock("pcdc node bou r mech-m-c range y 2\n")
    assert prescribed() == {"motion"}
    rock("pcdc node apply mech-f-b-c f-x 5e3\npcdc node boundary remove mech-vel-b-c\n")
    assert prescribed() == {"force"}
    rock("pcdc node boundary remove\n")
    assert prescribed() == set()


def test_a_level_of_water_by_a_point(tmp_path):
    script = (
        "pcdc mesh structured (0,0) (2,2) cells 2 2\npcdc e c-m mech-iso-e prop den 2400 y 3e9 p-r 0.2\n"
        "pcdc f-j c-m hydr-p-m prop f-den 1000 f-b 2e8 vis 1e-6 a-i 1e-3 a-min 1e-4 a-max 1e-2\npcdc model mech off\n"
    )
    found = []
    for words in ("flow-surface (0.3,1.4)", "flow-surface 1.4", "f-s 0.3,1.4"):
        rock = Rock(tmp_path / str(len(found)), script + "pcdc model g 0,-9.8\n"
                    f"pcdc node apply hydra-c-f-b {words} range x 0\npcdc model step 3\n")  # fmt: skip
        flow = next(one for one in rock.blocks.surface_loads if one.name == "fluid")
        found.append(flow.state.tobytes())
    assert found[0] == found[1] == found[2]
    with pytest.raises(HpcdemError, match="flow-surface by a point needs gravity"):
        Rock(tmp_path / "c", script + "pcdc node apply hydra-c-f-b flow-surface (0,1) range x 0\n")


def test_what_has_no_effect_is_reported_once(tmp_path):
    rock = Rock(tmp_path, BLOCK + "pcdc model collision-detect sap\npcdc device switch-to 'GPU'\nfor k in range(3):\n"
                "    pcdc view 'stress' target element name 'stress-yy'\npcdc model render-interval 5\n")  # fmt: skip
    told = [line for line in rock.blocks.log.lines if "no effect" in line]
    assert [line.split(" has no")[0] for line in dict.fromkeys(told)] == [
        f"warning: {name}" for name in ("model collision-detect", "device switch-to", "view", "model render-interval")
    ]  # fmt: skip


def test_code_is_refused_with_what_to_do(bench):
    for line, why in (
        ("boundary-model create s-b-c name 'a' code 'x'", "C# code is not supported.*Python function"),
        ("b-m create stress-b-c n 'a' v k 'b' t 'c'", "function 'file.py:name'"),
        ("model collision ecda off", "faces of an intact joint are not contacts"),
    ):
        with pytest.raises(HpcdemError, match=why):
            bench(f"pcdc {line}\n")


def test_plane_stress(tmp_path):
    """The sag of a block under 1 MPa, in plane strain and as a plate; that by other moduli in plane strain too."""
    young, nu, found = 2e9, 0.25, []
    for word, e, n in (
        ("strain", young, nu), ("stress", young, nu),
        ("strain", young * (1 + 2 * nu) / (1 + nu) ** 2, nu / (1 + nu)),
    ):  # fmt: skip
        rock = Rock(
            tmp_path / str(len(found)),
            f"pcdc model new\npcdc model plane-{word}\n"
            "pcdc element create brick p0 (0,0) p1 (2,0) p2 (0,1) n 8 4 tri false\n"
            f"pcdc element c-model mech-iso-e prop den 2500 y {e!r} p-r {n!r}\n"
            "pcdc node boundary apply mech-vel-b-c v-y 0 range y 0\n"
            "pcdc node boundary apply mech-vel-b-c v-x 0 range x 0\n"
            "pcdc element-face boundary apply m-s-b-c s-n -1e6 range y 1\npcdc model option dynamic off\n"
            "pcdc model solve cycle 20000 ratio 1e-8\n"
            "sag = pcdc.values('node', 'displacement-y', y=(1, 1))\n")  # fmt: skip
        found.append(-float(np.mean(rock["sag"])))
    assert found == pytest.approx([4.6875e-4, 5e-4, 5e-4], rel=1e-5)
    with pytest.raises(HpcdemError, match="model plane-stress"):
        Rock(tmp_path / "space", "pcdc model new dim 3\npcdc model plane-stress\n")


def test_shear_along_faces_turns_a_body_counter_clockwise(tmp_path):
    """Of a unit square, on all sides and on one."""
    tau = 3e4
    body = "pcdc mesh structured (0,0) (1,1) cells 1 1 type quad\npcdc e c-m mech-iso-e prop den 2400 y 3e9 p-r 0.2\n"
    turned = f"pcdc e-f apply m-s-b-c dip {tau}\npcdc model time-step 1e-7\npcdc model step 1\n"
    rock = Rock(tmp_path / "a", body + turned)
    vx, vy = (rock.blocks.v.reshape(-1)[k:8:2] for k in (0, 1))
    x, y = (rock.blocks.x.reshape(-1)[k:8:2] - 0.5 for k in (0, 1))
    # each corner has half of both its sides: tau / 2 along each, mass rho / 4
    assert x * vy - y * vx == pytest.approx([0.5 * tau * 1e-7 / (2400 / 4)] * 4, rel=1e-4)
    # above it goes to the left
    one, other = (
        Rock(tmp_path / word, body + f"pcdc n apply mech-vel-b-c v-x 0 v-y 0 range y 0\npcdc model step 5\n"
             f"pcdc {line}\npcdc model step 20\n")
        for word, line in (("b", f"e-f apply m-s-b-c dip {tau} range y 1"),
                           ("c", f"n apply mech-f-b-c f-x {-tau / 2} range y 1"))
    )  # fmt: skip
    assert one.blocks.v == pytest.approx(other.blocks.v, rel=1e-5, abs=1e-9)
    with pytest.raises(HpcdemError, match="'dip' is for two dimensions"):
        Rock(tmp_path / "d", "pcdc model new dim 3\npcdc e-f apply m-s-b-c dip 1\n")


def test_surfaces_lose_energy_by_damp_b_of_their_elements(tmp_path):
    """Two blocks that meet: what comes back is less, as with damping-b of a contact model."""
    found = []
    for words, model in (("", ""), ("d-b 4", ""), ("", "pcdc e-f c-m c-m-c prop p-n 3e10 p-s 3e10 d-b 4 f 0\n")):
        rock = Rock(
            tmp_path / str(len(found)),
            "pcdc mesh structured (0,0) (1,1) cells 1 1 type quad group 'a'\n"
            "pcdc mesh structured (0,1.0001) (1,2.0001) cells 1 1 type quad group 'b'\n"
            f"pcdc e c-m mech-iso-e prop den 2400 y 3e9 p-r 0.2 pen 3e10 {words}\n{model}"
            "pcdc n apply mech-vel-b-c v-x 0 v-y 0 range face-of 'a'\npcdc n init vel-y -0.5 range face-of 'b'\n"
            "pcdc model solve time 4e-3\nback = float(pcdc.values('node', 'velocity-y', y=(1.5, 3)).mean())\n",
        )  # fmt: skip
        found.append(rock["back"])
    assert found[0] > found[1] == pytest.approx(found[2], rel=1e-6)

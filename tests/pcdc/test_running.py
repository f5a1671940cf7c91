"""model step and solve: when they end, and what is recorded on the way."""

from __future__ import annotations

import csv

import pytest

from hpcdem.core.errors import HpcdemError, PhysicsError, StoppedWithCheckpoint
from hpcdem.runtime.stop_requests import STOP, StopRequests

BOX = "pcdc mesh structured (0,0) (4,2) cells 4 2 diagonal right\n"


def rows(bench, name: str) -> list[list[str]]:
    with open(bench.project.directory / name, encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def test_steps(bench):
    bench(BOX + "pcdc model step 250\npcdc model step 0\n")
    assert bench.blocks.clock.step == 250 and sum(args[0] for args, _ in bench.blocks.told("advance")) == 250


@pytest.mark.parametrize(
    ("words", "dynamic", "steps"),
    [
        # The ratio of the fake falls as 1 / step and is looked at every 100 steps, every 50 in static runs.
        ("ratio 0.004", True, 300),
        ("ratio 0.004", False, 250),
        ("ratio 0.004 cycles 120", True, 120),
        ("cycles 7", True, 7),
        ("time 0.5", True, 50),
        ("time 0.507", True, 51),
        ("time 0.502", True, 50),
        ("time 5 ratio 0.01", True, 100),
        ("time 0.3 cycles 1000 ratio 1e-9", True, 30),
    ],
)
def test_solve_ends_with_what_comes_first(bench, words, dynamic, steps):
    bench(BOX + f"pcdc model option dynamic [{dynamic}]\npcdc model solve {words}\n")
    assert bench.blocks.clock.step == steps


def test_time_does_not_pass_in_static_runs(bench):
    with pytest.raises(HpcdemError, match=r"script.sc:3: .*time does not pass in static runs"):
        bench(BOX + "pcdc model option dynamic off\npcdc model solve time 1\n")


def test_equilibrium_at_once(bench):
    bench(BOX + "pcdc model option dynamic off\npcdc history create 't' model value cycle every 5\n"
          "pcdc model solve elastic\npcdc mod sol ela cyc 4 rat 1e-6 solver petsc\n")  # fmt: skip
    assert [how for _, how in bench.blocks.told("solve_elastic")] == [
        {"cycles": 1, "solver": "auto"}, {"cycles": 4, "ratio": 1e-6, "solver": "petsc"}
    ]  # fmt: skip
    bench("pcdc model solve elastic steps 7\n")
    assert bench.blocks.told("solve_elastic")[-1][1] == {"cycles": 1, "solver": "auto", "steps": 7}
    assert bench.blocks.clock.step == 6 and not bench.blocks.told("advance")
    assert [row[0] for row in bench.project.histories["t"].rows] == [5]
    told = "line 5: solve elastic: unbalanced force ratio 1e-11 after 3 iterations; 42 unknowns, solver direct, "
    assert told in bench.blocks.log.lines[-2]


@pytest.mark.parametrize(
    "words, told",
    [("elastic time 1", "elastic with time is for static runs"),
     ("ratio 1e-3 solver petsc", "solver needs elastic"), ("ratio 1e-3 steps 3", "steps needs elastic"),
     ("elastic steps 0", "steps"),
     ("elastic solver cg", "auto, direct, petsc"), ("elastic cycles 0", "cycles")],
)  # fmt: skip
def test_words_that_do_not_go_with_equilibrium_at_once(bench, words, told):
    with pytest.raises(HpcdemError, match=rf"script.sc:2: .*{told}"):
        bench(BOX + f"pcdc model solve {words}\n")
    assert not bench.blocks.told("solve_elastic")


def test_static_runs_end_at_the_ratio_of_the_manual(bench, monkeypatch):
    monkeypatch.setattr(bench.blocks, "unbalanced_ratio", lambda: 0.4 / bench.blocks.clock.step)
    bench(BOX + "pcdc model option dynamic off\npcdc model solve on-failure stop limit 0\n")
    assert bench.blocks.clock.step == 40_000  # 0.4 / 40 000 is 1e-5


def test_a_solve_without_an_aim_ends_after_10_000_cycles(bench, monkeypatch):
    monkeypatch.setattr(bench.blocks, "unbalanced_ratio", lambda: 0.4 / bench.blocks.clock.step)
    bench(BOX + "pcdc model option dynamic off\npcdc model solve\n")
    assert bench.blocks.clock.step == 10_000 and bench.project.solved["reason"] == "cycles"
    assert "without a criterion ended after 10000 cycles at ratio 4e-05" in bench.blocks.log.lines[-1]
    monkeypatch.setattr(bench.blocks, "unbalanced_ratio", lambda: 4e-2 / bench.blocks.clock.step)
    bench("pcdc model solve\n")
    assert bench.blocks.clock.step == 10_050 and bench.project.solved["reason"] == "ratio"


def test_what_is_recorded_does_not_change_when_it_ends(bench):
    bench(BOX + "pcdc history create 'a' model value cycle every 7\npcdc history create 'b' model value time every 33\n"
          "pcdc model step 17\npcdc model solve ratio 0.004\n")  # fmt: skip
    assert bench.blocks.clock.step == 317  # looked at 100, 200, 300 steps after its beginning


def test_histories(bench):
    bench(
        BOX + "pcdc history create 'one' node id 3 value displacement-y every 20\n"
        "pcdc history create 'near' node nearest (3.9,2.2) value position-x every 20\n"
        "pcdc history create 'gauge' element nearest (0.4,0.2) value stress-xx every 40\n"
        "pcdc history create 'load' node value reaction-y sum every 20 range y 2 2\n"
        "pcdc history create 'mean' element value stress-yy mean every 40 range x 0 4\n"
        "pcdc history create 'low' element value stress-yy min every 40 range x 0 4\n"
        "pcdc history create 'high' element value stress-yy max every 40 range x 0 4\n"
        "pcdc history create 'cracks' model value broken-joints every 40\n"
        "pcdc model step 50\npcdc history export 'all.csv'\npcdc history export 'two.csv' names 'load' 'one'\n"
    )
    made = {name: h.rows for name, h in bench.project.histories.items()}
    assert made["one"] == [(20, 0.2, 0.4), (40, 0.4, 0.8)] and made["near"] == [(20, 0.2, 4.2), (40, 0.4, 4.4)]
    assert made["load"] == [(20, 0.2, 10.0), (40, 0.4, 10.0)] and made["cracks"] == [(40, 0.4, 1.0)]
    centres = bench.project.mesh.centroids()
    assert made["gauge"] == [(40, 0.4, 2 / 3)]  # element 0 of (0,0) (1,0) (1,1) holds the point: its centre
    assert made["mean"][0][2] == pytest.approx(1.0) and made["low"][0][2] == centres[:, 1].min() == pytest.approx(1 / 3)
    assert made["high"][0][2] == centres[:, 1].max() == pytest.approx(5 / 3)
    table = rows(bench, "data/all.csv")
    assert table[0][:4] == ["step", "time [s]", "one displacement_y [m]", "near position_x [m]"]
    assert [row[0] for row in table[1:]] == ["20", "40"] and table[1][4] == "" and table[2][4] == repr(2 / 3)
    assert rows(bench, "data/two.csv")[0] == ["step", "time [s]", "load reaction_y [N/m]", "one displacement_y [m]"]
    assert rows(bench, "data/history_load.csv") == [
        ["step", "time [s]", "reaction_y [N/m]"], ["20", "0.2", "10.0"], ["40", "0.4", "10.0"]
    ]  # fmt: skip


def test_files_of_histories_grow_while_the_model_runs(bench, monkeypatch):
    from hpcdem.commands.fdem import histories

    monkeypatch.setattr(histories, "FLUSH", 3)
    seen = []
    usual = bench.blocks.advance

    def advance(steps):
        path = bench.project.outdir / "history_t.csv"
        seen.append(len(path.read_text().splitlines()) if path.exists() else 0)
        return usual(steps)

    monkeypatch.setattr(bench.blocks, "advance", advance)
    bench(BOX + "pcdc history create 't' model value time\npcdc model step 8\n")
    assert seen == [0, 0, 0, 4, 4, 4, 7, 7] and len(rows(bench, "data/history_t.csv")) == 9


def test_a_history_is_stopped_and_its_file_stays(bench):
    bench(
        BOX
        + "pcdc history create 't' model value time\npcdc model step 2\npcdc history delete 't'\npcdc model step 2\n"
    )
    assert len(rows(bench, "data/history_t.csv")) == 3 and not bench.project.histories
    for text in ("pcdc history delete 't'\n", "pcdc history create 'a/b' model value time\n"):
        with pytest.raises(HpcdemError):
            bench(text)
    bench("pcdc history create 't' model value time\n")
    with pytest.raises(HpcdemError, match="history 't' exists already"):
        bench("pcdc history create 't' model value time\n")


def test_an_earlier_name_of_a_history_is_the_present_one(bench):
    """A script of a ready-made model that asks for `way top`; a name that is neither is still refused."""
    bench(BOX + "pcdc history create 'displacement top' node id 12 value displacement-y\npcdc model step 2\n")
    bench("found = pcdc.history('way top')\npcdc history export 'one.csv' names 'way top'\n")
    assert bench["found"][:, 2].tolist() == [row[2] for row in bench.project.histories["displacement top"].rows] != []
    with pytest.raises(HpcdemError, match="there is no history 'way low'"):
        bench("pcdc.history('way low')\n")
    bench("pcdc history delete 'way top'\n")
    assert not bench.project.histories


def test_charts(bench):
    bench(
        BOX + "pcdc history create 'load' node value reaction-y sum every 10 range y 2 2\n"
        "pcdc history create 'way' node id 12 value displacement-y every 20\npcdc model step 60\n"
        "pcdc chart create 'c' title 'Test' y-label 'load, total [[kN]]'\n"
        "pcdc chart add 'c' x 'way' scale-x 1000 y 'load' scale-y 1e-3 label 'model'\n"
        "pcdc chart add 'c' values (0,0) (1200,0.02) label 'exact' style points\n"
        "pcdc chart export 'c' 'c.png'\npcdc chart export 'c' 'c2.pdf'\npcdc chart export 'c' 'c3.svg'\n"
    )
    table = rows(bench, "data/c.csv")
    assert table[0] == ["curve", "x", "load, total [kN]"]
    assert [row[0] for row in table[1:]] == ["model"] * 3 + ["exact"] * 2
    assert [[float(v) for v in row[1:]] for row in table[1:4]] == [
        [400, 0.01],
        [800, 0.01],
        [pytest.approx(1200), 0.01],
    ]
    begins = {"c.png": b"\x89PNG", "c2.pdf": b"%PDF", "c3.svg": b"<?xml"}
    for name, first in begins.items():
        assert (bench.project.outdir / name).read_bytes().startswith(first)
    for text in ("pcdc chart export 'c' 'c.gif'\n", "pcdc chart add 'c' y 'none'\n", "pcdc chart add 'd' y 'load'\n"):
        with pytest.raises(HpcdemError):
            bench(text)
    bench("pcdc chart create 'c'\n")
    with pytest.raises(HpcdemError, match="has no points yet"):
        bench("pcdc chart export 'c' 'c.png'\n")


def test_physics_that_breaks_down_leaves_the_histories(bench, monkeypatch):
    usual = bench.blocks.advance

    def advance(steps):
        if bench.blocks.clock.step >= 30:
            raise PhysicsError("step 30: element 7 is turned inside out")
        return usual(steps)

    monkeypatch.setattr(bench.blocks, "advance", advance)
    with pytest.raises(PhysicsError, match="element 7"):
        bench(BOX + "pcdc history create 't' model value time every 10\npcdc model step 100\n")
    assert len(rows(bench, "data/history_t.csv")) == 4


class Asked(StopRequests):
    """Requests of the outside: a stop."""

    def __init__(self) -> None:
        super().__init__()
        self.reason = "SIGTERM"

    def overdue_request(self) -> int:
        return 0

    def decide(self, code: int) -> str:
        return "stop" if code == STOP else "none"


def test_a_stop_leaves_a_checkpoint_with_the_names_of_the_script(bench, monkeypatch):
    usual = bench.blocks.advance
    monkeypatch.setattr(bench.blocks, "stop", Asked())
    monkeypatch.setattr(bench.blocks, "advance", lambda steps: usual(1) or STOP * (bench.blocks.clock.step == 13))
    with pytest.raises(
        StoppedWithCheckpoint, match=r"stopped at step 13 by SIGTERM; checkpoint .*0000000013\.sav written"
    ):
        bench("m_a = 4\n" + BOX + "pcdc history create 't' model value time\npcdc model step 100\n")
    assert len(rows(bench, "data/history_t.csv")) == 14
    assert bench.project.progress is None
    from tests.pcdc.fake import Bench

    again = Bench(bench.project.directory)("pcdc model restore 'data/0000000013.sav'\n")
    assert again["m_a"] == 4 and again.project.step == 13


def test_the_log_says_what_is_done(bench):
    bench(BOX + "pcdc model solve cycles 20\n")
    assert "line 2: solve cycles 20" in bench.blocks.log.lines
    assert bench.blocks.log.lines[-1].startswith(
        "step 20 | time 200 ms, time step 10 ms | unbalanced force ratio 0.05 | joints: 2 yielded, 1 broken"
    )


def test_names_that_cannot_be_saved_do_not_end_a_run(bench, monkeypatch):
    usual = bench.blocks.advance
    monkeypatch.setattr(bench.blocks, "stop", Asked())
    monkeypatch.setattr(bench.blocks, "advance", lambda steps: usual(1) or STOP * (bench.blocks.clock.step == 3))
    with pytest.raises(StoppedWithCheckpoint):
        bench("m_f = lambda x: x\n" + BOX + "pcdc model step 5\n")
    assert any("m_f cannot be saved" in line and "no m_ names" in line for line in bench.blocks.log.lines)


def test_a_line_in_a_loop_is_reported_once_in_a_while(bench):
    bench(BOX + "for i in range(50):\n    pcdc model step 2\npcdc model step 3\n")
    lines = bench.blocks.log.lines
    assert sum(line.startswith("line 3: step 2") for line in lines) == 1 and "line 4: step 3" in lines
    assert sum(line.startswith("step ") for line in lines) == 2


def test_where_a_run_ends_does_not_depend_on_where_it_was_interrupted(bench, monkeypatch):
    """The time step doubles after 20 steps: near the end it is looked at after each step."""
    blocks = bench.blocks

    def advance(steps: int) -> int:
        for _ in range(steps):
            blocks.clock.dt = 0.01 if blocks.clock.step < 20 else 0.02
            blocks.clock.step += 1
            blocks.clock.time += blocks.clock.dt
        return 0

    monkeypatch.setattr(blocks, "advance", advance)
    bench(BOX + "pcdc model time-step auto on\npcdc model solve time 0.4\n")
    assert blocks.clock.step == 30 and blocks.clock.time == pytest.approx(0.4)


def test_the_energy_budget_is_asked_for_before_it_is_recorded(bench):
    bench.blocks.budget = None
    with pytest.raises(HpcdemError, match=r"script.sc:2: .*no energy budget yet: use model option energy on"):
        bench(BOX + "pcdc history create 'e' model value kinetic-energy\n")
    bench(BOX + "pcdc model option energy on\n")
    assert bench.blocks.told("account_energy") == [((True,), {})]
    bench.blocks.budget = object()
    bench.blocks.energies = lambda: {"kinetic": 2.5}
    bench("pcdc history create 'e' model value kinetic-energy every 2\npcdc model step 4\n")
    assert [row[2] for row in bench.project.histories["e"].rows] == [2.5, 2.5]
    with pytest.raises(HpcdemError, match="history 'e' follows the energy budget"):
        bench("pcdc model option energy off\n")

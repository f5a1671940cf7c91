"""The log: what is printed, when, and what the numbers are."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from pathlib import Path

import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.timers import Timers
from hpcdem.runtime.progress import Log, StepStatus, duration, folded, rate


class Clock:
    """A clock that stands still until it is told."""

    def __init__(self) -> None:
        self.t = 1000.0

    def __call__(self) -> float:
        return self.t


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def status(step: int, **other) -> StepStatus:
    values = {"time": 0.05 * step, "dt": 0.05, "dt_critical": 0.1, "kinetic": 1.5e6, "unbalanced_ratio": 0.01}
    counts = {"particles": 1000, "contacts": 2500, "bonds": 1200}
    return StepStatus(step=step, **{**values, **counts, **other})


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def out() -> io.StringIO:
    return io.StringIO()


@pytest.fixture
def log(out, clock) -> Log:
    return Log(stream=out, now=clock)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.2, "0 s"),
        (59.4, "59 s"),
        (60, "1:00"),
        (3723, "1:02:03"),
        (float("inf"), "--"),
        (-1, "--"),
        (float("nan"), "--"),
    ],
)
def test_durations(seconds, text):
    assert duration(seconds) == text


@pytest.mark.parametrize(
    ("number", "text"),
    [(0.25, "0.25"), (812, "812"), (999.9, "1000"), (20431, "20400"), (48.2e6, "48.2 million"), (2.5e9, "2.5 billion")],
)
def test_rates(number, text):
    assert rate(number) == text


def test_a_line_says_where_the_run_is(log, out, clock):
    log.script_started("push", 2000)
    log.command_started("CYC", 12, 1000, step=0)
    clock.t += 20.0
    log.step(status(500, broken_tension=3, broken_shear=4, walls=((0, 1.0, -2.5e9), (1, 0.0, 0.0))))
    head, line = out.getvalue().splitlines()
    assert head == "line 12: CYC, 1000 steps"
    for part in (
        "step 500 | CYC 50.0% | script 25.0%",
        "25 steps/s",
        "left 20 s, script 1:00",
        "time 25 s, time step 50 ms (0.50 of the critical one)",
        "kinetic energy 1.5 MJ, unbalanced force 0.01 of the mean contact force",
        "1000 particles, 2500 contacts, 1200 bonds (3 broken in tension, 4 in shear)",
        "forces on walls: 0 (1 N, -2.5 GN), 1 (0 N, 0 N)",
    ):
        assert part in line


def test_the_rate_is_that_of_the_last_window(log, out, clock):
    log.command_started("CYC", 0, 100000, step=0)
    clock.t += 10.0
    log.step(status(10000))
    clock.t += 10.0
    log.step(status(11000))
    first, second = (line for line in out.getvalue().splitlines() if line.startswith("step"))
    assert "1000 steps/s" in first and "100 steps/s" in second


def test_a_log_file_gets_a_line_each_ten_seconds(log, out, clock):
    log.command_started("CYC", 0, 10**9, step=0)
    for step in range(1, 101):
        clock.t += 1.0
        log.step(status(step))
    assert out.getvalue().count("\nstep") == 10


def test_the_folder_is_reported_how_far_it_is(log, clock, tmp_path):
    """Once a second, from the second second on; of a command that went on from a checkpoint with what was before."""
    log.script_started("a.py", 400)
    log.command_started("CYC", 3, 100, 50, before=20)
    log.place = tmp_path
    log.wants(50)
    clock.t += 0.5
    log.wants(60)
    assert not (tmp_path / "progress.json").exists()
    clock.t += 1.5
    log.wants(90)
    told = json.loads((tmp_path / "progress.json").read_text())
    assert told == {
        "step": 90, "command": "CYC", "line": "line 3: CYC, 120 steps, 100 left", "speed": 20.0, "part": 0.5,
        "left": 3.0, "script_part": 0.1, "script_left": 18.0,
    }  # fmt: skip
    clock.t += 0.5
    log.wants(100)
    assert json.loads((tmp_path / "progress.json").read_text())["step"] == 90
    log.at(100, "solve", 100, float("inf"))
    clock.t += 2.0
    log.at(140, "solve", 100, float("inf"))
    told = json.loads((tmp_path / "progress.json").read_text())
    assert told["part"] is None and told["left"] is None and told["speed"] == 20.0
    log.place = tmp_path / "gone"
    clock.t += 2.0
    log.at(180, "solve", 100, float("inf"))  # and nothing happens


def test_set_stepbar_means_each_interval(log, out, clock):
    log.set_interval(explicit=True)
    log.command_started("CYC", 0, 10**9, step=0)
    for step in range(1, 8):
        clock.t += 0.01
        log.step(status(step))
    assert out.getvalue().count("\nstep") == 7


def test_the_last_step_of_a_command_is_always_there_once(log, out, clock):
    log.command_started("IMPLE", 3, 20, step=100)
    clock.t += 0.5
    log.step(status(120))
    log.step(status(120))
    log.command_finished()
    assert out.getvalue().count("\nstep 120 | IMPLE 100.0%") == 1


def test_without_a_first_step_the_first_status_sets_it(log, out, clock):
    log.command_started("CYC", 3, 20)
    log.step(status(100))
    clock.t += 1.0
    log.step(status(120))
    assert out.getvalue().count("\nstep") == 1 and "20 steps/s" in out.getvalue()


def test_finished_commands_count_for_the_script(log, out, clock):
    log.script_started("push", 400)
    for begin in (0, 100):
        log.command_started("CYC", 1, 100, step=begin)
        clock.t += 10.0
        log.step(status(begin + 100))
        log.command_finished()
    assert "script 50.0%" in out.getvalue().splitlines()[-1]


def test_a_critical_step_that_is_not_known_is_left_out(log, out, clock):
    log.command_started("CYC", 1, 10, step=0)
    clock.t += 1.0
    log.step(status(10, dt_critical=float("inf")))
    assert "critical" not in out.getvalue()


def test_a_warning_comes_once(log, out):
    for _ in range(3):
        log.warn_once("late", "lists came late")
    assert out.getvalue() == "warning: lists came late\n"


def test_other_ranks_are_silent(out, clock):
    log = Log(rank=1, stream=out, now=clock)
    log.info("a")
    log.warn_once("b", "b")
    log.command_started("CYC", 1, 10, step=0)
    clock.t += 100
    log.step(status(10))
    log.command_finished()
    log.stages(Timers(), SerialComm())
    assert out.getvalue() == ""


def test_lines_end_with_newlines_only(log, out, clock):
    """A carriage return would fill the log file of a batch job with one endless line."""
    log.command_started("CYC", 1, 10, step=0)
    clock.t += 10
    log.step(status(10))
    assert "\r" not in out.getvalue() and "\x1b" not in out.getvalue()


def test_the_table_of_stages(log, out):
    timers = Timers()
    for name, seconds, calls in (("halo", 1.0, 40), ("force", 3.0, 40)):
        timers(name).ns, timers(name).calls = int(seconds * 1e9), calls
    timers.count(steps=40, particles=100)
    log.stages(timers, SerialComm())
    head, force, halo, other, total = out.getvalue().splitlines()
    assert head.split()[0] == "stage"
    assert force.split()[:3] == ["force", "3.00", "3.00"] and force.split()[-1] == "40"
    assert halo.split()[0] == "halo" and other.split()[0] == "other"
    assert total.startswith("40 steps in ") and "particle-steps/s" in total


def test_a_terminal_gets_a_bar_with_lines_above(clock):
    terminal = Terminal()
    log = Log(stream=terminal, now=clock)
    log.script_started("push", 200)
    log.command_started("CYC", 7, 100, step=0)
    for step in (25, 50, 100):
        clock.t += 10.0
        log.step(status(step))
    log.warn("something [odd]")
    log.command_finished()
    log.stages(Timers(), SerialComm())
    text = terminal.getvalue()
    assert "script" in text and "━" in text
    assert "warning: something [odd]" in text
    assert text.count("step 50 |") == 1
    assert "stage" in text


def test_a_reader_that_goes_away_does_not_end_the_run():
    """`hpcdem push.py | head`, a terminal that was closed, a full disk under the log file."""
    code = (
        "import sys\nfrom hpcdem.runtime.progress import Log\nlog = Log()\n"
        "sys.stdin.read()\n"
        "for _ in range(3): log.info('a line')\n"
        "print('still here', file=sys.stderr)\n"
    )
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", code], stdin=pipe, stdout=pipe, stderr=pipe, text=True) as process:
        process.stdout.close()
        process.stdin.close()
        err = process.stderr.read()
        assert process.wait(60) == 0
    assert err == "still here\n"


def test_a_disk_that_is_full_for_a_while_leaves_a_gap_that_is_reported(tmp_path):
    """A log that goes to a file: what finds no room is lost, what comes later is there, and the run goes on."""
    code = (
        "import os, sys\nfrom hpcdem.runtime.progress import Log, write\nlog = Log()\n"
        "log.info('before')\n"
        "file, full = os.dup(1), os.open('/dev/full', os.O_WRONLY)\n"
        "os.dup2(full, 1)\nlog.info('lost')\nwrite(sys.stdout, 'lost too\\nand this\\n')\n"
        "os.dup2(file, 1)\nlog.info('after')\nlog.info('later')\n"
    )
    with open(tmp_path / "log", "w") as file:
        done = subprocess.run([sys.executable, "-c", code], stdout=file, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    gap = "warning: 3 lines are missing: no space left on the disk"
    assert (tmp_path / "log").read_text().splitlines() == ["before", gap, "after", "later"]


@pytest.mark.parametrize(
    "stream",
    [*(pytest.param(one, marks=pytest.mark.slow) for one in ("1>/dev/full", "2>/dev/full")), "1>/dev/full 2>&1"],
)
def test_a_full_disk_under_the_log_changes_no_exit_code(tmp_path, stream):
    """Nor do prints of a script end it."""
    for text, code in (("print('one')\nprint('two')\n", 0), ("print('one')\n1 / 0\n", 1)):
        (tmp_path / "a.sc").write_text(f"pcdc model new\n{text}")
        done = subprocess.run(
            ["bash", "-c", f'"$0" -m hpcdem a.sc {stream}', sys.executable], cwd=tmp_path, check=False
        )
        assert done.returncode == code


# -- warnings that come again, the end -------------------------------------------------------------------------------


def test_warnings_that_differ_in_numbers_alone_are_counted(log, out):
    for step in range(1, 151):
        log.warn(f"step {step}: 2 pairs overlap by {0.1 * step:.3g} m")
    log.warn("another one")
    log.close()
    lines = out.getvalue().splitlines()
    assert lines[:3] == [f"warning: step {k}: 2 pairs overlap by {0.1 * k:.3g} m" for k in (1, 2, 3)]
    assert lines[3:] == [
        "warning (10 times so far): step 10: 2 pairs overlap by 1 m",
        "warning (100 times so far): step 100: 2 pairs overlap by 10 m",
        "warning: another one",
        "warning: 150 in total like this one: step #: # pairs overlap by # m",
    ]


def test_where_commands_are_typed_each_warning_is_reported(log, out):
    log.folds = False
    for _ in range(6):
        log.warn("once more")
    log.close()
    assert out.getvalue() == 6 * "warning: once more\n"


def test_the_end_says_what_can_be_done_next(log, out):
    log.results(Path("out of the way"))
    said = out.getvalue()
    assert said.startswith("results: out of the way; `hpcdem view 'out of the way'` shows them")


def test_an_account_is_in_one_unit_with_a_prefix(log, out):
    log.account("energy budget", "energy", "J/m", {"motion": 2.5e6, "lost": -1e3})
    log.account("energy budget", "energy", "J", {"motion": 2.5e6}, "mm-mpa-s")
    first, second = out.getvalue().split("energy budget\n")[1:]
    assert [line.split() for line in first.splitlines()] == [["energy", "MJ/m"], ["motion", "2.5"], ["lost", "-0.001"]]
    assert [line.split() for line in second.splitlines()] == [["energy", "mJ"], ["motion", "2.5e+06"]]


def test_a_model_with_declared_units_keeps_them(log, out, clock):
    log.command_started("CYC", 0, 10, step=0)
    clock.t += 20.0
    log.step(status(10, units="mm-mpa-s", walls=((0, 1.0, -2.5e9),)))
    assert "kinetic energy 1.5e+06 mJ" in out.getvalue() and "0 (1 N, -2.5e+09 N)" in out.getvalue()


def test_lines_are_broken_between_words_on_a_terminal_alone(log, out, monkeypatch):
    text = "step 500 | " + "some words " * 12 + "/a/path/" + 60 * "x"
    log.info(text)
    assert out.getvalue() == f"{text}\n"
    lines = folded(f"{text}\nshort\n\n  table  kept", 50).split("\n")
    assert all(len(line) < 50 for line in lines if "xxx" not in line) and lines[-3:] == ["short", "", "  table  kept"]
    assert " ".join(" ".join(lines[:-3]).split()) == " ".join(text.split())

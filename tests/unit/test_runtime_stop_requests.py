"""Requests to save or stop: what a signal, a limit and the ranks together decide."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import UsageError
from hpcdem.runtime.stop_requests import NONE, SAVE, STOP, StopRequests, parse_limit, slurm_end_time


@pytest.fixture
def stop() -> Iterator[StopRequests]:
    """Requests that have the signals of this process."""
    # The watchdog of a session that an earlier test left in this process would end it after the second Ctrl-C.
    others = signal.set_wakeup_fd(-1)
    requests = StopRequests().install()
    yield requests
    requests.uninstall()
    signal.set_wakeup_fd(others)


def send(name: str) -> None:
    os.kill(os.getpid(), getattr(signal, name))


# -- signals -----------------------------------------------------------------------------------------------------


def test_nothing_is_asked_for_at_first(stop):
    assert stop.local_request() == NONE
    assert stop.poll(SerialComm()) == "none"


def test_sigusr2_saves_once_and_continues(stop):
    send("SIGUSR2")
    assert stop.local_request() == SAVE
    assert stop.poll(SerialComm()) == "save"
    assert stop.poll(SerialComm()) == "none"


@pytest.mark.parametrize("name", ["SIGTERM", "SIGUSR1", "SIGINT"])
def test_the_others_stop_and_stay_stopped(stop, name):
    send(name)
    assert stop.local_request() == STOP
    assert [stop.poll(SerialComm()) for _ in range(2)] == ["stop", "stop"]
    assert stop.reason == {"SIGINT": "Ctrl-C"}.get(name, name)


def test_stop_wins_over_save(stop):
    send("SIGUSR2")
    send("SIGTERM")
    assert stop.poll(SerialComm()) == "stop"


def test_the_second_ctrl_c_interrupts_at_once(stop):
    send("SIGINT")
    with pytest.raises(KeyboardInterrupt):
        send("SIGINT")
        time.sleep(1)


def test_a_signal_to_all_ranks_makes_one_checkpoint(stop):
    """A rank that got the signal just after another rank's request had been answered."""
    assert stop.decide(SAVE) == "save"
    send("SIGUSR2")
    assert stop.local_request() == NONE


def test_a_request_of_another_rank_counts(stop):
    assert stop.local_request() == NONE
    assert stop.decide(STOP) == "stop"
    assert "another rank" in stop.reason


def test_signals_are_restored():
    before = signal.getsignal(signal.SIGTERM)
    StopRequests().install().uninstall()
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.mpi
def test_a_signal_to_one_rank_is_seen_by_all_on_the_same_poll(launch, tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "import os, signal, sys\n"
        "from hpcdem.runtime import launch, shutdown, stop_requests\n"
        "comm = launch.start_mpi()\n"
        "stop = stop_requests.StopRequests().install()\n"
        "for poll in range(100):\n"
        "    if comm.rank == 1 and poll in (3, 6):\n"
        "        os.kill(os.getpid(), signal.SIGUSR2 if poll == 3 else signal.SIGTERM)\n"
        "    answer = stop.poll(comm)\n"
        "    if answer != 'none':\n"
        "        sys.stdout.write(f'{comm.rank} {poll} {answer} {stop.reason}\\n')\n"
        "    if answer == 'stop':\n"
        "        break\n"
        "shutdown.leave(shutdown.ExitStatus())\n"
    )
    done = launch.python(3, program)
    assert done.returncode == 0, done.stderr
    lines = sorted(done.stdout.splitlines())
    assert [line.split()[:3] for line in lines] == [
        [str(rank), poll, answer] for rank in range(3) for poll, answer in (("3", "save"), ("6", "stop"))
    ]
    assert "SIGTERM" in lines[3] and "another rank" in lines[1]


# -- limits ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("11:30:00", 41400.0), ("05:00", 300.0), ("90", 90.0), ("1-02:00:00", 93600.0), (" 00:00:01 ", 1.0)],
)
def test_times_are_read(text, seconds):
    assert parse_limit(text) == seconds


@pytest.mark.parametrize("text", ["", "soon", "1:2:3:4", "-5", "00:00:00", "nan", "inf", "1:-5"])
def test_other_words_are_refused_by_name(text):
    with pytest.raises(UsageError, match="--time-limit"):
        parse_limit(text)


def test_the_limit_stops_before_its_time():
    stop = StopRequests(time_limit=0.2)
    assert stop.local_request() == NONE
    time.sleep(0.2)
    assert stop.poll(SerialComm()) == "stop"
    assert stop.reason == "the time limit"


def test_the_margin_is_a_share_of_the_limit_until_a_save_was_measured():
    stop = StopRequests(time_limit=100.0)
    assert stop.margin() == pytest.approx(5.0)
    assert StopRequests(time_limit=1e6).margin() == 60.0
    stop.saved(30.0)
    assert stop.margin() == pytest.approx(61.0)
    assert stop.local_request() == NONE
    stop.saved(60.0)  # 121 s would be needed, 100 are left
    assert stop.local_request() == STOP


def test_the_end_of_the_job_is_a_limit_too():
    assert StopRequests(end_time=time.time() + 1000.0).local_request() == NONE
    stop = StopRequests(time_limit=1e6, end_time=time.time() - 1.0)
    assert stop.local_request() == STOP
    assert "Slurm" in stop.reason or (stop.poll(SerialComm()) == "stop" and "Slurm" in stop.reason)


# -- Slurm -------------------------------------------------------------------------------------------------------


def test_the_variable_is_taken_before_squeue_is_asked():
    def never(*args, **kwargs):
        raise AssertionError("squeue was asked")

    assert slurm_end_time({"SLURM_JOB_ID": "7", "SLURM_JOB_END_TIME": "1700000000"}, never) == 1.7e9
    assert slurm_end_time({}, never) is None


def test_squeue_is_asked_for_the_end():
    def ask(command, **kwargs):
        assert command == ["squeue", "-h", "-j", "7", "-o", "%e"]
        return SimpleNamespace(stdout="2024-05-01T12:00:00\n")

    end = slurm_end_time({"SLURM_JOB_ID": "7"}, ask)
    assert time.strftime("%Y-%m-%dT%H:%M:%S", time.localtime(end)) == "2024-05-01T12:00:00"


@pytest.mark.parametrize(
    "answer",
    [
        lambda *a, **k: SimpleNamespace(stdout="N/A\n"),
        lambda *a, **k: (_ for _ in ()).throw(FileNotFoundError("squeue")),
        lambda *a, **k: (_ for _ in ()).throw(subprocess.TimeoutExpired("squeue", 10)),
    ],
)
def test_a_cluster_that_does_not_answer_sets_no_limit(answer):
    assert slurm_end_time({"SLURM_JOB_ID": "7"}, answer) is None

"""A process that hangs in a call that no signal ends, and is told to end all the same."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator

import pytest

from hpcdem.runtime import watchdog
from hpcdem.runtime.shutdown import EXIT_INTERRUPTED, EXIT_TERMINATED, describe
from hpcdem.runtime.stop_requests import StopRequests
from hpcdem.runtime.watchdog import Watchdog
from tests.conftest import PATIENCE, ROOT, until

pytestmark = pytest.mark.alone  # times of a second and less

HANGS = """\
import ctypes, sys
from hpcdem.runtime import watchdog
from hpcdem.runtime.stop_requests import StopRequests
watchdog.SAME_SIGNAL = {same}
stop = StopRequests().install(3)
stop._watchdog._grace = {grace}
stop._watchdog._timeout = {timeout}
libc, mutex = ctypes.CDLL(None), ctypes.create_string_buffer(128)
libc.pthread_mutex_lock(mutex)
print("now", flush=True)
libc.pthread_mutex_lock(mutex)  # for ever; no signal ends it, as it does not end a wait inside MPI
"""


@pytest.fixture
def hanging() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """`hanging(grace=0.3, timeout=60)`: a process that waits for ever, inside C."""
    started = []

    def start(grace: float, timeout: float, same: float = 0.2) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-c", HANGS.format(grace=grace, timeout=timeout, same=same)],
            cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        started.append(process)
        assert process.stdout is not None and process.stdout.readline() == "now\n"
        time.sleep(0.1)
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


@pytest.mark.parametrize(("name", "code"), [("SIGTERM", 143), pytest.param("SIGINT", 130, marks=pytest.mark.slow)])
def test_the_second_signal_ends_a_process_that_hangs(hanging, name, code):
    process = hanging(grace=0.3, timeout=60.0)
    process.send_signal(getattr(signal, name))
    with pytest.raises(subprocess.TimeoutExpired):  # the first one alone does not
        process.wait(1.0)
    while process.poll() is None:  # one that was heard together with the first, as on a busy machine, is none
        process.send_signal(getattr(signal, name))
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(10.0)
    _, err = process.communicate()
    assert process.returncode == code
    assert err.count("\n") == 1 and "rank 3" in err and "came twice" in err and "<string>:11" in err


def test_signals_that_come_by_several_ways_are_one(hanging):
    process = hanging(grace=0.1, timeout=60.0, same=10.0)
    for _ in range(3):
        process.send_signal(signal.SIGTERM)
        time.sleep(0.02)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(1.0)


def test_signals_that_were_seen_together_are_one_and_the_next_one_counts(hanging):
    """As when a rank waits for its disk, and the system delivers what came meanwhile as one."""
    process = hanging(grace=0.1, timeout=60.0, same=0.3)
    process.send_signal(signal.SIGSTOP)
    for _ in range(2):
        process.send_signal(signal.SIGTERM)
        time.sleep(0.4)
    process.send_signal(signal.SIGCONT)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(1.0)
    process.send_signal(signal.SIGTERM)
    assert process.wait(PATIENCE) == EXIT_TERMINATED


def test_a_sigterm_that_is_not_answered_ends_it_too(hanging):
    process = hanging(grace=5.0, timeout=0.5)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 143 and "not answered for 0.5 s" in err


def test_the_other_requests_have_time(hanging):
    """SIGUSR1 comes minutes before the end of a job: there is no hurry."""
    process = hanging(grace=0.2, timeout=0.2)
    for _ in range(2):
        process.send_signal(signal.SIGUSR1)
        time.sleep(0.3)
    assert process.poll() is None


@pytest.fixture
def ended(monkeypatch) -> Iterator[tuple[StopRequests, list[int]]]:
    """Requests of this process, and the exit codes with which it would have been ended."""
    monkeypatch.setattr(watchdog, "SAME_SIGNAL", 0.1)
    monkeypatch.setattr("hpcdem.runtime.stop_requests.SAME_SIGNAL", 0.1)
    codes: list[int] = []
    others = signal.set_wakeup_fd(-1)  # those of a session that an earlier test left in this process
    stop = StopRequests().install()
    stop._watchdog._leave = codes.append
    stop._watchdog._timeout = 0.4
    stop._watchdog._grace = 0.3
    yield stop, codes
    stop.uninstall()
    signal.set_wakeup_fd(others)


def one_call(seconds: float, codes: list[int]) -> None:
    """Work of one function, until it would have been ended."""
    end = time.monotonic() + seconds
    while not codes and time.monotonic() < end:
        time.sleep(0.001)


def test_a_process_at_work_is_left_alone():
    """It is not for want of looking that the request has not been answered. Seconds are made up."""
    codes: list[int] = []
    dog = Watchdog(timeout=0.4, leave=codes.append)
    dog._receive("SIGTERM", 0.0)
    for second in range(1, 20):  # the main thread waits in a call of its own for each look
        looking = threading.Thread(target=dog._check, args=(float(second),))
        looking.start()
        looking.join()
    assert not codes


def test_a_process_within_one_call_is_not(ended):
    stop, codes = ended
    os.kill(os.getpid(), signal.SIGTERM)
    one_call(PATIENCE, codes)
    assert codes and set(codes) == {EXIT_TERMINATED}


def test_the_last_checkpoint_takes_as_long_as_it_needs(ended):
    stop, codes = ended
    os.kill(os.getpid(), signal.SIGTERM)
    assert stop.decide(stop.local_request()) == "stop"
    one_call(1.5, codes)
    assert not codes


def test_the_second_sigterm_interrupts_at_once_where_it_can(ended):
    _, codes = ended
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(0.2)
    with pytest.raises(KeyboardInterrupt) as caught:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(1.0)
    failure = describe(caught.value)
    assert failure.code == EXIT_TERMINATED and "second SIGTERM" in failure.text
    assert describe(KeyboardInterrupt()).code == EXIT_INTERRUPTED


def test_an_event_loop_that_listens_is_not_disturbed():
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    before = signal.set_wakeup_fd(writing)
    try:
        stop = StopRequests().install()
        stop.uninstall()
        assert signal.set_wakeup_fd(writing) == writing
    finally:
        signal.set_wakeup_fd(before)
        os.close(reading)
        os.close(writing)


def test_nothing_is_left_behind():
    """Threads of tests before this one may still be ending: only those begun here are looked at."""
    before = set(threading.enumerate())
    for _ in range(5):
        dog = Watchdog()
        dog.listen()
        assert set(threading.enumerate()) - before
        dog.close()
    until(lambda: set(threading.enumerate()) <= before, "the end of the threads")
    assert signal.set_wakeup_fd(-1) == -1

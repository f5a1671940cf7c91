"""The line before the maker: the newest request wins, slow work is ended, an end of the process is told."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.page import worker as module
from hpcdem.page.worker import SupersededError, Worker
from tests.conftest import PATIENCE, until

QUICK = {"number": 50, "shape": "circle", "placement": "cells"}
SLOW = {"number": 20_000, "shape": "triangle", "placement": "dense", "void_ratio": 0.1, "roundness": 0.0}
"""Minutes of work."""


@pytest.fixture
def workers() -> Iterator:
    made: list[Worker] = []

    def start(newest_wins: bool) -> Worker:
        made.append(Worker(newest_wins))
        return made[-1]

    yield start
    for worker in made:
        worker.close()


class Asking(threading.Thread):
    """A request in a thread of its own, as the server makes one."""

    def __init__(self, worker: Worker, request: dict) -> None:
        super().__init__()
        self.worker, self.request = worker, request
        self.answer: bytes | None = None
        self.error: BaseException | None = None
        self.start()

    def run(self) -> None:
        try:
            self.answer = self.worker.ask("specimen", self.request)
        except Exception as error:
            self.error = error

    def end(self, timeout: float = PATIENCE) -> Asking:
        self.join(timeout)
        assert not self.is_alive(), "still waiting"
        return self


def test_the_newest_request_ends_slow_work_and_takes_its_place(workers, wanted):
    worker = workers(newest_wins=True)
    worker.ask("specimen", wanted(**QUICK))  # kernels are there from now on
    first = worker.maker.process
    slow = Asking(worker, wanted(**SLOW))
    until(lambda: worker.began is not None)
    assert Asking(worker, wanted(**QUICK)).end().answer
    assert isinstance(slow.end().error, SupersededError)
    assert first.returncode == -signal.SIGKILL and worker.maker.process is not first


@pytest.mark.slow
def test_of_many_requests_only_the_newest_is_answered_besides_the_one_under_way(workers, wanted, monkeypatch):
    monkeypatch.setattr(module, "OVERTAKEN_AFTER", 3.0)
    worker = workers(newest_wins=True)
    worker.ask("specimen", wanted(**QUICK))
    slow = Asking(worker, wanted(**SLOW))
    until(lambda: worker.began is not None)
    late = []
    for k in range(10):
        late.append(Asking(worker, wanted(**QUICK, seed=k)))
        until(lambda k=k: worker.asked == 3 + k)
    assert all(isinstance(one.end().error, SupersededError) for one in [slow, *late[:-1]])
    assert late[-1].end().answer


@pytest.mark.slow
def test_files_are_made_one_after_the_other_and_only_so_many_wait(workers, wanted, monkeypatch):
    monkeypatch.setattr(module, "WAITING", 2)
    worker = workers(newest_wins=False)
    worker.ask("specimen", wanted(**QUICK))
    medium = wanted(number=10_000, shape="pentagon")  # about a second
    asked = [Asking(worker, medium)]
    until(lambda: worker.began is not None)
    for k in range(3):
        asked.append(Asking(worker, wanted(**QUICK, seed=k)))
        until(lambda k=k: worker.asked == 3 + k or asked[-1].error)
    errors = [one.end().error for one in asked]
    assert errors[:3] == [None, None, None] and "try again" in str(errors[3])


@pytest.mark.slow
def test_work_that_takes_too_long_is_ended_with_advice(workers, wanted):
    worker = workers(newest_wins=False)
    worker.ask("specimen", wanted(**QUICK))
    worker.longest = 1.0
    with pytest.raises(HpcdemError, match="not finished after 1 s: choose fewer grains"):
        worker.ask("specimen", wanted(**SLOW))
    worker.longest = 60.0
    assert worker.ask("specimen", wanted(**QUICK))


def test_a_process_that_dies_is_reported_and_replaced(workers, wanted):
    worker = workers(newest_wins=True)
    worker.ask("specimen", wanted(**QUICK))
    slow = Asking(worker, wanted(**SLOW))
    until(lambda: worker.began is not None)
    os.kill(worker.maker.process.pid, signal.SIGSEGV)
    assert "has ended: signal 11" in str(slow.end().error)
    assert worker.ask("specimen", wanted(**QUICK))
    os.kill(worker.maker.process.pid, signal.SIGKILL)  # while it waits
    worker.maker.process.wait()
    assert worker.ask("specimen", wanted(**QUICK))


def test_a_refusal_is_the_makers_sentence_and_the_process_stays(workers, wanted):
    worker = workers(newest_wins=True)
    with pytest.raises(HpcdemError, match=r"^table:1: 90 % finer"):
        worker.ask("specimen", wanted(rows=[["1", "90"]]))
    process = worker.maker.process
    with pytest.raises(HpcdemError, match="internal error: KeyError"):
        worker.ask("no such task", {})
    assert worker.ask("specimen", wanted(**QUICK)) and worker.maker.process is process


def test_what_the_maker_prints_does_not_get_between_the_answers(workers, wanted, monkeypatch):
    worker = workers(newest_wins=True)
    worker.start()
    links = Path(f"/proc/{worker.maker.process.pid}/fd")
    if not links.is_dir():
        pytest.skip("no /proc here")
    worker.ask("specimen", wanted(**QUICK))
    assert os.readlink(links / "1") == os.readlink(links / "2")


def test_the_process_leaves_when_its_server_does(workers, wanted):
    worker = workers(newest_wins=True)
    worker.ask("specimen", wanted(**QUICK))
    process = worker.maker.process
    process.stdin.close()  # what the system does when the server is killed
    assert process.wait(20) == 0


def test_after_the_end_requests_are_refused_and_no_process_is_left(workers, wanted):
    worker = workers(newest_wins=True)
    worker.ask("specimen", wanted(**QUICK))
    slow = Asking(worker, wanted(**SLOW))
    until(lambda: worker.began is not None)
    process = worker.maker.process
    worker.close()
    assert "the server is shutting down" in str(slow.end().error)
    assert process.returncode == -signal.SIGKILL
    with pytest.raises(HpcdemError, match="the server is shutting down"):
        worker.ask("specimen", wanted(**QUICK))

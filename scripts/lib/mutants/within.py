"""Many mutants in one process: as a plugin of pytest, which collects tests once and never runs them itself.

Kernels are plain functions here (plain.py), so a mutant is the byte code of one function: a fork puts it into the
function and runs the tests that call it, the most specific of each file first, up to the first that fails.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import select
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any

import pytest

from mutants.seeds import Mutant

LONGEST = 1.0
"""Processor seconds after which a test is too slow for mutants."""
CASES = 2
"""Cases of one parametrized test that are measured."""
MOST, OF_FILE = 24, 6.0
"""Tests of one file that are measured, and processor seconds after which no more of them are."""
ELSEWHERE = {"launch", "launch_once", "resident", "needs_mpi", "needs_petsc", "needs_parallel_hdf5", "slurm"}
"""Fixtures of tests that start other processes, in which nothing is changed."""
MARKS = ("slow", "alone", "ranks", "mpi", "petsc", "slurm", "figures")


class TooLong(BaseException):
    """A test has used up its processor time."""


def function_of(code: CodeType, root: str) -> str | None:
    """`hpcdem/io/dat.py::Frame.write` of its code, None for what is no function of the package. Lambdas and
    comprehensions are part of the function around them."""
    if not code.co_filename.startswith(root):
        return None
    return f"{code.co_filename[len(root) :]}::{code.co_qualname}" if code.co_name[0] != "<" else None


class Session:
    """The plugin. `work` is handed the collected tests, and decides what is run."""

    def __init__(self, root: Path, work: Callable[[Session], None]) -> None:
        self.root, self.work = f"{root}{os.sep}", work
        self.codes: set[CodeType] = set()
        self.items: dict[str, pytest.Item] = {}
        self.broken = self.why = ""
        self.known: dict[str, bool] = {}
        self._trace()

    def _trace(self) -> None:
        seen = self.codes.add

        def called(frame: FrameType, event: str, arg: object) -> None:
            seen(frame.f_code)

        threading.settrace(called)
        sys.settrace(called)

    def functions(self) -> set[str]:
        """Those of the package that were called since the last time."""
        codes, self.codes = self.codes, set()
        self._trace()
        return {name for name in (function_of(code, self.root) for code in codes) if name}

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        self.items = {item.nodeid: item for item in session.items}
        self.work(self)
        return True

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            crash = getattr(report.longrepr, "reprcrash", None)
            self.broken = self.broken or (crash.message if crash else str(report.longrepr)) or "failed"

    def run(self, item: pytest.Item, following: pytest.Item | None, seconds: float) -> str:
        """Run a test in this process: "passed", "failed" (too long is a failure) or "torn"."""
        self.broken = ""

        def stop(*_: object) -> None:
            raise TooLong

        signal.signal(signal.SIGPROF, stop)
        signal.setitimer(signal.ITIMER_PROF, seconds, 1.0)
        try:
            item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
        except BaseException:
            return "torn"  # what it was torn out of is in no state to go on
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        return "failed" if self.broken else "passed"

    # -- which functions each test calls

    def measurable(self) -> dict[str, list[pytest.Item]]:
        """Tests by file, of each only some of its cases."""
        cases: dict[str, list[pytest.Item]] = defaultdict(list)
        for item in self.items.values():
            if ELSEWHERE.isdisjoint(item.fixturenames) and not any(item.get_closest_marker(name) for name in MARKS):  # type: ignore[attr-defined]
                cases[item.nodeid.partition("[")[0]].append(item)
        files: dict[str, list[pytest.Item]] = defaultdict(list)
        for found in cases.values():
            step = max(1, len(found) // CASES)
            files[found[0].nodeid.partition("::")[0]] += found[::step][:CASES]
        return {file: found[:: -(-len(found) // MOST)] for file, found in files.items()}

    def measure(self, file: str, items: list[pytest.Item], wall: float) -> Iterator[dict[str, Any]]:
        """Of each test of a file its outcome, seconds and functions."""

        spent_before = 0.0

        def tests(tell: Callable[[dict[str, Any]], None]) -> None:
            self.functions()
            whole = spent_before
            for item, following in zip(items, [*items[1:], None]):
                if whole > OF_FILE:
                    break
                began = time.process_time()
                outcome = self.run(item, following, LONGEST)
                spent = round(time.process_time() - began, 3)
                whole += spent
                reach = sorted(self.functions())
                tell({"test": item.nodeid, "outcome": outcome, "seconds": spent, "reach": reach})
                if outcome == "torn":
                    break

        left = items
        while items := left:
            left, said = left[1:], None
            for said in forked(tests, wall):
                if said["outcome"] == "time":
                    break
                spent_before += said["seconds"]
                yield said
                left = items[[item.nodeid for item in items].index(said["test"]) + 1 :]
            if spent_before > OF_FILE:
                break
            if said and said["outcome"] not in ("torn", "time"):
                left = left[1:]  # the next one has ended the process, if there is one

    # -- mutants

    def sound(self, test: str, seconds: float) -> bool:
        """Whether a test passes by itself, without a mutant."""
        if test not in self.known:
            self.known[test] = not self._killer([], [(test, seconds)], 60.0)[0]
        return self.known[test]

    def judge(self, mutant: Mutant, text: str, tests: list[tuple[str, float]], wall: float) -> tuple[str, int]:
        """Run tests (name, expected seconds) with a mutant: which one kills it ("" if none, "time" if it hangs), and
        how many have passed. LookupError if the process does not know the function as it stands in the text."""
        changed = compile(mutant.applied(text), f"{self.root}{mutant.file}", "exec")
        places = []
        inner = mutant.function
        while inner:  # those that there are, and what the functions around them will make from now on
            code = code_of(changed, inner)
            living = self._living(f"{mutant.file}::{inner}")
            places += [
                (place, code) for place in living if code and len(code.co_freevars) == len(place.__code__.co_freevars)
            ]
            inner = inner.rpartition(".<locals>.")[0]
        if not places:
            raise LookupError(mutant.function)
        by, passed = self._killer(places, tests, wall)
        if by and by in self.items and not self.sound(by, dict(tests)[by]):
            return self.judge(mutant, text, [(test, spent) for test, spent in tests if test != by], wall)
        return by, passed

    def _killer(
        self, places: list[tuple[FunctionType, CodeType]], tests: list[tuple[str, float]], wall: float
    ) -> tuple[str, int]:
        """Which test fails first with other code in some functions, and how many have passed before it."""

        def trial(tell: Callable[[dict[str, Any]], None]) -> None:
            sys.settrace(None)
            threading.settrace(None)  # type: ignore[arg-type]
            for place, code in places:
                place.__code__ = code
            items = [self.items[test] for test, _ in tests]
            for (test, seconds), item, following in zip(tests, items, [*items[1:], None]):
                outcome = self.run(item, following, 4.0 * seconds + 1.0)
                tell({"test": test, "outcome": outcome, "why": self.broken[:200]})
                if outcome != "passed":
                    break

        passed = 0
        for said in forked(trial, wall):
            if said["outcome"] != "passed":
                self.why = said.get("why", "")
                return said["test"] or "time", passed
            passed += 1
        return ("" if passed == len(tests) else "end of process"), passed

    def _living(self, name: str) -> list[FunctionType]:
        """The functions of this name that there are: one, or as many as a factory has made."""
        functions = (thing for thing in gc.get_objects() if isinstance(thing, FunctionType))
        return [function for function in functions if function_of(function.__code__, self.root) == name]


def code_of(module: CodeType, function: str) -> CodeType | None:
    """The code of a function, by its qualified name; None if there are several."""
    found, left = [], [module]
    while left:
        code = left.pop()
        found += [code] if code.co_qualname == function else []
        left += [inner for inner in code.co_consts if isinstance(inner, CodeType)]
    return found[0] if len(found) == 1 else None


def forked(work: Callable[[Callable[[dict[str, Any]], None]], None], wall: float) -> Iterator[dict[str, Any]]:
    """What a copy of this process says in its work. It is ended if it takes longer than `wall` seconds; "time" then."""
    end, begin = os.pipe()
    folder = tempfile.mkdtemp(prefix="mutant-")
    child = os.fork()
    if not child:
        with contextlib.suppress(BaseException):
            os.setsid()
            os.close(end)
            os.environ["TMPDIR"] = tempfile.tempdir = folder
            nowhere = os.open(os.devnull, os.O_RDWR)
            for stream in (0, 1, 2):
                os.dup2(nowhere, stream)
            work(lambda said: _tell(begin, said))
        os._exit(0)
    os.close(begin)
    text, until = b"", time.monotonic() + wall
    try:
        while True:
            ready, _, _ = select.select([end], [], [], max(0.0, until - time.monotonic()))
            if not ready:
                yield {"test": "", "outcome": "time"}
                break
            data = os.read(end, 1 << 16)
            if not data:
                break
            *lines, text = (text + data).split(b"\n")
            yield from map(json.loads, lines)
    finally:
        os.close(end)
        for ended in (os.killpg, os.kill):  # with what it has started; itself, where it has no group yet
            with contextlib.suppress(ProcessLookupError):
                ended(child, signal.SIGKILL)
        os.waitpid(child, 0)
        shutil.rmtree(folder, ignore_errors=True)


def _tell(pipe: int, said: dict[str, Any]) -> None:
    data = json.dumps(said).encode() + b"\n"
    while data:
        data = data[os.write(pipe, data) :]

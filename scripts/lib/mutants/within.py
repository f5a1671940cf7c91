"""Many mutants in one process: as a plugin of pytest, which collects tests once and never runs them itself.

A mutant is the byte code of one function: a fork puts it into the function and runs the tests that call it, the most
specific of each file first, up to the first that fails. A function that Python calls while kernels are compiled is
changed in such a process, in which tests take their usual time; a kernel in a process of plain functions (plain.py).
"""

from __future__ import annotations

import base64
import contextlib
import gc
import json
import os
import pickle
import select
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any, cast

import pytest
from numba.core.dispatcher import Dispatcher

from hpcdem.runtime import kept
from mutants.seeds import Mutant


@dataclass(frozen=True)
class Pace:
    """longest: processor seconds after which a test is too slow for mutants; of_file: after which no more tests of a
    file are measured; loading: what a test may take longer than measured, as it is the first to load kernels."""

    longest: float
    of_file: float
    loading: float


PACES = {"plain": Pace(0.6, 8.0, 1.0), "compiled": Pace(2.5, 4.0, 6.0)}
CASES, MOST = 2, 60
"""Cases of one parametrized test, and tests of one file, that are measured."""
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

    def __init__(self, root: Path, work: Callable[[Session], None], pace: Pace) -> None:
        self.root, self.work, self.pace = f"{root}{os.sep}", work, pace
        self.made: dict[str, set[str]] = {}
        self.codes: set[CodeType] = set()
        self.items: dict[str, pytest.Item] = {}
        self.broken = self.why = ""
        self.known: dict[str, bool] = {}
        self.living: dict[str, list[FunctionType]] = {}
        self.kernels: dict[int, Any] = {}
        self.loaded: list[tuple[int, Any]] = []
        self._note_loads()
        self._trace()

    def _note_loads(self) -> None:
        """Write down which kernels this process takes from the store, and for which types of arguments."""
        usual, files = kept.Files.load_overload, cast(Any, kept.Files)

        def load_overload(of: Any, signature: Any, target: Any) -> Any:
            found = usual(of, signature, target)
            if found is not None:
                self.loaded.append((id(of), signature))
            return found

        files.load_overload = load_overload

    def _told_loads(self) -> dict[str, Any]:
        return {"outcome": "loaded", "kernels": base64.b64encode(pickle.dumps(self.loaded)).decode()}

    def _load(self, text: str) -> None:
        """Load the kernels that a fork had to load, for those to come: reading them is most of the time of a test. They
        are not run here, which would start threads."""
        for of, signature in pickle.loads(base64.b64decode(text)):
            if of in self.kernels:
                self.kernels[of].compile(signature)

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
        return self._named(codes)

    def _named(self, codes: set[CodeType]) -> set[str]:
        return {name for name in (function_of(code, self.root) for code in codes) if name}

    @pytest.hookimpl(hookwrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Iterator[None]:
        """What several tests share is made in the first of them; each would make it if it ran alone."""
        before = set(self.codes)
        self.codes.clear()
        yield
        if fixturedef.scope != "function":
            self.made[fixturedef.argname] = self._named(set(self.codes))
        self.codes |= before

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

    def measurable(self, seconds: dict[str, float]) -> dict[str, list[pytest.Item]]:
        """Tests by file, of each only some of its cases, the quickest first. seconds: of those that are known."""
        cases: dict[str, list[pytest.Item]] = defaultdict(list)
        for item in self.items.values():
            if ELSEWHERE.isdisjoint(item.fixturenames) and not any(item.get_closest_marker(name) for name in MARKS):  # type: ignore[attr-defined]
                cases[item.nodeid.partition("[")[0]].append(item)
        files: dict[str, list[pytest.Item]] = defaultdict(list)
        for found in cases.values():
            step = max(1, len(found) // CASES)
            files[found[0].nodeid.partition("::")[0]] += found[::step][:CASES]
        chosen = {file: found[:: -(-len(found) // MOST)] for file, found in files.items()}
        return {file: sorted(found, key=lambda item: seconds.get(item.nodeid, 0.0)) for file, found in chosen.items()}

    def measure(self, file: str, items: list[pytest.Item], wall: float) -> Iterator[dict[str, Any]]:
        """Of each test of a file its outcome, seconds and functions."""

        spent_before = 0.0

        def tests(tell: Callable[[dict[str, Any]], None]) -> None:
            self.functions()
            self.loaded.clear()
            whole = spent_before
            for item, following in zip(items, [*items[1:], None]):
                if whole > self.pace.of_file:
                    break
                began = time.process_time()
                outcome = self.run(item, following, self.pace.longest)
                spent = round(time.process_time() - began, 3)
                whole += spent
                reach = sorted(self.functions().union(*(self.made.get(name, ()) for name in item.fixturenames)))  # type: ignore[attr-defined]
                tell({"test": item.nodeid, "outcome": outcome, "seconds": spent, "reach": reach})
                if outcome == "torn":
                    break
            tell(self._told_loads())

        self._look()
        left = items
        while items := left:
            left, said = left[1:], None
            for heard in forked(tests, wall):
                if heard["outcome"] == "loaded":
                    self._load(heard["kernels"])
                    continue
                said = heard
                if said["outcome"] == "time":
                    break
                spent_before += said["seconds"]
                yield said
                left = items[[item.nodeid for item in items].index(said["test"]) + 1 :]
            if spent_before > self.pace.of_file:
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
        self._look()
        changed = compile(mutant.applied(text), f"{self.root}{mutant.file}", "exec")
        places = []
        inner = mutant.function
        while inner:  # those that there are, and what the functions around them will make from now on
            code = code_of(changed, inner)
            living = self.living.get(f"{mutant.file}::{inner}", [])
            places += [
                (place, code) for place in living if code and len(code.co_freevars) == len(place.__code__.co_freevars)
            ]
            inner = inner.rpartition(".<locals>.")[0]
        if not places:
            raise LookupError(mutant.function)
        by, passed = self._killer(places, tests, wall)
        if by in ("time", "end of process") and self._killer([], tests, wall)[0]:
            raise LookupError(by)  # without the mutant too
        if by and by in self.items and not self.sound(by, dict(tests)[by]):
            return self.judge(mutant, text, [(test, spent) for test, spent in tests if test != by], wall)
        return by, passed

    def _killer(
        self, places: list[tuple[FunctionType, CodeType]], tests: list[tuple[str, float]], wall: float
    ) -> tuple[str, int]:
        """Which test fails first with other code in some functions, and how many have passed before it."""

        self._look()

        def trial(tell: Callable[[dict[str, Any]], None]) -> None:
            self.loaded.clear()
            sys.settrace(None)
            threading.settrace(None)  # type: ignore[arg-type]
            for place, code in places:
                place.__code__ = code
            items = [self.items[test] for test, _ in tests]
            for (test, seconds), item, following in zip(tests, items, [*items[1:], None]):
                outcome = self.run(item, following, 4.0 * seconds + self.pace.loading)
                if outcome != "passed" or test == tests[-1][0]:
                    tell(self._told_loads())
                tell({"test": test, "outcome": outcome, "why": self.broken[:200]})
                if outcome != "passed":
                    break

        passed = 0
        for said in forked(trial, wall):
            if said["outcome"] == "loaded":
                self._load(said["kernels"])
            elif said["outcome"] == "passed":
                passed += 1
            else:
                self.why = said.get("why", "")
                return said["test"] or "time", passed
        return ("" if passed == len(tests) else "end of process"), passed

    def _look(self) -> None:
        """Find the functions of the package that there are, one of each name or as many as a factory has made, and the
        kernels; none comes later, as tests run in forks."""
        gc.unfreeze()  # what tests/conftest.py spares the collector
        for thing in [] if self.living else gc.get_objects():
            if isinstance(thing, FunctionType):
                self.living.setdefault(function_of(thing.__code__, self.root) or "", []).append(thing)
            elif isinstance(thing, Dispatcher):
                self.kernels[id(thing._cache)] = thing


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

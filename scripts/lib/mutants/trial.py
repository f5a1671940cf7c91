"""One mutant on trial: the tests that can notice it run in a copy of the tree, up to the first that fails."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from mutants.seeds import Mutant

PLAIN = {"NUMBA_DISABLE_JIT": "1", "NPY_PROMOTION_STATE": "weak"}
"""Environment of a process in which kernels are plain functions. The promotion is that of numpy 2, and of numba: an
unsigned index stays one."""
FAILED = "FAILED "
ERROR = "ERROR "


@dataclass
class Copy:
    """A copy of the tree in which one file at a time is changed, with compiled kernels of its own.

    kernels: the store that it begins with; files in a store are known by what they were compiled from, so a changed
    source only adds some.
    """

    root: Path
    place: Path
    kernels: Path | None = None
    sound: dict[str, bool] = field(default_factory=dict)

    def make(self) -> Copy:
        """Copy what git knows."""
        names = subprocess.run(["git", "ls-files", "-z"], cwd=self.root, capture_output=True, text=True, check=True)
        for name in filter(None, names.stdout.split("\0")):
            source, target = self.root / name, self.place / "tree" / name
            if source.is_file():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(source, target)
        shared = self.root.parent / "shared"
        if shared.is_dir() and not (self.place / "shared").exists():
            (self.place / "shared").symlink_to(shared)
        self.forget()
        return self

    def forget(self) -> None:
        """Drop the kernels of mutants."""
        store = self.place / "kernels"
        shutil.rmtree(store, ignore_errors=True)
        if self.kernels:
            shutil.copytree(self.kernels, store / self.kernels.name, copy_function=_link)
        else:
            store.mkdir(parents=True)

    def pytest(self, words: list[str], limit: float, plain: bool = False) -> tuple[int | None, str]:
        """Exit code, None if the limit [s] was reached, and output. plain: kernels are not compiled."""
        tree = self.place / "tree"
        paths = [str(tree)]
        env = os.environ | {"PYTHONPATH": os.pathsep.join(paths), "NUMBA_CACHE_DIR": str(self.place / "kernels")}
        env.pop("HPCDEM_TEST_RESULTS", None)
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "--no-header", *words]
        if plain:
            env |= PLAIN | {"PYTHONPATH": os.pathsep.join([*paths, str(Path(__file__).parents[1])])}
            command = [sys.executable, "-m", "mutants.plain", *command[3:]]
        process = subprocess.Popen(
            command,
            cwd=tree,
            env=env,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        try:
            out, _ = process.communicate(timeout=limit)
            return process.returncode, out
        except subprocess.TimeoutExpired:
            return None, ""
        finally:
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            process.wait()

    def fresh(self, mutant: Mutant, tests: list[str], limit: float) -> str:
        """The test that kills a mutant, "time" or "start"; "" if none. For what imports call."""
        file = self.place / "tree" / mutant.file
        text = file.read_text(encoding="utf-8")
        _write(file, mutant.applied(text))
        try:
            return _killer(*self.pytest(tests, limit, plain=True))
        finally:
            _write(file, text)

    def is_sound(self, test: str, limit: float) -> bool:
        """Whether a test passes without any change."""
        if test not in self.sound:
            self.sound[test] = self.pytest([test], limit)[0] == 0
        return self.sound[test]


def _killer(code: int | None, out: str) -> str:
    """Which test has failed in a run of pytest, "time" or "start"; "" if none has."""
    if code in (None, 0, 5):
        return "time" if code is None else ""
    lines = [line for line in out.splitlines() if line.startswith((FAILED, ERROR))]
    return lines[-1].partition(" ")[2].partition(" - ")[0] if lines else "start"


def _write(file: Path, text: str) -> None:
    """Python knows a compiled module by the second and the size of its source: each version is a second younger."""
    younger = file.stat().st_mtime + 1.0
    file.write_text(text, encoding="utf-8")
    os.utime(file, (younger, younger))


def _link(source: str, target: str) -> None:
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


def judge(copy: Copy, mutant: Mutant, seconds: float) -> dict[str, object]:
    """A record of the trial: what became of the mutant ("killed", "survived", "untested") and by which test.

    seconds: time of tests, as measured before, that it is given; a mutant that takes four times as long has hung.
    """
    from tests import suite

    began = time.monotonic()
    file = copy.place / "tree" / mutant.file
    text = file.read_text(encoding="utf-8")
    tests, left = suite.within(suite.tests_of([mutant.file]), seconds)
    record: dict[str, object] = {"mutant": mutant.name, "file": mutant.file, "kind": mutant.kind}
    record |= {"tests": len(tests), "left": len(left)}
    if not tests:
        return record | {"outcome": "untested", "by": "", "seconds": 0.0}
    _write(file, mutant.applied(text))
    try:
        code, out = copy.pytest(["-m", "not slow and not alone", *tests], 4 * seconds + 60)
    finally:
        _write(file, text)
    by = _killer(code, out)
    if "::" in by and not copy.is_sound(by, 4 * seconds + 60):
        by = ""  # it fails without the change too
        record["unsound"] = True
    copy.forget()
    return record | {"outcome": "killed" if by else "survived", "by": by, "seconds": round(time.monotonic() - began, 1)}
